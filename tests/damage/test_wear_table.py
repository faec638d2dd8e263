import numpy as np
import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS, coefficient_set
from wearsim.damage.wear import WEAR_LAWS, WearSettings, passage_depth
from wearsim.damage.wear.table import rate_at
from wearsim.scene.wear_table import WearTableSection, read_wear_table, wear_table

STATED = {
    "source": "twin disc",
    "certainty": "measured",
    "interpolation": "linear",
    "beyond": "hold",
}
KTH = """\
# Regions of the wear map over sliding speed and pressure, as rows of a grid.
# source = map of jendel_2002, written as a table
# certainty = uncertain
# interpolation = step
# beyond = hold
# hardness_GPa = 3.0
slip_speed_m_s, pressure_MPa, wear_coefficient
0.0, 0, 5e-4
0.2, 0, 35e-4
0.7, 0, 5e-4
0.7, 2400, 350e-4
0.2, 2400, 350e-4
0.0, 2400, 350e-4
"""


def made(**columns):
    table, faults = wear_table(WearTableSection(**{**STATED, **columns}), "mine")
    assert not faults
    return table


@pytest.mark.parametrize("form", ["local", "patch_mean"])
@pytest.mark.parametrize("peak", [0.02e6, 0.3e6, 5e6])
def test_map_of_a_paper_written_as_a_table_is_the_law(tmp_path, form, peak, patches):
    """Archard's law with the KTH map as it jumps, 1e-12, in a CSV file with its rows in
    any order.
    """
    path = tmp_path / "kth.csv"
    path.write_text(KTH)
    table = read_wear_table(path)
    fields, area = patches(peak)
    fields.pressure[0, :, :5] = 2.5e9
    jumping = COEFFICIENT_SETS["jendel_2002"].with_value("speed_blend", 0.0, "test")
    law = WEAR_LAWS["archard"].depth(fields, area, jumping, form=form)
    depth = WEAR_LAWS["table"].depth(fields, area, table, form=form)
    np.testing.assert_allclose(depth[1], law.sum(axis=0), rtol=1e-12)
    assert not depth[[0, 2]].any()  # a step table holds by intention


@pytest.mark.parametrize("form", ["local", "patch_mean"])
def test_sheffields_law_as_a_table(tmp_path, form, patches):
    """Three straight branches, the last one going on; 0.2 % is the printed jump at 10.4
    N/mm2.
    """
    path = tmp_path / "usfd.toml"
    path.write_text(
        'source = "lewis_dwyer_joyce_2004"\ncertainty = "confirmed"\n'
        'interpolation = "linear"\nbeyond = "slope"\n'
        "T_gamma_A_N_mm2 = [0, 10.4, 77.2,\n  177.2]\n"
        "mass_rate_ug_m_mm2 = [0, 55, 55, 6245]\n"
    )
    table = read_wear_table(path)
    assert table.name == "usfd"
    fields, area = patches(250e6)
    law = WEAR_LAWS["usfd"].depth(
        fields, area, COEFFICIENT_SETS["lewis_dwyer_joyce_2004"], form=form
    )
    depth = WEAR_LAWS["table"].depth(fields, area, table, form=form)
    np.testing.assert_allclose(depth.sum(axis=0), law.sum(axis=0), rtol=0.0022)
    assert depth[2].any() == (form == "local")  # cells beyond 177.2 N/mm2, no mean


def test_two_level_law_as_a_table(patches):
    table = made(
        interpolation="step",
        power_density_W_mm2=[0, 4],
        energy_coefficient_mm3_kJ=[7e-10 / 7850 * 1e12, 21e-10 / 7850 * 1e12],
    )
    fields, area = patches(2e6)
    law = WEAR_LAWS["energy"].depth(fields, area, COEFFICIENT_SETS["zobory_1997"])
    np.testing.assert_allclose(
        WEAR_LAWS["table"].depth(fields, area, table)[1], law.sum(axis=0), rtol=1e-12
    )
    assert law[1].any()


@pytest.mark.parametrize(
    ("interpolation", "beyond", "below", "expected"),
    [
        ("linear", "hold", "hold", [10.0, 10.0, 15.0, 20.0, 20.0]),
        ("linear", "slope", "proportional", [5.0, 10.0, 15.0, 20.0, 30.0]),
        ("linear", "hold", "zero", [0.0, 10.0, 15.0, 20.0, 20.0]),
        ("step", "hold", "hold", [10.0, 10.0, 10.0, 20.0, 20.0]),
        ("step", "hold", "proportional", [5.0, 10.0, 10.0, 20.0, 20.0]),
        ("step", "hold", "zero", [0.0, 10.0, 10.0, 20.0, 20.0]),
    ],
)
def test_interpolation_as_stated(interpolation, beyond, below, expected):
    table = made(
        interpolation=interpolation,
        beyond=beyond,
        below=below,
        T_gamma_A_N_mm2=[1, 2],
        mass_rate_ug_m_mm2=[10, 20],
    )
    result = rate_at((np.array([0.5, 1.0, 1.5, 2.0, 3.0]) * 1e6,), table)
    np.testing.assert_allclose(result / 1e-3, expected, rtol=1e-12)
    assert table.validity.endswith(f"below the first {below}.")
    assert f"below the first {below}" in table.numbers


@pytest.mark.parametrize("form", ["local", "patch_mean"])
def test_wear_below_the_first_row_is_a_regime_of_its_own(form, patches):
    """One row above all indices: "proportional" is the line from the origin to it,
    1e-12, "hold" its rate.
    """
    fields, area = patches(0.3e6)
    row = {"T_gamma_A_N_mm2": [10.0], "mass_rate_ug_m_mm2": [50.0]}
    line = made(T_gamma_A_N_mm2=[0.0, 10.0], mass_rate_ug_m_mm2=[0.0, 50.0])
    depth = {
        below: WEAR_LAWS["table"].depth(
            fields, area, made(below=below, **row), form=form
        )
        for below in ("proportional", "hold", "zero")
    }
    for result in depth.values():
        assert not result[1:].any()
    expected = WEAR_LAWS["table"].depth(fields, area, line, form=form)
    assert expected[1].any()
    np.testing.assert_allclose(depth["proportional"][0], expected[1], rtol=1e-12)
    assert depth["hold"][0].sum() > 5.0 * depth["proportional"][0].sum()
    assert not depth["zero"].any()


def test_a_map_that_starts_above_zero_is_in_proportion_to_what_is_below():
    v, p = np.meshgrid([0.5, 2.0], [800.0, 1000.0], indexing="ij")
    keys = {
        "hardness_GPa": 3,
        "slip_speed_m_s": v.ravel().tolist(),
        "pressure_MPa": p.ravel().tolist(),
    }
    table = made(
        below="proportional", wear_coefficient=[1e-4, 2e-4, 3e-4, 4e-4], **keys
    )
    result = rate_at(
        (np.array([0.25, 0.25, 2.0]), np.array([1000e6, 400e6, 200e6])), table
    )
    np.testing.assert_allclose(result, [1e-4, 0.25e-4, 0.75e-4], rtol=1e-12)


def test_a_falling_slope_never_wears_less_than_nothing():
    table = made(
        beyond="slope",
        below="hold",
        T_gamma_A_N_mm2=[1, 2],
        mass_rate_ug_m_mm2=[20, 10],
    )
    assert rate_at((np.array([10e6]),), table) == [0.0]


def test_map_is_bilinear_between_its_rows():
    """Exact for a + b v + c p + d v p, 1e-12; held outside."""
    v, p = np.meshgrid([0.0, 0.5, 2.0], [0.0, 1000.0], indexing="ij")
    table = made(
        hardness_GPa=3,
        slip_speed_m_s=v.ravel().tolist(),
        pressure_MPa=p.ravel().tolist(),
        wear_coefficient=(1 + 2 * v + 3e-3 * p + 4e-3 * v * p).ravel().tolist(),
    )
    result = rate_at((np.array([0.3, 1.7, 9.0]), np.array([250e6, 900e6, 5e9])), table)
    expected = [1 + 0.6 + 0.75 + 0.3, 1 + 3.4 + 2.7 + 6.12, 1 + 4 + 3 + 8]
    np.testing.assert_allclose(result, expected, rtol=1e-12)


def test_nothing_wears_where_nothing_slides_whatever_the_first_row_says(patches):
    table = made(T_gamma_A_N_mm2=[0], mass_rate_ug_m_mm2=[7])
    fields, area = patches(1e6)
    depth = passage_depth(fields, area, WearSettings("table", table))
    assert depth[2, 0].any()  # beyond the only row
    assert not depth[:2].any()
    assert not depth[:, 2].any()


def test_table_states_its_source_and_validity():
    table = made(
        T_gamma_A_N_mm2=[0, 1], mass_rate_ug_m_mm2=[0, 5], validity="up to 1 N/mm2"
    )
    assert coefficient_set(table, "table") is table
    assert table.source == "twin disc"
    expected = (
        "up to 1 N/mm2 Certainty: measured. 2 rows, between them linear, beyond the "
        "last hold."
    )
    assert table.validity == expected
