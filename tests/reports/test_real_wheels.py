"""Worn and measured wheels: the committed report and its shortest row computed
again.
"""

import numpy as np
import pandas as pd
import pytest
import real_wheels
from real_wheels import (
    BY_LABEL,
    REPEATABLE,
    TOLERANCE,
    WHEELS,
    curvature,
    in_child,
    labels_of,
    noisy,
)


@pytest.mark.slow
def test_row_of_the_report(reports):
    """The shortest case, by the depth compilers may change and the target of the error
    of steps.
    """
    table = pd.read_csv(reports / "real_wheels.csv")
    (committed,) = table[
        (table["case"] == "rig66") & (table["distance_km"] == 20.0)
    ].to_dict("records")
    row = in_child("rig66_20km")
    assert row["end"] == committed["end"] == "reached"
    assert row["deepest_um"] == pytest.approx(committed["deepest_um"], rel=REPEATABLE)
    assert row["difference_percent"] < TOLERANCE
    assert committed["difference_percent"] < TOLERANCE


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "real_wheels.csv").write_bytes(
        (reports / "real_wheels.csv").read_bytes()
    )
    real_wheels.main(["--from-csv", "--out", str(tmp_path)])
    written, text = (
        (folder / "real_wheels.md").read_text() for folder in (tmp_path, reports)
    )
    assert written == text
    rows = pd.read_csv(reports / "real_wheels.csv")
    labels = labels_of(rows)
    assert len(set(labels)) == len(labels)
    assert set(labels) <= set(BY_LABEL)


def test_curvature_of_a_circle():
    """A parabola over 2 mm of a circle of 10 mm: its fourth-order term, under 1 %."""
    angle = np.linspace(-0.5, 0.5, 80)
    found = curvature(10e-3 * np.sin(angle), 10e-3 * np.cos(angle))
    np.testing.assert_allclose(found[20:-20], -100.0, rtol=0.01)


def test_noise_moves_heights_only():
    """Every point, by 10 µm rms to the spread of 536 samples (3 %), two of them at 3.3
    times that.
    """
    text = (WHEELS / "wheel_worn_right.whl").read_text()
    given, moved = (
        np.array([line.split() for line in one.split("\n\n")[1].splitlines()], float)
        for one in (text, noisy(text, np.random.default_rng(1)))
    )
    assert (given[:, 0] == moved[:, 0]).all()
    assert np.std(moved[:, 1] - given[:, 1]) == pytest.approx(10e-3, rel=0.1)
