"""Target of a rig programme: wear pattern of a field result, or of a worn wheel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.damage.fatigue.shakedown import shakedown_limit
from wearsim.errors import ResultError
from wearsim.profile.shape import Profile, vertex_lengths
from wearsim.profile.worn import wear_between
from wearsim.results import checks
from wearsim.translation.factors import at_distances
from wearsim.translation.guard import by_zone, zone_quantiles
from wearsim.translation.translate import is_reprofiled

FloatArray = NDArray[np.float64]

_FIRST_STAGES = (10e-6, 10e-6, 20e-6)  # depths of the first stages [m]
_SAME_WHEEL = 0.1e-3  # largest distance of two new wheels that count as one [m]


_LEAST_WORN = 1e-6
"""Deepest wear of a worn wheel that is a target [m]."""


@dataclass(frozen=True)
class Stage:
    """Part of a target: from one depth to a larger one [m]."""

    distance: float  # of the field at its end; NaN if unknown [m]
    depth: FloatArray  # (2, v) at its end, of right and left wheel [m]
    pressure: FloatArray | None = None  # (zones,) quantile in this part [Pa]
    wear_index: FloatArray | None = None  # (zones,) [Pa]
    shakedown: FloatArray | None = None  # (zones,) of `shakedown_yield` [Pa]
    regimes: FloatArray | None = None  # (regimes, zones) share of the wear [-]


@dataclass(frozen=True)
class Target:
    """Wear pattern at v points of both wheels over the distance of the field."""

    distance: FloatArray  # (k,) [m]
    depth: FloatArray  # (k, 2, v) [m]
    y: FloatArray  # (2, v) new wheels of the rig [m]
    z: FloatArray
    name: str
    field: xr.Dataset | None = None  # result, from 0 to the last distance at least
    regime_depth: FloatArray | None = None  # (k, 2, regimes, v) [m]
    regimes: tuple[str, ...] = ()  # names of them

    def in_order_of(self, regimes: tuple[str, ...], *, compared: bool) -> Target:
        """Return the target with its wear regimes in the order of names.

        Where the names are not those of the target, raises a ResultError if the shares
        are compared, and else leaves them out. A law of one regime has no shares.
        """
        if self.regime_depth is None or len(self.regimes) == len(regimes) == 1:
            return replace(self, regime_depth=None)
        if set(self.regimes) != set(regimes):
            if not compared:
                return replace(self, regime_depth=None)
            raise ResultError(
                "the guard compares the shares of wear regimes by their names, which "
                f"are {', '.join(self.regimes)} in the field and {', '.join(regimes)} "
                "on the rig; give the rig the wear law of the field, or guard = 0"
            )
        order = [self.regimes.index(name) for name in regimes]
        return replace(
            self, regime_depth=self.regime_depth[:, :, order], regimes=regimes
        )

    @property
    def deepest(self) -> float:
        """Largest depth at the end [m]."""
        return float(self.depth[-1].max())

    def levels(self, stage_depth: float) -> FloatArray:
        """Largest depths at the ends of the stages [m]."""
        sizes = [min(size, stage_depth) for size in _FIRST_STAGES]
        count = int(np.ceil((self.deepest - sum(sizes)) / stage_depth))
        ends = np.cumsum([*sizes, *[stage_depth] * max(count, 0)])
        least = min(0.2 * stage_depth, 0.1 * self.deepest)  # of the last stage
        within = ends[ends < self.deepest - least]
        return np.append(within, self.deepest)

    def stage(self, low: float, high: float) -> Stage:
        """Stage from a largest depth to another one [m]."""
        if self.field is None:
            share = high / self.deepest
            return Stage(share * self.distance[-1], share * self.depth[-1])
        start, end = (self._distance_of(level) for level in (low, high))
        depth = at_distances(self.distance, self.depth, np.array([end]))[0]
        rows = np.flatnonzero((self.distance >= start) & (self.distance <= end))
        if not rows.size:
            rows = np.array([int(np.abs(self.distance - end).argmin())])
        pressure, index, shakedown = self._extremes(rows)
        regimes = self._regimes(start, end)
        return Stage(end, depth, pressure, index, shakedown, regimes)

    def _distance_of(self, level: float) -> float:
        """Distance at which the deepest wear reaches a level [m]."""
        return float(
            np.interp(level, self.depth.max(axis=(1, 2)), self.distance, left=0.0)
        )

    def _extremes(self, rows: NDArray[np.int64]) -> list[FloatArray]:
        """Quantiles by zone of patches of stored states.

        They are of pressure, wear index, and the yield stress that shakedown asks for.
        """
        assert self.field is not None
        names = (
            *("wheel_y", "wear_area_rate", "max_pressure", "wear_index_max"),
            *("normal_force", "force_x", "force_y"),
        )
        patches = self.field[[*names, "weight", "environment"]].isel(step=rows)
        patches = patches.transpose("step", "operating_point", "patch", ...)
        y, area, pressure, index, *force = (patches[name].values for name in names)
        share = patches["weight"].values * patches["environment"].values
        wear = np.nan_to_num(area) * share[None, :, None]
        wearing = np.isfinite(y) & np.isfinite(pressure) & (wear > 0.0)
        normal, *shear = (component[wearing] for component in force)
        yields = pressure[wearing] / shakedown_limit(np.hypot(*shear) / normal)
        values = (pressure[wearing], index[wearing], yields)
        return [zone_quantiles(y[wearing], value, wear[wearing]) for value in values]

    def _regimes(self, start: float, end: float) -> FloatArray | None:
        """Share of each wear regime in the wear of each zone between two distances."""
        if self.regime_depth is None:
            return None
        ends = at_distances(self.distance, self.regime_depth, np.array([start, end]))
        worn = np.maximum(ends[1] - ends[0], 0.0)
        length = np.stack(
            [vertex_lengths(y, z) for y, z in zip(self.y, self.z, strict=True)]
        )
        of_zone = np.stack(
            [by_zone(self.y[k], worn[k] * length[k]) for k in (0, 1)]
        ).sum(axis=0)
        total = of_zone.sum(axis=0)
        # where the field hardly wears, shares mean nothing
        counts = total > 1e-3 * total.sum()
        return np.where(counts, of_zone / np.where(counts, total, 1.0), np.nan)

    def environment(self) -> float:
        """Mean environment factor of the field by the wear of its new wheels [-]."""
        if self.field is None:
            return np.nan
        first = self.field.isel(step=0)
        area = first["wear_area_rate"].transpose("operating_point", "patch").values
        wear = np.nansum(area, axis=1) * first["weight"].values
        return float(wear @ first["environment"].values / wear.sum())


def field_target(
    field: xr.Dataset, wheels: tuple[Profile, Profile], distance: float | None = None
) -> Target:
    """Target of a field result at a distance [m], by default its end.

    Parameters
    ----------
    field : Dataset
        Result as `wearsim.open_results` gives it.
    wheels : pair of Profile
        New wheels of the rig, with equally many points.
    distance : float, optional
        Within the distance run [m].

    Raises
    ------
    ResultError
        If the wheels were reprofiled, began as other wheels than those of the rig,
        did not wear, or did not run the distance.
    """
    if is_reprofiled(field):
        raise ResultError(
            "the wheels of the target were reprofiled; give a result without "
            "[campaign.reprofiling]"
        )
    run = field["distance"].values
    end = float(run[-1]) if distance is None else float(distance)
    checks.check_run(field, np.array([end]))
    places = np.append(run[run < end * (1.0 - 1e-9)], end)
    y, z = (np.stack([getattr(wheel, axis) for wheel in wheels]) for axis in "yz")
    new_y, new_z = (field[name].values[0] for name in ("profile_y", "profile_z"))
    for k, side in enumerate(("right", "left")):
        inside = (y[k] >= new_y[k][0]) & (y[k] <= new_y[k][-1])
        apart = np.abs(np.interp(y[k], new_y[k], new_z[k]) - z[k])[inside].max()
        if apart > _SAME_WHEEL:
            raise ResultError(
                f"the {side} wheel of the target began {1e3 * apart:.2g} mm off the "
                "new wheel of the rig; give a target of the same wheel profile"
            )

    def carried(values: FloatArray) -> FloatArray:
        """Values (k, 2, ..., points of the field) at the points of the rig."""
        values = at_distances(run, values, places)
        resampled = np.empty((*values.shape[:-1], y.shape[1]))
        for place in np.ndindex(values.shape[:-1]):
            wheel = place[1]
            resampled[place] = np.interp(y[wheel], new_y[wheel], values[place])
        return resampled

    depth = carried(field["wear_depth"].values)
    if depth[-1].max() <= 0.0:
        raise ResultError("the wheels of the target did not wear; nothing to reproduce")
    by_regime = field["wear_depth_by_regime"]
    regimes = carried(by_regime.transpose("step", "wheel", "regime", "point").values)
    names = tuple(map(str, field["regime_name"].values))
    name = str(field.attrs.get("title", "")) or "field"
    return Target(places, depth, y, z, name, field, regimes, names)


def worn_target(
    worn: tuple[Profile, Profile],
    wheels: tuple[Profile, Profile],
    distance: float | None = None,
) -> Target:
    """Target of worn wheels against the new ones of the rig.

    Its stages are parts of the whole depth, and it has no mechanism to guard.

    Parameters
    ----------
    worn, wheels : pair of Profile
        Right and left wheel, worn and new; the worn ones are laid on the parts of the
        new ones that do not wear.
    distance : float, optional
        That the worn wheels ran [m].

    Raises
    ------
    ProfileError
        If the profiles are not of one wheel.
    ResultError
        If the wheels are not worn.
    """
    y, z = (np.stack([getattr(wheel, axis) for wheel in wheels]) for axis in "yz")
    depth = np.zeros((2, *y.shape))
    for k in (0, 1):
        # An instrument measures in axes of its own.
        wear = wear_between(wheels[k], worn[k], align="best_fit")
        depth[1, k] = np.interp(y[k], wear.y, wear.depth, left=0.0, right=0.0)
    depth = np.maximum(depth, 0.0)
    if depth.max() < _LEAST_WORN:
        raise ResultError(f"{worn[0].name} is not worn against {wheels[0].name}")
    end = np.nan if distance is None else distance
    return Target(np.array([0.0, end]), depth, y, z, worn[0].name)
