"""[campaign] of a scene: how far, in which steps; its faults beside the rest of the scene, and SI values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.operation.control import ControlSettings
from wearsim.scene.limits import LimitsSection, values
from wearsim.scene.reprofiling import ReprofilingSection, reprofiling_rules
from wearsim.scene.section import Section, number
from wearsim.toml_faults import shown

_EXPLICIT_LIMIT = 2.0
"""From this stability number on an explicit step makes every wave larger (spec 3.2)."""


class CampaignSection(Section):
    """[campaign]: how far, and in which steps."""

    distance_km: float = number("distance", "the distance of the campaign")
    max_step_depth_um: float = number("depth_cap", "the largest wear depth of one step", 8.0)
    first_step_depth_um: float | None = number(
        "first_depth",
        "the largest wear depth of the first step and of that after a turning, doubled from step to step",
        None,
    )
    stability: float = number("stability_number", "the limit of the stability number S", 0.4)
    smoothing_wavelength_mm: float = number(
        "smoothing_wavelength", "the wavelength that smoothing halves, 0 for none", 2.5
    )
    integrator: Literal["heun", "euler", "semi_implicit"] = Field(
        "heun", description="the rule that combines wear rates"
    )
    error_tolerance_um: float = number(
        "step_error", "the largest estimated error of the depth of one step, of wheels and counterface", 1.0
    )
    point_spacing_mm: float = number("point_spacing", "the spacing of the profile's points", 0.25)
    max_step_km: float | None = number("step_length", "the longest step", None)
    limits: LimitsSection | None = None
    reprofiling: ReprofilingSection | None = None


def campaign_faults(campaign: CampaignSection, normal: str | None) -> Iterator[tuple[tuple[str, ...], str]]:
    """Tell what in [campaign] does not go together, or not with the contact model.

    Parameters
    ----------
    campaign : CampaignSection
        As read.
    normal : str or None
        Name of the normal contact model; None where models are chosen, of which some answer otherwise.

    Yields
    ------
    tuple of (key, message)
        The key as a path from the top of the scene.
    """
    if 0 < campaign.smoothing_wavelength_mm < 2.0 * campaign.point_spacing_mm:
        yield (
            ("campaign", "smoothing_wavelength_mm"),
            f"smoothing_wavelength_mm = {campaign.smoothing_wavelength_mm:g} must be 0 (no smoothing) or at "
            f"least twice point_spacing_mm = {campaign.point_spacing_mm:g}; shorter waves are not resolved",
        )
    limits = campaign.limits
    if limits is not None and not values(limits):
        yield (
            ("campaign", "limits"),
            "[campaign.limits] has no limit; write one, such as flange_thickness_mm = 22, or delete it",
        )
    implicit = campaign.integrator == "semi_implicit"
    if implicit and not (normal in NORMAL_MODELS and NORMAL_MODELS[normal].local):
        others = " or ".join(f"normal = {shown(name)}" for name, one in NORMAL_MODELS.items() if one.local)
        lacks = 'some models that model = "auto" may choose do not have'
        if normal is not None:
            lacks = f"normal = {shown(normal)} does not have"
        instead = f'delete model = "auto" for {others}' if normal is None else others
        yield (
            ("campaign", "integrator"),
            f'integrator = "semi_implicit" damps a step by depth over interpenetration, which {lacks}; '
            f'write integrator = "heun", or {instead}',
        )
    if campaign.stability >= _EXPLICIT_LIMIT and not implicit:
        yield (
            ("campaign", "stability"),
            f"stability = {campaign.stability:g} must be below {_EXPLICIT_LIMIT:g} with integrator = "
            f"{shown(campaign.integrator)}: longer steps make every wave grow; lower it, or write "
            f'integrator = "semi_implicit"',
        )


def control_settings(campaign: CampaignSection) -> ControlSettings:
    """Return the settings of the steps in SI units.

    Parameters
    ----------
    campaign : CampaignSection
        As read.
    """
    first, longest = campaign.first_step_depth_um, campaign.max_step_km
    return ControlSettings(
        distance=1e3 * campaign.distance_km,
        depth_cap=1e-6 * campaign.max_step_depth_um,
        stability=campaign.stability,
        smoothing_wavelength=1e-3 * campaign.smoothing_wavelength_mm,
        integrator=campaign.integrator,
        max_step=math.inf if longest is None else 1e3 * longest,
        error_tolerance=1e-6 * campaign.error_tolerance_um,
        first_depth=math.inf if first is None else 1e-6 * first,
        limits=tuple(values(campaign.limits).items()),
        end_at_limit=campaign.limits is not None and campaign.limits.end,
        reprofiling=reprofiling_rules(campaign.reprofiling),
    )
