"""FASTSIM against the closed forms of simplified theory."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from closed_forms import (
    fastsim_elliptic_force,
    fastsim_elliptic_slip_border,
    fastsim_strip_work,
    frictional_power,
    full_slip,
    full_slip_spin_moment,
    kalker_linear,
    reduced_creepage,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.contact.tangential import fastsim
from wearsim.contact.tangential.kalker import coefficients

A, B, LOAD, FRICTION = 6e-3, 4e-3, 80e3, 0.35
SHEAR_MODULUS, POISSON = 80.77e9, 0.3
DATA = Path(__file__).parents[2] / "data"


def solved(patch, creepage, cells=50, friction=FRICTION):
    return fastsim.solve(
        replace(patch, cells=np.array([cells])),
        np.atleast_2d(np.asarray(creepage, dtype=float)),
        np.array([friction]),
        shear_modulus=SHEAR_MODULUS,
        poisson_ratio=POISSON,
        fields=True,
    )


def saturation(friction=FRICTION):
    """Longitudinal creepage at which the reduced one is 1."""
    return 1.0 / float(
        reduced_creepage(1.0, A, B, friction, LOAD, SHEAR_MODULUS, POISSON)[0]
    )


@pytest.mark.parametrize("eps", [0.25, 0.5, 1.0, 1.5])
def test_longitudinal_force_follows_the_closed_form(ellipse, eps):
    """Discretisation of the slip border: 1e-3 on 80 x 80, 1.5e-3 on 50 x 50; of its
    place: 1 cell.
    """
    for cells, error in ((50, 1.5e-3), (80, 1e-3)):
        patch = ellipse(A, B, LOAD, cells)
        result = solved(patch, [eps * saturation(), 0.0, 0.0], cells)
        force = result.force[0]
        assert -force[0] / (FRICTION * LOAD) == pytest.approx(
            fastsim_elliptic_force(eps), abs=error
        )
        assert abs(force[1:]).max() < 1e-9 * FRICTION * LOAD
        slip_share = result.slip_area[0] / (
            (patch.x_lead - patch.x_trail).sum() * patch.width[0]
        )
        exact = 0.5 * (1.0 + fastsim_elliptic_slip_border(eps))
        assert slip_share == pytest.approx(exact, abs=1.0 / cells)


@pytest.mark.parametrize("eps", [0.5, 1.0, 1.5])
def test_longitudinal_force_converges_with_the_grid(ellipse, eps):
    """The load is exact on any grid; what is left falls faster than first order."""
    exact = fastsim_elliptic_force(eps)
    n = np.array([16, 32, 64, 128, 256])
    error = [
        abs(
            solved(ellipse(A, B, LOAD, k), [eps * saturation(), 0.0, 0.0], k).force[
                0, 0
            ]
            / (FRICTION * LOAD)
            + exact
        )
        for k in n
    ]
    assert np.polyfit(np.log(n), np.log(error), 1)[0] < -1.2


@pytest.mark.parametrize("eps", [0.1, 0.7, 3.0, 50.0])
def test_strip_work_of_pure_longitudinal_creepage_is_parabolic(ellipse, eps):
    """e(y) = 3 T gamma / (4 b) (1 - y^2/b^2) at any creepage; shape exact, size by the
    strips' width.
    """
    patch, creepage = ellipse(A, B, LOAD, 40), eps * saturation()
    result = solved(patch, [creepage, 0.0, 0.0])
    _, shear_x, _, slip_x, _ = result.cells[:, 0]
    work = -(shear_x * slip_x).sum(axis=0) * (patch.x_lead - patch.x_trail)[0] / 50
    exact = fastsim_strip_work(patch.y[0], B, result.force[0, 0], creepage)
    np.testing.assert_allclose(work / work.sum(), exact / exact.sum(), rtol=1e-11)
    # The midpoint rule of the parabola is off by 1/(2 strips^2).
    np.testing.assert_allclose(work, exact, rtol=0.6 / 40**2)


@pytest.mark.parametrize(
    "creepage", [(1e-3, 0, 0), (2e-4, -7e-4, 0.0), (1e-4, 6e-4, -0.6), (0, 0, 0.4)]
)
@pytest.mark.parametrize("cells", [4, 33])
def test_local_work_equals_the_resultants_with_one_flexibility(
    ellipse, monkeypatch, creepage, cells
):
    """Two forms of one sum: the mean traction of the cell makes the balance exact on
    any grid.
    """
    flexibility = 1.3e-14
    monkeypatch.setattr(
        fastsim,
        "flexibilities",
        lambda patch, *_: np.full((3, patch.row.size), flexibility),
    )
    patch = ellipse(A, B, LOAD, 21, offset=0.1)
    result = solved(patch, creepage, cells)
    _, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0]
    area = (patch.x_lead - patch.x_trail)[0] / cells * patch.width[0]
    local = -((shear_x * slip_x + shear_y * slip_y) * area).sum()
    assert local == pytest.approx(-result.force[0] @ np.array(creepage), rel=1e-12)
    assert local > 0.0


@pytest.mark.parametrize(
    "creepage", [(0.5, 0.0, 0.0), (0.0, -0.4, 0.0), (-0.3, 0.4, 0.0)]
)
def test_full_slip_carries_friction_times_load(ellipse, creepage):
    """Imposed quantity: 1e-9."""
    patch = ellipse(A, B, LOAD, 20)
    for cells in (7, 50):
        result = solved(patch, creepage, cells)
        force = result.force[0, :2]
        # With unequal flexibilities full slip turns towards the stiffer direction: a
        # trait of the model.
        rate = (
            np.array(creepage[:2])
            / fastsim.flexibilities(patch, SHEAR_MODULUS, POISSON)[:2, 0]
        )
        np.testing.assert_allclose(
            force, full_slip(rate[None], FRICTION, LOAD)[0], atol=1e-9 * FRICTION * LOAD
        )
        assert result.slip_area[0] == pytest.approx(
            (2.0 * patch.x_lead).sum() * patch.width[0], rel=1e-12
        )


@pytest.mark.parametrize(("a", "b"), [(6e-3, 4e-3), (3e-3, 8e-3), (5e-3, 5e-3)])
def test_spin_alone_slides_all_around(ellipse, a, b):
    """Moment of a spin far beyond saturation: the ends of the strips cost 1e-3 with
    120, of order 1.5.
    """
    for spin in (2e4, -2e4):
        exact = full_slip_spin_moment(spin, a, b, FRICTION, LOAD)
        error = []
        for n in (30, 60, 120):
            force = solved(ellipse(a, b, LOAD, n), [0.0, 0.0, spin], n).force[0]
            error.append(abs(force[2] / exact - 1.0))
            assert abs(force[0]) < 1e-9 * FRICTION * LOAD
        assert error[2] < 1e-3
        assert np.polyfit(np.log([30, 60, 120]), np.log(error), 1)[0] == pytest.approx(
            -1.5, abs=0.15
        )


@pytest.mark.parametrize(("a", "b"), [(6e-3, 4e-3), (3e-3, 8e-3)])
def test_small_creepage_follows_linear_theory(ellipse, a, b):
    """Fx, Fy with Kalker's coefficients; the last cell of a strip (traction falls to 0)
    costs 1/cells.

    Moments are those of simplified theory, with coefficients of its own.
    """
    _, c22, c23, _ = coefficients(np.array([a / b]), POISSON)[:, 0]
    tiny = 1e-8
    g = SHEAR_MODULUS
    kalker = kalker_linear(np.eye(3), a, b, g, POISSON).T
    spin_moment = (
        -8.0 / 15.0 * a**2 * b**3 * 4.0 * g * c23 / (np.pi * a * np.sqrt(a / b))
    )
    lateral_moment = 3.0 * np.pi / 32.0 * g * c22 * a**2 * b
    expected = {
        (0, 0): kalker[0, 0],
        (1, 1): kalker[1, 1],
        (1, 2): kalker[1, 2],
        (2, 1): lateral_moment,
        (2, 2): spin_moment,
    }
    for (out, into), slope in expected.items():
        error = []
        for n in (40, 80, 160):
            creepage = np.zeros(3)
            creepage[into] = tiny
            force = solved(ellipse(a, b, LOAD, n), creepage, n).force[0, out]
            error.append(force / (slope * tiny) - 1.0)
        assert abs(error[0]) < 3.0 / 40, (out, into)
        assert abs(error[2]) < 0.6 * abs(error[1]) < 0.36 * abs(error[0]), (
            out,
            into,
        )  # first order


def test_lateral_force_by_spin_and_moment_by_lateral_creepage_are_reciprocal(ellipse):
    """C32 = -C23 for equal flexibilities; simplified theory keeps it up to the ratio
    L2 / L3.
    """
    tiny, patch = 1e-8, ellipse(A, B, LOAD, 100)
    flexibility = fastsim.flexibilities(patch, SHEAR_MODULUS, POISSON)[:, 0]
    by_spin = solved(patch, [0.0, 0.0, tiny], 100).force[0, 1] * flexibility[2]
    by_lateral = solved(patch, [0.0, tiny, 0.0], 100).force[0, 2] * flexibility[1]
    # Both are sums over the last, cut cell with different weights: 3 / cells.
    assert by_lateral == pytest.approx(-by_spin, rel=3.0 / 100)


def test_creep_curve_of_an_elliptic_contact(ellipse):
    """Spec 7.2: closed form to its printed digits, our grid to 1e-3; simplified theory
    is 0.062 off.
    """
    table = pd.read_csv(DATA / "contact_creep_curve.csv", comment="#")
    a, b, load, friction, modulus, poisson = (
        6.304e-3,
        12.607e-3,
        106.7e3,
        0.33,
        82e9,
        0.28,
    )
    eps = reduced_creepage(table.creepage, a, b, friction, load, modulus, poisson)
    closed = fastsim_elliptic_force(eps)
    np.testing.assert_allclose(
        closed, table.closed_form, atol=1.5e-4
    )  # a, b, N have four digits
    patch = ellipse(a, b, load, 200, cells=200)
    for k in range(len(table)):
        force = fastsim.solve(
            patch,
            np.array([[table.creepage[k], 0.0, 0.0]]),
            np.array([friction]),
            shear_modulus=modulus,
            poisson_ratio=poisson,
            fields=False,
        ).force
        assert -force[0, 0] / (friction * load) == pytest.approx(closed[k], abs=1e-3)
        assert -force[0, 0] / (friction * load) == pytest.approx(
            table.half_space[k], abs=0.065
        )


def test_lateral_creepage_against_spin(ellipse):
    """Spec 4.3, a = 8, b = 4 mm: an independent FASTSIM with 120 x 120 cells printed
    -0.598 and -44.424.
    """
    patch = ellipse(8e-3, 4e-3, 82e3, 120, cells=120)
    result = fastsim.solve(
        patch,
        np.array([[0.0, 6.25e-4, -0.625]]),
        np.array([0.3]),
        shear_modulus=82e9,
        poisson_ratio=0.28,
        fields=False,
    )
    # Printed creepages and forces are those on the rail: both signs differ, products do
    # not.
    assert result.force[0, 0] == pytest.approx(0.0, abs=1.0)
    assert abs(result.force[0, 1]) / (0.3 * 82e3) == pytest.approx(0.598, abs=3e-3)
    assert abs(result.force[0, 2]) == pytest.approx(44.424, rel=1e-2)
    power = frictional_power(result.force, [[0.0, 6.25e-4, -0.625]], 30.0)[0]
    assert power == pytest.approx(557.0, rel=1e-2)


# Rounded: squares of creepages below 1e-150 underflow.
small = st.floats(-3e-3, 3e-3).map(lambda value: round(value, 12))
spins = st.floats(-1.0, 1.0).map(lambda value: round(value, 9))


@settings(max_examples=40)
@given(small, small, spins)
def test_reversed_creepage_reverses_the_forces(ellipse, xi_x, xi_y, spin):
    patch = ellipse(A, B, LOAD, 17, offset=0.2)
    forward = solved(patch, [xi_x, xi_y, spin], 13).force
    backward = solved(patch, [-xi_x, -xi_y, -spin], 13).force
    np.testing.assert_allclose(backward, -forward, rtol=1e-12, atol=1e-9)


@settings(max_examples=40)
@given(small, small, spins)
def test_mirrored_patch_mirrors_lateral_force_and_moment(ellipse, xi_x, xi_y, spin):
    patch = ellipse(A, B, LOAD, 17, offset=0.2)
    mirrored = replace(patch, y=-patch.y)
    there = solved(patch, [xi_x, xi_y, spin], 13).force[0]
    back = solved(mirrored, [xi_x, -xi_y, -spin], 13).force[0]
    np.testing.assert_allclose(back, there * [1.0, -1.0, -1.0], rtol=1e-11, atol=1e-8)


@settings(max_examples=40)
@given(small, small, spins, st.floats(0.0, 0.6).map(lambda value: round(value, 9)))
def test_traction_stays_within_friction_and_opposes_slip(
    ellipse, xi_x, xi_y, spin, friction
):
    result = solved(ellipse(A, B, LOAD, 16), [xi_x, xi_y, spin], 12, friction)
    pressure, shear_x, shear_y = result.cells[:3, 0]
    assert np.isfinite(result.cells).all()
    assert np.all(np.hypot(shear_x, shear_y) <= friction * pressure * (1.0 + 1e-12))
    assert -(result.force[0] @ [xi_x, xi_y, spin]) >= -1e-9 * friction * LOAD
    assert np.all(pressure > 0.0)


@settings(max_examples=30)
@given(st.floats(0.1, 10.0), small, small, spins)
def test_scaling_of_the_patch(ellipse, scale, xi_x, xi_y, spin):
    """Lengths times k, load times k^2, spin over k: the same pressure, k^2 times the
    forces.
    """
    unit = solved(ellipse(A, B, LOAD, 12), [xi_x, xi_y, spin], 11).force[0]
    patch = ellipse(scale * A, scale * B, scale**2 * LOAD, 12)
    scaled = solved(patch, [xi_x, xi_y, spin / scale], 11).force[0]
    np.testing.assert_allclose(
        scaled, unit * scale ** np.array([2.0, 2.0, 3.0]), rtol=1e-9, atol=1e-7
    )
