"""Operating points of `wearsim contact` solved in batches of what they have in common."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from wearsim.cli.contact_flags import Point, Settings
from wearsim.errors import ContactError, NumericalError, ProfileError

if TYPE_CHECKING:
    from wearsim.contact.solve import (
        ContactConditions,
        ContactModels,
        ContactSolution,
        Counterface,
        Wheelset,
    )
    from wearsim.profile.shape import Profile

PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
"""Numbers of each patch, names as in JSON and in the table of quantities."""

_SIDES = {"right": (0,), "left": (1,), "both": (0, 1)}
_REMOVALS = 3  # faulty points taken out of a batch one by one, before the rest is solved point by point


class PatchResult(NamedTuple):
    """One patch: its wheel and the numbers of `PATCH_NAMES`."""

    side: str
    values: dict[str, float]


class PointResult(NamedTuple):
    """One solved point; `rotation_speed` is None if creepages were given."""

    point: Point
    roll: float
    rotation_speed: float | None
    patches: tuple[PatchResult, ...]


class Problem(NamedTuple):
    """What `solve` is called with."""

    conditions: ContactConditions
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    options: dict[str, Any]


@lru_cache(maxsize=64)
def wheel_profile(name: str) -> Profile:
    """Wheel profile by name or file, read once."""
    from wearsim.profile.files import load_profile

    return load_profile(name, "wheel")


@lru_cache(maxsize=256)
def rail_profile(name: str, inclination: float, gauge: float, half_span: float) -> Profile:
    """Rail profile by name or file, placed in the track."""
    from wearsim.profile.files import load_profile

    return load_profile(name, "rail", inclination=inclination, gauge=gauge, half_span=half_span)


def profile_faults(settings: Settings) -> list[tuple[str, str]]:
    """Faults of the profiles, as (column, message), one line each."""
    faults = []
    try:
        wheel_profile(settings.wheel)
    except ProfileError as error:
        faults += [("wheel", line) for line in str(error).splitlines()]
    try:
        rail_profile(settings.rail, settings.inclination, settings.gauge, settings.half_span)
    except ProfileError as error:
        faults += [("rail", line) for line in str(error).splitlines()]
    return faults


def problem(points: Sequence[Point]) -> Problem:
    """Batch of points that share their settings and rules."""
    import numpy as np

    from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset

    first = points[0]
    shared = first.settings
    wheel = wheel_profile(shared.wheel)

    def column(values: Iterable[float]) -> Any:
        return np.array(list(values), dtype=np.float64)

    rotation: Any = first.rotation
    return Problem(
        ContactConditions(
            shift=column(p.shift for p in points),
            yaw=column(p.yaw for p in points),
            roll=column(p.roll or 0.0 for p in points),
            wheel_load=column(p.load for p in points),
            speed=column(p.speed for p in points),
            friction=column(p.friction for p in points),
            track_curvature=column(p.track_curvature for p in points),
            rotation=rotation if isinstance(rotation, str) else column(float(p.rotation) for p in points),
            free_roll=first.roll is None,
            creepage=None if first.creepage is None else np.array([p.creepage for p in points]),
        ),
        Wheelset(wheel, wheel, shared.wheel_radius, shared.half_span),
        Counterface(
            rail_profile(shared.rail, shared.inclination, shared.gauge, shared.half_span), shared.curvature
        ),
        ContactModels(
            normal=shared.normal,
            tangential=shared.tangential,
            strips=shared.strips,
            cells=shared.cells,
            youngs_modulus=shared.youngs_modulus,
            poisson_ratio=shared.poisson_ratio,
        ),
        {"sides": _SIDES[shared.side], "vertical": first.vertical},
    )


def results(solution: ContactSolution, points: Sequence[Point]) -> list[tuple[int, PointResult]]:
    """Results of a solution by index of the point; `solution` may hold some of the points only."""
    import numpy as np

    index = solution.point
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    numbers = np.stack([getattr(solution, name) for name in PATCH_NAMES], axis=1)
    found = []
    for start, stop in zip(starts, [*starts[1:], index.size], strict=True):
        given = points[index[start]]
        patches = tuple(
            PatchResult(
                "left" if solution.side[k] else "right",
                dict(zip(PATCH_NAMES, numbers[k].tolist(), strict=True)),
            )
            for k in range(start, stop)
        )
        speed = None if given.creepage is not None else float(solution.rotation_speed[start])
        found.append((int(index[start]), PointResult(given, float(solution.roll[start]), speed, patches)))
        if not (np.isfinite(numbers[start:stop]).all() and np.isfinite(solution.roll[start])):
            raise NumericalError("the solution is not finite; use other models", int(index[start]))
    return found


def solve_points(points: Sequence[Point]) -> list[PointResult | ContactError]:
    """Solve points, each as if it were alone.

    Parameters
    ----------
    points : sequence of Point
        Any points; those that share settings and rules are solved together.

    Returns
    -------
    list
        Result of each point, or why it has none; its message does not count the point.
    """
    groups: dict[Any, list[int]] = {}
    for index, given in enumerate(points):
        rule = given.rotation if isinstance(given.rotation, str) else "number"
        key = (given.settings, rule, given.vertical, given.roll is None, given.creepage is None)
        groups.setdefault(key, []).append(index)
    solved: dict[int, PointResult | ContactError] = {}
    for members in groups.values():
        answers = _together([points[index] for index in members])
        solved |= dict(zip(members, answers, strict=True))
    return [solved[index] for index in range(len(points))]


def _together(points: list[Point]) -> list[PointResult | ContactError]:
    """Solve a batch; if points have no answer, the others are solved without them."""
    from wearsim.contact.solve import CHUNK

    try:
        return list(_batch(points))
    except ContactError:
        if len(points) > CHUNK:  # other chunks need not be solved again and again
            chunks = [points[i : i + CHUNK] for i in range(0, len(points), CHUNK)]
            return [answer for chunk in chunks for answer in _together(chunk)]
    answers: dict[int, PointResult | ContactError] = {}
    left = list(range(len(points)))
    for _ in range(_REMOVALS):
        if not left:
            break
        try:
            answers |= dict(zip(left, _batch([points[i] for i in left]), strict=True))
            left = []
        except ContactError as error:
            if error.row is None:
                break
            answers[left.pop(error.row)] = _unnumbered(error)
    for i in left:
        try:
            answers[i] = _batch([points[i]])[0]
        except ContactError as error:
            answers[i] = _unnumbered(error)
    return [answers[i] for i in range(len(points))]


def _batch(points: list[Point]) -> list[PointResult]:
    from wearsim.contact.solve import solve_each

    conditions, wheelset, counterface, models, options = problem(points)
    parts = solve_each(
        conditions,
        wheelset,
        counterface,
        models,
        lambda solution: results(solution, points),
        threads=os.cpu_count() or 1,
        **options,
    )
    return [result for part in parts for _, result in part]


def solve_one(given: Point) -> tuple[Problem, ContactSolution, PointResult]:
    """Solve a single point and keep the whole solution."""
    from wearsim.contact.solve import solve

    made = problem([given])
    try:
        solution = solve(made.conditions, made.wheelset, made.counterface, made.models, **made.options)
        return made, solution, results(solution, [given])[0][1]
    except ContactError as error:
        raise _unnumbered(error) from None


def _unnumbered(error: ContactError) -> ContactError:
    """Return the error without the index of its point in the batch, which the user does not know."""
    return type(error)(str(error).removeprefix(f"point {error.row}, "), row=error.row)
