"""Values that take the place of those in a scene file, by `--set`, a sweep or a study.

Scenes as TOML.
"""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, time
from pathlib import Path, PurePath
from typing import Any

from wearsim.errors import Fault, SceneError, brief, raise_any, shown
from wearsim.toml_faults import DEEPEST, KeyPath, Lines, line_of

NOTE = "# scene with"
"""Begin of a scene file that was written with overrides."""

_QUOTES = ('"', "'")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Override:
    """Another value for one key of a scene.

    The key is dotted, such as "wheelset.radius_mm". In a list of tables a number
    counted from 1 selects one of them ("operation.block.2.friction"), a name those of
    that name ("operation.block.curve.friction"); a key without them means all tables.
    Rows of a programme are selected like blocks.
    """

    key: str
    value: (
        Any  # as `tomllib` reads it; None removes the key, so that its default applies
    )
    source: str | None = None  # flag or file that asks for it, named in faults
    line: int | None = None  # its line in that file

    @property
    def keys(self) -> tuple[str, ...]:
        """Parts of the key."""
        return tuple(self.key.split("."))

    @property
    def label(self) -> str:
        """Last part of the key, and the value."""
        return (
            f"{self.keys[-1]} "
            f"{'removed' if self.value is None else f'= {shown(self.value)}'}"
        )


Overrides = Mapping[str, Any] | Sequence[Override]
"""What functions take: values by dotted keys, such as {"contact.model": "fast"}, or a
list of `Override`.
"""


def as_overrides(given: Overrides) -> list[Override]:
    """Return overrides as a list.

    Raises
    ------
    SceneError
        With all keys that are not dotted, and values that TOML has no type for.
    """
    if not isinstance(given, Mapping):
        return list(given)
    overrides, faults = [], []
    for key, value in given.items():
        if not (isinstance(key, str) and all(key.split("."))):
            faults.append(
                Fault(
                    f"{key!r} must be a dotted key, such as campaign.distance_km",
                    "overrides",
                )
            )
            continue
        plain = None if value is None else _plain_value(value, key)
        overrides.append(Override(key, plain, "overrides"))
    raise_any(faults)
    return overrides


class OverriddenLine(int):
    """Line of a key whose value was overridden; carries the override to the fault."""

    override: Override

    @classmethod
    def of(cls, line: int, override: Override) -> OverriddenLine:
        """Return the line with the override that acts there."""
        overridden = cls(line)
        overridden.override = override
        return overridden


def merge(
    data: Mapping[str, Any], overrides: Sequence[Override], lines: Lines
) -> dict[str, Any]:
    """Merge overrides into a copy of a parsed scene; later ones win.

    `lines` of the keys are changed in place, so that `at_its_source` names the override
    in a fault.

    Raises
    ------
    SceneError
        With the overrides of tables that do not exist.
    """
    merged = copy.deepcopy(dict(data))
    faults = []
    for override in overrides:
        paths = (
            list(paths_of(merged, override.keys))
            if len(override.keys) <= DEEPEST
            else []
        )
        if not paths or not all(
            [_set_value(merged, path, override.value) for path in paths]
        ):
            message = (
                f"the scene has no table for {brief(override.key)}; tables of a list "
                "are selected by their name, or by their number counted from 1"
            )
            faults.append(Fault(message, override.source, override.line))
            continue
        for path in paths:
            lines[path] = OverriddenLine.of(line_of(lines, path), override)
    raise_any(faults)
    return merged


def at_its_source(fault: Fault) -> Fault:
    """Fault of an overridden value at the flag or line that asks for the value."""
    if not isinstance(fault.line, OverriddenLine):
        return fault
    override = fault.line.override
    if override.source is None:
        return fault
    where = f" (in {Path(fault.file).name})" if fault.file else ""
    return Fault(f"{fault.message}{where}", override.source, override.line)


def overridden_text(
    data: Mapping[str, Any],
    overrides: Sequence[Override],
    text: str = "",
    elsewhere: Sequence[Override] = (),
) -> str:
    """Write a merged scene as TOML, for the copy in a run directory.

    The first line lists its overrides.

    Comments and order are those of the text of the scene before it was merged; some
    overrides act elsewhere.
    """
    last = {override.key: override for override in overrides}
    labels = (".".join((*last[key].keys[:-1], last[key].label)) for key in sorted(last))
    note = json.dumps(", ".join(labels), ensure_ascii=False)[1:-1].replace("\x7f", "")
    local = [override for override in overrides if override not in elsewhere]
    return f"{NOTE} {note}\n\n{_edited(text, data, local) or toml_text(data)}"


def _edited(text: str, data: Mapping[str, Any], overrides: Sequence[Override]) -> str:
    """Return the text of a scene with overrides in place.

    "" if it does not stand for the merged data.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    try:
        document = tomlkit.parse(text)
        for override in overrides:
            for path in list(paths_of(document, override.keys)):
                _set_value(document, path, override.value)
        edited = tomlkit.dumps(document)
        return edited if tomllib.loads(edited) == data else ""
    except (
        TOMLKitError,
        KeyError,
        TypeError,
        ValueError,
    ):  # it does not edit tables out of order
        return ""


def value_of(text: str, *, as_text: bool = False) -> Any:
    """Read a value from a flag or a cell of a table.

    Parameters
    ----------
    text : str
        What stands there.
    as_text : bool
        Whether the key holds a text, such as a name: 54E1 is no number then.

    Returns
    -------
    object
        A number, true or false; a list, a table or a text in quotes, as TOML has them;
        or else the text. None for an empty text, which removes the key.
    """
    text = text.strip()
    if text.startswith(_QUOTES if as_text else (*_QUOTES, "[", "{")):
        try:
            read = tomllib.loads(f"value = {text}")
        except (tomllib.TOMLDecodeError, RecursionError):
            return text
        return read["value"] if len(read) == 1 else text
    if as_text:
        return text or None
    if re.fullmatch(r"[+-]?\d{1,18}", text):
        return int(text)
    if _NUMBER.fullmatch(text):
        return float(text)
    return {"true": True, "false": False, "": None}.get(text, text)


def paths_of(data: Any, keys: Sequence[str]) -> Iterator[KeyPath]:
    """Paths that a dotted key means in a scene.

    Keys that are not there yet end the search.
    """
    first, *rest = keys
    chosen: Sequence[int]
    if isinstance(data, list) and any(isinstance(item, Mapping) for item in data):
        chosen = range(len(data))
        named = [
            index
            for index, item in enumerate(data)
            if isinstance(item, dict) and item.get("name") == first
        ]
        if first.isdecimal():  # one of the tables, if it has the number
            chosen, keys = (
                chosen[max(int(first) - 1, 0) : int(first)] if rest else range(0),
                rest,
            )
        elif named and rest:
            chosen, keys = named, rest
        for index in chosen:
            yield from ((index, *path) for path in paths_of(data[index], keys))
    elif rest and isinstance(data, Mapping) and first in data:
        yield from ((first, *path) for path in paths_of(data[first], rest))
    else:
        yield tuple(keys)


def _set_value(data: Any, path: KeyPath, value: Any) -> bool:
    """Set or remove one value.

    False where the path leads through a value that is no table.
    """
    for part in path[:-1]:
        if isinstance(data, dict) and value is None and part not in data:
            return True
        if not isinstance(data, list | dict):
            return False
        data = data.setdefault(part, {}) if isinstance(data, dict) else data[int(part)]
    if not isinstance(data, dict):
        return False
    if value is None:
        data.pop(path[-1], None)
    else:
        data[path[-1]] = copy.deepcopy(value)
    return True


def toml_text(data: Mapping[str, Any]) -> str:
    """Write a scene as TOML.

    One key per line, tables behind the keys of the table around them.

    It may hold tables, lists, text, numbers, dates, NumPy arrays and paths; what is
    None is left out.

    Raises
    ------
    SceneError
        For a value of another type.
    """
    return "\n".join(_table_lines(_plain_value(data, ""), ())).lstrip("\n") + "\n"


def toml_value(value: Any) -> str:
    """Write a value, as `tomllib` reads it, as TOML."""
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return (
            "{"
            + ", ".join(
                f"{_name(key)} = {toml_value(item)}" for key, item in value.items()
            )
            + "}"
        )
    return str(value)


def _plain_value(value: Any, key: str) -> Any:
    """Value of a scene in the types of `tomllib`; `key` names it in a fault."""
    if hasattr(value, "tolist"):  # NumPy scalars and arrays
        value = value.tolist()
    if isinstance(value, Mapping):
        return {
            str(name): _plain_value(item, f"{key}.{name}" if key else str(name))
            for name, item in value.items()
            if item is not None
        }
    if isinstance(value, list | tuple):
        return [
            _plain_value(item, f"{key}[{index}]") for index, item in enumerate(value)
        ]
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, str | bool | int | float | date | time):
        return value
    raise SceneError(
        [
            Fault(
                f"{key} is a {type(value).__name__}; give a number, a text, a list or "
                "a dict"
            )
        ]
    )


def _table_lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    inner = {
        key: value
        for key, value in table.items()
        if isinstance(value, Mapping) or _is_tables(value)
    }
    yield from (
        f"{_name(key)} = {toml_value(value)}"
        for key, value in table.items()
        if key not in inner
    )
    for key, value in inner.items():
        name = ".".join(_name(part) for part in (*path, key))
        header = f"[{name}]" if isinstance(value, Mapping) else f"[[{name}]]"
        for item in (value,) if isinstance(value, Mapping) else value:
            yield from ("", header, *_table_lines(item, (*path, key)))


def _is_tables(value: Any) -> bool:
    return (
        isinstance(value, list)
        and bool(value)
        and all(isinstance(item, Mapping) for item in value)
    )


def _name(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else toml_value(key)
