"""[programme] of a rig scene: how a rig programme is designed from a target."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from wearsim.scene.section import Section, quantity, range_of
from wearsim.toml_faults import cross_check

Yaw = Annotated[float, Field(**range_of("yaw"))]
Load = Annotated[float, Field(**range_of("wheel_load"))]


class ProgrammeSection(Section):
    """[programme]: the design of a rig programme that reproduces a wear pattern."""

    not_here: ClassVar[dict[str, str]] = {
        "programme": "the CSV file of blocks stands in [operation]; write programme "
        "there",
    }
    tolerance: float = Field(
        0.05,
        description="the largest error of the worn pattern over its deepest wear at "
        "the end, but at least 2 um; also at the end of each stage",
        ge=0.001,
        le=1.0,
    )
    blocks: int = Field(
        0,
        description="the largest number of blocks of a stage, 0 for any number; few of "
        "them cost error and distance",
        ge=0,
        le=1000,
    )
    guard: float = Field(
        1.5,
        description="in each zone of the wheel, the largest ratio of pressure, wear "
        "index, and pressure over its shakedown limit to those of the field; 0 for no "
        "guard",
        ge=0.0,
        le=10.0,
    )
    changeover_min: float = Field(
        1.0,
        description="the time from one block to the next",
        ge=0.0,
        le=10000.0,
        json_schema_extra={"unit": "min"},
    )
    stage_depth_um: float = Field(
        50.0,
        description="the largest depth of a stage, after which the contact is solved "
        "anew; the first stages are shorter",
        ge=5.0,
        le=500.0,
        json_schema_extra={"unit": "um"},
    )
    loop_depth_um: float = Field(
        10.0,
        description="the largest depth of one loop of the blocks of a stage, which are "
        "run one after the other and again until the stage is worn",
        ge=1.0,
        le=500.0,
        json_schema_extra={"unit": "um"},
    )
    shift_mm: float | None = quantity(
        "shift",
        None,
        "the largest lateral shift to either side, by default that of the rig or the "
        "flange clearance",
    )
    shift_step_mm: float = Field(
        0.4,
        description="the distance between two lateral shifts",
        ge=0.05,
        le=5.0,
        json_schema_extra={"unit": "mm"},
    )
    lateral_force_kN: float | None = quantity(
        "lateral_force",
        None,
        "in place of the shift: blocks control the lateral force, up to this one to "
        "either side; by default where the rig does not control the shift",
    )
    lateral_force_step_kN: float = Field(
        10.0,
        description="the distance between two lateral forces; each set-point by force "
        "is a search for its balance, so few of them save time",
        ge=0.1,
        le=100.0,
        json_schema_extra={"unit": "kN"},
    )
    yaws_mrad: tuple[Yaw, ...] = Field(
        (-4.0, -2.0, -1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0, 4.0),
        description="the yaw angles to choose from, those of the default within the "
        "limits of the rig; one value fixes the yaw",
        min_length=1,
        max_length=50,
        strict=False,
        json_schema_extra={"unit": "mrad"},
    )
    loads_kN: tuple[Load, ...] = Field(
        (25.0, 35.0, 50.0, 65.0, 80.0, 100.0),
        description="the wheel loads to choose from, those of the default within the "
        "limits of the rig; one value fixes the load",
        min_length=1,
        max_length=50,
        strict=False,
        json_schema_extra={"unit": "kN"},
    )
    ramps: bool = Field(
        True,
        description="whether blocks may be ramps, along which the shift changes "
        "evenly; not of lateral forces",
    )
    speed_km_h: float | None = quantity(
        "speed", None, "the speed, by default the highest one of the scene's blocks"
    )
    friction: float | None = quantity(
        "friction",
        None,
        "Coulomb's coefficient of friction, by default that of the scene's blocks",
    )

    @model_validator(mode="after")
    def _of_a_guard(self) -> Self:
        if 0.0 < self.guard < 1.0:
            text = (
                f"guard = {self.guard:g} asks for less than the field has; write 1 or "
                "more, or 0 for no guard"
            )
            raise cross_check(text, "guard")
        return self

    @model_validator(mode="after")
    def _by_shift_or_force(self) -> Self:
        if self.shift_mm is not None and self.lateral_force_kN is not None:
            text = "shift_mm and lateral_force_kN exclude each other; delete one"
            raise cross_check(text, "lateral_force_kN")
        return self
