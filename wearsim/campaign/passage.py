"""Passage of the patches of all operating points over the wheel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from wearsim.campaign.comparison import ComparisonPassage
from wearsim.campaign.state import PatchWear
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches
from wearsim.errors import ContactError

_FORCES = (
    "normal_force",
    "force_x",
    "force_y",
    "spin_moment",
    "power",
    "track_lateral",
    "track_vertical",
    "track_longitudinal",
    "track_yaw_moment",
    "track_roll_moment",
)


@dataclass(frozen=True)
class Passage:
    """Passage of each of `m` patches over the wheel: contact and laws' results."""

    contact: ContactPatches
    strip_work: FloatArray  # (m, ny) frictional work per area of each strip [J/m2]
    work_density_max: FloatArray  # (m,) of all cells [Pa]
    depth: tuple[
        FloatArray, ...
    ]  # (m, ny) by the regimes of the active wear law, along the normal [m]
    comparison: ComparisonPassage
    # (m,) of the distance of its point that each acts in; forces and wear are means [-]
    share: FloatArray
    failed: Mapping[int, ContactError] = field(
        default_factory=dict
    )  # points without contact solution
    # results of `solve_passage` that follow from the profiles
    wear: PatchWear | None = None
    strip_edges_arc: FloatArray | None = (
        None  # (m, ny + 1) arc length at the edges of strips [m]
    )


def shared(passage: Passage, share: FloatArray) -> Passage:
    """Passage of patches that are active for shares of the distance of their points.

    The shares are those of the runs (n,).
    """
    contact, comparison = passage.contact, passage.comparison
    factor = share[contact.point]
    if (factor == 1.0).all():
        return passage

    def of(values: tuple[FloatArray, ...]) -> tuple[FloatArray, ...]:
        return tuple(factor[:, None] * value for value in values)

    laws = replace(
        comparison, depth=tuple(map(of, comparison.depth)), damage=of(comparison.damage)
    )
    return replace(
        passage,
        contact=replace(
            contact, **{name: factor * getattr(contact, name) for name in _FORCES}
        ),
        strip_work=factor[:, None] * passage.strip_work,
        depth=of(passage.depth),
        comparison=laws,
        share=factor,
    )
