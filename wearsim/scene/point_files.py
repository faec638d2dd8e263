"""Keys on files of points, the same in all tables that name such files."""

from __future__ import annotations

from typing import Annotated, TypeVar, cast

from pydantic import Field, model_validator

from wearsim.errors import listed
from wearsim.profile.files.axes import FormatName, OriginName, Statements, UnitName
from wearsim.scene.section import Section, quantity
from wearsim.toml_faults import cross_check

AnySection = TypeVar("AnySection", bound=Section)

STATEMENTS = (
    "format",
    "units",
    "mirror",
    "z_up",
    "origin",
    "offset_y_mm",
    "offset_z_mm",
)
"""Keys that state what files of points leave open; rails have the first four."""

_KEYS_OF_FLAGS = {
    "--format": "format",
    "--units": "units",
    "--z-up or --z-down": "z_up = true or false",
    "--no-mirror": "mirror = false",
    "--mirror": "mirror = true",
    "--offset-y-mm": "offset_y_mm",
    "--offset-z-mm": "offset_z_mm",
}

FileFormat = Annotated[
    FormatName | None,
    Field(
        description="the format of its files of points, by default by their content, "
        "then by their extension"
    ),
]
Units = Annotated[
    UnitName | None,
    Field(
        description="the unit of their points, by default that of the file or format, "
        "else the one that fits their size"
    ),
]
Mirror = Annotated[
    bool | None,
    Field(
        description="whether their y grows towards the track centre (the flange or "
        "the gauge side), by default by format and shape"
    ),
]
ZUp = Annotated[
    bool | None,
    Field(
        description="whether their z grows away from the flange tip or the foot of "
        "the rail, by default by the shape"
    ),
]
PointOrigin = Annotated[
    OriginName | None,
    Field(
        description="where their y counts from; gauge_point: y and z count from a "
        "point of the flange (APTA) and are moved by the flange back and the height "
        "of the running circle. By default by the place of the flange tip"
    ),
]
OffsetY = Annotated[
    float | None,
    quantity(
        "profile_offset",
        meaning="the length added to their y, positive to the field side, so that y "
        "counts from the running circle, in place of origin",
    ),
]
OffsetZ = Annotated[
    float | None,
    quantity(
        "profile_offset",
        meaning="the length added to their z, positive to the flange tip, so that z "
        "counts from the running circle, in place of origin",
    ),
]


def _check_origin(table: AnySection) -> AnySection:
    """Return a table; one with both an origin and offsets has a fault."""
    keys = [
        key for key in ("offset_y_mm", "offset_z_mm") if getattr(table, key) is not None
    ]
    if getattr(table, "origin", None) is not None and keys:
        text = f"origin and {listed(keys)} exclude each other; delete one of them"
        raise cross_check(text, "origin")
    return table


one_origin = model_validator(mode="after")(_check_origin)
"""Validator of tables with origin and offsets, which exclude each other."""


def statements_of(table: Section | None) -> Statements:
    """Statements of a table on the files of points that it names."""
    values = {
        key.removesuffix("_mm"): 1e-3 * value if key.endswith("_mm") else value
        for key in STATEMENTS
        if (value := getattr(table, key, None)) is not None
    }
    return cast(Statements, values)


def with_keys(message: str) -> str:
    """Message of a profile file with keys of scenes in place of flags."""
    for flag, key in _KEYS_OF_FLAGS.items():
        message = message.replace(flag, key)
    return message
