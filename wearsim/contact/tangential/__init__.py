"""Tangential contact models by name: from patch, pressure and creepage to shear, slip and forces.

The contract of a model stands in `contact.tangential.model`. Candidates that were tried and left out:
`reports/contact_models.md`.
"""

from wearsim.contact.registry import models_in
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution, Wanted

TANGENTIAL_MODELS: dict[str, TangentialModel] = models_in(__name__, __path__)

__all__ = ["TANGENTIAL_MODELS", "TangentialModel", "TangentialSolution", "Wanted"]
