"""Report on wear steps with control on and off: Markdown and figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from wearsim.report.folder import report_folder
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style

_BAND = (-18.0, 26.0)  # where the wheel wears [mm]
_RIPPLE_MM = 4


def write_wear_steps(
    datasets: Sequence[xr.Dataset], title: str, remarks: str, out: Path, stem: str, command: str
) -> Path:
    """Write the report.

    Parameters
    ----------
    datasets : sequence of Dataset
        One per model, from `wearsim.studies.wear_steps.solve_wear_steps`.
    title, remarks : str
        Of the scene.
    out : Path
        Folder; made if it is not there.
    stem : str
        Of the file names.
    command : str
        Command line, for the report.

    Returns
    -------
    Path
        The Markdown file; the figure stands beside it.

    Raises
    ------
    ResultError
        If the folder cannot be written to.
    """
    with report_folder(out):
        save_svg(figure(datasets), out / f"{stem}.svg")
        path = out / f"{stem}.md"
        path.write_text(markdown(datasets, title, remarks, f"{stem}.svg", command), encoding="utf-8")
    return path


def figure(datasets: Sequence[xr.Dataset]) -> Figure:
    """Draw the worn depth at the end and the ripple on the way, one column per model.

    Parameters
    ----------
    datasets : sequence of Dataset
        One per model.
    """
    with style():
        made, axes = grid(2, len(datasets), height=2.4, gap=0.8, between=0.6)
        for column, data in enumerate(datasets):
            end, way = axes[0, column], axes[1, column]
            for case in range(data.sizes["case"]):
                colour, steps = SERIES_COLOURS[case % len(SERIES_COLOURS)], int(data["steps"][case])
                text = str(data["text"].values[case])
                end.plot(1e3 * data["y"], 1e6 * data["wear_depth"][case], lw=0.9, color=colour, label=text)
                way.semilogy(
                    1e6 * data["depth"][case, :steps],
                    1e6 * data["ripple"][case, :steps],
                    ".-",
                    lw=0.8,
                    color=colour,
                    label=text,
                )
                if str(data["told"].values[case]):
                    last = steps - 1
                    way.plot(
                        1e6 * data["depth"][case, last], 1e6 * data["ripple"][case, last], "x", color=colour
                    )
            beyond = float(data["factor"].max())
            end.set_title(f"{data['normal'].values[0]}, {beyond:g} times the limit")
            end.set_xlim(*_BAND)
            end.set_xlabel("y on the wheel [mm]")
            end.set_ylabel("wear depth [µm]")
            way.set_xlabel("largest wear depth on the way [µm]")
            way.set_ylabel(f"waves below {_RIPPLE_MM} mm, RMS [µm]")
            way.yaxis.set_major_formatter("{x:g}")
            way.yaxis.set_minor_formatter(NullFormatter())
        legend(made, columns=2)
    return made


def markdown(datasets: Sequence[xr.Dataset], title: str, remarks: str, picture: str, command: str) -> str:
    """Write the text.

    Parameters
    ----------
    datasets : sequence of Dataset
        One per model.
    title, remarks, picture, command : str
        Heading, a paragraph, the figure's file, the command line.
    """
    first = datasets[0].attrs
    introduction = (
        f"Made by `{command}`. A new S1002 wheel with noise of {1e6 * first['noise']:g} µm at its points, "
        "0.25 mm apart, runs on 60E1 1:40 at seven lateral positions from -4 to -1 mm with 5 mrad of yaw, "
        f"80 kN, friction 0.35; patches of {first['strips']} strips. With control on, the steps are those of "
        "a campaign: stability, depth of 8 µm, Heun's rule, increments smoothed at 2.5 mm. With control off, "
        "every step is a given multiple of the longest stable one: S = 1 for models of virtual penetration, "
        "the depth (p0/E*) Δy for models of the half-space kind."
    )
    lines = [
        "| model | steps | number of steps | wear depth [µm] | waves below 4 mm, RMS [µm] | end |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for data in datasets:
        for case in range(data.sizes["case"]):
            steps = int(data["steps"][case])
            depth, ripple = (
                f"{1e6 * float(data[name][case, steps - 1]):.3g}" if steps else "-"
                for name in ("depth", "ripple")
            )
            told = str(data["told"].values[case])
            end = f"breaks down: {told}" if told else "reached"
            name, text = str(data["normal"].values[case]), str(data["text"].values[case])
            factor = float(data["factor"][case])
            if factor:
                text = text.replace("beyond", f"{factor:g} times")
            lines.append(f"| {name} | {text} | {steps} | {depth} | {ripple} | {end} |")
    caption = (
        "Top: wear depth at the end. Bottom: what is shorter than 4 mm in it, on the way; a cross marks "
        "where the contact broke up into more patches than a wheel can have."
    )
    parts = [
        f"# {title}",
        introduction,
        remarks.strip(),
        "\n".join(lines),
        f"![{caption}]({picture})",
        f"*{caption}*",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"
