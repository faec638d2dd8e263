"""A contact of the field on a rig: set-point of equal pressure, wear number, place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import least_squares

from wearsim.contact.dataset import SIDES, Side, solve_contact
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import available_cores
from wearsim.errors import ContactError
from wearsim.quantities import QUANTITIES
from wearsim.scene import RigScene
from wearsim.scene.actuators import Actuator, actuators
from wearsim.scene.overrides import Overrides
from wearsim.scene.prepared import bodies_of, contact_models, coupled_difference
from wearsim.studies.contact_flags import MATCHED
from wearsim.studies.design import rig_scene

FloatArray = NDArray[np.float64]

TOLERANCE = {"max_pressure": 0.01, "wear_number": 0.01, "place": 0.5e-3}
"""Within which a quantity counts as matched: share of the field's, or length [m]."""

ERRORS = {
    "shift": 0.1e-3,
    "yaw": 0.2e-3,
    "wheel_load": 0.01,
    "speed_difference": 1e-3,
}
"""Errors of set-points whose effect is stated [m, rad, share, -]."""

ACTUATORS = tuple(ERRORS)
_STATES = ("field", "copied", "matched")
_SIGNED = ("creepage_x", "creepage_y", "spin")
_OF_MAIN = ("creepage_x", "creepage_y", "spin", "contact_angle")
_UNIT = np.array([1e-3, 1e-3, 1e4, 1e-3])  # of the search [m, rad, N, -]
_STEP = 5e-3  # of the difference quotients, in these units
_NO_CONTACT = 1e3  # residual of a set-point without contact solution
_HERTZ = 3.0  # power of the load in the largest pressure of a Hertzian contact
_AROUND = (  # further starts: changes of shift, yaw and speed difference, share of load
    (0.0, 0.0, 0.0, 1.0),
    (1.5, 1.0, 0.0, 1.0),
    (-1.5, -1.0, 0.0, 1.0),
    (1.5, -1.0, 0.0, 1.0),
    (-1.5, 1.0, 0.0, 1.0),
    (0.0, 0.0, 4.0, 0.7),
    (0.0, 0.0, -4.0, 0.7),
)
_ROUGH: dict[str, Any] = {"xtol": 1e-3, "ftol": 1e-2, "gtol": 1e-6, "max_nfev": 8}
_FINE: dict[str, Any] = {"xtol": 1e-6, "ftol": 1e-4, "gtol": 1e-8, "max_nfev": 12}
_AT_LIMIT = 1e-3  # of the range, within which a limit binds
_BETTER = 0.9  # of what is off, below which a further actuator is named


@dataclass(frozen=True)
class Rig:
    """Wheelset on rollers at set-points: shift, yaw, wheel load, speed difference."""

    name: str
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    actuators: tuple[Actuator, ...]
    sides: tuple[Side, ...]
    rules: Mapping[str, Any]  # speed, friction and rules of the rig's scene
    coupled: float  # speed difference of rollers of one angular speed [-]

    def conditions(self, set_points: FloatArray) -> ContactConditions:
        """Operating points of set-points (k, 4) [m, rad, N, -]."""
        shift, yaw, load, difference = set_points.T
        apart = difference + self.coupled
        rules = dict(self.rules)
        if apart.any():
            rules["speed_difference"] = apart
        return ContactConditions.of(shift, yaw=yaw, wheel_load=load, **rules)

    def solve(self, set_points: FloatArray) -> tuple[dict[str, FloatArray], str]:
        """Contacts of set-points (k, 4), NaN and a reason where there is none."""
        bodies = self.wheelset, self.counterface
        count = len(set_points)
        left, reason = np.arange(count), ""
        quantities: dict[str, FloatArray] = {}
        while left.size:
            try:
                part = wheels_of(
                    *bodies, self.conditions(set_points[left]), self.models, self.sides
                )
            except ContactError as error:
                reason = str(error).partition(", ")[2] or str(error)
                if error.row is None:
                    break
                left = np.delete(left, list(error.rows))
                continue
            for name, values in part.items():
                quantities[name] = np.full((count, len(self.sides)), np.nan)
                quantities[name][left] = values
            break
        nothing = np.full((count, len(self.sides)), np.nan)
        return quantities or dict.fromkeys(
            (*MATCHED, "area", *_OF_MAIN), nothing
        ), reason

    def within(self, set_point: FloatArray) -> FloatArray:
        """Set-point (4,) moved into the limits [m, rad, N, -]."""
        low, high = self.limits
        return np.asarray(np.clip(set_point, low, high))

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the ranges (4,) of the set-points [m, rad, N, -]."""
        low, high = (
            [getattr(actuator, end) for actuator in self.actuators] for end in _ENDS
        )
        return np.array(low), np.array(high)


_SAME_LOAD = 1e-6
"""Share by which wheel loads may differ and count as equal."""
_ENDS = ("low", "high")


@dataclass(frozen=True)
class Match:
    """Set-point of a search, and how far its contact is off that of the field."""

    set_point: FloatArray  # (4,)
    off: FloatArray  # (quantities, sides) in tolerances, signed
    unlike: int  # creepages of other sign

    @property
    def worst(self) -> float:
        """Largest difference, in tolerances."""
        return float(np.abs(self.off).max())

    @property
    def order(self) -> tuple[bool, int, float]:
        """Order of preference: matched, creepages of the field's sign, difference."""
        reached = self.worst <= 1.0
        return not reached, self.unlike if reached else 0, float((self.off**2).sum())


def wheels_of(
    wheelset: Wheelset,
    counterface: Counterface,
    conditions: ContactConditions,
    models: ContactModels,
    sides: Sequence[Side],
) -> dict[str, FloatArray]:
    """Quantities (points, sides) of whole wheels, over all patches of each.

    The place is the mean of the patches by their normal force; creepages and contact
    angle are those of the patch with the largest one.
    """
    contact = solve_contact(
        wheelset,
        counterface,
        conditions,
        models,
        sides=list(sides),
        threads=available_cores(),
    )
    side = np.array([list(sides).index(name) for name in contact["side"].values])
    row = len(sides) * contact["point"].values + side
    shape = contact.sizes["operating_point"], len(sides)
    count = shape[0] * shape[1]

    def total(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(row, values, count), np.float64).reshape(shape)

    force = contact["normal_force"].values
    highest = np.zeros(count)
    np.maximum.at(highest, row, contact["max_pressure"].values)
    first = np.unique(row, return_index=True)[1]
    quantities = {
        "max_pressure": highest.reshape(shape),
        "wear_number": total(contact["power"].values) / conditions.speed[:, None],
        "place": total(force * contact["wheel_y"].values) / total(force),
        "area": total(contact["area"].values),
    }
    return quantities | {
        name: contact[name].values[first].reshape(shape) for name in _OF_MAIN
    }


def match_contact(
    wheelset: Wheelset,
    counterface: Counterface,
    conditions: ContactConditions,
    rig: str | Path | Mapping[str, Any] | RigScene,
    models: ContactModels | None = None,
    *,
    quantities: Sequence[str] = MATCHED,
    sides: Side | Sequence[Side] = SIDES,
    overrides: Overrides = (),
) -> xr.Dataset:
    """Find the set-point of a rig whose contact equals one of the field.

    Parameters
    ----------
    wheelset : Wheelset
        In the field, see `wearsim.wheelset`.
    counterface : Counterface
        In the field, see `wearsim.rails`.
    conditions : ContactConditions
        One operating point of the field, see `ContactConditions.of`.
    rig : str, Path, dict or scene
        Scene of the rig: its wheelset and rollers, the friction and speed of its
        blocks, and the limits of the rig that it names; values of [programme] end the
        ranges of shift, yaw and load, too. The roll is free where that of the field is,
        else the same.
    models : ContactModels, optional
        Of both contacts; by default those of the scene of the rig.
    quantities : sequence of {"max_pressure", "wear_number", "place"}
        To match: the largest pressure of a wheel, its frictional work per distance, and
        the lateral place of contact on its profile.
    sides : {"right", "left"} or sequence of them
        Wheels whose quantities are matched.
    overrides : mapping or sequence of Override
        Values that replace those of the scene of the rig.

    Returns
    -------
    xarray.Dataset
        Over `state` (field, copied, matched): `shift` [m], `yaw` [rad], `wheel_load`
        [N] and `speed_difference` of the rollers [-]. Over `state` and `wheel`:
        `max_pressure` [Pa], `wear_number` [N], `place` [m] (mean of the patches by
        their normal force), `area` [m2], and of the patch of the largest normal force
        `contact_angle` [rad], `creepage_x`, `creepage_y` [-] and `spin` [1/m]. Over
        `actuator`: `low` and `high`, the ends of its range, `controlled`, and `error`,
        that of a set-point whose effect is `sensitivity` (quantity, actuator, wheel):
        the larger change of both directions, a share of pressure and wear number, a
        length of the place [m]. Over `quantity` and `wheel`: `difference` of rig less
        field. NaN where a set-point has no contact solution or is not
        controlled. `attrs`: `reached` (1 if all quantities are within `tolerance`), and
        lines `limits` that bind, `missing` actuator, `copy_reason`.

    Raises
    ------
    SceneError
        For faults of the scene of the rig.
    ContactError
        If the field has no contact solution, several points or given creepages, a
        quantity is unknown or zero in the field, or no start has a contact solution.

    Notes
    -----
    Bounded least squares of the differences over their tolerances (1 % of pressure and
    wear number, 0.5 mm of place) from eight starts. The first one is the set-point of
    the field with the load of Hertz's theory, :math:`Q_{rig} = Q (p_{field} /
    p_{copied})^3` [1]_. The search ends at the first match whose creepages all have the
    signs of those in the field; without one, that with the most of them is returned,
    and where none is within the tolerances the nearest one. Fewer quantities than
    actuators leave the set-point undetermined: it is one near that of the field.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, 1985, 4.2,
       doi:10.1017/CBO9781139171731: the largest pressure of an elliptical contact is
       proportional to the cube root of the load.

    Examples
    --------
    >>> import wearsim
    >>> made = wearsim.match_contact(
    ...     wearsim.wheelset("S1002", radius=0.460),
    ...     wearsim.rails("60E1", inclination=1 / 40),
    ...     wearsim.ContactConditions.of(1.8e-3, yaw=0.5e-3, free_roll=True),
    ...     "workflows/rig_given.toml",
    ...     wearsim.ContactModels.of("fast"),
    ...     sides="right",
    ... )
    >>> made.attrs["reached"]
    1
    >>> bool(made["wheel_load"].sel(state="matched") < 80e3)
    True
    """
    chosen = _quantities(quantities)
    scene = rig_scene(rig, overrides)
    if models is None:
        models = contact_models(scene.contact)
    if conditions.shift.size != 1 or conditions.creepage is not None:
        raise ContactError(
            "a match is that of one operating point whose creepages follow from its "
            "motion; give a single point without creepage"
        )
    wheels: tuple[Side, ...] = (
        (sides,) if isinstance(sides, str) else tuple(dict.fromkeys(sides))
    )
    load = _load_of(conditions, wheels)
    field = wheels_of(wheelset, counterface, conditions, models, wheels)
    _check_field(field, chosen)
    on = rig_of_scene(scene, models, wheels, conditions)
    low, high = on.limits
    if not (high > low).any():
        raise ContactError(
            f"the rig {on.name} leaves no range to shift, yaw, wheel load and speed "
            "difference; widen those of its scene"
        )
    copied = np.array(
        [
            float(conditions.axle_shift()[0]),
            float(conditions.yaw[0]),
            load,
            0.0,
        ]
    )
    best_match = matched(on, field, chosen, copied)
    dataset = _dataset(on, field, chosen, copied, best_match)
    names = [body.right.name for body in (wheelset, on.wheelset)]
    unlike = f"the wheel is {names[0]} in the field and {names[1]} on the rig"
    return dataset.assign_attrs(wheels=unlike if names[0] != names[1] else "")


def _load_of(conditions: ContactConditions, wheels: Sequence[Side]) -> float:
    """Load in the field of the wheels to match [N]; an error where they are unlike.

    A rig loads both wheels equally.
    """
    loads = conditions.loads[0, [SIDES.index(side) for side in wheels]]
    if loads.size and np.ptp(loads) > _SAME_LOAD * loads.max():
        raise ContactError(
            f"the wheels carry {1e-3 * loads[0]:.4g} and {1e-3 * loads[1]:.4g} kN in "
            "the field, and equal loads on the rig; match one side at a time"
        )
    return float(loads.mean()) if loads.size else 0.0


def rig_of_scene(
    scene: RigScene,
    models: ContactModels,
    sides: tuple[Side, ...],
    field: ContactConditions,
) -> Rig:
    """Bodies, actuators and rules of a rig; its roll is that of the field."""
    rig_actuators = actuators(scene)
    wheelset, counterface = bodies_of(scene)
    rules: dict[str, Any] = {
        "speed": rig_actuators.speed,
        "friction": rig_actuators.friction,
        "rotation": scene.contact.rotation,
        "torque": rig_actuators.torque,
        "free_roll": field.free_roll,
        "roll": 0.0 if field.free_roll else float(field.roll[0]),
    }
    if rig_actuators.torque_difference:
        rules["torque_difference"] = rig_actuators.torque_difference
    if rig_actuators.friction_flange is not None:
        rules["friction_flange"] = rig_actuators.friction_flange
    return Rig(
        rig_actuators.rig,
        wheelset,
        counterface,
        models,
        rig_actuators.ranges,
        tuple(sides),
        rules,
        coupled_difference(scene, counterface),
    )


def _quantities(names: Sequence[str]) -> tuple[str, ...]:
    """Quantities in their order, each once; raises an error for unknown ones."""
    names = [names] if isinstance(names, str) else list(names)
    unknown = [name for name in names if name not in MATCHED]
    if unknown or not names:
        given = unknown[0] if unknown else "nothing"
        raise ContactError(
            f"{given} cannot be matched; choose from {', '.join(MATCHED)}"
        )
    return tuple(name for name in MATCHED if name in names)


def _check_field(field: Mapping[str, FloatArray], chosen: Sequence[str]) -> None:
    """Raise an error where the field has no wear number to match."""
    if "wear_number" in chosen and not (field["wear_number"] > 0.0).all():
        raise ContactError(
            "the wear number of the field is 0; leave wear_number out, or give friction"
        )


def differences(
    contact: Mapping[str, FloatArray],
    field: Mapping[str, FloatArray],
    chosen: Sequence[str],
) -> FloatArray:
    """Differences (quantities, points, sides) from the field: shares [-], place [m]."""
    return np.stack(
        [
            contact[name] - field[name]
            if name == "place"
            else contact[name] / field[name] - 1.0
            for name in chosen
        ]
    )


def matched(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: tuple[str, ...],
    copied: FloatArray,
) -> Match:
    """Match of least difference from eight starts.

    Raises a ContactError where none of the starts has a contact solution.
    """
    best: Match | None = None
    for start in _starts(rig, field, chosen, copied):
        candidate = _match_from(rig, field, chosen, start, _ROUGH)
        if candidate is not None and (best is None or candidate.order < best.order):
            best = candidate
        if best is not None and best.order[:2] == (False, 0):
            break
    if best is None:
        reason = rig.solve(rig.within(copied)[None])[1]
        raise ContactError(
            f"no set-point near that of the field has a contact on the rig: {reason}"
        )
    return _match_from(rig, field, chosen, best.set_point, _FINE) or best


def _starts(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: Sequence[str],
    copied: FloatArray,
) -> list[FloatArray]:
    """Eight set-points within the limits, the first one by Hertz's theory.

    Where the pressure is not to be matched it is that of the field.
    """
    hertz = rig.within(copied)
    pressure = rig.solve(hertz[None])[0]["max_pressure"][0]
    if "max_pressure" in chosen and np.isfinite(pressure).all():
        ratio = float(np.mean(field["max_pressure"][0] / pressure))
        hertz = rig.within(hertz * np.array([1.0, 1.0, ratio**_HERTZ, 1.0]))
    starts = [hertz]
    for *change, share in _AROUND:
        moved = hertz + _UNIT * np.array([*change[:2], 0.0, change[2]])
        moved[2] *= share
        starts.append(rig.within(moved))
    starts[1] = rig.within(copied)
    return starts


def _match_from(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: tuple[str, ...],
    start: FloatArray,
    ends: Mapping[str, Any],
) -> Match | None:
    """Match of one start, to the ends of the search; None without contact solution."""
    low, high = rig.limits
    free = np.flatnonzero(high > low)
    scale = np.array([TOLERANCE[name] for name in chosen])[:, None, None]
    middle, unit = 0.5 * (low + high), _UNIT[free]
    jacobian = np.zeros((len(chosen) * len(rig.sides), free.size))
    signs = np.zeros(0)

    def residual(values: FloatArray) -> FloatArray:
        """Differences in tolerances; their derivatives are kept for the next step."""
        nonlocal jacobian, signs
        base = start.copy()
        base[free] = unit * values
        step = np.where(base > middle, -_STEP, _STEP)[free]
        points = np.repeat(base[None], 1 + free.size, axis=0)
        points[1 + np.arange(free.size), free] += unit * step
        contact, _ = rig.solve(points)
        difference = differences(contact, field, chosen) / scale
        rows = np.moveaxis(difference, 1, 0).reshape(len(points), -1)
        if not np.isfinite(rows[0]).all():
            return np.full(rows.shape[1], _NO_CONTACT)
        jacobian = np.nan_to_num((rows[1:] - rows[0]).T / step)
        signs = np.concatenate([contact[name][0] for name in _SIGNED])
        return np.asarray(rows[0])

    first = start[free] / unit
    if not free.size or residual(first)[0] == _NO_CONTACT:
        return None
    bounds = low[free] / unit, high[free] / unit
    solution = least_squares(
        residual,
        np.clip(first, bounds[0] + 1e-6, bounds[1] - 1e-6),
        lambda _: jacobian,
        bounds=bounds,
        **ends,
    )
    difference = residual(solution.x).reshape(len(chosen), -1)
    set_point = start.copy()
    set_point[free] = unit * solution.x
    unlike = np.concatenate([field[name][0] for name in _SIGNED]) * signs < 0.0
    return Match(set_point, difference, int(unlike.sum()))


def _dataset(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: tuple[str, ...],
    copied: FloatArray,
    best_match: Match,
) -> xr.Dataset:
    """Dataset of a match, see `match_contact`."""
    contact, reason = rig.solve(copied[None])
    at, _ = rig.solve(best_match.set_point[None])
    values: dict[str, Any] = {}
    for k, name in enumerate(ACTUATORS):
        column = [copied[k], copied[k], best_match.set_point[k]]
        values[name] = "state", column, _attrs(name)
    for name in (*MATCHED, "area", *_OF_MAIN):
        rows = [quantities[name][0] for quantities in (field, contact, at)]
        values[name] = ("state", "wheel"), np.array(rows), _attrs(name)
    low, high = rig.limits
    values["low"] = "actuator", low
    values["high"] = "actuator", high
    values["controlled"] = (
        "actuator",
        [int(actuator.controlled) for actuator in rig.actuators],
    )
    values["error"] = "actuator", list(ERRORS.values())
    of_quantity = ("quantity", "wheel")
    values["difference"] = of_quantity, differences(at, field, chosen)[:, 0]
    values["sensitivity"] = (
        ("quantity", "actuator", "wheel"),
        _sensitivity(rig, field, chosen, best_match),
    )
    reached = best_match.worst <= 1.0
    binding = [
        (k, end)
        for k, actuator in enumerate(rig.actuators)
        for end in _ENDS
        if actuator.high > actuator.low
        and abs(best_match.set_point[k] - getattr(actuator, end))
        <= _AT_LIMIT * (actuator.high - actuator.low)
    ]
    missing = (
        "" if reached else _missing_actuator(rig, field, chosen, best_match, binding)
    )
    attrs = {
        "rig": rig.name,
        "reached": int(reached),
        "unlike_creepages": best_match.unlike,
        "limits": "\n".join(_limit_line(rig.actuators[k], end) for k, end in binding),
        "missing": missing,
        "copy_reason": reason if np.isnan(contact["max_pressure"]).any() else "",
        "history": "wearsim.match_contact",
    }
    names = {
        "state": list(_STATES),
        "wheel": list(rig.sides),
        "actuator": list(ACTUATORS),
        "quantity": list(chosen),
    }
    attrs |= {f"tolerance_{name}": TOLERANCE[name] for name in chosen}
    return xr.Dataset(values, coords=names, attrs=attrs)


_TABLE = {"wear_number": "wear_number_with_spin", "place": "wheel_y"}


def _attrs(name: str) -> dict[str, str]:
    quantity = QUANTITIES[_TABLE.get(name, name)]
    return {"long_name": quantity.meaning, "units": quantity.unit}


def _sensitivity(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: tuple[str, ...],
    best_match: Match,
) -> FloatArray:
    """Larger change (quantities, actuators, sides) by an error of either sign."""
    error = np.array(list(ERRORS.values()))
    error[2] *= best_match.set_point[2]
    points = np.concatenate([best_match.set_point + np.diag(error)] * 2)
    points[len(error) :] = best_match.set_point - np.diag(error)
    contact, _ = rig.solve(np.concatenate([best_match.set_point[None], points]))
    difference = differences(contact, field, chosen)
    change = np.abs(difference[:, 1:] - difference[:, :1]).reshape(
        len(chosen), 2, len(error), -1
    )
    largest = np.where(np.isfinite(change), change, -1.0).max(axis=1)
    fixed = np.array([actuator.high == actuator.low for actuator in rig.actuators])
    return np.where((largest < 0.0) | fixed[None, :, None], np.nan, largest)


WORDS = {
    "shift": ("shift", 1e3, "mm"),
    "yaw": ("yaw", 1e3, "mrad"),
    "wheel_load": ("wheel load", 1e-3, "kN"),
    "speed_difference": ("speed difference of the rollers", 1e2, "%"),
}
"""Name, factor and unit of each actuator in texts."""

_OF_END = {
    "rig": "limit of the rig",
    "flange": "flange clearance",
    "scene": "[programme] of the scene",
}


def _limit_line(actuator: Actuator, end: str) -> str:
    word, factor, unit = WORDS[actuator.name]
    size = "smallest" if end == "low" else "largest"
    value = factor * getattr(actuator, end)
    return f"{word} at its {size}, {value:.4g} {unit} ({_OF_END[actuator.end]})"


def _widest(actuator: Actuator) -> tuple[float, float]:
    """Range that a better actuator could have."""
    if actuator.widest is not None:
        return actuator.widest
    quantity = QUANTITIES[actuator.name]
    ends = (quantity.range.low, quantity.range.high)
    low, high = (end / quantity.shown_factor for end in ends)
    return low, high


def _missing_actuator(
    rig: Rig,
    field: Mapping[str, FloatArray],
    chosen: tuple[str, ...],
    best_match: Match,
    binding: Sequence[tuple[int, str]],
) -> str:
    """Line on the actuator, or wider range of one, that comes nearest to a match."""
    best, text = _BETTER * best_match.worst, ""
    bound = [k for k, _ in binding]
    for k, actuator in enumerate(rig.actuators):
        if actuator.high > actuator.low and k not in bound:
            continue
        word, factor, unit = WORDS[actuator.name]
        low, high = _widest(actuator)
        if low >= actuator.low and high <= actuator.high:
            continue
        wider = list(rig.actuators)
        wider[k] = replace(actuator, low=low, high=high)
        free = replace(rig, actuators=tuple(wider))
        trial = _match_from(free, field, chosen, best_match.set_point, _FINE)
        if trial is None or trial.worst >= best:
            continue
        best = trial.worst
        text = f"{word}: at {factor * trial.set_point[k]:.4g} {unit} "
        text += (
            "the rig would match"
            if best <= 1.0
            else f"the largest difference would be {best:.3g} times its tolerance"
        )
    return text or "none: no other range of a single actuator brings it nearer"
