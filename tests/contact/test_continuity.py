"""Forces, power and strip work when the wheelset moves by a micrometre, also where patches come and go.

Steps of 0.1 mm from -8 to 8 mm find where patches appear or vanish; there, and in the flange root, where the
contact moves fastest, steps of 1 um and less are looked at. Changes are shares: forces over friction times
load, load and work by their distribution over the wheel.
"""

import numpy as np
import pytest

from wearsim.contact.solve import ContactModels, Counterface, solve
from wearsim.profile import standard

MODELS = ContactModels(strips=30, cells=20)
BINS = np.arange(-50e-3, 40e-3, 0.5e-3)
# inclination 1:N, roller radius [m], gauge [m], yaw [rad]
CASES = [
    (40, np.inf, 1.435, 0.0),
    (20, np.inf, 1.435, 0.0),
    (40, 1.0, 1.435, -0.005),
    (20, 0.5, 1.440, 0.0),
    (40, np.inf, 1.430, 0.010),
    (20, 1.0, 1.432, 0.010),
]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "1:{} {} m {} m {} rad".format(*case))
def totals(request, wheelset, points):
    """Function: totals of the right wheel at (n,) shifts."""
    inclination, radius, gauge, yaw = request.param
    counterface = Counterface(standard.rail("60E1", 1.0 / inclination, gauge, 0.75), 1.0 / radius)

    def at(shift):
        contact = solve(points(shift, yaw), wheelset, counterface, MODELS, sides=(0,))
        sums = np.zeros((shift.size, 4))
        angle = contact.contact_angle
        across = contact.force_y * np.cos(angle) - contact.normal_force * np.sin(angle)
        for k, value in enumerate((np.ones_like(angle), contact.force_x, across, contact.power)):
            np.add.at(sums[:, k], contact.point, value)
        half = 0.5 * (contact.patch.x_lead - contact.patch.x_trail)
        load = 0.5 * np.pi * contact.patch.pressure_slope * half**2 * contact.patch.width[:, None]
        work = contact.fields.strip_work * contact.patch.width[:, None]
        spread = np.zeros((2, shift.size, BINS.size - 1))
        for k, point in enumerate(contact.point):
            edges = contact.strip_edges_wheel_y[k]
            for part, strips in zip(spread, (load, work), strict=True):
                below = np.concatenate(([0.0], np.cumsum(strips[k])))
                part[point] += np.diff(np.interp(BINS, edges, below))
        assert abs(contact.load_scale - 1.0).max() < 3e-9
        return sums, spread

    return at


def changes(result):
    """Largest changes from each shift to the next: forces, load, power and work."""
    sums, (load, work) = result
    limit = 0.35 * 80e3
    power = np.maximum(sums[1:, 3], 0.05 * limit * 20.0 * 0.01)
    per_metre = np.maximum(work[1:].sum(axis=1), 0.05 * limit * 0.01)
    return {
        "force": abs(np.diff(sums[:, 1:3], axis=0)).max(axis=1) / limit,
        "load": abs(np.diff(load, axis=0)).sum(axis=1) / 80e3,
        "power": abs(np.diff(sums[:, 3])) / power,
        "work": abs(np.diff(work, axis=0)).sum(axis=1) / per_metre,
    }


def where_patches_change(totals, low=-8e-3, high=8e-3, resolution=2e-7):
    """Shifts between which their number changes, found by halving steps of 0.1 mm."""
    shift = np.linspace(low, high, 161)
    steps = np.flatnonzero(np.diff(totals(shift)[0][:, 0]))
    left, right = shift[steps], shift[steps + 1]
    while left.size and (right - left).max() > resolution:
        middle = 0.5 * (left + right)
        counts = totals(np.concatenate((left, middle)))[0][:, 0].reshape(2, -1)
        same = counts[0] == counts[1]
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return left, right


def test_patches_appear_and_vanish_without_a_jump(totals):
    """Within 0.2 um: nothing moves more than 0.3 % of the load or work where a patch comes or goes."""
    left, right = where_patches_change(totals)
    if left.size == 0:
        pytest.fail("a case without a change of patches tests nothing")
    for pair in zip(left, right, strict=True):
        found = changes(totals(np.array(pair)))
        assert max(value[0] for value in found.values()) < 3e-3, (pair, found)


def test_a_micrometre_changes_little_on_the_tread(totals):
    """Below 1.5 % of load or work per um, all steps of 0.1 mm, until the flange climbs."""
    sums, _ = totals(np.linspace(-8e-3, 8e-3, 161))
    climbs = np.flatnonzero(sums[:, 2] > 80e3)
    end = 160 if climbs.size == 0 else climbs[0] - 3
    shift = np.linspace(-8e-3, 8e-3, 161)[:end]
    pairs = np.stack((shift, shift + 1e-6), axis=1).ravel()
    found = changes(totals(pairs))
    for name, value in found.items():
        assert value[::2].max() < 1.5e-2, (name, shift[value[::2].argmax()])


def test_the_flange_root_is_steep_but_has_no_jump(totals):
    """Where the contact runs through the flange root, steps shrink with the move: a jump would not."""
    shift = np.arange(-8e-3, 8e-3, 2e-6 * 5)
    fastest = int(changes(totals(shift))["load"].argmax())
    low, width = shift[fastest], 1e-5
    whole = changes(totals(np.array([low, low + width])))["load"][0]
    for _ in range(3):
        steps = low + width * np.linspace(0.0, 1.0, 11)
        found = changes(totals(steps))["load"]
        low, width = steps[found.argmax()], 0.1 * width
    assert width < 2e-8
    assert found.max() < 0.03 * whole + 1e-4
