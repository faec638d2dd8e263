"""Standard shapes: TOML files with numbers, parameters, source and certainty, and what is built from them.

A shape is a chain of `[[segment]]` tables, each a range `from` .. `to` and one of

- `arc = { centre = [y, z], radius, branch }`: z = centre_z + branch * sqrt(radius^2 - (y - centre_y)^2);
- `polynomial = [c0, c1, ...]`: z = sum of c_k y^k;
- `spline = { step, heights, end_slopes }`: clamped cubic through a table of equal steps;
- `tangent_arc = { radius, branch }`: tangent to the segments before and after it, without `from` and `to`,
  which it also gives to the ends of its neighbours;

or a rail `[head]` of tangent arcs. `[base]` takes zones (and parameters) of another shape in the same folder
before the own segments. `[[parameter]]` says what may be varied, `[[allow]]` at which junctions the standard
is not smooth, how much, and why: `tests/profile/junctions.py` finds all others smooth. All lengths in mm.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.segments import Arc, Polynomial, Segment, Spline, rail_head
from wearsim.profile.shape import FloatArray, Kind

_NUMBER = r"([0-9]{1,4}(?:\.[0-9]{1,6})?)"


@dataclass(frozen=True)
class TangentArc:
    """An arc that is yet to be constructed from its neighbours."""

    zone: str
    radius: float
    branch: int


def _piece(table: Mapping[str, Any]) -> Segment | TangentArc:
    """One `[[segment]]` table; an end that the tangent arc of a neighbour gives is left out."""
    zone, start, end = table.get("zone", ""), table.get("from", -math.inf), table.get("to", math.inf)
    if arc := table.get("arc"):
        return Arc(zone, start, end, tuple(arc["centre"]), arc["radius"], arc["branch"])
    if spline := table.get("spline"):
        knots = tuple(start + spline["step"] * k for k in range(len(spline["heights"])))
        return Spline(zone, start, end, knots, tuple(spline["heights"]), tuple(spline["end_slopes"]))
    if tangent := table.get("tangent_arc"):
        return TangentArc(zone, **tangent)
    return Polynomial(zone, start, end, tuple(table["polynomial"]))


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape; an effect takes place only if the value is not the default.

    `form` is how it is written, # for the number: "h#", "e#", "#%", "1:#". All `values` there are, or the
    `range` of them. Zones of `raised` go up by the difference to the default; `tangent_arc` has a zone that
    becomes an arc tangent to its neighbours, of one of `radii` for each of the values; with `slope` a
    straight zone turns about `pivot` (its start if not given), and what lies outward keeps to its end; with
    `move` a part of the shape moves in y by the difference to the default, see `part_moved`. `allow` lists
    junctions that are not smooth for other values than the default.
    """

    form: str
    name: str
    default: float  # the value of the numbers in the file
    unit: str = ""
    values: tuple[float, ...] = ()
    range: tuple[float, float] | None = None
    raised: tuple[str, ...] = ()
    tangent_arc: Mapping[str, Any] | None = None
    slope: Mapping[str, Any] | None = None
    move: Mapping[str, Any] | None = None
    allow: tuple[Mapping[str, Any], ...] = ()

    def range_text(self) -> str:
        """Return the allowed values in words."""
        unit = f" {self.unit}" if self.unit else ""
        if self.range is None:
            return f"one of {', '.join(f'{v:g}' for v in self.values)}{unit}"
        return f"in {self.range[0]:g} .. {self.range[1]:g}{unit}"

    def parse(self, text: str) -> float | None:
        """Return the value written in `text`, None if it is not of this form."""
        prefix, suffix = map(re.escape, self.form.split("#"))
        match = re.fullmatch(rf"{prefix}\s*{_NUMBER}\s*{suffix}", text)
        return float(match[1]) if match else None

    def allows(self, value: float) -> bool:
        """Whether there is a shape of this value."""
        return value in self.values if self.range is None else self.range[0] <= value <= self.range[1]


@dataclass(frozen=True)
class Definition:
    """A standard shape as a chain of segments with rising y, from the flange back or the gauge side; in mm.

    A rail is upright, y from its symmetry axis, unless `inclined_gauge_y` is given.
    """

    name: str
    title: str  # the standard's designation
    kind: Kind
    segments: tuple[Segment, ...]
    source: str  # where the numbers come from
    certainty: str  # how sure they are
    allowances: tuple[Mapping[str, Any], ...] = ()  # junctions that are not smooth, with the reason
    inclined_gauge_y: float | None = None  # of a rail defined as it stands in the track: y of its gauge point


def evaluate(definition: Definition, y: FloatArray) -> FloatArray:
    """Exact height z (n,) [m] of a definition at lateral positions y (n,) [m]; a rail is not placed.

    At a junction the segment on the field side counts.
    """
    y_mm = np.asarray(y, dtype=np.float64) * 1e3
    starts = np.array([piece.start for piece in definition.segments])
    # a position given in metres may miss the end by the rounding of the unit
    which = np.clip(np.searchsorted(starts, y_mm, side="right") - 1, 0, None)
    z = np.empty_like(y_mm)
    for k, piece in enumerate(definition.segments):
        z[which == k] = piece.height(y_mm[which == k])
    return z * 1e-3


def sample(definition: Definition, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Points y, z [m] on a definition at even arc length within each segment, all junctions included.

    Raises `ProfileError` for a spacing [m] that is not within 0.001 .. 2 mm.
    """
    if not 1e-6 <= spacing <= 2e-3:
        raise ProfileError(
            f"{definition.name}: point spacing = {spacing * 1e3:g} mm must be in 0.001 .. 2 mm"
        )
    y = [definition.segments[0].abscissae(spacing * 1e3)]
    y.extend(piece.abscissae(spacing * 1e3)[1:] for piece in definition.segments[1:])
    y_m = np.concatenate(y) * 1e-3
    return y_m, evaluate(definition, y_m)


class Template(NamedTuple):
    """A file before values of its parameters are chosen: some pieces are yet to be constructed."""

    path: Path
    about: Mapping[str, Any]  # its own keys
    pieces: tuple[Segment | TangentArc, ...]  # with those of the base
    parameters: tuple[Parameter, ...]  # with those of the base


@lru_cache(maxsize=64)
def read_template(path: Path) -> Template:
    """Read a file of a standard shape, see the head of this module."""
    pieces: list[Segment | TangentArc] = []
    parameters: list[Parameter] = []
    try:
        about = tomllib.loads(path.read_text(encoding="utf-8"))
        if base := about.get("base"):
            other = read_template(path.with_name(f"{base['name']}.toml"))
            pieces = [piece for piece in other.pieces if piece.zone in base["zones"]]
            parameters = [p for p in other.parameters if p.form in base["parameters"]]
        if head := about.get("head"):
            pieces += rail_head(**head)
        pieces += [_piece(table) for table in about.get("segment", ())]
        parameters += [Parameter(**table) for table in about.get("parameter", ())]
        if not {"name", "kind", "source", "certainty"} <= about.keys() or not pieces:
            raise KeyError("name, kind, source, certainty and a shape are needed")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ProfileError(f"{path}: is no definition of a shape: {error}") from error
    return Template(path, about, tuple(pieces), tuple(parameters))
