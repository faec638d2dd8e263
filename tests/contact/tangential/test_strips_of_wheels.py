"""Steady rolling on the strips of all patches of a wheel, each strip in a contact plane
of its own.
"""

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import frictional_power

from wearsim.contact.patch import Patch, StripPlanes
from wearsim.contact.tangential import StripMotion, coupled_strips
from wearsim.errors import ContactError

POISSON = 0.3
SHEAR_MODULUS = 210e9 / 2.6
A, B, LOAD, FRICTION = 6.5e-3, 5e-3, 80e3, 0.35
CREEPAGE = np.array([-1.6e-3, 4e-4, -0.2])


def solved(patch, motion=None, creepage=CREEPAGE, **more):
    count = len(patch.row)
    return coupled_strips.MODEL(
        patch,
        np.tile(creepage, (count, 1)),
        np.full(count, FRICTION),
        shear_modulus=SHEAR_MODULUS,
        poisson_ratio=POISSON,
        fields=True,
        strips=motion,
        **more,
    )


def strips_of(edges, a=A, b=B, load=LOAD, skew=0.1, origin=0.0):
    """Planes (1, N) of an ellipse of Hertz cut at edges (N + 1,)."""
    y = 0.5 * (edges[1:] + edges[:-1])
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    peak = load / (2.0 / 3.0 * np.pi * a * b) * half / a
    parts = y + origin, y + origin, np.diff(edges), half, skew * y, peak, 0.0 * y
    return StripPlanes(*(part[None] for part in parts))


def joined(planes):
    """Planes of patches (m, N), padded."""
    most = max(part.y.shape[1] for part in planes)
    names = vars(planes[0])
    return StripPlanes(
        **{
            name: np.concatenate(
                [
                    np.pad(vars(part)[name], [(0, 0), (0, most - part.y.shape[1])])
                    for part in planes
                ]
            )
            for name in names
        }
    )


def patch_of(planes, cut=None, cells=20):
    """Patches whose own strips are the solved ones, or put together by `cut` neighbours
    of equal width.
    """
    count = len(planes.y)
    normal = planes.peak * planes.half * planes.width
    mean = (normal * planes.station).sum(axis=1) / normal.sum(axis=1)
    y, half, middle, peak = (
        planes.station - mean[:, None],
        planes.half,
        planes.middle,
        planes.peak,
    )
    y = np.where(planes.width > 0.0, y, 0.0)
    strips = (planes.width > 0.0).sum(axis=1)
    width = planes.width.max(axis=1)
    if cut is not None:
        load = (peak * half).reshape(count, -1, cut).mean(axis=2)
        y, half, middle = (
            part.reshape(count, -1, cut).mean(axis=2) for part in (y, half, middle)
        )
        peak, width, strips = load / half, cut * width, strips // cut
    slope = np.divide(peak, half, out=np.zeros_like(half), where=half > 0.0)
    return Patch(
        np.arange(count),
        y,
        width,
        middle + half,
        middle - half,
        slope,
        0.0 * y,
        strips,
        np.full(count, cells),
        planes=planes,
    )


def motion_of(planes, creepage=CREEPAGE, wheel=None, friction=FRICTION):
    """Motion of strips that lie in one plane, whose origin is that of the stations."""
    of_strips = np.tile(np.asarray(creepage, dtype=float), (*planes.y.shape, 1))
    of_strips[:, :, 0] -= of_strips[:, :, 2] * planes.station
    wheel = (
        np.zeros(len(planes.y), dtype=np.int64) if wheel is None else np.asarray(wheel)
    )
    return StripMotion(wheel, of_strips, np.full(planes.y.shape, friction))


def part_of(planes, first, last):
    return StripPlanes(
        **{name: value[:, first:last] for name, value in vars(planes).items()}
    )


EQUAL = np.linspace(-B, B, 13)
SIZE = FRICTION * LOAD * np.array([1.0, 1.0, A])
"""Of forces and moments."""


# ---- the same wheel in other words


def test_strips_in_one_plane_are_the_patch_in_one_plane():
    """Strips that coincide: tractions to rounding; forces to what the bound cuts from
    cells.
    """
    planes = strips_of(EQUAL)
    patch = patch_of(planes)
    plain, wheel = solved(replace(patch, planes=None)), solved(patch, motion_of(planes))
    np.testing.assert_allclose(wheel.cells, plain.cells, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(wheel.slip_area, plain.slip_area, rtol=1e-9)
    np.testing.assert_allclose(wheel.force / SIZE, plain.force / SIZE, atol=1e-4)
    np.testing.assert_allclose(
        wheel.strip_force.sum(axis=1)[0, :2], wheel.force[0, :2], rtol=1e-12
    )
    assert plain.strip_force is None


@pytest.mark.parametrize("creepage", [CREEPAGE, (5e-5, 5e-5, 0.02), (0.0, 2e-3, 1.0)])
def test_names_of_patches_do_not_matter(creepage):
    """One patch, or its halves as two patches: rounding."""
    planes = strips_of(np.sort(np.append(EQUAL, [1.1e-3, -2.8e-3])))
    halves = joined([part_of(planes, 0, 5), part_of(planes, 5, 14)])
    whole = solved(patch_of(planes), motion_of(planes, creepage), creepage)
    parts = solved(patch_of(halves), motion_of(halves, creepage), creepage)
    of_parts = np.concatenate((parts.strip_force[0, :5], parts.strip_force[1]))
    np.testing.assert_allclose(of_parts / SIZE, whole.strip_force[0] / SIZE, atol=1e-9)
    assert not parts.strip_force[0, 5:].any()
    np.testing.assert_allclose(
        parts.force.sum(axis=0)[:2], whole.force[0, :2], rtol=1e-9
    )


def test_patches_may_have_centres_of_their_own():
    """Middles and creepage from other centres, and these told: rounding."""
    planes = strips_of(EQUAL)
    halves = joined([part_of(planes, 0, 5), part_of(planes, 5, 12)])
    motion, x = motion_of(halves), np.array([1.5e-3, -0.7e-3])
    moved = replace(halves, middle=halves.middle - x[:, None])
    across = motion.creepage[:, :, 1] + motion.creepage[:, :, 2] * x[:, None]
    creepage = np.stack(
        (motion.creepage[:, :, 0], across, motion.creepage[:, :, 2]), axis=2
    )
    same = solved(patch_of(halves), motion)
    other = solved(patch_of(moved), motion._replace(creepage=creepage, x=x))
    np.testing.assert_allclose(
        other.strip_force[:, :, :2], same.strip_force[:, :, :2], rtol=1e-8, atol=1e-5
    )
    moment = same.strip_force[:, :, 2] - x[:, None] * same.strip_force[:, :, 1]
    np.testing.assert_allclose(other.strip_force[:, :, 2], moment, rtol=1e-8, atol=1e-7)


def test_cells_do_not_know_the_names_of_patches():
    planes = strips_of(EQUAL)
    halves = joined([part_of(planes, 0, 5), part_of(planes, 5, 12)])
    whole, parts = (
        solved(patch_of(planes), motion_of(planes)),
        solved(patch_of(halves), motion_of(halves)),
    )
    of_parts = np.concatenate((parts.cells[:, 0, :, :5], parts.cells[:, 1]), axis=2)
    np.testing.assert_allclose(of_parts, whole.cells[:, 0], rtol=1e-7, atol=1e-12)


def test_order_of_patches_does_not_matter():
    """Patches are ordered by falling force, strips of a wheel by place."""
    planes = strips_of(EQUAL)
    left, right = part_of(planes, 0, 5), part_of(planes, 5, 12)
    there, back = (
        solved(patch_of(halves), motion_of(halves)).strip_force
        for halves in (joined([left, right]), joined([right, left]))
    )
    np.testing.assert_array_equal(back[::-1], there)


def test_wheels_of_a_batch_do_not_act_on_each_other():
    """The same bits as each alone."""
    one, other = (
        strips_of(EQUAL),
        strips_of(np.linspace(-B, B, 10), a=4e-3, origin=8e-3),
    )
    both = joined([one, other])
    apart = solved(patch_of(both), motion_of(both, wheel=[0, 1]))
    near = solved(patch_of(both), motion_of(both, wheel=[0, 0]))
    for m, planes in enumerate((one, other)):
        alone, count = solved(patch_of(planes), motion_of(planes)), planes.y.shape[1]
        np.testing.assert_array_equal(
            apart.strip_force[m, :count], alone.strip_force[0]
        )
        np.testing.assert_array_equal(apart.cells[:, m, :, :count], alone.cells[:, 0])
        np.testing.assert_array_equal(apart.slip_area[m], alone.slip_area[0])
    assert abs(near.force - apart.force)[:, :2].max() > 1e-3 * FRICTION * LOAD


def test_patches_far_apart_do_not_act_on_each_other(monkeypatch):
    """Slip falls with the square of the distance, also beyond the table of influence:
    1e-4 at 0.4 m.
    """
    monkeypatch.setattr(coupled_strips, "TOLERANCE", 1e-9)
    one, errors = strips_of(EQUAL), []
    alone = solved(patch_of(one), motion_of(one)).strip_force[0]
    for distance in (0.05, 0.1, 0.2, 0.4, 0.8):
        other = strips_of(EQUAL, origin=distance)
        motion = motion_of(one)
        both = joined([one, other])
        motion = StripMotion(
            np.array([0, 0]),
            np.repeat(motion.creepage, 2, axis=0),
            np.repeat(motion.friction, 2, axis=0),
        )
        errors.append(
            abs(solved(patch_of(both), motion).strip_force[0] - alone).max()
            / abs(alone).max()
        )
    assert errors[3] < 1e-4
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.2)


def test_mirrored_wheel_mirrors_lateral_forces_and_moments():
    """Rounding, through the iteration."""
    planes = strips_of(np.sort(np.append(EQUAL, [1.1e-3, -2.8e-3])))
    planes = replace(
        planes, angle=0.3 + 60.0 * planes.station + 3e3 * planes.station**2
    )
    motion = motion_of(planes)
    back = {name: value[:, ::-1] for name, value in vars(planes).items()}
    mirrored = StripPlanes(
        **{
            **back,
            "y": -back["y"],
            "station": -back["station"],
            "angle": -back["angle"],
        }
    )
    sign = np.array([1.0, -1.0, -1.0])
    there = solved(patch_of(planes), motion)
    other = solved(
        patch_of(mirrored), motion._replace(creepage=sign * motion.creepage[:, ::-1])
    )
    np.testing.assert_allclose(
        other.strip_force[:, ::-1] / SIZE, sign * there.strip_force / SIZE, atol=1e-9
    )
    np.testing.assert_allclose(other.force / SIZE, sign * there.force / SIZE, atol=1e-9)


def test_angle_of_all_strips_changes_nothing():
    planes = strips_of(EQUAL)
    planes = replace(planes, angle=60.0 * planes.station)
    turned = replace(planes, angle=planes.angle + 0.7)
    flat, steep = (solved(patch_of(each), motion_of(each)) for each in (planes, turned))
    np.testing.assert_allclose(
        steep.strip_force / SIZE, flat.strip_force / SIZE, atol=1e-9
    )
    np.testing.assert_allclose(steep.force / SIZE, flat.force / SIZE, atol=1e-9)


def test_stretched_wheel_has_the_same_matrix():
    """Lengths times k, spin over k: forces times k^2."""
    coupled_strips.influence._of_shape.cache_clear()
    edges = np.sort(np.append(EQUAL, [1.1e-3, -2.8e-3]))
    unit = strips_of(edges, origin=0.02)
    force = solved(patch_of(unit), motion_of(unit)).force[0]
    for scale in (0.3, 1.001, 3.0):
        lengths = {
            n: scale * vars(unit)[n]
            for n in ("y", "station", "width", "half", "middle")
        }
        wheel = replace(unit, **lengths)
        creepage = CREEPAGE / np.array([1.0, 1.0, scale])
        scaled = solved(patch_of(wheel), motion_of(wheel, creepage)).force[0]
        np.testing.assert_allclose(
            scaled, force * scale ** np.array([2.0, 2.0, 3.0]), rtol=1e-7
        )
    assert coupled_strips.influence._of_shape.cache_info().misses == 1


# ---- strips of unlike widths, planes and motion


def test_strips_of_unlike_widths_converge():
    """Widths that grow fourfold across the ellipse: of second order, to the same forces
    as equal strips.
    """
    exact = strips_of(np.linspace(-B, B, 49))
    exact, errors = solved(patch_of(exact), motion_of(exact)).force[0] / SIZE, []
    for count in (6, 12, 24):
        place = np.linspace(0.0, 1.0, count + 1)
        planes = strips_of(B * (2.0 * (place + 1.5 * place**2) / 2.5 - 1.0))
        planes = replace(
            planes,
            peak=planes.peak
            * LOAD
            / (0.5 * np.pi * planes.peak * planes.half * planes.width).sum(),
        )
        errors.append(
            abs(
                solved(patch_of(planes), motion_of(planes)).force[0] / SIZE - exact
            ).max()
        )
    assert errors[2] < 0.4 * errors[1] < 0.16 * errors[0]
    assert errors[2] < 3e-3


@pytest.mark.parametrize("which", [0, 4])
def test_strip_that_loses_contact_is_harmless(which, monkeypatch):
    """Forces go with its half-length to those without it, also far beyond the table of
    influence.
    """
    monkeypatch.setattr(coupled_strips, "TOLERANCE", 1e-9)
    planes = strips_of(EQUAL)
    rest = np.arange(12) != which
    without = StripPlanes(
        **{name: value[:, rest] for name, value in vars(planes).items()}
    )
    limit = solved(patch_of(without), motion_of(without)).strip_force[0] / SIZE
    share, change, own = 10.0 ** -np.arange(1.0, 9.0), [], []
    for part in share:
        half = planes.half.copy()
        half[:, which] *= part
        wheel = replace(planes, half=half)
        force = solved(patch_of(wheel), motion_of(wheel)).strip_force[0] / SIZE
        change.append(abs(force[rest] - limit).max())
        own.append(abs(force[which]).max())
    assert np.isfinite(change).all()
    assert np.all(np.array(own) < 0.2 * share)
    assert np.all(np.array(change) < 0.05 * share)


def test_forces_are_continuous_in_the_length_of_a_strip(monkeypatch):
    """Across the ends of the table, without slip: second differences are those of its
    lines, 1.3e-5.
    """
    monkeypatch.setattr(coupled_strips, "TOLERANCE", 1e-9)
    planes, forces = strips_of(EQUAL), []
    for part in np.linspace(0.02, 0.6, 59):
        half = planes.half.copy()
        half[:, 4] *= part
        wheel = replace(planes, half=half)
        forces.append(
            solved(patch_of(wheel), motion_of(wheel, 0.01 * CREEPAGE)).force[0] / SIZE
        )
    steps = np.array(forces) / abs(forces[0]).max()
    assert abs(np.diff(steps, 2, axis=0)).max() < 5e-5


def test_lateral_influence_is_turned_with_the_planes():
    """Those of x on x stay, across and mixed ones go with the cosine between the
    normals.
    """
    planes = strips_of(EQUAL)
    angle = 80.0 * planes.station[0]
    flat, bent = (
        coupled_strips.influence.slip_influence(
            coupled_strips.strips_of_wheels(
                patch_of(each),
                CREEPAGE[None],
                np.array([FRICTION]),
                motion_of(each),
                12,
            ),
            8,
            POISSON,
        )[0]
        for each in (planes, replace(planes, angle=angle[None]))
    )
    cosine = np.repeat(np.repeat(np.cos(angle[:, None] - angle), 8, axis=0), 9, axis=1)
    np.testing.assert_array_equal(bent[:, 0], flat[:, 0])
    np.testing.assert_allclose(bent[:, 1], cosine * flat[:, 1], rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(bent[:, 2], cosine * flat[:, 2], rtol=1e-10, atol=1e-14)


def test_each_strip_has_its_own_motion():
    """Halves that slide in opposite directions carry friction x load each, and the sums
    are of vectors.
    """
    planes = strips_of(EQUAL, skew=0.0)
    planes = replace(planes, angle=np.where(planes.station < 0.0, 0.2, 0.8))
    motion = motion_of(planes, (0.0, 0.0, 0.0))
    motion.creepage[:, :, 0] = np.where(planes.station < 0.0, 0.5, -0.5)
    result = solved(patch_of(planes), motion)
    carried = FRICTION * 0.5 * np.pi * planes.peak * planes.half * planes.width
    np.testing.assert_allclose(
        result.strip_force[:, :, 0],
        -np.sign(motion.creepage[:, :, 0]) * carried,
        rtol=1e-3,
    )
    assert result.force[0, 0] == pytest.approx(0.0, abs=1e-3 * FRICTION * LOAD)
    turning = -(planes.station * result.strip_force[:, :, 0]).sum()
    assert result.force[0, 2] == pytest.approx(turning, rel=1e-3)
    motion.creepage[:, :, :2] = 0.0, 0.5
    result = solved(patch_of(planes), motion)
    assert result.force[0, 1] == pytest.approx(-carried.sum() * np.cos(0.3), rel=1e-3)


def test_friction_is_that_of_the_strip():
    planes = strips_of(EQUAL)
    motion = motion_of(planes, (0.5, 0.0, 0.0))
    motion.friction[0, :4], motion.friction[0, 4:6] = 0.1, 0.0
    result = solved(patch_of(planes), motion)
    carried = motion.friction * 0.5 * np.pi * planes.peak * planes.half * planes.width
    np.testing.assert_allclose(
        -result.strip_force[:, :, 0], carried, rtol=1e-3, atol=1e-9
    )
    assert np.isfinite(result.cells).all()


def test_strips_without_friction_beside_others_slide_freely():
    """They carry their pressure and slip as rigid bodies do, without traction; the
    others do not notice.
    """
    planes = strips_of(EQUAL)
    patch, motion = patch_of(planes), motion_of(planes, (-1.6e-3, 4e-4, -0.8))
    rubbed = solved(patch, motion)
    motion.friction[0, 4:6] = 0.0
    result = solved(patch, motion)
    pressure, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0, :, 4:6]
    np.testing.assert_array_equal(pressure, rubbed.cells[0, 0, :, 4:6])
    assert not shear_x.any()
    assert not shear_y.any()
    along, across, spin = motion.creepage[0, 4:6].T
    x = (
        planes.middle[0, 4:6]
        + planes.half[0, 4:6] * (1.0 - (2.0 * np.arange(20) + 1.0) / 20)[:, None]
    )
    np.testing.assert_allclose(slip_x, along + 0.0 * x, rtol=1e-12)
    np.testing.assert_allclose(slip_y, across + spin * x, rtol=1e-12)
    assert not result.strip_force[0, 4:6].any()
    # as if the two strips were not there
    rest = np.r_[0:4, 6:12]
    without = StripPlanes(
        **{name: value[:, rest] for name, value in vars(planes).items()}
    )
    motion = StripMotion(
        motion.wheel, motion.creepage[:, rest], motion.friction[:, rest]
    )
    alone = solved(patch_of(without), motion).strip_force[0]
    np.testing.assert_allclose(
        result.strip_force[0, rest] / SIZE, alone / SIZE, atol=1e-6
    )


def test_motion_that_is_not_finite_is_refused():
    """But that of padding has no meaning."""
    planes = strips_of(EQUAL)
    wheel = joined([planes, part_of(planes, 0, 5)])
    motion = motion_of(wheel, wheel=[0, 1])
    motion.creepage[1, 5:], motion.friction[1, 5:] = np.nan, np.nan
    result = solved(patch_of(wheel), motion)
    assert np.isfinite(result.force).all()
    motion.creepage[1, 3, 1] = np.nan
    with pytest.raises(ContactError, match="must be finite") as caught:
        solved(patch_of(wheel), motion)
    assert caught.value.row == 1


def test_without_motion_of_its_strips_a_patch_lies_in_one_plane():
    patch = patch_of(strips_of(EQUAL))
    there, here = solved(patch), solved(replace(patch, planes=None))
    np.testing.assert_array_equal(there.force, here.force)
    np.testing.assert_array_equal(there.cells, here.cells)
    assert there.strip_force is None


def test_wheels_without_friction_have_no_forces():
    planes = joined([strips_of(EQUAL), strips_of(EQUAL, origin=0.1)])
    motion = motion_of(planes, wheel=[0, 1])
    motion.friction[0] = 0.0
    part = solved(patch_of(planes), motion)
    assert not part.strip_force[0].any()
    assert part.strip_force[1].any()
    motion.friction[1] = 0.0
    none = solved(patch_of(planes), motion)
    assert not none.force.any()
    np.testing.assert_allclose(none.slip_area, patch_of(planes).area, rtol=1e-12)


# ---- cells


@pytest.mark.parametrize(("count", "error"), [(24, 0.01), (48, 0.003)])
def test_cells_have_the_work_of_the_solved_strips(count, error):
    """Three solved strips in each strip of the patch; work per pressure is
    interpolated: second order.
    """
    planes, work = strips_of(np.linspace(-B, B, count + 1)), []
    for cut in (None, 3):
        patch = patch_of(planes, cut)
        result = solved(patch, motion_of(planes))
        _, shear_x, shear_y, slip_x, slip_y = result.cells[:, 0]
        each = (
            -(shear_x * slip_x + shear_y * slip_y).sum(axis=0)
            * result.cell_length[0]
            * patch.width[0]
        )
        work.append(each)
    fine, coarse = work[0].reshape(-1, 3).sum(axis=1), work[1]
    assert abs(coarse - fine).sum() < error * fine.sum()
    power = frictional_power(result.force, CREEPAGE[None], 1.0)[0]
    assert coarse.sum() == pytest.approx(power, rel=0.03)


def test_work_stays_in_the_patch_of_its_strips():
    """Also where strips of a patch reach over those of the next one: a fifth of a strip
    is 4 % of a patch.
    """
    planes = strips_of(EQUAL)
    halves = joined([part_of(planes, 0, 5), part_of(planes, 5, 12)])
    patch, work = patch_of(halves), []
    for shift in (0.0, 0.2, -0.2):
        moved = replace(patch, y=patch.y + shift * patch.width[:, None])
        _, shear_x, shear_y, slip_x, slip_y = solved(moved, motion_of(halves)).cells
        each = -(shear_x * slip_x + shear_y * slip_y).sum(axis=1) * (
            patch.x_lead - patch.x_trail
        )
        work.append(each.sum(axis=1))
    np.testing.assert_allclose(work[1:], [work[0], work[0]], rtol=0.05)


def test_pressure_of_the_cells_is_that_of_the_patch():
    patch = patch_of(strips_of(np.linspace(-B, B, 25)), 3)
    result = solved(patch, motion_of(patch.planes))
    area = result.cell_length[0] * patch.width[0]
    half = 0.5 * (patch.x_lead - patch.x_trail)
    load = 0.5 * np.pi * (patch.pressure_slope * half**2).sum() * patch.width[0]
    assert (result.cells[0, 0] * area).sum() == pytest.approx(load, rel=1e-9)
