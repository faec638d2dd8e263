"""Patches of the solved strips, cut into strips of equal width for the contract.

Equations and sources: see `coupled_strips`. Between the middles of solved strips q is a
cubic, with the slopes of the parabola through a node and its neighbours, and the ratio
a line; a strip of the patch carries the integral of the load over its width, and its q
is the mean.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.coupled_strips.strips import Records, Row, linear_at
from wearsim.contact.normal.coupled_strips.wheel import Wheels, row_of
from wearsim.contact.patch import FloatArray, IntArray

_SAMPLES = 6  # samples of the pressure between two nodes, for its maximum
_STEEPEST = 3.0  # largest slope of a monotone cubic over that of its chord
_END = 1.5  # the same at the first strip from the end
_LEAST = 1e-9  # least q over the largest: strips of a patch have a length
# Gauss's rule of three points, exact for a cubic times a line: places and weights on a
# unit length.
_GAUSS = (
    (0.5 - np.sqrt(0.15), 5.0 / 18.0),
    (0.5, 4.0 / 9.0),
    (0.5 + np.sqrt(0.15), 5.0 / 18.0),
)


class Cut(NamedTuple):
    """Strips of equal width: centres, half-lengths, middle lines, slopes and edges.

    Slopes are those of pressure; edges are positions on the profile.
    """

    y: FloatArray
    half: FloatArray
    middle: FloatArray
    slope: FloatArray
    edge: FloatArray


class Nodes(NamedTuple):
    """Nodes (n,) along the arc.

    Between them q is a cubic with these `slope`, and the ratio is linear.
    """

    place: FloatArray
    square: FloatArray
    slope: FloatArray
    ratio: FloatArray


def nodes_for(most: int) -> Nodes:
    """Allocate the nodes of a number of strips and the ends of a patch."""
    return Nodes(*np.empty((4, most + 2)))


@bare_kernel
def measure_patches(
    wheels: Wheels, number: IntArray, patches: Records, kept: FloatArray
) -> None:
    """Find the widths of the patches of every row along the arc."""
    for n in range(number.size):
        for m in range(number[n]):
            patch = patches[n, m]
            patch.left = min(
                wheels.step * patch.start, kept[0, n, patch.first_whole] - 1e-9
            )
            patch.right = max(
                wheels.step * patch.stop, kept[0, n, patch.last_whole] + 1e-9
            )
            patch.width = patch.right - patch.left


@bare_kernel
def cut_patches(
    wheels: Wheels,
    rows: IntArray,
    places: IntArray,
    load: FloatArray,
    modulus: float,
    counts: IntArray,
    patches: Records,
    kept: FloatArray,
    nodes: Nodes,
    out: Cut,
) -> None:
    """Cut patches, by row, into strips of equal width.

    Entries after the last strip of a patch are padding.
    """
    for m in range(patches.size):
        row = row_of(wheels, rows[places[m]], load[places[m]])
        count = _fill_nodes(patches[m], kept[:, places[m]], nodes)
        _cut(m, patches[m], counts[m], count, modulus, row, nodes, out)


@bare_kernel
def fill_planes(
    wheels: Wheels,
    places: IntArray,
    modulus: float,
    patches: Records,
    kept: FloatArray,
    count: IntArray,
    planes: FloatArray,
) -> None:
    """Combine neighbouring strips of patches in pairs, independent of the patch ends.

    `planes` (7, m, N) become y, station, width, half, middle, peak and angle of
    `StripPlanes`, of `count` (m,) strips each. Load, middle and variance of the
    pressure along the strip are kept: that of a semi-ellipse of half length a is a^2 /
    4.
    """
    for m in range(patches.size):
        patch, place = patches[m], places[m]
        k, pair = -1, 0
        load = moment = square = turned = 0.0
        for i in range(patch.first, patch.last + 1):
            number = int(np.floor(0.5 * kept[6, place, i]))
            if k < 0 or number != pair:
                k, pair = k + 1, number
                load = moment = square = turned = 0.0
                planes[2, m, k] = 0.0
                planes[1, m, k] = kept[0, place, i] - 0.5 * kept[3, place, i]
            part = kept[2, place, i] * kept[1, place, i] * kept[3, place, i]
            middle = kept[5, place, i]
            load, moment = load + part, moment + part * middle
            square += part * (0.25 * kept[1, place, i] + middle * middle)
            turned += part * kept[4, place, i]
            planes[2, m, k] += kept[3, place, i]
            planes[1, m, k] += 0.5 * kept[3, place, i]
            planes[0, m, k] = linear_at(wheels.y, planes[1, m, k] / wheels.step)
            half = 2.0 * np.sqrt(square / load - (moment / load) ** 2)
            planes[3, m, k] = half
            planes[4, m, k] = moment / load - patch.along
            planes[5, m, k] = (
                np.pi * modulus * patch.scale * load / (half * planes[2, m, k])
            )
            planes[6, m, k] = turned / load
        count[m] = k + 1


@inner_bare_kernel
def _fill_nodes(patch: Records, kept: FloatArray, nodes: Nodes) -> int:
    """Set nodes at the centres of the solved strips of a patch and at its ends.

    Return their number.
    """
    first, last = patch.first_whole, patch.last_whole
    count = last - first + 3
    for k in range(1, count - 1):
        nodes.place[k], nodes.square[k] = kept[0, first + k - 1], kept[1, first + k - 1]
        nodes.ratio[k] = kept[2, first + k - 1]
    for end, inside, place in ((0, 1, patch.left), (count - 1, count - 2, patch.right)):
        nodes.place[end], nodes.square[end], nodes.ratio[end] = (
            place,
            0.0,
            nodes.ratio[inside],
        )
    place, square, slope = nodes.place, nodes.square, nodes.slope
    for k in range(1, count - 1):
        before, behind = place[k] - place[k - 1], place[k + 1] - place[k]
        left, right = (
            (square[k] - square[k - 1]) / before,
            (square[k + 1] - square[k]) / behind,
        )
        slope[k] = (left * behind + right * before) / (before + behind)
        if left * right > 0.0:
            # Between a strip that hardly carries and the next one the cubic must not
            # oscillate.
            most = _STEEPEST * min(abs(left), abs(right))
            slope[k] = min(max(slope[k], -most), most)
    for end, inside in ((0, 1), (count - 1, count - 2)):
        # parabola that rises monotonically from the end
        chord = square[inside] / (place[inside] - place[end])
        if slope[inside] * chord > 0.0:
            slope[inside] = np.sign(chord) * min(abs(slope[inside]), _END * abs(chord))
        slope[end] = 2.0 * chord - slope[inside]
    return count


@inner_bare_kernel
def _between(nodes: Nodes, k: int, place: float, least: float) -> tuple[float, float]:
    """Squared half-length, at least `least`, and ratio after node k."""
    step = nodes.place[k + 1] - nodes.place[k]
    t = (place - nodes.place[k]) / step
    u, rise = 1.0 - t, nodes.square[k + 1] - nodes.square[k]
    a, b = nodes.slope[k] * step - rise, rise - nodes.slope[k + 1] * step
    square = nodes.square[k] + t * rise + t * u * (a * u + b * t)
    return max(square, least), nodes.ratio[k] + t * (
        nodes.ratio[k + 1] - nodes.ratio[k]
    )


@inner_bare_kernel
def _cut(
    m: int,
    patch: Records,
    strips: int,
    count: int,
    modulus: float,
    row: Row,
    nodes: Nodes,
    out: Cut,
) -> None:
    """Cut one patch into strips, and measure it."""
    width, left = patch.width / strips, patch.left
    largest, least, peak = 0.0, 0.0, 0.0
    for k in range(count):
        largest = max(largest, nodes.square[k])
    least = _LEAST * largest
    for k in range(count - 1):
        step = nodes.place[k + 1] - nodes.place[k]
        for n in range(_SAMPLES):
            square, ratio = _between(
                nodes, k, nodes.place[k] + step * n / _SAMPLES, least
            )
            peak = max(peak, square * ratio * ratio)
    # Integrals over each strip, by intervals between nodes.
    k, total, moment = 0, 0.0, 0.0
    for j in range(strips):
        start, stop = left + j * width, left + (j + 1) * width
        area, carried = 0.0, 0.0
        while True:
            end = min(stop, nodes.place[k + 1])
            if k + 2 == count:
                end = stop
            for share, weight in _GAUSS:
                square, ratio = _between(nodes, k, start + share * (end - start), least)
                area += weight * (end - start) * square
                carried += weight * (end - start) * square * ratio
            start = end
            if end == stop:
                break
            k += 1
        out.y[m, j], out.half[m, j] = left + (j + 0.5) * width, np.sqrt(area / width)
        out.slope[m, j] = carried / area
        load = out.slope[m, j] * out.half[m, j] ** 2
        total += load
        moment += load * out.y[m, j]
    centre = moment / total
    # The force is that of the solved strips; load is 2 N / (pi^2 E*).
    factor = np.pi * modulus * patch.force / (total * width)
    patch.force *= 0.5 * np.pi**2 * modulus
    patch.pressure = np.sqrt(peak) * factor
    _place(m, patch, strips, centre, row, out)
    for j in range(strips):
        out.y[m, j] -= centre
        out.slope[m, j] *= factor
    last = strips - 1
    for j in range(strips, out.y.shape[1]):
        out.y[m, j], out.half[m, j], out.slope[m, j] = (
            out.y[m, last],
            0.0,
            out.slope[m, last],
        )
        out.middle[m, j], out.edge[m, j + 1] = out.middle[m, last], out.edge[m, strips]
    patch.left, patch.right = out.edge[m, 0], out.edge[m, strips]


@inner_bare_kernel
def _place(
    m: int, patch: Records, strips: int, centre: float, row: Row, out: Cut
) -> None:
    """Edges and middle lines of strips on the profile, and the approach of a patch."""
    width = patch.width / strips
    for j in range(strips + 1):
        out.edge[m, j] = linear_at(row.y, (patch.left + j * width) / row.step)
    patch.centre = linear_at(row.y, centre / row.step)
    patch.along = linear_at(row.along, centre / row.step)
    for j in range(strips):
        out.middle[m, j] = (
            linear_at(row.along, (patch.left + (j + 0.5) * width) / row.step)
            - patch.along
        )
    lowest = min(linear_at(row.gap, patch.start), linear_at(row.gap, patch.stop))
    for k in range(
        max(int(patch.start) + 1, 0), min(int(patch.stop) + 1, row.gap.size)
    ):
        lowest = min(lowest, row.gap[k])
    patch.approach = (patch.displacement - lowest) * np.cos(patch.angle)
