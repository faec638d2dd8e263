"""Noise of measured profiles: a low-pass along arc length that keeps the shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wearsim.errors import ProfileError
from wearsim.profile.shape import (
    FloatArray,
    Profile,
    arc_length,
    corners,
    vertex_lengths,
    vertex_normals,
)

ROUGH_BELOW = 2e-3
"""Wavelength below which the content of a measured profile is roughness [m].

A contact patch is wider.
"""

_MM = 1e-3
_PASSES = (
    2  # the second pass uses arc length along the smoothed shape, free of the noise
)
# Wavelengths at an end over which its curvature is fitted; a rail's side is not much
# longer.
_FIT = 0.8
_FADE = 4.0  # wavelengths over which the end curvature fades out
# Length on either side of a corner over which its angle is measured [m]: 20 degrees on
# 3 mm radius.
_EITHER_SIDE = 1e-3
_EITHER_SIDE_POINTS = 4
_CORNER = np.radians(20.0)
# Integrals over u = q Lambda/(2 pi) of the transfer function T = 1/(1 + u^4): of
# (T(u/2) - T(u))^2, which is what an octave passes, and of u^2 T^2 = pi/(8 sqrt 2).
_OCTAVE = 0.42578
_SLOPE = np.pi / (8.0 * np.sqrt(2.0))


def smoothing_spline(
    arc: FloatArray, values: FloatArray, length: FloatArray, wavelength: float
) -> FloatArray:
    r"""Cubic smoothing spline through values over arc length.

    Parameters
    ----------
    arc : (..., n) array
        Arc length at the points, strictly rising, n at least 3 [m].
    values : (..., m, n) array
        Rows to be smoothed, each on its own.
    length : (..., n) array
        Length that each point represents [m].
    wavelength : float
        Wavelength whose amplitude is halved, above 0 [m].

    Returns
    -------
    (..., m, n) array
        Smoothed rows, at the points.

    Notes
    -----
    Minimises :math:`\int (d - s)^2\,du + \lambda \int
    s''^2\,du`, transfer function :math:`1/(1 + \lambda q^4)`, so :math:`\lambda =
    (\Lambda/2\pi)^4` halves the amplitude at wavelength :math:`\Lambda`. The natural
    spline has knots at all points; it is computed from its second derivatives, one
    symmetric pentadiagonal system for all [1]_, in millimetres for its condition.

    References
    ----------
    .. [1] C. H. Reinsch, Smoothing by spline functions, Numer. Math. 10 (1967) 177-183,
       doi:10.1007/BF02162161.
    """
    from scipy.linalg import solveh_banded  # slow import, only when it is needed

    penalty = (wavelength / _MM / (2.0 * np.pi)) ** 4
    gap = (arc[..., 1:] - arc[..., :-1]) / _MM
    weight = length / _MM
    # Second-difference operator: column j of Q holds (low, mid, high) in rows j, j+1,
    # j+2.
    low, high = 1.0 / gap[..., :-1], 1.0 / gap[..., 1:]
    mid = -low - high
    inverse = penalty / weight
    # Upper form for solveh_banded: bands[2] is the diagonal; profiles are not coupled.
    bands = np.zeros((3, *low.shape))
    bands[2] = (gap[..., :-1] + gap[..., 1:]) / 3.0
    bands[2] += (
        low**2 * inverse[..., :-2]
        + mid**2 * inverse[..., 1:-1]
        + high**2 * inverse[..., 2:]
    )
    bands[1, ..., 1:] = gap[..., 1:-1] / 6.0
    bands[1, ..., 1:] += (
        mid[..., :-1] * low[..., 1:] * inverse[..., 1:-2]
        + high[..., :-1] * mid[..., 1:] * inverse[..., 2:-1]
    )
    bands[0, ..., 2:] = high[..., :-2] * low[..., 2:] * inverse[..., 2:-2]

    low, mid, high, inverse = (
        coefficient[..., None, :] for coefficient in (low, mid, high, inverse)
    )
    second = low * values[..., :-2] + mid * values[..., 1:-1] + high * values[..., 2:]
    by_point = np.moveaxis(second, -2, -1)
    right = by_point.reshape(-1, by_point.shape[-1])
    curvature = solveh_banded(bands.reshape(3, -1), right, check_finite=False)
    curvature = np.moveaxis(curvature.reshape(by_point.shape), -1, -2)
    pull = np.zeros_like(values)
    pull[..., :-2] += low * curvature
    pull[..., 1:-1] += mid * curvature
    pull[..., 2:] += high * curvature
    return values - inverse * pull


def smoothed(profile: Profile, wavelength: float) -> Profile:
    r"""Profile without its noise of short wavelength.

    Parameters
    ----------
    profile : Profile
        Measured points at any distances, none repeated.
    wavelength : float
        Wavelength along the profile of which half the amplitude is left [m]; 0 returns
        the profile.

    Returns
    -------
    Profile
        As many points in the same order. Corners of more than 20 degrees and both ends
        stay what they are: corners keep their place exactly, and nothing is smoothed
        across them.

    Raises
    ------
    ProfileError
        The wavelength is above a fifth of the length.

    Notes
    -----
    The spline filter of [1]_ with free ends, of y and of z over arc length: waves of
    length L are left with :math:`1/(1 + (\Lambda/L)^4)` of their amplitude, 6 % at half
    the wavelength :math:`\Lambda`, 94 % at twice. Straight lines pass unchanged, and
    arcs of radius R but for :math:`3 (\Lambda/2\pi)^4/R^3`; the Gaussian filter of the
    same wavelength would flatten an arc of 12 mm by 13 um at 3 mm. The free ends would
    straighten the last stretch, so its curvature is taken off before and put back
    after.

    References
    ----------
    .. [1] ISO 16610-22, Geometrical product specifications: linear profile filters,
           spline filters.
    """
    if wavelength == 0.0:
        return profile
    s = arc_length(profile.y, profile.z)
    if wavelength > longest_wavelength(profile):
        raise ProfileError(
            f"{profile.name}: noise wavelength = {1e3 * wavelength:g} mm must be below "
            f"a fifth of the profile's length of {1e3 * s[-1]:.4g} mm"
        )
    points = np.vstack((profile.y, profile.z))
    result = points.copy()
    ends = [0, *_corners(points, s), len(s) - 1]
    for first, last in pairwise(ends):
        if last - first < 3:
            continue
        part = points[:, first : last + 1]
        new = part
        for _ in range(_PASSES):
            new = _piece(
                part,
                arc_length(new[0], new[1]),
                vertex_lengths(new[0], new[1]),
                wavelength,
            )
        # A corner belongs to both pieces and is not moved.
        inner = slice(
            0 if first == 0 else 1,
            new.shape[1] if last == len(s) - 1 else new.shape[1] - 1,
        )
        result[:, first : last + 1][:, inner] = new[:, inner]
    return replace(
        profile, y=np.ascontiguousarray(result[0]), z=np.ascontiguousarray(result[1])
    )


def longest_wavelength(profile: Profile) -> float:
    """Largest wavelength that `smoothed` accepts for a profile [m]."""
    return 0.2 * float(arc_length(profile.y, profile.z)[-1])


def change(before: Profile, after: Profile) -> FloatArray:
    """Return the distance (n,) along the normal from one profile to another [m].

    Both profiles have the same number of points.
    """
    normal_y, normal_z = vertex_normals(after.y, after.z)
    return (after.y - before.y) * normal_y + (after.z - before.z) * normal_z


@dataclass(frozen=True)
class Roughness:
    """Roughness of a profile: its content of wavelengths below `ROUGH_BELOW`.

    Parameters
    ----------
    height : (n,) array
        Along the normal, at the points [m].
    slope : (n,) array
        Of the height over arc length, from each point to the next; of the last one as
        of that before [-].
    octave : (n,) array
        Of the height what has wavelengths of half to the whole of `ROUGH_BELOW` [m].
    """

    height: FloatArray
    slope: FloatArray
    octave: FloatArray

    def wavelength(self, where: NDArray[np.bool_], slope: float) -> float:
        r"""Wavelength of `smoothed` that leaves slopes of a given RMS [m].

        Notes
        -----
        Power S per wavenumber as that of the octave at the points `where`, alike for
        all longer waves (white noise): :math:`\int S q^2 T^2 dq =
        0.278\,S\,(2\pi/\Lambda)^3` with the transfer function T of `smoothed` is to be
        the square of `slope` [-].
        """
        power = float(np.mean(self.octave[where] ** 2)) / (
            _OCTAVE * 2.0 * np.pi / ROUGH_BELOW
        )
        return float(2.0 * np.pi * (_SLOPE * power / slope**2) ** (1.0 / 3.0))


def roughness(profile: Profile) -> Roughness:
    """Roughness of a profile.

    Raises `ProfileError` for a profile shorter than 10 mm, as `smoothed` does.
    """
    shape = smoothed(profile, ROUGH_BELOW)
    height = -change(profile, shape)
    slope = np.diff(height) / np.diff(arc_length(shape.y, shape.z))
    octave = height + change(profile, smoothed(profile, 0.5 * ROUGH_BELOW))
    return Roughness(height, np.append(slope, slope[-1]), octave)


def _corners(points: FloatArray, s: FloatArray) -> list[int]:
    """Corners, including those that noise or point spacing spreads over vertices."""
    clear = corners(points[0], points[1])
    low = np.searchsorted(s, s - _EITHER_SIDE, side="left")
    high = np.searchsorted(s, s + _EITHER_SIDE, side="right")
    index = np.arange(len(s))
    before, after = _lines(points, s, low, index + 1), _lines(points, s, index, high)
    turn = np.angle(
        np.exp(1j * (np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])))
    )
    enough = (index + 1 - low >= _EITHER_SIDE_POINTS) & (
        high - index >= _EITHER_SIDE_POINTS
    )
    size = np.where(enough, np.abs(turn), 0.0)
    places = list(clear)
    for j in np.argsort(-size, kind="stable"):
        if size[j] <= _CORNER:
            break
        if any(abs(s[j] - s[k]) < _EITHER_SIDE for k in places):
            continue
        near = slice(low[j], high[j])
        # The lines on both sides meet at the corner; the noise of its own vertex is
        # left out.
        dy, dz, y, z = np.column_stack((before[:, j], after[:, j]))
        meeting = np.linalg.lstsq(
            np.column_stack((-dz, dy)), dy * z - dz * y, rcond=None
        )[0]
        places.append(
            int(low[j] + np.argmin(np.hypot(*(points[:, near] - meeting[:, None]))))
        )
    return sorted(set(places))


def _lines(
    points: FloatArray, s: FloatArray, start: NDArray[np.intp], stop: NDArray[np.intp]
) -> FloatArray:
    """Fit straight lines to points start .. stop - 1.

    The result (4, n) has direction y, z and mean y, z.
    """

    def over(values: FloatArray) -> FloatArray:
        total = np.concatenate(([0.0], np.cumsum(values)))
        return total[stop] - total[start]

    count = (stop - start).astype(np.float64)
    mean_s = over(s) / count
    spread = np.maximum(over(s * s) - count * mean_s**2, np.finfo(np.float64).tiny)
    means = [over(values) / count for values in points]
    slopes = [
        (over(s * values) - count * mean_s * mean) / spread
        for values, mean in zip(points, means, strict=True)
    ]
    return np.array([*slopes, *means])


def _piece(
    part: FloatArray, s: FloatArray, length: FloatArray, wavelength: float
) -> FloatArray:
    """Smooth one piece without corners, (2, n) points over arc length."""
    base = (
        _end_bend(part, s, wavelength)
        + _end_bend(part[:, ::-1], s[-1] - s[::-1], wavelength)[:, ::-1]
    )
    return base + smoothing_spline(s, part - base, length, wavelength)


def _end_bend(part: FloatArray, s: FloatArray, wavelength: float) -> FloatArray:
    """Smooth function with the second derivative of the points at s = 0, fading out."""
    # Its second derivative is k (1 - u^2)^2, u = s over the fading length. It has zero
    # slope at the end, as the free end of the spline requires of the rest.
    near = s <= _FIT * wavelength
    if np.count_nonzero(near) < 5:
        return np.zeros_like(part)
    x = s[near] / s[near][-1]
    fit = np.linalg.lstsq(np.vander(x, 3), part[:, near].T, rcond=None)[0]
    bend = 2.0 * fit[0] / s[near][-1] ** 2
    fade = min(_FADE * wavelength, float(s[-1]))
    u = np.minimum(s / fade, 1.0)
    # Integrate twice from the far side, where value and slope vanish.
    slope = 8.0 / 15.0
    whole = (
        u**2 / 2.0
        - u**4 / 6.0
        + u**6 / 30.0
        - slope * u
        + (slope - 1.0 / 2.0 + 1.0 / 6.0 - 1.0 / 30.0)
    )
    result: FloatArray = bend[:, None] * fade**2 * whole
    return result
