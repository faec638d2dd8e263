from dataclasses import replace

import numpy as np
import pytest
from law_settings import fatigue_settings

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import passage_damage, shakedown, surface_fatigue, wlrm
from wearsim.damage.fatigue.agreement import agreement, normalised
from wearsim.damage.fatigue.balance import LIMITED_BY, balance, damage_after

BURSTOW = COEFFICIENT_SETS["burstow_2004"]
VARIANT = COEFFICIENT_SETS["burstow_2004_20n"]


def test_both_forms_of_the_surface_index_agree():
    """Algebra, 1e-12: p0 = 3N / (2 pi a b)."""
    rng = np.random.default_rng(3)
    a, b = rng.uniform(2e-3, 9e-3, (2, 50))
    force, friction = rng.uniform(1e4, 2e5, 50), rng.uniform(0, 0.6, 50)
    pressure = 1.5 * force / (np.pi * a * b)
    by_pressure = surface_fatigue.surface_index(friction, pressure, 300e6)
    by_ellipse = friction - 2.0 * np.pi * a * b * 300e6 / (3.0 * force)
    np.testing.assert_allclose(by_ellipse, by_pressure, rtol=1e-12, atol=1e-14)


def test_surface_index_by_hand():
    """0.35 against 300/1000: 0.05 above the limit; at p0/k = 1/mu exactly on it."""
    result = surface_fatigue.surface_index(
        np.array([0.35, 0.3, 0.2]), np.array([1e9] * 3), 300e6
    )
    np.testing.assert_allclose(result, [0.05, 0.0, -0.1], atol=1e-15)


def test_subsurface_index_is_a_sixth_of_the_pressure_in_pure_rolling():
    force, a, b = 80e3, 6e-3, 5e-3
    pressure = 1.5 * force / (np.pi * a * b)
    result = surface_fatigue.subsurface_index(np.zeros(1), np.array([pressure]))
    assert result[0] == pytest.approx(force / (4.0 * np.pi * a * b), rel=1e-12)
    more = surface_fatigue.subsurface_index(np.array([0.4]), np.array([pressure]))
    assert more[0] == pytest.approx(pressure / 6.0 * 1.16, rel=1e-12)


def test_local_index_in_full_slip_is_the_index_of_the_patch(loads):
    """|tau| = mu p everywhere: the worst cell is that of the highest pressure, (mu p0 -
    k)/p0.
    """
    given = loads(5e6)
    fields = given.fields
    across = 1.0 - (given.y / 5e-3) ** 2
    pressure = np.broadcast_to(
        1.2e9 * np.sqrt(across)[:, None, :], fields.pressure.shape
    ).copy()
    fields = replace(fields, pressure=pressure, shear_x=-0.4 * pressure)
    cell_area = (fields.cell_length * fields.strip_width[:, None])[:, None, :]
    full = replace(
        given,
        fields=fields,
        normal_force=(pressure * cell_area).sum(axis=(1, 2)),
        force_x=(fields.shear_x * cell_area).sum(axis=(1, 2)),
        max_pressure=pressure.max(axis=(1, 2)),
    )
    patch = passage_damage(full, fatigue_settings("surface_fatigue_index"))
    local = passage_damage(full, fatigue_settings("surface_fatigue_index_local"))
    np.testing.assert_allclose(local.index, patch.index, rtol=1e-12)
    np.testing.assert_allclose(local.index, 0.4 - 300e6 / full.max_pressure, rtol=1e-12)
    np.testing.assert_allclose(
        np.abs(local.index_y), np.abs(given.y).min(axis=1), rtol=1e-12
    )
    stress = passage_damage(full, fatigue_settings("stress_index"))
    np.testing.assert_allclose(
        stress.index, 0.4 * full.max_pressure - 300e6, rtol=1e-12
    )
    np.testing.assert_allclose(stress.damage, stress.index / 300e6, rtol=1e-12)


def test_local_index_finds_the_cell_the_patch_does_not_show(loads):
    """One cell above k in a patch of little utilised friction; damage in its strip
    alone.
    """
    given = loads(0.0)
    given.fields.shear_x[:] = 0.0
    given.fields.shear_y[0, 4, 11] = 380e6
    given = replace(given, force_x=np.zeros(3))
    assert (
        passage_damage(given, fatigue_settings("surface_fatigue_index")).damage[0]
        == 0.0
    )
    local = passage_damage(given, fatigue_settings("surface_fatigue_index_local"))
    assert local.index[0] == pytest.approx(0.08)  # 80 MPa over 1 GPa
    assert local.index_y[0] == given.y[0, 11]
    assert np.flatnonzero(local.strip_damage[0]).tolist() == [11]
    assert local.damage[1:].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("result", "wear_number", "expected"),
    [
        (BURSTOW, 0.0, 0.0),
        (BURSTOW, 15.0, 0.0),
        (BURSTOW, 40.0, 5.0),
        (BURSTOW, 65.0, 10.0),
        (BURSTOW, 120.0, 5.0),
        (BURSTOW, 175.0, 0.0),
        (BURSTOW, 230.0, -5.0),
        (VARIANT, 20.0, 0.0),
        (VARIANT, 42.5, 5.0),
        (VARIANT, 65.0, 10.0),
        (VARIANT, 120.0, 5.0),
        (VARIANT, 175.0, 0.0),
        (VARIANT, 500.0, 0.0),
    ],
)
def test_break_points_of_the_whole_life_rail_model(result, wear_number, expected):
    assert wlrm.damage_function(np.array([wear_number]), result)[0] == pytest.approx(
        expected * 1e-6, abs=1e-18
    )


def test_slopes_of_the_variant_as_published():
    """+2.22e-7 and -9.09e-8 per N, to the last printed digit."""

    def slope(low, high):
        damage = wlrm.damage_function(np.array([low, high]), VARIANT)
        return (damage[1] - damage[0]) / (high - low)

    assert slope(25.0, 60.0) == pytest.approx(2.22e-7, abs=0.005e-7)
    assert slope(70.0, 170.0) == pytest.approx(-9.09e-8, abs=0.005e-8)


def test_rising_branch_stays_at_its_peak():
    number = np.array([0.0, 15.0, 40.0, 65.0, 175.0, 1e4])
    result = wlrm.damage_function(number, BURSTOW, "rising")
    np.testing.assert_allclose(
        result, np.array([0, 0, 5, 10, 10, 10]) * 1e-6, rtol=1e-12
    )


def test_shakedown_limit():
    """Landmarks of the map, 1/mu from 0.3 on, falling and continuous between; index
    zero on the limit.
    """
    friction = np.linspace(0.0, 0.6, 601)
    limit = shakedown.shakedown_limit(friction)
    assert limit[0] == 4.7
    np.testing.assert_allclose(limit[300:], 1.0 / friction[300:], rtol=1e-12)
    assert (np.diff(limit) < 0.0).all()
    assert np.abs(np.diff(limit)).max() < 0.012
    assert (limit[1:] * friction[1:] <= 1.0 + 1e-12).all()
    index = surface_fatigue.surface_index(friction[300:], 300e6 * limit[300:], 300e6)
    np.testing.assert_allclose(index, 0.0, atol=1e-12)


def test_curves_of_the_map_meet_and_say_how_sure_they_are():
    flow, join, rolling = shakedown.boundaries()
    assert (join.friction[-1], join.ratio[-1]) == (
        flow.friction[0],
        pytest.approx(flow.ratio[0]),
    )
    assert (flow.certainty, join.certainty) == ("recalled", "join")
    assert rolling.ratio.tolist() == [2.8, 2.8]


def test_utilised_friction_is_shear_over_normal_force(loads):
    given = loads(5e6)
    np.testing.assert_allclose(
        given.utilised_friction * given.normal_force, np.abs(given.force_x), rtol=1e-12
    )


def test_balance_names_what_ends_the_life_first():
    """By hand: 5 mm crack depth, 10 mm of wear; damage 1e-8 per m is balanced by 0.05
    um/km.
    """
    damage = np.array([1e-8, 1e-8, 1e-8, 0.0, 0.0])
    wear = np.array([0.0, 2e-11, 6e-11, 1e-10, 0.0])
    result = balance(damage, wear, crack_depth=5e-3, wear_limit=10e-3)
    np.testing.assert_allclose(
        result.magic_wear_rate, [5e-11, 5e-11, 5e-11, 0.0, 0.0], rtol=1e-12
    )
    np.testing.assert_allclose(
        result.crack_distance[:2], [1e8, 1.0 / 0.6e-8], rtol=1e-12
    )
    assert np.isinf(result.crack_distance[2:]).all()  # wear is faster
    np.testing.assert_allclose(
        result.wear_distance[1:4], [5e8, 10e-3 / 6e-11, 1e8], rtol=1e-12
    )
    assert [LIMITED_BY[k] for k in result.limited_by] == [
        "cracks",
        "cracks",
        "wear",
        "wear",
        "nothing",
    ]


def test_damage_with_removal_is_exact_for_constant_rates():
    """One step or a hundred, and never below zero: 1e-12."""
    start, added, worn = (
        np.array([0.2, 0.05]),
        np.array([0.3, 0.1]),
        np.array([1e-3, 2e-3]),
    )
    once = damage_after(start, added, worn, 5e-3)
    stepped = start
    for _ in range(100):
        stepped = damage_after(stepped, added / 100, worn / 100, 5e-3)
    np.testing.assert_allclose(once, [0.3, 0.0], rtol=1e-12, atol=0)
    np.testing.assert_allclose(stepped, once, rtol=1e-12, atol=1e-15)


def test_agreement_of_laws():
    """By hand: shares 1/3, 2/3 against 1/2, 1/2 have 5/6 in common."""
    result = agreement(
        {
            "a": np.array([1.0, 2.0, -4.0]),
            "b": np.array([5.0, 5.0, 0.0]),
            "c": np.zeros(3),
        }
    )
    np.testing.assert_allclose(result.normalised, [[0.5, 1, 0], [1, 1, 0], [0, 0, 0]])
    expected = [[1.0, 5 / 6, 0.0], [5 / 6, 1.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(result.overlap, expected, rtol=1e-12)
    weighted = agreement(
        {"a": np.array([1.0, 2.0]), "b": np.array([5.0, 5.0])}, np.array([2.0, 1.0])
    )
    assert weighted.overlap[0, 1] == pytest.approx(0.5 + 1 / 3)
    assert not normalised(np.array([-1.0, 0.0])).any()
