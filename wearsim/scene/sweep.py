"""Scenes of kind "sweep": a base scene and what is varied in it, made into the cases of a design."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Strict

from wearsim.errors import Fault, SceneError
from wearsim.quantities import QUANTITIES
from wearsim.scene.models import Header, SceneModel, find_file
from wearsim.scene.overrides import Override, value_of
from wearsim.scene.section import Section, Text, number, words
from wearsim.toml_faults import KeyPath, content_of, shown, text_of

MOST_CASES = int(QUANTITIES["sweep_cases"].range.high)
_DIGITS = 6  # significant ones of values drawn from a range: enough for any input, and legible in tables


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
    cases: int | None = number("sweep_cases", "the number of cases of a latin_hypercube", None)
    seed: int | None = number("sweep_seed", "the seed of a latin_hypercube", None)
    table: Text | None = words("a CSV file of cases, with columns named as keys are", None)
    vary: dict[str, Any] = Field(
        {}, description="the keys that are varied, each with the list of its values, or its range"
    )


class SweepScene(SceneModel):
    """Many campaigns."""

    scene: SweepHeader
    sweep: CasesSection


Row = tuple[Override, ...]
"""What one case overrides in its base scene."""


@dataclass(frozen=True)
class Case:
    """One campaign, or comparison, of many: number from 1, its scene file, and what it sets in it."""

    number: int
    base: Path
    overrides: Row = ()

    @property
    def name(self) -> str:
        """Name of its run directory."""
        return f"case_{self.number:04d}"

    @property
    def label(self) -> str:
        """What makes it differ from the others."""
        return ", ".join(override.label for override in self.overrides) or self.base.name


@dataclass(frozen=True)
class Sweep:
    """The cases of a sweep, not yet checked as scenes; its title for tables, and the file the user named."""

    title: str
    file: str
    cases: tuple[Case, ...]


def read_sweep(scene: SweepScene) -> Sweep:
    """Make the cases of a sweep file, or raise a SceneError with all faults."""
    section, origin = scene.sweep, scene.origin
    faults = [scene.fault(("sweep", key), message) for key, message in _section_faults(section)]

    def file_of(key: str, name: str, places: str) -> Path | None:
        path = find_file(name, (origin.path.parent,), "workflows")
        if path is None:
            faults.append(scene.fault(("sweep", key), f"{key} = {shown(name)} does not exist {places}"))
        return path

    places = "as given, next to the sweep file or among the workflows"
    if section.base is None:
        bases = [file_of("scenes", name, places) for name in section.scenes]
    else:
        bases = [file_of("base", section.base, places)]
    varied = []
    for leaf, values in _leaves(section.vary):
        path = ("sweep", "vary", *leaf)
        if not isinstance(values, list) or not values:
            message = f"{leaf[-1]} = {shown(values)} must be a list of values; write [{shown(values)}]"
            faults.append(scene.fault(path, message))
        elif any(isinstance(value, Mapping) for value in values):
            faults.append(scene.fault(path, f"{leaf[-1]} = {shown(values)}: vary keys, not tables"))
        else:
            key, file, line = ".".join(map(str, leaf)), str(origin.path), scene.line(*path)
            varied.append([Override(key, value, file, line) for value in values])
    rows: list[Row] = []
    if not faults and section.table is not None:
        table = file_of("table", section.table, "as given or next to the sweep file")
        rows = _table_rows(table, faults) if table is not None else []
    elif not faults:
        rows = _design_rows(varied, section.design, faults, section.cases or 0, section.seed or 0)
    if len(rows) * len(bases) > MOST_CASES:
        message = f"{len(rows) * len(bases)} cases are too many; at most {MOST_CASES}"
        faults.append(scene.fault(("sweep", "vary"), message))
    if faults:
        raise SceneError(sorted(faults, key=lambda fault: (fault.file != str(origin.path), fault.line or 0)))
    existing = [path for path in bases if path is not None]
    return Sweep(scene.scene.title or origin.path.stem, str(origin.path), _cases(existing, rows))


def _section_faults(section: CasesSection) -> Iterator[tuple[str, str]]:
    """Keys of [sweep] that do not fit together, with messages."""
    if (section.base is None) == (not section.scenes):
        yield "base", "give either base, one scene, or scenes, a list of them"
    if section.table is not None and section.vary:
        yield "table", "give either table, a CSV file of cases, or [sweep.vary]"
    hypercube = section.design == "latin_hypercube"
    for key, given in (("cases", section.cases), ("seed", section.seed)):
        if hypercube and given is None:
            yield "design", f'design = "latin_hypercube" needs {key}; give {key} in [sweep]'
        if not hypercube and given is not None:
            yield key, f'{key} belongs to design = "latin_hypercube"; delete {key}, or change design'
    if section.table is not None and "design" in section.model_fields_set:
        yield "design", "design belongs to [sweep.vary]; a table lists its cases itself"


def sweep_of_flags(scene: str, vary: Sequence[str], table: str | None) -> Sweep:
    """Make the cases of a sweep of one scene from the flags of the command line, or raise all faults.

    Each of `vary` is "KEY=VALUE,VALUE,...": every value with every other, an empty one removes the key;
    `table` is a CSV file of cases in place of it.
    """
    base = find_file(scene, (), "workflows")
    faults = [] if base else [Fault("the scene file does not exist", scene)]
    rows: list[Row] = []
    if bool(vary) == (table is not None):
        message = "say what to vary, by --vary KEY=VALUE,VALUE or by --table CSV, or give a sweep file"
        faults.append(Fault(message, scene))
    elif table is not None:
        rows = _table_rows(Path(table), faults)
    else:
        varied = []
        for flag in vary:
            key, _, values = (part.strip() for part in flag.partition("="))
            if values and key:
                texts = next(csv.reader([values]))
                varied.append([Override(key, value_of(text), f"--vary {flag}") for text in texts])
            else:
                message = "must be KEY=VALUE,VALUE,... such as wear.form=local,patch_mean"
                faults.append(Fault(message, f"--vary {flag}"))
        rows = _design_rows(varied, "full_factorial", faults)
    if faults or base is None:
        raise SceneError(faults)
    return Sweep(base.stem, str(base), _cases([base], rows))


def _design_rows(
    varied: Sequence[Sequence[Override]], design: str, faults: list[Fault], cases: int = 0, seed: int = 0
) -> list[Row]:
    """Combine the values of all keys, the last key changing fastest; faults are appended to `faults`.

    Without any key there is one case, the base itself. The values of a Latin hypercube are the two ends of
    each range; it draws one value from each of `cases` equal parts of every range, in random order [1]_.

    References
    ----------
    .. [1] M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239,
       doi:10.1080/00401706.1979.10489755.
    """
    before = len(faults)

    def fault(item: Sequence[Override], message: str) -> None:
        faults.append(Fault(message, item[0].source, item[0].line))

    keys = [item[0].key for item in varied]
    length = max((len(item) for item in varied), default=0)
    for index, (key, item) in enumerate(zip(keys, varied, strict=True)):
        values = [override.value for override in item]
        numbers = [v for v in values if isinstance(v, int | float) and not isinstance(v, bool)]
        if key in keys[index + 1 :]:
            fault(item, f"{key} is varied twice; give all its values in one place")
        if design == "latin_hypercube" and not (len(numbers) == len(values) == 2 and numbers[0] < numbers[1]):
            fault(item, f"{key} = {shown(values)} must be a range [lowest, highest] for a latin_hypercube")
        if design == "list" and len(item) != length:
            fault(item, f"{key} has {len(item)} values, another key {length}; a list needs as many for each")
    if design == "full_factorial" and np.prod([len(item) for item in varied], dtype=float) > MOST_CASES:
        fault(varied[0], f"more than {MOST_CASES} cases; give fewer values, or a latin_hypercube")
    if len(faults) > before:
        return []
    if design == "full_factorial":
        return list(itertools.product(*varied))
    if design == "latin_hypercube":
        random = np.random.default_rng(seed)
        varied = [_drawn(item, (random.permutation(cases) + random.random(cases)) / cases) for item in varied]
    return list(zip(*varied, strict=True)) if varied else [()]


def _drawn(ends: Sequence[Override], part: np.ndarray) -> list[Override]:
    low, high = (float(end.value) for end in ends)
    drawn = [float(f"{low + (high - low) * share:.{_DIGITS}g}") for share in part]
    return [replace(ends[0], value=min(max(value, low), high)) for value in drawn]


def _table_rows(path: Path, faults: list[Fault]) -> list[Row]:
    """Read cases from a CSV file; its faults are appended to `faults`.

    First line: dotted keys. Each further line is a case; an empty cell keeps the base's value, lines that
    start with # do not count.
    """
    file = str(path)
    try:
        text = text_of(content_of(path, "a CSV file of cases"), file)
    except SceneError as error:
        faults += error.faults
        return []
    rows = [
        (place, next(csv.reader([line])))
        for place, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(rows) < 2:
        message = "no cases; give a line of keys such as wheelset.radius_mm, and a line per case"
        faults.append(Fault(message, file))
        return []
    (top, header), body = rows[0], rows[1:]
    keys = [key.strip() for key in header]
    for key in keys:
        if "." not in key:
            message = f"column {shown(key)} must be named section.key, such as wheelset.radius_mm"
            faults.append(Fault(message, file, top))
    if len(set(keys)) < len(keys):
        faults.append(Fault("two columns have the same key; delete one", file, top))
    for place, cells in body:
        if len(cells) != len(keys):
            faults.append(Fault(f"{len(cells)} cells where the first line has {len(keys)} keys", file, place))
    return [
        tuple(
            Override(key, value_of(cell), file, place)
            for key, cell in zip(keys, cells, strict=False)
            if cell.strip()
        )
        for place, cells in body
    ]


def _cases(bases: Sequence[Path], rows: Sequence[Row]) -> tuple[Case, ...]:
    pairs = itertools.product(bases, rows)
    return tuple(Case(k, base, row) for k, (base, row) in enumerate(pairs, 1))


def _leaves(vary: Mapping[str, Any], path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Keys of nested tables with their values; quoted keys with dots mean the same."""
    for key, value in vary.items():
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, (*path, key))
        else:
            yield (*path, key), value
