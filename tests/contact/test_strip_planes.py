"""Patches whose strips lie in planes of their own: kinematics, sums and reports, with
two models as doubles.

The normal one cuts the patches of `kik_piotrowski` into strips, in one plane or along
the profile; the tangential one has the traction -K p (slip), whose integrals over a
strip are elementary.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.contact import wheels as wheels_module
from wearsim.contact.creepage import ContactPoint, kinematics
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import NORMAL_MODELS, kik_piotrowski
from wearsim.contact.normal.model import NormalModel
from wearsim.contact.patch import StripPlanes
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve
from wearsim.contact.tangential import (
    TANGENTIAL_MODELS,
    TangentialModel,
    TangentialSolution,
)
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.resultants import resultants

RADIUS, SPAN, SPEED = 0.46, 0.75, 20.0
K = 100.0


def cut(bent):
    """Normal model whose patches have strips in one plane each, or each in the plane of
    the profile there.
    """

    def solve(gap, row, load, **options):
        normal = kik_piotrowski.solve(gap, row, load, **options)
        if options["rough"]:
            return normal
        patch, profile = normal.patch, gap.counterface
        half, middle = (
            0.5 * (patch.x_lead - patch.x_trail),
            0.5 * (patch.x_lead + patch.x_trail),
        )
        y = 0.5 * (normal.edge_y[:, 1:] + normal.edge_y[:, :-1])
        station, angle = patch.y, normal.contact_angle[:, None] + 0.0 * y
        if bent:
            arc = np.cumsum(
                np.hypot(
                    np.diff(profile.y, prepend=profile.y[0]),
                    np.diff(profile.z, prepend=0),
                )
            )
            station, angle = (
                np.interp(y, profile.y, arc),
                np.interp(y, profile.y, profile.angle),
            )
        else:
            y = normal.centre_y[:, None] + np.cos(angle) * patch.y
        real = np.arange(y.shape[1]) < patch.strips[:, None]
        arrays = (
            y,
            station,
            patch.width[:, None],
            half,
            middle,
            patch.pressure_slope * half,
            angle,
        )
        planes = StripPlanes(*(np.where(real, one, 0.0) for one in arrays))
        normal = replace(normal, patch=replace(patch, planes=planes))
        if not bent:
            return normal
        total, angle = vector_sum(planes)
        return replace(normal, normal_force=total, contact_angle=angle)

    return NormalModel("cut", solve)


def vector_sum(planes):
    """Length and angle of the sum of the normal forces of strips."""
    across = (planes.normal_force * np.sin(planes.angle)).sum(axis=1)
    up = (planes.normal_force * np.cos(planes.angle)).sum(axis=1)
    return np.hypot(across, up), np.arctan2(across, up)


def slide(patch, creepage, friction, *, fields, strips=None, **_):
    """Traction -K p (slip) of every point."""
    half, middle = (
        0.5 * (patch.x_lead - patch.x_trail),
        0.5 * (patch.x_lead + patch.x_trail),
    )
    load = 0.5 * np.pi * patch.pressure_slope * half**2 * patch.width[:, None]
    if strips is None:
        along = creepage[:, :1] - creepage[:, 2:] * patch.y
        across, spin = creepage[:, 1:2], creepage[:, 2:]
    else:
        along, across, spin = np.moveaxis(strips.creepage, 2, 0)
    f_x, f_y = -K * load * along, -K * load * (across + spin * middle)
    moment = middle * f_y - K * load * spin * 0.25 * half**2
    lateral, arm, strip_force = f_y, patch.y, None
    if strips is not None:
        planes, strip_force = patch.planes, np.stack([f_x, f_y, moment], axis=2)
        lateral, arm = (
            f_y * np.cos(planes.angle - vector_sum(planes)[1][:, None]),
            planes.offset,
        )
    force = np.stack(
        [f_x.sum(axis=1), lateral.sum(axis=1), (moment - arm * f_x).sum(axis=1)], axis=1
    )
    shape = (
        1 if fields == "work" else 5,
        *patch.y.shape[:1],
        patch.cells.max(initial=1),
        patch.y.shape[1],
    )
    cells = np.zeros(shape) if fields else None
    length = 2.0 * half / patch.cells[:, None]
    return TangentialSolution(
        force, patch.area, patch.x_lead, length, cells, strip_force
    )


@pytest.fixture(params=["flat", "bent"])
def shape(request):
    return request.param


@pytest.fixture
def doubles(monkeypatch):
    """Names of the models of the registries that stand for both, and what `slide` was
    given at last.
    """
    seen = SimpleNamespace(strips=None)

    def watching(*arguments, **options):
        seen.strips, seen.creepage = options.get("strips"), arguments[1]
        return slide(*arguments, **options)

    for name in ("flat", "bent"):
        monkeypatch.setitem(NORMAL_MODELS, name, cut(name == "bent"))
    monkeypatch.setitem(
        TANGENTIAL_MODELS,
        "in_planes",
        TangentialModel("slide", watching, by_strips=True),
    )
    monkeypatch.setitem(TANGENTIAL_MODELS, "in_plane", TangentialModel("slide", slide))
    return seen


def models(normal, tangential="in_planes"):
    """On a grid whose patches have unlike numbers of strips."""
    return ContactModels(normal, tangential, strips=12, cells=10, cell_size=0.4e-3)


def values(solution, *left_out):
    """Arrays of patches by name."""
    arrays = vars(solution.patches())
    return {
        k: v
        for k, v in arrays.items()
        if k not in ("patch", "nearby", "point", "side", *left_out)
    }


# ------------------------------------------------------------------------- closed forms


def along_section(offset, angle, bend, kappa, **pose):
    """Creepage (N, 3) of a wheel and counterface of one section, at arc lengths (N,)
    from a point of it.

    A line at an angle, or with a bend [1/m] an arc: cone and torus.
    """
    turned = angle + bend * offset
    if bend:
        aside, down = (
            (np.sin(turned) - np.sin(angle)) / bend,
            (np.cos(angle) - np.cos(turned)) / bend,
        )
    else:
        aside, down = offset * np.cos(angle), offset * np.sin(angle)
    zero = np.zeros((1, offset.size))
    point = ContactPoint(
        -12e-3 + aside[None],
        0.4608 + down[None],
        zero,
        0.8e-3 + down[None],
        turned[None],
        zero,
        zero,
    )
    here = {"shift": 0.0, "yaw": 0.0, "roll": 0.0} | pose
    motion = kinematics(
        point,
        WheelsetPose(**{k: np.array([v]) for k, v in here.items()}),
        speed=np.array([SPEED]),
        track_curvature=np.zeros(1),
        half_span=SPAN,
        nominal_radius=RADIUS,
        curvature=kappa,
    )
    return motion.creepage(np.array([-SPEED / RADIUS]))[0], down


OFFSET = 1e-3 * np.array([0.0, -9.0, -3.0, 4.0, 8.0])


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize("angle", [-0.05, 0.6, -1.1])
def test_rigid_slip_along_a_cone_is_that_of_one_plane(kappa, angle):
    """xi_x - spin x arc, exactly: rounding."""
    slip, _ = along_section(OFFSET, angle, 0.0, kappa)
    np.testing.assert_allclose(slip[:, 0], slip[0, 0] - slip[0, 2] * OFFSET, atol=1e-14)
    np.testing.assert_allclose(
        slip[:, 1:], np.broadcast_to(slip[0, 1:], (5, 2)), atol=1e-14
    )
    assert slip[0, 2] == pytest.approx(
        np.sin(angle) * (1.0 / RADIUS + kappa), rel=1e-12
    )


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize("bend", [30.0, -80.0])
def test_rigid_slip_along_a_torus_differs_from_it_by_the_sagitta(kappa, bend):
    """In the rolling radii of both bodies; spin of the local angle: rounding."""
    angle = 0.5
    slip, down = along_section(OFFSET, angle, bend, kappa)
    sagitta = down - OFFSET * np.sin(angle)
    assert np.abs(sagitta).max() > 0.8e-3
    expected = slip[0, 0] - slip[0, 2] * OFFSET - sagitta * (1.0 / RADIUS + kappa)
    np.testing.assert_allclose(slip[:, 0], expected, atol=1e-14)
    np.testing.assert_allclose(
        slip[:, 2], np.sin(angle + bend * OFFSET) * (1.0 / RADIUS + kappa), rtol=1e-12
    )


def test_strips_of_a_wheel_have_the_creepage_of_their_own_radius_and_angle(
    doubles, wheelset, counterface, points
):
    """Straight on a rail: xi_x = 1 - r/r0, spin = sin(angle)/r0; profiles joined by
    lines, 0.25 um.
    """
    solution = solve(
        points(shift=5e-3), wheelset, counterface(), models("bent"), sides=(0,)
    )
    planes, slip = solution.patch.planes, doubles.strips.creepage
    real = planes.width > 0.0
    assert np.ptp(planes.angle[real]) > 0.2
    radius = RADIUS + np.interp(planes.y - 5e-3, wheelset.right.y, wheelset.right.z)
    np.testing.assert_allclose(
        slip[:, :, 0][real], (1.0 - radius / RADIUS)[real], atol=0.25e-6 / RADIUS
    )
    np.testing.assert_allclose(slip[:, :, 1][real], 0.0, atol=1e-15)
    np.testing.assert_allclose(
        slip[:, :, 2][real], (np.sin(planes.angle) / RADIUS)[real], rtol=1e-12
    )


def test_yawed_strips_have_their_creepage_at_the_middle_of_the_patch(
    doubles, wheelset, counterface, points
):
    """Lateral, on a rail, by the velocity of the wheel there; it stands 0.25 mm off its
    design height.
    """
    yaw, shift = 20e-3, 5e-3
    solution = solve(
        points(shift=shift, yaw=yaw),
        wheelset,
        counterface(),
        models("bent"),
        sides=(0,),
    )
    slip, planes = doubles.strips.creepage, solution.patch.planes
    real, x = planes.width > 0.0, solution.x[:, None]
    y, z = (
        SPAN + planes.y - shift,
        RADIUS + np.interp(planes.y, counterface().profile.y, counterface().profile.z),
    )
    sine, cosine = np.sin(planes.angle), np.cos(planes.angle)
    velocity = cosine * np.sin(yaw) * z - sine * (np.sin(yaw) * y + np.cos(yaw) * x)
    np.testing.assert_allclose(
        slip[:, :, 1][real], (-velocity / RADIUS)[real], atol=0.25e-3 * yaw / RADIUS
    )
    assert np.ptp(slip[:, :, 1][real]) > 5e-4


# ------------------------------------------------------------ strips in one plane, bent


def test_flat_strips_give_the_resultants_of_the_plane(
    doubles, wheelset, counterface, points
):
    """1e-9 with the same creepages, on rails.

    But that normal forces of strips have levers of their own about the vertical axis,
    and heights of strips are those of the profile, not of the plane.
    """
    given = points(shift=np.array([-2e-3, 3e-3, 4e-3]), yaw=4e-3)
    given = replace(
        given,
        creepage=np.array([[-1.7e-3, 3e-4, 0.2], [1e-3, -2e-3, -0.4], [0.0, 0.0, 0.5]]),
    )
    bodies = wheelset, counterface()
    plane, strips = (
        solve(given, *bodies, models("flat", name))
        for name in ("in_plane", "in_planes")
    )
    assert plane.patch.planes is None
    assert strips.patch.planes is not None
    whole = values(plane)
    for name, value in values(
        strips, "x", "track_yaw_moment", "track_roll_moment"
    ).items():
        scale = np.abs(whole[name]).max(initial=0.0)
        np.testing.assert_allclose(
            value, whole[name], rtol=1e-9, atol=1e-9 * scale, err_msg=name
        )
    np.testing.assert_allclose(
        strips.x, plane.x, atol=1e-10
    )  # lines between points of the profile
    planes = strips.patch.planes
    lever = (planes.normal_force * planes.middle * np.sin(planes.angle)).sum(axis=1)
    np.testing.assert_allclose(
        strips.track_yaw_moment, plane.track_yaw_moment + lever, rtol=1e-9, atol=1e-5
    )
    np.testing.assert_allclose(
        strips.track_roll_moment, plane.track_roll_moment, atol=1e-4 * 80e3
    )


def test_a_planar_model_sees_one_plane(doubles, wheelset, counterface, points):
    conditions = points(shift=np.array([0.0, 3e-3]), rotation="free")
    bent, planar = (
        solve(conditions, wheelset, counterface(), models(name, "fastsim"))
        for name in ("flat", "kik_piotrowski")
    )
    assert bent.patch.planes is None
    for name, value in values(bent).items():
        np.testing.assert_array_equal(value, getattr(planar, name), err_msg=name)


def test_a_left_wheel_mirrors_the_right_one(
    doubles, shape, wheelset, counterface, points
):
    """Both sides of the mirrored point, with the axle turning freely; to the tolerance
    of the balance.
    """
    conditions = points(
        shift=np.array([4.5e-3, -4.5e-3]),
        yaw=np.array([6e-3, -6e-3]),
        rotation="free",
        roll=0.0,
    )
    solution = solve(conditions, wheelset, counterface(1.0), models(shape))
    here, there = (
        np.flatnonzero((solution.point == point) & (solution.side == side))
        for point, side in ((0, 0), (1, 1))
    )
    odd = (
        "contact_angle creepage_y spin force_y spin_moment track_lateral "
        "track_yaw_moment track_roll_moment"
    )
    for name, value in values(solution, "roll").items():
        sign = -1.0 if name in odd.split() else 1.0
        scale = np.abs(value).max(initial=0.0)
        np.testing.assert_allclose(
            value[there], sign * value[here], atol=1e-9 * scale, err_msg=name
        )
    planes = solution.patch.planes
    np.testing.assert_allclose(planes.angle[there], -planes.angle[here], atol=1e-9)
    forces = resultants(solution, 2)
    np.testing.assert_allclose(forces.force[1], -forces.force[0], rtol=1e-9)
    np.testing.assert_allclose(forces.moment[1], -forces.moment[0], rtol=1e-8)


def test_a_bent_patch_adds_up_vectors(doubles, wheelset, counterface, points):
    """Straight on a rail: by hand from strips, 1e-12; wheels carry their loads, no
    torque is left.
    """
    conditions = points(shift=np.array([5e-3]), rotation="free", friction=0.3)
    solution = solve(conditions, wheelset, counterface(), models("bent"))
    planes, slip = solution.patch.planes, doubles.strips.creepage
    assert (np.diff(doubles.strips.wheel) >= 0).all()
    sign = np.where(solution.side == 1, -1.0, 1.0)[:, None]
    load, angle, middle = planes.normal_force, sign * planes.angle, planes.middle
    f_x, f_y = (
        -K * load * slip[:, :, 0],
        -K * load * (slip[:, :, 1] + slip[:, :, 2] * middle),
    )
    m_z = middle * f_y - K * load * slip[:, :, 2] * 0.25 * planes.half**2
    across, up = (
        load * np.sin(angle) + f_y * np.cos(angle),
        load * np.cos(angle) - f_y * np.sin(angle),
    )
    y = SPAN + planes.y - sign * 5e-3
    z = solution.z[:, None] + np.interp(
        planes.y, counterface().profile.y, counterface().profile.z
    )
    z = (
        z
        - np.interp(solution.rail_y, counterface().profile.y, counterface().profile.z)[
            :, None
        ]
    )
    x = solution.x[:, None]
    by_hand = {
        "track_lateral": sign * across,
        "track_vertical": up,
        "track_longitudinal": f_x,
        "track_yaw_moment": sign
        * (x * across + middle * load * np.sin(angle) - y * f_x + m_z * np.cos(angle)),
    }
    for name, value in by_hand.items():
        np.testing.assert_allclose(
            getattr(solution, name), value.sum(axis=1), rtol=1e-9, atol=1e-6
        )
    roll = (sign * (y * up + z * across)).sum(axis=1)
    np.testing.assert_allclose(
        solution.track_roll_moment, roll, rtol=1e-5
    )  # profiles on two grids
    power = -SPEED * (
        f_x * slip[:, :, 0] + f_y * slip[:, :, 1] + m_z * slip[:, :, 2]
    ).sum(axis=1)
    np.testing.assert_allclose(solution.power, power, rtol=1e-9)
    # what patches report
    weight = load / load.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(
        solution.creepage_x, (weight * slip[:, :, 0]).sum(axis=1), atol=1e-15
    )
    np.testing.assert_allclose(
        solution.spin, (sign * weight * slip[:, :, 2]).sum(axis=1), rtol=1e-12
    )
    total, direction = vector_sum(planes)
    np.testing.assert_allclose(solution.normal_force, total, rtol=1e-12)
    np.testing.assert_allclose(solution.contact_angle, direction, rtol=1e-12)
    turned = (sign * f_y * np.cos(planes.angle - direction[:, None])).sum(axis=1)
    np.testing.assert_allclose(solution.force_y, turned, rtol=1e-9)
    forces = resultants(solution, 1)
    np.testing.assert_allclose(forces.vertical, 80e3, rtol=2e-6)
    radius = RADIUS + np.interp(
        planes.y - sign * 5e-3, wheelset.right.y, wheelset.right.z
    )
    torque, scale = (f_x * radius - m_z * np.sin(angle)).sum(), np.abs(f_x).sum()
    assert abs(torque) < 0.25e-6 * scale + 2e-6 * 0.3 * 80e3 * RADIUS


def test_friction_of_strips_is_that_of_their_own_angle(
    doubles, wheelset, counterface, points
):
    """0.4 on the tread, 0.1 from 40 degrees on, linear from 20; patch models are given
    the mean.
    """
    conditions = replace(
        points(shift=5.8e-3, friction=0.4), friction_flange=np.array([0.1])
    )
    solution = solve(conditions, wheelset, counterface(), models("bent"), sides=(0,))
    angle = np.degrees(np.abs(solution.patch.planes.angle))
    expected = 0.4 - 0.3 * np.clip((angle - 20.0) / 20.0, 0.0, 1.0)
    assert expected.min() < 0.35
    np.testing.assert_allclose(doubles.strips.friction, expected, rtol=1e-12)


def test_similar_patches_have_similar_strips(
    doubles, monkeypatch, wheelset, counterface, points
):
    """Lengths and pressures with the cube root of the load; slip moves with the strips
    in their planes.
    """
    seen = []
    forces_of = wheels_module.forces_of
    monkeypatch.setattr(
        "wearsim.contact.axle.forces_of",
        lambda task, wheels, *rest, **options: (
            seen.append(wheels) or forces_of(task, wheels, *rest, **options)
        ),
    )
    solve(points(shift=4e-3), wheelset, counterface(), models("bent"), sides=(0,))
    near = seen[-1]
    load = np.ones((1, 2))
    load.ravel()[near.place] = 1.2 * near.load
    far = wheels_module.stretched(near, load)
    old, new, scale = (
        near.normal.patch.planes,
        far.normal.patch.planes,
        1.2 ** (1.0 / 3.0),
    )
    np.testing.assert_allclose(new.normal_force, 1.2 * old.normal_force, rtol=1e-12)
    np.testing.assert_allclose(new.offset, scale * old.offset, atol=1e-12)
    centre = near.normal.centre_y[:, None]
    np.testing.assert_allclose(new.y - centre, scale * (old.y - centre), atol=1e-15)
    np.testing.assert_array_equal(new.angle, old.angle)
    speed = np.array([-SPEED / RADIUS])[near.normal.patch.row]
    before, after = near.kinematics.creepage(speed), far.kinematics.creepage(speed)
    moved = (scale - 1.0) * old.offset * before[:, :, 2]
    np.testing.assert_allclose(after[:, :, 0], before[:, :, 0] - moved, atol=1e-15)
    np.testing.assert_array_equal(after[:, :, 1:], before[:, :, 1:])


def test_a_row_without_rough_solution_is_bracketed_in_one_plane(
    doubles, monkeypatch, wheelset, counterface, points
):
    """Its full solution has strips, the rough ones of the other rows have none."""
    solve_cut = NORMAL_MODELS["bent"].solve

    def flaky(gap, row, load, **options):
        if options["rough"] and 1 in row:
            raise ContactError("no rough solution", row=1)
        return solve_cut(gap, row, load, **options)

    monkeypatch.setitem(NORMAL_MODELS, "flaky", NormalModel("flaky", flaky))
    conditions = points(shift=np.array([0.0, 3e-3, 4.5e-3]), rotation="free")
    found, whole = (
        solve(conditions, wheelset, counterface(), models(name))
        for name in ("flaky", "bent")
    )
    np.testing.assert_allclose(found.track_vertical, whole.track_vertical, rtol=5e-6)


def test_strips_without_finite_pressures_or_forces_are_refused(
    doubles, monkeypatch, wheelset, counterface, points
):
    def broken(gap, row, load, **options):
        normal = NORMAL_MODELS["bent"].solve(gap, row, load, **options)
        if (planes := normal.patch.planes) is not None:
            planes.peak[0, 3] = np.nan
        return normal

    def lost(*arguments, **options):
        solution = slide(*arguments, **options)
        if solution.strip_force is not None:
            solution.strip_force[0, 3, 0] = np.nan
        return solution

    monkeypatch.setitem(NORMAL_MODELS, "broken", NormalModel("broken", broken))
    monkeypatch.setitem(
        TANGENTIAL_MODELS, "lost", TangentialModel("lost", lost, by_strips=True)
    )
    for pair, message in (
        (models("broken"), "no finite solution"),
        (models("bent", "lost"), "no finite creep"),
    ):
        with pytest.raises(NumericalError, match=message):
            solve(points(), wheelset, counterface(), pair)
