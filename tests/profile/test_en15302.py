"""All five benchmark pairs of EN 15302 against the values published with them."""

import csv
from pathlib import Path

import numpy as np
import pytest

from wearsim.profile.conicity import (
    equivalent_conicity,
    rolling_radius_difference,
    running,
)
from wearsim.profile.standard import definition, evaluate, rail, wheel

DATA = Path(__file__).parents[1] / "data"
# Shifts [mm] at which an edge or a jump of curvature carries the contact: there the
# place of the smallest gap is found to half a step of 0.05 mm, on slopes of up to 0.29.
ON_EDGES = {"A": (3.0,), "B": (6.9,), "C": (9.4,), "I": (5.0, 6.5)}


def table(name, wheel_name):
    """Rows of one wheel as numbers."""
    lines = [
        line
        for line in (DATA / name).read_text().splitlines()
        if line[:1] in "ABCHI" and line[1:2] == ","
    ]
    return np.array(
        [
            [float(v) for v in line.split(",")[1:]]
            for line in lines
            if line[0] == wheel_name
        ]
    )


@pytest.fixture(scope="module")
def rail_a():
    """Benchmark rail with points fine enough for its jumps of curvature."""
    return rail("EN15302_rail_A", 0.0, 1.435, 0.750, spacing=0.05e-3)


@pytest.mark.parametrize("letter", "ABCHI")
def test_radius_difference_is_the_published_one(letter, rail_a):
    """0.5 um of the published digits and 0.3 um of the grid; 8 um on edges."""
    shift, published = table("profile_en15302_delta_r.csv", letter).T
    profile = wheel(f"EN15302_{letter}", spacing=0.05e-3)
    result = rolling_radius_difference(profile, profile, rail_a)(shift * 1e-3) * 1e3
    edge = np.isin(shift, ON_EDGES.get(letter, ()))
    assert len(shift) > 15
    assert np.max(np.abs(result - published)[~edge]) < 0.8e-3
    assert np.max(np.abs(result - published)) < 8e-3
    back = rolling_radius_difference(profile, profile, rail_a)(-shift * 1e-3) * 1e3
    assert back == pytest.approx(-result, abs=1e-9)


def _conicity_cases():
    for letter in "ABCHI":
        for amplitude, published, _ in table("profile_en15302_conicity.csv", letter):
            yield pytest.param(
                letter, amplitude, published, id=f"{letter}-{amplitude:g}"
            )


@pytest.mark.parametrize(("letter", "amplitude", "published"), list(_conicity_cases()))
def test_conicity_is_within_the_tolerance_of_the_standard(
    letter, amplitude, published, rail_a
):
    """EN 15302 asks for 0.05 or half the value, whichever is less."""
    profile = wheel(f"EN15302_{letter}")
    result = equivalent_conicity(profile, profile, rail_a, amplitude=amplitude * 1e-3)
    assert abs(result - published) < min(0.05, 0.5 * published)


@pytest.mark.parametrize("letter", "AC")
def test_conicity_without_jumps_is_published_to_its_last_digit(letter, rail_a):
    """0.0005 are the digits, 0.0004 the grid; the contact of B, H and I jumps within
    the amplitudes.
    """
    profile = wheel(f"EN15302_{letter}")
    for amplitude, published, own in table("profile_en15302_conicity.csv", letter):
        result = equivalent_conicity(
            profile, profile, rail_a, amplitude=amplitude * 1e-3
        )
        assert result == pytest.approx(published, abs=0.0009)
        assert result == pytest.approx(own, abs=0.0004)


@pytest.mark.parametrize(
    ("letter", "farthest"), [("B", 0.0016), ("H", 0.0014), ("I", 0.0008)]
)
def test_conicity_a_millimetre_behind_a_jump(letter, farthest, rail_a):
    """A jump still tells in the third digit a millimetre later."""
    profile = wheel(f"EN15302_{letter}")
    later = [
        row
        for row in table("profile_en15302_conicity.csv", letter)
        if row[0] >= (3 if letter == "I" else 4)
    ]
    assert len(later) >= 3
    for amplitude, _, own in later:
        result = equivalent_conicity(
            profile, profile, rail_a, amplitude=amplitude * 1e-3
        )
        assert result == pytest.approx(own, abs=farthest)


def test_rail_a_stands_as_the_standard_places_it():
    """No tilt, whatever inclination is asked for; z counts from its highest point
    instead of from y = 0.
    """
    shape = definition("EN15302_rail_A", "rail")
    placed = rail("EN15302_rail_A", 1 / 40, 1.435, 0.750)
    inside = (placed.y > -32.5e-3) & (placed.y < 39e-3)
    off = placed.z[inside] - evaluate(shape, placed.y[inside])
    assert np.ptp(off) < 1e-12
    assert off[0] == pytest.approx(0.4918e-3, abs=0.05e-6)
    upright = rail("EN15302_rail_A", 0.0, 1.435, 0.750)
    assert np.array_equal(upright.y, placed.y)
    # the gauge point lies 14 mm below z(0)
    assert evaluate(shape, np.array([-32.5e-3, 0.0])) == pytest.approx(
        [14e-3, 0.0], abs=0.5e-6
    )


def test_rail_a_follows_gauge_and_flange_back_distance():
    base = rail("EN15302_rail_A", 0.0, 1.435, 0.750)
    wider = rail("EN15302_rail_A", 0.0, 1.437, 0.7515)
    assert wider.y - base.y == pytest.approx(
        np.full(len(base.y), 1e-3 - 1.5e-3), abs=1e-12
    )
    assert np.array_equal(wider.z, base.z)


def test_wheel_c_is_the_p8():
    assert wheel("EN15302_C").name == wheel("P8").name == "P8"


UNEQUAL = list(
    csv.DictReader(
        line
        for line in (DATA / "profile_en15302_unequal.csv").read_text().splitlines()
        if not line.startswith("#")
    )
)
ON_A_JUMP = {("E7", "4"): 0.021}
"""Rows whose amplitude ends at a jump of the contact, which the 0.1 mm grid of the
standard smears, with what it changes.
"""


@pytest.mark.parametrize(
    "row", UNEQUAL, ids=lambda row: f"{row['case']}-{row['amplitude_mm']}"
)
def test_conicity_of_unequal_wheels_is_the_published_one(row):
    """Annex E5 to E9: diameters that differ by 2 mm, or profiles A and B; 0.0075 are
    the grid of the standard behind jumps, its own tolerance is 0.05 or a half.
    """
    right, left = (wheel(f"EN15302_{row[side]}") for side in ("right", "left"))
    difference = 1e-3 * (920.0 - float(row["left_diameter_mm"]))
    amplitude = 1e-3 * float(row["amplitude_mm"])
    rail_a = rail("EN15302_rail_A", 0.0, 1.435, 0.750)
    (result,) = running(
        right, left, rail_a, "", difference, (amplitude,)
    ).equivalent_conicity
    published = float(row["published"])
    limit = ON_A_JUMP.get((row["case"], row["amplitude_mm"]), 7.5e-3)
    assert abs(result.value - published) < min(0.05, 0.5 * published)
    assert abs(result.value - published) < limit
