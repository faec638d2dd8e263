"""Factors that carry a rig result to the field: pure functions on two result datasets.

A dataset is what the result file of one campaign holds. A factor is always rig over
field. Where it has no meaning it is NaN in memory and its status says why; files hold a
fill value there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.damage.fatigue.loads import WEAR_NUMBERS
from wearsim.results.settings import SETTINGS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class CommonAxes:
    """Stations at which two campaigns are compared: distance and depth [m].

    Basis 0: equal distance, 1: equal worn depth, 2: equal worn area.
    """

    distance: (
        FloatArray  # (3, k, 2) run, by basis, progress and campaign (rig, field) [m]
    )
    depth: FloatArray  # (3, k, 2) largest wear depth of the two wheels there [m]
    reachable: NDArray[np.bool_]  # (3, k) whether both campaigns reach it


def at_distances(
    distance: FloatArray, values: FloatArray, targets: FloatArray
) -> FloatArray:
    """Interpolate linearly between the rows (step, ...) of a result.

    At distances (k,) within its range [m].

    Returns
    -------
    (k, ...) array
        The row itself where a target meets one, so that a neighbour without value does
        no harm; between equal rows their bits.
    """
    left = rows_at(distance, targets)
    right = np.minimum(left + 1, distance.size - 1)
    gap = distance[right] - distance[left]
    part = np.divide(
        targets - distance[left], gap, out=np.zeros_like(gap), where=gap > 0.0
    )
    part = part.reshape(part.shape + (1,) * (values.ndim - 1))
    return np.where(
        part == 0.0, values[left], values[left] + part * (values[right] - values[left])
    )


def rows_at(distance: FloatArray, targets: FloatArray) -> IntArray:
    """Row of the last stored state at or before each distance, (k,) int array."""
    return np.clip(
        np.searchsorted(distance, targets, side="right") - 1, 0, distance.size - 1
    )


def distance_at(
    growing: FloatArray, distance: FloatArray, targets: FloatArray
) -> FloatArray:
    """Distance [m] at which a growing measure (step,) first reaches targets (k,).

    Returns
    -------
    (k,) array
        Distance [m], NaN beyond what the campaign reached.
    """
    level = np.maximum.accumulate(growing)
    after = np.minimum(np.searchsorted(level, targets, side="left"), level.size - 1)
    before = np.maximum(after - 1, 0)
    rise = level[after] - level[before]
    # a standstill ends where the next rise begins, so the part counts from the last row
    # of the lower level
    part = np.divide(
        targets - level[before], rise, out=np.ones_like(rise), where=rise > 0.0
    )
    reached = np.where(
        part == 1.0,
        distance[after],
        distance[before] + part * (distance[after] - distance[before]),
    )
    return np.where(
        targets <= level[-1],
        np.where(targets <= level[0], distance[0], reached),
        np.nan,
    )


def equivalent_distance(
    distance: FloatArray, run: Sequence[FloatArray], wear: Sequence[FloatArray]
) -> FloatArray:
    """Distance [m] of a campaign with the wear of another one at given distances.

    Parameters
    ----------
    distance : (k,) array
        Distances of the first campaign [m].
    run, wear : two (step,) arrays each
        Distance [m] and a measure of wear of both campaigns, the first one first.

    Returns
    -------
    (k,) array
        Distance of the second campaign [m], NaN where one of them ends before.
    """
    within = np.where(distance <= run[0][-1], distance, np.nan)
    defined = np.isfinite(within)
    equivalent = np.full(distance.shape, np.nan)
    equivalent[defined] = distance_at(
        wear[1], run[1], at_distances(run[0], wear[0], within[defined])
    )
    return equivalent


def common_axes(
    rig: xr.Dataset,
    field: xr.Dataset,
    count: int = 41,
    reach: Sequence[float] | None = None,
) -> CommonAxes:
    """Lay `count` stations over the common range, equally spaced by each basis.

    Worn depth is the larger one of the two wheels, worn area the sum of both. Without
    wear in one campaign only the new wheel can be compared at equal depth or area.
    `reach` gives the range of each basis as other campaigns cover it: stations beyond
    that of these are not reachable, and NaN.
    """
    run = [data["distance"].values for data in (rig, field)]
    worst = [data["max_wear_depth"].max("wheel").values for data in (rig, field)]
    bases = (
        run,
        worst,
        [data["worn_area"].sum("wheel").values for data in (rig, field)],
    )
    part = np.linspace(0.0, 1.0, count)
    distance, depth = np.empty((2, len(bases), count, 2))
    reachable = np.ones((len(bases), count), dtype=bool)
    for b, measure in enumerate(bases):
        common = min(measure[0][-1], measure[1][-1])
        equal = part * (common if reach is None else reach[b])
        reachable[b, 1:] = (equal[1:] <= common * (1.0 + 1e-12)) & (equal[-1] > 0.0)
        equal = np.minimum(equal, common)
        for c in (0, 1):
            distance[b, :, c] = (
                equal if measure is run else distance_at(measure[c], run[c], equal)
            )
            at_station = at_distances(run[c], worst[c], distance[b, :, c])
            depth[b, :, c] = equal if measure is worst else at_station
    return CommonAxes(distance, depth, reachable)


_STATUS = (
    "defined",
    "zero_denominator",
    "missing",
    "beyond_range",
    "small_denominator",
)
STATUS: dict[str, int] = {name: number for number, name in enumerate(_STATUS)}
"""Why a factor is undefined; `small_denominator`: not zero, but too small to divide
by.
"""

ZERO_SHARE = 1e-6
"""A denominator below this share of the largest magnitude of its quantity is too small
to divide by.
"""

CONTACT_SHARE = 1e-3
"""The same for quantities that vanish by symmetry: they leave a remainder of about this
size. (Power and wear, which grow with its square, then leave one of `ZERO_SHARE`.)
"""

SYMMETRIC = ("creepage_x", "creepage_y", "spin", "force_x", "force_y")
"""Quantities that vanish by symmetry."""

CHANGE_SHARE = 1e-2
"""The same for changes of the wheel shape, which may go through zero while the wheel
wears.
"""

WORN_SHARE = 0.01
"""Along the profile, a depth below this share of the largest one counts as not worn:
what smoothing spreads beyond the running band is not compared.
"""

MATCH_KEYS: Mapping[str, float] = {
    "shift": 1e-9,
    "yaw": 1e-9,
    "roll": 1e-9,
    "wheel_load": 1e-3,
    "speed": 1e-9,
    "friction": 1e-9,
    "track_curvature": 1e-12,
}
"""Conditions that two operating points must share to be compared, with the rounding
allowed [SI unit of each].
"""

TURNING_KEYS: Mapping[str, float] = {
    "applied_torque": 1e-6,
    "applied_torque_difference": 1e-6,
    "roller_speed_difference": 1e-12,
}
"""Further conditions, 0 where results do not hold them."""

POINT_QUANTITIES: Mapping[str, str] = {
    "area": "sum",
    "max_pressure": "largest",
    "normal_force": "sum",
    "creepage_x": "load-weighted mean",
    "creepage_y": "load-weighted mean",
    "spin": "load-weighted mean",
    "force_x": "sum",
    "force_y": "sum",
    "slip_area": "sum",
    "power": "sum",
    "wear_number_without_spin": "sum",
    "wear_number_with_spin": "sum",
    "wear_index_mean": "area-weighted mean",
    "wear_index_max": "largest",
    "wear_area_rate": "sum",
    "wear_depth_rate_max": "largest",
}
"""Quantities of operating points that are compared, in the order of tables, and how the
patches of one wheel make one value.
"""

WEAR_QUANTITIES: Mapping[str, str] = {
    "max_wear_depth": "largest",
    "worn_area": "sum",
    "worn_mass": "sum",
    "flange_height": "change",
    "flange_thickness": "change",
    "flange_gradient": "change",
    "hollowing": "change",
}
"""Measures of wear that are compared, in the order of tables, and how both wheels make
one value; "change": from the new wheel, of both the larger magnitude.
"""

SIMILARITY: Mapping[str, tuple[str, str]] = {
    "depth_correlation": ("1", "correlation over the places worn on either"),
    "depth_shift": (
        "m",
        "centroid of the first curve less that of the second one, along the arc",
    ),
    "depth_width": (
        "1",
        "ratio of widths, twice the standard deviation of place each, first over "
        "second",
    ),
    "depth_overlap": (
        "1",
        "common share of the curves, each normalised to area one",
    ),
}
"""Similarity of two depth curves along the profile: unit, meaning."""

_WEAR_NUMBERS: dict[str, Callable[[Any], Any]] = {
    f"wear_number_{kind}": number for kind, number in WEAR_NUMBERS.items()
}


class Factor(NamedTuple):
    """Values (...) of rig over field, NaN where undefined [-], and why undefined.

    `status` is 0 where defined, else a number of `STATUS`.
    """

    value: FloatArray
    status: IntArray


def ratio(
    rig: FloatArray,
    field: FloatArray,
    scale: FloatArray | float,
    share: float = ZERO_SHARE,
    reachable: NDArray[np.bool_] | bool = True,
) -> Factor:
    """Divide the values (...) of one quantity, rig by field, where that has meaning.

    `scale` is the magnitude the quantity has where it matters: denominators below
    `share` of it are too small to divide by. Values are NaN where there is none;
    `reachable` is False where a campaign ends before.
    """
    rig, field, scale_, reached = np.broadcast_arrays(rig, field, scale, reachable)
    status = np.full(rig.shape, STATUS["defined"], dtype=np.int64)
    with np.errstate(invalid="ignore"):
        status[~(np.abs(field) > share * scale_)] = STATUS["small_denominator"]
    status[field == 0.0] = STATUS["zero_denominator"]
    status[~(np.isfinite(rig) & np.isfinite(field))] = STATUS["missing"]
    status[~reached] = STATUS["beyond_range"]
    value = np.full(rig.shape, np.nan)
    defined = status == STATUS["defined"]
    value[defined] = rig[defined] / field[defined]
    return Factor(value, status)


def zero_share(name: str) -> float:
    """Share of the largest magnitude below which a quantity is too small to divide by.

    The one rule.
    """
    if name in SYMMETRIC:
        return CONTACT_SHARE
    return CHANGE_SHARE if WEAR_QUANTITIES.get(name) == "change" else ZERO_SHARE


def rotation_matches(rig: xr.Dataset, field: xr.Dataset) -> bool:
    """Return True if the wheelsets of two campaigns turn and roll by the same rules.

    Under the same axle torque.

    False also where the rule is unknown, or where rotation speeds were given: they are
    not stored.
    """
    keys = [setting.name for setting in SETTINGS.values() if setting.of_points]
    stored = (
        all(key in rig.attrs for key in keys) and rig.attrs["rotation_rule"] != "given"
    )
    return stored and all(rig.attrs[key] == field.attrs.get(key) for key in keys)


def per_wheel(dataset: xr.Dataset, name: str) -> FloatArray:
    """Value per wheel from its contact patches, by `POINT_QUANTITIES` [SI].

    Forces are those in the contact planes: patches of different contact angle add their
    components as they are.

    Returns
    -------
    (step, operating_point, 2) array
        NaN where the wheel has no contact patch [SI unit of the quantity].
    """
    rule = POINT_QUANTITIES[name]
    # results of version 0.2.0 without fatigue laws hold what the wear numbers are made
    # of
    value = (
        dataset[name].values if name in dataset else _WEAR_NUMBERS[name](dataset).values
    )
    on_wheel = np.stack(
        [(dataset["side"].values == wheel) & np.isfinite(value) for wheel in (0, 1)]
    )
    if rule == "largest":
        combined = np.where(on_wheel, value, -np.inf).max(axis=-1)
    elif rule == "sum":
        combined = np.where(on_wheel, value, 0.0).sum(axis=-1)
    else:
        weight = dataset["normal_force" if rule.startswith("load") else "area"].values
        total = np.where(on_wheel, weight, 0.0).sum(axis=-1)
        sums = np.where(on_wheel, value * weight, 0.0).sum(axis=-1)
        combined = np.divide(
            sums, total, out=np.full_like(total, np.nan), where=total > 0.0
        )
    return np.moveaxis(np.where(on_wheel.any(axis=-1), combined, np.nan), 0, -1)


def between_solutions(dataset: xr.Dataset, values: FloatArray) -> FloatArray:
    """Fill values (step, operating_point, ...) where a point was not solved.

    Linear in distance between rows.

    Rows of a programme hold only the points that acted. NaN where no later row has a
    point: it was left out.
    """
    solved, run = dataset["n_patch"].values > 0, dataset["distance"].values
    result = np.array(values)
    for point in np.flatnonzero(~solved.all(axis=0)):
        rows = np.flatnonzero(solved[:, point])
        gone = np.flatnonzero(~solved[:, point])
        gone = gone[(gone > rows.min(initial=run.size)) & (gone < rows.max(initial=0))]
        if gone.size:
            result[gone, point] = at_distances(
                run[rows], values[rows, point], run[gone]
            )
    return result


def collective_mean(values: FloatArray, weight: FloatArray) -> FloatArray:
    """Mean magnitude over a load collective of a quantity.

    By wheel, (step, operating_point, 2) -> (step, 2).

    The magnitude counts, since shifts to both sides would cancel. Points of weight 0
    (monitoring points) do not count; NaN where a point that counts has no contact
    patch.
    """
    counts = weight > 0.0
    if not counts.any():
        return np.full((values.shape[0], values.shape[2]), np.nan)
    share = weight[counts] / weight[counts].sum()
    return np.asarray(np.einsum("spw,p->sw", np.abs(values[:, counts]), share))


def match_points(rig: xr.Dataset, field: xr.Dataset) -> IntArray:
    """Operating points that both campaigns solved, monitoring points included.

    Returns
    -------
    (k, 2) int array
        Index in the rig and in the field campaign; equal points of one campaign count
        once. None where the wheelsets turn by different rules or under different
        torque.
    """
    if not rotation_matches(rig, field):
        return np.empty((0, 2), dtype=np.int64)
    rig_values, field_values = (
        np.nan_to_num(_matched_values(data), nan=np.inf) for data in (rig, field)
    )
    tolerance = np.array(
        [
            *MATCH_KEYS.values(),
            MATCH_KEYS["friction"],
            *[MATCH_KEYS["wheel_load"]] * 2,
            *TURNING_KEYS.values(),
        ]
    )
    pairs: dict[int, int] = {}  # rig by field
    for i in range(rig.sizes["operating_point"]):
        equals = np.flatnonzero(
            np.isclose(
                field_values, rig_values[:, i, None], rtol=0.0, atol=tolerance[:, None]
            ).all(axis=0)
        )
        if equals.size:
            pairs.setdefault(int(equals[0]), i)
    return np.array([(i, j) for j, i in pairs.items()], dtype=np.int64).reshape(-1, 2)


def _matched_values(data: xr.Dataset) -> FloatArray:
    """`MATCH_KEYS`, friction on the flange.

    Loads of both new wheels, `TURNING_KEYS`, (m, n) of points.
    """
    keys = [data[key].values for key in MATCH_KEYS]
    flange = data.get("flange_friction", data["friction"]).values
    loads = (
        data["wheel_loads"].values[0].T
        if "wheel_loads" in data
        else [data["wheel_load"].values] * 2
    )
    nothing = np.zeros(flange.size)
    turning = [data[key].values if key in data else nothing for key in TURNING_KEYS]
    return np.stack([*keys, flange, *loads, *turning])


def wear_by_wheel(dataset: xr.Dataset, name: str) -> FloatArray:
    """Wear quantity of the right wheel, the left wheel and both, (step, 3) [SI]."""
    value, rule = dataset[name].values, WEAR_QUANTITIES[name]
    return with_both(value - value[0] if rule == "change" else value, rule)


def with_both(value: FloatArray, rule: str) -> FloatArray:
    """Append that of both to the values (..., 2) of the wheels.

    "sum", "largest", or largest "change".
    """
    right, left = value[..., 0], value[..., 1]
    if rule == "change":
        finite = np.isfinite(right + left)
        both = np.where(
            finite, np.where(np.abs(right) >= np.abs(left), right, left), np.nan
        )
    else:
        both = right + left if rule == "sum" else np.maximum(right, left)
    return np.concatenate([value, both[..., None]], axis=-1)


def similarity(
    rig: FloatArray, field: FloatArray, arc: FloatArray
) -> dict[str, FloatArray]:
    """Similarity of two depth curves (..., n) over one arc length (n,).

    Returns
    -------
    dict of (...) arrays
        By the names of `SIMILARITY`: correlation of the depths [-], distance of the
        centroids [m], ratio of the widths [-] and overlap of the normalised curves [-];
        NaN where one of them has no wear.
    """
    length = np.gradient(arc)
    # what smoothing spreads beyond the running band is no wear, and places one campaign
    # lacks are neither
    curves = [np.nan_to_num(depth) for depth in (rig, field)]
    curves = [
        np.where(d > WORN_SHARE * d.max(axis=-1, keepdims=True), d, 0.0) for d in curves
    ]
    with np.errstate(invalid="ignore", divide="ignore"):
        parts = [d * length / (d * length).sum(axis=-1, keepdims=True) for d in curves]
        place = [(part * arc).sum(axis=-1) for part in parts]
        width = [
            np.sqrt((part * (arc - at[..., None]) ** 2).sum(axis=-1))
            for part, at in zip(parts, place, strict=True)
        ]
        either = np.where((parts[0] > 0.0) | (parts[1] > 0.0), length, 0.0)
        mean = [
            (d * either).sum(axis=-1, keepdims=True) / either.sum(axis=-1)[..., None]
            for d in curves
        ]
        a, b = (d - m for d, m in zip(curves, mean, strict=True))
        varied = np.sqrt((a * a * either).sum(axis=-1) * (b * b * either).sum(axis=-1))
        correlation = (a * b * either).sum(axis=-1) / varied
    overlap = np.minimum(parts[0], parts[1]).sum(axis=-1)
    values = (correlation, place[0] - place[1], width[0] / width[1], overlap)
    return dict(zip(SIMILARITY, values, strict=True))


def dominant_regime(depth_by_regime: FloatArray, share: float = WORN_SHARE) -> IntArray:
    """Index (..., n) of the regime with most of a depth (..., regime, n) along it.

    -1 where not worn, or less than `share` of the deepest place.
    """
    total = depth_by_regime.sum(axis=-2)
    worn = (total > share * total.max(axis=-1, keepdims=True)) & (total > 0.0)
    return np.where(worn, depth_by_regime.argmax(axis=-2), -1)


def regime_differs(rig: IntArray, field: IntArray) -> IntArray:
    """1 where both have a regime and not the same, 0 where the same, -1 if none."""
    return np.where((rig < 0) | (field < 0), -1, (rig != field).astype(np.int64))
