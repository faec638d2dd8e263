"""Check of a scene: all its faults, or what would be run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from wearsim.scene import Scene, SweepScene, load_scene, prepare
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.models import SceneModel
from wearsim.scene.overrides import Overrides
from wearsim.studies.plan import plan, silent
from wearsim.studies.sweep import checked_plan


def check(
    scene: str | Path | Mapping[str, Any] | Scene,
    *,
    overrides: Overrides = (),
    report: Callable[[str], None] = silent,
) -> dict[str, Any]:
    """Check a scene as `wearsim check` does.

    Its files, its keys, and the contact of the new wheels.

    Parameters
    ----------
    scene : str, Path, dict or scene
        Scene file, its tables as dicts, or loaded by `load_scene`.
    overrides : mapping or sequence of Override
        Values that replace those of a scene file or dict, as of `load_scene`:
        {"contact.model": "fast"}.
    report : callable, optional
        Called with what is being done.

    Returns
    -------
    dict
        JSON values, SI units. `scene` and `kind`; of a sweep `title`, `cases`, the
        campaigns of the `first` one and `warnings`; of any other scene `campaigns`,
        each with `settings`, every value that would act, `states`, the forces and wear
        numbers of the operating points on new wheels, estimates of steps, time and end,
        and `warnings`.

    Raises
    ------
    SceneError
        With all faults of the first stage that has any.

    Examples
    --------
    >>> import wearsim
    >>> plan = wearsim.check("workflows/rig_given.toml", overrides={"contact.model": "fast"})
    >>> campaign = plan["campaigns"][0]
    >>> campaign["distance"], campaign["settings"]["contact"]["model"]
    (1260000.0, 'fast')
    >>> try:
    ...     wearsim.check("workflows/rig_given.toml", overrides={"wheelset.radius_mm": -460})
    ... except wearsim.WearsimError as error:
    ...     print("radius_mm = -460 must be" in str(error))
    True
    """
    loaded = (
        scene
        if isinstance(scene, SceneModel)
        else load_scene(scene, overrides=overrides)
    )
    about = {"scene": str(loaded.origin.path), "kind": loaded.scene.kind}
    if isinstance(loaded, SweepScene):
        return {**about, **checked_plan(loaded)}
    report("where the wheelset runs")
    prepared = [prepare(part) for part in loaded.parts]
    report("initial contact")
    warnings = check_contact(loaded, prepared=prepared)
    plans = []
    for part, prepared_part in zip(loaded.parts, prepared, strict=True):
        part_warnings = [
            item for item in warnings if item.file == str(part.origin.path)
        ]
        plans.append(plan(part, prepared_part, part_warnings, report=report))
    return {**about, "campaigns": plans}
