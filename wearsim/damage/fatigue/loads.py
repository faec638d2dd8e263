"""Contact quantities that fatigue laws use.

They are resultants and fields of patches, and the wear numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.contact.problem import ContactSolution
from wearsim.damage.wear.sliding import along_strips, mean_of, patch_total, share_of

WearNumber = Literal["without_spin", "with_spin"]


@dataclass(frozen=True)
class PatchLoads:
    """Loads of `m` contact patches with their strips and cells.

    Arrays (m,) are those of `ContactSolution`.
    """

    normal_force: FloatArray  # [N]
    force_x: FloatArray  # in the contact plane [N]
    force_y: FloatArray
    spin_moment: FloatArray  # about the contact normal [N m]
    creepage_x: FloatArray  # [-]
    creepage_y: FloatArray
    spin: FloatArray  # [1/m]
    max_pressure: FloatArray  # [Pa]
    area: FloatArray  # [m2]
    # strip centres (m, ny) on the wheel profile, positive to the field side [m]
    y: FloatArray
    fields: SurfaceFields  # in the cells

    @property
    def utilised_friction(self) -> FloatArray:
        """Shear over normal force of each patch (m,) [-]."""
        return utilised_friction(self)

    def y_of_largest(self, strips: FloatArray) -> FloatArray:
        """Lateral position (m,) of the strip with the largest value in each patch [m].

        `values` (m, ny) are given by strip.
        """
        if not strips.size:  # all points of a chunk are left out
            return np.zeros(len(strips))
        return np.take_along_axis(self.y, strips.argmax(axis=1)[:, None], axis=1)[:, 0]


def patch_loads(solution: ContactSolution) -> PatchLoads:
    """Extract the loads of all patches of a solution, in the axes of a right wheel."""
    edges = solution.strip_edges_wheel_y
    loads = {
        field.name: getattr(solution, field.name)
        for field in fields(PatchLoads)
        if field.name != "y"
    }
    return PatchLoads(y=0.5 * (edges[:, 1:] + edges[:, :-1]), **loads)


def utilised_friction(loads: Any) -> FloatArray:
    """Shear over normal force of each patch (m,) [-]."""
    size: FloatArray = np.hypot(loads.force_x, loads.force_y)
    return mean_of(size, loads.normal_force)


def wear_number_without_spin(loads: Any) -> FloatArray:
    r"""Wear number without spin, :math:`T\gamma = |F_x \xi_x| + |F_y \xi_y|` [N].

    The argument is the loads of patches or a campaign result.
    """
    return np.abs(loads.force_x * loads.creepage_x) + np.abs(
        loads.force_y * loads.creepage_y
    )


def wear_number_with_spin(loads: Any) -> FloatArray:
    r"""Wear number with spin, :math:`-(F_x \xi_x + F_y \xi_y + M \varphi)` [N].

    It equals the frictional work per metre rolled, and is at least 0.
    """
    work = (
        loads.force_x * loads.creepage_x
        + loads.force_y * loads.creepage_y
        + loads.spin_moment * loads.spin
    )
    return np.maximum(-work, 0.0)


WEAR_NUMBERS: dict[WearNumber, Callable[[Any], FloatArray]] = {
    "without_spin": wear_number_without_spin,
    "with_spin": wear_number_with_spin,
}


def work_share(loads: PatchLoads) -> FloatArray:
    r"""Share (m, ny) of each patch's damage on each strip, per width [1/m].

    It is :math:`e(y) / \int e\,dy` with the frictional work e(y) of the strips, or that
    of the load without slip. Its integral over the width is 1.
    """
    cells = loads.fields
    work = np.maximum(cells.strip_work, 0.0)
    slips = patch_total(work, cells)[:, None] > 0.0
    chosen = np.where(slips, work, along_strips(cells.pressure, cells))
    return share_of(chosen, cells)
