"""Rig programmes by design: the committed report, and its targets."""

import numpy as np
import pandas as pd
import pytest
import rig_design


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "rig_design.csv")


@pytest.fixture(scope="module")
def long_target(committed):
    """Rows of the acceptance by way."""
    rows = committed[committed["field_km"] == rig_design.DISTANCE]
    return rows.set_index("way")


def test_the_report_is_what_its_table_says(reports, tmp_path):
    held = (reports / "rig_design.csv").read_bytes()
    (tmp_path / "rig_design.csv").write_bytes(held)
    rig_design.main(["--from-csv", "--out", str(tmp_path)])
    written = (tmp_path / "rig_design.md").read_text()
    assert written == (reports / "rig_design.md").read_text()


def test_accelerations_are_products_of_environment_and_mechanism(committed):
    committed = committed[committed["fault"].isna()]
    product = committed["environment"] * committed["mechanism"]
    np.testing.assert_allclose(committed["acceleration"], product, rtol=1e-4)
    run = committed["field_km"] / committed["rig_km"]
    np.testing.assert_allclose(committed["acceleration"], run, rtol=1e-4)


def test_rows_are_those_of_the_script(committed):
    keys = committed[["field", "field_km", "radius_mm", "way", "variant"]]
    found = {tuple(row) for row in keys.fillna("").itertuples(index=False)}
    assert found == set(rig_design.cases())


def test_the_long_programmes_are_nearer_than_copies_and_five_times_as_fast(long_target):
    for copy in ("copy", "copy_forces"):
        assert (long_target["largest_error"] < long_target[f"{copy}_error"]).all()
        five = 5.0 * long_target[f"{copy}_acceleration"]
        assert (long_target["acceleration"] > five).all()


def test_without_guard_the_shipped_rig_meets_its_targets(long_target):
    row = long_target.loc["no guard"]
    assert row["largest_error"] <= 0.06
    assert row["acceleration"] >= 50.0


def test_with_guard_the_shipped_rig_meets_its_targets(long_target):
    assert long_target.loc["guard 1.5", "acceleration"] >= 40.0


@pytest.mark.slow
def test_the_long_programme_meets_its_targets_computed_again(long_target, tmp_path):
    held = long_target.loc["no guard"]
    result = rig_design.field_result(tmp_path)
    row = rig_design.designed(result, "given", rig_design.DISTANCE, 1000.0, "no guard")
    assert row["largest_error"] <= 0.06
    assert row["acceleration"] >= 50.0
    assert row["acceleration"] == pytest.approx(held["acceleration"], rel=0.1)
