"""Normal contact models by name: from gap and load to patch, pressure and approach.

The contract of a model stands in `contact.normal.model`.
"""

from wearsim.contact.normal.model import NormalModel, NormalSolution
from wearsim.contact.registry import models_in

NORMAL_MODELS: dict[str, NormalModel] = models_in(__name__, __path__)

__all__ = ["NORMAL_MODELS", "NormalModel", "NormalSolution"]
