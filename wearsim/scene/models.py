"""What a scene file may hold: one model per table, with unit, limits and meaning of every key."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import AUTO_REMOVED, PAIRS, TOLERANCE_REMOVED
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import Fault, shown
from wearsim.profile.files import is_result
from wearsim.profile.standard import shipped_path
from wearsim.scene.campaign import CampaignSection, RailWearSection, RollerWearSection
from wearsim.scene.damage import FatigueSection, WearSection
from wearsim.scene.overrides import Override
from wearsim.scene.recorded import RecordedSection
from wearsim.scene.section import (
    Registered,
    Section,
    SetPoints,
    Text,
    quantity,
    range_of,
    text_field,
)
from wearsim.scene.uncertainty import UncertaintySection
from wearsim.scene.vehicle import CurveRadius, Inclination, VehicleSection
from wearsim.toml_faults import KeyPath, Lines, cross_check, line_of

Shift = Annotated[float, Field(**range_of("shift"))]


class Header(Section):
    """What the file is."""

    title: Text = text_field(
        "one line that names the campaign in results and reports", ""
    )
    schema_version: Literal[1] = Field(
        1, alias="schema", description="the version of the scene format"
    )


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
    kind: Literal["rig", "field", "compare", "sweep"] = Field(
        description="what the scene describes"
    )


class AnyScene(Section):
    """A scene file while its kind is not known."""

    model_config = ConfigDict(extra="ignore")
    scene: AnyHeader


class WheelsetSection(Section):
    """[wheelset]: two wheels on an axle."""

    not_here: ClassVar[dict[str, str]] = {
        "flange_back_mm": "the key has a new name; write back_to_back_mm",
        "profile_right": "profile is that of the right wheel, and of both without "
        "profile_left",
    }
    profile: Text = text_field(
        "the name of a shipped wheel profile, such as S1002, a file of points, or a "
        "result file (.nc), whose worn wheels are taken",
    )
    profile_left: Text | None = text_field(
        "the profile of the left wheel, if it differs", None
    )
    at_km: float | None = Field(
        None,
        description="of a result file: the distance at which its wheels are taken, by "
        "default the last",
        json_schema_extra={"unit": "km"},
    )
    wheel_diameter_difference_mm: float = quantity("wheel_diameter_difference", 0.0)
    radius_mm: float = quantity(
        "wheel_radius",
        460.0,
        "the wheel radius at the running circle; without it half the diameter that "
        "the file of the profile states, if any",
    )
    smooth_mm: float | None = quantity("noise_wavelength", None)
    back_to_back_mm: float = quantity(
        "back_to_back", 1360.0, "the back-to-back distance of the wheels"
    )
    mass_kg: float | None = quantity(
        "wheelset_mass", None, "the mass of the wheelset, for forces on its boxes"
    )
    axle_box_distance_mm: float | None = quantity("axle_box_distance", None)

    @model_validator(mode="after")
    def _of_a_result(self) -> Self:
        if self.at_km is not None and not any(map(is_result, (self.profile, self.profile_left))):
            text = (
                "at_km picks a state of a result file (.nc), but profile names none; "
                "delete it"
            )
            raise cross_check(text, "at_km")
        return self

    @property
    def left(self) -> str | None:
        """Profile of the left wheel, if it is not that of the right one: of a result its own."""
        return self.profile_left or (self.profile if is_result(self.profile) else None)


class CounterfaceSection(Section):
    """[counterface]: what rails and rollers with a rail's profile have in common."""

    profile: Text = text_field(
        "the name of a shipped rail profile, such as 60E1, or a file of points"
    )
    profile_left: Text | None = text_field(
        "the profile of the left side, if it differs", None
    )
    inclination: Inclination = text_field(
        'the inclination of the rail, such as "1:40", or "none"'
    )
    gauge_mm: float = quantity("gauge", 1435.0)
    gauge_height_mm: float = quantity("gauge_height", 14.0)
    smooth_mm: float | None = quantity("noise_wavelength", None)


class RailSection(CounterfaceSection):
    """[counterface] in the field: rails."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        ("roller_radius_mm", "roller_radius_left_mm"),
        'a rail has no radius; delete the key, or write kind = "rig" in [scene]',
    )
    wear: RailWearSection | None = None
    curvature: ClassVar[float] = 0.0


class RollerSection(CounterfaceSection):
    """[counterface] on a rig: rollers with a rail's profile."""

    rig: Text | None = text_field(
        "the name of a rig that wearsim ships, or its file", None
    )
    roller_radius_mm: float | None = quantity(
        "roller_radius",
        None,
        "the radius of the rollers at the profile's top, by default that of the rig",
    )
    roller_radius_left_mm: float | None = quantity(
        "roller_radius", None, "the radius of the left roller, if it differs"
    )
    drive: Literal["coupled", "independent"] | None = Field(
        None,
        description="whether both rollers turn alike, by default as those of the rig "
        "do, else coupled; of unlike radii they then run at unlike speeds, the mean "
        "of which is that of the block",
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


NormalName = Annotated[str, Registered(NORMAL_MODELS)]
TangentialName = Annotated[str, Registered(TANGENTIAL_MODELS)]


class ContactSection(Section):
    """[contact]: the models of the contact and how finely they are solved."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        (
            "youngs_wheel_GPa",
            "youngs_rail_GPa",
            "youngs_roller_GPa",
            "youngs_counterface_GPa",
            "poisson_wheel",
            "poisson_rail",
            "poisson_roller",
            "poisson_counterface",
        ),
        "wheel and counterface share one youngs_GPa and one poisson: with unequal "
        "ones shear would act back on the pressure, which no contact model here "
        "knows",
    )
    removed: ClassVar[dict[str, str]] = {
        "tolerance": TOLERANCE_REMOVED,
        'model = "auto"': AUTO_REMOVED,
        **{
            f"normal = {shown(name)}": f"contact.normal = {shown(name)} {message}"
            for name, message in NORMAL_MODELS.unusable.items()
        },
    }
    model: Literal["fast", "standard", "accurate"] = Field(
        "standard",
        description="the models of the contact. fast: kik_piotrowski and fastsim; "
        "standard: coupled_strips in both; accurate: a half-space in both",
    )
    normal: NormalName | None = Field(
        None, description="the model of the normal contact, in place of that of model"
    )
    tangential: TangentialName | None = Field(
        None,
        description="the model of the tangential contact, in place of that of model",
    )
    strips: int = quantity("strips", 30)
    cells: int = quantity("cells", 30, "the smallest number of cells along a strip")
    cell_mm: float = quantity("cell_size", 0.5)
    most_cells: int = quantity("most_cells", 120)
    youngs_GPa: float = quantity(
        "youngs_modulus", 210.0, "Young's modulus of both bodies"
    )
    poisson: float = quantity("poisson_ratio", 0.3, "Poisson's ratio of both bodies")
    rotation: Literal["free", "centred", "nominal"] = Field(
        "free", description="the rule that gives the wheels' rotation speed"
    )
    roll: Literal["given", "free"] = Field(
        "given",
        description="given: the roll of blocks and classes is roll_mrad; free: the "
        "wheelset rests on both wheels, whatever their wear",
    )
    torque_Nm: float = quantity(
        "axle_torque", 0.0, "the torque on the axle, driving forward"
    )
    virtual_penetration_factor: float = quantity("virtual_penetration_factor", 0.55)

    @property
    def pair(self) -> tuple[str, str]:
        """Normal and tangential model."""
        normal, tangential = PAIRS[self.model]
        return self.normal or normal, self.tangential or tangential


class Running(SetPoints):
    """How the wheelset runs, alike in blocks and classes."""

    yaw_mrad: float = quantity("yaw", 0.0)
    roll_mrad: float = quantity("roll", 0.0)
    load_kN: float | None = quantity("wheel_load", None)
    wheel_load_right_kN: float | None = quantity(
        "wheel_load", None, "the vertical load of the right wheel"
    )
    wheel_load_left_kN: float | None = quantity(
        "wheel_load", None, "the vertical load of the left wheel"
    )
    axle_load_kN: float | None = quantity("axle_load", None)

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

    shift_mm: float | None = quantity(
        "shift", None, "the lateral shift, + to the right"
    )
    lateral_force_kN: float | None = quantity(
        "lateral_force",
        None,
        "the lateral force at axle height, + to the right, in place of the shift",
    )
    axle_box_right_kN: float | None = quantity(
        "axle_load", None, "the vertical force on the right axle box"
    )
    axle_box_left_kN: float | None = quantity(
        "axle_load", None, "the vertical force on the left axle box"
    )
    speed_difference_percent: float | None = quantity("speed_difference", None)
    distance_km: float | None = quantity(
        "block_length", None, "the distance run in this block of the loop"
    )
    duration_h: float | None = quantity(
        "duration", None, "the time of this block, in place of its distance"
    )
    revolutions: float | None = quantity("revolutions", None)
    positions: int | None = quantity("ramp_positions", None)


class ClassSection(Running):
    """[[operation.class]]: one class of track in the field."""

    curve_radius_m: CurveRadius | None = Field(
        None,
        description="the curve radius, + to the right; none in tangent track",
        json_schema_extra={"unit": "m"},
    )
    shift_mean_mm: float = quantity(
        "shift", meaning="the mean lateral shift, + to the right"
    )
    shift_std_mm: float = quantity("shift_std")
    positions: int = quantity(
        "positions", 15, "the number of lateral positions within 3 standard deviations"
    )
    share: float = quantity("weight", meaning="the share of the distance")


class MonitorSection(Section):
    """[operation.monitor]: points solved and stored for comparison, which wear nothing."""

    shifts_mm: tuple[Shift, ...] = Field(
        description="the lateral shifts to watch",
        min_length=1,
        max_length=200,
        strict=False,
        json_schema_extra={"unit": "mm"},
    )
    yaw_mrad: float = quantity("yaw", 0.0)
    load_kN: float = quantity("wheel_load", meaning="the vertical load of one wheel")
    speed_km_h: float = quantity("speed", meaning="the speed")
    friction: float = quantity("friction", meaning="Coulomb's coefficient of friction")


class RigOperation(Section):
    """[operation] of a rig: a programme of blocks, looped until the distance is run."""

    not_here: ClassVar[dict[str, str]] = {
        "class": "classes belong to a field scene; write [[operation.block]], or kind "
        '= "field" in [scene]',
    }
    programme: Text | None = text_field(
        "a CSV file of blocks, one a row, with columns named as their keys", None
    )
    blocks: tuple[BlockSection, ...] = Field(
        (),
        alias="block",
        description="the blocks of the rig programme",
        max_length=1000,
        strict=False,
    )
    together: bool = Field(
        False,
        description="weigh all blocks by their share of the loop in every step, not "
        "one after another",
    )
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Blocks by their path in the scene."""
        return {("operation", "block", k): block for k, block in enumerate(self.blocks)}


class FieldOperation(Section):
    """[operation] in the field: classes of track, each with a distribution of the shift."""

    not_here: ClassVar[dict[str, str]] = {
        "block": "blocks belong to a rig scene; write [[operation.class]], or kind = "
        '"rig" in [scene]',
    }
    classes: tuple[ClassSection, ...] = Field(
        (),
        alias="class",
        description="the classes of track",
        max_length=1000,
        strict=False,
    )
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Classes by their path in the scene."""
        return {("operation", "class", k): run for k, run in enumerate(self.classes)}


class ComparedSection(Section):
    """[compare]: the two scenes that are run and compared."""

    rig: Text = text_field("the scene file of the roller rig")
    field: Text = text_field("the scene file of the service on track")
    causes: bool = Field(
        False,
        description="split the factor of the worn area among the differences of the "
        "two scenes",
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
    row_overrides: tuple[Override, ...] = ()  # of rows of the programme it names


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
        if block is None or block._place is None:
            return super().fault(path, message)
        file, lines = block._place
        return Fault(message, file, line_of(lines, path[3:]))


class FieldScene(_Campaign):
    """A campaign on track."""

    scene: FieldHeader
    counterface: RailSection
    operation: FieldOperation = Field(default_factory=lambda: FieldOperation.model_validate({}))
    recorded: RecordedSection | None = None
    vehicle: VehicleSection | None = None


class CompareScene(SceneModel):
    """Two campaigns, rig against field."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        (
            "wheelset",
            "counterface",
            "contact",
            "wear",
            "fatigue",
            "operation",
            "campaign",
        ),
        "a compare scene holds [scene], [compare] and [uncertainty]; move it into "
        "the two scenes it names",
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
