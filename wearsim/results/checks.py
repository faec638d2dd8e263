"""Spans of wear between reprofilings of the wheels, and warnings of a result."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.friction import FLANGE_ANGLE
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue.shakedown import shakedown_limit
from wearsim.damage.titles import law_title
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import ResultError, listed
from wearsim.quantities import STEP_LIMITS, kilometres

if TYPE_CHECKING:
    import xarray as xr

TREAD_WEAR_BAND = (0.5e-3, 2.0e-3)
"""Tread wear of passenger stock in service per 100 000 km [m].

UNCERTAIN: a range from the literature by memory, without a source that was read. It is
used for a warning only and proves nothing.
"""

SERVICE_DISTANCE = 1e8
"""Distance to which the range of tread wear refers [m]."""

TREAD_SLOPE = 0.2
"""Slope at which the tread of a new wheel ends towards the flange [-]."""

LOAD_TOLERANCE = 0.01
"""Deviation from 1 of the factor on normal forces above which there is a warning."""

STOOD_IN_SHARE = 0.05
"""Share of the wear from wheels solved by a substitute model that causes a warning."""

FORCE_RESIDUAL = 1e-3
"""Residual of a balance of forces over the axle load that causes a warning."""

NO_LATERAL_FORCE = 100.0
"""Lateral force on a wheelset up to which it counts as zero [N]."""

SEIZURE_SHARE = 0.01
"""Share of the worn area by seizure that causes a warning."""

OUTSIDE_SHARE = 0.01
"""Share of the worn area outside the rows of a wear table that causes a warning."""

MOST_BEYOND_VALIDITY = 0.2
"""Share of the wear beyond the validity of the models above which bands are omitted."""

LOW_FRICTION = 0.3
"""Friction below which surfaces count as lubricated or wet [-]."""

_SHEAR_YIELD = "ekberg_kabo_andersson_2002"


class Reprofiling(NamedTuple):
    """Reprofiling of both wheels, with their diameters at the running circle [m]."""

    distance: float  # [m]
    before: tuple[float, ...]  # right and left wheel, NaN without a previous value
    after: tuple[float, ...]


def reprofiled_rows(dataset: xr.Dataset) -> list[int]:
    """Return the rows of freshly reprofiled wheels."""
    if "last_reprofiling" not in dataset:
        return []
    last = dataset["last_reprofiling"].values
    return [
        int(row) for row in np.flatnonzero((last == np.arange(last.size)) & (last > 0))
    ]


def reprofilings(dataset: xr.Dataset) -> tuple[Reprofiling, ...]:
    """Return the reprofilings of the wheels in order; an empty list without any."""
    events = []
    for row in reprofiled_rows(dataset):
        before, after = dataset["wheel_diameter"].values[row - 1 : row + 1].tolist()
        events.append(
            Reprofiling(
                float(dataset["distance"].values[row]), tuple(before), tuple(after)
            )
        )
    return tuple(events)


def spans(dataset: xr.Dataset) -> Iterator[tuple[int, int]]:
    """First and last row of each span of wear, from a new wheel to a reprofiling."""
    rows = reprofiled_rows(dataset)
    yield from zip(
        [0, *rows], [*(row - 1 for row in rows), dataset.sizes["step"] - 1], strict=True
    )


def last_worn_row(dataset: xr.Dataset) -> int:
    """Return the last row whose wheels are not freshly reprofiled."""
    last = dataset.sizes["step"] - 1
    return last - 1 if last in reprofiled_rows(dataset) else last


def wear_steps(dataset: xr.Dataset) -> int:
    """Return the number of wear steps of a campaign, without reprofilings."""
    return int(dataset.sizes["step"]) - 1 - len(reprofiled_rows(dataset))


def step_limits(dataset: xr.Dataset) -> dict[str, int]:
    """Count the wear steps limited by each limit, most frequent first."""
    reasons = dataset["step_limit"].values.astype(int).tolist()
    # the first reason, of initial states and reprofilings, is not a limit
    return {
        STEP_LIMITS[which]: count
        for which, count in Counter(filter(None, reasons)).most_common()
    }


def new_row(dataset: xr.Dataset, row: int) -> int:
    """Row in which the wheels were last new or reprofiled, before a given row.

    Depth and damage in `row` refer to the points of that profile.
    """
    return (
        int(dataset["last_reprofiling"].values[row])
        if "last_reprofiling" in dataset
        else 0
    )


def closing_reprofiling(dataset: xr.Dataset) -> str:
    """State which values a closing reprofiling leaves out, "" without one."""
    if last_worn_row(dataset) == dataset.sizes["step"] - 1:
        return ""
    return (
        "The campaign ends with a reprofiling of the wheels: values at its end are of "
        "the state before it."
    )


def damage_left(dataset: xr.Dataset) -> dict[str, tuple[float, float]]:
    """Damage that remains after reprofiling, for laws with a stated crack depth.

    By law the largest damage of reprofiled wheels [-] and the depth of a crack of
    damage 1 [m]; empty without reprofilings.
    """
    rows = reprofiled_rows(dataset)
    if not rows or "fatigue_name" not in dataset:
        return {}
    damage = dataset["fatigue_damage"].values[rows].max(axis=(0, 1, 3))
    cracks = dataset["fatigue_crack_depth"].values
    return {
        str(law): (float(damage[k]), float(cracks[k]))
        for k, law in enumerate(dataset["fatigue_name"].values)
        if np.isfinite(cracks[k])
    }


def cracks_left(dataset: xr.Dataset) -> str:
    """State the effect of reprofiling on fatigue damage, by law.

    The text is "" without damage or without reprofiling.
    """
    if not reprofiled_rows(dataset) or "fatigue_name" not in dataset:
        return ""
    left, lines = damage_left(dataset), []
    for law in map(str, dataset["fatigue_name"].values):
        damage, crack = left.get(law, (0.0, 0.0))
        kept = f"left at most {damage:.3g} of it" if damage > 0.0 else "left none"
        kept += (
            ": cracked, as deep as a crack of damage 1 or deeper"
            if damage > 1.0
            else ""
        )
        reached = f"the damage its cut reached (1 is a crack of {1e3 * crack:g} mm)"
        lines.append(
            f"Of {law_title(law)} the lathe took {reached} and {kept}."
            if law in left
            else (
                f"The lathe is assumed to take all damage of {law_title(law)}, which "
                "states no depth of its cracks."
            )
        )
    return " ".join(lines)


def check_run(dataset: xr.Dataset, distance: NDArray[np.float64]) -> None:
    """Raise a `ResultError` for distances (k,) that a campaign has not run [m]."""
    end = float(dataset["distance"].values[-1])
    for place in distance[~((distance >= 0.0) & (distance <= end))]:
        raise ResultError(
            f"distance = {place:.10g} must be 0 to {end:.10g} m, the distance run"
        )


def depth_by_regime(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Wear depth by regime (2, n_regimes), summed along the profile and over spans [m].

    Only its shares are meaningful: the points of a profile are equally spaced.
    """
    rows = [last for _, last in spans(dataset)]
    return np.asarray(dataset["wear_depth_by_regime"].values[rows].sum(axis=(0, 3)))


def tread_wear(dataset: xr.Dataset) -> float | None:
    """Return the largest wear depth on the tread of both wheels, per 100 000 km [m].

    It is proportional to the distance run, and None before the first step.
    """
    run = float(dataset["distance"].values[-1])
    if run <= 0.0:
        return None
    # Depth counts from the last reprofiling; compared are the deepest places of all
    # spans, wherever they are.
    deepest = np.zeros(2)
    for first, last in spans(dataset):
        for wheel in (0, 1):
            y, z = (
                dataset[name].values[first, wheel]
                for name in ("profile_y", "profile_z")
            )
            # On a steep flank y may be constant; only the slopes of the tread count,
            # where y rises.
            steep = np.flatnonzero(np.abs(np.diff(z)) > TREAD_SLOPE * np.diff(y))
            inner = steep[y[steep] < 0.0]
            tread = np.arange(y.size) > (inner[-1] if inner.size else -1)
            deepest[wheel] += (
                dataset["wear_depth"].values[last, wheel, tread].max(initial=0.0)
            )
    return float(deepest.max()) * SERVICE_DISTANCE / run


def tread_wear_warning(dataset: xr.Dataset) -> str | None:
    """Warn if the tread wear rate of a field campaign is not as seen in service."""
    law = WEAR_LAWS.get(dataset.attrs.get("wear_law", ""))
    if dataset.attrs.get("scene_kind") != "field" or (
        law is not None and not law.wears
    ):
        return None
    wear = tread_wear(dataset)
    low, high = TREAD_WEAR_BAND
    if wear is None or low <= wear <= high:
        return None
    side = "below" if wear < low else "above"
    return (
        f"tread wear of {1e3 * wear:.3g} mm per 100 000 km is {side} the {1e3 * low:g} "
        f"to {1e3 * high:g} mm seen in service (an uncertain band): look at "
        "environment factors, friction, shares and the spread of the shifts"
    )


class LoadScaling(NamedTuple):
    """Cases in which pressures and forces were scaled to the wheel load.

    Scaling by less than `LOAD_TOLERANCE` is not listed.
    """

    points: int  # operating points with a weight that were ever omitted
    distance_share: (
        float  # of the distance that was run in such a point, up to such a state [-]
    )
    largest: float  # factor that deviates most from 1 [-]


def load_scaling(dataset: xr.Dataset) -> LoadScaling | None:
    """Find the scaling of normal forces at operating points that wear, or None.

    The distance of a step counts for the state it leads to.
    """
    counts = dataset["weight"].values > 0.0
    scale = dataset["load_scale"].values[:, counts]
    scaled = (
        np.nan_to_num(np.abs(scale - 1.0)).max(axis=-1, initial=0.0) > LOAD_TOLERANCE
    )
    if not scaled.any():
        return None
    step_length, active = (
        dataset[name].values[1:] for name in ("step_length", "active_weight")
    )
    run = float(step_length.sum())
    scaled_run = float((step_length[:, None] * active[:, counts] * scaled[1:]).sum())
    scales = scale[np.isfinite(scale)]
    return LoadScaling(
        points=int(scaled.any(axis=0).sum()),
        distance_share=scaled_run / run if run > 0.0 else 0.0,
        largest=float(scales[np.argmax(np.abs(scales - 1.0))]),
    )


def left_out_warning(dataset: xr.Dataset) -> str | None:
    """Warn of operating points that were omitted for lack of a contact solution."""
    if "left_out" not in dataset or not dataset["left_out"].values.any():
        return None
    out, run = dataset["left_out"].values > 0, dataset["step_length"].values
    acted = float(
        (run[:, None] * dataset["active_weight"].values * out).sum() / run.sum()
    )
    names = dataset["operating_point_name"].values[out.any(axis=0)]
    more = f" and {names.size - 3} more" if names.size > 3 else ""
    largest_share = percent(float(dataset["left_out_share"].values.max()))
    shown_names = ", ".join(map(str, names[:3])) + more
    return (
        f"{names.size} of {out.shape[1]} operating points had no contact solution and "
        f"were left out ({shown_names}), over {percent(acted)} of the distance: their "
        "weight goes to the rest of their class; a class with no other points causes "
        f"no wear; they carry at most {largest_share} of the wear"
    )


def load_scale_warning(dataset: xr.Dataset) -> str | None:
    """Warn of pressures and forces that were scaled to the wheel load."""
    scaling = load_scaling(dataset)
    if scaling is None:
        return None
    share = percent(scaling.distance_share)
    return (
        "contact patches merge or the load of the model jumps: forces are scaled to "
        f"the wheel load by more than {LOAD_TOLERANCE:.0%} (at most by the factor "
        f"{scaling.largest:.3g}) at {scaling.points} operating points that wear, over "
        f"{share} of the distance: pressures and wear there are less certain"
    )


def stood_in_share(dataset: xr.Dataset) -> float:
    """Share of the worn area from wheels solved by a substitute contact model [-].

    Contacts count in the state to which a step leads. The share is 0 without wear, and
    in results of versions that did not record it.
    """
    wear = worn_by_patch(dataset)
    if "stood_in" not in dataset or wear.sum() <= 0.0:
        return 0.0
    return float(wear[dataset["stood_in"].values == 1].sum() / wear.sum())


def stood_in_warning(dataset: xr.Dataset) -> str | None:
    """Warn if much wear is from wheels that the scene's contact models cannot solve."""
    share = stood_in_share(dataset)
    if share <= STOOD_IN_SHARE:
        return None
    stood_in = (dataset["stood_in"].values == 1).any(axis=(0, 2))
    allowed = percent(STOOD_IN_SHARE)
    return (
        f"{percent(share)} of the wear, more than {allowed}, is of wheels for which "
        f"the contact model had no solution, at {stood_in.sum()} of {stood_in.size} "
        "operating points: half_space stood in for it there; smooth measured "
        'profiles, or write model = "accurate" in [contact]'
    )


def force_residual_warning(dataset: xr.Dataset) -> str | None:
    """Warn of blocks or classes that run where their forces are not balanced."""
    if "force_residual" not in dataset:
        return None
    residual = np.nan_to_num(dataset["force_residual"].values)
    beyond = residual > FORCE_RESIDUAL
    if not beyond.any():
        return None
    first = int(beyond.any(axis=1).argmax())
    names = list(dict.fromkeys(map(str, group_names(dataset)[beyond.any(axis=0)])))
    shown = [*names[:3], f"{len(names) - 3} more"] if len(names) > 3 else names
    return (
        f"no position balances the forces on the wheelset in {listed(shown)}, first at "
        f"{kilometres(dataset['distance'].values[first])}: at most "
        f"{percent(float(residual.max()))} of the axle load is missing where it runs, "
        f"more than {percent(FORCE_RESIDUAL)}; its wear there is that of other forces"
    )


def onto_flange_warning(dataset: xr.Dataset) -> str | None:
    """Warn of wheelsets on a rig that reach flange contact as their wheels wear.

    No lateral force acts on them.
    """
    if dataset.attrs.get("scene_kind") != "rig" or "lateral_stiffness" not in dataset:
        return None
    moves = (dataset["lateral_stiffness"].values > 0.0).any(axis=0)
    force = np.nan_to_num(dataset["lateral_force"].values)
    without = moves & (np.abs(force) <= NO_LATERAL_FORCE).all(axis=0)
    steep = (np.abs(np.nan_to_num(dataset["contact_angle"].values)) > FLANGE_ANGLE).any(
        axis=2
    )
    names, distance = dataset["operating_point_name"].values, dataset["distance"].values
    parts = [
        f"{names[point]} from {kilometres(distance[steep[:, point].argmax()])} on"
        for point in np.flatnonzero(without & ~steep[0] & steep.any(axis=0))
    ]
    if not parts:
        return None
    return (
        "without a lateral force the wheelset has moved onto a flange as its wheels "
        f"wore: {listed(parts)}; give these blocks shift_mm, or a lateral_force_kN as "
        "in service"
    )


def regime_shares(dataset: xr.Dataset, sought: str) -> dict[str, float]:
    """Share of the worn area of both wheels that each law assigns to a regime [-].

    The result has active and comparison laws by name. It is empty if no law has a
    regime of that name, or if no wear belongs to it.
    """
    shares = {}
    names = [str(name) for name in dataset["regime_name"].values]
    depth = depth_by_regime(dataset).sum(axis=0)
    if sought in names and depth.sum() > 0.0:
        shares[str(dataset.attrs["wear_law"])] = float(
            depth[names.index(sought)] / depth.sum()
        )
    if "comparison_name" in dataset:
        area = dataset["comparison_worn_area"].values[-1].sum(axis=0)
        pairs = [
            str(name).split(": ", 1)
            for name in dataset["comparison_regime_name"].values
        ]
        for k, (law, regime) in enumerate(pairs):
            total = sum(
                float(area[i]) for i, (owner, _) in enumerate(pairs) if owner == law
            )
            if regime == sought and total > 0.0:
                shares[law] = float(area[k]) / total
    return shares


def seizure_warning(dataset: xr.Dataset) -> str | None:
    """Warn of wear by seizure, which the pressures of elastic contact models cause."""
    shares = regime_shares(dataset, "seizure")
    parts = [
        f"{percent(part)} of the wear by {law_title(law)}"
        for law, part in shares.items()
        if part > SEIZURE_SHARE
    ]
    if not parts:
        return None
    return (
        f"{listed(parts)} is seizure, at pressures that elastic contact models exceed "
        "where steel would yield: seizure_cap in [wear] keeps it out"
    )


def group_names(dataset: xr.Dataset) -> NDArray[Any]:
    """Block or class (n,) of each operating point; its own name in older results."""
    suffix = "class" if "operating_point_class" in dataset else "name"
    names: NDArray[Any] = dataset[f"operating_point_{suffix}"].values
    return names


def worn_by_patch(dataset: xr.Dataset) -> NDArray[np.float64]:
    """Worn area (step, operating_point, patch) of each step [m2].

    Patches are those of the state to which the step leads.
    """
    ran = dataset["step_length"].values[:, None] * dataset["active_weight"].values
    area = (
        np.nan_to_num(dataset["wear_area_rate"].values)
        * (ran * dataset["environment"].values)[..., None]
    )
    return np.asarray(area)


def shares_beyond_validity(dataset: xr.Dataset) -> dict[str, float]:
    r"""Share of the worn area beyond the validity of the models, by reason [-].

    It is the wear in patches above the shakedown limit of :math:`p_0/k` [1]_, by
    seizure, and in patches whose largest pressure or mean wear index exceeds that of
    the tests behind the coefficients, where known. Contacts count in the state to which
    a step leads. Empty before the first step.

    References
    ----------
    .. [1] K. L. Johnson, Proc. IMechE Part C 203 (1989) 151-163, see
           `wearsim.damage.fatigue.shakedown`.
    """
    wear = worn_by_patch(dataset)
    if wear.sum() <= 0.0:
        return {}
    force, pressure = dataset["normal_force"].values, dataset["max_pressure"].values
    shear = np.hypot(dataset["force_x"].values, dataset["force_y"].values)
    friction = np.divide(shear, force, out=np.zeros_like(force), where=force > 0.0)
    above = pressure / shear_yield(dataset) > shakedown_limit(np.nan_to_num(friction))
    shares = {"above shakedown": float(wear[above].sum() / wear.sum())}
    if (
        seizure := regime_shares(dataset, "seizure").get(str(dataset.attrs["wear_law"]))
    ) is not None:
        shares["in seizure"] = seizure
    coefficients = COEFFICIENT_SETS.get(str(dataset.attrs.get("wear_coefficients", "")))
    if coefficients is not None and coefficients.tested_up_to:
        beyond = np.any(
            [
                dataset[name].values > largest_tested
                for name, largest_tested in coefficients.tested_up_to.items()
            ],
            axis=0,
        )
        shares["beyond the tests of the law"] = float(wear[beyond].sum() / wear.sum())
    return shares


def shear_yield(dataset: xr.Dataset) -> float:
    """Yield stress in cyclic shear [Pa] of the campaign's fatigue laws.

    Without one, it is that of a published coefficient set.
    """
    yields = (
        dataset["fatigue_shear_yield"].values
        if "fatigue_shear_yield" in dataset
        else np.empty(0)
    )
    stated = yields[np.isfinite(yields)]
    return (
        float(stated[0])
        if stated.size
        else 1e6 * COEFFICIENT_SETS[_SHEAR_YIELD]["shear_yield"]
    )


def low_friction_warning(dataset: xr.Dataset) -> str | None:
    """Warn of low friction together with an environment factor below 1.

    Lubrication may then be counted twice.
    """
    acts = dataset["weight"].values > 0.0
    twice = (
        acts
        & (dataset["friction"].values < LOW_FRICTION)
        & (dataset["environment"].values < 1.0)
    )
    if not twice.any():
        return None
    return (
        f"{twice.sum()} of {acts.sum()} operating points combine friction below "
        f"{LOW_FRICTION:g} with an environment factor below 1: lubrication may be "
        "counted twice"
    )


def outside_warning(dataset: xr.Dataset) -> str | None:
    """Warn of wear in regimes outside the data of a law.

    An example is an index beyond the rows of a wear table.
    """
    for name, law in WEAR_LAWS.items():
        shares = {
            text: regime_shares(dataset, regime).get(name, 0.0)
            for regime, text in law.outside
        }
        parts = [
            f"{percent(share)} of it is {text}"
            for text, share in shares.items()
            if share > OUTSIDE_SHARE
        ]
        if parts:
            return (
                f"wear by the law {law_title(name)} lies outside its data: "
                f"{listed(parts)}, where it follows what the {name} assumes: give it "
                "more rows"
            )
    return None


def cracks_warning(dataset: xr.Dataset) -> str | None:
    """Warn of cracks deeper than the cut of the reprofiling.

    A law without a crack depth gives no depth of damage above 1.
    """
    parts = []
    for law, (damage, crack) in damage_left(dataset).items():
        if damage > 1.0:
            least = f"{1e3 * crack:.2g} mm deep or deeper"
            index = f"damage index up to {damage:.3g}"
            parts.append(f"of {law_title(law)}, {index}: cracked, {least}")
        elif damage > 0.0:
            depth = f"up to {1e3 * damage * crack:.2g} mm deep"
            parts.append(f"of {law_title(law)}, {depth}")
    if not parts:
        return None
    return (
        f"the lathe left cracks {'; '.join(parts)}; damage among at_limits of "
        "[campaign.reprofiling] has them cut out, a larger cut_mm takes more of them"
    )


def result_warnings(dataset: xr.Dataset) -> list[str]:
    """Return all warnings of this module for one result, one line each."""
    checks = (
        tread_wear_warning,
        left_out_warning,
        load_scale_warning,
        stood_in_warning,
        force_residual_warning,
        onto_flange_warning,
        seizure_warning,
        low_friction_warning,
        outside_warning,
        cracks_warning,
    )
    return [line for check in checks if (line := check(dataset)) is not None]


def percent(share: float) -> str:
    """Format a share [-] in per cent, without an exponent.

    Small values have two digits, larger ones are rounded to whole per cent.
    """
    value = 100.0 * share
    if 0.0 < abs(value) < 1e-3:
        return "less than 0.001 %"
    return f"{value:.2g} %" if abs(value) < 99.5 else f"{value:.0f} %"
