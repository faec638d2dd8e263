"""A standard shape as a chain of segments: heights, junctions, points."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.segment import Segment
from wearsim.profile.shape import FloatArray

STEP_TOLERANCE = 0.2e-6
"""Largest jump of z at a junction without a stated reason [m]: the rounding of good printed digits."""

KINK_TOLERANCE = 0.02e-3
"""Largest jump of the tangent angle at a junction without a stated reason [rad]."""


@dataclass(frozen=True)
class Allowance:
    """A junction at which the standard itself is not smooth.

    Parameters
    ----------
    between : tuple of str
        Zones on its flange (or gauge) side and on its field side; "*" is any zone.
    step : float
        Largest jump of z [m].
    kink : float
        Largest jump of the tangent angle [rad].
    reason : str
        Why.
    """

    between: tuple[str, str]
    step: float
    kink: float
    reason: str


@dataclass(frozen=True)
class Definition:
    """A standard shape as a chain of segments with rising y.

    Parameters
    ----------
    name, title : str
        Short name and the standard's designation.
    kind : {"wheel", "rail"}
        A rail is upright, y from its symmetry axis, unless `inclined_gauge_y` is given.
    segments : tuple of Segment
        From the flange back (wheel) or the gauge side (rail) to the field side.
    source, certainty : str
        Where the numbers come from, and how sure they are.
    allowances : tuple of Allowance
        Junctions that are not smooth, with the reason.
    inclined_gauge_y : float, optional
        Of a rail that is defined as it stands in the track: y of its gauge point [mm].
    """

    name: str
    title: str
    kind: Literal["wheel", "rail"]
    segments: tuple[Segment, ...]
    source: str
    certainty: str
    allowances: tuple[Allowance, ...] = ()
    inclined_gauge_y: float | None = None


def evaluate(definition: Definition, y: FloatArray) -> FloatArray:
    """Exact profile height of a definition.

    Parameters
    ----------
    definition : Definition
        Standard shape (a rail as it is defined, not placed).
    y : (n,) array
        Lateral positions [m]; at a junction the segment on the field side counts.

    Returns
    -------
    (n,) array
        z in the axes of `Profile` [m].
    """
    y_mm = np.asarray(y, dtype=np.float64) * 1e3
    starts = np.array([piece.start for piece in definition.segments])
    # a position given in metres may miss the end by the rounding of the unit
    low, high = starts[0] - 1e-9, definition.segments[-1].end + 1e-9
    if not np.all((y_mm >= low) & (y_mm <= high)):
        raise ProfileError(f"{definition.name} is defined from y = {starts[0]:g} to {high:.6g} mm only")
    which = np.clip(np.searchsorted(starts, y_mm, side="right") - 1, 0, None)
    z = np.empty_like(y_mm)
    for k, piece in enumerate(definition.segments):
        z[which == k] = piece.height(y_mm[which == k])
    return z * 1e-3


def junctions(definition: Definition) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misclosure of a definition at the junctions of its segments.

    Parameters
    ----------
    definition : Definition
        Standard shape.

    Returns
    -------
    y, step, kink : (n - 1,) array
        Place [m], jump of z [m] and of the tangent angle [rad], field side minus flange or gauge side.
    """
    pairs = list(pairwise(definition.segments))
    y = np.array([right.start for _, right in pairs])
    step, kink = np.empty_like(y), np.empty_like(y)
    for k, (left, right) in enumerate(pairs):
        at = y[k : k + 1]
        step[k] = (right.height(at) - left.height(at))[0]
        kink[k] = (right.angle(at) - left.angle(at))[0]
    return y * 1e-3, step * 1e-3, kink


def junction_faults(definition: Definition) -> list[str]:
    """Junctions of a definition that are neither smooth nor allowed.

    Parameters
    ----------
    definition : Definition
        Standard shape.

    Returns
    -------
    list of str
        One message per junction; empty if z is continuous within `STEP_TOLERANCE` and the tangent
        within `KINK_TOLERANCE`, or within what an allowance says.
    """
    faults = []
    chain = definition.segments
    for left, right in pairwise(chain):
        if left.end != right.start:
            faults.append(
                f"zone {left.zone!r} ends at y = {left.end:.9g} mm, zone {right.zone!r} begins at "
                f"{right.start:.9g} mm; both must be the same"
            )
    for k, (y, step, kink) in enumerate(zip(*junctions(definition), strict=True)):
        zones = chain[k].zone, chain[k + 1].zone
        allowed = [
            a
            for a in definition.allowances
            if all(w in ("*", z) for w, z in zip(a.between, zones, strict=True))
        ]
        most_step = max([STEP_TOLERANCE, *(a.step for a in allowed)])
        most_kink = max([KINK_TOLERANCE, *(a.kink for a in allowed)])
        if not (abs(step) <= most_step and abs(kink) <= most_kink):
            faults.append(
                f"zones {zones[0]!r} and {zones[1]!r} meet at y = {y * 1e3:.6g} mm with a step of "
                f"{step * 1e6:.3g} um and a kink of {kink * 1e3:.3g} mrad, more than {most_step * 1e6:g} um "
                f"or {most_kink * 1e3:g} mrad; correct the numbers, or allow it with its reason in [[allow]]"
            )
    return faults


def sample(definition: Definition, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Points on a definition at even arc length within each segment, all junctions included.

    Parameters
    ----------
    definition : Definition
        Standard shape.
    spacing : float
        Wanted distance of the points [m].

    Returns
    -------
    y, z : (n,) array
        Points [m].
    """
    if not 1e-6 <= spacing <= 2e-3:
        raise ProfileError(
            f"{definition.name}: point spacing = {spacing * 1e3:g} mm must be in 0.001 .. 2 mm"
        )
    y = [definition.segments[0].abscissae(spacing * 1e3)]
    y.extend(piece.abscissae(spacing * 1e3)[1:] for piece in definition.segments[1:])
    y_m = np.concatenate(y) * 1e-3
    return y_m, evaluate(definition, y_m)
