"""Operating points of `wearsim contact`: fields are flags, alike columns of its tables.

Only light modules are imported: `--help` reads this one, too.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Flag(NamedTuple):
    """Flag of an operating point; as a column it has underscores for dashes."""

    name: str
    meaning: str
    default: str | None
    quantity: str  # whose unit and range hold, "" of words

    @property
    def column(self) -> str:
        """Name as a column."""
        return self.name.replace("-", "_")


def flag(
    name: str, meaning: str, default: str | None = None, quantity: str = ""
) -> Any:
    """Field of an operating point, of which this is the flag."""
    return Flag(name, meaning, default, quantity)


class Bodies:
    """Wheelset and counterface."""

    wheel: str = flag("wheel", "wheel profile, name or file", "S1002")
    left_wheel: str | None = flag(
        "left-wheel", "profile of the left wheel, if it differs"
    )
    rail: str = flag("rail", "rail or roller profile, name or file", "60E1")
    inclination: float = flag("inclination", "of the rail, 1:N or none", "1:40")
    gauge: float = flag("gauge-mm", "gauge", "1435", "gauge")
    gauge_height: float = flag(
        "gauge-height-mm",
        "depth below the top of the rail at which the gauge is measured; 15.875 in "
        "North America",
        "14",
        "gauge_height",
    )
    back_to_back: float = flag(
        "back-to-back-mm", "back-to-back distance of the wheels", "1360", "back_to_back"
    )
    wheel_radius: float = flag(
        "wheel-radius-mm", "wheel radius at the running circle", "460", "wheel_radius"
    )
    smooth: float | None = flag(
        "smooth-mm",
        "take waves shorter than this out of profiles from files",
        quantity="noise_wavelength",
    )
    roller_radius: float | None = flag(
        "roller-radius-mm",
        "roller radius at its top; without it: rail",
        quantity="roller_radius",
    )
    roller_radius_left: float | None = flag(
        "roller-radius-left-mm",
        "that of the left roller, if it differs; both turn alike",
        quantity="roller_radius",
    )
    rail_ends: str = flag(
        "rail-ends",
        "whether a rail or roller goes on beyond the points of its file (open) or ends "
        "there, as a disc does (sharp)",
        "open",
    )
    curve_radius: float | None = flag(
        "curve-radius-m",
        "curve radius, positive to the right; without it: tangent",
        quantity="curve_radius",
    )


class Motion:
    """Motion and load of the wheelset."""

    shift: float = flag(
        "shift-mm", "lateral shift of the wheelset, positive to the right", "0", "shift"
    )
    yaw: float = flag(
        "yaw-mrad", "yaw of the wheelset, positive to the right", "0", "yaw"
    )
    roll: float | str | None = flag(
        "roll",
        "roll of the wheelset in mrad, right side down positive, or free: it rests on "
        "both wheels (default free with --side both, else 0)",
        quantity="roll",
    )
    wheel_load: float = flag(
        "wheel-load-kN", "vertical load of each wheel", "80", "wheel_load"
    )
    wheel_load_right: float | None = flag(
        "wheel-load-right-kN",
        "instead of the wheel load: that of the right wheel",
        quantity="wheel_load",
    )
    wheel_load_left: float | None = flag(
        "wheel-load-left-kN",
        "instead of the wheel load: that of the left wheel",
        quantity="wheel_load",
    )
    axle_load: float | None = flag(
        "axle-load-kN",
        "instead of the wheel load: that of both wheels, shared as the roll of the "
        "axle asks for",
        quantity="axle_load",
    )
    lateral_force: float | None = flag(
        "lateral-force-kN",
        "instead of the shift: lateral force at axle height, positive to the right",
        quantity="lateral_force",
    )
    normal_force: float | None = flag(
        "normal-force-kN",
        "instead of the wheel load: normal force of the single patch of each wheel",
        quantity="normal_force",
    )
    friction: float = flag("friction", "friction coefficient", "0.35", "friction")
    friction_flange: float | None = flag(
        "friction-flange",
        "friction coefficient on the flange, if it differs",
        quantity="friction_flange",
    )
    speed: float = flag("speed-km-h", "speed", "72", "speed")
    rotation: float | str = flag(
        "rotation",
        "rotation speed: free (axle torque balance of both wheels), independent "
        "(torque balance of each wheel), centred, nominal, or rad/s",
        "free",
        "rotation_speed",
    )
    torque: float = flag(
        "torque-Nm",
        "torque on the axle, driving forward; independent wheels have half of it each",
        "0",
        "axle_torque",
    )
    creepage: tuple[float, ...] | None = flag(
        "creepage",
        "instead of the rotation: given creepages XI_X,XI_Y,SPIN (spin in 1/m) of the "
        "single patch of one wheel",
    )
    side: str = flag("side", "which wheel: right, left or both", "right")


class Models:
    """Models of the contact."""

    model: str | None = flag(
        "model", "contact models: fast, standard or accurate", "standard"
    )
    normal: str = flag("normal", "normal contact model, instead of that of the model")
    tangential: str = flag(
        "tangential", "tangential contact model, instead of that of the model"
    )
    youngs_modulus: float = flag(
        "youngs-GPa", "Young's modulus of both bodies", "210", "youngs_modulus"
    )
    poisson_ratio: float = flag(
        "poisson", "Poisson's ratio of both bodies", "0.3", "poisson_ratio"
    )
    kalker_factor: float = flag(
        "kalker-factor",
        "creep stiffness over that of clean surfaces, below 1 if contaminated",
        "1",
        "kalker_factor",
    )
    friction_ratio: float = flag(
        "friction-ratio",
        "friction coefficient at large slip velocity over that at rest, A",
        "1",
        "friction_ratio",
    )
    friction_decrease: float = flag(
        "friction-decrease-s-m",
        "coefficient B of its exponential decrease with the slip velocity V: friction "
        "x ((1 - A) exp(-B V) + A)",
        "0",
        "friction_decrease",
    )
    strips: int = flag(
        "strips", "smallest number of strips across a patch", "30", "strips"
    )
    cells: int = flag(
        "cells", "smallest number of cells along each strip", "30", "cells"
    )
    cell_size: float = flag(
        "cell-mm", "largest width of a strip and length of a cell", "0.5", "cell_size"
    )
    most_cells: int = flag(
        "most-cells", "largest number of strips and of cells", "120", "most_cells"
    )


GROUPS: dict[str, type] = {
    "wheelset and counterface": Bodies,
    "motion and load": Motion,
    "models": Models,
}
"""Fields of an operating point by the title that their flags have in the help."""


def flags_of(*parts: type) -> dict[str, Flag]:
    """Return flags by the name of their field, in the order of the help."""
    given = ((name, value) for part in parts for name, value in vars(part).items())
    return {name: value for name, value in given if isinstance(value, Flag)}


FLAGS = flags_of(*GROUPS.values())
"""All flags by the name of their field."""

COLUMNS = {flag.column: flag for flag in FLAGS.values()}
"""Flags by their name as a column."""

MATCHED = ("max_pressure", "wear_number", "place")
"""Quantities of a contact that can be matched on a rig."""
