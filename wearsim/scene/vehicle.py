"""[vehicle] of a field scene: a vehicle file and the track it runs on, in place of given shifts."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field, Strict, WithJsonSchema
from pydantic_core import PydanticCustomError

from wearsim.errors import SceneError
from wearsim.operation.bogie import Vehicle
from wearsim.operation.route import POSITIONS, WITHIN, Curve, Tangent
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.scene.section import Section, Text, number, words
from wearsim.toml_faults import KeyPath, read_toml, shown, suggestion

if TYPE_CHECKING:
    from wearsim.scene.models import FieldScene

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


def shipped_or_own(folder: str, place: Place, role: str, name: str) -> tuple[Path | None, str]:
    """Find a data file that a scene names, its own or one in a `folder` of profiles/; else None and why."""
    path = place(role, name) or place(role, f"{name}.toml")
    shipped = shipped_path("profiles", folder, f"{name.removesuffix('.toml')}.toml")
    path = path or (shipped if shipped.is_file() else None)
    known = sorted(one.stem for one in shipped_path("profiles", folder).glob("*.toml"))
    return path, "" if path else suggestion(name, known)


class VehicleFile(Section):
    """A vehicle of two bogies of two axles each; stiffness is that of the springs of one axle box."""

    name: Text = words("the name of the vehicle")
    source: Text = words("where its data are from")
    wheelbase_m: float = Field(ge=0.6, le=10.0, description="the wheelbase of a bogie")
    pivot_distance_m: float = number("pivot_distance", "the distance of the pivots of both bogies")
    wheelset_mass_kg: float = number("vehicle_mass", "the mass of a wheelset")
    bogie_mass_kg: float = number("vehicle_mass", "the mass of a bogie without wheelsets")
    body_mass_kg: float = number("vehicle_mass", "the mass of the body with its load")
    bogie_height_m: float = number("vehicle_height", "the height of the bogie's centre of gravity")
    body_height_m: float = number("vehicle_height", "the height of the body's centre of gravity")
    longitudinal_stiffness_MN_m: float = number(
        "spring_stiffness", "the longitudinal stiffness between an axle box and the bogie"
    )
    lateral_stiffness_MN_m: float = number(
        "spring_stiffness", "the lateral stiffness between an axle box and the bogie"
    )
    spring_spacing_m: float = number(
        "spring_spacing", "the lateral distance of the springs of both axle boxes"
    )
    secondary_yaw_stiffness_MN_m_rad: float = number(
        "yaw_stiffness", "the yaw stiffness between a bogie and the body", 0.0
    )
    roll_coefficient: float = number("roll_coefficient", "the roll coefficient of the body", 0.0)

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle in SI units."""
        return Vehicle(
            half_wheelbase=0.5 * self.wheelbase_m,
            half_pivot_distance=0.5 * self.pivot_distance_m,
            wheelset_mass=self.wheelset_mass_kg,
            bogie_mass=self.bogie_mass_kg,
            body_mass=self.body_mass_kg,
            bogie_height=self.bogie_height_m,
            body_height=self.body_height_m,
            lateral_stiffness=2e6 * self.lateral_stiffness_MN_m,
            yaw_stiffness=0.5e6 * self.longitudinal_stiffness_MN_m * self.spring_spacing_m**2,
            secondary_yaw_stiffness=1e6 * self.secondary_yaw_stiffness_MN_m_rad,
            roll_coefficient=self.roll_coefficient,
        )


class TrackSection(Section):
    """[[vehicle.class]]: one class of track, a curve or straight."""

    name: Text = words("a name for tables and figures")
    share: float = number("weight", "the share of the distance")
    speed_km_h: float = number("speed", "the speed")
    friction: float = number("friction", "Coulomb's coefficient of friction, on the tread")
    friction_flange: float | None = number(
        "friction_flange", "the coefficient of friction on the flange, by default that of the tread", None
    )
    environment: float = number(
        "environment", "the factor on the wear depth, 1 for dry laboratory coefficients", 1.0
    )
    curve_radius_m: CurveRadius | None = Field(
        None,
        description="the curve radius, + to the right; none on straight track",
        json_schema_extra={"unit": "m"},
    )
    cant_mm: float | None = number("cant", "the cant in the curve, the outer rail higher", None)
    cant_deficiency_mm: float | None = number("cant_deficiency", "in place of the cant, its deficiency", None)
    shift_std_mm: float | None = number(
        "shift_std", "the standard deviation of the lateral motion on straight track", None
    )


class VehicleSection(Section):
    """[vehicle]: the vehicle whose bogies decide where the wheelset runs."""

    file: Text = words("the name of a shipped vehicle, or the file of one")
    leading_share: float = number(
        "axle_share", "the share of the distance that the wheelset is the leading one of its bogie", 0.5
    )
    turned_share: float = number(
        "axle_share", "the share of the distance that the train is turned, right wheels on left rails", 0.5
    )
    tangent: Literal["suspended", "kinematic", "guided", "shifted"] = Field(
        "suspended",
        description="how wheelsets move on straight track: held by their yaw stiffness, free to roll, held "
        "parallel while they move, or shifted without moving",
    )
    tangent_wavelength_m: float | None = number(
        "tangent_wavelength", "the wavelength of that motion, by default Klingel's of the new profiles", None
    )
    track: Annotated[tuple[TrackSection, ...], Strict(False)] = Field(
        (), alias="class", max_length=200, description="the classes of track"
    )


def points_of_track(section: VehicleSection) -> list[int]:
    """Operating points of each class of track, as `wearsim.operation.route.route` makes them."""
    axles, ways = ((one > 0.0) + (one < 1.0) for one in (section.leading_share, section.turned_share))
    return [POSITIONS * axles if one.curve_radius_m is None else 2 * ways for one in section.track]


def read_vehicle(scene: FieldScene, place: Place) -> tuple[VehicleFile, Path]:
    """Read the vehicle of a scene; the file may be anywhere, `place` finds it by role and name.

    Raises
    ------
    SceneError
        If the vehicle is not known, its file has faults, or classes do not fit together.
    """
    section = scene.vehicle
    assert section is not None
    faults = [scene.fault(path, text) for path, text in _faults(section)]
    path, text = shipped_or_own("vehicles", place, "vehicle.file", section.file)
    if path is None:
        text = f"file = {shown(section.file)} is no file, nor a shipped vehicle; {text}"
        raise SceneError([*faults, scene.fault(("vehicle", "file"), text)])
    vehicle, of_file = read_toml(path, VehicleFile)
    if vehicle is None or faults:
        raise SceneError([*faults, *of_file])
    return vehicle, path


def _faults(section: VehicleSection) -> list[tuple[KeyPath, str]]:
    """Keys of the classes of track that do not fit together, with messages."""
    found: list[tuple[KeyPath, str]] = []
    if not section.track:
        found.append((("vehicle",), "[vehicle] has no track; write [[vehicle.class]] with name and share"))
    for k, one in enumerate(section.track):
        path, named = ("vehicle", "class", k), f"class {shown(one.name)}"
        curve = one.curve_radius_m is not None
        if curve and one.cant_mm is not None and one.cant_deficiency_mm is not None:
            text = "cant_mm and cant_deficiency_mm exclude each other; delete one of them"
            found.append(((*path, "cant_mm"), f"{named}: {text}"))
        if curve and one.cant_mm is None and one.cant_deficiency_mm is None:
            text = "a curve needs cant_mm or cant_deficiency_mm; give one of them"
            found.append(((*path, "curve_radius_m"), f"{named}: {text}"))
        if not curve and (one.cant_mm is not None or one.cant_deficiency_mm is not None):
            key = "cant_mm" if one.cant_mm is not None else "cant_deficiency_mm"
            found.append(((*path, key), f"{named}: cant is for curves; give curve_radius_m, or delete {key}"))
        if curve and one.shift_std_mm is not None:
            text = "shift_std_mm is for straight track: the balance of the bogie gives the shift; delete it"
            found.append(((*path, "shift_std_mm"), f"{named}: {text}"))
        if not curve and one.shift_std_mm is None:
            found.append((path, f"{named}: straight track needs shift_std_mm, that of the lateral motion"))
    total = sum(one.share for one in section.track)
    if section.track and abs(total - 1.0) > SHARES_ROUNDED:
        text = f"share: the shares of all classes must sum to 1 within 1 %, not {total:.7g}; change them"
        found.append((("vehicle", "class", 0, "share"), text))
    return found


def cut_motion(section: VehicleSection, clearance: float) -> list[tuple[KeyPath, str]]:
    """Warnings of motion on straight track that is cut at the flange clearance [m]."""
    found: list[tuple[KeyPath, str]] = []
    for k, one in enumerate(section.track):
        spread = 1e-3 * (one.shift_std_mm or 0.0)
        cut = math.exp(-0.5 * (WITHIN * clearance / spread) ** 2) if spread > 0.0 else 0.0
        if cut > CUT_UNNOTED:
            text = (
                f"shift_std_mm = {one.shift_std_mm:g}: {100.0 * cut:.2g} % of the motion would go beyond the"
            )
            text += f" flange clearance of {1e3 * clearance:.3g} mm; it turns {WITHIN:g} of the way there"
            found.append((("vehicle", "class", k, "shift_std_mm"), text))
    return found


def track_of(section: VehicleSection) -> tuple[Curve | Tangent, ...]:
    """Return the classes of track of a section without faults, in SI units."""
    made: list[Curve | Tangent] = []
    for one in section.track:
        values = {
            "name": one.name, "share": one.share, "speed": one.speed_km_h / 3.6, "friction": one.friction,
            "friction_flange": one.friction if one.friction_flange is None else one.friction_flange,
            "environment": one.environment,
        }  # fmt: skip
        if one.curve_radius_m is None:
            made.append(Tangent(**values, std=1e-3 * (one.shift_std_mm or 0.0)))  # type: ignore[arg-type]
            continue
        curvature = 1.0 / one.curve_radius_m
        if one.cant_deficiency_mm is not None:
            acceleration = Curve.of_deficiency(curvature, 1e-3 * one.cant_deficiency_mm)
        else:
            acceleration = Curve.of_cant(curvature, one.speed_km_h / 3.6, 1e-3 * (one.cant_mm or 0.0))
        made.append(Curve(**values, curvature=curvature, acceleration=acceleration))  # type: ignore[arg-type]
    return tuple(made)
