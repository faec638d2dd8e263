"""`wearsim resume`: go on with a campaign that was interrupted."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli.flags import add_set_flag, overrides_of
from wearsim.cli.progress import observer
from wearsim.cli.report import print_warnings, reported

SUMMARY = "continue an interrupted run directory; a finished one is left as it is"
EXAMPLES = "wearsim resume out\nwearsim resume out --set campaign.error_tolerance_um=2"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("directory", metavar="DIR", help="run directory")
    add_set_flag(parser, "[campaign] on step, tolerance or smoothing", ", from the next step on")


def execute(arguments: argparse.Namespace) -> int:
    """Continue from the last finished step and write the report."""
    from wearsim.campaign.run import resume
    from wearsim.report.html import write_report

    out = Path(arguments.directory)
    with reported(out), observer() as observe:
        results = resume(out, observer=observe, overrides=overrides_of(arguments.set))
    print_warnings(results)
    print(f"report: {write_report(out)}")
    return 0
