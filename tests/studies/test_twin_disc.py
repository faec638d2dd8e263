"""Twin discs: bodies of a few centimetres, from which laws of wear were measured."""

import numpy as np
import pandas as pd
import pytest

from wearsim.errors import ContactError
from wearsim.studies.contact_points import operating_points, solve_batch

TEST = {
    "wheel": "disc",
    "wheel_radius_mm": "23.5",
    "roller_radius_mm": "23.5",
    "inclination": "none",
    "normal_force_kN": "7.1",
    "friction": "0.45",
    "creepage": "0.01,0,0",
}


def solved(path, edge, ends="open"):
    """Disc 10 mm wide with ends given as points y, z [mm]."""
    inner = [(0.05 * k - 5.0, 0.0) for k in range(201)]
    points = [*((-y, z) for y, z in edge[::-1]), *inner, *edge]
    path.write_text("y,z\n" + "".join(f"{y:.3f},{z:.3f}\n" for y, z in points))
    given = pd.DataFrame([{**TEST, "rail": str(path), "rail_ends": ends}])
    points, faults = operating_points(given)
    assert faults == []
    return solve_batch(points.values)[1].patches.iloc[0]


@pytest.mark.parametrize("ends", ["open", "sharp"])
def test_discs_of_47_mm_touch_in_a_line(tmp_path, ends):
    """Line contact of Hertz: 1.49 GPa at 7.1 kN on 10 mm with radii of 23.5 mm, whose
    mean over the width is that of the patch to 3 %, as the edges carry more.
    """
    chamfer = [(5.0 + 0.05 * k, 0.05 * k) for k in range(1, 21)]
    edge = chamfer if ends == "open" else []
    patch = solved(tmp_path / "disc.csv", edge, ends)
    modulus = 210e9 / (2.0 * (1.0 - 0.3**2))
    line = np.sqrt(7.1e3 / 10e-3 * modulus / (np.pi * 0.5 * 23.5e-3))
    assert line == pytest.approx(1.49e9, rel=2e-3)
    mean = patch["normal_force"] / patch["area"]
    assert 4.0 / np.pi * mean == pytest.approx(line, rel=0.03)
    assert 1e3 * patch["width"] == pytest.approx(10.0, abs=0.1)
    assert patch["force_x"] == pytest.approx(-0.45 * 7.1e3, rel=0.05)


def test_a_disc_without_ends_is_named(tmp_path):
    with pytest.raises(ContactError, match="that ends there needs its chamfers"):
        solved(tmp_path / "disc.csv", [])
