"""A campaign by force: each row holds the balance on its worn wheels, and the next step
starts from it.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign import running as running_of_states
from wearsim.campaign.evaluate import setup_of, solve_passage, solved
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import summarise
from wearsim.campaign.run import run_evolution
from wearsim.campaign.running import row_running
from wearsim.campaign.state import State, flattened, rebuilt
from wearsim.contact.axle import Wheelsets
from wearsim.contact.balance import ACCEPTED
from wearsim.operation import states
from wearsim.operation.points import where_it_runs
from wearsim.operation.states import TOLERANCE, BeyondJump
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.results import FILL_FLOAT
from wearsim.scene import build, load_scene
from wearsim.scene.overrides import Override
from wearsim.studies.states import states as states_of

FEW = 5
"""Contact solutions of a search that starts near its end."""

SCENE = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "rig": "full_scale"},
    "contact": {"model": "fast", "strips": 8, "cells": 8, "cell_mm": 2},
    "wear": {"law": "archard"},
    "operation": {
        "block": [
            {
                "name": "tread",
                "lateral_force_kN": 1,
                "axle_load_kN": 160,
                "speed_km_h": 72,
                "friction": 0.35,
                "distance_km": 2,
            },
            {
                "name": "flange",
                "lateral_force_kN": 30,
                "axle_load_kN": 160,
                "speed_km_h": 72,
                "friction": 0.3,
                "yaw_mrad": 1,
                "distance_km": 1,
            },
        ],
        "monitor": {
            "shifts_mm": [0],
            "load_kN": 80,
            "speed_km_h": 72,
            "friction": 0.35,
        },
    },
    "campaign": {"distance_km": 100, "first_step_depth_um": 2},
}


@pytest.fixture(scope="module")
def steps():
    """Evolution, and state and row after each of three steps."""
    evolution = WheelsetEvolution(build(load_scene(SCENE)))
    state, taken = evolution.start()
    found = []
    for _ in range(4):
        evaluation = evolution.evaluate(state, taken)
        found.append((state, evolution.row(state, evaluation, taken)))
        state, taken = evolution.advance(state, evaluation)
    return evolution, found, state


def test_every_row_holds_the_forces_that_are_controlled(steps):
    _, found, _ = steps
    known = 0
    for _, row in found:
        force, load = row["lateral_force"], row["wheel_loads"]
        solved = force[:2] != FILL_FLOAT
        known += solved.sum()
        np.testing.assert_allclose(
            force[:2][solved], np.array([1e3, 30e3])[solved], atol=TOLERANCE * 160e3
        )
        np.testing.assert_allclose(load[:2].sum(axis=1), 160e3, rtol=2.0 * TOLERANCE)
        assert row["lateral_position"][2] == 0.0  # the monitoring point stays
        assert row["wear_share"].sum() == pytest.approx(1.0)
        quotient = row["derailment_quotient"][:2][solved]
        # the wheels' lateral forces add up to the force
        carried = (quotient * load[:2][solved] * [1.0, -1.0]).sum(axis=1)
        np.testing.assert_allclose(carried, force[:2][solved], atol=2.0)
    assert known >= 4
    positions = np.array([row["lateral_position"][:2] for _, row in found])
    assert (np.ptp(positions, axis=0) > 1e-6).all()  # wear moves the wheelset
    assert {"lateral_position", "wheel_loads", "wear_share"} <= set(QUANTITIES)


def test_rows_state_what_is_missing_of_the_forces_that_are_controlled(
    steps, monkeypatch
):
    """Over the axle load; nothing of points in given places."""
    evolution, found, _ = steps
    for state, row in found:
        residual = row["force_residual"]
        assert (residual[:2] <= ACCEPTED).all()
        np.testing.assert_array_equal(residual[:2], state.running.residual[:2])
        assert residual[2] == FILL_FLOAT
    search = states.solve_guided

    def inexact(*given, **more):
        found = search(*given, **more)
        return replace(found, residual=np.full(found.residual.size, 4e-3))

    monkeypatch.setattr(states, "solve_guided", inexact)
    after, _ = evolution.advance(found[-1][0], evolution.evaluate(found[-1][0]))
    np.testing.assert_array_equal(after.running.residual, [4e-3, 4e-3, 0.0])


def test_rows_hold_a_force_that_two_shifts_of_the_axle_carry_and_stored_states_take_the_same_step():
    """P8 on 60E1 carries 46 to 56 kN at two shifts of the axle, but at one at the
    height of the rails.
    """
    block = {
        "name": "flange",
        "lateral_force_kN": 51,
        "axle_load_kN": 160,
        "speed_km_h": 72,
    }
    block |= {"friction": 0.35, "distance_km": 1}
    operation = {**SCENE["operation"], "block": [block]}
    scene = {**SCENE, "wheelset": {"profile": "P8"}, "operation": operation}
    evolution = WheelsetEvolution(build(load_scene(scene)))
    state, taken = evolution.start()
    shares = []
    for _ in range(3):
        evaluation = evolution.evaluate(state, taken)
        row = evolution.row(state, evaluation, taken)
        assert row["lateral_force"][0] == pytest.approx(
            51e3, abs=2.0 * TOLERANCE * 160e3
        )
        shares.append(row["share_beyond_jump"][0])
        stored = rebuilt(State, flattened(state))
        again, _ = evolution.advance(stored, evolution.evaluate(stored))
        state, taken = evolution.advance(state, evaluation)
        for name, value in flattened(state).items():
            assert flattened(again)[name].tobytes() == value.tobytes(), name
    assert max(shares) == 0.0


def test_a_stored_state_takes_the_same_step_to_the_last_bit(steps):
    evolution, found, after = steps
    state, _ = found[-1]
    stored = rebuilt(State, flattened(state))
    for name in ("shift", "stiffness", "residual"):
        np.testing.assert_array_equal(
            getattr(stored.running, name), getattr(state.running, name)
        )
    again, _ = evolution.advance(stored, evolution.evaluate(stored))
    np.testing.assert_array_equal(again.z, after.z)
    np.testing.assert_array_equal(again.running.shift, after.running.shift)


def test_stages_look_for_acting_points_with_the_models_of_the_campaign(
    steps, monkeypatch
):
    evolution, found, _ = steps
    state, asked = found[1][0], []

    def recording(conditions, controlled, bodies, models, *others, stage, **more):
        asked.append((models, None if stage is None else stage.tolist()))
        return states.settle_nearby(
            conditions, controlled, bodies, models, *others, stage=stage, **more
        )

    monkeypatch.setattr(running_of_states, "settle_nearby", recording)
    after, _ = evolution.advance(state, evolution.evaluate(state))
    acts = (after.active_weight > 0.0).tolist()
    assert (evolution.setup.models, acts) in asked
    assert (evolution.setup.models, None) in asked
    assert {models for models, _ in asked} == {evolution.setup.models}


FAST = [Override("contact.model", "fast")]


def test_wear_and_forces_at_both_sides_of_a_jump_are_means_with_their_shares(steps):
    evolution, found, _ = steps
    state, points = found[-1][0], evolution.setup.points
    running, setup, weight = state.running, setup_of(evolution.setup), points.weight
    past = BeyondJump(
        np.array([1]),
        running.shift[[1]] + 0.2e-3,
        np.array([0.3]),
    )

    def of(position):
        there = where_it_runs(points, position)
        return there, solved(
            state, there, weight, setup, among=np.ones(weight.size, bool)
        )

    right = running.shift.copy()
    right[1] = past.shift[0]
    (here, one), (aside, other) = of(running), of(replace(running, shift=right))
    there, both = of(replace(running, beyond=past))
    expected = 0.7 * one.collective.depth + 0.3 * other.collective.depth
    # of sums over padding
    np.testing.assert_allclose(
        both.collective.depth, expected, rtol=1e-9, atol=1e-12 * expected.max()
    )
    rows = [
        row_running(
            state,
            replace(evolution.setup, points=where),
            weight,
            each.passage,
            each.wear,
        )
        for where, each in ((here, one), (aside, other), (there, both))
    ]
    for name in ("lateral_force", "axle_wear_number", "lateral_position"):
        mean = 0.7 * rows[0][name] + 0.3 * rows[1][name]
        assert rows[2][name][1] == pytest.approx(mean[1], rel=1e-9)
    assert rows[2]["share_beyond_jump"].tolist() == pytest.approx([0.0, 0.3, 0.0])
    patches = [summarise(each.passage, each.wear, 3) for each in (one, both)]
    assert patches[1]["n_patch"][1] > patches[0]["n_patch"][1]
    assert patches[1]["wear_index_mean"][1, 0] == pytest.approx(
        patches[0]["wear_index_mean"][1, 0]
    )


def test_a_stored_state_keeps_both_sides_of_a_jump(steps):
    state = steps[1][-1][0]
    past = BeyondJump(np.array([1]), np.array([6e-3]), np.array([0.25]))
    for beyond in (past, None):
        running = replace(state.running, beyond=beyond)
        stored = rebuilt(State, flattened(replace(state, running=running))).running
        assert flattened(stored).keys() == flattened(running).keys()
        assert all(
            (value == flattened(running)[name]).all()
            for name, value in flattened(stored).items()
        )


@pytest.fixture(scope="module")
def worn_by_force():
    """Rows of the shipped scene to 700 km, and contacts of a wheelset solved in each
    search.
    """
    contact, settle, searches = Wheelsets.contact, running_of_states.settle_nearby, []

    def counting(wheelsets, unknown, rows, near):
        if searches and not (
            wheelsets.coarse or wheelsets.placed.all()
        ):  # not while the scene is built
            searches[-1].append(rows.sum())
        return contact(wheelsets, unknown, rows, near)

    def settled_and_counted(*given, **options):
        searches.append([])
        return settle(*given, **options)

    rows = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Wheelsets, "contact", counting)
        patch.setattr(running_of_states, "settle_nearby", settled_and_counted)
        scene = load_scene(shipped_path("workflows", "rig.toml"), overrides=FAST)
        evolution = WheelsetEvolution(build(scene))
        state, taken = evolution.start()
        while state.distance < 700e3:
            evaluation = evolution.evaluate(state, taken)
            rows.append(evolution.row(state, evaluation, taken))
            state, taken = evolution.advance(state, evaluation)
    return rows, np.array([sum(contacts) / max(contacts) for contacts in searches])


@pytest.mark.slow
def test_a_campaign_by_force_wears_on_as_its_flank_wears(worn_by_force):
    """Before the shift followed in stages, steps were of 0.3 km from 540 km on."""
    rows, _ = worn_by_force
    assert len(rows) < 40
    force = np.array(
        [row["lateral_force"][3] for row in rows if row["active_weight"][3] > 0.0]
    )
    np.testing.assert_allclose(force, 20e3, atol=2.0 * TOLERANCE * 160e3)
    positions = np.array([row["lateral_position"][3] for row in rows])
    assert (np.diff(positions) > -2e-6).all()  # outwards, as the flank wears


@pytest.mark.slow
def test_a_shift_by_force_needs_few_contacts_in_half_of_all_searches(worn_by_force):
    """Of stages and ends of steps: one at the start, two for slopes, and steps."""
    rows, contacts = worn_by_force
    assert contacts.size > 2 * len(rows)
    assert np.median(contacts) <= FEW


def test_check_marks_a_block_that_runs_on_both_sides_of_a_jump(steps):
    setup, running = steps[0].setup, steps[1][0][0].running
    past = BeyondJump(np.array([1]), running.shift[[1]] + 1e-6, np.array([0.5]))

    def shown(there):
        points, state = where_it_runs(setup.points, there), steps[1][0][0]
        return states_of(points, solve_passage(state, points, setup_of(setup)))

    marked = shown(replace(running, beyond=past))
    jumps = [
        any("both sides of the jump" in mark for mark in one["marks"]) for one in marked
    ]
    assert jumps == [False, True]
    right = running.shift.copy()
    right[1] += 0.2e-3
    past = replace(past, shift=right[[1]], share=np.array([0.3]))
    near, far, both = (
        shown(there)[1]
        for there in (
            running,
            replace(running, shift=right),
            replace(running, beyond=past),
        )
    )
    for name in ("lateral_force", "steering_moment", "wear_number", "load_right"):
        assert both[name] == pytest.approx(0.7 * near[name] + 0.3 * far[name], rel=1e-9)


@pytest.mark.slow
def test_searches_of_a_worn_vehicle_do_not_circle(monkeypatch, tmp_path):
    """Kinks of the forces, where strips gain and lose contact, kept searches of worn
    wheels circling above their tolerance for up to 93 contacts (10 now).
    """
    contacts = []
    settle, contact = states.settle_nearby, Wheelsets.contact

    def counted(*given, **options):
        contacts.append(0)
        return settle(*given, **options)

    def counting(*given):
        if contacts:
            contacts[-1] += 1
        return contact(*given)

    monkeypatch.setattr(running_of_states, "settle_nearby", counted)
    monkeypatch.setattr(Wheelsets, "contact", counting)
    scene = load_scene(
        Path(__file__).parents[2] / "workflows" / "field.toml",
        overrides=[Override("campaign.distance_km", 2000.0)],
    )
    run_evolution(WheelsetEvolution(build(scene)), tmp_path, "field")
    assert max(contacts[1:]) < 30
