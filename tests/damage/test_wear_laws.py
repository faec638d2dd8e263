from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.wear import (
    FORMS,
    WEAR_LAWS,
    WEAR_REGIMES,
    WearSettings,
    coefficient_set,
    passage_depth,
    regimes,
    wear_law,
)
from wearsim.errors import NumericalError, SceneError

MADE_FOR = [
    (law, name)
    for law in sorted(WEAR_LAWS)
    for name, found in sorted(COEFFICIENT_SETS.items())
    if law == "none" or law in found.laws
]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("law", "name"), MADE_FOR)
@pytest.mark.parametrize("peak", [0.0, 5e6, 200e6])
def test_wear_law_contract(law, name, form, peak, patches):
    fields, area = patches(peak)
    depth = WEAR_LAWS[law](fields, area, COEFFICIENT_SETS[name], form=form, density=7850.0)
    assert depth.shape == (len(WEAR_REGIMES[law]), *fields.cell_length.shape)
    assert np.isfinite(depth).all()
    assert (depth >= 0.0).all()  # wear never adds material
    still = ~fields.slip_x.any(axis=1) & ~fields.slip_y.any(axis=1)
    assert still.any()
    assert not depth[:, still].any()  # nor acts where nothing slides
    if law != "none" and peak > 0.0:
        assert (depth.sum(axis=0)[~still] > 0.0).all()
        lighter = WEAR_LAWS[law](fields, area, COEFFICIENT_SETS[name], form=form, density=2 * 7850.0)
        np.testing.assert_allclose(2.0 * lighter, depth, rtol=1e-12)  # mass is what laws give


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("law", "name"), MADE_FOR)
def test_more_work_never_wears_less_but_for_written_jumps(law, name, form, patches):
    """The plateau of the severe regime lies 0.2 % below the end of the mild one."""
    before = None
    for peak in np.geomspace(0.1e6, 300e6, 30):
        depth = WEAR_LAWS[law](*patches(peak), COEFFICIENT_SETS[name], form=form).sum()
        assert before is None or depth >= before * (1.0 - 0.0022)
        before = depth


def test_every_law_has_regimes_and_a_set():
    assert set(WEAR_REGIMES) == set(WEAR_LAWS)
    for law in WEAR_LAWS:
        assert regimes(law)
        assert any(made == law for made, _ in MADE_FOR)


@pytest.mark.parametrize("name", sorted(COEFFICIENT_SETS))
def test_coefficient_set_cites(name):
    found = COEFFICIENT_SETS[name]
    assert found.name == name
    assert set(found.laws) <= set(WEAR_LAWS)
    assert found.source
    assert found.validity
    for value in found.values.values():
        assert value.unit
        assert value.place
        assert value.certainty in {"printed", "confirmed", "derived", "uncertain"}
        assert value.value > 0.0


def test_unknown_names_tell_what_there_is_and_the_nearest():
    with pytest.raises(SceneError, match=r'wear law "ufsd" is unknown; there is none, usfd; .* "usfd"\?'):
        wear_law("ufsd")
    with pytest.raises(SceneError, match=r'did you mean "lewis_dwyer_joyce_2004"\?'):
        coefficient_set("lewis_dwyer_2004", "usfd")
    with pytest.raises(SceneError, match="wear law"):
        regimes("archard")


def test_set_of_another_law_is_refused(monkeypatch):
    other = replace(COEFFICIENT_SETS["lewis_dwyer_joyce_2004"], name="other", laws=("archard",))
    monkeypatch.setitem(COEFFICIENT_SETS, "other", other)
    with pytest.raises(SceneError, match=r"belong to archard, not to law = .usfd.; take lewis_dwyer"):
        coefficient_set("other", "usfd")
    assert coefficient_set("other", "none") is other


def test_unknown_form_is_refused(patches):
    with pytest.raises(SceneError, match="there is local, patch_mean"):
        passage_depth(*patches(1e6), SimpleNamespace(**vars(WearSettings()) | {"form": "mean"}))


def test_fields_that_are_not_finite_are_stopped(patches):
    fields, area = patches(5e6)
    fields.work_density[1, 9, 9] = np.nan
    with pytest.raises(NumericalError, match=r"in 1 of 3 patches \(first: 1\)"):
        passage_depth(fields, area, WearSettings())
