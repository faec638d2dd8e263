"""Where the processes that are attacked come from: a server that holds all imports and kernels, and forks.

A new interpreter takes seconds to load them.
"""

import multiprocessing
import os
import resource
import signal
import sys
import tempfile
from functools import cache
from multiprocessing import forkserver
from pathlib import Path

from wearsim.campaign import record
from wearsim.cli import main
from wearsim.report import html

RIG = """\
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
roller_radius_mm = 1000
[contact]
strips = 8
cells = 8
[[operation.block]]
name = "a"
shift_mm = 3
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 1
[campaign]
distance_km = 4
point_spacing_mm = 1
max_step_km = 1
"""
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def die_at(operation):
    """Die by SIGKILL at an operation on files, counted from 0; return a function that gives their number."""
    count = 0

    def hook(event, arguments):
        nonlocal count
        if event in ("os.rename", "os.remove", "os.mkdir", "os.truncate") or (
            event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITING
        ):
            if count == operation:
                os.kill(os.getpid(), signal.SIGKILL)
            count += 1

    sys.addaudithook(hook)
    return lambda: count


def start(words, folder, end, how, where, surround):
    """Run a command line in a forked process; `end` gets the number of operations on files."""
    os.setsid()
    os.chdir(folder)
    log = os.open("log", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    os.dup2(log, 1), os.dup2(log, 2)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    html.to_svg = lambda figure, name: "<svg></svg>"
    if words[0] != "report":  # which takes longer than a small campaign
        html.render = lambda datasets, *_, **__: f"<html>{len(datasets)} results</html>\n"
    if how == "size":  # die where a file grows beyond it
        resource.setrlimit(resource.RLIMIT_FSIZE, (where, where))
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    counted = die_at(where if how == "operation" else -1)
    record.APPEND_INTERVAL = 0.0  # each step grows the result file
    if surround is not None:
        surround()
    code = main(words)
    end.send(counted())
    sys.exit(code)


@cache
def serve():
    """Start the server, which takes no search path from its parent but by the environment."""
    forkserver.set_forkserver_preload(["siege_nursery"])
    kept = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    try:
        forkserver.ensure_running()
    finally:
        os.environ.pop("PYTHONPATH")
        if kept is not None:
            os.environ["PYTHONPATH"] = kept


def forked(words, folder, how="", where=0, surround=None):
    """Start a command line; return its process, and a pipe for the number of its operations on files.

    It dies at an operation on files ("operation") or where a file grows beyond a size ("size"), or runs after
    a function has changed its surroundings.
    """
    context = multiprocessing.get_context("forkserver")
    serve()
    ours, theirs = context.Pipe(duplex=False)
    words = [str(word) for word in words]
    process = context.Process(target=start, args=(words, folder, theirs, how, where, surround))
    process.start()
    theirs.close()
    return process, ours


def warm():
    """Load what a campaign and its report need."""
    before, kept = Path.cwd(), html.to_svg
    html.to_svg = lambda figure, name: "<svg></svg>"
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        nowhere, streams = os.open(os.devnull, os.O_WRONLY), (os.dup(1), os.dup(2))
        os.dup2(nowhere, 1), os.dup2(nowhere, 2)
        Path("rig.toml").write_text(RIG)
        main(["run", "rig.toml", "--out", "out"])
        os.dup2(streams[0], 1), os.dup2(streams[1], 2)
        os.chdir(before)
    html.to_svg = kept


if sys.argv and "forkserver" in " ".join(sys.orig_argv):
    warm()
