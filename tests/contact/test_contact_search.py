"""Contact search under yaw against a half-space program: heights, reference points,
centres of pressure.

That program's contact reference is the mean over the interpenetration of the rigid
bodies, pushed together by the penetration, weighted with its square over the area (its
2.5th power over the width). Heights, this point and its angle are geometry alone; the
centre of pressure is a matter of the normal model too.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.contact import geometry
from wearsim.contact.gap import ContactPlane, gap_surface
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.problem import ContactModels, Counterface, Wheelset
from wearsim.contact.solve import solve
from wearsim.profile import standard

DATA = Path(__file__).parents[1] / "data"
RAILS = {"s1002_60e1": "60E1", "mbench": "60E1_benchmark"}


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(DATA / "contact_search.csv", comment="#")


@pytest.fixture(scope="module")
def rails(table):
    pairs = table[["geometry", "inclination"]].drop_duplicates().itertuples(index=False)
    return {(g, n): standard.rail(RAILS[g], 1.0 / n, 1.435, 0.75) for g, n in pairs}


@pytest.fixture(scope="module")
def gaps(table, rails, s1002):
    """Gap of each row."""
    wheel = geometry.wheel_surface(s1002, 0.46)
    grounds = {key: geometry.counterface_profile(rail) for key, rail in rails.items()}
    return [
        geometry.gap(
            wheel,
            grounds[row.geometry, row.inclination],
            WheelsetPose(np.array([row.shift]), np.array([row.yaw]), np.zeros(1)),
            half_span=0.75,
            nominal_radius=0.46,
            curvature=row.curvature,
        )
        for row in table.itertuples()
    ]


def test_rows_reach_over_the_profiles(table):
    """Rail and both rollers, both rails, both inclinations, yaw of both signs, tread to
    flange.
    """
    assert len(table) == 129
    assert set(table.curvature) == {0.0, 1.0, 2.0}
    assert set(table.yaw) == {0.0, 0.01, -0.01}
    assert (table["shift"].min(), table["shift"].max()) == (-8e-3, 8e-3)
    assert (table.angle < -1.0).sum() > 10


def test_interpenetration_along_the_normal(table, gaps):
    """At the height of the solution the exact gap is as deep as its penetration.

    The profiles there are points 0.1 to 0.25 mm apart: 0.15 um on the tread, 0.8 um in
    R 13 of the flange.
    """
    along = np.arange(-12e-3, 12.01e-3, 0.2e-3)[None]
    error = []
    for row, gap in zip(table.itertuples(), gaps, strict=True):
        place = (np.array([value]) for value in (row.y, row.x, row.angle, row.height))
        across = np.arange(row.s_min - 1e-3, row.s_max + 1e-3, 0.1e-3)[None]
        depth = -gap_surface(
            gap, ContactPlane(np.array([0]), *place), along, across
        ).min()
        error.append(abs(depth - row.penetration))
    error = np.array(error)
    tread = table.angle.abs() < 0.2
    assert error[tread].max() < 0.25e-6
    assert error.max() < 1e-6


def reference(row, gap):
    """Place and angle of the contact reference from the interpenetration of the rigid
    bodies.
    """
    grid = gap.counterface
    here = int(np.argmin(np.abs(grid.y - row.y)))
    slope = row.curvature * gap.x[0, here]
    depth = row.height / np.sqrt(1.0 + slope**2) - gap.gap[0]
    apart = np.flatnonzero(depth <= 0.0)
    part = slice(apart[apart < here].max() + 1, apart[apart > here].min())
    weight = depth[part] ** 2.5 * np.gradient(grid.y)[part]
    return (weight * grid.y[part]).sum() / weight.sum(), (
        weight * grid.angle[part]
    ).sum() / weight.sum()


def test_reference_point_and_angle(table, gaps):
    """0.1 mm and 1 mrad hold: 0.01 mm, and 0.1 mrad away from the flange.

    In 8 of 129 rows near two-point contact or on the flange its planes are those of
    several patches; there it is 3 mrad.
    """
    pairs = [
        reference(row, gap) for row, gap in zip(table.itertuples(), gaps, strict=True)
    ]
    place, angle = np.array(pairs).T
    assert np.abs(place - table.y).max() < 0.02e-3
    error = np.abs(angle - table.angle)
    assert error[table["shift"].abs() < 5.8e-3].max() < 0.1e-3
    assert (error > 1e-3).sum() <= 8
    assert error.max() < 3.2e-3


def centres(table, rails, s1002, points, model):
    """Centre of pressure on the rail's profile under the row's normal force, minus the
    reference's [m].
    """
    error = []
    for row in table.itertuples():
        solution = solve(
            points(row.shift, row.yaw, load=row.normal_force),
            Wheelset(s1002, s1002, 0.46, 0.75),
            Counterface(rails[row.geometry, row.inclination], row.curvature),
            ContactModels(normal=model, tangential="fastsim", strips=50, cells=10),
            sides=(0,),
            vertical=False,
        )
        error.append(
            solution.rail_y[0] - row.y - row.s_pressure_centre * np.cos(row.angle)
        )
    return np.array(error)


@pytest.fixture(scope="module")
def single(table):
    """Rows of one patch, away from two-point contact, where virtual penetration has one
    patch too.
    """
    return table[
        (table.patches == 1)
        & ((table["shift"].abs() < 4.6e-3) | (table["shift"] < 0.0))
    ]


def test_centre_of_pressure_with_the_half_space(single, rails, s1002, points):
    """0.1 mm holds everywhere; 0.02 mm measured."""
    sample = single.iloc[::3]
    assert len(sample) > 25
    assert np.abs(centres(sample, rails, s1002, points, "half_space")).max() < 0.03e-3


def test_centre_of_pressure_with_virtual_penetration(single, rails, s1002, points):
    """The pressure's shape, not the search: 0.12 mm where the contact is compact, 0.7
    mm where it is flat.
    """
    error = np.abs(centres(single, rails, s1002, points, "kik_piotrowski"))
    compact = (single.s_max - single.s_min < 10e-3).to_numpy()
    assert compact.sum() > 40
    assert error[compact].max() < 0.125e-3
    assert error.max() < 0.75e-3
    assert np.median(error) < 0.1e-3


@pytest.mark.parametrize("kappa", [0.0, 1.0])
@pytest.mark.parametrize("normal", ["kik_piotrowski", "half_space"])
def test_left_wheel_mirrors_the_right_one_up_to_100_mrad(
    wheelset, counterface, points, normal, kappa
):
    """Imposed symmetry: 1e-9."""
    models = ContactModels(normal=normal, tangential="fastsim", strips=20, cells=10)
    shift, yaw = np.array([-4e-3, 0.0, 3e-3]), np.array([0.1, -0.1, 0.06])
    right = solve(points(shift, yaw), wheelset, counterface(kappa), models, sides=(0,))
    left = solve(points(-shift, -yaw), wheelset, counterface(kappa), models, sides=(1,))
    for name in ("wheel_y", "rail_y", "x", "area", "max_pressure", "force_x", "power"):
        np.testing.assert_allclose(
            getattr(left, name), getattr(right, name), rtol=1e-9, err_msg=name
        )
    np.testing.assert_allclose(left.contact_angle, -right.contact_angle, rtol=1e-9)
    np.testing.assert_allclose(left.force_y, -right.force_y, rtol=1e-9)
