"""Values in range that are hardly meant: a warning each, with its line."""

import re
from pathlib import Path

import pytest

from wearsim.scene import build, load_scene
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.setup import warnings_of

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
FIELD = (DATA / "scene_field.toml").read_text()
ROOT = Path(__file__).parents[2]

CASES = {
    "a diameter as radius": (
        RIG,
        '"S1002"',
        '"S1002"\nradius_mm = 920',
        "radius_mm = 920 is a radius",
    ),
    "another railway": (
        RIG,
        "roller_radius_mm = 1000",
        "roller_radius_mm = 1000\ngauge_mm = 1520",
        "gauge_mm = 1520 is not that of a wheelset with this back_to_back_mm",
    ),
    "yaw": (
        RIG,
        "yaw_mrad = 2",
        "yaw_mrad = 30",
        'yaw_mrad = 30 in block "left" is beyond',
    ),
    "soft steel": (
        RIG,
        "[campaign]",
        "[contact]\nyoungs_GPa = 1\n[campaign]",
        "youngs_GPa = 1 is no Young's",
    ),
    "wet": (
        RIG,
        'name = "right"',
        'name = "wet rail"',
        'friction = 0.9 in block "wet rail" is that of dry surfaces',
    ),
    "axle load": (
        RIG,
        "load_kN = 80",
        "load_kN = 250",
        'load_kN = 250 in block "left" is the load of one wheel',
    ),
    "one name": (
        RIG,
        'name = "right"',
        'name = "left"',
        'name = "left" is that of another block, too',
    ),
    "environment": (
        RIG,
        "environment = 0.5",
        "environment = 10",
        'environment = 10 in block "right" multiplies',
    ),
    "inside of the curve": (
        FIELD,
        "curve_radius_m = -500",
        "curve_radius_m = 500",
        "is to the inside of the curve of curve_radius_m",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_value_that_is_hardly_meant_is_a_warning_with_its_line(folder, case, changed):
    text, old, new, message = CASES[case]
    text = changed(text, (old, new))
    if case == "wet":
        text = changed(text, ("friction = 0.3\n", "friction = 0.9\n"))
    Path("scene.toml").write_text(text)
    (warning,) = [
        one for one in warnings_of(load_scene("scene.toml")) if message in one.message
    ]
    assert (
        text.splitlines()[warning.line - 1] == re.split(" in | is ", warning.message)[0]
    )


CAMPAIGNS = sorted(
    {*ROOT.glob("workflows/*.toml")} - {ROOT / "workflows/sweep_rig.toml"}
)


@pytest.mark.parametrize("path", CAMPAIGNS, ids=lambda path: path.stem)
def test_shipped_scenes_are_plausible(path):
    scene = load_scene(path)
    told = [str(one) for part in scene.parts for one in warnings_of(part)]
    assert not [
        line
        for line in told
        if "is that of" in line or "is beyond" in line or "multiplies" in line
    ]


def test_check_and_run_tell_the_same(folder, changed):
    Path("scene.toml").write_text(
        changed(RIG, ("environment = 0.5", "environment = 10"))
    )
    scene = load_scene("scene.toml")
    (checked,) = check_contact(scene)
    (kept,) = build(scene).warnings
    assert str(checked).endswith(kept)
