"""Copies of the operating points of a field on a rig: what a programme is held against.

Both run the points of the new wheels of the field by their shares of the distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.contact.wheels import joined
from wearsim.errors import ContactError, WearsimError
from wearsim.operation.resultants import resultants
from wearsim.scene.prepared import contact_models
from wearsim.studies.candidates import points_at
from wearsim.studies.chart import run_short
from wearsim.studies.design import Design, row_at, setup_of_tables
from wearsim.translation.factors import at_distances

FloatArray = NDArray[np.float64]

_FURTHEST = 10.0  # distances of the field that a copy runs at most
_WORN = "a worn wheel has no operating points to copy"


@dataclass(frozen=True)
class Copy:
    """Campaign on the rig at operating points copied from the field."""

    what: str  # is copied
    reason: str = ""  # why the rig cannot run it
    depth: FloatArray | None = None  # (2, v); None where it cannot [m]
    distance: float = np.nan  # until it is as deep as the target [m]


def copied_positions(design: Design) -> Copy:
    """Copy shift, yaw and load of the field."""
    what, field = "shift, yaw and load", design.target.field
    if field is None:
        return Copy(what, _WORN)
    if design.set_points.by_force:
        return Copy(what, "its blocks control the lateral force")
    points = _acting_points(field)
    return _run(design, what, points, points["lateral_position"].values)


def copied_forces(design: Design) -> Copy:
    """Copy angle of attack, load, and Y/Q of the guiding wheel; or lateral force."""
    by_force, field = design.set_points.by_force, design.target.field
    quantity = "lateral force" if by_force else "Y/Q of the guiding wheel"
    what = f"angle of attack, load and {quantity}"
    if field is None:
        return Copy(what, _WORN)
    points = _acting_points(field)
    if by_force:
        return _run(design, what, points, points["lateral_force"].values)
    quotient = points["derailment_quotient"].values
    guiding = np.nan_to_num(quotient, nan=-np.inf).argmax(axis=1)
    try:
        at, on_rig = _quotients(design, points)
    except WearsimError as error:
        return Copy(what, str(error).splitlines()[0])
    rows = np.arange(len(guiding))
    shift = nearest_crossings(
        at,
        on_rig[rows, :, guiding],
        quotient[rows, guiding],
        points["lateral_position"].values,
    )
    return _run(design, what, points, shift)


def nearest_crossings(
    at: FloatArray, values: FloatArray, target: FloatArray, near: FloatArray
) -> FloatArray:
    """Places where curves, linear between points, have target values.

    Parameters
    ----------
    at : (s,) array
        Points of the curves, rising [any unit].
    values : (n, s) array
        Of n curves; NaN where they have none.
    target : (n,) array
        Value of each.
    near : (n,) array
        The place of a curve is the nearest to this one; where it does not have the
        value, it is the point of the nearest value.

    Returns
    -------
    (n,) array
        In the unit of `at`.
    """
    difference = values - target[:, None]
    if at.size == 1:
        return np.repeat(at, target.size)
    first, second = difference[:, :-1], difference[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = first / (first - second)
    crosses = (first * second <= 0.0) & np.isfinite(part)
    place = np.where(crosses, at[:-1] + part * np.diff(at), np.inf)
    nearest = np.abs(place - near[:, None]).argmin(axis=1)
    rows = np.arange(len(difference))
    least = np.where(np.isfinite(difference), np.abs(difference), np.inf).argmin(axis=1)
    return np.where(crosses.any(axis=1), place[rows, nearest], at[least])


def _acting_points(field: xr.Dataset) -> xr.Dataset:
    """Operating points of the new wheels of a field that act, where contacts exist."""
    names = (
        *("lateral_position", "wheelset_yaw", "wheel_loads", "lateral_force"),
        *("derailment_quotient", "weight"),
    )
    new = field[list(names)].isel(step=0).transpose("operating_point", ...)
    acts = (new["weight"].values > 0.0) & np.isfinite(new["lateral_force"].values)
    return new.isel(operating_point=np.flatnonzero(acts))


def _quotients(design: Design, points: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Shifts (s,) of the rig, and Y/Q (n, s, 2) there at yaw and load of n points."""
    shift, count = design.set_points.lateral, points.sizes["operating_point"]
    yaw = np.repeat(points["wheelset_yaw"].values, shift.size)
    load = np.repeat(points["wheel_loads"].values.mean(axis=1), shift.size)
    at = points_at(
        design.scene, design.set_points, np.tile(shift, count), yaw, load
    ).conditions
    failed: dict[int, ContactError] = {}
    models = contact_models(design.scene.contact)
    parts = solve_each(
        at, *design.bodies, models, ContactSolution.patches, failed=failed
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = resultants(joined(parts), at.shift.size).derailment_quotient
    quotient[list(failed)] = np.nan
    return shift, quotient.reshape(count, shift.size, 2)


def _run(
    design: Design, what: str, points: xr.Dataset, lateral: Sequence[float] | FloatArray
) -> Copy:
    """Run points at shifts or forces (n,) until as deep as the target."""
    target = design.target
    far = _FURTHEST * float(target.distance[-1])
    share = points["weight"].values / points["weight"].values.sum()
    yaw = points["wheelset_yaw"].values
    load = points["wheel_loads"].values.mean(axis=1)
    rows = [
        row_at(
            f"point {k + 1}",
            design.set_points,
            (float(lateral[k]), float(yaw[k]), float(load[k])),
            far * float(share[k]),
        )
        for k in range(share.size)
    ]
    tables = design.scene_of(rows, 1)
    tables["operation"]["together"] = True
    try:
        run = run_short(setup_of_tables(tables), target.deepest)
    except WearsimError as error:
        return Copy(what, str(error).splitlines()[0])
    deepest = run.depth.max(axis=(1, 2))
    if deepest[-1] < target.deepest:
        reason = "it does not become as deep in ten times the distance"
        return Copy(what, reason)
    end = float(np.interp(target.deepest, deepest, run.distance))
    depth = at_distances(run.distance, run.depth, np.array([end]))[0]
    return Copy(what, depth=depth, distance=end)
