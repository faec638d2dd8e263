"""What every kind of attack shares: counts, seeds, limits of one case, outcomes and
what breaks the rules.

A kind is a module `siege_<kind>` with WAYS, what is attacked by name, and
`attack(way, random, folder)`, which attacks once in an empty folder, returns the
outcome in a word or two and raises `Broken` where wearsim breaks its rules. Case `seed`
of a kind has its way, its random numbers and its folder from the seed alone.
"""

import contextlib
import importlib
import io
import json
import os
import re
import resource
import shutil
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

from wearsim.cli import main
from wearsim.errors import LONGEST_ECHO, MOST_FAULTS

COUNTS = {
    "scenes": (10_000, 40),
    "profiles": (10_000, 400),
    "tables": (2_000, 24),
    "netcdf": (5_000, 24),
    "environment": (400, 6),
    "kills": (1_000, 6),
}
"""Attacks of each kind: all of the full siege, and the sample of `.ci/run`, its first
ones.
"""

SECONDS, MEMORY = 20.0, 1000
"""Processor time [s] and growth of memory [MB] that one case in process may cost."""

ADDRESSES = 8 * 2**30
"""Memory that the process may ask for [B]: what takes too much fails here, not the
machine.
"""

REFUSED, ACCEPTED, FAULT = "refused", "accepted", "fault"
ROOT = Path(__file__).parents[2]


def count_of(kind):
    """Attacks to make: WEARSIM_SIEGE = 1.0 for all, another share of them, by default
    the sample.
    """
    whole, sample = COUNTS[kind]
    share = os.environ.get("WEARSIM_SIEGE")
    return sample if share is None else max(round(float(share) * whole), 1)


class Broken(AssertionError):
    """A rule of wearsim that an attack has broken."""


def require(holds, *what):
    """Raise `Broken` with what there is to see if a rule does not hold."""
    if not holds:
        raise Broken(" | ".join(str(each) for each in what))


def way_of(kind, seed):
    """Module of a kind, and the way in which a seed attacks."""
    module = importlib.import_module(f"siege_{kind}")
    return module, tuple(module.WAYS)[seed % len(module.WAYS)]


def attack(kind, seed):
    """Attack once, in a folder of its own; return way and outcome."""
    module, way = way_of(kind, seed)
    random = np.random.default_rng([seed, *kind.encode()])
    limits = resource.getrlimit(resource.RLIMIT_AS)
    folder, before = Path(tempfile.mkdtemp(prefix="siege")), Path.cwd()
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, limits[1]))
    began, memory = (
        time.process_time(),
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    )
    try:
        os.chdir(folder)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            outcome = module.attack(way, random, folder)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
        os.chdir(before)
        shutil.rmtree(folder, ignore_errors=True)
    spent = time.process_time() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory) / 1024
    require(spent < SECONDS, f"{spent:.0f} s", outcome)
    require(grown < MEMORY, f"{grown:.0f} MB", outcome)
    return way, outcome


def besiege(kind, seeds):
    """Attack once for each seed; return the number of each (way, outcome), and the
    faults by seed.
    """
    counts, faults = Counter(), {}
    for seed in seeds:
        try:
            counts[attack(kind, seed)] += 1
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            text = (
                f"{type(error).__name__} at "
                f"{Path(place.filename).name}:{place.lineno}: {error}"
            )[:1500]
            faults[seed] = (
                f"{text}\n    again: python reports/reliability.py --kind {kind} "
                f"--seed {seed}"
            )
    return counts, faults


def chosen(random, options):
    """Return one of some options."""
    return list(options)[int(random.integers(len(options)))]


def command(*words):
    """Run a command line in this process; return exit code, output and messages."""
    out, printed = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(printed):
        try:
            code = main([str(word) for word in words])
        except SystemExit as ended:
            code = ended.code
    return code, out.getvalue(), printed.getvalue()


def judged(code, out, printed, *names, codes=(0, 2)):
    """Hold a command to the rules of bad input; return the outcome.

    Each fault is one short printable line that begins with the name of a file; nothing
    is printed besides. Output has no number that is not finite.
    """
    lines = printed.splitlines()
    require("Traceback" not in printed and "internal error" not in printed, printed)
    require(code in codes, code, printed)
    for line in lines:
        require(line.isprintable() and len(line) < 2000, repr(line))
        require(not re.search(rf"(\S)\1{{{LONGEST_ECHO + 3}}}", line), line)
    if code == 0:
        # those of `wearsim contact --table` begin with the name of the table
        require(
            all(line.startswith(("warning: ", "note: ", *names)) for line in lines),
            printed,
        )
        if out.startswith(("{", "[")):
            strict_json(out)
        else:
            require(not re.search(r"\b(nan|inf)\b", out), out[:2000])
        return ACCEPTED
    require(out == "", out[:300])
    faults = [line for line in lines if not line.startswith(("warning: ", "note: "))]
    require(0 < len(faults) <= MOST_FAULTS + 1, printed)
    for line in faults[:MOST_FAULTS]:
        require(any(name in line for name in names), "names no file", line)
        require(
            not re.search(
                r"(?<![\w=.\"'\[] )(?<![\w\"'/.\[-])nan\b(?! must| is not)", line
            ),
            "nan",
            line,
        )
    return REFUSED


def outline(figure, name):
    """Take the place of the drawing of a figure."""
    return "<svg></svg>"


def strict_json(text):
    """Read JSON that must hold no NaN."""

    def constant(name):
        raise Broken(f"JSON with {name}")

    return json.loads(text, parse_constant=constant)


DAMAGES = ("cut", "tail", "put", "zero", "double", "swap")
BYTES = (
    b"\n",
    b"-",
    b".",
    b"9",
    b"e5",
    b"nan",
    b"inf",
    b"1e400",
    b'"',
    b"'",
    b",",
    b";",
    b"\xe4",
    b"\xff",
    b"\t",
    b"=",
    b"\r",
    b"\x00",
    b"[",
    b"]",
    "µ".encode(),
    "\u2028".encode(),
    "\ufeff".encode(),
    b"9" * 400,
)


def damaged(content, random, lines=True):
    """Cut, overwrite, zero or double bytes at a random place, or swap two lines."""
    at = int(random.integers(len(content) + 1))
    end = min(len(content), at + int(random.integers(200)))
    how = chosen(random, DAMAGES if lines else DAMAGES[:-1])
    if how == "cut":
        return content[:at] + content[end:]
    if how == "tail":
        return content[:at]
    if how == "put":
        return (
            content[:at]
            + chosen(random, BYTES)
            + content[at if random.random() < 0.5 else end :]
        )
    if how == "zero":
        return content[:at] + bytes(end - at) + content[end:]
    if how == "double":
        return content[:end] + content[at:]
    rows = content.split(b"\n")
    one, other = random.integers(len(rows), size=2)
    rows[one], rows[other] = rows[other], rows[one]
    return b"\n".join(rows)
