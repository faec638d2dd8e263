"""What every tangential contact model takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from wearsim.contact.patch import FloatArray, Patch


@dataclass(frozen=True)
class TangentialSolution:
    """Resultants and, where asked for, cell fields of each patch.

    Parameters
    ----------
    force : (m, 3) array
        Longitudinal and lateral force on the wheel [N, N] and moment about the contact normal [N m].
    slip_area : (m,) array
        Part of the patch that slips [m2].
    x_lead, x_trail : (m, ny) array
        Ends of the rows of cells: of the strips, or of a uniform grid [m].
    cells : (5, m, nx, ny) array or None
        Pressure, shear x, shear y [Pa], relative slip x, slip y [-], means of each cell.
    """

    force: FloatArray
    slip_area: FloatArray
    x_lead: FloatArray
    x_trail: FloatArray
    cells: FloatArray | None


class TangentialModel(Protocol):
    """Signature of every tangential model."""

    def __call__(
        self,
        patch: Patch,
        creepage: FloatArray,
        friction: FloatArray,
        *,
        shear_modulus: float,
        poisson_ratio: float,
        cells: int,
        fields: bool,
    ) -> TangentialSolution:
        """Solve (m,) patches for (m, 3) creepages [-, -, 1/m] and (m,) friction coefficients."""
