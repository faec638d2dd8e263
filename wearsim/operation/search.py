"""What is controlled of operating points, and the points on their way to its balance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions, ContactModels, ContactPatches, Counterface, Wheelset
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError
from wearsim.operation.bogie import Bogies
from wearsim.operation.resultants import Resultants, resultants

_COARSE, _COARSE_CELL = 12, 2e-3  # strips, cells and their size of the walk: its end is solved as asked for


@dataclass(frozen=True)
class Controlled:
    """What is controlled of `n` operating points in place of shift and wheel loads; NaN: those are given."""

    lateral_force: FloatArray  # (n,) on the wheelset at axle height, to the right [N]
    axle_load: FloatArray  # (n,) that both wheels carry [N]
    box_moment: FloatArray  # (n,) of the axle boxes, right side down positive [N m]
    bogies: Bogies | None = None  # points whose shift and yaw follow from the balance of a bogie

    @property
    def any(self) -> NDArray[np.bool_]:
        """Points (n,) whose shift or wheel loads follow from forces."""
        return np.isfinite(self.lateral_force) | np.isfinite(self.axle_load)

    def at(self, index: IntArray) -> Controlled:
        """Return forces and loads of the points at `index`; bogies are those of all points."""
        return Controlled(self.lateral_force[index], self.axle_load[index], self.box_moment[index])


@dataclass
class Search:
    """Points on their way to balance; arrays over all `n` of them."""

    conditions: ContactConditions
    controlled: Controlled
    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    threads: int
    shift: FloatArray
    yaw: FloatArray
    roll: FloatArray
    load: FloatArray
    stiffness: FloatArray
    beyond: FloatArray  # shift, both loads, share and gap past a jump (n, 5); NaN: there is none

    def solve(
        self,
        rows: IntArray,
        shift: FloatArray,
        load: FloatArray,
        coarse: bool = False,
        yaw: FloatArray | None = None,
    ) -> tuple[Resultants, NDArray[np.bool_]]:
        """Resultants at shifts (k,) under loads (k, 2) of `rows` (k,), and which have a solution.

        Where a `yaw` (k,) is given it takes the place of that of the search.
        """
        here = replace(
            self.conditions.at(rows), shift=shift, wheel_load=load, yaw=self.yaw[rows] if yaw is None else yaw
        )
        models, failed = self.models, dict[int, ContactError]()
        if coarse:
            models = replace(models, strips=_COARSE, cells=_COARSE, cell_size=_COARSE_CELL)
        found: list[ContactPatches] = solve_each(
            here, self.wheelset, self.counterface, models, ContactSolution.patches, threads=self.threads,
            failed=failed, fields="work",
        )  # fmt: skip
        solved = np.ones(rows.size, dtype=bool)
        solved[list(failed)] = False
        return resultants(joined(found), rows.size), solved

    def loads(self, rows: IntArray, forces: Resultants, load: FloatArray, share: float = 1.0) -> FloatArray:
        """Wheel loads (k, 2) that balance the roll with the levers of `forces`, under the forces wanted.

        Where the lateral force is controlled its moment is that of the force wanted: what is still missing of
        it does not shift load. `share` of the force wanted acts.
        """
        own = self.controlled.at(rows)
        wanted, vertical = share * own.lateral_force, np.where(forces.vertical > 0.0, forces.vertical, 1.0)
        given = np.isfinite(wanted)
        arm = forces.roll_moment / vertical
        held = (forces.roll_moment - forces.height[:, None] * forces.lateral) / vertical
        arm = np.where(given[:, None], held, arm)
        moment = own.box_moment + np.where(given, forces.height * wanted, 0.0)
        apart = arm[:, 0] - arm[:, 1]  # 0 without a solution
        right = (moment - arm[:, 1] * own.axle_load) / np.where(apart == 0.0, 1.0, apart)
        both = np.stack((right, own.axle_load - right), axis=1)
        return np.where((np.isfinite(own.axle_load) & (apart != 0.0))[:, None], both, load)
