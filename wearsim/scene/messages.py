"""What only shows between the values of a scene: faults that forbid a run, warnings that do not."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.damage.fatigue import FATIGUE_LAWS, counts_cycles
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import Fault, ProfileError
from wearsim.operation.points import REACH
from wearsim.operation.recorded import Reduction
from wearsim.profile import measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES
from wearsim.results.limits import LIMITED
from wearsim.scene.campaign import LIMIT_KEYS, STABILITY, LimitsSection, RollerWearSection
from wearsim.scene.damage import damage_faults
from wearsim.scene.implausible import implausible
from wearsim.scene.models import BlockSection, ClassSection, FieldScene, RigScene
from wearsim.scene.vehicle import cut_motion, points_of_track
from wearsim.toml_faults import KeyPath, shown, suggestion

SHARES_ROUNDED = 0.01
"""Shares of classes that sum to 1 within this are taken for rounded ones and normalised."""

WIDEST_POSITION_SPACING_MM = 2.0
"""About half the width of the narrower patches [mm]."""

FURTHEST_CLIMB_MM = 4.0
"""How far beyond the clearance a shift is still solved [mm]: on S1002 the straight flank of 70 degrees ends
there, the wheel stands 10 mm high, and what follows over the rounded tip is derailment, not wear."""

_SAME_DIAMETER_MM = 0.1
"""Diameters in headers are rounded by as much [mm]."""

_OF_WHEEL = ("flange_height", "flange_thickness", "flange_gradient", "hollowing")
"""Limited measures of `profile.measures`."""

_REPROFILING = ("campaign", "reprofiling")

Campaign = RigScene | FieldScene
Clearance = tuple[float | None, float | None]
Wheels = tuple[Profile, Profile]
_Messages = Iterator[tuple[KeyPath, str]]


def by_line(faults: list[Fault]) -> list[Fault]:
    """Faults in the order of the file."""
    return sorted(faults, key=lambda fault: fault.line or 0)


def cross_faults(scene: Campaign) -> list[Fault]:
    """Faults between values that are each in range."""
    checks = (
        _share_faults, _load_faults, _block_faults, _contact_faults, _step_faults, _limit_faults,
        _reprofiling_faults,
    )  # fmt: skip
    messages = [message for check in checks for message in check(scene)]
    messages += damage_faults(scene.wear, scene.fatigue)
    law = scene.wear.law
    if scene.counterface.wear is not None and not WEAR_LAWS[law].wears:
        text = f'[counterface.wear] wears where the law of [wear] does, and law = "{law}" wears nowhere'
        messages.append((("counterface", "wear"), f"{text}; write another law, or delete the table"))
    return [scene.fault(*message) for message in messages]


def scene_warnings(
    scene: Campaign, wheels: Wheels, counterface: Profile, clearance: Clearance
) -> list[Fault]:
    """Return what is allowed but deserves a second look in a scene without faults, in the order of the file.

    Wheels and flange clearances [m] are right and left, the counterface is placed.
    """
    warnings = beyond_clearance(scene, clearance)[1]
    warnings += [scene.fault(*message) for message in _warnings(scene)]
    if isinstance(scene, FieldScene) and scene.vehicle is not None:
        free = min((one for one in clearance if one is not None), default=math.inf)
        warnings += [scene.fault(*message) for message in cut_motion(scene.vehicle, free)]
    return by_line(warnings + limit_faults(scene, wheels, counterface, end=False))


def header_warnings(scene: Campaign, diameters: Mapping[str, float]) -> list[Fault]:
    """Warnings of wheel diameters [mm] in the headers of files, by name, that are not those that act."""
    radius = scene.wheelset.radius_mm
    stated = " and ".join(f"{diameter:g} mm ({name})" for name, diameter in diameters.items())
    path = ("wheelset", "radius_mm")
    if "radius_mm" not in scene.wheelset.model_fields_set:
        if np.ptp([*diameters.values()] or [0.0]) <= _SAME_DIAMETER_MM:
            return []
        text = "radius_mm is not given, and the headers of the wheels differ in diameter"
        return [scene.fault(path, f"{text}, {stated}: half the mean acts on both; write the radius")]
    if all(abs(each - 2.0 * radius) <= _SAME_DIAMETER_MM for each in diameters.values()):
        return []
    text = f"radius_mm = {radius:g} is a diameter of {2.0 * radius:g} mm"
    return [scene.fault(path, f"{text}, the header says {stated}; what the scene says acts")]


def _warnings(scene: Campaign) -> _Messages:
    runs, contact, campaign = scene.operation.runs, scene.contact, scene.campaign
    yield from implausible(scene)
    if runs and all(run.friction == 0 for run in runs.values()) and WEAR_LAWS[scene.wear.law].needs_friction:
        yield (*next(iter(runs)), "friction"), "friction = 0 everywhere: nothing will wear"
    if contact.torque_Nm != 0 and contact.rotation != "free":
        yield (
            ("contact", "torque_Nm"),
            f"torque_Nm = {contact.torque_Nm:g} is without effect where rotation = {shown(contact.rotation)} "
            f'gives the speed; write rotation = "free", or delete it',
        )
    classes = {path: run for path, run in runs.items() if isinstance(run, ClassSection)}
    total = sum(run.share for run in classes.values())
    if classes and abs(total - 1.0) > 1e-6:
        text = f"share: the shares of all classes sum to {total:.7g}; they are normalised to 1"
        yield ("operation", "class", 0, "share"), text
    for path, run in classes.items():
        step = 2.0 * REACH * run.shift_std_mm / (run.positions - 1)
        if step > WIDEST_POSITION_SPACING_MM:
            yield (
                (*path, "positions"),
                f"positions = {run.positions} lie {step:.2g} mm apart in class {shown(run.name)}; more than "
                f"half a patch width (about {WIDEST_POSITION_SPACING_MM:g} mm) leaves ridges between them",
            )
    wear, distance = scene.counterface.wear, campaign.distance_km
    every = wear.redress_every_km if isinstance(wear, RollerWearSection) else None
    if every is not None and every >= distance:
        yield (
            ("counterface", "wear", "redress_every_km"),
            f"redress_every_km = {every:g} is not reached in distance_km = {distance:g}: the rollers are not "
            "redressed at it",
        )
    rules = campaign.reprofiling
    beyond = [f"{place:g}" for place in (rules.at_km if rules else ()) if place >= distance]
    if beyond:
        yield (
            (*_REPROFILING, "at_km"),
            f"at_km = {', '.join(beyond)} is not below the distance of the campaign, {distance:g} km: the "
            "wheels are not reprofiled there",
        )
    if campaign.smoothing_wavelength_mm == 0:
        path = ("campaign", "smoothing_wavelength_mm")
        yield path, "smoothing_wavelength_mm = 0: wear increments are not smoothed"


def _sum(shares: Sequence[float]) -> str:
    """Write a sum of the first few shares."""
    more = f" + ... ({len(shares) - 10} more)" if len(shares) > 10 else ""
    return f"{' + '.join(f'{share:g}' for share in shares[:10])}{more}"


def _share_faults(scene: Campaign) -> _Messages:
    shares = [run.share for run in scene.operation.runs.values() if isinstance(run, ClassSection)]
    if shares and abs(sum(shares) - 1.0) > SHARES_ROUNDED:
        yield (
            ("operation", "class", 0, "share"),
            f"share: the shares of all classes, {_sum(shares)}, must sum to 1 within "
            f"{100 * SHARES_ROUNDED:g} %, not {sum(shares):.7g}; change them",
        )


def _contact_faults(scene: Campaign) -> _Messages:
    contact, runs = scene.contact, scene.operation.runs
    if contact.model is not None:
        for key in sorted(contact.model_fields_set & {"normal", "tangential"}):
            text = f'{key} and model = "{contact.model}" exclude each other; delete one of them'
            yield ("contact", key), text
    on_route = isinstance(scene, FieldScene) and scene.vehicle is not None
    forced = {path: shown(run.name) for path, run in runs.items() if _balanced(run)}
    if on_route:
        forced[("vehicle",)] = "the vehicle"
    for path in forced if contact.model == "auto" else ():
        # positions found by a fast model are not those of the half-space
        text = (
            f'{key_of(path)}: forces are balanced by the fast model alone with model = "auto"; write '
            'model = "accurate", or normal and tangential, in [contact]'
        )
        yield path, text
    if contact.model != "auto" and "tolerance" in contact.model_fields_set:
        text = f'tolerance = {contact.tolerance:g} is for model = "auto"; write that, too, or delete it'
        yield ("contact", "tolerance"), text
    model = NORMAL_MODELS[contact.normal]
    if not model.can_update_profile:
        others = _normal_models("can_update_profile")
        text = f"normal = {shown(contact.normal)} cannot update the profile in a campaign: {model.reason}; "
        yield ("contact", "normal"), f"{text}write {others}"
    if forced and "roll" in contact.model_fields_set and contact.roll != "free":
        first = next(iter(forced.values()))
        text = f'roll = "given" lets no forces of {first} be balanced; write roll = "free", or'
        yield ("contact", "roll"), f"{text} delete it"
    for path, run in runs.items() if contact.roll == "free" or forced else ():
        if "roll_mrad" in run.model_fields_set:
            yield (
                (*path, "roll_mrad"),
                f'roll_mrad = {run.roll_mrad:g} and roll = "free" of [contact] exclude each other: a '
                "wheelset free to roll rests on both wheels; delete one of them",
            )
    if contact.rotation == "free":
        common = ("contact", "torque_Nm")
        states: list[tuple[str, KeyPath, float, float]] = [
            (f"{path[1]} {shown(run.name)}", common, contact.torque_Nm, run.friction * run.mean_load_kN)
            if run.axle_torque_kN_m is None
            else (
                f"{path[1]} {shown(run.name)}",
                (*path, "axle_torque_kN_m"),
                1e3 * run.axle_torque_kN_m,
                run.friction * run.mean_load_kN,
            )
            for path, run in runs.items()
        ]
        monitor = scene.operation.monitor
        if monitor is not None:
            states.append(
                ("[operation.monitor]", common, contact.torque_Nm, monitor.friction * monitor.load_kN)
            )
        nothing: tuple[str, KeyPath, float, float] = ("", common, 0.0, math.inf)
        place, path, torque, force = max(
            [*states, nothing], key=lambda state: abs(state[2]) / max(state[3], 1e-300)
        )
        weakest = 2.0 * force * scene.wheelset.radius_mm  # kN mm = N m
        if abs(torque) > weakest:
            yield (
                path,
                f"{path[-1]} = {torque / (1.0 if path == common else 1e3):g} is more than friction can carry "
                f"in {place}: 2 x friction x wheel load x radius_mm = {weakest:.4g} N m; lower the torque",
            )


def _balanced(run: ClassSection | BlockSection) -> bool:
    """Whether the shift or the wheel loads of a run follow from forces."""
    force = isinstance(run, BlockSection) and (
        run.lateral_force_kN is not None or run.axle_box_right_kN is not None
    )
    return force or run.axle_load_kN is not None


_LOADS = (
    ("load_kN",),
    ("axle_load_kN",),
    ("wheel_load_right_kN", "wheel_load_left_kN"),
    ("axle_box_right_kN", "axle_box_left_kN"),
)
"""Keys of which a run has those of one line."""


def _load_faults(scene: Campaign) -> _Messages:
    for path, run in scene.operation.runs.items():
        named = f"{path[1]} {shown(run.name)}"
        given = [key for line in _LOADS for key in line if getattr(run, key, None) is not None]
        lines = [line for line in _LOADS if set(line) & set(given)]
        known = " or ".join(" and ".join(line) for line in _LOADS if hasattr(run, line[0]))
        if len(lines) != 1:
            text = f"{', '.join(given)} exclude each other" if given else "has no load"
            yield (*path, given[-1]) if given else path, f"{named}: {text}; give either {known}"
        elif len(given) < len(lines[0]):
            missing = next(key for key in lines[0] if key not in given)
            yield (*path, given[0]), f"{named}: {given[0]} is that of one side; give {missing}, too"
        elif given[0] == "axle_box_right_kN" and None in (
            scene.wheelset.mass_kg,
            scene.wheelset.axle_box_distance_mm,
        ):
            text = "forces on axle boxes need mass_kg and axle_box_distance_mm in [wheelset]; add them"
            yield (*path, given[0]), f"{named}: {text}"


_WHERE = ("shift_mm", "lateral_force_kN")
_LENGTHS = ("distance_km", "duration_h", "revolutions")


def _block_faults(scene: Campaign) -> _Messages:
    if not isinstance(scene, RigScene):
        return
    runs = list(scene.operation.runs.items())
    for number, (path, run) in enumerate(runs):
        assert isinstance(run, BlockSection)
        for keys in (_WHERE, _LENGTHS):
            given = [key for key in keys if getattr(run, key) is not None]
            if len(given) != 1:
                what = f"{' and '.join(given)} exclude each other" if given else f"needs {' or '.join(keys)}"
                place = (*path, given[-1]) if given else path
                yield place, f"block {shown(run.name)}: {what}; give exactly one of them"
        if scene.counterface.drive != "independent" and run.speed_difference_percent:
            text = 'speed_difference_percent needs rollers that turn apart; write drive = "independent"'
            yield (*path, "speed_difference_percent"), f"block {shown(run.name)}: {text}, or delete it"
        following = runs[(number + 1) % len(runs)][1]
        every = {key for line in (*_LOADS, _WHERE) for key in line}
        have, need = ({k for k in every if getattr(one, k, None) is not None} for one in (run, following))
        if run.positions is not None and have != need:
            text = f"a ramp goes to {shown(following.name)}, which does not give the same set-points"
            differing = ", ".join(sorted(have ^ need))
            yield (*path, "positions"), f"block {shown(run.name)}: {text} ({differing}); give them in both"


def _normal_models(attribute: str) -> str:
    names = (name for name, model in NORMAL_MODELS.items() if getattr(model, attribute))
    return " or ".join(f"normal = {shown(name)}" for name in names)


def _step_faults(scene: Campaign) -> _Messages:
    campaign = scene.campaign
    if 0 < campaign.smoothing_wavelength_mm < 2.0 * campaign.point_spacing_mm:
        yield (
            ("campaign", "smoothing_wavelength_mm"),
            f"smoothing_wavelength_mm = {campaign.smoothing_wavelength_mm:g} must be 0 (no smoothing) or at "
            f"least twice point_spacing_mm = {campaign.point_spacing_mm:g}; shorter waves are not resolved",
        )
    largest = STABILITY[campaign.integrator][1]
    if campaign.stability is not None and campaign.stability > largest:
        yield (
            ("campaign", "stability"),
            f"stability = {campaign.stability:g} must be at most {largest:g} with integrator = "
            f"{shown(campaign.integrator)}: longer steps make every wave grow; lower it or delete it",
        )


def _limit_faults(scene: Campaign) -> _Messages:
    limits = scene.campaign.limits
    if limits is None:
        return
    if not limits.values:
        text = "[campaign.limits] has no limit; write one, such as flange_thickness_mm = 22, or delete it"
        yield ("campaign", "limits"), text
    laws = scene.fatigue.laws if scene.fatigue else ()
    if limits.damage is not None and not any(map(counts_cycles, laws)):
        given = f"; {', '.join(laws)} orders passages and counts none" if laws else ""
        yield (
            ("campaign", "limits", "damage"),
            f"damage = {limits.damage:g} needs a fatigue law that counts cycles{given}; write "
            f"{' or '.join(filter(counts_cycles, FATIGUE_LAWS))} among the laws of [fatigue], or delete it",
        )


def _reprofiling_faults(scene: Campaign) -> _Messages:
    rules, limits = scene.campaign.reprofiling, scene.campaign.limits
    least, new = None if limits is None else limits.diameter_mm, 2.0 * scene.wheelset.radius_mm
    path: KeyPath = ("campaign", "limits", "diameter_mm")
    if rules is None:
        if least is not None:
            text = f"diameter_mm = {least:g} is for wheels that are reprofiled"
            yield path, f"{text}; add [campaign.reprofiling], or delete it"
        return
    if least is not None and least >= new:
        yield path, f"diameter_mm = {least:g} must be below the diameter of the new wheels, {new:g} mm"
    if not rules.at_limits and not rules.at_km:
        yield (
            _REPROFILING,
            "[campaign.reprofiling] does not say when; write at_limits, such as "
            '["flange_thickness_mm"], or at_km',
        )
    keys = [key for name, key in LIMIT_KEYS.items() if name != "wheel_diameter"]
    for key in rules.at_limits:
        path = (*_REPROFILING, "at_limits")
        if key not in keys:
            yield path, f"at_limits: {shown(key)} is no limit to reprofile wheels at; {suggestion(key, keys)}"
        elif limits is None or getattr(limits, key) is None:
            yield path, f"at_limits: {shown(key)} has no value; give it in [campaign.limits]"
    if any(b <= a for a, b in zip((0.0, *rules.at_km), rules.at_km, strict=False)):
        text = f"at_km = {shown(list(rules.at_km))} must rise from one to the next"
        yield (*_REPROFILING, "at_km"), text
    if scene.contact.rotation == "nominal":
        yield (
            ("contact", "rotation"),
            'rotation = "nominal" is the rotation speed of new wheels: reprofiled wheels would slide; '
            'write rotation = "free" or "centred", or delete [campaign.reprofiling]',
        )
    if scene.origin.role != "scene":
        yield (
            _REPROFILING,
            "[campaign.reprofiling] cannot be compared: factors from rig to field are of the wear since new; "
            "delete it, or run this scene by itself",
        )


def shift_ranges(scene: Campaign) -> Iterator[tuple[KeyPath, float, float, int]]:
    """Path of each shift in the scene, ends of its range [mm], number of operating points in it."""
    for path, run in scene.operation.runs.items():
        if isinstance(run, ClassSection):
            mean, spread = run.shift_mean_mm, REACH * run.shift_std_mm
            positions = run.positions if run.shift_std_mm > 0 else 1
            yield (*path, "shift_mean_mm"), mean - spread, mean + spread, positions
        else:
            key = "shift_mm" if run.shift_mm is not None else "lateral_force_kN"
            shifts = [run.shift_mm or 0.0]  # one that follows from a force is within what the flange allows
            if run.positions is not None:
                blocks = list(scene.operation.runs.values())
                following = blocks[(int(path[2]) + 1) % len(blocks)]
                shifts.append(getattr(following, "shift_mm", None) or 0.0)
            yield (*path, key), min(shifts), max(shifts), run.positions or 1
    if isinstance(scene, FieldScene) and scene.vehicle is not None:
        for k, count in enumerate(points_of_track(scene.vehicle, scene._track)):
            path = ("vehicle", "class", k) if scene.vehicle.route is None else ("vehicle", "route")
            yield path, 0.0, 0.0, count  # all within what the flange allows
    if isinstance(scene, FieldScene) and scene.recorded is not None:
        found = scene._reduction
        yield ("recorded", "file"), 0.0, 0.0, len(found.group) if isinstance(found, Reduction) else 1
    if scene.operation.monitor is not None:
        for index, shift in enumerate(scene.operation.monitor.shifts_mm):
            yield ("operation", "monitor", "shifts_mm", index), shift, shift, 1


def key_of(path: KeyPath) -> str:
    """Last key of a path, without the index in its list."""
    return str(path[-1] if isinstance(path[-1], str) else path[-2])


def fit_faults(scene: Campaign, wheels: Wheels, counterface: Profile) -> list[Fault]:
    """Fault of a wheelset that does not stand on its rails, if there is any."""
    gauge, back_to_back = scene.counterface.gauge_mm, scene.wheelset.back_to_back_mm
    try:
        thickness = [1e3 * measures.flange_thickness(wheel.y, wheel.z) for wheel in wheels]
    except ProfileError as error:
        return [scene.fault(("wheelset", "profile"), f"no flange can be measured: {error}")]
    over_flanges = back_to_back + sum(thickness)
    if over_flanges >= gauge:
        text = (
            f"gauge_mm = {gauge:g} must be above {over_flanges:.4g} mm, the width over both flanges "
            f"(back_to_back_mm = {back_to_back:g} + {thickness[0]:.4g} + {thickness[1]:.4g}); "
            "give the gauge of the track or the back-to-back distance of the wheelset"
        )
        return [scene.fault(("counterface", "gauge_mm"), text)]
    top = float(counterface.y[np.argmin(counterface.z)])
    for path, low, high, _ in shift_ranges(scene):
        for shift in dict.fromkeys((low, high)):
            for sign, wheel in zip((1.0, -1.0), wheels, strict=True):
                missing = top - (float(wheel.y[-1]) + sign * 1e-3 * shift)
                if missing > 0.0:
                    text = (
                        f"{key_of(path)}: at a shift of {shift:g} mm the tread ends {1e3 * missing:.3g} mm "
                        f"short of the counterface's top: the wheel has no contact; check gauge_mm = "
                        f"{gauge:g} and back_to_back_mm = {back_to_back:g}"
                    )
                    return [scene.fault(path, text)]
    return []


def beyond_clearance(scene: Campaign, clearance: Clearance) -> tuple[list[Fault], list[Fault]]:
    """Faults of shifts at which a wheel climbs its flange by more than `FURTHEST_CLIMB_MM`, and warnings.

    At most one for each block, class or watched shift. `clearance` is that of the right and the left wheel,
    see `wearsim.profile.conicity.flange_clearance` [m].
    """
    faults, warnings = [], []
    right, left = (math.inf if free is None else 1e3 * free for free in clearance)
    fix = (
        f"give smaller shifts, or check gauge_mm = {scene.counterface.gauge_mm:g} and "
        f"back_to_back_mm = {scene.wheelset.back_to_back_mm:g}"
    )
    for path, low, high, _ in shift_ranges(scene):
        to_right = high - right >= -low - left
        shift, free, wheel = (high, right, "right") if to_right else (low, left, "left")
        beyond = abs(shift) - free
        if beyond <= 0:
            continue
        run = scene.operation.runs.get(path[:3])
        entry = f"[{path[-1]}]" if run is None else ""
        start = f"{key_of(path)}{entry} = {low:g} is"
        if isinstance(run, ClassSection):
            start = f"shift_mean_mm = {run.shift_mean_mm:g} is"
            if high > low:
                path = (*path[:-1], "shift_std_mm")
                start = (
                    f"shift_std_mm = {run.shift_std_mm:g}: {REACH:g} standard deviations about shift_mean_mm "
                    f"= {run.shift_mean_mm:g} reach {shift:.4g} mm,"
                )
        if beyond > FURTHEST_CLIMB_MM:
            text = (
                f"{start} more than {FURTHEST_CLIMB_MM:g} mm beyond the flange clearance of {free:.4g} mm: "
                f"the {wheel} wheel has climbed off its flank, on the way to derailment; {fix}"
            )
            faults.append(scene.fault(path, text))
        else:
            text = f"{start} beyond the flange clearance of {free:.4g} mm"
            warnings.append(scene.fault(path, f"{text}: the {wheel} wheel climbs its flange; {fix}"))
    for key, value in zip(("profile", "profile_left"), clearance, strict=True):
        if value is None and (key == "profile" or scene.wheelset.profile_left is not None):
            text = f"{key}: no part of the flange is as steep as 60 degrees"
            warnings.append(scene.fault(("wheelset", key), f"{text}: shifts are not checked for climbing"))
    return faults, warnings


def limit_faults(scene: Campaign, wheels: Wheels, counterface: Profile, *, end: bool) -> list[Fault]:
    """Limits that the new wheels meet already: faults of a campaign that ends at them, else warnings.

    `end` says which of both to check.
    """
    limits, rules = scene.campaign.limits, scene.campaign.reprofiling
    if limits is None or limits.end is not end:
        return []
    faults = []
    for key, who in _met_by(limits, wheels, counterface, "new").items():
        if end and rules is not None and key in rules.at_limits:
            continue
        text = f"{key} = {getattr(limits, key):g} is met by {who} already"
        if end:
            text += ", and the campaign would end before it begins; change the limit, or delete end = true"
        faults.append(scene.fault(("campaign", "limits", key), text))
    return faults


def template_faults(scene: Campaign, templates: Wheels, counterface: Profile) -> list[Fault]:
    """Limits that wheels of the profiles `templates` would still meet."""
    limits, rules = scene.campaign.limits, scene.campaign.reprofiling
    if limits is None or rules is None:
        return []
    return [
        scene.fault(
            ("campaign", "limits", key),
            f"{key} = {getattr(limits, key):g} is met by {who}, too: wheels would be reprofiled for ever; "
            "change the limit, or give another profile in [campaign.reprofiling]",
        )
        for key, who in _met_by(limits, templates, counterface, "reprofiled").items()
        if key in rules.at_limits
    ]


def _met_by(limits: LimitsSection, wheels: Wheels, counterface: Profile, state: str) -> dict[str, str]:
    """By key of a limit that unworn wheels meet, which wheel it is and what it has."""
    met: dict[str, str] = {}
    for name, limit in limits.values.items():
        have: dict[str, float | None] = {}
        try:
            if name in _OF_WHEEL:
                right, left = (getattr(measures, name)(wheel.y, wheel.z) for wheel in wheels)
                have = {"right wheel": right, "left wheel": left}
            elif name == "equivalent_conicity":
                have = {"wheelset": equivalent_conicity(*wheels, counterface)}
        except ProfileError:
            continue  # a measure that the new wheel does not have meets no limit
        quantity = QUANTITIES[name]
        unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
        for who, value in have.items():
            if value is not None and LIMITED[name] * (value - limit) >= 0.0:
                shown_value = f"{value * quantity.shown_factor:.4g}{unit}"
                met.setdefault(LIMIT_KEYS[name], f"the {state} {who} ({shown_value})")
    return met
