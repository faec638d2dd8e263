"""Scenes of kind "wear_steps": what longer steps than control allows do to a new wheel."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, Strict
from pydantic_core import PydanticCustomError

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.scene.models import Header, NormalName, SceneModel
from wearsim.scene.section import Section, quantity


def _leading(name: str) -> str:
    if not NORMAL_MODELS[name].can_update_profile:
        raise PydanticCustomError("out_of_range", "model", {"allowed": "a model that may lead a campaign"})
    return name


class WearStepsHeader(Header):
    """[scene] of a study of wear steps."""

    kind: Literal["wear_steps"] = Field(description="what the scene describes")


class StepModelSection(Section):
    """[[model]]: one normal contact model, and the steps it is tried with."""

    normal: Annotated[NormalName, AfterValidator(_leading)] = Field(
        description="the model of the normal contact"
    )
    beyond: float = quantity(
        "how many times the longest stable step the steps without control are", "", gt=1, le=100
    )
    depth_um: float = quantity("the wear depth to reach", "um", ge=10, le=1000)


class WearStepsScene(SceneModel):
    """S1002 on 60E1 1:40, worn with control on and off."""

    scene: WearStepsHeader
    models: Annotated[tuple[StepModelSection, ...], Strict(False)] = Field(
        alias="model", min_length=1, max_length=10, description="the models"
    )
    noise_um: float = quantity("the noise of the new profile", "um", 0.05, ge=0, le=5)
    strips: int = quantity("the number of strips across a patch", "", 60, ge=10, le=400)
    cells: int = quantity("the number of cells along a strip", "", 16, ge=5, le=400)
    remarks: str = Field("", description="a paragraph for the report", max_length=5000)
