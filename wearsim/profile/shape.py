"""A cross-section as an ordered list of points."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """Cross-section of a wheel, or of a rail or roller, as points ordered by arc length.

    Parameters
    ----------
    name : str
        What the user calls it.
    kind : {"wheel", "rail"}
        Which convention `z` follows.
    y : (n,) array
        Lateral position [m]; from the wheel profile's origin line, positive to the field side.
        Points run from the flange back (wheel) or the gauge side (rail) to the field side.
    z : (n,) array
        Wheel: positive radially outward, 0 at the tape circle; rail: positive down, 0 at the top [m].
    source : str
        Where the shape comes from.
    """

    name: str
    kind: Literal["wheel", "rail"]
    y: FloatArray = field(repr=False)
    z: FloatArray = field(repr=False)
    source: str = ""
