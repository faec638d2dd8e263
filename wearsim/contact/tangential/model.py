"""Contract of tangential contact models: input, solution, record, their validation.

A model is a module or a folder of `contact.tangential` that defines ``MODEL =
TangentialModel(...)``; no other file needs a change to add one. A call of a record
validates input and solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray, Patch
from wearsim.contact.registry import check_grid
from wearsim.errors import NumericalError

Wanted: TypeAlias = bool | Literal["work"]
"""Fields of cells: all, none, or their frictional work alone.

For the last a model may compute all.
"""


class StripMotion(NamedTuple):
    """Rigid slip and friction of strips in planes of their own.

    The rigid slip over V of a strip at x from the patch's centre is (creepage x,
    creepage y + spin x).

    Parameters
    ----------
    wheel : (m,) int array
        Wheel of the batch each patch belongs to: strips of patches of one wheel act on
        each other.
    creepage : (m, N, 3) array
        Longitudinal, lateral creepage and spin of each strip in its plane, at its
        middle across and at x = 0, that of the patch's centre [-, -, 1/m].
    friction : (m, N) array
        Coulomb coefficient [-].
    x : (m,) array, optional
        Longitudinal positions of the patches' centres in one frame of the wheel; None:
        all at one [m].
    """

    wheel: IntArray
    creepage: FloatArray
    friction: FloatArray
    x: FloatArray | None = None


@dataclass(frozen=True)
class TangentialSolution:
    """Resultants and, on request, cell fields of each patch.

    Parameters
    ----------
    force : (m, 3) array
        Longitudinal and lateral force on the wheel [N, N] and moment about the contact
        normal [N m]. Of strips in planes of their own: their sums, lateral ones turned
        into the plane of the patch.
    slip_area : (m,) array
        Part of the patch that slips [m2].
    x_lead, cell_length : (m, ny) array
        Leading end of each row of cells, and length of its cells [m].
    cells : (5, m, nx, ny) or (1, m, nx, ny) array or None
        Pressure, shear x, shear y [Pa], relative slip x, slip y [-], means of each
        cell; or -shear . slip.
    strip_force : (m, N, 3) array, optional
        Of strips in planes of their own: longitudinal and lateral force in the strip's
        plane [N, N], and moment of the lateral traction about its normal through its
        middle at x = 0 [N m]; zeros in padding.
    stood_in : (m,) array, optional
        True for a substitute model, used if the model has no solution; models leave it
        to their caller.
    """

    force: FloatArray
    slip_area: FloatArray
    x_lead: FloatArray
    cell_length: FloatArray
    cells: FloatArray | None
    strip_force: FloatArray | None = None
    stood_in: NDArray[np.bool_] | None = None

    @property
    def plane_force(self) -> FloatArray:
        """Force and moment (m, N, 3) in each contact plane.

        There is one plane per patch, or one per strip.
        """
        return self.force[:, None] if self.strip_force is None else self.strip_force


class TangentialSolver(Protocol):
    """Signature of the function of every tangential model."""

    def __call__(
        self,
        patch: Patch,
        creepage: FloatArray,
        friction: FloatArray,
        *,
        shear_modulus: float,
        poisson_ratio: float,
        fields: Wanted,
        strips: StripMotion | None = None,
    ) -> TangentialSolution:
        """Shear, slip and creep forces of each patch.

        Parameters
        ----------
        patch : Patch
            m patches of ny strips, with their own numbers of strips and cells.
        creepage : (m, 3) array
            Longitudinal, lateral creepage and spin about the patch's
            centre [-, -, 1/m]; means over strips in planes of their own.
        friction : (m,) array
            Coulomb coefficient [-]; the mean over such strips.
        shear_modulus, poisson_ratio : float
            Of both bodies [Pa], [-].
        fields : bool or "work"
            Requested fields of cells besides the resultants, see `Wanted`; the
            resultants do not depend on it.
        strips : StripMotion, optional
            Of strips in planes of their own; for models with `by_strips` and patches
            with `planes` alone.

        Returns
        -------
        TangentialSolution

        Raises
        ------
        ContactError
            If a creepage or friction coefficient is outside the model's limits.
        NumericalError
            If the iteration does not converge.

        Notes
        -----
        Models with `by_strips` take one more optional keyword,
        ``strips: StripMotion | None = None``, which is given where the patches have
        `planes`; their solution then has the forces of the strips.
        """


def unconverged(residual: float, tolerance: float, row: int) -> NumericalError:
    """Error of a row whose steady rolling on the half-space did not converge."""
    message = (
        "steady rolling on the half-space did not converge: residual "
        f"{residual:.1e} of the tractions, allowed {tolerance:.0e}; try other numbers "
        "of strips and cells, another tangential model, or smooth measured profiles"
    )
    return NumericalError(message, row=row)


@dataclass(frozen=True)
class TangentialModel:
    """Record of a tangential model.

    Calling it validates input and solution around `solve`.

    Parameters
    ----------
    name : str
        In scenes and on the command line.
    solve : TangentialSolver
        The function itself, without validation.
    tolerance : float
        Error of its forces over friction coefficient x normal force, at most: how far
        equilibrium can be had.
    jump : float
        Largest jump of its forces over friction coefficient x normal force, where a
        point changes between stick and slip: an equilibrium at one is no nearer.
    fewest : int
        Strips across a patch, and cells along each, at least.
    most_strips : int, optional
        Strips at most.
    chunk : int
        Largest number of operating points that are solved together: few if one takes
        milliseconds, so that all threads are used.
    bounded_slip : bool
        True if the slip of cells is that of an elastic body; False if it grows without
        bound towards the trailing edge, so that only its work over the patch is valid.
    by_strips : bool
        True if the model uses strips with their own rigid slip; for other models each
        patch has one creepage.
    on_rows : bool
        True if it uses strips only where they are the grid rows of the normal model's
        pressures.
    instead : str
        Substitute model for wheels without a solution; "": none.
    title : str
        Name in texts, by default `name` with blanks.
    """

    name: str
    solve: TangentialSolver
    tolerance: float = 1e-6
    jump: float = 0.0
    fewest: int = 2
    most_strips: int | None = None
    chunk: int = 256
    bounded_slip: bool = True
    by_strips: bool = False
    instead: str = ""
    on_rows: bool = False
    title: str = ""

    def takes_strips_of(self, patch: Patch) -> bool:
        """Return True if the model uses the strips of patches that have `planes`."""
        return self.by_strips and not (self.on_rows and patch.grid is None)

    def __call__(
        self, patch: Patch, creepage: FloatArray, friction: FloatArray, **options: Any
    ) -> TangentialSolution:
        """Solve with validation of input and solution.

        Parameters and errors are those of `TangentialSolver`.

        Raises
        ------
        ContactError
            Also for grids outside the model's limits.
        NumericalError
            Also for creep forces that are not finite.
        """
        hint = ", or another tangential model"
        if patch.row.size > 0:
            fewest = int(patch.strips.min()), int(patch.cells.min())
            check_grid(self.name, *fewest, self.fewest, None, hint)
            check_grid(
                self.name, patch.y.shape[1], fewest[1], self.fewest, self.most_strips
            )
        solution = self.solve(patch, creepage, friction, **options)
        fine = np.isfinite(solution.force).all(axis=1)
        if solution.strip_force is not None:
            fine &= np.isfinite(solution.strip_force).all(axis=(1, 2))
        if not fine.all():
            raise NumericalError(
                f"{self.name} has no finite creep forces; check creepages and friction",
                row=int(patch.row[np.argmin(fine)]),
                rows=np.unique(patch.row[~fine]).tolist(),
            )
        return solution
