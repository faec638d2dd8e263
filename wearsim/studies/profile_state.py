"""A profile with its measures, wear and running behaviour as a dataset: what its figures draw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import ProfileError
from wearsim.profile.alignment import Alignment
from wearsim.profile.measures import flange_gradient, flange_height, flange_thickness
from wearsim.profile.shape import Profile, extremum
from wearsim.profile.worn import WearBetween
from wearsim.quantities import QUANTITIES
from wearsim.studies.profile_examination import Comparison, Examination
from wearsim.studies.profile_running import Running
from wearsim.studies.profile_subject import Subject

GAUGE_POINTS = ("flange tip", "tape circle", "lower point of the flank", "upper point of the flank")
"""Order along `gauge_point`."""


GAUGED = ("flange_height", "flange_thickness", "flange_gradient")
"""Measures between them."""


def gauge_points(profile: Profile, level: float, below_tip: float, tape: float) -> np.ndarray | None:
    """Points between which Sh, Sd and qR are measured.

    Parameters
    ----------
    profile : Profile
        A wheel.
    level, below_tip, tape : float
        Distances of the measures [m].

    Returns
    -------
    (4, 2) array or None
        y and z of `GAUGE_POINTS` [m]; None for a wheel on which they cannot be found.
    """
    y, z = profile.y, profile.z
    try:
        height = flange_height(y, z)
        lower = flange_thickness(y, z, level=level, flange_back=tape) - tape
        upper = lower - flange_gradient(y, z, level=level, below_tip=below_tip)
    except ProfileError:
        return None
    tip_y, tip_z = extremum(y, z, int(np.argmax(z)))
    base = tip_z - height
    return np.array([[tip_y, tip_z], [0.0, base], [lower, base + level], [upper, tip_z - below_tip]])


def profile_state(
    profile: Profile,
    *,
    label: str,
    reference: Profile | None = None,
    reference_label: str = "",
    left: Profile | None = None,
    points: np.ndarray | None = None,
    distances: Mapping[str, float] | None = None,
    measures: Mapping[str, float] | None = None,
    wear: WearBetween | None = None,
    running: Running | None = None,
    reference_running: Running | None = None,
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Dataset of one profile.

    Parameters
    ----------
    profile : Profile
        Aligned with the reference, if there is one.
    label, reference_label : str
        Names in figures.
    reference : Profile, optional
        Drawn behind it.
    left : Profile, optional
        Left wheel of the axle, in the axes of a right one.
    points : (4, 2) array, optional
        From `gauge_points`, moved like the profile [m].
    distances : mapping of str to float, optional
        `level`, `below_tip` and `tape`, needed with `points` [m].
    measures : mapping of str to float, optional
        Sh, Sd and qR by their names as quantities, needed with `points` [m].
    wear : WearBetween, optional
        From the reference to the profile.
    running, reference_running : Running, optional
        Of a wheelset, and of one with the reference.
    attributes : mapping of str to str, optional
        Further texts for titles.

    Returns
    -------
    Dataset
        SI units. `profile_y, profile_z (point)`; with a reference `reference_y, reference_z`, with a left
        wheel `left_y, left_z`; with gauge points `gauge_y, gauge_z (gauge_point)` in the order of
        `GAUGE_POINTS` and the measures `GAUGED`; with wear `arc_length, wear_y, wear_depth (wear_point)`;
        with running behaviour `shift`, `rolling_radius_difference (shift)`, `amplitude` and
        `equivalent_conicity (amplitude)`, amplitudes without a conicity left out; the same with names
        beginning with `reference_`.
    """
    axes = ("profile_y", "profile_z") if profile.kind == "wheel" else ("counterface_y", "counterface_z")
    data: dict[str, Any] = {
        "profile_y": _variable(axes[0], ("point",), profile.y),
        "profile_z": _variable(axes[1], ("point",), profile.z),
    }
    for name, other in (("reference", reference), ("left", left)):
        if other is not None:
            data[f"{name}_y"] = _variable(axes[0], (f"{name}_point",), other.y)
            data[f"{name}_z"] = _variable(axes[1], (f"{name}_point",), other.z)
    if points is not None and measures is not None:
        data |= {name: _variable(name, (), measures[name]) for name in GAUGED}
        data["gauge_y"] = _variable(axes[0], ("gauge_point",), points[:, 0])
        data["gauge_z"] = _variable(axes[1], ("gauge_point",), points[:, 1])
    texts = {
        "label": label,
        "reference_label": reference_label,
        "left_label": "" if left is None else f"{left.name} (left wheel)",
        "kind": profile.kind,
        **{f"{name}_distance": value for name, value in (distances or {}).items()},
        **(attributes or {}),
    }
    if wear is not None:
        data["arc_length"] = _variable("arc_length", ("wear_point",), wear.s)
        data["wear_y"] = _variable(axes[0], ("wear_point",), wear.y)
        data["wear_depth"] = _variable("wear_depth", ("wear_point",), wear.depth)
        data["worn_area"] = _variable("worn_area", (), wear.worn_area)
    for before, run in (("", running), ("reference_", reference_running)):
        if run is None:
            continue
        known = [(a, value) for a, value, _ in run.conicity if value is not None]
        shifts, amplitudes = f"{before}shift", f"{before}amplitude"
        data |= {
            shifts: _variable("shift", (shifts,), run.shift),
            f"{before}rolling_radius_difference": _variable(
                "rolling_radius_difference", (shifts,), run.difference
            ),
            amplitudes: _variable("amplitude", (amplitudes,), [a for a, _ in known]),
            f"{before}equivalent_conicity": _variable(
                "equivalent_conicity", (amplitudes,), [value for _, value in known]
            ),
        }
    if running is not None:
        wheels = f"{running.wheel} and {running.left} (left)" if running.left else running.wheel
        texts["track"] = f"{wheels} on {running.track}"
    return xr.Dataset(data, attrs=texts)


def examination_state(found: Examination) -> xr.Dataset:
    """Dataset of an examined profile.

    Parameters
    ----------
    found : Examination
        With or without a comparison.

    Returns
    -------
    Dataset
        See `profile_state`.
    """
    subject, at, comparison = found.subject, found.circumstances, found.comparison
    distances = {
        "level": at.distances.level, "below_tip": at.distances.below_tip, "tape": at.distances.flange_back
    }  # fmt: skip
    points = gauge_points(subject.profile, **distances) if subject.kind == "wheel" else None
    if points is not None and comparison is not None:
        points = _moved(points, comparison.alignment)
    title = f"{subject.profile.name}: {subject.kind}, {subject.title}"
    exceeded = dict.fromkeys(each.measure for each in found.judgements if each.exceeded)
    lines = {"title": title, "exceeded": " ".join(exceeded)}
    beyond = [QUANTITIES[each.measure].meaning for each in found.left_judgements if each.exceeded]
    if found.left is not None and beyond:
        # its measures have no dimension lines: its label tells them
        told = ", ".join(dict.fromkeys(beyond))
        lines["left_label"] = f"{found.left.profile.name} (left wheel), beyond: {told} !"
    if comparison is not None:
        alignment = comparison.alignment
        lines["subtitle"] = f"laid on {comparison.reference.profile.name}: {alignment.rule}, {alignment.note}"
        lines["wear_note"] = comparison.wear.note
    if subject.kind == "rail":
        lines["origin"] = _origin(subject, comparison)
    return profile_state(
        found.laid,
        label=subject.profile.name,
        reference=None if comparison is None else comparison.reference.profile,
        reference_label="" if comparison is None else comparison.reference.profile.name,
        left=None if found.left is None else found.left.profile,
        points=points,
        distances=distances if points is not None else None,
        measures=found.measures.values if found.measures is not None else None,
        wear=None if comparison is None else comparison.wear,
        running=found.running,
        reference_running=None if comparison is None else comparison.running,
        attributes=lines,
    )


def _origin(rail: Subject, comparison: Comparison | None) -> str:
    """Where the lateral position of a rail is counted from."""
    if comparison is not None:
        return "in the track" if comparison.reference.upright else f"of {comparison.reference.profile.name}"
    return "as measured" if rail.measured else "from the symmetry axis" if rail.upright else "in the track"


def _moved(points: np.ndarray, alignment: Alignment) -> np.ndarray:
    """Points of a profile after its alignment."""
    c, s = np.cos(alignment.angle), np.sin(alignment.angle)
    turned = points @ np.array([[c, s], [-s, c]])
    return np.asarray(turned + np.array([alignment.dy, alignment.dz]))


def _variable(name: str, dimensions: tuple[str, ...], values: Any) -> xr.Variable:
    quantity = QUANTITIES[name]
    attributes = {"long_name": quantity.meaning, "units": quantity.unit or "1"}
    if quantity.sign:
        attributes["comment"] = quantity.sign
    return xr.Variable(dimensions, np.asarray(values, dtype=np.float64), attributes)
