"""Kernels of the strip model: patches of a wheel, and the strips of the solution.

Equations and sources: see `knothe_le_the`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import bare_kernel
from wearsim.contact.normal.knothe_le_the.strips import (
    NO_ROOM,
    Records,
    Row,
    Work,
    blended,
    first_beyond,
    plane_share_of,
    points_in_plane,
    value_at,
)
from wearsim.contact.normal.model import NOT_SINGLE
from wearsim.contact.patch import FloatArray, IntArray

_SMALLEST = 5e-4  # of the load: patches below are left out
_FINE = 160  # samples of the largest pressure
_GIVES_WAY = 0.25  # widths of a strip


class Wheels(NamedTuple):
    """Points of the counterface's profile, and gap, its lowest value, ring and contact line of every row."""

    y: FloatArray
    z: FloatArray
    slope: FloatArray
    angle: FloatArray
    gap: FloatArray
    low: FloatArray
    radius: FloatArray
    along: FloatArray
    kappa: float
    vertical: bool


@bare_kernel
def end_of(strips: Records, first: int, step: int, count: int) -> float:
    """Widths of a strip from the outer edge of strip `first` inwards to where the half-length is zero.

    A parabola through q of the strips behind the outermost one with pressure, which may lie in part outside.
    Where the patch is wide up to its end the parabola sees it far outside: then as if q fell linearly within
    the outermost strip, less what makes it give way to the parabola of a smooth end.
    """
    k = 0
    while k < count and strips[first + k * step].load <= 0.0:
        k += 1
    n = 0
    while k + n < count and n < 4 and strips[first + (k + n) * step].load > 0.0:
        n += 1
    if n < 3:
        return float(k)
    one, two = strips[first + (k + 1) * step].square, strips[first + (k + 2) * step].square
    share = strips[first + k * step].square / one
    covered = 1.0 - _GIVES_WAY - share - np.sqrt(share * share + share)
    rise, bend = two - one, 0.0
    if rise > 0.0:
        if n > 3:
            bend = min(0.5 * (strips[first + (k + 3) * step].square - 2.0 * two + one), 0.0)
        tilt = rise - bend
        covered = max(covered, 1.5 - 2.0 * one / (tilt + np.sqrt(tilt * tilt - 4.0 * bend * one)))
    end: float = k + min(max(covered, -0.5), 1.0)
    return end


@bare_kernel
def find_patches(
    total: int, displacement: float, load: float, modulus: float, row: Row, strips: Records, patches: Records,
    nodes: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Find the patches of a wheel, by falling normal force; return a fault or 0, and their number."""
    # Runs of strips with pressure are patches.
    runs, j, carried = 0, 0, 0.0
    while j < total:
        first, force = j, 0.0
        while j < total and strips[j].load > 0.0 and strips[j].part == strips[first].part:
            force += 0.5 * np.pi * np.pi * modulus * strips[j].load * strips[j].width
            j += 1
        j = max(j, first + 1)
        if force > _SMALLEST * load:
            if runs == patches.size:
                return NO_ROOM, runs
            carried += force * (strips[first].cosine if row.vertical else 1.0)
            place = runs
            runs += 1
            while place > 0 and patches[place - 1].force < force:
                patches[place] = patches[place - 1]
                place -= 1
            one = patches[place]
            one.force, one.first, one.last = force, first, j - 1
    if runs > 1 and not row.vertical:
        return NOT_SINGLE, runs
    for rank in range(runs):
        one = patches[rank]
        x, f, c = nodes[0, rank], nodes[1, rank], nodes[2, rank]
        a, b = one.first, one.last
        n, width = b - a + 1, strips[a].width
        one.scale = load / carried
        one.force *= one.scale
        one.displacement, one.angle, one.origin = displacement, strips[a].angle, strips[a].origin
        one.start = strips[a].s + width * (end_of(strips, a, 1, n) - 0.5)
        one.stop = strips[b].s - width * (end_of(strips, b, -1, n) - 0.5)
        weighted, sum_load, count = 0.0, 0.0, 1
        for j in range(a, b + 1):
            weighted += strips[j].load * strips[j].tilt
            sum_load += strips[j].load
            # The outermost strips may lie in part outside of the patch.
            if n <= 2 or a < j < b:
                x[count], f[count] = strips[j].s, strips[j].square
                c[count] = strips[j].load / strips[j].square
                count += 1
        x[0], f[0], c[0] = one.start, 0.0, c[1]
        x[count], f[count], c[count] = one.stop, 0.0, c[count - 1]
        one.nodes = count + 1
        one.own = weighted / sum_load
    return 0, runs


class Cut(NamedTuple):
    """Strips of equal width: centres, half-lengths, middles, pressure slopes; edges on the profile."""

    y: FloatArray
    half: FloatArray
    middle: FloatArray
    slope: FloatArray
    edge: FloatArray


@bare_kernel
def _slopes(x: FloatArray, f: FloatArray, slope: FloatArray) -> None:
    """Take derivatives at nodes of the parabolas through each and its neighbours."""
    n = x.size
    for k in range(1, n - 1):
        before, after = x[k] - x[k - 1], x[k + 1] - x[k]
        left, right = (f[k] - f[k - 1]) / before, (f[k + 1] - f[k]) / after
        slope[k] = (left * after + right * before) / (before + after)
    slope[0] = 2.0 * (f[1] - f[0]) / (x[1] - x[0]) - slope[1]
    slope[n - 1] = 2.0 * (f[n - 1] - f[n - 2]) / (x[n - 1] - x[n - 2]) - slope[n - 2]


@bare_kernel
def _between(
    x: FloatArray, f: FloatArray, slope: FloatArray, c: FloatArray, least: float, at: float
) -> tuple[float, float]:
    """Squared half-length by a cubic, at least the `least`, and pressure slope linearly, at a place."""
    k = min(max(first_beyond(x, x.size, at) - 1, 0), x.size - 2)
    step = x[k + 1] - x[k]
    t = (at - x[k]) / step
    u = 1.0 - t
    rise = f[k + 1] - f[k]
    a, b = slope[k] * step - rise, rise - slope[k + 1] * step
    return max(f[k] + t * rise + t * u * (a * u + b * t), least), c[k] + t * (c[k + 1] - c[k])


@bare_kernel
def cut_patches(
    wheels: Wheels, rows: IntArray, places: IntArray, ranks: IntArray, counts: IntArray, patches: Records,
    nodes: FloatArray, work: Work, out: Cut,
) -> None:  # fmt: skip
    """Cut patches, by row, into strips of equal width; what lies behind the strips of a patch is padding."""
    for m in range(rows.size):
        one, strips, r = patches[m], counts[m], rows[m]
        row = Row(
            wheels.y, wheels.z, wheels.slope, wheels.angle, wheels.gap[r], wheels.radius[r],
            wheels.along[r], wheels.low[r], wheels.kappa, 0.0, wheels.vertical,
        )  # fmt: skip
        at, rank, n = places[m], ranks[m], one.nodes
        x, f, c = nodes[0, at, rank][:n], nodes[1, at, rank][:n], nodes[2, at, rank][:n]
        left, right, slope = one.start, one.stop, work.right
        _slopes(x, f, slope)
        least = 0.0
        for k in range(n):
            least = max(least, 1e-9 * f[k])
        # The largest pressure on a fine grid of its own.
        total, peak = 0.0, 0.0
        for j in range(_FINE):
            q, ratio = _between(x, f, slope, c, least, left + (right - left) * (j + 0.5) / _FINE)
            total += q * ratio
            peak = max(peak, ratio * np.sqrt(q))
        one.pressure = peak * one.force / (0.5 * np.pi * total * (right - left) / _FINE)
        # Strips of the solution, along the profile.
        first, last = points_in_plane(one.origin, one.angle, left, right, row, work.s)
        s, y = work.s[first : last + 1], row.y[first : last + 1]
        gap, along = row.gap[first : last + 1], row.along[first : last + 1]
        step = (right - left) / strips
        edge, volume, moment = out.edge[m], 0.0, 0.0
        for j in range(strips + 1):
            edge[j] = value_at(left + j * step, s, y)
        for j in range(strips):
            place = left + 0.5 * (2 * j + 1) * step
            q, ratio = _between(x, f, slope, c, least, place)
            out.y[m, j], out.half[m, j], out.slope[m, j] = place, np.sqrt(q), ratio
            out.middle[m, j] = value_at(place, s, along)
            volume += q * ratio * step
            moment += q * ratio * step * place
        middle = moment / volume
        k = min(max(int((middle - left) / step), 0), strips - 1)
        one.centre = edge[k] + ((middle - left) / step - k) * (edge[k + 1] - edge[k])
        middle_x = value_at(middle, out.y[m, :strips], out.middle[m, :strips])
        for j in range(strips):
            out.y[m, j] -= middle
            out.slope[m, j] *= one.force / (0.5 * np.pi * volume)
            out.middle[m, j] -= middle_x
        for j in range(strips, out.y.shape[1]):
            out.y[m, j], out.half[m, j] = out.y[m, strips - 1], 0.0
            out.middle[m, j], out.slope[m, j] = out.middle[m, strips - 1], out.slope[m, strips - 1]
            edge[j + 1] = edge[strips]
        lowest = min(value_at(left, s, gap), value_at(right, s, gap))
        for k in range(gap.size):
            if left < s[k] < right:
                lowest = min(lowest, gap[k])
        one.approach = (one.displacement - (lowest - row.low)) * np.cos(one.angle)
        one.left, one.right = edge[0], edge[strips]
        if m + 1 == rows.size or rows[m + 1] != r:
            share_points(patches[m - ranks[m] : m + 1], row, work.share)


@bare_kernel
def share_points(patches: Records, row: Row, share: FloatArray) -> None:
    """Creepage reference points of the patches of a wheel, one for those in a plane; `share` is for work."""
    for j in range(patches.size):
        for k in range(patches.size):
            one, other = patches[j], patches[k]
            if one.centre < other.centre:
                both = plane_share_of(one.right, other.left, one.own - other.own, row)
                share[j, k] = share[k, j] = both**4
    for k in range(patches.size):
        own = patches[k]
        lowest, deeper = own.displacement - own.approach / np.cos(own.angle), 0.0
        for j in range(patches.size):
            if j != k:
                height = own.displacement - patches[j].approach / np.cos(patches[j].angle)
                deeper = min(deeper, share[j, k] * (height - lowest))
        place = blended(k, patches.size, share, patches.force, patches.centre)
        own.point = place
        own.point_approach = (own.displacement - lowest - deeper) * np.cos(own.angle)
        down = value_at(own.centre, row.y, row.z) - value_at(place, row.y, row.z)
        own.across = (own.centre - place) * np.cos(own.angle) + down * np.sin(own.angle)
        own.along = value_at(own.centre, row.y, row.along) - value_at(place, row.y, row.along)
