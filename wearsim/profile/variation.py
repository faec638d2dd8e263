"""Standard shapes for values of their parameters: what varies is changed, what is tangent is constructed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from wearsim.errors import Fault, ProfileError
from wearsim.profile.construction import height_at, part_moved, tangent_arc
from wearsim.profile.definition import Definition, junction_faults
from wearsim.profile.parameters import Parameter, canonical_suffix
from wearsim.profile.segment import Arc, Polynomial, Segment


@dataclass(frozen=True)
class TangentArc:
    """An arc that is yet to be constructed from its neighbours."""

    zone: str
    radius: float
    branch: int


@dataclass(frozen=True)
class Template:
    """What a file says, before values of the parameters are chosen.

    Parameters
    ----------
    path : Path
        The file.
    definition : Definition
        Name, source and the like, without segments.
    aliases : tuple of str
        Other names of the shape.
    pieces : tuple
        Segments, some of them yet to be constructed.
    parameters : tuple of Parameter
        What can be varied.
    """

    path: Path
    definition: Definition
    aliases: tuple[str, ...]
    pieces: tuple[Segment | TangentArc, ...]
    parameters: tuple[Parameter, ...]


def build(template: Template, values: Mapping[str, float]) -> Definition:
    """Shape of a file for values of its parameters.

    Parameters
    ----------
    template : Template
        From a file.
    values : mapping
        Value by form of all its parameters.

    Returns
    -------
    Definition
        Junctions checked.

    Raises
    ------
    ProfileError
        With the file and the zones that do not fit together.
    """
    pieces = list(template.pieces)
    allowances = template.definition.allowances
    changed = [p for p in template.parameters if values[p.form] != p.default]
    try:
        for parameter in changed:
            pieces = _varied(pieces, parameter, values[parameter.form])
            allowances += parameter.allowances
        chain = _constructed(pieces)
        for parameter in changed:
            if parameter.move is not None:
                by, move = values[parameter.form] - parameter.default, parameter.move
                chain = part_moved(chain, move.start, move.end, by, move.join_zone, move.join_end)
        about = template.definition
        suffix = canonical_suffix(values, template.parameters)
        title = f"{about.title}; but {suffix[1:].replace('/', ', ')}" if suffix else about.title
        definition = replace(
            about, name=about.name + suffix, title=title, segments=tuple(chain), allowances=allowances
        )
        faults = junction_faults(definition)
        if faults:
            raise ProfileError("; ".join(faults))
    except ProfileError as error:
        raise ProfileError(str(Fault(str(error), str(template.path)))) from error
    return definition


def _varied(
    pieces: list[Segment | TangentArc], parameter: Parameter, value: float
) -> list[Segment | TangentArc]:
    """Effects of a parameter on single zones."""
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
            if turn is not None and new.zone == turn.zone and isinstance(new, Polynomial):
                slope = -0.01 * value if turn.meaning == "percent" else -1.0 / value
                pivot = new.start if turn.pivot is None else turn.pivot
                turned = replace(new, origin=pivot, coefficients=(height_at(new, pivot), slope))
                lift += height_at(turned, new.end) - height_at(new, new.end)
                new = turned
            if new.zone == parameter.tangent_zone and isinstance(new, Arc):
                new = TangentArc(new.zone, parameter.tangent_radii[parameter.values.index(value)], new.branch)
        result.append(new)
    return result


def _constructed(pieces: list[Segment | TangentArc]) -> tuple[Segment, ...]:
    """Put tangent arcs in their places and end their neighbours there."""
    chain = list(pieces)
    for k, piece in enumerate(chain):
        if isinstance(piece, TangentArc):
            before = chain[k - 1] if k > 0 else None
            after = chain[k + 1] if k + 1 < len(chain) else None
            if not isinstance(before, Segment) or not isinstance(after, Segment):
                raise ProfileError(f"zone {piece.zone!r} needs an arc or a line on both sides")
            arc = tangent_arc(piece.zone, before, after, piece.radius, piece.branch)
            chain[k - 1] = before.between(before.start, arc.start)
            chain[k] = arc
            chain[k + 1] = after.between(arc.end, after.end)
    done = tuple(piece for piece in chain if isinstance(piece, Segment))
    for piece in done:
        if not (math.isfinite(piece.start) and math.isfinite(piece.end)):
            raise ProfileError(f"zone {piece.zone!r} has no beginning or no end; give from and to")
    return done
