"""Small figures of many profiles: `plot_member(dataset, member, ax) -> Axes`, wheels flange down.

The datasets are those of `wearsim.profile.inspection.datasets.fleet_dataset`.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures_profile import EXCEEDED
from wearsim.report.style import COLOURS, own_axes, shown

_BODY = "#1a1a1a"
NOT_JUDGED = "#b07a1e"
"""Colour of profiles that no limits were applied to, or that are open in some."""

_SHORT = {"flange_height": "Sh", "flange_thickness": "Sd", "flange_gradient": "qR", "hollowing": "hollow"}
_REACH = 40.0  # how far beyond the median a profile widens the axes [mm]
_LONGEST = 26  # characters of a title


def plot_member(dataset: xr.Dataset, member: int, ax: Axes | None = None) -> Axes:
    """Draw one profile over the reference, with its measures; those beyond a limit stand out.

    Parameters
    ----------
    dataset : Dataset
        Fleet state.
    member : int
        Which profile.
    ax : Axes, optional
        Where to draw.
    """
    ax = own_axes(ax)
    kind = str(dataset["kind"].values[member])
    if "reference_y" in dataset and dataset.attrs["reference_kind"] == kind:
        ax.plot(
            shown("profile_y", dataset["reference_y"].values),
            shown("profile_z", dataset["reference_z"].values),
            color=COLOURS["new"], lw=0.9, label=dataset.attrs["reference_label"],
        )  # fmt: skip
    exceeded = str(dataset["exceeded"].values[member]).split()
    open_measures = str(dataset["not_judged"].values[member]).split()
    judged = bool(dataset["judged"].values[member]) and not open_measures
    colour = EXCEEDED if exceeded else _BODY if judged else NOT_JUDGED
    label = "beyond a limit" if exceeded else "within the limits" if judged else "not judged, or not in all"
    y, z = (shown(f"profile_{axis}", dataset[f"profile_{axis}"].values[member]) for axis in "yz")
    ax.plot(y, z, color=colour, lw=1.1, label=label)
    name = str(dataset["wheel_name"].values[member])
    ax.set_title(
        name if len(name) <= _LONGEST else f"…{name[1 - _LONGEST :]}",  # the end tells the side
        fontsize=7.5, color=colour, pad=2.5, fontweight="bold" if exceeded else "normal",
    )  # fmt: skip
    texts = []
    for measure, short in _SHORT.items():
        if measure in dataset and dataset[f"known_{measure}"].values[member]:
            value = float(shown(measure, dataset[measure].values[member]))
            mark = " !" if measure in exceeded else " ?" if measure in open_measures else ""
            texts.append((f"{short} {value + 0.0:.2f}{mark}", measure in exceeded))
    for k, (text, beyond) in enumerate(texts):
        ax.text(
            0.66 if k % 2 == 0 else 0.98, 0.22 - 0.17 * (k // 2), text,
            transform=ax.transAxes, ha="right", va="bottom", fontsize=6.5,
            color=EXCEEDED if beyond else "#444444", fontweight="bold" if beyond else "normal",
        )  # fmt: skip
    ax.tick_params(labelsize=6.5, length=2.0, pad=1.5)
    ax.grid(visible=True, lw=0.4)
    return ax


def limits_of(dataset: xr.Dataset) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of lateral position and height: medians of the profiles' ends, and the reference [mm].

    Profiles that reach at most `_REACH` further widen them; one that was misread does not.
    """
    spans = []
    for axis in "yz":
        values = shown(f"profile_{axis}", dataset[f"profile_{axis}"].values)
        low, high = values.min(axis=1), values.max(axis=1)
        ends = [
            float(low[low >= np.median(low) - _REACH].min()),
            float(high[high <= np.median(high) + _REACH].max()),
        ]
        if f"reference_{axis}" in dataset:
            reference = shown(f"profile_{axis}", dataset[f"reference_{axis}"].values)
            ends += [float(reference.min()), float(reference.max())]
        spans.append((min(ends) - 3.0, max(ends) + 3.0))
    return spans[0], spans[1]
