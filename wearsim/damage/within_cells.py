r"""Distribution of pressure and slip within cells, linear between cell centres.

The fields of a contact solution are means of cells. A law whose coefficient jumps at a
pressure or sliding speed assigns a whole cell to one side of the jump, so its wear
depends on the grid. Integrated over points within cells it depends on the place where
the slip passes the jump.

Between the centres of two cells of a strip, pressure and slip are linear. Beyond the
outermost centres, and towards a cell without pressure, they continue the slope of the
neighbour on the opposite side, and stay at or above zero. Each cell keeps the mean of
the pressure and of pressure times slip, and thereby of the frictional work. A cell that
sticks does so everywhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.contact.kernel import kernel, plain
from wearsim.contact.patch import FloatArray, SurfaceFields

POINTS = 4
"""Number of integration points within each cell along its strip."""


def within_cells(fields: SurfaceFields, points: int = POINTS) -> SurfaceFields:
    """Return the fields on cells cut into parts along their strips.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells (m, nx, ny) of m patches.
    points : int
        Parts of each cell.

    Returns
    -------
    SurfaceFields
        On cells (m, points nx, ny).
    """
    slip = np.sqrt(fields.slip_x**2 + fields.slip_y**2)
    shape = (
        fields.pressure.shape[0],
        points * fields.pressure.shape[1],
        fields.pressure.shape[2],
    )
    pressure, sliding = np.empty(shape), np.empty(shape)
    _fill(plain(fields.pressure), plain(slip), pressure, sliding)

    def parts(values: FloatArray, course: FloatArray) -> FloatArray:
        return np.repeat(values, points, axis=1) * course

    return replace(
        fields,
        pressure=parts(fields.pressure, pressure),
        shear_x=parts(fields.shear_x, pressure),
        shear_y=parts(fields.shear_y, pressure),
        slip_x=parts(fields.slip_x, sliding),
        slip_y=parts(fields.slip_y, sliding),
        work_density=parts(fields.work_density, pressure * sliding),
        cell_length=fields.cell_length / points,
    )


@kernel
def _fill(
    pressure: FloatArray, slip: FloatArray, of_pressure: FloatArray, of_slip: FloatArray
) -> None:
    """Course of pressure and slip within each cell.

    Pressure is relative to its mean; slip is scaled so that the product has the mean 1.

    Both are 1 in cells without them.
    """
    patches, cells, strips = pressure.shape
    points = of_pressure.shape[1] // cells
    for m in range(patches):
        for i in range(cells):
            for j in range(strips):
                ahead = i > 0 and pressure[m, i - 1, j] > 0.0
                behind = i < cells - 1 and pressure[m, i + 1, j] > 0.0
                for values, course in ((pressure, of_pressure), (slip, of_slip)):
                    cell_mean = values[m, i, j]
                    before = cell_mean - values[m, i - 1, j] if ahead else 0.0
                    after = values[m, i + 1, j] - cell_mean if behind else before
                    if not ahead:
                        before = after
                    total = 0.0
                    for k in range(points):
                        away = (k + 0.5) / points - 0.5
                        value = cell_mean + away * (before if away < 0.0 else after)
                        value = (
                            max(value, 0.0) if cell_mean == cell_mean else cell_mean
                        )  # NaN stays NaN
                        course[m, i * points + k, j] = value
                        total += value
                    for k in range(points):
                        if total == 0.0 or cell_mean == 0.0:
                            course[m, i * points + k, j] = 1.0
                        else:
                            course[m, i * points + k, j] *= points / total
                product = 0.0
                for k in range(points):
                    product += (
                        of_pressure[m, i * points + k, j]
                        * of_slip[m, i * points + k, j]
                    )
                for k in range(points):
                    of_slip[m, i * points + k, j] *= (
                        points / product if product > 0.0 else 1.0
                    )
