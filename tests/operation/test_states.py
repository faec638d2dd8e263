"""Resultants and states of a wheelset against those of an independent prototype, and
their identities.

The prototype is `../shared/reference/operation` (same contact models and grid): 1e-3
mm, 5 N, 5 N m, 0.1 % of the wear number, which its printed digits bound.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worn_wheels import worn_wheels

from wearsim.contact.axle import (
    DISPLACEMENT,
    LATERAL,
    ROLL_MOMENT,
    TORQUE,
    UNKNOWNS,
    VERTICAL,
    Contact,
    Wheelsets,
)
from wearsim.contact.balance import ACCEPTED, Equilibria
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
    solve,
    solve_guided,
)
from wearsim.errors import ContactError
from wearsim.operation import states
from wearsim.operation.controlled import Controlled
from wearsim.operation.resultants import resultants
from wearsim.operation.states import (
    BeyondJump,
    Running,
    StateError,
    settle,
    settle_rows,
)
from wearsim.profile import standard

AXLE = 160e3
DATA = Path(__file__).parents[1] / "data"


def conditions_of(table, **others):
    names = {"yaw": "yaw_mrad", "shift": "y_mm"}
    values = {
        name: 1e-3 * table[key] for name, key in names.items() if name not in others
    }
    return ContactConditions.of(
        **values, **others, speed=20.0, free_roll=True, box_moment=0.0
    )


def loads_of(running, given, bodies, models):
    """Vertical forces (n, 2) of the contact where wheelsets run."""
    return resultants(
        solve(running.conditions(given), *bodies, models), running.shift.size
    ).vertical


def under(force, count):
    return Controlled(np.broadcast_to(np.asarray(force, float), count))


@pytest.fixture
def solutions(monkeypatch):
    """Number of contact solutions of each point so far."""
    counted = np.zeros(8, dtype=int)
    contact = Wheelsets.contact

    def counting(wheelsets, unknown, rows, near):
        if not wheelsets.coarse:
            counted[: rows.size] += rows
        return contact(wheelsets, unknown, rows, near)

    monkeypatch.setattr(Wheelsets, "contact", counting)
    return counted


def test_forces_and_loads_at_given_shifts_are_those_of_the_reference(
    bodies, models, reference
):
    for curvature, table in reference("operation_resultants.csv").items():
        others = {
            "friction": table["friction"],
            "track_curvature": table["track_curvature_per_m"],
        }
        given, count = conditions_of(table, **others), table["y_mm"].size
        running = settle(given, under(np.nan, count), *bodies(curvature), models)
        found = running.conditions(given)
        solution = solve(found, *bodies(curvature), models)
        forces = resultants(solution, count)
        np.testing.assert_allclose(forces.force / 1e3, table["H_c_kN"], atol=5e-3)
        np.testing.assert_allclose(forces.moment / 1e3, table["M_c_kNm"], atol=5e-3)
        np.testing.assert_allclose(
            forces.vertical[:, 0] / 1e3, table["Q_right_kN"], atol=5e-3
        )
        np.testing.assert_allclose(
            forces.power / 20.0, table["wear_number_N"], rtol=1e-3, atol=1e-2
        )
        np.testing.assert_allclose(forces.vertical.sum(axis=1), AXLE, rtol=2e-5)
        assert (
            np.abs(forces.roll_moment.sum(axis=1)).max()
            <= 2.0 * states.TOLERANCE * AXLE * 0.75
        )
        # a wheel with one patch: Y/Q = tan(|angle| - atan(Fy/N)), on rails
        slope = np.arctan(solution.force_y / solution.normal_force)
        np.testing.assert_allclose(
            solution.track_lateral
            / (solution.track_vertical + curvature * solution.x * solution.force_x),
            np.tan(solution.contact_angle + slope),
            rtol=1e-9,
        )


def test_shifts_by_force_are_those_of_the_reference_and_need_few_solutions_when_warm(
    bodies, models, reference, solutions
):
    for curvature, table in reference("operation_rig.csv").items():
        count = table["H_kN"].size
        given = conditions_of(table, shift=np.zeros(count), friction=0.35)
        wanted = under(1e3 * table["H_kN"], count)
        running = settle(given, wanted, *bodies(curvature), models)
        shift = running.conditions(given).axle_shift()
        np.testing.assert_allclose(1e3 * shift, table["y_mm"], atol=1e-3)
        load = loads_of(running, given, bodies(curvature), models)
        np.testing.assert_allclose(load[:, 0] / 1e3, table["Q_right_kN"], atol=1e-2)
        assert (running.stiffness > 1e6).all()
        solutions[:] = 0
        # as much as a step of wear moves it
        before = replace(
            running,
            shift=running.shift - 2e-6,
            stiffness=1.1 * running.stiffness,
        )
        again = settle(given, wanted, *bodies(curvature), models, before)
        # two for the slopes where those of coarse patches mislead
        assert 1 <= solutions.max() <= 8
        # both within the tolerance of the force
        near = 2.0 * states.TOLERANCE * AXLE / running.stiffness
        assert (np.abs(again.shift - running.shift) <= near).all()


def test_a_shift_below_the_axle_is_that_of_the_axle_and_its_roll(bodies, models):
    below = ContactConditions.of(
        [2e-3, 6e-3], speed=20.0, free_roll=True, shift_depth=0.46
    )
    found = solve(below, *bodies(0.0), models)
    shift = below.axle_shift(found.roll[np.searchsorted(found.point, [0, 1])])
    assert (np.abs(shift - below.shift) > 1e-5).all()
    again = solve(
        ContactConditions.of(shift, speed=20.0, free_roll=True), *bodies(0.0), models
    )
    # both at rest within 1 nm
    np.testing.assert_allclose(again.normal_force, found.normal_force, rtol=1e-5)
    np.testing.assert_allclose(again.rail_y, found.rail_y, atol=1e-6)


def test_a_shift_found_below_the_axle_is_solved_there_again(bodies, models):
    given = ContactConditions.of([0.0], speed=20.0, free_roll=True, shift_depth=0.46)
    running = settle(given, under(25e3, 1), *bodies(0.0), models)
    found = running.conditions(given)
    forces = resultants(solve(found, *bodies(0.0), models), found.shift.size)
    assert -forces.force[0] == pytest.approx(25e3, abs=2.0 * states.TOLERANCE * AXLE)


def test_forces_rise_with_the_shift_at_the_rails_where_that_of_the_axle_goes_back():
    """The roll moves the axle of P8 on its flank back by more than the wheel goes
    forth, from 46 to 56 kN.

    With the shift given at the axle the force jumps by 10 kN there.
    """
    wheel, rail = standard.wheel("P8"), standard.rail("60E1", 1 / 40, 1.435, 0.75)
    bodies = Wheelset(wheel, wheel, 0.46, 0.75), Counterface(rail, 0.0)
    shift = 9.376e-3 + 1e-6 * np.arange(16)
    given = ContactConditions.of(
        shift, wheel_load=[[99e3, 61e3]], speed=20.0, free_roll=True
    )
    jumps = []
    for depth in (None, np.full(shift.size, 0.46)):
        rolled = replace(given, shift_depth=depth)
        if depth is None:
            rolled = replace(given, shift=np.linspace(8.830e-3, 8.848e-3, shift.size))
        solution = solve(rolled, *bodies, ContactModels.of("fast"))
        forces = resultants(solution, rolled.shift.size)
        jumps.append(np.diff(-forces.force).max())
    assert jumps[0] > 8e3
    assert jumps[1] < 2e3


WORN = {
    # the force falls for 18 um to the right of where it is 3 N too low, and rises from
    # there on
    "fold": (
        0.75,
        0.0,
        0.0,
        Running(
            np.array([1.324453398665655e-3]),
            np.array([1.2037267e7]),
            np.zeros(1),
            np.zeros(1),
        ),
    ),
    # no contact from 7.281 to 7.289 mm, where it was expected: above 11 GPa; the
    # balance is before that
    "flank": (
        1.0,
        25e3,
        1e-3,
        Running(
            np.array([7.285523840319748e-3]),
            np.array([8.2355739e8]),
            np.full(1, 1e-3),
            np.zeros(1),
            BeyondJump(
                np.zeros(1, int),
                np.array([7.285682746877062e-3]),
                np.array([0.5887646]),
            ),
        ),
    ),
}


@pytest.mark.parametrize("place", WORN)
def test_a_worn_noisy_pair_finds_its_balance_past_what_is_in_the_way(place):
    """Measured wheels of 10 um noise, worn by a programme of forces; old searches ended
    there.
    """
    radius, force, yaw, start = WORN[place]
    wheels = worn_wheels(place)
    rail = standard.rail("60E1", 1 / 40, 1.435, 0.75)
    bodies = Wheelset(wheels[0], wheels[1], 0.46, 0.75), Counterface(rail, 1.0 / radius)
    models = ContactModels.of("fast", cell_size=0.5e-3)
    given = ContactConditions.of(
        [0.0], yaw=yaw, friction=0.35, speed=20.0, free_roll=True, box_moment=0.0
    )
    running = settle(given, under(force, 1), *bodies, models, start)
    sides = [(1.0, running)]
    if (past := running.beyond) is not None:
        sides = [
            (1.0 - past.share, running),
            (past.share, replace(running, shift=past.shift)),
        ]
    missing = np.zeros(2)
    for share, side in sides:
        found = side.conditions(given)
        forces = resultants(solve(found, *bodies, models), found.shift.size)
        missing += share * np.array(
            [-forces.force[0] - force, forces.roll_moment.sum() / 1.5]
        )
    # of forces; of loads where a side of a jump carries other ones
    assert np.abs(missing[0]) <= ACCEPTED * AXLE
    assert np.abs(missing[1]) <= 2e-3 * AXLE


def test_a_mirrored_state_is_the_mirror_image(bodies, models):
    """Of states that are searched apart. Within the tolerance of the force: the roll
    comes to rest within 1 nm, from the right wheel's side.
    """
    shift, load = [], []
    for sign in (1.0, -1.0):
        given = ContactConditions.of(
            [0.0], yaw=sign * 1e-3, speed=20.0, free_roll=True, box_moment=0.0
        )
        running = settle(given, under(sign * 10e3, 1), *bodies(1.0), models)
        shift.append(running.shift[0])
        load.append(loads_of(running, given, bodies(1.0), models)[0])
    near = 2.0 * states.TOLERANCE * AXLE / running.stiffness[0]
    assert shift[0] == pytest.approx(-shift[1], abs=near)
    np.testing.assert_allclose(load[0], load[1][::-1], atol=states.TOLERANCE * AXLE)


def test_spin_pushes_a_wheelset_off_the_middle(bodies, models):
    """The creep force of the spin is 1.6 times what centres the wheelset; without
    friction it is centred.
    """
    given = ContactConditions.of(
        [0.0, 0.0], friction=[0.35, 1e-6], speed=20.0, free_roll=True, box_moment=0.0
    )
    running = settle(given, under([0.0, 0.0], 2), *bodies(1.0), models)
    assert running.shift[0] == pytest.approx(0.26e-3, abs=0.02e-3)
    assert abs(running.shift[1]) < 1e-5
    either = settle(given, under([-1.0, 0.0], 2), *bodies(1.0), models)
    assert either.shift[0] == pytest.approx(-0.26e-3, abs=0.02e-3)


def test_forces_on_the_boxes_shift_the_load(bodies, models):
    given = ContactConditions.of([0.0], speed=20.0, free_roll=True, box_moment=7.5e3)
    load = resultants(solve(given, *bodies(0.0), models), 1).vertical
    # 7.5 kN m over the 1.5 m between the wheels; the lateral forces of the unlike loads
    # are below 0.1 kN
    assert np.diff(load)[0, 0] == pytest.approx(-10e3, abs=300.0)
    assert load.sum() == pytest.approx(160e3, rel=1e-6)


def test_boxes_that_unload_a_wheel_are_refused(bodies, models):
    given = ContactConditions.of(
        [0.0, 0.0], speed=20.0, free_roll=True, box_moment=[0.0, 125e3]
    )
    with pytest.raises(
        ContactError,
        match=r"^point 1, left wheel, .*leave its left wheel less than 2 % of",
    ):
        solve(given, *bodies(0.0), models)


@pytest.mark.parametrize(
    ("force", "moment", "reason"),
    [
        (250e3, 0.0, "would climb over its crest"),
        (300e3, 0.0, "unloads the left wheel: the axle carries at most"),
        (0.0, 125e3, "axle boxes unload the left wheel already without a lateral"),
        (-1e3, 125e3, "axle boxes unload the left wheel already without a lateral"),
    ],
)
def test_a_force_without_balance_is_an_error_with_its_reason(
    bodies, models, force, moment, reason
):
    given = ContactConditions.of([0.0], speed=20.0, free_roll=True, box_moment=moment)
    with pytest.raises(StateError, match=reason):
        settle(given, under(force, 1), *bodies(0.0), models)


def test_friction_goes_from_that_of_the_tread_to_that_of_the_flange(bodies, models):
    """One coefficient in a patch, linear between 20 and 40 degrees; at 8 mrad they
    slide but for a tenth.
    """
    flange = np.full(4, 0.2)
    given = ContactConditions.of(
        [5.0e-3, 6.0e-3, 6.2e-3, 7.0e-3],
        yaw=8e-3,
        friction=0.4,
        friction_flange=flange,
        speed=20.0,
    )
    solution = solve(given, *bodies(0.0), models)
    share = np.hypot(solution.force_x, solution.force_y) / solution.normal_force
    steep = np.clip(
        (np.degrees(np.abs(solution.contact_angle)) - 20.0) / 20.0, 0.0, 1.0
    )
    limit = 0.4 - 0.2 * steep
    assert set(steep) > {0.0, 1.0}
    assert (share <= limit * (1.0 + 1e-9)).all()
    assert (share >= 0.9 * limit).all()


def test_a_drift_is_seen_as_yaw_the_other_way(bodies, models):
    """The creepage of a cone without spin: a wheelset moving along its own yaw does not
    slip across.
    """
    still = ContactConditions.of([0.0], yaw=1e-3, speed=20.0)
    moving = replace(still, drift=np.array([1e-3]))
    across = [solve(one, *bodies(0.0), models).creepage_y for one in (still, moving)]
    np.testing.assert_allclose(across[0], -1e-3, rtol=0.01)
    np.testing.assert_allclose(across[1], 0.0, atol=1e-5)


def test_rollers_of_unlike_speed_imitate_a_curve_to_the_right(bodies, models):
    """(V_left - V_right)/V = 2 l k gives the creepages of the curve but for its spin;
    levers within 4 %.
    """
    k = 1.0 / 500.0
    straight = ContactConditions.of([0.0], speed=20.0)
    curve = solve(
        replace(straight, track_curvature=np.array([k])), *bodies(0.0), models
    ).creepage_x
    apart = replace(straight, speed_difference=np.array([2 * 0.75 * k]))
    np.testing.assert_allclose(
        solve(apart, *bodies(0.0), models).creepage_x, curve, rtol=0.04
    )


def test_conditions_take_loads_of_each_wheel_and_torques_of_each_point(bodies, models):
    loads = [[90e3, 70e3], [80e3, 80e3]]
    given = ContactConditions.of(0.0, wheel_load=loads, torque=[2e3, 0.0], speed=20.0)
    solution = solve(given, *bodies(0.0), models)
    forces = resultants(solution, given.shift.size)
    np.testing.assert_allclose(forces.vertical, loads, rtol=1e-5)
    # the torque over the radius, within the tolerance of the balance
    np.testing.assert_allclose(
        forces.longitudinal.sum(axis=1), [2e3 / 0.46, 0.0], atol=0.01 * 2e3 / 0.46
    )
    with pytest.raises(ContactError, match=r"wheel_load \(2, 3\)"):
        ContactConditions.of(0.0, wheel_load=np.ones((2, 3)))


def test_a_wheelset_that_begins_in_balance_stays_there_with_its_stiffness(
    bodies, models
):
    given = ContactConditions.of(
        [0.0], yaw=1e-3, speed=20.0, free_roll=True, box_moment=0.0
    )
    running = settle(given, under(20e3, 1), *bodies(1.0), models)
    again = settle(given, under(20e3, 1), *bodies(1.0), models, running)
    near = 2.0 * states.TOLERANCE * AXLE / running.stiffness[0]
    assert again.shift[0] == pytest.approx(running.shift[0], abs=near)
    # slopes by differences and improved ones
    assert again.stiffness[0] == pytest.approx(running.stiffness[0], rel=0.1)


JUMP, PLACE = 4e3, 6.2e-3
"""Of the lateral force [N], and where [m]."""


def force_with_jump(shift):
    return 5e8 * (shift - PLACE) + np.where(shift > PLACE, JUMP, 0.0)


def differences(contact, wheelsets, unknown):
    """Slopes (n, 7, 7) of residuals over a thousandth of each unknown."""
    still = wheelsets.residuals(contact(unknown).forces)
    moved = [
        wheelsets.residuals(contact(unknown + step).forces)
        for step in 1e-3 * np.eye(UNKNOWNS)
    ]
    return np.stack([(there - still) / 1e-3 for there in moved], axis=2)


@pytest.fixture
def guided(monkeypatch):
    """Function that gives wheelsets a lateral force over the shift [N], all else being
    smooth, and returns the number of solved states in a list.
    """
    solved = [0]

    def wheelsets_under(force):
        def contact(wheelsets, unknown, rows, near):
            solved[0] += not wheelsets.coarse
            return of_state(wheelsets, unknown, rows)

        def of_state(wheelsets, unknown, rows):
            posed = wheelsets.conditions(unknown)
            forces = np.zeros((len(unknown), 2, 6))
            forces[:, 0, TORQUE] = (
                7e3 * unknown[:, 0]
            )  # of a creep coefficient of 15 MN
            forces[:, :, VERTICAL] = wheelsets.loads(unknown)
            forces[:, :, ROLL_MOMENT] = forces[:, :, VERTICAL] * [0.75, -0.75]
            forces[:, 0, DISPLACEMENT] = 1.5 * posed.roll
            forces[:, 0, LATERAL] = -force(posed.shift)
            return Contact(
                None, forces, rows, np.zeros((rows.size, 3)), np.ones((rows.size, 2))
            )

        def slopes(wheelsets, unknown, now, rows):
            return differences(
                lambda there: of_state(wheelsets, there, rows), wheelsets, unknown
            )

        monkeypatch.setattr(Wheelsets, "contact", contact)
        monkeypatch.setattr(Wheelsets, "slopes", slopes)
        return solved

    return wheelsets_under


@pytest.fixture
def jumping(guided):
    """Wheelsets whose lateral force rises by 5e8 N/m and jumps by 4 kN at a shift."""
    guided(force_with_jump)


@pytest.fixture
def smooth_models(models):
    """Models whose forces are not known to jump."""
    return replace(models, normal="half_space")


def unguided(count=1):
    return ContactConditions.of(
        np.zeros(count), speed=20.0, free_roll=True, box_moment=0.0
    )


def test_a_wheelset_rests_within_the_scatter_of_its_forces(
    guided, bodies, smooth_models
):
    """By 50 N, 3e-4 of the axle load, it is known where it runs: within 2.5 um."""
    stiffness, scatter = 2e7, 50.0

    def force(shift):
        fold = 1.0 + 0.5 * np.sin(shift / 3e-7)
        return stiffness * (shift - PLACE) + scatter * fold * np.sign(shift - PLACE)

    solved = guided(force)
    running = settle(unguided(), under(0.0, 1), *bodies(0.0), smooth_models)
    assert abs(running.shift[0] - PLACE) < 1.5 * scatter / stiffness
    assert solved[0] < 60


@pytest.mark.parametrize(("stiffness", "place"), [(1e5, 0.5e-3), (3e5, 0.3e-3)])
def test_short_steps_on_a_slack_contact_do_not_find_the_place(
    guided, bodies, smooth_models, stiffness, place
):
    """Steps become short where forces scatter, by 0.4 of what is missing at first."""
    scatter, given = 0.4 * stiffness * place, unguided()

    def force(shift):
        return stiffness * (shift - place) + scatter * np.sign(np.sin(shift / 2e-6 + 1))

    guided(force)
    found = solve_guided(
        given,
        under(0.0, 1).guidance(given),
        *bodies(0.0),
        smooth_models,
        states.TOLERANCE,
    )
    near = abs(found.shift[0] - place) < 1.2 * scatter / stiffness
    assert near or not found.in_place[0]


def test_a_wheelset_leaves_an_unstable_balance_for_one_that_scatters(
    guided, bodies, smooth_models
):
    """At 0.2 mm, where 50 N, 3e-4 of the axle load, are missing."""
    place = 0.2e-3

    def force(shift):
        jump = np.where(np.abs(shift) > place, 50.0, -50.0) * np.sign(shift)
        smooth = 2e7 * (shift**3 / place**2 - shift)
        return smooth + np.where(np.abs(shift) > 0.5 * place, jump, 0.0)

    guided(force)
    running = settle(unguided(), under(0.0, 1), *bodies(0.0), smooth_models)
    assert abs(running.shift[0]) == pytest.approx(place, abs=5e-6)


@pytest.mark.parametrize(("missing", "balanced"), [(4e-3, True), (6e-3, False)])
def test_a_wheelset_without_balance_runs_where_least_is_missing(
    guided, bodies, smooth_models, missing, balanced
):
    """Up to 5e-3 of the axle load."""
    jump = missing * AXLE
    guided(lambda shift: 2e7 * (shift - PLACE) + np.where(shift > PLACE, jump, -jump))
    running, without = settle_rows(
        unguided(), under(0.0, 1), *bodies(0.0), smooth_models
    )
    assert without.tolist() == ([] if balanced else [0])
    if balanced:
        assert running.shift[0] == pytest.approx(PLACE, abs=0.2e-3)


def test_a_force_within_a_jump_is_the_mean_of_both_of_its_sides(
    jumping, bodies, models
):
    """Shares are linear in the force: (H - H_below) / (H_above - H_below). No force is
    that of another one to the other side: this jump has no mirror image.
    """
    wanted = np.array([-600.0, 500.0, 2000.0, 3500.0, 4500.0])
    given = ContactConditions.of(
        np.zeros(wanted.size), speed=20.0, free_roll=True, box_moment=0.0
    )
    running = settle(given, under(wanted, wanted.size), *bodies(0.0), models)
    beyond = running.beyond
    assert beyond.point.tolist() == [1, 2, 3]
    below, above = running.shift[beyond.point], beyond.shift
    assert ((below <= PLACE) & (above > PLACE) & (above - below <= 1e-6)).all()
    mean = (1.0 - beyond.share) * force_with_jump(
        below
    ) + beyond.share * force_with_jump(above)
    np.testing.assert_allclose(mean, wanted[beyond.point], atol=states.TOLERANCE * AXLE)
    # 1 um of the slopes at its sides
    np.testing.assert_allclose(
        beyond.share, wanted[beyond.point] / JUMP, atol=5e8 * 1e-6 / JUMP
    )
    alone = [0, 4]
    np.testing.assert_allclose(
        force_with_jump(running.shift[alone]),
        wanted[alone],
        atol=2.0 * states.TOLERANCE * AXLE,
    )


def test_a_wheelset_leaves_a_jump_when_its_force_no_longer_lies_within(
    jumping, bodies, models
):
    given = ContactConditions.of([0.0], speed=20.0, free_roll=True, box_moment=0.0)
    at_jump = settle(given, under(2000.0, 1), *bodies(0.0), models)
    assert at_jump.beyond is not None
    for wanted in (-800.0, 4800.0):
        after = settle(given, under(wanted, 1), *bodies(0.0), models, at_jump)
        assert after.beyond is None
        assert force_with_jump(after.shift[0]) == pytest.approx(
            wanted, abs=2.0 * states.TOLERANCE * AXLE
        )


def test_slopes_of_a_balance_that_is_met_at_once_are_differences(bodies, models):
    """A search that begins in balance without slopes states its stiffness: to 10 %."""
    given = ContactConditions.of(
        [0.0], yaw=1e-3, speed=20.0, free_roll=True, box_moment=0.0
    )
    wanted = under(20e3, 1)
    running, ends = states.settle_nearby(given, wanted, bodies(1.0), models, None, None)
    begin = Equilibria.found(
        ends.equilibria.unknown, np.full((1, UNKNOWNS, UNKNOWNS), np.nan)
    )
    again, _ = states.settle_nearby(given, wanted, bodies(1.0), models, running, begin)
    assert again.shift[0] == pytest.approx(running.shift[0], abs=1e-9)
    assert again.stiffness[0] == pytest.approx(running.stiffness[0], rel=0.1)
