"""Times and iterations of the half-space's normal problem, printed beside their
targets, never asserted.
"""

from functools import partial

import numpy as np
import pytest
from closed_forms import hertz

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import half_space
from wearsim.contact.normal.half_space.pressure import HeightGrid, solve_pressure
from wearsim.contact.patch import Resolution
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
E_STAR, LOAD = 210e9 / (2.0 * (1.0 - 0.3**2)), 80e3


def test_pressure_on_an_ellipse(show, best):
    """Load given, non-periodic, from nothing, influence included; exponents of
    iterations and time.
    """
    along, across = 0.5 / 0.46, 0.5 / 0.3
    ellipse = hertz(along, across, LOAD, E_STAR)
    a, b = float(ellipse.semi_axis_x), float(ellipse.semi_axis_y)
    sizes, times, counts = [], [], []
    target = {(32, 64): "at most 2 ms", (64, 128): "at most 15 ms"}
    for nx, ny in ((16, 32), (32, 64), (64, 128), (128, 256)):
        length, width = 2.0 * a / (nx - 3), 2.0 * b / (ny - 3)
        x, y = (
            (np.arange(nx) - 0.5 * (nx - 1)) * length,
            (np.arange(ny) - 0.5 * (ny - 1)) * width,
        )
        grid = HeightGrid(along * x[:, None] ** 2 + across * y**2, length, width)
        result = solve_pressure([grid], LOAD, E_STAR)
        sizes.append(nx * ny)
        times.append(best(lambda grid=grid: solve_pressure([grid], LOAD, E_STAR), 9))
        counts.append(result.iterations)
        off = result.pressure[0].max() / float(ellipse.max_pressure) - 1.0
        show(
            f"normal problem {nx} x {ny}: {1e3 * times[-1]:.1f} ms "
            f"{target.get((nx, ny), '')}, {result.iterations} iterations, maximum "
            f"pressure {1e2 * off:+.3f} %"
        )
    for name, values in (("iterations", counts), ("time", times)):
        exponent = np.polyfit(np.log(sizes), np.log(values), 1)[0]
        show(f"exponent of {name} in the number of cells: {exponent:.2f}")


def test_wheel_on_rail(show, best):
    """Search, planes and pressures of S1002 on 60E1, in full and rough."""
    shift, yaw = 1e-3 * np.array(
        [[3.0, 3.0, -4.0, 0.0, 1.0, 6.0], [0.0, 10.0, 2.0, 0.0, 0.0, 10.0]]
    )
    rings = geometry.wheel_surface(standard.wheel("S1002"), 0.46)
    ground = geometry.counterface_profile(
        standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    )
    pose = WheelsetPose(shift, yaw, 0.0 * shift)
    gap = geometry.gap(
        rings, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0
    )
    targets = {"30 x 30": " (at most 2.5)"}
    for name, resolution in (
        ("30 x 30", Resolution(1.0, 30, 30, 120)),
        ("0.5 mm, 30 at least", Resolution(0.5e-3, 30, 30, 120)),
        ("0.2 mm", Resolution(0.2e-3, 8, 8, 240)),
    ):
        options = {
            "vertical": True,
            "effective_modulus": E_STAR,
            "resolution": resolution,
            "parameters": {},
        }
        times, counts = [], []
        for row in range(shift.size):
            tasks = [
                partial(half_space.solve_wheel, gap, row, LOAD, rough=rough, **options)
                for rough in (False, True)
            ]
            times.append([best(task, 9) for task in tasks])
            counts.append([sum(task().iterations) for task in tasks])
        in_full, roughly = 1e3 * np.mean(times, axis=0)
        show(
            f"wheel on rail, {name}: {in_full:.2f} ms{targets.get(name, '')}, rough "
            f"{roughly:.2f} ms; iterations {np.mean(counts, axis=0).round(1).tolist()}"
        )
