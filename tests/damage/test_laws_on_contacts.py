"""All laws on solved contacts: S1002 on 60E1, 3 mm off centre, 80 kN, rail and roller
of 0.5 m.
"""

import numpy as np
import pytest
from law_settings import fatigue_settings, wear_settings

from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import solve
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import passage_damage
from wearsim.damage.fatigue.agreement import agreement
from wearsim.damage.fatigue.loads import (
    patch_loads,
    wear_number_with_spin,
    wear_number_without_spin,
)
from wearsim.damage.wear import archard, energy, passage_depth
from wearsim.damage.wear.sliding import relative_slip
from wearsim.profile import standard

MM3_KM = 1e-12  # [m3/m]
MODELS = ContactModels.of(
    "fast", strips=50, cells=50
)  # sliding in partial slip takes some cells


def contacts(models):
    """Right wheel at shifts of 0, 1.5, 3 and 4.5 mm on rail, then on rollers; 20 m/s,
    friction 0.35.
    """
    wheel = standard.wheel("S1002")
    rail = standard.rail("60E1", 1 / 40, 1.435, 0.75)
    shift = np.array([0.0, 1.5e-3, 3e-3, 4.5e-3])
    conditions = ContactConditions(
        shift=shift,
        yaw=0 * shift,
        roll=0 * shift,
        wheel_load=0 * shift + 80e3,
        speed=0 * shift + 20.0,
        friction=0 * shift + 0.35,
        track_curvature=0 * shift,
        rotation="centred",
    )
    wheelset = Wheelset(wheel, wheel, 0.46, 0.75)
    return [
        solve(conditions, wheelset, Counterface(rail, curvature), models, sides=(0,))
        for curvature in (0.0, 2.0)
    ]


@pytest.fixture(scope="module")
def solved():
    return contacts(MODELS)


@pytest.fixture(scope="module")
def by_default():
    """The same on the default grid."""
    return contacts(ContactModels.of("fast"))


def test_wear_number_with_spin_is_the_power_over_the_speed(solved):
    """Two forms of one number, 1e-9; without spin it is less by the work of spin."""
    for solution in solved:
        loads = patch_loads(solution)
        number = wear_number_with_spin(loads)
        np.testing.assert_allclose(number, solution.power / 20.0, rtol=1e-9)
        work = solution.fields.strip_work.sum(axis=1) * solution.fields.strip_width
        np.testing.assert_allclose(number, work, rtol=1e-9)
        assert (wear_number_without_spin(loads) < number).any()


@pytest.mark.parametrize(
    ("grid", "cells", "each", "all_of_them"),
    [("solved", 50, 0.03, 0.0025), ("by_default", 30, 0.055, 0.005)],
)
def test_archard_and_energy_law_on_solved_contacts(
    request, grid, cells, each, all_of_them
):
    """k_e = k / (mu H): p|s| mu over the work density is 1 in cells that slip at both
    ends; FASTSIM turns the traction within a cell, and slip sets in at one end of a
    cell.

    Volume of single patches within 2.4 % on 50 cells, 5.1 % on the 30 of the default
    grid: worst unshifted, where least slips. Of all patches together 0.2 and 0.5 %.
    """
    solved = request.getfixturevalue(grid)
    result = COEFFICIENT_SETS["jendel_2002"]
    for name in ("k_mild", "k_oxidative", "k_severe", "k_seizure"):
        result = result.with_value(name, 5e-4, "test")
    by_energy = energy.constant(5e-4 / (0.35 * 3e9), "test")
    for solution in solved:
        fields, area = solution.fields, solution.area
        slips = fields.slip_x**2 + fields.slip_y**2 > 0.0
        behind = slips.copy()
        behind[:, 1:] &= slips[:, :-1]
        behind[:, 0] = False
        ratio = (
            0.35
            * (fields.pressure * relative_slip(fields))[behind]
            / fields.work_density[behind]
        )
        assert np.abs(np.median(ratio) - 1.0) < 1e-3
        sliding = archard.depth(fields, area, result).sum(axis=0)
        work = energy.depth(fields, area, by_energy).sum(axis=0)
        volumes = [depth.sum(axis=1) * fields.strip_width for depth in (sliding, work)]
        assert slips.shape[1] == cells
        np.testing.assert_allclose(volumes[0], volumes[1], rtol=each)
        assert volumes[0].sum() == pytest.approx(volumes[1].sum(), rel=all_of_them)


def test_all_wear_laws_compared(solved):
    """At 3 mm: laws within a straight branch see the ratio of the powers, 1e-9; the KTH
    map changes region.

    Rail 22.45, 20.7, 7.0 and 17.8, roller 52.5, 38.9, 13.3 and 33.5 mm3/km by archard,
    brr, energy, usfd.
    """
    settings = [wear_settings(law) for law in ("archard", "brr", "energy", "usfd")]
    worn, power, severe = [], [], []
    for solution in solved:
        at = solution.point == 2
        depths = [
            passage_depth(solution.fields, solution.area, one) for one in settings
        ]
        volumes = [
            (depth.sum(axis=2) * solution.fields.strip_width)[:, at] for depth in depths
        ]
        worn.append([volume.sum() / MM3_KM for volume in volumes])
        power.append(solution.power[at].sum())
        severe.append(
            volumes[0][archard.REGIMES.index("severe")].sum() / volumes[0].sum()
        )
    ratio = np.divide(worn[1], worn[0])
    np.testing.assert_allclose(ratio[[1, 3]], power[1] / power[0], rtol=1e-9)
    assert severe[1] > severe[0] > 0.0
    assert ratio[0] > 1.1 * ratio[1]
    assert (
        3.0 < max(worn[0]) / min(worn[0]) < 5.0
    )  # absolute levels differ more than ratios
    np.testing.assert_allclose(worn[0], [22.45, 20.7, 7.0, 17.8], rtol=0.02)
    np.testing.assert_allclose(worn[1], [52.5, 38.9, 13.3, 33.5], rtol=0.02)


def test_all_fatigue_laws_compared(solved):
    """The worst cell is never better than the patch; a roller of 0.5 m is harder on the
    surface than a rail.

    At 3 mm from rail to roller: FI -0.0247 and 0.0393, local 0.083 and 0.151, T-gamma
    24.7 and 45.5 N.
    """
    laws = (
        "stress_index",
        "surface_fatigue_index",
        "surface_fatigue_index_local",
        "wlrm",
    )
    settings = [fatigue_settings(law) for law in laws]
    rail, roller = (
        [passage_damage(patch_loads(one), each) for each in settings] for one in solved
    )
    for result in (rail, roller):
        assert (result[2].index >= result[1].index).all()
        assert np.array_equal(
            result[0].damage > 0.0, result[2].damage > 0.0
        )  # both ask where |tau| > k
    for on_rail, on_roller in zip(rail, roller, strict=True):
        assert (on_roller.index[1:] > on_rail.index[1:]).all()
    np.testing.assert_allclose(
        [each.index[2] for each in rail[1:]], [-0.0247, 0.0833, 24.7], rtol=0.01
    )
    np.testing.assert_allclose(
        [each.index[2] for each in roller[1:]], [0.0393, 0.151, 45.5], rtol=0.01
    )
    damage = {
        one.law: np.concatenate([rail[k].damage, roller[k].damage])
        for k, one in enumerate(settings)
    }
    overlap = agreement(damage).overlap
    np.testing.assert_allclose(overlap, overlap.T, rtol=1e-12)
    assert (
        overlap[0, 2] == overlap[~np.eye(4, dtype=bool)].max()
    )  # laws of the local shear stress agree best
