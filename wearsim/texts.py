"""Texts for people from Jinja templates, in the folder `templates` of a room."""

from __future__ import annotations

import functools
import re
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2

WIDTH = 100
"""Columns of a terminal that answers of the command line keep to."""


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


def text_table(rows: Sequence[Sequence[str]], gap: str = "  ") -> list[str]:
    """Lines of a table, its first column to the left and the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        gap.join(
            [row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]
        ).rstrip()
        for row in rows
    ]


_JOINT = "\N{NO-BREAK SPACE}"


def wrapped(text: str, indent: str = "  ") -> str:
    """Break a text into lines of `WIDTH` columns, all but the first indented.

    Numbers with thousands apart are not broken.
    """
    text = re.sub(r"(?<=\d) (?=\d{3}\b)", _JOINT, text)
    return textwrap.fill(
        text,
        WIDTH,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    ).replace(_JOINT, " ")
