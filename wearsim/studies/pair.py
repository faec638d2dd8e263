"""Two campaigns of one kind, run one after the other and set side by side."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.campaign.directory import (
    PAIR,
    is_claimed,
    names_of_pair,
    require_own_directory,
)
from wearsim.campaign.event import Event
from wearsim.campaign.run import Observer, run_prepared
from wearsim.errors import Fault, ResultError, issue_warning
from wearsim.results import load_results
from wearsim.scene import PairScene, prepare
from wearsim.scene.initial_contact import check_contact
from wearsim.studies.bands import draws_in
from wearsim.translation.side_by_side import side_by_side, with_bands
from wearsim.whole_files import write_whole

TABLE = "comparison.csv"
"""File of both campaigns side by side."""
"""File of the table in the directory of both campaigns."""


def run_pair(
    scene: PairScene,
    out: Path,
    *,
    command: str = "",
    observer: Observer | None = None,
    warn: Callable[[Fault], None] = issue_warning,
) -> dict[str, Path]:
    """Run two scenes of one kind in run directories below `out`, or continue them.

    Parameters
    ----------
    scene : PairScene
        From `load_scene`.
    out : Path
        Directory of both; each runs in the folder of its name.
    command : str
        Command line, for the history of the results.
    observer : callable, optional
        As for `run_scene`; its events name the campaigns.
    warn : callable, optional
        Called before the runs with each warning on the scenes.

    Returns
    -------
    dict of str to Path
        Result files by name.

    Raises
    ------
    SceneError
        With all faults of the contact of new wheels in both scenes; nothing is run
        then.
    ResultError
        If `out` is the run directory of another campaign.
    """
    prepared = [prepare(part) for part in scene.parts]
    for warning in check_contact(scene, prepared=prepared):
        warn(warning)
    if not names_of_pair(out):  # that of a pair has the page of both in it
        require_own_directory(out)
    if is_claimed(out):
        raise ResultError(
            f"{out} is the run directory of one campaign; choose another --out"
        )
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / PAIR, json.dumps({"campaigns": list(scene.pair)}, indent=2))
    paths = {}
    for (name, part), prepared_part in zip(scene.pair.items(), prepared, strict=True):
        (paths[name],) = run_prepared(
            part,
            [prepared_part],
            out / name,
            command=command or f"wearsim.run({scene.origin.path.name!r})",
            observer=None
            if observer is None
            else partial(_report_named_event, observer, name),
        )
    return paths


def compared(paths: Mapping[str, Path]) -> pd.DataFrame:
    """Set two results side by side, with bands where both were drawn.

    Parameters
    ----------
    paths : mapping of str to Path
        Result files by name, each in its run directory.

    Returns
    -------
    DataFrame
        From `wearsim.side_by_side`, with the columns of `with_bands` where both
        campaigns have draws of uncertain inputs.
    """
    first, second = paths
    table = side_by_side(*paths.values(), names=(first, second))
    drawn = [draws_in(path.parent) for path in paths.values()]
    if all(results is not None for results in drawn):
        a, b = (results for results in drawn if results is not None)
        count = min(len(a.results), len(b.results))
        draws = (
            (load_results(a.results[k]), load_results(b.results[k]))
            for k in range(count)
        )
        nominal = side_by_side(a.nominal, b.nominal, names=(first, second))
        paired = _paired(a.bands, b.bands, count)
        table = with_bands(table, draws, nominal=nominal, paired=paired)
    return table


def _paired(a: xr.Dataset, b: xr.Dataset, count: int) -> bool:
    """Return True if the first draws of both have the same values of the inputs."""
    return np.array_equal(a["input_name"].values, b["input_name"].values) and (
        np.array_equal(a["drawn"].values[:count], b["drawn"].values[:count])
    )


def _report_named_event(observer: Observer, name: str, event: Event) -> None:
    """Report an event of a campaign under its name."""
    observer(replace(event, name=name))
