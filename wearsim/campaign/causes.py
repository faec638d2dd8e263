r"""Causes of a factor from rig to field: which difference of the two scenes makes how much of it.

Rig and field differ in groups of inputs. :math:`v(S)` is the wear rate with the groups in `S` as on the rig
and the others as in the field: of the bodies and laws each group its own, of the operating points the
product of the rig's joint distribution of the groups in `S` and the field's of the others. The Shapley value
of a group is the mean of what it adds to :math:`\log v` over all orders of exchanging the groups, so that

.. math::
    \frac{v(\text{all})}{v(\emptyset)} = \prod_g c_g, \qquad
    \log c_g = \sum_{S \not\ni g} \frac{|S|!\,(n - |S| - 1)!}{n!} \log \frac{v(S \cup g)}{v(S)}

(Shapley, "A value for n-person games", 1953). No group is the rest of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from wearsim.campaign.evaluate import Setup, patch_wear, setup_of, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    ContactPatches,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import solve_each
from wearsim.errors import ContactError
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import Profile
from wearsim.profile.worn import WHEEL_ZONES
from wearsim.translation.axes import common_axes, rows_at
from wearsim.translation.compare import STAGES
from wearsim.translation.factors import match_points

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

POINT_CAUSES: dict[str, tuple[str, ...]] = {
    "positions (shift and yaw)": ("shift", "yaw", "roll", "drift"),
    "track curvature": ("track_curvature", "speed_difference"),
    "load": ("load_right", "load_left", "torque"),
    "speed": ("speed",),
    "friction": ("friction", "friction_flange"),
    "environment": ("environment",),
}
"""Groups of the operating points, and their values."""

LEAST_WEIGHT = 0.99
"""Of the operating points of an exchange that must have a contact solution."""

LEAST_ZONE = 1e-3
"""Of the rate of all zones that a zone must have in every exchange, to have causes."""

MOST_SOLUTIONS = 100_000
"""Of one wheel in all exchanges of one state."""

_COLUMNS = [name for names in POINT_CAUSES.values() for name in names]
_OF_GROUP = np.array([k for k, names in enumerate(POINT_CAUSES.values()) for _ in names])
_CONTACT = _COLUMNS.index("environment")  # the columns before it are those of the contact


@dataclass(frozen=True)
class World:
    """One campaign in one state."""

    setup: Setup
    y: FloatArray  # (2, n) profiles of the wheels [m]
    z: FloatArray
    rules: tuple[Any, ...]  # of rotation and roll
    values: FloatArray  # (points, columns) of `POINT_CAUSES`
    weight: FloatArray  # (points,) share of the distance


class NoSplitError(Exception):
    """Why the causes of a factor cannot be separated."""


def _curvature_of_contact(made: Counterface, of: World) -> Counterface:
    rolling = made.curvature if made.rolling_curvature is None else made.rolling_curvature
    return replace(made, curvature=of.setup.counterface.curvature, rolling_curvature=rolling)


def _curvature_of_rolling(made: Counterface, of: World) -> Counterface:
    return replace(made, rolling_curvature=of.setup.counterface.curvature)


def _shape(made: Counterface, of: World) -> Counterface:
    return replace(made, profile=of.setup.counterface.profile, left=of.setup.counterface.left)


def _on_counterface(change: Callable[[Counterface, World], Counterface]) -> Callable[[World, World], World]:
    def exchanged(made: World, of: World) -> World:
        counterface = change(made.setup.counterface, of)
        return replace(made, setup=replace(made.setup, counterface=counterface))

    return exchanged


def _with_wheels(made: World, of: World) -> World:
    return replace(made, y=of.y, z=of.z, setup=replace(made.setup, wheelset=of.setup.wheelset))


def _with_models(made: World, of: World) -> World:
    setup = replace(made.setup, models=of.setup.models, fallbacks=of.setup.fallbacks)
    return replace(made, setup=setup)


def _with_law(made: World, of: World) -> World:
    return replace(made, setup=replace(made.setup, wear=of.setup.wear))


BODY_CAUSES: dict[str, tuple[Callable[[World], Any], Callable[[World, World], World]]] = {
    "roller curvature: contact patch": (
        lambda world: world.setup.counterface.curvature,
        _on_counterface(_curvature_of_contact),
    ),
    "roller curvature: creepage": (
        lambda world: world.setup.counterface.curvature,
        _on_counterface(_curvature_of_rolling),
    ),
    "counterface profile": (lambda world: world.setup.counterface.profiles, _on_counterface(_shape)),
    "wheel profile": (lambda world: (world.setup.wheelset, world.y, world.z), _with_wheels),
    "contact model": (lambda world: (world.setup.models, world.setup.fallbacks), _with_models),
    "wear law": (lambda world: world.setup.wear, _with_law),
}
"""Groups of bodies, models and laws: what they are, and how a world takes them from another one."""


def world_of(setup: CampaignSetup, result: xr.Dataset, row: int, threads: int = 1) -> World:
    """Campaign in the state of a row of its result, with the operating points as found there."""
    points, conditions = setup.points, setup.points.conditions
    if not isinstance(conditions.rotation, str) or conditions.creepage is not None:
        raise NoSplitError("rotation speeds or creepages were given")
    if setup.brake is not None or conditions.rail is not None:
        raise NoSplitError("brake blocks wear the wheels, or classes run on several rails")
    if "lateral_position" in result:
        names = ("lateral_position", "wheelset_yaw", "wheel_loads")
        shift, yaw, load = (result[name].values[row] for name in names)
        points = replace(points, conditions=replace(conditions, shift=shift, yaw=yaw, wheel_load=load))
    values, weight = _values_of(points)
    if not np.isfinite(values).all():
        raise NoSplitError("not all operating points were found in this state")
    y, z = (result[f"profile_{axis}"].values[row] for axis in "yz")
    bare = replace(setup, also_evaluate=(), fatigue=(), tolerance=None, counterface_wear=None)
    rules = (conditions.rotation, conditions.free_roll)
    return World(setup_of(bare, threads), y, z, rules, values, weight)


def _values_of(points: OperatingPoints) -> tuple[FloatArray, FloatArray]:
    """Values (n, columns) of `POINT_CAUSES` and weight (n,) of the points that act."""
    acting, conditions = np.flatnonzero(points.weight > 0.0), points.conditions
    flange = conditions.friction if conditions.friction_flange is None else conditions.friction_flange
    own = {
        "load_right": conditions.loads[:, 0], "load_left": conditions.loads[:, 1], "friction_flange": flange,
        "environment": points.environment,
    }  # fmt: skip
    columns = [own[name] if name in own else getattr(conditions, name) for name in _COLUMNS]
    given = [np.asarray(0.0 if column is None else column, dtype=float) for column in columns]
    values = np.stack([np.broadcast_to(column, points.weight.shape)[acting] for column in given], axis=1)
    return values, points.weight[acting] / points.weight[acting].sum()


def shapley(log_value: FloatArray) -> FloatArray:
    """Shares (n,) of `n` groups in what the last of the values (2^n,) of subsets has more than the first.

    Bit k of its number says whether a subset has group k.
    """
    count = int(np.log2(log_value.size))
    subset = np.arange(log_value.size)
    size = np.array([int(mask).bit_count() for mask in subset])
    shares = np.empty(count)
    for group in range(count):
        without = subset[(subset >> group) & 1 == 0]
        chance = [factorial(k) * factorial(count - k - 1) / factorial(count) for k in size[without]]
        shares[group] = np.sum(chance * (log_value[without | 1 << group] - log_value[without]))
    return shares


def split(rig: World, field: World) -> tuple[dict[str, FloatArray], FloatArray]:
    """Share out the factor of the rate of worn area, rig over field, both wheels together.

    Returns
    -------
    causes : dict of (1 + zones,) arrays
        Factor of each group that differs, of the whole wheel and of patches with their centre in each of
        `WHEEL_ZONES`; their product is the factor. NaN for a zone where an exchange makes less than
        `LEAST_ZONE` of the whole wear.
    factor : (1 + zones,) array
        Rate of the rig over that of the field [-].

    Raises
    ------
    NoSplitError
        If exchanges have no contact solution, do not wear, or are too many.
    """
    if rig.rules != field.rules:
        raise NoSplitError("the wheelsets turn or roll by different rules")
    bodies = [name for name, (part, _) in BODY_CAUSES.items() if not _alike(part(rig), part(field))]
    of_points = _differing(rig, field)
    exchanges = [_exchanged(rig, field, of_points, mask) for mask in range(2 ** len(of_points))]
    contact = np.concatenate([values[:, :_CONTACT] for values, _ in exchanges])
    unique, back = np.unique(contact, axis=0, return_inverse=True)
    if 2 * len(unique) * 2 ** len(bodies) > MOST_SOLUTIONS:
        raise NoSplitError(f"{2 * len(unique) * 2 ** len(bodies)} contact solutions would be needed")
    parts = np.split(back.ravel(), np.cumsum([len(values) for values, _ in exchanges])[:-1])
    value = np.empty((2 ** len(bodies), len(exchanges), 1 + len(WHEEL_ZONES)))
    for number in range(len(value)):
        made = field
        for k, name in enumerate(bodies):
            if number >> k & 1:
                made = BODY_CAUSES[name][1](made, rig)
        rate = _area_rates(made, unique)
        for mask, (at, (values, weight)) in enumerate(zip(parts, exchanges, strict=True)):
            known = np.isfinite(rate[at, 0])
            share = weight[known].sum()
            if share < LEAST_WEIGHT:
                raise NoSplitError(
                    f"{1.0 - share:.0%} of the exchanged operating points have no contact solution"
                )
            every = weight[known] * values[known, _COLUMNS.index("environment")]
            value[number, mask] = every @ rate[at][known] / share
    if not (value[..., 0] > 0.0).all():
        raise NoSplitError("some exchanged operating points do not wear")
    value[:, :, (value < LEAST_ZONE * value[..., :1]).any(axis=(0, 1))] = np.nan
    # bits of the bodies are the low ones
    log_value = np.log(value.transpose(2, 1, 0).reshape(value.shape[-1], -1))
    names = [*bodies, *(list(POINT_CAUSES)[k] for k in of_points)]
    shares = np.exp([shapley(one) for one in log_value]).reshape(len(log_value), -1)
    return dict(zip(names, shares.T, strict=True)), np.exp(log_value[:, -1] - log_value[:, 0])


def _alike(one: Any, other: Any) -> bool:
    """Whether two parts of a world are the same, arrays and profiles by their values."""
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(np.array_equal(one, other))
    if isinstance(one, Profile):
        return _alike(one.y, other.y) and _alike(one.z, other.z)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(_alike, one, other))
    if hasattr(one, "half_span"):  # new wheels are those of the profiles
        return bool(one.half_span == other.half_span and one.radius == other.radius)
    return bool(one == other)


def _differing(rig: World, field: World) -> list[int]:
    """Find the groups of `POINT_CAUSES` that can make a difference.

    Not those that are one constant, nor those distributed alike if all others are constant in each world:
    elsewhere an exchange can also break how a group goes with the others.
    """

    def constant(columns: np.ndarray, *worlds: World) -> bool:
        values = np.concatenate([world.values for world in worlds])[:, columns]
        return bool((values == values[0]).all())

    groups = range(len(POINT_CAUSES))
    varied = [k for k in groups if not constant(np.equal(_OF_GROUP, k), rig, field)]
    unlike = [k for k in varied if not _same_points(rig, field, np.equal(_OF_GROUP, k))]
    alike = ~np.isin(_OF_GROUP, unlike)
    apart = all(constant(np.equal(_OF_GROUP, k), world) for k in unlike for world in (rig, field))
    return unlike if apart and _same_points(rig, field, alike) else varied


def _same_points(rig: World, field: World, columns: np.ndarray) -> bool:
    """Whether the joint distributions of some values of the operating points are the same."""
    (one, p), (other, q) = (_merged(world.values[:, columns], world.weight) for world in (rig, field))
    return _alike(one, other) and bool(np.allclose(p, q, rtol=0.0, atol=1e-12))


def _merged(values: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Different rows of values, and the weight of each."""
    rows, back = np.unique(values, axis=0, return_inverse=True)
    return rows, np.bincount(back.ravel(), weight, len(rows)).astype(np.float64)


def _exchanged(rig: World, field: World, groups: Sequence[int], mask: int) -> tuple[FloatArray, FloatArray]:
    """Operating points and weights: the rig's of the groups in a mask, all else of the field."""
    chosen = list(compress(groups, (mask >> k & 1 for k in range(len(groups)))))
    mine = np.isin(_OF_GROUP, chosen)
    of_rig, p = _merged(np.where(mine, rig.values, 0.0), rig.weight)
    of_field, q = _merged(np.where(mine, 0.0, field.values), field.weight)
    values = (of_rig[:, None] + of_field[None]).reshape(-1, len(_COLUMNS))
    return _merged(values, np.outer(p, q).ravel())


def _area_rates(world: World, values: FloatArray) -> FloatArray:
    """Worn area per distance (n, 1 + zones) under conditions of the contact, NaN without one [m2/m].

    Of both wheels, in all and by zone.
    """
    at = dict(zip(_COLUMNS, values.T, strict=False))
    rotation, free_roll = world.rules
    count = len(values)
    conditions = ContactConditions(
        **{
            name: at[name].copy() for name in ("shift", "yaw", "roll", "speed", "friction", "track_curvature")
        },
        wheel_load=np.stack([at["load_right"], at["load_left"]], axis=1),
        rotation=rotation,
        torque=at["torque"].copy(),
        free_roll=free_roll,
        friction_flange=_or_none(at["friction_flange"], at["friction"]),
        drift=_or_none(at["drift"], 0.0),
        speed_difference=_or_none(at["speed_difference"], 0.0),
    )
    one = np.ones(count)
    points = OperatingPoints(conditions, one, one, np.zeros(count), tuple(map(str, range(count))))
    nothing = np.zeros(2)
    unworn = np.zeros_like(world.y)
    state = State(
        0, 0.0, world.y, world.z, unworn, unworn[:, None], worn_area=nothing, worn_mass=nothing,
        points=new_history(points),
    )  # fmt: skip
    try:
        passage = solve_passage(state, points, world.setup)
    except ContactError as error:
        raise NoSplitError(str(error)) from None
    wear = patch_wear(passage, state, world.setup.wheelset)
    zone = 1 + np.searchsorted(list(WHEEL_ZONES.values())[:-1], passage.contact.wheel_y, side="right")
    rate = np.zeros((count, 1 + len(WHEEL_ZONES)))
    for place in (np.zeros_like(zone), zone):
        np.add.at(rate, (passage.contact.point, place), passage.weight * wear.area_rate)
    rate[list(passage.failed)] = np.nan
    return rate


def _or_none(values: FloatArray, other: FloatArray | float) -> FloatArray | None:
    return None if (values == other).all() else values.copy()


POWER_CAUSES = ("contact patch", "longitudinal creepage", "lateral creepage", "spin")
"""What makes the frictional power of an equal operating point another one: the bodies, and their motion."""

Bodies = tuple[Wheelset, Counterface, ContactModels]


def split_power(conditions: ContactConditions, rig: Bodies, field: Bodies) -> tuple[FloatArray, FloatArray]:
    """Share out the factor of the frictional power at operating points that are the same on rig and track.

    Each wheel is solved with the bodies of either world and each creepage of either world.

    Parameters
    ----------
    conditions : ContactConditions
        n operating points, whose rotation is a rule.
    rig, field : tuple
        Wheelset, counterface and contact models of both worlds.

    Returns
    -------
    causes : (n, 2, 4) array
        Factors by wheel and `POWER_CAUSES`; NaN where a wheel has several patches in one of the worlds, or an
        exchange has no contact solution.
    factor : (n, 2) array
        Power on the rig over that in the field: their product [-].
    """
    count, worlds = len(conditions.shift), (field, rig)
    creepage = np.full((2, count, 2, 3), np.nan)  # by world and wheel
    for own, bodies in zip(creepage, worlds, strict=True):
        for found in _solved(conditions, bodies, (0, 1)):
            wheel = 2 * found.point + found.side
            single = np.bincount(wheel, minlength=2 * count)[wheel] == 1
            place = found.point[single], found.side[single]
            own[place] = np.stack([found.creepage_x, found.creepage_y, found.spin], axis=1)[single]
    causes, factor = np.full((count, 2, 4), np.nan), np.full((count, 2), np.nan)
    masks = range(2 ** len(POWER_CAUSES))
    for side in (0, 1):
        known = np.flatnonzero(np.isfinite(creepage[:, :, side]).all(axis=(0, 2)))
        power = np.full((len(masks), known.size), np.nan)
        for mask in masks if known.size else ():
            bits = [mask >> k & 1 for k in range(len(POWER_CAUSES))]
            mixed = np.stack([creepage[bit, known, side, k] for k, bit in enumerate(bits[1:])], axis=1)
            at = replace(conditions.at(known), rotation="nominal", creepage=mixed)
            for found in _solved(at, worlds[bits[0]], (side,)):
                power[mask, found.point] = found.power
        with np.errstate(divide="ignore", invalid="ignore"):
            log_power = np.log(power)
        for column, point in enumerate(known):
            if np.isfinite(log_power[:, column]).all():
                causes[point, side] = np.exp(shapley(log_power[:, column]))
                factor[point, side] = np.exp(log_power[-1, column] - log_power[0, column])
    return causes, factor


def _solved(conditions: ContactConditions, bodies: Bodies, sides: tuple[int, ...]) -> list[ContactPatches]:
    """Patches of the points that have a contact solution."""
    return solve_each(conditions, *bodies, lambda found: found.patches(), sides=sides, failed={})


def _add_power_causes(
    translation: xr.Dataset, setups: Sequence[CampaignSetup], results: Sequence[xr.Dataset]
) -> xr.Dataset:
    """Add the causes of the power at equal operating points, new wheels, where there are any."""
    matched = match_points(*results)[:, 0]
    conditions = setups[0].points.conditions
    if not matched.size or conditions.free_roll or not np.isfinite(conditions.shift[matched]).all():
        return translation
    bodies = [(one.wheelset, one.counterface, one.models) for one in setups]
    causes, factor = split_power(conditions.at(matched), *bodies)
    long = "share of the cause in the factor of the frictional power, new wheels, rig over field"
    dims = ("matched_point", "wheel")
    return translation.assign(
        power_cause_name=("power_cause", list(POWER_CAUSES), {"long_name": "what differs at equal points"}),
        power_cause_factor=((*dims, "power_cause"), causes, {"units": "1", "long_name": long}),
        power_factor=(dims, factor, {"units": "1", "long_name": "frictional power, rig over field"}),
    )


def add_causes(
    translation: xr.Dataset,
    setups: Sequence[CampaignSetup],
    results: Sequence[xr.Dataset],
    threads: int = 1,
) -> xr.Dataset:
    """Return factors with the causes of that of the rate of worn area, or with the reason why there are none.

    Parameters
    ----------
    translation : Dataset
        From `wearsim.translation.translate.translate`.
    setups, results : two each
        Of rig and field.

    Returns
    -------
    Dataset
        With `cause_factor` (way, cause) and their product `rate_factor` (way), in the states at equal worn
        depth: new wheels and the quarters of the way to where both campaigns end; by zone of the wheel
        `cause_zone_factor` and `rate_zone_factor`, NaN where a zone hardly wears; and `power_cause_factor`
        (matched_point, wheel, power_cause) at equal operating points.
    """
    translation = _add_power_causes(translation, setups, results)
    ways = (0.0, *STAGES)
    stations = 4 * len(STAGES)
    distance = common_axes(results[0], results[1], stations + 1).distance[1]
    found: list[tuple[Mapping[str, FloatArray], FloatArray]] = []
    try:
        for way in ways:
            there = distance[round(way * stations)]
            worlds = [
                world_of(setup, data, int(rows_at(data["distance"].values, there[c : c + 1])[0]), threads)
                for c, (setup, data) in enumerate(zip(setups, results, strict=True))
            ]
            found.append(split(worlds[0], worlds[1]))
    except NoSplitError as reason:
        return translation.assign_attrs(causes=f"no causes: {reason}")
    names = [*BODY_CAUSES, *POINT_CAUSES]
    names = [name for name in names if any(name in causes for causes, _ in found)]
    one = np.ones(1 + len(WHEEL_ZONES))
    table = np.array([[causes.get(name, one) for name in names] for causes, _ in found])
    rate = np.array([factor for _, factor in found])
    long = "share of the cause in the factor of the rate of worn area, both wheels, rig over field"
    return translation.assign(
        way=("way", np.array(ways), {"units": "1", "long_name": "share of the common range, by worn depth"}),
        cause_name=("cause", names, {"long_name": "what differs between rig and field"}),
        cause_factor=(("way", "cause"), table[..., 0], {"units": "1", "long_name": long}),
        cause_zone_factor=(
            ("way", "cause", "zone"), table[..., 1:],
            {"units": "1", "long_name": f"{long}, of patches with their centre in the zone"},
        ),
        rate_factor=(
            "way", rate[:, 0], {"units": "1", "long_name": "rate of worn area, both wheels, rig over field"}
        ),
        rate_zone_factor=(
            ("way", "zone"), rate[:, 1:],
            {"units": "1", "long_name": "rate of worn area of the zone, both wheels, rig over field"},
        ),
    )  # fmt: skip
