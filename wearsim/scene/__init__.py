"""The scene file, in four steps: read, check, prepare, build.

`load_scene` reads a file and those it names (`read.py`) and checks them: each table by
its model and the functions `..._faults` beside it, tables with one another and with
profiles in `checks.py`; all faults at once. `prepare` solves what has to be known
before
a campaign begins, `build` makes its ingredients, in SI units (`setup.py`).
"""

from wearsim.scene.inputs import files_to_copy
from wearsim.scene.models import CompareScene, FieldScene, PairScene, RigScene
from wearsim.scene.prepared import Prepared, prepare, prepare_again
from wearsim.scene.read import CampaignScene, Scene, load_campaign, load_scene
from wearsim.scene.reference import scene_schema
from wearsim.scene.setup import CampaignSetup, build
from wearsim.scene.sweep import SweepScene

__all__ = [
    "CampaignScene",
    "CampaignSetup",
    "CompareScene",
    "FieldScene",
    "PairScene",
    "Prepared",
    "RigScene",
    "Scene",
    "SweepScene",
    "build",
    "files_to_copy",
    "load_campaign",
    "load_scene",
    "prepare",
    "prepare_again",
    "scene_schema",
]
