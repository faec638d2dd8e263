from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from law_settings import wear_settings

from wearsim.contact.patch import SurfaceFields
from wearsim.damage.coefficients import COEFFICIENT_SETS, coefficient_set
from wearsim.damage.wear import (
    WEAR_LAWS,
    WearSettings,
    coefficients_of,
    energy,
    passage_depth,
)
from wearsim.damage.wear.law import FORMS
from wearsim.errors import NumericalError, SceneError
from wearsim.scene.wear_table import WearTableSection, wear_table

STATED = {"source": "test", "certainty": "made up", "beyond": "hold"}
EXAMPLE_TABLES = {
    name: wear_table(WearTableSection(**{**STATED, **columns}), name)[0]
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
    for name, result in sorted(SETS.items())
    for form in WEAR_LAWS[law].forms
    if not WEAR_LAWS[law].wears or law in result.laws
]
PUBLISHED = sorted(
    name for name, law in WEAR_LAWS.items() if law.coefficients is not None
)
MASS_UNITS = ("ug ", "kg ")


def gives_mass(result):
    return getattr(result, "rate", "").startswith("mass") or any(
        number.unit.startswith(MASS_UNITS) for number in result.values.values()
    )


def turned(fields):
    """Return the fields of the other wheel: lateral position, shear and slip change
    sign.
    """
    return replace(
        fields,
        **{
            name: getattr(fields, name)[..., ::-1].copy()
            for name in (
                "pressure",
                "shear_x",
                "slip_x",
                "work_density",
                "x_lead",
                "cell_length",
            )
        },
        **{name: -getattr(fields, name)[..., ::-1] for name in ("shear_y", "slip_y")},
    )


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_wear_law_contract(law, name, form, patches):
    for peak in (0.0, 5e6, 200e6):
        obeys_contract(law, name, form, peak, *patches(peak))


def obeys_contract(law, name, form, peak, fields, area):
    record = WEAR_LAWS[law]
    depth = record.depth(fields, area, SETS[name], form=form)
    assert depth.shape == (len(record.regimes), *fields.cell_length.shape)
    assert np.isfinite(depth).all()
    assert (depth >= 0.0).all()  # wear never adds material
    still = ~fields.slip_x.any(axis=1) & ~fields.slip_y.any(axis=1)
    assert still.any()
    assert not depth[:, still].any()  # nor acts where nothing slides
    mirrored = record.depth(turned(fields), area, SETS[name], form=form)
    np.testing.assert_allclose(mirrored[..., ::-1], depth, rtol=1e-12)
    if record.wears and peak > 0.0:
        assert (depth.sum(axis=0)[~still] > 0.0).all()
        assert "density" in record.parameters or not gives_mass(SETS[name])
    if "density" in record.parameters:
        lighter = record.depth(fields, area, SETS[name], form=form, density=2 * 7850.0)
        factor = (
            2.0 if gives_mass(SETS[name]) else 1.0
        )  # laws of mass and laws of volume
        np.testing.assert_allclose(factor * lighter, depth, rtol=1e-12)


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_only_laws_that_need_fields_take_more_than_the_work_of_cells(
    law, name, form, patches
):
    fields, area = patches(60e6)
    unknown = np.broadcast_to(np.nan, fields.pressure.shape)
    others = ("pressure", "shear_x", "shear_y", "slip_x", "slip_y")
    depth = WEAR_LAWS[law].depth(
        replace(fields, **dict.fromkeys(others, unknown)), area, SETS[name], form=form
    )
    # of tables it is a matter of their quantities: those of work alone, too, ask for
    # all
    assert np.isnan(depth).any() or law == "table" or not WEAR_LAWS[law].needs_fields
    if not WEAR_LAWS[law].needs_fields:
        np.testing.assert_array_equal(
            depth, WEAR_LAWS[law].depth(fields, area, SETS[name], form=form)
        )


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_patches_do_not_know_each_other(law, name, form, patches):
    """A batch is its patches one by one, 1e-12."""
    fields, area = patches(60e6)
    both = WEAR_LAWS[law].depth(fields, area, SETS[name], form=form)
    for m in range(area.size):
        one = replace(
            fields, **{key: value[m : m + 1] for key, value in vars(fields).items()}
        )
        alone = WEAR_LAWS[law].depth(one, area[m : m + 1], SETS[name], form=form)
        np.testing.assert_allclose(alone[:, 0], both[:, m], rtol=1e-12)


@pytest.mark.parametrize(
    ("law", "name", "form"), [made for made in MADE_FOR if made[0] != "archard"]
)
def test_more_work_never_wears_less_but_for_written_jumps(law, name, form, patches):
    """The plateau of USFD's severe regime lies 0.2 % below the end of the mild one;
    Archard's map falls.
    """
    before = None
    for peak in np.geomspace(0.1e6, 300e6, 30):
        depth = WEAR_LAWS[law].depth(*patches(peak), SETS[name], form=form).sum()
        assert before is None or depth >= before * (1.0 - 0.0022)
        before = depth


@pytest.mark.parametrize(("law", "name", "form"), MADE_FOR)
def test_fields_that_are_not_finite_are_stopped(law, name, form, patches):
    if not WEAR_LAWS[law].wears:
        return
    for field in ("work_density", "cell_length"):
        fields, area = patches(5e6)
        getattr(fields, field)[1, 9] = np.nan
        settings = WearSettings(law=law, coefficients=SETS[name], form=form)
        with pytest.raises(NumericalError, match=r"in 1 of 3 patches \(first: 1\)"):
            passage_depth(fields, area, settings)


def test_every_law_has_regimes_and_a_set():
    assert {"archard", "brr", "energy", "none", "table", "usfd"} <= set(WEAR_LAWS)
    for name, law in WEAR_LAWS.items():
        assert law.name == name
        assert any(made[0] == name for made in MADE_FOR)
        assert set(law.forms) <= set(FORMS)
        assert {regime for regime, _ in law.outside} <= set(law.regimes)
        assert (law.coefficients is None) == ("table" in law.parameters)
    for name in PUBLISHED:
        settings = wear_settings(name)
        assert (
            coefficients_of(settings) is COEFFICIENT_SETS[WEAR_LAWS[name].coefficients]
        )
        assert passage_depth_of_nothing(settings).shape[0] == len(
            WEAR_LAWS[name].regimes
        )


def passage_depth_of_nothing(settings):
    cells = np.zeros((1, 2, 3))
    fields = SurfaceFields(
        *[cells] * 6, cells[:, 0], cells[:, 0], strip_width=np.ones(1), speed=np.ones(1)
    )
    depth = passage_depth(fields, np.zeros(1), settings)
    assert not depth.any()
    return depth


def test_a_value_in_place_of_a_published_one_moves_wear_between_regimes(patches):
    """The law jumps between 8 and 10.4 N/mm2 with the lower limit of the severe
    regime.
    """
    fields, area = patches(12e6)
    mild, severe, _ = passage_depth(fields, area, wear_settings("usfd"))
    lower = wear_settings("usfd", values=(("severe_limit", 8.0),))
    mild_below_8, severe_from_8, _ = passage_depth(fields, area, lower)
    assert severe_from_8.sum() > severe.sum() > 0.0
    assert 0.0 < mild_below_8.sum() < mild.sum()


@pytest.mark.parametrize("law", PUBLISHED)
def test_scale_multiplies_the_depths_of_every_law(patches, law):
    depth = passage_depth(*patches(5e6), wear_settings(law))
    scaled = passage_depth(*patches(5e6), wear_settings(law, scale=2.5))
    np.testing.assert_array_equal(scaled, 2.5 * depth)


def test_unknown_names_tell_what_there_is_and_the_nearest():
    with pytest.raises(
        SceneError, match=r'wear law "ufsd" is unknown; there is archard, .* \'usfd\'\?'
    ):
        WEAR_LAWS["ufsd"]
    with pytest.raises(SceneError, match=r"did you mean \'lewis_dwyer_joyce_2004\'\?"):
        coefficient_set("lewis_dwyer_2004", "usfd")
    with pytest.raises(SceneError, match="wear law"):
        wear_settings("arkard")


def test_set_of_another_law_is_refused():
    with pytest.raises(
        SceneError, match=r"belong to archard, not to law = .usfd.; take lewis_dwyer"
    ):
        coefficient_set("jendel_2002", "usfd")
    with pytest.raises(SceneError, match="take a table of your own"):
        coefficient_set("jendel_2002", "table")
    with pytest.raises(SceneError, match=r'"jendel" is unknown; there is none$'):
        coefficient_set("jendel", "table")
    with pytest.raises(SceneError, match=r"coefficients = 5 must be .*; take lewis"):
        coefficient_set(5, "usfd")
    with pytest.raises(
        SceneError, match=r'"constant" belong to energy, not to law = .archard.'
    ):
        coefficient_set(SETS["constant"], "archard")
    settings = wear_settings("none", coefficients="jendel_2002")
    assert coefficients_of(settings) is COEFFICIENT_SETS["jendel_2002"]


def test_unknown_form_is_refused(patches):
    with pytest.raises(SceneError, match='write form = "local" or "patch_mean"'):
        passage_depth(
            *patches(1e6), SimpleNamespace(**vars(WearSettings()) | {"form": "mean"})
        )


def test_settings_that_do_not_fit_are_told_all_at_once(patches):
    wrong = WearSettings(
        law="brr", coefficients="jendel_2002", seizure_cap="regime", hardness=3e9
    )
    with pytest.raises(SceneError) as caught:
        passage_depth(*patches(1e6), wrong)
    message = str(caught.value).splitlines()
    assert len(message) == 4
    assert (
        message[0] == 'form = "local" is not of law = "brr"; write form = "patch_mean"'
    )
    assert (
        message[1] == 'seizure_cap acts with law = "archard" only, not "brr"; delete it'
    )
    assert message[2] == 'hardness acts with law = "archard" only, not "brr"; delete it'
    assert "take pearce_sherratt_1991, pearce_sherratt_1991_continuous" in message[3]


def test_hardness_of_the_wheel_replaces_that_of_the_set():
    result = coefficients_of(wear_settings("archard", hardness=2.7e9))
    assert result["hardness"] == pytest.approx(2.7)
    assert result.values["hardness"].certainty == "given"
    assert "hardness = 2.7 GPa" in result.departures[-1]


@pytest.mark.parametrize("law", PUBLISHED)
def test_laws_take_a_few_patches_at_a_time(law, patches):
    """50 patches, more than one part of 16: the same bits as all at once, and none
    lost.
    """
    fields, area = patches(50e6)
    many = replace(
        fields,
        **{name: np.concatenate([v] * 17)[:50] for name, v in vars(fields).items()},
    )
    depth = passage_depth(many, np.concatenate([area] * 17)[:50], wear_settings(law))
    once = passage_depth(fields, area, wear_settings(law))
    assert (depth == np.concatenate([once] * 17, axis=1)[:, :50]).all()
    none = replace(fields, **{name: v[:0] for name, v in vars(fields).items()})
    assert passage_depth(none, area[:0], wear_settings(law)).shape == (
        len(WEAR_LAWS[law].regimes),
        0,
        16,
    )
