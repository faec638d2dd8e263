"""Sensitivity of a campaign's result to its numerical settings: one refined at a time, then all together."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.campaign.record import write_atomically
from wearsim.campaign.run import Event, Observer, run_scene
from wearsim.errors import ContactError
from wearsim.quantities import QUANTITIES
from wearsim.results import open_results
from wearsim.results.checks import last_worn_row, new_row, wear_steps
from wearsim.results.schema import CONVERGENCE
from wearsim.scene import CampaignScene, FieldScene, RigScene, load_campaign
from wearsim.scene.campaign import STABILITY
from wearsim.scene.overrides import Override

FOLDER = "converge"
MEASURES = ("flange_thickness", "flange_height", "max_wear_depth", "worn_area", "equivalent_conicity")
COUNTERFACE_MEASURES = ("counterface_max_wear_depth", "counterface_worn_area")
"""Further measures of rails or rollers that wear."""


@dataclass(frozen=True)
class Refinement:
    """One way to compute the same campaign otherwise.

    `name` is that of its run directory, `text` says what is refined; where there is nothing to refine
    `overrides` is empty, and `reason` says why.
    """

    name: str
    text: str
    overrides: tuple[Override, ...]
    reason: str = ""


def refinements(scene: CampaignScene) -> tuple[Refinement, ...]:
    """Make the refinements of a scene.

    Step, grid, smoothing (half and double), operating points, and all but double smoothing together.
    """

    def overrides(of: Any) -> tuple[Override, ...]:
        parts = scene.prefixed.items()
        return tuple(Override(role + key, value) for role, part in parts for key, value in of(part).items())

    step, grid, points = overrides(_step), overrides(_grid), overrides(_points)
    # together the points are twice as close, and half the wavelength is resolved wherever the whole one was
    resolved = overrides(lambda part: _smoothing(part, 0.5, _grid(part)["campaign.point_spacing_mm"]))
    text = "all of these, smoothed as given"
    if resolved:
        where = "" if len(resolved) == len(scene.prefixed) else ", where points resolve that"
        text = f"all of these, with the wavelength halved{where}"
    no_wave = "the increments are not smoothed, or half the wavelength is below two points of the profile"
    half, double = (overrides(lambda part, f=factor: _smoothing(part, f)) for factor in (0.5, 2.0))
    given = "a rig programme gives its operating points one by one"
    return (
        Refinement("step", "steps half as long", step),
        Refinement("grid", "profile points, strips and cells twice as fine", grid),
        Refinement("smoothing-half", "smoothing wavelength halved", half, no_wave),
        Refinement("smoothing-double", "smoothing wavelength doubled", double, no_wave),
        Refinement("points", "twice as many lateral positions", points, given),
        Refinement("together", text, (*step, *grid, *resolved, *points)),
    )


def other_models(scene: CampaignScene, against: Sequence[tuple[str, str]]) -> tuple[Refinement, ...]:
    """Make the campaigns with other contact models, by their normal and tangential model, else as given."""
    if any(part.contact.model == "auto" for part in scene.parts):
        roles, reason = [], 'the scene leaves its contact models to model = "auto"'
    else:
        roles, reason = list(scene.prefixed), ""
    return tuple(
        Refinement(
            f"{normal}+{tangential}",
            f"contact models {normal} + {tangential}",
            tuple(
                Override(f"{role}contact.{key}", value)
                for role in roles
                for key, value in (("normal", normal), ("tangential", tangential))
            ),
            reason,
        )
        for normal, tangential in against
    )


def converge(
    path: str | Path,
    out: str | Path,
    *,
    overrides: Sequence[Override] = (),
    distance: float | None = None,
    refine: bool = True,
    against: Sequence[tuple[str, str]] = (),
    command: str = "",
    observer: Observer | None = None,
) -> Path:
    """Run a scene and its refinements, each in a run directory of its own, and compare the ends.

    Parameters
    ----------
    path : str or Path
        Scene file of a campaign.
    out : str or Path
        Run directory of the campaign itself; it is run there unless it is finished.
    overrides : sequence of Override
        Values that replace those in the scene file, in all of them.
    distance : float, optional
        Run all of them, the scene as it is too, for this distance only [m].
    refine : bool
        Whether step, grid, smoothing and operating points are refined.
    against : sequence of (str, str)
        Normal and tangential contact models of further runs of the campaign.
    command : str
        Command line.
    observer : callable, optional
        Called with an `Event` at each step.

    Returns
    -------
    Path
        The table, JSON; what was finished before is not run again.
    """
    out = Path(out)
    shortened = () if distance is None else (Override("campaign.distance_km", 1e-3 * distance),)
    common = (*overrides, *shortened)
    scene = load_campaign(path, overrides=common)
    others = other_models(scene, against)
    for item in others:  # models that cannot run raise before anything is run
        load_campaign(path, overrides=(*common, *item.overrides))
    runs = out / FOLDER if distance is None else out / f"{FOLDER}-{1e-3 * distance:g}km"
    base = out if distance is None else runs / "as-given"

    def run(directory: Path, all_overrides: Sequence[Override]) -> dict[str, dict[str, Any]]:
        """Run, and return the ends of the campaigns by their kind."""

        def observe(event: Event) -> None:
            name = event.name if directory == out else f"{event.name}, {directory.name}"
            if observer is not None:
                observer(replace(event, name=name))

        paths = run_scene(path, directory, overrides=all_overrides, command=command, observer=observe)
        return {item.stem: _end(item) for item in paths if item.stem in ("rig", "field")}

    out.mkdir(parents=True, exist_ok=True)
    given = run(base, common)
    alike = (*common, *_as_far(scene, given))
    runs.mkdir(exist_ok=True)
    rows = []
    for item in (*(refinements(scene) if refine else ()), *others):
        row: dict[str, Any] = {"name": item.name, "text": item.text, "reason": item.reason}
        if item.overrides:
            try:
                ends = run(runs / item.name, (*alike, *item.overrides))
                for kind, end in ends.items():
                    file = f"{kind}.nc"
                    end["profile_difference"] = _difference(base / file, runs / item.name / file)
                row |= {"ends": ends, "reason": ""}
            except ContactError as error:
                row["reason"] = f"failed: {error}"
        rows.append(row)
    table = {"command": command, "shortened": distance is not None, "given": given, "rows": rows}
    write_atomically(out / CONVERGENCE, json.dumps(table, indent=2, allow_nan=False).encode())
    return out / CONVERGENCE


def _as_far(scene: CampaignScene, given: dict[str, dict[str, Any]]) -> tuple[Override, ...]:
    """Return the overrides that let refined campaigns run as far as those given that ended at a limit."""
    overrides: list[Override] = []
    for prefix, part in scene.prefixed.items():
        if part.campaign.limits is not None and part.campaign.limits.end:
            distance = 1e-3 * given[part.scene.kind]["distance"]
            overrides.append(Override(f"{prefix}campaign.distance_km", distance))
            overrides.append(Override(f"{prefix}campaign.limits.end", False))
    return tuple(overrides)


def _end(path: Path) -> dict[str, Any]:
    """Measures at the end of a campaign, and how far they moved; None where a profile has none.

    After a reprofiling at the end it is that of the worn wheels: refined ones are not reprofiled there.
    """
    with open_results(path) as data:
        row = last_worn_row(data)
        names = (*MEASURES, *(name for name in COUNTERFACE_MEASURES if name in data))
        values = {name: data[name].values for name in names}
        return {
            "distance": float(data["distance"][-1]),
            "steps": wear_steps(data),
            "points": data.sizes["operating_point"],
            "end": {name: _known(value[row]) for name, value in values.items()},
            "moved": {name: _known(value[row] - value[0]) for name, value in values.items()},
        }


def _difference(given: Path, other: Path) -> list[float]:
    """Largest difference of the wear depth at one place of the profile, of each wheel, at the ends [m]."""
    with open_results(given) as a, open_results(other) as b:
        rows = [(data, last_worn_row(data)) for data in (a, b)]
        (y, depth), (other_y, other_depth) = (
            (data["profile_y"].values[new_row(data, row)], data["wear_depth"].values[row])
            for data, row in rows
        )
    return [
        float(np.abs(np.interp(y[wheel], other_y[wheel], other_depth[wheel]) - depth[wheel]).max())
        for wheel in range(len(y))
    ]


def _known(values: np.ndarray) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in np.reshape(values, -1).tolist()]


def _scaled(section: Any, name: str, factor: float, **quantities: str) -> dict[str, float]:
    """Values of keys of a section that are given, times a factor, within the ranges of their quantities."""
    scaled = {}
    for key, quantity in quantities.items():
        low, high = QUANTITIES[quantity].span
        if (value := getattr(section, key)) is not None:
            scaled[f"{name}.{key}"] = min(max(factor * value, low), high)
    return scaled


def _step(part: RigScene | FieldScene) -> dict[str, float]:
    campaign = part.campaign
    halved = {
        "max_step_depth_um": "depth_cap", "first_step_depth_um": "first_depth", "max_step_km": "step_length",
    }  # fmt: skip
    return {
        **_scaled(campaign, "campaign", 0.5, **halved),
        "campaign.stability": 0.5 * (campaign.stability or STABILITY[campaign.integrator][0]),
        # the error of a step grows with the cube of its length
        **_scaled(campaign, "campaign", 0.125, error_tolerance_um="step_error"),
    }


def _grid(part: RigScene | FieldScene) -> dict[str, float]:
    return {
        **_scaled(part.campaign, "campaign", 0.5, point_spacing_mm="point_spacing"),
        **_scaled(part.contact, "contact", 0.5, cell_mm="cell_size"),
        **_scaled(part.contact, "contact", 2, strips="strips", cells="cells", most_cells="most_cells"),
    }


def _smoothing(part: RigScene | FieldScene, factor: float, spacing: float | None = None) -> dict[str, float]:
    """Change the wavelength, but to none that the points, by default as given, do not resolve."""
    scaled = _scaled(part.campaign, "campaign", factor, smoothing_wavelength_mm="smoothing_wavelength")
    least = 2.0 * (part.campaign.point_spacing_mm if spacing is None else spacing)
    return {key: wavelength for key, wavelength in scaled.items() if wavelength >= least}


def _points(part: RigScene | FieldScene) -> dict[str, float]:
    if isinstance(part, RigScene):
        return {}
    scaled: dict[str, float] = {}
    for number, run in enumerate(part.operation.classes, start=1):
        scaled |= _scaled(run, f"operation.class.{number}", 2, positions="positions")
    return scaled
