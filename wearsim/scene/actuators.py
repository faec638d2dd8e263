"""Actuators of a rig: ranges of the set-points that reproduce a contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from wearsim.errors import Fault, raise_any
from wearsim.quantities import QUANTITIES
from wearsim.scene.models import RigScene
from wearsim.scene.programme import ProgrammeSection
from wearsim.scene.rig import RigFile
from wearsim.scene.set_points import (
    TORQUES,
    beyond_rig,
    common_values,
    flange_clearance,
    rig_of,
    running_of,
    section_of,
    without_clearance,
)

Span = tuple[float, float]

_FIFTH = 0.2  # of the largest load: the smallest one where the scene states none


@dataclass(frozen=True)
class Actuator:
    """Range of the set-points of an actuator; one value where it is not controlled."""

    name: str
    low: float
    high: float
    end: str  # what ends the range: the rig, the flange or the scene
    controlled: bool = True
    widest: Span | None = None  # that an actuator of more range could have; by default
    # what its quantity allows


@dataclass(frozen=True)
class Actuators:
    """Actuators of a rig, and what its blocks state of all set-points."""

    rig: str  # name of the rig
    ranges: tuple[Actuator, ...]  # shift, yaw, wheel load, speed difference
    speed: float  # [m/s]
    friction: float  # [-]
    friction_flange: float | None  # [-]
    torque: float  # on the axle [N m]
    torque_difference: float  # right less left wheel [N m]


def actuators(scene: RigScene) -> Actuators:
    """Actuators of the rig of a scene, within the limits of its file.

    Values that [programme] states end a range, too. The flange clearance ends that of
    the shift where neither does.

    Raises
    ------
    SceneError
        With all faults: values beyond the limits of the rig, blocks of unlike friction,
        or wheels without flange clearance where no largest shift is stated.
    """
    section, rig = section_of(scene), rig_of(scene)
    faults: list[Fault] = []
    speed, friction = running_of(scene, section, rig, faults)
    stated = common_values(scene, (*TORQUES, "friction_flange"), faults)
    ranges = (
        _shift(scene, section, rig, faults),
        _yaw(scene, section, rig, faults),
        _load(scene, section, rig, faults),
        _speed_difference(scene, rig),
    )
    raise_any(faults)
    name = scene.origin.path.stem if rig is None else rig.name
    torque, difference = _torques(scene, stated)
    return Actuators(
        str(name),
        ranges,
        speed,
        friction,
        stated.get("friction_flange"),
        torque,
        difference,
    )


def _torques(scene: RigScene, stated: Mapping[str, float]) -> tuple[float, float]:
    """Torque on the axle, and right less left wheel [N m], by keys of blocks."""
    on_axle, on_right, on_left = TORQUES
    if on_right in stated:
        right, left = 1e3 * stated[on_right], 1e3 * stated[on_left]
        return right + left, right - left
    default = 1e-3 * scene.contact.torque_Nm
    return 1e3 * stated.get(on_axle, default), 0.0


def _shift(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> Actuator:
    """Range of the shift [m]."""
    if rig is not None and "shift_mm" not in rig.controlled:
        if "lateral_force_kN" in rig.controlled:
            text = (
                f"the rig {rig.name} controls lateral_force_kN in place of shift_mm; "
                "set-points are searched by shift alone: take a rig that controls it"
            )
            faults.append(scene.fault(("counterface", "rig"), text))
        return Actuator("shift", 0.0, 0.0, "rig", False, _clearances(scene))
    stated = None if section.shift_mm is None else abs(section.shift_mm)
    limit = None if rig is None else rig.limits.shift_mm
    clearance = flange_clearance(scene)
    if stated is None and limit is None and clearance is None:
        faults.append(without_clearance(scene))
        return Actuator("shift", 0.0, 0.0, "scene")
    (low, high), end = _range(
        scene,
        "shift_mm",
        stated=None if stated is None else (-stated, stated),
        of_rig=None if limit is None else (-limit, limit),
        otherwise=((-(clearance or 0.0), clearance or 0.0), "flange"),
        faults=faults,
    )
    return Actuator("shift", 1e-3 * low, 1e-3 * high, end, widest=_clearances(scene))


def _clearances(scene: RigScene) -> Span | None:
    """Shifts within the flange clearance [m], None without flanges."""
    clearance = flange_clearance(scene)
    return None if clearance is None else (-1e-3 * clearance, 1e-3 * clearance)


def _yaw(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> Actuator:
    """Range of the yaw [rad]."""
    if rig is not None and "yaw_mrad" not in rig.controlled:
        return Actuator("yaw", 0.0, 0.0, "rig", controlled=False)
    limit = None if rig is None else rig.limits.yaw_mrad
    values = min(section.yaws_mrad), max(section.yaws_mrad)
    (low, high), end = _range(
        scene,
        "yaws_mrad",
        stated=values if "yaws_mrad" in section.model_fields_set else None,
        of_rig=None if limit is None else (-limit, limit),
        otherwise=(values, "scene"),
        faults=faults,
    )
    return Actuator("yaw", 1e-3 * low, 1e-3 * high, end)


def _load(
    scene: RigScene,
    section: ProgrammeSection,
    rig: RigFile | None,
    faults: list[Fault],
) -> Actuator:
    """Range of the load of a wheel [N]."""
    limit = None if rig is None else rig.limits.load_kN
    values = min(section.loads_kN), max(section.loads_kN)
    (low, high), end = _range(
        scene,
        "loads_kN",
        stated=values if "loads_kN" in section.model_fields_set else None,
        of_rig=None if limit is None else (min(values[0], _FIFTH * limit), limit),
        otherwise=(values, "scene"),
        faults=faults,
    )
    return Actuator("wheel_load", 1e3 * low, 1e3 * high, end)


def _range(
    scene: RigScene,
    key: str,
    *,
    stated: Span | None,
    of_rig: Span | None,
    otherwise: tuple[Span, str],
    faults: list[Fault],
) -> tuple[Span, str]:
    """Return the ends of a range in the unit of its key, and what ends it.

    The first that is given: what [programme] states, a fault beyond the rig; the limits
    of the rig; or otherwise.
    """
    if stated is not None:
        largest = max(stated[1], -stated[0])
        if of_rig is not None and largest > of_rig[1]:
            faults.append(beyond_rig(scene, key, largest, of_rig[1]))
        return stated, "scene"
    if of_rig is not None:
        return of_rig, "rig"
    return otherwise


def _speed_difference(scene: RigScene, rig: RigFile | None) -> Actuator:
    """Range of the difference of the roller speeds, left less right [-]."""
    key, name = "speed_difference_percent", "speed_difference"
    independent = scene.counterface.drive == "independent"
    if not independent or (rig is not None and key not in rig.controlled):
        return Actuator(name, 0.0, 0.0, "rig", controlled=False)
    if rig is not None and rig.limits.speed_difference_percent is not None:
        limit = 1e-2 * rig.limits.speed_difference_percent
        return Actuator(name, -limit, limit, "rig")
    low, high, _ = QUANTITIES[name].range
    factor = QUANTITIES[name].shown_factor
    return Actuator(name, low / factor, high / factor, "scene")
