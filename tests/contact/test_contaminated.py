"""Creep curves of contaminated surfaces: the Kalker factor."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve

FACTOR = 0.4


def solved(wheelset, counterface, points, creepage, **others):
    """Right wheel with given creepages (n, 3)."""
    creepage = np.array(creepage)
    conditions = replace(points(shift=np.zeros(len(creepage))), creepage=creepage)
    models = ContactModels.of("fast", strips=16, cells=16, **others)
    return solve(conditions, wheelset, counterface(), models, sides=(0,))


def test_forces_at_little_creepage_are_kalker_factor_times_as_large(
    wheelset, counterface, points
):
    """Forces are linear but for the load that lateral forces carry: 1e-5."""
    little = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0]]
    clean = solved(wheelset, counterface, points, little)
    dirty = solved(wheelset, counterface, points, little, kalker_factor=FACTOR)
    np.testing.assert_allclose(dirty.force_x[0], FACTOR * clean.force_x[0], rtol=1e-5)
    np.testing.assert_allclose(dirty.force_y[1], FACTOR * clean.force_y[1], rtol=1e-5)
    np.testing.assert_allclose(dirty.max_pressure, clean.max_pressure, rtol=1e-5)


def test_force_and_power_in_full_slip_do_not_depend_on_the_kalker_factor(
    wheelset, counterface, points
):
    """Elastic slip left over at a creepage of 20 %: 1e-3."""
    full = [[0.2, 0.0, 0.0], [0.0, -0.2, 0.0]]
    clean = solved(wheelset, counterface, points, full)
    dirty = solved(wheelset, counterface, points, full, kalker_factor=FACTOR)
    for name in ("force_x", "force_y", "power"):
        np.testing.assert_allclose(
            getattr(dirty, name), getattr(clean, name), rtol=1e-3, atol=1.0
        )
    np.testing.assert_allclose(dirty.power[0], 0.35 * 80e3 * 0.2 * 20.0, rtol=2e-3)


@pytest.mark.parametrize("name", ["force_x", "force_y", "spin_moment"])
def test_power_is_that_of_the_rigid_slip(wheelset, counterface, points, name):
    """A balance of forces and creepages, with the forces of clean surfaces at k times
    the creepage: rounding, and 1e-6 of the wheel load.
    """
    creepage = np.array([[3e-3, -1e-3, 0.3], [1e-3, 1e-3, 0.0]])
    clean = solved(wheelset, counterface, points, FACTOR * creepage)
    dirty = solved(wheelset, counterface, points, creepage, kalker_factor=FACTOR)
    np.testing.assert_allclose(
        getattr(dirty, name), getattr(clean, name), rtol=1e-5, atol=1e-2
    )
    np.testing.assert_allclose(dirty.power, clean.power / FACTOR, rtol=1e-5)
