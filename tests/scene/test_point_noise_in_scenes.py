"""Rounded profiles of scenes: a warning where they change the contact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.profile.files import write_profile
from wearsim.profile.shape import resample
from wearsim.profile.sources import standard_profile
from wearsim.scene import load_scene
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.setup import warnings_of as warnings_of_scene
from wearsim.studies.contact_noise import noise_notes
from wearsim.studies.contact_points import operating_points, solve_points

RIG = (Path(__file__).parents[1] / "data/scene_rig.toml").read_text()


@pytest.fixture
def files(folder):
    """S1002 with points 0.9 mm apart, exact and rounded to 0.01 mm."""
    points = resample(standard_profile("S1002"), 0.9e-3)
    rounded = [1e-5 * np.round(1e5 * each) for each in (points.y, points.z)]
    write_profile(points, "exact.csv")
    write_profile(replace(points, y=rounded[0], z=rounded[1]), "coarse.csv")


def warnings_of(text):
    Path("scene.toml").write_text(text)
    return [str(one) for one in check_contact(load_scene("scene.toml"))]


def test_a_scene_warns_of_points_that_change_its_contact(files, changed):
    """Points 0.9 mm apart, rounded to 0.01 mm, raise the largest pressure by 22 to
    26 %.
    """
    assert warnings_of(changed(RIG, ('"S1002"', '"exact.csv"'))) == []
    (warning,) = warnings_of(changed(RIG, ('"S1002"', '"coarse.csv"')))
    assert 'profile = "coarse.csv": noise of 2' in warning
    change = float(warning.partition("pressure by +")[2].partition(" %")[0])
    assert 20.0 <= change <= 30.0
    assert warning.endswith("which leaves about 1.8 % (rms)")
    wavelength = warning.partition("smooth_mm = ")[2].partition(" in")[0]
    cured = changed(RIG, ('"S1002"', f'"coarse.csv"\nsmooth_mm = {wavelength}'))
    assert warnings_of(cured) == []


def test_a_scene_warns_of_noise_in_the_profile_that_wheels_are_reprofiled_to(
    files,
):
    table = '[campaign.reprofiling]\nat_km = [50]\nprofile = "coarse.csv"\n'
    Path("scene.toml").write_text(f"{RIG}\n{table}")
    (warning,) = warnings_of_scene(load_scene("scene.toml"))
    assert 'profile = "coarse.csv": noise of 2' in str(warning)
    assert str(warning).endswith("; write smooth_mm in [campaign.reprofiling]")
    Path("scene.toml").write_text(f"{RIG}\n{table}smooth_mm = 9\n")
    assert not warnings_of_scene(load_scene("scene.toml"))


def notes_of(**texts):
    """Notes on the noise of points, whose texts are given by column."""
    points, faults = operating_points(pd.DataFrame(texts, dtype=object))
    assert faults == []
    return noise_notes(points, solve_points(points))


def test_a_contact_notes_points_that_change_it(files):
    """Of exact and rounded points in one table the rounded ones are noted."""
    ((rows, note),) = notes_of(wheel=["exact.csv", "coarse.csv", "S1002"])
    assert rows == [1]
    assert note.startswith("coarse.csv: noise of 2")
    assert "changes the largest pressure by +3" in note
    wavelength = note.partition("--smooth-mm ")[2].partition(",")[0]
    assert note.endswith("which leaves about 1.9 % (rms)")
    assert notes_of(wheel=["coarse.csv"], smooth_mm=[wavelength]) == []
