"""Shares of blocks and classes of operating points in the wear of a campaign."""

from __future__ import annotations

import pandas as pd
import xarray as xr

from wearsim.results.checks import group_names, worn_by_patch

MOST = 7
"""Blocks or classes with a row of their own; the others are summed."""


def wear_shares(dataset: xr.Dataset, most: int = MOST) -> pd.DataFrame:
    """Shares of blocks or classes in the distance and in the worn area [%].

    Returns
    -------
    DataFrame
        Columns run and wear, indexed by block or class, the largest wear first; beyond
        `most` rows the rest is the row "others". Without rows if nothing has worn.
    """
    wear = worn_by_patch(dataset).sum(axis=(0, 2))
    if not wear.any():
        return pd.DataFrame(columns=["run", "wear"])
    steps = dataset["step_length"].values[:, None] * dataset["active_weight"].values
    sums = (
        pd.DataFrame({"run": steps.sum(axis=0), "wear": wear})
        .groupby(group_names(dataset))
        .sum()
    )
    shares = (100.0 * sums / sums.sum())[sums["run"] > 0.0]
    shares = shares.sort_values("wear", ascending=False)
    if len(shares) <= most:
        return shares
    rest = shares.iloc[most - 1 :].sum().rename("others").to_frame().T
    return pd.concat([shares.iloc[: most - 1], rest])
