"""Tables of measured wheels: what is read, and faults with their lines."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ResultError, SceneError
from wearsim.scene import load_campaign
from wearsim.scene.inputs import inputs_of
from wearsim.scene.uncertainty import MeasuredSection
from wearsim.studies.measured import Curves, read_measured

WORKFLOWS = Path(__file__).parents[2] / "workflows"
SCENE = WORKFLOWS / "calibrate_rig.toml"
SETTINGS = MeasuredSection()
RIGHT = "measured/calibrate_rig/right_{}km.whl"


@pytest.fixture(scope="module")
def parts():
    return {"rig": load_campaign(SCENE)}


@pytest.fixture
def read(tmp_path, parts):
    def read(text, settings=SETTINGS, parts=parts):
        table = tmp_path / "table.csv"
        table.write_text(text)
        return read_measured(table, parts, settings)

    return read


def test_the_shipped_table_has_a_block_for_each_wheel(parts):
    found = read_measured(SCENE.with_suffix(".csv"), parts, SETTINGS)
    assert [(one.wheel, one.quantity) for one in found.blocks] == [
        ("right", "wear_depth"),
        ("left", "wear_depth"),
    ]
    for block in found.blocks:
        assert (1e-3 * block.distance).tolist() == [300.0, 600.0, 1000.0]
        # deeper from one measurement to the next, by much more than noise
        deepest = block.values.max(axis=1)
        assert (np.diff(deepest) > 50e-6).all()
        # behind the flange nothing wears: what is left is noise and place
        assert np.abs(block.values[:, block.y < -60e-3]).max() < 0.4e-3
    assert found.campaigns == ("rig",)
    assert len(found.files) == 8
    assert found.farthest("rig") == 1e6
    assert found.nearest("rig") == 3e5


def test_depths_are_those_of_the_worn_profile(tmp_path, read, parts):
    """A wheel worn along its normals, written without noise, has the same depth."""
    from wearsim.profile.shape import Profile, vertex_normals

    new = inputs_of(parts["rig"]).right
    ny, nz = vertex_normals(new.y, new.z)
    depth = 200e-6 * np.exp(-((new.y / 15e-3) ** 2))
    for name, d in (("new", 0.0 * depth), ("worn", depth)):
        worn = Profile(name, "wheel", new.y + ny * d, new.z + nz * d)
        rows = [
            f"{a:.7f} {b:.7f}" for a, b in zip(1e3 * worn.y, 1e3 * worn.z, strict=True)
        ]
        (tmp_path / f"{name}.txt").write_text("\n".join(rows))
    found = read(
        f"distance_km,wheel,profile\n0,right,{tmp_path}/new.txt\n"
        f"10,right,{tmp_path}/worn.txt\n"
    )
    (block,) = found.blocks
    points = block.points.astype(int)
    tread = np.abs(block.y) < 30e-3
    # the alignment holds it within 0.1 um, normals cut a chord
    np.testing.assert_allclose(block.values[0][tread], depth[points][tread], atol=1e-6)


def test_units_and_origin_of_measured_files_are_those_stated(tmp_path, read, parts):
    """A wheel in inches, 400 mm aside, is read as the new one."""
    new = inputs_of(parts["rig"]).right
    points = np.column_stack((new.y + 400e-3, new.z)) / 25.4e-3
    np.savetxt(tmp_path / "inch.csv", points, "%.9f", ",")
    rows = "".join(f"{km},right,{tmp_path}/inch.csv\n" for km in (0, 10))
    table = f"distance_km,wheel,profile\n{rows}"
    (block,) = read(table, MeasuredSection(units="in", offset_y_mm=-400.0)).blocks
    assert np.abs(block.values).max() < 1e-9
    with pytest.raises(SceneError, match=r"table.csv:2: profile = .*offset of y"):
        read(table, MeasuredSection(units="in"))


def test_gauges_and_masses_are_changes(read):
    found = read(
        "distance_km,wheel,Sd_mm,Sd_sd_mm,mass_kg,mass_sd_kg\n"
        "0,right,32.5,0.05,,\n100,right,32.1,0.05,,\n100,right,32.3,0.05,,\n"
        "0,both,,,1000,0.1\n100,both,,,999.5,0.1\n"
    )
    gauge, mass = found.blocks
    assert gauge.values[0, 0] == pytest.approx(-0.3e-3)
    # the mean of two, less the first one
    noise = gauge.covariance(np.zeros((1, 1)))[0, 0]
    assert noise == pytest.approx(0.05e-3**2 * 1.5)
    assert mass.values[0, 0] == pytest.approx(0.5)
    run = np.array([0.0, 50e3, 100e3])
    measures = {"worn_mass": np.outer([0.0, 0.1, 0.2], [1.0, 2.0])}
    measures["flange_thickness"] = np.outer([32.5e-3, 32.4e-3, 32.3e-3], [1.0, 1.0])
    curves = Curves(run, np.zeros((3, 2, 1)), measures)
    assert mass.predicted(curves)[0, 0] == pytest.approx(0.6)
    assert gauge.predicted(curves, 0.5)[0, 0] == pytest.approx(-0.1e-3)
    # a change of 0.2 mm is itself uncertain by the share of the shape
    more = gauge.covariance(np.full((1, 1), 0.2e-3))[0, 0] - noise
    assert more == pytest.approx((0.05 * 0.2e-3) ** 2)


def test_gauges_have_their_own_standard_deviations(read):
    """Each row counts by its own: a weighted mean, and its variance."""
    found = read(
        "distance_km,wheel,qR_mm,qR_sd_mm\n0,right,9.0,0.02\n100,right,9.1,0.03\n"
        "100,right,9.4,0.06\n200,right,9.5,0.5\n"
    )
    (gauge,) = found.blocks
    mean = (9.1 / 0.03**2 + 9.4 / 0.06**2) / (1.0 / 0.03**2 + 1.0 / 0.06**2)
    np.testing.assert_allclose(gauge.values[:, 0], [1e-3 * (mean - 9.0), 0.5e-3])
    first = 0.02e-3**2
    later = [1e-6 / (1.0 / 0.03**2 + 1.0 / 0.06**2), 0.5e-3**2]
    expected = np.diag(later) + first
    np.testing.assert_allclose(gauge.covariance(np.zeros((2, 1))), expected)


def test_wear_counts_from_the_first_measurement(read):
    settings = replace_settings(from_km=300.0)
    text = "distance_km,wheel,profile\n"
    text += "".join(f"{km},right,{RIGHT.format(km)}\n" for km in (300, 600, 1000))
    (block,) = read(text, settings).blocks
    assert block.start == 3e5
    run = np.linspace(0.0, 1e6, 11)
    depth = np.broadcast_to(
        1e-9 * run[:, None, None], (11, 2, 1 + int(block.points.max()))
    )
    predicted = block.predicted(Curves(run, depth, {}))
    np.testing.assert_allclose(
        predicted, [[0.3e-3], [0.7e-3]] * np.ones(block.arc.size)
    )


def replace_settings(**changes):
    return SETTINGS.model_copy(update=changes)


def test_a_first_measurement_that_is_far_less_exact_is_an_error_that_names_it(read):
    found = read(
        "distance_km,wheel,mass_kg,mass_sd_kg\n0,both,600,1\n100,both,599,1e-9\n"
        "200,both,598,1e-9\n"
    )
    with pytest.raises(ResultError, match=r"^mass_sd_kg of both wheels of the rig is"):
        found.noise(found.values)


@pytest.mark.parametrize(
    ("rows", "line", "message"),
    [
        ("0,left,none.whl\n300,left,none.whl", 2, "there is no such file"),
        (
            f"0,right,{RIGHT.format(0)}\n5000,right,{RIGHT.format(300)}",
            3,
            "beyond the campaign",
        ),
        ("-1,right,a.whl", 2, "distance_km = -1"),
        ("0,middle,a.whl", 2, "wheel"),
        ("0,right,", 2, "nothing was measured"),
        ("0,both,a.whl", 2, "wheel = both is for mass_kg"),
        (
            f"300,right,{RIGHT.format(300)}\n600,right,{RIGHT.format(600)}",
            2,
            "has no profile at 0 km",
        ),
        (f"0,right,{RIGHT.format(0)}", 2, "has no profile after 0 km"),
        (
            f"0,right,{RIGHT.format(0)}\nsoon,right,{RIGHT.format(300)}",
            3,
            "distance_km",
        ),
    ],
)
def test_faults_have_their_lines(read, rows, line, message):
    with pytest.raises(SceneError, match=message) as raised:
        read(f"distance_km,wheel,profile\n{rows}\n")
    assert raised.value.faults[0].line == line


@pytest.mark.parametrize(
    ("head", "row", "message"),
    [
        (
            "distance_m,wheel,profile",
            "0,right,a.whl",
            "distance_m.*did you mean.*distance_km",
        ),
        ("distance_km,wheel,Sd_mm", "0,right,32.5", "Sd_sd_mm, its standard deviation"),
        ("distance_km,wheel,Sd_mm,Sd_sd_mm", "0,right,32.5,0", "Sd_sd_mm = 0"),
        (
            "distance_km,wheel,Sh_mm,Sh_sd_mm",
            "0,right,0.028,0.02",
            "Sh_mm = 0.028 must be at least 20 and at most 45 mm",
        ),
        (
            "distance_km,wheel,mass_kg,mass_sd_kg",
            "0,both,400000,1",
            "mass_kg = 400000 must be at least 0.001 and at most 10000 kg",
        ),
        (
            "distance_km,wheel,profile,Sd_mm,Sd_sd_mm",
            "0,right,a.whl,32.5,0.1",
            "would count twice",
        ),
        (
            "campaign,distance_km,wheel,profile",
            "field,0,right,a.whl",
            "the scene is of kind rig",
        ),
    ],
)
def test_faults_of_columns(read, head, row, message):
    with pytest.raises(SceneError, match=message):
        read(f"{head}\n{row}\n")


def test_the_same_wear_in_several_rows_is_a_fault(read):
    """A mass of one wheel beside that of both; gauges beside profiles."""
    masses = "".join(
        f"{km},{wheel},{kg},0.01\n"
        for km, kg in ((0, 300.0), (600, 299.5))
        for wheel in ("both", "right")
    )
    with pytest.raises(SceneError, match=r"mass_kg.*both wheels.*would count twice"):
        read(f"distance_km,wheel,mass_kg,mass_sd_kg\n{masses}")
    rows = "".join(
        f"{km},right,{RIGHT.format(km)},,\n{km},right,,{32.5 - km / 1e4},0.1\n"
        for km in (0, 600)
    )
    with pytest.raises(SceneError, match=r"Sd_mm.*profile.*would count twice"):
        read(f"distance_km,wheel,profile,Sd_mm,Sd_sd_mm\n{rows}")


def test_a_measurement_before_the_first_one_is_a_fault(read):
    text = "distance_km,wheel,profile\n"
    text += "".join(f"{km},right,{RIGHT.format(km)}\n" for km in (0, 300, 600))
    with pytest.raises(
        SceneError, match=r"before the first measurement, from_km = 300"
    ) as raised:
        read(text, replace_settings(from_km=300.0))
    assert [fault.line for fault in raised.value.faults] == [2]


def test_the_profile_of_another_wheel_is_a_fault(read):
    other = "measured/wheel_worn_right.whl"
    with pytest.raises(SceneError, match="it is of another wheel") as raised:
        read(
            f"distance_km,wheel,profile\n0,right,{other}\n"
            f"300,right,{RIGHT.format(300)}\n"
        )
    assert raised.value.faults[0].line == 2


def test_repeated_measurements_are_averaged(read):
    text = "distance_km,wheel,profile\n"
    names = [RIGHT.format(km) for km in (0, 300, 600)]
    once = read(
        f"{text}0,right,{names[0]}\n300,right,{names[1]}\n300,right,{names[2]}\n"
    )
    each = [read(f"{text}0,right,{names[0]}\n300,right,{name}\n") for name in names[1:]]
    mean = 0.5 * (each[0].values + each[1].values)
    np.testing.assert_allclose(once.values, mean, atol=1e-15)
    assert once.blocks[0].counts.tolist() == [2.0]
    assert replace(once).again(once.blocks[0], 0).blocks[0].counts.tolist() == [3.0]


def test_profiles_are_laid_where_they_most_probably_were(parts):
    """A shift and a tilt of each measurement are taken out, wear is not."""
    block = read_measured(SCENE.with_suffix(".csv"), parts, SETTINGS).blocks[0]
    predicted = (
        300e-6 * np.exp(-((block.y / 15e-3) ** 2)) * np.array([[0.3], [0.6], [1.0]])
    )
    off = (
        block.modes @ np.array([[0.5, -1.0, 0.3], [1.0, 0.2, -0.5], [0.0, 0.4, 1.0]]).T
    )
    moved = replace(block, values=predicted + off.T)
    values, deviation = moved.placed(predicted)
    assert np.abs(off).max() > 80e-6
    assert np.abs(values - predicted).max() < 10e-6
    # what is left is the noise of two profiles, and the error of the shape
    assert deviation.min() == pytest.approx(np.sqrt(2.0 * 109e-12), rel=1e-3)
    assert deviation[2].max() == pytest.approx(
        np.hypot(np.sqrt(218e-12), 15e-6), rel=1e-2
    )
