"""Explicit wear steps: what a small waviness of the profile does while it wears (spec
3.2).

With virtual penetration each strip answers to its own depth only: one step multiplies a
waviness by 1 - S, where S is the sum over the operating points of wear depth over
interpenetration.
"""

from dataclasses import replace

import numpy as np
import pytest
from stepping import step_over

from wearsim.campaign.evaluate import Setup, rate
from wearsim.campaign.state import State
from wearsim.campaign.step import StepRule
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.damage.wear import WearSettings
from wearsim.operation.points import OperatingPoints
from wearsim.profile import standard

SHIFTS = np.linspace(
    -4e-3, -1e-3, 7
)  # one patch on the tread each, wide against the waviness
AMPLITUDE, WAVELENGTH = 0.2e-6, 2.5e-3


def collective():
    n = SHIFTS.size
    one, zero = np.ones(n), np.zeros(n)
    conditions = ContactConditions(
        SHIFTS,
        5e-3 * one,
        zero,
        80e3 * one,
        20.0 * one,
        0.35 * one,
        zero,
        rotation="free",
    )
    return OperatingPoints(conditions, one / n, one, zero, ("",) * n)


def worn(wave, stability, steps, smoothing=0.0, integrator="euler"):
    """Heights of the right wheel after each step of the given S, started with a
    waviness of `wave` [m].
    """
    smooth = standard.wheel("S1002", spacing=0.25e-3)
    height = smooth.z + wave * np.sin(2.0 * np.pi * smooth.y / WAVELENGTH)
    wheelset = Wheelset(replace(smooth, z=height), smooth, 0.46, 0.75)
    counterface = Counterface(standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75), 0.0)
    models, wear, points = (
        ContactModels.of("fast", strips=60, cells=20, most_cells=20),
        WearSettings(),
        collective(),
    )
    y, z = np.stack([smooth.y, smooth.y]), np.stack([height, smooth.z])
    regimes, n = 3, smooth.y.size
    state = State(
        0,
        0.0,
        y,
        z,
        np.zeros((2, n)),
        np.zeros((2, regimes, n)),
        np.zeros(2),
        np.zeros(2),
    )
    heights = [state.z[0]]

    def rate_at(ahead):
        return rate(
            ahead, points, points.weight, Setup(wheelset, counterface, models, wear)
        )

    for _ in range(steps):
        now = rate_at(state)
        length = stability / now.stability[0].max()
        state = step_over(
            state, now, length, StepRule(0.46, 7850.0, smoothing, integrator), rate_at
        ).state
        heights.append(state.z[0])
    return smooth.y, np.array(heights), state.wear_depth[0]


def waviness(stability, steps, smoothing=0.0, integrator="euler"):
    """RMS of what the waviness leaves of itself in the worn band, step by step, over
    its first value.
    """
    y, wavy, depth = worn(AMPLITUDE, stability, steps, smoothing, integrator)
    _, plain, _ = worn(0.0, stability, steps, smoothing, integrator)
    band = depth > 0.5 * depth.max()
    assert np.ptp(y[band]) > 2.0 * WAVELENGTH
    left = (wavy - plain)[:, band]
    left = np.diff(
        left, 2, axis=1
    )  # shifts and tilts of the whole profile are not waviness
    rms = np.sqrt((left**2).mean(axis=1))
    return rms / rms[0]


@pytest.mark.parametrize("smoothing", [0.0, 3e-3])
def test_waviness_wears_off_below_the_limit(smoothing):
    """S = 0.4: each step leaves less, eight steps less than half."""
    left = waviness(0.4, 8, smoothing)
    assert np.all(np.diff(left) < 0.0)
    assert left[-1] < 0.5


@pytest.mark.parametrize("stability", [2.5, 4.0])
def test_waviness_grows_beyond_the_limit(stability):
    """One step multiplies by about 1 - S in the band where S is near its largest: the
    limit is not idle.
    """
    assert waviness(stability, 1)[-1] == pytest.approx(stability - 1.0, rel=0.15)


BEYOND = "measured 1.15 after six steps, 0.80 after eight; target 0.82, 0.5"


@pytest.mark.parametrize(
    "stability",
    [
        4.0,
        pytest.param(
            8.0, marks=[pytest.mark.slow, pytest.mark.xfail(strict=True, reason=BEYOND)]
        ),
    ],
)
def test_chebyshev_steps_damp_where_those_of_first_order_fail(stability):
    """With the smoothing campaigns run with: eight steps leave less than half, and no
    two of them add.
    """
    left = waviness(stability, 8, smoothing=2.5e-3, integrator="rkc")
    assert np.all(left[2:] < 1.1 * left[:-2])
    assert left[-1] < 0.5


def test_steps_of_first_order_of_that_length_break_the_contact_up():
    """S = 5: within eight steps the wheel stands on ripples of its own, although
    smoothed.
    """
    assert waviness(5.0, 8, smoothing=2.5e-3)[-1] > 2.0
