"""Reprofiling a worn wheel to a template profile with the least loss of diameter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.measures import running_circle_level
from wearsim.profile.shape import FloatArray, Profile

_AT_ONCE = 256  # number of heights of a polygon that are evaluated together


@dataclass(frozen=True)
class Reprofiling:
    """A wheel after reprofiling."""

    profile: Profile = field(
        repr=False
    )  # the template where it was cut, in the axes of the worn profile
    # Displacement of the template inwards from the position with its running circle at
    # z = 0 [m]. In the axes of the new wheel it is the whole loss of radius, by wear
    # and reprofiling.
    depth: float
    # Loss of diameter at the running circle by reprofiling [m].
    radius_loss: float
    place: float  # y of the tightest place, where the cut equals `slack` [m]
    # Radius removed beyond what the wheel needs: 0, or the loss due to its partner [m].
    slack: float
    start: float  # y from which the template was compared with the worn profile [m]
    end: float


def reprofile(worn: Profile, template: Profile) -> Reprofiling:
    r"""Reprofile a wheel to a template with the least loss of diameter.

    The template is moved inwards until the worn wheel contains it.

    Parameters
    ----------
    worn, template : Profile
        Wheels, y from the same origin; the template with its own flange thickness and
        its running circle at z = 0.

    Returns
    -------
    Reprofiling
        With the least loss of diameter.

    Raises
    ------
    ProfileError
        A wheel without a flange, or the worn profile does not reach from the template's
        flange tip past the running circle.

    Notes
    -----
    The loss is the largest of :math:`z_T(y) - z_W(y)` from the template's flange tip to
    where the first of both profiles ends; the flange back is where both are held. Both
    are polygons, so the largest one is at a vertex of either and exact. Where a polygon
    turns back, the template's upper and the worn wheel's lower branch count: below it
    the wheel is whole. A flank of slope :math:`\tan\delta` worn sideways by w costs
    :math:`w \tan\delta` of radius: 2.7 w on a flank of 70 degrees.
    """
    start = float(template.y[int(np.argmax(template.z))])
    end = min(float(worn.y.max()), float(template.y.max()))
    if float(worn.y.min()) > start or end <= 0.0:
        raise ProfileError(
            f"{worn.name} reaches from y = {1e3 * worn.y.min():.4g} to "
            f"{1e3 * worn.y.max():.4g} mm; to be reprofiled to {template.name} it must "
            f"be known from its flange tip ({1e3 * start:.4g} mm) past the running "
            "circle"
        )
    inner = np.concatenate((worn.y, template.y))
    at = np.unique(
        np.concatenate(((start, end), inner[(inner > start) & (inner < end)]))
    )
    missing = _heights(template, at, 1.0) - _heights(worn, at, -1.0)
    tight = int(np.argmax(missing))
    level, new_level = (
        running_circle_level(profile.y, profile.z) for profile in (worn, template)
    )
    depth = float(missing[tight])
    return Reprofiling(
        profile=replace(template, z=template.z - depth),
        depth=depth,
        radius_loss=level - (new_level - depth),
        place=float(at[tight]),
        slack=0.0,
        start=start,
        end=end,
    )


def reprofile_axle(
    right: Profile,
    left: Profile,
    templates: tuple[Profile, Profile],
    radii: tuple[float, float] = (0.0, 0.0),
) -> tuple[Reprofiling, Reprofiling]:
    """Reprofile both worn wheels of an axle to one diameter.

    It is the smaller of the diameters that the wheels could have separately.

    Right comes before left in the wheels, their templates, and their radii at z = 0 of
    the worn profiles [m]; equal ones need not be given.
    """
    alone = (reprofile(right, templates[0]), reprofile(left, templates[1]))
    left_in_new = [
        radius - reprofiled.depth
        for radius, reprofiled in zip(radii, alone, strict=True)
    ]
    first, second = (new_radius - min(left_in_new) for new_radius in left_in_new)
    return _deeper(alone[0], first), _deeper(alone[1], second)


def _deeper(reprofiling: Reprofiling, more: float) -> Reprofiling:
    """Reprofile with an additional loss of radius."""
    return replace(
        reprofiling,
        profile=replace(reprofiling.profile, z=reprofiling.profile.z - more),
        depth=reprofiling.depth + more,
        radius_loss=reprofiling.radius_loss + more,
        slack=more,
    )


def _heights(profile: Profile, at: FloatArray, side: float) -> FloatArray:
    """Height of a polygon's upper (1) or lower (-1) branch at each y it reaches [m]."""
    y, z = profile.y, profile.z
    low, high = np.minimum(y[:-1], y[1:]), np.maximum(y[:-1], y[1:])
    run = np.diff(y)
    upright = run == 0.0
    slope = np.diff(z) / np.where(upright, 1.0, run)
    ends = np.maximum(side * z[:-1], side * z[1:])
    heights = np.empty_like(at)
    for first in range(0, len(at), _AT_ONCE):
        position = at[first : first + _AT_ONCE, None]
        # Count from the nearer end of an edge, so that its ends are met to the last
        # bit.
        nearer = np.abs(position - y[:-1]) <= np.abs(position - y[1:])
        on_edge = np.where(
            nearer,
            z[:-1] + slope * (position - y[:-1]),
            z[1:] + slope * (position - y[1:]),
        )
        value = np.where(upright, ends, side * on_edge)
        heights[first : first + _AT_ONCE] = np.where(
            (low <= position) & (position <= high), value, -np.inf
        ).max(axis=1)
    return side * heights
