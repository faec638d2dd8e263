"""Wheels and rails of a scene that are no files: `Profile` objects, and the worn wheels
of a result.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

import wearsim
from wearsim.errors import SceneError
from wearsim.scene import build, files_to_copy, load_scene
from wearsim.scene.inputs import inputs_of
from wearsim.scene.overrides import toml_text
from wearsim.translation.worn_wheel import worn_wheel

RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
SCENE = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "contact": {"model": "fast", "strips": 10, "cells": 10},
    "operation": {
        "block": [{"name": "right", "shift_mm": 3, "distance_km": 1, **RUNNING}]
    },
    "campaign": {"distance_km": 2.0, "max_step_km": 1.0},
}


def scene(**tables):
    return SCENE | {name: SCENE.get(name, {}) | table for name, table in tables.items()}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    (path,) = wearsim.run(
        scene(wheelset={"radius_mm": 450}), tmp_path_factory.mktemp("run") / "out"
    )
    return path


@pytest.fixture
def worn(result):
    """Right wheel at the end."""
    with wearsim.open_results(result) as data:
        last = data.sel(wheel="right").isel(step=-1)
        return wearsim.Profile(
            "my wheel/2", "wheel", last["profile_y"].values, last["profile_z"].values
        )


def points_of(given):
    inputs = inputs_of(given)
    return [(wheel.y, wheel.z) for wheel in (inputs.right, inputs.left)]


def test_a_profile_of_python_is_the_file_that_it_is_exported_to(worn, tmp_path):
    wearsim.export_profile(worn, tmp_path / "own.csv")
    given = load_scene(scene(wheelset={"profile": worn}))
    from_file = load_scene(scene(wheelset={"profile": tmp_path / "own.csv"}))
    np.testing.assert_array_equal(points_of(given), points_of(from_file))
    assert given.wheelset.profile == "my_wheel_2.csv"
    assert files_to_copy(given)["my_wheel_2.csv"] == (tmp_path / "own.csv").read_bytes()


def test_a_run_of_a_profile_resumes_and_repeats(worn, tmp_path):
    """Its copy stands in the run directory; the same points in another object are the
    same campaign.
    """
    tables, out = (
        scene(wheelset={"profile": worn, "profile_left": worn}),
        tmp_path / "out",
    )
    (path,) = wearsim.run(tables, out)
    again = scene(wheelset={"profile": replace(worn), "profile_left": replace(worn)})
    assert (
        wearsim.run(tables, out)
        == wearsim.resume(out, overrides={"campaign.distance_km": 3})
        == (path,)
    )
    assert (out / "scene" / "my_wheel_2.csv").is_file()
    with wearsim.open_results(path) as data:
        assert data.attrs["wheel_profile_right"] == "my_wheel_2"
        assert float(data["distance"][-1]) == 3000.0
    with pytest.raises(wearsim.WearsimError, match="belongs to another campaign"):
        wearsim.run(
            scene(
                wheelset={
                    "profile": replace(again["wheelset"]["profile"], z=worn.z - 1e-5)
                }
            ),
            out,
        )


def test_names_of_profiles_do_not_collide(worn, tmp_path, monkeypatch):
    """With one another, nor with files of those names."""
    monkeypatch.chdir(tmp_path)
    other = replace(worn, name="my wheel:2", z=worn.z - 1e-4)
    wearsim.export_profile(wearsim.standard_profile("S1002"), "my_wheel_2.csv")
    given = load_scene(scene(wheelset={"profile": worn, "profile_left": other}))
    right, left = points_of(given)
    np.testing.assert_allclose(right[1] - left[1], 1e-4, atol=1e-9)
    assert given.wheelset.profile_left == "my_wheel_2-2.csv"
    named = load_scene(
        scene(wheelset={"profile": worn, "profile_left": "my_wheel_2.csv"})
    )
    assert named.wheelset.profile == "my_wheel_2-2.csv"
    assert np.ptp(points_of(named)[1][1] - points_of(named)[0][1]) > 0.0


def test_a_rail_of_python_stands_as_it_was_placed():
    rail = wearsim.standard_profile("60E1", inclination=1 / 40)
    placed = build(load_scene(scene(counterface={"profile": rail}))).counterface.profile
    np.testing.assert_allclose(placed.z.min(), 0.0, atol=1e-7)
    np.testing.assert_allclose(np.interp(placed.y, rail.y, rail.z), placed.z, atol=2e-6)


def test_a_profile_among_overrides():
    smaller = replace(wearsim.standard_profile("S1002/e30.5"), name="thin")
    given = load_scene(SCENE, overrides={"wheelset.profile": smaller})
    assert given.wheelset.profile == "thin.csv"
    assert inputs_of(given).right.name == "thin"


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (
            {"wheelset": {"profile": wearsim.standard_profile("60E1")}},
            "wheelset.profile: .* a wheel profile",
        ),
        (
            {"counterface": {"profile": wearsim.standard_profile("S1002")}},
            "counterface.profile: .* a rail",
        ),
        (
            {"scene": {"title": wearsim.standard_profile("S1002")}},
            "scene.title is a Profile; give a number",
        ),
        (
            {"wheelset": {"at_km": 5}},
            "wheelset.at_km: at_km picks a state of a result file .* delete it",
        ),
        (
            {"wheelset": {"profile": "none.nc"}},
            "wheelset.profile: [^\\n]*there is no such file[^\\n]*$",
        ),
    ],
)
def test_what_is_no_wheel_or_rail_is_a_fault_of_its_key(tables, message):
    with pytest.raises(SceneError, match=f"^{message}"):
        load_scene(scene(**tables))


def test_both_worn_wheels_of_a_result(result, tmp_path):
    """At a distance between two stored states and at the end, with the radius they
    belong to.
    """
    for at_km, wheelset in ((1.5, {"at_km": 1.5}), (2.0, {})):
        given = load_scene(scene(wheelset={"profile": result, **wheelset}))
        assert given.wheelset.radius_mm == 450.0
        for side, wheel in zip(("right", "left"), points_of(given), strict=True):
            own = worn_wheel(result, side, 1e3 * at_km).profile
            np.testing.assert_allclose(
                np.interp(wheel[0], own.y, own.z), wheel[1], atol=1e-6
            )
        copied = files_to_copy(given)
        assert f"rig_right_{at_km:g}km.whl" in copied
        assert all(len(content) < 200_000 for content in copied.values())
    assert not np.array_equal(*points_of(given))


def test_a_campaign_on_worn_wheels_goes_on_from_its_copy_without_the_result(
    result, tmp_path
):
    copy = tmp_path / "before.nc"
    copy.write_bytes(result.read_bytes())
    (tmp_path / "next.toml").write_text(
        toml_text(
            scene(
                wheelset={"profile": "before.nc"},
                campaign={"distance_km": 1.0, "max_step_km": 1.0},
            )
        )
    )
    (path,) = wearsim.run(tmp_path / "next.toml", tmp_path / "out")
    copy.unlink()
    assert wearsim.resume(
        tmp_path / "out", overrides={"campaign.distance_km": 2.0}
    ) == (path,)
    with wearsim.open_results(path) as data:
        assert data.attrs["wheel_radius"] == 0.45
        assert data.attrs["wheel_profile_left"] == "before_left_2km"
        begun = data.sel(wheel="right").isel(step=0)
        own = worn_wheel(result, "right").profile
        np.testing.assert_allclose(
            np.interp(begun["profile_y"], own.y, own.z), begun["profile_z"], atol=1e-6
        )


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (
            {"wheelset": {"at_km": 7.0}},
            "at_km = 7 must be 0 to 2 km, the distance run in",
        ),
        (
            {"counterface": {"profile": "RESULT"}},
            "a result file has worn wheels; name it as profile in",
        ),
    ],
)
def test_a_result_that_does_not_give_what_is_asked_is_a_fault(result, tables, message):
    tables = {"wheelset": {"profile": result}} | tables
    named = {
        name: {
            key: result if value == "RESULT" else value for key, value in table.items()
        }
        for name, table in tables.items()
    }
    named["wheelset"] = {"profile": result} | named["wheelset"]
    with pytest.raises(SceneError, match=re.escape(message)):
        load_scene(scene(**named))
