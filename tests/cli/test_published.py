"""`wearsim run` and `wearsim check` on published contact cases, as a user calls them."""

import json
import shutil
from pathlib import Path

import pytest
import xarray as xr

from wearsim.cli import main

WORKFLOWS = Path(__file__).parents[2] / "workflows"


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A copy of the shipped scene with its half-space results, to be changed; work goes on beside it."""
    monkeypatch.chdir(tmp_path)
    for name in ("seed_tables.toml", "seed_tables_half_space.csv"):
        shutil.copy(WORKFLOWS / name, tmp_path / name)
    return tmp_path / "seed_tables.toml"


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_run_writes_report_figures_and_dataset(scene, tmp_path, capsys):
    out = tmp_path / "deep" / "reports"
    assert main(["run", str(scene), "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"report: {out / 'seed_tables.md'}\n"
    names = {"seed_tables.md", "seed_tables.nc", "seed_tables_patches.svg", "seed_tables_stress.svg"}
    assert {path.name for path in out.iterdir()} == names
    text = (out / "seed_tables.md").read_text()
    assert all(f"({name})" in text for name in names if name.endswith(".svg"))
    with xr.open_dataset(out / "seed_tables.nc") as dataset:
        assert dataset["area"].attrs["units"] == "m2"
        assert dataset["published_power"].attrs["units"] == "W"
        assert not dataset["area"].isnull().any()


def test_reports_go_to_the_folder_reports(scene, tmp_path):
    assert main(["run", "seed_tables.toml"]) == 0
    assert (tmp_path / "reports" / "seed_tables.md").is_file()


def test_a_scene_without_half_space_results_and_trends(scene, tmp_path):
    edited(scene, 'half_space = "seed_tables_half_space.csv"\n', "")
    scene.write_text(scene.read_text().partition("[trends]")[0])
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "seed_tables.md").read_text()
    assert "half-space" not in text.partition("## Creepages")[2].lower()
    assert "## Trends" not in text


def test_check_tells_what_would_be_solved(scene, capsys):
    assert main(["check", str(scene), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["kind"], told["cases"], told["profiles"]) == ("published", 6, ["60E1_benchmark", "60E1"])
    assert told["contact_solutions"] == 3 * 12 + 6 + 13 * 7
    assert main(["check", str(scene)]) == 0
    assert "133 contact solutions" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("seed_tables_half_space.csv", "none.csv", 'half_space = "none.csv": there is no such file'),
        ('"60E1"]', '"61E1"]', "'61E1' is neither a file nor a shipped rail profile"),
        ('"S1002"', '"S1003"', "did you mean 'S1002'?"),
        ("area_mm2 = 201.0", "area_mm2 = -201.0", "area_mm2 = -201.0 must be above 0 mm2"),
        ("spin_per_m = -0.075", "spins_per_m = -0.075", "unknown key spins_per_m"),
    ],
)
def test_faults_name_file_and_line(scene, capsys, old, new, told):
    edited(scene, old, new)
    line = scene.read_text().partition(new)[0].count("\n") + 1
    assert main(["run", str(scene)]) == 2
    error = capsys.readouterr().err
    assert f"{scene}:{line}: " in error
    assert told in error


@pytest.mark.parametrize(
    ("old", "new", "line", "told"),
    [
        ("max_pressure_MPa", "pressure", 7, "columns that are missing: max_pressure_MPa"),
        ("168.88", "much", 8, 'area_mm2 = "much" must be a number'),
        (
            "touch,0,1000",
            "touching,0,1000",
            21,
            'creepages = "touching" must be one of kinematics, centre, touch',
        ),
        ("4.00662,2.28771,47.057,127.565", "4.00662", 21, "power_W = None must be a number"),
    ],
)
def test_faults_of_the_half_space_file(scene, tmp_path, capsys, old, new, line, told):
    table = tmp_path / "seed_tables_half_space.csv"
    edited(table, old, new)
    assert main(["check", str(scene)]) == 2
    error = capsys.readouterr().err
    assert f"{table.name}:{line}: " in error
    assert told in error


def test_what_says_nothing_is_refused(scene, tmp_path, capsys):
    """Half-space results of no case or of one told before; a roller given twice in the trends."""
    edited(scene, "2000.0, 1500.0", "2000.0, 2000.0")
    table = tmp_path / "seed_tables_half_space.csv"
    edited(table, "centre,3,1000", "centre,3,500")
    edited(table, "touch,0,,", "touch,0.5,,")
    assert main(["check", str(scene)]) == 2
    error = capsys.readouterr().err
    for told in (
        "is no case of the scene: shift_mm 0.5, roller_radius_mm empty",
        "repeats an earlier row: shift_mm 3, roller_radius_mm 500",
        "roller_radii_mm holds 2000 twice",
    ):
        assert told in error


def test_another_paper_gets_none_of_the_first_ones_remarks(scene, tmp_path):
    """Lateral creepage then is a table, and no sentence speaks of lobes or of another paper."""
    text = scene.read_text()
    head, _, rest = text.partition("remarks = ")
    rest = rest.partition('"""')[2].partition('"""')[2]
    scene.write_text(head + rest.replace("creepage_x = 0.0", "creepage_x = 0.0\ncreepage_y = -0.001"))
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 0
    report = (tmp_path / "out" / "seed_tables.md").read_text()
    assert "### Lateral creepage" in report
    for word in ("lobe", "Lateral creepage is zero", "figure 5", "table 2 "):
        assert word not in report, word


def test_cases_without_contact_are_told(scene, capsys):
    edited(scene, "shift_mm = 0.0", "shift_mm = 5.0")
    edited(scene, 'half_space = "seed_tables_half_space.csv"\n', "")
    assert main(["run", str(scene)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("case 1 on 60E1_benchmark: right wheel, shift 5 mm")
    assert "several patches close" in error
    assert not Path("reports").exists()


def test_published_cases_are_no_campaign(scene, tmp_path, capsys):
    compare = tmp_path / "compare.toml"
    compare.write_text('[scene]\nkind = "compare"\n[compare]\nrig = "seed_tables.toml"\nfield = "x.toml"\n')
    assert main(["check", str(compare)]) == 2
    assert 'compare.toml:4: rig = "seed_tables.toml" is a published scene' in capsys.readouterr().err
