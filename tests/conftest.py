"""Settings and checks that tests of several rooms share."""

import contextlib
import copy
import functools
import gc
import importlib.util
import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# First calls compile kernels, which no deadline allows for; the same examples in every
# run.
settings.register_profile("wearsim", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("wearsim")


# Looking for garbage among the many objects of figures, data sets and compilation each
# time 700 are new takes up to a fifth of the time.
gc.set_threshold(50_000, 20, 20)


# What two processes import before workers start, each half of it first: in a fresh
# environment modules are compiled on import, which each worker would do for itself.
# Then pairs of models that together call every kernel: the second process begins when
# the first one has compiled what all pairs share.
IMPORTED = (
    "numba",
    "scipy.interpolate",
    "scipy.optimize",
    "xarray",
    "netCDF4",
    "matplotlib.figure",
    "hypothesis",
)
COMPILED = (
    (("kik_piotrowski", "fastsim"), ("coupled_strips", "coupled_strips")),
    (("half_space", "half_space"),),
)
# Looking for garbage among the compiler's millions of objects, which all live on, takes
# a sixth of its time.
PROGRAM = """
import gc, importlib, os, sys
gc.disable()
for name in {names}:
    importlib.import_module(name)
sys.stdin.readline()
progress, sys.stdout = sys.stdout, open(os.devnull, "w")
print("imported", file=progress, flush=True)
sys.stdin.readline()
from wearsim.cli import main
for normal, tangential in {pairs}:
    main(["contact", "--yaw-mrad", "1", "--json", "--normal", normal, "--tangential", tangential])
    print("compiled", file=progress, flush=True)
"""
CONTACT = Path(__file__).parents[1] / "wearsim" / "contact"
compiling = []


def compiled_before():
    """Whether the newest entry of numba's cache is newer than all modules that hold
    kernels.
    """
    cache = Path(os.environ.get("NUMBA_CACHE_DIR", CONTACT))
    newest = [
        max((path.stat().st_mtime for path in folder.rglob(pattern)), default=0.0)
        for folder, pattern in ((cache, "*.nbi"), (CONTACT, "*.py"))
    ]
    return newest[0] > newest[1]


def pytest_configure(config):
    """Import modules and compile kernels once, the latter while workers start and
    collect.
    """
    if hasattr(config, "workerinput") or not getattr(
        config.option, "numprocesses", None
    ):
        return
    if compiled_before():
        return
    before = subprocess.DEVNULL  # what the process before has done
    for names, pairs in zip((IMPORTED, IMPORTED[::-1]), COMPILED, strict=True):
        command = [sys.executable, "-c", PROGRAM.format(names=names, pairs=pairs)]
        compiling.append(
            subprocess.Popen(command, stdin=before, stdout=subprocess.PIPE)
        )
        before = compiling[-1].stdout
    before.readline()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished():
    """Let no worker begin before the kernels are there."""
    for process in compiling:
        process.wait()


def pytest_unconfigure():
    """Leave no process behind when there was nothing to wait for."""
    for process in compiling:
        process.kill()
        process.communicate()


@pytest.fixture(scope="session", autouse=True)
def figures_in_outline():
    """Pages of reports hold figures that are made, but not drawn: drawing is most of
    the time of a report.
    """
    from wearsim.report import html

    with pytest.MonkeyPatch.context() as patch:
        drawn = html.to_svg
        patch.setattr(
            html,
            "to_svg",
            lambda figure, name: f'<svg class="{name}"><path d="M0 0"/></svg>',
        )
        yield drawn


@pytest.fixture(scope="session")
def drawing(figures_in_outline):
    """Context in which pages hold whole figures."""

    @contextlib.contextmanager
    def context():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("wearsim.report.html.to_svg", figures_in_outline)
            yield

    return context


@pytest.fixture(scope="session")
def write_campaign():
    """Writer of small made-up campaigns, for the rooms that only read results."""
    path = Path(__file__).parent / "translation" / "synthetic_campaign.py"
    spec = importlib.util.spec_from_file_location("made_up_campaign", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.write_campaign


@pytest.fixture(scope="session")
def scene_text():
    """Function that writes the scene of a small campaign: S1002 on 60E1 1:40, on
    rollers of 1 m or on rails.

    Of each block (or class of track) the keys that are not load, speed and friction; of
    the tables further lines, below which further tables may stand. [campaign] comes
    last. The contact models are the fast ones unless the lines of [contact] name
    others.
    """

    def text(
        *running,
        kind="rig",
        contact="strips = 12\ncells = 12",
        counterface="",
        campaign="distance_km = 8\npoint_spacing_mm = 0.5",
        more="",
    ):
        table = {"rig": "[[operation.block]]", "field": "[[operation.class]]"}[kind]
        roller = "roller_radius_mm = 1000\n" if kind == "rig" else ""
        if not re.search("^(model|normal|tangential) *=", contact, re.MULTILINE):
            contact = f'model = "fast"\n{contact}'
        parts = [
            f'[scene]\nkind = "{kind}"',
            '[wheelset]\nprofile = "S1002"',
            (
                '[counterface]\nprofile = "60E1"\ninclination = "1:40"\n'
                f"gauge_mm = 1435\n{roller}{counterface}"
            ),
            f"[contact]\n{contact}",
            more,
        ]
        for number, own in enumerate(running, start=1):
            keys = {
                "name": f"{number}",
                "load_kN": 80,
                "speed_km_h": 72,
                "friction": 0.35,
                **own,
            }
            parts.append(
                "\n".join(
                    [
                        table,
                        *(
                            f"{key} = {json.dumps(value)}"
                            for key, value in keys.items()
                        ),
                    ]
                )
            )
        return "\n".join([*parts, f"[campaign]\n{campaign}", ""])

    return text


@pytest.fixture(scope="session")
def coarse_rig():
    """Function that writes the scene of a rig on a coarse grid, with further lines
    of [campaign].
    """
    contact = 'model = "fast"\nstrips = 8\ncells = 8'
    wear = 'law = "usfd"\ncoefficients = "lewis_dwyer_joyce_2004"'
    given = (Path(__file__).parent / "data" / "scene_rig.toml").read_text()
    head, operation = given.split("[[operation.block]]", 1)

    def text(distance_km, *lines):
        own = operation.replace("distance_km = 100", f"distance_km = {distance_km}")
        own += "\n" + "\n".join(
            ["integrator = 'euler'", "point_spacing_mm = 0.5", *lines, ""]
        )
        return f"{head}[contact]\n{contact}\n[wear]\n{wear}\n[[operation.block]]{own}"

    return text


@pytest.fixture
def impatient(monkeypatch):
    """Result files that cannot be opened are given up after a twentieth of a second."""
    monkeypatch.setattr("wearsim.results.file.RETRY_SECONDS", 0.05)


@pytest.fixture
def undrawn(monkeypatch):
    """Directories whose report a command writes: a word instead of figures, dearer than
    small campaigns.
    """
    reported = []

    def write(directory, loaded=None, *, side_by_side=None):
        reported.append(Path(directory))
        (Path(directory) / "report.html").write_text("report")
        return Path(directory) / "report.html"

    monkeypatch.setattr("wearsim.report.html.write_report", write)
    return reported


@pytest.fixture
def own_records(monkeypatch):
    """Forget what the test registers."""
    from wearsim import plugins

    monkeypatch.setattr(plugins, "_registered", {})
    for registry in plugins._REGISTRIES.values():
        for name in ("_records", "_sources"):
            monkeypatch.setattr(registry, name, dict(getattr(registry, name)))


@pytest.fixture(scope="session", autouse=True)
def leaf_kernels_have_one_variant():
    """After all tests: a second variant of a kernel means that results hang on what was
    called before.
    """
    yield
    variants = {
        f"{module}.{name}": [str(signature) for signature in value.signatures]
        for module, members in list(sys.modules.items())
        if module.startswith("wearsim.contact")
        for name, value in vars(members).items()
        if hasattr(value, "py_func")
        and value.targetoptions.get("fastmath")
        and len(value.signatures) > 1
    }
    assert not variants


def listed_once(of):
    """Return the function with a memory, which gives copies."""
    known = functools.cache(of)
    return lambda data: copy.copy(known(data))


@pytest.fixture
def assert_cf(tmp_path, monkeypatch):
    """Fail on any finding of the CF 1.11 checker, also a mere recommendation; needs the
    extra `cf`.
    """

    def check(path):
        from compliance_checker.cf import util
        from compliance_checker.runner import CheckSuite, ComplianceChecker

        CheckSuite.load_all_available_checkers()
        report = tmp_path / "cf.txt"
        with monkeypatch.context() as once:
            # Else the checker lists the same variables anew for each variable: nine
            # tenths of its time.
            for name, of in inspect.getmembers(util, inspect.isfunction):
                if name.startswith("get_") and list(
                    inspect.signature(of).parameters
                ) == ["nc"]:
                    once.setattr(util, name, listed_once(of))
            passed, errors = ComplianceChecker.run_checker(
                str(path),
                ["cf:1.11"],
                0,
                "strict",
                output_filename=str(report),
                output_format="text",
            )
        assert not errors
        assert passed, report.read_text()
        assert "All tests passed!" in report.read_text()

    return check
