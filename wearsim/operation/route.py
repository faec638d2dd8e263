r"""The operating points of a wheelset of a vehicle on its route: curves by balance, straight track by motion.

On straight track both axles of a bogie follow one lateral path :math:`y e^{i \omega x}`, each held by its yaw
stiffness, with :math:`y_{1,2} = y e^{\pm i \omega a}`:

.. math::
    i \omega\, 2 f_{11} l^2 \psi_j + 2 f_{11} l (\lambda/r_0) y_j + k_p (\psi_j - \psi_b) = 0, \quad
    \psi_b = \frac{a k_y (y_1 - y_2) + k_p (\psi_1 + \psi_2)}{2 a^2 k_y + 2 k_p}

The contact sees the yaw :math:`\psi - y'` and the curvature :math:`\psi'` of the path. Amplitudes are those
of a normal process (Rayleigh), phases even.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.contact.solve import solve
from wearsim.operation.bogie import GRAVITY, Bogies, Vehicle
from wearsim.operation.points import OperatingPoints, points_of
from wearsim.operation.recorded import bisected
from wearsim.operation.states import Controlled

BASE = 1.5
"""Distance of the contact points on both rails, by which cant turns the track [m]."""

LEAST_CONICITY = 1e-3
"""Equivalent conicity below which a wheelset is taken for one of cylinders [-]."""

_AMPLITUDES, _PHASES = 3, 8
POSITIONS = _AMPLITUDES * _PHASES
"""Positions of an axle on straight track."""

MOST_CLASSES = 32
"""Classes that segments of track are reduced to at most."""

WITHIN = 0.95
"""Of the flange clearance, up to which positions exist on straight track."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """A class of track."""

    name: str
    share: float
    speed: float  # [m/s]
    friction: float
    friction_flange: float
    environment: float
    torque: float = 0.0  # on the axle, driving forward [N m]


@dataclass(frozen=True, kw_only=True)
class Curve(Track):
    """A curve."""

    curvature: float  # positive to the right [1/m]
    acceleration: float  # unbalanced, to the right [m/s2]

    @staticmethod
    def of_deficiency(curvature: float, deficiency: float) -> float:
        """Unbalanced acceleration of a cant deficiency [m]."""
        return float(-np.sign(curvature)) * GRAVITY * deficiency / BASE

    @staticmethod
    def of_cant(curvature: float, speed: float, cant: float) -> float:
        """Unbalanced acceleration of a speed [m/s] at a cant, the outer rail higher [m]."""
        return float(-(speed**2 * curvature - np.sign(curvature) * GRAVITY * cant / BASE))


@dataclass(frozen=True, kw_only=True)
class Tangent(Track):
    """Straight track."""

    std: float  # standard deviation of the lateral position [m]


@dataclass(frozen=True)
class Motion:
    """How the wheelsets of a vehicle move on straight track, and which of its axles is looked at."""

    rule: str  # suspended, kinematic, guided or shifted
    wavelength: float  # [m]
    creep: float  # f11 of a wheel: longitudinal creep force over creepage [N]
    conicity: float
    clearance: float  # of the flange to either side [m]
    leading: float  # share of the distance that the wheelset is the leading one
    turned: float  # share that right wheels run on left rails


def klingel(wheelset: Wheelset, conicity: float) -> float:
    """Wavelength of the free lateral motion of a wheelset by Klingel's formula [m]."""
    return float(2.0 * np.pi * np.sqrt(wheelset.radius * wheelset.half_span / max(conicity, LEAST_CONICITY)))


def creep_coefficient(
    wheelset: Wheelset, counterface: Counterface, models: ContactModels, load: float
) -> float:
    """Longitudinal creep force over creepage of a wheel in the middle of the track, f11 [N]."""
    creepage = np.array([[1e-5, 0.0, 0.0], [-1e-5, 0.0, 0.0]])
    conditions = ContactConditions.of([0.0, 0.0], wheel_load=load, creepage=creepage)
    force = solve(conditions, wheelset, counterface, models, sides=(0,)).force_x
    return float((force[1] - force[0]) / 2e-5)


def yaw_over_shift(
    vehicle: Vehicle, motion: Motion, wheelset: Wheelset
) -> tuple[np.complex128, np.complex128]:
    """Yaw over lateral position of the leading and the trailing axle on straight track [rad/m].

    Complex: with a phase against the path, by the rule of the motion.
    """
    frequency, half, radius = 2.0 * np.pi / motion.wavelength, wheelset.half_span, wheelset.radius
    if motion.rule in ("guided", "shifted"):
        return np.complex128(0.0), np.complex128(0.0)
    stiffness = 0.0 if motion.rule == "kinematic" else vehicle.yaw_stiffness
    a, ky, creep = vehicle.half_wheelbase, vehicle.lateral_stiffness, 2.0 * motion.creep
    path = np.exp(1j * frequency * a * np.array([1.0, -1.0]))
    frame = 2.0 * a * a * ky + 2.0 * stiffness
    own = 1j * frequency * creep * half**2 + stiffness
    matrix = np.array([[own, 0.0], [0.0, own]]) - stiffness * stiffness / frame
    steering = -creep * half * motion.conicity / radius * path
    known = steering + stiffness * a * ky * (path[0] - path[1]) / frame
    leading, trailing = np.linalg.solve(matrix, known) / path
    return np.complex128(leading), np.complex128(trailing)


def _positions(one: Tangent, motion: Motion) -> tuple[NDArray[np.complex128], FloatArray]:
    """Positions (k,) of the motion on straight track with their phase, cut at the flange; weights (k,)."""
    node, weight = np.polynomial.laguerre.laggauss(_AMPLITUDES)
    size = np.minimum(one.std * np.sqrt(2.0 * node), WITHIN * motion.clearance)
    phase = 2.0 * np.pi * (np.arange(_PHASES) + 0.5) / _PHASES
    path = np.repeat(size, _PHASES) * np.exp(1j * np.tile(phase, _AMPLITUDES))
    return path, np.repeat(weight, _PHASES) / _PHASES


def route(
    track: Sequence[Track], vehicle: Vehicle, motion: Motion, wheelset: Wheelset, rotation: str = "free"
) -> OperatingPoints:
    """Operating points of one wheelset of a vehicle on all classes of track.

    Of a curve those of the leading and of the trailing axle of a bogie, as the train stands and turned; their
    positions follow from its balance (`wearsim.operation.bogie`). Shares of 0 are solved and do not wear.
    `rotation` is the rule of `ContactConditions`.
    """
    total = sum(one.share for one in track)
    runs: list[dict[str, object]] = []
    leading: list[int] = []
    shares = motion.leading, 1.0 - motion.leading
    axles = list(zip(shares, yaw_over_shift(vehicle, motion, wheelset), strict=True))
    frequency = 0.0 if motion.rule == "shifted" else 2.0 * np.pi / motion.wavelength
    for one in track:
        common = {
            "name": one.name, "speed": one.speed, "friction": one.friction,
            "friction_flange": one.friction_flange, "environment": one.environment,
            "axle_torque": one.torque,
        }  # fmt: skip
        share = one.share / total
        if isinstance(one, Tangent):
            path, weight = _positions(one, motion)
            for part, ratio in axles:
                if part == 0.0:
                    continue
                yaw = ratio * path
                slope, turning = (1j * frequency * each for each in (path, yaw))
                for k in range(path.size):
                    runs.append({
                        **common, "label": f"{one.name} {1e3 * path[k].real:+.2f} mm",
                        "weight": share * part * weight[k], "shift": path[k].real, "yaw": yaw[k].real,
                        "drift": slope[k].real, "track_curvature": turning[k].real,
                    })  # fmt: skip
            continue
        assert isinstance(one, Curve)
        for turned, part in ((1.0, 1.0 - motion.turned), (-1.0, motion.turned)):
            if part == 0.0:
                continue
            leading.append(len(runs))
            for axle, own in zip(("leading", "trailing"), shares, strict=True):
                runs.append({
                    **common, "label": f"{one.name}{'' if turned > 0.0 else ' turned'}, {axle}",
                    "name": f"{one.name}, {axle}",
                    "weight": share * part * own, "track_curvature": turned * one.curvature,
                    "acceleration": turned * one.acceleration,
                })  # fmt: skip
    weight = np.array([run["weight"] for run in runs], dtype=float)
    label = tuple(str(run["label"]) for run in runs)
    names = tuple(str(run["name"]) for run in runs)
    acceleration = np.array([run.get("acceleration", 0.0) for run in runs], dtype=float)
    moments = vehicle.box_moment(acceleration, wheelset.radius)
    loaded = [
        {**run, "axle_load": vehicle.axle_load, "box_moment": float(moment)}
        for run, moment in zip(runs, moments, strict=True)
    ]
    points = points_of(loaded, {"rotation": rotation, "free_roll": True}, weight / weight.sum(), label, names)
    first = np.array(leading, dtype=np.int64)
    if not first.size:
        return points
    assert isinstance(points.controlled, Controlled)
    bogies = Bogies(vehicle, first, first + 1, acceleration[first], np.ones(first.size))
    return replace(points, controlled=replace(points.controlled, bogies=bogies))


def reduced(
    segments: Sequence[Curve | Tangent],
    worn: Callable[[Sequence[Curve | Tangent]], FloatArray],
    tolerance: float,
) -> tuple[tuple[Curve | Tangent, ...], float]:
    """Reduce segments of track to the fewest classes that keep the error of the wear within a tolerance.

    Parameters
    ----------
    segments : sequence of Curve or Tangent
        Their shares are lengths.
    worn : callable
        Wear increment of classes, of any shape.
    tolerance : float
        Largest difference of the increments of these classes and of fewer ones, over its largest value [-].

    Returns
    -------
    tuple of Curve or Tangent
        Curves to the right, to the left and straight track apart; each is the mean of its segments by length.
    float
        The difference reached, which is above the tolerance if `MOST_CLASSES` do not do, and 0 if each class
        has segments of one kind alone.
    """
    kind = np.array([1 + (one.curvature > 0.0) if isinstance(one, Curve) else 0 for one in segments])
    names = sorted({field.name for one in segments for field in fields(one)} - {"name", "share"})
    table = np.array([[getattr(one, name, 0.0) for name in names] for one in segments])
    length = np.array([one.share for one in segments])
    spread = np.sqrt(np.average((table - np.average(table, axis=0, weights=length)) ** 2, 0, length))
    scaled = table / np.where(spread > 1e-9 * np.abs(table).max(axis=0), spread, np.inf)
    scaled *= np.where([name == "curvature" for name in names], 2.0, 1.0)  # what decides most of the wear
    bent = length * (0.1 + np.abs(scaled[:, names.index("curvature")]) if "curvature" in names else 1.0)
    error, before, made = np.inf, None, tuple(segments)
    for count in (4, 6, 8, 12, 16, 24, MOST_CLASSES):
        group = bisected(scaled, bent, count, kind)
        made = tuple(_mean(segments, names, np.flatnonzero(group == k)) for k in range(int(group.max()) + 1))
        after = worn(made)
        if before is not None:
            error = float(np.abs(after - before).max() / max(float(np.abs(after).max()), 1e-300))
        if error <= tolerance:
            break
        if len(made) < count:  # nothing is left to divide
            error = 0.0
            break
        before = after
    order = sorted(range(len(made)), key=lambda k: (-getattr(made[k], "curvature", -np.inf), made[k].name))
    return tuple(made[k] for k in order), error


def _mean(segments: Sequence[Curve | Tangent], names: Sequence[str], own: IntArray) -> Curve | Tangent:
    """Class of the segments `own`, all curves or all straight."""
    length = np.array([segments[k].share for k in own])
    first, values = segments[int(own[0])], dict[str, Any]()
    for name in (one for one in names if hasattr(first, one)):
        each = np.array([getattr(segments[k], name) for k in own])
        values[name] = float(each[0] if np.ptp(each) == 0.0 else np.average(each, weights=length))
    name = "straight"
    if isinstance(first, Curve):
        name = f"R {abs(1.0 / values['curvature']):.0f} {'right' if values['curvature'] > 0.0 else 'left'}"
    return replace(
        first, **values, name=f"{name} {3.6 * values['speed']:.0f} km/h", share=float(length.sum())
    )
