"""Forces of a worn wheelset over shift and yaw where patches part and join."""

import numpy as np
import pytest
from worn_wheels import worn_wheels

from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
    solve,
)
from wearsim.operation.resultants import resultants
from wearsim.profile import standard

STEPS = np.arange(41)
RAIL = standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)


@pytest.fixture(scope="module")
def worn():
    return Wheelset(*worn_wheels("fold"), radius=0.46, half_span=0.75)


@pytest.fixture(scope="module", params=["shift", "yaw"])
def second_differences(request, worn):
    """Largest and median ones of lateral force [N] and steering moment [N m], over 0.25
    um and 1 urad.
    """
    shift, yaw = (
        (0.85e-3 + 0.25e-6 * STEPS, 0.0)
        if request.param == "shift"
        else (0.85e-3, 1e-6 * STEPS)
    )
    where = ContactConditions.of(
        shift, yaw=yaw, wheel_load=80e3, friction=0.35, free_roll=True
    )
    patches = solve(where, worn, Counterface(RAIL, 0.0), ContactModels.of("standard"))
    forces = resultants(patches, STEPS.size)
    return [
        (bent.max(), np.median(bent))
        for bent in (
            np.abs(np.diff(value, 2)) for value in (forces.force, forces.moment)
        )
    ]


def test_forces_of_a_worn_wheelset_do_not_jump(second_differences):
    """By what points of strips jump that begin to slip: 1e-4 of the load; patches in
    one plane jump by kN.
    """
    (force, _), (moment, _) = second_differences
    assert force < 8.0
    assert moment < 10.0


@pytest.mark.xfail(
    strict=True, reason="measured 18 (force, shift), target 3 times the median"
)
def test_second_differences_are_those_of_a_smooth_function(second_differences):
    for largest, median in second_differences:
        assert largest < 3.0 * median
