"""Records in scenes: what they become, and what is refused."""

import html
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.run import run_scene
from wearsim.errors import SceneError
from wearsim.report import plates
from wearsim.report.html import write_report
from wearsim.results import open_results
from wearsim.scene import build, load_scene, prepare
from wearsim.scene.setup import warnings_of

FIELD = """[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
[recorded]
file = "run.csv"
shift_positive = "left"
yaw_positive = "right"
load_kN = 80
friction = 0.35
environment = 0.2
[recorded.columns]
time_s = "t"
speed_m_s = "v"
shift_mm = "y"
yaw_mrad = "psi"
[campaign]
distance_km = 10
"""
RUN = "t,v,y,psi\n" + "".join(
    f"{k},20,{-3 if k % 3 else 9},{1 if k % 2 else 0}\n" for k in range(12)
)


@pytest.fixture
def run(folder):
    Path("run.csv").write_text(RUN)


def test_a_record_becomes_points_with_the_stated_signs_and_constants(run):
    Path("scene.toml").write_text(FIELD)
    scene = load_scene("scene.toml")
    setup = build(scene)
    shift = setup.points.conditions.shift
    assert shift.max() == pytest.approx(3e-3)  # left is positive in the file
    assert -6.7e-3 < shift.min() < -6.5e-3  # 9 mm lie beyond the flange
    assert setup.points.conditions.free_roll
    np.testing.assert_array_equal(setup.points.environment, 0.2)
    np.testing.assert_allclose(setup.points.weight.sum(), 1.0)
    assert setup.reduction.samples == 12
    text = " ".join(map(str, warnings_of(scene)))
    assert "33.3 % of the samples lie beyond the flange clearance" in text
    assert any("recorded.file run.csv" in name for name, _ in setup.input_hashes)


def test_a_scene_stays_as_it_was_read_whatever_is_solved_from_it(run):
    Path("scene.toml").write_text(FIELD)
    scene = load_scene("scene.toml")
    before = scene.model_dump(), dict(scene.__pydantic_private__)
    setup = build(scene)
    assert (scene.model_dump(), dict(scene.__pydantic_private__)) == before
    prepared = prepare(scene)
    assert build(scene, prepared).points is prepared.points
    np.testing.assert_array_equal(setup.points.weight, prepared.points.weight)
    assert prepared.places == (("recorded", "file"),) * len(prepared.points.label)


def test_the_binning_error_is_taken_again_on_the_worn_wheels(run, changed):
    Path("run.csv").write_text(
        "t,v,y,psi\n" + "".join(f"{k},20,{0.4 * k - 2:g},0\n" for k in range(12))
    )
    loose = ("[recorded]", "[recorded]\nbinning_tolerance = 0.5")
    contact = '[contact]\nmodel = "fast"\nstrips = 10\n'
    Path("scene.toml").write_text(
        changed(FIELD, ("[campaign]", f"{contact}[campaign]"), loose)
    )
    run_scene("scene.toml", "out")
    with open_results("out/field.nc") as result:
        new, worn = result.attrs["binning_error"], result.attrs["binning_error_worn"]
        for end, error in (
            ("", new),
            ("_worn", worn),
        ):  # the increments that are drawn are those of the error
            samples, points = (
                result[f"binning_depth_{name}{end}"].values
                for name in ("samples", "points")
            )
            assert samples.shape == (2, result.sizes["binning_point"])
            assert np.abs(samples - points).max() / samples.max() == pytest.approx(
                error, rel=1e-12
            )
        figure = plates.binning([result])
        titles = [ax.get_title("left").partition(", ")[2] for ax in figure.axes]
        assert titles == [
            "new right wheel",
            "new left wheel",
            "worn right wheel",
            "worn left wheel",
        ]
        shares = [ax.texts[0].get_text() for ax in figure.axes]
        assert f"{100.0 * worn:.2g} % of the largest depth" in shares[2:]
    assert 1e-3 < new <= 0.5
    assert 1e-3 < worn < 0.5
    assert "12 samples" in html.unescape(write_report("out").read_text())


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            'shift_mm = "y"',
            'shift_inch = "y"',
            "unknown key shift_inch in [recorded.columns]; did you mean",
        ),
        ('shift_mm = "y"', 'shift_mm = "z"', '"z" is no column of run.csv'),
        ('time_s = "t"\n', "", "no distance: name a column for time_s or distance_m"),
        ('yaw_positive = "right"\n', "", "signs are not guessed"),
        ("friction = 0.35\n", "", "no column for friction"),
        ("load_kN = 80\n", "", "no column for wheel_load_right, wheel_load_left"),
        ('shift_mm = "y"\n', "", "no column for shift"),
        (
            'shift_mm = "y"',
            'shift_mm = "y"\nshift_m = "psi"',
            "are one quantity; delete one of them",
        ),
        (
            '"run.csv"',
            '"walk.csv"',
            "does not exist as given or next to the scene file",
        ),
        ('shift_positive = "left"\n', "", "shift_positive is missing in [recorded]"),
        (
            "[recorded]",
            '[[operation.class]]\nname = "a"\nshift_mean_mm = 0\nshift_std_mm = 0\n'
            "load_kN = 80\n"
            "speed_km_h = 72\nfriction = 0.3\nshare = 1\n[recorded]",
            "exclude each other",
        ),
    ],
)
def test_what_a_record_lacks_is_told_with_its_line(
    run, changed, faults_of, old, new, fault
):
    faults = faults_of(changed(FIELD, (old, new)))
    assert any(fault in line for line in faults), faults
    assert all(line.startswith("scene.toml:") for line in faults)


def test_standstill_does_not_count_and_curves_have_a_range(run, changed, faults_of):
    text = changed(FIELD, ('yaw_mrad = "psi"', 'track_curvature_per_m = "psi"'))
    text = changed(text, ('yaw_positive = "right"', 'curve_positive = "right"'))
    Path("scene.toml").write_text(FIELD)
    Path("run.csv").write_text(RUN.replace("3,20", "3,0"))
    assert any(
        "stand still" in str(warning)
        for warning in warnings_of(load_scene("scene.toml"))
    )
    assert any("track_curvature = 1 must be" in line for line in faults_of(text))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (RUN.replace("3,20", "2,20"), "the time does not rise"),
        (RUN.replace("3,20", "3,fast"), "row 4: speed is not a number"),
        (RUN.replace("3,20", "3,900"), "speed = 3240 must be"),
        (RUN.replace("3,20,", "3,20"), "run.csv:5: 3 cells, the header has 4"),
        ("t,v,y,psi\n", "holds no samples"),
    ],
)
def test_a_record_that_cannot_be_read_is_told(run, text, fault):
    Path("scene.toml").write_text(FIELD)
    Path("run.csv").write_text(text)
    with pytest.raises(SceneError, match=fault):
        load_scene("scene.toml")


def test_a_field_without_classes_and_record_is_refused(run, faults_of):
    start, end = FIELD.index("[recorded]"), FIELD.index("[campaign]")
    (fault,) = faults_of(FIELD[:start] + FIELD[end:])
    assert (
        "no operation: write [[operation.class]], [vehicle] with its track, or" in fault
    )
