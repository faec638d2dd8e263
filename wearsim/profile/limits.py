"""What the gauge values of a wheel make of limits: margin and transgression, with source and certainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from wearsim.profile.limits_file import LIMITED, DiameterRange, Limit, LimitSet, load_limits
from wearsim.profile.measures import Measures, WheelsetMeasures

__all__ = [
    "LIMITED",
    "NO_DIAMETER",
    "DiameterRange",
    "Judgement",
    "Limit",
    "LimitSet",
    "judge",
    "judge_wheelset",
    "load_limits",
]

_ROUNDING = 1e-9  # what is no transgression [m]: far below what can be measured
NO_DIAMETER = "depends on the wheel diameter, which is not given"
"""Reason of what cannot be told without a diameter."""

_ANY_DIAMETER = "any diameter listed"
_NOT_MEASURED = "not measured"
_BOUNDS: tuple[Literal["min", "max"], ...] = ("min", "max")


@dataclass(frozen=True)
class Judgement:
    """One measure against one bound.

    Parameters
    ----------
    measure : str
        Name in `wearsim.quantities`.
    value : float or None
        Measured, SI; None: not measured.
    bound : {"min", "max"}
        Which.
    limit : float or None
        Its value, SI; None: it depends on a diameter that is not known, or there is none for it.
    margin : float or None
        What is left, negative beyond the limit.
    exceeded : bool or None
        Whether the value is beyond; None: cannot be told, see `reason`.
    condition : str
        Diameters it holds for, such as "D > 840 mm"; empty: all.
    source, certainty : str
        Of the limit.
    reason : str
        Why it cannot be told; empty if it can.
    """

    measure: str
    value: float | None
    bound: Literal["min", "max"]
    limit: float | None
    margin: float | None
    exceeded: bool | None
    condition: str
    source: str
    certainty: str
    reason: str = ""


def judge(
    measures: Measures | Mapping[str, float],
    limits: LimitSet | Sequence[Limit],
    *,
    diameter: float | None = None,
) -> list[Judgement]:
    """Compare measures with limits.

    Parameters
    ----------
    measures : Measures or mapping of str to float
        SI, by name.
    limits : LimitSet or sequence of Limit
        From `load_limits`.
    diameter : float, optional
        Wheel diameter that chooses among the limits; `wheel_diameter` of the measures if not given [m].

    Returns
    -------
    list of Judgement
        In the order of the limits, one for each bound of each measure that is measured or was tried.
        Without a diameter, a value beyond the limits of all diameters is exceeded (with the margin to the
        most lenient one), one within all of them is within (to the strictest one); anything else cannot be
        told.
    """
    values = measures.values if isinstance(measures, Measures) else measures
    missing = measures.missing if isinstance(measures, Measures) else {}
    all_limits = limits.limits if isinstance(limits, LimitSet) else tuple(limits)
    diameter = values.get("wheel_diameter") if diameter is None else diameter
    result: list[Judgement] = []
    groups: dict[tuple[str, str], list[Limit]] = {}
    for limit in all_limits:
        groups.setdefault((limit.measure, limit.source), []).append(limit)
    for (measure, _), group in groups.items():
        if measure not in values and measure not in missing:
            continue
        for bound in _BOUNDS:
            result += _judged(measure, bound, values.get(measure), missing.get(measure, ""), group, diameter)
    return result


def judge_wheelset(
    wheelset: WheelsetMeasures, limits: LimitSet | Sequence[Limit], *, diameter: float | None = None
) -> dict[str, list[Judgement]]:
    """Compare the measures of a wheelset with limits.

    Parameters
    ----------
    wheelset : WheelsetMeasures
        Of both wheels.
    limits : LimitSet or sequence of Limit
        From `load_limits`.
    diameter : float, optional
        That chooses among the limits; if not given that of each wheel, of the axle the smaller one, if both
        are known [m].

    Returns
    -------
    dict of str to list of Judgement
        "right", "left" and "axle".
    """
    known = [
        m.values["wheel_diameter"] for m in (wheelset.right, wheelset.left) if "wheel_diameter" in m.values
    ]
    smaller = min(known) if len(known) == 2 else None  # a wheel of unknown size may be the smaller one
    of_axle = diameter if diameter is not None else smaller
    return {
        "right": judge(wheelset.right, limits, diameter=diameter),
        "left": judge(wheelset.left, limits, diameter=diameter),
        "axle": judge(wheelset.axle, limits, diameter=of_axle),
    }


def _judged(
    measure: str,
    bound: Literal["min", "max"],
    value: float | None,
    why_missing: str,
    group: list[Limit],
    diameter: float | None,
) -> list[Judgement]:
    """Judgements on one bound by the limits of one source."""
    if diameter is None:
        always = [limit for limit in group if not limit.diameters.text]
        result = [
            _by_number(measure, bound, value, why_missing, limit, number)
            for limit in always
            if (number := _number(limit, bound)) is not None
        ]
        return result + _by_all(measure, bound, value, why_missing, [x for x in group if x not in always])
    bounded = [(limit, number) for limit in group if (number := _number(limit, bound)) is not None]
    chosen = [(limit, number) for limit, number in bounded if diameter in limit.diameters]
    if bounded and not chosen:
        first = bounded[0][0]
        reason = f"no limit is given for a wheel diameter of {diameter * 1e3:.6g} mm"
        if value is None:
            reason = why_missing or _NOT_MEASURED
        return [Judgement(measure, value, bound, None, None, None, "", first.source, first.certainty, reason)]
    return [_by_number(measure, bound, value, why_missing, limit, number) for limit, number in chosen]


def _by_number(
    measure: str,
    bound: Literal["min", "max"],
    value: float | None,
    why_missing: str,
    limit: Limit,
    number: float,
    condition: str | None = None,
) -> Judgement:
    """Judgement by one number; the condition is that of the limit if no other is told."""
    margin = None if value is None else _margin(measure, bound, value, number)
    return Judgement(
        measure,
        value,
        bound,
        number,
        margin,
        None if margin is None else margin < -_ROUNDING,
        limit.diameters.text if condition is None else condition,
        limit.source,
        limit.certainty,
        "" if value is not None else why_missing or _NOT_MEASURED,
    )


def _by_all(
    measure: str, bound: Literal["min", "max"], value: float | None, why_missing: str, ranges: list[Limit]
) -> list[Judgement]:
    """Judge by limits of which one holds, but nobody knows which: beyond all of them, within all, or open."""
    bounded = [(limit, number) for limit in ranges if (number := _number(limit, bound)) is not None]
    if not bounded:
        return []
    bounded.sort(key=lambda pair: pair[1], reverse=bound == "max")
    (lenient, loose), (strict, tight) = bounded[0], bounded[-1]
    if len(ranges) == 1:
        return [_by_number(measure, bound, value, why_missing, lenient, loose)]
    if value is None:
        number = loose if loose == tight else None
        reason = why_missing or _NOT_MEASURED
        return [
            Judgement(measure, None, bound, number, None, None, "", strict.source, strict.certainty, reason)
        ]
    # diameters for which this bound is not given do not condemn a value
    everywhere = len(bounded) == len(ranges)
    if everywhere and _margin(measure, bound, value, loose) < -_ROUNDING:
        return [_by_number(measure, bound, value, "", lenient, loose, _ANY_DIAMETER)]
    if _margin(measure, bound, value, tight) >= -_ROUNDING:
        return [_by_number(measure, bound, value, "", strict, tight, _ANY_DIAMETER)]
    return [
        Judgement(measure, value, bound, None, None, None, "", strict.source, strict.certainty, NO_DIAMETER)
    ]


def _margin(measure: str, bound: str, value: float, number: float) -> float:
    """Return what is left to a limit, negative beyond it."""
    size = abs(value) if measure == "wheel_diameter_difference" else value
    return size - number if bound == "min" else number - size


def _number(limit: Limit, bound: str) -> float | None:
    return limit.least if bound == "min" else limit.most
