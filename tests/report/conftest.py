import importlib.util
import sys
from pathlib import Path

import pytest

from wearsim.report.html import write_report
from wearsim.results import open_results


def _builder():
    name = "wearsim_synthetic_campaign"
    if name not in sys.modules:
        path = Path(__file__).parent.parent / "translation" / "synthetic_campaign.py"
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="session")
def write_campaign():
    return _builder().write_campaign


@pytest.fixture(scope="session")
def run_directory(tmp_path_factory, write_campaign):
    """A rig and a field campaign of different depth and band, and their report."""
    folder = tmp_path_factory.mktemp("run")
    write_campaign(folder / "rig.nc", "rig", 6, 20e-9)
    write_campaign(folder / "field.nc", "field", 9, 8e-9)
    write_report(folder)
    return folder


@pytest.fixture(scope="session")
def rig(run_directory):
    with open_results(run_directory / "rig.nc") as data:
        return data.load()


@pytest.fixture(scope="session")
def field(run_directory):
    with open_results(run_directory / "field.nc") as data:
        return data.load()
