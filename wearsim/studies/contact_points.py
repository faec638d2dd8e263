"""Operating points of `wearsim contact`.

Texts of flags and columns validated, and solved in batches.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.contact.dataset import Side, solve_contact
from wearsim.contact.equilibrium import RULES, TORQUE_RULES
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import (
    PAIRS,
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import available_cores
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import LONGEST_ECHO, ContactError, NumericalError, ProfileError
from wearsim.operation.controlled import Controlled
from wearsim.operation.states import StateError, settle
from wearsim.profile.files import load_profile
from wearsim.profile.placement import slope_of
from wearsim.profile.shape import Profile
from wearsim.profile.sources import half_span
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import (
    COLUMNS,
    FLAGS,
    Bodies,
    Flag,
    Models,
    Motion,
    flags_of,
)
from wearsim.toml_faults import decimal

_SIDES: dict[str, tuple[Side, ...]] = {
    "right": ("right",),
    "left": ("left",),
    "both": ("right", "left"),
}
_WORDS = {  # allowed texts, besides numbers where the flag has a quantity
    "side": tuple(_SIDES),
    "roll": ("free",),
    "rotation": tuple(RULES),
    "model": tuple(PAIRS),
    "normal": tuple(sorted(NORMAL_MODELS)),
    "tangential": tuple(sorted(TANGENTIAL_MODELS)),
}
_DEFAULTS = {
    column: flag.default for column, flag in COLUMNS.items() if flag.default is not None
}
_WHOLE = ("strips", "cells", "most_cells")
_LOADS = (
    "wheel_load_kN",
    "wheel_load_right_kN",
    "wheel_load_left_kN",
    "axle_load_kN",
    "normal_force_kN",
)
# only one of each pair acts
_INSTEAD = (
    *(pair for pair in itertools.combinations(_LOADS, 2) if pair != _LOADS[1:3]),
    ("rotation", "creepage"),
    ("model", "normal"),
    ("model", "tangential"),
    ("shift_mm", "lateral_force_kN"),
)
# fields of points that are solved together may differ in these
_EACH = set(flags_of(Motion)) - {"side"} | {
    "curve_radius",
    "texts",
    "track_curvature",
    "rule",
    "loads",
}
_TO_THE_RIGHT = {
    "shift_mm",
    "yaw_mrad",
    "roll",
    "curve_radius_m",
    "lateral_force_kN",
    "creepage",
}

PATCH_NAMES = (
    "wheel_y",
    "rail_y",
    "x",
    "contact_angle",
    "area",
    "max_pressure",
    "length",
    "width",
    "approach",
    "normal_force",
    "creepage_x",
    "creepage_y",
    "spin",
    "force_x",
    "force_y",
    "spin_moment",
    "slip_area",
    "power",
    "power_balance",
)
"""Numbers of each patch, names as in JSON and in the table of quantities."""


Result = dict[str, Any]


class Request(Bodies, Motion, Models, SimpleNamespace):
    """One operating point with everything that acts on it, SI units.

    Its fields are those of its flags, the `texts` that act by column, and what follows
    from them: `counterface_curvature` of the roller, 0 of a rail; `track_curvature`;
    `balanced`, whether shift or wheel loads follow from forces; `free_roll`, whether
    the wheelset rests on both wheels; `rule` of the rotation speed, or the speed
    (without effect where creepages are given); `loads` of the right and the left wheel,
    the normal force where that is given.
    """

    def __init__(self, texts: dict[str, str], **values: Any) -> None:
        super().__init__(texts=texts, **values)
        self.counterface_curvature = (
            0.0 if self.roller_radius is None else 1.0 / float(self.roller_radius)
        )
        self.track_curvature = (
            0.0 if self.curve_radius is None else 1.0 / float(self.curve_radius)
        )
        self.balanced = self.axle_load is not None or self.lateral_force is not None
        unknown = self.roll is None and (self.side == "both" or self.balanced)
        self.free_roll = bool(self.roll == "free" or unknown)
        self.rule = self.rotation if self.creepage is None else "nominal"
        load = self.wheel_load if self.normal_force is None else self.normal_force
        load = load if self.axle_load is None else 0.5 * self.axle_load
        right, left = self.wheel_load_right, self.wheel_load_left
        self.loads = (load, load) if right is None or left is None else (right, left)
        normal, tangential = PAIRS[values["model"] or "standard"]
        self.normal, self.tangential = (
            values["normal"] or normal,
            values["tangential"] or tangential,
        )

    @property
    def batch(self) -> tuple[Any, ...]:
        """What points solved in one call have in common."""
        shared = tuple(
            value for field, value in vars(self).items() if field not in _EACH
        )
        alone = self.balanced and id(
            self
        )  # found one by one: points without a state do not stop others
        rule = isinstance(self.rule, str) and self.rule
        return (*shared, alone, rule, self.normal_force is None, self.creepage is None)

    @property
    def conflict(self) -> str | None:
        """What of it excludes each other."""
        if self.creepage is not None and self.side == "both":
            return (
                "creepages are given for the single patch of one wheel; choose the "
                "right or the left side"
            )
        if self.torque != 0.0 and self.rule not in TORQUE_RULES:
            return (
                "a torque has no effect where the rotation speed or creepages are "
                "given; leave it out"
            )
        if (self.friction_ratio < 1.0) != (self.friction_decrease > 0.0):
            return (
                "friction falls with the slip velocity where friction ratio is below 1 "
                "and friction decrease above 0; give both"
            )
        if (self.wheel_load_right is None) != (self.wheel_load_left is None):
            return "the load of one wheel is given; give those of both, right and left"
        if self.roller_radius is None and self.roller_radius_left is not None:
            return (
                "the radius of the left roller is given; give that of the right one, "
                "roller radius, too"
            )
        if self.balanced and self.roll not in (None, "free"):
            return (
                "forces are balanced by a wheelset that is free to roll; leave out "
                "the roll"
            )
        return None

    def source(self, column: str) -> tuple[Any, ...]:
        """Return what determines the profile of a column.

        Wheel, left_wheel, or the rail in the track.
        """
        smooth = self.smooth or 0.0
        if column != "rail":
            return getattr(self, column) or self.wheel, smooth
        placing = (
            self.inclination,
            self.gauge,
            half_span(self.back_to_back),
            self.gauge_height,
        )
        return self.rail, smooth, *placing

    @property
    def problem(self) -> tuple[Wheelset, Counterface, ContactModels]:
        """Wheelset, rails or rollers, and contact models."""
        right, left, rail = (
            profile_of(*self.source(name)) for name in ("wheel", "left_wheel", "rail")
        )
        wheelset = Wheelset(
            right, left, self.wheel_radius, half_span(self.back_to_back)
        )
        models = {
            field: getattr(self, field)
            for field in flags_of(Models)
            if field != "model"
        }
        other = (
            None
            if self.roller_radius_left is None
            else 1.0 / float(self.roller_radius_left)
        )
        below = Counterface(rail, self.counterface_curvature, left_curvature=other)
        return wheelset, below, ContactModels(**models)


@lru_cache(maxsize=256)
def profile_of(name: str, smooth: float, *placing: float) -> Profile:
    """Profile of a `Request.source`, read once."""
    if not placing:
        return load_profile(name, "wheel", smooth=smooth)
    inclination, gauge, span, height = placing
    placed = {
        "inclination": inclination,
        "gauge": gauge,
        "half_span": span,
        "gauge_height": height,
    }
    return load_profile(name, "rail", smooth=smooth, **placed)  # type: ignore[arg-type]


@lru_cache(maxsize=4096)  # the rows of a table repeat most texts
def _value(flag: Flag, text: str) -> Any:
    """SI value of the text of a flag; raises ValueError with the end of the message."""
    words = _WORDS.get(flag.column, ())
    if text in words or not (
        words or flag.quantity or flag.column in ("inclination", "creepage")
    ):
        return text
    if flag.column == "inclination":
        return slope_of(text)
    if flag.column == "creepage":
        return _creepage(text)
    if not flag.quantity:
        unusable = {
            "normal": NORMAL_MODELS.unusable,
            "tangential": TANGENTIAL_MODELS.unusable,
        }
        reason = unusable.get(flag.column, {}).get(text)
        raise ValueError(reason or f"must be one of {', '.join(words)}")
    quantity, number = QUANTITIES[flag.quantity], decimal(text)
    low, high, above = quantity.range
    magnitude = abs(number) if flag.column == "curve_radius_m" else number
    whole = flag.column in _WHOLE
    if (
        not low <= magnitude <= high
        or (above and magnitude == low)
        or (whole and number % 1.0)
    ):
        what = " or ".join([*words, "a whole number" if whole else "a number"])
        what += (
            " of magnitude"
            if flag.column == "curve_radius_m"
            else " above 0 and"
            if above
            else ""
        )
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        comma = "; the decimal mark is a point" if "," in text else ""
        meaning = flag.meaning.partition(" (")[0]
        raise ValueError(
            f"must be {what} from {low:g} to {high:g}{unit} ({meaning}){comma}"
        )
    if whole:
        return int(number)
    shown = quantity.shown_factor
    return number * (1.0 / shown if shown >= 1.0 else round(1.0 / shown))


def _creepage(text: str) -> tuple[float, ...]:
    numbers = tuple(map(decimal, text.split(",")))
    if len(numbers) != 3:
        raise ValueError(
            "must be three numbers with commas between them: XI_X,XI_Y,SPIN"
        )
    for quantity, number in zip(
        ("creepage_x", "creepage_y", "spin"), numbers, strict=True
    ):
        limit = QUANTITIES[quantity].range.high / QUANTITIES[quantity].shown_factor
        if not abs(number) <= limit:
            raise ValueError(f"must have a {quantity} from {-limit:g} to {limit:g}")
    return numbers


def mirrored(request: Request) -> Request:
    """Mirror image of a point that has no faults."""
    texts, image = request.texts, dict(request.texts)
    for column in _TO_THE_RIGHT & texts.keys():
        parts = texts[column].split(
            ","
        )  # the longitudinal creepage, the first of three, keeps its sign
        image[column] = ",".join(
            [*parts[: len(parts) // 2], *map(_negative, parts[len(parts) // 2 :])]
        )
    image["side"] = {"right": "left", "left": "right", "both": "both"}[texts["side"]]
    for right, left in (
        ("wheel", "left_wheel"),
        ("wheel_load_right_kN", "wheel_load_left_kN"),
    ):
        if left in texts:
            image |= {right: texts[left], left: texts[right]}
    return request_of(image)[0]


def _negative(text: str) -> str:
    number = decimal(text)
    return text if math.isnan(number) else f"{0.0 - number:.15g}"


def request_of(
    *layers: Mapping[str, str], dashes: bool = False
) -> tuple[Request, list[str]]:
    """Validate texts by column.

    Those of later layers act before those of earlier ones, before the defaults.

    Returns
    -------
    request : Request
        Of all texts that are right, and defaults.
    faults : list
        All that is wrong, one line each; columns are named as flags with `dashes`.
    """
    name = {
        column: f"--{flag.name}" if dashes else column
        for column, flag in COLUMNS.items()
    }
    texts, faults = dict[str, str](_DEFAULTS), list[str]()
    for given in layers:
        for pair in _INSTEAD:
            if given.keys() & set(pair):
                texts = {
                    column: text for column, text in texts.items() if column not in pair
                }
        texts |= given
    for column, text in tuple(texts.items()):
        try:
            _value(COLUMNS[column], text)
        except ValueError as error:
            faults.append(
                f"{name[column]} = {' '.join(text.split())[:LONGEST_ECHO]} {error}"
            )
            texts = {other: text for other, text in texts.items() if other != column}
    for one, other in _INSTEAD:
        if one in layers[-1] and other in layers[-1]:
            faults.append(
                f"{name[other]} and {name[one]} exclude each other; give one of them"
            )
    acting = {
        column: texts.get(column, flag.default) for column, flag in COLUMNS.items()
    }
    values = {
        field: None
        if (given_text := acting[flag.column]) is None
        else _value(flag, given_text)
        for field, flag in FLAGS.items()
    }
    return Request(texts, **values), faults


def profile_faults(request: Request) -> list[tuple[str, str]]:
    """Faults of the profiles, as (column, message), one line each."""
    columns = ("wheel", "rail", *(["left_wheel"] if request.left_wheel else []))
    return [
        (column, line) for column in columns for line in _faults(request.source(column))
    ]


@lru_cache(maxsize=256)
def _faults(source: tuple[Any, ...]) -> list[str]:
    try:
        profile_of(*source)
    except ProfileError as error:
        return str(error).splitlines()
    return []


def conditions(points: Sequence[Request]) -> tuple[ContactConditions, float]:
    """Operating conditions of points of a batch, with shifts and loads by forces.

    And the share of the distance that a wheelset by force runs past a jump of its
    force, 0 without one.
    """
    first = points[0]

    def column(name: str) -> Any:
        return np.array([getattr(point, name) for point in points], dtype=np.float64)

    loads, friction, flange = (
        column("loads"),
        column("friction"),
        column("friction_flange"),
    )
    apart = first.problem[1].coupled_difference
    given = ContactConditions(
        shift=column("shift"),
        yaw=column("yaw"),
        roll=np.zeros(len(points))
        if first.free_roll
        else np.nan_to_num(column("roll")),
        wheel_load=loads if (loads[:, 0] != loads[:, 1]).any() else loads[:, 0],
        speed=column("speed"),
        friction=friction,
        track_curvature=column("track_curvature"),
        rotation=first.rule if isinstance(first.rule, str) else column("rule"),
        torque=column("torque"),
        free_roll=first.free_roll,
        creepage=None if first.creepage is None else column("creepage"),
        friction_flange=None
        if np.isnan(flange).all()
        else np.where(np.isnan(flange), friction, flange),
        speed_difference=np.full(len(points), apart) if apart else None,
    )
    if not first.balanced:
        return given, 0.0
    controlled = Controlled(column("lateral_force"))
    shared = np.isfinite(column("axle_load"))
    given = replace(given, box_moment=np.where(shared, 0.0, np.nan))
    try:
        running = settle(given, controlled, *first.problem)
    except StateError as error:
        raise ContactError("; ".join(error.messages.values()), row=0) from None
    return running.conditions(given), 0.0 if running.beyond is None else float(
        running.beyond.share[0]
    )


def solve_batch(
    points: Sequence[Request], *, fields: bool = False
) -> tuple[xr.Dataset, list[Result]]:
    """Solve points that have `Request.batch` in common.

    Returns
    -------
    contact : Dataset
        That of `solve_contact`.
    results : list of dict
        SI units and names of each point as `--json` prints them.
    """
    first, (found, past) = points[0], conditions(points)
    wheelset, counterface, models = first.problem
    load = "wheel" if first.normal_force is None else "normal_force"
    options: Any = {
        "sides": _SIDES[first.side],
        "load": load,
        "threads": available_cores(),
    }
    try:
        contact = solve_contact(
            wheelset, counterface, found, models, fields=fields, **options
        )
    except (
        ContactError
    ) as error:  # the user does not know the index of the point in the batch
        text = str(error).removeprefix(f"point {error.row}, ")
        raise type(error)(text, row=error.row, rows=error.rows) from None
    patches = contact[list(PATCH_NAMES)].to_dataframe()[["point", "side", *PATCH_NAMES]]
    roll, speed = contact["roll"].values, contact["rotation_speed"].values
    shift = found.axle_shift(roll)
    if not (
        np.isfinite(patches[list(PATCH_NAMES)].values).all() and np.isfinite(roll).all()
    ):
        raise NumericalError("the solution is not finite; use other models")
    results: list[Result] = [
        {
            "shift": float(shift[k]),
            "yaw": point.yaw,
            "roll": float(roll[k]),
            "wheel_load": None
            if point.normal_force is not None
            else sum(point.loads) / 2.0,
            "counterface_curvature": point.counterface_curvature,
            "rotation_speed": None if point.creepage is not None else float(speed[k]),
            "patches": [],
        }
        | ({} if point.lateral_force is None else {"share_beyond_jump": past})
        for k, point in enumerate(points)
    ]
    if first.side == "both":
        forces = _forces(contact).to_dict("records")
        results = [
            result | {"wheelset": each}
            for result, each in zip(results, forces, strict=True)
        ]
    for patch in patches.assign(
        normal=first.normal, tangential=first.tangential
    ).to_dict("records"):
        results[patch.pop("point")]["patches"].append(patch)
    return contact, results


def _forces(contact: xr.Dataset) -> pd.DataFrame:
    """Table of the forces on the wheelset at each point, names as in results.

    Independent wheels have rotation speeds of their own.
    """
    count = contact.sizes["operating_point"]
    place = 2 * contact["point"].values + (contact["side"].values == "left")

    def of_wheels(name: str) -> FloatArray:
        return (
            np.bincount(place, contact[name].values, 2 * count)
            .astype(float)
            .reshape(-1, 2)
        )

    lateral, vertical = of_wheels("track_lateral"), of_wheels("track_vertical")
    quotient = np.array([-1.0, 1.0]) * lateral / vertical
    columns = {"lateral_force": -lateral.sum(axis=1)}
    for name, values in ("derailment_quotient", quotient), ("wheel_load", vertical):
        columns |= {f"{name}_right": values[:, 0], f"{name}_left": values[:, 1]}
    if "wheel_rotation_speed" in contact:
        turning = np.zeros(2 * count)
        turning[place] = contact["wheel_rotation_speed"].values
        right, left = turning.reshape(-1, 2).T
        columns |= {"rotation_speed_right": right, "rotation_speed_left": left}
    columns["steering_moment"] = of_wheels("track_yaw_moment").sum(axis=1)
    columns["axle_wear_number"] = (
        of_wheels("power").sum(axis=1) / contact["speed"].values
    )
    return pd.DataFrame(columns)


def solve_points(points: Sequence[Request]) -> list[Result | ContactError]:
    """Solve any points, each as if it were alone.

    Those of one batch are solved together.

    Returns
    -------
    list
        Result of each point, or why it has none; its message does not count the point.
    """
    batches: dict[Any, list[int]] = {}
    for index, request in enumerate(points):
        batches.setdefault(request.batch, []).append(index)
    solved: dict[int, Result | ContactError] = {}
    for left in batches.values():
        while left:
            try:
                solved |= zip(
                    left, solve_batch([points[index] for index in left])[1], strict=True
                )
            except ContactError as error:
                if len(left) == 1 or error.row is None:
                    solved |= dict.fromkeys(left, error)
                else:  # each alone for its own message
                    solved |= {
                        left[row]: solve_points([points[left[row]]])[0]
                        for row in error.rows
                    }
            left = [index for index in left if index not in solved]
    return [solved[index] for index in range(len(points))]
