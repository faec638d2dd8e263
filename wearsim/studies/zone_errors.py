"""Wear by block and zone of the wheel, with the uncertainty from errors of set-points.

A set-point is known with an error: a rig holds its shift to some 0.1 mm and its yaw to
some 0.2 mrad. Wear is solved anew with each set-point moved by its error to either side
in all blocks, as an offset of a sensor does. The change by the positive error is
stated; of both one-sided differences the larger one counts for the standard error,
because wear rises steeply only towards the flange.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wearsim.campaign.rate import wear_rate
from wearsim.contact.patch import FloatArray
from wearsim.errors import ContactError, Fault, SceneError
from wearsim.profile.shape import Profile, vertex_lengths
from wearsim.profile.worn import WHEEL_ZONES, ZONE_BORDERS
from wearsim.scene import CampaignSetup, FieldScene, RigScene, load_campaign
from wearsim.studies.moved_set_points import SET_POINTS, Movable, errors_of, movable

LEAST = 0.005
"""Least share of all wear of a row in the text of `zone_lines` [-]."""

COLUMNS = (
    *("block", "wheel", "zone", "share", "share_error"),
    *("of_zone", "of_zone_error", "one_sided"),
)
"""Columns of the table before those of the set-points."""

_SIDES = ("right", "left")
_WIDTH = 100  # of the text of `zone_lines`
_NAME, _LONGEST_NAME = 22, 34  # width of the column of blocks, and its largest


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
        Scene of a rig or of the field, as for `wear_rate`. A record has the groups of
        its samples as blocks: tread, right flange, left flange; a route of segments has
        the classes that stand for these.
    errors : mapping of str to float, optional
        Errors of set-points by their keys, in the units of the keys, such as
        {"shift_mm": 0.2}; the others are 0.1 mm of shift, 0.2 mrad of yaw, 1 kN of a
        wheel load or axle box, 2 kN of an axle load, 0.5 kN of a lateral force and
        10 mm of cant or cant deficiency.
        Friction ("friction", "friction_flange"), speed, roll, "shift_std_mm" and
        "speed_difference_percent" have none unless given.
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
        that wheel, with `of_zone_error`; `one_sided`, the keys of the set-points, with
        commas, whose error is of one side, because wheels have no contact with the
        set-point moved to the other; and for each set-point the signed change of the
        worn area of the row by its positive error, relative to it (`shift_mm`, ...).
        NaN where wheels have no contact with the set-point moved.

    Raises
    ------
    WearsimError
        For faults of the scene, errors of keys that are no set-points, and errors that
        move a set-point beyond the range allowed.

    Notes
    -----
    Each set-point is off by the same amount in all blocks; errors of different
    set-points are independent: their variances add up. The variance of a set-point is
    the square of the larger one of both one-sided differences. Wear is that of the full
    collective in this state, with the environment factors of the scene. What a record
    or a route is reduced to by its wear stays as it is chosen: the set-points of its
    operating points or classes are moved. On a route an error of the cant is one of the
    cant deficiency, and the speed is moved at the same deficiency.

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
    set_points = movable(loaded)
    sizes = errors_of(set_points, errors or {})
    base = _worn_area(set_points.base, profiles, threads)
    changes = {
        key: _changes(set_points, key, error, base, profiles, threads)
        for key, error in sizes.items()
    }
    return _table(base, changes, set_points.base.points.classes)


def _worn_area(
    campaign: CampaignSetup,
    profiles: Profile | tuple[Profile, Profile] | None,
    threads: int,
) -> FloatArray:
    """Worn area per metre (point, wheel, zone) of the weighted points [m2/m]."""
    rate = wear_rate(campaign, profiles=profiles, leave_out=True, threads=threads)
    acting = (rate["weight"] * rate["environment"]).values
    depth = rate["wear_depth_rate"].values.sum(axis=2)
    y, z = (rate[f"profile_{axis}"].values for axis in "yz")
    length = np.stack([vertex_lengths(*line) for line in zip(y, z, strict=True)])
    zone = np.digitize(y, ZONE_BORDERS)
    area = depth * length * acting[:, None, None]
    area[acting == 0.0] = 0.0  # monitoring points, solved or not
    return np.stack(
        [np.where(zone == k, area, 0.0).sum(axis=2) for k in range(len(WHEEL_ZONES))],
        axis=2,
    )


def _changes(
    set_points: Movable,
    key: str,
    error: float,
    base: FloatArray,
    profiles: Profile | tuple[Profile, Profile] | None,
    threads: int,
) -> FloatArray:
    """Change of the worn area (side, point, wheel, zone), by the positive error first.

    NaN where wheels have no contact with the set-point moved, zero at points that have
    none without that either.
    """
    changes = []
    for change in (error, -error):
        try:
            worn = _worn_area(set_points.moved(key, change), profiles, threads)
        except ContactError:
            worn = np.full_like(base, np.nan)
        changes.append(np.where(np.isnan(base), 0.0, worn - base))
    return np.stack(changes)


def _table(
    base: FloatArray, changes: Mapping[str, FloatArray], classes: Sequence[str]
) -> pd.DataFrame:
    """Tabulate shares and their errors of worn areas (point, wheel, zone)."""
    names = list(dict.fromkeys(classes))
    member = np.array(
        [[name == class_name for class_name in classes] for name in names], dtype=float
    )
    area = np.einsum("bp,pwz->bwz", member, np.nan_to_num(base))
    total_area, of_zone = area.sum(), area.sum(axis=0)
    share = area / total_area
    zone_share = np.divide(area, of_zone, out=np.zeros_like(area), where=of_zone > 0.0)
    variance, zone_variance = np.zeros_like(area), np.zeros_like(area)
    relative, one_sided = {}, []
    for key, change in changes.items():
        by_block = np.einsum("bp,spwz->sbwz", member, change)
        total = by_block.sum(axis=(1, 2, 3), keepdims=True)
        variance += _larger_magnitude((by_block - share * total) / total_area) ** 2
        in_zone = by_block - zone_share * by_block.sum(axis=1, keepdims=True)
        safe = np.where(of_zone > 0.0, of_zone, 1.0)
        zone_variance += _larger_magnitude(in_zone / safe) ** 2
        relative[key] = by_block[0] / np.where(area > 0.0, area, 1.0)
        if np.isfinite(total).sum() == 1:
            one_sided.append(key)
    rows = [
        {
            "block": name,
            "wheel": side,
            "zone": zone,
            "share": share[b, w, z],
            "share_error": np.sqrt(variance[b, w, z]),
            "of_zone": zone_share[b, w, z],
            "of_zone_error": np.sqrt(zone_variance[b, w, z]),
            "one_sided": ", ".join(one_sided),
            **{key: value[b, w, z] for key, value in relative.items()},
        }
        for z, zone in enumerate(WHEEL_ZONES)
        for w, side in enumerate(_SIDES)
        for b, name in enumerate(names)
        if area[b, w, z] > 0.0
    ]
    table = pd.DataFrame(rows)
    order = [list(WHEEL_ZONES).index(zone) for zone in table["zone"]]
    by = table.assign(order=order).sort_values(
        ["order", "share"], ascending=[True, False], kind="stable"
    )
    return by.drop(columns="order").reset_index(drop=True)


def _larger_magnitude(change: FloatArray) -> FloatArray:
    """Magnitude of the larger change of two sides, of one if the other is NaN."""
    size = np.where(np.isfinite(change), np.abs(change), -1.0).max(axis=0)
    return np.where(size < 0.0, np.nan, size)


def zone_lines(
    table: pd.DataFrame, errors: Mapping[str, float], everything: bool = False
) -> list[str]:
    """Write the table of `zone_errors` for a terminal, in lines of 100 columns.

    Set-points whose columns do not fit follow in further tables.
    """
    keys = [str(key) for key in table.columns[len(COLUMNS) :]]
    sizes = {key: errors.get(key, SET_POINTS[key].error) for key in keys}
    rows = table if everything else table[table["share"] >= LEAST]
    given = ", ".join(f"{key} {error:g}" for key, error in sizes.items())
    title = (
        f"wear by zone and block, with the errors {given}; last columns: change of the "
        "wear by each positive error [%]:"
    )
    first = _shares(rows)
    columns = [
        _column((SET_POINTS[key].title, f"+{error:g}{SET_POINTS[key].unit}"), rows, key)
        for key, error in sizes.items()
    ]
    lines = textwrap.wrap(title, _WIDTH)
    for part in _side_by_side(_names(rows), first, columns):
        lines += [line.rstrip() for line in part]
    if any(table["one_sided"]):
        lines.append(
            "* no contact with the set-point moved to one side; the error is that of "
            "the other side"
        )
    left_out = len(table) - len(rows)
    if left_out:
        lines.append(f"{left_out} rows below {100 * LEAST:g} % of all wear: --all")
    return lines


def _names(rows: pd.DataFrame) -> list[str]:
    """Zone and block of each row, below two lines of heads."""
    names = [str(name) for name in rows["block"]]
    width = min(max([_NAME, *(len(name) + 2 for name in names)]), _LONGEST_NAME)
    lines = [" " * (19 + width), f"{'zone':<19}{'block':<{width}}"]
    for row, name in zip(rows.to_dict("records"), names, strict=True):
        short = name if len(name) < width - 1 else f"{name[: width - 5]}..."
        lines.append(f"{row['wheel']:<6}{row['zone']:<13}{short:<{width}}")
    return lines


def _shares(rows: pd.DataFrame) -> list[str]:
    """Shares of each row with their errors, below two lines of heads."""
    lines = [f"{'':<26}", f"{'% of zone':>12}{'% of all':>14}"]
    lines += [
        f"{_with_error(row['of_zone'], row['of_zone_error']):>12}"
        f"{_with_error(row['share'], row['share_error']):>14}"
        for row in rows.to_dict("records")
    ]
    return lines


def _column(head: tuple[str, str], rows: pd.DataFrame, key: str) -> list[str]:
    """Write the changes of each row by an error below two lines of heads."""
    cells = [
        _percent(value, "+.1f") + ("*" if key in one_sided.split(", ") else "")
        for value, one_sided in zip(rows[key], rows["one_sided"], strict=True)
    ]
    width = 2 + max(map(len, (*head, *cells)))
    return [f"{cell:>{width}}" for cell in (*head, *cells)]


def _side_by_side(
    names: Sequence[str], shares: Sequence[str], columns: Sequence[Sequence[str]]
) -> list[list[str]]:
    """Tables of columns within the width; each begins with the names."""
    tables = [list(map("".join, zip(names, shares, strict=True)))]
    for column in columns:
        if len(tables[-1][0]) + len(column[0]) > _WIDTH:
            tables.append(list(names))
        tables[-1] = list(map("".join, zip(tables[-1], column, strict=True)))
    return tables


def _percent(value: float, form: str) -> str:
    return "?" if np.isnan(value) else f"{100.0 * value:{form}}"


def _with_error(value: float, error: float) -> str:
    return f"{_percent(value, '.1f')} +-{_percent(error, '.1f'):>4}"
