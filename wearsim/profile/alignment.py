"""Alignment of a measured profile with a reference by the parts that do not wear."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import ProfileError
from wearsim.profile.shape import (
    FloatArray,
    Profile,
    extremum,
    resample,
    vertex_lengths,
)

# slope above which a piece of the reference is flange back
_STEEPEST = math.radians(80.0)
_FEWEST = 5  # least number of points in a zone
# point distance of the reference [m]: chords deviate by 0.1 um on a radius of 12 mm
_SPACING = 0.1e-3
_CLOSE = 1e-10  # change of the shift below which the fit has converged [m]
# Change that is accepted if single points enter and leave a zone at its border [m].
_SETTLED = 1e-7
_HUBER, _TUKEY = 1.345, 4.685  # in standard deviations; 95 % efficient for normal noise
_WEAKEST = 1e-4  # least mean square of the normals in the weakest direction
_ROUNDS, _FIRST_ROUNDS = 200, 30  # largest numbers of steps
_ARM = 50e-3  # lever arm that makes an angle comparable to a shift [m]


class _Zone(NamedTuple):
    """Zone of the reference, in its axes, to which a measured profile is fitted.

    Ranges of y and z [m]. A profile without points in a required zone raises an error.
    """

    name: str
    y: tuple[float, float]
    z: tuple[float, float] = (-math.inf, math.inf)
    needed: bool = True


_EVERYWHERE = (_Zone("the whole profile", (-math.inf, math.inf)),)


def _zones(reference: Profile) -> tuple[_Zone, ...]:
    """Zones of a best fit: parts that do not wear, as defined by wearsim.

    They are behind and on top of the flange, and the end of the tread. Of a rail,
    wherever its origin is, they are the field side of the head from 5 mm below the top,
    and the gauge side from 15 mm below the top if it is measured.
    """
    if reference.kind == "wheel":
        back = _Zone("flange back and tip", (-math.inf, -52e-3))
        return back, _Zone("field side of the tread", (50e-3, math.inf), needed=False)
    top = extremum(reference.y, reference.z, int(np.argmin(reference.z)))[1]
    middle = 0.5 * float(reference.y.min() + reference.y.max())
    return (
        _Zone("field side of the head", (middle, math.inf), (top + 5e-3, math.inf)),
        _Zone(
            "lower gauge side",
            (-math.inf, middle),
            (top + 15e-3, math.inf),
            needed=False,
        ),
    )


@dataclass(frozen=True)
class Alignment:
    """Movement of a profile by alignment, and the profile after it.

    The source of the profile notes the movement.
    """

    rule: str  # one of `ALIGNMENTS`
    profile: Profile = field(repr=False)
    dy: float = 0.0  # shift, after the rotation [m]
    dz: float = 0.0
    # rotation about the origin of the measured profile; turns y towards z [rad]
    angle: float = 0.0
    # RMS of the normal distances in the zones of a best fit [m]
    rms: float | None = None
    # reference of the alignment, in one sentence
    note: str = "as measured, nothing moved"

    def moved(self, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points y, z (n,) [m] after the move."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return c * y - s * z + self.dy, s * y + c * z + self.dz


def prolonged(reference: Profile) -> Profile:
    """Extend the straight sides of a reference profile, which drawings end early.

    The flange back is extended by 30 mm, either side of a rail head by 15 mm where it
    is steep.
    """
    y, z = reference.y, reference.z
    more, ends = (30e-3, (0,)) if reference.kind == "wheel" else (15e-3, (0, -1))
    for end in ends:
        inner = 1 if end == 0 else -2
        dy, dz = float(y[end] - y[inner]), float(z[end] - z[inner])
        step = math.hypot(dy, dz)
        # a wheel's back goes down to smaller z, a rail's sides to larger z
        if (-dz if reference.kind == "wheel" else dz) < step * math.sin(_STEEPEST):
            continue
        at = 0 if end == 0 else len(y)
        y = np.insert(y, at, y[end] + more * dy / step)
        z = np.insert(z, at, z[end] + more * dz / step)
    return replace(reference, y=y, z=z)


def _best_fit(profile: Profile, reference: Profile, *, rotation: bool) -> Alignment:
    """Fit the profile to the unworn zones of the reference by least normal distances.

    With `rotation` the profile may also be rotated, as gauges tilt. Raises
    `ProfileError` if a required zone has fewer than 5 measured points, or the zones do
    not constrain all directions.

    Notes
    -----
    Gauss-Newton steps on signed distances to the nearest edge of the reference. Points
    are weighted with their length and with Tukey's biweight [1]_, after some steps with
    Huber's weights [2]_, at the scale of the median distance, so that worn or dirty
    parts of a zone lose their influence. The fit starts with the flange tip (the top
    and the field side of a rail) on that of the reference, so that the origin of the
    file does not matter.

    References
    ----------
    .. [1] A. E. Beaton, J. W. Tukey, Technometrics 16 (1974) 147-185,
           doi:10.1080/00401706.1974.10489171.
    .. [2] P. J. Huber, Ann. Math. Statist. 35 (1964) 73-101,
           doi:10.1214/aoms/1177703732.
    """
    zones = _zones(reference)
    search = _Nearest(prolonged(resample(reference, _SPACING)))
    points, length = (
        np.column_stack((profile.y, profile.z)),
        vertex_lengths(profile.y, profile.z),
    )
    centre = points.mean(axis=0)
    lever = points - centre
    # from flange tip to flange tip; of rails the outermost y and the top
    starts = [
        extremum(shape.y, shape.z, int(np.argmax(shape.z)))
        if shape.kind == "wheel"
        else (shape.y.max(), shape.z.min())
        for shape in (profile, reference)
    ]
    angle, place = 0.0, centre + np.array(starts[1]) - np.array(starts[0])
    # A biweight can converge to half of the points, so weights without local minima
    # come first. A worn rail head has no point to start from, but is close enough as a
    # whole.
    stages = [(zones, _huber, _FIRST_ROUNDS), (zones, _biweight, _ROUNDS)]
    if profile.kind == "rail":
        stages.insert(0, (_EVERYWHERE, _biweight, _FIRST_ROUNDS))
    for held, weigh, rounds in stages:
        for _ in range(rounds):
            c, s = math.cos(angle), math.sin(angle)
            rotated = lever @ np.array([[c, s], [-s, c]])
            foot, normal, distance = search(rotated + place)
            inside = [_within(zone, foot, reference.name) for zone in held]
            use = np.any(inside, axis=0)
            step = _step(
                rotated[use],
                normal[use],
                distance[use],
                length[use] * weigh(distance[use]),
                rotation,
            )
            place, angle = place + step[:2], angle + float(step[2])
            change = float(np.max(np.abs(step * (1.0, 1.0, _ARM))))
            if change < _CLOSE:
                break
    if change > _SETTLED:
        raise ProfileError(
            f"the fit does not settle (it still moves by {change * 1e6:.2g} um)"
        )
    rms = math.sqrt(
        float(np.sum(length[use] * distance[use] ** 2) / np.sum(length[use]))
    )
    c, s = math.cos(angle), math.sin(angle)
    total = place - np.array(
        [c * centre[0] - s * centre[1], s * centre[0] + c * centre[1]]
    )
    names = " and ".join(
        zone.name
        for zone, members in zip(zones, inside, strict=True)
        if np.any(members)
    )
    freedom = "shifted and rotated" if rotation else "shifted, not rotated"
    fit = f"by least squares over {np.count_nonzero(use)} points, {freedom}"
    note = f"{names} fitted to {reference.name} {fit}"
    return Alignment(
        "best_fit", profile, float(total[0]), float(total[1]), angle, rms, note
    )


def _step(
    lever: FloatArray,
    normal: FloatArray,
    distance: FloatArray,
    weight: FloatArray,
    rotation: bool,
) -> FloatArray:
    """Gauss-Newton step: shifts in y, z [m] and rotation [rad] about the pivot.

    `lever` is the position of the points relative to the pivot.
    """
    columns = [normal[:, 0], normal[:, 1]]
    if rotation:
        columns.append((normal[:, 1] * lever[:, 0] - normal[:, 0] * lever[:, 1]) / _ARM)
    design = np.column_stack(columns)
    matrix = (design * weight[:, None]).T @ design / weight.sum()
    if np.linalg.eigvalsh(matrix)[0] < _WEAKEST:
        raise ProfileError(
            "the unworn parts do not hold the profile in all directions; measure its "
            "sides"
        )
    step: FloatArray = np.zeros(3)
    step[: len(columns)] = -np.linalg.solve(
        matrix, design.T @ (weight * distance) / weight.sum()
    )
    step[2] /= _ARM
    return step


def _within(zone: _Zone, foot: FloatArray, name: str) -> NDArray[np.bool_]:
    """Mark the foot points that lie in a zone.

    Those beyond the ends of the reference (NaN) do not.
    """
    y, z = foot.T
    inside: NDArray[np.bool_] = (
        (y >= zone.y[0]) & (y <= zone.y[1]) & (z >= zone.z[0]) & (z <= zone.z[1])
    )
    if zone.needed and np.count_nonzero(inside) < _FEWEST:
        count = np.count_nonzero(inside)
        raise ProfileError(
            f"{count} points lie on {zone.name} of {name}, {_FEWEST} are needed"
        )
    return inside


def _scale(distance: FloatArray) -> float:
    """Return the standard deviation of normal noise from its median distance [m].

    It is above 0.
    """
    return max(1.4826 * float(np.median(np.abs(distance))), 1e-9)


def _huber(distance: FloatArray) -> FloatArray:
    """Huber's weights with the scale of the median distance."""
    return np.minimum(
        1.0, _HUBER * _scale(distance) / np.maximum(np.abs(distance), 1e-12)
    )


def _biweight(distance: FloatArray) -> FloatArray:
    """Tukey's biweight with the scale of the median distance."""
    u = np.minimum(np.abs(distance) / (_TUKEY * _scale(distance)), 1.0)
    return (1.0 - u**2) ** 2


class _Nearest:
    """Nearest point of a polygon, by its nearest vertex and the two edges there."""

    def __init__(self, target: Profile) -> None:
        from scipy.spatial import cKDTree  # slow import, only when it is needed

        self.vertex = np.column_stack((target.y, target.z))
        self.tree = cKDTree(self.vertex)
        self.edge = np.diff(self.vertex, axis=0)
        self.size = np.hypot(*self.edge.T)

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Foot (NaN beyond the ends), unit normal of the edge and signed distance."""
        near = self.tree.query(points)[1]
        last = len(self.edge) - 1
        best = np.full(len(points), np.inf)
        foot, normal = np.full_like(points, np.nan), np.zeros_like(points)
        signed = np.zeros(len(points))
        for k in (np.maximum(near - 1, 0), np.minimum(near, last)):
            along = self.edge[k] / self.size[k, None]
            offset = points - self.vertex[k]
            t = np.sum(offset * along, axis=1)
            outside = ((k == 0) & (t < 0.0)) | ((k == last) & (t > self.size[k]))
            at = self.vertex[k] + np.clip(t, 0.0, self.size[k])[:, None] * along
            away = np.hypot(*(points - at).T)
            better = (away < best) & ~outside
            across = np.column_stack((-along[:, 1], along[:, 0]))
            best[better], foot[better], normal[better] = (
                away[better],
                at[better],
                across[better],
            )
            signed[better] = np.sum(offset * across, axis=1)[better]
        return foot, normal, signed


ALIGNMENTS = ("none", "best_fit")
"""Alignment rules: points as measured, or unworn parts aligned with the reference."""


def align(
    profile: Profile, reference: Profile, rule: str, *, rotation: bool = False
) -> Alignment:
    """Align a measured profile with its reference by the parts that do not wear.

    Parameters
    ----------
    profile, reference : Profile
        Of one kind: as measured; new shape or earlier measurement, in whose axes the
        profile is moved.
    rule : str
        One of `ALIGNMENTS`.
    rotation : bool
        True if best_fit may also rotate the profile.

    Raises
    ------
    ProfileError
        The profile lacks what the fit holds.
    """
    if rule == "none":
        return Alignment(rule, profile)
    try:
        fit = _best_fit(profile, reference, rotation=rotation)
    except ProfileError as error:
        raise ProfileError(
            f"{profile.name}: best fit: {error}; state --align none if it lies on "
            f"{reference.name} as measured"
        ) from error
    y, z = fit.moved(profile.y, profile.z)
    source = (
        f"{profile.source}; aligned by {rule}"
        if profile.source
        else f"aligned by {rule}"
    )
    return replace(fit, profile=replace(profile, y=y, z=z, source=source))
