"""Flags that several commands share: renamed ones, whole numbers, and overrides of values of a scene."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from wearsim.scene import Scene
    from wearsim.scene.overrides import Override

_SMOOTHING = {"off": 0.0, "half": 0.5, "double": 2.0}


class _Renamed(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        parser.error(f"{self.option_strings[0]} has a new name; write {self.metavar}")


def add_renamed(parser: argparse.ArgumentParser, flags: Mapping[str, str]) -> None:
    """Add flags of earlier versions, as old: new, that are errors naming the new flag."""
    for old, new in flags.items():
        parser.add_argument(
            old, metavar=new, nargs="?", action=_Renamed, default=argparse.SUPPRESS, help=argparse.SUPPRESS
        )


def whole(low: int, high: int, text: str) -> int:
    """Return the whole number of a flag; raise what argparse prints."""
    return int(_within(int, "a whole number", low, high, text))


def decimal(low: float, high: float, text: str) -> float:
    """Return the number of a flag; raise what argparse prints."""
    return _within(float, "a number", low, high, text)


def _within(kind: type[float], what: str, low: float, high: float, text: str) -> float:
    try:
        number = kind(text)
    except ValueError:
        number = low - 1
    if not low <= number <= high:
        raise argparse.ArgumentTypeError(f"{text} must be {what}, at least {low:g} and at most {high:g}")
    return number


def add_worker_flags(parser: argparse.ArgumentParser, what: str) -> None:
    """Add `--jobs` and `--cluster`, for what many processes run."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=partial(whole, 1, 1024), metavar="N",
        help=f"processes for {what} (default: one per core)",
    )  # fmt: skip
    where.add_argument(
        "--cluster", metavar="ADDRESS",
        help=f"run {what} on the Dask cluster with this scheduler (tcp://host:8786, or its scheduler file); "
        "--out is a folder that its workers share",
    )  # fmt: skip


def add_set_flag(parser: argparse.ArgumentParser, keys: str, effect: str) -> None:
    """Add `--set` to the parser of a command, for some keys and with some effect."""
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[],
        help=f"another value for a key of {keys}, such as campaign.max_step_km=10{effect}; in a comparison "
        "for both scenes, with rig. or field. before the key for one of them; can be repeated",
    )  # fmt: skip


def add_override_flags(parser: argparse.ArgumentParser) -> None:
    """Add `--set`, for any key, and `--smoothing` to the parser of a command that reads a scene."""
    add_set_flag(parser, "the scene", "; KEY= removes the key or table, so that its default applies")
    parser.add_argument(
        "--smoothing",
        choices=tuple(_SMOOTHING),
        help="no smoothing of the wear increments, or half or double the scene's wavelength",
    )


def overrides_of(texts: Sequence[str]) -> list[Override]:
    """Read the overrides of `--set` flags, KEY=VALUE each."""
    from wearsim.errors import Fault, SceneError
    from wearsim.scene.overrides import Override, value_of

    overrides, faults = [], []
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        removes_table = not value and key not in ("rig", "field")
        if not (equals and all(key.split(".")) and ("." in key or removes_table)):
            message = "write KEY=VALUE with a dotted key, such as campaign.max_step_km=10"
            faults.append(Fault(message, f"--set {text}"))
        overrides.append(Override(key, value_of(value), f"--set {text}"))
    if faults:
        raise SceneError(faults)
    return overrides


def load_overridden(arguments: argparse.Namespace) -> tuple[Scene, Sequence[Override]]:
    """Load the scene of the command line with its overrides, which are for `run_scene`, too."""
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import SweepScene, load_scene
    from wearsim.scene.overrides import Override

    overrides = overrides_of(arguments.set)
    scene = load_scene(arguments.scene, overrides=overrides)
    if arguments.smoothing is None:
        return scene, overrides
    if isinstance(scene, SweepScene):
        message = f"--smoothing is for campaigns; this scene is of kind {scene.scene.kind}"
        raise SceneError([Fault(message, str(scene.origin.path))])
    for role, part in scene.prefixed.items():
        wavelength = _SMOOTHING[arguments.smoothing] * part.campaign.smoothing_wavelength_mm
        key, flag = f"{role}campaign.smoothing_wavelength_mm", f"--smoothing {arguments.smoothing}"
        overrides.append(Override(key, wavelength, flag))
    return load_scene(arguments.scene, overrides=overrides), overrides
