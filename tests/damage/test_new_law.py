"""A new wear law is two files: its own, and its coefficients."""

import sys
from pathlib import Path

import numpy as np
import pytest
from law_settings import wear_settings

from wearsim.contact.registry import Registry, discover
from wearsim.damage import wear
from wearsim.damage.coefficients import COEFFICIENT_SETS, read_set
from wearsim.damage.wear import WEAR_LAWS, passage_depth
from wearsim.damage.wear.law import WearLaw
from wearsim.errors import SceneError
from wearsim.scene import build, load_scene, scene_schema

LAW = '''
"""A law of the load alone."""

from wearsim.damage.wear.law import WearLaw
from wearsim.damage.wear.sliding import along_strips


def depth(fields, area, coefficients, *, form="local"):
    return coefficients["k"] * along_strips(fields.work_density, fields)[None]


SLIDING = WearLaw("sliding_test", depth, ("all",), coefficients="somebody_2026")
'''
SET = """
name = "somebody_2026"
laws = ["sliding_test"]
materials = "any"
source = "made up"
validity = "tests"
departures = []
values.k = { value = 2e-12, unit = "m3 J-1", place = "page 1", certainty = "given" }
"""


@pytest.fixture
def with_a_new_law(tmp_path, monkeypatch):
    """Put a law into a folder that belongs to its package, and discover it; read its
    set.
    """
    folder = tmp_path / "laws"
    folder.mkdir()
    (folder / "sliding_of_the_test.py").write_text(LAW)
    monkeypatch.setattr(wear, "__path__", [*wear.__path__, str(folder)])
    result = discover("wear law", wear.__name__, wear.__path__, WearLaw)
    monkeypatch.delitem(sys.modules, f"{wear.__name__}.sliding_of_the_test")
    monkeypatch.delattr(wear, "sliding_of_the_test")
    assert [one for one in result if one != "sliding_test"] == list(
        WEAR_LAWS
    )  # the others keep their order
    monkeypatch.setitem(WEAR_LAWS, "sliding_test", result["sliding_test"])
    (folder / "somebody_2026.toml").write_text(SET)
    monkeypatch.setitem(
        COEFFICIENT_SETS, "somebody_2026", read_set(folder / "somebody_2026.toml")
    )


def test_a_new_law_is_known_everywhere(with_a_new_law, patches, tmp_path, monkeypatch):
    fields, area = patches(5e6)
    depth = passage_depth(fields, area, wear_settings("sliding_test"))
    np.testing.assert_allclose(depth[0], 2e-12 * fields.strip_work, rtol=1e-12)
    monkeypatch.chdir(tmp_path)
    rig = (Path(__file__).parents[1] / "data" / "scene_rig.toml").read_text()
    Path("scene.toml").write_text(
        rig + '[wear]\nlaw = "sliding_test"\nalso_evaluate = ["usfd"]\n'
    )
    settings = build(load_scene("scene.toml")).wear
    assert (settings.law, settings.coefficients, settings.form) == (
        "sliding_test",
        "somebody_2026",
        "local",
    )
    Path("scene.toml").write_text(
        rig + '[wear]\nalso_evaluate = ["sliding_test"]\nhardness_GPa = 3\n'
    )
    with pytest.raises(SceneError, match='hardness_GPa acts with law = "archard" only'):
        load_scene("scene.toml")
    assert "sliding_test" in str(scene_schema())


def test_two_records_of_one_name_are_an_error():
    """The same object twice, such as an imported one, is one record."""
    usfd, other = (
        WEAR_LAWS["usfd"],
        WearLaw("usfd", WEAR_LAWS["none"].depth, ("a",), coefficients=None),
    )
    assert list(Registry("wear law", [usfd, usfd])) == ["usfd"]
    with pytest.raises(ValueError, match='wear law "usfd" is defined twice'):
        Registry("wear law", [usfd, other])
