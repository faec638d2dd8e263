"""Files of a report on the accuracy of contact models: Markdown, figure, table of all values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from wearsim.report.accuracy import markdown
from wearsim.report.folder import report_folder
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style
from wearsim.studies.accuracy import ERRORS

_LINES = ("-", "--", "-.", ":")
_SHOWN = (("max_pressure", "Error of pressure [%]"), ("power", "Error of power [%]"),
          ("strip_work", "Error of strip work [%]"))  # fmt: skip
_MOST = 100.0  # end of the error axes [%]; beyond it an error is of no further interest


def write_accuracy(dataset: xr.Dataset, out: Path, stem: str, command: str) -> Path:
    """Write the report on the accuracy of contact models.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file; beside it a figure and a CSV file of all errors.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    with report_folder(out):
        figure, caption = errors_figure(dataset)
        save_svg(figure, out / f"{stem}.svg")
        values_table(dataset).to_csv(
            out / f"{stem}.csv", index=False, float_format="%.6g", lineterminator="\n"
        )
        path = out / f"{stem}.md"
        path.write_text(markdown(dataset, command, (f"{stem}.svg", caption)), encoding="utf-8")
    return path


def values_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Table of all values: a row for each case of the reference, and one for each model and case.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.

    Returns
    -------
    DataFrame
        SI units; missing values where a model refuses.
    """
    names = ("area", "max_pressure", "force_x", "force_y", "power")
    shared = {
        "case": dataset["case"].values,
        **{
            name: dataset[name].values
            for name in ("counterface_profile", "inclination", "counterface_curvature", "shift", "yaw",
                         "wheel_load", "friction")
        },
    }  # fmt: skip
    parts = [
        pd.DataFrame(
            {"model": "reference", **shared, **{name: dataset[f"reference_{name}"].values for name in names}}
            | {name: dataset[f"reference_{name}"].values for name in ("slip_share", "patches")}
        )
    ]
    for k, model in enumerate(dataset["model"].values):
        values = {name: dataset[name].values[k] for name in (*names, *(f"error_{name}" for name in ERRORS))}
        parts.append(
            pd.DataFrame({"model": model, **shared, **values, "refusal": dataset["refusal"].values[k]})
        )
    return pd.concat(parts, ignore_index=True)


def errors_figure(dataset: xr.Dataset) -> tuple[Figure, str]:
    """Errors of pressure, power and strip work over the shift, on the first counterface without yaw.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.

    Returns
    -------
    figure : Figure
    caption : str
        What it shows.
    """
    like = ("counterface_profile", "inclination", "counterface_curvature", "wheel_load", "friction")
    mask = np.ones(dataset.sizes["case"], dtype=bool)
    for name in like:
        mask &= dataset[name].values == dataset[name].values[0]
    yaw = dataset["yaw"].values
    least = yaw[mask][np.argmin(np.abs(yaw[mask]))]
    mask &= yaw == least
    part = dataset.isel(case=np.flatnonzero(mask)).sortby("shift")
    with style():
        figure, axes = grid(1, len(_SHOWN), height=2.8, width=11.0, sharex=True)
        for ax, (name, label) in zip(axes[0], _SHOWN, strict=True):
            for k, model in enumerate(part["model"].values):
                ax.plot(
                    1e3 * part["shift"], np.clip(100.0 * part[f"error_{name}"].values[k], -_MOST, _MOST),
                    color=SERIES_COLOURS[k % len(SERIES_COLOURS)],
                    linestyle=_LINES[k // len(SERIES_COLOURS) % len(_LINES)],
                    marker="o", markersize=2.5, linewidth=1.2, label=str(model),
                )  # fmt: skip
            ax.axhline(0.0, color="#555555", linewidth=0.8)
            ax.set_xlabel("Shift, to the right [mm]")
            ax.set_ylabel(label)
        legend(figure, columns=4)
    kappa = float(part["counterface_curvature"].values[0])
    against = "rail" if kappa == 0.0 else f"roller of {1e3 / kappa:g} mm"
    caption = (
        f"Errors over the lateral shift on {part['counterface_profile'].values[0]} "
        f"{part['inclination'].values[0]}, {against}, yaw {1e3 * least:g} mrad; the axes end at "
        f"{_MOST:g} %, gaps are refusals."
    )
    return figure, caption
