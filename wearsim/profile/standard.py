"""Standard shapes by name and parameters, built from definitions in TOML files.

A shape is a chain of `[[segment]]` tables, each a range `from` .. `to` and one of

- `arc = { centre = [y, z], radius, branch }`: z = centre_z + branch * sqrt(radius^2 -
  (y - centre_y)^2);
- `polynomial = [c0, c1, ...]`: z = sum of c_k y^k;
- `spline = { step, heights, end_slopes }`: clamped cubic through a table of equal
  steps;
- `tangent_arc = { radius, branch }`: tangent to the segments before and after it,
  without `from` and `to`, which it also gives to the ends of its neighbours;

or a rail `[head]` of tangent arcs. `[base]` takes zones (and parameters) of another
shape in the same folder before the own segments. `[[parameter]]` says what may be
varied, `[[allow]]` at which junctions the standard is not smooth, how much, and why:
`tests/profile/junctions.py` finds all others smooth. All lengths in mm.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearsim.errors import ProfileError, suggestion
from wearsim.profile.placement import GAUGE_DEPTH, placement
from wearsim.profile.segments import (
    Arc,
    Polynomial,
    Segment,
    Spline,
    height_at,
    part_moved,
    rail_head,
    tangent_arc,
)
from wearsim.profile.shape import FloatArray, Kind, Profile

_NUMBER = r"([0-9]{1,4}(?:\.[0-9]{1,6})?)"


@dataclass(frozen=True)
class TangentArc:
    """Arc that is constructed later from its neighbours."""

    zone: str
    radius: float
    branch: int


def _piece(table: Mapping[str, Any]) -> Segment | TangentArc:
    """Build a segment from one `[[segment]]` table.

    An end that follows from the tangent arc of a neighbour is omitted.
    """
    zone, start, end = (
        table.get("zone", ""),
        table.get("from", -math.inf),
        table.get("to", math.inf),
    )
    if arc := table.get("arc"):
        return Arc(zone, start, end, tuple(arc["centre"]), arc["radius"], arc["branch"])
    if spline := table.get("spline"):
        knots = tuple(start + spline["step"] * k for k in range(len(spline["heights"])))
        return Spline(
            zone,
            start,
            end,
            knots,
            tuple(spline["heights"]),
            tuple(spline["end_slopes"]),
        )
    if tangent := table.get("tangent_arc"):
        return TangentArc(zone, **tangent)
    return Polynomial(zone, start, end, tuple(table["polynomial"]))


@dataclass(frozen=True)
class Parameter:
    """Parameter of a shape; it has an effect only if its value is not the default.

    `form` is how it is written, # for the number: "h#", "e#", "#%", "1:#". All `values`
    there are, or the `range` of them. Zones of `raised` go up by the difference to the
    default; `tangent_arc` has a zone that becomes an arc tangent to its neighbours, of
    one of `radii` for each of the values; with `slope` a straight zone turns about
    `pivot` (its start if not given), and what lies outward keeps to its end; with
    `move` a part of the shape moves in y by the difference to the default, see
    `part_moved`. `allow` lists junctions that are not smooth for other values than the
    default.
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
        """Parse the value written in `text`; None if it is not of this form."""
        prefix, suffix = map(re.escape, self.form.split("#"))
        match = re.fullmatch(rf"{prefix}\s*{_NUMBER}\s*{suffix}", text)
        return float(match[1]) if match else None

    def allows(self, value: float) -> bool:
        """Return True if the shape exists for this value."""
        return (
            value in self.values
            if self.range is None
            else self.range[0] <= value <= self.range[1]
        )


@dataclass(frozen=True)
class Definition:
    """Standard shape as a chain of segments with rising y, in mm.

    y rises from the flange back or the gauge side. A rail is upright, y from its
    symmetry axis, unless `inclined_gauge_y` is given.
    """

    name: str
    title: str  # designation of the standard
    kind: Kind
    segments: tuple[Segment, ...]
    source: str  # source of the numbers
    certainty: str  # certainty of the numbers
    allowances: tuple[
        Mapping[str, Any], ...
    ] = ()  # junctions that are not smooth, with the reason
    inclined_gauge_y: float | None = (
        None  # of a rail defined as it stands in the track: y of its gauge point
    )


def evaluate(definition: Definition, y: FloatArray) -> FloatArray:
    """Exact height z (n,) [m] of a definition at lateral positions y (n,) [m].

    A rail is not placed in the track. At a junction the segment on the field side
    counts.
    """
    y_mm = np.asarray(y, dtype=np.float64) * 1e3
    starts = np.array([piece.start for piece in definition.segments])
    # A position given in metres may miss the end by the rounding of the unit.
    which = np.clip(np.searchsorted(starts, y_mm, side="right") - 1, 0, None)
    z = np.empty_like(y_mm)
    for k, piece in enumerate(definition.segments):
        z[which == k] = piece.height(y_mm[which == k])
    return z * 1e-3


def sample(definition: Definition, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Points y, z [m] of a definition, equidistant in arc length within each segment.

    All junctions are included. Raises `ProfileError` for a spacing [m] that is not
    within 0.001 .. 2 mm.
    """
    if not 1e-6 <= spacing <= 2e-3:
        raise ProfileError(
            f"{definition.name}: point spacing = {1e3 * spacing:g} mm must be in 0.001 "
            ".. 2 mm"
        )
    y = [definition.segments[0].abscissae(spacing * 1e3)]
    y.extend(piece.abscissae(spacing * 1e3)[1:] for piece in definition.segments[1:])
    y_m = np.concatenate(y) * 1e-3
    return y_m, evaluate(definition, y_m)


class Template(NamedTuple):
    """Definition file before values of its parameters are chosen.

    Some of its segments are not yet constructed.
    """

    path: Path
    about: Mapping[str, Any]  # keys of the shape itself
    pieces: tuple[Segment | TangentArc, ...]  # pieces, including those of the base
    parameters: tuple[Parameter, ...]  # parameters, including those of the base


@lru_cache(maxsize=64)
def read_template(path: Path) -> Template:
    """Read a file of a standard shape, see the head of this module."""
    pieces: list[Segment | TangentArc] = []
    parameters: list[Parameter] = []
    try:
        about = tomllib.loads(path.read_text(encoding="utf-8"))
        if base := about.get("base"):
            base_template = read_template(path.with_name(f"{base['name']}.toml"))
            pieces = [
                piece for piece in base_template.pieces if piece.zone in base["zones"]
            ]
            parameters = [
                p for p in base_template.parameters if p.form in base["parameters"]
            ]
        if head := about.get("head"):
            pieces += rail_head(**head)
        pieces += [_piece(table) for table in about.get("segment", ())]
        parameters += [Parameter(**table) for table in about.get("parameter", ())]
        if not {"name", "kind", "source", "certainty"} <= about.keys() or not pieces:
            raise KeyError("name, kind, source, certainty and a shape are needed")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ProfileError(f"{path}: is no definition of a shape: {error}") from error
    return Template(path, about, tuple(pieces), tuple(parameters))


# Fine enough for the gauge point and the top of the densest arcs to be exact to 0.001
# um.
_PLACEMENT_SPACING = 0.02e-3


def shipped_path(*parts: str) -> Path:
    """Path of a file or folder of the package, such as ("profiles", "S1002.toml").

    In `wearsim/shipped` of an installed wheel, else in the checkout around the package;
    it need not exist.
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "shipped"
    return (installed if installed.is_dir() else package.parent).joinpath(*parts)


def find_shipped(name: str) -> Path:
    """File of a shipped profile by its name, with or without parameters.

    Raises the errors of `definition`.
    """
    return _found(name, None)[0].path


@lru_cache(maxsize=8)
def _templates(folder: Path) -> dict[str, Template]:
    """All shipped shapes by their names and other names."""
    named: dict[str, Template] = {}
    for path in sorted(folder.glob("*.toml")):
        template = read_template(path)
        for name in (template.about["name"], *template.about.get("aliases", ())):
            if name in named:
                raise ProfileError(
                    f"{path}: the name {name!r} is that of {named[name].path.name} "
                    "already"
                )
            named[name] = template
    return named


def shipped_names(kind: Kind) -> list[str]:
    """Sorted names and aliases of the shipped shapes of a kind, without parameters."""
    named = _templates(shipped_path("profiles"))
    return sorted(
        name for name, template in named.items() if template.about["kind"] == kind
    )


def _split(designation: str) -> tuple[Template, list[str]] | None:
    """Split a designation into shape and parameters.

    A name may contain a slash itself, such as 1/40.
    """
    named = _templates(shipped_path("profiles"))
    parts = [part.strip() for part in designation.split("/")]
    for count in range(len(parts), 0, -1):
        name = "/".join(parts[:count])
        if name in named:
            return named[name], parts[count:]
    return None


def _found(designation: str, kind: Kind | None) -> tuple[Template, list[str]]:
    """Shape and parameters of a designation, optionally of a required kind.

    A fault lists the names that exist.
    """
    named_shape = _split(designation)
    if named_shape is not None and kind in (None, named_shape[0].about["kind"]):
        return named_shape
    names = (
        shipped_names(kind)
        if kind
        else [*shipped_names("wheel"), *shipped_names("rail")]
    )
    what = f"neither a file nor a shipped {f'{kind} ' if kind else ''}profile"
    if named_shape is not None:
        what = f"a {named_shape[0].about['kind']} profile, a {kind} is needed"
    near = suggestion(designation.split("/")[0], names)
    raise ProfileError(f"{designation!r} is {what} ({', '.join(names)}){near}")


def is_designation(text: str) -> bool:
    """Return True if a text begins with the name of a shipped shape.

    Such a text is not a path.
    """
    return _split(text) is not None


def _parse_parameters(
    written: Sequence[str], parameters: Sequence[Parameter], designation: str
) -> dict[str, float]:
    """Parse the values of all parameters by form, from texts such as ("h30", "6.7%").

    All faults are reported in one line.
    """
    given: dict[str, float] = {}
    wrong = []
    for text in written:
        match = next(
            ((p, v) for p in parameters if (v := p.parse(text)) is not None), None
        )
        if match is None:
            forms = [f"{p.form} ({p.name} {p.range_text()})" for p in parameters]
            wrong.append(
                f"{text!r} is no parameter of it; there is {', '.join(forms) or 'none'}"
            )
            continue
        parameter, value = match
        if parameter.form in given:
            wrong.append(f"{parameter.name} is given twice")
        elif not parameter.allows(value):
            wrong.append(
                f"{parameter.name} = {value:g} must be {parameter.range_text()}"
            )
        given[parameter.form] = value
    if wrong:
        raise ProfileError(f"{designation}: {'; '.join(wrong)}")
    return {p.form: p.default for p in parameters} | given


def build(template: Template, values: Mapping[str, float]) -> Definition:
    """Build the shape of a file for values of its parameters (by form).

    Raises `ProfileError` with the file and the zones that do not fit together.
    """
    about, pieces = template.about, list(template.pieces)
    title, allowances = about.get("title", about["name"]), list(about.get("allow", ()))
    changed = [p for p in template.parameters if values[p.form] != p.default]
    try:
        for parameter in changed:
            pieces = _varied(pieces, parameter, values[parameter.form])
            allowances += parameter.allow
        chain = _constructed(pieces)
        for parameter in changed:
            if parameter.move is not None:
                by, move = values[parameter.form] - parameter.default, parameter.move
                chain = part_moved(
                    chain,
                    move["from"],
                    move["to"],
                    by,
                    move["join_zone"],
                    move["join_to"],
                )
        written = [p.form.replace("#", f"{values[p.form]:g}") for p in changed]
        name = "/".join((about["name"], *written))
        title = f"{title}; but {', '.join(written)}" if written else title
    except (ProfileError, AssertionError, IndexError) as error:
        raise ProfileError(f"{template.path}: is no shape: {error}") from error
    return Definition(
        name,
        title,
        about["kind"],
        chain,
        about["source"],
        about["certainty"],
        tuple(allowances),
        about.get("inclined_gauge_y"),
    )


def _varied(
    pieces: list[Segment | TangentArc], parameter: Parameter, value: float
) -> list[Segment | TangentArc]:
    """Apply the effects of a parameter to single zones."""
    by = value - parameter.default
    result: list[Segment | TangentArc] = []
    lift = 0.0
    for piece in pieces:
        new = piece
        if isinstance(new, Segment):
            if lift:
                new = new.moved(0.0, lift)
            if new.zone in parameter.raised:
                new = new.moved(0.0, by)
            turn = parameter.slope
            if (
                turn is not None
                and new.zone == turn["zone"]
                and isinstance(new, Polynomial)
            ):
                slope = -0.01 * value if turn["meaning"] == "percent" else -1.0 / value
                pivot = turn.get("pivot", new.start)
                sloped = replace(
                    new, origin=pivot, coefficients=(height_at(new, pivot), slope)
                )
                lift += height_at(sloped, new.end) - height_at(new, new.end)
                new = sloped
            arcs = parameter.tangent_arc
            if arcs is not None and new.zone == arcs["zone"] and isinstance(new, Arc):
                radius = arcs["radii"][parameter.values.index(value)]
                new = TangentArc(
                    zone=new.zone, radius=radius, branch=1 if new.branch > 0 else -1
                )
        result.append(new)
    return result


def _constructed(pieces: list[Segment | TangentArc]) -> tuple[Segment, ...]:
    """Insert tangent arcs and end their neighbours there."""
    chain = list(pieces)
    for k, piece in enumerate(chain):
        if isinstance(piece, TangentArc):
            before, after = chain[k - 1], chain[k + 1]
            assert isinstance(before, Arc)
            assert isinstance(after, Polynomial)
            arc = tangent_arc(piece.zone, before, after, piece.radius, piece.branch)
            chain[k - 1 : k + 2] = (
                before.between(before.start, arc.start),
                arc,
                after.between(arc.end, after.end),
            )
    done = tuple(piece for piece in chain if isinstance(piece, Segment))
    if not all(
        math.isfinite(end) for piece in done for end in (piece.start, piece.end)
    ):
        raise ProfileError("a zone has no beginning or no end; give from and to")
    return done


def definition(name: str, kind: Kind | None = None) -> Definition:
    """Definition of a shipped shape.

    Its name contains the parameters that differ from the file.

    A name such as "S1002" or "60E1". Parameters follow in any order behind slashes, as
    in the designation of EN 13715: "S1002/h30/e30.5/10%" has a flange height of 30 mm,
    a flange thickness of 30.5 mm and an outer slope of 10 %; what is left out keeps the
    value of the file ("S1002": 28, 32.5 and 6.7, which stands for 1:15). "cone/1:16" is
    a conical tread. Blanks around the slashes do not matter. Raises `ProfileError` if
    there is no such shape, none of the kind that is expected, or a parameter is out of
    its range; the message lists what there is and the nearest name.
    """
    template, written = _found(name, kind)
    values = _parse_parameters(written, template.parameters, repr(name))
    return _built(template.path, tuple(values.items()))


@lru_cache(maxsize=64)
def _built(path: Path, values: tuple[tuple[str, float], ...]) -> Definition:
    return build(read_template(path), dict(values))


def read_definition(path: Path) -> Definition:
    """Read a standard shape (TOML) with the default values of its parameters."""
    template = read_template(path)
    return build(template, {p.form: p.default for p in template.parameters})


def wheel(name: str, spacing: float = 0.25e-3) -> Profile:
    """Return a new standard wheel profile, from the flange back to the rim chamfer.

    Parameters
    ----------
    name : str
        Such as "S1002" or "S1002/h30/e30.5", see `definition`.
    spacing : float
        Distance of the points along the profile [m]; junctions of the definition are
        points.
    """
    shape = definition(name, "wheel")
    y, z = sample(shape, spacing)
    return Profile(shape.name, "wheel", y, z, shape.source)


def rail(
    name: str,
    inclination: float,
    gauge: float,
    half_span: float,
    spacing: float = 0.25e-3,
    gauge_height: float = GAUGE_DEPTH,
) -> Profile:
    """Return a standard rail head, inclined and placed in the track.

    Points are ordered from the gauge to the field side.

    Parameters
    ----------
    name : str
        Such as "60E1".
    inclination : float
        Tangent of the tilt towards the track centre, 1/40 for 1:40; 0 is upright [-]. A
        rail that is defined as it stands in the track (EN15302_rail_A) is not tilted,
        whatever is given here.
    gauge, half_span : float
        See `wearsim.profile.placement.place_rail`; z = 0 at the highest point, gauge
        point at y = gauge/2 - half_span. Where the definition names the gauge point
        itself, that point counts, unless the gauge height is another [m].
    spacing, gauge_height : float
        As of `wheel` and of `place_rail` [m].
    """
    shape = definition(name, "rail")
    gauge_y = shape.inclined_gauge_y
    fine = sample(shape, _PLACEMENT_SPACING)
    where = placement(
        *fine, inclination if gauge_y is None else 0.0, gauge, half_span, gauge_height
    )
    if gauge_y is not None and gauge_height == GAUGE_DEPTH:
        where = replace(where, shift_y=0.5 * gauge - half_span - 1e-3 * gauge_y)
    y, z = where.apply(*sample(shape, spacing))
    return Profile(shape.name, "rail", y, z, shape.source)
