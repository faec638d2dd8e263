r"""Operating points of a wheelset on a route: curves and straight track.

Curves are solved by balance; straight track has a prescribed motion.

On straight track both axles of a bogie follow one lateral path
:math:`y e^{i \omega x}`, each held by its yaw stiffness, with
:math:`y_{1,2} = y e^{\pm i \omega a}`:

.. math::
    i \omega\, 2 f_{11} l^2 \psi_j + 2 f_{11} l (\lambda/r_0) y_j + k_p (\psi_j - \psi_b) = 0, \quad
    \psi_b = \frac{a k_y (y_1 - y_2) + k_p (\psi_1 + \psi_2)}{2 a^2 k_y + 2 k_p}

The contact sees the yaw :math:`\psi - y'` and the curvature :math:`\psi'` of the path.
Amplitudes are those of a normal process (Rayleigh), phases even.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import solve
from wearsim.operation.bogie import Bogies, Vehicle, spring_slope, suspension
from wearsim.operation.controlled import Controlled
from wearsim.operation.points import OperatingPoints, points_of
from wearsim.operation.recorded import (
    binning_error,
    bisected,
    unit_spread,
    wear_and_place,
)
from wearsim.quantities import GRAVITY

BASE = 1.5
"""Distance of the contact points on both rails, over which cant acts [m]."""

LEAST_CONICITY = 1e-3
"""Equivalent conicity below which a wheelset is treated as cylindrical [-]."""

_AMPLITUDES, _PHASES = 3, 8
POSITIONS = _AMPLITUDES * _PHASES
"""Number of positions of an axle on straight track."""

MOST_CLASSES = 48
"""Largest number of classes to which track segments are reduced."""

_COUNTS = (4, 6, 8, 12, 16, 24, 32, MOST_CLASSES)
"""Numbers of classes that are tried until the binning error is small."""

_SET_POINTS = 0.05
"""Weight of the set-points, relative to that of the wear, when segments are grouped."""

MOST_SEGMENTS = 500
"""Largest number of different segments; more are first united by their set-points."""

WITHIN = 0.95
"""Share of the flange clearance within which positions on straight track lie."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """Class of track."""

    name: str
    share: float
    speed: float  # [m/s]
    friction: float
    friction_flange: float
    environment: float
    torque: float = 0.0  # on the axle, driving forward [N m]
    # alternative to `torque`: torques with shares
    torques: tuple[tuple[float, float], ...] = ()
    rails: tuple[tuple[int, float], ...] = (
        (0, 1.0),
    )  # pairs of rails of the counterface, with shares
    lubricated: float = (
        1.0  # share with the flange's own friction, elsewhere that of the tread applies
    )

    def on(self, rail: int) -> list[tuple[float, str, dict[str, float]]]:
        """Share, name and set-points of each track state on one pair of rails."""
        torques = self.torques or ((self.torque, 1.0),)
        flanges = (
            (self.friction_flange, self.lubricated),
            (self.friction, 1.0 - self.lubricated),
        )
        return [
            (
                of_rail * of_torque * of_flange,
                (f" rail {rail + 1}" if len(self.rails) > 1 else "")
                + (f" {1e-3 * torque:g} kN m" if len(torques) > 1 else "")
                + ("" if self.lubricated in (0.0, 1.0) else (" greased", " dry")[k]),
                {"rail": rail, "axle_torque": torque, "friction_flange": flange},
            )
            for pair, of_rail in self.rails
            if pair == rail
            for torque, of_torque in torques
            for k, (flange, of_flange) in enumerate(flanges)
            if of_flange > 0.0
        ]


@dataclass(frozen=True, kw_only=True)
class Curve(Track):
    """Curve of a track."""

    curvature: float  # positive to the right [1/m]
    acceleration: float  # unbalanced, to the right [m/s2]

    @staticmethod
    def of_deficiency(curvature: float, deficiency: float) -> float:
        """Unbalanced lateral acceleration of a cant deficiency [m] in m/s2."""
        return float(-np.sign(curvature)) * GRAVITY * deficiency / BASE

    @staticmethod
    def of_cant(curvature: float, speed: float, cant: float) -> float:
        """Unbalanced acceleration at a speed [m/s] and a cant of the outer rail [m]."""
        return float(
            -(speed**2 * curvature - np.sign(curvature) * GRAVITY * cant / BASE)
        )


@dataclass(frozen=True, kw_only=True)
class Tangent(Track):
    """Straight track."""

    std: float  # standard deviation of the lateral position [m]


@dataclass(frozen=True)
class AxleShares:
    """Position of the wheelset in a vehicle, as shares of the distance."""

    leading: float  # share in which the axle is the leading one of its bogie
    turned: float  # share in which right wheels run on left rails
    outer: bool = True  # True if its bogie is the front one while the axle leads


@dataclass(frozen=True)
class Motion:
    """Motion of the wheelsets of a vehicle on straight track."""

    rule: str  # suspended, kinematic, guided or shifted
    wavelength: float  # [m]
    creep: tuple[
        float, float
    ]  # f11, f22 of a wheel: longitudinal, lateral creep force over creepage [N];
    # f11 is 0 for independent wheels, which do not steer
    conicity: float
    clearance: float  # of the flange to either side [m]


def klingel(wheelset: Wheelset, conicity: float) -> float:
    r"""Wavelength of the free lateral motion of a wheelset by Klingel's formula [m].

    .. math:: L = 2 \pi \sqrt{r_0 l / \lambda}

    with the wheel radius :math:`r_0`, half the distance l of the running circles and
    the equivalent conicity :math:`\lambda`, which is at least `LEAST_CONICITY`.
    """
    return float(
        2.0
        * np.pi
        * np.sqrt(wheelset.radius * wheelset.half_span / max(conicity, LEAST_CONICITY))
    )


def creep_coefficients(
    wheelset: Wheelset, counterface: Counterface, models: ContactModels, load: float
) -> tuple[float, float]:
    """Longitudinal and lateral creep coefficient of a wheel at the track centre [N]."""
    creepage = 1e-5 * np.array(
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]
    )
    conditions = ContactConditions.of(np.zeros(4), wheel_load=load, creepage=creepage)
    solution = solve(conditions, wheelset, counterface, models, sides=(0,))
    along, across = solution.force_x, solution.force_y
    return float((along[1] - along[0]) / 2e-5), float((across[3] - across[2]) / 2e-5)


_YAW_STIFFNESS = {"kinematic": 0.0, "guided": 1e12}
"""Yaw stiffness of the primary suspension prescribed by the motion [N m/rad].

It replaces the stiffness of the vehicle.
"""


def resting(vehicle: Vehicle, motion: Motion, wheelset: Wheelset) -> FloatArray:
    """Lateral position and yaw (2, 2) of both axles at rest on straight track [m, rad].

    Not 0 where the wheels differ in diameter, D, or the axles are not parallel: the
    springs balance the lateral force 2 f22 psi and the moment -2 f11 l (lambda y +
    D/4)/r0 of each axle.
    """
    held = replace(
        vehicle, yaw_stiffness=_YAW_STIFFNESS.get(motion.rule, vehicle.yaw_stiffness)
    )
    turning = -2.0 * motion.creep[0] * wheelset.half_span / wheelset.radius
    contact = np.kron(
        np.eye(2), [[0.0, 2.0 * motion.creep[1]], [turning * motion.conicity, 0.0]]
    )
    still = np.zeros(1)
    force = suspension(held, np.zeros((1, 4)), still, still, still)[0]
    force[1::2] += turning * wheelset.diameter_difference / 4.0
    slope = contact + spring_slope(held)
    if turning == 0.0:  # nothing centres a bogie with independent wheels
        state: FloatArray = np.linalg.lstsq(slope, -force)[0]
    else:
        state = np.linalg.solve(slope, -force)
    return state.reshape(2, 2)


def yaw_over_shift(
    vehicle: Vehicle, motion: Motion, wheelset: Wheelset
) -> tuple[np.complex128, np.complex128]:
    """Yaw over lateral position of leading and trailing axle on straight track [rad/m].

    The ratio is complex: the prescribed motion has a phase against the path.
    """
    frequency, half, radius = (
        2.0 * np.pi / motion.wavelength,
        wheelset.half_span,
        wheelset.radius,
    )
    if motion.rule in ("guided", "shifted"):
        return np.complex128(0.0), np.complex128(0.0)
    stiffness = _YAW_STIFFNESS.get(motion.rule, vehicle.yaw_stiffness)
    a, ky, creep = (
        vehicle.half_wheelbase,
        vehicle.lateral_stiffness,
        2.0 * motion.creep[0],
    )
    path = np.exp(1j * frequency * a * np.array([1.0, -1.0]))
    frame = 2.0 * a * a * ky + 2.0 * stiffness
    diagonal = 1j * frequency * creep * half**2 + stiffness
    matrix = (
        np.array([[diagonal, 0.0], [0.0, diagonal]]) - stiffness * stiffness / frame
    )
    steering = -creep * half * motion.conicity / radius * path
    excitation = steering + stiffness * a * ky * (path[0] - path[1]) / frame
    leading, trailing = np.linalg.solve(matrix, excitation) / path
    return np.complex128(leading), np.complex128(trailing)


def _positions(
    tangent: Tangent, motion: Motion
) -> tuple[NDArray[np.complex128], FloatArray]:
    """Lateral positions (k,) of the motion on straight track, their phases and weights.

    Positions are clipped at the flange.
    """
    node, weight = np.polynomial.laguerre.laggauss(_AMPLITUDES)
    size = np.minimum(tangent.std * np.sqrt(2.0 * node), WITHIN * motion.clearance)
    phase = 2.0 * np.pi * (np.arange(_PHASES) + 0.5) / _PHASES
    path = np.repeat(size, _PHASES) * np.exp(1j * np.tile(phase, _AMPLITUDES))
    return path, np.repeat(weight, _PHASES) / _PHASES


def route(
    track: Sequence[Track],
    vehicle: Vehicle,
    shares: AxleShares,
    motions: Sequence[Motion],
    wheelset: Wheelset,
    rotation: str = "free",
) -> OperatingPoints:
    """Operating points of one wheelset of a vehicle on all track classes.

    A curve has those of the leading and the trailing axle of a bogie, in both running
    directions of the train; their positions follow from the balance of the bogie
    (`wearsim.operation.bogie`). Where the car body couples the bogies, the leading and
    the trailing axle are those of two bogies. Shares of 0 are solved and do not wear.
    `motions` are those on each pair of rails; `rotation` is the rule of
    `ContactConditions`.
    """
    total = sum(segment.share for segment in track)
    runs: list[dict[str, Any]] = []
    leading: list[
        tuple[int, float, float]
    ] = []  # run, acceleration, whether its bogie is in front
    for rail, motion in enumerate(motions):
        states = [
            (k, segment, *track_state)
            for k, segment in enumerate(track)
            for track_state in segment.on(rail)
        ]
        for k, segment, part, words, changes in states:
            common = {
                "name": segment.name,
                "speed": segment.speed,
                "friction": segment.friction,
                **changes,
                "environment": segment.environment,
                "share": part * segment.share / total,
                "of_track": k,
                "axle_load": vehicle.axle_load,
            }
            if isinstance(segment, Tangent):
                runs += [
                    {
                        **common,
                        "label": (
                            f"{segment.name}{words} {1e3 * set_points['shift']:+.2f} mm"
                        ),
                        **set_points,
                    }
                    for set_points in _on_straight(
                        segment, vehicle, shares, motion, wheelset
                    )
                ]
                continue
            assert isinstance(segment, Curve)
            for turned, of_turned in (
                (1.0, 1.0 - shares.turned),
                (-1.0, shares.turned),
            ):
                acceleration = turned * segment.acceleration
                for front, of_axles in (
                    _bogies(vehicle, shares) if of_turned > 0.0 else ()
                ):
                    leading.append((len(runs), acceleration, front))
                    for axle, of_axle in zip(
                        ("leading", "trailing"), of_axles, strict=True
                    ):
                        runs.append(
                            {
                                **common,
                                "label": (
                                    f"{segment.name}{words}"
                                    f"{'' if turned > 0.0 else ' turned'} {axle}"
                                ),
                                "name": f"{segment.name} {axle}",
                                "part": of_turned * of_axle,
                                "track_curvature": turned * segment.curvature,
                                "box_moment": float(
                                    vehicle.box_moment(
                                        np.array(acceleration), wheelset.radius
                                    )
                                ),
                            }
                        )
    weight = np.array([run["share"] * run["part"] for run in runs], dtype=float)
    label, names = (tuple(str(run[key]) for run in runs) for key in ("label", "name"))
    points = points_of(
        runs,
        {"rotation": rotation, "free_roll": True},
        weight / weight.sum(),
        label,
        names,
    )
    points = replace(points, of_track=tuple(run["of_track"] for run in runs))
    if not leading:
        return points
    number, of_bogie, in_front = np.array(leading).T
    first = number.astype(np.int64)
    pairs = Bogies(vehicle, first, first + 1, of_bogie, in_front)
    return replace(points, controlled=Controlled(np.full(weight.size, np.nan), pairs))


def _bogies(
    vehicle: Vehicle, shares: AxleShares
) -> list[tuple[float, tuple[float, float]]]:
    """Bogies in a curve: running order and the shares of leading and trailing axle."""
    front, leading, trailing = (
        1.0 if shares.outer else -1.0,
        shares.leading,
        1.0 - shares.leading,
    )
    if vehicle.secondary_yaw_stiffness == 0.0:
        return [(front, (leading, trailing))]
    apart = [(front, (leading, 0.0)), (-front, (0.0, trailing))]
    return [bogie for bogie in apart if sum(bogie[1]) > 0.0]


def _on_straight(
    tangent: Tangent,
    vehicle: Vehicle,
    shares: AxleShares,
    motion: Motion,
    wheelset: Wheelset,
) -> list[dict[str, Any]]:
    """Set-points of both axles on a class of straight track, one after the other."""
    frequency = 0.0 if motion.rule == "shifted" else 2.0 * np.pi / motion.wavelength
    furthest, (path, weight), set_points = (
        WITHIN * motion.clearance,
        _positions(tangent, motion),
        [],
    )
    parts, ratios = (
        (shares.leading, 1.0 - shares.leading),
        yaw_over_shift(vehicle, motion, wheelset),
    )
    for part, ratio, (place, turned) in zip(
        parts, ratios, resting(vehicle, motion, wheelset), strict=True
    ):
        yaw = ratio * path
        columns = {
            "part": part * weight,
            "shift": np.clip(place + path.real, -furthest, furthest),
            "yaw": turned + yaw.real,
            "drift": (1j * frequency * path).real,
            "track_curvature": (1j * frequency * yaw).real,
            "curve_curvature": np.zeros(path.size),
        }
        if part > 0.0:
            set_points += [
                {name: column[k] for name, column in columns.items()}
                for k in range(path.size)
            ]
    return set_points


def reduced(
    segments: Sequence[Curve | Tangent],
    worn: Callable[[Sequence[Curve | Tangent]], FloatArray],
    tolerance: float,
) -> tuple[tuple[Curve | Tangent, ...], float]:
    """Reduce track segments to the fewest classes within a tolerance of the wear.

    The wear of each different segment is calculated once, of at most `MOST_SEGMENTS`.
    Segments that wear the wheels by like depths at like places form a class; set-points
    count where the wear does not distinguish. The wear of a class is calculated from
    the mean of the set-points.

    Parameters
    ----------
    segments : sequence of Curve or Tangent
        Their shares are lengths.
    worn : callable
        Wear increment (k, 2, g) of each of `k` classes or segments over the grid across
        the wheels, for the distance they run.
    tolerance : float
        Largest difference of the sums of the increments of these segments and of the
        classes, over the largest value of the former [-].

    Returns
    -------
    tuple of Curve or Tangent
        Curves to the right, to the left and straight track apart; each is the mean of
        its segments by length.
    float
        The difference reached, which is above the tolerance if `MOST_CLASSES` do not
        do.
    """
    kind = np.array(
        [
            1 + (segment.curvature > 0.0) if isinstance(segment, Curve) else 0
            for segment in segments
        ]
    )
    common = {"name", "share", "torques", "rails", "lubricated"}
    names = sorted(
        {field.name for segment in segments for field in fields(segment)} - common
    )
    segments, kind = _united(segments, kind, names)
    length = np.array([segment.share for segment in segments])
    of_each = worn(segments)
    whole = of_each.sum(axis=0)
    wear = unit_spread(wear_and_place(of_each / length[:, None, None]), length)
    set_points = unit_spread(_table(segments, names), length)
    features = np.concatenate([wear, _SET_POINTS * set_points], axis=1)
    work = of_each.sum(axis=(1, 2))
    error, made = np.inf, tuple(segments)
    for count in _COUNTS:
        group = bisected(features, work, count, kind)
        made = tuple(
            _mean(segments, names, np.flatnonzero(group == k))
            for k in range(int(group.max()) + 1)
        )
        error = binning_error(np.stack([whole, worn(made).sum(axis=0)]))
        if error <= tolerance or len(made) < count:  # no class is left to divide
            break
    order = sorted(
        range(len(made)),
        key=lambda k: (-getattr(made[k], "curvature", -np.inf), made[k].name),
    )
    return tuple(made[k] for k in order), error


def _united(
    segments: Sequence[Curve | Tangent], kind: IntArray, names: Sequence[str]
) -> tuple[tuple[Curve | Tangent, ...], IntArray]:
    """Unite segments of equal set-points, and near ones beyond `MOST_SEGMENTS`.

    Returns
    -------
    tuple of Curve or Tangent
        Different segments; their shares are the lengths of all that they stand for.
    (n,) int array
        The kind of each, from those of the segments.
    """
    length = np.array([segment.share for segment in segments])
    scaled = unit_spread(_table(segments, names), length)
    # sharp curves wear most
    bent = np.array([abs(getattr(segment, "curvature", 0.0)) for segment in segments])
    work = length * (0.1 + bent / max(bent.max(), 1e-300))
    group = bisected(scaled, work, MOST_SEGMENTS, kind)
    members = [np.flatnonzero(group == k) for k in range(int(group.max()) + 1)]
    united = tuple(_mean(segments, names, rows) for rows in members)
    return united, kind[[rows[0] for rows in members]]


def _table(segments: Sequence[Curve | Tangent], names: Sequence[str]) -> FloatArray:
    """Set-points (n, k) of segments, 0 where a kind of segment lacks one."""
    return np.array(
        [[getattr(segment, name, 0.0) for name in names] for segment in segments]
    )


def _mean(
    segments: Sequence[Curve | Tangent], names: Sequence[str], rows: IntArray
) -> Curve | Tangent:
    """Mean class of the segments `rows`, all curves or all straight."""
    length = np.array([segments[k].share for k in rows])
    first, values = segments[int(rows[0])], dict[str, Any]()
    for name in (key for key in names if hasattr(first, key)):
        set_point = np.array([getattr(segments[k], name) for k in rows])
        values[name] = float(
            set_point[0]
            if np.ptp(set_point) == 0.0
            else np.average(set_point, weights=length)
        )
    name = "straight"
    if isinstance(first, Curve):
        name = (
            f"R {abs(1.0 / values['curvature']):.0f} "
            f"{'right' if values['curvature'] > 0.0 else 'left'}"
        )
    return replace(
        first,
        **values,
        name=f"{name} {3.6 * values['speed']:.0f} km/h",
        share=float(length.sum()),
    )
