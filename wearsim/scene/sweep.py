"""Scenes of kind "sweep": a base scene and what is varied in it, made into the cases of a design."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Strict

from wearsim.errors import Fault, SceneError
from wearsim.scene.changes import Change, value_of
from wearsim.scene.inputs import find_file
from wearsim.scene.models import Header, SceneModel
from wearsim.scene.section import Section, Text, quantity, words
from wearsim.toml_faults import KeyPath, line_of, shown

MOST_CASES = 100_000
DESIGNS = ("full_factorial", "list", "latin_hypercube")
DIGITS = 6
"""Significant digits of values drawn from a range: enough for any input, and legible in tables."""


class SweepHeader(Header):
    """[scene] of a sweep."""

    kind: Literal["sweep"] = Field(description="what the scene describes")


class CasesSection(Section):
    """[sweep]: the base scene and the design of the cases."""

    base: Text | None = words("the scene that is varied: a rig, a field or a comparison", None)
    scenes: Annotated[tuple[Text, ...], Strict(False)] = Field(
        (), max_length=1000, description="several scenes in place of base, each with every case of the design"
    )
    design: Literal["full_factorial", "list", "latin_hypercube"] = Field(
        "full_factorial",
        description="every value with every other, the first values of all keys, then the second, or drawn "
        "from ranges",
    )
    cases: int | None = quantity("the number of cases of a latin_hypercube", "", None, ge=1, le=MOST_CASES)
    seed: int | None = quantity("the seed of a latin_hypercube", "", None, ge=0, le=2**32 - 1)
    table: Text | None = words("a CSV file of cases, with columns named as keys are", None)
    vary: dict[str, Any] = Field(
        {}, description="the keys that are varied, each with the list of its values, or its range"
    )


class SweepScene(SceneModel):
    """Many campaigns."""

    scene: SweepHeader
    sweep: CasesSection


@dataclass(frozen=True)
class Case:
    """One campaign, or comparison, of a sweep.

    Parameters
    ----------
    number : int
        Counted from 1.
    base : Path
        The scene file it is made from.
    changes : tuple of Change
        What it sets in it.
    """

    number: int
    base: Path
    changes: tuple[Change, ...]

    @property
    def name(self) -> str:
        """Name of its run directory."""
        return f"case_{self.number:04d}"

    @property
    def label(self) -> str:
        """What makes it differ from the others."""
        return ", ".join(change.label for change in self.changes) or self.base.name


@dataclass(frozen=True)
class Varied:
    """One key and the values a sweep gives it.

    Parameters
    ----------
    key : str
        Dotted key.
    values : sequence
        As in TOML.
    file : str, optional
        Where it stands.
    line : int, optional
        Its line there.
    """

    key: str
    values: Sequence[Any]
    file: str | None = None
    line: int | None = None

    def change(self, value: Any) -> Change:
        """Return the change to one of the values."""
        return Change(self.key, value, self.file, self.line)


@dataclass(frozen=True)
class Sweep:
    """The cases of a sweep, not yet checked as scenes.

    Parameters
    ----------
    title : str
        For tables.
    file : str
        What the user named.
    cases : tuple of Case
        Numbered from 1.
    """

    title: str
    file: str
    cases: tuple[Case, ...]


def read_sweep(scene: SweepScene) -> tuple[Sweep | None, list[Fault]]:
    """Make the cases of a sweep file.

    Parameters
    ----------
    scene : SweepScene
        As it was read.

    Returns
    -------
    tuple of Sweep or None, list of Fault
        None if there are faults.
    """
    section, origin = scene.sweep, scene.origin
    file, folder = str(origin.path), origin.path.parent
    faults: list[Fault] = []

    def fault(told: str, *keys: str) -> None:
        faults.append(Fault(told, file, scene.line("sweep", *keys)))

    if (section.base is None) == (not section.scenes):
        fault("give either base, one scene, or scenes, a list of them", "base")
    names = [section.base] if section.base is not None else list(section.scenes)
    key = "base" if section.base is not None else "scenes"
    bases = [find_file(name, (folder,), "workflows") for name in names]
    for name, base in zip(names, bases, strict=True):
        if base is None:
            fault(
                f"{key} = {shown(name)} does not exist as given, beside the sweep or among the workflows",
                key,
            )
    varied = []
    for path, values in _leaves(section.vary):
        line = line_of(origin.lines, ("sweep", "vary", *path))
        if not isinstance(values, list) or not values:
            told = f"{path[-1]} = {shown(values)} must be a list of values; write [{shown(values)}]"
            faults.append(Fault(told, file, line))
        elif any(isinstance(value, Mapping) for value in values):
            faults.append(Fault(f"{path[-1]} = {shown(values)}: vary keys, not tables", file, line))
        else:
            varied.append(Varied(".".join(str(part) for part in path), values, file, line))
    if section.table is not None and section.vary:
        fault("give either table, a CSV file of cases, or [sweep.vary]", "table")
    hypercube = section.design == "latin_hypercube"
    for name, value in (("cases", section.cases), ("seed", section.seed)):
        if hypercube and value is None:
            fault(f'design = "latin_hypercube" needs {name}; give {name} in [sweep]', "design")
        if not hypercube and value is not None:
            fault(f'{name} belongs to design = "latin_hypercube"; delete {name}, or change design', name)
    if section.table is not None and "design" in section.model_fields_set:
        fault("design belongs to [sweep.vary]; a table lists its cases itself", "design")
    rows: list[tuple[Change, ...]] = []
    if not faults and section.table is not None:
        table = find_file(section.table, (folder,), "workflows")
        if table is None:
            fault(f"table = {shown(section.table)} does not exist as given or beside the sweep", "table")
        else:
            rows, told_of_table = table_rows(table)
            faults += told_of_table
    elif not faults:
        rows, told_of_design = design_rows(varied, section.design, section.cases or 0, section.seed or 0)
        faults += told_of_design
    if len(rows) * len(bases) > MOST_CASES:
        fault(f"{len(rows) * len(bases)} cases are too many; at most {MOST_CASES}")
    if faults:
        return None, sorted(faults, key=lambda fault: (fault.file != file, fault.line or 0))
    pairs = itertools.product([base for base in bases if base is not None], rows)
    cases = tuple(Case(number, base, row) for number, (base, row) in enumerate(pairs, 1))
    return Sweep(scene.scene.title or origin.path.stem, file, cases), []


def sweep_of_flags(scene: str, vary: Sequence[str], table: str | None) -> Sweep:
    """Make the cases of a sweep of one scene from the flags of the command line.

    Parameters
    ----------
    scene : str
        Scene file of a rig, a field or a comparison.
    vary : sequence of str
        Each "KEY=VALUE,VALUE,..."; every value with every other.
    table : str, optional
        CSV file of cases, in place of `vary`.

    Raises
    ------
    SceneError
        With all faults.
    """
    base = find_file(scene, (), "workflows")
    faults = [] if base else [Fault("the scene file does not exist", scene)]
    if bool(vary) == (table is not None):
        told = "tell what to vary, by --vary KEY=VALUE,VALUE or by --table CSV, or give a sweep file"
        faults.append(Fault(told, scene))
    rows: list[tuple[Change, ...]] = []
    if table is not None and not vary:
        rows, found = table_rows(Path(table))
        faults += found
    elif vary:
        varied = []
        for flag in vary:
            key, sign, values = flag.partition("=")
            if not sign or not values.strip() or not key.strip():
                faults.append(
                    Fault(f"--vary {flag}: must be KEY=VALUE,VALUE,... such as wear.form=local,patch_mean")
                )
            else:
                values_of_key = [value_of(value) for value in next(csv.reader([values]))]
                varied.append(Varied(key.strip(), values_of_key, f"--vary {flag}"))
        rows, found = design_rows(varied, "full_factorial")
        faults += found
    if faults or base is None:
        raise SceneError(faults)
    cases = tuple(Case(number, base, row) for number, row in enumerate(rows, 1))
    return Sweep(base.stem, str(base), cases)


def design_rows(
    varied: Sequence[Varied], design: str, cases: int = 0, seed: int = 0
) -> tuple[list[tuple[Change, ...]], list[Fault]]:
    """Combine the values of all keys.

    Parameters
    ----------
    varied : sequence of Varied
        Keys with their values; the last one changes fastest.
    design : {"full_factorial", "list", "latin_hypercube"}
        How.
    cases, seed : int
        Of a latin_hypercube, whose values are the two ends of each range.

    Returns
    -------
    tuple of list of tuple of Change, list of Fault
        One entry per case; without any key one case, the base itself.

    Notes
    -----
    The Latin hypercube draws one value from each of `cases` equal parts of every range, in random order.
    """
    faults: list[Fault] = []
    keys = [item.key for item in varied]
    for item in varied:
        if keys.count(item.key) > 1 and keys.index(item.key) == varied.index(item):
            faults.append(
                Fault(f"{item.key} is varied twice; give all its values in one place", item.file, item.line)
            )
    if design == "latin_hypercube":
        for item in varied:
            numbers = [v for v in item.values if isinstance(v, int | float) and not isinstance(v, bool)]
            if len(numbers) != len(item.values) or len(numbers) != 2 or not numbers[0] < numbers[1]:
                given = shown(list(item.values))
                told = f"{item.key} = {given} must be a range [lowest, highest] for a latin_hypercube"
                faults.append(Fault(told, item.file, item.line))
        if faults:
            return [], faults
        random = np.random.default_rng(seed)
        columns = []
        for item in varied:
            low, high = (float(value) for value in item.values)
            part = (random.permutation(cases) + random.random(cases)) / cases
            drawn = [float(f"{low + (high - low) * share:.{DIGITS}g}") for share in part]
            columns.append([item.change(min(max(value, low), high)) for value in drawn])
        return list(zip(*columns, strict=True)) if columns else [()], []
    if design == "list":
        length = max((len(item.values) for item in varied), default=0)
        for item in varied:
            if len(item.values) != length:
                count = len(item.values)
                told = f"{item.key} has {count} values, another key {length}; a list needs as many for each"
                faults.append(Fault(told, item.file, item.line))
        if faults:
            return [], faults
        columns = [[item.change(value) for value in item.values] for item in varied]
        return list(zip(*columns, strict=True)) if columns else [()], []
    if np.prod([len(item.values) for item in varied], dtype=float) > MOST_CASES:
        place = (varied[0].file, varied[0].line)
        return [], [Fault(f"more than {MOST_CASES} cases; give fewer values, or a latin_hypercube", *place)]
    return list(itertools.product(*([item.change(v) for v in item.values] for item in varied))), faults


def table_rows(path: Path) -> tuple[list[tuple[Change, ...]], list[Fault]]:
    """Read cases from a CSV file.

    Parameters
    ----------
    path : Path
        First line: dotted keys. Each further line is a case; an empty cell keeps the base's value, lines
        that start with # do not count.

    Returns
    -------
    tuple of list of tuple of Change, list of Fault
        One entry per case.
    """
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        return [], [Fault(f"cannot be read ({error.strerror}); give a CSV file of cases", file)]
    except UnicodeDecodeError:
        return [], [Fault("not UTF-8 text; save the table as UTF-8", file)]
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    rows = [(number, next(csv.reader([line]))) for number, line in lines]
    if len(rows) < 2:
        return [], [
            Fault("no cases; give a line of keys such as wheelset.radius_mm, and a line per case", file)
        ]
    (top, header), body = rows[0], rows[1:]
    keys = [key.strip() for key in header]
    faults = []
    for key in keys:
        if "." not in key:
            told = f"column {shown(key)} must be named section.key, such as wheelset.radius_mm"
            faults.append(Fault(told, file, top))
    if len(set(keys)) < len(keys):
        faults.append(Fault("two columns have the same key; delete one", file, top))
    cases = []
    for number, cells in body:
        if len(cells) != len(keys):
            faults.append(
                Fault(f"{len(cells)} cells where the first line has {len(keys)} keys", file, number)
            )
            continue
        pairs = zip(keys, cells, strict=True)
        cases.append(tuple(Change(k, value_of(cell), file, number) for k, cell in pairs if cell.strip()))
    return cases, faults


def _leaves(vary: Mapping[str, Any], path: KeyPath = ()) -> list[tuple[KeyPath, Any]]:
    """Keys of nested tables with their values; quoted keys with dots mean the same."""
    found: list[tuple[KeyPath, Any]] = []
    for key, value in vary.items():
        if isinstance(value, Mapping) and value:
            found += _leaves(value, (*path, key))
        else:
            found.append(((*path, key), value))
    return found
