"""Report on contact locations: figure, table and two-point contacts, as Markdown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from wearsim.report.folder import report_folder
from wearsim.report.style import COLOURS, SERIES_COLOURS, grid, legend, save_svg, style

_PANELS = (
    ("wheel_y", "Lateral position on the wheel [mm]"),
    ("x", "Longitudinal position [mm]"),
    ("contact_angle", "Contact angle [mrad]"),
)
_DASHES = ("-", "--", "-.", ":")


def write_locations(dataset: xr.Dataset, remarks: str, out: Path, stem: str, command: str) -> Path:
    """Write the report on contact locations.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.location.solve_locations`.
    remarks : str
        A paragraph for the report.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file; beside it a figure and a CSV file of all values.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    with report_folder(out):
        save_svg(locations_figure(dataset), out / f"{stem}.svg")
        values_table(dataset).to_csv(
            out / f"{stem}.csv", index=False, float_format="%.6f", lineterminator="\n"
        )
        path = out / f"{stem}.md"
        path.write_text(markdown(dataset, remarks, command, stem), encoding="utf-8")
    return path


def counterface_name(curvature: float) -> str:
    """Name a counterface by its curvature [1/m]."""
    return "rail" if curvature == 0.0 else f"roller {1.0 / curvature:g} m"


def values_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Table of all values, in mm and mrad.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.location.solve_locations`.

    Returns
    -------
    DataFrame
        A row for each counterface and shift.
    """
    rows = []
    for k, curvature in enumerate(dataset["counterface_curvature"].values):
        part = dataset.isel(counterface_curvature=k)
        rows.append(
            pd.DataFrame(
                {
                    "counterface": counterface_name(curvature),
                    "shift_mm": 1e3 * part["shift"].values,
                    "wheel_y_mm": 1e3 * part["wheel_y"].values,
                    "counterface_y_mm": 1e3 * part["counterface_y"].values,
                    "x_mm": 1e3 * part["x"].values,
                    "contact_angle_mrad": 1e3 * part["contact_angle"].values,
                    "wheel_radius_mm": 1e3 * part["wheel_radius"].values,
                    "roll_mrad": 1e3 * part["roll"].values,
                }
            )
        )
    return pd.concat(rows, ignore_index=True)


def locations_figure(dataset: xr.Dataset) -> Figure:
    """Lateral and longitudinal contact position and contact angle over the shift.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.location.solve_locations`.

    Returns
    -------
    Figure
        Lines break at two-point contacts, which are marked.
    """
    shift = 1e3 * dataset["shift"].values
    with style():
        figure, axes = grid(1, len(_PANELS), height=2.9, width=11.0, sharex=True)
        for ax, (name, label) in zip(axes[0], _PANELS, strict=True):
            for k, curvature in enumerate(dataset["counterface_curvature"].values):
                colour = COLOURS["field"] if k == 0 else COLOURS["rig"] if k == 1 else SERIES_COLOURS[k]
                jumps = np.flatnonzero(dataset["jump_curvature"].values == curvature)
                where = 1e3 * dataset["jump_shift"].values[jumps]
                sides = [1e3 * dataset[f"jump_{side}_{name}"].values[jumps] for side in ("before", "after")]
                line, value = shift, 1e3 * dataset[name].values[k]
                for at, before, after in zip(where, *sides, strict=True):
                    place = int(np.searchsorted(line, at))
                    line = np.insert(line, place, [at, at, at])
                    value = np.insert(value, place, [before, np.nan, after])
                ax.plot(
                    line, value, color=colour, linestyle=_DASHES[k % len(_DASHES)],
                    label=counterface_name(curvature),
                )  # fmt: skip
                for side in sides:
                    ax.plot(where, side, "o", color=colour, markerfacecolor="white", zorder=3)
            ax.set_xlabel("Shift, to the right [mm]")
            ax.set_ylabel(label)
        legend(figure)
    return figure


def markdown(dataset: xr.Dataset, remarks: str, command: str, stem: str) -> str:
    """Write the report.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.location.solve_locations`.
    remarks : str
        A paragraph for the report.
    command : str
        Command line that writes the report.
    stem : str
        Of the figure and the table.

    Returns
    -------
    str
        Markdown.
    """
    curvatures, shift = dataset["counterface_curvature"].values, 1e3 * dataset["shift"].values
    roll = "The wheelset rests on both wheels." if dataset.attrs["free_roll"] else "No roll."
    parts = [
        f"# {dataset.attrs['title']}",
        f"Written by `{command}`.",
        f"Where the right wheel touches first, as a rigid body, with {1e3 * dataset.attrs['yaw']:g} mrad of "
        f"yaw. {roll} Axes: x forwards, y to the right, z down; longitudinal positions from the middle of "
        "the axle.",
    ]
    if remarks.strip():
        parts.append(remarks.strip())
    parts += [
        f"![Contact position over the shift]({stem}.svg)",
        "*Contact on the wheel over the lateral shift. Open circles: two-point contact, where the contact "
        f"leaves one point for the other. All values: [{stem}.csv]({stem}.csv).*",
        "## Two-point contact",
    ]
    rows = [
        [
            counterface_name(dataset["jump_curvature"].values[k]),
            f"{1e3 * dataset['jump_shift'].values[k]:.2f}",
            *(
                " and ".join(
                    f"{1e3 * dataset[f'jump_{s}_{name}'].values[k]:.1f}" for s in ("before", "after")
                )
                for name in ("wheel_y", "x", "contact_angle")
            ),
        ]
        for k in range(dataset.sizes["jump"])
    ]
    head = ["counterface", "shift [mm]", "y on the wheel [mm]", "x [mm]", "contact angle [mrad]"]
    parts.append(_table(head, rows) if rows else "None in this range of shifts.")
    parts.append("## Contact points")
    chosen = np.unique(np.round(np.linspace(0, shift.size - 1, min(17, shift.size))).astype(int))
    head = ["shift [mm]"]
    for curvature in curvatures:
        head += [f"{counterface_name(curvature)}: y on the wheel [mm]", "x [mm]", "contact angle [mrad]"]
    parts.append(
        _table(
            head,
            [
                [
                    f"{shift[i]:g}",
                    *(
                        f"{1e3 * dataset[name].values[k, i]:.{digits}f}"
                        for k in range(curvatures.size)
                        for name, digits in (("wheel_y", 2), ("x", 2), ("contact_angle", 1))
                    ),
                ]
                for i in chosen
            ],
        )
    )
    return "\n\n".join(parts) + "\n"


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---", *(["---:"] * (len(head) - 1))], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
