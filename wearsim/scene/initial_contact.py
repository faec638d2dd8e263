"""Initial contact of the new wheels of a scene at every operating point: the last check before a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wearsim.contact import geometry
from wearsim.contact.equilibrium import resting_roll
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactSolution, check_loads, solve_each
from wearsim.damage.wear import passage_depth
from wearsim.errors import ContactError, Fault, NumericalError, SceneError
from wearsim.operation.left_out import LARGEST_SHARE, carried_share, mask_of
from wearsim.operation.points import select
from wearsim.scene.messages import by_line, key_of, shift_ranges
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.noise import noise_faults
from wearsim.scene.overrides import at_its_source
from wearsim.scene.read import CampaignScene
from wearsim.scene.setup import CampaignSetup, build, warnings_of
from wearsim.toml_faults import KeyPath

_BATCH = 64
"""Points whose gaps are held in memory at a time."""

LARGEST_TILT = 1e-3
"""Roll that a scene may leave out without a warning [rad]: contact angles change by as much."""


def check_contact(scene: CampaignScene) -> tuple[Fault, ...]:
    """Solve the normal contact of the new wheels at all operating points of a scene of `load_scene`.

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
        if noise := noise_faults(part, setup):  # a contact that noise decides has no faults of the scene
            faults += noise
            continue
        own, tilt = _contact_faults(part, setup, places)
        left_out = _left_out(own, setup)
        if own and not left_out:
            faults += own
            continue
        warnings += by_line(left_out + list(warnings_of(part)) + _roll_warnings(part, setup, places, tilt))
    if faults:
        raise SceneError([at_its_source(fault) for fault in faults])
    return tuple(warnings)


def _left_out(faults: list[Fault], setup: CampaignSetup) -> list[Fault]:
    """Faults of points that a campaign leaves out, as warnings; none where those carry too much wear."""
    if not faults:
        return []
    points, failed = setup.points, dict[int, ContactError]()

    def worn(solution: ContactSolution) -> tuple[IntArray, FloatArray]:
        depth = np.sum(passage_depth(solution.fields, solution.area, setup.wear), axis=(0, 2))
        return solution.point, depth * solution.patch.width

    models = replace(setup.models, tangential="fastsim")
    try:
        parts = solve_each(points.conditions, setup.wheelset, setup.counterface, models, worn, failed=failed)
    except ContactError:  # of no point: the grid
        return []
    point, area = (np.concatenate(values) for values in zip(*parts, strict=True))
    out = mask_of(failed, len(points.label))
    rate = np.where(out, np.nan, np.bincount(point, area, out.size))
    share = carried_share(points.weight * points.environment, points.of_class, rate, out)
    if not out.any() or share > LARGEST_SHARE or (points.weight[out] == 0.0).any():
        return []
    text = f"such points are left out, together they carry {100.0 * share:.2g} % of the wear"
    return [replace(fault, message=f"{fault.message}; {text}") for fault in faults]


def _contact_faults(
    scene: RigScene | FieldScene, setup: CampaignSetup, places: list[KeyPath]
) -> tuple[list[Fault], FloatArray]:
    """Faults of points without contact, and by how much the wheelset would roll further at each [rad]."""
    faults: dict[KeyPath, Fault] = {}
    tilt = np.zeros(len(places))
    if setup.points.conditions.free_roll:
        for number, place in enumerate(places):
            fault = None if place in faults else _without_rest(setup, number)
            if fault is not None:
                faults[place] = _fault(scene, setup, place, number, *fault)
        _add_lifted(scene, setup, places, faults)
        return by_line(list(faults.values())), tilt
    for start in range(0, len(places), _BATCH):
        rows = np.arange(start, min(start + _BATCH, len(places)))
        for side in (0, 1):
            displacement = _displacement(setup, side, rows)
            if isinstance(displacement, str):
                for row in rows:  # the error of a batch is that of its first row
                    text = None if places[row] in faults else _displacement(setup, side, np.array([row]))
                    if isinstance(text, str):
                        faults[places[row]] = _fault(scene, setup, places[row], int(row), side, text)
            elif displacement is not None:
                tilt[rows] += (-1.0 if side else 1.0) * displacement / (2.0 * setup.wheelset.half_span)
    _add_lifted(scene, setup, places, faults)
    return by_line(list(faults.values())), tilt


def _add_lifted(
    scene: RigScene | FieldScene, setup: CampaignSetup, places: list[KeyPath], faults: dict[KeyPath, Fault]
) -> None:
    """Add faults of places without one, at which creep forces lift a wheel."""
    rows = np.array([row for row, place in enumerate(places) if place not in faults], dtype=np.int64)
    for start in range(0, rows.size, _BATCH):
        part = rows[start : start + _BATCH]
        if _lifted(setup, part) is None:
            continue
        for row in part:  # the error of a batch is that of its first row
            error = None if places[row] in faults else _lifted(setup, part[part == row])
            if error is not None and not isinstance(error, NumericalError):
                place = places[row]
                text = str(error).rpartition(" mrad: ")[2]  # the fault names shift and yaw itself
                faults[place] = _fault(scene, setup, place, int(row), error.side, text, lifted=True)


def _lifted(setup: CampaignSetup, rows: IntArray) -> ContactError | None:
    """Error of loads that contact forces cannot balance at some points."""
    conditions = select(setup.points, rows).conditions
    problem = (setup.wheelset, setup.counterface, replace(setup.models, tangential="fastsim"))
    try:
        if conditions.free_roll:  # the roll follows from the loads
            solve_each(conditions, *problem, lambda _: None)
        else:
            check_loads(conditions, *problem)
    except ContactError as error:
        return error
    return None


def _displacement(
    setup: CampaignSetup, side: int, rows: IntArray, roll: FloatArray | None = None
) -> FloatArray | str | None:
    """Vertical displacement of one wheel at some points [m], or its fault; None without either.

    `roll` replaces that of the points [rad].
    """
    conditions, models, wheelset = setup.points.conditions, setup.models, setup.wheelset
    roll = conditions.roll[rows] if roll is None else roll
    sign = -1.0 if side else 1.0  # a left wheel is solved as the right wheel of the mirrored wheelset
    pose = WheelsetPose(sign * conditions.shift[rows], sign * conditions.yaw[rows], sign * roll)
    gap = geometry.gap(
        geometry.wheel_surface(wheelset.left if side else wheelset.right, wheelset.radius),
        geometry.counterface_profile(setup.counterface.profiles[side]),
        pose,
        half_span=wheelset.half_span,
        nominal_radius=wheelset.radius,
        curvature=setup.counterface.curvature,
    )
    try:
        solution = NORMAL_MODELS[models.normal](
            gap,
            np.arange(rows.size),
            conditions.loads[rows, side],
            vertical=True,
            effective_modulus=models.effective_modulus,
            resolution=models.resolution,
            parameters=dict(models.parameters),
        )
    except NumericalError:
        return None  # no fault of the scene; the run reports it
    except ContactError as error:
        return str(error)
    return solution.vertical_displacement[np.searchsorted(solution.patch.row, np.arange(rows.size))]


def _without_rest(setup: CampaignSetup, row: int) -> tuple[int | None, str] | None:
    """Return the wheel, and why the wheelset cannot rest on both; None if it can."""
    level = [_displacement(setup, side, np.array([row])) for side in (0, 1)]
    if any(displacement is None for displacement in level) or _resting_roll(setup, row) is not None:
        return None
    side = next((side for side, text in enumerate(level) if isinstance(text, str)), None)
    text = "no roll of the wheelset lets both wheels carry their loads" if side is None else str(level[side])
    return side, text


def _roll_warnings(
    scene: RigScene | FieldScene, setup: CampaignSetup, places: list[KeyPath], tilt: FloatArray
) -> list[Fault]:
    """Largest difference of the roll of each block or class to that of resting on both wheels."""
    worst: dict[KeyPath, tuple[float, int]] = {}
    for row, place in enumerate(places):
        if "monitor" in place or abs(tilt[row]) <= 0.5 * LARGEST_TILT:  # at rest it is seldom twice as much
            continue
        resting = _resting_roll(setup, row)
        if resting is not None:
            left_out = resting - float(setup.points.conditions.roll[row])
            if abs(left_out) > max(LARGEST_TILT, abs(worst.get(place, (0.0, 0))[0])):
                worst[place] = (left_out, row)
    warnings = []
    for place, (left_out, row) in worst.items():
        given, shift = 1e3 * setup.points.conditions.roll[row], 1e3 * setup.points.conditions.shift[row]
        text = (
            f"roll_mrad = {given:.4g}: at a shift of {shift:.3g} mm the wheelset rests on both wheels at a "
            f'roll of {given + 1e3 * left_out:.2g} mrad; give that roll, or roll = "free" in [contact], or '
            "smaller shifts"
        )
        warnings.append(scene.fault((*place[:3], "roll_mrad"), text))
    return warnings


def _resting_roll(setup: CampaignSetup, row: int) -> float | None:
    """Roll at which both wheels carry their loads [rad]; None where there is none."""
    rows = np.array([row])

    def displacements(angle: FloatArray, _: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        right, left = (_displacement(setup, side, rows, angle) for side in (0, 1))
        if isinstance(right, np.ndarray) and isinstance(left, np.ndarray):
            return right, left
        raise ContactError("no contact at this roll")

    try:
        angle, converged = resting_roll(
            displacements, setup.points.conditions.roll[rows], setup.wheelset.half_span
        )
    except ContactError:
        return None
    return float(angle[0]) if converged[0] else None


def _fault(
    scene: RigScene | FieldScene,
    setup: CampaignSetup,
    place: KeyPath,
    row: int,
    side: int | None,
    text: str,
    *,
    lifted: bool = False,
) -> Fault:
    conditions = setup.points.conditions
    shift, yaw = 1e3 * conditions.shift[row], 1e3 * conditions.yaw[row]
    who = "wheelset" if side is None else "left wheel" if side else "right wheel"
    reach = f"check the shift, gauge_mm = {scene.counterface.gauge_mm:g} and how far both profiles reach"
    fault = f"cannot carry its load: {text}" if lifted else f"has no contact to solve: {text}; {reach}"
    message = f"{key_of(place)}: at a shift of {shift:.4g} mm and a yaw of {yaw:.4g} mrad the {who} {fault}"
    return scene.fault(place, message)
