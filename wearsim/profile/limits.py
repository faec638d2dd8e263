"""Limits of gauge values: files of limits, and the margin of measures to them.

Each limit has its source and certainty.

A file of limits is TOML: `title`, `source` and `certainty` of the whole, then
`[[limit]]` tables with `measure`, `min_mm` and `max_mm` (`min` and `max` of quantities
without unit), where needed the wheel diameters it holds for, `diameter_mm = { above =
760, up_to = 840 }` (`above` and `below` exclude their number, `from` and `up_to`
include it), and where it differs its own `source` and `certainty`.

A file may state where its limits are valid: `gauge_mm = [1430, 1470]` and
`back_to_back_mm = [1355, 1365]`, and how they are measured: `measuring_height_mm` of Sd
above the running circle and `running_circle_mm` from the flange back. `wearsim profile`
takes no set by default on another gauge or wheelset, and limits of Sd measured at
another height are left open. `left_out` names limits of that railway whose numbers are
not in the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from wearsim.errors import ProfileError, listed, suggestion
from wearsim.profile.measures import EN_15313, Measures, MeasuringRule
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.toml_faults import Table, cross_check, read_toml

_Limited = Literal[
    "flange_height",
    "flange_thickness",
    "flange_gradient",
    "hollowing",
    "rim_width",
    "wheel_diameter",
    "wheel_diameter_difference",
    "back_to_back",
    "front_to_front",
    "equivalent_conicity",
]
LIMITED: tuple[str, ...] = _Limited.__args__  # type: ignore[attr-defined]
"""Measures that may have limits; a diameter difference counts by its magnitude."""

NO_DIAMETER = "depends on the wheel diameter, which is not given"
"""Reason for a missing value that depends on a diameter."""

_ROUNDING = 1e-9  # least transgression [m], far below what can be measured
_ANY_DIAMETER = "any diameter listed"
_NOT_MEASURED = "not measured"
_AT_HEIGHT = ("flange_thickness", "front_to_front")
"""Measures that depend on the height of Sd."""
_AT_CIRCLE = (*_AT_HEIGHT, "flange_height", "flange_gradient", "wheel_diameter")
"""Measures that depend on the place of the running circle."""
_BOUNDS: tuple[Literal["min", "max"], ...] = ("min", "max")


DEFAULT_LIMITS = "TSI"
"""Shipped set that is taken by default where it is valid."""

Bound = Annotated[float | None, Field(ge=0, lt=1e6)]
_Length = Annotated[float, Field(gt=0, lt=1e6)]
_Range = Annotated[tuple[_Length, _Length] | None, Strict(False)]


class Diameters(Table):
    """Wheel diameters for which a limit is valid [mm].

    `above` and `below` exclude their number.
    """

    above: Bound = None
    at_least: Bound = Field(None, alias="from")
    up_to: Bound = None
    below: Bound = None

    @model_validator(mode="after")
    def _one_lower_and_one_upper(self) -> Self:
        form = "diameter_mm must be like { above = 760, up_to = 840 } (or from, below)"
        lower, upper = (self.above, self.at_least), (self.up_to, self.below)
        if lower == upper == (None, None) or None not in lower or None not in upper:
            raise cross_check(f"{form}, with one lower or one upper end or both")
        low, high = self._ends
        if low >= high:
            raise cross_check(f"diameter_mm: {low:g} must be below {high:g}")
        return self

    @property
    def _ends(self) -> tuple[float, float]:
        low = max(
            (bound for bound in (self.above, self.at_least) if bound is not None),
            default=0.0,
        )
        return low, min(
            (bound for bound in (self.up_to, self.below) if bound is not None),
            default=math.inf,
        )

    def __contains__(self, diameter: float) -> bool:
        """Return True for a diameter [m] in the range, in whole micrometres."""
        d, (low, high) = round(1e3 * diameter, 3), self._ends
        return low <= d <= high and d not in (self.above, self.below)

    @property
    def text(self) -> str:
        """Text such as "760 < D <= 840 mm"."""
        low, high = self._ends
        first, last = (
            "<" if self.at_least is None else "<=",
            "<" if self.up_to is None else "<=",
        )
        if high == math.inf:
            return f"D {first.replace('<', '>')} {low:g} mm"
        return f"{f'{low:g} {first} ' if low > 0.0 else ''}D {last} {high:g} mm"


class Limit(Table):
    """Limit of one `[[limit]]` table."""

    measure: _Limited = Field(description=f"one of {', '.join(LIMITED)}")
    min: Bound = None
    max: Bound = None
    min_mm: Bound = None
    max_mm: Bound = None
    diameter_mm: Diameters | None = None
    source: str = ""
    certainty: str = ""

    @model_validator(mode="after")
    def _bounds_fit(self) -> Self:
        unit = self._unit
        for key in ("min", "max", "min_mm", "max_mm"):
            if getattr(self, key) is not None and not key.endswith(
                unit or ("min", "max")
            ):
                text = (
                    f"{key} is no key of a limit of {self.measure}; give min{unit}, "
                    f"max{unit}"
                )
                raise cross_check(text, key)
        least, most = (getattr(self, f"{bound}{unit}") for bound in _BOUNDS)
        if least is None and most is None:
            raise cross_check(f"gives no min{unit} and no max{unit} of {self.measure}")
        if least is not None and most is not None and least > most:
            raise cross_check(
                f"min{unit} = {least:g} is above max{unit} = {most:g}", f"min{unit}"
            )
        return self

    @property
    def _unit(self) -> str:
        return "_mm" if QUANTITIES[self.measure].unit == "m" else ""

    def holds_for(self, diameter: float | None) -> bool:
        """Return True for a wheel diameter in its range, and for an unknown one."""
        return (
            diameter is None or self.diameter_mm is None or diameter in self.diameter_mm
        )

    def bound(self, name: str) -> float | None:
        """Return the bound "min" or "max" in SI units, or None."""
        value: float | None = getattr(self, f"{name}{self._unit}")
        return value / 1e3 if value is not None and self._unit else value

    @property
    def condition(self) -> str:
        """Valid diameters, such as "D > 840 mm", empty for all."""
        return "" if self.diameter_mm is None else self.diameter_mm.text


class _LimitsFile(Table):
    """File of limits."""

    title: str = ""
    source: str = ""
    certainty: str = ""
    left_out: str = ""
    gauge_mm: _Range = None
    back_to_back_mm: _Range = None
    measuring_height_mm: Annotated[float | None, Field(ge=5, le=20)] = None
    running_circle_mm: Annotated[float | None, Field(ge=55, le=85)] = None
    limit: tuple[Limit, ...] = Field(
        min_length=1, description="at least one [[limit]] table"
    )

    @model_validator(mode="after")
    def _ranges_rise(self) -> Self:
        for key in ("gauge_mm", "back_to_back_mm"):
            if (ends := getattr(self, key)) is not None and ends[0] >= ends[1]:
                raise cross_check(
                    f"{key}: {ends[0]:g} must be below {ends[1]:g}; give the smallest "
                    "and the largest value, such as [1430, 1470]",
                    key,
                )
        return self

    @model_validator(mode="after")
    def _have_sources(self) -> Self:
        unsourced = [
            limit.measure for limit in self.limit if not all(self.about(limit).values())
        ]
        if unsourced:
            text = (
                f"the limits of {listed(unsourced)} have no source or certainty; give "
                "it for each limit or for the file"
            )
            raise cross_check(text, "limit")
        return self

    def about(self, limit: Limit) -> dict[str, str]:
        """Source and certainty of a limit, by default those of the file."""
        keys = ("source", "certainty")
        return {
            key: getattr(limit, key).strip() or getattr(self, key).strip()
            for key in keys
        }


@dataclass(frozen=True)
class LimitSet:
    """Limits of one file, in its order, with the name and title of the set.

    Each limit has its source and certainty.
    """

    name: str
    title: str
    limits: tuple[Limit, ...]
    left_out: str = ""  # limits of the railway whose numbers are not known
    # where they are valid, None: not stated [m]
    gauge: tuple[float, float] | None = None
    back_to_back: tuple[float, float] | None = None
    # how they are measured, None: not stated [m]
    measuring_height: float | None = None
    running_circle: float | None = None

    def foreign(self, gauge: float | None, back_to_back: float | None) -> str:
        """Reason why the limits are not valid for a stated gauge or distance [m].

        It is empty where they are valid or nothing is stated.
        """
        for what, value, ends in (
            ("gauge", gauge, self.gauge),
            ("back-to-back distance", back_to_back, self.back_to_back),
        ):
            if value is not None and ends and not ends[0] <= value <= ends[1]:
                return (
                    f"those of {self.name} are for a {what} of {1e3 * ends[0]:g} to "
                    f"{1e3 * ends[1]:g} mm, stated are {1e3 * value:g} mm"
                )
        return ""

    def measured_otherwise(self, measure: str, rule: MeasuringRule) -> str:
        """Reason why a measure taken by a rule is not that of the limits, or ""."""
        height, circle = self.measuring_height, self.running_circle
        if measure in _AT_CIRCLE and _differ(circle, rule.running_circle):
            return (
                f"the limits are for a running circle {1e3 * (circle or 0.0):g} mm "
                f"from the flange back, measured at {1e3 * rule.running_circle:g} mm"
            )
        if measure in _AT_HEIGHT and _differ(height, rule.height):
            return (
                f"the limits are for Sd {1e3 * (height or 0.0):g} mm above the running "
                f"circle, measured at {1e3 * rule.height:g} mm"
            )
        return ""


def _differ(stated: float | None, value: float) -> bool:
    """Return True for two lengths [m] that differ by more than rounding."""
    return stated is not None and abs(stated - value) > _ROUNDING


def shipped_limits() -> list[str]:
    """Names of the shipped sets of limits."""
    folder = shipped_path("profiles", "limits")
    return sorted(path.stem for path in folder.glob("*.toml"))


def load_limits(name_or_path: str | Path = "TSI") -> LimitSet:
    """Load limits by the name of a shipped set, such as "TSI", or from a file.

    The format is described at the head of this module. Raises `ProfileError` with all
    faults of the file, ``file:line: message``, or if there is no such set.
    """
    path = Path(name_or_path)
    if not path.is_file() and not path.suffix and len(path.parts) == 1:
        names = shipped_limits()
        if path.name not in names:
            near = suggestion(path.name, names)
            raise ProfileError(
                f"{str(name_or_path)!r} is neither a file nor a shipped set of limits "
                f"({listed(names)}){near}"
            )
        path = shipped_path("profiles", "limits") / f"{path.name}.toml"
    if not path.is_file():
        raise ProfileError(f"{path}: no such file of limits")
    data, faults = read_toml(path, _LimitsFile)
    if data is None:
        raise ProfileError("\n".join(map(str, faults)))
    limits = tuple(limit.model_copy(update=data.about(limit)) for limit in data.limit)
    return LimitSet(
        path.stem,
        data.title.strip() or path.stem,
        limits,
        data.left_out.strip(),
        _in_metres(data.gauge_mm),
        _in_metres(data.back_to_back_mm),
        _metres(data.measuring_height_mm),
        _metres(data.running_circle_mm),
    )


def _metres(length: float | None) -> float | None:
    return None if length is None else length / 1e3


def _in_metres(ends: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if ends is None else (ends[0] / 1e3, ends[1] / 1e3)


@dataclass(frozen=True)
class Judgement:
    """Comparison of one measure with one bound, SI units."""

    wheel: str  # measured body: "right", "left" or "axle"
    measure: str  # name in `wearsim.quantities`
    value: float | None  # None: not measured
    bound: Literal["min", "max"]
    limit: (
        float | None
    )  # None: it depends on a diameter that is not known, or there is none for it
    margin: float | None  # margin to the limit, negative beyond it
    exceeded: bool | None  # None: undecided, see `reason`
    condition: str  # valid diameters, such as "D > 840 mm"; empty: all
    source: str
    certainty: str
    reason: str = ""  # reason why it is undecided


def judge(
    measures: Mapping[str, Measures], limits: LimitSet, rule: MeasuringRule = EN_15313
) -> list[Judgement]:
    """Compare the measures of "right", "left" and "axle", or of one wheel, with limits.

    The wheel diameter selects the limits; for an axle it is that of the smaller wheel
    if both are known, because a wheel of unknown size may be the smaller one. Without a
    diameter, a value beyond the limits of all diameters is exceeded (with the margin to
    the most lenient one), and one within all of them is within (with the margin to the
    strictest one). Any other value is undecided, and so is a measure that the `rule`
    takes at another place than that of the limits.
    """
    diameters = {
        body: body_measures.values.get("wheel_diameter")
        for body, body_measures in measures.items()
        if body != "axle"
    }
    if "axle" in measures:
        sizes = [size for size in diameters.values() if size is not None]
        diameters["axle"] = min(sizes) if len(sizes) == 2 else None
    groups: dict[tuple[str, str], list[Limit]] = {}
    for limit in limits.limits:
        groups.setdefault((limit.measure, limit.source), []).append(limit)
    return [
        _unless_otherwise(
            _judged(body, body_measures, group, bound, diameters[body]),
            limits.measured_otherwise(measure, rule),
        )
        for body, body_measures in measures.items()
        for (measure, _), group in groups.items()
        if measure in body_measures.values or measure in body_measures.missing
        for bound in _BOUNDS
        if any(limit.bound(bound) is not None for limit in group)
    ]


def _unless_otherwise(judgement: Judgement, reason: str) -> Judgement:
    """Comparison, undecided if there is a reason why the measure is another one."""
    if not reason:
        return judgement
    return replace(judgement, margin=None, exceeded=None, reason=reason)


def _acting(
    group: list[Limit],
    stated: list[tuple[Limit, float]],
    rooms: list[float],
    diameter: float | None,
) -> tuple[Limit, float | None, str, str]:
    """Limit that acts, its number, its condition, and why none is compared.

    Parameters
    ----------
    group : list of Limit
        Of one measure and source, for several diameters.
    stated : list of tuple
        Those with this bound that may act, and the bound, the strictest first.
    rooms : list of float
        Margin to each of these, negative beyond it.
    diameter : float, optional
        Of the wheel [m].
    """
    if diameter is not None and not stated:
        reason = f"no limit is given for a wheel diameter of {diameter * 1e3:.6g} mm"
        return group[0], None, "", reason
    if diameter is not None or len(group) == 1:
        return *stated[0], stated[0][0].condition, ""
    if len(stated) == len(group) and rooms[-1] < -_ROUNDING:
        # Diameters without this bound would accept any value.
        return *stated[-1], _ANY_DIAMETER, ""
    if rooms[0] >= -_ROUNDING:
        return *stated[0], _ANY_DIAMETER, ""
    return stated[0][0], None, "", NO_DIAMETER


def _judged(
    body: str,
    measures: Measures,
    group: list[Limit],
    bound: Literal["min", "max"],
    diameter: float | None,
) -> Judgement:
    """Compare a measure with one bound of one source, given for several diameters."""
    measure = group[0].measure
    value = measures.values.get(measure)
    size = abs(value or 0.0) if measure == "wheel_diameter_difference" else value or 0.0
    sign = -1.0 if bound == "min" else 1.0
    stated = [
        (limit, number)
        for limit in group
        if (number := limit.bound(bound)) is not None and limit.holds_for(diameter)
    ]
    stated.sort(key=lambda pair: sign * pair[1])  # the strictest first
    # margin to each bound, negative beyond it
    rooms = [sign * (number - size) for _, number in stated]
    if value is None and diameter is None and len(group) > 1:
        limit = stated[0][0]
        condition = reason = ""
        number = stated[0][1] if stated[0][1] == stated[-1][1] else None
    else:
        limit, number, condition, reason = _acting(group, stated, rooms, diameter)
    margin = None if number is None or value is None else sign * (number - size)
    return Judgement(
        body,
        measure,
        value,
        bound,
        number,
        margin,
        None if margin is None else margin < -_ROUNDING,
        condition,
        limit.source,
        limit.certainty,
        reason if value is not None else measures.missing.get(measure) or _NOT_MEASURED,
    )
