"""Checks between the tables of a scene, and of its profiles: faults and warnings."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from wearsim.contact.equilibrium import TORQUE_RULES
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import Fault, ProfileError, listed, shown
from wearsim.operation.points import REACH, OperatingPoints
from wearsim.profile import measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES
from wearsim.results.limits import LIMITED
from wearsim.scene.campaign import (
    LIMIT_KEYS,
    REPROFILING,
    RollerWearSection,
    campaign_faults,
)
from wearsim.scene.contact import contact_faults
from wearsim.scene.damage import damage_faults
from wearsim.scene.implausible import implausible
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.operation import (
    WHEEL_TORQUES,
    BlockSection,
    ClassSection,
    block_faults,
    load_faults,
    share_faults,
    torque_faults,
)
from wearsim.scene.route import cut_motion, rails_of
from wearsim.scene.section import Messages
from wearsim.toml_faults import KeyPath

WIDEST_POSITION_SPACING_MM = 2.0
"""About half the width of the narrower patches [mm]."""

FURTHEST_CLIMB_MM = 4.0
"""How far beyond the clearance a shift is still solved [mm]: on S1002 the straight
flank of 70 degrees ends there, the wheel stands 10 mm high, and what follows over the
rounded tip is derailment, not wear.
"""

_SAME_DIAMETER_MM = 0.1
"""Diameters in headers are rounded by as much [mm]."""

Campaign = RigScene | FieldScene
Clearance = tuple[float | None, float | None]
Wheels = tuple[Profile, Profile]


def by_line(faults: list[Fault]) -> list[Fault]:
    """Faults in the order of the file."""
    return sorted(faults, key=lambda fault: fault.line or 0)


def cross_faults(scene: Campaign) -> list[Fault]:
    """Faults between values that are each in range."""
    wheelset, runs = scene.wheelset, scene.operation.runs
    of_boxes = None not in (wheelset.mass_kg, wheelset.axle_box_distance_mm)
    independent = getattr(scene.counterface, "drive", None) == "independent"
    fatigue = scene.fatigue.laws if scene.fatigue else ()
    messages = [
        *share_faults(runs),
        *load_faults(runs, of_boxes=of_boxes),
        *block_faults(runs, independent=independent),
        *contact_faults(scene.contact),
        *_roll_faults(scene),
        *torque_faults(runs, rotation=scene.contact.rotation),
        *_torque_faults(scene),
        *_independent_faults(scene),
        *campaign_faults(scene.campaign, fatigue, 2.0 * wheelset.radius_mm),
        *_reprofiled_faults(scene),
    ]
    messages += damage_faults(scene.wear, scene.fatigue)
    law = scene.wear.law
    if scene.counterface.wear is not None and not WEAR_LAWS[law].wears:
        text = (
            f'[counterface.wear] wears where the law of [wear] does, and law = "{law}" '
            "wears nowhere; write another law, or delete the table"
        )
        messages.append((("counterface", "wear"), text))
    places = [*rails_of(scene)[0].values()]
    of_sides = ("profile_left", "roller_radius_left_mm")
    side_keys = [
        key for key in of_sides if getattr(scene.counterface, key, None) is not None
    ]
    if scene.counterface.wear is not None and (side_keys or places[1:]):
        path = places[1] if places[1:] else ("counterface", side_keys[0])
        text = (
            "[counterface.wear] wears one pair of alike rails or rollers; delete it, "
            f"or rails and {listed(side_keys or ['profile_left'], ' and ')}"
        )
        messages.append((path, text))
    return [scene.fault(*message) for message in messages]


def scene_warnings(
    scene: Campaign, wheels: Wheels, counterface: Profile, clearance: Clearance
) -> list[Fault]:
    """Return what is allowed but deserves a second look in a scene without faults.

    In the order of the file.

    Wheels and flange clearances [m] are right and left, the counterface is placed.
    """
    messages = list(_warnings(scene))
    if scene.vehicle is not None:
        free = min(
            (play for play in clearance if play is not None),
            default=math.inf,
        )
        messages += cut_motion(scene.vehicle, free)
    warnings = beyond_clearance(scene, clearance)[1] + [
        scene.fault(*message) for message in messages
    ]
    return by_line(warnings + limit_faults(scene, wheels, counterface, end=False))


def header_warnings(scene: Campaign, diameters: Mapping[str, float]) -> list[Fault]:
    """Warnings of wheel diameters in the headers of files, by name.

    Of diameters [mm] that are not those that act.
    """
    radius, path = scene.wheelset.radius_mm, ("wheelset", "radius_mm")
    stated = " and ".join(
        f"{diameter:g} mm ({name})" for name, diameter in diameters.items()
    )
    if "radius_mm" not in scene.wheelset.model_fields_set:
        if np.ptp([*diameters.values()] or [0.0]) <= _SAME_DIAMETER_MM:
            return []
        text = (
            "radius_mm is not given, and the headers of the wheels differ in diameter, "
            f"{stated}: half the mean acts on both; write the radius"
        )
        return [scene.fault(path, text)]
    if all(
        abs(diameter - 2.0 * radius) <= _SAME_DIAMETER_MM
        for diameter in diameters.values()
    ):
        return []
    text = (
        f"radius_mm = {radius:g} is a diameter of {2.0 * radius:g} mm, the header says "
        f"{stated}; what the scene says acts"
    )
    return [scene.fault(path, text)]


def _warnings(scene: Campaign) -> Messages:
    runs, contact, campaign = scene.operation.runs, scene.contact, scene.campaign
    yield from implausible(scene)
    if (
        runs
        and all(run.friction == 0 for run in runs.values())
        and WEAR_LAWS[scene.wear.law].needs_friction
    ):
        yield (
            (*next(iter(runs)), "friction"),
            "friction = 0 everywhere: nothing will wear",
        )
    if contact.torque_Nm != 0 and contact.rotation not in TORQUE_RULES:
        text = (
            f"torque_Nm = {contact.torque_Nm:g} is without effect where rotation = "
            f'{shown(contact.rotation)} gives the speed; write rotation = "free", or '
            "delete it"
        )
        yield ("contact", "torque_Nm"), text
    yield from _class_warnings(scene)
    yield from _distance_warnings(scene)
    if campaign.smoothing_wavelength_mm == 0:
        path = ("campaign", "smoothing_wavelength_mm")
        yield path, "smoothing_wavelength_mm = 0: wear increments are not smoothed"


def _class_warnings(scene: Campaign) -> Messages:
    """Shares that do not sum to 1, and positions that leave ridges."""
    runs = scene.operation.runs
    classes = {path: run for path, run in runs.items() if isinstance(run, ClassSection)}
    total = sum(run.share for run in classes.values())
    if classes and abs(total - 1.0) > 1e-6:
        text = (
            f"share: the shares of all classes sum to {total:.7g}; they are normalised "
            "to 1"
        )
        yield ("operation", "class", 0, "share"), text
    for path, run in classes.items():
        step = 2.0 * REACH * run.shift_std_mm / (run.positions - 1)
        if step > WIDEST_POSITION_SPACING_MM:
            text = (
                f"positions = {run.positions} lie {step:.2g} mm apart in class "
                f"{shown(run.name)}; more than half a patch width (about "
                f"{WIDEST_POSITION_SPACING_MM:g} mm) leaves ridges between them"
            )
            yield (*path, "positions"), text


def _distance_warnings(scene: Campaign) -> Messages:
    """Redressing and reprofiling that the campaign does not reach."""
    campaign = scene.campaign
    wear, rules, distance = (
        scene.counterface.wear,
        campaign.reprofiling,
        campaign.distance_km,
    )
    interval = wear.redress_every_km if isinstance(wear, RollerWearSection) else None
    if interval is not None and interval >= distance:
        text = (
            f"redress_every_km = {interval:g} is not reached in distance_km = "
            f"{distance:g}: the rollers are not redressed at it"
        )
        yield ("counterface", "wear", "redress_every_km"), text
    beyond = [
        f"{place:g}" for place in (rules.at_km if rules else ()) if place >= distance
    ]
    if beyond:
        text = (
            f"at_km = {listed(beyond)} is not below the distance of the campaign, "
            f"{distance:g} km: the wheels are not reprofiled there"
        )
        yield (*REPROFILING, "at_km"), text


def _roll_faults(scene: Campaign) -> Messages:
    """Faults of a given roll where forces are balanced."""
    contact, runs = scene.contact, scene.operation.runs
    forced = {path: shown(run.name) for path, run in runs.items() if run.balanced}
    if scene.vehicle is not None:
        forced[("vehicle",)] = "the vehicle"
    if forced and "roll" in contact.model_fields_set and contact.roll != "free":
        text = (
            f'roll = "given" lets no forces of {next(iter(forced.values()))} be '
            'balanced; write roll = "free", or delete it'
        )
        yield ("contact", "roll"), text
    for path, run in runs.items() if contact.roll == "free" or forced else ():
        if "roll_mrad" in run.model_fields_set:
            text = (
                f'roll_mrad = {run.roll_mrad:g} and roll = "free" of [contact] exclude '
                "each other: a wheelset free to roll rests on both wheels; delete one "
                "of them"
            )
            yield (*path, "roll_mrad"), text


def _torque_faults(scene: Campaign) -> Messages:
    """Fault of the torque that is furthest beyond friction, if one is."""
    if scene.contact.rotation not in TORQUE_RULES:
        return
    torques = [
        torque
        for path, run in scene.operation.runs.items()
        for torque in _torques(scene, path, run)
    ]
    if (monitor := scene.operation.monitor) is not None:
        load = 2.0 * monitor.friction * monitor.load_kN
        path, value = ("contact", "torque_Nm"), scene.contact.torque_Nm
        torques.append(_Torque("[operation.monitor]", path, value, load, 2))
    worst = max(torques, key=lambda torque: torque.share, default=None)
    if worst is None or worst.share <= scene.wheelset.radius_mm:
        return
    key = str(worst.path[-1])
    text = (
        f"{key} = {worst.value / (1.0 if key == 'torque_Nm' else 1e3):g} is more than "
        f"friction can carry in {worst.place}: {'2 x ' if worst.wheels == 2 else ''}"
        "friction x wheel load x radius_mm = "
        f"{worst.friction * scene.wheelset.radius_mm:.4g} N m; lower the torque"
    )
    yield worst.path, text


class _Torque(NamedTuple):
    """Torque on an axle, or on one wheel."""

    place: str
    path: KeyPath
    value: float  # [N m]
    friction: float  # largest tangential force of the wheels that carry it [kN]
    wheels: int

    @property
    def share(self) -> float:
        """Torque over friction [mm]."""
        return abs(self.value) / max(self.friction, 1e-300)


def _torques(
    scene: Campaign, path: KeyPath, run: BlockSection | ClassSection
) -> list[_Torque]:
    """Torques of a block or class, each with the friction of its own wheels."""
    place = f"{path[1]} {shown(run.name)}"
    friction = max(run.friction, run.friction_flange or 0.0)
    wheels = [
        _Torque(place, (*path, key), 1e3 * torque, friction * load, 1)
        for key, load in zip(WHEEL_TORQUES, run.loads_kN, strict=True)
        if (torque := getattr(run, key)) is not None
    ]
    if wheels:
        return wheels
    # wheels that rotate independently have half of it each, whatever their loads
    alone = scene.contact.rotation == "independent"
    load = 2.0 * min(run.loads_kN) if alone else sum(run.loads_kN)
    if run.axle_torque_kN_m is None:
        path, value = ("contact", "torque_Nm"), scene.contact.torque_Nm
    else:
        path, value = (*path, "axle_torque_kN_m"), 1e3 * run.axle_torque_kN_m
    return [_Torque(place, path, value, friction * load, 2)]


def _independent_faults(scene: Campaign) -> Messages:
    """Fault of a motion on straight track that independent wheels do not have."""
    section = scene.vehicle
    if scene.contact.rotation != "independent" or section is None:
        return
    straight = section.route is not None or any(
        track_class.curve_radius_m is None for track_class in section.track
    )
    guided = section.tangent == "guided" and section.tangent_wavelength_m is not None
    if straight and section.tangent != "shifted" and not guided:
        text = (
            f"tangent = {shown(section.tangent)} needs the steering of an axle "
            '(Klingel\'s wavelength), and rotation = "independent" has none; write '
            'tangent = "shifted", or tangent = "guided" with tangent_wavelength_m'
        )
        yield ("vehicle", "tangent"), text


def _reprofiled_faults(scene: Campaign) -> Messages:
    """Faults of scenes whose wheels are reprofiled."""
    if scene.campaign.reprofiling is None:
        return
    if scene.contact.rotation == "nominal":
        text = (
            'rotation = "nominal" is the rotation speed of new wheels: reprofiled '
            'wheels would slide; write rotation = "free" or "centred", or delete '
            "[campaign.reprofiling]"
        )
        yield ("contact", "rotation"), text
    if scene.origin.role != "scene":
        text = (
            "[campaign.reprofiling] cannot be compared: factors from rig to field are "
            "of the wear since new; delete it, or run this scene by itself"
        )
        yield REPROFILING, text


def shift_ranges(
    scene: Campaign, points: OperatingPoints | None = None
) -> Iterator[tuple[KeyPath, float, float, int]]:
    """Path of each shift in the scene, ends of its range [mm], number of points.

    A route or a record is one range; given its points, as many of one each.
    """
    runs, monitor = list(scene.operation.runs.items()), scene.operation.monitor
    watched = () if monitor is None else monitor.shifts_mm
    for k, (path, run) in enumerate(runs):
        if isinstance(run, ClassSection):
            mean, spread = run.shift_mean_mm, REACH * run.shift_std_mm
            positions = run.positions if run.shift_std_mm > 0 else 1
            yield (*path, "shift_mean_mm"), mean - spread, mean + spread, positions
        else:
            # a shift that follows from a force is within what the flange allows
            ends = (
                [run] if run.positions is None else [run, runs[(k + 1) % len(runs)][1]]
            )
            shifts = [getattr(end, "shift_mm", None) or 0.0 for end in ends]
            key = "shift_mm" if run.shift_mm is not None else "lateral_force_kN"
            yield (*path, key), min(shifts), max(shifts), run.positions or 1
    if scene.vehicle is not None:
        for k in (0,) if points is None else points.of_track:
            path = (
                ("vehicle", "class", k)
                if scene.vehicle.route is None
                else ("vehicle", "route")
            )
            yield path, 0.0, 0.0, 1  # within what the flange allows
    if scene.recorded is not None:
        samples = 1 if points is None else len(points.label) - len(watched)
        yield ("recorded", "file"), 0.0, 0.0, samples
    for index, shift in enumerate(watched):
        yield ("operation", "monitor", "shifts_mm", index), shift, shift, 1


def places_of(scene: Campaign, points: OperatingPoints) -> tuple[KeyPath, ...]:
    """Path of the key in the scene that each operating point comes from."""
    return tuple(
        path for path, _, _, count in shift_ranges(scene, points) for _ in range(count)
    )


def key_of(path: KeyPath) -> str:
    """Last key of a path, without the index in its list."""
    return str(path[-1] if isinstance(path[-1], str) else path[-2])


def fit_faults(
    scene: Campaign,
    wheels: Wheels,
    counterface: Profile,
    gauges: Mapping[float, KeyPath],
) -> list[Fault]:
    """Fault of a wheelset that does not stand on its rails, if there is any.

    Gauges [mm] with their keys.
    """
    try:
        right, left = (
            1e3 * measures.flange_thickness(wheel.y, wheel.z) for wheel in wheels
        )
        for wheel in wheels:  # the places of the scene must lie on its wheels, too
            measures.flange_thickness(wheel.y, wheel.z, scene.wheelset.measuring_rule)
    except ProfileError as error:
        return [
            scene.fault(("wheelset", "profile"), f"no flange can be measured: {error}")
        ]
    narrowest, over = min(gauges), scene.wheelset.back_to_back_mm + right + left
    if over >= narrowest:
        text = (
            f"gauge_mm = {narrowest:g} must be above {over:.4g} mm, the width over "
            f"both flanges (back_to_back_mm = {scene.wheelset.back_to_back_mm:g} + "
            f"{right:.4g} + {left:.4g}); give the gauge of the track or the "
            "back-to-back distance of the wheelset"
        )
        return [scene.fault(gauges[narrowest], text)]
    top = float(counterface.y[np.argmin(counterface.z)])
    for path, low, high, _ in shift_ranges(scene):
        for shift in (low, high):
            for sign, wheel in zip((1.0, -1.0), wheels, strict=True):
                missing = top - (float(wheel.y[-1]) + sign * 1e-3 * shift)
                if missing > 0.0:
                    text = (
                        f"the tread ends {1e3 * missing:.3g} mm short of the "
                        "counterface's top: the wheel has no contact; check gauge_mm = "
                        f"{scene.counterface.gauge_mm:g} and back_to_back_mm = "
                        f"{scene.wheelset.back_to_back_mm:g}"
                    )
                    return [
                        scene.fault(
                            path, f"{key_of(path)}: at a shift of {shift:g} mm {text}"
                        )
                    ]
    return []


def beyond_clearance(
    scene: Campaign, clearance: Clearance
) -> tuple[list[Fault], list[Fault]]:
    """Faults and warnings of shifts at which a wheel climbs its flange.

    Faults are those more than `FURTHEST_CLIMB_MM` beyond the flange clearance. There is
    at most one for each block, class or watched shift. `clearance` is that of the right
    and the left wheel, see `wearsim.profile.conicity.flange_clearance` [m].
    """
    faults_and_warnings: tuple[list[Fault], list[Fault]] = [], []
    right, left = (math.inf if free is None else 1e3 * free for free in clearance)
    for path, low, high, _ in shift_ranges(scene):
        to_right = high - right >= -low - left
        shift, free, wheel = (high, right, "right") if to_right else (low, left, "left")
        beyond = abs(shift) - free
        if beyond <= 0:
            continue
        run = scene.operation.runs.get(path[:3])
        start = f"{key_of(path)}{f'[{path[-1]}]' if run is None else ''} = {low:g} is"
        if isinstance(run, ClassSection):
            start = f"shift_mean_mm = {run.shift_mean_mm:g} is"
            if high > low:
                path = (*path[:-1], "shift_std_mm")
                start = (
                    f"shift_std_mm = {run.shift_std_mm:g}: {REACH:g} standard "
                    f"deviations about shift_mean_mm = {run.shift_mean_mm:g} reach "
                    f"{shift:.4g} mm,"
                )
        far = beyond > FURTHEST_CLIMB_MM
        if far:
            what = (
                f"{start} more than {FURTHEST_CLIMB_MM:g} mm beyond the flange "
                f"clearance of {free:.4g} mm: the {wheel} wheel has climbed off its "
                "flank, on the way to derailment"
            )
        else:
            what = (
                f"{start} beyond the flange clearance of {free:.4g} mm: the {wheel} "
                "wheel climbs its flange"
            )
        text = (
            f"{what}; give smaller shifts, or check gauge_mm = "
            f"{scene.counterface.gauge_mm:g} and back_to_back_mm = "
            f"{scene.wheelset.back_to_back_mm:g}"
        )
        faults_and_warnings[not far].append(scene.fault(path, text))
    for key, value in zip(("profile", "profile_left"), clearance, strict=True):
        if value is None and (
            key == "profile" or scene.wheelset.profile_left is not None
        ):
            text = (
                f"{key}: no part of the flange is as steep as 60 degrees: shifts are "
                "not checked for climbing"
            )
            faults_and_warnings[1].append(scene.fault(("wheelset", key), text))
    return faults_and_warnings


def geometry_faults(
    scene: Campaign, wheels: Wheels, templates: Wheels | None, counterface: Profile
) -> list[Fault]:
    """Limits already met by templates, or by new wheels if a campaign ends at them."""
    faults = [] if templates is None else template_faults(scene, templates, counterface)
    return faults + limit_faults(scene, wheels, counterface, end=True)


def limit_faults(
    scene: Campaign, wheels: Wheels, counterface: Profile, *, end: bool
) -> list[Fault]:
    """Limits that the new wheels meet already.

    Faults of a campaign that ends at them, else warnings.

    `end` says which of both to check.
    """
    limits, rules = scene.campaign.limits, scene.campaign.reprofiling
    if limits is None or limits.end is not end:
        return []
    spared = rules.at_limits if end and rules is not None else ()
    keys = [key for key in LIMIT_KEYS.values() if key not in spared]
    consequence = " already"
    if end:
        consequence += (
            ", and the campaign would end before it begins; change the limit, or "
            "delete end = true"
        )
    return _limits_met(scene, keys, wheels, counterface, "new", consequence)


def template_faults(
    scene: Campaign, templates: Wheels, counterface: Profile
) -> list[Fault]:
    """Limits that wheels of the profiles `templates` would still meet."""
    if scene.campaign.limits is None or scene.campaign.reprofiling is None:
        return []
    keys = scene.campaign.reprofiling.at_limits
    consequence = (
        ", too: wheels would be reprofiled for ever; change the limit, or give another "
        "profile in [campaign.reprofiling]"
    )
    return _limits_met(scene, keys, templates, counterface, "reprofiled", consequence)


def _limits_met(
    scene: Campaign,
    keys: Collection[str],
    wheels: Wheels,
    counterface: Profile,
    state: str,
    consequence: str,
) -> list[Fault]:
    """Limits among `keys` that unworn wheels meet, with the consequence in messages."""
    limits, faults = scene.campaign.limits, []
    for name, limit in ({} if limits is None else limits.values).items():
        have: dict[str, float | None] = {}
        try:
            if name in measures.GAUGE_VALUES:
                rule = scene.wheelset.measuring_rule
                right, left = (
                    measures.gauge_value(name, wheel.y, wheel.z, rule)
                    for wheel in wheels
                )
                have = {"right wheel": right, "left wheel": left}
            elif name == "equivalent_conicity":
                amplitude = 1e-3 * scene.wheelset.conicity_amplitude_mm
                conicity = equivalent_conicity(
                    *wheels, counterface, amplitude=amplitude
                )
                have = {"wheelset": conicity}
        except ProfileError:
            continue  # a measure that the new wheel does not have meets no limit
        quantity, key = QUANTITIES[name], LIMIT_KEYS[name]
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        met = [
            f"the {state} {bodies} ({value * quantity.shown_factor:.4g}{unit})"
            for bodies, value in have.items()
            if value is not None and LIMITED[name] * (value - limit) >= 0.0
        ]
        if met and key in keys:
            text = f"{key} = {getattr(limits, key):g} is met by {met[0]}{consequence}"
            faults.append(scene.fault(("campaign", "limits", key), text))
    return faults
