"""A coefficient set as it was published."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Coefficient:
    """One number of a publication.

    Parameters
    ----------
    value : float
        As printed.
    unit : str
        As printed.
    place : str
        Where it stands, or by which route it reached us.
    certainty : str
        How well it is known: "printed" was read in the publication itself, "confirmed" in two sources
        that quote it, "derived" follows from other numbers here, "uncertain" rests on one quotation.
    """

    value: float
    unit: str
    place: str
    certainty: str


@dataclass(frozen=True)
class CoefficientSet:
    """All numbers one wear law takes from one publication.

    Parameters
    ----------
    name : str
        Key in `COEFFICIENT_SETS`.
    laws : tuple of str
        Wear laws the set belongs to.
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
    """

    name: str
    laws: tuple[str, ...]
    materials: str
    source: str
    validity: str
    departures: tuple[str, ...]
    values: Mapping[str, Coefficient]

    def __getitem__(self, symbol: str) -> float:
        """Return the value of `symbol` in its printed unit."""
        return self.values[symbol].value
