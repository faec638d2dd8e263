"""The command line: parse, call, print. One file per command; what they need is imported when they run."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import shlex
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from wearsim import __version__
from wearsim.cli.streams import standard_streams

COMMANDS = (
    "contact", "profile", "new", "check", "run", "sweep", "resume", "status", "inspect", "translate",
    "report", "chart", "schema",
)  # fmt: skip
"""Modules of this package in the order of the help, with `SUMMARY`, `EXAMPLES`, `add_flags` and `execute`."""


class Parser(argparse.ArgumentParser):
    """Argument parser that reports a wrong command line in one line."""

    def error(self, message: str) -> NoReturn:
        """Print what is wrong with the command line and where help is, and exit with 2."""
        self.exit(2, f"{self.prog}: {message}; see `{self.prog} --help`\n")


def print_json(value: Any, **options: Any) -> None:
    """Print JSON for people and programs; options are those of `json.dumps`."""
    import json

    plain = not (sys.stdout.encoding or "utf-8").lower().startswith("utf")
    print(json.dumps(value, indent=2, ensure_ascii=plain, **options))


def build_parser() -> argparse.ArgumentParser:
    """Parser of the whole command line."""
    parser = Parser(
        prog="wearsim",
        description="Wear of railway wheels on a roller rig and in the field, and the factors between them.",
        epilog="examples:\n  wearsim check workflows/rig_vs_field.toml\n"
        "  wearsim run workflows/rig_vs_field.toml --out out\n  wearsim COMMAND --help\n",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"wearsim {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an internal error")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in COMMANDS:
        module = importlib.import_module(f"wearsim.cli.{name}")
        command = commands.add_parser(
            name,
            help=module.SUMMARY,
            description=module.SUMMARY[:1].upper() + module.SUMMARY[1:] + ".",
            epilog="example:\n" + "\n".join(f"  {line}" for line in module.EXAMPLES.splitlines()),
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.add_argument(
            "--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
        )
        module.add_flags(command)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line: its arguments without the program's name, by default those of the process.

    Returns
    -------
    int
        0 ok, 2 bad input, 3 numerical failure or internal error; stopped by a signal, 128 + its number: 130
        by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    with standard_streams(), _stopped_by() as received:
        code = _executed(words)
    return 128 + received[0] if received else code


@contextlib.contextmanager
def _stopped_by() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP stop a command as Ctrl-C does, where they would kill it; list those received."""
    received: list[int] = []

    def stop(number: int, _: object) -> NoReturn:
        received.append(number)
        raise KeyboardInterrupt

    numbers = {signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)}
    in_main = threading.current_thread() is threading.main_thread()
    ours = [number for number in numbers if in_main and signal.getsignal(number) is signal.SIG_DFL]
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
        code = int(importlib.import_module(f"wearsim.cli.{arguments.command}").execute(arguments))
        sys.stdout.flush()
        _say_uncached()
    except KeyboardInterrupt:
        print("interrupted; a started campaign continues with `wearsim resume DIR`", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 0
    except Exception as error:
        from wearsim.errors import WearsimError  # not for --help: dataclasses cost 10 ms

        if "--debug" in words:
            raise
        if isinstance(error, WearsimError):
            print(error, file=sys.stderr)
            return error.exit_code
        if isinstance(error, FileNotFoundError) and not _has_folder():
            print("the current folder was deleted; change to one that exists", file=sys.stderr)
            return 2
        message = " ".join(str(error).split())
        fault = f"internal error, {type(error).__name__}: {message}; this is a fault of wearsim"
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
    """Say that kernels were compiled anew, where they were used and could not be cached."""
    if reasons := getattr(sys.modules.get("wearsim.contact.kernel"), "UNCACHED", ()):
        text = f"kernels are compiled anew in each run, numba's cache fails: {reasons[0]}"
        print(f"note: {text}; set NUMBA_CACHE_DIR to a folder that can be written", file=sys.stderr)
