"""Kalker's creepage coefficients against printed numbers."""

import numpy as np
import pytest

from wearsim.contact.tangential.kalker import coefficients

# a/b, Poisson's ratio, C11, C22, C23, C33 as printed in Kalker 1990, table E.3.
PRINTED = [
    (0.1, 0.0, 2.51, 2.51, 0.334, 6.42),
    (0.1, 0.5, 4.85, 2.53, 0.731, 11.7),
    (0.3, 0.25, 3.44, 2.75, 0.715, 2.96),
    (0.5, 0.0, 2.88, 2.88, 0.827, 1.74),
    (0.5, 0.25, 3.62, 3.01, 0.929, 1.93),
    (1.0, 0.0, 3.40, 3.40, 1.33, 1.21),
    (1.0, 0.25, 4.12, 3.67, 1.47, 1.19),
    (1.0, 0.5, 5.20, 3.98, 1.63, 1.16),
    (1.0 / 0.9, 0.0, 3.51, 3.51, 1.44, 1.16),
    (1.0 / 0.7, 0.5, 5.58, 4.67, 2.18, 0.852),
    (2.0, 0.25, 5.10, 4.90, 2.62, 0.819),
    (1.0 / 0.3, 0.25, 6.34, 6.40, 4.32, 0.674),
    (5.0, 0.5, 8.82, 9.79, 7.89, 0.341),
    (10.0, 0.0, 10.7, 10.7, 12.2, 0.795),
    (10.0, 0.5, 12.9, 16.0, 18.0, 0.228),
]


@pytest.mark.parametrize("line", PRINTED, ids=lambda line: f"{line[0]:.3g}-{line[1]}")
def test_printed_entries_are_met_exactly(line):
    ratio, poisson, *expected = line
    np.testing.assert_allclose(
        coefficients(np.array([ratio]), poisson)[:, 0], expected, rtol=1e-12
    )


def test_poisson_ratio_of_steel_between_the_printed_ones():
    """Spec 4.2: 1/C quadratic in Poisson's ratio, to the last printed digit."""
    c11, c22, c23, _ = coefficients(np.array([2.0]), 0.28)[:, 0]
    assert (round(c11, 3), round(c22, 3), round(c23, 3)) == (5.204, 4.971, 2.657)
    assert round(coefficients(np.array([0.5]), 0.28)[0, 0], 3) == 3.734


def test_all_ratios_give_positive_coefficients_without_jumps():
    """Piecewise linear in ln(a/b): a step of 1e-4 in it moves no coefficient by more
    than 3e-4.
    """
    ratio = np.exp(np.arange(np.log(0.02), np.log(50.0), 1e-4))
    value = coefficients(ratio, 0.3)
    assert np.all(value > 0.0)
    assert np.abs(np.diff(np.log(value), axis=1)).max() < 3e-4


def test_without_poisson_effect_both_directions_are_alike():
    ratio = np.geomspace(0.1, 10.0, 19)
    value = coefficients(ratio, 0.0)
    np.testing.assert_allclose(value[0], value[1], rtol=1e-12)
