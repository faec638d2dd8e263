"""Noise of measured profiles in solutions of `wearsim contact`."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.contact.problem import ContactModels
from wearsim.errors import ContactError
from wearsim.profile.files import is_file
from wearsim.profile.point_noise import NOTABLE, PointNoise, point_noise
from wearsim.studies.contact_points import (
    Request,
    Result,
    profile_of,
    request_of,
    solve_batch,
)

_SUSPECT = (
    0.02  # RMS change of pressure by noise from which the contact is solved again
)
_AROUND = 3e-3  # of a patch on either side, so that there are points enough [m]


def noise_note(request: Request, result: Result) -> str:
    """Note on noise that changes the largest pressure of a point by more than 5 %.

    The point is solved again with smoothed profiles where its noise lets expect that.
    """
    modulus = ContactModels(
        youngs_modulus=request.youngs_modulus, poisson_ratio=request.poisson_ratio
    ).effective_modulus
    worst: tuple[float, float, str, PointNoise] | None = None
    for patch in result["patches"]:
        for column, place in _measured(request, patch):
            profile = profile_of(*request.source(column))
            near = np.abs(profile.y - place) < 0.5 * patch["width"] + _AROUND
            noise, pressure = point_noise(profile, near), patch["max_pressure"]
            if noise is None:
                continue
            share = noise.share(modulus, pressure)
            if share > _SUSPECT and (worst is None or share > worst[0]):
                cure = noise.curing_wavelength(modulus, pressure)
                worst = share, cure, str(getattr(request, column)), noise
    if worst is None or worst[1] <= (request.smooth or 0.0):
        return ""
    _, cure, name, noise = worst
    texts = {**request.texts, "smooth_mm": f"{1e3 * cure:g}"}
    try:
        _, (smooth,) = solve_batch([request_of(texts)[0]])
    except ContactError:
        return ""
    change = _pressure(result) / _pressure(smooth) - 1.0
    if abs(change) <= NOTABLE:
        return ""
    return (
        f"{name}: {noise.words} changes the largest pressure by "
        f"{100.0 * change:+.2g} %; --smooth-mm {1e3 * cure:g} takes most of it out"
    )


def _measured(request: Request, patch: dict[str, Any]) -> list[tuple[str, float]]:
    """Columns of the measured profiles of a patch, with its place on them [m]."""
    left = patch["side"] == "left" and request.left_wheel is not None
    bodies = [("left_wheel" if left else "wheel", patch["wheel_y"])]
    bodies.append(("rail", patch["rail_y"]))
    return [one for one in bodies if is_file(str(getattr(request, one[0])))]


def _pressure(result: Result) -> float:
    """Largest pressure of a solved point [Pa]."""
    return max(float(patch["max_pressure"]) for patch in result["patches"])
