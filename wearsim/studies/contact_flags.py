"""Flags of `wearsim contact`, alike as columns of its table: one light table, read by `--help` too."""

from __future__ import annotations

from typing import NamedTuple

from wearsim.quantities import QUANTITIES


class Flag(NamedTuple):
    """One flag. As a column of a table it has underscores for dashes."""

    name: str
    default: str | None
    meaning: str
    group: str
    kind: str
    quantity: str = ""  # whose unit and range hold

    @property
    def column(self) -> str:
        """Name as a column."""
        return self.name.replace("-", "_")

    @property
    def field(self) -> str:
        """Name in a `Request` of `contact_points`, of the quantity without its unit."""
        units = ("_mm", "_mrad", "_kN", "_km_h", "_GPa", "_m")
        unit = next((unit for unit in units if self.column.endswith(unit)), "")
        return self.column.removesuffix(unit)

    @property
    def factor(self) -> float:
        """Factor from the unit of the flag to SI."""
        shown = QUANTITIES[self.quantity].shown_factor
        return 1.0 / shown if shown >= 1.0 else float(round(1.0 / shown))

    @property
    def low(self) -> float:
        """Lowest value."""
        return -self.high if self.kind == "curve" else QUANTITIES[self.quantity].span[0]

    @property
    def high(self) -> float:
        """Highest value."""
        return QUANTITIES[self.quantity].span[1]


_BODIES, _MOTION, _MODELS = "wheelset and counterface", "motion and load", "models"

FLAGS = (
    Flag("wheel", "S1002", "wheel profile, name or file", _BODIES, "name"),
    Flag("left-wheel", None, "profile of the left wheel, if it differs", _BODIES, "name"),
    Flag("rail", "60E1", "rail or roller profile, name or file", _BODIES, "name"),
    Flag("inclination", "1:40", "of the rail, 1:N or none", _BODIES, "inclination"),
    Flag("gauge-mm", "1435", "gauge, 14 mm below the top", _BODIES, "number", "gauge"),
    Flag("back-to-back-mm", "1360", "back-to-back distance of the wheels", _BODIES, "number", "back_to_back"),
    Flag("wheel-radius-mm", "460", "wheel radius at the running circle", _BODIES, "number", "wheel_radius"),
    Flag("smooth-mm", None, "take waves shorter than this out of profiles from files", _BODIES, "number",
         "noise_wavelength"),
    Flag("roller-radius-mm", None, "roller radius at its top; without it: rail", _BODIES, "number",
         "roller_radius"),
    Flag("curve-radius-m", None, "curve radius, positive to the right; without it: tangent", _BODIES, "curve",
         "curve_radius"),
    Flag("shift-mm", "0", "lateral shift of the wheelset, positive to the right", _MOTION, "number", "shift"),
    Flag("yaw-mrad", "0", "yaw of the wheelset, positive to the right", _MOTION, "number", "yaw"),
    Flag("roll", None, "roll of the wheelset in mrad, right side down positive, or free: it rests on both "
         "wheels (default free with --side both, else 0)", _MOTION, "roll", "roll"),
    Flag("wheel-load-kN", "80", "vertical load of each wheel", _MOTION, "number", "wheel_load"),
    Flag("wheel-load-right-kN", None, "instead of the wheel load: that of the right wheel", _MOTION, "number",
         "wheel_load"),
    Flag("wheel-load-left-kN", None, "instead of the wheel load: that of the left wheel", _MOTION, "number",
         "wheel_load"),
    Flag("axle-load-kN", None, "instead of the wheel load: that of both wheels, shared as the roll of the "
         "axle asks for", _MOTION, "number", "axle_load"),
    Flag("lateral-force-kN", None, "instead of the shift: lateral force at axle height, positive to the "
         "right", _MOTION, "number", "lateral_force"),
    Flag("normal-force-kN", None, "instead of the wheel load: normal force of the single patch of each wheel",
         _MOTION, "number", "normal_force"),
    Flag("friction", "0.35", "friction coefficient", _MOTION, "number", "friction"),
    Flag("friction-flange", None, "friction coefficient on the flange, if it differs", _MOTION, "number",
         "friction_flange"),
    Flag("speed-km-h", "72", "speed", _MOTION, "number", "speed"),
    Flag("rotation", "free", "rotation speed: free (axle torque balance of both wheels), centred, nominal, "
         "or rad/s", _MOTION, "rotation", "rotation_speed"),
    Flag("creepage", None, "instead of the rotation: given creepages XI_X,XI_Y,SPIN (spin in 1/m) of the "
         "single patch of one wheel", _MOTION, "creepage"),
    Flag("side", "right", "which wheel: right, left or both", _MOTION, "side"),
    Flag("normal", "kik_piotrowski", "normal contact model", _MODELS, "model"),
    Flag("tangential", "fastsim", "tangential contact model", _MODELS, "model"),
    Flag("youngs-GPa", "210", "Young's modulus of both bodies", _MODELS, "number", "youngs_modulus"),
    Flag("poisson", "0.3", "Poisson's ratio of both bodies", _MODELS, "number", "poisson_ratio"),
    Flag("strips", "30", "smallest number of strips across a patch", _MODELS, "count", "strips"),
    Flag("cells", "30", "smallest number of cells along each strip", _MODELS, "count", "cells"),
    Flag("cell-mm", "0.5", "largest width of a strip and length of a cell", _MODELS, "number", "cell_size"),
    Flag("most-cells", "120", "largest number of strips and of cells", _MODELS, "count", "most_cells"),
)  # fmt: skip

COLUMNS = {flag.column: flag for flag in FLAGS}
"""Flags by their name as a column."""
