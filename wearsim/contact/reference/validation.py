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
    array = _floats(name, value)
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
    array = _floats(name, value)
    limits = f"must be in {low:g} .. {high:g}"
    if high == np.inf:
        limits = "must be finite" if low == -np.inf else f"must be {low:g} or above, and finite"
    _refuse(~((array >= low) & (array <= high) & np.isfinite(array)), array, name, unit, limits + way_out)
    return array


def finite(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Array of a quantity that must be finite; parameters as of :func:`within`.

    Raises
    ------
    ContactError
        For the first entry that is not.
    """
    return within(name, value, unit, -np.inf, np.inf)


def vectors(name: str, value: ArrayLike, unit: str, columns: tuple[int, ...]) -> FloatArray:
    """Array of one vector per row, all of it finite.

    Parameters
    ----------
    name, unit : str
        As the message tells them.
    value : (m, k) array
        Rows of vectors.
    columns : tuple of int
        Numbers of columns k that are allowed.

    Returns
    -------
    (m, k) array
        The value as floats.

    Raises
    ------
    ContactError
        If it has another shape, or an entry is not finite.
    """
    array = finite(name, value, unit)
    if array.ndim != 2 or array.shape[1] not in columns:
        allowed = " or ".join(f"(m, {k})" for k in columns)
        raise ContactError(
            f"{name} has the shape {array.shape} and must have {allowed}: a row for each contact"
        )
    return array


def number(name: str, value: FloatArray) -> float:
    """Return a quantity that must be a single number.

    Parameters
    ----------
    name : str
        As the message tells it.
    value : array
        Checked otherwise.

    Raises
    ------
    ContactError
        If it has axes.
    """
    if value.ndim != 0:
        raise ContactError(f"{name} has the shape {value.shape} and must be one number for all contacts")
    return float(value)


def per_row(name: str, value: FloatArray, count: int) -> FloatArray:
    """Return a quantity of which each row has one, or all rows the same.

    Parameters
    ----------
    name : str
        As the message tells it.
    value : (count,) array or float
        Checked otherwise.
    count : int
        Number of rows.

    Returns
    -------
    (count,) array
        Read-only.

    Raises
    ------
    ContactError
        If it has another shape.
    """
    if value.shape not in ((), (count,)):
        raise ContactError(
            f"{name} has the shape {value.shape} and must be a number or have ({count},): "
            "one for each row of the creepages"
        )
    return np.broadcast_to(value, (count,))


def alike(**values: FloatArray) -> list[FloatArray]:
    """Broadcast quantities to one shape.

    Parameters
    ----------
    **values : array
        Checked otherwise; underscores of their names are told as spaces.

    Returns
    -------
    list of array
        In the order given, read-only.

    Raises
    ------
    ContactError
        If their shapes do not fit; names all of them that have axes.
    """
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


def _refuse(bad: NDArray[np.bool_], array: FloatArray, name: str, unit: str, limits: str) -> None:
    if bad.any():
        index = int(np.argmax(bad))
        shown = f"{array.reshape(-1)[index]:.4g}" + ("" if unit == "-" else f" {unit}")
        row = index // (array.size // array.shape[0]) if array.ndim > 0 else None
        raise ContactError(f"{name} = {shown} {limits}", row=row)
