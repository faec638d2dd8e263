"""`wearsim status`: how far a campaign is."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli import Commands, add_command
from wearsim.cli.progress import status_line


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "status",
        "show how far the campaigns of a run directory or a sweep are",
        "wearsim status out",
    )
    parser.add_argument("directory", metavar="DIR", help="run directory, or that of a sweep")
    parser.add_argument("--json", action="store_true", help="print JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Print the status."""
    import json

    from wearsim.campaign.directory import read_manifest, read_status

    out = Path(arguments.directory)
    if (out / "sweep.json").is_file():
        return _sweep(out, arguments.json)
    read_manifest(out)  # a clear fault where there is no campaign
    status = read_status(out)
    if arguments.json:
        print(json.dumps(status, indent=2))
        return 0
    campaigns = status.get("campaigns") or {}
    if not campaigns:
        print(f"{out}: no step finished yet")
    for name, item in campaigns.items():
        print(status_line(name, item))
    if any(item.get("state") in ("stopped", "interrupted") for item in campaigns.values()):
        print(f"nobody works in {out}; `wearsim resume {out}` continues it")
    return 0


def _sweep(out: Path, as_json: bool) -> int:
    import json
    from dataclasses import asdict

    from wearsim.campaign.directory import read_status
    from wearsim.studies.sweep import outcomes_of, read_plan

    if not as_json:
        print("\n".join(_lines(out)))
        return 0
    plan = read_plan(out)
    cases = [
        {**entry, **asdict(outcome), **read_status(out / entry["directory"])}
        for entry, outcome in zip(plan["cases"], outcomes_of(out), strict=True)
    ]
    for case in cases:
        del case["number"], case["exit_code"]
    print(json.dumps({"title": plan["title"], "cases": cases}, indent=2, ensure_ascii=False))
    return 0


def _lines(out: Path) -> list[str]:
    from wearsim.campaign.directory import read_status
    from wearsim.cli.sweep import with_fault
    from wearsim.studies.sweep import counted, outcomes_of, read_plan

    lines = []
    outcomes = outcomes_of(out)
    for entry, outcome in zip(read_plan(out)["cases"], outcomes, strict=True):
        campaigns = read_status(out / entry["directory"]).get("campaigns") or {}
        lines += [status_line(f"case {outcome.number}, {name}", item) for name, item in campaigns.items()]
        if not campaigns or (outcome.fault and not any(item.get("message") for item in campaigns.values())):
            lines.append(with_fault(f"case {outcome.number}: {outcome.state}", outcome.fault))
    return [*lines, counted(outcomes)]
