"""What the result file keeps of a counterface that wears, and the way back to its state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign.state import CounterfaceState
from wearsim.operation.counterface import CounterfaceWear

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


def static_below(setup: CampaignSetup) -> dict[str, Any]:
    """Return the static variables of a result file whose counterface wears."""
    if setup.counterface_wear is None:
        return {}
    kind = "roller" if setup.kind == "rig" else "rail"
    return {"counterface_name": (f"right {kind}", f"left {kind}")}


def attributes_below(settings: CounterfaceWear | None) -> dict[str, float]:
    """Return the global attributes that tell how the counterface wears [SI]."""
    if settings is None:
        return {}
    given = {
        "counterface_wear_factor": settings.factor,
        "counterface_area_rate": settings.area_rate,
        "redress_distance": settings.redress_distance,
        "redress_depth": settings.redress_depth,
    }
    return {name: value for name, value in given.items() if 0.0 < value < math.inf}


def row_below(state: CounterfaceState | None) -> dict[str, np.ndarray]:
    """Return the variables of one row that belong to a counterface that wears [SI units].

    Parameters
    ----------
    state : CounterfaceState or None
        None gives none of them.
    """
    if state is None:
        return {}
    return {
        "counterface_profile_y": state.y,
        "counterface_profile_z": state.z,
        "counterface_wear_depth": state.last_depth,
        "counterface_worn_area": state.worn_area,
        "counterface_max_wear_depth": state.last_depth.max(axis=1),
        "counterface_redressed_depth": state.turned_depth,
        "counterface_redressed_count": np.asarray(state.turnings, dtype=np.int32),
        "counterface_redressed_at": np.asarray(state.turned_at),
    }


def counterface_of(row: Mapping[str, np.ndarray]) -> CounterfaceState | None:
    """Return the state of the counterface that a row holds, bit by bit; None if it does not wear.

    Parameters
    ----------
    row : mapping of arrays
        Row of the result file.
    """
    if "counterface_profile_y" not in row:
        return None
    depth, turnings = row["counterface_wear_depth"], int(row["counterface_redressed_count"])
    just_turned = turnings > 0 and row["counterface_redressed_at"] == row["distance"]
    return CounterfaceState(
        y=row["counterface_profile_y"],
        z=row["counterface_profile_z"],
        depth=np.zeros_like(depth) if just_turned else depth,
        worn_area=row["counterface_worn_area"],
        last_depth=depth,
        turned_depth=row["counterface_redressed_depth"],
        turnings=turnings,
        turned_at=float(row["counterface_redressed_at"]),
    )
