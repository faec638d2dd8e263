"""Cells of a patch from the points along its solved strips, and first guesses of points from cells."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from wearsim.contact.kernel import inner_bare_kernel, kernel
from wearsim.contact.patch import FloatArray
from wearsim.contact.tangential.coupled_strips.influence import StripPoints, strip_points
from wearsim.contact.tangential.coupled_strips.strips import neighbours, parts_of
from wearsim.contact.tangential.semismooth_newton import STICK


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
        \frac{\sin(l+2)\theta}{l+2}]`; their sum over the points is the mean of :math:`\sqrt{1-t^2}`.
    """
    angle = np.arccos(1.0 - 2.0 * np.arange(cells + 1) / cells)
    order = np.arange(count)[:, None]
    whole = np.where(order > 0, np.sin(order * angle) / np.maximum(order, 1), angle)
    whole -= np.sin((order + 2) * angle) / (order + 2)
    return np.ascontiguousarray(strip_points(count).basis.T @ np.diff(whole, axis=1) * (0.25 * cells))


@kernel
def fill_cells(
    points: StripPoints, means: FloatArray, traction: FloatArray, slip: FloatArray, marks: FloatArray, peak:
    FloatArray, centre: FloatArray, shear_modulus: float, friction: float, first: int, loaded: int, y:
    FloatArray, x_lead: FloatArray, x_trail: FloatArray, slope: FloatArray, width: float, keep: bool, m: int,
    out: FloatArray, force: FloatArray,
) -> float:  # fmt: skip
    """Fill the cells of one patch and add up its forces.

    Parameters
    ----------
    points, means
        Of each strip, and `cell_means`.
    traction, slip, marks : (2, N, n), (2, N, n + 1), (N, n) arrays
        Tractions over the shear modulus, slip, and how points are marked.
    peak, centre : (N,) arrays
        Factor of the root in the pressure of each solved strip [Pa], and lateral position of its load [m].
    shear_modulus, friction : float
        [Pa], [-].
    first, loaded : int
        Of the patch's strips in contact.
    y, x_lead, x_trail, slope : (ny,) arrays
        Of the patch's strips.
    width : float
        Of the patch's strips [m].
    keep : bool
        Whether fields are wanted.
    m : int
        Number of the patch in the batch.
    out : (5, m, nx, ny) array
        Filled with pressure, traction and slip of patch m.
    force : (m, 3) array
        The sums over the cells are added to that of patch m.

    Returns
    -------
    float
        Area that slips [m2].
    """
    cells, count = means.shape[1], peak.size
    solved, slopes, sliding = np.zeros((3, count + 1, cells)), np.zeros((2, count, cells)), np.zeros(count)
    root, rate = np.zeros(cells), np.empty(points.between.size)
    for k in range(means.shape[0]):
        for c in range(cells):
            root[c] += means[k, c]
    for i in range(count):
        if peak[i] > 0.0:
            scale = shear_modulus / peak[i]
            for axis in range(2):
                _means_along(traction[axis, i], scale, means, solved[axis, i])
            _cut_back_along(solved[0, i], solved[1, i], root, friction)
            sliding[i] = _rates(points.between, traction[:, i], slip[:, i], marks[i], scale, friction, rate)
            _work_along(points.between, rate, root, solved[2, i])
    _slopes_across(solved, peak, centre, slopes)
    # Traction, pressure and slip of one strip; and of all by cells, so that memory is written in order.
    area, line, turned = 0.0, np.empty((5, cells)), np.empty((5, cells, loaded))
    for j in range(loaded):
        half = 0.5 * (x_lead[first + j] - x_trail[first + j])
        i, share, off, off_next = parts_of(j, loaded, count)
        other, rest, largest = min(i + 1, count - 1), 1.0 - share, slope[first + j] * half
        off += (y[first + j] - centre[i]) / width
        off_next += (y[first + j] - centre[other]) / width
        off, off_next = off * width, off_next * width
        for axis in range(2):
            for c in range(cells):
                line[axis, c] = share * (solved[axis, i, c] + off * slopes[axis, i, c])
            if rest > 0.0:
                for c in range(cells):
                    line[axis, c] += rest * (solved[axis, other, c] + off_next * slopes[axis, other, c])
        left, to_right = neighbours(j, loaded, count, peak)
        for c in range(cells):
            work = solved[2, left, c] + to_right * (solved[2, left + 1, c] - solved[2, left, c])
            limit, square = friction * root[c], line[0, c] * line[0, c] + line[1, c] * line[1, c]
            scale = largest * limit / np.sqrt(square) if square > limit * limit else largest
            line[0, c], line[1, c] = scale * line[0, c], scale * line[1, c]
            line[2, c] = largest * root[c]
            square = line[0, c] * line[0, c] + line[1, c] * line[1, c]
            against = -largest * work / square if square > 0.0 else 0.0
            line[3, c], line[4, c] = against * line[0, c], against * line[1, c]
        f_x, f_y, moment, length = 0.0, 0.0, 0.0, 2.0 * half / cells
        if keep:
            for k in range(5):
                for c in range(cells):
                    turned[k, c, j] = line[k, c]
        for c in range(cells):
            f_x, f_y, moment = f_x + line[0, c], f_y + line[1, c], moment + (c + 0.5) * line[1, c]
        area += 2.0 * half * width * (share * sliding[i] + rest * sliding[other])
        force[m, 0] += f_x * length * width
        force[m, 1] += f_y * length * width
        force[m, 2] += (x_lead[first + j] * f_y - length * moment - y[first + j] * f_x) * length * width
    if keep:
        for field, k in enumerate((2, 0, 1, 3, 4)):
            for c in range(cells):
                for j in range(loaded):
                    out[field, m, c, first + j] = turned[k, c, j]
    return area


@inner_bare_kernel
def _means_along(traction: FloatArray, scale: float, means: FloatArray, out: FloatArray) -> None:
    """Add the means of the cells of a strip, `scale` times its traction at the points."""
    for k in range(traction.size):
        value = scale * traction[k]
        for c in range(out.size):
            out[c] += means[k, c] * value


@inner_bare_kernel
def _slopes_across(values: FloatArray, peak: FloatArray, centre: FloatArray, slopes: FloatArray) -> None:
    """Fill the slopes of tractions (2, N, nx) across solved strips, that keep means and make no extremes.

    Outermost strips, also beside those without contact, go on as their neighbours.
    """
    count = peak.size
    for i in range(count):
        left, right = i > 0 and peak[i - 1] > 0.0, i < count - 1 and peak[i + 1] > 0.0
        if peak[i] <= 0.0 or not (left or right):
            continue
        first, last = i - 1 if left else i, i + 1 if right else i
        per_length = 1.0 / (centre[last] - centre[first])
        for k in range(2):
            for c in range(values.shape[2]):
                slope = (values[k, last, c] - values[k, first, c]) * per_length
                if left and right:
                    before = (values[k, i, c] - values[k, first, c]) / (centre[i] - centre[first])
                    after = (values[k, last, c] - values[k, i, c]) / (centre[last] - centre[i])
                    size = min(abs(slope), 2.0 * abs(before), 2.0 * abs(after))
                    slope = np.copysign(size, slope) if before * after > 0.0 else 0.0
                slopes[k, i, c] = slope


@inner_bare_kernel
def _cut_back_along(x: FloatArray, y: FloatArray, root: FloatArray, friction: float) -> None:
    """Shorten tractions of cells above the bound; what is cut goes to the next cells with room.

    A polynomial swings about the bound between points that slip: to the trailing end, then back.
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
    between: FloatArray, traction: FloatArray, slip: FloatArray, marks: FloatArray, scale: float, friction:
    float, rate: FloatArray,
) -> float:  # fmt: skip
    """Fill the work of friction over the largest pressure, where strains are computed; share that slips.

    Between two points that slip with the mean of their directions. At the trailing end there is slip also
    where all points stick: that of the singular strain, which takes the power of small creepages.
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
                rate[k] = max(-friction * (t_x * slip[0, k] + t_y * slip[1, k]) / size, 0.0)
            front, rear = 1.0 if k == 0 else between[k], -1.0 if k == count - 1 else between[k + 1]
            share += 0.5 * (front - rear)
        before = slides
    last = traction[0, count - 1] * slip[0, count] + traction[1, count - 1] * slip[1, count]
    rate[count] = max(-scale * last, 0.0)
    return share


@inner_bare_kernel
def _work_along(between: FloatArray, rate: FloatArray, root: FloatArray, work: FloatArray) -> None:
    """Fill the work of the cells of a strip, the square of its rate linear between places; the sum is exact.

    Near the onset of slip and at the trailing end it goes on in a straight line.
    """
    count, cells, total, have = between.size, work.size, 0.0, 0.0
    for k in range(count):
        total += (1.0 - between[k] * between[k]) * rate[k] * (np.pi / count)
    if total <= 0.0:
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


@kernel
def guess_from_cells(
    points: StripPoints, cells: FloatArray, m: int, rows: int, first: int, loaded: int, stiff: FloatArray,
    traction: FloatArray,
) -> None:  # fmt: skip
    """Fill tractions (2, N, n) from the cells (5, m, nx, ny) of a state nearby.

    Patch m has `rows` cells along each strip, and `stiff` (N,) is the factor of the pressure over the shear
    modulus.
    """
    count = traction.shape[1]
    for i in range(count):
        j = first + min(int((i + 0.5) * loaded / count), loaded - 1)
        for k in range(points.place.size):
            place = min(max(0.5 * (1.0 - points.place[k]) * rows - 0.5, 0.0), rows - 1.0)
            front = min(int(place), max(rows - 2, 0))
            rear = min(front + 1, rows - 1)
            for axis in range(2):
                value = 0.0
                for c, share in ((front, 1.0 - (place - front)), (rear, place - front)):
                    pressure = cells[0, m, c, j]
                    value += share * cells[1 + axis, m, c, j] / pressure if pressure > 0.0 else 0.0
                traction[axis, i, k] = value * stiff[i]
