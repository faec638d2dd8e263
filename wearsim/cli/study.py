"""Scenes that are no campaigns: which module runs each kind."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

if TYPE_CHECKING:
    from wearsim.scene import StudyScene

_MODULES = {
    "published": "wearsim.cli.published",
    "accuracy": "wearsim.cli.accuracy",
    "location": "wearsim.cli.location",
    "wear_steps": "wearsim.cli.wear_steps",
    "sweep": "wearsim.cli.sweep",
    "robustness": "wearsim.cli.robustness",
}


class Study(Protocol):
    """What the module of a kind has."""

    def run(self, scene: Any, out: Path | None, command: str) -> int:
        """Solve the scene and write its report to `out`, "reports" if not given; the exit code."""

    def plan(self, scene: Any) -> dict[str, Any]:
        """Tell what the scene would solve, for `wearsim check --json`."""

    def text(self, told: dict[str, Any]) -> str:
        """Lines for `wearsim check` from what `plan` told."""


def study(scene: StudyScene) -> Study:
    """Return the module that runs a scene.

    Parameters
    ----------
    scene : StudyScene
        As loaded.

    Returns
    -------
    Study
        By the kind of the scene.
    """
    return cast("Study", importlib.import_module(_MODULES[scene.scene.kind]))
