"""`wearsim run` and `wearsim check` on a scene of published contact cases."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import PublishedScene


def write(scene: PublishedScene, folder: Path, command: str) -> Path:
    """Solve the cases and write the report.

    Parameters
    ----------
    scene : PublishedScene
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
    from wearsim.report.pages_published import write_published
    from wearsim.scene.published import published_cases
    from wearsim.studies.published import contact_states, solve_published

    cases = published_cases(scene)
    stem = scene.origin.path.stem
    return write_published(solve_published(cases), contact_states(cases), folder, stem, command)


def plan(scene: PublishedScene) -> dict[str, Any]:
    """Tell what the scene would solve.

    Parameters
    ----------
    scene : PublishedScene
        As loaded.

    Returns
    -------
    dict
        For `wearsim check`.
    """
    from wearsim.scene.published import published_cases

    cases = published_cases(scene)
    points = len(cases.cases) * len(cases.profiles)
    trends = len(cases.trend_shifts) * len(cases.trend_curvatures)
    return {
        "cases": len(cases.cases),
        "profiles": list(cases.names),
        "contact_solutions": 3 * points + len(cases.cases) + trends,
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
        Two lines.
    """
    return (
        f"{told['title']}: {told['cases']} cases on {', '.join(told['profiles'])}\n"
        f"{told['contact_solutions']} contact solutions"
    )
