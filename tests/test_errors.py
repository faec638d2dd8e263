"""Errors of contact: the number of the operating point, its place, and the reason."""

import pickle

from wearsim.errors import NumericalError


def test_the_number_of_a_point_changes_with_the_batch():
    """Place, reason, wheel and kind stay; a copy for another process has them, too."""
    found = NumericalError("it does not converge", 1, 0, [1, 2])
    assert str(found) == "it does not converge"
    placed = found.of_point(17, [17, 18], place="right wheel, shift 6 mm")
    assert str(placed) == "point 17, right wheel, shift 6 mm: it does not converge"
    again = pickle.loads(pickle.dumps(placed.of_point(3, [3, 9])))
    assert str(again) == "point 3, right wheel, shift 6 mm: it does not converge"
    assert again.text == "right wheel, shift 6 mm: it does not converge"
    assert (again.row, again.side, again.rows) == (3, 0, (3, 9))
    assert isinstance(again, NumericalError)


def test_a_single_point_needs_no_number():
    placed = NumericalError("no contact", 0).of_point(
        0, [0], place="shift 6 mm", numbered=False
    )
    assert str(placed) == "shift 6 mm: no contact"
