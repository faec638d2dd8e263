"""Cells by the size of the patch: orders of convergence, and peaks of wide and
two-lobed patches.
"""

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact.geometry import CounterfaceProfile, Gap, WheelsetPose
from wearsim.contact.normal import half_space as normal
from wearsim.contact.patch import Resolution
from wearsim.contact.problem import ContactModels
from wearsim.contact.tangential import half_space as tangential
from wearsim.profile import standard

LOAD, FRICTION, MODELS = 80e3, 0.35, ContactModels.of("fast")
CELLS = 1e-3 * np.array([2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25])


def on_rail(shift, yaw):
    """S1002 on 60E1 1:40."""
    pose = WheelsetPose(np.array([shift]), np.array([yaw]), np.zeros(1))
    wheel = geometry.wheel_surface(standard.wheel("S1002"), 0.46)
    ground = geometry.counterface_profile(
        standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    )
    return geometry.gap(
        wheel, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0
    )


def curve(height):
    """Wheel over a flat rail, as a bare curve."""
    y = np.linspace(-40e-3, 40e-3, 8001)
    zero = np.zeros_like(y)
    ground = CounterfaceProfile(y, zero, zero, zero)
    return Gap(
        ground, 0.0, height(y)[None], y[None], zero[None], 0.46 + zero[None], zero[None]
    )


GAPS = {
    "tread": lambda: on_rail(3e-3, 0.0),
    "two_lobes": lambda: on_rail(0.0, 0.0),
    "narrow_lobe": lambda: on_rail(5e-3, 5e-3),
    "conformal": lambda: curve(
        lambda y: 0.02 * y**2 + 600.0 * np.maximum(np.abs(y) - 13e-3, 0.0) ** 3
    ),
    "waves": lambda: curve(
        lambda y: 4e-6 * (1.0 - np.cos(2.0 * np.pi * y / 6e-3)) + 0.1 * y**2
    ),
}


def solved(gap, resolution):
    """Largest pressure, approach, area, and the creep forces as shares of friction x
    load.
    """
    contact = normal.MODEL(
        gap,
        np.array([0]),
        np.array([LOAD]),
        vertical=True,
        effective_modulus=MODELS.effective_modulus,
        resolution=resolution,
        parameters={},
    )
    rolling = tangential.MODEL(
        contact.patch,
        np.array([[-1e-3, 5e-4, -0.15]] * contact.patch.row.size),
        np.full(contact.patch.row.size, FRICTION),
        shear_modulus=MODELS.shear_modulus,
        poisson_ratio=MODELS.poisson_ratio,
        fields=False,
    )
    lift = (contact.normal_force * np.cos(contact.contact_angle)).sum()
    assert lift == pytest.approx(LOAD, rel=1e-9)
    force = rolling.force[:, :2].sum(axis=0) / (FRICTION * LOAD)
    return np.array(
        [
            contact.max_pressure.max(),
            contact.approach[0],
            contact.patch.area.sum(),
            *force,
        ]
    )


@pytest.mark.slow
def test_order_of_convergence():
    """Root mean square over five patches: maximum and approach of order 1.5 and more,
    the others 0.8.

    Areas and forces have the staircase of the border, pressures its place within the
    cells.
    """
    errors = []
    for gap in GAPS.values():
        exact = solved(gap(), Resolution(0.125e-3, 8, 8, 400))
        scale = np.append(exact[:3], [1.0, 1.0])
        errors.append(
            [
                (solved(gap(), Resolution(cell, 8, 8, 400)) - exact) / scale
                for cell in CELLS
            ]
        )
    error = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    order = [np.polyfit(np.log(CELLS), np.log(one), 1)[0] for one in error.T]
    assert min(order[:2]) > 1.5, order
    assert min(order[2:]) > 0.8, order
    assert np.all(error[CELLS == 0.5e-3][0] < [0.03, 5e-4, 0.025, 0.015, 5e-3]), error


@pytest.mark.parametrize("name", sorted(GAPS))
def test_peaks_at_the_default_resolution(name):
    """0.6 % of the largest pressure, patches up to 38 mm wide and lobes of 2 mm beside
    wide ones.
    """
    gap = GAPS[name]()
    exact = solved(gap, Resolution(0.25e-3, 60, 60, 400))[0]
    assert solved(gap, MODELS.resolution)[0] == pytest.approx(exact, rel=6e-3)


@pytest.mark.parametrize(
    ("cell", "most"), [(0.5e-3, 120), (0.3e-3, 120), (0.3e-3, 40), (5e-3, 120)]
)
def test_counts_follow_the_size(cell, most):
    """Cells no larger than asked for, no fewer and no more than allowed; 1.5 of them
    beside each edge.
    """
    for gap in GAPS.values():
        contact = normal.MODEL(
            gap(),
            np.array([0]),
            np.array([LOAD]),
            vertical=True,
            effective_modulus=MODELS.effective_modulus,
            resolution=Resolution(cell, 12, 10, most),
            parameters={},
        )
        patch = contact.patch
        for count, size, fewest, extent in (
            (patch.cells, patch.grid.cell_length, 10, patch.length),
            (patch.strips, patch.width, 12, patch.lateral_extent),
        ):
            assert np.all((count >= fewest) & (count <= most))
            assert np.all((size < 1.03 * cell) | (count == most))
            np.testing.assert_allclose(
                count * size - extent, 3.0 * size, rtol=0.0, atol=2.0 * size.max()
            )
