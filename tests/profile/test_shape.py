from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from wearsim.errors import NumericalError, ProfileError
from wearsim.profile.shape import (
    Profile,
    arc_length,
    crossing,
    extremum,
    offset_distance,
    polygon_area_between,
    resample,
    spline_through,
    vertex_lengths,
    vertex_normals,
)
from wearsim.profile.standard import definition, evaluate, wheel


def moved(y, z, distance):
    ny, nz = vertex_normals(y, z)
    return y + distance * ny, z + distance * nz


def shoelace(y, z):
    return 0.5 * np.sum(y * np.roll(z, -1) - np.roll(y, -1) * z)


def test_arc_length_of_a_staircase():
    assert np.array_equal(
        arc_length(np.array([0.0, 3.0, 3.0]), np.array([0.0, 4.0, 2.0])),
        [0.0, 5.0, 7.0],
    )


@pytest.mark.parametrize("count", [2, 3, 4, 5, 600])
@pytest.mark.parametrize("inner", [(), (2,)])
def test_a_spline_is_that_of_scipy_to_the_last_bit(count, inner):
    random = np.random.default_rng(count)
    place, values = (
        np.cumsum(random.uniform(1e-5, 5e-4, count)),
        random.normal(size=(count, *inner)),
    )
    at = np.linspace(place[0], place[-1], 50)
    ours, theirs = spline_through(place, values), CubicSpline(place, values)
    for derivative in (0, 1):
        np.testing.assert_array_equal(ours(at, derivative), theirs(at, derivative))


@pytest.mark.parametrize(
    "place",
    [
        [0.0, 1.0, 1.0, 2.0, 3.0],
        [0.0, 2.0, 1.0, 3.0, 4.0],
        [0.0, 1.0, np.nan, 2.0, 3.0],
    ],
)
def test_a_spline_through_points_that_do_not_rise_is_refused(place):
    with pytest.raises(ValueError, match=r"strictly increasing|finite"):
        spline_through(np.array(place), np.zeros(5))


@pytest.mark.parametrize("spacing", [0.25e-3, 0.125e-3, 0.0625e-3])
def test_resampled_profile_stays_on_the_definition(spacing):
    """At the flank's end the curvature jumps by 1/13 mm: a cubic misses it by h^2/40 of
    that (second order).

    Below it lie the misclosures of the definition itself, 0.12 um at y = -35 mm.
    """
    given_points = wheel("S1002", spacing=spacing)
    new = resample(given_points, 0.4 * spacing)
    exact = evaluate(definition("S1002", "wheel"), np.clip(new.y, -0.07, 0.065))
    _, nz = vertex_normals(new.y, new.z)
    # next to the vertical end at y = -70 mm a vertical distance says nothing
    off = np.abs((new.z - exact) * nz)[new.y > -0.0699]
    y = new.y[new.y > -0.0699]
    flank_end = (y > -0.0395) & (y < -0.0375)
    assert np.max(off[flank_end]) < spacing**2 / (40 * 13e-3)
    assert np.max(off[~flank_end]) < 0.12e-6
    step = np.diff(arc_length(new.y, new.z))
    assert np.max(np.abs(step / (0.4 * spacing) - 1.0)) < 0.01
    assert (new.y[0], new.y[-1]) == (given_points.y[0], given_points.y[-1])


def test_resampling_keeps_corners_and_vertical_parts():
    """A back, a tread and a chamfer: straight lines between corners come back as
    straight lines.
    """
    corners = np.array([[0.0, -0.01], [0.0, 0.02], [0.05, 0.02], [0.06, 0.01]])
    parts = [np.linspace(a, b, 7)[:-1] for a, b in pairwise(corners)]
    y, z = np.vstack((*parts, corners[-1:])).T
    new = resample(Profile("box", "wheel", y, z), 1e-3)
    for corner in corners:
        assert np.min(np.hypot(new.y - corner[0], new.z - corner[1])) < 1e-15
    assert arc_length(new.y, new.z)[-1] == pytest.approx(
        0.08 + np.hypot(0.01, 0.01), abs=1e-15
    )


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, 1.0])
def test_resampling_checks_the_spacing(spacing):
    with pytest.raises(ProfileError, match=r"S1002: point spacing = .* mm must be"):
        resample(wheel("S1002"), spacing)


def test_normals_point_into_the_wheel():
    profile = wheel("S1002")
    ny, nz = vertex_normals(profile.y, profile.z)
    assert np.hypot(ny, nz) == pytest.approx(np.ones_like(ny), abs=1e-15)
    tread = np.argmin(np.abs(profile.y - 0.019))
    assert nz[tread] < -0.99
    flank = np.argmin(np.abs(profile.y + 0.039))
    # 70 degrees of flank: wear moves it towards the flange back
    assert (ny[flank], nz[flank]) == pytest.approx(
        (-np.sin(np.radians(70)), -np.cos(np.radians(70))), abs=1e-6
    )


def test_vertex_lengths_of_a_straight_line_are_its_cells():
    y = np.array([0.0, 1.0, 3.0, 4.0])
    assert np.array_equal(vertex_lengths(y, np.zeros(4)), [0.5, 1.5, 1.5, 0.5])


def test_removed_area_is_the_shoelace_of_the_closed_loop():
    """Absolute coordinates of 0.07 m against an area of 1e-6 m2 leave 1e-9 of it to the
    plain formula.
    """
    profile = wheel("S1002")
    y1, z1 = moved(profile.y, profile.z, np.full_like(profile.y, 5e-5))
    loop = shoelace(
        np.concatenate((profile.y, y1[::-1])), np.concatenate((profile.z, z1[::-1]))
    )
    removed = polygon_area_between(profile.y, profile.z, y1, z1)
    assert removed > 0.0
    assert removed == pytest.approx(-loop, rel=1e-9)


@given(
    centre=st.floats(-0.060, 0.055),
    width=st.floats(1e-3, 30e-3),
    height=st.floats(1e-7, 1e-4),
    spacing=st.sampled_from([0.1e-3, 0.25e-3, 1e-3]),
)
def test_offset_removes_the_area_of_the_law(centre, width, height, spacing):
    """Up to 0.1 mm at a time, also in the fillet of 13 mm and on the flange tip of 12
    mm.
    """
    profile = wheel("S1002", spacing=spacing)
    depth = height * np.exp(-(((profile.y - centre) / width) ** 2))
    y1, z1 = moved(profile.y, profile.z, offset_distance(profile.y, profile.z, depth))
    law = np.sum(depth * vertex_lengths(profile.y, profile.z))
    # rounding of coordinates of 0.07 m (1e-17) over the depth is what limits the
    # thinnest layers
    rounding = 1e-17 * 0.2 / law
    assert polygon_area_between(profile.y, profile.z, y1, z1) == pytest.approx(
        law, rel=1e-12 + rounding
    )


def test_offset_follows_the_curvature():
    """On an arc, d - curvature d^2/2 = depth; worn from the hollow side an arc gets
    longer, so d is less.
    """
    angle = np.linspace(-0.5, 0.5, 2001)
    radius, depth = 13e-3, np.full(2001, 1e-4)
    y = radius * np.sin(angle)
    hollow, round_ = -radius * np.cos(angle), radius * np.cos(angle)
    inner = slice(100, -100)
    # exact values: area of a ring; the polygon of 2001 points is off by the square of
    # its angle, 2.5e-7
    for z, sign in ((hollow, 1.0), (round_, -1.0)):
        exact = sign * (np.sqrt(radius**2 + sign * 2.0 * radius * 1e-4) - radius)
        assert offset_distance(y, z, depth)[inner] == pytest.approx(exact, rel=1e-6)


def test_offset_beyond_the_radius_is_refused():
    profile = wheel("S1002")
    with pytest.raises(
        NumericalError, match=r"wear depth of 15 mm in one step is too large"
    ):
        offset_distance(profile.y, profile.z, np.full_like(profile.y, 15e-3))


def test_extremum_of_a_parabola_is_exact():
    y = np.array([0.0, 1.0, 2.5, 3.0])
    place, value = extremum(y, 7.0 - (y - 1.7) ** 2, 2)
    assert (place, value) == pytest.approx((1.7, 7.0), abs=1e-12)


def test_extremum_at_an_end_is_the_point():
    assert extremum(np.array([0.0, 1.0]), np.array([2.0, 1.0]), 0) == (0.0, 2.0)


def test_crossing_of_a_cubic_is_exact():
    value = np.array([0.0, 1.0, 2.5, 3.0])
    assert crossing(value**3, value, 1, 1.9) == pytest.approx(1.9**3, abs=1e-12)


def test_crossing_next_to_a_turn_is_linear():
    assert (
        crossing(
            np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 0.0, 1.0, 2.0]), 1, 0.25
        )
        == 1.25
    )


def test_an_edge_at_the_level_is_crossed_at_its_beginning():
    assert crossing(np.array([0.0, 1.0, 2.0]), np.array([0.0, 5.0, 5.0]), 1, 5.0) == 1.0


Y = np.linspace(-0.07, 0.06, 100)


@pytest.mark.parametrize(
    ("y", "z", "reason"),
    [
        (
            1e3 * Y,
            1e3 * Y**2,
            "y spans 130 m, .* look like millimetres; divide y and z by 1000",
        ),
        (Y, 1e6 * Y**2, "z spans 4900 m, .* look like millimetres"),
        (
            np.where(Y > 0.0, np.nan, Y),
            Y**2,
            r"y\[54\] = nan must be a finite number; delete the point",
        ),
        (Y, np.where(Y > 0.0, -np.inf, Y), r"z\[54\] = -inf must be a finite number"),
        (
            Y,
            Y[:-1] ** 2,
            "y has 100 points and z has 99; give both coordinates of each point",
        ),
        (Y[:, None], Y[:, None], r"y has the shape \(100, 1\); give a list"),
        ([], [], r"y has the shape \(0,\); give a list of at least 2 coordinates"),
        (["a", "b"], [0.0, 1.0], "y is no array of numbers; give the coordinates"),
        (None, Y, r"y has the shape \(\); give a list"),
    ],
)
def test_a_profile_of_impossible_points_is_refused(y, z, reason):
    with pytest.raises(ProfileError, match=f'^profile "mine": {reason}') as caught:
        Profile("mine", "wheel", y, z)
    assert "\n" not in str(caught.value)


def test_a_profile_of_lists_has_arrays():
    profile = Profile("mine", "wheel", [0, 0.01, 0.02], [0, 0.001, 0])
    assert profile.y.dtype == profile.z.dtype == np.float64
    kept = Profile("mine", "wheel", profile.y, profile.z)
    assert kept.y is profile.y
