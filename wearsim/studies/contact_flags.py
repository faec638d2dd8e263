"""Flags of `wearsim contact`, alike as columns of its table: one light table, read by `--help` too.

The table is `contact_flags.csv`, a row for each flag in the order of the help; its columns are the fields of
`Flag`.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import NamedTuple


class Flag(NamedTuple):
    """One flag. As a column of a table it has underscores for dashes."""

    name: str
    default: str | None
    meaning: str
    group: str
    quantity: str  # whose unit and range hold, "" of words

    @property
    def column(self) -> str:
        """Name as a column."""
        return self.name.replace("-", "_")

    @property
    def field(self) -> str:
        """Name in a `Request` of `contact_points`: without unit; that of the quantity for models."""
        if self.group == MODELS:
            return self.quantity or self.column
        return re.sub("_(mm|mrad|kN|km_h|GPa|m)$", "", self.column)


MOTION, MODELS = "motion and load", "models"

with Path(__file__).with_name("contact_flags.csv").open(encoding="utf-8", newline="") as _file:
    FLAGS = tuple(Flag(**row | {"default": row["default"] or None}) for row in csv.DictReader(_file))

COLUMNS = {flag.column: flag for flag in FLAGS}
"""Flags by their name as a column."""
