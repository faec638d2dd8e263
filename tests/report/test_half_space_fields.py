"""The committed comparison of local fields with CONTACT: a row of it is computed again."""

import csv
import runpy
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.mark.parametrize("case", ["tread", "roller_two_lobes"])
def test_the_committed_table_is_what_the_script_finds(case):
    """One in the last digit: the iteration stops at 3e-5 of the pressures."""
    script = runpy.run_path(str(REPOSITORY / "reports/half_space_fields.py"), run_name="script")
    with (REPOSITORY / "tests/data/contact_rolling_fields.csv").open() as lines:
        rows = {row["case"]: row for row in csv.DictReader(line for line in lines if line[0] != "#")}
    row = {name: float(value) for name, value in rows[case].items() if name != "case"}
    *_, found = script["compared"](row, case)
    title = script["CASES"][case][0]
    (line,) = (
        line
        for line in (REPOSITORY / "reports/half_space_fields.md").read_text().splitlines()
        if line.startswith(f"| {title} |")
    )
    told = [cell.strip() for cell in line.split("|")[2:-1]]
    for cell, again in zip(told, found, strict=True):
        for one, other in zip(cell.split(", "), again.split(", "), strict=True):
            last = 10.0 ** -len(one.partition(".")[2])
            assert float(other) == pytest.approx(float(one), abs=1.01 * last)
    assert float(told[0]) < 0.6  # pressure
    assert float(told[1]) < 5.1  # shear
