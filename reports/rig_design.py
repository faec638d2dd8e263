"""How much of field patterns rigs reproduce, against copied operating points.

    python reports/rig_design.py [--jobs N] [--work DIR] [--out DIR] [--from-csv]

writes rig_design.md and rig_design.csv, each row as soon as it is computed; some five
minutes of one core.
"""

import re
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import pandas as pd
from writing import HERE, Table, options, write_csv, write_report

import wearsim

TITLE = "Rig programmes by design: rollers of 0.5, 1 and 2 m"
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
VEHICLE = {name: value for name, value in FAST.items() if "monitor" not in name}

TIGHT = {
    "vehicle.class.R 400.curve_radius_m": 200,
    "vehicle.class.R 400.speed_km_h": 50,
    "vehicle.class.R 400.friction_flange": 0.4,
}
FURTHEST = {"programme.shift_mm": 9.0}  # onto the flange, as the vehicle in curves
# field: scene, distance [km] and overrides
FIELDS = {
    "given": ("field_given.toml", 100e3, FAST),
    "vehicle": ("field.toml", 20e3, VEHICLE),
    "dry flange": (
        "field.toml",
        5e3,
        VEHICLE | TIGHT,
    ),
    "standard": ("field_given.toml", 2.5e3, FAST | {"contact.model": "standard"}),
}
DISTANCE = FIELDS["given"][1]  # of the long target [km]
TARGETS = {"given": 10e3, "vehicle": 5e3, "dry flange": 5e3, "standard": 2.5e3}  # [km]
SHORT = 2.5e3  # target of variants in the given field [km]
COARSE = {
    "programme.shift_step_mm": 0.8,
    "programme.yaws_mrad": [-4.0, -1.0, -0.25, 0.0, 0.25, 1.0, 4.0],
    "programme.loads_kN": [25.0, 50.0, 80.0, 100.0],
}
BY_FORCE = {
    "programme.lateral_force_kN": 40.0,
    "programme.yaws_mrad": [-1.0, 0.0, 1.0],
    "programme.loads_kN": [25.0, 50.0, 80.0],
}
# variant: field and overrides of the rig, with rollers of 1 m and guard 1.5
VARIANTS = {
    "by shift": ("given", {}),
    "by lateral force": ("given", BY_FORCE),
    "worn rollers": ("given", {"counterface.wear.factor": 1.0}),
    "severe wear, no guard": ("dry flange", {}),
    "standard model": ("standard", {"contact.model": "standard"}),
}

INTRODUCTION = """\
Rig: `rig_given.toml` with rollers of 0.5, 1 and 2 m. All with `contact.model = "fast"`,
20 strips and cells, and points 0.5 mm apart; any number of blocks. Each stage is run as
a campaign before the next one is designed, so the errors are those of a chained
campaign. Copies run operating points of the field on the rig until as deep as the
target: shift, yaw and load; or angle of attack, load and Y/Q of the guiding wheel, at
the shift nearest to that of the field where the rig has this Y/Q. The environment
factor of the field is an assumption of the scene and part of each acceleration; what is
left is the mechanism. CPU seconds of one core include copies, price of the guard and
error over the number of blocks.

The first table has the set-points that `[programme]` has by default; all others choose
from fewer of them: shifts 0.8 mm apart, seven yaw angles, four loads. Shifts end at the
flange clearance of 6.6 mm; for targets of the vehicle, which runs onto its flanges in
curves, at 9 mm.
"""

VARIED = f"""\
Shorter targets on rollers of 1 m with guard 1.5 and a tolerance of 10 %, unless stated:
{SHORT:,.0f} km of `field_given.toml` by shift, by lateral force up to 40 kN in steps of
10 kN (three yaw angles and loads, as each set-point needs its balance), and with
rollers that wear like the wheel (`factor = 1`); {TARGETS["dry flange"]:,.0f} km of
`field.toml` with curves of 200 m at 50 km/h in place of 400 m and a dry flange, without
guard at a tolerance of 5 %; and {TARGETS["standard"]:,.0f} km of `field_given.toml`
with `contact.model = "standard"` in field and rig.
"""


def field_result(folder, field="given"):
    """Run a field, unless the folder has its result already."""
    scene, distance, overrides = FIELDS[field]
    there = folder / field.replace(" ", "_") / "field.nc"
    if there.exists():
        return there
    overrides = overrides | {"campaign.distance_km": distance}
    path = HERE.parent / "workflows" / scene
    out = folder / field.replace(" ", "_")
    (result,) = wearsim.run(path, out, overrides=overrides, threads=1)
    return result


def severe_share(field, distance):
    """Share of the worn area of a field that is not mild, at a distance [km]."""
    with wearsim.open_results(field) as data:
        end = int((data["distance"].values <= 1e3 * distance * (1.0 + 1e-9)).sum()) - 1
        depth = data["wear_depth_by_regime"].isel(step=end)
        by_regime = depth.sum(["wheel", "point"]).values
    return float(by_regime[1:].sum() / by_regime.sum())


def designed(result, field, distance, radius, way, variant="", choice=None):
    """Row of a programme for a distance [km] of a field, by a choice of set-points."""
    guard, tolerance = WAYS[way]
    overrides = FAST | {
        "counterface.roller_radius_mm": radius,
        "programme.guard": guard,
        "programme.tolerance": tolerance,
        "programme.blocks": 0,
    }
    overrides |= choice or {}
    overrides |= {} if FIELDS[field][0] == "field_given.toml" else FURTHEST
    overrides |= VARIANTS[variant][1] if variant else {}
    began = time.process_time()
    scene = HERE.parent / "workflows" / "rig_given.toml"
    made = wearsim.programme(
        scene, result, overrides=overrides, distance=1e3 * distance
    )
    seconds = time.process_time() - began
    of = made.attrs
    row = {
        "field": field,
        "variant": variant,
        "radius_mm": radius,
        "way": way,
        "deepest_um": 1e6 * float(made["target"].max()),
        "severe_share": severe_share(result, distance),
        "tolerance": tolerance,
        "largest_error": of["largest_error"],
        "rms_error": of["rms_error"],
        "field_km": 1e-3 * of["target_distance"],
        "rig_km": 1e-3 * of["rig_distance"],
        "acceleration": of["acceleration"],
        "environment": of["acceleration_environment"],
        "mechanism": of["acceleration_mechanism"],
        "stages": made.sizes["stage"],
        "blocks": int(made["blocks"].sum()),
        "most_blocks": int(made["blocks"].max()),
        "cpu_s": seconds,
    }
    for copy in ("copy", "copy_forces"):
        row[f"{copy}_km"] = 1e-3 * of[f"{copy}_distance"]
        for name in ("acceleration", "error", "reason"):
            row[f"{copy}_{name}"] = of[f"{copy}_{name}"]
    return row


def reached(result, field, distance, radius, way, variant, choice):
    """Row of a programme, with the fault alone where there is none."""
    try:
        return designed(result, field, distance, radius, way, variant, choice)
    except wearsim.WearsimError as error:
        return {
            "field": field,
            "variant": variant,
            "radius_mm": radius,
            "way": way,
            "field_km": distance,
            "fault": re.sub(r"\S*/", "", str(error).splitlines()[0]),
        }


def _blocks(row):
    """Text of the number of blocks."""
    return f"{row.blocks:.0f} in {row.stages:.0f} stages"


def programmes(rows):
    """Table of the programmes for a pattern."""
    body = [
        [
            f"{1e-3 * row.radius_mm:g} m, {row.way}",
            f"{100 * row.tolerance:.0f}",
            f"{100 * row.largest_error:.1f}",
            f"{row.rig_km:.0f}",
            f"{row.acceleration:.1f}",
            f"{row.mechanism:.1f}",
            f"{_blocks(row)}, at most {row.most_blocks:.0f}",
            f"{row.cpu_s:.0f}",
        ]
        for row in rows.itertuples()
    ]
    head = ["rollers", *_HEAD, "blocks", "CPU [s]"]
    return Table(head, body, caption="Programmes of least time.")


_HEAD = (
    "tolerance [%]",
    "largest error [%]",
    "rig [km]",
    "acceleration",
    "of the mechanism",
)
_COPIES = {
    "copy": "shift, yaw and load",
    "copy_forces": "angle of attack, load and Y/Q",
}


def copies(rows):
    """Table of the copies for a pattern."""
    body = []
    for radius, own in rows.groupby("radius_mm"):
        row = own.iloc[0]
        for name, what in _COPIES.items():
            error, run = row[f"{name}_error"], row[f"{name}_km"]
            cells = [f"{100 * error:.1f}", f"{run:.0f}", f"{row.field_km / run:.1f}"]
            known = pd.notna(error)
            reason = row[f"{name}_reason"]
            body.append(
                [
                    f"{1e-3 * radius:g} m, {what}",
                    *(cells if known else ["-"] * 3),
                    "" if known else reason,
                ]
            )
    head = ["rollers, what is copied", "largest error [%]", "rig [km]", "acceleration"]
    return Table([*head, ""], body, caption="Operating points of the field copied.")


def variants(rows):
    """Table of the variants."""
    body = [
        [
            f"{row.variant}",
            f"{row.deepest_um:.0f}",
            f"{100 * row.severe_share:.0f}",
            f"{100 * row.largest_error:.1f}",
            f"{row.rig_km:.1f}",
            f"{row.acceleration:.1f}",
            f"{row.mechanism:.1f}",
            _blocks(row),
            f"{row.cpu_s:.0f}",
        ]
        for row in rows.itertuples()
    ]
    head = ["", "deepest [um]", "severe wear in the field [%]", *_HEAD[1:]]
    return Table([*head, "blocks", "CPU [s]"], body, caption="Variants.")


def failures(rows):
    """Sentences on programmes that do not exist, and on those worse than a copy."""
    sentences = []
    for row in rows.itertuples():
        name = f"{row.field_km:,.0f} km of `{FIELDS[row.field][0]}`"
        name += f", rollers of {1e-3 * row.radius_mm:g} m, {row.way}"
        if pd.notna(row.variant):
            name += f", {row.variant.removesuffix(', no guard')}"
        if pd.notna(row.fault):
            sentences.append(f"- {name}: no programme, {row.fault}.")
            continue
        for copy, what in _COPIES.items():
            error = getattr(row, f"{copy}_error")
            if error < row.largest_error:
                own = f"{100 * row.largest_error:.1f} %"
                better = f"the copy of {what} has {100 * error:.1f} %"
                sentences.append(f"- {name}: largest error {own}, {better}.")
    return ["\n".join(sentences)]


def cases():
    """Field, distance, radius, way and variant of each row."""
    found = [("given", DISTANCE, 1000.0, way, "") for way in WAYS]
    found += [
        (field, TARGETS[field], radius, way, "")
        for field in ("given", "vehicle")
        for radius in RADII
        for way in WAYS
    ]
    for variant, (field, _) in VARIANTS.items():
        distance = SHORT if field == "given" else TARGETS[field]
        way = "no guard" if "no guard" in variant else "guard 1.5"
        found.append((field, distance, 1000.0, way, variant))
    return found


def computed(file, folder, jobs):
    """Compute all rows, and write those that are done after each."""
    order, done, runs = cases(), {}, {}
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        fields = {key: pool.submit(field_result, folder, key) for key in FIELDS}
        for case in order:
            field, distance, *rest = case
            result = fields[field].result()
            choice = {} if distance == DISTANCE else COARSE
            run = pool.submit(reached, result, field, distance, *rest, choice)
            runs[run] = case
        for run in as_completed(runs):
            done[runs[run]] = run.result()
            kept = [done[case] for case in order if case in done]
            write_csv(pd.DataFrame(kept), file)


def _title(rows):
    """Sentence on the target of a table."""
    row = rows.iloc[0]
    scene = FIELDS[row["field"]][0]
    return f"Target: {row.field_km:,.0f} km of `{scene}`, {row.deepest_um:.0f} um deep."


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    more = {
        "jobs": {"type": int, "default": 1, "help": "processes (default: 1)"},
        "work": {
            "type": Path,
            "help": "folder of the field campaigns, which are kept and used again",
        },
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    file = chosen.out / "rig_design.csv"
    if not chosen.from_csv:
        with tempfile.TemporaryDirectory() as folder:
            computed(file, chosen.work or Path(folder), chosen.jobs)
    every = pd.read_csv(file, keep_default_na=False, na_values=["", "nan"])
    rows = every[every["fault"].isna()]
    plain = rows[rows["variant"].isna()]
    long = plain["field_km"] == DISTANCE
    blocks = [INTRODUCTION]
    for title, part in (
        ("## All set-points", plain[long]),
        ("## Positions given", plain[~long & (plain["field"] == "given")]),
        ("## A vehicle on its route", plain[~long & (plain["field"] == "vehicle")]),
    ):
        if len(part):
            blocks += [title, _title(part), programmes(part), copies(part)]
    varied = rows[rows["variant"].notna()]
    if len(varied):
        title = "## By force, worn rollers, severe wear, standard model"
        blocks += [title, VARIED, variants(varied)]
    blocks += ["## Where rigs fail", *failures(every)]
    blocks.append("All values: [rig_design.csv](rig_design.csv).")
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
