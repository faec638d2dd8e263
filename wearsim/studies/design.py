"""Stages of a rig programme: candidates, durations, and the campaign of the blocks."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.control import reached
from wearsim.campaign.counterface import worn_counterface
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.state import State, worn_wheels
from wearsim.contact.problem import Counterface, Wheelset
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import Fault, SceneError
from wearsim.profile.shape import Profile, resample_to
from wearsim.profile.sources import read_profile
from wearsim.results import loaded
from wearsim.scene import CampaignSetup, RigScene, build, load_scene
from wearsim.scene.inputs import inputs_of
from wearsim.scene.overrides import Overrides
from wearsim.scene.programme import ProgrammeSection
from wearsim.scene.set_points import SetPoints, section_of, set_points
from wearsim.studies.candidates import Candidates, Wear, candidates_of, wear_of
from wearsim.translation.programme import few_blocks
from wearsim.translation.target import Target, field_target, worn_target

FloatArray = NDArray[np.float64]

_LEAST = 2e-6  # tolerance of a stage [m]
_TURN = 1.0  # distance at the end of a ramp, whose block gives the set-points there [m]
_SHORTEST = 10.0  # block; shorter ones are left out [m]
_FILES = {
    "wheelset.profile": ("wheelset", "profile"),
    "wheelset.profile_left": ("wheelset", "profile_left"),
    "counterface.profile": ("counterface", "profile"),
    "counterface.profile_left": ("counterface", "profile_left"),
    "counterface.rig": ("counterface", "rig"),
    "wear.table_file": ("wear", "table_file"),
}


@dataclass(frozen=True)
class Block:
    """A block of a programme; a ramp has unlike shifts and several positions."""

    stage: int  # from 0
    lateral: tuple[float, float]  # shift [m] or force [N] at its beginning and end
    positions: int
    yaw: float  # [rad]
    load: float  # of a wheel [N]
    distance: float  # [m]


@dataclass(frozen=True)
class Design:
    """Scene, target, candidates and bodies of the design of a programme."""

    scene: RigScene
    section: ProgrammeSection
    set_points: SetPoints
    candidates: Candidates
    target: Target
    bodies: tuple[Wheelset, Counterface]  # new, wheels with equally many points
    new: Wear  # of the candidates on them
    tables: dict[str, Any]  # of the scene, with files that are found from anywhere

    @classmethod
    def of(cls, scene: RigScene, target: Any, distance: float | None) -> Design:
        """Read the target and lay out the candidates."""
        section, values = section_of(scene), set_points(scene)
        setup = build(scene)
        wheelset = setup.wheelset
        wheels = wheelset.right, resample_to(wheelset.left, wheelset.right.y.size)
        bodies = replace(wheelset, left=wheels[1]), setup.counterface
        wear_target = _target(target, wheels, distance)
        if (
            wear_target.field is None
            and section.guard
            and "guard" in section.model_fields_set
        ):
            text = "a worn wheel has no pressures to guard; give a field result"
            fault = f"guard = {section.guard:g}: {text}, or guard = 0"
            raise SceneError([scene.fault(("programme", "guard"), fault)])
        regimes = WEAR_LAWS[setup.wear.law].regimes
        wear_target = wear_target.in_order_of(regimes, compared=section.guard > 0.0)
        candidates = candidates_of(values, ramps=section.ramps)
        new = wear_of(candidates, scene, bodies)
        if not new.solved.any():
            text = "none of the set-points has a contact; give others in [programme]"
            raise SceneError([scene.fault(("programme",), text)])
        return cls(
            scene, section, values, candidates, wear_target, bodies, new, _tables(scene)
        )

    @property
    def stage_depth(self) -> float:
        """Largest depth of a stage [m]."""
        return 1e-6 * self.section.stage_depth_um

    @property
    def tolerance(self) -> float:
        """Largest error allowed at the end of each stage [m]."""
        return max(self.section.tolerance * self.target.deepest, _LEAST)

    def wear(self, state: State | None) -> Wear:
        """Wear of the candidates on the bodies of a state, the new ones without it."""
        if state is None:
            return self.new
        wheelset, counterface = self.bodies
        right, left = worn_wheels(wheelset, state.y, state.z)
        worn = replace(wheelset, right=right, left=left)
        bodies = worn, worn_counterface(counterface, state.counterface)
        return wear_of(self.candidates, self.scene, bodies, self.new.running)

    def stage(
        self, number: int, low: float, high: float, state: State | None
    ) -> tuple[list[Block], dict[str, float]]:
        """Blocks of a stage between two depths [m], and what was found."""
        part = self.target.stage(low, high)
        wear = self.wear(state)
        done = 0.0 if state is None else state.wear_depth
        problem, index, single = wear.problem(
            part.depth - done, part, self.section.guard
        )
        tolerance = self.tolerance
        worn = float((part.depth - done).max())
        loops = max(int(np.ceil(1e6 * worn / self.section.loop_depth_um)), 1)
        changeover = 60.0 * self.section.changeover_min * loops
        durations = few_blocks(
            problem, tolerance, self.section.blocks, changeover, single
        )
        chosen = [
            self.block(number, int(index[k]), float(durations.distance[k]))
            for k in durations.blocks
            if durations.distance[k] > _SHORTEST
        ]
        chosen.sort(key=lambda block: (sum(block.lateral), block.yaw, block.load))
        row = {
            "target_depth": high,
            "field_distance": part.distance,
            "rig_distance": sum(block.distance for block in chosen),
            "tolerance": tolerance,
            "kept_error": durations.tolerance,
            "loops": float(loops),
            "blocks": float(len(chosen)),
            "guard_binds": float(durations.guard.any()),
        }
        return chosen, row

    def block(self, stage: int, candidate: int, distance: float) -> Block:
        """Block of a candidate."""
        candidates = self.candidates
        return Block(
            stage,
            candidates.lateral(candidate),
            int(candidates.last[candidate] - candidates.first[candidate]) + 1,
            float(self.set_points.yaw[candidates.yaw[candidate]]),
            float(self.set_points.load[candidates.load[candidate]]),
            distance,
        )

    def run(self, blocks: Sequence[Block], loops: int, state: State | None) -> State:
        """Run loops of blocks as a campaign, from a state; None are the new wheels."""
        rows = rows_of(blocks, self.set_points, loops)
        return _run(setup_of_tables(self.scene_of(rows, loops)), state)

    def scene_of(self, rows: Sequence[Mapping[str, Any]], loops: int) -> dict[str, Any]:
        """Tables of the rig's scene with loops of other blocks."""
        run = loops * sum(row["distance_km"] for row in rows)
        campaign = {
            key: value
            for key, value in self.tables["campaign"].items()
            if key not in ("limits", "reprofiling")
        }
        return {
            **self.tables,
            "operation": {"block": list(rows)},
            "campaign": campaign | {"distance_km": run},
        }


def rig_scene(rig: Any, overrides: Overrides) -> RigScene:
    """Return the scene of a rig, with overrides."""
    scene = rig if isinstance(rig, RigScene) else load_scene(rig, overrides=overrides)
    if not isinstance(scene, RigScene):
        text = "the programme is that of a rig; give a scene of kind rig"
        raise SceneError([Fault(text, str(scene.origin.path))])
    return scene


def _target(
    target: Any, wheels: tuple[Profile, Profile], distance: float | None
) -> Target:
    """Read a target: a result, or a worn wheel."""
    if isinstance(target, str | Path) and Path(target).suffix.lower() != ".nc":
        target = read_profile(target, kind="wheel")
    if isinstance(target, Profile):
        target = target, target
    if isinstance(target, tuple):
        return worn_target(target, wheels, distance)
    return field_target(loaded(target), wheels, distance)


def _tables(scene: RigScene) -> dict[str, Any]:
    """Tables of a scene in which files have whole paths."""
    tables = tomllib.loads(scene.origin.content.decode("utf-8-sig"))
    for file in inputs_of(scene).files:
        if file.role in _FILES and not file.shipped:
            table, key = _FILES[file.role]
            tables[table][key] = str(file.path.resolve())
    return tables


def _run(setup: CampaignSetup, state: State | None) -> State:
    """Run a campaign to its end, from the wheels and rollers of a state if given."""
    evolution = WheelsetEvolution(setup)
    begun, taken = evolution.start()
    if state is not None:
        begun = evolution.settled(_continued(begun, state))
    while not reached(begun.distance, evolution.target):
        begun, taken = evolution.advance(begun, evolution.evaluate(begun, taken))
    return begun


def _continued(begun: State, state: State) -> State:
    """Begin a campaign with the wheels and rollers of the end of another one."""
    rollers = state.counterface
    if rollers is not None:
        before = rollers.redressed_at - state.distance
        rollers = replace(rollers, redressed_at=before)
    return replace(
        begun,
        y=state.y,
        z=state.z,
        wear_depth=state.wear_depth,
        regime_depth=state.regime_depth,
        counterface=rollers,
    )


def rows_of(
    blocks: Sequence[Block], values: SetPoints, loops: int
) -> list[dict[str, Any]]:
    """Rows of one of some loops of blocks, in their order, for a file of blocks.

    A ramp runs to the set-points of the row after it, so one of a metre follows it.
    """
    rows: list[dict[str, Any]] = []
    for number, block in enumerate(blocks):
        name = f"stage {block.stage + 1} block {number + 1}"
        place = block.lateral[0], block.yaw, block.load
        row = row_at(name, values, place, block.distance / loops)
        rows.append(row)
        if block.positions > 1:
            end: dict[str, Any] = {"shift_mm": round(1e3 * block.lateral[1], 6)}
            end |= {"name": f"{row['name']} end", "distance_km": 1e-3 * _TURN}
            rows.append(row | end)
            row["positions"] = block.positions
    return rows


def row_at(
    name: str,
    values: SetPoints,
    place: tuple[float, float, float],
    distance: float,
) -> dict[str, Any]:
    """Row of a block at a shift [m] or force [N], yaw [rad] and load [N]."""
    lateral, yaw, load = place
    key, unit = ("lateral_force_kN", 1e-3) if values.by_force else ("shift_mm", 1e3)
    return {
        "name": name,
        key: round(unit * lateral, 6),
        "yaw_mrad": round(1e3 * yaw, 6),
        "load_kN": round(1e-3 * load, 6),
        "speed_km_h": round(3.6 * values.speed, 6),
        "friction": values.friction,
        "environment": values.environment,
        **values.stated,
        "distance_km": round(1e-3 * distance, 6),
    }


def setup_of_tables(tables: Mapping[str, Any]) -> CampaignSetup:
    """Return what a campaign of a scene needs, without laws for comparison."""
    scene = load_scene(tables)
    assert isinstance(scene, RigScene)
    return replace(build(scene), also_evaluate=(), fatigue=(), templates=None)
