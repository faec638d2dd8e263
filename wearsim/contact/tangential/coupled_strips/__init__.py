r"""Steady rolling on coupled half-space strips, with few points along each strip.

There are no cells.

The patches of a wheel are cut into strips along the rolling direction, some ten each,
with the pressure :math:`p\sqrt{1-t^2}`, t from -1 to 1 along it. The traction of a
strip is :math:`\sqrt{1-t^2}` times a polynomial, known at eight Gauss-Chebyshev points
[3]_; Coulomb's bound becomes the constant :math:`\mu p` of the strip. The slip over V
is :math:`s = w - \partial u/\partial x`, with the rigid slip :math:`w = (\xi_x -
\varphi y, \xi_y + \varphi x)` and the displacements u of the half-space under the
tractions of all strips [1]_, [2]_ (`influence`). Strips of infinite width are strip
theory, and with it Carter's solution; a single ellipse has Kalker's coefficients.
Points stick or slip as `rolling` has it; the iteration is that of `semismooth_newton`
[5]_.

Strips of all patches of a wheel act on each other, each with its own position along the
arc of the profile, width, plane, rigid slip and friction; patches are units of reports.
A patch without planes of its strips lies in one plane and is treated as a separate
wheel; its rigid slip along x is :math:`\xi_x - \varphi y`. Between strips in different
planes the distance is that along the arc, the influence of tractions along x on slip
along x is that of one plane, and lateral and mixed influences are multiplied by the
cosine of the angle between the normals. The effects of a lateral traction along the
normal of the other strip, and of a pressure along its surface, are neglected. Within a
patch that turns by 40 degrees from end to end the cosine is above 0.77, for strips that
hardly act on each other.

The normal counterpart is [4]_: both resolve the patch across by strips and along each
by functions.

Assumptions: equal materials; strips are flat across; two lobes one behind the other in
a strip are one semi-ellipse of the same load. Strains are polynomials, so that a stick
zone that begins or ends between two points is smeared over their distance: at small
creepage, where one or two points of a strip slip, strip work is accurate to some per
cent only.

References
----------
.. [1] J. J. Kalker, On the rolling contact of two elastic bodies in the presence of dry
   friction, thesis, Delft 1967; Three-dimensional elastic bodies in rolling contact,
   Kluwer 1990.
.. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731,
       sections 3.6 and 8.3.
.. [3] F. Erdogan, G. D. Gupta, Q. Appl. Math. 29 (1972) 525-534,
       doi:10.1090/qam/408277.
.. [4] K. Knothe, H. Le The, Int. J. Solids Struct. 20 (1984) 803-815.
.. [5] P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991) 353-375,
   doi:10.1016/0045-7825(91)90022-X.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from wearsim.contact.patch import FloatArray, Patch
from wearsim.contact.tangential.coupled_strips import rolling
from wearsim.contact.tangential.coupled_strips.cells import cells_of_patches, fill_cells
from wearsim.contact.tangential.coupled_strips.influence import (
    slip_influence,
    strip_points,
)
from wearsim.contact.tangential.coupled_strips.strips import (
    strips_of_wheels,
    sums_of_strips,
)
from wearsim.contact.tangential.model import (
    StripMotion,
    TangentialModel,
    TangentialSolution,
    Wanted,
    unconverged,
)
from wearsim.errors import ContactError

STRIPS, POINTS = 12, 8
"""Number of strips across a patch and of points along each strip.

Wide patches have more strips, but no more than the patch has. The points are a multiple
of four.
"""
TOLERANCE = 3e-5
"""Tolerance: sum of the residuals of all points over the sum of their tractions."""
STALLED = 3e-4
"""Residual up to which a stalled iteration counts as solved.

It occurs if a point neither sticks nor slips.
"""
PLACES = (1.0, 0.3), (0.3, 0.3), (0.5, 0.5)
"""Positions of the slip of points that stick and that slip, see `strip_points`.

The next pair is used where these fail.
"""
MOST_STEPS = 14
"""Largest number of Newton steps."""


def solve(
    patch: Patch,
    creepage: FloatArray,
    friction: FloatArray,
    *,
    shear_modulus: float,
    poisson_ratio: float,
    fields: Wanted,
    strips: StripMotion | None = None,
) -> TangentialSolution:
    """Shear, slip and creep forces of each patch; contract in `tangential.model`.

    Forces are the sums of the solved strips for patches with planes, else of the cells.
    Cells have the integrals of the polynomials, limited to the friction bound.
    """
    if patch.planes is None:
        strips = None
    _check_finite(patch, creepage, friction, strips)
    shear_modulus, poisson_ratio = float(shear_modulus), float(poisson_ratio)
    count, ny = patch.y.shape
    points = strip_points(POINTS)
    wheels = strips_of_wheels(patch, creepage, friction, strips, STRIPS)
    cells = cells_of_patches(patch, POINTS)
    rigid, slip = np.empty((2, 2 * wheels.peak.size * (POINTS + 1)))
    traction, marks = (
        np.empty(2 * wheels.peak.size * POINTS),
        np.empty(wheels.peak.size * POINTS),
    )
    rolling.prepare(points, poisson_ratio, wheels, rigid, traction)
    bound = wheels.friction * wheels.peak / shear_modulus
    matrices = slip_influence(wheels, POINTS, poisson_ratio)
    for (begin, end), matrix in zip(
        pairwise(wheels.begin.tolist()), matrices, strict=True
    ):
        left = _roll(
            matrix, begin, end, poisson_ratio, rigid, bound, traction, slip, marks
        )
        if left > STALLED:
            raise unconverged(left, STALLED, int(patch.row[wheels.patch[begin]]))
    out = np.zeros((5, count, int(patch.cells.max(initial=1)) if fields else 0, ny))
    force, slip_area = np.zeros((count, 3)), np.zeros(count)
    fill_cells(
        points,
        wheels,
        cells,
        shear_modulus,
        traction,
        slip,
        marks,
        out,
        force,
        slip_area,
    )
    of_strips = None
    if strips is not None:
        of_strips = np.zeros(strips.creepage.shape)
        rolling.add_up(points, wheels, shear_modulus, traction, of_strips)
        force = sums_of_strips(wheels, of_strips)
    length = (patch.x_lead - patch.x_trail) / patch.cells[:, None]
    return TangentialSolution(
        force,
        slip_area,
        patch.x_lead,
        length,
        out if fields else None,
        strip_force=of_strips,
    )


def _check_finite(
    patch: Patch, creepage: FloatArray, friction: FloatArray, strips: StripMotion | None
) -> None:
    """Raise an error for creepages and friction coefficients that are not finite."""
    fault = ~(np.isfinite(creepage).all(axis=1) & np.isfinite(friction))
    if strips is not None and patch.planes is not None:
        fine = np.isfinite(strips.creepage).all(axis=2) & np.isfinite(strips.friction)
        fault |= ~(fine | (patch.planes.width <= 0.0)).all(axis=1)
    if fault.any():
        row = int(patch.row[np.argmax(fault)])
        raise ContactError("creepage and friction coefficient must be finite", row=row)


def _roll(
    matrix: FloatArray,
    begin: int,
    end: int,
    poisson_ratio: float,
    rigid: FloatArray,
    bound: FloatArray,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
) -> float:
    """Solve the strips `begin` to `end` of one wheel in place.

    Return the residual of the best solution.
    """
    n, count = POINTS, end - begin
    ends = slice(2 * begin * (n + 1), 2 * end * (n + 1))
    rigid_slip, whole_slip = (
        rigid[ends].reshape(2, count, n + 1),
        slip[ends].reshape(2, count, n + 1),
    )
    of_points = traction[2 * begin * n : 2 * end * n].reshape(2, count, n)
    marked = marks[begin * n : end * n].reshape(count, n)
    for places in PLACES:
        left, _, _ = rolling.roll(
            matrix,
            strip_points(n, *places),
            poisson_ratio,
            rigid_slip,
            bound[begin:end],
            TOLERANCE,
            MOST_STEPS,
            of_points,
            whole_slip,
            marked,
        )
        if left <= STALLED:
            break
    return left


MODEL = TangentialModel(
    name="coupled_strips",
    solve=solve,
    tolerance=1e-4,
    jump=5e-4,
    fewest=2,
    chunk=16,
    by_strips=True,
    instead="half_space",
)
