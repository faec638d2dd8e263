"""Wear rate of wheels at operating points: depth along the profile per metre run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.campaign.evaluate import Setup, carried, solve_passage
from wearsim.campaign.left_out import new_history
from wearsim.campaign.passage import Passage
from wearsim.campaign.running import new_running, settled_state
from wearsim.campaign.state import State
from wearsim.contact.dataset import SIDES, check_kind, check_models, variable
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.fatigue import WEAR_NUMBERS
from wearsim.damage.fatigue.loads import utilised_friction
from wearsim.damage.fatigue.shakedown import shakedown_limit
from wearsim.damage.wear import WEAR_LAWS, WearSettings, coefficients_of
from wearsim.damage.wear.law import Form
from wearsim.errors import ContactError, Fault, ProfileError, SceneError
from wearsim.operation.points import OperatingPoints, where_it_runs
from wearsim.profile.shape import Profile, arc_length, resample_to
from wearsim.scene import (
    CampaignSetup,
    CompareScene,
    FieldScene,
    RigScene,
    build,
    load_campaign,
)

Bodies = tuple[Wheelset, Counterface]
"""Bodies in contact: `wearsim.wheelset` with `wearsim.rails` or `wearsim.rollers`."""

_GIVEN = ("yaw", "speed", "friction", "track_curvature")


def wear_rate(
    scene: str
    | Path
    | Mapping[str, Any]
    | RigScene
    | FieldScene
    | CampaignSetup
    | Bodies,
    conditions: ContactConditions | None = None,
    *,
    profiles: Profile | tuple[Profile, Profile] | None = None,
    counterface: Counterface | None = None,
    models: ContactModels | None = None,
    law: str | None = None,
    coefficients: str | CoefficientSet | None = None,
    form: Form | None = None,
    leave_out: bool = False,
    threads: int = 1,
) -> xr.Dataset:
    r"""Wear rate along the wheel profiles at each operating point, without a campaign.

    Parameters
    ----------
    scene : str, Path, dict, scene, CampaignSetup or (Wheelset, Counterface)
        Scene of a rig or of the field: its bodies, contact models, active wear law and
        operating points; the same as made of a scene; or the bodies alone.
    conditions : ContactConditions, optional
        n operating points, in place of those of the scene; needed with bodies.
    profiles : Profile or pair of them, optional
        Wheels in place of the new ones, of both or of right and left, such as
        `wearsim.worn_profile` gives. Points that forces of a scene control are then
        found anew.
    counterface : Counterface, optional
        Of a scene: rails or rollers in place of the new ones, such as worn ones. Points
        that forces control are found anew, too.
    models : ContactModels, optional
        With bodies: by default `ContactModels()`.
    law : str, optional
        With bodies: wear law, by default "usfd".
    coefficients : str or CoefficientSet, optional
        With bodies: by default the set of the law.
    form : {"local", "patch_mean"}, optional
        With bodies: by default the first form of the law.
    leave_out : bool
        Whether points without contact solution are left out: their rates, pressures and
        powers are NaN.
    threads : int
        Of the contact solver; the result has the same bits for any number.

    Returns
    -------
    xarray.Dataset
        Over operating_point, wheel, regime and point of the profile:
        `wear_depth_rate` [m/m], along the normal, not smoothed. Over operating_point,
        wheel and point: `friction_work` [J/m3]. Over operating_point and wheel:
        `wear_area_rate` [m2/m], the largest `max_pressure` [Pa], `wear_index_max`
        [Pa] and `shakedown_yield` [Pa] of the patches, and the sums of their
        `wear_number_with_spin` [N] and `power` [W], 0 of a wheel without contact.
        `shift`, `yaw` and so on (operating_point) tell where the wheelset runs. All as
        if the wheelset ran in that point alone:
        multiplied by `weight` and `environment` (operating_point) and summed over the
        points they are those of the collective. `profile_y`, `profile_z` and
        `arc_length` (wheel, point) are coordinates, names of points, wheels and regimes
        are those of their dimensions; `conditions` are numbered from 0. What brake
        blocks wear is left out.

    Raises
    ------
    WearsimError
        For faults of the scene, arguments that do not fit together, and, unless they
        are left out, points without contact solution.

    Notes
    -----
    Depth per metre is the depth of a passage over :math:`2 \pi r(y)`,
    :math:`r = r_0 + z`. The area removed by each strip is distributed over the arc
    lengths of its points, so that the sum over the points is that over the strips.

    Examples
    --------
    >>> import wearsim
    >>> bodies = wearsim.wheelset("S1002"), wearsim.rails("60E1", inclination=1 / 40)
    >>> points = wearsim.ContactConditions.of([0.0, 3e-3], yaw=1e-3)
    >>> rate = wearsim.wear_rate(bodies, points, models=wearsim.ContactModels.of("fast"))
    >>> rate["wear_depth_rate"].dims
    ('operating_point', 'wheel', 'regime', 'point')
    >>> right = rate.sel(wheel="right")
    >>> bool(right["wear_area_rate"][1] > right["wear_area_rate"][0])
    True
    """
    campaign = None
    if isinstance(scene, tuple):
        if counterface is not None:
            raise ContactError("bodies have a counterface; leave counterface out")
        points, setup = _of_bodies(
            scene, conditions, models, _settings(law, coefficients, form), threads
        )
    else:
        options = {
            "models": models,
            "law": law,
            "coefficients": coefficients,
            "form": form,
        }
        if stated := [name for name, value in options.items() if value is not None]:
            fix = "change it there, or by overrides of load_scene"
            raise ContactError(f"{stated[0]} is stated by the scene; {fix}")
        campaign = (
            scene if isinstance(scene, CampaignSetup) else build(_campaign_of(scene))
        )
        points, setup = campaign.points, _setup(campaign, threads)
        if counterface is not None:
            setup = replace(setup, counterface=counterface)
        if conditions is not None:
            check_kind(
                "conditions",
                conditions,
                ContactConditions,
                "wearsim.ContactConditions.of",
            )
            points = points_of(conditions)
    wheels = setup.wheelset.right, setup.wheelset.left
    if profiles is not None:
        wheels = (profiles, profiles) if isinstance(profiles, Profile) else profiles
    state = new_state(
        replace(setup.wheelset, right=_wheel(wheels[0]), left=_wheel(wheels[1]))
    )
    if campaign is not None and conditions is None:
        state = replace(state, running=new_running(campaign))
        if profiles is not None or counterface is not None:
            state, _ = settled_state(state, points, setup)
        points = where_it_runs(points, state.running)
    if leave_out:
        state = replace(state, points=new_history(points))
    passage = solve_passage(state, points, setup)
    return _dataset(passage, points, state, setup, conditions is None)


def new_state(wheelset: Wheelset) -> State:
    """State of a wheelset before its first step.

    Its left wheel gets as many points as the right one.
    """
    right, left = wheelset.right, resample_to(wheelset.left, wheelset.right.y.size)
    y, z = np.stack([right.y, left.y]), np.stack([right.z, left.z])
    unworn, wheel_zeros = np.zeros_like(y), np.zeros(2)
    return State(0, 0.0, y, z, unworn, unworn[:, None], wheel_zeros, wheel_zeros)


def points_of(conditions: ContactConditions) -> OperatingPoints:
    """Operating points of equal weight, numbered, without environment factor."""
    count = conditions.shift.size
    ones = np.ones(count)
    return OperatingPoints(
        conditions, ones / count, ones, np.zeros(count), tuple(map(str, range(count)))
    )


def _settings(
    law: str | None, coefficients: str | CoefficientSet | None, form: Form | None
) -> WearSettings:
    """Return consistent settings of a wear law, by default its own."""
    record = WEAR_LAWS["usfd" if law is None else law]
    wear = WearSettings(
        record.name, coefficients or record.coefficients or "", form or record.forms[0]
    )
    coefficients_of(wear)  # raises where they do not
    return wear


def _of_bodies(
    bodies: Bodies,
    conditions: ContactConditions | None,
    models: ContactModels | None,
    wear: WearSettings,
    threads: int,
) -> tuple[OperatingPoints, Setup]:
    """Operating points, and the inputs of their wear, for given bodies."""
    if len(bodies) != 2:
        raise ContactError(
            f"bodies are a wheelset and a counterface, not {len(bodies)} values"
        )
    models = ContactModels() if models is None else models
    check_kind("wheelset", bodies[0], Wheelset, "wearsim.wheelset")
    check_kind(
        "counterface", bodies[1], Counterface, "wearsim.rails or wearsim.rollers"
    )
    check_kind(
        "conditions", conditions, ContactConditions, "wearsim.ContactConditions.of"
    )
    check_kind("models", models, ContactModels, "wearsim.ContactModels.of")
    check_models(models)
    assert conditions is not None
    return points_of(conditions), Setup(*bodies, models, wear, threads=threads)


def _campaign_of(
    scene: str | Path | Mapping[str, Any] | RigScene | FieldScene,
) -> RigScene | FieldScene:
    if not isinstance(scene, RigScene | FieldScene):
        loaded = (
            load_campaign(scene) if isinstance(scene, str | Path | Mapping) else scene
        )
        if not isinstance(loaded, RigScene | FieldScene):
            both = (
                "; give its rig or its field"
                if isinstance(loaded, CompareScene)
                else ""
            )
            raise SceneError(
                [Fault(f"a scene of a rig or of the field, or bodies are needed{both}")]
            )
        return loaded
    return scene


def _setup(campaign: CampaignSetup, threads: int) -> Setup:
    """Return the inputs of the wear by the active law."""
    return Setup(
        campaign.wheelset,
        campaign.counterface,
        campaign.models,
        campaign.wear,
        threads=threads,
    )


def _wheel(profile: Profile) -> Profile:
    if not isinstance(profile, Profile) or profile.kind != "wheel":
        raise ProfileError("give one wheel, or the right and the left one, as profiles")
    return profile


def _dataset(
    passage: Passage, points: OperatingPoints, state: State, setup: Setup, named: bool
) -> xr.Dataset:
    """Wear rates of a passage; operating points have their names, or numbers."""
    contact, wear, count = passage.contact, passage.wear, len(points.label)
    assert wear is not None
    regimes = WEAR_LAWS[setup.wear.law].regimes
    along = np.empty((count, 2, len(passage.depth) + 1, state.y.shape[1]))
    for k in range(count):
        alone = np.repeat((contact.point == k)[None].astype(float), 2, axis=0)
        along[k] = carried(passage, alone, state, setup)
    along[list(passage.failed)] = np.nan
    depth, work = along[:, :, :-1], along[:, :, -1]
    at = (contact.point, contact.side)

    def of_wheel(values: FloatArray, collect: np.ufunc) -> FloatArray:
        result = np.zeros((count, 2))
        collect.at(result, at, values)
        result[list(passage.failed)] = np.nan
        return result

    roll = np.zeros(count)
    roll[contact.point] = contact.roll
    point, wheel = ("operating_point",), ("operating_point", "wheel")
    arc = np.stack([arc_length(y, z) for y, z in zip(state.y, state.z, strict=True)])
    yields = contact.max_pressure / shakedown_limit(utilised_friction(contact))
    columns = {
        "wear_depth_rate": ((*wheel, "regime", "point"), depth),
        "friction_work": ((*wheel, "point"), work),
        "wear_area_rate": (wheel, of_wheel(wear.area_rate, np.add)),
        "max_pressure": (wheel, of_wheel(contact.max_pressure, np.maximum)),
        "wear_index_max": (wheel, of_wheel(passage.work_density_max, np.maximum)),
        "shakedown_yield": (wheel, of_wheel(yields, np.maximum)),
        "wear_number_with_spin": (
            wheel,
            of_wheel(WEAR_NUMBERS["with_spin"](contact), np.add),
        ),
        "power": (wheel, of_wheel(contact.power, np.add)),
        "shift": (point, points.conditions.axle_shift(roll)),
        **{name: (point, getattr(points.conditions, name)) for name in _GIVEN},
        "wheel_load": (point, points.conditions.loads.mean(axis=1)),
        "weight": (point, points.weight),
        "environment": (point, points.environment),
    }
    places = {
        "profile_y": (("wheel", "point"), state.y),
        "profile_z": (("wheel", "point"), state.z),
        "arc_length": (("wheel", "point"), arc),
    }
    names = {
        "operating_point": list(points.label) if named else np.arange(count),
        "wheel": list(SIDES),
        "regime": list(regimes),
    }
    return xr.Dataset(
        {name: variable(name, *column) for name, column in columns.items()},
        coords={
            **{name: variable(name, *column) for name, column in places.items()},
            **names,
        },
        attrs={
            "wear_law": setup.wear.law,
            "wear_form": setup.wear.form,
            "contact_normal": setup.models.normal,
            "contact_tangential": setup.models.tangential,
        },
    )
