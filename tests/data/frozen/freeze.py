"""Freeze run directories of small campaigns of the shipped scenes, which every later
version has to open.

`python tests/data/frozen/freeze.py` writes one archive for each into a folder named
after the version. They hold what `wearsim run` leaves, without the report and the last
state of finished campaigns, from which the same version alone makes them longer. Wall
times are left out: the same version freezes the same bytes.
"""

from __future__ import annotations

import json
import lzma
import shutil
import tarfile
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import wearsim
from wearsim.campaign.run import Event, resume, run_scene
from wearsim.scene.overrides import Override

FOLDER = Path(__file__).parent
LEFT_OUT = (".lock", "report.html")
COARSE = {
    "contact.strips": 8,
    "contact.cells": 8,
    "campaign.point_spacing_mm": 1.25,
    "campaign.error_tolerance_um": 20,
    "campaign.first_step_depth_um": 20,
}
FAST = {"contact.model": "fast"}
MONITORED = {"operation.monitor.shifts_mm": [3]}
UNMONITORED = {"operation.monitor": None}
WEARING_ROLLERS = {"counterface.wear": {"factor": 1.0}}


def overrides(values: Mapping[str, Any]) -> list[Override]:
    return [Override(key, value) for key, value in values.items()]


def stop_after(step: int, event: Event) -> None:
    """Stop as Ctrl-C does."""
    if event.kind == "step" and event.step == step:
        raise KeyboardInterrupt


def run(
    scene: str,
    out: Path,
    values: Mapping[str, Any],
    observer: Callable[[Event], None] | None = None,
) -> None:
    command, changed = (
        f"wearsim run workflows/{scene} --out {out.name}",
        overrides({**COARSE, **values}),
    )
    run_scene(
        f"workflows/{scene}", out, command=command, overrides=changed, observer=observer
    )


def fast(out: Path) -> None:
    """Made longer once, so that settings changed."""
    run("rig_given.toml", out, {**FAST, **MONITORED, "campaign.distance_km": 90})
    resume(out, overrides=overrides({"campaign.distance_km": 270}))


def standard(out: Path) -> None:
    values = {"campaign.distance_km": 27, **MONITORED, **WEARING_ROLLERS}
    run("rig_given.toml", out, values)


def compare(out: Path) -> None:
    values = {"rig.campaign.distance_km": 180, "field.campaign.distance_km": 1800}
    run("rig_vs_field.toml", out, {**FAST, **UNMONITORED, **values})


def reprofiled(out: Path) -> None:
    places = {"campaign.reprofiling.at_km": [400], "campaign.distance_km": 800}
    run("limits.toml", out, {**FAST, **places, "campaign.max_step_depth_um": None})


def forced(out: Path) -> None:
    run("rig.toml", out, {**FAST, "campaign.distance_km": 45, **MONITORED})


def vehicle(out: Path) -> None:
    one_axle = {"vehicle.leading_share": 1, "vehicle.turned_share": 0}
    run("field.toml", out, {**FAST, **one_axle, "campaign.distance_km": 300})


def unfinished(out: Path) -> None:
    try:
        run(
            "rig_given.toml",
            out,
            {**FAST, **MONITORED, "campaign.distance_km": 270},
            partial(stop_after, 2),
        )
    except KeyboardInterrupt:
        return
    raise AssertionError("the campaign ended before it was stopped")


DIRECTORIES = (fast, standard, compare, reprofiled, forced, vehicle, unfinished)


def without_wall_times(out: Path) -> None:
    """Set the wall times in the status, which stand nowhere else, to 0."""
    path = out / "status.json"
    status = json.loads(path.read_text(encoding="utf-8"))
    status["updated"] = "1970-01-01T00:00:00+00:00"
    for campaign in status["campaigns"].values():
        campaign |= {"elapsed": 0.0, "time_left": None}
    path.write_text(json.dumps(status, indent=2), encoding="utf-8")


def pack(out: Path, archive: Path) -> None:
    """Write a directory as an archive whose bytes depend on its files alone."""
    with (
        lzma.open(archive, "wb", preset=9) as packed,
        tarfile.open(fileobj=packed, mode="w") as tar,
    ):
        for path in sorted(out.rglob("*")):
            if path.is_file() and not (
                path.name in LEFT_OUT or path.name.endswith(".last.record")
            ):
                member = tarfile.TarInfo(str(path.relative_to(out.parent)))
                member.size = path.stat().st_size
                with open(path, "rb") as content:
                    tar.addfile(member, content)


def main() -> None:
    target = FOLDER / wearsim.__version__
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir()
    with tempfile.TemporaryDirectory() as folder:
        for make in DIRECTORIES:
            out = Path(folder) / make.__name__
            make(out)
            without_wall_times(out)
            pack(out, target / f"{out.name}.tar.xz")


if __name__ == "__main__":
    main()
