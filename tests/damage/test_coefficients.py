import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.damage.wear import WEAR_LAWS

CERTAINTIES = {"printed", "confirmed", "derived", "recalled", "uncertain"}


@pytest.mark.parametrize("name", sorted(COEFFICIENT_SETS))
def test_coefficient_set_cites(name):
    result = COEFFICIENT_SETS[name]
    assert result.name == name
    assert result.laws
    assert set(result.laws) <= {*WEAR_LAWS, *FATIGUE_LAWS}
    assert result.source
    assert result.validity
    for value in result.values.values():
        assert value.unit
        assert value.place
        assert value.certainty in CERTAINTIES
        assert value.value > 0.0 or value.unit == "-"
        if value.limits is not None:
            assert value.limits[0] <= value.value <= value.limits[1]


def test_uncertain_numbers_are_marked_and_have_a_band():
    result = COEFFICIENT_SETS["jendel_2002"]
    assert result.uncertain[0] == "k_mild = 0.0005, range 0.0001 to 0.001 (uncertain)"
    assert len(result.uncertain) == len(result.values)
    assert not COEFFICIENT_SETS["lewis_dwyer_joyce_2004"].uncertain
    assert result.values["k_severe"].limits == [30e-4, 40e-4]


def test_limits_of_the_twin_discs_name_the_table_that_supports_them():
    """Table 3 of the paper gives heat, and so T-gamma/A, at each slip; limits lie
    between two of its rows.
    """
    values = COEFFICIENT_SETS["lewis_dwyer_joyce_2004"].values
    assert (
        "table 3 of the paper: 4.3 N/mm2 at 1 % slip, 17 at 3 %"
        in values["severe_limit"].place
    )
    assert (
        "table 3 of the paper: 55 N/mm2 at 10 % slip, 82 at 15 %"
        in values["catastrophic_limit"].place
    )


def test_every_shipped_set_has_a_name_in_words_of_its_own():
    titles = [shipped.title for shipped in COEFFICIENT_SETS.values()]
    assert len(set(titles)) == len(titles)
    assert all(title and "_" not in title for title in titles)
