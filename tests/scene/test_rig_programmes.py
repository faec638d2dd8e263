"""Blocks by force, loads by side, programmes as tables, rigs as data: what they become,
what is refused.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.campaign.row import header_of
from wearsim.cli.flags import overrides_of
from wearsim.errors import SceneError
from wearsim.profile.standard import shipped_path
from wearsim.scene import build, files_to_copy, load_scene
from wearsim.scene.sweep import sweep_of_flags

HEAD = """[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
rig = "full_scale"
[contact]
model = "fast"
strips = 10
cells = 10
[operation]
"""
BLOCK = """[[operation.block]]
name = "a"
lateral_force_kN = 10
axle_load_kN = 160
speed_km_h = 72
friction = 0.35
distance_km = 2
"""
END = "[campaign]\ndistance_km = 1\n"
RIG = HEAD + BLOCK + END


def test_a_rig_gives_radius_gauge_and_drive_unless_the_scene_does(folder):
    Path("scene.toml").write_text(
        RIG.replace('rig = "full_scale"', 'rig = "full_scale"\ngauge_mm = 1440')
    )
    counterface = load_scene("scene.toml").counterface
    assert (counterface.roller_radius_mm, counterface.gauge_mm) == (1000.0, 1440.0)
    assert counterface.drive == "independent"


def test_a_rig_and_its_scene_say_how_deep_the_gauge_is_measured_and_what_is_on_the_left(
    folder,
):
    rig = shipped_path("profiles", "rigs", "full_scale.toml").read_text()
    Path("own.toml").write_text(
        rig.replace("gauge_mm =", "gauge_height_mm = 15.875\ngauge_mm =")
    )
    Path("scene.toml").write_text(
        RIG.replace('"full_scale"', '"own"\nprofile_left = "54E1"')
    )
    scene = load_scene("scene.toml")
    assert scene.counterface.gauge_height_mm == 15.875
    counterface = build(scene).counterface
    alike = wearsim.rails(
        "60E1", inclination=1 / 40, gauge=1.435, gauge_height=15.875e-3, left="54E1"
    )
    for own, expected in zip(counterface.profiles, alike.profiles, strict=True):
        np.testing.assert_array_equal(own.y, expected.y)
        np.testing.assert_array_equal(own.z, expected.z)


def test_blocks_become_points_with_found_shifts_and_loads(folder):
    more = (
        'name = "b"\nshift_mm = -1\nwheel_load_right_kN = 70\n'
        "wheel_load_left_kN = 80\nduration_h = 0.5"
    )
    block = BLOCK.replace('name = "a"\nlateral_force_kN = 10\naxle_load_kN = 160', more)
    turns = BLOCK.replace('"a"', '"c"').replace("distance_km = 2", "revolutions = 1000")
    Path("scene.toml").write_text(
        HEAD + BLOCK + block.replace("distance_km = 2\n", "") + turns + END
    )
    points = build(load_scene("scene.toml")).points
    np.testing.assert_allclose(
        points.block_length, [2e3, 36e3, 2 * np.pi * 0.46 * 1000]
    )
    np.testing.assert_allclose(points.weight.sum(), 1.0)
    assert 4e-3 < points.conditions.shift[0] < 6e-3
    assert points.conditions.shift[0] == points.conditions.shift[2]
    np.testing.assert_allclose(
        points.conditions.loads.sum(axis=1), [160e3, 150e3, 160e3], rtol=1e-4
    )
    np.testing.assert_array_equal(points.conditions.loads[1], [70e3, 80e3])


def test_a_programme_is_a_table_of_blocks(folder):
    Path("scene.toml").write_text(HEAD + 'programme = "table.csv"\n' + END)
    table = "name,shift_mm,load_kN,speed_km_h,friction,distance_km,positions\n"
    Path("table.csv").write_text(table + "up,0,80,72,0.3,2,3\nhold,3,80,72,0.3,4,\n")
    points = build(load_scene("scene.toml")).points
    assert points.label == ("up 1", "up 2", "up 3", "hold")
    np.testing.assert_allclose(points.conditions.shift, [0.5e-3, 1.5e-3, 2.5e-3, 3e-3])
    Path("table.csv").write_text(
        table.replace("friction", "frition") + "up,0,80,72,0.3,2,3\n"
    )
    with pytest.raises(
        SceneError,
        match=(
            r'table.csv:1: column "frition" is no key of a block; did you mean '
            r'"friction"'
        ),
    ):
        load_scene("scene.toml")
    Path("table.csv").write_text(table + "up,0,80,72,0.3,2,3\nhold,3,80,fast,2,4,\n")
    with pytest.raises(SceneError) as caught:
        load_scene("scene.toml")
    places = [Path(line.split(": ")[0]).name for line in str(caught.value).splitlines()]
    assert places == ["table.csv:3"] * 2
    assert 'speed_km_h = "fast"' in str(caught.value)
    Path("table.csv").write_text(
        table + "up,0,80,72,0.3,2,3\n\nhold,300,80,72,0.3,4,\n"
    )
    with pytest.raises(SceneError, match=r"table.csv:4: .*shift_mm"):
        build(load_scene("scene.toml"))
    forces = "name,lateral_force_kN,axle_load_kN,speed_km_h,friction,distance_km\n"
    Path("table.csv").write_text(forces + "a,1,160,72,0.3,2\nb,70,160,72,0.3,2\n")
    with pytest.raises(
        SceneError,
        match=r'table.csv:3: block "b": lateral_force_kN = 70 is beyond the rig',
    ):
        load_scene("scene.toml")
    Path("table.csv").write_text(forces + "a,1,160,72,0.3,2\nb,58,30,72,0.3,2\n")
    with pytest.raises(
        SceneError, match=r"table.csv:3: b: the moment of the lateral force"
    ):
        build(load_scene("scene.toml"))
    for number in ("nan", "inf"):
        Path("table.csv").write_text(table + f"up,0,80,72,0.3,2,{number}\n")
        with pytest.raises(
            SceneError, match=f"table.csv:2: positions = {number} must be"
        ):
            load_scene("scene.toml")
    Path("table.csv").write_text(
        table.replace("speed_km_h", "load_kN") + "up,0,80,72,0,3,2,3\n"
    )
    with pytest.raises(SceneError) as caught:
        load_scene("scene.toml")
    assert 'column "load_kN" stands twice' in str(caught.value)
    assert "table.csv:2: 8 cells, the header has 7" in str(caught.value)
    Path("table.csv").unlink()
    with pytest.raises(SceneError, match=r'programme = "table.csv" does not exist'):
        load_scene("scene.toml")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (
            "axle_load_kN",
            "wheel_load_right_kN = 80\naxle_load_kN",
            "exclude each other; give either",
        ),
        (
            "axle_load_kN = 160",
            "load_kN = 80\nwheel_load_left_kN = 80",
            "wheel_load_left_kN exclude",
        ),
        (
            "axle_load_kN = 160",
            "wheel_load_left_kN = 80",
            "give wheel_load_right_kN, too",
        ),
        (
            "axle_load_kN = 160",
            "axle_box_right_kN = 70\naxle_box_left_kN = 70",
            "need mass_kg and axle_box",
        ),
        ("axle_load_kN = 160", "yaw_mrad = 1", 'block "a": has no load'),
        (
            "lateral_force_kN = 10",
            "lateral_force_kN = 10\nshift_mm = 1",
            "and lateral_force_kN exclude",
        ),
        ("distance_km = 2\n[c", "[c", "needs distance_km or duration_h or revolutions"),
        (
            "distance_km = 2\n[c",
            "distance_km = 2\nduration_h = 1\n[c",
            "distance_km and duration_h exclude",
        ),
        (
            "lateral_force_kN = 10",
            "lateral_force_kN = 70",
            "lateral_force_kN = 70 is beyond the rig",
        ),
        ("speed_km_h = 72", "speed_km_h = 320", "speed_km_h = 320 is beyond the rig"),
        (
            "[contact]",
            '[contact]\nroll = "given"',
            'roll = "given" lets no forces of "a" be balanced',
        ),
        (
            '"full_scale"',
            '"full_scael"',
            'nor a shipped rig; did you mean "full_scale"?',
        ),
        ('rig = "full_scale"', "", "needs roller_radius_mm, or rig = "),
        (BLOCK, "", "needs at least one [[operation.block]], or programme"),
        ('"full_scale"', '"full_scale"\ndrive = "coupled"', ""),
        ('rig = "full_scale"', "roller_radius_mm = 1000", ""),
    ],
)
def test_what_does_not_fit_together_is_refused_with_its_line(
    folder, changed, faults_of, old, new, reason
):
    text = changed(RIG, (old, new))
    if not reason:
        text, reason = (
            text.replace("friction =", "speed_difference_percent = 1\nfriction ="),
            "turn apart",
        )
    faults = faults_of(text)
    assert any(reason in fault for fault in faults), faults
    assert all(fault.startswith("scene.toml:") for fault in faults)


@pytest.mark.parametrize(
    ("force", "reason"),
    [
        (250, "the flange carries a lateral force of at most"),
        (-300, "unloads the right wheel"),
    ],
)
def test_a_force_beyond_the_flange_is_a_fault_of_its_block(
    folder, changed, force, reason
):
    pairs = (
        ('rig = "full_scale"', "roller_radius_mm = 1000"),
        ("_kN = 10", f"_kN = {force}"),
    )
    Path("scene.toml").write_text(changed(RIG, *pairs))
    with pytest.raises(SceneError, match=rf"scene.toml:16: a: .*{reason}"):
        build(load_scene("scene.toml"))


def test_radii_of_both_rollers_and_the_speeds_of_one_shaft(folder):
    rig = shipped_path("profiles", "rigs", "full_scale.toml").read_text()
    Path("own.toml").write_text(
        rig.replace("gauge_mm =", "roller_radius_left_mm = 998\ngauge_mm =")
    )
    own = RIG.replace('"full_scale"', '"own"').replace(
        "lateral_force_kN = 10", "shift_mm = 1"
    )
    monitor = (
        "[operation.monitor]\nshifts_mm = [0]\nload_kN = 80\nspeed_km_h = 72\n"
        "friction = 0.35\n"
    )
    for drive, difference in (("coupled", -2.0 / 999.0), ("independent", None)):
        Path("scene.toml").write_text(
            own.replace('"own"', f'"own"\ndrive = "{drive}"') + monitor
        )
        setup = build(load_scene("scene.toml"))
        assert setup.counterface.curvatures == (1.0, 1e3 / 998.0)
        found = setup.points.conditions.speed_difference
        assert (
            found is None
            if difference is None
            else found.tolist() == pytest.approx([difference] * 2)
        )
        assert (
            header_of(setup, "").attributes["counterface_curvature_left"] == 1e3 / 998.0
        )
    # a radius of the scene is that of both
    Path("scene.toml").write_text(own.replace('"own"', '"own"\nroller_radius_mm = 500'))
    setup = build(load_scene("scene.toml"))
    assert setup.counterface.curvatures == (2.0, 2.0)
    assert "counterface_curvature_left" not in header_of(setup, "").attributes


@pytest.mark.parametrize(
    ("new", "reason"),
    [
        (
            "roller_radius_left_mm = 4",
            "roller_radius_left_mm = 4 must be at least 5",
        ),
        (
            "roller_radius_left_mm = 900\n[counterface.wear]\nfactor = 1",
            (
                "one pair of alike rails or rollers; delete it, or rails and "
                "roller_radius_left_mm"
            ),
        ),
    ],
)
def test_faults_of_the_radius_of_the_left_roller(
    folder, changed, faults_of, new, reason
):
    faults = faults_of(
        changed(RIG, ('rig = "full_scale"', f'rig = "full_scale"\n{new}'))
    )
    assert any(reason in fault for fault in faults), faults


ROWS = """name,shift_mm,load_kN,speed_km_h,friction,distance_km
up,0,80,72,0.3,2

hold 2,3,80,72,0.3,4
"""


@pytest.fixture
def programme(folder):
    """Function that loads a scene whose programme is a table, with overrides of
    flags.
    """
    Path("scene.toml").write_text(HEAD + 'programme = "table.csv"\n' + END)
    Path("table.csv").write_text(ROWS)
    return lambda *flags: load_scene("scene.toml", overrides=overrides_of(flags))


def test_rows_of_a_programme_are_set_by_name_by_number_and_all(programme):
    flags = (
        "block.friction=0.4",
        "block.hold 2.friction=0.2",
        "block.1.yaw_mrad=1",
        "block.2.load_kN=90",
    )
    scene = programme(*(f"operation.{flag}" for flag in flags))
    up, hold = scene.operation.blocks
    assert (up.friction, up.yaw_mrad, up.load_kN) == (0.4, 1.0, 80.0)
    assert (hold.friction, hold.yaw_mrad, hold.load_kN) == (0.2, 0.0, 90.0)
    assert Path("table.csv").read_text() == ROWS


def test_a_run_directory_keeps_a_programme_with_its_overrides(programme, tmp_path):
    scene = programme(
        "operation.block.hold 2.friction=0.2", "operation.block.up.yaw_mrad=1"
    )
    kept = tmp_path / "kept"
    kept.mkdir()
    for name, content in files_to_copy(scene).items():
        (kept / name).write_bytes(content)
    again = load_scene(kept / "scene.toml", copied=True)
    assert again.model_dump() == scene.model_dump()
    assert again.operation.blocks[1].friction == 0.2
    header = (kept / "scene.toml").read_text().splitlines()[0]
    assert header == (
        "# scene with operation.block.hold 2.friction = 0.2, "
        "operation.block.up.yaw_mrad = 1"
    )


@pytest.mark.parametrize(
    ("flag", "reason"),
    [
        (
            "block.hodl.friction=0.2",
            'table.csv has no row "hodl"; .* name (up, hold 2), or by their number',
        ),
        ("block.3.friction=0.2", 'table.csv has no row "3"'),
        (
            "block.up.frition=0.2",
            "unknown key frition in [[operation.block]]; did you mean friction?",
        ),
        ("block.up.friction=high", 'friction = "high" must be a number'),
        ("block.up.friction=9", "friction = 9.0 must be"),
        ("block.up.speed_km_h=400", "speed_km_h = 400 is beyond the rig"),
        ("block.up.friction=", "key friction is missing"),
    ],
)
def test_faults_of_overridden_rows_name_the_flag(programme, flag, reason):
    pattern = re.escape(reason).replace(r"\.\*", ".*")
    with pytest.raises(
        SceneError, match=rf"^--set operation\.{re.escape(flag)}: .*{pattern}"
    ) as caught:
        programme(f"operation.{flag}")
    assert "\n" not in str(caught.value)


def test_faults_of_other_cells_of_an_overridden_row_keep_their_line(programme):
    Path("table.csv").write_text(ROWS.replace("3,80,72", "3,80,720"))
    with pytest.raises(SceneError, match=r"^table.csv:4: .*speed_km_h = 720"):
        programme("operation.block.hold 2.friction=0.2")


def test_rows_of_a_programme_are_swept_by_name(programme):
    flags = ("operation.block.hold 2.friction=0.2,0.4", "counterface.profile=54E1,60E1")
    cases = sweep_of_flags("scene.toml", flags, None).cases
    frictions = [
        load_scene(case.base, overrides=case.overrides).operation.blocks[1].friction
        for case in cases
    ]
    assert frictions == [0.2, 0.2, 0.4, 0.4]
    assert cases[0].label == 'friction = 0.2, profile = "54E1"'
    Path("cases.csv").write_text(
        "operation.block.hold 2.friction,counterface.profile\n0.2,54E1\n,60E1\n"
    )
    first, second = sweep_of_flags("scene.toml", (), "cases.csv").cases
    scene = load_scene(first.base, overrides=first.overrides)
    assert (scene.operation.blocks[1].friction, scene.counterface.profile) == (
        0.2,
        "54E1",
    )
    scene = load_scene(second.base, overrides=second.overrides)
    assert (scene.operation.blocks[1].friction, scene.counterface.profile) == (
        0.3,
        "60E1",
    )
