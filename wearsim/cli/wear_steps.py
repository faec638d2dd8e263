"""`wearsim run` and `wearsim check` on a scene of wear steps with control on and off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import WearStepsScene


def write(scene: WearStepsScene, folder: Path, command: str) -> Path:
    """Wear the wheel in every way and write the report.

    Parameters
    ----------
    scene : WearStepsScene
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
    from wearsim.report.pages_wear_steps import write_wear_steps
    from wearsim.studies.wear_steps import solve_scene

    datasets = solve_scene(scene)
    stem = scene.origin.path.stem
    return write_wear_steps(datasets, scene.scene.title or stem, scene.remarks, folder, stem, command)


def plan(scene: WearStepsScene) -> dict[str, Any]:
    """Tell what the scene would run.

    Parameters
    ----------
    scene : WearStepsScene
        As loaded.

    Returns
    -------
    dict
        For `wearsim check`.
    """
    from wearsim.studies.wear_steps import cases_of

    return {
        "cases": [
            f"{case.normal}: {case.text} ({model.beyond:g} times), to {model.depth_um:g} um"
            for model in scene.models
            for case in cases_of(model.normal, model.beyond)
        ],
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
        Title and cases.
    """
    return "\n".join([told["title"], *told["cases"]])
