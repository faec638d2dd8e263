"""[campaign.limits] of a scene."""

from pathlib import Path

import pytest

from wearsim.profile.measures import MeasuringRule, running_circle_level
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


def test_condemning_limits_of_a_fleet_reach_the_campaign(folder):
    """Worn amounts against the new profile, and the diameter without a lathe."""
    Path("scene.toml").write_text(
        RIG + "\n[campaign.limits]\nroot_wear_mm = 6.0\ntread_wear_mm = 6.5\n"
        "flange_wear_mm = 3.0\ndiameter_mm = 850\n"
    )
    setup = build(load_scene("scene.toml"))
    assert dict(setup.control.limits) == {
        "root_wear": pytest.approx(6e-3, rel=1e-15),
        "tread_wear": pytest.approx(6.5e-3, rel=1e-15),
        "flange_wear": pytest.approx(3e-3, rel=1e-15),
        "wheel_diameter": pytest.approx(0.85, rel=1e-15),
    }
    assert setup.control.reprofiling is None


def test_the_places_of_measures_reach_the_campaign(folder):
    """The radius is that of the running circle: lower there by z of the S1002."""
    places = "measuring_height_mm = 12\nrunning_circle_mm = 65\n"
    Path("scene.toml").write_text(RIG.replace("[wheelset]\n", "[wheelset]\n" + places))
    setup = build(load_scene("scene.toml"))
    assert setup.measuring == MeasuringRule(12e-3, 65e-3)
    wheelset = setup.wheelset
    level = running_circle_level(wheelset.right.y, wheelset.right.z, setup.measuring)
    assert wheelset.radius + level == pytest.approx(0.46, abs=1e-6)
    assert level > 0.15e-3


def test_sd_of_a_limit_is_measured_where_the_scene_says(folder, faults_of):
    """32.5 mm at 10 mm, less at 12 mm: the limit is met by the new wheel there only."""
    limit = "\n[campaign.limits]\nflange_thickness_mm = 32.2\nend = true\n"
    Path("scene.toml").write_text(RIG + limit)
    assert build(load_scene("scene.toml")).control.end_at_limit
    at_12 = RIG.replace("[wheelset]\n", "[wheelset]\nmeasuring_height_mm = 12\n")
    (fault,) = faults_of(at_12 + limit)
    assert "flange_thickness_mm = 32.2 is met by the new right wheel (31" in fault
