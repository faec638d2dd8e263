"""`wearsim profile`: measures, limits, running behaviour, wear, conversion and figures of profiles."""

from __future__ import annotations

import argparse
import re

from wearsim.cli.flags import add_renamed

SUMMARY = (
    "measure a wheel or rail profile, standard, from a file or of a result: Sh, Sd, qR, limits, conicity, "
    "wear; convert and draw it; or measure a whole folder"
)
EXAMPLES = """\
wearsim profile S1002
wearsim profile S1002/h30 --rail 60E2 --inclination 1:20
wearsim profile profiles/measured/wheel_worn_right.whl --against S1002 --plot worn.png
wearsim profile profiles/measured/wheel_worn_right.whl --left profiles/measured/wheel_worn_left.whl
wearsim profile profiles/measured/wheel_worn_right.whl --reprofile-to S1002 --diameter-mm 900
wearsim profile profiles/measured/rail_worn_outer.ban --wheel S1002 --json
wearsim profile out/rig.nc --at-km 1000 --wheel left --convert simpack
wearsim profile out/rig.nc --left out/rig.nc --against S1002
wearsim profile points.csv --kind wheel --units in --convert miniprof --out wheel.whl
wearsim profile --fleet profiles/measured --against S1002 --plot fleet.pdf"""

# group, then name, placeholder (empty: a switch) and meaning of each flag
_FLAGS = {
    "reading of files (stated for every file given; else detected by extension, header and points)": (
        ("kind", "KIND", "wheel or rail"),
        ("format", "FORMAT", "simpack, miniprof, gensys, uic519 or two-column"),
        ("units", "UNIT", "mm, m, cm or in"),
        ("mirror", "", "flange (wheel) or gauge side (rail) at the end of larger y"),
        ("no-mirror", "", "at the end of smaller y"),
        ("z-up", "", "z grows away from the flange tip or the foot of the rail"),
        ("z-down", "", "z grows towards it"),
        ("origin", "ORIGIN", "y of a wheel counts from the running_circle or the flange_back"),
        ("at-km", "X", "of a result file (.nc): distance; interpolated between steps (default: the last)"),
    ),
    "wheelset and track": (
        ("left", "FILE", "left wheel, if it differs (NAME|FILE is the right one)"),
        ("rail", "NAME", "rail under a wheel (default 60E1)"),
        ("wheel", "NAME|SIDE", "wheel on a rail (default S1002); of a result file: right (default) or left"),
        ("inclination", "1:N", "of the rail, or none (default 1:40; measured rails stand as measured)"),
        ("gauge-mm", "X", "gauge, 14 mm below the top (default 1435)"),
        ("back-to-back-mm", "X", "back-to-back distance; stated, it is checked, too (default 1360)"),
        ("diameter-mm", "X", "wheel diameter at the running circle"),
        ("left-diameter-mm", "X", "diameter of the left wheel, if it differs"),
        ("limits", "FILE", "limits (TOML) of the measures instead of the shipped ones"),
    ),
    "comparison": (
        ("against", "NAME|FILE", "earlier or new profile: wear between the two"),
        ("align", "RULE", "lay NAME|FILE on it by best_fit (default for measured profiles) or none"),
        ("rotate", "", "best_fit may rotate it, too: for profiles measured at a tilt"),
        ("reprofile-to", "NAME", "template a worn wheel is reprofiled to; with --left both to one diameter"),
        ("smooth-mm", "X", "take out waves shorter than this before anything is measured"),
    ),
    "output": (
        ("convert", "FORMAT", "write it (aligned, if --align is stated) as two-column, miniprof, simpack"),
        ("out", "FILE", "file of --convert (default: the name with the format's extension, in this folder)"),
        ("overwrite", "", "replace existing files of --out and --csv"),
        ("csv", "FILE", "points, depth along the profile (--against) or table (--fleet); - for stdout"),
        ("json", "", "print JSON, SI units"),
        ("plot", "FILE", "draw it: .png, .svg or .pdf"),
        ("fleet", "DIR", "every profile file of a folder as one table"),
    ),
}


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser._negative_number_matcher = re.compile(r"-\.?\d")
    parser.add_argument(
        "name",
        metavar="NAME|FILE",
        nargs="?",
        help="standard shape (S1002, 60E1, ...), file of points or result file",
    )
    for title, flags in _FLAGS.items():
        group = parser.add_argument_group(title)
        for name, placeholder, meaning in flags:
            if placeholder:
                group.add_argument(f"--{name}", metavar=placeholder, help=meaning)
            else:
                group.add_argument(f"--{name}", action="store_true", help=meaning)
    renamed = {"flange-back-mm": "back-to-back-mm", "turn-to": "reprofile-to"}
    add_renamed(parser, {f"--{old}": f"--{new}" for old, new in renamed.items()})


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print; write what is asked for."""
    from wearsim.cli.profile_run import measure_fleet, measure_one

    return measure_one(arguments) if arguments.fleet is None else measure_fleet(arguments)
