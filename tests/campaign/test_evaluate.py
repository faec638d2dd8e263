from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign import evaluate as rate_module
from wearsim.campaign import evolution as evolution_module
from wearsim.campaign.control import reached
from wearsim.campaign.evaluate import (
    Setup,
    accumulate,
    passage_of,
    patch_wear,
    rate,
    solve_passage,
)
from wearsim.campaign.passage import shared
from wearsim.contact.solve import ContactModels, Counterface
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.operation.points import select
from wearsim.profile.shape import vertex_lengths

WEAR = WearSettings()


def law_on(wheelset):
    return Setup(wheelset, None, ContactModels.of("fast"), WEAR)


def worn(solution, points, weight, state, setup):
    """Wear rate of a contact solution."""
    return accumulate(passage_of(solution, setup), points, weight, state, setup)


def swapped(solution):
    """The same patches on the other wheels."""
    return replace(solution, side=1 - solution.side)


def per_wheel(solution, amount, wheel):
    return amount[..., solution.side == wheel].sum(axis=-1)


def test_strips_and_vertices_remove_the_same_volume(solution, points, state, wheelset):
    """Conservation of the transfer from the strips to the vertices, 1e-12, by wheel and
    regime.
    """
    result = worn(solution, points, points.weight, state, law_on(wheelset))
    depth = passage_depth(solution.fields, solution.area, WEAR)
    share = points.weight[solution.point] * points.environment[solution.point]
    strips = (depth * solution.fields.strip_width[:, None]).sum(axis=2) * share
    ring = 2 * np.pi * (wheelset.radius + state.z)
    for wheel in (0, 1):
        length = vertex_lengths(state.y[wheel], state.z[wheel])
        vertices = (result.regime_depth[wheel] * length * ring[wheel]).sum(axis=1)
        np.testing.assert_allclose(
            vertices, per_wheel(solution, strips, wheel), rtol=1e-12
        )
    np.testing.assert_allclose(
        result.depth, result.regime_depth.sum(axis=1), rtol=1e-15
    )
    assert (
        result.regime_depth.max(axis=(0, 2)) > 0.0
    ).all()  # all three regimes occur in this case


def test_friction_work_is_carried_without_the_environment(
    solution, points, state, wheelset
):
    """Imposed, 1e-12: environment factors reduce wear, not the work that is done."""
    result = worn(solution, points, points.weight, state, law_on(wheelset))
    strips = (solution.fields.strip_work * solution.fields.strip_width[:, None]).sum(
        axis=1
    )
    strips = strips * points.weight[solution.point]
    ring = 2 * np.pi * (wheelset.radius + state.z)
    for wheel in (0, 1):
        length = vertex_lengths(state.y[wheel], state.z[wheel])
        vertices = (result.friction_work[wheel] * length * ring[wheel]).sum()
        assert vertices == pytest.approx(per_wheel(solution, strips, wheel), rel=1e-12)


def test_depth_at_the_centre_of_a_wide_patch(
    made_solution, made_points, state, wheelset
):
    """Discretisation against the closed form: strips and vertices of 0.25 mm on a 14 mm
    patch, 0.5 %.
    """
    peak = 4e6
    solution = made_solution([0], [0], [10e-3], [7e-3], [peak], ny=56)
    result = worn(solution, made_points([1.0]), np.ones(1), state, law_on(wheelset))
    at = int(np.argmin(np.abs(state.y[0] - 10e-3)))
    per_passage = 5.3e-3 * (peak / 1e6) * 2 * 6e-3 / 7850.0
    # a strip is as wide in the contact plane as on the profile only where that is
    # level: cos of 1:20
    expected = (
        per_passage / (2 * np.pi * (0.46 + state.z[0, at])) * np.cos(np.arctan(0.05))
    )
    assert result.depth[0, at] == pytest.approx(expected, rel=5e-3)
    outside = np.abs(state.y[0] - 10e-3) > 7.3e-3
    assert not result.depth[0, outside].any()


def test_wheels_changed_over_wear_changed_over(solution, points, state, wheelset):
    """Mirror symmetry: the left wheel is described in the axes of a right one, so only
    the index moves.
    """
    straight = worn(solution, points, points.weight, state, law_on(wheelset))
    mirrored = worn(swapped(solution), points, points.weight, state, law_on(wheelset))
    for name in ("depth", "regime_depth", "friction_work", "stability"):
        np.testing.assert_allclose(
            getattr(mirrored, name), getattr(straight, name)[::-1], rtol=1e-9
        )


def test_rate_is_linear_in_the_weights(solution, points, state, wheelset):
    whole = worn(solution, points, points.weight, state, law_on(wheelset))
    parts = [
        worn(solution, points, weight, state, law_on(wheelset))
        for weight in np.diag(points.weight)
    ]
    for name in ("depth", "regime_depth", "friction_work", "stability"):
        total = sum(getattr(part, name) for part in parts)
        np.testing.assert_allclose(getattr(whole, name), total, rtol=1e-12, atol=1e-25)


def test_stability_is_depth_over_interpenetration(
    made_solution, made_points, state, wheelset
):
    """With both of one shape the ratio is constant over the strips; outside, and at the
    rim, nothing.
    """
    peak, gap = 4e6, 40e-6
    solution = made_solution([0], [1], [0.0], [6e-3], [peak], gap=gap)
    points = made_points([0.25], environment=[0.5])
    result = worn(solution, points, points.weight, state, law_on(wheelset))
    local = state.y[1] / 6e-3
    inside = np.abs(local) < 0.95
    ring = 2 * np.pi * (0.46 + state.z[1, inside])
    # the strip's value is taken at the vertex: half a strip of 0.3 mm beside it, error
    # below 20 % at 0.95 b
    half_length = 6e-3 * np.sqrt(1 - local[inside] ** 2)
    expected = 0.125 * 5.3e-3 * (peak / 1e6) * 2 * half_length / 7850.0 / gap / ring
    np.testing.assert_allclose(result.stability[1, inside], expected, rtol=0.2)
    central = np.abs(local[inside]) < 0.5
    np.testing.assert_allclose(
        result.stability[1, inside][central], expected[central], rtol=0.02
    )
    assert not result.stability[1, np.abs(local) > 0.985].any()
    assert not result.stability[0].any()


def test_models_without_interpenetration_have_no_stability_number(
    solution, points, state, wheelset
):
    flat = replace(
        solution.patch, interpenetration=np.zeros_like(solution.patch.interpenetration)
    )
    result = worn(
        replace(solution, patch=flat), points, points.weight, state, law_on(wheelset)
    )
    assert not result.stability.any()


def test_a_faint_patch_does_not_hold_up_the_step(
    made_solution, made_points, state, wheelset
):
    """Flat or soft as it may be, with 0.05 % of the load; one that acts in 0.1 % of the
    distance does.
    """
    solution = made_solution(
        [0, 0, 1] * 2,
        np.repeat([0, 1], 3),
        [0.0, 0.02, -0.02] * 2,
        [5e-3] * 6,
        [4e6] * 6,
    )
    whole, share = np.array([1.0, 5e-4, 1.0] * 2), np.array([0.999, 0.001])
    soft = replace(solution, normal_force=80e3 * whole, max_pressure=1e9 * whole)
    points, setup = made_points([1.0]), law_on(wheelset)

    def limits(solution):
        passage = shared(passage_of(solution, setup), share)
        passage = replace(
            passage, contact=replace(passage.contact, point=0 * solution.point)
        )
        rate = accumulate(passage, points, points.weight, state, setup)
        return rate.stability, rate.over_strain

    stability, nothing = limits(soft)
    assert not nothing.any()
    flat = replace(soft.patch, interpenetration=0.0 * soft.patch.interpenetration)
    nothing, over_strain = limits(replace(soft, patch=flat))
    assert not nothing.any()
    for low, high, limiting in (
        (15e-3, 25e-3, False),
        (-5e-3, 5e-3, True),
        (-25e-3, -15e-3, True),
    ):
        near = (state.y[0] > low) & (state.y[0] < high)
        assert stability[:, near].any() == limiting
        assert over_strain[:, near].any() == limiting


def test_no_friction_no_wear(made_solution, made_points, state, wheelset):
    solution = made_solution([0, 0], [0, 1], [0.0, 0.0], [6e-3, 6e-3], [0.0, 0.0])
    result = worn(solution, made_points([1.0]), np.ones(1), state, law_on(wheelset))
    for name in ("depth", "regime_depth", "friction_work", "stability"):
        assert not getattr(result, name).any()


def test_strip_within_one_vertex_cell(made_solution, made_points, state, wheelset):
    """A patch narrower than the vertex spacing still gives all its volume to the
    profile.
    """
    solution = made_solution(
        [0], [0], [state.y[0, 200] + 0.02e-3], [0.04e-3], [4e6], ny=7
    )
    result = worn(solution, made_points([1.0]), np.ones(1), state, law_on(wheelset))
    assert np.flatnonzero(result.depth[0]).tolist() == [200]


def test_wear_of_one_patch_is_the_closed_form(made_solution, state, wheelset):
    """Elliptic patch, mild: the integral of 1 - t^2 over the ellipse is 3/8 pi a b; 60
    strips, 0.1 %.

    The radius of the strips spreads by 0.3 mm about the one at the centre: 0.04 % of
    460 mm.
    """
    peak, a, b = 4e6, 6e-3, 7e-3
    solution = made_solution([0], [1], [10e-3], [b], [peak], ny=60)
    wear = patch_wear(passage_of(solution, law_on(wheelset)), state, wheelset)
    ring = 2 * np.pi * (0.46 + np.interp(10e-3, state.y[1], state.z[1]))
    per_index = 5.3e-3 * (peak / 1e6) / 7850.0
    # twice 3/8 pi a b: strips are 2 a sqrt(1 - t^2) long and 1 - t^2 is worn in each
    assert wear.area_rate[0] == pytest.approx(
        per_index * 0.75 * np.pi * a * b / ring, rel=1e-3
    )
    assert wear.depth_rate_max[0] == pytest.approx(per_index * 2 * a / ring, rel=1e-3)
    assert (wear.regime[0], wear.regime_highest[0]) == (0, 0)


def test_patches_wear_what_their_points_wear_on_the_profile(
    solution, points, state, wheelset
):
    """Shares and environment factors put on afterwards give the collective, on both
    wheels.

    Strips take the radius at their own centre, vertices at theirs: half a spacing of
    0.25 mm apart on a flank of 70 degrees is 0.35 mm of 460 mm, below 0.1 %.
    """
    wear = patch_wear(passage_of(solution, law_on(wheelset)), state, wheelset)
    share = (points.weight * points.environment)[solution.point]
    result = worn(solution, points, points.weight, state, law_on(wheelset))
    for wheel in (0, 1):
        vertices = (
            result.depth[wheel] * vertex_lengths(state.y[wheel], state.z[wheel])
        ).sum()
        patches = (wear.area_rate * share)[solution.side == wheel].sum()
        assert patches == pytest.approx(vertices, rel=1e-3)
    # peaks of 2 to 120 N/mm2 by patch, the skew adding a little; limits at 10.4 and
    # 77.2
    assert wear.regime_highest.tolist() == [0, 0, 2, 1, -1, 2]
    assert (wear.regime_highest >= wear.regime).all()


def test_rate_solves_the_acting_points_with_the_worn_profiles(
    monkeypatch, solution, points, state, wheelset, made_solution
):
    seen = []

    def fake_solve(
        conditions, wheels, counterface, models, each, *, threads, failed, fields
    ):
        assert fields == "work"  # all that the law takes
        seen.append((conditions, wheels, threads))
        return [
            each(made_solution([0, 1], [0, 1], [0.0, 0.0], [5e-3, 5e-3], [4e6, 4e6]))
        ]

    monkeypatch.setattr(rate_module, "solve_each", fake_solve)
    state = replace(state, z=state.z - np.array([[1e-4], [2e-4]]))
    counterface = Counterface(profile=wheelset.right, curvature=0.0)
    weight = np.array([0.25, 0.0, 0.75])
    result = rate(
        state,
        points,
        weight,
        Setup(wheelset, counterface, ContactModels.of("fast"), WEAR, threads=2),
    )
    conditions, wheels, threads = seen[0]
    np.testing.assert_array_equal(conditions.shift, points.conditions.shift[[0, 2]])
    np.testing.assert_array_equal(wheels.right.z, state.z[0])
    np.testing.assert_array_equal(wheels.left.z, state.z[1])
    assert threads == 2
    # point 2 acts through its weight and environment: 0.75 x 0.1 against 0.25 x 1
    ratio = result.depth[1].max() / result.depth[0].max()
    assert ratio == pytest.approx(0.3, rel=1e-3)  # the radii differ by 0.1 mm in 460
    solve_passage(
        state, points, Setup(wheelset, counterface, ContactModels.of("fast"), WEAR)
    )
    assert seen[1][0].shift.size == 3


def test_select_keeps_rotation_speeds_with_their_points(points):
    given = replace(points.conditions, rotation=np.array([-43.0, -44.0, -45.0]))
    chosen = select(replace(points, conditions=given), np.array([2, 0]))
    np.testing.assert_array_equal(chosen.conditions.rotation, [-45.0, -43.0])
    assert chosen.label == ("point 2", "point 0")


@pytest.mark.benchmark
def test_transfer_of_200_patches(
    benchmark, made_solution, made_points, state, wheelset
):
    m = 200
    rng = np.random.default_rng(0)
    solution = made_solution(
        np.arange(m) // 2,
        np.arange(m) % 2,
        rng.uniform(-0.02, 0.02, m),
        np.full(m, 5e-3),
        np.full(m, 4e6),
        ny=50,
    )
    points = made_points(np.full(m // 2, 2.0 / m))
    passage = passage_of(solution, law_on(wheelset))
    benchmark(accumulate, passage, points, points.weight, state, law_on(wheelset))


def test_the_end_of_a_campaign_is_not_solved_again_where_all_points_acted(
    evolution_of, scene_text, monkeypatch
):
    """The contact at the end of the last step is, to the last bit, that of all points
    at the distance.
    """
    curve = {
        "shift_mean_mm": 3,
        "shift_std_mm": 1,
        "positions": 10,
        "yaw_mrad": 2,
        "share": 1,
    }
    of = evolution_of(scene_text(curve, kind="field"))
    state, taken = of.start()
    while not reached(state.distance, of.target):
        state, taken = of.advance(state, of.evaluate(state, taken))
    solved_again = of.row(state, of.evaluate(state, replace(taken, end=None)), taken)
    monkeypatch.setattr(
        evolution_module,
        "solved",
        lambda *_, **__: pytest.fail("the end is solved again"),
    )
    row = of.row(state, of.evaluate(state, taken), taken)
    assert row.keys() == solved_again.keys()
    for name, value in row.items():
        np.testing.assert_array_equal(value, solved_again[name], err_msg=name)
