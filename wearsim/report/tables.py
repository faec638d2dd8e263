"""The tables of a report as rows of cells; every number keeps its exact value beside its text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.profile.shape import polygon_area_between
from wearsim.quantities import QUANTITIES
from wearsim.report.pages import environment_text
from wearsim.report.style import capital, plain, role_of, shown
from wearsim.results.limits import LIMITED, LimitMet, limits_met
from wearsim.results.plausibility import LOAD_TOLERANCE, load_scaling, tread_wear
from wearsim.results.turnings import last_worn_row, spans, turned_rows, turnings, wear_steps
from wearsim.translation.factors import POINT_QUANTITIES
from wearsim.translation.translate import point_table

UNDEFINED = "undefined"

_REASONS = {
    "zero_denominator": "no ratio: the field value is zero",
    "small_denominator": "no ratio: the field value is too small to divide by",
    "missing": "a value is missing on one side",
    "beyond_range": "a campaign does not come so far",
}


@dataclass(frozen=True)
class Cell:
    """One cell of a table.

    Parameters
    ----------
    text : str
        What is shown.
    value : float, optional
        Exact number behind it; None for words.
    """

    text: str
    value: float | None = None

    @property
    def exact(self) -> str:
        """The number with all its digits."""
        return "" if self.value is None else repr(float(self.value))


def number(value: Any, digits: int = 4) -> Cell:
    """Cell of a number, "undefined" where there is none.

    Parameters
    ----------
    value : float
        In the unit of the column.
    digits : int
        Significant digits shown.
    """
    text = plain(value, digits)
    return Cell(text) if text == UNDEFINED else Cell(text, float(value))


def given(value: Any) -> Cell:
    """Cell of a number somebody chose: shown as it was given, without digits it does not have."""
    value = float(value)
    text = f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
    return Cell(text, value) if np.isfinite(value) else Cell(UNDEFINED)


@dataclass(frozen=True)
class VerdictRow:
    """One quantity of the verdict table.

    Parameters
    ----------
    group, quantity, unit, variable : str
        Where it stands and what it is.
    cells : tuple of Cell
        Rig, field, ratio at equal distance; the same at equal worn depth.
    note : str
        Reason for what is undefined, other remarks.
    """

    group: str
    quantity: str
    unit: str
    variable: str
    cells: tuple[Cell, ...]
    note: str


def verdict(table: pd.DataFrame) -> list[VerdictRow]:
    """Rows of the verdict table from `wearsim.translation.translate.table`."""
    bases = list(dict.fromkeys(table["basis"]))
    rows = []
    for variable in dict.fromkeys(table["variable"]):
        both = [table[(table["variable"] == variable) & (table["basis"] == basis)].iloc[0] for basis in bases]
        cells: list[Cell] = []
        notes: list[str] = []
        for entry in both:
            cells += [number(entry["rig"]), number(entry["field"])]
            defined = entry["status"] == "defined"
            cells.append(number(entry["factor"], 3) if defined else Cell(UNDEFINED))
            if not defined:
                notes.append(_REASONS[entry["status"]])
        if variable == "distance_run":
            notes.append("equal by definition at equal distance")
        if variable == "max_wear_depth":
            notes.append("equal by definition at equal worn depth")
        name = str(variable)
        group = (
            "Contact and wear law, mean magnitude over the load collective and both wheels"
            if name.endswith("_collective")
            else "Wheel shape"
            if name.endswith("_change") or name == "equivalent_conicity"
            else "Wear, both wheels"
        )
        quantity = str(both[0]["quantity"]).removesuffix(", collective mean")
        unit = str(both[0]["unit"])
        rows.append(VerdictRow(
            group, capital(quantity), "" if unit == "1" else unit, name, tuple(cells),
            "; ".join(dict.fromkeys(notes)),
        ))  # fmt: skip
    return rows


def grouped(rows: list[VerdictRow]) -> list[tuple[str, list[VerdictRow]]]:
    """Rows under the heading of their group, in the order the groups first appear."""
    groups: dict[str, list[VerdictRow]] = {}
    for row in rows:
        groups.setdefault(row.group, []).append(row)
    return list(groups.items())


def patch_rules() -> str:
    """Say how the patches of one wheel make one value."""
    rules: dict[str, list[str]] = {}
    for name, rule in POINT_QUANTITIES.items():
        rules.setdefault(rule, []).append(QUANTITIES[name].meaning)
    parts = "; ".join(f"{rule}: {', '.join(names)}" for rule, names in rules.items())
    return (
        "Contact values of each wheel are in translation.nc. "
        f"Several patches of a wheel make one value by {parts}."
    )


def verdict_sentences(table: pd.DataFrame, translation: xr.Dataset) -> list[str]:
    """Say in words what the factors say."""
    rows = table.set_index(["basis", "variable"])

    def entry(basis: str, variable: str) -> pd.Series:
        found = rows.loc[(basis, variable)]
        assert isinstance(found, pd.Series)  # the index is unique
        return found

    def say(value: float) -> str:
        return plain(value, 3)

    distance = entry("equal distance", "distance_run")
    depth, area = (entry("equal distance", name) for name in ("max_wear_depth", "worn_area"))
    sentences = []
    if depth["status"] == "defined" and area["status"] == "defined":
        sentences.append(
            f"After {say(distance['rig'])} km each, the rig has worn {say(depth['factor'])} times as deep "
            f"as the field ({say(depth['rig'])} against {say(depth['field'])} mm) "
            f"and {say(area['factor'])} times the area."
        )
    else:
        sentences.append("At equal distance no wear factor is defined: one campaign shows no wear.")
    run = entry("equal worn depth", "distance_run")
    if run["status"] == "defined" and run["rig"] > 0.0:
        common = entry("equal worn depth", "max_wear_depth")["rig"]
        sentences.append(
            f"{say(common)} mm of wear take {say(run['rig'])} km on the rig and {say(run['field'])} km "
            f"in the field: there, 1 km on the rig stands for {say(run['field'] / run['rig'])} km."
        )
    factor = translation["max_wear_depth_factor"].values[0, :, -1]
    factor = factor[np.isfinite(factor)]
    if factor.size > 1:
        low, high = float(factor.min()), float(factor.max())
        if high > 1.05 * low:
            sentences.append(
                f"The depth factor at equal distance runs from {say(low)} to {say(high)}: use the curves "
                "below, not one number."
            )
        else:
            sentences.append(
                f"The depth factor at equal distance stays within {say(low)} to {say(high)} here."
            )
    return sentences


def operating_points(dataset: xr.Dataset) -> tuple[list[str], list[list[Cell]]]:
    """Header and rows of the operating points of a campaign."""
    names = [
        "shift", "yaw", "roll", "wheel_load", "speed", "friction", "track_curvature",
        "environment", "weight", "block_length",
    ]  # fmt: skip
    header = ["Operating point"]
    for name in names:
        unit = QUANTITIES[name].shown_unit
        text = str(dataset[name].attrs["long_name"])
        header.append(capital(text) + (f" [{unit}]" if unit not in ("", "1") else ""))
    columns = [shown(name, dataset[name].values) for name in names]
    rows = []
    for index, text in enumerate(dataset["operating_point_name"].values):
        rows.append([Cell(str(text)), *(given(column[index]) for column in columns)])
    return header, rows


_SETTINGS: tuple[tuple[str, str, str, float], ...] = (
    ("wheel_profile_right", "Wheel profile, right", "", 1.0),
    ("wheel_profile_left", "Wheel profile, left", "", 1.0),
    ("counterface_profile", "Counterface profile", "", 1.0),
    ("counterface_wear_factor", "Depth of the rollers per passage over that of the wheels", "", 1.0),
    ("redress_distance", "Rollers turned every", "km", 1e-3),
    ("redress_depth", "Rollers turned at a depth of", "µm", 1e6),
    ("counterface_area_rate", "Area each rail loses", "mm²/1000 km", 1e12),
    ("wheel_radius", "Wheel radius", "mm", 1e3),
    ("half_span", "Half span of the wheel profiles", "mm", 1e3),
    ("rotation_rule", "Rule of the wheel rotation", "", 1.0),
    ("roll_rule", "Roll of the wheelset", "", 1.0),
    ("contact_normal", "Normal contact model", "", 1.0),
    ("contact_tangential", "Tangential contact model", "", 1.0),
    ("contact_parameters", "Parameters of the contact models", "", 1.0),
    ("strips", "Strips per patch", "", 1.0),
    ("cells", "Cells per strip", "", 1.0),
    ("axle_torque", "Axle torque", "N m", 1.0),
    ("youngs_modulus", "Young's modulus", "GPa", 1e-9),
    ("poisson_ratio", "Poisson's ratio", "", 1.0),
    ("wheel_density", "Density of the wheel", "kg/m³", 1.0),
    ("wear_law", "Wear law", "", 1.0),
    ("wear_form", "Form of the wear law", "", 1.0),
    ("wear_coefficients", "Wear coefficients", "", 1.0),
    ("seizure_cap", "Cap that keeps out the seizure regime", "", 1.0),
    ("integrator", "Integrator", "", 1.0),
    ("depth_cap", "Largest depth per step", "µm", 1e6),
    ("first_depth", "Largest depth of the first step", "µm", 1e6),
    ("stability_limit", "Limit of the stability number", "", 1.0),
    ("error_tolerance", "Tolerance of the error of a step", "µm", 1e6),
    ("smoothing_wavelength", "Smoothing wavelength", "mm", 1e3),
)


def settings(datasets: list[xr.Dataset]) -> list[tuple[str, list[Cell], bool]]:
    """Rows of (setting, cell per campaign, whether they differ)."""
    rows: list[tuple[str, list[Cell]]] = []
    roller = [float(data.attrs.get("counterface_curvature", 0.0)) for data in datasets]
    rows.append(
        ("Counterface", [Cell(f"roller, radius {1e3 / k:.4g} mm") if k else Cell("rail") for k in roller])
    )
    weighted = [data["weight"].values > 0.0 for data in datasets]
    for name in ("shift", "yaw", "wheel_load", "speed", "friction", "track_curvature"):
        cells = [_range(name, data[name].values[on]) for data, on in zip(datasets, weighted, strict=True)]
        unit = QUANTITIES[name].shown_unit
        text = str(datasets[0][name].attrs["long_name"])
        rows.append((capital(text) + (f" [{unit}]" if unit != "1" else ""), cells))
    rows.append(("Environment factor on the wear depth", [Cell(environment_text(data)) for data in datasets]))
    for key, text, unit, factor in _SETTINGS:
        values = [data.attrs.get(key) for data in datasets]
        if all(value is None for value in values):
            continue
        cells = [
            Cell("not given")
            if value is None
            else Cell(value)
            if isinstance(value, str)
            else given(float(value) * factor)
            for value in values
        ]
        rows.append((text + (f" [{unit}]" if unit else ""), cells))
    return [(text, cells, len({cell.text for cell in cells}) > 1) for text, cells in rows]


def _range(name: str, values: np.ndarray) -> Cell:
    if values.size == 0:
        return Cell("none")
    low, high = shown(name, [values.min(), values.max()])
    return given(low) if low == high else Cell(f"{given(low).text} to {given(high).text}")


def limits(datasets: list[xr.Dataset]) -> list[tuple[str, list[Cell]]]:
    """Rows of (limit, where each campaign meets it), for limits that any of them has."""
    found = [{limit.name: limit for limit in limits_met(data)} for data in datasets]
    rows = []
    for name in LIMITED:
        if any(name in campaign for campaign in found):
            values = sorted({campaign[name].limit for campaign in found if name in campaign})
            cells = [
                _where_met(campaign[name]) if name in campaign else Cell("not given") for campaign in found
            ]
            rows.append((limit_text(name, values), cells))
    return rows


def turned_wheels(dataset: xr.Dataset) -> list[tuple[Cell, list[Cell]]]:
    """Rows of (distance, diameter before, after and lost, right and left) of each turning [km, mm]."""

    def cells(before: float | None, after: float | None) -> list[Cell]:
        if before is None or after is None:
            return [Cell(UNDEFINED)] * 3
        return [number(1e3 * value, 6) for value in (before, after)] + [number(1e3 * (before - after))]

    return [
        (
            number(shown("distance", one.distance)),
            [cell for side in zip(one.before, one.after, strict=True) for cell in cells(*side)],
        )
        for one in turnings(dataset)
    ]


def limit_text(name: str, values: Sequence[float]) -> str:
    """Write a limit, or the limits of several campaigns, on one measure."""
    quantity = QUANTITIES[name]
    unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
    most = "at most" if LIMITED[name] > 0.0 else "at least"
    told = " or ".join(f"{value:g}" for value in shown(name, values))
    return f"{capital(quantity.meaning)}, {most} {told}{unit}"


def _where_met(limit: LimitMet) -> Cell:
    sides = ("right: ", "left: ") if len(limit.distance) == 2 else ("",)
    unit = QUANTITIES["distance"].shown_unit
    met = [
        "not met" if at is None else f"{plain(float(shown('distance', at)))} {unit}" for at in limit.distance
    ]
    texts = [side + text for side, text in zip(sides, met, strict=True)]
    return Cell("; ".join(texts), min((at for at in limit.distance if at is not None), default=None))


def quality(dataset: xr.Dataset) -> list[tuple[str, Cell]]:
    """Numbers that tell how far a campaign can be trusted as a computation."""
    lathe = turned_rows(dataset)
    count = wear_steps(dataset)
    depth = dataset["wear_depth"].values
    rows = [("Wear steps", Cell(str(count), float(count)))]
    if count:
        rows.append(("Largest stability number S", number(dataset["stability_number"].values[1:].max())))
        rows.append(("Largest depth in one step [µm]", number(1e6 * np.diff(depth, axis=0).max())))
        error = shown("step_error", dataset["step_error"].values[1:])
        if np.isfinite(error).any():
            rows.append(("Largest estimated error of one step [µm]", number(np.nanmax(error), 2)))
        rejected = int(dataset["rejected_steps"].values.sum())
        rows.append(("Steps repeated because of their error", Cell(str(rejected), float(rejected))))
        length = shown("distance", np.delete(dataset["step_length"].values, [0, *lathe]))
        rows.append(
            (
                "Shortest and longest step [km]",
                Cell(f"{number(length.min()).text} to {number(length.max()).text}"),
            )
        )
    for wheel, side in enumerate(("right", "left")):
        law = float(dataset["worn_area"].values[-1, wheel])
        y, z = (dataset[f"profile_{c}"].values[:, wheel] for c in "yz")
        polygon = sum(polygon_area_between(y[a], z[a], y[b], z[b]) for a, b in spans(dataset))
        text = f"Worn area by the law against the profiles, {side} wheel [relative difference]"
        rows.append((text, number(abs(polygon - law) / law, 2) if law > 0.0 else Cell("no wear")))
    scaling = load_scaling(dataset)
    rows.append((
        f"Distance run with normal forces scaled to the wheel load by more than {LOAD_TOLERANCE:.0%} [%]",
        number(100.0 * scaling.distance_share, 2) if scaling else Cell("none"),
    ))  # fmt: skip
    tread = tread_wear(dataset)
    if tread is not None:
        rows.append(("Largest wear depth on the tread per 100 000 km [mm]", number(1e3 * tread, 3)))
    balance = dataset["power_balance"].values
    balance = balance[np.isfinite(balance)]
    if balance.size:
        text = "Local over resultant frictional power before scaling"
        rows.append((text, Cell(f"{number(balance.min(), 3).text} to {number(balance.max(), 3).text}")))
    return rows


def factors_at_points(
    translation: xr.Dataset,
) -> list[tuple[str, list[str], list[tuple[str, str, Cell, list[Cell]]]]]:
    """Factors at equal operating points: by state its name, quantities, (point, wheel, shift, factors)."""
    table = point_table(translation)
    states = []
    for state, rows in table.groupby("state", sort=False):
        quantities = [capital(str(name)) for name in dict.fromkeys(rows["quantity"])]
        width = len(quantities)  # the rows of a point and wheel stand behind one another
        parts = [rows.iloc[start : start + width] for start in range(0, len(rows), width)]
        lines = [
            (str(part["point"].iloc[0]), str(part["wheel"].iloc[0]), given(part["shift"].iloc[0]),
             [number(value, 3) for value in part["factor"]])
            for part in parts
        ]  # fmt: skip
        states.append((str(state), quantities, lines))
    return states


def regimes(translation: xr.Dataset, progress: int) -> list[tuple[str, str, Cell, str, str, bool]]:
    """Rows of (point, wheel, shift, highest regime on the rig, in the field, differs) at equal distance."""
    if "regime_point" not in translation:
        return []
    names = str(translation["regime_point"].attrs["flag_meanings"]).split()
    regime = translation["regime_point"].values[0, progress].astype(int)
    differs = translation["regime_point_differs"].values[0, progress]
    shift = shown("shift", translation["shift"].values)
    return [
        (
            str(translation["rig_label"].values[i]), side, given(shift[i]), names[regime[0, i, w] + 1],
            names[regime[1, i, w] + 1], bool(differs[i, w] == 1),
        )
        for i in np.argsort(shift, kind="stable")
        for w, side in enumerate(("right", "left"))
    ]  # fmt: skip


def regime_bands(translation: xr.Dataset, rig: xr.Dataset) -> list[str]:
    """Say where along the profiles the prevailing wear regime differs, at the end of each basis."""
    lines = []
    for b, basis in enumerate(translation["basis_name"].values):
        for wheel, side in enumerate(("right", "left")):
            differs = translation["regime_profile_differs"].values[b, -1, wheel] == 1
            y = shown("profile_y", rig["profile_y"].values[0, wheel])
            edges = np.flatnonzero(np.diff(np.concatenate(([0], differs.astype(int), [0]))))
            bands = [
                f"{number(min(y[i], y[j - 1]), 3).text} to {number(max(y[i], y[j - 1]), 3).text} mm"
                for i, j in zip(edges[::2], edges[1::2], strict=True)
            ]
            where = "differs at " + ", ".join(bands) if bands else "is the same wherever both wear"
            lines.append(f"{str(basis).capitalize()}, {side} wheel: the prevailing regime {where}.")
    return lines


def role_title(dataset: xr.Dataset) -> str:
    """Heading of the column of a campaign."""
    return role_of(dataset).capitalize()


def state(dataset: xr.Dataset) -> list[tuple[str, list[Cell]]]:
    """Rows of (quantity, new, worn, change) of one campaign, by wheel where they differ."""
    rows: list[tuple[str, list[Cell]]] = []
    names = (
        "max_wear_depth", "worn_area", "worn_mass", "flange_height", "flange_thickness", "flange_gradient",
        "hollowing", "equivalent_conicity",
    )  # fmt: skip
    for name in names:
        values = shown(name, dataset[name].values[[0, last_worn_row(dataset)]])
        text, unit = str(dataset[name].attrs["long_name"]), QUANTITIES[name].shown_unit
        text = capital(text) + (f" [{unit}]" if unit != "1" else "")
        columns = (
            [("", values)] if values.ndim == 1 else [(", right", values[:, 0]), (", left", values[:, 1])]
        )
        rows += [(text + suffix, [number(v[0]), number(v[1]), number(v[1] - v[0])]) for suffix, v in columns]
    return rows
