"""`wearsim status`: how far a campaign, a sweep or a calibration is."""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wearsim.campaign.event import crawling
from wearsim.cli import print_json
from wearsim.cli.progress import with_fault
from wearsim.quantities import duration, kilometres

_SILENT = 300.0
"""Time without a step from which on it is stated [s]."""


def execute(arguments: argparse.Namespace) -> int:
    """Print the status."""
    from wearsim.campaign.directory import is_locked, read_manifest, read_status

    out = Path(arguments.directory)
    if (out / "sweep.json").is_file():
        return _sweep(out, arguments.json)
    learned = out / "campaigns"
    begun = is_locked(learned) or any(learned.glob("case_*"))
    if begun or (out / "posterior.nc").is_file():
        return _calibration(out, arguments.json)
    manifest = read_manifest(out)  # a clear fault where there is no campaign
    status, draws = read_status(out), None
    if "--bands" in manifest.command.split() or (out / "bands").is_dir():
        from wearsim.studies.bands import progress_of  # takes long to import

        draws = progress_of(out)
    if draws is not None:
        status["bands"] = draws
    if arguments.json:
        print_json(status)
        return 0
    campaigns = status.get("campaigns") or {}
    if not campaigns:
        print(f"{out}: no step finished yet")
    for name, item in campaigns.items():
        print(status_line(name, item, _since(status.get("updated"))))
    _print_report(out)
    if any(
        item.get("state") in ("stopped", "interrupted") for item in campaigns.values()
    ):
        print(f"nobody works in {out}; `wearsim resume {out}` continues it")
    if draws is not None:
        failed = f", {draws['failed']} failed" if draws["failed"] else ""
        print(
            f"bands: {draws['state']}, {draws['done']} of {draws['draws']} draws "
            f"done{failed}"
        )
    if draws is not None and draws["state"] == "stopped":
        print("nobody works on the draws; the same command again continues them")
    return 0


def _print_report(out: Path) -> None:
    """Print where the report of a directory is, if it has one."""
    report = out / "report.html"
    if report.is_file():
        print(f"report: {report}")


def _since(updated: str | None) -> float:
    """Time since the status was written [s], 0 where it is not known."""
    try:
        then = datetime.fromisoformat(updated or "")
        return (datetime.now(UTC) - then).total_seconds()
    except (ValueError, TypeError):  # a damaged file, or a time without zone
        return 0.0


def _calibration(out: Path, as_json: bool) -> int:
    from wearsim.studies.calibration import progress_of

    progress = progress_of(out)
    if as_json:
        print_json({"calibration": progress})
        return 0
    failed = f", {progress['failed']} failed" if progress["failed"] else ""
    print(
        f"calibration: {progress['state']}, {progress['done']} campaigns done{failed}"
    )
    if progress["running"]:
        print(progress["running"])
    if progress["state"] == "stopped":
        print(
            f"nobody works in {out}, and it has no posterior: the same command "
            "continues it, or states why the measurements were refused"
        )
    _print_report(out)
    return 0


def _sweep(out: Path, as_json: bool) -> int:
    from wearsim.campaign.directory import read_status
    from wearsim.studies.sweep import counted, outcomes_of, read_plan

    plan, outcomes = read_plan(out), outcomes_of(out)
    cases = [
        {
            **entry,
            "state": outcome.state,
            "fault": outcome.fault,
            **read_status(out / entry["directory"]),
        }
        for entry, outcome in zip(plan["cases"], outcomes, strict=True)
    ]
    if as_json:
        print_json({"title": plan["title"], "cases": cases})
        return 0
    for case in cases:
        number, campaigns = case["case"], case.get("campaigns") or {}
        for name, item in campaigns.items():
            print(status_line(f"case {number}, {name}", item))
        if not campaigns or (
            case["fault"]
            and not any(item.get("message") for item in campaigns.values())
        ):
            print(with_fault(f"case {number}: {case['state']}", case["fault"]))
    print(counted(outcomes))
    _print_report(out)
    return 0


def status_line(name: str, item: dict[str, Any], age: float = 0.0) -> str:
    """Line on one campaign from its entry in `status.json`, written an age [s] ago."""
    distance = float(item.get("distance", 0.0))
    target = float(item.get("target", 0.0))
    part = f" ({100.0 * distance / target:.0f} %)" if target > 0 else ""
    run = kilometres(distance).removesuffix(" km")
    since = " since reprofiling" if item.get("reprofiled") else ""
    text = (
        f"{name}: {item.get('state', 'unknown')}, "
        f"{run} of {kilometres(target)}{part}, "
        f"worst depth {1e3 * float(item.get('worst_depth', 0.0)):.4g} mm{since}, "
        f"step {item.get('step', 0)}"
    )
    if item.get("state") == "running":
        if item.get("time_left") is not None:
            text += f", about {duration(float(item['time_left']))} left"
        text += _slow(item, target - distance, age)
    if item.get("left_out"):
        share = 100.0 * float(item["left_out_share"])
        text += (
            f", operating points left out: {item['left_out']}, with {share:.2g} % of "
            "the wear"
        )
    if item.get("ended") not in (None, "", "distance reached"):
        text += f": {item['ended']}"
    if item.get("message"):
        text += f"; {item['message']}"
    return text


def _slow(item: dict[str, Any], left: float, age: float) -> str:
    """Where a running campaign makes no progress, "" if it does."""
    fastest = str(item.get("fastest", ""))
    length = float(item.get("step_length", 0.0))
    text = crawling(left, length, str(item.get("step_limit", "")), fastest)
    if age > _SILENT:
        where = f" in {fastest}" if fastest else ""
        text = f"no step for {duration(age)}{where}"
    return f"; {text}" if text else ""
