import numpy as np
import pytest
import xarray as xr

from wearsim.translation import factors
from wearsim.translation.factors import STATUS, at_distances, distance_at


def test_ratio_tells_why_it_is_undefined():
    rig = np.array([3.0, 1.0, np.nan, 1.0, 0.0])
    field = np.array([2.0, 0.0, 1.0, 1e-9, 4.0])
    actual = factors.ratio(rig, field, 1.0)
    zero, missing, small = (
        STATUS[name] for name in ("zero_denominator", "missing", "small_denominator")
    )
    assert actual.status.tolist() == [0, zero, missing, small, 0]
    assert actual.value[[0, 4]].tolist() == [1.5, 0.0]
    assert np.isnan(actual.value[1:4]).all()


def test_ratio_beyond_range_comes_first():
    actual = factors.ratio(
        np.ones(2), np.ones(2), 1.0, reachable=np.array([True, False])
    )
    assert actual.status.tolist() == [0, STATUS["beyond_range"]]


def test_all_zero_quantity_has_no_factor():
    """A scale of zero must not let 0/0 through."""
    assert (
        factors.ratio(np.zeros(1), np.zeros(1), 0.0).status[0]
        == STATUS["zero_denominator"]
    )


@pytest.mark.parametrize(
    ("name", "right", "left"),
    [
        ("power", 1100.0, 150.0),
        ("max_pressure", 1500e6, 850e6),
        ("creepage_x", (60.0 * 1e-3 - 25.0 * 2e-3) / 85.0, -1e-3),
        ("wear_area_rate", 8e-12, 4e-12),
        ("wear_depth_rate_max", 900e-12, 300e-12),
        ("wear_index_mean", (90 * 0.2e6 + 30 * 1.5e6) / 120.0, 0.1e6),
    ],
)
def test_patches_of_a_wheel_combine(field, name, right, left):
    """Sum, largest, load- and area-weighted mean, by hand; rounding 1e-12."""
    np.testing.assert_allclose(
        factors.per_wheel(field, name)[0, 0], [right, left], rtol=1e-12
    )


def test_points_that_did_not_act_are_between_the_rows_that_have_them(field):
    """5 % more area each 10 km; a point is missing in two rows, another one, left out,
    in the last three.
    """
    whole, some = factors.per_wheel(field, "wear_index_max"), field.copy(deep=True)
    area = factors.per_wheel(field, "area")
    for rows, point in ((slice(1, 3), 0), (slice(-3, None), 1)):
        some["n_patch"].values[rows, point] = 0
        for name in ("area", "wear_index_max", "side"):
            some[name].values[rows, point] = np.nan
    assert np.isnan(factors.per_wheel(some, "area")[1, 0]).all()
    filled = factors.between_solutions(some, factors.per_wheel(some, "area"))
    np.testing.assert_allclose(filled[:-3], area[:-3], rtol=1e-12)
    assert np.isnan(filled[-3:, 1]).all()
    np.testing.assert_array_equal(filled[-3:, 0], area[-3:, 0])
    np.testing.assert_array_equal(factors.between_solutions(field, whole), whole)


def test_wheel_without_patch_is_missing(field):
    gone = field.copy()
    gone["side"] = field["side"].where(field["side"] != 1)
    assert np.isnan(factors.per_wheel(gone, "power")[..., 1]).all()
    assert np.isfinite(factors.per_wheel(gone, "power")[..., 0]).all()


def test_equal_points_match_once(rig, field):
    """Shift 0 is a rig block, a field class and a monitor of both: it counts once."""
    pairs = factors.match_points(rig, field)
    shift = rig["shift"].values[pairs[:, 0]]
    assert sorted(shift) == pytest.approx([-3e-3, 0.0, 3e-3, 5e-3], abs=1e-12)
    np.testing.assert_array_equal(shift, field["shift"].values[pairs[:, 1]])


@pytest.mark.parametrize("key", sorted(factors.MATCH_KEYS))
def test_each_key_separates_points(rig, field, key):
    other = field.assign({key: field[key] + 10.0 * factors.MATCH_KEYS[key] + 1e-3})
    if key == "shift":
        other = field.assign({key: field[key] + 0.5e-3})
    assert len(factors.match_points(rig, other)) == 0


def test_friction_on_the_flange_and_loads_by_side_separate_points(rig, field):
    """Results of rigs and fields that hold them; what lacks them has the friction and
    load of both.
    """
    assert len(factors.match_points(rig, field)) > 0
    unlike = xr.DataArray(
        [[[500.0, -500.0]]], dims=("step", "operating_point", "wheel")
    )
    loads = field["wheel_load"] + unlike.isel(operating_point=0)
    loads = loads.transpose("step", "operating_point", "wheel").isel(
        step=[0] * field.sizes["step"]
    )
    for other in (
        field.assign(flange_friction=field["friction"] - 0.1),
        field.assign(wheel_loads=loads),
    ):
        assert len(factors.match_points(rig, other)) == 0
    for key in factors.TURNING_KEYS:
        assert (
            len(factors.match_points(rig, field.assign({key: field["friction"]}))) == 0
        )
        same = [one.assign({key: one["friction"]}) for one in (rig, field)]
        assert len(factors.match_points(*same)) == len(factors.match_points(rig, field))
    alike = field.assign(flange_friction=field["friction"])
    assert len(factors.match_points(rig, alike)) == len(
        factors.match_points(rig, field)
    )


def test_interpolation_meets_rows_exactly():
    distance = np.array([0.0, 1.0, 3.0])
    rows = np.array([[1.0], [np.nan], [5.0]])
    actual = at_distances(distance, rows, np.array([0.0, 3.0, 0.5]))
    assert actual[:2, 0].tolist() == [1.0, 5.0]
    assert np.isnan(actual[2, 0])


def test_distance_at_first_reaches_the_target():
    actual = distance_at(
        np.array([0.0, 2.0, 2.0, 4.0]),
        np.array([0.0, 10.0, 20.0, 30.0]),
        np.array([0.0, 1.0, 2.0, 3.0, 4.1]),
    )
    assert actual[:4].tolist() == [0.0, 5.0, 10.0, 25.0]
    assert np.isnan(actual[4])


def test_collective_mean_takes_magnitudes_and_shares():
    values = np.array([[[2.0, 1.0], [-4.0, 1.0], [np.nan, np.nan]]])
    actual = factors.collective_mean(values, np.array([0.25, 0.75, 0.0]))
    assert actual.tolist() == [[3.5, 1.0]]


def test_regime_flags():
    depth = np.array([[3.0, 1.0, 0.0, 0.01], [1.0, 3.0, 0.0, 0.0]])
    regime = factors.dominant_regime(depth)
    assert regime.tolist() == [0, 1, -1, -1]
    assert factors.regime_differs(regime, np.array([0, 0, 0, -1])).tolist() == [
        0,
        1,
        -1,
        -1,
    ]


@pytest.mark.parametrize(
    ("key", "value"),
    [("rotation_rule", "nominal"), ("axle_torque", 200.0), ("rotation_rule", None)],
)
def test_wheelsets_that_turn_otherwise_have_no_equal_points(rig, field, key, value):
    """Also where a file does not tell: what is unknown is not equal."""
    other = field.copy()
    if value is None:
        del other.attrs[key]
    else:
        other = field.assign_attrs({key: value})
    assert factors.match_points(rig, other).shape == (0, 2)
    assert len(factors.match_points(rig, field)) == 4


def test_a_free_roll_is_not_a_given_one(rig, field):
    free = [data.assign_attrs(roll_rule="free") for data in (rig, field)]
    assert len(factors.match_points(*free)) == 4
    assert len(factors.match_points(rig, free[1])) == 0


def test_given_rotation_speeds_are_never_equal(rig, field):
    """They are not in the file."""
    pair = [data.assign_attrs(rotation_rule="given") for data in (rig, field)]
    assert len(factors.match_points(*pair)) == 0


def test_one_rule_for_what_is_too_small_to_divide_by():
    """Signed quantities leave remainders of symmetry, changes of shape go through
    zero.
    """
    assert factors.zero_share("force_y") == factors.CONTACT_SHARE
    assert factors.zero_share("flange_thickness") == factors.CHANGE_SHARE
    assert (
        factors.zero_share("wear_area_rate")
        == factors.zero_share("worn_area")
        == factors.ZERO_SHARE
    )
    assert set(factors.SYMMETRIC) <= set(factors.POINT_QUANTITIES)
