from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign.control import (
    choose,
    error_limit,
    half_space_rate,
    largest_step,
    present_block,
    reached,
    remembered_limit,
)
from wearsim.campaign.state import WearRate, spacing_of
from wearsim.errors import NumericalError
from wearsim.scene.campaign import ControlSettings

SETTINGS = ControlSettings(
    distance=100e3,
    depth_cap=8e-6,
    stability=0.4,
    smoothing_wavelength=0.0,
    integrator="rkc",
    max_step=50e3,
)


@pytest.fixture
def rate_of(state, solution):
    """Make a rate with given largest depth and stability per metre."""

    def make(depth, stability=0.0):
        regime_depth = np.zeros((2, 3, state.y.shape[1]))
        regime_depth[1, 0, 150] = depth
        field = np.zeros_like(state.y)
        field[0, 120] = stability
        return WearRate(
            depth=regime_depth.sum(axis=1),
            regime_depth=regime_depth,
            friction_work=np.zeros_like(state.y),
            stability=field,
            over_strain=np.zeros_like(state.y),
            solution=solution,
        )

    return make


@pytest.mark.parametrize(
    ("depth", "stability", "step", "reason"),
    [
        (8e-10, 1e-6, 10e3, "depth cap"),
        (8e-12, 2e-5, 20e3, "stability"),
        (8e-12, 1e-7, 50e3, "max step"),
        (0.0, 0.0, 50e3, "max step"),
    ],
)
def test_shortest_limit_wins(rate_of, state, depth, stability, step, reason):
    result = largest_step(rate_of(depth, stability), state, SETTINGS)
    assert result[:2] == (pytest.approx(step, rel=1e-12), reason)


def test_remaining_distance_ends_the_campaign(rate_of, state, made_points):
    state = replace(state, distance=97e3)
    points = made_points([0.4, 0.6])
    weight, (step, reason, _) = choose(state, points, lambda w: rate_of(0.0), SETTINGS)
    assert (step, reason) == (pytest.approx(3e3, rel=1e-12), "remaining distance")
    np.testing.assert_array_equal(weight, points.weight)
    assert not reached(state.distance, SETTINGS.distance)
    assert reached(state.distance + step, SETTINGS.distance)


def test_a_campaign_ends_within_the_rounding_of_its_distance():
    for share, ends in ((1.0 - 1e-13, True), (1.0, True), (1.0 - 1e-11, False)):
        assert reached(300.0 * share, 300.0) is ends


def test_depth_cap_acts_after_smoothing(rate_of, state):
    """A single vertex is spread by smoothing, so that a longer step is allowed."""
    sharp, _, _ = largest_step(rate_of(8e-10), state, SETTINGS)
    smooth, reason, _ = largest_step(
        rate_of(8e-10), state, replace(SETTINGS, smoothing_wavelength=2.5e-3)
    )
    assert reason == "depth cap"
    assert smooth > 3 * sharp


@pytest.fixture
def after(state):
    """Function that gives the state after a step of two points."""

    def made(length, error, weight=(0.5, 0.5)):
        weight = np.array(weight)
        known = {
            "point_length": weight * length,
            "point_error": np.where(weight > 0.0, error, 0.0),
        }
        known["point_stiffness"] = np.zeros(weight.size)
        return replace(state, distance=length, active_weight=weight, **known)

    return made


def test_first_steps_are_small_and_grow(rate_of, state, made_points, after):
    """Start at 1 um, at most three times as long from step to step up to the cap of 8
    um.
    """
    settings, points = replace(SETTINGS, first_depth=1e-6), made_points([0.5, 0.5])

    def next_step(state):
        return choose(state, points, lambda w: rate_of(8e-10), settings).limit

    lengths, reasons = [], []
    for _ in range(4):
        limit = next_step(state)
        lengths.append(limit.step_length)
        reasons.append(limit.reason)
        state = after(limit.step_length, 0.0)
    np.testing.assert_allclose(
        8e-10 * np.array(lengths), [1e-6, 3e-6, 8e-6, 8e-6], rtol=1e-12
    )
    assert reasons == ["first step", "growth", "depth cap", "depth cap"]
    # a point that acts for the first time
    new = next_step(after(10e3, 0.0, weight=(1.0, 0.0)))
    assert (new.step_length, new.reason) == (pytest.approx(1e-6 / 8e-10), "first step")


def test_half_space_limit_is_a_depth_per_step(rate_of, state):
    """Closed form: p0/E* dy with p0 = 1 GPa, E* = 115.4 GPa, at the distance of the
    vertices.
    """
    deep = 1e9 / 115.3846e9 * spacing_of(state)
    rate = rate_of(1e-10)
    assert half_space_rate(rate, state, 0.0) == 0.0
    strained = replace(rate, over_strain=rate.depth * 115.3846)
    assert half_space_rate(strained, state, 0.0) == pytest.approx(1e-10 / deep)
    assert largest_step(strained, state, SETTINGS)[:2] == (
        pytest.approx(deep / 1e-10),
        "stability",
    )
    # a larger stability number of strips does not lengthen it; steps twice as deep have
    # S = 8/3
    longer = replace(
        SETTINGS,
        stability=8.0,
        depth_cap=1.0,
        max_step=1e9,
        distance=1e9,
        half_space_depths=2.0,
    )
    step, reason, stiffness = largest_step(strained, state, longer)
    assert (step, reason) == (pytest.approx(2.0 * deep / 1e-10), "stability")
    assert stiffness * step == pytest.approx(8.0 / 3.0)


def test_observed_stiffness_keeps_the_step_stable_with_the_most_stages(rate_of, state):
    """Eight stages are stable up to S = 32.1; the observed decay counts 1.5 times."""
    settings = replace(SETTINGS, depth_cap=1.0, max_step=1e9, distance=1e9)
    free = largest_step(rate_of(1e-12), state, settings)
    assert free.reason == "remaining distance"
    stiff = largest_step(rate_of(1e-12), state, settings, stiffness=1e-3)
    assert stiff.reason == "stability"
    assert stiff.step_length == pytest.approx(32.1 / 1.5e-3, rel=1e-2)


def test_error_limits_the_step(rate_of, made_points, after):
    """Imposed: 0.9 of the length at which an error that grows with its cube keeps the
    tolerance.
    """
    settings = replace(SETTINGS, error_tolerance=0.125e-6, distance=1e6)
    points = made_points([0.5, 0.5])
    limit = choose(after(4e3, 1e-6), points, lambda w: rate_of(1e-12), settings).limit
    assert (limit.step_length, limit.reason) == (
        pytest.approx(0.9 * 2e3, rel=1e-12),
        "error",
    )
    # at first order, with the square
    euler = replace(settings, integrator="euler", error_tolerance=0.25e-6)
    assert error_limit(4e3, 1e-6, euler) == pytest.approx(0.9 * 2e3, rel=1e-12)
    assert error_limit(4e3, 0.0, settings) == error_limit(4e3, 1e-6, SETTINGS) == np.inf


def test_a_block_remembers_its_own_step(after):
    """A point that ran 1 km of 4 km may run as much alone; in a collective its share
    decides.
    """
    settings, before = (
        replace(SETTINGS, error_tolerance=1e-6),
        after(4e3, 0.0, weight=(0.25, 0.75)),
    )
    for weight, length in (((1.0, 0.0), 3e3), ((0.0, 1.0), 9e3), ((0.5, 0.5), 6e3)):
        assert remembered_limit(before, np.array(weight), settings) == (
            pytest.approx(length),
            "growth",
        )


def test_impossible_step_is_told(rate_of, state):
    with pytest.raises(NumericalError, match="no wear step is possible after 0 km"):
        largest_step(rate_of(np.inf), state, SETTINGS)


def test_no_sliver_before_the_end(rate_of, state, made_points):
    """10 km allowed, 11 km left: two halves instead of 10 and 1."""
    state = replace(state, distance=89e3)
    _, (step, reason, _) = choose(
        state, made_points([1.0]), lambda w: rate_of(8e-10), SETTINGS
    )
    assert (step, reason) == (pytest.approx(5.5e3, rel=1e-12), "depth cap")


class TestProgramme:
    """Blocks of 2, 1 and 3 km, and a monitoring point that belongs to none."""

    @pytest.fixture
    def programme(self, made_points):
        return made_points(
            [1 / 3, 1 / 6, 1 / 2, 0.0], block_length=[2e3, 1e3, 3e3, 0.0]
        )

    def test_several_loops_in_one_step(self, programme, rate_of, state):
        weight, (step, reason, _) = choose(
            state, programme, lambda w: rate_of(4e-10), SETTINGS
        )  # 20 km
        assert (step, reason) == (18e3, "depth cap")
        np.testing.assert_allclose(weight, programme.weight, rtol=1e-15)

    def test_last_loops_end_at_the_distance_asked_for(self, programme, rate_of, state):
        settings = replace(SETTINGS, distance=18e3 + 1e-6)
        weight, (step, reason, _) = choose(
            state, programme, lambda w: rate_of(0.0), settings
        )
        assert (step, reason) == (settings.distance, "remaining distance")
        np.testing.assert_allclose(weight, programme.weight, rtol=1e-15)

    @pytest.mark.parametrize(
        ("distance", "block", "step"),
        [
            (0.0, 0, 2e3),
            (2e3, 1, 1e3),
            (2.4e3, 1, 600.0),
            (3e3, 2, 2.5e3),
            (12e3 - 1e-7, 0, 2e3),
        ],
    )
    def test_short_step_stays_in_its_block(
        self, programme, rate_of, state, distance, block, step
    ):
        """A collective too harsh for a whole loop; single blocks allow 2.5 km."""

        def rate(weight):
            return rate_of(8e-6 / (2.5e3 if weight.max() == 1.0 else 5e3))

        # 3 km at 2.5 km allowed would leave a sliver: two steps of 1.5 km
        expected = 1.5e3 if distance == 3e3 else step
        weight, (result, reason, _) = choose(
            replace(state, distance=distance), programme, rate, SETTINGS
        )
        assert np.flatnonzero(weight).tolist() == [block]
        assert weight.sum() == 1.0
        assert result == pytest.approx(expected, rel=1e-9)
        assert reason == ("depth cap" if distance == 3e3 else "block border")

    def test_every_block_gets_its_distance(self, programme, rate_of, state):
        """Run to the end in blockwise steps: shares of the distance are the
        programme's, 1e-9.
        """
        settings = replace(SETTINGS, distance=12e3)
        run = np.zeros(4)
        steps = 0
        while not reached(state.distance, settings.distance):
            weight, (step, _, _) = choose(
                state, programme, lambda w: rate_of(8e-6 / 0.7e3), settings
            )
            run += weight * step
            state = replace(state, distance=state.distance + step)
            steps += 1
        np.testing.assert_allclose(run, [4e3, 2e3, 6e3, 0.0], rtol=1e-9)
        assert steps == 2 * (3 + 2 + 5)

    def test_shorter_than_a_loop(self, programme, rate_of, state):
        """A campaign that ends within the first loop runs only its first blocks."""
        settings = replace(SETTINGS, distance=2.5e3)
        state = replace(state, distance=2e3)
        weight, (step, reason, _) = choose(
            state, programme, lambda w: rate_of(0.0), settings
        )
        assert np.flatnonzero(weight).tolist() == [1]
        assert (step, reason) == (500.0, "remaining distance")

    def test_border_belongs_to_the_block_that_begins(self, programme):
        for loops in (0, 1, 10_000):
            start = loops * 6e3
            assert present_block(start, programme.block_length) == (
                0,
                pytest.approx(2e3),
            )
            assert present_block(start + 2e3, programme.block_length) == (
                1,
                pytest.approx(1e3),
            )
            assert present_block(start + 3e3 - 1e-7, programme.block_length)[0] == 2
            assert present_block(start + 3e3 + 1e3, programme.block_length) == (
                2,
                pytest.approx(2e3),
            )
