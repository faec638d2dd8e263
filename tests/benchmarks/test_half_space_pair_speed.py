"""Times of both half-space problems of one wheel together, printed beside their
targets.
"""

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import half_space as normal
from wearsim.contact.patch import Resolution
from wearsim.contact.problem import ContactModels
from wearsim.contact.tangential import half_space as tangential
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
LOAD, FRICTION = 80e3, np.array([0.35])
MODELS = ContactModels("half_space", "half_space")
# Shift [m] and yaw [rad]: tread, tread near full slip, field side, two lobes in one
# patch; their creepages.
STATES = np.array([[3e-3, 0.0], [3e-3, 10e-3], [-4e-3, 2e-3], [0.0, 0.0]])
CREEPAGES = np.array(
    [
        [-1.1e-3, 0.0, -0.193],
        [-9e-4, -0.01, -0.192],
        [1.2e-3, -2e-3, -0.024],
        [0.0, 0.0, -0.077],
    ]
)


@pytest.fixture(scope="module")
def gap():
    wheel, rail = (
        standard.wheel("S1002"),
        standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75),
    )
    shift, yaw = STATES.T.copy()
    rings, ground = (
        geometry.wheel_surface(wheel, 0.46),
        geometry.counterface_profile(rail),
    )
    pose = WheelsetPose(shift, yaw, 0.0 * shift)
    return geometry.gap(
        rings, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0
    )


def pressed(gap, row, resolution):
    return normal.MODEL(
        gap,
        np.array([row]),
        np.array([LOAD]),
        vertical=True,
        effective_modulus=MODELS.effective_modulus,
        resolution=resolution,
        parameters={},
    )


def rolled(patch, creepage):
    return tangential.MODEL(
        patch,
        creepage[None],
        FRICTION,
        shear_modulus=MODELS.shear_modulus,
        poisson_ratio=MODELS.poisson_ratio,
        fields=True,
    )


def times_of(gap, resolution, best, repeats):
    """Times of both problems, mean over the states [ms]."""
    times = []
    for row, creepage in enumerate(CREEPAGES):
        patch = pressed(gap, row, resolution).patch
        tasks = (
            lambda row=row: pressed(gap, row, resolution),
            lambda patch=patch, creepage=creepage: rolled(patch, creepage),
        )
        times.append([1e3 * best(task, repeats) for task in tasks])
    return np.mean(times, axis=0)


def test_both_problems_of_a_wheel(show, best, gap, cell_sizes):
    """Pressures and tractions without the gap; one wheel with free rotation and load
    balance: 6 ms.
    """
    show(
        "both half-space problems, S1002 on 60E1 1:40, four states; pressures + "
        "tractions"
    )
    cells, means = [], []
    fixed = ("30 x 30, at most 2.5 + 1.5 ms", Resolution(1.0, 30, 30, 120), 9)
    sizes = [
        (f"{1e3 * cell:4.2f} mm", Resolution(cell, 8, 8, 400), repeats)
        for cell, repeats in cell_sizes
    ]
    for name, resolution, repeats in (fixed, *sizes):
        pressures, tractions = times_of(gap, resolution, best, repeats)
        show(f"{name}: {pressures:.2f} + {tractions:.2f} ms")
        if resolution.most == 400:
            cells.append(pressed(gap, 0, resolution).patch.grid.pressure.size)
            means.append(pressures + tractions)
    exponent = np.polyfit(np.log(cells[1:]), np.log(means[1:]), 1)[0]
    show(f"time grows with the cells to the power {exponent:.2f}, at most 1.5")
