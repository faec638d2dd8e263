"""Contact models measured against a reference, case by case: normal contact, forces, power, strip work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import xarray as xr
from scipy import ndimage

from wearsim import __version__
from wearsim.campaign.choose import named
from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import CHUNK, ContactConditions, ContactModels, ContactSolution, solve_each
from wearsim.errors import ContactError, NumericalError
from wearsim.scene.accuracy import CaseGroup, Matrix

ERRORS = ("area", "max_pressure", "force", "power", "strip_work")
"""What a model is judged by; each is a variable `error_*` of the dataset."""

FULL_SLIP = 0.9
"""Slip share that parts the classes of cases: above it nearly all of the patch slips."""

_CELL = 0.2e-3
"""Width [m] of the pieces of the wheel profile over which strip work is compared: about a tenth of a narrow
patch, and a few points of a wheel profile."""


@dataclass(frozen=True)
class WheelAnswer:
    """What a solution gives for one wheel: sums over its patches, and strip work on its profile.

    Forces are the creep forces in the rolling direction and across it in the contact planes [N].
    """

    area: float
    max_pressure: float
    force: tuple[float, float]
    power: float
    slip_area: float
    patches: int
    lobes: int
    edges: tuple[FloatArray, ...]
    work: tuple[FloatArray, ...]


def solve_accuracy(matrix: Matrix, cases: Sequence[int] | None = None) -> xr.Dataset:
    """Solve the right wheel of every case with the reference and with each model.

    Parameters
    ----------
    matrix : Matrix
        From a scene of kind "accuracy".
    cases : sequence of int, optional
        Which cases to solve, by their place in the matrix; all if not given.

    Returns
    -------
    Dataset
        Over `case`: what it is, and the reference's results. Over `model` and `case`: results and errors
        of each model: of area, maximum pressure and power relative to the reference; of the force, the
        length of the difference over friction coefficient times wheel load; of the strip work, the
        integral of the absolute difference over that of the reference, in pieces of 0.2 mm of profile.
        Where a model refuses a case its values are missing and `refusal` holds its message.

    Raises
    ------
    ContactError, NumericalError
        If the reference does not solve a case.
    """
    chosen = np.arange(matrix.count) if cases is None else np.asarray(cases)
    told: dict[str, list[Any]] = {}
    reference: list[WheelAnswer] = []
    found: list[list[WheelAnswer | str]] = [[] for _ in matrix.models]
    first = 0
    for group in matrix.groups:
        count = group.conditions.shift.size
        rows = chosen[(chosen >= first) & (chosen < first + count)] - first
        first += count
        if rows.size == 0:
            continue
        conditions = _rows(group.conditions, rows)
        for name, values in _described(group, conditions).items():
            told.setdefault(name, []).append(values)
        for answer in _answers(matrix, group, conditions, matrix.reference):
            if isinstance(answer, str):
                raise ContactError(f"the reference: {answer}")
            reference.append(answer)
        for k, models in enumerate(matrix.models):
            found[k] += _answers(matrix, group, conditions, models)
    data: dict[str, Any] = {name: ("case", np.concatenate(parts)) for name, parts in told.items()}
    limit = data["friction"][1] * data["wheel_load"][1]
    data |= _of_reference(reference)
    columns = [errors_against(answers, reference, limit) for answers in found]
    for name in columns[0]:
        data[name] = (("model", "case"), np.stack([column[name] for column in columns]))
    return xr.Dataset(
        data,
        coords={"case": chosen, "model": [named(models) for models in matrix.models]},
        attrs={
            "title": matrix.title,
            "remarks": matrix.remarks.strip(),
            "wearsim_version": __version__,
            "scene": matrix.scene_text,
            "reference": named(matrix.reference),
            "wheel_profile": matrix.wheelset.right.name,
        },
    )


def _rows(conditions: ContactConditions, rows: Any) -> ContactConditions:
    arrays = {
        f.name: getattr(conditions, f.name)[rows]
        for f in fields(conditions)
        if isinstance(getattr(conditions, f.name), np.ndarray)
    }
    return replace(conditions, **arrays)


def _described(group: CaseGroup, conditions: ContactConditions) -> dict[str, Any]:
    count = conditions.shift.size
    return {
        "counterface_profile": np.full(count, group.profile),
        "inclination": np.full(count, group.inclination),
        "counterface_curvature": np.full(count, group.counterface.curvature),
        "shift": conditions.shift,
        "yaw": conditions.yaw,
        "wheel_load": conditions.wheel_load,
        "friction": conditions.friction,
    }


def _answers(
    matrix: Matrix, group: CaseGroup, conditions: ContactConditions, models: ContactModels
) -> list[WheelAnswer | str]:
    """Answer or refusal of each case; a case that is refused does not keep the others from being solved."""

    def solved(rows: Any) -> list[WheelAnswer | str]:
        parts = solve_each(
            _rows(conditions, rows), matrix.wheelset, group.counterface, models, answers_of, sides=(0,)
        )
        return [wheel for part in parts for wheel in part]

    answers: list[WheelAnswer | str] = []
    for start in range(0, conditions.shift.size, CHUNK):
        rows = np.arange(start, min(start + CHUNK, conditions.shift.size))
        try:
            answers += solved(rows)
        except (ContactError, NumericalError):
            for row in rows:
                try:
                    answers += solved(np.array([row]))
                except (ContactError, NumericalError) as error:
                    answers.append(str(error))
    return answers


def answers_of(solution: ContactSolution) -> list[WheelAnswer | str]:
    """Sum up the patches of each operating point; one side must have been solved.

    Parameters
    ----------
    solution : ContactSolution
        Of any points.

    Returns
    -------
    list of WheelAnswer
        One for each point, in their order.
    """
    wheels: list[WheelAnswer | str] = []
    lobes = _lobes(solution)
    for point in np.unique(solution.point):
        rows = np.flatnonzero(solution.point == point)
        work = solution.fields.strip_work[rows] * solution.fields.strip_width[rows, None]
        wheels.append(
            WheelAnswer(
                area=float(solution.area[rows].sum()),
                max_pressure=float(solution.max_pressure[rows].max()),
                force=(float(solution.force_x[rows].sum()), float(solution.force_y[rows].sum())),
                power=float(solution.power[rows].sum()),
                slip_area=float(solution.slip_area[rows].sum()),
                patches=rows.size,
                lobes=int(lobes[rows].sum()),
                edges=tuple(solution.strip_edges_wheel_y[rows]),
                work=tuple(work),
            )
        )
    return wheels


def _lobes(solution: ContactSolution) -> FloatArray:
    """Parts of each patch that do not touch each other (m,); 1 for models of strips."""
    grid = solution.patch.grid
    if grid is None:
        return np.ones(solution.point.size)
    return np.array([float(ndimage.label(pressure > 0.0)[1]) for pressure in grid.pressure])


def _of_reference(wheels: Sequence[WheelAnswer]) -> dict[str, Any]:
    values = {
        "area": [wheel.area for wheel in wheels],
        "max_pressure": [wheel.max_pressure for wheel in wheels],
        "force_x": [wheel.force[0] for wheel in wheels],
        "force_y": [wheel.force[1] for wheel in wheels],
        "power": [wheel.power for wheel in wheels],
        "slip_share": [wheel.slip_area / wheel.area for wheel in wheels],
        "patches": [max(wheel.patches, wheel.lobes) for wheel in wheels],
    }
    return {f"reference_{name}": ("case", np.array(column)) for name, column in values.items()}


def errors_against(
    answers: Sequence[WheelAnswer | str], reference: Sequence[WheelAnswer], limit: FloatArray
) -> dict[str, Any]:
    """Results and errors of one model over the cases.

    Parameters
    ----------
    answers : sequence of WheelAnswer or str
        Of the model; a text is the message of a refusal.
    reference : sequence of WheelAnswer
        Of the reference.
    limit : (n,) array
        Friction coefficient times wheel load, which errors of the force are divided by [N].

    Returns
    -------
    dict
        Columns (n,): results, `error_*` for `ERRORS`, missing where refused; `refusal`.
    """
    names = ("area", "max_pressure", "force_x", "force_y", "power", *(f"error_{name}" for name in ERRORS))
    columns: dict[str, Any] = {name: np.full(len(answers), np.nan) for name in names}
    columns["refusal"] = np.array([answer if isinstance(answer, str) else "" for answer in answers], object)
    for k, (answer, truth) in enumerate(zip(answers, reference, strict=True)):
        if isinstance(answer, str):
            continue
        apart = np.hypot(answer.force[0] - truth.force[0], answer.force[1] - truth.force[1])
        values = {
            "area": answer.area,
            "max_pressure": answer.max_pressure,
            "force_x": answer.force[0],
            "force_y": answer.force[1],
            "power": answer.power,
            "error_area": answer.area / truth.area - 1.0,
            "error_max_pressure": answer.max_pressure / truth.max_pressure - 1.0,
            "error_force": apart / limit[k],
            "error_power": _relative(answer.power, truth.power),
            "error_strip_work": _work_error(answer, truth),
        }
        for name, value in values.items():
            columns[name][k] = value
    return columns


def _relative(value: float, truth: float) -> float:
    """Relative difference; 0 where neither dissipates."""
    return value / truth - 1.0 if truth > 0.0 else float(value > 0.0)


def _work_error(answer: WheelAnswer, truth: WheelAnswer) -> float:
    """Integral of the absolute difference of strip work over that of the reference's strip work."""
    ends = [float(edge) for wheel in (answer, truth) for edges in wheel.edges for edge in edges[[0, -1]]]
    grid = np.arange(min(ends) - _CELL, max(ends) + 2.0 * _CELL, _CELL)
    mine, other = (np.diff(_cumulative(wheel, grid)) for wheel in (answer, truth))
    total = other.sum()
    return float(np.abs(mine - other).sum() / total) if total > 0.0 else float(mine.sum() > 0.0)


def _cumulative(wheel: WheelAnswer, y: FloatArray) -> FloatArray:
    """Strip work of all patches up to each place on the wheel profile [J/m per passage and width]."""
    total = np.zeros_like(y)
    for edges, work in zip(wheel.edges, wheel.work, strict=True):
        total += np.interp(y, edges, np.concatenate(([0.0], np.cumsum(work))))
    return total
