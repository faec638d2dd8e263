"""The vehicle of a field scene and the track it runs on, from sections and files."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from wearsim.errors import SceneError, raise_any, shown
from wearsim.operation.bogie import Vehicle
from wearsim.operation.route import WITHIN, AxleShares, Curve, Tangent
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.section import read_rows
from wearsim.scene.vehicle import (
    Place,
    PracticeKeys,
    SegmentSection,
    TrackKeys,
    VehicleFile,
    VehicleSection,
    practice_of,
    shipped_or_own,
    vehicle_faults,
)
from wearsim.toml_faults import KeyPath, read_toml

CUT_UNNOTED = 0.01


class Rails(NamedTuple):
    """Profiles, inclination and gauge of a pair of rails."""

    profile: str
    profile_left: str | None
    inclination: str
    gauge_mm: float


def rails_of(
    scene: RigScene | FieldScene,
) -> tuple[dict[Rails, KeyPath], list[tuple[tuple[int, float], ...]]]:
    """Pairs of rails of a scene with where they are named.

    And for each class their numbers and shares.

    The first one is that of [counterface]. Segments of a route have one class.
    """
    base = scene.counterface
    base_rails = Rails(base.profile, base.profile_left, base.inclination, base.gauge_mm)
    places, shares = dict[Rails, KeyPath]({base_rails: ("counterface",)}), []
    for path, practice in practice_of(scene.vehicle).items():
        numbers = []
        for k, rail in enumerate(practice.rails):
            given = rail.model_dump(exclude_none=True, exclude={"share"})
            if "profile" in given:
                given.setdefault("profile_left", None)
            pair = base_rails._replace(**given)
            places.setdefault(pair, (*path, "rails", k))
            numbers.append((list(places).index(pair), rail.share))
        shares.append(tuple(numbers) or ((0, 1.0),))
    return places, shares


@dataclass(frozen=True)
class Route:
    """A vehicle with the track it runs on, as their files say."""

    vehicle: Vehicle
    about: str  # name and source of the vehicle
    track: tuple[Curve | Tangent, ...]  # classes, or segments of a file
    files: tuple[
        tuple[str, str, Path], ...
    ]  # role, name in the scene and place of each file
    shares: AxleShares


def read_vehicle(scene: FieldScene, place: Place) -> Route:
    """Read the vehicle and the route of a scene; `place` finds files by role and name.

    Raises
    ------
    SceneError
        If the vehicle is not known, files have faults, or classes do not fit together.
    """
    section = scene.vehicle
    assert section is not None
    faults = [scene.fault(path, text) for path, text in vehicle_faults(section)]
    path, text = shipped_or_own("vehicles", place, "vehicle.file", section.file)
    if path is None:
        text = f"file = {shown(section.file)} is no file, nor a shipped vehicle; {text}"
        raise SceneError([*faults, scene.fault(("vehicle", "file"), text)])
    file, of_file = read_toml(path, VehicleFile)
    files, segments = [("vehicle.file", section.file, path)], None
    if section.route is not None and not section.track:
        where = place("vehicle.route", section.route)
        if where is None:
            text = (
                f"route = {shown(section.route)} does not exist as given or next to "
                "the scene file; give a CSV file"
            )
            raise SceneError(
                [*faults, *of_file, scene.fault(("vehicle", "route"), text)]
            )
        try:
            defaults, practice = section.each, set(PracticeKeys.model_fields)
            given = (
                {}
                if defaults is None
                else defaults.model_dump(exclude_none=True, exclude=practice)
            )
            segments = read_rows(where, SegmentSection, "segment", given)
            files.append(("vehicle.route", section.route, where))
        except SceneError as error:
            faults += error.faults
    if file is None or faults:
        raise SceneError([*faults, *of_file])
    vehicle = replace(file.vehicle, axle_yaw_offset=1e-3 * section.axle_yaw_offset_mrad)
    track = section.track if segments is None else segments
    arm = 1e-3 * scene.wheelset.radius_mm * vehicle.axle_load
    for k, track_keys in enumerate(track):
        torques = [
            keys.axle_torque_kN_m
            for keys in (track_keys, *getattr(track_keys, "axle_torques", ()))
        ]
        largest, friction_limit = (
            max((torque or 0.0 for torque in torques), key=abs),
            1e-3 * track_keys.friction * arm,
        )
        if abs(largest) > friction_limit:
            name = (
                "axle_torques"
                if track_keys.axle_torque_kN_m is None
                else "axle_torque_kN_m"
            )
            key = (
                ("vehicle", "class", k, name)
                if segments is None
                else ("vehicle", "route")
            )
            message = (
                f"axle_torque_kN_m = {largest:g} is more than friction can carry in "
                f"{shown(track_keys.name)}: friction x axle load x radius_mm = "
                f"{friction_limit:.3g} kN m; lower it"
            )
            faults.append(scene.fault(key, message))
    raise_any(faults)
    about = f"{file.name} ({file.source})"
    kinds = list(zip(practice_of(section).values(), rails_of(scene)[1], strict=True))
    classes = tuple(
        _track(track_keys, scene, *kinds[k % len(kinds)])
        for k, track_keys in enumerate(track)
    )
    axle = AxleShares(
        section.leading_share, section.turned_share, section.axle == "outer"
    )
    return Route(vehicle, about, classes, tuple(files), axle)


def cut_motion(section: VehicleSection, clearance: float) -> list[tuple[KeyPath, str]]:
    """Warnings of motion on straight track that is cut at the flange clearance [m]."""
    given = {
        ("vehicle", "class", k, "shift_std_mm"): track_class
        for k, track_class in enumerate(section.track)
    }
    spreads: dict[KeyPath, float] = {
        path: track_class.shift_std_mm or 0.0 for path, track_class in given.items()
    }
    if section.each is not None:
        spreads[("vehicle", "each", "shift_std_mm")] = section.each.shift_std_mm or 0.0
    messages: list[tuple[KeyPath, str]] = []
    for path, spread in spreads.items():
        cut = (
            math.exp(-0.5 * (1e3 * WITHIN * clearance / spread) ** 2)
            if spread > 0.0
            else 0.0
        )
        if cut > CUT_UNNOTED:
            text = (
                f"shift_std_mm = {spread:g}: {100.0 * cut:.2g} % of the motion would "
                f"go beyond the flange clearance of {1e3 * clearance:.3g} mm; it turns "
                f"{WITHIN:g} of the way there"
            )
            messages.append((path, text))
    return messages


def _track(
    track_keys: TrackKeys,
    scene: FieldScene,
    practice: PracticeKeys,
    rails: tuple[tuple[int, float], ...],
) -> Curve | Tangent:
    """Return a class or segment of track in SI units.

    The torque is that of [contact] if it has none.
    """
    speed, torque, torques = (
        track_keys.speed_km_h / 3.6,
        track_keys.axle_torque_kN_m,
        getattr(track_keys, "axle_torques", ()),
    )
    values: dict[str, Any] = {
        "name": track_keys.name,
        "share": getattr(track_keys, "length_km", None)
        or getattr(track_keys, "share", 0.0),
        "speed": speed,
        "friction": track_keys.friction,
        "environment": track_keys.environment,
        "friction_flange": track_keys.friction
        if track_keys.friction_flange is None
        else track_keys.friction_flange,
        "torque": scene.contact.torque_Nm if torque is None else 1e3 * torque,
        "torques": tuple(
            (1e3 * axle_torque.axle_torque_kN_m, axle_torque.share)
            for axle_torque in torques
        ),
        "rails": rails,
        "lubricated": practice.lubricated_share,
    }
    if track_keys.curve_radius_m is None:
        return Tangent(**values, std=1e-3 * (track_keys.shift_std_mm or 0.0))
    curvature = 1.0 / track_keys.curve_radius_m
    if track_keys.cant_deficiency_mm is not None:
        acceleration = Curve.of_deficiency(
            curvature, 1e-3 * track_keys.cant_deficiency_mm
        )
    else:
        acceleration = Curve.of_cant(
            curvature, speed, 1e-3 * (track_keys.cant_mm or 0.0)
        )
    return Curve(**values, curvature=curvature, acceleration=acceleration)
