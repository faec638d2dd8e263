"""Operating points of `wearsim contact`: flags and rows validated by one model, solved in batches."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from wearsim.contact.equilibrium import RULES
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import ContactConditions, ContactModels, ContactSolution, Counterface, Wheelset
from wearsim.contact.solve import solve, solve_each
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import ContactError, NumericalError, ProfileError
from wearsim.profile.files import load_profile
from wearsim.profile.placement import RUNNING_CIRCLE, slope_of
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_flags import COLUMNS, FLAGS, Flag
from wearsim.toml_faults import decimal

_TIGHTEST_CURVE = QUANTITIES["curve_radius"].range.low  # m
_INSTEAD = (("wheel_load_kN", "normal_force_kN"), ("rotation", "creepage"))  # only one of each pair acts


PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip
"""Numbers of each patch, names as in JSON and in the table of quantities."""

_SIDES = {"right": (0,), "left": (1,), "both": (0, 1)}


class Request(BaseModel):
    """One operating point with everything that acts on it, SI units; its fields are those of `FLAGS`."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, hide_input_in_errors=True)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    @property
    def load(self) -> float:
        """Wheel load, or the normal force where that is given."""
        return float(self.wheel_load if self.normal_force is None else self.normal_force)

    @property
    def free_roll(self) -> bool:
        """Whether the wheelset rests on both wheels."""
        return bool(self.roll == "free" or (self.roll is None and self.side == "both"))

    @property
    def rule(self) -> str | float:
        """Rule of the rotation speed, or the speed; without effect where creepages are given."""
        rule: str | float = self.rotation if self.creepage is None else "nominal"
        return rule

    @property
    def half_span(self) -> float:
        """From the track centre to the origin of the wheel profile."""
        return float(0.5 * self.back_to_back + RUNNING_CIRCLE)

    @property
    def counterface_curvature(self) -> float:
        """Of the roller, 0 of a rail."""
        return 0.0 if self.roller_radius is None else 1.0 / float(self.roller_radius)

    @property
    def track_curvature(self) -> float:
        """Positive to the right, 0 in tangent track."""
        return 0.0 if self.curve_radius is None else 1.0 / float(self.curve_radius)

    @property
    def placed_rail(self) -> tuple[str, float, float, float]:
        """What determines the rail in the track."""
        return self.rail, self.inclination, self.gauge, self.half_span

    @property
    def batch(self) -> tuple[Any, ...]:
        """What points solved in one call have in common."""
        shared = (self.side, self.wheel, *self.placed_rail, self.wheel_radius, self.counterface_curvature)
        models = (self.normal, self.tangential, self.youngs, self.poisson, self.strips, self.cells)
        rule = self.rule if isinstance(self.rule, str) else "number"
        return (*shared, *models, rule, self.normal_force is None, self.free_roll, self.creepage is None)

    @property
    def conflict(self) -> str | None:
        """What of it excludes each other."""
        if self.creepage is not None and self.side == "both":
            return "creepages are given for the single patch of one wheel; choose the right or the left side"
        return None


def _in_range(flag: Flag, text: str) -> float:
    number = decimal(text)
    if not flag.low <= number <= flag.high:
        word = "free or a number" if flag.kind == "roll" else "a number"
        comma = "; the decimal mark is a point" if "," in text else ""
        meaning = flag.meaning.partition(", right side")[0]
        raise ValueError(f"must be {word} from {flag.low:g} to {flag.high:g} ({meaning}){comma}")
    if flag.kind == "curve" and abs(number) < _TIGHTEST_CURVE:
        raise ValueError(f"must not lie within {_TIGHTEST_CURVE:g} m of 0; leave it out on tangent track")
    if flag.kind == "count" and number != int(number):
        raise ValueError("must be a whole number")
    return number


def _name(flag: Flag, text: str) -> str:
    """Name of a profile, a side or a contact model."""
    if flag.kind == "side" and text not in _SIDES:
        raise ValueError("must be right, left or both")
    names = NORMAL_MODELS if flag.name == "normal" else TANGENTIAL_MODELS
    if flag.kind == "model" and text not in names:
        raise ValueError(f"is not one of {', '.join(sorted(names))}")
    if "\0" in text:  # ends file names for the operating system
        raise ValueError("must not hold zero bytes")
    return text


def _rotation(flag: Flag, text: str) -> str | float:
    if text in RULES:
        return text
    if not flag.low < (speed := decimal(text)) <= flag.high:
        raise ValueError(f"must be {', '.join(RULES)}, or a speed above 0 and up to {flag.high:g} rad/s")
    return speed


def _creepage(text: str) -> tuple[float, ...]:
    numbers = tuple(map(decimal, text.split(",")))
    if len(numbers) != 3:
        raise ValueError("must be three numbers with commas between them: XI_X,XI_Y,SPIN")
    names = (("XI_X", "creepage_x"), ("XI_Y", "creepage_y"), ("SPIN", "spin"))
    for (name, quantity), number in zip(names, numbers, strict=True):
        limit = QUANTITIES[quantity].range.high / QUANTITIES[quantity].shown_factor
        if not abs(number) <= limit:
            raise ValueError(
                f"must have {name} from {-limit:g} to {limit:g}{' 1/m' if name == 'SPIN' else ''}"
            )
    return numbers


def _value(flag: Flag, text: str | None) -> Any:
    """SI value of the text of a flag; raises ValueError with the end of the message."""
    if text is None or (flag.kind == "roll" and text == "free"):
        return text
    if flag.kind in ("name", "side", "model"):
        return _name(flag, text)
    if flag.kind == "rotation":
        return _rotation(flag, text)
    if flag.kind in ("inclination", "creepage"):
        return slope_of(text) if flag.kind == "inclination" else _creepage(text)
    number = _in_range(flag, text)
    return int(number) if flag.kind == "count" else number * flag.factor


ContactRequest = create_model(  # type: ignore[call-overload]
    "ContactRequest",
    __base__=Request,
    **{
        flag.field: (
            Annotated[Any, BeforeValidator(partial(_value, flag))],
            Field(flag.default, alias=flag.column, description=flag.meaning),
        )
        for flag in FLAGS
    },
)
"""The model of a set of flags and of a row of a table: texts by column in, SI values out."""


def texts_of(*layers: Mapping[str, str]) -> dict[str, str]:
    """Texts that act, by column: those of later layers before those of earlier ones before the defaults.

    Parameters
    ----------
    layers : mapping
        Texts that are given, by column; what is empty is not among them.
    """
    texts = {column: flag.default for column, flag in COLUMNS.items() if flag.default is not None}
    for given in layers:
        for pair in _INSTEAD:
            if any(column in given for column in pair):
                for column in pair:
                    texts.pop(column, None)
        texts.update(given)
    return texts


def request_of(*layers: Mapping[str, str]) -> tuple[Request, dict[str, str]]:
    """Validate texts given together, in layers as for `texts_of`.

    Parameters
    ----------
    layers : mapping
        Texts by column.

    Returns
    -------
    request : ContactRequest
        Of all texts that are right.
    wrong : dict
        By column what is wrong with the others: the end of a sentence that begins with name and text.
    """
    texts = texts_of(*layers)
    try:
        return ContactRequest.model_validate(texts), {}
    except ValidationError as error:
        wrong = {str(item["loc"][0]): str(item["ctx"]["error"]) for item in error.errors()}
    right = {column: text for column, text in texts.items() if column not in wrong}
    return ContactRequest.model_validate(right), wrong


def faults_of(given: Mapping[str, str], wrong: Mapping[str, str], *, as_flags: bool) -> list[str]:
    """All that is wrong with texts given together, one line each, named as flags or as columns."""

    def name(column: str) -> str:
        return "--" + COLUMNS[column].name if as_flags else column

    faults = [
        f"{name(column)} = {' '.join(text.split())[:60]} {wrong[column]}"
        for column, text in given.items()
        if column in wrong
    ]
    for one, other in _INSTEAD:
        if one in given and other in given:
            faults.append(f"{name(other)} and {name(one)} exclude each other; give one of them")
    return faults


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
    return load_profile(name, "wheel")


@lru_cache(maxsize=256)
def rail_profile(name: str, inclination: float, gauge: float, half_span: float) -> Profile:
    """Rail profile by name or file, placed in the track."""
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
    made = problem([request])
    try:
        solution = solve(made.conditions, made.wheelset, made.counterface, made.models, **made.options)
        return made, solution, _results(solution, [request])[0]
    except ContactError as error:
        raise _unnumbered(error) from None


def _unnumbered(error: ContactError) -> ContactError:
    """Return the error without the index of its point in the batch, which the user does not know."""
    return type(error)(str(error).removeprefix(f"point {error.row}, "), row=error.row)
