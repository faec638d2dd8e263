"""Laws and models of one's own: registered by a script, or of an installed package."""

import os
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import netCDF4
import numpy as np
import pytest

import wearsim
from wearsim.cli import main
from wearsim.contact.registry import Registry
from wearsim.scene.overrides import toml_text

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "workflows" / "plug_in"
SCENE = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "contact": {
        "normal": "kik_piotrowski",
        "tangential": "fastsim",
        "strips": 10,
        "cells": 10,
    },
    "operation": {
        "block": [
            {
                "name": "curving",
                "shift_mm": 3,
                "yaw_mrad": 5,
                "load_kN": 80,
                "speed_km_h": 72,
                "friction": 0.35,
                "distance_km": 1,
            }
        ]
    },
    "campaign": {"distance_km": 1.0, "max_step_km": 0.5},
}


def scene(law=None, tangential="fastsim", **wear):
    contact = SCENE["contact"] | {"tangential": tangential}
    return SCENE | {"contact": contact, "wear": ({"law": law} if law else {}) | wear}


def by_work(fields, area, coefficients, *, form):
    return 1e-12 * fields.strip_work[None]


def law(depth=by_work, name="by_work", **others):
    return wearsim.WearLaw(name, depth, ("all",), **{"coefficients": None, **others})


def fails(*given, **named):
    return np.zeros(3).no_such_attribute


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Folder of the path with the package and what an installation says of it, and one
    that is broken.
    """
    folder = tmp_path_factory.mktemp("site")
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    (folder / "wearsim_by_work.py").write_text(
        (PACKAGE / "wearsim_by_work.py").read_text()
    )
    points = project["entry-points"] | {
        "wearsim.fatigue_laws": {"unfinished": "wearsim_by_work:NOT_THERE"},
        "wearsim.normal_models": {"gone": "package_that_is_gone:MODEL"},
    }
    about = folder / f"wearsim_by_work-{project['version']}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\n"
        f"Version: {project['version']}\n"
    )
    (about / "entry_points.txt").write_text(
        "".join(
            f"[{group}]\n"
            + "".join(f"{name} = {value}\n" for name, value in own.items())
            for group, own in points.items()
        )
    )
    return folder


COMMANDS = """
import wearsim
from wearsim.cli import main
from wearsim.report import html

html.to_svg = lambda figure, name: '<svg><path d="M0 0"/></svg>'  # drawing is most of the time
main(["check", "scene.toml"])
main(["run", "scene.toml", "--out", "out"])
main(["check", "gone.toml"])
main(["check", "law.toml"])
wearsim.load_scene("scene.toml")
"""
STUDY = """
import wearsim
from wearsim.cli import main
from wearsim.report import html
from wearsim.scene.sweep import sweep_of_flags
from wearsim.studies.ensemble import Runner
from wearsim.studies.sweep import run_sweep


def depth(fields, area, coefficients, *, form):
    return 1e-12 * fields.strip_work[None]


if __name__ == "__main__":
    html.to_svg = lambda figure, name: '<svg><path d="M0 0"/></svg>'
    main(["resume", "out", "--set", "campaign.distance_km=1.5"])
    law = wearsim.WearLaw("mine", depth, ("all",), coefficients=None)
    wearsim.register(law, source="study 7")
    wearsim.run("own.toml", "own")
    sweep = sweep_of_flags("both.toml", ["wear.scale=1,3"], None)
    states = [outcome.state for outcome in run_sweep(sweep, "sweep", Runner(jobs=2))]
    assert states == ["finished", "finished"]
"""


@pytest.fixture(scope="module")
def studied(installed, tmp_path_factory):
    """Folder in which, where the package is installed, a process gives commands and a
    script goes on, and what the first one printed.
    """
    folder = tmp_path_factory.mktemp("studied")
    gone, unfinished = {"normal": "gone"}, {"laws": ["unfinished"]}
    for name, tables in {
        "scene": scene("by_work", "fine_fastsim"),
        "gone": scene() | {"contact": gone},
        "law": scene() | {"fatigue": unfinished},
        "own": scene("mine"),
        "both": scene("mine", "fine_fastsim"),
        "slip": scene("archad"),
    }.items():
        (folder / f"{name}.toml").write_text(toml_text(tables))
    printed = []
    for name, text in (("commands.py", COMMANDS), ("study.py", STUDY)):
        (folder / name).write_text(text)
        path = os.pathsep.join([str(ROOT), str(installed)])
        done = subprocess.run(
            [sys.executable, name],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        printed.append(done)
    return folder, printed[0]


def test_the_command_line_knows_an_installed_package(studied):
    """Check, run, resume in a further process, and the report."""
    folder, first = studied
    assert "wear law by_work: wearsim-by-work 1.0" in first.stdout
    with netCDF4.Dataset(folder / "out" / "rig.nc") as file:
        for what in (
            "wear law by_work",
            "tangential model fine_fastsim",
            "coefficient set made_up_2026",
        ):
            assert f"{what}: wearsim-by-work 1.0" in file.plugins
        assert file.source.endswith(", wearsim-by-work 1.0")
        assert file["distance"][-1] == pytest.approx(1500.0)
        assert file["max_wear_depth"][-1].max() > 0.0
    assert "wearsim-by-work 1.0" in (folder / "out" / "report.html").read_text()


def test_what_cannot_be_loaded_is_named_where_it_is_used_and_nowhere_else(studied):
    package = "of wearsim-by-work 1.0 cannot be used:"
    model, unfinished = (
        line for line in studied[1].stderr.splitlines() if package in line
    )
    assert model.startswith(
        f'gone.toml:13: normal model "gone" {package} ModuleNotFoundError: No module '
        "named"
    )
    assert unfinished.startswith("law.toml:")
    assert unfinished.endswith(
        f"{package} AttributeError: module 'wearsim_by_work' has no attribute "
        "'NOT_THERE'"
    )


def test_processes_of_a_sweep_know_what_is_registered_and_installed(studied):
    rate = []
    for case in (1, 2):
        path = studied[0] / "sweep" / f"case_000{case}" / "rig.nc"
        with netCDF4.Dataset(path) as file:
            assert "wear law mine: study 7" in file.plugins
            assert "tangential model fine_fastsim: wearsim-by-work 1.0" in file.plugins
            rate.append(file["worn_area"][1].max() / file["distance"][1])
    assert rate[1] / rate[0] == pytest.approx(
        3.0, rel=0.02
    )  # the profiles differ after the first step


def test_the_command_line_says_that_a_law_may_be_of_a_script_and_how_it_gets_it(
    studied, monkeypatch, capsys
):
    """Check and resume; a name that is nearly that of a shipped law is a slip."""
    monkeypatch.chdir(studied[0])
    for words in (
        ("check", "own.toml"),
        ("resume", "own"),
        ("run", "own.toml", "--out", "own"),
    ):
        assert main([*words]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert 'law = "mine" is not known; known: archard' in line
        assert line.endswith(
            "; a wear law that a script registers is known in that script alone: run "
            "and resume there, or make it a package with the entry point "
            "wearsim.wear_laws (workflows/plug_in)"
        )
    assert main(["check", "slip.toml"]) == 2
    slip = capsys.readouterr().err
    assert 'did you mean "archard"?' in slip
    assert "script" not in slip


class Point:
    """Entry point of a package."""

    def __init__(self, name, value, package="mine"):
        self.name, self.load, self.value = name, lambda: value, f"{package}:X"
        self.dist = type("Distribution", (), {"name": package, "version": "1.0"})


@pytest.fixture
def packages(monkeypatch):
    """Function that gives the wear laws of a process in which entry points are
    installed.
    """

    def laws(points):
        monkeypatch.setattr(metadata, "entry_points", lambda group: points)
        return Registry(
            "wear law",
            [wearsim.WEAR_LAWS["usfd"]],
            group=wearsim.WEAR_LAWS.group,
            record=wearsim.WearLaw,
            function="depth",
        )

    return laws


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (
            [Point("mine", wearsim.WEAR_LAWS["usfd"])],
            "cannot be used: mine:X has the name 'usfd'; call",
        ),
        (
            [Point("mine", 3)],
            "of mine 1.0 cannot be used: a wear law must be a WearLaw; given is 3$",
        ),
        (
            [Point("by_work", law()), Point("by_work", law(), "yours")],
            (
                'wear law "by_work" is in mine 1.0 and in yours 1.0; uninstall one of '
                "them$"
            ),
        ),
    ],
)
def test_an_entry_point_that_is_none_is_named_with_its_package(
    packages, points, reason
):
    with pytest.raises(wearsim.WearsimError, match=reason):
        packages(points)[points[0].name]


def test_what_a_script_registers_replaces_a_package(packages):
    laws = packages([Point("by_work", law())])
    laws.add(law(coefficients="own"), "study")
    assert laws["by_work"].coefficients == "own"
    assert laws.source_of("by_work") == "study"


@pytest.mark.slow
def test_the_example_package_installs_with_pip(tmp_path):
    """Into a folder of the path, by the builder that its own file names."""
    install = [
        "-m",
        "pip",
        "-q",
        "install",
        "--no-deps",
        "--target",
        str(tmp_path / "site"),
        str(PACKAGE),
    ]
    subprocess.run([sys.executable, *install], check=True)
    variables = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path / "site")]),
    }
    asked = (
        "import wearsim; print(wearsim.WEAR_LAWS['by_work'].coefficients, 'by_work' "
        "in wearsim.WEAR_LAWS)"
    )
    done = subprocess.run(
        [sys.executable, "-c", asked], env=variables, check=True, capture_output=True
    )
    assert done.stdout.split() == [b"made_up_2026", b"True"]


def test_a_law_without_coefficients_runs_and_resumes(own_records, tmp_path):
    wearsim.register(law(), source="mine 0.1")
    (path,) = wearsim.run(scene("by_work", also_evaluate=["usfd"]), tmp_path / "out")
    assert wearsim.resume(tmp_path / "out") == (path,)
    with wearsim.open_results(path) as data:
        assert data.attrs["plugins"] == "wear law by_work: mine 0.1"
        assert data["regime_name"].values.tolist() == ["all"]
        assert float(data["max_wear_depth"][-1].max()) > 0.0
    assert main(["report", str(tmp_path / "out")]) == 0
    assert "mine 0.1" in (tmp_path / "out" / "report.html").read_text()


def test_a_shipped_scene_has_no_plug_ins(tmp_path):
    (path,) = wearsim.run(scene("usfd"), tmp_path / "out")
    with netCDF4.Dataset(path) as file:
        assert "plugins" not in file.ncattrs()


def test_a_record_replaces_the_one_before(own_records):
    wearsim.register(law())
    wearsim.register(law(coefficients="own_tests"), source="later")
    assert wearsim.WEAR_LAWS["by_work"].coefficients == "own_tests"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: law(name="usfd"),
            'wear law "usfd" is shipped; give yours another name',
        ),
        (
            lambda: law(name="by work"),
            "name = 'by work' of a wear law must be one word",
        ),
        (lambda: law("depth"), 'depth of wear law "by_work" must be a function'),
        (lambda: law(forms=()), r"forms = \(\) must be a tuple of local, patch_mean"),
        (
            lambda: law(parameters=("heat",)),
            r"parameters = \('heat',\) must be a tuple of density, ",
        ),
        (
            lambda: wearsim.WearLaw("mine", by_work, "all", None),
            "regimes = 'all' must be names, such as",
        ),
        (
            lambda: by_work,
            "cannot be registered; give one of WearLaw, FatigueLaw, NormalModel, ",
        ),
        (
            lambda: wearsim.FatigueLaw("mine", fails, "damage", "burstow_2004", ()),
            "has the index quantity 'damage'; give one of fatigue_index, ",
        ),
        (
            lambda: wearsim.CoefficientSet("mine", "usfd", "", "", "", (), {}),
            r"laws = 'usfd' must be a tuple of names, such as \(\"usfd\",\)",
        ),
        (
            lambda: wearsim.CoefficientSet(
                "mine", ("usfd",), "", "", "", (), {"k": 1.0}
            ),
            "k must be a Coefficient, whose value is a number",
        ),
    ],
)
def test_a_record_that_cannot_be_used_is_an_error(own_records, make, message):
    with pytest.raises(wearsim.WearsimError, match=message) as caught:
        wearsim.register(make())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("depth", "message"),
    [
        (
            fails,
            (
                r"\"by_work\" \(mine 1\) failed: AttributeError: .*no_such_.* "
                r"\(test_plug_ins.py:\d+\)$"
            ),
        ),
        (
            lambda fields, area: 0.0,
            "failed: TypeError: .* unexpected keyword argument 'form'$",
        ),
        (
            lambda *given, form: None,
            r"wear law \"by_work\" \(mine 1\) returns a NoneType, not a ndarray$",
        ),
        (
            lambda fields, *given, form: fields.strip_work,
            r"depths \(2, \d+\), not \(1, 2, \d+\): regimes",
        ),
        (
            lambda fields, *given, form: -fields.strip_work[None],
            "a depth below 0; check its coefficients",
        ),
        (
            lambda fields, area, own, form: own["k"],
            'k is no value of coefficients = "", which has none$',
        ),
    ],
)
def test_a_law_that_fails_is_one_line(own_records, tmp_path, depth, message):
    wearsim.register(law(depth), source="mine 1")
    with pytest.raises(wearsim.WearsimError, match=message) as caught:
        wearsim.run(scene("by_work"), tmp_path / "out")
    assert "\n" not in str(caught.value)


def test_a_model_that_fails_is_one_line(own_records):
    shipped = (
        wearsim.TANGENTIAL_MODELS["fastsim"],
        wearsim.NORMAL_MODELS["kik_piotrowski"],
    )
    wearsim.register(
        *(replace(one, name="broken", solve=fails) for one in shipped), source="mine 1"
    )
    bodies = (
        wearsim.wheelset("S1002"),
        wearsim.rails("60E1"),
        wearsim.ContactConditions.of(3e-3),
    )
    for models, kind in (
        (("kik_piotrowski", "broken"), "tangential"),
        (("broken", "fastsim"), "normal"),
    ):
        message = (
            rf'{kind} model "broken" \(mine 1\) failed: AttributeError: '
            r".*no_such_attribute"
        )
        with pytest.raises(wearsim.WearsimError, match=message):
            wearsim.solve_contact(*bodies, wearsim.ContactModels(*models))


def test_a_fatigue_law_of_ones_own_is_in_the_result(own_records, tmp_path):
    shipped = wearsim.FATIGUE_LAWS["surface_fatigue_index"]
    mine = replace(
        wearsim.COEFFICIENT_SETS[shipped.coefficients],
        name="own_steel",
        laws=("softer",),
    )
    softer = replace(shipped, name="softer", coefficients="own_steel")
    wearsim.register(
        softer, mine.with_value("shear_yield", 200.0, "own tests"), source="steels 2"
    )
    (path,) = wearsim.run(
        scene() | {"fatigue": {"laws": ["softer", shipped.name]}}, tmp_path / "out"
    )
    with wearsim.open_results(path) as data:
        own, other = data["fatigue_damage"].isel(step=-1).max(["wheel", "point"]).values
        assert own > other
        assert (
            data.attrs["plugins"]
            == "fatigue law softer: steels 2; coefficient set own_steel: steels 2"
        )
