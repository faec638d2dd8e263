"""Half-space models and contact search within stated limits of another half-space
program, away from jumps.

All its 458 cases of a single patch, each under its own normal force: that program's
wheel load has a share of the creep forces in it. A jump is a shift where the point of
first touch moves by more than 1 mm; within 0.75 mm of it two lobes carry the load, and
what happens depends on how they share a plane. Its contact plane is an average over the
overlap of the rigid bodies, ours over the pressure.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wearsim.contact import geometry
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.problem import ContactConditions, ContactModels, Counterface
from wearsim.contact.solve import solve
from wearsim.profile import standard

pytestmark = pytest.mark.usefixtures("one_creepage")  # that of the other program

DATA = Path(__file__).parents[1] / "data"
RAILS = {"s1002_60e1": "60E1", "mbench": "60E1_benchmark"}
NEAR = 0.75e-3  # m, of shift from the next jump
NARROW = 3e-3  # m, patches of 15 elements across and less
ELEMENT = 0.2e-3  # m, of the other program

# Geometry, inclination 1:n, curvature of the counterface [1/m], shift [mm], yaw [mrad].
FLAT = {
    ("s1002_60e1", 40, 0.0, 1.5, 10),
    ("s1002_60e1", 40, 0.0, 2.0, 0),
    ("s1002_60e1", 40, 0.0, 2.5, 0),
    ("s1002_60e1", 40, 0.0, 2.5, -10),
    ("s1002_60e1", 40, 1.0, 2.5, -10),
    ("s1002_60e1", 40, 1.0, 2.5, 10),
    ("mbench", 40, 0.0, 2.0, 0),
    ("mbench", 40, 0.0, 2.5, 0),
    ("mbench", 40, 1.0, 2.0, 0),
}
KINK = ("mbench", 40, 1.0, 2.0, 0)
THIN = [
    ("s1002_60e1", 20, 1.0, shift, 10) for shift in (7.0, 7.5)
]  # 2.2 mm wide and 31 mm long
LITTLE_SLIP = ("s1002_60e1", 20, 2.0, 5.0, 0)
ROOT = [
    ("s1002_60e1", 20, curvature, shift, 0)
    for curvature in (1.0, 2.0)
    for shift in (7.5, 8.0)
]


def state(row):
    return (
        row.geometry,
        row.inclination,
        row.curvature,
        round(1e3 * row.shift, 3),
        round(1e3 * row.yaw),
    )


def ground(row):
    return standard.rail(RAILS[row.geometry], 1.0 / row.inclination, 1.435, 0.75)


def gap_of(wheel, contour, shift, yaw, curvature):
    pose = WheelsetPose(
        np.atleast_1d(shift), np.full(np.size(shift), yaw), np.zeros(np.size(shift))
    )
    return geometry.gap(
        wheel, contour, pose, half_span=0.75, nominal_radius=0.46, curvature=curvature
    )


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(DATA / "contact_limits.csv", comment="#")


@pytest.fixture(scope="module")
def distance(table, s1002):
    """From the next jump [m]; jumps are those without yaw on the rail: others are 0.06
    mm off at most.
    """
    wheel = geometry.wheel_surface(s1002, 0.46)
    result = pd.Series(np.inf, index=table.index)
    for _, rows in table.groupby(["geometry", "inclination"]):
        contour = geometry.counterface_profile(ground(rows.iloc[0]))
        shifts = np.arange(-9e-3, 9e-3, 20e-6)
        touch = np.concatenate(
            [
                contour.y[gap_of(wheel, contour, s, 0.0, 0.0).gap.argmin(axis=1)]
                for s in np.split(shifts, 9)
            ]
        )
        jumps = shifts[np.flatnonzero(np.abs(np.diff(touch)) > 1e-3)] + 10e-6
        result[rows.index] = np.abs(rows["shift"].to_numpy()[:, None] - jumps).min(
            axis=1
        )
    return result


@pytest.fixture(scope="module")
def away(table, distance):
    return table[distance > NEAR]


def errors(rows, wheelset, *, fine=True):
    """Errors of each row; `fine`: narrow patches on cells like that program's elements,
    0.16 to 0.2 mm.
    """
    out = []
    for row in rows.itertuples():
        cells = strips = 50
        if fine and row.width < NARROW:
            cells, strips = (
                round(side / ELEMENT) + 4 for side in (row.length, row.width)
            )
        one = np.ones(1)
        result = solve(
            ContactConditions(
                row.shift * one,
                row.yaw * one,
                0.0 * one,
                row.normal_force * one,
                20.0 * one,
                0.35 * one,
                0.0 * one,
                "nominal",
            ),
            wheelset,
            Counterface(ground(row), row.curvature),
            ContactModels("half_space", "half_space", strips=strips, cells=cells),
            sides=(0,),
            vertical=False,
        )
        force = np.hypot(
            result.force_x[0] + row.force_x, result.force_y[0] + row.force_y
        )
        out.append(
            {
                "state": state(row),
                "centre": result.rail_y[0]
                - row.y
                - row.s_pressure_centre * np.cos(row.angle),
                "angle": result.contact_angle[0] - row.angle,
                "area": result.area[0] / row.area - 1.0,
                "max_pressure": result.max_pressure[0] / row.max_pressure - 1.0,
                "force": force / (0.35 * row.normal_force),
                "power": result.power[0] / row.power - 1.0,
            }
        )
    return pd.DataFrame(out, index=rows.index)


def hold(error):
    """Issue 5: 0.1 mm, 1 mrad, 3 %, 2 % (5 % on the benchmark's rail), 1 % of friction
    times load, 3 %.
    """
    size = (
        error.drop(columns="state").abs().assign(rough=error.state.str[0] == "mbench")
    )
    flat, flange, kink = (
        error.state.isin(FLAT),
        error.state.str[3] > 7.0,
        error.state == KINK,
    )
    assert size.centre.max() < 0.02e-3
    assert size.angle[~flat & ~flange].max() < 1e-3
    assert not (size.angle[flat] > 1.6e-3).any()
    assert not (size.angle[flange] > 27e-3).any()
    thin = error.state.isin(THIN)
    assert size.area[~thin].max() < 0.03
    assert not (size.area[thin] > 0.04).any()
    assert not (size.max_pressure[~size.rough] > 0.02).any()
    assert not (size.max_pressure[size.rough & ~kink] > 0.05).any()
    assert size.force.max() < 0.01
    assert size.power.max() < 0.03


def test_rows_reach_over_the_cases(table, away):
    assert (len(table), len(away)) == (458, 375)
    assert set(away.curvature) == {0.0, 1.0, 2.0}
    assert set(away.yaw) == {0.0, 0.01, -0.01}
    assert (away["shift"].min(), away["shift"].max()) == (-8e-3, 8e-3)
    assert (away.slip_share.min(), away.slip_share.max()) == (
        pytest.approx(0.045, abs=1e-3),
        1.0,
    )


def test_every_eighth_case(away, wheelset):
    hold(errors(away.iloc[::8], wheelset))


@pytest.mark.slow
@pytest.mark.parametrize("curvature", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("yawed", [False, True])
def test_every_case(away, wheelset, curvature, yawed):
    rows = away[(away.curvature == curvature) & ((away.yaw != 0.0) == yawed)]
    result = errors(rows, wheelset)
    hold(result)
    beyond = set(result.state[result.angle.abs() > 1e-3])
    listed = {one for one in FLAT if one[2] == curvature and (one[4] != 0) == yawed}
    assert beyond == listed | set(result.state[result.state.str[3] > 7.0])


def expected(where, measured, cause):
    reason = f"measured {measured} mrad, target 1: {cause}"
    return pytest.param(where, marks=pytest.mark.xfail(strict=True, reason=reason))


PLANES = "planes by pressure and by overlap of a wide patch"
NEIGHBOURS = "0.3 to 0.5 mm from each other on the flange"


@pytest.mark.parametrize(
    "where",
    [
        expected(("s1002_60e1", 40, 0.0, 1.5, 10), 1.003, PLANES),
        expected(("s1002_60e1", 40, 0.0, 2.0, 0), 1.5, PLANES),
        expected(("mbench", 40, 0.0, 2.5, 0), 1.2, PLANES),
        expected(("s1002_60e1", 40, 0.0, 7.5, -10), 16, NEIGHBOURS),
        expected(("s1002_60e1", 20, 2.0, 8.0, -10), 27, NEIGHBOURS),
    ],
)
def test_angle_of_the_plane_by_pressure(away, wheelset, where):
    """9 cases of a wide patch at 1.5 to 2.5 mm on 1:40, to 1.5 mrad; all 27 on the
    flange, 10 to 27 mrad.
    """
    rows = away[[state(row) == where for row in away.itertuples()]]
    assert errors(rows, wheelset).angle.abs().max() < 1e-3


@pytest.mark.xfail(
    strict=True,
    reason="measured 5.2 %, target 5 %: a kink of the rail file under a roller",
)
def test_maximum_pressure_at_a_kink(away, wheelset):
    """On the rail 0.1 %; there refining the elements of the other program moves its own
    by 6 to 7 %.
    """
    rows = away[[state(row) == KINK for row in away.itertuples()]]
    assert errors(rows, wheelset).max_pressure.abs().max() < 0.05


@pytest.mark.parametrize(
    "where",
    [
        pytest.param(
            one,
            marks=pytest.mark.xfail(
                strict=True, reason=f"measured {area} %, target 3 %: {across}"
            ),
        )
        for one, area, across in (
            (
                ("s1002_60e1", 20, 0.0, 8.0, 10),
                4.5,
                "9 elements of the other program across",
            ),
            (THIN[0], 3.6, "11 elements of the other program across"),
            (THIN[1], 3.8, "11 elements of the other program across"),
        )
    ],
)
def test_area_on_finer_cells_than_those_of_the_other_program(away, wheelset, where):
    """On the flange its elements round the outline up: ours are smaller by 3 to 5 % the
    finer they get.
    """
    rows = away[[state(row) == where for row in away.itertuples()]]
    assert errors(rows, wheelset, fine=False).area.abs().max() < 0.03


def test_power_where_little_slips(away, wheelset):
    """2.8 % by elements of the other program, 0.2 mm; finer cells of ours go farther
    away.
    """
    rows = away[[state(row) == LITTLE_SLIP for row in away.itertuples()]]
    assert errors(rows, wheelset).power.abs().max() < 0.03


@pytest.fixture(scope="module")
def overlap(table, s1002):
    """Errors of place [m] and angle [rad] of the reference, as that program has it,
    from our gap.

    Mean over the overlap of the rigid bodies at its height of the wheel, weighted with
    depth^2.5.
    """
    wheel = geometry.wheel_surface(s1002, 0.46)
    contours = {}
    out = []
    for row in table.itertuples():
        key = (row.geometry, row.inclination)
        if key not in contours:
            contours[key] = geometry.counterface_profile(ground(row))
        grid = contours[key]
        gap = gap_of(wheel, grid, row.shift, row.yaw, row.curvature)
        here = int(np.argmin(np.abs(grid.y - row.y)))
        lean = row.curvature * gap.x[0, here]
        depth = row.height / np.sqrt(1.0 + lean**2) - gap.gap[0]
        apart = np.flatnonzero(depth <= 0.0)
        part = slice(apart[apart < here].max() + 1, apart[apart > here].min())
        weight = depth[part] ** 2.5 * np.gradient(grid.y)[part]
        place = (weight * grid.y[part]).sum() / weight.sum()
        angle = (weight * grid.angle[part]).sum() / weight.sum()
        out.append((state(row), place - row.y, angle - row.angle))
    return pd.DataFrame(out, columns=["state", "place", "angle"], index=table.index)


def test_contact_search_with_the_planes_of_the_other_program(overlap):
    """0.1 mm and 1 mrad, beside jumps too: 11 um, 0.1 mrad up to 6 mm."""
    assert overlap.place.abs().max() < 0.015e-3
    tread = overlap.state.str[3] < 6.1
    assert overlap.angle[tread].abs().max() < 0.1e-3
    assert overlap.angle[~overlap.state.isin(ROOT)].abs().max() < 1e-3


@pytest.mark.parametrize("where", ROOT)
@pytest.mark.xfail(
    strict=True,
    reason="measured 1.7 to 2.8 mrad, target 1: 11 um on the flange, rollers",
)
def test_contact_search_on_the_flange(overlap, where):
    assert overlap.angle[overlap.state == where].abs().max() < 1e-3
