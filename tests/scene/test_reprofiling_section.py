"""[campaign.reprofiling] of a scene."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.scene import build, load_scene

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
COMPARE = (DATA / "scene_compare.toml").read_text()
LIMITS = "\n[campaign.limits]\nflange_thickness_mm = 30\nhollowing_mm = 2\n"


def with_turning(lines, limits=LIMITS):
    return f"{RIG}{limits}[campaign.reprofiling]\n{lines}\n"


def test_rules_and_templates_reach_the_campaign(folder):
    Path("scene.toml").write_text(
        with_turning(
            'at_limits = ["hollowing_mm", "flange_thickness_mm"]\nat_km = [10, 20.5]\n'
            "cut_mm = 0.2"
        )
    )
    setup = build(load_scene("scene.toml"))
    rules = setup.control.reprofiling
    assert rules.limits == ("hollowing", "flange_thickness")
    assert rules.places == (10e3, 20.5e3)
    assert rules.cut == pytest.approx(0.2e-3, rel=1e-15)
    assert setup.templates == (setup.wheelset.right, setup.wheelset.left)


def test_turnings_beyond_the_end_are_warned_of(folder, line_with):
    """A campaign may be shortened, by hand or to compare, without another list of
    turnings.
    """
    text = with_turning("at_km = [0.001, 1e6]")
    Path("scene.toml").write_text(text)
    (message,) = build(load_scene("scene.toml")).warnings
    assert message.startswith(
        f"scene.toml:{line_with(text, 'at_km')}: at_km = 1e+06 is not below the "
        "distance"
    )


def test_another_template_gets_the_points_of_the_wheel_and_its_file_is_told(folder):
    Path("scene.toml").write_text(
        with_turning('at_limits = ["hollowing_mm"]\nprofile = "S1002/e30.5"')
    )
    setup = build(load_scene("scene.toml"))
    right, left = setup.templates
    assert right is left
    assert right.y.shape == setup.wheelset.right.y.shape
    assert np.argmax(right.z) != 0
    assert "campaign.reprofiling.profile S1002/e30.5" in dict(setup.input_hashes)


def test_no_turning_without_the_table(folder):
    setup = build(load_scene("rig.toml"))
    assert setup.control.reprofiling is None
    assert setup.templates is None


@pytest.mark.parametrize(
    ("lines", "line", "message"),
    [
        ("", "[campaign.reprofiling]", "does not say when; write at_limits"),
        ("at_limit = []", "at_limit", "did you mean at_limits?"),
        (
            'at_limits = ["hollowing"]',
            "at_limits",
            '"hollowing" is no limit to reprofile wheels at; did you mean',
        ),
        (
            'at_limits = ["diameter_mm"]',
            "at_limits",
            '"diameter_mm" is no limit to reprofile wheels at',
        ),
        (
            'at_limits = ["conicity"]',
            "at_limits",
            '"conicity" has no value; give it in [campaign.limits]',
        ),
        ("at_km = [20, 10]", "at_km", "must rise from one to the next"),
        ("at_km = [0]", "at_km", "at_km"),
        (
            'at_km = [5]\nprofile = "S1003"',
            'profile = "S1003"',
            "neither a file nor a shipped wheel profile",
        ),
        ('at_km = [5]\nprofile = "60E1"', 'profile = "60E1"\n', "is a rail profile"),
        (
            'at_limits = ["flange_thickness_mm"]\nprofile = "S1002/h28/e29"',
            "flange_thickness_mm",
            (
                "flange_thickness_mm = 30 is met by the reprofiled right wheel (29 "
                "mm), too: wheels would be"
            ),
        ),
    ],
)
def test_faults_stand_at_their_line(folder, faults_of, lines, line, message):
    text = with_turning(lines)
    (fault,) = faults_of(text)
    at = text.rindex(line) if "profile" in line else text.index(line)
    assert fault.startswith(f"scene.toml:{text[:at].count(chr(10)) + 1}: ")
    assert message in fault


@pytest.mark.parametrize(
    ("limits", "turning", "message"),
    [
        (
            "diameter_mm = 920",
            "at_km = [5]",
            "must be below the diameter of the new wheels, 920 mm",
        ),
        (
            "diameter_mm = 921",
            "",
            "must be below the diameter of the new wheels, 920 mm",
        ),
        (
            "damage = 1",
            "",
            (
                "damage = 1 needs a fatigue law that counts cycles; write wlrm among "
                "the laws"
            ),
        ),
    ],
)
def test_limits_that_need_something_else(
    folder, faults_of, line_with, limits, turning, message
):
    table = f"[campaign.reprofiling]\n{turning}\n" if turning else ""
    text = f"{RIG}\n[campaign.limits]\n{limits}\n{table}"
    (fault,) = faults_of(text)
    assert fault.startswith(f"scene.toml:{line_with(text, limits)}: ")
    assert message in fault


def test_turned_wheels_are_not_compared_nor_run_at_the_speed_of_new_ones(
    folder, faults_of, changed
):
    Path("rig.toml").write_text(with_turning("at_km = [5]"))
    (fault,) = faults_of(COMPARE)
    assert fault.startswith("rig.toml:")
    assert "cannot be compared" in fault
    text = with_turning("at_km = [5]") + '[contact]\nrotation = "nominal"\n'
    (fault,) = faults_of(text)
    assert "reprofiled wheels would slide" in fault


def test_a_limit_that_has_the_new_wheel_turned_is_no_fault_of_the_end(folder):
    """A wheel with a thin flange is turned at once and runs on; the template is thick
    enough.
    """
    text = with_turning('at_limits = ["flange_thickness_mm"]\nprofile = "S1002"')
    text = text.replace('profile = "S1002"', 'profile = "S1002/h28/e29"', 1)
    Path("scene.toml").write_text(
        text.replace("hollowing_mm = 2", "hollowing_mm = 2\nend = true")
    )
    assert build(load_scene("scene.toml")).control.end_at_limit
