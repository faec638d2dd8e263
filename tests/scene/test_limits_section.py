"""[campaign.limits] of a scene."""

from pathlib import Path

import pytest

from wearsim.results.limits import LIMITED
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import LIMIT_KEYS as KEYS

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()


def test_every_measure_with_a_limit_has_a_key():
    assert set(KEYS) == set(LIMITED)


def test_limits_reach_the_campaign_in_si(folder):
    Path("scene.toml").write_text(
        RIG
        + (
            "\n[campaign.limits]\nflange_thickness_mm = 22\ndepth_mm = 3\n"
            "conicity = 0.4\ndamage = 1\n"
        )
        + "end = true\n"
        + '[fatigue]\nlaws = ["wlrm"]\n'
    )
    setup = build(load_scene("scene.toml"))
    assert dict(setup.control.limits) == {
        "max_wear_depth": pytest.approx(3e-3, rel=1e-15),
        "flange_thickness": pytest.approx(22e-3, rel=1e-15),
        "equivalent_conicity": 0.4,
        "fatigue_damage": 1.0,
    }
    assert setup.control.end_at_limit
    assert setup.warnings == ()


@pytest.mark.parametrize(
    ("lines", "line", "message"),
    [
        (
            "flange_thicknes_mm = 22",
            "flange_thicknes_mm",
            "did you mean flange_thickness_mm?",
        ),
        (
            "flange_thickness_mm = 2",
            "flange_thickness_mm",
            "flange_thickness_mm = 2 must be at least 15",
        ),
        ("hollowing_mm = 0", "hollowing_mm", "hollowing_mm = 0 must be above 0"),
        (
            "end = true",
            "[campaign.limits]",
            "[campaign.limits] has no limit; write one",
        ),
        ("", "[campaign.limits]", "[campaign.limits] has no limit; write one"),
        ("end = 1\ndepth_mm = 2", "end = 1", "end = 1"),
        (
            "flange_thickness_mm = 33\nend = true",
            "flange_thickness_mm",
            "flange_thickness_mm = 33 is met by the new right wheel (32.5 mm) "
            "already, and the campaign would end before it begins",
        ),
        (
            (
                'damage = 1\n[fatigue]\nlaws = ["surface_fatigue_index_local", '
                '"stress_index"]'
            ),
            "damage = 1",
            (
                "damage = 1 needs a fatigue law that counts cycles; "
                "surface_fatigue_index_local, stress_index"
            ),
        ),
    ],
)
def test_faults_stand_at_their_line(folder, faults_of, line_with, lines, line, message):
    text = f"{RIG}\n[campaign.limits]\n{lines}\n"
    (fault,) = faults_of(text)
    assert fault.startswith(f"scene.toml:{line_with(text, line)}: ")
    assert message in fault


def test_limits_behind_the_new_wheel_are_warnings_where_the_campaign_goes_on(
    folder, line_with
):
    text = (
        f"{RIG}\n[campaign.limits]\nconicity = 0.1\nflange_height_mm = 27\n"
        "flange_thickness_mm = 22\n"
    )
    Path("scene.toml").write_text(text)
    height, conicity = sorted(build(load_scene("scene.toml")).warnings, reverse=True)
    assert height == (
        f"scene.toml:{line_with(text, 'flange_height')}: flange_height_mm = 27 is met "
        "by the new right wheel (28 mm) already"
    )
    assert conicity.startswith(
        f"scene.toml:{line_with(text, 'conicity')}: conicity = 0.1 is met by the new"
    )
