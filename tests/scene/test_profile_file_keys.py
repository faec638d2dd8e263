"""Keys of scenes on the files of points that they name: unit, axes, origin, ends."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from wearsim.profile.files import read_profile
from wearsim.profile.measures import flange_height, flange_thickness
from wearsim.profile.shape import resample
from wearsim.scene import load_scene
from wearsim.scene.inputs import inputs_of
from wearsim.scene.setup import warnings_of

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
APTA = DATA / "exports" / "apta320_inch.csv"


@pytest.fixture
def with_keys(folder, changed):
    """Function that writes a scene of the APTA wheel with further keys of a table."""
    shutil.copy(APTA, folder / "apta.csv")

    def write(wheelset="", counterface=""):
        return changed(
            RIG,
            ('"S1002"\n', f'"apta.csv"\n{wheelset}'),
            ('"60E1"\n', f'"60E1"\n{counterface}'),
        )

    return write


@pytest.mark.parametrize(
    "origin",
    ['origin = "gauge_point"\n', "offset_y_mm = -40.767\noffset_z_mm = 17.28\n"],
)
def test_wheels_in_inches_counted_from_their_gauge_point(with_keys, origin):
    """Sh 26.79 and Sd 32.07 of the APTA 320 profile, of its points moved by hand."""
    Path("scene.toml").write_text(with_keys(f'units = "in"\n{origin}'))
    scene = load_scene("scene.toml")
    wheel = inputs_of(scene).right
    assert 1e3 * flange_height(wheel.y, wheel.z) == pytest.approx(26.79, abs=0.01)
    assert 1e3 * flange_thickness(wheel.y, wheel.z) == pytest.approx(32.07, abs=0.01)
    assert not any("without effect" in str(warning) for warning in warnings_of(scene))


def test_axes_of_a_file_are_those_stated(folder, changed):
    """The points of a wheel, listed with both axes turned, are read as before."""
    read = read_profile(APTA, "wheel", units="in", origin="gauge_point").profile
    turned = np.column_stack((-1e3 * read.y, -1e3 * read.z))
    np.savetxt("turned.csv", turned, "%.9f", ",")
    keys = 'units = "mm"\nformat = "two-column"\nmirror = true\nz_up = true\n'
    Path("scene.toml").write_text(changed(RIG, ('"S1002"\n', f'"turned.csv"\n{keys}')))
    wheel = inputs_of(load_scene("scene.toml")).right
    expected = resample(read, 0.25e-3)
    assert np.allclose(wheel.y, expected.y, rtol=0.0, atol=1e-9)
    assert np.allclose(wheel.z, expected.z, rtol=0.0, atol=1e-9)


def test_rails_end_where_their_points_do(with_keys):
    stated = with_keys('units = "in"\norigin = "gauge_point"\n', 'ends = "sharp"\n')
    Path("sharp.toml").write_text(stated)
    Path("open.toml").write_text(stated.replace("sharp", "open"))
    sharp, as_drawn = (
        inputs_of(load_scene(name)).counterface for name in ("sharp.toml", "open.toml")
    )
    assert len(sharp.y) > len(as_drawn.y)
    for end in (0, -1):
        fall = abs(sharp.z[end] - as_drawn.z[end])
        assert fall == pytest.approx(1e-3, abs=1e-9)
        assert abs(sharp.y[end] - as_drawn.y[end]) == pytest.approx(fall, abs=1e-9)


@pytest.mark.parametrize(
    ("keys", "at", "message"),
    [
        ('units = "inch"\n', "units", "units"),
        ("offset_y_mm = 3000\n", "offset_y_mm", "-2000"),
        ('origin = "gauge"\n', "origin = ", "origin"),
        (
            'origin = "gauge_point"\noffset_z_mm = 1\n',
            "origin = ",
            "origin and offset_z_mm exclude each other",
        ),
        ('units = "in"\n', "profile = ", "state the origin gauge_point"),
        ('units = "mm"\n', "profile = ", "state them with units"),
    ],
)
def test_faults_of_the_keys_name_line_and_key(
    with_keys, faults_of, line_with, keys, at, message
):
    text = with_keys(keys)
    lines = faults_of(text)
    assert any(
        line.startswith(f"scene.toml:{line_with(text, at)}: ") and message in line
        for line in lines
    ), lines
    assert not any("--" in line for line in lines)


def test_keys_without_a_file_of_points_are_without_effect(folder, changed):
    text = changed(RIG, ('"S1002"\n', '"S1002"\nunits = "mm"\n'))
    Path("scene.toml").write_text(changed(text, ('"60E1"\n', '"60E1"\nz_up = true\n')))
    found = [str(warning) for warning in warnings_of(load_scene("scene.toml"))]
    assert len(found) == 2
    assert "units is without effect: no profile of [wheelset] was read" in found[0]
    assert "z_up is without effect: no profile of [counterface] was read" in found[1]


TEMPLATE = """
[campaign.reprofiling]
at_km = [50]
profile = "apta.csv"
"""


def test_the_profile_that_wheels_are_reprofiled_to_has_its_own_keys(with_keys):
    """Those of [wheelset] are of its own files, here of none."""
    text = with_keys().replace("apta.csv", "S1002") + TEMPLATE
    Path("scene.toml").write_text(f'{text}units = "in"\norigin = "gauge_point"\n')
    scene = load_scene("scene.toml")
    template, _ = inputs_of(scene).templates
    height, thickness = (
        1e3 * measure(template.y, template.z)
        for measure in (flange_height, flange_thickness)
    )
    assert (height, thickness) == pytest.approx((26.79, 32.07), abs=0.02)
    Path("scene.toml").write_text(text.replace("apta.csv", "P8") + "smooth_mm = 4\n")
    (warning,) = warnings_of(load_scene("scene.toml"))
    assert "no profile of [campaign.reprofiling] was read" in str(warning)


def test_faults_of_the_keys_of_reprofiling_name_its_line(
    with_keys, faults_of, line_with
):
    text = with_keys().replace("apta.csv", "S1002") + TEMPLATE
    for keys, at, message in (
        ('units = "in"', 'profile = "apta', "state the origin gauge_point"),
        ('origin = "gauge_point"\noffset_y_mm = 1', "origin", "exclude each other"),
    ):
        lines = faults_of(f"{text}{keys}\n")
        start = f"scene.toml:{line_with(f'{text}{keys}', at)}: "
        assert any(line.startswith(start) and message in line for line in lines), lines
