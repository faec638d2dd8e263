"""Scene files without faults: what is read, built, copied and warned of."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import SceneError
from wearsim.profile import standard
from wearsim.profile.files import write_profile
from wearsim.scene import (
    CompareScene,
    FieldScene,
    RigScene,
    build,
    files_to_copy,
    load_scene,
    scene_schema,
)
from wearsim.scene.initial_contact import check_contact

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
FIELD = (DATA / "scene_field.toml").read_text()


def test_files_are_found_as_given_then_beside_the_scene_then_among_the_shipped(
    folder, tmp_path_factory, changed
):
    new = standard.wheel("S1002")
    away = tmp_path_factory.mktemp("away")
    write_profile(new, away / "wheel.csv")
    text = changed(RIG, ('"S1002"', '"wheel.csv"'))
    (away / "scene.toml").write_text(text)
    beside = load_scene(away / "scene.toml")
    assert dict(build(beside).input_hashes)["wheelset.profile wheel.csv"]
    Path("wheel.csv").write_text(
        "0,0\n1,0\n"
    )  # as given comes first, and has too few points
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
    np.testing.assert_allclose(
        conditions.shift, [-3e-3, 4e-3, -2e-3, 0, 2e-3], rtol=1e-15
    )
    np.testing.assert_allclose(conditions.yaw, [2e-3, 0, 0, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(conditions.roll, [0.5e-3, 0, 0, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(
        conditions.wheel_load, [80e3, 90e3, 80e3, 80e3, 80e3], rtol=1e-15
    )
    np.testing.assert_allclose(conditions.speed, [20, 10, 20, 20, 20], rtol=1e-15)
    np.testing.assert_array_equal(conditions.friction, [0.35, 0.3, 0.35, 0.35, 0.35])
    np.testing.assert_array_equal(points.weight, [0.25, 0.75, 0, 0, 0])
    np.testing.assert_array_equal(points.environment, [1, 0.5, 1, 1, 1])
    np.testing.assert_array_equal(points.block_length, [1000, 3000, 0, 0, 0])
    assert points.label[:2] == ("left", "right")
    assert setup.control.distance == 100e3
    assert setup.control.depth_cap == pytest.approx(50e-6, rel=1e-15)
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


def test_wheels_have_points_at_the_scenes_spacing_equally_many_left_and_right(
    folder, changed
):
    worn = standard.wheel("S1002")
    shorter = type(worn)("worn", "wheel", worn.y[:-20], worn.z[:-20])
    write_profile(shorter, "left.csv")
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
    folder, tmp_path_factory, changed
):
    Path("a").mkdir()
    Path("b").mkdir()
    for name, amount in (("a", 0.0), ("b", 1e-4)):
        new = standard.wheel("S1002")
        write_profile(
            type(new)(name, "wheel", new.y + amount, new.z), f"{name}/wheel.csv"
        )
    Path("a/rig.toml").write_text(changed(RIG, ('"S1002"', '"wheel.csv"')))
    Path("b/field.toml").write_text(
        changed(FIELD, ('"S1002"', f'"{folder}/b/wheel.csv"'))
    )
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
        assert np.array_equal(
            build(before).wheelset.right.y, build(after).wheelset.right.y
        )
        assert build(before).input_hashes == build(after).input_hashes
    assert not np.array_equal(
        build(again.rig).wheelset.right.y, build(again.field).wheelset.right.y
    )


def test_a_damaged_copy_is_a_fault(folder):
    with pytest.raises(SceneError, match=r"inputs\.json: cannot be read"):
        load_scene("rig.toml", copied=True)


def test_the_hash_of_an_input_follows_its_content(folder):
    before = dict(build(load_scene("rig.toml")).input_hashes)
    Path("rig.toml").write_text(RIG + "# a remark\n")
    after = dict(build(load_scene("rig.toml")).input_hashes)
    assert before["rig.toml"] != after["rig.toml"]
    assert before["wheelset.profile S1002"] == after["wheelset.profile S1002"]


def test_scenes_are_immutable(folder):
    scene = load_scene("rig.toml")
    with pytest.raises(ValueError, match="frozen"):
        scene.campaign.distance_km = 1.0


def test_the_schema_knows_every_key_limit_and_name():
    schema = scene_schema()
    json.dumps(schema)
    kinds = {item["then"]["$ref"].rsplit("/", 1)[1] for item in schema["allOf"]}
    assert kinds == {"RigScene", "FieldScene", "CompareScene", "SweepScene"}
    parts = schema["$defs"]
    assert parts["BlockSection"]["properties"]["speed_km_h"]["minimum"] == 0.1
    assert parts["BlockSection"]["properties"]["load_kN"]["unit"] == "kN"
    assert (
        "kik_piotrowski"
        in parts["ContactSection"]["properties"]["normal"]["anyOf"][0]["enum"]
    )
    assert "usfd" in parts["WearSection"]["properties"]["law"]["enum"]
    assert set(parts["RigOperation"]["properties"]) == {
        "block",
        "programme",
        "together",
        "monitor",
    }
    assert set(parts["FieldOperation"]["properties"]) == {"class", "monitor"}
    for name, part in parts.items():
        assert part["additionalProperties"] is False, name


def schema_faults(value, schema, root, path=()):
    """Faults of a value as an editor finds them, (path, keyword), by the keywords that
    the schema uses.
    """
    if "$ref" in schema:
        yield from schema_faults(
            value, root["$defs"][schema["$ref"].rsplit("/", 1)[1]], root, path
        )
    for part in schema.get("allOf", ()):
        yield from schema_faults(value, part, root, path)
    if "if" in schema and not list(schema_faults(value, schema["if"], root)):
        yield from schema_faults(value, schema["then"], root, path)
    if "anyOf" in schema and all(
        list(schema_faults(value, part, root)) for part in schema["anyOf"]
    ):
        yield path, "anyOf"
    types = {
        "object": dict,
        "array": list,
        "string": str,
        "boolean": bool,
        "number": (int, float),
        "null": type(None),
    }
    types["integer"] = int
    if "type" in schema and not isinstance(value, types[schema["type"]]):
        yield path, "type"
    if value not in schema.get("enum", [value]) or value != schema.get("const", value):
        yield path, "enum"
    if isinstance(value, dict):
        known = schema.get("properties", {})
        yield from (
            ((*path, name), "required")
            for name in schema.get("required", ())
            if name not in value
        )
        for name, item in value.items():
            if name in known:
                yield from schema_faults(item, known[name], root, (*path, name))
            elif schema.get("additionalProperties") is False:
                yield (*path, name), "additionalProperties"
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from schema_faults(
                item, schema.get("items", {}), root, (*path, index)
            )
    if isinstance(value, int | float):
        low, high = schema.get("minimum", value), schema.get("maximum", value)
        if not low <= value <= high or value <= schema.get(
            "exclusiveMinimum", value - 1.0
        ):
            yield path, "range"


@pytest.mark.parametrize(
    ("name", "changes", "faults"),
    [
        ("rig", (), []),
        ("field", (), []),
        ("compare", (), []),
        (
            "rig",
            (("friction = 0.35", "friction = 2"),),
            [(("operation", "block", 0, "friction"), "range")],
        ),
        (
            "rig",
            (("inclination", "incline"),),
            [(("counterface", "incline"), "additionalProperties")],
        ),
        (
            "field",
            (('kind = "field"', 'kind = "filed"'),),
            [(("scene", "kind"), "enum")],
        ),
    ],
)
def test_an_editor_sees_the_faults_of_the_kind_only(
    folder, changed, name, changes, faults
):
    """Not those of all kinds that the file might have been: the schema selects the
    model by the kind.
    """
    data = tomllib.loads(changed(Path(f"{name}.toml").read_text(), *changes))
    schema = scene_schema()
    result = [
        fault for fault in schema_faults(data, schema, schema) if fault[1] != "required"
    ]
    assert result == faults


@pytest.mark.parametrize(
    "name",
    [
        "rig.toml",
        "field.toml",
        "field_given.toml",
        "rig_vs_field.toml",
        "fatigue.toml",
        "limits.toml",
        "fleet.toml",
        "recorded.toml",
        "measured_wheel.toml",
    ],
)
def test_shipped_workflows_have_no_faults_and_no_warnings(name):
    scene = load_scene(standard.shipped_path("workflows", name))
    parts = [scene.rig, scene.field] if isinstance(scene, CompareScene) else [scene]
    for part in parts:
        assert isinstance(part, RigScene | FieldScene)
        assert build(part).warnings == ()
    assert check_contact(scene) == ()


@pytest.mark.parametrize(
    "name", ["rig.toml", "rig_given.toml", "field.toml", "field_given.toml"]
)
def test_shipped_rig_and_field_judge_fatigue(name):
    """A law that counts cycles to a crack, and one of shakedown, alike so that rig and
    field compare.
    """
    laws = build(load_scene(standard.shipped_path("workflows", name))).fatigue
    assert [law.law for law in laws] == ["wlrm", "surface_fatigue_index"]
    assert (
        laws
        == build(load_scene(standard.shipped_path("workflows", "field.toml"))).fatigue
    )


def test_the_shipped_rig_and_field_watch_the_same_states():
    scene = load_scene(standard.shipped_path("workflows", "rig_vs_field.toml"))
    assert scene.rig.operation.monitor == scene.field.operation.monitor
    assert scene.rig.operation.monitor is not None


def test_the_shipped_curves_are_those_of_an_under_steering_leading_axle():
    """Displaced towards the outer rail and heading towards it: yaw > 0 turns x
    (forwards) to y (right).
    """
    scene = load_scene(standard.shipped_path("workflows", "rig_vs_field.toml"))
    curves = [
        run for run in scene.field.operation.classes if run.curve_radius_m is not None
    ]
    assert {np.sign(run.curve_radius_m) for run in curves} == {-1, 1}
    for run in curves:
        assert (
            np.sign(run.shift_mean_mm)
            == np.sign(run.yaw_mrad)
            == -np.sign(run.curve_radius_m)
        )
    for run in scene.rig.operation.blocks:
        assert np.sign(run.shift_mm) == np.sign(run.yaw_mrad)


@pytest.mark.parametrize(
    "profile", ["S1002/h30/e30.5", "1/40", "measured/wheel_worn_left.whl"]
)
def test_designations_and_measured_files_are_wheels_of_a_scene(profile, tmp_path):
    """With a slash, but no path; a file among the shipped profiles, in the format of an
    instrument.
    """
    path = tmp_path / "rig.toml"
    text = (DATA / "scene_rig.toml").read_text()
    assert 'profile = "S1002"' in text
    path.write_text(text.replace('profile = "S1002"', f'profile = "{profile}"'))
    setup = build(load_scene(path))
    assert setup.wheelset.right.kind == "wheel"
    assert setup.wheelset.right.y[0] < -0.06
    copied = tmp_path / "copy"
    copied.mkdir()
    for name, content in files_to_copy(load_scene(path)).items():
        (copied / name).write_bytes(content)
    again = build(load_scene(copied / "rig.toml", copied=True))
    assert again.wheelset.right.z.tolist() == setup.wheelset.right.z.tolist()
