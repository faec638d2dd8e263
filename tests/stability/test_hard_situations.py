"""Every combination of contact models in every hard situation: right within its stated error, or refused.

Never numbers that are not finite, a load that is not carried, a hang or an error for programmers: see
`wearsim.studies.robustness.unsound`. Coarse grids here; reports/where_methods_fail.md has finer ones.
"""

from dataclasses import replace
from functools import cache

import pytest

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.studies.robustness import COMBINATIONS, REFUSED, STATED, UNSTATED, answer, errors_of
from wearsim.studies.situations import SITUATIONS

GRID, FINE = 40, 60
SECONDS = 20.0  # a hundred times what the slowest takes; the first call of a kernel compiles it
WAYS_OUT = ("check", "take", "give", "lower", "smooth", "raise")

KNOWN = {
    ("measured noise", "10 um", "kik_piotrowski"): "measured area 104 %, strip work 99 %, target 25 %, 50 %: "
    "its pressure is that of a smooth profile, and nothing tells so",
    ("measured noise", "10 um", "half_space"): "measured strip work 49 %, target 20 %: 30 cells do not "
    "resolve contacts on single asperities",
    ("load of 1 N", "1 N", "knothe_le_the"): "measured pressure 59 %, target 20 %: the patch is "
    "two points of the gap wide",
    ("next to no spin, no creepage", "0.01 1/m", None): "measured strip work 94 to 180 %, target 20 to 70 %: "
    "slip in a few cells at the trailing edge, power_balance 0.03 to 0.2",
    **{
        ("large yaw or shift", "1000 mrad, on the edge of the chamfer", normal): "measured an answer, target "
        "a refusal: the half-space solution does not converge on an edge, and no other model tells so"
        for normal in sorted(NORMAL_MODELS)
        if normal != "half_space"
    },
}  # fmt: skip


def cases(every=1):
    """All situations with all combinations, or of every so many situations, others for each combination."""
    return [
        pytest.param(
            situation, normal, tangential, id=f"{situation.kind}: {situation.title}-{normal}-{tangential}",
            marks=[
                pytest.mark.xfail(strict=True, reason=KNOWN[situation.kind, situation.title, who])
                for who in (normal, None)
                if (situation.kind, situation.title, who) in KNOWN
            ],
        )
        for i, situation in enumerate(SITUATIONS)
        for k, (normal, tangential) in enumerate(COMBINATIONS)
        if (i + k) % every == 0
    ]  # fmt: skip


@cache
def case_of(situation):
    return situation.case()


@cache
def truth(situation, grid):
    case = replace(case_of(situation), strips=None, cells=None)
    return answer(case, "half_space", "half_space", grid).wheel


@pytest.fixture(scope="module", autouse=True)
def compiled():
    for normal, tangential in COMBINATIONS:
        answer(SITUATIONS[0].case(), normal, tangential, GRID)


def examine(situation, normal, tangential, grid, fine):
    found = answer(case_of(situation), normal, tangential, grid)
    assert found.seconds < SECONDS
    if found.outcome == REFUSED:
        assert found.told.isprintable()
        assert any(word in found.told for word in WAYS_OUT), found.told
        return
    assert not found.outcome, found.told
    reference = truth(situation, fine)
    assert reference is not None, "an answer where the half-space solution refuses"
    limits = STATED.get((normal, tangential), UNSTATED)
    for name, error in errors_of(case_of(situation), found.wheel, reference).items():
        assert abs(error) <= limits[name], f"{name}: {100.0 * error:+.0f} %"


@pytest.mark.parametrize(("situation", "normal", "tangential"), cases())
def test_answer_within_the_stated_error_or_a_clear_refusal(situation, normal, tangential):
    examine(situation, normal, tangential, GRID, FINE)


@pytest.mark.slow
@pytest.mark.parametrize(("situation", "normal", "tangential"), cases(every=4))
def test_the_same_on_fine_grids(situation, normal, tangential):
    examine(situation, normal, tangential, 50, 80)
