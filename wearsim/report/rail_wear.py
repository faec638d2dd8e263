"""Rail wear per 100 MGT in reports and summaries: one table and its sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd
import xarray as xr

from wearsim.report.style import kind_of, role_of, role_title
from wearsim.report.tables import Table
from wearsim.results.rail_wear import NO_CO_EVOLUTION, rail_wear
from wearsim.texts import text_table, wrapped

_HEADS = (
    "Class",
    "Curve radius [m]",
    "Axle load [kN]",
    "Outer rail, head [mm]",
    "Outer rail, gauge face [mm]",
    "Inner rail, head [mm]",
    "Inner rail, gauge face [mm]",
    "Outer rail, area [mm²]",
    "Inner rail, area [mm²]",
)
_CAPTION = (
    "Rail wear per 100 MGT by class: largest depth along the normal of the rail, by "
    "the law of the wheels on the contacts of the campaign, mean of all its wheel "
    "states; on straight track (from a radius of 10 km on) the outer rail is the right "
    "one, gauge face from a "
    f"contact angle of 40 degrees on. {NO_CO_EVOLUTION}"
)


def rail_tables(datasets: Sequence[xr.Dataset]) -> Iterator[Table]:
    """Yield the table of rail wear of each result in the field."""
    fields = [data for data in datasets if kind_of(data) == "field"]
    for data in fields:
        frame = pd.DataFrame(_rows(data), columns=list(_HEADS), dtype=object)
        made = Table("rail-wear", frame, _CAPTION, digits=3)
        several = len(fields) > 1
        yield made.of(role_of(data), role_title(data)) if several else made


def rail_summary(dataset: xr.Dataset) -> dict[str, Any]:
    """Rail wear by class for JSON, SI units; depths are (head, gauge face)."""
    if kind_of(dataset) != "field":
        return {}
    wear = rail_wear(dataset)
    return {
        str(name): {
            "axle_load": float(part["axle_load"]),
            "passages": float(part["passages"]),
            **{
                f"{rail}_rail_wear_depth": part["rail_wear_depth"]
                .sel(rail=rail)
                .values.tolist()
                for rail in ("outer", "inner")
            },
            "rail_worn_area": part["rail_worn_area"].values.tolist(),
        }
        for name in wear["class"].values
        for part in [wear.sel({"class": name})]
    }


def rail_text(content: dict[str, Any]) -> str:
    """Write the rail wear of a summary of `inspect`, "" without any."""
    if not content.get("rail_wear"):
        return ""
    rows = [
        [
            "Rail wear per 100 MGT [mm]",
            "axle kN",
            "outer head",
            "face",
            "inner head",
            "face",
            "outer mm²",
            "inner mm²",
        ]
    ]
    for name, wear in content["rail_wear"].items():
        depths = [*wear["outer_rail_wear_depth"], *wear["inner_rail_wear_depth"]]
        cells = [f"{1e3 * depth:.3g}" for depth in depths]
        cells += [f"{1e6 * area:.3g}" for area in wear["rail_worn_area"]]
        rows.append([f"  {name}", f"{wear['axle_load'] / 1e3:.4g}", *cells])
    return "\n".join([*text_table(rows), wrapped(NO_CO_EVOLUTION)])


def _rows(dataset: xr.Dataset) -> Iterator[list[Any]]:
    wear = rail_wear(dataset)
    for name in wear["class"].values:
        part = wear.sel({"class": name})
        bend = float(part["track_curvature"])
        yield [
            str(name),
            1.0 / bend if bend > 0.0 else None,
            float(part["axle_load"]) / 1e3,
            *(1e3 * part["rail_wear_depth"].values).ravel().tolist(),
            *(1e6 * part["rail_worn_area"].values).tolist(),
        ]
