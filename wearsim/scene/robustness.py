"""Scenes of kind "robustness": contact models in situations that are hard on them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from wearsim.scene.models import Header, SceneModel
from wearsim.scene.section import Section, quantity


class RobustnessHeader(Header):
    """[scene] of the study where contact models fail."""

    kind: Literal["robustness"] = Field(description="what the scene describes")


class GridsSection(Section):
    """[grids]: how finely the models are solved, and the half-space solution they are measured against."""

    models: int = quantity(
        "the number of strips across a patch and of cells along each", "", 50, ge=8, le=400
    )
    reference: int = quantity("the same of the reference", "", 80, ge=8, le=400)


class LimitsSection(Section):
    """[limits]: borders between outcomes."""

    right_percent: float = quantity("the largest error of an answer that is right", "%", 10.0, gt=0, le=100)
    wrong_percent: float = quantity("the error above which an answer is wrong", "%", 100.0, ge=10, le=1000)
    seconds: float = quantity("the longest time a solution may take", "s", 20.0, gt=0, le=3600)


class RobustnessScene(SceneModel):
    """Every combination of contact models in every situation."""

    scene: RobustnessHeader
    grids: GridsSection = Field(default_factory=GridsSection, description="how finely contacts are solved")
    limits: LimitsSection = Field(default_factory=LimitsSection, description="borders between outcomes")
    remarks: str = Field("", description="a paragraph for the report", max_length=5000)
