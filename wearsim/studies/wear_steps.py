"""Wear steps within and beyond what control allows: what becomes of a little noise on a new wheel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearsim.campaign.control import half_space_depth_limit, largest_step
from wearsim.campaign.rate import rate
from wearsim.campaign.state import State, WearRate
from wearsim.campaign.step import advance
from wearsim.contact.normal import ANSWERS_BY_STRIP
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.damage.wear import WearSettings, regimes
from wearsim.errors import WearsimError
from wearsim.operation.points import ControlSettings, OperatingPoints
from wearsim.profile import standard
from wearsim.profile.smoothing import smoothing_spline
from wearsim.profile.shape import arc_length, vertex_lengths

if TYPE_CHECKING:
    from wearsim.scene import WearStepsScene

SPACING, RADIUS, HALF_SPAN, DENSITY = 0.25e-3, 0.46, 0.75, 7850.0
SHIFTS = np.linspace(-4e-3, -1e-3, 7)
WAVELENGTH = 2.5e-3
RIPPLE = 4e-3
"""Waves in the worn depth shorter than this are ripple: the running band itself is far wider [m]."""


@dataclass(frozen=True)
class Case:
    """How one campaign takes its steps.

    Parameters
    ----------
    normal : str
        Normal contact model.
    text : str
        For table and figure.
    factor : float
        Length of the steps over the longest that is stable (S = 1 or the depth limit of a half-space);
        0: the control of campaigns decides.
    smoothing : float
        Wavelength of the smoothing [m].
    integrator : str
        Name in the registry of `campaign.step`.
    """

    normal: str
    text: str
    factor: float
    smoothing: float
    integrator: str = "euler"


def cases_of(normal: str, factor: float) -> tuple[Case, ...]:
    """Make the cases of one model.

    Parameters
    ----------
    normal : str
        Normal contact model.
    factor : float
        How far beyond the limit the steps without control are.

    Returns
    -------
    tuple of Case
        Control on; the longer steps without smoothing and with it; where the model allows it the longer
        steps with the semi-implicit rule.
    """
    found = [
        Case(normal, "control on", 0.0, WAVELENGTH, "heun"),
        Case(normal, "beyond the limit, no smoothing", factor, 0.0),
        Case(normal, "beyond the limit, smoothed", factor, WAVELENGTH),
    ]
    if normal in ANSWERS_BY_STRIP:
        found.append(
            Case(normal, "beyond the limit, smoothed, semi-implicit", factor, WAVELENGTH, "semi_implicit")
        )
    return tuple(found)


def solve_scene(scene: WearStepsScene) -> list[xr.Dataset]:
    """Wear the wheel in every way that a scene asks for.

    Parameters
    ----------
    scene : WearStepsScene
        As loaded.

    Returns
    -------
    list of Dataset
        One per model.
    """
    return [
        solve_wear_steps(
            cases_of(model.normal, model.beyond),
            1e-6 * model.depth_um,
            1e-6 * scene.noise_um,
            scene.strips,
            scene.cells,
        )
        for model in scene.models
    ]


def solve_wear_steps(
    cases: Sequence[Case], depth: float, noise: float, strips: int, cells: int
) -> xr.Dataset:
    """Wear the same new wheel in every way.

    Parameters
    ----------
    cases : sequence of Case
        Ways to take steps.
    depth : float
        Largest wear depth to reach [m].
    noise : float
        Standard deviation of the heights of the new profile's points [m].
    strips, cells : int
        Of each patch.

    Returns
    -------
    Dataset
        `wear_depth(case, point)` of the right wheel at the end and `y(point)` [m]; `ripple(case, step)`,
        RMS of what is shorter than `RIPPLE` in the depth over the running band, and `depth(case, step)`
        [m], missing beyond the last step; `told(case)`, why a case ended early.
    """
    found = [_wear(case, depth, noise, strips, cells) for case in cases]
    longest = max(len(entry[1]) for entry in found)

    def padded(values: Sequence[float]) -> FloatArray:
        return np.concatenate([values, np.full(longest - len(values), np.nan)])

    wheel = standard.wheel("S1002", spacing=SPACING)
    return xr.Dataset(
        {
            "normal": ("case", [case.normal for case in cases]),
            "text": ("case", [case.text for case in cases]),
            "factor": ("case", [case.factor for case in cases]),
            "told": ("case", [entry[3] for entry in found]),
            "steps": ("case", [len(entry[1]) for entry in found]),
            "y": ("point", wheel.y),
            "wear_depth": (("case", "point"), np.array([entry[0] for entry in found])),
            "depth": (("case", "step"), np.array([padded(entry[1]) for entry in found])),
            "ripple": (("case", "step"), np.array([padded(entry[2]) for entry in found])),
        },
        attrs={"target": depth, "noise": noise, "strips": strips, "cells": cells},
    )


def _wear(
    case: Case, depth: float, noise: float, strips: int, cells: int
) -> tuple[FloatArray, list[float], list[float], str]:
    """Depth at the end, largest depth and ripple after each step, and why it ended early."""
    new = standard.wheel("S1002", spacing=SPACING)
    height = new.z + noise * np.random.default_rng(7).standard_normal(new.z.size)
    n, one = new.y.size, np.ones(SHIFTS.size)
    points = OperatingPoints(
        ContactConditions(SHIFTS, 5e-3 * one, 0.0 * one, 80e3 * one, 20.0 * one, 0.35 * one, 0.0 * one),
        one / one.size,
        one,
        0.0 * one,
        tuple(f"{1e3 * shift:g} mm" for shift in SHIFTS),
    )
    wheelset = Wheelset(replace(new, z=height), new, RADIUS, HALF_SPAN)
    counterface = Counterface(standard.rail("60E1", 1.0 / 40.0, 1.435, HALF_SPAN), 0.0)
    models = ContactModels(normal=case.normal, strips=strips, cells=cells)
    wear = WearSettings()
    settings = ControlSettings(1e12, 8e-6, 0.4, case.smoothing, case.integrator)
    y, z = np.stack([new.y, new.y]), np.stack([height, new.z])
    blank = np.zeros((2, len(regimes(wear.law)), n))
    state = State(0, 0.0, y, z, np.zeros((2, n)), blank, np.zeros(2), np.zeros(2))

    def rate_at(ahead: State) -> WearRate:
        return rate(ahead, points, points.weight, wheelset, counterface, models, wear)

    depths: list[float] = []
    ripples: list[float] = []
    try:
        while not depths or depths[-1] < depth:
            now = rate_at(state)
            wave = 0.0 if case.factor else case.smoothing
            limit = half_space_depth_limit(now, points.weight, models, SPACING, wave)
            if case.factor:
                steepest = float(now.stability.max())
                stable = 1.0 / steepest if math.isinf(limit) else limit / float(now.depth.max())
                length = case.factor * stable
            else:
                length, _ = largest_step(now, state, settings, limit)
            state = advance(
                state,
                now,
                length,
                radius=RADIUS,
                density=DENSITY,
                smoothing_wavelength=case.smoothing,
                integrator=case.integrator,
                rate_at=rate_at,
            )
            depths.append(float(state.wear_depth[0].max()))
            ripples.append(ripple(new.y, new.z, state.wear_depth[0]))
    except WearsimError as error:
        return state.wear_depth[0], depths, ripples, str(error)
    return state.wear_depth[0], depths, ripples, ""


def ripple(y: FloatArray, z: FloatArray, depth: FloatArray) -> float:
    """RMS of what is shorter than `RIPPLE` in a wear depth, over the half of the band that wears most.

    Parameters
    ----------
    y, z : (n,) array
        Profile [m].
    depth : (n,) array
        Wear depth at its points [m].

    Returns
    -------
    float
        [m]
    """
    long = smoothing_spline(arc_length(y, z), depth[None], vertex_lengths(y, z), RIPPLE)[0]
    band = long > 0.5 * long.max()
    return float(np.sqrt(((depth - long)[band] ** 2).mean()))
