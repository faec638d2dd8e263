"""Noise of measured profiles in solutions of `wearsim contact`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wearsim.contact.problem import ContactModels
from wearsim.profile.files import is_file
from wearsim.profile.point_noise import NOTABLE, PointNoise, point_noise
from wearsim.studies.contact_points import (
    Points,
    Solution,
    operating_points,
    profile_of,
    solve_points,
    sources,
)

# RMS change of pressure by noise from which the contact is solved again [-]
_SUSPECT = 0.02
_AROUND = 3e-3  # of a patch on either side, so that there are points enough [m]
_MOST_ROWS = 20  # of a table that are solved again without noise


class _Noise(NamedTuple):
    """Noise of a profile in a patch.

    Name of the profile, change of the largest pressure that it lets expect (RMS) [-],
    wavelength of the smoothing that takes most of it out [m], and the change that is
    left [-].
    """

    profile: str
    share: float
    cure: float
    left: float
    noise: PointNoise


def noise_notes(points: Points, solution: Solution) -> list[tuple[list[int], str]]:
    """Note on noise that changes the largest pressure of points by more than 5 %.

    Its rows, and the text on the first of them. Points whose noise lets expect that,
    of at most 20 rows of a table, are solved again with smoothed profiles.
    """
    rows = solution.points.index
    rows = rows[:: 1 + len(rows) // _MOST_ROWS]
    noise_of_row = {
        row: noise for row in rows if (noise := _decisive_noise(row, points, solution))
    }
    if not noise_of_row:
        return []
    cures = [f"{1e3 * noise.cure:g}" for noise in noise_of_row.values()]
    texts = points.texts.loc[list(noise_of_row)].assign(smooth_mm=cures)
    smooth = solve_points(operating_points(texts)[0])
    change = _pressures(solution) / _pressures(smooth) - 1.0
    changed = change.index[change.abs() > NOTABLE].tolist()
    if not changed:
        return []
    first = noise_of_row[changed[0]]
    text = (
        f"{first.profile}: {first.noise.words} changes the largest pressure by "
        f"{100.0 * change[changed[0]]:+.2g} % over that with --smooth-mm "
        f"{1e3 * first.cure:g}, which leaves about {100.0 * first.left:.2g} % (rms)"
    )
    return [(changed, text)]


def _decisive_noise(row: int, points: Points, solution: Solution) -> _Noise | None:
    """Noise that may change the contact of a point most, None of smoothed profiles."""
    patches = solution.patches[solution.patches["point"] == row]
    values = points.values.loc[[row]]
    noises = _noises(values, patches)
    worst = max(noises, key=lambda noise: noise.share, default=None)
    smooth = float(values["smooth"].iloc[0])
    return None if worst is None or worst.cure <= smooth else worst


def _noises(values: pd.DataFrame, patches: pd.DataFrame) -> Iterator[_Noise]:
    """Noise of the measured profiles of a point in each patch, where it is suspect."""
    given: Any = values.iloc[0]
    modulus = ContactModels(
        youngs_modulus=given["youngs_modulus"], poisson_ratio=given["poisson_ratio"]
    ).effective_modulus
    for patch in patches.to_dict("records"):
        wheel = "left_wheel" if patch["side"] == "left" else "wheel"
        for column, place in ((wheel, patch["wheel_y"]), ("rail", patch["rail_y"])):
            (source,) = sources(values, column)
            if not is_file(source[0]):
                continue
            profile = profile_of(*source)
            near = np.abs(profile.y - place) < 0.5 * patch["width"] + _AROUND
            noise, pressure = point_noise(profile, near), patch["max_pressure"]
            share = 0.0 if noise is None else noise.share(modulus, pressure)
            if noise is not None and share > _SUSPECT:
                cure = noise.curing_wavelength(modulus, pressure)
                left = noise.left(modulus, pressure, cure)
                yield _Noise(source[0], share, cure, left, noise)


def _pressures(solution: Solution) -> pd.Series:
    """Largest pressure of each solved point [Pa]."""
    return solution.patches.groupby("point")["max_pressure"].max()
