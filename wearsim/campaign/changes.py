"""Settings that `wearsim resume` changes: which, from which step on, and the control of each step."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from wearsim.campaign.directory import MANIFEST, SCENE_FOLDER, Change, Manifest
from wearsim.campaign.record import write_atomically
from wearsim.errors import Fault, ResultError, SceneError
from wearsim.scene import CampaignScene, FieldScene, RigScene, build, load_campaign
from wearsim.scene.campaign import ControlSettings
from wearsim.scene.overrides import Override

CHANGEABLE = (
    "max_step_depth_um", "first_step_depth_um", "max_step_km", "stability", "error_tolerance_um",
    "integrator", "smoothing_wavelength_mm",
)  # fmt: skip
"""Keys of [campaign] that act from the next step on: length and error of the steps, and their smoothing."""

FirstStep = Callable[[RigScene | FieldScene], int | None]
"""First step that is not computed yet of a campaign; None if it is finished."""


def changed_scene(
    out: Path, manifest: Manifest, changes: Sequence[Change], overrides: Sequence[Override] = ()
) -> CampaignScene:
    """Load the scene of a run directory with changes and further overrides."""
    before = [Override(f"{one.campaign}.{one.key}", one.new) for one in changes]
    return load_campaign(out / SCENE_FOLDER / manifest.main, copied=True, overrides=[*before, *overrides])


def with_changes(
    out: Path, manifest: Manifest, overrides: Sequence[Override], first_step: FirstStep
) -> Manifest:
    """Store changes of settings in the manifest of a locked run directory; they act from the next step on.

    Raises
    ------
    SceneError
        For keys that cannot change, and values out of their range.
    ResultError
        If all campaigns are finished.
    """
    names = ", ".join(f"campaign.{key}" for key in CHANGEABLE)
    faults = [
        Fault(
            f"{one.key} cannot change in a campaign that has begun, {names} can; start the changed scene "
            "with `wearsim run` and another --out",
            one.source,
        )
        for one in overrides
        if one.keys[-2:-1] != ("campaign",) or one.keys[-1] not in CHANGEABLE
    ]
    if faults:
        raise SceneError(faults)
    before, after = (changed_scene(out, manifest, manifest.changes, more) for more in ((), overrides))
    steps: dict[str, int | None] = {
        part.scene.kind: first_step(part) for part in changed_scene(out, manifest, ()).parts
    }
    if not (begun := {campaign: step for campaign, step in steps.items() if step is not None}):
        raise ResultError(
            f"{out} is finished; nothing was changed, start the changed scene with another --out"
        )
    if late := [one for one in overrides if one.keys[0] in steps.keys() - begun.keys()]:
        raise SceneError(
            [Fault(f"{one.key} cannot change: {one.keys[0]} is finished", one.source) for one in late]
        )
    # a step may be computed again because its record was lost
    stored = [replace(one, step=min(one.step, begun.get(one.campaign, one.step))) for one in manifest.changes]
    for old, new in zip(before.parts, after.parts, strict=True):
        for key in CHANGEABLE if (campaign := new.scene.kind) in begun else ():
            values = getattr(old.campaign, key), getattr(new.campaign, key)
            if values[0] != values[1]:
                stored.append(Change(campaign, begun[campaign], f"campaign.{key}", *values))
    manifest = replace(manifest, changes=tuple(stored))
    write_atomically(out / SCENE_FOLDER / MANIFEST, json.dumps(asdict(manifest), indent=2).encode())
    return manifest


def controls(out: Path, manifest: Manifest, campaign: str) -> tuple[tuple[int, ControlSettings], ...]:
    """First step and settings of the control of each change of a campaign, in order."""
    own = [one for one in manifest.changes if one.campaign == campaign]
    result = []
    for number, change in enumerate(own):
        scene = changed_scene(out, manifest, own[: number + 1])
        part = next(part for part in scene.parts if part.scene.kind == campaign)
        result.append((change.step, build(part).control))
    return tuple(result)


def text_of(manifest: Manifest, campaign: str) -> str:
    """List the changes of a campaign, for its results; empty without any."""
    return "; ".join(
        f"from step {one.step} on {one.key} = {_text(one.new)} instead of {_text(one.old)}"
        for one in manifest.changes
        if one.campaign == campaign
    )


def _text(value: float | str | None) -> str:
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
