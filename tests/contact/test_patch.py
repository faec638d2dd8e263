"""The two forms of a patch, strips and grid, and the change from one to the other."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.patch import PatchGrid, Resolution, from_grid, on_grid


def test_a_grid_carries_the_load_and_moment_of_the_strips(ellipse):
    patch = ellipse(6e-3, 3e-3, 80e3, 15, offset=0.3, cells=40)
    grid = on_grid(patch)
    force = grid.pressure.sum(axis=1) * grid.cell_length[:, None] * patch.width[:, None]
    assert force.sum() == pytest.approx(80e3, rel=1e-12)
    half = 0.5 * (patch.x_lead - patch.x_trail)
    each = 0.5 * np.pi * patch.pressure_slope * half**2 * patch.width[:, None]
    np.testing.assert_allclose(force, each, rtol=1e-12)
    middle = (grid.pressure * grid.x[:, :, None]).sum(axis=1) / grid.pressure.sum(
        axis=1
    )
    np.testing.assert_allclose(
        middle, 0.3 * patch.y, atol=2e-5
    )  # staircase of 0.3 mm cells
    assert np.all(grid.pressure >= 0.0)


def test_strips_of_a_grid_have_its_load_exactly_and_its_ends_to_second_order(ellipse):
    """Ends of the strips found again from cells of two sizes; the staircase alone would
    be of first order.
    """
    patch = ellipse(6e-3, 3e-3, 80e3, 15, offset=0.3)
    errors = []
    for cells in (20, 40, 80):
        grid = on_grid(replace(patch, cells=np.array([cells])))
        result = from_grid(
            patch.row, patch.y, patch.width, grid, patch.strips, patch.cells
        )
        half = 0.5 * (result.x_lead - result.x_trail)
        load = (0.5 * np.pi * result.pressure_slope * half**2).sum() * patch.width[0]
        assert load == pytest.approx(80e3, rel=1e-12)
        errors.append(np.abs(result.x_lead - patch.x_lead).max())
        assert result.grid is grid
        assert on_grid(result) is grid
    orders = -np.diff(np.log2(errors))
    assert np.all(orders > 1.7), (errors, orders)


def test_rows_of_cells_without_pressure_have_no_length():
    pressure = np.zeros((1, 8, 5))
    pressure[0, 2:6, 1:3] = 1e9
    pressure[0, 3, 2] = 0.0  # a hole
    grid = PatchGrid(np.array([4e-3]), np.array([1e-3]), pressure)
    patch = from_grid(
        np.array([0]),
        np.arange(-2.0, 3.0)[None] * 1e-3,
        np.array([1e-3]),
        grid,
        np.array([5]),
        np.array([8]),
    )
    assert np.all((patch.x_lead > patch.x_trail) == [[False, True, True, False, False]])
    assert np.all(np.isfinite(patch.pressure_slope))
    assert patch.area == pytest.approx(7e-6)
    assert patch.length == pytest.approx(4e-3)
    assert patch.lateral_extent == pytest.approx(2e-3)
    # four equal cells of 1 mm: variance 16/12 mm2
    assert patch.x_lead[0, 1] == pytest.approx(2.0 * np.sqrt(16.0 / 12.0) * 1e-3)


def test_counts_follow_the_size_between_fewest_and_most():
    """A multiple of the cell is not one more by rounding; each cell is at most as large
    as asked for.
    """
    resolution = Resolution(cell=0.5e-3, strips=30, cells=20, most=60)
    size = np.array([1e-3, 15e-3, 15.1e-3, 0.1 * 3 * 0.1, 31e-3])
    assert resolution.strips_across(size).tolist() == [30, 30, 31, 60, 60]
    assert resolution.cells_along(size).tolist() == [20, 30, 31, 60, 60]
    assert Resolution(1.0, 12, 12, 5).strips_across(size).tolist() == [12] * 5
