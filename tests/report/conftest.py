import re
import shutil
from html import unescape

import pytest

from wearsim.campaign.run import run_scene
from wearsim.report.html import write_report
from wearsim.results import open_results


@pytest.fixture
def page_one():
    """Function that gives the words of page one, as people count them: without
    figures.
    """

    def words(text):
        part = text[text.index("<h1>") : text.index("<nav aria")]
        part = re.sub(r"<svg.*?</svg>|<h3>.*?</h3>", " ", part, flags=re.DOTALL)
        return " ".join(unescape(re.sub(r"<[^>]*>", " ", part)).split())

    return words


@pytest.fixture
def without_figures(monkeypatch):
    """Reports have tables and texts only: figures take most of their time."""
    monkeypatch.setattr("wearsim.report.html.figures", lambda *_, **__: iter(()))


@pytest.fixture(scope="session")
def run_directory(tmp_path_factory, write_campaign):
    """A rig and a field campaign of different depth and band, and their report."""
    folder = tmp_path_factory.mktemp("run")
    write_campaign(folder / "rig.nc", "rig", 6, 20e-9)
    write_campaign(folder / "field.nc", "field", 9, 8e-9)
    write_report(folder)
    return folder


@pytest.fixture(scope="session")
def drawn_directory(tmp_path_factory, run_directory, drawing):
    """The same with whole figures."""
    folder = shutil.copytree(run_directory, tmp_path_factory.mktemp("drawn") / "run")
    with drawing():
        write_report(folder)
    return folder


def loaded(path):
    with open_results(path) as data:
        return data.load()


@pytest.fixture(scope="session")
def rig(run_directory):
    return loaded(run_directory / "rig.nc")


@pytest.fixture(scope="session")
def field(run_directory):
    return loaded(run_directory / "field.nc")


@pytest.fixture
def reprofiled(rig):
    """The rig with wheels that are reprofiled in its fourth row, at 30 of 60 km."""
    return rig.assign(last_reprofiling=("step", [0, 0, 0, 3, 3, 3, 3]))


@pytest.fixture(scope="session")
def run_pair(tmp_path_factory, scene_text):
    """Function that runs a rig over 14 km and a field over 30 km: folder of the scenes,
    both results.
    """

    def run(shift_mm, rig, field):
        """`rig` and `field` are what their scenes have besides a block or class of that
        (mean) shift.
        """
        folder = tmp_path_factory.mktemp("pair")
        block = {"name": "curve", "shift_mm": shift_mm, "yaw_mrad": 3, "distance_km": 2}
        spread = {
            "shift_mean_mm": shift_mm - 1,
            "shift_std_mm": 1,
            "positions": 10,
            "share": 1,
        }
        running = {
            "rig": (block, 14, rig),
            "field": ({"name": "curve", "yaw_mrad": 2, **spread}, 30, field),
        }
        for kind, (points, distance, more) in running.items():
            campaign = f"distance_km = {distance}\npoint_spacing_mm = 0.5"
            text = scene_text(points, kind=kind, campaign=campaign, **more)
            (folder / f"{kind}.toml").write_text(text)
        (folder / "compare.toml").write_text(
            '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\n'
            'field = "field.toml"\n'
        )
        run_scene(folder / "compare.toml", folder / "out")
        return folder, [loaded(folder / "out" / f"{kind}.nc") for kind in running]

    return run
