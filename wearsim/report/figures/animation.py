"""The running wear as a film.

Both wheel profiles wear while the contact patches move over them.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from wearsim.errors import ResultError
from wearsim.profile.shape import arc_length
from wearsim.report.figures.campaign import (
    DRAWN_DEPTH,
    WHEELS,
    exaggeration,
    worn_shape,
)
from wearsim.report.style import (
    COLOURS,
    colour_of,
    distance_text,
    grid,
    label,
    label_axes,
    plain,
    role_title,
    shown,
    style,
    with_unit,
)
from wearsim.translation.factors import rows_at
from wearsim.whole_files import replacing

FRAMES = 60
_FRAMES_PER_SECOND = 10
_DPI = 80
_PATCH_POINTS = 15


def patch_lines(
    dataset: xr.Dataset, wheel: int, distance: float, drawn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lines (m, k, 2) on `drawn` (2, n) [m] of the patches that wear.

    As last stored, and pressures [Pa].
    """
    row = int(rows_at(dataset["distance"].values, np.array([distance]))[0])
    on_wheel = (dataset["side"].values[row] == wheel) & (
        dataset["weight"].values[:, None] > 0.0
    )
    centre, width, pressure = (
        dataset[name].values[row][on_wheel]
        for name in ("wheel_y", "width", "max_pressure")
    )
    y, z = (dataset[f"profile_{c}"].values[row, wheel] for c in "yz")
    arc, tip = arc_length(y, z), int(np.argmax(z))
    rising = np.maximum.accumulate(y[tip:])  # a worn flank may overhang by rounding
    at = np.interp(centre, rising, arc[tip:])[:, None] + np.outer(
        width, np.linspace(-0.5, 0.5, _PATCH_POINTS)
    )
    lines = np.stack([np.interp(at, arc, line) for line in drawn], axis=2)
    return lines, pressure


def animate_wear(dataset: xr.Dataset, path: Path, frames: int = FRAMES) -> Path:
    """Write a GIF of both wheels at even distances.

    Raise ResultError where nothing has run, or it fails.
    """
    run = dataset["distance"].values
    if not run[-1] > 0.0:
        raise ResultError(
            f"{path}: the campaign has no wear step yet, there is nothing to animate"
        )
    factor = exaggeration([dataset])
    weighted = dataset["weight"].values > 0.0
    pressures = shown("max_pressure", dataset["max_pressure"].values[:, weighted])
    scale = Normalize(0.0, float(np.nanmax(pressures)))
    # opened first: a target that cannot be written costs no drawing
    with (
        replacing(path) as part,
        part.open("wb") as target,
        style(),
        TemporaryDirectory() as folder,
    ):
        figure, axes = grid(
            2, 1, height=2.1, between=0.5, edges=(0.95, 1.05, 0.5, 0.4), sharex=True
        )
        films = [
            _Film(ax, dataset, wheel, factor, scale)
            for wheel, ax in enumerate(axes[:, 0])
        ]
        axes[0, 0].set_xlabel("")
        bottom, top = axes[1, 0].get_position().y0, axes[0, 0].get_position().y1
        room = figure.add_axes((0.905, bottom, 0.015, top - bottom))
        bar = figure.colorbar(films[0].patches, cax=room)
        bar.set_label(with_unit("largest pressure of each patch", "max_pressure"))
        writer = PillowWriter(fps=_FRAMES_PER_SECOND)
        made = Path(folder) / "film.gif"
        with writer.saving(figure, str(made), _DPI):
            for distance in np.linspace(0.0, run[-1], frames):
                for film in films:
                    film.show(float(distance))
                writer.grab_frame()
        target.write(made.read_bytes())
    return path


class _Film:
    """Drawing of a wheel: its fixed and its moving parts."""

    def __init__(
        self, ax: Axes, dataset: xr.Dataset, wheel: int, factor: float, scale: Normalize
    ) -> None:
        self.ax, self.dataset, self.wheel, self.factor = ax, dataset, wheel, factor
        start = shown("profile_y", worn_shape(dataset, wheel, 0.0, factor))
        self.patches = LineCollection(
            [], norm=scale, cmap="viridis_r", lw=7.0, alpha=0.6, capstyle="butt"
        )
        ax.add_collection(self.patches)
        ax.plot(*start, "--", color=COLOURS["new"], lw=1.2, label="new wheel")
        name = (
            "worn" if factor == 1.0 else f"worn, drawn {plain(factor, 1)} times as deep"
        )
        (self.line,) = ax.plot([], [], color=colour_of(dataset), label=name)
        ax.set(xlim=(start[0].min() - 2.0, start[0].max() + 2.0))
        # outward is up, as gauges draw wheels
        ax.set_ylim(start[1].min() - 1e3 * DRAWN_DEPTH - 1.0, start[1].max() + 2.0)
        ax.legend(loc="upper right")
        deep = "" if factor == 1.0 else f", wear ×{plain(factor, 1)}"
        label_axes(ax, label(dataset, "profile_y"), f"Height, outward is up{deep} [mm]")

    def show(self, distance: float) -> None:
        """Draw a distance [m]."""
        drawn = worn_shape(self.dataset, self.wheel, distance, self.factor)
        self.line.set_data(*shown("profile_y", drawn))
        lines, pressure = patch_lines(self.dataset, self.wheel, distance, drawn)
        self.patches.set_segments(list(shown("profile_y", lines)))
        self.patches.set_array(shown("max_pressure", pressure))
        km = distance_text(distance)
        self.ax.set_title(
            f"{role_title(self.dataset)}, {WHEELS[self.wheel]} wheel after {km}"
        )
