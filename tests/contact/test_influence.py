"""Influence of rectangular cells: closed forms, quadrature, symmetries, and the
convolution.
"""

import numpy as np
import pytest
from closed_forms import hertz

from wearsim.contact.influence import (
    cell_integrals,
    field_of,
    normal_influence,
    spectrum,
    tangential_influence,
    wave_table,
    wave_weights,
    waves_of,
)

E_STAR, G, NU = 115e9, 80e9, 0.28


@pytest.mark.parametrize(
    ("length", "width"), [(1e-3, 1e-3), (2e-4, 1e-3), (5e-4, 1e-5)]
)
def test_uniform_pressure_on_a_rectangle(length, width):
    """Love: at the middle 4/(pi E*) (a arsinh(b/a) + b arsinh(a/b)) with half sides;
    half at a corner.
    """

    def middle(a, b):
        return 4.0 / (np.pi * E_STAR) * (a * np.arcsinh(b / a) + b * np.arcsinh(a / b))

    own = normal_influence(length, width, (1, 1), E_STAR)[0, 0]
    assert own == pytest.approx(middle(0.5 * length, 0.5 * width), rel=1e-14)
    # Cells of a grid add up to the whole rectangle; its middle is a corner of four
    # cells of half the size.
    grid = normal_influence(length, width, (9, 7), E_STAR)
    whole = grid[np.abs(np.arange(-8, 9))[:, None], np.abs(np.arange(-6, 7))].sum()
    assert whole == pytest.approx(middle(8.5 * length, 6.5 * width), rel=1e-12)


def integral(weight, x, y, length, width):
    """Gauss quadrature over a cell centred on the origin, seen from (x, y) outside of
    it.
    """
    node, share = np.polynomial.legendre.leggauss(40)
    u, v = x - 0.5 * length * node[:, None], y - 0.5 * width * node
    return 0.25 * length * width * share @ weight(u, v, np.hypot(u, v)) @ share


@pytest.mark.parametrize(("back", "beside"), [(3, 0), (0, 1), (2, 1), (1, 2)])
def test_tangential_influence_against_quadrature(back, beside):
    """Cerruti's kernels over a cell; x index from the leading end, so that a higher one
    lies behind.
    """
    length, width = 3e-4, 5e-4
    ours = tangential_influence(length, width, (4, 4), G, NU)[:, back, beside]
    x, y = -back * length, beside * width
    weights = (
        lambda u, v, r: (1.0 - NU) / r + NU * u * u / r**3,
        lambda u, v, r: (1.0 - NU) / r + NU * v * v / r**3,
        lambda u, v, r: NU * u * v / r**3,
    )
    expected = [
        integral(weight, x, y, length, width) / (np.pi * G) for weight in weights
    ]
    np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1e-9 * expected[0])


def test_tangential_influence_without_lateral_contraction_is_the_normal_one():
    """Poisson's ratio 0: 1/(pi G) over the distance in both directions, and nothing
    mixed.
    """
    along, across, mixed = tangential_influence(2e-4, 3e-4, (5, 6), G, 0.0)
    normal = normal_influence(2e-4, 3e-4, (5, 6), G)
    np.testing.assert_allclose(along, normal, rtol=1e-12)
    np.testing.assert_allclose(across, normal, rtol=1e-12)
    assert np.all(mixed == 0.0)


def test_no_digits_are_lost_beside_the_axes():
    """Far along the axis: a point load with the second moments of the cell."""
    length, width, cells = 1e-4, 1e-4, 400
    along, _, _ = tangential_influence(length, width, (cells, 2), G, 0.0)
    distance = (cells - 1) * length
    series = (
        length
        * width
        / (np.pi * G * distance)
        * (1.0 + (2.0 * length**2 - width**2) / (24.0 * distance**2))
    )
    # Each of four corners of about x ln(x) cancels to a cell's share: 1e-16 times cells
    # squared.
    np.testing.assert_allclose(along[-1, 0], series, rtol=1e-9)


def directly(table, field, odd):
    """Double sum over all pairs of cells."""
    apart = [
        np.subtract.outer(np.arange(count), np.arange(count)) for count in field.shape
    ]
    signs = [
        np.sign(step) if turns else np.ones_like(step)
        for step, turns in zip(apart, odd, strict=True)
    ]
    whole = table[np.abs(apart[0])[:, :, None, None], np.abs(apart[1])]
    return np.einsum("ikjm,ik,jm,km->ij", whole, *signs, field)


def convolved(table, field, odd=(False, False)):
    """The same by waves: an odd influence makes sines of cosines and cosines, turned,
    of sines.
    """
    tables = [wave_table(count) for count in field.shape]
    waves = waves_of(field, *tables)
    for axis, turns in enumerate(odd):
        if turns:
            sines, cosines = np.take(waves, 1, axis), np.take(waves, 0, axis)
            waves = np.stack((-sines, cosines), axis)
    out = np.empty_like(field)
    field_of(waves * spectrum(table, odd=odd), *tables, out)
    return out


@pytest.mark.parametrize("shape", [(1, 1), (5, 7), (8, 6), (2, 11)])
@pytest.mark.parametrize(
    "odd", [(False, False), (True, False), (False, True), (True, True)]
)
def test_convolution_is_the_sum_over_all_cells(shape, odd):
    field = np.random.default_rng(1).random(shape)
    table = cell_integrals(1e-4, 3e-4, shape)[2 if all(odd) else 0]
    size = np.abs(table).max() * field.sum()
    table = np.where(
        np.outer(
            *(
                np.arange(n) + (0 if turns else 1)
                for n, turns in zip(shape, odd, strict=True)
            )
        ),
        table,
        0.0,
    )
    actual, expected = convolved(table, field, odd), directly(table, field, odd)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-14 * size)


def test_waves_come_back_with_their_weights():
    """Discrete orthogonality: weights over the period make the transforms each other's
    inverse.
    """
    field = np.random.default_rng(2).random((7, 4))
    along, across = wave_table(7), wave_table(4)
    waves = waves_of(field, along, across) * (
        wave_weights(7)[:, None] * wave_weights(4)
    )
    back = np.empty_like(field)
    field_of(waves, along, across, back)
    np.testing.assert_allclose(back, field, rtol=1e-13)


@pytest.mark.parametrize(("along", "across"), [(1.0, 1.0), (0.4, 3.0)])
def test_pressure_of_hertz_presses_the_parabola(along, across):
    """Inside the ellipse u = approach - A x^2 - B y^2; the staircase at its border
    costs order 1.5.
    """
    ellipse = hertz(along, across, 80e3, E_STAR)
    a, b = float(ellipse.semi_axis_x), float(ellipse.semi_axis_y)
    counts, errors = np.array([17, 33, 65, 129]), []
    for n in counts:
        length, width = 2.0 * a / n, 2.0 * b / n
        x, y = ((np.arange(n) - 0.5 * (n - 1)) * size for size in (length, width))
        pressure = ellipse.pressure(x[:, None], y)
        ours = convolved(normal_influence(length, width, (n, n), E_STAR), pressure)
        expected = float(ellipse.approach) - along * x[:, None] ** 2 - across * y**2
        inside = (x[:, None] / a) ** 2 + (y / b) ** 2 < 0.8
        errors.append(np.abs(ours - expected)[inside].max() / float(ellipse.approach))
    assert errors[-1] < 5e-4
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.3
