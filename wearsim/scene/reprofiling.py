"""[campaign.reprofiling] of a scene: when the wheels are turned, and to what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, Strict

from wearsim.operation.control import ReprofilingRules
from wearsim.profile.shape import Profile
from wearsim.scene.limits import KEYS, LimitsSection, met_by_wheels, values
from wearsim.scene.section import Section, Text, number, range_of, words
from wearsim.toml_faults import shown, suggestion

Told = tuple[tuple[str, ...], str]
_HERE = ("campaign", "reprofiling")


class ReprofilingSection(Section):
    """[campaign.reprofiling]: both wheels are turned to one diameter, with the least loss of it.

    With `damage` among `at_limits` and a crack depth, that includes the material cracks run through.
    """

    at_limits: Annotated[tuple[str, ...], Strict(False)] = Field(
        (), description="the keys of [campaign.limits] at which the wheels are turned instead of worn on"
    )
    at_km: Annotated[tuple[Annotated[float, Field(**range_of("distance"))], ...], Strict(False)] = Field(
        (), description="the distances at which they are turned", json_schema_extra={"unit": "km"}
    )
    profile: Text | None = words("the profile they get, by default that of [wheelset]", None)
    cut_mm: float = number("least_cut", "the least depth that the lathe takes everywhere", 0.0)


def reprofiling_rules(section: ReprofilingSection | None) -> ReprofilingRules | None:
    """Return when the wheels are turned, in SI units.

    Parameters
    ----------
    section : ReprofilingSection or None
        As read.
    """
    if section is None:
        return None
    names = {key: name for name, key in KEYS.items()}
    return ReprofilingRules(
        limits=tuple(names[key] for key in section.at_limits),
        places=tuple(1e3 * place for place in section.at_km),
        cut=1e-3 * section.cut_mm,
    )


def reprofiling_faults(
    section: ReprofilingSection | None,
    limits: LimitsSection | None,
    *,
    diameter_mm: float,
    rotation: str,
    compared: bool,
) -> Iterator[Told]:
    """Tell what in [campaign.reprofiling] does not go together, or not with the rest of the scene.

    Parameters
    ----------
    section : ReprofilingSection or None
        As read.
    limits : LimitsSection or None
        As read.
    diameter_mm : float
        Of the new wheels.
    rotation : str
        Rule of the wheels' rotation speed.
    compared : bool
        Whether the scene is one of two that are compared.

    Yields
    ------
    tuple of (key, message)
        The key as a path from the top of the scene.
    """
    least = None if limits is None else limits.diameter_mm
    if section is None:
        if least is not None:
            yield (
                ("campaign", "limits", "diameter_mm"),
                f"diameter_mm = {least:g} is for wheels that are turned; add [campaign.reprofiling], or "
                f"delete it",
            )
        return
    if least is not None and least >= diameter_mm:
        yield (
            ("campaign", "limits", "diameter_mm"),
            f"diameter_mm = {least:g} must be below the diameter of the new wheels, {diameter_mm:g} mm",
        )
    if not section.at_limits and not section.at_km:
        yield (
            _HERE,
            "[campaign.reprofiling] does not say when; write at_limits, such as "
            '["flange_thickness_mm"], or at_km',
        )
    turnable = [key for name, key in KEYS.items() if name != "wheel_diameter"]
    for key in section.at_limits:
        if key not in turnable:
            hint = suggestion(key, turnable)
            yield (*_HERE, "at_limits"), f"at_limits: {shown(key)} is no limit to turn wheels at; {hint}"
        elif limits is None or getattr(limits, key) is None:
            yield (
                (*_HERE, "at_limits"),
                f"at_limits: {shown(key)} has no value; give it in [campaign.limits]",
            )
    if any(b <= a for a, b in zip((0.0, *section.at_km), section.at_km, strict=False)):
        yield (*_HERE, "at_km"), f"at_km = {shown(list(section.at_km))} must rise from one to the next"
    if rotation == "nominal":
        yield (
            ("contact", "rotation"),
            'rotation = "nominal" turns the wheels at the speed of new ones: turned wheels would slide; '
            'write rotation = "free" or "centred", or delete [campaign.reprofiling]',
        )
    if compared:
        yield (
            _HERE,
            "[campaign.reprofiling] cannot be compared: factors from rig to field are of the wear since new; "
            "delete it, or run this scene by itself",
        )


def reprofiling_warnings(section: ReprofilingSection | None, distance_km: float) -> Iterator[Told]:
    """Tell of turnings that a campaign does not reach: a shortened one is no fault.

    Parameters
    ----------
    section : ReprofilingSection or None
        As read.
    distance_km : float
        Of the campaign.

    Yields
    ------
    tuple of (key, message)
        The key as a path from the top of the scene.
    """
    beyond = [] if section is None else [place for place in section.at_km if place >= distance_km]
    if beyond:
        yield (
            (*_HERE, "at_km"),
            f"at_km = {', '.join(f'{place:g}' for place in beyond)} is not below the distance of the "
            f"campaign, {distance_km:g} km: the wheels are not turned there",
        )


def template_faults(
    section: ReprofilingSection,
    limits: LimitsSection | None,
    templates: tuple[Profile, Profile],
    counterface: Profile,
) -> Iterator[Told]:
    """Tell limits at which wheels are turned and which they would still meet afterwards.

    Parameters
    ----------
    section : ReprofilingSection
        As read.
    limits : LimitsSection or None
        As read.
    templates : (Profile, Profile)
        What the right and the left wheel get.
    counterface : Profile
        Placed.

    Yields
    ------
    tuple of (key, message)
        The key as a path from the top of the scene.
    """
    for key, who in met_by_wheels(limits, templates, counterface, "turned").items():
        if key in section.at_limits:
            yield (
                ("campaign", "limits", key),
                f"{key} = {getattr(limits, key):g} is met by {who}, too: wheels would be turned for ever; "
                f"change the limit, or give another profile in [campaign.reprofiling]",
            )


def turned_at(section: ReprofilingSection | None, limits: LimitsSection | None) -> frozenset[str]:
    """Keys of the limits at which wheels are turned, which end no campaign.

    Parameters
    ----------
    section : ReprofilingSection or None
        As read.
    limits : LimitsSection or None
        As read.
    """
    given = {KEYS[name] for name in values(limits)}
    return frozenset() if section is None else frozenset(section.at_limits) & given
