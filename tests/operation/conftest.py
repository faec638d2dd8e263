import csv
from pathlib import Path

import numpy as np
import pytest

from wearsim.contact.solve import ContactModels, Counterface, Wheelset
from wearsim.profile import standard

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="session")
def bodies():
    """Factory of S1002 on 60E1 1:40, as the reference states have it, by the curvature
    of the counterface.
    """
    wheel = standard.wheel("S1002")
    rail = standard.rail("60E1", 1 / 40, 1.435, 0.75)
    return lambda curvature: (
        Wheelset(wheel, wheel, 0.46, 0.75),
        Counterface(rail, curvature),
    )


@pytest.fixture(scope="session")
def models():
    """The grid of the reference states: as many cells in large patches."""
    return ContactModels.of("fast", cell_size=1.0)


@pytest.fixture
def reference():
    """Columns of a table of reference states, by curvature of the counterface."""

    def read(name):
        with open(DATA / name) as file:
            rows = [
                {key: float(value) for key, value in row.items()}
                for row in csv.DictReader(file)
            ]
        found = {}
        for curvature in sorted({row["counterface_curvature_per_m"] for row in rows}):
            own = [
                row for row in rows if row["counterface_curvature_per_m"] == curvature
            ]
            found[curvature] = {
                key: np.array([row[key] for row in own]) for key in rows[0]
            }
        return found

    return read
