"""[vehicle] of a field scene: a vehicle file and the track it runs on, in place of given shifts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from wearsim.errors import SceneError, raise_any, say, shown
from wearsim.operation.bogie import Vehicle
from wearsim.operation.route import WITHIN, AxleShares, Curve, Tangent
from wearsim.profile.placement import slope_of
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.scene.section import Section, SetPoints, Text, read_rows
from wearsim.toml_faults import KeyPath, cross_check, read_toml, suggestion

if TYPE_CHECKING:
    from wearsim.scene.models import FieldScene, RigScene

SHARES_ROUNDED = 0.01
CUT_UNNOTED = 0.01

Place = Callable[[str, str], Path | None]
"""File of a role and a name in the scene."""


def curve_radius(radius: float) -> float:
    """Return a curve radius of either sign, or raise what becomes a fault."""
    low, high = QUANTITIES["curve_radius"].span
    if not low <= abs(radius) <= high:
        allowed = f"between {low:.10g} and {high:.10g} m, with + to the right or - to the left"
        raise PydanticCustomError("out_of_range", "radius", {"allowed": allowed})
    return radius


_LEAST, _MOST = QUANTITIES["curve_radius"].span
_EITHER = [
    {"type": "number", "minimum": low, "maximum": high} for low, high in ((-_MOST, -_LEAST), (_LEAST, _MOST))
]
CurveRadius = Annotated[float, AfterValidator(curve_radius), WithJsonSchema({"anyOf": _EITHER})]


def _inclination(text: str) -> str:
    try:
        slope_of(text)
    except ValueError:
        low, high = QUANTITIES["inclination_ratio"].span
        allowed = f'"1:{low:g}" to "1:{high:g}", or "none"'
        raise PydanticCustomError("out_of_range", "inclination", {"allowed": allowed}) from None
    return text


Inclination = Annotated[str, AfterValidator(_inclination)]


def shipped_or_own(folder: str, place: Place, role: str, name: str) -> tuple[Path | None, str]:
    """Find a data file that a scene names, its own or one in a `folder` of profiles/; else None and why."""
    path = place(role, name) or place(role, f"{name}.toml")
    shipped = shipped_path("profiles", folder, f"{name.removesuffix('.toml')}.toml")
    path = path or (shipped if shipped.is_file() else None)
    known = sorted(one.stem for one in shipped_path("profiles", folder).glob("*.toml"))
    return path, "" if path else suggestion(name, known)


class VehicleFile(Section):
    """A vehicle of two bogies of two axles each; stiffness is that of the springs of one axle box."""

    name: Text
    source: Text
    wheelbase_m: float
    pivot_distance_m: float
    wheelset_mass_kg: float
    bogie_mass_kg: float
    body_mass_kg: float
    bogie_height_m: float
    body_height_m: float
    longitudinal_stiffness_MN_m: float
    lateral_stiffness_MN_m: float
    spring_spacing_m: float
    secondary_yaw_stiffness_MN_m_rad: float = 0.0
    roll_coefficient: float = 0.0

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle in SI units."""
        values = self.si()
        alike = ("wheelset_mass", "bogie_mass", "body_mass", "bogie_height", "body_height")
        return Vehicle(
            **{key: values[key] for key in alike},
            half_wheelbase=0.5 * self.wheelbase_m,
            half_pivot_distance=0.5 * self.pivot_distance_m,
            lateral_stiffness=2e6 * self.lateral_stiffness_MN_m,
            yaw_stiffness=0.5e6 * self.longitudinal_stiffness_MN_m * self.spring_spacing_m**2,
            secondary_yaw_stiffness=1e6 * self.secondary_yaw_stiffness_MN_m_rad,
            roll_coefficient=self.roll_coefficient,
        )


class TrackKeys(SetPoints):
    """What classes and segments of track have in common."""

    by_file: ClassVar[bool] = False  # keys may be those of all segments
    curve_radius_m: CurveRadius | None = None
    cant_mm: float | None = None
    cant_deficiency_mm: float | None = None
    shift_std_mm: float | None = None

    @model_validator(mode="after")
    def _fit(self) -> Self:
        cants = [key for key in ("cant_mm", "cant_deficiency_mm") if getattr(self, key) is not None]
        tilted = [key for key in cants if getattr(self, key) != 0.0]  # tables of track have 0 on straight
        key = text = ""
        if self.curve_radius_m is None and tilted:
            key, text = tilted[0], say("vehicle.cant_on_straight", key=tilted[0])
        elif self.curve_radius_m is None and self.shift_std_mm is None:
            key, text = "name", say("vehicle.straight_without_motion")
        elif self.curve_radius_m is not None and len(cants) != 1:
            key, text = "curve_radius_m", say("vehicle.one_cant")
        elif self.curve_radius_m is not None and self.shift_std_mm is not None and not self.by_file:
            key, text = "shift_std_mm", say("vehicle.motion_in_curve")
        if text:
            raise cross_check(f"{shown(self.name)}: {text}", key)
        return self


class RailShare(Section):
    """An entry of rails: a pair of rails, and the share of the distance it is run on."""

    share: float
    profile: Text | None = None
    profile_left: Text | None = None
    inclination: Inclination | None = None
    gauge_mm: float | None = None


class TorqueShare(Section):
    """An entry of axle_torques: a torque, and the share of the distance it acts on."""

    axle_torque_kN_m: float
    share: float


def _whole(entries: tuple[Any, ...]) -> tuple[Any, ...]:
    total = sum(one.share for one in entries)
    if entries and abs(total - 1.0) > SHARES_ROUNDED:
        raise cross_check(f"share: the shares must sum to 1 within 1 %, not {total:.7g}; change them")
    return entries


class PracticeKeys(Section):
    """What varies within a class of track: each combination is a state of its own, with its share."""

    rails: Annotated[tuple[RailShare, ...], AfterValidator(_whole)] = ()
    lubricated_share: float = 1.0


class TrackSection(PracticeKeys, TrackKeys):
    """[[vehicle.class]]: one class of track, a curve or straight."""

    share: float
    axle_torques: Annotated[tuple[TorqueShare, ...], AfterValidator(_whole)] = ()

    @model_validator(mode="after")
    def _practice_fits(self) -> Self:
        if self.axle_torques and self.axle_torque_kN_m is not None:
            raise cross_check(say("vehicle.torques", of=self), "axle_torques")
        if self.lubricated_share < 1.0 and self.friction_flange is None:
            raise cross_check(say("vehicle.lubricated", of=self), "lubricated_share")
        return self


class SegmentSection(TrackKeys):
    """A row of the CSV file that `route` of [vehicle] names: one segment of track."""

    by_file: ClassVar[bool] = True
    name: Text = "segment"
    length_km: float


class SegmentDefaults(PracticeKeys):
    """[vehicle.each]: keys of all segments of a route whose file does not give them."""

    speed_km_h: float | None = None
    friction: float | None = None
    friction_flange: float | None = None
    environment: float | None = None
    shift_std_mm: float | None = None


class VehicleSection(Section):
    """[vehicle]: the vehicle whose bogies decide where the wheelset runs."""

    file: Text
    leading_share: float = 0.5
    turned_share: float = 0.5
    axle: Literal["outer", "inner"] = "outer"
    axle_yaw_offset_mrad: float = 0.0
    tangent: Literal["suspended", "kinematic", "guided", "shifted"] = "suspended"
    tangent_wavelength_m: float | None = None
    positions: Literal["found", "frozen"] = "found"
    route: Text | None = None
    each: SegmentDefaults | None = None
    binning_tolerance: float = 0.05
    track: tuple[TrackSection, ...] = ()


def practice_of(section: VehicleSection | None) -> dict[KeyPath, PracticeKeys]:
    """Return what varies within each class of track, or within all segments of a route, by its path."""
    if section is None or section.track:
        return {("vehicle", "class", k): one for k, one in enumerate(section.track if section else ())}
    return {("vehicle", "each"): section.each or PracticeKeys.model_validate({})}


class Rails(NamedTuple):
    """What a pair of rails is made of."""

    profile: str
    profile_left: str | None
    inclination: str
    gauge_mm: float


def rails_of(
    scene: RigScene | FieldScene,
) -> tuple[dict[Rails, KeyPath], list[tuple[tuple[int, float], ...]]]:
    """Pairs of rails of a scene with where they are named, and for each class their numbers and shares.

    The first one is that of [counterface]. Segments of a route have one class.
    """
    base = scene.counterface
    own = Rails(base.profile, base.profile_left, base.inclination, base.gauge_mm)
    found, shares = dict[Rails, KeyPath]({own: ("counterface",)}), []
    for path, one in practice_of(scene.vehicle).items():
        numbers = []
        for k, rail in enumerate(one.rails):
            given = rail.model_dump(exclude_none=True, exclude={"share"})
            if "profile" in given:
                given.setdefault("profile_left", None)
            pair = own._replace(**given)
            found.setdefault(pair, (*path, "rails", k))
            numbers.append((list(found).index(pair), rail.share))
        shares.append(tuple(numbers) or ((0, 1.0),))
    return found, shares


@dataclass(frozen=True)
class Route:
    """A vehicle with the track it runs on, as their files say."""

    vehicle: Vehicle
    about: str  # name and source of the vehicle
    track: tuple[Curve | Tangent, ...]  # classes, or segments of a file
    files: tuple[tuple[str, str, Path], ...]  # role, name in the scene and place of each file
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
    faults = [scene.fault(path, text) for path, text in _faults(section)]
    path, text = shipped_or_own("vehicles", place, "vehicle.file", section.file)
    if path is None:
        text = f"file = {shown(section.file)} is no file, nor a shipped vehicle; {text}"
        raise SceneError([*faults, scene.fault(("vehicle", "file"), text)])
    file, of_file = read_toml(path, VehicleFile)
    files, segments = [("vehicle.file", section.file, path)], None
    if section.route is not None and not section.track:
        where = place("vehicle.route", section.route)
        if where is None:
            text = say("vehicle.no_route", section=section)
            raise SceneError([*faults, *of_file, scene.fault(("vehicle", "route"), text)])
        try:
            each, practice = section.each, set(PracticeKeys.model_fields)
            given = {} if each is None else each.model_dump(exclude_none=True, exclude=practice)
            segments = read_rows(where, SegmentSection, "segment", given)
            files.append(("vehicle.route", section.route, where))
        except SceneError as error:
            faults += error.faults
    if file is None or faults:
        raise SceneError([*faults, *of_file])
    vehicle = replace(file.vehicle, axle_yaw_offset=1e-3 * section.axle_yaw_offset_mrad)
    track = section.track if segments is None else segments
    arm = 1e-3 * scene.wheelset.radius_mm * vehicle.axle_load
    for k, one in enumerate(track):
        torques = [each.axle_torque_kN_m for each in (one, *getattr(one, "axle_torques", ()))]
        largest, most = max((each or 0.0 for each in torques), key=abs), 1e-3 * one.friction * arm
        if abs(largest) > most:
            name = "axle_torques" if one.axle_torque_kN_m is None else "axle_torque_kN_m"
            key = ("vehicle", "class", k, name) if segments is None else ("vehicle", "route")
            faults.append(scene.fault(key, say("vehicle.torque", largest=largest, most=most, of=one)))
    raise_any(faults)
    about = f"{file.name} ({file.source})"
    kinds = list(zip(practice_of(section).values(), rails_of(scene)[1], strict=True))
    classes = tuple(_track(one, scene, *kinds[k % len(kinds)]) for k, one in enumerate(track))
    axle = AxleShares(section.leading_share, section.turned_share, section.axle == "outer")
    return Route(vehicle, about, classes, tuple(files), axle)


def _faults(section: VehicleSection) -> list[tuple[KeyPath, str]]:
    """Keys of the classes of track that do not fit together, with messages."""
    total = sum(one.share for one in section.track)
    if section.route is not None and section.track:
        return [(("vehicle", "route"), say("vehicle.route_and_classes"))]
    if section.route is None and section.each is not None:
        return [(("vehicle", "each"), say("vehicle.each_alone"))]
    if section.route is None and not section.track:
        return [(("vehicle",), say("vehicle.no_track"))]
    if section.track and abs(total - 1.0) > SHARES_ROUNDED:
        return [(("vehicle", "class", 0, "share"), say("vehicle.share_sum", total=total))]
    return []


def cut_motion(section: VehicleSection, clearance: float) -> list[tuple[KeyPath, str]]:
    """Warnings of motion on straight track that is cut at the flange clearance [m]."""
    given = {("vehicle", "class", k, "shift_std_mm"): one for k, one in enumerate(section.track)}
    spreads: dict[KeyPath, float] = {path: one.shift_std_mm or 0.0 for path, one in given.items()}
    if section.each is not None:
        spreads[("vehicle", "each", "shift_std_mm")] = section.each.shift_std_mm or 0.0
    found: list[tuple[KeyPath, str]] = []
    for path, spread in spreads.items():
        cut = math.exp(-0.5 * (1e3 * WITHIN * clearance / spread) ** 2) if spread > 0.0 else 0.0
        if cut > CUT_UNNOTED:
            values = {"spread": spread, "cut": cut, "clearance": clearance, "within": WITHIN}
            found.append((path, say("vehicle.motion_cut", **values)))
    return found


def _track(
    one: TrackKeys,
    scene: FieldScene,
    practice: PracticeKeys,
    rails: tuple[tuple[int, float], ...],
) -> Curve | Tangent:
    """Return a class or segment of track in SI units; the torque is that of [contact] if it has none."""
    speed, torque, torques = one.speed_km_h / 3.6, one.axle_torque_kN_m, getattr(one, "axle_torques", ())
    values: dict[str, Any] = {
        "name": one.name, "share": getattr(one, "length_km", None) or getattr(one, "share", 0.0),
        "speed": speed, "friction": one.friction, "environment": one.environment,
        "friction_flange": one.friction if one.friction_flange is None else one.friction_flange,
        "torque": scene.contact.torque_Nm if torque is None else 1e3 * torque,
        "torques": tuple((1e3 * each.axle_torque_kN_m, each.share) for each in torques),
        "rails": rails, "lubricated": practice.lubricated_share,
    }  # fmt: skip
    if one.curve_radius_m is None:
        return Tangent(**values, std=1e-3 * (one.shift_std_mm or 0.0))
    curvature = 1.0 / one.curve_radius_m
    if one.cant_deficiency_mm is not None:
        acceleration = Curve.of_deficiency(curvature, 1e-3 * one.cant_deficiency_mm)
    else:
        acceleration = Curve.of_cant(curvature, speed, 1e-3 * (one.cant_mm or 0.0))
    return Curve(**values, curvature=curvature, acceleration=acceleration)
