"""Messages from `texts.toml`, and pages from Jinja templates in the folder `templates` of a room."""

from __future__ import annotations

import functools
import json
import string
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.errors import LONGEST_ECHO, brief

if TYPE_CHECKING:
    import jinja2

_UNITS = {"mm": 1e3, "um": 1e6, "µm": 1e6, "km": 1e-3, "kN": 1e-3, "mrad": 1e3, "%": 100.0, "GPa": 1e-9}
"""Units of messages, with the factor from SI."""
_BETWEEN = {"c": ", ", "o": " or ", "a": " and "}


def shown(value: object) -> str:
    """Value as TOML would write it, on one line, shortened."""
    if isinstance(value, Mapping):
        return "(a table)"
    if isinstance(value, str | bool):
        text = json.dumps(value, ensure_ascii=False)
        return text if len(text) <= LONGEST_ECHO else f'{text[: LONGEST_ECHO - 4]}..."'
    if isinstance(value, list | tuple):
        text = f"[{', '.join(map(shown, value))}]"
        return "(a list)" if len(value) > 4 or len(text) > LONGEST_ECHO else text
    return brief(str(value))


class _Formatter(string.Formatter):
    def convert_field(self, value: Any, conversion: Any) -> Any:
        if conversion == "t":
            return shown(value)
        if conversion in _BETWEEN:
            return _BETWEEN[conversion].join(map(str, value))
        return super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> Any:
        form, _, unit = format_spec.partition(" ")
        return f"{value * _UNITS[unit]:{form}} {unit}" if unit else format(value, form)


@functools.cache
def _messages() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("texts.toml").read_text(encoding="utf-8"))


def say(name: str, /, **values: Any) -> str:
    """Message of a name in `texts.toml`, such as "rig.no_file", with values in its fields.

    Fields are those of `str.format`; besides, ``{gap:.3g mm}`` shows a value in SI units in others,
    ``{key!t}`` as TOML writes it, and ``{names!c}``, ``!o`` and ``!a`` are lists with commas, or, and.
    """
    room, _, key = name.partition(".")
    return _Formatter().vformat(_messages()[room][key], (), values)


@functools.cache
def environment(package: str, autoescape: bool = False) -> jinja2.Environment:
    """Templates of a package, for HTML or (without escapes) for text."""
    import jinja2  # only spent where it is needed

    return jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        autoescape=autoescape,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def written(package: str, name: str, **context: Any) -> str:
    """Text of a template, without the line break at its end."""
    return environment(package).get_template(name).render(**context).rstrip("\n")
