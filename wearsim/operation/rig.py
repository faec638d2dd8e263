"""Operating points of a roller rig: the blocks of its programme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.contact.solve import ContactConditions
from wearsim.operation.points import OperatingPoints


@dataclass(frozen=True)
class Block:
    """One block of a rig programme: the wheelset runs like this for a while.

    Parameters
    ----------
    name : str
        For tables and figures.
    shift : float
        Lateral shift of the wheelset, positive to the right [m].
    wheel_load : float
        Vertical load of each wheel [N].
    speed : float
        Peripheral speed of the rollers [m/s].
    friction : float
        Coulomb coefficient [-].
    distance : float
        Length of the block in one loop of the programme [m].
    yaw, roll : float
        [rad]
    environment : float
        Factor on the wear depth [-].
    """

    name: str
    shift: float
    wheel_load: float
    speed: float
    friction: float
    distance: float
    yaw: float = 0.0
    roll: float = 0.0
    environment: float = 1.0


def programme(
    blocks: Sequence[Block], *, rotation: str = "free", torque: float = 0.0, free_roll: bool = False
) -> OperatingPoints:
    """Operating points of a programme whose blocks are looped until the campaign's distance is run.

    Parameters
    ----------
    blocks : sequence of Block
        In the order in which they are run, at least one.
    rotation : str
        Rule of the wheels' rotation speed.
    torque : float
        On the axle [N m].
    free_roll : bool
        Whether the wheelset rests on both wheels; its roll is then the first guess only.

    Returns
    -------
    OperatingPoints
        One point per block; its weight is its share of the loop, its track curvature 0.
    """
    distance = np.array([block.distance for block in blocks], dtype=np.float64)
    if distance.size == 0 or not np.all(distance > 0):
        raise ValueError("a programme needs blocks, each with a distance above 0")
    conditions = ContactConditions(
        shift=np.array([block.shift for block in blocks], dtype=np.float64),
        yaw=np.array([block.yaw for block in blocks], dtype=np.float64),
        roll=np.array([block.roll for block in blocks], dtype=np.float64),
        wheel_load=np.array([block.wheel_load for block in blocks], dtype=np.float64),
        speed=np.array([block.speed for block in blocks], dtype=np.float64),
        friction=np.array([block.friction for block in blocks], dtype=np.float64),
        track_curvature=np.zeros(distance.size),
        rotation=rotation,
        torque=torque,
        free_roll=free_roll,
    )
    return OperatingPoints(
        conditions=conditions,
        weight=distance / distance.sum(),
        environment=np.array([block.environment for block in blocks], dtype=np.float64),
        block_length=distance,
        label=tuple(block.name for block in blocks),
    )
