"""`wearsim inspect`: what is in a result file."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.cli import print_json
from wearsim.errors import ResultError
from wearsim.report.inspect import inspect, summary_text, write_animation, write_figures


def execute(arguments: argparse.Namespace) -> int:
    """Print the summary; write the figures on request."""
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
        print_json(summary)
        return 0
    print(summary_text(summary))
    for figure in figures:
        print(figure)
    return 0
