"""Contact solutions made up for tests of the campaign rooms: right shapes, no contact
mechanics.
"""

import importlib.util
import multiprocessing
import os
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.control import reached
from wearsim.campaign.evaluate import rate, setup_of
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.running import begun_at
from wearsim.campaign.state import State
from wearsim.contact.patch import Patch, SurfaceFields
from wearsim.contact.problem import NEARBY
from wearsim.contact.solve import ContactConditions, ContactSolution, Wheelset
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import Profile
from wearsim.scene import build, load_scene


def wheel_profile(spacing=0.25e-3):
    """Flange of a circular root and a 70 degree flank running into a cone, sampled by
    arc length.
    """
    tread = 70e-3
    turn = np.arctan(0.05)
    root, steep = 13e-3, np.deg2rad(70.0)
    arc = np.arange(0.0, 0.09, spacing)
    # Direction angle of the profile, from the flank to the tread; z falls towards the
    # field side.
    flank = 6e-3
    angle = np.interp(arc, [flank, flank + root * (steep - turn)], [-steep, -turn])
    mid = 0.5 * (angle[1:] + angle[:-1])
    y = np.concatenate([[0.0], np.cumsum(np.cos(mid))]) * spacing
    z = np.concatenate([[0.0], np.cumsum(np.sin(mid))]) * spacing
    at = np.interp(arc[-1] - 0.5 * tread, arc, y)
    return Profile(name="made up", kind="wheel", y=y - at, z=z - np.interp(at, y, z))


def state_of(right, left):
    n = right.y.size
    return State(
        step=0,
        distance=0.0,
        y=np.stack([right.y, left.y]),
        z=np.stack([right.z, left.z]),
        wear_depth=np.zeros((2, n)),
        regime_depth=np.zeros((2, 3, n)),
        worn_area=np.zeros(2),
        worn_mass=np.zeros(2),
    )


def solution_of(
    point, side, centre, half_width, peak_work, *, ny=40, nx=20, gap=50e-6, skew=0.0
):
    """Elliptic patches with work density peak_work * (1 - (y/b)^2) in every cell of the
    strip.
    """
    point, side = np.asarray(point), np.asarray(side)
    centre, half_width, peak_work = (
        np.asarray(a, dtype=float) for a in (centre, half_width, peak_work)
    )
    m = point.size
    local_edges = np.linspace(-1.0, 1.0, ny + 1)
    local = 0.5 * (local_edges[1:] + local_edges[:-1])
    half_length = 6e-3 * np.sqrt(1.0 - local**2)
    shape = 1.0 - local**2 + skew * local * (1.0 - local**2)
    work = np.broadcast_to(peak_work[:, None, None] * shape, (m, nx, ny)).copy()
    y = half_width[:, None] * local
    zeros, cells = np.zeros(m), np.zeros((m, nx, ny))
    cell_length = np.broadcast_to(2.0 * half_length / nx, (m, ny)).copy()
    fields = SurfaceFields(
        pressure=cells + 1e9,
        shear_x=cells,
        shear_y=cells,
        slip_x=cells,
        slip_y=cells,
        work_density=work,
        x_lead=np.broadcast_to(half_length, (m, ny)).copy(),
        cell_length=cell_length,
        strip_width=2.0 * half_width / ny,
        speed=zeros + 20.0,
    )
    patch = Patch(
        row=2 * point + side,
        y=y,
        width=2.0 * half_width / ny,
        x_lead=np.broadcast_to(half_length, (m, ny)).copy(),
        x_trail=np.broadcast_to(-half_length, (m, ny)).copy(),
        pressure_slope=np.full((m, ny), 1e11),
        interpenetration=np.broadcast_to(gap * (1.0 - local**2), (m, ny)).copy(),
        strips=np.full(m, ny),
        cells=np.full(m, nx),
    )
    names = (
        "rail_y x z contact_angle length width approach creepage_x creepage_y spin "
        "force_x force_y spin_moment slip_area power power_balance roll "
        "rotation_speed track_lateral track_vertical track_longitudinal "
        "track_yaw_moment track_roll_moment"
    )
    return ContactSolution(
        point=point,
        side=side,
        wheel_y=centre,
        area=np.pi * 6e-3 * half_width,
        max_pressure=zeros + 1e9,
        normal_force=zeros + 80e3,
        load_scale=zeros + 1.0,
        stood_in=np.zeros(m, dtype=np.int64),
        nearby=np.zeros((m, NEARBY)),
        strip_edges_wheel_y=centre[:, None] + half_width[:, None] * local_edges,
        strip_edges_rail_y=centre[:, None] + half_width[:, None] * local_edges,
        patch=patch,
        fields=fields,
        **dict.fromkeys(names.split(), zeros),
    )


def points_of(weight, environment=None, block_length=None):
    weight = np.asarray(weight, dtype=float)
    n = weight.size
    zeros = np.zeros(n)
    return OperatingPoints(
        conditions=ContactConditions(
            shift=np.arange(n) * 1e-3,
            yaw=zeros,
            roll=zeros,
            wheel_load=zeros + 80e3,
            speed=zeros + 20.0,
            friction=zeros + 0.3,
            track_curvature=zeros,
        ),
        weight=weight,
        environment=zeros + 1.0
        if environment is None
        else np.asarray(environment, dtype=float),
        block_length=zeros
        if block_length is None
        else np.asarray(block_length, dtype=float),
        label=tuple(f"point {i}" for i in range(n)),
    )


@pytest.fixture(scope="session")
def evolution_of(tmp_path_factory):
    """Function that gives the campaign of a scene's text."""

    def made(text):
        path = tmp_path_factory.mktemp("scene") / "scene.toml"
        path.write_text(text)
        return WheelsetEvolution(build(load_scene(path)), threads=1)

    return made


@pytest.fixture(scope="session")
def two_blocks(evolution_of, scene_text):
    """Function that gives the campaign of two blocks on a rig, tread and flange root.

    Mirrored: shift, yaw and roll with the other sign. Other keywords as `scene_text`
    has them, but for the environment factor of both.
    """

    def made(*, mirrored=False, environment=1.0, **tables):
        sign = -1 if mirrored else 1
        blocks = (
            {
                "shift_mm": sign * shift,
                "yaw_mrad": sign * yaw,
                "roll_mrad": sign * roll,
                "distance_km": distance,
                "environment": environment,
            }
            for shift, yaw, roll, distance in ((-2.0, -1.0, 0.0, 2), (4.5, 2.0, 0.5, 1))
        )
        return evolution_of(scene_text(*blocks, **tables))

    return made


@pytest.fixture(scope="session")
def states_of():
    """Function that gives all states of a campaign."""

    def run(of):
        state, taken = of.start()
        states = [state]
        while not reached(state.distance, of.setup.control.distance):
            state, taken = of.advance(state, of.evaluate(state, taken))
            states.append(state)
        return states

    return run


@pytest.fixture(scope="session")
def all_states(states_of):
    """Function that gives all states of a campaign, and the rate in each but the last
    of what acts next, which costs a further contact solution of each.
    """

    def run(of):
        states = states_of(of)
        points, setup = of.setup.points, setup_of(of.setup)
        rates = [
            rate(before, begun_at(points, before.begin), after.active_weight, setup)
            for before, after in pairwise(states)
        ]
        return states, rates

    return run


@pytest.fixture
def wheelset():
    profile = wheel_profile()
    return Wheelset(right=profile, left=profile, radius=0.46, half_span=0.75)


@pytest.fixture
def state(wheelset):
    return state_of(wheelset.right, wheelset.left)


@pytest.fixture
def made_solution():
    return solution_of


@pytest.fixture
def made_points():
    return points_of


@pytest.fixture
def solution():
    """Three points, tread and flange root, mild to catastrophic, different on both
    wheels.
    """
    return solution_of(
        point=[0, 0, 1, 1, 1, 2],
        side=[0, 1, 0, 0, 1, 1],
        centre=[-3e-3, 5e-3, -31e-3, -20e-3, 2.1e-3, -30e-3],
        half_width=[6e-3, 7e-3, 3e-3, 2.5e-3, 4e-3, 2e-3],
        peak_work=[2e6, 3e6, 90e6, 30e6, 0.0, 120e6],
        skew=0.4,
    )


@pytest.fixture
def points():
    return points_of([0.5, 0.3, 0.2], environment=[1.0, 0.5, 0.1])


@pytest.fixture(scope="session")
def synthetic():
    """The module `synthetic_campaign.py` beside this file."""
    path = Path(__file__).with_name("synthetic_campaign.py")
    spec = importlib.util.spec_from_file_location("synthetic_campaign", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["synthetic_campaign"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def stopped_at(synthetic):
    """Context manager whose observer stops a run once a step is written."""
    return synthetic.stopped_at


@pytest.fixture(scope="session")
def forked():
    """Function that starts `code` in a process of its own and returns it and all it
    prints, as a file.

    Its parent is a server that holds the imports of a campaign, which take a new
    interpreter seconds.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["wearsim.campaign.run"])
    printed_there = (
        "import os, sys; os.dup2(end.fileno(), 1), os.dup2(end.fileno(), 2)\n"
    )

    def start(code):
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(
            target=exec, args=(printed_there + code, {"end": theirs})
        )
        process.start()
        theirs.close()
        with ours:
            return process, os.fdopen(os.dup(ours.fileno()))

    return start
