"""`wearsim programme`: a rig programme that reproduces a wear pattern."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.flags import overrides_of
from wearsim.report.programme import notes, programme_lines, render_programme
from wearsim.studies.programme import DATA_FILE, PROGRAMME_FILE, programme
from wearsim.whole_files import write_whole


def execute(arguments: argparse.Namespace) -> int:
    """Design the programme, write it, and print what it reaches."""
    out = Path(arguments.out)

    def report(line: str) -> None:
        if not arguments.quiet:
            print(line, file=sys.stderr)

    made = programme(
        arguments.scene,
        arguments.target,
        out,
        distance=None if arguments.at_km is None else 1e3 * arguments.at_km,
        overrides=overrides_of(arguments.set),
        report=report,
    )
    page = out / "report.html"
    write_whole(page, render_programme(made))
    if arguments.json:
        print_json(dict(made.attrs))
        return 0
    print("\n".join(programme_lines(made)))
    for title, name in _NOTES.items():
        found = notes(made, name)
        if found:
            print(f"\n{title}:", *(f"  {line}" for line in found), sep="\n")
    print(f"\nprogramme: {out / PROGRAMME_FILE}, {out / 'stage1.toml'} and so on")
    print(f"data: {out / DATA_FILE}")
    print(f"report: {page}")
    return 0


_NOTES = {
    "Limits that bind": "limits",
    "Not reproduced within the tolerance": "missed",
    "Stages with a larger error than allowed": "warnings",
}
