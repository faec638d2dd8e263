"""Every combination of contact models in every hard situation: within its stated error,
or not applicable.

Never numbers that are not finite, a load that is not carried, a hang or an error for
programmers: see `violated_laws` of reports/where_methods_fail.py. Coarse grids here;
where_methods_fail.md has finer ones.
"""

from functools import cache

import pytest
from where_methods_fail import (
    NOT_APPLICABLE,
    SECONDS,
    SITUATIONS,
    STATED,
    errors_between,
    problem_of,
    solve,
)

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.tangential import TANGENTIAL_MODELS

GRID, FINE = 40, 60
ADVICE = ("check", "take", "give", "lower", "smooth", "raise", "must be")

ONE_PLANE = (
    "one creepage and spin about the centre, where rigid slip of the reference is local"
)

PLANAR = [
    (normal, tangential)
    for normal in ("kik_piotrowski", "coupled_strips", "half_space")
    for tangential in ("fastsim", "coupled_strips", "half_space")
    if (normal, tangential)
    not in (("half_space", "coupled_strips"), ("half_space", "half_space"))
    and (normal, tangential) != ("coupled_strips", "coupled_strips")
]
"""Pairs whose patches have one creepage and spin about the centre."""

KNOWN = {
    **{
        (kind, situation, models): f"measured {measured}: {ONE_PLANE}"
        for kind, situation, measured, pairs in (
            (
                "plain tread",
                "shift 0",
                "strip work 54 to 64 %, target 25 to 50 %",
                PLANAR,
            ),
            (
                "contact jumps",
                "shift -0.77 mm",
                "strip work 45 to 61 %, target 25 to 50 %",
                PLANAR,
            ),
            (
                "roller of 100 to 1 mm",
                "radius 5 mm",
                "force 15 to 38 %, target 10 to 25 %",
                [("kik_piotrowski", "fastsim"), *PLANAR[3:]],
            ),
            (
                "soft and hard materials",
                "soft: E = 1 GPa",
                "strip work 76 to 89 %, power 27 %, target 25 to 50 %, 25 %",
                [*PLANAR, ("hertz", "coupled_strips")],
            ),
        )
        for models in pairs
    },
    (
        "soft and hard materials",
        "soft: E = 1 GPa",
        ("coupled_strips", "coupled_strips"),
    ): "measured power "
    "60 %, target 20 %: strips lie in planes of their own, the reference in one",
    (
        "measured noise",
        "10 um",
        "coupled_strips",
    ): "measured area 8 %, strip work 62 %, target 6 %, 35 %: "
    "contacts on single asperities",
    (
        "measured noise",
        "10 um",
        "kik_piotrowski",
    ): "measured area 104 %, strip work 99 %, target 25 %, 50 %: "
    "its pressure is that of a smooth profile, without a warning",
    (
        "measured noise",
        "10 um",
        "half_space",
    ): "measured strip work 49 %, target 20 %: 30 cells do not "
    "resolve contacts on single asperities",
    (
        "next to no spin, no creepage",
        "0.01 1/m",
        None,
    ): "measured strip work 94 to 180 %, target 20 to 70 %: "
    "slip in a few cells at the trailing edge, power_balance 0.03 to 0.2",
    **{
        (
            "large yaw or shift",
            yaw,
            normal,
        ): "measured a solution, target a message: the half-space does not "
        "converge on an edge, and these models do not notice"
        for yaw in ("1000 mrad", "1200 mrad")
        for normal in sorted(NORMAL_MODELS)
        if normal not in ("coupled_strips", "half_space")
    },
}


def cases(every, slow=()):
    """One in `every` situations, others for each combination; `slow`: the rests that
    only slow runs try.
    """
    return [
        pytest.param(
            i,
            *models,
            id=f"{situation['kind']}: {situation['situation']}-{'-'.join(models)}",
            marks=[
                *(
                    pytest.mark.xfail(strict=True, reason=KNOWN[key])
                    for key in (
                        (situation["kind"], situation["situation"], who)
                        for who in (models, models[0], None)
                    )
                    if key in KNOWN
                ),
                *([pytest.mark.slow] if (i + k) % every in slow else []),
            ],
        )
        for i, situation in enumerate(SITUATIONS)
        for k, models in enumerate(STATED)
        if (i + k) % every in (0, *slow)
    ]


@cache
def problem(index):
    return problem_of(SITUATIONS[index])


@cache
def reference(index, grid):
    situation = SITUATIONS[index] | {"strips": "", "cells": ""}
    return solve(situation, "half_space", "half_space", grid, problem(index)).sums


@pytest.fixture(scope="module", autouse=True)
def compiled():
    for models in STATED:
        solve(SITUATIONS[0], *models, GRID)


def examine(index, models, grid, fine):
    solution = solve(SITUATIONS[index], *models, grid, problem(index))
    assert solution.seconds < SECONDS
    if solution.outcome == NOT_APPLICABLE:
        assert solution.message.isprintable()
        assert any(word in solution.message for word in ADVICE), solution.message
        return
    assert not solution.outcome, solution.message
    fine_sums = reference(index, fine)
    assert fine_sums is not None, "a solution where the half-space is not applicable"
    errors = errors_between(solution.sums, fine_sums, problem(index)[2])
    for (name, error), limit in zip(errors.items(), STATED[models], strict=True):
        assert abs(error) <= limit, f"{name}: {100.0 * error:+.0f} %"


@pytest.mark.parametrize(
    ("index", "normal", "tangential"), cases(12, slow=tuple(range(1, 12)))
)
def test_solution_within_the_stated_error_or_a_clear_message(index, normal, tangential):
    examine(index, (normal, tangential), GRID, FINE)


@pytest.mark.slow
@pytest.mark.parametrize(("index", "normal", "tangential"), cases(4))
def test_the_same_on_fine_grids(index, normal, tangential):
    examine(index, (normal, tangential), 50, 80)


def test_every_registered_combination_states_its_errors():
    """Here each is tried; a new model has to say how wrong it may be."""
    assert set(STATED) == {
        (normal, tangential)
        for normal in NORMAL_MODELS
        for tangential in TANGENTIAL_MODELS
    }
