"""What a user gets: README and guide as they stand, and an installed wheel that finds
its shipped files.
"""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import netCDF4
import pytest

import wearsim
from wearsim.cli import COMMANDS, build_parser, main
from wearsim.cli.flags import overrides_of
from wearsim.results import ROW
from wearsim.scene import load_scene
from wearsim.scene.sweep import sweep_of_flags

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDE = (ROOT / "workflows" / "README.md").read_text(encoding="utf-8")


def blocks(text, *languages):
    """Code blocks of a document in these languages; "" is none."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return [block for language, block in found if language in languages]


def section(text, title):
    """A section of a document without its title."""
    return text.split(f"\n## {title}\n")[1].split("\n## ")[0]


SHORT_SCENE = """\
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
roller_radius_mm = 1000
[contact]
model = "fast"
strips = 10
cells = 10
[[operation.block]]
name = "curving"
shift_mm = 3
yaw_mrad = 5
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 1
[campaign]
distance_km = 2
max_step_km = 0.5
"""


def test_the_quick_start_has_two_blocks_of_one_line_that_each_stand_alone():
    commands = blocks(section(README, "Quick start"), "")
    assert blocks(README, "", "console", "python", "toml")[:2] == commands
    assert [command.count("\n") for command in commands] == [1, 1]
    assert all(command.startswith("python3 -m venv .venv && ") for command in commands)
    assert "wearsim run workflows/rig_vs_field.toml --out out" in commands[0]
    assert "pytest" in commands[1]


def test_the_python_example_of_the_readme_runs(capsys):
    """Pressure is higher off the middle."""
    (example,) = blocks(README, "python")
    exec(compile(example, "README.md", "exec"), {})
    *pressure, unit = capsys.readouterr().out.replace("[", "").replace("]", "").split()
    assert unit == "MPa"
    middle, *shifted = map(float, pressure)
    assert 500.0 < middle < min(shifted) < max(shifted) < 2000.0


def test_the_python_examples_of_the_guide_run(tmp_path, monkeypatch, undrawn, capsys):
    """The one draws a line per state, the other prints how much more power rollers
    take.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    Path("short.toml").write_text(SHORT_SCENE)
    assert main(["run", "short.toml", "--out", "out"]) == 0
    examples = blocks(section(GUIDE, "From Python"), "python")
    capsys.readouterr()
    names = {}
    try:
        for example in examples:
            exec(compile(example, "workflows/README.md", "exec"), names)
        ratios = [float(text) for text in capsys.readouterr().out.strip("[]\n").split()]
        assert len(ratios) == 3
        assert min(ratios) > 1.0
        lines = names["axes"].get_lines()
        assert len(lines) == 4
        assert lines[-1].get_label() == "2 km"
        assert (lines[0].get_ydata() != lines[-1].get_ydata()).any()
        assert Path("evolution.png").stat().st_size > 0
    finally:
        plt.close("all")


def test_the_law_of_the_guide_is_known_to_scenes(own_records, tmp_path):
    for example in blocks(section(GUIDE, "Own laws and models"), "python"):
        exec(compile(example, "workflows/README.md", "exec"), {"wearsim": wearsim})
    (tmp_path / "scene.toml").write_text(SHORT_SCENE + '[wear]\nlaw = "by_work"\n')
    scene = load_scene(tmp_path / "scene.toml")
    assert (scene.wear.law, scene.wear.coefficients) == ("by_work", None)


@pytest.mark.parametrize(
    "document",
    [
        "README.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "reports/README.md",
        "workflows/README.md",
    ],
)
def test_the_links_of_documents_lead_somewhere(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if "://" not in target:
            path, _, heading = target.partition("#")
            linked = (ROOT / document).parent / path if path else ROOT / document
            assert linked.exists(), target
            if heading:
                titles = re.findall(
                    r"^#+ (.*)$", linked.read_text(encoding="utf-8"), flags=re.MULTILINE
                )
                assert heading in [
                    re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
                    for title in titles
                ]


def test_the_scenes_of_the_guide_have_no_faults(tmp_path):
    """One is complete, the tables of the others are added to it."""
    scenes = blocks(GUIDE, "toml")
    (complete,) = (text for text in scenes if "[scene]" in text)
    tables = [text for text in scenes if text != complete]
    assert len(tables) == 9
    for number, text in enumerate(["", *tables]):
        scene = tmp_path / f"scene_{number}.toml"
        scene.write_text(f"{complete}\n{text}")
        assert load_scene(scene).scene.kind == "rig"


DOCUMENTS = (
    "README.md",
    "CONTRIBUTING.md",
    "reports/README.md",
    "profiles/measured/README.md",
    "workflows/README.md",
    *(f"workflows/{path.name}" for path in sorted((ROOT / "workflows").glob("*.toml"))),
)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_the_commands_in_documents_exist_with_their_flags(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    lines = re.findall(
        r"(?:^|/|^\$ )wearsim ([^&>\n]*)",
        "".join(blocks(text, "", "console")),
        flags=re.MULTILINE,
    )
    lines += re.findall(r"^# {5}wearsim (.*)$", text, flags=re.MULTILINE) + re.findall(
        r"`wearsim ([^`]*)`", text
    )
    parser = build_parser()
    for line in lines:
        command, *arguments = shlex.split(line.replace("\\|", "/"))
        assert command in (*COMMANDS, "COMMAND"), line
        if arguments and command in COMMANDS:
            parser.parse_args([command, *arguments])
    for script in re.findall(r"python (\w+/[\w/]+\.py)", text):
        assert (ROOT / script).is_file(), script


def test_the_keys_that_commands_change_are_keys_of_their_scenes(monkeypatch):
    """In the guide and in `--help`."""
    monkeypatch.chdir(ROOT)
    parser = build_parser()
    text = GUIDE + (ROOT / "wearsim" / "cli" / "commands.py").read_text(
        encoding="utf-8"
    )
    commands = re.findall(
        r"^(?: +|\$ )?wearsim ((?:run|check) workflows/\S+ .*--set [^\n\"]*)",
        text,
        flags=re.MULTILINE,
    )
    assert len(commands) >= 4
    for command in commands:
        arguments = parser.parse_args(shlex.split(command))
        load_scene(arguments.scene, overrides=overrides_of(arguments.set))


def test_the_shipped_table_of_cases_has_keys_of_its_scene():
    study = sweep_of_flags(
        "workflows/field_given.toml", [], str(ROOT / "workflows" / "refinements.csv")
    )
    assert study.cases[-1].label == 'model = "accurate"'
    for case in study.cases:
        load_scene(case.base, overrides=case.overrides)


def test_the_readme_quotes_the_accuracy_of_contact_models_from_the_report():
    cells = [
        line.split("|")
        for line in README.splitlines()
        if re.match(r"\| `\w+` \+ `\w+`", line)
    ]
    report = (ROOT / "reports" / "contact_accuracy.md").read_text(encoding="utf-8")
    assert len(cells) == 6
    for _, models, *values, _ in cells:
        normal, tangential = re.findall(r"`(\w+)`", models)
        grid = "25 x 25" if "25 x 25" in models else "50 x 50"
        start = f"| `{normal} + {tangential}, {grid}` | all |"
        (row,) = (line for line in report.splitlines() if line.startswith(start))
        quantiles = [
            cell.split("·")[1].strip() for cell in row.split("|") if "·" in cell
        ]
        assert [value.strip() for value in values] == quantiles


def test_every_command_stands_in_the_guide_and_no_other():
    listed = r"^\| `wearsim (\w+)"
    assert sorted(re.findall(listed, GUIDE, flags=re.MULTILINE)) == sorted(COMMANDS)
    assert set(re.findall(listed, README, flags=re.MULTILINE)) < set(COMMANDS)


def test_annotations_are_those_of_users_and_the_version_stands_in_one_place():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert (ROOT / "wearsim" / "py.typed").is_file()
    assert "version" in project["project"]["dynamic"]
    stated = (ROOT / project["tool"]["hatch"]["version"]["path"]).read_text(
        encoding="utf-8"
    )
    assert stated.count(wearsim.__version__) == 1


def test_the_readme_is_one_page():
    assert README.count("\n") <= 120


def test_the_public_functions_and_registries_stand_in_the_guide():
    first = [
        line.split(" | ")[0]
        for line in section(GUIDE, "From Python").splitlines()
        if line.startswith("|")
    ]
    table = re.findall(r"`([\w.]+)`", " ".join(first))
    assert {name.split(".")[0] for name in table} == {
        name
        for name in wearsim.__all__
        if name not in ("__version__", "Counterface", "Profile", "Wheelset")
    } - {"WearsimError", "WearsimWarning"}


READ_AND_CHECK = """\
import sys
from wearsim.cli import main
from wearsim.scene import load_campaign
both = load_campaign("workflows/rig_vs_field.toml")
for scene in (both.rig, both.field):
    print(f"{scene.origin.path}: {scene.wheelset.profile}")
sys.exit(main(["check", "workflows/sweep_rig.toml"]))
"""


@pytest.mark.slow
def test_an_installed_wheel_runs_in_a_fresh_environment_from_any_directory(tmp_path):
    """With its declared dependencies and its shipped files; kernels compiled or loaded:
    the same bits.
    """
    environment, elsewhere, cache = (
        tmp_path / name for name in ("environment", "elsewhere", "cache")
    )
    elsewhere.mkdir()
    variables = {
        key: value
        for key, value in os.environ.items()
        if key not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    variables["NUMBA_CACHE_DIR"] = str(cache)

    def done(*words):
        run = subprocess.run(
            words,
            check=True,
            cwd=elsewhere,
            env=variables,
            stdout=subprocess.PIPE,
            text=True,
        )
        return run.stdout.splitlines()

    done(sys.executable, "-m", "venv", environment)
    done(environment / "bin" / "pip", "-q", "install", "--no-compile", ROOT)
    rig, field, study, *rest = done(
        environment / "bin" / "python", "-c", READ_AND_CHECK
    )
    for line in (rig, field, study):
        assert line.startswith(
            f"{environment}/"
        )  # the shipped copy, not the checkout's
    assert rig.endswith("/rig_given.toml: S1002")
    assert field.endswith("/field_given.toml: S1002")
    assert study.split(", ")[0].endswith(": no faults (sweep)")
    assert "6 cases" in "".join(rest)  # of a base scene read from a file
    assert list(elsewhere.iterdir()) == []
    (elsewhere / "short.toml").write_text(SHORT_SCENE)
    for out in ("compiled", "loaded"):
        done(environment / "bin" / "wearsim", "run", "short.toml", "--out", out)
        assert list(cache.rglob("*.nbc"))
        assert (elsewhere / out / "report.html").stat().st_size > 100_000
    with (
        netCDF4.Dataset(elsewhere / "compiled" / "rig.nc") as one,
        netCDF4.Dataset(elsewhere / "loaded" / "rig.nc") as other,
    ):
        assert one.source.startswith(f"wearsim {wearsim.__version__} ")
        assert one.finished == "distance reached"
        assert float(one["distance"][-1]) == pytest.approx(2e3)
        for name in ROW:
            assert one[name][:].tobytes() == other[name][:].tobytes(), name
