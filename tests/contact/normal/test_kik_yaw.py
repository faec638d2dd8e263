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
from wearsim.contact.normal.kik_piotrowski.strips import (
    displacement_integral,
    skewed_displacement_integrals,
)
from wearsim.contact.normal.kik_piotrowski.wheel_load import BASIN, find_basins
from wearsim.contact.patch import Resolution

E_STAR = 210e9 / (2.0 * (1.0 - 0.3**2))


@pytest.fixture(scope="module")
def patches(s1002, rail_60e1):
    """Function: gap and solution of one state."""
    wheel, ground = (
        geometry.wheel_surface(s1002, 0.46),
        geometry.counterface_profile(rail_60e1),
    )

    def of(shift, yaw, kappa=0.0, strips=40, load=80e3, **options):
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
            np.array([load]),
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
        lambda t: (
            (half * np.cos(t)) ** 2 / np.hypot(middle + half * np.sin(t), distance)
        ),
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
        assert ours == pytest.approx(
            displacement_integral(half**2, distance**2), rel=3e-5
        )


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
def test_both_ends_of_a_strip_lie_on_the_interpenetration(
    patches, shift, yaw, apart, along, kappa
):
    """Exact gap at leading and trailing end, and from strip to strip, as shares of the
    interpenetration.

    Left open: sections at constant y instead of constant s (first), and the change from
    vertical to normal distances in a patch whose tangents turn by 0.4 rad, in the
    flange root (second).
    """
    gap, result = patches(shift, yaw, kappa)
    patch = result.patch
    plane = contact_plane(gap, patch.row, result.centre_y, result.contact_angle)
    for m in range(patch.row.size):
        one = type(plane)(
            *(
                getattr(plane, n)[[m]]
                for n in ("row", "y", "x", "angle", "vertical_displacement")
            )
        )
        inner = slice(2, -2)
        ends = [
            np.array(
                [
                    gap_surface(gap, one, np.array([[x]]), np.array([[s]]))[0, 0, 0]
                    for x, s in zip(side[m, inner], patch.y[m, inner], strict=True)
                ]
            )
            for side in (patch.x_lead, patch.x_trail)
        ]
        deepest = patch.interpenetration[m].max()
        assert abs(ends[0] - ends[1]).max() < apart * deepest
        assert np.ptp(ends[0]) < along * deepest


def test_strips_are_not_symmetric_about_the_contact_line(patches):
    """Between leading and trailing half on the flange: 5 % and more with 40 mrad."""
    gap, result = patches(7e-3, 0.04)
    patch = result.patch
    m = int(result.centre_y.argmin())
    profile = np.interp(
        patch.y[m], patch.y[m], 0.5 * (result.edge_y[m, 1:] + result.edge_y[m, :-1])
    )
    line = np.interp(profile, gap.counterface.y, gap.x[0]) - np.interp(
        result.centre_y[m], gap.counterface.y, gap.x[0]
    )
    lead, trail = patch.x_lead[m] - line, line - patch.x_trail[m]
    assert abs(lead / trail - 1.0).max() > 0.05


@pytest.mark.parametrize("kappa", [0.0, 2.0])
@pytest.mark.parametrize("shift", [-4e-3, 0.0, 3e-3, 5e-3])
def test_a_vanishing_yaw_is_no_yaw(patches, shift, kappa):
    """Two ways to compute one thing: quadrature and section against closed forms,
    1e-6.
    """
    _, none = patches(shift, 0.0, kappa)
    _, little = patches(shift, 1e-10, kappa)
    for name in ("normal_force", "max_pressure", "approach", "centre_y"):
        np.testing.assert_allclose(
            getattr(little, name), getattr(none, name), rtol=1e-5
        )
    np.testing.assert_allclose(little.patch.area, none.patch.area, rtol=1e-5)
    np.testing.assert_allclose(
        little.patch.x_lead, none.patch.x_lead, rtol=0.0, atol=1e-7
    )


@pytest.mark.parametrize("shift", [0.0, 3e-3, 5.7e-3, 7e-3])
def test_the_other_yaw_mirrors_the_patch_in_x(patches, shift):
    """Imposed symmetry: 1e-9."""
    _, right = patches(shift, 0.03)
    _, left = patches(shift, -0.03)
    np.testing.assert_allclose(
        right.patch.x_lead, -left.patch.x_trail, rtol=0.0, atol=1e-11
    )
    np.testing.assert_allclose(right.max_pressure, left.max_pressure, rtol=1e-9)


@pytest.mark.parametrize("yaw", [0.01, 0.1])
def test_skewed_strips_carry_the_load(patches, yaw):
    _, result = patches(3e-3, yaw)
    half = 0.5 * (result.patch.x_lead - result.patch.x_trail)
    carried = (result.patch.pressure_slope * 0.5 * np.pi * half**2).sum(
        axis=1
    ) * result.patch.width
    np.testing.assert_allclose(carried, result.normal_force, rtol=1e-12)
    assert (result.normal_force * np.cos(result.contact_angle)).sum() == pytest.approx(
        80e3, rel=1e-8
    )


def test_sections_at_every_millimetre_are_as_good_as_at_every_grid_point(
    patches, monkeypatch
):
    """Strip ends are smooth in between, as multiples of those of circles.

    1e-6 at 10 mrad, 5e-5 at the flange, 1e-3 at 50 mrad.
    """
    for shift, yaw, limit in (
        (-4e-3, 0.01, 1e-6),
        (2e-3, -0.01, 1e-6),
        (5e-3, 0.01, 5e-5),
        (6e-3, 0.05, 1e-3),
    ):
        few = patches(shift, yaw)[1]
        with monkeypatch.context() as patch:
            patch.setattr(kik_piotrowski, "_PITCH", 1e-9)
            all_of_them = patches(shift, yaw)[1]
        for name in (
            "normal_force",
            "max_pressure",
            "approach",
            "vertical_displacement",
        ):
            np.testing.assert_allclose(
                getattr(few, name), getattr(all_of_them, name), rtol=limit
            )
        length = (all_of_them.patch.x_lead - all_of_them.patch.x_trail).max()
        np.testing.assert_allclose(
            few.patch.x_lead,
            all_of_them.patch.x_lead,
            rtol=0.0,
            atol=10.0 * limit * length,
        )


@pytest.mark.parametrize("yaw", [0.0, 0.01])
def test_rough_solutions_are_near(patches, yaw):
    """They carry the load; 3 % of it in each patch, planes to 10 mrad."""
    for shift in (-4e-3, 0.0, 3e-3, 5.5e-3):
        exact = patches(shift, yaw)[1]
        rough = patches(shift, yaw, rough=True)[1]
        assert np.cos(rough.contact_angle) @ rough.normal_force == pytest.approx(
            80e3, rel=1e-12
        )
        np.testing.assert_allclose(
            rough.normal_force, exact.normal_force, atol=0.03 * 80e3
        )
        np.testing.assert_allclose(rough.contact_angle, exact.contact_angle, atol=0.01)


def test_each_patch_has_the_strips_of_its_size(s1002, rail_60e1):
    """The patches of a batch are those solved alone, with strips without length behind
    their own.
    """
    wheel, rail = (
        geometry.wheel_surface(s1002, 0.46),
        geometry.counterface_profile(rail_60e1),
    )
    pose = WheelsetPose(np.array([-3e-3, 0.0, 5e-3]), np.full(3, 0.01), np.zeros(3))
    gap = geometry.gap(
        wheel, rail, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0
    )
    options = {"vertical": True, "effective_modulus": E_STAR, "parameters": {}}
    options["resolution"] = Resolution(0.4e-3, 5, 5, 100)
    both = kik_piotrowski.solve(gap, np.array([0, 2]), np.full(2, 80e3), **options)
    strips, length = both.patch.strips, both.patch.x_lead - both.patch.x_trail
    assert strips.min() < strips.max() == length.shape[1]
    for m, count in enumerate(strips):
        assert count == np.ceil(both.patch.lateral_extent[m] / 0.4e-3)
        assert length[m, :count].min() > 0.0
        assert not length[m, count:].any()
        assert np.all(both.edge_y[m, count:] == both.edge_y[m, count])
    alone = kik_piotrowski.solve(gap, np.array([2]), np.full(1, 80e3), **options)
    here, count = both.patch.row == 2, alone.patch.y.shape[1]
    np.testing.assert_array_equal(
        alone.patch.x_lead, both.patch.x_lead[here][:, :count]
    )
    np.testing.assert_array_equal(alone.normal_force, both.normal_force[here])


@given(st.lists(st.integers(0, 30), min_size=3, max_size=40, unique=True))
def test_basins_join_as_the_flood_says(heights):
    """Flooding level by level with sets of points, the slow way."""
    gap = np.array([100.0, *map(float, heights), 100.0])
    basins = np.zeros(gap.size // 2, BASIN).view(np.recarray)
    actual = find_basins(gap, 99.0, basins)
    order = basins.order[:actual]
    place = [
        i
        for i in range(1, gap.size - 1)
        if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1]
    ]
    assert actual == len(place)
    level = dict(
        zip(place, basins.height[:actual], strict=True)
    )  # of the parabola through three points
    assert basins.height[order].tolist() == sorted(level.values())
    joins = {}
    lakes = []
    for i in np.argsort(gap):
        touching = [lake for lake in lakes if i - 1 in lake or i + 1 in lake]
        lakes = [lake for lake in lakes if lake not in touching]
        deep = sorted(
            (min(lake & set(place), key=level.get) for lake in touching), key=level.get
        )
        for other in deep[1:]:
            joins[place.index(other)] = (place.index(deep[0]), gap[i])
        lakes.append({i}.union(*touching))
    for k in range(actual):
        if k == order[0]:
            assert basins[k].parent == -1
        else:
            assert (basins[k].parent, basins[k].saddle) == joins[k]
