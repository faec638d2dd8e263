r"""The two ends of the creep curve of an elliptic contact: no slip (Kalker's linear theory) and nothing else.

Axes of the contact frame: x rolling direction, y across to the right, normal into the counterface.
Creepage is (wheel - counterface)/V; forces and moment are those on the wheel and oppose it.

References
----------
.. [1] J. J. Kalker, Three-dimensional elastic bodies in rolling contact, Kluwer 1990.
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
    force: FloatArray = -modulus * np.stack(
        (square * c11 * x, square * c22 * y + cross * c23 * spin, square**2 * c33 * spin - cross * c23 * y),
        axis=1,
    )
    return force


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
    force: FloatArray = -(carried / size)[:, None] * xi
    return force


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
