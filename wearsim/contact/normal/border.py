"""What every normal model must be given and must give: checked where models are called, alike for all."""

from __future__ import annotations

from dataclasses import fields
from functools import wraps

import numpy as np

from wearsim.contact.geometry import Gap
from wearsim.contact.normal.model import NormalModel, NormalSolution
from wearsim.contact.patch import FloatArray
from wearsim.errors import ContactError, NumericalError

FEWEST = 5
"""Strips across a patch and cells along each, at least: with 5 the power is 5 % low, with 2 40 %."""
STRONGEST = 0.1
"""Pressure over E*, at most: strains of a tenth, four times what hardened steel bears before it yields."""
LONGEST = 0.3
"""Half length of a patch over the smallest rolling radius, at most: there the parabola that a circle is taken
for is 2 % off, surfaces are inclined by 17 degrees and strains reach 10 %: no half-space any more."""


def guarded(model: NormalModel) -> NormalModel:
    """Put the checks around a model.

    Parameters
    ----------
    model : NormalModel
        Any.

    Returns
    -------
    NormalModel
        Raises ContactError for loads that are not above 0, fewer than five strips or cells, and patches or
        pressures beyond an elastic half-space, and NumericalError for an answer that is not finite; else
        the same.
    """

    @wraps(model)
    def solve(
        gap: Gap,
        load: FloatArray,
        *,
        vertical: bool,
        effective_modulus: float,
        strips: int,
        parameters: dict[str, float],
    ) -> NormalSolution:
        _check_input(load, strips, parameters)
        solution = model(
            gap,
            load,
            vertical=vertical,
            effective_modulus=effective_modulus,
            strips=strips,
            parameters=parameters,
        )
        _check_answer(gap, solution, effective_modulus)
        return solution

    return solve


def _check_input(load: FloatArray, strips: int, parameters: dict[str, float]) -> None:
    for name, count in (("strips", strips), ("cells", parameters.get("cells", FEWEST))):
        if count < FEWEST:
            raise ContactError(f"{name} = {count:g} must be at least {FEWEST}; take more")
    wrong = np.flatnonzero(~((load > 0.0) & (load < np.inf)))
    if wrong.size > 0:
        row = int(wrong[0])
        raise ContactError(f"wheel load = {load[row]:g} N must be above 0 N and finite", row=row)


def _check_answer(gap: Gap, solution: NormalSolution, effective_modulus: float) -> None:
    patch = solution.patch
    row = patch.row
    if row.size == 0:
        return
    fine = np.ones(row.size, dtype=bool)
    for owner in (solution, patch):
        for field in fields(owner):
            values = getattr(owner, field.name)
            if isinstance(values, np.ndarray):
                fine &= np.isfinite(values.reshape(row.size, -1)).all(axis=1)
    if not fine.all():
        raise NumericalError(
            "the normal contact has no finite answer; check profiles, radii and load, or take another "
            "normal model",
            row=int(row[np.argmin(fine)]),
        )
    half = 0.5 * (patch.x_lead - patch.x_trail).max(axis=1)
    radius = _smallest_radius(gap, solution)
    long = np.flatnonzero(half > LONGEST * radius)
    if long.size > 0:
        m = int(long[0])
        raise ContactError(
            f"the contact patch is {2e3 * half[m]:.3g} mm long on a rolling radius of {1e3 * radius[m]:.3g} "
            f"mm, more than {2.0 * LONGEST:g} of it: no half-space; lower the load, or take a larger radius "
            "or a stiffer material",
            row=int(row[m]),
        )
    strong = np.flatnonzero(solution.max_pressure > STRONGEST * effective_modulus)
    if strong.size > 0:
        m = int(strong[0])
        raise ContactError(
            f"the contact pressure would be {1e-6 * solution.max_pressure[m]:.0f} MPa, more than "
            f"{STRONGEST:g} of E / (2 (1 - nu^2)): not elastic; lower the load, smooth a measured profile or "
            "take a larger radius",
            row=int(row[m]),
        )


def _smallest_radius(gap: Gap, solution: NormalSolution) -> FloatArray:
    """Smaller one of the rolling radii of wheel and counterface at each patch [m]."""
    grid = gap.contour
    at = np.clip(np.searchsorted(grid.y, solution.centre_y), 0, grid.y.size - 1)
    wheel: FloatArray = gap.wheel_radius[solution.patch.row, at]
    if gap.curvature <= 0.0:
        return wheel
    return np.minimum(wheel, 1.0 / gap.curvature - grid.z[at])
