"""What every wear law takes and gives."""

from __future__ import annotations

from typing import Literal, Protocol

from wearsim.contact.patch import FloatArray, SurfaceFields
from wearsim.damage.coefficients import CoefficientSet

Form = Literal["local", "patch_mean"]
FORMS: tuple[Form, ...] = ("local", "patch_mean")


class WearLaw(Protocol):
    """Depth worn by one passage of each patch, split by wear regime."""

    def __call__(
        self,
        fields: SurfaceFields,
        area: FloatArray,
        coefficients: CoefficientSet,
        *,
        form: Form = "local",
        density: float = 7850.0,
    ) -> FloatArray:
        """Return the depth along the normal (n_regimes, m, ny), never negative [m].

        Parameters
        ----------
        fields : SurfaceFields
            On the cells of `m` patches.
        area : (m,) array
            Of the patches [m2].
        coefficients : CoefficientSet
            Numbers of the law.
        form : {"local", "patch_mean"}
            Whether the wear index is taken cell by cell or as its mean over the patch.
        density : float
            Of the worn body [kg/m3].
        """
        ...
