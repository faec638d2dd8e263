r"""Reprofiling of the wheels in a campaign: its time and the reprofiled wheelset.

Where a law states the depth h of a crack of damage 1, a cut of the depth c along the
normal leaves the damage :math:`\max(D - c/h, 0)`. Reprofiling at a limit of damage cuts
as deep as the deepest crack. A law without that depth loses all its damage.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.comparison import comparison_laws
from wearsim.campaign.counterface import without_step
from wearsim.campaign.state import State, worn_wheels
from wearsim.contact.patch import FloatArray
from wearsim.damage.fatigue import counts_cycles
from wearsim.profile.reprofiling import reprofile_axle
from wearsim.profile.shape import Profile, arc_length, vertex_normals
from wearsim.profile.worn import LARGEST_DEPTH, cut_along_normals
from wearsim.results.limits import first_distance, first_met
from wearsim.scene.campaign import ControlSettings

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

# relative to the distance: above the rounding of its sum, below any step
_SAME_PLACE = 1e-9
_NO_CRACK = 1e-9  # depth of a crack that is rounding [m]
# largest share of the distance since the last reprofiling that is run beyond a limit
_LATE = 0.01


def reprofiling_due(
    state: State, setup: CampaignSetup, measures: Mapping[str, np.ndarray]
) -> bool:
    """Return True if the wheels are reprofiled before the next step.

    Reprofiling takes place at a given distance or where the measures of the state, from
    `row.recorded_measures`, meet a limit, but never directly after another.
    """
    rules = setup.control.reprofiling
    if rules is None or state.reprofiled == state.step > 0:
        return False
    if any(
        abs(state.distance - place) <= _SAME_PLACE * place for place in rules.places
    ):
        return True
    limits = _limits(setup)
    laws = [fatigue.law for fatigue in setup.fatigue]
    return bool(limits) and first_met(measures, limits, laws) is not None


def _limits(setup: CampaignSetup) -> dict[str, float]:
    """Limits at which wheels are reprofiled, by measure [SI]."""
    rules = setup.control.reprofiling
    names = () if rules is None else rules.limits
    return {name: value for name, value in setup.control.limits if name in names}


def late(
    state: State,
    length: float,
    measures: Sequence[Mapping[str, np.ndarray]],
    setup: CampaignSetup,
) -> float | None:
    """Length of a step that ends at a limit of reprofiling [m], of one that is late.

    None if the step meets no limit, or goes beyond it by at most 1 % of the distance
    since the last reprofiling.

    Parameters
    ----------
    state : State
        Before the step.
    length : float
        Of the step [m].
    measures : sequence of mapping
        `row.recorded_measures` before and after the step; the place of the limit is
        interpolated linearly between them.

    Notes
    -----
    The shorter step aims half as far beyond the limit as is allowed, since a step that
    ends just before it is followed by another. A step of whole loops of a programme
    becomes one of fewer whole loops.
    """
    limits, laws = _limits(setup), [fatigue.law for fatigue in setup.fatigue]
    before, after = measures
    if not limits or first_met(before, limits, laws) is not None:
        return None
    at = first_distance(np.array([0.0, length]), (before, after), limits, laws)
    if at is None:
        return None
    allowed = _LATE * (state.distance + at - state.reprofiled_at)
    shorter, loop = at + 0.5 * allowed, float(setup.points.block_length.sum())
    if 0.0 < loop <= length * (1.0 + _SAME_PLACE):
        shorter = loop * math.ceil(shorter / loop - _SAME_PLACE)
    too_long = length - at > allowed and shorter < length * (1.0 - _SAME_PLACE)
    return shorter if too_long else None


def reprofile(state: State, setup: CampaignSetup) -> State:
    """Reprofile both wheels to their templates and one diameter at the least loss.

    Returns
    -------
    State
        Next step, at the same distance. Heights keep the axes of the new wheel:
        :math:`r_0 + z` is the rolling radius. Depth restarts at 0, fatigue damage at
        the cracks left; worn area and mass are kept.
    """
    rules = setup.control.reprofiling
    if setup.templates is None or rules is None:
        raise ValueError("wheels are reprofiled only where the scene has a template")
    worn = worn_wheels(setup.wheelset, state.y, state.z)
    cracks = (
        _cracks(state, setup)
        if "fatigue_damage" in rules.limits
        else np.zeros_like(state.y)
    )
    right, left = (
        _sound(wheel, crack) for wheel, crack in zip(worn, cracks, strict=True)
    )
    wheels = [
        reprofiled_wheel.profile
        for reprofiled_wheel in reprofile_axle(right, left, setup.templates)
    ]
    y = np.stack([wheel.y for wheel in wheels])
    z = np.stack([wheel.z for wheel in wheels]) - rules.cut
    names = ("wear_depth", "regime_depth", "active_weight", "point_length")
    restarted: dict[str, Any] = {
        name: np.zeros_like(getattr(state, name)) for name in names
    }
    return replace(
        state,
        **restarted,
        step=state.step + 1,
        reprofiled=state.step + 1,
        reprofiled_at=state.distance,
        y=y,
        z=z,
        comparison_depth=tuple(
            np.zeros_like(depth) for depth in state.comparison_depth
        ),
        fatigue_damage=_damage_left(
            state, setup, worn, worn_wheels(setup.wheelset, y, z)
        ),
        counterface=None
        if state.counterface is None
        else without_step(state.counterface),
    )


def _cracks(state: State, setup: CampaignSetup) -> FloatArray:
    """Depth of the deepest crack at each point (2, n) [m].

    It is given by the laws that count cycles and state a crack depth.
    """
    depth = np.zeros_like(state.y)
    for law, damage in zip(setup.fatigue, state.fatigue_damage, strict=True):
        if counts_cycles(law.law) and law.crack_depth is not None:
            depth = np.maximum(depth, law.crack_depth * damage)
    return depth


def _sound(wheel: Profile, crack: FloatArray) -> Profile:
    """Wheel contour without the cracked material.

    It may be folded; the cut stays below all of it.
    """
    normal_y, normal_z = vertex_normals(wheel.y, wheel.z)
    return replace(wheel, y=wheel.y + crack * normal_y, z=wheel.z + crack * normal_z)


def _damage_left(
    state: State,
    setup: CampaignSetup,
    worn: tuple[Profile, Profile],
    reprofiled: tuple[Profile, Profile],
) -> tuple[FloatArray, ...]:
    """Damage of each law at the points of the reprofiled wheels, (2, n) each."""
    left = [np.zeros_like(state.y) for _ in state.fatigue_damage]
    depths = comparison_laws(setup).crack_depth
    if not np.isfinite(depths).any():
        return tuple(left)
    for side, (before, after) in enumerate(zip(worn, reprofiled, strict=True)):
        reach = max(LARGEST_DEPTH, 2.0 * float(before.z.max() - after.z.max()))
        cut, place = cut_along_normals(
            before, after, *vertex_normals(before.y, before.z), reach
        )
        met = np.flatnonzero(
            np.isfinite(place)
        )  # except for a few points at the ends, outside the contact
        met = met[np.argsort(place[met], kind="stable")]
        arc = arc_length(after.y, after.z)
        at = np.interp(place[met], np.arange(arc.size), arc)
        for damage, damage_before, depth in zip(
            left, state.fatigue_damage, depths, strict=True
        ):
            if np.isfinite(depth):
                crack = depth * damage_before[side, met] - np.maximum(cut[met], 0.0)
                damage[side] = np.interp(
                    arc, at, np.where(crack > _NO_CRACK, crack, 0.0) / depth
                )
    return tuple(left)


def to_next_reprofiling(state: State, control: ControlSettings) -> ControlSettings:
    """Return the settings with which steps end at the next prescribed reprofiling."""
    places = () if control.reprofiling is None else control.reprofiling.places
    ahead = [place for place in places if place > state.distance * (1.0 + _SAME_PLACE)]
    return replace(control, distance=min([control.distance, *ahead]))
