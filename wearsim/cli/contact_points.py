"""Operating points of `wearsim contact` solved in batches of what they have in common."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from wearsim.cli.contact_request import Request
from wearsim.errors import ContactError, NumericalError, ProfileError

if TYPE_CHECKING:
    from wearsim.contact.solve import ContactConditions, ContactModels, ContactSolution, Counterface, Wheelset
    from wearsim.profile.shape import Profile

PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
"""Numbers of each patch, names as in JSON and in the table of quantities."""

_SIDES = {"right": (0,), "left": (1,), "both": (0, 1)}


class PointResult(NamedTuple):
    """One solved point; `rotation_speed` is None if creepages were given.

    Each patch holds its side and the numbers of `PATCH_NAMES`.
    """

    request: Request
    roll: float
    rotation_speed: float | None
    patches: tuple[dict[str, Any], ...]


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


def profile_faults(request: Request) -> list[tuple[str, str]]:
    """Faults of the profiles, as (column, message), one line each."""
    faults = []
    for column, read, given in (
        ("wheel", wheel_profile, (request.wheel,)),
        ("rail", rail_profile, request.placed_rail),
    ):
        try:
            read(*given)
        except ProfileError as error:
            faults += [(column, line) for line in str(error).splitlines()]
    return faults


def problem(points: Sequence[Request]) -> Problem:
    """Batch of points that have all in common that `Request.batch` holds."""
    import numpy as np

    from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset

    first = points[0]
    wheel = wheel_profile(first.wheel)

    def column(name: str) -> Any:
        return np.array([getattr(point, name) for point in points], dtype=np.float64)

    return Problem(
        ContactConditions(
            shift=column("shift"),
            yaw=column("yaw"),
            roll=np.zeros(len(points)) if first.free_roll else np.nan_to_num(column("roll")),
            wheel_load=column("load"),
            speed=column("speed"),
            friction=column("friction"),
            track_curvature=column("track_curvature"),
            rotation=first.rule if isinstance(first.rule, str) else column("rule"),
            free_roll=first.free_roll,
            creepage=None if first.creepage is None else column("creepage"),
        ),
        Wheelset(wheel, wheel, first.wheel_radius, first.half_span),
        Counterface(rail_profile(*first.placed_rail), first.counterface_curvature),
        ContactModels(
            normal=first.normal,
            tangential=first.tangential,
            strips=first.strips,
            cells=first.cells,
            youngs_modulus=first.youngs,
            poisson_ratio=first.poisson,
        ),
        {"sides": _SIDES[first.side], "vertical": first.normal_force is None},
    )


def _results(solution: ContactSolution, points: Sequence[Request]) -> list[PointResult]:
    """Results of a solution, which may hold some of the points only."""
    import numpy as np

    index = solution.point
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    numbers = np.stack([getattr(solution, name) for name in PATCH_NAMES], axis=1)
    results = []
    for start, stop in zip(starts, [*starts[1:], index.size], strict=True):
        request = points[index[start]]
        if not (np.isfinite(numbers[start:stop]).all() and np.isfinite(solution.roll[start])):
            raise NumericalError("the solution is not finite; use other models", int(index[start]))
        patches = tuple(
            {"side": "left" if solution.side[k] else "right"}
            | dict(zip(PATCH_NAMES, numbers[k].tolist(), strict=True))
            for k in range(start, stop)
        )
        speed = None if request.creepage is not None else float(solution.rotation_speed[start])
        results.append(PointResult(request, float(solution.roll[start]), speed, patches))
    return results


def solve_points(points: Sequence[Request]) -> list[PointResult | ContactError]:
    """Solve points, each as if it were alone.

    Parameters
    ----------
    points : sequence of Request
        Any points; those of one batch are solved together.

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
    """Solve a batch; if points have no solution, halves of it, down to single points."""
    try:
        return list(_batch(points))
    except ContactError as error:
        if len(points) == 1:
            return [_unnumbered(error)]
    half = len(points) // 2
    return _together(points[:half]) + _together(points[half:])


def _batch(points: list[Request]) -> list[PointResult]:
    from wearsim.contact.solve import solve_each

    conditions, wheelset, counterface, models, options = problem(points)
    parts = solve_each(
        conditions,
        wheelset,
        counterface,
        models,
        lambda solution: _results(solution, points),
        threads=os.cpu_count() or 1,
        **options,
    )
    return [result for part in parts for result in part]


def solve_one(request: Request) -> tuple[Problem, ContactSolution, PointResult]:
    """Solve a single point and keep the whole solution."""
    from wearsim.contact.solve import solve

    made = problem([request])
    try:
        solution = solve(made.conditions, made.wheelset, made.counterface, made.models, **made.options)
        return made, solution, _results(solution, [request])[0]
    except ContactError as error:
        raise _unnumbered(error) from None


def _unnumbered(error: ContactError) -> ContactError:
    """Return the error without the index of its point in the batch, which the user does not know."""
    return type(error)(str(error).removeprefix(f"point {error.row}, "), row=error.row)
