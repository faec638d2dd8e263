"""Normal contact models by name: from gap and load to patch, pressure and approach.

The contract of a model stands in `contact.normal.model`.
"""

from wearsim.contact.normal.model import NormalModel, NormalSolution
from wearsim.contact.registry import Registry, discover

NORMAL_MODELS: Registry[NormalModel] = discover("normal model", __name__, __path__, NormalModel)

__all__ = ["NORMAL_MODELS", "NormalModel", "NormalSolution"]
