"""`wearsim contact`: contact solutions of one operating point, or of a table of them."""

from __future__ import annotations

import argparse
import re

from wearsim.cli.flags import add_renamed
from wearsim.studies.contact_flags import FLAGS, MOTION

SUMMARY = (
    "solve the contact of one or both wheels with rail or roller, at one operating point or a table of them"
)
_ABOUT_TABLES = """\
Tables: a CSV file with a header, columns named like the flags (shift_mm, yaw_mrad, roll, creepage, ...), one
row per operating point. An empty cell takes the flag's value; other columns are carried through. What a row
gives goes before the flags. Nothing is computed before the whole table is free of faults; a row whose contact
has no solution is named on stderr, the others are printed, the exit code is 2 (3 if a computation failed).
The output holds one line per patch and is a table for this command again: its results are computed anew,
lines of further patches of a wheel (patch 2, 3, ...) are left out. So are rows without any value.
"""

EXAMPLES = """\
wearsim contact --wheel S1002 --rail 60E1 --inclination 1:40 --shift-mm 3
wearsim contact --shift-mm 3 --roller-radius-mm 1000 --json
wearsim contact --shift-mm 3 --yaw-mrad 2 --side both
wearsim contact --shift-mm 3 --creepage=-0.0016,0,-0.197
wearsim contact --lateral-force-kN 10 --axle-load-kN 160 --roller-radius-mm 1000 --side both
wearsim contact --shift-mm 5 --plot contact.png
wearsim contact --table points.csv --roller-radius-mm 500 > solved.csv"""


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    # argparse takes only plain negative numbers for values, neither -1e-3 nor -0.001,0,0.2
    parser._negative_number_matcher = re.compile(r"-\.?\d")
    parser.epilog = f"{_ABOUT_TABLES}\n{parser.epilog}"
    groups: dict[str, argparse._ArgumentGroup] = {}
    for flag in FLAGS:
        if flag.group not in groups:
            groups[flag.group] = parser.add_argument_group(flag.group)
        default = "" if flag.default is None else f" (default {flag.default})"
        groups[flag.group].add_argument(
            f"--{flag.name}", metavar="X", dest=flag.column, default=None, help=flag.meaning + default
        )
    groups[MOTION].add_argument(
        "--mirror", action="store_true", help="solve the mirror image: right and left wheel exchanged, signs "
        "of shift, yaw, roll, curve, lateral force and lateral creepages changed"
    )  # fmt: skip
    add_renamed(parser, {"--flange-back-mm": "--back-to-back-mm"})
    output = parser.add_argument_group("tables and output")
    output.add_argument("--table", metavar="CSV", help="solve every row of a table, - for stdin; prints CSV")
    output.add_argument("--json", action="store_true", help="print JSON, SI units")
    output.add_argument("--plot", metavar="FILE", help="draw the contact of one point: .png, .svg or .pdf")


def execute(arguments: argparse.Namespace) -> int:
    """Solve and print."""
    from wearsim.cli.contact_run import solve_and_print

    return solve_and_print(arguments)
