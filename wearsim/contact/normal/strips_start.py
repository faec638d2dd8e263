"""Kernels of the strip model: a first descent, with patches pressed into ellipses.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact.geometry import NO_WHEEL
from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray


@kernel
def hertz_at(table: FloatArray, ratio: float) -> tuple[float, float, float]:
    """Return A a^2/delta, B b^2/delta and p0/(E* a A) of ellipses at A/B from a table over its logarithm."""
    x = (np.log(ratio) + 14.0) * 8.0
    k = min(max(int(x), 0), table.shape[0] - 2)
    x = min(max(x - k, 0.0), 1.0)
    return (
        table[k, 0] + x * (table[k + 1, 0] - table[k, 0]),
        table[k, 1] + x * (table[k + 1, 1] - table[k, 1]),
        table[k, 2] + x * (table[k + 1, 2] - table[k, 2]),
    )


@kernel
def _start(
    descent: float,
    low: float,
    vertical: bool,
    grid_y: FloatArray,
    grid_z: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    table: FloatArray,
    lobes: FloatArray,
) -> tuple[float, int]:
    """Return load over pi E* at a descent, every part pressed into an ellipse, and their number.

    `lobes` gets a line for each: left and right end (profile y), half-length squared per depth, gap where it
    ends, load per half-length squared.
    """
    total, used = 0.0, 0
    i = 1
    last = gap.size - 2
    while i < last and used < lobes.shape[0]:
        if gap[i] - low >= 0.55 * descent:
            i += 1
            continue
        start = i
        deepest = i
        while i < last and gap[i] - low < 0.55 * descent:
            if gap[i] < gap[deepest]:
                deepest = i
            i += 1
        stop = i - 1
        cosine = np.cos(angle[deepest])
        reach = 0.55 * descent - (gap[deepest] - low)
        # Ends between grid points.
        left, right = grid_y[start], grid_y[stop]
        if gap[start - 1] < NO_WHEEL:
            share = (low + 0.55 * descent - gap[start]) / max(gap[start - 1] - gap[start], 1e-12)
            left -= min(share, 1.0) * (grid_y[start] - grid_y[start - 1])
        if gap[stop + 1] < NO_WHEEL:
            share = (low + 0.55 * descent - gap[stop]) / max(gap[stop + 1] - gap[stop], 1e-12)
            right += min(share, 1.0) * (grid_y[stop + 1] - grid_y[stop])
        half = 0.5 * (right - left) / cosine
        across = reach * cosine / (half * half)
        along = 0.5 * (cosine / radius[deepest] + kappa / (1.0 - kappa * grid_z[deepest]) * cosine)
        along_share, across_share, slope = hertz_at(table, along / across)
        # Depth below the rim of the ellipse: `across_share` of the part's own descent.
        own = descent - (gap[deepest] - low)
        rim = (gap[deepest] - low) + across_share * own
        per_depth = along_share / across_share * cosine / along
        area = 0.0
        a, b = start, stop
        while a > 1 and gap[a - 1] - low < rim:
            a -= 1
        while b < last and gap[b + 1] - low < rim:
            b += 1
        for k in range(a, b + 1):
            depth = rim - (gap[k] - low)
            if depth > 0.0:
                area += depth * per_depth * 0.5 * (grid_y[k + 1] - grid_y[k - 1]) / cosine
        stiff = slope * along / np.pi
        lobes[used, 0] = grid_y[a] - 0.5 * (grid_y[a] - grid_y[a - 1])
        lobes[used, 1] = grid_y[b] + 0.5 * (grid_y[b + 1] - grid_y[b])
        if across_share < 0.55:
            while a < b and gap[a] - low > rim:
                a += 1
            while b > a and gap[b] - low > rim:
                b -= 1
            lobes[used, 0] = grid_y[a] - 0.5 * (grid_y[a] - grid_y[a - 1])
            lobes[used, 1] = grid_y[b] + 0.5 * (grid_y[b + 1] - grid_y[b])
        lobes[used, 2] = per_depth
        lobes[used, 3] = rim
        lobes[used, 4] = stiff
        force = 0.5 * np.pi * stiff * area
        total += force * cosine if vertical else force
        used += 1
    return total, used


@kernel
def first_descent(
    load: float,
    low: float,
    vertical: bool,
    grid_y: FloatArray,
    grid_z: FloatArray,
    angle: FloatArray,
    gap: FloatArray,
    radius: FloatArray,
    kappa: float,
    table: FloatArray,
    lobes: FloatArray,
) -> tuple[float, int]:
    """Descent at which patches pressed into ellipses carry the load, to a few per cent, and their number."""
    small, large = 0.0, 0.0
    descent = 5e-5
    found = 0
    for _ in range(40):
        value, found = _start(descent, low, vertical, grid_y, grid_z, angle, gap, radius, kappa, table, lobes)
        if found > 0 and abs(value / load - 1.0) < 0.02:
            break
        if value < load:
            small = descent
        else:
            large = descent
        guess = descent * (load / value) ** (2.0 / 3.0) if value > 0.0 else 4.0 * descent
        guess = min(max(guess, 0.25 * descent), 4.0 * descent)
        if large > 0.0 and not small < guess < large:
            guess = 0.5 * (small + large)
        descent = guess
    return descent, found
