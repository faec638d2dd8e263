"""[counterface.wear] of a scene: rollers that wear and are turned, rails that lose a stated area."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

from wearsim.damage.wear import WEAR_LAWS
from wearsim.operation.control import CounterfaceWear
from wearsim.scene.section import Section, number

_STATED = (
    "a rail is passed by other wheels, too: state what it loses as area_mm2_per_1000km, or write "
    'kind = "rig" in [scene]'
)
_FOUND = (
    "a roller runs under this wheel alone: its wear follows from the wheel's law times factor; write that, "
    'or kind = "field" in [scene]'
)


class RollerWearSection(Section):
    """[counterface.wear] on a rig: both rollers wear, each under its wheel, and are turned together."""

    not_here: ClassVar[dict[str, str]] = {"area_mm2_per_1000km": _FOUND}
    factor: float = number(
        "counterface_wear_factor",
        "the wear depth of a roller in one passage over that of the wheel by the law of [wear]",
    )
    redress_every_km: float | None = number(
        "redress_distance", "the running after which both rollers are turned back to their new profile", None
    )
    redress_depth_um: float | None = number(
        "redress_depth",
        "the wear depth of either roller at which both are turned back to their new profile",
        None,
    )


class RailWearSection(Section):
    """[counterface.wear] in the field: both rails lose a stated area where the campaign's contacts wear."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        ("factor", "redress_every_km", "redress_depth_um"), _STATED
    )
    area_mm2_per_1000km: float = number(
        "counterface_area_rate", "the area each rail's cross-section loses while the wheelset runs 1000 km"
    )


def counterface_wear(
    section: RollerWearSection | RailWearSection | None, roller_radius: float
) -> CounterfaceWear | None:
    """Return how the counterface wears, in SI units; None if it does not.

    Parameters
    ----------
    section : RollerWearSection, RailWearSection or None
        As read.
    roller_radius : float
        At the profile's top, infinite for a rail [m].
    """
    if section is None:
        return None
    if isinstance(section, RailWearSection):
        return CounterfaceWear(area_rate=1e-12 * section.area_mm2_per_1000km)
    every, depth = section.redress_every_km, section.redress_depth_um
    return CounterfaceWear(
        factor=section.factor,
        radius=roller_radius,
        redress_distance=math.inf if every is None else 1e3 * every,
        redress_depth=math.inf if depth is None else 1e-6 * depth,
    )


def counterface_faults(
    section: RollerWearSection | RailWearSection | None, law: str
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Tell what does not go together with a counterface that wears.

    Parameters
    ----------
    section : RollerWearSection, RailWearSection or None
        As read.
    law : str
        Name of the wear law.

    Yields
    ------
    tuple of (key, message)
        The key as a path from the top of the scene.
    """
    if section is not None and not WEAR_LAWS[law].wears:
        yield (
            ("counterface", "wear"),
            f'[counterface.wear] wears where the law of [wear] does, and law = "{law}" wears nowhere; write '
            "another law, or delete the table",
        )


def counterface_warnings(
    section: RollerWearSection | RailWearSection | None, distance_km: float
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Tell what is allowed but deserves a second look.

    Parameters
    ----------
    section : RollerWearSection, RailWearSection or None
        As read.
    distance_km : float
        Of the campaign [km].

    Yields
    ------
    tuple of (key, message)
        As `counterface_faults`.
    """
    if not isinstance(section, RollerWearSection) or section.redress_every_km is None:
        return
    if section.redress_every_km >= distance_km:
        yield (
            ("counterface", "wear", "redress_every_km"),
            f"redress_every_km = {section.redress_every_km:g} is not reached in distance_km = "
            f"{distance_km:g}: the rollers are not turned by it",
        )
