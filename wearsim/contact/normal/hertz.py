r"""Hertz contact: elliptic patch from the curvatures at the initial contact.

Each local minimum of the gap is a contact. In its contact plane the surfaces part as
:math:`A x^2 + B s^2`; A follows from the rolling radius of the wheel and the curvature
of the counterface, B from a parabola fitted to the gap over a window. All contacts of a
wheel share one vertical displacement; its share in the contact's normal direction, less
the height of its initial contact, is the approach :math:`\delta` of Hertz, and
:math:`N = K \delta^{3/2}`. Loads add up; contacts have no influence on each other.

Rule for several patches: minima of the gap nearer to a lower one than the window are
one contact with it; the others are contacts of their own, and where two ellipses
overlap the model raises an error: it never merges them.

Half-space, elastic, curvatures constant over the patch: on profiles of many arcs the
last one is the assumption that fails first, and nothing in the result shows it. Where B
is not positive there is no ellipse and the model raises an error.

References
----------
.. [1] H. Hertz, J. reine angew. Math. 92 (1882) 156-171, doi:10.1515/crll.1882.92.156.
.. [2] K. L. Johnson, Contact Mechanics, Cambridge 1985, doi:10.1017/CBO9781139171731,
       chapter 4.
.. [3] NIST Digital Library of Mathematical Functions, section 19.25 (elliptic integrals
       by Carlson's).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from wearsim.contact.geometry import NO_WHEEL, Gap
from wearsim.contact.normal.model import (
    AT_EDGE,
    NO_CONTACT,
    NOT_SINGLE,
    NormalModel,
    NormalSolution,
    fault_of,
)
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution, cells_of
from wearsim.errors import ContactError

# Half width [m] of the window of the lateral curvature: a narrower one shows the
# interpolation of the gap, a wider one includes the next arc of the profile; measured
# in reports/contact_models.md.
DEFAULTS = {"curvature_window": 1e-3}

_NARROWEST, _WIDEST = 0.2e-3, 10e-3
_SAMPLES = np.linspace(-1.0, 1.0, 41)  # sample positions in the window
# least-squares parabola by rising power
_FIT = np.linalg.pinv(np.vander(_SAMPLES, 3, increasing=True))
_MOVES = 8  # largest number of moves of the window to the vertex of its parabola
_STILL = 1e-9  # negligible move [m]
_NEWTON_STEPS = 5  # 3 reach rounding for A/B = 1e-8 .. 1e8


@dataclass(frozen=True)
class ContactEllipse:
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


def axis_ratio(curvature_ratio: FloatArray) -> FloatArray:
    r"""Ratio a/b of the semi-axes of contact ellipses.

    Parameters
    ----------
    curvature_ratio : array
        A/B, any positive number [-].

    Returns
    -------
    array
        a/b [-]; error below 1e-14 in its logarithm for A/B = 1e-8 to 1e8.

    Notes
    -----
    With :math:`\kappa` the minor over the major axis, the larger over the smaller
    curvature is :math:`(E/\kappa^2 - K)/(K - E) = R_D(0, 1, \kappa^2) / R_D(0,
    \kappa^2, 1)`; Carlson's integrals [3]_ lose no digits near the circle. Newton's
    method in logarithms, where the slope lies between -2 (long ellipses) and -3/2
    (circle). Every entry goes through the same steps whatever its neighbours.
    """
    target = np.abs(np.log(curvature_ratio))
    log_minor = -target / 1.5
    for _ in range(_NEWTON_STEPS):
        square = np.exp(2.0 * log_minor)
        along, across = elliprd(0.0, square, 1.0), elliprd(0.0, 1.0, square)
        log_minor = log_minor - (np.log(across / along) - target) / _slope(
            square, along, across
        )
    return np.exp(np.sign(np.log(curvature_ratio)) * log_minor)


def _slope(square: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Return the derivative of log(curvature ratio) by log(minor/major axis)."""
    parameter = 1.0 - square
    # near the circle the difference below cancels, and -3/2 is accurate enough
    round_off = parameter < 1e-6
    first = elliprf(0.0, square, 1.0)
    second = first - parameter * along / 3.0
    rise = second / along - first / across
    slope = -2.0 + 3.0 * rise / np.where(round_off, 1.0, parameter)
    return np.clip(np.where(round_off, -1.5, slope), -2.0, -1.5)


def contact_ellipse(
    along: ArrayLike, across: ArrayLike, force: ArrayLike, effective_modulus: float
) -> ContactEllipse:
    r"""Contact ellipse, approach and pressure of half-spaces without friction.

    Parameters
    ----------
    along, across : array
        A and B of the gap :math:`A x^2 + B y^2`, positive [1/m]: half the sum of the
        curvatures of the two bodies, so that A = 1/(2 r) for a wheel on a rail and
        (1/r + 1/s)/2 for one on a roller.
    force : array
        Normal force, positive [N].
    effective_modulus : float
        E* with :math:`1/E^* = (1-\nu_1^2)/E_1 + (1-\nu_2^2)/E_2`, for equal bodies
        :math:`E / (2 (1-\nu^2))` [Pa].

    Returns
    -------
    ContactEllipse
        Of the shape that the arguments broadcast to.

    Notes
    -----
    [2]_: major axis :math:`= (3 N (K-E) / (2\pi E^* e^2 \min(A,
    B)))^{1/3}`, :math:`p_0 = 3N/(2\pi a b)`, :math:`\delta = p_0 K(e) \min(a, b) /
    E^*`. The approach also equals :math:`A a^2 + B b^2`.
    """
    a_gap, b_gap, load, modulus = np.broadcast_arrays(
        along, across, force, effective_modulus
    )
    ratio = axis_ratio(a_gap / b_gap)
    lengthwise = ratio >= 1.0
    minor = np.where(lengthwise, 1.0 / ratio, ratio)  # ratio of minor to major axis
    major = np.cbrt(
        load
        * elliprd(0.0, minor**2, 1.0)
        / (2.0 * np.pi * modulus * np.minimum(a_gap, b_gap))
    )
    pressure = 1.5 * load / (np.pi * minor * major**2)
    return ContactEllipse(
        semi_axis_x=np.where(lengthwise, major, minor * major),
        semi_axis_y=np.where(lengthwise, minor * major, major),
        approach=pressure * minor * major * elliprf(0.0, minor**2, 1.0) / modulus,
        max_pressure=pressure,
    )


# Initial contact of the surfaces in one basin of the gap: row; position, z and angle on
# the profile; gap; curvatures A and B; normal force over approach^1.5 [m, rad, 1/m,
# N/m^1.5].
_CONTACT = np.dtype(
    [("row", int)]
    + [
        (name, float)
        for name in ("y", "z", "angle", "height", "along", "across", "stiffness")
    ]
    + [("force", float), ("displacement", float)]
)
_Contacts = NDArray[np.void]


def solve(
    gap: Gap,
    row: IntArray,
    load: FloatArray,
    *,
    vertical: bool,
    effective_modulus: float,
    resolution: Resolution,
    parameters: dict[str, float],
    **_: Any,
) -> NormalSolution:
    """Elliptic patches of every row; contract in `normal.model`.

    The parameter "curvature_window" is the half width of the window, in the contact
    plane, over which the parabola of the lateral curvature is fitted, 1 mm by default
    [m]. Minima of the gap nearer to a lower one than this are one contact with it. A
    ContactError is also raised where the window reaches the edge of a profile, a
    curvature is not positive, or two ellipses overlap.
    """
    window = {**DEFAULTS, **parameters}["curvature_window"]
    if not _NARROWEST <= window <= _WIDEST:
        raise ContactError(
            f"curvature_window = {1e3 * window:g} mm must be in {1e3 * _NARROWEST:g} "
            f".. {1e3 * _WIDEST:g} mm"
        )
    loaded = [np.zeros(0, _CONTACT)]
    for gap_row, weight in zip(row.tolist(), load.tolist(), strict=True):
        contacts = _contacts(gap, gap_row, weight, vertical, effective_modulus, window)
        if contacts.size > 1 and not vertical:
            raise fault_of(NOT_SINGLE, gap_row)
        contacts["displacement"] = _balance(contacts, weight, vertical)
        contacts["force"] = _forces(contacts, contacts["displacement"])
        contacts = contacts[np.argsort(-contacts["force"], kind="stable")]
        loaded.append(contacts[contacts["force"] > 0.0])
    return _cut_strips(gap, np.concatenate(loaded), effective_modulus, resolution)


def _contacts(
    gap: Gap,
    row: int,
    load: float,
    vertical: bool,
    effective_modulus: float,
    window: float,
) -> _Contacts:
    """Contacts that may close under the load, the lowest first."""
    curve = gap.gap[row]
    lowest = int(curve.argmin())
    if curve[lowest] >= NO_WHEEL:
        raise fault_of(NO_CONTACT, row)
    minima = 1 + np.flatnonzero((curve[1:-1] < curve[:-2]) & (curve[1:-1] <= curve[2:]))
    if lowest not in minima or max(curve[lowest - 1], curve[lowest + 1]) >= NO_WHEEL:
        raise fault_of(AT_EDGE, row)
    contacts = np.array(
        [_contact(gap, row, lowest, window, effective_modulus)], _CONTACT
    )
    # Displacement of the lowest contact alone under the load: the others reduce it.
    deepest = _displacement_alone(contacts, load, vertical)[0]
    for index in minima[np.argsort(curve[minima], kind="stable")]:
        if (
            curve[index] >= deepest
            or np.abs(gap.counterface.y[index] - contacts["y"]).min() <= window
        ):
            continue
        contact = np.array(
            _contact(gap, row, int(index), window, effective_modulus), _CONTACT
        )
        if np.abs(contact["y"] - contacts["y"]).min() > window:
            contacts = np.append(contacts, contact)
    return contacts[contacts["height"] < deepest]


def _contact(
    gap: Gap, row: int, index: int, window: float, effective_modulus: float
) -> tuple[float, ...]:
    """Contact at one minimum of the gap.

    The fitting window is centred on the vertex of its parabola.
    """
    grid, curve = gap.counterface, gap.gap[row]

    def fault(y: float, why: str) -> ContactError:
        place = (
            f"no contact ellipse at y = {1e3 * y:.2f} mm of the counterface's profile"
        )
        return ContactError(
            f"{place}: {why}; take the normal model kik_piotrowski", row=row
        )

    y, move = float(grid.y[index]), 0.0
    for _ in range(_MOVES):
        y += move
        z, angle = (
            float(np.interp(y, grid.y, grid.z)),
            float(np.interp(y, grid.y, grid.angle)),
        )
        cosine, sine = float(np.cos(angle)), float(np.sin(angle))
        part = slice(*np.searchsorted(grid.y, (y - 3.0 * window, y + 3.0 * window)))
        s = (grid.y[part] - y) * cosine + (grid.z[part] - z) * sine
        if (
            s[0] > -window
            or s[-1] < window
            or curve[part][np.abs(s) <= window].max() >= NO_WHEEL
        ):
            what = f"the window of +-{1e3 * window:g} mm for its lateral curvature"
            raise fault(y, f"{what} reaches the edge of a profile")
        wheel_slope = grid.slope[part] - np.gradient(curve[part], grid.y[part])
        opening = (curve[part] - curve[index]) / (cosine + wheel_slope * sine)
        level, tilt, across = (
            _FIT @ np.interp(window * _SAMPLES, s, opening) / window ** np.arange(3)
        )
        if across <= 0.0:
            raise fault(
                y, f"its lateral curvature B = {across:.3g} 1/m is not positive"
            )
        # Move at most by the window from the minimum itself.
        aim = y - 0.5 * tilt / across * cosine
        move = min(max(aim, grid.y[index] - window), grid.y[index] + window) - y
        if abs(move) < _STILL:
            break
    radius = float(np.interp(y, grid.y, gap.wheel_radius[row]))
    along = 0.5 * cosine * (1.0 / radius + gap.curvature / (1.0 - gap.curvature * z))
    if along <= 0.0:
        raise fault(
            y, f"its longitudinal curvature A = {along:.3g} 1/m is not positive"
        )
    height = curve[index] + (level - 0.25 * tilt**2 / across) / cosine
    stiffness = contact_ellipse(along, across, 1.0, effective_modulus).approach ** -1.5
    return row, y, z, angle, height, along, across, float(stiffness), 0.0, 0.0


def _forces(contacts: _Contacts, displacement: ArrayLike) -> FloatArray:
    """Return the normal forces [N] of contacts at a vertical displacement [m].

    The contacts are those of one wheel.
    """
    approach = np.maximum(
        (displacement - contacts["height"]) * np.cos(contacts["angle"]), 0.0
    )
    return contacts["stiffness"] * approach**1.5


def _displacement_alone(contacts: _Contacts, load: float, vertical: bool) -> FloatArray:
    """Vertical displacements [m] at which each contact alone carries the load."""
    cosine = np.cos(contacts["angle"])
    force = load / cosine if vertical else load
    return contacts["height"] + (force / contacts["stiffness"]) ** (2.0 / 3.0) / cosine


def _balance(contacts: _Contacts, load: float, vertical: bool) -> float:
    """Vertical displacement [m] at which the contacts of a wheel carry its load."""
    upper = float(_displacement_alone(contacts, load, vertical).min())
    if contacts.size == 1:
        return upper
    low, cosine = float(contacts["height"].min()), np.cos(contacts["angle"])

    def excess(approach: float) -> float:
        return float(_forces(contacts, low + approach) @ cosine) - load

    # Each contact alone would need a larger displacement; the margin covers the
    # rounding of `upper`.
    return low + float(
        brentq(excess, 0.0, (upper - low) * (1.0 + 1e-9), xtol=1e-18, rtol=1e-15)
    )


def _cut_strips(
    gap: Gap, contacts: _Contacts, effective_modulus: float, resolution: Resolution
) -> NormalSolution:
    """Cut the ellipses into strips of equal width and fit the pressure to the load."""
    row, y, z, angle, height, along, across, _, force, displacement = (
        contacts[name].copy() for name in _CONTACT.names or ()
    )
    ellipse = contact_ellipse(along, across, force, effective_modulus)
    strips = resolution.strips_across(2.0 * ellipse.semi_axis_y)
    # Strip edges and centres in turn, in halves of a strip from the initial contact
    # point; then padding.
    share = np.arange(2 * int(strips.max(initial=0)) + 1) / strips[:, None] - 1.0
    place = ellipse.semi_axis_y[:, None] * np.minimum(share, 1.0)
    grid = gap.counterface
    on_profile, skew = np.empty_like(place), np.empty_like(place)
    for m in range(row.size):
        # Points around the contact whose tangents differ by less than 84 degrees from
        # its own.
        away = np.flatnonzero(np.cos(grid.angle - angle[m]) < 0.1)
        bounds = np.concatenate(([-1], away, [grid.y.size]))
        k = np.searchsorted(away, np.searchsorted(grid.y, y[m]))
        part = slice(bounds[k] + 1, bounds[k + 1])
        s = (grid.y[part] - y[m]) * np.cos(angle[m]) + (grid.z[part] - z[m]) * np.sin(
            angle[m]
        )
        first, last = np.searchsorted(s, place[m, [0, -1]])
        if (
            first == 0
            or last == s.size
            or gap.gap[row[m], part][first - 1 : last + 1].max() >= NO_WHEEL
        ):
            raise fault_of(AT_EDGE, int(row[m]))
        on_profile[m] = np.interp(place[m], s, grid.y[part])
        middle_x = np.interp(place[m], s, gap.x[row[m], part])
        skew[m] = middle_x - middle_x[strips[m]]
    _check_overlap(row, on_profile[:, 0], on_profile[:, -1])
    middle = place[:, 1::2]
    half = ellipse.semi_axis_x[:, None] * np.sqrt(
        np.maximum(1.0 - share[:, 1::2] ** 2, 0.0)
    )
    true = np.minimum(np.arange(middle.shape[1]), strips[:, None] - 1)
    skew = np.take_along_axis(skew[:, 1::2], true, axis=1)
    width = 2.0 * ellipse.semi_axis_y / strips
    slope = force / (0.5 * np.pi * (half**2).sum(axis=1) * width)
    patch = Patch(
        row=row,
        y=middle,
        width=width,
        x_lead=skew + half,
        x_trail=skew - half,
        pressure_slope=np.broadcast_to(slope[:, None], half.shape),
        interpenetration=np.zeros_like(middle),
        strips=strips,
        cells=cells_of(resolution, skew + half, skew - half),
    )
    return NormalSolution(
        patch=patch,
        centre_y=y,
        contact_angle=angle,
        approach=(displacement - height) * np.cos(angle),
        normal_force=force,
        max_pressure=ellipse.max_pressure,
        edge_y=on_profile[:, ::2].copy(),
        load_scale=np.ones(row.size),
        vertical_displacement=displacement,
    )


def _check_overlap(row: IntArray, left: FloatArray, right: FloatArray) -> None:
    """Raise an error for overlapping ellipses, which would load the profile twice."""
    order = np.lexsort((left, row))
    left, right, row = left[order], right[order], row[order]
    for k in np.flatnonzero((row[1:] == row[:-1]) & (left[1:] < right[:-1]))[:1]:
        text = (
            "no contact ellipse: the ellipses of two contacts overlap at y = "
            f"{1e3 * left[k + 1]:.2f} .. {1e3 * right[k]:.2f} mm of the counterface's "
            "profile; take the normal model kik_piotrowski"
        )
        raise ContactError(text, row=int(row[k]))


# A small bump wears like the smooth profile around it, so that it keeps what a step
# adds to it.
MODEL = NormalModel(
    name="hertz",
    title="Hertz",
    solve=solve,
    can_update_profile=False,
    reason=(
        "an ellipse from the curvatures under one point evens out no wave shorter "
        "than itself, so that noise in the profile would stay or grow"
    ),
    parameters=DEFAULTS,
)
