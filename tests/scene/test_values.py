"""Syntax, keys, types and ranges of scene files: every fault with its line, all at
once.
"""

from pathlib import Path

import pytest

from wearsim.errors import SceneError
from wearsim.scene import RigScene, load_scene

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
FIELD = (DATA / "scene_field.toml").read_text()


@pytest.mark.parametrize(
    ("text", "old", "new", "output"),
    [
        (
            RIG,
            "load_kN = 80",
            "load_kN = 0",
            "load_kN = 0 must be at least 0.1 and at most 300 kN; give the vertical",
        ),
        (RIG, "load_kN = 80", "load_kN = -80", "load_kN = -80 must be at least 0.1"),
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
        (
            RIG,
            "friction = 0.35",
            "friction = 2",
            "friction = 2 must be at least 0 and at most 1",
        ),
        (
            RIG,
            "yaw_mrad = 2",
            "yaw_mrad = 101",
            "yaw_mrad = 101 must be at least -100 and at most 100 mrad",
        ),
        (RIG, "yaw_mrad = 2", "yaw_mrad = -101", "yaw_mrad = -101 must be"),
        (
            RIG,
            "shift_mm = -3",
            "shift_mm = -101",
            "shift_mm = -101 must be at least -100",
        ),
        (
            RIG,
            "speed_km_h = 72",
            "speed_km_h = 501",
            "speed_km_h = 501 must be at least 0.1 and at most 500 km/h",
        ),
        (
            RIG,
            "[-2, 0, 2]",
            "[-2, 0, 101]",
            "shifts_mm[2] = 101 must be at least -100 and at most 100 mm",
        ),
        (RIG, "[-2, 0, 2]", "2", "shifts_mm = 2 must be a list"),
        (RIG, "[-2, 0, 2]", "[]", "shifts_mm has 0 entries, needs at least 1"),
        (
            RIG,
            'kind = "rig"',
            'kind = "rigg"',
            'kind = "rigg" is not allowed; did you mean "rig"?',
        ),
        (
            RIG,
            "roller_radius_mm = 1000",
            "roller_radius_mm = 4",
            "roller_radius_mm = 4 must be at least 5 and at most 100000 mm",
        ),
        (
            RIG,
            '"1:40"',
            '"1/40"',
            'inclination = "1/40" must be "1:10" to "1:100", or "none"',
        ),
        (RIG, '"a rig"', '"a\\u0000rig"', "must be one line of printable text"),
        (RIG, 'name = "left"', 'name = ""', "name is empty; give a name"),
        (
            FIELD,
            "curve_radius_m = -500",
            "curve_radius_m = 0",
            "must be between 10 and 1000000 m",
        ),
        (
            FIELD,
            "share = 0.75",
            "positions = 9",
            "positions = 9 must be at least 10 and at most 200",
        ),
        (
            FIELD,
            "share = 0.75",
            "positions = 15.0",
            "positions = 15.0 must be a whole number",
        ),
        (FIELD, "gauge_mm = 1435", "roller_radius_mm = 1000", "a rail has no radius"),
        (
            FIELD,
            "gauge_mm = 1435",
            "roller_radius_left_mm = 1000",
            "a rail has no radius",
        ),
        (
            FIELD,
            "max_step_km = 20",
            "stability = 110",
            "stability = 110 must be above 0 and at most 100",
        ),
        (
            FIELD,
            "max_step_km = 20",
            "error_tolerance_um = 0",
            "error_tolerance_um = 0 must be",
        ),
        (
            FIELD,
            "max_step_km = 20",
            "gauge_mm = 1",
            "unknown key gauge_mm in [campaign]; it belongs to [counterface]",
        ),
        (
            FIELD,
            "max_step_km = 20",
            'integrator = "semi_implicit"',
            "is not allowed; known: rkc, euler",
        ),
    ],
)
def test_a_bad_value_is_one_fault_with_its_line(
    folder, text, old, new, output, changed, faults_of, line_with
):
    result = [
        fault for fault in faults_of(changed(text, (old, new))) if output in fault
    ]
    assert len(result) == 1
    assert result[0].startswith(f"scene.toml:{line_with(text, old)}: ")


@pytest.mark.parametrize(
    ("key", "value", "output"),
    [
        (
            "load_kN",
            "0.0001",
            "load_kN = 0.0001 must be at least 0.1 and at most 300 kN",
        ),
        (
            "speed_km_h",
            "1e-300",
            "speed_km_h = 1e-300 must be at least 0.1 and at most 500 km/h",
        ),
    ],
)
@pytest.mark.parametrize(
    ("text", "table"),
    [
        (RIG, "[[operation.block]]"),
        (FIELD, "[[operation.class]]"),
        (RIG, "[operation.monitor]"),
    ],
    ids=["block", "class", "monitor"],
)
def test_loads_and_speeds_have_the_same_limits_everywhere(
    folder, faults_of, line_with, text, table, key, value, output
):
    start = text.index(table)
    old = text[text.index(f"{key} = ", start) :].split("\n")[0]
    text = text[:start] + text[start:].replace(old, f"{key} = {value}", 1)
    (fault,) = faults_of(text)
    assert fault.startswith(
        f"scene.toml:{line_with(text, f'{key} = {value}')}: {output}"
    )


@pytest.mark.parametrize(
    ("key", "output"),
    [
        (
            "distance_km = 100",
            (
                "key distance_km is missing in [campaign]; give the distance of the "
                "campaign, above 0"
            ),
        ),
        (
            "roller_radius_mm = 1000",
            "[counterface] needs roller_radius_mm, or rig = the name",
        ),
        ("shift_mm = 4", "needs shift_mm or lateral_force_kN; give exactly one"),
    ],
)
def test_a_missing_key_is_told_at_its_table(folder, key, output, changed, faults_of):
    (fault,) = faults_of(changed(RIG, (key, "")))
    assert output in fault
    table = RIG[: RIG.index(key)].rindex("\n[") + 1
    assert fault.startswith(f"scene.toml:{RIG[:table].count(chr(10)) + 1}: ")


def test_all_faults_of_a_file_are_told_at_once_in_the_order_of_the_file(
    folder, changed, faults_of
):
    text = changed(
        RIG,
        ("roller_radius_mm = 1000", "roller_radius_mm = 0"),
        ("load_kN = 80", "load_kN = 0"),
        ("friction = 0.3\n", "friction = 2\n"),
        ("distance_km = 100", "distnce_km = 100"),
    )
    result = faults_of(text)
    assert [fault.split(":")[1] for fault in result] == ["9", "15", "24", "32", "33"]
    assert "did you mean distance_km?" in result[-1]


@pytest.mark.parametrize("name", ["normal", "tangential"])
def test_an_unknown_contact_model_is_told_with_what_there_is(folder, name, faults_of):
    (fault,) = faults_of(RIG + f'[contact]\n{name} = "fastsimm"\n')
    assert fault.startswith(
        f'scene.toml:{RIG.count(chr(10)) + 2}: {name} = "fastsimm" is not known; '
    )
    assert ("fastsim" if name == "tangential" else "kik_piotrowski") in fault


@pytest.mark.parametrize("name", ["law", "coefficients"])
def test_an_unknown_wear_law_or_coefficient_set_is_told_with_the_nearest(
    folder, name, faults_of
):
    value = {"law": "usdf", "coefficients": "lewis_dwyer_2004"}[name]
    meant = {"law": "usfd", "coefficients": "lewis_dwyer_joyce_2004"}[name]
    (fault,) = faults_of(RIG + f'[wear]\n{name} = "{value}"\n')
    assert f'{name} = "{value}" is not known; did you mean "{meant}"?' in fault


def test_missing_and_unknown_sections_are_told(folder, faults_of):
    result = faults_of('[scene]\nkind = "rig"\n[wheelst]\nprofile = "S1002"\n')
    assert "scene.toml:3: unknown section [wheelst]; did you mean wheelset?" in result
    for name in ("wheelset", "counterface", "operation", "campaign"):
        assert any(f"[{name}] is missing" in fault for fault in result)


@pytest.mark.parametrize(
    "text", ["", "x = 1\n", "[scene]\n", "scene = 3\n", "[[scene]]\nkind = 'rig'\n"]
)
def test_a_file_without_a_kind_is_one_fault(folder, text, faults_of):
    (fault,) = faults_of(text)
    assert fault.startswith("scene.toml:1: ")
    assert "scene" in fault


def test_faults_in_a_list_of_tables_are_not_followed_by_one_on_its_length(
    folder, faults_of
):
    text = RIG.replace(
        "load_kN = 80\nspeed_km_h = 72\nfriction = 0.35\ndist",
        "load_kN = 0\nspeed_km_h = 72\nfriction = 0.35\ndist",
    )
    (fault,) = faults_of(text)
    assert "load_kN = 0" in fault


@pytest.mark.parametrize(
    ("content", "output"),
    [
        (b"[scene\n", "scene.toml:1: not valid TOML"),
        (b"[scene]\nkind = 'rig'\nkind = 'rig'\n", "scene.toml:3: not valid TOML"),
        (b"\xff\xfe[\x00s", "scene.toml:1: is not UTF-8 text"),
        (b"a = " + b"[" * 20000, "nested too deeply"),
        (b"a = " + b"1" * 5000, "not valid TOML"),
        (b"#" * 2_000_001, "larger than 2 MB"),
    ],
)
def test_a_file_that_is_no_toml_is_one_fault(folder, content, output):
    Path("scene.toml").write_bytes(content)
    with pytest.raises(SceneError) as caught:
        load_scene("scene.toml")
    assert len(str(caught.value).splitlines()) == 1
    assert output in str(caught.value)


def test_a_byte_order_mark_is_no_fault(folder):
    Path("scene.toml").write_bytes(b"\xef\xbb\xbf" + RIG.encode())
    assert isinstance(load_scene("scene.toml"), RigScene)


@pytest.mark.parametrize("name", ["nowhere.toml", ".", "nowhere\x00.toml", "x" * 5000])
def test_a_scene_file_that_is_not_there_is_told_with_the_shipped_ones(folder, name):
    with pytest.raises(SceneError, match=r"rig_vs_field\.toml"):
        load_scene(name)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        (
            "[contact]\nfriction = 0.3",
            "unknown key friction in [contact]; it belongs to [[operation.block]]",
        ),
        (
            "[wheelset]\nprofile_right = 'S1002'",
            "unknown key profile_right in [wheelset]: profile is that of the",
        ),
        (
            "[wheelset]\nflange_back_mm = 1360",
            "unknown key flange_back_mm in [wheelset]: the key has a new name",
        ),
    ],
)
def test_an_unknown_key_leads_to_the_right_one(folder, faults_of, key, message):
    table, _ = key.split("\n")
    text = RIG.replace(table, key) if table in RIG else f"{RIG}\n{key}\n"
    assert any(message in fault for fault in faults_of(text))
