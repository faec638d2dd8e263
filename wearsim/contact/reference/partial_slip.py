"""Friction in contacts of simple shape: rolling cylinders (Carter).

Both bodies have the same elastic constants, x is the rolling direction, creepage is (wheel - counterface)/V
and tractions and forces are those on the wheel: they oppose the creepage.

References
----------
.. [1] F. W. Carter, Proc. R. Soc. Lond. A 112 (1926) 151-157.
.. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731, chapter 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.validation import alike, finite, positive


@dataclass(frozen=True)
class RollingCylinders:
    """Carter's solution for line contacts in steady rolling.

    Parameters
    ----------
    half_length : array
        Half the length of the contact along the rolling direction [m].
    stick_half_length : array
        Half the length of the stick zone; it begins at the leading edge [m].
    saturation : array
        Creepage at which all slips [-].
    creepage : array
        Longitudinal creepage [-].
    limit : array
        Friction coefficient times the pressure in the middle [Pa].
    """

    half_length: FloatArray
    stick_half_length: FloatArray
    saturation: FloatArray
    creepage: FloatArray
    limit: FloatArray

    @property
    def force_per_width(self) -> FloatArray:
        """Longitudinal force on the wheel per width [N/m]."""
        full = 0.5 * np.pi * self.half_length * self.limit
        share = 1.0 - (self.stick_half_length / self.half_length) ** 2
        return -np.sign(self.creepage) * full * share

    def traction(self, x: ArrayLike) -> FloatArray:
        """Longitudinal traction on the wheel [Pa] at finite distances [m] from the middle."""
        place, a, c = alike(
            x=finite("x", x, "m"), half_length=self.half_length, stick_half_length=self.stick_half_length
        )
        full = np.sqrt(np.maximum(a**2 - place**2, 0.0))
        held = np.sqrt(np.maximum(c**2 - (place - (a - c)) ** 2, 0.0))
        value: FloatArray = -np.sign(self.creepage) * self.limit * (full - held) / a
        return value

    def slip(self, x: ArrayLike) -> FloatArray:
        """Slip velocity over V [-] at finite distances [m] from the middle within the contact."""
        place, a, c = alike(
            x=finite("x", x, "m"), half_length=self.half_length, stick_half_length=self.stick_half_length
        )
        behind = np.maximum(a - c - place, 0.0)
        beyond = np.maximum(np.abs(self.creepage) / self.saturation - 1.0, 0.0)
        local = np.sqrt(np.maximum(behind**2 - c**2, 0.0)) / a
        return np.sign(self.creepage) * self.saturation * (local + beyond)


def carter(
    creepage: ArrayLike,
    half_length: ArrayLike,
    max_pressure: ArrayLike,
    friction: ArrayLike,
    effective_modulus: ArrayLike,
) -> RollingCylinders:
    r"""Tractive rolling of parallel cylinders.

    Parameters
    ----------
    creepage : array
        Longitudinal creepage [-].
    half_length, max_pressure : array
        Of the line contact [m], [Pa], as from :func:`line_hertz`.
    friction : array
        Coulomb coefficient [-].
    effective_modulus : array
        E* = E / (2 (1 - nu^2)) of two equal bodies [Pa].

    Returns
    -------
    RollingCylinders
        Force, stick zone, traction and slip.

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.

    Notes
    -----
    [1]_, [2]_ section 8.3, with the saturation creepage :math:`\xi_s = 2 \mu p_0 / E^* = \mu a / R` and
    :math:`c/a = 1 - |\xi|/\xi_s`: :math:`F = -\mathrm{sgn}(\xi)\, \mu P' (1 - c^2/a^2)`. For small creepage
    this is the limit a/b to 0 of Kalker's linear theory, :math:`C_{11} = \pi^2 / (4 (1 - \nu))`.

    References
    ----------
    .. [1] F. W. Carter, Proc. R. Soc. Lond. A 112 (1926) 151-157.
    .. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731.
    """
    xi, half, pressure, mu, modulus = alike(
        creepage=finite("creepage", creepage, "-"),
        half_length=positive("half length", half_length, "m"),
        pressure=positive("pressure", max_pressure, "Pa"),
        friction_coefficient=positive("friction coefficient", friction, "-"),
        effective_modulus=positive("effective modulus E*", effective_modulus, "Pa"),
    )
    limit = mu * pressure
    saturation = 2.0 * limit / modulus
    stick = half * np.maximum(1.0 - np.abs(xi) / saturation, 0.0)
    return RollingCylinders(half, stick, saturation, xi, limit)
