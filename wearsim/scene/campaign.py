"""[campaign] and [counterface.wear] of a scene, and records a campaign runs by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field, Strict

from wearsim.damage.fatigue import FATIGUE_LAWS, counts_cycles
from wearsim.errors import listed, shown
from wearsim.quantities import QUANTITIES
from wearsim.scene.point_files import (
    FileFormat,
    Mirror,
    OffsetY,
    OffsetZ,
    PointOrigin,
    Units,
    ZUp,
    one_origin,
)
from wearsim.scene.section import (
    Messages,
    Section,
    Text,
    quantity,
    range_of,
    text_field,
)
from wearsim.toml_faults import KeyPath, suggestion

Distance = Annotated[float, Field(**range_of("distance"))]


class RollerWearSection(Section):
    """[counterface.wear] on a rig: both rollers wear, each under its wheel, and are
    redressed together.
    """

    not_here: ClassVar[dict[str, str]] = {
        "area_mm2_per_1000km": "a roller runs under this wheel alone: its wear "
        'follows from the wheel\'s law times factor; write that, or kind = "field" '
        "in [scene]",
    }
    factor: float = quantity("counterface_wear_factor")
    redress_every_km: float | None = quantity(
        "redress_distance",
        None,
        "the distance after which both rollers are redressed to their new profile",
    )
    redress_depth_um: float | None = quantity(
        "redress_depth",
        None,
        "the wear depth of either roller at which both are redressed to their new "
        "profile",
    )


class RailWearSection(Section):
    """[counterface.wear] in the field: both rails lose a stated area where the
    campaign's contacts wear.
    """

    not_here: ClassVar[dict[str, str]] = {
        **dict.fromkeys(
            ("factor", "redress_every_km", "redress_depth_um"),
            "a rail is passed by other wheels, too: state what it loses as "
            'area_mm2_per_1000km, or write kind = "rig" in [scene]',
        ),
        **dict.fromkeys(
            ("law", "depth_per"),
            "rail wear per 100 MGT follows from every result in the field, by the law "
            "of [wear]: wearsim inspect --all lists it; delete the key",
        ),
    }
    area_mm2_per_1000km: float = quantity(
        "counterface_area_rate",
        meaning="the area each rail's cross-section loses while the wheelset runs "
        "1000 km",
    )


class LimitsSection(Section):
    """[campaign.limits]: what ends the life of a wheel; results hold the distance at
    which each is met.
    """

    depth_mm: float | None = quantity("max_wear_depth", None, "the largest wear depth")
    tread_wear_mm: float | None = quantity(
        "tread_wear",
        None,
        "the largest wear depth of the tread (y from -26 to 32 mm)",
    )
    root_wear_mm: float | None = quantity(
        "root_wear",
        None,
        "the largest wear depth of the flange root (y from -38 to -26 mm)",
    )
    flange_wear_mm: float | None = quantity(
        "flange_wear", None, "the largest wear depth of the flange (y below -38 mm)"
    )
    flange_height_mm: float | None = quantity(
        "flange_height", None, "the largest flange height Sh"
    )
    flange_thickness_mm: float | None = quantity(
        "flange_thickness", None, "the least flange thickness Sd"
    )
    flange_gradient_mm: float | None = quantity(
        "flange_gradient", None, "the least flange gradient qR"
    )
    hollowing_mm: float | None = quantity(
        "hollowing", None, "the largest hollowing of the tread"
    )
    conicity: float | None = quantity(
        "equivalent_conicity", None, "the largest equivalent conicity"
    )
    damage: float | None = quantity(
        "fatigue_damage",
        None,
        "the largest fatigue damage by a law that counts cycles (wlrm)",
    )
    diameter_mm: float | None = quantity(
        "wheel_diameter", None, "the least wheel diameter, worn or reprofiled"
    )
    end: bool = Field(
        False, description="whether the campaign ends at the first limit that is met"
    )

    @property
    def values(self) -> dict[str, float]:
        """The limits by the variable of the result file [SI]."""
        given = {name: getattr(self, key) for name, key in LIMIT_KEYS.items()}
        return {
            name: limit / QUANTITIES[name].shown_factor
            for name, limit in given.items()
            if limit is not None
        }


LIMIT_KEYS: Mapping[str, str] = {
    "max_wear_depth": "depth_mm",
    "tread_wear": "tread_wear_mm",
    "root_wear": "root_wear_mm",
    "flange_wear": "flange_wear_mm",
    "flange_height": "flange_height_mm",
    "flange_thickness": "flange_thickness_mm",
    "flange_gradient": "flange_gradient_mm",
    "hollowing": "hollowing_mm",
    "equivalent_conicity": "conicity",
    "fatigue_damage": "damage",
    "wheel_diameter": "diameter_mm",
}
"""Key of the scene by variable of the result file, for each of
`results.limits.LIMITED`.
"""


class ReprofilingSection(Section):
    """[campaign.reprofiling]: both wheels are reprofiled to one diameter, with the
    least loss of it.

    With `damage` among `at_limits` and a crack depth, that includes the material cracks
    run through.
    """

    at_limits: Annotated[tuple[str, ...], Strict(False)] = Field(
        (),
        description="the keys of [campaign.limits] at which the wheels are reprofiled "
        "instead of worn on",
    )
    at_km: Annotated[tuple[Distance, ...], Strict(False)] = Field(
        (),
        description="the distances at which they are reprofiled",
        json_schema_extra={"unit": "km"},
    )
    profile: Text | None = text_field(
        "the profile they get, by default that of [wheelset]", None
    )
    smooth_mm: float | None = quantity("noise_wavelength", None)
    format: FileFormat = None
    units: Units = None
    mirror: Mirror = None
    z_up: ZUp = None
    origin: PointOrigin = None
    offset_y_mm: OffsetY = None
    offset_z_mm: OffsetZ = None
    cut_mm: float = quantity(
        "least_cut", 0.0, "the least depth that the lathe takes everywhere"
    )

    _one_origin = one_origin


STABILITY: Mapping[str, tuple[float, float]] = {"rkc": (8.4, 32.0), "euler": (0.4, 2.0)}
"""Limit of the stability number by rule where the scene gives none, and the one no
scene may exceed.
"""

HALF_SPACE_DEPTHS: Mapping[str, float] = {"rkc": 5.0, "euler": 1.0}
"""By rule, how many times deeper than one of first order a step on a half-space may be,
at most. The rule then takes four stages, which damp all waves that smoothing passes.
"""


class CampaignSection(Section):
    """[campaign]: how far, and in which steps."""

    removed: ClassVar[dict[str, str]] = {
        'integrator = "heun"': (
            'campaign.integrator = "heun" was removed in 0.3.0: write "rkc"'
        )
    }
    distance_km: float = quantity("distance", meaning="the distance of the campaign")
    max_step_depth_um: float = quantity("depth_cap", 50.0)
    first_step_depth_um: float = quantity(
        "first_depth",
        2.0,
        "the largest wear depth of the first step of each block or collective, and of "
        "that after a reprofiling; steps grow at most threefold from there",
    )
    stability: float | None = quantity(
        "stability_number",
        None,
        "the limit of the stability number S, at first depth over interpenetration, "
        "then half of it; by default that of the rule: 8.4 of rkc, 0.4 of euler",
    )
    smoothing_wavelength_mm: float = quantity(
        "smoothing_wavelength", 2.5, "the wavelength that smoothing halves, 0 for none"
    )
    integrator: Literal["rkc", "euler"] = Field(
        "rkc",
        description="the rule that combines wear rates: Runge-Kutta-Chebyshev of "
        "second order with two to eight stages, or Euler's",
    )
    error_tolerance_um: float = quantity(
        "step_error",
        1.0,
        "the largest estimated error of the depth of one step, as RMS over the band "
        "worn in it, of wheels and counterface",
    )
    point_spacing_mm: float = quantity("point_spacing", 0.25)
    max_step_km: float | None = quantity("step_length", None, "the longest step")
    limits: LimitsSection | None = None
    reprofiling: ReprofilingSection | None = None


@dataclass(frozen=True)
class ReprofilingRules:
    """Limits, distances [m] and cut [m] of reprofiling.

    The limits are measures; the cut is the least depth over the whole profile. With
    fatigue damage among the limits, every reprofiling removes all cracks of known
    depth.
    """

    limits: tuple[str, ...] = ()
    places: tuple[float, ...] = ()
    cut: float = 0.0


@dataclass(frozen=True)
class ControlSettings:
    """Distance of a campaign and length of its steps; depths are those after smoothing.

    The stability number is that of the fastest wave of the profile in one step; from
    the limit of the rule on waves grow, see `campaign.step`. Steps whose estimated
    error exceeds its tolerance are repeated shorter. The first depth is that of the
    first step of each block or collective, and after reprofiling or redressing. The
    campaign may end with the step in which the first limit is met; limits of
    reprofiling do not end it.
    """

    distance: float  # [m]
    depth_cap: float  # largest wear depth of one step [m]
    stability: float  # largest S [-]
    smoothing_wavelength: (
        float  # whose amplitude in the wear increment is halved; 0 = no smoothing [m]
    )
    integrator: str  # name in the registry of `campaign.step`
    max_step: float = math.inf  # [m]
    error_tolerance: float = (
        math.inf
    )  # of the depth of one step; infinite = not estimated [m]
    first_depth: float = math.inf  # [m]
    half_space_depths: float = (
        1.0  # largest depth over that of first order, without interpenetration [-]
    )
    limits: tuple[
        tuple[str, float], ...
    ] = ()  # of measures, by variable of the result file [SI]
    end_at_limit: bool = False
    reprofiling: ReprofilingRules | None = None


@dataclass(frozen=True)
class CounterfaceWear:
    r"""Wear of rollers by the wheels' law, or of rails at a stated rate.

    Notes
    -----
    A roller of radius :math:`s_0` passes under its wheel once in :math:`2 \pi s_0` of
    running, whatever the local radius; the distance run is that of its profile top. A
    rail is passed by other wheels as well: its loss is given, and the contacts of the
    campaign distribute it.
    """

    # depth per passage of a roller over that of the wheel in one contact; 0: a rail [-]
    factor: float = 0.0
    radius: float = (
        math.inf
    )  # of the rollers at their profile's top; infinite for a rail [m]
    area_rate: float = (
        0.0  # cross-section that each rail loses per distance run; 0 for rollers [m2/m]
    )
    redress_distance: float = (
        math.inf
    )  # after which both rollers are redressed to their new profile [m]
    redress_depth: float = (
        math.inf
    )  # wear depth of either roller at which both are redressed [m]

    def passages(self, area: float) -> float:
        """Return the passages per metre run, times the factor of a roller [1/m].

        They multiply the wheel's depth per passage; `area` of its cross-section is
        removed in one passage of the collective [m2].
        """
        if self.area_rate == 0.0:
            return self.factor / (2.0 * math.pi * self.radius)
        return self.area_rate / area if area > 0.0 else 0.0


REPROFILING = ("campaign", "reprofiling")
"""Path of the table in the scene."""


def campaign_faults(
    campaign: CampaignSection, laws: Sequence[str], diameter: float
) -> Messages:
    """Faults between the keys of [campaign].

    Parameters
    ----------
    laws : sequence of str
        Fatigue laws of the scene.
    diameter : float
        Of the new wheels [mm].
    """
    yield from _step_faults(campaign)
    yield from _limit_faults(campaign, laws)
    yield from _reprofiling_faults(campaign, diameter)


def _step_faults(campaign: CampaignSection) -> Messages:
    largest = STABILITY[campaign.integrator][1]
    if 0 < campaign.smoothing_wavelength_mm < 2.0 * campaign.point_spacing_mm:
        text = (
            f"smoothing_wavelength_mm = {campaign.smoothing_wavelength_mm:g} must be 0 "
            "(no smoothing) or at least twice point_spacing_mm = "
            f"{campaign.point_spacing_mm:g}; shorter waves are not resolved"
        )
        yield ("campaign", "smoothing_wavelength_mm"), text
    if campaign.stability is not None and campaign.stability > largest:
        text = (
            f"stability = {campaign.stability:g} must be at most {largest:g} with "
            f"integrator = {shown(campaign.integrator)}: longer steps make every wave "
            "grow; lower it or delete it"
        )
        yield ("campaign", "stability"), text


def _limit_faults(campaign: CampaignSection, laws: Sequence[str]) -> Messages:
    limits = campaign.limits
    if limits is None:
        return
    if not limits.values:
        text = (
            "[campaign.limits] has no limit; write one, such as flange_thickness_mm = "
            "22, or delete it"
        )
        yield ("campaign", "limits"), text
    if limits.damage is not None and not any(map(counts_cycles, laws)):
        given = f"; {', '.join(laws)} orders passages and counts none" if laws else ""
        counting = [law for law in FATIGUE_LAWS if counts_cycles(law)]
        text = (
            f"damage = {limits.damage:g} needs a fatigue law that counts "
            f"cycles{given}; write {listed(counting, ' or ')} among the laws of "
            "[fatigue], or delete it"
        )
        yield ("campaign", "limits", "damage"), text


def _reprofiling_faults(campaign: CampaignSection, new: float) -> Messages:
    rules, limits = campaign.reprofiling, campaign.limits
    least = None if limits is None else limits.diameter_mm
    of_diameter: KeyPath = ("campaign", "limits", "diameter_mm")
    if least is not None and least >= new:
        text = (
            f"diameter_mm = {least:g} must be below the diameter of the new wheels, "
            f"{new:g} mm"
        )
        yield of_diameter, text
    if rules is None:
        return
    if not rules.at_limits and not rules.at_km:
        text = (
            "[campaign.reprofiling] does not say when; write at_limits, such as "
            '["flange_thickness_mm"], or at_km'
        )
        yield REPROFILING, text
    keys = [key for name, key in LIMIT_KEYS.items() if name != "wheel_diameter"]
    for key in rules.at_limits:
        path, start = (*REPROFILING, "at_limits"), f"at_limits: {shown(key)}"
        if key not in keys:
            yield (
                path,
                f"{start} is no limit to reprofile wheels at; {suggestion(key, keys)}",
            )
        elif limits is None or getattr(limits, key) is None:
            yield path, f"{start} has no value; give it in [campaign.limits]"
    if any(b <= a for a, b in zip((0.0, *rules.at_km), rules.at_km, strict=False)):
        text = f"at_km = {shown(list(rules.at_km))} must rise from one to the next"
        yield (*REPROFILING, "at_km"), text
