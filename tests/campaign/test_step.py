from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from stepping import step_over

from wearsim.campaign.evaluate import Setup, accumulate, passage_of
from wearsim.campaign.state import WearRate
from wearsim.campaign.step import (
    INTEGRATORS,
    StepRule,
    chebyshev_tableau,
    error_of,
    remove,
    smoothed,
    smoothed_at_end,
    stiffness_of,
)
from wearsim.contact.solve import ContactModels
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.errors import NumericalError
from wearsim.profile.shape import polygon_area_between, vertex_lengths

RULE = StepRule(
    radius=0.46, density=7850.0, smoothing_wavelength=2.5e-3, integrator="rkc"
)


def advance(*arguments, **options):
    """State at the end of a step."""
    return step_over(*arguments, **options).state


def worn(solution, points, weight, state, setup):
    """Wear rate of a contact solution."""
    return accumulate(passage_of(solution, setup), points, weight, state, setup)


@pytest.fixture
def rate_at(solution, points, wheelset):
    """Wear rate of a contact that stays where it is while the profile wears."""

    def at(state):
        return worn(
            solution,
            points,
            points.weight,
            state,
            Setup(wheelset, None, ContactModels.of("fast"), WearSettings()),
        )

    return at


def step_for(rate, depth):
    return depth / rate.depth.max()


@pytest.mark.parametrize("integrator", sorted(INTEGRATORS))
@pytest.mark.parametrize("wavelength", [0.0, 2.5e-3])
def test_polygons_lose_the_area_of_the_law(
    rate_at, state, wheelset, integrator, wavelength
):
    """Profile change against the law's area, 1e-9; patches at the flange root and on
    the tread.
    """
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    rule = replace(RULE, integrator=integrator, smoothing_wavelength=wavelength)
    after = advance(state, rate, length, rule, rate_at)
    for wheel in (0, 1):
        cells = vertex_lengths(state.y[wheel], state.z[wheel])
        removed = polygon_area_between(
            state.y[wheel], state.z[wheel], after.y[wheel], after.z[wheel]
        )
        assert removed == pytest.approx(after.worn_area[wheel], rel=1e-9)
        assert after.worn_area[wheel] == pytest.approx(
            (after.wear_depth[wheel] * cells).sum(), rel=1e-12
        )
        if integrator == "euler":
            law = length * (rate.depth[wheel] * cells).sum()
            assert after.worn_area[wheel] == pytest.approx(law, rel=1e-12)
    np.testing.assert_allclose(
        after.regime_depth.sum(axis=1), after.wear_depth, rtol=1e-12
    )
    assert after.wear_depth.min() >= 0.0


def test_two_stages_wear_the_mean_of_both_areas(rate_at, state):
    """Imposed, 1e-9: area worn = step times the mean of the rates' areas, each on its
    own polygon.
    """
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    ahead = advance(state, rate, length, replace(RULE, integrator="euler"), rate_at)
    after = advance(
        state, rate, length, RULE, rate_at, 1.0
    )  # its first stage is the end of Euler's step
    for wheel in (0, 1):
        areas = [
            (rate_at(s).depth[wheel] * vertex_lengths(s.y[wheel], s.z[wheel])).sum()
            for s in (state, ahead)
        ]
        assert after.worn_area[wheel] == pytest.approx(
            length * np.mean(areas), rel=1e-9
        )


def test_mass_is_that_of_the_strips(rate_at, state, solution, points):
    """Removed mass, 1e-12 without smoothing: each ring of the wheel passes once in its
    own 2 pi r.
    """
    rate = rate_at(state)
    length = step_for(rate, 8e-6)
    rule = replace(RULE, integrator="euler", smoothing_wavelength=0.0)
    after = advance(state, rate, length, rule, rate_at)
    depth = passage_depth(solution.fields, solution.area, WearSettings()).sum(axis=0)
    share = points.weight[solution.point] * points.environment[solution.point]
    volume = (depth * solution.fields.strip_width[:, None]).sum(
        axis=1
    ) * share  # per metre
    for wheel in (0, 1):
        mass = 7850.0 * length * volume[solution.side == wheel].sum()
        assert after.worn_mass[wheel] == pytest.approx(mass, rel=1e-12)


def test_smoothing_changes_the_mass_only_by_the_slope(rate_at, state):
    """Area is kept, so mass moves with the radius over 2.5 mm of a 70 degree flank:
    below 0.1 %.
    """
    rate = rate_at(state)
    sharp, smooth = (
        advance(
            state, rate, 1e3, replace(RULE, smoothing_wavelength=w), rate_at
        ).worn_mass
        for w in (0.0, 2.5e-3)
    )
    np.testing.assert_allclose(smooth, sharp, rtol=1e-3)


def test_wheels_changed_over_wear_changed_over(
    rate_at, state, solution, points, wheelset
):
    mirrored = replace(solution, side=1 - solution.side)

    def mirrored_rate_at(s):
        return worn(
            mirrored,
            points,
            points.weight,
            s,
            Setup(wheelset, None, ContactModels.of("fast"), WearSettings()),
        )

    here, there = state, state
    for _ in range(3):
        here = advance(here, rate_at(here), 2e4, RULE, rate_at)
        there = advance(there, mirrored_rate_at(there), 2e4, RULE, mirrored_rate_at)
    for name in ("y", "z", "wear_depth", "regime_depth", "worn_area", "worn_mass"):
        np.testing.assert_allclose(
            getattr(there, name), getattr(here, name)[::-1], rtol=1e-9, atol=1e-24
        )


def test_points_move_into_the_wheel(rate_at, state):
    """Against the closed form on the straight 1:20 cone: y by -d sin, z by -d cos of
    its slope.
    """
    after = advance(state, rate_at(state), 1e3, RULE, rate_at)
    at = int(np.argmin(np.abs(state.y[0] + 3e-3)))
    depth = after.wear_depth[0, at]
    slope = np.arctan(0.05)
    assert depth > 0.0
    assert after.z[0, at] - state.z[0, at] == pytest.approx(
        -depth * np.cos(slope), rel=1e-6
    )
    assert after.y[0, at] - state.y[0, at] == pytest.approx(
        -depth * np.sin(slope), rel=1e-6
    )


def test_counters(rate_at, state):
    after = advance(state, rate_at(state), 1e3, RULE, rate_at)
    after = advance(after, rate_at(after), 5e2, RULE, rate_at)
    assert (after.step, after.distance) == (2, 1.5e3)
    assert (after.worn_area > 0.0).all()


def test_without_wear_nothing_moves(state, solution):
    still = np.zeros_like(state.y)
    regime = np.zeros_like(state.regime_depth)
    rate = WearRate(still, regime, still, still, still, solution)
    after = advance(state, rate, 1e6, RULE, lambda s: rate)
    np.testing.assert_array_equal(after.y, state.y)
    np.testing.assert_array_equal(after.z, state.z)
    assert not after.worn_mass.any()


def fading(state, solution, fade):
    """Wear rate that fades with the depth worn so far, and its closed form of the
    largest depth.
    """
    pattern = np.zeros_like(state.regime_depth)
    pattern[:, 0] = np.exp(-((state.y / 5e-3) ** 2))
    pattern[1] *= 0.5

    def rate_at(s):
        regime = 1e-9 * pattern * np.exp(-s.wear_depth / fade)[:, None]
        nothing = np.zeros_like(s.z)
        return WearRate(regime.sum(axis=1), regime, s.z, nothing, nothing, solution)

    return (
        rate_at,
        lambda distance: fade * np.log1p(1e-9 * pattern.max() * distance / fade),
    )


@pytest.mark.parametrize(
    ("stability", "order"), [(None, 1), (1.0, 2), (4.0, 2), (8.0, 2)]
)
def test_order_of_convergence(state, solution, stability, order):
    """Error of the worn depth against a closed form: Euler, and two, three and four
    Chebyshev stages.
    """
    rate_at, exact = fading(state, solution, 20e-6)
    distance, n, error = 20e3, np.array([4, 8, 16]), []
    rule = replace(
        RULE, integrator="rkc" if stability else "euler", smoothing_wavelength=0.0
    )
    for count in n:
        s = state
        for _ in range(count):
            s = advance(s, rate_at(s), distance / count, rule, rate_at, stability)
        error.append(abs(s.wear_depth.max() / exact(distance) - 1.0))
    assert -np.polyfit(np.log(n), np.log(error), 1)[0] == pytest.approx(order, abs=0.15)
    assert error[-1] < {1: 2e-2, 2: 5e-4}[order]


@pytest.mark.parametrize("stages", [2, 3, 4, 8])
def test_stability_of_the_chebyshev_rules(stages):
    """On the test equation of stability number S: below 1 to their limit, 0.59 (s^2 -
    1), and of order 2.
    """
    tableau = chebyshev_tableau(stages)
    assert tableau.stable == pytest.approx(0.86 * 0.595 * (stages**2 - 1), rel=0.01)
    number = np.linspace(0.0, tableau.stable / 0.86, 1000)
    value = [np.ones_like(number)]
    for shares in tableau.shares[1:]:
        value.append(
            1.0 - number * sum(c * v for c, v in zip(shares, value, strict=False))
        )
    assert np.abs(value[-1])[1:].max() < 1.0
    assert value[-1][1] == pytest.approx(np.exp(-number[1]), abs=number[1] ** 3)


@pytest.mark.parametrize("stages", [2, 3, 8])
def test_stages_show_how_fast_waves_decay(state, solution, stages):
    """Against the coefficient c of a rate c (g - d); 0.5 % for the floor against noise
    and for stretches.
    """
    stiffness, gap = 3e-3, 20e-6 * (1.0 + np.cos(state.y / 1e-3))

    def rate_at(s):
        regime = np.zeros_like(s.regime_depth)
        regime[:, 1] = stiffness * (gap - s.wear_depth)
        nothing = np.zeros_like(s.z)
        return WearRate(regime.sum(axis=1), regime, s.z, s.z, nothing, solution)

    now, rule = (
        rate_at(state),
        replace(RULE, integrator="rkc", smoothing_wavelength=0.0),
    )
    tableau = chebyshev_tableau(stages)
    tried = step_over(
        state,
        now,
        0.9 * tableau.stable / stiffness,
        rule,
        rate_at,
        0.9 * tableau.stable,
    )
    assert tried.stages == stages
    shown = stiffness_of(
        tried, smoothed_at_end(state, tried.state, rate_at(tried.state), 0.0)
    )
    assert shown == pytest.approx(stiffness, rel=5e-3)


def test_the_rule_of_two_stages_is_that_of_heun(state, solution):
    np.testing.assert_allclose(
        INTEGRATORS["rkc"][0].shares, [[0, 0], [1, 0], [0.5, 0.5]], atol=1e-14
    )
    assert [len(one.shares) - 1 for one in INTEGRATORS["rkc"]] == list(range(2, 9))


@pytest.mark.parametrize("stability", [1.6, 4.4, 8.4])
def test_stiff_strip_is_worn_off_as_by_the_stability_polynomial(
    state, solution, stability
):
    """A strip whose rate is its interpenetration: a step leaves 1 - b T(w0) + b T(w0 -
    w1 S) of it.

    Equation (2.3) of Sommeijer, Shampine and Verwer, with the cosine of the Chebyshev
    polynomials; away from the edges of the strip, where the profile stretches.
    """
    gap, band = 50e-6, np.abs(state.y) < 4e-3

    def rate_at(s):
        regime = np.zeros_like(s.regime_depth)
        regime[:, 1] = 1e-6 * np.where(band, gap - s.wear_depth, 0.0)
        stiff, nothing = np.where(band, 1e-6, 0.0), np.zeros_like(s.z)
        return WearRate(regime.sum(axis=1), regime, s.z, stiff, nothing, solution)

    rule, after = replace(RULE, integrator="rkc", smoothing_wavelength=0.0), state
    for _ in range(4):
        before, step = (
            after,
            step_over(after, rate_at(after), stability / 1e-6, rule, rate_at),
        )
        after, n = step.state, step.stages
        w0 = 1.0 + 1.0 / n**2
        t = Chebyshev.basis(n)
        d, dd = t.deriv(1)(w0), t.deriv(2)(w0)
        left = 1.0 + dd / d**2 * (
            np.cos(n * np.arccos(w0 - d / dd * stability)) - t(w0)
        )
        assert 0.0 < left < 1.0
        inner = np.abs(state.y) < 3e-3
        ratio = (gap - after.wear_depth[inner]) / (gap - before.wear_depth[inner])
        np.testing.assert_allclose(ratio, left, rtol=1e-4)


def test_a_patch_that_leaves_is_clipped_and_keeps_its_area(state, solution):
    """Three stages weigh the first rate by -0.32: where the patch is gone the sum is
    negative and is cut.
    """
    bump = np.exp(-(((state.y[0] + 3e-3) / 2e-3) ** 2))

    def rate_at(s):
        regime = np.zeros_like(s.regime_depth)
        regime[:, 0] = 1e-9 * (bump if not s.wear_depth.any() else np.roll(bump, 30))
        nothing = np.zeros_like(s.z)
        return WearRate(regime.sum(axis=1), regime, s.z, nothing, nothing, solution)

    rule = replace(RULE, integrator="rkc", smoothing_wavelength=0.0)
    step = step_over(state, rate_at(state), 1e3, rule, rate_at, 4.0)
    assert 0.1 < step.clipped < 0.5
    assert step.state.wear_depth.min() == 0.0
    length = vertex_lengths(state.y[0], state.z[0])
    assert step.state.worn_area[0] == pytest.approx(
        1e-6 * (bump * length).sum(), rel=1e-2
    )


@pytest.mark.parametrize("stability", [None, 1.0, 4.0, 8.0])
def test_error_estimate(state, solution, stability):
    """Against the error of one step, in the ratio that both have by their expansions;
    15 % for the next term.

    With f' = -f / fade and f'' = f / fade^2 the error of the depth is e h^3 f^3 /
    fade^2 with e = 1/3 - sum(b c^2) / 2 - sum(b a c), the estimate has 0.8 (e + 1/6)
    for e; of Euler's rule it is 0.8 of the error.
    """
    rate_at, exact = fading(state, solution, 100e-6)
    rule = replace(
        RULE, integrator="rkc" if stability else "euler", smoothing_wavelength=0.0
    )
    now, distance = rate_at(state), 10e3
    step = step_over(state, now, distance, rule, rate_at, stability)
    after, ratio = step.state, 0.8
    if stability:
        shares = chebyshev_tableau(step.stages).shares
        a, b = shares[:-1], shares[-1]
        c = a.sum(axis=1)
        e = 1.0 / 3.0 - 0.5 * b @ c**2 - b @ a @ c
        ratio = 0.8 * (e + 1.0 / 6.0) / e
    estimate = error_of(
        state,
        after,
        smoothed(state, now, 0.0),
        smoothed_at_end(state, after, rate_at(after), 0.0),
    )
    pattern = now.depth[0] / now.depth.max()
    lost = 100e-6 * np.log1p(1e-9 * pattern * distance / 100e-6) - after.wear_depth[0]
    band = after.wear_depth[0] > 0.02 * after.wear_depth[0].max()
    length = vertex_lengths(after.y[0], after.z[0])
    error = np.sqrt((length * lost**2)[band].sum() / length[band].sum())
    assert estimate == pytest.approx(ratio * error, rel=0.15)
    assert abs(after.wear_depth.max() - exact(distance)) < (
        1e-6 if stability is None else 0.1e-6
    )


@pytest.mark.parametrize("worn", [slice(100, 102), slice(60, 140)])
def test_folded_profile_is_refused(state, worn):
    """Normals of a ridge of 2 mm radius meet in its centre: points moved 2.5 mm pass
    each other.
    """
    angle = np.linspace(0.75, 0.25, state.y.shape[1]) * np.pi
    ridge = replace(
        state,
        y=state.y * 0 + 2e-3 * np.cos(angle),
        z=state.z * 0 + 2e-3 * np.sin(angle),
    )
    depth = np.zeros_like(state.regime_depth)
    depth[1, 0, worn] = 2.5e-3
    with pytest.raises(NumericalError, match="step"):
        remove(ridge, depth, 1.0, RULE)
