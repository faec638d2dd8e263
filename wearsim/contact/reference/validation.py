"""Limits of the arguments of closed forms: errors in one line with the first row outside a formula's domain.

Every function returns its value as floats and raises ContactError; `name` and `unit` are for the message.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wearsim.contact.patch import FloatArray
from wearsim.errors import ContactError


def positive(name: str, value: ArrayLike, unit: str, hint: str = "") -> FloatArray:
    """Array that must be above zero and finite; `hint` is the end of the message."""
    array = _floats(name, value)
    _check(~((array > 0.0) & (array < np.inf)), array, name, unit, f"must be above 0 and finite{hint}")
    return array


def within(name: str, value: ArrayLike, unit: str, low: float, high: float) -> FloatArray:
    """Array that must be in a closed interval; infinite ends let every finite value pass."""
    array = _floats(name, value)
    limits = f"must be in {low:g} .. {high:g}"
    if high == np.inf:
        limits = "must be finite" if low == -np.inf else f"must be {low:g} or above, and finite"
    _check(~((array >= low) & (array <= high) & np.isfinite(array)), array, name, unit, limits)
    return array


def finite(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Array that must be finite."""
    return within(name, value, unit, -np.inf, np.inf)


def vectors(name: str, value: ArrayLike, unit: str, columns: tuple[int, ...]) -> FloatArray:
    """Array (m, k) of one vector per row, all of it finite, with k one of `columns`."""
    array = finite(name, value, unit)
    if array.ndim != 2 or array.shape[1] not in columns:
        allowed = " or ".join(f"(m, {k})" for k in columns)
        raise ContactError(
            f"{name} has the shape {array.shape} and must have {allowed}: a row for each contact"
        )
    return array


def number(name: str, value: FloatArray) -> float:
    """Single number."""
    if value.ndim != 0:
        raise ContactError(f"{name} has the shape {value.shape} and must be one number for all contacts")
    return float(value)


def per_row(name: str, value: FloatArray, count: int) -> FloatArray:
    """Array (count,), read-only, of a quantity of which each row has one, or all rows the same."""
    if value.shape not in ((), (count,)):
        raise ContactError(
            f"{name} has the shape {value.shape} and must be a number or have ({count},): "
            "one for each row of the creepages"
        )
    return np.broadcast_to(value, (count,))


def alike(**values: FloatArray) -> list[FloatArray]:
    """Broadcast quantities to one shape, in the order given, read-only."""
    try:
        return list(np.broadcast_arrays(*values.values()))
    except ValueError:
        shapes = [f"{name.replace('_', ' ')} {v.shape}" for name, v in values.items() if v.ndim > 0]
        raise ContactError(f"shapes do not fit together: {', '.join(shapes)}") from None


def _floats(name: str, value: ArrayLike) -> FloatArray:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ContactError(f"{name} must be numbers in rows of equal length") from None


def _check(bad: NDArray[np.bool_], array: FloatArray, name: str, unit: str, limits: str) -> None:
    if bad.any():
        index = int(np.argmax(bad))
        shown = f"{array.reshape(-1)[index]:.4g}" + ("" if unit == "-" else f" {unit}")
        row = index // (array.size // array.shape[0]) if array.ndim > 0 else None
        raise ContactError(f"{name} = {shown} {limits}", row=row)
