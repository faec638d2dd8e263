"""How hot loops are compiled: one decorator for every kernel of the contact rooms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Only flags that keep NaN and infinity meaningful: a NaN must stay visible (architecture section 4).
# Error model "numpy": a check for division by zero in the loop would keep it from using vector
# instructions; kernels guard the places where it can happen.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}


def kernel(function: _Function) -> _Function:
    """Compile `function` with numba, releasing the GIL, cached on disk where a place for it exists.

    One source function per kernel: two variants of one function would share a cache entry (numba #6845).
    The cache watches the kernel's own file only: after editing a kernel that is called from another file
    (strip_half_length_squared, cell_of), touch the file of the caller.
    """
    try:
        compiled = numba.njit(cache=True, **_OPTIONS)(function)
    except RuntimeError:  # neither the installation nor the user's cache directory can be written
        compiled = numba.njit(**_OPTIONS)(function)
    return compiled  # type: ignore[no-any-return]
