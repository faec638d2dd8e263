"""The JSON schema of scene files.

Also the reference of every key with unit, range, default and meaning.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from wearsim.scene.read import MODELS
from wearsim.texts import written

_PLAIN = {
    "string": "text",
    "boolean": "true or false",
    "object": "table",
    "null": "",
    "number": "number",
    "integer": "whole number",
}


def scene_schema() -> dict[str, Any]:
    """JSON schema of the scene file, draft 2020-12, for editors.

    The kind in [scene] selects the model by if and then: an editor shows the faults of
    that kind only.
    """
    mode: JsonSchemaMode = "validation"
    models: list[tuple[type[BaseModel], JsonSchemaMode]] = [
        (model, mode) for model in MODELS.values()
    ]
    definitions = models_json_schema(models, by_alias=True)[1]["$defs"]

    def of_kind(kind: dict[str, Any]) -> dict[str, Any]:
        scene = {"type": "object", "properties": {"kind": kind}, "required": ["kind"]}
        return {"type": "object", "properties": {"scene": scene}, "required": ["scene"]}

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scene file",
        **of_kind({"enum": list(MODELS)}),
        "allOf": [
            {
                "if": of_kind({"const": kind}),
                "then": {"$ref": f"#/$defs/{model.__name__}"},
            }
            for kind, model in MODELS.items()
        ],
        "$defs": definitions,
    }


@dataclass
class _Table:
    """A table of scene files: rows and texts with the kinds of scene that have them."""

    required: bool = False
    kinds: list[str] = field(default_factory=list)
    texts: dict[str, list[str]] = field(default_factory=dict)
    rows: dict[tuple[str, ...], list[str]] = field(default_factory=dict)


def scene_reference() -> str:
    """Markdown of every table and key of rig, field, compare and sweep scenes.

    In the order of the models.
    """
    schema = scene_schema()
    parts, tables = schema["$defs"], dict[str, _Table]()
    for branch in schema["allOf"]:
        kind = branch["if"]["properties"]["scene"]["properties"]["kind"]["const"]
        scene = _definition(parts, branch["then"])
        for key, value in scene["properties"].items():
            for part in _tables(parts, value):
                _collect(parts, part, key, key in scene["required"], kind, tables)
    return written("wearsim.scene", "reference.md.j2", tables=tables) + "\n"


def _definition(parts: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    return parts[schema["$ref"].rsplit("/", 1)[1]]


def _tables(parts: dict[str, Any], schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Tables that a key may hold, by itself, in place of other values or in a list."""
    if "$ref" in schema:
        yield _definition(parts, schema)
    for inner in (*schema.get("anyOf", ()), *filter(None, [schema.get("items")])):
        for part in _tables(parts, inner):
            yield {**part, "repeated": "items" in schema or part.get("repeated")}


def _collect(
    parts: dict[str, Any],
    part: dict[str, Any],
    path: str,
    required: bool,
    kind: str,
    tables: dict[str, _Table],
) -> None:
    """Add a table, and those in it, as a kind of scene has it."""
    table = tables.setdefault(
        f"[[{path}]]" if part.get("repeated") else f"[{path}]", _Table()
    )
    table.required |= required
    table.kinds.append(kind)
    text = re.sub(r"^\[.*?\]+:? *", "", " ".join(part["description"].split()))
    table.texts.setdefault(text, []).append(kind)
    for key, value in part["properties"].items():
        values, needed = _values(value), key in part.get("required", ())
        if values in ("table", "list: table") and any(_tables(parts, value)):
            continue  # which have rows below
        written = json.dumps(value.get("default"), ensure_ascii=False)
        default = "required" if needed else "–" if written == "null" else f"`{written}`"
        row = (
            f"`{key}`",
            value.get("unit", ""),
            values,
            default,
            value.get("description", ""),
        )
        table.rows.setdefault(row, []).append(kind)
    for key, value in part["properties"].items():
        for inner in _tables(parts, value):
            _collect(
                parts,
                inner,
                f"{path}.{key}",
                key in part.get("required", ()),
                kind,
                tables,
            )


def _values(schema: dict[str, Any]) -> str:
    """Values that a key takes, in words."""
    if "$ref" in schema:
        return "table"
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(filter(None, map(_values, schema["anyOf"]))))
    if "enum" in schema or "const" in schema:
        return ", ".join(
            f"`{json.dumps(value)}`"
            for value in schema.get("enum", [schema.get("const")])
        )
    kind = schema["type"]
    if kind == "array":
        return f"list: {_values(schema['items'])}"
    low, high = schema.get("minimum"), schema.get("maximum")
    start = "" if low is None else f"{low:.10g}"
    start = (
        f"above {schema['exclusiveMinimum']:.10g}"
        if "exclusiveMinimum" in schema
        else start
    )
    span = f"{start} to {high:.10g}" if high is not None else start
    return f"whole, {span}" if span and kind == "integer" else span or _PLAIN[kind]
