"""Standard shapes: TOML files with numbers, parameters, source and certainty, and what is built from them.

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
import re
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from wearsim.errors import ProfileError
from wearsim.profile.segments import Arc, Polynomial, Segment, Spline, rail_head
from wearsim.profile.shape import FloatArray, Kind
from wearsim.toml_faults import Table, cross_check, read_toml

STEP_TOLERANCE = 0.2e-6
"""Largest jump of z at a junction without a stated reason [m]: the rounding of good printed digits."""

KINK_TOLERANCE = 0.02e-3
"""Largest jump of the tangent angle at a junction without a stated reason [rad]."""
_NUMBER = r"([0-9]{1,4}(?:\.[0-9]{1,6})?)"


def _not_blank(text: str) -> str:
    if not text.strip():
        raise PydanticCustomError("out_of_range", "text", {"allowed": "a text that is not empty"})
    return text


Text = Annotated[str, AfterValidator(_not_blank)]
Positive = Annotated[float, Field(gt=0)]
Numbers = Annotated[tuple[float, ...], Field(min_length=1)]
Pair = tuple[float, float]
Branch = Annotated[Literal[1, -1], Field(description="1 (cap) or -1 (bowl)")]


class Allowance(Table):
    """A junction at which the standard itself is not smooth: zones ("*" is any), size and reason."""

    between: tuple[str, str] = Field(description="the zones on its flange (or gauge) and on its field side")
    step_um: Positive = 0.0
    kink_mrad: Positive = 0.0
    reason: Text = Field(description="why it is not smooth")

    def holds(self, zones: tuple[str, str]) -> bool:
        """Whether it is about the junction of these zones."""
        return all(own in ("*", zone) for own, zone in zip(self.between, zones, strict=True))


class _ArcKeys(Table):
    centre: Pair
    radius: Positive = Field(description="the radius [mm]")
    branch: Branch


class TangentArc(Table):
    """An arc that is yet to be constructed from its neighbours."""

    zone: str = ""
    radius: Positive = Field(description="the radius [mm]")
    branch: Branch


class _SplineKeys(Table):
    step: Positive
    heights: Numbers
    end_slopes: Pair


class _Piece(Table):
    """One `[[segment]]` table; an end that the tangent arc of a neighbour gives is left out."""

    zone: str = ""
    start: float = Field(-math.inf, alias="from", allow_inf_nan=True)
    end: float = Field(math.inf, alias="to", allow_inf_nan=True)
    arc: _ArcKeys | None = None
    polynomial: Numbers | None = None
    spline: _SplineKeys | None = None
    tangent_arc: TangentArc | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        curves = ("arc", "polynomial", "spline", "tangent_arc")
        if sum(getattr(self, name) is not None for name in curves) != 1:
            raise cross_check(f"zone {self.zone!r} needs one of {', '.join(curves)}")
        if not self.start < self.end:
            raise cross_check(
                f"zone {self.zone!r}: from = {self.start:g} must be below to = {self.end:g}", "from"
            )
        ends = [end for end in (self.start, self.end) if math.isfinite(end)]
        if self.arc is not None and any(
            abs(end - self.arc.centre[0]) > self.arc.radius * (1.0 + 1e-9) for end in ends
        ):
            range = f"{self.start:g} .. {self.end:g}"
            raise cross_check(f"zone {self.zone!r}: the circle is smaller than its range {range}", "arc")
        if self.spline is not None and not abs(self._knots(self.spline)[-1] - self.end) < 1e-9:
            reach = f"{len(self.spline.heights)} heights do not reach from {self.start:g} to {self.end:g}"
            raise cross_check(f"zone {self.zone!r}: {reach}", "spline")
        return self

    def _knots(self, spline: _SplineKeys) -> tuple[float, ...]:
        return tuple(self.start + spline.step * k for k in range(len(spline.heights)))

    def piece(self) -> Segment | TangentArc:
        """Segment, or what one will be constructed from."""
        zone, start, end, arc, spline = self.zone, self.start, self.end, self.arc, self.spline
        if arc is not None:
            return Arc(zone, start, end, arc.centre, arc.radius, arc.branch)
        if spline is not None:
            return Spline(zone, start, end, self._knots(spline), spline.heights, spline.end_slopes)
        if self.tangent_arc is not None:
            return self.tangent_arc.model_copy(update={"zone": zone})
        return Polynomial(zone, start, end, self.polynomial or ())


class _Slope(Table):
    """A straight zone turns about `pivot` (its start if not given); what lies outward keeps to its end."""

    zone: Text
    meaning: Literal["percent", "one_in"]
    pivot: float | None = None


class _Move(Table):
    """A part of the shape moves in y by the difference to the default, see `part_moved`."""

    start: float = Field(alias="from")
    end: float = Field(alias="to")
    join_zone: Text
    join_to: float


class _TangentArcs(Table):
    """Zone that becomes an arc tangent to its neighbours, of a radius for each of the values."""

    zone: Text
    radii: Numbers


class Parameter(Table):
    """One parameter of a shape; an effect takes place only if the value is not the default.

    `form` is how it is written, # for the number: "h#", "e#", "#%", "1:#". All `values` there are, or the
    `range` of them. Zones of `raised` go up by the difference to the default; `allow` lists junctions that
    are not smooth for other values than the default.
    """

    form: Text = Field(description="how it is written, # for the number")
    name: Text = Field(description="its name in words")
    unit: Text = ""
    default: float = Field(description="the value of the numbers in the file")
    values: Numbers = ()
    range: Pair | None = None
    raised: tuple[str, ...] = ()
    tangent_arc: _TangentArcs | None = None
    slope: _Slope | None = None
    move: _Move | None = None
    allow: tuple[Allowance, ...] = ()

    @model_validator(mode="after")
    def _fits(self) -> Self:
        form = f"parameter {self.form!r}"
        if self.form.count("#") != 1:
            raise cross_check(f"form = {self.form!r} must hold # once, for the number", "form")
        if not self.values and self.range is None:
            raise cross_check(f"{form}: give values or range")
        if not self.allows(self.default):
            raise cross_check(f"{form}: default must be {self.range_text()}", "default")
        if self.tangent_arc is not None and len(self.tangent_arc.radii) != len(self.values):
            raise cross_check(f"{form}: radii must be {len(self.values)} numbers", "tangent_arc")
        return self

    def range_text(self) -> str:
        """Return the allowed values in words."""
        unit = f" {self.unit}" if self.unit else ""
        if self.values or self.range is None:
            return f"one of {', '.join(f'{v:g}' for v in self.values)}{unit}"
        return f"in {self.range[0]:g} .. {self.range[1]:g}{unit}"

    def parse(self, text: str) -> float | None:
        """Return the value written in `text`, None if it is not of this form."""
        prefix, suffix = map(re.escape, self.form.split("#"))
        match = re.fullmatch(rf"{prefix}\s*{_NUMBER}\s*{suffix}", text)
        return float(match[1]) if match else None

    def allows(self, value: float) -> bool:
        """Whether there is a shape of this value."""
        if self.values or self.range is None:
            return value in self.values
        return self.range[0] <= value <= self.range[1]


class _Head(Table):
    """Rail head, see `rail_head`."""

    radii: Numbers
    junction_widths: Numbers
    side: Positive
    side_depth: Positive


class _Base(Table):
    name: Text
    zones: tuple[str, ...]
    parameters: tuple[str, ...]


class ShapeFile(Table):
    """File of a standard shape."""

    name: Text = Field(description="its short name")
    kind: Kind = Field(description="what it is")
    title: Text = ""
    source: Text = Field(description="where the numbers come from")
    certainty: Text = Field(description="how sure they are")
    aliases: tuple[str, ...] = ()
    inclined_gauge_y: float | None = None
    base: _Base | None = None
    head: _Head | None = None
    segment: tuple[_Piece, ...] = ()
    parameter: tuple[Parameter, ...] = ()
    allow: tuple[Allowance, ...] = ()

    @model_validator(mode="after")
    def _has_shape(self) -> Self:
        if not (self.base or self.head or self.segment):
            raise cross_check("no shape: give [head] or [[segment]] tables")
        return self


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
    allowances: tuple[Allowance, ...] = ()  # junctions that are not smooth, with the reason
    inclined_gauge_y: float | None = None  # of a rail defined as it stands in the track: y of its gauge point


def evaluate(definition: Definition, y: FloatArray) -> FloatArray:
    """Exact height z (n,) [m] of a definition at lateral positions y (n,) [m]; a rail is not placed.

    At a junction the segment on the field side counts. Raises `ProfileError` outside the definition.
    """
    y_mm = np.asarray(y, dtype=np.float64) * 1e3
    starts = np.array([piece.start for piece in definition.segments])
    # a position given in metres may miss the end by the rounding of the unit
    low, high = starts[0] - 1e-9, definition.segments[-1].end + 1e-9
    if not np.all((y_mm >= low) & (y_mm <= high)):
        raise ProfileError(f"{definition.name} is defined from y = {starts[0]:g} to {high:.6g} mm only")
    which = np.clip(np.searchsorted(starts, y_mm, side="right") - 1, 0, None)
    z = np.empty_like(y_mm)
    for k, piece in enumerate(definition.segments):
        z[which == k] = piece.height(y_mm[which == k])
    return z * 1e-3


def junctions(definition: Definition) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misclosure of a definition at its n - 1 junctions: place [m], jump of z [m] and of the angle [rad].

    Jumps are field side minus flange or gauge side.
    """
    pairs = list(pairwise(definition.segments))
    y = np.array([right.start for _, right in pairs])
    step, kink = np.empty_like(y), np.empty_like(y)
    for k, (left, right) in enumerate(pairs):
        at = y[k : k + 1]
        step[k] = (right.height(at) - left.height(at))[0]
        kink[k] = (right.angle(at) - left.angle(at))[0]
    return y * 1e-3, step * 1e-3, kink


def junction_faults(definition: Definition) -> list[str]:
    """One message for each junction that is neither smooth within the tolerances nor allowed."""
    faults = []
    chain = definition.segments
    for left, right in pairwise(chain):
        if left.end != right.start:
            faults.append(
                f"zone {left.zone!r} ends at y = {left.end:.9g} mm, zone {right.zone!r} begins at "
                f"{right.start:.9g} mm; both must be the same"
            )
    for k, (y, step, kink) in enumerate(zip(*junctions(definition), strict=True)):
        zones = chain[k].zone, chain[k + 1].zone
        allowed = [each for each in definition.allowances if each.holds(zones)]
        most_step = max([STEP_TOLERANCE, *(each.step_um * 1e-6 for each in allowed)])
        most_kink = max([KINK_TOLERANCE, *(each.kink_mrad * 1e-3 for each in allowed)])
        if not (abs(step) <= most_step and abs(kink) <= most_kink):
            faults.append(
                f"zones {zones[0]!r} and {zones[1]!r} meet at y = {y * 1e3:.6g} mm with a step of "
                f"{step * 1e6:.3g} um and a kink of {kink * 1e3:.3g} mrad, more than {most_step * 1e6:g} um "
                f"or {most_kink * 1e3:g} mrad; correct the numbers, or allow it with its reason in [[allow]]"
            )
    return faults


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
    shape: ShapeFile
    pieces: tuple[Segment | TangentArc, ...]  # with those of the base
    parameters: tuple[Parameter, ...]  # with those of the base


@lru_cache(maxsize=64)
def read_template(path: Path) -> Template:
    """Read a file of a standard shape, see the head of this module; all faults as ``file:line: message``."""
    shape, faults = read_toml(path, ShapeFile)
    if shape is None:
        raise ProfileError("\n".join(map(str, faults)))
    pieces: list[Segment | TangentArc] = []
    parameters: list[Parameter] = []
    try:
        if shape.base is not None:
            zones, forms = shape.base.zones, shape.base.parameters
            base = read_template(path.with_name(f"{shape.base.name}.toml"))
            pieces = [piece for piece in base.pieces if piece.zone in zones]
            parameters = [p for p in base.parameters if p.form in forms]
            if len(pieces) < len(zones) or len(parameters) < len(forms):
                raise ProfileError(f"base: {base.shape.name} does not have all of {[*zones, *forms]}")
        if (head := shape.head) is not None:
            pieces += rail_head(head.radii, head.junction_widths, head.side, head.side_depth)
    except ProfileError as error:
        raise ProfileError(f"{path}: {error}") from error
    pieces += [each.piece() for each in shape.segment]
    return Template(path, shape, tuple(pieces), (*parameters, *shape.parameter))
