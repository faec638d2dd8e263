"""Rig and field: the seed's cases split into causes.

Also how factors drift with wear and roller radius.

    python reports/translation.py [--out DIR] [--from-csv]

writes translation.md and translation.csv; about four minutes on two cores.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from writing import Table, options, write_csv, write_report

import wearsim
from wearsim.campaign.causes import POWER_CAUSES, split_power
from wearsim.scene.overrides import Override
from wearsim.studies.bands import run_bands
from wearsim.translation.bands import asked_of, band_table
from wearsim.translation.translate import cause_table

RADII = (0.5, 1.0, 2.0)
PAPER = {(0.0, 1.0): 1.61, (0.0, 0.5): 2.78, (3.0, 1.0): 1.39, (3.0, 0.5): 1.84}
"""Power on the roller over that on the rail by shift [mm] and radius [m], table 5 of
Liu & Bruni (2016).
"""
DISTANCE = {"rig": 1260, "field": 35000}
"""Of the shipped scenes [km]."""


def points():
    """Rows of the seed's cases: power on rollers over that on rails, and its causes."""
    rail = wearsim.rails("60E1", inclination=1 / 40, gauge=1.435)
    wheelset = wearsim.wheelset("S1002", radius=0.46)
    models = wearsim.ContactModels.of("fast", strips=60, cells=60)
    shifts = np.array([0.0, 3.0])
    conditions = wearsim.ContactConditions.of(1e-3 * shifts, friction=0.35)
    for radius in RADII:
        roller = replace(rail, curvature=1.0 / radius)
        causes, factor = split_power(
            conditions, (wheelset, roller, models), (wheelset, rail, models)
        )
        for k, shift in enumerate(shifts):
            yield {
                "what": "point",
                "radius_m": radius,
                "shift_mm": shift,
                "factor": factor[k, 0],
                **dict(zip(POWER_CAUSES, causes[k, 0], strict=True)),
            }


def campaigns(folder):
    """Rows of the shipped comparison with rollers of several radii.

    Factors and causes along the way.
    """
    for radius in RADII:
        out = folder / f"{radius:g}"
        wearsim.run(
            "workflows/rig_vs_field.toml",
            out,
            overrides=[Override("rig.counterface.roller_radius_mm", 1e3 * radius)],
        )
        with xr.open_dataset(out / "translation.nc") as factors:
            table = cause_table(factors.load())
        for way in ("new wheels", "25%", "50%", "75%", "100%"):
            causes = {str(name): float(value) for name, value in table[way].items()}
            yield {"what": "campaign", "radius_m": radius, "way": way, **causes}


def bands(folder):
    """Rows of the shipped bands: what is left open, and what decides it."""
    scene = wearsim.load_scene("workflows/uncertainty.toml")
    wearsim.run(scene, folder / "bands")
    made, _ = run_bands(scene.origin.path, folder / "bands")
    for name in asked_of(made):
        found = made[f"{name}_sensitivity"]
        decided = dict(zip(made["input_name"].values, found.values[:, 0], strict=True))
        row = next(
            one
            for one in band_table(made).to_dict("records")
            if one["variable"] == name
        )
        low, high = row["5%"], row["95%"]
        yield {
            "what": "band",
            "quantity": f"{row['quantity']}, {row['where']} [{row['unit']}]",
            "factor": row["nominal"],
            "low": low,
            "high": high,
            **decided,
        }


def text(value):
    """Write a factor."""
    return "–" if not np.isfinite(value) else f"{value:.3g}"


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    file = chosen.out / "translation.csv"
    if not chosen.from_csv:
        with tempfile.TemporaryDirectory() as folder:
            write_csv(
                pd.DataFrame(
                    [*points(), *campaigns(Path(folder)), *bands(Path(folder))]
                ),
                file,
            )
    rows = pd.read_csv(file)
    point = rows[rows["what"] == "point"].to_dict("records")
    power = Table(
        ["Shift [mm]", "Roller [m]", "paper", "ours", *POWER_CAUSES],
        [
            [
                f"{row['shift_mm']:g}",
                f"{row['radius_m']:g}",
                text(PAPER.get((row["shift_mm"], row["radius_m"]), np.nan)),
                *(text(row[name]) for name in ("factor", *POWER_CAUSES)),
            ]
            for row in point
        ],
        caption=(
            "Frictional power on rollers over that on rails, right wheel, and its "
            "causes: they multiply."
        ),
    )
    run = rows[rows["what"] == "campaign"].dropna(axis=1, how="all")
    names = [
        name
        for name in run.columns
        if name not in ("what", "radius_m", "way", "shift_mm")
    ]
    ends = [
        Table(
            ["Cause", *run[run["radius_m"] == radius]["way"]],
            [
                [name, *map(text, run[run["radius_m"] == radius][name])]
                for name in names
            ],
            caption=(
                f"Rollers of {radius:g} m: worn area per distance, rig over field, "
                "and its causes, at equal worn depth."
            ),
        )
        for radius in RADII
    ]
    band = rows[rows["what"] == "band"].dropna(axis=1, how="all")
    inputs = [
        name
        for name in band.columns
        if name not in ("what", "quantity", "factor", "low", "high")
    ]
    left = Table(
        ["Quantity", "nominal", "5 %", "95 %", *inputs],
        [
            [
                row["quantity"],
                *(text(row[name]) for name in ("factor", "low", "high")),
                *(f"{row[name]:.2f}" for name in inputs),
            ]
            for row in band.to_dict("records")
        ],
        caption=(
            "Bands of 64 draws, and the share of the variance of the logarithm that "
            "each input decides."
        ),
    )
    blocks = [
        "Which difference of a rig and a field makes how much of a factor. Factors of "
        "causes multiply to the whole factor; they are Shapley values of its "
        "logarithm (`wearsim/campaign/causes.py`).",
        "## Equal operating points: the cases of the seed",
        "The paper's ratios are those of table 5 of Liu & Bruni (2016), 80 kN, 72 "
        "km/h, friction 0.35, a wheel whose rotation leaves no longitudinal creepage "
        "in the middle; ours is a wheelset that turns freely. In the middle the power "
        "is that of spin, which is 1 + r0/s0 times as large on a roller; at 3 mm it "
        "is mostly that of the longitudinal creepage. The smaller patch takes some "
        "off everywhere.",
        power,
        "## Campaigns: how factors drift with wear",
        f"The shipped comparison (`workflows/rig_vs_field.toml`, {DISTANCE['rig']} km "
        f"of rig, {DISTANCE['field']} km of field) with rollers of three radii.",
        *ends,
        "## Which uncertain inputs matter",
        (
            "`wearsim run workflows/uncertainty.toml --bands`: its ranges are "
            "assumptions, stated there."
        ),
        left,
    ]
    return write_report(
        chosen.out, __file__, "From the rig to the field: causes", blocks
    )


if __name__ == "__main__":
    main()
