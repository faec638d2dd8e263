"""Axles of a bogie in curves against a prototype's states, a linear contact's closed
ones, and identities.

The prototype is that of the reference (same contact models and grid): 1.5e-3 mm, 2e-3
mrad, 5 N m and 0.1 % of the wear number, which its printed digits and its balance to
1e-5 of the axle load bound.
"""

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.contact.axle import (
    LATERAL,
    ROLL_MOMENT,
    UNKNOWNS,
    VERTICAL,
    YAW_MOMENT,
    Contact,
    Wheelsets,
)
from wearsim.contact.balance import ACCEPTED, AT_JUMP, balanced
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import ContactConditions, Counterface, Wheelset, solve
from wearsim.contact.wheels import Task
from wearsim.operation.bogie import Bogies, Vehicle, suspension
from wearsim.operation.controlled import Controlled
from wearsim.operation.resultants import resultants
from wearsim.operation.route import Motion, resting
from wearsim.operation.states import TOLERANCE, StateError, settle, settle_nearby
from wearsim.profile import standard
from wearsim.profile.standard import shipped_path
from wearsim.quantities import GRAVITY
from wearsim.scene.vehicle import VehicleFile
from wearsim.toml_faults import read_toml

VEHICLE = Vehicle(
    half_wheelbase=1.25,
    half_pivot_distance=9.5,
    wheelset_mass=1500.0,
    bogie_mass=3000.0,
    body_mass=53239.55,
    bogie_height=0.6,
    body_height=1.8,
    lateral_stiffness=10e6,
    yaw_stiffness=10e6,
)
DATA = Path(__file__).parents[1] / "data"


def rows():
    with open(DATA / "operation_bogie.csv") as file:
        table = [
            {key: float(value) for key, value in row.items()}
            for row in csv.DictReader(file)
        ]
    return {key: np.array([row[key] for row in table]) for key in table[0]}


def task(radius, deficiency=0.0, friction=0.35, vehicle=VEHICLE, in_front=1.0):
    """Conditions, forces and bogies of curves, the axles of each one after the
    other.
    """
    radius, deficiency, friction = np.broadcast_arrays(
        *(
            np.atleast_1d(np.asarray(one, float))
            for one in (radius, deficiency, friction)
        )
    )
    count, pairs = radius.size, [np.repeat(one, 2) for one in (radius, friction)]
    acceleration = -np.sign(radius) * GRAVITY * deficiency / 1.5
    conditions = ContactConditions.of(
        np.zeros(2 * count),
        wheel_load=0.5 * vehicle.axle_load,
        friction=pairs[1],
        track_curvature=1.0 / pairs[0],
        speed=20.0,
        free_roll=True,
        box_moment=np.repeat(vehicle.box_moment(acceleration, 0.46), 2),
    )
    first = 2 * np.arange(count)
    bogies = Bogies(vehicle, first, first + 1, acceleration, np.full(count, in_front))
    return conditions, Controlled(np.full(2 * count, np.nan), bogies)


def forces_of(running, conditions, bodies, models):
    found = running.conditions(conditions)
    return resultants(solve(found, *bodies, models), found.shift.size)


def test_states_in_curves_are_those_of_the_reference(bodies, models):
    table = rows()
    curves = 1e-3 * table["cant_deficiency_mm"]
    conditions, controlled = task(table["radius_m"], curves, table["friction"])
    running = settle(conditions, controlled, *bodies(0.0), models)
    forces = forces_of(running, conditions, bodies(0.0), models)
    shift = running.conditions(conditions).axle_shift(forces.roll)
    for axle, number in ((slice(0, None, 2), 1), (slice(1, None, 2), 2)):
        np.testing.assert_allclose(
            1e3 * shift[axle], table[f"y{number}_mm"], atol=1.5e-3
        )
        np.testing.assert_allclose(
            1e3 * running.yaw[axle], table[f"yaw{number}_mrad"], atol=2e-3
        )
        np.testing.assert_allclose(
            forces.vertical[axle, 1] / 1e3, table[f"Q_left{number}_kN"], atol=6e-3
        )
        wear = forces.power[axle] / 20.0
        np.testing.assert_allclose(
            wear, table[f"wear_number{number}_N"], rtol=2e-3, atol=2e-2
        )
    np.testing.assert_allclose(forces.force[::2] / 1e3, table["H1_kN"], atol=6e-3)
    np.testing.assert_allclose(forces.moment[::2] / 1e3, table["M1_kNm"], atol=6e-3)
    # the whole bogie in balance, whatever its springs do
    lateral = forces.force.reshape(-1, 2)
    mass = 2.0 * VEHICLE.wheelset_mass + VEHICLE.bogie_mass + VEHICLE.body_mass / 2.0
    near = 4.0 * TOLERANCE * VEHICLE.axle_load
    np.testing.assert_allclose(
        lateral.sum(1), -mass * controlled.bogies.acceleration, atol=near
    )
    turning = VEHICLE.half_wheelbase * (
        lateral[:, 0] - lateral[:, 1]
    ) + forces.moment.reshape(-1, 2).sum(1)
    np.testing.assert_allclose(turning, 0.0, atol=(1.0 + VEHICLE.half_wheelbase) * near)


@pytest.mark.parametrize(
    ("in_front", "states"),
    [
        (1.0, [(-5.2216, -0.9495), (-6.1955, -3.9108)]),
        (-1.0, [(-5.1600, -1.0213), (-6.1110, -3.4274)]),
    ],
)
def test_a_bogie_held_by_the_body_runs_as_that_of_the_reference(
    bodies, models, in_front, states
):
    held = replace(VEHICLE, secondary_yaw_stiffness=0.4e6)
    conditions, controlled = task([600.0, 300.0], vehicle=held, in_front=in_front)
    running = settle(conditions, controlled, *bodies(0.0), models)
    forces = forces_of(running, conditions, bodies(0.0), models)
    shift = running.conditions(conditions).axle_shift(forces.roll)
    found = np.stack([shift[::2], running.yaw[::2]], axis=1)
    np.testing.assert_allclose(1e3 * found, states, atol=2e-3)


def test_a_mirrored_curve_has_mirrored_axles(bodies, models):
    """Of curves that are searched apart."""
    (right, to_right), (left, to_left) = (
        settled(task(radius, 0.05), bodies, models) for radius in (600.0, -600.0)
    )
    near = 2.0 * TOLERANCE * VEHICLE.axle_load
    np.testing.assert_allclose(to_right.force, -to_left.force, atol=near)
    # what a force of that size moves in the stiff direction of the flange, and on the
    # tread by creep
    np.testing.assert_allclose(right.shift, -left.shift, atol=1e-6)
    np.testing.assert_allclose(right.yaw, -left.yaw, atol=2e-6)


def settled(of_curves, bodies, models):
    """Where the axles of curves run, and the forces there."""
    conditions, controlled = of_curves
    running = settle(conditions, controlled, *bodies(0.0), models)
    return running, forces_of(running, conditions, bodies(0.0), models)


def test_curves_that_are_mirror_images_are_searched_once(bodies, models, monkeypatch):
    """A curve to either side and one of them again: the states are exact images; each
    is as if searched by itself.
    """
    counted, contact = [], Wheelsets.contact
    monkeypatch.setattr(
        Wheelsets,
        "contact",
        lambda *given: counted.extend(np.flatnonzero(given[2])) or contact(*given),
    )
    alone = settle(*task(600.0, 0.05), *bodies(0.0), models)
    once = len(counted)
    counted.clear()
    together = settle(*task([600.0, -600.0, 600.0], 0.05), *bodies(0.0), models)
    assert len(counted) == once
    for name in ("shift", "yaw", "roll"):
        values, searched = getattr(together, name), getattr(alone, name)
        np.testing.assert_array_equal(
            values, np.concatenate([searched, -searched, searched])
        )


def test_axles_out_of_parallel_have_no_mirror_image(bodies, models):
    """Curves to either side are both searched, and are no images of each other."""
    oblique = replace(VEHICLE, axle_yaw_offset=1e-3)
    running, _ = settled(task([600.0, -600.0], vehicle=oblique), bodies, models)
    assert np.abs(running.shift[:2] + running.shift[2:]).max() > 1e-5


def test_axles_without_yaw_stiffness_roll_through_a_wide_curve(bodies, models):
    """Neither wheel creeps along the track then; axles that are guided stay
    parallel.
    """
    conditions, controlled = task(3000.0, vehicle=replace(VEHICLE, yaw_stiffness=1.0))
    running = settle(conditions, controlled, *bodies(0.0), models)
    contact = solve(running.conditions(conditions), *bodies(0.0), models)
    assert np.abs(contact.creepage_x).max() < 1e-5
    conditions, controlled = task(3000.0, vehicle=replace(VEHICLE, yaw_stiffness=1e12))
    running = settle(conditions, controlled, *bodies(0.0), models)
    between = (
        -2.0 * VEHICLE.half_wheelbase / 3000.0
    )  # of the directions of the track at both axles
    assert running.yaw[0] - running.yaw[1] == pytest.approx(between, rel=1e-4)


def test_balance_is_found_from_near_by_in_few_solutions(bodies, models, monkeypatch):
    """One at the start, three for the slopes and some steps under them; more come from
    coarse patches.
    """
    conditions, controlled = task([1000.0, 400.0])
    running = settle(conditions, controlled, *bodies(0.0), models)
    counted, contact = [], Wheelsets.contact
    monkeypatch.setattr(
        Wheelsets,
        "contact",
        lambda *given: counted.extend(np.flatnonzero(given[2])) or contact(*given),
    )
    before = replace(running, shift=running.shift - 2e-6, yaw=running.yaw + 1e-6)
    again = settle(conditions, controlled, *bodies(0.0), models, before)
    assert len(counted) <= 8 * running.shift.size
    np.testing.assert_allclose(again.shift, running.shift, atol=1e-6)


def missing(running, conditions, controlled, bodies, models):
    """Force and moment (m, 4) that bogies miss, over the axle load, by contacts solved
    anew.
    """
    bogies, points = controlled.bogies, running.conditions(conditions)
    share = np.ones(points.shift.size)
    forces = forces_of(running, conditions, bodies, models)
    force, moment = forces.force, forces.moment
    if (two := running.beyond) is not None:
        share[two.point] = 1.0 - two.share
        shift = running.shift.copy()
        shift[two.point] = two.shift
        past = forces_of(replace(running, shift=shift), conditions, bodies, models)
        force = share * force + (1.0 - share) * past.force
        moment = share * moment + (1.0 - share) * past.moment
    axles = np.stack([bogies.leading, bogies.trailing], axis=1)
    shift = running.conditions(conditions).axle_shift(forces.roll)
    state = np.stack([shift[axles], running.yaw[axles]], axis=2).reshape(-1, 4)
    springs = suspension(
        bogies.vehicle,
        state,
        conditions.track_curvature[bogies.leading],
        bogies.acceleration,
        bogies.in_front,
    )
    contact = np.stack([force[axles], moment[axles]], axis=2).reshape(-1, 4)
    return (contact + springs) / bogies.vehicle.axle_load


@pytest.mark.parametrize(
    ("wheel", "rail", "inclination", "radius"),
    [
        ("S1002", "60E1", 1 / 20, 5040.0),
        ("P8", "56E1", 1 / 20, 700.0),
        ("EPS", "60E1", 1 / 40, 315.0),
    ],
)
def test_a_bogie_runs_where_its_search_once_found_no_balance(
    models, wheel, rail, inclination, radius
):
    """The forces are smooth there, and neighbouring radii were found."""
    profile = standard.wheel(wheel)
    bodies = (
        Wheelset(profile, profile, 0.46, 0.75),
        Counterface(standard.rail(rail, inclination, 1.435, 0.75), 0.0),
    )
    conditions, controlled = task([radius, -radius], 0.04)
    running = settle(conditions, controlled, *bodies, models)
    assert (
        np.abs(missing(running, conditions, controlled, bodies, models)).max()
        < ACCEPTED
    )


@pytest.mark.slow
def test_a_bogie_at_a_jump_of_the_contact_is_nearly_in_balance():
    """Of the shipped locomotive, whose leading axle is where a patch of S1002 on 54E1
    1:20 splits.
    """
    profile = standard.wheel("S1002")
    bodies = (
        Wheelset(profile, profile, 0.46, 0.75),
        Counterface(standard.rail("54E1", 1 / 20, 1.435, 0.75), 0.0),
    )
    file, _ = read_toml(
        shipped_path("profiles", "vehicles", "locomotive.toml"), VehicleFile
    )
    models = ContactModels.of("fast")
    conditions, controlled = task(1587.0, 0.04, vehicle=file.vehicle)
    running = settle(conditions, controlled, *bodies, models)
    assert (
        np.abs(missing(running, conditions, controlled, bodies, models)).max() < AT_JUMP
    )
    smooth = ContactModels.of("standard")
    running = settle(conditions, controlled, *bodies, smooth, running)
    assert running.beyond is None
    assert (
        np.abs(missing(running, conditions, controlled, bodies, smooth)).max()
        < ACCEPTED
    )


def test_contact_begun_where_the_search_ended_is_in_balance():
    """Solved anew with the fast model, it rests on other patches there: by 1.2 % of the
    axle load.
    """
    profile, models = standard.wheel("S1002"), ContactModels.of("fast")
    bodies = (
        Wheelset(profile, profile, 0.46, 0.75),
        Counterface(standard.rail("60E1", 1 / 40, 1.435, 0.75), 0.0),
    )
    file, _ = read_toml(
        shipped_path("profiles", "vehicles", "locomotive.toml"), VehicleFile
    )
    conditions, controlled = task(1587.0, 0.04, vehicle=file.vehicle)
    conditions = replace(conditions, shift_depth=np.full(2, 0.46))
    running, ends = settle_nearby(conditions, controlled, bodies, models, None, None)
    begun = replace(conditions, nearby=ends.equilibria.placed)
    assert np.abs(missing(running, begun, controlled, bodies, models)).max() < ACCEPTED


@pytest.mark.slow
def test_a_curve_without_balance_is_named(bodies, models):
    loose = replace(VEHICLE, bogie_height=4.0, body_height=4.0)
    conditions, controlled = task([500.0, 250.0], [0.0, 0.4], vehicle=loose)
    with pytest.raises(
        StateError, match="no equilibrium of the bogie in the curve of 250 m"
    ) as error:
        settle(conditions, controlled, *bodies(0.0), models)
    assert list(error.value.messages) == [2]


@dataclass(frozen=True)
class Linear(Wheelsets):
    """Wheelsets whose creep forces are linear and whose conicity is constant."""

    creep, conicity, radius, half = 8e6, 0.1, 0.46, 0.75

    @property
    def wanted(self):
        free = [False] * 4 + [True] * 2 + [False]
        return np.tile(free, (len(self.chunk.shift), 1))

    def contact(self, unknown, rows, near):
        shift, yaw = self.position(unknown).T
        turning = -2.0 * self.creep * self.half
        rolling = (
            self.conicity / self.radius * shift + self.half * self.chunk.track_curvature
        )
        forces = np.zeros((len(unknown), 2, 6))
        forces[:, :, VERTICAL] = 0.5 * VEHICLE.axle_load
        forces[:, :, ROLL_MOMENT] = forces[:, :, VERTICAL] * [0.75, -0.75]
        forces[:, 0, LATERAL] = 2.0 * self.creep * yaw
        forces[:, 0, YAW_MOMENT] = turning * rolling
        return Contact(
            None, forces, rows, np.zeros((rows.size, 3)), np.ones((rows.size, 2))
        )

    def slopes(self, unknown, now, rows):
        still = self.residuals(now.forces)
        moved = [self.contact(unknown + step, rows, None) for step in np.eye(UNKNOWNS)]
        return np.stack(
            [self.residuals(there.forces) - still for there in moved], axis=2
        )


def linear_state(vehicle, curvature):
    """Shift and yaw (2, 2) of the axles of a bogie on linear contacts."""
    one, wheel = np.ones(1), standard.wheel("S1002")
    chunk = ContactConditions.of(
        np.zeros(2),
        track_curvature=curvature,
        wheel_load=0.5 * VEHICLE.axle_load,
        box_moment=0.0,
    )
    bogies = Bogies(vehicle, np.array([0]), np.array([1]), 0.0 * one, one)
    controlled = Controlled(np.full(2, np.nan), bogies)
    wheelset = Wheelset(wheel, wheel, Linear.radius, Linear.half)
    on_nothing = Task((), (), wheelset, (), (), ContactModels.of("fast"), (0, 1), True)
    wheelsets = Linear(on_nothing, chunk, controlled.guidance(chunk), None)
    found = balanced(wheelsets, np.zeros((2, UNKNOWNS)), 1e-10)
    assert (found.residual <= 1e-10).all()
    return np.stack([found.shift, found.yaw], axis=1)


@pytest.mark.parametrize(
    ("stiffness", "expected"),
    [
        (1e6, [-8.1249, -0.0366, -6.2363, 0.0366]),
        (10e6, [-21.6333, -1.3435, -12.7664, 1.3435]),
    ],
)
def test_linear_contact_has_the_state_of_its_equations(stiffness, expected):
    vehicle = replace(VEHICLE, lateral_stiffness=20e6, yaw_stiffness=stiffness)
    # of R = 500 m, in a curve ten times as wide
    np.testing.assert_allclose(
        1e4 * linear_state(vehicle, 1.0 / 5000.0).ravel(), expected, atol=1e-4
    )


def test_axles_out_of_parallel_rest_on_straight_track_as_the_bogie_balances():
    """The mean of the motion on straight track solves the same equations as the balance
    without curve.
    """
    skew = replace(VEHICLE, axle_yaw_offset=0.5e-3)
    motion = Motion(
        "suspended", 9.0, (Linear.creep, Linear.creep), Linear.conicity, 1.0
    )
    state = resting(skew, motion, Wheelset(None, None, Linear.radius, Linear.half))
    np.testing.assert_allclose(linear_state(skew, 0.0), state, atol=1e-9)
    assert state[0, 1] > 1e-4 > -1e-4 > state[1, 1]
    # springs without end keep the axles out of parallel by twice the offset
    stiff = suspension(
        replace(skew, yaw_stiffness=1e12),
        np.array([[0.0, 0.5e-3, 0.0, -0.5e-3]]),
        *[np.zeros(1)] * 3,
    )
    np.testing.assert_allclose(stiff, 0.0, atol=1e-3)


def test_a_bogie_with_independent_wheels_rests_where_it_is_put():
    """Nothing centres or steers it: 0 with parallel axles, and axles out of parallel
    yaw against each other.
    """
    wheelset = Wheelset(None, None, Linear.radius, Linear.half)
    motion = Motion("shifted", 9.0, (0.0, Linear.creep), Linear.conicity, 1.0)
    np.testing.assert_allclose(resting(VEHICLE, motion, wheelset), 0.0, atol=1e-15)
    skew = resting(replace(VEHICLE, axle_yaw_offset=0.5e-3), motion, wheelset)
    assert np.isfinite(skew).all()
    np.testing.assert_allclose(skew[0], -skew[1], atol=1e-9)
    assert skew[0, 1] > 1e-5


def test_springs_of_a_bogie_exert_no_force_on_it_as_a_whole():
    random = np.random.default_rng(3)
    state, one = 1e-3 * random.normal(size=(20, 4)), np.ones(20)
    springs = suspension(VEHICLE, state, 1e-3 * one, 0.0 * one, one)
    size = np.abs(springs).max()
    np.testing.assert_allclose(springs[:, 0] + springs[:, 2], 0.0, atol=1e-12 * size)
    turning = (
        VEHICLE.half_wheelbase * (springs[:, 0] - springs[:, 2])
        + springs[:, 1]
        + springs[:, 3]
    )
    np.testing.assert_allclose(turning, 0.0, atol=1e-12 * size)
