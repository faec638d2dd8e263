"""Between the strips of contact patches and the vertices of a profile, and how the vertices are worn off."""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray
from wearsim.errors import NumericalError
from wearsim.profile.shape import offset_distance, vertex_normals


def stretches(arc: FloatArray) -> FloatArray:
    """Return the borders (n + 1,) of the stretches that vertices at arc lengths (n,) stand for [m]."""
    return np.concatenate([arc[:1], 0.5 * (arc[1:] + arc[:-1]), arc[-1:]])


@kernel
def share_out(strip_edges: FloatArray, cell_edges: FloatArray, amount: FloatArray, out: FloatArray) -> None:
    """Add amount (q, m, ny) of strips between strip_edges (m, ny + 1) to the cells out (q, n)."""
    n = cell_edges.size - 1
    for patch in range(strip_edges.shape[0]):
        cell = np.searchsorted(cell_edges, strip_edges[patch, 0], side="right") - 1
        cell = min(max(cell, 0), n - 1)
        for strip in range(strip_edges.shape[1] - 1):
            low = strip_edges[patch, strip]
            high = strip_edges[patch, strip + 1]
            while cell < n - 1 and cell_edges[cell + 1] <= low:
                cell += 1
            while True:
                end = high if cell == n - 1 else min(high, cell_edges[cell + 1])
                share = (end - low) / (high - strip_edges[patch, strip]) if high > low else 1.0
                for q in range(amount.shape[0]):
                    out[q, cell] += amount[q, patch, strip] * share
                if end >= high:
                    break
                low = end
                cell += 1


@kernel
def sample(strip_edges: FloatArray, arc: FloatArray, value: FloatArray, out: FloatArray) -> None:
    """Add the value (m, ny) of the strip each vertex lies in to out (n,)."""
    for patch in range(strip_edges.shape[0]):
        vertex = np.searchsorted(arc, strip_edges[patch, 0])
        for strip in range(strip_edges.shape[1] - 1):
            while vertex < arc.size and arc[vertex] < strip_edges[patch, strip + 1]:
                out[vertex] += value[patch, strip]
                vertex += 1


def taken_off(y: FloatArray, z: FloatArray, depth: FloatArray, body: str) -> tuple[FloatArray, FloatArray]:
    """Move the vertices of a profile along their normals so that it loses the area of a wear increment.

    Parameters
    ----------
    y, z : (n,) array
        Vertices, z out of the material [m].
    depth : (n,) array
        Depth of the law at the vertices, smoothed [m].
    body : str
        What wears, for the error.

    Returns
    -------
    y, z : (n,) array
        The same vertices after [m].

    Raises
    ------
    NumericalError
        When the depth is too large for the curvature of the profile.
    """
    distance = offset_distance(y, z, depth)
    normal_y, normal_z = vertex_normals(y, z)
    new_y, new_z = y + distance * normal_y, z + distance * normal_z
    forward = np.diff(new_y) * np.diff(y) + np.diff(new_z) * np.diff(z)
    if not (forward > 0.0).all():
        raise NumericalError(
            f"a wear step of {depth.max() * 1e6:.3g} um folds the profile of the {body} at y = "
            f"{y[int(np.argmin(forward))] * 1e3:.4g} mm; lower max_step_depth_um or raise "
            f"smoothing_wavelength_mm"
        )
    return new_y, new_z
