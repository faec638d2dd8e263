"""Faint patches: weights, what is kept, what is counted."""

from dataclasses import fields, replace

import numpy as np
import pytest
from law_settings import wear_settings

from wearsim.campaign.comparison import ComparisonLaws
from wearsim.campaign.control import half_space_depth_limit
from wearsim.campaign.evaluate import Setup, accumulate, passage_of
from wearsim.campaign.faint import lost_row, weight_of
from wearsim.contact.solve import ContactModels

FAINT = 1e-3


def test_weight_is_smooth_and_whole_from_one_share_on():
    """Continuous with its derivative by the logarithm of a share; 0 up to a tenth of the limit."""
    step = 1e-4
    log = np.arange(-5.0, -2.0, step)
    for others in (0.0, 3e-4):
        share = np.stack([10.0**log, np.full(log.size, others), np.zeros(log.size)])
        weight = weight_of(share)
        slope = np.diff(weight) / step
        assert np.all(slope >= 0.0)
        assert slope.max() < 1.6  # of 3 t^2 - 2 t^3: 1.5
        assert np.abs(np.diff(slope)).max() < 10.0 * step  # its second derivative is at most 6
        assert np.all(weight[share[0] >= FAINT] == 1.0)
        assert np.all((weight[log < -4.0] > 0.0) == (others > 0.0))
    assert np.all(weight_of(np.diag([FAINT] * 3)) == 1.0)


@pytest.fixture
def shares():
    """Load, power and work density of three patches on each wheel, the second and third fainter ones."""
    return np.array([[1.0, 4e-4, 2e-5], [1.0, 3e-4, 5e-5], [1.0, 5e-4, 1e-5]])


@pytest.fixture
def wheels(made_solution, shares):
    """Patches of both wheels at two points, alike but for the signs of the left wheel."""
    load, power, work = np.tile(shares, 4)
    solution = made_solution(
        np.repeat([0, 1], 6), np.tile(np.repeat([0, 1], 3), 2), np.tile([0.0, 0.02, -0.02], 4),
        np.full(12, 5e-3), 4e6 * work,
    )  # fmt: skip
    sign = 1.0 - 2.0 * solution.side
    return replace(
        solution, normal_force=80e3 * load, power=500.0 * power, force_x=2e3 * power, force_y=sign * power
    )


def setup_of(wheelset, law="usfd"):
    return Setup(wheelset, None, None, wear_settings(law))


def test_load_is_kept_and_the_rest_counted(wheels, made_points, wheelset, shares):
    passage = passage_of(wheels, setup_of(wheelset))
    contact = passage.contact
    assert contact.point.tolist() == np.repeat([0, 1], 4).tolist()  # the third patches have vanished
    load = contact.normal_force.reshape(4, 2)
    whole = 80e3 * shares[0].sum()
    np.testing.assert_allclose(load.sum(axis=1), whole, rtol=1e-15)
    share = shares / shares.sum(axis=1)[:, None]
    weight = weight_of(share)
    np.testing.assert_allclose(passage.weight, np.tile(weight[:2], 4), rtol=1e-14)
    assert 0.9 < weight[1] < 1.0
    factor = shares[0].sum() / (weight * shares[0]).sum()
    np.testing.assert_allclose(contact.power[:2], 500.0 * factor * (weight * shares[1])[:2], rtol=1e-14)
    row = lost_row(passage, made_points([0.3, 0.7], environment=[0.5, 1.0]), np.array([0.3, 0.7]))
    for name, lost in zip(("load", "power", "wear"), ((1.0 - weight) * share).sum(axis=1), strict=True):
        assert row[f"faint_{name}"] == pytest.approx(lost, rel=1e-12), name
        assert row[f"faint_{name}_max"] == pytest.approx(lost, rel=1e-12), name


@pytest.mark.parametrize(
    ("quantity", "kept"), [("power", "power"), ("normal_force", "load"), ("work", "wear")]
)
def test_a_patch_stays_that_counts_in_one_way(wheels, wheelset, quantity, kept):
    """A share of 0.2 % of load, power or wear is enough: the patch acts in full."""
    third = np.tile([1.0, 1.0, 300.0], 4)
    if quantity == "work":
        fields = replace(wheels.fields, work_density=wheels.fields.work_density * third[:, None, None])
        wheels = replace(wheels, fields=fields)
    else:
        wheels = replace(wheels, **{quantity: third * getattr(wheels, quantity)})
    passage = passage_of(wheels, setup_of(wheelset))
    assert np.all(passage.weight[2::3] == 1.0), kept
    assert passage.weight.size == 12


def test_wear_by_a_comparison_law_counts_for_that_law_alone(wheels, made_points, state, wheelset):
    """The third patch wears by the comparison law alone, three times as much as the first one."""
    work = wheels.fields.work_density * np.tile([1.0, 1.0, 3e5], 4)[:, None, None]
    wheels = replace(wheels, fields=replace(wheels.fields, work_density=work))
    energy, alone = wear_settings("energy"), setup_of(wheelset, "none")
    both = replace(alone, comparison=ComparisonLaws((energy,)))
    one, other = (passage_of(wheels, setup) for setup in (alone, both))
    full, (depth,) = passage_of(wheels, setup_of(wheelset, "energy")), other.comparison.depth
    assert (one.weight.size, other.weight.size) == (8, 12)
    for of_regime, expected in zip(depth, full.depth, strict=True):
        np.testing.assert_array_equal(of_regime[2::3], expected[2::3])
    assert sum(each[2].sum() for each in depth) > 2.0 * sum(each[0].sum() for each in depth)
    here = other.weight > 0.0
    np.testing.assert_array_equal(other.contact.normal_force[here], one.contact.normal_force)
    np.testing.assert_array_equal(other.lost[here], one.lost)
    points, weight = made_points([0.5, 0.5]), np.full(2, 0.5)
    work = [accumulate(each, points, weight, state, alone).friction_work for each in (one, other)]
    np.testing.assert_array_equal(*work)


def test_wheels_changed_over_fade_changed_over(wheels, made_points, state, wheelset):
    """Mirror symmetry, to the last bit: a wheel does not know of the others in the batch."""
    passage = passage_of(wheels, setup_of(wheelset))
    right, left = (
        {f.name: getattr(passage.contact, f.name)[passage.contact.side == k] for f in fields(passage.contact)
         if isinstance(getattr(passage.contact, f.name), np.ndarray) and f.name != "side"}
        for k in (0, 1)
    )  # fmt: skip
    for name in right:
        sign = -1.0 if name == "force_y" else 1.0
        np.testing.assert_array_equal(right[name], sign * left[name], err_msg=name)
    rate = accumulate(passage, made_points([0.5, 0.5]), np.full(2, 0.5), state, setup_of(wheelset))
    assert rate.depth.any()
    np.testing.assert_allclose(rate.depth[0], rate.depth[1], rtol=1e-12)


def test_without_friction_and_without_a_law_the_load_decides(wheels, wheelset):
    still = replace(wheels, power=0.0 * wheels.power)
    weight = passage_of(still, setup_of(wheelset, "none")).weight
    load = wheels.normal_force[:3] / wheels.normal_force[:3].sum()
    np.testing.assert_array_equal(weight, np.tile(weight_of(np.array([load]))[:2], 4))


def test_a_faint_patch_does_not_hold_up_the_step(wheels, made_points, state, wheelset):
    """Flat or soft as it may be: neither by its interpenetration nor by its pressure."""
    points, weight = made_points([0.5, 0.5]), np.full(2, 0.5)
    whole = np.where(np.tile([1.0, 0.0, 0.0], 4) > 0.0, 1.0, 1e-3)
    flat = replace(wheels.patch, interpenetration=wheels.patch.interpenetration * whole[:, None])

    def rate(solution):
        return accumulate(passage_of(solution, setup_of(wheelset)), points, weight, state, setup_of(wheelset))

    result = rate(replace(wheels, patch=flat))
    # the first patch reaches 5 mm to each side
    assert not result.stability[:, np.abs(state.y[0]) > 6e-3].any()
    assert result.stability.any()
    none = replace(wheels.patch, interpenetration=0.0 * wheels.patch.interpenetration)
    result = rate(replace(wheels, patch=none, max_pressure=1e9 * whole))
    limit = half_space_depth_limit(result, weight, ContactModels.of("fast"), 1e-4)
    assert limit == pytest.approx(1e9 / ContactModels.of("fast").effective_modulus * 1e-4)
