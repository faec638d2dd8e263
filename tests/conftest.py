"""Settings and checks that tests of several rooms share."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# First calls compile kernels, which no deadline allows for; the same examples in every run.
settings.register_profile("wearsim", deadline=None, derandomize=True)
settings.load_profile("wearsim")


def pytest_configure(config):
    """Compile the kernels once, model beside model, before workers start: each would do it for itself."""
    if hasattr(config, "workerinput") or not getattr(config.option, "numprocesses", None):
        return
    command = [sys.executable, "-m", "wearsim", "contact", "--yaw-mrad", "1", "--json"]
    pairs = [("kik_piotrowski", "fastsim"), ("knothe_le_the", "fastsim"), ("half_space", "half_space")]
    running = [
        subprocess.Popen(
            [*command, "--normal", normal, "--tangential", tangential], stdout=subprocess.DEVNULL
        )
        for normal, tangential in pairs
    ]
    for process in running:
        process.wait()


@pytest.fixture(scope="session")
def write_campaign():
    """Writer of small made-up campaigns, for the rooms that only read results."""
    path = Path(__file__).parent / "translation" / "synthetic_campaign.py"
    spec = importlib.util.spec_from_file_location("made_up_campaign", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.write_campaign


@pytest.fixture(scope="session", autouse=True)
def leaf_kernels_have_one_variant():
    """After all tests: a second variant of a kernel means that results hang on what was called before."""
    yield
    variants = {
        f"{module}.{name}": [str(signature) for signature in value.signatures]
        for module, members in list(sys.modules.items())
        if module.startswith("wearsim.contact")
        for name, value in vars(members).items()
        if hasattr(value, "py_func") and value.targetoptions.get("fastmath") and len(value.signatures) > 1
    }
    assert not variants


@pytest.fixture
def assert_cf(tmp_path):
    """Fail on any finding of the CF 1.11 checker, also a mere recommendation; needs the extra `cf`."""

    def check(path):
        from compliance_checker.runner import CheckSuite, ComplianceChecker

        CheckSuite.load_all_available_checkers()
        report = tmp_path / "cf.txt"
        passed, errors = ComplianceChecker.run_checker(
            str(path), ["cf:1.11"], 0, "strict", output_filename=str(report), output_format="text"
        )
        assert not errors
        assert passed, report.read_text()
        assert "All tests passed!" in report.read_text()

    return check
