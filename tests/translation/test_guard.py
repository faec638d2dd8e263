"""Guard on the mechanism: quantiles by zone, rows of extremes and of wear regimes."""

import numpy as np
import pytest

from wearsim.translation.guard import (
    ZONE_BORDERS,
    by_zone,
    extreme_rows,
    in_all_zones,
    regime_rows,
    weighted_quantile,
    zone_of,
    zone_quantiles,
)

ZONES = len(ZONE_BORDERS) + 1


def test_zones_and_their_sums_hold_all_that_is_worn():
    y = np.linspace(-50e-3, 60e-3, 45)
    worn = np.random.default_rng(1).random((3, 45))
    assert by_zone(y, worn).shape == (3, ZONES)
    np.testing.assert_allclose(
        by_zone(y, worn).sum(axis=1), worn.sum(axis=1), rtol=1e-12
    )
    assert zone_of(np.array([-60e-3, 0.0, 50e-3])).tolist() == [0, 5, 9]


def test_a_quantile_is_that_of_the_weight():
    value = np.array([3.0, 1.0, 2.0])
    assert weighted_quantile(value, np.array([0.04, 0.5, 0.46]), 0.95) == 2.0
    assert weighted_quantile(value, np.array([0.06, 0.5, 0.44]), 0.95) == 3.0
    assert np.isnan(weighted_quantile(value, np.zeros(3), 0.95))


def test_zones_without_wear_have_no_quantile():
    found = zone_quantiles(
        np.array([0.0, 1e-3]), np.array([5.0, 7.0]), np.array([1.0, 1.0])
    )
    assert found[5] == 7.0
    assert np.isnan(np.delete(found, 5)).all()


@pytest.mark.parametrize(("above", "fits"), [(0.05, True), (0.06, False)])
def test_extremes_may_bring_five_per_cent_of_the_wear_of_a_zone(above, fits):
    worn = np.zeros((2, 2, ZONES))
    worn[:, 0, 5] = 1.0  # of the right wheel
    value = np.array([[1.0, 9.0], [3.0, 9.0]])  # the left wheel wears nothing
    limit = np.where(np.arange(ZONES) == 5, 2.0, np.nan)
    rows = extreme_rows(worn, value, limit)
    assert rows.shape == (1, 2)
    assert bool((rows @ [1.0 - above, above] <= 1e-12).all()) is fits


@pytest.mark.parametrize(("value", "fits"), [(1.9, True), (2.1, False)])
def test_zones_that_the_field_does_not_wear_have_its_largest_limit(value, fits):
    worn = np.zeros((2, 2, ZONES))
    worn[0, 0, 5] = worn[1, 0, 2] = 1.0
    limit = np.full(ZONES, np.nan)
    limit[5:7] = 1.0, 2.0
    values = np.array([[1.0, 0.0], [value, 0.0]])
    rows = extreme_rows(worn, values, in_all_zones(limit))
    assert len(rows) == ZONES
    assert bool((rows @ [1.0, 0.01] <= 1e-12).all()) is fits
    assert np.isnan(in_all_zones(np.full(ZONES, np.nan))).all()


@pytest.mark.parametrize(
    ("severe", "fits"), [(0.15, False), (0.25, True), (0.45, False)]
)
def test_the_share_of_a_wear_regime_keeps_to_that_of_the_field(severe, fits):
    """Border of two regimes: candidate 0 wears mildly, candidate 1 severely."""
    worn = np.zeros((2, 2, ZONES))
    worn[0, 0, 5] = worn[1, 1, 5] = 1.0
    share = np.full((2, ZONES), np.nan)
    share[:, 5] = 0.7, 0.3
    rows = regime_rows(worn, share)
    assert rows.shape == (4, 2)
    assert bool((rows @ [1.0 - severe, severe] <= 1e-12).all()) is fits
