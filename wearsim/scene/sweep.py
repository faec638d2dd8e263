"""Scenes of kind "sweep".

A base scene and what is varied in it, made into the cases of a design.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from wearsim.csv_tables import csv_table, unit_faults
from wearsim.errors import Fault, SceneError, brief, shown
from wearsim.quantities import QUANTITIES
from wearsim.scene.models import (
    CompareScene,
    FieldScene,
    Header,
    RigScene,
    SceneModel,
    find_file,
)
from wearsim.scene.overrides import Override, value_of
from wearsim.scene.section import Section, Text, text_field
from wearsim.toml_faults import KeyPath, content_of, is_text

MOST_CASES = int(QUANTITIES["sweep_cases"].range.high)


class SweepHeader(Header):
    """[scene] of a sweep."""

    kind: Literal["sweep"] = Field(description="what the scene describes")


class CasesSection(Section):
    """[sweep]: the base scene and its cases, every value of a key with every other, or
    those of a table.
    """

    base: Text | None = text_field(
        "the scene that is varied: a rig, a field or a comparison", None
    )
    scenes: tuple[Text, ...] = Field(
        (),
        description="several scenes in place of base, each with every case",
        max_length=1000,
        strict=False,
    )
    table: Text | None = text_field(
        "a CSV file of cases, with columns named as keys are", None
    )
    vary: dict[str, Any] = Field(
        {}, description="the keys that are varied, each with the list of its values"
    )


class SweepScene(SceneModel):
    """Many campaigns."""

    scene: SweepHeader
    sweep: CasesSection


Row = tuple[Override, ...]
"""What one case overrides in its base scene."""


@dataclass(frozen=True)
class Case:
    """Case of a sweep: a campaign or a comparison.

    Number from 1, its scene file, and what it sets in it.
    """

    number: int
    base: Path
    overrides: Row = ()

    @property
    def name(self) -> str:
        """Name of its run directory."""
        return f"case_{self.number:04d}"

    @property
    def label(self) -> str:
        """Text on the difference from the other cases."""
        return (
            ", ".join(override.label for override in self.overrides) or self.base.name
        )


@dataclass(frozen=True)
class Sweep:
    """The cases of a sweep, not yet checked as scenes.

    Its title for tables, and the file the user named.
    """

    title: str
    file: str
    cases: tuple[Case, ...]


def override_of(key: str, text: str, source: str, line: int | None = None) -> Override:
    """Override as a flag or a cell of a table writes it."""
    keys = key.split(".")
    of_scene = keys[1:] if keys[0] in ("rig", "field") and len(keys) > 1 else keys
    as_text = any(
        is_text(model, of_scene)
        for model in (RigScene, FieldScene, CompareScene, SweepScene)
    )
    return Override(key, value_of(text, as_text=as_text), source, line)


def _variation_fault(leaf: KeyPath, values: Any) -> str:
    given = f"{brief(str(leaf[-1]))} = {shown(values)}"
    if not isinstance(values, list) or not values:
        return f"{given} must be a list of values; write [{shown(values)}]"
    if any(isinstance(value, Mapping) for value in values):
        return f"{given}: vary keys, not tables"
    return ""


def read_sweep(scene: SweepScene) -> Sweep:
    """Make the cases of a sweep file, or raise a SceneError with all faults."""
    section, origin, faults = scene.sweep, scene.origin, list[Fault]()
    places = "as given, next to the sweep file or among the workflows"

    def fault(key: KeyPath, message: str) -> None:
        faults.append(scene.fault(("sweep", *key), message))

    def file_of(key: str, name: str, places: str) -> Path | None:
        path = find_file(name, (origin.path.parent,), "workflows")
        if path is None:
            fault((key,), f"{key} = {shown(name)} does not exist {places}")
        return path

    if (section.base is None) == (not section.scenes):
        fault(("base",), "give either base, one scene, or scenes, a list of them")
    if section.table is not None and section.vary:
        fault(("table",), "give either table, a CSV file of cases, or [sweep.vary]")
    named = (
        [("scenes", name) for name in section.scenes]
        if section.base is None
        else [("base", section.base)]
    )
    bases = [
        path for key, name in named if (path := file_of(key, name, places)) is not None
    ]
    varied = []
    for leaf, values in _nested_values(section.vary):
        if message := _variation_fault(leaf, values):
            fault(("vary", *leaf), message)
            continue
        key, line = ".".join(map(str, leaf)), scene.line("sweep", "vary", *leaf)
        file = str(origin.path)
        varied.append([Override(key, value, file, line) for value in values])
    rows: list[Row] = []
    if not faults and section.table is not None:
        table = file_of("table", section.table, "as given or next to the sweep file")
        rows = _table_rows(table, faults) if table is not None else []
    elif not faults:
        rows = _every_row(varied, faults)
    if len(rows) * len(bases) > MOST_CASES:
        fault(
            ("vary",),
            f"{len(rows) * len(bases)} cases are too many; at most {MOST_CASES}",
        )
    if faults:
        raise SceneError(
            sorted(
                faults,
                key=lambda fault: (fault.file != str(origin.path), fault.line or 0),
            )
        )
    return Sweep(
        scene.scene.title or origin.path.stem, str(origin.path), _cases(bases, rows)
    )


def sweep_of_flags(scene: str, vary: Sequence[str], table: str | None) -> Sweep:
    """Make the cases of a sweep of one scene from the flags of the command line.

    Or raise all faults.

    Each of `vary` is "KEY=VALUE,VALUE,...": every value with every other, an empty one
    removes the key; `table` is a CSV file of cases in place of it.
    """
    base = find_file(scene, (), "workflows")
    faults = [] if base else [Fault("the scene file does not exist", scene)]
    rows: list[Row] = []
    varied = []
    for flag in vary:
        key, _, values = (part.strip() for part in flag.partition("="))
        if values and key:
            texts = next(csv.reader([values]))
            varied.append([override_of(key, text, f"--vary {flag}") for text in texts])
        else:
            message = "must be KEY=VALUE,VALUE,... such as wear.form=local,patch_mean"
            faults.append(Fault(message, f"--vary {flag}"))
    if bool(vary) == (table is not None):
        message = (
            "say what to vary, by --vary KEY=VALUE,VALUE or by --table CSV, or give a "
            "sweep file"
        )
        faults.append(Fault(message, scene))
    else:
        rows = (
            _every_row(varied, faults)
            if table is None
            else _table_rows(Path(table), faults)
        )
    if faults or base is None:
        raise SceneError(faults)
    return Sweep(base.stem, str(base), _cases([base], rows))


def _every_row(varied: Sequence[Sequence[Override]], faults: list[Fault]) -> list[Row]:
    """Combine every value of each key with every other, the last key changing fastest.

    Note what forbids it.

    Without any key there is one case, the base itself.
    """
    keys = [item[0].key for item in varied]
    before = len(faults)
    for index, item in enumerate(varied):
        if keys[index] in keys[index + 1 :]:
            text = f"{keys[index]} is varied twice; give all its values in one place"
            faults.append(Fault(text, item[0].source, item[0].line))
    if math.prod(map(len, varied)) > MOST_CASES:
        text = f"more than {MOST_CASES} cases; give fewer values"
        faults.append(Fault(text, varied[0][0].source, varied[0][0].line))
    return list(itertools.product(*varied)) if len(faults) == before else []


def _table_rows(path: Path, faults: list[Fault]) -> list[Row]:
    """Read cases from a CSV file; its faults are appended to `faults`.

    First line: dotted keys. Each further line is a case; an empty cell keeps the base's
    value, lines that start with # do not count.
    """
    file = str(path)
    try:
        content = content_of(path, "a CSV file of cases")
    except SceneError as error:
        faults += error.faults
        return []
    table = csv_table(content, file, empty=True)
    faults += table.faults
    faults += unit_faults(table, file, {name: name for name in table.header})
    if not table.rows and not table.faults:
        message = (
            "no cases; give a line of keys such as wheelset.radius_mm, and a line per "
            "case"
        )
        faults.append(Fault(message, file))
    for key in table.header:
        if "." not in key:
            message = (
                f"column {shown(key)} must be named section.key, such as "
                "wheelset.radius_mm"
            )
            faults.append(Fault(message, file, table.line))
    rows = [(line, zip(table.header, cells, strict=True)) for line, cells in table.rows]
    return [
        tuple(override_of(key, cell, file, line) for key, cell in pairs if cell)
        for line, pairs in rows
    ]


def _cases(bases: Sequence[Path], rows: Sequence[Row]) -> tuple[Case, ...]:
    pairs = itertools.product(bases, rows)
    return tuple(Case(k, base, row) for k, (base, row) in enumerate(pairs, 1))


def _nested_values(
    vary: Mapping[str, Any], path: KeyPath = ()
) -> Iterator[tuple[KeyPath, Any]]:
    """Keys of nested tables with their values; quoted keys with dots mean the same."""
    for key, value in vary.items():
        if isinstance(value, Mapping) and value:
            yield from _nested_values(value, (*path, key))
        else:
            yield (*path, key), value
