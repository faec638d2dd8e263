"""Rollers and rails that wear: conservation, ratios, symmetry, redressing, the same
bits after a stop.
"""

from dataclasses import replace
from itertools import pairwise

import netCDF4
import numpy as np
import pytest
from stepping import step_over

from wearsim.campaign.control import stability_rate
from wearsim.campaign.counterface import (
    new_counterface,
    redressed,
    wear_off_counterface,
    worn_counterface,
)
from wearsim.campaign.evaluate import Setup, accumulate, passage_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import run_evolution
from wearsim.campaign.state import CounterfaceRate, WearRate
from wearsim.campaign.step import (
    INTEGRATORS,
    StepRule,
    error_of,
    smoothed,
    smoothed_at_end,
)
from wearsim.contact.solve import ContactModels, Counterface
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.profile.shape import polygon_area_between, vertex_lengths
from wearsim.results import GROUPS, open_results
from wearsim.scene.campaign import CounterfaceWear

WEAR = WearSettings()
FACTOR, RADIUS = 0.7, 1.2
ROLLER = CounterfaceWear(factor=FACTOR, radius=RADIUS)
RAIL = CounterfaceWear(area_rate=3e-12)

GRID = "strips = 12\ncells = 10"


def law_on(wheelset, counterface_wear=None):
    return Setup(
        wheelset,
        None,
        ContactModels.of("fast"),
        WEAR,
        counterface_wear=counterface_wear,
    )


def worn(solution, points, weight, state, setup):
    """Wear rate of a contact solution."""
    return accumulate(passage_of(solution, setup), points, weight, state, setup)


@pytest.fixture
def rig(two_blocks):
    """Function that gives a campaign on rollers of which the text says how they
    wear.
    """

    def made(wear, campaign="distance_km = 30", mirrored=False):
        return two_blocks(
            mirrored=mirrored,
            contact=GRID,
            counterface=wear,
            campaign=f"point_spacing_mm = 0.5\n{campaign}",
        )

    return made


@pytest.fixture
def field(evolution_of, scene_text):
    """Function that gives a campaign of one class of track, both flanks of a
    distribution.
    """

    def made(wear, campaign="distance_km = 30"):
        shifts = {
            "shift_mean_mm": 1,
            "shift_std_mm": 1,
            "positions": 10,
            "share": 1,
            "yaw_mrad": 1,
        }
        tables = {
            "counterface": wear,
            "campaign": f"point_spacing_mm = 0.5\n{campaign}",
        }
        return evolution_of(scene_text(shifts, kind="field", contact=GRID, **tables))

    return made


@pytest.fixture
def mirror_image(wheelset, state):
    """State whose counterface is the wheel turned upside down: the same vertices at the
    same arc lengths.
    """
    upside_down = replace(wheelset.right, kind="rail", z=-wheelset.right.z)
    return replace(
        state, counterface=new_counterface(Counterface(upside_down, 1.0 / RADIUS))
    )


@pytest.mark.parametrize("settings", [ROLLER, RAIL], ids=["roller", "rail"])
def test_strips_and_vertices_remove_the_same_area(
    mirror_image, solution, points, wheelset, settings
):
    """Conservation of the transfer, 1e-12; what a rail loses is what is stated."""
    result = worn(
        solution,
        points,
        points.weight,
        mirror_image,
        law_on(wheelset, settings),
    )
    depth = passage_depth(solution.fields, solution.area, WEAR).sum(axis=0)
    share = points.weight[solution.point] * points.environment[solution.point]
    strips = (depth * solution.fields.strip_width[:, None]).sum(axis=1) * share
    rollers = mirror_image.counterface
    for side in (0, 1):
        vertices = (
            result.counterface.depth[side]
            * vertex_lengths(rollers.y[side], rollers.z[side])
        ).sum()
        expected = strips[solution.side == side].sum() * FACTOR / (2.0 * np.pi * RADIUS)
        if settings is RAIL:
            expected = RAIL.area_rate
        assert vertices == pytest.approx(expected, rel=1e-12)


def test_depth_of_the_roller_over_that_of_the_wheel(
    mirror_image, solution, points, wheelset
):
    """Factor times r/s0 at each point (two forms of one sum, 1e-12); both bodies open
    the gap.

    A wheel meets its strip once in 2 pi r, a roller once in 2 pi s0.
    """
    with_roller = worn(
        solution,
        points,
        points.weight,
        mirror_image,
        law_on(wheelset, ROLLER),
    )
    alone = worn(solution, points, points.weight, mirror_image, law_on(wheelset))
    ratio = FACTOR * (wheelset.radius + mirror_image.z) / RADIUS
    rollers, depth = with_roller.counterface, alone.depth
    assert alone.counterface is None
    assert depth.max() > 0.0
    np.testing.assert_array_equal(with_roller.depth, depth)
    np.testing.assert_allclose(rollers.depth, ratio * depth, rtol=1e-12)
    both = (1.0 + ratio) * alone.stability
    np.testing.assert_allclose(with_roller.stability, both, rtol=1e-12)
    # the roller's own sum takes r at the strips, the wheel's at the vertices
    np.testing.assert_allclose(rollers.stability, both, rtol=5e-3)
    assert stability_rate(with_roller) >= with_roller.stability.max()


def test_waves_of_models_without_overlap_count_the_depth_of_both_bodies(
    mirror_image, solution, points, wheelset
):
    """Depth over p0/E*, summed over the patches, larger by the depth of the roller."""
    flat = replace(
        solution.patch, interpenetration=np.zeros_like(solution.patch.interpenetration)
    )
    flat = replace(solution, patch=flat)
    with_roller, alone = (
        worn(flat, points, points.weight, mirror_image, law_on(wheelset, wear))
        for wear in (ROLLER, None)
    )
    strain = flat.max_pressure.max() / ContactModels.of("fast").effective_modulus
    assert alone.over_strain.max() >= 0.99 * alone.depth.max() / strain > 0.0
    ratio = FACTOR * (wheelset.radius + mirror_image.z) / RADIUS
    both = (1.0 + ratio) * alone.over_strain
    np.testing.assert_allclose(with_roller.over_strain, both, rtol=1e-12)
    # the roller's own sum takes r at the strips, the wheel's at the vertices
    np.testing.assert_allclose(with_roller.counterface.over_strain, both, rtol=5e-3)


def test_an_undercut_head_wears_on_its_top(mirror_image, solution, points, wheelset):
    """A point below the head at either end, where y turns back: nothing changes between
    (rounding, 1e-9).
    """
    rollers = mirror_image.counterface
    ends = {"y": ([1e-3], [-1e-3]), "z": ([5e-3], [5e-3])}
    axes = {
        axis: np.stack(
            [
                np.concatenate((row[0] + before, row, row[-1] + after))
                for row in getattr(rollers, axis)
            ]
        )
        for axis, (before, after) in ends.items()
    }
    undercut = replace(mirror_image, counterface=replace(rollers, **axes))
    plain, other = (
        worn(solution, points, points.weight, state, law_on(wheelset, ROLLER))
        for state in (mirror_image, undercut)
    )
    for name in ("depth", "stability"):
        value, expected = (
            getattr(other.counterface, name),
            getattr(plain.counterface, name),
        )
        np.testing.assert_allclose(
            value[:, 1:-1], expected, rtol=1e-9, atol=1e-12 * expected.max()
        )
        assert not value[:, [0, -1]].any()


@pytest.mark.parametrize("integrator", sorted(INTEGRATORS))
@pytest.mark.parametrize("wavelength", [0.0, 2.5e-3])
def test_a_step_takes_the_area_off_both(
    mirror_image, solution, points, wheelset, integrator, wavelength
):
    """Polygons against the sum of depths, 1e-9; the error of the step is that of the
    deeper wear.
    """

    def rate_at(state):
        return worn(solution, points, points.weight, state, law_on(wheelset, ROLLER))

    rate = rate_at(mirror_image)
    step_length = 10e-6 / rate.depth.max()
    rule = StepRule(0.46, 7850.0, wavelength, integrator)
    after = step_over(mirror_image, rate, step_length, rule, rate_at, 8.0).state
    before, rollers = mirror_image.counterface, after.counterface
    for side in (0, 1):
        polygon = polygon_area_between(
            before.y[side], -before.z[side], rollers.y[side], -rollers.z[side]
        )
        assert rollers.worn_area[side] == pytest.approx(polygon, rel=1e-9)
    lengths = np.stack(
        [vertex_lengths(y, z) for y, z in zip(before.y, before.z, strict=True)]
    )
    if integrator == "euler":
        law = step_length * (rate.counterface.depth * lengths).sum(axis=1)
        np.testing.assert_allclose(rollers.worn_area, law, rtol=1e-9)
    np.testing.assert_array_equal(rollers.last_depth, rollers.depth)
    assert (
        error_of(
            mirror_image,
            after,
            smoothed(mirror_image, rate, wavelength),
            smoothed_at_end(mirror_image, after, rate_at(after), wavelength),
        )
        > 0.0
    )


@pytest.mark.parametrize(
    ("integrator", "stability", "order"),
    [("euler", 4.0, 1), ("rkc", 1.0, 2), ("rkc", 4.0, 2)],
)
def test_two_bodies_share_a_gap(mirror_image, solution, integrator, stability, order):
    """A strip with virtual penetration: both depths together are g (1 - exp(-(a + b)
    s)), shared as a to b.

    The order of convergence is that of the rule, and the error of a step counts both
    bodies.
    """
    wheel, roller, run = 1e-5, 2e-5, 60e3
    gap = np.where(
        np.abs(mirror_image.y) < 8e-3, 60e-6 * (1.0 - (mirror_image.y / 8e-3) ** 2), 0.0
    )
    opens = np.where(gap > 0.0, wheel + roller, 0.0)

    def rate_at(state):
        left = np.maximum(gap - state.wear_depth - state.counterface.depth, 0.0)
        regime = np.zeros_like(state.regime_depth)
        regime[:, 0] = wheel * left
        rollers = CounterfaceRate(roller * left, opens, 0.0 * opens)
        nothing = np.zeros_like(left)
        return WearRate(
            regime[:, 0],
            regime,
            nothing,
            opens,
            nothing,
            solution,
            counterface=rollers,
        )

    exact = gap * (1.0 - np.exp(-(wheel + roller) * run)) / (wheel + roller)
    errors = []
    for steps in (4, 8, 16):
        state = mirror_image
        for _ in range(steps):
            rule, before = StepRule(0.46, 7850.0, 0.0, integrator), state
            state = step_over(
                state, rate_at(state), run / steps, rule, rate_at, stability
            ).state
            assert (
                error_of(
                    before,
                    state,
                    smoothed(before, rate_at(before), 0.0),
                    smoothed_at_end(before, state, rate_at(state), 0.0),
                )
                > 0.0
            )
        off = (
            state.wear_depth - wheel * exact,
            state.counterface.depth - roller * exact,
        )
        errors.append(max(np.abs(one).max() for one in off))
        # the curved parts of the profile stretch and shrink as they wear, by no more
        # than 1 % of the depth
        np.testing.assert_allclose(
            state.counterface.depth, 2.0 * state.wear_depth, rtol=0.01, atol=1e-12
        )
    fall = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(fall > order - 0.3)


def test_points_move_into_the_counterface(mirror_image):
    """Wear of the top goes down, towards larger z, by the depth along the normal."""
    depth = np.full_like(mirror_image.y, 20e-6)
    rollers = wear_off_counterface(mirror_image.counterface, depth)
    level = mirror_image.y[0] > 0.0
    moved = rollers.z[0][level] - mirror_image.counterface.z[0][level]
    np.testing.assert_allclose(moved[:-2], 20e-6 * np.cos(np.arctan(0.05)), rtol=1e-6)


def test_without_wear_it_is_the_given_counterface(mirror_image, wheelset):
    given = Counterface(wheelset.right, 1.0)
    assert worn_counterface(given, None) is given
    sides = worn_counterface(given, mirror_image.counterface).profiles
    for side in (0, 1):
        np.testing.assert_array_equal(sides[side].z, mirror_image.counterface.z[side])


def test_redressing_restores_the_profile_bit_by_bit(mirror_image, wheelset):
    """By running and by depth, whichever comes first; what was worn and redressed stays
    counted.
    """
    new = Counterface(replace(wheelset.right, z=-wheelset.right.z), 1.0 / RADIUS)
    depth = np.zeros_like(mirror_image.y)
    depth[0, 100:140], depth[1, 100:140] = 30e-6, 20e-6
    worn = wear_off_counterface(mirror_image.counterface, depth)
    state = replace(mirror_image, distance=5e3, counterface=worn)
    assert (
        redressed(
            state, new, replace(ROLLER, redress_distance=5.1e3, redress_depth=31e-6)
        )
        is state
    )
    for settings in (
        replace(ROLLER, redress_distance=5e3),
        replace(ROLLER, redress_depth=30e-6),
    ):
        fresh = redressed(state, new, settings).counterface
        assert fresh.y.tobytes() == mirror_image.counterface.y.tobytes()
        assert fresh.z.tobytes() == mirror_image.counterface.z.tobytes()
        assert not fresh.depth.any()
        assert (fresh.redressed_count, fresh.redressed_at) == (1, 5e3)
        np.testing.assert_array_equal(fresh.worn_area, worn.worn_area)
        np.testing.assert_allclose(fresh.redressed_depth, [30e-6, 20e-6], rtol=1e-12)
        np.testing.assert_array_equal(fresh.last_depth, worn.depth)


@pytest.mark.parametrize("body", ["rollers", "rails"])
def test_removed_area_is_the_time_integral_of_the_law(body, rig, field, all_states):
    """Euler's sum of law areas, the sum the state keeps, and the polygons: 1e-9 over
    the whole campaign.
    """
    campaign = 'distance_km = 12\nintegrator = "euler"'
    if body == "rollers":
        of = rig("[counterface.wear]\nfactor = 0.8", campaign)
    else:
        of = field("[counterface.wear]\narea_mm2_per_1000km = 2", campaign)
    states, rates = all_states(of)
    first, last = states[0].counterface, states[-1].counterface
    for side in (0, 1):
        law = 0.0
        for before, after, rate in zip(states, states[1:], rates, strict=False):
            cells = vertex_lengths(
                before.counterface.y[side], before.counterface.z[side]
            )
            law += (after.distance - before.distance) * (
                rate.counterface.depth[side] * cells
            ).sum()
        polygon = polygon_area_between(
            first.y[side], -first.z[side], last.y[side], -last.z[side]
        )
        assert last.worn_area[side] == pytest.approx(law, rel=1e-9)
        assert polygon == pytest.approx(law, rel=1e-9)
        if body == "rails":
            assert law == pytest.approx(12 * 2e-9, rel=1e-9)  # 2 mm2 per 1000 km


def test_mirrored_scene_wears_mirrored_rollers(rig, states_of):
    """Right and left change places, through a redressing at a block's border: 1e-9 of
    the depth.
    """
    wear = "[counterface.wear]\nfactor = 0.8\nredress_every_km = 17"
    one, other = (states_of(rig(wear, mirrored=mirrored)) for mirrored in (False, True))
    assert [state.distance for state in one] == pytest.approx(
        [state.distance for state in other]
    )
    assert one[-1].counterface.redressed_count == 1
    assert one[-1].counterface.redressed_at == pytest.approx(17e3, rel=1e-12)
    pairs = [(end.wear_depth, end.counterface.depth) for end in (one[-1], other[-1])]
    for depth, there in zip(*pairs, strict=True):
        assert (
            abs(depth[0].max() / depth[1].max() - 1.0) > 0.05
        )  # the sides themselves differ
        np.testing.assert_allclose(there[::-1], depth, rtol=0, atol=1e-9 * depth.max())


@pytest.mark.slow
def test_small_first_steps_after_redressing_too(rig, states_of):
    """Two lives of a roller in steps up to 40 um, the first of each 2 um, against steps
    of 2 um throughout.

    Without a tolerance of the error; with small steps at the start alone, 1.9 um of 42
    are missing.
    """
    wear = "[counterface.wear]\nfactor = 1\nredress_every_km = 30"
    steps = (
        "distance_km = 60\nstability = 1.9\nerror_tolerance_um = 1000\n"
        "max_step_depth_um ="
    )
    fine, coarse = (
        states_of(rig(wear, f"{steps} {text}"))[-1]
        for text in ("2", "40\nfirst_step_depth_um = 2")
    )
    assert fine.counterface.redressed_count == coarse.counterface.redressed_count == 1
    assert np.abs(coarse.wear_depth - fine.wear_depth).max() < 0.5e-6


def test_rollers_are_redressed_at_the_given_depth(rig, states_of):
    """Steps are aimed at it: 1 % short at most, and past it only by what a step's error
    allows.
    """
    wear = "[counterface.wear]\nfactor = 3\nredress_depth_um = 10"
    states = states_of(rig(wear, "distance_km = 20\nerror_tolerance_um = 0.2"))
    depths = np.array(
        [
            after.counterface.last_depth.max(axis=1)
            for before, after in pairwise(states)
            if after.counterface.redressed_count > before.counterface.redressed_count
        ]
    )
    assert len(depths) >= 2
    assert depths.max(axis=1).min() >= 9.9e-6
    assert depths.max() <= 10.2e-6
    assert max(state.counterface.depth.max() for state in states) < 9.9e-6
    np.testing.assert_allclose(
        states[-1].counterface.redressed_depth, depths.sum(axis=0), rtol=1e-12
    )


def test_stopped_and_continued_to_the_same_bits(tmp_path, rig, stopped_at):
    """Stopped before redressing and reprofiling, between the two and after; every
    variable of the file.
    """
    campaign = "distance_km = 20\n[campaign.reprofiling]\nat_km = [12]"
    of = rig("[counterface.wear]\nfactor = 0.8\nredress_every_km = 12", campaign)
    for folder in ("whole", "parts"):
        (tmp_path / folder).mkdir()
    whole = run_evolution(
        WheelsetEvolution(of.setup, "wearsim run"), tmp_path / "whole", "rig"
    )
    with open_results(whole) as data:
        (redressing,) = (
            np.flatnonzero(np.diff(data["counterface_redressed_count"].values)) + 1
        )
        deepest = data["counterface_max_wear_depth"].values.max(axis=1)
        assert (
            data["last_reprofiling"].values[redressing + 1] == redressing + 1
        )  # of the wheels, at the same distance
        assert deepest[redressing] > deepest[redressing - 1]
        assert deepest[redressing + 1] == 0.0
    for step in (1, int(redressing), int(redressing) + 1):
        with stopped_at(step) as stop:
            run_evolution(of, tmp_path / "parts", "rig", stop)
    parts = run_evolution(
        WheelsetEvolution(of.setup, "wearsim run"), tmp_path / "parts", "rig"
    )
    with netCDF4.Dataset(whole) as one, netCDF4.Dataset(parts) as other:
        assert set(GROUPS["counterface"]) <= set(one.variables)
        for file in (one, other):
            file.set_auto_maskandscale(False)
        for name in one.variables:
            assert np.array_equal(one[name][:], other[name][:]), name
        assert one["counterface_redressed_count"][-1] == 1
        assert one.counterface_wear_factor == 0.8
        assert one.redress_distance == 12e3
        assert list(one["counterface_name"][:]) == ["right roller", "left roller"]


@pytest.mark.cf
def test_the_file_of_rollers_that_wear_keeps_the_conventions(tmp_path, assert_cf, rig):
    of = rig(
        "[counterface.wear]\nfactor = 0.8\nredress_every_km = 2", "distance_km = 3"
    )
    assert_cf(
        run_evolution(WheelsetEvolution(of.setup, "wearsim run"), tmp_path, "rig")
    )


def test_a_counterface_that_stays_has_no_variables(tmp_path, rig):
    of = rig("", "distance_km = 3")
    path = run_evolution(of, tmp_path, "rig")
    with open_results(path) as data:
        assert not set(GROUPS["counterface"]) & set(data.variables)
        assert not any(
            "redress" in name or name == "counterface_wear_factor"
            for name in data.attrs
        )
