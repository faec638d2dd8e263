"""The sample of the siege, or with WEARSIM_SIEGE=1.0 all of it: attacks by seeds, see
`siege.py`.
"""

import pytest
import siege
import siege_profiles

TOGETHER = (
    "kills",
    "environment",
)  # one process for both, whose server and results they share


@pytest.mark.siege
@pytest.mark.parametrize(
    "kinds",
    [TOGETHER, *((kind,) for kind in siege.COUNTS if kind not in TOGETHER)],
    ids="+".join,
)
def test_no_attack_breaks_a_rule(kinds):
    for kind in kinds:
        counts, faults = siege.besiege(kind, range(siege.count_of(kind)))
        assert not faults, "\n".join(faults.values())
        assert counts.total() > 0


def test_a_broken_rule_is_reported_with_the_command_that_repeats_it(monkeypatch):
    """Here everything is read; garbage that is read breaks a rule, changed numbers do
    not.
    """
    monkeypatch.setattr(
        siege_profiles, "attempt", lambda path, kind, **statements: "a profile"
    )
    seeds = [
        k
        for k in range(12)
        if siege.way_of("profiles", k)[1] in ("cut off", "garbage", "numbers")
    ]
    counts, faults = siege.besiege("profiles", seeds)
    assert counts["numbers", siege.ACCEPTED] == 2
    garbage = [k for k in seeds if siege.way_of("profiles", k)[1] == "garbage"]
    assert set(garbage) <= faults.keys()
    for seed in garbage:
        assert faults[seed].endswith(
            f"python reports/reliability.py --kind profiles --seed {seed}"
        )


def test_a_seed_is_always_the_same_attack():
    assert [siege.attack("profiles", k) for k in range(6)] == [
        siege.attack("profiles", k) for k in range(6)
    ]
