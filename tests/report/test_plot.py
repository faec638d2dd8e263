"""One figure of a result by the name of a quantity."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import wearsim
from wearsim.errors import WearsimError


@pytest.fixture(scope="module")
def rig(run_directory):
    with wearsim.open_results(run_directory / "rig.nc") as data:
        return data.load()


def test_depth_and_profile_are_those_of_the_wheel_and_distance(rig):
    half = 0.5 * float(rig["distance"][-1])
    state = wearsim.at_distance(rig, half).sel(wheel="left")
    (line,) = wearsim.plot(rig, wheel="left", distance=half).lines
    np.testing.assert_allclose(line.get_ydata(), 1e3 * state["wear_depth"], rtol=1e-12)
    worn = wearsim.plot(rig, "profile_z", wheel="left", distance=half).lines[-1]
    np.testing.assert_allclose(worn.get_ydata(), 1e3 * state["profile_z"], rtol=1e-9, atol=1e-9)


def test_measures_are_drawn_over_the_distance_patches_over_the_shift_into_given_axes(run_directory, rig):
    figure, (one, other) = plt.subplots(2)
    assert wearsim.plot(run_directory / "rig.nc", "worn_area", one) is one
    for line, wheel in zip(one.lines, ("right", "left"), strict=True):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * rig["worn_area"].sel(wheel=wheel), rtol=1e-12)
    assert wearsim.plot(rig, "max_pressure", other) is other
    drawn = np.sort(np.concatenate([line.get_ydata() for line in other.lines]))
    pressure = rig["max_pressure"].values[-1]
    np.testing.assert_allclose(drawn, 1e-6 * np.sort(pressure[np.isfinite(pressure)]), rtol=1e-12)
    plt.close(figure)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("max_presure", {}, "'max_presure' is nothing that plot draws .* did you mean 'max_pressure'"),
        ("wheel_name", {}, "'wheel_name' is nothing that plot draws"),
        ("wear_depth", {"wheel": "both"}, "wheel = 'both' is not one of right, left"),
        ("profile_z", {"distance": 1e9}, "distance = 1000000000 must be 0 to"),
        ("worn_area", {"distance": 0.0}, "distance is for wear_depth and profile_z"),
    ],
)
def test_faults_are_one_line(rig, name, options, message):
    with pytest.raises(WearsimError, match=message) as caught:
        wearsim.plot(rig, name, **options)
    assert "\n" not in str(caught.value)
