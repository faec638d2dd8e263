"""What every normal contact model takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from wearsim.contact.geometry import Gap
from wearsim.contact.patch import FloatArray, Patch


@dataclass(frozen=True)
class SharedPoint:
    """Point from which the motion of patches is seen that lie in one plane; of a patch alone, its centre.

    Parameters
    ----------
    y : (m,) array
        On the counterface profile [m].
    approach : (m,) array
        Rigid approach of the planes there along the normal [m].
    across, along : (m,) array
        How far the patch's centre lies from there, in the plane, to the field side and forwards [m].
    """

    y: FloatArray
    approach: FloatArray
    across: FloatArray
    along: FloatArray


@dataclass(frozen=True)
class NormalSolution:
    """What a normal model gives; the leading axis is the patch, ordered by row and falling normal force.

    Parameters
    ----------
    patch : Patch
        Outline and pressure on strips.
    centre_y : (m,) array
        Pressure-weighted centre on the counterface profile [m].
    contact_angle : (m,) array
        Of the contact plane about x [rad].
    approach : (m,) array
        Rigid approach along the normal [m].
    normal_force : (m,) array
        [N].
    max_pressure : (m,) array
        [Pa].
    edge_y : (m, ny + 1) array
        Strip edges on the counterface profile [m].
    load_scale : (m,) array
        What the forces of the wheel's patches were multiplied with to carry the load exactly: 1 to the
        tolerance of the balance; more where a model's load jumps past the wanted one [-].
    descent : (m,) array
        How far the load pushes the wheel down from its design height, alike for its patches [m].
    seen_from : SharedPoint, optional
        Where the planes of wheel and counterface are taken for the creepages; none: at the centre.
    """

    patch: Patch
    centre_y: FloatArray
    contact_angle: FloatArray
    approach: FloatArray
    normal_force: FloatArray
    max_pressure: FloatArray
    edge_y: FloatArray
    load_scale: FloatArray
    descent: FloatArray
    seen_from: SharedPoint | None = None


class NormalModel(Protocol):
    """Signature of every normal model."""

    def __call__(
        self,
        gap: Gap,
        load: FloatArray,
        *,
        vertical: bool,
        effective_modulus: float,
        strips: int,
        parameters: dict[str, float],
    ) -> NormalSolution:
        """Solve every row of `gap` under `load` [N], of the wheel (`vertical`) or of its single patch.

        `parameters` are those of all models, each takes its own; "cells" along a strip is for models that
        find the pressure cell by cell.
        """
