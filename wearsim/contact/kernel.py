"""Compilation of kernels: the decorators for all hot loops of the contact package."""

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

# Error model "numpy": a check for division by zero in the loop would prevent vector
# instructions; kernels guard the places where it can happen. There is no wrapper for
# calls from C, which are not used and would take time to compile.
_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
}
_INNER: dict[str, Any] = {"no_cpython_wrapper": True}
# Only flags that preserve NaN and infinity: a NaN must remain visible.
_REASSOCIATED: dict[str, Any] = {
    **_OPTIONS,
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}


def kernel(function: _Function) -> _Function:
    """Compile `function` with numba, releasing the GIL.

    The code is cached on disk if possible.

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
    """Compile as `kernel` does, without reference counts of arrays.

    It is for kernels that allocate no arrays; numba does not compile others this way.
    Counting takes an atomic operation per array and call: with named tuples of twenty
    arrays it costs more than a loop over a hundred strips. Such a kernel must not
    return arrays either, because a kernel that counts would release them. The option is
    private to numba; a version without it compiles as `kernel` does.
    """
    return _compiled(
        function, {**_OPTIONS, **_uncounted(getattr(cpu, "CPUTargetOptions", None))}
    )


def inner_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, without the wrapper for calls from Python.

    Such a kernel is called by kernels alone. The wrapper unpacks each array of each
    tuple among the arguments, which takes long to compile.
    """
    return _compiled(function, {**_OPTIONS, **_INNER})


def inner_bare_kernel(function: _Function) -> _Function:
    """Compile as `bare_kernel` does, for calls from kernels alone."""
    return _compiled(
        function,
        {**_OPTIONS, **_INNER, **_uncounted(getattr(cpu, "CPUTargetOptions", None))},
    )


def inlined_bare_kernel(function: _Function) -> _Function:
    """Compile as `bare_kernel` does, inlined into the calling kernels.

    A call passes every array in ten parts, which takes as long as a few lines of
    arithmetic.
    """
    uncounted = _uncounted(getattr(cpu, "CPUTargetOptions", None))
    return _compiled(function, {**_OPTIONS, **uncounted, "forceinline": True})


class _Inner(registry.CPUDispatcher):  # type: ignore[misc]
    """Inner kernel; without its wrapper a call from Python would end the process."""

    def __call__(self, *_: Any, **__: Any) -> None:
        raise TypeError(
            f"{self.py_func.__qualname__}: an inner kernel, which kernels alone can "
            "call"
        )


def _uncounted(target: object) -> dict[str, Any]:
    """Compiler target option that disables reference counting, if there is one."""
    return {"_nrt": False} if hasattr(target, "_nrt") else {}


def leaf_kernel(function: _Function) -> _Function:
    """Compile as `kernel` does, but allow sums to be reordered.

    That is three times as fast where a sum is the loop. It is only for kernels that
    call no kernel and are called by none, always with the same types, floats and
    `plain` arrays: numba selects among the variants compiled so far, and the last bit
    would depend on previous calls. After all tests it is checked that none has a second
    variant.
    """
    return _compiled(function, _REASSOCIATED)


_LOG = logging.getLogger("wearsim.kernels")

UNCACHED: list[str] = []
"""Reason why kernels are compiled in each process, empty if the cache works."""


def _compiled(function: _Function, options: dict[str, Any]) -> _Function:
    try:
        compiled = numba.njit(cache=True, **options)(function)
    except (
        RuntimeError
    ):  # neither the installation nor the user's cache directory is writable
        UNCACHED.append("no folder for it can be written")
        compiled = numba.njit(**options)(function)
    if "no_cpython_wrapper" in options and isinstance(
        compiled, registry.CPUDispatcher
    ):  # otherwise compilation is disabled
        compiled.__class__ = _Inner
    cache: Any = getattr(compiled, "_cache", None)
    if hasattr(cache, "load_overload"):
        cache.load_overload = _announcing(_forgiving(cache.load_overload))
        cache.save_overload = _forgiving(cache.save_overload)
    return compiled


def _announcing(load: Callable[..., Any]) -> Callable[..., Any]:
    """Announce the compilation of a kernel that is not in the cache."""

    def call(*arguments: Any) -> Any:
        overload = load(*arguments)
        if overload is None:
            _announce()
        return overload

    return call


@functools.cache
def _announce() -> None:
    """Log once that kernels are being compiled.

    A first run is silent for half a minute otherwise.
    """
    _LOG.info(
        "compiling kernels of the contact models: a first run here takes up to a "
        "minute longer"
    )


def _forgiving(of_cache: Callable[..., Any]) -> Callable[..., Any]:
    """Continue without the cache if the disk is full or a cache file is damaged."""

    def call(*arguments: Any) -> Any:
        try:
            return of_cache(*arguments)
        except Exception as error:  # a damaged pickle may raise any exception
            UNCACHED.append(
                " ".join(str(getattr(error, "strerror", None) or repr(error)).split())
            )
            return None

    return call


def plain(array: ArrayLike, kind: type[Any] = np.float64) -> NDArray[Any]:
    """Return an array as kernels are compiled for it: contiguous and writeable."""
    if type(array) is np.ndarray and array.dtype == kind and array.flags.carray:
        return array
    return np.require(array, kind, ("C", "W"))
