"""Judging contact models by the wear increment they give."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim import open_results
from wearsim.campaign import choose
from wearsim.campaign.choose import CLASSES, Collective, cheapest, judge, point_classes
from wearsim.campaign.evaluate import setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import resume, run_scene
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.errors import ContactError, SceneError
from wearsim.operation.points import select
from wearsim.scene import build, load_scene

CONE = """
[scene]
kind = "rig"
[wheelset]
profile = "1in40"
[counterface]
profile = "60E1"
inclination = "1:40"
gauge_mm = 1435
roller_radius_mm = 1000
[campaign]
distance_km = 4
[[operation.block]]
name = "yawed"
shift_mm = 0.0
yaw_mrad = 3
load_kN = 60
speed_km_h = 72
friction = 0.35
distance_km = 1
"""


def test_a_small_collective_is_its_own_sample():
    index, weight = choose.sample(
        np.array([1.0, 5.0, 2.0]), np.array([0.5, 0.0, 0.25]), np.zeros(3, dtype=np.int64), 2
    )
    assert index.tolist() == [0, 2]
    assert weight.tolist() == [0.5, 0.25]


def test_a_sample_stands_for_the_work_in_equal_parts():
    """100 points, one of which does half of the work: it is taken, and the rest is spread over the others."""
    work = np.ones(100)
    work[37] = 100.0
    one_class = np.zeros(100, dtype=np.int64)
    index, weight = choose.sample(work, np.full(100, 0.01), one_class, 10)
    assert 37 in index
    assert 5 <= index.size <= 10
    assert np.all(np.diff(index) > 0)
    assert weight @ work[index] == pytest.approx(0.01 * work.sum(), rel=1e-12)
    part = weight * work[index] / (weight * work[index]).sum()
    np.testing.assert_allclose(part, np.where(index == 37, 0.5, 0.1), rtol=1e-9)
    assert choose.sample(np.zeros(100), np.full(100, 0.01), one_class, 10)[0].size == 10


def test_each_class_is_stood_for_by_points_of_its_own_with_its_own_share_of_the_work():
    rng = np.random.default_rng(3)
    work, weight = rng.uniform(0.0, 1.0, 60) ** 3, rng.uniform(0.1, 1.0, 60)
    weight /= weight.sum()
    whose = point_classes(work, weight)
    index, own = choose.sample(work, weight, whose, 5)
    for one in range(len(CLASSES)):
        assert (whose[index] == one).sum() == min(5, (whose == one).sum())
        part = (own * work[index])[whose[index] == one].sum()
        assert part == pytest.approx((weight * work)[whose == one].sum(), rel=1e-12)


def test_a_closer_tolerance_takes_more_points():
    """A point of the sample stands for a share of the work of about the tolerance."""
    assert [choose.sample_size(tolerance) for tolerance in (0.5, 0.1, 0.05, 0.01)] == [2, 3, 5, 25]


@pytest.fixture(scope="module")
def rig():
    return build(load_scene("workflows/rig_by_shift.toml"))


def test_evidence_is_zero_against_itself_and_the_size_of_the_difference_otherwise(rig):
    """30 against 60 strips: below 2 % in strip work; twice the friction wears far more than twice as much."""
    state, _ = WheelsetEvolution(rig).start()
    points = choose.sample_of(rig, state, 4).points
    fine = replace(rig.models, strips=60, cells=60)
    stiff = replace(rig.models, normal="hertz")
    evidence = tuple(judge(
        [fine, replace(fine, strips=30, cells=30), stiff], fine, state, points, setup_of(rig),
        smoothing_wavelength=rig.control.smoothing_wavelength,
    ))  # fmt: skip
    assert (evidence[0].depth_error, evidence[0].work_error, evidence[0].power_error) == (0.0, 0.0, 0.0)
    assert 0.0 < evidence[1].work_error < 0.02
    assert 0.0 < evidence[1].power_error < 0.02
    assert evidence[2].depth_error == np.inf
    assert "no contact ellipse" in evidence[2].message


def test_points_that_the_sample_leaves_out_count_by_a_fast_model(rig):
    """Two points of the shipped rig for all four: the estimate of a fast model is as on all, but for the
    difference of the bridge to the reference, which is looked up on the sample alone."""
    state, _ = WheelsetEvolution(rig).start()
    acting = np.flatnonzero(rig.points.weight > 0.0)
    points, halves = select(rig.points, acting), select(rig.points, acting[:2])
    fast = replace(rig.models, strips=20, cells=20)
    bridge, truth = (replace(fast, normal="knothe_le_the", strips=n, cells=n) for n in (20, 30))
    kinds = np.array([0, 0, 1, 1])

    def differences(points, classes, models, reference, collective=None):
        (evidence,) = judge(
            [models], reference, state, points, setup_of(rig),
            smoothing_wavelength=rig.control.smoothing_wavelength, point_class=classes, collective=collective,
        )  # fmt: skip
        return evidence

    collective = Collective(points, kinds, (bridge,), (fast, bridge))
    own = np.array([0, 1])
    estimate = differences(halves, own, fast, truth, collective)
    alone = differences(halves, own, fast, truth)
    whole = differences(points, kinds, fast, truth)
    assert alone.depth_error != pytest.approx(whole.depth_error, rel=0.1)
    assert estimate.depth_error == pytest.approx(whole.depth_error, rel=0.1)
    # the fast model's own difference on the sample is all that is known of it there
    close = differences(halves, own, bridge, truth, collective)
    only = differences(halves, own, bridge, truth)
    scale = np.abs(close.difference).max() / np.abs(only.difference).max()  # over another largest depth
    np.testing.assert_allclose(close.difference, scale * only.difference, rtol=0.0, atol=1e-9)  # rounding


TWELVE = CONE.replace(CONE[CONE.index("[[operation") :], "").replace('"1in40"', '"S1002"') + "".join(
    f"""[[operation.block]]
name = "{shift}"
shift_mm = {shift}
load_kN = 60
speed_km_h = 72
friction = 0.3
distance_km = {1.0 + 0.1 * shift:.1f}
"""
    for shift in (-4, -3, -2.5, -2, -1.5, 1, 1.5, 2, 2.5, 3, 3.5, 4)
)
"""Twelve points, of which a sample of two per class is less."""


@pytest.fixture(scope="module")
def twelve(tmp_path_factory):
    path = tmp_path_factory.mktemp("twelve") / "rig.toml"
    path.write_text(TWELVE)
    return replace(build(load_scene(path)), tolerance=0.5)


@pytest.mark.slow
def test_a_model_that_refuses_one_point_of_all_is_not_taken(twelve, monkeypatch):
    """The sample has none of the points that the strip model is made to refuse: it would be taken."""
    state, _ = WheelsetEvolution(replace(twelve, tolerance=None)).start()
    tight = replace(twelve, tolerance=0.15)
    index = choose.sample_of(tight, state, choose.sample_size(tight.tolerance)).index
    assert index.size < 12
    freely = choose.choice(tight, state)
    bridge = choose.candidates(tight.models)[choose.BRIDGES[0]].normal
    assert not any(one.message for one in freely.evidence)
    solve = choose.solve_passage

    def refuse(state, points, setup):
        if setup.models.normal == bridge and len(points.label) == 12:
            raise ContactError("point 7: no contact for strips", row=7)
        return solve(state, points, setup)

    monkeypatch.setattr(choose, "solve_passage", refuse)
    verdict = choose.choice(tight, state)
    taken = {choose.candidates(tight.models)[place].normal for place in verdict.choice.models}
    assert bridge not in taken
    messages = {one.models.normal: one.message for one in verdict.evidence}
    assert messages.get(bridge, "point 7: no contact for strips") == "point 7: no contact for strips"
    assert verdict.choice.error <= 0.15


def test_the_work_of_points_is_looked_for_with_the_first_model_that_answers(twelve, monkeypatch):
    state, _ = WheelsetEvolution(replace(twelve, tolerance=None)).start()
    solve, asked = choose.solve_passage, []

    def refuse(state, points, setup):
        asked.append(setup.models.normal)
        if setup.models.normal == "kik_piotrowski":
            raise ContactError("conformal", row=0)
        return solve(state, points, setup)

    monkeypatch.setattr(choose, "solve_passage", refuse)
    assert choose.sample_of(twelve, state, 2).index.size <= 8
    assert asked == ["kik_piotrowski", "knothe_le_the"]


@pytest.mark.slow
def test_a_campaign_with_chosen_models_runs_resumes_and_keeps_its_choice(tmp_path, monkeypatch):
    """A short rig campaign; the choice is in the result file, and a resumed run has the same bits."""
    text = Path("workflows/rig_by_shift.toml").read_text()
    start, stop = text.index("[contact]"), text.index("[wear]")
    text = text[:start] + '[contact]\nmodel = "auto"\ntolerance = 0.5\n\n' + text[stop:]
    scene = tmp_path / "auto.toml"
    scene.write_text(re.sub(r"distance_km = 1260(\.0)?", "distance_km = 16.0", text))
    setup = build(load_scene(scene))
    assert setup.tolerance == 0.5
    assert setup.control.distance < 100e3
    (whole,) = run_scene(scene, tmp_path / "whole")
    with open_results(whole) as result:
        assert result.attrs["contact_normal"] == "auto"
        names = result["contact_candidate"].values.tolist()
        assert names == [choose.named(one) for one in choose.candidates(setup.models)]
        assert np.all(np.diff(result["contact_candidate_cost"]) > 0.0)
        assert result["contact_class"].values.tolist() == list(CLASSES)
        chosen = result["contact_models"].values
        assert np.all(np.isin(np.unique(chosen), range(len(names))))
        assert np.all((result["contact_models_error"] > 0.0) & (result["contact_models_error"] <= 0.5))
        tried = result["contact_candidate_error"].values
        assert np.all(np.nanmin(tried, axis=1) <= 0.5)
        whose = result["contact_point_class"].values
        power = (result["power"].fillna(0.0).sum("patch") * result["weight"] / result["speed"]).values[0]
        assert CLASSES[whose[0, np.argmax(power)]] == "leading"
        depth, distance = result["max_wear_depth"].values, result["distance"].values
    stop_after = 2
    real = WheelsetEvolution.advance

    def interrupted(self, state, evaluation):
        if state.step == stop_after:
            raise KeyboardInterrupt
        return real(self, state, evaluation)

    monkeypatch.setattr(WheelsetEvolution, "advance", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_scene(scene, tmp_path / "part")
    monkeypatch.setattr(WheelsetEvolution, "advance", real)
    asked, real_choice = [], choose.choice
    monkeypatch.setattr(
        choose, "choice", lambda *given, **named: asked.append(1) or real_choice(*given, **named)
    )
    (resumed,) = resume(tmp_path / "part")
    # not once more at the place of the interruption
    assert len(asked) == sum(share * setup.control.distance > distance[stop_after] for share in choose.CHECKS)
    with open_results(resumed) as result:
        np.testing.assert_array_equal(result["max_wear_depth"].values, depth)
        np.testing.assert_array_equal(result["contact_models"].values, chosen)
        np.testing.assert_array_equal(result["contact_point_class"].values, whose)


def test_choice_and_given_models_exclude_each_other(tmp_path):
    text = (
        Path("workflows/rig_by_shift.toml").read_text().replace("[contact]\n", '[contact]\nmodel = "auto"\n')
    )
    (tmp_path / "both.toml").write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / "both.toml")
    message = str(caught.value)
    for key in ("normal", "tangential", "strips", "cells"):
        assert f'{key} and model = "auto" exclude each other' in message
    (tmp_path / "alone.toml").write_text(text.replace('model = "auto"', "tolerance = 0.1"))
    with pytest.raises(SceneError, match=r'tolerance = 0\.1 is for model = "auto"'):
        load_scene(tmp_path / "alone.toml")


def test_virtual_penetration_is_rejected_at_zero_shift(rig):
    """At y = 0 alone and 5 %: its patches are too long and narrow there (issue 6)."""
    central = np.flatnonzero((rig.points.conditions.shift == 0.0) & (rig.points.weight > 0.0))
    assert central.size == 1
    auto = replace(rig, tolerance=0.05, points=select(rig.points, central))
    verdict = choose.choice(auto, WheelsetEvolution(rig).start()[0])
    assert verdict.evidence[0].models.normal == "kik_piotrowski"
    assert verdict.evidence[0].depth_error > 0.1
    assert all(one.depth_error > 0.05 for one in verdict.evidence[:-1])
    assert verdict.choice.error <= 0.05
    assert set(verdict.choice.models) == {len(verdict.evidence) - 1}


def test_virtual_penetration_is_rejected_where_the_rig_wears_most(rig):
    """On all blocks with 5 %, also for a class of them: the increment would be a third too small there."""
    auto = replace(rig, tolerance=0.05)
    verdict = choose.choice(auto, WheelsetEvolution(rig).start()[0])
    evidence = verdict.evidence
    assert evidence[0].models.normal == "kik_piotrowski"
    assert evidence[0].depth_error > 0.2
    assert evidence[-1].depth_error <= 0.05
    assert all(one.depth_error > 0.05 for one in evidence[:-1])
    candidates = choose.candidates(rig.models)
    leading = candidates[verdict.choice.models[CLASSES.index("leading")]]
    assert leading.normal != "kik_piotrowski"
    assert leading.tangential == "half_space"
    assert list(verdict.choice.models) == sorted(verdict.choice.models)
    assert verdict.choice.error <= 0.05
    assert verdict.cost <= choose.COST_ORDER[len(evidence) - 1][3]


def test_hertz_is_good_for_an_ellipse_but_never_leads_a_campaign(tmp_path):
    """A cone on a rail's crown, full slip: 2.2 % in depth is the staircase of the reference and fastsim."""
    scene = tmp_path / "cone.toml"
    scene.write_text(CONE)
    cone = build(load_scene(scene))
    hertz = replace(cone.models, normal="hertz", strips=30, cells=30)
    (evidence,) = judge(
        [hertz], choose.candidates(cone.models)[-1], WheelsetEvolution(cone).start()[0], cone.points,
        setup_of(cone), smoothing_wavelength=cone.control.smoothing_wavelength,
    )  # fmt: skip
    assert evidence.depth_error < 0.05
    assert evidence.work_error < 0.05
    assert evidence.power_error < 0.01
    assert all(NORMAL_MODELS[normal].can_update_profile for normal, *_ in choose.COST_ORDER)


def test_costs_are_those_of_the_committed_chart():
    """Within a factor of two, which is what other processors make of a ratio of times; in the same order."""
    lines = Path("reports/speed_accuracy.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:5]] for line in lines if line.startswith("| ")]
    chart = {(normal, tangential, grid): time for normal, tangential, grid, time in cells}
    costs = {tuple(map(str, place)): cost for *place, cost in choose.COST_ORDER}
    assert sorted(costs.values()) == list(costs.values())
    known = [place for place in costs if place in chart]
    assert len(known) >= 6
    for place in known:
        ratio = float(chart[place]) / float(chart[known[0]])
        assert 0.5 < costs[place] / ratio < 2.0, place
    charted = [float(chart[place]) for place in known]
    assert charted == sorted(charted)


@pytest.mark.parametrize("count", [1, 2, 10])
def test_every_class_that_is_named_has_a_point_in_the_sample(rig, count):
    """However small the sample is, of the 4 points that act and 9 that only monitor."""
    part = choose.sample_of(rig, WheelsetEvolution(rig).start()[0], count)
    assert np.bincount(part.point_class[part.index]).max() <= count
    assert set(part.point_class[part.index]) == set(part.point_class)


def test_classes_part_the_work_in_rising_order():
    """Shares 0.01, 0.09 | 0.2 | 0.3 | 0.4, and a point without weight; not in order."""
    classes = point_classes(np.array([20.0, 1.0, 40.0, 9.0, 400.0, 30.0]), np.array([1.0, 1, 1, 1, 0, 1]))
    assert [CLASSES[k] for k in classes] == ["minor", "least", "leading", "least", "leading", "major"]


def test_one_point_that_does_all_leads_and_so_do_all_if_none_works():
    assert [CLASSES[k] for k in point_classes(np.array([1.0, 0.0]), np.array([0.5, 0.5]))] == [
        "leading",
        "least",
    ]
    assert [CLASSES[k] for k in point_classes(np.zeros(3), np.full(3, 1.0))] == ["leading"] * 3


def test_the_cheapest_is_found_among_all_with_better_models_for_more_work():
    """Against a search by hand: 4 candidates, 3 classes, random differences; the bound is that of the sum."""
    random = np.random.default_rng(6)
    difference = random.normal(0.0, 1.0, (4, 3, 2, 5)) * np.array([1.0, 0.3, 0.1, 0.0])[:, None, None, None]
    cost, count = [1.0, 1.5, 20.0, 70.0], [7, 2, 3]
    choices = set()
    for bound in (0.05, 0.2, 0.3, 0.6, 1.5, 9.0):
        chosen, error = cheapest(difference, cost, count, bound)
        choices.add(chosen)
        assert error == pytest.approx(np.abs(sum(difference[k, c] for c, k in enumerate(chosen))).max())
        assert error <= bound
        assert list(chosen) == sorted(chosen)
        price = np.dot([cost[k] for k in chosen], count)
        for other in np.ndindex(4, 4, 4):
            if list(other) == sorted(other) and np.dot([cost[k] for k in other], count) < price - 1e-9:
                assert np.abs(sum(difference[k, c] for c, k in enumerate(other))).max() > bound
    assert len(choices) >= 4


def test_refusing_candidates_are_not_taken_and_a_bound_nobody_keeps_is_an_error():
    difference = np.array([[np.inf, 0.1], [0.2, 0.1]])
    assert cheapest(difference, [1.0, 2.0], [1, 1], 0.5)[0] == (1, 1)
    with pytest.raises(ValueError, match="no candidate"):
        cheapest(difference, [1.0, 2.0], [1, 1], 0.05)
