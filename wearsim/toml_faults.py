"""TOML files of users.

Where keys stand, and faults of their models with file, line and fix.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
import types
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

from wearsim.errors import LONGEST_ECHO, Fault, SceneError, brief, shown

if TYPE_CHECKING:
    from tree_sitter import Node

KeyPath = tuple[str | int, ...]
Lines = dict[KeyPath, int]
_Model = TypeVar("_Model", bound=BaseModel)
LARGEST_FILE = 2_000_000
"""Largest file of people's making [B]."""
LARGEST_TABLE = 200_000_000
"""Largest file of samples or operating points [B]."""
DEEPEST = 50
"""Most parts of a key, and tables in tables."""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}")

_OPPOSITES: tuple[set[str], ...] = (
    {"left", "right"},
    {"wheel", "rail", "roller", "counterface"},
    {"rig", "field"},
    {"min", "max"},
    {"mean", "std"},
    {"lower", "upper"},
    {"start", "end"},
    {"normal", "tangential"},
    {"yaw", "roll"},
)
_BOUNDS = (("gt", "above"), ("ge", "at least"), ("lt", "below"), ("le", "at most"))


def key_lines(text: str) -> Lines:
    """Line of every key, table and list element of a TOML text that `tomllib` accepts.

    Lines count from 1; paths are keys as in the parsed data, list elements by index. A
    table stands where its header or its first dotted key does.
    """
    import tree_sitter_toml  # for faults only
    from tree_sitter import Language, Parser

    lines: Lines = {}
    _locate(
        Parser(Language(tree_sitter_toml.language())).parse(text.encode()).root_node,
        (),
        lines,
        {},
    )
    return lines


def _locate(
    node: Node, path: KeyPath, lines: Lines, counts: dict[KeyPath, int]
) -> None:
    """Note the lines of a part of a text, below `path`.

    `counts` are those of arrays of tables so far.
    """
    inner = [child for child in node.named_children if child.type != "comment"]
    if node.type == "array":
        for index, element in enumerate(inner):
            lines[(*path, index)] = element.start_point[0] + 1
            _locate(element, (*path, index), lines, counts)
        return
    if node.type in ("pair", "table", "table_array_element"):
        if (
            node.type == "pair" and len(inner) != 2
        ):  # not understood: its faults get the line of the table
            return
        header, *inner = inner
        line, names = (
            header.start_point[0] + 1,
            _names_in((header.text or b"").decode()),
        )
        for place, name in enumerate(names, 1):
            path = (*path, name)
            lines.setdefault(path, line)
            if node.type == "table_array_element" and place == len(names):
                counts[path] = counts.get(path, 0) + 1
            if (
                path in counts
            ):  # a table below an array of tables belongs to its last element
                path = (*path, counts[path] - 1)
        if node.type != "pair":
            lines[path] = line
    elif node.type not in ("document", "inline_table"):
        return
    for child in inner:
        _locate(child, path, lines, counts)


def _names_in(key: str) -> list[str]:
    """Names in a bare, quoted or dotted key, escapes resolved by the TOML reader."""
    value: Any = tomllib.loads(f"{key} = 0")
    names = []
    while isinstance(value, dict):
        ((name, value),) = value.items()
        names.append(name)
    return names


class Table(BaseModel):
    """A table of a file: immutable, exact types, no unknown keys, no infinities."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        validate_by_alias=True,
        hide_input_in_errors=True,
    )


def cross_check(message: str, key: str = "") -> PydanticCustomError:
    """Error for the validator of a table.

    Message with the fix, and the key it refers to, if it is one.
    """
    return PydanticCustomError(
        "cross_check", "cross-check", {"message": message, "key": key}
    )


def content_of(path: Path, what: str, most: int = LARGEST_FILE) -> bytes:
    """Content of a file of at most `most` bytes.

    A SceneError says that `what` must be given.
    """
    file = str(path)
    try:
        with path.open("rb") as stream:
            content = stream.read(most + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(
            [Fault(f"cannot be read ({reason}); give {what}", file)]
        ) from None
    return of_at_most(content, most, what, file)


def of_at_most(content: bytes, most: int, what: str, file: str) -> bytes:
    """Return content of at most `most` bytes, or raise a SceneError."""
    if len(content) > most:
        raise SceneError(
            [Fault(f"is larger than {most // 1_000_000} MB; give {what}", file)]
        )
    return content


def text_of(content: bytes, file: str) -> str:
    """Text of a file's content with plain ends of lines.

    Or a SceneError at the line that is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = (
            content[: error.start]
            .replace(b"\r\n", b"\n")
            .replace(b"\r", b"\n")
            .count(b"\n")
            + 1
        )
        raise SceneError(
            [Fault("is not UTF-8 text; save it as UTF-8", file, line)]
        ) from None


def toml_of(text: str, file: str) -> dict[str, Any]:
    """Parse TOML, or raise a SceneError with the fault of its syntax."""
    deep, line = "tables or lists are nested too deeply; write flat tables", None
    try:
        if match := _DEEP_KEY.search(text):  # the parser takes the square of its parts
            line = text.count("\n", 0, match.start()) + 1
            raise RecursionError
        data = tomllib.loads(text)
        level: list[Any] = [data]
        for _ in range(DEEPEST):
            values = [
                container.values() if isinstance(container, dict) else container
                for container in level
            ]
            level = [
                item
                for entries in values
                for item in entries
                if isinstance(item, dict | list)
            ]
        if level:
            raise RecursionError
    except ValueError as error:
        raise SceneError([syntax_fault(error, text, file)]) from error
    except RecursionError:
        raise SceneError([Fault(deep, file, line)]) from None
    return data


def read_toml(path: Path, model: type[_Model]) -> tuple[_Model | None, list[Fault]]:
    """Read a TOML file, UTF-8 text up to 2 MB, into a model of it, with tuples.

    Returns
    -------
    data : model or None
        None if there are faults.
    faults : list of Fault
        All of them, with their lines.
    """
    file, text = str(path), ""
    try:
        text = text_of(content_of(path, "another file"), file)
        return model.model_validate(_with_tuples(toml_of(text, file))), []
    except SceneError as error:
        return None, list(error.faults)
    except ValidationError as error:
        return None, validation_faults(error, model, key_lines(text), file)


def _with_tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_tuples(item) for key, item in value.items()}
    return tuple(map(_with_tuples, value)) if isinstance(value, list) else value


def line_of(lines: Lines, path: Sequence[str | int]) -> int:
    """Line of a path, of the nearest table around it, or 1."""
    prefix = tuple(path)
    while prefix and prefix not in lines:
        prefix = prefix[:-1]
    return lines.get(prefix, 1)


def decimal(text: str) -> float:
    """Value of a plain decimal, NaN of anything else.

    Python alone would accept 1_000 and Arabic digits.
    """
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan


def nearest(name: str, names: Sequence[str]) -> str | None:
    """Most similar of `names`, if one is similar enough to be what was meant.

    A name that differs by a word of the opposite meaning is none: better no suggestion
    than a wrong one.
    """
    alike = [
        candidate.lower()
        for candidate in names
        if not _opposite(name.lower(), candidate.lower())
    ]
    matches = difflib.get_close_matches(name.lower(), alike, n=1, cutoff=0.66)
    return next(
        (
            candidate
            for candidate in names
            if matches and candidate.lower() == matches[0]
        ),
        None,
    )


def _opposite(name: str, candidate: str) -> bool:
    """Whether two names hold different words of one group, such as left and right."""
    first, second = set(name.split("_")), set(candidate.split("_"))
    return any(
        first & group and second & group and not first & second & group
        for group in _OPPOSITES
    )


def suggestion(name: str, names: Sequence[str]) -> str:
    """List of `names`, led by the most similar one, as the fix of a wrong name."""
    near = nearest(name, names)
    listed = ", ".join(map(brief, names))
    return (
        f"did you mean {shown(near)}? (known: {listed})" if near else f"known: {listed}"
    )


def table_name(path: Sequence[str | int]) -> str:
    """Name of a table as its header is written.

    ``[campaign]``, ``[[operation.block]]``.
    """
    names = _dotted(tuple(path))
    if not names:
        return "the file"
    return f"[[{names}]]" if path and isinstance(path[-1], int) else f"[{names}]"


def is_key(model: type[BaseModel], keys: Sequence[str]) -> bool:
    """Whether a dotted key, as an override writes it, exists in a scene."""
    return _field(model, model_path(model, keys)) is not None


def is_text(model: type[BaseModel], keys: Sequence[str]) -> bool:
    """Whether a dotted key, as an override writes it, is in a scene and is text."""
    info = _field(model, model_path(model, keys))
    return info is not None and any(
        _is_text(annotation) for annotation in _types(info.annotation)
    )


def meaning_of(model: type[BaseModel], keys: Sequence[str]) -> str:
    """Meaning of a dotted key of a scene, "" if it has none of its own."""
    path = model_path(model, keys)
    table, info = _field(model, path[:-1]), _field(model, path)
    of_table = table is not None and table is info  # of any names
    return "" if info is None or of_table else info.description or ""


def removed_key(keys: Sequence[str], model: type[BaseModel]) -> str:
    """Message on a dotted key that a table of an earlier version had, else ""."""
    path = model_path(model, keys)
    return _removed(path[:-1], model, str(path[-1]))


def unknown_key(keys: Sequence[str], model: type[BaseModel]) -> str:
    """Message on a dotted key that no table has."""
    path = model_path(model, keys)
    return _unknown(str(path[-1]), path[:-1], model, "")


def model_path(model: type[BaseModel], keys: Sequence[str]) -> KeyPath:
    """Path of a dotted key.

    What selects an entry of a list of tables, its number or its name, becomes 0.
    """
    path: KeyPath = ()
    for key in keys[:-1]:
        table = _field(model, path) if path else None
        inner = None if table is None or isinstance(path[-1], int) else _element(table)
        selects = (
            table is not None
            and _is_list(table)
            and inner is not None
            and key not in _fields(inner)
        )
        path = (*path, 0 if selects else key)
    return (*path, keys[-1])


def syntax_fault(error: ValueError, text: str, file: str) -> Fault:
    """Fault of a text that is no TOML."""
    match = re.search(r"at line (\d+)", str(error))
    what = re.sub(
        rf"[\w.-]{{{LONGEST_ECHO},}}", lambda word: brief(word[0]), str(error)
    )
    line = int(match[1]) if match else max(1, len(text.rstrip().splitlines()))
    if not isinstance(
        error, tomllib.TOMLDecodeError
    ):  # a number that Python does not read
        return Fault(f"not valid TOML: {what}", file)
    return Fault(
        f"not valid TOML: {what}; write one `key = value` per line", file, line
    )


def validation_faults(
    error: ValidationError, model: type[BaseModel], lines: Lines, file: str
) -> list[Fault]:
    """One fault in one line for each error of pydantic when `model` was filled.

    In the order of the file.
    """
    faults = []
    for detail in error.errors(include_url=False):
        # a list may be too short only because entries with faults of their own do not
        # count
        if (
            detail["type"] != "too_short"
            or len(detail["input"]) < detail["ctx"]["min_length"]
        ):
            key = detail.get("ctx", {}).get("key")  # that a cross-check refers to
            line = line_of(lines, (*detail["loc"], key) if key else detail["loc"])
            faults.append(Fault(_message(detail, model), file, line))
    return sorted(faults, key=lambda fault: fault.line or 0)


def _needed(error: ErrorDetails, info: FieldInfo) -> str:
    """State the allowed type and range of a value, "" if they are not its fault."""
    path = error["loc"]
    limits = _limits(info, entry=bool(path) and isinstance(path[-1], int))
    match error["type"]:
        case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
            return limits
        case "string_type" | "string_too_long":
            lengths = (getattr(item, "max_length", None) for item in info.metadata)
            longest = next(filter(None, lengths), None)
            return f"a text of at most {longest} characters" if longest else "a text"
        case "int_type" | "int_from_float":
            return f"a whole number, {limits}"
        case "float_type":
            return f"a number, {limits}"
        case "finite_number":
            return f"a finite number, {limits}"
        case "out_of_range":
            return str(error.get("ctx", {}).get("allowed", ""))
    return ""


def _message(error: ErrorDetails, model: type[BaseModel]) -> str:
    path, kind, value, context = (
        error["loc"],
        error["type"],
        error["input"],
        error.get("ctx", {}),
    )
    label, info = _label(path), _field(model, path) or FieldInfo()
    given = f"{label} = {shown(value)}"
    if removed := _removed(path[:-1], model, given):
        return removed
    if needed := _needed(error, info):
        words = f"{given} must be {needed.rstrip(', ')}"
        return f"{words}; give {info.description}" if info.description else words
    match kind:
        case "cross_check":
            return str(context["message"])
        case "missing" if isinstance(path[-1], int):
            count = len(value) if isinstance(value, tuple) else path[-1]
            return f"{_label(path[:-1])} has {count} entries, needs more"
        case "missing":
            return _missing(path, info)
        case "extra_forbidden":
            return _unknown(str(path[-1]), path[:-1], model, value)
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"{given} must be a table; write its keys below {table_name(path)}"
        case "tuple_type" | "list_type":
            if not isinstance(value, Mapping) and _element(info) is None:
                return f"{given} must be a list, such as [{shown(value)}]"
            table = _dotted(path)
            return f"[{table}] must be a list of tables; write [[{table}]]"
        case "literal_error":
            return f"{given} is not allowed; {suggestion(str(value), _choices(info))}"
        case "unknown_name":
            return f"{given} is not known; {context['hint']}"
        case "too_short":
            least, count = context["min_length"], context["actual_length"]
            return f"{label} has {count} entries, needs at least {least}"
        case "too_long":
            most, count = context["max_length"], context["actual_length"]
            return f"{label} has {count} entries, needs at most {most}"
        case "string_too_short":
            return f"{label} is empty; give {info.description or 'a value'}"
    return f"{given}: {error['msg'][:1].lower()}{error['msg'][1:]}"


def _missing(path: KeyPath, info: FieldInfo) -> str:
    inner = _element(info)
    if inner is None:
        words = (
            f"key {path[-1]} is missing in {table_name(path[:-1])}; give "
            f"{info.description or 'a value'}"
        )
        choices = ", ".join(_choices(info))
        allowed = _limits(info) or (f"one of {choices}" if choices else "")
        return f"{words}, {allowed}" if allowed else words
    required = {
        name: field for name, field in _fields(inner).items() if field.is_required()
    }
    keys = ", ".join(
        f"{name} (a list of tables)" if _is_list(field) else name
        for name, field in required.items()
    )
    if _is_list(info):
        return f"[[{_dotted(path)}]] is missing; give at least one, with {keys}"
    return (
        f"[{_dotted(path)}] is missing; give the table{f' with {keys}' if keys else ''}"
    )


def _unknown(name: str, table: KeyPath, model: type[BaseModel], value: object) -> str:
    table_model = _element(_field(model, table) or FieldInfo()) if table else model
    what = f"unknown key {_key(name)} in {table_name(table)}"
    tables = value if isinstance(value, list) else [value]
    if not table and all(isinstance(entry, Mapping) for entry in tables):
        what = f"unknown section [{_key(name)}]"
    if table_model is None:
        return what
    if removed := _removed(table, model, name):
        return removed
    if hint := getattr(table_model, "not_here", {}).get(name):
        return f"{what}: {hint}"
    homes = [
        table_name(path)
        for path, candidate in _tables(model)
        if name in _fields(candidate)
    ]
    if homes:
        return f"{what}; it belongs to {' or '.join(homes)}"
    near = nearest(name, list(_fields(table_model)))
    return (
        f"{what}; did you mean {near}?"
        if near
        else f"{what}; known: {', '.join(_fields(table_model))}"
    )


def _removed(table: KeyPath, model: type[BaseModel], given: str) -> str:
    """Message on a key or its value that an earlier version had, else ""."""
    table_model = _element(_field(model, table) or FieldInfo()) if table else model
    message: str = getattr(table_model, "removed", {}).get(given, "")
    return message


def _key(name: str) -> str:
    return name if re.fullmatch(rf"[\w-]{{1,{LONGEST_ECHO}}}", name) else shown(name)


def _dotted(path: KeyPath) -> str:
    return ".".join(_key(item) for item in path if isinstance(item, str))


def _label(path: KeyPath) -> str:
    """Key as the user knows it: its name, with the index for an entry of a list."""
    if not path:
        return "the file"
    if isinstance(path[-1], int):
        return f"{_label(path[:-1])}[{path[-1]}]"
    return _key(path[-1])


def _limits(info: FieldInfo, *, entry: bool = False) -> str:
    """Limits in words, as pydantic checks them, of a key or of entries of its list."""
    metadata = info.metadata
    if entry:
        fields = get_args(_entry(info.annotation))[1:]
        metadata = [item for field in fields for item in getattr(field, "metadata", [])]
    limits = [
        f"{word} {limit:.10g}"
        for item in metadata
        for name, word in _BOUNDS
        if (limit := getattr(item, name, None)) is not None
    ]
    extra = info.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    return f"{' and '.join(limits) or ('in' if unit else '')} {unit}".strip()


def _entry(annotation: Any) -> Any:
    """Annotation of the entries of a list, which may be optional."""
    if get_origin(annotation) is tuple:
        return get_args(annotation)[0]
    return next(
        (entry for item in get_args(annotation) if (entry := _entry(item)) is not None),
        None,
    )


def _types(annotation: Any) -> Iterator[Any]:
    """Types in an annotation.

    Itself, those that may stand in its place, and of the entries of a list.
    """
    yield annotation
    if get_origin(annotation) in (tuple, Union, types.UnionType):
        for item in get_args(annotation):
            yield from _types(item)


def _is_text(annotation: Any) -> bool:
    """Whether an annotation, without those in its place, is that of a text."""
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is Literal:
        return all(isinstance(choice, str) for choice in get_args(annotation))
    return annotation is str


def _choices(info: FieldInfo) -> list[str]:
    literals = (
        annotation
        for annotation in _types(info.annotation)
        if get_origin(annotation) is Literal
    )
    return [str(choice) for literal in literals for choice in get_args(literal)]


def _element(info: FieldInfo) -> type[BaseModel] | None:
    """Return the table model of a key: itself, optional, or the entries of a list."""
    tables = (
        annotation
        for annotation in _types(info.annotation)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel)
    )
    return next(tables, None)


def _is_list(info: FieldInfo) -> bool:
    return get_origin(info.annotation) is tuple


def _is_open(info: FieldInfo) -> bool:
    """Return True for a table of values by any name."""
    return any(get_origin(annotation) is dict for annotation in _types(info.annotation))


def _fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Fields of a table by the name of their key."""
    return {info.alias or name: info for name, info in model.model_fields.items()}


def _field(model: type[BaseModel], path: Sequence[str | int]) -> FieldInfo | None:
    table_model: type[BaseModel] | None = model
    info: FieldInfo | None = None
    for item in path:
        if info is not None and table_model is None and _is_open(info):
            continue  # any name in it is a key
        if isinstance(item, str):  # an entry has the meaning and limits of its list
            info = None if table_model is None else _fields(table_model).get(item)
            table_model = None if info is None else _element(info)
    return info


def _tables(
    model: type[BaseModel], path: KeyPath = ()
) -> Iterator[tuple[KeyPath, type[BaseModel]]]:
    for name, info in _fields(model).items():
        if (inner := _element(info)) is not None:
            inner_path: KeyPath = (*path, name)
            yield (*inner_path, 0) if _is_list(info) else inner_path, inner
            yield from _tables(inner, inner_path)
