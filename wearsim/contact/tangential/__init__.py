"""Tangential contact models by name: from patch, pressure and creepage to shear, slip and forces."""

from wearsim.contact.tangential import fastsim, half_space
from wearsim.contact.tangential.border import guarded
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution

TANGENTIAL_MODELS: dict[str, TangentialModel] = {
    "fastsim": guarded(
        "fastsim",
        fastsim.solve,
        2,  # one cell has no pressure between its ends
        fastsim.MOST_STRIPS,
    ),
    "half_space": guarded("half_space", half_space.solve, 8),  # with 5 the power is 17 % off
}

__all__ = ["TANGENTIAL_MODELS", "TangentialModel", "TangentialSolution"]
