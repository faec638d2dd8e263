"""Base of every table of a scene file: a model of exact types.

Tables as rows of CSV files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import (
    AfterValidator,
    Field,
    GetCoreSchemaHandler,
    PrivateAttr,
    ValidationError,
)
from pydantic.annotated_handlers import GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from wearsim.contact.registry import Registry
from wearsim.csv_tables import CsvTable, csv_table, unit_faults
from wearsim.errors import Fault, raise_any, shown
from wearsim.quantities import QUANTITIES
from wearsim.toml_faults import (
    KeyPath,
    Lines,
    Table,
    content_of,
    cross_check,
    decimal,
    nearest,
    suggestion,
    validation_faults,
)

_SI = {
    "_kN_m": (1e3, 1.0),
    "_percent": (1e-2, 1.0),
    "_km_h": (1.0, 3.6),
    "_mrad": (1e-3, 1.0),
    "_GPa": (1e9, 1.0),
    "_kN": (1e3, 1.0),
    "_km": (1e3, 1.0),
    "_mm": (1e-3, 1.0),
    "_um": (1e-6, 1.0),
    "_Nm": (1.0, 1.0),
    "_m": (1.0, 1.0),
    "_h": (3600.0, 1.0),
    "_kg": (1.0, 1.0),
}
"""Units at the end of keys, with the factor and the divisor that make SI of them."""

_ASCII = str.maketrans("µ²³", "u23")


def range_of(name: str) -> dict[str, Any]:
    """Input range of a quantity as arguments of `Field`."""
    low, high, above = QUANTITIES[name].range
    return {"gt" if above else "ge": low, "le": high}


def quantity(name: str, default: Any = ..., meaning: str = "") -> Any:
    """Field of a number with the unit and the range of a quantity.

    Its meaning is that of the quantity, too, where none is given.
    """
    definition = QUANTITIES[name]
    unit = definition.shown_unit.translate(_ASCII)
    return Field(
        default,
        description=meaning or f"the {definition.meaning}",
        json_schema_extra=None if unit in ("", "1") else {"unit": unit},
        **range_of(name),
    )


def text_field(meaning: str, default: Any = ...) -> Any:
    """Field of a text of 1 to 200 characters."""
    return Field(default, description=meaning, min_length=1, max_length=200)


def _printable(text: str) -> str:
    if not text.isprintable():  # results, reports and terminals show it
        raise PydanticCustomError(
            "out_of_range", "text", {"allowed": "one line of printable text"}
        )
    return text


Text = Annotated[str, AfterValidator(_printable)]


@dataclass(frozen=True, eq=False)
class Registered:
    """A name of a registry, of those records that pass."""

    registry: Registry[Any]
    passes: Callable[[Any], bool] = bool

    def names(self) -> list[str]:
        """Return the names at this moment: plug-ins add some."""
        return sorted(
            name for name, record in self.registry.items() if self.passes(record)
        )

    def check(self, name: str) -> str:
        """Return the name, or raise what becomes a fault with the nearest name."""
        names = self.names()
        if name in names:
            return name
        if name in self.registry.unusable:
            raise cross_check(self.registry.unknown(name).message)
        hint = suggestion(name, names)
        group = self.registry.group
        if group and name not in self.registry and not nearest(name, names):
            hint += (
                f"; a {self.registry.kind} that a script registers is known in that "
                "script alone: run and resume there, or make it a package with the "
                f"entry point {group} (workflows/plug_in)"
            )
        raise PydanticCustomError("unknown_name", "unknown name", {"hint": hint})

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Any:
        return {**handler(schema), "enum": self.names()}


def si_name(key: str) -> str:
    """Name of the value of a key in SI units: the key without its unit."""
    return key.removesuffix(_unit_suffix(key))


def _unit_suffix(key: str) -> str:
    """Return the unit at the end of a key, "" without one."""
    return next((unit for unit in _SI if key.endswith(unit)), "")


class Section(Table):
    """A table of the scene file.

    `not_here` holds hints on keys that people look for in it, `removed` messages on
    keys and values of earlier versions.
    """

    not_here: ClassVar[dict[str, str]] = {}
    removed: ClassVar[dict[str, str]] = {}
    # file and lines of a table that is a row of a CSV file
    _place: tuple[str, Lines] | None = PrivateAttr(None)

    def si(self) -> dict[str, Any]:
        """Values by key without its unit, numbers in SI units.

        Without None and lists of numbers.
        """
        values: dict[str, Any] = {}
        for key in type(self).model_fields:
            value, ending = getattr(self, key), _unit_suffix(key)
            if value is not None and not (ending and isinstance(value, tuple)):
                times, over = _SI.get(ending, (1, 1))
                values[si_name(key)] = value * times / over if ending else value
        return values


class SetPoints(Section):
    """What blocks, classes and segments of track have in common."""

    name: Text = text_field("a name for tables and figures")
    speed_km_h: float = quantity("speed", meaning="the speed")
    friction: float = quantity(
        "friction",
        meaning="Coulomb's coefficient of friction, on the tread if it is another "
        "there",
    )
    friction_flange: float | None = quantity("friction_flange", None)
    axle_torque_kN_m: float | None = Field(
        None,
        description="the torque on the axle, driving forward, by default that of "
        "[contact]",
        ge=-50.0,
        le=50.0,
        json_schema_extra={"unit": "kN m"},
    )
    environment: float = quantity(
        "environment",
        1.0,
        "the factor on the wear depth, 1 for dry laboratory coefficients",
    )


Messages = Iterator[tuple[KeyPath, str]]
"""Path of a key from the root of the scene, and message, of each fault or warning."""

Row = TypeVar("Row", bound=Section)


def read_rows(
    path: Path, model: type[Row], what: str, defaults: Mapping[str, Any] | None = None
) -> tuple[Row, ...]:
    """Read the rows of a CSV file, each a table of `model` with `defaults` if empty.

    Raises
    ------
    SceneError
        With all faults of the file, each with its line; also if it has no rows.
    """
    return validated_rows(csv_rows(path, what), str(path), model, what, defaults)


def csv_rows(path: Path, what: str) -> CsvTable:
    """Read a CSV file of tables, or raise a SceneError.

    The faults of its form are not raised.
    """
    file = str(path)
    return csv_table(content_of(path, f"a table of {what}s"), file, short=True)


def validated_rows(
    table: CsvTable,
    file: str,
    model: type[Row],
    what: str,
    defaults: Mapping[str, Any] | None = None,
    lines: Sequence[Lines] = (),
) -> tuple[Row, ...]:
    """Make tables of `model` of the rows of a CSV file, as `read_rows` does.

    Where values of rows come from elsewhere, `lines` has the lines of each row by key.
    """
    keys = list(model.model_fields)
    unknown = [name for name in table.header if name not in keys]
    texts = [
        f"column {shown(name)} is no key of a {what}; {suggestion(name, keys)}"
        for name in unknown
    ]
    faults = [*(Fault(text, file, table.line) for text in texts), *table.faults]
    faults += unit_faults(table, file, {name: name for name in table.header})
    rows = []
    for index, (line, cells) in enumerate(table.rows if not unknown else ()):
        at: Lines = lines[index] if lines else {(): line}
        named = zip(table.header, cells, strict=False)
        values = {name: _cell(name, cell) for name, cell in named if cell}
        try:
            rows.append(model.model_validate({**(defaults or {}), **values}))
            rows[-1]._place = file, at
        except ValidationError as error:
            faults += validation_faults(error, model, at, file)
    if not faults and not rows:
        message = (
            f"holds no {what}s; give a header with keys of {what}s and one row for each"
        )
        faults.append(Fault(message, file))
    raise_any(faults)
    return tuple(rows)


def _cell(name: str, text: str) -> Any:
    """Value of a cell: text, whole number, or decimal.

    What is neither stays text, which is a fault.
    """
    if name == "name":
        return text
    value = decimal(text)
    if math.isnan(value) and "nan" not in text.lower():
        return text
    return int(value) if name == "positions" and value.is_integer() else value
