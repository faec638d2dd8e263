"""Sweeps: the cases of a design in one directory, its plan, and the table of how each case ended."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import filelock
import numpy as np

from wearsim.campaign.directory import is_claimed
from wearsim.campaign.record import write_atomically
from wearsim.campaign.run import Observer, available_cores
from wearsim.errors import Fault, ResultError, SceneError
from wearsim.quantities import QUANTITIES
from wearsim.results import GROUPS, LAYOUT, open_results
from wearsim.results.turnings import last_worn_row
from wearsim.scene.sweep import Case, Sweep
from wearsim.studies.ensemble import CaseRunner, Outcome, campaigns_of, outcome_in, run_cases

if TYPE_CHECKING:
    import xarray as xr

SWEEP_FILE = "sweep.json"
_LOCK = ".sweep.lock"
_PATIENCE = 60.0  # tasks of a job array wait for each other so long when they write the plan [s]

MEASURES = tuple(
    name
    for name, variable in LAYOUT.items()
    if variable.dimensions in (("step",), ("step", "wheel"))
    and variable.kind == "f8"
    and name not in ("step_length", "stability_number", "step_error", "contact_models_error")
)
"""Variables of a result file that have one value per campaign or per wheel; the table has their last ones."""

COUNTERFACE_MEASURES = ("counterface_max_wear_depth", "counterface_worn_area", "counterface_redressed_depth")
"""The same of rails or rollers, where those of any case wear."""

WHEELS = ("right", "left")


def run_sweep(
    sweep: Sweep,
    out: str | Path,
    executor: Executor | None = None,
    *,
    jobs: int | None = None,
    command: str = "",
    report: Callable[[Outcome], None] | None = None,
) -> tuple[Outcome, ...]:
    """Run all cases of a sweep, or continue them, each in its run directory, and write their table.

    Parameters
    ----------
    sweep : Sweep
        The cases; `check_cases` finds all their faults before.
    out : str or Path
        Directory; case 1 runs in `case_0001` in it, `sweep.csv` and `sweep.nc` have a row for each.
    executor, jobs, command, report
        As for `run_cases`.

    Returns
    -------
    tuple of Outcome
        In the order of the cases; one that fails does not stop the others.

    Raises
    ------
    ResultError
        If the directory cannot be written, or another sweep runs in it.
    KeyboardInterrupt
        After Ctrl-C, when the running cases have written their last step.
    """
    out = Path(out).absolute()
    if not sweep.cases:
        raise ResultError(f"{sweep.file}: a sweep without cases")
    failed: dict[str, Any] = {}

    def ended(outcome: Outcome) -> None:
        if outcome.state == "failed":
            failed[str(outcome.number)] = asdict(outcome)
            _write_plan(sweep, out, failed)
        if report is not None:
            report(outcome)

    with _locked(out, 0.0):
        _write_plan(sweep, out, failed)
        try:
            return run_cases(sweep.cases, out, executor, jobs=jobs, command=command, report=ended)
        finally:
            write_tables(out)


def run_one(
    sweep: Sweep, case: Case, out: str | Path, *, command: str = "", observer: Observer | None = None
) -> Outcome:
    """Run one case of a sweep in this process, or continue it, whatever the others do.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    case : Case
        One of them, as a job array counts them.
    out : str or Path
        Directory of the sweep.
    command : str
        Command line, for the history of the results.
    observer : callable, optional
        Called with an `Event` at each step.

    Returns
    -------
    Outcome
        Of this case. The tables are written by `run_sweep`.
    """
    out = Path(out).absolute()
    if read_plan(out).get("cases") != plan_of(sweep)["cases"]:
        with _locked(out, _PATIENCE):
            _write_plan(sweep, out, {})
    return CaseRunner(out, command, available_cores(), observer)(case)


def chosen(sweep: Sweep, only: int | None) -> tuple[Case, ...]:
    """Return all cases, or the one of this number.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    only : int, optional
        Number of a case, from 1.

    Raises
    ------
    SceneError
        If there is no such case.
    """
    if only is None:
        return sweep.cases
    if not 1 <= only <= len(sweep.cases):
        message = f"there is no case {only}; give --case 1 to {len(sweep.cases)}"
        raise SceneError([Fault(message, sweep.file)])
    return (sweep.cases[only - 1],)


def plan_of(sweep: Sweep) -> dict[str, Any]:
    """Return what the directory of a sweep says about its cases.

    Parameters
    ----------
    sweep : Sweep
        The cases.

    Returns
    -------
    dict
        JSON values.
    """
    cases = [
        {
            "case": case.number,
            "directory": case.name,
            "scene": case.base.name,
            "values": {override.key: override.value for override in case.overrides},
        }
        for case in sweep.cases
    ]
    return {"title": sweep.title, "cases": cases}


def read_plan(out: Path) -> dict[str, Any]:
    """Read `sweep.json`; empty where there is none.

    Parameters
    ----------
    out : Path
        Directory of a sweep.
    """
    try:
        content = json.loads((out / SWEEP_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ResultError(
            f"{out / SWEEP_FILE} cannot be read ({error}); delete it and run the same sweep again: "
            f"its finished cases stay"
        ) from error
    if not isinstance(content, dict) or not isinstance(content.get("cases"), list):
        raise ResultError(f"{out / SWEEP_FILE} is not that of a wearsim sweep; choose another --out")
    return content


def outcomes_of(out: Path) -> tuple[Outcome, ...]:
    """Return how the cases of a sweep stand, from what their run directories say.

    Parameters
    ----------
    out : Path
        Directory of the sweep.

    Returns
    -------
    tuple of Outcome
        In the order of the cases.
    """
    plan = read_plan(out)
    outcomes = []
    for entry in plan.get("cases", ()):
        outcome = outcome_in(out / str(entry["directory"]), int(entry["case"]))
        fault = plan.get("faults", {}).get(str(entry["case"]))
        if fault is not None and outcome.state in ("not started", "stopped"):
            outcome = Outcome(**fault)
        outcomes.append(outcome)
    return tuple(outcomes)


@contextmanager
def _locked(out: Path, patience: float) -> Iterator[None]:
    """Hold the lock of a sweep's directory, which is made if need be."""
    if is_claimed(out):
        raise ResultError(f"{out} is the run directory of a campaign; choose another --out for the sweep")
    try:
        out.mkdir(parents=True, exist_ok=True)
        lock = filelock.FileLock(out / _LOCK, timeout=patience)
        lock.acquire()
    except filelock.Timeout:
        raise ResultError(
            f"another wearsim sweep runs in {out}; wait for it (see `wearsim status {out}`) "
            f"or choose another --out"
        ) from None
    except OSError as error:
        raise ResultError(
            f"{out} cannot be used for a sweep: {error.strerror}; choose another --out"
        ) from error
    try:
        yield
    finally:
        lock.release()


def _write_plan(sweep: Sweep, out: Path, failed: dict[str, Any]) -> None:
    """Write `sweep.json`; run directories of cases that failed need not know why."""
    text = json.dumps({**plan_of(sweep), "faults": failed}, indent=1, ensure_ascii=False)
    write_atomically(out / SWEEP_FILE, text.encode())


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
    counterface = [name for name in COUNTERFACE_MEASURES if any(name in end for end in ends.values())]
    for name in (*MEASURES, *counterface) if campaigns else ():
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
        # as in result files: a text variable per dimension, since coordinates of CF are numbers
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
            for name in [one for one in (*MEASURES, *COUNTERFACE_MEASURES) if one in dataset]:
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
        told = (*MEASURES, *(name for name in COUNTERFACE_MEASURES if name in result))
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
