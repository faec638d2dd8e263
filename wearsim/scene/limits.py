"""[campaign.limits] of a scene: what ends the life of a wheel, and whether the new wheel has it behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pydantic import Field

from wearsim.errors import ProfileError
from wearsim.profile import measures
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.shape import FloatArray, Profile
from wearsim.quantities import QUANTITIES
from wearsim.results.limits import LIMITED
from wearsim.scene.section import Section, number


class LimitsSection(Section):
    """[campaign.limits]: what ends the life of a wheel; the distance at which each is met is told."""

    depth_mm: float | None = number("max_wear_depth", "the largest wear depth", None)
    flange_height_mm: float | None = number("flange_height", "the largest flange height Sh", None)
    flange_thickness_mm: float | None = number("flange_thickness", "the least flange thickness Sd", None)
    flange_gradient_mm: float | None = number("flange_gradient", "the least flange gradient qR", None)
    hollowing_mm: float | None = number("hollowing", "the largest hollowing of the tread", None)
    conicity: float | None = number("equivalent_conicity", "the largest equivalent conicity", None)
    damage: float | None = number(
        "fatigue_damage", "the largest fatigue damage by a law that counts cycles (wlrm)", None
    )
    diameter_mm: float | None = number("wheel_diameter", "the least wheel diameter after turning", None)
    end: bool = Field(False, description="whether the campaign ends at the first limit that is met")


KEYS: Mapping[str, str] = {
    "max_wear_depth": "depth_mm",
    "flange_height": "flange_height_mm",
    "flange_thickness": "flange_thickness_mm",
    "flange_gradient": "flange_gradient_mm",
    "hollowing": "hollowing_mm",
    "equivalent_conicity": "conicity",
    "fatigue_damage": "damage",
    "wheel_diameter": "diameter_mm",
}
"""Key of the scene by variable of the result file, for each of `results.limits.LIMITED`."""

_OF_WHEEL: Mapping[str, Callable[[FloatArray, FloatArray], float]] = {
    "flange_height": measures.flange_height,
    "flange_thickness": measures.flange_thickness,
    "flange_gradient": measures.flange_gradient,
    "hollowing": measures.hollowing,
}


def values(section: LimitsSection | None) -> dict[str, float]:
    """Return the limits by the variable of the result file [SI].

    Parameters
    ----------
    section : LimitsSection or None
        As read.
    """
    if section is None:
        return {}
    given = {name: getattr(section, key) for name, key in KEYS.items()}
    return {name: value / QUANTITIES[name].shown_factor for name, value in given.items() if value is not None}


def met_by_wheels(
    section: LimitsSection | None, wheels: tuple[Profile, Profile], counterface: Profile, state: str = "new"
) -> dict[str, str]:
    """Tell which limits wheels meet before they wear.

    Parameters
    ----------
    section : LimitsSection or None
        As read.
    wheels : (Profile, Profile)
        Right and left.
    counterface : Profile
        Placed.
    state : str
        What the wheels are, "new" or "turned".

    Returns
    -------
    dict
        By key of the scene, what the wheels have, in words.
    """
    found = {}
    for name, limit in values(section).items():
        have: list[tuple[str, float | None]] = []
        try:
            if name in _OF_WHEEL:
                have = [
                    (f"the {state} {side} wheel", _OF_WHEEL[name](wheel.y, wheel.z))
                    for side, wheel in zip(("right", "left"), wheels, strict=True)
                ]
            elif name == "equivalent_conicity":
                have = [(f"the {state} wheelset", equivalent_conicity(*wheels, counterface))]
        except ProfileError:
            continue  # a measure that the new wheel does not have meets no limit
        met = [
            (who, value)
            for who, value in have
            if value is not None and LIMITED[name] * (value - limit) >= 0.0
        ]
        if met:
            who, value = met[0]
            quantity_ = QUANTITIES[name]
            unit = "" if quantity_.shown_unit == "1" else f" {quantity_.shown_unit}"
            found[KEYS[name]] = f"{who} ({value * quantity_.shown_factor:.4g}{unit})"
    return found
