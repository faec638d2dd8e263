"""Cells of a patch from the points along its solved strips."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import inner_bare_kernel, kernel, plain
from wearsim.contact.patch import FloatArray, IntArray, Patch
from wearsim.contact.tangential.coupled_strips.influence import (
    StripPoints,
    strip_points,
)
from wearsim.contact.tangential.coupled_strips.strips import WheelStrips
from wearsim.contact.tangential.semismooth_newton import STICK

_SLIVER = 1e-9  # relative overlap of strips that is ignored
# distance of the centres of adjacent strips, over their mean width
_TOUCHING = 1.0 + 1e-6


@lru_cache(maxsize=256)
def cell_means(cells: int, count: int) -> FloatArray:
    r"""Means of a traction over cells along a strip, from its values at the points.

    Parameters
    ----------
    cells : int
        nx, from the leading end.
    count : int
        n, points.

    Returns
    -------
    (n, nx) array
        Exact, by :math:`\int\sqrt{1-t^2}\,U_l\,dt = -\frac12[\frac{\sin l\theta}{l} -
        \frac{\sin(l+2)\theta}{l+2}]`; their sum over the points is the mean of
        :math:`\sqrt{1-t^2}`.
    """
    angle = np.arccos(1.0 - 2.0 * np.arange(cells + 1) / cells)
    order = np.arange(count)[:, None]
    whole = np.where(order > 0, np.sin(order * angle) / np.maximum(order, 1), angle)
    whole -= np.sin((order + 2) * angle) / (order + 2)
    return np.ascontiguousarray(
        strip_points(count).basis.T @ np.diff(whole, axis=1) * (0.25 * cells)
    )


class PatchCells(NamedTuple):
    """Strips and cells of m patches to which tractions are transferred.

    Parameters
    ----------
    means : (u, n, nx) array
        `cell_means` of different numbers of cells, padded.
    number : (m,) int array
        Which of them each patch has.
    cells : (m,) int array
        Along each strip.
    y, x_lead, x_trail, slope : (m, ny) array
        Of the patch's strips, see `Patch`.
    width : (m,) array
        Of these strips [m].
    """

    means: FloatArray
    number: IntArray
    cells: IntArray
    y: FloatArray
    x_lead: FloatArray
    x_trail: FloatArray
    slope: FloatArray
    width: FloatArray


def cells_of_patches(patch: Patch, count: int) -> PatchCells:
    """Cells of patches, with the means of tractions at `count` points."""
    kinds, number = np.unique(patch.cells, return_inverse=True)
    means = np.zeros((kinds.size, count, int(kinds.max(initial=1))))
    for k, cells in enumerate(kinds.tolist()):
        means[k, :, :cells] = cell_means(cells, count)
    return PatchCells(
        means,
        plain(number, np.int64),
        plain(patch.cells, np.int64),
        plain(patch.y),
        plain(patch.x_lead),
        plain(patch.x_trail),
        plain(patch.pressure_slope),
        plain(patch.width),
    )


class WorkArrays(NamedTuple):
    """Data of the solved strips of one patch while its cells are filled.

    Parameters
    ----------
    solved : (3, N, nx) array
        Tractions of the solved strips over their largest pressure, and work over it.
    slopes : (2, N, nx) array
        Slopes of the tractions across [1/m].
    sliding : (N,) array
        Share of each strip that slips.
    rate : (n + 1,) array
        Work over pressure where strains are computed.
    root : (nx,) array
        Means of the root in the pressure.
    line : (5, nx) array
        Tractions, work and slip of one strip of the patch.
    """

    solved: FloatArray
    slopes: FloatArray
    sliding: FloatArray
    rate: FloatArray
    root: FloatArray
    line: FloatArray


@kernel
def fill_cells(
    points: StripPoints,
    strips: WheelStrips,
    patches: PatchCells,
    shear_modulus: float,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
    out: FloatArray,
    force: FloatArray,
    slip_area: FloatArray,
) -> None:
    """Fill patch cells with tractions and interpolated work, and sum their forces.

    Work is relative to pressure.

    Parameters
    ----------
    points : StripPoints
        Of each strip.
    strips : WheelStrips
        Strips that are solved.
    patches : PatchCells
        Strips and cells of the patches.
    shear_modulus : float
        [Pa].
    traction, slip, marks : flat arrays
        Tractions over the shear modulus (2, N, n), slip (2, N, n + 1), and how points
        are marked (N, n), of one wheel behind the other.
    out : (5, m, nx, ny) array
        Filled with pressure, traction and slip; without cells (nx = 0) the forces alone
        are wanted.
    force : (m, 3) array
        The sums over the cells are added: of patches in one plane their forces and
        moments.
    slip_area : (m,) array
        Filled with the area that slips [m2].
    """
    n, most = points.place.size, patches.means.shape[2]
    widest = 0
    for w in range(strips.begin.size - 1):
        widest = max(widest, strips.begin[w + 1] - strips.begin[w])
    work = WorkArrays(
        np.empty((3, widest, most)),
        np.empty((2, widest, most)),
        np.empty(widest),
        np.empty(n + 1),
        np.empty(most),
        np.empty((5, most)),
    )
    for w in range(strips.begin.size - 1):
        begin, end = strips.begin[w], strips.begin[w + 1]
        of_wheel = traction[2 * begin * n : 2 * end * n].reshape(2, end - begin, n)
        slip_of_wheel = slip[2 * begin * (n + 1) : 2 * end * (n + 1)].reshape(
            2, end - begin, n + 1
        )
        marks_of_wheel = marks[begin * n : end * n].reshape(end - begin, n)
        first = begin
        while first < end:
            last = first + 1
            while last < end and strips.patch[last] == strips.patch[first]:
                last += 1
            # An adjacent strip of another patch continues the tractions.
            low = first - 1 if first > begin and _touch(strips, first - 1) else first
            high = last + 1 if last < end and _touch(strips, last - 1) else last
            _along(
                points,
                strips,
                patches,
                shear_modulus,
                begin,
                low,
                high,
                strips.patch[first],
                of_wheel,
                slip_of_wheel,
                marks_of_wheel,
                work,
            )
            _hand_out(
                strips, patches, low, first, last, high, work, out, force, slip_area
            )
            first = last


@inner_bare_kernel
def _touch(strips: WheelStrips, i: int) -> bool:
    """Return True if a strip of a wheel touches the next one."""
    apart = strips.station[i + 1] - strips.station[i]
    return bool(apart < 0.5 * _TOUCHING * (strips.width[i] + strips.width[i + 1]))


@inner_bare_kernel
def _along(
    points: StripPoints,
    strips: WheelStrips,
    patches: PatchCells,
    shear_modulus: float,
    begin: int,
    low: int,
    high: int,
    m: int,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
    work: WorkArrays,
) -> None:
    """Fill tractions, slopes, work and slip share of strips `low` to `high` along x.

    The cells are those of patch m.
    """
    cells, means = patches.cells[m], patches.means[patches.number[m]]
    for c in range(cells):
        work.root[c] = 0.0
    for k in range(means.shape[0]):
        for c in range(cells):
            work.root[c] += means[k, c]
    root = work.root[:cells]
    for s in range(low, high):
        i, strip = s - low, s - begin
        scale = shear_modulus / strips.peak[s]
        for axis in range(2):
            _means_along(
                traction[axis, strip], scale, means, work.solved[axis, i, :cells]
            )
        _cut_back_along(
            work.solved[0, i, :cells],
            work.solved[1, i, :cells],
            root,
            strips.friction[s],
        )
        work.sliding[i] = _rates(
            points.between,
            traction[:, strip],
            slip[:, strip],
            marks[strip],
            scale,
            strips.friction[s],
            work.rate,
        )
        _work_along(points.between, work.rate, root, work.solved[2, i, :cells])
    _slopes_across(work.solved, strips, low, high, cells, work.slopes)


@inner_bare_kernel
def _hand_out(
    strips: WheelStrips,
    patches: PatchCells,
    low: int,
    first: int,
    last: int,
    high: int,
    work: WorkArrays,
    out: FloatArray,
    force: FloatArray,
    slip_area: FloatArray,
) -> None:
    """Fill the patch cells of the strips `first` to `last`.

    They are interpolated from the solved strips `low` to `high`.
    """
    m = strips.patch[first]
    cells, width = patches.cells[m], patches.width[m]
    solved, slopes, root = work.solved, work.slopes, work.root
    x, y, rate, slip_x, slip_y = (
        work.line[0],
        work.line[1],
        work.line[2],
        work.line[3],
        work.line[4],
    )
    area = 0.0
    for j in range(patches.y.shape[1]):
        half = 0.5 * (patches.x_lead[m, j] - patches.x_trail[m, j])
        largest = patches.slope[m, j] * half
        if largest <= 0.0:
            continue
        lower, upper = _edges(strips, patches, first, j)
        for c in range(cells):
            x[c], y[c], rate[c] = 0.0, 0.0, 0.0
        covered, bound, sliding = 0.0, 0.0, 0.0
        p, q = _overlapped(strips, first, last, lower, upper)
        for s in range(p, q):
            share, place = _part(strips, s, lower, upper, q - p == 1)
            i, off = s - low, place - strips.centre[s]
            covered += share
            bound += share * strips.friction[s]
            sliding += share * work.sliding[i]
            _add_line(solved[0, i], slopes[0, i], share, off * share, x, cells)
            _add_line(solved[1, i], slopes[1, i], share, off * share, y, cells)
            neighbour, to_neighbour = _next_to(strips, s, place, low, high)
            _add_line(
                solved[2, i],
                solved[2, neighbour - low],
                share * (1.0 - to_neighbour),
                share * to_neighbour,
                rate,
                cells,
            )
        # The part of a strip beyond the solved ones has the tractions and work of the
        # rest.
        per_share, limit = 1.0 / covered, bound / covered
        if bound > 0.0:
            for c in range(cells):
                t_x, t_y, most = per_share * x[c], per_share * y[c], limit * root[c]
                size = np.sqrt(t_x * t_x + t_y * t_y)
                scale = largest * most / (size if size > most else most)
                t_x, t_y = scale * t_x, scale * t_y
                square = t_x * t_x + t_y * t_y
                against = (
                    -largest * per_share * rate[c] / (square if square > 0.0 else 1.0)
                )
                x[c], y[c] = t_x, t_y
                slip_x[c], slip_y[c] = against * t_x, against * t_y
        else:
            middle = 0.5 * (patches.x_lead[m, j] + patches.x_trail[m, j])
            sliding = covered * _slide_freely(
                strips,
                p,
                q,
                lower,
                upper,
                middle,
                half,
                x[:cells],
                y[:cells],
                slip_x,
                slip_y,
            )
        area += 2.0 * half * width * per_share * sliding
        if out.shape[2] > 0:
            for c in range(cells):
                out[0, m, c, j], out[1, m, c, j], out[2, m, c, j] = (
                    largest * root[c],
                    x[c],
                    y[c],
                )
                out[3, m, c, j], out[4, m, c, j] = slip_x[c], slip_y[c]
        f_x, f_y, moment, length = 0.0, 0.0, 0.0, 2.0 * half / cells
        for c in range(cells):
            f_x, f_y, moment = f_x + x[c], f_y + y[c], moment + (c + 0.5) * y[c]
        force[m, 0] += f_x * length * width
        force[m, 1] += f_y * length * width
        turning = patches.x_lead[m, j] * f_y - length * moment - patches.y[m, j] * f_x
        force[m, 2] += turning * length * width
    slip_area[m] = area


@inner_bare_kernel
def _slide_freely(
    strips: WheelStrips,
    p: int,
    q: int,
    lower: float,
    upper: float,
    middle: float,
    half: float,
    x: FloatArray,
    y: FloatArray,
    slip_x: FloatArray,
    slip_y: FloatArray,
) -> float:
    """Fill the cells of a frictionless strip with the rigid slip.

    Return the share of them that slides.
    """
    along, across, spin, covered, slide = 0.0, 0.0, 0.0, 0.0, 0
    for s in range(p, q):
        share, _ = _part(strips, s, lower, upper, q - p == 1)
        turning = strips.creepage[s, 2]
        covered += share
        along += share * (
            strips.creepage[s, 0]
            - turning * (0.5 * (lower + upper) - strips.station[s])
        )
        across += share * strips.creepage[s, 1]
        spin += share * turning
    for c in range(x.size):
        place = middle + half * (1.0 - (2.0 * c + 1.0) / x.size)
        x[c], y[c] = 0.0, 0.0
        slip_x[c], slip_y[c] = along / covered, (across + spin * place) / covered
        slide += slip_x[c] != 0.0 or slip_y[c] != 0.0
    return float(slide / x.size)


@inner_bare_kernel
def _add_line(
    first: FloatArray,
    second: FloatArray,
    of_first: float,
    of_second: float,
    out: FloatArray,
    cells: int,
) -> None:
    """Add two lines of cells times factors."""
    for c in range(cells):
        out[c] += of_first * first[c] + of_second * second[c]


@inner_bare_kernel
def _edges(
    strips: WheelStrips, patches: PatchCells, first: int, j: int
) -> tuple[float, float]:
    """Stations of the edges of strip j of the patch with this first solved strip."""
    m = strips.patch[first]
    middle, half = (
        strips.station[first] - strips.y[first] + patches.y[m, j],
        0.5 * patches.width[m],
    )
    return middle - half, middle + half


@inner_bare_kernel
def _overlapped(
    strips: WheelStrips, first: int, last: int, lower: float, upper: float
) -> tuple[int, int]:
    """Range of the solved strips of a patch that a patch strip overlaps.

    Without overlap it is the next solved strip.
    """
    sliver, p = _SLIVER * (upper - lower), first
    while p < last - 1 and strips.station[p] + 0.5 * strips.width[p] <= lower + sliver:
        p += 1
    q = p + 1
    while q < last and strips.station[q] - 0.5 * strips.width[q] < upper - sliver:
        q += 1
    return p, q


@inner_bare_kernel
def _part(
    strips: WheelStrips, s: int, lower: float, upper: float, alone: bool
) -> tuple[float, float]:
    """Share of a patch strip covered by solved strip s, all of it if `alone`.

    The middle of this part is also returned.
    """
    edge, further = (
        strips.station[s] - 0.5 * strips.width[s],
        strips.station[s] + 0.5 * strips.width[s],
    )
    left, right = max(lower, edge), min(upper, further)
    share = 1.0 if alone else max((right - left) / (upper - lower), 0.0)
    return share, min(max(0.5 * (left + right), edge), further)


@inner_bare_kernel
def _next_to(
    strips: WheelStrips, s: int, place: float, low: int, high: int
) -> tuple[int, float]:
    """Solved strip beside a position in strip s, if it touches.

    Its share is that of linear interpolation between centres.
    """
    off = place - strips.station[s]
    if off > 0.0 and s + 1 < high and _touch(strips, s):
        return s + 1, off / (strips.station[s + 1] - strips.station[s])
    if off < 0.0 and s > low and _touch(strips, s - 1):
        return s - 1, off / (strips.station[s - 1] - strips.station[s])
    return s, 0.0


@inner_bare_kernel
def _means_along(
    traction: FloatArray, scale: float, means: FloatArray, out: FloatArray
) -> None:
    """Fill means of the cells of a strip, `scale` times its traction at the points."""
    for c in range(out.size):
        out[c] = 0.0
    for k in range(traction.size):
        value = scale * traction[k]
        for c in range(out.size):
            out[c] += means[k, c] * value


@inner_bare_kernel
def _slopes_across(
    values: FloatArray,
    strips: WheelStrips,
    low: int,
    high: int,
    cells: int,
    slopes: FloatArray,
) -> None:
    """Fill the slopes of tractions (2, N, nx) across solved strips.

    They keep means and create no extremes. Outermost strips, also those that touch no
    other, continue as their neighbours.
    """
    centre = strips.centre
    for s in range(low, high):
        left, right = (
            s > low and _touch(strips, s - 1),
            s < high - 1 and _touch(strips, s),
        )
        i, first, last = s - low, s - 1 if left else s, s + 1 if right else s
        per_length = 1.0 / (centre[last] - centre[first]) if last > first else 0.0
        per_left = 1.0 / (centre[s] - centre[first]) if left else 0.0
        per_right = 1.0 / (centre[last] - centre[s]) if right else 0.0
        for k in range(2):
            before, value, after = (
                values[k, first - low],
                values[k, i],
                values[k, last - low],
            )
            for c in range(cells):
                slope = (after[c] - before[c]) * per_length
                if left and right:
                    of_left, of_right = (
                        (value[c] - before[c]) * per_left,
                        (after[c] - value[c]) * per_right,
                    )
                    size = min(abs(slope), 2.0 * abs(of_left), 2.0 * abs(of_right))
                    slope = (
                        np.copysign(size, slope) if of_left * of_right > 0.0 else 0.0
                    )
                slopes[k, i, c] = slope


@inner_bare_kernel
def _cut_back_along(
    x: FloatArray, y: FloatArray, root: FloatArray, friction: float
) -> None:
    """Reduce tractions of cells above the friction bound.

    The excess is moved to the next cells with room. A polynomial oscillates about the
    bound between points that slip: to the trailing end, then back.
    """
    cells, more_x, more_y = x.size, 0.0, 0.0
    for step in range(2 * cells):
        if step == cells and more_x == 0.0 and more_y == 0.0:
            break
        c = step if step < cells else 2 * cells - 1 - step
        t_x, t_y, limit = x[c] + more_x, y[c] + more_y, friction * root[c]
        square, more_x, more_y = t_x * t_x + t_y * t_y, 0.0, 0.0
        if square > limit * limit:
            share = limit / np.sqrt(square)
            more_x, more_y = (1.0 - share) * t_x, (1.0 - share) * t_y
            t_x, t_y = share * t_x, share * t_y
        x[c], y[c] = t_x, t_y


@inner_bare_kernel
def _rates(
    between: FloatArray,
    traction: FloatArray,
    slip: FloatArray,
    marks: FloatArray,
    scale: float,
    friction: float,
    rate: FloatArray,
) -> float:
    """Fill the friction work over the largest pressure at the strain positions.

    Return the share that slips. Work is interpolated between two points that slip with
    the mean of their directions. At the trailing end there is slip also where all
    points stick: that of the singular strain, which dissipates the power of small
    creepages.
    """
    count, share, before = marks.size, 0.0, False
    for k in range(count):
        slides = marks[k] != STICK
        rate[k] = 0.0
        if slides:
            t_x, t_y = traction[0, k], traction[1, k]
            if before:
                t_x, t_y = t_x + traction[0, k - 1], t_y + traction[1, k - 1]
            size = np.sqrt(t_x * t_x + t_y * t_y)
            if size > 0.0:
                rate[k] = max(
                    -friction * (t_x * slip[0, k] + t_y * slip[1, k]) / size, 0.0
                )
            front, rear = (
                1.0 if k == 0 else between[k],
                -1.0 if k == count - 1 else between[k + 1],
            )
            share += 0.5 * (front - rear)
        before = slides
    last = (
        traction[0, count - 1] * slip[0, count]
        + traction[1, count - 1] * slip[1, count]
    )
    rate[count] = max(-scale * last, 0.0)
    return share


@inner_bare_kernel
def _work_along(
    between: FloatArray, rate: FloatArray, root: FloatArray, work: FloatArray
) -> None:
    """Fill the friction work of the cells of a strip; its sum is exact.

    The square of its rate is linear between positions. Near the onset of slip and at
    the trailing end it is extrapolated linearly.
    """
    count, cells, total, have = between.size, work.size, 0.0, 0.0
    for k in range(count):
        total += (1.0 - between[k] * between[k]) * rate[k] * (np.pi / count)
    if total <= 0.0:
        for c in range(cells):
            work[c] = 0.0
        return
    behind = 0
    for c in range(cells):
        place = 1.0 - (2.0 * c + 1.0) / cells
        while behind < count and between[behind] > place:
            behind += 1
        k = behind - 1
        if k < 0:
            square = rate[0] ** 2
        else:
            onset = k + 2 < count and rate[k] == 0.0 and rate[k + 2] > rate[k + 1] > 0.0
            k = k + 1 if onset else min(k, count - 2)
            slope = (rate[k + 1] ** 2 - rate[k] ** 2) / (between[k + 1] - between[k])
            square = rate[k] ** 2 + slope * (place - between[k])
        work[c] = root[c] * np.sqrt(max(square, 0.0))
        have += work[c] * 2.0 / cells
    for c in range(cells):
        work[c] *= total / have if have > 0.0 else 0.0
