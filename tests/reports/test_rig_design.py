"""Rig programmes by design: the committed report, and its targets."""

import numpy as np
import pandas as pd
import pytest
import rig_design


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "rig_design.csv").set_index(["radius_mm", "way"])


def test_the_report_is_what_its_table_says(reports, tmp_path):
    held = (reports / "rig_design.csv").read_bytes()
    (tmp_path / "rig_design.csv").write_bytes(held)
    rig_design.main(["--from-csv", "--out", str(tmp_path)])
    written = (tmp_path / "rig_design.md").read_text()
    assert written == (reports / "rig_design.md").read_text()


def test_accelerations_are_products_of_environment_and_mechanism(committed):
    product = committed["environment"] * committed["mechanism"]
    np.testing.assert_allclose(committed["acceleration"], product, rtol=1e-4)
    run = rig_design.DISTANCE / committed["rig_km"]
    np.testing.assert_allclose(committed["acceleration"], run, rtol=1e-4)


def test_programmes_are_nearer_and_faster_than_copies(committed):
    assert (committed["largest_error"] < committed["copy_error"]).all()
    assert (committed["acceleration"] > committed["copy_acceleration"]).all()


def test_without_guard_the_shipped_rig_meets_its_targets(committed):
    row = committed.loc[(1000.0, "no guard")]
    assert row["largest_error"] <= 0.06
    assert row["acceleration"] >= 50.0


def test_with_guard_the_shipped_rig_meets_its_targets(committed):
    assert committed.loc[(1000.0, "guard 1.5"), "acceleration"] >= 40.0


@pytest.mark.slow
@pytest.mark.parametrize("way", rig_design.WAYS)
def test_a_programme_of_the_report_computed_again(way, committed, tmp_path):
    row = rig_design.designed(rig_design.field_result(tmp_path), 1000.0, way)
    held = committed.loc[(1000.0, way)]
    assert row["largest_error"] == pytest.approx(held["largest_error"], rel=0.1)
    assert row["acceleration"] == pytest.approx(held["acceleration"], rel=0.1)
