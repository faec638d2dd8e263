"""Causes of factors: the committed report, its rows of points computed again."""

import pandas as pd
import pytest
import translation


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "translation.csv")


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "translation.csv").write_bytes(
        (reports / "translation.csv").read_bytes()
    )
    translation.main(["--from-csv", "--out", str(tmp_path)])
    written, text = (
        (folder / "translation.md").read_text() for folder in (tmp_path, reports)
    )
    assert written == text


def test_points_are_found_again(committed):
    """On other machines to 1e-6 of the load balance; the table has six digits."""
    found = pd.DataFrame(translation.points())
    rows = committed[committed["what"] == "point"]
    for name in ("factor", *translation.POWER_CAUSES):
        assert found[name].to_numpy() == pytest.approx(rows[name].to_numpy(), rel=1e-5)


def test_causes_of_campaigns_multiply(committed):
    rows = committed[committed["what"] == "campaign"].dropna(axis=1, how="all")
    whole = rows.pop("all causes: rig over field")
    causes = rows.drop(columns=["what", "radius_m", "way"])
    assert causes.prod(axis=1).to_numpy() == pytest.approx(
        whole.to_numpy(), rel=1e-4
    )  # six digits each
    # a larger roller is nearer to the rail, of new wheels and worn ones
    creepage = (
        rows["roller curvature: creepage"].groupby(rows["radius_m"]).agg(["min", "max"])
    )
    assert (creepage["min"].to_numpy()[:-1] > creepage["max"].to_numpy()[1:]).all()
