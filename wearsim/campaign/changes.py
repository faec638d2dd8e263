"""Settings changed by `wearsim resume`, and the control of each step."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from wearsim.campaign.control import reached
from wearsim.campaign.directory import (
    MANIFEST,
    SCENE_FOLDER,
    Change,
    Manifest,
    is_claimed,
    read_manifest,
)
from wearsim.campaign.record import write_atomically
from wearsim.errors import Fault, ResultError, raise_any
from wearsim.quantities import kilometres
from wearsim.scene import (
    CampaignScene,
    CampaignSetup,
    FieldScene,
    Prepared,
    RigScene,
    build,
    load_campaign,
)
from wearsim.scene.overrides import Override

DISTANCE = "distance_km"
CHANGEABLE = (
    DISTANCE,
    "max_step_depth_um",
    "first_step_depth_um",
    "max_step_km",
    "stability",
    "error_tolerance_um",
    "integrator",
    "smoothing_wavelength_mm",
)
"""Keys of [campaign] that apply from the next step on.

They are the distance, the length and error of the steps, and the smoothing.
"""


@dataclass(frozen=True)
class Standing:
    """Progress of a campaign: steps recorded, distance run [m], reason of its end.

    The reason is "" if the campaign has not ended.
    """

    rows: int
    distance: float
    ended: str = ""


StandingOf = Callable[[RigScene | FieldScene], Standing]


def changed_scene(
    out: Path,
    manifest: Manifest,
    changes: Sequence[Change],
    overrides: Sequence[Override] = (),
) -> CampaignScene:
    """Load the scene of a run directory with changes and further overrides."""
    before = [
        Override(f"{change.campaign}.{change.key}", change.new) for change in changes
    ]
    return load_campaign(
        out / SCENE_FOLDER / manifest.main, copied=True, overrides=[*before, *overrides]
    )


def _check_changeable(overrides: Sequence[Override]) -> None:
    """Raise faults of keys that cannot change."""
    names = ", ".join(f"campaign.{key}" for key in CHANGEABLE)
    raise_any(
        [
            Fault(
                f"{override.key} cannot change in a campaign that has begun, {names} "
                "can; start the changed scene with `wearsim run` and another --out",
                override.source,
                override.line,
            )
            for override in overrides
            if override.keys[-2:-1] != ("campaign",)
            or override.keys[-1] not in CHANGEABLE
        ]
    )


def with_changes(
    out: Path,
    manifest: Manifest,
    overrides: Sequence[Override],
    standing_of: StandingOf,
) -> Manifest:
    """Store changes of settings in the manifest of a locked run directory.

    They apply from the next step on. A finished campaign accepts them if its distance
    is increased.

    Raises
    ------
    SceneError
        For keys that cannot change, and values out of their range.
    ResultError
        If changes are for finished campaigns alone.
    """
    _check_changeable(overrides)
    before, after = (
        changed_scene(out, manifest, manifest.changes, more) for more in ((), overrides)
    )
    parts = changed_scene(out, manifest, ()).parts
    standings: dict[str, Standing] = {
        part.scene.kind: standing_of(part) for part in parts
    }
    # a step may be computed again because its record was lost
    stored = [
        replace(change, step=min(change.step, max(standings[change.campaign].rows, 1)))
        for change in manifest.changes
    ]
    faults, closed = [], set()
    for old, new in zip(before.parts, after.parts, strict=True):
        campaign = new.scene.kind
        done = standings[campaign]
        values = {
            key: (getattr(old.campaign, key), getattr(new.campaign, key))
            for key in CHANGEABLE
        }
        changed = {key: pair for key, pair in values.items() if pair[0] != pair[1]}
        if DISTANCE in changed and (
            text := _distance_fault(campaign, new.campaign.distance_km, done)
        ):
            last = [
                override
                for override in overrides
                if override.keys[0] in (campaign, "campaign")
            ][-1]
            faults.append(Fault(text, last.source, last.line))
        elif changed and done.ended and DISTANCE not in changed:
            closed.add(campaign)
        else:
            step = max(done.rows, 1)
            stored += [
                Change(campaign, step, f"campaign.{key}", *pair)
                for key, pair in changed.items()
            ]
    raise_any(faults)
    if closed == standings.keys():
        raise ResultError(
            f"{out} is finished; nothing was changed: a longer campaign.distance_km "
            "continues it, other changes need `wearsim run` and another --out"
        )
    raise_any(
        [
            Fault(
                f"{override.key} cannot change: {override.keys[0]} is finished",
                override.source,
                override.line,
            )
            for override in overrides
            if override.keys[0] in closed
        ]
    )
    manifest = replace(manifest, changes=tuple(stored))
    write_atomically(
        out / SCENE_FOLDER / MANIFEST, json.dumps(asdict(manifest), indent=2).encode()
    )
    return manifest


def _distance_fault(campaign: str, distance_km: float, done: Standing) -> str:
    """State why the distance of a campaign cannot be changed, or ""."""
    if reached(done.distance, 1e3 * distance_km):
        return (
            f"distance_km = {distance_km:g} is not above the "
            f"{kilometres(done.distance)} that the {campaign} campaign has run; give "
            "more, or run the scene in another directory"
        )
    if done.ended and not done.ended.startswith("distance"):
        return (
            f"distance_km = {distance_km:g} does not continue the {campaign} campaign, "
            f"which ended after {kilometres(done.distance)} ({done.ended}); run a "
            "scene without end = true in [campaign.limits] in another directory"
        )
    return ""


def changed_setups(
    out: Path, manifest: Manifest, campaign: str, prepared: Prepared
) -> tuple[tuple[int, CampaignSetup], ...]:
    """First step and setup of each change of a campaign, in order.

    `prepared` is what was solved from its scene: changes act on the steps alone.
    """
    changes = [
        setting_change
        for setting_change in manifest.changes
        if setting_change.campaign == campaign
    ]
    result = []
    for number, change in enumerate(changes):
        scene = changed_scene(out, manifest, changes[: number + 1])
        part = next(part for part in scene.parts if part.scene.kind == campaign)
        result.append((change.step, build(part, prepared)))
    return tuple(result)


def distances_in(out: Path) -> tuple[Override, ...]:
    """Increased distances of the campaigns of a run directory.

    Empty for any other directory.
    """
    made = read_manifest(out).changes if is_claimed(out) else ()
    return tuple(
        Override(f"{change.campaign}.{change.key}", change.new)
        for change in made
        if change.key == f"campaign.{DISTANCE}"
    )


def text_of(manifest: Manifest, campaign: str) -> str:
    """List the changes of a campaign, for its results; empty without any."""
    return "; ".join(
        (
            f"from step {change.step} on {change.key} = {_text(change.new)} instead of "
            f"{_text(change.old)}"
        )
        for change in manifest.changes
        if change.campaign == campaign
    )


def _text(value: float | str | None) -> str:
    return (
        "none"
        if value is None
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )
