"""Flags that override values of a scene for one run: `--set` for any key, `--smoothing` for one question."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.scene import Scene
    from wearsim.scene.overrides import Override

_SMOOTHING = {"off": 0.0, "half": 0.5, "double": 2.0}


def add_override_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags to the parser of a command that reads a scene."""
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="another value for a key of the scene, such as campaign.stability=0.2; KEY= removes the key or "
        "table, so that its default applies; in a comparison for both scenes, with rig. or field. before the "
        "key for one of them; can be repeated",
    )
    parser.add_argument(
        "--smoothing",
        choices=tuple(_SMOOTHING),
        help="no smoothing of the wear increments, or half or double the scene's wavelength",
    )


def load_overridden(arguments: argparse.Namespace) -> tuple[Scene, Sequence[Override]]:
    """Load the scene of the command line.

    Parameters
    ----------
    arguments : Namespace
        With `scene` and the flags of `add_override_flags`.

    Returns
    -------
    scene : Scene
        With the overrides.
    overrides : sequence of Override
        For `run_scene`.
    """
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import SweepScene, load_scene
    from wearsim.scene.overrides import Override, value_of

    overrides, faults = [], []
    for text in arguments.set:
        key, equals, value = (part.strip() for part in text.partition("="))
        removes_table = not value and key not in ("rig", "field")
        if not (equals and all(key.split(".")) and ("." in key or removes_table)):
            message = "write KEY=VALUE with a dotted key, such as campaign.stability=0.2"
            faults.append(Fault(message, f"--set {text}"))
        overrides.append(Override(key, value_of(value), f"--set {text}"))
    if faults:
        raise SceneError(faults)
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
