"""What every tangential model must be given and must give: checked where models are called."""

from __future__ import annotations

from functools import wraps

import numpy as np

from wearsim.contact.patch import FloatArray, Patch
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution
from wearsim.errors import ContactError, NumericalError


def guarded(
    name: str, model: TangentialModel, fewest: int, most_strips: int | None = None
) -> TangentialModel:
    """Put the checks around a model.

    Parameters
    ----------
    name : str
        Of the model.
    model : TangentialModel
        Any.
    fewest : int
        Strips, and cells along each, that it needs.
    most_strips : int, optional
        That it has room for.

    Returns
    -------
    TangentialModel
        Raises ContactError on other grids, and NumericalError for an answer that is not finite; else the
        same.
    """

    @wraps(model)
    def solve(
        patch: Patch,
        creepage: FloatArray,
        friction: FloatArray,
        *,
        shear_modulus: float,
        poisson_ratio: float,
        cells: int,
        fields: bool,
    ) -> TangentialSolution:
        if min(cells, patch.y.shape[1]) < fewest:
            raise ContactError(
                f"{name} needs at least {fewest} strips and cells along them; take more, or another "
                "tangential model"
            )
        if most_strips is not None and patch.y.shape[1] > most_strips:
            raise ContactError(f"{name} has room for {most_strips} strips at most; take fewer")
        solution = model(
            patch,
            creepage,
            friction,
            shear_modulus=shear_modulus,
            poisson_ratio=poisson_ratio,
            cells=cells,
            fields=fields,
        )
        fine = np.isfinite(solution.force).all(axis=1)
        if not fine.all():
            raise NumericalError(
                f"{name} has no finite creep forces; check creepages and friction",
                row=int(patch.row[np.argmin(fine)]),
            )
        return solution

    return solve
