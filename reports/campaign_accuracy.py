"""Fast models over whole campaigns against the frozen half-space.

Depth, power, pressure, area, time.

    python reports/campaign_accuracy.py [--out DIR] [--cases N ...] [--from-csv]

runs `fast` and `standard` on the campaigns that frozen_references.py has finished, and
writes campaign_accuracy.csv and .md; an hour of one core for all. With --cases N ...
these alone, all other rows stay as they are; with --from-csv the text alone, from the
tables as they stand.
"""

import sys
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from frozen_references import (
    KINDS,
    SAMPLES,
    contact,
    errors_of_contact,
    point_rows,
    read_contacts,
    wheelset_of,
)
from made_up_campaigns import (
    CASES,
    FINER,
    load_kernels,
    places_of,
    run,
    setup_of,
    with_pair,
)
from real_wheels import kernel_time
from writing import HERE, Table, options, write_csv, write_report

import wearsim
from wearsim.contact.problem import PAIRS as MODELS
from wearsim.contact.solve import solve
from wearsim.damage.wear import WEAR_LAWS, WearSettings, passage_depth
from wearsim.errors import WearsimError

TITLE = "Accuracy of the contact models over campaigns"
PAIRS = "fast", "standard"
QUANTITIES = {
    "power_W": ("power", 3.0),
    "pressure_MPa": ("pressure", 4.0),
    "area_mm2": ("area", 3.0),
}
"""Columns of the operating points, their names and the errors half of them are to keep
within [%].
"""
MOST = 6.0
"""Error that nine tenths of the operating points are to keep within [%]."""
LAWS = {"usfd": "USFD", "archard": "KTH"}

INTRODUCTION = f"""\
Campaigns made up by seeds (`made_up_campaigns.py`): wheels S1002, EPS, P8, 1in40 and a pair worn in service,
on rails and rollers of 0.4 to 4 m, loads of 50 to 110 kN, friction 0.1 to 0.5, laws `usfd` and `archard`. The
reference is the half-space pair on 30 x 30 cells at every operating point and in every stage
(`frozen_references.py`); `fast` and `standard` run on their own grids over the same distance, to the same
places, all in steps with {FINER:g} times less error than a scene asks for: what differs are the models.

Differences of depth are the largest along both profiles, over the largest depth: at the end, and the largest
of ten places on the way (loops or blocks in programmes). Errors of power, largest pressure and area are those
of the wheels of all operating points, halfway and at the end, each on the profiles of its own model. Times
are CPU times over the time of the FASTSIM kernel in the same run, over those of the reference.
"""


def compared(number, pair, references):
    """Row of a case, a pair of models against frozen half-space on 30 x 30 cells."""
    campaigns, depths, points = (
        table[(table["case"] == number) & (table["cells"] == 30)]
        for table in references
    )
    (truth,) = campaigns.to_dict("records")
    row = {"case": number, "pair": pair} | {
        name: truth[name] for name in ("kind", "law", "wheel", "points")
    }
    with tempfile.TemporaryDirectory() as folder:
        setup = with_pair(setup_of(number, Path(folder)), pair)
    try:
        load_kernels(setup)
        kernel = kernel_time()
        course = run(setup, places_of(setup, 1e3 * truth["distance_km"]))
        kernel = min(kernel, kernel_time())
    except WearsimError as error:
        return row | {"fault": str(error)}
    ends = differences(course, depths)
    row |= {"steps": course.stops[-1].state.step, "deepest_um": truth["deepest_um"]}
    row |= {"end_percent": ends[-1], "largest_percent": ends.max()}
    row |= errors_of_points(pd.DataFrame(point_rows(course)), points)
    ratio = course.seconds / kernel / (truth["seconds"] / truth["kernel_ns"])
    return row | {
        "seconds": course.seconds,
        "kernel_ns": kernel,
        "cpu_ratio": ratio,
        "fault": "",
    }


def differences(course, depths):
    """Largest difference of depth at each place over the largest depth there [%]."""
    samples = [f"d{k + 1}" for k in range(SAMPLES)]
    share = np.linspace(0.0, 1.0, SAMPLES)
    found = []
    for place, stop in enumerate(course.stops, 1):
        here = depths[depths["place"] == place].sort_values("side")
        worst = 0.0
        for line in here.to_dict("records"):
            side = int(line["side"])
            y = 1e-3 * (
                line["y_first_mm"] + share * (line["y_last_mm"] - line["y_first_mm"])
            )
            ours = 1e6 * np.interp(y, course.y[side], stop.state.wear_depth[side])
            worst = max(worst, np.abs(ours - [line[name] for name in samples]).max())
        found.append(100.0 * worst / here[samples].to_numpy().max())
    return np.array(found)


def errors_of_points(ours, theirs):
    """Medians of the errors of operating points [%], their number.

    How many keep within the limits.
    """
    both = theirs.merge(ours, on=["place", "point", "side"], suffixes=("", "_ours"))
    row = {"compared": len(both)}
    for column, (name, half) in QUANTITIES.items():
        error = 100.0 * (both[f"{column}_ours"] / both[column] - 1.0)
        row[f"{name}_percent"] = error.median()
        row[f"{name}_within_half"] = int((error.abs() <= half).sum())
        row[f"{name}_within_most"] = int((error.abs() <= MOST).sum())
    return row


def grids(references):
    """Differences of depth between 30 and 60 cells [%], of the campaigns with both."""
    campaigns, depths, _ = references
    samples = [f"d{k + 1}" for k in range(SAMPLES)]
    rows = []
    for number in sorted(
        set(
            campaigns.loc[
                (campaigns["cells"] == 60) & campaigns["fault"].eq(""), "case"
            ]
        )
    ):
        (case,) = campaigns[
            (campaigns["case"] == number) & (campaigns["cells"] == 30)
        ].to_dict("records")
        coarse, fine = (
            depths[(depths["case"] == number) & (depths["cells"] == n)]
            for n in (30, 60)
        )
        found = []
        for place in sorted(fine["place"].unique()):
            here = [
                part[part["place"] == place].sort_values("side")
                for part in (coarse, fine)
            ]
            ours, theirs = (part[samples].to_numpy() for part in here)
            found.append(100.0 * np.abs(ours - theirs).max() / theirs.max())
        rows.append(
            {
                "case": number,
                "kind": case["kind"],
                "law": case["law"],
                "end": found[-1],
                "most": max(found),
            }
        )
    return rows


def of_contacts(folder):
    """Errors of pairs of models in the frozen contacts [%].

    Median, 90 % and 97 % quantile.
    """
    table = read_contacts(folder).to_dict("records")
    rows = []
    for name, pair in [
        *((pair, MODELS[pair]) for pair in PAIRS),
        ("accurate", MODELS["accurate"]),
    ]:
        errors = pd.DataFrame([errors_of_contact(row, *pair, 30) for row in table])
        quantiles = errors.quantile([0.5, 0.9, 0.97])
        rows.append(
            [
                f"`{name}`",
                *(" · ".join(f"{v:.2f}" for v in quantiles[one]) for one in errors),
            ]
        )
    return rows


def by_slip():
    """Change of the volume worn for 1 % more slip [%].

    Median and largest of the frozen contacts, by law.
    """
    rows = []
    for name in sorted(WEAR_LAWS):
        law = WEAR_LAWS[name]
        if not law.wears or law.coefficients is None:
            continue
        for form in law.forms:
            settings = WearSettings(law=name, coefficients=law.coefficients, form=form)
            change = [_change(solution, settings) for solution in _contacts()]
            change = np.array([one for one in change if np.isfinite(one)])
            rows.append(
                [
                    f"`{name}`",
                    f"`{form}`",
                    f"{np.median(change):.2f}",
                    f"{change.max():.2f}",
                ]
            )
    return rows


@cache
def _contacts():
    """Solutions by `standard` of the first frozen contacts of each kind."""
    known = []
    for number in range(10 * len(KINDS)):
        case = contact(number)
        inclination = 1.0 / float(case["inclination"].partition(":")[2])
        rail = wearsim.standard_profile(
            case["rail"], inclination=inclination, gauge=1.435
        )
        motion = {
            name: np.atleast_1d(case[name])
            for name in ("shift", "yaw", "wheel_load", "friction")
        }
        conditions = wearsim.ContactConditions.of(
            **motion, speed=20.0, rotation="nominal"
        )
        try:
            known.append(
                solve(
                    conditions,
                    wheelset_of(case),
                    wearsim.Counterface(rail, case["curvature"]),
                    wearsim.ContactModels.of("standard"),
                    sides=(0,),
                )
            )
        except WearsimError:
            continue
    return known


def _change(solution, settings):
    """Change of the volume worn for 1 % more slip of a contact [%]."""
    fields = solution.fields
    more = replace(
        fields,
        slip_x=1.01 * fields.slip_x,
        slip_y=1.01 * fields.slip_y,
        work_density=1.01 * fields.work_density,
    )
    before, after = (
        float(
            (
                passage_depth(one, solution.area, settings).sum(axis=0)
                * fields.strip_width[:, None]
            ).sum()
        )
        for one in (fields, more)
    )
    return 100.0 * (after / before - 1.0) if before > 0.0 else np.nan


def summary(table, pair, law):
    """Campaigns of a law in 3, 4 and 6 %, and median and largest differences [%]."""
    part = table[
        (table["pair"] == pair) & (table["law"] == law) & table["end_percent"].notna()
    ]
    cells = [f"`{pair}`", LAWS[law], str(len(part))]
    for column in ("end_percent", "largest_percent"):
        values = part[column]
        cells.append(f"{values.median():.2g} · {values.max():.2g}")
        cells += [f"{int((values <= limit).sum())}" for limit in (3.0, 4.0, 6.0)]
    return cells


def of_points(table, pair):
    """Shares of points within the limits of each quantity [%], over all campaigns."""
    part = table[(table["pair"] == pair) & table["compared"].notna()]
    total = part["compared"].sum()
    cells = [f"`{pair}`", f"{total:.0f}"]
    for name, _ in QUANTITIES.values():
        cells += [
            f"{100.0 * part[f'{name}_within_{which}'].sum() / total:.0f}"
            for which in ("half", "most")
        ]
    return cells


def report(table, references, contacts, slip):
    """Blocks of the text."""
    campaigns = references[0]
    done = {
        n: int((campaigns["cells"].eq(n) & campaigns["fault"].eq("")).sum())
        for n in (30, 60)
    }
    blocks = [
        INTRODUCTION,
        (
            f"The reference has {done[30]} of {CASES} campaigns on 30 x 30 cells, "
            f"{done[60]} on 60 x 60, too."
        ),
        "## Depth",
        Table(
            [
                "pair",
                "law",
                "campaigns",
                "end: median · most [%]",
                "≤ 3 %",
                "≤ 4 %",
                "≤ 6 %",
                "on the way: median · most [%]",
                "≤ 3 %",
                "≤ 4 %",
                "≤ 6 %",
            ],
            [summary(table, pair, law) for pair in PAIRS for law in LAWS],
        ),
        "## Power, largest pressure and area",
        Table(
            [
                "pair",
                "wheels",
                *(
                    f"{name}: {text}"
                    for name, half in QUANTITIES.values()
                    for text in (f"≤ {half:g} % [%]", f"≤ {MOST:g} % [%]")
                ),
            ],
            [of_points(table, pair) for pair in PAIRS],
            caption="Share of the wheels of operating points within a limit",
        ),
        "## Time",
        Table(
            ["pair", "rigs: median", "fields: median"],
            [
                [
                    f"`{pair}`",
                    *(
                        f"{ratios_of(table, pair, kind).median():.3f}"
                        for kind in ("rig", "field")
                    ),
                ]
                for pair in PAIRS
            ],
            caption=(
                "CPU time over that of the half-space pair, each in units of the "
                "FASTSIM kernel"
            ),
        ),
        "## The reference on 30 x 30 against 60 x 60 cells",
        Table(
            ["case", "kind", "law", "end [%]", "on the way [%]"],
            [
                [
                    str(row["case"]),
                    row["kind"],
                    LAWS[row["law"]],
                    f"{row['end']:.2f}",
                    f"{row['most']:.2f}",
                ]
                for row in grids(references)
            ],
        ),
        "## Single contacts",
        "Errors on 30 x 30 cells against the half-space pair extrapolated from 50 x "
        "50 and 100 x 100 cells: those of 100 contacts drawn by a seed, half of them "
        "of worn wheels. Median · 90 % · 97 % quantile.",
        Table(
            [
                "pair",
                "force over limit [%]",
                "power [%]",
                "max. pressure [%]",
                "area [%]",
                "strip work [%]",
            ],
            contacts,
        ),
        "## Wear for 1 % more slip",
        "Change of the volume worn if the slip of all cells were 1 % larger, of "
        "contacts of the frozen table by `standard`: how far a law magnifies what is "
        "not known of the slip.",
        Table(["law", "form", "median [%]", "most [%]"], slip, align="llrr"),
        "## Campaigns",
        Table(
            [
                "case",
                "kind",
                "law",
                "wheel",
                "pair",
                "deepest [µm]",
                "end [%]",
                "on the way [%]",
                "power [%]",
                "pressure [%]",
                "area [%]",
                "CPU",
            ],
            [_line(row) for row in table.to_dict("records") if row["fault"] == ""],
            align="lllllrrrrrrr",
        ),
        *(
            f"Case {row['case']}, `{row['pair']}`, has no result: {row['fault']}"
            for row in table.to_dict("records")
            if row["fault"]
        ),
        *(
            (
                f"Case {row['case']} on {row['cells']} x {row['cells']} cells has no "
                f"reference: {row['fault']}"
            )
            for row in campaigns.to_dict("records")
            if row["fault"]
        ),
        "All values: [campaign_accuracy.csv](campaign_accuracy.csv).",
    ]
    return blocks


def ratios_of(table, pair, kind):
    """CPU ratios of a pair on rigs or in the field."""
    return table[(table["pair"] == pair) & (table["kind"] == kind)][
        "cpu_ratio"
    ].dropna()


def _line(row):
    """Cells of a campaign."""
    names = (
        "end_percent",
        "largest_percent",
        "power_percent",
        "pressure_percent",
        "area_percent",
    )
    first = [
        str(row["case"]),
        row["kind"],
        LAWS[row["law"]],
        row["wheel"],
        f"`{row['pair']}`",
    ]
    return [
        *first,
        f"{row['deepest_um']:.3g}",
        *(f"{row[name]:.2f}" for name in names),
        f"{row['cpu_ratio']:.3f}",
    ]


def read_references(folder):
    """Tables of `frozen_references.py`: campaigns, depths, operating points."""
    names = "campaigns", "depths", "rows"
    return [
        pd.read_csv(folder / f"reference_{name}.csv", dtype={"fault": str}).fillna(
            {"fault": ""}
        )
        for name in names
    ]


def read_table(folder):
    """Table of this report."""
    return pd.read_csv(folder / "campaign_accuracy.csv", dtype={"fault": str}).fillna(
        {"fault": ""}
    )


def main(arguments=None):
    """Run what has a reference and write the report."""
    more = {
        "cases": {
            "nargs": "+",
            "type": int,
            "metavar": "N",
            "help": f"0 to {CASES - 1} (default: all)",
        }
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    values, slips = (
        chosen.out / "campaign_accuracy.csv",
        chosen.out / "campaign_accuracy_slip.csv",
    )
    singles = chosen.out / "campaign_accuracy_contacts.csv"
    frozen = chosen.out if (chosen.out / "reference_campaigns.csv").exists() else HERE
    references = read_references(frozen)
    table = (
        read_table(chosen.out)
        if values.exists()
        else pd.DataFrame({"case": [], "pair": []})
    )
    ready = references[0][
        references[0]["cells"].eq(30) & references[0]["fault"].eq("")
    ]["case"].tolist()
    for number in [] if chosen.from_csv else ready:
        if chosen.cases is not None and number not in chosen.cases:
            continue
        for pair in PAIRS:
            row = compared(number, pair, references)
            sys.stderr.write(f"{row}\n")
            others = table[~(table["case"].eq(number) & table["pair"].eq(pair))]
            table = pd.concat([others, pd.DataFrame([row])], ignore_index=True)
            write_csv(
                table.sort_values(["case", "pair"], kind="stable"), values, "%.5g"
            )
    if not chosen.from_csv:
        write_csv(pd.DataFrame(by_slip()), slips)
        write_csv(pd.DataFrame(of_contacts(frozen)), singles)
    slip, contacts = (
        pd.read_csv(path, dtype=str).to_numpy().tolist() for path in (slips, singles)
    )
    write_report(
        chosen.out,
        __file__,
        TITLE,
        report(read_table(chosen.out), references, contacts, slip),
    )


if __name__ == "__main__":
    main()
