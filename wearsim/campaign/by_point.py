"""Contact models that differ from operating point to operating point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactModels, ContactSolution
from wearsim.errors import ContactError


@dataclass(frozen=True)
class ModelsByPoint:
    """Which contact models solve which operating point.

    Parameters
    ----------
    models : tuple of ContactModels
        Combinations with their grids.
    place : (n,) int array
        Place of each point's in `models`.
    """

    models: tuple[ContactModels, ...]
    place: IntArray

    def at(self, index: IntArray) -> ModelsByPoint:
        """Return those of the points at `index`."""
        return replace(self, place=self.place[index])

    def groups(self) -> list[tuple[ContactModels, IntArray]]:
        """Return each combination that solves a point with the points it solves."""
        whose = [(one, np.flatnonzero(self.place == k)) for k, one in enumerate(self.models)]
        return [(one, index) for one, index in whose if index.size]


def numbered(error: ContactError, index: IntArray) -> ContactError:
    """Return an error of the points at `index` of a batch with the number of its point in the batch."""
    if error.row is None:
        return error
    row = int(index[error.row])
    return type(error)(str(error).replace(f"point {error.row}, ", f"point {row}, ", 1), row=row)


def join(parts: Sequence[tuple[ContactSolution, IntArray]]) -> ContactSolution:
    """Put solutions of different operating points together.

    Parameters
    ----------
    parts : sequence of (ContactSolution, (k,) int array)
        Each solution numbers its points among themselves; the array gives their places in the batch.

    Returns
    -------
    ContactSolution
        Ordered by point, side and falling normal force as every solution. All have as many strips, and
        cells along them, as the one with most: those that others lack are added at the field side and
        the trailing end; the strips have no width on the profiles, the cells carry no pressure and
        do not slip, so that neither adds to a sum. The patches are those of strips, without the grid
        a half-space model found its pressure on.
    """
    ((solution, index), *others) = parts
    if not others and np.array_equal(index, np.arange(index.size)):
        return solution
    strips = max(one.patch.y.shape[1] for one, _ in parts)
    cells = max(one.fields.pressure.shape[1] for one, _ in parts)
    padded = [_padded(one, strips, cells) for one, _ in parts]
    point = np.concatenate([index[one.point] for one, index in parts])
    order = np.argsort(point, kind="stable")
    whole: ContactSolution = _stacked(padded, order)
    return replace(whole, point=point[order], patch=replace(whole.patch, row=point[order]))


def _padded(solution: ContactSolution, strips: int, cells: int) -> ContactSolution:
    """Add strips without width and cells without load."""
    patch, fields_ = solution.patch, solution.fields
    more = strips - patch.y.shape[1]
    further = cells - fields_.pressure.shape[1]
    centre = patch.y[:, -1:] + patch.width[:, None] * np.arange(1, more + 1)

    def empty(value: FloatArray) -> FloatArray:
        return np.pad(value, [(0, 0)] * (value.ndim - 1) + [(0, more)])

    def same(value: FloatArray) -> FloatArray:
        return np.pad(value, [(0, 0), (0, more)], mode="edge")

    def field(value: FloatArray) -> FloatArray:
        return np.pad(value, [(0, 0), (0, further), (0, more)])

    return replace(
        solution,
        strip_edges_wheel_y=same(solution.strip_edges_wheel_y),
        strip_edges_rail_y=same(solution.strip_edges_rail_y),
        patch=replace(
            patch,
            y=np.concatenate([patch.y, centre], axis=1),
            x_lead=same(patch.x_lead),
            x_trail=np.concatenate([patch.x_trail, np.repeat(patch.x_lead[:, -1:], more, axis=1)], axis=1),
            pressure_slope=empty(patch.pressure_slope),
            interpenetration=empty(patch.interpenetration),
            grid=None,
        ),
        fields=replace(
            fields_,
            pressure=field(fields_.pressure),
            shear_x=field(fields_.shear_x),
            shear_y=field(fields_.shear_y),
            slip_x=field(fields_.slip_x),
            slip_y=field(fields_.slip_y),
            work_density=field(fields_.work_density),
            x_lead=same(fields_.x_lead),
            cell_length=same(fields_.cell_length),
        ),
    )


def _stacked(parts: Sequence[Any], order: IntArray) -> Any:
    """Put dataclasses of arrays behind one another along the first axis, in another order."""
    first = parts[0]
    if first is None:
        return None
    if isinstance(first, np.ndarray):
        return np.concatenate(parts)[order]
    joined = {f.name: _stacked([getattr(part, f.name) for part in parts], order) for f in fields(first)}
    return type(first)(**joined)
