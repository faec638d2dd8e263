"""Where a measured profile lies against a reference.

The parts that do not wear laid on each other.
"""

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

_STEEPEST = math.radians(
    80.0
)  # slope from which a piece of the reference is flange back
_FEWEST = 5  # points a rule needs on whatever it holds
_SPACING = 0.1e-3  # of the reference's points [m]: chords bulge by 0.1 um on 12 mm
_CLOSE = 1e-10  # change of the shift at which the fit is settled [m]
# change that is accepted where single points come and go at a border of a zone [m]
_SETTLED = 1e-7
_HUBER, _TUKEY = 1.345, 4.685  # in standard deviations; 95 % efficient for normal noise
_WEAKEST = 1e-4  # mean square of the normals' share in the weakest direction
_ROUNDS, _FIRST_ROUNDS = 200, 30  # steps at most
_ARM = 50e-3  # what makes an angle comparable to a shift [m]


class _Zone(NamedTuple):
    """Where a best fit holds the measured profile to a reference, in whose axes it is.

    Ranges of y and z [m]. A profile without points on a zone that is needed is an
    error.
    """

    name: str
    y: tuple[float, float]
    z: tuple[float, float] = (-math.inf, math.inf)
    needed: bool = True


_EVERYWHERE = (_Zone("the whole profile", (-math.inf, math.inf)),)


def _zones(reference: Profile) -> tuple[_Zone, ...]:
    """Zones of a best fit, parts that do not wear; wearsim's own choice.

    Behind and on top of the flange, and the end of the tread; of a rail, wherever its
    origin is, the field side of the head from 5 mm below the top, and the gauge side
    from 15 mm below the top if it is measured.
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
    """How a profile was moved, and the profile after it, which its source notes."""

    rule: str  # one of `ALIGNMENTS`
    profile: Profile = field(repr=False)
    dy: float = 0.0  # shift, after the rotation [m]
    dz: float = 0.0
    # rotation about the origin of the measured profile; turns y towards z [rad]
    angle: float = 0.0
    rms: float | None = (
        None  # of the normal distances left on the zones of a best fit [m]
    )
    note: str = "as measured, nothing moved"  # what was held, in one sentence

    def moved(self, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points y, z (n,) [m] after the move."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return c * y - s * z + self.dy, s * y + c * z + self.dz


def prolonged(reference: Profile) -> Profile:
    """Prolong the straight sides of a reference.

    Drawings end where they have just begun.

    30 mm more of the flange back, 15 mm more of either side of a rail head, where they
    are steep.
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
    """Least squares of the normal distances to the reference on its unworn zones.

    With `rotation` the profile may also be rotated, as gauges tilt. Raises
    `ProfileError` if a zone that is needed holds fewer than 5 measured points, or the
    zones do not hold all directions.

    Notes
    -----
    Gauss-Newton steps on signed distances to the nearest edge of the reference, points
    weighted with the length they stand for and with Tukey's biweight [1]_, after some
    with Huber's weights [2]_, at the scale of the median distance, so that what is worn
    or dirty within a zone loses its say. Begins with the flange tip (the top and the
    field side of a rail) on that of the reference, so that where the file has its
    origin does not matter.

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
        extremum(each.y, each.z, int(np.argmax(each.z)))
        if each.kind == "wheel"
        else (each.y.max(), each.z.min())
        for each in (profile, reference)
    ]
    angle, place = 0.0, centre + np.array(starts[1]) - np.array(starts[0])
    # a biweight can stick to half of the points, so weights without local minima come
    # first; a worn rail head has no point to begin with, but the whole of it comes near
    # enough
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
    """Gauss-Newton step.

    Shift y, z [m] and angle [rad] of points at `lever` from the pivot.
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
    """Mark the feet that lie in a zone.

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
    """Return standard deviation of noise with this median distance, above 0 [m]."""
    return max(1.4826 * float(np.median(np.abs(distance))), 1e-9)


def _huber(distance: FloatArray) -> FloatArray:
    """Huber's weights at the scale of the median distance."""
    return np.minimum(
        1.0, _HUBER * _scale(distance) / np.maximum(np.abs(distance), 1e-12)
    )


def _biweight(distance: FloatArray) -> FloatArray:
    """Tukey's weights at the scale of the median distance."""
    u = np.minimum(np.abs(distance) / (_TUKEY * _scale(distance)), 1.0)
    return (1.0 - u**2) ** 2


class _Nearest:
    """Nearest point of a polygon, by its nearest vertex and the two edges there."""

    def __init__(self, target: Profile) -> None:
        from scipy.spatial import cKDTree  # only spent where it is needed

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
"""Rules of alignment: points stay as measured, or what does not wear is laid on the
reference.
"""


def align(
    profile: Profile, reference: Profile, rule: str, *, rotation: bool = False
) -> Alignment:
    """Move a measured profile onto its reference.

    The parts of it that do not wear then lie where the reference has them.

    Parameters
    ----------
    profile, reference : Profile
        Of one kind: as measured; new shape or earlier measurement, in whose axes the
        profile is moved.
    rule : str
        One of `ALIGNMENTS`.
    rotation : bool
        Whether the profile may be rotated by best_fit, too.

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
