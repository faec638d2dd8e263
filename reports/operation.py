"""Vehicles in curves and on straight track.

Where axles run, and what that makes of their wear.

    python reports/operation.py [--out DIR] [--from-csv]

writes operation.md, operation.csv and operation.svg; about three minutes on two cores.
"""

import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.ticker import NullFormatter
from writing import Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.campaign import evolution
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
    solve,
)
from wearsim.operation.bogie import Bogies
from wearsim.operation.controlled import Controlled
from wearsim.operation.resultants import resultants
from wearsim.operation.route import Curve
from wearsim.operation.states import settle
from wearsim.profile import standard
from wearsim.profile.standard import shipped_path
from wearsim.report.style import (
    SERIES_COLOURS,
    WHEEL_LINES,
    label_axes,
    panels,
    save_svg,
)
from wearsim.scene.overrides import Override
from wearsim.scene.vehicle import VehicleFile
from wearsim.toml_faults import read_toml

RADII = (250, 300, 400, 500, 600, 800, 1000, 1500, 2000, 3000, 5000)
TICKS = (250, 500, 1000, 2000, 5000)
DEFICIENCY = 0.05
VEHICLES = ("regional_multiple_unit", "passenger_coach", "freight_wagon", "locomotive")
ROLLER = 1.0
SCENE = "workflows/field.toml"
RULES = ("suspended", "kinematic", "guided", "shifted")


def bodies(curvature=0.0):
    """S1002 on rails or rollers 60E1 1:40."""
    wheel, rail = standard.wheel("S1002"), standard.rail("60E1", 1 / 40, 1.435, 0.75)
    return Wheelset(wheel, wheel, 0.46, 0.75), Counterface(rail, curvature)


def curves(vehicles=VEHICLES):
    """Rows of both axles of the shipped vehicles in curves.

    Also of a rig with the same shift and yaw.
    """
    models, rail, roller = ContactModels.of("fast"), bodies(), bodies(1.0 / ROLLER)
    radius = np.array(RADII, dtype=float)
    first = 2 * np.arange(radius.size)
    for name in vehicles:
        file, _ = read_toml(
            shipped_path("profiles", "vehicles", f"{name}.toml"), VehicleFile
        )
        vehicle = file.vehicle
        whole = np.ones(2 * radius.size)
        acceleration = np.array(
            [Curve.of_deficiency(1.0 / one, DEFICIENCY) for one in radius]
        )
        bogies = Bogies(vehicle, first, first + 1, acceleration, np.ones(radius.size))
        given = ContactConditions.of(
            0.0 * whole,
            wheel_load=0.5 * vehicle.axle_load,
            friction=0.35,
            speed=20.0,
            free_roll=True,
            track_curvature=np.repeat(1.0 / radius, 2),
            box_moment=np.repeat(vehicle.box_moment(acceleration, 0.46), 2),
        )
        controlled = Controlled(np.nan * whole, bogies)
        running = settle(given, controlled, *rail, models)
        found = running.conditions(given)
        forces = resultants(solve(found, *rail, models), whole.size)
        shift = found.axle_shift(forces.roll)
        held = ContactConditions.of(
            shift,
            yaw=running.yaw,
            wheel_load=forces.vertical,
            friction=0.35,
            speed=20.0,
            free_roll=True,
        )
        on_rollers = solve(held, *roller, models)
        rig = np.bincount(on_rollers.point, on_rollers.power, whole.size) / 20.0
        for k in range(whole.size):
            yield {
                "what": "curve",
                "vehicle": name,
                "radius_m": radius[k // 2],
                "axle": ("leading", "trailing")[k % 2],
                "shift_mm": 1e3 * shift[k],
                "yaw_mrad": 1e3 * running.yaw[k],
                "lateral_force_kN": -1e-3 * forces.force[k],
                "quotient": forces.derailment_quotient[k, 1],
                "wear_number_N": forces.power[k] / 20.0,
                "rig_wear_number_N": rig[k],
            }


def campaign(out, name, **keys):
    """Row of a campaign of the shipped vehicle with other keys.

    Also its depth along the right wheel.
    """
    spent, settled = [0.0], evolution.settled_state

    def timed(*arguments, **options):
        begin = time.perf_counter()
        try:
            return settled(*arguments, **options)
        finally:
            spent[0] += time.perf_counter() - begin

    evolution.settled_state, begin = timed, time.perf_counter()
    try:
        (path,) = wearsim.run(
            SCENE,
            out,
            overrides=[
                Override(f"vehicle.{key}", value) for key, value in keys.items()
            ],
        )
    finally:
        evolution.settled_state = settled
    whole = time.perf_counter() - begin
    with wearsim.open_results(path) as result:
        last = result.isel(step=-1)
        depth, names = last["wear_depth"].values[0], last["operating_point_name"].values
        straight = (
            last["wear_share"]
            .values[[str(one).startswith("straight") for one in names]]
            .sum()
        )
        return {
            "what": "campaign",
            "name": name,
            "area_mm2": 1e6 * last["worn_area"].values[0],
            "depth_um": 1e6 * depth.max(),
            "straight": float(straight),
            "operation": spent[0] / whole,
        }, depth


def campaigns(folder):
    """Rows of the shipped scene with each motion on straight track.

    Also with positions that stay.
    """
    depths = {}
    for rule in RULES:
        row, depths[rule] = campaign(folder / rule, rule, tangent=rule)
        yield row
    row, frozen = campaign(folder / "frozen", "frozen", positions="frozen")
    found = depths["suspended"]
    yield {**row, "difference": float(np.abs(frozen - found).max() / found.max())}


def figure(curve):
    """Angle of attack and wear number of axles over the radius, a line per vehicle."""
    shown = {
        "yaw_mrad": "Yaw [mrad], positive to the inside of the curve",
        "wear_number_N": "Wear number of the axle [N]",
    }

    def draw(ax, _, column):
        name = list(shown)[column]
        for index, vehicle in enumerate(VEHICLES):
            rows = curve[curve["vehicle"] == vehicle]
            for axle, line in zip(("leading", "trailing"), WHEEL_LINES, strict=True):
                own = rows[rows["axle"] == axle]
                text = f"{vehicle.replace('_', ' ')}, {axle} axle"
                look = {"ls": line, "color": SERIES_COLOURS[index], "lw": 1.2}
                ax.plot(own["radius_m"], own[name], label=text, **look)
        ax.set_xscale("log")
        ax.set_xticks(TICKS, list(map(str, TICKS)))
        ax.xaxis.set_minor_formatter(NullFormatter())
        if column:
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        label_axes(ax, "Curve radius [m]", shown[name])

    return panels(1, 2, draw, height=2.9, edges=(0.95, 0.15, 0.5, 0.95), key_columns=3)


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    file = chosen.out / "operation.csv"
    if not chosen.from_csv:
        with tempfile.TemporaryDirectory() as folder:
            write_csv(pd.DataFrame([*curves(), *campaigns(Path(folder))]), file)
    rows = pd.read_csv(file)
    curve = rows[rows["what"] == "curve"]
    save_svg(figure(curve), chosen.out / "operation.svg")
    tables = []
    for name in VEHICLES:
        own = curve[curve["vehicle"] == name]
        pairs = [
            own[own["axle"] == axle].to_dict("records")
            for axle in ("leading", "trailing")
        ]
        tables.append(
            Table(
                [
                    "R [m]",
                    "shift [mm]",
                    "yaw [mrad]",
                    "Y/Q",
                    "wear number [N]",
                    "on rollers [N]",
                    "trailing: shift",
                    "yaw",
                    "wear number",
                    "on rollers",
                ],
                [
                    [
                        f"{one['radius_m']:g}",
                        f"{one['shift_mm']:.2f}",
                        f"{one['yaw_mrad']:.2f}",
                        f"{one['quotient']:.2f}",
                        f"{one['wear_number_N']:.0f}",
                        f"{one['rig_wear_number_N']:.0f}",
                        f"{two['shift_mm']:.2f}",
                        f"{two['yaw_mrad']:.2f}",
                        f"{two['wear_number_N']:.0f}",
                        f"{two['rig_wear_number_N']:.0f}",
                    ]
                    for one, two in zip(*pairs, strict=True)
                ],
                caption=(
                    f"{name.replace('_', ' ').capitalize()}, leading axle, then the "
                    "trailing one."
                ),
            )
        )
    run = rows[rows["what"] == "campaign"].to_dict("records")
    base = run[0]
    ways = Table(
        [
            "Campaign",
            "worn area [mm²]",
            "deepest [µm]",
            "area over suspended",
            "wear made on straight track",
        ],
        [
            [
                one["name"],
                f"{one['area_mm2']:.3g}",
                f"{one['depth_um']:.0f}",
                f"{one['area_mm2'] / base['area_mm2']:.2f}",
                f"{100 * one['straight']:.0f} %",
            ]
            for one in run
        ],
        caption=(
            "`workflows/field.toml` to its end, right wheel, by the motion on "
            "straight track; frozen: suspended, with the positions in curves that the "
            "new wheels have."
        ),
    )
    frozen = run[-1]
    blocks = [
        "S1002 on 60E1 1:40, friction 0.35, 72 km/h, curves to the right with 50 mm "
        "of cant deficiency. The vehicles are made up from textbook magnitudes. On "
        "rollers (radius 1 m, no track curvature) the same wheelset is held at the "
        "same shift and yaw with the same loads: a rig that copies the position and "
        "not the curve.",
        Figure(
            "operation.svg",
            "Yaw and wear number of the leading (full) and trailing (dashed) axles.",
        ),
        *tables,
        "## Straight track, and the coupling of wear and running",
        ways,
        "With positions of the new wheels kept, the depth differs from that of those "
        f"found anew by up to {100 * frozen['difference']:.0f} % of the deepest. "
        f"Finding them takes {100 * base['operation']:.0f} % of the time of the "
        "campaign.",
    ]
    return write_report(
        chosen.out, __file__, "Vehicles: where axles run, and what wears them", blocks
    )


if __name__ == "__main__":
    main()
