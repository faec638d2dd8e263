"""The directory of a sweep: which case runs where, and how each stands."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import filelock

from wearsim.campaign.directory import SCENE_FOLDER, is_claimed, read_manifest, read_status
from wearsim.campaign.record import write_atomically
from wearsim.errors import ResultError
from wearsim.scene.sweep import Sweep

SWEEP_FILE = "sweep.json"
_LOCK = ".sweep.lock"


@dataclass(frozen=True)
class Outcome:
    """How a case of a sweep stands.

    Parameters
    ----------
    number : int
        Of the case.
    state : str
        "finished", "failed", "interrupted", "running" or "not started".
    fault : str
        Why it failed.
    exit_code : int
        2 bad input, 3 numerical failure or internal error, 130 interrupted, else 0.
    """

    number: int
    state: str
    fault: str = ""
    exit_code: int = 0


@contextmanager
def locked_sweep(out: Path, patience: float) -> Iterator[None]:
    """Hold the lock of a sweep's directory; the directory is made if need be.

    Parameters
    ----------
    out : Path
        Directory of the sweep.
    patience : float
        How long to wait for another process that holds it [s].

    Raises
    ------
    ResultError
        If it cannot be made or written, or another sweep runs in it.
    """
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


def refuse_run_directory(out: Path) -> None:
    """Raise if `out` is the run directory of a campaign, which a sweep must not be mixed with.

    Parameters
    ----------
    out : Path
        Intended directory of a sweep.
    """
    if is_claimed(out):
        raise ResultError(f"{out} is the run directory of a campaign; choose another --out for the sweep")


def plan_of(sweep: Sweep) -> dict[str, Any]:
    """Tell what the directory of a sweep says about its cases.

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
            "values": {change.key: change.value for change in case.changes},
        }
        for case in sweep.cases
    ]
    return {"title": sweep.title, "cases": cases}


def write_plan(sweep: Sweep, out: Path, faults: Mapping[int, Outcome]) -> None:
    """Write `sweep.json`, atomically; the caller holds the lock.

    Parameters
    ----------
    sweep : Sweep
        The cases.
    out : Path
        Directory of the sweep.
    faults : mapping of int to Outcome
        Of cases that failed; their run directories need not know why.
    """
    told = {str(number): asdict(outcome) for number, outcome in faults.items()}
    text = json.dumps({**plan_of(sweep), "faults": told}, indent=1, ensure_ascii=False)
    write_atomically(out / SWEEP_FILE, text.encode())


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
            f"its finished cases are found"
        ) from error
    if not isinstance(content, dict) or not isinstance(content.get("cases"), list):
        raise ResultError(f"{out / SWEEP_FILE} is not that of a wearsim sweep; choose another --out")
    return content


def outcomes_of(out: Path) -> tuple[Outcome, ...]:
    """Tell how the cases of a sweep stand, from what their run directories say.

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
    found = []
    for entry in plan.get("cases", ()):
        number = int(entry["case"])
        outcome = _outcome(number, out / str(entry["directory"]))
        fault = plan.get("faults", {}).get(str(number))
        if fault is not None and outcome.state in ("not started", "running"):
            outcome = Outcome(**fault)
        found.append(outcome)
    return tuple(found)


def campaigns_of(directory: Path) -> tuple[str, ...]:
    """Names of the campaigns a run directory is for.

    Parameters
    ----------
    directory : Path
        Of a case.
    """
    main = read_manifest(directory).main
    kind = tomllib.loads((directory / SCENE_FOLDER / main).read_text(encoding="utf-8-sig"))["scene"]["kind"]
    return ("rig", "field") if kind == "compare" else (str(kind),)


def _outcome(number: int, directory: Path) -> Outcome:
    if not is_claimed(directory):
        return Outcome(number, "not started")
    try:
        names = campaigns_of(directory)
    except ResultError as error:
        return Outcome(number, "failed", str(error), 2)
    campaigns = read_status(directory).get("campaigns") or {}
    for state in ("failed", "interrupted"):
        for item in campaigns.values():
            if item.get("state") == state:
                code = {"failed": 2, "interrupted": 130}[state]
                return Outcome(number, state, str(item.get("message") or ""), code)
    done = all((campaigns.get(name) or {}).get("state") == "finished" for name in names)
    complete = done and (len(names) == 1 or (directory / "translation.nc").is_file())
    return Outcome(number, "finished" if complete else "running")
