"""Values in range that are hardly meant: one table of tests and texts.

Wheels on the other side. Warnings.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import PurePath
from typing import Any, NamedTuple

from wearsim.errors import Fault, shown
from wearsim.scene.models import FieldScene, RigScene
from wearsim.toml_faults import KeyPath


class Implausible(NamedTuple):
    """A key of a table, the test of its scene or run that its value is hardly meant.

    And what to look at.
    """

    table: str  # in the scene, or "" of all blocks and classes that have the key
    key: str
    test: Callable[[Any], bool]
    text: str


LUBRICATED = re.compile(r"wet|water|rain|lubri|greas|oil\b|oily|leaves", re.IGNORECASE)
"""Names of surfaces that are not dry."""

TESTS = (
    Implausible(
        "wheelset",
        "radius_mm",
        lambda scene: scene.wheelset.radius_mm > 650.0,
        (
            "is a radius, and wheels of railways have 150 to 650 mm: half the "
            "diameter is meant"
        ),
    ),
    Implausible(
        "counterface",
        "gauge_mm",
        lambda scene: (
            not 50.0
            <= scene.counterface.gauge_mm - scene.wheelset.back_to_back_mm
            <= 110.0
        ),
        "is not that of a wheelset with this back_to_back_mm, which is 60 to 90 mm "
        "less: give both of one railway",
    ),
    Implausible(
        "contact",
        "youngs_GPa",
        lambda scene: not 90.0 <= scene.contact.youngs_GPa <= 230.0,
        "is no Young's modulus of wheels: steel has about 210, cast iron 100",
    ),
    Implausible(
        "",
        "yaw_mrad",
        lambda run: abs(run.yaw_mrad) > 20.0,
        (
            "is beyond the angles of attack of the tightest curves, about 20: it is "
            "in milliradians"
        ),
    ),
    Implausible(
        "",
        "friction",
        lambda run: run.friction > 0.4 and LUBRICATED.search(run.name) is not None,
        (
            "is that of dry surfaces, and the name says otherwise: wet or lubricated "
            "ones have less than 0.3"
        ),
    ),
    Implausible(
        "",
        "load_kN",
        lambda run: run.load_kN > 200.0,
        (
            "is the load of one wheel, and the heaviest axles carry 400 kN: half the "
            "axle load is meant"
        ),
    ),
    Implausible(
        "",
        "axle_load_kN",
        lambda run: run.axle_load_kN > 400.0,
        "is beyond the heaviest axles, which carry 400 kN",
    ),
    Implausible(
        "",
        "environment",
        lambda run: run.environment > 2.0,
        (
            "multiplies the wear of the dry laboratory, and service wears less: "
            "factors are 1 and below"
        ),
    ),
    Implausible(
        "",
        "shift_mean_mm",
        lambda run: (
            abs(run.shift_mean_mm) >= 1.0
            and (run.curve_radius_m or 0.0) * run.shift_mean_mm > 0.0
        ),
        "is to the inside of the curve of curve_radius_m, and wheelsets run to the "
        "outside: both are positive to the right",
    ),
)


def implausible(scene: RigScene | FieldScene) -> Iterator[tuple[KeyPath, str]]:
    """Give path and text of each value of a scene that is hardly meant."""
    runs: dict[KeyPath, Any] = dict(scene.operation.runs)
    if scene.vehicle is not None:
        runs |= {
            ("vehicle", "class", k): track_class
            for k, track_class in enumerate(scene.vehicle.track)
        }
    for check in TESTS:
        if check.table and check.test(scene):
            value = getattr(getattr(scene, check.table), check.key)
            yield (check.table, check.key), f"{check.key} = {value:g} {check.text}"
        for path, run in () if check.table else runs.items():
            if getattr(run, check.key, None) is not None and check.test(run):
                value = f"{check.key} = {getattr(run, check.key):g}"
                yield (
                    (*path, check.key),
                    f"{value} in {path[1]} {shown(run.name)} {check.text}",
                )
    names = Counter(run.name for run in runs.values())
    for path, run in runs.items():
        if names.pop(run.name, 1) > 1:
            text = (
                f"name = {shown(run.name)} is that of another {path[1]}, too: tables "
                "and figures cannot tell them apart"
            )
            yield (*path, "name"), text


_SIDES = {"l": "left", "r": "right"}
_IN_NAME = re.compile(r"(?<![a-z])(left|right|links|rechts)(?![a-z])")


def side_of(name: str, header: Mapping[str, str]) -> tuple[str, str]:
    """Side of the wheel that the header of a file, or else its name, states.

    And which does; "" if none.
    """
    stated = {key.lower(): value.strip().lower() for key, value in header.items()}.get(
        "side", ""
    )
    if side := _SIDES.get(stated[:1], ""):
        return side, "header"
    words = {_SIDES[word[0]] for word in _IN_NAME.findall(PurePath(name).stem.lower())}
    return (words.pop(), "name") if len(words) == 1 else ("", "")


def side_warnings(
    scene: RigScene | FieldScene, headers: Mapping[str, tuple[str, Mapping[str, str]]]
) -> list[Fault]:
    """Warnings of profiles of the other side, where both wheels have a file, by key.

    Its name and header.
    """
    warnings = []
    for key, wheel in (
        (("profile", "right"), ("profile_left", "left"))
        if "profile_left" in headers
        else ()
    ):
        name, header = headers.get(key, ("", {}))
        side, where = side_of(name, header)
        if side not in ("", wheel):
            text = (
                f"{key} = {shown(name)} acts on the {wheel} wheel, and its {where} "
                f"says {side}: exchange profile and profile_left"
            )
            warnings.append(scene.fault(("wheelset", key), text))
    return warnings
