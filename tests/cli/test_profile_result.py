"""`wearsim profile` on a result file: the worn wheel at a distance, measured, compared
and written.
"""

import json

import netCDF4
import numpy as np
import pytest

from wearsim.cli import main
from wearsim.profile import standard
from wearsim.profile.files import read_profile, write_profile
from wearsim.profile.measures import running_circle_level
from wearsim.results import open_results

CONVERTED = {"simpack": ".prw", "miniprof": ".whl", "two-column": ".csv"}
KEPT = (
    "flange_height",
    "flange_thickness",
    "flange_gradient",
    "hollowing",
    "rim_width",
)


@pytest.fixture(scope="module")
def result(write_campaign, tmp_path_factory):
    """States every 10 km up to 40 km, where 0.4 mm of the right and 0.36 mm of the left
    wheel are worn.
    """
    return write_campaign(tmp_path_factory.mktemp("result") / "rig.nc", "rig", 4, 1e-8)


def message(capsys, *words):
    assert main(["profile", *map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def faults(capsys, *words):
    assert main(["profile", *map(str, words)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    return captured.err.splitlines()


def stored(result, wheel, row):
    with open_results(result) as data:
        state = data.sel(wheel=wheel).isel(step=row)
        return state["profile_y"].values, state["profile_z"].values


@pytest.mark.parametrize("wheel", ["right", "left"])
@pytest.mark.parametrize("format", CONVERTED)
def test_a_written_wheel_reads_back_as_the_same_wheel(
    format, wheel, result, tmp_path, capsys
):
    """The decimals of the file stand for the stored bits, so all measures are the
    same.
    """
    target = tmp_path / f"worn{CONVERTED[format]}"
    worn = message(
        capsys,
        result,
        "--at-km",
        20,
        "--wheel",
        wheel,
        "--convert",
        format,
        "--out",
        target,
    )
    again = message(capsys, target)
    assert {name: again["measures"][name] for name in KEPT} == {
        name: worn["measures"][name] for name in KEPT
    }
    assert (
        again["running"]["equivalent_conicity"]
        == worn["running"]["equivalent_conicity"]
    )
    profile = read_profile(target, "wheel").profile
    np.testing.assert_array_equal((profile.y, profile.z), stored(result, wheel, 2))


def test_the_last_state_and_the_right_wheel_without_flags(result, capsys):
    value = message(capsys, result)
    assert (
        value["profile"]["notes"][0] == "right wheel after 40 km: the last stored state"
    )
    level = running_circle_level(*stored(result, "right", 4))
    assert level == pytest.approx(
        -0.4e-3, rel=0.01
    )  # the law's depth, along a normal 1:40 off the radius
    assert value["measures"]["wheel_diameter"] == pytest.approx(
        2.0 * (0.46 + level), rel=1e-15
    )
    assert value["measures"]["back_to_back"] == pytest.approx(1.36)


def test_between_two_states_points_are_interpolated(result, tmp_path, capsys):
    target = tmp_path / "worn.csv"
    value = message(
        capsys, result, "--at-km", 12.5, "--convert", "two-column", "--out", target
    )
    assert value["profile"]["notes"][0] == (
        "right wheel after 12.5 km: interpolated between the stored states at 10 km "
        "and 20 km"
    )
    before, after = (
        np.array(stored(result, "right", 1)),
        np.array(stored(result, "right", 2)),
    )
    profile = read_profile(target, "wheel").profile
    np.testing.assert_allclose(
        (profile.y, profile.z), 0.75 * before + 0.25 * after, atol=1e-15
    )


def test_of_two_states_at_one_distance_the_later_one_is_taken(
    write_campaign, tmp_path, capsys
):
    """As a reprofiling leaves them: points run to the earlier state, and on from the
    later one.
    """
    path = write_campaign(tmp_path / "rig.nc", "rig", 4, 1e-8)
    with netCDF4.Dataset(path, "a") as file:
        file["distance"][3] = file["distance"][2]
    at, before = (
        message(capsys, path, "--at-km", 20),
        message(capsys, path, "--at-km", 19.999999),
    )
    assert (
        at["profile"]["notes"][0]
        == "right wheel after 20 km: the stored state after the reprofiling there"
    )
    levels = [
        2.0 * (0.46 + running_circle_level(*stored(path, "right", row)))
        for row in (2, 3)
    ]
    assert at["measures"]["wheel_diameter"] == pytest.approx(levels[1], rel=1e-15)
    assert before["measures"]["wheel_diameter"] == pytest.approx(levels[0], abs=1e-10)


def test_the_axle_and_the_wear_since_new(result, tmp_path, capsys):
    """A standard shape lies in the axes of the result, so nothing is moved; its
    diameter is not known.
    """
    new = tmp_path / "new.csv"
    message(capsys, result, "--at-km", 0, "--convert", "two-column", "--out", new)
    value = message(
        capsys,
        result,
        "--left",
        result,
        "--at-km",
        40,
        "--against",
        new,
        "--align",
        "none",
    )
    with open_results(result) as data:
        area = float(data["worn_area"].sel(wheel="right")[-1])
    assert value["against"]["worn_area"] == pytest.approx(
        area, rel=1e-3
    )  # normals every 0.1 mm
    assert (
        value["measures"]["wheel_diameter"] < value["left_measures"]["wheel_diameter"]
    )
    standard_one = message(capsys, result, "--against", "S1002")["against"]
    assert standard_one["alignment"]["rule"] == "none"
    assert standard_one["measures"].get("wheel_diameter") is None


def test_a_measured_wheel_against_a_computed_one(result, tmp_path, capsys):
    measured = tmp_path / "measured.csv"
    write_profile(standard.wheel("S1002"), measured)
    value = message(
        capsys,
        measured,
        "--against",
        result,
        "--wheel",
        "left",
        "--at-km",
        10,
        "--align",
        "none",
    )
    assert value["against"]["profile"]["name"] == "rig_left_10km"


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["--at-km", "41"], "--at-km = 41 must be 0 to 40 km, the distance run in {}"),
        (["--at-km", "-1"], "--at-km = -1 must be 0 to 40 km, the distance run in {}"),
        (
            ["--at-km", "far"],
            "--at-km = far must be 0 to 40 km, the distance run in {}",
        ),
        (
            ["--wheel", "outer"],
            "--wheel = outer must be right or left of a result file",
        ),
        (
            ["--wheel", "left", "--left", "P8"],
            "--wheel left and --left exclude each other; give one of them",
        ),
        (
            ["--kind", "rail"],
            "--kind rail: {} is a result file, its profiles are wheels",
        ),
        (
            ["--units", "mm"],
            (
                "--units: is a statement on a file of points, but none is given; "
                "leave it out"
            ),
        ),
    ],
)
def test_one_line_for_each_fault(words, fault, result, capsys):
    assert faults(capsys, result, *words) == [fault.format(result)]


def test_files_without_wheels(tmp_path, capsys):
    other = tmp_path / "translation.nc"
    with netCDF4.Dataset(other, "w") as file:
        file.createDimension("progress", 1)
    for words in ((other,), ("S1002", "--against", other)):
        (line,) = faults(capsys, *words)
        assert f"{other} is not a result file of a wearsim campaign" in line
    missing = tmp_path / "gone.nc"
    (line,) = faults(capsys, missing)
    assert line == (
        f"{missing} does not exist; `wearsim run SCENE --out DIR` writes result files"
    )
    assert faults(capsys, "S1002", "--at-km", "3") == [
        "--at-km picks a state of a result file (.nc), none is given; leave it out"
    ]
