"""Published contact cases solved with our models: a dataset of their values, ours and half-space ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim import __version__
from wearsim.contact import geometry
from wearsim.contact.solve import ContactConditions, ContactSolution, Counterface, solve
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES
from wearsim.scene.published import Case, PublishedCases
from wearsim.studies.contact_state import contact_state

FloatArray = NDArray[np.float64]

RESULTS = (
    "area", "max_pressure", "length", "width", "slip_share", "force_x", "force_y",
    "spin_moment", "power",
)  # fmt: skip
MOTION = ("creepage_x", "creepage_y", "spin", "contact_angle")
ABOUT = ("centre", "touch")
TRENDS = {"area": -1, "max_pressure": 1, "length": -1, "width": 1, "slip_share": 1, "power": 1}
"""Quantities with a published trend over the roller's curvature: 1 rises, -1 falls."""


def solve_published(cases: PublishedCases) -> xr.Dataset:
    """Solve all cases on every rail profile.

    Parameters
    ----------
    cases : PublishedCases
        From a scene of kind "published".

    Returns
    -------
    Dataset
        Over `profile` and `case`: creepages and angle that follow from the motion (rotation speed without
        longitudinal creepage at zero shift), and `touch_offset`, where the undeformed bodies touch, in the
        contact plane from the pressure-weighted centre. Over `about` too: what the prescribed creepages
        give, held at the centre ("centre") or at the touching point ("touch"). `published_*` and
        `half_space_*` stand beside them, missing values filled with NaN by xarray's convention and
        never computed with. Over `trend_*`: wheel totals from curvature to curvature.

    Raises
    ------
    ContactError
        If a case has no contact, or several patches.
    """
    shape = (len(cases.profiles), len(cases.cases))
    motion: dict[str, FloatArray] = {name: np.zeros(shape) for name in MOTION}
    touch = np.zeros(shape)
    results = {name: np.zeros((len(ABOUT), *shape)) for name in RESULTS}
    for i, profile in enumerate(cases.profiles):
        for j, case in enumerate(cases.cases):
            moved = _solve(cases, profile, case, None)
            for name in MOTION:
                motion[name][i, j] = getattr(moved, name)[0]
            touch[i, j] = touch_offset(cases, profile, case, moved)
            x, y, spin = case.creepage
            for k, offset in enumerate((0.0, touch[i, j])):
                given = np.array([[x + spin * offset, y, spin]])
                for name, value in _results(_solve(cases, profile, case, given)).items():
                    results[name][k, i, j] = value[0]
    columns: dict[str, Any] = {
        "shift": ("case", np.array([case.shift for case in cases.cases])),
        "counterface_curvature": ("case", np.array([case.counterface_curvature for case in cases.cases])),
        "prescribed_creepage": (("case", "component"), np.array([case.creepage for case in cases.cases])),
        "touch_offset": (("profile", "case"), touch),
    }
    columns |= {f"motion_{name}": (("profile", "case"), value) for name, value in motion.items()}
    columns |= {name: (("about", "profile", "case"), value) for name, value in results.items()}
    columns |= _told(cases.cases)
    columns |= _trends(cases)
    dataset = xr.Dataset(
        columns,
        coords={"profile": list(cases.names), "about": list(ABOUT)},
        attrs={
            "title": cases.title,
            "published_source": cases.source,
            "remarks": cases.remarks.strip(),
            "wearsim_version": __version__,
            "scene": cases.scene_text,
            "normal_model": cases.models.normal,
            "tangential_model": cases.models.tangential,
            "strips": cases.models.strips,
            "cells": cases.models.cells,
            "normal_force": cases.normal_force,
            "speed": cases.speed,
            "friction": cases.friction,
        },
    )
    return _described(dataset)


def _conditions(cases: PublishedCases, shift: FloatArray) -> ContactConditions:
    def all_of(value: float) -> FloatArray:
        return np.full(shift.shape, value)

    return ContactConditions(
        shift=shift,
        yaw=all_of(0.0),
        roll=all_of(0.0),
        wheel_load=all_of(cases.normal_force),
        speed=all_of(cases.speed),
        friction=all_of(cases.friction),
        track_curvature=all_of(0.0),
        rotation="centred",
    )


def _solve(
    cases: PublishedCases, profile: Profile, case: Case, creepage: FloatArray | None
) -> ContactSolution:
    conditions = replace(_conditions(cases, np.array([case.shift])), creepage=creepage)
    counterface = Counterface(profile, case.counterface_curvature)
    try:
        return solve(conditions, cases.wheelset, counterface, cases.models, sides=(0,), vertical=False)
    except ContactError as error:
        raise type(error)(f"case {cases.cases.index(case) + 1} on {profile.name}: {error}") from None


def contact_states(cases: PublishedCases) -> list[xr.Dataset]:
    """Contact states of all cases on the first rail profile, with their prescribed creepages.

    Parameters
    ----------
    cases : PublishedCases
        From a scene of kind "published".

    Returns
    -------
    list of Dataset
        Of the right wheel; for the figures.
    """
    states = []
    for case in cases.cases:
        conditions = replace(_conditions(cases, np.array([case.shift])), creepage=np.array([case.creepage]))
        counterface = Counterface(cases.profiles[0], case.counterface_curvature)
        solution = _solve(cases, cases.profiles[0], case, np.array([case.creepage]))
        states.append(contact_state(conditions, cases.wheelset, counterface, solution))
    return states


def touch_offset(cases: PublishedCases, profile: Profile, case: Case, solution: ContactSolution) -> float:
    """Where the undeformed right wheel and counterface touch, in the contact plane of a solution [m].

    Parameters
    ----------
    cases : PublishedCases
        The wheelset.
    profile : Profile
        Of the counterface.
    case : Case
        Its shift and curvature.
    solution : ContactSolution
        Its pressure-weighted centre is the origin.

    Returns
    -------
    float
        Positive to the field side; from the lowest point of the gap, a parabola through three grid points.
    """
    wheelset = cases.wheelset
    contour = geometry.contour(profile)
    zero = np.zeros(1)
    gap = geometry.gap(
        geometry.rings(wheelset.right, wheelset.radius),
        contour,
        geometry.Attitude(np.array([case.shift]), zero, zero),
        half_span=wheelset.half_span,
        nominal_radius=wheelset.radius,
        curvature=case.counterface_curvature,
    ).gap[0]
    lowest = int(np.argmin(gap[1:-1])) + 1
    before, here, after = gap[lowest - 1 : lowest + 2]
    move = 0.5 * (before - after) / (before - 2.0 * here + after)
    y = np.interp(lowest + move, np.arange(contour.y.size), contour.y)
    z, centre_z = np.interp((y, solution.rail_y[0]), contour.y, contour.z)
    angle = solution.contact_angle[0]
    return float((y - solution.rail_y[0]) * np.cos(angle) + (z - centre_z) * np.sin(angle))


def _results(solution: ContactSolution) -> dict[str, FloatArray]:
    derived = {
        "length": solution.length,
        "width": solution.width,
        "slip_share": solution.slip_area / solution.area,
    }
    return {name: derived[name] if name in derived else getattr(solution, name) for name in RESULTS}


def _told(cases: tuple[Case, ...]) -> dict[str, Any]:
    """Return published and half-space values of the cases; NaN where a source has none."""

    def column(values: list[float | None]) -> tuple[str, FloatArray]:
        return "case", np.array([np.nan if value is None else value for value in values])

    columns: dict[str, Any] = {
        f"published_{name}": column([case.results.get(name) for case in cases])
        for name in RESULTS
        if any(name in case.results for case in cases)
    }
    for kind, names in (
        ("kinematics", ("creepage_x", "spin", "contact_angle")),
        *((k, RESULTS) for k in ABOUT),
    ):
        for name in names:
            values = [case.half_space.get(kind, {}).get(name) for case in cases]
            if any(value is not None for value in values):
                columns[f"half_space_{kind}_{name}"] = column(values)
    return columns


def _trends(cases: PublishedCases) -> dict[str, Any]:
    """Totals of the right wheel over shift and curvature, on the first profile; creepages from the motion."""
    if not cases.trend_shifts:
        return {}
    shifts = np.array(cases.trend_shifts)
    shape = (shifts.size, len(cases.trend_curvatures))
    totals = {name: np.zeros(shape) for name in TRENDS}
    patches = np.zeros(shape, np.int64)
    for j, curvature in enumerate(cases.trend_curvatures):
        solution = solve(
            _conditions(cases, shifts),
            cases.wheelset,
            Counterface(cases.profiles[0], curvature),
            cases.models,
            sides=(0,),
        )
        patches[:, j] = np.bincount(solution.point, minlength=shifts.size)
        first = np.searchsorted(solution.point, np.arange(shifts.size))
        values = _results(solution)
        for name in ("max_pressure", "length"):
            totals[name][:, j] = np.maximum.reduceat(values[name], first)
        for name in ("area", "width", "power"):
            totals[name][:, j] = np.add.reduceat(values[name], first)
        totals["slip_share"][:, j] = np.add.reduceat(solution.slip_area, first) / totals["area"][:, j]
    dims = ("trend_shift", "trend_curvature")
    return {
        "trend_shift": ("trend_shift", shifts),
        "trend_curvature": ("trend_curvature", np.array(cases.trend_curvatures)),
        "trend_patches": (dims, patches),
        **{f"trend_{name}": (dims, value) for name, value in totals.items()},
    }


def trend_exceptions(dataset: xr.Dataset) -> list[tuple[str, int, int]]:
    """Find where a quantity does not follow its published trend.

    Parameters
    ----------
    dataset : Dataset
        From `solve_published`.

    Returns
    -------
    list of (str, int, int)
        Quantity, index of the shift, index of the curvature at which it went the other way or stood still.
    """
    found = []
    for name, sign in TRENDS.items():
        change = np.diff(dataset[f"trend_{name}"].values, axis=1)
        found += [(name, int(i), int(j) + 1) for i, j in np.argwhere(sign * change <= 0.0)]
    return found


def _described(dataset: xr.Dataset) -> xr.Dataset:
    """Units and long names of the quantities, by the last part of each name that is in it."""
    for name, variable in dataset.variables.items():
        words = str(name).split("_")
        for start in range(len(words)):
            quantity = QUANTITIES.get("_".join(words[start:]))
            if quantity is not None:
                variable.attrs |= {"units": quantity.unit, "long_name": quantity.meaning}
                break
    return dataset
