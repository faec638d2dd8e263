"""What a scene file may hold.

One model per table, with unit, limits and meaning of every key.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, PrivateAttr, Strict, model_validator

from wearsim.errors import Fault, listed, shown
from wearsim.profile.files import is_result
from wearsim.profile.measures import MeasuringRule
from wearsim.profile.standard import shipped_path
from wearsim.scene.campaign import CampaignSection, RailWearSection, RollerWearSection
from wearsim.scene.contact import ContactSection
from wearsim.scene.damage import FatigueSection, WearSection
from wearsim.scene.operation import (
    FieldOperation,
    RigOperation,
)
from wearsim.scene.overrides import Override
from wearsim.scene.point_files import (
    FileFormat,
    Mirror,
    OffsetY,
    OffsetZ,
    PointOrigin,
    Units,
    ZUp,
    one_origin,
)
from wearsim.scene.programme import ProgrammeSection
from wearsim.scene.recorded import RecordedSection
from wearsim.scene.section import (
    Section,
    Text,
    quantity,
    text_field,
)
from wearsim.scene.uncertainty import UncertaintySection
from wearsim.scene.vehicle import Inclination, VehicleSection
from wearsim.toml_faults import KeyPath, Lines, cross_check, line_of


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
    format: FileFormat = None
    units: Units = None
    mirror: Mirror = None
    z_up: ZUp = None
    origin: PointOrigin = None
    offset_y_mm: OffsetY = None
    offset_z_mm: OffsetZ = None
    back_to_back_mm: float = quantity(
        "back_to_back", 1360.0, "the back-to-back distance of the wheels"
    )
    measuring_height_mm: float = quantity(
        "measuring_height",
        10.0,
        "the height above the running circle at which Sd is measured, such as 12 for "
        "the Chinese LMA",
    )
    running_circle_mm: float = quantity("running_circle", 70.0)
    conicity_amplitude_mm: float = quantity("conicity_amplitude", 3.0)
    mass_kg: float | None = quantity(
        "wheelset_mass", None, "the mass of the wheelset, for forces on its boxes"
    )
    axle_box_distance_mm: float | None = quantity("axle_box_distance", None)

    @property
    def measuring_rule(self) -> MeasuringRule:
        """Places at which Sh, Sd and qR are measured."""
        return MeasuringRule(
            1e-3 * self.measuring_height_mm, 1e-3 * self.running_circle_mm
        )

    @model_validator(mode="after")
    def _of_a_result(self) -> Self:
        if self.at_km is not None and not any(
            map(is_result, (self.profile, self.profile_left))
        ):
            text = (
                "at_km picks a state of a result file (.nc), but profile names none; "
                "delete it"
            )
            raise cross_check(text, "at_km")
        return self

    _one_origin = one_origin

    @property
    def left(self) -> str | None:
        """Profile of the left wheel, if it is not that of the right one.

        Of a result its own.
        """
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
    format: FileFormat = None
    units: Units = None
    mirror: Mirror = None
    z_up: ZUp = None
    ends: Literal["open", "sharp"] = Field(
        "open",
        description="whether rails or rollers go on beyond the points of their "
        "profiles, or end there, as discs do",
    )


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


class ComparedSection(Section):
    """[compare]: the two scenes that are run and compared."""

    rig: Text | None = text_field("the scene file of the roller rig", None)
    field: Text | None = text_field("the scene file of the service on track", None)
    scenes: Annotated[tuple[Text, ...], Strict(False)] = Field(
        (),
        description="in place of rig and field two scene files of any kind, such as "
        "two wheel profiles or two rules of maintenance; two of one kind are set side "
        "by side under the names of their files",
    )
    causes: bool = Field(
        False,
        description="split the factor of the worn area among the differences of the "
        "two scenes",
    )

    @model_validator(mode="after")
    def _two_scenes(self) -> Self:
        named = [key for key in ("rig", "field") if getattr(self, key) is not None]
        if len(self.scenes) not in (0, 2):
            text = f"scenes = {shown(list(self.scenes))} must be two files; name two"
            raise cross_check(text, "scenes")
        if self.scenes and named:
            text = f"scenes and {listed(named)} exclude each other; delete one of them"
            raise cross_check(text, "scenes")
        if not self.scenes and len(named) < 2:
            missing = {"rig", "field"} - {*named}
            text = (
                f"[compare] needs {listed(sorted(missing))}; name both scenes, or "
                "write scenes, a list of two"
            )
            raise cross_check(text)
        return self


@dataclass(frozen=True)
class Origin:
    """Origin of a scene: file, role, content and lines.

    The role is "scene" for the file the user named, "rig" or "field" for those a
    compare scene names.
    """

    path: Path
    role: str
    content: bytes
    lines: Lines
    row_overrides: tuple[Override, ...] = ()  # of rows of the programme it names
    with_overrides: bool = False  # whether the file was written with overrides


def find_file(name: str, folders: tuple[Path, ...], shipped: str) -> Path | None:
    """Existing file of a name.

    As given, in one of `folders`, or among the files in the `shipped` folder.
    """
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
        """Origin of the scene."""
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
    contact: ContactSection = Field(
        default_factory=lambda: ContactSection.model_validate({})
    )
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
    programme: ProgrammeSection | None = None
    recorded: ClassVar[None] = None
    vehicle: ClassVar[None] = None

    def fault(self, path: KeyPath, message: str) -> Fault:
        """Fault or warning at the line of a key, of a block in the table it is from."""
        block = (
            self.operation.blocks[int(path[2])]
            if path[1:2] == ("block",) and path[2:]
            else None
        )
        if block is None or block._place is None:
            return super().fault(path, message)
        file, lines = block._place
        return Fault(message, file, line_of(lines, path[3:]))


class FieldScene(_Campaign):
    """A campaign on track."""

    scene: FieldHeader
    counterface: RailSection
    operation: FieldOperation = Field(
        default_factory=lambda: FieldOperation.model_validate({})
    )
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


class PairScene(SceneModel):
    """Two campaigns of one kind, named after their files: each runs on its own."""

    scene: CompareHeader
    compare: ComparedSection
    _pair: dict[str, RigScene | FieldScene] = PrivateAttr(default_factory=dict)

    @property
    def pair(self) -> dict[str, RigScene | FieldScene]:
        """Both scenes by their names."""
        return self._pair

    @property
    def prefixed(self) -> dict[str, RigScene | FieldScene]:
        """Campaigns of the scene by what stands before their keys in overrides."""
        return {f"{name}.": part for name, part in self._pair.items()}
