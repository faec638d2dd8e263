"""Least squares of a measured profile on the parts of a reference that do not wear."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import ProfileError
from wearsim.profile.shape import FloatArray, Profile, extremum, resample, vertex_lengths

STEEPEST = math.radians(80.0)
"""Slope from which a piece of the reference is flange back [rad]."""

FEWEST = 5
"""Points a rule needs on whatever it holds."""

_SPACING = 0.1e-3  # of the reference's points [m]: chords bulge by 0.1 um on 12 mm
_CLOSE = 1e-10  # change of the shift at which the fit is settled [m]
_SETTLED = 1e-7  # change that is accepted where single points come and go at a border of a zone [m]
_HUBER, _TUKEY = 1.345, 4.685  # in standard deviations; 95 % efficient for normal noise
_WEAKEST = 1e-4  # mean square of the normals' share in the weakest direction
_ROUNDS, _FIRST_ROUNDS = 200, 30  # steps at most
_ARM = 50e-3  # what makes an angle comparable to a shift [m]


@dataclass(frozen=True)
class FitZone:
    """Where a best fit holds the measured profile to the reference, in the axes of the reference.

    Parameters
    ----------
    name : str
        What it is called.
    y, z : (float, float)
        Ranges [m]; infinite where nothing limits them.
    needed : bool
        Whether a profile without points there is refused.
    """

    name: str
    y: tuple[float, float]
    z: tuple[float, float] = (-math.inf, math.inf)
    needed: bool = True


WHEEL_ZONES = (
    FitZone("flange back and tip", (-math.inf, -52e-3)),
    FitZone("field side of the tread", (50e-3, math.inf)),
)
"""Parts of a wheel that rails do not wear: behind and on top of the flange, and the end of the tread."""

_EVERYWHERE = (FitZone("the whole profile", (-math.inf, math.inf)),)


def default_zones(reference: Profile) -> tuple[FitZone, ...]:
    """Zones of a best fit where none are given.

    Parameters
    ----------
    reference : Profile
        Wheel, or rail wherever its origin is.

    Returns
    -------
    tuple of FitZone
        `WHEEL_ZONES`; of a rail the field side of the head from 5 mm below the top, and the gauge side
        from 15 mm below the top if it is measured. Where these lie is wearsim's own choice.
    """
    if reference.kind == "wheel":
        return WHEEL_ZONES
    top = extremum(reference.y, reference.z, int(np.argmin(reference.z)))[1]
    middle = 0.5 * float(reference.y.min() + reference.y.max())
    return (
        FitZone("field side of the head", (middle, math.inf), (top + 5e-3, math.inf)),
        FitZone("lower gauge side", (-math.inf, middle), (top + 15e-3, math.inf), needed=False),
    )


@dataclass(frozen=True)
class Move:
    """What a rule finds: rotation about the origin, then shift; see `Alignment`."""

    dy: float = 0.0
    dz: float = 0.0
    angle: float = 0.0
    rms: float | None = None
    note: str = ""


def prolonged(reference: Profile) -> Profile:
    """Prolong the straight sides of a reference where it ends steeply.

    Parameters
    ----------
    reference : Profile
        Drawings end where the flange back, or the side of the rail head, has just begun.

    Returns
    -------
    Profile
        With 30 mm more of the flange back, 15 mm more of either side of a rail head, or as it was.
    """
    y, z = reference.y, reference.z
    more, ends = (30e-3, (0,)) if reference.kind == "wheel" else (15e-3, (0, -1))
    for end in ends:
        inner = 1 if end == 0 else -2
        dy, dz = float(y[end] - y[inner]), float(z[end] - z[inner])
        step = math.hypot(dy, dz)
        # a wheel's back goes down to smaller z, a rail's sides to larger z
        if (-dz if reference.kind == "wheel" else dz) < step * math.sin(STEEPEST):
            continue
        at = 0 if end == 0 else len(y)
        y = np.insert(y, at, y[end] + more * dy / step)
        z = np.insert(z, at, z[end] + more * dz / step)
    return replace(reference, y=y, z=z)


def best_fit(
    profile: Profile, reference: Profile, zones: tuple[FitZone, ...], *, rotation: bool = False
) -> Move:
    """Least squares of the normal distances to the reference on its unworn zones.

    Parameters
    ----------
    profile, reference : Profile
        Of one kind.
    zones : tuple of FitZone
        In the axes of the reference; each that is needed must hold 5 measured points.
    rotation : bool
        Whether the profile may also be turned, as gauges tilt.

    Returns
    -------
    Move
        From the measured position.

    Raises
    ------
    ProfileError
        A zone is not measured, or the zones do not hold all directions.

    Notes
    -----
    Gauss-Newton steps on signed distances to the nearest edge of the reference, points weighted with
    the length they stand for and with Tukey's biweight at the scale of the median distance, so that what
    is worn or dirty within a zone loses its say. Begins with the flange tip (the top and the field side
    of a rail) on that of the reference, so that where the file has its origin does not matter.
    """
    search = _Nearest(prolonged(resample(reference, _SPACING)))
    points, length = np.column_stack((profile.y, profile.z)), vertex_lengths(profile.y, profile.z)
    centre = points.mean(axis=0)
    lever = points - centre
    angle, place = 0.0, centre + _extreme(reference) - _extreme(profile)
    # a biweight can stick to half of the points, so weights without local minima come first; a worn rail
    # head has no point to begin with, but the whole of it comes near enough
    stages = [(zones, _huber, _FIRST_ROUNDS), (zones, _biweight, _ROUNDS)]
    if profile.kind == "rail":
        stages.insert(0, (_EVERYWHERE, _biweight, _FIRST_ROUNDS))
    for held, weigh, rounds in stages:
        for turn in range(rounds):
            c, s = math.cos(angle), math.sin(angle)
            turned = lever @ np.array([[c, s], [-s, c]])
            foot, normal, distance = search(turned + place)
            inside = [_within(zone, foot) for zone in held]
            _refuse_empty(held, inside, reference.name, turn == 0)
            use = np.any(inside, axis=0)
            step = _step(
                turned[use], normal[use], distance[use], length[use] * weigh(distance[use]), rotation
            )
            place, angle = place + step[:2], angle + float(step[2])
            change = float(np.max(np.abs(step * (1.0, 1.0, _ARM))))
            if change < _CLOSE:
                break
    if change > _SETTLED:
        raise ProfileError(
            f"the fit does not settle (it still moves by {change * 1e6:.2g} um); give other zones"
        )
    rms = math.sqrt(float(np.sum(length[use] * distance[use] ** 2) / np.sum(length[use])))
    c, s = math.cos(angle), math.sin(angle)
    total = place - np.array([c * centre[0] - s * centre[1], s * centre[0] + c * centre[1]])
    names = " and ".join(zone.name for zone, members in zip(zones, inside, strict=True) if np.any(members))
    freedom = "shifted and turned" if rotation else "shifted, not turned"
    return Move(
        float(total[0]),
        float(total[1]),
        angle,
        rms,
        f"{names} fitted to {reference.name} by least squares over {np.count_nonzero(use)} points, {freedom}",
    )


def _refuse_empty(
    zones: tuple[FitZone, ...], inside: list[NDArray[np.bool_]], name: str, first: bool
) -> None:
    """Refuse a profile without enough points on a zone that is needed, at first or as the fit goes on."""
    for zone, members in zip(zones, inside, strict=True):
        count = int(np.count_nonzero(members))
        if zone.needed and count < FEWEST:
            if first:
                raise ProfileError(f"{count} points lie on {zone.name} of {name}, {FEWEST} are needed")
            raise ProfileError(
                f"the fit runs away from {zone.name} of {name}: too little of the zones is measured, or they "
                "are worn; give zones that are neither"
            )


def _step(
    lever: FloatArray, normal: FloatArray, distance: FloatArray, weight: FloatArray, rotation: bool
) -> FloatArray:
    """Gauss-Newton step: shift y, z [m] and angle [rad] of points at `lever` from the pivot."""
    columns = [normal[:, 0], normal[:, 1]]
    if rotation:
        columns.append((normal[:, 1] * lever[:, 0] - normal[:, 0] * lever[:, 1]) / _ARM)
    design = np.column_stack(columns)
    matrix = (design * weight[:, None]).T @ design / weight.sum()
    if np.linalg.eigvalsh(matrix)[0] < _WEAKEST:
        raise ProfileError(
            "the zones do not hold the profile in all directions; give zones on its sides as well"
        )
    step: FloatArray = np.zeros(3)
    step[: len(columns)] = -np.linalg.solve(matrix, design.T @ (weight * distance) / weight.sum())
    step[2] /= _ARM
    return step


def _extreme(profile: Profile) -> FloatArray:
    """Flange tip of a wheel; outermost y and top of a rail [m]."""
    if profile.kind == "wheel":
        return np.array(extremum(profile.y, profile.z, int(np.argmax(profile.z))))
    return np.array([profile.y.max(), profile.z.min()])


def _within(zone: FitZone, foot: FloatArray) -> NDArray[np.bool_]:
    """Tell which feet lie in a zone; those beyond the ends of the reference (NaN) do not."""
    y, z = foot.T
    inside: NDArray[np.bool_] = (y >= zone.y[0]) & (y <= zone.y[1]) & (z >= zone.z[0]) & (z <= zone.z[1])
    return inside


def _scale(distance: FloatArray) -> float:
    """Return the standard deviation of normal noise with this median distance, above 0 [m]."""
    return max(1.4826 * float(np.median(np.abs(distance))), 1e-9)


def _huber(distance: FloatArray) -> FloatArray:
    """Huber's weights at the scale of the median distance."""
    result: FloatArray = np.minimum(1.0, _HUBER * _scale(distance) / np.maximum(np.abs(distance), 1e-12))
    return result


def _biweight(distance: FloatArray) -> FloatArray:
    """Tukey's weights at the scale of the median distance."""
    u = np.minimum(np.abs(distance) / (_TUKEY * _scale(distance)), 1.0)
    result: FloatArray = (1.0 - u**2) ** 2
    return result


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
            best[better], foot[better], normal[better] = away[better], at[better], across[better]
            signed[better] = np.sum(offset * across, axis=1)[better]
        return foot, normal, signed
