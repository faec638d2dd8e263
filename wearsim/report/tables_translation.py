"""Tables and sentences of rig against field, from `wearsim.translation`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.plates import BASES
from wearsim.report.style import capital, plain, shown, values_of, with_unit
from wearsim.report.tables import UNDEFINED, Cell, Table, cell, cells, given
from wearsim.translation.factors import POINT_QUANTITIES
from wearsim.translation.translate import point_table

_REASONS = {
    "zero_denominator": "no ratio: the field value is zero",
    "small_denominator": "no ratio: the field value is too small to divide by",
    "missing": "a value is missing on one side",
    "beyond_range": "a campaign ends before",
}
_EQUAL = {"distance_run": "distance", "max_wear_depth": "worn depth"}


@dataclass(frozen=True)
class Verdict:
    """The table of factors where both campaigns end: what is equal in each half, rows by group.

    A row is quantity, unit, name of the variable, cells (rig, field, ratio at equal distance, then at equal
    worn depth) and a note.
    """

    caption: str
    ends: list[str]
    groups: dict[str, list[tuple[str, str, str, list[Cell], str]]]

    macro = "verdict"


def verdict(table: pd.DataFrame, translation: xr.Dataset, environment: str) -> Verdict:
    """Verdict from `wearsim.translation.translate.table`, with a note on the environment factors."""
    groups: dict[str, list[tuple[str, str, str, list[Cell], str]]] = {}
    for variable, both in table.groupby("variable", sort=False):
        name = str(variable)
        row: list[Cell] = []
        notes = list(dict.fromkeys(_REASONS[s] for s in both["status"] if s != "defined"))
        for _, entry in both.iterrows():
            factor = cell(entry["factor"] if entry["status"] == "defined" else UNDEFINED, 3)
            row += cells(entry["rig"], entry["field"], factor)
        if name in _EQUAL:
            notes.append(f"equal by definition at equal {_EQUAL[name]}")
        group = (
            "Contact and wear law, mean magnitude over the load collective and both wheels"
            if name.endswith("_collective")
            else "Wheel shape"
            if name.endswith("_change") or name == "equivalent_conicity"
            else "Wear, both wheels"
        )
        first = both.iloc[0]
        quantity = capital(first["quantity"].removesuffix(", collective mean"))
        unit = "–" if first["unit"] in ("", "1") else first["unit"]
        groups.setdefault(group, []).append((quantity, unit, name, row, "; ".join(notes) or "–"))
    caption = (
        "Rig against field at the end of the range both campaigns cover. The ratio is rig over field. "
        f"{environment}"
    )
    run = float(shown("distance", translation["distance_run"].values[0, -1, 0]))
    depth = float(shown("max_wear_depth", translation["worn_depth"].values[1, -1, 0]))
    ends = [f"{BASES[0]}, {plain(run)} km each", f"{BASES[1]}, {plain(depth, 3)} mm each"]
    return Verdict(caption, ends, groups)


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
    rows = {(row["basis"], row["variable"]): row for row in table.to_dict("records")}
    distance, depth, area = (
        rows["equal distance", name] for name in ("distance_run", "max_wear_depth", "worn_area")
    )
    say = partial(plain, digits=3)
    if depth["status"] == area["status"] == "defined":
        sentences = [
            f"After {say(distance['rig'])} km each, the rig has worn {say(depth['factor'])} times as deep "
            f"as the field ({say(depth['rig'])} against {say(depth['field'])} mm) "
            f"and {say(area['factor'])} times the area."
        ]
    else:
        sentences = ["At equal distance no wear factor is defined: one campaign shows no wear."]
    run, common = (rows["equal worn depth", name] for name in ("distance_run", "max_wear_depth"))
    if run["status"] == "defined" and run["rig"] > 0.0:
        sentences.append(
            f"{say(common['rig'])} mm of wear take {say(run['rig'])} km on the rig and "
            f"{say(run['field'])} km in the field: there, 1 km on the rig stands for "
            f"{say(run['field'] / run['rig'])} km."
        )
    factor = translation["max_wear_depth_factor"].values[0, :, -1]
    factor = factor[np.isfinite(factor)]
    if factor.size > 1:
        low, high = factor.min(), factor.max()
        sentences.append(
            f"The depth factor at equal distance runs from {say(low)} to {say(high)}: use the curves "
            "below, not one number."
            if high > 1.05 * low
            else f"The depth factor at equal distance stays within {say(low)} to {say(high)} here."
        )
    return sentences


def factors_at_points(translation: xr.Dataset) -> list[Table]:
    """Factors at equal operating points, a table for each state."""
    caption = (
        "Rig over field; rotation rule and axle torque are alike too. Worn area and wear depth per distance "
        "are those of the wear law, without environment factor."
    )
    tables = []
    for name, rows in point_table(translation).groupby("state", sort=False):
        quantities = [capital(name) for name in dict.fromkeys(rows["quantity"])]
        each = len(quantities)
        places = rows[["point", "wheel", "shift"]].iloc[::each].itertuples(index=False)
        factors = rows["factor"].to_numpy().reshape(-1, each)
        lines = [
            cells(point, wheel, given(shift), *values, digits=3)
            for (point, wheel, shift), values in zip(places, factors, strict=True)
        ]
        where = "new wheels" if name == "new wheels" else f"end of {name!s}"
        fold = f"Factors at equal operating points, {where}"
        head = ["Operating point", "Wheel", "Shift [mm]", *quantities]
        tables.append(Table("", caption, head, lines, "points", fold))
    return tables


def regimes(translation: xr.Dataset) -> list[Table]:
    """Highest regime on the rig and in the field at equal points, of new wheels and at equal distance."""
    if "regime_point" not in translation:
        return []
    names = str(translation["regime_point"].attrs["flag_meanings"]).split()
    shift = values_of(translation, "shift")
    places = [(i, w) for i in np.argsort(shift, kind="stable") for w in range(len(WHEELS))]
    tables = []
    for progress, title in ((0, "new wheels"), (-1, "end of the common distance")):
        regime = translation["regime_point"].values[0, progress].astype(int)
        differs = translation["regime_point_differs"].values[0, progress] == 1
        rows = [
            cells(translation["rig_label"].values[i], WHEELS[w], given(shift[i]),
                  *(names[regime[c, i, w] + 1] for c in (0, 1)), "differs" if differs[i, w] else None)
            for i, w in places
        ]  # fmt: skip
        shaded = frozenset(k for k, place in enumerate(places) if differs[place])
        fold = (
            f"Highest regime of any cell at equal operating points, {title}: {len(shaded)} of {len(rows)} "
            "wheels in contact differ"
        )
        head = ["Operating point", "Wheel", "Shift [mm]", "Rig", "Field", "Flag"]
        tables.append(Table("", "", head, rows, "regimes", fold, bool(shaded), shaded))
    return tables


def regime_bands(translation: xr.Dataset, rig: xr.Dataset) -> list[str]:
    """Say where along the profiles the prevailing wear regime differs, at the end of each basis."""
    lines = []
    for b, basis in enumerate(translation["basis_name"].values):
        for wheel, side in enumerate(WHEELS):
            differs = translation["regime_profile_differs"].values[b, -1, wheel] == 1
            y = values_of(rig, "profile_y", 0, wheel)
            edges = np.flatnonzero(np.diff(np.concatenate(([0], differs.astype(int), [0]))))
            bands = [
                f"{plain(min(y[i], y[j - 1]), 3)} to {plain(max(y[i], y[j - 1]), 3)} mm"
                for i, j in zip(edges[::2], edges[1::2], strict=True)
            ]
            where = "differs at " + ", ".join(bands) if bands else "is the same wherever both wear"
            lines.append(f"{str(basis).capitalize()}, {side} wheel: the prevailing regime {where}.")
    return lines


def damage_factors(translation: xr.Dataset, group: str) -> list[Table]:
    """Rig over field of the comparison or fatigue laws (`group`) of both campaigns, at their end."""
    if f"{group}_name" not in translation:
        return []
    names = ("comparison_worn_area",) if group == "comparison" else ("fatigue_damage", "fatigue_damage_rate")
    rows = []
    for k, law in enumerate(translation[f"{group}_name"].values):
        for name in names:
            text = f"{law}: {translation[name].attrs['long_name']}{with_unit('', name)}"
            values = shown(name, translation[name].values[:, -1, :, k, 2])
            factors = translation[f"{name}_factor"].values[:, -1, k, 2:]
            rows.append(cells(text, *np.hstack((values, factors)).ravel(), digits=3))
    ends = [f"{basis}: {what}" for basis in BASES for what in ("rig", "field", "ratio")]
    text = (
        "Damage by the laws of both campaigns where the range they share ends, both wheels. Factors over the "
        "whole range are in translation.nc."
    )
    table = Table(f"{group}-factors", text, ["Law and quantity", *ends], rows)
    return [table.of("translation", "Rig over field")]
