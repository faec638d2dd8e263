r"""Creep forces of an elliptic contact in closed form: no slip, full slip, and simplified theory in between.

Axes of the contact frame: x rolling direction, y across to the right, normal into the counterface.
Creepage is (wheel - counterface)/V; forces and moment are those on the wheel and oppose it. Simplified
theory, the model that FASTSIM solves, is for pure longitudinal creepage: traction on the wheel grows from
the leading edge in proportion to creepage and is cut back to the traction bound; shares are
positive magnitudes.

References
----------
.. [1] J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer 1990.
.. [2] J. J. Kalker, Vehicle System Dynamics 11 (1982) 1-13, doi:10.1080/00423118208968684.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipe

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.validation import alike, finite, number, per_row, positive, vectors, within
from wearsim.contact.tangential.kalker import coefficients
from wearsim.errors import ContactError


def kalker_linear(
    creepage: ArrayLike,
    semi_axis_x: ArrayLike,
    semi_axis_y: ArrayLike,
    shear_modulus: float,
    poisson_ratio: float,
) -> FloatArray:
    r"""Creep forces without slip.

    Parameters
    ----------
    creepage : (m, 3) array
        Longitudinal, lateral creepage and spin [-, -, 1/m].
    semi_axis_x, semi_axis_y : (m,) array or float
        a and b [m].
    shear_modulus, poisson_ratio : float
        G and nu of both bodies [Pa], [-].

    Returns
    -------
    (m, 3) array
        Longitudinal, lateral force and moment about the normal, on the wheel [N, N, N m].

    Raises
    ------
    ContactError
        If an argument is outside its domain or has another shape.

    Notes
    -----
    Of [1]_: :math:`F_x = -G ab\, C_{11} \xi_x`,
    :math:`F_y = -G ab\, C_{22} \xi_y - G (ab)^{3/2} C_{23} \varphi`,
    :math:`M_z = G (ab)^{3/2} C_{23} \xi_y - G (ab)^2 C_{33} \varphi`. Independent of load and friction:
    right to a few per cent while the forces stay below about a third of what friction carries.

    References
    ----------
    .. [1] J. J. Kalker, Three-dimensional elastic bodies in rolling contact, Kluwer 1990.
    """
    modulus = number("shear modulus G", positive("shear modulus G", shear_modulus, "Pa"))
    poisson = number("Poisson's ratio", within("Poisson's ratio", poisson_ratio, "-", 0.0, 0.5))
    xi = vectors("creepage", creepage, "-", (3,))
    a, b = (
        per_row(name, positive(name, axis, "m"), len(xi))
        for name, axis in (("semi-axis a", semi_axis_x), ("semi-axis b", semi_axis_y))
    )
    c11, c22, c23, c33 = coefficients(a / b, poisson)
    square, cross = a * b, (a * b) ** 1.5
    x, y, spin = xi.T
    return -modulus * np.stack(
        (square * c11 * x, square * c22 * y + cross * c23 * spin, square**2 * c33 * spin - cross * c23 * y),
        axis=1,
    )


def full_slip(creepage: ArrayLike, friction: ArrayLike, normal_force: ArrayLike) -> FloatArray:
    r"""Creep force of a contact that slides as a whole, without spin.

    Parameters
    ----------
    creepage : (m, 2) array
        Longitudinal and lateral creepage [-].
    friction : (m,) array or float
        Coulomb coefficient [-].
    normal_force : (m,) array or float
        [N].

    Returns
    -------
    (m, 2) array
        Longitudinal and lateral force on the wheel, against the creepage [N]. Any shape of patch.

    Raises
    ------
    ContactError
        If an argument is outside its domain or has another shape, or both creepages are zero: sliding has
        no direction then.
    """
    xi = vectors("creepage", creepage, "-", (2,))
    size = np.hypot(xi[:, 0], xi[:, 1])
    if (size == 0.0).any():
        raise ContactError(
            "both creepages are 0: sliding without a direction; give a creepage", int(np.argmin(size))
        )
    mu = within("friction coefficient", friction, "-", 0.0, np.inf)
    load = positive("normal force", normal_force, "N")
    carried = per_row("friction coefficient", mu, len(xi)) * per_row("normal force", load, len(xi))
    return -(carried / size)[:, None] * xi


def full_slip_spin_moment(
    spin: ArrayLike,
    semi_axis_x: ArrayLike,
    semi_axis_y: ArrayLike,
    friction: ArrayLike,
    normal_force: ArrayLike,
) -> FloatArray:
    r"""Moment of a contact ellipse that slides by spin alone: the limit of large spin.

    Parameters
    ----------
    spin : array
        [1/m]; its sign alone matters.
    semi_axis_x, semi_axis_y : array
        a and b [m].
    friction : array
        Coulomb coefficient [-].
    normal_force : array
        [N].

    Returns
    -------
    array
        Moment on the wheel about the contact normal [N m]; no force goes with it.

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.

    Notes
    -----
    :math:`|M_z| = \mu \iint p \sqrt{x^2 + y^2}` with the pressure of Hertz. In polar coordinates the radial
    integral is :math:`\pi R^4/16` over R and what is left is a complete elliptic integral:
    :math:`|M_z| = \tfrac38 \mu N a_> E(1 - a_<^2/a_>^2)` with the larger and smaller semi-axis (parameter
    form of E); on a circle :math:`3\pi \mu N a/16`.
    """
    turning, a, b, mu, load = alike(
        spin=finite("spin", spin, "1/m"),
        semi_axis_a=positive("semi-axis a", semi_axis_x, "m"),
        semi_axis_b=positive("semi-axis b", semi_axis_y, "m"),
        friction_coefficient=within("friction coefficient", friction, "-", 0.0, np.inf),
        normal_force=positive("normal force", normal_force, "N"),
    )
    larger, smaller = np.maximum(a, b), np.minimum(a, b)
    largest = 0.375 * mu * load * larger * ellipe(1.0 - (smaller / larger) ** 2)
    moment: FloatArray = -np.sign(turning) * largest
    return moment


def frictional_power(force: ArrayLike, creepage: ArrayLike, speed: ArrayLike) -> FloatArray:
    r"""Power that friction takes in steady rolling.

    Parameters
    ----------
    force : (m, k) array
        Longitudinal, with k = 2 also lateral force [N] and with k = 3 also moment [N m] on the wheel.
    creepage : (m, k) array
        Of the same order [-, -, 1/m].
    speed : (m,) array or float
        V [m/s].

    Returns
    -------
    (m,) array
        :math:`-V (F_x \xi_x + F_y \xi_y + M_z \varphi)`, positive or zero where forces oppose creepage [W].

    Raises
    ------
    ContactError
        If an argument is outside its domain or has another shape.
    """
    forces, xi = (
        vectors(name, value, "-", (1, 2, 3)) for name, value in (("force", force), ("creepage", creepage))
    )
    if forces.shape != xi.shape:
        raise ContactError(
            f"force has the shape {forces.shape} and creepage {xi.shape}: they must be the same"
        )
    v = per_row("speed", positive("speed", speed, "m/s"), len(xi))
    power: FloatArray = -v * (forces * xi).sum(axis=1) + 0.0
    return power


def reduced_creepage(
    creepage: ArrayLike,
    semi_axis_x: ArrayLike,
    semi_axis_y: ArrayLike,
    friction: ArrayLike,
    normal_force: ArrayLike,
    shear_modulus: float,
    poisson_ratio: float,
) -> FloatArray:
    r"""Longitudinal creepage in the scale of the elliptic traction bound.

    Parameters
    ----------
    creepage : (m,) array or float
        Longitudinal creepage [-].
    semi_axis_x, semi_axis_y : (m,) array or float
        a and b [m].
    friction : (m,) array or float
        Coulomb coefficient [-].
    normal_force : (m,) array or float
        [N].
    shear_modulus, poisson_ratio : float
        G and nu of both bodies [Pa], [-].

    Returns
    -------
    (m,) array
        :math:`\varepsilon = \tfrac{\pi}{4} G a b\, C_{11} |\xi_x| / (\mu N)`, (1,) if all are floats [-].

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.
    """
    xi, a, b, mu, load = alike(
        creepage=np.atleast_1d(finite("creepage", creepage, "-")),
        semi_axis_a=positive("semi-axis a", semi_axis_x, "m"),
        semi_axis_b=positive("semi-axis b", semi_axis_y, "m"),
        friction_coefficient=positive("friction coefficient", friction, "-"),
        normal_force=positive("normal force", normal_force, "N"),
    )
    if xi.ndim > 1:
        raise ContactError(f"creepages and semi-axes have the shape {xi.shape} and must have one axis")
    poisson = number("Poisson's ratio", within("Poisson's ratio", poisson_ratio, "-", 0.0, 0.5))
    modulus = number("shear modulus G", positive("shear modulus G", shear_modulus, "Pa"))
    value: FloatArray = 0.25 * np.pi * modulus * a * b * coefficients(a / b, poisson)[0] * np.abs(xi)
    return value / (mu * load)


def fastsim_elliptic_force(reduced: ArrayLike) -> FloatArray:
    r"""Longitudinal force with the elliptic traction bound (pressure of Hertz).

    Parameters
    ----------
    reduced : array
        :math:`\varepsilon` of :func:`reduced_creepage`, 0 or above [-].

    Returns
    -------
    array
        Force over friction coefficient times normal force [-].

    Raises
    ------
    ContactError
        If an entry is negative or not finite.

    Notes
    -----
    :math:`\tfrac{2}{\pi} [\varepsilon/(1+\varepsilon^2) + \arctan \varepsilon]`: Polach's formula with both
    of his reduction factors at 1.
    """
    eps = within("reduced creepage", reduced, "-", 0.0, np.inf)
    return 2.0 / np.pi * (eps / (1.0 + eps**2) + np.arctan(eps))


def fastsim_elliptic_slip_border(reduced: ArrayLike) -> FloatArray:
    r"""Where slip begins in each strip, with the elliptic traction bound.

    Parameters
    ----------
    reduced : array
        :math:`\varepsilon` of :func:`reduced_creepage`, 0 or above [-].

    Returns
    -------
    array
        :math:`x^*/a(y) = (\varepsilon^2 - 1)/(\varepsilon^2 + 1)`, the same in all strips, a(y) the strip's
        half length; it sticks ahead of it and slips behind it [-]. The share of the patch that slips is
        half of one plus this.

    Raises
    ------
    ContactError
        If an entry is negative or not finite.
    """
    square = within("reduced creepage", reduced, "-", 0.0, np.inf) ** 2
    return 1.0 - 2.0 / (square + 1.0)


def fastsim_strip_work(
    y: ArrayLike, semi_axis_y: ArrayLike, force: ArrayLike, creepage: ArrayLike
) -> FloatArray:
    r"""Frictional work of one passage across an ellipse, with the elliptic traction bound.

    Parameters
    ----------
    y : array
        Lateral position from the middle [m].
    semi_axis_y : array
        b [m].
    force : array
        Longitudinal force on the wheel [N].
    creepage : array
        Longitudinal creepage [-].

    Returns
    -------
    array
        Work per area e(y), zero outside [J/m2]; all arguments broadcast.

    Raises
    ------
    ContactError
        If an argument is outside its domain, or shapes do not fit together.

    Notes
    -----
    :math:`e(y) = \tfrac{3 T\gamma}{4b} (1 - y^2/b^2)` with :math:`T\gamma = -F_x \xi_x`: parabolic at any
    creepage, because all strips slip over the same share of their lengths.
    """
    place, b, fx, xi = alike(
        lateral_position=finite("lateral position y", y, "m"),
        semi_axis_b=positive("semi-axis b", semi_axis_y, "m"),
        force=finite("force", force, "N"),
        creepage=finite("creepage", creepage, "-"),
    )
    return 0.75 * -fx * xi / b * np.maximum(1.0 - (place / b) ** 2, 0.0)
