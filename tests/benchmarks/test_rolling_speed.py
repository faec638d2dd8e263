"""Times and iteration counts of steady rolling on the half-space, printed and never
asserted.
"""

import numpy as np
import pytest

from wearsim.contact.patch import PatchGrid, from_grid
from wearsim.contact.tangential import half_space
from wearsim.contact.tangential.half_space import steady_rolling

pytestmark = pytest.mark.benchmark

A, B, LOAD, FRICTION = 6.5e-3, 5e-3, 80e3, 0.35
CREEPAGES = np.array(
    [
        [-1e-4, 0.0, 0.0],
        [-1.7e-3, 0.0, -0.197],
        [2e-3, 0.0, 0.0],
        [0.0, 1e-3, 0.0],
        [0.0, 2e-3, -0.3],
        [-1e-3, 5e-3, -0.5],
        [5e-4, -1e-3, 0.8],
        [0.0, 0.0, -0.5],
        [1e-2, 1e-2, 1.0],
    ]
)


def patch_of(cell):
    nx, ny = (2 * int(np.ceil(half / cell)) for half in (A, B))
    dx, dy = 2.0 * A / nx, 2.0 * B / ny
    x, y = dx * (np.arange(nx) - 0.5 * (nx - 1)), dy * (np.arange(ny) - 0.5 * (ny - 1))
    pressure = np.sqrt(np.maximum(1.0 - (x[:, None] / A) ** 2 - (y / B) ** 2, 0.0))
    pressure *= LOAD / (pressure.sum() * dx * dy)
    grid = PatchGrid(np.array([A]), np.array([dx]), pressure[None])
    return from_grid(
        np.array([0]), y[None], np.array([dy]), grid, np.array([ny]), np.array([nx])
    )


def solved(patch, creepage):
    return half_space.solve(
        patch,
        creepage[None],
        np.array([FRICTION]),
        shear_modulus=210e9 / 2.6,
        poisson_ratio=0.3,
        fields=True,
    )


def test_rolling_over_the_cells(show, best, monkeypatch, cell_sizes):
    """Targets of both problems together: 20 ms at 0.5 mm, 1 s at 0.2 mm, exponent
    1.5.
    """
    counts = []
    solve = steady_rolling.solve

    def counted(*arguments, **more):
        rolling = solve(*arguments, **more)
        counts.append((rolling.steps, rolling.products))
        return rolling

    cells, means = [], []
    show(
        "steady rolling on the half-space, 13 mm x 10 mm, 9 creepages from linear to "
        "full slip"
    )
    for cell, repeats in cell_sizes:
        patch = patch_of(cell)
        counts.clear()
        with monkeypatch.context() as within:
            within.setattr(steady_rolling, "solve", counted)
            for creepage in CREEPAGES:
                solved(patch, creepage)
        times = [
            1e3 * best(lambda xi=xi: solved(patch, xi), repeats)  # noqa: B023
            for xi in CREEPAGES
        ]
        steps, products = np.array(counts).T
        cells.append(int((patch.grid.pressure > 0.0).sum()))
        means.append(np.mean(times))
        show(
            f"{1e3 * cell:4.2f} mm, {cells[-1]:5d} cells: {np.mean(times):6.1f} ms "
            f"(most {max(times):.1f}), {steps.mean():.1f} steps, "
            f"{products.mean():.0f} convolutions (most {products.max()})"
        )
    show(
        "time grows with the cells to the power "
        f"{np.polyfit(np.log(cells[1:]), np.log(means[1:]), 1)[0]:.2f}"
    )
