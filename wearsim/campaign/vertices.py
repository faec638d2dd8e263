"""Wear at the vertices of a profile: transfer from strips, smoothing, removal."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches
from wearsim.errors import NumericalError
from wearsim.profile.shape import (
    arc_length,
    offset_distance,
    vertex_lengths,
    vertex_normals,
)
from wearsim.profile.smoothing import smoothing_spline


def stretches(arc: FloatArray) -> FloatArray:
    """Limits (n + 1,) of the intervals of vertices at arc lengths (n,) [m]."""
    return np.concatenate([arc[:1], 0.5 * (arc[1:] + arc[:-1]), arc[-1:]])


@kernel
def share_out(
    strip_edges: FloatArray, cell_edges: FloatArray, amount: FloatArray, out: FloatArray
) -> None:
    """Add amounts (q, m, ny) between strip_edges (m, ny + 1) to cells out (q, n)."""
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
                share = (
                    (end - low) / (high - strip_edges[patch, strip])
                    if high > low
                    else 1.0
                )
                for q in range(amount.shape[0]):
                    out[q, cell] += amount[q, patch, strip] * share
                if end >= high:
                    break
                low = end
                cell += 1


@kernel
def sample(
    strip_edges: FloatArray, arc: FloatArray, value: FloatArray, out: FloatArray
) -> None:
    """Add to out (n,) the value (m, ny) of the strip in which each vertex lies."""
    for patch in range(strip_edges.shape[0]):
        vertex = np.searchsorted(arc, strip_edges[patch, 0])
        for strip in range(strip_edges.shape[1] - 1):
            while vertex < arc.size and arc[vertex] < strip_edges[patch, strip + 1]:
                out[vertex] += value[patch, strip]
                vertex += 1


def worn_off(
    y: FloatArray, z: FloatArray, depth: FloatArray, body: str
) -> tuple[FloatArray, FloatArray]:
    """Move the vertices of both profiles (2, n) along their normals by a depth [m].

    The depth is smooth; z points out of the material. The area between the polygons is
    the sum of depth times vertex length.

    Raises
    ------
    NumericalError
        When the depth is too large for the curvature of a profile; it names side and
        body.
    """
    new_y, new_z = np.empty_like(y), np.empty_like(z)
    normal_y, normal_z = vertex_normals(y, z)
    for k, side in enumerate(("right", "left")):
        distance = offset_distance(y[k], z[k], depth[k])
        new_y[k], new_z[k] = (
            y[k] + distance * normal_y[k],
            z[k] + distance * normal_z[k],
        )
        forward = np.diff(new_y[k]) * np.diff(y[k]) + np.diff(new_z[k]) * np.diff(z[k])
        if not (forward > 0.0).all():
            raise NumericalError(
                f"a wear step of {depth[k].max() * 1e6:.3g} um folds the profile of "
                f"the {side} {body} at y = {y[k, int(np.argmin(forward))] * 1e3:.4g} "
                "mm; lower max_step_depth_um or raise smoothing_wavelength_mm"
            )
    return new_y, new_z


def strip_heights(contact: ContactPatches, y: FloatArray, z: FloatArray) -> FloatArray:
    """Height (m, ny) of wheel profiles (2, n) at the strip centres of patches [m]."""
    centre = 0.5 * (
        contact.strip_edges_wheel_y[:, 1:] + contact.strip_edges_wheel_y[:, :-1]
    )
    height = np.empty_like(centre)
    for wheel in (0, 1):
        at = contact.side == wheel
        # a worn flank may overhang by rounding; interpolation needs a rising y
        height[at] = np.interp(centre[at], np.maximum.accumulate(y[wheel]), z[wheel])
    return height


def smooth_sides(
    y: FloatArray, z: FloatArray, depth: FloatArray, wavelength: float
) -> FloatArray:
    r"""Smooth a wear increment (2, ..., n) along both profiles (2, n), keeping areas.

    Parameters
    ----------
    y, z : (2, n) array
        Of both sides [m].
    depth : (2, ..., n) array
        Wear depth, not negative [m]; rows are independent.
    wavelength : float
        Wavelength whose amplitude is halved [m]; 0: no smoothing.

    Returns
    -------
    (2, ..., n) array
        Cubic smoothing spline over the arc length, nowhere negative, with the same
        sum(depth * length) in each row [m].

    Notes
    -----
    `wearsim.profile.smoothing.smoothing_spline`: the amplitude at wavelength :math:`\Lambda`
    is halved. Negative side lobes of a worn band are set to 0, then each row is scaled
    to its area.
    """
    if wavelength == 0.0:
        return depth.copy()
    return _smooth_sides(
        y.tobytes(), z.tobytes(), depth.tobytes(), depth.shape, wavelength
    ).copy()


@lru_cache(
    maxsize=8
)  # the rate at the end of a step is that at the start of the next one
def _smooth_sides(
    of_y: bytes, of_z: bytes, of_depth: bytes, shape: tuple[int, ...], wavelength: float
) -> FloatArray:
    y, z = (np.frombuffer(of).reshape(2, -1) for of in (of_y, of_z))
    return smoothed_sides(y, z, np.frombuffer(of_depth).reshape(shape), wavelength)


def smoothed_sides(
    y: FloatArray, z: FloatArray, depth: FloatArray, wavelength: float
) -> FloatArray:
    """Smooth wear increments as `smooth_sides` does, without keeping them for a second call."""
    if wavelength == 0.0:
        return depth.copy()
    shape = depth.shape
    rows, length = depth.reshape(2, -1, shape[-1]), vertex_lengths(y, z)[:, None]
    smoothed = rows
    if rows.any():
        spline = smoothing_spline(
            arc_length(y, z), rows, vertex_lengths(y, z), wavelength
        )
        smoothed = np.maximum(spline, 0.0)
    area, kept = (rows * length).sum(axis=-1), (smoothed * length).sum(axis=-1)
    scale = np.where(kept > 0.0, area / np.where(kept > 0.0, kept, 1.0), 0.0)
    result: FloatArray = (smoothed * scale[:, :, None]).reshape(shape)
    return result


def only_worn(depth: FloatArray, length: FloatArray) -> tuple[FloatArray, float]:
    """Set negative depths to 0 and restore the area.

    Parameters
    ----------
    depth : (2, r, n) array
        By regime [m].
    length : (2, n) array
        Profile length of each vertex [m].

    Returns
    -------
    (2, r, n) array
        Parts of a sum over the regimes that is nowhere negative, of the same area [m].
    float
        Largest share of the area of a side that was negative [-].
    """
    total, parts = depth.sum(axis=1), np.maximum(depth, 0.0)
    worn, of_parts = np.maximum(total, 0.0), parts.sum(axis=1)
    area, kept = (total * length).sum(axis=1), (worn * length).sum(axis=1)
    ratio = np.maximum(area, 0.0) / np.where(kept > 0.0, kept, 1.0)
    share = worn * ratio[:, None] / np.where(of_parts > 0.0, of_parts, 1.0)
    result: FloatArray = parts * share[:, None]
    return result, float(
        np.where(kept > 0.0, 1.0 - area / np.where(kept > 0.0, kept, 1.0), 0.0).max()
    )
