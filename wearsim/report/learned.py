"""Tables and figures of a calibration: what measured wheels tell about inputs."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes

from wearsim.report.figures.wheels import WORN_Y
from wearsim.report.plates import Plate
from wearsim.report.style import (
    COLOURS,
    SERIES_COLOURS,
    label_axes,
    own_axes,
    panels,
    plain,
)
from wearsim.report.tables import Table
from wearsim.scene.input_names import input_heading, input_title, titled
from wearsim.studies.calibration import (
    PRIOR_RETURNED,
    checks_of,
    table_of,
    transfer_notes,
)
from wearsim.studies.posterior import LARGEST_ERROR, LEAST_EFFECTIVE, LEAST_P

_SUFFIX = "_measured"
_WITHIN = 1.645  # standard deviations of 90 %


def quantities(calibration: xr.Dataset) -> list[str]:
    """Names of what was measured, such as rig_right_wear_depth."""
    names = map(str, calibration.data_vars)
    return [name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)]


def sentences(calibration: xr.Dataset) -> list[str]:
    """Say what was learned, and what was not."""
    rows = table_of(calibration)
    informed = [row for row in rows if row["deviation"] <= PRIOR_RETURNED]
    lines = [
        f"{input_heading(row['input'])}: "
        f"{_with_unit(plain(row['posterior'][1], 3), row['unit'])} "
        f"(90 %: {plain(row['posterior'][0], 3)} to {plain(row['posterior'][2], 3)}; "
        "before the measurements "
        f"{plain(row['prior'][0], 3)} to {plain(row['prior'][2], 3)})."
        for row in informed
    ]
    if uninformed := [input_title(row["input"]) for row in rows if row not in informed]:
        names = ", ".join(uninformed)
        text = f"The measurements say next to nothing about {names}"
        lines.append(f"{text}: what was assumed before is returned.")
    lines += [f"{note}." for note in transfer_notes(calibration)]
    lines.append("These are predictions of a model, fitted to these measurements.")
    return lines


def _with_unit(value: str, unit: str) -> str:
    """Write a value with the unit of `table_of`."""
    return f"factor {value}" if unit == "factor" else f"{value} {unit}".strip()


def inputs(calibration: xr.Dataset) -> Table:
    """Quantiles of each input before and after."""
    rows = [
        [
            input_title(row["input"]),
            row["unit"],
            *row["prior"],
            *row["posterior"],
            row["deviation"],
            row["remark"],
        ]
        for row in table_of(calibration)
    ]
    heads = [
        "Input",
        "Unit",
        *2 * ["5 %", "50 %", "95 %"],
        "Deviation over prior",
        "Note",
    ]
    return Table(
        "inputs",
        pd.DataFrame(rows, columns=heads, dtype=object),
        "Inputs before (prior) and after the measurements (posterior): quantiles, and "
        "the standard deviation after over that before, near 1 where the measurements "
        "say nothing. Units: a factor multiplies the value of the scene, an added "
        "amount is added to it.",
        bands=[("", 2), ("Prior", 3), ("Posterior", 3), ("", 2)],
    )


def correlations(calibration: xr.Dataset) -> Table:
    """Correlations of the inputs after the measurements."""
    names = list(map(str, titled(calibration)["input_name"].values))
    values = calibration["correlation"].values
    rows = [[name, *map(float, row)] for name, row in zip(names, values, strict=True)]
    return Table(
        "correlations",
        pd.DataFrame(rows, columns=["Input", *names], dtype=object),
        "Correlations of the posterior: near 1 or −1, the measurements determine a "
        "combination of both inputs, not each of them.",
        digits=2,
    )


def worth(calibration: xr.Dataset) -> Table:
    """Give what a further measurement would leave of each standard deviation."""
    names = list(map(str, titled(calibration)["input_name"].values))
    rows = [
        [str(name), *map(float, row)]
        for name, row in zip(
            calibration["measurement_name"].values,
            calibration["worth"].values,
            strict=True,
        )
    ]
    return Table(
        "worth",
        pd.DataFrame(rows, columns=["Further measurement", *names], dtype=object),
        "Standard deviation of each input with a further measurement of both wheels "
        "over that now, linearised: 1 where it adds nothing. At twice the distance "
        "wear is assumed to go on as it has.",
        digits=2,
    )


def checks(calibration: xr.Dataset) -> Table:
    """Figures by which the posterior is accepted."""
    of = checks_of(calibration)
    rows = [
        ["Chi-square", of["chi_square"], f"of {of['measurements']} values"],
        ["p of chi-square", of["p_value"], f"refused below {LEAST_P:g}"],
        ["Effective draws", of["effective_draws"], f"refused below {LEAST_EFFECTIVE}"],
        [
            "Error of the polynomial over the noise",
            of["surrogate_error"],
            f"refused above {LARGEST_ERROR:g}",
        ],
        ["Campaigns", of["campaigns"], ""],
        ["Contact models", str(calibration.attrs["contact_models"]), ""],
        ["Seed", int(calibration.attrs["seed"]), ""],
    ]
    frame = pd.DataFrame(rows, columns=["Check", "Value", "Note"], dtype=object)
    return Table("checks", frame, "Why the posterior is accepted.")


def files(calibration: xr.Dataset) -> Table:
    """Files of the measurements."""
    pairs = json.loads(calibration.attrs["files"]).items()
    rows = [
        ["table", str(calibration.attrs["table"]), ""],
        *(["profile", *pair] for pair in pairs),
    ]
    frame = pd.DataFrame(rows, columns=["Role", "Name", "SHA-256"], dtype=object)
    return Table("files", frame, "What was measured.", look="text")


def plot_measured(calibration: xr.Dataset, wheel: str, ax: Axes | None = None) -> Axes:
    """Draw measured depth of a wheel and what is predicted, at each distance.

    Parameters
    ----------
    calibration : Dataset
        Of a calibration.
    wheel : str
        Campaign and wheel, such as "rig_right".
    ax : Axes, optional
        By default that of a new figure.
    """
    ax, name = own_axes(ax), f"{wheel}_wear_depth"
    y, order = _along(calibration, name)
    low, _, high = 1e6 * calibration[f"{name}_predicted"].values
    campaign, side = wheel.split("_")
    for k, values in enumerate(1e6 * calibration[f"{name}_measured"].values):
        first = k == 0
        ax.plot(
            y,
            values[order],
            ".",
            ms=2,
            color=COLOURS["new"],
            label="measured" if first else None,
        )
        ax.fill_between(
            y,
            low[k][order],
            high[k][order],
            color=COLOURS[campaign],
            alpha=0.5,
            lw=0,
            label=f"predicted ({campaign}), 90 %" if first else None,
        )
    text = f"{campaign.capitalize()}, {side} wheel: wear depth [µm]"
    return label_axes(ax, WORN_Y, text)


def plot_left_over(calibration: xr.Dataset, wheel: str, ax: Axes | None = None) -> Axes:
    """Draw measured less predicted depth of a wheel; see `plot_measured`."""
    ax, name = own_axes(ax), f"{wheel}_wear_depth"
    y, order = _along(calibration, name)
    rest = 1e6 * (
        calibration[f"{name}_measured"].values
        - calibration[f"{name}_predicted"].values[1]
    )
    for k, distance in enumerate(calibration[f"{name}_distance"].values):
        colour = SERIES_COLOURS[k % len(SERIES_COLOURS)]
        ax.plot(
            y, rest[k][order], color=colour, lw=0.8, label=f"{1e-3 * distance:g} km"
        )
    wide = _WITHIN * 1e6 * calibration[f"{name}_deviation"].values[-1][order]
    ax.fill_between(y, -wide, wide, color="#d9dee4", lw=0)
    return label_axes(ax, WORN_Y, "Measured less predicted [µm]")


def _along(calibration: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Places on the wheel [mm] in order, and that order."""
    y = 1e3 * calibration[f"{name}_y"].values
    order = np.argsort(y)
    return y[order], order


def figures(calibration: xr.Dataset) -> Iterator[Plate]:
    """Measured against predicted depth with its band, and what is left over."""
    ending = "_wear_depth"
    wheels = [
        name.removesuffix(ending)
        for name in quantities(calibration)
        if name.endswith(ending)
    ]
    if not wheels:
        return
    draw = (plot_measured, plot_left_over)
    figure = panels(
        len(wheels),
        2,
        lambda ax, row, column: draw[column](calibration, wheels[row], ax),
    )
    text = (
        "Left: wear depth measured since the first measurement, each profile where it "
        "most probably lay, and predicted with the inputs learned (90 % of the draws) "
        "at each distance. Right: measured less predicted, by distance; 90 % of it "
        "should lie within the grey area of the noise and the error of the shape."
    )
    yield Plate("measured_depth", figure, text)
