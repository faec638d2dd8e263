"""Standard shapes against independently computed points, arcs, junctions and gauge
values.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from junctions import junctions

from wearsim.profile.conicity import equivalent_conicity, rolling_radius_difference
from wearsim.profile.measures import flange_gradient, flange_height, flange_thickness
from wearsim.profile.segments import Arc
from wearsim.profile.standard import definition, evaluate, rail, wheel

DATA = Path(__file__).parents[1] / "data"
# width [mm] at depth [mm] on the drawings of EN 13674-1, with the digits they close
# to [mm]
DRAWN_WIDTHS = {
    "60E1": (72.0, 14.3, 0.4e-3),
    "60E2": (72.0, 14.3, 0.2e-3),
    "54E1": (70.0, 14.1, 0.2e-3),
    "54E2": (67.01, 13.85, 0.2e-3),
    "49E1": (67.0, 14.0, 0.4e-3),
    "56E1": (69.85, 14.53, 0.3e-3),
}
# amplitudes [mm] within 0.3 mm of a jump of the contact, by wheel, rail, cant and gauge
BESIDE_A_JUMP = {
    ("S1002", "60E1", "40", "1432"): (6,),
    ("S1002", "54E1", "40", "1435"): (1, 5),
    ("S1002", "54E1", "20", "1435"): (6,),
    ("S1002", "56E1", "40", "1435"): (1,),
    ("EPS", "60E1", "40", "1435"): (6,),
    ("EPS", "60E1", "20", "1435"): (6,),
    ("1in40", "60E1", "40", "1435"): (5,),
}


def rows(name):
    """Lines of a small check table as texts."""
    lines = [
        line
        for line in (DATA / name).read_text().splitlines()
        if not line.startswith("#")
    ]
    return list(csv.reader(lines))[1:]


def points(name, shape):
    """Columns of the rows of one shape [m]."""
    return (
        np.array(
            [[float(v) for v in row[1:]] for row in rows(name) if row[0] == shape]
        ).T
        * 1e-3
    )


@pytest.mark.parametrize("name", ["EPS", "1in40", "P8"])
def test_wheels_equal_their_points(name):
    """The points are printed to 1 nm; P8 closes at y = 19 to 4 nm, where the points
    have the other side.
    """
    y, z = points("profile_wheel_points.csv", name)
    assert len(y) > 60
    off = np.abs(evaluate(definition(name, "wheel"), y) - z)
    junction = np.isclose(y, 19e-3)
    assert np.max(off[~junction]) < 0.6e-9
    assert np.max(off) < 4e-9


def test_eps_closes_to_the_digits_of_its_table():
    """At -35 and -26 the table of 1 um meets exact curves: 0.50 and 0.21 um."""
    y, step, _ = junctions(definition("EPS", "wheel"))
    assert abs(step[np.isclose(y, -35e-3)][0]) == pytest.approx(0.504e-6, abs=1e-9)
    assert abs(step[np.isclose(y, -26e-3)][0]) == pytest.approx(0.210e-6, abs=1e-9)
    table = [
        6.867,
        6.466,
        6.108,
        5.788,
        5.507,
        5.262,
        5.044,
        4.832,
        4.624,
        4.421,
        4.222,
        4.028,
    ]
    at = -35e-3 + 0.5e-3 * np.arange(len(table))
    assert evaluate(definition("EPS", "wheel"), at) == pytest.approx(
        np.array(table) * 1e-3, abs=1e-12
    )


def test_1_in_40_is_the_tangent_construction():
    """Centre and junctions of the R 36 by an independent construction; the standard
    rounds them to 1 um.
    """
    shape = definition("1:40", "wheel")
    (arc,) = [piece for piece in shape.segments if piece.zone == "R36"]
    assert arc.centre == pytest.approx((-14.736832, 36.379669), abs=1e-6)
    assert (arc.start, arc.end) == pytest.approx((-32.69587, -15.63655), abs=0.6e-5)
    assert arc.centre == pytest.approx((-14.740, 36.380), abs=3.5e-3)
    assert evaluate(shape, np.array([35e-3]))[0] == pytest.approx(-0.875e-3, abs=1e-15)


@pytest.mark.parametrize("name", ["60E2", "54E1", "54E2", "49E1", "56E1"])
def test_rails_equal_their_points(name):
    """The points print 1 nm of x, which is 20 nm of z on the side of slope 20."""
    x, z = points("profile_rail_points.csv", name)
    assert len(x) > 25
    shape = definition(name, "rail")
    assert np.max(np.abs(evaluate(shape, x) - z)) < 12e-9
    assert evaluate(shape, -x) == pytest.approx(evaluate(shape, x), abs=1e-12)


@pytest.mark.parametrize("name", sorted(DRAWN_WIDTHS))
def test_rail_heads_have_the_arcs_of_the_table_and_close_on_the_drawing(name):
    shape = definition(name, "rail")
    half = [
        piece for piece in shape.segments if isinstance(piece, Arc) and piece.end > 0.0
    ]
    table = [
        list(map(float, row[2:]))
        for row in rows("profile_rail_arcs.csv")
        if row[0] == name
    ]
    assert len(half) == len(table)
    for piece, (radius, xc, zc, x_start, z_start, x_end, z_end) in zip(
        half, table, strict=True
    ):
        start = max(piece.start, 0.0)
        ends = piece.height(np.array([start, piece.end]))
        result = (piece.radius, *piece.centre, start, ends[0], piece.end, ends[1])
        assert result == pytest.approx(
            (radius, xc, zc, x_start, z_start, x_end, z_end), abs=0.51e-6
        )
    # no input of the construction: the width where the sides begin
    width, depth, digits = DRAWN_WIDTHS[name]
    assert 2.0 * half[-1].end == pytest.approx(width, abs=digits)
    assert float(half[-1].height(np.array([half[-1].end]))[0]) == pytest.approx(
        depth, abs=digits
    )


@pytest.mark.parametrize(
    "row", rows("profile_rail_tops.csv"), ids=lambda r: f"{r[0]}-{r[1]}"
)
def test_inclined_rails_have_top_and_gauge_point_of_the_table(row):
    """Printed to 0.01 um; the top, flat to the last bits over micrometres, is found by
    a parabola.
    """
    name, cant, y_top, from_origin = row[0], float(row[1]), float(row[2]), float(row[3])
    placed = rail(name, 1.0 / cant, 1.435, 0.750, spacing=0.05e-3)
    top = definition(name, "rail")
    # the crown's point of slope 1/N, tilted with the head
    slope = np.arctan(1.0 / cant)
    piece = next(p for p in top.segments if p.angle(np.array([p.end]))[0] > slope)
    assert isinstance(piece, Arc)
    y0 = piece.centre[0] + piece.radius * np.sin(slope)
    z0 = float(piece.height(np.array([y0]))[0])
    y_tilted = y0 * np.cos(slope) + z0 * np.sin(slope)
    assert y_tilted - from_origin == pytest.approx(32.5 + y_top, abs=2e-5)
    near = np.abs(placed.y - y_top * 1e-3) < 0.6e-3
    bend, tilt, _ = np.polyfit(placed.y[near] - y_top * 1e-3, placed.z[near], 2)
    assert abs(tilt / (2.0 * bend)) < 1e-6
    assert (
        0.0 <= placed.z.min() + 1e-12 < 0.05e-3**2 / (8 * 70e-3)
    )  # the top may lie between two points
    left = placed.y < 0.0
    order = np.argsort(placed.z[left])
    at = np.interp(14e-3, placed.z[left][order], placed.y[left][order])
    assert at == pytest.approx(-32.5e-3, abs=0.05e-6)  # chords of 0.05 mm on R 8


def test_s1002_junctions_equal_the_table():
    shape = definition("S1002", "wheel")
    y, step, kink = junctions(shape)
    table = np.array(
        [[float(v) for v in row[1:]] for row in rows("profile_s1002_junctions.csv")]
    )
    assert [row[0] for row in rows("profile_s1002_junctions.csv")] == [
        f"{left.zone}/{right.zone}"
        for left, right in zip(shape.segments[:-2], shape.segments[1:-1], strict=True)
    ]
    count = len(table)
    assert y[:count] * 1e3 == pytest.approx(table[:, 0], abs=0.51e-6)
    assert step[:count] * 1e6 == pytest.approx(table[:, 3], abs=0.51e-6)
    assert kink[:count] * 1e3 == pytest.approx(table[:, 4], abs=0.51e-6)
    left = [piece.height(np.array([piece.end]))[0] for piece in shape.segments[:count]]
    assert left == pytest.approx(table[:, 1], abs=0.51e-6)


@pytest.mark.parametrize("row", rows("profile_wheel_measures.csv"), ids=lambda r: r[0])
def test_gauge_values_equal_the_table(row):
    """0.1 um of the table's digits and of 0.25 mm points.

    At the edge on the tip of P8 the parabola through the highest points rises 1 um
    above the edge.
    """
    profile = wheel(row[0])
    result = [
        f(profile.y, profile.z) * 1e3
        for f in (flange_height, flange_thickness, flange_gradient)
    ]
    height, thickness, gradient = map(float, row[1:])
    tip = 1.1e-3 if row[0] == "P8" else 0.1e-3
    assert result[0] == pytest.approx(height, abs=tip)
    assert result[1] == pytest.approx(thickness, abs=0.1e-3)
    assert result[2] == pytest.approx(gradient, abs=2.0 * tip)


@pytest.mark.parametrize(
    "row", rows("profile_conicity_pairs.csv"), ids=lambda r: "-".join(r[:4])
)
def test_conicity_and_radius_difference_of_pairs(row):
    """0.0015 is the lateral grid of both; beside jumps of the contact the table is
    uncertain by 0.01.
    """
    pair = tuple(row[:4])
    profile = wheel(row[0])
    placed = rail(row[1], 1.0 / float(row[2]), 1e-3 * float(row[3]), 0.750)
    for millimetres in range(1, 7):
        result = equivalent_conicity(
            profile, profile, placed, amplitude=millimetres * 1e-3
        )
        bound = 0.005 if millimetres in BESIDE_A_JUMP.get(pair, ()) else 0.0015
        assert result == pytest.approx(float(row[3 + millimetres]), abs=bound), (
            millimetres
        )
    result = (
        rolling_radius_difference(profile, profile, placed)(np.array([3e-3, 5e-3]))
        * 1e3
    )
    # 1 um of y is 2.7 um of radius on the flank, which S1002 touches at 5 mm on gauge
    # 1432
    on_flank = float(row[11]) > 5.0
    assert result[0] == pytest.approx(float(row[10]), abs=0.6e-3)
    assert result[1] == pytest.approx(
        float(row[11]), abs=2.7e-3 if on_flank else 0.6e-3
    )
