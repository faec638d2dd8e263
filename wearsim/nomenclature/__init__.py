"""The one table of quantities: name, symbol, SI unit, shown unit, sign convention, meaning.

Result files take their units and long names from here, figures their labels and factors, and
``wearsim contact --json`` its field names.  A quantity that is not in this table has no name.  Each room has
a part of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from wearsim.nomenclature import campaign, choice, contact, counterface, damage, field, operation, profile
from wearsim.nomenclature.row import Quantity, percent, quantity

_ROWS = (
    *campaign.ROWS,
    *counterface.ROWS,
    *operation.ROWS,
    *contact.PATCH,
    *choice.ROWS,
    *damage.ROWS,
    *contact.SOLUTION,
    *field.ROWS,
    *profile.ROWS,
)

NOMENCLATURE: Mapping[str, Quantity] = MappingProxyType({row[0]: quantity(row) for row in _ROWS})
"""All quantities by name."""

__all__ = ["NOMENCLATURE", "Quantity", "percent"]
