"""Junctions of standard shapes: how far they are from smooth, and where the standard is
not.
"""

from itertools import pairwise

import numpy as np

STEP_TOLERANCE = 0.2e-6
"""Largest jump of z at a junction without a stated reason [m]: the rounding of good
printed digits.
"""

KINK_TOLERANCE = 0.02e-3
"""Largest jump of the tangent angle at a junction without a stated reason [rad]."""


def junctions(definition):
    """Misclosure of a definition at its n - 1 junctions: place [m], jump of z [m] and
    of the angle [rad].

    Jumps are field side minus flange or gauge side.
    """
    pairs = list(pairwise(definition.segments))
    y = np.array([right.start for _, right in pairs])
    step, kink = np.empty_like(y), np.empty_like(y)
    for k, (left, right) in enumerate(pairs):
        at = y[k : k + 1]
        step[k] = (right.height(at) - left.height(at))[0]
        kink[k] = (right.angle(at) - left.angle(at))[0]
    return y * 1e-3, step * 1e-3, kink


def holds(allowance, zones):
    """Whether an allowance is about the junction of these zones; "*" is any."""
    return all(
        own in ("*", zone)
        for own, zone in zip(allowance["between"], zones, strict=True)
    )


def junction_faults(definition):
    """One message for each junction that is neither smooth within the tolerances nor
    allowed.
    """
    faults = []
    chain = definition.segments
    for left, right in pairwise(chain):
        if left.end != right.start:
            faults.append(
                f"zone {left.zone!r} ends at y = {left.end:.9g} mm, zone "
                f"{right.zone!r} begins at {right.start:.9g} mm; both must be the same"
            )
    for k, (y, step, kink) in enumerate(zip(*junctions(definition), strict=True)):
        zones = chain[k].zone, chain[k + 1].zone
        allowed = [each for each in definition.allowances if holds(each, zones)]
        most_step = max(
            [STEP_TOLERANCE, *(each.get("step_um", 0.0) * 1e-6 for each in allowed)]
        )
        most_kink = max(
            [KINK_TOLERANCE, *(each.get("kink_mrad", 0.0) * 1e-3 for each in allowed)]
        )
        if not (abs(step) <= most_step and abs(kink) <= most_kink):
            faults.append(
                f"zones {zones[0]!r} and {zones[1]!r} meet at y = {y * 1e3:.6g} mm "
                f"with a step of {step * 1e6:.3g} um and a kink of {kink * 1e3:.3g} "
                f"mrad, more than {most_step * 1e6:g} um or {most_kink * 1e3:g} mrad; "
                "correct the numbers, or allow it with its reason in [[allow]]"
            )
    return faults
