"""Published values: the committed table, and its cheap rows computed again."""

import numpy as np
import pandas as pd
import pytest
import validation


@pytest.fixture(scope="module")
def committed(reports):
    return pd.read_csv(reports / "validation.csv", dtype=str).set_index("key")


def numbers(text):
    return np.array([float(part) for part in text.split(",")])


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "validation.csv").write_bytes((reports / "validation.csv").read_bytes())
    validation.main(["--from-csv", "--out", str(tmp_path)])
    assert (tmp_path / "validation.md").read_text() == (
        reports / "validation.md"
    ).read_text()


def test_every_row_says_what_it_proves_and_what_not(committed):
    assert set(committed.index) == set(validation.ROWS)
    assert all(row.proves and row.not_proved for row in validation.ROWS.values())


@pytest.mark.parametrize(
    "compute",
    [validation.of_paper, validation.of_creep_curve, validation.of_laws],
    ids=["paper and CONTACT", "creep forces", "laws"],
)
def test_cheap_rows_are_computed_again(committed, compute):
    for key, published, own in compute():
        assert committed.loc[key, "published"] == published
        # printed digits
        assert numbers(committed.loc[key, "wearsim"]) == pytest.approx(
            numbers(own), rel=2e-3
        )


def test_laws_give_what_was_published(committed):
    """Imposed: the coefficients are those quoted."""
    for key in ("brr", "wlrm"):
        row = committed.loc[key]
        assert numbers(row["wearsim"]) == pytest.approx(numbers(row["published"]))


def test_slopes_of_creep_curves_are_kalkers(committed):
    """2.5 %: those of twelve strips of eight points, see `test_coupled_strips`."""
    for key in ("kalker_C11", "kalker_C22", "kalker_C23"):
        row = committed.loc[key]
        assert numbers(row["wearsim"]) == pytest.approx(
            numbers(row["published"]), rel=0.025
        )


def test_cracks_begin_where_they_were_observed(committed):
    """Molyneux-Berry & Bevan: field side, sharp curves with the other wheel in flange
    contact, not moderate ones. The surface ratchets at R 300 and 500 m, beyond 10 mm
    from the running circle on the field side, and not at R 1000 and 2500 m.
    """
    inner, outer = committed.loc["rcf_field_side", "wearsim"].split("; outer wheel ")
    index, place = inner.split(" at y = ")
    assert (numbers(index) > 0.0).tolist() == [True, True, False, False]
    assert (numbers(place)[:2] > 10.0).all()
    # the report says that the flange root of the outer wheel has the larger index
    assert (numbers(outer) > numbers(index)).all()


def test_leading_wheelsets_carry_more_traction_than_trailing_ones(committed):
    """Wheel impact detectors: more shelling on wheelsets that lead."""
    leading, trailing = numbers(committed.loc["rcf_leading", "wearsim"])
    assert leading > 1.2 * trailing


@pytest.mark.slow
def test_curves_of_the_coach_are_computed_again(committed, tmp_path):
    """What the committed table says of cracks and rails, to its printed digits; the
    outer wheel of sharp curves is in flange contact.
    """
    data = validation.run(validation.coach(), tmp_path / "coach")
    for key, published, own in validation.of_curves(data):
        assert committed.loc[key, "published"] == published
        assert committed.loc[key, "wearsim"] == own
    outer = [
        validation.worst(data, f"R {radius} leading", 1).angle for radius in (300, 500)
    ]
    # the flange root: the tread of the new wheel has less than 6 degrees
    assert min(np.degrees(outer)) > 20.0
