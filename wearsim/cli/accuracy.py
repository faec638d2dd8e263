"""`wearsim run` and `wearsim check` on a scene that measures contact models against a reference."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import AccuracyScene


def write(scene: AccuracyScene, folder: Path, command: str) -> Path:
    """Solve the cases with every model and write the report.

    Parameters
    ----------
    scene : AccuracyScene
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
    from wearsim.report.pages_accuracy import write_accuracy
    from wearsim.scene.accuracy import matrix_of
    from wearsim.studies.accuracy import solve_accuracy

    return write_accuracy(solve_accuracy(matrix_of(scene)), folder, scene.origin.path.stem, command)


def plan(scene: AccuracyScene) -> dict[str, Any]:
    """Tell what the scene would solve.

    Parameters
    ----------
    scene : AccuracyScene
        As loaded.

    Returns
    -------
    dict
        For `wearsim check`.
    """
    from wearsim.campaign.choose import named
    from wearsim.scene.accuracy import matrix_of

    matrix = matrix_of(scene)
    return {
        "cases": matrix.count,
        "reference": named(matrix.reference),
        "models": [named(models) for models in matrix.models],
        "contact_solutions": matrix.count * (1 + len(matrix.models)),
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
        Cases, reference, models.
    """
    lines = [f"{told['title']}: {told['cases']} cases", f"reference: {told['reference']}"]
    lines += [f"model: {name}" for name in told["models"]]
    return "\n".join([*lines, f"{told['contact_solutions']} contact solutions"])
