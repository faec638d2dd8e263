"""Strips under a yawed wheel, and the basins of the gap that become patches."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from wearsim.contact import geometry
from wearsim.contact.gap import contact_plane, gap_surface
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.kik_piotrowski.strips import displacement_integral, skewed_displacement_integrals
from wearsim.contact.normal.kik_piotrowski.wheel_load import BASIN, MOST_BASINS, find_basins
from wearsim.contact.patch import Resolution

E_STAR = 210e9 / (2.0 * (1.0 - 0.3**2))


@pytest.fixture(scope="module")
def patches(s1002, rail_60e1):
    """Function: gap and solution of one state."""
    wheel, ground = geometry.wheel_surface(s1002, 0.46), geometry.counterface_profile(rail_60e1)

    def of(shift, yaw, kappa=0.0, strips=40, **options):
        gap = geometry.gap(
            wheel,
            ground,
            WheelsetPose(np.array([shift]), np.array([yaw]), np.zeros(1)),
            half_span=0.75,
            nominal_radius=0.46,
            curvature=kappa,
        )
        return gap, kik_piotrowski.solve(
            gap,
            np.zeros(1, np.int64),
            np.array([80e3]),
            vertical=True,
            effective_modulus=E_STAR,
            resolution=Resolution(1.0, strips, strips, strips),
            parameters={},
            **options,
        )

    return of


@pytest.mark.parametrize("middle", [0.0, 1e-3, 5e-3, 9e-3])
@pytest.mark.parametrize("distance", [2e-5, 3e-4, 5e-3])
def test_skewed_displacement_integral_against_quadrature(middle, distance):
    """Six nodes: 2e-5 at 1/300 of the half length, rounding far away."""
    half = 6e-3
    value, _ = quad(
        lambda t: (half * np.cos(t)) ** 2 / np.hypot(middle + half * np.sin(t), distance),
        -np.pi / 2,
        np.pi / 2,
        points=[np.arcsin(max(min(-middle / half, 1.0), -1.0))],
        epsrel=1e-11,
        limit=500,
    )
    work = np.empty((3, 1))
    skewed_displacement_integrals(
        np.array([half**2]), np.array([middle]), 0.0, np.array([distance**2]), *work
    )
    ours = work[2, 0]
    assert ours == pytest.approx(value, rel=3e-5)
    if middle == 0.0:
        assert ours == pytest.approx(displacement_integral(half**2, distance**2), rel=3e-5)


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize(
    ("shift", "yaw", "apart", "along"),
    [
        (3e-3, 0.01, 0.003, 0.03),
        (3e-3, -0.04, 0.01, 0.03),
        (-4e-3, 0.1, 0.025, 0.04),
        (6.2e-3, 0.01, 0.01, 0.16),
    ],
)
def test_both_ends_of_a_strip_lie_on_the_interpenetration(patches, shift, yaw, apart, along, kappa):
    """Exact gap at leading and trailing end, and from strip to strip, as shares of the interpenetration.

    Left open: sections at constant y instead of constant s (first), and the change from vertical to normal
    distances in a patch whose tangents turn by 0.4 rad, in the flange root (second).
    """
    gap, result = patches(shift, yaw, kappa)
    patch = result.patch
    plane = contact_plane(gap, patch.row, result.centre_y, result.contact_angle)
    for m in range(patch.row.size):
        one = type(plane)(
            *(getattr(plane, n)[[m]] for n in ("row", "y", "x", "angle", "vertical_displacement"))
        )
        inner = slice(2, -2)
        ends = [
            np.array([
                gap_surface(gap, one, np.array([[x]]), np.array([[s]]))[0, 0, 0]
                for x, s in zip(side[m, inner], patch.y[m, inner], strict=True)
            ])
            for side in (patch.x_lead, patch.x_trail)
        ]  # fmt: skip
        deepest = patch.interpenetration[m].max()
        assert abs(ends[0] - ends[1]).max() < apart * deepest
        assert np.ptp(ends[0]) < along * deepest


def test_strips_are_not_symmetric_about_the_contact_line(patches):
    """Between leading and trailing half on the flange: 5 % and more with 40 mrad."""
    gap, result = patches(7e-3, 0.04)
    patch = result.patch
    m = int(result.centre_y.argmin())
    profile = np.interp(patch.y[m], patch.y[m], 0.5 * (result.edge_y[m, 1:] + result.edge_y[m, :-1]))
    line = np.interp(profile, gap.counterface.y, gap.x[0]) - np.interp(
        result.centre_y[m], gap.counterface.y, gap.x[0]
    )
    lead, trail = patch.x_lead[m] - line, line - patch.x_trail[m]
    assert abs(lead / trail - 1.0).max() > 0.05


@pytest.mark.parametrize("kappa", [0.0, 2.0])
@pytest.mark.parametrize("shift", [-4e-3, 0.0, 3e-3, 5e-3])
def test_a_vanishing_yaw_is_no_yaw(patches, shift, kappa):
    """Two ways to compute one thing: quadrature and section against closed forms, 1e-6."""
    _, none = patches(shift, 0.0, kappa)
    _, little = patches(shift, 1e-10, kappa)
    for name in ("normal_force", "max_pressure", "approach", "centre_y"):
        np.testing.assert_allclose(getattr(little, name), getattr(none, name), rtol=1e-5)
    np.testing.assert_allclose(little.patch.area, none.patch.area, rtol=1e-5)
    np.testing.assert_allclose(little.patch.x_lead, none.patch.x_lead, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("shift", [0.0, 3e-3, 5.7e-3, 7e-3])
def test_the_other_yaw_mirrors_the_patch_in_x(patches, shift):
    """Imposed symmetry: 1e-9."""
    _, right = patches(shift, 0.03)
    _, left = patches(shift, -0.03)
    np.testing.assert_allclose(right.patch.x_lead, -left.patch.x_trail, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(right.max_pressure, left.max_pressure, rtol=1e-9)


@pytest.mark.parametrize("yaw", [0.01, 0.1])
def test_skewed_strips_carry_the_load(patches, yaw):
    _, result = patches(3e-3, yaw)
    half = 0.5 * (result.patch.x_lead - result.patch.x_trail)
    carried = (result.patch.pressure_slope * 0.5 * np.pi * half**2).sum(axis=1) * result.patch.width
    np.testing.assert_allclose(carried, result.normal_force, rtol=1e-12)
    assert (result.normal_force * np.cos(result.contact_angle)).sum() == pytest.approx(80e3, rel=1e-8)


@given(st.lists(st.integers(0, 30), min_size=3, max_size=40, unique=True))
def test_basins_join_as_the_flood_says(heights):
    """Flooding level by level with sets of points, the slow way."""
    gap = np.array([100.0, *map(float, heights), 100.0])
    basins = np.zeros(MOST_BASINS, BASIN).view(np.recarray)
    actual = find_basins(gap, 99.0, basins)
    order = basins.order[:actual]
    place = [i for i in range(1, gap.size - 1) if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1]]
    assert actual == len(place)
    level = dict(zip(place, basins.height[:actual], strict=True))  # of the parabola through three points
    assert basins.height[order].tolist() == sorted(level.values())
    joins = {}
    lakes = []
    for i in np.argsort(gap):
        touching = [lake for lake in lakes if i - 1 in lake or i + 1 in lake]
        lakes = [lake for lake in lakes if lake not in touching]
        deep = sorted((min(lake & set(place), key=level.get) for lake in touching), key=level.get)
        for other in deep[1:]:
            joins[place.index(other)] = (place.index(deep[0]), gap[i])
        lakes.append({i}.union(*touching))
    for k in range(actual):
        if k == order[0]:
            assert basins[k].parent == -1
        else:
            assert (basins[k].parent, basins[k].saddle) == joins[k]
