"""Indexes of a result: steps by distance; wheels, points, regimes and laws by name."""

from __future__ import annotations

from typing import Any

import numpy as np
from xarray.indexes import PandasIndex

INDEXES = (
    "operating_point",
    "wheel",
    "regime",
    "zone",
    "comparison",
    "comparison_regime",
    "fatigue",
)
"""Index dimensions of `open_results`, where a result has them."""


class NameIndex(PandasIndex):
    """Index of names, which are matched exactly.

    `method` applies to a distance selected together with them.
    """

    def sel(
        self,
        labels: dict[Any, Any],
        method: str | None = None,  # noqa: ARG002
        tolerance: Any = None,  # noqa: ARG002
    ) -> Any:
        """Positions of the names, see `xarray.Dataset.sel`."""
        return super().sel(labels)


class DistanceIndex(PandasIndex):
    """Index of distances that rise with the step.

    Of equal distances (at a reprofiling) the later step is selected.
    """

    def sel(
        self, labels: dict[Any, Any], method: str | None = None, tolerance: Any = None
    ) -> Any:
        """Rows of the labels, see `xarray.Dataset.sel`."""
        if method is None or self.index.is_unique:
            return super().sel(labels, method, tolerance)
        last = np.flatnonzero(~self.index.duplicated(keep="last"))
        result = PandasIndex(self.index[last], self.dim).sel(labels, method, tolerance)
        rows = result.dim_indexers[self.dim]
        rows = rows.copy(data=last[rows.data]) if hasattr(rows, "dims") else last[rows]
        result.dim_indexers[self.dim] = rows
        return result
