r"""Friction in contacts of simple shape: rolling cylinders (Carter) and pressed bodies (Cattaneo, Mindlin).

Both bodies have the same elastic constants, x is the rolling direction, creepage is (wheel - counterface)/V
and tractions and forces are those on the wheel: they oppose the creepage.

References
----------
.. [1] F. W. Carter, Proc. R. Soc. Lond. A 112 (1926) 151-157.
.. [2] C. Cattaneo, Rend. Accad. Naz. Lincei 27 (1938) 342-348, 434-436, 474-478.
.. [3] R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268, doi:10.1115/1.4009973.
.. [4] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731, chapters 7 and 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprd, elliprf

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.validation import alike, finite, positive, within


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


@dataclass(frozen=True)
class TangentialLoading:
    """Solution of Cattaneo and Mindlin for contact ellipses that are pressed, then pushed sideways.

    Parameters
    ----------
    semi_axis_x, semi_axis_y : array
        Of the contact ellipse [m].
    stick_ratio : array
        Size of the stick ellipse over that of the contact [-].
    limit : array
        Friction coefficient times the pressure in the middle [Pa].
    direction : array
        Sign of the force [-].
    displacement : array
        Of the bodies relative to each other, far from the contact, along the force [m].
    """

    semi_axis_x: FloatArray
    semi_axis_y: FloatArray
    stick_ratio: FloatArray
    limit: FloatArray
    direction: FloatArray
    displacement: FloatArray

    def traction(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Traction along x [Pa] at points [m], zero outside the contact; arguments as for the pressure."""
        at_x, at_y, a, b = alike(
            x=finite("x", x, "m"), y=finite("y", y, "m"),
            semi_axis_a=self.semi_axis_x, semi_axis_b=self.semi_axis_y,
        )  # fmt: skip
        place = (at_x / a) ** 2 + (at_y / b) ** 2
        full = np.sqrt(np.maximum(1.0 - place, 0.0))
        held = np.sqrt(np.maximum(self.stick_ratio**2 - place, 0.0))
        value: FloatArray = self.direction * self.limit * (full - held)
        return value


def cattaneo_mindlin(
    tangential_force: ArrayLike,
    normal_force: ArrayLike,
    semi_axis_x: ArrayLike,
    semi_axis_y: ArrayLike,
    friction: ArrayLike,
    shear_modulus: ArrayLike,
    poisson_ratio: ArrayLike,
) -> TangentialLoading:
    r"""Partial slip of a contact ellipse under a force along x that rises from zero, without rolling.

    Parameters
    ----------
    tangential_force : array
        Q along x, magnitude up to the friction coefficient times the normal force [N]. For a force along y
        exchange the two axes.
    normal_force : array
        P [N].
    semi_axis_x, semi_axis_y : array
        Of the contact ellipse [m].
    friction : array
        Coulomb coefficient [-].
    shear_modulus, poisson_ratio : array
        G and nu of both bodies [Pa], [-].

    Returns
    -------
    TangentialLoading
        Signs follow Q.

    Raises
    ------
    ContactError
        If Q is more than friction carries, another argument is outside its domain, or shapes do not fit
        together.

    Notes
    -----
    [1]_ to [3]_: the stick ellipse is similar to the contact, :math:`k = (1 - |Q|/\mu P)^{1/3}`, the traction
    :math:`\mu p_0 [\sqrt{1-\rho^2} - \sqrt{k^2-\rho^2}]` with
    :math:`\rho^2 = x^2/a^2 + y^2/b^2`. The slight slip across the force is neglected, as usual. The
    displacement, from that of a semi-ellipsoid of traction in its middle, is
    :math:`\mu p_0 (1 - k^2) [(1-\nu) R_F(0, a^{-2}, b^{-2}) + \tfrac{\nu}{3 b^2} R_D(0, a^{-2}, b^{-2})] / G`
    with Carlson's integrals; on a circle :math:`3 \mu P (2-\nu) (1-k^2) / (8 a G)`, [3]_ section 7.2.

    References
    ----------
    .. [1] C. Cattaneo, Rend. Accad. Naz. Lincei 27 (1938) 342-348, 434-436, 474-478.
    .. [2] R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268, doi:10.1115/1.4009973.
    .. [3] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731.
    """
    push, load, a, b, mu, modulus, poisson = alike(
        tangential_force=finite("tangential force", tangential_force, "N"),
        normal_force=positive("normal force", normal_force, "N"),
        semi_axis_a=positive("semi-axis a", semi_axis_x, "m"),
        semi_axis_b=positive("semi-axis b", semi_axis_y, "m"),
        friction_coefficient=positive("friction coefficient", friction, "-"),
        shear_modulus=positive("shear modulus G", shear_modulus, "Pa"),
        poisson_ratio=within("Poisson's ratio", poisson_ratio, "-", 0.0, 0.5),
    )
    share = within("tangential force over friction times normal force", push / (mu * load), "-", -1.0, 1.0)
    limit = mu * 1.5 * load / (np.pi * a * b)
    stick = np.cbrt(1.0 - np.abs(share))
    compliance = (1.0 - poisson) * elliprf(0.0, a**-2.0, b**-2.0) + poisson / (3.0 * b**2) * elliprd(
        0.0, a**-2.0, b**-2.0
    )
    direction = np.sign(share)
    displacement = direction * limit * (1.0 - stick**2) * compliance / modulus
    return TangentialLoading(a, b, stick, limit, direction, displacement)
