"""Wear by block and zone, with the uncertainty from errors of the set-points."""

import json
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim import cli
from wearsim.errors import SceneError
from wearsim.profile.worn import WHEEL_ZONES
from wearsim.studies.moved_set_points import SET_POINTS
from wearsim.studies.zone_errors import zone_lines

BLOCKS = (
    {"name": "centred", "shift_mm": 0.5, "distance_km": 3},
    {"name": "curve", "shift_mm": 5.4, "yaw_mrad": 3, "distance_km": 1},
)

VEHICLE = Path(__file__).parents[1] / "data" / "scene_vehicle.toml"


@pytest.fixture(scope="module")
def scene(tmp_path_factory, scene_text):
    path = tmp_path_factory.mktemp("zones") / "rig.toml"
    path.write_text(scene_text(*BLOCKS))
    return path


@pytest.fixture(scope="module")
def table(scene):
    return wearsim.zone_errors(scene, {"shift_mm": 0.2})


def area_in_root(scene, shift):
    """Worn area of the right flange root in the block "curve", per metre of it."""
    moved = wearsim.load_scene(
        scene, overrides={"operation.block.curve.shift_mm": shift}
    )
    rate = wearsim.wear_rate(moved).sel(operating_point="curve", wheel="right")
    y, depth = rate["profile_y"].values, rate["wear_depth_rate"].sum("regime").values
    low, high = (WHEEL_ZONES[name] for name in ("flange", "flange root"))
    inside = (y >= low) & (y < high)
    return float((depth * np.gradient(rate["arc_length"].values))[inside].sum())


def row_of(table, block, zone, wheel="right"):
    chosen = table[
        (table["block"] == block) & (table["zone"] == zone) & (table["wheel"] == wheel)
    ]
    return chosen.iloc[0]


def test_changes_are_those_of_the_wear_rate_at_the_moved_set_point(scene, table):
    """Lengths of the profile at its points differ by their formulas, which nearly
    cancels.
    """
    root = row_of(table, "curve", "flange root")
    base, moved = (area_in_root(scene, 5.4 + error) for error in (0.0, 0.2))
    assert root["shift_mm"] == pytest.approx(moved / base - 1.0, rel=5e-3)
    assert abs(root["shift_mm"]) > abs(root["load_kN"]) > 0.0


def test_changes_are_those_of_the_positive_error_with_their_sign(tmp_path, scene_text):
    """A shift to the right wears the right flange root more and the left one less,
    where both are loaded as mirror images; the standard errors are equal.
    """
    path = tmp_path / "rig.toml"
    right = {"name": "right", "shift_mm": 5.4, "yaw_mrad": 3, "distance_km": 1}
    left = {"name": "left", "shift_mm": -5.4, "yaw_mrad": -3, "distance_km": 1}
    path.write_text(scene_text(right, left))
    mirrored = wearsim.zone_errors(path)
    outer = row_of(mirrored, "right", "flange root", "right")
    inner = row_of(mirrored, "left", "flange root", "left")
    assert outer["shift_mm"] > 0.05
    assert inner["shift_mm"] < -0.05
    assert outer["share_error"] == pytest.approx(inner["share_error"], rel=1e-6)


def test_shares_add_up_and_one_block_alone_has_no_error_of_its_zone(table):
    assert table["share"].sum() == pytest.approx(1.0, rel=1e-12)
    zones = table.groupby(["wheel", "zone"])["of_zone"].sum()
    np.testing.assert_allclose(zones, 1.0, rtol=1e-12)
    root = row_of(table, "curve", "flange root")
    assert (root["of_zone"], root["of_zone_error"]) == (1.0, 0.0)
    assert root["share_error"] > 0.0
    assert table["zone"].tolist() == sorted(table["zone"], key=list(WHEEL_ZONES).index)


def test_smaller_errors_leave_smaller_standard_errors(scene, table):
    small = wearsim.zone_errors(
        scene, {"shift_mm": 0.02, "yaw_mrad": 0.02, "load_kN": 0.1}
    )
    root = [
        row_of(one, "curve", "flange root")["share_error"] for one in (small, table)
    ]
    assert 0.0 < root[0] < 0.3 * root[1]


def test_worn_wheels_take_the_place_of_the_new_ones(scene, table):
    worn = wearsim.zone_errors(scene, profiles=wearsim.standard_profile("S1002/h30"))
    assert list(worn.columns) == list(table.columns)
    assert worn["share"].sum() == pytest.approx(1.0, rel=1e-12)


def test_command_prints_blocks_by_zone(scene, capsys):
    words = ["check", str(scene), "--zones", "--error", "shift_mm=0.2"]
    assert cli.main(words) == 0
    out = capsys.readouterr().out
    assert "with the errors shift_mm 0.2, yaw_mrad 0.2, load_kN 1" in out
    first = next(line for line in out.split("\n") if line.startswith("right"))
    assert first.startswith("right flange root  curve")
    assert "100.0 +- 0.0" in first
    assert max(map(len, out.split("\n"))) <= 100
    assert cli.main([*words, "--json"]) == 0
    (rows,) = json.loads(capsys.readouterr().out).values()
    assert {row["block"] for row in rows} == {"centred", "curve"}


def test_a_set_point_without_contact_has_no_value(table):
    table = table.assign(shift_mm=np.nan)
    assert "?" in zone_lines(table, {}, everything=True)[4]


def test_an_error_of_one_side_is_marked(scene):
    """The profiles end before a shift of 48 mm to the right, not to 38 mm left."""
    errors = {"shift_mm": 43.0, "yaw_mrad": 0.01}
    moved = wearsim.zone_errors(scene, errors)
    assert moved["one_sided"].unique().tolist() == ["shift_mm"]
    assert np.isnan(row_of(moved, "curve", "flange root")["shift_mm"])
    assert moved["share_error"].notna().all()
    lines = zone_lines(moved, errors)
    assert any(" ?*  " in line for line in lines)
    assert "* no contact with the set-point moved to one side" in lines[-1]


def test_lines_of_many_set_points_stay_within_100_columns(table):
    """Columns that do not fit follow below, each block named again."""
    keys = ("axle_box_right_kN", "axle_box_left_kN", "friction", "friction_flange")
    errors = dict.fromkeys(keys, 0.05)
    lines = zone_lines(table.assign(**errors), errors)
    assert max(map(len, lines)) <= 100
    for name in ("axle box right", "axle box left", "friction flange"):
        assert any(f"  {name}" in line for line in lines)
    assert sum(line.startswith("right flange root  curve") for line in lines) == 2


def test_faults_name_key_and_kind(scene, capsys):
    with pytest.raises(SceneError, match="no block has the set-point shift_mean_mm"):
        wearsim.zone_errors(scene, {"shift_mean_mm": 0.1})
    with pytest.raises(SceneError, match="must be above 0"):
        wearsim.zone_errors(scene, {"shift_mm": -0.1})
    for key in ("name", "distance_km", "positions", "environment"):
        allowed = "give shift_mm, yaw_mrad, roll_mrad, load_kN, speed_km_h, friction$"
        with pytest.raises(SceneError, match=f"the set-point {key}; {allowed}"):
            wearsim.zone_errors(scene, {key: 0.5})
    with pytest.raises(SceneError, match=r"load_kN=100 .* load_kN = -20 must be at le"):
        wearsim.zone_errors(scene, {"load_kN": 100.0})
    for words, text in (
        (["--zones", "--error", "shift_mm"], "write KEY=VALUE with a number"),
        (["--error", "shift_mm=0.2"], "--error is for --zones"),
    ):
        assert cli.main(["check", str(scene), *words]) == 2
        assert text in capsys.readouterr().err


RECORD = """\
[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
[contact]
model = "fast"
strips = 10
cells = 10
[recorded]
file = "run.csv"
shift_positive = "right"
yaw_positive = "right"
friction = 0.3
[recorded.columns]
distance_m = "s"
speed_km_h = "v"
shift_mm = "y"
yaw_mrad = "psi"
wheel_load_right_kN = "QR"
wheel_load_left_kN = "QL"
[campaign]
distance_km = 10
"""
"""A record; of its four samples each is an operating point."""


def recorded(folder, shift):
    """Scene of the record with all shifts [mm] moved."""
    samples = ((0, 1.0, 0), (100, 6.2, 4), (200, -0.5, 0), (300, 6.4, 5))
    rows = [f"{s},80,{y + shift},{psi},60,55" for s, y, psi in samples]
    (folder / "run.csv").write_text("\n".join(["s,v,y,psi,QR,QL", *rows]))
    (folder / "field.toml").write_text(RECORD)
    return folder / "field.toml"


def area_of_tread(scene):
    """Worn area of the right tread by all samples but those on the flange."""
    rate = wearsim.wear_rate(scene).sel(wheel="right")
    rate = rate.sel(operating_point=rate.operating_point.str.startswith("tread"))
    y, depth = rate["profile_y"].values, rate["wear_depth_rate"].sum("regime").values
    inside = (y >= WHEEL_ZONES["flange root"]) & (y < WHEEL_ZONES["tread"])
    area = (depth * np.gradient(rate["arc_length"].values))[:, inside].sum(axis=1)
    return float((area * rate["weight"].values).sum())


def test_samples_of_a_record_are_moved_like_the_record(tmp_path):
    table = wearsim.zone_errors(recorded(tmp_path, 0.0), {"shift_mm": 0.2})
    assert {*table["block"]} == {"tread", "right flange"}
    assert table["share"].sum() == pytest.approx(1.0, rel=1e-12)
    base, moved = (area_of_tread(recorded(tmp_path, shift)) for shift in (0.0, 0.2))
    row = row_of(table, "tread", "tread")
    assert row["shift_mm"] == pytest.approx(moved / base - 1.0, rel=5e-3)
    names = ["shift_mm", "yaw_mrad", "wheel_load_right_kN", "wheel_load_left_kN"]
    assert [name for name in table.columns if name in SET_POINTS] == names
    with pytest.raises(SceneError, match='moves "tread" out of the range'):
        wearsim.zone_errors(recorded(tmp_path, 0.0), {"wheel_load_left_kN": 56.0})


@pytest.mark.slow
def test_segments_of_a_route_have_the_errors_of_the_same_classes(tmp_path):
    """Two segments of one curve are the class of it."""
    (tmp_path / "line.csv").write_text(
        "name,length_km,speed_km_h,friction,friction_flange,environment,curve_radius_m,"
        "cant_deficiency_mm,shift_std_mm\na,6,120,0.35,,1,,,1.5\n"
        "b,1,90,0.35,0.15,0.5,-600,50,\nc,3,90,0.35,0.15,0.5,-600,50,\n"
    )
    before, _, rest = VEHICLE.read_text().partition("[[vehicle.class]]")
    after = rest[rest.index("[campaign]") :]
    route = tmp_path / "route.toml"
    route.write_text(f'{before}route = "line.csv"\n{after}')
    errors = {"cant_deficiency_mm": 20.0, "friction": 0.05, "shift_std_mm": 0.5}
    classes, segments = (
        wearsim.zone_errors(scene, errors).sort_values(["zone", "wheel", "share"])
        for scene in (VEHICLE, route)
    )
    for name in ("share", "of_zone_error", *errors):
        np.testing.assert_allclose(segments[name], classes[name], rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_classes_of_a_vehicle_have_errors_of_cant_and_motion():
    """The change is that of the wear rate with another cant deficiency in the scene;
    lengths of the profile at its points differ by their formulas, which nearly cancels.
    """
    table = wearsim.zone_errors(VEHICLE, {"cant_deficiency_mm": 20.0})
    assert table["share"].sum() == pytest.approx(1.0, rel=1e-12)
    worn = []
    for deficiency in (50, 70):
        keys = {"vehicle.class.curve.cant_deficiency_mm": deficiency}
        rate = wearsim.wear_rate(wearsim.load_scene(VEHICLE, overrides=keys))
        acting = rate.weight * rate.operating_point.str.endswith("trailing")
        depth = (rate.wear_depth_rate.sum("regime") * acting).sum("operating_point")
        y, side = rate["profile_y"].values[1], depth.sel(wheel="left").values
        low, high = WHEEL_ZONES["flange root"], WHEEL_ZONES["tread"]
        length = np.gradient(rate["arc_length"].values[1])
        worn.append(float((side * length)[(y >= low) & (y < high)].sum()))
    tread = row_of(table, "curve trailing", "tread", "left")
    expected = worn[1] / worn[0] - 1.0
    assert tread["cant_deficiency_mm"] == pytest.approx(expected, rel=0.02, abs=1e-4)
