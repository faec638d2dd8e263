"""Speed against accuracy of the contact models: time and wear error of every pair of them, and CONTACT's.

    python reports/speed_accuracy.py [--out DIR] [--from-csv]

does what `wearsim chart` does for the scenes of workflows/rig_vs_field.toml and writes speed_accuracy.md,
.csv and .svg; times are of this machine. With --from-csv it writes the text alone, from the CSV file. What
is known of CONTACT is in speed_accuracy_peers.csv.
"""

import sys

import pandas as pd
from writing import HERE, Figure, Table, options, write_csv, write_report

from wearsim.report.style import SERIES_COLOURS, grid, label_axes, legend, save_svg, style
from wearsim.scene import build
from wearsim.scene.read import load_campaign
from wearsim.studies.chart import ERRORS, MODEL, speed_and_accuracy, worst_scene

SCENE, GRIDS, REFERENCE_GRID = "workflows/rig_vs_field.toml", (20, 30, 50), 60
MARKERS = ("o", "s", "^", "D", "v", "P")
SMALLEST = 0.1  # end of the error axis [%]

SETTING = """
Scenes: {scenes}; new profiles. Reference: {reference}. Time: of one wheel at one operating point on one
thread, as a ratio to the fastest combination in the same run. Errors in per cent: of the smoothed wear
increment, its largest difference over the largest depth, by the scene's wear law; of the strip work, the
integral of the difference over that of the reference; of the power, the largest of all points. A
combination is on the Pareto front if none is as fast and as close in both depth and strip work of the worst
scene, and better in one; those on it by strip work alone are behind the line of the figure.
"""
CAPTION = """\
Time of one solution and error of the wear depth of the worst scene (left), and of the power at the worst
point (right); larger signs are finer grids. Stars: combinations of CONTACT, 95 % quantile of the error of
the power over its own reference cases."""


def figure(table):
    """Draw time against the errors of depth and of power."""
    worst = worst_scene(table).join(table[["pareto_depth"]])
    with style():
        picture, ((depth, power),) = grid(1, 2, height=3.6, width=10.5)
        scatter(worst, depth, "depth_error", "Error of wear depth [%]")
        front = worst[worst["pareto_depth"]].sort_values("time")
        depth.plot(
            1e3 * front["time"], per_cent(front["depth_error"]), color="#555555", linewidth=0.8,
            drawstyle="steps-post", zorder=1, label="front of time and depth",
        )  # fmt: skip
        scatter(worst, power, "power_error", "Error of power [%]")
        for row in pd.read_csv(HERE / "speed_accuracy_peers.csv", comment="#").dropna().itertuples():
            place = 1e3 * row.time, per_cent(row.power_error)
            power.plot(
                *place, marker="*", markersize=8, markerfacecolor="none", color="#888888", linestyle="none",
                label="CONTACT, another machine",
            )  # fmt: skip
            power.annotate(
                f"{row.normal}, {row.tangential}, {row.cell_mm} mm", place, textcoords="offset points",
                xytext=(5, 4), fontsize=7, color="#666666",
            )  # fmt: skip
        legend(picture, columns=4)
    return picture


def per_cent(error):
    """Error as it is drawn [%]."""
    return (100.0 * error).clip(SMALLEST) if isinstance(error, pd.Series) else max(100.0 * error, SMALLEST)


def scatter(worst, ax, error, label):
    """Draw a mark for every combination that solves all scenes."""
    normals, tangentials = (sorted(set(worst[name])) for name in ("normal", "tangential"))
    for one in worst.dropna(subset=["time", error]).to_dict("records"):
        ax.plot(
            1e3 * one["time"], per_cent(one[error]), linestyle="none",
            color=SERIES_COLOURS[normals.index(one["normal"]) % len(SERIES_COLOURS)],
            marker=MARKERS[tangentials.index(one["tangential"]) % len(MARKERS)],
            markersize=3.0 + 4.0 * one["grid"] / worst["grid"].max(),
            label=f"{one['normal']} + {one['tangential']}",
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylim(bottom=SMALLEST)
    label_axes(ax, "Time per solution [ms]", label)


def shown(error):
    """Error in a table [%]."""
    return f"{100.0 * error:.2g}" if error < 1.0 else f"{100.0 * error:.0f}"


def report(values):
    """Blocks of text, figure and table from the values of the CSV file."""
    scenes = list(dict.fromkeys(values["scene"]))
    rows, refused = [], []
    for names, of_model in values.sort_values("time_ratio", kind="stable").groupby(
        MODEL, sort=False, dropna=False
    ):
        first = of_model.iloc[0]
        if of_model["refusal"].notna().any():
            refused.append(f"- {names[0]} + {names[1]}, {names[2]}: {of_model['refusal'].dropna().iloc[0]}")
            continue
        ratio = first["time_ratio"]
        depth = of_model.set_index("scene")["depth_error"][scenes]
        rows.append([
            *names, f"{ratio:.2g}" if ratio < 100.0 else f"{ratio:.0f}", *map(shown, depth),
            shown(of_model["work_error"].max()), shown(of_model["power_error"].max()),
            "yes" if first["pareto"] else "",
        ])  # fmt: skip
    head = [*MODEL, "time, ratio", *(f"depth, {name}" for name in scenes), "strip work", "power", "Pareto"]
    reference = f"half_space + half_space, {REFERENCE_GRID} x {REFERENCE_GRID}"
    blocks = [
        SETTING.format(scenes=", ".join(scenes), reference=reference),
        Figure("speed_accuracy.svg", CAPTION.replace("\n", " ")),
        Table(head, rows, "l" * len(head)),
    ]
    return [*blocks, "Without a solution:", "\n".join(refused)] if refused else blocks


def main():
    """Write the report."""
    chosen = options(__file__, __doc__, from_csv=True)
    csv = chosen.out / "speed_accuracy.csv"
    if not chosen.from_csv:
        setups = [build(part) for part in load_campaign(SCENE).parts]
        table = speed_and_accuracy(
            setups, GRIDS, REFERENCE_GRID, report=lambda line: sys.stderr.write(f"{line}\n")
        )
        save_svg(figure(table), chosen.out / "speed_accuracy.svg")
        table["time_ratio"] = table["time"] / table["time"].min()
        columns = ["scene", *MODEL, *ERRORS, "refusal", "time_ratio", "pareto"]
        write_csv(table.sort_values(["normal", "tangential", "grid"], kind="stable")[columns], csv)
    title = "Speed against accuracy of the contact models"
    write_report(chosen.out, __file__, title, report(pd.read_csv(csv)))


if __name__ == "__main__":
    main()
