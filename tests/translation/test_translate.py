import math

import netCDF4
import numpy as np
import pytest
import xarray as xr

from wearsim.errors import ResultError
from wearsim.results import open_results
from wearsim.results.settings import SETTINGS
from wearsim.translation import factors
from wearsim.translation.compare import answers
from wearsim.translation.factors import SIMILARITY, STATUS, similarity
from wearsim.translation.translate import (
    content_hash,
    point_table,
    table,
    translate,
    write,
)


@pytest.fixture(scope="module")
def translation(rig, field):
    return translate(rig, field)


def test_depth_factor_at_equal_distance(translation):
    """Depth grows by 20 and 8 nm/km: the factor is 2.5 wherever there is wear."""
    factor = translation["max_wear_depth_factor"].values[0]
    np.testing.assert_allclose(factor[1:], 2.5, rtol=1e-12)
    assert np.isnan(factor[0]).all()
    assert (
        translation["max_wear_depth_factor_status"].values[0, 0]
        == STATUS["zero_denominator"]
    ).all()


def test_depth_factor_at_equal_depth(translation):
    """By definition 1 for both wheels together; distances then are as 1 to 2.5."""
    np.testing.assert_allclose(
        translation["max_wear_depth_factor"].values[1, 1:, 2], 1.0, rtol=1e-12
    )
    run = translation["distance_run"].values[1]
    np.testing.assert_allclose(run[:, 1], 2.5 * run[:, 0], rtol=1e-12)


def test_common_range(translation):
    """60 km on the rig, 90 km in the field; 1.2 and 0.72 mm deep."""
    assert translation["distance_run"].values[0, -1].tolist() == [60e3, 60e3]
    np.testing.assert_allclose(
        translation["worn_depth"].values[1, -1], 720e-6, rtol=1e-12
    )


def test_wear_depth_along_the_profile(translation, rig, field):
    depth = translation["wear_depth_profile"]
    np.testing.assert_allclose(
        depth.values[0, -1, 0], rig["wear_depth"].values[6], rtol=1e-12
    )
    np.testing.assert_allclose(
        depth.values[0, -1, 1], field["wear_depth"].values[6], rtol=1e-12
    )
    status = translation["wear_depth_profile_factor_status"].values[0, -1]
    worn = depth.values[0, -1, 1] > 0.01 * depth.values[0, -1, 1].max(
        axis=-1, keepdims=True
    )
    np.testing.assert_array_equal(status == 0, worn)


def test_regime_differs_only_in_the_severe_band(translation, rig):
    """Within 4 mm of the running circle the rig wears severely and the field mildly."""
    differs = translation["regime_profile_differs"].values[0, -1, 0]
    y = rig["profile_y"].values[0, 0]
    np.testing.assert_array_equal(differs == 1, np.abs(y) < 4e-3)


def test_contact_factors_at_equal_points(translation):
    np.testing.assert_allclose(
        translation["power_point_factor"].values[0, 0], 1.3, rtol=1e-12
    )
    np.testing.assert_allclose(
        translation["area_point_factor"].values[0], 1.0 / 1.3, rtol=1e-12
    )
    assert (
        translation["creepage_y_point_factor_status"].values
        == STATUS["zero_denominator"]
    ).all()
    np.testing.assert_allclose(
        translation["wear_area_rate_point_factor"].values, 1.3**2, rtol=1e-12
    )
    np.testing.assert_allclose(
        translation["wear_depth_rate_max_point_factor"].values, 1.3, rtol=1e-12
    )
    meaning = translation["wear_area_rate_point"].attrs["long_name"]
    assert meaning.endswith("without environment factor at equal operating points")


def test_wear_rates_of_the_collective_contain_the_environment_factor(
    translation, rig, field
):
    """Of 1 on the rig and 0.2 in the field, as all wear depths and areas do."""

    def mean_at_60_km(data, name):
        mean = factors.collective_mean(
            factors.per_wheel(data, name), data["weight"].values
        )
        return mean[6].mean()

    for name in ("wear_area_rate", "wear_depth_rate_max"):
        bare = [mean_at_60_km(data, name) for data in (rig, field)]
        actual = translation[f"{name}_collective"].values[0, -1, :, -1]
        np.testing.assert_allclose(actual, [bare[0], 0.2 * bare[1]], rtol=1e-12)
        ratio = translation[f"{name}_collective_factor"].values[0, -1, -1]
        np.testing.assert_allclose(ratio, 5.0 * bare[0] / bare[1], rtol=1e-12)
    power = translation["power_collective"].values[0, -1, 1, -1]
    assert power == pytest.approx(mean_at_60_km(field, "power"), rel=1e-12)


def test_equivalent_distance_ends_with_the_field(translation):
    """Rig distance s wears as deep as 2.5 s in the field, which ends at 90 km, so at
    s = 36 km.
    """
    s = translation["rig_distance"].values
    actual = translation["equivalent_field_distance_max_wear_depth"].values[:, 2]
    inside = s <= 36e3
    np.testing.assert_allclose(actual[inside], 2.5 * s[inside], rtol=1e-12, atol=1e-9)
    assert np.isnan(actual[~inside]).all()
    status = translation["equivalent_field_distance_max_wear_depth_status"].values[:, 2]
    np.testing.assert_array_equal(
        status, np.where(inside, STATUS["defined"], STATUS["beyond_range"])
    )


def test_equivalent_distance_of_the_field_ends_with_the_rig(translation):
    """Field distance s wears as deep as 0.4 s on the rig, whose 60 km are more than the
    90 km need.
    """
    s = translation["field_distance"].values
    found = translation["equivalent_rig_distance_max_wear_depth"].values[:, 2]
    np.testing.assert_allclose(found, 0.4 * s, rtol=1e-12, atol=1e-9)


def test_there_and_back_is_the_same_distance(rig, field):
    asked = 20e3
    there = answers(rig, field, "rig", asked)["field_km"]
    assert there[0] == pytest.approx(2.5 * 1e-3 * asked, rel=1e-12)
    for k, km in enumerate(there):
        back = answers(rig, field, "field", 1e3 * km)["rig_km"][k]
        assert back == pytest.approx(1e-3 * asked, rel=1e-12)


def test_beyond_the_reach_is_no_number_but_what_is_missing(rig, field):
    """The rig's 60 km are 150 km of a field of which 90 km were run: of its 100 km 10
    are missing.
    """
    row = answers(rig, field, "field", 100e3).iloc[0]
    assert np.isnan(row["rig_km"])
    assert np.isnan(row["field_km_per_rig_km"])
    assert row["field_km_within_reach"] == pytest.approx(90.0, rel=1e-12)
    assert row["field_km_missing"] == pytest.approx(10.0, rel=1e-12)
    row = answers(rig, field, "rig", 50e3).iloc[
        0
    ]  # 36 km of the rig wear as the whole field campaign
    assert row["rig_km_within_reach"] == pytest.approx(36.0, rel=1e-12)
    assert row["rig_km_missing"] == pytest.approx(14.0, rel=1e-12)


def test_area_factor_at_equal_area(translation):
    """By definition 1 for both wheels together, at all stations between the new wheel
    and the end.
    """
    np.testing.assert_allclose(
        translation["worn_area_factor"].values[2, 1:, 2], 1.0, rtol=1e-12
    )
    area = translation["worn_area"].values[2, :, 0, 2]
    np.testing.assert_allclose(np.diff(area), area[-1] / 40, rtol=1e-9)


def test_deepest_zone_is_the_deepest_place(translation):
    zone, whole = translation["zone_depth"].values, translation["max_wear_depth"].values
    np.testing.assert_allclose(zone.max(axis=3), whole, rtol=0.0, atol=1e-15)
    status = translation["zone_depth_factor_status"].values[0, -1, :, 2]
    names = list(translation["zone_name"].values)
    assert status[names.index("tread")] == STATUS["defined"]


def test_curves_of_one_shape_are_alike_whatever_their_depth():
    arc = np.linspace(0.0, 0.1, 2001)
    rig, moved = (np.exp(-(((arc - at) / 4e-3) ** 2)) for at in (0.04, 0.05))
    wide = np.exp(-(((arc - 0.04) / 8e-3) ** 2))
    alike = similarity(
        np.stack([rig, rig, rig, 0.0 * rig]),
        np.stack([7.0 * rig, moved, wide, rig]),
        arc,
    )
    np.testing.assert_allclose(
        [alike[name][0] for name in SIMILARITY], [1.0, 0.0, 1.0, 1.0], atol=1e-12
    )
    assert alike["depth_shift"][1] == pytest.approx(-0.01, rel=1e-9)
    assert alike["depth_width"][1:3] == pytest.approx(
        [1.0, 0.5], rel=1e-3
    )  # tails below 1 % are cut
    assert alike["depth_overlap"][1] == pytest.approx(math.erfc(0.005 / 4e-3), abs=0.01)
    assert all(
        np.isnan(alike[name][3])
        for name in ("depth_shift", "depth_width", "depth_correlation")
    )


def test_unknown_conicity_is_missing(translation):
    """The files have no conicity from step 4 on."""
    assert (
        translation["equivalent_conicity_factor_status"].values[0, -1]
        == STATUS["missing"]
    )


def test_table_equals_the_dataset(translation):
    rows = table(translation).set_index(["basis", "variable"])
    depth = rows.loc[("equal distance", "max_wear_depth")]
    assert depth["unit"] == "mm"
    assert depth["rig"] == pytest.approx(1.2, rel=1e-12)
    assert depth["factor"] == pytest.approx(2.5, rel=1e-12)
    assert rows.loc[("equal worn depth", "distance_run")]["factor"] == pytest.approx(
        0.4, rel=1e-12
    )
    assert (
        rows.loc[("equal distance", "creepage_y_collective")]["status"]
        == "zero_denominator"
    )


def test_table_never_contradicts_the_file(rig, field, translation):
    """The same values, factors and reasons, also for what is near the limit: 0.5e-3 of
    the largest force.
    """
    near = field.copy(deep=True)
    force = near["force_y"].values
    force[-1] *= 0.5e-3
    actual = translate(rig, near)
    status = actual["force_y_collective_factor_status"].values
    assert status[1, -1, 2] == STATUS["small_denominator"]
    for data in (translation, actual):
        for _, row in table(data).iterrows():
            basis = ["equal distance", "equal worn depth", "equal worn area"].index(
                row["basis"]
            )
            place = (
                (basis, -1)
                if data[row["variable"]].dims[-1] != "wheel_group"
                else (basis, -1, 2)
            )
            factor = data[f"{row['variable']}_factor"].values[place]
            assert (
                STATUS[row["status"]]
                == data[f"{row['variable']}_factor_status"].values[place]
            )
            assert row["factor"] == factor or (
                np.isnan(row["factor"]) and np.isnan(factor)
            )


def test_small_changes_of_the_wheel_shape_are_not_called_zero(rig, field):
    """A field that wears a thousandth of what it will: 1 % of the largest change is the
    limit.
    """
    slow = field.copy(deep=True)
    sd = slow["flange_thickness"].values
    sd[:] = sd[0] + 1e-3 * (sd - sd[0])
    rows = table(translate(rig, slow)).set_index(["basis", "variable"])
    assert (
        rows.loc[("equal distance", "flange_thickness_change")]["status"]
        == "small_denominator"
    )
    assert (
        rows.loc[("equal distance", "hollowing_change")]["status"] == "zero_denominator"
    )


def test_points_table_is_the_dataset(translation):
    rows = point_table(translation)
    # 3 states, 4 points, 2 wheels
    assert len(rows) == 3 * 4 * 2 * len(factors.POINT_QUANTITIES)
    assert rows["shift"].drop_duplicates().tolist() == pytest.approx(
        [-3.0, 0.0, 3.0, 5.0], abs=1e-9
    )
    area = rows[rows["variable"] == "wear_area_rate_point"]
    # 8e-12 and 1.69 times that on the right wheel, in mm2 per 1000 km
    assert area["field"].iloc[0] == pytest.approx(8.0, rel=1e-12)
    assert area["rig"].iloc[0] == pytest.approx(8.0 * 1.69, rel=1e-12)
    assert area["factor"].to_numpy() == pytest.approx(1.69, rel=1e-12)
    assert set(rows[rows["variable"] == "creepage_y_point"]["status"]) == {
        "zero_denominator"
    }


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "youngs_modulus",
            205e9,
            "youngs modulus differs: 2.1e+11 Pa on the rig, 2.05e+11 Pa in the field",
        ),
        (
            "wheel_radius",
            0.42,
            "wheel radius differs: 0.46 m on the rig, 0.42 m in the field",
        ),
        (
            "cell_size",
            0.25e-3,
            "cell size differs: 0.0005 m on the rig, 0.00025 m in the field",
        ),
        ("cells", np.int32(20), "cells differs: 50 on the rig, 20 in the field"),
        (
            "counterface_profile",
            "54E1",
            "counterface profile differs: 60E1 1:40 on the rig, 54E1 in the field",
        ),
        (
            "axle_torque",
            100.0,
            "axle torque differs: 0 N m on the rig, 100 N m in the field",
        ),
        ("wear_law", "", "wear law differs: USFD on the rig, unknown in the field"),
        (
            "wear_law",
            "9" * 400,
            f"wear law differs: USFD on the rig, {'9' * 37}... in the field",
        ),
        ("wear_law", "a\nb", "wear law differs: USFD on the rig, a\\nb in the field"),
    ],
)
def test_differing_settings_are_named_with_both_values(rig, field, key, value, message):
    actual = translate(rig, field.assign_attrs({key: value}))
    assert message in actual.attrs["warnings"].splitlines()
    assert table(actual).attrs["warnings"] == actual.attrs["warnings"].splitlines()
    assert (actual.attrs["matched_points"] == 0) == (SETTINGS[key].of_points)
    assert actual.attrs[f"rig_{key}"] == rig.attrs[key]


def test_every_attribute_of_model_material_and_wheelset_is_compared(rig, field):
    for key in [one.name for one in SETTINGS.values() if one.compared]:
        actual = translate(rig, field.assign_attrs({key: "something else"}))
        assert f"{key.replace('_', ' ')} differs" in actual.attrs["warnings"], key


def test_counterfaces_of_one_name_and_two_shapes_are_reported(rig, field):
    moved = field.assign(counterface_y=field["counterface_y"] + 1e-3)
    warnings = translate(rig, moved).attrs["warnings"]
    assert (
        "the counterface profiles differ in shape or place, by up to 1 mm" in warnings
    )
    sparse = field.isel(counterface_point=slice(None, None, 2))
    assert "are sampled differently" in translate(rig, sparse).attrs["warnings"]
    assert "warnings" not in translate(rig, field).attrs


def test_no_wear_leaves_factors_undefined(tmp_path, write_campaign, rig):
    """A field without friction: nothing to divide by, and nothing but the new wheel at
    equal depth.
    """
    with open_results(
        write_campaign(tmp_path / "field.nc", "field", 3, 8e-9, friction_free=True)
    ) as data:
        actual = translate(rig, data.load())
    assert (
        actual["max_wear_depth_factor_status"].values[0] == STATUS["zero_denominator"]
    ).all()
    assert (
        actual["power_point_factor_status"].values[1, 1:] == STATUS["beyond_range"]
    ).all()
    assert (actual["power_point_factor_status"].values[1, 0] == STATUS["defined"]).all()


def test_file_holds_neither_nan_nor_infinity(tmp_path, campaign_files, translation):
    path = write(translate(*campaign_files), tmp_path / "translation.nc")
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name, variable in file.variables.items():
            if variable.dtype is not str:
                assert np.isfinite(variable[:]).all(), name
                assert getattr(variable, "long_name", ""), name
            if name.endswith("_factor"):
                undefined = variable[:] == variable._FillValue
                np.testing.assert_array_equal(
                    undefined, file.variables[f"{name}_status"][:] != 0
                )
    with xr.open_dataset(path) as read:
        np.testing.assert_array_equal(
            read["power_point_factor"].values, translation["power_point_factor"].values
        )
        assert table(read.load()).equals(table(translation))


def test_campaigns_without_common_points_say_so(rig, field):
    actual = translate(rig, field.assign(speed=field["speed"] + 1.0))
    assert actual.attrs["matched_points"] == 0
    assert "[operation.monitor]" in actual.attrs["warnings"]
    assert "power_point" not in actual


def test_content_hash_sees_one_bit(rig):
    changed = rig.copy(deep=True)
    changed["worn_area"].values[3, 1] = np.nextafter(
        changed["worn_area"].values[3, 1], 1.0
    )
    assert content_hash(rig) != content_hash(changed)
    assert content_hash(rig) == content_hash(rig.copy(deep=True))


def test_unreadable_file_is_one_line(tmp_path, campaign_files, impatient):
    bad = tmp_path / "rig.nc"
    bad.write_text("not netCDF")
    with pytest.raises(ResultError, match=r"rig\.nc cannot be read") as caught:
        translate(bad, campaign_files[1])
    assert "\n" not in str(caught.value)


def test_unwritable_place_is_one_line(tmp_path, campaign_files):
    with pytest.raises(ResultError, match="cannot be written"):
        write(translate(*campaign_files), tmp_path / "absent" / "translation.nc")


@pytest.mark.cf
def test_compliance_checker_finds_nothing(tmp_path, campaign_files, assert_cf):
    assert_cf(write(translate(*campaign_files), tmp_path / "translation.nc"))


def test_reprofiled_wheels_have_no_factors(rig, field):
    """Wear depth begins anew at a reprofiling."""
    reprofiled = rig.assign(
        last_reprofiling=("step", np.minimum(np.arange(rig.sizes["step"]), 2))
    )
    with pytest.raises(
        ResultError, match=r"its wheels were reprofiled.*\[campaign.reprofiling\]"
    ):
        translate(reprofiled, field)
