"""How far a campaign can be trusted as a computation: steps, choice of contact models, convergence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import ResultError
from wearsim.profile.shape import polygon_area_between
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import plain, role_title, shown
from wearsim.report.tables import UNDEFINED, Table, span, table
from wearsim.results import checks
from wearsim.results.schema import CONVERGENCE

COLUMNS = {
    "flange_thickness": ("flange thickness Sd [µm]", 1e6),
    "flange_height": ("flange height Sh [µm]", 1e6),
    "max_wear_depth": ("largest wear depth [µm]", 1e6),
    "worn_area": ("worn area [mm²]", 1e6),
    "equivalent_conicity": ("equivalent conicity [10⁻³]", 1e3),
    "counterface_max_wear_depth": ("largest depth of the counterface [µm]", 1e6),
    "counterface_worn_area": ("worn area of the counterface [mm²]", 1e6),
}
"""Title and factor of each measure of `wearsim.studies.converge`."""
ANYWHERE = "wear depth anywhere on the profile [µm]"


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


def read_convergence(directory: Path) -> list[Table]:
    """Read the tables of `wearsim run --converge` in a run directory, one per campaign, if there are any."""
    path = directory / CONVERGENCE
    if not path.is_file():
        return []
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return [_convergence(content, role) for role in content["given"]]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise ResultError(
            f"{path} is no table of `wearsim run --converge` ({error}); remove it and run that again"
        ) from error


def _convergence(content: dict[str, Any], role: str) -> Table:
    given = content["given"][role]
    names = [name for name in COLUMNS if name in given["end"]]
    moved = {name: np.array(given["moved"][name], dtype=np.float64) for name in names}
    first = [_largest(COLUMNS[name][1] * moved[name]) for name in names]
    rows: list[list[Any]] = [["what wear changed, as given", given["steps"], *first, ""]]
    for row in content["rows"]:
        if "ends" not in row:
            rows.append([row["text"], row.get("reason") or "not run", *[""] * (len(names) + 1)])
            continue
        end, cells = row["ends"][role], []
        for name in names:
            apart = np.subtract(*(np.array(one["end"][name], dtype=np.float64) for one in (end, given)))
            cells.append(_largest(COLUMNS[name][1] * apart, apart, moved[name]))
        apart = np.array(end["profile_difference"])
        anywhere = _largest(1e6 * apart, apart, np.array(given["end"]["max_wear_depth"]))
        rows.append([row["text"], end["steps"], *cells, anywhere])
    short = ", shortened for this comparison" if content["shortened"] else ""
    title = f"Convergence, {role}: {given['distance'] / 1e3:.6g} km{short}"
    heads = [*(COLUMNS[name][0] for name in names), ANYWHERE]
    return table("convergence", rows, *heads, look="numbers", title=title, key=f"convergence-{role}")


def _largest(values: np.ndarray, part: Any = 0.0, whole: Any = 0.0) -> str:
    """Write the largest magnitude of values, with the largest share (`part` of a `whole` that is not 0)."""
    known = values[np.isfinite(values)]
    if known.size == 0:
        return UNDEFINED
    text = plain(known[np.argmax(np.abs(known))], 3)
    part, whole = np.atleast_1d(part), np.atleast_1d(whole)
    shares = [abs(a / b) for a, b in zip(part, whole, strict=True) if b and np.isfinite(a / b)]
    return f"{text} ({checks.percent(max(shares))})" if shares else text
