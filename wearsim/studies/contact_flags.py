"""Flags of `wearsim contact`, alike as columns of its table: one light table, read by `--help` too."""

from __future__ import annotations

import re
from typing import NamedTuple


class Flag(NamedTuple):
    """One flag. As a column of a table it has underscores for dashes."""

    name: str
    default: str | None
    meaning: str
    group: str
    quantity: str = ""  # whose unit and range hold

    @property
    def column(self) -> str:
        """Name as a column."""
        return self.name.replace("-", "_")

    @property
    def field(self) -> str:
        """Name in a `Request` of `contact_points`: without unit; that of the quantity for models."""
        if self.group == MODELS:
            return self.quantity or self.column
        return re.sub("_(mm|mrad|kN|km_h|GPa|m)$", "", self.column)


_BODIES, MOTION, MODELS = "wheelset and counterface", "motion and load", "models"

FLAGS = (
    Flag("wheel", "S1002", "wheel profile, name or file", _BODIES),
    Flag("left-wheel", None, "profile of the left wheel, if it differs", _BODIES),
    Flag("rail", "60E1", "rail or roller profile, name or file", _BODIES),
    Flag("inclination", "1:40", "of the rail, 1:N or none", _BODIES),
    Flag("gauge-mm", "1435", "gauge", _BODIES, "gauge"),
    Flag("gauge-height-mm", "14", "depth below the top of the rail at which the gauge is measured; 15.875 in "
         "North America", _BODIES, "gauge_height"),
    Flag("back-to-back-mm", "1360", "back-to-back distance of the wheels", _BODIES, "back_to_back"),
    Flag("wheel-radius-mm", "460", "wheel radius at the running circle", _BODIES, "wheel_radius"),
    Flag("smooth-mm", None, "take waves shorter than this out of profiles from files", _BODIES,
         "noise_wavelength"),
    Flag("roller-radius-mm", None, "roller radius at its top; without it: rail", _BODIES, "roller_radius"),
    Flag("roller-radius-left-mm", None, "that of the left roller, if it differs; both turn alike", _BODIES,
         "roller_radius"),
    Flag("curve-radius-m", None, "curve radius, positive to the right; without it: tangent", _BODIES,
         "curve_radius"),
    Flag("shift-mm", "0", "lateral shift of the wheelset, positive to the right", MOTION, "shift"),
    Flag("yaw-mrad", "0", "yaw of the wheelset, positive to the right", MOTION, "yaw"),
    Flag("roll", None, "roll of the wheelset in mrad, right side down positive, or free: it rests on both "
         "wheels (default free with --side both, else 0)", MOTION, "roll"),
    Flag("wheel-load-kN", "80", "vertical load of each wheel", MOTION, "wheel_load"),
    Flag("wheel-load-right-kN", None, "instead of the wheel load: that of the right wheel", MOTION,
         "wheel_load"),
    Flag("wheel-load-left-kN", None, "instead of the wheel load: that of the left wheel", MOTION,
         "wheel_load"),
    Flag("axle-load-kN", None, "instead of the wheel load: that of both wheels, shared as the roll of the "
         "axle asks for", MOTION, "axle_load"),
    Flag("lateral-force-kN", None, "instead of the shift: lateral force at axle height, positive to the "
         "right", MOTION, "lateral_force"),
    Flag("normal-force-kN", None, "instead of the wheel load: normal force of the single patch of each wheel",
         MOTION, "normal_force"),
    Flag("friction", "0.35", "friction coefficient", MOTION, "friction"),
    Flag("friction-flange", None, "friction coefficient on the flange, if it differs", MOTION,
         "friction_flange"),
    Flag("speed-km-h", "72", "speed", MOTION, "speed"),
    Flag("rotation", "free", "rotation speed: free (axle torque balance of both wheels), centred, nominal, "
         "or rad/s", MOTION, "rotation_speed"),
    Flag("creepage", None, "instead of the rotation: given creepages XI_X,XI_Y,SPIN (spin in 1/m) of the "
         "single patch of one wheel", MOTION),
    Flag("side", "right", "which wheel: right, left or both", MOTION),
    Flag("normal", "kik_piotrowski", "normal contact model", MODELS),
    Flag("tangential", "fastsim", "tangential contact model", MODELS),
    Flag("youngs-GPa", "210", "Young's modulus of both bodies", MODELS, "youngs_modulus"),
    Flag("poisson", "0.3", "Poisson's ratio of both bodies", MODELS, "poisson_ratio"),
    Flag("strips", "30", "smallest number of strips across a patch", MODELS, "strips"),
    Flag("cells", "30", "smallest number of cells along each strip", MODELS, "cells"),
    Flag("cell-mm", "0.5", "largest width of a strip and length of a cell", MODELS, "cell_size"),
    Flag("most-cells", "120", "largest number of strips and of cells", MODELS, "most_cells"),
)  # fmt: skip

COLUMNS = {flag.column: flag for flag in FLAGS}
"""Flags by their name as a column."""
