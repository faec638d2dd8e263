"""Times and iterations of the half-space's normal problem, printed beside their targets, never asserted."""

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import half_space
from wearsim.contact.normal.half_space.pressure import HeightGrid, solve_pressure
from wearsim.contact.reference.hertzian import hertz
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
E_STAR, LOAD = 210e9 / (2.0 * (1.0 - 0.3**2)), 80e3


def test_pressure_on_an_ellipse(show, best):
    """Load given, non-periodic, from nothing, influence included; exponents of iterations and time."""
    along, across = 0.5 / 0.46, 0.5 / 0.3
    ellipse = hertz(along, across, LOAD, E_STAR)
    a, b = float(ellipse.semi_axis_x), float(ellipse.semi_axis_y)
    sizes, times, counts = [], [], []
    target = {(32, 64): "at most 7 ms", (64, 128): "at most 30 ms"}
    for nx, ny in ((16, 32), (32, 64), (64, 128), (128, 256)):
        length, width = 2.0 * a / (nx - 3), 2.0 * b / (ny - 3)
        x, y = (np.arange(nx) - 0.5 * (nx - 1)) * length, (np.arange(ny) - 0.5 * (ny - 1)) * width
        grid = HeightGrid(along * x[:, None] ** 2 + across * y**2, length, width)
        result = solve_pressure([grid], LOAD, E_STAR)
        sizes.append(nx * ny)
        times.append(best(lambda grid=grid: solve_pressure([grid], LOAD, E_STAR), 9))
        counts.append(result.iterations)
        off = result.pressure[0].max() / float(ellipse.max_pressure) - 1.0
        show(
            f"normal problem {nx} x {ny}: {1e3 * times[-1]:.1f} ms {target.get((nx, ny), '')}, "
            f"{result.iterations} iterations, maximum pressure {1e2 * off:+.3f} %"
        )
    for name, values in (("iterations", counts), ("time", times)):
        exponent = np.polyfit(np.log(sizes), np.log(values), 1)[0]
        show(f"exponent of {name} in the number of cells: {exponent:.2f}")


def test_wheel_on_rail(show, best):
    """Search, planes and pressures of S1002 on 60E1 at cells of 0.5, 0.2 mm and 50 x 50; cold and warm."""
    shift = 1e-3 * np.array([3.0, 3.1])
    rings = geometry.wheel_surface(standard.wheel("S1002"), 0.46)
    ground = geometry.counterface_profile(standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75))
    pose = WheelsetPose(shift, 0.0 * shift, 0.0 * shift)
    gap = geometry.gap(rings, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0)
    for name, strips, cells in (("0.5 mm", 20, 32), ("0.2 mm", 44, 76), ("50 x 50", 50, 50)):
        arguments = {
            "vertical": True,
            "effective_modulus": E_STAR,
            "strips": strips,
            "parameters": {"cells": float(cells)},
        }
        before = half_space.solve_wheel(gap, 0, LOAD, **arguments)
        cold = half_space.solve_wheel(gap, 1, LOAD, **arguments)
        warm = half_space.solve_wheel(gap, 1, LOAD, start=before, **arguments)
        times = [
            best(lambda a=arguments: half_space.solve_wheel(gap, 1, LOAD, **a), 9),
            best(lambda a=arguments, b=before: half_space.solve_wheel(gap, 1, LOAD, start=b, **a), 9),
        ]
        counts = ["+".join(map(str, state.iterations)) for state in (cold, warm)]
        show(
            f"wheel on rail, {name}: {1e3 * times[0]:.1f} ms ({counts[0]} iterations), "
            f"from the state 0.1 mm away {1e3 * times[1]:.1f} ms ({counts[1]})"
        )
