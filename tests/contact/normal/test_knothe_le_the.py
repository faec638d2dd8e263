"""The strip model: ellipses of Hertz, a half-space program's patches, and what must not depend on strips."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
import pytest
from closed_forms import hertz

import wearsim
from wearsim.contact import geometry
from wearsim.contact.geometry import CounterfaceProfile, Gap, WheelsetPose
from wearsim.contact.normal import half_space
from wearsim.contact.normal.hertz import axis_ratio
from wearsim.contact.normal.knothe_le_the import solve
from wearsim.contact.normal.knothe_le_the.equations import averages, in_the_middle, influence_table
from wearsim.contact.patch import Resolution
from wearsim.contact.solve import solve as solve_contact
from wearsim.errors import ContactError

DATA = Path(__file__).parents[2] / "data"
E_STAR = 210e9 / (2.0 * (1.0 - 0.3**2))
RADIUS = 0.46

# Right wheel, S1002 on 60E1 1:40, yaw 0: curvature of the counterface [1/m], shift [m], normal force times
# cosine of the contact angle [N], area [m2] and maximum pressure [Pa]. Two humps, or two parts a few
# millimetres apart; made by the program and settings of tests/data/contact_half_space.csv.
SPLIT = np.array(
    [
        [0, 0, 79921.7, 0.00016744, 8.98622e08],
        [1, 0, 79920.9, 0.00014244, 1.01293e09],
        [1, 0.005, 79147.6, 9.372e-05, 2.05406e09],
        [1, 0.0055, 78292.9, 7.912e-05, 3.04951e09],
        [2, 0, 79919.5, 0.0001264, 1.10972e09],
    ]
)


def solved(gap, load, strips=50, vertical=True, options=MappingProxyType({}), **parameters):
    load = np.atleast_1d(np.asarray(load, dtype=float))
    return solve(
        gap,
        np.arange(load.size),
        load,
        vertical=vertical,
        effective_modulus=E_STAR,
        resolution=Resolution(1.0, strips, strips, strips),
        parameters=parameters,
        **options,
    )


def parabola(curvature, offset=0.0, reach=30e-3):
    """Wheel of constant radius over a flat counterface: gap `curvature` (y - offset)^2 across."""
    y = np.linspace(-reach, reach, 3001)
    zero = np.zeros_like(y)
    return Gap(
        CounterfaceProfile(y, zero, zero, zero),
        0.0,
        (curvature * (y - offset) ** 2)[None],
        y[None],
        zero[None],
        RADIUS + zero[None],
        zero[None],
    )


def ellipse_of(ratio, middle=6e-3):
    """Curvature across [1/m], load [N] and Hertz's ellipse with a/b = ratio and sqrt(ab) = middle."""
    along = 0.5 / RADIUS
    quotient = np.exp(np.linspace(12.0, -12.0, 4801))  # a/b rises as A/B falls
    across = along / np.exp(np.interp(np.log(ratio), np.log(axis_ratio(quotient)), np.log(quotient)))
    unit = hertz(along, across, 1.0, E_STAR)
    load = middle**3 / float(unit.semi_axis_x * unit.semi_axis_y) ** 1.5
    return across, load, hertz(along, across, load, E_STAR)


@pytest.fixture(scope="module")
def gap_of(s1002, rail_60e1):
    """Factory of gaps of S1002 on 60E1."""
    wheel, ground = geometry.wheel_surface(s1002, RADIUS), geometry.counterface_profile(rail_60e1)

    def gap(shift, yaw=0.0, curvature=0.0):
        shift = np.atleast_1d(shift).astype(float)
        pose = WheelsetPose(shift, yaw + np.zeros_like(shift), np.zeros_like(shift))
        return geometry.gap(wheel, ground, pose, half_span=0.75, nominal_radius=RADIUS, curvature=curvature)

    return gap


def test_influence_of_a_long_narrow_strip():
    """Far out along its line F is pi/2 ln 2Y less the potential of a semicircle; the table's steps: 1e-4."""
    distance = 200.0
    # Mean over the strip of t^2 - 1/2 - ln 2 with both weights: t^2 is 1/4 and 3/4.
    for k, square in enumerate((0.25, 0.75)):
        expected = 0.5 * np.pi * (np.log(2.0 * distance) - square + 0.5 + np.log(2.0))
        assert averages(influence_table(), 0.0, np.log(distance))[k] == pytest.approx(expected, rel=1e-4)


def test_influence_under_the_middle_of_a_strip():
    """A target much shorter than the strip sees F(0, Y), here by quadrature in the angle."""
    angle = (np.arange(200000) + 0.5) * 0.5 * np.pi / 200000
    for distance in (0.03, 1.0, 30.0):
        reference = np.pi / 200000 * np.sum(np.cos(angle) ** 2 * np.arcsinh(distance / np.sin(angle)))
        first, second = averages(influence_table(), -5.0, np.log(distance))[:2]
        assert first == pytest.approx(reference, rel=3e-4)
        assert second == pytest.approx(reference, rel=3e-4)
        assert in_the_middle(influence_table(), np.log(distance)) == pytest.approx(reference, rel=3e-4)


@pytest.mark.parametrize("ratio", [0.0, -0.6, -2.0])
def test_averages_of_the_longer_strip_are_derivatives(ratio):
    """M of either strip is N and its derivative by the length of that strip, N taken the same for both."""
    table, y, step = influence_table(), np.log(0.4), 0.05
    shorter, longer = averages(table, ratio, y)[1:3]
    by_ratio = 0.5 * (averages(table, ratio, y)[0] - averages(table, ratio - 2.0 * step, y)[0]) / step
    mean = averages(table, ratio - step, y)
    assert mean[0] + by_ratio == pytest.approx(mean[1], rel=5e-3)  # the step's square
    by_distance = 0.5 * (averages(table, ratio, y + step)[0] - averages(table, ratio, y - step)[0]) / step
    assert 2.0 * averages(table, ratio, y)[0] - shorter - by_distance == pytest.approx(longer, rel=1e-3)
    if ratio == 0.0:
        assert longer == pytest.approx(shorter, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.1, 0.3, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("offset", [0.0, 0.37e-3])
def test_ellipses_of_hertz(ratio, offset):
    """Twenty strips: 0.4 % of everything, but for the width and the area of very long patches, 1 %."""
    across, load, exact = ellipse_of(ratio)
    got = solved(parabola(across, offset), load, 200, vertical=False)
    assert got.max_pressure[0] == pytest.approx(float(exact.max_pressure), rel=4e-3)
    assert got.approach[0] == pytest.approx(float(exact.approach), rel=2e-3)
    assert 0.5 * got.patch.length[0] == pytest.approx(float(exact.semi_axis_x), rel=4e-3)
    assert 0.5 * got.patch.lateral_extent[0] == pytest.approx(float(exact.semi_axis_y), rel=1e-2)
    assert got.patch.area[0] == pytest.approx(float(exact.area), rel=4e-3 if ratio < 2.0 else 1e-2)
    assert got.centre_y[0] == pytest.approx(offset, abs=1e-6)


def test_ellipse_converges_with_the_strips_solved_for():
    across, load, exact = ellipse_of(1.0, 2e-3)  # so small that strips are no narrower than asked for
    error = [
        abs(
            solved(parabola(across), load, 400, vertical=False, solved_strips=n).patch.area[0] / exact.area
            - 1
        )
        for n in (10.0, 20.0, 40.0)
    ]
    assert error[1] < 0.7 * error[0]
    assert error[2] < 0.7 * error[1]


@pytest.fixture(scope="module")
def single():
    return pd.read_csv(DATA / "contact_half_space.csv", comment="#")


def test_single_patches_of_a_half_space_program(single, gap_of):
    """65 patches, no factor fitted; that program counts cells of 0.2 mm, which makes areas 1 % larger."""
    area, pressure = [], []
    for curvature, rows in single.groupby("curvature"):
        gap = gap_of(rows["shift"].to_numpy(), rows.yaw.to_numpy(), curvature)
        got = solved(gap, rows.normal_force.to_numpy(), vertical=False)
        area.append(got.patch.area / rows.area.to_numpy() - 1.0)
        pressure.append(got.max_pressure / rows.max_pressure.to_numpy() - 1.0)
    area, pressure = np.concatenate(area), np.concatenate(pressure)
    assert area.size == 65
    assert np.abs(area).max() < 0.025
    assert -0.015 < np.median(area) < 0.0
    assert np.abs(pressure).max() < 0.008


def test_split_patches_of_a_half_space_program(gap_of):
    """Parts of one patch press each other apart: 2.5 % in the area, 3.5 % in the pressure."""
    assert len(SPLIT) > 4
    for curvature, shift, load, area, pressure in SPLIT:
        got = solved(gap_of(shift, 0.0, curvature), load)
        assert got.patch.area.sum() == pytest.approx(area, rel=0.025)
        assert got.max_pressure.max() == pytest.approx(pressure, rel=0.035)


def test_parts_feel_each_other():
    """Two like contacts 12 mm apart sink in further than each alone with half the load."""
    across, load, exact = ellipse_of(1.0, 2e-3)
    y = np.linspace(-30e-3, 30e-3, 3001)
    zero = np.zeros_like(y)
    heights = across * np.minimum((y - 6e-3) ** 2, (y + 6e-3) ** 2)
    gap = Gap(
        CounterfaceProfile(y, zero, zero, zero),
        0.0,
        heights[None],
        y[None],
        zero[None],
        RADIUS + zero[None],
        zero[None],
    )
    got = solved(gap, 2.0 * load)
    # The other's load from 12 mm away, as a point's: N / (pi E* d), less the growth of the patch by it.
    further = load / (np.pi * E_STAR * 12e-3)
    np.testing.assert_allclose(got.normal_force, load, rtol=1e-6)
    np.testing.assert_allclose(got.approach, float(exact.approach) + further, rtol=3e-3)


def test_parts_near_each_other_share_a_plane_and_a_point(gap_of):
    """Two parts 8 mm apart and 0.1 rad: one plane, one point for the creepages; far apart each its own."""
    near = solved(gap_of(5e-3), 80e3)
    assert near.patch.row.size == 2
    assert near.contact_angle[0] == pytest.approx(near.contact_angle[1], abs=2e-4)
    assert near.reference_point.y[0] == pytest.approx(near.reference_point.y[1], abs=1e-9)
    middle = (near.normal_force * near.centre_y).sum() / near.normal_force.sum()
    assert near.reference_point.y[0] == pytest.approx(middle, abs=1e-9)
    apart = np.diff(near.reference_point.across) * np.cos(near.contact_angle[0])
    assert apart == pytest.approx(np.diff(near.centre_y), rel=0.05)
    alone = solved(gap_of(0.0), 80e3)
    assert alone.reference_point.y == pytest.approx(alone.centre_y, abs=1e-12)
    assert alone.reference_point.across == pytest.approx(0.0, abs=1e-12)
    assert alone.reference_point.approach == pytest.approx(alone.approach, rel=1e-12)


def test_pressure_follows_the_shift_without_jumps(gap_of):
    """From one part through a split to the other in steps of 20 um: pressure and area, 12 % each."""
    shift = np.arange(4.4e-3, 5.8e-3, 20e-6)
    got = solved(gap_of(shift), np.full(shift.size, 80e3))
    pressure = np.array([got.max_pressure[got.patch.row == k].max() for k in range(shift.size)])
    area = np.bincount(got.patch.row, got.patch.area)
    assert np.abs(np.diff(np.log(pressure))).max() < 0.12
    assert np.abs(np.diff(np.log(area))).max() < 0.12
    first = np.flatnonzero(np.diff(got.patch.row, prepend=-1))
    assert np.abs(np.diff(got.vertical_displacement[first])).max() < 12e-6


def test_a_load_from_nothing_to_three_hundred_kilonewton(gap_of):
    """Always a solution; within one part of the profile between the powers of Hertz."""
    load = np.geomspace(1.0, 300e3, 40)
    got = solved(gap_of(np.full(40, -4e-3)), load)
    assert got.patch.row.size == 40
    growth = np.diff(np.log(got.max_pressure)) / np.diff(np.log(load))
    # Below a newton or two the patch is as small as the profile's points are apart.
    assert np.all((growth > 0.1) & (growth < 0.5))
    assert np.all(np.abs(growth[load[1:] > 1e3] - 1.0 / 3.0) < 0.02)


def test_rough_solutions_and_starts(gap_of):
    """Rough: forces of single patches within 1 %. A start changes nothing beyond the tolerance, 1e-4."""
    shift, load = np.array([-4e-3, -3e-3, 2e-3, 4e-3]), np.full(4, 80e3)
    gap = gap_of(shift, 0.005)
    exact = solved(gap, load)
    rough = solved(gap, load, options={"rough": True})
    np.testing.assert_array_equal(rough.patch.row, exact.patch.row)
    np.testing.assert_allclose(rough.normal_force, exact.normal_force, rtol=0.01)
    again = solved(gap, load, options={"start": solved(gap, 1.05 * load)})
    np.testing.assert_allclose(again.normal_force, exact.normal_force, rtol=1e-3)
    np.testing.assert_allclose(again.max_pressure, exact.max_pressure, rtol=1e-3)


def test_a_solution_from_one_that_settled_hardly_moves(gap_of):
    """Strips stay where they were laid, but for ends that just miss their place: in one of five poses.

    Rolls of a wheelset are compared to 1e-9 m: displacements to two of them.
    """
    gap, load = gap_of(1e-3 * np.linspace(-6.0, 6.0, 49)), np.full(49, 80e3)
    settled = solved(gap, load, options={"start": solved(gap, load)})
    again = solved(gap, load, options={"start": settled})
    np.testing.assert_array_equal(again.layout.strips, settled.layout.strips)
    same = (again.layout.ends == settled.layout.ends).all(axis=1)
    assert same.mean() > 0.75
    np.testing.assert_allclose(
        again.vertical_displacement, settled.vertical_displacement, rtol=0.0, atol=2e-9
    )
    np.testing.assert_allclose(again.max_pressure, settled.max_pressure, rtol=1e-3)


def test_each_patch_has_the_strips_of_its_size(gap_of):
    """The patches of a batch are those solved alone, with strips without length behind their own."""
    shift, resolution = np.array([-4e-3, 0.0, 5e-3]), Resolution(0.4e-3, 5, 5, 60)
    gap = gap_of(shift)
    options = {"vertical": True, "effective_modulus": E_STAR, "resolution": resolution, "parameters": {}}
    both = solve(gap, np.array([0, 2]), np.full(2, 80e3), **options)
    patch = both.patch
    np.testing.assert_array_equal(patch.strips, resolution.strips_across(patch.width * patch.strips))
    assert set(patch.row) == {0, 2}
    assert patch.strips.min() < patch.strips.max() == patch.y.shape[1]
    for m, count in enumerate(patch.strips):
        assert (patch.x_lead - patch.x_trail)[m, :count].min() > 0.0
        assert not (patch.x_lead - patch.x_trail)[m, count:].any()
        assert np.all(both.edge_y[m, count:] == both.edge_y[m, count])
    alone = solve(gap, np.array([2]), np.full(1, 80e3), **options)
    np.testing.assert_array_equal(alone.max_pressure, both.max_pressure[patch.row == 2])
    count = alone.patch.y.shape[1]
    np.testing.assert_array_equal(alone.patch.x_lead, patch.x_lead[patch.row == 2][:, :count])


def test_soft_bodies_start_from_patches_of_less_load(gap_of):
    """E = 1 GPa is 210 times the load: 3 % of the half-space in area, 2 % in pressure; other rows stay."""
    gap, load = gap_of(np.full(2, 3e-3)), np.array([80e3, 210 * 80e3])
    got, alone = solved(gap, load), solved(gap, load[:1])
    soft = got.patch.row == 1
    options = {"vertical": True, "effective_modulus": E_STAR, "parameters": {}}
    exact = half_space.solve(gap, np.array([1]), load[1:], resolution=Resolution(1.0, 60, 60, 60), **options)
    assert got.patch.area[soft].sum() == pytest.approx(exact.patch.area.sum(), rel=0.03)
    assert got.max_pressure[soft].max() == pytest.approx(exact.max_pressure.max(), rel=0.02)
    np.testing.assert_array_equal(alone.max_pressure, got.max_pressure[~soft])


@pytest.mark.parametrize("load", [80e3, 150e3])
def test_a_profile_that_ends_beyond_the_patch_gives_its_patch(load):
    """Cut 1 mm off the patch, where trial ends overshoot: 1e-3 in pressure; cut within: no solution."""
    rail, wheelset = wearsim.rails("60E1", inclination=1 / 40, gauge=1.435), wearsim.wheelset("S1002")
    conditions = wearsim.ContactConditions.of([0.0], wheel_load=load)
    models = wearsim.ContactModels(normal="knothe_le_the", tangential="fastsim")

    def on(rail):
        return solve_contact(conditions, wheelset, rail, models, sides=(0,))

    def cut(y):
        keep = rail.profile.y > y
        return replace(rail, profile=replace(rail.profile, y=rail.profile.y[keep], z=rail.profile.z[keep]))

    whole = on(rail)
    end = whole.strip_edges_rail_y[0, 0]
    assert on(cut(end - 1e-3)).max_pressure == pytest.approx(whole.max_pressure, rel=1e-3)
    with pytest.raises(ContactError, match="edge of a profile"):
        on(cut(end + 1e-3))


@pytest.mark.parametrize("place", [2.725e-3, 2.75e-3, 2.775e-3, 2.8e-3])
def test_a_ridge_as_narrow_as_a_strip_keeps_its_length(place):
    """Next to a gap without pressure, where a strip or two carry a quarter of the load: no second solution.

    Of two strips that take their ratio from each other neither would know its length: pressures of 28 GPa,
    three times that of the half-space. Strips as wide as the ridge lose up to 40 % of its pressure.
    """
    gap = parabola(0.0)
    y = gap.counterface.y
    gap = replace(
        gap, gap=(40e-6 * (y / 2.8e-3) ** 6 - 45e-6 * np.exp(-(((y - place) / 0.25e-3) ** 2)))[None]
    )
    got = solved(gap, 80e3)
    options = {"vertical": True, "effective_modulus": E_STAR, "parameters": {}}
    exact = half_space.solve(
        gap, np.array([0]), np.array([80e3]), resolution=Resolution(0.2e-3, 20, 20, 120), **options
    )
    assert got.max_pressure.max() == pytest.approx(exact.max_pressure.max(), rel=0.42)
    assert got.patch.area.sum() == pytest.approx(exact.patch.area.sum(), rel=0.05)


@pytest.mark.parametrize("place", [-13.5e-3, -13.6e-3])
def test_a_strip_at_the_end_of_a_wide_patch_does_not_shrink_to_a_point(place):
    """Behind a strip without pressure, as on worn flange roots: 5 and 7 % below the half-space's pressure.

    Its length once went to nothing, with 50 GPa, as the change of a strip that short ended no solution.
    """
    gap = parabola(0.0)
    y = gap.counterface.y
    shallow = 51e-6 * (1.0 - np.exp(-((y / 4.2e-3) ** 2)))
    rise = 60.0 * np.minimum(y - place + 0.3e-3, 0.0) ** 2
    dip = 14e-6 * np.exp(-(((y - place) / 0.4e-3) ** 2))
    gap = replace(gap, gap=(np.where(y > 0.0, 4.0 * y**2, shallow) + rise - dip)[None])
    got = solved(gap, 82e3)
    options = {"vertical": True, "effective_modulus": E_STAR, "parameters": {}}
    exact = half_space.solve(
        gap, np.array([0]), np.array([82e3]), resolution=Resolution(0.2e-3, 20, 20, 120), **options
    )
    assert got.max_pressure.max() == pytest.approx(exact.max_pressure.max(), rel=0.08)
    assert got.vertical_displacement[0] == pytest.approx(exact.vertical_displacement[0], rel=3e-3)
