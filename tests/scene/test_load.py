"""Scene files: every fault with its line, all at once; and what is built from a valid one."""

import json
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import SceneError
from wearsim.profile import standard
from wearsim.profile.files import write_two_column
from wearsim.scene import (
    CompareScene,
    FieldScene,
    RigScene,
    build,
    files_to_copy,
    load_scene,
    scene_schema,
)

RIG = """\
[scene]
kind = "rig"
title = "a rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
roller_radius_mm = 1000
[[operation.block]]
name = "left"
shift_mm = -3
yaw_mrad = 2
roll_mrad = 0.5
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 1
[[operation.block]]
name = "right"
shift_mm = 4
load_kN = 90
speed_km_h = 36
friction = 0.3
distance_km = 3
environment = 0.5
[operation.monitor]
shifts_mm = [-2, 0, 2]
load_kN = 80
speed_km_h = 72
friction = 0.35
[campaign]
distance_km = 100
"""

FIELD = """\
[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
[[operation.class]]
name = "tangent"
shift_mean_mm = 0
shift_std_mm = 2.5
load_kN = 80
speed_km_h = 72
friction = 0.35
share = 0.75
environment = 0.1
[[operation.class]]
name = "curve"
curve_radius_m = -500
shift_mean_mm = 3
shift_std_mm = 0
load_kN = 80
speed_km_h = 72
friction = 0.35
share = 0.25
[campaign]
distance_km = 1000
max_step_km = 20
"""

COMPARE = """\
[scene]
kind = "compare"
[compare]
rig = "rig.toml"
field = "field.toml"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Working directory with a scene of each kind."""
    (tmp_path / "rig.toml").write_text(RIG)
    (tmp_path / "field.toml").write_text(FIELD)
    (tmp_path / "compare.toml").write_text(COMPARE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def changed(text, *pairs):
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def faults_of(text, name="scene.toml"):
    Path(name).write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(name)
    assert caught.value.exit_code == 2
    lines = str(caught.value).splitlines()
    assert len(lines) == len(caught.value.faults)
    return lines


def line_with(text, part):
    return text[: text.index(part)].count("\n") + 1


@pytest.mark.parametrize(
    ("text", "old", "new", "told"),
    [
        (
            RIG,
            "load_kN = 80",
            "load_kN = 0",
            "load_kN = 0 must be above 0 and at most 250 kN; give the vertical",
        ),
        (RIG, "load_kN = 80", "load_kN = -80", "load_kN = -80 must be above 0"),
        (RIG, "load_kN = 80", 'load_kN = "80"', 'load_kN = "80" must be a number'),
        (RIG, "load_kN = 80", "load_kN = nan", "load_kN = nan must be a finite number"),
        (RIG, "load_kN = 80", "load_kN = inf", "load_kN = inf must be"),
        (RIG, "load_kN = 80", "load_kN = true", "load_kN = true must be a number"),
        (RIG, "load_kN = 80", f"load_kN = 1{'0' * 400}", "must be"),
        (
            RIG,
            "load_kN = 80",
            "load_kn = 80",
            "unknown key load_kn in [[operation.block]]; did you mean load_kN?",
        ),
        (RIG, "friction = 0.35", "friction = 2", "friction = 2 must be at least 0 and at most 1"),
        (RIG, "yaw_mrad = 2", "yaw_mrad = 101", "yaw_mrad = 101 must be at least -100 and at most 100 mrad"),
        (RIG, "yaw_mrad = 2", "yaw_mrad = -101", "yaw_mrad = -101 must be"),
        (RIG, "shift_mm = -3", "shift_mm = -21", "shift_mm = -21 must be at least -20"),
        (RIG, "speed_km_h = 72", "speed_km_h = 401", "speed_km_h = 401 must be above 0 and at most 400 km/h"),
        (RIG, "[-2, 0, 2]", "[-2, 0, 21]", "shifts_mm[2] = 21 must be at least -20 and at most 20 mm"),
        (RIG, "[-2, 0, 2]", "2", "shifts_mm = 2 must be a list"),
        (RIG, "[-2, 0, 2]", "[]", "shifts_mm has 0 entries, needs at least 1"),
        (RIG, 'kind = "rig"', 'kind = "rigg"', 'kind = "rigg" is not allowed; did you mean "rig"?'),
        (RIG, '"1:40"', '"1/40"', 'inclination = "1/40" must be "1:10" to "1:100", or "none"'),
        (RIG, '"a rig"', '"a\\u0000rig"', "must be one line of printable text"),
        (RIG, 'name = "left"', 'name = ""', "name is empty; give a name"),
        (FIELD, "curve_radius_m = -500", "curve_radius_m = 0", "must be between 50 and 100000 m"),
        (FIELD, "share = 0.75", "positions = 9", "positions = 9 must be at least 10 and at most 200"),
        (FIELD, "share = 0.75", "positions = 15.0", "positions = 15.0 must be a whole number"),
        (FIELD, "gauge_mm = 1435", "roller_radius_mm = 1000", "a rail has no radius"),
        (FIELD, "max_step_km = 20", "stability = 2", "stability = 2 must be above 0 and below 2"),
        (
            FIELD,
            "max_step_km = 20",
            "gauge_mm = 1",
            "unknown key gauge_mm in [campaign]; it belongs to [counterface]",
        ),
        (FIELD, "max_step_km = 20", 'integrator = "rk4"', "is not allowed; known: heun, euler"),
    ],
)
def test_a_bad_value_is_one_fault_with_its_line(folder, text, old, new, told):
    found = [fault for fault in faults_of(changed(text, (old, new))) if told in fault]
    assert len(found) == 1
    assert found[0].startswith(f"scene.toml:{line_with(text, old)}: ")


@pytest.mark.parametrize(
    ("key", "told"),
    [
        (
            "distance_km = 100",
            "key distance_km is missing in [campaign]; give the distance of the campaign, above 0",
        ),
        ("roller_radius_mm = 1000", "key roller_radius_mm is missing in [counterface]; give the radius"),
        ("shift_mm = 4", "key shift_mm is missing in [[operation.block]]; give the lateral shift"),
    ],
)
def test_a_missing_key_is_told_at_its_table(folder, key, told):
    (fault,) = faults_of(changed(RIG, (key, "")))
    assert told in fault
    table = RIG[: RIG.index(key)].rindex("\n[") + 1
    assert fault.startswith(f"scene.toml:{RIG[:table].count(chr(10)) + 1}: ")


def test_all_faults_of_a_file_are_told_at_once_in_the_order_of_the_file(folder):
    text = changed(
        RIG,
        ("roller_radius_mm = 1000", "roller_radius_mm = 0"),
        ("load_kN = 80", "load_kN = 0"),
        ("friction = 0.3\n", "friction = 2\n"),
        ("distance_km = 100", "distnce_km = 100"),
    )
    found = faults_of(text)
    assert [fault.split(":")[1] for fault in found] == ["9", "15", "24", "32", "33"]
    assert "did you mean distance_km?" in found[-1]


@pytest.mark.parametrize("name", ["normal", "tangential"])
def test_an_unknown_contact_model_is_told_with_what_there_is(folder, name):
    (fault,) = faults_of(RIG + f'[contact]\n{name} = "fastsimm"\n')
    assert fault.startswith(f'scene.toml:{RIG.count(chr(10)) + 2}: {name} = "fastsimm" is not known; ')
    assert ("fastsim" if name == "tangential" else "kik_piotrowski") in fault


@pytest.mark.parametrize("name", ["law", "coefficients"])
def test_an_unknown_wear_law_or_coefficient_set_is_told_with_the_nearest(folder, name):
    value = {"law": "usdf", "coefficients": "lewis_dwyer_2004"}[name]
    meant = {"law": "usfd", "coefficients": "lewis_dwyer_joyce_2004"}[name]
    (fault,) = faults_of(RIG + f'[wear]\n{name} = "{value}"\n')
    assert f'{name} = "{value}" is not known; did you mean "{meant}"?' in fault


def test_missing_and_unknown_sections_are_told(folder):
    found = faults_of('[scene]\nkind = "rig"\n[wheelst]\nprofile = "S1002"\n')
    assert "scene.toml:3: unknown section [wheelst]; did you mean wheelset?" in found
    for name in ("wheelset", "counterface", "operation", "campaign"):
        assert any(f"[{name}] is missing" in fault for fault in found)


@pytest.mark.parametrize("text", ["", "x = 1\n", "[scene]\n", "scene = 3\n", "[[scene]]\nkind = 'rig'\n"])
def test_a_file_without_a_kind_is_one_fault(folder, text):
    (fault,) = faults_of(text)
    assert fault.startswith("scene.toml:1: ")
    assert "scene" in fault


def test_faults_in_a_list_of_tables_are_not_followed_by_one_on_its_length(folder):
    text = RIG.replace(
        "load_kN = 80\nspeed_km_h = 72\nfriction = 0.35\ndist",
        "load_kN = 0\nspeed_km_h = 72\nfriction = 0.35\ndist",
    )
    (fault,) = faults_of(text)
    assert "load_kN = 0" in fault


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"[scene\n", "scene.toml:1: not valid TOML"),
        (b"[scene]\nkind = 'rig'\nkind = 'rig'\n", "scene.toml:3: not valid TOML"),
        (b"\xff\xfe[\x00s", "scene.toml:1: not UTF-8 text"),
        (b"a = " + b"[" * 20000, "nested too deeply"),
        (b"a = " + b"1" * 5000, "not valid TOML"),
        (b"#" * 2_000_001, "larger than 2 MB"),
    ],
)
def test_a_file_that_is_no_toml_is_one_fault(folder, content, told):
    Path("scene.toml").write_bytes(content)
    with pytest.raises(SceneError) as caught:
        load_scene("scene.toml")
    assert len(str(caught.value).splitlines()) == 1
    assert told in str(caught.value)


def test_a_byte_order_mark_is_no_fault(folder):
    Path("scene.toml").write_bytes(b"\xef\xbb\xbf" + RIG.encode())
    assert isinstance(load_scene("scene.toml"), RigScene)


@pytest.mark.parametrize("name", ["nowhere.toml", ".", "nowhere\x00.toml", "x" * 5000])
def test_a_scene_file_that_is_not_there_is_told_with_the_shipped_ones(folder, name):
    with pytest.raises(SceneError, match=r"rig_vs_field\.toml"):
        load_scene(name)


@pytest.mark.parametrize(
    ("text", "old", "new", "told"),
    [
        (RIG, '"S1002"', '"S1003"', "neither a file nor a shipped wheel profile"),
        (RIG, '"60E1"', '"S1002"', "'S1002' is a wheel profile"),
        (
            RIG,
            '"60E1"',
            '"rail.csv"',
            "there is no such file as given, beside the scene or among the shipped",
        ),
        (
            RIG,
            "roller_radius_mm = 1000",
            "roller_radius_mm = 10",
            "roller_radius_mm = 10 must be at least 50 mm",
        ),
        (FIELD, "share = 0.75", "share = 0.8", "0.8 + 0.25, must sum to 1, not 1.05"),
        (FIELD, "shift_std_mm = 2.5", "shift_std_mm = 9", "reaches shifts of 27 mm"),
        (FIELD, "gauge_mm = 1435", "gauge_mm = 1424", "gauge_mm = 1424 must be above 1425 mm"),
        (
            FIELD,
            "max_step_km = 20",
            "smoothing_wavelength_mm = 0.4",
            "at least twice point_spacing_mm = 0.25",
        ),
    ],
)
def test_files_and_cross_checks_are_told_with_their_line(folder, text, old, new, told):
    (fault,) = faults_of(changed(text, (old, new)))
    assert fault.startswith(f"scene.toml:{line_with(text, old)}: ")
    assert told in fault


def test_all_faults_of_the_last_stage_are_told_at_once(folder):
    found = faults_of(changed(RIG, ('"S1002"', '"S1003"'), ('"60E1"', '"rail.csv"'), ("= 1000", "= 10")))
    assert [fault.split(":")[1] for fault in found] == ["5", "7", "9"]


def test_a_wheel_that_does_not_touch_the_rail_is_told_at_its_shift(folder):
    text = changed(FIELD, ("gauge_mm = 1435", "gauge_mm = 1700"))
    (fault,) = faults_of(text)
    assert fault.startswith(f"scene.toml:{line_with(text, 'shift_mean_mm')}: ")
    assert "does not touch" in fault


def test_faults_of_a_profile_file_name_both_files_and_lines(folder):
    rows = [f"{0.5 * index},{0.01 * index}" for index in range(30)]
    rows[11] = "nan,1"
    rows[20] = "5,abc"
    Path("wheel.csv").write_text("\n".join(rows))
    found = faults_of(changed(RIG, ('"S1002"', '"wheel.csv"')))
    assert len(found) == 2
    assert all(fault.startswith('scene.toml:5: profile = "wheel.csv": wheel.csv:') for fault in found)
    assert "wheel.csv:12:" in found[0]
    assert "wheel.csv:21:" in found[1]


def test_a_profile_with_too_few_points_is_a_fault_of_its_key(folder):
    Path("wheel.csv").write_text("0,0\n1,0\n2,0\n")
    (fault,) = faults_of(changed(RIG, ('"S1002"', '"wheel.csv"')))
    assert fault.startswith('scene.toml:5: profile = "wheel.csv": ')
    assert "points" in fault


def test_a_compare_scene_tells_the_faults_of_both_scenes(folder):
    Path("rig.toml").write_text(changed(RIG, ("load_kN = 80", "load_kN = 0")))
    Path("field.toml").write_text(changed(FIELD, ("share = 0.75", "share = 0.5")))
    found = faults_of(COMPARE)
    assert [fault.split(": ")[0] for fault in found] == ["rig.toml:15", "field.toml:16"]


def test_a_compare_scene_names_one_scene_of_each_kind(folder):
    (fault,) = faults_of(changed(COMPARE, ('field = "field.toml"', 'field = "rig.toml"')))
    assert fault == 'scene.toml:5: field = "rig.toml" is a rig scene; name a field scene'
    (fault,) = faults_of(changed(COMPARE, ('rig = "rig.toml"', 'rig = "compare.toml"')))
    assert fault.startswith('scene.toml:4: rig = "compare.toml" is a compare scene')
    (fault,) = faults_of(changed(COMPARE, ('rig = "rig.toml"', 'rig = "none.toml"')))
    assert fault.startswith('scene.toml:4: rig = "none.toml" does not exist')


def test_a_compare_scene_takes_nothing_else(folder):
    (fault,) = faults_of(COMPARE + '[wheelset]\nprofile = "S1002"\n')
    assert fault.startswith("scene.toml:6: unknown section [wheelset]: a compare scene holds")


def test_files_are_found_as_given_then_beside_the_scene_then_among_the_shipped(folder, tmp_path_factory):
    new = standard.wheel("S1002")
    away = tmp_path_factory.mktemp("away")
    write_two_column(new, away / "wheel.csv")
    text = changed(RIG, ('"S1002"', '"wheel.csv"'))
    (away / "scene.toml").write_text(text)
    beside = load_scene(away / "scene.toml")
    assert dict(build(beside).input_hashes)["wheelset.profile wheel.csv"]
    Path("wheel.csv").write_text("0,0\n1,0\n")  # as given comes first, and has too few points
    with pytest.raises(SceneError, match="points"):
        load_scene(away / "scene.toml")
    assert load_scene("workflows/rig_vs_field.toml").origin.path.is_absolute()
    assert isinstance(load_scene("rig_vs_field.toml"), CompareScene)


def test_the_rig_is_built_in_si_units(folder):
    setup = build(load_scene("rig.toml"))
    assert (setup.kind, setup.title) == ("rig", "a rig")
    assert setup.counterface.curvature == 1.0
    assert setup.wheelset.radius == 0.46
    assert setup.wheelset.half_span == pytest.approx(0.75, abs=1e-15)
    assert setup.scene_text == RIG
    points = setup.points
    conditions = points.conditions
    np.testing.assert_allclose(conditions.shift, [-3e-3, 4e-3, -2e-3, 0, 2e-3], rtol=1e-15)
    np.testing.assert_allclose(conditions.yaw, [2e-3, 0, 0, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(conditions.roll, [0.5e-3, 0, 0, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(conditions.wheel_load, [80e3, 90e3, 80e3, 80e3, 80e3], rtol=1e-15)
    np.testing.assert_allclose(conditions.speed, [20, 10, 20, 20, 20], rtol=1e-15)
    np.testing.assert_array_equal(conditions.friction, [0.35, 0.3, 0.35, 0.35, 0.35])
    np.testing.assert_array_equal(points.weight, [0.25, 0.75, 0, 0, 0])
    np.testing.assert_array_equal(points.environment, [1, 0.5, 1, 1, 1])
    np.testing.assert_array_equal(points.block_length, [1000, 3000, 0, 0, 0])
    assert points.label[:2] == ("left", "right")
    assert setup.control.distance == 100e3
    assert setup.control.depth_cap == pytest.approx(8e-6, rel=1e-15)
    assert setup.control.smoothing_wavelength == 2.5e-3
    assert setup.control.max_step == np.inf
    assert setup.models.youngs_modulus == 210e9
    assert setup.models.parameters == (("virtual_penetration_factor", 0.55),)


def test_the_field_is_built_in_si_units(folder):
    setup = build(load_scene("field.toml"))
    assert (setup.kind, setup.title) == ("field", "field")
    assert setup.counterface.curvature == 0.0
    assert setup.control.max_step == 20e3
    points = setup.points
    assert len(points.label) == 16  # 15 positions, and one where the deviation is 0
    assert points.weight.sum() == pytest.approx(1.0, abs=1e-15)
    assert points.weight[-1] == 0.25
    assert points.conditions.track_curvature[-1] == -1 / 500
    assert not points.block_length.any()
    np.testing.assert_array_equal(points.environment, [0.1] * 15 + [1.0])


def test_wheels_have_points_at_the_scenes_spacing_equally_many_left_and_right(folder):
    worn = standard.wheel("S1002")
    shorter = type(worn)("worn", "wheel", worn.y[:-20], worn.z[:-20])
    write_two_column(shorter, "left.csv")
    text = changed(
        RIG,
        ('profile = "S1002"', 'profile = "S1002"\nprofile_left = "left.csv"'),
        ("distance_km = 100", "distance_km = 100\npoint_spacing_mm = 0.5"),
    )
    Path("scene.toml").write_text(text)
    wheelset = build(load_scene("scene.toml")).wheelset
    assert len(wheelset.left.y) == len(wheelset.right.y)
    assert wheelset.left.y[-1] == pytest.approx(shorter.y[-1], abs=1e-12)
    step = np.hypot(np.diff(wheelset.right.y), np.diff(wheelset.right.z))
    # even arc length between corners; chords are shorter where the profile is curved
    assert np.median(step) == pytest.approx(0.5e-3, rel=0.02)


def test_a_copy_of_the_files_gives_the_same_campaign_whatever_happens_to_the_originals(
    folder, tmp_path_factory
):
    Path("a").mkdir()
    Path("b").mkdir()
    for name, amount in (("a", 0.0), ("b", 1e-4)):
        new = standard.wheel("S1002")
        write_two_column(type(new)(name, "wheel", new.y + amount, new.z), f"{name}/wheel.csv")
    Path("a/rig.toml").write_text(changed(RIG, ('"S1002"', '"wheel.csv"')))
    Path("b/field.toml").write_text(changed(FIELD, ('"S1002"', f'"{folder}/b/wheel.csv"')))
    Path("scene.toml").write_text(
        '[scene]\nkind="compare"\n[compare]\nrig="a/rig.toml"\nfield="b/field.toml"\n'
    )
    scene = load_scene("scene.toml")
    files = files_to_copy(scene)
    assert next(iter(files)) == "scene.toml"
    assert files["rig.toml"] == Path("a/rig.toml").read_bytes()
    assert all("/" not in name for name in files)
    assert files == files_to_copy(load_scene("scene.toml"))
    copy = tmp_path_factory.mktemp("copy")
    for name, content in files.items():
        (copy / name).write_bytes(content)
    for name in ("a/wheel.csv", "b/wheel.csv", "a/rig.toml"):
        Path(name).write_text("changed")
    again = load_scene(copy / "scene.toml", copied=True)
    for before, after in ((scene.rig, again.rig), (scene.field, again.field)):
        assert np.array_equal(build(before).wheelset.right.y, build(after).wheelset.right.y)
        assert build(before).input_hashes == build(after).input_hashes
    assert not np.array_equal(build(again.rig).wheelset.right.y, build(again.field).wheelset.right.y)


def test_a_damaged_copy_is_a_fault(folder):
    with pytest.raises(SceneError, match=r"inputs\.json: cannot be read"):
        load_scene("rig.toml", copied=True)


def test_the_hash_of_an_input_follows_its_content(folder):
    before = dict(build(load_scene("rig.toml")).input_hashes)
    Path("rig.toml").write_text(RIG + "# a remark\n")
    after = dict(build(load_scene("rig.toml")).input_hashes)
    assert before["rig.toml"] != after["rig.toml"]
    assert before["wheelset.profile S1002"] == after["wheelset.profile S1002"]


def test_what_deserves_a_second_look_is_a_warning(folder):
    assert build(load_scene("rig.toml")).warnings == ()
    Path("scene.toml").write_text(
        RIG.replace("friction = 0.35", "friction = 0").replace("friction = 0.3\n", "friction = 0\n")
    )
    assert any("nothing will wear" in line for line in build(load_scene("scene.toml")).warnings)
    Path("scene.toml").write_text(
        changed(FIELD, ("shift_std_mm = 2.5", "shift_std_mm = 2.5\npositions = 10"), ("2.5", "4"))
    )
    (warning,) = build(load_scene("scene.toml")).warnings
    assert "scene.toml:13: positions = 10 lie 2.7 mm apart" in warning


def test_scenes_are_immutable(folder):
    scene = load_scene("rig.toml")
    with pytest.raises(ValueError, match="frozen"):
        scene.campaign.distance_km = 1.0


def test_the_schema_knows_every_key_limit_and_name():
    schema = scene_schema()
    json.dumps(schema)
    kinds = {item["$ref"].rsplit("/", 1)[1] for item in schema["anyOf"]}
    assert kinds == {"RigScene", "FieldScene", "CompareScene"}
    parts = schema["$defs"]
    assert parts["BlockSection"]["properties"]["load_kN"]["exclusiveMinimum"] == 0
    assert parts["BlockSection"]["properties"]["load_kN"]["unit"] == "kN"
    assert "kik_piotrowski" in parts["ContactSection"]["properties"]["normal"]["enum"]
    assert "usfd" in parts["WearSection"]["properties"]["law"]["enum"]
    assert set(parts["RigOperation"]["properties"]) == {"block", "monitor"}
    assert set(parts["FieldOperation"]["properties"]) == {"class", "monitor"}
    for name, part in parts.items():
        assert part["additionalProperties"] is False, name


@pytest.mark.parametrize("name", ["rig.toml", "field.toml", "rig_vs_field.toml"])
def test_shipped_workflows_have_no_faults_and_no_warnings(name):
    scene = load_scene(standard.shipped_path("workflows", name))
    parts = [scene.rig, scene.field] if isinstance(scene, CompareScene) else [scene]
    for part in parts:
        assert isinstance(part, RigScene | FieldScene)
        assert build(part).warnings == ()


def test_the_shipped_rig_and_field_watch_the_same_states():
    scene = load_scene(standard.shipped_path("workflows", "rig_vs_field.toml"))
    assert scene.rig.operation.monitor == scene.field.operation.monitor
    assert scene.rig.operation.monitor is not None
