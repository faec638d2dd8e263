"""Parts of the comparison dataset: wear, contact, profile, equivalent distance.

Each function adds variables to `out`, a mapping as `xarray.Dataset` takes it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.translation import factors
from wearsim.translation.axes import CommonAxes, FloatArray, IntArray, at_distances, rows_at
from wearsim.translation.factors import STATUS, WORN_SHARE, Factor

CAMPAIGN = ("rig", "field")
STAGES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the common range at which values along the profile are compared."""

_BOTH_WHEELS = {
    "sum": "both wheels: sum",
    "largest": "both wheels: the larger one",
    "change": "both wheels: the change of larger magnitude",
}
_BARE = ("wear_area_rate", "wear_depth_rate_max")  # of the law as it is

Pair = tuple[xr.Dataset, xr.Dataset]


def add_quantity(
    out: dict[str, Any], variable: str, dims: tuple[str, ...], values: FloatArray, factor: Factor,
    quantity: str, meaning: str, comment: str, share: float | None = None,
) -> None:  # fmt: skip
    """Add values (with a campaign dimension), their factor and its status; `share` as for `factors.ratio`."""
    attrs = {"units": QUANTITIES[quantity].unit, "long_name": meaning, "quantity": quantity}
    out[variable] = (dims, values, attrs | ({"comment": comment} if comment else {}))
    rest = tuple(dim for dim in dims if dim != "campaign")
    out[f"{variable}_factor"] = (
        rest,
        factor.value,
        {"units": "1", "long_name": f"{meaning}, rig over field", "quantity": quantity,
         "ancillary_variables": f"{variable}_factor_status"},
    )  # fmt: skip
    share = factors.zero_share(quantity) if share is None else share
    remark = {
        "comment": f"a field value below the part {share:g} of the largest one is too small to divide by"
    }
    out[f"{variable}_factor_status"] = (rest, factor.status.astype(np.int8), _status_attrs(meaning) | remark)


def _status_attrs(meaning: str) -> dict[str, Any]:
    return {
        "long_name": f"why the factor of {meaning} is undefined, if it is",
        "flag_values": np.array(list(STATUS.values()), dtype=np.int8),
        "flag_meanings": " ".join(STATUS),
    }


def add_compared(
    out: dict[str, Any], variable: str, dims: tuple[str, ...], values: FloatArray, axes: CommonAxes,
    quantity: str, meaning: str, comment: str = "", scale_axis: tuple[int, ...] | None = None,
) -> None:  # fmt: skip
    """Add values (basis, progress, campaign, *dims) with their factor; `scale_axis`: axes with one scale."""
    scale = np.nan_to_num(np.abs(values)).max(axis=scale_axis)
    reach = axes.reachable.reshape(axes.reachable.shape + (1,) * len(dims))
    factor = factors.ratio(values[:, :, 0], values[:, :, 1], scale, factors.zero_share(quantity), reach)
    add_quantity(
        out, variable, ("basis", "progress", "campaign", *dims), values, factor, quantity, meaning, comment
    )


def along(pair: Pair, values: list[FloatArray], distance: FloatArray) -> FloatArray:
    """Rows of both campaigns at (basis, k, campaign) distances -> (basis, k, campaign, ...)."""
    run = [np.asarray(data["distance"].values, dtype=np.float64) for data in pair]
    return np.stack(
        [
            np.stack([at_distances(run[c], values[c], distance[b, :, c]) for c in (0, 1)], axis=1)
            for b in (0, 1)
        ]
    )


def add_distance(out: dict[str, Any], axes: CommonAxes) -> None:
    """Add the distances where the campaigns are compared and their factor, (basis, progress)."""
    run = axes.distance
    factor = factors.ratio(
        run[..., 0], run[..., 1], float(np.nan_to_num(run).max()), reachable=axes.reachable
    )
    add_quantity(
        out, "distance_run", ("basis", "progress", "campaign"), run, factor, "distance",
        "distance run where the campaigns are compared", "",
    )  # fmt: skip


def add_wear(out: dict[str, Any], pair: Pair, axes: CommonAxes) -> None:
    """Add wear measures and conicity with their factors, (basis, progress, wheel_group)."""
    for name, rule in factors.WEAR_QUANTITIES.items():
        values = along(pair, [factors.wear_by_wheel(data, name) for data in pair], axes.distance)
        change = rule == "change"
        meaning = QUANTITIES[name].meaning + (", change from new" if change else "")
        # the scale is what the campaigns reach: at the new wheel all wear is zero
        add_compared(
            out, f"{name}_change" if change else name, ("wheel_group",), values, axes, name, meaning,
            _BOTH_WHEELS[rule], scale_axis=(0, 1, 2),
        )  # fmt: skip
    conicity = along(pair, [np.asarray(data["equivalent_conicity"].values) for data in pair], axes.distance)
    meaning = QUANTITIES["equivalent_conicity"].meaning
    add_compared(out, "equivalent_conicity", (), conicity, axes, "equivalent_conicity", meaning)


def add_contact(out: dict[str, Any], pair: Pair, axes: CommonAxes) -> int:
    """Add contact quantities of the collective and of equal operating points; return how many are equal."""
    matched = factors.match_points(*pair)
    for name, rule in factors.POINT_QUANTITIES.items():
        meaning = QUANTITIES[name].meaning
        remark = "; the environment factor does not enter" if name in _BARE else ""
        wheels = [factors.per_wheel(data, name) for data in pair]
        weight = [np.asarray(data["weight"].values, dtype=np.float64) for data in pair]
        means = [factors.collective_mean(wheels[c], weight[c]) for c in (0, 1)]
        means = [np.column_stack([mean, mean.mean(axis=1)]) for mean in means]
        add_compared(
            out, f"{name}_collective", ("wheel_group",), along(pair, means, axes.distance), axes, name,
            f"{meaning}, collective mean",
            f"mean magnitude, weighted with the shares of the load collective; patches of a wheel: {rule}; "
            f"both wheels: mean{remark}",
        )  # fmt: skip
        if len(matched):
            values = along(pair, [wheels[c][:, matched[:, c]] for c in (0, 1)], axes.distance)
            add_compared(
                out, f"{name}_point", ("matched_point", "wheel"), values, axes, name,
                f"{meaning} at equal operating points",
                f"patches of a wheel: {rule}; linear between stored states{remark}",
            )  # fmt: skip
    if len(matched):
        _add_points(out, pair, axes, matched)
    return len(matched)


def _regime_names(pair: Pair) -> tuple[list[str], list[IntArray]]:
    """Names of both laws' regimes in one list, and each law's numbers in that list (last entry: -1)."""
    own = [[str(name) for name in data["regime_name"].values] for data in pair]
    names = own[0] + [name for name in own[1] if name not in own[0]]
    return names, [np.array([names.index(name) for name in one] + [-1]) for one in own]


def _add_regimes(
    out: dict[str, Any],
    variable: str,
    dims: tuple[str, ...],
    regime: IntArray,
    names: list[str],
    meaning: str,
) -> None:
    """Add wear regimes (basis, ., campaign, ...) and whether they differ between rig and field."""
    out[variable] = (
        dims, regime.astype(np.int8), {
            "long_name": meaning,
            "flag_values": np.arange(-1, len(names), dtype=np.int8),
            "flag_meanings": " ".join(["none", *(name.replace(" ", "_") for name in names)]),
        },
    )  # fmt: skip
    out[f"{variable}_differs"] = (
        tuple(dim for dim in dims if dim != "campaign"),
        factors.regime_differs(regime[:, :, 0], regime[:, :, 1]).astype(np.int8), {
            "long_name": f"whether the {meaning} differs between rig and field",
            "comment": "where it differs, the factor depends on the wear law",
            "flag_values": np.array([-1, 0, 1], dtype=np.int8),
            "flag_meanings": "no_wear same differs",
        },
    )  # fmt: skip


def _add_points(out: dict[str, Any], pair: Pair, axes: CommonAxes, matched: IntArray) -> None:
    for name in factors.MATCH_KEYS:
        attrs = {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].meaning}
        values = np.asarray(pair[0][name].values, dtype=np.float64)
        out[name] = ("matched_point", values[matched[:, 0]], attrs)
    for c, role in enumerate(CAMPAIGN):
        labels = [str(pair[c]["operating_point_name"].values[i]) for i in matched[:, c]]
        out[f"{role}_label"] = (
            "matched_point",
            labels,
            {"long_name": f"operating point of the {role} campaign"},
        )
    names, numbers = _regime_names(pair)
    dims = ("basis", "progress", "campaign", "matched_point", "wheel")
    regime = np.empty((2, axes.distance.shape[1], 2, len(matched), 2), dtype=np.int64)
    for c, data in enumerate(pair):
        own = numbers[c][factors.highest_regime(data)][:, matched[:, c]]
        run = np.asarray(data["distance"].values)
        for b in (0, 1):
            regime[b, :, c] = own[rows_at(run, axes.distance[b, :, c])]
    meaning = "highest wear regime of any cell at equal operating points"
    _add_regimes(out, "regime_point", dims, regime, names, meaning)
    out["regime_point"][2]["comment"] = (
        "in the order of the law; of the last stored state at or before the distance"
    )


def add_profile(out: dict[str, Any], pair: Pair, axes: CommonAxes) -> list[str]:
    """Add wear depth and wear regime along the profile at the quarters of the common range."""
    count = axes.distance.shape[1]
    rows = np.array([round(stage * (count - 1)) for stage in STAGES])
    distance, reach = axes.distance[:, rows], axes.reachable[:, rows]
    names, numbers = _regime_names(pair)
    arc = [np.asarray(data["arc_length"].values, dtype=np.float64) for data in pair]
    same = arc[0].shape == arc[1].shape and bool(np.allclose(arc[0], arc[1], rtol=0.0, atol=1e-9))
    by_regime = _along_regimes(pair, distance, names, numbers)
    if not same:
        field_on_rig = [
            np.apply_along_axis(lambda d: np.interp(arc[0], arc[1], d, left=np.nan, right=np.nan), -1, part)
            for part in by_regime[1]
        ]
        by_regime[1] = np.stack(field_on_rig)
    depth = np.stack([part.sum(axis=3) for part in by_regime], axis=2)
    scale = np.nanmax(depth[:, :, 1], axis=-1, keepdims=True)
    factor = factors.ratio(depth[:, :, 0], depth[:, :, 1], scale, WORN_SHARE, reach[:, :, None, None])
    dims = ("basis", "stage", "campaign", "wheel", "arc")
    add_quantity(
        out, "wear_depth_profile", dims, depth, factor, "wear_depth", "wear depth along the profile",
        f"factor only where the field wears more than {WORN_SHARE:.0%} of its largest depth", WORN_SHARE,
    )  # fmt: skip
    regime = np.stack([factors.dominant_regime(np.nan_to_num(part)) for part in by_regime], axis=2)
    _add_regimes(out, "regime_profile", dims, regime, names, "wear regime that removed most")
    if same:
        shift = max(
            float(np.abs(pair[0][n].values[0] - pair[1][n].values[0]).max())
            for n in ("profile_y", "profile_z")
        )
        if shift <= 1e-7:
            return []
    return ["the new wheel profiles differ: places are compared at equal arc length from the flange back"]


def _along_regimes(
    pair: Pair, distance: FloatArray, names: list[str], numbers: list[IntArray]
) -> list[FloatArray]:
    """Wear depth by regime of each campaign, (basis, stage, wheel, regime of both laws, n)."""
    result = []
    for c, data in enumerate(pair):
        run = np.asarray(data["distance"].values, dtype=np.float64)
        depth = np.asarray(data["wear_depth_by_regime"].values, dtype=np.float64)
        own = np.stack([at_distances(run, depth, np.nan_to_num(distance[b, :, c])) for b in (0, 1)])
        merged = np.zeros((*own.shape[:3], len(names), own.shape[-1]))
        merged[:, :, :, numbers[c][:-1]] = own
        result.append(merged)
    return result


def add_equivalent_distance(out: dict[str, Any], pair: Pair, count: int) -> None:
    """Add the field distance that wears as much as the rig, by largest depth and by worn area."""
    run = [np.asarray(data["distance"].values, dtype=np.float64) for data in pair]
    asked = np.linspace(0.0, run[0][-1], count)
    out["rig_distance"] = ("rig_progress", asked, {"units": "m", "long_name": "distance run on the rig"})
    for name, meaning in (("max_wear_depth", "largest wear depth"), ("worn_area", "worn area")):
        mine, theirs = (factors.wear_by_wheel(data, name) for data in pair)
        reached = [
            factors.equivalent_distance(at_distances(run[0], mine[:, w], asked), theirs[:, w], run[1])
            for w in range(3)
        ]
        dims = ("rig_progress", "wheel_group")
        variable = f"equivalent_distance_{name}"
        distance, status = (np.stack(parts, axis=1) for parts in zip(*reached, strict=True))
        text = f"field distance of equal {meaning}"
        attrs = {"units": "m", "long_name": text, "ancillary_variables": f"{variable}_status"}
        out[variable] = (dims, distance, attrs)
        out[f"{variable}_status"] = (dims, status.astype(np.int8), _status_attrs(text))
