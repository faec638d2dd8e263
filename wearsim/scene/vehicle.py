"""[vehicle] of a field scene: a vehicle file and the track it runs on, in place of given shifts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from wearsim.errors import shown
from wearsim.operation.bogie import Vehicle
from wearsim.profile.placement import slope_of
from wearsim.profile.standard import shipped_path
from wearsim.quantities import QUANTITIES
from wearsim.scene.section import Section, SetPoints, Text
from wearsim.toml_faults import KeyPath, cross_check, suggestion

SHARES_ROUNDED = 0.01

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
        elif self.curve_radius_m is not None and self.shift_std_mm is not None and not self.by_file:
            key = "shift_std_mm"
            text = (
                "shift_std_mm is for straight track: the balance of the bogie gives "
                "the shift; delete it"
            )
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
