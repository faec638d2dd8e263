"""Exact results of simplified theory: printed values, limits and the integrals they
stand for.
"""

import numpy as np
import pytest
from closed_forms import (
    fastsim_elliptic_force,
    fastsim_elliptic_slip_border,
    fastsim_strip_work,
    kalker_linear,
    reduced_creepage,
)
from scipy.integrate import quad

A, B, LOAD, FRICTION, G, POISSON = 6e-3, 4e-3, 80e3, 0.35, 80.77e9, 0.3


@pytest.mark.parametrize(
    ("eps", "printed"),
    [(0.25, "0.30575"), (0.5, "0.54982"), (1.0, "0.81831"), (1.5, "0.91949")],
)
def test_printed_values_with_the_elliptic_bound(eps, printed):
    """Specification 4.3, to the printed digit."""
    assert f"{fastsim_elliptic_force(eps):.5f}" == printed


@pytest.mark.parametrize("eps", [0.01, 0.4, 1.0, 7.0])
def test_elliptic_force_is_the_integral_of_a_cut_back_traction(eps):
    """One strip of half length 1: eps (1 - x) up to the bound sqrt(1 - x^2);
    quadrature, 1e-9.
    """
    border = float(fastsim_elliptic_slip_border(eps))
    assert eps * (1.0 - border) == pytest.approx(np.sqrt(1.0 - border**2), rel=1e-9)
    sticks, _ = quad(lambda x: eps * (1.0 - x), border, 1.0, epsrel=1e-12)
    slips, _ = quad(lambda x: np.sqrt(1.0 - x**2), -1.0, border, epsrel=1e-12)
    assert (sticks + slips) / (0.5 * np.pi) == pytest.approx(
        fastsim_elliptic_force(eps), rel=1e-9
    )


def test_small_creepage_is_linear_theory_with_the_elliptic_bound():
    """The slope is that of Kalker; what is left is of higher order in the creepage."""
    creepage = np.array([1e-6, 1e-7])
    eps = reduced_creepage(creepage, A, B, FRICTION, LOAD, G, POISSON)
    linear = -kalker_linear([[xi, 0.0, 0.0] for xi in creepage], A, B, G, POISSON)[:, 0]
    left = np.abs(fastsim_elliptic_force(eps) * FRICTION * LOAD / linear - 1.0)
    assert left[1] < 0.11 * left[0] + 1e-12
    assert left[0] < 1e-3


def test_large_creepage_saturates():
    eps = np.array([10.0, 100.0, 1e3])
    left = 1.0 - fastsim_elliptic_force(eps)
    np.testing.assert_allclose(
        left, 4.0 / (3.0 * np.pi) * eps**-3.0, rtol=2e-2
    )  # the next term: eps^-5
    np.testing.assert_array_equal(
        fastsim_elliptic_slip_border(np.array([0.0, 1.0])), [-1.0, 0.0]
    )


def test_strip_work_adds_up_to_the_work_per_metre():
    y = np.linspace(-B, B, 2001)
    work = fastsim_strip_work(y, B, -9e3, 2e-3)
    assert np.trapezoid(work, y) == pytest.approx(18.0, rel=1e-6)
    assert work[[0, -1]].tolist() == [0.0, 0.0]
    assert fastsim_strip_work(1.1 * B, B, -9e3, 2e-3) == 0.0
