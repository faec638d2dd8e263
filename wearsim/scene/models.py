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
from wearsim.scene.section import Registered, Section, SetPoints, Text, range_of
from wearsim.scene.uncertainty import UncertaintySection
from wearsim.scene.vehicle import CurveRadius, Inclination, VehicleSection
from wearsim.toml_faults import KeyPath, Lines, cross_check, line_of

Shift = Annotated[float, Field(**range_of("shift"))]


class Header(Section):
    """What the file is."""

    title: Text = ""
    schema_version: Literal[1] = 1


class RigHeader(Header):
    """[scene] of a roller rig."""

    kind: Literal["rig"]


class FieldHeader(Header):
    """[scene] of service on track."""

    kind: Literal["field"]


class CompareHeader(Header):
    """[scene] of a comparison."""

    kind: Literal["compare"]


class AnyHeader(Section):
    """[scene] while the kind is not known; it decides which other keys are right."""

    model_config = ConfigDict(extra="ignore")
    kind: Literal["rig", "field", "compare", "sweep"]


class AnyScene(Section):
    """A scene file while its kind is not known."""

    model_config = ConfigDict(extra="ignore")
    scene: AnyHeader


class WheelsetSection(Section):
    """[wheelset]: two wheels on an axle."""

    profile: Text
    profile_left: Text | None = None
    at_km: float | None = None
    wheel_diameter_difference_mm: float = 0.0
    radius_mm: float = 460.0
    smooth_mm: float | None = None
    back_to_back_mm: float = 1360.0
    mass_kg: float | None = None
    axle_box_distance_mm: float | None = None

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

    profile: Text
    profile_left: Text | None = None
    inclination: Inclination
    gauge_mm: float = 1435.0
    gauge_height_mm: float = 14.0
    smooth_mm: float | None = None


class RailSection(CounterfaceSection):
    """[counterface] in the field: rails."""

    wear: RailWearSection | None = None
    curvature: ClassVar[float] = 0.0


class RollerSection(CounterfaceSection):
    """[counterface] on a rig: rollers with a rail's profile."""

    rig: Text | None = None
    roller_radius_mm: float | None = None
    roller_radius_left_mm: float | None = None
    drive: Literal["coupled", "independent"] | None = None
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

    removed: ClassVar[dict[str, str]] = {
        "tolerance": TOLERANCE_REMOVED,
        'model = "auto"': AUTO_REMOVED,
        **{
            f"normal = {shown(name)}": f"contact.normal = {shown(name)} {message}"
            for name, message in NORMAL_MODELS.unusable.items()
        },
    }
    model: Literal["fast", "standard", "accurate"] = "standard"
    normal: NormalName | None = None
    tangential: TangentialName | None = None
    strips: int = 30
    cells: int = 30
    cell_mm: float = 0.5
    most_cells: int = 120
    youngs_GPa: float = 210.0
    poisson: float = 0.3
    rotation: Literal["free", "centred", "nominal"] = "free"
    roll: Literal["given", "free"] = "given"
    torque_Nm: float = 0.0
    virtual_penetration_factor: float = 0.55

    @property
    def pair(self) -> tuple[str, str]:
        """Normal and tangential model."""
        normal, tangential = PAIRS[self.model]
        return self.normal or normal, self.tangential or tangential


class Running(SetPoints):
    """How the wheelset runs, alike in blocks and classes."""

    yaw_mrad: float = 0.0
    roll_mrad: float = 0.0
    load_kN: float | None = None
    wheel_load_right_kN: float | None = None
    wheel_load_left_kN: float | None = None
    axle_load_kN: float | None = None

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

    shift_mm: float | None = None
    lateral_force_kN: float | None = None
    axle_box_right_kN: float | None = None
    axle_box_left_kN: float | None = None
    speed_difference_percent: float | None = None
    distance_km: float | None = None
    duration_h: float | None = None
    revolutions: float | None = None
    positions: int | None = None


class ClassSection(Running):
    """[[operation.class]]: one class of track in the field."""

    curve_radius_m: CurveRadius | None = None
    shift_mean_mm: float
    shift_std_mm: float
    positions: int = 15
    share: float


class MonitorSection(Section):
    """[operation.monitor]: points solved and stored for comparison, which wear nothing."""

    shifts_mm: tuple[Shift, ...]
    yaw_mrad: float = 0.0
    load_kN: float
    speed_km_h: float
    friction: float


class RecordColumns(Section):
    """[recorded.columns]: the column of the file by quantity, with its unit; what has none is constant."""

    others: ClassVar[str] = "Text"

    @property
    def given(self) -> dict[str, str]:
        """Columns by key, of those that are given."""
        return {key: name for key in type(self).model_fields if (name := getattr(self, key)) is not None}


class RecordedSection(Section):
    """[recorded]: samples of a simulated or measured run, in place of classes."""

    file: Text
    columns: RecordColumns
    shift_positive: Literal["right", "left"]
    yaw_positive: Literal["right", "left"] | None = None
    curve_positive: Literal["right", "left"] | None = None
    load_kN: float | None = None
    speed_km_h: float | None = None
    yaw_mrad: float = 0.0
    friction: float | None = None
    friction_flange: float | None = None
    environment: float = 1.0
    binning_tolerance: float = 0.02


class RigOperation(Section):
    """[operation] of a rig: a programme of blocks, looped until the distance is run."""

    programme: Text | None = None
    blocks: tuple[BlockSection, ...] = ()
    together: bool = False
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Blocks by their path in the scene."""
        return {("operation", "block", k): block for k, block in enumerate(self.blocks)}


class FieldOperation(Section):
    """[operation] in the field: classes of track, each with a distribution of the shift."""

    classes: tuple[ClassSection, ...] = ()
    monitor: MonitorSection | None = None

    @property
    def runs(self) -> dict[KeyPath, BlockSection | ClassSection]:
        """Classes by their path in the scene."""
        return {("operation", "class", k): run for k, run in enumerate(self.classes)}


class ComparedSection(Section):
    """[compare]: the two scenes that are run and compared."""

    rig: Text
    field: Text
    causes: bool = False


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
