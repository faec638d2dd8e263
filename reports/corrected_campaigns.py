"""Depth worn with `model = "auto"` against a half-space at every point, on campaigns made up by seeds.

python reports/corrected_campaigns.py                    runs all: corrected_campaigns.csv and .md (an hour)
python reports/corrected_campaigns.py --cases 3 17       runs these; all other rows stay as they are
python reports/corrected_campaigns.py --from-csv         writes the text from the table as it stands
"""

import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from writing import HERE, Table, options, write_csv, write_report

from wearsim.campaign.correction import estimated_error
from wearsim.errors import WearsimError
from wearsim.scene import build, load_campaign
from wearsim.studies.chart import run_short

TITLE = "Accuracy of corrected fast models over campaigns"
CASES = 40
TOLERANCE = 0.03
DEPTHS = (30.0, 60.0, 120.0)  # largest depth at the end [um]
FINER = 10.0  # times smaller error of the steps of the campaign with which all others are compared
WORN = HERE.parent / "tests" / "data" / "real_wheels"
COLUMNS = (
    "case", "kind", "wheel", "points", "deepest_um", "distance_km", "fast_percent", "accurate_percent",
    "auto_percent", "largest_percent", "estimate_percent", "steps_accurate", "steps_auto", "solved_accurate",
    "solved_auto", "cpu_ratio", "fault",
)  # fmt: skip
INTRODUCTION = f"""\
{CASES} campaigns made up by seeds: wheels S1002, EPS, P8, 1in40 and a pair worn in service, on rails
and rollers of 0.4 to 4 m, loads of 50 to 110 kN, friction 0.1 to 0.5, law `usfd` and Archard's. Each is
run with `model = "auto"` at a tolerance of {100 * TOLERANCE:g} %, with a half-space at every operating point
in every stage (`model = "accurate"`) and with the fast model alone over the same distance. They are compared
with the half-space at every point in steps whose error is {FINER:g} times smaller: in programmes of blocks,
where one step may be a whole loop, `accurate` itself is off by its steps. Differences are the largest along
both profiles at the end, over the largest depth; the largest one is that at any of ten places of the
distance, over the largest depth there. In programmes these places are the ends of steps that both campaigns
have: between them one may be in another block than the other, or halfway through a step over a whole loop,
and depths interpolated there differ whatever the contact. Solved are operating points with the half-space,
in steps that were kept. Times are CPU times with all kernels loaded.
"""


def scene(number: int) -> str:
    """Text of a scene: any wheel and rail, on a roller or in the field, around some mean shift."""
    random = np.random.default_rng([2026, 11, number])
    kind = ("rig", "field")[number % 2]
    worn = number % 5 == 4
    wheel = "wheel_worn_right.whl" if worn else str(random.choice(["S1002", "EPS", "P8", "1in40"]))
    profile = (
        f'profile = "{WORN / wheel}"\nprofile_left = "{WORN / "wheel_worn_left.whl"}"'
        if worn
        else (f'profile = "{wheel}"')
    )
    radius = 460.0 if worn else random.uniform(350.0, 500.0)
    text = f"""[scene]
kind = "{kind}"
[wheelset]
{profile}
radius_mm = {radius:.0f}
[counterface]
profile = "{random.choice(["60E1", "54E1", "60E2"])}"
inclination = "{random.choice(["1:20", "1:40"])}"
gauge_mm = {random.uniform(1433.0, 1438.0):.0f}
"""
    if kind == "rig":
        text += f"roller_radius_mm = {10.0 ** random.uniform(2.6, 3.6):.0f}\n"
    text += f"""[contact]
model = "accurate"
[wear]
law = "{random.choice(["usfd", "archard"])}"
[campaign]
distance_km = 1e6
"""
    running = (_blocks if kind == "rig" else _classes)(random)
    return text + running


def _blocks(random: np.random.Generator) -> str:
    text = ""
    for point in range(int(random.integers(1, 7))):
        side = random.choice([-1.0, 1.0])
        text += f"""[[operation.block]]
name = "{point}"
shift_mm = {side * random.uniform(0.0, 4.5):.3f}
yaw_mrad = {side * random.uniform(0.0, 3.0):.3f}
load_kN = {random.uniform(50.0, 110.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
distance_km = {random.uniform(0.5, 4.0):.1f}
"""
    return text


def _classes(random: np.random.Generator) -> str:
    text = ""
    for name, side, share in (("tangent", 0.0, 0.5), ("right", -1.0, 0.3), ("left", 1.0, 0.2)):
        out = side * random.uniform(1.0, 3.5)
        text += f"""[[operation.class]]
name = "{name}"
shift_mean_mm = {out:.3f}
shift_std_mm = {min(random.uniform(0.4, 1.5), (5.0 - abs(out)) / 3.0):.3f}
positions = {int(random.integers(10, 13)) if side == 0.0 else 10}
yaw_mrad = {side * random.uniform(0.0, 2.0):.3f}
{f"curve_radius_m = {-side * 10.0 ** random.uniform(2.6, 3.5):.0f}" if side else ""}
load_kN = {random.uniform(50.0, 110.0):.1f}
speed_km_h = 72
friction = {random.uniform(0.1, 0.5):.2f}
share = {share}
"""
    return text


def outcome(number: int, folder) -> dict[str, object]:
    """Row of the table."""
    path = folder / f"case{number}.toml"
    path.write_text(scene(number))
    setup = build(load_campaign(path))
    deepest = DEPTHS[number % len(DEPTHS)]
    row = {"case": number, "kind": setup.kind, "wheel": setup.wheelset.right.name.split("/")[-1]}
    row |= {"points": len(setup.points.label), "fault": ""}
    fine = replace(setup.control, error_tolerance=setup.control.error_tolerance / FINER)
    given = path.read_text()
    text = {
        "accurate": given,
        "auto": given.replace('model = "accurate"', f'model = "auto"\ntolerance = {TOLERANCE}'),
        "fast": given.replace('model = "accurate"', 'normal = "kik_piotrowski"\ntangential = "fastsim"'),
    }
    setups = {}
    for name, one in text.items():
        path.write_text(one)
        setups[name] = build(load_campaign(path))
    try:
        run_short(setups["auto"], 1e-9)  # loads what is compiled: not part of the times
        true = run_short(replace(setup, control=fine), 1e-6 * deepest)
    except WearsimError as error:
        return row | {"fault": str(error)}
    state = true.state
    row |= {"deepest_um": 1e6 * state.wear_depth.max(), "distance_km": 1e-3 * state.distance}
    control = replace(setup.control, distance=state.distance)
    seconds = np.nan
    for name, one in setups.items():
        try:
            ours = run_short(replace(one, control=control))
        except WearsimError as error:
            row["fault"] += f"{name}: {error} "
            continue
        difference = np.abs(ours.depth[-1] - true.depth[-1]).max()
        row[f"{name}_percent"] = 100.0 * float(difference / true.depth[-1].max())
        end = ours.state
        if name == "accurate":
            row |= {"steps_accurate": end.step, "solved_accurate": ours.solved}
            seconds = ours.seconds
        if name == "auto":
            differences, depths = ours.differences(true)
            row["largest_percent"] = 100.0 * float((differences / depths).max())
            row["estimate_percent"] = 100.0 * estimated_error(end)
            row |= {"steps_auto": end.step, "solved_auto": end.correction.solved}
            row["cpu_ratio"] = seconds / ours.seconds
    return row


def report(table: pd.DataFrame, out) -> None:
    """Write the text."""
    done = table[table["auto_percent"].notna()]
    kept = int((done["auto_percent"] <= 100 * TOLERANCE).sum())
    shown = [
        "case", "kind", "wheel", "points", "deepest_um", "fast_percent", "accurate_percent", "auto_percent",
        "largest_percent",
        "estimate_percent", "solved_accurate", "solved_auto", "cpu_ratio",
    ]  # fmt: skip
    rows = [["" if pd.isna(value) else f"{value:.3g}" if isinstance(value, float) else str(value)
             for value in row] for row in done[shown].itertuples(index=False)]  # fmt: skip
    summary = [
        f"Within {100 * TOLERANCE:g} % at the end: {kept} of {len(done)} campaigns; largest difference "
        f"{done['auto_percent'].max():.2g} %, median {done['auto_percent'].median():.2g} %. The fast model "
        f"alone: largest {done['fast_percent'].max():.3g} %, median {done['fast_percent'].median():.2g} %. "
        f"`accurate` by its steps: largest {done['accurate_percent'].max():.2g} %, median "
        f"{done['accurate_percent'].median():.2g} %. During the campaign `auto` differs by at most "
        f"{done['largest_percent'].max():.2g} %. "
        f"Time of the half-space at every point over that of `auto`: median "
        f"{done['cpu_ratio'].median():.2g}.",
        *(f"Case {int(row.case)} has no result: {row.fault}" for row in table.itertuples() if row.fault),
    ]
    head = ["case", "kind", "wheel", "points", "deepest [µm]", "fast alone [%]", "accurate [%]", "auto [%]",
            "largest [%]", "estimate [%]", "solved, accurate", "solved, auto", "CPU ratio"]  # fmt: skip
    values = "All values: [corrected_campaigns.csv](corrected_campaigns.csv)."
    write_report(out, __file__, TITLE, [INTRODUCTION, *summary, Table(head, rows), values])


def main(arguments=None):
    """Run the cases and write the report."""
    more = {
        "cases": {"nargs": "+", "type": int, "metavar": "N", "help": f"0 to {CASES - 1} (default: all)"},
        "jobs": {"type": int, "default": 1, "metavar": "N", "help": "cases at a time (default: 1)"},
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    values = chosen.out / "corrected_campaigns.csv"
    table = pd.read_csv(values) if values.exists() else pd.DataFrame(columns=COLUMNS)
    wanted = [] if chosen.from_csv else range(CASES) if chosen.cases is None else chosen.cases
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(chosen.jobs) as pool:
        for row in pool.map(outcome, wanted, [Path(folder)] * len(wanted)):
            sys.stderr.write(f"{row}\n")
            table = pd.concat([table[table["case"] != row["case"]], pd.DataFrame([row])])
            write_csv(table.reindex(columns=COLUMNS).sort_values("case"), values)
    report(pd.read_csv(values, dtype={"fault": str}).fillna({"fault": ""}), chosen.out)


if __name__ == "__main__":
    main()
