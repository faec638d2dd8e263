"""What only the contact of the new wheels tells about a scene, before it runs."""

from pathlib import Path

import pytest

from wearsim.errors import SceneError
from wearsim.scene import load_scene
from wearsim.scene.touch import check_contact

RIG = (Path(__file__).parents[1] / "data/scene_rig.toml").read_text()


def test_the_grid_of_the_scene_is_the_one_that_is_tried(folder, changed):
    """The half-space needs 8 cells along a strip: told before the run, as with 7 strips."""
    for key in ("cells", "strips"):
        for count in (7, 8):
            grid = {"cells": 10, "strips": 10, key: count}
            keys = "".join(f"{name} = {value}\n" for name, value in grid.items())
            Path("scene.toml").write_text(RIG + f'[contact]\nnormal = "half_space"\n{keys}')
            scene = load_scene("scene.toml")
            if count == 8:
                assert check_contact(scene) == ()
            else:
                with pytest.raises(SceneError, match="at least 8 strips and cells"):
                    check_contact(scene)
