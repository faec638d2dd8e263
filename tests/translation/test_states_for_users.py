"""State of a result at a distance, and worn wheels of it, from files, datasets and
parts of them.
"""

import numpy as np
import pytest

import wearsim
from wearsim.errors import WearsimError


@pytest.fixture(scope="module")
def path(tmp_path_factory, write_campaign):
    return write_campaign(tmp_path_factory.mktemp("states") / "rig.nc", "rig", 5, 20e-9)


@pytest.fixture
def rig(path):
    with wearsim.open_results(path) as data:
        yield data.load()


def test_values_of_wheels_are_linear_and_those_of_patches_of_the_state_before(
    path, rig
):
    run = rig["distance"].values
    at = 0.25 * run[1] + 0.75 * run[2]
    state = wearsim.at_distance(path, at)
    for name in (
        "profile_y",
        "profile_z",
        "wear_depth_by_regime",
        "worn_area",
        "max_wear_depth",
    ):
        expected = 0.25 * rig[name][1].values + 0.75 * rig[name][2].values
        np.testing.assert_allclose(
            state[name], expected, rtol=1e-12, atol=1e-18, err_msg=name
        )
    for name in ("area", "side", "n_patch", "active_weight", "step_limit"):
        np.testing.assert_array_equal(state[name], rig[name][1], err_msg=name)
    conicity = (
        0.25 * rig["equivalent_conicity"][1] + 0.75 * rig["equivalent_conicity"][2]
    )
    assert float(state["equivalent_conicity"]) == pytest.approx(
        float(conicity), rel=1e-12
    )
    assert float(state["distance"]) == at
    assert float(state["max_wear_depth"].sel(wheel="left")) == float(
        state["max_wear_depth"][1]
    )


def test_several_distances_are_a_dimension_and_stored_states_keep_their_bits(rig):
    run = rig["distance"].values
    series = wearsim.at_distance(rig, run[[0, 2, 4]])
    assert series["profile_z"].dims == ("distance", "wheel", "point")
    np.testing.assert_array_equal(series["profile_z"], rig["profile_z"][[0, 2, 4]])
    (line,) = (
        series["wear_depth"].sel(distance=run[2], wheel="right").plot(x="profile_y")
    )
    assert line.get_ydata().max() > 0.0


def test_a_worn_wheel_of_a_file_and_of_a_dataset_is_the_same_profile(path, rig):
    half = 0.5 * float(rig["distance"][-1])
    for wheel in ("right", "left"):
        one, other = (wearsim.worn_profile(each, wheel, half) for each in (path, rig))
        np.testing.assert_array_equal(one.z, other.z)
        state = wearsim.at_distance(rig, half).sel(wheel=wheel)
        np.testing.assert_allclose(one.z, state["profile_z"], rtol=1e-12, atol=1e-18)
    assert one.kind == "wheel"
    assert "interpolated between" in one.source
    last = wearsim.worn_profile(path)
    np.testing.assert_array_equal(last.y, rig["profile_y"][-1, 0])


def test_a_part_with_profiles_is_enough_for_a_worn_wheel(rig, tmp_path):
    rig[["profile_y", "profile_z"]].to_netcdf(tmp_path / "part.nc")
    part = wearsim.worn_profile(tmp_path / "part.nc", "left")
    np.testing.assert_array_equal(part.z, rig["profile_z"][-1, 1])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda rig: wearsim.at_distance(rig, 1e9),
            "distance = 1000000000 must be 0 to .* m",
        ),
        (
            lambda rig: wearsim.at_distance(rig, [0.0, np.nan]),
            "distance = nan must be 0 to",
        ),
        (lambda rig: wearsim.at_distance(rig.isel(step=0), 0.0), "one state alone"),
        (
            lambda rig: wearsim.worn_profile(rig, "both"),
            "wheel = 'both' is not one of right, left",
        ),
        (
            lambda rig: wearsim.worn_profile(rig, "right", -1.0),
            "distance = -1 m must be 0 to",
        ),
        (
            lambda rig: wearsim.worn_profile(rig.drop_vars("profile_z")),
            "part of a result without profiles",
        ),
        (
            lambda rig: wearsim.worn_profile(rig.sel(wheel=["left"])),
            "without the right wheel",
        ),
        (
            lambda rig: wearsim.worn_profile(rig.isel(wheel=0)),
            "part of a result without profiles",
        ),
        (
            lambda rig: wearsim.inspect(rig.drop_vars("hollowing")),
            "hollowing is not whole; give the result",
        ),
        (
            lambda rig: wearsim.inspect(rig.isel(wheel=0)),
            "is not whole; give the result file",
        ),
        (lambda _: wearsim.citations("none.nc"), "none.nc does not exist"),
        (
            lambda _: wearsim.measure(wearsim.standard_profile("60E1")),
            "those of a wheel",
        ),
    ],
)
def test_faults_are_one_line(rig, call, message):
    with pytest.raises(WearsimError, match=message) as caught:
        call(rig)
    assert "\n" not in str(caught.value)


def test_summaries_and_citations_of_files_and_datasets_are_the_same(path, rig):
    assert wearsim.inspect(path) == wearsim.inspect(rig)
    assert wearsim.citations([path, rig]) == wearsim.citations(rig)


def test_creep_curves_of_contaminated_rails_are_cited(rig):
    for numbers, cited in (({}, False), ({"kalker_factor": 0.4}, True)):
        publications = wearsim.citations(rig.assign_attrs(numbers))
        assert any("Polach" in one for one in publications) is cited


def test_settings_that_a_result_does_not_state_are_those_of_clean_rails(rig):
    """Results of earlier versions have no Kalker factor."""
    key = "kalker factor differs"
    same = wearsim.compare(rig, rig.assign_attrs(kalker_factor=1.0))
    other = wearsim.compare(rig, rig.assign_attrs(kalker_factor=0.4))
    assert key not in str(same.attrs)
    assert f"{key}: 1" in str(other.attrs)
