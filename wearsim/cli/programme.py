"""`wearsim programme`: a rig programme that reproduces a wear pattern."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import xarray as xr

from wearsim.cli import print_json
from wearsim.cli.flags import overrides_of
from wearsim.errors import WearsimError
from wearsim.report.programme import (
    notes,
    programme_lines,
    render_programme,
    rig_lines,
    rig_table,
)
from wearsim.report.style import in_terminal
from wearsim.scene import RigScene
from wearsim.studies.programme import (
    DATA_FILE,
    PROGRAMME_FILE,
    WHOLE_SCENE,
    programme,
    rig_scenes,
)
from wearsim.whole_files import write_whole

RIGS_FILE = "rigs.csv"


def execute(arguments: argparse.Namespace) -> int:
    """Design the programme of each rig, write it, and print what it reaches."""
    out = Path(arguments.out)
    scenes = rig_scenes(arguments.scene, overrides_of(arguments.set))
    if len(scenes) > 1:
        return _of_rigs(scenes, out, arguments)
    made = _designed(next(iter(scenes.values())), out, arguments)
    if arguments.json:
        print_json(dict(made.attrs))
        return 0
    print("\n".join(map(in_terminal, programme_lines(made))))
    for title, name in _NOTES.items():
        note_lines = notes(made, name)
        if note_lines:
            print(f"\n{title}:", *(f"  {line}" for line in note_lines), sep="\n")
    whole = out / WHOLE_SCENE
    scenes_of = whole if whole.exists() else f"{out / 'stage1.toml'} and so on"
    print(f"\nprogramme: {out / PROGRAMME_FILE}, {scenes_of}")
    print(f"data: {out / DATA_FILE}")
    print(f"report: {out / 'report.html'}")
    return 0


def _designed(
    scene: RigScene, out: Path, arguments: argparse.Namespace, name: str = ""
) -> xr.Dataset:
    """Design the programme of a rig, and write it with its report."""

    def report(line: str) -> None:
        if not arguments.quiet:
            print(f"{name}: {line}" if name else line, file=sys.stderr)

    made = programme(
        scene,
        arguments.target,
        out,
        distance=None if arguments.at_km is None else 1e3 * arguments.at_km,
        report=report,
    )
    write_whole(out / "report.html", render_programme(made))
    return made


def _of_rigs(
    scenes: Mapping[str, RigScene], out: Path, arguments: argparse.Namespace
) -> int:
    """Design and compare the programmes of rigs; the exit code of the worst one."""
    made: dict[str, xr.Dataset] = {}
    failed: dict[str, WearsimError] = {}
    for name, scene in scenes.items():
        try:
            made[name] = _designed(scene, out / name, arguments, name)
        except WearsimError as error:
            failed[name] = error
    for name, reason in failed.items():
        print(f"{name}: {reason}", file=sys.stderr)
    table = out / RIGS_FILE
    outcomes: dict[str, xr.Dataset | WearsimError] = {**made, **failed}
    every = {name: outcomes[name] for name in scenes}
    write_whole(table, rig_table(every).to_csv(index=False))
    if arguments.json:
        faults = {name: {"fault": str(reason)} for name, reason in failed.items()}
        held = {name: dict(of.attrs) for name, of in made.items()} | faults
        print_json({name: held[name] for name in scenes})
    elif made:
        print(*rig_lines(made), sep="\n")
        print(f"\ntable: {table}")
        print(f"programmes, data and reports: {', '.join(str(out / n) for n in made)}")
    return max((reason.exit_code for reason in failed.values()), default=0)


_NOTES = {
    "Limits that bind": "limits",
    "Not reproduced within the tolerance": "missed",
    "Stages with a larger error than allowed": "warnings",
}
