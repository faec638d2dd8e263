"""`wearsim new`: a commented scene file to start from."""

from __future__ import annotations

import argparse

SUMMARY = "write a commented scene file to start from, ready to run"
EXAMPLES = "wearsim new rig\nwearsim new compare --out study.toml"

SHIPPED = {
    "rig": ("rig.toml",),
    "rig_given": ("rig_given.toml",),
    "field": ("field.toml",),
    "field_given": ("field_given.toml",),
    "compare": ("rig_vs_field.toml", "rig_given.toml", "field_given.toml"),
    "sweep": ("sweep_rig.toml", "rig_given.toml"),
}
"""Shipped scene of each kind, and the scenes it names."""


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument(
        "kind", choices=SHIPPED, help="rig: by force; field: a vehicle on a route; _given: at given positions"
    )
    parser.add_argument(
        "--out", metavar="FILE",
        help="scene file (default rig.toml, ... in this folder); scenes that it names are written next to "
        "it, or taken as they are where they exist",
    )  # fmt: skip
    parser.add_argument("--force", action="store_true", help="replace FILE if it exists")


def execute(arguments: argparse.Namespace) -> int:
    """Write the scene and what it names; say how to go on."""
    import shlex
    from pathlib import Path

    from wearsim.errors import Fault, SceneError
    from wearsim.profile.standard import shipped_path
    from wearsim.whole_files import write_whole

    name, *named = SHIPPED[arguments.kind]
    out = f"{arguments.kind}.toml" if arguments.out is None else arguments.out
    target = Path(out)
    faults = (
        (not out.isprintable() or not target.name, "must be the name of a file"),
        (target.name in named, "is the name of a scene that it takes; choose another name"),
        (target.is_dir(), "is a folder; give the name of a file in it"),
        (not target.parent.is_dir(), "its folder does not exist; make it first"),
        (target.exists() and not arguments.force, "exists already; choose another name or add --force"),
    )
    for wrong, text in faults:
        if wrong:
            raise SceneError([Fault(f"--out = {out!r} {text}")])
    for other, source in ((target, name), *((target.with_name(each), each) for each in named)):
        # a scene looks for those it names in the current folder first
        existing = [place for place in (Path(source), other) if place.is_file() and other != target]
        if existing:
            print(f"takes {existing[0]}, which exists")
            continue
        text = shipped_path("workflows", source).read_text(encoding="utf-8")
        write_whole(other, text.replace(f"workflows/{source}", shlex.quote(str(other))))
        print(f"wrote {other}")
    file, command = shlex.quote(out), "sweep" if arguments.kind == "sweep" else "run"
    print(f"next: `wearsim check {file}`, then `wearsim {command} {file} --out DIR`")
    return 0
