"""The parser of the command line, from the table of commands and their flags in `commands.toml`."""

from __future__ import annotations

import argparse
import re
import tomllib
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from wearsim import __version__
from wearsim.studies.contact_flags import FLAGS

_TABLE: dict[str, Any] = tomllib.loads(Path(__file__).with_name("commands.toml").read_text(encoding="utf-8"))
_SHARED = _TABLE.pop("shared")
_SHORT = {"--out": "-o", "--jobs": "-j", "--quiet": "-q"}

_FILES = ("CSV", "FIELD", "FILE", "FILE|DIR", "NAME|FILE", "RIG", "SCENE")
"""What the help calls an argument that is the name of a file."""

COMMANDS = tuple(_TABLE)
"""Modules of this package with a function `execute`, in the order of the help."""


class Parser(argparse.ArgumentParser):
    """Argument parser that reports a wrong command line in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)
        # argparse takes only plain negative numbers for values, neither -1e-3 nor -0.001,0,0.2
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Raise for a value that is no choice, with the nearest one."""
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            from wearsim.errors import suggestion  # not for --help: dataclasses cost 10 ms

            error.message += suggestion(str(value), map(str, action.choices or ()))
            raise

    def error(self, message: str) -> NoReturn:
        """Print what is wrong with the command line and where help is, and exit with 2."""
        self.exit(2, f"{self.prog}: {message}; see `{self.prog} --help`\n")


class _PrintCompletion(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, _: object, shell: Any, *__: object) -> NoReturn:
        import shtab  # for this alone

        (commands,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
        for command in commands.choices.values():
            for argument in command._actions:
                if argument.metavar in _FILES:
                    argument.complete = shtab.FILE
                elif argument.metavar == "DIR":
                    argument.complete = shtab.DIRECTORY
        print(shtab.complete(parser, str(shell)))
        parser.exit()


class _Renamed(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        parser.error(f"{self.option_strings[0]} has a new name; write {self.metavar}")


def build_parser() -> argparse.ArgumentParser:
    """Parser of the whole command line."""
    parser = Parser(
        prog="wearsim",
        description="Wear and rolling contact fatigue of railway wheels on a roller rig and in the field, "
        "and the factors between them.",
        epilog="examples:\n  wearsim check workflows/rig_vs_field.toml\n"
        "  wearsim run workflows/rig_vs_field.toml --out out\n  wearsim COMMAND --help\n",
    )
    parser.add_argument("--version", action="version", version=f"wearsim {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an internal error")
    parser.add_argument(
        "--print-completion",
        choices=["bash", "zsh", "tcsh"],
        action=_PrintCompletion,
        help="print the completion of commands, flags and files for a shell",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    hidden: dict[str, Any] = {"default": argparse.SUPPRESS, "help": argparse.SUPPRESS}
    for name, of in _TABLE.items():
        examples = "\n".join(["example:", *(f"  {line}" for line in of["examples"].splitlines())])
        command = commands.add_parser(
            name,
            help=of["summary"],
            description=of["summary"][:1].upper() + of["summary"][1:] + ".",
            epilog="\n".join([of["about"], examples] if "about" in of else [examples]),
        )
        command.add_argument("--debug", action="store_true", **hidden)
        _add_flags(command, of.get("flags", {}))
        groups = {title: command.add_argument_group(title) for title in of.get("groups", ())}
        for flag in FLAGS if of.get("columns") else ():
            default = "" if flag.default is None else f" (default {flag.default})"
            text = flag.meaning + default
            groups[flag.group].add_argument(f"--{flag.name}", metavar="X", dest=flag.column, help=text)
        for title, group in groups.items():
            _add_flags(group, of["groups"][title])
        for old, new in of.get("renamed", {}).items():
            command.add_argument(old, metavar=new, nargs="?", action=_Renamed, **hidden)
    return parser


def _add_flags(parser: argparse._ActionsContainer, flags: dict[str, dict[str, Any]]) -> None:
    """Add flags of the table."""
    alone: dict[str, argparse._ActionsContainer] = {}
    for name, given in flags.items():
        options, place, names = dict(given), parser, [name]
        if "help" not in options:
            options = {**_SHARED[name], "help": _SHARED[name]["help"].format(**given)}
        if short := _SHORT.get(name):
            names.insert(0, short)
        if instead := options.pop("instead", None):
            place = alone[instead] = alone.get(instead) or parser.add_mutually_exclusive_group()
        if options.pop("switch", False):
            options["action"] = "store_true"
        if options.pop("repeat", False):
            options |= {"action": "append", "default": []}
        if options.pop("whole", False):
            options["type"] = int
        if "range" in options:
            options["type"] = partial(number, *options.pop("range"))
        place.add_argument(*names, **options)


def number(low: float, high: float, text: str) -> float:
    """Return the number of a flag, a whole one between whole ends; raise what argparse prints."""
    whole = isinstance(low, int)
    try:
        value = int(text) if whole else float(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        what = "a whole number" if whole else "a number"
        raise argparse.ArgumentTypeError(f"{text} must be {what}, at least {low:g} and at most {high:g}")
    return value
