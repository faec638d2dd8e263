from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.contact.patch import SurfaceFields
from wearsim.damage.coefficients import CERTAINTIES, COEFFICIENT_SETS
from wearsim.damage.wear import (
    DEFAULT_COEFFICIENTS,
    FORMS,
    WEAR_FORMS,
    WEAR_LAWS,
    WEAR_REGIMES,
    WearSettings,
    acting_coefficients,
    coefficient_set,
    default_settings,
    energy,
    passage_depth,
    passage_depths,
    regime_shares,
    regimes,
    wear_law,
    worn_volume,
)
from wearsim.damage.wear.table_file import wear_table
from wearsim.errors import NumericalError, SceneError

STATED = {"source": "test", "certainty": "made up", "beyond": "hold"}
EXAMPLE_TABLES = {
    name: wear_table({**STATED, **columns}, name)[0]
    for name, columns in {
        "table_mass": {
            "interpolation": "linear",
            "beyond": "slope",
            "T_gamma_A_N_mm2": [0, 10.4, 77.2],
            "mass_rate_ug_m_mm2": [2.0, 55, 60],
        },
        "table_energy": {
            "interpolation": "step",
            "power_density_W_mm2": [0, 4],
            "energy_coefficient_mm3_kJ": [0.09, 0.27],
        },
        "table_archard": {
            "interpolation": "linear",
            "hardness_GPa": 3.0,
            "slip_speed_m_s": [0, 1],
            "wear_coefficient": [1e-4, 5e-4],
        },
    }.items()
}
SETS = {
    **COEFFICIENT_SETS,
    "constant": energy.constant(1e-12, "round number"),
    **EXAMPLE_TABLES,
}
MADE_FOR = [
    (law, name, form)
    for law in sorted(WEAR_LAWS)
    for name, found in sorted(SETS.items())
    for form in WEAR_FORMS[law]
    if law == "none" or law in found.laws
]
MASS_UNITS = ("ug ", "kg ")


def gives_mass(found):
    return getattr(found, "rate", "").startswith("mass") or any(
        number.unit.startswith(MASS_UNITS) for number in found.values.values()
    )


def turned(fields):
    """Return the fields of the other wheel: lateral position, shear and slip change sign."""
    return replace(
        fields,
        **{
            name: getattr(fields, name)[..., ::-1].copy()
            for name in ("pressure", "shear_x", "slip_x", "work_density", "x_lead", "cell_length")
        },
        **{name: -getattr(fields, name)[..., ::-1] for name in ("shear_y", "slip_y")},
    )


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
@pytest.mark.parametrize("peak", [0.0, 5e6, 200e6])
def test_wear_law_contract(law, name, form, peak, patches):
    fields, area = patches(peak)
    depth = WEAR_LAWS[law](fields, area, SETS[name], form=form, density=7850.0)
    assert depth.shape == (len(WEAR_REGIMES[law]), *fields.cell_length.shape)
    assert np.isfinite(depth).all()
    assert (depth >= 0.0).all()  # wear never adds material
    still = ~fields.slip_x.any(axis=1) & ~fields.slip_y.any(axis=1)
    assert still.any()
    assert not depth[:, still].any()  # nor acts where nothing slides
    mirrored = WEAR_LAWS[law](turned(fields), area, SETS[name], form=form, density=7850.0)
    np.testing.assert_allclose(mirrored[..., ::-1], depth, rtol=1e-12)
    if law != "none" and peak > 0.0:
        assert (depth.sum(axis=0)[~still] > 0.0).all()
        lighter = WEAR_LAWS[law](fields, area, SETS[name], form=form, density=2 * 7850.0)
        factor = 2.0 if gives_mass(SETS[name]) else 1.0  # laws of mass and laws of volume
        np.testing.assert_allclose(factor * lighter, depth, rtol=1e-12)


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_patches_do_not_know_each_other(law, name, form, patches):
    """A batch is its patches one by one, 1e-12."""
    fields, area = patches(60e6)
    both = WEAR_LAWS[law](fields, area, SETS[name], form=form)
    for m in range(area.size):
        one = replace(fields, **{key: value[m : m + 1] for key, value in vars(fields).items()})
        alone = WEAR_LAWS[law](one, area[m : m + 1], SETS[name], form=form)
        np.testing.assert_allclose(alone[:, 0], both[:, m], rtol=1e-12)


@pytest.mark.parametrize(("law", "name", "form"), [made for made in MADE_FOR if made[0] != "archard"])
def test_more_work_never_wears_less_but_for_written_jumps(law, name, form, patches):
    """The plateau of USFD's severe regime lies 0.2 % below the end of the mild one; Archard's map falls."""
    before = None
    for peak in np.geomspace(0.1e6, 300e6, 30):
        depth = WEAR_LAWS[law](*patches(peak), SETS[name], form=form).sum()
        assert before is None or depth >= before * (1.0 - 0.0022)
        before = depth


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_fields_that_are_not_finite_are_stopped(law, name, form, patches):
    if law == "none":
        return
    for field in ("work_density", "cell_length"):
        fields, area = patches(5e6)
        getattr(fields, field)[1, 9] = np.nan
        settings = WearSettings(law=law, coefficients=SETS[name], form=form)
        with pytest.raises(NumericalError, match=r"in 1 of 3 patches \(first: 1\)"):
            passage_depth(fields, area, settings)


def test_every_law_has_regimes_and_a_set():
    assert set(WEAR_REGIMES) == set(WEAR_FORMS) == set(WEAR_LAWS) == {*DEFAULT_COEFFICIENTS, "table"}
    for law in WEAR_LAWS:
        assert regimes(law)
        assert any(made[0] == law for made in MADE_FOR)
        assert set(WEAR_FORMS[law]) <= set(FORMS)
    for law, name in DEFAULT_COEFFICIENTS.items():
        assert coefficient_set(name, law) is COEFFICIENT_SETS[name]
        assert passage_depth_of_nothing(default_settings(law)).shape[0] == len(WEAR_REGIMES[law])
    with pytest.raises(SceneError, match="needs its own table"):
        default_settings("table")


def passage_depth_of_nothing(settings):
    cells = np.zeros((1, 2, 3))
    fields = SurfaceFields(*[cells] * 6, cells[:, 0], cells[:, 0], strip_width=np.ones(1), speed=np.ones(1))
    depth = passage_depth(fields, np.zeros(1), settings)
    assert not depth.any()
    return depth


@pytest.mark.parametrize("name", sorted(COEFFICIENT_SETS))
def test_coefficient_set_cites(name):
    found = COEFFICIENT_SETS[name]
    assert found.name == name
    assert found.laws
    assert set(found.laws) <= set(WEAR_LAWS)
    assert found.source
    assert found.validity
    for value in found.values.values():
        assert value.unit
        assert value.place
        assert value.certainty in set(CERTAINTIES) - {"given"}
        assert value.value > 0.0 or value.unit == "-"
        if value.limits is not None:
            assert value.limits[0] <= value.value <= value.limits[1]


def test_unknown_names_tell_what_there_is_and_the_nearest():
    with pytest.raises(SceneError, match=r'wear law "ufsd" is unknown; there is archard, .* "usfd"\?'):
        wear_law("ufsd")
    with pytest.raises(SceneError, match=r'did you mean "lewis_dwyer_joyce_2004"\?'):
        coefficient_set("lewis_dwyer_2004", "usfd")
    with pytest.raises(SceneError, match="wear law"):
        regimes("arkard")


def test_set_of_another_law_is_refused():
    with pytest.raises(SceneError, match=r"belong to archard, not to law = .usfd.; take lewis_dwyer"):
        coefficient_set("jendel_2002", "usfd")
    with pytest.raises(SceneError, match="take a table of your own"):
        coefficient_set("jendel_2002", "table")
    with pytest.raises(SceneError, match=r'"constant" belong to energy, not to law = .archard.'):
        coefficient_set(SETS["constant"], "archard")
    assert coefficient_set("jendel_2002", "none") is COEFFICIENT_SETS["jendel_2002"]


def test_unknown_form_is_refused(patches):
    with pytest.raises(SceneError, match="there is local, patch_mean"):
        passage_depth(*patches(1e6), SimpleNamespace(**vars(WearSettings()) | {"form": "mean"}))


def test_settings_that_do_not_fit_are_told_all_at_once(patches):
    wrong = WearSettings(law="brr", coefficients="jendel_2002", seizure_cap="regime", hardness=3e9)
    with pytest.raises(SceneError) as caught:
        passage_depth(*patches(1e6), wrong)
    told = str(caught.value).splitlines()
    assert len(told) == 4
    assert told[0] == 'form = "local": law = "brr" is a law of the whole patch; write form = "patch_mean"'
    assert "seizure_cap acts with" in told[1]
    assert "hardness acts with" in told[2]
    assert "take pearce_sherratt_1991, pearce_sherratt_1991_continuous" in told[3]


def test_hardness_of_the_wheel_replaces_that_of_the_set():
    found = acting_coefficients(default_settings("archard", hardness=2.7e9))
    assert found["hardness"] == pytest.approx(2.7)
    assert found.values["hardness"].certainty == "given"
    assert "hardness = 2.7 GPa" in found.departures[-1]


def test_several_laws_on_the_same_fields(patches):
    """Each exactly as if it were alone."""
    fields, area = patches(50e6)
    settings = [default_settings(law) for law in sorted(DEFAULT_COEFFICIENTS)]
    together = passage_depths(fields, area, settings)
    for one, depth in zip(settings, together, strict=True):
        assert (depth == passage_depth(fields, area, one)).all()


@pytest.mark.parametrize("law", sorted(DEFAULT_COEFFICIENTS))
def test_laws_take_a_few_patches_at_a_time(law, patches):
    """50 patches, more than one part of 16: the same bits as all at once, and none lost."""
    fields, area = patches(50e6)
    many = replace(fields, **{name: np.concatenate([v] * 17)[:50] for name, v in vars(fields).items()})
    depth = passage_depth(many, np.concatenate([area] * 17)[:50], default_settings(law))
    once = passage_depth(fields, area, default_settings(law))
    assert (depth == np.concatenate([once] * 17, axis=1)[:, :50]).all()
    none = replace(fields, **{name: v[:0] for name, v in vars(fields).items()})
    assert passage_depth(none, area[:0], default_settings(law)).shape == (len(WEAR_REGIMES[law]), 0, 16)


def test_regime_shares_sum_to_the_whole(patches):
    """Weighted with the share of the distance; 1e-12."""
    fields, area = patches(80e6)
    depth = passage_depth(fields, area, WearSettings())
    weight = np.array([0.0, 0.4, 0.6])
    shares = regime_shares(depth, fields.strip_width, weight)
    assert shares.sum() == pytest.approx(1.0, rel=1e-12)
    volume = worn_volume(depth, fields.strip_width)
    np.testing.assert_allclose(shares, volume[:, 1] / volume[:, 1].sum(), rtol=1e-12)
    assert not regime_shares(0.0 * depth, fields.strip_width).any()


def test_doubtful_numbers_are_marked_and_have_a_band():
    found = COEFFICIENT_SETS["jendel_2002"]
    assert found.doubts[0] == "k_mild = 0.0005, range 0.0001 to 0.001 (uncertain)"
    assert len(found.doubts) == len(found.values)
    assert not COEFFICIENT_SETS["lewis_dwyer_joyce_2004"].doubts
    assert found.values["k_severe"].limits == (30e-4, 40e-4)


def test_limits_of_the_twin_discs_name_the_table_that_bears_them_out():
    """Table 3 of the paper gives heat, and so T-gamma/A, at each slip; limits lie between two of its rows."""
    values = COEFFICIENT_SETS["lewis_dwyer_joyce_2004"].values
    assert "table 3 of the paper: 4.3 N/mm2 at 1 % slip, 17 at 3 %" in values["severe_limit"].place
    assert "table 3 of the paper: 55 N/mm2 at 10 % slip, 82 at 15 %" in values["catastrophic_limit"].place
