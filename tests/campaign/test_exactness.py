"""What a campaign must give exactly, or within the tolerance it was asked for."""

from dataclasses import replace

import numpy as np
import pytest
from stepping import step_over

from wearsim.campaign.control import choose, error_limit, reached
from wearsim.campaign.state import WearRate
from wearsim.campaign.step import StepRule, error_of, smoothed, smoothed_at_end
from wearsim.profile.shape import polygon_area_between, vertex_lengths, vertex_normals
from wearsim.scene.campaign import ControlSettings


@pytest.fixture
def evolution(two_blocks):
    """Function that gives a campaign of two blocks on the default profile points."""

    def made(campaign="", mirrored=False, distance=18):
        return two_blocks(
            mirrored=mirrored,
            contact="strips = 12\ncells = 10",
            campaign=f"distance_km = {distance}\n{campaign}",
        )

    return made


def test_mirrored_scene_gives_mirrored_wear(evolution, states_of):
    """Right and left change places; 1e-9 of the depth."""
    one, other = (states_of(evolution(mirrored=mirrored)) for mirrored in (False, True))
    assert len(one) == len(other)
    depth = one[-1].wear_depth
    assert (
        abs(depth[0].max() / depth[1].max() - 1.0) > 0.05
    )  # the wheels themselves differ
    np.testing.assert_allclose(
        other[-1].wear_depth[::-1], depth, rtol=0, atol=1e-9 * depth.max()
    )
    np.testing.assert_allclose(other[-1].worn_mass[::-1], one[-1].worn_mass, rtol=1e-9)


@pytest.mark.parametrize("smoothing", [0.0, 2.5])
def test_removed_area_is_the_time_integral_of_the_law(smoothing, evolution, all_states):
    """Euler's sum of law areas, the sum the state keeps, and the polygons: 1e-9 over
    the whole campaign.
    """
    campaign = f'integrator = "euler"\nsmoothing_wavelength_mm = {smoothing}'
    states, rates = all_states(evolution(campaign))
    first, last = states[0], states[-1]
    for wheel in (0, 1):
        law = 0.0
        for before, after, rate in zip(states, states[1:], rates, strict=False):
            cells = vertex_lengths(before.y[wheel], before.z[wheel])
            law += (after.distance - before.distance) * (
                rate.depth[wheel] * cells
            ).sum()
        polygon = polygon_area_between(
            first.y[wheel], first.z[wheel], last.y[wheel], last.z[wheel]
        )
        assert last.worn_area[wheel] == pytest.approx(law, rel=1e-9)
        assert polygon == pytest.approx(law, rel=1e-9)


@pytest.mark.slow
def test_result_does_not_hang_on_the_first_step(evolution, states_of):
    """First steps of up to 2 um, 0.05, 0.1 and 0.2 mm over 0.12 mm of wear: within half
    a tolerance.

    Without the tolerance a first step of 0.05 mm ends 4 um off, one of 0.1 mm 6 um.
    """
    result, rejected = {}, {}
    for first in (2, 50, 100, 200):
        campaign = (
            f"max_step_depth_um = 200\nfirst_step_depth_um = {first}\n"
            "stability = 1.9\nerror_tolerance_um = 1"
        )
        of = evolution(campaign, distance=240)
        result[first] = states_of(of)[-1].wear_depth
        state, _ = of.start()
        rejected[first] = of.advance(state, of.evaluate(state))[1].rejected
    assert result[2].max() > 100e-6
    assert rejected[2] == 0
    assert min(rejected[first] for first in (50, 100, 200)) >= 1
    for first in (50, 100, 200):
        assert np.abs(result[first] - result[2]).max() < 0.5e-6


SETTINGS = ControlSettings(
    distance=100e3,
    depth_cap=50e-6,
    stability=1.0,
    smoothing_wavelength=0.0,
    integrator="rkc",
)


def controlled(state, points, rate_at, settings):
    """Steps of a campaign with a rate of one's own, repeated where they fail the
    tolerance.
    """
    rule = StepRule(0.46, 7850.0, 0.0, settings.integrator)
    errors, limit = [], np.inf
    while not reached(state.distance, settings.distance):
        rate = rate_at(state)
        choice = choose(
            state,
            points,
            lambda weight: rate,  # noqa: B023
            settings,
            length_limit=(limit, "error"),
        )
        after = step_over(state, rate, choice.limit.step_length, rule, rate_at).state
        error = error_of(
            state,
            after,
            smoothed(state, rate, 0.0),
            smoothed_at_end(state, after, rate_at(after), 0.0),
        )
        limit = error_limit(choice.limit.step_length, error, settings)
        if error <= settings.error_tolerance:
            state = after
            errors.append(error)
    return state, errors


@pytest.mark.parametrize("integrator", ["euler", "rkc"])
def test_analytic_case(state, solution, made_points, integrator):
    """A strip with virtual penetration under one state: d = g (1 - exp(-c s)), g its
    interpenetration.

    The end is off by no more than the sum of the errors, and an estimate is 0.8 of the
    error of a step of Euler's rule, 1.2 times that of two stages, as RMS over the band:
    of a parabola 0.73 of the largest.
    """
    gap = np.where(np.abs(state.y) < 8e-3, 60e-6 * (1.0 - (state.y / 8e-3) ** 2), 0.0)

    def rate_at(s):
        regime = np.zeros_like(s.regime_depth)
        regime[:, 0] = 1.5e-5 * np.maximum(gap - s.wear_depth, 0.0)
        return WearRate(
            regime.sum(axis=1),
            regime,
            s.z,
            np.where(gap > 0.0, 1.5e-5, 0.0),
            np.zeros_like(s.y),
            solution,
        )

    exact = gap * (1.0 - np.exp(-1.5e-5 * 100e3))
    off = []
    for tolerance in (0.4e-6, 0.1e-6):
        settings = replace(SETTINGS, integrator=integrator, error_tolerance=tolerance)
        last, errors = controlled(state, made_points([1.0]), rate_at, settings)
        off.append(np.abs(last.wear_depth - exact).max())
        assert off[-1] < sum(errors) / (0.73 * (0.8 if integrator == "euler" else 1.2))
    # a quarter of the tolerance: steps of a half and half the error, or of 0.63 and 0.4
    # times it
    assert off[1] < off[0] * (0.6 if integrator == "euler" else 0.5)


def test_uniform_wear_keeps_the_shape(state, solution, made_points):
    """Every vertex 0.4 mm inwards: the parallel curve, root of 13 mm radius included.

    To 1e-6 of the depth along the normal, and to 1e-4 sideways. Straight parts stay
    straight with their slope; where they meet the root, one vertex turns half way.
    """

    def rate_at(s):
        regime = np.full_like(s.regime_depth, 0.0)
        regime[:, 0] = 4e-9
        nothing = np.zeros_like(s.y)
        return WearRate(regime.sum(axis=1), regime, s.z, nothing, nothing, solution)

    settings = replace(SETTINGS, depth_cap=8e-6)
    last, _ = controlled(state, made_points([1.0]), rate_at, settings)
    normal_y, normal_z = vertex_normals(state.y[0], state.z[0])
    along = slice(3, -3)  # the ends of the profile have a neighbour on one side only
    moved = np.stack([last.y[0] - state.y[0], last.z[0] - state.z[0]])
    inwards = (moved * np.stack([normal_y, normal_z])).sum(axis=0)[along]
    assert np.abs(np.abs(inwards) / 0.4e-3 - 1.0).max() < 1e-6
    sideways = (moved * np.stack([-normal_z, normal_y])).sum(axis=0)[along]
    assert np.abs(sideways).max() < 1e-4 * 0.4e-3
    tread = state.y[0] > 0.0
    slope = np.diff(last.z[0][tread]) / np.diff(last.y[0][tread])
    np.testing.assert_allclose(slope[:-3], -0.05, rtol=1e-9)


def test_twice_the_coefficient_is_half_the_distance(
    evolution_of, scene_text, states_of
):
    """Of a collective one factor on all wear is a clock: 1e-9 of the depth; of blocks
    it is none.
    """

    def depth(kind, running, environment, km):
        blocks = [{**one, "environment": environment} for one in running]
        campaign = f"distance_km = {km}\npoint_spacing_mm = 0.5\nmax_step_depth_um = 5"
        of = evolution_of(scene_text(*blocks, kind=kind, campaign=campaign))
        return states_of(of)[-1].wear_depth

    spread = {"shift_mean_mm": 1, "shift_std_mm": 1.5, "positions": 10, "share": 1}
    one, two = (depth("field", [spread], k, 60 / k) for k in (0.5, 1.0))
    assert one.max() > 2e-6
    np.testing.assert_allclose(two, one, rtol=0.0, atol=1e-9 * one.max())
    programme = [
        {"shift_mm": -2, "distance_km": 40},
        {"shift_mm": 3, "distance_km": 40},
    ]
    one, two = (depth("rig", programme, k, 40 / k) for k in (0.5, 1.0))
    assert np.abs(two - one).max() > 0.05 * one.max()
