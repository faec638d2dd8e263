"""Carter, linear theory and full slip, against integrals and limits of each other."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from closed_forms import (
    carter,
    frictional_power,
    full_slip,
    full_slip_spin_moment,
    hertz,
    kalker_linear,
    line_hertz,
)
from scipy.integrate import dblquad

G, POISSON = 80e9, 0.3
E_STAR = G / (1.0 - POISSON)
DATA = Path(__file__).parents[2] / "data"

# Carter


@pytest.fixture(scope="module")
def line():
    return line_hertz(1.1, 8e6, E_STAR)


@pytest.fixture(scope="module")
def rolling(line):
    """Factory: creepage in units of that of saturation."""
    saturation = 2.0 * 0.3 * line.max_pressure / E_STAR
    return lambda share: carter(
        share * saturation, line.half_length, line.max_pressure, 0.3, E_STAR
    )


def chebyshev(function, low, high, nodes=4000):
    """Integral of a function with square-root ends."""
    turn = np.pi * (np.arange(nodes) + 0.5) / nodes
    x = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(turn)
    return (function(x) * np.sin(turn)).sum() * np.pi / nodes * 0.5 * (high - low)


@pytest.mark.parametrize("share", [-0.9, 0.1, 0.5, 1.0, 3.0])
def test_carter_force_is_the_integral_of_the_traction(rolling, line, share):
    """The kink at the end of the stick zone costs the quadrature 1e-5."""
    contact = rolling(share)
    a = line.half_length
    force = chebyshev(contact.traction, -a, a)
    assert force == pytest.approx(contact.force_per_width, rel=1e-5)
    assert abs(contact.force_per_width) <= 0.3 * 8e6 * (1.0 + 1e-12)
    assert np.sign(contact.force_per_width) == -np.sign(share)
    assert contact.stick_half_length == pytest.approx(
        a * max(1.0 - abs(share), 0.0), rel=1e-12
    )


@pytest.mark.parametrize("share", [0.1, -0.5, 0.9, 2.0])
def test_carter_traction_gives_the_slip(rolling, line, share):
    """Slip is the creepage less the strain of the traction, by a principal-value
    integral of it: 1e-3.

    Zero in the stick zone, against the traction behind it.
    """
    contact, a = rolling(share), line.half_length
    n = 200_000
    edge = np.linspace(-a, a, n + 1)
    middle = 0.5 * (edge[1:] + edge[:-1])
    traction = contact.traction(middle)
    for x in a * np.array([-0.95, -0.7, -0.3, 0.05, 0.35, 0.85]):
        index = int(np.searchsorted(edge, x))
        x = edge[index]  # between two middles: the principal value is the plain sum
        strain = -2.0 / (np.pi * E_STAR) * (traction / (x - middle)).sum() * 2.0 * a / n
        slip = contact.creepage - strain
        assert slip == pytest.approx(
            contact.slip(x), abs=1e-3 * abs(contact.saturation)
        )
        sticks = x > a - 2.0 * contact.stick_half_length
        assert (contact.slip(x) == 0.0) == sticks
        assert contact.slip(x) * contact.traction(x) <= 0.0
        limit = 0.3 * line.pressure(x)
        assert abs(contact.traction(x)) <= limit * (1.0 + 1e-12)
        assert sticks or abs(contact.traction(x)) == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("share", [0.2, -0.7, 1.0, 4.0])
def test_carter_local_power_is_that_of_the_resultant(rolling, line, share):
    """Steady rolling: slip times traction adds up to force times creepage; quadrature,
    1e-5.
    """
    contact, a = rolling(share), line.half_length
    end = a - 2.0 * contact.stick_half_length
    local = chebyshev(lambda x: contact.traction(x) * contact.slip(x), -a, end)
    assert local == pytest.approx(contact.force_per_width * contact.creepage, rel=1e-5)


def test_carter_is_the_limit_of_linear_theory():
    """Strips of a wide ellipse under small creepage: C11 = pi^2/(4 (1 - nu)).

    At a/b = 0.1 Kalker's table is 2 % above the limit.
    """
    ellipse = hertz(1.0, 1e-3, 80e3, E_STAR)
    a, b = ellipse.semi_axis_x, ellipse.semi_axis_y
    y = b * np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    share = np.sqrt(1.0 - (y / b) ** 2)
    strips = carter(1e-9, a * share, ellipse.max_pressure * share, 0.3, E_STAR)
    force = (strips.force_per_width * share).sum() * np.pi / 200 * b
    assert force == pytest.approx(
        -(np.pi**2) / (4.0 * (1.0 - POISSON)) * G * a * b * 1e-9, rel=1e-4
    )
    kalker = kalker_linear([[1e-9, 0.0, 0.0]], 0.1 * b, b, G, POISSON)[0, 0]
    assert kalker == pytest.approx(force * 0.1 * b / a, rel=0.025)


# Kalker's linear theory


def test_linear_theory_against_half_space():
    """CONTACT without slip, extrapolated: the table's three digits and the
    extrapolation, 4 %.
    """
    table = pd.read_csv(DATA / "contact_linear_coefficients.csv", comment="#")
    c = 6e-3
    a, b = (
        c * np.sqrt(table["a_over_b"].to_numpy()),
        c / np.sqrt(table["a_over_b"].to_numpy()),
    )

    def force(column, value):
        creepage = np.zeros((len(table), 3))
        creepage[:, column] = value
        return kalker_linear(creepage, a, b, G, POISSON) / -value

    longitudinal, lateral, spin = force(0, 1e-6), force(1, -2e-6), force(2, 1e-3)
    for result, name, power in (
        (longitudinal[:, 0], "C11", 2),
        (lateral[:, 1], "C22", 2),
        (spin[:, 1], "C23", 3),
        (lateral[:, 2], "C32", 3),
        (spin[:, 2], "C33", 4),
    ):
        np.testing.assert_allclose(
            result / (G * c**power), table[name], rtol=0.04, err_msg=name
        )
    np.testing.assert_array_equal(longitudinal[:, 1:], 0.0)
    np.testing.assert_array_equal(np.hstack((lateral[:, :1], spin[:, :1])), 0.0)


def test_linear_theory_takes_power():
    """No creepage gives power back: C22 C33 > -C23 C32, here with all three at once."""
    rng = np.random.default_rng(3)
    creepage = rng.normal(size=(200, 3)) * [1e-4, 1e-4, 2e-2]
    a = 5e-3 * np.exp(rng.normal(size=200))
    force = kalker_linear(creepage, a, 5e-3, G, POISSON)
    assert np.all(frictional_power(force, creepage, 20.0) > 0.0)


# Full slip


def test_full_slip_is_friction_against_the_creepage():
    creepage = np.array([[3e-3, -4e-3], [-0.1, 0.0]])
    force = full_slip(creepage, 0.3, np.array([50e3, 80e3]))
    np.testing.assert_allclose(force, [[-9e3, 12e3], [24e3, 0.0]], rtol=1e-14)
    np.testing.assert_allclose(
        frictional_power(force, creepage, 20.0),
        [20.0 * 15e3 * 5e-3, 20.0 * 24e3 * 0.1],
        rtol=1e-14,
    )


@pytest.mark.parametrize(
    ("a", "b"), [(5e-3, 5e-3), (2e-3, 9e-3), (9e-3, 2e-3), (1e-3, 50e-3)]
)
def test_moment_of_sliding_spin(a, b):
    """Friction times pressure times distance by quadrature, 1e-7; on a circle 3 pi mu N
    a/16.
    """
    force, friction = 60e3, 0.3
    exact, _ = dblquad(
        lambda rho, turn: (
            rho
            * a
            * b
            * np.sqrt(1.0 - rho**2)
            * np.hypot(a * rho * np.cos(turn), b * rho * np.sin(turn))
        ),
        0.0,
        0.5 * np.pi,
        0.0,
        1.0,
        epsabs=0.0,
        epsrel=1e-9,
    )
    exact *= 4.0 * friction * 1.5 * force / (np.pi * a * b)
    for spin in (0.5, -70.0):
        moment = full_slip_spin_moment(spin, a, b, friction, force)
        assert moment == pytest.approx(-np.sign(spin) * exact, rel=1e-7)
    if a == b:
        assert exact == pytest.approx(
            3.0 * np.pi * friction * force * a / 16.0, rel=1e-9
        )
