import pytest

from wearsim.report.html import write_report
from wearsim.results import open_results


@pytest.fixture
def without_figures(monkeypatch):
    """Reports have tables and texts only: figures take most of their time."""
    monkeypatch.setattr("wearsim.report.sections.figures", lambda *_, **__: iter(()))


@pytest.fixture(scope="session")
def run_directory(tmp_path_factory, write_campaign, drawing):
    """A rig and a field campaign of different depth and band, and their report with whole figures."""
    folder = tmp_path_factory.mktemp("run")
    write_campaign(folder / "rig.nc", "rig", 6, 20e-9)
    write_campaign(folder / "field.nc", "field", 9, 8e-9)
    with drawing():
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
