"""Wheels of S1002 as campaigns of forces left them."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.profile import standard

DATA = Path(__file__).parents[1] / "data"


def worn_wheels(place):
    """Right and left wheel, worn on the "flank", in the "fold" or to the "gauge" face.

    The first two had noise when new; the third ran 85 000 km under a multiple unit.
    """
    new = standard.wheel("S1002")
    with np.load(DATA / f"operation_worn_{place}.npz") as worn:
        return [
            replace(new, y=y, z=z)
            for y, z in zip(worn["wheel_y"], worn["wheel_z"], strict=True)
        ]
