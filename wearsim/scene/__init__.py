"""The scene file: read, checked with all faults at once, and made into the ingredients of a campaign."""

from wearsim.scene.inputs import files_to_copy
from wearsim.scene.models import CompareScene, FieldScene, RigScene
from wearsim.scene.prepared import Prepared, prepare, prepare_again
from wearsim.scene.read import CampaignScene, Scene, load_campaign, load_scene
from wearsim.scene.reference import scene_schema
from wearsim.scene.setup import CampaignSetup, build
from wearsim.scene.sweep import SweepScene

__all__ = [
    "CampaignScene", "CampaignSetup", "CompareScene", "FieldScene", "Prepared", "RigScene", "Scene",
    "SweepScene", "build", "files_to_copy", "load_campaign", "load_scene", "prepare", "prepare_again",
    "scene_schema",
]  # fmt: skip
