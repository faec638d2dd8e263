"""Headers that contradict what their files are used as are reported."""

from dataclasses import replace
from pathlib import Path

import pytest

from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.inputs import axle_notes, comparison_notes, read_input
from wearsim.profile.measures import GaugeDistances

MEASURED = Path(__file__).parents[3] / "profiles" / "measured"


@pytest.fixture(scope="module")
def wheels():
    return [read_input(str(MEASURED / f"wheel_worn_{side}.whl")) for side in ("right", "left")]


@pytest.mark.parametrize("word", ["L", "%L", "left", "links"])
def test_sides_in_all_words(wheels, word):
    given = replace(wheels[0], header={"SIDE": word})
    assert len(axle_notes(given, given)) == 1


def test_wheels_on_the_wrong_side_are_told(wheels):
    right, left = wheels
    assert axle_notes(right, left) == ()
    first, second = axle_notes(left, right)
    assert first == f"used as the right wheel, but the header of {left.given} says Side = L"
    assert second == f"used as the left wheel, but the header of {right.given} says Side = R"
    assert axle_notes(read_input("S1002"), left) == ()


def test_another_wheel_is_told_in_a_comparison(wheels):
    right = wheels[0]
    assert comparison_notes(right, right) == comparison_notes(right, read_input("S1002")) == ()
    same = replace(right, header={**right.header, "CarNo": " 1 "})
    assert comparison_notes(right, same) == ()
    (note,) = comparison_notes(right, replace(right, header={**right.header, "CarNo": "2", "AxleNo": "7"}))
    assert note == "is it the same wheel? The headers differ: CarNo '1' against '2', AxleNo '2' against '7'"


def test_examinations_hold_these_notes(wheels):
    right, left = wheels
    at = Conditions(GaugeDistances())
    result = inspect_profile(left, at, left=right, against=right, amplitudes=(3e-3,), measure_reference=False)
    message = " ".join(result.given.notes)
    assert "used as the right wheel" in message
    assert "is it the same wheel?" in message
