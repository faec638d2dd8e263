"""Records in scenes: what they become, and what is refused."""

import html
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.run import run_scene
from wearsim.contact.solve import solve
from wearsim.errors import SceneError
from wearsim.operation.resultants import resultants
from wearsim.report import plates
from wearsim.report.html import write_report
from wearsim.results import open_results
from wearsim.scene import build, load_scene, prepare
from wearsim.scene.inputs import inputs_of
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


def test_points_of_a_record_hold_the_curvature_of_the_track_without_the_yaw_rate(
    folder,
):
    """On straight track samples 0.5 m apart, whose wheelset turns to and fro."""
    wave = 2e-3 * np.sin(np.pi / 9.0 * np.arange(200))
    lines = "".join(f"{0.5 * k},20,{1e3 * y},{1e3 * y}\n" for k, y in enumerate(wave))
    Path("run.csv").write_text(f"s,v,y,psi\n{lines}")
    Path("scene.toml").write_text(FIELD.replace('time_s = "t"', 'distance_m = "s"'))
    points = build(load_scene("scene.toml")).points
    assert np.abs(points.conditions.track_curvature).max() > 1e-4
    assert not points.curvature.any()


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
        ('yaw_positive = "right"\n', "", "the sign convention is stated, not guessed"),
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
        (
            'shift_positive = "left"\n',
            "",
            'shift_mm needs shift_positive = "right" or "left" in [recorded]',
        ),
        (
            'yaw_mrad = "psi"',
            'yaw_mrad = "psi"\nlateral_force_left_N = "y"',
            'lateral_force_left_N needs lateral_force_positive = "right" or "left"',
        ),
        (
            'yaw_mrad = "psi"',
            'yaw_mrad = "psi"\nlateral_force_left_N = "y"',
            "stand in place of the shift",
        ),
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
        (
            RUN.replace("3,20", "3,fast"),
            'csv:5: column "v": speed is not a number',
        ),
        (RUN.replace("3,20", "3,900"), 'column "v": speed = 3240 must be'),
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


EXPORTS = Path(__file__).parents[1] / "data/exports"
BODIES = FIELD[: FIELD.index("[recorded]")]
EXPORTED = """[recorded]
file = "multibody.csv"
shift_positive = "right"
yaw_positive = "right"
friction = 0.35
speed_km_h = 60
[recorded.columns]
time_s = "time"
shift_m = "$WS1.y"
yaw_rad = "$WS1.yaw"
wheel_load_right_N = "$WS1.Q_r"
wheel_load_left_N = "$WS1.Q_l"
[campaign]
distance_km = 10
"""
MEASURED = """[recorded]
file = "instrumented_gbk.csv"
lateral_force_positive = "outwards"
friction = 0.35
[recorded.columns]
distance_km = "里程"
speed_km_h = "速度"
wheel_load_right_kN = "轮轨垂向力2"
lateral_force_right_kN = "轮轨横向力2"
wheel_load_left_kN = "轮轨垂向力1"
lateral_force_left_kN = "轮轨横向力1"
[campaign]
distance_km = 10
"""


def with_export(name, text):
    Path(name).write_bytes((EXPORTS / name).read_bytes())
    Path("scene.toml").write_text(BODIES + text)
    return load_scene("scene.toml")


def test_an_export_of_a_multibody_program_is_read_as_the_same_record_in_plain_csv(
    folder, changed
):
    scene = with_export("multibody.csv", EXPORTED)
    (note,) = map(str, warnings_of(scene))
    assert "read as columns separated by semicolons, decimal commas, units in" in note
    lines = Path("multibody.csv").read_text().splitlines()
    plain = [line.replace(",", ".").replace(";", ",") for line in lines]
    Path("plain.csv").write_text("\n".join([plain[0], *plain[2:]]))
    Path("plain.toml").write_text(changed(BODIES + EXPORTED, ("multibody", "plain")))
    again = load_scene("plain.toml")
    assert warnings_of(again) == ()
    for name, values in inputs_of(scene).samples.values.items():
        np.testing.assert_array_equal(values, inputs_of(again).samples.values[name])


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            'shift_m = "$WS1.y"',
            'shift_mm = "$WS1.y"',
            'toml:16: shift_mm = "$WS1.y": multibody.csv states the unit m; name',
        ),
        (
            "friction",
            'load_sign = "negative"\nfriction',
            'by load_sign = "negative"; write load_sign = "positive"',
        ),
    ],
)
def test_units_and_signs_of_an_export_are_held_against_the_keys(
    folder, changed, old, new, fault
):
    with pytest.raises(SceneError) as caught:
        with_export("multibody.csv", changed(EXPORTED, (old, new)))
    assert fault in str(caught.value)


def test_forces_on_the_wheel_with_z_down_are_negative(folder, changed):
    text = changed(EXPORTED, ("friction", 'load_sign = "negative"\nfriction'))
    lines = (EXPORTS / "multibody.csv").read_text().splitlines()
    rows = [line.rsplit(";", 2) for line in lines[2:]]
    signed = [";".join((head, f"-{right}", f"-{left}")) for head, right, left in rows]
    Path("multibody.csv").write_text("\n".join(lines[:2] + signed))
    Path("scene.toml").write_text(BODIES + text)
    load = inputs_of(load_scene("scene.toml")).samples.values["wheel_load_left"]
    assert load[0] == 70000.0
    Path("scene.toml").write_text(BODIES + EXPORTED)
    with pytest.raises(SceneError, match='write load_sign = "negative" in'):
        load_scene("scene.toml")


def test_an_instrumented_wheelset_runs_where_its_lateral_force_is_balanced(folder):
    """H = Y1 - Y2 with both counted outwards, wheel 1 on the left: 3.524 kN to the
    left at first.
    """
    scene = with_export("instrumented_gbk.csv", MEASURED)
    force = inputs_of(scene).samples.values["lateral_force"]
    assert force[0] == pytest.approx(4000.0 - 7524.0)
    text = " ".join(map(str, warnings_of(scene)))
    assert "read as text in GBK" in text
    assert "the shift follows from the lateral force of both wheels" in text
    prepared = prepare(scene)
    points, setup = prepared.points, build(scene, prepared)
    guiding = points.controlled.lateral_force
    assert guiding.min() == pytest.approx(force.min(), rel=0.1)
    problem = setup.wheelset, setup.counterface, setup.models
    forces = resultants(solve(points.conditions, *problem), guiding.size)
    np.testing.assert_allclose(-forces.lateral.sum(axis=1), guiding, atol=5.0)
