"""Tangential contact models by name: from patch, pressure and creepage to shear, slip and forces."""

from wearsim.contact.tangential import fastsim, half_space
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution

TANGENTIAL_MODELS: dict[str, TangentialModel] = {"fastsim": fastsim.solve, "half_space": half_space.solve}

__all__ = ["TANGENTIAL_MODELS", "TangentialModel", "TangentialSolution"]
