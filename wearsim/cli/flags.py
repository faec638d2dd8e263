"""Flags that several commands share: overrides of values of a scene."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from wearsim.errors import Fault, SceneError, raise_any
from wearsim.scene import Scene, SweepScene, load_scene
from wearsim.scene.overrides import Override
from wearsim.scene.sweep import override_of

STDIN = "-"
"""Name of a scene that is read from standard input."""
_SMOOTHING = {"off": 0.0, "half": 0.5, "double": 2.0}


def overrides_of(texts: Sequence[str]) -> list[Override]:
    """Read the overrides of `--set` flags, KEY=VALUE each."""
    overrides, faults = [], []
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        removes_table = not value and key not in ("rig", "field")
        if not (equals and all(key.split(".")) and ("." in key or removes_table)):
            message = (
                "write KEY=VALUE with a dotted key, such as campaign.max_step_km=10"
            )
            faults.append(Fault(message, f"--set {text}"))
        overrides.append(override_of(key, value, f"--set {text}"))
    raise_any(faults)
    return overrides


def load_overridden(arguments: argparse.Namespace) -> tuple[Scene, Sequence[Override]]:
    """Load the scene of the command line, or of standard input, with its overrides.

    Return both.
    """
    overrides = overrides_of(arguments.set)
    content, path = None, arguments.scene
    if path == STDIN:
        content, path = sys.stdin.buffer.read(), "stdin.toml"
    scene = load_scene(path, content=content, overrides=overrides)
    if arguments.smoothing is None:
        return scene, overrides
    if isinstance(scene, SweepScene):
        message = (
            f"--smoothing is for campaigns; this scene is of kind {scene.scene.kind}"
        )
        raise SceneError([Fault(message, str(scene.origin.path))])
    for role, part in scene.prefixed.items():
        wavelength = (
            _SMOOTHING[arguments.smoothing] * part.campaign.smoothing_wavelength_mm
        )
        key, flag = (
            f"{role}campaign.smoothing_wavelength_mm",
            f"--smoothing {arguments.smoothing}",
        )
        overrides.append(Override(key, wavelength, flag))
    return load_scene(path, content=content, overrides=overrides), overrides
