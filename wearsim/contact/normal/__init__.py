"""Normal contact models by name: from gap and load to patch, pressure and approach.

The contract of a model stands in `contact.normal.model`.
"""

from wearsim.contact.normal.model import NormalModel, NormalSolution
from wearsim.contact.registry import Registry, discover

_REMOVED = {
    "knothe_le_the": (
        'was removed in 0.3.0: write "coupled_strips", or leave normal out: it is the '
        "default"
    )
}

NORMAL_MODELS: Registry[NormalModel] = discover(
    "normal model",
    __name__,
    __path__,
    NormalModel,
    _REMOVED,
    group="wearsim.normal_models",
    function="solve",
    returns=NormalSolution,
)

__all__ = ["NORMAL_MODELS", "NormalModel", "NormalSolution"]
