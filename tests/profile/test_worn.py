"""Wear between two profiles: closed forms, exact zero, other points and other
extents.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.errors import ProfileError
from wearsim.profile.shape import (
    Profile,
    offset_distance,
    resample,
    vertex_lengths,
    vertex_normals,
)
from wearsim.profile.standard import rail, wheel
from wearsim.profile.worn import wear_between, worn_amounts

NEW = wheel("S1002")
RAIL = rail("60E1", 1.0 / 40.0, 1.435, 0.750)


def worn_by_law(spacing=0.25e-3):
    """S1002 worn on tread and flank, vertices moved so that the area is the law's, and
    the area.
    """
    even = resample(NEW, spacing)
    y = 1e3 * even.y
    active = np.arange(len(y)) > np.argmax(even.z)
    law = 1.5e-3 * np.exp(-(((y + 2.0) / 24.0) ** 4))
    law += np.where(active, 1.2e-3 * np.exp(-(((y + 38.5) / 4.5) ** 2)), 0.0)
    moved = offset_distance(even.y, even.z, law)
    ny, nz = vertex_normals(even.y, even.z)
    after = Profile("worn", "wheel", even.y + ny * moved, even.z + nz * moved)
    return even, moved, after, float(np.sum(law * vertex_lengths(even.y, even.z)))


@pytest.mark.parametrize("shape", [NEW, RAIL, wheel("P8")], ids=lambda p: p.name)
def test_equal_profiles_have_exactly_no_wear(shape):
    wear = wear_between(shape, replace(shape, name="again"))
    assert wear.worn_area == 0.0
    assert not wear.depth.any()
    assert set(wear.zone_areas.values()) == {0.0}
    assert wear.compared_length == wear.length


def arc(kind, radius, bowl, half_angle, count):
    t = np.linspace(-half_angle, half_angle, count)
    sign = (1.0 if kind == "wheel" else -1.0) * (-1.0 if bowl else 1.0)
    return Profile("arc", kind, radius * np.sin(t), sign * radius * np.cos(t))


@pytest.mark.parametrize("kind", ["wheel", "rail"])
@pytest.mark.parametrize("bowl", [False, True])
@pytest.mark.parametrize("radius", [12e-3, 50e-3, 300e-3])
def test_concentric_arcs(kind, bowl, radius):
    """Depth to the bulge of chords of 0.1 mm, h^2/8/R = 0.1 um on 12 mm; area of the
    ring sector.
    """
    half = min(1.2, 0.06 / radius)
    inner = radius + (1e-3 if bowl else -1e-3)
    wear = wear_between(
        arc(kind, radius, bowl, half, 401), arc(kind, inner, bowl, 1.05 * half, 331)
    )
    assert np.max(np.abs(wear.depth - 1e-3)) < 0.13e-6
    assert wear.worn_area == pytest.approx(half * abs(radius**2 - inner**2), rel=2e-4)
    added = wear_between(
        arc(kind, inner, bowl, half, 401), arc(kind, radius, bowl, 1.05 * half, 331)
    )
    assert np.max(np.abs(added.depth + 1e-3)) < 0.13e-6
    assert added.worn_area == pytest.approx(-half * abs(radius**2 - inner**2), rel=2e-4)


def test_depth_and_area_of_a_wear_law_on_tread_and_flank():
    """Imposed depths at the vertices, within the bend of the profile over a step of
    0.25 mm.
    """
    even, moved, after, area = worn_by_law()
    wear = wear_between(NEW, after)
    assert wear.worn_area == pytest.approx(area, rel=2e-5)
    tread = wear.y > -30e-3
    active = even.y > -50e-3
    assert (
        np.max(
            np.abs(wear.depth - np.interp(wear.y, even.y[active], moved[active]))[tread]
        )
        < 0.5e-6
    )
    flank = (wear.y > -45e-3) & ~tread
    assert (
        np.max(
            np.abs(wear.depth - np.interp(wear.y, even.y[active], moved[active]))[flank]
        )
        < 3e-6
    )
    assert wear.max_wear_depth == pytest.approx(np.max(moved), abs=1e-6)
    assert abs(wear.max_wear_depth_y + 2e-3) < 5e-3


def test_area_is_the_integral_of_depth_and_curvature():
    """A = integral of d - k d^2/2, k > 0 where normals meet; the error falls with the
    step.
    """
    _, _, after, _ = worn_by_law()
    errors = []
    for spacing in (0.2e-3, 0.05e-3):
        wear = wear_between(NEW, after, spacing=spacing)
        heading = np.unwrap(np.arctan2(np.gradient(wear.z), np.gradient(wear.y)))
        curvature = -np.gradient(heading, wear.s)
        integral = np.trapezoid(wear.depth - 0.5 * curvature * wear.depth**2, wear.s)
        errors.append(abs(integral / wear.worn_area - 1.0))
    assert errors[0] < 5e-5
    assert errors[1] < 5e-6


def test_a_lowered_cylinder_has_the_area_of_a_rectangle():
    y = np.linspace(-30e-3, 60e-3, 91)
    flat = Profile("flat", "wheel", y, np.zeros_like(y))
    wear = wear_between(flat, replace(flat, z=flat.z - 2e-3))
    assert wear.worn_area == pytest.approx(2e-3 * 90e-3, rel=1e-12)
    assert np.allclose(wear.depth, 2e-3, rtol=0.0, atol=1e-15)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(
    depth=st.floats(-1e-3, 3e-3),
    centre=st.floats(-20e-3, 40e-3),
    width=st.floats(3e-3, 15e-3),
    step=st.floats(0.1e-3, 0.6e-3),
)
def test_area_does_not_depend_on_the_points_of_the_measurement(
    depth, centre, width, step
):
    """A groove cut straight down: its area is that of the bell, whatever points the
    measurement has.
    """
    even = resample(NEW, step)
    after = replace(
        even, z=even.z - depth * np.exp(-(((even.y - centre) / width) ** 2))
    )
    low, high = -34e-3, 59e-3  # beyond, the flank and the chamfer cut the bell off
    wear = wear_between(NEW, after)
    y = np.linspace(low, high, 20001)
    bell = np.trapezoid(depth * np.exp(-(((y - centre) / width) ** 2)), y)
    missed = (
        abs(depth)
        * width
        * (
            np.exp(-(((high - centre) / width) ** 2))
            + np.exp(-(((low - centre) / width) ** 2))
        )
    )
    assert wear.worn_area == pytest.approx(
        bell, abs=2e-4 * abs(depth) * width + 3.0 * missed + 5e-10
    )


def test_zones_add_up_and_lie_where_they_say():
    _, _, after, _ = worn_by_law()
    wear = wear_between(NEW, after)
    assert list(wear.zone_areas) == ["flange", "flange root", "tread", "field side"]
    assert sum(wear.zone_areas.values()) == pytest.approx(wear.worn_area, rel=1e-12)


def test_rail_zones():
    worn = replace(RAIL, z=RAIL.z + 1e-3 * np.exp(-(((RAIL.y - 5e-3) / 8e-3) ** 4)))
    wear = wear_between(RAIL, worn)
    assert list(wear.zone_areas) == ["gauge corner", "top", "field side"]
    assert wear.zone_areas["top"] == pytest.approx(wear.worn_area, rel=1e-3)
    assert wear.max_wear_depth == pytest.approx(1e-3, abs=1e-6)


def test_only_the_common_part_is_compared_and_told():
    _, _, after, _ = worn_by_law()
    keep = (after.y > -45e-3) & (after.y < 40e-3)
    short = replace(after, y=after.y[keep], z=after.z[keep])
    wear = wear_between(NEW, short)
    whole = wear_between(NEW, after)
    assert wear.y[0] > -46e-3
    assert wear.y[-1] < 40e-3
    assert wear.compared_length < 0.7 * wear.length
    assert np.all(np.isfinite(wear.depth))
    assert "mm of 160.5 mm of S1002" in wear.note
    assert wear.max_wear_depth == pytest.approx(whole.max_wear_depth, abs=0.1e-6)
    longer = wear_between(short, NEW)
    assert longer.compared_length > 0.99 * longer.length
    assert longer.worn_area == pytest.approx(-wear.worn_area, rel=0.01)


def test_profiles_that_cannot_be_compared_are_refused():
    with pytest.raises(
        ProfileError, match="do not lie on each other; align them first"
    ):
        wear_between(NEW, replace(NEW, z=NEW.z - 20e-3))
    with pytest.raises(ProfileError, match="do not lie on each other"):
        wear_between(NEW, replace(NEW, y=NEW.y + 1.0))
    gap = np.where((NEW.y > 0.0) & (NEW.y < 30e-3), 15e-3, 0.0)
    with pytest.raises(
        ProfileError,
        match=r"worn is nowhere within 12 mm of S1002 along its normal at y = ",
    ):
        wear_between(NEW, replace(NEW, name="worn", z=NEW.z - gap))


def test_profiles_are_aligned_on_request():
    """A wheel measured with a gauge that was not zeroed: its wear is that of the wheel
    as it stands.
    """
    worn = replace(NEW, z=NEW.z - 0.4e-3 * np.exp(-((NEW.y / 12e-3) ** 2)))
    placed = replace(worn, y=worn.y + 0.3e-3, z=worn.z - 0.2e-3)
    true, fitted = wear_between(NEW, worn), wear_between(NEW, placed, align="best_fit")
    assert fitted.max_wear_depth == pytest.approx(true.max_wear_depth, abs=2e-6)
    assert abs(wear_between(NEW, placed).worn_area - true.worn_area) > 1e-5
    with pytest.raises(
        ProfileError, match="align = 'fit' is not one of none, best_fit"
    ):
        wear_between(NEW, placed, align="fit")
    with pytest.raises(ProfileError, match="is a wheel and other a rail") as caught:
        wear_between(NEW, replace(NEW, name="other", kind="rail"))
    assert "\n" not in str(caught.value)


def test_worn_amounts_are_the_deepest_points_of_their_zones():
    y = 1e-3 * np.array([-69.0, -45.0, -39.0, -37.0, -30.0, -25.0, 0.0, 31.0, 33.0])
    depth = 1e-3 * np.array([0.0, 0.2, 0.3, 0.6, 0.5, 0.4, 0.1, 0.7, 0.9])
    assert worn_amounts(y, depth) == {
        "flange_wear": 0.3e-3,
        "root_wear": 0.6e-3,
        "tread_wear": 0.7e-3,  # without the field side
    }
    assert worn_amounts(y[6:], depth[6:])["flange_wear"] == 0.0
