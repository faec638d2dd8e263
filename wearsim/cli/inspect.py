"""`wearsim inspect`: what is in a result file."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli import print_json

SUMMARY = "summarise a result file, as text, JSON or figures"
EXAMPLES = "wearsim inspect out/rig.nc\nwearsim inspect out/rig.nc --plot figures"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("file", metavar="FILE", help="result file (netCDF)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--plot", metavar="DIR", help="write the figures of the report into this folder")


def execute(arguments: argparse.Namespace) -> int:
    """Print the summary; write the figures on request."""
    from wearsim.report.inspect import inspect, summary_text, write_figures

    path = Path(arguments.file)
    summary = inspect(path)
    figures = write_figures(path, Path(arguments.plot)) if arguments.plot else []
    if arguments.json:
        if arguments.plot:
            summary = {**summary, "figures": [str(figure) for figure in figures]}
        print_json(summary, allow_nan=False)
        return 0
    print(summary_text(summary))
    for figure in figures:
        print(figure)
    return 0
