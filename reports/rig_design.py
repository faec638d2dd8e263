"""How much of a field pattern rigs reproduce, against copied positions.

    python reports/rig_design.py [--out DIR] [--from-csv]

writes rig_design.md and rig_design.csv; some ten minutes of one core.
"""

import tempfile
import time
from pathlib import Path

import pandas as pd
from writing import HERE, Table, options, write_csv, write_report

import wearsim

TITLE = "Rig programmes by design: rollers of 0.5, 1 and 2 m"
DISTANCE = 100e3  # of the field [km]
RADII = (500.0, 1000.0, 2000.0)  # of the rollers [mm]
WAYS = {"no guard": (0.0, 0.05), "guard 1.5": (1.5, 0.10)}  # guard and tolerance
FAST = {
    "contact.model": "fast",
    "contact.strips": 20,
    "contact.cells": 20,
    "campaign.point_spacing_mm": 0.5,
    "operation.monitor": None,
    "fatigue": None,
}

INTRODUCTION = f"""\
Target: {DISTANCE:,.0f} km of `field_given.toml`. Rig: `rig_given.toml` with rollers
of 0.5, 1 and 2 m. Both with `contact.model = "fast"`, 20 strips and cells, and points
0.5 mm apart; any number of blocks. Each stage is run as a campaign before the next
one is designed, so the errors are those of a chained campaign. Copy: shift, yaw and
load of the field on the rig until as deep as the target. The environment factor of
the field is an assumption of the scene and part of each acceleration; what is left is
the mechanism. CPU seconds of one core include copy, price of the guard and error over
the number of blocks.

Not in the report: the pattern of `field.toml`, copies of angle of attack and Y/Q,
candidates by lateral force, worn rollers, severe wear.
"""


def field_result(folder, distance=DISTANCE):
    """Run the field."""
    overrides = FAST | {"campaign.distance_km": distance}
    scene = HERE.parent / "workflows" / "field_given.toml"
    (path,) = wearsim.run(scene, folder / "field", overrides=overrides, threads=1)
    return path


def designed(field, radius, way):
    """Row of a programme."""
    guard, tolerance = WAYS[way]
    overrides = FAST | {
        "counterface.roller_radius_mm": radius,
        "programme.guard": guard,
        "programme.tolerance": tolerance,
        "programme.blocks": 0,
    }
    began = time.process_time()
    scene = HERE.parent / "workflows" / "rig_given.toml"
    made = wearsim.programme(scene, field, overrides=overrides)
    seconds = time.process_time() - began
    of = made.attrs
    return {
        "radius_mm": radius,
        "way": way,
        "tolerance": tolerance,
        "largest_error": of["largest_error"],
        "rms_error": of["rms_error"],
        "rig_km": 1e-3 * of["rig_distance"],
        "acceleration": of["acceleration"],
        "environment": of["acceleration_environment"],
        "mechanism": of["acceleration_mechanism"],
        "stages": made.sizes["stage"],
        "blocks": int(made["blocks"].sum()),
        "most_blocks": int(made["blocks"].max()),
        "copy_km": 1e-3 * of["copy_distance"],
        "copy_acceleration": of["copy_acceleration"],
        "copy_error": of["copy_error"],
        "cpu_s": seconds,
    }


def programmes(rows):
    """Table of the programmes."""
    body = [
        [
            f"{1e-3 * row.radius_mm:g} m, {row.way}",
            f"{100 * row.tolerance:.0f}",
            f"{100 * row.largest_error:.1f}",
            f"{row.rig_km:.0f}",
            f"{row.acceleration:.1f}",
            f"{row.mechanism:.1f}",
            f"{row.blocks} in {row.stages} stages, at most {row.most_blocks}",
            f"{row.cpu_s:.0f}",
        ]
        for row in rows.itertuples()
    ]
    head = [
        "rollers",
        "tolerance [%]",
        "largest error [%]",
        "rig [km]",
        "acceleration",
        "of the mechanism",
        "blocks",
        "CPU [s]",
    ]
    return Table(head, body, caption="Programmes of least time.")


def copies(rows):
    """Table of the copies."""
    body = [
        [
            f"{1e-3 * radius:g} m",
            f"{100 * own.copy_error.iloc[0]:.1f}",
            f"{own.copy_km.iloc[0]:.0f}",
            f"{own.copy_acceleration.iloc[0]:.1f}",
        ]
        for radius, own in rows.groupby("radius_mm")
    ]
    head = ["rollers", "largest error [%]", "rig [km]", "acceleration"]
    return Table(head, body, caption="Shift, yaw and load of the field copied.")


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    file = chosen.out / "rig_design.csv"
    if not chosen.from_csv:
        with tempfile.TemporaryDirectory() as folder:
            field = field_result(Path(folder))
            found = [designed(field, radius, way) for radius in RADII for way in WAYS]
        write_csv(pd.DataFrame(found), file)
    rows = pd.read_csv(file)
    all_values = "All values: [rig_design.csv](rig_design.csv)."
    blocks = [INTRODUCTION, programmes(rows), copies(rows), all_values]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
