"""Contact models that differ from operating point to operating point."""

import re
from dataclasses import is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign import control
from wearsim.campaign.comparison import comparison_laws
from wearsim.campaign.evaluate import ModelsByPoint, accumulate, passage_of, rate, setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.contact.solve import CHUNK, solve
from wearsim.damage.wear import WEAR_LAWS, WearSettings
from wearsim.errors import ContactError
from wearsim.operation.points import select
from wearsim.scene import build, load_scene

# the law of tables needs one; its sums are those of the law by cells
COEFFICIENTS = {
    "usfd": "lewis_dwyer_joyce_2004",
    "archard": "jendel_2002",
    "brr": "pearce_sherratt_1991",
    "energy": "krause_poll_1986",
}


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """The shipped rig with a fatigue law."""
    text = Path("workflows/rig_by_shift.toml").read_text()
    scene = tmp_path_factory.mktemp("by_point") / "rig.toml"
    scene.write_text(
        re.sub(r"\n\[campaign\]", '\n[fatigue]\nlaws = ["surface_fatigue_index"]\n\n[campaign]', text)
    )
    return build(load_scene(scene))


@pytest.fixture(scope="module")
def state(rig):
    return WheelsetEvolution(rig).start()[0]


@pytest.fixture(scope="module")
def mixed(rig):
    """Virtual penetration on 8 x 12 and a half-space on 14 x 14 for every other point."""
    coarse = replace(rig.models, strips=8, cells=12)
    fine = replace(rig.models, normal="half_space", strips=14, cells=14)
    return ModelsByPoint((coarse, fine), np.arange(len(rig.points.label)) % 2)


def solved(rig, state, points, models):
    return solve_passage(state, points, replace(setup_of(rig), models=models))


def test_the_same_models_for_all_have_the_bits_of_one(rig, state):
    """In one group, and in two that are solved apart."""
    one = solved(rig, state, rig.points, rig.models)
    count = len(rig.points.label)
    for place in (np.zeros(count, dtype=int), np.arange(count) % 2):
        again = solved(rig, state, rig.points, ModelsByPoint((rig.models, rig.models), place))
        for name in ("point", "power", "strip_edges_wheel_y"):
            np.testing.assert_array_equal(getattr(again.contact, name), getattr(one.contact, name))
        for name in ("strip_work", "work_density_max", "depth"):
            np.testing.assert_array_equal(getattr(again, name), getattr(one, name))


def test_patches_of_all_points_stand_in_their_order(rig, state, mixed):
    passage = solved(rig, state, rig.points, mixed)
    whole = passage.contact
    assert np.all(np.diff(whole.point) >= 0)
    for k, one in enumerate(mixed.models):
        index = np.flatnonzero(mixed.place == k)
        apart = solved(rig, state, select(rig.points, index), one)
        alone, strips = apart.contact, apart.strip_work.shape[1]
        there = np.isin(whole.point, index)
        np.testing.assert_array_equal(whole.power[there], alone.power)
        np.testing.assert_array_equal(whole.point[there], index[alone.point])
        np.testing.assert_array_equal(whole.patch.width[there], alone.patch.width)
        # strips without width do no work
        np.testing.assert_array_equal(passage.strip_work[there][:, :strips], apart.strip_work)
        assert not passage.strip_work[there][:, strips:].any()
        assert not np.diff(whole.strip_edges_wheel_y[there][:, strips:]).any()


def arrays_of(passage):
    """All arrays of a passage, one after the other."""
    values = vars(passage).values() if is_dataclass(passage) else passage
    values = passage.values() if isinstance(passage, dict) else values
    for value in values:
        yield from [value] if isinstance(value, np.ndarray) else () if value is None else arrays_of(value)


def test_laws_on_the_threads_have_the_bits_of_laws_on_the_whole_solution(rig, state):
    """More than one chunk, wear and fatigue laws, any number of threads."""
    points = select(rig.points, np.arange(CHUNK + 20) % len(rig.points.label))
    further = tuple(WearSettings(law=law, coefficients=name) for law, name in list(COEFFICIENTS.items())[:2])
    setup = replace(setup_of(rig), comparison=replace(comparison_laws(rig), wear=further))
    one, two = (list(arrays_of(solve_passage(state, points, replace(setup, threads=k)))) for k in (1, 2))
    whole = passage_of(solve(points.conditions, rig.wheelset, rig.counterface, rig.models), setup)
    assert len(one) > 40
    for a, b, c in zip(one, two, arrays_of(whole), strict=True):
        assert a.tobytes() == b.tobytes() == c.tobytes()


@pytest.mark.parametrize("law", sorted(COEFFICIENTS))
def test_wear_and_fatigue_are_the_sums_of_those_solved_apart(rig, state, mixed, law):
    wear = WearSettings(law=law, coefficients=COEFFICIENTS[law], form=WEAR_LAWS[law].forms[0])
    setup = replace(setup_of(rig), wear=wear)

    def accumulated(points, models):
        own = replace(setup, models=models)
        return accumulate(solve_passage(state, points, own), points, points.weight, state, own)

    whole = accumulated(rig.points, mixed)
    parts = [accumulated(select(rig.points, index), one) for one, index in mixed.groups()]
    for name in ("regime_depth", "friction_work", "stability"):
        total = sum(getattr(part, name) for part in parts)
        np.testing.assert_allclose(
            getattr(whole, name), total, rtol=1e-11, atol=1e-14 * total.max(), err_msg=name
        )
    total = sum(part.fatigue[0] for part in parts)
    assert total.max() > 0.0
    np.testing.assert_allclose(whole.fatigue[0], total, rtol=1e-11, atol=1e-14 * total.max())


def test_points_without_weight_are_left_out(rig, state, mixed):
    weight = rig.points.weight.copy()
    weight[0] = 0.0
    result = rate(state, rig.points, weight, replace(setup_of(rig), models=mixed))
    whole = accumulate(solved(rig, state, rig.points, mixed), rig.points, weight, state, setup_of(rig))
    np.testing.assert_allclose(result.depth, whole.depth, rtol=1e-11, atol=1e-14 * whole.depth.max())


def test_the_half_space_points_alone_bound_a_step_by_their_pressure(rig, state, mixed):
    """Virtual penetration is bounded by its stability number, also beside a half-space."""
    weight = rig.points.weight
    result = rate(state, rig.points, weight, replace(setup_of(rig), models=mixed))
    limit = control.half_space_depth_limit(result, weight, rig.models, 1e-4, 2e-3)
    mine = np.isin(result.solution.point, np.flatnonzero(mixed.place == 1))
    modulus = rig.models.youngs_modulus / (2.0 * (1.0 - rig.models.poisson_ratio**2))
    assert limit == pytest.approx(result.solution.max_pressure[mine].min() / modulus * 1e-3, rel=1e-12)


def test_a_refusal_names_its_point_of_the_collective(rig, state):
    """Ellipses of two contacts overlap at zero shift of the new profiles (reports/speed_accuracy.md)."""
    central = int(np.argmin(np.abs(rig.points.conditions.shift)))
    assert central > 0
    place = np.zeros(len(rig.points.label), dtype=int)
    place[[central, -1]] = 1
    models = ModelsByPoint((rig.models, replace(rig.models, normal="hertz")), place)
    with pytest.raises(ContactError, match="no contact ellipse") as fault:
        solved(rig, replace(state, points=None), rig.points, models)
    assert fault.value.row in (central, len(place) - 1)
    assert str(fault.value).startswith(f"point {fault.value.row}, ")
    # of a campaign, that leaves such points out
    failed = solved(rig, state, rig.points, models).failed
    assert central in failed
    assert all(place[k] == 1 and str(error).startswith(f"point {k}, ") for k, error in failed.items())
