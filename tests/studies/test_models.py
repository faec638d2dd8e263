"""The pairs of contact models compared at the points of a scene that wear most."""

from dataclasses import replace

import pytest

from wearsim.campaign.evaluate import solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.errors import ContactError
from wearsim.scene import build, load_scene
from wearsim.scene.overrides import Override
from wearsim.studies import models
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
    assert (accurate["wear_rate"], accurate["power"], accurate["pressure"]) == (
        0.0,
        0.0,
        0.0,
    )
    for key in ("wear_rate", "power", "pressure"):
        assert 0.0 < abs(standard[key]) < 0.1
        assert 0.0 < abs(fast[key]) < 0.4
    assert standard["seconds"] > 0.0


def test_what_is_not_known_is_a_dash(item):
    rows = [{**one, "seconds": None, "wear_rate": None} for one in item["pairs"]]
    lines = table_lines({**item, "pairs": rows})
    assert [line.split()[:3] for line in lines[1:]] == [
        [one["name"], "-", "-"] for one in rows
    ]


def test_a_pair_that_does_not_solve_a_point_has_no_differences(monkeypatch):
    setup = build(
        load_scene(
            "workflows/rig_given.toml", overrides=[Override("contact.model", "fast")]
        )
    )
    evolution = WheelsetEvolution(setup)
    start, _ = evolution.start()
    evaluation = evolution.evaluate(start)

    def refused(state, points, here, among):
        passage = solve_passage(state, points, here, among)
        lost = (
            {3: ContactError("no contact", 3)}
            if here.models.normal == "half_space"
            else {}
        )
        return replace(passage, failed=lost)

    monkeypatch.setattr(models, "solve_passage", refused)
    item = compared(setup, start, evaluation, 10.0)
    assert all(one["wear_rate"] is None for one in item["pairs"])
    assert item["pairs"][0]["seconds"] == pytest.approx(10.0)
    assert all(one["seconds"] > 0.0 for one in item["pairs"])
