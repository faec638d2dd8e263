"""Elliptic patches under a Hertz pressure, cut into strips."""

import numpy as np
import pytest

from wearsim.contact.patch import Patch


def _ellipse(a, b, load, strips, offset=0.0):
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
        pressure_slope=np.array([slope]),
        interpenetration=np.zeros((1, strips)),
    )


@pytest.fixture(scope="session")
def ellipse():
    """Factory of a patch with semi-axes a (rolling direction) and b [m] that carries `load` [N]."""
    return _ellipse
