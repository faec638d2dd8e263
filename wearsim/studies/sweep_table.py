"""The table of a sweep: what was varied, and how each case stands and ended."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.record import write_atomically
from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import GROUPS, LAYOUT, open_results
from wearsim.results.turnings import last_worn_row
from wearsim.studies.sweep_directory import campaigns_of, outcomes_of, read_plan

if TYPE_CHECKING:
    import xarray as xr

MEASURES = tuple(
    name
    for name, variable in LAYOUT.items()
    if variable.dimensions in (("step",), ("step", "wheel"))
    and variable.kind == "f8"
    and name not in ("step_length", "stability_number", "step_error", "contact_models_error")
)
"""Variables of a result file that have one value per campaign or per wheel; the table has their last ones."""

BELOW = ("counterface_max_wear_depth", "counterface_worn_area", "counterface_redressed_depth")
"""The same of rails or rollers, where those of any case wear."""

WHEELS = ("right", "left")


def sweep_dataset(out: str | Path) -> xr.Dataset:
    """Gather the cases of a sweep.

    Parameters
    ----------
    out : str or Path
        Directory of the sweep.

    Returns
    -------
    xarray.Dataset
        Over `case`, `campaign` (rig, field) and `wheel`: the varied values as the scene has them, state and
        fault of each case, and of finished ones the last value of each measure [SI], that of the worn
        wheels where a campaign ends with a turning; others are NaN.
    """
    import xarray as xr

    out = Path(out)
    plan = read_plan(out)
    entries = plan.get("cases", [])
    if not entries:
        raise ResultError(f"{out} is not the directory of a sweep; start one with `wearsim sweep`")
    outcomes = outcomes_of(out)
    ends: dict[tuple[int, str], dict[str, np.ndarray]] = {}
    for row, (entry, outcome) in enumerate(zip(entries, outcomes, strict=True)):
        if outcome.state == "finished":
            directory = out / entry["directory"]
            for name in campaigns_of(directory):
                ends[row, name] = _end(directory / f"{name}.nc")
    campaigns = [name for name in ("rig", "field") if any(key[1] == name for key in ends)]
    variables: dict[str, Any] = {}
    for key in dict.fromkeys(key for entry in entries for key in entry["values"]):
        variables[key.replace(".", "_")] = _varied(key, [entry["values"].get(key) for entry in entries])
    if len({entry["scene"] for entry in entries}) > 1:
        variables["scene"] = (
            "case",
            _texts([e["scene"] for e in entries]),
            {"long_name": "scene file of the case"},
        )
    variables["state"] = ("case", _texts([o.state for o in outcomes]), {"long_name": "state of the case"})
    variables["fault"] = ("case", _texts([o.fault for o in outcomes]), {"long_name": "why the case failed"})
    layout = {**LAYOUT, **GROUPS["counterface"]}
    below = [name for name in BELOW if any(name in end for end in ends.values())]
    for name in (*MEASURES, *below) if campaigns else ():
        per_wheel = "wheel" in layout[name].dimensions
        shape = (len(entries), len(campaigns), *((2,) if per_wheel else ()))
        values = np.full(shape, np.nan)
        for (row, campaign), end in ends.items():
            values[row, campaigns.index(campaign)] = end.get(name, np.nan)
        quantity = QUANTITIES[name]
        about = {"units": quantity.unit, "long_name": quantity.meaning}
        if quantity.sign:
            about["comment"] = quantity.sign
        dimensions = ("case", "campaign", "wheel") if per_wheel else ("case", "campaign")
        variables[name] = (dimensions, values, about)
    coordinates: dict[str, Any] = {
        "case": ("case", np.array([entry["case"] for entry in entries]), {"long_name": "number of the case"})
    }
    if campaigns:
        # as in result files: texts beside the dimension they name, since coordinates of CF are numbers
        coordinates["campaign_name"] = ("campaign", _texts(campaigns), {"long_name": "campaign"})
        coordinates["wheel_name"] = ("wheel", _texts(list(WHEELS)), {"long_name": "wheel"})
    title = str(plan.get("title") or "sweep")
    about_all = {"Conventions": "CF-1.11", "title": title, "history": "gathered by wearsim sweep"}
    return xr.Dataset(variables, coordinates, about_all)


def sweep_rows(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Rows of the table, one per case and campaign, in the units people read.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `sweep_dataset`.

    Returns
    -------
    list of dict
        Values by column; None where there is none.
    """
    campaigns = (
        [str(name) for name in dataset["campaign_name"].values] if "campaign" in dataset.dims else [""]
    )
    rows = []
    for at, number in enumerate(dataset["case"].values):
        ended = [
            c for c in campaigns if c and np.isfinite(dataset["distance"].values[at, campaigns.index(c)])
        ]
        for campaign in ended or [""]:
            row: dict[str, Any] = {"case": int(number)}
            for name, variable in dataset.data_vars.items():
                if variable.dims == ("case",) and name not in ("state", "fault"):
                    row[str(variable.attrs.get("key", name))] = _plain(variable.values[at])
            row |= {"state": str(dataset["state"].values[at]), "fault": str(dataset["fault"].values[at])}
            row["campaign"] = campaign
            for name in [one for one in (*MEASURES, *BELOW) if one in dataset]:
                _measures(
                    row, name, dataset[name].values[at], campaigns.index(campaign) if campaign else None
                )
            rows.append(row)
    return rows


def write_tables(out: Path) -> None:
    """Write `sweep.csv` and `sweep.nc` of a sweep, each atomically.

    Parameters
    ----------
    out : Path
        Directory of the sweep.
    """
    dataset = sweep_dataset(out)
    rows = sweep_rows(dataset)
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: "" if value is None else value for key, value in row.items()} for row in rows)
    write_atomically(out / "sweep.csv", text.getvalue().encode())
    path = out / "sweep.nc"
    part = out / ".sweep.nc.tmp"
    encoding = {name: {"_FillValue": None} for name in dataset.coords}
    try:
        part.unlink(missing_ok=True)
        dataset.to_netcdf(part, engine="netcdf4", format="NETCDF4", encoding=encoding)
        os.replace(part, path)
    except OSError as error:
        raise ResultError(
            f"{path} cannot be written: {error.strerror or error}; all cases are safe, make room and run the "
            f"same command again"
        ) from error


def _end(path: Path) -> dict[str, np.ndarray]:
    with open_results(path) as result:
        last = result.isel(step=last_worn_row(result))
        told = (*MEASURES, *(name for name in BELOW if name in result))
        return {name: np.asarray(last[name].values, dtype=float) for name in told}


def _varied(key: str, values: list[Any]) -> tuple[str, np.ndarray, dict[str, str]]:
    about = {"long_name": f"{key} of the scene", "key": key}
    given = [value for value in values if value is not None]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in given):
        return "case", np.array([np.nan if value is None else float(value) for value in values]), about
    return "case", _texts(["" if value is None else _text(value) for value in values]), about


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _texts(values: list[str]) -> np.ndarray:
    return np.array(values, dtype=object)


def _plain(value: Any) -> Any:
    if isinstance(value, float | np.floating):
        return None if np.isnan(value) else float(value)
    return str(value)


def _measures(row: dict[str, Any], name: str, values: np.ndarray, campaign: int | None) -> None:
    quantity = QUANTITIES[name]
    unit, factor = ("km", 1e-3) if name == "distance" else (quantity.shown_unit, quantity.shown_factor)
    suffix = {"mm²": "_mm2", "1": "", "": ""}.get(unit, f"_{unit}")
    wheels = [""] if values.ndim == 1 else [f"_{wheel}" for wheel in WHEELS]
    for index, wheel in enumerate(wheels):
        value = None
        if campaign is not None:
            found = float(values[campaign] if values.ndim == 1 else values[campaign, index])
            value = float(f"{found * factor:.9g}") if np.isfinite(found) else None
        row[f"{name}{suffix}{wheel}"] = value
