"""The scene file: read, checked with all faults at once, and made into the ingredients of a campaign."""

from wearsim.scene.load import CampaignSetup, Scene, build, files_to_copy, load_scene, scene_schema
from wearsim.scene.models import CompareScene, FieldScene, RigScene

__all__ = [
    "CampaignSetup",
    "CompareScene",
    "FieldScene",
    "RigScene",
    "Scene",
    "build",
    "files_to_copy",
    "load_scene",
    "scene_schema",
]
