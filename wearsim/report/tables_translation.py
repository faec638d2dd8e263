"""Tables and sentences of rig against field, from `wearsim.translation`."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.damage.titles import law_title
from wearsim.quantities import NOT_IN_SIGHT
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.plates import BASES, Datasets
from wearsim.report.style import (
    capital,
    distance_text,
    plain,
    shown,
    values_of,
    with_unit,
)
from wearsim.report.tables import UNDEFINED, Table, table
from wearsim.report.texts import words
from wearsim.scene.input_names import titled
from wearsim.translation.bands import band_table
from wearsim.translation.translate import BASIS, cause_table

_BASES = (("", 1), (BASES[0], 3), (BASES[1], 3))
"""Heads above the columns of rig, field and ratio."""


def verdict(
    factors: pd.DataFrame, translation: xr.Dataset, datasets: Datasets
) -> Table:
    """Verdict from `wearsim.translation.translate.table`.

    Values and ratios where both campaigns end.
    """
    reasons, headings = words("reasons"), words("groups")
    rows: dict[tuple[str, str], list[object]] = {}
    shown_here = factors[
        factors["basis"].isin(BASIS[:2])
    ]  # figures show them at equal area, too
    for variable, both in shown_here.groupby("variable", sort=False):
        notes = [
            reasons[key]
            for key in dict.fromkeys([*both["status"], variable])
            if key in reasons
        ]
        values = both[["rig", "field", "factor"]].astype(object)
        values.loc[both["status"] != "defined", "factor"] = UNDEFINED
        first = both.iloc[0]
        quantity = capital(first["quantity"].removesuffix(", collective mean"))
        quantity += "" if first["unit"] in ("", "1") else f" [{first['unit']}]"
        group = next(
            text for end, text in headings.items() if str(variable).endswith(end)
        )
        rows[group, str(variable)] = [
            quantity,
            *values.to_numpy().ravel(),
            "; ".join(notes) or "–",
        ]
    run = distance_text(translation["distance_run"].values[0, -1, 0])
    depth = plain(
        shown("max_wear_depth", translation["worn_depth"].values[1, -1, 0]), 3
    )
    bands = [
        ("", 1),
        (f"{BASES[0]}, {run} each", 3),
        (f"{BASES[1]}, {depth} mm each", 3),
        ("", 1),
    ]
    # rows of a group stand together, in the order of their first ones
    groups = list(dict.fromkeys(group for group, _ in rows))
    places = sorted(rows, key=lambda place: groups.index(place[0]))
    made = table(
        "verdict",
        [rows[place] for place in places],
        context={"datasets": datasets},
        bands=bands,
        digits=(4, 4, 4, 3, 4, 4, 3, 4),
        look="verdict",
    )
    made.frame.index = pd.MultiIndex.from_tuples(places)
    return made


def regime_bands(translation: xr.Dataset, rig: xr.Dataset) -> list[str]:
    """Say where along the profiles the prevailing wear regime differs.

    At equal distance and worn depth.
    """
    sentences = []
    for b, basis in enumerate(BASIS[:2]):
        for wheel, side in enumerate(WHEELS):
            differs = translation["regime_profile_differs"].values[b, -1, wheel] == 1
            y = values_of(rig, "profile_y", 0, wheel)
            edges = np.flatnonzero(
                np.diff(np.concatenate(([0], differs.astype(int), [0])))
            )
            bands = [
                f"{plain(min(y[i], y[j - 1]), 3)} to {plain(max(y[i], y[j - 1]), 3)} mm"
                for i, j in zip(edges[::2], edges[1::2], strict=True)
            ]
            if bands:
                sentences.append(
                    f"{capital(basis)}, {side} wheel: the prevailing regime differs at "
                    f"{', '.join(bands)}."
                )
    same = "The prevailing regime is the same wherever both campaigns wear."
    return sentences or [same]


def damage_factors(translation: xr.Dataset, group: str) -> list[Table]:
    """Rig over field of the comparison or fatigue laws (`group`) of both campaigns."""
    if f"{group}_name" not in translation:
        return []
    names = (
        ("comparison_worn_area",)
        if group == "comparison"
        else ("fatigue_damage", "fatigue_damage_rate")
    )
    rows = []
    for k, law in enumerate(translation[f"{group}_name"].values):
        for name in names:
            meaning = f"{translation[name].attrs['long_name']}{with_unit('', name)}"
            text = f"{law_title(str(law))}: {meaning}"
            values = shown(name, translation[name].values[:2, -1, :, k, 2])
            factors = translation[f"{name}_factor"].values[:2, -1, k, 2:]
            rows.append([text, *np.hstack((values, factors)).ravel()])
    key = f"{group}-factors-translation"
    return [table("damage_factors", rows, digits=3, key=key, bands=_BASES)]


def causes(translation: xr.Dataset) -> list[Table]:
    """Causes of the factor of worn area per distance, with product, along the way."""
    frame = cause_table(translation)
    rows = [
        [capital(str(name)), *values]
        for name, values in zip(frame.index, frame.to_numpy(), strict=True)
    ]
    return (
        [table("causes", rows, *map(capital, frame.columns), digits=3)] if rows else []
    )


def bands_table(bands: xr.Dataset) -> Table:
    """Quantiles of the answers, and what decides them."""
    frame = (
        band_table(titled(bands))
        .drop(columns="variable")
        .replace(np.inf, NOT_IN_SIGHT)
        .astype(object)
    )
    frame["unit"] = frame["unit"].replace("1", "–")
    frame["error/width"] = frame["error/width"].where(
        frame["error/width"].notna(), None
    )
    frame["decided by"] = frame["decided by"].str.replace(
        r" -(?=[\d.]+\)$)",
        " \N{MINUS SIGN}",
        regex=True,  # not in names
    )
    rows = [
        [capital(str(name)), *values] for name, *values in frame.to_numpy().tolist()
    ]
    return table("bands", rows, digits=3)


def materials(ranked: pd.DataFrame) -> list[Table]:
    """Steels against that of the scene, by worn area."""
    if not len(ranked):
        return []
    return [
        table(
            "materials",
            ranked.to_numpy().tolist(),
            *map(capital, ranked.columns),
            digits=3,
        )
    ]


def zones(translation: xr.Dataset) -> list[Table]:
    """Largest depth by zone of the profile, where both campaigns end."""
    rows = []
    for k, zone in enumerate(translation["zone_name"].values):
        depth = (
            translation["zone_depth"].values[:2, -1, :, k, -1].round(9)
        )  # smoothing leaves less than a nm
        depth = shown("max_wear_depth", depth)
        ratio = translation["zone_depth_factor"].values[:2, -1, k, -1:]
        rows.append([capital(zone), *np.hstack((depth, ratio)).ravel()])
    return [table("zones", rows, digits=3, bands=_BASES)]
