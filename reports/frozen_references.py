"""References by the half-space pair, once.

Contacts on cells without end, campaigns at ten places.

    python reports/frozen_references.py [--out DIR] [--contacts] [--cases N ...]
    [--seconds S]

writes reference_contacts.csv, reference_campaigns.csv, reference_depths.csv and
reference_rows.csv. What stands in them is not computed again, so that a run may be
broken off and begun again; it takes hours of one core. With --contacts contacts alone,
with --cases these campaigns alone; begins none after S seconds.
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from contact_accuracy import wheel_sums
from made_up_campaigns import (
    CASES,
    PLACES,
    WORN,
    depth_of,
    distance_of,
    is_worn,
    load_kernels,
    places_of,
    run,
    scene,
    setup_of,
    with_pair,
)
from real_wheels import kernel_time
from writing import options, write_csv

import wearsim
from wearsim.errors import WearsimError

CONTACTS = 100
SEED = 42, 2
GRIDS = 50, 100
"""Cells along and across from which values are extrapolated: errors are of first order
in their size.
"""
PIECES = 40
"""Pieces of the wheel's profile with the strip work."""
KINDS = "rail", "roller", "measured", "hollow"
FIELDS = "force_x", "force_y", "power", "max_pressure", "area"

CELLS = 30, 60
"""Of campaigns, the second ones as far as there is time."""
FIRST = 18, 36, 15, 27
"""Campaigns with KTH's map whose difference between both grids is asked for."""
SAMPLES = 61
"""Places of the depth over the worn band of a wheel."""
WITH_ROWS = PLACES // 2, PLACES
"""Places with a table of the operating points, from 1 on."""


def main(arguments=None):
    """Compute what is not there."""
    more = {
        "contacts": {"action": "store_true", "help": "contacts alone"},
        "cases": {
            "nargs": "+",
            "type": int,
            "metavar": "N",
            "help": f"campaigns alone, 0 to {CASES - 1}",
        },
        "seconds": {
            "type": float,
            "default": np.inf,
            "metavar": "S",
            "help": "begin nothing after that",
        },
    }
    chosen = options(__file__, __doc__, arguments, more=more)
    end = time.monotonic() + chosen.seconds
    if chosen.cases is None:
        freeze_contacts(chosen.out, end)
    if not chosen.contacts:
        freeze_campaigns(chosen.out, chosen.cases, end)


# ----------------------------------------------------------------------------- contacts


def contact(number):
    """Describe a contact by its number: wheel, counterface and pose."""
    random = np.random.default_rng([*SEED, number])
    kind = KINDS[number % len(KINDS)]
    root = number // len(KINDS) % 3 == 0  # a third of them in or near the flange root
    roller = kind == "roller" or (kind in KINDS[2:] and random.random() < 0.4)
    case = {
        "contact": number,
        "kind": kind,
        "wheel": str(random.choice(["S1002", "EPS", "P8", "1in40"])),
        "wear_y": 0.0,
        "wear_width": 0.0,
        "wear_depth": 0.0,
        "rail": str(random.choice(["60E1", "54E1", "60E2"])),
        "inclination": str(random.choice(["1:20", "1:40"])),
        "curvature": 1.0 / 10.0 ** random.uniform(-0.4, 0.6) if roller else 0.0,
        "shift": 1e-3
        * (random.uniform(4.0, 6.5) if root else random.uniform(-5.0, 4.0)),
        "yaw": 1e-3 * random.uniform(-6.0, 6.0),
        "wheel_load": 1e3 * random.uniform(40.0, 110.0),
        "friction": random.uniform(0.1, 0.5),
    }
    if kind == "measured":
        case["wheel"] = str(
            random.choice(["wheel_worn_right.whl", "wheel_worn_left.whl"])
        )
    if kind == "hollow":  # in the root of the flange or on the tread
        at, width, depth = (
            (-36.0, 5.0, 0.8) if root else (random.uniform(-15.0, 10.0), 14.0, 1.5)
        )
        case |= {
            "wear_y": 1e-3 * at,
            "wear_width": 1e-3 * width * random.uniform(0.7, 1.4),
        }
        case |= {"wear_depth": 1e-3 * depth * random.uniform(0.2, 1.0)}
    rounded = {k: float(f"{v:.6g}") for k, v in case.items() if isinstance(v, float)}
    return case | rounded


def wheelset_of(case):
    """Wheelset of a contact; a made-up hollow is a bell."""
    if case["kind"] == "measured":
        return wearsim.wheelset(
            str(WORN / case["wheel"]), radius=0.46, back_to_back=1.36
        )
    wheel = wearsim.standard_profile(case["wheel"])
    if case["kind"] == "hollow":
        bell = np.exp(
            -0.5 * ((wheel.y - case["wear_y"]) / (0.5 * case["wear_width"])) ** 2
        )
        wheel = replace(wheel, z=wheel.z - case["wear_depth"] * bell)
    return wearsim.wheelset(wheel, radius=0.46, back_to_back=1.36)


def contact_sums(case, normal, tangential, cells):
    """Solve the right wheel of a contact by a pair of models on cells.

    See `wheel_sums`.
    """
    inclination = 1.0 / float(case["inclination"].partition(":")[2])
    rail = wearsim.standard_profile(case["rail"], inclination=inclination, gauge=1.435)
    motion = {
        name: np.atleast_1d(case[name])
        for name in ("shift", "yaw", "wheel_load", "friction")
    }
    solution = wearsim.solve_contact(
        wheelset_of(case),
        wearsim.Counterface(rail, case["curvature"]),
        wearsim.ContactConditions.of(**motion, speed=20.0, rotation="nominal"),
        wearsim.ContactModels(normal, tangential, cells, cells, most_cells=cells),
        sides=("right",),
        fields=True,
    )
    return wheel_sums(solution)[0]


def frozen_contact(number):
    """Row of a contact.

    Values extrapolated to cells without size, and the change from 50 to 100.
    """
    row = contact(number)
    began = time.process_time()
    try:
        coarse, fine = (
            contact_sums(row, "half_space", "half_space", cells) for cells in GRIDS
        )
    except WearsimError as error:
        return row | {"fault": str(error)}
    row |= {name: 2.0 * getattr(fine, name) - getattr(coarse, name) for name in FIELDS}
    row |= {"patches": fine.patches, "slip_share": fine.slip_share}
    ends = np.concatenate(
        [one.strip_edges[:, [0, -1]].ravel() for one in (coarse, fine)]
    )
    y = np.linspace(ends.min(), ends.max(), PIECES + 1)
    work = [np.diff(one.work_up_to(y)) for one in (coarse, fine)]
    row |= {
        "power_change": fine.power / coarse.power - 1.0 if coarse.power > 0.0 else 0.0
    }
    row |= {"y_first": y[0], "y_last": y[-1], "seconds": time.process_time() - began}
    row |= {
        f"work_{k + 1}": value
        for k, value in enumerate(np.maximum(2.0 * work[1] - work[0], 0.0))
    }
    return row | {"fault": ""}


def errors_of_contact(row, normal, tangential, cells):
    """Errors of a pair of models in a contact of the table [%].

    Force over friction times load.
    """
    ours = contact_sums(contact(row["contact"]), normal, tangential, cells)
    y = np.linspace(row["y_first"], row["y_last"], PIECES + 1)
    work, theirs = (
        np.diff(ours.work_up_to(y)),
        np.array([row[f"work_{k + 1}"] for k in range(PIECES)]),
    )
    force = np.hypot(ours.force_x - row["force_x"], ours.force_y - row["force_y"])
    errors = {"force": force / (row["friction"] * row["wheel_load"])}
    errors |= {name: getattr(ours, name) / row[name] - 1.0 for name in FIELDS[2:]}
    errors["strip_work"] = np.abs(work - theirs).sum() / theirs.sum()
    return {name: 100.0 * abs(error) for name, error in errors.items()}


def read_contacts(folder):
    """Table of the contacts; none of the names of rails is a number."""
    table = pd.read_csv(
        folder / "reference_contacts.csv", dtype={"rail": str, "fault": str}
    )
    return table.fillna({"fault": ""})


def freeze_contacts(folder, end):
    """Contacts drawn one after the other, those without solution too, until enough."""
    path = folder / "reference_contacts.csv"
    table = read_contacts(folder) if path.exists() else pd.DataFrame()
    number = len(table)
    while time.monotonic() < end and (
        len(table) == 0 or table["power"].notna().sum() < CONTACTS
    ):
        table = pd.concat(
            [table, pd.DataFrame([frozen_contact(number)])], ignore_index=True
        )
        write_csv(table, path)
        sys.stderr.write(f"contact {number}\n")
        number += 1


# ---------------------------------------------------------------------------- campaigns


def order():
    """Cases and cells: every kind early, those of `FIRST` on both grids."""
    kinds = {}
    for number in range(CASES):
        law = "archard" if 'law = "archard"' in scene(number) else "usfd"
        kinds.setdefault((number % 2, law, is_worn(number)), []).append(number)
    turns = [
        case
        for turn in range(CASES)
        for group in kinds.values()
        for case in group[turn : turn + 1]
    ]
    rest = [case for case in turns if case not in FIRST]
    coarse, fine = CELLS
    begin = [(case, coarse) for case in (*FIRST, *rest[: len(kinds)])] + [
        (case, fine) for case in FIRST
    ]
    return [
        *begin,
        *((case, coarse) for case in rest[len(kinds) :]),
        *((case, fine) for case in rest),
    ]


def freeze_campaigns(out, cases, end):
    """Campaigns that are not in the tables yet."""
    paths = {
        name: out / f"reference_{name}.csv" for name in ("campaigns", "depths", "rows")
    }
    tables = {
        name: pd.read_csv(path) if path.exists() else pd.DataFrame()
        for name, path in paths.items()
    }
    for number, cells in order():
        known = tables["campaigns"]
        done = (
            not known.empty
            and ((known["case"] == number) & (known["cells"] == cells)).any()
        )
        if done or time.monotonic() >= end or not (cases is None or number in cases):
            continue
        distance = None
        if not known.empty and (known["case"] == number).any():
            distance = 1e3 * float(
                known.loc[known["case"] == number, "distance_km"].iloc[0]
            )
        with tempfile.TemporaryDirectory() as folder:
            found = frozen_campaign(
                number, cells, distance, tables["depths"], Path(folder)
            )
        for name, table in found.items():
            tables[name] = pd.concat([tables[name], table], ignore_index=True)
            tables[name] = tables[name].sort_values(["case", "cells"], kind="stable")
            write_csv(
                tables[name], paths[name], "%.4g" if name != "campaigns" else "%.7g"
            )
        sys.stderr.write(f"{found['campaigns'].iloc[0].to_dict()}\n")


def frozen_campaign(number, cells, distance, known, folder):
    """Tables of a campaign by the half-space pair.

    What it is, its depths, its operating points.

    Depths are taken where they are in the table `known`, of another grid.
    """
    setup = setup_of(number, folder)
    head = {
        "case": number,
        "cells": cells,
        "kind": setup.kind,
        "wheel": setup.wheelset.right.name.split("/")[-1],
    }
    head |= {
        "law": setup.wear.law,
        "points": len(setup.points.label),
        "depth_um": depth_of(number),
    }
    pair = with_pair(setup, "accurate", strips=cells, cells=cells, most_cells=cells)
    nothing = pd.DataFrame()
    try:
        if distance is None:
            distance = distance_of(setup, number)
        head |= {"distance_km": 1e-3 * distance}
        load_kernels(pair)
        kernel = kernel_time()
        course = run(pair, places_of(setup, distance))
        kernel = min(kernel, kernel_time())
    except WearsimError as error:
        return {
            "campaigns": pd.DataFrame([head | {"fault": str(error)}]),
            "depths": nothing,
            "rows": nothing,
        }
    last = course.stops[-1].state
    head |= {
        "steps": last.step,
        "deepest_um": 1e6 * last.wear_depth.max(),
        "seconds": course.seconds,
    }
    head |= {"kernel_ns": kernel, "fault": ""}
    same = {"case": number, "cells": cells}
    return {
        "campaigns": pd.DataFrame([head]),
        "depths": pd.DataFrame(
            [same | row for row in depth_rows(course, bands_of(course, number, known))]
        ),
        "rows": pd.DataFrame([same | row for row in point_rows(course)]),
    }


def bands_of(course, number, known):
    """Find the worn band of each wheel, to 0.01 mm.

    That in the table of depths, or as worn [mm].
    """
    if not known.empty and (mine := known[known["case"] == number]).size:
        ends = mine.drop_duplicates("side").set_index("side")[
            ["y_first_mm", "y_last_mm"]
        ]
        return [tuple(ends.loc[side]) for side in (0, 1)]
    worn = course.stops[-1].state.wear_depth
    bands = []
    for side in (0, 1):
        band = course.y[side][worn[side] > 1e-3 * worn.max()]
        bands.append(
            (round(1e3 * band.min(), 2), round(1e3 * band.max(), 2))
            if band.size
            else (0.0, 0.0)
        )
    return bands


def depth_rows(course, bands):
    """Depths over the worn band of each wheel at each place [um]."""
    rows = []
    for side, (first, last) in enumerate(bands):
        y = 1e-3 * np.linspace(first, last, SAMPLES)
        for place, stop in enumerate(course.stops, 1):
            depth = 1e6 * np.interp(y, course.y[side], stop.state.wear_depth[side])
            row = {
                "place": place,
                "distance_km": 1e-3 * stop.state.distance,
                "side": side,
            }
            row |= {"y_first_mm": first, "y_last_mm": last}
            rows.append(row | {f"d{k + 1}": value for k, value in enumerate(depth)})
    return rows


def point_rows(course):
    """Power, largest pressure, area of the wheels of all points at some places."""
    rows = []
    for place in sorted({min(place, len(course.stops)) for place in WITH_ROWS}):
        contact = course.stops[place - 1].evaluation.passage.contact
        wheel = 2 * contact.point + contact.side
        for one in np.unique(wheel):
            mine = wheel == one
            rows.append(
                {
                    "place": place,
                    "point": one // 2,
                    "side": one % 2,
                    "power_W": contact.power[mine].sum(),
                    "pressure_MPa": 1e-6 * contact.max_pressure[mine].max(),
                    "area_mm2": 1e6 * contact.area[mine].sum(),
                }
            )
    return rows


if __name__ == "__main__":
    main()
