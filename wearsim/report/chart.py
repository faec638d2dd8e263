"""Report on speed against accuracy, as Markdown, and its figure."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.profile.standard import shipped_path
from wearsim.report.style import SERIES_COLOURS, grid, label_axes, legend, save_svg, style, writing
from wearsim.report.texts import environment

_MARKERS = ("o", "s", "^", "D", "v", "P")
_PEERS = "chart_peers.csv"


def write_chart(dataset: xr.Dataset, out: Path, stem: str, command: str) -> Path:
    """Write the report on speed against accuracy with its figure.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.chart.speed_and_accuracy`.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file; next to it the figure, and a CSV file of errors and ratios of time.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    with writing(f"{out}:", "choose another --out"):
        out.mkdir(parents=True, exist_ok=True)
        figure, caption = chart_figure(dataset)
        save_svg(figure, out / f"{stem}.svg")
        names = ["normal", "tangential", "grid", "depth_error", "work_error", "power_error", "refusal"]
        ratio = dataset["time"] / dataset["time"].min()
        table = dataset[[*names, "pareto"]].assign(time_ratio=ratio).to_dataframe().reset_index()
        table = table[["scene", *names, "time_ratio", "pareto"]]
        table.to_csv(out / f"{stem}.csv", index=False, float_format="%.6g", lineterminator="\n")
        path = out / f"{stem}.md"
        path.write_text(markdown(dataset, command, (f"{stem}.svg", caption)), encoding="utf-8")
    return path


def markdown(dataset: xr.Dataset, command: str, picture: tuple[str, str]) -> str:
    """Write the report as Markdown; `picture` are file name and caption of the figure."""
    names = ("depth_error", "work_error", "power_error")
    models = [
        {name: dataset[name].values[..., k] for name in names}
        | {name: dataset[name].values[k] for name in ("normal", "tangential", "grid", "pareto")}
        | {"ratio": _ratio(dataset, k), "reason": next(filter(None, dataset["refusal"].values[:, k]), "")}
        for k in range(dataset.sizes["model"])
    ]
    return environment(autoescape=False).get_template("chart.md.j2").render(
        scenes=[str(name) for name in dataset["scene"].values], reference=dataset.attrs["reference"],
        command=command, picture=picture, models=[models[k] for k in _order(dataset)],
        refused=[one for one in models if one["reason"]], per_cent=_per_cent,
    )  # fmt: skip


def _order(dataset: xr.Dataset) -> list[int]:
    time = dataset["time"].values
    return [int(k) for k in np.argsort(time, kind="stable") if np.isfinite(time[k])]


def _ratio(dataset: xr.Dataset, model: int) -> str:
    ratio = float(dataset["time"][model]) / float(np.nanmin(dataset["time"].values))
    return f"{ratio:.2g}" if ratio < 100.0 else f"{ratio:.0f}"


def _per_cent(value: float) -> str:
    return f"{100.0 * value:.2g}" if value < 1.0 else f"{100.0 * value:.0f}"


def peers() -> list[dict[Hashable, Any]]:
    """Read the combinations of CONTACT that are drawn with ours: columns of `workflows/chart_peers.csv`."""
    path = shipped_path("workflows", _PEERS)
    return pd.read_csv(path, comment="#", dtype=str, keep_default_na=False).to_dict("records")


def chart_figure(dataset: xr.Dataset) -> tuple[Figure, str]:
    """Draw time against the errors of depth and of power; returns the figure and its caption."""
    worst_depth = dataset["worst_depth_error"].values
    with style():
        figure, ((depth, power),) = grid(1, 2, height=3.6, width=10.5)
        _scatter(dataset, depth, worst_depth, "Error of wear depth [%]")
        front = [k for k in _order(dataset) if dataset["pareto_depth"].values[k]]
        depth.plot(
            1e3 * dataset["time"].values[front], _shown(worst_depth[front]),
            color="#555555", linewidth=0.8, drawstyle="steps-post", zorder=1, label="front of time and depth",
        )  # fmt: skip
        _scatter(dataset, power, dataset["power_error"].values.max(axis=0), "Error of power [%]")
        for row in peers():
            if row["power_error"]:
                place = 1e3 * float(row["time"]), float(_shown(float(row["power_error"])))
                power.plot(
                    *place, marker="*", markersize=8, markerfacecolor="none", color="#888888",
                    linestyle="none", label="CONTACT, another machine",
                )  # fmt: skip
                power.annotate(
                    f"{row['normal']}, {row['tangential']}, {row['cell_mm']} mm", place,
                    textcoords="offset points", xytext=(5, 4), fontsize=7, color="#666666",
                )  # fmt: skip
        legend(figure, columns=4)
    caption = (
        "Time of one solution and error of the wear depth of the worst scene (left), and of the power at the "
        "worst point (right); larger signs are finer grids. Stars: combinations of CONTACT, 95 % quantile of "
        "the error of the power over its own reference cases."
    )
    return figure, caption


_SMALLEST = 0.1  # end of the error axis [%]


def _shown(error: Any) -> Any:
    return np.maximum(100.0 * error, _SMALLEST)


def _scatter(dataset: xr.Dataset, ax: Axes, error: np.ndarray, label: str) -> None:
    normals, tangentials = (sorted(set(dataset[name].values.tolist())) for name in ("normal", "tangential"))
    finest = float(dataset["grid"].values.max())
    for k in range(dataset.sizes["model"]):
        one = dataset.isel(model=k)
        if not (np.isfinite(float(one["time"])) and np.isfinite(error[k])):
            continue
        normal, tangential = one["normal"].item(), one["tangential"].item()
        ax.plot(
            1e3 * float(one["time"]), _shown(error[k]), linestyle="none",
            color=SERIES_COLOURS[normals.index(normal) % len(SERIES_COLOURS)],
            marker=_MARKERS[tangentials.index(tangential) % len(_MARKERS)],
            markersize=3.0 + 4.0 * float(one["grid"]) / finest, label=f"{normal} + {tangential}",
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylim(bottom=_SMALLEST)
    label_axes(ax, "Time per solution [ms]", label)
