"""`wearsim resume`: go on with a campaign that was interrupted."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.campaign.run import resume
from wearsim.cli.flags import overrides_of
from wearsim.cli.progress import observer
from wearsim.cli.report import print_warnings, reported, write_report


def execute(arguments: argparse.Namespace) -> int:
    """Continue from the last finished step and write the report."""
    out = Path(arguments.directory)
    with reported(out), observer(quiet=arguments.quiet) as observe:
        results = resume(out, observer=observe, overrides=overrides_of(arguments.set))
    print(f"report: {write_report(out, print_warnings(results))}")
    return 0
