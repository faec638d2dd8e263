"""The commands on one small comparison, from the scene to the report."""

import json
import re
import shutil
from pathlib import Path

import netCDF4
import pandas as pd
import pytest

from wearsim import cli
from wearsim.cli.report import print_warnings
from wearsim.profile.standard import shipped_path
from wearsim.report import html

DISTANCE = {"rig_given": 5.0, "field_given": 100.0}  # a few steps at most [km]


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """Run directory of the shipped workflows, cut short and coarse."""
    folder = tmp_path_factory.mktemp("compared")
    for name in ("rig_given", "field_given", "rig_vs_field"):
        text = shipped_path("workflows", f"{name}.toml").read_text()
        if name in DISTANCE:
            head, _ = text.split("[campaign]")
            head = head.replace("strips = 30", "strips = 12").replace(
                "cells = 30", "cells = 12"
            )
            head = head.replace('model = "standard"', 'model = "fast"')
            text = (
                f"{head}[campaign]\ndistance_km = {DISTANCE[name]}\n"
                "integrator = 'euler'\n"
            )
        (folder / f"{name}.toml").write_text(text)
    assert (
        cli.main(
            ["run", str(folder / "rig_vs_field.toml"), "--out", str(folder / "out")]
        )
        == 0
    )
    return folder


@pytest.fixture
def out(compared):
    return compared / "out"


def test_run_leaves_results_factors_and_report(out):
    assert {"rig.nc", "field.nc", "translation.nc", "report.html", "scene"} <= {
        path.name for path in out.iterdir()
    }


def test_the_history_of_the_results_is_the_command_line(out, compared):
    with netCDF4.Dataset(out / "rig.nc") as file:
        assert f"wearsim run {compared}/rig_vs_field.toml --out {out}" in file.history


def test_check_foretells_steps_and_their_size(out, compared, capsys):
    """Steps about, the size of a row exactly."""
    assert cli.main(["check", str(compared / "rig_given.toml"), "--json"]) == 0
    rig = json.loads(capsys.readouterr().out)["campaigns"][0]
    output = rig["bytes_per_step"]
    with netCDF4.Dataset(out / "rig.nc") as file:
        steps = len(file.dimensions["step"])
        assert 0.5 <= rig["steps"] / (steps - 1) <= 2.0
        assert rig["seconds"] > 0.0
        assert rig["slowest"]["name"] in file["operating_point_name"][:]
        stored = [
            item for item in file.variables.values() if item.dimensions[:1] == ("step",)
        ]
        size = sum(item.size * item.dtype.itemsize for item in stored) / steps
    assert output == size


def test_status_tells_both_campaigns(out, capsys):
    assert cli.main(["status", str(out)]) == 0
    rig, field, report = capsys.readouterr().out.splitlines()
    assert rig.startswith("rig: finished, 5 of 5 km (100 %), worst depth ")
    assert field.startswith("field: finished, ")
    assert report == f"report: {out / 'report.html'}"
    assert cli.main(["status", str(out), "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["campaigns"]) == {"rig", "field"}


@pytest.fixture
def ended(out, tmp_path):
    """Function that gives a copy of the run directory in which the rig ended
    otherwise.
    """

    def copy(**status):
        directory = shutil.copytree(out, tmp_path / "copy")
        content = json.loads((directory / "status.json").read_text())
        content["campaigns"]["rig"] |= status
        (directory / "status.json").write_text(json.dumps(content))
        return directory

    return copy


def test_status_of_a_killed_run_is_stopped(ended, capsys):
    directory = ended(state="running")
    assert cli.main(["status", str(directory)]) == 0
    rig, _, _, advice = capsys.readouterr().out.splitlines()
    assert rig.startswith("rig: stopped, 5 of 5 km ")
    assert (
        advice
        == f"nobody works in {directory}; `wearsim resume {directory}` continues it"
    )
    assert cli.main(["status", str(directory), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["campaigns"]["rig"]["state"] == "stopped"


def test_the_report_of_a_failed_campaign_says_why_on_top(ended, capsys, monkeypatch):
    monkeypatch.setattr(html, "figures", lambda *_, **__: iter(()))
    message = "the wear step at 4 km is too short to change the distance"
    directory = ended(state="failed", message=message)
    assert cli.main(["report", str(directory)]) == 0
    text = (directory / "report.html").read_text()
    assert re.search(
        rf">Rig: the campaign failed after [\d.]+\skm of [\d.]+\skm: {message}</p>",
        text,
    )
    assert text.index(message) < text.index("<h2")
    for name in ("rig", "field"):
        (directory / f"{name}.nc").unlink()
    capsys.readouterr()
    assert cli.main(["report", str(directory)]) == 2
    assert capsys.readouterr().err.endswith(f"the campaign failed: {message}\n")


def test_a_sweep_is_not_resumed_as_a_campaign(tmp_path, capsys):
    (tmp_path / "sweep.json").write_text('{"cases": []}')
    assert cli.main(["report", str(tmp_path)]) == 2
    assert capsys.readouterr().err.endswith("start one with `wearsim sweep`\n")
    assert cli.main(["resume", str(tmp_path)]) == 2
    assert f"`wearsim sweep SCENE --out {tmp_path}`" in capsys.readouterr().err


def test_a_result_file_is_no_run_directory(out, capsys):
    assert cli.main(["resume", str(out / "rig.nc")]) == 2
    assert (
        capsys.readouterr().err
        == f"{out / 'rig.nc'} is a file; give the run directory, {out}\n"
    )


def test_a_result_file_is_no_file_of_points(out, capsys):
    """Where only such a file will do, the command that writes one is named."""
    assert cli.main(["profile", "S1002", "--rail", str(out / "rig.nc")]) == 2
    output = capsys.readouterr().err
    assert "is a result file, not a file of points; " in output
    assert (
        f"`wearsim profile {out / 'rig.nc'} --convert miniprof` writes its worn wheel"
        in output
    )
    assert "UTF-8" not in output


def test_a_finished_campaign_is_resumed_with_success_and_left_as_it_is(
    out, capsys, undrawn
):
    report = (out / "report.html").read_bytes()
    before = {name: (out / name).read_bytes() for name in ("rig.nc", "field.nc")}
    assert cli.main(["resume", str(out)]) == 0
    assert "finished before" in capsys.readouterr().err
    assert before == {name: (out / name).read_bytes() for name in before}
    assert undrawn == [out]
    (out / "report.html").write_bytes(report)


def test_another_campaign_is_kept_out_of_the_directory(out, compared, capsys):
    before = (out / "rig.nc").read_bytes()
    assert cli.main(["run", str(compared / "rig_given.toml"), "--out", str(out)]) == 2
    *warnings, output = capsys.readouterr().err.splitlines()
    assert any("less than one loop of the programme" in warning for warning in warnings)
    assert "belongs to another campaign" in output
    assert (out / "rig.nc").read_bytes() == before


def test_inspect_prints_a_summary_json_and_figures(out, tmp_path, capsys, monkeypatch):
    """Two figures stand for all, which are drawn where their room is tested."""
    every = html.all_figures
    monkeypatch.setattr(
        "wearsim.report.inspect.all_figures", lambda campaigns: every(campaigns)[:2]
    )
    assert cli.main(["inspect", str(out / "rig.nc")]) == 0
    assert "5 km" in capsys.readouterr().out
    assert (
        cli.main(
            [
                "inspect",
                str(out / "rig.nc"),
                "--json",
                "--plot",
                str(tmp_path / "figures"),
            ]
        )
        == 0
    )
    output = json.loads(capsys.readouterr().out)
    assert len(output["figures"]) == 2
    assert all(Path(figure).stat().st_size > 1000 for figure in output["figures"])


def test_translate_prints_the_answer_and_writes_the_factors(out, tmp_path, capsys):
    words = ["translate", str(out / "rig.nc"), str(out / "field.nc")]
    beyond = ["--field-km", "1e7", "--rig-km", "0.001"]
    assert cli.main([*words, *beyond, "--out", str(tmp_path / "factors.nc")]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert (tmp_path / "factors.nc").is_file()
    lines = printed.out.splitlines()
    assert lines[0].startswith("1 km on the rig = ")
    assert max(map(len, lines)) <= 100
    assert len(lines) < 20
    (asked,) = (line for line in lines if line.startswith("10 000 000 km in the field"))
    assert "by depth no answer: run the field 9 999" in asked
    (asked,) = (line for line in lines if line.startswith("0.001 km on the rig = "))
    assert "no answer" not in asked


def test_translate_takes_the_run_directory_of_a_comparison(out, capsys):
    """The answer of both of its results, in their order."""
    assert cli.main(["translate", str(out / "rig.nc"), str(out / "field.nc")]) == 0
    of_files = capsys.readouterr().out
    assert cli.main(["translate", str(out)]) == 0
    assert capsys.readouterr().out == of_files
    assert cli.main(["translate", str(out / "rig.nc")]) == 2
    assert "give the results of two campaigns" in capsys.readouterr().err


def test_translate_prints_all_tables_on_request(out, tmp_path, capsys):
    words = ["translate", str(out / "rig.nc"), str(out / "field.nc")]
    assert cli.main([*words, "--all", "--csv", str(tmp_path / "factors.csv")]) == 0
    printed = capsys.readouterr().out
    assert "Factors at equal operating points, new wheels, by shift [mm]:" in printed
    lines = [line for line in printed.splitlines() if line.startswith("wear area rate")]
    # 3 words, wheel, 9 shifts; 2 wheels in 3 states
    assert [len(line.split()) for line in lines] == [3 + 1 + 9] * 6
    assert max(map(len, printed.splitlines())) <= 100
    assert "nan" not in printed.lower()
    assert cli.main([*words, "--json"]) == 0
    tables = json.loads(capsys.readouterr().out)
    written = pd.read_csv(tmp_path / "factors.csv")
    assert len(written) == len(tables["factors"]) + len(tables["points"])
    assert cli.main([*words, "--csv", "-"]) == 0
    assert capsys.readouterr().out == (tmp_path / "factors.csv").read_text()
    holds_every_factor(tables)


def holds_every_factor(tables):
    rows = tables["factors"]
    points = [
        row
        for row in tables["points"]
        if row["variable"] == "wear_depth_rate_max_point"
    ]
    assert len(points) == 3 * 9 * 2
    assert all(
        row["factor"] == pytest.approx(row["rig"] / row["field"], rel=1e-14)
        for row in points
    )
    depth = next(row for row in rows if row["variable"] == "max_wear_depth")
    assert depth["factor"] == pytest.approx(depth["rig"] / depth["field"], rel=1e-14)
    assert any(
        row["factor"] is None for row in rows
    )  # such as the field's hollowing of zero


def test_differing_settings_stand_below_the_answer(out, tmp_path, capsys):
    shutil.copy(out / "field.nc", tmp_path / "field.nc")
    with netCDF4.Dataset(tmp_path / "field.nc", "a") as file:
        file.youngs_modulus = 205e9
        file.rotation_rule = "nominal"
    words = ["translate", str(out / "rig.nc"), str(tmp_path / "field.nc")]
    assert cli.main([*words, "--all"]) == 0
    output = capsys.readouterr().out.splitlines()
    assert (
        "warning: youngs modulus differs: 2.1e+11 Pa on the rig, 2.05e+11 Pa in "
        "the field"
    ) in output
    assert (
        "warning: rotation rule differs: free on the rig, nominal in the field"
        in output
    )
    assert not any("Factors at equal operating points" in line for line in output)
    assert cli.main([*words, "--json"]) == 0
    printed = capsys.readouterr()
    assert "warning: youngs modulus differs" in printed.err
    assert json.loads(printed.out)["points"] == []


def test_what_a_result_deserves_to_be_doubted_for_is_told_after_the_run(
    out, tmp_path, capsys
):
    """Scaled loads do not occur in so short a campaign, so one is written into the
    file.
    """
    with netCDF4.Dataset(shutil.copy(out / "rig.nc", tmp_path / "rig.nc"), "a") as file:
        file["load_scale"][1, 0, 0] = 1.25
    print_warnings([tmp_path / "rig.nc", out / "translation.nc"])
    output = capsys.readouterr().err.splitlines()
    assert len(output) == 1
    assert output[0].startswith("warning: rig: contact patches merge")
    assert "at most by the factor 1.25" in output[0]


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (("field.nc", "rig.nc"), "the results are exchanged: "),
        (("rig.nc", "rig.nc"), "rig and field are the same result twice; "),
        (("field.nc", "field.nc"), "rig and field are the same result twice; "),
    ],
)
def test_results_exchanged_or_given_twice_are_one_line_and_exit_code_2(
    out, capsys, names, reason
):
    assert cli.main(["translate", *(str(out / name) for name in names)]) == 2
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert reason in line
    assert printed.out == ""


def test_results_of_other_kinds_are_warned_of(out, tmp_path, capsys):
    """A kind of any length is repeated in 40 characters."""
    rig = shutil.copy(out / "rig.nc", tmp_path)
    with netCDF4.Dataset(rig, "a") as file:
        file.scene_kind = "9" * 500 + "\n"
    assert cli.main(["translate", str(out / "field.nc"), rig]) == 0
    output = capsys.readouterr().err.splitlines()
    assert len(output) == 2
    assert output[0].endswith("field.nc holds a field campaign and is taken as the rig")
    assert output[1].endswith(
        f"holds a {'9' * 37}... campaign and is taken as the field"
    )


def test_report_is_written_again_byte_by_byte(out, capsys):
    before = (out / "report.html").read_bytes()
    assert cli.main(["report", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out / "report.html")
    assert (out / "report.html").read_bytes() == before


@pytest.mark.parametrize(
    "words",
    [
        ["inspect", "none.nc"],
        ["translate", "none.nc", "none.nc"],
        ["report", "none"],
        ["status", "none"],
        ["resume", "none"],
        ["run", "none.toml"],
    ],
)
def test_what_is_not_there_is_one_line_and_exit_code_2(
    words, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert len(output.err.splitlines()) == 1
    assert "none" in output.err
    assert not list(tmp_path.iterdir())
