"""Parts of the comparison dataset.

Wear, contact, profile, equivalent distance, damage.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from wearsim.profile.worn import WHEEL_ZONES
from wearsim.quantities import QUANTITIES
from wearsim.translation import factors
from wearsim.translation.factors import (
    STATUS,
    WORN_SHARE,
    FloatArray,
    IntArray,
    at_distances,
    common_axes,
    distance_at,
    equivalent_distance,
)

CAMPAIGN = ("rig", "field")
STAGES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the common range at which values along the profile are compared."""

STATIONS = ("basis", "progress", "campaign")

EQUIVALENT_BY = {"max_wear_depth": "largest wear depth", "worn_area": "worn area"}
"""Measures of wear by which distances of rig and field are equivalent."""

_BOTH_WHEELS = {
    "sum": "both wheels: sum",
    "largest": "both wheels: the larger one",
    "change": "both wheels: the change of larger magnitude",
}
_LAW_SETTINGS = {
    "comparison": ("coefficients", "form"),
    "fatigue": ("coefficients", "form", "crack_width", "crack_depth", "shear_yield"),
}
"""Variables that laws of one name must share to be compared, with all their numbers."""
_WEAR_RATES = ("wear_area_rate", "wear_depth_rate_max")
_SAME_PROFILE = 1e-7  # [m]


class Comparison:
    """Comparison of two campaigns: stations, variables and notes.

    Parameters
    ----------
    first, second : Dataset
        Results of the two campaigns.
    count : int
        Number of stations along each axis.
    reach : sequence of float, optional
        Of `common_axes`.
    names : pair of str
        Of the campaigns, in names of variables and in texts.

    Attributes
    ----------
    variables : dict
        Variables of the comparison, as `xarray.Dataset` takes them.
    notes : list of str
        What the reader has to know of them.
    matched : (k, 2) int array
        Equal operating points of both, from `factors.match_points`.
    """

    def __init__(
        self,
        first: xr.Dataset,
        second: xr.Dataset,
        count: int,
        reach: Sequence[float] | None = None,
        names: tuple[str, str] = CAMPAIGN,
    ) -> None:
        self.pair, self.names = (first, second), names
        self.axes = common_axes(first, second, count, reach)
        self.matched = factors.match_points(first, second)
        self.variables: dict[str, Any] = {}
        self.notes: list[str] = []
        # regimes of both laws in one list, and each law's numbers in it, with -1 for
        # none at the end
        regime_names = [
            [str(name) for name in data["regime_name"].values] for data in self.pair
        ]
        self.regimes = list(dict.fromkeys(regime_names[0] + regime_names[1]))
        self.regime_numbers = [
            np.array([*map(self.regimes.index, names), -1]) for names in regime_names
        ]

    def add(
        self,
        name: str,
        dims: Any,
        values: Any,
        meaning: str,
        unit: str = "",
        **attrs: str,
    ) -> None:
        """Add a variable with its unit, long name and further attributes."""
        about = {"units": unit, "long_name": meaning} | attrs
        self.variables[name] = (
            dims,
            values,
            {key: text for key, text in about.items() if text},
        )

    def add_flags(
        self,
        name: str,
        dims: Any,
        values: Any,
        meaning: str,
        names: Collection[str],
        first: int = 0,
        comment: str = "",
    ) -> None:
        """Add a variable of flags, numbered from the first one on."""
        self.add(
            name,
            dims,
            values.astype(np.int8),
            meaning,
            flag_meanings=" ".join(names),
            comment=comment,
        )
        self.variables[name][2]["flag_values"] = np.arange(
            first, first + len(names), dtype=np.int8
        )

    def add_factor(
        self,
        variable: str,
        dims: tuple[str, ...],
        values: FloatArray,
        quantity: str,
        meaning: str = "",
        comment: str = "",
        *,
        scale: FloatArray | None = None,
        share: float | None = None,
        reachable: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add values (basis, station, campaign, ...), their factor and its status.

        Denominators below `share` (by default that of the quantity) of the `scale` (by
        default the largest magnitude of all) are too small to divide by. Stations are
        those of the axes, if not `reachable`.
        """
        meaning = meaning or QUANTITIES[quantity].meaning
        scale = np.nan_to_num(np.abs(values)).max() if scale is None else scale
        share = factors.zero_share(quantity) if share is None else share
        reach = self.axes.reachable if reachable is None else reachable
        reach = reach.reshape(reach.shape + (1,) * (values.ndim - 3))
        factor = factors.ratio(values[:, :, 0], values[:, :, 1], scale, share, reach)
        unit, rest = (
            QUANTITIES[quantity].unit,
            tuple(dim for dim in dims if dim != "campaign"),
        )
        self.add(
            variable, dims, values, meaning, unit, quantity=quantity, comment=comment
        )
        attrs = {
            "quantity": quantity,
            "ancillary_variables": f"{variable}_factor_status",
        }
        over = f"{self.names[0]} over {self.names[1]}"
        self.add(
            f"{variable}_factor", rest, factor.value, f"{meaning}, {over}", "1", **attrs
        )
        remark = (
            f"a divisor below the part {share:g} of the largest value is too small to "
            "divide by"
        )
        self.add_status(
            f"{variable}_factor", rest, factor.status, meaning, comment=remark
        )

    def add_status(
        self,
        variable: str,
        dims: Any,
        status: IntArray,
        meaning: str,
        comment: str = "",
    ) -> None:
        """Add `{variable}_status`."""
        text = f"why the factor of {meaning} is undefined, if it is"
        self.add_flags(
            f"{variable}_status", dims, status, text, STATUS, comment=comment
        )

    def add_rows(
        self,
        variable: str,
        dims: tuple[str, ...],
        rows: Sequence[FloatArray],
        quantity: str,
        meaning: str = "",
        comment: str = "",
        scale_axis: tuple[int, ...] | None = None,
        share: float | None = None,
    ) -> None:
        """Add rows (step, *dims) of both campaigns at all stations.

        Axes in `scale_axis` share one scale.
        """
        columns = [
            np.stack(
                [
                    at_distances(data["distance"].values, series, at)
                    for at in self.axes.distance[..., c]
                ]
            )
            for c, (data, series) in enumerate(zip(self.pair, rows, strict=True))
        ]
        values = np.stack(columns, axis=2)
        scale = np.nan_to_num(np.abs(values)).max(axis=scale_axis)
        self.add_factor(
            variable,
            (*STATIONS, *dims),
            values,
            quantity,
            meaning,
            comment,
            scale=scale,
            share=share,
        )


def add_distance(comparison: Comparison) -> None:
    """Add the distances of comparison [m] and their factor, (basis, progress)."""
    meaning = "distance run where the campaigns are compared"
    comparison.add_factor(
        "distance_run", STATIONS, comparison.axes.distance, "distance", meaning
    )


def add_wear(comparison: Comparison) -> None:
    """Add measures and conicity with factors, (basis, progress, wheel_group)."""
    for name, rule in factors.WEAR_QUANTITIES.items():
        change = rule == "change"
        # the scale is what the campaigns reach: at the new wheel all wear is zero
        comparison.add_rows(
            f"{name}_change" if change else name,
            ("wheel_group",),
            [factors.wear_by_wheel(data, name) for data in comparison.pair],
            name,
            QUANTITIES[name].meaning + (", change from new" if change else ""),
            _BOTH_WHEELS[rule],
            scale_axis=(0, 1, 2),
        )
    conicity = [data["equivalent_conicity"].values for data in comparison.pair]
    comparison.add_rows("equivalent_conicity", (), conicity, "equivalent_conicity")


def add_contact(comparison: Comparison) -> None:
    """Add contact quantities of the collective and of equal operating points."""
    pair, matched = comparison.pair, comparison.matched
    for name, rule in factors.POINT_QUANTITIES.items():
        meaning, wears = QUANTITIES[name].meaning, name in _WEAR_RATES
        wheels = [
            factors.between_solutions(data, factors.per_wheel(data, name))
            for data in pair
        ]
        means = []
        for values, data in zip(wheels, pair, strict=True):
            acting = values * data["environment"].values[:, None] if wears else values
            means.append(factors.collective_mean(acting, data["weight"].values))
        remark = "; with the environment factor of each point" if wears else ""
        comparison.add_rows(
            f"{name}_collective",
            ("wheel_group",),
            [np.column_stack([mean, mean.mean(axis=1)]) for mean in means],
            name,
            f"{meaning}, collective mean",
            "mean magnitude, weighted with the shares of the load collective; "
            f"patches of a wheel: {rule}; both wheels: mean{remark}",
        )
        if len(matched):
            # the environment factor belongs to the collective, not to the state that
            # both have in common
            comparison.add_rows(
                f"{name}_point",
                ("matched_point", "wheel"),
                [values[:, matched[:, c]] for c, values in enumerate(wheels)],
                name,
                (
                    f"{meaning}{', without environment factor' if wears else ''} at "
                    "equal operating points"
                ),
                f"patches of a wheel: {rule}; linear between stored states",
            )
    if len(matched):
        _add_points(comparison)


def _add_points(comparison: Comparison) -> None:
    """Add conditions and labels of the equal operating points."""
    pair, matched = comparison.pair, comparison.matched
    for name in factors.MATCH_KEYS:
        values, quantity = pair[0][name].values[matched[:, 0]], QUANTITIES[name]
        comparison.add(name, "matched_point", values, quantity.meaning, quantity.unit)
    for c, (role, data) in enumerate(zip(comparison.names, pair, strict=True)):
        labels = [
            str(label) for label in data["operating_point_name"].values[matched[:, c]]
        ]
        comparison.add(
            f"{role}_label",
            "matched_point",
            labels,
            f"operating point of the {role} campaign",
        )


def add_profile(comparison: Comparison) -> None:
    """Add depth and regime along the profile at the quarters of the common range."""
    pair, axes = comparison.pair, comparison.axes
    rows = np.array([round(stage * (axes.distance.shape[1] - 1)) for stage in STAGES])
    arc = [data["arc_length"].values for data in pair]
    same = arc[0].shape == arc[1].shape and bool(
        np.allclose(arc[0], arc[1], rtol=0.0, atol=1e-9)
    )
    by_regime = _along_regimes(comparison, axes.distance[:, rows])
    if not same:
        by_regime[1] = np.apply_along_axis(
            lambda depth: np.interp(arc[0], arc[1], depth, left=np.nan, right=np.nan),
            -1,
            by_regime[1],
        )
    depth = np.stack([part.sum(axis=3) for part in by_regime], axis=2)
    scale = np.nanmax(depth[:, :, 1], axis=-1, keepdims=True)
    dims = ("basis", "stage", "campaign", "wheel", "arc")
    comparison.add_factor(
        "wear_depth_profile",
        dims,
        depth,
        "wear_depth",
        "wear depth along the profile",
        (
            f"factor only where {comparison.names[1]} wears more than "
            f"{WORN_SHARE:.0%} of its largest depth"
        ),
        scale=scale,
        share=WORN_SHARE,
        reachable=axes.reachable[:, rows],
    )
    regimes = [factors.dominant_regime(np.nan_to_num(part)) for part in by_regime]
    names = ["none", *(name.replace(" ", "_") for name in comparison.regimes)]
    meaning, campaigns = "wear regime that removed most", " and ".join(comparison.names)
    remark = "where it differs, the factor depends on the wear law"
    comparison.add_flags(
        "regime_profile", dims, np.stack(regimes, axis=2), meaning, names, -1
    )
    comparison.add_flags(
        "regime_profile_differs",
        ("basis", "stage", "wheel", "arc"),
        factors.regime_differs(*regimes),
        f"whether the {meaning} differs between {campaigns}",
        ("no_wear", "same", "differs"),
        -1,
        comment=remark,
    )
    new = [
        np.stack([data[f"profile_{axis}"].values[0] for axis in "yz"]) for data in pair
    ]
    if not same or np.abs(new[0] - new[1]).max() > _SAME_PROFILE:
        comparison.notes.append(
            "the new wheel profiles differ: places are compared at equal arc length "
            "from the flange back"
        )


def _along_regimes(comparison: Comparison, distance: FloatArray) -> list[FloatArray]:
    """Wear depth by regime, (basis, stage, wheel, regime of both laws, n)."""
    result = []
    for c, data in enumerate(comparison.pair):
        run, depth = data["distance"].values, data["wear_depth_by_regime"].values
        depth_at = np.stack(
            [at_distances(run, depth, np.nan_to_num(at)) for at in distance[..., c]]
        )
        merged = np.zeros(
            (*depth_at.shape[:3], len(comparison.regimes), depth_at.shape[-1])
        )
        merged[:, :, :, comparison.regime_numbers[c][:-1]] = depth_at
        result.append(merged)
    return result


def add_similarity(comparison: Comparison) -> None:
    """Add the similarity of both depth curves, (basis, stage, wheel)."""
    depth = comparison.variables["wear_depth_profile"][1]
    arc = comparison.pair[0]["arc_length"].values
    alike = factors.similarity(depth[:, :, 0], depth[:, :, 1], arc)
    for name, (unit, meaning) in factors.SIMILARITY.items():
        text = f"{meaning}, of the depth curves of {' and '.join(comparison.names)}"
        comparison.add(name, ("basis", "stage", "wheel"), alike[name], text, unit)


def add_zones(comparison: Comparison) -> None:
    """Add the largest depth by zone, (basis, progress, zone, wheel_group)."""
    borders = [-np.inf, *WHEEL_ZONES.values()]
    limits = [
        f"{name} to y = {1e3 * end:g} mm"
        for name, end in list(WHEEL_ZONES.items())[:-1]
    ]
    remark = "of the new profile: " + ", ".join(limits)
    comparison.add(
        "zone_name",
        "zone",
        list(WHEEL_ZONES),
        "zone of the wheel profile",
        comment=remark,
    )
    rows = []
    for data in comparison.pair:
        depth, y = data["wear_depth"].values, data["profile_y"].values[0]
        within = [(y >= low) & (y < high) for low, high in itertools.pairwise(borders)]
        zones = [np.where(mask, depth, 0.0).max(axis=-1) for mask in within]
        rows.append(factors.with_both(np.stack(zones, axis=1), "largest"))
    comparison.add_rows(
        "zone_depth",
        ("zone", "wheel_group"),
        rows,
        "max_wear_depth",
        "largest wear depth of the zone",
        (
            f"{_BOTH_WHEELS['largest']}; no factor of zones below {WORN_SHARE:.0%} of "
            "the deepest place"
        ),
        scale_axis=(0, 1, 2, 3),
        share=WORN_SHARE,
    )


def add_equivalent_distance(comparison: Comparison) -> None:
    """Add the distance [m] of each campaign that wears as much as the other.

    By depth and by worn area.
    """
    run = [data["distance"].values for data in comparison.pair]
    wears = {
        name: [factors.wear_by_wheel(data, name) for data in comparison.pair]
        for name in EQUIVALENT_BY
    }
    for number, (role, counterpart) in enumerate(
        (comparison.names, comparison.names[::-1])
    ):
        stations = np.linspace(0.0, run[number][-1], comparison.axes.distance.shape[1])
        dims = (f"{role}_progress", "wheel_group")
        comparison.add(
            f"{role}_distance",
            dims[0],
            stations,
            f"distance run by the {role} campaign",
            "m",
        )
        order = slice(None, None, -1 if number else 1)
        for name, meaning in EQUIVALENT_BY.items():
            distances = [
                equivalent_distance(
                    stations, run[order], [wear[:, w] for wear in wears[name][order]]
                )
                for w in range(3)
            ]
            variable, text = (
                f"equivalent_{counterpart}_distance_{name}",
                f"{counterpart} distance of equal {meaning}",
            )
            distance = np.stack(distances, axis=1)
            status = np.where(
                np.isfinite(distance), STATUS["defined"], STATUS["beyond_range"]
            )
            comparison.add(
                variable,
                dims,
                distance,
                text,
                "m",
                ancillary_variables=f"{variable}_status",
            )
            comparison.add_status(variable, dims, status, text)


def answers(
    rig: xr.Dataset, field: xr.Dataset, of: str, distance: float
) -> pd.DataFrame:
    """Distance [km] of a campaign that wears as much as a given one of the other.

    Parameters
    ----------
    rig, field : Dataset
        Results of the two campaigns.
    of : str
        Campaign whose distance is given: "rig" or "field".
    distance : float
        That distance [m].

    Returns
    -------
    DataFrame
        A row for each measure of wear of both wheels together: quantity, distance asked
        for, its answer on the other campaign [km], field distance for each rig
        distance [-], the distance up to which the two campaigns have an answer, and
        what is missing of the distance asked for [km]. Beyond that the answer is NaN:
        nothing is extrapolated.
    """
    pair = (rig, field) if of == CAMPAIGN[0] else (field, rig)
    counterpart = CAMPAIGN[1 - CAMPAIGN.index(of)]
    run = [data["distance"].values for data in pair]
    rows = []
    for name, meaning in EQUIVALENT_BY.items():
        wear = [factors.wear_by_wheel(data, name)[:, 2] for data in pair]
        answer = float(equivalent_distance(np.array([distance]), run, wear)[0])
        end = float(distance_at(wear[0], run[0], wear[1][-1:])[0])
        reach = float(run[0][-1]) if np.isnan(end) else end
        ratio = distance / answer if answer > 0.0 else np.nan
        rows.append(
            {
                "quantity": meaning,
                f"{of}_km": 1e-3 * distance,
                f"{counterpart}_km": 1e-3 * answer,
                "field_km_per_rig_km": ratio if of == CAMPAIGN[1] else 1.0 / ratio,
                f"{of}_km_within_reach": 1e-3 * reach,
                f"{of}_km_missing": 1e-3 * max(distance - reach, 0.0),
            }
        )
    return pd.DataFrame(rows)


def common_laws(
    pair: tuple[xr.Dataset, xr.Dataset], group: str
) -> tuple[list[str], list[str]]:
    """Laws that act in both campaigns.

    Returns
    -------
    same, other : list of str
        Names of laws of a group, "comparison" or "fatigue", with equal settings, and
        with differing ones.
    """
    if any(f"{group}_name" not in data for data in pair):
        return [], []
    rig, field = (_settings(data, group) for data in pair)
    both = [name for name in rig if name in field]
    same = [name for name in both if rig[name] == field[name]]
    return same, [name for name in both if name not in same]


def _settings(dataset: xr.Dataset, group: str) -> dict[str, list[str]]:
    """Return the settings by law."""
    columns = [
        dataset[f"{group}_{key}"].values for key in ("name", *_LAW_SETTINGS[group])
    ]
    rows = zip(*columns, dataset.attrs[f"{group}_numbers"].split("\n"), strict=True)
    return {str(name): [str(value) for value in settings] for name, *settings in rows}


def add_damage(comparison: Comparison) -> None:
    """Add worn area by comparison laws, and fatigue damage.

    By laws of both campaigns with their factors.
    """
    for group, what in (
        ("comparison", "comparison wear law"),
        ("fatigue", "fatigue law"),
    ):
        same, differing = common_laws(comparison.pair, group)
        comparison.notes += [
            f"{what} {name}: its settings differ, it is not compared"
            for name in differing
        ]
        if not same:
            continue
        comparison.add(f"{group}_name", group, same, f"{what} of both campaigns")
        wear = group == "comparison"
        for name in (
            ("comparison_worn_area",)
            if wear
            else ("fatigue_damage", "fatigue_damage_rate")
        ):
            meaning = QUANTITIES[name].meaning.removesuffix(", by regime")
            comparison.add_rows(
                name,
                (group, "wheel_group"),
                [_by_wheel(data, name, same) for data in comparison.pair],
                name,
                meaning if wear else f"largest {meaning} of the wheel",
                _BOTH_WHEELS["sum" if wear else "largest"],
                scale_axis=(0, 1, 2),
            )


def _by_wheel(dataset: xr.Dataset, name: str, laws: list[str]) -> FloatArray:
    """Values of some laws on the right wheel, left wheel and both (step, law, 3)."""
    value = dataset[name].values
    if name == "comparison_worn_area":
        owner = np.array(
            [
                str(text).split(": ", 1)[0]
                for text in dataset["comparison_regime_name"].values
            ]
        )
        wheels = np.stack(
            [value[:, :, owner == law].sum(axis=2) for law in laws], axis=1
        )
        return factors.with_both(wheels, "sum")
    law_names = [str(text) for text in dataset["fatigue_name"].values]
    wheels = value.max(axis=3)[:, :, [law_names.index(law) for law in laws]].swapaxes(
        1, 2
    )
    return factors.with_both(wheels, "largest")


PARTS = (
    add_distance,
    add_wear,
    add_contact,
    add_zones,
    add_profile,
    add_similarity,
    add_equivalent_distance,
    add_damage,
)
"""Parts of a comparison in order; similarity is that of the profiles before it."""
