"""Left and right worn wheels that were exchanged."""

from pathlib import Path

import pytest

from wearsim.scene import load_scene
from wearsim.scene.implausible import side_of
from wearsim.scene.initial_contact import check_contact

ROOT = Path(__file__).parents[2]
RIG = (Path(__file__).parents[1] / "data" / "scene_rig.toml").read_text()


@pytest.mark.parametrize(
    ("name", "header", "side"),
    [
        ("wheel_worn_left.whl", {}, ("left", "name")),
        ("wheel_worn_left.whl", {"SIDE": " R "}, ("right", "header")),
        ("Rad 3 rechts.csv", {"Side": "?"}, ("right", "name")),
        ("bright.whl", {}, ("", "")),
        ("left_and_right.whl", {}, ("", "")),
    ],
)
def test_the_header_goes_before_the_name(name, header, side):
    assert side_of(name, header) == side


@pytest.fixture
def scene(tmp_path):
    """Function that writes a scene with two worn wheels, without sides in the names of
    their files.
    """

    def write(right, left):
        for name, side in (("a.whl", right), ("b.whl", left)):
            text = (
                ROOT / "profiles" / "measured" / f"wheel_worn_{side}.whl"
            ).read_text()
            (tmp_path / name).write_text(text)
        wheels = (
            'profile = "a.whl"\nprofile_left = "b.whl"\nradius_mm = 450\nsmooth_mm = 4'
        )
        (tmp_path / "rig.toml").write_text(RIG.replace('profile = "S1002"', wheels))
        return tmp_path / "rig.toml"

    return write


def test_exchanged_wheels_are_a_warning_by_their_headers(scene, capsys):
    def sides(right, left):
        return [
            str(one)
            for one in check_contact(load_scene(scene(right, left)))
            if "acts on the" in str(one)
        ]

    assert sides("right", "left") == []
    right, left = sides("left", "right")
    assert (
        'profile = "a.whl" acts on the right wheel, and its header says left: '
        "exchange profile"
    ) in right
    assert (
        'profile_left = "b.whl" acts on the left wheel, and its header says right'
        in left
    )
    assert ":" in right.split(" profile")[0]  # file and line
