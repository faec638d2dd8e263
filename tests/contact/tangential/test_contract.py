"""What every tangential model of the registry must give, on ellipses of strips and on
patches of cells.
"""

from dataclasses import fields, replace

import numpy as np
import pytest
from closed_forms import frictional_power, kalker_linear

from wearsim.contact.patch import Patch, PatchGrid, from_grid, on_grid
from wearsim.contact.tangential import TANGENTIAL_MODELS

SHEAR_MODULUS, POISSON, LOAD, CELLS, STRIPS = 80.77e9, 0.3, 80e3, 20, 16
SHAPES = [(6.5e-3, 5e-3), (3e-3, 6e-3), (5e-3, 2e-3), (4e-3, 4e-3)]
CREEPAGE = np.array(
    [[-1.6e-3, 0.0, -0.2], [2e-3, -1e-3, 0.4], [2e-3, 4e-3, -0.6], [5e-5, 5e-5, 0.01]]
)
FRICTION = np.array([0.35, 0.2, 0.4, 0.3])

pytestmark = pytest.mark.parametrize("name", sorted(TANGENTIAL_MODELS))


def join(patches):
    """One batch of strip patches."""
    names = [f.name for f in fields(Patch) if f.name not in ("row", "grid", "planes")]
    arrays = {key: np.concatenate([getattr(p, key) for p in patches]) for key in names}
    return Patch(row=np.arange(len(patches)), **arrays)


@pytest.fixture(scope="module")
def strips(ellipse):
    return join(
        [ellipse(a, b, LOAD, STRIPS, offset=0.1, cells=CELLS) for a, b in SHAPES]
    )


@pytest.fixture(scope="module")
def batch(strips, request):
    """The same patches with their pressure cell by cell."""
    return from_grid(
        strips.row, strips.y, strips.width, on_grid(strips), strips.strips, strips.cells
    )


@pytest.fixture(scope="module", params=["strips", "grid"])
def patch(request, strips, batch):
    return strips if request.param == "strips" else batch


def part(patch, rows):
    """Some patches of a batch."""
    names = [f.name for f in fields(Patch) if f.name not in ("grid", "planes")]
    grid = patch.grid
    if grid is not None:
        grid = PatchGrid(grid.x_lead[rows], grid.cell_length[rows], grid.pressure[rows])
    return Patch(grid=grid, **{key: getattr(patch, key)[rows] for key in names})


def solved(
    name,
    patch,
    creepage=CREEPAGE,
    friction=FRICTION,
    wanted=True,
    modulus=SHEAR_MODULUS,
):
    return TANGENTIAL_MODELS[name](
        patch,
        creepage,
        friction,
        shear_modulus=modulus,
        poisson_ratio=POISSON,
        fields=wanted,
    )


def normal_force(patch):
    half = 0.5 * (patch.x_lead - patch.x_trail)
    return 0.5 * np.pi * (patch.pressure_slope * half**2).sum(axis=1) * patch.width


def test_arrays_fit_together_and_are_finite(name, patch):
    result = solved(name, patch)
    count = len(SHAPES)
    assert result.force.shape == (count, 3)
    assert result.slip_area.shape == (count,)
    assert result.x_lead.shape == result.cell_length.shape == (count, STRIPS)
    assert result.cells.shape == (5, count, CELLS, STRIPS)
    for array in (
        result.force,
        result.slip_area,
        result.x_lead,
        result.cell_length,
        result.cells,
    ):
        assert np.isfinite(array).all()
    assert np.all(result.cell_length >= 0.0)
    assert solved(name, patch, wanted=False).cells is None


def test_pressure_of_the_cells_carries_the_load(name, patch):
    """On the strips or cells as they are: 1e-9."""
    result = solved(name, patch)
    area = result.cell_length * patch.width[:, None]
    np.testing.assert_allclose(
        (result.cells[0] * area[:, None, :]).sum(axis=(1, 2)), LOAD, rtol=1e-9
    )


def test_resultants_are_the_sums_of_the_tractions(name, patch):
    """Rounding: 1e-9 of friction x load."""
    result = solved(name, patch)
    length = result.cell_length
    x = result.x_lead[:, None] - length[:, None] * (np.arange(CELLS)[:, None] + 0.5)
    area = (length * patch.width[:, None])[:, None]
    _, shear_x, shear_y = result.cells[:3]
    moment = x * shear_y - patch.y[:, None] * shear_x
    sums = np.stack(
        [(part * area).sum(axis=(1, 2)) for part in (shear_x, shear_y, moment)], axis=1
    )
    np.testing.assert_allclose(result.force, sums, atol=1e-9 * 0.5 * LOAD)


def test_traction_within_friction_against_slip(name, patch):
    result = solved(name, patch)
    pressure, shear_x, shear_y, slip_x, slip_y = result.cells
    bound = FRICTION[:, None, None] * pressure
    assert np.all(np.hypot(shear_x, shear_y) <= bound * (1.0 + 1e-9))
    assert np.all(
        shear_x * slip_x + shear_y * slip_y <= 1e-9 * bound * np.hypot(slip_x, slip_y)
    )
    assert np.all(frictional_power(result.force, CREEPAGE, 20.0) > 0.0)
    assert np.all(
        (result.slip_area >= 0.0) & (result.slip_area <= patch.area * (1.0 + 1e-9))
    )


def test_what_cells_dissipate_is_near_the_power_of_the_resultants(name, patch):
    """Within a quarter where a tenth slips or more; the models' own tests say more."""
    result = solved(name, patch)
    _, shear_x, shear_y, slip_x, slip_y = result.cells
    area = result.cell_length * patch.width[:, None]
    local = -((shear_x * slip_x + shear_y * slip_y) * area[:, None]).sum(axis=(1, 2))
    ratio = local / frictional_power(result.force, CREEPAGE, 1.0)
    slides = result.slip_area > 0.1 * patch.area
    assert np.count_nonzero(slides) >= 3
    assert np.all(abs(ratio[slides] - 1.0) < 0.25)


def test_no_creepage_no_force(name, patch):
    result = solved(name, patch, 0.0 * CREEPAGE)
    assert not result.force.any()
    assert not result.slip_area.any()
    assert not result.cells[1:].any()


def test_no_friction_no_force(name, patch):
    result = solved(name, patch, friction=0.0 * FRICTION)
    assert not result.force.any()
    assert np.isfinite(result.cells).all()


def test_resultants_alone_are_the_same(name, patch):
    np.testing.assert_array_equal(
        solved(name, patch, wanted=False).force, solved(name, patch).force
    )


def test_a_patch_alone_is_the_patch_of_a_batch(name, patch):
    whole = solved(name, patch)
    for m in range(len(SHAPES)):
        rows = slice(m, m + 1)
        alone = solved(name, part(patch, rows), CREEPAGE[rows], FRICTION[rows])
        np.testing.assert_array_equal(alone.force, whole.force[rows])
        np.testing.assert_array_equal(alone.slip_area, whole.slip_area[rows])
        np.testing.assert_array_equal(alone.cells, whole.cells[:, rows])


def test_reversed_creepage_reverses_the_forces(name, patch):
    """Two forms of one problem; iterations stop at their tolerance."""
    forward, backward = solved(name, patch).force, solved(name, patch, -CREEPAGE).force
    np.testing.assert_allclose(backward, -forward, rtol=1e-6, atol=1e-7 * 0.5 * LOAD)


def test_a_mirrored_patch_mirrors_lateral_force_and_moment(name, patch):
    mirrored = replace(
        patch,
        y=-patch.y[:, ::-1],
        x_lead=patch.x_lead[:, ::-1],
        x_trail=patch.x_trail[:, ::-1],
        pressure_slope=patch.pressure_slope[:, ::-1],
        grid=None
        if patch.grid is None
        else replace(patch.grid, pressure=patch.grid.pressure[:, :, ::-1]),
    )
    sign = np.array([1.0, -1.0, -1.0])
    there, back = (
        solved(name, patch).force,
        solved(name, mirrored, sign * CREEPAGE).force,
    )
    np.testing.assert_allclose(back, sign * there, rtol=1e-6, atol=1e-7 * 0.5 * LOAD)


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_forces_grow_from_linear_to_what_friction_carries(name, patch, direction):
    """Kalker's law below: 10 %, as 20 cells reach too far; friction x load above: 1e-3
    of elastic slip.
    """
    direction = np.array(direction)
    size = np.geomspace(1e-6, 0.1, 18)
    most = FRICTION * normal_force(patch)
    force = np.array(
        [
            -solved(name, patch, np.tile(s * direction, (4, 1))).force @ direction
            for s in size
        ]
    )
    assert np.all(np.diff(force, axis=0) > -1e-6 * most)
    np.testing.assert_allclose(force[-1], most, rtol=1e-3)
    a, b = np.array(SHAPES).T
    linear = (
        -kalker_linear(
            np.tile(size[0] * direction, (4, 1)), a, b, SHEAR_MODULUS, POISSON
        )
        @ direction
    )
    np.testing.assert_allclose(force[0], linear, rtol=0.10)


def test_spin_alone_pushes_across_as_kalker_has_it(name, patch):
    """Fy = -G (ab)^1.5 C23 spin: 12 %, as 20 cells reach too far."""
    creepage = np.tile([0.0, 0.0, 1e-3], (4, 1))
    a, b = np.array(SHAPES).T
    linear = kalker_linear(creepage, a, b, SHEAR_MODULUS, POISSON)[:, 1]
    np.testing.assert_allclose(
        solved(name, patch, creepage).force[:, 1], linear, rtol=0.12
    )


def test_a_softer_tangential_problem_has_the_forces_of_less_creepage(name, patch):
    """Elastic displacements 1/k times as large: with k times the creepage the forces
    are those of the stiff problem, its slip is k times as large. Iterations stop at
    their tolerance. The Kalker factor relies on this.
    """
    k = 0.4
    soft = solved(name, patch, modulus=k * SHEAR_MODULUS)
    stiff = solved(name, patch, creepage=k * CREEPAGE)
    most = FRICTION[:, None] * normal_force(patch)[:, None]
    np.testing.assert_allclose(soft.force, stiff.force, atol=1e-6 * most.min())
    scale = np.abs(CREEPAGE).max()
    np.testing.assert_allclose(
        soft.cells[3:], stiff.cells[3:] / k, rtol=1e-4, atol=1e-4 * scale
    )
