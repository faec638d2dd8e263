"""S1002 on 60E1 1:40, the pair of the seed paper, and operating points from plain
numbers.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.patch import Patch
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.profile import standard


@pytest.fixture(scope="session")
def s1002():
    return standard.wheel("S1002")


@pytest.fixture(scope="session")
def rail_60e1():
    return standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)


@pytest.fixture(scope="session")
def wheelset(s1002):
    return Wheelset(s1002, s1002, 0.46, 0.75)


@pytest.fixture(scope="session")
def counterface(rail_60e1):
    """Factory: rail, or roller of a curvature [1/m]."""
    return lambda curvature=0.0: Counterface(rail_60e1, curvature)


@pytest.fixture(scope="session")
def coarse():
    """Models on a small grid, for properties that hold on any grid."""
    return ContactModels.of("fast", strips=16, cells=12)


def _points(
    shift=0.0,
    yaw=0.0,
    roll=0.0,
    load=80e3,
    speed=20.0,
    friction=0.35,
    track_curvature=0.0,
    rotation="nominal",
    torque=0.0,
):
    arrays = np.broadcast_arrays(
        *np.atleast_1d(shift, yaw, roll, load, speed, friction, track_curvature)
    )
    arrays = [np.array(a, dtype=float) for a in arrays]
    if not isinstance(rotation, str):
        rotation = np.broadcast_to(
            np.asarray(rotation, dtype=float), arrays[0].shape
        ).copy()
    return ContactConditions(*arrays, rotation=rotation, torque=torque)


@pytest.fixture(scope="session")
def points():
    """Factory of operating points: scalars or arrays of n, SI units."""
    return _points


def _ellipse(a, b, load, strips, offset=0.0, cells=50):
    edges = np.linspace(-b, b, strips + 1)
    y = 0.5 * (edges[1:] + edges[:-1])
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    skew = offset * y
    width = 2.0 * b / strips
    slope = load / (0.5 * np.pi * (half**2).sum() * width)
    return Patch(
        row=np.array([0]),
        y=y[None],
        width=np.array([width]),
        x_lead=(skew + half)[None],
        x_trail=(skew - half)[None],
        pressure_slope=np.full((1, strips), slope),
        interpenetration=np.zeros((1, strips)),
        strips=np.array([strips]),
        cells=np.array([cells]),
    )


@pytest.fixture(scope="session")
def ellipse():
    """Factory of a patch with semi-axes a (rolling direction) and b [m] that carries
    `load` [N].
    """
    return _ellipse


@pytest.fixture
def one_creepage(monkeypatch):
    """Tangential half-space with one creepage and spin about the centre of a patch:
    other programs.
    """
    model = replace(TANGENTIAL_MODELS["half_space"], by_strips=False)
    monkeypatch.setitem(TANGENTIAL_MODELS, "half_space", model)
