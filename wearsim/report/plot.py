"""Figure of a result, of wear rates or of profiles, by the name of a quantity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.errors import ResultError, brief, suggestion
from wearsim.profile.shape import Profile
from wearsim.report import learned
from wearsim.report.figures import campaign, rate
from wearsim.report.figures.profile import plot_profiles
from wearsim.results import checks, loaded

_SIDES = ("right", "left")
_ALONG = ("profile_z", "patches", "wear_depth", "wear_depth_by_regime")
_AT_A_DISTANCE: dict[str, Callable[..., Axes]] = {
    "wear_depth": campaign.plot_wear_depth,
    "profile_z": campaign.plot_profile,
    "patches": campaign.plot_patches,
}
_OVER_DISTANCE = (("step",), ("step", "wheel"))
_OF_PATCHES = ("step", "operating_point", "patch")


def plot(
    results: str | Path | xr.Dataset | Profile | Sequence[Profile],
    name: str | None = None,
    ax: Axes | None = None,
    *,
    wheel: str = "right",
    distance: float | None = None,
) -> Axes:
    """Draw a quantity of a result or of wear rates, or profiles, with labels and units.

    Parameters
    ----------
    results : str, Path, Dataset, Profile or sequence of Profile
        Result file, or a result as `wearsim.open_results` gives it; wear rates of
        `wearsim.wear_rate`; one profile or several of one kind, such as before and
        after; or what `wearsim.calibrate` returns, of which measured and predicted
        depth of a wheel are drawn.
    name : str, optional
        Of a result: "wear_depth" (default) or "wear_depth_by_regime" along the profile;
        "profile_z" for the worn and the new profile with the counterface; "patches" for
        the contact patches on the worn profile; a measure such as "flange_thickness"
        over the distance, of both wheels; a quantity of the patches such as
        "max_pressure" or "wheel_y" over the shift of their operating points. Of wear
        rates: "wear_depth_rate" (default) or "friction_work" along the profile, a line
        for each operating point; or "power" and the like over the shift, of both
        wheels. Of profiles nothing.
    ax : Axes, optional
        To draw into, by default that of a new figure (`ax.figure`, not one of pyplot).
    wheel : {"right", "left"}
        Of which depths, profiles and patches are drawn.
    distance : float, optional
        At which depths and profiles of a result are drawn, by default the end [m];
        patches are those of the last stored state.

    Returns
    -------
    matplotlib.axes.Axes
        Nothing is shown or saved.

    Raises
    ------
    ResultError
        If the file is no whole result, it cannot be drawn by that name, or the distance
        was not run.

    Examples
    --------
    >>> import wearsim
    >>> ax = wearsim.plot("out/rig.nc", "flange_thickness")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('Distance run [km]', 'Flange thickness [mm]')
    >>> new = wearsim.standard_profile("S1002")
    >>> ax = wearsim.plot([new, wearsim.worn_profile("out/rig.nc")])
    >>> [line.get_label() for line in ax.lines]
    ['S1002', 'rig_right_2km']
    """
    if wheel not in _SIDES:
        raise ResultError(f"wheel = {brief(repr(wheel))} is not one of right, left")
    side = _SIDES.index(wheel)
    if not isinstance(results, str | Path | xr.Dataset):
        return _plot_profiles(
            [results] if isinstance(results, Profile) else results, name, ax, distance
        )
    if isinstance(results, xr.Dataset) and "transfer_deviation" in results:
        return _of_calibration(results, name or "wear_depth", wheel, ax)
    if (
        isinstance(results, xr.Dataset)
        and rate.DEPTH in results
        and "step" not in results.dims
    ):
        if distance is not None:
            raise ResultError("distance is for results; leave it out for wear rates")
        return _plot_rates(results, rate.DEPTH if name is None else name, ax, side)
    return _plot_result(
        loaded(results), "wear_depth" if name is None else name, ax, side, distance
    )


def _plot_profiles(
    profiles: Sequence[Profile],
    name: str | None,
    ax: Axes | None,
    distance: float | None,
) -> Axes:
    are_profiles = isinstance(profiles, Sequence) and all(
        isinstance(profile, Profile) for profile in profiles
    )
    if not are_profiles or len({profile.kind for profile in profiles}) != 1:
        what = "a result, wear rates, or profiles of one kind"
        raise ResultError(
            f"{brief(repr(profiles))} is nothing that plot draws; give {what}"
        )
    if name is not None or distance is not None:
        raise ResultError(
            "name and distance are for results; leave them out for profiles"
        )
    return plot_profiles(profiles, ax)


def _plot_rates(data: xr.Dataset, name: str, ax: Axes | None, side: int) -> Axes:
    along = [
        str(key) for key, values in data.data_vars.items() if "point" in values.dims
    ]
    of_wheels = [
        str(key)
        for key, values in data.data_vars.items()
        if values.dims == ("operating_point", "wheel")
    ]
    if name in along:
        return rate.plot_along(data, name, ax, wheel=side)
    if name in of_wheels:
        return rate.plot_over_shift(data, name, ax)
    near = suggestion(name, (*along, *of_wheels))
    raise ResultError(
        f"{brief(repr(name))} is nothing that plot draws of wear rates{near}"
    )


def _plot_result(
    data: xr.Dataset, name: str, ax: Axes | None, side: int, distance: float | None
) -> Axes:
    if distance is not None:
        checks.check_run(data, np.array([distance]))
    if name in _AT_A_DISTANCE:
        return _AT_A_DISTANCE[name](data, ax, wheel=side, distance=distance)
    if distance is not None:
        *others, last = _AT_A_DISTANCE
        raise ResultError(
            f"distance is for {', '.join(others)} and {last}; leave it out for "
            f"{brief(name)}"
        )
    if name == "wear_depth_by_regime":
        return campaign.plot_wear_by_regime(data, ax, wheel=side)
    drawn = {
        str(key): variable.dims
        for key, variable in data.data_vars.items()
        if variable.dtype.kind == "f"
        and variable.dims in (*_OVER_DISTANCE, _OF_PATCHES)
    }
    if name not in drawn:
        near = suggestion(name, (*_ALONG, *drawn))
        raise ResultError(
            f"{brief(repr(name))} is nothing that plot draws of this result{near}"
        )
    if drawn[name] == _OF_PATCHES:
        return campaign.plot_contact(data, name, ax)
    return campaign.plot_over_distance(data, name, ax)


def _of_calibration(
    calibration: xr.Dataset, name: str, wheel: str, ax: Axes | None
) -> Axes:
    """Draw what a calibration has of a wheel, of the rig if that was measured."""
    ending = f"_{wheel}_wear_depth"
    measured = [
        quantity
        for quantity in learned.quantities(calibration)
        if quantity.endswith(ending)
    ]
    if name != "wear_depth" or not measured:
        raise ResultError(
            "a calibration draws wear_depth of the wheels that were measured, not "
            f"{name}"
        )
    return learned.plot_measured(
        calibration, measured[0].removesuffix("_wear_depth"), ax
    )
