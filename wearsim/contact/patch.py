"""The contact patch and the fields on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Patch:
    """Contact patches in their contact planes, cut into `ny` strips along the rolling direction.

    Lateral positions are those in the contact plane from the pressure-weighted centre of the patch,
    positive to the field side; longitudinal ones positive in the rolling direction.

    Parameters
    ----------
    row : (m,) int array
        Row of the batch (one wheel at one operating point) each patch belongs to.
    y : (m, ny) array
        Strip centres [m].
    width : (m,) array
        Width of one strip [m].
    x_lead, x_trail : (m, ny) array
        Leading and trailing end of each strip [m].
    pressure_slope : (m,) array
        Factor c of p = c sqrt((x_lead - x)(x - x_trail)) [Pa/m]; load-conserving on these strips.
    interpenetration : (m, ny) array
        Virtual interpenetration g of each strip, zero for models without one [m].
    """

    row: IntArray
    y: FloatArray
    width: FloatArray
    x_lead: FloatArray
    x_trail: FloatArray
    pressure_slope: FloatArray
    interpenetration: FloatArray


@dataclass(frozen=True)
class SurfaceFields:
    """Pressure, shear and slip in the cells of each patch; x index from the leading edge.

    Parameters
    ----------
    pressure : (m, nx, ny) array
        Contact pressure, mean of the cell [Pa].
    shear_x, shear_y : (m, nx, ny) array
        Shear traction on the wheel, mean of the cell [Pa].
    slip_x, slip_y : (m, nx, ny) array
        Slip velocity of the wheel's surface relative to the counterface, over V [-].
    work_density : (m, nx, ny) array
        Frictional work per cell area and distance rolled, -shear . slip, after the scaling to the
        resultant power [J/m3 = Pa]; the local wear index of energy laws.
    cell_length : (m, ny) array
        Length of the cells of each strip along the rolling direction [m].
    strip_width : (m,) array
        Width of the strips in the contact plane [m].
    speed : (m,) array
        Reference speed V [m/s].
    """

    pressure: FloatArray
    shear_x: FloatArray
    shear_y: FloatArray
    slip_x: FloatArray
    slip_y: FloatArray
    work_density: FloatArray
    cell_length: FloatArray
    strip_width: FloatArray
    speed: FloatArray

    @property
    def strip_work(self) -> FloatArray:
        """Frictional work per unit area and passage e(y), (m, ny) [J/m2]."""
        work: FloatArray = self.work_density.sum(axis=1) * self.cell_length
        return work


def load_factor(cells: int) -> float:
    """Ratio of the integral of a semi-ellipse to its trapezoidal sum over `cells` equal cells.

    Cell pressures multiplied by it carry exactly the load of the strip, so that a fully slipping patch
    carries exactly the friction coefficient times the normal force on any grid.

    Parameters
    ----------
    cells : int
        Cells along a strip.

    Returns
    -------
    float
        1 + O(cells^-1.5).
    """
    ends = np.linspace(-1.0, 1.0, cells + 1)
    return float(0.5 * np.pi / (2.0 / cells * np.sqrt(np.maximum(1.0 - ends**2, 0.0)).sum()))
