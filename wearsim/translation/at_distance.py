"""The state of a campaign at any distance, between the steps it stored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import ResultError
from wearsim.results import checks, open_results
from wearsim.translation.factors import at_distances, rows_at


def at_distance(results: str | Path | xr.Dataset, distance: Any) -> xr.Dataset:
    """State of a campaign at distances, between its wear steps.

    Parameters
    ----------
    results : str, Path or Dataset
        Result file, or a result as `wearsim.open_results` gives it.
    distance : float or (k,) array
        Distances within those run [m].

    Returns
    -------
    xarray.Dataset
        As of `wearsim.open_results`, with the dimension `distance` in place of `step`,
        or without it for one distance. Values of the wheels, such as profiles, wear
        depths and measures, are linear between the stored states; of two states at one
        distance the one after the reprofiling is taken. What is known of steps,
        operating points and patches is that of the last stored state.

    Raises
    ------
    ResultError
        If the file is no result, or a distance was not run.

    Examples
    --------
    >>> import wearsim
    >>> state = wearsim.at_distance("out/rig.nc", 900.0)
    >>> state["profile_z"].dims
    ('wheel', 'point')
    >>> series = wearsim.at_distance("out/rig.nc", [0.0, 500.0, 1000.0])
    >>> series["max_wear_depth"].sel(wheel="right").values[0].tolist()
    0.0
    """
    if not isinstance(results, xr.Dataset):
        with open_results(results) as opened:
            return at_distance(opened.load(), distance)
    if "step" not in results.dims:
        raise ResultError("the result holds one state alone; give one with its steps")
    run = results["distance"].values
    stations = np.atleast_1d(np.asarray(distance, dtype=float))
    checks.check_run(results, stations)
    rows = rows_at(run, stations)
    state = results.isel(step=rows).drop_vars(["distance", "step"], errors="ignore")
    for name, variable in results.variables.items():
        if _is_linear(str(name), variable):
            values = at_distances(run, variable.values, stations)
            state[name] = (variable.dims, values, variable.attrs)
    state = state.rename(step="distance").assign_coords(
        distance=("distance", stations, results["distance"].attrs)
    )
    if "profile_y" in state:
        state = state.set_coords("profile_y")
    return state if np.ndim(distance) else state.isel(distance=0)


def _is_linear(name: str, variable: xr.Variable) -> bool:
    """Return True if values of wheels or the wheelset are linear between two steps."""
    dimensions = set(variable.dims)
    of_wheels = "wheel" in dimensions and "operating_point" not in dimensions
    varies = "step" in dimensions and variable.dtype.kind == "f"
    return varies and (of_wheels or name == "equivalent_conicity")
