"""Scenes of kind "accuracy": the matrix they hold and the faults they are refused with."""

import numpy as np
import pytest

from wearsim.errors import SceneError
from wearsim.scene import load_scene
from wearsim.scene.accuracy import matrix_of

TEXT = """\
[scene]
kind = "accuracy"
[wheelset]
profile = "S1002"
[matrix]
inclinations = ["1:40", "1:20"]
roller_radii_mm = [1000, 500]
shifts_mm = [-3, 0, 3]
yaws_mrad = [0, 10]
[reference]
normal = "kik_piotrowski"
tangential = "fastsim"
[[model]]
normal = "hertz"
tangential = "fastsim"
strips = 20
"""


@pytest.fixture
def scene(tmp_path):
    def write(*changes):
        text = TEXT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "accuracy.toml"
        path.write_text(text)
        return path

    return write


def test_every_combination_is_a_case(scene):
    matrix = matrix_of(load_scene(scene()))
    assert matrix.count == 2 * 3 * 3 * 2
    assert [(g.inclination, g.counterface.curvature) for g in matrix.groups] == [
        (inclination, kappa) for inclination in ("1:40", "1:20") for kappa in (0.0, 1.0, 2.0)
    ]
    conditions = matrix.groups[0].conditions
    np.testing.assert_allclose(conditions.shift, [-3e-3, 0.0, 3e-3] * 2)
    np.testing.assert_allclose(conditions.yaw, [0.0] * 3 + [0.01] * 3)
    assert np.all(conditions.wheel_load == 80e3)
    assert matrix.models[0].strips == 20


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ([("[-3, 0, 3]", "[-3, 0, 133]")], "8: shifts_mm"),
        ([('"hertz"', '"herz"')], '14: normal = "herz" is not known; did you mean "hertz"?'),
        ([('"S1002"', '"S1003"')], '4: profile = "S1003"'),
        ([("inclinations", 'profiles = ["60E9"]\ninclinations')], '6: profiles = "60E9"'),
        ([("roller_radii_mm = [1000, 500]", "rail = false")], "7: rail = false and no roller_radii_mm"),
        ([("[-3, 0, 3]", str([0] * 200)), ("[0, 10]", str([0] * 50))], "8: [matrix] has 60000 cases"),
        ([("[[model]]", "[[modell]]")], "13: unknown section [modell]; did you mean model?"),
    ],
)
def test_faults_name_the_line_and_the_key(scene, changes, told):
    with pytest.raises(SceneError) as refused:
        load_scene(scene(*changes))
    assert told in str(refused.value)


def test_faults_of_files_are_told_all_at_once(scene):
    path = scene(('"S1002"', '"S1003"'), ("inclinations", 'profiles = ["60E9"]\ninclinations'))
    with pytest.raises(SceneError) as refused:
        load_scene(path)
    assert len(refused.value.faults) == 2
