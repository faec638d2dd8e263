"""`wearsim run` and `wearsim check` on a scene of contact locations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.scene import LocationScene


def write(scene: LocationScene, folder: Path, command: str) -> Path:
    """Search the contacts and write the report.

    Parameters
    ----------
    scene : LocationScene
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
    from wearsim.report.pages_location import write_locations
    from wearsim.scene.location import locations_of
    from wearsim.studies.location import solve_locations

    cases = locations_of(scene)
    return write_locations(solve_locations(cases), cases.remarks, folder, scene.origin.path.stem, command)


def plan(scene: LocationScene) -> dict[str, Any]:
    """Tell what the scene would search.

    Parameters
    ----------
    scene : LocationScene
        As loaded.

    Returns
    -------
    dict
        For `wearsim check`.
    """
    from wearsim.scene.location import locations_of

    cases = locations_of(scene)
    return {
        "shifts": cases.shift.size,
        "counterfaces": len(cases.curvatures),
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
        Shifts and counterfaces.
    """
    return f"{told['title']}: {told['shifts']} shifts on {told['counterfaces']} counterfaces"
