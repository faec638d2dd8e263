"""Flags that change values of a scene for one run: `--set` for any key, `--smoothing` for one question."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.scene import FieldScene, RigScene, Scene
    from wearsim.scene.changes import Change

_SMOOTHING = {"off": 0.0, "half": 0.5, "double": 2.0}


def add_change_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags.

    Parameters
    ----------
    parser : ArgumentParser
        Of a command that reads a scene.
    """
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="another value for a key of the scene, such as campaign.stability=0.2; in a comparison for both "
        "scenes, with rig. or field. before the key for one of them; can be repeated",
    )
    parser.add_argument(
        "--smoothing",
        choices=tuple(_SMOOTHING),
        help="no smoothing of the wear increments, or half or double the scene's wavelength",
    )


def load_changed(arguments: argparse.Namespace) -> tuple[Scene, Sequence[Change]]:
    """Load the scene of the command line with its changes.

    Parameters
    ----------
    arguments : Namespace
        With `scene` and the flags.

    Returns
    -------
    scene : Scene
        As changed.
    changes : sequence of Change
        For `run_scene`.
    """
    from wearsim.errors import Fault, SceneError
    from wearsim.scene import CompareScene, SweepScene, load_scene
    from wearsim.scene.changes import Change, value_of

    changes: list[Change] = []
    faults = []
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not (equals and all(key.strip().split(".")) and "." in key):
            faults.append(
                Fault(f"--set {text}: write KEY=VALUE with a dotted key, such as campaign.stability=0.2")
            )
        changes.append(Change(key.strip(), value_of(value), "--set"))
    if faults:
        raise SceneError(faults)
    scene = load_scene(arguments.scene, changes=changes)
    if arguments.smoothing is None:
        return scene, changes
    if isinstance(scene, SweepScene):
        told = f"--smoothing is for campaigns; this scene is of kind {scene.scene.kind}"
        raise SceneError([Fault(told, str(scene.origin.path))])
    parts: dict[str, RigScene | FieldScene]
    parts = {"rig": scene.rig, "field": scene.field} if isinstance(scene, CompareScene) else {"": scene}
    for role, part in parts.items():
        wavelength = _SMOOTHING[arguments.smoothing] * part.campaign.smoothing_wavelength_mm
        key = ".".join(filter(None, (role, "campaign.smoothing_wavelength_mm")))
        changes.append(Change(key, wavelength, "--smoothing"))
    return load_scene(arguments.scene, changes=changes), changes
