"""Scenes that are no campaigns: which module runs each kind, and what all those with a report share."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import StudyScene

_REPORTED = {
    "published": "wearsim.cli.published",
    "location": "wearsim.cli.location",
}
"""Modules with `write` (solves a scene, writes its report and returns the path of it), `plan` and `text`."""


@dataclass(frozen=True)
class Study:
    """What `wearsim run` and `wearsim check` do with a kind of scene.

    Parameters
    ----------
    run : callable
        Of scene, folder or None, command line: solves the scene; returns the exit code.
    plan : callable
        Of scene: what it would solve, for `wearsim check --json`.
    text : callable
        Of what `plan` told: lines for `wearsim check`.
    """

    run: Callable[[Any, Path | None, str], int]
    plan: Callable[[Any], dict[str, Any]]
    text: Callable[[dict[str, Any]], str]


def study(scene: StudyScene) -> Study:
    """Return what runs a scene.

    Parameters
    ----------
    scene : StudyScene
        As loaded.

    Returns
    -------
    Study
        By the kind of the scene.
    """
    if scene.scene.kind in _REPORTED:
        return _reported(_REPORTED[scene.scene.kind])
    from wearsim.cli import sweep

    return Study(sweep.run, sweep.plan, sweep.text)


def _reported(name: str) -> Study:
    """Study whose outcome is a report, in "reports" if no folder is given."""
    module = importlib.import_module(name)

    def run(scene: Any, out: Path | None, command: str) -> int:
        print(f"report: {module.write(scene, out or Path('reports'), command)}")
        return 0

    def plan(scene: Any) -> dict[str, Any]:
        title = scene.scene.title or scene.origin.path.stem
        settings = scene.model_dump(by_alias=True, mode="json")
        return {"title": title, **module.plan(scene), "settings": settings}

    return Study(run, plan, module.text)
