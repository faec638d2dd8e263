"""Speed against accuracy: short campaigns by every combination of contact models.

    python reports/speed_accuracy.py [--out DIR] [--from-csv]

does what `wearsim chart` does for the scenes of workflows/rig_vs_field.toml and writes
speed_accuracy.md, .csv and .svg; times are of this machine. With --from-csv it writes
text and figure from the CSV file.
"""

import sys

import pandas as pd
from writing import HERE, Figure, Table, options, write_csv, write_report

from wearsim.report.html import plot_chart
from wearsim.report.style import save_svg
from wearsim.scene import build
from wearsim.scene.read import load_campaign
from wearsim.studies.chart import speed_and_accuracy

SCENE = HERE.parent / "workflows" / "rig_vs_field.toml"

SETTING = """
Scenes: {scenes}. Each campaign begins with new profiles; one by the half-space at every operating point and
every stage, in finer steps, ends where its largest depth reaches 60 um, the others run over the same
distance, in steps with an error of at most 1/250 of that depth. Error: largest difference of depth from it
along both profiles at ten places of the distance, in a programme of blocks at the ends of steps that both
campaigns have, over the largest depth at the end. Time: CPU time of the whole campaign over that of the
half-space, one thread; one solution: of one wheel at one operating point, over that of the fastest
combination. Front: no other combination is both faster and nearer in that scene.
"""
CAPTION = (
    "CPU time of whole short campaigns and their largest error of wear depth; dashed: "
    "the front."
)


def report(table):
    """Blocks of text, figure and tables from the values of the CSV file."""
    blocks = [
        SETTING.format(scenes="; ".join(dict.fromkeys(table["scene"]))),
        Figure("speed_accuracy.svg", CAPTION),
    ]
    for scene, rows in table.groupby("scene", sort=False):
        cells = [
            [
                row.models,
                "" if pd.isna(row.solution_ratio) else f"{row.solution_ratio:.3g}",
                f"{row.time_ratio:.2g}",
                f"{row.steps:.0f}",
                f"{100 * row.depth_error:.2g}",
                "yes" if row.pareto else "",
            ]
            for row in rows[rows["time_ratio"].notna()]
            .sort_values("time_ratio")
            .itertuples()
        ]
        head = ["models", "one solution", "campaign", "steps", "error [%]", "front"]
        blocks.append(Table(head, cells, caption=scene))
    refused = table[table["refusal"].notna()]
    return [
        *blocks,
        *(
            f"{row.scene}, {row.models}: no solution, {row.refusal}"
            for row in refused.itertuples()
        ),
    ]


def main():
    """Write the report."""
    chosen = options(__file__, __doc__, from_csv=True)
    csv = chosen.out / "speed_accuracy.csv"
    if not chosen.from_csv:
        setups = [build(part) for part in load_campaign(SCENE).parts]
        table = speed_and_accuracy(
            setups, report=lambda line: sys.stderr.write(f"{line}\n")
        )
        table["solution_ratio"] = (
            table["time_per_solution"] / table["time_per_solution"].min()
        )
        write_csv(table.drop(columns=["time", "time_per_solution"]), csv)
    table = pd.read_csv(csv)
    save_svg(plot_chart(table), chosen.out / "speed_accuracy.svg")
    write_report(
        chosen.out,
        __file__,
        "Speed against accuracy of the contact models",
        report(table),
    )


if __name__ == "__main__":
    main()
