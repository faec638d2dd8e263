"""Pressure of half-spaces: closed forms, orders, symmetries, lobes and patches,
refusals.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from closed_forms import hertz

from wearsim.contact import geometry
from wearsim.contact.geometry import CounterfaceProfile, Gap, WheelsetPose
from wearsim.contact.influence import (
    field_of,
    normal_influence,
    spectrum,
    wave_table,
    waves_of,
)
from wearsim.contact.normal import half_space
from wearsim.contact.normal.half_space.lobes import Lobe, gather
from wearsim.contact.normal.half_space.pressure import NODES, HeightGrid, solve_pressure
from wearsim.contact.patch import Resolution
from wearsim.errors import ContactError, NumericalError

E_STAR, LOAD = 210e9 / (2.0 * (1.0 - 0.3**2)), 80e3


def paraboloid(along, across, cells, load=LOAD):
    """Grid that fits the Hertz ellipse as the model's grids fit patches, and the
    ellipse.
    """
    ellipse = hertz(along, across, load, E_STAR)
    a, b = float(ellipse.semi_axis_x), float(ellipse.semi_axis_y)
    length, width = 2.0 * a / (cells - 3), 2.0 * b / (cells - 3)
    step = np.arange(cells) - 0.5 * (cells - 1)
    x, y = step[:, None] * length, step * width
    return (
        HeightGrid(along * x**2 + across * y**2, length, width),
        ellipse,
        ellipse.pressure(x, y),
    )


# A and B [1/m]: circle, a/b = 0.21, 1.9, 4.8; 1/50 is a line contact almost.
PARABOLOIDS = [(1.0, 1.0), (1.0, 0.09), (0.4, 1.0), (0.09, 1.0), (600.0, 1.0)]


@pytest.mark.parametrize(("along", "across"), PARABOLOIDS)
def test_hertz(along, across):
    """64 x 64 cells: maximum 0.1 %, approach 1e-4, field 0.2 %; area by its staircase 1
    %.
    """
    grid, ellipse, expected = paraboloid(along, across, 64)
    result = solve_pressure([grid], LOAD, E_STAR)
    pressure, cell = result.pressure[0], grid.cell_length * grid.cell_width
    assert result.converged
    assert pressure.max() == pytest.approx(float(ellipse.max_pressure), rel=1e-3)
    assert result.vertical_displacement == pytest.approx(
        float(ellipse.approach), rel=1e-4
    )
    assert np.abs(pressure - expected).sum() * cell < 2e-3 * LOAD
    assert np.count_nonzero(pressure) * cell == pytest.approx(
        float(ellipse.area), rel=1e-2
    )
    assert pressure.sum() * cell == pytest.approx(LOAD, rel=1e-12)


@pytest.mark.parametrize(("along", "across"), PARABOLOIDS)
def test_order_of_convergence(along, across):
    """Border cells cost the field order 1.5 and more, the maximum order 2; the area's
    staircase order 1.
    """
    counts, maximum, field, area, iterations = (
        np.array([16, 24, 32, 48, 64, 96, 128]),
        [],
        [],
        [],
        [],
    )
    for cells in counts:
        grid, ellipse, expected = paraboloid(along, across, int(cells))
        result = solve_pressure([grid], LOAD, E_STAR, tolerance=1e-6)
        pressure, cell = result.pressure[0], grid.cell_length * grid.cell_width
        maximum.append(abs(pressure.max() / float(ellipse.max_pressure) - 1.0))
        field.append(np.abs(pressure - expected).sum() * cell / LOAD)
        area.append(abs(np.count_nonzero(pressure) * cell / float(ellipse.area) - 1.0))
        iterations.append(result.iterations)
    orders = [
        np.polyfit(np.log(counts), np.log(error), 1)[0]
        for error in (maximum, field, area)
    ]
    assert orders[0] < -1.8
    assert orders[1] < -1.6
    assert orders[2] < -1.0
    # With n log n in each, 0.5 in cells per side keeps the total exponent below 1.25 in
    # their number.
    assert np.polyfit(np.log(counts), np.log(iterations), 1)[0] < 0.5


@pytest.mark.parametrize("cells", [32, 64])
@pytest.mark.parametrize(("along", "across"), PARABOLOIDS)
def test_tolerance_holds_the_maximum(along, across, cells):
    """What the default tolerance leaves: 1e-4 of the maximum pressure, 1e-3 in a border
    cell.
    """
    grid, ellipse, _ = paraboloid(along, across, cells)
    result = solve_pressure([grid], LOAD, E_STAR).pressure[0]
    tight = solve_pressure([grid], LOAD, E_STAR, tolerance=1e-12).pressure[0]
    assert result.max() == pytest.approx(tight.max(), rel=1e-4)
    np.testing.assert_allclose(
        result, tight, rtol=0.0, atol=1e-3 * float(ellipse.max_pressure)
    )


def test_conditions_of_contact_hold():
    """No pressure beside, no overlap; the gap under pressure is zero to 1e-4 of the
    approach.
    """
    grid, _, _ = paraboloid(1.0, 0.3, 48)
    result = solve_pressure([grid], LOAD, E_STAR, tolerance=1e-10)
    shape = grid.height.shape
    influence = normal_influence(grid.cell_length, grid.cell_width, shape, E_STAR)
    tables, moved = [wave_table(count) for count in shape], np.empty(shape)
    field_of(
        waves_of(result.pressure[0], *tables) * spectrum(influence), *tables, moved
    )
    left = grid.height + moved - result.vertical_displacement
    loaded = result.pressure[0] > 0.0
    assert np.all(result.pressure[0] >= 0.0)
    assert np.abs(left[loaded]).max() < 1e-6 * result.vertical_displacement
    assert left[~loaded].min() > -1e-6 * result.vertical_displacement


def test_pressure_scales_as_hertz():
    """Eight times the load on a grid twice as large: twice the pressure, four times the
    approach.
    """
    small, large = paraboloid(1.0, 0.3, 40)[0], paraboloid(1.0, 0.3, 40, 8.0 * LOAD)[0]
    one, other = (
        solve_pressure([small], LOAD, E_STAR),
        solve_pressure([large], 8.0 * LOAD, E_STAR),
    )
    np.testing.assert_allclose(
        other.pressure[0], 2.0 * one.pressure[0], rtol=1e-9, atol=1.0
    )
    assert other.vertical_displacement == pytest.approx(
        4.0 * one.vertical_displacement, rel=1e-9
    )


def test_two_grids_share_the_vertical_displacement():
    """Grids that do not feel each other: the loads of each are those of Hertz at the
    common approach.
    """
    one, first, _ = paraboloid(1.0, 0.3, 48)
    other, second, _ = paraboloid(4.0, 2.0, 48, 20e3)
    lift = float(first.approach - second.approach)  # the second touches later
    result = solve_pressure(
        [one, replace(other, height=other.height + lift)], LOAD + 20e3, E_STAR
    )
    loads = [
        p.sum() * g.cell_length * g.cell_width
        for p, g in zip(result.pressure, (one, other), strict=True)
    ]
    np.testing.assert_allclose(loads, [LOAD, 20e3], rtol=1e-3)


def test_coupled_grids_press_on_each_other_like_point_loads():
    """Nodes that all lie 40 mm away: the displacement of both grows by half the load
    over pi E* d.
    """
    grid, _, _ = paraboloid(1.0, 0.3, 32, 0.5 * LOAD)
    count = NODES * NODES
    coupling = np.kron(
        1.0 - np.eye(2), np.full((count, count), 1.0 / (np.pi * E_STAR * 40e-3))
    )
    alone, both = (
        solve_pressure([grid, grid], LOAD, E_STAR, coupling=one)
        for one in (None, coupling)
    )
    more = 0.5 * LOAD / (np.pi * E_STAR * 40e-3)
    assert both.vertical_displacement - alone.vertical_displacement == pytest.approx(
        more, rel=1e-3
    )
    np.testing.assert_allclose(
        both.pressure[0],
        alone.pressure[0],
        rtol=0.0,
        atol=1e-3 * alone.pressure[0].max(),
    )


def test_pressures_to_start_from_save_iterations_and_leave_the_answer():
    """Those of a load 2 % off: the solution is that from the first guess, to the
    tolerance.
    """
    grid, _, _ = paraboloid(1.0, 0.3, 64)
    guessed = solve_pressure([grid], LOAD, E_STAR)
    near = solve_pressure([grid], 0.98 * LOAD, E_STAR)
    begun = solve_pressure([grid], LOAD, E_STAR, start=near.pressure)
    assert begun.iterations < guessed.iterations
    assert begun.pressure[0].max() == pytest.approx(guessed.pressure[0].max(), rel=1e-4)
    assert begun.vertical_displacement == pytest.approx(
        guessed.vertical_displacement, rel=1e-6
    )


def curve(height, angle=0.0, radius=0.46, curvature=0.0):
    """Gap of a wheel over a plane counterface of some inclination, 40 mm to each side,
    as a bare curve.
    """
    y = np.linspace(-40e-3, 40e-3, 8001)
    zero = np.zeros_like(y)
    ground = CounterfaceProfile(
        y, y * np.tan(angle), zero + np.tan(angle), zero + angle
    )
    return Gap(
        ground,
        curvature,
        height(y)[None],
        y[None],
        zero[None],
        radius + zero[None],
        zero[None],
    )


def resolution(strips, cells=None, cell=1.0, most=200):
    """As many strips and cells as given, unless cells must be smaller."""
    return Resolution(cell, strips, strips if cells is None else cells, most)


def solved(
    gap,
    load=LOAD,
    strips=40,
    vertical=True,
    cells=None,
    cell=1.0,
    rough=False,
    **parameters,
):
    rows = gap.gap.shape[0]
    return half_space.MODEL(
        gap,
        np.arange(rows),
        np.full(rows, load),
        vertical=vertical,
        effective_modulus=E_STAR,
        resolution=resolution(strips, cells, cell),
        parameters=parameters,
        rough=rough,
    )


def test_a_faint_patch_at_an_edge_is_left_out():
    """A ridge on the end of the profile: 0.04 % of the load, which the other patch
    takes over; not 0.3 %.
    """

    def under(height):
        return solved(
            curve(
                lambda y: np.minimum(2.0 * y**2, height + 200.0 * (y - 39.99e-3) ** 2)
            ),
            strips=20,
        )

    result = under(91.4e-6)
    assert result.normal_force.tolist() == pytest.approx([LOAD], rel=1e-12)
    cell = result.patch.width[0] * result.patch.grid.cell_length[0]
    assert result.patch.grid.pressure.sum() * cell == pytest.approx(LOAD, rel=1e-12)
    assert 1e-4 < result.load_scale[0] - 1.0 < 1e-3
    with pytest.raises(ContactError, match="edge of a profile"):
        under(89e-6)


@pytest.mark.parametrize("bend", [0.05, 1.0, 30.0])
@pytest.mark.parametrize("curvature", [0.0, 2.0])
def test_model_is_hertz_on_a_parabola(bend, curvature):
    """Search and fit of the grid included; a/b from 0.16 to 18."""
    result = solved(curve(lambda y: bend * (y - 3e-3) ** 2, curvature=curvature))
    ellipse = hertz(0.5 * (1.0 / 0.46 + curvature), bend, LOAD, E_STAR)
    assert result.patch.row.tolist() == [0]
    assert result.max_pressure[0] == pytest.approx(
        float(ellipse.max_pressure), rel=2e-3
    )
    assert result.approach[0] == pytest.approx(float(ellipse.approach), rel=5e-4)
    assert result.vertical_displacement[0] == pytest.approx(
        float(ellipse.approach), rel=5e-4
    )
    assert result.patch.area[0] == pytest.approx(float(ellipse.area), rel=2e-2)
    assert result.centre_y[0] == pytest.approx(3e-3, abs=1e-6)
    assert result.patch.length[0] == pytest.approx(
        2.0 * float(ellipse.semi_axis_x), rel=1.5 / 40
    )
    assert result.patch.lateral_extent[0] == pytest.approx(
        2.0 * float(ellipse.semi_axis_y), rel=1.5 / 40
    )


def test_model_on_an_inclined_plane():
    """The parabola seen along the normal: curvatures and load turn with the plane."""
    tilt = 0.4
    result = solved(curve(lambda y: (y / np.cos(tilt)) ** 2 / np.cos(tilt), angle=tilt))
    ellipse = hertz(0.5 * np.cos(tilt) / 0.46, 1.0, LOAD / np.cos(tilt), E_STAR)
    assert result.contact_angle[0] == pytest.approx(tilt, abs=1e-12)
    assert result.normal_force[0] == pytest.approx(LOAD / np.cos(tilt), rel=1e-9)
    # The wheel's parabola turns by 2 B y sin(tilt) over the patch: 1 %.
    assert result.max_pressure[0] == pytest.approx(
        float(ellipse.max_pressure), rel=1e-2
    )
    assert result.approach[0] == pytest.approx(float(ellipse.approach), rel=1e-2)
    assert result.vertical_displacement[0] == pytest.approx(
        float(ellipse.approach) / np.cos(tilt), rel=1e-2
    )


def test_moved_and_mirrored():
    """A gap 10 mm beside, and its mirror image: the same patch, to the iteration's
    tolerance.
    """

    def lopsided(y):
        return np.where(y < 0.0, 0.3 * y**2, 3.0 * y**2) + 4.0 * y**3

    plain, moved = solved(curve(lopsided)), solved(curve(lambda y: lopsided(y - 10e-3)))
    mirror = solved(curve(lambda y: lopsided(-y)))
    for name in ("max_pressure", "approach", "normal_force"):
        np.testing.assert_allclose(
            getattr(moved, name), getattr(plain, name), rtol=1e-4
        )
        np.testing.assert_allclose(
            getattr(mirror, name), getattr(plain, name), rtol=1e-4
        )
    assert moved.centre_y[0] - plain.centre_y[0] == pytest.approx(10e-3, abs=1e-6)
    assert mirror.centre_y[0] == pytest.approx(-plain.centre_y[0], abs=1e-6)
    np.testing.assert_allclose(
        mirror.patch.grid.pressure[0],
        plain.patch.grid.pressure[0, :, ::-1],
        atol=5e-3 * plain.max_pressure[0],
    )


def lobes(distance):
    """Two parabolas of one height, a distance apart."""
    return lambda y: (
        np.minimum((y - 0.5 * distance) ** 2, (y + 0.5 * distance) ** 2) * 4.0
    )


def test_lobes_on_one_grid_are_symmetric_and_feel_each_other():
    """Each presses on the other like a point load: approach = that of half the load +
    N/2 / (pi E* d).
    """
    distance = 14e-3
    result = solved(curve(lobes(distance)), strips=120)
    pressure = result.patch.grid.pressure
    assert pressure.shape[0] == 1
    across = pressure[0].sum(axis=0)
    np.testing.assert_allclose(across, across[::-1], rtol=0.0, atol=1e-3 * across.max())
    assert np.count_nonzero(across == 0.0) > 30  # between them
    alone = float(hertz(0.5 / 0.46, 4.0, 0.5 * LOAD, E_STAR).approach)
    beside = 0.5 * LOAD / (np.pi * E_STAR * distance)
    assert beside > 0.1 * alone
    assert result.vertical_displacement[0] == pytest.approx(alone + beside, rel=5e-3)


def test_patches_far_apart_do_not_feel_each_other():
    result = solved(curve(lobes(40e-3)))
    alone = hertz(0.5 / 0.46, 4.0, 0.5 * LOAD, E_STAR)
    assert result.patch.row.tolist() == [0, 0]
    np.testing.assert_allclose(result.normal_force, 0.5 * LOAD, rtol=1e-4)
    np.testing.assert_allclose(np.sort(result.centre_y), [-20e-3, 20e-3], atol=1e-5)
    np.testing.assert_allclose(
        result.vertical_displacement, float(alone.approach), rtol=5e-4
    )


@pytest.mark.slow
def test_grids_part_without_a_jump():
    """From one grid to two that feel each other less and less: steps of 0.25 mm move
    the wheel evenly.
    """
    distance = 1e-3 * np.arange(12.0, 34.0, 0.5)
    result = [solved(curve(lobes(d)), strips=60) for d in distance]
    assert {f.patch.row.size for f in result} == {1, 2}
    displacement = np.array([f.vertical_displacement[0] for f in result])
    steps = np.diff(displacement) / displacement[:-1]
    assert np.all(steps < 1e-3)
    assert np.abs(steps).max() < 0.03
    assert np.abs(np.diff(steps)).max() < 0.02  # the ramp begins and ends


def test_a_third_lobe_is_found_though_it_is_small():
    """0.2 um below the surface that is pressed down between two lobes nothing is missed
    or invented.
    """

    def gap(depth):
        return curve(lambda y: np.minimum(lobes(24e-3)(y), 30.0 * y**2 + depth))

    pressed = solved(gap(1.0)).vertical_displacement[0]
    touching = solved(gap(0.5 * pressed))
    assert touching.vertical_displacement[0] < pressed
    middle = np.abs(touching.patch.y + touching.centre_y[:, None]) < 1e-3
    load = touching.patch.grid.pressure.sum(axis=1)
    assert load[middle].max() > 0.0
    free = solved(gap(1.05 * pressed))
    assert free.vertical_displacement[0] == pytest.approx(pressed, rel=1e-6)


def lobe(left, right, angle):
    return Lobe(
        1e-3 * left, 1e-3 * right, -1e-3, 1e-3, 0.5e-3 * (left + right), angle, 1e3
    )


@pytest.mark.parametrize(
    ("apart", "turn", "share"),
    [
        (1.9, 1.0, 1.0),
        (3.0, 1.0, 0.5),
        (4.1, 1.0, 0.0),
        (9.9, 0.1, 1.0),
        (15.0, 0.1, 0.5),
        (20.1, 0.1, 0.0),
        (9.0, 0.25, 0.5),
        (15.0, 0.25, 0.25),
        (9.0, 0.31, 0.0),
    ],
)
def test_rule_of_sharing(apart, turn, share):
    """Distance [mm], angle [rad]: the numbers of the docstring."""
    groups, coupled = gather(
        curve(lambda y: y**2),
        [lobe(0.0, 2.0, 0.0), lobe(2.0 + apart, 9.0 + apart, turn)],
    )
    assert len(groups) == (1 if share == 1.0 else 2)
    assert coupled.sum() == pytest.approx(0.0 if share == 1.0 else 2.0 * share)


def test_refusals_of_its_own():
    gap = curve(lambda y: y**2)
    with pytest.raises(
        NumericalError, match="has not converged; take fewer strips and cells"
    ) as caught:
        solved(gap, half_space_iterations=3.0)
    assert caught.value.row == 0
    with pytest.raises(ContactError, match="at least 8 strips and cells"):
        solved(gap, strips=7)
    with pytest.raises(ContactError, match="at least 8"):
        solved(gap, cells=7)
    for load in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ContactError, match="must be above 0 N and finite"):
            solved(gap, load)
    with pytest.raises(ContactError, match="does not touch"):
        solved(curve(lambda y: y**2 + np.nan))


def test_cells_of_the_models_are_those_of_the_grid():
    result = solved(curve(lambda y: y**2), strips=20, cells=33)
    assert result.patch.grid.pressure.shape == (1, 33, 20)


@pytest.fixture(scope="module")
def searched(s1002, rail_60e1):
    """Factory of exact gaps of S1002 on 60E1 1:40."""

    def gap(shift, yaw=0.0, curvature=0.0):
        shift, yaw = np.broadcast_arrays(np.atleast_1d(np.asarray(shift, float)), yaw)
        pose = WheelsetPose(shift, yaw.astype(float), np.zeros_like(shift))
        wheel, ground = (
            geometry.wheel_surface(s1002, 0.46),
            geometry.counterface_profile(rail_60e1),
        )
        return geometry.gap(
            wheel,
            ground,
            pose,
            half_span=0.75,
            nominal_radius=0.46,
            curvature=curvature,
        )

    return gap


def test_bare_curve_and_bodies_agree_without_yaw(searched):
    """Parabolas and the small-angle opening against the exact surface: 0.5 % of the
    pressure.
    """
    gap = searched([-4e-3, 0.0, 3e-3])
    exact, bare = solved(gap), solved(replace(gap, bodies=None))
    np.testing.assert_allclose(bare.max_pressure, exact.max_pressure, rtol=5e-3)
    np.testing.assert_allclose(
        bare.vertical_displacement - gap.gap.min(axis=1),
        exact.vertical_displacement - gap.gap.min(axis=1),
        rtol=2e-3,
    )


@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_the_sign_of_yaw_mirrors_the_patch(searched, curvature):
    """Grids may differ by a tenth of a cell, as the path to them does: 0.5 % of the
    load, cell by cell.
    """
    ahead, behind = (
        solved(searched(3e-3, 0.02, curvature)),
        solved(searched(3e-3, -0.02, curvature)),
    )
    one, other = ahead.patch.grid.pressure[0], behind.patch.grid.pressure[0, ::-1]
    assert np.abs(one - other).sum() < 5e-3 * one.sum()
    trail = (
        behind.patch.grid.x_lead - behind.patch.cells * behind.patch.grid.cell_length
    )
    np.testing.assert_allclose(ahead.patch.grid.x_lead, -trail, rtol=5e-3)
    skew = (ahead.patch.grid.pressure[0].sum(axis=1) * ahead.patch.grid.x[0]).sum()
    assert abs(skew) > 1e-6 * ahead.patch.grid.pressure[0].sum()  # 1 um: yaw does act
    assert ahead.max_pressure[0] == pytest.approx(behind.max_pressure[0], rel=1e-4)


STATES = 1e-3 * np.array([-7.0, -4.0, -1.2, 0.0, 1.0, 2.5, 3.0, 4.0, 5.0, 5.6, 6.2])


def test_rough_solutions(searched):
    """Some percent of force, some milliradians of the plane, 0.1 mm of the centre."""
    gap = searched(STATES, 5e-3)
    fine, rough = solved(gap, strips=30), solved(gap, strips=30, rough=True)
    lift = np.bincount(
        rough.patch.row, rough.normal_force * np.cos(rough.contact_angle)
    )
    np.testing.assert_allclose(lift, LOAD, rtol=1e-9)
    first, coarse = (
        np.searchsorted(one.patch.row, np.arange(STATES.size)) for one in (fine, rough)
    )
    np.testing.assert_allclose(
        rough.normal_force[coarse], fine.normal_force[first], rtol=0.03
    )
    np.testing.assert_allclose(
        rough.contact_angle[coarse], fine.contact_angle[first], rtol=0.0, atol=0.012
    )
    np.testing.assert_allclose(
        rough.vertical_displacement[coarse],
        fine.vertical_displacement[first],
        rtol=0.0,
        atol=2e-6,
    )


def test_rows_of_a_batch_have_the_bits_they_have_alone(searched):
    """Whatever else is solved: other rows only add strips and cells without load."""
    gap = searched(STATES, 5e-3)
    options = {
        "vertical": True,
        "effective_modulus": E_STAR,
        "resolution": resolution(20, cell=0.5e-3),
        "parameters": {},
    }
    whole = half_space.MODEL(
        gap, np.arange(STATES.size), np.full(STATES.size, LOAD), **options
    )
    assert len(set(whole.patch.strips.tolist())) > 3
    for row in (0, 3, 8):
        alone = half_space.MODEL(gap, np.array([row]), np.array([LOAD]), **options)
        here = np.flatnonzero(whole.patch.row == row)
        nx, ny = alone.patch.grid.pressure.shape[1:]
        np.testing.assert_array_equal(
            whole.patch.grid.pressure[here][:, :nx, :ny], alone.patch.grid.pressure
        )
        assert not whole.patch.grid.pressure[here][:, nx:].any()
        assert not whole.patch.grid.pressure[here][:, :, ny:].any()
        np.testing.assert_array_equal(whole.edge_y[here][:, : ny + 1], alone.edge_y)
        np.testing.assert_array_equal(whole.contact_angle[here], alone.contact_angle)
        np.testing.assert_array_equal(whole.patch.strips[here], alone.patch.strips)


@pytest.mark.parametrize(("curvature", "yaw"), [(0.0, 0.0), (1.0, 0.01)])
def test_continuous_when_the_wheel_moves_by_a_micrometre(searched, curvature, yaw):
    """From the field side over two lobes to the flange's root; 1.6 mm of the narrow
    lobe are five strips.
    """
    shift = 1e-3 * np.array(
        [-7.3, -4.1, -1.2, 0.0, 0.4, 2.7, 4.6, 4.9, 5.1, 5.4, 5.7, 5.9]
    )
    here, there = (
        solved(searched(s, yaw, curvature), strips=50) for s in (shift, shift + 1e-6)
    )
    assert here.patch.row.tolist() == there.patch.row.tolist()
    np.testing.assert_allclose(there.max_pressure, here.max_pressure, rtol=6e-3)
    np.testing.assert_allclose(there.normal_force, here.normal_force, rtol=1e-3)
    np.testing.assert_allclose(there.contact_angle, here.contact_angle, atol=5e-4)
    np.testing.assert_allclose(there.centre_y, here.centre_y, atol=2e-5)
    np.testing.assert_allclose(
        there.vertical_displacement, here.vertical_displacement, atol=1e-6
    )


def test_stripes_follow_the_profile(searched):
    """Strip edges rise, and the pressure-weighted centre is the origin of the
    strips.
    """
    result = solved(searched([-3e-3, 0.0, 3e-3, 6.5e-3], 0.01))
    assert all(np.all(np.diff(edges) > 0.0) for edges in result.edge_y)
    load = result.patch.grid.pressure.sum(axis=1)
    np.testing.assert_allclose(
        (load * result.patch.y).sum(axis=1) / load.sum(axis=1), 0.0, atol=1e-15
    )
    for one, other in pairwise(result.patch.row):
        assert one < other


@pytest.mark.parametrize("curvature", [0.0, 2.0])
@pytest.mark.parametrize("yaw", [0.0, -0.03, 0.1])
def test_every_state_has_an_answer(searched, curvature, yaw):
    """Tread, two lobes, flange root, climbing flange, yaw up to 100 mrad: none refused,
    all loads carried.
    """
    shift = 1e-3 * np.arange(-8.0, 8.1, 1.0)
    result = solved(searched(shift, yaw, curvature), strips=20)
    assert set(result.patch.row.tolist()) == set(range(shift.size))
    lift = np.bincount(
        result.patch.row, result.normal_force * np.cos(result.contact_angle)
    )
    np.testing.assert_allclose(lift, LOAD, rtol=1e-9)
    assert np.all(result.approach > 0.0)
    true = np.arange(result.patch.y.shape[1]) < result.patch.strips[:, None]
    np.testing.assert_array_equal(np.diff(result.edge_y, axis=1) > 0.0, true)
    assert result.max_pressure.max() < 1e10
