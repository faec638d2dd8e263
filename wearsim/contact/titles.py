"""Names of contact models as texts write them."""

from __future__ import annotations

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.normal.model import NormalModel
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.contact.tangential.model import TangentialModel


def normal_title(name: str) -> str:
    """Name of a normal model in a text; that of an unknown model as it is."""
    return _title(NORMAL_MODELS.get(name), name)


def tangential_title(name: str) -> str:
    """Name of a tangential model in a text; that of an unknown model as it is."""
    return _title(TANGENTIAL_MODELS.get(name), name)


def _title(model: NormalModel | TangentialModel | None, name: str) -> str:
    """Title of a model, or its name in words, or the name of an unknown one."""
    if model is None:
        return name
    return model.title or name.replace("_", " ")
