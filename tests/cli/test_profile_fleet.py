"""`wearsim profile --fleet`: one row for each file, whatever is wrong with some."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from pathlib import Path

import pytest

from wearsim.cli import main

MEASURED = Path(__file__).parents[2] / "profiles" / "measured"


@pytest.fixture
def folder(tmp_path):
    """Two wheels of an axle, a rail, a broken and an empty file, and things that are no
    profiles.
    """
    place = tmp_path / "fleet"
    place.mkdir()
    for name in (
        "wheel_worn_right.whl",
        "wheel_worn_left.whl",
        "wheel_worn_light.prw",
        "rail_worn_outer.ban",
    ):
        shutil.copy(MEASURED / name, place)
    (place / "cut.whl").write_text(
        (MEASURED / "wheel_worn_right.whl").read_text()[:3000]
    )
    (place / "empty.csv").write_text("")
    (place / "notes.md").write_text("bought 1998")
    (place / ".hidden.whl").write_text("1 2")
    (place / "sub").mkdir()
    return place


def measured(capsys, folder, *flags, code=0):
    assert main(["profile", "--fleet", str(folder), *flags]) == code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert "internal error" not in captured.err
    return captured


def rows_of(text):
    return {row["file"]: row for row in csv.DictReader(io.StringIO(text))}


def test_each_file_is_a_row_sorted_by_name(folder, capsys):
    captured = measured(
        capsys, folder, "--csv", "-", "--against", "S1002", "--diameter-mm", "900"
    )
    rows = rows_of(captured.out)
    assert list(rows) == [
        "cut.whl",
        "empty.csv",
        "rail_worn_outer.ban",
        "wheel_worn_left.whl",
        "wheel_worn_light.prw",
        "wheel_worn_right.whl",
    ]
    right = rows["wheel_worn_right.whl"]
    assert right["wheel"] == "Example coach car 1 axle 2 R"
    assert (right["stock"], right["car"], right["axle"], right["side"]) == (
        "Example coach",
        "1",
        "2",
        "R",
    )
    assert float(right["max_wear_depth_mm"]) == pytest.approx(1.6, abs=0.01)
    assert right["fault"] == ""
    assert rows["wheel_worn_left.whl"]["exceeded"] == "Sd"  # 33.6 mm, more than 33
    assert rows["wheel_worn_light.prw"]["wheel"] == "wheel_worn_light"
    assert "not compared" in rows["rail_worn_outer.ban"]["notes"]
    assert rows["rail_worn_outer.ban"]["Sh_mm"] == ""
    assert "the file is cut off" in rows["cut.whl"]["fault"]
    assert "state --kind" in rows["empty.csv"]["fault"]
    assert "6 files: 4 measured, 2 with faults" in captured.err
    assert "notes.md" in captured.err
    assert "hidden" not in captured.err + captured.out


def test_what_cannot_be_judged_without_a_diameter_is_told(folder, capsys):
    """Sh = 29.6 mm is below the least height of wheels up to 630 mm only."""
    rows = rows_of(measured(capsys, folder, "--csv", "-").out)
    right = rows["wheel_worn_right.whl"]
    assert (right["exceeded"], right["not_judged"]) == ("", "Sh")
    assert rows["rail_worn_outer.ban"]["not_judged"] == ""
    assert (
        rows_of(measured(capsys, folder, "--csv", "-", "--diameter-mm", "900").out)[
            "wheel_worn_right.whl"
        ]["not_judged"]
        == ""
    )
    text = measured(capsys, folder).out
    assert "not checked: Sh" in text
    assert "(--diameter-mm)" in text


def test_a_row_has_the_values_of_the_file_alone(folder, capsys):
    (row,) = (
        each
        for each in json.loads(measured(capsys, folder, "--json").out)["wheels"]
        if each["file"] == "wheel_worn_right.whl"
    )
    assert main(["profile", str(folder / "wheel_worn_right.whl"), "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)
    for name in (
        "flange_height",
        "flange_thickness",
        "flange_gradient",
        "hollowing",
        "rim_width",
    ):
        assert row[name] == alone["measures"][name]
    conicity = {
        round(1e3 * each["amplitude"]): each["value"]
        for each in alone["running"]["equivalent_conicity"]
    }
    assert row["equivalent_conicity"] == conicity[3]


def test_notes_of_a_row_are_those_of_the_file_alone(folder, capsys):
    text = (folder / "wheel_worn_right.whl").read_text()
    (folder / "old.whl").write_text(text.replace("CarNo=1", "CarNo=7\nSd=25.1"))
    row = rows_of(measured(capsys, folder, "--csv", "-").out)
    assert (
        "the header says Sd = 25.1 mm, the points give 32.35 mm"
        in row["old.whl"]["notes"]
    )


def test_the_table_for_people(folder, capsys):
    out = measured(capsys, folder).out
    lines = {line.split()[0]: line for line in out.splitlines()}
    assert "FAULT" in lines["cut.whl"]
    assert "29.601" in lines["wheel_worn_right.whl"]
    assert "FAULT" not in lines["wheel_worn_right.whl"]


def test_links_to_nothing_and_pipes_are_rows_and_folders_are_told(folder, capsys):
    (folder / "gone.whl").symlink_to(folder / "nowhere.whl")
    os.mkfifo(folder / "pipe.prw")
    captured = measured(capsys, folder, "--csv", "-")
    rows = rows_of(captured.out)
    assert "does not exist" in rows["gone.whl"]["fault"]
    assert "no regular file" in rows["pipe.prw"]["fault"]
    assert "8 files: 4 measured, 4 with faults" in captured.err
    assert "sub/" in captured.err


def test_a_folder_of_faults_is_a_fault_but_still_a_table(tmp_path, capsys):
    for k in range(3):
        (tmp_path / f"{k}.csv").write_text("y;z\n")
    captured = measured(capsys, tmp_path, "--csv", "-", code=2)
    assert len(rows_of(captured.out)) == 3
    assert "3 files: 0 measured, 3 with faults" in captured.err


def test_csv_file_and_json_together(folder, tmp_path, capsys):
    table = tmp_path / "table.csv"
    captured = measured(capsys, folder, "--csv", str(table), "--json")
    assert (
        len(json.loads(captured.out)["wheels"]) == len(rows_of(table.read_text())) == 6
    )
    assert main(["profile", "--fleet", str(folder), "--csv", str(table)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_a_file_that_cannot_be_aligned_keeps_its_measures(folder, capsys):
    row = rows_of(measured(capsys, folder, "--csv", "-", "--against", "disc").out)[
        "wheel_worn_right.whl"
    ]
    assert row["fault"]
    assert row["Sh_mm"] == "29.601"


def test_doubts_of_the_comparison_are_told_in_table_and_notes(folder, capsys):
    """Against a wheel of another shape the parts that do not wear do not fit."""
    flags = ["--against", "P8"]
    lines = measured(capsys, folder, *flags).out.splitlines()
    assert (
        sum(
            "wear uncertain" in line
            for line in lines
            if ".whl" in line or ".prw" in line
        )
        == 3
    )
    assert sum(line.startswith("wear uncertain: ") for line in lines) == 1
    row = rows_of(measured(capsys, folder, "--csv", "-", *flags).out)[
        "wheel_worn_right.whl"
    ]
    assert "rms are left on parts that do not wear" in row["notes"]
    assert "uncertain" not in measured(capsys, folder, "--against", "S1002").out


def test_the_figure_holds_all_profiles(folder, tmp_path, capsys):
    figure = tmp_path / "fleet.svg"
    captured = measured(capsys, folder, "--plot", str(figure), "--against", "S1002")
    assert f"wrote {figure}: 4 profiles drawn" in captured.err
    assert figure.read_text().count("Lateral position of") == 2


FAULTS = {
    "no folder": (["--fleet", "nowhere"], "No such file"),
    "a file": (["--fleet", str(MEASURED / "README.md")], "Not a directory"),
    "no profiles": (["--fleet", "."], "holds no profile files"),
    "convert": (["--fleet", ".", "--convert", "miniprof"], "exclude each other"),
    "left": (["--fleet", ".", "--left", "S1002"], "exclude each other"),
    "bad reference": (["--fleet", str(MEASURED), "--against", "S1003"], "did you mean"),
    "bad rail": (["--fleet", str(MEASURED), "--rail", "61E1"], "--rail"),
    "bad limits": (["--fleet", str(MEASURED), "--limits", "USI"], "--limits"),
    "bad rule": (
        ["--fleet", str(MEASURED), "--against", "S1002", "--align", "eye"],
        "--align",
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_of_the_command_is_one_line(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words, part = FAULTS[case]
    assert main(["profile", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (fault,) = captured.err.splitlines()
    assert part in fault
