"""Vehicles in curves: the committed report, its rows of one vehicle computed again."""

import operation
import pandas as pd
import pytest


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "operation.csv")


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "operation.csv").write_bytes((reports / "operation.csv").read_bytes())
    operation.main(["--from-csv", "--out", str(tmp_path)])
    assert (tmp_path / "operation.md").read_text() == (
        reports / "operation.md"
    ).read_text()


def test_axles_in_curves_are_found_again(committed):
    """To the balance of forces, 1e-5 of the axle load, which moves an axle on the tread
    by some um.
    """
    found = pd.DataFrame(operation.curves(("freight_wagon",)))
    rows = committed[committed["vehicle"] == "freight_wagon"]
    for name in ("shift_mm", "yaw_mrad"):
        assert found[name].to_numpy() == pytest.approx(rows[name].to_numpy(), abs=2e-3)
    for name in ("wear_number_N", "rig_wear_number_N"):
        assert found[name].to_numpy() == pytest.approx(rows[name].to_numpy(), rel=5e-3)


def test_stiffer_axles_attack_and_wear_more(committed):
    """By yaw stiffness in sharp curves; and on straight track the bounds lie on both
    sides of held axles.
    """
    sharp = committed[
        (committed["radius_m"] == 400.0) & (committed["axle"] == "leading")
    ].set_index("vehicle")
    order = ["freight_wagon", "regional_multiple_unit", "passenger_coach", "locomotive"]
    assert sharp.loc[order, "yaw_mrad"].is_monotonic_decreasing
    assert sharp.loc[order, "wear_number_N"].is_monotonic_increasing
    area = committed[committed["what"] == "campaign"].set_index("name")["area_mm2"]
    assert area["kinematic"] < area["suspended"] < area["guided"]
