"""Initial contact of the new wheels of a scene at every operating point: the last check before a run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactSolution, available_cores, solve_each
from wearsim.damage.wear import passage_depth
from wearsim.errors import ContactError, Fault, NumericalError, SceneError
from wearsim.operation.left_out import LARGEST_SHARE, carried_share, mask_of
from wearsim.scene.messages import by_line, key_of, shift_ranges
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.noise import noise_faults
from wearsim.scene.overrides import at_its_source
from wearsim.scene.read import CampaignScene
from wearsim.scene.setup import CampaignSetup, build, warnings_of
from wearsim.toml_faults import KeyPath

LARGEST_TILT = 1e-3
"""Roll that a scene may leave out without a warning [rad]: contact angles change by as much."""


_Failed = Mapping[int, ContactError]
"""Errors of points without contact, by their row."""


def check_contact(scene: CampaignScene, threads: int | None = None) -> tuple[Fault, ...]:
    """Solve the contact of the new wheels at all operating points of a scene of `load_scene`.

    With FASTSIM, whatever the tangential model; on so many threads, by default all available.

    Returns
    -------
    tuple of Fault
        Warnings: what runs, but deserves a second look before. In the order of files and lines.

    Raises
    ------
    SceneError
        With one fault for each block, class or watched shift at which a wheel has no contact, or its patch
        reaches the edge of a profile, or creep forces lift it; before these, with one for each measured
        profile whose noise decides the contact. Points are warnings where together they carry less of the
        wear than a campaign leaves out.
    """
    faults: list[Fault] = []
    warnings: list[Fault] = []
    for part in scene.parts:
        setup = build(part)
        places = [path for path, _, _, points in shift_ranges(part) for _ in range(points)]
        try:
            if noise := noise_faults(part, setup):  # a contact that noise decides has no faults of the scene
                faults += noise
                continue
            failed, share = _failed(setup, threads or available_cores())
        except ContactError as error:  # of no point: the grid
            faults.append(part.fault(("contact",), str(error)))
            continue
        own = _faults(part, setup, places, failed)
        if own and share > LARGEST_SHARE:
            faults += own
            continue
        text = f"; such points are left out, together they carry {100.0 * share:.2g} % of the wear"
        own = [replace(fault, message=f"{fault.message}{text}") for fault in own]
        warnings += by_line([*own, *warnings_of(part), *_roll_warnings(part, setup, places, failed)])
    if faults:
        raise SceneError([at_its_source(fault) for fault in faults])
    return tuple(warnings)


def _failed(setup: CampaignSetup, threads: int) -> tuple[dict[int, ContactError], float]:
    """Errors of points without contact, and the share of the wear they carry; inf if one only watches."""
    points, wear, failed = setup.points, setup.wear, dict[int, ContactError]()

    def worn(solution: ContactSolution) -> tuple[IntArray, FloatArray]:
        depth = np.sum(passage_depth(solution.fields, solution.area, wear), axis=(0, 2))
        return solution.point, depth * solution.patch.width

    parts, rest = list[tuple[IntArray, FloatArray]](), np.arange(len(points.label))
    for one in (setup.models, *setup.fallbacks):
        failed, conditions = {}, points.conditions.at(rest)
        problem = (setup.wheelset, setup.counterface, replace(one, tangential="fastsim"))
        found = solve_each(
            conditions, *problem, worn, threads=threads, failed=failed, fields=wear.needs_fields or "work"
        )
        parts += [(rest[point], area) for point, area in found]
        failed = {int(rest[row]): error for row, error in failed.items()}
        rest = np.array(sorted(failed), dtype=np.int64)
        if not failed:
            break
    if not failed:
        return failed, 0.0
    point, area = (np.concatenate(values) for values in zip(*parts, strict=True))
    out = mask_of(failed, len(points.label))
    if (points.weight[out] == 0.0).any():
        return failed, np.inf
    rate = np.where(out, np.nan, np.bincount(point, area, out.size))
    return failed, carried_share(points.weight * points.environment, points.of_class, rate, out)


def _faults(
    scene: RigScene | FieldScene, setup: CampaignSetup, places: list[KeyPath], failed: _Failed
) -> list[Fault]:
    """One fault for each place with points that failed, of the first of them."""
    faults: dict[KeyPath, Fault] = {}
    conditions = setup.points.conditions
    problem = (setup.wheelset, setup.counterface, replace(setup.models, tangential="fastsim"))
    for row, error in sorted(failed.items()):
        place = places[row]
        # a point that does not converge is no fault of the scene; the run reports it
        if place in faults or isinstance(error, NumericalError):
            continue
        if error.row != row:  # several that failed together share the error of the first one
            try:
                solve_each(conditions.at(np.array([row])), *problem, lambda _: None)
            except ContactError as own:
                error = own
        shift, yaw = 1e3 * conditions.shift[row], 1e3 * conditions.yaw[row]
        who = "wheelset" if error.side is None else "left wheel" if error.side else "right wheel"
        reach = f"check the shift, gauge_mm = {scene.counterface.gauge_mm:g} and how far both profiles reach"
        text = str(error).rpartition(" mrad: ")[2].replace("check shift, gauge and profiles", reach)
        where = f"{key_of(place)}: at a shift of {shift:.4g} mm and a yaw of {yaw:.4g} mrad"
        faults[place] = scene.fault(place, f"{where} the {who} cannot carry its load: {text}")
    return by_line(list(faults.values()))


def _roll_warnings(
    scene: RigScene | FieldScene, setup: CampaignSetup, places: list[KeyPath], failed: _Failed
) -> list[Fault]:
    """Where the wheelset would roll much further: the worst outermost point of each block or class."""
    conditions, shift = setup.points.conditions, setup.points.conditions.shift
    if conditions.free_roll:
        return []
    rows = defaultdict[KeyPath, list[int]](list)
    for row, place in enumerate(places):
        if row not in failed and "monitor" not in place:
            rows[place].append(row)
    ends = {pick(some, key=shift.__getitem__) for some in rows.values() for pick in (min, max)}
    # how far it rolls hardly depends on the models
    models = replace(setup.models, normal="kik_piotrowski", tangential="fastsim", strips=16, cells=16)
    index = np.array(sorted(ends), dtype=np.int64)
    free = replace(conditions.at(index), free_roll=True)
    resting: dict[int, float] = {}

    def roll(solution: ContactSolution) -> None:
        resting.update(zip(index[solution.point].tolist(), solution.roll.tolist(), strict=True))

    solve_each(free, setup.wheelset, setup.counterface, models, roll, failed={}, fields="work")
    tilt = {row: abs(resting[row] - conditions.roll[row]) for row in sorted(resting)}
    worst: dict[KeyPath, int] = {}
    for row in sorted(tilt, key=lambda row: -tilt[row]):
        if tilt[row] > LARGEST_TILT:
            worst.setdefault(places[row], row)
    return [
        scene.fault(
            (*place[:3], "roll_mrad"),
            f"roll_mrad = {1e3 * conditions.roll[row]:.4g}: at a shift of {1e3 * shift[row]:.3g} mm the "
            f"wheelset rests on both wheels at a roll of {1e3 * resting[row]:.2g} mrad; give that roll, or "
            'roll = "free" in [contact], or smaller shifts',
        )
        for place, row in worst.items()
    ]
