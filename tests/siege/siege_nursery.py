"""Where the processes that are attacked come from: a server that holds all imports and
kernels, and forks.

A new interpreter takes seconds to load them.
"""

import contextlib
import gc
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
from functools import cache
from multiprocessing import forkserver
from pathlib import Path
from unittest import mock

import netCDF4
from siege import outline

from wearsim.campaign import record
from wearsim.cli import main
from wearsim.report import html

# imported by commands when they need them
from wearsim.studies import bands, sweep  # noqa: F401

RIG = Path(__file__).parent / "scenes/rig.toml"
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def die_at(operation):
    """Die by SIGKILL at an operation on files, counted from 0; return a function that
    gives their number.
    """
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
    """Run a command line in a forked process; `end` gets the number of operations on
    files.
    """
    os.setsid()
    os.chdir(folder)
    log = os.open("log", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    os.dup2(log, 1), os.dup2(log, 2)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    html.to_svg = outline
    if words[0] != "report":  # which takes longer than a small campaign
        html.render = lambda datasets, *_, **__: (
            f"<html>{len(datasets)} results</html>\n"
        )
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
    """Start the server, which takes no search path from its parent but by the
    environment.
    """
    forkserver.set_forkserver_preload(["__main__", "siege_nursery"])
    with mock.patch.dict(
        os.environ, PYTHONPATH=os.pathsep.join(filter(None, sys.path))
    ):
        forkserver.ensure_running()


def forked(words, folder, how="", where=0, surround=None):
    """Start a command line; return its process, and a pipe for the number of its
    operations on files.

    It dies at an operation on files ("operation") or where a file grows beyond a size
    ("size"), or runs after a function has changed its surroundings.
    """
    context = multiprocessing.get_context("forkserver")
    serve()
    ours, theirs = context.Pipe(duplex=False)
    words = [str(word) for word in words]
    process = context.Process(
        target=start, args=(words, folder, theirs, how, where, surround)
    )
    process.start()
    theirs.close()
    return process, ours


def warm():
    """Load and compile what the commands need: run a campaign with its report, and
    translate it.
    """
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        open(os.devnull, "w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
        mock.patch.object(html, "to_svg", outline),
    ):
        main(["run", str(RIG), "--out", "out"])
        with netCDF4.Dataset(shutil.copy("out/rig.nc", "other.nc"), "a") as file:
            file["environment"][:] = 0.5
        main(["translate", "out/rig.nc", "other.nc"])
    gc.collect()
    gc.freeze()  # what stands already is no concern of the processes to come


if sys.argv and "forkserver" in " ".join(sys.orig_argv):
    warm()
