"""Coefficient sets of wear and fatigue laws, as published."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from wearsim.errors import Fault, SceneError, raise_any, shown, suggestion

_MARKED = ("recalled", "uncertain")
MOST_CHANGE = 100.0
"""Largest factor between a published value and its replacement.

Wrong units would give a factor of 1000.
"""
SCALE = "wear.scale"
"""Name of the factor on depths among the numbers of a set.

It is the key of the scene, not a symbol.
"""


@dataclass(frozen=True)
class Coefficient:
    """One number of a publication.

    Parameters
    ----------
    value : float
        As printed; of a printed range, the one we take.
    unit : str
        As printed.
    place : str
        Where it stands, or by which route it reached us.
    certainty : str
        How well it is known: "printed" was read in the publication itself, "confirmed"
        in two sources that quote it, "derived" follows from other numbers here, "given"
        is the user's own, "recalled" is well known and plausible, but the publication
        was not read again, "uncertain" rests on one quotation, or sources disagree.
    limits : two floats, optional
        Range as printed.
    allowed : two floats, optional
        Range of values in place of the published one; None: a hundredth to a hundred
        times that.
    """

    value: float
    unit: str
    place: str
    certainty: str
    limits: Sequence[float] | None = None
    allowed: Sequence[float] | None = None

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest value that may replace the published one."""
        if self.allowed is not None:
            return self.allowed[0], self.allowed[1]
        low, high = sorted((self.value / MOST_CHANGE, self.value * MOST_CHANGE))
        return low, high

    @property
    def unit_after(self) -> str:
        """Unit after a number in a text."""
        return "" if self.unit == "-" else f" {self.unit}"


@dataclass(frozen=True)
class CoefficientSet:
    """Coefficients of one damage law from one publication.

    Parameters
    ----------
    name : str
        Key in its registry.
    laws : tuple of str
        Damage laws the set belongs to.
    materials : str
        Wheel and rail steel, and the state of the surfaces.
    source : str
        The publication, in full.
    validity : str
        Tests the numbers rest on, and where using them is an extrapolation.
    departures : tuple of str
        Where our law differs from the printed one, and why.
    values : mapping of str to Coefficient
        The numbers by symbol.
    tested_up_to : mapping of str to float
        Largest values in the tests, by variable of the result file [SI]; empty where
        they are not known.
    certainty : str
        Of a set of the user's own: how sure it is, in their words; empty for published
        sets.
    title : str
        Name in texts: authors and year; by default `name`.
    """

    name: str
    laws: tuple[str, ...]
    materials: str
    source: str
    validity: str
    departures: tuple[str, ...]
    values: Mapping[str, Coefficient]
    tested_up_to: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    certainty: str = field(default="", kw_only=True)
    title: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        named = f'coefficient set "{self.name}"'
        faults = []
        if isinstance(self.laws, str):
            faults.append(
                f"{named}: laws = {self.laws!r} must be a tuple of names, such as "
                f'("{self.laws}",)'
            )
        if isinstance(self.departures, str):
            faults.append(f"{named}: departures must be a tuple of texts, () for none")
        for symbol, coefficient in self.values.items():
            if not (
                isinstance(coefficient, Coefficient)
                and _is_number(coefficient.value)
                and not math.isnan(coefficient.value)
            ):
                faults.append(
                    f"{named}: {symbol} must be a Coefficient, whose value is a number"
                )
        raise_any([Fault(text) for text in faults])
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))

    def __getstate__(self) -> dict[str, Any]:
        return {
            **vars(self),
            "values": dict(self.values),
        }  # a mapping proxy cannot be pickled for another process

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, values=MappingProxyType(state["values"]))

    def __getitem__(self, symbol: str) -> float:
        """Return the value of `symbol` in its printed unit, or raise a SceneError."""
        if symbol not in self.values:
            raise SceneError([self._without(symbol)])
        return self.values[symbol].value

    def _without(self, symbol: str) -> Fault:
        symbols = ", ".join(self.values) or "none"
        near = suggestion(symbol, self.values)
        return Fault(
            f'{symbol} is no value of coefficients = "{self.name}", which has '
            f"{symbols}{near}"
        )

    @property
    def uncertain(self) -> tuple[str, ...]:
        """List each number that reports mark, such as "k_mild = 0.0005 (uncertain)".

        A user's own set is marked as a whole, with the certainty its author states.
        """
        if self.certainty:
            return (f"{self.name}: given by the user, who says: {self.certainty}",)
        return tuple(
            (
                f"{symbol} = "
                f"{number.value:g}{number.unit_after}{_range(number.limits)} "
                f"({number.certainty})"
            )
            for symbol, number in self.values.items()
            if number.certainty in _MARKED
        )

    @property
    def numbers(self) -> tuple[str, ...]:
        """List all numbers in force, such as "hardness = 3 GPa".

        They distinguish two sets of the same name.
        """
        return tuple(
            f"{symbol} = {number.value:.10g}{number.unit_after}"
            for symbol, number in self.values.items()
        )

    def value_fault(self, symbol: str, value: float) -> Fault | None:
        """Return the fault of a value that replaces a published one, or None.

        A fault is an unknown symbol or a value out of its range.
        """
        if symbol not in self.values:
            return self._without(symbol)
        old = self.values[symbol]
        low, high = old.range
        if _is_number(value) and low <= value <= high:
            return None
        allowed = f"at least {low:.4g} and at most {high:.4g}{old.unit_after}"
        published = f"{old.value:g}{old.unit_after}"
        return Fault(
            f"{symbol} = {shown(value)} must be {allowed}; the published value is "
            f"{published}"
        )

    def scaled(self, scale: float, place: str) -> CoefficientSet:
        """Return the set with a note that its depths are multiplied by a factor.

        `place` names the place where the factor is given.
        """
        values = {**self.values, SCALE: Coefficient(scale, "-", place, "given")}
        change = f"Depths are multiplied by {scale:g} ({place})."
        return replace(self, departures=(*self.departures, change), values=values)

    def with_value(self, symbol: str, value: float, place: str) -> CoefficientSet:
        """Return the set with a new value of one number, in the unit of that number.

        The departures of the set record the change.

        `place` names the origin of the value.
        """
        old = self.values[symbol]
        values = {
            **self.values,
            symbol: replace(old, value=value, place=place, certainty="given"),
        }
        change = f"{symbol} = {value:g} {old.unit} ({place}) in place of {old.value:g}."
        return replace(self, departures=(*self.departures, change), values=values)


def given_set(
    name: str,
    law: str,
    values: Mapping[str, tuple[float, str]],
    source: str,
    validity: str,
    sure: str = "",
) -> CoefficientSet:
    """Return a user's own coefficient set of a law, built from values with their units.

    `sure` is the certainty of the values.
    """
    numbers = {
        symbol: Coefficient(value, unit, source, "given")
        for symbol, (value, unit) in values.items()
    }
    return CoefficientSet(
        name, (law,), "as given", source, validity, (), numbers, certainty=sure
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _range(limits: Sequence[float] | None) -> str:
    if limits is None or not math.isfinite(limits[1]):
        return ""
    return f", range {limits[0]:g} to {limits[1]:g}"
