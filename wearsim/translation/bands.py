r"""Bands.

What uncertain inputs leave open of the wear of a campaign, of factors, and of the order
of steels.

Draws are eight independent scrambles of Sobol points, draw d of scramble d modulo 8:
the scatter of a quantile over the scrambles is its standard error [1]_. A band reaches
from the 5 % to the 95 % quantile.

References
----------
.. [1] A. B. Owen, "Monte Carlo variance of scrambled net quadrature", SIAM J. Numer.
       Anal. 34 (1997) 1884-1910, doi:10.1137/S0036142994277468.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES, kilometres
from wearsim.results.file import UNREADABLE, load_derived
from wearsim.results.limits import LIMITED, limits_met
from wearsim.results.service_life import service_life
from wearsim.translation import factors
from wearsim.translation.factors import FloatArray, IntArray, at_distances
from wearsim.translation.translate import WHEELS, content_hash, translate

QUANTILES = (0.05, 0.5, 0.95)
SCRAMBLES = 8
SURE = 0.05
"""Standard error of a quantile, over the width of its band, from which on more draws
would move it.
"""
LEAST_Q2 = 0.8
"""Of leave-one-out predictions by the surrogate, for shares of the variance."""

PER_KM: Mapping[str, str] = {
    "field_distance_per_rig_distance_by_depth": (
        "field distance per rig distance of equal largest depth"
    ),
    "field_distance_per_rig_distance_by_area": (
        "field distance per rig distance of equal worn area"
    ),
}
"""What 1 km on the rig stands for, as far as both campaigns have worn."""

SERVICE: Mapping[str, tuple[str, str]] = {
    "reprofiling_interval": ("mean distance between reprofilings", "km"),
    "reprofiling_loss": ("loss of diameter at each reprofiling", "mm"),
    "service_life": ("distance to the end of the life", "km"),
}
"""Measures of wheels that are reprofiled: meaning, and the unit they are shown in."""

_BOOTSTRAPS = 200
_ALONG = (
    "wear_depth",
)  # of which the band is added to the nominal value, not multiplied
_OBSERVED = ("_met", "_reprofiling_interval")  # distances to events within the way
_STATIONS = ("distance_run", "worn_depth", "worn_area_reached")
_NO_BAND = {"matched_point", "stage", "arc"}


def values_of(
    results: Mapping[str, xr.Dataset], like: xr.Dataset | None = None
) -> xr.Dataset:
    """Gather the quantities with bands from the results of one draw [SI].

    Parameters
    ----------
    results : mapping of str to Dataset
        By role: rig, field or both.
    like : Dataset, optional
        The same of the nominal values: distances, depths and areas are its.

    Returns
    -------
    Dataset
        Measures of each campaign over shares of its distance, `rig_worn_area` (rig_way,
        wheel_group) and so on, depth along the profile at the end, distances to
        limits [m]; of rig and field their factors as `translate` names them.
    """
    variables: dict[str, Any] = {}
    attrs: dict[str, Any] = {"ends": {}}

    def add(
        name: str, dims: Any, values: Any, unit: str, meaning: str, **more: str
    ) -> None:
        variables[name] = (dims, values, {"units": unit, "long_name": meaning} | more)

    for role, data in results.items():
        run, along = data["distance"].values, f"{role}_way"
        attrs[f"{role}_sha256"] = content_hash(data)
        attrs["ends"][role] = float(run[-1])
        way = np.linspace(0.0, run[-1], 41) if like is None else like[along].values
        add(along, along, way, "m", f"distance run by the {role} campaign")
        for name, rule in factors.WEAR_QUANTITIES.items():
            measure = at_distances(
                run, factors.wear_by_wheel(data, name), np.minimum(way, run[-1])
            )
            measure[way > run[-1] * (1.0 + 1e-12)] = np.nan
            meaning = QUANTITIES[name].meaning + (
                ", change from new" if rule == "change" else ""
            )
            dims = (along, "wheel_group")
            add(
                f"{role}_{name}",
                dims,
                measure,
                QUANTITIES[name].unit,
                meaning,
                quantity=name,
            )
        arc, depth = data["arc_length"].values, data["wear_depth"].values[-1]
        add(f"{role}_arc", f"{role}_arc", arc, "m", "arc length of the new wheel")
        meaning = f"wear depth at the end of the {role} campaign"
        add(f"{role}_wear_depth", ("wheel", f"{role}_arc"), depth, "m", meaning)
        for limit in limits_met(data):
            met = min((at for at in limit.distance if at is not None), default=np.inf)
            add(
                f"{role}_{limit.name}_met",
                (),
                met,
                "m",
                f"distance to the limit of {limit.name}, {role}",
            )
        life = service_life(data)
        if life is not None:
            # A draw that is not reprofiled in its distance is so beyond it.
            interval = life.interval if life.reprofilings else np.inf
            values = {
                "reprofiling_interval": interval,
                "reprofiling_loss": life.loss,
                "service_life": life.distance,
            }
            for name, value in values.items():
                add(f"{role}_{name}", (), value, "m", f"{SERVICE[name][0]}, {role}")
    if len(results) < 2:
        return xr.Dataset(
            variables | {"wheel_group_name": ("wheel_group", list(WHEELS))}, attrs=attrs
        )
    reach = None if like is None else like.attrs["reach"]
    pair = translate(results["rig"], results["field"], reach=reach)
    for key, factor in pair.data_vars.items():
        if str(key).endswith("_factor") and not _NO_BAND & set(map(str, factor.dims)):
            variables[str(key)] = factor.variable
    for basis, (key, meaning) in enumerate(PER_KM.items(), start=1):
        with np.errstate(divide="ignore"):
            add(
                key,
                "progress",
                1.0 / pair["distance_run_factor"].values[basis],
                "1",
                meaning,
            )
    ends = (
        pair["distance_run"][0, -1, 0],
        pair["worn_depth"][1, -1, 0],
        pair["worn_area"][2, -1, :, 2].min(),
    )
    names = (
        "basis_name",
        "wheel_group_name",
        "zone_name",
        "distance_run",
        "worn_depth",
    )
    variables |= {name: pair[name] for name in names} | {
        "worn_area_reached": pair["worn_area"]
    }
    return xr.Dataset(variables, attrs={"reach": [float(end) for end in ends], **attrs})


def some_ended_before(values: FloatArray, ends: Sequence[float]) -> np.ndarray:
    """Return True where a draw without event ended before the event of another.

    Its event may lie before that of the other draw.

    Parameters
    ----------
    values : (n, m) array
        Distances of the draws to events, infinite without one.
    ends : sequence of n numbers
        Distances that the draws have run, in the same unit.
    """
    finite = np.where(np.isfinite(values), values, -np.inf).max(axis=0)
    short = np.array(ends)[:, None] < finite * (1.0 - 1e-9)
    return np.asarray((np.isinf(values) & short).any(axis=0))


def quantiles_of(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Quantiles (3, ...) of draws (n, ...), with standard errors over the scrambles.

    NaN where any draw has no value: those that wear least reach least far, and the rest
    would be biased. An infinite one is a value.
    """
    lacks = np.isnan(values).any(axis=0)
    filled = np.where(lacks, 0.0, values)
    infinite = np.isinf(filled).any(axis=0)
    with np.errstate(invalid="ignore"):
        quantiles = np.quantile(filled, QUANTILES, axis=0)
        parts = np.stack(
            [
                np.quantile(filled[k::SCRAMBLES], QUANTILES, axis=0)
                for k in range(SCRAMBLES)
            ]
        )
        error = np.sqrt(np.var(parts, axis=0, ddof=1) / SCRAMBLES)
    if infinite.any():  # no value lies between a distance and never
        quantiles = np.where(
            infinite,
            np.quantile(filled, QUANTILES, axis=0, method="inverted_cdf"),
            quantiles,
        )
        error = np.where(infinite, np.nan, error)
    return np.where(lacks, np.nan, quantiles), np.where(lacks, np.nan, error)


@dataclass(frozen=True)
class Sensitivity:
    """Influence of each input on a result: share of variance or rank correlation [-].

    Shares are those of a quadratic surrogate of the logarithm; where it predicts less
    than `LEAST_Q2` of draws left out, `value` are rank correlations. Limits are 90 %
    intervals of the bootstrap.
    """

    kind: str  # "share of variance" or "rank correlation"
    value: FloatArray  # (inputs,)
    low: FloatArray
    high: FloatArray
    q2: float


def sensitivity(
    shares: FloatArray, result: FloatArray, choices: Sequence[int]
) -> Sensitivity:
    """Influence of each input on a result, with its 90 % interval [-].

    Parameters
    ----------
    shares : (n, d) array
        Shares of the distributions that were drawn.
    result : (n,) array
        Positive values, such as a factor; draws without value do not count.
    choices : sequence of int
        Number of values of each input that is one of some, 0 for the others.
    """
    defined = np.isfinite(result) & (result > 0.0)
    u, y = shares[defined], np.log(result[defined])
    columns = [_columns(u[:, k], count) for k, count in enumerate(choices)]
    group = np.repeat(np.arange(len(columns)), [c.shape[1] for c in columns]).astype(
        np.int64
    )
    design = (
        np.column_stack([np.ones(len(u)), *columns])
        if columns
        else np.ones((len(u), 1))
    )
    random = np.random.default_rng(0)
    rows = [
        np.arange(len(u)),
        *(random.integers(0, len(u), len(u)) for _ in range(_BOOTSTRAPS)),
    ]
    q2 = -np.inf
    if len(u) > 2 * design.shape[1] and np.ptp(y) > 0.0:
        hat = design @ np.linalg.pinv(design)
        left_out = (y - hat @ y) / np.maximum(1.0 - np.diag(hat), 1e-9)
        q2 = 1.0 - float((left_out**2).sum() / ((y - y.mean()) ** 2).sum())
    if q2 >= LEAST_Q2:
        influences = np.stack([_variance_shares(design[r], y[r], group) for r in rows])
        kind = "share of variance"
    else:
        influences = np.stack([_rank_correlations(u[r], y[r]) for r in rows])
        kind = "rank correlation"
    low, high = np.quantile(influences[1:], (0.05, 0.95), axis=0)
    return Sensitivity(kind, influences[0], low, high, q2)


def _columns(share: FloatArray, choices: int) -> FloatArray:
    """Columns of the surrogate for an input.

    Legendre polynomials to degree two, or which value it has.
    """
    if choices:
        index = np.minimum((share * choices).astype(int), choices - 1)
        return (
            np.column_stack([index == k for k in range(1, choices)]).astype(float)
            if choices > 1
            else (np.empty((share.size, 0)))
        )
    x = 2.0 * share - 1.0
    return np.column_stack([x, 1.5 * x * x - 0.5])


def _variance_shares(design: FloatArray, y: FloatArray, group: IntArray) -> FloatArray:
    weights = np.linalg.lstsq(design, y, rcond=None)[0][1:]
    parts = design[:, 1:] * weights
    variance = np.array(
        [np.var(parts[:, group == k].sum(axis=1)) for k in range(int(group.max()) + 1)]
    )
    return np.asarray(variance / max(float(np.var(y)), 1e-300))


def _rank_correlations(u: FloatArray, y: FloatArray) -> FloatArray:
    from scipy.stats import spearmanr  # 0.3 s to import, only spent where it is needed

    if np.ptp(y) == 0.0:
        return np.zeros(u.shape[1])
    return np.array([float(spearmanr(column, y).statistic) for column in u.T])


def bands_of(
    nominal: xr.Dataset,
    draws: Sequence[xr.Dataset],
    shares: FloatArray,
    inputs: Mapping[str, int],
    fast: xr.Dataset | None = None,
) -> xr.Dataset:
    """Make bands of the values of draws.

    Parameters
    ----------
    nominal, draws : Dataset, sequence of Dataset
        From `values_of`, the draws with the nominal values as `like`.
    shares : (n, d) array
        Shares of the distributions that were drawn.
    inputs : mapping of str to int
        Names of the inputs, with the number of values of those that are one of some,
        else 0.
    fast : Dataset, optional
        Nominal values with the contact models of the draws, if the scene has others:
        the band is the ratio to them, times the nominal value of the scene's own models
        (of depth along the profile the difference).

    Returns
    -------
    Dataset
        Of each variable `x`, `x` itself, `x_band` (quantile, ...) and `x_band_error`,
        the standard error of the quantiles; `x_sensitivity` (input) of what stands at
        the end of the way; NaN where a draw has no value.
    """
    variables: dict[str, Any] = {str(name): nominal[name] for name in nominal.variables}
    for name, variable in nominal.data_vars.items():
        if variable.dtype.kind != "f" or name in _STATIONS:
            continue
        key, values = str(name), np.stack([draw[name].values for draw in draws])
        if key.endswith(_OBSERVED):
            ends = [draw.attrs["ends"][key.partition("_")[0]] for draw in draws]
            if some_ended_before(values[:, None], ends).any():
                values = np.full_like(values, np.nan)
        if fast is not None:
            base = fast[name].values
            if key.endswith(_ALONG):
                values = values - base + variable.values
            else:
                differs = (base != 0.0) & (base != variable.values)
                ratio = np.divide(
                    variable.values, base, out=np.ones_like(base), where=differs
                )
                values = values * ratio
        band, error = quantiles_of(values)
        dims = ("quantile", *map(str, variable.dims))
        about = {k: v for k, v in variable.attrs.items() if k in ("units", "quantity")}
        meaning = variable.attrs.get("long_name", key)
        variables[f"{key}_band"] = (
            dims,
            band,
            about | {"long_name": f"{meaning}, quantiles of the draws"},
        )
        variables[f"{key}_band_error"] = (
            dims,
            error,
            about | {"long_name": f"{meaning}, their standard error"},
        )
    variables["input_name"] = ("input", list(inputs), {"long_name": "uncertain input"})
    for key in asked_of(nominal):
        last: tuple[Any, ...] = (slice(None), *answered_at(variables[f"{key}_band"][1]))
        influence = sensitivity(
            shares,
            np.stack([draw[key].values for draw in draws])[last],
            list(inputs.values()),
        )
        variables[f"{key}_sensitivity"] = (
            ("input", "estimate"),
            np.column_stack([influence.value, influence.low, influence.high]),
            {
                "units": "1",
                "long_name": f"{influence.kind}, with its 90 % interval",
                "kind": influence.kind,
                "leave_one_out_q2": influence.q2,
            },
        )
    about = {"long_name": "quantile of the draws", "units": "1"}
    shown = {k: v for k, v in nominal.attrs.items() if k not in ("reach", "ends")}
    return xr.Dataset(
        variables,
        {"quantile": ("quantile", list(QUANTILES), about)},
        shown | {"draws": len(draws)},
    )


def asked_of(nominal: xr.Dataset) -> list[str]:
    """Variables whose bands are the answer.

    Distance for distance, factors, worn area and depth of each campaign.
    """
    names = ("worn_area", "max_wear_depth")
    candidates = [*PER_KM, *(f"{name}_factor" for name in names)]
    candidates += [f"{role}_{name}" for role in ("rig", "field") for name in names]
    return [name for name in candidates if name in nominal]


def answered_at(band: FloatArray) -> tuple[Any, ...]:
    """Place of the answer in the band of a variable of `asked_of`.

    The last station with a band, both wheels.

    Of factors that at equal distance.
    """
    if band.ndim == 4:
        return (0, last_known(band[1, 0, :, -1]), -1)
    return (
        (last_known(band[1]),) if band.ndim == 2 else (last_known(band[1, :, -1]), -1)
    )


def last_known(values: FloatArray) -> int:
    """Index of the last value that is not missing."""
    finite = np.flatnonzero(np.isfinite(values))
    return int(finite[-1]) if finite.size else -1


def sure(bands: xr.Dataset) -> float:
    """Largest standard error of a quantile, over the width of its band [-]."""
    largest = 0.0
    for name in asked_of(bands):
        band, error = bands[f"{name}_band"].values, bands[f"{name}_band_error"].values
        at = answered_at(band)
        width = float(band[(2, *at)] - band[(0, *at)])
        worst = float(np.max(error[(slice(None), *at)]))
        if width > 1e-6 * abs(float(band[(1, *at)])):
            largest = max(largest, worst / width)
    return largest


def band_table(bands: xr.Dataset) -> pd.DataFrame:
    """Bands of worn area and depth where the campaigns end, and of their factors.

    With what decides them.

    Returns
    -------
    DataFrame
        Columns variable, quantity, where, unit, nominal, 5%, 50%, 95% (areas in mm²,
        depths in mm), standard error over width, and main input.
    """
    rows, heads = (
        [],
        [
            "variable",
            "quantity",
            "where",
            "unit",
            "nominal",
            *(f"{q:.0%}" for q in QUANTILES),
        ],
    )
    for name in asked_of(bands):
        band, error = bands[f"{name}_band"].values, bands[f"{name}_band_error"].values
        at = answered_at(band)
        quantity = QUANTITIES["worn_area" if "area" in name else "max_wear_depth"]
        unit, scale = "1", 1.0
        if name in PER_KM:
            area = "area" in name
            depths = (
                bands["worn_area_reached"].values[2, ..., -1]
                if area
                else bands["worn_depth"].values[1]
            )
            reached = quantity.shown_factor * float(depths[(*at, 0)])
            unit, where = "km/km", f"up to {reached:.3g} {quantity.shown_unit} each"
        elif name.endswith("_factor"):
            where = (
                "rig over field at "
                f"{kilometres(float(bands['distance_run'].values[0, at[1], 0]))} each"
            )
        else:
            role, unit, scale = (
                name.split("_")[0],
                quantity.shown_unit,
                quantity.shown_factor,
            )
            way = float(bands[f"{role}_way"].values[at[0]])
            where = f"{role} at {kilometres(way)}"
        low, middle, high = (float(band[(q, *at)]) for q in range(3))
        sensitive = bands[f"{name}_sensitivity"]
        first = int(np.argmax(np.abs(sensitive.values[:, 0])))
        decided = f"({sensitive.attrs['kind']} {sensitive.values[first, 0]:.2f})"
        decided = f"{bands['input_name'].values[first]} {decided}"
        worst = float(np.max(error[(slice(None), *at)]))
        values = scale * np.array([float(bands[name].values[at]), low, middle, high])
        short = "worn area" if "area" in name else "largest wear depth"
        share = worst / (high - low) if high > low else 0.0
        rows.append(
            [name, PER_KM.get(name, short), where, unit, *values, share, decided]
        )
    for key in (str(key) for key in bands.data_vars if str(key).endswith("_met")):
        role, _, measure = key.removesuffix("_met").partition("_")
        if measure in LIMITED:
            values = 1e-3 * np.array([bands[key].values, *bands[f"{key}_band"].values])
            text = f"distance to the limit of {measure.replace('_', ' ')}"
            rows.append([key, text, role, "km", *values, np.nan, ""])
    rows += _service_rows(bands)
    return pd.DataFrame(rows, columns=[*heads, "error/width", "decided by"])


def _service_rows(bands: xr.Dataset) -> list[list[Any]]:
    """Rows of `band_table` on reprofilings and service life."""
    rows = []
    for name, (text, unit) in SERVICE.items():
        scale = 1e-3 if unit == "km" else 1e3
        for role in ("rig", "field"):
            key = f"{role}_{name}"
            if key in bands:
                band = [bands[key].values, *bands[f"{key}_band"].values]
                values = scale * np.array(band, dtype=np.float64)
                rows.append([key, text, role, unit, *values, np.nan, ""])
    return rows


FILE, MATERIALS = "bands.nc", "materials.csv"
"""Files of the bands and of the ranking of steels in a run directory."""


def known_bands(
    directory: Path, hashes: Mapping[str, str]
) -> tuple[xr.Dataset | None, pd.DataFrame]:
    """Read bands and ranking of steels of a run directory, where there are any.

    `hashes` are those of the results by role, from `translate.content_hash`.
    """
    path, table = directory / FILE, directory / MATERIALS
    if not path.is_file():
        return None, pd.DataFrame()
    try:
        band_dataset = load_derived(path)
        ranked = pd.read_csv(table) if table.is_file() else pd.DataFrame()
    except UNREADABLE as error:
        raise ResultError(
            f"{path} cannot be read ({error}); delete it, or run with --bands again"
        ) from error
    if any(
        band_dataset.attrs.get(f"{role}_sha256") != digest
        for role, digest in hashes.items()
    ):
        return None, pd.DataFrame()
    return band_dataset, ranked


def rank_materials(
    draws: Sequence[Mapping[str, xr.Dataset]],
    others: Mapping[str, Sequence[Mapping[str, xr.Dataset]]],
) -> pd.DataFrame:
    """Rank steels on the rig and in the field.

    Each draw with the steel of the scene and with another one.

    Parameters
    ----------
    draws : sequence of mappings
        Results by role of each draw with the steel of the scene.
    others : mapping of str to sequence of mappings
        The same draws with each other steel, by its name.

    Returns
    -------
    DataFrame
        A row for each steel: worn area over that of the scene's steel, with its band,
        on the rig and in the field; the share of draws in which the order of both is
        alike; and the wear regime whose share of the wear differs most between rig and
        field.
    """
    rows = []
    for material, results in others.items():
        row: dict[str, Any] = {"steel": material}
        logs = {}
        for role in draws[0]:
            ratio = np.array(
                [
                    _area(b[role]) / _area(a[role])
                    for a, b in zip(draws, results, strict=True)
                ]
            )
            low, middle, high = quantiles_of(ratio)[0]
            row |= {f"{role}, 5%": low, f"{role}, 50%": middle, f"{role}, 95%": high}
            logs[role] = np.log(ratio)
        if len(logs) == 2:
            row["order survives"] = float(
                np.mean(np.sign(logs["rig"]) == np.sign(logs["field"]))
            )
            row["regime that differs most"] = _most_different_regime(results)
        rows.append(row)
    return pd.DataFrame(rows)


def _area(data: xr.Dataset) -> float:
    return max(float(data["worn_area"].values[-1].sum()), 1e-300)


def _most_different_regime(results: Sequence[Mapping[str, xr.Dataset]]) -> str:
    """Regime whose wear share differs most between rig and field, with both shares."""
    shares = pd.DataFrame(0.0, index=[], columns=["rig", "field"])
    for role in ("rig", "field"):
        for pair in results:
            names = [str(name) for name in pair[role]["regime_name"].values]
            amount = pair[role]["wear_depth_by_regime"].values[-1].sum(axis=(0, -1))
            regime_shares = pd.DataFrame(
                {role: amount / max(amount.sum(), 1e-300) / len(results)}, index=names
            )
            shares = shares.add(regime_shares, fill_value=0.0)
    rig, field = (shares[role].fillna(0.0) for role in ("rig", "field"))
    name = str((rig - field).abs().idxmax())
    return (
        f"{name}: {rig[name]:.0%} of the wear on the rig, {field[name]:.0%} in the "
        "field"
    )
