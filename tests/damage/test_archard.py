from dataclasses import replace

import numpy as np
import pytest
from law_settings import wear_settings

from wearsim.contact.patch import Patch, SurfaceFields
from wearsim.contact.tangential import fastsim
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import archard, energy, passage_depth
from wearsim.damage.wear.sliding import relative_slip

SET = COEFFICIENT_SETS["jendel_2002"]
H = 3e9


def one_k(k):
    """Return the map with one coefficient everywhere."""
    result = SET
    for name in ("k_mild", "k_oxidative", "k_severe", "k_seizure"):
        result = result.with_value(name, k, "test")
    return result


@pytest.mark.parametrize(
    ("pressure", "speed", "region"),
    [
        (1e9, 0.0, "mild"),
        (1e9, 0.187, "mild"),
        (1e9, 0.21, "severe"),
        (1e9, 0.665, "severe"),
        (1e9, 0.75, "oxidative"),
        (1e9, 50.0, "oxidative"),
        (2.324e9, 0.3, "severe"),
        (2.475e9, 0.0, "seizure"),
        (2.475e9, 0.9, "seizure"),
    ],
)
def test_regions_of_the_map(pressure, speed, region):
    """Limits as printed with their blends: 0.2 and 0.7 m/s within 7 %, 0.8 H = 2.4 GPa
    +- 2.5 % of H.
    """
    part = archard.by_regime(np.array([pressure]), np.array([speed]), SET)[:, 0]
    assert np.count_nonzero(part) == 1
    assert archard.REGIMES[int(part.argmax())] == region
    assert part.max() == pytest.approx(SET[f"k_{region}"], rel=1e-12)


def test_coefficients_are_blended_over_the_limits_of_the_speed():
    """Over 5 % on both sides of a limit, by the mean of the jump, without a kink."""
    for limit, below, above in ((0.2, "mild", "severe"), (0.7, "severe", "oxidative")):
        logarithm = np.linspace(np.log(limit) - 0.1, np.log(limit) + 0.1, 20001)
        speed = np.exp(logarithm)
        part = archard.by_regime(np.full_like(speed, 1e9), speed, SET)
        k = part.sum(axis=0)
        first, last = SET[f"k_{below}"], SET[f"k_{above}"]
        assert (np.diff(k) * (last - first) >= 0.0).all()
        between = (k != k[0]) & (k != k[-1])
        assert np.ptp(logarithm[between]) == pytest.approx(2.0 * np.log(1.05), rel=0.01)
        jump = np.where(speed < limit, first, last)
        assert k.mean() == pytest.approx(jump.mean(), rel=1e-4)
        slope = np.gradient(k, logarithm)
        assert np.abs(np.diff(slope)).max() < 0.01 * np.abs(slope).max()
        shares = part[[archard.REGIMES.index(name) for name in (below, above)]] / k
        np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)
        # k of the shares: the logarithm is linear in them
        mean = shares[0] * np.log(first) + shares[1] * np.log(last)
        np.testing.assert_allclose(np.log(k), mean, rtol=1e-12)


def test_a_patch_has_the_same_bits_among_others():
    random = np.random.default_rng(3)
    pressure, speed = (
        random.uniform(1e9, 2.6e9, (37, 30, 31)),
        random.uniform(0.1, 0.8, (37, 30, 31)),
    )
    whole = archard.by_regime(pressure, speed, SET)
    for k in (0, 5, 36):
        np.testing.assert_array_equal(
            archard.by_regime(pressure[k], speed[k], SET), whole[:, k]
        )


def test_parts_are_never_negative_where_limits_of_the_speed_are_near_to_each_other():
    near = SET.with_value("oxidative_speed", 0.203, "test")
    part = archard.by_regime(np.full(1001, 1e9), np.linspace(0.15, 0.25, 1001), near)
    assert (part >= 0.0).all()


def test_without_blend_a_limit_of_the_speed_belongs_to_the_region_above():
    jumping = SET.with_value("speed_blend", 0.0, "test")
    for limit, below, above in ((0.2, "mild", "severe"), (0.7, "severe", "oxidative")):
        for speed, region in ((np.nextafter(limit, 0.0), below), (limit, above)):
            part = archard.by_regime(np.array([1e9]), np.array([speed]), jumping)[:, 0]
            assert archard.REGIMES[int(part.argmax())] == region
            assert np.count_nonzero(part) == 1


def test_jumps_of_the_map():
    """Written out: up 7 times at 0.2 m/s, down 7 times at 0.7 m/s, up 70 times at 0.8 H
    without a blend.
    """
    k = np.array([SET[f"k_{name}"] for name in archard.REGIMES])

    def at(pressure, speed, blend=0.05):
        with_blend = SET.with_value("seizure_blend", blend, "test").with_value(
            "speed_blend", 0.0, "test"
        )
        return archard.by_regime(
            np.atleast_1d(pressure), np.array([speed]), with_blend
        ).sum(axis=0)

    for limit, jump in ((0.2, 7.0), (0.7, 1 / 7)):
        assert at(1e9, limit) / at(1e9, np.nextafter(limit, 0)) == pytest.approx(jump)
    assert at(2.4e9, 0.1, 0.0) / at(np.nextafter(2.4e9, 0), 0.1, 0.0) == pytest.approx(
        70.0
    )
    # the blend: half way at 0.8 H, as much on average as the jump, without a kink at
    # its ends
    pressure = np.linspace(2.3e9, 2.5e9, 2001)
    blended = at(pressure, 0.1)
    assert at(2.4e9, 0.1) == pytest.approx(0.5 * (k[0] + k[3]))
    assert blended.mean() == pytest.approx(at(pressure, 0.1, 0.0).mean(), rel=1e-3)
    assert (
        np.abs(np.diff(blended, 2)).max()
        < 1.01 * 6.0 * (k[3] - k[0]) * (1e5 / 1.5e8) ** 2
    )


def test_depth_of_one_cell_by_hand(patches):
    """k p s / (V H): 5e-4 of 1 GPa sliding 1 mm per metre over a cell of 10 mm in 3 GPa
    is 1.667 nm.
    """
    fields, area = patches(0.0)
    fields.cell_length[0, 3] = 10e-3
    fields.slip_x[0, 9, 3] = 1e-3
    fields.work_density[0, 9, 3] = 3e8 * 1e-3
    fields.shear_x[0, 9, 3] = -3e8
    fields.speed[:] = 20.0  # 0.02 m/s
    depth = archard.depth(fields, area, SET)
    assert depth[0, 0, 3] == pytest.approx(5e-4 * 1e9 * 1e-3 * 10e-3 / H, rel=1e-12)
    assert np.count_nonzero(depth) == 1
    fields.speed[:] = 300.0  # 0.3 m/s: the same creepage, another regime
    assert archard.depth(fields, area, SET)[2, 0, 3] == pytest.approx(
        7 * depth[0, 0, 3], rel=1e-12
    )


def test_archard_is_the_energy_law_cell_by_cell_where_coulombs_bound_is_reached(
    patches,
):
    """Two forms of one law, 1e-12: k_e = k / (mu H) with |tau| = 0.3 p in every
    slipping cell.
    """
    fields, area = patches(40e6)
    fields = replace(
        fields, work_density=0.83 * fields.work_density
    )  # scaled to some resultant power
    slips = fields.slip_x > 0.0
    assert slips.any()
    np.testing.assert_allclose(
        (fields.pressure * relative_slip(fields))[slips],
        fields.work_density[slips] / 0.3,
        rtol=1e-12,
    )
    by_energy = energy.constant(5e-4 / (0.3 * H), "test")
    for form in ("local", "patch_mean"):
        sliding = archard.depth(fields, area, one_k(5e-4), form=form).sum(axis=0)
        work = energy.depth(fields, area, by_energy, form=form).sum(axis=0)
        np.testing.assert_allclose(sliding, work, rtol=1e-12)


def rolled(cells, creepage, friction=0.35):
    """Return fields of an ellipse of 6 x 4 mm under 1 GPa by FASTSIM."""
    strips = 40
    edge = np.linspace(-4e-3, 4e-3, strips + 1)
    y = 0.5 * (edge[1:] + edge[:-1])[None]
    half = 6e-3 * np.sqrt(1 - (y / 4e-3) ** 2)
    patch = Patch(
        np.zeros(1, dtype=np.int64),
        y,
        np.array([8e-3 / strips]),
        half,
        -half,
        np.full_like(y, 1e9 / 6e-3),
        0 * y,
        np.array([strips]),
        np.array([cells]),
    )
    solution = fastsim.solve(
        patch,
        np.array([creepage]),
        np.array([friction]),
        shear_modulus=81e9,
        poisson_ratio=0.3,
        fields=True,
    )
    pressure, shear_x, shear_y, slip_x, slip_y = solution.cells
    return SurfaceFields(
        pressure,
        shear_x,
        shear_y,
        slip_x,
        slip_y,
        -(shear_x * slip_x + shear_y * slip_y),
        half,
        2 * half / cells,
        patch.width,
        np.array([20.0]),
    ), patch.area


@pytest.mark.parametrize(
    "creepage", [(1e-3, 0.0, 0.0), (2e-3, -1e-3, 0.0), (1e-3, 1e-3, 0.3)]
)
def test_archard_is_the_energy_law_on_a_partially_slipping_patch(creepage):
    """FASTSIM: the cell where slip sets in holds half the traction of its end; first
    order in the cells.
    """
    by_energy = energy.constant(5e-4 / (0.35 * H), "test")
    cells = np.array([50, 100, 200, 400])
    error = []
    for count in cells:
        fields, area = rolled(count, creepage)
        assert 0.1 < (relative_slip(fields) > 0.0).mean() < 0.95
        sliding = archard.depth(fields, area, one_k(5e-4)).sum()
        work = energy.depth(fields, area, by_energy).sum()
        error.append(abs(sliding / work - 1.0))
    assert error[0] < 0.03
    assert np.polyfit(np.log(cells), np.log(error), 1)[0] < -0.9


def test_both_forms_agree_in_one_region(patches):
    fields, area = patches(1e6)  # slip up to 0.0033
    fields.speed[:] = 5.0
    local = archard.depth(fields, area, SET)
    np.testing.assert_allclose(
        archard.depth(fields, area, SET, form="patch_mean"),
        local,
        rtol=1e-12,
        atol=1e-25,
    )
    assert local[0].any()
    assert not local[1:].any()


def test_patch_mean_takes_the_region_of_mean_pressure_and_mean_speed(patches):
    fields, area = patches(1e6)
    mean = (
        (fields.pressure * relative_slip(fields)).sum(axis=1) * fields.cell_length
    ).sum(axis=1) / (fields.pressure.sum(axis=1) * fields.cell_length).sum(axis=1)
    fields.speed[:] = 0.3 / mean[0]  # severe in the first patch, whatever the cells do
    depth = archard.depth(fields, area, SET, form="patch_mean")
    assert [bool(each.any()) for each in depth[:, 0]] == [False, False, True, False]


def test_seizure_is_told_and_can_be_capped(patches):
    """5e-4 against 350e-4: of the pressure capped at 2.4 GPa, depth falls by 2.4/2.6
    besides.
    """
    fields, area = patches(1e6)
    fields.speed[:] = 5.0
    fields.pressure[0] = 2.6e9
    fields.work_density[0] *= 2.6
    fields.shear_x[0] *= 2.6
    printed = passage_depth(fields, area, wear_settings("archard"))
    assert printed[3, 0].any()
    assert not printed[:3, 0].any()
    volume = (printed.sum(axis=2) * fields.strip_width).sum(axis=1)
    assert 0.9 < volume[3] / volume.sum() < 1.0
    by_regime = passage_depth(
        fields, area, wear_settings("archard", seizure_cap="regime")
    )
    np.testing.assert_allclose(by_regime[0, 0] * 70.0, printed[3, 0], rtol=1e-12)
    assert not by_regime[3].any()
    by_pressure = passage_depth(
        fields, area, wear_settings("archard", seizure_cap="pressure")
    )
    np.testing.assert_allclose(
        by_pressure[0, 0], by_regime[0, 0] * 2.4 / 2.6, rtol=1e-12
    )
    np.testing.assert_allclose(by_pressure[:, 1:], printed[:, 1:], rtol=1e-12)


def test_without_friction_the_slip_of_the_model_acts(patches):
    fields, _ = patches(0.0)
    still = replace(
        fields, shear_x=0 * fields.shear_x, slip_x=fields.pressure * 0 + 2e-3
    )
    np.testing.assert_array_equal(relative_slip(still), 2e-3)
