"""Errors of the contact models against half-space solutions.

Cases differ in profiles, rollers, shifts and yaw angles.

python reports/contact_accuracy.py              solves all cases: contact_accuracy.csv, .md and .svg
python reports/contact_accuracy.py --from-csv   writes text and figure from the table as it stands
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd
from scipy import ndimage
from writing import Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.errors import ContactError
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style

TITLE = "Errors of the contact models against half-space solutions"
RAIL = "60E1"
INCLINATIONS = {"1:40": 1.0 / 40.0, "1:20": 1.0 / 20.0}
CURVATURES = (
    0.0,
    1.0,
    2.0,
)  # of the counterface: rail, rollers of 1 m and 0.5 m radius [1/m]
SHIFTS = (-5e-3, -3e-3, -1e-3, 0.0, 0.5e-3, 1.5e-3, 3e-3, 4e-3, 5e-3, 5.5e-3, 6e-3)
YAWS = (0.0, 0.01)
WHEEL_LOAD, SPEED, FRICTION = 80e3, 20.0, 0.35
REFERENCE = ("half_space", "half_space", 50)
MODELS = (
    ("hertz", "fastsim", 50),
    ("kik_piotrowski", "fastsim", 50),
    ("kik_piotrowski", "half_space", 50),
    ("coupled_strips", "fastsim", 50),
    ("coupled_strips", "coupled_strips", 50),
    ("coupled_strips", "half_space", 50),
    ("half_space", "fastsim", 50),
    ("half_space", "half_space", 25),
)
ERRORS = {
    "area": "area",
    "max_pressure": "max. pressure",
    "force": "force",
    "power": "power",
    "strip_work": "strip work",
}
DESCRIPTION = (
    "counterface_profile",
    "inclination",
    "counterface_curvature",
    "shift",
    "yaw",
    "wheel_load",
    "friction",
)
RESULTS = (
    "area",
    "max_pressure",
    "force_x",
    "force_y",
    "power",
    "slip_share",
    "patches",
)
# slip share that separates two classes of cases: above it nearly all of the patch slips
FULL_SLIP = 0.9
# length of wheel profile over which strip work is compared: a tenth of a narrow
# patch [m]
PIECE = 0.2e-3
WORST = 5
LARGEST_SHOWN = 100.0  # end of the figure's axes [%]
SHOWN = {"max_pressure": "pressure", "power": "power", "strip_work": "strip work"}

INTRODUCTION = """\
{count} cases: S1002 on 60E1 1:40 and 1:20; rail, rollers of 1000 and 500 mm; shifts of -5 to 6 mm, yaw
angles of 0 and 10 mrad, wheel load 80 kN, carried by normal and creep forces together, friction 0.35; right
wheel, rotation speed V/r0. Reference: `{reference}`.

Errors are those of the wheel (sums over its patches): of area, maximum pressure and power relative to the
reference; of the creep force, the length of the difference over friction coefficient times wheel load; of
the strip work, the integral over the wheel profile of the absolute difference over that of the reference,
in pieces of 0.2 mm: what decides the shape of worn profiles. Each cell holds the median and the 95 %
quantile of the absolute errors in per cent.

All values: [contact_accuracy.csv](contact_accuracy.csv).
"""
REMARKS = """\
All models agree on the area of an ellipse; they differ in the flat two-lobed contact of a new S1002 on 60E1
at zero shift and in the contact of two lobes between 5 and 6 mm, where virtual penetration has a third too
little pressure. In 95 % of the single patches coupled strips are within 1.9 % in area and 0.4 % in pressure;
with the tangential model of strips, too, within 3.4 % in power and 10 % in strip work (median 0.1 and 1.6 %).

In both of these models the wheel's own radius decides how strips or rows of cells slip. Pairs with one
creepage and spin about the centre of a patch miss 13 % in power and 43 % in strip work of single patches (95
% quantiles), whatever their pressures, most where little of a wide patch slips. Power depends on a
convention, too, in split patches: the half-space solution, as CONTACT does, puts lobes that belong together
in one plane; virtual penetration gives each lobe its own plane and creepages, coupled strips each strip. At
1:20 and 5.5 mm the longitudinal creepage in the smaller lobe is -0.0009 in the one and -0.0020 in the other;
its power is twice as large, though pressure and area agree within 2 %. Neither is the truth there.

At equal models a grid of 25 x 25 cells is within 3 % in area and forces, but its strip work is off by a
quarter in partial slip: the zones of slip are a few cells wide.

Among fast tangential models only FASTSIM was kept: FASTSIM with blended flexibilities, FaStrip, strip
theory coupled by the half-space and closed-form full slip were measured on these cases. Strip theories are
closer where nearly all of a patch slips, but not in the strip work where little does.
[contact_models.md](contact_models.md) lists the figures, also those for other ways of scaling local power.
"""


@dataclass(frozen=True)
class WheelSums:
    """Sums over patches of a wheel, and strip work of each on the wheel profile."""

    area: float
    max_pressure: float
    force_x: float
    force_y: float
    power: float
    slip_share: float
    patches: int  # or lobes, if more
    strip_edges: np.ndarray  # (m, ny + 1) lateral positions on the wheel profile [m]
    strip_work: np.ndarray  # (m, ny) per passage, times the width of the strips [J/m]

    def work_up_to(self, y):
        """Strip work of patches up to each position of the wheel profile [J/m]."""
        parts = zip(self.strip_edges, self.strip_work, strict=True)
        return np.sum(
            [np.interp(y, edges, [0.0, *np.cumsum(work)]) for edges, work in parts],
            axis=0,
        )


def wheel_sums(solution):
    """Sum the patches of each operating point of one side, with fields."""
    sums = []
    for point in np.unique(solution["point"]):
        patches = solution.isel(patch=np.flatnonzero(solution["point"] == point))
        added = ("area", "force_x", "force_y", "power", "slip_area")
        total = {name: float(patches[name].sum()) for name in added}
        lobes = 0
        if "cell_pressure" in patches:
            lobes = sum(
                ndimage.label(pressure > 0.0)[1]
                for pressure in patches["cell_pressure"].values
            )
        sums.append(
            WheelSums(
                max_pressure=float(patches["max_pressure"].max()),
                slip_share=total.pop("slip_area") / total["area"],
                patches=max(patches.sizes["patch"], lobes),
                strip_edges=patches["strip_wheel_y_edges"].values,
                strip_work=(patches["strip_work"] * patches["strip_width"]).values,
                **total,
            )
        )
    return sums


def errors_of(model, reference, limit):
    """Errors of a wheel's sums by the names of `ERRORS`.

    `limit` is friction times wheel load [N].
    """
    ends = np.concatenate(
        [sums.strip_edges[:, [0, -1]].ravel() for sums in (model, reference)]
    )
    y = np.arange(ends.min() - PIECE, ends.max() + 2.0 * PIECE, PIECE)
    work, reference_work = (np.diff(sums.work_up_to(y)) for sums in (model, reference))
    force = np.hypot(
        model.force_x - reference.force_x, model.force_y - reference.force_y
    )
    power, total = reference.power, reference_work.sum()
    difference = np.abs(work - reference_work).sum()
    return {
        "area": model.area / reference.area - 1.0,
        "max_pressure": model.max_pressure / reference.max_pressure - 1.0,
        "force": force / limit,
        "power": model.power / power - 1.0 if power > 0.0 else float(model.power > 0.0),
        "strip_work": difference / total if total > 0.0 else float(work.sum() > 0.0),
    }


def all_cases():
    """Table of the cases.

    Every combination of inclination, counterface, yaw and shift.
    """
    names = ("inclination", "counterface_curvature", "yaw", "shift")
    cases = pd.DataFrame(
        product(INCLINATIONS, CURVATURES, YAWS, SHIFTS), columns=names
    ).rename_axis("case")
    return cases.assign(
        counterface_profile=RAIL, wheel_load=WHEEL_LOAD, friction=FRICTION
    )


def solve(cases, model):
    """Solve the right wheel of each case.

    Its sums, or the message where a model is not applicable.
    """
    normal, tangential, cells = model
    models = wearsim.ContactModels(normal, tangential, cells, cells, most_cells=cells)
    sums = []
    groups = cases.groupby(["inclination", "counterface_curvature"], sort=False)
    for (inclination, curvature), group in groups:
        rail = wearsim.standard_profile(
            RAIL, inclination=INCLINATIONS[inclination], gauge=1.435
        )
        sums += _solve_group(group, wearsim.Counterface(rail, curvature), models)
    return sums


def _solve_group(cases, counterface, models):
    """Solve cases on one counterface at once, or one by one if a case fails."""
    motion = {
        name: cases[name].to_numpy()
        for name in ("shift", "yaw", "wheel_load", "friction")
    }
    conditions = wearsim.ContactConditions.of(**motion, speed=SPEED, rotation="nominal")
    wheelset = wearsim.wheelset("S1002", radius=0.46, back_to_back=1.36)
    try:
        solution = wearsim.solve_contact(
            wheelset, counterface, conditions, models, sides=("right",), fields=True
        )
    except ContactError as error:
        if len(cases) == 1:
            return [str(error)]
        return [
            _solve_group(cases.iloc[[k]], counterface, models)[0]
            for k in range(len(cases))
        ]
    return wheel_sums(solution)


def compare(cases):
    """Table of results and errors.

    A row of each case for the reference, then for each model.
    """
    reference = solve(cases, REFERENCE)
    rows = [
        _row("reference", case, truth)
        for case, truth in zip(cases.itertuples(), reference, strict=True)
    ]
    for model in MODELS:
        for case, sums, truth in zip(
            cases.itertuples(), solve(cases, model), reference, strict=True
        ):
            if isinstance(sums, str):
                rows.append(_row(model_name(model), case) | {"message": sums})
                continue
            errors = errors_of(sums, truth, case.friction * case.wheel_load)
            row = _row(model_name(model), case, sums) | {
                "slip_share": np.nan,
                "patches": np.nan,
            }
            rows.append(
                row | {f"error_{name}": error for name, error in errors.items()}
            )
    return pd.DataFrame(rows)


def read_table(path):
    """Table of `compare` from its CSV file."""
    return pd.read_csv(path, dtype={"counterface_profile": str}).fillna({"message": ""})


def model_name(model):
    """Name of a combination of models with its grid."""
    normal, tangential, cells = model
    return f"{normal} + {tangential}, {cells} x {cells}"


def _row(model, case, sums=None):
    """Columns of the table that every row has."""
    return (
        {"model": model, "case": case.Index}
        | {name: getattr(case, name) for name in DESCRIPTION}
        | {name: getattr(sums, name, np.nan) for name in RESULTS}
        | {f"error_{name}": np.nan for name in ERRORS}
        | {"message": ""}
    )


def classes(table):
    """Classes of the cases by the reference's slip share and number of patches.

    Masks over the cases.
    """
    reference = table[table["model"] == "reference"].set_index("case")
    slips, single = reference["slip_share"] >= FULL_SLIP, reference["patches"] < 1.5
    return {
        "all": slips | ~slips,
        f"slip below {FULL_SLIP:g}": ~slips,
        f"slip above {FULL_SLIP:g}": slips,
        "single patch": single,
        "split patch": ~single,
    }


def spread_table(table):
    """Median and 95 % quantile of the errors of each model by class of cases."""
    rows = []
    for model in map(model_name, MODELS):
        part = table[table["model"] == model].set_index("case")
        for name, mask in classes(table).items():
            solved = part[mask & (part["message"] == "")]
            quantiles = [
                100.0 * solved[f"error_{error}"].abs().quantile([0.5, 0.95])
                for error in ERRORS
            ]
            cells = [f"{middle:.1f} · {most:.1f}" for middle, most in quantiles]
            first = f"`{model}`" if name == "all" else ""
            rows.append([first, name, f"{len(solved)} of {mask.sum()}", *cells])
    return Table(["model", "cases", "solved", *ERRORS.values()], rows)


def worst_table(table, model):
    """Cases with the largest errors of strip work."""
    reference = table[table["model"] == "reference"].set_index("case")
    errors = table[table["model"] == model].sort_values(
        "error_strip_work", ascending=False, kind="stable"
    )
    rows = []
    for case in errors[:WORST].itertuples():
        kappa = case.counterface_curvature
        counterface = "rail" if kappa == 0.0 else f"roller {1e3 / kappa:g} mm"
        title = (
            f"{case.counterface_profile} {case.inclination}, {counterface}, shift "
            f"{1e3 * case.shift:g} mm, yaw {1e3 * case.yaw:g} mrad, "
            f"{1e-3 * case.wheel_load:g} kN"
        )
        patches, slip = reference.loc[case.case, ["patches", "slip_share"]]
        errors = [f"{100.0 * getattr(case, f'error_{name}'):+.1f}" for name in ERRORS]
        rows.append([title, int(patches), f"{slip:.2f}", *errors])
    return Table(
        ["case", "patches", "slip share", *ERRORS.values()], rows, caption=f"`{model}`"
    )


def not_applicable(table):
    """List of the models that fail in a case, with the first message of each."""
    lines = []
    for model, part in table[table["message"] != ""].groupby("model", sort=False):
        count = (table["model"] == model).sum()
        lines.append(
            f"- `{model}`: {len(part)} of {count} cases, the first: "
            f"{part['message'].iloc[0]}"
        )
    return "\n".join(lines)


def draw(table):
    """Errors of pressure, power and work over the shift on the first rail, no yaw."""
    part = table.query(
        "inclination == '1:40' and counterface_curvature == 0 and yaw == 0"
    )
    with style():
        edges = (0.95, 0.15, 0.5, 0.75)  # three lines of legend
        figure, axes = grid(
            1, len(SHOWN), height=2.8, width=11.0, edges=edges, sharex=True
        )
        for ax, (name, label) in zip(axes[0], SHOWN.items(), strict=True):
            for k, model in enumerate(map(model_name, MODELS)):
                line = part[part["model"] == model].sort_values("shift")
                error = np.clip(
                    100.0 * line[f"error_{name}"], -LARGEST_SHOWN, LARGEST_SHOWN
                )
                look = {
                    "color": SERIES_COLOURS[k % 6],
                    "linestyle": ("-", "--")[k // 6],
                    "linewidth": 1.2,
                }
                ax.plot(
                    1e3 * line["shift"],
                    error,
                    marker="o",
                    markersize=2.5,
                    label=model,
                    **look,
                )
            ax.axhline(0.0, color="#555555", linewidth=0.8)
            ax.set_xlabel("Shift, to the right [mm]")
            ax.set_ylabel(f"Error of {label} [%]")
        legend(figure, columns=3)
    return figure


def write(table, out):
    """Write text and figure from the table."""
    save_svg(draw(table), out / "contact_accuracy.svg")
    caption = (
        f"Errors over the lateral shift on {RAIL} 1:40, rail, yaw 0 mrad; the axes "
        f"end at {LARGEST_SHOWN:g} %, gaps are cases a model is not applicable to."
    )
    count = (table["model"] == "reference").sum()
    blocks = [
        INTRODUCTION.format(count=count, reference=model_name(REFERENCE)),
        REMARKS,
        "## Errors by class of cases",
        spread_table(table),
        Figure("contact_accuracy.svg", caption),
        "## Worst cases of each model",
        *(worst_table(table, model) for model in map(model_name, MODELS)),
        "## Models that are not applicable",
        not_applicable(table),
    ]
    write_report(out, __file__, TITLE, blocks)


def main(arguments=None):
    """Write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    values = chosen.out / "contact_accuracy.csv"
    if not chosen.from_csv:
        write_csv(compare(all_cases()), values)
    write(read_table(values), chosen.out)


if __name__ == "__main__":
    main()
