"""What normal models refuse, in one wording for all of them."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import IntArray
from wearsim.errors import ContactError, NumericalError

NO_TOUCH, AT_EDGE, TOO_MANY, NOT_SINGLE, NO_BALANCE, NO_CONVERGENCE = 1, 2, 3, 4, 5, 6
MOST_PATCHES = 4  # of one wheel

_CHECK = "; check shift, gauge and profiles"
_TEXT = {
    NO_TOUCH: f"the wheel does not touch the counterface at any lateral position{_CHECK}",
    AT_EDGE: f"the contact patch reaches the edge of a profile{_CHECK}",
    TOO_MANY: f"the wheel has more than {MOST_PATCHES} contact patches{_CHECK}",
    NOT_SINGLE: "several patches close: a normal force belongs to one; give the wheel load instead",
    NO_BALANCE: "no descent of the wheel was found that carries the load; check load and profiles, smooth "
    "measured ones, or take the normal model half_space",
    NO_CONVERGENCE: "the pressure of the half-space has not converged; take fewer strips and "
    "cells, or smooth measured profiles",
}


def refusal(kind: int, row: int) -> ContactError | NumericalError:
    """Error for a row without an answer.

    Parameters
    ----------
    kind : int
        One of the numbers above.
    row : int
        Of the batch; the caller knows which operating point it is.

    Returns
    -------
    ContactError or NumericalError
        The latter for NO_BALANCE and NO_CONVERGENCE.
    """
    return (NumericalError if kind in (NO_BALANCE, NO_CONVERGENCE) else ContactError)(_TEXT[kind], row=row)


def raise_first(fault: IntArray) -> None:
    """Tell the first row without an answer.

    Parameters
    ----------
    fault : (n,) int array
        0, or one of the numbers above, for each row.

    Raises
    ------
    ContactError, NumericalError
        If a row is not 0.
    """
    failed = np.flatnonzero(fault)
    if failed.size > 0:
        raise refusal(int(fault[failed[0]]), int(failed[0]))
