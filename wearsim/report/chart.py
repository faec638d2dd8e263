"""Report on speed against accuracy, as Markdown, and its figure."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.errors import ResultError
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style

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
        The Markdown file; beside it the figure, and a CSV file of errors and ratios of time.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    try:
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
    except OSError as error:
        raise ResultError(f"{out}: cannot be written ({error.strerror}); choose another --out") from error
    return path


def markdown(dataset: xr.Dataset, command: str, picture: tuple[str, str]) -> str:
    """Write the report.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.chart.speed_and_accuracy`.
    command : str
        Command line that writes the report.
    picture : (str, str)
        File name and caption of the figure.

    Returns
    -------
    str
        Markdown.
    """
    scenes = [str(name) for name in dataset["scene"].values]
    rows = [
        "| normal | tangential | grid | time, ratio | " + " | ".join(f"depth, {name}" for name in scenes)
        + " | strip work | power | Pareto |",
        "|---|---|---|---|" + "---|" * len(scenes) + "---|---|---|",
    ]  # fmt: skip
    for k in _order(dataset):
        one = dataset.isel(model=k)
        depth = " | ".join(_per_cent(value) for value in one["depth_error"].values)
        rows.append(
            f"| {one['normal'].item()} | {one['tangential'].item()} | {int(one['grid'])} | "
            f"{_ratio(dataset, k)} | {depth} | {_per_cent(one['work_error'].values.max())} | "
            f"{_per_cent(one['power_error'].values.max())} | {'yes' if one['pareto'] else ''} |"
        )
    parts = [
        "# Speed against accuracy of the contact models",
        f"Scenes: {', '.join(scenes)}; new profiles. Reference: {dataset.attrs['reference']}. Time: of one "
        "wheel at one operating point on one thread, as a ratio to the fastest combination in the same run. "
        "Errors in per cent: of the smoothed wear increment, its largest difference over the largest depth, "
        "by the scene's wear law; of the strip work, the integral of the difference over that of the "
        "reference; of the power, the largest of all points. A combination is on the Pareto front if none "
        "is as fast and as close in both depth and strip work of the worst scene, and better in one; those "
        f"on it by strip work alone are behind the line of the figure.\n\nWritten by `{command}`.",
        f"![{picture[1]}]({picture[0]})\n\n*{picture[1]}*",
        "\n".join(rows),
        *_refusals(dataset),
    ]
    return "\n\n".join(parts) + "\n"


def _order(dataset: xr.Dataset) -> list[int]:
    time = dataset["time"].values
    return [int(k) for k in np.argsort(time, kind="stable") if np.isfinite(time[k])]


def _ratio(dataset: xr.Dataset, model: int) -> str:
    ratio = float(dataset["time"][model]) / float(np.nanmin(dataset["time"].values))
    return f"{ratio:.2g}" if ratio < 100.0 else f"{ratio:.0f}"


def _per_cent(value: float) -> str:
    return f"{100.0 * value:.2g}" if value < 1.0 else f"{100.0 * value:.0f}"


def _refusals(dataset: xr.Dataset) -> list[str]:
    lines = []
    told = dataset["refusal"].values
    for k in range(dataset.sizes["model"]):
        first = next((text for text in told[:, k] if text), "")
        if first:
            one = dataset.isel(model=k)
            name = f"{one['normal'].item()} + {one['tangential'].item()}, {int(one['grid'])}"
            lines.append(f"- {name}: {first}")
    return ["Without a solution:\n\n" + "\n".join(lines)] if lines else []


def peers() -> list[dict[str, str]]:
    """Read the combinations of CONTACT that are drawn beside ours.

    Returns
    -------
    list of dict
        Columns of `workflows/chart_peers.csv`.
    """
    from wearsim.profile.standard import shipped_path

    lines = shipped_path("workflows", _PEERS).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def chart_figure(dataset: xr.Dataset) -> tuple[Figure, str]:
    """Draw time against the errors of depth and of power.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.chart.speed_and_accuracy`.

    Returns
    -------
    figure : Figure
    caption : str
        What it shows.
    """
    with style():
        figure, axes = grid(1, 2, height=3.6, width=10.5)
        _scatter(dataset, axes[0, 0], dataset["worst_depth_error"].values, "Error of wear depth [%]")
        front = [k for k in _order(dataset) if dataset["pareto_depth"].values[k]]
        axes[0, 0].plot(
            1e3 * dataset["time"].values[front], _shown(dataset["worst_depth_error"].values[front]),
            color="#555555", linewidth=0.8, drawstyle="steps-post", zorder=1, label="front of time and depth",
        )  # fmt: skip
        _scatter(dataset, axes[0, 1], dataset["power_error"].values.max(axis=0), "Error of power [%]")
        for row in peers():
            if row["power_error"]:
                axes[0, 1].plot(
                    1e3 * float(row["time"]), _shown(np.array([float(row["power_error"])])), marker="*",
                    markersize=8, markerfacecolor="none", color="#888888", linestyle="none",
                    label="CONTACT, another machine",
                )  # fmt: skip
                name = f"{row['normal']}, {row['tangential']}, {row['cell_mm']} mm"
                axes[0, 1].annotate(
                    name, (1e3 * float(row["time"]), _shown(np.array([float(row["power_error"])]))[0]),
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


def _shown(error: np.ndarray) -> np.ndarray:
    return np.maximum(100.0 * error, _SMALLEST)


def _scatter(dataset: xr.Dataset, ax: Axes, error: np.ndarray, label: str) -> None:
    normals = sorted(set(dataset["normal"].values.tolist()))
    tangentials = sorted(set(dataset["tangential"].values.tolist()))
    finest = float(dataset["grid"].values.max())
    for k in range(dataset.sizes["model"]):
        one = dataset.isel(model=k)
        if not (np.isfinite(float(one["time"])) and np.isfinite(error[k])):
            continue
        normal, tangential = one["normal"].item(), one["tangential"].item()
        ax.plot(
            1e3 * float(one["time"]), _shown(error[k : k + 1]), linestyle="none",
            color=SERIES_COLOURS[normals.index(normal) % len(SERIES_COLOURS)],
            marker=_MARKERS[tangentials.index(tangential) % len(_MARKERS)],
            markersize=3.0 + 4.0 * float(one["grid"]) / finest, label=f"{normal} + {tangential}",
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylim(bottom=_SMALLEST)
    ax.set_xlabel("Time per solution [ms]")
    ax.set_ylabel(label)
