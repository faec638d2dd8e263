"""A few patches at a time: laws make several copies of the cells, which then fit the cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

_PATCHES = 16

Arrays = TypeVar("Arrays")


def batches(count: int) -> Iterator[slice]:
    """Yield slices of a few patches each; one, empty, if there are none."""
    for start in range(0, max(count, 1), _PATCHES):
        yield slice(start, start + _PATCHES)


def part_of(arrays: Arrays, patches: slice) -> Arrays:
    """Return some patches of a dataclass of arrays (m, ...), and of the dataclasses it holds."""
    parts: dict[str, Any] = {}
    for field in fields(arrays):  # type: ignore[arg-type]
        value = getattr(arrays, field.name)
        parts[field.name] = part_of(value, patches) if is_dataclass(value) else value[patches]
    return type(arrays)(**parts)
