"""Torques on each wheel of a wheelset whose wheels rotate independently."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.operation.points import programme
from wearsim.scene import load_scene
from wearsim.scene.prepared import set_points_of

RIG = (Path(__file__).parents[1] / "data/scene_rig.toml").read_text()
KEYS = "wheel_torque_right_kN_m = 3\nwheel_torque_left_kN_m = -2\n"


@pytest.fixture
def with_torques(changed):
    """Function that writes a rig of independent wheels with keys in its first block."""

    def write(keys, rotation="independent"):
        block = "[[operation.block]]\n"
        contact = f'[contact]\nrotation = "{rotation}"\n'
        return changed(RIG, (block, f"{contact}{block}{keys}"))

    return write


def test_torques_of_wheels_reach_the_operating_points(folder, with_torques):
    """The other block has half of the torque of [contact] on each wheel."""
    Path("scene.toml").write_text(with_torques(KEYS))
    scene = load_scene("scene.toml", overrides={"contact.torque_Nm": 500.0})
    runs = [set_points_of(scene, run) for run in scene.operation.runs.values()]
    conditions = programme(runs, rotation="independent", torque=500.0).conditions
    np.testing.assert_allclose(conditions.torque, [1000.0, 500.0])
    np.testing.assert_allclose(conditions.torque_difference, [5000.0, 0.0])


@pytest.mark.parametrize(
    ("keys", "rotation", "at", "message"),
    [
        (KEYS, "free", "right", 'needs rotation = "independent" in [contact]'),
        (f"{KEYS}axle_torque_kN_m = 1\n", "independent", "right", "exclude each other"),
        ("wheel_torque_left_kN_m = 1\n", "independent", "left", "right_kN_m, too"),
        (KEYS.replace("3", "26"), "independent", "right", "must be"),
        (
            KEYS.replace("-2", "-20"),
            "independent",
            "left",
            "wheel_torque_left_kN_m = -20 is more than friction can carry in block "
            '"left": friction x wheel load x radius_mm',
        ),
    ],
)
def test_faults_of_torques_name_line_and_key(
    folder, with_torques, faults_of, line_with, keys, rotation, at, message
):
    text = with_torques(keys, rotation)
    (line,) = faults_of(text)
    assert line.startswith(f"scene.toml:{line_with(text, f'wheel_torque_{at}')}: ")
    assert message in line


@pytest.mark.parametrize(
    ("keys", "key", "weakest"),
    [
        (KEYS.replace("-2", "-9"), "wheel_torque_left_kN_m = -9", "friction"),
        ("axle_torque_kN_m = 17\n", "axle_torque_kN_m = 17", "2 x friction"),
    ],
)
def test_a_torque_is_compared_with_the_load_of_its_own_wheel(
    folder, with_torques, faults_of, keys, key, weakest
):
    """12.1 kN m would be carried by the mean of 100 and 50 kN."""
    text = with_torques(keys).replace(
        "load_kN = 80", "wheel_load_right_kN = 100\nwheel_load_left_kN = 50", 1
    )
    (line,) = faults_of(text)
    carried = 8050 if weakest == "friction" else 16100
    product = f"{weakest} x wheel load x radius_mm = {carried:.4g} N m"
    assert f'{key} is more than friction can carry in block "left": {product}' in line
