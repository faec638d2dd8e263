"""The committed comparison of local fields with CONTACT: two rows of it are computed
again.
"""

import half_space_fields
import pytest


@pytest.mark.parametrize("case", ["tread", "roller_two_lobes"])
def test_rows_of_the_committed_table(case, reports, same_numbers):
    """One in the last digit: the iteration stops at 3e-5 of the pressures."""
    *_, cells = half_space_fields.compared(half_space_fields.CONTACT.loc[case], case)
    row = " | ".join([half_space_fields.CASES[case][0], *cells])
    text = (reports / "half_space_fields.md").read_text()
    (line,) = (
        line
        for line in text.splitlines()
        if line.startswith(f"| {row.partition(' | ')[0]} |")
    )
    same_numbers(row, line.strip("| "), tolerance=1.01)
    assert float(cells[0]) < 0.6  # pressure
    assert float(cells[1]) < 5.1  # shear
