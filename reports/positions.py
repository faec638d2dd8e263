"""Where worn wheelsets run with strips, against the half-space.

Positions and wear numbers.

    python reports/positions.py [--out DIR] [--from-csv]

writes positions.md and positions.csv; some ten minutes of one core.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from writing import HERE, Table, options, write_csv, write_report

import wearsim
from wearsim.campaign.state import worn_wheels
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve
from wearsim.operation.bogie import Bogies
from wearsim.operation.resultants import resultants
from wearsim.operation.states import settle
from wearsim.scene import build, load_scene
from wearsim.scene.overrides import Override

TITLE = "Worn wheelsets: positions with strips and with the half-space"
SCENES = {"rig": (1260.0, 5), "field": (10_000.0, 1)}  # distance [km], worn states
BOGIES = 5  # of the field, both axles of each
MODELS = ("standard", "accurate")
SHIFT_TARGET = 20.0  # [um]
POWER_TARGET = 3.0  # of the wear number [%]
LEAST_WEAR_NUMBER = 1.0  # below which it is compared with this one [N]

INTRODUCTION = f"""\
The shipped scenes run with `standard`: `rig.toml`, four blocks by lateral force, and `field.toml`,
bogies in curves. On their worn wheels, at equal distances and at the end, each wheelset is let run
where it is in balance with `standard` and with `accurate`, the half-space pair, from the same start.
Shifts are those of the axle; the wear number is the frictional power of both wheels over the speed.
Differences of wear numbers are over those of `accurate`, or {LEAST_WEAR_NUMBER:g} N if that is more.
Targets: {SHIFT_TARGET:g} um and {POWER_TARGET:g} %.

Where the lateral force hardly changes with the shift, as on the tread under 1.5 kN, a small difference of the
spin's creep forces moves a wheelset far; on the flange and in bogies it does not.
"""


def worn_states(name, distance, states, folder):
    """Give the set-up of a scene, distances [km] and worn wheelsets there, in turn."""
    path = HERE.parent / "workflows" / f"{name}.toml"
    overrides = [Override("campaign.distance_km", distance)]
    (result,) = wearsim.run(path, folder / name, overrides=overrides)
    setup = build(load_scene(path, overrides=overrides))
    with wearsim.open_results(result) as data:
        at = data["distance"].values / 1e3
        for part in np.arange(1, states + 1) / states:
            row = int(np.abs(at - part * distance).argmin())
            profile = data["profile_y"].values[row], data["profile_z"].values[row]
            right, left = worn_wheels(setup.wheelset, *profile)
            yield setup, at[row], replace(setup.wheelset, right=right, left=left)


def chosen_points(setup):
    """Conditions and forces of the points that are compared, and their names."""
    points = setup.points
    controlled, bogies = points.controlled, points.controlled.bogies
    rows = np.flatnonzero(controlled.any)
    if bogies is not None:
        few = np.linspace(0, bogies.leading.size - 1, BOGIES).astype(int)
        rows = np.stack([bogies.leading[few], bogies.trailing[few]], axis=1).ravel()
        first = 2 * np.arange(BOGIES)
        own = Bogies(
            bogies.vehicle,
            first,
            first + 1,
            bogies.acceleration[few],
            bogies.in_front[few],
        )
        controlled = replace(controlled.at(rows), bogies=own)
    else:
        controlled = controlled.at(rows)
    return points.conditions.at(rows), controlled, [points.label[row] for row in rows]


def rows_of(name, distance, states, folder):
    """Rows of the worn states of a scene.

    Shift, yaw and wear number of each wheelset with both pairs.
    """
    for setup, at, wheelset in worn_states(name, distance, states, folder):
        conditions, controlled, labels = chosen_points(setup)
        bodies, values, running = (wheelset, setup.counterface), {}, None
        for model in MODELS:
            models = replace(setup.models, **pair_of(model))
            running = settle(conditions, controlled, *bodies, models, running)
            there = running.conditions(conditions)
            forces = resultants(solve(there, *bodies, models), there.shift.size)
            values[f"{model}_shift_mm"] = 1e3 * there.axle_shift(forces.roll)
            values[f"{model}_yaw_mrad"] = 1e3 * there.yaw
            values[f"{model}_wear_number_N"] = forces.power / there.speed
        frame = pd.DataFrame(values)
        frame.insert(0, "point", labels)
        frame.insert(0, "distance_km", at)
        frame.insert(0, "scene", name)
        yield frame


def pair_of(model):
    """Return normal and tangential model of a pair."""
    models = ContactModels.of(model)
    return {"normal": models.normal, "tangential": models.tangential}


def differences(rows):
    """Differences of `standard` from `accurate`.

    Of the shift [um] and of the wear number [%].
    """
    shift = 1e3 * (rows["standard_shift_mm"] - rows["accurate_shift_mm"])
    reference = rows["accurate_wear_number_N"]
    power = (
        100.0
        * (rows["standard_wear_number_N"] - reference)
        / reference.clip(lower=LEAST_WEAR_NUMBER)
    )
    return shift, power


def table(rows):
    """Table of medians and largest values.

    Also of how many wheelsets meet the targets, by scene.
    """
    body = []
    for scene, own in rows.groupby("scene", sort=False):
        shift, power = (np.abs(one) for one in differences(own))
        body.append(
            [
                f"`{scene}.toml`",
                len(own),
                f"{shift.median():.2g}, {shift.max():.3g}",
                f"{(shift <= SHIFT_TARGET).sum()}",
                f"{power.median():.2g}, {power.max():.3g}",
                f"{(power <= POWER_TARGET).sum()}",
            ]
        )
    head = [
        "scene",
        "wheelsets",
        "shift [um]: median, largest",
        "within",
        "wear number [%]",
        "within",
    ]
    return Table(
        head,
        body,
        caption="`standard` against `accurate`; how many are within the targets.",
    )


def every_point(rows):
    """Table of all wheelsets."""
    shift, power = differences(rows)
    body = [
        [
            row.scene,
            f"{row.distance_km:.5g}",
            row.point,
            f"{row.accurate_shift_mm:.3f}",
            f"{aside:+.1f}",
            f"{row.accurate_wear_number_N:.1f}",
            f"{more:+.1f}",
        ]
        for row, aside, more in zip(rows.itertuples(), shift, power, strict=True)
    ]
    head = [
        "scene",
        "km",
        "point",
        "shift [mm]",
        "difference [um]",
        "wear number [N]",
        "difference [%]",
    ]
    return Table(
        head,
        body,
        "lrlrrrr",
        "Values of `accurate`, and the differences of `standard` from them.",
    )


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    file = chosen.out / "positions.csv"
    if not chosen.from_csv:
        with tempfile.TemporaryDirectory() as folder:
            found = [
                frame
                for name, (distance, states) in SCENES.items()
                for frame in rows_of(name, distance, states, Path(folder))
            ]
        write_csv(pd.concat(found), file)
    rows = pd.read_csv(file)
    blocks = [
        INTRODUCTION,
        table(rows),
        every_point(rows),
        "All values: [positions.csv](positions.csv).",
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
