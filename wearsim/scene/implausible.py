"""Values in range that are hardly meant: one table of tests and texts, all of them warnings."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from wearsim.scene.models import FieldScene, RigScene
from wearsim.toml_faults import KeyPath, shown


class Implausible(NamedTuple):
    """A key, the test of its table (in a scene) that its value is hardly meant, and what to look at."""

    key: str
    test: Callable[[Any], bool]
    text: str


LUBRICATED = re.compile(r"wet|water|rain|lubri|greas|oil\b|oily|leaves", re.IGNORECASE)
"""Names of surfaces that are not dry."""

OF_SCENE: tuple[tuple[str, Implausible], ...] = (
    (
        "wheelset",
        Implausible(
            "radius_mm",
            lambda scene: scene.wheelset.radius_mm > 650.0,
            "is a radius, and wheels of railways have 150 to 650 mm: half the diameter is meant",
        ),
    ),
    (
        "counterface",
        Implausible(
            "gauge_mm",
            lambda scene: not 50.0 <= scene.counterface.gauge_mm - scene.wheelset.back_to_back_mm <= 110.0,
            "is not that of a wheelset with this back_to_back_mm, which is 60 to 90 mm less: give both of "
            "one railway",
        ),
    ),
    (
        "contact",
        Implausible(
            "youngs_GPa",
            lambda scene: not 90.0 <= scene.contact.youngs_GPa <= 230.0,
            "is no Young's modulus of wheels: steel has about 210, cast iron 100",
        ),
    ),
)
"""Tests of a scene, by the table of the key."""


OF_RUN = (
    Implausible(
        "yaw_mrad",
        lambda run: abs(getattr(run, "yaw_mrad", 0.0)) > 20.0,
        "is beyond the angles of attack of the tightest curves, about 20: it is in milliradians",
    ),
    Implausible(
        "friction",
        lambda run: run.friction > 0.4 and LUBRICATED.search(run.name) is not None,
        "is that of dry surfaces, and the name says otherwise: wet or lubricated ones have less than 0.3",
    ),
    Implausible(
        "load_kN",
        lambda run: (getattr(run, "load_kN", None) or 0.0) > 200.0,
        "is the load of one wheel, and the heaviest axles carry 400 kN: half the axle load is meant",
    ),
    Implausible(
        "axle_load_kN",
        lambda run: (getattr(run, "axle_load_kN", None) or 0.0) > 400.0,
        "is beyond the heaviest axles, which carry 400 kN",
    ),
    Implausible(
        "environment",
        lambda run: run.environment > 2.0,
        "multiplies the wear of the dry laboratory, and service wears less: factors are 1 and below",
    ),
    Implausible(
        "shift_mean_mm",
        lambda run: (
            (getattr(run, "curve_radius_m", None) or 0.0) * getattr(run, "shift_mean_mm", 0.0) > 0.0
            and abs(run.shift_mean_mm) >= 1.0
        ),
        "is to the inside of the curve of curve_radius_m, and wheelsets run to the outside: both are "
        "positive to the right",
    ),
)
"""Tests of blocks and classes, those of a vehicle's track, too."""


def implausible(scene: RigScene | FieldScene) -> Iterator[tuple[KeyPath, str]]:
    """Give path and text of each value of a scene that is hardly meant."""
    for table, one in OF_SCENE:
        if one.test(scene):
            yield (
                (table, one.key),
                f"{one.key} = {getattr(getattr(scene, table), one.key):g} {one.text}",
            )
    runs: dict[KeyPath, Any] = dict(scene.operation.runs)
    if isinstance(scene, FieldScene) and scene.vehicle is not None:
        runs |= {("vehicle", "class", k): one for k, one in enumerate(scene.vehicle.track)}
    for path, run in runs.items():
        for one in OF_RUN:
            if one.test(run):
                value = f"{one.key} = {getattr(run, one.key):g}"
                yield (*path, one.key), f"{value} in {path[1]} {shown(run.name)} {one.text}"
    names = Counter(run.name for run in runs.values())
    for path, run in runs.items():
        if names.pop(run.name, 1) > 1:
            text = (
                f"name = {shown(run.name)} is that of another {path[1]}, too: tables and figures cannot tell"
            )
            yield (*path, "name"), f"{text} them apart"
