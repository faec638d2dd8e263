"""Normal contact models by name: from gap and load to patch, pressure and approach.

The contract of a model stands in `contact.normal.model`.
"""

from wearsim.contact.normal.model import NormalModel, NormalSolution
from wearsim.contact.registry import Registry, discover
from wearsim.errors import say

_REMOVED = {"knothe_le_the": say("removed.knothe_le_the")}

NORMAL_MODELS: Registry[NormalModel] = discover(
    "normal model", __name__, __path__, NormalModel, _REMOVED,
    group="wearsim.normal_models", function="solve", returns=NormalSolution,
)  # fmt: skip

__all__ = ["NORMAL_MODELS", "NormalModel", "NormalSolution"]
