"""One passage of the patches of all operating points over the wheel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from wearsim.campaign.comparison import ComparisonPassage
from wearsim.campaign.state import PatchWear
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactPatches
from wearsim.contact.wheels import Wheels
from wearsim.errors import ContactError


@dataclass(frozen=True)
class Passage:
    """One passage of each of `m` patches over the wheel: contact, and what the laws make of its cells."""

    contact: ContactPatches
    strip_work: FloatArray  # (m, ny) frictional work per area of each strip [J/m2]
    work_density_max: FloatArray  # (m,) of all cells [Pa]
    depth: tuple[FloatArray, ...]  # (m, ny) by the regimes of the active wear law, along the normal [m]
    comparison: ComparisonPassage
    weight: FloatArray  # (m,) with which each patch acts: below 1 where it is faint [-]
    lost: FloatArray  # (m, 3) share of load, power and wear that faint patches of its wheel lost [-]
    share: FloatArray  # (m,) of the distance of its point that each acts in; forces and wear are means [-]
    failed: Mapping[int, ContactError] = field(default_factory=dict)  # points without contact solution
    # what follows from the profiles, of `solve_passage` alone
    wear: PatchWear | None = None
    strip_edges_arc: FloatArray | None = None  # (m, ny + 1) arc length at the edges of strips [m]
    wheels: Mapping[bytes, Wheels] | None = None  # of its chunks, for another passage to begin with
