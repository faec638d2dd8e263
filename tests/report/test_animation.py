"""The film of the running wear: what it draws, and the file it writes."""

import itertools

import numpy as np
import pytest
from PIL import Image

from wearsim.cli import main
from wearsim.errors import ResultError
from wearsim.profile.shape import arc_length
from wearsim.report.figures.animation import animate_wear, patch_lines
from wearsim.report.figures.campaign import worn_shape
from wearsim.results import open_results


@pytest.fixture(scope="module")
def result(write_campaign, tmp_path_factory):
    """States every 10 km up to 40 km, at the end 0.4 mm of the right wheel are worn."""
    return write_campaign(tmp_path_factory.mktemp("film") / "rig.nc", "rig", 4, 1e-8)


@pytest.fixture(scope="module")
def dataset(result):
    with open_results(result) as data:
        return data.load()


def test_patches_lie_on_the_profile_and_are_as_wide_as_they_are(dataset):
    drawn = worn_shape(dataset, 0, 40e3, 1.0)
    lines, pressure = patch_lines(dataset, 0, 40e3, drawn)
    wearing = dataset["weight"].values > 0.0
    here = (dataset["side"].values[4] == 0) & wearing[:, None]
    assert (
        len(lines) == np.count_nonzero(here) == 6
    )  # two patches of three points, none of the monitors
    np.testing.assert_array_equal(pressure, dataset["max_pressure"].values[4][here])
    for line, centre, width in zip(
        lines,
        dataset["wheel_y"].values[4][here],
        dataset["width"].values[4][here],
        strict=True,
    ):
        assert line[7, 0] == pytest.approx(centre, abs=1e-12)
        assert arc_length(*line.T)[-1] == pytest.approx(
            width, rel=0.01
        )  # chords cut vertices


def test_the_film_moves_and_states_its_exaggeration(dataset, tmp_path, monkeypatch):
    labels = []
    monkeypatch.setattr(
        "wearsim.report.figures.animation.label_axes",
        lambda ax, x, y: labels.append(y) or ax.set_ylabel(y),
    )
    path = animate_wear(dataset, tmp_path / "film.gif", frames=3)
    assert labels == ["Height, outward is up, wear ×10 [mm]"] * 2
    with Image.open(path) as film:
        assert film.n_frames == 3
        frames = [
            np.asarray(film.convert("RGB")) for k in range(3) if film.seek(k) is None
        ]
    for before, after in itertools.pairwise(frames):
        assert np.count_nonzero(before != after) > 1000


def test_the_command_names_the_file(result, tmp_path, capsys, monkeypatch):
    target = tmp_path / "film.gif"
    monkeypatch.setattr(
        "wearsim.report.figures.animation.animate_wear",
        lambda data, path: path.write_text("film") and path,
    )
    assert main(["inspect", str(result), "--animate", str(target)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(target)
    assert target.read_text() == "film"


def test_one_line_for_each_fault(result, dataset, tmp_path, capsys):
    def fault(*words):
        assert main(["inspect", *map(str, words)]) == 2
        return capsys.readouterr().err

    assert (
        fault(result, "--animate", "film.mp4")
        == "--animate = film.mp4 must end with .gif\n"
    )
    gone = tmp_path / "gone" / "film.gif"
    assert fault(result, "--animate", gone) == (
        f"{gone} cannot be written: No such file or directory; choose another folder\n"
    )
    with pytest.raises(ResultError, match="no wear step yet"):
        animate_wear(dataset.isel(step=slice(0, 1)), tmp_path / "film.gif")
