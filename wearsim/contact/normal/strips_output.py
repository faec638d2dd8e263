"""Kernel of the strip model: from the strips solved for to patches cut into as many strips as wanted.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.normal.refusal import MOST_PATCHES, NOT_SINGLE, TOO_MANY
from wearsim.contact.normal.strips_laid import (
    ANGLE,
    COSINE,
    FIELDS,
    LOAD,
    LOBES,
    ORIGIN,
    PART,
    SQUARE,
    WIDTH,
    S,
    Y,
)
from wearsim.contact.normal.strips_planes import share_points, value_at
from wearsim.contact.normal.strips_refit import end_of
from wearsim.contact.normal.strips_wheel import solve_wheel
from wearsim.contact.patch import FloatArray, IntArray

_SMALLEST = 5e-4  # of the load: patches below are left out
_FINE = 160  # samples of the largest pressure


@kernel
def _slopes(x: FloatArray, f: FloatArray, n: int, slope: FloatArray) -> None:
    """Take derivatives at nodes of the parabolas through each and its neighbours."""
    for k in range(1, n - 1):
        before, after = x[k] - x[k - 1], x[k + 1] - x[k]
        left, right = (f[k] - f[k - 1]) / before, (f[k + 1] - f[k]) / after
        slope[k] = (left * after + right * before) / (before + after)
    slope[0] = 2.0 * (f[1] - f[0]) / (x[1] - x[0]) - slope[1]
    slope[n - 1] = 2.0 * (f[n - 1] - f[n - 2]) / (x[n - 1] - x[n - 2]) - slope[n - 2]


@kernel
def _between(
    x: FloatArray, f: FloatArray, slope: FloatArray, c: FloatArray, k: int, at: float
) -> tuple[float, float]:
    """Squared half-length by a cubic and pressure slope linearly, `at` a place between nodes k and k + 1."""
    step = x[k + 1] - x[k]
    t = (at - x[k]) / step
    u = 1.0 - t
    rise = f[k + 1] - f[k]
    a, b = slope[k] * step - rise, rise - slope[k + 1] * step
    return f[k] + t * rise + t * u * (a * u + b * t), c[k] + t * (c[k + 1] - c[k])


@kernel
def lay_patches(
    load: FloatArray,
    vertical: bool,
    modulus: float,
    count: int,
    grid_y: FloatArray,
    grid_z: FloatArray,
    slope: FloatArray,
    angle: FloatArray,
    gaps: FloatArray,
    radii: FloatArray,
    alongs: FloatArray,
    kappa: float,
    influence: FloatArray,
    hertz: FloatArray,
    number: IntArray,
    fault: IntArray,
    out_y: FloatArray,
    out_half: FloatArray,
    out_skew: FloatArray,
    out_slope: FloatArray,
    out_edge: FloatArray,
    values: FloatArray,
) -> None:
    """Solve every row and lay its patches, by falling normal force.

    `values` (n, most, 13): centre y, angle of the plane, approach, normal force, largest pressure, load
    scale, descent, width of the strips; place y from which the patch is seen, its angle for itself, approach
    at that place, and how far across and along its centre lies from there.
    """
    most = 4 * count
    strips, lobe = np.zeros((FIELDS, most)), np.zeros(most, np.int64)
    spans, info = np.zeros((LOBES, PART)), np.zeros(6)
    first, last = np.zeros(most, np.int64), np.zeros(most, np.int64)
    force, order = np.zeros(most), np.zeros(most, np.int64)
    x, f, c, tilt = (np.zeros(most + 2), np.zeros(most + 2), np.zeros(most + 2), np.zeros(most + 2))
    wanted = out_y.shape[2]
    for row in range(load.size):
        gap, along = gaps[row], alongs[row]
        info[:] = 0.0
        fault[row] = solve_wheel(
            load[row] / (np.pi * modulus), vertical, count, grid_y, grid_z, slope, angle, gap, radii[row],
            kappa, max(8, (3 * count) // 5), influence, hertz, strips, lobe, spans, info,
        )  # fmt: skip
        if fault[row] != 0:
            continue
        total, descent, low = int(info[0]), info[1], info[2]
        # Runs of strips with pressure are patches.
        runs, j = 0, 0
        carried = 0.0
        while j < total:
            if strips[LOAD, j] <= 0.0:
                j += 1
                continue
            first[runs] = j
            force[runs] = 0.0
            while j < total and strips[LOAD, j] > 0.0 and lobe[j] == lobe[first[runs]]:
                force[runs] += 0.5 * np.pi * np.pi * modulus * strips[LOAD, j] * strips[WIDTH, j]
                j += 1
            last[runs] = j - 1
            if force[runs] > _SMALLEST * load[row]:
                carried += force[runs] * (strips[COSINE, first[runs]] if vertical else 1.0)
                runs += 1
        if runs > MOST_PATCHES:
            fault[row] = TOO_MANY
            continue
        if runs > 1 and not vertical:
            fault[row] = NOT_SINGLE
            continue
        scale = load[row] / carried
        number[row] = runs
        for k in range(runs):
            order[k] = k
        for k in range(1, runs):
            m = k
            while m > 0 and force[order[m]] > force[order[m - 1]]:
                swap = order[m]
                order[m] = order[m - 1]
                order[m - 1] = swap
                m -= 1
        for rank in range(runs):
            a, b = first[order[rank]], last[order[rank]]
            n = b - a + 1
            width = strips[WIDTH, a]
            left = strips[S, a] + width * (end_of(strips, a, 1, n) - 0.5)
            right = strips[S, b] - width * (end_of(strips, b, -1, n) - 0.5)
            nodes = 1
            x[0], f[0] = left, 0.0
            for j in range(a, b + 1):
                # The outermost strips may lie in part outside of the patch.
                if n > 2 and j in (a, b):
                    continue
                x[nodes], f[nodes] = strips[S, j], strips[SQUARE, j]
                c[nodes] = strips[LOAD, j] / strips[SQUARE, j]
                nodes += 1
            x[nodes], f[nodes] = right, 0.0
            c[0], c[nodes] = c[1], c[nodes - 1]
            nodes += 1
            _slopes(x, f, nodes, tilt)
            top = 0.0
            for k in range(nodes):
                top = max(top, f[k])
            # The largest pressure on a fine grid of its own.
            k, sum_fine, peak = 0, 0.0, 0.0
            for j in range(_FINE):
                s = left + (right - left) * (j + 0.5) / _FINE
                while k < nodes - 2 and x[k + 1] < s:
                    k += 1
                q, ratio = _between(x, f, tilt, c, k, s)
                q = max(q, 1e-9 * top)
                sum_fine += q * ratio
                peak = max(peak, ratio * np.sqrt(q))
            normal = force[order[rank]] * scale
            peak *= normal / (0.5 * np.pi * sum_fine * (right - left) / _FINE)
            # Strips as wanted, along the profile.
            delta, origin = strips[ANGLE, a], strips[ORIGIN, a]
            cosine, sine = np.cos(delta), np.sin(delta)
            i = np.searchsorted(grid_y, origin) - 1
            share = (origin - grid_y[i]) / (grid_y[i + 1] - grid_y[i])
            base = grid_z[i] + share * (grid_z[i + 1] - grid_z[i])
            base_x = along[i] + share * (along[i + 1] - along[i])
            i = max(i - int(2.0 * (abs(left) + 1e-3) / (grid_y[i + 1] - grid_y[i])), 0)
            s_here = (grid_y[i] - origin) * cosine + (grid_z[i] - base) * sine
            while s_here > left and i > 0:
                i -= 1
                s_here = (grid_y[i] - origin) * cosine + (grid_z[i] - base) * sine
            s_next = (grid_y[i + 1] - origin) * cosine + (grid_z[i + 1] - base) * sine
            step = (right - left) / wanted
            k, volume, moment, lowest = 0, 0.0, 0.0, NO_WHEEL
            for j in range(2 * wanted + 1):
                s = left + 0.5 * j * step
                while s > s_next and i < gap.size - 3:
                    i += 1
                    s_here = s_next
                    s_next = (grid_y[i + 1] - origin) * cosine + (grid_z[i + 1] - base) * sine
                    if s_here >= left:
                        lowest = min(lowest, gap[i])
                share = (s - s_here) / (s_next - s_here)
                if j % 2 == 0:
                    out_edge[row, rank, j // 2] = grid_y[i] + share * (grid_y[i + 1] - grid_y[i])
                    lowest = min(lowest, gap[i] + share * (gap[i + 1] - gap[i]))
                    continue
                while k < nodes - 2 and x[k + 1] < s:
                    k += 1
                q, ratio = _between(x, f, tilt, c, k, s)
                q = max(q, 1e-9 * top)
                out_y[row, rank, j // 2] = s
                out_half[row, rank, j // 2] = np.sqrt(q)
                out_skew[row, rank, j // 2] = along[i] + share * (along[i + 1] - along[i]) - base_x
                out_slope[row, rank, j // 2] = ratio
                volume += q * ratio * step
                moment += q * ratio * step * s
            middle = moment / volume
            for j in range(wanted):
                out_y[row, rank, j] -= middle
                out_slope[row, rank, j] *= normal / (0.5 * np.pi * volume)
            k = min(max(int((middle - left) / step), 0), wanted - 1)
            share = (middle - left) / step - k
            centre = out_edge[row, rank, k] + share * (out_edge[row, rank, k + 1] - out_edge[row, rank, k])
            k = min(max(int((middle - left) / step - 0.5), 0), wanted - 2) if wanted > 1 else 0
            if wanted > 1:
                share = (middle - left) / step - 0.5 - k
                middle_x = out_skew[row, rank, k] + share * (
                    out_skew[row, rank, k + 1] - out_skew[row, rank, k]
                )
            else:
                middle_x = out_skew[row, rank, 0]
            for j in range(wanted):
                out_skew[row, rank, j] -= middle_x
            line = values[row, rank]
            line[0], line[1], line[2], line[3] = centre, delta, (descent - (lowest - low)) * cosine, normal
            line[4], line[5], line[6], line[7] = peak, scale, low + descent, step
            weighted, total_load = 0.0, 0.0
            for j in range(a, b + 1):
                weighted += strips[LOAD, j] * value_at(strips[Y, j], grid_y, angle)
                total_load += strips[LOAD, j]
            line[9] = weighted / total_load
        share_points(runs, descent, grid_y, grid_z, along, out_edge[row], values[row])
