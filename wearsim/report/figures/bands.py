"""Figures of bands: `plot_x(bands, ..., ax=None) -> Axes`, of datasets of `wearsim.translation.bands`."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures.campaign import new_place
from wearsim.report.style import COLOURS, capital, label_axes, own_axes, role_of, shown
from wearsim.translation.bands import PER_KM, QUANTILES

_WIDTH = f"{100 * (QUANTILES[-1] - QUANTILES[0]):.0f} %"


def _draw(ax: Axes, x: np.ndarray, nominal: np.ndarray, band: np.ndarray, colour: str, name: str) -> None:
    """Draw a line and its band."""
    ax.fill_between(
        x, band[0], band[-1], color=colour, alpha=0.2, lw=0, label=f"{name}, {_WIDTH} of the draws"
    )
    ax.plot(x, nominal, color=colour, label=f"{name}, nominal")


def plot_band(bands: xr.Dataset, role: str, name: str = "max_wear_depth", ax: Axes | None = None) -> Axes:
    """Draw a measure of both wheels of one campaign ("rig", "field") over its distance, with its band."""
    ax = own_axes(ax)
    x, variable = shown("distance", bands[f"{role}_way"].values), f"{role}_{name}"
    values = shown(name, bands[variable].values[:, -1])
    _draw(ax, x, values, shown(name, bands[f"{variable}_band"].values[..., -1]), COLOURS[role], role)
    ax.set_xlim(left=0.0, auto=None)
    meaning = capital(str(bands[variable].attrs["long_name"]))
    return label_axes(ax, f"Distance run, {role} [km]", f"{meaning} [mm]", 0.0)


def plot_depth_band(
    bands: xr.Dataset, dataset: xr.Dataset, ax: Axes | None = None, *, wheel: int = 0
) -> Axes:
    """Draw the band of the wear depth along the profile, at the end of the campaign of a dataset."""
    ax, role = own_axes(ax), role_of(dataset)
    low, _, high = shown("wear_depth", bands[f"{role}_wear_depth_band"].values[:, wheel])
    x, name = shown("profile_y", new_place(dataset, wheel)), f"{role}, {_WIDTH} of the draws"
    ax.fill_between(x, low, high, color=COLOURS[role], alpha=0.2, lw=0, label=name)
    return ax


def plot_per_km(bands: xr.Dataset, basis: int = 0, ax: Axes | None = None) -> Axes:
    """Draw what 1 km on the rig stands for over the worn depth (basis 0) or worn area (1) of each."""
    ax = own_axes(ax)
    name = list(PER_KM)[basis]
    if basis:
        reached, text = bands["worn_area_reached"].values[2, :, 0, -1], "Worn area of each [mm²]"
        x = shown("worn_area", reached)
    else:
        x, text = shown("max_wear_depth", bands["worn_depth"].values[1, :, 0]), "Largest depth of each [mm]"
    _draw(ax, x, bands[name].values, bands[f"{name}_band"].values, COLOURS["difference"], "field over rig")
    return label_axes(ax, text, "Field distance per\nrig distance [km/km]", 0.0)


def plot_sensitivity(bands: xr.Dataset, name: str, ax: Axes | None = None) -> Axes:
    """Draw how much each input decides of an answer, with 90 % intervals, the largest on top."""
    ax = own_axes(ax)
    found = bands[f"{name}_sensitivity"]
    value, low, high = found.values.T
    order = np.argsort(np.abs(value), kind="stable")
    ax.barh(np.arange(order.size), value[order], color=COLOURS["difference"], height=0.6)
    ax.hlines(np.arange(order.size), low[order], high[order], color="black", lw=1.0)
    ax.set_yticks([])
    for row, k in enumerate(order):
        place = (max(float(high[k]), float(value[k]), 0.0), row)
        name = capital(str(bands["input_name"].values[k]))
        ax.annotate(name, place, xytext=(4, 0), textcoords="offset points", va="center")
    ax.set_xlim(right=max(1.5 * float(high.max()), 0.1))
    return label_axes(ax, capital(str(found.attrs["kind"])), "")
