"""Contract of normal contact models: input, solution, record and their validation.

A model is a module or a folder of `contact.normal` that defines ``MODEL =
NormalModel(...)``; no other file needs a change to add one. A call of a record
validates input and solution, equally for all models.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.geometry import Gap
from wearsim.contact.kernel import bare_kernel, plain
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution
from wearsim.contact.registry import check_grid
from wearsim.errors import ContactError, NumericalError
from wearsim.quantities import QUANTITIES

FEWEST = int(QUANTITIES["strips"].range.low)
"""Least number of strips across a patch and of cells along each of any normal model."""
LARGEST_STRAIN = 0.1
"""Largest pressure over E*.

It gives strains of a tenth, four times the yield strain of hardened steel.
"""
LONGEST_PATCH = 0.3
"""Largest half length of a patch over the smallest rolling radius.

At this length the parabola that represents a circle deviates by 2 %, surfaces are
inclined by 17 degrees and strains reach 10 %: the half-space is no longer valid.
"""
FAINT = 1e-3
"""Share of a wheel's load below which a patch is faint.

It may be at an edge or beyond the validity of the half-space. Solvers of wheels let it
fade, see `normal.faint`.
"""


@dataclass(frozen=True)
class NormalSolution:
    """Solution of a normal model.

    The leading axis is the patch, ordered by row and falling normal force.

    Parameters
    ----------
    patch : Patch
        Outline and pressure on strips. With `planes` contact angle and normal force of
        a patch are those of the sum of the normal forces of its strips, as vectors.
    centre_y : (m,) array
        Pressure-weighted centre on the counterface profile [m].
    contact_angle : (m,) array
        Of the contact plane about x [rad].
    approach : (m,) array
        Rigid approach along the normal [m].
    normal_force : (m,) array
        [N].
    max_pressure : (m,) array
        [Pa].
    edge_y : (m, ny + 1) array
        Strip edges on the counterface profile [m].
    load_scale : (m,) array
        Factor on the forces of the wheel's patches that makes them carry the load
        exactly: 1 to the tolerance of the balance; more where a model's load jumps past
        the given one [-].
    vertical_displacement : (m,) array
        Of the wheel under the load from its design height, downwards, alike for its
        patches [m].
    stood_in : (m,) array, optional
        True for a substitute model, used if the model has no solution; models leave it
        to their caller.
    """

    patch: Patch
    centre_y: FloatArray
    contact_angle: FloatArray
    approach: FloatArray
    normal_force: FloatArray
    max_pressure: FloatArray
    edge_y: FloatArray
    load_scale: FloatArray
    vertical_displacement: FloatArray
    stood_in: NDArray[np.bool_] | None = None


class NormalSolver(Protocol):
    """Signature of the function of every normal model."""

    def __call__(
        self,
        gap: Gap,
        row: IntArray,
        load: FloatArray,
        *,
        vertical: bool,
        effective_modulus: float,
        resolution: Resolution,
        parameters: dict[str, float],
        rough: bool = False,
    ) -> NormalSolution:
        """Patches and pressures of rows of a gap.

        Parameters
        ----------
        gap : Gap
            n rows on a grid of g points.
        row : (k,) int array
            Rows of the gap to solve, rising.
        load : (k,) array
            Vertical load of the wheel, balanced by the vertical parts of the normal
            forces of all its patches, or (`vertical` false) the normal force of its
            only patch [N].
        vertical : bool
            Which of the two `load` is.
        effective_modulus : float
            E* = E / (2 (1 - nu^2)) of two equal bodies [Pa].
        resolution : Resolution
            Strips across each patch and cells along them, from its size.
        parameters : dict
            Of all models, each takes its own.
        rough : bool
            True if errors of some per cent in forces and planes are acceptable: a model
            may omit expensive parts; patches lie in one plane each, without `planes`.
            Where a rough solution raises an error, the caller solves the row in full.

        Returns
        -------
        NormalSolution
            The leading axis is the patch; `patch.row` and the rows of errors are those
            of the gap.

        Raises
        ------
        ContactError
            If a wheel is not in contact, a patch that is not faint reaches the edge of
            a profile, or `vertical` is false and several patches close.
        NumericalError
            If the load cannot be balanced or the iteration does not converge.
        """


@dataclass(frozen=True)
class NormalModel:
    """Record of a normal model; calling it validates input and solution around `solve`.

    Parameters
    ----------
    name : str
        In scenes and on the command line.
    solve : NormalSolver
        The function itself, without validation.
    can_update_profile : bool
        True if wear computed with the model may change the profile.
    reason : str
        Reason why it may not.
    parameters : mapping
        Names and defaults of its own parameters.
    fewest : int
        Strips across a patch, and cells along each, at least.
    most_strips : int, optional
        Strips at most.
    chunk : int
        Largest number of operating points that are solved together: few if one takes
        milliseconds, so that all threads are used.
    scatter : float
        Jump of vertical displacements with a new layout of the strips [m].
    several_solutions : bool
        True if some wheels have several solutions: forces jump with the pose.
    underrates_pressure : bool
        True if its largest pressures are too low for laws of fatigue.
    instead : str
        Substitute model for wheels without a solution; "": none.
    title : str
        Name in texts, by default `name` with blanks.
    """

    name: str
    solve: NormalSolver
    can_update_profile: bool = True
    reason: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    fewest: int = FEWEST
    most_strips: int | None = None
    chunk: int = 256
    scatter: float = 0.0
    several_solutions: bool = False
    underrates_pressure: bool = False
    instead: str = ""
    title: str = ""

    def __call__(
        self, gap: Gap, row: IntArray, load: FloatArray, **options: Any
    ) -> NormalSolution:
        """Solve with validation of input and solution.

        Parameters and errors are those of `NormalSolver`.

        Raises
        ------
        ContactError
            Also for loads not above 0, grids outside the model's limits, and patches or
            pressures beyond an elastic half-space where they are not faint.
        NumericalError
            Also for a solution that is not finite.
        """
        resolution: Resolution = options["resolution"]
        for key in ("strips", "cells"):
            if getattr(resolution, key) < FEWEST:
                raise ContactError(
                    f"{key} = {getattr(resolution, key)} must be at least {FEWEST}; "
                    "take more"
                )
        check_grid(
            self.name,
            resolution.strips,
            resolution.cells,
            self.fewest,
            self.most_strips,
        )
        right = (load > 0.0) & (load < np.inf)
        if not right.all():
            first = int(np.argmin(right))
            raise ContactError(
                f"wheel load = {load[first]:g} N must be above 0 N and finite",
                row=int(row[first]),
            )
        solution = self.solve(gap, row, load, **options)
        if solution.patch.row.size > 0:
            _check_solution(gap, solution, options["effective_modulus"])
        return solution


_REAL = (
    "centre_y",
    "contact_angle",
    "approach",
    "normal_force",
    "max_pressure",
    "edge_y",
    "load_scale",
    "vertical_displacement",
)
_REAL_OF_PATCH = "x_lead", "x_trail", "y", "width", "pressure_slope", "interpenetration"


@bare_kernel
def _sum_up(
    values: tuple[FloatArray, ...], total: FloatArray, longest: FloatArray
) -> None:
    """Sum (m,) of all values (m, k) of each patch, and its longest strip.

    The strip lengths are between the first two of the values.
    """
    for m in range(total.size):
        total[m], longest[m] = 0.0, 0.0
        for array in values:
            for j in range(array.shape[1]):
                total[m] += array[m, j]
        for j in range(values[0].shape[1]):
            longest[m] = max(longest[m], values[0][m, j] - values[1][m, j])


def _check_solution(
    gap: Gap, solution: NormalSolution, effective_modulus: float
) -> None:
    """Check that numbers are finite, and that loaded patches suit a half-space.

    Sizes and pressures must be within the limits of an elastic half-space.
    """
    patch = solution.patch
    row = patch.row
    loaded = ~(
        solution.normal_force < FAINT * np.bincount(row, solution.normal_force)[row]
    )
    arrays = [getattr(patch, name) for name in _REAL_OF_PATCH] + [
        getattr(solution, name) for name in _REAL
    ]
    total, longest = np.empty((2, row.size))
    _sum_up(
        tuple(plain(array).reshape(row.size, -1) for array in arrays), total, longest
    )
    fine = np.isfinite(total)  # sums detect values that are not finite
    if patch.planes is not None:
        for array in vars(patch.planes).values():
            fine &= np.isfinite(array).all(axis=1)
    if not fine.all():
        raise NumericalError(
            "the normal contact has no finite solution; check profiles, radii and "
            "load, or take another normal model",
            row=int(row[np.argmin(fine)]),
            rows=np.unique(row[~fine]).tolist(),
        )
    half = 0.5 * longest
    radius = _smallest_radius(gap, solution)
    beyond = loaded & (half > LONGEST_PATCH * radius)
    if beyond.any():
        m = int(np.argmax(beyond))
        raise ContactError(
            f"the contact patch is {2e3 * half[m]:.3g} mm long on a rolling radius of "
            f"{1e3 * radius[m]:.3g} mm, more than {2.0 * LONGEST_PATCH:g} of it: no "
            "half-space; lower the load, or take a larger radius or a stiffer "
            "material",
            row=int(row[m]),
            rows=np.unique(row[beyond]).tolist(),
        )
    beyond = loaded & (solution.max_pressure > LARGEST_STRAIN * effective_modulus)
    if beyond.any():
        m = int(np.argmax(beyond))
        raise ContactError(
            f"the contact pressure would be {1e-6 * solution.max_pressure[m]:.0f} "
            f"MPa, more than {LARGEST_STRAIN:g} of E / (2 (1 - nu^2)): not elastic; "
            "lower the load, smooth a measured profile or take a larger radius",
            row=int(row[m]),
            rows=np.unique(row[beyond]).tolist(),
        )


def _smallest_radius(gap: Gap, solution: NormalSolution) -> FloatArray:
    """Smaller rolling radius of wheel and counterface at each patch [m]."""
    grid = gap.counterface
    at = np.minimum(np.searchsorted(grid.y, solution.centre_y), grid.y.size - 1)
    wheel: FloatArray = gap.wheel_radius[solution.patch.row, at]
    if gap.curvature <= 0.0:
        return wheel
    return np.minimum(wheel, 1.0 / gap.curvature - grid.z[at])


NO_CONTACT, AT_EDGE, NOT_SINGLE, NO_BALANCE, NO_CONVERGENCE = 1, 2, 3, 4, 5

_CHECK = "; check shift, gauge and profiles"
_TEXT = {
    NO_CONTACT: f"the wheel does not touch the counterface at any lateral position{_CHECK}",
    AT_EDGE: f"the contact patch reaches the edge of a profile{_CHECK}; a disc or roller "
    "that ends there needs its chamfers in the file (`wearsim contact`: --rail-ends "
    "sharp)",
    NOT_SINGLE: (
        "several patches close: a normal force belongs to one; give the wheel load "
        "instead"
    ),
    NO_BALANCE: (
        "no vertical displacement of the wheel balances the load; check load and "
        "profiles, smooth measured ones, or take the normal model half_space"
    ),
    NO_CONVERGENCE: (
        "the pressure of the half-space has not converged; take fewer strips and "
        "cells, or smooth measured profiles"
    ),
}


def fault_of(
    kind: int, row: int, rows: Iterable[int] = ()
) -> ContactError | NumericalError:
    """Error of a row without a solution.

    Parameters
    ----------
    kind : int
        NO_CONTACT, AT_EDGE, NOT_SINGLE, NO_BALANCE or NO_CONVERGENCE.
    row : int
        Of the batch; the caller knows which operating point it is.
    rows : iterable of int
        All rows known to be of that kind.

    Returns
    -------
    ContactError or NumericalError
        The latter for NO_BALANCE and NO_CONVERGENCE.
    """
    return (NumericalError if kind in (NO_BALANCE, NO_CONVERGENCE) else ContactError)(
        _TEXT[kind], row=row, rows=rows
    )


def raise_first(fault: IntArray) -> None:
    """Raise the error of the first row without a solution.

    The error names all rows of the same kind.

    Parameters
    ----------
    fault : (n,) int array
        0, or the kind of `fault_of`, for each row.

    Raises
    ------
    ContactError, NumericalError
        If a row is not 0.
    """
    failed = np.flatnonzero(fault)
    if failed.size > 0:
        kind = int(fault[failed[0]])
        raise fault_of(kind, int(failed[0]), np.flatnonzero(fault == kind).tolist())
