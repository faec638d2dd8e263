"""Steady rolling on coupled strips against closed forms, tables, and the half-space on
fine cells.
"""

import csv
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from closed_forms import carter, frictional_power, full_slip, full_slip_spin_moment

from wearsim.contact.patch import Patch, from_grid, on_grid
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve as solve_contact
from wearsim.contact.tangential import TANGENTIAL_MODELS, coupled_strips
from wearsim.contact.tangential.coupled_strips import influence, rolling
from wearsim.contact.tangential.kalker import coefficients
from wearsim.errors import ContactError, NumericalError

POISSON = 0.3
SHEAR_MODULUS = 210e9 / 2.6
A, B, LOAD, FRICTION = 6.5e-3, 5e-3, 80e3, 0.35
CREEPAGE = (-1.6e-3, 4e-4, -0.2)
DATA = Path(__file__).parents[2] / "data"


def table(name):
    """Rows of a data file of numbers."""
    with (DATA / name).open() as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return [{key: float(value) for key, value in row.items()} for row in rows]


def solved(
    patch,
    creepage,
    friction=FRICTION,
    wanted=True,
    modulus=SHEAR_MODULUS,
    poisson=POISSON,
):
    creepage = np.atleast_2d(np.asarray(creepage, dtype=float))
    return coupled_strips.solve(
        patch,
        creepage,
        np.full(len(creepage), friction),
        shear_modulus=modulus,
        poisson_ratio=poisson,
        fields=wanted,
    )


@pytest.fixture(scope="module")
def patch(ellipse):
    """A skew patch with 30 strips, of which 12 are solved."""
    return ellipse(A, B, LOAD, 30, offset=0.1, cells=26)


def half_space(patch, creepage):
    return TANGENTIAL_MODELS["half_space"](
        patch,
        np.atleast_2d(np.asarray(creepage, dtype=float)),
        np.array([FRICTION]),
        shear_modulus=SHEAR_MODULUS,
        poisson_ratio=POISSON,
        fields=True,
    )


@pytest.fixture
def counted(monkeypatch):
    """Products of the matrix that each solution of a patch took."""
    products = []
    roll = rolling.roll

    def and_count(*arguments):
        result = roll(*arguments)
        products.append(result[2])
        return result

    monkeypatch.setattr(rolling, "roll", and_count)
    return products


# ---- without slip


def creepage_coefficients(patch, c):
    """C11, C22 and C23."""
    unit = SHEAR_MODULUS * c**2
    return np.array(
        [
            -solved(patch, [1e-9, 0.0, 0.0]).force[0, 0] / (1e-9 * unit),
            -solved(patch, [0.0, 1e-9, 0.0]).force[0, 1] / (1e-9 * unit),
            -solved(patch, [0.0, 0.0, 1e-7]).force[0, 1] / (1e-7 * unit * c),
        ]
    )


@pytest.mark.parametrize("ratio", [0.2, 0.5, 1.0, 2.0, 5.0])
def test_ellipses_have_kalkers_coefficients(ellipse, ratio):
    """2.5 % with twelve strips of eight points; 2.0 % measured. Kalker's table has two
    to three digits.
    """
    c = 6e-3
    patch = ellipse(c * np.sqrt(ratio), c / np.sqrt(ratio), 100e3, 30, cells=30)
    expected = coefficients(np.array([ratio]), POISSON)[:3, 0]
    np.testing.assert_allclose(creepage_coefficients(patch, c), expected, rtol=0.025)


def test_coefficients_converge_with_the_strips(ellipse, monkeypatch):
    """Of second order, measured."""
    c, strips, values = 6e-3, (6, 12, 24), []
    for count in strips:
        monkeypatch.setattr(coupled_strips, "STRIPS", count)
        values.append(creepage_coefficients(ellipse(0.7 * c, c / 0.7, 100e3, count), c))
    coarse, fine = np.abs(np.diff(values, axis=0))
    assert np.all(fine < 0.4 * coarse)
    assert np.all(fine < 0.005 * values[-1])


def test_coefficients_converge_with_the_points(ellipse, monkeypatch):
    """Of order 1.5 or more: slip at the trailing end reaches a distance of the points'
    squared.
    """
    c, values = 6e-3, []
    patch = ellipse(c, c, 100e3, 8)
    for count in (4, 8, 16):
        monkeypatch.setattr(coupled_strips, "POINTS", count)
        values.append(creepage_coefficients(patch, c)[:2])
    coarse, fine = np.abs(np.diff(values, axis=0))
    assert np.all(fine < 0.36 * coarse)
    assert np.all(fine < 0.02 * values[-1])


@pytest.mark.parametrize(
    "direction", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 150.0)]
)
def test_small_creepage_is_linear(patch, direction):
    unit = solved(patch, 1e-9 * np.array(direction)).force[0]
    assert unit.any()
    force = solved(patch, 1e-7 * np.array(direction)).force[0]
    np.testing.assert_allclose(
        force, 100.0 * unit, rtol=1e-4, atol=1e-5 * abs(force).max()
    )


# ---- closed forms with slip


def strip(half, peak, cells):
    """One strip 2e4 times as wide as long."""
    one, count = np.array([[half]]), np.array([1])
    return Patch(
        np.array([0]),
        0.0 * one,
        np.array([2e4 * half]),
        one,
        -one,
        np.array([[peak / half]]),
        0.0 * one,
        count,
        np.array([cells]),
    )


@pytest.mark.parametrize("axis", [0, 1])
def test_cylinders_roll_as_carter_has_it(axis, monkeypatch):
    """Force within 1e-3 of friction x load with 16 points, 3e-3 with 8; across, G takes
    the place of E*.
    """
    a, p0 = 5e-3, 1e9
    modulus = SHEAR_MODULUS / (1.0 - POISSON) if axis == 0 else SHEAR_MODULUS
    worst = []
    for points in (8, 16):
        monkeypatch.setattr(coupled_strips, "POINTS", points)
        errors = []
        for share in (0.1, 0.3, 0.5, 0.7, 0.9):
            exact = carter(
                share * 2.0 * FRICTION * p0 / modulus, a, p0, FRICTION, modulus
            )
            creepage = np.zeros(3)
            creepage[axis] = exact.creepage
            result = solved(strip(a, p0, 40), creepage)
            force = result.force[0, axis] / (2e4 * a)
            errors.append(
                abs(force - float(exact.force_per_width))
                / (0.5 * np.pi * FRICTION * p0 * a)
            )
            x = a * (1.0 - (2.0 * np.arange(40) + 1.0) / 40)
            traction, expected = result.cells[1 + axis, 0, :, 0], exact.traction(x)
            assert abs(traction - expected).sum() < 0.8 / points * abs(expected).sum()
        worst.append(max(errors))
    assert worst[0] < 3.2e-3
    assert worst[1] < 1e-3


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, -1.0), (-0.8, 0.6)])
def test_full_slip_carries_friction_times_load(patch, direction):
    """Elastic slip, 1e-3, turns the traction less the faster the bodies slide."""
    for size, error in ((0.05, 1e-3), (0.5, 1e-4), (5.0, 1e-5)):
        creepage = size * np.array([*direction, 0.0])
        result = solved(patch, creepage)
        expected = full_slip(creepage[None, :2], FRICTION, LOAD)[0]
        np.testing.assert_allclose(
            result.force[0, :2], expected, atol=error * FRICTION * LOAD
        )
        assert result.slip_area[0] == pytest.approx(patch.area[0], rel=1e-12)


def test_large_spin_turns_with_the_largest_moment(ellipse):
    """1 %; a lateral force is left as slip is looked at ahead of the points."""
    force = solved(ellipse(A, B, LOAD, 30, cells=30), [0.0, 0.0, 1e4]).force[0]
    assert force[2] == pytest.approx(
        float(full_slip_spin_moment(1e4, A, B, FRICTION, LOAD)), rel=0.01
    )
    assert abs(force[0]) < 1e-6 * FRICTION * LOAD
    assert abs(force[1]) < 0.05 * FRICTION * LOAD


# ---- another half-space program


def test_creep_curve_of_an_elliptic_contact(ellipse):
    """Spec 7.2: 1 % of friction x load; 0.7 % measured."""
    friction, load = 0.33, 106.7e3
    patch = ellipse(6.304e-3, 12.607e-3, load, 30, cells=30)
    for row in table("contact_creep_curve.csv"):
        force = solved(
            patch, [row["creepage"], 0.0, 0.0], friction, modulus=82e9, poisson=0.28
        ).force
        assert -force[0, 0] / (friction * load) == pytest.approx(
            row["half_space"], abs=0.01
        )


def test_lateral_creepage_against_spin(ellipse):
    """Spec 4.3, a = 8, b = 4 mm at 30 m/s: 604 W is the half-space on extrapolated
    cells.
    """
    creepage = np.array([[0.0, 6.25e-4, -0.625]])
    for strips in (12, 30):
        patch = ellipse(8e-3, 4e-3, 82e3, strips, cells=30)
        result = solved(patch, creepage, 0.3, modulus=82e9, poisson=0.28)
        assert frictional_power(result.force, creepage, 30.0)[0] == pytest.approx(
            604.0, abs=6.0
        )
        assert result.force[0, 0] == pytest.approx(0.0, abs=1.0)


# ---- symmetries and similarity


def test_reversed_creepage_reverses_everything(patch):
    """The same arithmetic with other signs."""
    forward, backward = solved(patch, CREEPAGE), solved(patch, -np.array(CREEPAGE))
    np.testing.assert_array_equal(backward.force, -forward.force)
    np.testing.assert_array_equal(backward.cells[1:], -forward.cells[1:])
    np.testing.assert_array_equal(backward.slip_area, forward.slip_area)


@pytest.mark.parametrize("creepage", [CREEPAGE, (2e-4, 1e-3, 0.8), (0.0, 0.0, 1e-3)])
def test_mirrored_patch_mirrors_lateral_force_and_moment(patch, creepage):
    """Rounding, through the iteration."""
    flipped = {
        name: getattr(patch, name)[:, ::-1]
        for name in ("x_lead", "x_trail", "pressure_slope")
    }
    mirrored, sign = (
        replace(patch, y=-patch.y[:, ::-1], **flipped),
        np.array([1.0, -1.0, -1.0]),
    )
    there, back = (
        solved(patch, creepage).force[0],
        solved(mirrored, sign * creepage).force[0],
    )
    np.testing.assert_allclose(
        back, sign * there, rtol=1e-8, atol=1e-9 * FRICTION * LOAD
    )


def test_scaling_of_the_patch(ellipse):
    """Lengths times k, load times k^2, spin over k: the same pressure, k^2 times the
    forces, one matrix.
    """
    influence._of_shape.cache_clear()
    unit = solved(ellipse(A, B, LOAD, 30, offset=0.1), CREEPAGE).force[0]
    for scale in (0.3, 1.001, 3.0):
        scaled = solved(
            ellipse(scale * A, scale * B, scale**2 * LOAD, 30, offset=0.1),
            CREEPAGE / np.array([1.0, 1.0, scale]),
        )
        np.testing.assert_allclose(
            scaled.force[0], unit * scale ** np.array([2.0, 2.0, 3.0]), rtol=1e-7
        )
    assert influence._of_shape.cache_info().misses == 1


# ---- cells


def test_cells_hold_the_solution(patch):
    """Sticking cells have no slip, and slip is against the traction; power of the cells
    within 2 %.
    """
    result = solved(patch, CREEPAGE)
    pressure, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0]
    size, slid = np.hypot(shear_x, shear_y), np.hypot(slip_x, slip_y)
    assert np.all(size <= FRICTION * pressure * (1.0 + 1e-12))
    assert np.all(shear_x * slip_x + shear_y * slip_y <= 0.0)
    assert 0.2 < (slid > 0.0).mean() < 0.9
    assert 0.2 < result.slip_area[0] / patch.area[0] < 0.9
    area = result.cell_length[0] * patch.width[0]
    power = -((shear_x * slip_x + shear_y * slip_y) * area).sum()
    assert power == pytest.approx(
        frictional_power(result.force, [CREEPAGE], 1.0)[0], rel=0.02
    )


@pytest.mark.parametrize(
    "creepage", [(1e-7, 0.0, 0.0), (0.0, -1e-6, 0.0), (0.0, 0.0, 0.01), CREEPAGE]
)
def test_all_strips_that_pull_do_work(patch, creepage):
    """Also where no point slips: then at the trailing end, as the elastic body has
    it.
    """
    result = solved(patch, creepage)
    _, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0]
    work = -(shear_x * slip_x + shear_y * slip_y)
    assert np.all(work.sum(axis=0)[2:-2] > 0.0)
    assert work[-6:].sum() > 0.8 * work.sum() or creepage == CREEPAGE
    assert np.isfinite(result.cells).all()


def test_forces_hardly_depend_on_the_cells(ellipse):
    """What the bound cuts goes to other cells: 2e-4 of friction x load between 10 and
    80 cells.
    """
    force = [
        solved(ellipse(A, B, LOAD, 30, cells=cells), CREEPAGE).force[0, :2]
        for cells in (10, 30, 80)
    ]
    assert np.ptp(force, axis=0).max() < 2e-4 * FRICTION * LOAD


def test_strips_and_their_cells_are_one_problem(patch):
    """From cells, strips get the same load, middle and variance: 0.5 % of friction x
    load.
    """
    cells = from_grid(
        patch.row, patch.y, patch.width, on_grid(patch), patch.strips, patch.cells
    )
    np.testing.assert_allclose(
        solved(cells, CREEPAGE).force,
        solved(patch, CREEPAGE).force,
        atol=5e-3 * FRICTION * LOAD,
    )


def test_empty_strips_at_the_sides_change_nothing(ellipse):
    """A grid is wider than its patch; two strips without contact on one side, one on
    the other.
    """
    patch = ellipse(A, B, LOAD, 30)
    padded = {
        name: np.pad(getattr(patch, name), [(0, 0), (2, 1)])
        for name in ("x_lead", "x_trail", "pressure_slope", "interpenetration")
    }
    y = patch.y[0, 0] + patch.width[0] * np.arange(-2, 31)[None]
    wider = replace(patch, y=y, strips=np.array([33]), **padded)
    whole, within = solved(wider, CREEPAGE), solved(patch, CREEPAGE)
    np.testing.assert_allclose(whole.force, within.force, rtol=1e-9)
    assert not whole.cells[:, :, :, [0, 1, -1]].any()


def test_two_lobes_side_by_side(ellipse):
    """Empty strips between them, too: each carries what friction lets it, and nothing
    acts between them.
    """
    patch = ellipse(A, B, LOAD, 40, cells=26)
    gap = np.where(np.abs(patch.y) < 1.5e-3, 0.0, 1.0)
    lobes = replace(
        patch,
        **{
            name: gap * getattr(patch, name)
            for name in ("x_lead", "x_trail", "pressure_slope")
        },
    )
    carried = FRICTION * LOAD * 0.5 * np.pi / LOAD
    carried *= (
        lobes.pressure_slope * (0.5 * (lobes.x_lead - lobes.x_trail)) ** 2
    ).sum() * patch.width[0]
    result = solved(lobes, [0.05, 0.0, 0.0])
    assert -result.force[0, 0] == pytest.approx(carried, rel=1e-3)
    assert not result.cells[:, 0][:, :, gap[0] == 0.0].any()
    assert np.isfinite(solved(lobes, CREEPAGE).cells).all()


# ---- the same solution in every way of asking


def test_batch_and_threads_keep_the_bits(ellipse):
    sizes = [(6.5e-3, 5e-3, 30), (4e-3, 7e-3, 44), (6e-3, 2e-3, 9), (8e-3, 0.45e-3, 30)]
    patches = [
        ellipse(a, b, LOAD, strips, cells=20 + strips // 9) for a, b, strips in sizes
    ]
    creepage = np.array(
        [CREEPAGE, (0.0, 1e-3, 0.4), (3e-3, -1e-3, 0.1), (1e-5, 0.0, 0.0)]
    )
    wide = max(p.y.shape[1] for p in patches)
    names = [f.name for f in fields(Patch) if f.name not in ("row", "grid", "planes")]
    joined = {
        name: np.concatenate(
            [
                np.pad(part, [(0, 0), (0, wide - part.shape[1])])
                if part.ndim == 2
                else part
                for part in (getattr(p, name) for p in patches)
            ]
        )
        for name in names
    }
    batch = solved(Patch(row=np.arange(4), **joined), creepage)
    for threads in (1, 2):
        influence._of_shape.cache_clear()
        with ThreadPoolExecutor(threads) as pool:
            for m, alone in enumerate(pool.map(solved, patches, creepage)):
                cells, strips = alone.cells.shape[2:]
                np.testing.assert_array_equal(alone.force[0], batch.force[m])
                np.testing.assert_array_equal(
                    alone.cells[:, 0], batch.cells[:, m, :cells, :strips]
                )
                assert not batch.cells[:, m, cells:].any()
                assert not batch.cells[:, m, :, strips:].any()


# ---- ends of the range


def test_without_friction_all_slides_freely(patch):
    result = solved(patch, [1e-3, -2e-3, 0.3], friction=0.0)
    assert not result.force.any()
    assert result.slip_area[0] == pytest.approx(patch.area[0], rel=1e-12)
    expected = np.broadcast_to(1e-3 - 0.3 * patch.y[0], (26, 30))
    np.testing.assert_allclose(result.cells[3, 0], expected, rtol=1e-12)
    np.testing.assert_array_equal(result.cells[0], solved(patch, CREEPAGE).cells[0])
    assert not solved(patch, [1e-3, -2e-3, 0.3], friction=0.0, wanted=False).force.any()


def test_what_is_not_finite_is_refused(patch):
    with pytest.raises(
        ContactError, match=r"^creepage and friction coefficient must be finite$"
    ) as caught:
        solved(replace(patch, row=np.array([4])), [np.nan, 0.0, 0.0])
    assert caught.value.row == 4


def test_no_solution_is_told(patch, monkeypatch):
    monkeypatch.setattr(coupled_strips, "MOST_STEPS", 0)
    with pytest.raises(
        NumericalError, match=r"^steady rolling .* did not converge: residual "
    ) as caught:
        solved(replace(patch, row=np.array([7])), CREEPAGE)
    assert caught.value.row == 7


def test_spin_on_a_narrow_patch_is_solved_with_one_place_for_the_slip(ellipse, counted):
    """Where points would have to stick by one place and slip by the other: 1.5 % of
    friction x load.
    """
    creepage = (0.0, 2e-3, 5.0)
    force = solved(ellipse(8e-3, 3e-3, LOAD, 30, cells=30), creepage).force[0]
    assert len(counted) == 2
    exact = half_space(ellipse(8e-3, 3e-3, LOAD, 60, cells=60), creepage).force[0]
    assert abs(force - exact)[:2].max() < 0.015 * FRICTION * LOAD


@pytest.mark.slow
@pytest.mark.parametrize("spin", [0.0, 1.0, 4.0, 20.0])
@pytest.mark.parametrize("size", [0.1, 0.5, 1.0, 3.0])
def test_ellipses_of_all_shapes_converge(ellipse, size, spin):
    """No more than the tolerance is left, or an island of stick; tractions oppose the
    creepage.
    """
    for a, b in ((8e-3, 1e-3), (8e-3, 3e-3), (5e-3, 5e-3), (2e-3, 9e-3)):
        patch, scale = (
            ellipse(a, b, LOAD, 30),
            3.0 * FRICTION * LOAD / (SHEAR_MODULUS * 4.0 * a * b),
        )
        for angle in np.linspace(0.0, 2.0 * np.pi, 7)[:-1]:
            creepage = (
                size
                * scale
                * np.array([np.cos(angle), np.sin(angle), spin / np.sqrt(a * b)])
            )
            force = solved(patch, creepage).force[0]
            assert force @ creepage < 0.0


# ---- the half-space on fine cells


def contacts(wheelset, counterface, points, strips):
    """Patches of a wheel on a rail and on a roller: tread, field side, flange root; and
    their creepages.
    """
    found = []
    models = ContactModels("coupled_strips", "fastsim", strips, strips, cell_size=1.0)
    for curvature in (0.0, 2.0):
        where = points(
            np.array([-3e-3, 0.0, 3e-3, 5e-3, 6e-3]),
            np.array([1e-3, 0.0, -1e-3, 0.0, 3e-3]),
        )
        result = solve_contact(
            where, wheelset, counterface(curvature), models, sides=(0,)
        )
        for m in np.flatnonzero(result.normal_force > 8e3):
            cut = {
                f.name: getattr(result.patch, f.name)[m : m + 1]
                for f in fields(Patch)
                if f.name not in ("row", "grid", "planes")
            }
            creepage = np.array(
                [result.creepage_x[m], result.creepage_y[m], result.spin[m]]
            )
            found.append(
                (Patch(row=np.array([0]), **cut), creepage, result.normal_force[m])
            )
    return found


def strip_work(patch, result, power):
    """Work of the strips, scaled to the power, cumulated over the edges of the
    patch.
    """
    _, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0]
    work = (
        -(shear_x * slip_x + shear_y * slip_y).sum(axis=0)
        * result.cell_length[0]
        * patch.width[0]
    )
    place = patch.y[0, 0] + patch.width[0] * (np.arange(work.size + 1) - 0.5)
    return place, np.concatenate(([0.0], np.cumsum(work))) * power / work.sum()


@pytest.mark.slow
def test_wheels_on_rail_and_roller_as_on_fine_cells(wheelset, counterface, points):
    """Against 96 x 96 cells on the same kind of patch, with the creepage of the wheel,
    half of it and twice.

    Measured: forces 0.2 % (median) and 2 % (worst) of friction x load, power 0.5 and 6
    %, strip work 2 and 15 % (little slip); FASTSIM 1.5 and 12, 3 and 19, 8 and 25 %.
    """
    errors = []
    pairs = zip(
        contacts(wheelset, counterface, points, 30),
        contacts(wheelset, counterface, points, 96),
        strict=True,
    )
    for (coarse, creepage, load), (fine, _, _) in pairs:
        for scale in (0.5, 1.0, 2.0):
            given = scale * creepage
            exact, result = half_space(fine, given), solved(coarse, given)
            there, here = (
                frictional_power(one.force, given[None], 1.0)[0]
                for one in (exact, result)
            )
            place, work = strip_work(coarse, result, here)
            reference = np.interp(place, *strip_work(fine, exact, there))
            errors.append(
                (
                    np.hypot(*(result.force - exact.force)[0, :2]) / (FRICTION * load),
                    abs(here / there - 1.0),
                    abs(np.diff(work) - np.diff(reference)).sum() / reference[-1],
                )
            )
    assert len(errors) >= 30
    force, power, strips = np.array(errors).T
    assert np.median(force) < 0.005
    assert force.max() < 0.025
    assert np.median(power) < 0.01
    assert power.max() < 0.06
    assert np.median(strips) < 0.03
    assert np.percentile(strips, 90) < 0.06
    assert strips.max() < 0.2
