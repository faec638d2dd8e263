"""Rows of cells of the half-space pair as strips: each has the rigid slip of its own
place on the wheel.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import wheels as wheels_module
from wearsim.contact.patch import on_grid
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve
from wearsim.contact.tangential import TANGENTIAL_MODELS, StripMotion

MODELS = ContactModels("half_space", "half_space", strips=16, cells=14, cell_size=1.0)
MODULUS, POISSON, FRICTION = 80e9, 0.28, 0.35
RADIUS, SPEED = 0.46, 20.0


@pytest.fixture
def seen(monkeypatch):
    """Motions of strips that `half_space` was given, and its patches."""
    motions = []
    model = TANGENTIAL_MODELS["half_space"]

    def watching(patch, *arguments, **options):
        motions.append((patch, options.get("strips")))
        return model.solve(patch, *arguments, **options)

    monkeypatch.setitem(TANGENTIAL_MODELS, "half_space", replace(model, solve=watching))
    return motions


def rolled(patch, creepage, friction, strips=None):
    """By the tangential model alone."""
    given = {"shear_modulus": MODULUS, "poisson_ratio": POISSON, "fields": True}
    return TANGENTIAL_MODELS["half_space"](
        patch, creepage, friction, strips=strips, **given
    )


def of_rows(creepage):
    """Motion of the rows of one patch (N, 3)."""
    one = creepage[None]
    return StripMotion(
        np.zeros(1, dtype=np.int64), one, np.full(one.shape[:2], FRICTION)
    )


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize("angle", [-0.05, 0.6])
def test_rows_along_a_cone_have_the_tractions_of_the_whole_patch(ellipse, kappa, angle):
    """Creepage by the radius at each place against that about the centre: 1e-9; rows
    add up to 1e-12.
    """
    patch = ellipse(6e-3, 4e-3, 80e3, 16, cells=14)
    patch = replace(patch, grid=on_grid(patch))
    down = patch.y[0] * np.sin(angle)
    spin = np.sin(angle) * (1.0 / RADIUS + kappa)
    places = np.empty((16, 3))
    places[:, 0] = 1.0 - kappa * (0.8e-3 + down) - (0.4608 + down) / RADIUS
    places[:, 1:] = 3e-4, spin
    centre = np.array([1.0 - kappa * 0.8e-3 - 0.4608 / RADIUS, 3e-4, spin])
    plane = rolled(patch, centre[None], np.full(1, FRICTION))
    rows = rolled(patch, centre[None], np.full(1, FRICTION), of_rows(places))
    scale = FRICTION * 80e3
    np.testing.assert_allclose(rows.force, plane.force, atol=1e-9 * scale)
    np.testing.assert_allclose(
        rows.cells[1:3], plane.cells[1:3], atol=1e-9 * plane.cells[0].max()
    )
    assert plane.strip_force is None
    of_row = rows.strip_force[0]
    np.testing.assert_allclose(
        of_row[:, :2].sum(axis=0), rows.force[0, :2], atol=1e-12 * scale
    )
    moment = (of_row[:, 2] - patch.y[0] * of_row[:, 0]).sum()
    assert moment == pytest.approx(rows.force[0, 2], abs=1e-12 * scale)


def test_friction_is_that_of_each_row(ellipse):
    """In full slip each row carries its coefficient times its load; turned a little by
    what neighbours do.
    """
    patch = ellipse(6e-3, 4e-3, 80e3, 16, cells=14)
    patch = replace(patch, grid=on_grid(patch))
    motion = of_rows(np.tile([0.05, 0.0, 0.0], (16, 1)))
    friction = np.linspace(0.1, 0.4, 16)[None]
    found = rolled(
        patch,
        np.array([[0.05, 0.0, 0.0]]),
        np.full(1, 0.25),
        motion._replace(friction=friction),
    )
    grid = patch.grid
    load = grid.pressure[0].sum(axis=0) * grid.cell_length[0] * patch.width[0]
    np.testing.assert_allclose(
        found.strip_force[0, :, 0], -friction[0] * load, rtol=1e-4
    )


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_slip_of_rows_is_that_of_the_wheels_own_radius(
    seen, wheelset, counterface, points, kappa
):
    """1 - kappa z - r/r0 at each row, whose mean is off a plane by 4e-4; spin is that
    of the patch's plane.

    Profiles are joined by lines, 0.25 um.
    """
    solution = solve(
        points(shift=1e-3), wheelset, counterface(kappa), MODELS, sides=(0,)
    )
    patch, motion = seen[-1]
    y, loaded = patch.planes.y, patch.planes.width > 0.0
    face = counterface(kappa).profile
    radius = RADIUS + np.interp(y - 1e-3, wheelset.right.y, wheelset.right.z)
    expected = 1.0 - kappa * np.interp(y, face.y, face.z) - radius / RADIUS
    slip = motion.creepage
    np.testing.assert_allclose(
        slip[:, :, 0][loaded], expected[loaded], atol=0.25e-6 * (1.0 / RADIUS + kappa)
    )
    np.testing.assert_allclose(slip[:, :, 1][loaded], 0.0, atol=1e-15)
    spin = np.sin(solution.contact_angle[0]) * (1.0 / RADIUS + kappa)
    np.testing.assert_allclose(slip[:, :, 2][loaded], spin, rtol=1e-9)
    along_a_plane = solution.creepage_x[0] - spin * patch.y
    assert np.abs(slip[:, :, 0] - along_a_plane)[loaded].max() > 1.5e-4


def test_given_creepages_are_those_of_one_plane(
    monkeypatch, wheelset, counterface, points
):
    """With and without rows, on rails: 1e-9. On a roller yawed rows have levers of
    their own.
    """
    given = points(shift=np.array([-2e-3, 3e-3]), yaw=4e-3)
    given = replace(
        given, creepage=np.array([[-1.7e-3, 3e-4, 0.2], [1e-3, -2e-3, -0.4]])
    )
    rows = solve(given, wheelset, counterface(), MODELS)
    model = TANGENTIAL_MODELS["half_space"]
    monkeypatch.setitem(
        TANGENTIAL_MODELS, "half_space", replace(model, by_strips=False)
    )
    plane = solve(given, wheelset, counterface(), MODELS)
    assert plane.patch.planes is None
    assert rows.patch.planes is not None
    for name in (
        "normal_force",
        "force_x",
        "force_y",
        "spin_moment",
        "power",
        "track_lateral",
        "creepage_x",
    ):
        ours, theirs = getattr(rows, name), getattr(plane, name)
        np.testing.assert_allclose(
            ours, theirs, atol=1e-9 * np.abs(theirs).max(), err_msg=name
        )


def test_rows_carry_the_loads_of_their_cells(wheelset, counterface, points):
    """In the patch's plane and order; rough solutions have no rows."""
    solution = solve(
        points(shift=np.array([0.0, 5e-3])), wheelset, counterface(), MODELS, sides=(0,)
    )
    patch, planes = solution.patch, solution.patch.planes
    load = (
        patch.grid.pressure.sum(axis=1)
        * patch.grid.cell_length[:, None]
        * patch.width[:, None]
    )
    np.testing.assert_allclose(planes.normal_force, load, atol=1e-9 * load.max())
    loaded = planes.width > 0.0
    np.testing.assert_allclose(planes.offset[loaded], patch.y[loaded], atol=1e-9)
    np.testing.assert_allclose(
        planes.angle[loaded],
        np.repeat(solution.contact_angle[:, None], loaded.shape[1], axis=1)[loaded],
    )


def test_stretched_patches_keep_grid_and_rows_together(
    monkeypatch, wheelset, counterface, points
):
    found = []
    forces_of = wheels_module.forces_of
    monkeypatch.setattr(
        "wearsim.contact.axle.forces_of",
        lambda task, wheels, *rest, **options: (
            found.append(wheels) or forces_of(task, wheels, *rest, **options)
        ),
    )
    solve(points(shift=3e-3), wheelset, counterface(), MODELS, sides=(0,))
    near = found[-1]
    load = np.ones((1, 2))
    load.ravel()[near.place] = 1.2 * near.load
    far = wheels_module.stretched(near, load)
    patch, planes = far.normal.patch, far.normal.patch.planes
    cells = (
        patch.grid.pressure.sum(axis=1)
        * patch.grid.cell_length[:, None]
        * patch.width[:, None]
    )
    np.testing.assert_allclose(planes.normal_force, cells, atol=1e-9 * cells.max())
    loaded = planes.width > 0.0
    np.testing.assert_allclose(planes.offset[loaded], patch.y[loaded], atol=1e-9)
    speed = np.full(1, -SPEED / RADIUS)
    old, new = (one.kinematics.creepage(speed) for one in (near, far))
    moved = (patch.y - near.normal.patch.y) * old[:, :, 2]
    np.testing.assert_allclose(
        new[:, :, 0][loaded], (old[:, :, 0] - moved)[loaded], atol=1e-12
    )


@pytest.mark.parametrize("normal", ["hertz", "kik_piotrowski", "coupled_strips"])
def test_patches_without_rows_of_cells_lie_in_one_plane(
    seen, wheelset, counterface, points, normal
):
    models = replace(MODELS, normal=normal)
    solution = solve(points(shift=2e-3), wheelset, counterface(), models, sides=(0,))
    assert solution.patch.planes is None
    assert {strips for _, strips in seen} == {None}


def test_coupled_strips_take_the_rows_of_the_half_space(wheelset, counterface, points):
    """Forces of the same pressures and rigid slip within 2 % of friction times load."""
    conditions, models = (
        points(shift=np.array([0.0, 3e-3])),
        replace(MODELS, strips=24, cells=24),
    )
    cells, strips = (
        solve(
            conditions,
            wheelset,
            counterface(),
            replace(models, tangential=name),
            sides=(0,),
        )
        for name in ("half_space", "coupled_strips")
    )
    assert strips.patch.planes is not None
    for name in ("force_x", "force_y"):
        difference = getattr(cells, name) - getattr(strips, name)
        assert np.abs(difference).max() < 0.02 * 0.35 * 80e3


def test_a_left_wheel_mirrors_the_right_one(wheelset, counterface, points):
    """Both sides of the mirrored point; to the tolerance of the balance."""
    conditions = points(shift=np.array([1e-3, -1e-3]), yaw=np.array([3e-3, -3e-3]))
    solution = solve(conditions, wheelset, counterface(1.0), MODELS)
    here, there = (
        np.flatnonzero((solution.point == point) & (solution.side == side))
        for point, side in ((0, 0), (1, 1))
    )
    for name in ("power", "force_x", "creepage_x", "track_vertical"):
        value = getattr(solution, name)
        np.testing.assert_allclose(value[there], value[here], rtol=1e-6, err_msg=name)
    for name in ("force_y", "spin", "track_lateral"):
        value = getattr(solution, name)
        np.testing.assert_allclose(value[there], -value[here], rtol=1e-6, err_msg=name)


@pytest.fixture
def on_a_wide_tread(wheelset, counterface, points):
    """Work of all strips [J/m], and its largest per area [J/m2], of pairs on S1002 at 0
    and 1 mm.
    """

    def of(kappa):
        conditions = points(shift=np.array([0.0, 1e-3]))
        found = []
        for pair in ("standard", "accurate"):
            models = ContactModels.of(pair, most_cells=30)
            solution = solve(
                conditions, wheelset, counterface(kappa), models, sides=(0,)
            )
            strips, width = solution.fields.strip_work, solution.patch.width[:, None]
            whole = [
                (strips * width)[solution.point == point].sum() for point in (0, 1)
            ]
            largest = [strips[solution.point == point].max() for point in (0, 1)]
            found.append(np.array([whole, largest]))
        return found

    return of


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_both_models_do_the_same_work_on_a_wide_tread(on_a_wide_tread, kappa):
    """2 %, where slip is by spin; 24 % of a point with one creepage and spin about the
    centre.
    """
    standard, accurate = on_a_wide_tread(kappa)
    np.testing.assert_allclose(standard[0], accurate[0], rtol=0.02)


@pytest.mark.xfail(
    strict=True,
    reason="measured 9.8 and 7.7 %, target 5 %: work over pressure is a line",
)
@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_both_models_wear_a_wide_tread_alike(on_a_wide_tread, kappa):
    """Where it is largest; 42 and 36 % with one creepage and spin about the centre."""
    standard, accurate = on_a_wide_tread(kappa)
    np.testing.assert_allclose(standard[1], accurate[1], rtol=0.05)
