"""Forces, power and strip work when the wheelset moves by a micrometre, also where
patches come and go.

Steps of 0.1 mm from -8 to 8 mm find where patches appear or vanish; there, and in the
flange root, where the contact moves fastest, steps of 1 um and less are looked at.
Changes are shares: forces over friction times load, load and work by their distribution
over the wheel.

The other models are searched for jumps: intervals of 0.25 mm and less are halved
towards the larger change, and what is left at 10 nm does not come from the move. In
half-space grids the cells move with the patch: what is left there is sampling, and has
to shrink with the cells.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.problem import ContactModels, Counterface
from wearsim.contact.solve import solve
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import WearsimError
from wearsim.profile import standard

MODELS = ContactModels.of("fast", strips=30, cells=20)
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


@pytest.fixture(scope="module")
def totals_of(wheelset, points):
    """Factory of functions: totals of the right wheel at (n,) shifts, for a case and
    models.
    """

    def of(case, models):
        inclination, radius, gauge, yaw = case
        counterface = Counterface(
            standard.rail("60E1", 1.0 / inclination, gauge, 0.75), 1.0 / radius
        )

        def at(shift):
            contact = solve(
                points(shift, yaw), wheelset, counterface, models, sides=(0,)
            )
            sums = np.zeros((shift.size, 4))
            angle = contact.contact_angle
            across = contact.force_y * np.cos(angle) - contact.normal_force * np.sin(
                angle
            )
            for k, value in enumerate(
                (np.ones_like(angle), contact.force_x, across, contact.power)
            ):
                np.add.at(sums[:, k], contact.point, value)
            half = 0.5 * (contact.patch.x_lead - contact.patch.x_trail)
            load = (
                0.5
                * np.pi
                * contact.patch.pressure_slope
                * half**2
                * contact.patch.width[:, None]
            )
            work = contact.fields.strip_work * contact.patch.width[:, None]
            spread = np.zeros((2, shift.size, BINS.size - 1))
            for k, point in enumerate(contact.point):
                edges = contact.strip_edges_wheel_y[k]
                for part, strips in zip(spread, (load, work), strict=True):
                    below = np.concatenate(([0.0], np.cumsum(strips[k])))
                    part[point] += np.diff(np.interp(BINS, edges, below))
            assert abs(contact.load_scale - 1.0).max() < (
                3e-9 if models.normal == "kik_piotrowski" else 1e-3
            )
            return sums, spread

        return at

    return of


@pytest.fixture(
    scope="module", params=CASES, ids=lambda case: "1:{} {} m {} m {} rad".format(*case)
)
def totals(request, totals_of):
    return totals_of(request.param, MODELS)


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
    """Within 0.2 um: nothing moves more than 0.3 % of the load or work where a patch
    comes or goes.
    """
    left, right = where_patches_change(totals)
    if left.size == 0:
        pytest.fail("a case without a change of patches tests nothing")
    for pair in zip(left, right, strict=True):
        actual = changes(totals(np.array(pair)))
        assert max(value[0] for value in actual.values()) < 3e-3, (pair, actual)


def test_a_micrometre_changes_little_on_the_tread(totals):
    """Below 1.5 % of load or work per um, all steps of 0.1 mm, until the flange
    climbs.
    """
    sums, _ = totals(np.linspace(-8e-3, 8e-3, 161))
    climbs = np.flatnonzero(sums[:, 2] > 80e3)
    end = 160 if climbs.size == 0 else climbs[0] - 3
    shift = np.linspace(-8e-3, 8e-3, 161)[:end]
    pairs = np.stack((shift, shift + 1e-6), axis=1).ravel()
    actual = changes(totals(pairs))
    for name, value in actual.items():
        assert value[::2].max() < 1.5e-2, (name, shift[value[::2].argmax()])


def test_the_flange_root_is_steep_but_has_no_jump(totals):
    """Where the contact runs through the flange root, steps shrink with the move: a
    jump would not.
    """
    shift = np.arange(-8e-3, 8e-3, 2e-6 * 5)
    fastest = int(changes(totals(shift))["load"].argmax())
    low, width = shift[fastest], 1e-5
    whole = changes(totals(np.array([low, low + width])))["load"][0]
    for _ in range(3):
        steps = low + width * np.linspace(0.0, 1.0, 11)
        actual = changes(totals(steps))["load"]
        low, width = steps[actual.argmax()], 0.1 * width
    assert width < 2e-8
    assert actual.max() < 0.03 * whole + 1e-4


def one_by_one(totals, shifts):
    """Totals at each shift, none where the model raises an error."""
    try:
        sums, spread = totals(shifts)
    except WearsimError:
        if shifts.size == 1:
            return [None]
        half = shifts.size // 2
        return one_by_one(totals, shifts[:half]) + one_by_one(totals, shifts[half:])
    return [(sums[[k]], spread[:, [k]]) for k in range(shifts.size)]


def largest_change(one, other):
    """Largest of `changes` between two results, nothing where one of them is
    refused.
    """
    if one is None or other is None:
        return 0.0
    pair = tuple(np.concatenate(both, axis=-2) for both in zip(one, other, strict=True))
    return max(value[0] for value in changes(pair).values())


def jumps(totals, low, high, intervals, resolution=1e-8):
    """What is left of the change in each interval when it is halved towards the larger
    one; its place.
    """
    shift = np.linspace(low, high, intervals + 1)
    results = one_by_one(totals, shift)
    left, right = (
        list(zip(shift[:-1], results[:-1], strict=True)),
        list(zip(shift[1:], results[1:], strict=True)),
    )
    width = shift[1] - shift[0]
    while width > resolution:
        width *= 0.5
        middles = np.array([at + width for at, _ in left])
        for k, middle in enumerate(
            zip(middles, one_by_one(totals, middles), strict=True)
        ):
            if largest_change(left[k][1], middle[1]) >= largest_change(
                middle[1], right[k][1]
            ):
                right[k] = middle
            else:
                left[k] = middle
    actual = np.array(
        [largest_change(a[1], b[1]) for a, b in zip(left, right, strict=True)]
    )
    fault = sum(result is None for result in results)
    return actual, np.array([at for at, _ in left]), fault / shift.size


# Shift [m] at which the wheel begins to climb the flange's root, for each of the cases.
ROOT = [6.3e-3, 6.3e-3, 6.3e-3, 8e-3, 3.9e-3, 4.7e-3]
JUMPS = {
    place: [
        pytest.mark.slow,
        pytest.mark.xfail(
            strict=True,
            reason=(
                f"measured {measured} of load and work by their distribution, target "
                "0.3 %; sums 0.01 %"
            ),
        ),
    ]
    for place, measured in (("tread", "0.33 %"), ("climb", "0.50 %"))
}
"""Marks of coupled_strips."""


def models_of(normal):
    """Models with a normal one: strips in planes of their own with the tangential model
    that takes them.
    """
    tangential = normal if normal == "coupled_strips" else MODELS.tangential
    return replace(MODELS, normal=normal, tangential=tangential)


def slow_but(parameters, quick):
    return [
        p if p in quick else pytest.param(*p, marks=pytest.mark.slow)
        for p in parameters
    ]


@pytest.mark.parametrize(
    ("name", "case"),
    slow_but(
        [
            (name, case)
            for name in ("hertz", "kik_piotrowski")
            for case in range(len(CASES))
        ],
        [("hertz", 1), ("kik_piotrowski", 0), ("kik_piotrowski", 5)],
    )
    + [
        pytest.param("coupled_strips", case, marks=pytest.mark.slow)
        for case in (0, 1, 2, 3, 5)
    ]
    + [pytest.param("coupled_strips", 4, marks=JUMPS["tread"])],
)
def test_nothing_jumps_on_the_tread(totals_of, name, case):
    """0.3 % of forces, load, power or work, as where patches change; Hertz may refuse a
    tenth.
    """
    totals = totals_of(CASES[case], models_of(name))
    actual, at, fault = jumps(totals, -8e-3, ROOT[case], 24 if name == "hertz" else 48)
    assert actual.max() < 3e-3, (1e3 * at[actual.argmax()], actual.max())
    assert fault < (0.1 if name == "hertz" else 1e-9)


CLIMB = "measured 0.56 % of the load, target 0.3 %: its strips shift by 10 um"


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("coupled_strips", marks=JUMPS["climb"]),
        "hertz",
        pytest.param(
            "kik_piotrowski", marks=pytest.mark.xfail(strict=True, reason=CLIMB)
        ),
    ],
)
def test_nothing_jumps_while_the_flange_climbs(totals_of, name):
    """0.3 %; with 1:20 on rail the contact runs through the flange's root from 6.5 to 7
    mm.
    """
    totals = totals_of(CASES[1], models_of(name))
    actual, at, _ = jumps(totals, 6.5e-3, 7.0e-3, 20)
    assert actual.max() < 3e-3, (1e3 * at[actual.argmax()], actual.max())


@pytest.mark.parametrize(
    ("case", "low", "high"),
    [
        (0, 4.9e-3, 5.1e-3),
        pytest.param(
            0,
            5.45e-3,
            5.65e-3,
            marks=[
                pytest.mark.slow,
                pytest.mark.xfail(
                    strict=True,
                    reason="measured 2.5 %, target 2 %: borders of the cells",
                ),
            ],
        ),
        pytest.param(0, 6.65e-3, 6.85e-3, marks=pytest.mark.slow),
    ],
)
def test_half_space_only_jumps_with_its_cells(totals_of, case, low, high):
    """Where a second lobe comes, and in the flange's root: half as large cells, less
    than half the jumps.

    Or within the 0.3 % that count as none: in the flange's root 7 % on 20 x 14 cells,
    0.2 % on 40 x 28.
    """
    coarse, fine = (
        jumps(
            totals_of(
                CASES[case],
                replace(
                    MODELS,
                    normal="half_space",
                    strips=n,
                    cells=7 * n // 10,
                    cell_size=1.0,
                ),
            ),
            low,
            high,
            2,
        )[0]
        for n in (20, 40)
    )
    assert fine.max() < max(0.5 * coarse.max(), 3e-3)
    assert fine.max() < 0.02


@pytest.mark.parametrize("tangential", sorted(TANGENTIAL_MODELS))
def test_patches_come_and_go_without_a_jump_in_any_tangential_model(
    totals_of, tangential
):
    """0.3 % where the second patch comes and where the last but one goes; patches of
    kik_piotrowski.
    """
    left, right = where_patches_change(totals_of(CASES[0], MODELS), 4e-3, 8e-3)
    assert left.size >= 2
    totals = totals_of(CASES[0], replace(MODELS, tangential=tangential))
    for k in (0, -1):
        actual = changes(totals(np.array([left[k], right[k]])))
        assert max(value[0] for value in actual.values()) < 3e-3, (left[k], actual)
