"""Balance of wheel load and axle torque by normal and creep forces, with every pair of
models.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import wearsim
from wearsim.contact import axle, geometry, loaded, wheels
from wearsim.contact.axle import Wheelsets
from wearsim.contact.balance import Equilibria, settled
from wearsim.contact.guidance import in_given_place
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import ContactConditions, ContactModels
from wearsim.contact.rough_axle import begun_with_coarse_patches
from wearsim.contact.solve import solve
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.contact.wheels import Task
from wearsim.errors import ContactError

# Tread, and near the flange's fillet, with the yaw either way up to 60 mrad; ellipses
# exist at all of them.
SHIFT = 1e-3 * np.array([-4.0, -3.0, 3.0, 3.0, 3.5])
YAW = 1e-3 * np.array([0.0, 60.0, 10.0, -60.0, 30.0])
FLANGE = (6e-3, 60e-3)  # shift and yaw at which creep forces carry half the load


@pytest.fixture(scope="module")
def balanced(wheelset, counterface):
    """Factory of equilibria, and what of load [N] and torque [N m] is left at each
    point.
    """

    def run(conditions, curvature, models):
        ground = counterface(curvature)
        task = Task(
            wheels=(geometry.wheel_surface(wheelset.right, wheelset.radius),) * 2,
            counterfaces=(geometry.counterface_profile(ground.profile),) * 2,
            wheelset=wheelset,
            curvature=(curvature, curvature),
            rolling_curvature=(curvature, curvature),
            models=models,
            sides=(0, 1),
            vertical=True,
        )
        problem = Wheelsets(task, conditions, in_given_place(conditions), None)
        result = settled(problem, *begun_with_coarse_patches(problem))
        loads = problem.loads(result.unknown)
        wheels, force, planes = (
            result.wheels,
            result.contact.plane_force,
            result.wheels.normal.patch.planes,
        )
        along, across, deep = np.moveaxis(wheels.kinematics.down, 2, 0)
        normal = (
            wheels.normal.normal_force[:, None]
            if planes is None
            else planes.normal_force
        )
        up = (normal * deep - force[:, :, 0] * along - force[:, :, 1] * across).sum(
            axis=1
        )
        turning = (force * wheels.kinematics.per_speed).sum(axis=(1, 2)) * wheels.speed
        point, count = wheels.normal.patch.row, conditions.shift.size
        carried = np.bincount(2 * point + (wheels.sign < 0.0), up, 2 * count).reshape(
            count, 2
        )
        return (
            loads,
            carried - conditions.wheel_load[:, None],
            np.bincount(point, turning, count),
        )

    return run


@pytest.mark.parametrize("curvature", [0.0, 2.0])
@pytest.mark.parametrize(
    ("normal", "tangential"),
    [*product(sorted(NORMAL_MODELS), sorted(TANGENTIAL_MODELS))],
)
def test_every_pair_of_models_balances_load_and_torque(
    balanced, points, normal, tangential, curvature
):
    """1e-6 of the load; of the torque 1e-6 of what friction carries, or the tangential
    model's tolerance.

    Or what its forces jump by.
    """
    models = ContactModels(normal, tangential, strips=16, cells=16, cell_size=1e-3)
    _, load, torque = balanced(points(SHIFT, YAW), curvature, models)
    model = TANGENTIAL_MODELS[tangential]
    assert np.abs(load).max() <= max(1.001e-6, 0.3 * model.jump) * 80e3
    tolerance = max(1.001e-6, model.tolerance, model.jump)
    assert np.abs(torque).max() <= tolerance * 0.35 * 80e3 * 0.46


@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_flange_contact_at_60_mrad_is_balanced(balanced, points, coarse, curvature):
    """There the normal force alone would carry 0.6 of the load; signs of both wheels
    and of the dip count.
    """
    shift, yaw = np.array([FLANGE[0], -FLANGE[0]]), np.array([FLANGE[1], -FLANGE[1]])
    loads, load, _ = balanced(points(shift, yaw), curvature, coarse)
    assert np.abs(load).max() <= 1.001e-6 * 80e3
    assert 0.4 < loads[0, 0] / 80e3 < 0.8
    np.testing.assert_allclose(
        loads[0], loads[1, ::-1], rtol=1e-9
    )  # the mirrored wheelset


def test_without_friction_normal_forces_alone_carry_the_load(balanced, points, coarse):
    loads, load, _ = balanced(points(SHIFT, YAW, friction=0.0), 0.0, coarse)
    np.testing.assert_allclose(loads, 80e3, rtol=1e-9)
    assert np.abs(load).max() < 1e-6 * 80e3


def test_true_models_are_asked_about_three_times(monkeypatch, balanced, points, coarse):
    """The coarse patches find the neighbourhood, Broyden's method the rest; the last
    look has fields.
    """
    asked = []
    forces_of = axle.forces_of

    def counted(task, wheels, speed, model, **options):
        if wheels.normal.patch.y.shape[1] > 12:
            asked.append(np.unique(wheels.normal.patch.row).size)
        return forces_of(task, wheels, speed, model, **options)

    monkeypatch.setattr(axle, "forces_of", counted)
    balanced(
        points(np.linspace(-4e-3, 4e-3, 40), np.linspace(-10e-3, 10e-3, 40)),
        0.0,
        coarse,
    )
    assert len(asked) <= 5
    assert sum(asked) / 40 < 3.6  # the last one for the fields


def test_stretched_patches_are_near_those_solved_anew(
    monkeypatch, wheelset, counterface, points, coarse
):
    """Similarity over a thousandth of the load: power within 1e-4, strip work within
    1e-3 of the largest.
    """
    conditions = points(SHIFT, YAW)
    quick = solve(conditions, wheelset, counterface(1.0), coarse)
    monkeypatch.setattr(loaded, "SIMILAR", 1e-7)
    anew = solve(conditions, wheelset, counterface(1.0), coarse)
    np.testing.assert_allclose(quick.power, anew.power, rtol=1e-4)
    work = anew.fields.strip_work
    np.testing.assert_allclose(
        quick.fields.strip_work, work, rtol=0.0, atol=1e-3 * work.max()
    )


def test_a_flange_that_locks_is_refused_with_angle_and_friction(
    wheelset, counterface, points, coarse
):
    """Climbing: the yaw turns the flange against the rail, and friction x tan(angle)
    reaches 1.
    """
    with pytest.raises(
        ContactError, match=r"^right wheel, shift 6.5 mm, yaw -60 mrad: flange locks"
    ) as caught:
        solve(points(6.5e-3, -60e-3, friction=0.5), wheelset, counterface(), coarse)
    message = str(caught.value)
    assert "friction coefficient of 0.5" in message
    product_of_both = float(message.split("tan(angle) = ")[1].split(",")[0])
    assert product_of_both > 1.0
    assert caught.value.row == 0


def test_a_locked_flange_is_named_by_its_point_and_wheel(
    wheelset, counterface, points, coarse
):
    shift, yaw = np.zeros(5), np.zeros(5)
    shift[3], yaw[3] = -6.5e-3, 60e-3
    with pytest.raises(ContactError, match=r"^point 3, left wheel, .*flange locks"):
        solve(points(shift, yaw, friction=0.5), wheelset, counterface(), coarse)


@pytest.mark.parametrize("normal", sorted(NORMAL_MODELS))
def test_a_row_whose_rough_solution_fails_is_solved_in_full(
    monkeypatch, wheelset, counterface, points, normal
):
    """The others keep their bits, and the row its solution within the tolerance of its
    balance.
    """
    conditions = points([1e-3, 3e-3, 5e-3], [0.0, 10e-3, 0.0], rotation="free")
    models = ContactModels(normal, "fastsim", strips=12, cells=12, cell_size=1e-3)
    whole = solve(conditions, wheelset, counterface(), models)
    model, calls = NORMAL_MODELS[normal], []

    def fails(gap, row, load, **options):
        if options["rough"] and 1 in row:
            calls.append(row.size)
            raise ContactError("not roughly", row=1)
        return model(gap, row, load, **options)

    monkeypatch.setattr(wheels, "NORMAL_MODELS", {normal: fails})
    again = solve(conditions, wheelset, counterface(), models)
    assert max(calls) == min(3, model.chunk)
    np.testing.assert_array_equal(again.point, whole.point)
    others = whole.point != 1
    np.testing.assert_array_equal(
        again.normal_force[others], whole.normal_force[others]
    )
    np.testing.assert_array_equal(again.power[others], whole.power[others])
    assert again.normal_force == pytest.approx(whole.normal_force, rel=1e-4)


def test_given_normal_forces_need_one_patch_in_the_solution_alone(
    monkeypatch, wheelset, counterface, points, coarse
):
    """A rough solution with two patches is no fault of the input."""
    model = NORMAL_MODELS["kik_piotrowski"]

    def several(gap, row, load, **options):
        if options["rough"]:
            raise ContactError("several patches close", row=int(row[0]))
        return model(gap, row, load, **options)

    monkeypatch.setattr(wheels, "NORMAL_MODELS", {"kik_piotrowski": several})
    solution = solve(
        points([0.0, 3e-3]), wheelset, counterface(), coarse, sides=(0,), vertical=False
    )
    assert solution.normal_force == pytest.approx([80e3, 80e3], rel=1e-9)


@pytest.mark.parametrize("normal", ["kik_piotrowski", "half_space"])
def test_half_space_tractions_of_a_point_do_not_depend_on_the_others(
    wheelset, counterface, points, normal
):
    """Sums over padded strips may differ in the last bit."""
    shift, yaw, load = (
        [-4e-3, 3e-3, 5e-3, 5.5e-3],
        [0.0, 10e-3, -5e-3, 30e-3],
        [2e3, 80e3, 80e3, 150e3],
    )
    models = ContactModels(normal, "half_space", strips=10, cells=10, cell_size=1e-3)
    whole = solve(
        points(shift, yaw, load=load, rotation="free"), wheelset, counterface(), models
    )
    for k in range(len(shift)):
        alone = solve(
            points(shift[k], yaw[k], load=load[k], rotation="free"),
            wheelset,
            counterface(),
            models,
        )
        mine = whole.point == k
        for name in ("normal_force", "force_x", "force_y", "spin_moment", "creepage_x"):
            here, expected = getattr(whole, name)[mine], getattr(alone, name)
            np.testing.assert_allclose(
                here, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max()
            )


def test_a_wheel_that_needs_more_than_its_contact_carries_is_refused_with_the_reason(
    wheelset, counterface, points, coarse
):
    """On a small roller the patch reaches the profile's end before the loads are
    balanced.
    """
    shift, yaw = np.zeros(3), np.zeros(3)
    shift[1], yaw[1] = 6.7e-3, -37e-3
    load = np.array([80e3, 270e3, 80e3])
    with pytest.raises(ContactError) as caught:
        solve(
            points(shift, yaw, load=load, friction=0.8),
            wheelset,
            counterface(10.0),
            coarse,
        )
    message = str(caught.value)
    assert message.startswith(
        "point 1, right wheel, shift 6.7 mm, yaw -37 mrad: flange locks: at a contact"
    )
    assert "creep forces lift the wheel, and at " in message
    assert (caught.value.row, caught.value.side) == (1, 0)


def test_true_patches_stand_in_for_coarse_ones_without_solution(
    monkeypatch, wheelset, counterface, points, coarse
):
    """Near a profile's end coarse patches of the half-space may reach it where true
    ones do not.
    """
    model, failed = NORMAL_MODELS[coarse.normal], []

    def without(gap, row, load, **options):
        if options["rough"] and (row == 2).any():
            failed.append(
                int(gap.bodies.pose.shift[0] != SHIFT[0])
            )  # a left wheel is mirrored
            raise ContactError("the contact patch reaches the edge of a profile", row=2)
        return model(gap, row, load, **options)

    conditions = points(SHIFT, YAW)
    wanted = solve(conditions, wheelset, counterface(), coarse)
    monkeypatch.setattr(wheels, "NORMAL_MODELS", {coarse.normal: without})
    result = solve(conditions, wheelset, counterface(), coarse)
    assert set(failed) == {0, 1}
    np.testing.assert_allclose(result.normal_force, wanted.normal_force, rtol=3e-6)
    other = result.point != 2
    assert np.array_equal(result.power[other], wanted.power[other])


def test_a_flange_that_locks_is_an_error_of_its_wheel(
    wheelset, counterface, points, coarse
):
    locked = points(np.array([0.0, -6.5e-3]), np.array([0.0, 60e-3]), friction=0.5)
    with pytest.raises(ContactError, match=r"mrad: flange locks") as caught:
        solve(locked, wheelset, counterface(), coarse)
    assert (caught.value.row, caught.value.side) == (1, 1)


def test_a_wheelset_at_rest_needs_few_rolls_where_creep_forces_carry_much(
    monkeypatch, wheelset, counterface, points, coarse
):
    """Loads follow the roll and the roll the loads: both settle together.

    The other wheelset, which stands straight, settles before and is not solved again.
    On a fixed grid: forces jump where the size of a patch adds a strip.
    """
    coarse, solved, solved_wheels = (
        replace(coarse, cell_size=1.0),
        [],
        loaded.solved_wheels,
    )

    def counted(task, chunk, sides, load, wanted, rough=False):
        if not rough:
            solved.append(wanted.any(axis=1).tolist())
        return solved_wheels(task, chunk, sides, load, wanted, rough)

    for module in (axle, loaded):
        monkeypatch.setattr(module, "solved_wheels", counted)
    conditions = points(
        np.array([0.0, 6.34e-3]), np.array([0.0, -45.6e-3]), friction=0.367
    )
    solution = solve(
        replace(conditions, free_roll=True), wheelset, counterface(5.0), coarse
    )
    assert sum(one[0] for one in solved) < sum(one[1] for one in solved)
    assert not solved[-1][0]
    assert len(solved) <= 8
    again = replace(
        conditions,
        roll=np.array([solution.roll[solution.point == k][0] for k in (0, 1)]),
    )
    given = solve(again, wheelset, counterface(5.0), coarse)
    assert given.normal_force == pytest.approx(solution.normal_force, rel=1e-5)


@pytest.mark.parametrize(
    ("model", "free_roll", "shift", "yaw", "friction", "load"),
    [
        (
            "fast",
            False,
            -6.30462e-3,
            45.17479e-3,
            0.45225,
            113072.29,
        ),  # a load that jumps past the balance
        ("fast", False, -7.462e-3, 15.30e-3, 0.607, 104246.0),
        ("fast", True, 7.41e-3, -35e-3, 0.3, 107369.0),
        (
            "standard",
            True,
            6.4207532e-3,
            -15.4257144e-3,
            0.60552095,
            65190.339,
        ),  # normal force of 7 loads
        (
            "standard",
            True,
            6.46561665e-3,
            -11.11212459e-3,
            0.29259139,
            38726.225,
        ),  # torque that jumps
    ],
)
def test_wheels_near_their_climb_are_balanced(
    model, free_roll, shift, yaw, friction, load
):
    """Within what creep forces of strips jump by; normal forces of the flange are up to
    15 wheel loads.
    """
    bodies = wearsim.wheelset("S1002"), wearsim.rails("60E1", inclination=1 / 40)
    given = ContactConditions.of(
        shift, yaw=yaw, friction=friction, wheel_load=load, free_roll=free_roll
    )
    solution = solve(given, *bodies, ContactModels.of(model))
    carried = np.bincount(solution.side, solution.track_vertical)
    assert carried == pytest.approx([load, load], rel=2e-4)
    assert solution.normal_force.max() > 2.0 * load


def test_equilibria_drift_in_proportion_to_the_distance():
    """From those 10 m before; what is unknown stays unknown and keeps no drift, and a
    wheelset that does not act stays.
    """
    before, after = np.zeros((3, 7)), np.full((3, 7), 0.01)
    before[1, 3] = after[1, 4] = np.nan
    slope = np.zeros((3, 7, 7))
    equilibria = Equilibria.found(after, slope).with_drift(
        Equilibria.found(before, slope), 10.0
    )
    expected = np.full((3, 7), 0.015)
    expected[1, 3], expected[1, 4], expected[2] = 0.01, np.nan, 0.01
    acts = np.array([True, True, False])
    np.testing.assert_allclose(equilibria.ahead(5.0, acts).unknown, expected)
    still = Equilibria.found(after, slope).ahead(5.0, acts)
    np.testing.assert_array_equal(still.unknown, after)


def test_equilibria_that_were_a_moment_apart_do_not_drift_away():
    """0.1 um of shift over 1 m are the residual of a search, not a drift."""
    slope, after = np.zeros((1, 7, 7)), np.full((1, 7), 1e-3)
    equilibria = Equilibria.found(after, slope).with_drift(
        Equilibria.found(np.zeros((1, 7)), slope), 1.0
    )
    far = equilibria.ahead(1e6, np.array([True])).unknown
    assert (np.abs(far) <= 2.1).all()
