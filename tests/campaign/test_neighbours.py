"""Operating points between others that are alike: which they are, and what it does to the wear."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign import correction, evaluate, neighbours
from wearsim.campaign.evaluate import setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError
from wearsim.operation.states import Controlled
from wearsim.scene import build, load_scene

FINE = {"shift_mean_mm": 0.5, "shift_std_mm": 0.7, "positions": 40, "share": 1.0}
GRID = "strips = 12\ncells = 12"


@pytest.fixture(scope="module")
def fine(tmp_path_factory, scene_text):
    path = tmp_path_factory.mktemp("fine") / "scene.toml"
    text = scene_text(FINE, kind="field", contact=f'model = "auto"\n{GRID}',
                      campaign="distance_km = 60\npoint_spacing_mm = 0.5")  # fmt: skip
    path.write_text(text)
    return WheelsetEvolution(build(load_scene(path)))


@pytest.fixture(scope="module")
def passage(fine):
    evolution = replace(fine, setup=replace(fine.setup, tolerance=None))
    return solve_passage(evolution.start()[0], fine.setup.points, setup_of(evolution.setup))


def ends_of(passage, points, step=0, known=None, among=None):
    every = np.ones(len(points.label), bool)
    known, among = (every if one is None else one for one in (known, among))
    return neighbours.between(passage, points, among, known, step)


def test_each_point_lies_between_others_near_by_or_is_solved(fine, passage):
    points, contact = fine.setup.points, passage.contact
    shift, count = points.conditions.shift, len(points.label)
    for step in range(4):
        ends, share = ends_of(passage, points, step)
        own = (ends == np.arange(count)[:, None]).all(axis=1)
        assert own[ends].all()
        assert own.sum() < 0.6 * count
        assert share * (shift[ends[:, 1]] - shift[ends[:, 0]]) == pytest.approx(
            np.where(own, 0.0, shift - shift[ends[:, 0]]), abs=1e-15
        )
        for one, other in np.unique(ends[~own], axis=0):
            a, b = contact.point == one, contact.point == other
            assert (contact.side[a] == contact.side[b]).all()
            away = np.abs(contact.wheel_y[a] - contact.wheel_y[b])
            assert (away <= 0.15 * np.minimum(contact.width[a], contact.width[b])).all()
            assert 1 < abs(other - one) <= 4


def test_every_point_is_solved_in_turn(fine, passage):
    count = len(fine.setup.points.label)
    ends = [ends_of(passage, fine.setup.points, step)[0] for step in range(4)]
    assert np.unique(ends).size == count


def test_points_that_differ_in_more_than_the_shift_are_not_alike(fine, passage):
    points, count = fine.setup.points, len(fine.setup.points.label)
    alone, other = np.stack([np.arange(count)] * 2, axis=1), np.arange(count) % 2
    for changed in (
        replace(points, environment=1.0 + other),
        replace(points, conditions=replace(points.conditions, friction=0.3 + 0.01 * other)),
        replace(points, class_name=tuple(map(str, other))),
    ):
        ends, _ = ends_of(passage, changed)
        assert (other[ends] == other[:, None]).all()
        assert (ends != alone).any()
    ends, _ = ends_of(passage, points, known=other == 0)
    assert (other[ends] == other[:, None]).all()
    for one, other_one in np.unique(ends_of(passage, points, known=np.zeros(count, bool))[0], axis=0):
        assert other_one - one in (0, 2)  # of unknown ones every second is solved
    ends, _ = ends_of(passage, points, among=other == 0)
    assert (ends[other == 1] == alone[other == 1]).all()
    assert (other[ends[other == 0]] == 0).all()


def test_points_of_other_models_or_at_shifts_that_follow_from_forces_are_solved(fine, passage):
    points, count = fine.setup.points, len(fine.setup.points.label)
    alone = np.stack([np.arange(count)] * 2, axis=1)
    models = passage.contact.point % 2
    ends, _ = ends_of(replace(passage, model=models), points)
    assert (ends == alone).all()
    ends, _ = ends_of(passage, replace(points, controlled=Controlled(*np.full((3, count), np.nan))))
    assert (ends == alone).all()


def test_points_between_those_without_a_solution_are_solved_themselves(fine, monkeypatch):
    solve, failing = evaluate.solve_each, []
    shift = fine.setup.points.conditions.shift

    def fails(conditions, wheelset, counterface, models, each, *, failed=None, **rest):
        if models.normal != "half_space":
            return solve(conditions, wheelset, counterface, models, each, failed=failed, **rest)
        bad = np.isin(conditions.shift, shift[::6])
        failing.extend(conditions.shift[bad])
        failed.update({int(row): ContactError(f"point {row}", int(row)) for row in np.flatnonzero(bad)})
        parts = solve(conditions, wheelset, counterface, models, each, failed=failed, **rest)
        return [joined([one], np.flatnonzero(~np.isin(shift[one.contact.point], failing))) for one in parts]

    monkeypatch.setattr(evaluate, "solve_each", fails)
    known = fine.start()[0].correction
    assert np.unique(failing).size == 7
    pressure = known.max_pressure.min(axis=1)
    assert ((pressure > 0.0) == ~np.isin(shift, failing)).all()
    assert (np.abs(known.wheel).max(axis=(1, 2, 3))[pressure > 0.0] > 0.0).all()


def test_the_wear_is_that_with_all_points_solved(fine, monkeypatch):
    def ended():
        state, taken = fine.start()
        while state.distance < fine.target:
            state, taken = fine.advance(state, fine.evaluate(state, taken))
        return state

    ours = ended()
    monkeypatch.setattr(neighbours, "_MOST", 1)
    theirs = ended()
    assert ours.correction.solved < 0.6 * theirs.correction.solved
    third = 0.01 * theirs.wear_depth.max()  # of the tolerance
    assert ours.wear_depth == pytest.approx(theirs.wear_depth, abs=third)
    assert ours.correction.max_pressure == pytest.approx(theirs.correction.max_pressure, rel=0.1)
    assert correction.estimated_error(ours) < 0.03
