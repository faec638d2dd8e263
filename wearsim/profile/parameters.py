"""Parameters of standard shapes: flange height, flange thickness, slopes, as people write them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from wearsim.errors import ProfileError
from wearsim.profile.definition import Allowance

_NUMBER = r"([0-9]{1,4}(?:\.[0-9]{1,6})?)"


@dataclass(frozen=True)
class Slope:
    """A straight zone turns; what lies further to the field side keeps to its end.

    Parameters
    ----------
    zone : str
        Which one.
    meaning : {"percent", "one_in"}
        Whether the value is a fall in per cent or the N of 1:N.
    pivot : float, optional
        Where the height stays [mm]; None: at the start of the zone.
    """

    zone: str
    meaning: Literal["percent", "one_in"]
    pivot: float | None


@dataclass(frozen=True)
class Move:
    """A part of the shape moves in y by the difference to the default, see `part_moved`; lengths in mm."""

    start: float
    end: float
    join_zone: str
    join_end: float


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape; an effect takes place only if the value is not the default.

    Parameters
    ----------
    form : str
        How it is written, # for the number: "h#", "e#", "#%", "1:#".
    name, unit : str
        In words.
    default : float
        The value of the numbers in the file.
    values : tuple of float
        All values there are; empty if any within `limits` will do.
    limits : tuple of float
        Smallest and largest value.
    raised : tuple of str
        Zones that go up by the difference to the default [mm].
    tangent_zone : str
        Zone that becomes an arc tangent to its neighbours ...
    tangent_radii : tuple of float
        ... of this radius for each of `values` [mm].
    slope : Slope, optional
        Zone that turns.
    move : Move, optional
        Part that moves.
    allowances : tuple of Allowance
        Junctions that are not smooth for other values than the default.
    """

    form: str
    name: str
    unit: str
    default: float
    values: tuple[float, ...]
    limits: tuple[float, float]
    raised: tuple[str, ...] = ()
    tangent_zone: str = ""
    tangent_radii: tuple[float, ...] = ()
    slope: Slope | None = None
    move: Move | None = None
    allowances: tuple[Allowance, ...] = ()

    def range_text(self) -> str:
        """Return the allowed values in words."""
        unit = f" {self.unit}" if self.unit else ""
        if self.values:
            return f"one of {', '.join(f'{v:g}' for v in self.values)}{unit}"
        return f"in {self.limits[0]:g} .. {self.limits[1]:g}{unit}"

    def parse(self, text: str) -> float | None:
        """Return the value written in `text`, None if it is not of this form."""
        prefix, suffix = map(re.escape, self.form.split("#"))
        match = re.fullmatch(rf"{prefix}\s*{_NUMBER}\s*{suffix}", text)
        return float(match[1]) if match else None

    def allows(self, value: float) -> bool:
        """Tell whether there is a shape of this value."""
        if self.values:
            return value in self.values
        return math.isfinite(value) and self.limits[0] <= value <= self.limits[1]


def parse_parameters(
    written: Sequence[str], parameters: Sequence[Parameter], designation: str
) -> dict[str, float]:
    """Values of the parameters of a designation.

    Parameters
    ----------
    written : sequence of str
        Such as ("h30", "e30.5", "6.7%"), in any order.
    parameters : sequence of Parameter
        What the shape has.
    designation : str
        The whole, for messages.

    Returns
    -------
    dict
        Value by form of all parameters.

    Raises
    ------
    ProfileError
        Something is not a parameter of the shape, is given twice or out of range; one line for all.
    """
    values = {p.form: p.default for p in parameters}
    seen: set[str] = set()
    wrong = []
    for text in written:
        match = next(((p, v) for p in parameters if (v := p.parse(text)) is not None), None)
        if match is None:
            forms = [f"{p.form} ({p.name} {p.range_text()})" for p in parameters]
            wrong.append(f"{text!r} is no parameter of it; there is {', '.join(forms) or 'none'}")
            continue
        parameter, value = match
        if parameter.form in seen:
            wrong.append(f"{parameter.name} is given twice")
        elif not parameter.allows(value):
            wrong.append(f"{parameter.name} = {value:g} must be {parameter.range_text()}")
        seen.add(parameter.form)
        values[parameter.form] = value
    if wrong:
        raise ProfileError(f"{designation}: {'; '.join(wrong)}")
    return values


def canonical_suffix(values: Mapping[str, float], parameters: Sequence[Parameter]) -> str:
    """Write the values that are not the default, such as "/h30/e30.5", in the order of the file."""
    changed = [p.form.replace("#", f"{values[p.form]:g}") for p in parameters if values[p.form] != p.default]
    return "".join(f"/{text}" for text in changed)
