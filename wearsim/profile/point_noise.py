r"""Noise of single points of a profile: rounding of a file, noise of an instrument.

Each point is compared with the cubic through its neighbours. What differs is noise;
with the distance of the points it changes the contact, however wide they are apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.profile.shape import FloatArray, Profile, arc_length, vertex_normals

USUAL_PRESSURE = 1e9
"""Largest contact pressure for which the effect of noise is stated without contact
[Pa]."""
MODULUS = 0.5 * 210e9 / (1.0 - 0.3**2)
"""Effective modulus E/(2 (1 - nu^2)) of steel on steel [Pa]."""
NOTABLE = 0.05
"""Change of the largest pressure from which noise is warned of [-]."""

_LEFT = 0.02  # RMS change of pressure that the named smoothing leaves [-]
_STEP, _LONGEST = 0.5e-3, 10e-3  # of the wavelengths that are named [m]
_SHORTEST = 0.25e-3  # point distance below which noise acts no more on pressures [m]
_NEIGHBOURS = (-2, -1, 1, 2)
_FEWEST = 9  # points of which the noise is estimated
_NORMAL = 1.4826  # standard deviation of normal noise over its median magnitude
_TREAD = (-26e-3, 30e-3)  # y of the running surface of a wheel [m]
_HEAD = 25e-3  # half the width of the running surface of a rail [m]
# integral of u^2 / (1 + u^4)^2: power of the slope that `smoothing.smoothed` leaves
_SLOPE = np.pi / (8.0 * np.sqrt(2.0))


class PointNoise(NamedTuple):
    """White noise of points along a profile.

    Parameters
    ----------
    height : float
        RMS along the normal [m].
    typical : float
        Standard deviation of normal noise of the same median magnitude: jumps of the
        curvature of the shape do not count [m].
    spacing : float
        Distance of the points [m].
    """

    height: float
    typical: float
    spacing: float

    @property
    def slope(self) -> float:
        r"""RMS slope of typical noise [-].

        White noise has the power :math:`s^2 d/\pi` per wavenumber q up to
        :math:`\pi/d`, and the mean square slope :math:`s^2 \pi^2/(3 d^2)`.
        """
        shortest = max(self.spacing, _SHORTEST)
        power = self.typical**2 * self.spacing / np.pi
        return float(np.sqrt(power * (np.pi / shortest) ** 3 / 3.0))

    def share(self, modulus: float, pressure: float) -> float:
        r"""RMS change of pressure over the largest pressure [-].

        It is :math:`E^*/2` times the RMS slope, as of
        `scene.initial_contact.noise_faults`; `modulus` and `pressure` in Pa.
        """
        return 0.5 * modulus * self.slope / pressure

    def curing_wavelength(self, modulus: float, pressure: float) -> float:
        r"""Wavelength of `smoothing.smoothed` that leaves 2 % RMS of a pressure [m].

        In steps of 0.5 mm, at most 10 mm. See `left`.
        """
        slope = _LEFT * 2.0 * pressure / modulus
        needed = 2.0 * np.pi * (_SLOPE * self._power / slope**2) ** (1.0 / 3.0)
        return float(min(_STEP * np.ceil(needed / _STEP), _LONGEST))

    def left(self, modulus: float, pressure: float, wavelength: float) -> float:
        r"""RMS change of pressure over the largest pressure that smoothing leaves [-].

        `smoothing.smoothed` leaves the mean square slope
        :math:`0.278 (2\pi/\Lambda)^3 s^2 d/\pi`; `wavelength` in m.
        """
        slope = np.sqrt(_SLOPE * self._power * (2.0 * np.pi / wavelength) ** 3)
        return float(0.5 * modulus * slope / pressure)

    @property
    def _power(self) -> float:
        """Power per wavenumber of all of the noise [m3]."""
        return self.height**2 * self.spacing / np.pi

    @property
    def words(self) -> str:
        """Describe the noise."""
        return (
            f"noise of {1e6 * self.height:.2g} um rms in points "
            f"{1e3 * self.spacing:.2g} mm apart (rounding included)"
        )


def point_noise(
    profile: Profile, where: NDArray[np.bool_] | None = None
) -> PointNoise | None:
    """Noise of the points of a profile, None of too few points.

    Parameters
    ----------
    profile : Profile
        Measured points at any distances, none repeated.
    where : (n,) bool array, optional
        Points that count, by default all.
    """
    count = profile.y.size
    inner = np.arange(2, count - 2)
    if where is not None:
        inner = inner[where[2:-2]]
    if inner.size < _FEWEST:
        return None
    residual = _residuals(profile, inner)
    arc = arc_length(profile.y, profile.z)
    spacing = float(np.median(np.diff(arc)[inner]))
    rms = float(np.sqrt(np.mean(residual**2)))
    return PointNoise(rms, _NORMAL * float(np.median(np.abs(residual))), spacing)


def noise_note(profile: Profile) -> str:
    """Note on noise that would change contact pressures by more than 5 % RMS.

    "" if there is none. It is that of the running surface, at a pressure of 1 GPa.
    """
    y = profile.y
    if profile.kind == "wheel":
        where = (y > _TREAD[0]) & (y < _TREAD[1])
    else:
        where = np.abs(y - y[int(np.argmin(profile.z))]) < _HEAD
    noise = point_noise(profile, where)
    if noise is None or noise.share(MODULUS, USUAL_PRESSURE) <= NOTABLE:
        return ""
    share = 100.0 * noise.share(MODULUS, USUAL_PRESSURE)
    cure = noise.curing_wavelength(MODULUS, USUAL_PRESSURE)
    left = noise.left(MODULUS, USUAL_PRESSURE, cure)
    return (
        f"{noise.words} changes contact pressures of 1 GPa by {share:.2g} % (rms); "
        f"smoothing with a wavelength of {1e3 * cure:g} mm leaves about "
        f"{100.0 * left:.2g} %"
    )


def _residuals(profile: Profile, rows: NDArray[np.intp]) -> FloatArray:
    """Distance of points from the cubic through four neighbours, as of one point [m].

    Along the normal, over the factor by which the noise of all five points counts.
    """
    arc, points = (
        arc_length(profile.y, profile.z),
        np.vstack((profile.y, profile.z)),
    )
    at = np.stack([arc[rows + k] for k in _NEIGHBOURS]) - arc[rows]
    weights = np.stack(
        [
            np.prod([at[j] / (at[j] - at[k]) for j in range(4) if j != k], axis=0)
            for k in range(4)
        ]
    )
    around = np.stack([points[:, rows + k] for k in _NEIGHBOURS])
    off = points[:, rows] - np.einsum("kn,kcn->cn", weights, around)
    normal = np.stack(vertex_normals(profile.y, profile.z))[:, rows]
    factor = np.sqrt(1.0 + (weights**2).sum(axis=0))
    result: FloatArray = (off * normal).sum(axis=0) / factor
    return result
