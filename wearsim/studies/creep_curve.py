r"""Fit of a measured creep curve: Kalker factor and falling friction.

Steady rolling is linear but for friction: with the Kalker factor k and the friction
coefficient :math:`\mu` the traction coefficient at the creepage c is

.. math:: f(c) = \mu \, g(k c / \mu), \qquad
    \mu = \mu_0 [(1 - A) e^{-B V |c|} + A]

with one function g of each direction of c [1]_. It is solved once, at many multiples of
each measured creepage; the four numbers are least squares.

References
----------
.. [1] O. Polach, Wear 258 (2005) 992-1000, doi:10.1016/j.wear.2004.03.046.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator
from scipy.optimize import OptimizeResult, least_squares

from wearsim.contact.friction import falling_friction
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import available_cores, solve
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_points import Points, conditions, problem_of
from wearsim.toml_faults import decimal

MEASURED = "traction_coefficient"
"""Column of a table with a measured creep curve."""
_FEWEST = 6  # rows of a curve
_FRICTION = 0.3  # at which g is solved
_MULTIPLES = np.geomspace(0.02, 50.0, 40)  # of each creepage at which g is solved
_LEAST_FRICTION = 0.01
# Friction falls if that lowers the sum of squares to this share.
_CLEARLY = 0.9
_LIMITS = (
    (QUANTITIES["kalker_factor"].span[0], _LEAST_FRICTION, 0.0, 0.0),
    (
        QUANTITIES["kalker_factor"].span[1],
        QUANTITIES["friction"].span[1],
        1.0,
        QUANTITIES["friction_decrease"].span[1],
    ),
)
"""Lower and upper limits of the four numbers."""
_AT_LIMIT = 1e-4  # nearer to a limit, a number is at it
_STARTS = ((0.9, 0.4, 0.1), (0.3, 0.4, 0.1), (0.9, 0.4, 1.0), (0.3, 0.4, 1.0))


class CreepCurve(NamedTuple):
    """Numbers of a fitted creep curve.

    Parameters
    ----------
    kalker_factor, friction : float
        Kalker factor and friction coefficient at rest [-].
    friction_ratio, friction_decrease : float
        A [-] and B [s/m]; 1 and 0 where the measured friction does not fall.
    deviation : float
        Root mean square of the deviations of the traction coefficients [-].
    """

    kalker_factor: float
    friction: float
    friction_ratio: float
    friction_decrease: float
    deviation: float

    @property
    def text(self) -> str:
        """The numbers by the keys of scenes."""
        keys = ("kalker_factor", "friction", "friction_ratio", "friction_decrease_s_m")
        # numbers of a friction that does not fall are not fitted
        free = 2 if self.friction_ratio == 1.0 else 4
        limits = [_limit_of(k, self[k]) if k < free else "" for k in range(4)]
        texts = [
            f"{key} = {value:.3g}{limit}"
            for key, value, limit in zip(keys, self, limits, strict=False)
        ]
        return f"{', '.join(texts)}; root mean square deviation {self.deviation:.2g}"


def _limit_of(index: int, value: float) -> str:
    """Name the limit at which a fitted number is, "" if it is at none."""
    low, high = (ends[index] for ends in _LIMITS)
    names = {low: " (at its lower limit)", high: " (at its upper limit)"}
    return names.get(value, "")


def row_faults(cells: pd.DataFrame) -> list[tuple[int, str]]:
    """Faults of the cells of a measured curve by column, with the line of each."""
    if MEASURED not in cells:
        return []
    low, high = QUANTITIES[MEASURED].span
    faults = []
    for line, text in cells[MEASURED].items():
        if not low <= decimal(text) <= high:
            message = (
                f"{MEASURED} = {text or 'nothing'} must be a number from {low:g} to "
                f"{high:g}, the magnitude of creep force over normal force"
            )
            faults.append((int(str(line)), message))
    given = cells.get("creepage", pd.Series("", cells.index))
    without = cells.index[given == ""].tolist()
    message = f"a row with {MEASURED} needs its creepage: XI_X, or XI_X,XI_Y,SPIN"
    return [*faults, *((line, message) for line in without)]


def curve_faults(cells: pd.DataFrame, points: Points) -> list[str]:
    """Faults of the rows of a measured curve together; none of other tables."""
    if MEASURED not in cells:
        return []
    faults = []
    if len(cells) < _FEWEST:
        faults.append(
            f"a creep curve of {len(cells)} rows has too few for its four numbers; "
            f"give at least {_FEWEST}"
        )
    if len(points.batches()) > 1:
        faults.append(
            f"rows with {MEASURED} are one creep curve: give all of them the same "
            "wheel, rail, side, kind of load and models"
        )
    if not any(any(creepage[:2]) for creepage in points.values["creepage"]):
        faults.append("a creep curve needs rows with creepage")
    return faults


def fitted(points: Points, traction: FloatArray) -> CreepCurve:
    r"""Fit Kalker factor and falling friction [-] to a measured creep curve.

    Parameters
    ----------
    points : Points
        n points of one batch with given creepages, without faults.
    traction : (n,) array
        Measured creep force over normal force [-].

    Returns
    -------
    CreepCurve
        Friction falls where that lowers the sum of squares by a tenth.

    Raises
    ------
    ContactError
        If a point has no contact solution, or several patches.

    Notes
    -----
    Friction falls with the slip velocity V by
    :math:`\mu = \mu_0 [(1 - A) e^{-B V} + A]` [1]_.

    References
    ----------
    .. [1] O. Polach, Wear 258 (2005) 992-1000, doi:10.1016/j.wear.2004.03.046.
    """
    values = points.values
    curves = _normalised(values)
    creepage = np.array(values["creepage"].tolist())
    slip = values["speed"].to_numpy() * np.hypot(*creepage.T[:2])

    def deviations(numbers: FloatArray) -> FloatArray:
        factor, friction, ratio, decrease = numbers
        acting = friction * falling_friction(slip, ratio, decrease)
        multiple = factor * _FRICTION / np.maximum(acting, _LEAST_FRICTION)
        place = np.log(np.clip(multiple, _MULTIPLES[0], _MULTIPLES[-1]))
        share = [curve(at) for curve, at in zip(curves, place, strict=True)]
        return acting * np.array(share) - traction

    highest = float(np.clip(traction.max(), 2.0 * _LEAST_FRICTION, 0.95))
    low, high = map(list, _LIMITS)

    def best(falls: bool) -> OptimizeResult:
        free = 4 if falls else 2
        constant = np.array([] if falls else [1.0, 0.0])
        tries = [
            least_squares(
                lambda numbers: deviations(np.append(numbers, constant)),
                np.array([factor, highest, ratio, decrease])[:free],
                bounds=(low[:free], high[:free]),
                x_scale=np.array([0.1, 0.1, 0.1, 0.1])[:free],
            )
            for factor, ratio, decrease in _STARTS
        ]
        return min(tries, key=lambda result: float(result.cost))

    steady, falling = best(falls=False), best(falls=True)
    numbers = np.append(steady.x, [1.0, 0.0])
    if falling.cost < _CLEARLY * steady.cost:
        numbers = falling.x
    deviation = float(np.sqrt(np.mean(deviations(numbers) ** 2)))
    for ends in _LIMITS:  # which the fit approaches, but does not reach
        numbers = np.where(np.abs(numbers - ends) < _AT_LIMIT, ends, numbers)
    factor, friction, ratio, decrease = map(float, numbers)
    return CreepCurve(factor, friction, ratio, decrease, deviation)


def _normalised(values: pd.DataFrame) -> list[PchipInterpolator]:
    """Traction over friction coefficient of each point.

    They are functions of the logarithm of the multiple of its creepage.
    """
    first = values.iloc[0]
    wheelset, counterface, models = problem_of(values)
    given, _ = conditions(values)
    count, multiples = len(values), _MULTIPLES.size
    several = given.at(np.repeat(np.arange(count), multiples))
    assert several.creepage is not None
    several = replace(
        several,
        creepage=np.tile(_MULTIPLES, count)[:, None] * several.creepage,
        friction=np.full(count * multiples, _FRICTION),
        friction_flange=None,
    )
    clean = replace(
        models, kalker_factor=1.0, friction_ratio=1.0, friction_decrease=0.0
    )
    rolling = solve(
        several,
        wheelset,
        counterface,
        clean,
        sides=(0,) if first["side"] == "right" else (1,),
        vertical=bool(pd.isna(first["normal_force"])),
        threads=available_cores(),
    )
    share = np.hypot(rolling.force_x, rolling.force_y) / (
        _FRICTION * rolling.normal_force
    )
    return [
        PchipInterpolator(np.log(_MULTIPLES), shares)
        for shares in share.reshape(count, multiples)
    ]
