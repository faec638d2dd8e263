"""The gap over a contact plane: closed forms, the contact line, limits and
symmetries.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact.gap import ContactPlane, between_points, contact_plane, gap_surface
from wearsim.contact.geometry import (
    Bodies,
    CounterfaceProfile,
    Gap,
    WheelsetPose,
    WheelSurface,
)
from wearsim.errors import ContactError

RADIUS, SPAN = 0.46, 0.75
X = np.linspace(-12e-3, 12e-3, 25)[None]
S = np.linspace(-9e-3, 9e-3, 19)[None]


def bodies_gap(ring_y, radius, slope, pose, profile=0.0, kappa=0.0):
    """Gap of analytic bodies without the search: the surface needs no more than the
    bodies.
    """
    y = np.linspace(-40e-3, 40e-3, 801)
    contour = CounterfaceProfile(
        y, profile * y, 0.0 * y + profile, 0.0 * y + np.arctan(profile)
    )
    empty = np.zeros((1, y.size))
    shift, yaw, roll = (np.array([value]) for value in pose)
    bodies = Bodies(
        WheelSurface(ring_y, radius, slope),
        WheelsetPose(shift, yaw, roll),
        SPAN,
        RADIUS,
    )
    return Gap(contour, kappa, empty, empty, empty, empty, empty, bodies)


def plane_at(y=0.0, x=0.0, angle=0.0, displacement=0.0):
    return ContactPlane(
        np.array([0]), *(np.array([value]) for value in (y, x, angle, displacement))
    )


def searched(wheel, rail, shift, yaw, kappa=0.0, roll=0.0):
    return geometry.gap(
        geometry.wheel_surface(wheel, RADIUS),
        geometry.counterface_profile(rail),
        WheelsetPose(np.array([shift]), np.array([yaw]), np.array([roll])),
        half_span=SPAN,
        nominal_radius=RADIUS,
        curvature=kappa,
    )


def surface_of(gap, x=X, s=S):
    """Surface about the lowest point of the gap."""
    lowest = int(gap.gap[0].argmin())
    plane = contact_plane(
        gap, np.array([0]), gap.counterface.y[[lowest]], gap.counterface.angle[[lowest]]
    )
    return gap_surface(gap, plane, x, s)[0]


@pytest.mark.parametrize("yaw", [0.0, 0.01, -0.06, 0.1])
@pytest.mark.parametrize("cone", [0.0, 0.05, -0.4])
def test_cylinder_and_cone_over_a_flat_rail(cone, yaw):
    """Vertical rays cut a cone about a horizontal axle in a square root; rounding at
    half a metre.
    """
    ring_y = np.linspace(-30e-3, 30e-3, 61)
    gap = bodies_gap(
        ring_y, RADIUS + cone * ring_y, 0.0 * ring_y + cone, (2e-3, yaw, 0.0)
    )
    x0 = -np.sin(yaw) * SPAN
    ours = gap_surface(gap, plane_at(y=3e-3, x=x0, displacement=1e-4), X, S)[0]
    x, y = x0 + X[0][:, None], 3e-3 + S[0] - 2e-3 + SPAN
    forward, across = (
        np.cos(yaw) * x + np.sin(yaw) * y,
        np.cos(yaw) * y - np.sin(yaw) * x - SPAN,
    )
    depth = np.sqrt((RADIUS + cone * across) ** 2 - forward**2)
    np.testing.assert_allclose(ours, RADIUS - 1e-4 - depth, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("radius", [np.inf, 1.0, 0.5])
@pytest.mark.parametrize("angle", [0.0, -0.3, 0.8])
@pytest.mark.parametrize(("yaw", "roll"), [(0.0, 0.0), (0.1, 2e-3), (-0.06, -1e-3)])
def test_sphere_over_a_roller_along_any_normal(radius, angle, yaw, roll):
    """A sphere on the axle, cut by rays of any direction; cubic rings 0.1 mm apart are
    exact to rounding.
    """
    kappa, ball, x0, y0 = 1.0 / radius, RADIUS, 5e-3, -2e-3
    ring_y = np.linspace(-60e-3, 60e-3, 1201)
    gap = bodies_gap(
        ring_y,
        np.sqrt(ball**2 - ring_y**2),
        -ring_y / np.sqrt(ball**2 - ring_y**2),
        (1e-3, yaw, roll),
        kappa=kappa,
    )
    ours = gap_surface(gap, plane_at(y=y0, x=x0, angle=angle), X, S)[0]
    turn = np.arctan(kappa * x0)
    e_x = np.array([np.cos(turn), 0.0, np.sin(turn)])
    e_d = np.array([-np.sin(turn), 0.0, np.cos(turn)])
    e_s = np.array([0.0, np.cos(angle), 0.0]) + np.sin(angle) * e_d
    e_n = np.array([0.0, -np.sin(angle), 0.0]) + np.cos(angle) * e_d
    foot = (
        np.array([x0, 0.0, 0.0])
        if kappa == 0.0
        else (np.array([0, 0, radius]) - radius * e_d)
    )
    foot[1] = y0
    points = foot + X[0][:, None, None] * e_x + S[0][None, :, None] * e_s
    axle = np.array(
        [-np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)]
    )
    centre = np.array([0.0, 1e-3 - SPAN, -RADIUS]) + SPAN * axle

    def cut(offset, direction, size, outer):
        """Distance along e_n to a sphere or circle of radius `size`; `outer` takes the
        further one.
        """
        a, b = direction @ direction, offset @ direction
        root = np.sqrt(b**2 - a * ((offset**2).sum(axis=-1) - size**2))
        return (-b + root if outer else -b - root) / a

    wheel = cut(points - centre, e_n, ball, True)
    if kappa == 0.0:
        ground = -points[..., 2] / e_n[2]
    else:
        flat = np.array([1.0, 0.0, 1.0])
        ground = cut(
            (points - np.array([0, 0, radius])) * flat, e_n * flat, radius, False
        )
    np.testing.assert_allclose(ours, ground - wheel, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize("shift", [0.0, 3e-3, -5e-3])
def test_without_yaw_the_parabola_is_left_with_the_fourth_order(
    s1002, rail_60e1, shift, kappa
):
    """Sections along x are circles, or on an inclined plane nearly so."""
    gap = searched(s1002, rail_60e1, shift, 0.0, kappa)
    x = np.geomspace(4e-3, 32e-3, 7)[None]
    lowest = int(gap.gap[0].argmin())
    height = surface_of(
        gap, np.concatenate((x, np.zeros((1, 1))), axis=1), np.zeros((1, 1))
    )[:, 0]
    z = gap.counterface.z[lowest]
    radius, angle = gap.wheel_radius[0, lowest], gap.counterface.angle[lowest]
    bend = 0.5 * np.cos(angle) * (1.0 / radius + kappa / (1.0 - kappa * z))
    left = np.abs(height[:-1] - height[-1] - bend * x[0] ** 2)
    assert np.polyfit(np.log(x[0]), np.log(left), 1)[0] > 3.7
    assert left[2] < 2e-3 * bend * x[0, 2] ** 2  # 8 mm, the half length of a patch


@pytest.mark.parametrize("yaw", [0.01, 0.015])
def test_yaw_bends_the_sections_in_the_flange_root_with_its_square(
    s1002, rail_60e1, yaw
):
    """At a fixed y the ring changes with x by -yaw x: the curvature loses yaw^2 r'',
    here r'' = 1/13 mm.
    """
    x, shift = np.array([[-2e-3, 0.0, 2e-3]]), 6.2e-3
    gap = searched(s1002, rail_60e1, shift, yaw)
    rings = gap.bodies.wheel
    bend = np.gradient(rings.slope, rings.y)
    root = np.flatnonzero(gap.gap[0] < gap.gap[0].min() + 5e-5)
    root = int(root[np.argmax(np.interp(gap.wheel_y[0, root], rings.y, bend))])
    plane = contact_plane(gap, np.array([0]), gap.counterface.y[[root]], np.zeros(1))
    height = gap_surface(gap, plane, x, np.zeros((1, 1)))[0, :, 0]
    curvature = (height[0] - 2.0 * height[1] + height[2]) / x[0, 2] ** 2
    wheel_y = gap.wheel_y[0, root]
    sine = gap.sin_theta[0, root]
    lost = yaw**2 * np.interp(wheel_y, rings.y, bend)
    circle = 1.0 / (gap.wheel_radius[0, root] * np.sqrt(1.0 - sine**2))
    assert lost > 50.0 * yaw**2
    assert curvature == pytest.approx(circle - lost, abs=0.1 * lost + 1e-3 * circle)


@pytest.mark.parametrize("kappa", [0.0, 2.0])
@pytest.mark.parametrize("yaw", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("shift", [0.0, 3e-3, 5.8e-3])
def test_surface_touches_where_the_search_says(s1002, rail_60e1, shift, yaw, kappa):
    """Lowest height over the plane: zero, to half a ring of 0.1 mm beside the minimum
    (0.15 um).
    """
    height = surface_of(
        searched(s1002, rail_60e1, shift, yaw, kappa),
        np.linspace(-2e-3, 2e-3, 81)[None],
        np.linspace(-2e-3, 2e-3, 81)[None],
    )
    assert abs(height.min()) < 1.5e-7


def test_infinite_roller_is_bit_equal_and_kappa_acts_with_first_order(s1002, rail_60e1):
    """Rail and roller share each line."""
    rail = surface_of(searched(s1002, rail_60e1, 3e-3, 0.01))
    endless = surface_of(searched(s1002, rail_60e1, 3e-3, 0.01, 1.0 / np.inf))
    assert rail.tobytes() == endless.tobytes()
    kappa = np.geomspace(1e-4, 1e-1, 4)
    plane = None
    off = []
    for k in kappa:
        gap = searched(s1002, rail_60e1, 3e-3, 0.01, k)
        if plane is None:
            lowest = int(gap.gap[0].argmin())
            plane = contact_plane(
                gap,
                np.array([0]),
                gap.counterface.y[[lowest]],
                gap.counterface.angle[[lowest]],
            )
            bare = gap_surface(searched(s1002, rail_60e1, 3e-3, 0.01), plane, X, S)
        off.append(np.abs(gap_surface(gap, plane, X, S) - bare).max())
    assert 0.98 < np.polyfit(np.log(kappa), np.log(off), 1)[0] < 1.02


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_turning_the_wheelset_the_other_way_mirrors_the_gap_in_x(
    s1002, rail_60e1, kappa
):
    """Leading and trailing side change places with the sign of yaw."""
    ahead = surface_of(searched(s1002, rail_60e1, 5.5e-3, 0.03, kappa, 1e-3))
    behind = surface_of(searched(s1002, rail_60e1, 5.5e-3, -0.03, kappa, 1e-3))
    met = (ahead < 1e-2) & (behind[::-1] < 1e-2)
    assert met.mean() > 0.6
    np.testing.assert_allclose(ahead[met], behind[::-1][met], rtol=0.0, atol=1e-12)
    assert np.abs(ahead - ahead[::-1])[met & met[::-1]].max() > 1e-6  # and yaw does act


def test_rays_that_meet_nothing_have_no_gap_and_a_bare_curve_has_no_surface(
    s1002, rail_60e1
):
    gap = searched(s1002, rail_60e1, 0.0, 0.0)
    height = surface_of(gap, s=np.array([[0.0, 0.2]]))
    assert (height[:, 1] == geometry.NO_WHEEL).all()
    assert (height[:, 0] < 1e-3).all()
    with pytest.raises(ContactError, match="curve without bodies"):
        surface_of(replace(gap, bodies=None))


def test_curves_between_and_beyond_the_points_of_the_grid(s1002, rail_60e1):
    """A straight line is kept, at rising and falling places, to rounding; 1e-15 of 0.1
    m.
    """
    gap = searched(s1002, rail_60e1, 0.0, 0.0)
    grid = gap.counterface.y
    line = np.ascontiguousarray(np.stack((3.0 * grid + 1e-3, 0.02 - grid)))
    row = np.array([1, 0, 1])
    y = np.array(
        [
            [grid[0] - 1e-3, grid[7], 0.0],
            [3e-3, -20.03e-3, grid[-1]],
            [0.0, 1e-3, grid[-1] + 2e-3],
        ]
    )
    expected = np.where(row[:, None] == 0, 3.0 * y + 1e-3, 0.02 - y)
    np.testing.assert_allclose(
        between_points(gap, (line,), row, y)[0], expected, rtol=0.0, atol=1e-15
    )
    first, again = between_points(gap, (line, line), row, y[:, 0])
    np.testing.assert_array_equal(first, between_points(gap, (line,), row, y)[0, :, 0])
    np.testing.assert_array_equal(again, first)
