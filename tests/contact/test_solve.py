"""The four problems together: parallel runs, balances, limits, any input in range."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import CHUNK, solve, solve_each
from wearsim.contact.wheels import joined


def arrays(item, name=""):
    """Every array of a solution by name."""
    for f in fields(item):
        value = getattr(item, f.name)
        if is_dataclass(value):
            yield from arrays(value, f"{name}{f.name}.")
        elif value is not None:
            yield name + f.name, value


def assert_same_bits(one, other):
    for (name, a), (_, b) in zip(arrays(one), arrays(other), strict=True):
        assert a.shape == b.shape, name
        assert a.tobytes() == b.tobytes(), name


@pytest.fixture(scope="module")
def spread(points):
    """Operating points of all kinds; so many that they fill three chunks."""
    random = np.random.default_rng(5)
    n = 2 * CHUNK + 22
    return points(
        shift=random.uniform(-5e-3, 5e-3, n),
        yaw=random.uniform(-0.02, 0.02, n),
        roll=random.uniform(-2e-3, 2e-3, n),
        load=random.uniform(1e3, 150e3, n),
        track_curvature=random.uniform(-2e-3, 2e-3, n),
        friction=random.uniform(0.1, 0.6, n),
        rotation="free",
    )


@pytest.fixture(scope="module")
def solved(spread, wheelset, counterface, coarse):
    return solve(spread, wheelset, counterface(1.0), coarse)


def part_of(conditions, index):
    changed = {
        f.name: getattr(conditions, f.name)[index]
        for f in fields(conditions)
        if isinstance(getattr(conditions, f.name), np.ndarray)
    }
    return replace(conditions, **changed)


@pytest.mark.parametrize("threads", [2, 3])
def test_same_bits_for_any_number_of_threads(
    spread, solved, wheelset, counterface, coarse, threads
):
    assert_same_bits(
        solve(spread, wheelset, counterface(1.0), coarse, threads=threads), solved
    )


def test_few_points_of_the_half_space_are_shared_out_with_the_same_bits(
    spread, wheelset, counterface, coarse
):
    few, models = (
        part_of(spread, slice(0, 5)),
        replace(coarse, normal="half_space", tangential="half_space"),
    )
    few = replace(few, yaw=0.1 * few.yaw)
    parts = [
        solve_each(
            few, wheelset, counterface(1.0), models, lambda part: part, threads=threads
        )
        for threads in (1, 2)
    ]
    assert [len(set(part.point.tolist())) for part in parts[0]] == [2, 2, 1]
    for one, other in zip(*parts, strict=True):
        assert_same_bits(one, other)


def test_same_bits_for_parts_of_whole_chunks(
    spread, solved, wheelset, counterface, coarse
):
    parts = [part_of(spread, slice(0, CHUNK)), part_of(spread, slice(CHUNK, None))]
    first, second = (solve(p, wheelset, counterface(1.0), coarse) for p in parts)
    for name in ("wheel_y", "power", "spin_moment", "rotation_speed"):
        joined = np.concatenate([getattr(first, name), getattr(second, name)])
        assert joined.tobytes() == getattr(solved, name).tobytes(), name


def test_a_point_does_not_depend_on_its_neighbours(
    spread, solved, wheelset, counterface, coarse
):
    """Two forms of one algorithm: 1e-12 of the largest value, rotation by balance
    included.
    """
    for k in (0, CHUNK - 1, CHUNK, 2 * CHUNK + 21):
        alone = solve(
            part_of(spread, slice(k, k + 1)), wheelset, counterface(1.0), coarse
        )
        mine = solved.point == k
        for name in (
            "wheel_y",
            "area",
            "creepage_x",
            "force_x",
            "force_y",
            "spin_moment",
            "power",
        ):
            value = getattr(solved, name)
            np.testing.assert_allclose(
                getattr(alone, name),
                value[mine],
                rtol=1e-12,
                atol=1e-12 * abs(value).max(),
                err_msg=name,
            )


def test_reducing_chunk_by_chunk_is_reducing_the_whole(
    spread, solved, wheelset, counterface, coarse
):
    parts = solve_each(
        spread,
        wheelset,
        counterface(1.0),
        coarse,
        lambda part: (part.point, part.fields.strip_work.max(axis=1)),
        threads=2,
    )
    assert np.concatenate([p for p, _ in parts]).tolist() == solved.point.tolist()
    largest = np.concatenate([w for _, w in parts])
    assert largest.tobytes() == solved.fields.strip_work.max(axis=1).tobytes()


@pytest.mark.parametrize("normal", ["kik_piotrowski", "half_space"])
def test_work_alone_has_the_bits_of_the_work_among_all_fields(
    spread, wheelset, counterface, coarse, normal
):
    few, models = part_of(spread, slice(0, 6)), replace(coarse, normal=normal)
    bodies = wheelset, counterface(1.0)
    whole = solve(few, *bodies, models)
    part = joined(solve_each(few, *bodies, models, lambda part: part, fields="work"))
    for name in ("work_density", "strip_work", "x_lead", "cell_length", "strip_width"):
        np.testing.assert_array_equal(
            getattr(part.fields, name), getattr(whole.fields, name), name
        )
    for name in ("pressure", "shear_x", "shear_y", "slip_x", "slip_y"):
        assert np.isnan(getattr(part.fields, name)).any(), name
        assert np.isfinite(getattr(whole.fields, name)).all(), name
    assert_same_bits(part.patches(), whole.patches())


def test_order_of_the_patches(solved):
    order = np.lexsort((-solved.normal_force, solved.side, solved.point))
    assert order.tolist() == list(range(solved.point.size))
    assert np.array_equal(solved.patch.row, solved.point)


def vertical_forces(solution, curvature, profile):
    """Normal and creep forces of each wheel, upwards; on a roller off its top the
    rolling direction dips.
    """
    height = np.interp(solution.rail_y, profile.y, profile.z)
    dip = np.arctan(curvature * solution.x / (1.0 - curvature * height))
    across = solution.normal_force * np.cos(solution.contact_angle)
    across -= solution.force_y * np.sin(solution.contact_angle)
    upwards = across * np.cos(dip) - solution.force_x * np.sin(dip)
    return np.bincount(2 * solution.point + solution.side, weights=upwards)


def test_patches_of_a_wheel_carry_its_load(spread, solved, counterface):
    """Normal and creep forces together, and the cells carry each patch, 1e-12.

    Tolerance of the balance 1e-6; height of the rail here instead of the wheel's point
    there: 1e-6, too.
    """
    vertical = vertical_forces(solved, 1.0, counterface(1.0).profile)
    np.testing.assert_allclose(vertical, np.repeat(spread.wheel_load, 2), rtol=2e-6)
    area = solved.fields.cell_length * solved.fields.strip_width[:, None]
    carried = (solved.fields.pressure.sum(axis=1) * area).sum(axis=1)
    np.testing.assert_allclose(carried, solved.normal_force, rtol=1e-12)


def test_power_is_work_of_forces_and_of_cells(spread, solved):
    """P = -V F . creepage >= 0 and the sum of the cells' work: 1e-12."""
    speed = spread.speed[solved.point]
    resultant = -speed * (
        solved.force_x * solved.creepage_x
        + solved.force_y * solved.creepage_y
        + solved.spin_moment * solved.spin
    )
    assert solved.power.min() >= 0.0
    np.testing.assert_allclose(
        solved.power, np.maximum(resultant, 0.0), rtol=1e-11, atol=1e-9
    )
    area = solved.fields.cell_length * solved.fields.strip_width[:, None]
    cells = speed * (solved.fields.work_density.sum(axis=1) * area).sum(axis=1)
    np.testing.assert_allclose(cells, solved.power, rtol=1e-12)
    strips = speed * solved.fields.strip_work.sum(axis=1) * solved.fields.strip_width
    np.testing.assert_allclose(strips, solved.power, rtol=1e-12)


def test_resultants_are_sums_of_the_cells(solved):
    area = (solved.fields.cell_length * solved.fields.strip_width[:, None])[:, None, :]
    for name, shear in (
        ("force_x", solved.fields.shear_x),
        ("force_y", solved.fields.shear_y),
    ):
        summed = (shear * area).sum(axis=(1, 2))
        np.testing.assert_allclose(
            summed, getattr(solved, name), atol=1e-12 * 150e3, err_msg=name
        )


def test_strips_lie_on_the_wheel(solved, wheelset):
    edges = solved.strip_edges_wheel_y
    true = np.arange(edges.shape[1] - 1) < solved.patch.strips[:, None]
    assert np.array_equal(np.diff(edges, axis=1) > 0.0, true)  # padding has no width
    assert np.all((edges[:, 0] < solved.wheel_y) & (solved.wheel_y < edges[:, -1]))
    assert edges.min() > wheelset.right.y.min()
    assert edges.max() < wheelset.right.y.max()
    # Strip widths in the contact plane, turned back to the wheel's axis.
    width = np.diff(edges, axis=1).sum(axis=1)
    assert np.all(width <= solved.width * 1.02)
    assert np.all(width >= solved.width * np.cos(solved.contact_angle) * 0.9)


def test_strips_lie_on_the_counterface(solved, rail_60e1):
    """Both sides of a strip are the same strip: the middles of the patches, and widths
    but for the slope.
    """
    edges = solved.strip_edges_rail_y
    true = np.arange(edges.shape[1] - 1) < solved.patch.strips[:, None]
    assert np.array_equal(np.diff(edges, axis=1) > 0.0, true)
    assert np.all((edges[:, 0] < solved.rail_y) & (solved.rail_y < edges[:, -1]))
    assert edges.min() > rail_60e1.y.min()
    assert edges.max() < rail_60e1.y.max()
    across = np.diff(edges, axis=1).sum(axis=1)
    assert np.all(across <= solved.width * (1.0 + 1e-9))
    assert np.all(across >= solved.width * np.cos(solved.contact_angle) * 0.9)


def test_each_side_has_a_counterface_of_its_own(spread, wheelset, counterface, coarse):
    """Another left roller changes nothing on the right where the rotation is given; an
    equal one nothing.
    """
    first = replace(part_of(spread, slice(0, 10)), rotation="nominal")
    one = counterface(1.0)
    flat = replace(one.profile, z=0.9 * one.profile.z)
    same, both = (
        solve(first, wheelset, replace(one, left=left), coarse)
        for left in (one.profile, flat)
    )
    assert_same_bits(solve(first, wheelset, one, coarse), same)
    for name in (
        "rail_y",
        "area",
        "max_pressure",
        "creepage_x",
        "power",
        "strip_edges_rail_y",
    ):
        right, wanted = (getattr(s, name)[s.side == 0] for s in (both, same))
        if (
            name == "strip_edges_rail_y"
        ):  # the other side's patches decide how many are padding
            right, wanted = right[:, :17], wanted[:, :17]
        np.testing.assert_allclose(
            right, wanted, rtol=1e-14, err_msg=name
        )  # sums with padding: the last bit
    assert (
        np.abs(both.area[both.side == 1].max() / same.area[same.side == 1].max() - 1.0)
        > 0.01
    )
    # the mirrored wheelset on exchanged rollers
    mirrored = replace(
        first,
        shift=-first.shift,
        yaw=-first.yaw,
        roll=-first.roll,
        track_curvature=-first.track_curvature,
    )
    mirror = solve(
        mirrored, wheelset, replace(one, profile=flat, left=one.profile), coarse
    )
    for name in ("rail_y", "area", "power", "creepage_x"):
        here, there = (
            getattr(both, name)[both.side == 1],
            getattr(mirror, name)[mirror.side == 0],
        )
        np.testing.assert_allclose(there, here, rtol=1e-12, atol=1e-15, err_msg=name)


def test_without_friction_nothing_wears(wheelset, counterface, points, coarse):
    for rule in ("free", "nominal", "centred"):
        smooth = solve(
            points(
                shift=np.array([-2e-3, 3e-3]), yaw=0.01, friction=0.0, rotation=rule
            ),
            wheelset,
            counterface(2.0),
            coarse,
        )
        for name, value in arrays(smooth):
            assert np.isfinite(value).all(), name
        for name in ("force_x", "force_y", "spin_moment", "power"):
            assert not getattr(smooth, name).any(), (rule, name)
        assert not smooth.fields.work_density.any()
        assert np.all(smooth.power_balance == 1.0)


def test_batches_that_end_with_a_chunk_or_have_no_point(
    wheelset, counterface, points, coarse
):
    one = solve(
        points(shift=np.zeros(CHUNK)), wheelset, counterface(), coarse, sides=(0,)
    )
    assert one.point.tolist() == list(range(CHUNK))
    more = solve(
        points(shift=np.zeros(CHUNK + 1)), wheelset, counterface(), coarse, sides=(0,)
    )
    assert more.point.tolist() == list(range(CHUNK + 1))
    assert len(set(more.power.tolist())) == 1
    for rule in ("free", "nominal", "centred"):
        none = solve(
            points(shift=np.zeros(0), rotation=rule), wheelset, counterface(), coarse
        )
        assert none.power.shape == (0,)
        assert none.fields.strip_work.shape[0] == 0


def test_normal_force_instead_of_wheel_load(wheelset, counterface, points, coarse):
    """The single patch carries exactly that force; the wheel load then follows from its
    angle.
    """
    force = solve(
        points(shift=3e-3), wheelset, counterface(), coarse, sides=(0,), vertical=False
    )
    assert force.normal_force[0] == pytest.approx(80e3, rel=1e-12)
    load = solve(points(shift=3e-3), wheelset, counterface(), coarse, sides=(0,))
    assert vertical_forces(load, 0.0, counterface().profile) == pytest.approx(
        [80e3], rel=1e-6
    )


def test_two_patches_where_the_contact_jumps(wheelset, counterface, points, coarse):
    """Near 5 mm tread and gauge corner close together; their loads add up to the
    wheel's.
    """
    solution = solve(
        points(shift=np.linspace(4.6e-3, 5.6e-3, 11)),
        wheelset,
        counterface(),
        coarse,
        sides=(0,),
    )
    count = np.bincount(solution.point)
    assert count.max() == 2
    vertical = vertical_forces(solution, 0.0, counterface().profile)
    np.testing.assert_allclose(vertical[::2], 80e3, rtol=1e-6)


def test_finer_grids_change_little(wheelset, counterface, points):
    """Discretisation of the default 50 x 50 grid against 200 x 200: power 1.5 %, forces
    1.5 % of friction.
    """
    conditions = points(
        shift=np.array([-4e-3, 0.0, 3e-3]), yaw=np.array([0.0, 2e-3, 0.0])
    )
    default, fine = (
        solve(
            conditions,
            wheelset,
            counterface(1.0),
            ContactModels.of("fast", strips=n, cells=n),
            sides=(0,),
        )
        for n in (50, 200)
    )
    np.testing.assert_allclose(default.power, fine.power, rtol=0.015)
    np.testing.assert_allclose(default.force_x, fine.force_x, atol=0.015 * 28e3)
    np.testing.assert_allclose(default.force_y, fine.force_y, atol=0.015 * 28e3)
    np.testing.assert_allclose(default.area, fine.area, rtol=2e-3)


@settings(max_examples=25)
@given(
    st.floats(-5e-3, 5e-3),
    st.floats(-20e-3, 20e-3),
    st.floats(1e3, 150e3),
    st.sampled_from([0.0, 1.0, 2.0]),
    st.floats(0.0, 1.0).map(lambda value: round(value, 6)),
    st.sampled_from(["free", "nominal", "centred"]),
)
def test_any_point_in_range(
    wheelset, counterface, points, coarse, shift, yaw, load, curvature, friction, rule
):
    conditions = points(shift, yaw, load=load, friction=friction, rotation=rule)
    ground = counterface(curvature)
    solution = solve(conditions, wheelset, ground, coarse)
    for name, value in arrays(solution):
        assert np.isfinite(value).all(), name
    np.testing.assert_allclose(
        vertical_forces(solution, curvature, ground.profile), load, rtol=3e-6
    )
    shear = np.hypot(solution.fields.shear_x, solution.fields.shear_y)
    assert np.all(shear <= friction * solution.fields.pressure * (1.0 + 1e-12))
    assert solution.power.min() >= 0.0
    assert np.all(solution.patch.x_lead >= solution.patch.x_trail)
    assert np.all(solution.slip_area <= solution.area * (1.0 + 1e-12))
    assert np.all(solution.max_pressure > 0.0)


def test_unlike_wheel_loads_are_carried_as_they_are_given(
    wheelset, counterface, points, coarse
):
    """A wheel that carries a hundredth of the other one is no fault of the roll."""
    given = replace(points(np.zeros(1)), wheel_load=np.array([[160e3, 1.6e3]]))
    solution = solve(given, wheelset, counterface(), coarse)
    carried = np.bincount(solution.side, solution.track_vertical)
    assert carried == pytest.approx([160e3, 1.6e3], rel=2e-6)
