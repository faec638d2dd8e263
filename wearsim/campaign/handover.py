"""Operating points that the reference solves in all stages, where correcting fast models would cost more."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.state import Correction, State
from wearsim.contact.patch import FloatArray

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

_AGAIN = 3.0
"""Further depth, over the present one or over that of a step of the reference, until it gives points back."""

_FEW = 6
"""Points up to which the reference solves all at first: hardly any of them could wait."""


class ReferenceStep(NamedTuple):
    """A step in which the reference solves all points, as long as its stability allows."""

    length: float  # [m]
    depth: float  # [m]
    model: int  # number of the reference in the chain of models


def handed_over(
    state: State, weight: FloatArray, corrected: float, own: ReferenceStep, short: NDArray[np.bool_]
) -> State:
    """Let the reference solve the acting points in all stages where that costs less, or no longer.

    Parameters
    ----------
    state : State
        Where a corrected step ends, or begins.
    weight : (n,) array
        Share of the step that each point acts for.
    corrected : float
        Length with which a step after which all points are solved would keep the tolerance at the depth after
        a step of the reference, or infinite [m].
    own : ReferenceStep
        Compared as if it solved all points twice.
    short : (n,) bool array
        Points that the reference solves in steps whose error leaves them shorter than corrected ones.
    """
    old = state.correction
    assert old is not None
    deepest = float(state.wear_depth.max())
    alone, over = old.until > 0.0, deepest >= np.abs(old.until)
    back = alone & (over | short)
    solvable = old.max_pressure.max(axis=1) > 0.0
    taken = (weight > 0.0) & ~alone & over & solvable & (2.0 * corrected < own.length)
    if not (back | taken).any():
        return state
    until, lengths = deepest + _AGAIN * max(deepest, own.depth), old.length.copy()
    lengths[taken] = weight[taken] * corrected
    lengths[back & (lengths == 0.0)] = math.inf  # of few points
    depths = np.where(taken, until, np.where(back, np.where(over, 0.0, -until), old.until))
    given_back = replace(
        old,
        model=np.where(back, 0, old.model),
        step=np.where(back, -1, old.step),
        drift=np.where(back, math.inf, old.drift),
    )
    return replace(state, correction=_taken(given_back, taken, own.model, depths, lengths))


def few_handed_over(state: State, setup: CampaignSetup) -> State:
    """Let the reference solve few points in all stages as long as their wear is not deep.

    Corrected steps are as short then as the tolerance of little depth asks for. A single point is never given
    back: it could not wait for others.
    """
    old, acts = state.correction, setup.points.weight > 0.0
    if old is None or setup.tolerance is None or acts.sum() > _FEW or setup.points.controlled is not None:
        return state
    # where a step of the reference alone may err by the tolerance of the depth
    until = setup.control.error_tolerance / setup.tolerance if acts.sum() > 1 else math.inf
    taken = acts & (old.max_pressure.max(axis=1) > 0.0)
    lengths = np.where(taken, 0.0, old.length)
    new = _taken(old, taken, len(setup.fallbacks), np.where(taken, until, 0.0), lengths)
    return replace(state, correction=new)


def _taken(
    old: Correction, taken: NDArray[np.bool_], reference: int, until: FloatArray, length: FloatArray
) -> Correction:
    """Correction after the reference, of that number in the chain of models, has taken points (n,) over."""
    differences = {name: getattr(old, name).copy() for name in ("wheel", "below")}
    for values in differences.values():
        values[taken] = 0.0
    return replace(
        old, **differences, forces=old.forces.of(~taken), until=until, length=length,
        model=np.where(taken, reference, old.model),
    )  # fmt: skip
