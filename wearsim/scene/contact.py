"""[contact] of a scene: the models of the contact and how finely they are solved."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import AUTO_REMOVED, PAIRS, TOLERANCE_REMOVED
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import listed, shown
from wearsim.scene.section import Messages, Registered, Section, quantity

NormalName = Annotated[str, Registered(NORMAL_MODELS)]
TangentialName = Annotated[str, Registered(TANGENTIAL_MODELS)]


class ContactSection(Section):
    """[contact]: the models of the contact and how finely they are solved."""

    not_here: ClassVar[dict[str, str]] = dict.fromkeys(
        (
            "youngs_wheel_GPa",
            "youngs_rail_GPa",
            "youngs_roller_GPa",
            "youngs_counterface_GPa",
            "poisson_wheel",
            "poisson_rail",
            "poisson_roller",
            "poisson_counterface",
        ),
        "wheel and counterface share one youngs_GPa and one poisson: with unequal "
        "ones shear would act back on the pressure, which no contact model here "
        "knows",
    )
    removed: ClassVar[dict[str, str]] = {
        "tolerance": TOLERANCE_REMOVED,
        'model = "auto"': AUTO_REMOVED,
        **{
            f"normal = {shown(name)}": f"contact.normal = {shown(name)} {message}"
            for name, message in NORMAL_MODELS.unusable.items()
        },
    }
    model: Literal["fast", "standard", "accurate"] = Field(
        "standard",
        description="the models of the contact. fast: kik_piotrowski and fastsim; "
        "standard: coupled_strips in both; accurate: a half-space in both",
    )
    normal: NormalName | None = Field(
        None, description="the model of the normal contact, in place of that of model"
    )
    tangential: TangentialName | None = Field(
        None,
        description="the model of the tangential contact, in place of that of model",
    )
    strips: int = quantity("strips", 30)
    cells: int = quantity("cells", 30, "the smallest number of cells along a strip")
    cell_mm: float = quantity("cell_size", 0.5)
    most_cells: int = quantity("most_cells", 120)
    youngs_GPa: float = quantity(
        "youngs_modulus", 210.0, "Young's modulus of both bodies"
    )
    poisson: float = quantity("poisson_ratio", 0.3, "Poisson's ratio of both bodies")
    kalker_factor: float = quantity(
        "kalker_factor",
        1.0,
        "creep stiffness over that of clean surfaces, below 1 for contaminated rails: "
        "elastic displacements of the tangential problem are 1/kalker_factor times as "
        "large",
    )
    friction_ratio: float = quantity(
        "friction_ratio",
        1.0,
        "the friction coefficient at large slip velocity over that at rest, A",
    )
    friction_decrease_s_m: float = quantity(
        "friction_decrease",
        0.0,
        "the coefficient B of the exponential decrease of friction with the slip "
        "velocity V: friction x ((1 - A) exp(-B V) + A)",
    )
    rotation: Literal["free", "independent", "centred", "nominal"] = Field(
        "free",
        description="the rule that gives the wheels' rotation speed. free: the torque "
        "of the whole axle is balanced; independent: that of each wheel, with half the "
        "torque on the axle or its own; centred: no creepage in the middle of the "
        "track; nominal: that of new wheels",
    )
    roll: Literal["given", "free"] = Field(
        "given",
        description="given: the roll of blocks and classes is roll_mrad; free: the "
        "wheelset rests on both wheels, whatever their wear",
    )
    torque_Nm: float = quantity(
        "axle_torque", 0.0, "the torque on the axle, driving forward"
    )
    virtual_penetration_factor: float = quantity("virtual_penetration_factor", 0.55)

    @property
    def pair(self) -> tuple[str, str]:
        """Normal and tangential model."""
        normal, tangential = PAIRS[self.model]
        return self.normal or normal, self.tangential or tangential


def _friction_faults(contact: ContactSection) -> Messages:
    """Fault of one number of falling friction without the other."""
    falls = {
        "friction_ratio": contact.friction_ratio < 1.0,
        "friction_decrease_s_m": contact.friction_decrease_s_m > 0.0,
    }
    if any(falls.values()) and not all(falls.values()):
        (given,) = (key for key, acts in falls.items() if acts)
        (missing,) = (key for key, acts in falls.items() if not acts)
        limit = "below 1" if missing == "friction_ratio" else "above 0"
        text = (
            f"{given} = {getattr(contact, given):g} is without effect where {missing} "
            f"= {getattr(contact, missing):g}; write a {missing} {limit}, or delete it"
        )
        yield ("contact", given), text


def contact_faults(contact: ContactSection) -> Messages:
    """Faults of models and grid."""
    normal, tangential_name = contact.pair
    model, tangential = NORMAL_MODELS[normal], TANGENTIAL_MODELS[tangential_name]
    if "model" in contact.model_fields_set:
        for key in sorted(contact.model_fields_set & {"normal", "tangential"}):
            text = (
                f'{key} and model = "{contact.model}" exclude each other; delete one '
                "of them"
            )
            yield ("contact", key), text
    fewest = max(model.fewest, tangential.fewest)
    name = model.name if fewest == model.fewest else tangential.name
    for key in ("strips", "cells"):
        if (count := getattr(contact, key)) < fewest:
            text = (
                f"{key} = {count} must be at least {fewest} with {name}; write more, "
                "or choose another model"
            )
            yield ("contact", key), text
    yield from _friction_faults(contact)
    if not model.can_update_profile:
        fit = [
            f"normal = {shown(name)}"
            for name, candidate in NORMAL_MODELS.items()
            if candidate.can_update_profile
        ]
        text = (
            f"normal = {shown(contact.normal)} cannot update the profile in a "
            f"campaign: {model.reason}; write {listed(fit, ' or ')}"
        )
        yield ("contact", "normal"), text
