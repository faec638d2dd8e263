"""A few patches at a time.

Laws make several copies of the cells, which then fit the cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.wheels import joined
from wearsim.errors import NumericalError

_PATCHES = 16


def batches(arrays: Any, count: int) -> Iterator[Any]:
    """Yield a few of the patches of arrays (m, ...), or of dataclasses of them.

    Once, empty, without any.
    """
    for start in range(0, max(count, 1), _PATCHES):
        yield joined([arrays], slice(start, start + _PATCHES))


def require_usable(law: str, bad: NDArray[np.bool_], fault: str) -> None:
    """Raise if some patches (m,) of the contact cannot be used by a law.

    `fault` says what they may be.
    """
    if bad.any():
        raise NumericalError(
            f"{law} got contact fields that are {fault} in {bad.sum()} of {bad.size} "
            f"patches (first: {np.argmax(bad)}); look at this operating point with the "
            "contact command"
        )
