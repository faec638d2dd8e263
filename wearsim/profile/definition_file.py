"""Files of standard shapes: TOML with numbers, parameters, source and certainty.

A shape is a chain of `[[segment]]` tables, each a range `from` .. `to` and one of

- `arc = { centre = [y, z], radius, branch }`: z = centre_z + branch * sqrt(radius^2 - (y - centre_y)^2);
- `polynomial = [c0, c1, ...]`: z = sum of c_k y^k;
- `spline = { step, heights, end_slopes }`: clamped cubic through a table of equal steps;
- `tangent_arc = { radius, branch }`: tangent to the segments before and after it, without `from` and `to`,
  which it also gives to the ends of its neighbours;

or a rail `[head]` of tangent arcs. `[base]` takes zones (and parameters) of another shape in the same folder
before the own segments. `[[parameter]]` says what may be varied, `[[allow]]` at which junctions the standard
is not smooth, and why. All lengths in mm.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from wearsim.errors import Fault, ProfileError
from wearsim.profile.construction import rail_head
from wearsim.profile.definition import Allowance, Definition
from wearsim.profile.parameters import Move, Parameter, Slope
from wearsim.profile.segment import Arc, Polynomial, Segment, Spline
from wearsim.profile.variation import TangentArc, Template, build


class _Table:
    """A TOML table read key by key, so that missing, mistyped and unknown keys are told with their place."""

    def __init__(self, data: object, place: str) -> None:
        if not isinstance(data, dict):
            raise ProfileError(f"{place} must be a table")
        self.data: dict[str, Any] = dict(data)
        self.place = f"{place}: " if place else ""

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def _take(self, key: str, words: str) -> Any:
        if key not in self.data:
            raise ProfileError(f"{self.place}{key} is missing; give {words}")
        return self.data.pop(key)

    def _number(self, value: object, key: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ProfileError(f"{self.place}{key} = {value!r} must be a number")
        return float(value)

    def number(self, key: str) -> float:
        return self._number(self._take(key, "a number"), key)

    def positive(self, key: str) -> float:
        value = self.number(key)
        if value <= 0.0:
            raise ProfileError(f"{self.place}{key} = {value:g} must be above 0")
        return value

    def numbers(self, key: str, count: int | None = None) -> tuple[float, ...]:
        words = "a list of numbers" if count is None else f"a list of {count} numbers"
        value = self._take(key, words)
        if not isinstance(value, list) or not value or (count is not None and len(value) != count):
            raise ProfileError(f"{self.place}{key} must be {words}")
        return tuple(self._number(v, key) for v in value)

    def branch(self) -> int:
        value = self.number("branch")
        if value not in (-1.0, 1.0):
            raise ProfileError(f"{self.place}branch = {value:g} must be 1 (cap) or -1 (bowl)")
        return int(value)

    def text(self, key: str) -> str:
        value = self._take(key, "a text")
        if not isinstance(value, str) or not value.strip():
            raise ProfileError(f"{self.place}{key} must be a text that is not empty")
        return value

    def one_of(self, key: str, choices: tuple[str, ...]) -> Any:
        value = self.text(key)
        if value not in choices:
            raise ProfileError(f"{self.place}{key} = {value!r} must be one of {', '.join(choices)}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        value = self._take(key, "a list of texts")
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise ProfileError(f"{self.place}{key} must be a list of texts")
        return tuple(value)

    def table(self, key: str) -> _Table:
        return _Table(self._take(key, "a table"), f"{self.place}{key}")

    def tables(self, key: str) -> list[_Table]:
        value = self.data.pop(key, [])
        if not isinstance(value, list):
            raise ProfileError(f"{self.place}{key} must be a list of tables, [[{key}]]")
        return [_Table(v, f"{self.place}{key} {k}") for k, v in enumerate(value, start=1)]

    def done(self) -> None:
        if self.data:
            raise ProfileError(f"{self.place}{next(iter(self.data))} is not a key of a definition; delete it")


@lru_cache(maxsize=64)
def read_template(path: Path) -> Template:
    """Read a file of a standard shape.

    Parameters
    ----------
    path : Path
        TOML file, see the head of this module.

    Returns
    -------
    Template
        To be built with `build`.

    Raises
    ------
    ProfileError
        With file, and the segment or key that is wrong.
    """
    try:
        with path.open("rb") as file:
            root = _Table(tomllib.load(file), "")
        return _template(path, root)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ProfileError(f"{path}: is not TOML: {error}") from error
    except OSError as error:
        raise ProfileError(f"{path}: cannot be read ({error.strerror})") from error
    except ProfileError as error:
        raise ProfileError(str(Fault(str(error), str(path)))) from error


def _template(path: Path, root: _Table) -> Template:
    kind: Literal["wheel", "rail"] = root.one_of("kind", ("wheel", "rail"))
    pieces: list[Segment | TangentArc] = []
    parameters: list[Parameter] = []
    if "base" in root:
        table = root.table("base")
        base = read_template(path.with_name(f"{table.text('name')}.toml"))
        zones, forms = table.texts("zones"), table.texts("parameters")
        table.done()
        pieces = [piece for piece in base.pieces if piece.zone in zones]
        parameters = [p for p in base.parameters if p.form in forms]
        if len(pieces) < len(zones) or len(parameters) < len(forms):
            raise ProfileError(f"base: {base.definition.name} does not have all of {[*zones, *forms]}")
    if "head" in root:
        head = root.table("head")
        pieces += rail_head(
            head.numbers("radii"),
            head.numbers("junction_widths"),
            head.positive("side"),
            head.positive("side_depth"),
        )
        head.done()
    pieces += [_piece(table) for table in root.tables("segment")]
    if not pieces:
        raise ProfileError("no shape: give [head] or [[segment]] tables")
    parameters += [_parameter(table) for table in root.tables("parameter")]
    name = root.text("name")
    definition = Definition(
        name=name,
        title=root.text("title") if "title" in root else name,
        kind=kind,
        segments=(),
        source=root.text("source"),
        certainty=root.text("certainty"),
        allowances=tuple(map(_allowance, root.tables("allow"))),
        inclined_gauge_y=root.number("inclined_gauge_y") if "inclined_gauge_y" in root else None,
    )
    aliases = root.texts("aliases") if "aliases" in root else ()
    root.done()
    return Template(path, definition, aliases, tuple(pieces), tuple(parameters))


def _piece(table: _Table) -> Segment | TangentArc:
    """One `[[segment]]` table."""
    zone = table.text("zone") if "zone" in table else ""
    if zone:
        table.place = f"zone {zone!r}: "
    piece: Segment | TangentArc
    if "tangent_arc" in table:
        arc = table.table("tangent_arc")
        piece = TangentArc(zone, arc.positive("radius"), arc.branch())
        arc.done()
        table.done()
        return piece
    # an end that a tangent arc beside it gives is left out
    start = table.number("from") if "from" in table else -math.inf
    end = table.number("to") if "to" in table else math.inf
    if not start < end:
        raise ProfileError(f"{table.place}from = {start:g} must be below to = {end:g}")
    if "arc" in table:
        arc = table.table("arc")
        y, z = arc.numbers("centre", 2)
        piece = Arc(zone, start, end, (y, z), arc.positive("radius"), arc.branch())
        arc.done()
        reach = piece.radius * (1.0 + 1e-9)
        if not (y - reach <= start or start == -math.inf) or not (end <= y + reach or end == math.inf):
            raise ProfileError(f"{table.place}the circle is smaller than its range {start:g} .. {end:g}")
    elif "spline" in table:
        piece = _spline(zone, start, end, table.table("spline"))
    else:
        piece = Polynomial(zone, start, end, table.numbers("polynomial"))
    table.done()
    return piece


def _spline(zone: str, start: float, end: float, table: _Table) -> Spline:
    step, heights = table.positive("step"), table.numbers("heights")
    first, last = table.numbers("end_slopes", 2)
    table.done()
    knots = tuple(start + step * k for k in range(len(heights)))
    if not abs(knots[-1] - end) < 1e-9:
        raise ProfileError(f"{table.place}{len(heights)} heights do not reach from {start:g} to {end:g}")
    return Spline(zone, start, end, knots, heights, (first, last))


def _allowance(table: _Table) -> Allowance:
    between = table.texts("between")
    if len(between) != 2:
        raise ProfileError(f"{table.place}between must be two zones")
    step = table.positive("step_um") if "step_um" in table else 0.0
    kink = table.positive("kink_mrad") if "kink_mrad" in table else 0.0
    allowance = Allowance((between[0], between[1]), step * 1e-6, kink * 1e-3, table.text("reason"))
    table.done()
    return allowance


def _parameter(table: _Table) -> Parameter:
    form = table.text("form")
    if form.count("#") != 1:
        raise ProfileError(f"{table.place}form = {form!r} must hold # once, for the number")
    table.place = f"parameter {form!r}: "
    values = table.numbers("values") if "values" in table else ()
    limits = (min(values), max(values)) if values else table.numbers("range", 2)
    parameter = Parameter(
        form=form,
        name=table.text("name"),
        unit=table.text("unit") if "unit" in table else "",
        default=table.number("default"),
        values=values,
        limits=(limits[0], limits[1]),
        raised=table.texts("raised") if "raised" in table else (),
    )
    if not parameter.allows(parameter.default):
        raise ProfileError(f"{table.place}default must be {parameter.range_text()}")
    if "tangent_arc" in table:
        arc = table.table("tangent_arc")
        parameter = replace(
            parameter, tangent_zone=arc.text("zone"), tangent_radii=arc.numbers("radii", len(values))
        )
        arc.done()
    if "slope" in table:
        turn = table.table("slope")
        meaning: Literal["percent", "one_in"] = turn.one_of("meaning", ("percent", "one_in"))
        pivot = turn.number("pivot") if "pivot" in turn else None
        parameter = replace(parameter, slope=Slope(turn.text("zone"), meaning, pivot))
        turn.done()
    if "move" in table:
        move = table.table("move")
        parameter = replace(
            parameter,
            move=Move(move.number("from"), move.number("to"), move.text("join_zone"), move.number("join_to")),
        )
        move.done()
    parameter = replace(parameter, allowances=tuple(map(_allowance, table.tables("allow"))))
    table.done()
    return parameter


def read_definition(path: Path) -> Definition:
    """Read a standard shape with the default values of its parameters.

    Parameters
    ----------
    path : Path
        TOML file, see the head of this module.

    Returns
    -------
    Definition
        Lengths in mm, as in the file; junctions checked.
    """
    template = read_template(path)
    return build(template, {p.form: p.default for p in template.parameters})
