"""Tangential contact models by name: shear, slip and forces from pressure and creepage.

The contract of a model stands in `contact.tangential.model`. Candidates that were tried
and left out: `reports/contact_models.md`.
"""

from wearsim.contact.registry import Registry, discover
from wearsim.contact.tangential.model import (
    StripMotion,
    TangentialModel,
    TangentialSolution,
    Wanted,
)

TANGENTIAL_MODELS: Registry[TangentialModel] = discover(
    "tangential model",
    __name__,
    __path__,
    TangentialModel,
    group="wearsim.tangential_models",
    function="solve",
    returns=TangentialSolution,
)

__all__ = [
    "TANGENTIAL_MODELS",
    "StripMotion",
    "TangentialModel",
    "TangentialSolution",
    "Wanted",
]
