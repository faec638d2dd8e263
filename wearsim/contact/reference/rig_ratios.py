r"""What a roller changes against the rail, in closed form: ratios rig / field at the same state of the wheel.

:math:`\chi = r_0/s_0 = r_0 \kappa` is the ratio of the radii of wheel and roller, 0 on a rail. The
longitudinal gap curvature grows by :math:`1 + \chi`, the lateral one stays. Elliptic contacts (Hertz): on
the profiles in use the ellipse is the assumption that fails, most of all in flat, two-lobed contacts.

References
----------
.. [1] A. Keylin, M. Ahmadian, ASME Rail Transportation Division Fall Technical Conference 2012.
.. [2] B. Liu, S. Bruni, Urban Rail Transit 1 (2016) 215-226.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.hertzian import axis_ratio, hertz
from wearsim.contact.reference.validation import alike, finite, number, positive, within
from wearsim.contact.tangential.kalker import coefficients
from wearsim.errors import ContactError


@dataclass(frozen=True)
class NormalRatios:
    """Ratios rig / field of the contact ellipse at the same normal force [-].

    Parameters
    ----------
    semi_axis_x, semi_axis_y : array
        Of length and width.
    area, max_pressure, approach : array
        Area and pressure are reciprocal.
    """

    semi_axis_x: FloatArray
    semi_axis_y: FloatArray
    area: FloatArray
    max_pressure: FloatArray
    approach: FloatArray


@dataclass(frozen=True)
class StiffnessRatios:
    """Ratios rig / field of the creep stiffnesses of Kalker's linear theory [-].

    Parameters
    ----------
    longitudinal, lateral : array
        Of G ab C11 and G ab C22.
    spin : array
        Of G (ab)^(3/2) C23, lateral force by spin and moment by lateral creepage.
    """

    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray


def normal_ratios(
    longitudinal_curvature: ArrayLike, lateral_curvature: ArrayLike, radius_ratio: ArrayLike
) -> NormalRatios:
    r"""Contact ellipse on a roller against that on the rail, at the same normal force.

    Parameters
    ----------
    longitudinal_curvature, lateral_curvature : array
        A and B of the gap on the rail [1/m]; only A/B matters.
    radius_ratio : array
        :math:`\chi = r_0/s_0` [-].

    Returns
    -------
    NormalRatios
        Two solutions of Hertz; independent of load and material.

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.
    """
    along, across, chi = alike(
        longitudinal_curvature=positive("longitudinal curvature A", longitudinal_curvature, "1/m"),
        lateral_curvature=positive("lateral curvature B", lateral_curvature, "1/m"),
        radius_ratio=_radius_ratio(radius_ratio),
    )
    field = hertz(along, across, 1.0, 1.0)
    rig = hertz(along * (1.0 + chi), across, 1.0, 1.0)
    names = [each.name for each in fields(NormalRatios)]
    return NormalRatios(*(getattr(rig, name) / getattr(field, name) for name in names))


def normal_exponents(curvature_ratio: ArrayLike) -> NormalRatios:
    """Logarithmic derivatives of the contact ellipse by the longitudinal curvature.

    Parameters
    ----------
    curvature_ratio : array
        A/B [-].

    Returns
    -------
    NormalRatios
        d ln a / d ln A and so on [-]: near a large roller every ratio is (1 + chi) to this power.

    Raises
    ------
    ContactError
        If a ratio is not positive and finite.

    Notes
    -----
    Central differences of :func:`hertz` over 1e-4 in ln A: right to 1e-9.
    """
    ratio, step = positive("curvature ratio A/B", curvature_ratio, "-"), 1e-4
    change = normal_ratios(ratio * np.exp(-0.5 * step), 1.0, np.expm1(step))
    return NormalRatios(*(np.log(value) / step for value in vars(change).values()))


def spin_ratio(radius_ratio: ArrayLike, roll_share: ArrayLike = 0.0) -> FloatArray:
    r"""Spin on a roller against that on the rail.

    Parameters
    ----------
    radius_ratio : array
        :math:`\chi = r_0/s_0` [-].
    roll_share : array
        :math:`\phi/\delta`, roll of the wheelset over the contact angle to its axle; on a right wheel
        positive where the roll lowers that wheel [-].

    Returns
    -------
    array
        :math:`1 + \chi (1 - \phi/\delta)`, small angles, no yaw [-].

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.
    """
    chi, share = alike(
        radius_ratio=_radius_ratio(radius_ratio),
        roll_over_contact_angle=finite("roll over contact angle", roll_share, "-"),
    )
    return 1.0 + chi * (1.0 - share)


def longitudinal_creepage_ratio(
    radius_difference: ArrayLike, depth: ArrayLike, wheel_radius: ArrayLike, curvature: ArrayLike
) -> FloatArray:
    r"""Longitudinal creepage on a roller against that on the rail, at the rotation speed V/r0, without yaw.

    Parameters
    ----------
    radius_difference : array
        :math:`\Delta r = r - r_0` of the wheel at the contact [m].
    depth : array
        z of the contact below the top of the counterface's profile, :math:`-\Delta s` [m].
    wheel_radius : array
        :math:`r_0` [m].
    curvature : array
        :math:`\kappa = 1/s_0` of the roller [1/m].

    Returns
    -------
    array
        :math:`1 + \kappa z r_0 / \Delta r` [-].

    Raises
    ------
    ContactError
        If the radius difference is zero (there is no creepage on the rail then), another argument is outside
        its domain, or shapes do not fit together.
    """
    difference, z, radius, kappa = alike(
        radius_difference=finite("radius difference", radius_difference, "m"),
        depth=finite("depth", depth, "m"),
        wheel_radius=positive("wheel radius", wheel_radius, "m"),
        curvature=_curvature(curvature),
    )
    if (difference == 0.0).any():
        raise ContactError("radius difference = 0 m: no longitudinal creepage on the rail to compare with")
    return 1.0 + kappa * z * radius / difference


def creep_stiffness_ratios(
    curvature_ratio: ArrayLike, radius_ratio: ArrayLike, poisson_ratio: float
) -> StiffnessRatios:
    r"""Creep stiffness on a roller against that on the rail, at the same normal force.

    Parameters
    ----------
    curvature_ratio : array
        A/B on the rail [-].
    radius_ratio : array
        :math:`\chi = r_0/s_0` [-].
    poisson_ratio : float
        Of both bodies [-].

    Returns
    -------
    StiffnessRatios
        Area ratio (to the power 3/2 for spin) times that of Kalker's coefficients at the two a/b.

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.
    """
    ratio, chi = alike(
        curvature_ratio=positive("curvature ratio A/B", curvature_ratio, "-"),
        radius_ratio=_radius_ratio(radius_ratio),
    )
    area = normal_ratios(ratio, 1.0, chi).area
    poisson = number("Poisson's ratio", within("Poisson's ratio", poisson_ratio, "-", 0.0, 0.5))
    field, rig = (
        coefficients(np.ravel(axis_ratio(value)), poisson)[:3].reshape(3, *ratio.shape)
        for value in (ratio, ratio * (1.0 + chi))
    )
    c11, c22, c23 = rig / field
    return StiffnessRatios(area * c11, area * c22, area**1.5 * c23)


def load_ratio_for_equal_pressure(pressure_ratio: ArrayLike) -> FloatArray:
    """Load on the rig over that in the field that gives the field's contact pressure.

    Parameters
    ----------
    pressure_ratio : array
        `max_pressure` of :func:`normal_ratios`, at the same load [-].

    Returns
    -------
    array
        Its power -3; the area falls further then: one load cannot restore both [-].

    Raises
    ------
    ContactError
        If a ratio is not positive and finite.
    """
    return positive("pressure ratio", pressure_ratio, "-") ** -3.0


def load_ratio_for_equal_area(area_ratio: ArrayLike) -> FloatArray:
    """Load on the rig over that in the field that gives the field's contact area.

    Parameters
    ----------
    area_ratio : array
        `area` of :func:`normal_ratios`, at the same load [-].

    Returns
    -------
    array
        Its power -3/2; the pressure rises further then [-].

    Raises
    ------
    ContactError
        If a ratio is not positive and finite.
    """
    return positive("area ratio", area_ratio, "-") ** -1.5


def _radius_ratio(value: ArrayLike) -> FloatArray:
    return within("radius ratio r0/s0", value, "-", 0.0, np.inf)


def _curvature(value: ArrayLike) -> FloatArray:
    return within("roller curvature 1/s0", value, "1/m", 0.0, np.inf)
