"""What a scene file may hold: one model per table, with unit, limits and meaning of every key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, PrivateAttr

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import Fault
from wearsim.operation.recorded import Reduction, Samples
from wearsim.operation.route import Curve, Tangent
from wearsim.operation.states import Running as Settled
from wearsim.profile.standard import shipped_path
from wearsim.scene.campaign import CampaignSection, RailWearSection, RollerWearSection
from wearsim.scene.damage import FatigueSection, WearSection
from wearsim.scene.section import Registered, Section, SetPoints, Text, entries, number, range_of, words
from wearsim.scene.uncertainty import UncertaintySection
from wearsim.scene.vehicle import CurveRadius, Inclination, Route, VehicleSection
from wearsim.toml_faults import KeyPath, Lines, line_of

Shift = Annotated[float, Field(**range_of("shift"))]


class Header(Section):
    """What the file is."""

    title: Text = words("one line that names the campaign in results and reports", "")
    schema_version: Literal[1] = Field(1, alias="schema", description="the version of the scene format")


class RigHeader(Header):
    """[scene] of a roller rig."""

    kind: Literal["rig"] = Field(description="what the scene describes")


class FieldHeader(Header):
    """[scene] of service on track."""

    kind: Literal["field"] = Field(description="what the scene describes")


class CompareHeader(Header):
    """[scene] of a comparison."""

    kind: Literal["compare"] = Field(description="what the scene describes")


class AnyHeader(Section):
    """[scene] while the kind is not known; it decides which other keys are right."""

    model_config = ConfigDict(extra="ignore")
    kind: Literal["rig", "field", "compare", "sweep"] = Field(description="what the scene describes")


class AnyScene(Section):
    """A scene file while its kind is not known."""

    model_config = ConfigDict(extra="ignore")
    scene: AnyHeader


class WheelsetSection(Section):
    """[wheelset]: two wheels on an axle."""

    not_here: ClassVar[dict[str, str]] = {
        "flange_back_mm": "the key has a new name; write back_to_back_mm",
        "profile_right": "profile is that of the right wheel, and of both without profile_left",
    }
    profile: Text = words("the name of a shipped wheel profile, such as S1002, or a file of points")
    profile_left: Text | None = words("the profile of the left wheel, if it differs", None)
    wheel_diameter_difference_mm: float = number("wheel_diameter_difference", default=0.0)
    radius_mm: float = number(
        "wheel_radius",
        "the wheel radius at the running circle; without it half the diameter that the file of the profile "
        "states, if any",
        460.0,
    )
    smooth_mm: float | None = number("noise_wavelength", default=None)
    back_to_back_mm: float = number("back_to_back", "the back-to-back distance of the wheels", 1360.0)
    mass_kg: float | None = number("wheelset_mass", "the mass of the wheelset, for forces on its boxes", None)
    axle_box_distance_mm: float | None = number("axle_box_distance", default=None)


class CounterfaceSection(Section):
    """[counterface]: what rails and rollers with a rail's profile have in common."""

    profile: Text = words("the name of a shipped rail profile, such as 60E1, or a file of points")
    profile_left: Text | None = words("the profile of the left side, if it differs", None)
    inclination: Inclination = words('the inclination of the rail, such as "1:40", or "none"')
    gauge_mm: float = number("gauge", default=1435.0)
    gauge_height_mm: float = number("gauge_height", default=14.0)
    smooth_mm: float | None = number("noise_wavelength", default=None)


class RailSection(CounterfaceSection):
    """[counterface] in the field: rails."""

    not_here: ClassVar[dict[str, str]] = {
        key: 'a rail has no radius; delete the key, or write kind = "rig" in [scene]'
        for key in ("roller_radius_mm", "roller_radius_left_mm")
    }
    wear: RailWearSection | None = None
    curvature: ClassVar[float] = 0.0


class RollerSection(CounterfaceSection):
    """[counterface] on a rig: rollers with a rail's profile."""

    rig: Text | None = words("the name of a rig that wearsim ships, or its file", None)
    roller_radius_mm: float | None = number(
        "roller_radius", "the radius of the rollers at the profile's top, by default that of the rig", None
    )
    roller_radius_left_mm: float | None = number(
        "roller_radius", "the radius of the left roller, if it differs", None
    )
    drive: Literal["coupled", "independent"] | None = Field(
        None,
        description="whether both rollers turn alike, by default as those of the rig do, else coupled; of "
        "unlike radii they then run at unlike speeds, the mean of which is that of the block",
    )
    wear: RollerWearSection | None = None

    @property
    def curvature(self) -> float:
        """Curvature of the rollers at the profile's top [1/m]."""
        return 1e3 / self.roller_radius_mm if self.roller_radius_mm else 0.0

    @property
    def left_curvature(self) -> float | None:
        """Curvature of the left roller, if it differs [1/m]."""
        return 1e3 / self.roller_radius_left_mm if self.roller_radius_left_mm else None


CHAINS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "auto": (("kik_piotrowski", "fastsim"), ("knothe_le_the", "fastsim"), ("half_space", "half_space")),
    "accurate": (("half_space", "half_space"),),
    "fast": (("kik_piotrowski", "fastsim"),),
}
"""Normal and tangential models of each `model` of [contact], in the order in which they are tried; all but
the last are corrected by the last."""

NormalName = Annotated[str, Registered(lambda: NORMAL_MODELS)]
TangentialName = Annotated[str, Registered(lambda: TANGENTIAL_MODELS)]


_ONE_MATERIAL = (
    "wheel and counterface share one youngs_GPa and one poisson: with unequal ones shear would act back on "
    "the pressure, which no contact model here knows"
)


class ContactSection(Section):
    """[contact]: the models of the contact and how finely they are solved."""

    not_here: ClassVar[dict[str, str]] = {
        f"{name}_{body}{unit}": _ONE_MATERIAL
        for name, unit in (("youngs", "_GPa"), ("poisson", ""))
        for body in ("wheel", "rail", "roller", "counterface")
    }
    model: Literal["auto", "accurate", "fast"] | None = Field(
        None,
        description="in place of normal and tangential. auto: fast models, corrected by a half-space as "
        "often as the tolerance asks for; accurate: a half-space at every operating point; fast: "
        "kik_piotrowski and fastsim at every operating point",
    )
    tolerance: float = number(
        "contact_tolerance",
        "with model = auto, the error of the wear depth over its largest value at which the correction aims",
        0.03,
    )
    normal: NormalName = Field("kik_piotrowski", description="the model of the normal contact")
    tangential: TangentialName = Field("fastsim", description="the model of the tangential contact")
    strips: int = number("strips", default=30)
    cells: int = number("cells", "the smallest number of cells along a strip", 30)
    cell_mm: float = number("cell_size", default=0.5)
    most_cells: int = number("most_cells", default=120)
    youngs_GPa: float = number("youngs_modulus", "Young's modulus of both bodies", 210.0)
    poisson: float = number("poisson_ratio", "Poisson's ratio of both bodies", 0.3)
    rotation: Literal["free", "centred", "nominal"] = Field(
        "free", description="the rule that gives the wheels' rotation speed"
    )
    roll: Literal["given", "free"] = Field(
        "given",
        description="given: the roll of blocks and classes is roll_mrad; free: the wheelset rests on both "
        "wheels, whatever their wear",
    )
    torque_Nm: float = number("axle_torque", "the torque on the axle, driving forward", 0.0)
    virtual_penetration_factor: float = number("virtual_penetration_factor", default=0.55)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Normal and tangential models, in the order in which they are tried."""
        return CHAINS[self.model] if self.model else ((self.normal, self.tangential),)


class Running(SetPoints):
    """How the wheelset runs, alike in blocks and classes."""

    yaw_mrad: float = number("yaw", default=0.0)
    roll_mrad: float = number("roll", default=0.0)
    load_kN: float | None = number("wheel_load", default=None)
    wheel_load_right_kN: float | None = number("wheel_load", "the vertical load of the right wheel", None)
    wheel_load_left_kN: float | None = number("wheel_load", "the vertical load of the left wheel", None)
    axle_load_kN: float | None = number("axle_load", default=None)

    @property
    def balanced(self) -> bool:
        """Whether the shift or the wheel loads follow from forces."""
        keys = ("lateral_force_kN", "axle_box_right_kN", "axle_load_kN")
        return any(getattr(self, key, None) is not None for key in keys)

    @property
    def mean_load_kN(self) -> float:
        """What each wheel carries about, of unlike ones the mean."""
        if self.load_kN is not None:
            return self.load_kN
        if self.axle_load_kN is not None:
            return 0.5 * self.axle_load_kN
        if self.wheel_load_right_kN is not None and self.wheel_load_left_kN is not None:
            return 0.5 * (self.wheel_load_right_kN + self.wheel_load_left_kN)
        return math.inf


class BlockSection(Running):
    """[[operation.block]]: one block of the rig programme."""

    shift_mm: float | None = number("shift", "the lateral shift, + to the right", None)
    lateral_force_kN: float | None = number(
        "lateral_force", "the lateral force at axle height, + to the right, in place of the shift", None
    )
    axle_box_right_kN: float | None = number("axle_load", "the vertical force on the right axle box", None)
    axle_box_left_kN: float | None = number("axle_load", "the vertical force on the left axle box", None)
    speed_difference_percent: float | None = number("speed_difference", default=None)
    distance_km: float | None = number("block_length", "the distance run in this block of the loop", None)
    duration_h: float | None = number("duration", "the time of this block, in place of its distance", None)
    revolutions: float | None = number("revolutions", default=None)
    positions: int | None = number("ramp_positions", default=None)


class ClassSection(Running):
    """[[operation.class]]: one class of track in the field."""

    curve_radius_m: CurveRadius | None = Field(
        None,
        description="the curve radius, + to the right; none in tangent track",
        json_schema_extra={"unit": "m"},
    )
    shift_mean_mm: float = number("shift", "the mean lateral shift, + to the right")
    shift_std_mm: float = number("shift_std")
    positions: int = number("positions", "the number of lateral positions within 3 standard deviations", 15)
    share: float = number("weight", "the share of the distance")


class MonitorSection(Section):
    """[operation.monitor]: points solved and stored for comparison, which wear nothing."""

    shifts_mm: tuple[Shift, ...] = entries(
        "the lateral shifts to watch", 200, ..., min_length=1, json_schema_extra={"unit": "mm"}
    )
    yaw_mrad: float = number("yaw", default=0.0)
    load_kN: float = number("wheel_load", "the vertical load of one wheel")
    speed_km_h: float = number("speed", "the speed")
    friction: float = number("friction", "Coulomb's coefficient of friction")


class RecordColumns(Section):
    """[recorded.columns]: the column of the file by quantity, with its unit; what has none is constant."""

    time_s: Text | None = words("the time", None)
    time_h: Text | None = words("the time", None)
    distance_m: Text | None = words("the distance run", None)
    distance_km: Text | None = words("the distance run", None)
    speed_km_h: Text | None = words("the speed", None)
    speed_m_s: Text | None = words("the speed", None)
    shift_mm: Text | None = words("the lateral shift", None)
    shift_m: Text | None = words("the lateral shift", None)
    yaw_mrad: Text | None = words("the yaw", None)
    yaw_rad: Text | None = words("the yaw", None)
    curve_radius_m: Text | None = words("the curve radius, 0 on straight track, too", None)
    track_curvature_per_m: Text | None = words("the track curvature", None)
    track_curvature_per_km: Text | None = words("the track curvature", None)
    friction: Text | None = words("the coefficient of friction", None)
    wheel_load_right_kN: Text | None = words("the vertical load of the right wheel", None)
    wheel_load_right_N: Text | None = words("the vertical load of the right wheel", None)
    wheel_load_left_kN: Text | None = words("the vertical load of the left wheel", None)
    wheel_load_left_N: Text | None = words("the vertical load of the left wheel", None)
    axle_torque_kN_m: Text | None = words("the torque on the axle", None)
    axle_torque_N_m: Text | None = words("the torque on the axle", None)

    @property
    def given(self) -> dict[str, str]:
        """Columns by key, of those that are given."""
        return {key: name for key in type(self).model_fields if (name := getattr(self, key)) is not None}


class RecordedSection(Section):
    """[recorded]: samples of a simulated or measured run, in place of classes."""

    file: Text = words("the CSV or netCDF file of the samples")
    columns: RecordColumns
    shift_positive: Literal["right", "left"] = Field(description="to which side shifts count positive")
    yaw_positive: Literal["right", "left"] | None = Field(
        None, description="to which side the yaw counts positive"
    )
    curve_positive: Literal["right", "left"] | None = Field(None, description="which curves count positive")
    load_kN: float | None = number("wheel_load", "the vertical load of each wheel, if no column has it", None)
    speed_km_h: float | None = number("speed", "the speed, if no column has it", None)
    yaw_mrad: float = number("yaw", "the yaw of the wheelset, if no column has it", 0.0)
    friction: float | None = number("friction", "Coulomb's coefficient, if no column has it", None)
    friction_flange: float | None = number("friction_flange", default=None)
    environment: float = number(
        "environment", "the factor on the wear depth, 1 for dry laboratory coefficients", 1.0
    )
    binning_tolerance: float = number(
        "binning_error",
        "the largest error of the wear of the operating points that stand for all samples",
        0.02,
    )


class RigOperation(Section):
    """[operation] of a rig: a programme of blocks, looped until the distance is run."""

    not_here: ClassVar[dict[str, str]] = {
        "class": 'classes belong to a field scene; write [[operation.block]], or kind = "field" in [scene]'
    }
    programme: Text | None = words("a CSV file of blocks, one a row, with columns named as their keys", None)
    blocks: tuple[BlockSection, ...] = entries("the blocks of the rig programme", 1000, alias="block")
    together: bool = Field(
        False, description="weigh all blocks by their share of the loop in every step, not one after another"
    )
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Blocks by their path in the scene."""
        return {("operation", "block", k): block for k, block in enumerate(self.blocks)}


class FieldOperation(Section):
    """[operation] in the field: classes of track, each with a distribution of the shift."""

    not_here: ClassVar[dict[str, str]] = {
        "block": 'blocks belong to a rig scene; write [[operation.class]], or kind = "rig" in [scene]'
    }
    classes: tuple[ClassSection, ...] = entries("the classes of track", 1000, alias="class")
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Classes by their path in the scene."""
        return {("operation", "class", k): run for k, run in enumerate(self.classes)}


class ComparedSection(Section):
    """[compare]: the two scenes that are run and compared."""

    rig: Text = words("the scene file of the roller rig")
    field: Text = words("the scene file of the service on track")
    causes: bool = Field(
        False, description="split the factor of the worn area among the differences of the two scenes"
    )


@dataclass(frozen=True)
class Origin:
    """Where a scene was read from.

    The role is "scene" for the file the user named, "rig" or "field" for those a compare scene names.
    """

    path: Path
    role: str
    content: bytes
    lines: Lines


def find_file(name: str, folders: tuple[Path, ...], shipped: str) -> Path | None:
    """Existing file of a name: as given, in one of `folders`, or among the files in the `shipped` folder."""
    places = (Path(name), *(folder / name for folder in folders))
    places += (shipped_path(name), shipped_path(shipped, name))
    try:
        return next((place for place in places if place.is_file()), None)
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return None


class SceneModel(Section):
    """A scene file; `origin` is where it was read from."""

    _origin: Origin = PrivateAttr()
    _inputs: Any = PrivateAttr(None)  # set once the files it names were read

    @property
    def origin(self) -> Origin:
        """Where the scene was read from."""
        return self._origin

    def line(self, *path: str | int) -> int:
        """Line of a key in the scene file, counted from 1."""
        return line_of(self._origin.lines, path)

    @property
    def prefixed(self) -> dict[str, RigScene | FieldScene]:
        """Campaigns of the scene by what stands before their keys in overrides."""
        return {"": self} if isinstance(self, RigScene | FieldScene) else {}

    @property
    def parts(self) -> tuple[RigScene | FieldScene, ...]:
        """Campaigns of the scene, the rig first."""
        return tuple(self.prefixed.values())

    def fault(self, path: KeyPath, message: str) -> Fault:
        """Fault or warning at the line of a key."""
        return Fault(message, str(self._origin.path), self.line(*path))


class _Campaign(SceneModel):
    """What scenes of rig and field have in common."""

    scene: RigHeader | FieldHeader
    wheelset: WheelsetSection
    counterface: RailSection | RollerSection
    contact: ContactSection = Field(default_factory=lambda: ContactSection.model_validate({}))
    wear: WearSection = Field(default_factory=lambda: WearSection.model_validate({}))
    fatigue: FatigueSection | None = None
    operation: RigOperation | FieldOperation
    campaign: CampaignSection
    uncertainty: UncertaintySection | None = None
    # set once the files they follow from were read, or once they are asked for
    _running: Settled | None = PrivateAttr(None)  # where the new wheelset runs under controlled forces
    _samples: Samples = PrivateAttr()  # of a record
    _reduction: Reduction | None = PrivateAttr(None)  # of a record to operating points
    _route: Route = PrivateAttr()  # of a vehicle
    _track: tuple[Curve | Tangent, ...] = PrivateAttr(())  # its classes; once known, those of segments
    _of_track: tuple[int, ...] = PrivateAttr(())  # number of the class of each operating point
    _error: float = PrivateAttr(0.0)  # of the wear of classes that stand for segments


class RigScene(_Campaign):
    """A campaign on a roller rig."""

    scene: RigHeader
    counterface: RollerSection
    operation: RigOperation
    recorded: ClassVar[None] = None
    vehicle: ClassVar[None] = None

    def fault(self, path: KeyPath, message: str) -> Fault:
        """Fault or warning at the line of a key, of a block in the table it is from."""
        block = self.operation.blocks[int(path[2])] if path[1:2] == ("block",) and path[2:] else None
        return Fault(message, *block._place) if block and block._place else super().fault(path, message)


class FieldScene(_Campaign):
    """A campaign on track."""

    scene: FieldHeader
    counterface: RailSection
    operation: FieldOperation = Field(default_factory=lambda: FieldOperation.model_validate({}))
    recorded: RecordedSection | None = None
    vehicle: VehicleSection | None = None


_ELSEWHERE = (
    "a compare scene holds [scene], [compare] and [uncertainty]; move it into the two scenes it names"
)


class CompareScene(SceneModel):
    """Two campaigns, rig against field."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        ("wheelset", "counterface", "contact", "wear", "fatigue", "operation", "campaign"), _ELSEWHERE
    )
    scene: CompareHeader
    compare: ComparedSection
    uncertainty: UncertaintySection | None = None
    _rig: RigScene = PrivateAttr()
    _field: FieldScene = PrivateAttr()

    @property
    def rig(self) -> RigScene:
        """The scene of the rig."""
        return self._rig

    @property
    def field(self) -> FieldScene:
        """The scene of the field."""
        return self._field

    @property
    def prefixed(self) -> dict[str, RigScene | FieldScene]:
        """Campaigns of the scene by what stands before their keys in overrides."""
        return {"rig.": self._rig, "field.": self._field}
