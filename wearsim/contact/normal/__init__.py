"""Normal contact models by name: from gap and load to patch, pressure and approach."""

from wearsim.contact.normal import kik_piotrowski
from wearsim.contact.normal.model import NormalModel, NormalSolution

NORMAL_MODELS: dict[str, NormalModel] = {"kik_piotrowski": kik_piotrowski.solve}

__all__ = ["NORMAL_MODELS", "NormalModel", "NormalSolution"]
