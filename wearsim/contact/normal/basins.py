"""Basins of the gap: its minima, and the saddles over which they join."""

from __future__ import annotations

import numpy as np

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray, IntArray

MOST_BASINS = 64


@kernel
def find_basins(
    gap: FloatArray,
    highest: float,
    minima: FloatArray,
    order: IntArray,
    parent: IntArray,
    saddle: FloatArray,
) -> int:
    """Find local minima of the gap below `highest`, how they join, and return their number.

    Fills `minima` with their places as fractional grid positions and their heights, `order` with their
    indices by rising height. The gap flooded from below joins each basin to a deeper one: `parent` is the
    deepest one that holds the water it joins (-1 for the deepest of all), `saddle` the height of joining.
    """
    found = 0
    top = -np.inf
    between = np.empty(MOST_BASINS)  # highest point between each minimum and the one before
    for i in range(1, gap.size - 1):
        top = max(top, gap[i])
        if gap[i] < gap[i - 1] and gap[i] <= gap[i + 1] and gap[i] < highest:
            if found == MOST_BASINS:
                break
            bend = gap[i - 1] - 2.0 * gap[i] + gap[i + 1]
            move = 0.5 * (gap[i - 1] - gap[i + 1]) / bend
            minima[0, found] = i + move
            minima[1, found] = gap[i] - 0.25 * (gap[i - 1] - gap[i + 1]) * move
            between[found] = top
            top = -np.inf
            found += 1
    for k in range(found):
        j = k
        while j > 0 and minima[1, order[j - 1]] > minima[1, k]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = k
    for k in range(found):
        # The lower of the two walks from here to the first deeper minimum, left or right.
        parent[k], saddle[k] = -1, np.inf
        for way in (-1, 1):
            height = -np.inf
            j = k
            while 0 <= j + way < found:
                height = max(height, between[j] if way < 0 else between[j + 1])
                j += way
                if minima[1, j] < minima[1, k] or (minima[1, j] == minima[1, k] and j < k):
                    if height < saddle[k]:
                        parent[k], saddle[k] = j, height
                    break
    for rank in range(found):
        # Not the first deeper one but the deepest that the flood holds when it reaches the saddle.
        k = order[rank]
        while parent[k] >= 0 and saddle[parent[k]] <= saddle[k]:
            parent[k] = parent[parent[k]]
    return found
