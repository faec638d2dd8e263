"""Wear by block and zone of the wheel, and what errors of the set-points leave open.

A set-point is known with an error: a rig holds its shift to some 0.1 mm and its yaw to
some 0.2 mrad. Wear is solved anew with each set-point moved by its error to either side
in all blocks, as an offset of a sensor does; of both one-sided differences the larger
one counts, because wear rises steeply only towards the flange.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wearsim.campaign.rate import wear_rate
from wearsim.contact.patch import FloatArray
from wearsim.errors import Fault, SceneError, WearsimError, listed
from wearsim.profile.shape import Profile, vertex_lengths
from wearsim.profile.worn import WHEEL_ZONES
from wearsim.scene import FieldScene, RigScene, build, load_campaign

ERRORS: Mapping[str, float] = {
    "shift_mm": 0.1,
    "shift_mean_mm": 0.1,
    "lateral_force_kN": 0.5,
    "yaw_mrad": 0.2,
    "load_kN": 1.0,
    "axle_load_kN": 2.0,
    "wheel_load_right_kN": 1.0,
    "wheel_load_left_kN": 1.0,
    "axle_box_right_kN": 1.0,
    "axle_box_left_kN": 1.0,
}
"""Errors of the set-points by their keys, where none are given."""

LEAST = 0.005
"""Least share of all wear of a row in the text of `zone_lines` [-]."""

_SIDES = ("right", "left")


def zone_errors(
    scene: str | Path | Mapping[str, Any] | RigScene | FieldScene,
    errors: Mapping[str, float] | None = None,
    *,
    profiles: Profile | tuple[Profile, Profile] | None = None,
    threads: int = 1,
) -> pd.DataFrame:
    """Share of each block and zone in the wear of both wheels, with its error [-].

    Parameters
    ----------
    scene : str, Path, dict or scene
        Scene of a rig, or of the field with classes of track, as for `wear_rate`.
    errors : mapping of str to float, optional
        Errors of set-points by their keys, in the units of the keys, such as
        {"shift_mm": 0.2}; the others are 0.1 mm of shift, 0.2 mrad of yaw, 1 kN of a
        wheel load and 0.5 kN of a lateral force. Friction has none unless given
        ("friction").
    profiles : Profile or pair of them, optional
        Worn wheels in place of the new ones, as for `wear_rate`.
    threads : int
        Of the contact solver.

    Returns
    -------
    DataFrame
        A row for each block or class, wheel and zone that wears, by zone, the largest
        share first. Columns: `block`, `wheel`, `zone`, `share` of all wear with its
        standard error `share_error`, `of_zone`, the share in the wear of that zone of
        that wheel, with `of_zone_error`, and for each set-point the change of the worn
        area of the row by its error, relative to it (`shift_mm`, ...). NaN where no
        contact is found with the set-point moved.

    Raises
    ------
    WearsimError
        For faults of the scene, errors of unknown keys, and scenes whose operating
        points are not given by set-points: those of a vehicle or a record.

    Notes
    -----
    Each set-point is off by the same amount in all blocks; errors of different
    set-points are independent. Wear is that of the full collective in this state, with
    the environment factors of the scene.

    Examples
    --------
    >>> import wearsim
    >>> scene = wearsim.load_scene("rig.toml")
    >>> found = wearsim.zone_errors(scene)
    >>> bool((found["share_error"] < 1.0).all())
    True
    """
    loaded = scene
    if not isinstance(loaded, RigScene | FieldScene):
        campaign = load_campaign(loaded)
        if not isinstance(campaign, RigScene | FieldScene):
            raise SceneError([Fault("zones are of one campaign; give its scene")])
        loaded = campaign
    moved = _errors_of(loaded, errors or {})
    base, classes = _worn(loaded, profiles, threads), _classes(loaded)
    changes = {
        key: _changes(loaded, key, error, base, profiles, threads)
        for key, error in moved.items()
    }
    return _table(base, changes, classes)


def _errors_of(
    scene: RigScene | FieldScene, errors: Mapping[str, float]
) -> dict[str, float]:
    """Errors of the set-points that the blocks or classes of a scene state."""
    runs = scene.operation.runs
    if not runs or scene.vehicle is not None or scene.recorded is not None:
        text = (
            "the operating points follow from a vehicle or a record, not from "
            "set-points; zones with their errors are for [[operation.block]] and "
            "[[operation.class]]"
        )
        raise SceneError([scene.fault(("operation",), text)])
    stated = {
        key: error
        for key, error in {**ERRORS, **errors}.items()
        if any(getattr(run, key, None) is not None for run in runs.values())
    }
    unknown = [key for key in errors if key not in stated]
    if unknown:
        text = f"no block has the set-point {listed(unknown)}; give {listed(stated)}"
        raise SceneError([Fault(text)])
    wrong = [key for key, error in errors.items() if not 0.0 < error < np.inf]
    if wrong:
        raise SceneError([Fault(f"the error of {listed(wrong)} must be above 0")])
    return stated


def _moved(
    scene: RigScene | FieldScene, key: str, change: float
) -> RigScene | FieldScene:
    """Scene whose blocks or classes have a set-point moved, in the unit of its key."""
    name = "blocks" if isinstance(scene, RigScene) else "classes"
    runs = tuple(
        run
        if getattr(run, key, None) is None
        else run.model_copy(update={key: getattr(run, key) + change})
        for run in getattr(scene.operation, name)
    )
    operation = scene.operation.model_copy(update={name: runs})
    return scene.model_copy(update={"operation": operation})


def _classes(scene: RigScene | FieldScene) -> tuple[str, ...]:
    """Block or class of each operating point."""
    points = build(scene).points
    return points.class_name or points.label


def _worn(
    scene: RigScene | FieldScene,
    profiles: Profile | tuple[Profile, Profile] | None,
    threads: int,
) -> FloatArray:
    """Worn area per metre (point, wheel, zone) of the weighted points [m2/m]."""
    rate = wear_rate(scene, profiles=profiles, leave_out=True, threads=threads)
    acting = (rate["weight"] * rate["environment"]).values
    depth = rate["wear_depth_rate"].values.sum(axis=2)
    y, z = (rate[f"profile_{axis}"].values for axis in "yz")
    length = np.stack([vertex_lengths(*line) for line in zip(y, z, strict=True)])
    zone = np.digitize(y, list(WHEEL_ZONES.values())[:-1])
    area = depth * length * acting[:, None, None]
    area[acting == 0.0] = 0.0  # monitoring points, solved or not
    return np.stack(
        [np.where(zone == k, area, 0.0).sum(axis=2) for k in range(len(WHEEL_ZONES))],
        axis=2,
    )


def _changes(
    scene: RigScene | FieldScene,
    key: str,
    error: float,
    base: FloatArray,
    profiles: Profile | tuple[Profile, Profile] | None,
    threads: int,
) -> FloatArray:
    """Change of the worn area (side, point, wheel, zone) by an error to either side.

    NaN where no contact is found.
    """
    found = []
    for sign in (1.0, -1.0):
        try:
            worn = _worn(_moved(scene, key, sign * error), profiles, threads)
        except WearsimError:
            worn = np.full_like(base, np.nan)
        found.append(worn - base)
    return np.stack(found)


def _table(
    base: FloatArray, changes: Mapping[str, FloatArray], classes: Sequence[str]
) -> pd.DataFrame:
    """Tabulate shares and their errors of worn areas (point, wheel, zone)."""
    names = list(dict.fromkeys(classes))
    member = np.array([[name == one for one in classes] for name in names], dtype=float)
    area = np.einsum("bp,pwz->bwz", member, np.nan_to_num(base))
    whole, of_zone = area.sum(), area.sum(axis=0)
    share = area / whole
    zone_share = np.divide(area, of_zone, out=np.zeros_like(area), where=of_zone > 0.0)
    variance, zone_variance = np.zeros_like(area), np.zeros_like(area)
    relative = {}
    for key, change in changes.items():
        by_block = np.einsum("bp,spwz->sbwz", member, change)
        total = by_block.sum(axis=(1, 2, 3), keepdims=True)
        variance += _larger((by_block - share * total) / whole) ** 2
        in_zone = by_block - zone_share * by_block.sum(axis=1, keepdims=True)
        safe = np.where(of_zone > 0.0, of_zone, 1.0)
        zone_variance += _larger(in_zone / safe) ** 2
        relative[key] = _larger(by_block / np.where(area > 0.0, area, 1.0))
    rows = [
        {
            "block": name,
            "wheel": side,
            "zone": zone,
            "share": share[b, w, z],
            "share_error": np.sqrt(variance[b, w, z]),
            "of_zone": zone_share[b, w, z],
            "of_zone_error": np.sqrt(zone_variance[b, w, z]),
            **{key: value[b, w, z] for key, value in relative.items()},
        }
        for z, zone in enumerate(WHEEL_ZONES)
        for w, side in enumerate(_SIDES)
        for b, name in enumerate(names)
        if area[b, w, z] > 0.0
    ]
    made = pd.DataFrame(rows)
    order = [list(WHEEL_ZONES).index(zone) for zone in made["zone"]]
    by = made.assign(order=order).sort_values(
        ["order", "share"], ascending=[True, False], kind="stable"
    )
    return by.drop(columns="order").reset_index(drop=True)


def _larger(change: FloatArray) -> FloatArray:
    """Signed change of larger magnitude of two sides, of the known one if one fails."""
    size = np.where(np.isfinite(change), np.abs(change), -1.0)
    side = size.argmax(axis=0)
    return np.take_along_axis(change, side[None], axis=0)[0]


def zone_lines(
    table: pd.DataFrame, errors: Mapping[str, float], everything: bool = False
) -> list[str]:
    """Write the table of `zone_errors` for a terminal."""
    keys = [str(key) for key in table.columns[7:]]
    given = ", ".join(f"{key} {({**ERRORS, **errors})[key]:g}" for key in keys)
    rows = table if everything else table[table["share"] >= LEAST]
    lines = [
        f"wear by zone and block, with the errors {given}:",
        f"{'zone':<19}{'block':<22}{'% of zone':>12}{'% of all':>14}  changes by [%]",
        f"{'':<67}" + "".join(f"{_short(key):>11}" for key in keys),
    ]
    for row in rows.to_dict("records"):
        name = str(row["block"])
        short = name if len(name) < 21 else f"{name[:17]}..."
        cells = "".join(f"{_percent(row[key], '+.1f'):>11}" for key in keys)
        lines.append(
            f"{row['wheel']:<6}{row['zone']:<13}{short:<22}"
            f"{_with_error(row['of_zone'], row['of_zone_error']):>12}"
            f"{_with_error(row['share'], row['share_error']):>14}{cells}"
        )
    left_out = len(table) - len(rows)
    if left_out:
        lines.append(f"{left_out} rows below {100 * LEAST:g} % of all wear: --all")
    return lines


def _short(key: str) -> str:
    """Name of a set-point without its unit, for the head of a column."""
    name = key.rpartition("_")[0] or key
    short = name.removesuffix("_mean").replace("lateral_", "").replace("wheel_", "")
    return short.replace("_", " ")


def _percent(value: float, form: str) -> str:
    return "?" if np.isnan(value) else f"{100.0 * value:{form}}"


def _with_error(value: float, error: float) -> str:
    return f"{_percent(value, '.1f')} +-{_percent(error, '.1f'):>4}"
