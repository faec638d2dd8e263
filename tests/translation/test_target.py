"""Target of a rig programme: stages, extremes and regimes of the field, worn wheels."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import wearsim
from wearsim.errors import ResultError
from wearsim.translation.guard import zone_of
from wearsim.translation.target import Target, worn_target

Y = np.stack([np.linspace(-30e-3, 30e-3, 61)] * 2)
SHAPE = np.exp(-0.5 * (Y / 8e-3) ** 2)
RUN = np.array([0.0, 10e3, 40e3])


def patches():
    """Field result of one operating point with a patch on the running circle."""
    values = {"wheel_y": 0.0, "wear_area_rate": 2.0, "max_pressure": 1e9}
    values |= {"wear_index_max": 3e6}
    values |= {"normal_force": 80e3, "force_x": 24e3, "force_y": -32e3}
    grown = np.array([1.0, 2.0, 3.0])[:, None, None]
    dims = ("step", "operating_point", "patch")
    data = {name: (dims, value * grown) for name, value in values.items()}
    data["weight"] = ("operating_point", [1.0])
    data["environment"] = ("operating_point", [0.2])
    return xr.Dataset(data)


@pytest.fixture
def target():
    """Wear that grows by 100 um in 10 km and by 20 um in the next 30 km."""
    depth = np.array([0.0, 100e-6, 120e-6])[:, None, None] * SHAPE
    regimes = np.stack([0.75 * depth, 0.25 * depth], axis=2)
    return Target(RUN, depth, Y, np.zeros_like(Y), "made up", patches(), regimes)


def test_regimes_are_compared_by_their_names(target):
    named = replace(target, regimes=("mild", "severe"))
    turned = named.in_order_of(("severe", "mild"), compared=True)
    np.testing.assert_array_equal(
        turned.regime_depth, target.regime_depth[:, :, [1, 0]]
    )
    assert named.in_order_of(("mild", "plateau"), compared=False).regime_depth is None
    with pytest.raises(ResultError, match="mild, severe in the field and mild, plat"):
        named.in_order_of(("mild", "plateau"), compared=True)
    one = replace(target, regimes=("wear",)).in_order_of(("sliding",), compared=True)
    assert one.regime_depth is None


def test_stages_are_short_at_first_and_end_at_the_target(target):
    np.testing.assert_allclose(
        1e6 * target.levels(50e-6), [10.0, 20.0, 40.0, 90.0, 120.0]
    )
    np.testing.assert_allclose(1e6 * target.levels(500e-6), [10.0, 20.0, 40.0, 120.0])


def test_a_stage_ends_where_the_deepest_wear_reaches_it(target):
    stage = target.stage(0.0, 50e-6)
    assert stage.distance == pytest.approx(5e3)
    np.testing.assert_allclose(stage.depth, 50e-6 * SHAPE, rtol=1e-9)
    assert target.stage(100e-6, 110e-6).distance == pytest.approx(25e3)


def test_extremes_and_regimes_are_those_of_the_zone(target):
    stage = target.stage(0.0, 100e-6)
    zone = int(zone_of(np.zeros(1))[0])
    assert stage.pressure[zone] == 2e9  # of both stored states, the larger one
    assert np.isnan(np.delete(stage.pressure, zone)).all()
    assert stage.wear_index[zone] == 6e6
    # half of the normal force is transmitted: the limit of p0/k is 2
    assert stage.shakedown[zone] == pytest.approx(2e9 / 2.0)
    np.testing.assert_allclose(stage.regimes[:, zone], [0.75, 0.25])
    assert target.environment() == pytest.approx(0.2)


def test_a_worn_wheel_is_worn_in_parts_of_its_depth():
    new = wearsim.standard_profile("S1002")
    cut = 30e-6 * np.exp(-0.5 * (new.y / 6e-3) ** 2)
    worn = wearsim.Profile("worn", "wheel", new.y, new.z - cut)
    target = worn_target((worn, worn), (new, new), 8e6)
    assert target.deepest == pytest.approx(30e-6, rel=0.02)
    half = target.stage(0.0, 0.5 * target.deepest)
    np.testing.assert_allclose(half.depth, 0.5 * target.depth[-1])
    assert half.distance == pytest.approx(4e6)
    assert half.pressure is None
    with pytest.raises(ResultError, match="is not worn"):
        worn_target((new, new), (new, new))


@pytest.mark.parametrize("move", [(0.1e-3, 0.0), (0.0, 0.1e-3), (0.0, -0.1e-3)])
def test_a_worn_wheel_may_lie_in_axes_of_its_own(move):
    """Moved as a whole, as instruments leave it: the pattern within 10 um."""
    new = wearsim.standard_profile("S1002")
    cut = 100e-6 * np.exp(-0.5 * (new.y / 6e-3) ** 2)
    depths = []
    for y, z in ((0.0, 0.0), move):
        worn = wearsim.Profile("worn", "wheel", new.y + y, new.z - cut + z)
        depths.append(worn_target((worn, worn), (new, new)).depth[-1])
    np.testing.assert_allclose(depths[1], depths[0], rtol=0.0, atol=10e-6)
