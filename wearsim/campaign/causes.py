r"""Causes of a translation factor from rig to field, attributed to scene differences.

Rig and field differ in groups of inputs. :math:`v(S)` is the wear rate with the groups
in `S` as on the rig and the others as in the field. Bodies and laws are exchanged by
group; the operating points have the product of the rig's joint distribution of the
groups in `S` and the field's of the others. The Shapley value [1]_ of a group is the
mean of its addition to :math:`\log v` over all orders of exchanging the groups, so that

.. math::
    \frac{v(\text{all})}{v(\emptyset)} = \prod_g c_g, \qquad
    \log c_g = \sum_{S \not\ni g} \frac{|S|!\,(n - |S| - 1)!}{n!} \log \frac{v(S \cup g)}{v(S)}

No group is defined as the remainder of the others.

References
----------
.. [1] L. S. Shapley, A value for n-person games, 1953.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from wearsim.campaign.evaluate import Setup, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.rate import new_state, points_of
from wearsim.campaign.state import worn_wheels
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.errors import ContactError
from wearsim.profile.shape import Profile
from wearsim.profile.worn import WHEEL_ZONES, ZONE_BORDERS
from wearsim.translation.compare import STAGES
from wearsim.translation.factors import (
    at_distances,
    between_solutions,
    common_axes,
    match_points,
)

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

BODY_CAUSES = (
    "roller curvature: contact patch",
    "roller curvature: creepage",
    "counterface profile",
    "wheel profile",
    "contact model",
    "wear law",
)
"""Groups of bodies, models and laws."""

POINT_CAUSES: dict[str, tuple[str, ...]] = {
    "positions (shift and yaw)": ("shift", "yaw", "roll", "drift", "shift_depth"),
    "path curvature (wheelset)": ("track_curvature", "speed_difference"),
    "load": ("load_right", "load_left", "torque", "torque_difference"),
    "speed": ("speed",),
    "friction": ("friction", "friction_flange"),
    "environment": ("environment",),
}
"""Groups of the operating points, and their values.

`track_curvature` is that of the path of the wheelset, `curve_curvature` of results that
of the track itself.
"""

LEAST_WEIGHT = 0.99
"""Least weight of operating points of an exchange that must have a contact solution."""

LEAST_ZONE = 1e-3
"""Least share of a zone in the rate of all zones, in every exchange, to have causes."""

MOST_SOLUTIONS = 100_000
"""Most contact solutions of one wheel in all exchanges of one state."""

_COLUMNS = [name for names in POINT_CAUSES.values() for name in names]
_OF_GROUP = np.array(
    [k for k, names in enumerate(POINT_CAUSES.values()) for _ in names]
)
_CONTACT = _COLUMNS.index(
    "environment"
)  # the columns before it are those of the contact


@dataclass(frozen=True)
class World:
    """Campaign in one state, as one side of the comparison."""

    parts: Mapping[
        str, Any
    ]  # by `BODY_CAUSES`: what the contact and its wear depend on
    rules: tuple[Any, ...]  # of rotation and roll
    values: FloatArray  # (points, columns) of `POINT_CAUSES`
    weight: FloatArray  # (points,) share of the distance
    threads: int = 1


_JUMP = "operating points run on both sides of a jump of their lateral force"


class NoSplitError(Exception):
    """Error: the causes of a factor cannot be separated."""


def _check_separable(setup: CampaignSetup, new: bool) -> None:
    """Raise an error for a campaign whose causes cannot be separated."""
    points = setup.points
    if (
        not isinstance(points.conditions.rotation, str)
        or points.conditions.creepage is not None
    ):
        raise NoSplitError("rotation speeds or creepages were given")
    if setup.brake is not None or points.conditions.rail is not None:
        raise NoSplitError(
            "brake blocks wear the wheels, or classes run on several rails"
        )
    if new and points.beyond is not None:
        raise NoSplitError(_JUMP)
    if setup.counterface.left_curvature is not None:
        raise NoSplitError("the radii of the rollers differ by side")


def _conditions_at(
    conditions: ContactConditions, result: xr.Dataset, target: FloatArray
) -> ContactConditions:
    """Conditions at a distance (1,) of a result [m], with the positions solved there."""
    run = result["distance"].values

    def solved(name: str) -> FloatArray:
        values: FloatArray = between_solutions(result, result[name].values)
        return at_distances(run, values, target)[0]

    if "share_beyond_jump" in result and (solved("share_beyond_jump") > 0.0).any():
        raise NoSplitError(_JUMP)
    if "lateral_position" not in result:
        return conditions
    shift = solved("lateral_position")
    if (depth := conditions.shift_depth) is not None:
        roll = solved("wheelset_roll")  # follows from the rest
        shift = shift - np.where(depth > 0.0, depth * np.sin(roll), 0.0)
    yaw, load = solved("wheelset_yaw"), solved("wheel_loads")
    return replace(conditions, shift=shift, yaw=yaw, wheel_load=load)


def world_of(
    setup: CampaignSetup,
    result: xr.Dataset | None = None,
    distance: float = 0.0,
    threads: int = 1,
) -> World:
    """Campaign at a distance of its result [m], or new.

    Profiles and the solved operating points are interpolated linearly in distance
    between the stored states.
    """
    _check_separable(setup, result is None)
    points, wheelset = setup.points, setup.wheelset
    if result is not None:
        run, target = result["distance"].values, np.array([distance])
        y, z = (
            at_distances(run, result[f"profile_{axis}"].values, target)[0]
            for axis in "yz"
        )
        right, left = worn_wheels(wheelset, y, z)
        wheelset = replace(wheelset, right=right, left=left)
        points = replace(
            points, conditions=_conditions_at(points.conditions, result, target)
        )
    active, conditions = np.flatnonzero(points.weight > 0.0), points.conditions
    flange = (
        conditions.friction
        if conditions.friction_flange is None
        else conditions.friction_flange
    )
    derived = {
        "load_right": conditions.loads[:, 0],
        "load_left": conditions.loads[:, 1],
        "friction_flange": flange,
        "environment": points.environment,
    }
    columns = [
        derived[name] if name in derived else getattr(conditions, name)
        for name in _COLUMNS
    ]
    given = [
        np.asarray(0.0 if column is None else column, dtype=float) for column in columns
    ]
    values = np.stack(
        [np.broadcast_to(column, points.weight.shape)[active] for column in given],
        axis=1,
    )
    if not np.isfinite(values).all():
        raise NoSplitError("not all operating points were found in this state")
    counterface = setup.counterface
    parts = (
        counterface.curvature,
        counterface.curvature,
        counterface.profiles,
        wheelset,
        setup.models,
        setup.wear,
    )
    rules = (conditions.rotation, conditions.free_roll)
    weight = points.weight[active] / points.weight[active].sum()
    return World(
        dict(zip(BODY_CAUSES, parts, strict=True)), rules, values, weight, threads
    )


def shapley(log_value: FloatArray) -> FloatArray:
    """Shapley values (n,) of `n` groups from the values (2^n,) of their subsets.

    They add up to the last value less the first.

    Bit k of the number of a subset is set if the subset contains group k.
    """
    count = int(np.log2(log_value.size))
    subset = np.arange(log_value.size)
    size = np.array([int(mask).bit_count() for mask in subset])
    shares = np.empty(count)
    for group in range(count):
        without = subset[(subset >> group) & 1 == 0]
        chance = [
            factorial(k) * factorial(count - k - 1) / factorial(count)
            for k in size[without]
        ]
        shares[group] = np.sum(
            chance * (log_value[without | 1 << group] - log_value[without])
        )
    return shares


def split(rig: World, field: World) -> tuple[dict[str, FloatArray], FloatArray]:
    """Attribute the factor of the worn-area rate, rig over field, to its causes.

    The rate is that of both wheels together.

    Returns
    -------
    causes : dict of (1 + zones,) arrays
        Factor of each group that differs, of the whole wheel and of patches with their
        centre in each of `WHEEL_ZONES`; their product is the factor. NaN for a zone
        where an exchange makes less than `LEAST_ZONE` of the whole wear.
    factor : (1 + zones,) array
        Rate of the rig over that of the field [-].

    Raises
    ------
    NoSplitError
        If exchanges have no contact solution, do not wear, or are too many.
    """
    if rig.rules != field.rules:
        raise NoSplitError("the wheelsets turn or roll by different rules")
    bodies = [
        name for name in BODY_CAUSES if not _alike(rig.parts[name], field.parts[name])
    ]
    of_points = _differing(rig, field)
    exchanges = [
        _exchanged(rig, field, of_points, mask) for mask in range(2 ** len(of_points))
    ]
    contact = np.concatenate([values[:, :_CONTACT] for values, _ in exchanges])
    unique, back = np.unique(contact, axis=0, return_inverse=True)
    if (solutions := 2 * len(unique) * 2 ** len(bodies)) > MOST_SOLUTIONS:
        raise NoSplitError(f"{solutions} contact solutions would be needed")
    parts = np.split(
        back.ravel(), np.cumsum([len(values) for values, _ in exchanges])[:-1]
    )
    value = np.empty((2 ** len(bodies), len(exchanges), 1 + len(WHEEL_ZONES)))
    for number in range(len(value)):
        of_rig = {
            name: rig.parts[name] for k, name in enumerate(bodies) if number >> k & 1
        }
        rate = _area_rates(replace(field, parts={**field.parts, **of_rig}), unique)
        for mask, (at, (values, weight)) in enumerate(
            zip(parts, exchanges, strict=True)
        ):
            solved = np.isfinite(rate[at, 0])
            share = weight[solved].sum()
            if share < LEAST_WEIGHT:
                raise NoSplitError(
                    f"{1.0 - share:.0%} of the exchanged operating points have no "
                    "contact solution"
                )
            every = weight[solved] * values[solved, _CONTACT]
            value[number, mask] = every @ rate[at][solved] / share
    if not (value[..., 0] > 0.0).all():
        raise NoSplitError("some exchanged operating points do not wear")
    value[:, :, (value < LEAST_ZONE * value[..., :1]).any(axis=(0, 1))] = np.nan
    # bits of the bodies are the low ones
    log_value = np.log(value.transpose(2, 1, 0).reshape(value.shape[-1], -1))
    names = [*bodies, *(list(POINT_CAUSES)[k] for k in of_points)]
    shares = np.exp([shapley(log_rate) for log_rate in log_value]).reshape(
        len(log_value), -1
    )
    return dict(zip(names, shares.T, strict=True)), np.exp(
        log_value[:, -1] - log_value[:, 0]
    )


def area_rates(world: World) -> FloatArray:
    """Rate (1 + zones,) of worn area of both wheels, in total and by zone [m2/m].

    The operating points are not exchanged: they keep their order and weights.
    """
    rate = _area_rates(world, world.values[:, :_CONTACT])
    solved = np.isfinite(rate[:, 0])
    weight = world.weight[solved] / world.weight[solved].sum()
    every: FloatArray = (weight * world.values[solved, _CONTACT]) @ rate[solved]
    return every


def _alike(rig_part: Any, field_part: Any) -> bool:
    """Return True if two parts of the scenes are equal, profiles by their points."""
    if isinstance(rig_part, Profile):
        return np.array_equal(rig_part.y, field_part.y) and np.array_equal(
            rig_part.z, field_part.z
        )
    if isinstance(rig_part, tuple):
        return len(rig_part) == len(field_part) and all(
            map(_alike, rig_part, field_part)
        )
    if isinstance(rig_part, Wheelset):
        return all(
            _alike(getattr(rig_part, name), getattr(field_part, name))
            for name in ("right", "left", "half_span", "radius")
        )
    return bool(rig_part == field_part)


def _differing(rig: World, field: World) -> list[int]:
    """Find the groups of `POINT_CAUSES` that can make a difference.

    Groups with one constant value are excluded, and so are groups with equal
    distributions if all others are constant in each scene. Otherwise an exchange can
    also break the correlation of a group with the others.
    """

    def constant(columns: np.ndarray, *worlds: World) -> bool:
        values = np.concatenate([world.values for world in worlds])[:, columns]
        return bool((values == values[0]).all())

    groups = range(len(POINT_CAUSES))
    varied = [k for k in groups if not constant(np.equal(_OF_GROUP, k), rig, field)]
    unlike = [k for k in varied if not _same_points(rig, field, np.equal(_OF_GROUP, k))]
    alike = ~np.isin(_OF_GROUP, unlike)
    apart = all(
        constant(np.equal(_OF_GROUP, k), world)
        for k in unlike
        for world in (rig, field)
    )
    return unlike if apart and _same_points(rig, field, alike) else varied


def _same_points(rig: World, field: World, columns: np.ndarray) -> bool:
    """Return True if operating points have equal joint distributions of some values."""
    (rig_values, p), (field_values, q) = (
        _merged(world.values[:, columns], world.weight) for world in (rig, field)
    )
    return np.array_equal(rig_values, field_values) and np.allclose(
        p, q, rtol=0.0, atol=1e-12
    )


def _merged(values: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distinct rows of values, and the weight of each."""
    rows, back = np.unique(values, axis=0, return_inverse=True)
    return rows, np.bincount(back.ravel(), weight, len(rows)).astype(np.float64)


def _exchanged(
    rig: World, field: World, groups: Sequence[int], mask: int
) -> tuple[FloatArray, FloatArray]:
    """Operating points and weights of an exchange.

    The groups in a mask are the rig's, all others the field's.
    """
    chosen = list(compress(groups, (mask >> k & 1 for k in range(len(groups)))))
    from_rig = np.isin(_OF_GROUP, chosen)
    of_rig, p = _merged(np.where(from_rig, rig.values, 0.0), rig.weight)
    of_field, q = _merged(np.where(from_rig, 0.0, field.values), field.weight)
    values = (of_rig[:, None] + of_field[None]).reshape(-1, len(_COLUMNS))
    return _merged(values, np.outer(p, q).ravel())


def _area_rates(world: World, values: FloatArray) -> FloatArray:
    """Worn area per distance (n, 1 + zones) under contact conditions [m2/m].

    It is that of both wheels, in total and by zone, and NaN without contact.
    """
    at = dict(zip(_COLUMNS, np.ascontiguousarray(values.T), strict=False))
    count, parts, (rotation, free_roll) = len(values), world.parts, world.rules
    without = {
        "friction_flange": at["friction"],
        "drift": 0.0,
        "speed_difference": 0.0,
        "shift_depth": 0.0,
        "torque_difference": 0.0,
    }
    optional: dict[str, Any] = {
        name: None if (at[name] == value).all() else at[name]
        for name, value in without.items()
    }
    conditions = ContactConditions(
        **{
            name: at[name]
            for name in ("shift", "yaw", "roll", "speed", "friction", "track_curvature")
        },
        **optional,
        wheel_load=np.stack([at["load_right"], at["load_left"]], axis=1),
        rotation=rotation,
        torque=at["torque"],
        free_roll=free_roll,
    )
    points = points_of(conditions)
    of_patch, of_creepage, (right, left), wheelset, models, wear = parts.values()
    counterface = Counterface(right, of_patch, left, of_creepage)
    setup = Setup(wheelset, counterface, models, wear, threads=world.threads)
    state = replace(new_state(wheelset), points=new_history(points))
    try:
        passage = solve_passage(state, points, setup)
    except ContactError as error:
        raise NoSplitError(str(error)) from None
    assert passage.wear is not None
    zone = 1 + np.searchsorted(ZONE_BORDERS, passage.contact.wheel_y, side="right")
    rate = np.zeros((count, 1 + len(WHEEL_ZONES)))
    for place in (np.zeros_like(zone), zone):
        np.add.at(rate, (passage.contact.point, place), passage.wear.area_rate)
    rate[list(passage.failed)] = np.nan
    return rate


POWER_CAUSES = ("contact patch", "longitudinal creepage", "lateral creepage", "spin")
"""Causes of a different frictional power at equal operating points.

They are the bodies and their motion.
"""

Bodies = tuple[Wheelset, Counterface, ContactModels]


def split_power(
    conditions: ContactConditions, rig: Bodies, field: Bodies
) -> tuple[FloatArray, FloatArray]:
    """Attribute the factor of the frictional power at equal operating points.

    These points are the same on rig and track. Each wheel is solved with the bodies and
    the creepages of either scene.

    Parameters
    ----------
    conditions : ContactConditions
        n operating points, whose rotation is a rule.
    rig, field : tuple
        Wheelset, counterface and contact models of both worlds.

    Returns
    -------
    causes : (n, 2, 4) array
        Factors by wheel and `POWER_CAUSES`; NaN where a wheel has several patches in
        one of the worlds, or an exchange has no contact solution.
    factor : (n, 2) array
        Power on the rig over that in the field: their product [-].
    """
    worlds, count = (field, rig), len(conditions.shift)
    motion = ("creepage_x", "creepage_y", "spin")
    creepage = np.stack(
        [_of_single_patches(conditions, bodies, motion) for bodies in worlds]
    )
    log_power = np.full((2 ** len(POWER_CAUSES), count, 2), np.nan)
    for side in (0, 1):
        solved = np.flatnonzero(np.isfinite(creepage[:, :, side]).all(axis=(0, 2)))
        for mask in range(len(log_power)) if solved.size else ():
            bits = [mask >> k & 1 for k in range(len(POWER_CAUSES))]
            mixed = np.stack(
                [creepage[bit, solved, side, k] for k, bit in enumerate(bits[1:])],
                axis=1,
            )
            at = replace(conditions.at(solved), rotation="nominal", creepage=mixed)
            power = _of_single_patches(at, worlds[bits[0]], ("power",), (side,))[
                :, side, 0
            ]
            with np.errstate(divide="ignore", invalid="ignore"):
                log_power[mask, solved, side] = np.log(power)
    log_power[:, ~np.isfinite(log_power).all(axis=0)] = np.nan
    causes = np.exp(np.apply_along_axis(shapley, 0, log_power))
    return np.moveaxis(causes, 0, -1), np.exp(log_power[-1] - log_power[0])


def _of_single_patches(
    conditions: ContactConditions,
    bodies: Bodies,
    names: Sequence[str],
    sides: tuple[int, ...] = (0, 1),
) -> FloatArray:
    """Values (n, 2, names) of the patch of each wheel.

    They are NaN without a solution or with several patches.
    """
    count = len(conditions.shift)
    values = np.full((count, 2, len(names)), np.nan)
    patches_of = ContactSolution.patches
    for patches in solve_each(
        conditions, *bodies, patches_of, sides=sides, failed={}, fields="work"
    ):
        wheel = 2 * patches.point + patches.side
        single = np.bincount(wheel, minlength=2 * count)[wheel] == 1
        of_patch = np.stack([getattr(patches, name) for name in names], axis=1)
        values[patches.point[single], patches.side[single]] = of_patch[single]
    return values


def _add_power_causes(
    translation: xr.Dataset,
    setups: Sequence[CampaignSetup],
    results: Sequence[xr.Dataset],
) -> xr.Dataset:
    """Add the causes of the power at equal operating points of new wheels, if any."""
    matched = match_points(*results)[:, 0]
    conditions = setups[0].points.conditions
    if (
        not matched.size
        or conditions.free_roll
        or not np.isfinite(conditions.shift[matched]).all()
    ):
        return translation
    bodies = [(setup.wheelset, setup.counterface, setup.models) for setup in setups]
    causes, factor = split_power(conditions.at(matched), *bodies)
    dims = ("matched_point", "wheel")
    long = (
        "share of the cause in the factor of the frictional power, new wheels, rig "
        "over field"
    )
    return translation.assign(
        power_cause_name=_described(
            "power_cause", list(POWER_CAUSES), "what differs at equal points"
        ),
        power_cause_factor=_described((*dims, "power_cause"), causes, long),
        power_factor=_described(dims, factor, "frictional power, rig over field"),
    )


def _described(
    dims: str | tuple[str, ...], values: Any, long_name: str
) -> tuple[Any, Any, dict[str, str]]:
    """Variable of a translation file: names, or factors and shares."""
    units = {"units": "1"} if isinstance(values, np.ndarray) else {}
    return dims, values, units | {"long_name": long_name}


def add_causes(
    translation: xr.Dataset,
    setups: Sequence[CampaignSetup],
    results: Sequence[xr.Dataset],
    threads: int = 1,
) -> xr.Dataset:
    """Return factors with the causes of the worn-area rate, or why there are none.

    Parameters
    ----------
    translation : Dataset
        From `wearsim.translation.translate.translate`.
    setups, results : two each
        Of rig and field.

    Returns
    -------
    Dataset
        With `rate_factor` (way), the rate of worn area of the rig over that of the
        field, and `cause_factor` (way, cause), whose product it is. Both are given at
        equal worn depth: for new wheels and at quarters of the depth at which both
        campaigns end, interpolated between the stored states. By zone of the wheel
        there are `cause_zone_factor` and `rate_zone_factor`, NaN where a zone hardly
        wears, and at equal operating points `power_cause_factor` (matched_point, wheel,
        power_cause).
    """
    translation = _add_power_causes(translation, setups, results)
    ways = (0.0, *STAGES)
    stations = 4 * len(STAGES)
    distance = common_axes(results[0], results[1], stations + 1).distance[1]

    def world(campaign: int, way: float) -> World:
        return world_of(
            setups[campaign],
            results[campaign],
            distance[round(way * stations), campaign],
            threads,
        )

    try:
        pairs = [(world(0, way), world(1, way)) for way in ways]
        splits = [split(*pair) for pair in pairs]
        rates = np.array(
            [[area_rates(campaign_state) for campaign_state in pair] for pair in pairs]
        )
    except NoSplitError as reason:
        return translation.assign_attrs(causes=f"no causes: {reason}")
    names = [
        name
        for name in (*BODY_CAUSES, *POINT_CAUSES)
        if any(name in causes for causes, _ in splits)
    ]
    neutral = np.ones(1 + len(WHEEL_ZONES))
    table = np.array(
        [[causes.get(name, neutral) for name in names] for causes, _ in splits]
    )
    caused = np.isfinite([factor for _, factor in splits])
    rate = np.divide(
        rates[:, 0], rates[:, 1], out=np.full(caused.shape, np.nan), where=caused
    )
    of_area, by_zone = (
        "rate of worn area, both wheels, rig over field",
        "rate of worn area of the zone",
    )
    share = f"share of the cause in the factor of the {of_area}"
    return translation.assign(
        way=_described(
            "way", np.array(ways), "share of the common range, by worn depth"
        ),
        cause_name=_described("cause", names, "what differs between rig and field"),
        cause_factor=_described(("way", "cause"), table[..., 0], share),
        cause_zone_factor=_described(
            ("way", "cause", "zone"),
            table[..., 1:],
            f"{share}, of patches with their centre in the zone",
        ),
        rate_factor=_described("way", rate[:, 0], of_area),
        rate_zone_factor=_described(
            ("way", "zone"), rate[:, 1:], f"{by_zone}, both wheels, rig over field"
        ),
    )
