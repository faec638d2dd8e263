"""Comparison laws: on the same contacts, along the same campaign, changing no
profile.
"""

import shutil
from dataclasses import replace

import netCDF4
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stepping import step_over

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import run_evolution
from wearsim.campaign.state import State, WearRate
from wearsim.campaign.step import StepRule
from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.errors import ResultError
from wearsim.profile.shape import vertex_lengths
from wearsim.report.sources import laws
from wearsim.report.tables_damage import wear_laws
from wearsim.results import GROUPS, LAYOUT, layout_of, load_results, open_results

FATIGUE = f"""
[fatigue]
laws = {sorted(FATIGUE_LAWS)}
branch = "rising"
crack_depth_mm = 2
""".replace("'", '"')
COMPARISON = '[wear]\nalso_evaluate = ["archard", "energy", "brr", "none"]\n'


@pytest.fixture(scope="module")
def evolution(two_blocks):
    """Function that gives a short, coarse campaign with some laws, under an environment
    factor of 0.5.
    """

    def made(damage="", campaign="", mirrored=False):
        return two_blocks(
            mirrored=mirrored,
            environment=0.5,
            contact="strips = 10\ncells = 10",
            campaign=f"distance_km = 12\npoint_spacing_mm = 0.5\n{campaign}",
            more=damage,
        )

    return made


@pytest.fixture(scope="module")
def last(evolution, states_of):
    """Last state of the campaign with all laws."""
    return states_of(evolution(COMPARISON + FATIGUE))[-1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory, evolution):
    """Its result file."""
    folder = tmp_path_factory.mktemp("whole")
    return run_evolution(evolution(COMPARISON + FATIGUE), folder, "rig")


@pytest.mark.parametrize("integrator", ["euler", "rkc"])
def test_comparison_law_equal_to_the_active_one_has_its_bits(
    integrator, evolution, states_of
):
    of = evolution(COMPARISON, f'integrator = "{integrator}"')
    laws = (*of.setup.also_evaluate, of.setup.wear)
    of = WheelsetEvolution(replace(of.setup, also_evaluate=laws), threads=1)
    last = states_of(of)[-1]
    np.testing.assert_array_equal(last.comparison_depth[-1], last.wear_depth)
    regimes = last.regime_depth.shape[1]
    np.testing.assert_allclose(
        last.comparison_area[:, -regimes:].sum(axis=1), last.worn_area, rtol=1e-12
    )


def test_both_forms_of_a_law_stand_side_by_side(tmp_path, evolution):
    """Local is active, the mean of the patch compared: other depths, other names."""
    forms = (
        '[wear]\nlaw = "energy"\nalso_evaluate = [{law = "energy", form = '
        '"patch_mean"}, "usfd"]\n'
    )
    path = run_evolution(evolution(forms), tmp_path, "rig")
    with open_results(path) as data:
        assert list(data["comparison_name"].values) == ["energy (patch mean)", "usfd"]
        names = [str(name) for name in data["comparison_regime_name"].values]
        assert names[:3] == [
            "energy (patch mean): mild",
            "energy (patch mean): severe",
            "usfd: mild",
        ]
        mean, local = (
            data["comparison_wear_depth"].values[-1, :, 0],
            data["wear_depth"].values[-1],
        )
        assert mean.max() > 0.0
        assert abs(mean.max() / local.max() - 1.0) > 1e-5
        area = data["comparison_worn_area"].values[-1][:, :2].sum()
        table = wear_laws(data)[0]
        assert table.frame["Wear law"].tolist() == [
            "energy, active",
            "energy (patch mean)",
            "USFD",
        ]
        assert table.frame.iloc[1, 3] == pytest.approx(
            area / data["worn_area"].values[-1].sum(), rel=1e-12
        )
        assert laws([data]).frame["Form"].tolist() == ["local", "patch mean", "local"]


def test_comparison_laws_and_fatigue_change_no_bit_of_the_wear(
    evolution, states_of, last
):
    alone = states_of(evolution())[-1]
    for name in (
        "distance",
        "y",
        "z",
        "wear_depth",
        "regime_depth",
        "worn_area",
        "worn_mass",
        "point_error",
    ):
        np.testing.assert_array_equal(
            getattr(last, name), getattr(alone, name), err_msg=name
        )
    deepest = [depth.max() for depth in last.comparison_depth]
    assert deepest[-1] == 0.0  # the law "none"
    assert min(deepest[:-1]) > 0.0
    assert len(set(deepest)) == len(deepest)


def test_active_law_without_wear_has_comparison_laws(evolution, states_of):
    """The profile stays new, and the comparison law grows with the distance."""
    states = states_of(
        evolution('[wear]\nlaw = "none"\nalso_evaluate = ["usfd"]\n' + FATIGUE)
    )
    last = states[-1]
    np.testing.assert_array_equal(last.z, states[0].z)
    assert last.worn_area.max() == 0.0
    assert last.comparison_depth[0].max() > 1e-6


def test_mirrored_scene_gives_mirrored_damage(evolution, states_of, last):
    """Right and left change places; 1e-9 of the largest of each law."""
    other = states_of(evolution(COMPARISON + FATIGUE, mirrored=True))[-1]
    for name in ("comparison_depth", "fatigue_damage"):
        for here, there in zip(getattr(last, name), getattr(other, name), strict=True):
            np.testing.assert_allclose(
                there[::-1], here, rtol=0, atol=1e-9 * here.max()
            )
    assert all(damage.max() > 0.0 for damage in last.fatigue_damage)
    np.testing.assert_allclose(
        other.comparison_area[::-1], last.comparison_area, rtol=1e-9, atol=1e-18
    )


def test_damage_of_an_unworn_wheel_grows_linearly(evolution, states_of):
    """Rate of the new wheel times distance: only rounding lies between them."""
    of = evolution('[wear]\nlaw = "none"\n' + FATIGUE)
    start, _ = of.start()
    rates = of.evaluate(start).collective.fatigue
    last = states_of(of)[-1]
    for rate, damage in zip(rates, last.fatigue_damage, strict=True):
        np.testing.assert_allclose(damage, rate * last.distance, rtol=1e-12)


@pytest.mark.slow
@given(
    parts=st.lists(st.floats(1.0, 1e5), min_size=1, max_size=6),
    depth=st.sampled_from([np.inf, 1e-3]),
)
def test_damage_of_constant_rates_knows_no_steps(parts, depth):
    """Damage grows, or wear removes it, at their rates, however the distance is cut;
    rounding only.
    """
    y = np.tile(np.linspace(-0.03, 0.03, 40), (2, 1))
    z, nothing = -0.05 * y, np.zeros_like(y)
    worn = np.zeros((2, 1, 40))
    worn[:, 0, 10:20] = 1e-12
    damage = np.linspace(-1e-9, 3e-9, 40) * np.ones((2, 1))
    state = State(
        0,
        0.0,
        y,
        z,
        nothing,
        np.zeros((2, 1, 40)),
        np.zeros(2),
        np.zeros(2),
        fatigue_damage=(nothing,),
    )
    rate = WearRate(
        worn[:, 0], worn, nothing, nothing, nothing, None, fatigue=(damage,)
    )
    rule = StepRule(
        0.46, 7850.0, smoothing_wavelength=0.0, integrator="euler", crack_depth=(depth,)
    )
    for part in parts:
        state = step_over(state, rate, part, rule, lambda _: rate).state
    expected = np.maximum((damage - worn[:, 0] / depth) * sum(parts), 0.0)
    np.testing.assert_allclose(
        state.fatigue_damage[0], expected, rtol=1e-9, atol=1e-18 * sum(parts)
    )


def test_wear_removes_cracks_of_a_stated_depth_only(evolution, states_of, last):
    """A shallow crack is worn away faster; laws without crack depth keep all they
    had.
    """
    shallow = FATIGUE.replace("crack_depth_mm = 2", "crack_depth_mm = 0.05")
    flat = states_of(evolution(shallow))[-1]
    names = sorted(FATIGUE_LAWS)
    for name, one, other in zip(
        names, last.fatigue_damage, flat.fatigue_damage, strict=True
    ):
        if name == "wlrm":
            assert (other <= one).all()
            assert other.sum() < 0.9 * one.sum()
        else:
            np.testing.assert_array_equal(one, other)


def test_damage_of_patches_is_kept_on_the_profile(evolution):
    """Sum over rings and lengths against the sum over patches: 1e-12 of it (carried,
    not sampled).
    """
    of = evolution(FATIGUE)
    state, _ = of.start()
    result = of.evaluate(state)
    setup, solution = of.setup, result.collective.solution
    for k, law in enumerate(setup.fatigue):
        strips = result.passage.comparison.damage[k] / law.crack_width
        by_patch = (strips.sum(axis=1) * solution.patch.width) * setup.points.weight[
            solution.point
        ]
        assert by_patch.sum() > 0.0
        for wheel in (0, 1):
            ring = 2.0 * np.pi * (setup.wheelset.radius + state.z[wheel])
            length = vertex_lengths(state.y[wheel], state.z[wheel])
            on_profile = (
                result.collective.fatigue[k][wheel] * ring * length
            ).sum() / law.crack_width
            here = by_patch[solution.side == wheel].sum()
            assert on_profile == pytest.approx(here, rel=1e-12, abs=1e-15)


def test_environment_factor_acts_on_wear_not_on_damage(evolution):
    of = evolution(COMPARISON + FATIGUE)
    dry = replace(of.setup, points=replace(of.setup.points, environment=np.ones(2)))
    state, _ = of.start()
    half, full = (
        WheelsetEvolution(one, threads=1).evaluate(state).collective
        for one in (of.setup, dry)
    )
    for one, other in zip(half.comparison, full.comparison, strict=True):
        np.testing.assert_allclose(2.0 * one, other, rtol=1e-12)
    for one, other in zip(half.fatigue, full.fatigue, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("step", [pytest.param(0, marks=pytest.mark.slow), 2])
def test_resumed_campaign_has_the_same_bits(
    tmp_path, step, evolution, whole, stopped_at
):
    of = evolution(COMPARISON + FATIGUE)
    with stopped_at(step) as stop:
        run_evolution(of, tmp_path, "rig", stop)
    cut = run_evolution(of, tmp_path, "rig")
    with netCDF4.Dataset(whole) as one, netCDF4.Dataset(cut) as other:
        names = layout_of(one.variables)
        groups = (
            name
            for group in ("comparison", "fatigue", "running", "left_out", "zone")
            for name in GROUPS[group]
        )
        assert (
            set(names) == {*LAYOUT, *groups} == set(one.variables) - {"step", "point"}
        )
        for file in (one, other):
            file.set_auto_maskandscale(False)
        for name in names:
            assert np.array_equal(one[name][:], other[name][:]), name


def test_result_file_holds_the_laws(whole):
    with open_results(whole) as data:
        assert list(data["comparison_name"].values) == [
            "archard",
            "energy",
            "brr",
            "none",
        ]
        assert list(data["fatigue_name"].values) == sorted(FATIGUE_LAWS)
        has_depth = data["fatigue_name"].values == "wlrm"
        np.testing.assert_array_equal(
            np.isfinite(data["fatigue_crack_depth"].values), has_depth
        )
        balanced = data["magic_wear_rate"].values
        assert np.isfinite(balanced[:, :, has_depth]).all()
        assert np.isnan(balanced[:, :, ~has_depth]).all()
        rate = data["fatigue_damage_rate"].values[:, :, has_depth]
        np.testing.assert_allclose(balanced[:, :, has_depth], rate * 2e-3, rtol=1e-15)
        np.testing.assert_allclose(
            data["wear_number_with_spin"], data["power"] / data["speed"], rtol=1e-9
        )
        low = np.abs(data["force_x"] * data["creepage_x"]) + np.abs(
            data["force_y"] * data["creepage_y"]
        )
        np.testing.assert_allclose(data["wear_number_without_spin"], low, rtol=1e-12)


def test_wear_numbers_of_patches_are_stored_without_fatigue_laws(tmp_path, evolution):
    path = run_evolution(evolution(""), tmp_path, "rig")
    with open_results(path) as data:
        assert "fatigue_name" not in data
        power = data["power"].values / data["speed"].values[:, None]
        np.testing.assert_allclose(data["wear_number_with_spin"], power, rtol=1e-9)
        assert (data["wear_number_without_spin"] > 0.0).any()


def test_file_with_half_a_group_is_refused(tmp_path, whole):
    path = shutil.copy(whole, tmp_path / "rig.nc")
    with netCDF4.Dataset(path, "a") as file:
        file.renameVariable("comparison_wear_depth", "comparison_wear")
    with pytest.raises(ResultError, match="not a result file"):
        load_results(path)


@pytest.mark.cf
def test_compliance_checker_finds_nothing(tmp_path, assert_cf, evolution):
    of = replace(evolution(COMPARISON + FATIGUE), command="wearsim run rig.toml")
    assert_cf(run_evolution(of, tmp_path, "rig"))
