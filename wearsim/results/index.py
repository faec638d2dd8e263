"""Indexes of a result: steps by the distance run.

Wheels, operating points, regimes and laws by name.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from xarray.indexes import PandasIndex

INDEXES = (
    "operating_point",
    "wheel",
    "regime",
    "comparison",
    "comparison_regime",
    "fatigue",
)
"""Dimensions whose names `open_results` makes their index, where a result has them."""


class NameIndex(PandasIndex):
    """Names, which are always met exactly.

    `method` is for the distance selected with them.
    """

    def sel(
        self,
        labels: dict[Any, Any],
        method: str | None = None,  # noqa: ARG002
        tolerance: Any = None,  # noqa: ARG002
    ) -> Any:
        """Places of the names, see `xarray.Dataset.sel`."""
        return super().sel(labels)


class DistanceIndex(PandasIndex):
    """Distances that rise with the step.

    Of equal ones (reprofiling) the later counts.
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
