"""Answer of a comparison as text, on campaigns of known wear."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from wearsim.translation.compare import answers
from wearsim.translation.text import answer_lines, factor_tables, undefined_lines
from wearsim.translation.translate import table, translate

ENDS = {"rig": 60.0, "field": 90.0}


@pytest.fixture(scope="module")
def factors(rig, field):
    return translate(rig, field)


def lines_of(factors, answered=(), bands=()):
    rows = table(factors)
    return answer_lines(factors, rows, pd.DataFrame(bands), ENDS, dict(answered))


def test_the_first_lines_hold_the_answer(factors):
    """1 km on the rig wears 2.5 times as deep; the field ends at 0.72 mm."""
    first, second, *more = lines_of(factors)
    assert first.startswith(
        "1 km on the rig = 2.5 km in the field (equal depth 0.72 mm; "
    )
    assert second == "run: rig 60 km, field 90 km"
    head, depth, area = map(str.split, more)
    assert head[:2] == ["factor", "rig/field"]
    assert depth == ["largest", "depth", "2.5", "1", depth[-1]]
    assert area[-1] == "1"


def test_a_distance_has_an_answer_or_what_is_missing(factors, rig, field):
    """36 km of the rig wear as the 90 km of the field: 40 km on the rig lack 10 km."""
    found = [("rig", answers(rig, field, "rig", 20e3))]
    (line,) = (x for x in lines_of(factors, found) if x.startswith("20 km on the rig"))
    assert line.startswith("20 km on the rig = 50 km in the field by depth; ")
    found = [("rig", answers(rig, field, "rig", 40e3))]
    (line,) = (x for x in lines_of(factors, found) if x.startswith("40 km on the rig"))
    assert "by depth no answer: run the field about 10 km longer" in line
    found = [("field", answers(rig, field, "field", 100e3))]
    (line,) = (x for x in lines_of(factors, found) if x.startswith("100 km in the"))
    assert "by depth no answer: run the field 10 km longer" in line


def test_causes_are_one_product_the_largest_first(factors):
    names = ["wheel profile", "positions (shift and yaw)", "environment"]
    caused = factors.assign(
        cause_name=("cause", names),
        cause_factor=(("way", "cause"), np.array([[1.0, 1.0, 1.0], [1.001, 0.5, 5.0]])),
        rate_factor=("way", np.array([1.0, 2.5025])),
    )
    assert lines_of(caused)[-1] == (
        "causes: environment 5.00 x positions 0.50 = 2.5 (worn area per km at equal "
        "depth)"
    )


def test_bands_are_a_line_with_what_decides_them(factors):
    band = {
        "variable": "field_distance_per_rig_distance_band",
        "quantity": "field distance per rig distance of equal largest depth",
        "where": "up to 0.1 mm each",
        "5%": 11.6,
        "95%": 49.0,
        "decided by": "environment (0.85)",
    }
    lines = "\n".join(lines_of(factors, bands=[band]))
    assert "90 % of the draws: 11.6 to 49, field distance per rig" in lines
    assert "environment (0.85)" in lines


def test_campaigns_without_equal_wear_say_so(rig, field):
    still = field.copy(deep=True)
    for name in ("max_wear_depth", "worn_area", "wear_depth_by_regime"):
        still[name].values[:] = 0.0
    first = lines_of(translate(rig, still))[0]
    assert first.startswith("no equivalent distance: no equal wear of rig and field")


def test_undefined_factors_are_listed_with_their_reason(factors: xr.Dataset):
    rows = table(factors)
    text = " ".join(undefined_lines(rows))
    assert "no factor (zero denominator): " in text
    assert "lateral creepage" in text
    shown = factor_tables(rows)
    assert [len(frame) for frame in shown.values()] == [len(rows) // 3] * 3
