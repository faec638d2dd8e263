"""Wear between two measurements of one wheel or rail."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import ProfileError, brief
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.profile.alignment import align as aligned
from wearsim.profile.shape import (
    FloatArray,
    Profile,
    arc_length,
    resample,
    vertex_normals,
)

LARGEST_DEPTH = 12e-3
"""Search range for the new profile along the normals of the old one [m].

It is the radius of the flange tip, beyond which normals cross.
"""

# least common share of the shorter profile; less is not the same section
_LEAST_COMMON = 0.5
_SPACING = 0.1e-3  # point distance [m]: the work grows with its square
_ROWS = 256  # points of the old profile whose normals are intersected at once


WHEEL_ZONES = {
    "flange": -38e-3,
    "flange root": -26e-3,
    "tread": 32e-3,
    "field side": math.inf,
}
"""Zones of a wheel and the y of their ends [m], defined by wearsim.

They are flange with its straight flank, flange root (fillet of S1002 and EPS), tread,
and field side (the straight end of S1002).
"""
ZONE_BORDERS = tuple(WHEEL_ZONES.values())[:-1]
"""y of the borders between the zones, rising [m]."""


WORN_AMOUNTS = {
    "flange_wear": "flange",
    "root_wear": "flange root",
    "tread_wear": "tread",
}
"""Zone of each worn amount."""


def worn_amounts(y: FloatArray, depth: FloatArray) -> dict[str, float]:
    """Largest wear depth on flange, flange root and tread of a wheel [m].

    Parameters
    ----------
    y : (n,) array
        Lateral positions on the wheel profile [m].
    depth : (n,) array
        Wear depth along the normal against the new profile [m].

    Returns
    -------
    dict
        `flange_wear`, `root_wear`, `tread_wear` [m], 0 where the zone has no points.

    Notes
    -----
    The zones are those of `WHEEL_ZONES`. A gauge that measures wear in one direction at
    one place, as railways use for condemning limits, may read less.
    """
    ends = [-math.inf, *WHEEL_ZONES.values()]
    bands = dict(zip(WHEEL_ZONES, pairwise(ends), strict=True))
    return {
        name: float(np.max(depth[(y >= low) & (y < high)], initial=0.0))
        for name, zone in WORN_AMOUNTS.items()
        for low, high in [bands[zone]]
    }


@dataclass(frozen=True)
class WearBetween:
    """Wear between two profiles, at m points of the compared part."""

    s: FloatArray = field(
        repr=False
    )  # (m,) arc length of the profile before, from its first point [m]
    y: FloatArray = field(repr=False)  # (m,) points of the profile before [m]
    z: FloatArray = field(repr=False)
    depth: FloatArray = field(
        repr=False
    )  # (m,) along its normal, positive where material was removed [m]
    worn_area: float  # between both profiles, removed less added [m2]
    max_wear_depth: float  # [m]
    max_wear_depth_y: float  # y of the largest depth [m]
    zone_areas: Mapping[str, float]  # share of each zone in the worn area [m2]
    compared_length: float  # arc length [m]
    length: float  # of the profile before [m]
    note: str  # compared part, in one sentence


def wear_between(
    before: Profile, after: Profile, align: str = "none", *, spacing: float = _SPACING
) -> WearBetween:
    r"""Wear depth and area between two profiles, such as two measurements of a wheel.

    Parameters
    ----------
    before, after : Profile
        Of one kind; their points need not correspond. Only the part both have is
        compared.
    align : {"none", "best_fit"}
        "none": both have the same axes already; "best_fit": the parts of `after` that
        do not wear are first aligned with those of `before`
        (`wearsim.profile.alignment`).
    spacing : float
        Distance of the points on which both are set [m].

    Returns
    -------
    WearBetween
        `depth` [m] at the points `y`, `z` of the profile before, `worn_area` [m2],
        `max_wear_depth` [m] and where it is, `zone_areas` [m2] by zone, and what was
        compared.

    Raises
    ------
    ProfileError
        The profiles are of different kinds, lack what the alignment holds, are more
        than 12 mm apart, or less than half of the shorter one has a counterpart.

    Notes
    -----
    Depth is where the normal of the old
    profile cuts the new one first; of several cuts, the nearest one that faces the same
    way. The area is that of the closed loop along the old profile, across, and back
    along the new one, exact for both polygons, and each zone ends at a normal, so zones
    add up to the whole. It equals the integral of :math:`d - \kappa d^2/2`.

    Examples
    --------
    >>> import wearsim
    >>> new = wearsim.standard_profile("S1002")
    >>> wear = wearsim.wear_between(new, wearsim.worn_profile("out/rig.nc", "right"))
    >>> 0.0 < wear.max_wear_depth < 1e-4
    True
    """
    if before.kind != after.kind:
        raise ProfileError(
            f"{before.name} is a {before.kind} and {after.name} a {after.kind}; give "
            "two alike"
        )
    if align not in ALIGNMENTS:
        raise ProfileError(
            f"align = {brief(repr(align))} is not one of {', '.join(ALIGNMENTS)}"
        )
    after = aligned(after, before, align).profile
    old, new = resample(before, spacing), resample(after, spacing)
    s = arc_length(old.y, old.z)
    outward = (
        -1.0 if before.kind == "rail" else 1.0
    )  # z points into a rail, out of a wheel
    normal = outward * np.stack(vertex_normals(old.y, old.z))
    depth, place = cut_along_normals(old, new, *normal)
    hit = np.flatnonzero(np.isfinite(depth))
    shorter = min(float(s[-1]), float(arc_length(new.y, new.z)[-1]))
    if len(hit) < 2 or s[hit[-1]] - s[hit[0]] < _LEAST_COMMON * shorter:
        raise ProfileError(
            f"{before.name} and {after.name} do not lie on each other; align them first"
        )
    first, last = int(hit[0]), int(hit[-1])
    if len(hit) <= last - first:
        lost = first + int(np.flatnonzero(~np.isfinite(depth[first : last + 1]))[0])
        raise ProfileError(
            f"{after.name} is nowhere within {1e3 * LARGEST_DEPTH:g} mm of "
            f"{before.name} along its normal at y = {1e3 * old.y[lost]:.4g} mm; align "
            "the profiles, or check that they are of one wheel"
        )
    part = slice(first, last + 1)
    swept = outward * _areas(old, new, part, depth, place, normal)
    zones = WHEEL_ZONES if before.kind == "wheel" else _rail_zones(before)
    which = _zone_of(old, part, zones)
    deepest = first + int(np.argmax(depth[part]))
    compared, length = float(s[last] - s[first]), float(s[-1])
    return WearBetween(
        s=s[part],
        y=old.y[part],
        z=old.z[part],
        depth=depth[part],
        worn_area=float(np.sum(swept)),
        max_wear_depth=float(depth[deepest]),
        max_wear_depth_y=float(old.y[deepest]),
        zone_areas={
            name: float(np.sum(swept[which == k])) for k, name in enumerate(zones)
        },
        compared_length=compared,
        length=length,
        note=(
            f"compared from y = {old.y[first] * 1e3:.4g} to {old.y[last] * 1e3:.4g} "
            f"mm: {compared * 1e3:.4g} mm of {length * 1e3:.4g} mm of {before.name}"
        ),
    )


def _rail_zones(rail: Profile) -> dict[str, float]:
    """Gauge corner, top and field side of a rail head, zones defined by wearsim.

    The corner and the field side are 10 mm wide, the top lies between.
    """
    first, last = float(rail.y.min()) + 10e-3, float(rail.y.max()) - 10e-3
    return {"gauge corner": first, "top": last, "field side": math.inf}


def cut_along_normals(
    old: Profile,
    new: Profile,
    ny: FloatArray,
    nz: FloatArray,
    reach: float = LARGEST_DEPTH,
) -> tuple[FloatArray, FloatArray]:
    """Depth at which the normals of a profile cut another one, and the cut position.

    Unit normals (n,) point into the material and are followed to either side over
    `reach` [m]. The depth (n,) [m] is positive where `new` lies within the material.
    The position (n,) is edge number plus fraction on the polygon of `new`. Both are NaN
    without a cut.
    """
    dy, dz = np.diff(new.y), np.diff(new.z)
    depth, place = np.full(len(old.y), np.nan), np.full(len(old.y), np.nan)
    for start in range(0, len(old.y), _ROWS):
        rows = slice(start, start + _ROWS)
        vy, vz = ny[rows, None], nz[rows, None]
        ay, az = new.y[:-1] - old.y[rows, None], new.z[:-1] - old.z[rows, None]
        facing = (
            vy * dz - vz * dy
        )  # the same sign as of an edge perpendicular to the normal
        facing_right = facing < 0.0 if old.kind == "rail" else facing > 0.0
        safe = np.where(facing_right, facing, 1.0)
        along = (ay * dz - az * dy) / safe
        fraction = (ay * vz - az * vy) / safe
        good = (
            facing_right
            & (fraction >= 0.0)
            & (fraction <= 1.0)
            & (np.abs(along) <= reach)
        )
        distance = np.where(good, np.abs(along), np.inf)
        least = np.argmin(distance, axis=1)
        row = np.arange(len(least))
        hit = np.isfinite(distance[row, least])
        depth[rows] = np.where(hit, along[row, least], np.nan)
        place[rows] = np.where(hit, least + fraction[row, least], np.nan)
    return depth, place


def _areas(
    old: Profile,
    new: Profile,
    part: slice,
    depth: FloatArray,
    place: FloatArray,
    normal: FloatArray,
) -> FloatArray:
    """Signed area between neighbouring normals, both polygons exact; z outward [m2]."""
    oy, oz, d, at = old.y[part], old.z[part], depth[part], place[part]
    hy, hz = oy + d * normal[0, part], oz + d * normal[1, part]
    # quadrilateral between two normals, by half the cross product of its diagonals
    swept = 0.5 * (
        (hy[1:] - oy[:-1]) * (oz[1:] - hz[:-1])
        - (hz[1:] - oz[:-1]) * (oy[1:] - hy[:-1])
    )
    # Add the area between the new polygon and the side between its two cuts, where it
    # has vertices there.
    middle = len(oy) // 2
    ry, rz = float(oy[middle]), float(oz[middle])
    edge = 0.5 * (
        (new.y[:-1] - ry) * np.diff(new.z) - (new.z[:-1] - rz) * np.diff(new.y)
    )
    whole = np.concatenate(([0.0], np.cumsum(edge)))
    k = np.minimum(at.astype(np.int64), len(edge) - 1)
    begun = 0.5 * (
        (new.y[k] - ry) * (hz - new.z[k]) - (new.z[k] - rz) * (hy - new.y[k])
    )
    side = 0.5 * ((hy[:-1] - ry) * np.diff(hz) - (hz[:-1] - rz) * np.diff(hy))
    bulge = np.diff(whole[k] + begun) - side
    return swept + np.where(np.ceil(at[1:]) - np.floor(at[:-1]) > 1.0, bulge, 0.0)


def _zone_of(old: Profile, part: slice, zones: Mapping[str, float]) -> NDArray[np.intp]:
    """Zone number of each edge of the compared part.

    Edges before the flange tip belong to the first zone.
    """
    middle = 0.5 * (old.y[part][1:] + old.y[part][:-1])
    reach = np.maximum.accumulate(middle)
    return np.searchsorted(list(zones.values()), reach, side="left")
