"""The parser of the command line: faults in one line, numbers in a range."""

from __future__ import annotations

import argparse
import re
from typing import Any, NoReturn

_FILES = ("CSV", "FIELD", "FILE", "FILE|DIR", "NAME|FILE", "RIG", "SCENE")
"""What the help calls an argument that is the name of a file."""


class Parser(argparse.ArgumentParser):
    """Argument parser that reports a wrong command line in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            **options,
        )
        # argparse takes only plain negative numbers for values, neither -1e-3 nor
        # -0.001,0,0.2
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Raise for a value that is no choice, with the nearest one."""
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            from wearsim.errors import (
                suggestion,
            )  # not for --help: dataclasses cost 10 ms

            error.message += suggestion(str(value), map(str, action.choices or ()))
            raise

    def parse_known_args(
        self, args: Any = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """Parse arguments of a command; unknown ones are a fault of that command."""
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown and self._subparsers is None:
            from wearsim.errors import suggestion

            flag = unknown[0]
            named = self._option_string_actions if flag.startswith("-") else ()
            hint = suggestion(flag, named) if named else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return parsed, unknown

    def error(self, message: str) -> NoReturn:
        """Say what is wrong in the command line and where help is, and exit with 2."""
        self.exit(2, f"{self.prog}: {message}; see `{self.prog} --help`\n")


class PrintCompletion(argparse.Action):
    """Flag that prints the completion for a shell, of commands, flags and files."""

    def __call__(
        self, parser: argparse.ArgumentParser, _: object, shell: Any, *__: object
    ) -> NoReturn:
        """Print it, and exit with 0."""
        import shtab  # for this alone

        (commands,) = (
            action
            for action in parser._actions
            if isinstance(action, argparse._SubParsersAction)
        )
        for command in commands.choices.values():
            for argument in command._actions:
                if argument.metavar in _FILES:
                    argument.complete = shtab.FILE
                elif argument.metavar == "DIR":
                    argument.complete = shtab.DIRECTORY
        print(shtab.complete(parser, str(shell)))
        parser.exit()


class Renamed(argparse.Action):
    """Flag of an earlier version: an error that names the new one."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Raise the error."""
        parser.error(f"{self.option_strings[0]} has a new name; write {self.metavar}")


def number(low: float, high: float, text: str) -> float:
    """Return the number of a flag, a whole one between whole ends.

    Raise what argparse prints.
    """
    whole = isinstance(low, int)
    try:
        value = int(text) if whole else float(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        what = "a whole number" if whole else "a number"
        raise argparse.ArgumentTypeError(
            f"{text} must be {what}, at least {low:g} and at most {high:g}"
        )
    return value
