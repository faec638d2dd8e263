"""Batches of contact patches, small enough for the processor's cache.

Wear laws make several copies of the cell arrays.
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
    """Yield batches of patches from arrays (m, ...) or dataclasses of such arrays.

    Without any patches one empty batch is yielded.
    """
    for start in range(0, max(count, 1), _PATCHES):
        yield joined([arrays], slice(start, start + _PATCHES))


def require_usable(law: str, bad: NDArray[np.bool_], fault: str) -> None:
    """Raise an error if a law cannot use some patches (m,) of the contact.

    `fault` is the text that states the allowed values.
    """
    if bad.any():
        raise NumericalError(
            f"{law} got contact fields that are {fault} in {bad.sum()} of {bad.size} "
            f"patches (first: {np.argmax(bad)}); look at this operating point with the "
            "contact command"
        )
