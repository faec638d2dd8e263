"""Whether the new wheels of a scene find a contact at every operating point: the last check before a run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from wearsim.contact import geometry
from wearsim.contact.geometry import Attitude
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.errors import ContactError, Fault, NumericalError, SceneError
from wearsim.scene.load import CampaignSetup, Scene, build
from wearsim.scene.models import CompareScene, FieldScene, RigScene

_BATCH = 64
"""Points whose gaps are held in memory at a time."""


def check_contact(scene: Scene) -> None:
    """Solve the normal contact of the new wheels at all operating points and refuse what has no answer.

    Parameters
    ----------
    scene : Scene
        As loaded.

    Raises
    ------
    SceneError
        With one fault for each block, class or watched shift at which a wheel does not touch, or its patch
        reaches the edge of a profile.
    """
    parts: list[RigScene | FieldScene] = (
        [scene.rig, scene.field] if isinstance(scene, CompareScene) else [scene]
    )
    faults = [fault for part in parts for fault in _faults(part)]
    if faults:
        raise SceneError(faults)


def _faults(scene: RigScene | FieldScene) -> list[Fault]:
    setup = build(scene)
    places = list(_places(scene))
    found: dict[tuple[str | int, ...], Fault] = {}
    for start in range(0, len(places), _BATCH):
        rows = np.arange(start, min(start + _BATCH, len(places)))
        for side in (0, 1):
            if _told(setup, side, rows) is None:
                continue
            for row in rows:  # a batch tells its first row only
                told = None if places[row] in found else _told(setup, side, np.array([row]))
                if told is not None:
                    found[places[row]] = _fault(scene, setup, places[row], int(row), side, told)
    return sorted(found.values(), key=lambda fault: fault.line or 0)


def _told(setup: CampaignSetup, side: int, rows: np.ndarray) -> str | None:
    """Return what is wrong with the contact of one wheel at some points, None where nothing is."""
    conditions, models, wheelset = setup.points.conditions, setup.models, setup.wheelset
    sign = -1.0 if side else 1.0  # a left wheel is solved as the right wheel of the mirrored wheelset
    attitude = Attitude(
        *(sign * values[rows] for values in (conditions.shift, conditions.yaw, conditions.roll))
    )
    gap = geometry.gap(
        geometry.rings(wheelset.left if side else wheelset.right, wheelset.radius),
        geometry.contour(setup.counterface.profile),
        attitude,
        half_span=wheelset.half_span,
        nominal_radius=wheelset.radius,
        curvature=setup.counterface.curvature,
    )
    try:
        NORMAL_MODELS[models.normal](
            gap,
            conditions.wheel_load[rows],
            vertical=True,
            effective_modulus=models.effective_modulus,
            strips=models.strips,
            parameters=dict(models.parameters),
        )
    except NumericalError:
        return None  # no fault of the scene; the run tells it
    except ContactError as error:
        return str(error)
    return None


def _places(scene: RigScene | FieldScene) -> Iterator[tuple[str | int, ...]]:
    """Key behind each operating point, in the order of the points."""
    if isinstance(scene, RigScene):
        for index in range(len(scene.operation.blocks)):
            yield ("operation", "block", index, "shift_mm")
    else:
        for index, run in enumerate(scene.operation.classes):
            for _ in range(run.positions if run.shift_std_mm > 0 else 1):
                yield ("operation", "class", index, "shift_mean_mm")
    if scene.operation.monitor is not None:
        for index in range(len(scene.operation.monitor.shifts_mm)):
            yield ("operation", "monitor", "shifts_mm", index)


def _fault(
    scene: RigScene | FieldScene,
    setup: CampaignSetup,
    place: tuple[str | int, ...],
    row: int,
    side: int,
    told: str,
) -> Fault:
    key = place[-1] if isinstance(place[-1], str) else place[-2]
    conditions = setup.points.conditions
    shift, yaw = 1e3 * conditions.shift[row], 1e3 * conditions.yaw[row]
    wheel = "left" if side else "right"
    message = (
        f"{key}: at a shift of {shift:.4g} mm and a yaw of {yaw:.4g} mrad the {wheel} wheel "
        f"has no contact to solve: {told}; check the shift, gauge_mm = {scene.counterface.gauge_mm:g} and "
        f"how far both profiles reach"
    )
    return Fault(message, str(scene.origin.path), scene.line(*place))
