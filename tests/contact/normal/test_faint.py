"""Faint patches: their weights, and what is left of wheels with a second patch of any
share of the load.
"""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.contact.geometry import CounterfaceProfile, Gap
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.normal.faint import weight_of
from wearsim.contact.problem import ContactModels
from wearsim.contact.wheels import Side, normal_of

LOAD = 80e3
SHARES = np.array([6e-5, 2e-4, 7e-4, 3e-3])
"""Of the second patch of each wheel, nearly."""


def test_weight_is_smooth_and_whole_from_a_thousandth_on():
    """Continuous with its derivative by the logarithm of a share; 0 up to a tenth of
    it.
    """
    step = 1e-4
    log = np.arange(-5.0, -2.0, step)
    weight = weight_of(10.0**log)
    slope = np.diff(weight) / step
    assert np.all(slope >= 0.0)
    assert slope.max() < 1.6  # of 3 t^2 - 2 t^3: 1.5
    assert (
        np.abs(np.diff(slope)).max() < 10.0 * step
    )  # its second derivative is at most 6
    assert np.all(weight[log > -3.0 + step] == 1.0)
    assert np.all((weight > 0.0) == (log > -4.0 + 0.5 * step))


def gap_of(height):
    """Gaps of two parabolas 25 mm apart, the second one higher (n,), over a flat
    counterface [m].
    """
    y = np.linspace(-15e-3, 40e-3, 2751)
    curve = np.minimum(2.0 * y**2, height[:, None] + 2.0 * (y - 25e-3) ** 2)
    zero = np.zeros_like(curve)
    ground = CounterfaceProfile(y, zero[0], zero[0], zero[0])
    return Gap(ground, 0.0, curve, zero + y, zero, 0.46 + zero, zero)


def share_of(solution):
    """Share of each wheel's second patch; 0 where there is none."""
    second = np.zeros(SHARES.size)
    here = np.append(False, np.diff(solution.patch.row) == 0)
    second[solution.patch.row[here]] = solution.normal_force[here]
    return second / np.bincount(solution.patch.row, solution.normal_force)


@pytest.fixture(scope="module", params=sorted(NORMAL_MODELS))
def solutions(request):
    """Solutions of the model itself, and those that wheels get, at heights found by
    halving.
    """
    models = ContactModels(normal=request.param, strips=20, cells=20)
    row, load = np.arange(SHARES.size), np.full(SHARES.size, LOAD)

    def solved(height):
        return NORMAL_MODELS[request.param](
            gap_of(height),
            row,
            load,
            vertical=True,
            effective_modulus=models.effective_modulus,
            parameters={},
            resolution=models.resolution,
        )

    low, high = np.full((2, SHARES.size), [[10e-6], [150e-6]])
    for _ in range(18):
        middle = 0.5 * (low + high)
        lower = share_of(solved(middle)) > SHARES
        low, high = np.where(lower, middle, low), np.where(lower, high, middle)
    task = SimpleNamespace(models=models, vertical=True)
    return solved(low), normal_of(task, Side(0, 1.0, gap_of(low), None), row, load)


def test_faint_patches_fade_and_the_load_is_kept(solutions):
    solved, faded = solutions
    before, after = share_of(solved), share_of(faded)
    assert np.all((before > 0.8 * SHARES) & (before < 1.5 * SHARES))
    assert np.all((after > 0.0) == (before > 1e-4))
    left = weight_of(before) * before
    np.testing.assert_allclose(after, left / (1.0 - before + left), rtol=1e-12)
    np.testing.assert_allclose(
        np.bincount(faded.patch.row, faded.normal_force), LOAD, rtol=1e-9
    )
    down = [
        one.vertical_displacement[np.diff(one.patch.row, prepend=-1) > 0]
        for one in solutions
    ]
    np.testing.assert_array_equal(*down)


def test_what_is_left_carries_its_force(solutions):
    """Strips, cells and strips in planes; edges enclose the centre; pressures fade with
    the patch.
    """
    patch, force = solutions[1].patch, solutions[1].normal_force
    half = 0.5 * (patch.x_lead - patch.x_trail)
    carried = 0.5 * np.pi * (patch.pressure_slope * half**2).sum(axis=1) * patch.width
    np.testing.assert_allclose(carried, force, rtol=1e-12)
    if patch.planes is not None:
        np.testing.assert_allclose(
            patch.planes.normal_force.sum(axis=1), force, rtol=1e-9
        )
    if patch.grid is not None:
        cells = (
            patch.grid.pressure.sum(axis=(1, 2)) * patch.grid.cell_length * patch.width
        )
        np.testing.assert_allclose(cells, force, rtol=1e-12)
    edge, centre = solutions[1].edge_y, solutions[1].centre_y
    assert np.all((edge[:, 0] < centre) & (centre < edge[:, -1]))
    np.testing.assert_allclose(
        np.ptp(edge, axis=1), patch.width * patch.strips, rtol=1e-6
    )
    assert np.all(
        (patch.pressure_slope * half).max(axis=1) < 1.02 * solutions[1].max_pressure
    )


def test_a_wheel_without_faint_patches_stays_as_it_is(solutions):
    """To the last bit, whatever stands beside it in the batch."""
    solved, faded = solutions
    of_wheel = [one.patch.row == SHARES.size - 1 for one in solutions]
    for one, other in (
        (solved, faded),
        (solved.patch, faded.patch),
        (solved.patch.planes, faded.patch.planes),
    ):
        for name in [] if one is None else [f.name for f in fields(one)]:
            values = getattr(one, name), getattr(other, name)
            if isinstance(values[0], np.ndarray):
                kept = [
                    value[mask] for value, mask in zip(values, of_wheel, strict=True)
                ]
                np.testing.assert_array_equal(*kept, err_msg=name)
