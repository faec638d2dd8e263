"""Names of contact models as texts write them."""

from __future__ import annotations

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.tangential import TANGENTIAL_MODELS


def model_title(name: str) -> str:
    """Name of a contact model as it is written in a text; an unknown one as it is."""
    model = NORMAL_MODELS.get(name) or TANGENTIAL_MODELS.get(name)
    return (model.title or name.replace("_", " ")) if model else name
