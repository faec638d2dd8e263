"""Equal operating points and mirror images: solved once, as if each were solved by
itself.
"""

from dataclasses import fields, replace

import numpy as np
import pytest

from wearsim.campaign import evaluate
from wearsim.campaign.evaluate import setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.left_out import new_history
from wearsim.contact.mirror import images_of
from wearsim.contact.problem import ContactConditions
from wearsim.operation.points import select
from wearsim.operation.states import BeyondJump
from wearsim.scene import build, load_scene

SCENE = """\
[scene]
kind = "field"
title = "A train that is turned half of the time"

[wheelset]
profile = "S1002"
radius_mm = 460

[counterface]
profile = "60E1"
inclination = "1:40"

[wear]
law = "usfd"
coefficients = "lewis_dwyer_joyce_2004"

[fatigue]
laws = ["wlrm", "surface_fatigue_index"]
wear_number = "with_spin"

[vehicle]
file = "regional_multiple_unit"
leading_share = 0.5
turned_share = 0.5

[[vehicle.class]]
name = "straight"
share = 0.5
speed_km_h = 120
friction = 0.35
shift_std_mm = 1.5

[[vehicle.class]]
name = "curve"
share = 0.5
curve_radius_m = 600
speed_km_h = 80
friction = 0.35
cant_deficiency_mm = 40

[campaign]
distance_km = 100
"""


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """Set-up and new state of the scene."""
    file = tmp_path_factory.mktemp("turned") / "turned.toml"
    file.write_text(SCENE, encoding="utf-8")
    setup = build(load_scene(file))
    return setup, WheelsetEvolution(setup).start()[0]


@pytest.fixture
def solved(monkeypatch):
    """Numbers of operating points whose contact is solved."""
    numbers, alone = [], evaluate.solve_each
    monkeypatch.setattr(
        evaluate,
        "solve_each",
        lambda conditions, *others, **options: (
            numbers.append(conditions.shift.size)
            or alone(conditions, *others, **options)
        ),
    )
    return numbers


def of_few(setup, state):
    """Four of the points on straight track in either direction, and both curves."""
    names = np.array(setup.points.class_name)
    straight = np.flatnonzero(["straight" in name for name in names])
    curve = np.flatnonzero(["curve" in name for name in names])
    places = np.abs(setup.points.conditions.shift[straight])
    outside = straight[np.argsort(-places, kind="stable")[:8]]
    index = np.sort(np.concatenate([outside, curve]))
    points = select(setup.points, index)
    if points.conditions.nearby is not None:
        points = replace(points, conditions=replace(points.conditions, nearby=None))
    return points, replace(state, points=None, running=None, begin=None)


def each_alone(points, state, setup):
    """Passages of the points, each of a batch of its own."""
    count = len(points.label)
    return [
        solve_passage(state, points, setup, np.arange(count) == k) for k in range(count)
    ]


def test_copies_are_what_each_point_has_by_itself(turned, solved):
    """Every value of every patch, to the accuracy of a balance of loads: 1e-5.
    At most half of the points are solved.
    """
    setup, state = turned
    points, state = of_few(setup, state)
    together = solve_passage(state, points, setup_of(setup))
    assert 0 < sum(solved) <= len(points.label) / 2
    alone = each_alone(points, state, setup_of(setup))
    for name in (field.name for field in fields(together.contact)):
        if name in ("patch", "nearby"):
            continue
        expected = np.concatenate(
            [
                np.pad(
                    value := getattr(part.contact, name),
                    [
                        (0, 0),
                        *[
                            (0, size - own)
                            for size, own in zip(
                                getattr(together.contact, name).shape[1:],
                                value.shape[1:],
                                strict=True,
                            )
                        ],
                    ],
                    mode="edge",
                )
                for part in alone
            ]
        )
        found = getattr(together.contact, name)
        scale = max(np.abs(expected).max(), 1e-9)
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=1e-5 * scale, err_msg=name
        )
    area = np.concatenate([part.wear.area_rate for part in alone])
    np.testing.assert_allclose(
        together.wear.area_rate, area, rtol=0, atol=1e-4 * area.max()
    )


def test_unlike_wheels_have_no_mirror_images(turned, solved):
    """Points of one shift are still copies; those of the other side are solved."""
    setup, state = turned
    points, state = of_few(setup, state)
    z = state.z.copy()
    z[1] += 1e-6 * np.linspace(-1.0, 1.0, z.shape[1])
    solve_passage(state, points, setup_of(setup))
    like, solved[:] = sum(solved), []
    solve_passage(replace(state, z=z), points, setup_of(setup))
    assert sum(solved) > like


def test_a_copy_of_a_point_that_fails_has_its_own_message(turned):
    """Off the rail to either side: the wheel and the reason of each."""
    setup, state = turned
    points, state = of_few(setup, state)
    images = images_of(points.conditions, True)
    copy = int(np.flatnonzero(images.copied & images.mirrored)[0])
    source = int(images.source[copy])
    shift = points.conditions.shift.copy()
    shift[[source, copy]] = 80e-3, -80e-3
    far = replace(points.conditions, shift=shift)
    assert images_of(far, True).source[copy] == source
    points = replace(points, conditions=far)
    history = replace(state, points=new_history(points))
    failed = solve_passage(history, points, setup_of(setup)).failed
    assert "shift 80 mm" in str(failed[source])
    assert "shift -80 mm" in str(failed[copy])
    assert failed[copy].row == copy


def test_points_at_a_jump_are_no_copies(turned):
    """A point that runs in two places keeps both; its image, in one place, has its own
    contact.
    """
    setup, state = turned
    points, state = of_few(setup, state)
    images = images_of(points.conditions, True)
    copy = int(np.flatnonzero(images.copied)[0])
    source = int(images.source[copy])
    place = points.conditions.shift[[source]]
    two = BeyondJump(np.array([source]), place + 0.2e-3, np.array([0.25]))
    whole = solve_passage(state, replace(points, beyond=two), setup_of(setup)).contact
    alone = solve_passage(state, points, setup_of(setup)).contact
    force = [part.normal_force[part.point == copy].sum() for part in (whole, alone)]
    assert force[0] == pytest.approx(force[1], rel=1e-6)
    assert (whole.point == source).sum() > (alone.point == source).sum()


CHANGED = {
    "shift": 4e-3,
    "yaw": 2e-3,
    "roll": 1e-3,
    "wheel_load": [81e3, 70e3],
    "speed": 21.0,
    "friction": 0.31,
    "track_curvature": 2e-3,
    "rotation": -46.0,
    "torque": 1e3,
    "friction_flange": 0.2,
    "drift": 2e-3,
    "speed_difference": 2e-3,
    "shift_depth": 0.46,
    "rail": 1,
    "box_moment": 1e3,
    "torque_difference": 1e3,
}
"""A value that another point has, of every condition on which contacts depend."""


OTHERS = {"free_roll", "creepage", "nearby"}
"""One rule for all points; given creepages, without copies; where a search begins."""


def test_no_condition_is_forgotten():
    names = {field.name for field in fields(ContactConditions)}
    assert names == set(CHANGED) | OTHERS


@pytest.mark.parametrize("name", CHANGED)
def test_points_that_differ_in_a_condition_are_no_copies(name):
    pair = np.zeros(2)
    values = dict.fromkeys(CHANGED, pair) | {
        "wheel_load": np.full((2, 2), 70e3),
        "speed": pair + 20.0,
        "friction": pair + 0.3,
        "rotation": pair - 45.0,
        "friction_flange": pair + 0.3,
        "rail": np.zeros(2, dtype=int),
    }
    equal = ContactConditions(**values)
    assert images_of(equal, True).copied.tolist() == [False, True]
    other = values[name].copy()
    other[1] = CHANGED[name]
    changed = replace(equal, **{name: other})
    assert not images_of(changed, True).copied.any()


def test_conditions_that_are_not_known_have_no_copies():
    given = ContactConditions.of([1e-3, 2e-3, 1e-3])
    unknown = replace(given, shift=np.array([1e-3, np.nan, 1e-3]))
    assert images_of(unknown, False).source.tolist() == [0, 1, 0]


def test_images_need_equal_conditions():
    """A point, its mirror image, one with other friction, and one in another curve."""
    conditions = ContactConditions.of(
        [3e-3, -3e-3, -3e-3, -3e-3],
        yaw=[1e-3, -1e-3, -1e-3, -1e-3],
        friction=[0.3, 0.3, 0.4, 0.3],
        track_curvature=[1e-3, -1e-3, -1e-3, 1e-3],
        wheel_load=[[80e3, 70e3], [70e3, 80e3], [70e3, 80e3], [70e3, 80e3]],
    )
    images = images_of(conditions, True)
    assert images.source.tolist() == [0, 0, 2, 3]
    assert images.mirrored.tolist() == [False, True, False, False]
    assert not images_of(conditions, False).copied.any()
    with_equal = images_of(conditions.at(np.array([2, 0, 2, 0])), False)
    assert with_equal.source.tolist() == [0, 1, 0, 1]
    assert not with_equal.mirrored.any()


def test_given_creepages_have_no_images():
    given = ContactConditions.of([0.0, 0.0], creepage=[[1e-3, 0.0, 0.0]] * 2)
    assert not images_of(given, True).copied.any()
