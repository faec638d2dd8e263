"""How hot loops are compiled: the decorators for every kernel of the contact rooms."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import cpu, registry
from numpy.typing import ArrayLike, NDArray

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Error model "numpy": a check for division by zero in the loop would keep it from using
# vector instructions; kernels guard the places where it can happen.
# No wrapper for calls from C, which nothing here makes and which would be compiled as
# well.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
}
_INNER: dict[str, Any] = {"no_cpython_wrapper": True}
# Only flags that keep NaN and infinity meaningful: a NaN must stay visible
# (architecture section 4).
_REASSOCIATED: dict[str, Any] = {
    **_OPTIONS,
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}


def kernel(function: _Function) -> _Function:
    """Compile `function` with numba, releasing the GIL.

    Cached on disk where a place for it exists.

    Sums keep their order, so that the last bit is the same in every variant: a kernel
    that others call is inlined into some of them and not into others, depending on what
    the cache held when each was compiled.

    One source function per kernel: two variants of one function would share a cache
    entry (numba #6845). The cache watches the kernel's own file only: after editing a
    kernel that is called from another file (place_in, smooth_at), touch the file of the
    caller.
    """
    return _compiled(function, _OPTIONS)


def bare_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, without counting references to arrays.

    For kernels that allocate none.

    Counting takes an atomic operation per array and call: with named tuples of twenty
    arrays it costs more than a loop over a hundred strips. Numba does not compile one
    that allocates. It must not return arrays either: a kernel that counts would release
    them. The option is private to numba; a version without it compiles as `kernel`
    does.
    """
    return _compiled(
        function, {**_OPTIONS, **_uncounted(getattr(cpu, "CPUTargetOptions", None))}
    )


def inner_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, for calls from kernels alone.

    Without the wrapper for those from Python.

    The wrapper takes apart each array of each tuple among the arguments, which is much
    to compile.
    """
    return _compiled(function, {**_OPTIONS, **_INNER})


def inner_bare_kernel(function: _Function) -> _Function:
    """Compile as `bare_kernel` does, for calls from kernels alone."""
    return _compiled(
        function,
        {**_OPTIONS, **_INNER, **_uncounted(getattr(cpu, "CPUTargetOptions", None))},
    )


def inlined_bare_kernel(function: _Function) -> _Function:
    """Compile as `bare_kernel` does, and put the code into the kernels that call it.

    A call hands over every array in ten parts, which takes as long as a few lines of
    arithmetic.
    """
    uncounted = _uncounted(getattr(cpu, "CPUTargetOptions", None))
    return _compiled(function, {**_OPTIONS, **uncounted, "forceinline": True})


class _Inner(registry.CPUDispatcher):  # type: ignore[misc]
    """An inner kernel; without its wrapper a call from Python would end the process."""

    def __call__(self, *_: Any, **__: Any) -> None:
        raise TypeError(
            f"{self.py_func.__qualname__}: an inner kernel, which kernels alone can "
            "call"
        )


def _uncounted(target: object) -> dict[str, Any]:
    """Option of a compiler's target that switches the counting off, if it has one."""
    return {"_nrt": False} if hasattr(target, "_nrt") else {}


def leaf_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, free to reorder sums.

    Three times as fast where a sum is the loop.

    Only for kernels that call no kernel and are called by none, always with the same
    types, floats and `plain` arrays: numba picks among the variants compiled so far,
    and the last bit would hang on what was called before. After all tests it is checked
    that none has a second variant.
    """
    return _compiled(function, _REASSOCIATED)


_LOG = logging.getLogger("wearsim.kernels")

UNCACHED: list[str] = []
"""Why kernels are compiled anew in each process; empty where the cache works."""


def _compiled(function: _Function, options: dict[str, Any]) -> _Function:
    try:
        compiled = numba.njit(cache=True, **options)(function)
    except (
        RuntimeError
    ):  # neither the installation nor the user's cache directory can be written
        UNCACHED.append("no folder for it can be written")
        compiled = numba.njit(**options)(function)
    if "no_cpython_wrapper" in options and isinstance(
        compiled, registry.CPUDispatcher
    ):  # else no JIT
        compiled.__class__ = _Inner
    cache: Any = getattr(compiled, "_cache", None)
    if hasattr(cache, "load_overload"):
        cache.load_overload = _announcing(_forgiving(cache.load_overload))
        cache.save_overload = _forgiving(cache.save_overload)
    return compiled


def _announcing(load: Callable[..., Any]) -> Callable[..., Any]:
    """Let a kernel that is not in the cache, and is compiled next, be announced."""

    def call(*arguments: Any) -> Any:
        found = load(*arguments)
        if found is None:
            _announce()
        return found

    return call


@functools.cache
def _announce() -> None:
    """Log once that kernels are compiled.

    Nothing else is heard of a first run for half a minute.
    """
    _LOG.info(
        "compiling kernels of the contact models: a first run here takes up to a "
        "minute longer"
    )


def _forgiving(of_cache: Callable[..., Any]) -> Callable[..., Any]:
    """Let a full disk or a damaged file of the cache cost time, not the run."""

    def call(*arguments: Any) -> Any:
        try:
            return of_cache(*arguments)
        except Exception as error:  # a damaged pickle raises anything
            UNCACHED.append(
                " ".join(str(getattr(error, "strerror", None) or repr(error)).split())
            )
            return None

    return call


def plain(array: ArrayLike, kind: type[Any] = np.float64) -> NDArray[Any]:
    """Return the same numbers as the one kind of array kernels are compiled for.

    Contiguous, writeable.
    """
    if type(array) is np.ndarray and array.dtype == kind and array.flags.carray:
        return array
    return np.require(array, kind, ("C", "W"))
