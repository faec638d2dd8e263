from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign.evaluate import Setup, accumulate, passage_of
from wearsim.campaign.state import WearRate
from wearsim.campaign.step import INTEGRATORS, StepRule, advance, remove
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.errors import NumericalError
from wearsim.profile.shape import polygon_area_between, vertex_lengths

RULE = StepRule(radius=0.46, density=7850.0, smoothing_wavelength=2.5e-3, integrator="heun")


def worn(solution, points, weight, state, setup):
    """Wear rate of a contact solution."""
    return accumulate(passage_of(solution, setup), points, weight, state, setup)


@pytest.fixture
def rate_at(solution, points, wheelset):
    """Wear rate of a contact that stays where it is while the profile wears."""

    def at(state):
        return worn(solution, points, points.weight, state, Setup(wheelset, None, None, WearSettings()))

    return at


def step_for(rate, depth):
    return depth / rate.depth.max()


@pytest.mark.parametrize("integrator", sorted(INTEGRATORS))
@pytest.mark.parametrize("wavelength", [0.0, 2.5e-3])
def test_polygons_lose_the_area_of_the_law(rate_at, state, wheelset, integrator, wavelength):
    """Profile change against the law's area, 1e-9; patches at the flange root and on the tread."""
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    rule = replace(RULE, integrator=integrator, smoothing_wavelength=wavelength)
    after = advance(state, rate, length, rule, rate_at)
    for wheel in (0, 1):
        cells = vertex_lengths(state.y[wheel], state.z[wheel])
        removed = polygon_area_between(state.y[wheel], state.z[wheel], after.y[wheel], after.z[wheel])
        assert removed == pytest.approx(after.worn_area[wheel], rel=1e-9)
        assert after.worn_area[wheel] == pytest.approx((after.wear_depth[wheel] * cells).sum(), rel=1e-12)
        if integrator == "euler":
            law = length * (rate.depth[wheel] * cells).sum()
            assert after.worn_area[wheel] == pytest.approx(law, rel=1e-12)
    np.testing.assert_allclose(after.regime_depth.sum(axis=1), after.wear_depth, rtol=1e-12)
    assert after.wear_depth.min() >= 0.0


def test_heun_wears_the_mean_of_both_areas(rate_at, state):
    """Imposed, 1e-9: area worn = step times the mean of the rates' areas, each on its own polygon."""
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    ahead = advance(state, rate, length, replace(RULE, integrator="euler"), rate_at)
    after = advance(state, rate, length, RULE, rate_at)
    for wheel in (0, 1):
        areas = [
            (rate_at(s).depth[wheel] * vertex_lengths(s.y[wheel], s.z[wheel])).sum() for s in (state, ahead)
        ]
        assert after.worn_area[wheel] == pytest.approx(length * np.mean(areas), rel=1e-9)


def test_mass_is_that_of_the_strips(rate_at, state, solution, points):
    """Removed mass, 1e-12 without smoothing: each ring of the wheel passes once in its own 2 pi r."""
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    rule = replace(RULE, integrator="euler", smoothing_wavelength=0.0)
    after = advance(state, rate, length, rule, rate_at)
    depth = passage_depth(solution.fields, solution.area, WearSettings()).sum(axis=0)
    share = points.weight[solution.point] * points.environment[solution.point]
    volume = (depth * solution.fields.strip_width[:, None]).sum(axis=1) * share  # per metre
    for wheel in (0, 1):
        mass = 7850.0 * length * volume[solution.side == wheel].sum()
        assert after.worn_mass[wheel] == pytest.approx(mass, rel=1e-12)


def test_smoothing_changes_the_mass_only_by_the_slope(rate_at, state):
    """Area is kept, so mass moves with the radius over 2.5 mm of a 70 degree flank: below 0.1 %."""
    rate = rate_at(state)
    sharp, smooth = (
        advance(state, rate, 1e3, replace(RULE, smoothing_wavelength=w), rate_at).worn_mass
        for w in (0.0, 2.5e-3)
    )
    np.testing.assert_allclose(smooth, sharp, rtol=1e-3)


def test_wheels_changed_over_wear_changed_over(rate_at, state, solution, points, wheelset):
    mirrored = replace(solution, side=1 - solution.side)

    def mirrored_rate_at(s):
        return worn(mirrored, points, points.weight, s, Setup(wheelset, None, None, WearSettings()))

    here, there = state, state
    for _ in range(3):
        here = advance(here, rate_at(here), 2e4, RULE, rate_at)
        there = advance(there, mirrored_rate_at(there), 2e4, RULE, mirrored_rate_at)
    for name in ("y", "z", "wear_depth", "regime_depth", "worn_area", "worn_mass"):
        np.testing.assert_allclose(getattr(there, name), getattr(here, name)[::-1], rtol=1e-9, atol=1e-24)


def test_points_move_into_the_wheel(rate_at, state):
    """Against the closed form on the straight 1:20 cone: y by -d sin, z by -d cos of its slope."""
    after = advance(state, rate_at(state), 1e3, RULE, rate_at)
    at = int(np.argmin(np.abs(state.y[0] + 3e-3)))
    depth = after.wear_depth[0, at]
    slope = np.arctan(0.05)
    assert depth > 0.0
    assert after.z[0, at] - state.z[0, at] == pytest.approx(-depth * np.cos(slope), rel=1e-6)
    assert after.y[0, at] - state.y[0, at] == pytest.approx(-depth * np.sin(slope), rel=1e-6)


def test_counters(rate_at, state):
    after = advance(state, rate_at(state), 1e3, RULE, rate_at)
    after = advance(after, rate_at(after), 5e2, RULE, rate_at)
    assert (after.step, after.distance) == (2, 1.5e3)
    assert (after.worn_area > 0.0).all()


def test_without_wear_nothing_moves(state, solution):
    still = np.zeros_like(state.y)
    rate = WearRate(still, np.zeros_like(state.regime_depth), still, still, solution)
    after = advance(state, rate, 1e6, RULE, lambda s: rate)
    np.testing.assert_array_equal(after.y, state.y)
    np.testing.assert_array_equal(after.z, state.z)
    assert not after.worn_mass.any()


@pytest.mark.parametrize(("integrator", "order"), [("euler", 1), ("heun", 2), ("semi_implicit", 1)])
def test_order_of_convergence(state, solution, integrator, order):
    """Error of the worn depth against the closed form of a rate that fades with the depth worn so far."""
    fade = 20e-6
    pattern = np.zeros_like(state.regime_depth)
    pattern[:, 0] = np.exp(-((state.y / 5e-3) ** 2))

    def rate_at(s):
        regime = 1e-9 * pattern * np.exp(-s.wear_depth / fade)[:, None]
        depth = regime.sum(axis=1)
        return WearRate(depth, regime, s.z, s.z, solution, damping=depth / fade)

    distance = 20e3
    at = int(np.argmax(pattern[0, 0]))
    exact = fade * np.log1p(1e-9 * pattern[0, 0, at] * distance / fade)
    rule = replace(RULE, integrator=integrator, smoothing_wavelength=0.0)
    n = np.array([4, 8, 16])
    error = []
    for count in n:
        s = state
        for _ in range(count):
            s = advance(s, rate_at(s), distance / count, rule, rate_at)
        error.append(abs(s.wear_depth[0, at] / exact - 1.0))
    assert -np.polyfit(np.log(n), np.log(error), 1)[0] == pytest.approx(order, abs=0.15)
    assert error[-1] < {1: 2e-2, 2: 5e-4}[order]


@pytest.mark.parametrize("stability", [0.4, 1.9, 5.0, 50.0])
def test_semi_implicit_step_of_a_strip_with_virtual_penetration(state, solution, stability):
    """Imposed: what is left of the interpenetration is divided by 1 + S, however long the step is."""
    gap = 50e-6
    band = np.abs(state.y) < 4e-3

    def rate_at(s):
        regime = np.zeros_like(s.regime_depth)
        regime[:, 1] = 1e-6 * np.where(band, gap - s.wear_depth, 0.0)
        damping = np.where(band, 1e-6, 0.0)
        return WearRate(regime.sum(axis=1), regime, s.z, damping, solution, damping=damping)

    rule = replace(RULE, integrator="semi_implicit", smoothing_wavelength=0.0)
    after = state
    for count in range(1, 5):
        after = advance(after, rate_at(after), stability / 1e-6, rule, rate_at)
        left = gap - after.wear_depth[band]
        np.testing.assert_allclose(left, gap / (1.0 + stability) ** count, rtol=1e-9, atol=1e-12 * gap)


@pytest.mark.parametrize("integrator", ["euler", "heun"])
def test_error_estimate_is_the_error_of_the_first_order_rule(state, solution, integrator):
    """Against the closed form of one step of a fading rate; what is left is a sixth of depth over fade."""
    fade, depth = 100e-6, 3e-6
    pattern = np.zeros_like(state.regime_depth)
    pattern[0, 1] = np.exp(-((state.y[0] / 5e-3) ** 2))

    def rate_at(s):
        regime = 1e-9 * pattern * np.exp(-s.wear_depth / fade)[:, None]
        return WearRate(regime.sum(axis=1), regime, s.z, s.z, solution)

    rule = replace(RULE, integrator=integrator, smoothing_wavelength=0.0, estimate=True)
    after = advance(state, rate_at(state), depth / 1e-9, rule, rate_at)
    exact = fade * np.log1p(depth / fade)
    assert after.step_error == pytest.approx(depth * pattern.max() - exact, rel=1.1 / 6.0 * depth / fade)
    error = abs(after.wear_depth.max() - exact)
    assert error == pytest.approx(after.step_error, rel=0.01) if integrator == "euler" else error < 0.05e-6


def test_error_of_euler_is_not_looked_at_unless_asked_for(rate_at, state):
    after = advance(state, rate_at(state), 1e3, replace(RULE, integrator="euler"), None)
    assert after.step_error is None
    assert after.step_length == 1e3


@pytest.mark.parametrize("worn", [slice(100, 102), slice(60, 140)])
def test_folded_profile_is_refused(state, worn):
    """Normals of a ridge of 2 mm radius meet in its centre: points moved 2.5 mm pass each other."""
    angle = np.linspace(0.75, 0.25, state.y.shape[1]) * np.pi
    ridge = replace(state, y=state.y * 0 + 2e-3 * np.cos(angle), z=state.z * 0 + 2e-3 * np.sin(angle))
    depth = np.zeros_like(state.regime_depth)
    depth[1, 0, worn] = 2.5e-3
    with pytest.raises(NumericalError, match="step"):
        remove(ridge, depth, 1.0, replace(RULE, smoothing_wavelength=0.0))
