"""Hertz: identities, limits, printed values, refusals."""

import numpy as np
import pytest
from closed_forms import hertz, line_hertz
from scipy.integrate import dblquad
from scipy.special import ellipe, ellipk, ellipkm1

from wearsim.contact.normal.hertz import axis_ratio

E_STAR = 210e9 / (2.0 * (1.0 - 0.3**2))
RATIOS = 10.0 ** np.linspace(-8.0, 8.0, 161)

# Specification 4.1: A/B, a/b, A a^2 / approach, B b^2 / approach as printed.
TABLE = """
0.1  4.4994 0.6694 0.3306
0.25 2.5007 0.6099 0.3901
0.5  1.5858 0.5570 0.4430
1    1.0000 0.5000 0.5000
2    0.6306 0.4430 0.5570
4    0.3999 0.3901 0.6099
10   0.2222 0.3306 0.6694
"""


@pytest.mark.parametrize(
    "row", TABLE.strip().split("\n"), ids=lambda row: f"A/B {row.split()[0]}"
)
def test_printed_table(row):
    """To the printed digit."""
    ratio, *printed = row.split()
    ellipse = hertz(float(ratio), 1.0, 1.0, 1.0)
    a, b, approach = ellipse.semi_axis_x, ellipse.semi_axis_y, ellipse.approach
    result = (a / b, float(ratio) * a**2 / approach, b**2 / approach)
    assert [f"{value:.4f}" for value in result] == printed


def test_curvature_ratio_comes_back():
    """A/B from the axes by the textbook's integrals, which lose digits near the circle:
    1e-12 beside it.
    """
    ratio = RATIOS[np.abs(np.log10(RATIOS)) > 0.05]
    minor = np.minimum(axis_ratio(ratio), 1.0 / axis_ratio(ratio))
    first, second = ellipkm1(minor**2), ellipe(1.0 - minor**2)
    back = (second / minor**2 - first) / (first - second)
    np.testing.assert_allclose(back, np.maximum(ratio, 1.0 / ratio), rtol=1e-12)


def test_near_the_circle():
    """a/b = (A/B)^(-2/3) to first order: at A = B (1 + h) the difference is h^2."""
    h = np.array([0.0, 1e-16, 1e-12, 1e-9, 1e-7, 1e-5, -1e-12, -1e-7, -1e-5])
    difference = np.log(axis_ratio(1.0 + h)) + np.log1p(h) / 1.5
    assert np.all(np.abs(difference) < 1e-15 + h**2)


def test_approach_is_the_sum_of_both_gaps_at_the_edge():
    """A a^2 + B b^2 = approach; rounding."""
    ellipse = hertz(RATIOS, 1.0, 1e3, E_STAR)
    gaps = RATIOS * ellipse.semi_axis_x**2 + ellipse.semi_axis_y**2
    np.testing.assert_allclose(gaps, ellipse.approach, rtol=1e-13)


def test_exchange_of_the_axes():
    one, other = hertz(RATIOS, 3.0, 80e3, E_STAR), hertz(3.0, RATIOS, 80e3, E_STAR)
    np.testing.assert_allclose(one.semi_axis_x, other.semi_axis_y, rtol=1e-13)
    np.testing.assert_allclose(one.max_pressure, other.max_pressure, rtol=1e-13)


def test_pressure_carries_the_force():
    """Mean pressure is two thirds of the greatest; and the field itself by quadrature,
    1e-7.
    """
    ellipse = hertz(RATIOS, 2.0, 80e3, E_STAR)
    np.testing.assert_allclose(
        2.0 / 3.0 * ellipse.max_pressure * ellipse.area, 80e3, rtol=1e-13
    )
    one = hertz(1.1, 2.0, 80e3, E_STAR)
    a, b = one.semi_axis_x, one.semi_axis_y
    total, _ = dblquad(
        lambda rho, turn: (
            rho * a * b * one.pressure(a * rho * np.cos(turn), b * rho * np.sin(turn))
        ),
        0.0,
        2.0 * np.pi,
        0.0,
        1.0,
        epsrel=1e-9,
    )
    assert total == pytest.approx(80e3, rel=1e-7)
    assert one.pressure(1.01 * a, 0.0) == 0.0
    assert one.pressure(0.8 * a, 0.6 * b) == pytest.approx(
        0.0, abs=1e-7 * one.max_pressure
    )


def test_displacement_of_the_surface_fits_the_gap():
    """The pressure's own displacement at points of the ellipse is the approach less the
    gap: 1e-6.

    Independent of the formulas: Boussinesq's integral in polar coordinates around the
    point, where the pressure along a chord is the root of a quadratic whose integral is
    pi/8 of its discriminant.
    """
    along, across = 0.9, 2.3
    ellipse = hertz(along, across, 80e3, E_STAR)
    a, b, p0 = ellipse.semi_axis_x, ellipse.semi_axis_y, ellipse.max_pressure
    turn = (np.arange(4000) + 0.5) * np.pi / 4000
    for x, y in ((0.0, 0.0), (0.4 * a, 0.0), (0.0, -0.7 * b), (0.5 * a, 0.6 * b)):
        q2 = (np.cos(turn) / a) ** 2 + (np.sin(turn) / b) ** 2
        q1 = x * np.cos(turn) / a**2 + y * np.sin(turn) / b**2
        q0 = 1.0 - (x / a) ** 2 - (y / b) ** 2
        chord = 0.5 * np.pi * (q0 + q1**2 / q2) / np.sqrt(q2)
        displacement = p0 * chord.mean() / E_STAR
        expected = ellipse.approach - along * x**2 - across * y**2
        assert displacement == pytest.approx(expected, rel=1e-6)


def test_printed_case_of_a_half_space_program():
    """A = 0.8 1/m, b = 2a, 106.7 kN, G = 82 GPa, nu = 0.28: four printed digits; its
    grid is 0.06 % off.
    """
    minor = 0.5
    first, second = ellipk(1.0 - minor**2), ellipe(1.0 - minor**2)
    across = 0.8 * (first - second) / (second / minor**2 - first)
    ellipse = hertz(0.8, across, 106.7e3, 82e9 / (1.0 - 0.28))
    assert f"{1e3 * ellipse.semi_axis_x:.3f}" == "6.304"
    assert f"{1e3 * ellipse.semi_axis_y:.3f}" == "12.607"
    assert f"{1e3 * ellipse.approach:.5f}" == "0.07652"
    assert f"{1e-6 * ellipse.max_pressure:.1f}" == "641.1"


def test_ball_on_a_plane():
    """a^3 = 3 N R / (4 E*), approach a^2/R; rounding."""
    radius, force = 0.3, 5e3
    ball = hertz(0.5 / radius, 0.5 / radius, force, E_STAR)
    a = np.cbrt(0.75 * force * radius / E_STAR)
    for value in (ball.semi_axis_x, ball.semi_axis_y, np.sqrt(ball.approach * radius)):
        assert value == pytest.approx(a, rel=1e-14)


def test_long_ellipses_become_lines():
    """With the local force per width 3 N / (4 b) in the middle; the difference falls
    with (a/b)^2 ln(b/a).
    """
    across = np.array([1e-4, 1e-6, 1e-8])
    ellipse = hertz(1.0, across, 1e3, E_STAR)
    line = line_hertz(1.0, 0.75 * 1e3 / ellipse.semi_axis_y, E_STAR)
    short = ellipse.semi_axis_x / ellipse.semi_axis_y
    error = np.abs(line.half_length / ellipse.semi_axis_x - 1.0)
    assert np.all(error < short**2 * np.log(4.0 / short))
    np.testing.assert_allclose(
        line.max_pressure / ellipse.max_pressure, 1.0, atol=2.0 * error.max()
    )


def test_line_contact_carries_its_load():
    line = line_hertz(np.array([1.1, 3.0]), 5e6, E_STAR)
    x = np.cos(
        np.pi * (np.arange(400) + 0.5) / 400
    )  # Chebyshev nodes: exact for the semi-ellipse
    weight = np.pi / 400 * np.sqrt(1.0 - x**2)
    total = (line.pressure(x[:, None] * line.half_length) * weight[:, None]).sum(
        axis=0
    ) * line.half_length
    np.testing.assert_allclose(total, 5e6, rtol=1e-12)
    # Contact of cylinders: p0 = E* a A, from the slope of the gap.
    np.testing.assert_allclose(
        line.max_pressure, E_STAR * line.half_length * [1.1, 3.0], rtol=1e-14
    )
    assert line.pressure(1.0).tolist() == [0.0, 0.0]


def test_rows_do_not_depend_on_their_neighbours():
    together = hertz(RATIOS, 1.0, 1e3, E_STAR)
    alone = [hertz(ratio, 1.0, 1e3, E_STAR).semi_axis_x for ratio in RATIOS]
    np.testing.assert_allclose(together.semi_axis_x, alone, rtol=1e-15)
    assert hertz(np.ones((2, 1)), np.ones(3), 1.0, E_STAR).area.shape == (2, 3)
    assert hertz(np.ones(0), 1.0, 1.0, E_STAR).area.shape == (0,)
