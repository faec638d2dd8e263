"""Times and iterations of both half-space problems of one wheel together, printed beside their targets."""

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import half_space as normal
from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset, solve
from wearsim.contact.tangential import half_space as tangential
from wearsim.contact.tangential.half_space import steady_rolling
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
LOAD, FRICTION = 80e3, 0.35
MODELS = ContactModels("half_space", "half_space")
# Shift [m] and yaw [rad]: tread, tread near full slip, field side, two lobes in one patch.
STATES = np.array([[3e-3, 0.0], [3e-3, 10e-3], [-4e-3, 2e-3], [0.0, 0.0]])
STEP = np.array([1e-4, 2e-4])  # to the neighbouring state


@pytest.fixture(scope="module")
def contacts():
    """Gap of the states and of their neighbours, creepages and size of the patch of each."""
    wheel, rail = standard.wheel("S1002"), standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    shift, yaw = np.concatenate((STATES, STATES + STEP)).T
    one = np.ones(shift.size)
    pose = WheelsetPose(shift, yaw, 0.0 * one)
    rings, ground = geometry.wheel_surface(wheel, 0.46), geometry.counterface_profile(rail)
    gap = geometry.gap(rings, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0)
    result = solve(
        ContactConditions(
            shift, yaw, 0.0 * one, LOAD * one, 20.0 * one, FRICTION * one, 0.0 * one, "nominal"
        ),
        Wheelset(wheel, wheel, 0.46, 0.75),
        Counterface(rail, 0.0),
        MODELS,
        sides=(0,),
    )
    assert result.point.tolist() == list(range(shift.size))  # one patch each
    creepage = np.stack([result.creepage_x, result.creepage_y, result.spin], axis=1)
    return gap, creepage, result.length, result.width


def both(contacts, row, cell, start=(None, None)):
    """Pressures, then tractions: of one wheel, as `solve` has them, from nothing or from a neighbour's."""
    gap, creepage, length, width = contacts
    state = row % len(STATES)
    strips, cells = (int(np.ceil(size[state] / cell)) + 3 for size in (width, length))
    pressure = normal.solve_wheel(
        gap,
        row,
        LOAD,
        vertical=True,
        effective_modulus=MODELS.effective_modulus,
        strips=strips,
        parameters={"cells": float(cells)},
        start=start[0],
    )
    patch = normal._assembled(gap, np.array([row]), [pressure], True).patch
    rolling = tangential.solve(
        patch,
        creepage[row : row + 1],
        np.array([FRICTION]),
        shear_modulus=MODELS.shear_modulus,
        poisson_ratio=MODELS.poisson_ratio,
        cells=cells,
        fields=True,
        start=start[1],
    )
    return pressure, rolling, strips * cells


def test_both_problems_of_a_wheel(show, best, contacts, monkeypatch, cell_sizes):
    """All but the gap: at 0.5 mm 20 ms, 8 ms from a neighbouring state, at 0.2 mm 1 s."""
    products = []
    roll = steady_rolling.solve

    def counted(*arguments, **more):
        rolling = roll(*arguments, **more)
        products.append(rolling.products)
        return rolling

    target = {0.5e-3: (" at most 20 ms", " at most 8 ms"), 0.2e-3: (" at most 1000 ms", "")}
    sizes, means = [], []
    show("both half-space problems, S1002 on 60E1 1:40, four states; warm: from 0.1 mm and 0.2 mrad away")
    for cell, repeats in cell_sizes:
        rows = range(len(STATES))
        near = [both(contacts, row + len(STATES), cell) for row in rows]
        times, counts = [], []
        for starts in ([(None, None)] * len(STATES), [(pressure, rolling) for pressure, rolling, _ in near]):
            products.clear()
            with monkeypatch.context() as within:
                within.setattr(steady_rolling, "solve", counted)
                result = [both(contacts, row, cell, start) for row, start in zip(rows, starts, strict=True)]
            counts.append((np.mean([sum(state.iterations) for state, _, _ in result]), np.mean(products)))
            times.append(
                [
                    1e3 * best(lambda row=row, start=start: both(contacts, row, cell, start), repeats)  # noqa: B023
                    for row, start in zip(rows, starts, strict=True)
                ]
            )
        sizes.append(np.mean([cells for _, _, cells in near]))
        means.append(np.mean(times[0]))
        message = [
            f"{name} {np.mean(part):.1f} ms (most {max(part):.1f}){aim}, {iterations:.0f} iterations of "
            f"pressures, {convolutions:.0f} convolutions of tractions"
            for name, part, aim, (iterations, convolutions) in zip(
                ("cold", "warm"), times, target.get(cell, ("", "")), counts, strict=True
            )
        ]
        show(f"{1e3 * cell:4.2f} mm, {sizes[-1]:6.0f} cells: {'; '.join(message)}")
    exponent = np.polyfit(np.log(sizes[1:]), np.log(means[1:]), 1)[0]
    show(f"time grows with the cells to the power {exponent:.2f}, at most 1.5")
