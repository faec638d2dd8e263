r"""Recorded runs: samples of a simulated or measured run, reduced to operating points.

Each sample represents the distance run around it. Samples are divided by recursive
bisection: the group that varies most, weighted with the wear of its samples, is divided
at its mean across the quantity that varies most.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.contact.friction import TREAD_ANGLE
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.damage.wear import WearSettings, passage_depth
from wearsim.errors import ContactError
from wearsim.operation.controlled import Controlled
from wearsim.operation.smoothed_motion import (
    SmoothedMotion,
    curing_wavelength,
    default_wavelength,
    smoothed_motion,
)
from wearsim.operation.states import StateError, settle

MOST_SAMPLES = 16384
"""Largest number of samples; longer records are represented by evenly spread ones."""
_COUNTS = (8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
"""Numbers of operating points that are tried until the binning error is small."""

_SLOWEST = 0.1  # speed below which a wheelset counts as stopped [m/s]
_MOST_UNBALANCED = 0.05  # of samples whose force no shift balances
_GAP = 10.0  # a gap is longer than this many median distances in time or space
_SAMPLED = 1.0  # sample distance that resolves a lateral motion of some metres [m]
_CREEPAGE = 0.5e-3  # least lateral creepage with which that of noise is compared [-]
_NOISY = (
    0.05  # square of the creepage by noise over that of the motion, of which to warn
)
_GRID = 0.25e-3  # grid of the wear increments across the wheel [m]
_GROUPS = ("tread", "right flange", "left flange")


@dataclass(frozen=True)
class Samples:
    """Samples of a run: values (n,) by quantity [SI] and the distance of each [m]."""

    values: Mapping[str, FloatArray]
    distance: FloatArray
    notes: tuple[str, ...] = ()

    @property
    def matrix(self) -> FloatArray:
        """Values (n, k) of all quantities that act in the contact."""
        acting = [v for name, v in self.values.items() if name != "curve_curvature"]
        return np.stack(acting, axis=1)

    def at(self, index: IntArray) -> Samples:
        """Return the samples at `index`, in that order."""
        values = {name: value[index] for name, value in self.values.items()}
        return replace(self, values=values, distance=self.distance[index])


def samples_of(
    values: Mapping[str, FloatArray], wavelength: float | None = None
) -> Samples:
    """Weight samples by the distance around each.

    Where the sampling resolves the motion, shift and yaw are smoothed, and their rates
    are added: the drift, and the yaw rate as curvature. The curvature of the track
    itself is kept as `curve_curvature`.

    Parameters
    ----------
    values : mapping
        (n,) values by quantity: `time` [s] or `place` [m], rising, `speed` [m/s] and
        others [SI].
    wavelength : float, optional
        Below which shift and yaw are smoothed [m]; by default that of
        `smoothed_motion.default_wavelength`.

    Raises
    ------
    ValueError
        If there is no distance: neither time nor place rises.

    Notes
    -----
    Samples at standstill do not count; over a gap no distance is run.
    """
    others = {
        name: value for name, value in values.items() if name not in ("time", "place")
    }
    along = values["place"] if "place" in values else values["time"]
    steps = np.diff(along)
    if steps.size == 0 or not (steps > 0.0).all():
        name = "the distance" if "place" in values else "the time"
        raise ValueError(f"{name} does not rise from sample to sample")
    notes = []
    usual = float(np.median(steps))
    gaps = steps > _GAP * usual
    if gaps.any():
        notes.append(
            f"{int(gaps.sum())} gaps between samples, over which no distance is run"
        )
    steps = np.where(gaps, usual, steps)
    distance = 0.5 * (np.append(steps, steps[-1]) + np.insert(steps, 0, steps[0]))
    speed = np.abs(others["speed"])
    if "place" not in values:
        distance = distance * speed
    still = speed < _SLOWEST
    if still.any():
        share = 100.0 * still.mean()
        notes.append(f"{share:.3g} % of the samples stand still and do not count")
    spacing = float(np.median(distance[~still])) if not still.all() else 0.0
    if spacing <= 0.0:
        raise ValueError("no distance is run")
    kept = {name: value[~still] for name, value in others.items()}
    distance = distance[~still]
    if spacing <= _SAMPLED:
        piece = np.cumsum(np.insert(gaps, 0, False).astype(np.int64))[~still]
        run = np.cumsum(distance) - 0.5 * distance
        length = default_wavelength(spacing) if wavelength is None else wavelength
        notes += _with_rates(kept, run, piece, length)
    else:
        notes.append(
            f"samples are {spacing:.3g} m apart: lateral and yaw velocities are not "
            "known, the wheelset is taken as one at rest"
        )
    return Samples(kept, distance, tuple(notes))


def _with_rates(
    values: dict[str, FloatArray], run: FloatArray, piece: IntArray, wavelength: float
) -> list[str]:
    """Smooth shift and yaw in `values` and add their rates; return notes on noise.

    The yaw less the drift, and the curvature plus the yaw rate act in the contact.
    """
    zero, motions = np.zeros(run.size), dict[str, SmoothedMotion]()
    values["curve_curvature"] = values.get("track_curvature", zero)
    for name, rate in (("shift", "drift"), ("yaw", "track_curvature")):
        if name in values:
            motion = smoothed_motion(run, values[name], piece, wavelength)
            values[name] = motion.value
            values[rate] = values.get(rate, zero) + motion.rate
            motions[name] = motion
    if "shift" not in motions:
        return []
    slip = values.get("yaw", zero) - values["drift"]
    usual = max(float(np.sqrt(np.mean(slip**2))), _CREEPAGE)
    motion = motions["shift"]
    if motion.rough_rate**2 <= _NOISY * usual**2:
        return []
    note = (
        f"the shift has noise of {1e3 * motion.noise:.2g} mm rms in waves below "
        f"{wavelength:.3g} m: differences of samples would add "
        f"{1e3 * motion.rough_rate:.2g} mrad rms to the lateral creepage, the smoothed "
        f"record adds {1e3 * motion.left_rate:.1g} mrad"
    )
    if motion.left_rate**2 > _NOISY * usual**2:
        longer = curing_wavelength(motion, wavelength, np.sqrt(_NOISY) * usual)
        note += f"; write smooth_m = {np.ceil(10.0 * longer) / 10.0:g}"
    return [note]


def merged(samples: Samples, group: IntArray) -> Samples:
    """Mean of the samples of each group (n,), weighted by distance.

    Groups count from 0.
    """
    weight = np.bincount(group, samples.distance).astype(float)
    values = {
        name: np.bincount(group, samples.distance * value) / weight
        for name, value in samples.values.items()
    }
    return Samples(values, weight, samples.notes)


def bisected(
    values: FloatArray, weight: FloatArray, count: int, start: IntArray
) -> IntArray:
    """Divide samples into at most `count` groups.

    Parameters
    ----------
    values : (n, k) array
        Scaled so that unit differences are alike in all columns.
    weight : (n,) array
        Of the samples.
    count : int
        Of groups; at least those of `start` come back.
    start : (n,) int array
        Groups that are never joined, counted from 0.

    Returns
    -------
    (n,) int array
        Group of each sample, counted from 0. It depends on the order of the samples by
        its numbers alone.
    """
    group = np.unique(start, return_inverse=True)[1]

    def weigh(rows: IntArray) -> tuple[float, int, float]:
        part, share = values[rows], weight[rows]
        total = share.sum()
        if rows.size < 2 or total <= 0.0:
            return 0.0, 0, 0.0
        mean = (share[:, None] * part).sum(axis=0) / total
        above = part > mean
        # values equal up to rounding must fall on one side of their mean
        divisible = above.any(axis=0) & ~above.all(axis=0)
        variance = np.where(
            divisible, (share[:, None] * (part - mean) ** 2).sum(axis=0), 0.0
        )
        column = int(np.argmax(variance))
        return float(variance[column]), column, float(mean[column])

    spread = [weigh(np.flatnonzero(group == k)) for k in range(int(group.max()) + 1)]
    while len(spread) < count:
        worst = max(range(len(spread)), key=lambda k: (spread[k][0], -k))
        variance, column, mean = spread[worst]
        rows = np.flatnonzero(group == worst)
        upper = rows[values[rows, column] > mean]
        if variance <= 0.0:
            break
        group[upper] = len(spread)
        spread[worst] = weigh(rows[values[rows, column] <= mean])
        spread.append(weigh(upper))
    return group


@dataclass(frozen=True)
class Reduction:
    """Operating points of a record."""

    points: Samples
    group: tuple[str, ...]  # of each point: tread, right or left flange
    # (2, 2, g) by all samples and by the points, see `Reducer.increment` [m]
    increments: FloatArray
    samples: int  # number of samples of the record
    kept: Samples  # selected samples that represent all
    reducer: Reducer

    @property
    def error(self) -> float:
        """Binning error of the reduction [-]."""
        return binning_error(self.increments)

    def increments_on(self, wheelset: Wheelset) -> FloatArray:
        """Increments (2, 2, g) with other wheels, such as worn ones [m]."""
        reducer = replace(self.reducer, wheelset=wheelset, across=self.reducer.grid)
        return np.stack(
            [reducer.increment(samples) for samples in (self.kept, self.points)]
        )


@dataclass(frozen=True)
class Reducer:
    """Bodies, models and laws by which samples are weighted.

    The fastest models are used, because the error compares samples and points with the
    same models.
    """

    wheelset: Wheelset
    counterface: Counterface
    models: ContactModels
    wear: WearSettings
    wavelength: float  # of the smoothing of wear increments [m]
    threads: int = 1
    across: FloatArray | None = (
        None  # grid of the increments, by default over the width of the wheels [m]
    )

    @property
    def grid(self) -> FloatArray:
        """Lateral positions (g,) on the wheels at which increments are given [m]."""
        if self.across is not None:
            return self.across
        width = np.concatenate(
            [wheel.y for wheel in (self.wheelset.right, self.wheelset.left)]
        )
        return width.min() + _GRID * np.arange(int(np.ceil(np.ptp(width) / _GRID)) + 1)

    def conditions(self, samples: Samples) -> ContactConditions:
        """Contact conditions of samples, free to roll."""
        value = dict(samples.values)
        load = np.stack(
            [value.pop(f"wheel_load_{side}") for side in ("right", "left")], axis=1
        )
        names = ("shift", "yaw", "roll", "speed", "friction", "track_curvature")
        zero = np.zeros(samples.distance.size)
        given: dict[str, Any] = {name: value.get(name, zero) for name in names}
        given |= {
            name: value[name] for name in ("friction_flange", "drift") if name in value
        }
        if "axle_torque" in value:
            given["torque"] = value["axle_torque"]
        if "lateral_force" in value:  # its shift is that at the height of the rails
            given["shift_depth"] = np.full(zero.size, self.wheelset.radius)
        return ContactConditions(wheel_load=load, free_roll=True, **given)

    def increment(self, samples: Samples) -> FloatArray:
        """Smoothed wear depth (2, g) of both wheels in one passage [m].

        It is the mean of all samples.
        """
        return _mean_of(samples, self.worn(self.conditions(samples))[0])

    def worn(
        self,
        conditions: ContactConditions,
        failed: dict[int, ContactError] | None = None,
    ) -> tuple[FloatArray, IntArray]:
        """Wear of both wheels per distance (n,), and the flange in contact.

        Parameters
        ----------
        conditions : ContactConditions
            Of `n` points.
        failed : dict, optional
            Gets the reason of each point without contact solution, which does not wear.

        Returns
        -------
        depth : (n, 2, g) array
            In one passage, over the grid across the wheel, smoothed [m].
        flange : (n,) int array
            0 tread, 1 right flange, 2 left flange.
        """
        low, size = self.grid[0], self.grid.size
        count = conditions.shift.size
        depth, flange = np.zeros((count, 2, size)), np.zeros(count, dtype=np.int64)
        kernel = _half(self.wavelength)

        def keep(solution: ContactSolution) -> tuple[Any, ...]:
            strips = np.sum(
                passage_depth(solution.fields, solution.area, self.wear), axis=0
            )
            edges = solution.strip_edges_wheel_y
            middle = 0.5 * (edges[:, 1:] + edges[:, :-1])
            place = np.clip(
                ((middle - low) / _GRID).round().astype(np.int64), 0, size - 1
            )
            spread = strips * (solution.patch.width[:, None] / _GRID)
            return solution.point, solution.side, place, spread, solution.contact_angle

        failed = {} if failed is None else failed
        chunks = solve_each(
            conditions,
            self.wheelset,
            self.counterface,
            self.models,
            keep,
            threads=self.threads,
            failed=failed,
            fields=self.wear.needs_fields or "work",
        )
        for point, side, place, spread, angle in chunks:
            np.add.at(depth, (point[:, None], side[:, None], place), spread)
            steep = np.abs(angle) > TREAD_ANGLE
            flange[point[steep]] = 1 + side[steep]
        for wheel in (0, 1):
            depth[:, wheel] = np.apply_along_axis(
                np.convolve, 1, depth[:, wheel], kernel, mode="same"
            )
        return depth, flange


def thinned(samples: Samples) -> Samples:
    """Return the samples, of more than `MOST_SAMPLES` evenly spread ones.

    They are not merged: a mean of tread and flange contact is neither.
    """
    total = samples.distance.size
    if total <= MOST_SAMPLES:
        return samples
    kept = np.linspace(0, total - 1, MOST_SAMPLES).round().astype(np.int64)
    return samples.at(kept)


def with_shifts(samples: Samples, reducer: Reducer) -> Samples:
    """Find the shifts at which the lateral forces of samples are balanced [m].

    Parameters
    ----------
    samples : Samples
        With `lateral_force`, that on the wheelset at axle height, to the right [N].
    reducer : Reducer
        Bodies and models.

    Returns
    -------
    Samples
        Without those whose force no shift balances, with a note on their share.

    Raises
    ------
    StateError
        The forces of more than 5 % of the samples are balanced by no shift.
    """
    samples = thinned(samples)
    count = samples.distance.size
    still = replace(samples, values={**samples.values, "shift": np.zeros(count)})

    def shifts(some: Samples) -> FloatArray:
        forces = Controlled(some.values["lateral_force"])
        running = settle(
            reducer.conditions(some),
            forces,
            reducer.wheelset,
            reducer.counterface,
            reducer.models,
            threads=reducer.threads,
        )
        return running.shift

    try:
        return replace(still, values={**still.values, "shift": shifts(still)})
    except StateError as error:
        share = len(error.messages) / count
        if share > _MOST_UNBALANCED:
            raise
        kept = still.at(np.setdiff1d(np.arange(count), list(error.messages)))
        values = {**kept.values, "shift": shifts(kept)}
        note = (
            f"{100.0 * share:.2g} % of the samples have a lateral force that no shift "
            "balances and are left out"
        )
        return replace(kept, values=values, notes=(*kept.notes, note))


def binning_error(increments: FloatArray) -> float:
    """Largest difference of depth increments (2, ...) of samples and points [-].

    It is relative to the greatest depth of the samples.
    """
    whole, part = increments
    return float(np.abs(part - whole).max() / max(float(whole.max()), 1e-300))


def _half(wavelength: float) -> FloatArray:
    """Weights over the grid of a Gaussian filter that halves a given wavelength."""
    if wavelength <= 0.0:
        return np.ones(1)
    deviation = np.sqrt(2.0 * np.log(2.0)) * wavelength / (2.0 * np.pi) / _GRID
    reach = int(np.ceil(4.0 * deviation))
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    return weight / weight.sum()


def reduce_samples(samples: Samples, reducer: Reducer, tolerance: float) -> Reduction:
    """Reduce samples to the fewest points with a binning error within a tolerance.

    Parameters
    ----------
    samples : Samples
        Of a record.
    reducer : Reducer
        Bodies, models and laws by which the samples are weighted.
    tolerance : float
        Largest difference of the smoothed wear increments of all samples and of the
        points, over the largest depth of those of the samples [-].

    Returns
    -------
    Reduction
        With the error reached, which 512 points may leave above the tolerance.
    """
    total = samples.distance.size
    samples = thinned(samples)
    depth, flange = reducer.worn(reducer.conditions(samples))
    whole = _mean_of(samples, depth)
    features, work = (
        _features(samples, depth),
        samples.distance * depth.sum(axis=(1, 2)),
    )
    for count in _COUNTS:
        group = bisected(features, work, count, flange)
        points = merged(samples, group)
        names = tuple(
            _GROUPS[k] for k in flange[np.unique(group, return_index=True)[1]]
        )
        both = np.stack([whole, reducer.increment(points)])
        reduction = Reduction(points, names, both, total, samples, reducer)
        if (
            reduction.error <= tolerance or points.distance.size < count
        ):  # no group is left to divide
            break
    return reduction


def _mean_of(samples: Samples, depth: FloatArray) -> FloatArray:
    """Mean (2, g) of depths (n, 2, g), weighted with the distance of the samples."""
    return np.tensordot(samples.distance / samples.distance.sum(), depth, axes=1)


def _features(samples: Samples, depth: FloatArray) -> FloatArray:
    """Features (n, k) by which samples are grouped: set-points, wear and its position.

    Each is scaled to unit spread. Set-points count half, because those that matter show
    in the wear.
    """
    columns = np.concatenate([wear_and_place(depth), samples.matrix], axis=1)
    unit = unit_spread(columns, samples.distance)
    unit[:, 4:] *= 0.5
    return unit


def wear_and_place(depth: FloatArray) -> FloatArray:
    """Worn area and mean place (n, 4) of depths (n, 2, g) on both wheels.

    The unit of area is depth times the grid distance, that of place the grid distance.
    """
    area = depth.sum(axis=2)
    place = (depth * np.arange(depth.shape[2])).sum(axis=2) / np.where(
        area > 0.0, area, 1.0
    )
    return np.concatenate([area, place], axis=1)


def unit_spread(columns: FloatArray, weight: FloatArray) -> FloatArray:
    """Columns (n, k) with mean 0 and standard deviation 1 under weights (n,).

    Columns that do not vary beyond rounding are 0.
    """
    share = (weight / weight.sum())[:, None]
    centred = columns - (share * columns).sum(axis=0)
    spread = np.sqrt((share * centred**2).sum(axis=0))
    varies = spread > 1e-9 * np.abs(columns).max(axis=0)
    unit: FloatArray = np.where(varies, centred / np.where(varies, spread, 1.0), 0.0)
    return unit
