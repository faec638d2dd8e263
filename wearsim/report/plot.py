"""One figure of a result, by the name of a quantity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.errors import ResultError, brief, suggestion
from wearsim.report.figures import campaign
from wearsim.results import checks, loaded

_SIDES = ("right", "left")
_ALONG = ("profile_z", "wear_depth", "wear_depth_by_regime")
_OVER_DISTANCE = (("step",), ("step", "wheel"))
_OF_PATCHES = ("step", "operating_point", "patch")


def plot(
    results: str | Path | xr.Dataset,
    name: str = "wear_depth",
    ax: Axes | None = None,
    *,
    wheel: str = "right",
    distance: float | None = None,
) -> Axes:
    """Draw a quantity of a result, with labels and units.

    Parameters
    ----------
    results : str, Path or Dataset
        Result file, or a result as `wearsim.open_results` gives it.
    name : str
        "wear_depth" or "wear_depth_by_regime" along the profile; "profile_z" for the worn and the new profile
        with the counterface; a measure such as "flange_thickness" over the distance, of both wheels; a
        quantity of the patches such as "max_pressure" or "wheel_y" over the shift of their operating points.
    ax : Axes, optional
        To draw into, by default that of a new figure.
    wheel : {"right", "left"}
        Of which depths and profiles are drawn.
    distance : float, optional
        At which depths and profiles are drawn, by default the end [m].

    Returns
    -------
    matplotlib.axes.Axes
        Nothing is shown or saved.

    Raises
    ------
    ResultError
        If the file is no whole result, it cannot be drawn by that name, or the distance was not run.

    Examples
    --------
    >>> import wearsim
    >>> ax = wearsim.plot("out/rig.nc", "flange_thickness")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('Distance run [km]', 'Flange thickness [mm]')
    """
    data = loaded(results)
    if wheel not in _SIDES:
        raise ResultError(f"wheel = {brief(repr(wheel))} is not one of right, left")
    if distance is not None:
        checks.check_run(data, np.array([distance]))
    side = _SIDES.index(wheel)
    if name == "wear_depth":
        return campaign.plot_wear_depth(data, ax, wheel=side, distance=distance)
    if name == "profile_z":
        return campaign.plot_profile(data, ax, wheel=side, distance=distance)
    if distance is not None:
        raise ResultError(f"distance is for wear_depth and profile_z; leave it out for {brief(name)}")
    if name == "wear_depth_by_regime":
        return campaign.plot_wear_by_regime(data, ax, wheel=side)
    drawn = {
        str(one): variable.dims
        for one, variable in data.data_vars.items()
        if variable.dtype.kind == "f" and variable.dims in (*_OVER_DISTANCE, _OF_PATCHES)
    }
    if name not in drawn:
        near = suggestion(name, (*_ALONG, *drawn))
        raise ResultError(f"{brief(repr(name))} is nothing that plot draws of this result{near}")
    if drawn[name] == _OF_PATCHES:
        return campaign.plot_contact(data, name, ax)
    return campaign.plot_over_distance(data, name, ax)
