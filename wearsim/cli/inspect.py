"""`wearsim inspect`: what is in a result file, or in those of a run directory."""

from __future__ import annotations

import argparse
from pathlib import Path

from wearsim.campaign.directory import campaigns_of, read_manifest
from wearsim.cli import print_json
from wearsim.errors import ResultError
from wearsim.report.inspect import (
    inspect,
    summary_text,
    write_animation,
    write_figures,
    write_learned_figures,
)
from wearsim.studies.calibration import checks_of, table_of, text_of
from wearsim.studies.learned import FILE, load_posterior


def execute(arguments: argparse.Namespace) -> int:
    """Print the summaries; write the figures on request."""
    given = Path(arguments.file)
    if given.name == FILE or (given / FILE).is_file():
        return _calibration(given if given.is_dir() else given.parent, arguments)
    results = results_in(given) if given.is_dir() else [given]
    film = _film(arguments.animate, results)
    summaries = {path.stem: inspect(path) for path in results}
    figures = list[Path]()
    if arguments.plot:
        for path in results:
            figures += write_figures(path, Path(arguments.plot))
    if film is not None:
        figures.append(write_animation(results[0], film))
    if arguments.json:
        content = summaries if given.is_dir() else summaries[given.stem]
        if figures:
            content = {**content, "figures": [str(figure) for figure in figures]}
        print_json(content)
        return 0
    texts = [summary_text(summary, arguments.all) for summary in summaries.values()]
    print("\n\n".join(texts))
    if not arguments.all:
        print("more: --all, --json, --plot DIR, --animate FILE")
    for figure in figures:
        print(figure)
    return 0


def _film(animate: str | None, results: list[Path]) -> Path | None:
    """Path of the animation, which is of one result."""
    if animate is None:
        return None
    film = Path(animate)
    if film.suffix.lower() != ".gif":
        raise ResultError(f"--animate = {film} must end with .gif")
    if len(results) > 1:
        raise ResultError(
            f"--animate draws one result; give {' or '.join(map(str, results))}"
        )
    return film


def _calibration(directory: Path, arguments: argparse.Namespace) -> int:
    """Print what a calibration has learned; write its figures on request."""
    posterior = load_posterior(directory)
    if arguments.animate is not None:
        raise ResultError(f"--animate is for campaigns; {directory} is a calibration")
    written = (
        write_learned_figures(posterior, Path(arguments.plot)) if arguments.plot else []
    )
    if arguments.json:
        content = {"inputs": table_of(posterior), **checks_of(posterior)}
        print_json(content | ({"figures": list(map(str, written))} if written else {}))
        return 0
    print(text_of(posterior))
    for figure in written:
        print(figure)
    return 0


def results_in(out: Path) -> list[Path]:
    """Return the result files of a run directory, of which there must be one."""
    names = campaigns_of(out, read_manifest(out))
    results = [path for name in names if (path := out / f"{name}.nc").is_file()]
    if not results:
        raise ResultError(f"{out} has no result yet; see `wearsim status {out}`")
    return results


def result_in(given: Path, name: str = "") -> Path:
    """Return a result file, or that of a run directory: of several the named one."""
    if not given.is_dir():
        return given
    results = results_in(given)
    named = [path for path in results if path.stem == name]
    if len(results) == 1 or named:
        return (named or results)[0]
    raise ResultError(f"{given} holds two; give {' or '.join(map(str, results))}")
