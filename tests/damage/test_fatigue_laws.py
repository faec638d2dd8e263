from dataclasses import replace

import numpy as np
import pytest
from law_settings import fatigue_settings

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import (
    FATIGUE_LAWS,
    FatigueSettings,
    coefficients_of,
    counts_cycles,
    passage_damage,
)
from wearsim.damage.fatigue.loads import (
    WEAR_NUMBERS,
    wear_number_with_spin,
    wear_number_without_spin,
    work_share,
)
from wearsim.errors import NumericalError, SceneError
from wearsim.quantities import QUANTITIES

MADE_FOR = [
    FatigueSettings(law, name, wear_number=number, branch=branch, crack_depth=depth)
    for name, result in sorted(COEFFICIENT_SETS.items())
    for law in result.laws
    if law in FATIGUE_LAWS
    for number in ("with_spin", "without_spin")
    if "wear_number" in FATIGUE_LAWS[law].parameters or number == "without_spin"
    for branch, depth in (("net", None), ("rising", 5e-3))
    if FATIGUE_LAWS[law].contains_removal or branch == "net"
]
NAMES = [
    f"{each.law}-{each.coefficients}-{each.wear_number}-{each.branch}"
    for each in MADE_FOR
]


def turned(loads):
    """Return the loads of the other wheel."""
    fields = loads.fields
    return replace(
        loads,
        force_y=-loads.force_y,
        creepage_y=-loads.creepage_y,
        spin=-loads.spin,
        spin_moment=-loads.spin_moment,
        y=-loads.y[:, ::-1],
        fields=replace(
            fields,
            **{
                name: getattr(fields, name)[..., ::-1]
                for name in (
                    "pressure",
                    "shear_x",
                    "slip_x",
                    "work_density",
                    "x_lead",
                    "cell_length",
                )
            },
            **{
                name: -getattr(fields, name)[..., ::-1]
                for name in ("shear_y", "slip_y")
            },
        ),
    )


def part(loads, m):
    def one(values):
        return {key: value[m : m + 1] for key, value in values.items()}

    values = dict(vars(loads))
    fields = values.pop("fields")
    return replace(loads, **one(values), fields=replace(fields, **one(vars(fields))))


@pytest.mark.parametrize("settings", MADE_FOR, ids=NAMES)
@pytest.mark.parametrize("peak", [0.0, 1e6, 5e6, 200e6])
def test_fatigue_law_contract(settings, peak, loads):
    given = loads(peak)
    result = passage_damage(given, settings)
    m, ny = given.y.shape
    assert result.index.shape == result.index_y.shape == result.damage.shape == (m,)
    assert result.strip_damage.shape == (m, ny)
    width = given.fields.strip_width
    # shared, not made: 1e-12 of the damage of the passage
    total = result.strip_damage.sum(axis=1) * width
    np.testing.assert_allclose(total, result.damage, rtol=1e-12, atol=1e-25)
    assert (np.abs(result.index_y) <= np.abs(given.y).max(axis=1)).all()
    assert (
        "floor" not in coefficients_of(settings).values or (result.damage >= 0.0).all()
    )
    may_heal = FATIGUE_LAWS[settings.law].contains_removal and settings.branch == "net"
    assert may_heal or (result.strip_damage >= 0.0).all()
    assert (np.sign(result.strip_damage) * np.sign(result.damage)[:, None] >= 0.0).all()
    mirrored = passage_damage(turned(given), settings)
    np.testing.assert_allclose(
        mirrored.strip_damage[:, ::-1], result.strip_damage, rtol=1e-12
    )
    np.testing.assert_allclose(mirrored.index, result.index, rtol=1e-12)
    for k in range(m):
        alone = passage_damage(part(given, k), settings)
        np.testing.assert_allclose(
            alone.strip_damage[0], result.strip_damage[k], rtol=1e-12
        )


@pytest.mark.parametrize("settings", MADE_FOR, ids=NAMES)
def test_no_shear_no_damage(settings, loads):
    given = loads(0.0)
    fields = replace(
        given.fields,
        shear_x=0 * given.fields.shear_x,
        slip_x=given.fields.slip_x + 1e-3,
    )
    result = passage_damage(
        replace(given, force_x=np.zeros(3), fields=fields), settings
    )
    assert not result.damage.any()
    assert not result.strip_damage.any()


@pytest.mark.parametrize("settings", MADE_FOR, ids=NAMES)
@pytest.mark.parametrize("name", ["pressure", "shear_x", "work_density"])
def test_fatigue_fields_that_are_not_finite_are_stopped(settings, name, loads):
    given = loads(5e6)
    getattr(given.fields, name)[1, 9, 9] = np.nan
    with pytest.raises(NumericalError, match=r"in 1 of 3 patches \(first: 1\)"):
        passage_damage(given, settings)


def test_a_patch_without_load_is_stopped(loads):
    given = loads(5e6)
    with pytest.raises(NumericalError, match="carry no load"):
        passage_damage(
            replace(given, normal_force=np.array([1.0, 0.0, 1.0])), FatigueSettings()
        )


def test_every_law_has_a_set_and_a_quantity():
    known = {
        "stress_index",
        "surface_fatigue_index",
        "surface_fatigue_index_local",
        "wlrm",
    }
    assert known <= set(FATIGUE_LAWS)
    assert {each.law for each in MADE_FOR} == set(FATIGUE_LAWS)
    for name, law in FATIGUE_LAWS.items():
        assert law.index_quantity in QUANTITIES
        assert coefficients_of(fatigue_settings(name)).name == law.coefficients
    assert [name for name in sorted(known) if FATIGUE_LAWS[name].contains_removal] == [
        "wlrm"
    ]
    assert [
        name
        for name in (*sorted(known), "law of a later version")
        if counts_cycles(name)
    ] == ["wlrm"]


def test_wear_numbers_with_and_without_spin(loads):
    """The fixture puts a quarter of the work into spin: 1e-12."""
    given = loads(5e6)
    work = given.fields.strip_work.sum(axis=1) * given.fields.strip_width
    np.testing.assert_allclose(wear_number_with_spin(given), work, rtol=1e-12)
    np.testing.assert_allclose(wear_number_without_spin(given), 0.75 * work, rtol=1e-12)
    assert set(WEAR_NUMBERS) == {"with_spin", "without_spin"}


def test_classical_wear_number_adds_magnitudes(loads):
    """A lateral force along its creepage (spin does that) counts as work in the
    classical sum only.
    """
    given = replace(loads(1e6), force_y=np.full(3, 1e3), creepage_y=np.full(3, 2e-3))
    without = loads(1e6)
    np.testing.assert_allclose(
        wear_number_without_spin(given) - wear_number_without_spin(without),
        2.0,
        rtol=1e-12,
    )
    difference = wear_number_with_spin(without) - wear_number_with_spin(given)
    assert difference[:2] == pytest.approx([2.0, 2.0])


def test_share_is_that_of_the_work_and_of_the_load_where_nothing_slips(loads):
    given = loads(5e6)
    share = work_share(given)
    np.testing.assert_allclose(
        (share.sum(axis=1) * given.fields.strip_width), 1.0, rtol=1e-12
    )
    work = given.fields.strip_work
    np.testing.assert_allclose(
        share[0] / share[0].max(), work[0] / work[0].max(), rtol=1e-12
    )
    load = given.fields.cell_length[2]
    np.testing.assert_allclose(share[2] / share[2].max(), load / load.max(), rtol=1e-12)


def fault(settings):
    with pytest.raises(SceneError) as caught:
        coefficients_of(settings)
    return str(caught.value).splitlines()


def test_removal_of_cracks_is_never_counted_twice_nor_forgotten():
    message = fault(fatigue_settings("wlrm", crack_depth=5e-3))
    assert len(message) == 1
    assert "both would count wear twice" in message[0]
    assert "needs the removal" in fault(fatigue_settings("wlrm", branch="rising"))[0]
    assert coefficients_of(fatigue_settings("wlrm"))
    assert coefficients_of(fatigue_settings("wlrm", branch="rising", crack_depth=5e-3))
    both = fault(fatigue_settings("stress_index", branch="rising", crack_depth=5e-3))
    assert both[0] == 'branch = "rising" acts with law = "wlrm" only; delete it'
    assert "orders passages" in both[1]


def test_all_faults_of_fatigue_settings():
    message = fault(FatigueSettings("wlrm", "burstow", "spin", "fall", 1.0, 1.0))
    assert message == [
        'wear_number = "spin" must be without_spin or with_spin',
        'branch = "fall" must be net or rising',
        "crack_depth = 1000 must be at least 0.001 and at most 100 mm",
        "crack_width = 1000 must be at least 0.1 and at most 200 mm",
        'coefficient set "burstow" is unknown; there is burstow_2004, '
        "burstow_2004_20n; did you mean "
        "'burstow_2004'?",
    ]
    other = fault(fatigue_settings("wlrm", coefficients="dirks_enblom_2011"))
    assert other == [
        'coefficients = "dirks_enblom_2011" belong to stress_index, not to law = '
        '"wlrm"; '
        "take burstow_2004, burstow_2004_20n"
    ]
    with pytest.raises(SceneError, match="did you mean 'wlrm'"):
        fatigue_settings("wlmr")


@pytest.mark.parametrize("law", sorted(FATIGUE_LAWS))
def test_fatigue_laws_take_a_few_patches_at_a_time(law, loads):
    """51 patches, more than one part of 16: the same bits as all at once, and none
    lost.
    """
    given = loads(50e6)

    def many(values, count):
        return {name: np.concatenate([value] * count) for name, value in values.items()}

    values = dict(vars(given))
    fields = values.pop("fields")
    more = replace(
        given, **many(values, 17), fields=replace(fields, **many(vars(fields), 17))
    )
    result, once = (
        passage_damage(more, fatigue_settings(law)),
        passage_damage(given, fatigue_settings(law)),
    )
    for name, value in vars(once).items():
        assert (getattr(result, name) == np.concatenate([value] * 17)).all()
