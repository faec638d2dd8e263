"""The figures of a report on comparison laws and on fatigue, where a scene asks for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report import figures, figures_damage
from wearsim.report.pages import Plate, environment_note, worn_range
from wearsim.report.style import grid, legend, role_of, style


def plates(datasets: list[xr.Dataset]) -> list[Plate]:
    """Draw the figures of damage for one campaign, or for rig and field.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field.

    Returns
    -------
    list of Plate
        In the order of the report.
    """
    compared = [data for data in datasets if "comparison_name" in data]
    tired = [data for data in datasets if "fatigue_name" in data]
    found = [_wear_laws(compared)] if compared else []
    if tired:
        found += [_shakedown(tired), _damage(tired), _cycles(tired)]
        weighed = [(data, k) for data in tired for k in laws_with_balance(data)]
        found += [_balance(weighed)] if weighed else []
    return found


def laws_with_balance(dataset: xr.Dataset) -> list[int]:
    """Return the fatigue laws whose cracks have a stated depth: wear and cracks can be weighed there."""
    return [int(k) for k in np.flatnonzero(np.isfinite(dataset["fatigue_crack_depth"].values))]


def _by_wheel(
    rows: Sequence[tuple[xr.Dataset, Callable[..., Axes], str]],
    *,
    sharey: bool | Literal["row"],
    columns: int = 4,
) -> Figure:
    """Draw both wheels side by side in each row: of a dataset, by a function, with more in the title."""
    with style():
        figure, axes = grid(len(rows), 2, height=1.8, gap=0.3, sharey=sharey)
        for row, (data, draw, more) in enumerate(rows):
            for wheel, side in enumerate(figures.WHEELS):
                ax = draw(data, axes[row, wheel], wheel=wheel)
                ax.set_xlim(worn_range([data], wheel))
                ax.set_title(f"{role_of(data).capitalize()}, {side} wheel{more}")
                if wheel:
                    ax.set_ylabel("")
        legend(figure, columns=columns)
    return figure


def _wear_laws(datasets: list[xr.Dataset]) -> Plate:
    rows = [(data, figures_damage.plot_wear_laws, "") for data in datasets]
    figure = _by_wheel(rows, sharey="row", columns=6)
    text = (
        "Wear depth at the end of each campaign by the active law and by the comparison laws, on the same "
        "contacts: the profile wears by the active law alone."
    )
    return Plate("wear_laws", "wear", figure, f"{text} {environment_note(datasets)}")


def _shakedown(datasets: list[xr.Dataset]) -> Plate:
    with style():
        figure, axes = grid(1, len(datasets), height=3.2, gap=0.6, sharey=True)
        figure.subplots_adjust(top=0.78)
        for column, data in enumerate(datasets):
            ax = figures_damage.plot_shakedown(data, axes[0, column])
            ax.set_title(role_of(data).capitalize())
            if column:
                ax.set_ylabel("")
        legend(figure, columns=3)
    shear = "; ".join(f"{role_of(data)}: {figures_damage.shear_yield_told(data)}" for data in datasets)
    text = (
        "Shakedown map of point contact with every contact patch of the campaign: hollow marks the new "
        "wheel, full ones the end; monitoring points included. Above the limits the material ratchets. "
        f"Yield stress in cyclic shear, {shear}. The limits are recalled from the source; between "
        "pure rolling and flow at the surface they are a straight join of our own."
    )
    return Plate("shakedown", "fatigue", figure, text)


def _damage(datasets: list[xr.Dataset]) -> Plate:
    figure = _by_wheel([(data, figures_damage.plot_fatigue_damage, "") for data in datasets], sharey=True)
    text = (
        "Fatigue damage along the profile at the end of each campaign, each law over its largest value on "
        "both wheels: laws count different things, the place compares."
    )
    return Plate("fatigue_damage", "fatigue", figure, text)


def _cycles(datasets: list[xr.Dataset]) -> Plate:
    with style():
        figure, axes = grid(1, len(datasets), height=2.4, gap=0.3, sharey=True)
        for column, data in enumerate(datasets):
            ax = figures_damage.plot_passage_damage(data, axes[0, column])
            ax.set_title(role_of(data).capitalize())
            if column:
                ax.set_ylabel("")
        legend(figure)
    text = (
        "Agreement of the fatigue laws: damage of each load cycle (passage of a contact patch, both wheels, "
        "worn profiles) over the largest of its law. Where marks of all laws coincide, they agree."
    )
    return Plate("fatigue_cycles", "fatigue", figure, text)


def _balance(weighed: list[tuple[xr.Dataset, int]]) -> Plate:
    rows = [
        (data, partial(figures_damage.plot_balance, law=law), f", {data['fatigue_name'].values[law]}")
        for data, law in weighed
    ]
    figure = _by_wheel(rows, sharey="row")
    text = (
        "Wear against fatigue at the rates of the full collective in the last state: the wear rate, and the "
        "one at which cracks just do not grow. Where wear is above, it removes cracks as fast as they grow. "
        "The balance is in proportion to two assumptions, the depth of a crack and the width of a place."
    )
    return Plate("balance", "fatigue", figure, text)
