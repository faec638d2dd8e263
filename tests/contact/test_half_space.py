"""The whole contact against a half-space solution: S1002 on 60E1, rail and rollers, yaw
0 and 10 mrad.

65 single patches, wheelset shifts of -5.5 to -2.5 and 3 to 4.5 mm: away from the jumps
of the contact, where a small difference in the patch moves everything. Bounds are
measured errors, rounded up; each says whose.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve

DATA = Path(__file__).parents[1] / "data"
NAMES = (
    "rail_y",
    "contact_angle",
    "creepage_x",
    "creepage_y",
    "spin",
    "normal_force",
    "area",
    "max_pressure",
    "force_x",
    "force_y",
    "power",
)


@pytest.fixture(scope="module")
def both(wheelset, counterface, points):
    """Reference table in our signs, and our solution for each of its rows."""
    table = pd.read_csv(DATA / "contact_half_space.csv", comment="#")
    scale = table.speed / 20.0  # creepages there are over the mean speed of both bodies
    table["creepage_x"] = -table.xi * scale
    table["creepage_y"] = -table.eta * scale
    table["spin"] = -table.spin * scale
    table["force_x"], table["force_y"] = -table.force_x, -table.force_y
    ours = pd.DataFrame(index=table.index, columns=list(NAMES), dtype=float)
    for curvature, group in table.groupby("curvature"):
        conditions = points(group["shift"].to_numpy(), group.yaw.to_numpy())
        solution = solve(
            conditions,
            wheelset,
            counterface(curvature),
            ContactModels.of("fast"),
            sides=(0,),
        )
        assert solution.point.tolist() == list(range(len(group)))  # one patch each
        for name in NAMES:
            ours.loc[group.index, name] = getattr(solution, name)
    return table, ours


def test_position(both):
    """Centre of pressure: 0.1 mm and 1 mrad hold; the pressure's shape, not the search,
    sets the rest.
    """
    reference, ours = both
    np.testing.assert_allclose(ours.rail_y, reference.rail_y, atol=0.1e-3, rtol=0.0)
    np.testing.assert_allclose(
        ours.contact_angle, reference.contact_angle, atol=1e-3, rtol=0.0
    )


def test_creepage(both):
    """They follow from the position: 0.06 mm on the profile is 7e-5 of creepage and 3 %
    of spin.
    """
    reference, ours = both
    np.testing.assert_allclose(
        ours.creepage_x, reference.creepage_x, atol=8e-5, rtol=0.0
    )
    np.testing.assert_allclose(
        ours.creepage_y, reference.creepage_y, atol=1e-5, rtol=0.0
    )
    np.testing.assert_allclose(ours.spin, reference.spin, rtol=0.035)


def test_normal_contact(both):
    """Virtual penetration: area 10 % too large, pressure 11 % too low at most, never
    the other way by 2 %.
    """
    reference, ours = both
    area, pressure = (
        ours.area / reference.area - 1.0,
        ours.max_pressure / reference.max_pressure - 1.0,
    )
    assert area.min() > -0.02
    assert area.max() < 0.10
    assert pressure.min() > -0.11
    assert pressure.max() < 0.0


def test_normal_force(both):
    """Both balance the wheel load with normal and creep forces: what differs is the
    creep force, by 2 %.
    """
    reference, ours = both
    straight = reference.yaw == 0.0
    np.testing.assert_allclose(
        ours.normal_force[straight], reference.normal_force[straight], rtol=3e-4
    )
    np.testing.assert_allclose(ours.normal_force, reference.normal_force, rtol=1.5e-3)


def test_creep_forces(both):
    """As a share of friction x load: 2.7 % along, 0.6 % across without yaw, 5.5 % with
    it.
    """
    reference, ours = both
    limit, straight = 0.35 * 80e3, reference.yaw == 0.0
    assert abs(ours.force_x - reference.force_x).max() / limit < 0.028
    across = abs(ours.force_y - reference.force_y) / limit
    assert across[straight].max() < 0.0065
    assert across.max() < 0.058


def test_frictional_power(both):
    """Within 10.3 % in partial slip, 4 % near full slip."""
    reference, ours = both
    error, straight = ours.power / reference.power - 1.0, reference.yaw == 0.0
    assert abs(error[straight]).max() < 0.105
    assert abs(error[~straight]).max() < 0.04


@pytest.mark.parametrize(
    ("name", "bound"),
    [("area", 0.055), ("max_pressure", 0.02), ("power", 0.03)],
    ids=lambda v: str(v),
)
def test_roller_over_rail(both, name, bound):
    """What the tool is for: the ratio of roller to rail is truer than either of
    them.
    """
    reference, ours = both
    error = reference[["shift", "yaw", "curvature"]].assign(
        ratio=ours[name] / reference[name]
    )
    wide = error.pivot_table(
        index=["shift", "yaw"], columns="curvature", values="ratio"
    )
    for roller in (1.0, 2.0):
        change = (wide[roller] / wide[0.0] - 1.0).dropna()
        assert len(change) >= 14
        assert abs(change).max() < bound


# Shift [m], half-space area [m2], maximum pressure [Pa] and power [W]: same program,
# rail, yaw 0.
TWO_LOBES = (0.0, 1.6744e-4, 8.98622e8, 56.4493)


def test_two_lobed_contact_is_beyond_virtual_penetration(points, wheelset, counterface):
    """A known weakness, stated in the README: the bounds say how large it is, not that
    it is acceptable.

    At zero shift S1002 lies flat on 60E1: area 16 % too large, maximum pressure a third
    too low, power 14 % too high (measured). A better normal model will need bounds of
    its own.
    """
    shift, area, pressure, power = TWO_LOBES
    ours = solve(
        points(np.array([shift]), np.array([0.0])),
        wheelset,
        counterface(0.0),
        ContactModels.of("fast"),
        sides=(0,),
    )
    assert 0.15 < ours.area[0] / area - 1.0 < 0.18
    assert -0.35 < ours.max_pressure[0] / pressure - 1.0 < -0.32
    assert 0.12 < ours.power[0] / power - 1.0 < 0.16
