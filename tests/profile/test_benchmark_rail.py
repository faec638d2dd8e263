"""The rail of the Manchester contact benchmark: 60E1 with other junctions."""

from pathlib import Path

import numpy as np
import pytest
from junctions import junctions
from scipy.optimize import least_squares

from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.standard import definition, evaluate, rail, wheel

DATA = Path(__file__).parents[1] / "data"


def upright_points():
    """Points of the benchmark's file turned back by 1:40, from the axis and the top of
    R 300 [m].
    """
    y, z = np.loadtxt(DATA / "profile_mbench_uic60.csv", delimiter=",").T * 1e-3
    tilt = np.arctan(1 / 40)
    x, z = y * np.cos(tilt) - z * np.sin(tilt), y * np.sin(tilt) + z * np.cos(tilt)
    crown = (y > -17.7e-3) & (y < 2.5e-3)
    # Only where the axis is: the file does not say. In mm, for the solver's sake.
    centre = least_squares(
        lambda c: (
            1e3 * np.hypot(x[crown] - 1e-3 * c[0], z[crown] - 1e-3 * c[1]) - 300.0
        ),
        [0.0, 300.0],
        xtol=1e-15,
        ftol=1e-15,
    ).x
    return x - 1e-3 * centre[0], z - 1e-3 * (centre[1] - 300.0)


def test_arcs_give_the_points_of_the_file():
    """R 300 and R 80 to the printed digits, 1 nm of y; R 13 but for the 45 nm by which
    the file is lower.
    """
    x, z = upright_points()
    off = evaluate(definition("60E1_benchmark", "rail"), x) - z
    flat = np.abs(x) < 25.9e-3
    assert np.count_nonzero(flat) == 17
    assert np.max(np.abs(off[flat])) < 0.5e-9
    # 45 nm are rounded by 0.5 nm, y of the file by as much, which the slope of up to
    # 7.4 multiplies.
    assert np.max(np.abs(off[~flat] + 45e-9)) < 4.5e-9


def test_junctions_are_smooth_and_centres_where_the_specification_has_them():
    shape = definition("60E1_benchmark", "rail")
    _, step, kink = junctions(shape)
    assert np.max(np.abs(step)) < 1e-12
    assert np.max(np.abs(kink)) < 1e-12
    right = {piece.zone: piece for piece in shape.segments if piece.end > 0.0}
    assert right["R80"].centre == pytest.approx((7.7, 80.1348), abs=0.5e-4)
    assert right["R80"].start == pytest.approx(10.5, abs=1e-12)
    assert right["R13"].end == pytest.approx(36.0, abs=1e-7)


@pytest.mark.parametrize(
    ("x", "deviation", "digit"),
    [
        (10.2, 0.0, 0.1),
        (10.9, -1.4, 0.1),
        (15.0, -11.6, 0.1),
        (20.0, -24.2, 0.2),
        (25.0, -37.7, 0.2),
        (26.0, -40.2, 0.1),
        (30.0, -40.0, 0.5),
        (35.5, -40.8, 0.1),
    ],
)
def test_deviation_from_60e1(x, deviation, digit):
    """The specification's table of what the file lies higher, to its last digit; twice
    that at two places.
    """
    at = np.array([x, -x]) * 1e-3
    off = evaluate(definition("60E1_benchmark", "rail"), at) - evaluate(
        definition("60E1", "rail"), at
    )
    assert off[0] == pytest.approx(off[1], abs=1e-12)
    assert off[0] == pytest.approx(deviation * 1e-6, abs=digit * 1e-6)


def test_kink_appears_only_with_the_junction_of_60e1():
    """At 10.228 mm, where R 300 of 60E1 ends, R 300 and R 80 of the benchmark differ by
    2.5 mrad.
    """
    crown, shoulder = definition("60E1_benchmark", "rail").segments[3:5]
    at = np.array([10.228])
    assert (shoulder.angle(at) - crown.angle(at))[0] == pytest.approx(
        -2.5e-3, abs=0.02e-3
    )


def test_equivalent_conicity_is_that_of_the_benchmark_file():
    """0.180 at 3 mm against 0.174 with 60E1; 0.003 is the grid of the reference."""
    wheels = wheel("S1002")
    result = equivalent_conicity(
        wheels, wheels, rail("60E1_benchmark", 1 / 40, 1.435, 0.750), amplitude=3e-3
    )
    assert result == pytest.approx(0.180, abs=0.003)
