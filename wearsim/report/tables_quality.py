"""How far a campaign can be trusted as a computation: steps, choice of contact models."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from wearsim.profile.shape import polygon_area_between
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import role_title, shown
from wearsim.report.tables import Table, span, table
from wearsim.results import checks


def quality(datasets: list[xr.Dataset]) -> Table:
    """List the checks of the computation, a column per campaign."""
    columns = [_checks(data) for data in datasets]
    names = dict.fromkeys(text for column in columns for text in column)
    rows = [[text, *(column.get(text) for column in columns)] for text in names]
    return table("quality", rows, *map(role_title, datasets), look="numbers", digits=3)


def _checks(dataset: xr.Dataset) -> dict[str, Any]:
    steps = checks.wear_steps(dataset)
    rows: dict[str, Any] = {"Wear steps": steps}
    if held := checks.step_limits(dataset):
        rows["Wear steps held by"] = ", ".join(f"{limit} {count}" for limit, count in held.items())
    if steps:
        rows["Largest stability number S"] = dataset["stability_number"].values[1:].max()
        rows["Largest depth in one step [µm]"] = 1e6 * np.diff(dataset["wear_depth"].values, axis=0).max()
        error = shown("step_error", dataset["step_error"].values[1:])
        if np.isfinite(error).any():
            rows["Largest estimated error of one step [µm]"] = np.nanmax(error)
        rows["Steps repeated because of their error"] = int(dataset["rejected_steps"].values.sum())
        length = np.delete(dataset["step_length"].values, [0, *checks.reprofiled_rows(dataset)])
        rows["Shortest and longest step [km]"] = span(shown("distance", length))
    for wheel, side in enumerate(WHEELS):
        law = float(dataset["worn_area"].values[-1, wheel])
        y, z = (dataset[f"profile_{c}"].values[:, wheel] for c in "yz")
        polygon = sum(polygon_area_between(y[a], z[a], y[b], z[b]) for a, b in checks.spans(dataset))
        text = f"Worn area by the law against the profiles, {side} wheel [relative difference]"
        rows[text] = abs(polygon - law) / law if law > 0.0 else "no wear"
    scaling = checks.load_scaling(dataset)
    most = f"{checks.LOAD_TOLERANCE:.0%}"
    text = f"Distance run with normal forces scaled to the wheel load by more than {most} [%]"
    rows[text] = 100.0 * scaling.distance_share if scaling else "none"
    if "contact_model_name" in dataset:
        rows |= _correction(dataset)
    for name in ("load", "power", "wear"):
        shares = [100.0 * float(dataset[f"faint_{name}{of}"].values.max()) for of in ("", "_max")]
        text = f"Largest share of the {name} that faint patches lost, in all and of a wheel [%]"
        rows[text] = ", ".join(f"{share:.2g}" for share in shares) if max(shares) > 0.0 else "none"
    tread = checks.tread_wear(dataset)
    if tread is not None:
        rows["Largest wear depth on the tread per 100 000 km [mm]"] = 1e3 * tread
    balance = dataset["power_balance"].values
    balance = balance[np.isfinite(balance)]
    if balance.size:
        rows["Local over resultant frictional power before scaling"] = span(balance, 3)
    return rows


def models_in_use(dataset: xr.Dataset) -> dict[str, int]:
    """Count the acting operating points that each pair of models solves in every stage."""
    acts = dataset["weight"].values > 0.0
    model = dataset["contact_model"].values[-1][acts].astype(int)
    names = dataset["contact_model_name"].values
    return {str(name): int((model == k).sum()) for k, name in enumerate(names) if (model == k).any()}


def _correction(dataset: xr.Dataset) -> dict[str, Any]:
    points = ", ".join(f"{name} at {count} points" for name, count in models_in_use(dataset).items())
    reference = str(dataset["contact_model_name"].values[-1])
    error, tolerance = dataset["correction_error"].values[-1], float(dataset.attrs["contact_tolerance"])
    solved = "Operating points solved by the reference, each as often as it was"
    estimate = f"Estimated error of the wear depth by the correction [%], tolerance {100.0 * tolerance:g} %"
    return {
        "Contact models": f"{points}; corrected by {reference}",
        solved: int(dataset["reference_solved"].values[-1]),
        estimate: 100.0 * float(error),
    }
