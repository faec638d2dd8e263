"""Processes of runs, sweeps, bands, translations and reports killed at a moment, at a file, within a file.

After each kill nothing is half written under a final name, and what continues it has every variable bit-equal
to that of an uninterrupted run.
"""

import json
import os
import shutil
import signal
import tempfile
import time
from functools import cache
from pathlib import Path

import netCDF4
import numpy as np
from siege import chosen, require
from siege_nursery import RIG, forked

from wearsim.errors import ResultError
from wearsim.results import load_results

FIELD = (
    RIG.replace('"rig"', '"field"')
    .replace("roller_radius_mm = 1000\n", "")
    .replace("[[operation.block]]", "[[operation.class]]")
    .replace("shift_mm = 3", "shift_mean_mm = 0\nshift_std_mm = 2\npositions = 10")
    .replace("distance_km = 1\n", "share = 1.0\n", 1)
)
COMPARE = '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\nfield = "field.toml"\n'
BANDS = (
    RIG.replace("distance_km = 4", "distance_km = 2")
    + """
[uncertainty]
draws = 16
[[uncertainty.input]]
name = "load"
key = "operation.load_kN"
acts = "factor"
distribution = "normal"
mean = 1.0
std = 0.03
"""
)
FILES = {"rig.toml": RIG, "field.toml": FIELD, "compare.toml": COMPARE, "bands.toml": BANDS}
RESUME = "resume out"
WAYS = {
    "run": ("", "run rig.toml --out out"),
    "resume": ("half", RESUME),
    "comparison": ("", "run compare.toml --out out"),
    "report": ("whole", "report out"),
    "translation": ("whole", "translate out/rig.nc out/field.nc --out out/translation.nc"),
    "sweep": ("", "sweep rig.toml --vary wheelset.radius_mm=420,460 --jobs 1 --out out"),
    "bands": ("", "run bands.toml --bands --jobs 1 --out out"),
    "run again": ("", "run rig.toml --out out"),
}
"""What stands in the folder before, and the command that is killed."""
SIGNALS = (signal.SIGKILL,) * 4 + (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
LIMIT = 300
"""Time that no command may take, on a machine that does other things besides [s]."""


def ended(process, limit=LIMIT):
    """Exit code of a process, which must end by itself."""
    process.join(limit)
    if process.is_alive():
        process.kill()
        require(False, f"hangs after {limit} s")
    return process.exitcode


def log(folder):
    """Print of all commands in a folder."""
    return (folder / "log").read_text(errors="replace") if (folder / "log").exists() else ""


def complete(command, folder):
    """Run a command to its end; return its time and the number of its operations on files."""
    began = time.monotonic()
    process, operations = forked(command.split(), folder)
    code = ended(process)
    require(code == 0, f"exit code {code}", command, log(folder)[-1500:])
    return time.monotonic() - began, operations.recv()


@cache
def reference(way):
    """Folder of an uninterrupted run: before and after it, its time, its operations, its largest file."""
    place = Path(tempfile.mkdtemp(prefix="siege"))
    before = prepared(WAYS[way][0], place / "before")
    shutil.copytree(before, place / "after")
    spent, operations = complete(WAYS[way][1], place / "after")
    largest = max(path.stat().st_size for path in (place / "after").rglob("*") if path.is_file())
    return before, place / "after", spent, operations, largest


def prepared(state, folder):
    """Folder with scenes, and what has been run before."""
    folder.mkdir(parents=True)
    for name, text in FILES.items():
        (folder / name).write_text(text)
    if state == "whole":
        complete(WAYS["comparison"][1], folder)
        for name in ("report.html", "translation.nc"):
            (folder / "out" / name).unlink()
    elif state == "half":
        _, _, _, operations, _ = reference("run")
        process, _ = forked(WAYS["run"][1].split(), folder, "operation", operations // 2)
        require(ended(process) == -signal.SIGKILL, "not killed")
    (folder / "log").unlink(missing_ok=True)
    return folder


def bits(folder):
    """Bits of all variables of all result files below a folder, and the other files' names."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.suffix == ".nc":
            with netCDF4.Dataset(path) as file:
                file.set_auto_maskandscale(False)
                for variable in file.variables:
                    found[f"{name} {variable}"] = np.asarray(file[variable][:]).tolist()
        elif path.is_file() and path.name not in ("log", ".lock", ".sweep.lock"):
            found[name] = path.read_bytes() if path.suffix in (".csv", ".toml") else b""
    return found


def require_whole(folder):
    """Hold every file under a final name to be whole; a result that was killed in growth is one line."""
    for path in folder.rglob("*"):
        if not path.is_file() or path.name.startswith("."):
            continue
        if path.name in ("rig.nc", "field.nc"):
            try:
                load_results(path)
            except ResultError as error:
                require(len(str(error).splitlines()) == 1, error)
        elif path.suffix == ".nc":
            with netCDF4.Dataset(path) as file:
                require(file.variables, path)
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".html":
            require(path.read_text().rstrip().endswith("</html>"), path)
        elif path.suffix == ".csv":
            require(path.read_text().endswith("\n"), path)


def attack(way, random, folder):
    """Kill once and continue."""
    command = WAYS[way][1]
    before, after, spent, operations, largest = reference(way)
    here = folder / "here"
    shutil.copytree(before, here)
    how = chosen(random, ("moment", "operation", "operation", "size"))
    number, where = signal.SIGKILL, 0
    if how == "moment":
        number, where = chosen(random, SIGNALS), random.uniform(0.0, 1.1 * spent)
    elif how == "operation":
        where = int(random.integers(operations))
    else:
        where, number = int(largest * random.uniform(0.0, 1.0) ** 2), signal.SIGXFSZ
    process, _ = forked(command.split(), here, how, where)
    if how == "moment":
        process.join(where)
        if process.is_alive():
            os.kill(process.pid, number)
    code = ended(process)
    printed = log(here)
    require(code in (0, -number, 128 + number), f"exit code {code}", how, where, printed[-1500:])
    require("Traceback" not in printed and "internal error" not in printed, printed[-1500:])
    require_whole(here)
    began = (here / "out/manifest.json").exists() and way in ("run", "comparison", "run again")
    complete(RESUME if began and way != "run again" and random.integers(2) else command, here)
    ours, theirs = bits(here), bits(after)
    require(ours.keys() == theirs.keys(), how, where, sorted(ours.keys() ^ theirs.keys()))
    different = [name for name in theirs if ours[name] != theirs[name]]
    require(not different, how, where, different)
    return "ended before the kill" if code == 0 else f"killed {PLACES[how]}, continued equal"


PLACES = {"moment": "at a moment", "operation": "at a file operation", "size": "within a file"}
