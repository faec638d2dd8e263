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
    np.testing.assert_allclose(
        worn.get_ydata(), 1e3 * state["profile_z"], rtol=1e-9, atol=1e-9
    )


def test_measures_are_drawn_over_the_distance_patches_over_the_shift_into_given_axes(
    run_directory, rig
):
    figure, (one, other) = plt.subplots(2)
    assert wearsim.plot(run_directory / "rig.nc", "worn_area", one) is one
    for line, wheel in zip(one.lines, ("right", "left"), strict=True):
        np.testing.assert_allclose(
            line.get_ydata(), 1e6 * rig["worn_area"].sel(wheel=wheel), rtol=1e-12
        )
    assert wearsim.plot(rig, "max_pressure", other) is other
    drawn = np.sort(np.concatenate([line.get_ydata() for line in other.lines]))
    pressure = rig["max_pressure"].values[-1]
    np.testing.assert_allclose(
        drawn, 1e-6 * np.sort(pressure[np.isfinite(pressure)]), rtol=1e-12
    )
    plt.close(figure)


def test_patches_lie_on_the_profile_with_their_widths(rig):
    for wheel, side in (("right", 0), ("left", 1)):
        profile, *patches = wearsim.plot(rig, "patches", wheel=wheel).lines
        state = rig.isel(step=-1)
        own = (state["side"].values == side) & np.isfinite(state["wheel_y"].values)
        assert len(patches) == own.sum() > 0
        for line, y, width in zip(
            patches,
            state["wheel_y"].values[own],
            state["width"].values[own],
            strict=True,
        ):
            along, height = line.get_xdata(), line.get_ydata()
            assert along[0] < 1e3 * y < along[-1]
            length = np.hypot(np.diff(along), np.diff(height)).sum()
            assert length == pytest.approx(
                1e3 * width, rel=1e-3
            )  # of the arc, by its chords
            points = np.stack([profile.get_xdata(), profile.get_ydata()], axis=1)
            inner = np.stack([along, height], axis=1)[1:-1]
            assert (
                max(
                    (np.hypot(*(points - point).T).min() for point in inner),
                    default=0.0,
                )
                < 1e-9
            )


def test_profiles_before_and_after_are_drawn_over_each_other(rig):
    new, worn = wearsim.standard_profile("S1002"), wearsim.worn_profile(rig, "left")
    before, after = wearsim.plot((new, worn)).lines
    np.testing.assert_array_equal(before.get_xdata(), 1e3 * new.y)
    np.testing.assert_array_equal(after.get_ydata(), 1e3 * worn.z)
    assert [line.get_label() for line in (before, after)] == [new.name, worn.name]
    (alone,) = wearsim.plot(wearsim.standard_profile("60E1")).lines
    assert alone.get_label() == "60E1"


@pytest.fixture(scope="module")
def rate():
    bodies = wearsim.wheelset("S1002"), wearsim.rails("60E1", inclination=1 / 40)
    points = wearsim.ContactConditions.of(1e-3 * np.arange(-4, 5))
    return wearsim.wear_rate(
        bodies, points, models=wearsim.ContactModels.of("fast", strips=8, cells=8)
    )


def test_wear_rates_are_drawn_along_the_profile_and_over_the_shift(rate):
    lines = wearsim.plot(rate, wheel="left").lines
    assert len(lines) == rate.sizes["operating_point"]
    named = [line for line in lines if line.get_label().isdigit()]
    assert len(named) == 6
    for line in named:
        depth = (
            rate["wear_depth_rate"]
            .isel(operating_point=int(line.get_label()))
            .sel(wheel="left")
        )
        np.testing.assert_allclose(
            line.get_ydata(), 1e12 * depth.sum("regime"), rtol=1e-12
        )
    work = wearsim.plot(rate, "friction_work")
    assert "[" in work.get_ylabel()
    figure, ax = plt.subplots()
    assert wearsim.plot(rate, "power", ax) is ax
    for line, wheel in zip(ax.lines, ("right", "left"), strict=True):
        np.testing.assert_allclose(
            line.get_ydata(), rate["power"].sel(wheel=wheel), rtol=1e-12
        )
        np.testing.assert_allclose(line.get_xdata(), 1e3 * rate["shift"], atol=1e-12)
    plt.close(figure)


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (
            lambda rate: rate,
            {"name": "powr"},
            "'powr' is nothing that plot draws of wear rates; did you mean",
        ),
        (
            lambda rate: rate,
            {"distance": 1.0},
            "distance is for results; leave it out for wear rates",
        ),
        (
            lambda rate: 3,
            {},
            (
                "3 is nothing that plot draws; give a result, wear rates, or profiles "
                "of one"
            ),
        ),
        (lambda rate: [], {}, "is nothing that plot draws"),
        (
            lambda rate: [wearsim.standard_profile(name) for name in ("S1002", "60E1")],
            {},
            "give a result, wear rates, or profiles of one kind",
        ),
        (
            lambda rate: wearsim.standard_profile("S1002"),
            {"name": "wear_depth"},
            "name and distance are for results; leave them out for profiles",
        ),
    ],
)
def test_faults_of_what_is_no_result_are_one_line(rate, make, options, message):
    with pytest.raises(WearsimError, match=message) as caught:
        wearsim.plot(make(rate), **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        (
            "max_presure",
            {},
            "'max_presure' is nothing that plot draws .* did you mean 'max_pressure'",
        ),
        ("wheel_name", {}, "'wheel_name' is nothing that plot draws"),
        ("wear_depth", {"wheel": "both"}, "wheel = 'both' is not one of right, left"),
        ("profile_z", {"distance": 1e9}, "distance = 1000000000 must be 0 to"),
        (
            "worn_area",
            {"distance": 0.0},
            "distance is for wear_depth, profile_z and patches",
        ),
    ],
)
def test_faults_are_one_line(rig, name, options, message):
    with pytest.raises(WearsimError, match=message) as caught:
        wearsim.plot(rig, name, **options)
    assert "\n" not in str(caught.value)
