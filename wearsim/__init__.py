"""Wear and rolling contact fatigue of railway wheels, on a roller rig and in the field.

The public interface; each name is imported from its module on first use. Scripts may
also use documented public functions of the subpackages.

Examples
--------
Registries hold models, laws, coefficient sets and quantities by name; a model can be
solved with parameters and material of one's own:

>>> import wearsim
>>> sorted(wearsim.NORMAL_MODELS)
['coupled_strips', 'half_space', 'hertz', 'kik_piotrowski']
>>> sorted(wearsim.TANGENTIAL_MODELS)
['coupled_strips', 'fastsim', 'half_space']
>>> wearsim.NORMAL_MODELS["hertz"].can_update_profile
False
>>> wearsim.ContactModels(normal="half_space", strips=50, cells=50, youngs_modulus=207e9).tangential
'coupled_strips'
>>> wearsim.ContactModels.of("fast").tangential
'fastsim'
>>> wearsim.WEAR_LAWS["usfd"].coefficients, wearsim.FATIGUE_LAWS["wlrm"].coefficients
('lewis_dwyer_joyce_2004', 'burstow_2004')
>>> wearsim.COEFFICIENT_SETS["jendel_2002"]["hardness"]
3.0
>>> wearsim.QUANTITIES["max_pressure"].label
'largest contact pressure p₀ [MPa]'

Wrong input raises `WearsimError`, one fault a line:

>>> try:
...     wearsim.standard_profile("S1002/h99")
... except wearsim.WearsimError as error:
...     print("h99" in str(error))
True

Profiles are points in metres, of one's own, too; rails and rollers take them as placed
in the track:

>>> wheel = wearsim.standard_profile("S1002")
>>> mine = wearsim.Profile("mine", "wheel", wheel.y, wheel.z)
>>> wheelset = wearsim.Wheelset(mine, wheel, radius=0.46, half_span=0.75)
>>> wearsim.Counterface(wearsim.standard_profile("60E1"), curvature=0.5).curvature
0.5
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearsim.campaign.rate import wear_rate
    from wearsim.campaign.run import resume
    from wearsim.campaign.run import run_scene as run
    from wearsim.contact.dataset import rails, rollers, solve_contact, wheelset
    from wearsim.contact.normal import NORMAL_MODELS, NormalModel, NormalSolution
    from wearsim.contact.problem import (
        ContactConditions,
        ContactModels,
        Counterface,
        Wheelset,
    )
    from wearsim.contact.tangential import (
        TANGENTIAL_MODELS,
        TangentialModel,
        TangentialSolution,
    )
    from wearsim.damage.coefficients import (
        COEFFICIENT_SETS,
        Coefficient,
        CoefficientSet,
    )
    from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueDamage, FatigueLaw
    from wearsim.damage.wear import WEAR_LAWS
    from wearsim.damage.wear.law import WearLaw
    from wearsim.errors import WearsimError, WearsimWarning
    from wearsim.plugins import register
    from wearsim.profile.files import write_profile as export_profile
    from wearsim.profile.measures import Measures, measure
    from wearsim.profile.shape import Profile
    from wearsim.profile.sources import read_profile, standard_profile
    from wearsim.profile.worn import WearBetween, wear_between
    from wearsim.quantities import QUANTITIES
    from wearsim.report.html import write_report
    from wearsim.report.inspect import inspect
    from wearsim.report.plot import plot
    from wearsim.report.sources import citations
    from wearsim.results.file import open_results
    from wearsim.results.rail_wear import rail_wear
    from wearsim.results.service_life import reprofilings
    from wearsim.results.zones import wear_by_zone
    from wearsim.scene.read import load_scene
    from wearsim.studies.calibration import calibrate
    from wearsim.studies.check import check
    from wearsim.studies.compare import compare
    from wearsim.studies.many import run_many, sweep
    from wearsim.studies.match import match_contact
    from wearsim.studies.programme import programme
    from wearsim.studies.zone_errors import zone_errors
    from wearsim.translation.at_distance import at_distance
    from wearsim.translation.side_by_side import side_by_side
    from wearsim.translation.translate import translate
    from wearsim.translation.worn_wheel import worn_profile

__version__ = "0.3.0.dev0"

_MODULES = {
    "campaign.rate": ("wear_rate",),
    "campaign.run": ("resume", "run_scene"),
    "contact.dataset": ("rails", "rollers", "solve_contact", "wheelset"),
    "contact.normal": ("NORMAL_MODELS", "NormalModel", "NormalSolution"),
    "contact.problem": (
        "ContactConditions",
        "ContactModels",
        "Counterface",
        "Wheelset",
    ),
    "contact.tangential": (
        "TANGENTIAL_MODELS",
        "TangentialModel",
        "TangentialSolution",
    ),
    "damage.coefficients": ("COEFFICIENT_SETS", "Coefficient", "CoefficientSet"),
    "damage.fatigue": ("FATIGUE_LAWS", "FatigueDamage", "FatigueLaw"),
    "damage.wear": ("WEAR_LAWS",),
    "damage.wear.law": ("WearLaw",),
    "errors": ("WearsimError", "WearsimWarning"),
    "plugins": ("register",),
    "profile.files": ("write_profile",),
    "profile.measures": ("Measures", "measure"),
    "profile.shape": ("Profile",),
    "profile.sources": ("read_profile", "standard_profile"),
    "profile.worn": ("WearBetween", "wear_between"),
    "quantities": ("QUANTITIES",),
    "report.html": ("write_report",),
    "report.inspect": ("inspect",),
    "report.plot": ("plot",),
    "report.sources": ("citations",),
    "results.file": ("open_results",),
    "results.rail_wear": ("rail_wear",),
    "results.service_life": ("reprofilings",),
    "results.zones": ("wear_by_zone",),
    "scene.read": ("load_scene",),
    "studies.calibration": ("calibrate",),
    "studies.check": ("check",),
    "studies.compare": ("compare",),
    "studies.many": ("run_many", "sweep"),
    "studies.match": ("match_contact",),
    "studies.programme": ("programme",),
    "studies.zone_errors": ("zone_errors",),
    "translation.at_distance": ("at_distance",),
    "translation.side_by_side": ("side_by_side",),
    "translation.translate": ("translate",),
    "translation.worn_wheel": ("worn_profile",),
}
_PLACES = {name: (module, name) for module, names in _MODULES.items() for name in names}
_PLACES["run"] = _PLACES.pop("run_scene")
_PLACES["export_profile"] = _PLACES.pop("write_profile")

__all__ = [
    "COEFFICIENT_SETS",
    "FATIGUE_LAWS",
    "NORMAL_MODELS",
    "QUANTITIES",
    "TANGENTIAL_MODELS",
    "WEAR_LAWS",
    "Coefficient",
    "CoefficientSet",
    "ContactConditions",
    "ContactModels",
    "Counterface",
    "FatigueDamage",
    "FatigueLaw",
    "Measures",
    "NormalModel",
    "NormalSolution",
    "Profile",
    "TangentialModel",
    "TangentialSolution",
    "WearBetween",
    "WearLaw",
    "WearsimError",
    "WearsimWarning",
    "Wheelset",
    "__version__",
    "at_distance",
    "calibrate",
    "check",
    "citations",
    "compare",
    "export_profile",
    "inspect",
    "load_scene",
    "match_contact",
    "measure",
    "open_results",
    "plot",
    "programme",
    "rail_wear",
    "rails",
    "read_profile",
    "register",
    "reprofilings",
    "resume",
    "rollers",
    "run",
    "run_many",
    "side_by_side",
    "solve_contact",
    "standard_profile",
    "sweep",
    "translate",
    "wear_between",
    "wear_by_zone",
    "wear_rate",
    "wheelset",
    "worn_profile",
    "write_report",
    "zone_errors",
]


def __getattr__(name: str) -> Any:
    """Import a public name on first use.

    So that `import wearsim` loads neither numpy nor xarray.
    """
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _PLACES[name]
    value = globals()[name] = getattr(
        importlib.import_module(f"{__name__}.{module}"), attribute
    )
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
