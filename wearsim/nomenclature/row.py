"""One row of the table of quantities, and what rows of several rooms share."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One quantity of the field.

    Parameters
    ----------
    name : str
        As in result files, in JSON and as the Python name.
    symbol : str
        As in the literature, Unicode.
    unit : str
        SI unit in UDUNITS form, "1" for ratios, "" for names and flags.
    shown_unit : str
        Unit people read.
    shown_factor : float
        Shown value = stored value * factor.
    meaning : str
        One short phrase; the `long_name` of result files.
    sign : str
        Sign convention or further remark, where there is one; the `comment` of result files.
    """

    name: str
    symbol: str
    unit: str
    shown_unit: str
    shown_factor: float
    meaning: str
    sign: str = ""

    @property
    def label(self) -> str:
        """Axis label: meaning, symbol and shown unit."""
        unit = f" [{self.shown_unit}]" if self.shown_unit not in ("", "1") else ""
        return f"{self.meaning} {self.symbol}{unit}" if self.symbol else f"{self.meaning}{unit}"


# unit -> shown unit and factor where nothing better is said in the row
_SHOWN = {
    "": ("", 1.0),
    "1": ("1", 1.0),
    "m": ("mm", 1e3),
    "m2": ("mm²", 1e6),
    "m2 m-1": ("mm²/1000 km", 1e12),
    "m m-1": ("µm/1000 km", 1e12),
    "m-1": ("1/m", 1.0),
    "rad": ("mrad", 1e3),
    "rad s-1": ("rad/s", 1.0),
    "N": ("kN", 1e-3),
    "N m": ("N m", 1.0),
    "Pa": ("MPa", 1e-6),
    "W": ("W", 1.0),
    "kg": ("kg", 1.0),
    "J m-3": ("kJ/m³", 1e-3),
    "m s-1": ("km/h", 3.6),
}
PER_KM = ("1/1000 km", 1e6)

KM = ("km", 1e-3)
MICRON = ("µm", 1e6)
PER_MILLE = ("10⁻³", 1e3)
INDEX = ("N/mm²", 1e-6)

LATERAL = "positive to the field side, 0 at the origin line of the wheel profile"
ON_WHEEL = "acting on the wheel, in the contact frame, x rolling direction, y right, z down"

Row = tuple[str, str, str, str, str, tuple[str, float] | None]
"""Name, symbol, unit, meaning, sign convention, (shown unit, factor) where it differs from the usual one."""


def quantity(row: Row) -> Quantity:
    """Return the quantity of a row.

    Parameters
    ----------
    row : Row
        Of one of the tables.
    """
    name, symbol, unit, meaning, sign, shown = row
    shown_unit, factor = shown if shown is not None else _SHOWN[unit]
    return Quantity(name, symbol, unit, shown_unit, factor, meaning, sign)


def percent(share: float) -> str:
    """Write a share with two digits, or to the whole per cent above that, never with an exponent.

    Parameters
    ----------
    share : float
        1 is 100 % [-].
    """
    value = 100.0 * share
    if 0.0 < abs(value) < 1e-3:
        return "less than 0.001 %"
    return f"{value:.2g} %" if abs(value) < 99.5 else f"{value:.0f} %"
