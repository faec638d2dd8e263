"""Page and text of a designed rig programme."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.errors import WearsimError, brief
from wearsim.report.html import Block, page
from wearsim.report.plates import Plate
from wearsim.report.style import COLOURS, label_axes, panels
from wearsim.report.tables import Table, table
from wearsim.report.texts import caption, lines
from wearsim.texts import text_table, wrapped

_TARGET, _PROGRAMME, _COPY = COLOURS["field"], COLOURS["rig"], COLOURS["new"]


def programme_lines(made: xr.Dataset) -> list[str]:
    """Sentences on a programme, as the page and the command line state them."""
    context: dict[str, Any] = {
        "of": made.attrs,
        "blocks": int(made["blocks"].sum()),
        "most": int(made["blocks"].max()),
        "runs": int((made["blocks"] * made["loops"]).sum()),
        "stages": made.sizes["stage"],
    }
    return lines("programme", **context)


def notes(made: xr.Dataset, name: str) -> list[str]:
    """Lines of an attribute: "limits", "missed" or "warnings"."""
    return [line for line in str(made.attrs[name]).split("\n") if line]


def rig_table(made: Mapping[str, xr.Dataset | WearsimError]) -> pd.DataFrame:
    """Table of programmes for one target on several rigs, or why there is none.

    Errors are shares of the deepest wear, distances in km; a rig without a programme
    has a `fault` alone.
    """
    return pd.DataFrame([_rig_row(name, of) for name, of in made.items()])


def _rig_row(name: str, of: xr.Dataset | WearsimError) -> dict[str, Any]:
    """Row of the table of rigs."""
    columns = (
        *("largest_error", "acceleration", "acceleration_mechanism", "rig_km"),
        *("blocks", "limits", "not_reproduced"),
    )
    if isinstance(of, WearsimError):
        return {"rig": name, **dict.fromkeys(columns, np.nan), "fault": str(of)}
    values = (
        *(of.attrs[column] for column in columns[:3]),
        1e-3 * of.attrs["rig_distance"],
        int(of["blocks"].sum()),
        "; ".join(notes(of, "limits")),
        "; ".join(notes(of, "missed")),
    )
    return {"rig": name, **dict(zip(columns, values, strict=True)), "fault": ""}


def rig_lines(made: Mapping[str, xr.Dataset]) -> list[str]:
    """Lines of the table of several rigs in 100 columns, what limits each below it."""
    head = ["rig", "largest error [%]", "acceleration", "by the mechanism", "km"]
    table = [[*head, "blocks", "limits", "places off"]]
    for row, of in zip(rig_table(made).to_dict("records"), made.values(), strict=True):
        numbers = (
            100.0 * row["largest_error"],
            row["acceleration"],
            row["acceleration_mechanism"],
            row["rig_km"],
            row["blocks"],
            len(notes(of, "limits")),
            len(notes(of, "missed")),
        )
        table.append([brief(row["rig"]), *map(_shown, numbers)])
    text_lines = text_table(table)
    for name, of in made.items():
        for title, attribute in (("limit", "limits"), ("off", "missed")):
            lines = notes(of, attribute)
            text_lines += [wrapped(f"{name}, {title}: {line}") for line in lines]
    return text_lines


def _shown(value: float) -> str:
    """Write a number with three digits, whole from 1000 on; - for an unknown one."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= _WHOLE else f"{value:.3g}"


_WHOLE = 1e3  # numbers that are shown without digits after the point


def render_programme(made: xr.Dataset) -> str:
    """Make the page of a programme, of a dataset of `wearsim.programme`."""
    answer = [
        Block("alerts", notes(made, "warnings")),
        Block("say", programme_lines(made)),
        Plate("programme", plot_pattern(made), caption("figure", "programme")),
    ]
    curves = [
        Plate(
            "programme_curves",
            plot_curves(made),
            caption("figure", "programme_curves", of=made.attrs),
        )
    ]
    missed, limits = notes(made, "missed"), notes(made, "limits")
    sections = [
        ("stages", "Stages", [stages(made)]),
        ("price", "Price of the guard, and of few blocks", curves),
        ("missed", "Not reproduced", [Block("list", missed)] if missed else []),
        ("limits", "Limits that bind", [Block("list", limits)] if limits else []),
    ]
    layers: Any = {
        "": [("answer", "Answer", answer)],
        "For engineers": sections,
        "Appendix": [("blocks", "All blocks", [blocks(made)])],
    }
    return page(f"Rig programme for {made.attrs['target_name']}", layers)


def plot_pattern(made: xr.Dataset) -> Figure:
    """Draw target, programme and copy along the profiles of both wheels."""
    drawn = {
        "target": ("target", _TARGET, "-"),
        "depth": ("programme", _PROGRAMME, "-"),
    }
    for name, line in (("copy", "--"), ("copy_forces", ":")):
        if name in made:
            drawn[name] = (f"{made.attrs[f'{name}_of']} copied", _COPY, line)

    def draw(ax: Axes, _: int, column: int) -> None:
        y = 1e3 * made["profile_y"].values[column]
        for name, (text, colour, line) in drawn.items():
            depth = 1e6 * made[name].values[column]
            ax.plot(y, depth, line, color=colour, label=text)
        ax.set_title(f"{made['wheel'].values[column]} wheel")
        label_axes(ax, "Lateral position [mm]", "Wear depth [µm]", 0.0)

    edges = (0.95, 0.15, 0.5, 0.9)
    return panels(1, 2, draw, height=3.0, sharey=True, edges=edges)


def plot_curves(made: xr.Dataset) -> Figure:
    """Draw the price of the guard, and the error over the number of blocks."""
    guards = made["guard"].values > 0.0
    guard = made["guard"].values[guards]
    error = 100.0 * made["guard_error"].values

    def draw(ax: Axes, _: int, column: int) -> None:
        if column == 0:
            ax.plot(guard, error[guards], "o-", color=_PROGRAMME)
            free = error[~guards]
            if free.size:
                ax.axhline(free[0], ls="--", color=_COPY, label="no guard")
            label_axes(ax, "Guard", "Error kept [% of the deepest]", 0.0)
        elif column == 1:
            run = 1e-3 * made["guard_rig_distance"].values
            ax.plot(guard, run[guards], "o-", color=_PROGRAMME)
            free = run[~guards]
            if free.size:
                ax.axhline(free[0], ls="--", color=_COPY, label="no guard")
            label_axes(ax, "Guard", "Distance of the rig [km]", 0.0)
        else:
            share = 100.0 * made["blocks_error"].values
            ax.plot(made["count"].values, share, "o-", color=_PROGRAMME)
            label_axes(ax, "Blocks of the stage", "Smallest error [%]", 0.0)

    return panels(1, 3, draw, height=2.4, edges=(0.95, 0.15, 0.5, 0.6))


def stages(made: xr.Dataset) -> Table:
    """Depth, distances, errors and blocks of each stage."""
    columns = zip(
        made["stage"].values.tolist(),
        1e6 * made["target_depth"].values,
        1e-3 * made["field_distance"].values,
        1e-3 * made["rig_distance"].values,
        made["blocks"].values.astype(int).tolist(),
        made["loops"].values.astype(int).tolist(),
        1e6 * made["tolerance"].values,
        1e6 * made["kept_error"].values,
        1e6 * made["largest_error"].values,
        strict=True,
    )
    return table("programme_stages", columns, look="numbers", digits=4)


def blocks(made: xr.Dataset) -> Table:
    """Set-points and distance of each block over all loops of its stage."""
    by_force = "lateral_force_begin" in made
    lateral = (
        [1e-3 * made["lateral_force_begin"].values]
        if by_force
        else [1e3 * made["shift_begin"].values, 1e3 * made["shift_end"].values]
    )
    columns = zip(
        made["block_stage"].values.astype(int).tolist(),
        *lateral,
        1e3 * made["yaw"].values,
        1e-3 * made["wheel_load"].values,
        1e-3 * made["distance"].values,
        strict=True,
    )
    rows = [np.asarray(row, dtype=object) for row in columns]
    name = "programme_forces" if by_force else "programme_blocks"
    return table(name, rows, look="numbers", digits=4)
