"""Contact models that were chosen: what the report, `wearsim inspect` and `wearsim check` report."""

import json

import pytest

from wearsim.campaign import choose
from wearsim.campaign.choose import CLASSES
from wearsim.campaign.run import run_scene
from wearsim.cli import main
from wearsim.report import tables_quality
from wearsim.report.html import write_report
from wearsim.report.inspect import inspect, summary_text
from wearsim.results import open_results


@pytest.fixture(scope="module")
def scene(tmp_path_factory, scene_text):
    """Two blocks, one of which does most of the work."""
    path = tmp_path_factory.mktemp("choice") / "rig.toml"
    curve, middle = (
        {"shift_mm": shift, "yaw_mrad": yaw, "distance_km": 1} for shift, yaw in ((5, 3), (1, 0.2))
    )
    campaign = "distance_km = 4\npoint_spacing_mm = 0.5"
    path.write_text(scene_text(curve, middle, contact='model = "auto"\ntolerance = 0.5', campaign=campaign))
    return path


@pytest.fixture(scope="module")
def result(scene):
    (path,) = run_scene(scene, scene.parent / "out")
    return path


def test_report_shows_classes_models_costs_and_evidence(result, without_figures):
    with open_results(result) as data:
        models, evidence = tables_quality.chosen(data)
        steps = tables_quality.looked_at(data)
        text = models.frame.to_numpy()
        assert steps[0] == 0
        assert len(text) == 2 * len(steps)
        assert [row[0] for row in text[:2]] == ["0 km, least", "0 km, leading"]
        place = data["contact_models"].values[0]
        names = data["contact_candidate"].values
        assert [row[2] for row in text[:2]] == [names[place[0]], names[place[-1]]]
        assert [int(row[3]) for row in text[:2]] == [place[0] + 1, place[-1] + 1]
        assert evidence.frame.iloc[0, 0] == names[0]
        # the last that was tried for all points keeps the tolerance
        assert evidence.frame.iloc[:, 3].min() <= 50.0
        page = write_report(result.parent).read_text()
    for table in ("table-choice-rig", "table-candidates-rig"):
        assert table in page
    assert "0 km, leading" in page


def test_inspect_lists_the_models_at_the_end(result):
    actual = inspect(result)
    assert [one["class"] for one in actual["contact_models"]["classes"]] == ["least", "leading"]
    assert 0.0 < actual["contact_models"]["error"] <= 0.5
    assert "1 leading operating points: " in summary_text(actual)


def test_check_lists_the_choice_of_the_start_and_why(scene, result, capsys):
    assert main(["check", str(scene), "--json"]) == 0
    (plan,) = json.loads(capsys.readouterr().out)["campaigns"]
    choice = plan["choice"]
    assert [one["class"] for one in choice["classes"]] == list(CLASSES)
    assert [one["points"] for one in choice["classes"]] == [1, 0, 0, 1]
    with open_results(result) as data:
        names = data["contact_candidate"].values[data["contact_models"].values[0]]
        assert [one["models"] for one in choice["classes"]] == names.tolist()
        assert choice["depth_error"] == float(data["contact_models_error"][0])
    costs = [one["cost"] for one in choice["evidence"]]
    assert costs == [cost for *_, cost in choose.COST_ORDER][: len(costs)]
    assert choice["cost"] <= choice["cost_of_one_for_all"] == costs[-1]
    assert main(["check", str(scene)]) == 0
    message = capsys.readouterr().out
    assert "chosen for a tolerance of 50 %" in message
    assert f"1 leading points: {names[-1]}" in message
