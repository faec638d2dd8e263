"""Whether a list of points can be a wheel or rail profile in our axes and units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.profile.shape import FloatArray, Kind, arc_length

PointFault = tuple[str, int | None]
"""Message and index of the point; None: the profile as a whole."""

MIN_POINTS = 20
# Plausible widths of a measured cross-section [m]; part of a rail head or roller is enough for a contact.
WIDTH_RANGE: dict[str, tuple[float, float]] = {"wheel": (0.080, 0.200), "rail": (0.010, 0.200)}
PARTIAL = 0.030
"""Width below which a rail profile is part of a head, without the gauge point, and may be flat [m]."""
# Difference of the largest and smallest z [m]; a wheel has a flange, a rail may end on its crown.
HEIGHT_RANGE: dict[str, tuple[float, float]] = {"wheel": (0.015, 0.150), "rail": (0.001, 0.200)}
# Other units people's files come in, with their factor to the one stated.
_SCALES = {1e3: "1000 times as large", 1e-3: "1000 times as small", 25.4: "25.4 times as large (inches)"}
_END_PIECE = 0.020  # longest straight piece at an end that needs no points between [m]
_END_POINTS = 3  # points at most between it and the end, or one in fifty
_TIP_RANGE = (-0.080, -0.030)  # lateral position of flange tips, from the running circle [m]
_CIRCLE_LIMIT = 0.015  # |z| at the running circle of a worn wheel measured from the new one [m]


def points_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[PointFault]:
    """All faults of the points y, z (n,) [m] of a wheel or rail profile: message and index of the point.

    The index is None for the profile as a whole. Later checks need the earlier ones passed: number and
    finiteness, size, order, orientation and origin. `units` is the fix if another unit would fit.
    """
    faults = shape_faults(kind, y, z, units)
    return faults or (list(_wheel_faults(y, z)) if kind == "wheel" else head_faults(y, z))


class _List(NamedTuple):
    """Finite points, the distance from each to the next, the usual distance, and the fix for units."""

    kind: Kind
    y: FloatArray
    z: FloatArray
    step: FloatArray
    usual: float
    units: str


def shape_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[PointFault]:
    """Faults that do not depend on orientation and origin, as of `points_faults`."""
    if y.ndim != 1 or y.shape != z.shape:
        return [(f"y and z must be two lists of equal length, not of shapes {y.shape} and {z.shape}", None)]
    faults: list[PointFault] = []
    if len(y) < MIN_POINTS:
        are = "point is" if len(y) == 1 else "points are"
        faults.append((f"{len(y)} {are} too few for a profile; give at least {MIN_POINTS}", None))
    for j in np.flatnonzero(~(np.isfinite(y) & np.isfinite(z))):
        faults.append((f"point {j + 1} is not finite; delete or repeat the measurement of it", int(j)))
    if faults:
        return faults
    step = np.hypot(np.diff(y), np.diff(z))
    points = _List(kind, y, z, step, float(np.median(step)), units)
    checks = (_mixed_units, _wild_points, _size, _repeated, _turning_back, _gaps)
    return next((faults for check in checks if (faults := list(check(points)))), [])


def _mixed_units(points: _List) -> Iterator[PointFault]:
    """First jump that a factor of 1000 on one of its ends would close."""
    y, z, step = points.y, points.z, points.step
    size = np.hypot(y, z)
    for j in np.flatnonzero(step > 3.0 * points.usual):
        small, large = (j, j + 1) if size[j] < size[j + 1] else (j + 1, j)
        gap = float(np.hypot(1e3 * y[small] - y[large], 1e3 * z[small] - z[large]))
        if size[large] > 100.0 * size[small] and gap < 0.3 * step[j]:
            which = (
                f"points {j + 1} and {j + 2} fit together only if one of them is taken 1000 times as large"
            )
            yield f"{which}: mixed units; give all points in one unit", int(j + 1)
            return


def _wild_points(points: _List) -> Iterator[PointFault]:
    y, z, step = points.y, points.z, points.step
    across = np.hypot(y[2:] - y[:-2], z[2:] - z[:-2])
    both = np.minimum(step[1:], step[:-1])
    wild = (both > np.maximum(3.0 * points.usual, 2e-3)) & (across < 0.5 * both)
    for j in np.flatnonzero(wild) + 1:
        off = f"{both[j - 1] * 1e3:.3g} mm off both neighbours"
        yield f"point {j + 1} lies {off}; correct or delete it", int(j)


def _size(points: _List) -> Iterator[PointFault]:
    """Width of the whole, then its height."""
    kind = points.kind
    partial = kind == "rail" and float(np.ptp(points.y)) < PARTIAL
    for word, values, (low, high) in (
        ("wide", points.y, WIDTH_RANGE[kind]),
        ("high", points.z, HEIGHT_RANGE[kind]),
    ):
        size = float(np.ptp(values))
        if low <= size <= high or (partial and word == "high" and size <= high):
            continue
        what = f"the {kind} profile is {size * 1e3:.4g} mm {word}, which is not within"
        column = " in z only, mixed units" if word == "high" else ""
        fits = (words for factor, words in _SCALES.items() if low <= size * factor <= high)
        hint = next(
            (f"it would fit if the numbers were {words}{column}: {points.units}" for words in fits), ""
        )
        yield f"{what} {low * 1e3:g} .. {high * 1e3:g} mm; {hint or 'check units and columns'}", None
        return


def _repeated(points: _List) -> Iterator[PointFault]:
    order = np.lexsort((points.z, points.y))
    same = (np.diff(points.y[order]) == 0.0) & (np.diff(points.z[order]) == 0.0)
    pairs = sorted(tuple(sorted((int(order[k]), int(order[k + 1])))) for k in np.flatnonzero(same))
    if pairs:
        first, second = pairs[0]
        what = f"point {second + 1} repeats point {first + 1}"
        if len(pairs) == 1:
            yield f"{what}; delete one of them", second
        elif len(pairs) < len(points.y) // 4:
            yield f"{what}, {len(pairs)} points are repeated in all; delete the repeated ones", second
        else:
            yield (
                f"{what}, {len(pairs)} points are repeated in all: two profiles in one list; give one",
                second,
            )


def turns(y: FloatArray, z: FloatArray) -> NDArray[np.intp]:
    """Return the points at which a list turns back by more than 154 degrees."""
    dy, dz = np.diff(y), np.diff(z)
    step = np.hypot(dy, dz)
    return np.flatnonzero(dy[1:] * dy[:-1] + dz[1:] * dz[:-1] < -0.9 * step[1:] * step[:-1]) + 1


def _turning_back(points: _List) -> Iterator[PointFault]:
    """Points that do not follow each other along the profile."""
    y, z = points.y, points.z
    back = turns(y, z)
    if 0 < len(back) < max(6, len(y) // 10):
        for j in back:
            yield f"the points turn back at point {j + 1}; put them in order", int(j)
        return
    length, around = float(arc_length(y, z)[-1]), 2.0 * float(np.ptp(y) + np.ptp(z))
    if length > around or len(back):
        path = f"a path of {length * 1e3:.4g} mm, more than the {around * 1e3:.4g} mm around the profile"
        yield f"the points make {path}: list them in their order along the profile, once", None


def _gaps(points: _List) -> Iterator[PointFault]:
    step, count = points.step, len(points.y)
    gaps = np.flatnonzero((step > 5e-3) & (step > 10.0 * np.median(step))) + 1
    # drawn profiles end in a chamfer and a face of two points each, and instruments jump on the straight
    # side of a head or roller: there is no contact
    end = max(_END_POINTS, count // 50)
    for j in gaps[(step[gaps - 1] > _END_PIECE) | ((gaps > end) & (gaps < count - end))]:
        gap = f"{step[j - 1] * 1e3:.4g} mm without a point"
        yield f"{gap} before point {j + 1}; add the missing points", int(j)


def _wheel_faults(y: FloatArray, z: FloatArray) -> Iterator[PointFault]:
    """Orientation and origin of a wheel profile."""
    tread = float(np.median(z))
    highest, lowest = int(np.argmax(z)), int(np.argmin(z))
    edge = max(2, len(y) // 50)
    tip, half_way = float(y[highest]), 0.5 * float(y.min() + y.max())
    at_circle = float(z[int(np.argmin(np.abs(y)))])
    low, high = _TIP_RANGE
    if tread - z[lowest] > z[highest] - tread and edge <= lowest < len(y) - edge:
        yield "the flange points to negative z: change the sign of z (positive radially outward)", lowest
    elif tip > half_way:
        where = f"the flange is at the end of larger y (tip at y = {tip * 1e3:.4g} mm)"
        yield f"{where}; mirror the file: change the sign of y", highest
    elif not low <= tip <= high:
        where = f"y = {tip * 1e3:.4g} mm, which is not within {low * 1e3:g} .. {high * 1e3:g} mm"
        shifted = "; it would fit with y counted from the running circle: subtract 70 mm from y"
        hint = shifted if low <= tip - 0.070 <= high else ": y counts from the running circle"
        yield f"the flange tip is at {where}{hint}", highest
    elif y.max() < 0.020:
        where = f"y = {y.max() * 1e3:.4g} mm"
        yield f"the profile ends at {where}; the tread is needed up to 20 mm at least", None
    elif abs(at_circle) > _CIRCLE_LIMIT:
        where = f"z = {at_circle * 1e3:.4g} mm at the running circle (y = 0)"
        allowed = f"which is not within +-{_CIRCLE_LIMIT * 1e3:g} mm"
        yield f"{where}, {allowed}: z counts from the running circle of the new wheel", None


def head_faults(y: FloatArray, z: FloatArray) -> list[PointFault]:
    """Faults of the orientation of a rail head, as of `points_faults`; the gauge sets its origin later."""
    middle = 0.5 * (float(y.min()) + float(y.max()))
    crown = float(np.median(z[np.abs(y - middle) < 0.2 * np.ptp(y)]))
    if not crown < 0.5 * (float(z[0]) + float(z[-1])):
        return [("the head's top has larger z than its ends: change the sign of z (positive down)", None)]
    return []
