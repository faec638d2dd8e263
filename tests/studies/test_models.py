"""The pairs of contact models compared at the points of a scene that wear most."""

import pytest

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.scene import build, load_scene
from wearsim.studies.models import compared, table_lines


@pytest.fixture(scope="module")
def item():
    setup = build(load_scene("workflows/rig_given.toml"))
    evolution = WheelsetEvolution(setup)
    start, _ = evolution.start()
    return compared(setup, start, evolution.evaluate(start), 10.0)


def test_pairs_are_compared_at_the_points_that_wear_with_accurate_as_the_truth(item):
    assert item["points"] == 4  # of 13, of which the others monitor
    assert item["wear_share"] == pytest.approx(1.0)
    fast, standard, accurate = item["pairs"]
    assert [one["name"] for one in item["pairs"]] == ["fast", "standard", "accurate"]
    assert (accurate["wear_rate"], accurate["power"], accurate["pressure"]) == (0.0, 0.0, 0.0)
    for key in ("wear_rate", "power", "pressure"):
        assert 0.0 < abs(standard[key]) < 0.1
        assert 0.0 < abs(fast[key]) < 0.4
    assert standard["seconds"] > 0.0


def test_what_is_not_known_is_a_dash(item):
    rows = [{**one, "seconds": None, "wear_rate": None} for one in item["pairs"]]
    lines = table_lines({**item, "pairs": rows})
    assert [line.split()[:3] for line in lines[1:]] == [[one["name"], "-", "-"] for one in rows]
