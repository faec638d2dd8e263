"""Strips to be solved, of the wheels of a batch.

Patches lie in one plane, or their strips in planes of their own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.kernel import bare_kernel, kernel, plain
from wearsim.contact.patch import FloatArray, IntArray, Patch
from wearsim.contact.tangential.model import StripMotion

_PER_STRIP = 3.2  # largest number of the patch's strips in one solved strip
_SHORTEST = 1e-6  # half-length over width of a strip below which it carries no load


class WheelStrips(NamedTuple):
    """Strips in contact of the wheels of a batch, by wheel and rising station.

    Parameters
    ----------
    begin : (w + 1,) int array
        First strip of each wheel, and the number of all.
    patch, number : (S,) int array
        Patch of each strip, and its number among the strips of that patch.
    station, y, centre : (S,) array
        Position of the middle across the rolling direction: from one origin for a
        wheel, and from the centre of the patch; position of the strip's load, from the
        origin of the stations [m].
    width, half : (S,) array
        Width and half-length [m].
    middle, along : (S,) array
        Longitudinal position of the middle: from the patch's centre, and from an origin
        of the wheel [m].
    peak, angle, friction : (S,) array
        Factor of the root in p = peak sqrt(1 - t^2) [Pa]; contact angle [rad]; Coulomb
        coefficient [-].
    creepage : (S, 3) array
        Longitudinal and lateral creepage at the strip's middle line and the patch's
        centre; spin [-, -, 1/m].
    turned : (m,) array
        Contact angle of each patch: direction of the sum of its strips' normal
        forces [rad].
    """

    begin: IntArray
    patch: IntArray
    number: IntArray
    station: FloatArray
    y: FloatArray
    centre: FloatArray
    width: FloatArray
    half: FloatArray
    middle: FloatArray
    along: FloatArray
    peak: FloatArray
    angle: FloatArray
    friction: FloatArray
    creepage: FloatArray
    turned: FloatArray


class SolvedStrips(NamedTuple):
    """Equal strips of m patches in one plane.

    Strips without contact, and padding, have no pressure.

    Parameters
    ----------
    width : (m,) array
        [m].
    y, half, middle, peak : (m, N) array
        Lateral position, half length, longitudinal position of the middle [m], and
        factor of the root in p = peak sqrt(1 - t^2) [Pa].
    centre : (m, N) array
        Lateral position of the load [m].
    """

    width: FloatArray
    y: FloatArray
    half: FloatArray
    middle: FloatArray
    peak: FloatArray
    centre: FloatArray


def strips_of_wheels(
    patch: Patch,
    creepage: FloatArray,
    friction: FloatArray,
    motion: StripMotion | None,
    fewest: int,
) -> WheelStrips:
    """Gather the strips in contact of the wheels of a batch.

    Parameters
    ----------
    patch : Patch
        m patches; without planes each is a wheel of its own.
    creepage, friction : (m, 3), (m,) array
        Of the patches [-, -, 1/m], [-].
    motion : StripMotion, optional
        Of the strips of patches with planes.
    fewest : int
        As of `solved_strips`, of patches without planes.

    Returns
    -------
    WheelStrips
        Strips without load or length are left out, and with them wheels that have no
        others.
    """
    if patch.planes is None or motion is None:
        strips = solved_strips(patch, fewest)
        wheel, station, y, centre, half = (
            np.arange(len(creepage)),
            strips.y,
            strips.y,
            strips.centre,
            strips.half,
        )
        middle, along, peak, angle = (
            strips.middle,
            strips.middle,
            strips.peak,
            np.zeros_like(strips.y),
        )
        width = np.broadcast_to(strips.width[:, None], y.shape)
        coefficient = np.broadcast_to(friction[:, None], y.shape)
        of_strips = np.repeat(creepage[:, None], y.shape[1], axis=1)
        of_strips[:, :, 0] -= creepage[:, 2, None] * y
        turned = np.zeros(len(creepage))
    else:
        planes, (wheel, of_strips, coefficient, x) = patch.planes, motion
        station, width, half, middle = (
            planes.station,
            planes.width,
            planes.half,
            planes.middle,
        )
        peak, angle, centre = planes.peak, planes.angle, station
        along = middle if x is None else middle + x[:, None]
        normal, y = planes.normal_force, planes.offset
        turned = np.arctan2(
            (normal * np.sin(angle)).sum(axis=1), (normal * np.cos(angle)).sum(axis=1)
        )
    carries = (peak > 0.0) & (width > 0.0) & (half > _SHORTEST * width)
    at, number = np.nonzero(carries)
    order = np.lexsort((station[carries], wheel[at]))
    at, number = at[order], number[order]
    index = at, number
    end = np.searchsorted(wheel[at], np.unique(wheel[at]), side="right")
    return WheelStrips(
        np.concatenate(([0], end)),
        at,
        number,
        station[index],
        y[index],
        centre[index],
        width[index],
        half[index],
        middle[index],
        along[index],
        peak[index],
        angle[index],
        coefficient[index],
        of_strips[index],
        turned,
    )


def sums_of_strips(strips: WheelStrips, force: FloatArray) -> FloatArray:
    """Sum the forces of strips in planes of their own by patch, for reports.

    Parameters
    ----------
    strips : WheelStrips
        Strips of m patches.
    force : (m, N, 3) array
        Force along and across each strip [N, N], and moment about its normal, about the
        point in its middle at the patch's centre [N m].

    Returns
    -------
    (m, 3) array
        Lateral forces and moments turned into the patch's plane, about the patch's
        centre [N, N, N m].
    """
    of_strips = force[strips.patch, strips.number]
    share = np.cos(strips.angle - strips.turned[strips.patch])
    parts = of_strips * np.stack((np.ones_like(share), share, share), axis=1)
    parts[:, 2] -= strips.y * of_strips[:, 0]
    sums = np.zeros((len(force), 3))
    np.add.at(sums, strips.patch, parts)
    return sums


def solved_strips(patch: Patch, fewest: int) -> SolvedStrips:
    """Combine neighbouring strips of patches.

    Load, middle and variance of the pressure are kept.

    Parameters
    ----------
    patch : Patch
        m patches.
    fewest : int
        Strips that are solved in a patch, unless it has fewer; more in patches of many
        strips.

    Returns
    -------
    SolvedStrips
        A semi-ellipse of half length a has the variance a^2 / 4. Similar patches have
        similar strips.
    """
    count, most = patch.y.shape[0], _solved(patch.y.shape[1], fewest)
    y, half, middle, peak, centre = np.zeros((5, count, most))
    strips = SolvedStrips(np.empty(count), y, half, middle, peak, centre)
    _put_together(
        plain(patch.y),
        plain(patch.width),
        plain(patch.x_lead),
        plain(patch.x_trail),
        plain(patch.pressure_slope),
        plain(patch.strips, np.int64),
        fewest,
        strips,
    )
    return strips


@kernel
def _solved(count: int, fewest: int) -> int:
    """Count the solved strips for a number of strips of the patch."""
    return int(min(count, max(fewest, int(np.ceil(count / _PER_STRIP)))))


@bare_kernel
def _put_together(
    y: FloatArray,
    width: FloatArray,
    x_lead: FloatArray,
    x_trail: FloatArray,
    slope: FloatArray,
    strip_count: IntArray,
    fewest: int,
    strips: SolvedStrips,
) -> None:
    """Fill the strips of all patches."""
    for m in range(y.shape[0]):
        first, last = 0, strip_count[m]
        while (
            first < last - 1
            and slope[m, first] * (x_lead[m, first] - x_trail[m, first]) <= 0.0
        ):
            first += 1
        while (
            last > first + 1
            and slope[m, last - 1] * (x_lead[m, last - 1] - x_trail[m, last - 1]) <= 0.0
        ):
            last -= 1
        count = _solved(last - first, fewest)
        ratio = (last - first) / count
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
            if load > 0.0:
                middle = moment / load
                strips.middle[m, i] = middle
                strips.half[m, i] = 2.0 * np.sqrt(
                    max(square / load - middle * middle, 1e-18)
                )
                strips.peak[m, i] = load / (ratio * strips.half[m, i])
                strips.centre[m, i] = y[m, first] + width[m] * (lateral / load - 0.5)
