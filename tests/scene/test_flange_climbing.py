"""Shifts beyond the flange clearance: warned of, or refused where the wheel derails."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.profile import standard
from wearsim.profile.files import write_profile
from wearsim.scene import load_scene
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.setup import warnings_of

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
FIELD = (
    (DATA / "scene_field.toml")
    .read_text()
    .replace("shift_std_mm = 2.5", "shift_std_mm = 1.5")
)


def warned(text):
    Path("scene.toml").write_text(text)
    return [str(warning) for warning in warnings_of(load_scene("scene.toml"))]


CASES = {  # change of the scene, shift that the user reads, wheel
    "block to the right": (
        RIG,
        "shift_mm = 4",
        "shift_mm = {}",
        "shift_mm = {} is",
        "right",
    ),
    "block to the left": (
        RIG,
        "shift_mm = -3",
        "shift_mm = -{}",
        "shift_mm = -{} is",
        "left",
    ),
    "watched shift": (
        RIG,
        "[-2, 0, 2]",
        "[-2, 0, {}]",
        "shifts_mm[2] = {} is",
        "right",
    ),
    "class without spread": (
        FIELD.replace("curve_radius_m = -500", "curve_radius_m = 500"),
        "shift_mean_mm = 3",
        "shift_mean_mm = -{}",
        "shift_mean_mm = -{} is",
        "left",
    ),
}


# the clearance is 6.6 mm (tests/profile/test_clearance.py), the last accepted shift 4
# mm more
@pytest.mark.parametrize("case", sorted(CASES))
def test_a_shift_beyond_the_clearance_is_warned_of_and_far_beyond_refused(
    folder, faults_of, changed, line_with, case
):
    text, old, new, message, wheel = CASES[case]
    assert warned(changed(text, (old, new.format(6.55)))) == []
    place = f"scene.toml:{line_with(text, old)}: "
    for shift in (6.65, 10.55):
        (warning,) = warned(changed(text, (old, new.format(shift))))
        assert warning.startswith(
            f"{place}{message.format(shift)} beyond the flange clearance of 6.6 mm: "
            f"the {wheel}"
        )
        assert "check gauge_mm = 1435 and back_to_back_mm = 1360" in warning
    for shift in (10.65, 20):
        (fault,) = faults_of(changed(text, (old, new.format(shift))))
        assert fault.startswith(
            f"{place}{message.format(shift)} more than 4 mm beyond the flange "
            "clearance of 6.6 mm"
        )
        assert wheel in fault


def test_the_spread_of_a_class_counts_with_three_standard_deviations(
    folder, faults_of, changed, line_with
):
    place = f"scene.toml:{line_with(FIELD, 'shift_std_mm = 1.5')}: shift_std_mm = "
    old = ("shift_mean_mm = 0", "shift_std_mm = 1.5")
    assert warned(changed(FIELD, (old[0], "shift_mean_mm = -2"))) == []
    (warning,) = warned(changed(FIELD, (old[0], "shift_mean_mm = -2.2")))
    assert warning.startswith(
        f"{place}1.5: 3 standard deviations about shift_mean_mm = -2.2 reach -6.7 mm, "
        "beyond"
    )
    assert "the left wheel climbs its flange" in warning
    (fault,) = faults_of(changed(FIELD, (old[1], "shift_std_mm = 3.6")))
    assert fault.startswith(
        f"{place}3.6: 3 standard deviations about shift_mean_mm = 0 reach 10.8 mm, "
        "more than"
    )


def test_each_wheel_has_its_own_clearance(folder, changed):
    """A left flange that is 2 mm further from its rail: 8.6 mm of clearance to the
    left.
    """
    new = standard.wheel("S1002")
    write_profile(type(new)("worn", "wheel", new.y - 2e-3, new.z), "left.csv")
    text = changed(
        RIG, ('profile = "S1002"', 'profile = "S1002"\nprofile_left = "left.csv"')
    )
    assert warned(changed(text, ("shift_mm = -3", "shift_mm = -8.5"))) == []
    (warning,) = warned(changed(text, ("shift_mm = -3", "shift_mm = -8.7")))
    assert "beyond the flange clearance of 8.6 mm: the left wheel" in warning
    (warning,) = warned(changed(text, ("shift_mm = 4", "shift_mm = 8.5")))
    assert "beyond the flange clearance of 6.6 mm: the right wheel" in warning


def test_a_wider_gauge_is_a_way_out(folder, changed):
    text = changed(
        RIG, ("shift_mm = 4", "shift_mm = 8"), ('"1:40"', '"1:40"\ngauge_mm = 1438')
    )
    assert warned(text) == []


def test_a_wheel_without_a_steep_flange_is_warned_of(folder, changed):
    """The flange is leant from its root on, to a flank of less than 50 degrees."""
    new = standard.wheel("S1002")
    tip = int(new.z.argmax())
    y, z = new.y[tip:], new.z[tip:]
    y = y - 0.55 * np.maximum(z - 8e-3, 0.0)
    write_profile(type(new)("leaning", "wheel", y, z), "leaning.csv")
    text = changed(
        RIG, ('"S1002"', '"leaning.csv"'), ('"1:40"', '"1:40"\ngauge_mm = 1445')
    )
    (warning,) = warned(text)
    assert warning.startswith(
        "scene.toml:5: profile: no part of the flange is as steep as 60 degrees"
    )


def test_a_roll_that_the_scene_leaves_out_is_warned_of(folder, changed):
    """At 6.5 mm, just within the clearance, the wheelset rests at 1.4 mrad, the right
    wheel higher.
    """
    text = changed(RIG, ("shift_mm = 4", "shift_mm = 6.5"))
    Path("scene.toml").write_text(text)
    (warning,) = map(str, check_contact(load_scene("scene.toml")))
    block = text[: text.rindex("[[operation.block]]")].count("\n") + 1
    assert warning.startswith(
        f"scene.toml:{block}: roll_mrad = 0: at a shift of 6.5 mm"
    )
    resting = float(warning.split("at a roll of ")[1].split(" mrad")[0])
    assert -2.0 < resting < -1.0
    Path("scene.toml").write_text(
        changed(text, ("shift_mm = 6.5", f"shift_mm = 6.5\nroll_mrad = {resting}"))
    )
    assert check_contact(load_scene("scene.toml")) == ()
