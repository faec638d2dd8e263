"""Pressure, shear and slip of the half-space models compared with those of CONTACT.

    python reports/half_space_fields.py [--out DIR]

reads the fields of CONTACT in tests/data and writes half_space_fields.md and .svg.
"""

import numpy as np
import pandas as pd
from writing import HERE, Figure, Table, options, write_report

import wearsim
from wearsim.report.style import COLOURS, grid, legend, save_svg, style

DATA = HERE.parent / "tests" / "data"
# Case: title, shift [m], yaw [rad], curvature of the counterface [1/m].
CASES = {
    "tread": ("rail, 3 mm", 3e-3, 0.0, 0.0),
    "yawed": ("rail, 3 mm, 10 mrad", 3e-3, 0.01, 0.0),
    "field_side": ("rail, \N{MINUS SIGN}4 mm", -4e-3, 0.0, 0.0),
    "two_lobes": ("rail, 0 mm", 0.0, 0.0, 0.0),
    "roller_one_metre": ("roller 1 m, 3 mm", 3e-3, 0.0, 1.0),
    "roller_half_metre": ("roller 0.5 m, 3 mm", 3e-3, 0.0, 2.0),
    "roller_two_lobes": ("roller 0.5 m, 0 mm", 0.0, 0.0, 2.0),
}
CONTACT = pd.read_csv(
    DATA / "contact_rolling_fields.csv", comment="#", index_col="case"
).loc[list(CASES)]
NAMES = ("Pressure [MPa]", "Shear stress [MPa]", "Slip [1/1000]")
FRICTION, SPEED = 0.35, 20.0

SETTING = """
S1002 on 60E1 1:40, wheel load 80 kN, friction 0.35, steady rolling, right wheel, rotation speed V/r0;
CONTACT with elements of 0.2 mm, ours with 80 x 80 cells and all of it our own: gap, pressures, and
tractions at CONTACT's creepages, moved to our centre of pressure. Each cell of the table is the integral
over the patch of the absolute difference (for shear and slip, of the length of the difference), over that
of CONTACT's field, in per cent; the fields of both are laid on CONTACT's elements about the centre of
pressure. CONTACT gives slip at the upstream edges of its elements, we as mean of cells: the difference is
largest where only a narrow rim slips. tests/contact/tangential/test_half_space_tangential.py compares both
at the same places under the same pressures: shear within 0.03 %, slip within 0.04 %.
"""
CAPTION = """\
Along the strip of the largest pressure: CONTACT dashed, ours solid; rolling direction to the right.
Pressure, size of the shear stress with the bound dotted, size of the slip over V."""


def ours(row, case, centre):
    """Solve a case with CONTACT's normal force and creepages."""
    _, shift, yaw, curvature = CASES[case]
    spin = -row["spin"]
    creepage = [-row["xi"] - spin * centre[1], -row["eta"] + spin * centre[0], spin]
    return wearsim.solve_contact(
        wearsim.wheelset("S1002", radius=0.46),
        wearsim.rollers("60E1", radius=1.0 / curvature)
        if curvature
        else wearsim.rails("60E1"),
        wearsim.ContactConditions.of(
            shift=shift,
            yaw=yaw,
            wheel_load=row["load"],
            speed=SPEED,
            friction=FRICTION,
            rotation="nominal",
            creepage=[creepage],
        ),
        wearsim.ContactModels(
            "half_space", "half_space", strips=80, cells=80, most_cells=80
        ),
        sides=["right"],
        load="normal_force",
        fields=True,
    ).isel(patch=0)


def on_elements(field, x, y, new_x, new_y):
    """Bilinear: field (nx, ny), x falling, on other places."""
    across = np.array([np.interp(new_y, y, line, 0.0, 0.0) for line in field])
    return np.array(
        [np.interp(new_x, x[::-1], column[::-1], 0.0, 0.0) for column in across.T]
    ).T


def compared(row, case):
    """Fields of both on CONTACT's elements: places along, (5, nx, ny) of each.

    Cells of the table.
    """
    data = np.load(DATA / f"contact_rolling_{case}.npz")
    x, s = data["x"].astype(float), data["s"].astype(float)
    reference = np.stack(
        [
            sign * data[name].T.astype(float)
            for sign, name in (
                (1, "p"),
                (-1, "tau_x"),
                (-1, "tau_s"),
                (-1, "slip_x"),
                (-1, "slip_s"),
            )
        ]
    )
    reference[3:] *= data["state"].T > 0  # outside the contact we have no slip
    load = reference[0].sum()
    centre = (
        (reference[0].sum(axis=1) * x).sum() / load,
        (reference[0].sum(axis=0) * s).sum() / load,
    )
    contact = ours(row, case, centre)
    fields = [
        contact[name].values
        for name in ("pressure", "shear_x", "shear_y", "slip_x", "slip_y")
    ]
    lead, trail = contact["cells_lead"].values[0], contact["cells_trail"].values[0]
    our_x = (
        lead
        - (lead - trail)
        * (np.arange(contact.sizes["cell"]) + 0.5)
        / contact.sizes["cell"]
    )
    our_y, places = contact["lateral"].values, (x - centre[0], s - centre[1])
    computed = np.stack([on_elements(part, our_x, our_y, *places) for part in fields])
    differences = [
        np.sqrt(((computed[part] - reference[part]) ** 2).sum(axis=0)).sum()
        / np.sqrt((reference[part] ** 2).sum(axis=0)).sum()
        for part in (slice(0, 1), slice(1, 3), slice(3, 5))
    ]
    share = float(contact["slip_area"] / contact["area"])
    power = SPEED * row["power"], float(contact["power"])
    shown = [f"{1e2 * value:.1f}" for value in differences]
    shown += [
        f"{row['slip_share']:.3f}, {share:.3f}",
        f"{power[0]:.1f}, {power[1]:.1f}",
    ]
    return x - centre[0], reference, computed, shown


def sizes(fields):
    """Pressure [MPa], size of shear [MPa] and of slip [1/1000]."""
    return 1e-6 * fields[0], 1e-6 * np.hypot(*fields[1:3]), 1e3 * np.hypot(*fields[3:])


def draw(axes):
    """Draw the fields of each case into a column, and return the rows of the table."""
    rows = []
    for (case, row), column in zip(CONTACT.iterrows(), axes.T, strict=True):
        x, reference, computed, shown = compared(row, case)
        strip = int(reference[0].max(axis=0).argmax())
        for ax, theirs, our in zip(
            column, sizes(reference), sizes(computed), strict=True
        ):
            ax.plot(1e3 * x, our[:, strip], color=COLOURS["field"], label="wearsim")
            look = {"color": COLOURS["rig"], "ls": "--", "label": "CONTACT"}
            ax.plot(1e3 * x, theirs[:, strip], **look)
        limit = FRICTION * sizes(reference)[0][:, strip]
        text = "friction times pressure"
        column[1].plot(1e3 * x, limit, color=COLOURS["rail"], ls=":", label=text)
        column[0].set_title(CASES[case][0])
        column[2].set_xlabel("x [mm]")
        rows.append([CASES[case][0], *shown])
    return rows


def main(arguments=None):
    """Write the report."""
    out = options(__file__, __doc__, arguments).out
    with style():
        figure, axes = grid(
            3, len(CASES), 1.6, width=14.0, gap=0.25, between=0.3, sharey="row"
        )
        rows = draw(axes)
        for ax, name in zip(axes[:, 0], NAMES, strict=True):
            ax.set_ylabel(name)
        legend(figure, axes[1])
    save_svg(figure, out / "half_space_fields.svg")
    head = [
        "case",
        "pressure",
        "shear",
        "slip",
        "slip share: CONTACT, ours",
        "power [W]: CONTACT, ours",
    ]
    write_report(
        out,
        __file__,
        "Local fields of the half-space models compared with CONTACT",
        [
            SETTING,
            Table(head, rows),
            Figure(
                "half_space_fields.svg", CAPTION, "Fields along the rolling direction"
            ),
        ],
    )


if __name__ == "__main__":
    main()
