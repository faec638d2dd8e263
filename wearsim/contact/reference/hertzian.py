r"""Hertz: elliptic contacts from two principal curvatures, and line contacts.

The gap is :math:`A x^2 + B y^2`, x along the rolling direction, y across. Bodies are elastic half-spaces
without friction; :math:`1/E^* = (1-\nu_1^2)/E_1 + (1-\nu_2^2)/E_2`, for equal bodies
:math:`E^* = E / (2 (1-\nu^2))`. Nothing here depends on the signs of axes.

References
----------
.. [1] H. Hertz, J. reine angew. Math. 92 (1882) 156-171, doi:10.1515/crll.1882.92.156.
.. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731, chapter 4.
.. [3] NIST Digital Library of Mathematical Functions, section 19.25 (elliptic integrals by Carlson's).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprd, elliprf

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.validation import alike, finite, positive

_NEWTON_STEPS = 5  # 3 reach rounding for A/B = 1e-8 .. 1e8


@dataclass(frozen=True)
class EllipticContact:
    """Contact ellipses and their semi-ellipsoidal pressure.

    Parameters
    ----------
    semi_axis_x, semi_axis_y : array
        a along the rolling direction and b across [m].
    approach : array
        Of points far from the contact [m].
    max_pressure : array
        In the middle [Pa].
    """

    semi_axis_x: FloatArray
    semi_axis_y: FloatArray
    approach: FloatArray
    max_pressure: FloatArray

    @property
    def area(self) -> FloatArray:
        """Of the ellipse [m2]."""
        return np.pi * self.semi_axis_x * self.semi_axis_y

    def pressure(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Pressure at points, zero outside the ellipse.

        Parameters
        ----------
        x, y : array
            From the middle [m]; they broadcast with the semi-axes: for many points on each of m ellipses
            give them a leading axis.

        Returns
        -------
        array
            [Pa].

        Raises
        ------
        ContactError
            If a point is not finite, or its shape does not fit that of the ellipses.
        """
        at_x, at_y, a, b = alike(
            x=finite("x", x, "m"), y=finite("y", y, "m"),
            semi_axis_a=self.semi_axis_x, semi_axis_b=self.semi_axis_y,
        )  # fmt: skip
        place = (at_x / a) ** 2 + (at_y / b) ** 2
        return self.max_pressure * np.sqrt(np.maximum(1.0 - place, 0.0))


def axis_ratio(curvature_ratio: ArrayLike) -> FloatArray:
    r"""Ratio a/b of the semi-axes of contact ellipses.

    Parameters
    ----------
    curvature_ratio : array
        A/B, any positive number [-].

    Returns
    -------
    array
        a/b [-]; error below 1e-14 in its logarithm for A/B = 1e-8 to 1e8.

    Raises
    ------
    ContactError
        If a ratio is not positive and finite.

    Notes
    -----
    With :math:`\kappa` the minor over the major axis, the larger over the smaller curvature is
    :math:`(E/\kappa^2 - K)/(K - E) = R_D(0, 1, \kappa^2) / R_D(0, \kappa^2, 1)`; Carlson's integrals lose no
    digits near the circle. Newton's method in logarithms, where the slope lies between -2 (long ellipses)
    and -3/2 (circle). Every entry goes through the same steps whatever its neighbours.
    """
    ratio = positive("curvature ratio A/B", curvature_ratio, "-")
    target = np.abs(np.log(ratio))
    log_minor = -target / 1.5
    for _ in range(_NEWTON_STEPS):
        square = np.exp(2.0 * log_minor)
        along, across = elliprd(0.0, square, 1.0), elliprd(0.0, 1.0, square)
        log_minor = log_minor - (np.log(across / along) - target) / _slope(square, along, across)
    return np.exp(np.sign(np.log(ratio)) * log_minor)


def _slope(square: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Return the derivative of the logarithm of the curvature ratio by that of minor/major axis."""
    parameter = 1.0 - square
    round_off = parameter < 1e-6  # so near the circle the difference below is lost, and -3/2 is exact enough
    first = elliprf(0.0, square, 1.0)
    second = first - parameter * along / 3.0
    rise = second / along - first / across
    slope = -2.0 + 3.0 * rise / np.where(round_off, 1.0, parameter)
    return np.clip(np.where(round_off, -1.5, slope), -2.0, -1.5)


def hertz(
    longitudinal_curvature: ArrayLike,
    lateral_curvature: ArrayLike,
    force: ArrayLike,
    effective_modulus: ArrayLike,
) -> EllipticContact:
    r"""Contact ellipse, approach and pressure.

    Parameters
    ----------
    longitudinal_curvature, lateral_curvature : array
        A and B of the gap :math:`A x^2 + B y^2` [1/m]: half the sum of the curvatures of the two bodies, so
        that A = 1/(2 r) for a wheel on a rail and (1/r + 1/s)/2 for one on a roller.
    force : array
        Normal force [N].
    effective_modulus : array
        E* [Pa].

    Returns
    -------
    EllipticContact
        Of the shape that the arguments broadcast to.

    Raises
    ------
    ContactError
        If an argument is not positive and finite, or shapes do not fit together.

    Notes
    -----
    [2]_: major axis :math:`= (3 N (K-E) / (2\pi E^* e^2 \min(A, B)))^{1/3}`,
    :math:`p_0 = 3N/(2\pi a b)`, :math:`\delta = p_0 K(e) \min(a, b) / E^*`. The approach also equals
    :math:`A a^2 + B b^2`.
    """
    hint = ": a contact ellipse needs surfaces that part in both directions"
    a_gap, b_gap, load, modulus = alike(
        longitudinal_curvature=positive("longitudinal curvature A", longitudinal_curvature, "1/m", hint),
        lateral_curvature=positive("lateral curvature B", lateral_curvature, "1/m", hint),
        normal_force=positive("normal force", force, "N"),
        effective_modulus=positive("effective modulus E*", effective_modulus, "Pa"),
    )
    ratio = axis_ratio(a_gap / b_gap)
    lengthwise = ratio >= 1.0
    minor = np.where(lengthwise, 1.0 / ratio, ratio)  # of minor to major axis
    major = np.cbrt(load * elliprd(0.0, minor**2, 1.0) / (2.0 * np.pi * modulus * np.minimum(a_gap, b_gap)))
    pressure = 1.5 * load / (np.pi * minor * major**2)
    return EllipticContact(
        semi_axis_x=np.where(lengthwise, major, minor * major),
        semi_axis_y=np.where(lengthwise, minor * major, major),
        approach=pressure * minor * major * elliprf(0.0, minor**2, 1.0) / modulus,
        max_pressure=pressure,
    )


@dataclass(frozen=True)
class LineContact:
    """Line contacts and their semi-elliptic pressure.

    Parameters
    ----------
    half_length : array
        Half the length along the rolling direction [m].
    max_pressure : array
        In the middle [Pa].
    """

    half_length: FloatArray
    max_pressure: FloatArray

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Pressure at distances from the middle, zero outside.

        Parameters
        ----------
        x : array
            [m]; broadcasts with the contacts.

        Returns
        -------
        array
            [Pa].

        Raises
        ------
        ContactError
            If a distance is not finite, or its shape does not fit that of the contacts.
        """
        at, half = alike(x=finite("x", x, "m"), half_length=self.half_length)
        place = (at / half) ** 2
        return self.max_pressure * np.sqrt(np.maximum(1.0 - place, 0.0))


def line_hertz(
    longitudinal_curvature: ArrayLike, force_per_width: ArrayLike, effective_modulus: ArrayLike
) -> LineContact:
    r"""Contact of two parallel cylinders.

    Parameters
    ----------
    longitudinal_curvature : array
        A of the gap :math:`A x^2`: (1/r + 1/s)/2 [1/m].
    force_per_width : array
        Normal force per width P' [N/m].
    effective_modulus : array
        E* [Pa].

    Returns
    -------
    LineContact
        Without an approach: that of a line contact has no limit far away.

    Raises
    ------
    ContactError
        If an argument is not positive and finite, or shapes do not fit together.

    Notes
    -----
    [2]_ (4.43)-(4.45): :math:`a^2 = 2 P' / (\pi E^* A)`, :math:`p_0 = 2 P' / (\pi a)`.
    """
    curvature, load, modulus = alike(
        longitudinal_curvature=positive("longitudinal curvature A", longitudinal_curvature, "1/m"),
        normal_force_per_width=positive("normal force per width", force_per_width, "N/m"),
        effective_modulus=positive("effective modulus E*", effective_modulus, "Pa"),
    )
    half = np.sqrt(2.0 * load / (np.pi * modulus * curvature))
    return LineContact(half, 2.0 * load / (np.pi * half))
