"""Bands of a small comparison: run by draws, continued, read by report and
translate.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wearsim.cli as cli
from wearsim import translation
from wearsim.campaign.directory import locked
from wearsim.campaign.run import resume, run_scene
from wearsim.errors import ResultError, SceneError
from wearsim.report.html import render
from wearsim.results import load_results
from wearsim.scene.overrides import Override
from wearsim.studies.bands import plan_of, run_bands
from wearsim.studies.ensemble import Runner, check_cases

DATA = Path(__file__).parents[1] / "data"
SMALL = '[contact]\nmodel = "fast"\nstrips = 8\ncells = 8\n[wear]\nlaw = "energy"\n'
STEEL = """
[uncertainty]
draws = 16
[[uncertainty.input]]
name = "steel"
key = "operation.environment"
acts = "factor"
shared = true
distribution = "lognormal"
median = 1.0
within = 1.5
"""
OTHER = (
    '[[uncertainty.material]]\nname = "twice"\n'
    "wear = {energy_coefficient_mm3_kJ = 0.12}\n"
)


def write(folder, kind, km, more=""):
    """Coarse scene of a linear law."""
    text = (DATA / f"scene_{kind}.toml").read_text()
    tables, operation = text.split("[campaign]", 1)[0].split("[[operation", 1)
    text = f"{tables}{SMALL}energy_coefficient_mm3_kJ = 0.06\n[[operation{operation}"
    text += (
        f"[campaign]\ndistance_km = {km}\npoint_spacing_mm = 0.5\n"
        "error_tolerance_um = 0.05\n"
    )
    (folder / f"{kind}.toml").write_text(text + more)
    return folder / f"{kind}.toml"


@pytest.mark.slow
def test_a_shared_linear_coefficient_cancels(tmp_path, capsys):
    """Nothing is left of it in km for km; a draw that is lost is run again, with the
    same bits.
    """
    for kind, km in (("rig", 4), ("field", 16)):
        write(tmp_path, kind, km)
    scene, out = tmp_path / "compare.toml", tmp_path / "out"
    compare = (
        '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\nfield = "field.toml"\n'
    )
    scene.write_text(compare + STEEL)
    command = ["run", str(scene), "--out", str(out), "--bands", "--jobs", "2"]
    assert cli.main(command) == 0
    assert "Bands of 16 draws" in capsys.readouterr().out
    with xr.open_dataset(out / "bands.nc") as stored:
        bands = stored.load()
    per_km = bands["field_distance_per_rig_distance_by_area_band"].values[:, 1:]
    known = np.isfinite(per_km).all(axis=0)
    assert known.sum() > 10
    # what is left is the error of the wear steps
    assert np.ptp(per_km[:, known], axis=0).max() < 0.01 * per_km[1, known].min()
    low, middle, high = bands["rig_worn_area_band"].values[:, -1, -1]
    assert high / middle == pytest.approx(1.5, rel=0.15)
    assert middle / low == pytest.approx(1.5, rel=0.15)
    assert bands["rig_worn_area"].values[-1, -1] == pytest.approx(middle, rel=0.05)
    assert 'id="bands"' in (out / "report.html").read_text()
    shutil.rmtree(out / "bands" / "case_0003")
    again, _ = run_bands(scene, out, Runner(jobs=1))
    for name in bands.data_vars:
        np.testing.assert_array_equal(again[name].values, bands[name].values)
    capsys.readouterr()
    words = ["translate", str(out / "rig.nc"), str(out / "field.nc")]
    assert cli.main(words) == 0
    assert "\n90 % of the draws: " in capsys.readouterr().out
    assert cli.main([*words, "--all"]) == 0
    assert "Bands of the draws" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("by", ["scene", "resume"])
def test_draws_follow_a_campaign_that_is_made_longer(tmp_path, by):
    scene, out = write(tmp_path, "rig", 1, STEEL), tmp_path / "out"
    run_scene(scene, out)
    run_bands(scene, out, Runner(jobs=1))
    if by == "scene":
        run_scene(write(tmp_path, "rig", 2, STEEL), out)
    else:
        resume(out, overrides=[Override("campaign.distance_km", 2)])
    made, _ = run_bands(scene, out, Runner(jobs=1))
    ends = [
        float(load_results(path)["distance"][-1])
        for path in out.glob("bands/case_*/rig.nc")
    ]
    assert ends == [2000.0] * 16
    assert made.attrs["draws"] == 16


@pytest.mark.slow
def test_steels_are_ranked_in_the_same_draws(tmp_path):
    """Twice the coefficient of a linear law wears twice as much, within the change of
    the profile.
    """
    scene = write(tmp_path, "rig", 4, STEEL + OTHER)
    run_scene(scene, tmp_path / "out")
    bands, ranked = run_bands(scene, tmp_path / "out")
    (steel,) = ranked.to_dict("records")
    assert steel["steel"] == "twice"
    assert steel["rig, 50%"] == pytest.approx(2.0, rel=0.03)
    assert "order survives" not in steel  # of one campaign
    assert bands["rig_max_wear_depth_sensitivity"].attrs["kind"] == "share of variance"
    assert (tmp_path / "out" / "materials.csv").is_file()
    # an input that no scene can have names itself before anything is run
    wide = tmp_path / "wide.toml"
    wide.write_text(scene.read_text().replace("within = 1.5", "within = 90.0"))
    with pytest.raises(SceneError, match="environment"):
        run_bands(wide, tmp_path / "out")


def test_status_counts_the_draws_of_bands(tmp_path, capsys):
    """A draw counts with all its steels; run directories of the draws are made of that
    of the scene here.
    """
    scene, out = write(tmp_path, "rig", 1, STEEL + OTHER), tmp_path / "out"
    text = scene.read_text()
    scene.write_text(text.replace("error_tolerance_um = 0.05", "max_step_km = 1"))
    whole = tmp_path / "whole"
    run_scene(scene, out, command=f"wearsim run {scene} --out {out} --bands")
    shutil.copytree(out, whole)

    def told(*words):
        capsys.readouterr()
        assert cli.main(["status", str(out), *words]) == 0
        return capsys.readouterr().out

    assert told().endswith("bands: not begun, 0 of 16 draws done\n")
    for number in (1, 2, 3, 4, 5):
        shutil.copytree(whole, out / "bands" / f"case_{number:04d}")
    advice = "nobody works on the draws; the same command again continues them\n"
    assert told().endswith(f"bands: stopped, 2 of 16 draws done\n{advice}")
    assert json.loads(told("--json"))["bands"] == {
        "state": "stopped",
        "draws": 16,
        "done": 2,
        "failed": 0,
    }
    with locked(out / "bands"):
        assert told().endswith("bands: running, 2 of 16 draws done\n")
        with pytest.raises(ResultError, match=r"another wearsim run works in .*bands"):
            run_bands(scene, out)
    shutil.copytree(whole, out / "bands" / "case_0033")  # of the 17th draw
    assert "bands: stopped, 2 of 32 draws done" in told()


def test_the_shipped_example_draws_what_can_be_run():
    plan = plan_of(Path("workflows/uncertainty.toml").absolute())
    assert [one.name for one in plan.dimensions] == [
        "environment",
        "friction, rig",
        "friction, field",
        "wear coefficient",
        "spread of shifts",
        "yaw bias of the rig",
        "load, rig",
        "load, field",
    ]
    cases = plan.cases(0, 64)
    assert len(cases) == 64
    check_cases(cases[:1])


@pytest.mark.slow
def test_life_of_reprofiled_wheels_has_bands(tmp_path, scene_text, capsys):
    """Wear is in proportion to the factor that is drawn, intervals in inverse
    proportion to it, but for the length of a wear step, a tenth of them.
    """
    campaign = (
        "distance_km = 4\nmax_step_km = 0.2\npoint_spacing_mm = 0.5\n"
        "error_tolerance_um = 5\nfirst_step_depth_um = 10\n"
        "[campaign.limits]\ndepth_mm = 0.002\ndiameter_mm = 919.9\n"
        '[campaign.reprofiling]\nat_limits = ["depth_mm"]\n'
    )
    block = {"shift_mm": 4, "friction": 0.4, "distance_km": 0.2}
    scene, out = tmp_path / "rig.toml", tmp_path / "out"
    scene.write_text(scene_text(block, campaign=campaign, more=STEEL))
    assert cli.main(["run", str(scene), "--out", str(out), "--bands"]) == 0
    assert "mean distance between reprofilings" in capsys.readouterr().out
    made = xr.load_dataset(out / "bands.nc")
    low, _, high = made["rig_reprofiling_interval_band"].values
    assert high / low == pytest.approx(1.5**2, rel=0.2)
    assert low < float(made["rig_reprofiling_interval"]) < high
    page = (out / "report.html").read_text()
    answer = page[: page.index('id="measures"')]
    assert "Mean distance between reprofilings (rig)" in answer
    alone = render([load_results(out / "rig.nc")])
    assert "Mean distance between reprofilings (rig)" not in alone


def test_draws_that_are_doubled_are_counted_on(tmp_path, monkeypatch):
    """The second half is reported after the first, not from one again."""
    monkeypatch.setattr(translation.bands, "SURE", -1.0)
    more = STEEL.replace("draws = 16", "draws = 16\nmost_draws = 32")
    scene, out, counted = write(tmp_path, "rig", 1, more), tmp_path / "out", []
    whole = tmp_path / "whole"
    run_scene(scene, whole)
    shutil.copytree(whole, out)

    class Copies(Runner):
        """Runs no draw: all have the results of the scene."""

        def finish(self, cases, out, of, advice, before=0):
            counted.append((before, len(cases)))
            for case in cases:
                shutil.copytree(whole, out / case.name)

    run_bands(scene, out, Copies())
    assert counted == [(0, 16), (16, 16)]
