import numpy as np
import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import brr, energy

MM3_KJ = 1e-12
PRINTED = COEFFICIENT_SETS["pearce_sherratt_1991"]
CONTINUOUS = COEFFICIENT_SETS["pearce_sherratt_1991_continuous"]


def slope(result, branch):
    """Volume per frictional work of a straight branch at a friction of 0.45 [m3/J],
    from printed units.
    """
    law = result.laws[0]
    if law == "usfd":  # ug/(m mm2) per N/mm2 over the density
        return 1e-9 / 7850.0 * result[f"{branch}_slope"]
    if law == "brr":  # mm2/km times mm per N, on the circumference
        return np.pi * 1e-12 * result[f"{branch}_slope"]
    if law == "archard":
        return result[f"k_{branch}"] / (0.45 * 1e9 * result["hardness"])
    return energy.volume_per_work(result, branch, 7850.0)


@pytest.mark.parametrize(
    ("name", "branch", "expected", "archard", "digits"),
    [
        ("lewis_dwyer_joyce_2004", "mild", 0.675, 9.1e-4, (5e-4, 0.05e-4)),
        ("pearce_sherratt_1991", "mild", 0.785, 10.6e-4, (5e-4, 0.05e-4)),
        ("jendel_2002", "severe", 2.6, 35e-4, (0.05, 1e-9)),
        ("pearce_sherratt_1991", "severe", 3.74, None, (5e-3, None)),
        ("lewis_dwyer_joyce_2004", "catastrophic", 7.9, None, (0.05, None)),
        ("zobory_1997", "mild", 0.089, 1.2e-4, (5e-4, 0.05e-4)),
        ("zobory_1997", "severe", 0.27, 3.6e-4, (5e-3, 0.05e-4)),
    ],
)
def test_coefficients_of_all_laws_compared(name, branch, expected, archard, digits):
    """Cross-comparison at mu = 0.45, H = 3 GPa, to its last digit."""
    result = slope(COEFFICIENT_SETS[name], branch)
    assert result / MM3_KJ == pytest.approx(expected, abs=digits[0])
    if archard is not None:
        assert result * 0.45 * 3e9 == pytest.approx(archard, abs=digits[1])


def test_range_of_archards_mild_regime():
    """0.074 to 0.74 mm3/kJ over the printed range of k."""
    result = COEFFICIENT_SETS["jendel_2002"]
    limits = result.values["k_mild"].limits
    ends = [
        slope(result.with_value("k_mild", end, "end of its range"), "mild") / MM3_KJ
        for end in limits
    ]
    assert ends == pytest.approx([0.074, 0.74], abs=0.0051)


def test_mild_regimes_of_two_independent_laws_agree():
    """USFD and BRR within 15 % (of the larger), from independent tests."""
    usfd = slope(COEFFICIENT_SETS["lewis_dwyer_joyce_2004"], "mild")
    other = slope(PRINTED, "mild")
    assert abs(usfd / other - 1.0) < 0.15


@pytest.mark.parametrize(
    ("wear_number", "expected"),
    [
        (0.0, 0.0),
        (10.0, 2.5),
        (40.0, 10.0),
        (99.0, 24.75),
        (100.0, 25.0),
        (150.0, 25.0),
        (200.0, 25.0),
        (201.0, 85.19),
        (300.0, 203.0),
        (500.0, 441.0),
    ],
)
def test_brr_as_printed(wear_number, expected):
    """0.25 T-gamma, 25 and 1.19 T-gamma - 154 mm2/km over the diameter in mm."""
    assert brr.area_loss(np.array([wear_number]), PRINTED).sum() == pytest.approx(
        expected, abs=1e-9
    )


@pytest.mark.parametrize(("result", "jump"), [(PRINTED, 59.0), (CONTINUOUS, 0.0)])
def test_jumps_of_brr(result, jump):
    """Written out: as quoted the loss jumps from 25 to 84 at 200 N; at 100 N it is
    continuous.
    """

    def at(wear_number):
        return float(brr.area_loss(np.array([wear_number]), result).sum())

    assert at(np.nextafter(200, 300)) - at(200.0) == pytest.approx(jump, abs=1e-9)
    assert at(100.0) - at(np.nextafter(100, 0)) == pytest.approx(0.0, abs=1e-9)


def test_brr_removes_its_volume_whatever_the_diameter(patches):
    """Imposed, 1e-12: area loss x pi D, per metre 0.25 pi T-gamma mm3/km; spread as
    e(y).
    """
    fields, area = patches(2e6)
    depth = brr.depth(fields, area, PRINTED)
    wear_number = fields.strip_work.sum(axis=1) * fields.strip_width
    assert (wear_number[:2] < 100.0).all()
    diameter, km = 920.0, 1e6  # [mm]
    volume = np.pi * diameter * 0.25 * wear_number / diameter  # [mm3/km]
    np.testing.assert_allclose(
        depth[0].sum(axis=1) * fields.strip_width,
        volume * 1e-9 / (km * 1e-3),
        rtol=1e-12,
    )
    share = depth[0, 0] / depth[0, 0].sum()
    np.testing.assert_allclose(
        share, fields.strip_work[0] / fields.strip_work[0].sum(), rtol=1e-12
    )


def test_constant_energy_law_removes_volume_in_proportion_to_work(patches):
    """Imposed, 1e-12: integral of the depth = k_e x integral of e = k_e x power /
    speed.
    """
    fields, area = patches(30e6)
    for form in ("local", "patch_mean"):
        depth = energy.depth(
            fields, area, energy.constant(0.7 * MM3_KJ, "test"), form=form
        )
        np.testing.assert_allclose(
            depth[0], 0.7 * MM3_KJ * fields.strip_work, rtol=1e-12
        )
        assert not depth[1].any()


def test_two_level_law_switches_at_its_power_density(patches):
    """Zobory: 4 W/mm2 at 20 m/s is a work density of 0.2 N/mm2; three times the wear
    from there on.
    """
    result = COEFFICIENT_SETS["zobory_1997"]
    fields, area = patches(0.0)
    fields.work_density[0, :2, 3] = np.nextafter(0.2e6, 0.0), 0.2e6
    fields.slip_x[0, :2, 3] = 1e-3
    depth = energy.depth(fields, area, result, density=7000.0)
    cell = 0.2e6 * fields.cell_length[0, 3]
    assert depth[0, 0, 3] == pytest.approx(7e-10 / 7000.0 * cell, rel=1e-12)
    assert depth[1, 0, 3] == pytest.approx(21e-10 / 7000.0 * cell, rel=1e-12)
    fields.speed[:] = 10.0  # half the speed: mild throughout
    assert not energy.depth(fields, area, result)[1].any()


def test_two_level_law_on_the_mean_of_the_patch(patches):
    result = COEFFICIENT_SETS["krause_poll_1986"]
    assert energy.power_limit(result) == 4e6
    fields, area = patches(3e6)
    mean = fields.strip_work.sum(axis=1) * fields.strip_width / area
    fields.speed[:] = [3.9e6 / mean[0], 4.1e6 / mean[1], 20.0]
    depth = energy.depth(fields, area, result, form="patch_mean")
    np.testing.assert_allclose(depth[0, 0], 9.87e-14 * fields.strip_work[0], rtol=1e-12)
    np.testing.assert_allclose(depth[1, 1], 2.96e-13 * fields.strip_work[1], rtol=1e-12)
    assert not depth[1, 0].any()
    assert not depth[0, 1].any()
