"""Strips that are solved: those of a patch, neighbours put together where it has more."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel, kernel, plain
from wearsim.contact.patch import FloatArray, IntArray, Patch

_PER_STRIP = 3.2  # of the patch's own, at most


class SolvedStrips(NamedTuple):
    """Strips of m patches that are solved; what lies behind `solved` of them is padding.

    Parameters
    ----------
    first, loaded : (m,) int array
        First strip of the patch in contact, and number of strips from it to the last one in contact.
    solved : (m,) int array
        N, number of solved strips.
    width : (m,) array
        [m].
    y, half, middle, peak : (m, N) array
        Lateral position, half length, longitudinal position of the middle [m], and factor of the root in
        p = peak sqrt(1 - t^2), zero in strips without contact [Pa].
    centre : (m, N) array
        Lateral position of the load [m].
    """

    first: IntArray
    loaded: IntArray
    solved: IntArray
    width: FloatArray
    y: FloatArray
    half: FloatArray
    middle: FloatArray
    peak: FloatArray
    centre: FloatArray


def solved_strips(patch: Patch, fewest: int) -> SolvedStrips:
    """Put neighbouring strips of patches together, keeping load, middle and variance of the pressure.

    Parameters
    ----------
    patch : Patch
        m patches.
    fewest : int
        Strips that are solved in a patch, unless it has fewer; more in patches of many strips.

    Returns
    -------
    SolvedStrips
        Equal strips; a semi-ellipse of half length a has the variance a^2 / 4. Similar patches have similar
        strips.
    """
    count, most = patch.y.shape[0], _solved(patch.y.shape[1], fewest)
    first, loaded, solved = np.empty((3, count), dtype=np.int64)
    y, half, middle, peak, centre = np.zeros((5, count, most))
    strips = SolvedStrips(first, loaded, solved, np.empty(count), y, half, middle, peak, centre)
    _put_together(
        plain(patch.y), plain(patch.width), plain(patch.x_lead), plain(patch.x_trail),
        plain(patch.pressure_slope), plain(patch.strips, np.int64), fewest, strips,
    )  # fmt: skip
    return strips


@kernel
def _solved(count: int, fewest: int) -> int:
    """Count the strips that are solved, of a number of the patch's own."""
    return int(min(count, max(fewest, int(np.ceil(count / _PER_STRIP)))))


@bare_kernel
def _put_together(
    y: FloatArray, width: FloatArray, x_lead: FloatArray, x_trail: FloatArray, slope: FloatArray,
    strip_count: IntArray, fewest: int, strips: SolvedStrips,
) -> None:  # fmt: skip
    """Fill the strips of all patches."""
    for m in range(y.shape[0]):
        first, last = 0, strip_count[m]
        while first < last - 1 and slope[m, first] * (x_lead[m, first] - x_trail[m, first]) <= 0.0:
            first += 1
        while last > first + 1 and slope[m, last - 1] * (x_lead[m, last - 1] - x_trail[m, last - 1]) <= 0.0:
            last -= 1
        count = _solved(last - first, fewest)
        ratio = (last - first) / count
        strips.first[m], strips.loaded[m], strips.solved[m] = first, last - first, count
        strips.width[m] = width[m] * ratio
        for i in range(count):
            strips.y[m, i] = y[m, first] + width[m] * (ratio * (i + 0.5) - 0.5)
            low, high = i * ratio, (i + 1) * ratio
            load, moment, square, lateral = 0.0, 0.0, 0.0, 0.0
            for j in range(int(low), last - first):
                share = min(high, j + 1.0) - max(low, float(j))
                if share < 1e-9:
                    continue
                half = 0.5 * (x_lead[m, first + j] - x_trail[m, first + j])
                middle = 0.5 * (x_lead[m, first + j] + x_trail[m, first + j])
                part = share * slope[m, first + j] * half * half
                load, moment = load + part, moment + part * middle
                square += part * (0.25 * half * half + middle * middle)
                lateral += part * 0.5 * (max(low, float(j)) + min(high, j + 1.0))
            # Without contact, any length: nothing acts there.
            strips.half[m, i], strips.middle[m, i], strips.peak[m, i] = strips.width[m], 0.0, 0.0
            if load > 0.0:
                middle = moment / load
                strips.middle[m, i] = middle
                strips.half[m, i] = 2.0 * np.sqrt(max(square / load - middle * middle, 1e-18))
                strips.peak[m, i] = load / (ratio * strips.half[m, i])
                strips.centre[m, i] = y[m, first] + width[m] * (lateral / load - 0.5)


@inner_bare_kernel
def parts_of(j: int, loaded: int, count: int) -> tuple[int, float, float, float]:
    """Solved strip of the first part of strip j in contact, its share; where the middles of both parts are.

    Those are in widths of a strip from its middle; the other part is in the next solved strip.
    """
    ratio = loaded / count
    i = min(int(j / ratio), count - 1)
    share = min((i + 1) * ratio - j, 1.0)
    if share < 1e-9:
        return i + 1, 1.0, 0.0, 0.0
    if share > 1.0 - 1e-9 or i == count - 1:
        return i, 1.0, 0.0, 0.0
    return i, share, 0.5 * (share - 1.0), 0.5 * share


@inner_bare_kernel
def neighbours(j: int, loaded: int, count: int, peak: FloatArray) -> tuple[int, float]:
    """Solved strip whose middle is left of that of strip j in contact, and the share of the next one.

    Strips without contact have no share.
    """
    place = min(max((j + 0.5) * count / loaded - 0.5, 0.0), count - 1.0)
    left = min(int(place), max(count - 2, 0))
    if left + 1 == count or peak[left + 1] <= 0.0:
        return left, 0.0
    return left, 1.0 if peak[left] <= 0.0 else place - left
