"""Vehicles on their routes over the life of a wheel.

Time, steps, reprofilings, jumps of the contact.

python reports/routes.py [--jobs N]              runs all campaigns: routes.csv, routes.md (about an hour)
python reports/routes.py --cases field ...       runs these campaigns; all other rows stay as they are
python reports/routes.py --distance-km 1000      runs shorter campaigns
python reports/routes.py --from-csv              writes the text from the table as it stands
"""

import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pandas as pd
from real_wheels import run, written
from writing import HERE, Table, options, write_csv, write_report

import wearsim
from wearsim.scene.overrides import Override

TITLE = "Vehicles on their routes"
DISTANCE = 200_000.0  # [km]
LIMIT = 3600.0  # CPU time at which a campaign is stopped [s]
TARGET = 300.0  # CPU time of the shipped scene [s]
FIELD = HERE.parent / "workflows" / "field.toml"
ROUTE = HERE.parent / "tests" / "data" / "fleet_route.csv"
SCENE = """\
[scene]
kind = "field"
title = "{wheel} under a {vehicle} on a route of 220 segments"

[wheelset]
profile = "{wheel}"
radius_mm = 460

[counterface]
profile = "60E1"
inclination = "1:40"

[vehicle]
file = "{vehicle}"
route = "{route}"

[vehicle.each]
environment = 0.18
shift_std_mm = 1.5

[campaign]
distance_km = 200000
smoothing_wavelength_mm = 2.5

[campaign.limits]
hollowing_mm = 2
flange_thickness_mm = 22
flange_height_mm = 36

[campaign.reprofiling]
at_limits = ["hollowing_mm", "flange_thickness_mm", "flange_height_mm"]
"""


@dataclass(frozen=True)
class Case:
    """A campaign: the shipped scene, or a vehicle with a wheel profile on the route."""

    name: str
    vehicle: str = ""
    wheel: str = ""

    def scene(self, folder):
        """Scene file of the campaign; that of a route is written into a folder."""
        if not self.vehicle:
            return FIELD
        file = folder / f"{self.name}.toml"
        text = SCENE.format(
            wheel=self.wheel, vehicle=self.vehicle, route=ROUTE.as_posix()
        )
        file.write_text(text, encoding="utf-8")
        return file


CASES = (
    Case("field"),
    Case("multiple_unit_S1002", "regional_multiple_unit", "S1002"),
    Case("multiple_unit_EPS", "regional_multiple_unit", "EPS"),
    Case("coach_S1002", "passenger_coach", "S1002"),
    Case("coach_EPS", "passenger_coach", "EPS"),
)
BY_NAME = {case.name: case for case in CASES}
COLUMNS = (
    "case",
    "distance_km",
    "end",
    "reached_km",
    "cpu_s",
    "steps",
    "rejected",
    "reprofilings",
    "share_at_jumps",
    "deepest_mm",
)
INTRODUCTION = f"""\
`field` is `workflows/field.toml` with nothing but its distance changed (target: {TARGET:g} s of CPU time).
The other campaigns run the shipped multiple unit and coach with wheels S1002 and EPS on 60E1 1:40 over the
220 segments of `tests/data/fleet_route.csv`, environment factor 0.18, and reprofile the wheels at 2 mm of
hollowing, 22 mm of flange thickness or 36 mm of flange height. CPU time is that of the whole campaign, with
the reduction of the route to classes, and of the machine that wrote this. The share at jumps is that of the
distance in operating points whose axle runs on both sides of a jump of the contact in turn.
"""


def share_at_jumps(results):
    """Share of distance in points that run on both sides of a jump of the contact."""
    distance = results["distance"].values
    if "share_beyond_jump" not in results or not distance[-1]:
        return 0.0
    at_jump = results["share_beyond_jump"].values > 0.0
    share = at_jump @ results["weight"].values
    return float(np.diff(distance) @ share[:-1] / distance[-1])


def measured(case, distance=DISTANCE, limit=LIMIT):
    """Row of a campaign, run in this process."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        out = folder / "run"
        overrides = [Override("campaign.distance_km", distance)]
        event, end, cpu = run(case.scene(folder), overrides, out, limit)
        row = {"case": case.name, "distance_km": distance, "end": end, "cpu_s": cpu}
        if event is None:
            return row
        (file,) = out.glob("*.nc")
        with wearsim.open_results(file) as results:
            reprofiled = results.get("last_reprofiling", np.zeros(1, dtype=int))
            return row | {
                "reached_km": event.distance / 1e3,
                "steps": event.step,
                "rejected": int(results["rejected_steps"].sum()),
                "reprofilings": np.count_nonzero(np.unique(reprofiled)),
                "share_at_jumps": share_at_jumps(results),
                "deepest_mm": 1e3 * float(results["max_wear_depth"].max()),
            }


def merged(rows, path):
    """Table with new rows in the place of the old ones of the same campaigns.

    In the order of `CASES`.
    """
    old = pd.read_csv(path).to_dict("records") if path.exists() else []
    by_name = {row["case"]: row for row in [*old, *rows]}
    return pd.DataFrame(
        [by_name[name] for name in BY_NAME if name in by_name], columns=COLUMNS
    )


def table_of(rows):
    """Table of the report."""
    columns = (
        ("reached [km]", "reached_km", ".6g"),
        ("CPU [s]", "cpu_s", ".0f"),
        ("steps", "steps", ".0f"),
        ("rejected", "rejected", ".0f"),
        ("reprofilings", "reprofilings", ".0f"),
        ("at jumps [%]", "share_at_jumps", ".2f"),
        ("deepest [mm]", "deepest_mm", ".3f"),
        ("end", "end", ""),
    )
    rows = rows.assign(share_at_jumps=100.0 * rows["share_at_jumps"])
    body = [
        [f"`{row['case']}`", *(written(row[name], form) for _, name, form in columns)]
        for row in rows.to_dict("records")
    ]
    return Table(["campaign", *(head for head, _, _ in columns)], body, "lrrrrrrrl")


def main(arguments=None):
    """Run the campaigns or read their rows, and write the report."""
    more = {
        "cases": {
            "nargs": "+",
            "choices": list(BY_NAME),
            "metavar": "CASE",
            "help": ", ".join(BY_NAME),
        },
        "jobs": {
            "type": int,
            "default": 1,
            "metavar": "N",
            "help": "campaigns at a time (default: 1)",
        },
        "distance-km": {
            "type": float,
            "default": DISTANCE,
            "metavar": "KM",
            "help": "to run",
        },
        "limit": {
            "type": float,
            "default": LIMIT,
            "metavar": "S",
            "help": "CPU time of a campaign [s]",
        },
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    file = chosen.out / "routes.csv"
    if not chosen.from_csv:
        with ProcessPoolExecutor(chosen.jobs, mp_context=get_context("spawn")) as pool:
            tasks = [
                pool.submit(measured, BY_NAME[name], chosen.distance_km, chosen.limit)
                for name in chosen.cases or BY_NAME
            ]
            for task in as_completed(tasks):
                write_csv(merged([task.result()], file), file)
    blocks = [
        INTRODUCTION,
        table_of(pd.read_csv(file)),
        "All values: [routes.csv](routes.csv).",
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
