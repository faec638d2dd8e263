"""Candidates of a rig programme: set-points and ramps, and what they wear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.rate import wear_rate
from wearsim.campaign.vertices import smoothed_sides
from wearsim.contact.problem import Counterface, Wheelset
from wearsim.operation.points import OperatingPoints
from wearsim.operation.states import Running, settle_rows
from wearsim.profile.shape import vertex_lengths
from wearsim.scene import RigScene
from wearsim.scene.prepared import contact_models, points_on_rig
from wearsim.scene.section import si_name
from wearsim.scene.set_points import SetPoints
from wearsim.translation.guard import (
    by_zone,
    extreme_rows,
    in_all_zones,
    regime_rows,
    scaled,
    zone_of,
)
from wearsim.translation.programme import Problem
from wearsim.translation.target import Stage

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PLACED = 1e-3  # of the largest rate: below it a place counts only if it has a target
_LEAST_TARGET = 0.05e-6  # depth of a place that counts in any case [m]
_EVERY = 2  # shifts between the ends of ramps


@dataclass(frozen=True)
class Candidates:
    """Set-points (s shifts or forces, a yaws, l loads), and the ramps among them.

    A candidate runs evenly over the shifts from `first` to `last`, which are the same
    where it is no ramp.
    """

    set_points: SetPoints
    first: IntArray  # (n,) index of the shift, or of the lateral force
    last: IntArray  # (n,)
    yaw: IntArray  # (n,) index of the yaw angle
    load: IntArray  # (n,) index of the load

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of shifts or forces, yaw angles and loads."""
        set_points = self.set_points
        return set_points.lateral.size, set_points.yaw.size, set_points.load.size

    def lateral(self, k: int) -> tuple[float, float]:
        """Shift [m] or force [N] at the beginning and at the end of a candidate."""
        set_points, half = self.set_points, 0.5 * self.set_points.step
        low, high = (
            float(set_points.lateral[index[k]]) for index in (self.first, self.last)
        )
        return (
            (low, high) if self.first[k] == self.last[k] else (low - half, high + half)
        )

    def points(self, scene: RigScene) -> OperatingPoints:
        """Operating points of all set-points, by the rules of a scene."""
        set_points = self.set_points
        grid = np.meshgrid(
            set_points.lateral, set_points.yaw, set_points.load, indexing="ij"
        )
        return points_at(scene, set_points, *(axis.ravel() for axis in grid))

    def means(self, values: FloatArray) -> FloatArray:
        """Mean over the shifts of each candidate: (set-points, ...) to (n, ...)."""
        grid = values.reshape(*self.shape, *values.shape[1:])
        sums = np.concatenate([np.zeros((1, *grid.shape[1:])), np.cumsum(grid, axis=0)])
        # a single set-point exactly: sums would leave rounding
        means = grid[self.first, self.yaw, self.load]
        ramp = np.flatnonzero(self.first != self.last)
        yaw, load = self.yaw[ramp], self.load[ramp]
        count = (self.last - self.first + 1)[ramp]
        part = sums[self.last[ramp] + 1, yaw, load] - sums[self.first[ramp], yaw, load]
        means[ramp] = part / count.reshape(-1, *[1] * (part.ndim - 1))
        return means


def points_at(
    scene: RigScene,
    set_points: SetPoints,
    lateral: FloatArray,
    yaw: FloatArray,
    load: FloatArray,
) -> OperatingPoints:
    """Operating points at shifts [m] or forces [N], yaws [rad] and loads [N] (n,)."""
    block = scene.operation.blocks[0].si()
    common = {si_name(key): block[si_name(key)] for key in set_points.stated}
    common |= {"speed": set_points.speed, "friction": set_points.friction}
    place = "lateral_force" if set_points.by_force else "shift"
    runs = [
        {place: a, "yaw": b, "load": c, **common}
        for a, b, c in zip(lateral.tolist(), yaw.tolist(), load.tolist(), strict=True)
    ]
    return points_on_rig(scene, runs)


def candidates_of(set_points: SetPoints, *, ramps: bool = True) -> Candidates:
    """All set-points, and the ramps between every second shift."""
    count = set_points.lateral.size
    pairs = [(k, k) for k in range(count)]
    if ramps and not set_points.by_force:
        ends = range(0, count + 1, _EVERY)
        pairs += [(a, b - 1) for a in ends for b in ends if b > a + 1]
    yaw, load = set_points.yaw.size, set_points.load.size
    first, last = np.array(pairs, dtype=np.int64).T
    of_pair, of_yaw, of_load = np.meshgrid(
        np.arange(len(pairs)), np.arange(yaw), np.arange(load), indexing="ij"
    )
    at = of_pair.ravel()
    return Candidates(set_points, first[at], last[at], of_yaw.ravel(), of_load.ravel())


@dataclass(frozen=True)
class Wear:
    """Wear depth per distance of the candidates on given wheels [m/m]."""

    candidates: Candidates
    solved: NDArray[np.bool_]  # (n,) candidates with contact solutions throughout
    depth: FloatArray  # (n, 2, v) smooth depth rate [m/m]
    y: FloatArray  # (2, v) wheels [m]
    worn: FloatArray  # (set-points, 2, regimes, zones) area rate [m2/m]
    at: IntArray  # (set-points, 2) zone of the deepest place of each wheel
    pressure: FloatArray  # (set-points, 2) largest one of each wheel [Pa]
    wear_index: FloatArray  # (set-points, 2) [Pa]
    shakedown: FloatArray  # (set-points, 2) `shakedown_yield` [Pa]
    running: Running | None = None  # of set-points by lateral force

    def guard(self, stage: Stage, guard: float) -> FloatArray:
        """Rows (q, n) that keep the mechanism of a stage within the guard."""
        if not guard or stage.pressure is None:
            return np.zeros((0, self.solved.size))
        # as in the field, the whole wear of a contact counts where the contact is
        zones = np.arange(self.worn.shape[-1])
        area = self.worn.sum(axis=(2, 3))[:, :, None] * (self.at[:, :, None] == zones)
        pairs = (
            (self.pressure, stage.pressure),
            (self.wear_index, stage.wear_index),
            (self.shakedown, stage.shakedown),
        )
        rows = [
            extreme_rows(area, of_candidates, guard * in_all_zones(of_field))
            for of_candidates, of_field in pairs
            if of_field is not None
        ]
        # none of zones that the field does not wear: it has no share to keep there
        if stage.regimes is not None:
            rows.append(regime_rows(self.worn.sum(axis=1), stage.regimes))
        return scaled(self.candidates.means(np.concatenate(rows).T).T)

    def problem(
        self, target: FloatArray, stage: Stage, guard: float
    ) -> tuple[Problem, IntArray, IntArray]:
        """Problem of the solved candidates, their numbers, and which are no ramps.

        `target` (2, v) is the depth still to be worn [m]. Places that hardly wear under
        any candidate, and need not, are left out.
        """
        chosen = np.flatnonzero(self.solved)
        rates = self.depth[chosen].reshape(len(chosen), -1).T
        largest, needed_depth = rates.max(axis=1), np.abs(target.ravel())
        counts = (largest > _PLACED * rates.max()) | (needed_depth > _LEAST_TARGET)
        speed = self.candidates.set_points.speed
        problem = Problem(
            np.ascontiguousarray(rates[counts]),
            target.ravel()[counts],
            np.full(len(chosen), 1.0 / speed),
            self.guard(stage, guard)[:, chosen],
        )
        is_single = self.candidates.first == self.candidates.last
        return problem, chosen, np.flatnonzero(is_single[chosen])


def wear_of(
    candidates: Candidates,
    scene: RigScene,
    bodies: tuple[Wheelset, Counterface],
    start: Running | None = None,
) -> Wear:
    """Solve all set-points on given bodies, each wear curve smoothed alone.

    Those by lateral force are searched from `start`, by default the track centre. They
    count as not solved without a balance, and where the contact forces jump across it.
    """
    points, running = candidates.points(scene), None
    conditions, lost = points.conditions, np.zeros(0, dtype=np.int64)
    if points.controlled is not None:
        models = contact_models(scene.contact)
        running, lost = settle_rows(
            conditions, points.controlled, *bodies, models, start
        )
        conditions = running.conditions(conditions)
        if running.beyond is not None:
            lost = np.union1d(lost, running.beyond.point)
    wheels = bodies[0].right, bodies[0].left
    rate = wear_rate(
        scene, conditions, profiles=wheels, counterface=bodies[1], leave_out=True
    ).transpose("operating_point", "wheel", "regime", "point")
    y, z = rate["profile_y"].values, rate["profile_z"].values
    by_regime = np.nan_to_num(rate["wear_depth_rate"].values)
    by_regime *= candidates.set_points.environment
    length = np.stack([vertex_lengths(*profile) for profile in zip(y, z, strict=True)])
    worn = np.stack(
        [by_zone(y[k], by_regime[:, k] * length[k]) for k in (0, 1)], axis=1
    )
    wavelength = 1e-3 * scene.campaign.smoothing_wavelength_mm
    total = np.ascontiguousarray(np.moveaxis(by_regime.sum(axis=2), 1, 0))
    smooth = np.moveaxis(smoothed_sides(y, z, total, wavelength), 0, 1)
    pressure, index = rate["max_pressure"].values, rate["wear_index_max"].values
    solved = np.isfinite(pressure).all(axis=1)
    solved[lost] = False
    return Wear(
        candidates,
        candidates.means(solved.astype(float)) > 1.0 - 1e-9,
        candidates.means(smooth),
        y,
        worn,
        np.stack([zone_of(y[k])[smooth[:, k].argmax(axis=1)] for k in (0, 1)], axis=1),
        np.nan_to_num(pressure),
        np.nan_to_num(index),
        np.nan_to_num(rate["shakedown_yield"].values),
        running,
    )
