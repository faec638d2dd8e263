"""Checks of a list of points as a wheel or rail profile in wearsim's axes and units."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from wearsim.profile.shape import FloatArray, Kind

PointFault = tuple[str, int | None]
"""Message and index of the point; None stands for the profile as a whole."""

MIN_POINTS = 20
# Plausible widths of a measured cross-section [m]; part of a rail head or roller is
# enough for a contact.
WIDTH_RANGE: dict[str, tuple[float, float]] = {
    "wheel": (0.080, 0.200),
    "rail": (0.010, 0.200),
}
PARTIAL = 0.030
"""Width below which a rail profile counts as part of a head [m].

It then lacks the gauge point and may be flat.
"""
# Difference of the largest and smallest z [m]; a wheel has a flange, a rail may end on
# its crown.
HEIGHT_RANGE: dict[str, tuple[float, float]] = {
    "wheel": (0.015, 0.150),
    "rail": (0.001, 0.200),
}
# Other units that files use, with their factor to the stated unit.
_SCALES = {
    1e3: "1000 times as large",
    1e-3: "1000 times as small",
    10.0: "10 times as large (cm)",
    25.4: "25.4 times as large (inches)",
}
_END_PIECE = 0.020  # longest straight end piece that needs no intermediate points [m]
_END_POINTS = 3  # largest number of points between it and the end, or one in fifty
_TIP_RANGE = (
    -0.080,
    -0.030,
)  # lateral position of flange tips, from the running circle [m]
_TIP_FROM_GAUGE_POINT = (-0.025, -0.005)  # of a wheel counted from there [m]
_CIRCLE_LIMIT = (
    0.015  # |z| at the running circle of a worn wheel measured from the new one [m]
)


def points_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[PointFault]:
    """Faults of the points y, z (n,) [m] of a wheel or rail profile.

    Each is a message and the index of its point.

    The index is None for the profile as a whole. Later checks need the earlier ones
    passed: number and finiteness, size, order, orientation and origin. `units` is the
    fix if another unit would fit.
    """
    faults = shape_faults(kind, y, z, units)
    return faults or (_wheel_faults(y, z) if kind == "wheel" else head_faults(y, z))


def shape_faults(
    kind: Kind, y: FloatArray, z: FloatArray, units: str = "state the right units"
) -> list[PointFault]:
    """Faults that do not depend on orientation and origin, as of `points_faults`."""
    if y.ndim != 1 or y.shape != z.shape:
        return [
            (
                (
                    "y and z must be two lists of equal length, not of shapes "
                    f"{y.shape} and {z.shape}"
                ),
                None,
            )
        ]
    faults: list[PointFault] = []
    if len(y) < MIN_POINTS:
        text = (
            f"number of points = {len(y)} is too few for a profile; give at least "
            f"{MIN_POINTS}"
        )
        faults.append((text, None))
    for j in np.flatnonzero(~(np.isfinite(y) & np.isfinite(z))):
        faults.append(
            (
                f"point {j + 1} is not finite; delete or repeat the measurement of it",
                int(j),
            )
        )
    return (
        faults
        or list(_wild_points(y, z))
        or _size(kind, y, z, units)
        or list(_order(y, z))
    )


def _wild_points(y: FloatArray, z: FloatArray) -> Iterator[PointFault]:
    step = np.hypot(np.diff(y), np.diff(z))
    across = np.hypot(y[2:] - y[:-2], z[2:] - z[:-2])
    both = np.minimum(step[1:], step[:-1])
    wild = (both > np.maximum(3.0 * np.median(step), 2e-3)) & (across < 0.5 * both)
    for j in np.flatnonzero(wild) + 1:
        text = (
            f"point {j + 1} lies {1e3 * both[j - 1]:.3g} mm off both neighbours; "
            "correct or delete it, or give all points in one unit"
        )
        yield text, int(j)


def _size(kind: Kind, y: FloatArray, z: FloatArray, units: str) -> list[PointFault]:
    """Faults of the width of the whole profile, else of its height."""
    flat = kind == "rail" and float(np.ptp(y)) < PARTIAL
    for word, values, (low, high) in (
        ("wide", y, WIDTH_RANGE[kind]),
        ("high", z, HEIGHT_RANGE[kind]),
    ):
        size = float(np.ptp(values))
        if not (low <= size or (flat and word == "high")) or size > high:
            fits = " or ".join(
                words
                for factor, words in _SCALES.items()
                if low <= size * factor <= high
            )
            hint = (
                f"it would fit if the numbers were {fits}: {units}"
                if fits
                else "check units and columns"
            )
            text = (
                f"the {kind} profile is {1e3 * size:.4g} mm {word}, which is not "
                f"within {1e3 * low:g} .. {1e3 * high:g} mm; {hint}"
            )
            return [(text, None)]
    return []


def turns(y: FloatArray, z: FloatArray) -> NDArray[np.intp]:
    """Return the points at which the order turns back by more than 154 degrees."""
    dy, dz = np.diff(y), np.diff(z)
    step = np.hypot(dy, dz)
    return (
        np.flatnonzero(
            dy[1:] * dy[:-1] + dz[1:] * dz[:-1] < -0.9 * step[1:] * step[:-1]
        )
        + 1
    )


def _order(y: FloatArray, z: FloatArray) -> Iterator[PointFault]:
    """Faults of the order of points along the profile, and gaps between them."""
    if len(back := turns(y, z)):
        more = f" (and at {len(back) - 1} more)" if len(back) > 1 else ""
        text = (
            f"the points turn back at point {back[0] + 1}{more}; list them in their "
            "order along the profile, once"
        )
        yield text, int(back[0])
        return
    step, count = np.hypot(np.diff(y), np.diff(z)), len(y)
    gaps = np.flatnonzero((step > 5e-3) & (step > 10.0 * np.median(step))) + 1
    # Drawn profiles end in a chamfer and a face of two points each, and instruments
    # jump on the straight side of a head or roller; these parts have no contact.
    end = max(_END_POINTS, count // 50)
    for j in gaps[
        (step[gaps - 1] > _END_PIECE) | ((gaps > end) & (gaps < count - end))
    ]:
        text = (
            f"{1e3 * step[j - 1]:.4g} mm without a point before point {j + 1}; add the "
            "missing points, or give one profile in one unit"
        )
        yield text, int(j)


def _wheel_faults(y: FloatArray, z: FloatArray) -> list[PointFault]:
    """Orientation and origin of a wheel profile."""
    tread, edge = float(np.median(z)), max(2, len(y) // 50)
    highest, lowest = int(np.argmax(z)), int(np.argmin(z))
    tip, at_circle = float(y[highest]), float(z[int(np.argmin(np.abs(y)))])
    low, high = _TIP_RANGE
    if tread - z[lowest] > z[highest] - tread and edge <= lowest < len(y) - edge:
        text = (
            "the flange points to negative z: change the sign of z (positive radially "
            "outward)"
        )
        return [(text, lowest)]
    if tip > 0.5 * float(y.min() + y.max()):
        text = (
            f"the flange is at the end of larger y (tip at y = {1e3 * tip:.4g} mm); "
            "mirror the file: change the sign of y"
        )
        return [(text, highest)]
    if not low <= tip <= high:
        fits = (
            "; it would fit with y counted from the running circle: subtract 70 mm "
            "from y"
        )
        on_flange = (
            "; it would fit with y and z counted from a gauge point on the flange: "
            "state the origin gauge_point, or offsets of y and z"
        )
        hint = ": y counts from the running circle; state the origin or the offset of y"
        if low <= tip - 0.070 <= high:
            hint = fits
        elif _TIP_FROM_GAUGE_POINT[0] <= tip <= _TIP_FROM_GAUGE_POINT[1]:
            hint = on_flange
        text = (
            f"the flange tip is at y = {1e3 * tip:.4g} mm, which is not within "
            f"{1e3 * low:g} .. {1e3 * high:g} mm{hint}"
        )
        return [(text, highest)]
    if y.max() < 0.020:
        text = (
            f"the profile ends at y = {1e3 * y.max():.4g} mm; the tread is needed up "
            "to 20 mm at least"
        )
        return [(text, None)]
    if abs(at_circle) > _CIRCLE_LIMIT:
        text = (
            f"z = {1e3 * at_circle:.4g} mm at the running circle (y = 0), which is not "
            f"within +-{1e3 * _CIRCLE_LIMIT:g} mm: z counts from the running circle of "
            "the new wheel; state the offset of z"
        )
        return [(text, None)]
    return []


def head_fall(y: FloatArray, z: FloatArray) -> float:
    """Mean z at the ends of a rail head y, z (n,) less z in its middle [m]."""
    inner = np.abs(y - 0.5 * (float(y.min()) + float(y.max()))) < 0.2 * np.ptp(y)
    crown = float(np.median(z[inner])) if np.any(inner) else 0.5 * float(z[0] + z[-1])
    return 0.5 * (float(z[0]) + float(z[-1])) - crown


def head_faults(y: FloatArray, z: FloatArray) -> list[PointFault]:
    """Faults of the orientation of a rail head, as in `points_faults`.

    The gauge determines its origin later.
    """
    fall = head_fall(y, z)
    if fall == 0.0 and float(np.ptp(y)) < PARTIAL:
        return []  # a cylindrical disc
    if fall == 0.0:
        return [
            ("the head is as high at its ends as in its middle; check columns", None)
        ]
    if fall < 0.0:
        return [
            (
                (
                    "the head's top has larger z than its ends: change the sign of z "
                    "(positive down)"
                ),
                None,
            )
        ]
    return []
