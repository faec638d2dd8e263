r"""How a strip with semi-elliptic pressure moves the surface under itself and under other strips.

A strip of half-length a carries :math:`p = p_0\sqrt{1-(x/a)^2}` along the rolling direction x, uniform
across a width. From its own line out to the distance Y a the displacement at X a along x is
:math:`p_0 a F(X, Y) / (\pi E^*)` with

.. math:: F(X, Y) = \int_{-1}^{1} \sqrt{1-t^2}\; \mathrm{arsinh}\frac{Y}{|X-t|}\,dt,

and a strip's displacement is the difference of F between its two edges. A strip of half-length a_i that is
moved averages it with the weights :math:`\sqrt{1-t^2}` and :math:`t^2/\sqrt{1-t^2}`, t = x/a_i: the
averages N and M depend on two numbers, a_i/a and Y, and are tabulated in their logarithms.

Which of two strips moves the other is the same for N, and M of one is :math:`\partial (a_i N)/\partial a_i`:
one table for the shorter strip over the longer one holds both, and the derivatives of N.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from wearsim.contact.kernel import bare_kernel, inner_bare_kernel
from wearsim.contact.normal.knothe_le_the.strips import Record, Work, influence_share
from wearsim.contact.patch import FloatArray

# Table over ln(shorter/longer) and ln(Y): start and steps per unit. Linear interpolation in these steps is
# off by less than 1e-4 of F; beyond the table it goes on as the straight line F is there.
RATIO_START, RATIO_STEPS, _RATIOS = -5.0, 24.0, 120
DISTANCE_START, DISTANCE_STEPS, _DISTANCES = -9.0, 40.0, 640

_NODES = 48  # of the averages over half a strip; a short strip's field has a kink at its end


def _along_strip(place: FloatArray, distance: FloatArray) -> FloatArray:
    """F at places X >= 0 (n,) and distances Y > 0 (k,), by tanh-sinh quadrature on each side of X."""
    step = np.linspace(-3.2, 3.2, 60)
    stretch = 0.5 * np.pi * np.sinh(step)
    near = 1.0 / (1.0 + np.exp(2.0 * stretch))  # share of the piece from its end, to full precision
    far = near[::-1]
    weight = (step[1] - step[0]) * 0.25 * np.pi * np.cosh(step) / np.cosh(stretch) ** 2
    total = np.zeros((place.size, distance.size))
    for k, x in enumerate(place):
        split = min(x, 1.0)
        for first, length in ((-1.0, 1.0 + split), (split, 1.0 - split)):
            to_left = first + 1.0 + length * near
            to_right = 1.0 - first - length + length * far
            away = x - first - length + length * far if first < split else length * near
            bell = length * weight * np.sqrt(to_left * to_right)
            with np.errstate(divide="ignore"):
                total[k] += np.arcsinh(distance[:, None] / np.maximum(away, 1e-300)) @ bell
    return total


@lru_cache(maxsize=1)
def influence_table() -> FloatArray:
    """Averages of F of the longer of two strips: table over ln(shorter/longer) and ln(Y).

    Returns
    -------
    (ratios, distances, 3) array
        N, M of the shorter strip, M of the longer one; for the kernels that call `averages`; made once per
        process, in about half a second.
    """
    # F over arsinh(Y / sqrt(1 + X^2)) is a smooth function of X/(1 + X) and ln(Y).
    share = np.linspace(0.0, 0.6, 90)
    log_distance = np.linspace(DISTANCE_START, DISTANCE_START + _DISTANCES / DISTANCE_STEPS, 140)
    place, distance = share / (1.0 - share), np.exp(log_distance)
    scale = np.arcsinh(distance / np.sqrt(1.0 + place[:, None] ** 2))
    smooth = RectBivariateSpline(share, log_distance, _along_strip(place, distance) / scale)
    ratio = np.exp(RATIO_START + np.arange(_RATIOS + 1) / RATIO_STEPS)
    log_distance = DISTANCE_START + np.arange(_DISTANCES + 1) / DISTANCE_STEPS
    distance = np.exp(log_distance)
    node = np.sin(0.5 * np.pi * (np.arange(_NODES) + 0.5) / _NODES)  # Gauss-Chebyshev
    table = np.zeros((ratio.size, distance.size, 3))
    for t in node:
        first, other = 2.0 * (1.0 - t * t) / _NODES, 2.0 * t * t / _NODES
        x = t * ratio
        reach = np.sqrt(1.0 + x[:, None] ** 2)
        scale, rise = np.arcsinh(distance / reach), distance / np.sqrt(reach**2 + distance**2)
        shape = smooth(x / (1.0 + x), log_distance)
        values = shape * scale
        table[:, :, 0] += first * values
        table[:, :, 1] += other * values
        # By ln Y, of which a longer strip sees less.
        table[:, :, 2] -= first * (smooth(x / (1.0 + x), log_distance, dy=1) * scale + shape * rise)
    table[:, :, 2] += 2.0 * table[:, :, 0] - table[:, :, 1]
    return table


@bare_kernel
def averages(
    table: FloatArray, ratio: float, distance: float
) -> tuple[float, float, float, float, float, float]:
    """N, M of the shorter and M of the longer strip at ln(shorter/longer) and ln(Y), and slopes.

    Those of M of the shorter by its own length, of M of the longer by either's: derivatives by the logarithms
    of the half-lengths, the distance being given.
    """
    x, y = (ratio - RATIO_START) * RATIO_STEPS, (distance - DISTANCE_START) * DISTANCE_STEPS
    i = min(max(int(x), 0), table.shape[0] - 2)
    j = min(max(int(y), 0), table.shape[1] - 2)
    x, y = max(x - i, 0.0), y - j
    low, high = table[i, j], table[i + 1, j]
    low_next, high_next = table[i, j + 1], table[i + 1, j + 1]
    across = low_next[2] - low[2]
    across += x * (high_next[2] - high[2] - across)
    a, d = low[0] + y * (low_next[0] - low[0]), high[0] + y * (high_next[0] - high[0])
    b, e = low[1] + y * (low_next[1] - low[1]), high[1] + y * (high_next[1] - high[1])
    c, f = low[2] + y * (low_next[2] - low[2]), high[2] + y * (high_next[2] - high[2])
    by_short = RATIO_STEPS * (f - c)
    by_long = -by_short - DISTANCE_STEPS * across
    return a + x * (d - a), b + x * (e - b), c + x * (f - c), RATIO_STEPS * (e - b), by_short, by_long


@bare_kernel
def in_the_middle(table: FloatArray, distance: float) -> float:
    """F in the middle of a strip, X = 0, at ln(Y): what a strip without length sees."""
    y = (distance - DISTANCE_START) * DISTANCE_STEPS
    j = min(max(int(y), 0), table.shape[1] - 2)
    value: float = table[0, j, 0] + (y - j) * (table[0, j + 1, 0] - table[0, j, 0])
    return value


@inner_bare_kernel
def bow_of(x_squared: float, strip: Record) -> float:
    """Gap that wheel and counterface open at a distance from where they are nearest: two circles, to x^4."""
    rise: float = x_squared * (strip.bend + strip.bend_more * x_squared)
    return rise


@inner_bare_kernel
def pair_up(work: Work, total: int) -> None:
    """Distances of strips from each other over the first one's width, and the shares of their influence."""
    strips, nearer, farther, part, steps = work.strips, work.nearer, work.farther, work.part, work.steps
    state = work.states[0]
    state.log_width = np.log(strips[0].width)
    if strips[total - 1].part != strips[0].part:
        state.alone = 0
    elif state.alone >= total:  # as in any other part alone with so many
        return
    else:
        state.alone = total
    for i in range(total):
        one = strips[i]
        wider = np.log(one.width) - state.log_width
        for k in range(total):
            other = strips[k]
            if one.part == other.part:
                # Strips of one part are alike: those of a patch alone have the same numbers at any width.
                away = abs(i - k)
                nearer[i, k], farther[i, k], part[i, k] = steps[away] + wider, steps[away + 1] + wider, 1.0
            elif one.part < other.part:
                across, down = one.y - other.y, one.z - other.z
                distance = np.sqrt(across * across + down * down)
                half = 0.25 * (one.width + other.width)
                share = influence_share(one.angle - other.angle, distance) * 0.5 / half
                nearer[i, k] = nearer[k, i] = np.log(max(distance - half, 0.1 * half)) - state.log_width
                farther[i, k] = farther[k, i] = np.log(distance + half) - state.log_width
                part[i, k], part[k, i] = share * other.width, share * one.width


@inner_bare_kernel
def inner_of(work: Work, m: int, row: int) -> int:
    """Row of the one neighbour of a strip at the rim, or -1."""
    active, strips = work.active, work.strips
    i = active[row]
    before = row > 0 and active[row - 1] == i - 1 and strips[i - 1].part == strips[i].part
    after = row + 1 < m and active[row + 1] == i + 1 and strips[i + 1].part == strips[i].part
    if before == after:
        return -1
    return row - 1 if before else row + 1


@inner_bare_kernel
def share_of_neighbour(load: float, inside: float) -> float:
    """Share in which a strip at the rim takes its ratio P/q from its neighbour: none if it carries more."""
    share: float = min(max((_ALIKE - load / inside) / (_ALIKE - _UNLIKE), 0.0), 1.0)
    return share


_UNLIKE, _ALIKE = 0.6, 0.9  # load of a strip at the rim over its neighbour's, from which on it is on its own
UNKNOWN = 1e9  # logarithm of a half-length about which nothing is expanded


@inner_bare_kernel
def expand(work: Work, table: FloatArray, total: int) -> None:
    """Averages on strips per load of each, with derivatives by logarithms of half-lengths, about `base`.

    M - N of a strip is the derivative of N by the logarithm of its own half-length. Those of strips that
    changed by more than is `nearby`, or had none before.
    """
    logs, base, terms, changed, nothing = work.logs, work.base, work.terms, work.sums[1], True
    for i in range(total):
        changed[i] = 0.0
        if abs(logs[i] - base[i]) > work.states[0].nearby:
            changed[i], base[i] = 1.0, logs[i]
            nothing = False
    if nothing:
        return
    for i in range(total):
        if changed[i] > 0.0:
            a, b, _, _, b_own, b_other = averages(table, 0.0, work.farther[i, i] - base[i])
            bend = b_own + b_other - 2.0 * (b - a)
            terms[0, i, i] = 2.0 * a
            terms[1, i, i] = terms[2, i, i] = 2.0 * (b - a)
            terms[3, i, i] = terms[4, i, i] = terms[5, i, i] = bend
        for j in range(i + 1, total):
            if changed[i] + changed[j] == 0.0:
                continue
            short, long = (i, j) if base[i] < base[j] else (j, i)
            log = base[long]
            ratio = base[short] - log
            a, b, c, b_short, c_short, c_long = averages(table, ratio, work.farther[i, j] - log)
            d, e, f, e_short, f_short, f_long = averages(table, ratio, work.nearer[i, j] - log)
            a, b, c = a - d, b - e, c - f
            b, c = b - a, c - a
            b_short, c_long, both = b_short - e_short - b, c_long - f_long - c, c_short - f_short - b
            share, back = work.part[short, long], work.part[long, short]
            terms[1, long, short], terms[1, short, long] = share * b, back * c
            terms[3, long, short], terms[3, short, long] = share * b_short, back * c_long
            terms[4, long, short], terms[4, short, long] = share * both, back * both
            if short < long:
                share, b, c, b_short, c_long = back, c, b, c_long, b_short
            terms[0, i, j], terms[2, i, j], terms[5, i, j] = share * a, share * c, share * c_long


@inner_bare_kernel
def influences(work: Work, total: int) -> None:
    """Averages N, and what M is above them, on strips per load of each, from what `expand` made nearby.

    N on and above the diagonal: `mean_on` has the others.
    """
    terms, moved = work.terms, work.sums[0][:total]
    for k in range(total):
        moved[k] = work.logs[k] - work.base[k]
    for j in range(total):
        above, by_own = work.above[j, :total], terms[1, j, :total]
        bend, both = terms[3, j, :total], terms[4, j, :total]
        mean, value, own, other = work.mean[j, j:total], terms[0, j, j:total], moved[j:total], moved[j]
        by_other, other_bend = terms[2, j, j:total], terms[5, j, j:total]
        # In two loops, because the compiler uses vector instructions only for few arrays.
        for k in range(above.size):
            above[k] = by_own[k] + bend[k] * moved[k] + both[k] * other
        by_own, bend, both = by_own[j:], bend[j:], both[j:]
        for k in range(mean.size):
            first = by_own[k] + 0.5 * bend[k] * own[k] + both[k] * other
            mean[k] = value[k] + first * own[k] + (by_other[k] + 0.5 * other_bend[k] * other) * other


@inner_bare_kernel
def mean_on(work: Work, i: int, j: int) -> float:
    """Average N on strip i per load of strip j: forces on forces are symmetric, loads are per width."""
    value: float = (
        work.mean[j, i] if j <= i else work.mean[i, j] * work.strips[j].width / work.strips[i].width
    )
    return value
