"""Commands where streams are closed, full or in ASCII, folders read-only, disks full,
names not UTF-8.

Numba's cache, which is looked for on import, is attacked in
tests/contact/test_kernel.py.
"""

import io
import os
import resource
import shutil
import sys
from functools import partial

from siege import ACCEPTED, REFUSED, chosen, require
from siege_kills import FILES, bits, ended, log, reference, require_whole
from siege_nursery import forked

COMMANDS = {
    "schema": "schema",
    "check": "check rig.toml",
    "faults": "check none.toml",
    "profile": "profile S1002 --csv table.csv",
    "convert": "profile S1002 --convert miniprof --out wheel.whl",
    "contact": "contact --strips 8 --cells 8 --json",
    "run": "run rig.toml --out new",
    "report": "report out",
    "translate": "translate out/rig.nc out/field.nc --out new.nc",
    "inspect": "inspect out/rig.nc",
    "status": "status out --json",
    "list": "sweep rig.toml --vary wheelset.radius_mm=420,460 --list",
}
WAYS = (
    "stdout closed",
    "stderr closed",
    "both closed",
    "stdout full",
    "stderr full",
    "reader gone",
    "ASCII",
    "no HOME",
    "read-only folder",
    "full disk",
    "name not UTF-8",
    "no folder",
)
NOBODY = 65534


def surround(way):
    """Change the surroundings of this process."""
    if "closed" in way:
        for number, name in ((1, "stdout"), (2, "stderr")):
            if name in way or "both" in way:
                os.close(number)
                setattr(sys, name, None)  # as Python starts then
    elif "full" in way and "std" in way:
        os.dup2(os.open("/dev/full", os.O_WRONLY), 1 if "stdout" in way else 2)
        sys.stdout = io.TextIOWrapper(
            os.fdopen(1, "wb", closefd=False), line_buffering=False
        )
        sys.stderr = io.TextIOWrapper(
            os.fdopen(2, "wb", closefd=False), line_buffering=True
        )
    elif way == "reader gone":
        ours, theirs = os.pipe()
        os.close(ours)
        os.dup2(theirs, 1)
    elif way == "ASCII":
        sys.stdout, sys.stderr = (
            io.TextIOWrapper(os.fdopen(n, "wb", closefd=False), "ascii") for n in (1, 2)
        )
    elif way == "no HOME":
        for name in [
            name for name in os.environ if name == "HOME" or name.startswith("XDG_")
        ]:
            del os.environ[name]
    elif way == "read-only folder":
        if os.getuid() == 0:
            os.setuid(NOBODY)
    elif way == "full disk":
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
    elif way == "no folder":
        os.mkdir("gone"), os.chdir("gone"), os.rmdir("../gone")


def attack(way, random, folder):
    """Run one command in such surroundings."""
    name = chosen(random, COMMANDS)
    here = folder / (os.fsdecode(b"h\xe9re") if way == "name not UTF-8" else "here")
    shutil.copytree(reference("report")[0], here)
    for file, text in FILES.items():
        (here / file).write_text(text)
    before = reference("report")[1]
    if way == "read-only folder":
        (here / "log").write_text("")
        (here / "log").chmod(0o666)
        folder.chmod(0o755)
        for path in (*here.rglob("*"), here):
            if path.is_dir():
                path.chmod(0o555)
    process, _ = forked(COMMANDS[name].split(), here, surround=partial(surround, way))
    code = ended(process)
    here = here.rename(folder / "after")
    printed = log(here)
    allowed = (2,) if name == "faults" else (0, 2)
    require(code in allowed, f"exit code {code}", name, printed[-1500:])
    require(
        "Traceback" not in printed and "internal error" not in printed,
        name,
        printed[-1500:],
    )
    faults = [line for line in printed.splitlines() if " cannot be " in line]
    require(code == 0 or len(faults) <= 1, name, printed)
    left = [path.name for path in here.rglob("*") if path.name.endswith(".tmp")]
    require(not left, "left behind", name, left)
    require_whole(here)
    after = bits(here)
    changed = [
        key for key in before if before[key] != after.get(key) and "report" not in key
    ]
    require(not changed, "changed", name, changed)
    return ACCEPTED if code == 0 else REFUSED
