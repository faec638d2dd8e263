"""Noise of 1 um on a new profile: worn off or at least not made larger, by every model that may lead."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign.control import half_space_depth_limit, largest_step
from wearsim.campaign.rate import rate
from wearsim.campaign.state import State
from wearsim.campaign.step import advance
from wearsim.contact.normal import NEVER_LEADS, NORMAL_MODELS
from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings
from wearsim.operation.points import ControlSettings, OperatingPoints
from wearsim.profile import standard

SHIFTS = np.linspace(-4e-3, -1e-3, 5)
SPACING, NOISE = 0.25e-3, 1e-6


@pytest.mark.parametrize(("smoothing", "cap"), [(0.0, 8e-6), (2.5e-3, 8e-6), (2.5e-3, 1e-3)])
@pytest.mark.parametrize("normal", sorted(set(NORMAL_MODELS) - NEVER_LEADS))
def test_noise_does_not_grow(normal, smoothing, cap):
    """RMS second difference over the worn band in eight steps of the length campaigns take.

    Smoothing keeps the increments from the shortest waves, so that they stay as they are; without it they
    wear off. The strips are as wide as the points are apart: a model that does not see a wave cannot damp it.
    With the cap of campaigns it limits most steps; without one the limits of stability do.
    """
    smooth = standard.wheel("S1002", spacing=SPACING)
    noisy = smooth.z + NOISE * np.random.default_rng(5).standard_normal(smooth.y.size)
    n, one = smooth.y.size, np.ones(SHIFTS.size)
    conditions = ContactConditions(
        SHIFTS, 5e-3 * one, 0.0 * one, 80e3 * one, 20.0 * one, 0.35 * one, 0.0 * one, rotation="free"
    )
    points = OperatingPoints(conditions, one / one.size, one, 0.0 * one, ("",) * one.size)
    wheelset = Wheelset(replace(smooth, z=noisy), smooth, 0.46, 0.75)
    counterface = Counterface(standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75), 0.0)
    models = ContactModels(normal=normal, strips=60, cells=16)
    settings = ControlSettings(1e9, cap, 0.4, smoothing, "euler")
    y, z = np.stack([smooth.y, smooth.y]), np.stack([noisy, smooth.z])
    state = State(0, 0.0, y, z, np.zeros((2, n)), np.zeros((2, 3, n)), np.zeros(2), np.zeros(2))
    heights = [noisy]
    for _ in range(8):
        now = rate(state, points, points.weight, wheelset, counterface, models, WearSettings())
        limit = half_space_depth_limit(now, points.weight, models, SPACING, smoothing)
        length, _ = largest_step(now, state, settings, limit)
        options = {"smoothing_wavelength": smoothing, "integrator": "euler", "rate_at": None}
        state = advance(state, now, length, radius=0.46, density=7850.0, **options)
        heights.append(state.z[0])
    band = state.wear_depth[0] > 0.5 * state.wear_depth[0].max()
    assert band.sum() > 30
    bend = np.diff((np.array(heights) - smooth.z)[:, band], 2, axis=1)
    left = np.sqrt((bend**2).mean(axis=1))
    assert left[1:].max() < left[0]
    assert left[-1] < (0.999 if smoothing else 0.97) * left[0]
