"""What closed forms refuse: input outside the domain of a formula, in one line with its first bad row."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wearsim.contact.patch import FloatArray
from wearsim.errors import ContactError


def positive(name: str, value: ArrayLike, unit: str, way_out: str = "") -> FloatArray:
    """Array of a quantity that must be above zero and finite.

    Parameters
    ----------
    name : str
        As the message tells it.
    value : array
        Any shape.
    unit : str
        SI unit, "-" for ratios.
    way_out : str
        End of the message.

    Returns
    -------
    array
        The value as floats.

    Raises
    ------
    ContactError
        For the first entry that is not.
    """
    array = np.asarray(value, dtype=float)
    _refuse(~((array > 0.0) & (array < np.inf)), array, name, unit, f"must be above 0 and finite{way_out}")
    return array


def within(
    name: str,
    value: ArrayLike,
    unit: str,
    low: float,
    high: float,
    way_out: str = "",
) -> FloatArray:
    """Array of a quantity that must be in a closed interval.

    Parameters
    ----------
    name : str
        As the message tells it.
    value : array
        Any shape.
    unit : str
        SI unit, "-" for ratios.
    low, high : float
        Ends of the interval; infinite ones let every finite value pass.
    way_out : str
        End of the message.

    Returns
    -------
    array
        The value as floats.

    Raises
    ------
    ContactError
        For the first entry outside.
    """
    array = np.asarray(value, dtype=float)
    limits = f"must be in {low:g} .. {high:g}"
    if high == np.inf:
        limits = "must be finite" if low == -np.inf else f"must be {low:g} or above, and finite"
    _refuse(~((array >= low) & (array <= high) & np.isfinite(array)), array, name, unit, limits + way_out)
    return array


def _refuse(bad: NDArray[np.bool_], array: FloatArray, name: str, unit: str, limits: str) -> None:
    if bad.any():
        index = int(np.argmax(bad))
        shown = f"{array.reshape(-1)[index]:.4g}" + ("" if unit == "-" else f" {unit}")
        raise ContactError(f"{name} = {shown} {limits}", row=index if array.ndim > 0 else None)
