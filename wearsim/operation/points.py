"""Operating points: how the wheelset runs, for how large a share, in which environment."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.contact.patch import FloatArray
from wearsim.contact.solve import ContactConditions


@dataclass(frozen=True)
class OperatingPoints:
    """The load collective of a campaign.

    Parameters
    ----------
    conditions : ContactConditions
        Of the `n` points.
    weight : (n,) array
        Share of the distance; sums to 1. Monitoring points have 0: they are solved and stored, but
        wear nothing.
    environment : (n,) array
        Environment factor on the wear depth [-], 1 = dry laboratory coefficients.
    block_length : (n,) array
        Length of the block in the programme's loop [m], 0 for points of a stationary collective
        (field classes) and monitoring points.
    label : tuple of str
        One per point.
    """

    conditions: ContactConditions
    weight: FloatArray
    environment: FloatArray
    block_length: FloatArray
    label: tuple[str, ...]
