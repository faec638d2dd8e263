"""Operating points of `wearsim contact`: texts of flags and rows validated and solved in batches."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearsim.contact.dataset import Side, solve_contact
from wearsim.contact.equilibrium import RULES
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.contact.solve import available_cores
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import LONGEST_ECHO, ContactError, NumericalError, ProfileError
from wearsim.operation.resultants import resultants
from wearsim.operation.states import Controlled, StateError, settle
from wearsim.profile.files import load_profile
from wearsim.profile.placement import slope_of
from wearsim.profile.shape import Profile
from wearsim.profile.sources import half_span
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS, Flag
from wearsim.toml_faults import decimal

_TIGHTEST_CURVE = QUANTITIES["curve_radius"].range.low  # m
_LOADS = ("wheel_load_kN", "wheel_load_right_kN", "wheel_load_left_kN", "axle_load_kN", "normal_force_kN")
_BY_SIDE = {"wheel_load_right_kN", "wheel_load_left_kN"}
# only one of each pair acts
_INSTEAD = (
    *(pair for pair in itertools.combinations(_LOADS, 2) if set(pair) != _BY_SIDE),
    ("rotation", "creepage"),
    ("shift_mm", "lateral_force_kN"),
)
_FIELDS = tuple((column, flag.field, flag) for column, flag in COLUMNS.items())
_SIDES: dict[str, tuple[Side, ...]] = {"right": ("right",), "left": ("left",), "both": ("right", "left")}

PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
"""Numbers of each patch, names as in JSON and in the table of quantities."""


class Request(SimpleNamespace):
    """One operating point with everything that acts on it, SI units; its fields are those of `FLAGS`."""

    @property
    def load(self) -> float:
        """Mean wheel load, or the normal force where that is given."""
        if self.axle_load is not None:
            return 0.5 * float(self.axle_load)
        return float(self.wheel_load if self.normal_force is None else self.normal_force)

    @property
    def loads(self) -> tuple[float, float]:
        """Loads of the right and the left wheel; the normal force where that is given."""
        sides = (self.wheel_load_right, self.wheel_load_left)
        right, left = (self.load if one is None else float(one) for one in sides)
        return right, left

    @property
    def balanced(self) -> bool:
        """Whether shift or wheel loads follow from forces."""
        return self.axle_load is not None or self.lateral_force is not None

    @property
    def free_roll(self) -> bool:
        """Whether the wheelset rests on both wheels."""
        return bool(self.roll == "free" or (self.roll is None and (self.side == "both" or self.balanced)))

    @property
    def rule(self) -> str | float:
        """Rule of the rotation speed, or the speed; without effect where creepages are given."""
        rule: str | float = self.rotation if self.creepage is None else "nominal"
        return rule

    @property
    def counterface_curvature(self) -> float:
        """Of the roller, 0 of a rail."""
        return 0.0 if self.roller_radius is None else 1.0 / float(self.roller_radius)

    @property
    def track_curvature(self) -> float:
        """Positive to the right, 0 in tangent track."""
        return 0.0 if self.curve_radius is None else 1.0 / float(self.curve_radius)

    @property
    def smoothed_wheel(self) -> tuple[str, float]:
        """What determines the profile of the right wheel."""
        return self.wheel, self.smooth or 0.0

    @property
    def smoothed_left_wheel(self) -> tuple[str, float]:
        """What determines the profile of the left wheel."""
        return self.left_wheel or self.wheel, self.smooth or 0.0

    @property
    def placed_rail(self) -> tuple[str, float, float, float, float]:
        """What determines the rail in the track."""
        return self.rail, self.inclination, self.gauge, half_span(self.back_to_back), self.smooth or 0.0

    @property
    def batch(self) -> tuple[Any, ...]:
        """What points solved in one call have in common."""
        shared = (
            self.side,
            self.wheel,
            self.left_wheel,
            *self.placed_rail,
            self.wheel_radius,
            self.counterface_curvature,
        )
        grid = (self.strips, self.cells, self.cell, self.most_cells)
        models = (self.normal, self.tangential, self.youngs, self.poisson, *grid)
        rule = self.rule if isinstance(self.rule, str) else "number"
        alone = self.balanced  # found one by one: points without a state do not stop others
        return (
            *shared,
            *models,
            alone and id(self),
            rule,
            self.normal_force is None,
            self.free_roll,
            self.creepage is None,
        )

    @property
    def conflict(self) -> str | None:
        """What of it excludes each other."""
        if self.creepage is not None and self.side == "both":
            return "creepages are given for the single patch of one wheel; choose the right or the left side"
        if (self.wheel_load_right is None) != (self.wheel_load_left is None):
            return "the load of one wheel is given; give those of both, right and left"
        if self.balanced and self.roll not in (None, "free"):
            return "forces are balanced by a wheelset that is free to roll; leave out the roll"
        return None


def _number(flag: Flag, text: str) -> float:
    number = decimal(text)
    if not flag.low <= number <= flag.high:
        word = "free or a number" if flag.kind == "roll" else "a number"
        comma = "; the decimal mark is a point" if "," in text else ""
        meaning = flag.meaning.partition(", right side")[0]
        raise ValueError(f"must be {word} from {flag.low:g} to {flag.high:g} ({meaning}){comma}")
    if flag.kind == "curve" and abs(number) < _TIGHTEST_CURVE:
        raise ValueError(f"must not lie within {_TIGHTEST_CURVE:g} m of 0; leave it out on tangent track")
    if flag.kind != "count":
        return number * flag.factor
    if number != int(number):
        raise ValueError("must be a whole number")
    return int(number)


def _rotation(flag: Flag, text: str) -> str | float:
    if text in RULES:
        return text
    if not flag.low < (speed := decimal(text)) <= flag.high:
        raise ValueError(f"must be {', '.join(RULES)}, or a speed above 0 and up to {flag.high:g} rad/s")
    return speed


def _creepage(text: str) -> tuple[float, ...]:
    numbers = tuple(map(decimal, text.split(",")))
    if len(numbers) != 3:
        raise ValueError("must be three numbers with commas between them: XI_X,XI_Y,SPIN")
    names = (("XI_X", "creepage_x", ""), ("XI_Y", "creepage_y", ""), ("SPIN", "spin", " 1/m"))
    for (name, quantity, unit), number in zip(names, numbers, strict=True):
        limit = QUANTITIES[quantity].range.high / QUANTITIES[quantity].shown_factor
        if not abs(number) <= limit:
            raise ValueError(f"must have {name} from {-limit:g} to {limit:g}{unit}")
    return numbers


@lru_cache(maxsize=4096)  # the rows of a table repeat most texts
def _value(flag: Flag, text: str | None) -> Any:
    """SI value of the text of a flag; raises ValueError with the end of the message."""
    if text is None or (flag.kind == "roll" and text == "free"):
        return text
    if flag.kind == "rotation":
        return _rotation(flag, text)
    if flag.kind in ("inclination", "creepage"):
        return slope_of(text) if flag.kind == "inclination" else _creepage(text)
    if flag.kind not in ("name", "side", "model"):
        return _number(flag, text)
    if flag.kind == "side" and text not in _SIDES:
        raise ValueError("must be right, left or both")
    models = NORMAL_MODELS if flag.name == "normal" else TANGENTIAL_MODELS
    if flag.kind == "model" and text not in models:
        raise ValueError(f"is not one of {', '.join(sorted(models))}")
    if "\0" in text:  # ends file names for the operating system
        raise ValueError("must not hold zero bytes")
    return text


def texts_of(*layers: Mapping[str, str]) -> dict[str, str]:
    """Texts that act, by column: those of later layers before those of earlier ones before the defaults."""
    texts = {column: flag.default for column, flag in COLUMNS.items() if flag.default is not None}
    for given in layers:
        for pair in _INSTEAD:
            if any(column in given for column in pair):
                for column in pair:
                    texts.pop(column, None)
        texts.update(given)
    return texts


def request_of(*layers: Mapping[str, str]) -> tuple[Request, dict[str, str]]:
    """Validate texts given together, in layers as for `texts_of`.

    Returns
    -------
    request : Request
        Of all texts that are right, and defaults.
    wrong : dict
        By column what is wrong with the others: the end of a sentence that begins with name and text.
    """
    texts = texts_of(*layers)
    values, wrong = {}, {}
    for column, field, flag in _FIELDS:
        try:
            values[field] = _value(flag, texts.get(column, flag.default))
        except ValueError as error:
            values[field] = _value(flag, flag.default)
            wrong[column] = str(error)
    return Request(**values), wrong


def faults_of(given: Mapping[str, str], wrong: Mapping[str, str], *, as_flags: bool) -> list[str]:
    """All that is wrong with texts given together, one line each, named as flags or as columns."""

    def name(column: str) -> str:
        return "--" + COLUMNS[column].name if as_flags else column

    faults = [
        f"{name(column)} = {' '.join(text.split())[:LONGEST_ECHO]} {wrong[column]}"
        for column, text in given.items()
        if column in wrong
    ]
    for one, other in _INSTEAD:
        if one in given and other in given:
            faults.append(f"{name(other)} and {name(one)} exclude each other; give one of them")
    return faults


class PointResult(NamedTuple):
    """One solved point; `rotation_speed` is None if creepages were given.

    Each patch holds its side and the numbers of `PATCH_NAMES`.
    """

    request: Request
    roll: float
    rotation_speed: float | None
    patches: tuple[dict[str, Any], ...]
    shift: float = 0.0

    @property
    def wheelset(self) -> dict[str, float]:
        """Forces on the wheelset, if both wheels are solved: SI units, names as in results."""
        if self.request.side != "both":
            return {}
        names = ("contact_angle", "normal_force", "force_x", "force_y", "spin_moment", "x", "power", "rail_y")
        arrays = {name: np.array([patch[name] for patch in self.patches]) for name in names}
        side = np.array([patch["side"] == "left" for patch in self.patches], dtype=np.int64)
        nowhere = np.zeros(side.size)
        patches: Any = SimpleNamespace(point=np.zeros_like(side), side=side, z=nowhere, **arrays)
        forces = resultants(patches, ContactConditions.of([self.shift]), *bodies(self.request))
        return {
            "lateral_force": float(-forces.force[0]),
            "derailment_quotient_right": float(forces.derailment_quotient[0, 0]),
            "derailment_quotient_left": float(forces.derailment_quotient[0, 1]),
            "wheel_load_right": float(forces.vertical[0, 0]),
            "wheel_load_left": float(forces.vertical[0, 1]),
            "steering_moment": float(forces.moment[0]),
            "axle_wear_number": float(forces.power[0] / self.request.speed),
        }


@lru_cache(maxsize=64)
def wheel_profile(name: str, smooth: float) -> Profile:
    """Wheel profile by name or file, read once."""
    return load_profile(name, "wheel", smooth=smooth)


@lru_cache(maxsize=256)
def rail_profile(name: str, inclination: float, gauge: float, half_span: float, smooth: float) -> Profile:
    """Rail profile by name or file, placed in the track."""
    return load_profile(
        name, "rail", inclination=inclination, gauge=gauge, half_span=half_span, smooth=smooth
    )


def profile_faults(request: Request) -> list[tuple[str, str]]:
    """Faults of the profiles, as (column, message), one line each."""
    faults = []
    for column, read, given in (
        ("wheel", wheel_profile, request.smoothed_wheel),
        *([("left_wheel", wheel_profile, request.smoothed_left_wheel)] if request.left_wheel else []),
        ("rail", rail_profile, request.placed_rail),
    ):
        try:
            read(*given)
        except ProfileError as error:
            faults += [(column, line) for line in str(error).splitlines()]
    return faults


def bodies(request: Request) -> tuple[Wheelset, Counterface]:
    """Wheelset and rails or rollers of a point."""
    wheel = wheel_profile(*request.smoothed_wheel)
    left = wheel_profile(*request.smoothed_left_wheel)
    wheelset = Wheelset(wheel, left, request.wheel_radius, half_span(request.back_to_back))
    return wheelset, Counterface(rail_profile(*request.placed_rail), request.counterface_curvature)


def conditions(points: Sequence[Request]) -> ContactConditions:
    """Operating conditions of points that have `Request.batch` in common."""
    first = points[0]

    def column(name: str) -> Any:
        return np.array([getattr(point, name) for point in points], dtype=np.float64)

    loads, flange = column("loads"), column("friction_flange")
    return ContactConditions(
        shift=column("shift"),
        yaw=column("yaw"),
        roll=np.zeros(len(points)) if first.free_roll else np.nan_to_num(column("roll")),
        wheel_load=loads if (loads[:, 0] != loads[:, 1]).any() else loads[:, 0],
        speed=column("speed"),
        friction=column("friction"),
        track_curvature=column("track_curvature"),
        rotation=first.rule if isinstance(first.rule, str) else column("rule"),
        free_roll=first.free_roll,
        creepage=None if first.creepage is None else column("creepage"),
        friction_flange=None
        if np.isnan(flange).all()
        else np.where(np.isnan(flange), column("friction"), flange),
    )


def found_conditions(points: Sequence[Request]) -> ContactConditions:
    """Conditions of points of a batch, with the shifts and loads that follow from forces."""
    given = conditions(points)
    if not points[0].balanced:
        return given
    force, load = (
        np.array([getattr(point, name) for point in points], dtype=float)
        for name in ("lateral_force", "axle_load")
    )
    controlled = Controlled(force, load, np.zeros(len(points)))
    try:
        return settle(given, controlled, *bodies(points[0]), models_of(points[0])).conditions(given)
    except StateError as error:
        raise ContactError("; ".join(error.messages.values()), row=0) from None


def models_of(first: Request) -> ContactModels:
    """Contact models of points of a batch."""
    return ContactModels(
        normal=first.normal,
        tangential=first.tangential,
        strips=first.strips,
        cells=first.cells,
        cell_size=first.cell,
        most_cells=first.most_cells,
        youngs_modulus=first.youngs,
        poisson_ratio=first.poisson,
    )


def solve_batch(points: Sequence[Request], *, fields: bool = False) -> tuple[xr.Dataset, list[PointResult]]:
    """Solve points that have `Request.batch` in common: the dataset of `solve_contact`, and each result."""
    first = points[0]
    found = found_conditions(points)
    try:
        contact = solve_contact(
            *bodies(first),
            found,
            models_of(first),
            sides=_SIDES[first.side],
            load="wheel" if first.normal_force is None else "normal_force",
            fields=fields,
            threads=available_cores(),
        )
    except ContactError as error:  # the user does not know the index of the point in the batch
        text = str(error).removeprefix(f"point {error.row}, ")
        raise type(error)(text, row=error.row, rows=error.rows) from None
    numbers = np.stack([contact[name].values for name in PATCH_NAMES], axis=1)
    roll, speed = contact["roll"].values, contact["rotation_speed"].values
    if not (np.isfinite(numbers).all() and np.isfinite(roll).all()):
        raise NumericalError("the solution is not finite; use other models")
    patches: list[list[dict[str, Any]]] = [[] for _ in points]
    for point, side, row in zip(contact["point"].values, contact["side"].values, numbers, strict=True):
        patches[point].append({"side": str(side)} | dict(zip(PATCH_NAMES, row.tolist(), strict=True)))
    return contact, [
        PointResult(
            point,
            float(roll[k]),
            float(speed[k]) if point.creepage is None else None,
            tuple(patches[k]),
            float(found.shift[k]),
        )
        for k, point in enumerate(points)
    ]


def solve_points(points: Sequence[Request]) -> list[PointResult | ContactError]:
    """Solve any points, each as if it were alone; those of one batch are solved together.

    Returns
    -------
    list
        Result of each point, or why it has none; its message does not count the point.
    """
    batches: dict[Any, list[int]] = {}
    for index, request in enumerate(points):
        batches.setdefault(request.batch, []).append(index)
    solved: dict[int, PointResult | ContactError] = {}
    for members in batches.values():
        solved |= dict(zip(members, _together([points[index] for index in members]), strict=True))
    return [solved[index] for index in range(len(points))]


def _together(points: list[Request]) -> list[PointResult | ContactError]:
    """Solve a batch; points without solution leave it, and are solved alone for their own message."""
    solved: dict[int, PointResult | ContactError] = {}
    left = list(range(len(points)))
    while left:
        try:
            solved |= zip(left, solve_batch([points[index] for index in left])[1], strict=True)
            break
        except ContactError as error:
            failed = left if error.row is None else [left[row] for row in error.rows]
            if len(left) == 1 or error.row is None:
                solved |= dict.fromkeys(failed, error)
            else:
                solved |= {index: _together([points[index]])[0] for index in failed}
        left = [index for index in left if index not in solved]
    return [solved[index] for index in range(len(points))]
