"""Contact solver for users: bodies by name, arrays in, a Dataset out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Literal, SupportsFloat

import numpy as np
import xarray as xr

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    ContactPatches,
    ContactSolution,
    Counterface,
    Wheelset,
)
from wearsim.contact.registry import Registry
from wearsim.contact.solve import solve_each
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.contact.wheels import joined
from wearsim.errors import (
    ContactError,
    Fault,
    ProfileError,
    brief,
    issue_warning,
)
from wearsim.profile.files import is_file, load_profile
from wearsim.profile.placement import GAUGE, INCLINATION
from wearsim.profile.point_noise import noise_note
from wearsim.profile.shape import Profile
from wearsim.profile.sources import half_span
from wearsim.quantities import QUANTITIES

Side = Literal["right", "left"]
SIDES: tuple[Side, Side] = ("right", "left")

_PATCH = (
    "wheel_y",
    "rail_y",
    "x",
    "contact_angle",
    "area",
    "max_pressure",
    "length",
    "width",
    "approach",
    "normal_force",
    "load_scale",
    "stood_in",
    "creepage_x",
    "creepage_y",
    "spin",
    "force_x",
    "force_y",
    "spin_moment",
    "slip_area",
    "power",
    "power_balance",
    "track_lateral",
    "track_vertical",
    "track_longitudinal",
    "track_yaw_moment",
)
_CELLS = ("pressure", "shear_x", "shear_y", "slip_x", "slip_y", "work_density")
_CONDITIONS = ("yaw", "speed", "friction", "track_curvature")

Columns = dict[str, tuple[tuple[str, ...], Any]]
"""Dimensions and values by quantity name."""


def wheelset(
    profile: str | Path | Profile,
    *,
    left: str | Path | Profile | None = None,
    radius: float = 0.460,
    back_to_back: float = 1.360,
    diameter_difference: float = 0.0,
) -> Wheelset:
    """Wheelset of two wheels, by name, file or profile.

    Parameters
    ----------
    profile : str, Path or Profile
        Of both wheels: a standard shape such as "S1002/h30", a profile file, or a
        profile in metres.
    left : str, Path or Profile, optional
        Of the left wheel, if it differs; in the axes of a right wheel, too.
    radius : float
        At the running circle [m].
    back_to_back : float
        Distance between the inner wheel faces [m].
    diameter_difference : float
        Diameter of the right wheel less that of the left one [m].

    Returns
    -------
    Wheelset
        For `solve_contact`.

    Raises
    ------
    ProfileError
        A name is unknown, a file cannot be read, the profile is that of a rail, or a
        length is out of range.

    Examples
    --------
    >>> import wearsim
    >>> wheelset = wearsim.wheelset("S1002", radius=0.460)
    >>> wheelset.half_span
    0.75
    """
    right = _wheel(profile)
    left_wheel = right if left is None else _wheel(left)
    if fault := QUANTITIES["wheel_diameter_difference"].fault(
        diameter_difference, "diameter_difference"
    ):
        raise ProfileError(fault)
    span = half_span(back_to_back)
    return Wheelset(
        right, left_wheel, _radius(radius, "wheel_radius"), span, diameter_difference
    )


def rails(
    profile: str | Path | Profile,
    *,
    left: str | Path | Profile | None = None,
    inclination: float | None = None,
    gauge: float | None = None,
    back_to_back: float | None = None,
    gauge_height: float | None = None,
) -> Counterface:
    """Track of two rails, by name, file or profile.

    Parameters
    ----------
    profile : str, Path or Profile
        Of both rails: a standard shape such as "60E1", a profile file, or a profile as
        placed in the track.
    left : str, Path or Profile, optional
        Of the left rail, if it differs; in the axes of the right side, too.
    inclination : float, optional
        Tangent of the tilt towards the track centre, by default 1/40 [-].
    gauge : float, optional
        Distance of the gauge points, by default 1.435 [m].
    back_to_back : float, optional
        Of the wheelset: it fixes the origin of the wheel profile, which is that of the
        rail; by default 1.360 [m].
    gauge_height : float, optional
        Depth below the top of the rail at which the gauge is measured, by default
        0.014 [m].

    Returns
    -------
    Counterface
        For `solve_contact`.

    Raises
    ------
    ProfileError
        A name is unknown, a file cannot be read, the profile is that of a wheel, or a
        profile is placed in the track already and inclination, gauge or back_to_back
        are given again.

    Examples
    --------
    >>> import wearsim
    >>> wearsim.rails("60E1", inclination=1 / 20, gauge=1.437).curvature
    0.0
    """
    place = {
        "inclination": inclination,
        "gauge": gauge,
        "back_to_back": back_to_back,
        "gauge_height": gauge_height,
    }
    return Counterface(
        _rail(profile, place), 0.0, None if left is None else _rail(left, place)
    )


def rollers(
    profile: str | Path | Profile,
    *,
    radius: float,
    radius_left: float | None = None,
    left: str | Path | Profile | None = None,
    inclination: float | None = None,
    gauge: float | None = None,
    back_to_back: float | None = None,
    gauge_height: float | None = None,
) -> Counterface:
    """Pair of rollers with a rail's profile, by name, file or profile.

    Parameters
    ----------
    profile, left, inclination, gauge, back_to_back, gauge_height
        As of `rails`.
    radius, radius_left : float
        At the profile's top, and that of the left roller if it differs [m]. On one
        shaft they run at unlike speeds: `speed_difference` of the conditions is then
        the `coupled_difference` of the counterface.

    Returns
    -------
    Counterface
        For `solve_contact`.

    Raises
    ------
    ProfileError
        As `rails`, or the radius is out of its range.

    Examples
    --------
    >>> import wearsim
    >>> wearsim.rollers("60E1", radius=0.5).curvature
    2.0
    """
    track = rails(
        profile,
        left=left,
        inclination=inclination,
        gauge=gauge,
        back_to_back=back_to_back,
        gauge_height=gauge_height,
    )
    left_curvature = (
        None if radius_left is None else 1.0 / _radius(radius_left, "roller_radius")
    )
    curvature = 1.0 / _radius(radius, "roller_radius")
    return Counterface(
        track.profile, curvature, track.left, left_curvature=left_curvature
    )


def solve_contact(
    wheelset: Wheelset,
    counterface: Counterface,
    conditions: ContactConditions,
    models: ContactModels | None = None,
    *,
    sides: Side | Sequence[Side] = SIDES,
    load: Literal["wheel", "normal_force"] = "wheel",
    fields: bool = False,
    threads: int = 1,
) -> xr.Dataset:
    """Solve the contact of a wheelset at every operating point.

    Parameters
    ----------
    wheelset : Wheelset
        See `wearsim.wheelset`.
    counterface : Counterface
        See `wearsim.rails` and `wearsim.rollers`.
    conditions : ContactConditions
        n operating points, see `ContactConditions.of`.
    models : ContactModels, optional
        Normal and tangential model, grid and material; by default `ContactModels()`.
    sides : {"right", "left"} or sequence of them
        Wheels of the result.
    load : {"wheel", "normal_force"}
        Whether `wheel_load` is the vertical load of the wheel, which normal and creep
        forces carry together, or the normal force of its single patch.
    fields : bool
        Whether strips and cells of every patch are in the result; they need a hundred
        times the memory.
    threads : int
        Of the solver; the result has the same bits for any number.

    Returns
    -------
    xarray.Dataset
        SI units, with `units` and `long_name`. Over `patch`, ordered by point, side and
        falling normal force: coordinates `point` (index of the operating point) and
        `side`, and wheel_y, rail_y, x, contact_angle, area, max_pressure, length,
        width, approach, normal_force, load_scale, stood_in, creepage_x, creepage_y,
        spin, force_x, force_y, spin_moment, slip_area, power, power_balance, and normal
        and creep force together in the axes of the track: track_lateral,
        track_vertical, track_longitudinal, track_yaw_moment. Over `operating_point`:
        shift, yaw, roll, wheel_load, speed, friction, track_curvature and
        rotation_speed; that of wheels which rotate independently is the mean of both,
        and wheel_rotation_speed over `patch` that of each. With `fields`, over (patch, strip): lateral, x_lead, x_trail,
        cells_lead, cells_trail, strip_work; strip_width over patch; strip_wheel_y_edges
        and strip_rail_y_edges (patch, strip_edge); over (patch, cell, strip), cells
        from the leading edge: pressure, shear_x, shear_y, slip_x, slip_y, work_density.
        Each patch has strips and cells by its size; those behind them, up to the
        largest numbers of all patches, have no length and hold zeros. Models that solve
        the pressure on a grid add cell_pressure (patch, grid_cell, strip), grid_lead
        and grid_trail. Forces and shear act on the wheel, with the signs of the track
        axes.
        `stood_in` is 1 where another model solved the wheel than `models` has, which
        has no solution.

    Raises
    ------
    ContactError
        If a wheel is not in contact, its patch reaches the edge of a profile, creepages
        are given and several patches are in contact, or the flange locks: friction x
        tan(contact angle) reaches 1 where it climbs. The message names the point. Also
        if a model, a parameter or a side is unknown, or a number of `models` is out of
        range.

    Examples
    --------
    >>> import wearsim
    >>> contact = wearsim.solve_contact(
    ...     wearsim.wheelset("S1002", radius=0.460),
    ...     wearsim.rails("60E1", inclination=1 / 40),
    ...     wearsim.ContactConditions.of(shift=[0.0, 3e-3], wheel_load=80e3, friction=0.35),
    ...     sides=["right"],
    ... )
    >>> contact["side"].values.tolist()
    ['right', 'right']
    >>> bool(contact["max_pressure"][1] > contact["max_pressure"][0])
    True
    """
    models = ContactModels() if models is None else models
    check_kind("wheelset", wheelset, Wheelset, "wearsim.wheelset")
    check_kind(
        "counterface", counterface, Counterface, "wearsim.rails or wearsim.rollers"
    )
    check_kind(
        "conditions", conditions, ContactConditions, "wearsim.ContactConditions.of"
    )
    check_kind("models", models, ContactModels, "wearsim.ContactModels.of")
    check_models(models)
    pairs = 1 + len(counterface.further)
    for rail in np.unique([] if conditions.rail is None else conditions.rail).tolist():
        if rail not in range(pairs):
            raise ContactError(
                f"rail = {rail} must be at least 0 and below {pairs}, the pairs of "
                "rails"
            )
    _check_name("load", load, ("wheel", "normal_force"))
    sides = (sides,) if isinstance(sides, str) else sides
    for side in sides or ("",):
        _check_name("sides", side, SIDES)
    parts = solve_each(
        conditions,
        wheelset,
        counterface,
        models,
        lambda solution: (solution.patches(), solution if fields else None),
        sides=tuple(sorted({SIDES.index(side) for side in sides})),
        vertical=load == "wheel",
        threads=threads,
        fields=fields or "work",
    )
    patches: ContactPatches = joined([of_chunk for of_chunk, _ in parts])
    columns = patch_columns(patches)
    if fields:
        columns |= field_columns(joined([solution for _, solution in parts]))
    first = np.searchsorted(columns["point"][1], np.arange(conditions.shift.size))
    last = np.append(first[1:], columns["point"][1].size) - 1
    for name in ("roll", "rotation_speed"):  # equal for all patches of a wheel
        values = columns[name][1]
        columns[name] = ("operating_point",), 0.5 * (values[first] + values[last])
    if conditions.independent:
        columns["wheel_rotation_speed"] = ("patch",), patches.rotation_speed
    columns["shift"] = (("operating_point",), conditions.axle_shift(columns["roll"][1]))
    columns |= {
        name: (("operating_point",), getattr(conditions, name)) for name in _CONDITIONS
    }
    columns["wheel_load"] = (("operating_point",), conditions.loads.mean(axis=1))
    dataset = xr.Dataset(
        {name: variable(name, *column) for name, column in columns.items()}
    )
    dataset = dataset.set_coords(["point", "side"])
    dataset.attrs = {
        "wheel_profile": wheelset.right.name,
        "wheel_profile_left": wheelset.left.name,
        "counterface_profile": counterface.profile.name,
        "wheel_radius": wheelset.radius,
        "half_span": wheelset.half_span,
        "counterface_curvature": counterface.curvature,
        "normal_model": models.normal,
        "tangential_model": models.tangential,
        **{
            name: getattr(models, name)
            for name in ("strips", "cells", "cell_size", "most_cells")
        },
        "rotation_rule": conditions.rotation
        if isinstance(conditions.rotation, str)
        else "given",
    }
    return dataset


def _check_name(what: str, name: str, known_names: Iterable[str]) -> None:
    if name not in known_names:
        raise ContactError(f"{what} = {name!r} is not one of {', '.join(known_names)}")


def check_kind(name: str, value: object, kind: type, maker: str) -> None:
    """Raise an error for an argument of the wrong kind."""
    if not isinstance(value, kind):
        given = (
            repr(value)
            if isinstance(value, str | int | float)
            else f"a {type(value).__name__}"
        )
        raise ContactError(f"{name} is {brief(given)}; give what {maker} returns")


def _check_number(name: str, value: object) -> None:
    if not isinstance(value, SupportsFloat):
        raise ContactError(f"{name} = {brief(repr(value))} must be a number")


_RANGED = (
    "poisson_ratio",
    "kalker_factor",
    "friction_ratio",
    "friction_decrease",
    "strips",
    "cells",
    "cell_size",
    "most_cells",
)


def check_models(models: ContactModels) -> None:
    """Check names of models and parameters, and ranges of material and parameters."""
    registries: tuple[Registry[Any], ...] = NORMAL_MODELS, TANGENTIAL_MODELS
    for registry, what in zip(registries, ("normal", "tangential"), strict=True):
        name = getattr(models, what)
        if name not in registry and (reason := registry.unusable.get(name)):
            raise ContactError(f"{what} = {name!r} {reason}")
        _check_name(what, name, registry)
    _check_number("youngs_modulus", models.youngs_modulus)
    if not 0.0 < models.youngs_modulus < np.inf:
        raise ContactError(
            f"youngs_modulus = {models.youngs_modulus:g} must be above 0 Pa and finite"
        )
    for name in _RANGED:
        if fault := QUANTITIES[name].fault(getattr(models, name)):
            raise ContactError(fault)
    parameter_names = sorted(
        {name for model in NORMAL_MODELS.values() for name in model.parameters}
        - {"cells"}
    )
    try:
        parameters = [(name, value) for name, value in models.parameters]
    except (TypeError, ValueError):
        raise ContactError(
            f"parameters = {brief(str(models.parameters))} must be pairs of a name and "
            'a number, such as (("virtual_penetration_factor", 0.55),)'
        ) from None
    for name, value in parameters:
        _check_name("name of a parameter", name, parameter_names)
        _check_number(name, value)
        if not 0.0 < value < np.inf:
            raise ContactError(f"{name} = {value:g} must be above 0 and finite")
        if name in QUANTITIES and (fault := QUANTITIES[name].fault(value)):
            raise ContactError(fault)


def patch_columns(solution: ContactPatches) -> Columns:
    """Quantities of m patches.

    Returns
    -------
    dict
        Dimensions, and values (m,) by name.
    """
    return {
        "point": (("patch",), solution.point),
        "side": (("patch",), np.array(SIDES)[solution.side]),
        **{
            name: (("patch",), getattr(solution, name))
            for name in (*_PATCH, "roll", "rotation_speed")
        },
    }


def field_columns(solution: ContactSolution) -> Columns:
    """Quantities of the strips and cells of the m patches of a solution.

    Returns
    -------
    dict
        Dimensions, `patch` first, and values (m, ...) by name.
    """
    patch, cells = solution.patch, solution.fields
    strip, edge, cell = (
        ("patch", "strip"),
        ("patch", "strip_edge"),
        ("patch", "cell", "strip"),
    )
    columns: Columns = {
        "lateral": (strip, np.where(solution.side == 1, -1.0, 1.0)[:, None] * patch.y),
        "strip_width": (("patch",), patch.width),
        "strip_wheel_y_edges": (edge, solution.strip_edges_wheel_y),
        "strip_rail_y_edges": (edge, solution.strip_edges_rail_y),
        "x_lead": (strip, patch.x_lead),
        "x_trail": (strip, patch.x_trail),
        "cells_lead": (strip, cells.x_lead),
        "cells_trail": (
            strip,
            cells.x_lead - cells.pressure.shape[1] * cells.cell_length,
        ),
        "strip_work": (strip, cells.strip_work),
        **{name: (cell, getattr(cells, name)) for name in _CELLS},
    }
    if (grid := patch.grid) is not None:
        columns |= {
            "cell_pressure": (("patch", "grid_cell", "strip"), grid.pressure),
            "grid_lead": (("patch",), grid.x_lead),
            "grid_trail": (
                ("patch",),
                grid.x_lead - grid.pressure.shape[1] * grid.cell_length,
            ),
        }
    return columns


def variable(name: str, dimensions: tuple[str, ...], values: Any) -> xr.Variable:
    """Dataset variable with the attributes of its quantity.

    Parameters
    ----------
    name : str
        Key of `QUANTITIES`, or "point".
    dimensions : tuple of str
        Of the values.
    values : array
        SI units.
    """
    if name == "point":
        return xr.Variable(
            dimensions, values, {"long_name": "index of the operating point"}
        )
    return xr.Variable(dimensions, values, QUANTITIES[name].attributes)


def _wheel(profile: str | Path | Profile) -> Profile:
    """Wheel profile from a name, a file or a profile."""
    return (
        _of_kind(profile, "wheel")
        if isinstance(profile, Profile)
        else _warned(profile, load_profile(profile, "wheel"))
    )


def _rail(profile: str | Path | Profile, placed: dict[str, float | None]) -> Profile:
    """Rail profile, placed in the track, from a name, a file or a profile."""
    given: dict[str, Any] = {
        name: value for name, value in placed.items() if value is not None
    }
    if not isinstance(profile, Profile):
        where: dict[str, Any] = {
            "inclination": INCLINATION,
            "gauge": GAUGE,
            "back_to_back": 1.360,
        } | given
        span = half_span(where.pop("back_to_back"))
        return _warned(profile, load_profile(profile, "rail", half_span=span, **where))
    if given:
        raise ProfileError(
            f"profile {profile.name!r} is placed in the track already; give "
            f"{next(iter(given))} to wearsim.standard_profile or wearsim.read_profile"
        )
    return _of_kind(profile, "rail")


def _warned(name: str | Path, profile: Profile) -> Profile:
    """Return a profile, with a warning of noise if its name is that of a file."""
    if is_file(str(name)) and (note := noise_note(profile)):
        issue_warning(Fault(f"{note} (smooth of wearsim.read_profile)", str(name)), 5)
    return profile


def _of_kind(profile: Profile, kind: str) -> Profile:
    if profile.kind != kind:
        raise ProfileError(
            f"profile {profile.name!r} is that of a {profile.kind}, a {kind} is needed"
        )
    return profile


def _radius(value: float, name: str) -> float:
    """Radius of a wheel or roller, checked for its range [m]."""
    if fault := QUANTITIES[name].fault(value, "radius"):
        raise ProfileError(fault)
    return value
