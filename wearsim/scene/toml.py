"""A scene in Python written as TOML, so that a run directory keeps it like a scene file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from datetime import date, time
from pathlib import PurePath
from typing import Any

from wearsim.errors import Fault, SceneError


def toml_text(data: Mapping[str, Any]) -> str:
    """Write a scene as TOML.

    Parameters
    ----------
    data : mapping
        Tables, lists, text, numbers, dates, NumPy arrays and paths; what is None is left out.

    Returns
    -------
    str
        One key per line, tables behind the keys of the table around them.

    Raises
    ------
    SceneError
        For a value of another type.
    """
    return "\n".join(_table_lines(_plain(data, ""), ())).lstrip("\n") + "\n"


def toml_value(value: Any) -> str:
    """Write a value as TOML.

    Parameters
    ----------
    value : str, bool, int, float, list, dict or date
        As `tomllib` reads it.
    """
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_name(key)} = {toml_value(item)}" for key, item in value.items()) + "}"
    return str(value)


def _plain(value: Any, key: str) -> Any:
    """Value of a scene in the types of `tomllib`; `key` names it in a fault."""
    if hasattr(value, "tolist"):  # NumPy scalars and arrays
        value = value.tolist()
    if isinstance(value, Mapping):
        return {
            str(name): _plain(item, f"{key}.{name}" if key else str(name))
            for name, item in value.items()
            if item is not None
        }
    if isinstance(value, list | tuple):
        return [_plain(item, f"{key}[{index}]") for index, item in enumerate(value)]
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, str | bool | int | float | date | time):
        return value
    raise SceneError([Fault(f"{key} is a {type(value).__name__}; give a number, a text, a list or a dict")])


def _table_lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    inner = {key: value for key, value in table.items() if isinstance(value, Mapping) or _is_tables(value)}
    yield from (f"{_name(key)} = {toml_value(value)}" for key, value in table.items() if key not in inner)
    for key, value in inner.items():
        name = ".".join(_name(part) for part in (*path, key))
        header = f"[{name}]" if isinstance(value, Mapping) else f"[[{name}]]"
        for item in (value,) if isinstance(value, Mapping) else value:
            yield from ("", header, *_table_lines(item, (*path, key)))


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _name(key: str) -> str:
    return key if re.fullmatch(r"[\w-]+", key, re.ASCII) else toml_value(key)
