"""wearsim check, schema and status."""

import json
import re
import shutil
from pathlib import Path

import pytest

from wearsim import cli, open_results
from wearsim.cli.status import status_line
from wearsim.errors import ContactError
from wearsim.profile.standard import shipped_path

pytestmark = pytest.mark.usefixtures("untried")


FAST = 'model = "standard"', 'model = "fast"'


def unwrapped(text):
    """Text without its line breaks and indents."""
    return " ".join(text.split())


@pytest.fixture
def bad_rig(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = shipped_path("workflows", "rig_given.toml").read_text()
    Path("rig.toml").write_text(
        text.replace("load_kN = 80", "load_kN = 0").replace("strips", "stripes")
    )
    return tmp_path


def test_check_tells_what_would_run(capsys):
    assert cli.main(["check", "workflows/rig_vs_field.toml"]) == 0
    output = capsys.readouterr().out
    head = output.splitlines()[0]
    assert (
        head
        == "workflows/rig_vs_field.toml: no faults (compare), about 3 min on 2 threads"
    )
    assert max(map(len, output.splitlines())) <= 100
    for part in (
        "rig: ",
        "field: ",
        "operating points",
        "environment factor",
        "about 1200, 2 min on ",
        "about 20 000 km: limit",
        "  fast                   50     +4.0 %  +4.0 %            +4.0 %",
        "differences from accurate at the 4 points that wear most, 90 % of the wear",
    ):
        assert part in output


def test_check_as_json_holds_every_value_that_would_act(capsys):
    assert cli.main(["check", "workflows/rig_vs_field.toml", "--json"]) == 0
    output = json.loads(capsys.readouterr().out)
    rig, field = output["campaigns"]
    assert (rig["kind"], field["kind"]) == ("rig", "field")
    for plan in (rig, field):
        settings = plan["settings"]
        assert plan["distance"] == settings["campaign"]["distance_km"] * 1e3
        assert (plan["steps"], plan["seconds"]) == (1234, 100.0)
        assert (plan["end"], plan["limit"]) == (20.4e6, "hollowing")
        assert plan["slowest"] == {"name": "left", "share": 0.6, "held_by": "error"}
        assert plan["monitoring_points"] == len(
            settings["operation"]["monitor"]["shifts_mm"]
        )
        assert settings["contact"]["virtual_penetration_factor"] == 0.55  # a default
        assert settings["wear"]["density_kg_m3"] == 7850
        assert plan["bytes_per_step"] == 5678
        assert {entry["name"] for entry in plan["inputs"]} >= {"wheelset.profile S1002"}
    for plan, name in ((rig, "block"), (field, "class")):
        factors = [run["environment"] for run in plan["settings"]["operation"][name]]
        assert plan["environment"] == sorted(set(factors))


def test_check_tells_all_faults_and_returns_2(bad_rig, capsys):
    assert cli.main(["check", "rig.toml"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    lines = output.err.splitlines()
    assert sum("load_kN = 0 must be at least 0.1" in fault for fault in lines) == 5
    assert sum("did you mean strips?" in fault for fault in lines) == 1
    assert all(fault.startswith("rig.toml:") for fault in lines)


@pytest.fixture
def climbing_rig(tmp_path, monkeypatch):
    """A short rig scene whose last block lies 0.4 mm beyond the flange clearance."""
    monkeypatch.chdir(tmp_path)
    text = shipped_path("workflows", "rig_given.toml").read_text()
    text = text.replace("shift_mm = 5", "shift_mm = 7").replace(
        "distance_km = 1260", "distance_km = 0.01"
    )
    Path("rig.toml").write_text(
        text.replace("cells = 30", "cells = 10")
        .replace("strips = 30", "strips = 10")
        .replace(*FAST)
    )
    line = text[: text.index("shift_mm = 7")].count("\n") + 1
    return (
        f"warning: rig.toml:{line}: shift_mm = 7 is beyond the flange clearance of "
        "6.6 mm: "
    )


def test_check_warns_with_the_line_at_the_campaign_it_belongs_to(climbing_rig, capsys):
    shutil.copy(shipped_path("workflows", "field_given.toml"), "field.toml")
    scenes = Path("both.toml")
    scenes.write_text(
        '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\nfield = "field.toml"\n'
    )
    assert cli.main(["check", str(scenes)]) == 0
    verdict, rig, field = capsys.readouterr().out.split("\n\n")
    head, *warnings = verdict.splitlines()
    assert head.startswith("both.toml: no faults (compare), about ")
    assert head.endswith(
        f", {len(re.findall('^warning: ', verdict, re.MULTILINE))} warnings"
    )
    assert climbing_rig in unwrapped(" ".join(warnings))
    assert "warning" not in rig + field
    assert cli.main(["check", str(scenes), "--json"]) == 0
    rig, field = json.loads(capsys.readouterr().out)["campaigns"]
    assert any(
        f"warning: {warning}".startswith(climbing_rig) for warning in rig["warnings"]
    )
    assert field["warnings"] == []


def test_run_warns_on_standard_error_and_runs(climbing_rig, capsys, undrawn):
    assert cli.main(["run", "rig.toml", "--out", "out"]) == 0
    output = capsys.readouterr()
    assert any(line.startswith(climbing_rig) for line in output.err.splitlines())
    assert "warning" not in output.out
    with open_results("out/rig.nc") as rig:
        assert climbing_rig.removeprefix("warning: ") in rig.attrs["warnings"]


def test_run_refuses_a_scene_with_faults_before_anything_is_written(bad_rig, capsys):
    assert cli.main(["run", "rig.toml", "--out", "out"]) == 2
    assert capsys.readouterr().err.splitlines()[0].startswith("rig.toml:")
    assert sorted(path.name for path in bad_rig.iterdir()) == ["rig.toml"]


def test_schema_is_json(capsys):
    assert cli.main(["schema"]) == 0
    output = json.loads(capsys.readouterr().out)
    assert output["$schema"].startswith("https://json-schema.org/")


@pytest.mark.parametrize("command", ["status", "resume"])
def test_a_folder_without_a_campaign_is_told(command, tmp_path, capsys):
    assert cli.main([command, str(tmp_path)]) == 2
    output = capsys.readouterr().err
    assert "not a run directory" in output
    assert len(output.splitlines()) == 1


def test_a_line_of_status_says_that_wheels_were_reprofiled():
    item = {"state": "finished", "worst_depth": 0.12e-3, "reprofiled": True}
    assert "worst depth 0.12 mm since reprofiling, step 0" in status_line("rig", item)


def test_a_line_of_status_holds_distance_depth_and_time_left():
    item = {
        "state": "running",
        "step": 7,
        "distance": 250e3,
        "target": 1000e3,
        "worst_depth": 0.12e-3,
        "time_left": 125.0,
    }
    assert status_line("rig", item) == (
        "rig: running, 250 of 1000 km (25 %), worst depth 0.12 mm, step 7, about 2 "
        "min left"
    )
    output = status_line(
        "rig", {**item, "state": "failed", "message": "no convergence"}
    )
    assert output.endswith("worst depth 0.12 mm, step 7; no convergence")


def test_check_tells_the_limits_and_which_the_new_wheel_meets(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    text = shipped_path("workflows", "rig_given.toml").read_text()
    text = text.replace(*FAST)
    Path("rig.toml").write_text(
        f"{text}\n[campaign.limits]\nhollowing_mm = 2\nconicity = 0.1\n"
    )
    assert cli.main(["check", "rig.toml"]) == 0
    output = unwrapped(capsys.readouterr().out)
    assert (
        "hollowing_mm = 2, conicity = 0.1; the distance at which each is met is "
        "reported"
    ) in output
    assert "conicity = 0.1 is met by the new wheelset (0.1" in output


def test_status_tells_the_limit_that_ended_a_campaign():
    item = {
        "state": "finished",
        "step": 3,
        "distance": 5e3,
        "target": 9e3,
        "ended": "limit of hollowing met",
    }
    assert status_line("rig", item).endswith(": limit of hollowing met")
    assert "distance reached" not in status_line(
        "rig", {**item, "ended": "distance reached"}
    )


def test_status_of_a_campaign_that_crawls_says_where():
    item = {"state": "running", "step": 900, "distance": 250e3, "target": 1000e3}
    slow = {"step_length": 0.5, "step_limit": "error", "fastest": "R 400 leading"}
    assert status_line("rig", {**item, **slow}).endswith(
        "; no progress in R 400 leading: steps of 0.5 m, limited by error"
    )
    assert status_line("rig", {**item, **slow}, age=720.0).endswith(
        "; no step for 12 min in R 400 leading"
    )
    assert status_line("rig", {**item, **slow, "step_length": 5e3}).endswith(" 900")
    assert "no " not in status_line("rig", {**item, **slow, "state": "stopped"}, 720.0)


def test_check_tells_that_a_step_fails(monkeypatch, capsys):
    def fail(*_):
        raise ContactError("no contact")

    monkeypatch.setattr("wearsim.studies.plan.estimate", fail)
    assert cli.main(["check", "workflows/rig_given.toml"]) == 0
    output = capsys.readouterr().out
    assert "the first fails: no contact" in output
    assert "slowest" not in output


def test_check_lists_comparison_and_fatigue_laws(capsys):
    assert cli.main(["check", "workflows/fatigue.toml"]) == 0
    output = unwrapped(capsys.readouterr().out)
    assert "Archard (patch mean), Jendel 2002" in output
    assert (
        "WLRM, Burstow 2004, rising form, wear number with spin, wear removes "
        "cracks of 5 mm"
    ) in output
    assert "cracks of 5 mm; assumed: places 10 mm wide, 3 mm may wear" in output
    assert (
        "stress index, Dirks and Enblom 2011; assumed: places 10 mm wide steps "
        in output
    )
    assert "wear law USFD (local), Lewis and Dwyer-Joyce 2004" in output
    assert cli.main(["check", "workflows/fatigue.toml", "--json"]) == 0
    campaign = json.loads(capsys.readouterr().out)["campaigns"][0]
    assert [one["law"] for one in campaign["comparison_laws"]] == [
        "archard",
        "brr",
        "energy",
    ]
    wlrm = campaign["fatigue"][0]
    assert (wlrm["law"], wlrm["crack_depth"], wlrm["wear_limit"]) == (
        "wlrm",
        5e-3,
        3e-3,
    )


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("standard", "coupled strips (normal and tangential)"),
        ("fast", "Kik and Piotrowski (normal), FASTSIM (tangential)"),
    ],
)
def test_check_names_contact_models_in_words(model, words, capsys):
    command = ["check", "workflows/rig_given.toml", "--set", f"contact.model={model}"]
    assert cli.main(command) == 0
    assert f"contact models {words}; rotation free" in unwrapped(
        capsys.readouterr().out
    )


def test_check_tells_limits_turnings_and_worn_rails(capsys):
    assert cli.main(["check", "workflows/limits.toml"]) == 0
    output = unwrapped(capsys.readouterr().out)
    limits = "flange_thickness_mm = 22, hollowing_mm = 0.02, diameter_mm = 919.3"
    ends = "the first that is met and at which the wheels are not reprofiled ends"
    assert f"{limits}; {ends} the campaign" in output
    assert "each loses 0.5 mm2 per 1000 km where the wheels wear" in output
    assert "S1002: hollowing_mm" in output


def test_check_shows_the_states_and_marks_what_deserves_a_second_look(
    climbing_rig, capsys
):
    assert cli.main(["check", "rig.toml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("  state "))
    table = {line.split()[0]: line for line in lines[start + 2 : start + 6]}
    assert list(table) == ["left", "centred", "right", "curving"]
    assert "  right flange: curving" in lines
    assert max(map(len, lines)) <= 100
    assert cli.main(["check", "rig.toml", "--json"]) == 0
    (campaign,) = json.loads(capsys.readouterr().out)["campaigns"]
    left, _, right, curving = campaign["states"]
    assert left["wear_number"] == pytest.approx(right["wear_number"], rel=1e-6)
    assert left["lateral_force"] == pytest.approx(-right["lateral_force"], rel=1e-6)
    assert curving["shift"] == 7e-3
    assert curving["load_right"] == pytest.approx(80e3, rel=1e-5)


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_shows_what_takes_long(climbing_rig, monkeypatch, capsys, terminal):
    monkeypatch.setattr("wearsim.cli.check._PATIENCE", 0.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    assert cli.main(["check", "rig.toml"]) == 0
    assert (
        "wearsim: initial contact ..." in capsys.readouterr().err.splitlines()
    ) == terminal
