"""Tables 2 to 5 of Liu & Bruni (2016).

With our results and half-space solutions, and our figures 5 and 6.

    python reports/seed_tables.py [--out DIR]

reads seed_tables_cases.csv and writes seed_tables.md, .csv (our values and half-space
ones) and two figures.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from initial_contact import initial_contact
from writing import HERE, Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.report.figures import contact
from wearsim.report.style import (
    COLOURS,
    SERIES_COLOURS,
    grid,
    label,
    label_axes,
    legend,
    save_svg,
    style,
    values_of,
)
from wearsim.studies.contact_state import contact_state

WHEELSET = wearsim.wheelset("S1002", radius=0.46)
RAILS = (
    "60E1_benchmark",
    "60E1",
)  # the half-space solutions are those on the first one
# Young's modulus is printed in MPa in table 1 of the paper, a misprint of GPa.
MODELS = wearsim.ContactModels.of(
    "fast", strips=100, cells=100, most_cells=100, youngs_modulus=210e9
)
CELL_SIZES = (
    0.4e-3,
    0.2e-3,
    0.1e-3,
)  # of the half-space solutions; the tables hold those of the last [m]
HALF_SPACE = {
    size: replace(
        MODELS,
        normal="half_space",
        tangential="half_space",
        strips=8,
        cells=8,
        cell_size=size,
        most_cells=512,
    )
    for size in CELL_SIZES
}
CASES = pd.read_csv(HERE / "seed_tables_cases.csv", comment="#", index_col="source")
TREND_SHIFTS = 1e-3 * np.arange(-6.0, 7.0)
TREND_RADII = (2.0, 1.5, 1.0, 0.75, 0.5, 0.35)

# Column of the cases: variable of a contact solution, factor from SI
COLUMNS = {
    "creepage_x": ("creepage_x", 1.0),
    "spin_per_m": ("spin", 1.0),
    "contact_angle_mrad": ("contact_angle", 1e3),
    "area_mm2": ("area", 1e6),
    "max_pressure_MPa": ("max_pressure", 1e-6),
    "length_mm": ("length", 1e3),
    "width_mm": ("width", 1e3),
    "slip_share": ("slip_share", 1.0),
    "force_x_kN": ("force_x", 1e-3),
    "force_y_kN": ("force_y", 1e-3),
    "spin_moment_Nm": ("spin_moment", 1.0),
    "power_W": ("power", 1.0),
}
# Tables of the report: section, how its creepages come about, column, heading, digits
TABLES = (
    ("Creepages", "motion", "creepage_x", "Longitudinal creepage [10⁻³]", 3),
    ("Creepages", "motion", "spin_per_m", "Spin creepage [1/m]", 4),
    ("Creepages", "motion", "contact_angle_mrad", "Contact angle [mrad]", 2),
    ("Normal contact", "centre", "area_mm2", "Area of the contact patch [mm²]", 1),
    (
        "Normal contact",
        "centre",
        "max_pressure_MPa",
        "Largest contact pressure [MPa]",
        0,
    ),
    (
        "Normal contact",
        "centre",
        "length_mm",
        "Length of the contact patch in rolling direction [mm]",
        2,
    ),
    ("Normal contact", "centre", "width_mm", "Width of the contact patch [mm]", 2),
    ("Tangential contact", "centre", "slip_share", "Share of the patch that slips", 3),
    ("Tangential contact", "centre", "force_x_kN", "Longitudinal creep force [kN]", 2),
    ("Tangential contact", "centre", "force_y_kN", "Lateral creep force [kN]", 2),
    (
        "Tangential contact",
        "centre",
        "spin_moment_Nm",
        "Spin moment about the centre of the patch [N m]",
        1,
    ),
    ("Frictional power", "centre", "power_W", "Frictional power of the patch [W]", 1),
)
# Conclusions of the paper over the curvature of the roller: +1 rises, -1 falls; of
# several patches of a wheel
TRENDS = {
    "area": ("area of the contact patch", -1, "sum"),
    "max_pressure": ("largest contact pressure", 1, "max"),
    "length": ("length of the contact patch in rolling direction", -1, "max"),
    "width": ("width of the contact patch", 1, "sum"),
    "slip_share": ("share of the patch that slips", 1, "sum"),
    "power": ("frictional power of the patch", 1, "sum"),
}

SETTING = """
Published values: B. Liu, S. Bruni: Analysis of wheel-roller contact and comparison with the wheel-rail
case, published online 12 January 2016; tables 1 to 5. Ours: normal model `kik_piotrowski`, tangential
model `fastsim`, 100 strips of 100 cells, normal force 80 kN, 72 km/h, friction 0.35. Right wheel; z down,
y to the right; forces on the wheel; creepage of the wheel against the counterface. Half-space solutions
are our `half_space + half_space` on the first profile, on cells of 0.1 mm (below, under "Cell size of the
half-space solutions"). Values of both: [seed_tables.csv](seed_tables.csv); published values and those of
CONTACT: [seed_tables_cases.csv](seed_tables_cases.csv).
"""
REMARKS = """
Creepages are table 2 of the paper, normal contact is table 3, tangential contact table 4, frictional power
table 5; the figures are our counterparts of its figures 5 and 6. tests/reports/test_seed_tables.py
computes the tables again.

At zero shift the contact is flat and has two lobes. There initial contact lies 3 mm from the
pressure-weighted centre, and this point moves by millimetres with micrometres of profile. The contact
angle at the centre is the one that the paper's spin implies, 0.0345 rad. Spin, and a longitudinal creepage
of zero at the point of initial contact, are together a creepage that is not zero at the centre: that is
where forces of several kN come from in cases whose creepages are called zero (below, under "Creepage
reference point"). The paper's forces are of that size, about 30 % larger, and of the other sign: it would
take initial contact on the other side of the centre, such as the other lobe, which the profiles of its
authors may have. We test neither value tightly. In this flat contact the paper, and our model, which is
the same, compute a third less pressure than the half-space solution; at 3 mm they are within 10 %.
"""
MOTION = """
Ours follow from the motion without yaw; the rotation speed is that without longitudinal creepage at zero
shift. Lateral creepage is zero in all cases.
"""
CELL_SIZE = """
The cells of the half-space solutions are halved until pressures stand still; creepages are the paper's, at
the centre. From {coarse:g} to {fine:g} mm no pressure changes by more than {pressure:.1f} %, no area by more
than {area:.1f} % and no power by more than {power:.1f} %.

CONTACT is an independent program. On the rail its pressure is ours within 0.5 %; on the rollers it rises by
3 to 7 % from 0.2 to 0.1 mm while area and power stand still, so it has not converged there. Its creepages
are held at a contact reference, which at 3 mm lies 0.1 to 0.2 mm beside the pressure-weighted centre: that
is most of the 3 to 4 % between the powers.
"""
REFERENCE_POINT = """
Above, prescribed creepages are those at the pressure-weighted centre of the patch, as everywhere in
wearsim. Prescribed at the point of initial contact, they are others at the centre: the longitudinal
creepage differs by spin times distance.
"""


def counterface(rail, roller_radius):
    """Rails, or rollers of a radius [m] with a rail's profile."""
    if np.isfinite(roller_radius):
        return wearsim.rollers(rail, radius=roller_radius, inclination=1 / 40)
    return wearsim.rails(rail, inclination=1 / 40)


def conditions(shift, creepage=None):
    """Operating points at some shifts [m], without yaw."""
    return wearsim.ContactConditions.of(
        shift=shift,
        wheel_load=80e3,
        speed=20.0,
        friction=0.35,
        rotation="centred",
        creepage=creepage,
    )


def values(rail, case, models, creepage=None):
    """Columns for one case with given creepages or those from the motion.

    Also the centre [m].
    """
    given = conditions(1e-3 * case.shift_mm, creepage)
    below = counterface(rail, 1e-3 * case.roller_radius_mm)
    contact = wearsim.solve_contact(
        WHEELSET, below, given, models, sides=["right"], load="normal_force"
    )
    contact["slip_share"] = contact["slip_area"] / contact["area"]
    row = {
        column: factor * contact[name].item()
        for column, (name, factor) in COLUMNS.items()
    }
    return row, contact["rail_y"].item()


def solved(rail, case, models):
    """Values of a case by how creepages come about: columns of the cases."""
    shift, below = (
        np.array([1e-3 * case.shift_mm]),
        counterface(rail, 1e-3 * case.roller_radius_mm),
    )
    motion, centre_y = values(rail, case, models)
    y = initial_contact(WHEELSET, below, shift)["counterface_y"][0], centre_y
    z = np.interp(y, below.profile.y, below.profile.z)
    angle = 1e-3 * motion["contact_angle_mrad"]
    offset = (y[0] - y[1]) * np.cos(angle) + (z[0] - z[1]) * np.sin(angle)
    x, spin = case.creepage_x, case.spin_per_m
    about = {"initial_contact_mm": 1e3 * offset}
    return {
        "motion": motion,
        "centre": about | values(rail, case, models, [[x, 0.0, spin]])[0],
        "initial_contact": about
        | values(rail, case, models, [[x + spin * offset, 0.0, spin]])[0],
    }


def state(case):
    """Contact of a case on the first rail with creepages at the centre, for figures."""
    given = conditions(1e-3 * case.shift_mm, [[case.creepage_x, 0.0, case.spin_per_m]])
    below = counterface(RAILS[0], 1e-3 * case.roller_radius_mm)
    contact = wearsim.solve_contact(
        WHEELSET,
        below,
        given,
        MODELS,
        sides=["right"],
        load="normal_force",
        fields=True,
    )
    return contact_state(given, WHEELSET, below, contact)


def trend(roller_radius):
    """Values of the right wheel over `TREND_SHIFTS` on the first rail.

    Creepages from the motion.
    """
    below = counterface(RAILS[0], roller_radius)
    contact = wearsim.solve_contact(
        WHEELSET, below, conditions(TREND_SHIFTS), MODELS, sides=["right"]
    )
    contact["slip_share"] = contact["slip_area"]
    wheel = contact[list(TRENDS)].to_dataframe().groupby("point")
    totals = wheel.agg({name: how for name, (_, _, how) in TRENDS.items()})
    totals["slip_share"] /= totals["area"]
    return totals.assign(patches=wheel.size())


def shown(values, digits):
    """Write numbers; a dash where there is none."""
    return [
        f"{round(v, digits) + 0.0:.{digits}f}" if np.isfinite(v) else "-"
        for v in values
    ]


def difference(values, reference):
    """Write differences in per cent.

    A dash where one is missing or the reference next to nothing.
    """
    smallest = 1e-3 * np.nanmax(np.abs(reference), initial=0.0)

    def cell(v, r):
        if not np.isfinite(v * r) or abs(r) <= smallest:
            return "-"
        return f"{100.0 * (v / r - 1.0):+.1f} %" if v * r > 0.0 else "other sign"

    return [cell(v, r) for v, r in zip(values, reference, strict=True)]


def comparison(cases, paper, ours, half_space, digits):
    """Table of one quantity by case.

    The paper's values, ours on each rail (rows), half-space ones.
    """
    columns = [("paper", shown(paper, digits))]
    for rail, row in zip(RAILS, ours, strict=True):
        columns += [
            (f"wearsim, {rail}", shown(row, digits)),
            ("difference to paper", difference(row, paper)),
        ]
    columns += [
        ("half-space", shown(half_space, digits)),
        ("difference of paper to half-space", difference(paper, half_space)),
        ("difference of wearsim to half-space", difference(ours[0], half_space)),
    ]
    columns = [
        ("case", cases),
        *[(head, cells) for head, cells in columns if set(cells) != {"-"}],
    ]
    return Table(
        [head for head, _ in columns],
        list(zip(*(cells for _, cells in columns), strict=True)),
    )


def ratios(values):
    """Values over those of the first of three cases, the rail.

    NaN for it and where its value is small.
    """
    by_shift = values.reshape(*values.shape[:-1], 2, 3)
    rail = by_shift[..., :1]
    largest = np.max(np.abs(values), axis=-1)[..., None, None]
    ratio = by_shift / np.where(np.abs(rail) > 0.01 * largest, rail, np.nan)
    ratio[..., 0] = np.nan
    return ratio.reshape(values.shape)


def frame(ax, states):
    """Give axes limits in which the patches of all states fit.

    So their sizes can be compared.
    """
    outlines = [contact.outline(state, 0) for state in states]
    across, along = (
        1.08 * max(float(np.nanmax(np.abs(line[k]))) for line in outlines)
        for k in (0, 1)
    )
    box = ax.get_window_extent()
    shape = box.width / box.height
    half = max(along, across / shape)
    ax.set_xlim(-half * shape, half * shape)
    ax.set_ylim(-half, half)
    ax.set_aspect("equal", adjustable="box")


def plot_pressure(state, ax, **line):
    """Draw the largest pressure of strips across a patch, zero at its ends."""
    pressure = values_of(state, "pressure", 0).max(axis=0)
    y = values_of(state, "lateral", 0)
    half = 0.5 * (y[1] - y[0])
    ax.plot(
        np.r_[y[0] - half, y, y[-1] + half],
        np.r_[0.0, pressure, 0.0],
        label=state.attrs["label"],
        **line,
    )
    label_axes(ax, "Lateral, to the right [mm]", label(state, "pressure"), 0.0)


def patches_figure(groups):
    """Outlines above and pressures below of the patches, one column for each shift."""
    looks = list(
        zip(
            (COLOURS["rail"], COLOURS["rig"], SERIES_COLOURS[1]),
            ("-", "--", "-."),
            strict=True,
        )
    )
    with style():
        figure, axes = grid(
            2, len(groups), height=2.6, width=4.8 * len(groups), between=0.6
        )
        for (above, below), states in zip(axes.T, groups, strict=True):
            for state, (colour, line) in zip(states, looks, strict=True):
                contact.plot_outline(state, above, color=colour, linestyle=line)
                plot_pressure(state, below, color=colour, linestyle=line)
            frame(above, groups[0] + groups[1])
            below.set_xlim(above.get_xlim())
            above.set_title(f"Shift {1e3 * float(states[0]['shift']):g} mm")
        legend(figure, [axes[0, 0]])
    return figure


def stress_figure(groups):
    """Shear stress, stick and slip.

    One row for each counterface, one column and scale for each shift.
    """
    with style():
        figure, axes = grid(
            3, len(groups), height=2.9, width=4.8 * len(groups), between=0.75
        )
        for column, states in zip(axes.T, groups, strict=True):
            largest = max(
                float(np.hypot(state["shear_x"], state["shear_y"]).max())
                for state in states
            )
            for ax, state in zip(column, states, strict=True):
                contact.plot_shear(state, ax, largest=largest)
                frame(ax, states)
                ax.set_title(
                    f"Shift {1e3 * float(state['shift']):g} mm, {state.attrs['label']}"
                )
                swatches = ax.get_legend().legend_handles
                ax.get_legend().remove()  # one legend for all
        figure.legend(
            handles=swatches,
            loc="upper left",
            bbox_to_anchor=(figure.subplotpars.left, 1.0),
            ncols=len(swatches),
        )
    return figure


def compared(paper, cases, ours, half_space):
    """Sections that compare all values."""
    blocks = []
    for title, source, column, heading, digits in TABLES:
        if f"## {title}" not in blocks:
            blocks += [f"## {title}", *([MOTION] if source == "motion" else [])]
        factor = 1e3 if column == "creepage_x" else 1.0
        three = [
            factor * paper[column].to_numpy(),
            factor * np.array([ours.loc[(rail, source), column] for rail in RAILS]),
            factor * half_space.loc[source, column].to_numpy(),
        ]
        blocks += [f"### {heading}", comparison(cases, *three, digits)]
        if source == "centre" and paper[column].notna().any():
            three = [ratios(values) for values in three]
            rows = np.isfinite(three[1]).any(axis=0)
            names = [name for name, row in zip(cases, rows, strict=True) if row]
            three = [values[..., rows] for values in three]
            blocks += ["Ratio of roller to rail:", comparison(names, *three, 3)]
    return blocks


def cell_sizes(paper, cases, finest):
    """Section on the convergence of the half-space solutions, with those of CONTACT."""
    by_size = [
        pd.DataFrame(
            values(
                RAILS[0],
                case,
                HALF_SPACE[size],
                [[case.creepage_x, 0.0, case.spin_per_m]],
            )[0]
            for case in paper.itertuples()
        )
        for size in CELL_SIZES[:-1]
    ]
    by_size.append(finest.reset_index(drop=True))
    names = {
        "max_pressure_MPa": "pressure [MPa]",
        "area_mm2": "area [mm²]",
        "power_W": "power [W]",
    }
    before, last = by_size[-2:]
    most = [
        100.0 * float((before[name] / last[name] - 1.0).abs().max()) for name in names
    ]
    said = dict(zip(("pressure", "area", "power"), most, strict=True))
    text = CELL_SIZE.format(
        coarse=1e3 * CELL_SIZES[-2], fine=1e3 * CELL_SIZES[-1], **said
    )
    blocks = ["## Cell size of the half-space solutions", text]
    for name, heading in names.items():
        columns = {"case": cases}
        for size, ours in zip(CELL_SIZES, by_size, strict=True):
            columns[f"ours, {1e3 * size:g} mm"] = shown(ours[name], 1)
        for size, source in (("0.2", "contact"), ("0.1", "contact_fine")):
            columns[f"CONTACT, {size} mm"] = shown(CASES.loc[source, name], 1)
        blocks.append(
            Table(
                list(columns),
                list(zip(*columns.values(), strict=True)),
                caption=heading,
            )
        )
    return blocks


def reference_points(paper, cases, ours, half_space):
    """Section on where creepages are prescribed."""
    mine = ours.loc[RAILS[0]]
    columns = [
        ("case", cases),
        (
            "initial contact from centre [mm]",
            [f"{v:+.2f}" for v in mine.loc["centre", "initial_contact_mm"]],
        ),
    ]
    for column, name, digits in (("force_x_kN", "Fx [kN]", 2), ("power_W", "P [W]", 1)):
        columns.append((f"{name} paper", shown(paper[column], digits)))
        for source, place in (
            ("centre", "centre"),
            ("initial_contact", "initial contact"),
        ):
            columns.append(
                (f"{name} wearsim, {place}", shown(mine.loc[source, column], digits))
            )
            columns.append(
                (
                    f"{name} half-space, {place}",
                    shown(half_space.loc[source, column], digits),
                )
            )
    rows = list(zip(*(cells for _, cells in columns), strict=True))
    return [
        "## Creepage reference point",
        REFERENCE_POINT,
        Table([head for head, _ in columns], rows),
    ]


def trends():
    """Section on the trends over the radius of the roller.

    From each radius to the next smaller one.
    """
    radii = ("rail", *TREND_RADII)
    names = ["rail", *(f"{radius:g} m" for radius in TREND_RADII)]
    totals = [trend(np.inf if radius == "rail" else radius) for radius in radii]
    exceptions = [
        (name, i, j)
        for name, (_, sign, _) in TRENDS.items()
        for i in range(TREND_SHIFTS.size)
        for j in range(1, len(radii))
        if sign * (totals[j][name][i] - totals[j - 1][name][i]) <= 0.0
    ]
    steps = [
        [
            TRENDS[name][0],
            f"{1e3 * TREND_SHIFTS[i]:g}",
            names[j - 1],
            names[j],
            f"{100.0 * (totals[j][name][i] / totals[j - 1][name][i] - 1.0):+.1f} %",
            f"{totals[j - 1]['patches'][i]}, {totals[j]['patches'][i]}",
        ]
        for name, i, j in exceptions
    ]
    said = ", ".join(
        f"{words} {'rises' if sign > 0 else 'falls'}"
        for words, sign, _ in TRENDS.values()
    )
    count = len(TRENDS) * TREND_SHIFTS.size * len(TREND_RADII)
    return [
        "## Trends",
        f"Trends with the curvature of the roller: {said}. Checked from the rail to "
        f"radii of {', '.join(f'{radius:g}' for radius in TREND_RADII)} m one after "
        "the other, at shifts from -6 to 6 mm (right wheel, all its patches, "
        f"creepages from the motion, vertical load): {count} steps, {len(exceptions)} "
        "of them exceptions.",
        Table(
            [
                "quantity",
                "shift [mm]",
                "from",
                "to",
                "change",
                "patches before and after",
            ],
            steps,
        ),
        "Where two patches merge into one between two radii, two flexibilities become "
        "one, and the creep forces jump.",
        f"Ratios of the smallest roller ({names[-1]}) to the rail:",
        Table(
            ["shift [mm]", *(words for words, _, _ in TRENDS.values())],
            [
                [
                    f"{1e3 * shift:g}",
                    *(
                        f"{totals[-1][name][i] / totals[0][name][i]:.3f}"
                        for name in TRENDS
                    ),
                ]
                for i, shift in enumerate(TREND_SHIFTS)
            ],
        ),
    ]


def main(arguments=None):
    """Write the report."""
    out = options(__file__, __doc__, arguments).out
    paper = CASES.loc["paper"]
    against = [
        "rail" if np.isnan(r) else f"roller {1e-3 * r:g} m"
        for r in paper.roller_radius_mm
    ]
    cases = [
        f"{shift:g} mm, {what}"
        for shift, what in zip(paper.shift_mm, against, strict=True)
    ]
    rows = [
        {"model": models.normal, "rail": rail, "source": source}
        | {"shift_mm": case.shift_mm, "roller_radius_mm": case.roller_radius_mm}
        | row
        for models, rails in ((MODELS, RAILS), (HALF_SPACE[CELL_SIZES[-1]], RAILS[:1]))
        for rail in rails
        for case in paper.itertuples()
        for source, row in solved(rail, case, models).items()
    ]
    table = pd.DataFrame(rows)
    write_csv(
        table.reindex(columns=["model", "rail", "source", *CASES.columns]),
        out / "seed_tables.csv",
    )
    table = table.set_index(["model", "rail", "source"]).sort_index()
    ours, half_space = table.loc[MODELS.normal], table.loc[("half_space", RAILS[0])]
    states = [state(case) for case in paper.itertuples()]
    groups = [states[:3], states[3:]]
    save_svg(patches_figure(groups), out / "seed_tables_patches.svg")
    save_svg(stress_figure(groups), out / "seed_tables_stress.svg")
    write_report(
        out,
        __file__,
        "Wheel on rail and on rollers: the tables of Liu & Bruni (2016)",
        [
            SETTING,
            REMARKS,
            *compared(paper, cases, ours, half_space),
            *reference_points(paper, cases, ours, half_space),
            *cell_sizes(paper, cases, half_space.loc["centre"]),
            Figure(
                "seed_tables_patches.svg",
                (
                    "Outline and pressure of the patches by our solutions, by lateral "
                    "shift."
                ),
            ),
            Figure(
                "seed_tables_stress.svg",
                "Shear stress on the wheel, stick and slip by our solutions.",
            ),
            *trends(),
        ],
    )


if __name__ == "__main__":
    main()
