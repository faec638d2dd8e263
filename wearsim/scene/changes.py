"""Values of a scene file replaced in its text: what a sweep varies, the rest stays as it was written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import tree_sitter_toml
from tree_sitter import Language, Node, Parser

from wearsim.errors import Fault
from wearsim.toml_faults import KeyPath, Lines, header_keys, key_lines, line_of, shown

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Change:
    """One value that a case of a sweep sets.

    Parameters
    ----------
    key : str
        Dotted key, such as "wheelset.radius_mm".
    value : object
        As in TOML.
    file : str, optional
        The file that asks for it.
    line : int, optional
        Its line there.
    """

    key: str
    value: Any
    file: str | None = None
    line: int | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """Parts of the key."""
        return tuple(self.key.split("."))

    @property
    def label(self) -> str:
        """Last part of the key, and the value."""
        return f"{self.keys[-1]} = {shown(self.value)}"

    def below(self, keys: Sequence[str]) -> Change:
        """Return the same change of another key."""
        return Change(".".join(keys), self.value, self.file, self.line)


class ChangedLine(int):
    """Line of a key whose value was changed: a fault there is one of the change."""

    change: Change

    def __new__(cls, line: int, change: Change) -> ChangedLine:
        """Make the line with its change."""
        made = super().__new__(cls, line)
        made.change = change
        return made


@dataclass(frozen=True)
class ChangedText:
    """A scene text with its changes.

    Parameters
    ----------
    text : str
        To be read in place of the file.
    lines : dict
        Where keys stand in the file itself; those changed as `ChangedLine`.
    faults : tuple of Fault
        Changes that could not be made.
    """

    text: str
    lines: Lines
    faults: tuple[Fault, ...]


def changed_text(text: str, changes: Sequence[Change]) -> ChangedText:
    """Make changes in the text of a scene file.

    Parameters
    ----------
    text : str
        A text that `tomllib` accepts.
    changes : sequence of Change
        Later ones win.

    Returns
    -------
    ChangedText
        Comments and all other values stay; a key that is not there yet is added to its table.

    Notes
    -----
    In a list of tables, a number counted from 1 names one of them (`operation.block.2.friction`), a key
    without one means all of them (`operation.block.friction`).
    """
    text = text if text.endswith("\n") else text + "\n"
    lines = key_lines(text)
    faults: list[Fault] = []
    data = tomllib.loads(text)
    for change in changes:
        paths = list(_paths(data, change.keys))
        if not paths:
            told = f"{change.label}: there is no {change.key} in the base scene; count its tables from 1"
            faults.append(Fault(told, change.file, change.line))
        for path in paths:
            made = _set(text, path, change.value)
            if made is None:
                told = (
                    f"{change.label}: {change.key} cannot be set in the base scene as it is written; "
                    f"write the key there, in a table of its own"
                )
                faults.append(Fault(told, change.file, change.line))
                break
            text = made
            lines[path] = ChangedLine(line_of(lines, path), change)
    return ChangedText(text, lines, tuple(faults))


def toml_value(value: Any) -> str:
    """Write a value as TOML.

    Parameters
    ----------
    value : str, bool, int, float or list
        As `tomllib` gives it.
    """
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(value)


def value_of(text: str) -> Any:
    """Read a value from a flag or a cell of a table: a number, true, false, or else a text.

    Parameters
    ----------
    text : str
        Without quotes.
    """
    text = text.strip()
    if re.fullmatch(r"[+-]?\d{1,18}", text):
        return int(text)
    if _NUMBER.fullmatch(text):
        return float(text)
    return {"true": True, "false": False}.get(text, text)


def _paths(data: Any, keys: Sequence[str]) -> Iterator[KeyPath]:
    """Paths that a dotted key means in a scene; keys that are not there yet end the search."""
    if isinstance(data, list) and any(isinstance(item, Mapping) for item in data):
        if keys[0].isdecimal():
            if 1 <= int(keys[0]) <= len(data) and len(keys) > 1:
                index = int(keys[0]) - 1
                yield from ((index, *rest) for rest in _paths(data[index], keys[1:]))
            return
        for index, item in enumerate(data):
            yield from ((index, *rest) for rest in _paths(item, keys))
    elif len(keys) > 1 and isinstance(data, Mapping) and keys[0] in data:
        yield from ((keys[0], *rest) for rest in _paths(data[keys[0]], keys[1:]))
    else:
        yield tuple(keys)


def _set(text: str, path: KeyPath, value: Any) -> str | None:
    """Text with one value replaced or added; None if the text cannot take it."""
    content = text.encode()
    values, headers = _places(content)
    written = toml_value(value)
    names = [item for item in path if isinstance(item, str)]
    key = names[-1] if re.fullmatch(r"[\w-]+", names[-1], re.ASCII) else json.dumps(names[-1])
    if path in values:
        start, end = values[path]
    elif path[:-1] in headers:
        start = end = content.index(b"\n", headers[path[:-1]]) + 1
        written = f"{key} = {written}\n"
    else:
        start = end = len(content)
        table = ".".join(
            name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name) for name in names[:-1]
        )
        written = f"\n[{table}]\n{key} = {written}\n" if table else ""
    made = (content[:start] + written.encode() + content[end:]).decode()
    try:
        found: Any = tomllib.loads(made)
        for item in path:
            found = found[item]
    except (ValueError, LookupError, TypeError):
        return None
    return made if found == value or value != value else None


def _places(content: bytes) -> tuple[dict[KeyPath, tuple[int, int]], dict[KeyPath, int]]:
    """Bytes from and to which each value stands, and the end of each table's header."""
    values: dict[KeyPath, tuple[int, int]] = {}
    headers: dict[KeyPath, int] = {}
    counts: dict[KeyPath, int] = {}
    root = Parser(Language(tree_sitter_toml.language())).parse(content).root_node
    for node in root.named_children:
        if node.type == "pair":
            _place_pair(node, (), values)
        elif node.type in ("table", "table_array_element"):
            header = next(child for child in node.named_children if child.type.endswith("key"))
            path: KeyPath = ()
            names = header_keys(header)
            for name in names[:-1]:
                path = (*path, name)
                if path in counts:
                    path = (*path, counts[path] - 1)
            path = (*path, names[-1])
            if node.type == "table_array_element":
                counts[path] = counts.get(path, 0) + 1
                path = (*path, counts[path] - 1)
            headers[path] = header.end_byte
            for child in node.named_children:
                if child.type == "pair":
                    _place_pair(child, path, values)
    return values, headers


def _place_pair(pair: Node, table: KeyPath, values: dict[KeyPath, tuple[int, int]]) -> None:
    parts = [child for child in pair.named_children if child.type != "comment"]
    if len(parts) == 2:
        _place_value(parts[1], (*table, *header_keys(parts[0])), values)


def _place_value(value: Node, path: KeyPath, values: dict[KeyPath, tuple[int, int]]) -> None:
    values[path] = (value.start_byte, value.end_byte)
    if value.type == "inline_table":
        for child in value.named_children:
            if child.type == "pair":
                _place_pair(child, path, values)
    elif value.type == "array":
        for index, element in enumerate(item for item in value.named_children if item.type != "comment"):
            _place_value(element, (*path, index), values)
