"""`wearsim programme`: what it prints and writes, and what it refuses."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import wearsim
from wearsim.cli import main
from wearsim.scene.overrides import toml_text
from wearsim.texts import WIDTH

RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
COMMON = {
    "wheelset": {"profile": "S1002"},
    "contact": {"model": "fast", "strips": 10, "cells": 10},
    "campaign": {"distance_km": 100.0, "point_spacing_mm": 1.0},
}
CLASS = {"shift_mean_mm": 0, "shift_std_mm": 1.2, "positions": 10, "share": 1}
FIELD = COMMON | {
    "scene": {"kind": "field", "title": "short field"},
    "counterface": {"profile": "60E1", "inclination": "1:40"},
    "operation": {
        "class": [{"name": "tangent", "environment": 0.5, **CLASS, **RUNNING}]
    },
}
RIG = COMMON | {
    "scene": {"kind": "rig"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "rig": "full_scale"},
    "operation": {"block": [{"name": "a", "shift_mm": 0, "distance_km": 1, **RUNNING}]},
    "programme": {
        "shift_mm": 4.5,
        "shift_step_mm": 1.0,
        "yaws_mrad": [0],
        "loads_kN": [50, 80],
        "blocks": 6,
        "tolerance": 0.3,
    },
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Scene of a rig, and the result of a field campaign."""
    folder = tmp_path_factory.mktemp("programme")
    (folder / "rig.toml").write_text(toml_text(RIG))
    wearsim.run(FIELD, folder / "field", threads=1)
    return folder


def words(folder, *more, rigs=("rig.toml",)):
    target = str(folder / "field" / "field.nc")
    scenes = [str(folder / name) for name in rigs]
    return ["programme", *scenes, "--target", target, *more]


def test_a_programme_is_designed_and_reported(folder, capsys, drawing):
    out = folder / "designed"
    assert main([*words(folder, "--at-km", "80"), "--out", str(out)]) == 0
    told, progress = capsys.readouterr()
    assert progress.startswith("stage 1: to ")
    assert "km on the rig wear like 80 km of short field" in told
    assert "the environment factor makes 2.00" in told
    assert "Copying shift, yaw and load of the field" in told
    written = {path.name for path in out.iterdir()}
    files = {"programme.csv", "programme.nc", "report.html", "stage1.csv"}
    assert files | {"stage1.toml"} <= written
    report = (out / "report.html").read_text(encoding="utf-8")
    for part in ("figure-programme", "Stages", "All blocks", "Price of the guard"):
        assert part in report


def test_json_holds_the_figures(folder, capsys):
    assert main([*words(folder, "--json", "--quiet"), "--out", str(folder / "b")]) == 0
    told, progress = capsys.readouterr()
    assert progress == ""
    held = json.loads(told)
    split = held["acceleration_environment"] * held["acceleration_mechanism"]
    assert held["acceleration"] == pytest.approx(split)


def test_several_rigs_stand_in_one_table(folder, capsys):
    large = RIG | {"counterface": RIG["counterface"] | {"roller_radius_mm": 2000}}
    (folder / "large.toml").write_text(toml_text(large))
    out = folder / "rigs"
    rigs = ("rig.toml", "large.toml")
    assert main(words(folder, "--quiet", "--out", str(out), rigs=rigs)) == 0
    told = capsys.readouterr().out
    head, *rows = told.splitlines()
    assert head.split()[:3] == ["rig", "largest", "error"]
    assert [row.split()[0] for row in rows[:2]] == ["rig", "large"]
    assert all(len(line) <= WIDTH for line in rows[:2])
    table = pd.read_csv(out / "rigs.csv").set_index("rig")
    for name in ("rig", "large"):
        with xr.open_dataset(out / name / "programme.nc") as held:
            assert table.loc[name, "largest_error"] == pytest.approx(
                held.attrs["largest_error"]
            )
        assert (out / name / "stage1.toml").exists()
        assert (out / name / "report.html").exists()


def test_a_rig_that_fails_stands_in_the_table(folder, capsys):
    """Its wheel is not that of the field."""
    other = RIG | {"wheelset": {"profile": "S1002/h30"}}
    (folder / "apart.toml").write_text(toml_text(other))
    out = folder / "failed"
    flags = ("--quiet", "--json", "--out", str(out))
    code = main(words(folder, *flags, rigs=("rig.toml", "apart.toml")))
    told, fault = capsys.readouterr()
    assert code != 0
    assert fault.startswith("apart: ")
    held = json.loads(told)
    assert "largest_error" in held["rig"]
    assert held["apart"]["fault"]
    table = pd.read_csv(out / "rigs.csv").set_index("rig")
    assert table.loc["apart", "fault"] == held["apart"]["fault"]
    assert np.isnan(table.loc["apart", "largest_error"])


def test_rigs_of_one_name_and_all_their_faults_are_told(folder, capsys):
    (folder / "other").mkdir()
    (folder / "other" / "rig.toml").write_text(toml_text(FIELD))
    rigs = ("rig.toml", "other/rig.toml")
    assert main(words(folder, "--out", str(folder / "d"), rigs=rigs)) == 2
    told = capsys.readouterr().err
    assert "is a second file named rig" in told
    assert "give a scene of kind rig" in told
    assert not (folder / "d").exists()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--at-km", "200"], "must be 0 to 100000 m, the distance run"),
        (["--set", "programme.yaws_mrad=[0,50]"], "beyond the rig, whose limit is 40"),
        (["--set", "programme.shift_step_mm=9"], "shift_step_mm = 9 must be"),
    ],
)
def test_faults_are_lines_and_exit_code_2(more, message, folder, capsys):
    assert main([*words(folder, *more), "--out", str(folder / "c")]) == 2
    assert message in capsys.readouterr().err
    assert not (folder / "c").exists()
