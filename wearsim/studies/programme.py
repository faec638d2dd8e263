"""Rig programme by design: durations that reproduce a wear pattern, by stages."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.campaign.state import State
from wearsim.csv_tables import CsvTable, csv_text
from wearsim.errors import Fault, ResultError, SceneError, raise_any
from wearsim.profile.shape import Profile
from wearsim.quantities import kilometres
from wearsim.scene import RigScene
from wearsim.scene.overrides import Overrides, toml_text
from wearsim.scene.set_points import set_points
from wearsim.studies.design import Block, Design, rig_scene, rows_of
from wearsim.studies.programme_dataset import missed, programme_dataset
from wearsim.translation.programme import (
    pattern_error,
)
from wearsim.translation.translate import write
from wearsim.whole_files import write_whole

PROGRAMME_FILE, DATA_FILE = "programme.csv", "programme.nc"
WHOLE_SCENE = "programme.toml"
"""Scene of the whole programme, where stages cannot begin on worn rollers."""


def programme(
    rig: str | Path | Mapping[str, Any] | RigScene,
    target: str | Path | xr.Dataset | Profile | tuple[Profile, Profile],
    out: str | Path | None = None,
    *,
    distance: float | None = None,
    overrides: Overrides = (),
    report: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Design a rig programme that reproduces a wear pattern in the least time.

    Parameters
    ----------
    rig : str, Path, dict or scene
        Scene of the rig; [programme] states tolerance, blocks, guard and set-points to
        choose from. Its blocks give speed, friction and environment factor.
    target : str, Path, Dataset, Profile or pair of Profile
        Result of a campaign in the field, as a file (.nc) or as
        `wearsim.open_results` gives it; or a worn wheel, of both sides or right and
        left, as a file of points or as profiles, against the new wheels of the rig.
    out : str or Path, optional
        Directory for programme.csv, the whole programme in its order; for stage1.toml,
        stage2.toml and so on, which `wearsim run` takes, or programme.toml alone where
        the rollers wear; and for programme.nc.
    distance : float, optional
        Of the field result to reproduce, by default its end; of a worn wheel, what it
        ran [m].
    overrides : mapping or sequence of Override
        Values that replace those of the scene, as of `wearsim.load_scene`.
    report : callable, optional
        Takes a line on each stage.

    Returns
    -------
    xarray.Dataset
        Over wheel and point: `target` and `depth` of the programme, and `copy`, the
        depth of a campaign that runs the shifts, yaw angles and loads of the field on
        the rig until it is as deep, and `copy_forces` of angles of attack, loads and
        Y/Q [m]. Over `block`: set-points and `distance`. Over
        `stage`: its end (`target_depth`), `field_distance` and `rig_distance`,
        `tolerance`, `smallest_error` of any durations, `largest_error` and `blocks`.
        Over `guard`: `guard_error` and `guard_rig_distance`, and over `count`:
        `blocks_error`, of a stage on new wheels. `attrs` has the accelerations and
        errors, and a line for each limit that binds and each zone that is not
        reproduced.

    Raises
    ------
    SceneError
        For faults of the scene, and set-points beyond the limits of the rig.
    ResultError, ProfileError
        If the target cannot be read, does not fit the rig's wheels, or is not worn; or,
        with a guard, has wear regimes of other names than the law of the rig.
    NumericalError
        If a linear programme is not solved.

    Notes
    -----
    Depth is linear in the durations while the profiles hardly change. So the target is
    cut into stages of depth, and for each of them all set-points are solved on the
    wheels worn so far. The durations of least time keep the error of the pattern below
    the tolerance everywhere, on both wheels. The blocks of the stage are then run as a
    campaign, one after the other; what they wear is what the next stage begins with.
    Set-points by lateral force are solved where it balances.

    Examples
    --------
    >>> import wearsim
    >>> made = wearsim.programme(  # doctest: +SKIP
    ...     "rig.toml", "out/field.nc", "designed", distance=1e8
    ... )
    >>> made["depth"].dims  # doctest: +SKIP
    ('wheel', 'point')
    >>> made.attrs["acceleration_mechanism"]  # doctest: +SKIP
    8.6
    """
    scene = rig_scene(rig, overrides)
    if out is not None:
        _require_writable(Path(out))  # before minutes of design
    design = Design.of(scene, target, distance)
    if out is not None:
        _make_room(Path(out))
    state: State | None = None
    blocks: list[Block] = []
    rows: list[dict[str, float]] = []
    low, out_of_reach = 0.0, False
    for high in map(float, design.target.levels(design.stage_depth)):
        chosen, row = design.stage(len(rows), low, high, state)
        if not chosen:  # within the tolerance without them, or out of reach
            out_of_reach |= row["kept_error"] > row["tolerance"] * (1.0 + 1e-6)
            continue
        state = design.run(chosen, int(row["loops"]), state)
        aim = design.target.stage(low, high).depth
        row["largest_error"] = pattern_error(state.wear_depth, aim).largest
        blocks += chosen
        rows.append(row)
        low = high
        if report is not None:
            report(_stage_line(len(rows), row))
    if state is None:
        raise SceneError([_without_blocks(design, out_of_reach)])
    dataset = programme_dataset(design, blocks, rows, state)
    if out is not None:
        _write(design, blocks, dataset, Path(out))
    return dataset


def rig_scenes(
    rigs: Sequence[str | Path], overrides: Overrides = ()
) -> dict[str, RigScene]:
    """Return the scenes of rigs by the names of their files.

    Raises a SceneError with the faults of all of them, and for files of one name.
    """
    scenes: dict[str, RigScene] = {}
    faults: list[Fault] = []
    for rig in rigs:
        name = Path(rig).stem
        if name in scenes:
            text = f"is a second file named {name}; rename one, for the folders of both"
            faults.append(Fault(text, str(rig)))
        try:
            scenes[name] = rig_scene(rig, overrides)
            set_points(scenes[name])
        except SceneError as error:
            faults += error.faults
    raise_any(faults)
    return scenes


def _without_blocks(design: Design, out_of_reach: bool) -> Fault:
    """Return the fault of a target for which no block runs."""
    if not out_of_reach:
        text = f"tolerance = {design.section.tolerance:g} is met by new wheels"
        return design.scene.fault(("programme", "tolerance"), f"{text}; lower it")
    worst = missed(design, np.zeros_like(design.target.depth[-1]))[0]
    text = (
        "no durations of the set-points come nearer to the target than new wheels: "
        f"{worst}; give more set-points, a larger guard or tolerance"
    )
    return design.scene.fault(("programme",), text)


def _stage_line(stage: int, row: Mapping[str, float]) -> str:
    """Progress of a stage."""
    return (
        f"stage {stage}: to {1e6 * row['target_depth']:.4g} um, "
        f"{kilometres(row['rig_distance'], 4)} in {row['blocks']:.0f} blocks, largest "
        f"error {1e6 * row['largest_error']:.3g} um"
    )


def _require_writable(out: Path) -> None:
    """Raise ResultError where the folder of a programme can't be made or written."""
    ancestor = next(folder for folder in (out, *out.parents) if folder.exists())
    if not ancestor.is_dir():
        raise ResultError(f"{out}: cannot be written: {ancestor} is no folder")
    if not os.access(ancestor, os.W_OK | os.X_OK):
        raise ResultError(f"{out}: cannot be written: {os.strerror(errno.EACCES)}")


def _make_room(out: Path) -> None:
    """Make the folder of a programme; that of an earlier design is removed."""
    patterns = ("stage*.toml", "stage*.csv", WHOLE_SCENE, PROGRAMME_FILE)
    try:
        out.mkdir(parents=True, exist_ok=True)
        for old in (file for pattern in patterns for file in out.glob(pattern)):
            old.unlink()
    except OSError as error:
        raise ResultError(f"{out}: cannot be written: {error.strerror}") from error


def _write(
    design: Design, blocks: Sequence[Block], dataset: xr.Dataset, out: Path
) -> None:
    """Write programme.csv, the scenes that run it, and the dataset.

    Each stage begins on the wheels of the one before. No scene begins on worn rollers,
    so where they wear one runs it all.
    """
    wears = design.scene.counterface.wear is not None
    all_rows: list[dict[str, Any]] = []
    for number in range(dataset.sizes["stage"]):
        loops = int(dataset["loops"].values[number])
        part = [block for block in blocks if block.stage == number]
        rows = rows_of(part, design.set_points, loops)
        all_rows += [
            row | {"name": f"{row['name']} loop {loop + 1}"}
            for loop in range(loops)
            for row in rows
        ]
        if wears:
            continue
        name = f"stage{number + 1}"
        write_whole(out / f"{name}.csv", _csv(rows))
        tables = design.scene_of(rows, loops)
        tables["operation"] = {"programme": f"{name}.csv"}
        if number:
            result = f"stage{number}/rig.nc"
            tables["wheelset"] = _on_result(design, result)
        write_whole(out / f"{name}.toml", toml_text(tables))
    write_whole(out / PROGRAMME_FILE, _csv(all_rows))
    if wears:
        tables = design.scene_of(all_rows, 1)
        tables["operation"] = {"programme": PROGRAMME_FILE}
        write_whole(out / WHOLE_SCENE, toml_text(tables))
    write(dataset, out / DATA_FILE)


def _on_result(design: Design, result: str) -> dict[str, Any]:
    """Return the table of the wheelset with the worn wheels of a result."""
    left_out = ("profile_left", "at_km", "smooth_mm")
    of = design.tables["wheelset"].items()
    kept = {key: value for key, value in of if key not in left_out}
    # a file of points may have stated it
    radius = {"radius_mm": design.scene.wheelset.radius_mm}
    return {**kept, **radius, "profile": result}


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Write rows of blocks as CSV; a key that a row has not is empty."""
    header = list(dict.fromkeys(key for row in rows for key in row))
    cells = [(0, [str(row.get(key, "")) for key in header]) for row in rows]
    return csv_text(CsvTable(1, header, cells, []))
