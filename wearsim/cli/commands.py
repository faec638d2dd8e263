"""The commands in the order of the help: their summaries, examples and flags.

The help reads this module alone: it imports nothing large.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable
from functools import partial
from typing import Any

from wearsim import __version__
from wearsim.cli.parser import Parser, PrintCompletion, Renamed, number
from wearsim.studies.contact_flags import GROUPS, flags_of

Commands = Any  # what `add_subparsers` returns; argparse has no public name for it
_HIDDEN: dict[str, Any] = {"default": argparse.SUPPRESS, "help": argparse.SUPPRESS}
_REMOVES = (
    "; KEY= removes the key or table, so that its default applies; "
    "operation.block.NAME.friction=0.2 acts on the block, or row of a programme, of "
    "this name"
)


def _command(
    commands: Commands, name: str, summary: str, examples: str, about: str = ""
) -> argparse.ArgumentParser:
    """Add a command; `examples`, a line each, and `about` are written indented."""
    lines = textwrap.dedent(examples).strip().splitlines()
    shown = "\n".join(["example:", *(f"  {line}" for line in lines)])
    command: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=summary[:1].upper() + summary[1:] + ".",
        epilog=textwrap.dedent(about).removeprefix("\n") + "\n" * bool(about) + shown,
    )
    command.add_argument("--debug", action="store_true", **_HIDDEN)
    return command


def _add_renamed(command: argparse.ArgumentParser, old: str, new: str) -> None:
    """Flag of an earlier version, an error that names the new one."""
    command.add_argument(old, metavar=new, nargs="?", action=Renamed, **_HIDDEN)


def _add_set(command: argparse.ArgumentParser, of: str, effect: str = "") -> None:
    command.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help=f"another value for a key of {of}, such as "
        f"campaign.max_step_km=10{effect}; in a comparison for both scenes, with rig. "
        "or field. before the key for one of them; can be repeated",
    )


def _add_smoothing(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--smoothing",
        choices=["off", "half", "double"],
        help="no smoothing of the wear increments, or half or double the scene's "
        "wavelength",
    )


def _add_quiet(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-q", "--quiet", action="store_true", help="write no lines on the progress"
    )


def _add_workers(command: argparse.ArgumentParser, of: str) -> None:
    alone = command.add_mutually_exclusive_group()
    alone.add_argument(
        "-j",
        "--jobs",
        metavar="N",
        type=partial(number, 1, 1024),
        help=f"processes for {of} (default: one per core)",
    )
    alone.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help=f"run {of} on the Dask cluster with this scheduler (tcp://host:8786, or "
        "its scheduler file); --out is a folder that its workers share",
    )


def _contact(commands: Commands) -> None:
    command = _command(
        commands,
        "contact",
        "solve the contact of one or both wheels with rail or roller, at one "
        "operating point or a table of them",
        """
        wearsim contact --wheel S1002 --rail 60E1 --inclination 1:40 --shift-mm 3
        wearsim contact --shift-mm 3 --roller-radius-mm 1000 --json
        wearsim contact --shift-mm 3 --yaw-mrad 2 --side both
        wearsim contact --shift-mm 3 --creepage=-0.0016,0,-0.197
        wearsim contact --lateral-force-kN 10 --axle-load-kN 160 --roller-radius-mm 1000 --side both
        wearsim contact --shift-mm 5 --plot contact.png
        wearsim contact --table points.csv --roller-radius-mm 500 > solved.csv
        wearsim contact --shift-mm 3 --match max_pressure,wear_number,place --rig rig.toml
        """,
        about="""
        Tables: a CSV file with a header, columns named like the flags (shift_mm, yaw_mrad, roll, creepage, ...), one
        row per operating point. An empty cell takes the flag's value; other columns are carried through. What a row
        gives goes before the flags. Nothing is computed before the whole table is free of faults; a row whose contact
        has no solution is named on stderr, the others are printed, the exit code is 2 (3 if a computation failed).
        The output holds one line per patch and is a table for this command again: its results are computed anew,
        lines of further patches of a wheel (patch 2, 3, ...) are left out. So are rows without any value.
        """,
    )
    groups = {title: command.add_argument_group(title) for title in GROUPS}
    for title, part in GROUPS.items():
        for flag in flags_of(part).values():
            default = "" if flag.default is None else f" (default {flag.default})"
            groups[title].add_argument(
                f"--{flag.name}",
                metavar="X",
                dest=flag.column,
                help=flag.meaning + default,
            )
    groups["motion and load"].add_argument(
        "--mirror",
        action="store_true",
        help="solve the mirror image: right and left wheel exchanged, signs of shift, "
        "yaw, roll, curve, lateral force and lateral creepages changed",
    )
    output = command.add_argument_group("tables and output")
    output.add_argument(
        "--table",
        metavar="CSV",
        help="solve every row of a table, - for stdin; prints CSV; columns creepage "
        "and traction_coefficient are a measured creep curve, which is fitted",
    )
    output.add_argument("--json", action="store_true", help="print JSON, SI units")
    output.add_argument(
        "--plot",
        metavar="FILE",
        help="draw the contact of one point: .png, .svg or .pdf",
    )
    matching = command.add_argument_group("match on a rig")
    matching.add_argument(
        "--match",
        metavar="NAME,...",
        help="find the set-point of a rig (shift, yaw, wheel load, speed difference of "
        "the rollers) whose contact has the max_pressure, wear_number and place of the "
        "wheels of --side, all or some of them; models and roll act on both contacts",
    )
    matching.add_argument(
        "--rig",
        metavar="FILE",
        help="scene file of the rig: wheelset, rollers, friction and speed of its "
        "blocks, limits of the rig that it names, ranges of its [programme]",
    )
    matching.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="another value for a key of the scene of --rig, such as "
        "counterface.roller_radius_mm=500; can be repeated",
    )
    matching.add_argument(
        "--csv",
        metavar="FILE",
        help="write the match as CSV, SI units; - for stdout",
    )
    _add_renamed(command, "--flange-back-mm", "--back-to-back-mm")


def _profile(commands: Commands) -> None:
    command = _command(
        commands,
        "profile",
        "measure a wheel or rail profile, standard, from a file or of a result: Sh, "
        "Sd, qR, limits, conicity, wear; convert and draw it; or measure a whole "
        "folder",
        """
        wearsim profile S1002
        wearsim profile S1002/h30 --rail 60E2 --inclination 1:20
        wearsim profile profiles/measured/wheel_worn_right.whl --against S1002 --plot worn.png
        wearsim profile profiles/measured/wheel_worn_right.whl --left profiles/measured/wheel_worn_left.whl
        wearsim profile profiles/measured/wheel_worn_right.whl --reprofile-to S1002 --diameter-mm 900
        wearsim profile profiles/measured/rail_worn_outer.ban --wheel S1002 --json
        wearsim profile out/rig.nc --at-km 1000 --wheel left --convert simpack
        wearsim profile out/rig.nc --left out/rig.nc --against S1002
        wearsim profile points.csv --kind wheel --units in --convert miniprof --out wheel.whl
        wearsim profile LMA.txt --kind wheel --back-to-back-mm 1353 --limits Chinese
        wearsim profile --fleet profiles/measured --against S1002 --plot fleet.pdf
        """,
    )
    command.add_argument(
        "name",
        metavar="NAME|FILE",
        nargs="?",
        help="standard shape (S1002, 60E1, ...), file of points or result file",
    )
    reading = command.add_argument_group(
        "reading of files (stated for every file given; else detected by extension, "
        "header and points)",
    )
    reading.add_argument("--kind", metavar="KIND", help="wheel or rail")
    reading.add_argument(
        "--format",
        metavar="FORMAT",
        help="simpack, miniprof, gensys, uic519 or two-column",
    )
    reading.add_argument("--units", metavar="UNIT", help="mm, m, cm or in")
    reading.add_argument(
        "--mirror",
        action="store_true",
        help="flange (wheel) or gauge side (rail) at the end of larger y",
    )
    reading.add_argument(
        "--no-mirror", action="store_true", help="at the end of smaller y"
    )
    reading.add_argument(
        "--z-up",
        action="store_true",
        help="z grows away from the flange tip or the foot of the rail",
    )
    reading.add_argument("--z-down", action="store_true", help="z grows towards it")
    reading.add_argument(
        "--origin",
        metavar="ORIGIN",
        help="y of a wheel counts from the running_circle or the flange_back, or y and "
        "z from the gauge_point, a point of the flange",
    )
    reading.add_argument(
        "--offset-y-mm",
        metavar="MM",
        help="length to add to y of a wheel, so that it counts from the running circle",
    )
    reading.add_argument(
        "--offset-z-mm", metavar="MM", help="length to add to z of a wheel"
    )
    reading.add_argument(
        "--at-km",
        metavar="X",
        help="of a result file (.nc): distance; interpolated between steps (default: "
        "the last)",
    )
    wheelset = command.add_argument_group("wheelset and track")
    wheelset.add_argument(
        "--left",
        metavar="FILE",
        help="left wheel, if it differs (NAME|FILE is the right one)",
    )
    wheelset.add_argument(
        "--rail", metavar="NAME", help="rail under a wheel (default 60E1)"
    )
    wheelset.add_argument(
        "--wheel",
        metavar="NAME|SIDE",
        help="wheel on a rail (default S1002); of a result file: right (default) or "
        "left",
    )
    wheelset.add_argument(
        "--inclination",
        metavar="1:N",
        help="of the rail, or none (default 1:40; measured rails stand as measured)",
    )
    wheelset.add_argument(
        "--gauge-mm", metavar="X", help="gauge, 14 mm below the top (default 1435)"
    )
    wheelset.add_argument(
        "--back-to-back-mm",
        metavar="X",
        help="back-to-back distance; stated, it is checked, too (default 1360)",
    )
    wheelset.add_argument(
        "--diameter-mm", metavar="X", help="wheel diameter at the running circle"
    )
    wheelset.add_argument(
        "--left-diameter-mm",
        metavar="X",
        help="diameter of the left wheel, if it differs",
    )
    wheelset.add_argument(
        "--measuring-height-mm",
        metavar="X",
        help="height of Sd above the running circle (default that of the limits, 10)",
    )
    wheelset.add_argument(
        "--running-circle-mm",
        metavar="X",
        help="distance of the running circle from the flange back (default 70)",
    )
    wheelset.add_argument(
        "--amplitude-mm",
        metavar="X,...",
        help="further amplitudes of the equivalent conicity",
    )
    wheelset.add_argument(
        "--limits",
        metavar="NAME|FILE",
        help="limits of the measures: AAR, British, Chinese, TSI or a file (TOML); "
        "default TSI for back-to-back distances near 1360 mm on a gauge near 1435 mm",
    )
    comparison = command.add_argument_group("comparison")
    comparison.add_argument(
        "--against",
        metavar="NAME|FILE",
        help="earlier or new profile: wear between the two",
    )
    comparison.add_argument(
        "--align",
        metavar="RULE",
        help="lay NAME|FILE on it by best_fit (default for measured profiles) or none",
    )
    comparison.add_argument(
        "--rotate",
        action="store_true",
        help="best_fit may rotate it, too: for profiles measured at a tilt",
    )
    comparison.add_argument(
        "--reprofile-to",
        metavar="NAME",
        help="template a worn wheel is reprofiled to; with --left both to one diameter",
    )
    comparison.add_argument(
        "--smooth-mm",
        metavar="X",
        help="take out waves shorter than this before anything is measured",
    )
    output = command.add_argument_group("output")
    output.add_argument(
        "--convert",
        metavar="FORMAT",
        help="write it (aligned, if --align is stated) as two-column, miniprof, "
        "simpack",
    )
    output.add_argument(
        "-o",
        "--out",
        metavar="FILE",
        help="file of --convert (default: the name with the format's extension, in "
        "this folder)",
    )
    output.add_argument(
        "--overwrite",
        action="store_true",
        help="replace existing files of --out and --csv",
    )
    output.add_argument(
        "--csv",
        metavar="FILE",
        help="points, depth along the profile (--against) or table (--fleet); - for "
        "stdout",
    )
    output.add_argument("--json", action="store_true", help="print JSON, SI units")
    output.add_argument("--plot", metavar="FILE", help="draw it: .png, .svg or .pdf")
    output.add_argument(
        "--fleet", metavar="DIR", help="every profile file of a folder as one table"
    )
    _add_renamed(command, "--flange-back-mm", "--back-to-back-mm")
    _add_renamed(command, "--turn-to", "--reprofile-to")


def _new(commands: Commands) -> None:
    command = _command(
        commands,
        "new",
        "write a commented scene file to start from, ready to run",
        """
        wearsim new rig
        wearsim new compare --out study.toml
        """,
    )
    command.add_argument(
        "kind",
        choices=["rig", "rig_given", "field", "field_given", "compare", "sweep"],
        help="rig: by force; field: a vehicle on a route; _given: at given positions",
    )
    command.add_argument(
        "-o",
        "--out",
        metavar="FILE",
        help="scene file (default rig.toml, ... in this folder); scenes that it names "
        "are written next to it, or taken as they are where they exist",
    )
    command.add_argument(
        "--force", action="store_true", help="replace FILE if it exists"
    )


def _check(commands: Commands) -> None:
    command = _command(
        commands,
        "check",
        "show all faults of a scene file, or what it would run",
        """
        wearsim check workflows/rig_vs_field.toml
        wearsim check rig.toml --json
        wearsim check rig.toml --zones --set wheelset.profile=out/rig.nc
        """,
    )
    command.add_argument(
        "scene", metavar="SCENE", help="scene file (TOML), - for stdin"
    )
    command.add_argument(
        "--all",
        action="store_true",
        help="list every state and every case, cells and size of the result",
    )
    command.add_argument(
        "--zones",
        action="store_true",
        help="print the share of each block in the wear of each zone of the wheels "
        "instead, with the uncertainty from errors of the set-points",
    )
    command.add_argument(
        "--error",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="error of a set-point for --zones, such as shift_mm=0.2 (default 0.1 mm "
        "of shift, 0.2 mrad of yaw, 1 kN of a wheel load, 0.5 kN of a lateral force, "
        "10 mm of cant or cant deficiency)",
    )
    command.add_argument(
        "--json",
        action="store_true",
        help="print JSON, with every value that would act",
    )
    _add_set(command, "the scene", _REMOVES)
    _add_smoothing(command)


def _run(commands: Commands) -> None:
    command = _command(
        commands,
        "run",
        "run the campaign or comparison of a scene file and write its report",
        """
        wearsim run workflows/rig_vs_field.toml --out out
        wearsim run workflows/rig_given.toml --smoothing half --set campaign.error_tolerance_um=0.125 --out half
        wearsim run workflows/uncertainty.toml --bands --out bands
        wearsim run forecast.toml --bands --posterior learned --out forecast
        """,
    )
    command.add_argument(
        "scene", metavar="SCENE", help="scene file (TOML), - for stdin"
    )
    command.add_argument(
        "-o",
        "--out",
        metavar="DIR",
        help="run directory (default: the scene file's name without .toml)",
    )
    _add_set(command, "the scene", _REMOVES)
    _add_smoothing(command)
    command.add_argument(
        "--bands",
        action="store_true",
        help="also run the draws of [uncertainty] and report the bands that they "
        "leave to wear and factors",
    )
    command.add_argument(
        "--posterior",
        metavar="DIR",
        help="with --bands: draw the inputs that a calibration in DIR has learned from "
        "its posterior, the others as the scene states",
    )
    _add_workers(command, "the draws of --bands, or the cases of a sweep,")
    _add_quiet(command)
    command.add_argument(
        "--json",
        action="store_true",
        help="print JSON: result files, report, warnings, and how each campaign ended",
    )


def _sweep(commands: Commands) -> None:
    command = _command(
        commands,
        "sweep",
        "run many campaigns, each resumable by itself, and write one table of them",
        """
        wearsim sweep workflows/sweep_rig.toml --out out
        wearsim sweep rig.toml --vary wheelset.radius_mm=420,460 --vary wear.form=local,patch_mean
        wearsim sweep cases.toml --out out --case $SLURM_ARRAY_TASK_ID
        wearsim sweep cases.toml --out /shared/out --cluster tcp://node1:8786
        """,
    )
    command.add_argument(
        "scene", metavar="SCENE", help='sweep file (kind = "sweep"), or a scene to vary'
    )
    command.add_argument(
        "-o",
        "--out",
        metavar="DIR",
        help="directory of the sweep (default: the file's name without .toml)",
    )
    command.add_argument(
        "--vary",
        metavar="KEY=VALUE,...",
        action="append",
        default=[],
        help="vary a key of the scene; given several times, every value with every "
        "other; an empty value removes the key, so that its default applies; "
        "operation.block.NAME.friction=0.2 acts on the block, or row of a programme, "
        "of this name",
    )
    command.add_argument(
        "--table",
        metavar="CSV",
        help="cases of the scene, with columns named section.key",
    )
    alone = command.add_mutually_exclusive_group()
    alone.add_argument(
        "--case",
        metavar="K",
        type=int,
        help="run case K only, counted from 1 (job arrays)",
    )
    alone.add_argument(
        "--list", action="store_true", help="show and check the cases; run nothing"
    )
    _add_workers(command, "the cases")
    _add_quiet(command)
    command.add_argument("--json", action="store_true", help="print JSON")


def _calibrate(commands: Commands) -> None:
    command = _command(
        commands,
        "calibrate",
        "learn about the uncertain inputs of a scene from measured wheels",
        """
        wearsim calibrate workflows/calibrate_rig.toml --measured workflows/calibrate_rig.csv --out learned
        wearsim run forecast.toml --bands --posterior learned --out forecast
        """,
        about="""
        SCENE is a rig, field or comparison with [[uncertainty.input]]: these inputs
        are unknown, their distributions what is believed before. The table (CSV) has
        the columns distance_km, wheel (right, left; both for masses), campaign (rig or
        field, where the scene has both), and profile (a file) or Sh_mm, Sd_mm, qR_mm,
        mass_kg, each with its standard deviation (Sh_sd_mm, mass_sd_kg). Wear counts
        from the first measurement, at from_km of [uncertainty.measured]. Several rows
        for one distance, around the circumference, are averaged.
        """,
    )
    command.add_argument(
        "scene", metavar="SCENE", help="scene file (TOML) with [uncertainty]"
    )
    command.add_argument(
        "--measured", metavar="CSV", required=True, help="table of measured wheels"
    )
    command.add_argument(
        "-o",
        "--out",
        metavar="DIR",
        help="directory of the calibration (default: the scene file's name without "
        ".toml, with _learned)",
    )
    _add_set(command, "the scene", "")
    _add_workers(command, "the campaigns")
    _add_quiet(command)
    command.add_argument("--json", action="store_true", help="print JSON")


def _resume(commands: Commands) -> None:
    command = _command(
        commands,
        "resume",
        "continue an interrupted run directory, or make a campaign longer; else a "
        "finished one is left as it is",
        """
        wearsim resume out
        wearsim resume out --set campaign.distance_km=200000
        wearsim resume out --set campaign.error_tolerance_um=2
        """,
    )
    command.add_argument("directory", metavar="DIR", help="run directory")
    _add_set(
        command,
        "[campaign] on distance, step, tolerance or smoothing",
        ", from the next step on",
    )
    _add_quiet(command)


def _status(commands: Commands) -> None:
    command = _command(
        commands,
        "status",
        "show how far the campaigns of a run directory, sweep or calibration are",
        """
        wearsim status out
        """,
    )
    command.add_argument(
        "directory",
        metavar="DIR",
        help="run directory, or that of a sweep or calibration",
    )
    command.add_argument("--json", action="store_true", help="print JSON")


def _inspect(commands: Commands) -> None:
    command = _command(
        commands,
        "inspect",
        "summarise a result file, or those of a run directory, as text, JSON, figures "
        "or a film",
        """
        wearsim inspect out
        wearsim inspect out/rig.nc
        wearsim inspect out/rig.nc --plot figures
        wearsim inspect out/rig.nc --animate rig.gif
        """,
    )
    command.add_argument(
        "file", metavar="FILE|DIR", help="result file (netCDF), or run directory"
    )
    command.add_argument(
        "--all",
        action="store_true",
        help="also print contact, wear steps, counterface, laws and settings",
    )
    command.add_argument("--json", action="store_true", help="print JSON")
    command.add_argument(
        "--plot", metavar="DIR", help="write the figures of the report into this folder"
    )
    command.add_argument(
        "--animate",
        metavar="FILE",
        help="write the wearing profiles and their contact patches as a film (.gif)",
    )


def _compare(commands: Commands) -> None:
    command = _command(
        commands,
        "compare",
        "set two results of any kind side by side: life, reprofiling, wear by zone",
        """
        wearsim compare s1002/field.nc thin/field.nc
        wearsim compare early late --csv rules.csv
        """,
    )
    for name in ("first", "second"):
        command.add_argument(
            name,
            metavar=name.upper(),
            help=f"{name} result file, or run directory of one campaign",
        )
    command.add_argument(
        "--names",
        nargs=2,
        metavar="NAME",
        help="names of both, by default those of their files or folders",
    )
    command.add_argument("--csv", metavar="FILE", help="also write the table as CSV")
    command.add_argument("--json", action="store_true", help="print JSON")


def _translate(commands: Commands) -> None:
    command = _command(
        commands,
        "translate",
        "compare a rig result with a field result: equivalent distance, factors and "
        "their causes",
        """
        wearsim translate out                        of a comparison
        wearsim translate out/rig.nc out/field.nc
        wearsim translate out/rig.nc out/field.nc --all --out translation.nc
        wearsim translate out/rig.nc out/field.nc --field-km 20000   how many rig km for 20 000 km of the field
        """,
    )
    command.add_argument(
        "rig",
        metavar="RIG",
        help="result file of the rig, its run directory, or that of a comparison",
    )
    command.add_argument(
        "field",
        nargs="?",
        metavar="FIELD",
        help="result file of the field, or its run directory (default: the other "
        "result of a comparison)",
    )
    command.add_argument(
        "--field-km",
        metavar="KM",
        type=partial(number, 1e-3, 1e8),
        help="also say which distance of the rig wears as much as this distance of "
        "the field",
    )
    command.add_argument(
        "--rig-km",
        metavar="KM",
        type=partial(number, 1e-3, 1e8),
        help="also say which distance of the field wears as much as this distance of "
        "the rig",
    )
    command.add_argument(
        "-o",
        "--out",
        metavar="FILE",
        help="also write all factors, as functions, to this netCDF file",
    )
    command.add_argument(
        "--all",
        action="store_true",
        help="also print all tables: contact and wear at equal distance, depth and "
        "area, equal operating points, causes, bands",
    )
    command.add_argument(
        "--csv",
        metavar="FILE",
        help="write the factors, also those at equal operating points, as CSV; - for "
        "stdout; empty where undefined",
    )
    command.add_argument(
        "--json",
        action="store_true",
        help="print the tables as JSON; null where undefined",
    )


def _report(commands: Commands) -> None:
    command = _command(
        commands,
        "report",
        "write the self-contained HTML report of a run directory, a pair of campaigns, "
        "a sweep or a calibration",
        """
        wearsim report out
        wearsim report out --pdf
        """,
    )
    command.add_argument(
        "--pdf",
        action="store_true",
        help="also print it to report.pdf with the Chromium or Chrome of this machine, "
        "or with the browser that the environment variable WEARSIM_BROWSER names",
    )
    command.add_argument(
        "directory",
        metavar="DIR",
        help="run directory of a campaign or of rig and field, with their bands; or that "
        "of two campaigns of one kind, a sweep or a calibration. Campaigns and sweeps "
        "need not be finished. `wearsim programme` writes the report of its directory",
    )


def _chart(commands: Commands) -> None:
    command = _command(
        commands,
        "chart",
        "run short campaigns with every combination of contact models, compare their "
        "wear with a half-space's",
        """
        wearsim chart --depth-um 30
        wearsim chart my_scene.toml --report chart.html
        """,
    )
    command.add_argument(
        "scene",
        metavar="SCENE",
        nargs="?",
        default="workflows/rig_vs_field.toml",
        help="scene file of a campaign or comparison (default "
        "workflows/rig_vs_field.toml)",
    )
    command.add_argument(
        "--depth-um",
        metavar="D",
        type=partial(number, 0.5, 5000.0),
        default=60.0,
        help="largest wear depth at the end of the campaigns, by the half-space "
        "(default 60)",
    )
    command.add_argument(
        "--report",
        metavar="FILE",
        help="also write a page with figure and table (.html)",
    )
    command.add_argument("--json", action="store_true", help="print JSON")


def _programme(commands: Commands) -> None:
    command = _command(
        commands,
        "programme",
        "design a rig programme that reproduces the wear pattern of the field in the "
        "shortest running time",
        """
        wearsim programme rig.toml --target out/field.nc --at-km 100000 --out designed
        wearsim programme rig.toml --target worn.csv --out designed
        wearsim programme rig.toml --target out/field.nc --out designed --set programme.guard=0
        wearsim programme small.toml large.toml --target out/field.nc --out designed
        """,
        about="""
        [programme] of the scene states tolerance, blocks, guard, and the set-points to
        choose from. --out gets programme.csv, the whole programme in its order, with
        the columns that [operation] programme reads; stage1.toml, stage2.toml and so
        on, which run it; programme.nc; and report.html. Run the stages in their order:
        each begins on the wheels of the one before.
          cd designed && wearsim run stage1.toml --out stage1
          cd designed && wearsim run stage2.toml --out stage2
        Where rollers wear, programme.toml alone runs it all.
        """,
    )
    command.add_argument(
        "scene",
        metavar="RIG",
        nargs="+",
        help="scene file of the rig; of several rigs one table, and for each the "
        "folder of its name in --out",
    )
    command.add_argument(
        "--target",
        metavar="FILE",
        required=True,
        help="result of the field (.nc), or a worn wheel as a file of points, against "
        "the new wheels of the scene",
    )
    command.add_argument(
        "--at-km",
        metavar="KM",
        type=partial(number, 1e-3, 1e8),
        help="distance of the field result to reproduce (default: its end), or that "
        "the worn wheel ran",
    )
    command.add_argument(
        "-o", "--out", metavar="DIR", required=True, help="folder of the programme"
    )
    _add_set(command, "the scene")
    _add_quiet(command)
    command.add_argument("--json", action="store_true", help="print JSON")


def _schema(commands: Commands) -> None:
    command = _command(
        commands,
        "schema",
        "print the JSON schema of scene files, for editors, or the reference of their "
        "keys",
        """
        wearsim schema > scene.schema.json
        wearsim schema --markdown > reference.md
        """,
    )
    alone = command.add_mutually_exclusive_group()
    alone.add_argument(
        "--json",
        action="store_true",
        help="accepted for uniformity; the schema is JSON",
    )
    alone.add_argument(
        "--markdown",
        action="store_true",
        help="every key with unit, values, default and meaning",
    )


COMMANDS: dict[str, Callable[[Commands], None]] = {
    "contact": _contact,
    "profile": _profile,
    "new": _new,
    "check": _check,
    "run": _run,
    "sweep": _sweep,
    "calibrate": _calibrate,
    "resume": _resume,
    "status": _status,
    "inspect": _inspect,
    "compare": _compare,
    "translate": _translate,
    "programme": _programme,
    "report": _report,
    "chart": _chart,
    "schema": _schema,
}
"""What adds each command, which is executed by the module of its name in this
package.
"""


def build_parser() -> argparse.ArgumentParser:
    """Parser of the whole command line."""
    parser = Parser(
        prog="wearsim",
        description=(
            "Wear and rolling contact fatigue of railway wheels on a roller rig and "
            "in the field, and the factors between them."
        ),
        epilog="examples:\n"
        "  wearsim check workflows/rig_vs_field.toml\n"
        "  wearsim run workflows/rig_vs_field.toml --out out\n"
        "  wearsim COMMAND --help\n",
    )
    parser.add_argument("--version", action="version", version=f"wearsim {__version__}")
    parser.add_argument(
        "--debug", action="store_true", help="show the traceback of an internal error"
    )
    parser.add_argument(
        "--print-completion",
        choices=["bash", "zsh", "tcsh"],
        action=PrintCompletion,
        help="print the completion of commands, flags and files for a shell",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in COMMANDS.values():
        add(commands)
    return parser
