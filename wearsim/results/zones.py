"""Wear by block or class of operating points and zone of the wheel profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wearsim.profile.worn import WHEEL_ZONES
from wearsim.results.checks import group_names, worn_by_patch
from wearsim.results.file import loaded

if TYPE_CHECKING:
    import xarray as xr


def wear_by_zone(results: str | Path | xr.Dataset) -> pd.DataFrame:
    """Share of each block and zone of the profile in the worn area of both wheels [-].

    Parameters
    ----------
    results : str, Path or Dataset
        Result file of a campaign, finished or not, or a result as
        `wearsim.open_results` gives it.

    Returns
    -------
    DataFrame
        Rows are blocks or classes of operating points, the one that wears most first;
        columns have two levels, wheel (right, left) and zone: flange up to y = -38 mm,
        flange root up to -26 mm, tread up to 32 mm, and field side, y from the running
        circle, 70 mm from the flange back. All cells sum to 1. The table is empty
        before the first step, and for results of version 0.2.0, which do not know it.

    Raises
    ------
    ResultError
        If the file is missing, damaged or not a whole result of this version of
        wearsim.

    Notes
    -----
    Patches are those of the state to which each step leads, divided by their strips.

    Examples
    --------
    >>> import wearsim
    >>> share = wearsim.wear_by_zone("out/rig.nc")
    >>> round(float(share.to_numpy().sum()), 9)
    1.0
    >>> bool(share["right"]["tread"].max() > 0.01)
    True
    """
    return zone_table(loaded(results))


def zone_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Tabulate the wear of a loaded result by class and zone, see `wear_by_zone`."""
    columns = pd.MultiIndex.from_product([("right", "left"), WHEEL_ZONES])
    if "zone_share" not in dataset or dataset.sizes["step"] < 2:
        return pd.DataFrame(columns=columns, dtype=np.float64)
    worn = _worn_by_point(dataset)
    names = group_names(dataset)
    acts = dataset["weight"].values > 0.0  # monitoring points do not wear
    table = pd.DataFrame(worn.reshape(len(worn), -1)[acts], columns=columns)
    table = table.groupby(names[acts], sort=False).sum()
    total = float(table.to_numpy().sum())
    order = (-table.sum(axis=1)).argsort(kind="stable")
    return table.iloc[order] / total if total > 0.0 else table.iloc[:0]


def _worn_by_point(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Worn area (operating_point, wheel, zone) of all steps [m2]."""
    worn, side = worn_by_patch(dataset)[1:], dataset["side"].values[1:]
    share = np.nan_to_num(dataset["zone_share"].values[1:])
    return np.stack(
        [
            np.einsum("spk,spkz->pz", np.where(side == wheel, worn, 0.0), share)
            for wheel in (0, 1)
        ],
        axis=1,
    )
