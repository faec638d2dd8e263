"""Operating points of `wearsim contact`: texts of flags and columns validated, and solved in batches."""

from __future__ import annotations

import itertools
import math
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
from wearsim.errors import ContactError, NumericalError, ProfileError
from wearsim.operation.resultants import resultants
from wearsim.operation.states import Controlled, StateError, settle
from wearsim.profile.files import load_profile
from wearsim.profile.placement import slope_of
from wearsim.profile.shape import Profile
from wearsim.profile.sources import half_span
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS, Flag
from wearsim.toml_faults import decimal

_SIDES: dict[str, tuple[Side, ...]] = {"right": ("right",), "left": ("left",), "both": ("right", "left")}
_WORDS = {  # allowed texts, beside numbers where the flag has a quantity
    "side": tuple(_SIDES),
    "roll": ("free",),
    "rotation": tuple(RULES),
    "normal": tuple(sorted(NORMAL_MODELS)),
    "tangential": tuple(sorted(TANGENTIAL_MODELS)),
}
_WHOLE = ("strips", "cells", "most_cells")
_LOADS = ("wheel_load_kN", "wheel_load_right_kN", "wheel_load_left_kN", "axle_load_kN", "normal_force_kN")
# only one of each pair acts
_INSTEAD = (
    *(pair for pair in itertools.combinations(_LOADS, 2) if pair != _LOADS[1:3]),
    ("rotation", "creepage"),
    ("shift_mm", "lateral_force_kN"),
)
# fields of points that are solved together may differ in these
_EACH = {
    "shift", "yaw", "roll", "wheel_load", "wheel_load_right", "wheel_load_left", "axle_load", "normal_force",
    "lateral_force", "texts", "friction", "friction_flange", "speed", "rotation", "creepage", "curve_radius",
}  # fmt: skip

_TO_THE_RIGHT = {"shift_mm", "yaw_mrad", "roll", "curve_radius_m", "lateral_force_kN", "creepage"}

PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
"""Numbers of each patch, names as in JSON and in the table of quantities."""


class Request(SimpleNamespace):
    """One operating point with everything that acts on it, SI units.

    Its fields are those of `FLAGS`, and the texts that act by column.
    """

    @property
    def loads(self) -> tuple[float, float]:
        """Loads of the right and the left wheel; the normal force where that is given."""
        load = self.wheel_load if self.normal_force is None else self.normal_force
        load = load if self.axle_load is None else 0.5 * self.axle_load
        return (
            (load, load) if self.wheel_load_right is None else (self.wheel_load_right, self.wheel_load_left)
        )

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
    def batch(self) -> tuple[Any, ...]:
        """What points solved in one call have in common."""
        shared = tuple(value for field, value in vars(self).items() if field not in _EACH)
        alone = self.balanced and id(self)  # found one by one: points without a state do not stop others
        rule = isinstance(self.rule, str) and self.rule
        return (*shared, alone, rule, self.normal_force is None, self.free_roll, self.creepage is None)

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

    def source(self, column: str) -> tuple[Any, ...]:
        """Return what determines the profile of a column: wheel, left_wheel, or the rail in the track."""
        smooth = self.smooth or 0.0
        if column != "rail":
            return getattr(self, column) or self.wheel, smooth
        return (
            self.rail,
            smooth,
            self.inclination,
            self.gauge,
            half_span(self.back_to_back),
            self.gauge_height,
        )

    @property
    def bodies(self) -> tuple[Wheelset, Counterface]:
        """Wheelset and rails or rollers."""
        right, left, rail = (profile_of(*self.source(name)) for name in ("wheel", "left_wheel", "rail"))
        wheelset = Wheelset(right, left, self.wheel_radius, half_span(self.back_to_back))
        return wheelset, Counterface(rail, self.counterface_curvature)

    @property
    def models(self) -> ContactModels:
        """Contact models."""
        return ContactModels(
            normal=self.normal,
            tangential=self.tangential,
            strips=self.strips,
            cells=self.cells,
            cell_size=self.cell,
            most_cells=self.most_cells,
            youngs_modulus=self.youngs,
            poisson_ratio=self.poisson,
        )


@lru_cache(maxsize=256)
def profile_of(name: str, smooth: float, *placing: float) -> Profile:
    """Profile of a `Request.source`, read once."""
    if not placing:
        return load_profile(name, "wheel", smooth=smooth)
    options = zip(("inclination", "gauge", "half_span", "gauge_height"), placing, strict=True)
    return load_profile(name, "rail", smooth=smooth, **dict(options))


@lru_cache(maxsize=4096)  # the rows of a table repeat most texts
def _value(flag: Flag, text: str) -> Any:
    """SI value of the text of a flag; raises ValueError with the end of the message."""
    words = _WORDS.get(flag.column, ())
    if text in words or not (words or flag.quantity or flag.column in ("inclination", "creepage")):
        return text
    if flag.column == "inclination":
        return slope_of(text)
    if flag.column == "creepage":
        return _creepage(text)
    if not flag.quantity:
        raise ValueError(f"must be one of {', '.join(words)}")
    quantity, number = QUANTITIES[flag.quantity], decimal(text)
    low, high, above = quantity.range
    magnitude = abs(number) if flag.column == "curve_radius_m" else number
    whole = flag.column in _WHOLE
    if not low <= magnitude <= high or (above and magnitude == low) or (whole and number % 1.0):
        what = " or ".join([*words, "a whole number" if whole else "a number"])
        what += " of magnitude" if flag.column == "curve_radius_m" else " above 0 and" if above else ""
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        comma = "; the decimal mark is a point" if "," in text else ""
        raise ValueError(
            f"must be {what} from {low:g} to {high:g}{unit} ({flag.meaning.partition(' (')[0]}){comma}"
        )
    if whole:
        return int(number)
    shown = quantity.shown_factor
    return number * (1.0 / shown if shown >= 1.0 else round(1.0 / shown))


def _creepage(text: str) -> tuple[float, ...]:
    numbers = tuple(map(decimal, text.split(",")))
    if len(numbers) != 3:
        raise ValueError("must be three numbers with commas between them: XI_X,XI_Y,SPIN")
    for quantity, number in zip(("creepage_x", "creepage_y", "spin"), numbers, strict=True):
        limit = QUANTITIES[quantity].range.high / QUANTITIES[quantity].shown_factor
        if not abs(number) <= limit:
            raise ValueError(f"must have a {quantity} from {-limit:g} to {limit:g}")
    return numbers


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


def mirrored(texts: Mapping[str, str]) -> dict[str, str]:
    """Texts, by column and without faults, of the mirror image of a point."""
    image = dict(texts)
    for column in _TO_THE_RIGHT & texts.keys():
        parts = texts[column].split(",")  # the longitudinal creepage, the first of three, keeps its sign
        image[column] = ",".join([*parts[: len(parts) // 2], *map(_negative, parts[len(parts) // 2 :])])
    image["side"] = {"right": "left", "left": "right"}.get(texts["side"], texts["side"])
    for right, left in (("wheel", "left_wheel"), ("wheel_load_right_kN", "wheel_load_left_kN")):
        if left in texts:
            image |= {right: texts[left], left: texts[right]}
    return image


def _negative(text: str) -> str:
    number = decimal(text)
    return text if math.isnan(number) else f"{0.0 - number:.15g}"


def request_of(*layers: Mapping[str, str], mirror: bool = False) -> tuple[Request, dict[str, str]]:
    """Validate texts given together, in layers as for `texts_of`.

    Returns
    -------
    request : Request
        Of all texts that are right, and defaults; or its mirror image.
    wrong : dict
        By column what is wrong with the others: the end of a sentence that begins with name and text.
    """
    texts, wrong = texts_of(*layers), dict[str, str]()
    for column, text in tuple(texts.items()):
        try:
            _value(COLUMNS[column], text)
        except ValueError as error:
            wrong[column] = str(error)
            del texts[column]
    texts = {
        column: flag.default for column, flag in COLUMNS.items() if column in wrong and flag.default
    } | texts
    texts = mirrored(texts) if mirror else texts
    values = {
        flag.field: None if (text := texts.get(column, flag.default)) is None else _value(flag, text)
        for column, flag in COLUMNS.items()
    }
    return Request(texts=texts, **values), wrong


def faults_of(given: Mapping[str, str], wrong: Mapping[str, str], *, as_flags: bool) -> list[str]:
    """All that is wrong with texts given together, one line each, named as flags or as columns."""
    name = {column: f"--{flag.name}" if as_flags else column for column, flag in COLUMNS.items()}
    faults = [
        f"{name[column]} = {' '.join(text.split())[:60]} {wrong[column]}"
        for column, text in given.items()
        if column in wrong
    ]
    return faults + [
        f"{name[other]} and {name[one]} exclude each other; give one of them"
        for one, other in _INSTEAD
        if one in given and other in given
    ]


def profile_faults(request: Request) -> list[tuple[str, str]]:
    """Faults of the profiles, as (column, message), one line each."""
    columns = ("wheel", "rail", *(["left_wheel"] if request.left_wheel else []))
    return [(column, line) for column in columns for line in _faults(request.source(column))]


@lru_cache(maxsize=256)
def _faults(source: tuple[Any, ...]) -> list[str]:
    try:
        profile_of(*source)
    except ProfileError as error:
        return str(error).splitlines()
    return []


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
        arrays = {name: np.array([patch[name] for patch in self.patches]) for name in PATCH_NAMES}
        side = np.array([patch["side"] == "left" for patch in self.patches], dtype=np.int64)
        patches: Any = SimpleNamespace(point=np.zeros_like(side), side=side, z=np.zeros(side.size), **arrays)
        forces = resultants(patches, ContactConditions.of([self.shift]), *self.request.bodies)
        return {
            "lateral_force": float(-forces.force[0]),
            "derailment_quotient_right": float(forces.derailment_quotient[0, 0]),
            "derailment_quotient_left": float(forces.derailment_quotient[0, 1]),
            "wheel_load_right": float(forces.vertical[0, 0]),
            "wheel_load_left": float(forces.vertical[0, 1]),
            "steering_moment": float(forces.moment[0]),
            "axle_wear_number": float(forces.power[0] / self.request.speed),
        }


def conditions(points: Sequence[Request]) -> ContactConditions:
    """Operating conditions of points of a batch, with the shifts and loads that follow from forces."""
    first = points[0]

    def column(name: str) -> Any:
        return np.array([getattr(point, name) for point in points], dtype=np.float64)

    loads, friction, flange = column("loads"), column("friction"), column("friction_flange")
    given = ContactConditions(
        shift=column("shift"),
        yaw=column("yaw"),
        roll=np.zeros(len(points)) if first.free_roll else np.nan_to_num(column("roll")),
        wheel_load=loads if (loads[:, 0] != loads[:, 1]).any() else loads[:, 0],
        speed=column("speed"),
        friction=friction,
        track_curvature=column("track_curvature"),
        rotation=first.rule if isinstance(first.rule, str) else column("rule"),
        free_roll=first.free_roll,
        creepage=None if first.creepage is None else column("creepage"),
        friction_flange=None if np.isnan(flange).all() else np.where(np.isnan(flange), friction, flange),
    )
    if not first.balanced:
        return given
    controlled = Controlled(column("lateral_force"), column("axle_load"), np.zeros(len(points)))
    try:
        return settle(given, controlled, *first.bodies, first.models).conditions(given)
    except StateError as error:
        raise ContactError("; ".join(error.messages.values()), row=0) from None


def solve_batch(points: Sequence[Request], *, fields: bool = False) -> tuple[xr.Dataset, list[PointResult]]:
    """Solve points that have `Request.batch` in common: the dataset of `solve_contact`, and each result."""
    first = points[0]
    found = conditions(points)
    try:
        contact = solve_contact(
            *first.bodies,
            found,
            first.models,
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
    for left in batches.values():
        while left:
            try:
                solved |= zip(left, solve_batch([points[index] for index in left])[1], strict=True)
            except ContactError as error:
                if len(left) == 1 or error.row is None:
                    solved |= dict.fromkeys(left, error)
                else:  # each alone for its own message
                    solved |= {left[row]: solve_points([points[left[row]]])[0] for row in error.rows}
            left = [index for index in left if index not in solved]
    return [solved[index] for index in range(len(points))]
