"""Kernels of the virtual penetration model against integrals and circles."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from wearsim.contact.normal.kik_piotrowski.strips import (
    displacement_integral,
    strip_half_length_squared,
)


@pytest.mark.parametrize("half", [0.1e-3, 3e-3, 25e-3])
@pytest.mark.parametrize("distance", [2e-5, 3e-4, 5e-3, 4e-2])
def test_displacement_integral_is_the_elliptic_integral(half, distance):
    """Two forms of one integral; K - E itself loses digits where the strip is short."""
    total = half**2 + distance**2
    exact = (
        2.0 * np.sqrt(total) * (ellipkm1(distance**2 / total) - ellipe(half**2 / total))
    )
    lost = 1e-15 * total / half**2
    assert displacement_integral(half**2, distance**2) == pytest.approx(
        exact, rel=1e-12 + lost
    )


def test_displacement_integral_against_quadrature():
    half, distance = 5e-3, 2e-3
    # x = a sin(t) takes the root at the ends away.
    value, _ = quad(
        lambda t: (half * np.cos(t)) ** 2 / np.hypot(half * np.sin(t), distance),
        -np.pi / 2,
        np.pi / 2,
        epsrel=1e-13,
    )
    assert displacement_integral(half**2, distance**2) == pytest.approx(
        value, rel=1e-12
    )


def test_displacement_integral_of_nothing_is_zero():
    assert displacement_integral(0.0, 1e-6) == 0.0


@pytest.mark.parametrize("radius", [0.46, 0.3, 1.2])
@pytest.mark.parametrize("roller", [0.5, 1.0, 10.0])
@pytest.mark.parametrize("depth", [1e-8, 5e-5, 1e-3, 2e-2])
def test_strip_ends_lie_on_both_circles(radius, roller, depth):
    """Equations (4)-(6) of the seed with the corrected sign: sagittas of wheel and
    roller add up to g.
    """
    x = np.sqrt(strip_half_length_squared(depth, radius, 1.0 / roller))
    wheel = x**2 / (radius + np.sqrt(radius**2 - x**2))
    ground = x**2 / (roller + np.sqrt(roller**2 - x**2))
    assert wheel + ground == pytest.approx(depth, rel=1e-12)


@pytest.mark.parametrize("radius", [0.46, 1.2])
def test_strip_ends_on_a_rail_lie_on_the_wheel(radius):
    x = np.sqrt(strip_half_length_squared(1e-4, radius, 0.0))
    assert x**2 / (radius + np.sqrt(radius**2 - x**2)) == pytest.approx(1e-4, rel=1e-12)


@pytest.mark.parametrize("roller", [0.5, 1.0])
def test_strip_ends_of_shallow_strips(roller):
    """x^2 = 2 R g / (1 + R/S) in the limit; the difference falls with first order in
    the depth.
    """
    radius, depth = 0.46, np.array([1e-5, 1e-6, 1e-7])
    limit = 2.0 * radius * depth / (1.0 + radius / roller)
    error = [
        abs(strip_half_length_squared(g, radius, 1.0 / roller) / e - 1.0)
        for g, e in zip(depth, limit, strict=True)
    ]
    assert error[0] < 1e-4
    assert np.polyfit(np.log(depth), np.log(error), 1)[0] == pytest.approx(
        1.0, abs=0.02
    )
