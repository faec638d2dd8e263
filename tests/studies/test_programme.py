"""Rig programmes by design: error, limits, files, targets."""

import numpy as np
import pytest
import xarray as xr

import wearsim
from wearsim.errors import ResultError, SceneError
from wearsim.report.programme import programme_lines
from wearsim.scene import build, load_scene
from wearsim.scene.rig import BlockSection
from wearsim.scene.section import read_rows
from wearsim.scene.set_points import set_points
from wearsim.studies.candidates import candidates_of
from wearsim.studies.copies import nearest_crossings

RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
COMMON = {
    "wheelset": {"profile": "S1002"},
    "contact": {"model": "fast", "strips": 10, "cells": 10},
    "campaign": {"distance_km": 300.0, "point_spacing_mm": 1.0},
}
CLASS = {"shift_mean_mm": 0, "shift_std_mm": 1.2, "positions": 10, "share": 1}
FIELD = COMMON | {
    "scene": {"kind": "field", "title": "short field"},
    "counterface": {"profile": "60E1", "inclination": "1:40"},
    "operation": {"class": [{"name": "tangent", **CLASS, **RUNNING}]},
}
RIG = COMMON | {
    "scene": {"kind": "rig"},
    "counterface": {
        "profile": "60E1",
        "inclination": "1:40",
        "rig": "full_scale",
    },
    "operation": {"block": [{"name": "a", "shift_mm": 0, "distance_km": 1, **RUNNING}]},
    "programme": {
        "shift_mm": 4.25,
        "shift_step_mm": 0.5,
        "yaws_mrad": [-1, 0, 1],
        "loads_kN": [50, 80],
        "blocks": 0,
        "guard": 0,
        "tolerance": 0.1,
    },
}


FEW = {"yaws_mrad": [0], "loads_kN": [80], "ramps": False}


def changed(**programme):
    return RIG | {"programme": RIG["programme"] | programme}


@pytest.fixture(scope="module")
def field(tmp_path_factory):
    """Field campaign some 10 um deep."""
    (path,) = wearsim.run(FIELD, tmp_path_factory.mktemp("field"), threads=1)
    return path


@pytest.fixture(scope="module")
def made(field, tmp_path_factory):
    """Programme for it, and its folder."""
    out = tmp_path_factory.mktemp("designed")
    return wearsim.programme(RIG, field, out), out


def test_the_programme_wears_the_pattern_faster_than_the_copy(made, field):
    data, _ = made
    with wearsim.open_results(field) as result:
        np.testing.assert_allclose(
            data["target"], result["wear_depth"][-1], rtol=1e-9, atol=1e-12
        )
    beyond = data["kept_error"] > data["tolerance"] * (1.0 + 1e-6)
    warned = [line for line in data.attrs["warnings"].split("\n") if line]
    assert len(warned) == int(beyond.sum())
    # the tolerance, and what linear wear leaves out
    error = np.abs(data["depth"] - data["target"]).max() / data["target"].max()
    assert error == pytest.approx(data.attrs["largest_error"], rel=1e-9)
    assert error < 0.35
    assert data.attrs["acceleration"] > data.attrs["copy_acceleration"]
    assert data["copy"].max() == pytest.approx(float(data["target"].max()), rel=0.01)


def test_acceleration_is_split_into_environment_and_mechanism(made):
    attrs = made[0].attrs
    assert attrs["acceleration_environment"] == pytest.approx(1.0)
    assert attrs["acceleration"] == pytest.approx(attrs["acceleration_mechanism"])
    assert attrs["acceleration"] == pytest.approx(300e3 / attrs["rig_distance"])


def test_the_files_run_and_wear_what_was_designed(made):
    data, out = made
    stages = int((data["blocks"] > 0).sum())
    assert len(list(out.glob("stage*.toml"))) == stages >= 1
    total = np.zeros_like(data["depth"].values)
    for name in sorted(path.stem for path in out.glob("stage*.toml")):
        (path,) = wearsim.run(out / f"{name}.toml", out / name, threads=1)
        with wearsim.open_results(path) as run:
            y, depth = run["profile_y"].values[0], run["wear_depth"].values[-1]
        for k in (0, 1):
            total[k] += np.interp(data["profile_y"].values[k], y[k], depth[k])
    # worn wheels of results get new points
    np.testing.assert_allclose(total, data["depth"], atol=0.03 * total.max())
    whole = read_rows(out / "programme.csv", BlockSection, "block")
    run = sum(block.distance_km for block in whole)
    assert run == pytest.approx(1e-3 * data.attrs["rig_distance"], rel=1e-2)
    with xr.open_dataset(out / "programme.nc") as stored:
        np.testing.assert_array_equal(stored["depth"], data["depth"])


def test_no_block_is_beyond_the_limits(made):
    data, _ = made
    for name in ("shift_begin", "shift_end"):
        assert np.abs(data[name]).max() <= 4.25e-3 + 1e-12
    assert np.abs(data["yaw"]).max() <= 1e-3
    assert set(data["wheel_load"].values) <= {50e3, 80e3}


def test_few_blocks_keep_to_their_number(field):
    data = wearsim.programme(changed(blocks=3, **FEW), field)
    assert data["blocks"].max() <= 3
    errors = data["blocks_error"].values
    assert (np.diff(errors) <= 1e-9).all()


def test_a_guard_costs_distance_or_error(field):
    data = wearsim.programme(changed(guard=1.2, yaws_mrad=[0]), field)
    text = " ".join(programme_lines(data))
    limited = "in each zone pressure, pressure over its shakedown limit and wear index"
    assert f"{limited} at most 1.2 times those of the field, and the share" in text
    free = data["guard_error"].sel(guard=0.0)
    assert (data["guard_error"] >= free - 1e-9).all()
    costs = (data["guard_error"] > 1.001 * free) | (
        data["guard_rig_distance"] > 1.001 * data["guard_rig_distance"].sel(guard=0.0)
    )
    assert bool(costs.any())


def test_what_cannot_be_reproduced_is_named_with_place_and_reason(field):
    narrow = {"shift_mm": 0.75, "yaws_mrad": [0]}
    data = wearsim.programme(changed(**narrow), field)
    assert data.attrs["largest_error"] > 0.1
    lines = data.attrs["missed"].splitlines()
    assert any("too shallow; no set-point within the limits" in line for line in lines)
    assert "out of reach" in data.attrs["warnings"]
    assert "shift at its largest, 0.5 mm" in data.attrs["limits"]


def test_a_worn_wheel_is_a_target_without_mechanism(field):
    worn = tuple(wearsim.worn_profile(field, side) for side in ("right", "left"))
    data = wearsim.programme(changed(**FEW), worn)
    with wearsim.open_results(field) as result:
        depth = result["wear_depth"].values[-1]
    assert np.abs(data["target"] - depth).max() < 0.05 * depth.max()
    assert np.isnan(data.attrs["acceleration"])
    assert data.attrs["copy_reason"]
    with pytest.raises(SceneError, match="a worn wheel has no pressures to guard"):
        wearsim.programme(changed(guard=1.5), worn)


@pytest.mark.parametrize(
    ("wheel", "message"),
    [("S1002/h30", "off the new wheel of the rig"), ("S1002", "did not wear")],
)
def test_targets_that_do_not_fit_are_refused(wheel, message, field):
    with wearsim.open_results(field) as data:
        target = data.load() if wheel != "S1002" else data.isel(step=[0]).load()
    rig = RIG | {"wheelset": {"profile": wheel}}
    with pytest.raises(ResultError, match=message):
        wearsim.programme(rig, target)


def test_regimes_of_another_law_than_that_of_the_rig_are_refused(field):
    """Both laws have three regimes, of which only two have the same name."""
    rig = changed(guard=1.5) | {"wear": {"law": "brr"}}
    with pytest.raises(ResultError, match="severe, catastrophic in the field and mild"):
        wearsim.programme(rig, field)


def test_the_scene_must_be_that_of_a_rig(field):
    with pytest.raises(SceneError, match="give a scene of kind rig"):
        wearsim.programme(FIELD, field)


def test_set_points_by_lateral_force_run_where_it_balances(field, tmp_path):
    forces = {"lateral_force_kN": 20, "yaws_mrad": [-1, 0, 1], "loads_kN": [50, 80]}
    kept = {key: RIG["programme"][key] for key in ("guard", "tolerance")}
    data = wearsim.programme(RIG | {"programme": kept | forces}, field, tmp_path)
    assert set(np.abs(data["lateral_force_begin"].values)) <= {0.0, 10e3, 20e3}
    np.testing.assert_array_equal(
        data["lateral_force_begin"], data["lateral_force_end"]
    )
    assert "control the lateral force" in data.attrs["copy_reason"]
    assert data.attrs["copy_forces_error"] > 0.0
    blocks = read_rows(tmp_path / "programme.csv", BlockSection, "block")
    assert {block.shift_mm for block in blocks} == {None}
    assert {abs(block.lateral_force_kN) for block in blocks} <= {0.0, 10.0, 20.0}


def test_a_target_out_of_reach_is_refused_with_zone_and_reason(field):
    """Its wear is 25 mm off the place of all contacts of one set-point."""
    fixed = {"shift_mm": 0.2, "yaws_mrad": [0], "loads_kN": [80], "guard": 0}
    with wearsim.open_results(field) as data:
        moved = data.load()
    moved["wear_depth"].values[:] = np.roll(moved["wear_depth"].values, 50, axis=-1)
    reason = "too shallow; no set-point within the limits wears there"
    # both wheels differ in the last bits alone, by processor
    with pytest.raises(SceneError, match=f"(left|right) wheel, y = .* {reason}"):
        wearsim.programme(changed(**fixed), moved)


def test_worn_rollers_are_those_of_the_campaign_that_runs_the_programme(
    field, tmp_path
):
    rollers = RIG["counterface"] | {"wear": {"factor": 2.0}}
    rig = changed(tolerance=0.3) | {"counterface": rollers}
    data = wearsim.programme(rig, field, tmp_path)
    assert not list(tmp_path.glob("stage*"))
    (path,) = wearsim.run(tmp_path / "programme.toml", tmp_path / "run", threads=1)
    with wearsim.open_results(path) as run:
        depth = run["wear_depth"].values[-1]
    assert np.abs(depth - data["depth"]).max() < 0.02 * depth.max()


def test_torque_of_the_blocks_is_that_of_the_programme(tmp_path, field):
    driven = RIG["operation"]["block"][0] | {"axle_torque_kN_m": 2.0}
    rig = RIG | {"operation": {"block": [driven]}}
    scene = load_scene(rig)
    conditions = candidates_of(set_points(scene)).points(scene).conditions
    np.testing.assert_allclose(conditions.torque, 2e3)
    coarse = changed(tolerance=0.5) | {"operation": {"block": [driven]}}
    wearsim.programme(coarse, field, tmp_path)
    blocks = read_rows(tmp_path / "programme.csv", BlockSection, "block")
    assert {block.axle_torque_kN_m for block in blocks} == {2.0}


def test_a_curve_has_a_value_at_the_nearest_crossing_or_where_it_is_nearest():
    at = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    values = np.array([[0.0, 2.0, 0.0, 2.0, np.nan], [0.0, 1.0, 2.0, 3.0, 2.0]])
    wanted, near = np.array([1.0, 9.0]), np.array([0.2, 0.0])
    np.testing.assert_allclose(nearest_crossings(at, values, wanted, near), [0.5, 1.0])


def test_a_ramp_is_the_mean_of_its_shifts_and_ends_half_a_step_beyond():
    values = set_points(load_scene(RIG))
    candidates = candidates_of(values)
    grid = np.random.default_rng(2).random((values.lateral.size, 3, 2, 4))
    means = candidates.means(grid.reshape(-1, 4))
    k = int(np.flatnonzero(candidates.last - candidates.first == 3)[5])
    first, last = candidates.first[k], candidates.last[k]
    part = grid[first : last + 1, candidates.yaw[k], candidates.load[k]]
    np.testing.assert_allclose(means[k], part.mean(axis=0), rtol=1e-12)
    low, high = candidates.lateral(k)
    assert low == pytest.approx(values.lateral[first] - 0.25e-3)
    assert high == pytest.approx(values.lateral[last] + 0.25e-3)
    single = int(np.flatnonzero(candidates.first == candidates.last)[7])
    assert candidates.lateral(single)[0] == candidates.lateral(single)[1]


def test_candidates_on_coupled_rollers_of_unlike_radii_run_at_unlike_speeds():
    unlike = {"rig": "scaled", "gauge_mm": 1435, "roller_radius_left_mm": 510}
    unlike["roller_radius_mm"] = 500
    block = [{"name": "a", "shift_mm": 0, "distance_km": 1, **RUNNING, "load_kN": 20}]
    programme = RIG["programme"] | {"loads_kN": [20], "shift_mm": 2}
    tables = RIG | {"counterface": RIG["counterface"] | unlike}
    tables |= {"operation": {"block": block}, "programme": programme}
    scene = load_scene(tables)
    conditions = candidates_of(set_points(scene)).points(scene).conditions
    expected = build(scene).points.conditions.speed_difference[0]
    assert expected != 0.0
    np.testing.assert_allclose(conditions.speed_difference, expected)
