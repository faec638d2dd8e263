"""A new wear law is two files: its own, and its coefficients."""

import sys
from pathlib import Path

import numpy as np
import pytest

from wearsim.damage import coefficients, wear
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.registry import Registry, discover
from wearsim.damage.wear import WEAR_LAWS, default_settings, passage_depth
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
from wearsim.damage.coefficients.record import Coefficient, CoefficientSet

SOMEBODY_2026 = CoefficientSet(
    name="somebody_2026", laws=("sliding_test",), materials="any", source="made up", validity="tests",
    departures=(), values={"k": Coefficient(2e-12, "m3 J-1", "page 1", "given")},
)
"""


@pytest.fixture
def with_a_new_law(tmp_path, monkeypatch):
    """Put a law and a set into folders that belong to the two packages, and discover them."""
    for package, name, text, kind, registry, record in (
        (wear, "sliding_of_the_test", LAW, "wear law", WEAR_LAWS, WearLaw),
        (coefficients, "somebody_2026", SET, "coefficient set", COEFFICIENT_SETS, CoefficientSet),
    ):
        folder = tmp_path / package.__name__
        folder.mkdir()
        (folder / f"{name}.py").write_text(text)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
        result = discover(kind, package.__name__, package.__path__, record)
        monkeypatch.delitem(sys.modules, f"{package.__name__}.{name}")
        monkeypatch.delattr(package, name)
        (new,) = set(result) - set(registry)
        assert [one for one in result if one != new] == list(registry)  # the order of the others stays
        monkeypatch.setitem(registry, new, result[new])


def test_a_new_law_is_known_everywhere(with_a_new_law, patches, tmp_path, monkeypatch):
    fields, area = patches(5e6)
    depth = passage_depth(fields, area, default_settings("sliding_test"))
    np.testing.assert_allclose(depth[0], 2e-12 * fields.strip_work, rtol=1e-12)
    monkeypatch.chdir(tmp_path)
    rig = (Path(__file__).parents[1] / "data" / "scene_rig.toml").read_text()
    Path("scene.toml").write_text(rig + '[wear]\nlaw = "sliding_test"\nalso_evaluate = ["usfd"]\n')
    settings = build(load_scene("scene.toml")).wear
    assert (settings.law, settings.coefficients, settings.form) == ("sliding_test", "somebody_2026", "local")
    Path("scene.toml").write_text(rig + '[wear]\nalso_evaluate = ["sliding_test"]\nhardness_GPa = 3\n')
    with pytest.raises(SceneError, match='hardness_GPa acts with law = "archard" only'):
        load_scene("scene.toml")
    assert "sliding_test" in str(scene_schema())


def test_two_records_of_one_name_are_an_error():
    """The same object twice, such as an imported one, is one record."""
    usfd, other = WEAR_LAWS["usfd"], WearLaw("usfd", WEAR_LAWS["none"].depth, ("a",), coefficients=None)
    assert list(Registry("wear law", [usfd, usfd])) == ["usfd"]
    with pytest.raises(ValueError, match='wear law "usfd" is defined twice'):
        Registry("wear law", [usfd, other])
