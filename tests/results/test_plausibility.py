import numpy as np
import pytest
import xarray as xr

from wearsim.results import open_results, result_warnings
from wearsim.results.checks import (
    TREAD_WEAR_BAND,
    cracks_left,
    cracks_warning,
    load_scaling,
    low_friction_warning,
    outside_warning,
    regime_shares,
    seizure_warning,
    shares_beyond_validity,
    stood_in_share,
    tread_wear,
    tread_wear_warning,
)


@pytest.fixture
def make(tmp_path, write_campaign):
    """Campaigns of 60 km in 6 steps; depth grows by `rate`, deepest on the tread."""

    def campaign(kind="field", rate=10e-9):
        with open_results(
            write_campaign(tmp_path / f"{kind}.nc", kind, 6, rate)
        ) as data:
            return data.load()

    return campaign


def test_band_is_the_one_of_the_specification():
    """0.5 to 2 mm per 100 000 km, uncertain."""
    assert TREAD_WEAR_BAND == (0.5e-3, 2e-3)


def test_tread_wear_is_scaled_to_100_000_km(make):
    """10 nm/m over 1e8 m is 1 m; rounding 1e-12."""
    assert tread_wear(make(rate=10e-12)) == pytest.approx(1e-3, rel=1e-12)


def test_flange_wear_is_not_tread_wear(make):
    data = make(rate=10e-12)
    data["wear_depth"].values[-1, 0, data["profile_y"].values[0, 0] < -40e-3] = 1.0
    assert tread_wear(data) == pytest.approx(1e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (4e-12, "0.4 mm per 100 000 km is below"),
        (25e-12, "2.5 mm per 100 000 km is above"),
    ],
)
def test_field_outside_the_band_is_warned_of(make, rate, message):
    line = tread_wear_warning(make(rate=rate))
    assert message in line
    assert "0.5 to 2 mm seen in service (an uncertain band)" in line
    assert "\n" not in line


def test_no_warning_within_the_band_on_the_rig_without_law_and_before_the_first_step(
    make,
):
    assert tread_wear_warning(make(rate=10e-12)) is None
    assert tread_wear_warning(make("rig", 25e-12)) is None
    assert tread_wear_warning(make(rate=25e-12).assign_attrs(wear_law="none")) is None
    assert tread_wear_warning(make(rate=25e-12).isel(step=slice(0, 1))) is None


def test_loads_that_were_not_scaled_are_not_mentioned(make):
    data = make(rate=10e-12)
    data["load_scale"].values[:, 0, 0] = 1.0099
    data["load_scale"].values[:, 3:, 0] = 1.3  # monitoring points
    assert load_scaling(data) is None
    assert result_warnings(data) == []


def test_scaled_loads_are_counted_by_points_and_distance(make):
    """Shares 0.25, 0.5, 0.25; states 1, 2 and 6 of 0 to 6 end steps of their number."""
    data = make(rate=10e-12)
    data["load_scale"].values[1:3, 0, 0] = 1.2
    data["load_scale"].values[2, 1, 1] = 0.7
    data["load_scale"].values[6, 2, 0] = 1.02
    actual = load_scaling(data)
    assert actual.points == 3
    assert actual.distance_share == pytest.approx(
        (2 * 0.25 + 0.5 + 0.25) / 6, rel=1e-12
    )
    assert actual.largest == 0.7
    (line,) = result_warnings(data)
    assert "at 3 operating points that wear, over 21 % of the distance" in line
    assert "at most by the factor 0.7" in line


def test_scaled_loads_of_the_new_wheel_alone(make):
    data = make(rate=10e-12).isel(step=slice(0, 1)).copy(deep=True)
    data["load_scale"].values[0, 0, 0] = 1.2
    actual = load_scaling(data)
    assert (actual.points, actual.distance_share) == (1, 0.0)


@pytest.mark.parametrize(("slot", "share"), [(0, 3.0 / 12.0), (2, 4.0 / 12.0)])
def test_wear_of_wheels_that_another_model_solved_is_counted(make, slot, share):
    """Three patches of 3, 5 and 4 um2/m: of one at the second point, which runs half
    the distance.
    """
    data = make(rate=10e-12)
    assert stood_in_share(data) == 0.0
    data["stood_in"].values[:, 1, slot] = 1.0
    assert stood_in_share(data) == pytest.approx(0.5 * share, rel=1e-12)
    (line,) = result_warnings(data)
    assert "at 1 of " in line
    assert "half_space stood in" in line


def test_little_wear_of_such_wheels_is_not_mentioned(make):
    data = make(rate=10e-12)
    data["stood_in"].values[2, 1, 0] = (
        1.0  # a quarter of the wear in a sixth of half the distance
    )
    assert 0.0 < stood_in_share(data) < 0.05
    assert result_warnings(data) == []


def test_results_that_do_not_count_such_wheels_have_none(make):
    assert stood_in_share(make(rate=10e-12).drop_vars("stood_in")) == 0.0


@pytest.fixture
def unbalanced(make):
    """A campaign whose second point runs with a residual of its forces from row 3 on,
    and whose first one is in a given place.
    """

    def campaign(residual):
        data = make(rate=10e-12)
        values = np.full((data.sizes["step"], data.sizes["operating_point"]), np.nan)
        values[:, 1] = 1e-5
        values[3:, 1] = residual
        return data.assign(force_residual=(("step", "operating_point"), values))

    return campaign


def test_a_point_whose_forces_are_not_balanced_is_named_with_its_distance(unbalanced):
    data = unbalanced(2.5e-3)
    (line,) = result_warnings(data)
    name = data["operating_point_name"].values[1]
    distance = data["distance"].values[3] / 1e3
    assert f"in {name}, first at {distance:g} km: at most 0.25 % " in line


def test_points_whose_forces_are_nearly_balanced_or_not_stated_are_not(unbalanced):
    assert result_warnings(unbalanced(0.9e-3)) == []
    assert result_warnings(unbalanced(2.5e-3).drop_vars("force_residual")) == []


@pytest.fixture
def moved(make):
    """A rig whose wheelset, without a lateral force, is on its flange at the second
    point from a row on.
    """

    def campaign(row, *, force=0.0, stiffness=1e6):
        data = make("rig")
        points = data.sizes["operating_point"]
        shape = ("step", "operating_point"), np.zeros((data.sizes["step"], points))
        data = data.assign(lateral_force=shape, lateral_stiffness=shape).copy(deep=True)
        data["contact_angle"].values[:] = 0.05
        data["lateral_force"].values[:] = force
        data["lateral_stiffness"].values[:] = stiffness
        data["contact_angle"].values[row:, 1] = -0.9
        return data

    return campaign


def test_a_wheelset_that_moves_onto_its_flange_without_force_is_named_with_its_distance(
    moved,
):
    data = moved(3)
    (line,) = [line for line in result_warnings(data) if "moved onto a flange" in line]
    name, distance = (
        data["operating_point_name"].values[1],
        data["distance"].values[3] / 1e3,
    )
    assert f"{name} from {distance:g} km on" in line


@pytest.mark.parametrize(
    "given", [{"row": 0}, {"row": 3, "force": 5e3}, {"row": 3, "stiffness": 0.0}]
)
def test_a_wheelset_on_its_flange_from_the_start_by_force_or_held_there_is_not(
    moved, given
):
    assert not any("flange" in line for line in result_warnings(moved(**given)))


def test_share_of_seizure_of_the_active_and_the_comparison_laws(make):
    data = make(rate=10e-12)
    assert regime_shares(data, "seizure") == {}
    data["regime_name"] = ("regime", ["mild", "seizure"])
    depth = data["wear_depth_by_regime"].values[-1]
    share = depth[:, 1].sum() / depth.sum()
    area = np.zeros((data.sizes["step"], 2, 3))
    area[-1] = [1e-6, 3e-6, 5e-6]
    data = data.assign(
        comparison_name=("comparison", ["archard", "energy"]),
        comparison_regime_name=(
            "comparison_regime",
            ["archard: mild", "archard: seizure", "energy: mild"],
        ),
        comparison_worn_area=(("step", "wheel", "comparison_regime"), area),
    ).assign_attrs(wear_law="own")
    assert regime_shares(data, "seizure") == pytest.approx(
        {"own": share, "archard": 0.75}, rel=1e-12
    )
    message = seizure_warning(data)
    assert "75 % of the wear by Archard is seizure" in message
    assert message in result_warnings(data)
    area[-1, :, 1] = 0.0
    data["wear_depth_by_regime"].values[-1][:, 1] = 0.0
    assert seizure_warning(data) is None


def test_wear_outside_the_rows_of_a_table_is_warned_of(make):
    data = make(rate=10e-12)
    assert outside_warning(data) is None
    data["regime_name"] = ("regime", ["below", "within"])
    data = data.assign_attrs(wear_law="table")
    depth = data["wear_depth_by_regime"].values[-1]
    message = outside_warning(data)
    assert (
        f"{100.0 * depth[:, 0].sum() / depth.sum():.2g} % of it is below the first row"
        in message
    )
    assert "beyond" not in message
    assert message in result_warnings(data)
    data["wear_depth_by_regime"].values[-1][:, 0] = 0.0
    assert outside_warning(data) is None


def test_doubtful_wear_is_counted_by_patch_and_distance(make):
    """One of two equal points in one of two equal steps above shakedown; tests of the
    law up to 1.8 GPa.
    """
    data = (
        make(rate=10e-12)
        .isel(step=slice(0, 3))
        .assign_attrs(wear_coefficients="lewis_dwyer_joyce_2004")
    )
    acts = data["weight"].values > 0.0
    data["wear_area_rate"].values[:] = 0.0
    data["wear_area_rate"].values[:, np.flatnonzero(acts)[:2], 0] = 1e-12
    data["environment"].values[:] = 0.5
    data["active_weight"].values[1:] = 0.5
    data["step_length"].values[:] = (0.0, 1e3, 1e3)
    data["wear_index_mean"].values[:] = 1e6
    data["force_x"].values[:] = 0.0
    data["force_y"].values[:] = 0.0
    data["max_pressure"].values[:] = 0.9e9
    assert shares_beyond_validity(data) == {
        "above shakedown": 0.0,
        "beyond the tests of the law": 0.0,
    }
    # 300 MPa of yield stress in shear: 4.7 k = 1.41 GPa without friction
    data["max_pressure"].values[1, np.flatnonzero(acts)[0], 0] = 1.5e9
    assert shares_beyond_validity(data) == {
        "above shakedown": 0.25,
        "beyond the tests of the law": 0.0,
    }
    data["wear_index_mean"].values[2, np.flatnonzero(acts)[:2], 0] = 130e6
    assert shares_beyond_validity(data) == {
        "above shakedown": 0.25,
        "beyond the tests of the law": 0.5,
    }
    assert shares_beyond_validity(data.isel(step=slice(0, 1))) == {}


def test_lubrication_counted_twice_is_warned_of(make):
    data = make(rate=10e-12)
    data["environment"].values[:] = 1.0
    data["friction"].values[:] = 0.15
    assert low_friction_warning(data) is None
    data["environment"].values[0] = 0.2
    assert "1 of" in low_friction_warning(data)


@pytest.mark.parametrize(
    ("damage", "warned", "told"),
    [
        (0.6, "left cracks of WLRM, up to 3 mm deep;", "left at most 0.6 of it."),
        (
            12.8,
            (
                "left cracks of WLRM, damage index up to 12.8: cracked, 5 mm deep or "
                "deeper;"
            ),
            ": cracked, as",
        ),
    ],
)
def test_damage_above_one_is_no_depth_of_a_crack(damage, warned, told):
    """A crack of damage 1 is 5 mm deep here: 12.8 is not one of 64 mm."""
    of_points = ("step", "wheel", "fatigue", "point")
    turned = xr.Dataset(
        {
            "last_reprofiling": ("step", [0, 1]),
            "fatigue_name": ("fatigue", ["wlrm"]),
            "fatigue_crack_depth": ("fatigue", [5e-3]),
            "fatigue_damage": (of_points, np.full((2, 2, 1, 3), damage)),
        }
    )
    assert warned in cracks_warning(turned)
    assert told in cracks_left(turned)
    assert "64 mm" not in cracks_warning(turned) + cracks_left(turned)
