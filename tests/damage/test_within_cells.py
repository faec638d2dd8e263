"""Pressure and slip within cells: means that are kept, exact cases, and what laws with
jumps make of it.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.patch import SurfaceFields
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import WearSettings, archard, passage_depth
from wearsim.damage.wear.sliding import relative_slip
from wearsim.damage.within_cells import within_cells

SET = COEFFICIENT_SETS["jendel_2002"]
LENGTH = 10e-3  # of a strip [m]


def strip(cells, pressure=1e9, slip=(0.0, 0.02)):
    """Fields of one strip of `cells` under a pressure, whose slip rises from one value
    to another [-].
    """
    middle = (np.arange(cells) + 0.5) / cells
    sliding = (slip[0] + (slip[1] - slip[0]) * middle).reshape(1, cells, 1)
    load = np.full((1, cells, 1), pressure)
    shear, nothing = 0.3 * load, np.zeros((1, cells, 1))
    return SurfaceFields(
        load,
        -shear,
        nothing,
        sliding,
        nothing,
        shear * sliding,
        np.full((1, 1), LENGTH / 2),
        np.full((1, 1), LENGTH / cells),
        np.ones(1),
        np.full(1, 20.0),
    )


def scattered(patches=3, cells=9, strips=5):
    """Fields of no contact, a third of the cells stick and some strips end early."""
    random = np.random.default_rng(7)
    shape = patches, cells, strips
    load = random.uniform(0.5e9, 1e9, shape)
    load[0, 6:, 2] = 0.0
    slip_x, slip_y = np.where(
        random.random(shape) < 0.3, 0.0, random.normal(size=(2, *shape)) * 1e-3
    )
    shear_x, shear_y = -0.3 * load * np.sign(slip_x), 0.0 * load
    return SurfaceFields(
        load,
        shear_x,
        shear_y,
        slip_x,
        slip_y,
        -shear_x * slip_x,
        np.full((patches, strips), LENGTH / 2),
        np.full((patches, strips), LENGTH / cells),
        np.ones(patches),
        np.full(patches, 20.0),
    )


def means(values, points):
    """Means of the parts of each cell."""
    patches, cells, strips = values.shape
    return values.reshape(patches, cells // points, points, strips).mean(axis=2)


@pytest.mark.parametrize("points", [1, 4])
def test_cells_keep_their_pressure_slip_and_work(points):
    fields = scattered()
    parts = within_cells(fields, points)
    for name in ("pressure", "shear_x", "work_density"):
        np.testing.assert_allclose(
            means(getattr(parts, name), points), getattr(fields, name), rtol=1e-12
        )
    sliding = [
        one.pressure * np.hypot(one.slip_x, one.slip_y) for one in (parts, fields)
    ]
    np.testing.assert_allclose(means(sliding[0], points), sliding[1], rtol=1e-12)
    np.testing.assert_allclose(parts.strip_work, fields.strip_work, rtol=1e-12)
    assert (parts.pressure >= 0.0).all()
    assert (parts.work_density >= 0.0).all()


def test_what_is_linear_stays_so():
    fields = within_cells(strip(6), 4)
    np.testing.assert_allclose(fields.slip_x, strip(24).slip_x, rtol=1e-12)
    np.testing.assert_allclose(fields.pressure, 1e9, rtol=1e-12)


def test_a_patch_does_not_depend_on_what_is_behind_it_and_nan_stays():
    """Patches with fewer cells than others are padded with cells without pressure."""
    fields = scattered(1)
    alone = within_cells(fields)
    padded = {
        name: np.concatenate([value, np.zeros((1, 3, 5))], axis=1)
        for name, value in vars(fields).items()
        if value.ndim == 3
    }
    longer = within_cells(replace(fields, **padded))
    np.testing.assert_array_equal(
        longer.slip_x[:, : alone.slip_x.shape[1]], alone.slip_x
    )
    assert (longer.pressure[:, alone.slip_x.shape[1] :] == 0.0).all()
    fields.pressure[0, 3, 1] = np.nan
    assert np.isnan(within_cells(fields).pressure[0, 12:16, 1]).all()


def test_the_slip_of_a_patch_is_scaled_to_its_work_as_before():
    fields = scattered()
    worn = [one.pressure * relative_slip(one) for one in (within_cells(fields), fields)]
    np.testing.assert_allclose(means(worn[0], 4), worn[1], rtol=1e-12)


def test_local_laws_of_pressure_or_slip_are_integrated_within_cells():
    fields, area = strip(5), np.array([LENGTH])
    for form, own in (("local", within_cells(fields)), ("patch_mean", fields)):
        depth = passage_depth(
            fields, area, WearSettings("archard", "jendel_2002", form=form)
        )
        np.testing.assert_array_equal(depth, archard.depth(own, area, SET, form=form))


def test_wear_on_both_sides_of_a_jump_converges_with_few_cells():
    """Slip rises linearly through 0.2 m/s; by hand, the map without blend: work below
    and above it.

    By the means of cells the jump is at the end of a cell: first order; within cells it
    is where it is.
    """
    jumping = SET.with_value("speed_blend", 0.0, "test").with_value(
        "oxidative_speed", np.inf, "test"
    )
    # p s dx / H over a strip; slip to 0.02, 0.2 m/s is slip 0.01: a quarter of the work
    # is below it
    work = 1e9 * 0.01 * LENGTH / 3e9
    exact = work * (0.25 * SET["k_mild"] + 0.75 * SET["k_severe"])
    by_cells, within = [], []
    for cells in (5, 9, 15, 25):
        fields = strip(cells)
        for errors, own in ((by_cells, fields), (within, within_cells(fields, 8))):
            depth = archard.depth(own, np.ones(1), jumping).sum()
            errors.append(abs(depth / exact - 1.0))
    assert max(within) < 0.2 * max(by_cells)
    assert (np.array(within) <= np.array(by_cells)).all()
