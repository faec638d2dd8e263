"""Initial contact of wheel, rail and roller with 60 mrad of yaw.

Figure 2 of Liu & Bruni (2016).

    python reports/seed_figure_2.py [--out DIR]

writes seed_figure_2.md, .csv and .svg.
"""

import numpy as np
import pandas as pd
from initial_contact import initial_contact
from writing import Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.report.style import COLOURS, grid, legend, save_svg, style

YAW = 60e-3
SHIFT = 1e-3 * (-8.0 + 0.1 * np.arange(161))
WHEELSET = wearsim.wheelset("S1002", radius=0.46)
COUNTERFACES = {
    "rail": wearsim.rails("60E1", inclination=1 / 20),
    "roller 1 m": wearsim.rollers("60E1", radius=1.0, inclination=1 / 20),
}
# Column of the CSV file: value, factor from SI
COLUMNS = {
    "wheel_y_mm": ("wheel_y", 1e3),
    "counterface_y_mm": ("counterface_y", 1e3),
    "x_mm": ("x", 1e3),
    "contact_angle_mrad": ("contact_angle", 1e3),
    "wheel_radius_mm": ("wheel_radius", 1e3),
    "roll_mrad": ("roll", 1e3),
}
PANELS = (
    ("wheel_y", "Lateral position on the wheel [mm]"),
    ("x", "Longitudinal position [mm]"),
    ("contact_angle", "Contact angle [mrad]"),
)
# m on the wheel between neighbouring shifts; less within CLOSE is a contact that moves
# fast
JUMP = 1e-3
CLOSE = 1e-7  # m of shift

SETTING = """
Initial contact of the right wheel, as a rigid body, with 60 mrad of yaw. The wheelset rests on both wheels.
Axes: x forwards, y to the right, z down; longitudinal positions from the middle of the axle.
"""
REMARKS = """
The counterpart of figure 2 of B. Liu, S. Bruni: Analysis of wheel-roller contact and comparison with the
wheel-rail case (2016). The paper says that two-point contact occurs at a shift of about 5 mm on the rail
and a slightly different one on the roller. Yaw turns the flange of the right wheel ahead: on the tread the
wheel touches behind the axle, on the flange before it. The roller, curving away, lets it touch nearer to
the plane of both axles. tests/reports/test_seed_figure_2.py computes rows of the table again.
"""
CAPTION = (
    "Contact on the wheel over the lateral shift. Open circles: two-point contact, "
    "where the contact leaves one point for the other. All values: "
    "[seed_figure_2.csv](seed_figure_2.csv)."
)


def located(counterface, shift):
    """Return the initial contact at some shifts [m]."""
    return initial_contact(WHEELSET, counterface, shift, YAW, free_roll=True)


def two_point_contacts(counterface, shift):
    """Shifts where two points touch at once, and the contacts just before and after."""
    contact = located(counterface, shift)
    jumps = []
    for i in np.flatnonzero(np.abs(np.diff(contact["wheel_y"])) > JUMP):
        if shift[i + 1] - shift[i] > CLOSE:
            jumps += two_point_contacts(
                counterface, np.linspace(shift[i], shift[i + 1], 11)
            )
        else:
            sides = [
                {name: values[k] for name, values in contact.items()}
                for k in (i, i + 1)
            ]
            jumps.append((0.5 * (shift[i] + shift[i + 1]), *sides))
    return jumps


def figure(contacts, jumps):
    """Contact positions and angle over the shift.

    Lines break at two-point contacts, which are marked.
    """
    with style():
        drawn, axes = grid(1, len(PANELS), height=2.9, width=11.0, sharex=True)
        for ax, (name, label) in zip(axes[0], PANELS, strict=True):
            for counterface, colour, dashes in zip(
                contacts, ("field", "rig"), ("-", "--"), strict=True
            ):
                line, value = 1e3 * SHIFT, 1e3 * contacts[counterface][name]
                where = [1e3 * at for at, _, _ in jumps[counterface]]
                sides = [
                    [1e3 * jump[k][name] for jump in jumps[counterface]] for k in (1, 2)
                ]
                for at, before, after in zip(where, *sides, strict=True):
                    place = int(np.searchsorted(line, at))
                    line = np.insert(line, place, [at, at, at])
                    value = np.insert(value, place, [before, np.nan, after])
                ax.plot(
                    line,
                    value,
                    color=COLOURS[colour],
                    linestyle=dashes,
                    label=counterface,
                )
                for side in sides:
                    ax.plot(
                        where,
                        side,
                        "o",
                        color=COLOURS[colour],
                        markerfacecolor="white",
                        zorder=3,
                    )
            ax.set_xlabel("Shift, to the right [mm]")
            ax.set_ylabel(label)
        legend(drawn)
    return drawn


def main(arguments=None):
    """Write the report."""
    out = options(__file__, __doc__, arguments).out
    contacts = {
        name: located(counterface, SHIFT) for name, counterface in COUNTERFACES.items()
    }
    jumps = {
        name: two_point_contacts(counterface, SHIFT)
        for name, counterface in COUNTERFACES.items()
    }
    save_svg(figure(contacts, jumps), out / "seed_figure_2.svg")
    tables = [
        pd.DataFrame(
            {"counterface": name, "shift_mm": 1e3 * SHIFT}
            | {
                column: factor * contact[value]
                for column, (value, factor) in COLUMNS.items()
            }
        )
        for name, contact in contacts.items()
    ]
    write_csv(pd.concat(tables), out / "seed_figure_2.csv", "%.6f")
    both = [
        [name, f"{1e3 * at:.2f}"]
        + [
            f"{1e3 * before[n]:.1f} and {1e3 * after[n]:.1f}"
            for n in ("wheel_y", "x", "contact_angle")
        ]
        for name in COUNTERFACES
        for at, before, after in jumps[name]
    ]
    points = [
        [f"{1e3 * SHIFT[i]:g}"]
        + [
            f"{1e3 * contact[name][i]:.{digits}f}"
            for contact in contacts.values()
            for name, digits in (("wheel_y", 2), ("x", 2), ("contact_angle", 1))
        ]
        for i in range(0, SHIFT.size, 10)
    ]
    values = ["y on the wheel [mm]", "x [mm]", "contact angle [mrad]"]
    write_report(
        out,
        __file__,
        (
            "Initial contact of wheel, rail and roller with 60 mrad of yaw: figure 2 "
            "of Liu & Bruni"
        ),
        [
            SETTING,
            REMARKS,
            Figure("seed_figure_2.svg", CAPTION, "Contact position over the shift"),
            "## Two-point contact",
            Table(["counterface", "shift [mm]", *values], both),
            "## Contact points",
            Table(
                [
                    "shift [mm]",
                    *(
                        f"{name}: {value}" if value == values[0] else value
                        for name in COUNTERFACES
                        for value in values
                    ),
                ],
                points,
            ),
        ],
    )


if __name__ == "__main__":
    main()
