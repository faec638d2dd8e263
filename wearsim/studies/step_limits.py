"""Wear steps within and beyond the limit in force: what a waviness does under each normal model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearsim.campaign.control import half_space_depth_limit
from wearsim.campaign.rate import rate
from wearsim.campaign.state import State, WearRate
from wearsim.campaign.step import advance
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings
from wearsim.errors import NumericalError
from wearsim.operation.points import OperatingPoints
from wearsim.profile import standard
from wearsim.profile.shape import Profile

FACTORS = (1.0, 2.0, 5.0, 10.0)
"""Lengths of a step, in steps that campaigns take at most."""

STABILITY = 0.4
"""Largest S of a step, what campaigns have unless their scene says otherwise."""

SPACING = 0.25e-3
AMPLITUDE = 0.2e-6
WAVELENGTHS = (0.5e-3, 2.5e-3)
"""The shortest wave that points 0.25 mm apart can carry, and one of half a patch."""

SMOOTHING = 0.0
"""None: smoothing would take the waves away that a step is judged by. Limits of depth are of the same."""

_SHIFTS = np.linspace(-4e-3, -1e-3, 7)  # one patch on the tread each


def step_limits(names: Sequence[str] = tuple(sorted(NORMAL_MODELS)), strips: int = 60) -> xr.Dataset:
    """Wear a wavy wheel in one step of several lengths with each normal model.

    Parameters
    ----------
    names : sequence of str
        Normal models; the tangential one is fastsim.
    strips : int
        Across a patch.

    Returns
    -------
    Dataset
        Over `normal`: limit in force, depth of the longest step it allows, whether the model may lead a
        profile update. Over `normal`, `wavelength` and `factor`: what one step leaves of the waviness, RMS
        over RMS (1: all of it), and the message where the step is refused.
    """
    shape = (len(names), len(WAVELENGTHS), len(FACTORS))
    left, told = np.full(shape, np.nan), np.full(shape, "", dtype=object)
    limit, depth = [], np.zeros(len(names))
    for k, name in enumerate(names):
        models = ContactModels(normal=name, strips=strips, cells=20)
        plain, still = _rate(models, 0.0, WAVELENGTHS[0])
        length, reason = _longest(still, models)
        limit.append(reason)
        depth[k] = length * still.regime_depth[0].sum(axis=0).max()
        band = still.regime_depth[0].sum(axis=0) > 0.5 * still.regime_depth[0].sum(axis=0).max()
        for j, wavelength in enumerate(WAVELENGTHS):
            wavy, now = _rate(models, AMPLITUDE, wavelength)
            before = _rms(wavy.z[0] - plain.z[0], band)
            for i, factor in enumerate(FACTORS):
                try:
                    ends = [_worn(s, r, factor * length) for s, r in ((wavy, now), (plain, still))]
                    left[k, j, i] = _rms(ends[0] - ends[1], band) / before
                except NumericalError as error:
                    told[k, j, i] = str(error)
    over = ("normal", "wavelength", "factor")
    return xr.Dataset(
        {
            "left": (over, left),
            "told": (over, told),
            "limit": ("normal", limit),
            "depth": ("normal", depth),
            "leads": ("normal", [NORMAL_MODELS[name].can_update_profile for name in names]),
        },
        coords={"normal": list(names), "wavelength": list(WAVELENGTHS), "factor": list(FACTORS)},
        attrs={"spacing": SPACING, "strips": strips},
    )


def _rate(models: ContactModels, amplitude: float, wavelength: float) -> tuple[State, WearRate]:
    """State and wear rate of S1002 with a waviness on the right wheel."""
    smooth = standard.wheel("S1002", spacing=SPACING)
    # Extremes on the points: the shortest wave would vanish with its zeros on them.
    wave = amplitude * np.cos(2.0 * np.pi * SPACING * np.arange(smooth.y.size) / wavelength)
    right: Profile = replace(smooth, z=smooth.z + wave)
    n = smooth.y.size
    state = State(
        0, 0.0, np.stack([right.y, smooth.y]), np.stack([right.z, smooth.z]),
        np.zeros((2, n)), np.zeros((2, 3, n)), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    one, zero = np.ones(_SHIFTS.size), np.zeros(_SHIFTS.size)
    conditions = ContactConditions(
        _SHIFTS, 5e-3 * one, zero, 80e3 * one, 20.0 * one, 0.35 * one, zero, rotation="free"
    )
    points = OperatingPoints(conditions, one / one.size, one, zero, ("",) * one.size)
    now = rate(
        state,
        points,
        points.weight,
        Wheelset(right, smooth, 0.46, 0.75),
        Counterface(standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75), 0.0),
        models,
        WearSettings(),
    )
    return state, now


def _longest(now: WearRate, models: ContactModels) -> tuple[float, str]:
    """Longest step [m] that stability allows the right wheel, and the limit."""
    weight = np.full(_SHIFTS.size, 1.0 / _SHIFTS.size)
    allowed = half_space_depth_limit(now, weight, models, SPACING, SMOOTHING)
    deepest = float(now.regime_depth[0].sum(axis=0).max())
    if math.isfinite(allowed):
        return allowed / deepest, "depth <= (p0/E*) x point distance"
    return STABILITY / float(now.stability[0].max()), f"S <= {STABILITY:g}"


def _worn(state: State, now: WearRate, length: float) -> FloatArray:
    """Heights of the right wheel after one step."""

    def no_other(_: State) -> WearRate:
        raise AssertionError("Euler's step looks at no other state")

    after = advance(
        state,
        now,
        length,
        radius=0.46,
        density=7850.0,
        smoothing_wavelength=SMOOTHING,
        integrator="euler",
        rate_at=no_other,
    )
    heights: FloatArray = after.z[0]
    return heights


def _rms(wave: FloatArray, band: Any) -> float:
    """RMS of the second differences: shifts and tilts of the profile are no waviness."""
    return float(np.sqrt((np.diff(wave[band], 2) ** 2).mean()))
