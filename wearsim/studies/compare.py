"""Two results or scenes side by side, by the functions for rig and field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.campaign.rate import wear_rate
from wearsim.errors import ResultError, brief
from wearsim.quantities import QUANTITIES
from wearsim.results import loaded
from wearsim.scene.models import SceneModel
from wearsim.translation import factors
from wearsim.translation.compare import Comparison
from wearsim.translation.factors import FloatArray
from wearsim.translation.translate import (
    BASIS,
    WHEELS,
    compared,
    is_reprofiled,
    require_whole,
)

Compared = str | Path | Mapping[str, Any] | SceneModel | xr.Dataset
"""A result or a scene."""

_MEANS = (
    "max_pressure",
    "power",
    "wear_number_with_spin",
    "wear_index_max",
    "wear_area_rate",
)
_STATUS_ATTRS = {
    "long_name": "why the ratio is undefined, if it is",
    "flag_values": np.arange(len(factors.STATUS), dtype=np.int8),
    "flag_meanings": " ".join(factors.STATUS),
}
_NAMED = {"basis": BASIS, "wheel": WHEELS[:2], "wheel_group": WHEELS}


def compare(
    a: Compared, b: Compared, *, names: tuple[str, str] = ("a", "b"), count: int = 41
) -> xr.Dataset:
    """Compare two campaigns of any kind, or two scenes.

    Measures side by side, and their ratio a over b.

    For rig against field `translate` has causes and bands, too.

    Parameters
    ----------
    a, b : str, Path, dict, scene or Dataset
        Two results: files or what `wearsim.open_results` gives. Or two scenes of a rig
        or of the field, as of `wear_rate`: files (.toml), tables as dicts or loaded by
        `load_scene`; they are compared on new wheels, without a campaign.
    names : pair of str
        One word for each, in place of a and b.
    count : int
        Number of stations along `progress`, of results; a multiple of 4 plus 1.

    Returns
    -------
    xarray.Dataset
        Every measure `x` has the dimension `campaign` (a, b) and a ratio `x_factor`, a
        over b, NaN where undefined, with the reason in `x_factor_status`; SI units.

        Of results further dimensions are `basis` (equal distance, equal worn depth,
        equal worn area; the first one alone where wheels were reprofiled), `progress`
        (0: new wheels, 1: as far as both come) and `wheel_group` (right, left, both).
        Measures are `distance_run`, `max_wear_depth`, `worn_area`, changes of Sh, Sd
        and qR (`flange_height_change`, `flange_thickness_change`,
        `flange_gradient_change`), means of the load collective such as
        `power_collective`, values at equal operating points (`power_point`), depth
        along the profile, and what `translate` gives besides.

        Of scenes: `wear_depth_rate`, the largest one along the profile of the whole
        collective, and means of the collective such as `wear_area_rate_collective` and
        `power_collective`, over `wheel_group`.

        `attrs["warnings"]` has a line for each difference of models, material and
        wheelset of results.

    Raises
    ------
    WearsimError
        If one is a result and the other a scene, a file cannot be read, a scene has
        faults, or names are no two words.

    Examples
    --------
    >>> import wearsim
    >>> both = wearsim.compare("out/rig.nc", "out/field.nc")
    >>> end = both.sel(basis="equal distance", wheel_group="both").isel(progress=-1)
    >>> depth = end["max_wear_depth"]
    >>> float(depth.sel(campaign="a") / depth.sel(campaign="b")) > 0.0
    True
    >>> new = wearsim.compare("rig.toml", "field.toml", names=("rig", "field"))
    >>> new["power_collective"].dims, new["campaign"].values.tolist()
    (('campaign', 'wheel_group'), ['rig', 'field'])
    """
    if (
        len(set(names)) != 2
        or len(names) != 2
        or not all(str(name).isidentifier() for name in names)
    ):
        raise ResultError(
            f'names = {brief(repr(names))} must be two words, such as ("fast", '
            '"standard")'
        )
    scenes = [campaign for campaign in (a, b) if _is_scene(campaign)]
    if len(scenes) == 1:
        raise ResultError(
            "one is a result and the other a scene; give two results or two scenes"
        )
    if scenes:
        return _of_scenes(scenes, names)
    first, second = (
        loaded(campaign)
        for campaign in (a, b)
        if isinstance(campaign, str | Path | xr.Dataset)
    )
    require_whole((first, second), names)
    both = compared(Comparison(first, second, count, names=names)).assign_attrs(
        history="wearsim.compare"
    )
    if is_reprofiled(first) or is_reprofiled(second):
        both = both.isel(basis=[0])
    labels = {"campaign": names, **_NAMED}
    both = both.drop_vars([f"{name}_name" for name in labels])
    places = {name: list(labels[name][: both.sizes[name]]) for name in labels}
    return both.assign_coords(places).assign_coords(
        zone=both["zone_name"].values.tolist()
    )


def _is_scene(campaign: Any) -> bool:
    if isinstance(campaign, str | Path):
        return Path(campaign).suffix.lower() == ".toml"
    if not isinstance(campaign, Mapping | SceneModel):
        raise ResultError(
            f"{brief(repr(campaign))} is neither a result nor a scene; give a file, a "
            "Dataset or a scene"
        )
    return not isinstance(campaign, xr.Dataset)


def _of_scenes(scenes: Sequence[Any], names: tuple[str, str]) -> xr.Dataset:
    """Compare the wear rates of two scenes on new wheels."""
    rates = [wear_rate(scene) for scene in scenes]
    variables: dict[str, Any] = {}

    def add(variable: str, name: str, meaning: str, values: FloatArray) -> None:
        about = {"long_name": meaning, "quantity": name}
        variables[variable] = (
            ("campaign", "wheel_group"),
            values,
            {"units": QUANTITIES[name].unit} | about,
        )
        scale = np.nan_to_num(np.abs(values)).max()
        factor = factors.ratio(values[0], values[1], scale, factors.zero_share(name))
        over = {
            "units": "1",
            "long_name": f"{meaning}, {names[0]} over {names[1]}",
            "quantity": name,
        }
        variables[f"{variable}_factor"] = ("wheel_group", factor.value, over)
        variables[f"{variable}_factor_status"] = (
            "wheel_group",
            factor.status.astype(np.int8),
            _STATUS_ATTRS,
        )

    meaning = (
        "largest wear depth per distance run, of the load collective on new wheels"
    )
    add(
        "wear_depth_rate",
        "wear_depth_rate",
        meaning,
        np.stack([_deepest(rate) for rate in rates]),
    )
    for name in _MEANS:
        meaning = f"{QUANTITIES[name].meaning}, collective mean on new wheels"
        add(
            f"{name}_collective",
            name,
            meaning,
            np.stack([_mean(rate, name) for rate in rates]),
        )
    places = {"campaign": list(names), "wheel_group": list(WHEELS)}
    return xr.Dataset(
        variables,
        coords=places,
        attrs={"comment": f"factors are {names[0]} over {names[1]}"},
    )


def _deepest(rate: xr.Dataset) -> FloatArray:
    """Largest depth rate (3,) along the profile of the collective [m/m].

    Those of the right wheel, the left wheel and both.
    """
    share = rate["weight"] * rate["environment"] / rate["weight"].sum()
    depth = (
        (share * rate["wear_depth_rate"].sum("regime"))
        .sum("operating_point")
        .max("point")
    )
    return factors.with_both(depth.values, "largest")


def _mean(rate: xr.Dataset, name: str) -> FloatArray:
    """Mean (3,) of a quantity over the collective [SI].

    Those of the right wheel, the left wheel and the mean of both.
    """
    acting = rate["environment"].values[:, None] if name == "wear_area_rate" else 1.0
    values = rate[name].transpose("operating_point", "wheel").values * acting
    mean = factors.collective_mean(values[None], rate["weight"].values)[0]
    return np.append(mean, mean.mean())
