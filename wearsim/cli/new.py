"""`wearsim new`: a commented scene file to start from."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from wearsim.errors import Fault, SceneError
from wearsim.profile.standard import shipped_path
from wearsim.whole_files import write_whole

SHIPPED = {
    "rig": ("rig.toml",),
    "rig_given": ("rig_given.toml",),
    "field": ("field.toml",),
    "field_given": ("field_given.toml",),
    "compare": ("rig_vs_field.toml", "rig_given.toml", "field_given.toml"),
    "sweep": ("sweep_rig.toml", "rig_given.toml"),
}
"""Shipped scene of each kind, and the scenes it names."""


def execute(arguments: argparse.Namespace) -> int:
    """Write the scene and what it names; say how to go on."""
    name, *named = SHIPPED[arguments.kind]
    out = f"{arguments.kind}.toml" if arguments.out is None else arguments.out
    target = Path(out)
    faults = (
        (not out.isprintable() or not target.name, "must be the name of a file"),
        (
            target.name in named,
            "is the name of a scene that it takes; choose another name",
        ),
        (target.is_dir(), "is a folder; give the name of a file in it"),
        (not target.parent.is_dir(), "its folder does not exist; make it first"),
        (
            target.exists() and not arguments.force,
            "exists already; choose another name or add --force",
        ),
    )
    for wrong, text in faults:
        if wrong:
            raise SceneError([Fault(f"--out = {out!r} {text}")])
    for destination, source in (
        (target, name),
        *((target.with_name(file_name), file_name) for file_name in named),
    ):
        # a scene looks for those it names in the current folder first
        existing = [
            place
            for place in (Path(source), destination)
            if place.is_file() and destination != target
        ]
        if existing:
            print(f"takes {existing[0]}, which exists")
            continue
        text = shipped_path("workflows", source).read_text(encoding="utf-8")
        write_whole(
            destination,
            text.replace(f"workflows/{source}", shlex.quote(str(destination))),
        )
        print(f"wrote {destination}")
    file, command = shlex.quote(out), "sweep" if arguments.kind == "sweep" else "run"
    print(f"next: `wearsim check {file}`, then `wearsim {command} {file} --out DIR`")
    return 0
