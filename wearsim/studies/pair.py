"""Two campaigns of one kind, run one after the other and set side by side."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pandas as pd

from wearsim.campaign.directory import PAIR, is_claimed, require_own_directory
from wearsim.campaign.event import Event
from wearsim.campaign.run import Observer, run_scene
from wearsim.errors import Fault, ResultError, issue_warning
from wearsim.scene import PairScene, prepare
from wearsim.scene.initial_contact import check_contact
from wearsim.translation.side_by_side import side_by_side
from wearsim.whole_files import write_whole

TABLE = "comparison.csv"
"""File of the table in the directory of both campaigns."""


def run_pair(
    scene: PairScene,
    out: Path,
    *,
    command: str = "",
    observer: Observer | None = None,
    warn: Callable[[Fault], None] = issue_warning,
) -> tuple[dict[str, Path], pd.DataFrame]:
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
    paths : dict of str to Path
        Result files by name.
    table : DataFrame
        Of `wearsim.side_by_side`, which is also written to `comparison.csv`.

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
    require_own_directory(out)
    if is_claimed(out):
        raise ResultError(
            f"{out} is the run directory of one campaign; choose another --out"
        )
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / PAIR, json.dumps({"campaigns": list(scene.pair)}, indent=2))
    paths = {}
    for name, part in scene.pair.items():
        (paths[name],) = run_scene(
            part,
            out / name,
            command=command,
            observer=None if observer is None else partial(_named, observer, name),
            warn=lambda _: None,
        )
    first, second = scene.pair
    table = side_by_side(*paths.values(), names=(first, second))
    write_whole(out / TABLE, table.to_csv(index=False))
    return paths, table


def _named(observer: Observer, name: str, event: Event) -> None:
    """Report an event of a campaign under its name."""
    observer(replace(event, name=name))
