"""`wearsim inspect`: what is in a result file."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli import print_json

SUMMARY = "summarise a result file, as text, JSON, figures or a film"
EXAMPLES = """\
wearsim inspect out/rig.nc
wearsim inspect out/rig.nc --plot figures
wearsim inspect out/rig.nc --animate rig.gif"""


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("file", metavar="FILE", help="result file (netCDF)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--plot", metavar="DIR", help="write the figures of the report into this folder")
    parser.add_argument(
        "--animate",
        metavar="FILE",
        help="write the wearing profiles and their contact patches as a film (.gif)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Print the summary; write the figures on request."""
    from wearsim.errors import ResultError
    from wearsim.report.inspect import inspect, summary_text, write_animation, write_figures

    path = Path(arguments.file)
    film = None if arguments.animate is None else Path(arguments.animate)
    if film is not None and film.suffix.lower() != ".gif":
        raise ResultError(f"--animate = {film} must end with .gif")
    summary = inspect(path)
    figures = write_figures(path, Path(arguments.plot)) if arguments.plot else []
    figures += [write_animation(path, film)] if film is not None else []
    if arguments.json:
        if figures:
            summary = {**summary, "figures": [str(figure) for figure in figures]}
        print_json(summary, allow_nan=False)
        return 0
    print(summary_text(summary))
    for figure in figures:
        print(figure)
    return 0
