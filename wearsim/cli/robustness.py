"""`wearsim run` and `wearsim check` on a scene that looks for where contact models fail."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import RobustnessScene


def write(scene: RobustnessScene, folder: Path, command: str) -> Path:
    """Put every combination of models into every situation and write the report.

    Parameters
    ----------
    scene : RobustnessScene
        As loaded.
    folder : Path
        Of the report.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        Of the report.
    """
    from wearsim.report.robustness import write_robustness
    from wearsim.studies.robustness import Limits, assess
    from wearsim.studies.step_limits import step_limits

    limits = scene.limits
    found = assess(
        scene.grids.models,
        scene.grids.reference,
        Limits(1e-2 * limits.right_percent, 1e-2 * limits.wrong_percent, limits.seconds),
    )
    stem = scene.origin.path.stem
    told = (scene.scene.title or stem, scene.remarks)
    return write_robustness(found, step_limits(), told, folder, stem, command)


def plan(_scene: RobustnessScene) -> dict[str, Any]:
    """Tell what a scene of this kind would solve: they differ in limits and grids only.

    Parameters
    ----------
    _scene : RobustnessScene
        As loaded.

    Returns
    -------
    dict
        For `wearsim check`.
    """
    from wearsim.studies.robustness import COMBINATIONS
    from wearsim.studies.situations import SITUATIONS

    return {
        "situations": len(SITUATIONS),
        "combinations": len(COMBINATIONS),
        "contact_solutions": len(SITUATIONS) * (1 + len(COMBINATIONS)),
    }


def text(told: dict[str, Any]) -> str:
    """Lines for `wearsim check`.

    Parameters
    ----------
    told : dict
        From `plan`.

    Returns
    -------
    str
        Situations, combinations of models, solutions.
    """
    return (
        f"{told['title']}: {told['situations']} situations, {told['combinations']} combinations of models\n"
        f"{told['contact_solutions']} contact solutions"
    )
