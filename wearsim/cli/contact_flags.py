"""Flags of `wearsim contact`, alike as columns of its table: defaults, allowed values, SI values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from wearsim.quantities import QUANTITIES


class Flag(NamedTuple):
    """One flag. As a column of a table it has underscores for dashes."""

    name: str
    default: str | None
    meaning: str
    group: str = ""
    kind: str = "number"
    factor: float = 1.0  # to SI
    low: float = 0.0
    high: float = 0.0

    @property
    def column(self) -> str:
        """Name as a column."""
        return self.name.replace("-", "_")


def _range(name: str) -> tuple[float, float]:
    return QUANTITIES[name].span


_BODIES, _MOTION, _MODELS = "wheelset and counterface", "motion and load", "models"

FLAGS = (
    Flag("wheel", "S1002", "wheel profile, name or file", _BODIES, "word"),
    Flag("rail", "60E1", "rail or roller profile, name or file", _BODIES, "word"),
    Flag("inclination", "1:40", "of the rail, 1:N or none", _BODIES, "inclination"),
    Flag("gauge-mm", "1435", "gauge, 14 mm below the top", _BODIES, "number", 1e-3, *_range("gauge")),
    Flag("flange-back-mm", "1360", "distance of the flange backs", _BODIES, "number", 1e-3,
         *_range("back_to_back")),
    Flag("wheel-radius-mm", "460", "wheel radius at the tape circle", _BODIES, "number", 1e-3,
         *_range("wheel_radius")),
    Flag("roller-radius-mm", None, "roller radius at its top; without it: rail", _BODIES, "number",
         1e-3, *_range("roller_radius")),
    Flag("curve-radius-m", None, "curve radius, positive to the right; without it: tangent", _BODIES, "curve",
         1.0, -_range("curve_radius")[1], _range("curve_radius")[1]),
    Flag("shift-mm", "0", "lateral shift of the wheelset, positive to the right", _MOTION, "number",
         1e-3, *_range("shift")),
    Flag("yaw-mrad", "0", "yaw of the wheelset, positive to the right", _MOTION, "number",
         1e-3, *_range("yaw")),
    Flag("roll", None, "roll of the wheelset in mrad, right side down positive, or free: it rests on both "
         "wheels (default free with --side both, else 0)", _MOTION, "roll", 1e-3, *_range("roll")),
    Flag("wheel-load-kN", "80", "vertical load of each wheel", _MOTION, "number", 1e3, *_range("wheel_load")),
    Flag("normal-force-kN", None, "instead of the wheel load: normal force of the single patch of each wheel",
         _MOTION, "number", 1e3, *_range("normal_force")),
    Flag("friction", "0.35", "friction coefficient", _MOTION, "number", 1.0, *_range("friction")),
    Flag("speed-km-h", "72", "speed", _MOTION, "number", 1.0 / 3.6, *_range("speed")),
    Flag("rotation", "free", "rotation speed: free (axle torque balance of both wheels), centred, nominal, "
         "or rad/s", _MOTION, "rotation", 1.0, *_range("rotation_speed")),
    Flag("creepage", None, "instead of the rotation: given creepages XI_X,XI_Y,SPIN (spin in 1/m) of the "
         "single patch of one wheel", _MOTION, "creepage"),
    Flag("side", "right", "which wheel: right, left or both", _MOTION, "side"),
    Flag("normal", "kik_piotrowski", "normal contact model", _MODELS, "model"),
    Flag("tangential", "fastsim", "tangential contact model", _MODELS, "model"),
    Flag("youngs-GPa", "210", "Young's modulus of both bodies", _MODELS, "number", 1e9,
         *_range("youngs_modulus")),
    Flag("poisson", "0.3", "Poisson's ratio of both bodies", _MODELS, "number", 1.0,
         *_range("poisson_ratio")),
    Flag("strips", "30", "strips across the patch", _MODELS, "count", 1.0, *_range("strips")),
    Flag("cells", "30", "cells along each strip", _MODELS, "count", 1.0, *_range("cells")),
)  # fmt: skip

COLUMNS = {flag.column: flag for flag in FLAGS}
"""Flags by their name as a column."""

_TIGHTEST_CURVE = _range("curve_radius")[0]
_INSTEAD = (("wheel_load_kN", "normal_force_kN"), ("rotation", "creepage"))  # only one of each pair acts


class Point(NamedTuple):
    """One operating point with everything that acts on it, SI units."""

    shift: float
    yaw: float
    roll: float | None  # None: free
    load: float
    vertical: bool  # whether `load` is the wheel load, not the normal force
    friction: float
    speed: float
    track_curvature: float
    rotation: str | float
    creepage: tuple[float, float, float] | None
    settings: Settings


class Settings(NamedTuple):
    """What points solved in one batch have in common."""

    side: str
    wheel: str
    rail: str
    inclination: float
    gauge: float
    half_span: float
    wheel_radius: float
    curvature: float
    normal: str
    tangential: str
    youngs_modulus: float
    poisson_ratio: float
    strips: int
    cells: int


def merged(flags: Mapping[str, str], row: Mapping[str, str]) -> dict[str, str]:
    """Texts that act, by column: those of a row before those of the flags before the defaults.

    Parameters
    ----------
    flags, row : mapping
        Texts that are given, by column; what is empty is not among them.
    """
    texts = {column: flag.default for column, flag in COLUMNS.items() if flag.default is not None}
    for given in (flags, row):
        for pair in _INSTEAD:
            if any(column in given for column in pair):
                for column in pair:
                    texts.pop(column, None)
        texts.update(given)
    texts.setdefault("roll", "free" if texts["side"] == "both" else "0")
    return texts


def faults_of(given: Mapping[str, str], *, as_flags: bool) -> list[str]:
    """All that is wrong with values given together, one line each.

    Parameters
    ----------
    given : mapping
        Texts by column.
    as_flags : bool
        Whether to name them as flags.
    """

    def name(column: str) -> str:
        return "--" + COLUMNS[column].name if as_flags else column

    faults = []
    for column, text in given.items():
        wrong = value(column, text)[1]
        if wrong:
            faults.append(f"{name(column)} = {' '.join(text.split())[:60]} {wrong}")
    faults += [
        f"{name(other)} and {name(one)} exclude each other; give one of them"
        for one, other in _INSTEAD
        if one in given and other in given
    ]
    return faults


def without_faults(given: Mapping[str, str]) -> dict[str, str]:
    """Those of the given texts that stand for a value, so that the rest can be checked with them."""
    good = {column: text for column, text in given.items() if value(column, text)[1] is None}
    for one, other in _INSTEAD:
        if one in good and other in good:
            del good[other]
    return good


def conflict(texts: Mapping[str, str]) -> str | None:
    """Tell what merged texts contradict each other."""
    if "creepage" in texts and texts["side"] == "both":
        return "creepages are given for the single patch of one wheel; choose the right or the left side"
    return None


def point(texts: Mapping[str, str]) -> Point:
    """Operating point of merged texts without faults."""
    of: dict[str, Any] = {column: value(column, text)[0] for column, text in texts.items()}
    roller, curve = of.get("roller_radius_mm"), of.get("curve_radius_m")
    force = of.get("normal_force_kN")
    return Point(
        shift=of["shift_mm"],
        yaw=of["yaw_mrad"],
        roll=of["roll"],
        load=of["wheel_load_kN"] if force is None else force,
        vertical=force is None,
        friction=of["friction"],
        speed=of["speed_km_h"],
        track_curvature=0.0 if curve is None else 1.0 / curve,
        rotation=of.get("rotation", "nominal"),
        creepage=of.get("creepage"),
        settings=Settings(
            side=of["side"],
            wheel=of["wheel"],
            rail=of["rail"],
            inclination=of["inclination"],
            gauge=of["gauge_mm"],
            half_span=0.5 * of["flange_back_mm"] + 0.070,
            wheel_radius=of["wheel_radius_mm"],
            curvature=0.0 if roller is None else 1.0 / roller,
            normal=of["normal"],
            tangential=of["tangential"],
            youngs_modulus=of["youngs_GPa"],
            poisson_ratio=of["poisson"],
            strips=of["strips"],
            cells=of["cells"],
        ),
    )


@lru_cache(maxsize=65536)
def value(column: str, text: str) -> tuple[Any, str | None]:
    """SI value of a text, or what is wrong with it.

    Returns
    -------
    value : float, int, str, tuple or None
        None for a free roll and for faulty texts.
    wrong : str or None
        The end of a sentence that begins with name and text.
    """
    flag = COLUMNS[column]
    if flag.kind == "word":
        # a zero byte ends file names for the operating system
        return (None, "must not hold zero bytes") if "\0" in text else (text, None)
    if flag.kind == "side":
        return (text, None) if text in ("right", "left", "both") else (None, "must be right, left or both")
    if flag.kind == "model":
        return _model(flag, text)
    if flag.kind == "inclination":
        return _inclination(text)
    if flag.kind == "rotation":
        return _rotation(flag, text)
    if flag.kind == "creepage":
        return _creepage(text)
    if flag.kind == "roll" and text == "free":
        return None, None
    number = _number(text)
    if not flag.low <= number <= flag.high:
        word = "free or a number" if flag.kind == "roll" else "a number"
        comma = "; the decimal mark is a point" if "," in text else ""
        meaning = "roll of the wheelset in mrad" if flag.kind == "roll" else flag.meaning
        return None, f"must be {word} from {flag.low:g} to {flag.high:g} ({meaning}){comma}"
    if flag.kind == "count":
        return (int(number), None) if number == int(number) else (None, "must be a whole number")
    if flag.kind == "curve" and abs(number) < _TIGHTEST_CURVE:
        return None, f"must not lie within {_TIGHTEST_CURVE:g} m of 0; leave it out on tangent track"
    return number * flag.factor, None


def _number(text: str) -> float:
    """Value of a plain decimal, NaN of anything else; Python alone would accept 1_000 and Arabic digits."""
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan


def _model(flag: Flag, text: str) -> tuple[str | None, str | None]:
    names: Any
    if flag.name == "normal":
        from wearsim.contact.normal import NORMAL_MODELS as names
    else:
        from wearsim.contact.tangential import TANGENTIAL_MODELS as names
    return (text, None) if text in names else (None, f"is not one of {', '.join(sorted(names))}")


def _inclination(text: str) -> tuple[float | None, str | None]:
    """Slope of the rail's axis from 1:N or none."""
    if text == "none":
        return 0.0, None
    low, high = _range("inclination_ratio")
    first, _, second = text.partition(":")
    if first.strip() == "1" and second.strip().isdecimal() and low <= int(second[:9]) <= high:
        return 1.0 / int(second), None
    return None, f"must be 1:N with N from {low:g} to {high:g}, or none; 60E1 mostly lies at 1:40"


def _rotation(flag: Flag, text: str) -> tuple[str | float | None, str | None]:
    """Rule or rotation speed [rad/s]."""
    from wearsim.contact.equilibrium import RULES

    if text in RULES:
        return text, None
    speed = _number(text)
    if not flag.low < speed <= flag.high:
        return None, f"must be {', '.join(RULES)}, or a speed above 0 and up to {flag.high:g} rad/s"
    return speed, None


def _creepage(text: str) -> tuple[tuple[float, ...] | None, str | None]:
    numbers = [_number(part) for part in text.split(",")]
    if len(numbers) != 3:
        return None, "must be three numbers with commas between them: XI_X,XI_Y,SPIN"
    names = {"XI_X": "creepage_x", "XI_Y": "creepage_y", "SPIN": "spin"}
    for (name, quantity), number in zip(names.items(), numbers, strict=True):
        limit = _range(quantity)[1] / QUANTITIES[quantity].shown_factor
        if not abs(number) <= limit:
            return None, f"must have {name} from {-limit:g} to {limit:g}{' 1/m' if name == 'SPIN' else ''}"
    return tuple(numbers), None
