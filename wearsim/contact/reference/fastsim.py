r"""Exact results of simplified theory, the model that FASTSIM solves, for pure longitudinal creepage.

Traction on the wheel grows from the leading edge in proportion to creepage and is cut back to the traction
bound. Shares are positive magnitudes: the force on the wheel is minus the creepage's sign times them.

References
----------
.. [1] J. J. Kalker, Vehicle System Dynamics 11 (1982) 1-13.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from wearsim.contact.patch import FloatArray
from wearsim.contact.reference.validation import alike, finite, number, positive, within
from wearsim.contact.tangential.kalker import coefficients
from wearsim.errors import ContactError


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
    share: FloatArray = 2.0 / np.pi * (eps / (1.0 + eps**2) + np.arctan(eps))
    return share


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
    border: FloatArray = 1.0 - 2.0 / (square + 1.0)
    return border


def parabolic_reduced_creepage(reduced: ArrayLike) -> FloatArray:
    r"""Longitudinal creepage over that of full slip with the parabolic traction bound.

    Parameters
    ----------
    reduced : array
        :math:`\varepsilon` of :func:`reduced_creepage`, 0 or above [-].

    Returns
    -------
    array
        :math:`w = \xi/\xi_s`, with :math:`\xi_s = 4 L_1 \mu N / (\pi a^2 b)` and
        :math:`L_1 = 8a/(3 G C_{11})`: :math:`w = \tfrac38 \varepsilon` [-].

    Raises
    ------
    ContactError
        If an entry is negative or not finite.
    """
    value: FloatArray = 0.375 * within("reduced creepage", reduced, "-", 0.0, np.inf)
    return value


def fastsim_parabolic_force(reduced: ArrayLike) -> FloatArray:
    r"""Longitudinal force with Kalker's parabolic traction bound.

    Parameters
    ----------
    reduced : array
        :math:`w = \xi/\xi_s` of :func:`parabolic_reduced_creepage`, 0 or above; all slips from 1 on [-].

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
    A strip at :math:`\eta = y/b` carries :math:`1 - (1-\theta)^3` of its full force, which goes with
    :math:`(1-\eta^2)^{3/2}`, with :math:`\theta = \min(1, w/\sqrt{1-\eta^2})`. Integrated over the strips,
    with :math:`h = \sqrt{1-w^2}`:
    :math:`\tfrac{16}{3\pi} [3wh - w h^3 - \tfrac32 w^2 (hw + \arccos w) + \tfrac34 w^3 h
    + \tfrac38 (\arcsin w - wh)]`; its slope at zero is :math:`32/(3\pi)`.
    """
    w = np.minimum(within("reduced creepage", reduced, "-", 0.0, np.inf), 1.0)
    h = np.sqrt(1.0 - w**2)
    inner = 3.0 * w * h - w * h**3 - 1.5 * w**2 * (h * w + np.arccos(w)) + 0.75 * w**3 * h
    share: FloatArray = 16.0 / (3.0 * np.pi) * (inner + 0.375 * (np.arcsin(w) - w * h))
    return share


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
    work: FloatArray = 0.75 * -fx * xi / b * np.maximum(1.0 - (place / b) ** 2, 0.0)
    return work
