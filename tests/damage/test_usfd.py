import numpy as np
import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import highest_regime, patch_regime, usfd

SET = COEFFICIENT_SETS["lewis_dwyer_joyce_2004"]


def total(index):
    return float(usfd.wear_rate(np.array([index]), SET).sum())


@pytest.mark.parametrize(
    ("index", "expected"),
    [
        (1.0, 5.3),
        (4.3, 22.79),
        (10.4, 55.0),
        (41.0, 55.0),
        (77.2, 55.0),
        (121.0, 2766.22),
    ],
)
def test_wear_rate_as_printed(index, expected):
    """Published numbers to the last digit; 121 N/mm2 is the 20 % slip test of the twin
    discs.
    """
    assert total(index) == pytest.approx(expected, abs=0.005)


def test_jumps_at_the_regime_limits():
    """Written out: the printed plateau is 0.12 below the mild line's end; the third
    branch is continuous.
    """
    below, above = np.nextafter([10.4, 77.2], 0.0), np.nextafter([10.4, 77.2], np.inf)
    jumps = [total(b) - total(a) for a, b in zip(below, above, strict=True)]
    assert jumps == [pytest.approx(-0.12, abs=1e-9), pytest.approx(0.0, abs=1e-9)]


def test_regimes_share_no_index():
    index = np.array([-1.0, 0.0, 10.39, 10.4, 77.2, 77.21])
    rate = usfd.wear_rate(index, SET)
    assert rate.argmax(axis=0).tolist() == [0, 0, 0, 1, 1, 2]
    assert (rate > 0.0).sum(axis=0).tolist() == [0, 0, 1, 1, 1, 1]


def test_mild_regime_both_forms_agree(patches):
    """Two forms of one linear law, 1e-12; all indices, and so their mean, below 10.4
    N/mm2.
    """
    fields, area = patches(10.3e6)
    local = usfd.depth(fields, area, SET, form="local")
    mean = usfd.depth(fields, area, SET, form="patch_mean")
    assert local[0].max() > 0.0
    np.testing.assert_allclose(mean[0], local[0], rtol=1e-12, atol=1e-25)
    assert not local[1:].any()


def test_depth_of_one_strip_by_hand(patches):
    """Units: 5.3 ug/(m mm2) per N/mm2 over 10 mm at 2 N/mm2 in steel of 7850 kg/m3 is
    13.5 nm.
    """
    fields, area = patches(0.0)
    fields.work_density[0, :, 3] = 2e6
    fields.cell_length[0, 3] = 10e-3 / fields.work_density.shape[1]
    depth = usfd.depth(fields, area, SET)
    assert depth[0, 0, 3] == pytest.approx(5.3 * 2 * 1e-3 * 10e-3 / 7850.0, rel=1e-12)


def test_patch_mean_removes_the_volume_of_the_mean_index(patches):
    """Imposed, 1e-12: severe regime, volume per metre of rolling = K_w A / rho, spread
    as e(y).
    """
    fields, area = patches(60e6)
    depth = usfd.depth(fields, area, SET, form="patch_mean", density=8000.0)
    works = fields.strip_work.sum(axis=1) > 0.0
    mean = fields.strip_work.sum(axis=1) * fields.strip_width / area / 1e6
    assert works.any()
    assert ((mean[works] > 10.4) & (mean[works] < 77.2)).all()
    volume = depth[1].sum(axis=1) * fields.strip_width
    np.testing.assert_allclose(
        volume[works], 55.0e-3 * area[works] / 8000.0, rtol=1e-12
    )
    strip = int(np.argmax(works))
    share = depth[1, strip] / depth[1, strip].sum()
    np.testing.assert_allclose(
        share, fields.strip_work[strip] / fields.strip_work[strip].sum(), rtol=1e-12
    )


def test_patch_regime_is_the_one_that_removes_most():
    depth = np.zeros((3, 4, 5))
    depth[0, 0], depth[1, 0, 2] = 1.0, 4.0  # more mild strips, less severe depth
    depth[1, 1, 0], depth[2, 1, 1] = 1.0, 1.5
    depth[1, 2, 4] = 1e-12
    assert patch_regime(depth).tolist() == [0, 2, 1, -1]


def test_highest_regime_is_the_last_in_which_any_strip_wears():
    """Of the same depths: one strip is enough, however little it wears."""
    depth = np.zeros((3, 4, 5))
    depth[0, 0], depth[1, 0, 2] = 1.0, 1e-12
    depth[1, 1, 0], depth[2, 1, 1] = 1.0, 1e-9
    depth[0, 2, 4] = 1e-12
    assert highest_regime(depth).tolist() == [1, 2, 0, -1]


def test_one_severe_cell_makes_a_patch_severe_in_the_local_form_only(patches):
    """11 N/mm2 in one cell of a mild patch, the limit being 10.4; its mean stays far
    below.
    """
    fields, area = patches(5e6)
    fields.work_density[0, 12, 5] = 11e6
    for form, highest in (("local", 1), ("patch_mean", 0)):
        depth = usfd.depth(fields, area, SET, form=form)
        assert patch_regime(depth).tolist() == [0, 0, -1]
        assert highest_regime(depth).tolist() == [highest, 0, -1]


@pytest.mark.parametrize(
    ("slip", "heat", "expected", "friction", "name"),
    [
        (0.2, 1.3, "0.22", 0.09, "mild"),
        (0.5, 9.2, "1.5", 0.26, "mild"),
        (1.0, 25.7, "4.3", 0.36, "mild"),
        (3.0, 102.6, "17", 0.48, "severe"),
        (7.5, 246.0, "41", 0.46, "severe"),
        (10.0, 327.8, "55", 0.46, "severe"),
        (15.0, 492.1, "82", 0.46, "catastrophic"),
        (20.0, 728.4, "121", 0.51, "catastrophic"),
    ],
)
def test_regimes_of_the_twin_disc_tests(slip, heat, expected, friction, name):
    """Frictional heat of the programme behind the law (1500 MPa, 400 rpm, 47 mm discs
    of 10 mm, 6.1 mm2).

    T-gamma/A = Q / (U A) to half of its last digit; each test lies in its regime.
    """
    speed = 0.5 * 47e-3 * 400 * 2 * np.pi / 60
    assert speed == pytest.approx(0.984, abs=5e-4)
    index = heat / speed / 6.1
    decimals = len(expected.partition(".")[2])
    assert index == pytest.approx(float(expected), abs=0.5 * 10.0**-decimals)
    assert (
        usfd.REGIMES[int(usfd.wear_rate(np.array([index]), SET)[:, 0].argmax())] == name
    )
    load = (
        0.25 * np.pi * 1500e6 * 6.1e-6
    )  # line contact: mean pressure pi/4 of the largest
    assert heat / speed / (0.01 * slip) / load == pytest.approx(friction, abs=0.006)
