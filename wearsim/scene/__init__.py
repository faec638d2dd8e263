"""The scene file: read, checked with all faults at once, and made into the ingredients of a campaign."""

from wearsim.scene.accuracy import AccuracyScene
from wearsim.scene.load import (
    CampaignScene,
    Scene,
    StudyScene,
    files_to_copy,
    load_campaign,
    load_scene,
    scene_schema,
)
from wearsim.scene.models import CompareScene, FieldScene, RigScene
from wearsim.scene.robustness import RobustnessScene
from wearsim.scene.setup import CampaignSetup, build
from wearsim.scene.sweep import SweepScene
from wearsim.scene.wear_steps import WearStepsScene

__all__ = [
    "AccuracyScene",
    "CampaignScene",
    "CampaignSetup",
    "CompareScene",
    "FieldScene",
    "RigScene",
    "RobustnessScene",
    "Scene",
    "StudyScene",
    "SweepScene",
    "WearStepsScene",
    "build",
    "files_to_copy",
    "load_campaign",
    "load_scene",
    "scene_schema",
]
