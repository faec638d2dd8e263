r"""Shakedown map: limits of a ductile surface under repeated rolling and sliding.

Utilised friction is on the abscissa, :math:`p_0/k` on the ordinate [1]_. For friction
of about 0.3 and more the limit is :math:`p_0/k = 1/\mu`, where the surface flows; that
is the zero of the surface fatigue index. For pure rolling the limits are landmarks of
the map. The straight line that joins them is wearsim's own and not from the source.

References
----------
.. [1] K. L. Johnson, Proc. IMechE Part C 203 (1989) 151-163.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray

SURFACE_FLOW_FROM = 0.3
"""Friction from which flow at the surface is the limit [-]; recalled, approximate."""


# limits of p0/k of a point contact in rolling without friction, recalled from the map;
# above the second plastic strain accumulates
_FIRST_YIELD, _ELASTIC_SHAKEDOWN = 2.8, 4.7


class Boundary(NamedTuple):
    """Limit curve of the shakedown map: p0/k over utilised friction, both (n,) [-].

    Its certainty is "recalled", or "join" for the line between the source's curves.
    """

    friction: FloatArray
    ratio: FloatArray
    label: str
    certainty: str


def shakedown_limit(friction: FloatArray) -> FloatArray:
    r"""Limit of :math:`p_0/k` above which the surface or the subsurface ratchets [-].

    Parameters
    ----------
    friction : (...) array
        Utilised friction, not negative [-].

    Returns
    -------
    (...) array
        :math:`1/\mu` from `SURFACE_FLOW_FROM` on; below, a straight line from the
        landmark of pure rolling, and never above :math:`1/\mu` [-].
    """
    end = 1.0 / SURFACE_FLOW_FROM
    join = (
        _ELASTIC_SHAKEDOWN
        + (end - _ELASTIC_SHAKEDOWN) * np.asarray(friction) / SURFACE_FLOW_FROM
    )
    flow = 1.0 / np.maximum(friction, 1e-12)
    return np.where(
        np.asarray(friction) >= SURFACE_FLOW_FROM, flow, np.minimum(join, flow)
    )


def boundaries(most_friction: float = 0.6) -> tuple[Boundary, ...]:
    """Return the limit curves of the shakedown map.

    They are flow at the surface, the join below it, and first yield in pure rolling.

    The map ends at `most_friction`, above `SURFACE_FLOW_FROM` [-].
    """
    flow = np.linspace(SURFACE_FLOW_FROM, most_friction, 61)
    join = np.linspace(0.0, SURFACE_FLOW_FROM, 61)
    return (
        Boundary(flow, 1.0 / flow, "surface flow, p0/k = 1/µ", "recalled"),
        Boundary(
            join, shakedown_limit(join), "elastic shakedown, a straight join", "join"
        ),
        Boundary(
            np.zeros(2),
            np.full(2, _FIRST_YIELD),
            "first yield in pure rolling",
            "recalled",
        ),
    )
