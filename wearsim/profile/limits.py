"""What the gauge values of a wheel make of limits: margin and transgression, with source and certainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from wearsim.profile.limits_file import LIMITED, DiameterRange, Limit, LimitSet, load_limits
from wearsim.profile.measures import Measures, WheelsetMeasures

__all__ = [
    "LIMITED",
    "DiameterRange",
    "Judgement",
    "Limit",
    "LimitSet",
    "judge",
    "judge_wheelset",
    "load_limits",
]

_ROUNDING = 1e-9  # what is no transgression [m]: far below what can be measured
_BOUNDS: tuple[Literal["min", "max"], ...] = ("min", "max")


@dataclass(frozen=True)
class Judgement:
    """One measure against one bound.

    Parameters
    ----------
    measure : str
        Name in `wearsim.nomenclature`.
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
        Without a diameter, limits that depend on it are told as such unless all agree.
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
        That chooses among the limits; if not given that of each wheel, of the axle the smaller one [m].

    Returns
    -------
    dict of str to list of Judgement
        "right", "left" and "axle".
    """
    known = [
        m.values["wheel_diameter"] for m in (wheelset.right, wheelset.left) if "wheel_diameter" in m.values
    ]
    of_axle = diameter if diameter is not None else min(known, default=None)
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
    bounded = [(limit, number) for limit in group if (number := _number(limit, bound)) is not None]
    if not bounded:
        return []
    first = bounded[0][0]
    chosen = bounded
    condition: str | None = None
    if diameter is not None:
        chosen = [(limit, number) for limit, number in bounded if diameter in limit.diameters]
        reason = f"no limit is given for a wheel diameter of {diameter * 1e3:.6g} mm"
    elif len({number for _, number in bounded}) == 1:
        chosen, condition = bounded[:1], "any diameter listed" if len(bounded) > 1 else None
    elif len(bounded) > 1:
        chosen = [(limit, number) for limit, number in bounded if not limit.diameters.text]
        reason = "depends on the wheel diameter, which is not given"
    if not chosen:
        return [Judgement(measure, value, bound, None, None, None, "", first.source, first.certainty, reason)]
    result = []
    for limit, number in chosen:
        margin = exceeded = None
        if value is not None:
            size = abs(value) if measure == "wheel_diameter_difference" else value
            margin = size - number if bound == "min" else number - size
            exceeded = margin < -_ROUNDING
        text = limit.diameters.text if condition is None else condition
        reason = "" if value is not None else why_missing or "not measured"
        result.append(
            Judgement(
                measure, value, bound, number, margin, exceeded, text, limit.source, limit.certainty, reason
            )
        )
    return result


def _number(limit: Limit, bound: str) -> float | None:
    return limit.least if bound == "min" else limit.most
