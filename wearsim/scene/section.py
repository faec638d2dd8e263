"""Base of every table of a scene file: a model of exact types; fields with unit, range and meaning."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, PrivateAttr
from pydantic.annotated_handlers import GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from wearsim.quantities import QUANTITIES
from wearsim.toml_faults import Table, suggestion

_SI = {
    "_kN_m": (1e3, 1.0), "_percent": (1e-2, 1.0), "_km_h": (1.0, 3.6),
    "_mrad": (1e-3, 1.0), "_GPa": (1e9, 1.0), "_kN": (1e3, 1.0), "_km": (1e3, 1.0),
    "_mm": (1e-3, 1.0), "_um": (1e-6, 1.0), "_Nm": (1.0, 1.0), "_m": (1.0, 1.0),
    "_h": (3600.0, 1.0), "_kg": (1.0, 1.0),
}  # fmt: skip
"""Units at the end of keys, with the factor and the divisor that make SI of them."""

_ASCII = str.maketrans("µ²³", "u23")


def range_of(name: str) -> dict[str, Any]:
    """Input range of a quantity as arguments of `Field`."""
    low, high, above = QUANTITIES[name].range
    return {"gt" if above else "ge": low, "le": high}


def number(name: str, meaning: str = "", default: Any = ...) -> Any:
    """Field of a quantity: its unit, its limits and, where none is given, its meaning."""
    meaning = meaning or f"the {QUANTITIES[name].meaning}"
    unit = QUANTITIES[name].shown_unit.translate(_ASCII)
    extra: Any = {"unit": unit} if unit != "1" else None
    return Field(default, description=meaning, json_schema_extra=extra, **range_of(name))


def entries(meaning: str, most: int, default: Any = (), **more: Any) -> Any:
    """Field of a list of at most `most` values, a tuple in Python."""
    return Field(default, description=meaning, max_length=most, strict=False, **more)


def axle_torque(meaning: str, default: Any = ...) -> Any:
    """Field of a torque on an axle."""
    return Field(default, description=meaning, ge=-50.0, le=50.0, json_schema_extra={"unit": "kN m"})


def words(meaning: str, default: Any = ...) -> Any:
    """Field of a text of at most 200 characters."""
    return Field(default, description=meaning, min_length=1, max_length=200)


def _printable(text: str) -> str:
    if not text.isprintable():  # results, reports and terminals show it
        raise PydanticCustomError("out_of_range", "text", {"allowed": "one line of printable text"})
    return text


Text = Annotated[str, AfterValidator(_printable)]


@dataclass(frozen=True)
class Registered:
    """A name that must be one of those that `names` gives when it is checked."""

    names: Callable[[], Iterable[str]]

    def check(self, name: str) -> str:
        """Return the name, or raise what becomes a fault with the nearest name."""
        known = sorted(self.names())
        if name not in known:
            hint = suggestion(name, known)
            raise PydanticCustomError("unknown_name", "unknown name", {"hint": hint})
        return name

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> Any:
        return {**handler(schema), "enum": sorted(self.names())}


class Section(Table):
    """A table of the scene file; `not_here` holds hints on keys that people look for in it."""

    not_here: ClassVar[dict[str, str]] = {}
    _place: tuple[str, int] | None = PrivateAttr(None)  # file and line of a table that is a row of a CSV file

    def si(self) -> dict[str, Any]:
        """Values by key without its unit, numbers in SI units; without None and lists of numbers."""
        values: dict[str, Any] = {}
        for key in type(self).model_fields:
            value, ending = getattr(self, key), next((unit for unit in _SI if key.endswith(unit)), "")
            if value is not None and not (ending and isinstance(value, tuple)):
                times, over = _SI.get(ending, (1, 1))
                values[key.removesuffix(ending)] = value * times / over if ending else value
        return values


class SetPoints(Section):
    """What blocks, classes and segments of track have in common."""

    name: Text = words("a name for tables and figures")
    speed_km_h: float = number("speed", "the speed")
    friction: float = number(
        "friction", "Coulomb's coefficient of friction, on the tread if it is another there"
    )
    friction_flange: float | None = number("friction_flange", default=None)
    axle_torque_kN_m: float | None = axle_torque(
        "the torque on the axle, driving forward, by default that of [contact]", None
    )
    environment: float = number(
        "environment", "the factor on the wear depth, 1 for dry laboratory coefficients", 1.0
    )
