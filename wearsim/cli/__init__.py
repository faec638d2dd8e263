"""The command line: parse, call, print.

One file per command; what they need is imported when they run.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import shlex
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from wearsim.cli.commands import COMMANDS, build_parser
from wearsim.cli.streams import standard_streams

__all__ = ["COMMANDS", "build_parser", "main", "print_json"]

_OBJECTS = 50_000  # made, between two searches for garbage


def print_json(value: Any) -> None:
    """Print JSON for people and programs."""
    import json

    from wearsim.whole_files import json_value

    plain = not (sys.stdout.encoding or "utf-8").lower().startswith("utf")
    print(json.dumps(json_value(value), indent=2, ensure_ascii=plain, allow_nan=False))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Its arguments without the program's name, by default those of the process.

    Returns
    -------
    int
        0 ok, 2 bad input, 3 numerical failure or internal error; stopped by a signal,
        128 + its number: 130 by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.
    """
    if (
        argv is None
    ):  # compiling kernels and reading scenes make many objects that live on
        gc.set_threshold(_OBJECTS)
    words = list(sys.argv[1:] if argv is None else argv)
    with standard_streams(), _stopped_by() as received:
        code = _executed(words)
    return 128 + received[0] if received else code


@contextlib.contextmanager
def _stopped_by() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP stop a command as Ctrl-C does, where they would kill it.

    List those received.
    """
    received: list[int] = []

    def stop(number: int, _: object) -> NoReturn:
        received.append(number)
        raise KeyboardInterrupt

    numbers = {signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)}
    in_main = threading.current_thread() is threading.main_thread()
    ours = [
        number
        for number in numbers
        if in_main and signal.getsignal(number) is signal.SIG_DFL
    ]
    try:
        for number in ours:
            signal.signal(number, stop)
        yield received
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def _executed(words: Sequence[str]) -> int:
    try:
        try:
            arguments = build_parser().parse_args(words)
        finally:
            sys.stdout.flush()  # of the help
        arguments.command_line = shlex.join(["wearsim", *words])
        code = int(
            importlib.import_module(f"wearsim.cli.{arguments.command}").execute(
                arguments
            )
        )
        sys.stdout.flush()
        _say_uncached()
    except KeyboardInterrupt:
        print(
            "interrupted; a started campaign continues with `wearsim resume DIR`",
            file=sys.stderr,
        )
        return 130
    except BrokenPipeError:
        return 0
    except Exception as error:
        from wearsim.errors import (
            WearsimError,
        )  # not for --help: dataclasses cost 10 ms

        if "--debug" in words:
            raise
        if isinstance(error, WearsimError):
            print(error, file=sys.stderr)
            return error.exit_code
        if isinstance(error, FileNotFoundError) and not _has_folder():
            print(
                "the current folder was deleted; change to one that exists",
                file=sys.stderr,
            )
            return 2
        message = " ".join(str(error).split())
        fault = (
            f"internal error, {type(error).__name__}: {message}; this is a fault of "
            "wearsim"
        )
        print(f"wearsim: {fault}, add --debug to see where", file=sys.stderr)
        return 3
    return code


def _has_folder() -> bool:
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True


def _say_uncached() -> None:
    """Say that kernels were compiled anew, where used and not cached."""
    if reasons := getattr(sys.modules.get("wearsim.contact.kernel"), "UNCACHED", ()):
        text = (
            f"kernels are compiled anew in each run, numba's cache fails: {reasons[0]}"
        )
        print(
            f"note: {text}; set NUMBA_CACHE_DIR to a folder that can be written",
            file=sys.stderr,
        )
