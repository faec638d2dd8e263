r"""Closed forms of contact mechanics that the models are tested with.

Axes of the contact frame: x rolling direction, y across to the right, normal into the
counterface. Creepage is (wheel - counterface)/V; tractions, forces and moment are those
on the wheel and oppose it. The formulas do not check their arguments. Simplified
theory, the model that FASTSIM solves, is for pure longitudinal creepage: traction grows
from the leading edge in proportion to creepage and is cut back to the traction bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731, chapters
4 and 8;
F. W. Carter, Proc. R. Soc. Lond. A 112 (1926) 151-157; J. J. Kalker, Three-Dimensional
Elastic
Bodies in Rolling Contact, Kluwer 1990; J. J. Kalker, Vehicle System Dynamics 11
(1982) 1-13, doi:10.1080/00423118208968684.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from scipy.special import ellipe

from wearsim.contact.normal.hertz import ContactEllipse, contact_ellipse
from wearsim.contact.patch import FloatArray
from wearsim.contact.tangential.kalker import coefficients


class Ellipse(ContactEllipse):
    """Contact ellipses with their area and pressure field."""

    @property
    def area(self):
        return np.pi * self.semi_axis_x * self.semi_axis_y

    def pressure(self, x, y):
        """Pressure [Pa] at points from the middle, zero outside."""
        place = (x / self.semi_axis_x) ** 2 + (y / self.semi_axis_y) ** 2
        return self.max_pressure * np.sqrt(np.maximum(1.0 - place, 0.0))


def hertz(
    longitudinal_curvature, lateral_curvature, force, effective_modulus
) -> Ellipse:
    """Ellipse of the gap A x^2 + B y^2."""
    return Ellipse(
        *astuple(
            contact_ellipse(
                longitudinal_curvature, lateral_curvature, force, effective_modulus
            )
        )
    )


@dataclass(frozen=True)
class LineContact:
    """Line contacts and their semi-elliptic pressure."""

    half_length: FloatArray  # [m]
    max_pressure: FloatArray  # [Pa]

    def pressure(self, x):
        """Pressure [Pa] at distances from the middle, zero outside."""
        return self.max_pressure * np.sqrt(
            np.maximum(1.0 - (x / self.half_length) ** 2, 0.0)
        )


def line_hertz(
    longitudinal_curvature, force_per_width, effective_modulus
) -> LineContact:
    """Parallel cylinders, Johnson (4.43)-(4.45): a^2 = 2 P' / (pi E* A), p0 = 2 P' /
    (pi a).
    """
    half = np.sqrt(
        2.0 * force_per_width / (np.pi * effective_modulus * longitudinal_curvature)
    )
    return LineContact(half, 2.0 * force_per_width / (np.pi * half))


@dataclass(frozen=True)
class RollingCylinders:
    """Carter's solution for line contacts in steady rolling; the stick zone begins at
    the leading edge.
    """

    half_length: FloatArray  # [m]
    stick_half_length: FloatArray  # [m]
    saturation: FloatArray  # creepage at which all slips [-]
    creepage: FloatArray  # longitudinal [-]
    limit: FloatArray  # friction coefficient times the pressure in the middle [Pa]

    @property
    def force_per_width(self):
        full = 0.5 * np.pi * self.half_length * self.limit
        share = 1.0 - (self.stick_half_length / self.half_length) ** 2
        return -np.sign(self.creepage) * full * share

    def traction(self, x):
        """Longitudinal traction [Pa] at distances from the middle."""
        a, c = self.half_length, self.stick_half_length
        full = np.sqrt(np.maximum(a**2 - x**2, 0.0))
        held = np.sqrt(np.maximum(c**2 - (x - (a - c)) ** 2, 0.0))
        return -np.sign(self.creepage) * self.limit * (full - held) / a

    def slip(self, x):
        """Slip velocity over V at distances from the middle within the contact."""
        a, c = self.half_length, self.stick_half_length
        behind = np.maximum(a - c - x, 0.0)
        beyond = np.maximum(np.abs(self.creepage) / self.saturation - 1.0, 0.0)
        local = np.sqrt(np.maximum(behind**2 - c**2, 0.0)) / a
        return np.sign(self.creepage) * self.saturation * (local + beyond)


def carter(
    creepage, half_length, max_pressure, friction, effective_modulus
) -> RollingCylinders:
    r"""Tractive rolling of parallel cylinders, Johnson 8.3.

    Saturation creepage 2 mu p0 / E* = mu a / R and c/a = 1 - |xi|/xi_s. For small
    creepage this is the limit a/b to 0 of Kalker's linear theory,
    :math:`C_{11} = \pi^2 / (4 (1 - \nu))`.
    """
    limit = friction * max_pressure
    saturation = 2.0 * limit / effective_modulus
    stick = half_length * np.maximum(1.0 - np.abs(creepage) / saturation, 0.0)
    return RollingCylinders(half_length, stick, saturation, creepage, limit)


def kalker_linear(creepage, semi_axis_x, semi_axis_y, shear_modulus, poisson_ratio):
    r"""Forces and moment (m, 3) without slip.

    :math:`F_x = -G ab\, C_{11} \xi_x`, :math:`F_y = -G ab\, C_{22} \xi_y - G (ab)^{3/2}
    C_{23} \varphi`, :math:`M_z = G (ab)^{3/2} C_{23} \xi_y - G (ab)^2 C_{33} \varphi`.
    """
    xi = np.asarray(creepage, dtype=float)
    a, b = (np.broadcast_to(axis, len(xi)) for axis in (semi_axis_x, semi_axis_y))
    c11, c22, c23, c33 = coefficients(a / b, poisson_ratio)
    square, cross = a * b, (a * b) ** 1.5
    x, y, spin = xi.T
    return -shear_modulus * np.stack(
        (
            square * c11 * x,
            square * c22 * y + cross * c23 * spin,
            square**2 * c33 * spin - cross * c23 * y,
        ),
        axis=1,
    )


def full_slip(creepage, friction, normal_force):
    """Force (m, 2) of a contact that slides as a whole, without spin; any shape of
    patch.
    """
    size = np.hypot(*creepage.T)
    return -(friction * normal_force / size)[:, None] * creepage


def full_slip_spin_moment(spin, semi_axis_x, semi_axis_y, friction, normal_force):
    r"""Moment of a contact ellipse that slides by spin alone: the limit of large spin.

    :math:`|M_z| = \mu \iint p \sqrt{x^2 + y^2}` with the pressure of Hertz. In polar
    coordinates the radial integral is :math:`\pi R^4/16` over R and what is left is a
    complete elliptic integral: :math:`|M_z| = \tfrac38 \mu N a_> E(1 - a_<^2/a_>^2)`
    with the larger and smaller semi-axis (parameter form of E); on a circle
    :math:`3\pi \mu N a/16`.
    """
    larger, smaller = (
        np.maximum(semi_axis_x, semi_axis_y),
        np.minimum(semi_axis_x, semi_axis_y),
    )
    return (
        -np.sign(spin)
        * 0.375
        * friction
        * normal_force
        * larger
        * ellipe(1.0 - (smaller / larger) ** 2)
    )


def frictional_power(force, creepage, speed):
    """Power (m,) that friction takes in steady rolling: -V (Fx xi_x + Fy xi_y + Mz
    spin).
    """
    return -speed * (force * np.asarray(creepage)).sum(axis=1)


def reduced_creepage(
    creepage,
    semi_axis_x,
    semi_axis_y,
    friction,
    normal_force,
    shear_modulus,
    poisson_ratio,
):
    r"""Longitudinal creepage in the scale of the elliptic bound: pi/4 G a b C11
    |xi_x| / (mu N).
    """
    xi, a, b = np.broadcast_arrays(np.atleast_1d(creepage), semi_axis_x, semi_axis_y)
    c11 = coefficients(a / b, poisson_ratio)[0]
    return (
        0.25
        * np.pi
        * shear_modulus
        * a
        * b
        * c11
        * np.abs(xi)
        / (friction * normal_force)
    )


def fastsim_elliptic_force(reduced):
    """Longitudinal force over mu N with the elliptic traction bound: Polach's formula,
    both factors 1.
    """
    return 2.0 / np.pi * (reduced / (1.0 + reduced**2) + np.arctan(reduced))


def fastsim_elliptic_slip_border(reduced):
    """Where slip begins in each strip, over its half length: the same in all; it slips
    behind it.
    """
    return 1.0 - 2.0 / (reduced**2 + 1.0)


def fastsim_strip_work(y, semi_axis_y, force, creepage):
    """Frictional work per area of one passage across an ellipse, zero outside:
    parabolic at any creepage.
    """
    return (
        0.75
        * -force
        * creepage
        / semi_axis_y
        * np.maximum(1.0 - (y / semi_axis_y) ** 2, 0.0)
    )
