"""Order with the step of every wear law, on contact fields that are functions of the
depth worn so far.

Strips are the vertices of the wheels. Pressure falls by a third and slip doubles while
the deepest vertex wears off a given depth, so that cells pass every jump of the laws
that have some.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from stepping import step_over

from wearsim.campaign.state import WearRate
from wearsim.campaign.step import StepRule
from wearsim.contact.patch import SurfaceFields
from wearsim.damage.wear import WEAR_LAWS, WearSettings, energy, passage_depth
from wearsim.scene.wear_table import WearTableSection, wear_table

RULE = StepRule(radius=0.46, density=7850.0, smoothing_wavelength=0.0, integrator="rkc")
CELLS, FRICTION, SPEED, HALF = 12, 0.35, 20.0, 6e-3
VERTICES = 30
PEAK, DEPTH = 1.1e9, 40e-6
STEPS, FINE = np.array([4, 8, 16]), 64

LAWS = sorted(
    (name, form) for name, law in WEAR_LAWS.items() if law.wears for form in law.forms
)


TABLE = WearTableSection(
    source="test",
    certainty="made up",
    beyond="slope",
    interpolation="linear",
    T_gamma_A_N_mm2=[0, 10.4, 77.2],
    mass_rate_ug_m_mm2=[2.0, 55, 60],
)
OF_USERS = {
    "energy": energy.constant(1e-12, "round number"),
    "table": wear_table(TABLE, "test")[0],
}


def settings_of(name, form):
    coefficients = WEAR_LAWS[name].coefficients or OF_USERS[name]
    return WearSettings(law=name, coefficients=coefficients, form=form)


def fields_of(state, largest):
    """Fields of both wheels; slip rises from none in the leading half to its largest at
    the trailing end.
    """
    band = np.exp(-((state.y / 8e-3) ** 2))[:, None, :]
    worn = state.wear_depth[:, None, :] / DEPTH
    t = 1.0 - (2.0 * np.arange(CELLS)[None, :, None] + 1.0) / CELLS
    pressure = PEAK * np.sqrt(1.0 - t**2) * band * np.exp(-0.4 * worn)
    slip = largest * np.maximum(0.3 - t, 0.0) * (0.3 + band) * 2.0**worn
    zero, ends = np.zeros_like(pressure), np.full(state.y.shape, HALF)
    shear = -FRICTION * pressure * (slip > 0.0)
    return SurfaceFields(
        pressure,
        shear,
        zero,
        slip,
        zero,
        -shear * slip,
        ends,
        2.0 * ends / CELLS,
        np.full(2, np.ptp(state.y[0]) / state.y.shape[1]),
        np.full(2, SPEED),
    )


def depth_after(state, solution, settings, slip, distance, count):
    """Depth after a distance in steps of three stages."""
    area = np.full(2, 1e-4)

    def rate_at(now):
        regime = passage_depth(fields_of(now, slip), area, settings).swapaxes(0, 1) / (
            2.0 * np.pi * RULE.radius
        )
        nothing = np.zeros_like(now.z)
        return WearRate(regime.sum(axis=1), regime, now.z, nothing, nothing, solution)

    regimes = len(WEAR_LAWS[settings.law].regimes)
    few = state.y.shape[1] // VERTICES
    y, z, unworn = (each[:, ::few] for each in (state.y, state.z, state.wear_depth))
    regime_depth = np.zeros((2, regimes, y.shape[1]))
    now = replace(state, y=y, z=z, wear_depth=unworn, regime_depth=regime_depth)
    if distance is None:
        distance = DEPTH / rate_at(now).depth.max()
    for _ in range(count):
        now = step_over(now, rate_at(now), distance / count, RULE, rate_at, 4.0).state
    return now.wear_depth, distance


SLIPS = 6e-3, 2e-2, 6e-2  # 0.2 to 2.5 m/s at the trailing end of new and worn wheels
MISSED = {
    (
        "energy",
        "local",
        6e-3,
    ): "measured 0.9, target 1.7: cells pass a jump of the set, one after the other",
    (
        "table",
        "local",
        6e-2,
    ): "measured 1.4, target 1.7: cells pass a kink; the error is 5e-6 of the depth",
    (
        "archard",
        "patch_mean",
        2e-2,
    ): "measured 0.8, target 1.7: all of the patch passes a border at once",
}


def cases():
    for (name, form), slip in product(LAWS, SLIPS):
        reason = MISSED.get((name, form, slip))
        marks = [pytest.mark.xfail(strict=True, reason=reason)] if reason else []
        yield pytest.param(name, form, slip, marks=marks)


@pytest.mark.parametrize(("name", "form", "slip"), list(cases()))
def test_order_with_the_step(state, solution, name, form, slip):
    """Of rules of second order, on the depth of all strips: 1.7 at least between steps
    of 10 and 2.5 um.
    """
    settings = settings_of(name, form)
    fine, distance = depth_after(state, solution, settings, slip, None, FINE)
    errors = []
    for count in STEPS.tolist():
        depth, _ = depth_after(state, solution, settings, slip, distance, count)
        errors.append(np.sqrt(np.mean((depth - fine) ** 2)) / fine.max())
    order = -np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert order > 1.7
