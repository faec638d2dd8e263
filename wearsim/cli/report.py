"""`wearsim report`: the HTML report of a run directory."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli import Commands, add_command


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands, "report", "write the self-contained HTML report of a run directory", "wearsim report out"
    )
    parser.add_argument("directory", metavar="DIR", help="run directory, finished or not")


def execute(arguments: argparse.Namespace) -> int:
    """Write the report and print where it is."""
    from wearsim.report.html import write_report

    print(write_report(Path(arguments.directory)))
    return 0
