"""The law of a wheel that does not wear."""

from __future__ import annotations

import numpy as np

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients import CoefficientSet
from wearsim.damage.wear.law import Form

REGIMES = ("no_wear",)


def depth(
    fields: SurfaceFields,
    area: FloatArray,  # noqa: ARG001 -- the signature of every wear law
    coefficients: CoefficientSet,  # noqa: ARG001
    *,
    form: Form = "local",  # noqa: ARG001
    density: float = 7850.0,  # noqa: ARG001
) -> FloatArray:
    """Return zero depth, for studies in which the profile keeps its shape.

    Parameters
    ----------
    fields : SurfaceFields
        On the cells of `m` patches.
    area, coefficients, form, density
        As for every `WearLaw`; they do not act.

    Returns
    -------
    (1, m, ny) array
        Zeros [m].
    """
    return np.zeros((1, *fields.cell_length.shape))
