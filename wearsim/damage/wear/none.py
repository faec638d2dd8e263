"""Wear law without wear."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw


def depth(
    fields: SurfaceFields,
    area: FloatArray,  # noqa: ARG001 -- the signature of every wear law
    coefficients: CoefficientSet,  # noqa: ARG001
    *,
    form: Form = "local",  # noqa: ARG001
) -> FloatArray:
    """Zero depth (1, m, ny) [m], for studies without profile change; see `WearLaw`."""
    return np.zeros((1, *fields.cell_length.shape))


NONE = WearLaw(
    "none",
    depth,
    ("no_wear",),
    "lewis_dwyer_joyce_2004",
    wears=False,
    needs_fields=False,
)
