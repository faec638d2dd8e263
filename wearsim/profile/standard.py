"""Standard shapes, computed from their definitions: arcs, polynomials and lines in shipped TOML files."""

from __future__ import annotations

import difflib
import math
import tomllib
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.placement import Placement, placement
from wearsim.profile.shape import FloatArray, Profile

# Fine enough for the gauge point and the top of the densest arcs to be exact to 0.001 um.
_PLACEMENT_SPACING = 0.02e-3


@dataclass(frozen=True)
class Segment:
    """One piece of a definition, z as a function of y; lengths in mm as printed in the standards.

    Parameters
    ----------
    zone : str
        Its letter in the standard.
    start, end : float
        Lateral range, start < end [mm].
    coefficients : tuple of float
        Of z = sum c_k y^k (empty for an arc).
    centre : tuple of float
        Centre (y, z) of an arc [mm].
    radius : float
        Of an arc, 0 for a polynomial [mm].
    branch : int
        Sign of the root in z = centre_z + branch * sqrt(radius^2 - (y - centre_y)^2).
    """

    zone: str
    start: float
    end: float
    coefficients: tuple[float, ...] = ()
    centre: tuple[float, float] = (0.0, 0.0)
    radius: float = 0.0
    branch: int = 1

    def height(self, y: FloatArray) -> FloatArray:
        """Return z [mm] at y [mm]."""
        if self.radius > 0.0:
            root = np.sqrt(np.maximum(self.radius**2 - (y - self.centre[0]) ** 2, 0.0))
            return self.centre[1] + self.branch * root
        z = np.zeros_like(y)
        for c in reversed(self.coefficients):  # Horner: zone C of S1002 cancels terms of 4e3 to 5
            z = z * y + c
        return z

    def angle(self, y: FloatArray) -> FloatArray:
        """Return the tangent angle [rad] at y [mm]; +-pi/2 where an arc ends vertically."""
        if self.radius > 0.0:
            sine = np.clip((y - self.centre[0]) / self.radius, -1.0, 1.0)
            return np.asarray(-self.branch * np.arcsin(sine))
        slope = np.zeros_like(y)
        for k in range(len(self.coefficients) - 1, 0, -1):
            slope = slope * y + k * self.coefficients[k]
        return np.arctan(slope)

    def abscissae(self, spacing: float) -> FloatArray:
        """Return y [mm] of points at even arc length, about `spacing` [mm] apart, both ends included."""
        if self.radius > 0.0:
            a0, a1 = np.arcsin(
                np.clip((np.array([self.start, self.end]) - self.centre[0]) / self.radius, -1, 1)
            )
            count = max(1, round(self.radius * (a1 - a0) / spacing))
            y = self.centre[0] + self.radius * np.sin(np.linspace(a0, a1, count + 1))
        else:
            fine = np.linspace(self.start, self.end, 2001)
            stretch = 1.0 / np.cos(self.angle(fine))
            s = np.concatenate(([0.0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]) * np.diff(fine))))
            count = max(1, round(s[-1] / spacing))
            y = np.interp(np.linspace(0.0, s[-1], count + 1), s, fine)
        y[0], y[-1] = self.start, self.end
        return np.asarray(y)


@dataclass(frozen=True)
class Definition:
    """A standard shape as a chain of segments with rising y.

    Parameters
    ----------
    name, title : str
        Short name (of the file) and the standard's designation.
    kind : {"wheel", "rail"}
        A rail is upright, y from its symmetry axis.
    segments : tuple of Segment
        From the flange back (wheel) or the gauge side (rail) to the field side.
    source, certainty : str
        Where the numbers come from, and how sure they are.
    """

    name: str
    title: str
    kind: Literal["wheel", "rail"]
    segments: tuple[Segment, ...]
    source: str
    certainty: str


def shipped_path(*parts: str) -> Path:
    """Path of a file or folder that comes with the package.

    Parameters
    ----------
    *parts : str
        Path below the shipped files, such as ("profiles", "S1002.toml").

    Returns
    -------
    Path
        In `wearsim/shipped` of an installed wheel, else in the checkout around the package; it need
        not exist.
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "shipped"
    return (installed if installed.is_dir() else package.parent).joinpath(*parts)


def find_shipped(kind_dir: str, name: str) -> Path:
    """File of a shipped thing by its name.

    Parameters
    ----------
    kind_dir : str
        Folder of the shipped files: "profiles" or "workflows".
    name : str
        File name without ".toml".

    Returns
    -------
    Path
        The existing file.

    Raises
    ------
    ProfileError
        There is no such file; the message lists what there is and the nearest name.
    """
    names = sorted(path.stem for path in shipped_path(kind_dir).glob("*.toml"))
    if name not in names:
        raise ProfileError(_unknown(f"{name!r} is not among the shipped {kind_dir}", name, names))
    return shipped_path(kind_dir, f"{name}.toml")


def _unknown(message: str, name: str, names: list[str]) -> str:
    """End a message about an unknown name with what there is."""
    by_lower = {known.lower(): known for known in names}
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=1, cutoff=0.5)
    hint = f"; did you mean {by_lower[near[0]]!r}?" if near else ""
    return f"{message} ({', '.join(names) or 'none found'}){hint}"


def read_definition(path: Path) -> Definition:
    """Read the definition of a standard shape.

    Parameters
    ----------
    path : Path
        TOML file with `name`, `kind`, `source` and either `[[segment]]` tables (arc or polynomial) or
        a `[head]` of tangent arcs.

    Returns
    -------
    Definition
        Lengths in mm, as in the file.
    """
    with path.open("rb") as file:
        data = tomllib.load(file)
    segments = _tangent_head(data["head"]) if "head" in data else tuple(map(_segment, data["segment"]))
    return Definition(
        name=data["name"],
        title=data.get("title", data["name"]),
        kind=data["kind"],
        segments=segments,
        source=data["source"],
        certainty=data["certainty"],
    )


def _segment(table: dict[str, Any]) -> Segment:
    """One `[[segment]]` table."""
    piece = Segment(table.get("zone", ""), float(table["from"]), float(table["to"]))
    if "polynomial" in table:
        return replace(piece, coefficients=tuple(map(float, table["polynomial"])))
    arc = table["arc"]
    y, z = map(float, arc["centre"])
    return replace(piece, centre=(y, z), radius=float(arc["radius"]), branch=int(arc["branch"]))


def _tangent_head(head: dict[str, Any]) -> tuple[Segment, ...]:
    """Rail head of tangent arcs from radii, junction widths and the slope of the sides [mm].

    At a junction both centres lie on one normal, so the centre moves along it by the difference of the
    radii; the last arc ends where its tangent has the slope of the side.
    """
    radii = [float(r) for r in head["radii"]]
    half_widths = [0.5 * float(w) for w in head["junction_widths"]]
    side, depth = float(head["side"]), float(head["side_depth"])
    centre = (0.0, radii[0])
    half, start = [], 0.0
    for k, radius in enumerate(radii):
        sine = (half_widths[k] - centre[0]) / radius if k < len(half_widths) else side / math.hypot(side, 1.0)
        end = centre[0] + radius * sine
        half.append(Segment(f"R{radius:g}", start, end, centre=centre, radius=radius, branch=-1))
        start = end
        if k + 1 < len(radii):
            step = radius - radii[k + 1]
            centre = (centre[0] + step * sine, centre[1] - step * math.sqrt(1.0 - sine**2))
    z_end = float(half[-1].height(np.array([start]))[0])
    half.append(Segment("side", start, start + (depth - z_end) / side, (z_end - side * start, side)))
    crown = replace(half[0], start=-half[0].end)
    return (*(_mirrored(piece) for piece in reversed(half[1:])), crown, *half[1:])


def _mirrored(piece: Segment) -> Segment:
    """Return the segment with y reversed."""
    odd_reversed = tuple(c * (-1.0) ** k for k, c in enumerate(piece.coefficients))
    return replace(
        piece,
        start=-piece.end,
        end=-piece.start,
        coefficients=odd_reversed,
        centre=(-piece.centre[0], piece.centre[1]),
    )


def evaluate(definition: Definition, y: FloatArray) -> FloatArray:
    """Exact profile height of a definition.

    Parameters
    ----------
    definition : Definition
        Standard shape (a rail is upright).
    y : (n,) array
        Lateral positions [m]; at a junction the segment on the field side counts.

    Returns
    -------
    (n,) array
        z in the axes of `Profile` [m].
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
    """Misclosure of a definition at the junctions of its segments.

    Parameters
    ----------
    definition : Definition
        Standard shape.

    Returns
    -------
    y, step, kink : (n - 1,) array
        Place [m], jump of z [m] and of the tangent angle [rad], field side minus flange or gauge side.
    """
    pairs = list(zip(definition.segments[:-1], definition.segments[1:], strict=True))
    y = np.array([right.start for _, right in pairs])
    step, kink = np.empty_like(y), np.empty_like(y)
    for k, (left, right) in enumerate(pairs):
        at = y[k : k + 1]
        step[k] = (right.height(at) - left.height(at))[0]
        kink[k] = (right.angle(at) - left.angle(at))[0]
    return y * 1e-3, step * 1e-3, kink


def sample(definition: Definition, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Points on a definition at even arc length within each segment, all junctions included.

    Parameters
    ----------
    definition : Definition
        Standard shape.
    spacing : float
        Wanted distance of the points [m].

    Returns
    -------
    y, z : (n,) array
        Points [m].
    """
    if not 1e-6 <= spacing <= 2e-3:
        raise ProfileError(
            f"{definition.name}: point spacing = {spacing * 1e3:g} mm must be in 0.001 .. 2 mm"
        )
    y = [definition.segments[0].abscissae(spacing * 1e3)]
    y.extend(piece.abscissae(spacing * 1e3)[1:] for piece in definition.segments[1:])
    y_m = np.concatenate(y) * 1e-3
    return y_m, evaluate(definition, y_m)


@lru_cache(maxsize=32)
def _shipped(path: Path) -> Definition:
    return read_definition(path)


def definition(name: str, kind: Literal["wheel", "rail"]) -> Definition:
    """Definition of a shipped shape.

    Parameters
    ----------
    name : str
        Such as "S1002" or "60E1".
    kind : {"wheel", "rail"}
        What is expected.

    Returns
    -------
    Definition
        Lengths in mm.
    """
    every = [_shipped(path) for path in sorted(shipped_path("profiles").glob("*.toml"))]
    names = [shape.name for shape in every if shape.kind == kind]
    for shape in every:
        if shape.name == name and shape.kind == kind:
            return shape
        if shape.name == name:
            raise ProfileError(
                _unknown(f"{name!r} is a {shape.kind} profile, a {kind} is needed", name, names)
            )
    raise ProfileError(_unknown(f"{name!r} is neither a file nor a shipped {kind} profile", name, names))


def wheel(name: str, spacing: float = 0.25e-3) -> Profile:
    """Return a standard wheel profile, new.

    Parameters
    ----------
    name : str
        Such as "S1002".
    spacing : float
        Wanted distance of the points along the profile [m]; junctions of the definition are points.

    Returns
    -------
    Profile
        From the flange back to the end of the rim chamfer.
    """
    shape = definition(name, "wheel")
    y, z = sample(shape, spacing)
    return Profile(name, "wheel", y, z, shape.source)


def rail(name: str, inclination: float, gauge: float, half_span: float, spacing: float = 0.25e-3) -> Profile:
    """Return a standard rail head, inclined and placed in the track.

    Parameters
    ----------
    name : str
        Such as "60E1".
    inclination : float
        Tangent of the tilt towards the track centre, 1/40 for 1:40; 0 is upright [-].
    gauge : float
        Distance of the gauge points of both rails [m].
    half_span : float
        From the track centre to the origin of the wheel profile [m].
    spacing : float
        Wanted distance of the points along the profile [m]; junctions of the definition are points.

    Returns
    -------
    Profile
        From the gauge side to the field side; z = 0 at the highest point, gauge point at
        y = gauge/2 - half_span.
    """
    shape = definition(name, "rail")
    where: Placement = placement(*sample(shape, _PLACEMENT_SPACING), inclination, gauge, half_span)
    y, z = where.apply(*sample(shape, spacing))
    return Profile(name, "rail", y, z, shape.source)
