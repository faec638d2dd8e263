"""Sweeps: the cases of a design in one directory.

Its plan, and the table of how each case ended, too.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.campaign.directory import acquired, campaigns_of, is_claimed, read_manifest
from wearsim.campaign.record import readable_errors, write_atomically
from wearsim.campaign.run import Observer
from wearsim.contact.solve import available_cores
from wearsim.errors import (
    Fault,
    ResultError,
    SceneError,
    WearsimError,
    brief,
    printable,
)
from wearsim.quantities import QUANTITIES
from wearsim.results import LAYOUT, open_whole
from wearsim.results.checks import last_worn_row
from wearsim.scene import load_campaign, prepare
from wearsim.scene.sweep import Case, Sweep, SweepScene
from wearsim.studies.ensemble import (
    Outcome,
    Runner,
    check_cases,
    outcome_in,
    run_case,
)
from wearsim.studies.plan import plan, steps_text
from wearsim.texts import wrapped
from wearsim.whole_files import (
    NO_FILL,
    json_value,
    read_json,
    signals_wait,
    utf8,
    write_netcdf,
)

SWEEP_FILE = "sweep.json"
_LOCK = ".sweep.lock"
_MOST_CASES = 20
"""Cases that `wearsim check` lists."""
# tasks of a job array wait for each other so long when they write the plan [s]
_PATIENCE = 60.0

MEASURES = tuple(
    name
    for name, variable in LAYOUT.items()
    if variable.dimensions in (("step",), ("step", "wheel"))
    and variable.kind == "f8"
    and name
    not in ("step_length", "stability_number", "step_error", "contact_models_error")
)
"""Variables of a result file that have one value per campaign or per wheel; the table
has their last ones.
"""

COUNTERFACE_MEASURES = (
    "counterface_max_wear_depth",
    "counterface_worn_area",
    "counterface_redressed_depth",
)
"""The same of rails or rollers, where those of any case wear."""

WHEELS = ("right", "left")


def run_sweep(sweep: Sweep, out: str | Path, runner: Runner) -> tuple[Outcome, ...]:
    """Run all cases of a sweep, or continue them, each in its run directory.

    Then write their table.

    Parameters
    ----------
    sweep : Sweep
        The cases; from `read_sweep` or `sweep_of_flags`, checked by `check_cases`.
    out : str or Path
        Directory; case 1 runs in `case_0001` in it, `sweep.csv` and `sweep.nc` have a
        row for each.
    runner : Runner
        Runs the cases; what it returns is returned.

    Raises
    ------
    ResultError
        If the directory cannot be written, or another sweep runs in it.
    """
    out = Path(out).absolute()
    if not sweep.cases:
        raise ResultError(f"{sweep.file}: a sweep without cases")
    failed: dict[str, Any] = {}

    def ended(count: int, outcome: Outcome) -> None:
        if outcome.state == "failed":
            failed[str(outcome.number)] = asdict(outcome)
            _write_plan(sweep, out, failed)
        if runner.report is not None:
            runner.report(count, outcome)

    with _locked(out, 0.0):
        _write_plan(sweep, out, failed)
        try:
            return replace(runner, report=ended).run(sweep.cases, out)
        finally:
            write_tables(out)


def run_one(
    sweep: Sweep,
    case: Case,
    out: str | Path,
    *,
    command: str = "",
    observer: Observer | None = None,
) -> Outcome:
    """Run one case of a sweep in this process, or continue it, whatever the others do.

    The tables are written by `run_sweep`, whose parameters these are; the observer is
    called with an `Event` at each step.
    """
    out = Path(out).absolute()
    if read_plan(out).get("cases") != plan_of(sweep)["cases"]:
        with _locked(out, _PATIENCE):
            _write_plan(sweep, out, {})
    return run_case(
        case, out, command=command, threads=available_cores(), observer=observer
    )


def chosen(sweep: Sweep, number: int) -> Case:
    """Case of this number, from 1; raises SceneError if there is none."""
    if not 1 <= number <= len(sweep.cases):
        message = f"there is no case {number}; give --case 1 to {len(sweep.cases)}"
        raise SceneError([Fault(message, sweep.file)])
    return sweep.cases[number - 1]


def plan_of(sweep: Sweep) -> dict[str, Any]:
    """Title and cases of a sweep as JSON values: what its directory says about them."""
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
    """Read `sweep.json` of the directory of a sweep; empty where there is none."""
    try:
        content = read_json(out / SWEEP_FILE)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ResultError(
            f"{out / SWEEP_FILE} cannot be read ({error}); delete it and run the same "
            "sweep again: its finished cases stay"
        ) from error
    if not isinstance(content, dict) or not isinstance(content.get("cases"), list):
        raise ResultError(
            f"{out / SWEEP_FILE} is not that of a wearsim sweep; choose another --out"
        )
    return content


def outcomes_of(out: Path) -> tuple[Outcome, ...]:
    """States of the cases of a sweep, in their order, by their run directories."""
    plan = read_plan(out)
    faults = {
        int(number): Outcome(**fault)
        for number, fault in plan.get("faults", {}).items()
    }
    outcomes = [
        outcome_in(out / entry["directory"], int(entry["case"]))
        for entry in plan.get("cases", ())
    ]
    unknown = ("not started", "stopped")  # of which the run directory need not know why
    return tuple(
        faults.get(outcome.number, outcome) if outcome.state in unknown else outcome
        for outcome in outcomes
    )


@contextmanager
def _locked(out: Path, patience: float) -> Iterator[None]:
    """Hold the lock of a sweep's directory, which is made if need be."""
    if is_claimed(out):
        raise ResultError(
            f"{out} is the run directory of a campaign; choose another --out for the "
            "sweep"
        )
    with readable_errors(f"{out} cannot be used for a sweep"):
        out.mkdir(parents=True, exist_ok=True)
        lock = acquired(out, out / _LOCK, patience, "sweep runs")
    try:
        yield
    finally:
        lock.release()


def _write_plan(sweep: Sweep, out: Path, failed: dict[str, Any]) -> None:
    """Write `sweep.json`; run directories of cases that failed need not know why."""
    text = json.dumps(
        {**plan_of(sweep), "faults": failed}, indent=1, ensure_ascii=False
    )
    write_atomically(out / SWEEP_FILE, text.encode())


def sweep_dataset(out: str | Path) -> xr.Dataset:
    """Gather the cases of a sweep from its directory.

    Returns
    -------
    xarray.Dataset
        Over `case`, `campaign` (rig, field) and `wheel`: the varied values as the scene
        has them, state and fault of each case, and of finished ones the last value of
        each measure [SI], that of the worn wheels where a campaign ends with a
        reprofiling; others are NaN. The attribute `source` states the versions that
        the results were computed with, if any is finished.
    """
    out = Path(out)
    plan, outcomes = read_plan(out), outcomes_of(out)
    entries = plan.get("cases", [])
    if not entries:
        raise ResultError(
            f"{out} is not the directory of a sweep; start one with `wearsim sweep`"
        )
    ended = _ends(out, entries, outcomes)
    ends = {place: values for place, (values, _) in ended.items()}
    sources = [source for _, source in ended.values() if source]
    variables: dict[str, Any] = {}
    for key in dict.fromkeys(key for entry in entries for key in entry["values"]):
        variables[key.replace(".", "_")] = _varied(
            key, [entry["values"].get(key) for entry in entries]
        )
    texts = {
        "scene": ([e["scene"] for e in entries], "scene file of the case"),
        "state": ([outcome.state for outcome in outcomes], "state of the case"),
        "fault": ([outcome.fault for outcome in outcomes], "why the case failed"),
    }
    if len(set(texts["scene"][0])) == 1:
        texts.pop("scene")
    variables |= {name: _texts("case", *given) for name, given in texts.items()}
    numbers = np.array([entry["case"] for entry in entries])
    coordinates: dict[str, Any] = {
        "case": ("case", numbers, {"long_name": "number of the case"})
    }
    if ends:
        campaigns = [
            name for name in ("rig", "field") if any(key[1] == name for key in ends)
        ]
        variables |= _last_measures(ends, campaigns, len(entries))
        # as in result files: a text variable per dimension, since coordinates of CF are
        # numbers
        coordinates["campaign_name"] = _texts("campaign", campaigns, "campaign")
        coordinates["wheel_name"] = _texts("wheel", list(WHEELS), "wheel")
    title = utf8(str(plan.get("title") or "sweep"))
    return xr.Dataset(variables, coordinates, _attributes(title, sources))


def _attributes(title: str, sources: Sequence[str]) -> dict[str, str]:
    """Attributes of the data, with the versions that computed the cases."""
    about = {
        "Conventions": "CF-1.11",
        "title": title,
        "history": "gathered by wearsim sweep",
    }
    if sources:
        about["source"] = ", ".join(dict.fromkeys(sources))
    return about


def _last_measures(
    ends: Mapping[tuple[int, str], Mapping[str, Any]],
    campaigns: Sequence[str],
    cases: int,
) -> dict[str, Any]:
    """Variables of the last measures of finished cases, by row and campaign."""
    variables: dict[str, Any] = {}
    for name in dict.fromkeys(name for end in ends.values() for name in end):
        wheels = next(end[name].shape for end in ends.values() if name in end)
        values = np.full((cases, len(campaigns), *wheels), np.nan)
        for (row, campaign), end in ends.items():
            values[row, campaigns.index(campaign)] = end.get(name, np.nan)
        dimensions = ("case", "campaign", *["wheel" for _ in wheels])
        variables[name] = (dimensions, values, QUANTITIES[name].attributes)
    return variables


def sweep_rows(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Rows of the table, by case and campaign of `sweep_dataset`, in units people read.

    Returns
    -------
    list of dict
        Values by column; None where there is none.
    """
    campaigns = (
        dataset["campaign_name"].values.tolist() if "campaign" in dataset.dims else []
    )
    measures = {
        str(name): variable.values
        for name, variable in dataset.data_vars.items()
        if "campaign" in variable.dims
    }
    varied = {
        str(variable.attrs.get("key", name)): variable.values
        for name, variable in dataset.data_vars.items()
        if variable.dims == ("case",)
    }
    state = {
        name: varied.pop(name) for name in ("state", "fault")
    }  # behind what is varied
    rows = []
    for at, number in enumerate(dataset["case"].values):
        cells = {"case": int(number)} | {
            key: json_value(values[at]) for key, values in (varied | state).items()
        }
        ended = [
            k for k in range(len(campaigns)) if np.isfinite(measures["distance"][at, k])
        ]
        for k in ended or [0]:
            row = cells | {"campaign": campaigns[k] if ended else ""}
            for name, values in measures.items():
                row |= _measures(name, values[at, k])
            rows.append(row)
    return rows


def write_tables(out: Path) -> None:
    """Write `sweep.csv` and `sweep.nc` into a sweep's directory, each atomically."""
    dataset = sweep_dataset(out)
    table = pd.DataFrame(sweep_rows(dataset), dtype=object)
    write_atomically(
        out / "sweep.csv", table.to_csv(index=False, lineterminator="\n").encode()
    )
    advice = "all cases are safe, make room and run the same command again"
    write_netcdf(
        dataset, out / "sweep.nc", advice, dict.fromkeys(dataset.coords, NO_FILL)
    )


def _ends(
    out: Path, entries: Sequence[Mapping[str, Any]], outcomes: Sequence[Outcome]
) -> dict[tuple[int, str], tuple[dict[str, np.ndarray], str]]:
    """Last measures of finished cases and their versions, by row and campaign."""
    return {
        (row, name): _end(out / entry["directory"] / f"{name}.nc")
        for row, (entry, outcome) in enumerate(zip(entries, outcomes, strict=True))
        if outcome.state == "finished"
        for name in campaigns_of(
            out / entry["directory"], read_manifest(out / entry["directory"])
        )
    }


@signals_wait()
def _end(path: Path) -> tuple[dict[str, np.ndarray], str]:
    """Last measures of a result, and the versions that it was computed with."""
    with open_whole(path) as result:
        last = result.isel(step=last_worn_row(result))
        names = (*MEASURES, *(name for name in COUNTERFACE_MEASURES if name in result))
        measures = {name: np.asarray(last[name].values, dtype=float) for name in names}
        return measures, str(result.attrs.get("source", ""))


def _varied(key: str, values: list[Any]) -> tuple[str, np.ndarray, dict[str, str]]:
    """Values of a key over the cases: numbers, or texts as the scene has them.

    None where it is removed.
    """
    about = {"long_name": f"{key} of the scene", "key": key}
    if all(
        value is None or (isinstance(value, int | float) and type(value) is not bool)
        for value in values
    ):
        return "case", np.array(values, dtype=float), about
    texts = [
        "" if v is None else str(v).lower() if isinstance(v, bool) else str(v)
        for v in values
    ]
    return "case", np.array(texts, dtype=object), about


def _texts(
    dimension: str, values: list[str], meaning: str
) -> tuple[str, np.ndarray, dict[str, str]]:
    return dimension, np.array(values, dtype=object), {"long_name": meaning}


def _measures(name: str, values: np.ndarray) -> dict[str, float | None]:
    """Cells of a measure, of both wheels where it has a value of each."""
    quantity = QUANTITIES[name]
    unit, factor = (
        ("km", 1e-3)
        if name == "distance"
        else (quantity.shown_unit, quantity.shown_factor)
    )
    suffix = {"mm²": "_mm2", "1": "", "": ""}.get(unit, f"_{unit}")
    wheels = [f"_{wheel}" for wheel in WHEELS] if values.ndim else [""]
    return {
        f"{name}{suffix}{wheel}": float(f"{value:.9g}") if np.isfinite(value) else None
        for wheel, value in zip(wheels, values.reshape(-1) * factor, strict=True)
    }


def sweep_of(scene: SweepScene) -> Sweep:
    """Cases of a sweep file that `load_scene` has read."""
    assert isinstance(scene._inputs, Sweep)
    return scene._inputs


def checked_plan(scene: SweepScene) -> dict[str, Any]:
    """Return what a sweep file would run.

    Title, cases, the campaigns of the first one and warnings.

    Raises the faults of all cases.
    """
    sweep = sweep_of(scene)
    warnings = [str(warning) for warning in check_cases(sweep.cases)]
    first = load_campaign(sweep.cases[0].base, overrides=sweep.cases[0].overrides)
    return {
        **plan_of(sweep),
        "first": [plan(part, prepare(part), (), 1) for part in first.parts],
        "warnings": warnings,
    }


def checked_plan_text(item: dict[str, Any], details: bool = False) -> str:
    """Lines for people from what `checked_plan` returns, of every case if detailed."""
    cases = item["cases"]
    shown = cases if details else cases[:_MOST_CASES]
    lines = [f"{item['title']}: {len(cases)} cases", *map(case_line, shown)]
    if len(shown) < len(cases):
        lines.append(f"  {len(cases) - len(shown)} more; all with --all")
    lines += [
        f"steps of case 1, {part['kind']}: {steps_text(part)}" for part in item["first"]
    ]
    return "\n".join(wrapped(line, "    ") for line in lines)


def case_line(case: dict[str, Any]) -> str:
    """Line on a case of a plan and what it varies."""
    given = {
        key: "removed" if value is None else str(value)
        for key, value in case["values"].items()
    }
    values = [f"{brief(key)} = {brief(value)}" for key, value in given.items()]
    return printable(", ".join([f"  case {case['case']}: {case['scene']}", *values]))


def listed_cases(sweep: Sweep, out: Path) -> list[dict[str, Any]]:
    """All cases, each with its state in the directory, or the fault of it."""
    cases = plan_of(sweep)["cases"]
    begun = read_plan(out).get("cases") == cases
    states = (
        [item.state for item in outcomes_of(out)]
        if begun
        else ["not started"] * len(cases)
    )
    listed = []
    for case, entry, state in zip(sweep.cases, cases, states, strict=True):
        listed.append({**entry, "state": state, "fault": ""})
        try:
            if state == "not started":
                check_cases((case,), out)
        except WearsimError as error:
            fault = "; ".join(str(error).splitlines()).replace(
                f"case {case.number}: ", "", 1
            )
            listed[-1] |= {"state": "impossible", "fault": fault}
    return listed


def counted(outcomes: tuple[Outcome, ...]) -> str:
    """Text on the number of cases in each state."""
    states = [outcome.state for outcome in outcomes]
    counts = [f"{states.count(state)} {state}" for state in dict.fromkeys(states)]
    return f"{len(outcomes)} cases: {', '.join(counts)}"
