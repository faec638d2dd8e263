"""Operating points between others that are alike: which they are, and what it does to the wear."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.campaign import correction, differences, evaluate, neighbours
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


def ends_of(passage, points, turn=0, known=None, among=None):
    every = np.ones(len(points.label), bool)
    known, among = (every if one is None else one for one in (known, among))
    return neighbours.between(passage, points, among, known, turn * every)


def test_each_point_lies_between_others_near_by_or_is_solved(fine, passage):
    points, contact = fine.setup.points, passage.contact
    shift, count = points.conditions.shift, len(points.label)
    for turn in range(4):
        ends, share = ends_of(passage, points, turn)
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


def test_points_at_one_shift_lie_at_either_end(fine, passage):
    """As those of a ramp between blocks of equal shift: no division by zero, which is an error in tests."""
    points = fine.setup.points
    equal = replace(points, conditions=replace(points.conditions, shift=np.full(len(points.label), 1e-3)))
    first = {name: getattr(passage.contact, name) for name in ("side", "wheel_y", "width")}
    patches = int((passage.contact.point == 0).sum())
    same = {name: np.tile(value[:patches], len(points.label)) for name, value in first.items()}
    contact = SimpleNamespace(point=np.repeat(np.arange(len(points.label)), patches), **same)
    one = SimpleNamespace(contact=contact, model=np.zeros(contact.point.size, dtype=int))
    ends, share = ends_of(one, equal)
    assert (ends != np.arange(len(points.label))[:, None]).any()
    assert not share.any()


def test_every_point_is_solved_in_turn(fine, passage):
    count = len(fine.setup.points.label)
    ends = [ends_of(passage, fine.setup.points, turn)[0] for turn in range(4)]
    assert np.unique(ends).size == count


def test_a_mirrored_collective_has_mirrored_ends(fine, passage):
    """The other way round, as the shifts of a mirrored scene are."""
    points, last = fine.setup.points, len(fine.setup.points.label) - 1
    conditions = points.conditions.at(np.arange(last, -1, -1))
    mirrored = replace(points, conditions=replace(conditions, shift=-conditions.shift))
    contact = replace(passage.contact, point=last - passage.contact.point)
    order = np.argsort(contact.point, kind="stable")
    for turn in range(4):
        ends, share = ends_of(passage, points, turn)
        other, rest = ends_of(replace(passage, contact=joined([contact], order)), mirrored, turn)
        np.testing.assert_array_equal(np.sort(last - other[::-1]), ends)
        inner = share > 0.0
        np.testing.assert_allclose(1.0 - rest[::-1][inner], share[inner], rtol=1e-12)


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


@pytest.mark.parametrize("models", [[0, 0, 0], [2, 1, 2]])
def test_differences_from_before_do_not_stay_where_they_are_unknown(fine, passage, models):
    """Neither those forgotten at the lathe nor those from models that no longer solve the points."""
    state, _ = fine.start()
    points, every = fine.setup.points, np.ones(len(fine.setup.points.label), bool)
    setup, known = setup_of(fine.setup), state.correction
    of = np.resize(models, every.size)
    old = np.random.default_rng(1).uniform(1.0, 2.0, known.wheel.shape) * np.abs(known.wheel).max()
    step = known.step if any(models) else np.full_like(known.step, -1)
    first = replace(known, wheel=old, model=of, step=step, turn=np.zeros_like(step))
    before = replace(state, correction=first)
    again = differences.refreshed(before, points, every, setup, passage)
    np.testing.assert_array_equal(again.correction.wheel, known.wheel)
    assert not again.change.any()


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
    assert np.unique(failing).size >= 3
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
