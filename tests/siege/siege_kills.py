"""Processes of runs, sweeps, bands, translations and reports killed at a moment, at a
file, within a file.

After each kill nothing is half written under a final name, and what continues it has
every variable bit-equal to that of an uninterrupted run.
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
from siege_nursery import forked

from wearsim.errors import ResultError
from wearsim.results import load_results
from wearsim.studies import bands

FILES = {
    path.name: path.read_text()
    for path in (Path(__file__).parent / "scenes").glob("*.toml")
}
RESUME = "resume out"
WAYS = {
    "run": ("", "run rig.toml --out out"),
    "resume": ("half", RESUME),
    "comparison": ("", "run compare.toml --out out"),
    "report": ("whole", "report out"),
    "translation": (
        "whole",
        "translate out/rig.nc out/field.nc --out out/translation.nc",
    ),
    "sweep": (
        "",
        "sweep short.toml --vary wheelset.radius_mm=420,460 --jobs 1 --out out",
    ),
    "bands": ("drawn", "run bands.toml --bands --jobs 1 --out out"),
    "field": ("", "run field.toml --out out"),
    "profile": (
        "",
        "profile S1002 --csv table.csv --convert miniprof --out wheel.whl --overwrite",
    ),
}
"""What stands in the folder before, and the command that is killed."""
LEFT = 2
"""Draws that are left to be made, as are the campaign itself and its bands, where the
others are drawn.
"""
SIGNALS = (signal.SIGKILL,) * 4 + (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
LIMIT = 300
"""Time that no command may take, on a machine that does other things besides [s]."""


def ended(process):
    """Exit code of a process, which must end by itself."""
    process.join(LIMIT)
    if process.is_alive():
        process.kill()
        require(False, f"hangs after {LIMIT} s")
    return process.exitcode


def log(folder):
    """Print of all commands in a folder."""
    return (
        (folder / "log").read_text(errors="replace")
        if (folder / "log").exists()
        else ""
    )


def complete(command, folder):
    """Run a command to its end; return its time and the number of its operations on
    files.
    """
    began = time.monotonic()
    process, operations = forked(command.split(), folder)
    code = ended(process)
    require(code == 0, f"exit code {code}", command, log(folder)[-1500:])
    return time.monotonic() - began, operations.recv()


@cache
def reference(way):
    """Folder before an uninterrupted run; bits after it, its time, its operations, its
    largest file.
    """
    place = Path(tempfile.mkdtemp(prefix="siege"))
    before = prepared(WAYS[way][0], place / "before")
    shutil.copytree(before, place / "after")
    spent, operations = complete(WAYS[way][1], place / "after")
    largest = max(
        path.stat().st_size for path in (place / "after").rglob("*") if path.is_file()
    )
    return before, bits(place / "after"), spent, operations, largest


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
        process, _ = forked(
            WAYS["run"][1].split(), folder, "operation", operations // 2
        )
        require(ended(process) == -signal.SIGKILL, "not killed")
    elif state == "drawn":
        complete(WAYS["bands"][1], folder)
        for path in (folder / "out").iterdir():
            if path.is_file():
                path.unlink()
            elif path.name != bands.FOLDER:
                shutil.rmtree(path)
        for path in sorted((folder / "out" / bands.FOLDER).glob("case_*"))[-LEFT:]:
            shutil.rmtree(path)
    (folder / "log").unlink(missing_ok=True)
    return folder


def bits(folder):
    """Bits of all variables of all result files below a folder, and the other files'
    names.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.suffix == ".nc":
            with netCDF4.Dataset(path) as file:
                file.set_auto_maskandscale(False)
                for variable in file.variables:
                    array = np.asarray(file[variable][...])
                    found[f"{name} {variable}"] = (
                        array.tolist() if array.dtype == object else array.tobytes()
                    )
        elif path.is_file() and path.name not in ("log", ".lock", ".sweep.lock"):
            found[name] = (
                path.read_bytes() if path.suffix in (".csv", ".toml", ".whl") else b""
            )
    return found


def require_whole(folder, since=0.0):
    """Hold every later file under a final name to be whole; a result killed in growth
    is one line.
    """
    for path in folder.rglob("*"):
        if (
            not path.is_file()
            or path.name.startswith(".")
            or path.stat().st_mtime < since
        ):
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
    before, theirs, spent, operations, largest = reference(way)
    here = folder / "here"
    shutil.copytree(before, here)  # with the times of its files
    began = time.time() - 1.0
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
    require(
        code in (0, -number, 128 + number),
        f"exit code {code}",
        how,
        where,
        printed[-1500:],
    )
    require(
        "Traceback" not in printed and "internal error" not in printed, printed[-1500:]
    )
    require_whole(here, began)
    claimed = (here / "out/manifest.json").exists() and way in (
        "run",
        "comparison",
        "field",
    )
    complete(RESUME if claimed and random.integers(2) else command, here)
    ours = bits(here)
    require(
        ours.keys() == theirs.keys(), how, where, sorted(ours.keys() ^ theirs.keys())
    )
    different = [name for name in theirs if ours[name] != theirs[name]]
    require(not different, how, where, different)
    return (
        "ended before the kill"
        if code == 0
        else f"killed {PLACES[how]}, continued equal"
    )


PLACES = {
    "moment": "at a moment",
    "operation": "at a file operation",
    "size": "within a file",
}
