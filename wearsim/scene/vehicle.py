"""[vehicle] of a field scene.

A vehicle file and the track it runs on, in place of given shifts.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from wearsim.errors import shown
from wearsim.operation.bogie import Vehicle
from wearsim.profile.placement import slope_of
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.scene.section import (
    Messages,
    Section,
    SetPoints,
    Text,
    quantity,
    text_field,
)
from wearsim.toml_faults import KeyPath, cross_check, suggestion

SHARES_ROUNDED = 0.01
"""Shares of classes that sum to 1 within this are rounded ones and normalised."""

Place = Callable[[str, str], Path | None]
"""File of a role and a name in the scene."""


def curve_radius(radius: float) -> float:
    """Return a curve radius of either sign, or raise what becomes a fault."""
    low, high = QUANTITIES["curve_radius"].span
    if not low <= abs(radius) <= high:
        allowed = (
            f"between {low:.10g} and {high:.10g} m, with + to the right or - to the "
            "left"
        )
        raise PydanticCustomError("out_of_range", "radius", {"allowed": allowed})
    return radius


_LEAST, _MOST = QUANTITIES["curve_radius"].span
_EITHER = [
    {"type": "number", "minimum": low, "maximum": high}
    for low, high in ((-_MOST, -_LEAST), (_LEAST, _MOST))
]
CurveRadius = Annotated[
    float, AfterValidator(curve_radius), WithJsonSchema({"anyOf": _EITHER})
]


def _inclination(text: str) -> str:
    try:
        slope_of(text)
    except ValueError:
        low, high = QUANTITIES["inclination_ratio"].span
        allowed = f'"1:{low:g}" to "1:{high:g}", or "none"'
        raise PydanticCustomError(
            "out_of_range", "inclination", {"allowed": allowed}
        ) from None
    return text


Inclination = Annotated[str, AfterValidator(_inclination)]


def shipped_or_own(
    folder: str, place: Place, role: str, name: str
) -> tuple[Path | None, str]:
    """Find a data file that a scene names, its own or one in a `folder` of profiles/.

    Else None and why.
    """
    path = place(role, name) or place(role, f"{name}.toml")
    shipped = shipped_path("profiles", folder, f"{name.removesuffix('.toml')}.toml")
    path = path or (shipped if shipped.is_file() else None)
    names = sorted(
        file.stem for file in shipped_path("profiles", folder).glob("*.toml")
    )
    return path, "" if path else suggestion(name, names)


class VehicleFile(Section):
    """A vehicle of two bogies of two axles each; stiffness is that of the springs of
    one axle box.
    """

    name: Text = text_field("the name of the vehicle")
    source: Text = text_field("where its data are from")
    wheelbase_m: float = Field(description="the wheelbase of a bogie", ge=0.6, le=10.0)
    pivot_distance_m: float = quantity("pivot_distance")
    wheelset_mass_kg: float = quantity("vehicle_mass", meaning="the mass of a wheelset")
    bogie_mass_kg: float = quantity(
        "vehicle_mass", meaning="the mass of a bogie without wheelsets"
    )
    body_mass_kg: float = quantity(
        "vehicle_mass", meaning="the mass of the body with its load"
    )
    bogie_height_m: float = quantity(
        "vehicle_height", meaning="the height of the bogie's centre of gravity"
    )
    body_height_m: float = quantity(
        "vehicle_height", meaning="the height of the body's centre of gravity"
    )
    longitudinal_stiffness_MN_m: float = quantity(
        "spring_stiffness",
        meaning="the longitudinal stiffness between an axle box and the bogie",
    )
    lateral_stiffness_MN_m: float = quantity(
        "spring_stiffness",
        meaning="the lateral stiffness between an axle box and the bogie",
    )
    spring_spacing_m: float = quantity("spring_spacing")
    secondary_yaw_stiffness_MN_m_rad: float = quantity("yaw_stiffness", 0.0)
    roll_coefficient: float = quantity("roll_coefficient", 0.0)

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle in SI units."""
        values = self.si()
        alike = (
            "wheelset_mass",
            "bogie_mass",
            "body_mass",
            "bogie_height",
            "body_height",
        )
        return Vehicle(
            **{key: values[key] for key in alike},
            half_wheelbase=0.5 * self.wheelbase_m,
            half_pivot_distance=0.5 * self.pivot_distance_m,
            lateral_stiffness=2e6 * self.lateral_stiffness_MN_m,
            yaw_stiffness=0.5e6
            * self.longitudinal_stiffness_MN_m
            * self.spring_spacing_m**2,
            secondary_yaw_stiffness=1e6 * self.secondary_yaw_stiffness_MN_m_rad,
            roll_coefficient=self.roll_coefficient,
        )


class TrackKeys(SetPoints):
    """What classes and segments of track have in common."""

    by_file: ClassVar[bool] = False  # keys may be those of all segments
    curve_radius_m: CurveRadius | None = Field(
        None,
        description="the curve radius, + to the right; none on straight track",
        json_schema_extra={"unit": "m"},
    )
    cant_mm: float | None = quantity(
        "cant", None, "the cant in the curve, the outer rail higher"
    )
    cant_deficiency_mm: float | None = quantity(
        "cant_deficiency", None, "in place of the cant, its deficiency"
    )
    shift_std_mm: float | None = quantity(
        "shift_std",
        None,
        "the standard deviation of the lateral motion on straight track",
    )

    @model_validator(mode="after")
    def _fit(self) -> Self:
        cants = [
            key
            for key in ("cant_mm", "cant_deficiency_mm")
            if getattr(self, key) is not None
        ]
        tilted = [
            key for key in cants if getattr(self, key) != 0.0
        ]  # tables of track have 0 on straight
        key = text = ""
        if self.curve_radius_m is None and tilted:
            key = tilted[0]
            text = f"cant is for curves; give curve_radius_m, or set {key} to 0"
        elif self.curve_radius_m is None and self.shift_std_mm is None:
            key = "name"
            text = "straight track needs shift_std_mm, that of the lateral motion"
        elif self.curve_radius_m is not None and len(cants) != 1:
            key = "curve_radius_m"
            text = (
                "a curve needs either cant_mm or cant_deficiency_mm; give one of them"
            )
        elif (
            self.curve_radius_m is not None
            and self.shift_std_mm is not None
            and not self.by_file
        ):
            key = "shift_std_mm"
            text = (
                "shift_std_mm is for straight track: the balance of the bogie gives "
                "the shift; delete it"
            )
        if text:
            raise cross_check(f"{shown(self.name)}: {text}", key)
        return self


class RailShare(Section):
    """An entry of rails: a pair of rails, and the share of the distance it is run
    on.
    """

    share: float = quantity("weight", meaning="the share of the distance of the class")
    profile: Text | None = text_field(
        "the rail profile, by default that of [counterface]", None
    )
    profile_left: Text | None = text_field(
        "the profile of the left rail, if it differs", None
    )
    inclination: Inclination | None = text_field(
        'the inclination of the rails, such as "1:40", or "none"; by default that of '
        "[counterface]",
        None,
    )
    gauge_mm: float | None = quantity(
        "gauge", None, "the track gauge, by default that of [counterface]"
    )


class TorqueShare(Section):
    """An entry of axle_torques: a torque, and the share of the distance it acts on."""

    axle_torque_kN_m: float = Field(
        description="the torque on the axle, driving forward",
        ge=-50.0,
        le=50.0,
        json_schema_extra={"unit": "kN m"},
    )
    share: float = quantity("weight", meaning="the share of the distance of the class")


def _check_shares(entries: tuple[Any, ...]) -> tuple[Any, ...]:
    total = sum(entry.share for entry in entries)
    if entries and abs(total - 1.0) > SHARES_ROUNDED:
        raise cross_check(
            f"share: the shares must sum to 1 within 1 %, not {total:.7g}; change them"
        )
    return entries


class PracticeKeys(Section):
    """What varies within a class of track: each combination is a state of its own, with
    its share.
    """

    not_here: ClassVar[dict[str, str]] = {
        "gauge_mm": "write rails = [{gauge_mm = 1435, share = 0.5}, ...], or gauge_mm "
        "in [counterface]",
    }
    rails: Annotated[tuple[RailShare, ...], AfterValidator(_check_shares)] = Field(
        (),
        description="pairs of rails in place of those of [counterface], such as new, "
        "worn, of other inclination or gauge, each with its share of the distance",
        max_length=20,
        strict=False,
    )
    lubricated_share: float = quantity(
        "axle_share",
        1.0,
        "the share of the distance on which friction_flange acts; on the rest the "
        "flange has the friction of the tread",
    )


class TrackSection(PracticeKeys, TrackKeys):
    """[[vehicle.class]]: one class of track, a curve or straight."""

    share: float = quantity("weight", meaning="the share of the distance")
    axle_torques: Annotated[tuple[TorqueShare, ...], AfterValidator(_check_shares)] = (
        Field(
            (),
            description="torques on the axle in place of axle_torque_kN_m, such as "
            "traction, coasting and braking, each with its share of the distance",
            max_length=20,
            strict=False,
        )
    )

    @model_validator(mode="after")
    def _practice_fits(self) -> Self:
        if self.axle_torques and self.axle_torque_kN_m is not None:
            text = (
                f"{shown(self.name)}: axle_torques and axle_torque_kN_m exclude each "
                "other; delete one of them"
            )
            raise cross_check(text, "axle_torques")
        if self.lubricated_share < 1.0 and self.friction_flange is None:
            text = (
                f"{shown(self.name)}: lubricated_share = {self.lubricated_share:g} "
                "needs friction_flange, that of the lubricated flange; give it"
            )
            raise cross_check(text, "lubricated_share")
        return self


class SegmentSection(TrackKeys):
    """A row of the CSV file that `route` of [vehicle] names: one segment of track."""

    by_file: ClassVar[bool] = True
    name: Text = text_field("a name of the segment, which is not used", "segment")
    length_km: float = quantity("block_length", meaning="the length of the segment")


class SegmentDefaults(PracticeKeys):
    """[vehicle.each]: keys of all segments of a route whose file does not give them."""

    speed_km_h: float | None = quantity("speed", None, "the speed")
    friction: float | None = quantity(
        "friction", None, "Coulomb's coefficient of friction, on the tread"
    )
    friction_flange: float | None = quantity(
        "friction_flange", None, "the coefficient of friction on the flange"
    )
    environment: float | None = quantity(
        "environment", None, "the factor on the wear depth"
    )
    shift_std_mm: float | None = quantity(
        "shift_std",
        None,
        "the standard deviation of the lateral motion on straight track",
    )


class VehicleSection(Section):
    """[vehicle]: the vehicle whose bogies decide where the wheelset runs."""

    not_here: ClassVar[dict[str, str]] = {
        "wheel_diameter_difference_mm": "the key belongs to the wheelset; write it in "
        "[wheelset]",
    }
    file: Text = text_field("the name of a shipped vehicle, or the file of one")
    leading_share: float = quantity(
        "axle_share",
        0.5,
        "the share of the distance that the wheelset is the leading one of its bogie",
    )
    turned_share: float = quantity(
        "axle_share",
        0.5,
        "the share of the distance that the train is turned, right wheels on left "
        "rails",
    )
    axle: Literal["outer", "inner"] = Field(
        "outer",
        description="which axle of its bogie the wheelset is: the outer one is in the "
        "front bogie while it leads, the inner one in the rear bogie; it matters "
        "where the body holds the bogies",
    )
    axle_yaw_offset_mrad: float = quantity("axle_yaw_offset", 0.0)
    tangent: Literal["suspended", "kinematic", "guided", "shifted"] = Field(
        "suspended",
        description="how wheelsets move on straight track: held by their yaw "
        "stiffness, free to roll, held parallel while they move, or shifted without "
        "moving",
    )
    tangent_wavelength_m: float | None = quantity(
        "tangent_wavelength",
        None,
        "the wavelength of that motion, by default Klingel's of the new profiles",
    )
    positions: Literal["found", "frozen"] = Field(
        "found",
        description="whether positions in curves are found anew with the worn "
        "profiles of each wear step, or those of the new wheels are kept",
    )
    route: Text | None = text_field(
        "a CSV file of segments of track, reduced to classes, with columns named as "
        "their keys",
        None,
    )
    each: SegmentDefaults | None = None
    binning_tolerance: float = quantity(
        "binning_error",
        0.05,
        "the largest error of the wear of the classes that stand for all segments",
    )
    track: tuple[TrackSection, ...] = Field(
        (),
        alias="class",
        description="the classes of track",
        max_length=200,
        strict=False,
    )


def practice_of(section: VehicleSection | None) -> dict[KeyPath, PracticeKeys]:
    """Return what varies in each class of track, or in all segments of a route.

    By its path.
    """
    if section is None or section.track:
        return {
            ("vehicle", "class", k): track_class
            for k, track_class in enumerate(section.track if section else ())
        }
    return {("vehicle", "each"): section.each or PracticeKeys.model_validate({})}


def vehicle_faults(section: VehicleSection) -> Messages:
    """Faults between the keys of [vehicle] and its classes of track."""
    total = sum(entry.share for entry in section.track)
    if section.route is not None and section.track:
        text = "route and [[vehicle.class]] exclude each other; delete one of them"
        yield ("vehicle", "route"), text
    elif section.route is None and section.each is not None:
        text = "[vehicle.each] is for segments of a route; give route, or delete it"
        yield ("vehicle", "each"), text
    elif section.route is None and not section.track:
        text = (
            "[vehicle] has no track; write [[vehicle.class]], or route = a CSV file of "
            "segments"
        )
        yield ("vehicle",), text
    elif section.track and abs(total - 1.0) > SHARES_ROUNDED:
        text = (
            "share: the shares of all classes must sum to 1 within 1 %, not "
            f"{total:.7g}; change them"
        )
        yield ("vehicle", "class", 0, "share"), text
