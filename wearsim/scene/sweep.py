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
from wearsim.toml_faults import KeyPath, content_of, line_of, shown, text_of

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
    """One campaign, or comparison, of many.

    Parameters
    ----------
    number : int
        Counted from 1.
    base : Path
        The scene file it is made from.
    overrides : tuple of Override
        What it sets in it.
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
        """What makes it differ from the others."""
        return ", ".join(override.label for override in self.overrides) or self.base.name


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

    def fault(message: str, key: str) -> None:
        faults.append(Fault(message, file, scene.line("sweep", key)))

    if (section.base is None) == (not section.scenes):
        fault("give either base, one scene, or scenes, a list of them", "base")
    key = "scenes" if section.base is None else "base"
    bases = []
    for name in section.scenes if section.base is None else (section.base,):
        path = find_file(name, (folder,), "workflows")
        if path is None:
            places = "as given, next to the sweep file or among the workflows"
            fault(f"{key} = {shown(name)} does not exist {places}", key)
        else:
            bases.append(path)
    varied = []
    for leaf, values in _leaves(section.vary):
        line = line_of(origin.lines, ("sweep", "vary", *leaf))
        if not isinstance(values, list) or not values:
            message = f"{leaf[-1]} = {shown(values)} must be a list of values; write [{shown(values)}]"
            faults.append(Fault(message, file, line))
        elif any(isinstance(value, Mapping) for value in values):
            faults.append(Fault(f"{leaf[-1]} = {shown(values)}: vary keys, not tables", file, line))
        else:
            varied.append([Override(".".join(map(str, leaf)), value, file, line) for value in values])
    if section.table is not None and section.vary:
        fault("give either table, a CSV file of cases, or [sweep.vary]", "table")
    hypercube = section.design == "latin_hypercube"
    for key, given in (("cases", section.cases), ("seed", section.seed)):
        if hypercube and given is None:
            fault(f'design = "latin_hypercube" needs {key}; give {key} in [sweep]', "design")
        if not hypercube and given is not None:
            fault(f'{key} belongs to design = "latin_hypercube"; delete {key}, or change design', key)
    if section.table is not None and "design" in section.model_fields_set:
        fault("design belongs to [sweep.vary]; a table lists its cases itself", "design")
    rows: list[Row] = []
    if not faults and section.table is not None:
        table = find_file(section.table, (folder,), "workflows")
        if table is None:
            fault(
                f"table = {shown(section.table)} does not exist as given or next to the sweep file", "table"
            )
        else:
            rows, faults = table_rows(table)
    elif not faults:
        rows, faults = design_rows(varied, section.design, section.cases or 0, section.seed or 0)
    if len(rows) * len(bases) > MOST_CASES:
        fault(f"{len(rows) * len(bases)} cases are too many; at most {MOST_CASES}", "vary")
    if faults:
        return None, sorted(faults, key=lambda fault: (fault.file != file, fault.line or 0))
    return Sweep(scene.scene.title or origin.path.stem, file, _cases(bases, rows)), []


def sweep_of_flags(scene: str, vary: Sequence[str], table: str | None) -> Sweep:
    """Make the cases of a sweep of one scene from the flags of the command line.

    Parameters
    ----------
    scene : str
        Scene file of a rig, a field or a comparison.
    vary : sequence of str
        Each "KEY=VALUE,VALUE,..."; every value with every other, an empty one removes the key.
    table : str, optional
        CSV file of cases, in place of `vary`.

    Raises
    ------
    SceneError
        With all faults.
    """
    base = find_file(scene, (), "workflows")
    faults = [] if base else [Fault("the scene file does not exist", scene)]
    rows: list[Row] = []
    more: list[Fault] = []
    if bool(vary) == (table is not None):
        message = "say what to vary, by --vary KEY=VALUE,VALUE or by --table CSV, or give a sweep file"
        faults.append(Fault(message, scene))
    elif table is not None:
        rows, more = table_rows(Path(table))
    else:
        varied = []
        for flag in vary:
            key, sign, values = (part.strip() for part in flag.partition("="))
            if sign and values and key:
                texts = next(csv.reader([values]))
                varied.append([Override(key, value_of(text), f"--vary {flag}") for text in texts])
            else:
                message = "must be KEY=VALUE,VALUE,... such as wear.form=local,patch_mean"
                faults.append(Fault(message, f"--vary {flag}"))
        rows, more = design_rows(varied, "full_factorial")
    if faults or more or base is None:
        raise SceneError([*faults, *more])
    return Sweep(base.stem, str(base), _cases([base], rows))


def design_rows(
    varied: Sequence[Sequence[Override]], design: str, cases: int = 0, seed: int = 0
) -> tuple[list[Row], list[Fault]]:
    """Combine the values of all keys.

    Parameters
    ----------
    varied : sequence of sequence of Override
        All values of each key; the last key changes fastest.
    design : {"full_factorial", "list", "latin_hypercube"}
        How.
    cases, seed : int
        Of a latin_hypercube, whose values are the two ends of each range.

    Returns
    -------
    tuple of list of tuple of Override, list of Fault
        One entry per case; without any key one case, the base itself.

    Notes
    -----
    The Latin hypercube draws one value from each of `cases` equal parts of every range, in random order
    [1]_.

    References
    ----------
    .. [1] M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239,
       doi:10.1080/00401706.1979.10489755.
    """
    faults: list[Fault] = []

    def fault(item: Sequence[Override], message: str) -> None:
        faults.append(Fault(f"{item[0].key} {message}", item[0].source, item[0].line))

    keys = [item[0].key for item in varied]
    length = max((len(item) for item in varied), default=0)
    for index, item in enumerate(varied):
        values = [override.value for override in item]
        numbers = [v for v in values if isinstance(v, int | float) and not isinstance(v, bool)]
        if keys[index] in keys[index + 1 :]:
            fault(item, "is varied twice; give all its values in one place")
        if design == "latin_hypercube" and not (len(numbers) == len(values) == 2 and numbers[0] < numbers[1]):
            fault(item, f"= {shown(values)} must be a range [lowest, highest] for a latin_hypercube")
        if design == "list" and len(item) != length:
            fault(item, f"has {len(item)} values, another key {length}; a list needs as many for each")
    if design == "full_factorial" and np.prod([len(item) for item in varied], dtype=float) > MOST_CASES:
        message = f"more than {MOST_CASES} cases; give fewer values, or a latin_hypercube"
        faults.append(Fault(message, varied[0][0].source, varied[0][0].line))
    if faults:
        return [], faults
    if design == "full_factorial":
        return list(itertools.product(*varied)), []
    if design == "latin_hypercube":
        random = np.random.default_rng(seed)
        varied = [_drawn(item, (random.permutation(cases) + random.random(cases)) / cases) for item in varied]
    return (list(zip(*varied, strict=True)) if varied else [()]), []


def _drawn(ends: Sequence[Override], part: np.ndarray) -> list[Override]:
    low, high = (float(end.value) for end in ends)
    drawn = [float(f"{low + (high - low) * share:.{_DIGITS}g}") for share in part]
    return [replace(ends[0], value=min(max(value, low), high)) for value in drawn]


def table_rows(path: Path) -> tuple[list[Row], list[Fault]]:
    """Read cases from a CSV file.

    Parameters
    ----------
    path : Path
        First line: dotted keys. Each further line is a case; an empty cell keeps the base's value, lines
        that start with # do not count.

    Returns
    -------
    tuple of list of tuple of Override, list of Fault
        One entry per case.
    """
    file = str(path)
    try:
        text = text_of(content_of(path, "a CSV file of cases"), file)
    except SceneError as error:
        return [], list(error.faults)
    rows = [
        (place, next(csv.reader([line])))
        for place, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(rows) < 2:
        message = "no cases; give a line of keys such as wheelset.radius_mm, and a line per case"
        return [], [Fault(message, file)]
    (top, header), body = rows[0], rows[1:]
    keys = [key.strip() for key in header]
    faults = [
        Fault(f"column {shown(key)} must be named section.key, such as wheelset.radius_mm", file, top)
        for key in keys
        if "." not in key
    ]
    if len(set(keys)) < len(keys):
        faults.append(Fault("two columns have the same key; delete one", file, top))
    faults += [
        Fault(f"{len(cells)} cells where the first line has {len(keys)} keys", file, place)
        for place, cells in body
        if len(cells) != len(keys)
    ]
    return [
        tuple(
            Override(key, value_of(cell), file, place)
            for key, cell in zip(keys, cells, strict=False)
            if cell.strip()
        )
        for place, cells in body
    ], faults


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
