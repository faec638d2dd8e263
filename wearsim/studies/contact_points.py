"""Operating points of `wearsim contact`: tables of texts to SI values, and solved."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.contact.dataset import Side, solve_contact
from wearsim.contact.equilibrium import RULES, TORQUE_RULES
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import (
    PAIRS,
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.registry import Registry
from wearsim.contact.solve import available_cores
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import LONGEST_ECHO, ContactError, NumericalError, ProfileError
from wearsim.operation.controlled import Controlled
from wearsim.operation.states import StateError, settle
from wearsim.profile.files import load_profile
from wearsim.profile.placement import slope_of, with_sharp_ends
from wearsim.profile.shape import Profile
from wearsim.profile.sources import half_span
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import (
    COLUMNS,
    FLAGS,
    Flag,
    Models,
    Motion,
    flags_of,
)
from wearsim.toml_faults import decimal

SIDES_OF: dict[str, tuple[Side, ...]] = {
    "right": ("right",),
    "left": ("left",),
    "both": ("right", "left"),
}
_OPPOSITE = {"right": "left", "left": "right", "both": "both"}
_WORDS = {  # allowed texts, besides numbers where the flag has a quantity
    "side": tuple(SIDES_OF),
    "roll": ("free",),
    "rotation": tuple(RULES),
    "rail_ends": ("open", "sharp"),
    "model": tuple(PAIRS),
    "normal": tuple(sorted(NORMAL_MODELS)),
    "tangential": tuple(sorted(TANGENTIAL_MODELS)),
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
# values in which points that are solved together may differ
_EACH = set(flags_of(Motion)) - {"side"} | {
    "curve_radius",
    "track_curvature",
    "rule",
    "load_right",
    "load_left",
}
_TO_THE_RIGHT = (
    "shift_mm",
    "yaw_mrad",
    "roll",
    "curve_radius_m",
    "lateral_force_kN",
    "creepage",
)
_NUMBERS = {
    field
    for field, flag in FLAGS.items()
    if flag.quantity and flag.column not in (*_WORDS, *_WHOLE)
}
_PROFILES = {  # fields of the arguments of `profile_of`
    "wheel": ["wheel", "smooth"],
    "rail": [
        "rail",
        "smooth",
        "inclination",
        "gauge",
        "back_to_back",
        "gauge_height",
        "rail_ends",
    ],
    "left_wheel": ["left_wheel", "smooth"],
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

_STATE = (
    "shift",
    "yaw",
    "roll",
    "wheel_load",
    "counterface_curvature",
    "rotation_speed",
    "share_beyond_jump",
)

RowFaults = list[tuple[int, str]]
"""Row and message of each fault."""


@dataclass(frozen=True)
class Points:
    """Operating points, one row each.

    Parameters
    ----------
    texts : DataFrame
        Texts that act by column of `COLUMNS`, None where none acts.
    values : DataFrame
        SI values by field of `FLAGS`, NaN or None where none is given, and those that
        follow from them: `counterface_curvature` of the roller, 0 of a rail;
        `track_curvature`; `balanced`, true if shift or wheel loads follow from forces;
        `free_roll`, true if the wheelset rests on both wheels; `rule` of the rotation
        speed, or the speed; `load_right` and `load_left` of the wheels, the normal
        force where that is given; names of the models.
    """

    texts: pd.DataFrame
    values: pd.DataFrame

    def batches(self) -> list[pd.DataFrame]:
        """Values of points that are solved in one call.

        A point by forces is alone: those without a state do not stop others.
        """
        values = self.values
        keys = [values[name] for name in values if name not in _EACH]
        keys += [values["rule"].where(values["ruled"], "")]
        keys += [values["normal_force"].notna(), values["creepage"].notna()]
        keys += [values.index.to_series().where(values["balanced"], -1)]
        return [part for _, part in values.groupby(keys, sort=False, dropna=False)]


@dataclass(frozen=True)
class Solution:
    """Solved operating points; rows are those of the points.

    Parameters
    ----------
    points : DataFrame
        Shift, yaw, roll, wheel load, curvature of the counterface, rotation speed and,
        for a given lateral force, the share of the distance past its jump, by row.
    forces : DataFrame
        Forces on the wheelset by row, where both wheels are solved.
    patches : DataFrame
        Row `point`, side, `PATCH_NAMES` and models of each patch.
    errors : dict
        Reason of each row without a solution.
    """

    points: pd.DataFrame
    forces: pd.DataFrame
    patches: pd.DataFrame
    errors: dict[int, ContactError]


def operating_points(
    given: pd.DataFrame, flags: Mapping[str, str] | None = None, *, dashes: bool = False
) -> tuple[Points, RowFaults]:
    """Validate texts by column, one row per operating point.

    Parameters
    ----------
    given : DataFrame
        Texts by column of `COLUMNS`, None where none is given.
    flags : mapping, optional
        Texts that act on all rows where the row gives none.
    dashes : bool
        True to name columns as flags in messages.

    Returns
    -------
    points : Points
        Of all texts that are right, and defaults.
    faults : list
        All that is wrong, by row.
    """
    given = given.dropna(axis=1, how="all")
    texts = _layered_texts(given, pd.DataFrame(flags or {}, given.index))
    named = {c: f"--{flag.name}" if dashes else c for c, flag in COLUMNS.items()}
    values: dict[str, Any] = {}
    faults: RowFaults = []
    for field, flag in FLAGS.items():
        column = flag.column
        default = None if flag.default is None else _value(flag, flag.default)
        kind = float if field in _NUMBERS else None
        if column not in given and column not in (flags or ()):
            values[field] = math.nan if kind and default is None else default
            continue
        codes, distinct = pd.factorize(texts[column])
        parsed, messages = list[Any](), dict[int, str]()
        for code, text in enumerate(distinct):
            try:
                parsed.append(_value(flag, text))
            except ValueError as error:
                parsed.append(default)
                echo = " ".join(text.split())[:LONGEST_ECHO]
                messages[code] = f"{named[column]} = {echo} {error}"
        values[field] = pd.Series([*parsed, default], dtype=kind).iloc[codes].array
        wrong = np.isin(codes, list(messages))
        rows = zip(given.index[wrong], codes[wrong], strict=True)
        faults += [(row, messages[code]) for row, code in rows]
        texts.loc[wrong, column] = None
    for first, second in _INSTEAD:
        if first not in given or second not in given:
            continue
        both = given[first].notna() & given[second].notna()
        fault = f"{named[second]} and {named[first]} exclude each other"
        faults += [(row, f"{fault}; give one of them") for row in given.index[both]]
    return Points(
        texts, _with_derived_values(pd.DataFrame(values, given.index))
    ), faults


def _layered_texts(*layers: pd.DataFrame) -> pd.DataFrame:
    """Texts that act: those of the first layer before the second before defaults.

    A text also acts in place of those that it excludes.
    """
    defaults = {column: flag.default for column, flag in COLUMNS.items()}
    texts = pd.DataFrame(defaults, layers[0].index, dtype=object)
    for layer in reversed(layers):
        for pair in _INSTEAD:
            if excluding := [column for column in pair if column in layer]:
                rows = layer[excluding].notna().any(axis=1)
                for excluded in pair:
                    texts[excluded] = texts[excluded].mask(rows)
        for column, cells in layer.items():
            texts[column] = cells.where(cells.notna(), texts[column])
    return texts


def _value(flag: Flag, text: str) -> Any:
    """SI value of the text of a flag; raises ValueError with the end of the message."""
    words = _WORDS.get(flag.column, ())
    if text in words:
        return text
    if reader := _READERS.get(flag.column):
        return reader(text)
    if flag.quantity:
        return _number(flag, text)
    if words:
        registry = _REGISTRIES.get(flag.column)
        reason = None if registry is None else registry.unusable.get(text)
        raise ValueError(reason or f"must be one of {', '.join(words)}")
    return text


def _number(flag: Flag, text: str) -> float:
    quantity, number = QUANTITIES[flag.quantity], decimal(text)
    low, high, above = quantity.range
    signed, whole = flag.column == "curve_radius_m", flag.column in _WHOLE
    size = abs(number) if signed else number
    if not low <= size <= high or (above and size == low) or (whole and number % 1.0):
        what = [*_WORDS.get(flag.column, ()), "a whole number" if whole else "a number"]
        limits = " of magnitude" if signed else " above 0 and" if above else ""
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        comma = "; the decimal mark is a point" if "," in text else ""
        meaning = flag.meaning.partition(" (")[0]
        raise ValueError(
            f"must be {' or '.join(what)}{limits} from {low:g} to {high:g}{unit} "
            f"({meaning}){comma}"
        )
    shown = quantity.shown_factor
    value = number * (1.0 / shown if shown >= 1.0 else round(1.0 / shown))
    return int(value) if whole else value


def _creepage(text: str) -> tuple[float, ...]:
    numbers = tuple(map(decimal, text.split(",")))
    if len(numbers) != 3:
        raise ValueError(
            "must be three numbers with commas between them: XI_X,XI_Y,SPIN"
        )
    for name, number in zip(("creepage_x", "creepage_y", "spin"), numbers, strict=True):
        limit = QUANTITIES[name].range.high / QUANTITIES[name].shown_factor
        if not abs(number) <= limit:
            raise ValueError(f"must have a {name} from {-limit:g} to {limit:g}")
    return numbers


_READERS = {"inclination": slope_of, "creepage": _creepage}
_REGISTRIES: dict[str, Registry[Any]] = {
    "normal": NORMAL_MODELS,
    "tangential": TANGENTIAL_MODELS,
}


def _with_derived_values(values: pd.DataFrame) -> pd.DataFrame:
    """Values of the flags with those that follow from them."""
    given, creepage = values.notna(), values["creepage"].notna()
    pair = values["model"].fillna("standard").map(PAIRS).str
    balanced = given["axle_load"] | given["lateral_force"]
    unknown = ~given["roll"] & ((values["side"] == "both") | balanced)
    mean = values["normal_force"].fillna(values["wheel_load"])
    mean = (0.5 * values["axle_load"]).fillna(mean)
    apart = given["wheel_load_right"] & given["wheel_load_left"]
    return values.assign(
        smooth=values["smooth"].fillna(0.0),
        left_wheel=values["left_wheel"].fillna(values["wheel"]),
        counterface_curvature=(1.0 / values["roller_radius"]).fillna(0.0),
        track_curvature=(1.0 / values["curve_radius"]).fillna(0.0),
        balanced=balanced,
        free_roll=(values["roll"] == "free") | unknown,
        rule=values["rotation"].mask(creepage, "nominal"),
        ruled=creepage | values["rotation"].isin(RULES),
        load_right=values["wheel_load_right"].where(apart, mean),
        load_left=values["wheel_load_left"].where(apart, mean),
        normal=values["normal"].fillna(pair[0]),
        tangential=values["tangential"].fillna(pair[1]),
    )


def conflicts(points: Points) -> RowFaults:
    """List values of a point that exclude each other, at most one of each row."""
    values, given = points.values, points.values.notna()
    kinds = {
        "creepages are given for the single patch of one wheel; choose the right or "
        "the left side": given["creepage"] & (values["side"] == "both"),
        "a torque has no effect where the rotation speed or creepages are given; leave "
        "it out": (values["torque"] != 0.0) & ~values["rule"].isin(TORQUE_RULES),
        "friction falls with the slip velocity where friction ratio is below 1 and "
        "friction decrease above 0; give both": (values["friction_ratio"] < 1.0)
        != (values["friction_decrease"] > 0.0),
        "the load of one wheel is given; give those of both, right and left": given[
            "wheel_load_right"
        ]
        != given["wheel_load_left"],
        "the radius of the left roller is given; give that of the right one, roller "
        "radius, too": given["roller_radius_left"] & ~given["roller_radius"],
        "forces are balanced by a wheelset that is free to roll; leave out the roll": (
            values["balanced"] & given["roll"] & (values["roll"] != "free")
        ),
    }
    first = np.select(list(kinds.values()), list(kinds), "")
    return [
        (row, text)
        for row, text in zip(values.index, first.tolist(), strict=True)
        if text
    ]


def profile_faults(points: Points) -> list[tuple[int, str, str]]:
    """List faults of the profiles: row, column and message, each once."""
    faults: dict[tuple[str, str], int] = {}
    for column, names in _PROFILES.items():
        given = points.values.loc[points.texts[column].notna(), names]
        for row, *source in given.drop_duplicates().itertuples(name=None):
            for line in _faults(tuple(source)):
                faults.setdefault((column, line), row)
    return [(row, *fault) for fault, row in faults.items()]


@lru_cache(maxsize=256)
def _faults(source: tuple[Any, ...]) -> list[str]:
    try:
        profile_of(*source)
    except ProfileError as error:
        return str(error).splitlines()
    return []


@lru_cache(maxsize=256)
def profile_of(name: str, smooth: float, *placing: Any) -> Profile:
    """Profile of a wheel, or of a rail in the track, read once.

    `placing` is inclination, gauge, back-to-back distance, height of the gauge, and
    "sharp" for a body that ends where its points end.
    """
    if not placing:
        return load_profile(name, "wheel", smooth=smooth)
    inclination, gauge, back_to_back, height, ends = placing
    rail = load_profile(
        name,
        "rail",
        smooth=smooth,
        inclination=inclination,
        gauge=gauge,
        half_span=half_span(back_to_back),
        gauge_height=height,
    )
    return with_sharp_ends(rail) if ends == "sharp" else rail


def sources(values: pd.DataFrame, column: str) -> list[tuple[Any, ...]]:
    """Arguments of `profile_of` for wheel, rail or left_wheel of each point."""
    return list(values[_PROFILES[column]].itertuples(index=False, name=None))


def problem_of(values: pd.DataFrame) -> tuple[Wheelset, Counterface, ContactModels]:
    """Wheelset, rails or rollers, and contact models of points of a batch."""
    first = values.iloc[0]
    right, rail, left = (
        profile_of(*sources(values.iloc[:1], column)[0]) for column in _PROFILES
    )
    radius = first["roller_radius_left"]
    left_curvature = None if pd.isna(radius) else 1.0 / radius
    return (
        Wheelset(right, left, first["wheel_radius"], half_span(first["back_to_back"])),
        Counterface(
            rail, first["counterface_curvature"], left_curvature=left_curvature
        ),
        ContactModels(
            **{name: first[name] for name in flags_of(Models) if name != "model"}
        ),
    )


def mirrored(points: Points) -> Points:
    """Mirror images of points without faults."""
    image = points.texts.copy()
    for column in _TO_THE_RIGHT:
        image[column] = image[column].map(_mirrored_number, na_action="ignore")
    image["side"] = image["side"].map(_OPPOSITE)
    for right, left in (
        ("wheel", "left_wheel"),
        ("wheel_load_right_kN", "wheel_load_left_kN"),
    ):
        turned = image[left].fillna(image[right])
        image[left] = image[right].where(image[left].notna(), None)
        image[right] = turned
    return operating_points(image)[0]


def _mirrored_number(text: str) -> str:
    """Text of a number turned round; a longitudinal creepage keeps its sign."""
    parts = text.split(",")
    half = len(parts) // 2
    return ",".join([*parts[:half], *map(_negative, parts[half:])])


def _negative(text: str) -> str:
    number = decimal(text)
    return text if math.isnan(number) else f"{0.0 - number:.15g}"


def conditions(values: pd.DataFrame) -> tuple[ContactConditions, float]:
    """Operating conditions of points of a batch, with shifts and loads by forces.

    And the share of the distance that a wheelset by force runs past a jump of its
    force, 0 without one.
    """
    first, count = values.iloc[0], len(values)
    column = {
        name: values[name].to_numpy()
        for name in ("shift", "yaw", "speed", "friction", "track_curvature")
    }
    loads = values[["load_right", "load_left"]].to_numpy()
    flange = values["friction_flange"].to_numpy()
    roll = np.zeros(count)
    if not first["free_roll"]:
        roll = np.nan_to_num(values["roll"].to_numpy(np.float64))
    apart = problem_of(values)[1].coupled_difference
    given = ContactConditions(
        **column,
        roll=roll,
        wheel_load=loads if (loads[:, 0] != loads[:, 1]).any() else loads[:, 0],
        rotation=first["rule"]
        if first["ruled"]
        else values["rule"].to_numpy(np.float64),
        torque=values["torque"].to_numpy(np.float64),
        free_roll=bool(first["free_roll"]),
        creepage=np.array(values["creepage"].tolist())
        if isinstance(first["creepage"], tuple)
        else None,
        friction_flange=None
        if np.isnan(flange).all()
        else np.where(np.isnan(flange), column["friction"], flange),
        speed_difference=np.full(count, apart) if apart else None,
    )
    if not first["balanced"]:
        return given, 0.0
    controlled = Controlled(values["lateral_force"].to_numpy())
    moment = np.where(values["axle_load"].notna(), 0.0, np.nan)
    given = replace(given, box_moment=moment)
    try:
        running = settle(given, controlled, *problem_of(values))
    except StateError as error:
        raise ContactError("; ".join(error.messages.values()), row=0) from None
    beyond = running.beyond
    return running.conditions(given), 0.0 if beyond is None else float(beyond.share[0])


def solve_batch(
    values: pd.DataFrame, *, fields: bool = False
) -> tuple[xr.Dataset, Solution]:
    """Solve points of one batch.

    Parameters
    ----------
    values : DataFrame
        One of `Points.batches`.
    fields : bool
        True if the dataset has strips and cells.

    Returns
    -------
    contact : Dataset
        That of `solve_contact`.
    solution : Solution
        Without errors.
    """
    first, (given, past) = values.iloc[0], conditions(values)
    wheelset, counterface, models = problem_of(values)
    by_patch = pd.notna(first["normal_force"])
    try:
        contact = solve_contact(
            wheelset,
            counterface,
            given,
            models,
            sides=SIDES_OF[first["side"]],
            load="normal_force" if by_patch else "wheel",
            threads=available_cores(),
            fields=fields,
        )
    except ContactError as error:  # the user does not know the number of the point
        raise type(error)(error.text, row=error.row, rows=error.rows) from None
    roll, rows = contact["roll"].values, values.index
    numbers = {name: contact[name].values for name in PATCH_NAMES}
    if not all(np.isfinite(number).all() for number in (roll, *numbers.values())):
        raise NumericalError("the solution is not finite; use other models")
    place = {"point": rows[contact["point"].values], "side": contact["side"].values}
    patches = pd.DataFrame(place | numbers).assign(
        normal=models.normal, tangential=models.tangential
    )
    load = 0.5 * (values["load_right"] + values["load_left"])
    points = pd.DataFrame(
        {
            "shift": given.axle_shift(roll),
            "yaw": values["yaw"],
            "roll": roll,
            "wheel_load": np.nan if by_patch else load,
            "counterface_curvature": values["counterface_curvature"],
            "rotation_speed": np.nan
            if given.creepage is not None
            else contact["rotation_speed"].values,
            "share_beyond_jump": np.where(
                values["lateral_force"].notna(), past, np.nan
            ),
        },
        index=rows,
    )
    points.loc[values["lateral_force"].isna(), "share_beyond_jump"] = np.nan
    forces = _forces(contact).set_axis(rows) if first["side"] == "both" else None
    return contact, Solution(
        points, pd.DataFrame() if forces is None else forces, patches, {}
    )


def _forces(contact: xr.Dataset) -> pd.DataFrame:
    """Sum the forces on the wheelset at each point, names as in results.

    Independent wheels have rotation speeds of their own.
    """
    count = contact.sizes["operating_point"]
    place = 2 * contact["point"].values + (contact["side"].values == "left")
    lateral, vertical, moment, power = (
        np.bincount(place, contact[name].values, 2 * count).reshape(-1, 2)
        for name in ("track_lateral", "track_vertical", "track_yaw_moment", "power")
    )
    quotient = np.array([-1.0, 1.0]) * lateral / vertical
    turning = {}
    if "wheel_rotation_speed" in contact:
        speed = np.zeros(2 * count)
        speed[place] = contact["wheel_rotation_speed"].values
        right, left = speed.reshape(-1, 2).T
        turning = {"rotation_speed_right": right, "rotation_speed_left": left}
    return pd.DataFrame(
        {
            "lateral_force": -lateral.sum(axis=1),
            "derailment_quotient_right": quotient[:, 0],
            "derailment_quotient_left": quotient[:, 1],
            "wheel_load_right": vertical[:, 0],
            "wheel_load_left": vertical[:, 1],
            **turning,
            "steering_moment": moment.sum(axis=1),
            "axle_wear_number": power.sum(axis=1) / contact["speed"].values,
        }
    )


def solve_points(points: Points) -> Solution:
    """Solve any points, each as if it were alone.

    Those of one batch are solved together; errors do not count the point.
    """
    parts: list[Solution] = []
    errors: dict[int, ContactError] = {}
    waiting = points.batches()
    while waiting:
        values = waiting.pop()
        try:
            parts.append(solve_batch(values)[1])
        except ContactError as error:
            if len(values) == 1 or error.row is None:
                errors |= dict.fromkeys(values.index.tolist(), error)
                continue
            # each alone for its own message
            failed = np.isin(np.arange(len(values)), error.rows)
            waiting += [values.iloc[[row]] for row in error.rows]
            if not failed.all():
                waiting.append(values[~failed])
    columns = ("point", "side", *PATCH_NAMES, "normal", "tangential")
    patches = _concatenated([part.patches for part in parts], columns)
    return Solution(
        _concatenated([part.points for part in parts], _STATE).sort_index(),
        _concatenated([part.forces for part in parts]).sort_index(),
        patches.sort_values("point", kind="stable", ignore_index=True),
        dict(sorted(errors.items())),
    )


def _concatenated(
    frames: list[pd.DataFrame], columns: Sequence[str] = ()
) -> pd.DataFrame:
    rows = [frame for frame in frames if len(frame)]
    return pd.concat(rows) if rows else pd.DataFrame(columns=list(columns))
