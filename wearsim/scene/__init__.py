"""The scene file: read, checked with all faults at once, and made into the ingredients of a campaign."""

from wearsim.scene.load import (
    CampaignScene,
    Scene,
    StudyScene,
    files_to_copy,
    load_campaign,
    load_scene,
    scene_schema,
)
from wearsim.scene.location import LocationScene
from wearsim.scene.models import CompareScene, FieldScene, RigScene
from wearsim.scene.published import PublishedScene
from wearsim.scene.setup import CampaignSetup, build
from wearsim.scene.sweep import SweepScene

__all__ = [
    "CampaignScene",
    "CampaignSetup",
    "CompareScene",
    "FieldScene",
    "LocationScene",
    "PublishedScene",
    "RigScene",
    "Scene",
    "StudyScene",
    "SweepScene",
    "build",
    "files_to_copy",
    "load_campaign",
    "load_scene",
    "scene_schema",
]
