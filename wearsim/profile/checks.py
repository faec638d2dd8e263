"""Whether a list of points can be a wheel or rail profile in our axes and units."""

from __future__ import annotations

from typing import Literal

import numpy as np

from wearsim.profile.shape import FloatArray, arc_length

Kind = Literal["wheel", "rail"]

MIN_POINTS = 20
# Plausible widths of a measured cross-section [m]; half a rail head is enough for a contact.
WIDTH_RANGE: dict[str, tuple[float, float]] = {"wheel": (0.080, 0.200), "rail": (0.030, 0.200)}
# Difference of the largest and smallest z [m]; a wheel has a flange, a rail may end on its crown.
HEIGHT_RANGE: dict[str, tuple[float, float]] = {"wheel": (0.015, 0.150), "rail": (0.001, 0.200)}
# Other units people's files come in, with their factor to the one stated.
_SCALES = (
    (1e3, "1000 times as large"),
    (1e-3, "1000 times as small"),
    (25.4, "25.4 times as large (inches)"),
)
_END_PIECE = 0.020  # longest straight piece at an end that needs no points between [m]
_END_POINTS = 3  # points at most between it and the end, or one in fifty
_TIP_RANGE = (-0.080, -0.030)  # lateral position of flange tips, from the running circle [m]
_CIRCLE_LIMIT = 0.015  # |z| at the running circle of a worn wheel measured from the new one [m]


def points_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[tuple[str, int | None]]:
    """All faults of the points of a profile.

    Parameters
    ----------
    kind : {"wheel", "rail"}
        What they should be.
    y, z : (n,) array
        Points [m].
    units : str
        Way out if another unit would fit.

    Returns
    -------
    list of (str, int or None)
        Message and index of the point (None: the profile as a whole); empty if there is none. Later
        checks need the earlier ones passed: number and finiteness, size, order, orientation and origin.
    """
    faults = shape_faults(kind, y, z, units)
    if not faults:
        faults = _wheel_faults(y, z) if kind == "wheel" else head_faults(y, z)
    return faults


def shape_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[tuple[str, int | None]]:
    """Faults that do not depend on orientation and origin.

    Parameters
    ----------
    kind : {"wheel", "rail"}
        What the points should be.
    y, z : (n,) array
        Points [m].
    units : str
        Way out if another unit would fit.

    Returns
    -------
    list of (str, int or None)
        As `points_faults`: number, finiteness, size and order.
    """
    if y.ndim != 1 or y.shape != z.shape:
        return [(f"y and z must be two lists of equal length, not of shapes {y.shape} and {z.shape}", None)]
    faults: list[tuple[str, int | None]] = []
    if len(y) < MIN_POINTS:
        are = "point is" if len(y) == 1 else "points are"
        faults.append((f"{len(y)} {are} too few for a profile; give at least {MIN_POINTS}", None))
    for j in np.flatnonzero(~(np.isfinite(y) & np.isfinite(z))):
        faults.append((f"point {j + 1} is not finite; delete or repeat the measurement of it", int(j)))
    if not faults:
        faults = _unit_faults(kind, y, z, units)
    if not faults:
        faults = _order_faults(y, z)
    return faults


def _unit_faults(kind: Kind, y: FloatArray, z: FloatArray, units: str) -> list[tuple[str, int | None]]:
    """Mixed units within the list, single wild points, then the size of the whole."""
    step = np.hypot(np.diff(y), np.diff(z))
    usual = float(np.median(step))
    mixed = _mixed_units(y, z, step, usual)
    if mixed is not None:
        return [mixed]
    across = np.hypot(y[2:] - y[:-2], z[2:] - z[:-2])
    both = np.minimum(step[1:], step[:-1])
    wild = np.flatnonzero((both > np.maximum(3.0 * usual, 2e-3)) & (across < 0.5 * both)) + 1
    if len(wild):
        return [
            (
                f"point {j + 1} lies {both[j - 1] * 1e3:.3g} mm off both neighbours; correct or delete it",
                int(j),
            )
            for j in wild
        ]
    joined = _joined(y, step, usual)
    if joined is not None:
        return [joined]
    messages = [_size_fault(kind, "wide", float(np.ptp(y)), WIDTH_RANGE[kind], units)]
    if messages == [None]:
        messages = [_size_fault(kind, "high", float(np.ptp(z)), HEIGHT_RANGE[kind], units)]
    return [(message, None) for message in messages if message is not None]


def _joined(y: FloatArray, step: FloatArray, usual: float) -> tuple[str, int] | None:
    """Jump from the end of one profile to the beginning of another."""
    dy = np.diff(y)
    back = -float(np.sign(np.median(dy))) * dy
    width = float(np.ptp(y))
    jumps = np.flatnonzero(((back > 0.3 * width) | (back < -0.5 * width)) & (step > 10.0 * usual))
    if not 0 < len(jumps) <= 20:
        return None
    j = int(jumps[0]) + 1
    if min(j, len(y) - int(jumps[-1]) - 1) < MIN_POINTS:
        return None
    return (
        f"the points jump {'back ' if back[j - 1] > 0.0 else ''}by {step[j - 1] * 1e3:.4g} mm at point "
        f"{j + 1}: {len(jumps) + 1} profiles in one list; give one",
        j,
    )


def _size_fault(kind: Kind, word: str, size: float, limits: tuple[float, float], units: str) -> str | None:
    """Return what is wrong with the size of the whole."""
    low, high = limits
    if low <= size <= high:
        return None
    message = (
        f"the {kind} profile is {size * 1e3:.4g} mm {word}, which is not within "
        f"{low * 1e3:g} .. {high * 1e3:g} mm"
    )
    for factor, words in _SCALES:
        if low <= size * factor <= high:
            column = " in z only, mixed units" if word == "high" else ""
            return f"{message}; it would fit if the numbers were {words}{column}: {units}"
    return f"{message}; check units and columns"


def _mixed_units(y: FloatArray, z: FloatArray, step: FloatArray, usual: float) -> tuple[str, int] | None:
    """First jump that a factor of 1000 on one of its ends would close."""
    size = np.hypot(y, z)
    for j in np.flatnonzero(step > 3.0 * usual):
        small, large = (j, j + 1) if size[j] < size[j + 1] else (j + 1, j)
        gap = float(np.hypot(1e3 * y[small] - y[large], 1e3 * z[small] - z[large]))
        if size[large] > 100.0 * size[small] and gap < 0.3 * step[j]:
            return (
                f"points {j + 1} and {j + 2} fit together only if one of them is taken 1000 times as large: "
                "mixed units; give all points in one unit",
                int(j + 1),
            )
    return None


def _order_faults(y: FloatArray, z: FloatArray) -> list[tuple[str, int | None]]:
    """Repeated points, and points that do not follow each other along the profile."""
    turn = _there_and_back(y)
    if turn is not None:
        return [
            (
                f"the points go across and from point {turn + 1} on back again: two profiles are joined "
                "(left and right?), or one is listed twice; give one",
                turn,
            )
        ]
    order = np.lexsort((z, y))
    same = (np.diff(y[order]) == 0.0) & (np.diff(z[order]) == 0.0)
    if np.any(same):
        pairs = sorted(tuple(sorted((int(order[k]), int(order[k + 1])))) for k in np.flatnonzero(same))
        return [(f"point {b + 1} repeats point {a + 1}; delete one of them", b) for a, b in pairs]
    dy, dz = np.diff(y), np.diff(z)
    step = np.hypot(dy, dz)
    back = np.flatnonzero(dy[1:] * dy[:-1] + dz[1:] * dz[:-1] < -0.9 * step[1:] * step[:-1]) + 1
    if 0 < len(back) < max(6, len(y) // 10):
        return [(f"the points turn back at point {j + 1}; put them in order", int(j)) for j in back]
    length, around = float(arc_length(y, z)[-1]), 2.0 * float(np.ptp(y) + np.ptp(z))
    if length > around or len(back):
        return [
            (
                f"the points make a path of {length * 1e3:.4g} mm, more than the {around * 1e3:.4g} mm "
                "around the profile: list them in their order along the profile, once",
                None,
            )
        ]
    gaps = np.flatnonzero((step > 5e-3) & (step > 10.0 * np.median(step))) + 1
    # drawn profiles end in a chamfer and a face of two points each, and instruments jump on the straight
    # side of a head or roller: nothing touches there
    end = max(_END_POINTS, len(y) // 50)
    gaps = gaps[(step[gaps - 1] > _END_PIECE) | ((gaps > end) & (gaps < len(y) - end))]
    return [
        (f"{step[j - 1] * 1e3:.4g} mm without a point before point {j + 1}; add the missing points", int(j))
        for j in gaps
    ]


def _there_and_back(y: FloatArray) -> int | None:
    """Point at which a list that has gone across turns and goes across again."""
    for turn in (int(np.argmax(y)), int(np.argmin(y))):
        if not MIN_POINTS <= turn < len(y) - MIN_POINTS:
            continue
        ways = np.diff(y[: turn + 1]), np.diff(y[turn:])
        across = [abs(float(way.sum())) for way in ways]
        straight = [far > 0.9 * float(np.abs(way).sum()) for far, way in zip(across, ways, strict=True)]
        if all(straight) and min(across) > 0.6 * float(np.ptp(y)):
            return turn
    return None


def _wheel_faults(y: FloatArray, z: FloatArray) -> list[tuple[str, int | None]]:
    """Orientation and origin of a wheel profile."""
    tread = float(np.median(z))
    highest, lowest = int(np.argmax(z)), int(np.argmin(z))
    edge = max(2, len(y) // 50)
    if tread - z[lowest] > z[highest] - tread and edge <= lowest < len(y) - edge:
        return [("the flange points to negative z: change the sign of z (positive radially outward)", lowest)]
    tip, half_way = float(y[highest]), 0.5 * float(y.min() + y.max())
    if tip > half_way:
        return [
            (
                f"the flange is at the end of larger y (tip at y = {tip * 1e3:.4g} mm); mirror the file: "
                "change the sign of y",
                highest,
            )
        ]
    if not _TIP_RANGE[0] <= tip <= _TIP_RANGE[1]:
        hint = ": y counts from the running circle"
        if _TIP_RANGE[0] <= tip - 0.070 <= _TIP_RANGE[1]:
            hint = "; it would fit with y counted from the running circle: subtract 70 mm from y"
        return [
            (
                f"the flange tip is at y = {tip * 1e3:.4g} mm, which is not within "
                f"{_TIP_RANGE[0] * 1e3:g} .. {_TIP_RANGE[1] * 1e3:g} mm{hint}",
                highest,
            )
        ]
    if y.max() < 0.020:
        return [
            (
                f"the profile ends at y = {y.max() * 1e3:.4g} mm; the tread is needed up to 20 mm at least",
                None,
            )
        ]
    at_circle = float(z[int(np.argmin(np.abs(y)))])
    if abs(at_circle) > _CIRCLE_LIMIT:
        return [
            (
                f"z = {at_circle * 1e3:.4g} mm at the running circle (y = 0), which is not within "
                f"+-{_CIRCLE_LIMIT * 1e3:g} mm: z counts from the running circle of the new wheel",
                None,
            )
        ]
    return []


def head_faults(y: FloatArray, z: FloatArray) -> list[tuple[str, int | None]]:
    """Orientation of a rail head; its origin is set by the gauge later.

    Parameters
    ----------
    y, z : (n,) array
        Points [m].

    Returns
    -------
    list of (str, int or None)
        As `points_faults`.
    """
    middle = 0.5 * (float(y.min()) + float(y.max()))
    crown = float(np.median(z[np.abs(y - middle) < 0.2 * np.ptp(y)]))
    if not crown < 0.5 * (float(z[0]) + float(z[-1])):
        return [("the head's top has larger z than its ends: change the sign of z (positive down)", None)]
    return []
