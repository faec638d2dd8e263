"""Comparison laws and fatigue in the report, from short campaigns of the real
physics.
"""

import re

import numpy as np
import pytest

import wearsim
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.damage.fatigue.agreement import agreement
from wearsim.report import answer, plates, sources, tables, tables_damage
from wearsim.report.figures import campaign
from wearsim.report.html import SECTIONS, Campaigns, render, write_report
from wearsim.report.inspect import inspect, summary_text
from wearsim.report.style import plain
from wearsim.report.texts import words
from wearsim.results.fatigue import crack_distances, cycles, first_cracks
from wearsim.results.limits import attributes_of
from wearsim.scene import build, load_scene
from wearsim.translation.translate import translate

LAWS = """
[wear]
also_evaluate = ["archard", "none"]
[fatigue]
laws = ["wlrm", "surface_fatigue_index_local"]
branch = "rising"
crack_depth_mm = 2
"""
BLOCK = {"name": "curve", "shift_mm": 5, "yaw_mrad": 3, "distance_km": 2}


@pytest.fixture(scope="module")
def ran(run_pair):
    return run_pair(5, {"more": LAWS}, {"more": LAWS})


@pytest.fixture(scope="module")
def folder(ran):
    return ran[0] / "out"


@pytest.fixture(scope="module")
def pair(ran):
    return ran[1]


@pytest.fixture(scope="module")
def text(folder):
    return write_report(folder).read_text(encoding="utf-8")


def cells(table, head):
    return table.frame[head].tolist()


def test_running_has_derailment_quotients_under_one_head(text, pair):
    (running,) = tables.running(pair[0])
    width = running.frame.shape[1]
    assert list(running.frame.columns[-2:]) == ["Right", "Left"]
    heads = [running.band(column) for column in range(width)]
    assert heads == [""] * (width - 2) + ["Y/Q by wheel", ""]
    assert "Steering moment [kN\N{NO-BREAK SPACE}m]" in text


def test_report_has_all_tables_and_figures_of_the_laws(text):
    for role in ("rig", "field"):
        for name in ("wear-laws", "fatigue-laws", "life", "fatigue-index"):
            assert text.count(f'id="table-{name}-{role}"') == 1, (name, role)
    for group in ("comparison", "fatigue"):
        assert text.count(f'id="table-{group}-factors-translation"') == 1
    for figure in ("wear_laws", "shakedown", "fatigue_damage", "balance"):
        assert text.count(f'id="figure-{figure}"') == 1
    assert '<a href="#fatigue">' in text


@pytest.mark.slow
def test_whole_figures_of_the_laws_are_drawn(folder, drawing, text):
    with drawing():
        drawn = write_report(folder).read_text(encoding="utf-8")
    assert drawn.count("<figure ") == text.count("<figure ")
    assert len(drawn) > 5 * len(text)


def test_certainty_of_every_constant_stands_in_one_table_of_the_appendix(pair, text):
    found = sources.coefficients(pair).frame.set_index(["Law", "Coefficient"])
    recalled, uncertain = (words("certainty")[key] for key in ("recalled", "uncertain"))
    assert found.loc[
        ("Archard", "k_seizure"), ["Value", "Range", "Certainty"]
    ].tolist() == [
        "0.035",
        "0.03 to 0.04",
        uncertain,
    ]
    for law in ("surface fatigue index local", "WLRM"):
        symbol, value = (
            ("start", "15 N") if law == "WLRM" else ("shear_yield", "300 MPa")
        )
        assert found.loc[(law, symbol), ["Value", "Certainty"]].tolist() == [
            value,
            recalled,
        ]
    assert not found.index.duplicated().any()  # rig and field have the same laws
    assert found.loc["shakedown map", "Certainty"].notna().all()
    assert text.count('id="table-coefficients"') == 1
    told = re.sub(r"<pre>.*?</pre>", "", text, flags=re.DOTALL)
    assert not re.search("recalled|memory", told)
    assert re.search(r"seizure \d+\.\d%", text)  # the share of wear above 0.8 H


def test_report_marks_laws_of_the_users_own_with_their_certainty(
    pair, tmp_path, scene_text, without_figures
):
    own = (
        '[wear]\nlaw = "table"\n[wear.table]\nsource = "twin disc"\n'
        'certainty = "measured, 10 %"\n'
        'interpolation = "linear"\nbeyond = "hold"\nT_gamma_A_N_mm2 = [0, 10]\n'
        "mass_rate_ug_m_mm2 = [0, 55]\n"
        '[fatigue]\nlaws = ["wlrm"]\n[fatigue.damage_function]\nsource = "house"\n'
        'certainty = "a guess"\n'
        "start_N = 20\npeak_N = 80\nend_N = 200\npeak_damage = 5e-6\n"
    )
    (tmp_path / "rig.toml").write_text(scene_text(BLOCK, more=own))
    header = WheelsetEvolution(build(load_scene(tmp_path / "rig.toml"))).header
    numbers = sources.coefficients([pair[0].assign_attrs(header.attributes)])
    assert (
        cells(numbers, "Certainty")[0]
        == "wear.table: given by the user, who says: measured, 10 %"
    )
    assert header.static["fatigue_warnings"] == (
        "damage_function: given by the user, who says: a guess",
    )
    assert "given by the user" in render([pair[0].assign_attrs(header.attributes)])


def test_report_states_what_the_numbers_of_every_law_hold_for(pair, text):
    """Not of the active law alone: rail steel in the life of a wheel, jumps, floors,
    our own choices.
    """
    for message in (
        "rail steels R220 and R260",
        "In the net form the damage has no floor",
        "The damage of a passage is our own choice",
        "The map prints ranges of k; we take their middle",  # archard, comparison law
        "Twin discs in line contact",  # usfd, active
    ):
        assert message in text
    table = sources.laws(pair)
    values = table.frame.to_numpy()
    names = ("USFD", "Archard", "none", "WLRM", "surface fatigue index local")
    assert values[:, 0].tolist() == [f"{name} (rig, field)" for name in names]
    assert values[1, 3].startswith("wheel and rail steels, dry")
    assert values[2, 2:].tolist() == [None] * 4
    life = tables_damage.life(pair[0])
    assert (
        "numbers of rail steels R220 and R260 (Burstow 2004), not of wheel steel"
        in life.caption
    )
    assert text.count("not of wheel steel") == 3  # page one, rig and field
    older = pair[0].copy()
    older.attrs = {
        k: v
        for k, v in older.attrs.items()
        if not k.startswith(("fatigue_", "comparison_"))
    }
    assert sources.laws([older]).frame.iloc[1, 3:].tolist() == [None] * 3
    assert "wheel steel" not in tables_damage.life(older).caption


def test_every_shipped_set_reaches_the_header_of_a_campaign(tmp_path, scene_text):
    """One line for each law: materials, validity and departures, the jump of brr among
    them.
    """
    more = (
        '[wear]\nalso_evaluate = ["brr", "none", "energy"]\n[fatigue]\n'
        'laws = ["stress_index", "wlrm"]\n'
        'coefficients = ["burstow_2004_20n"]\n'
    )
    (tmp_path / "rig.toml").write_text(scene_text(BLOCK, more=more))
    attrs = WheelsetEvolution(
        build(load_scene(tmp_path / "rig.toml"))
    ).header.attributes
    departures = attrs["comparison_departures"].split("\n")
    assert "at 200 N the loss jumps from 25 to 84" in departures[0]
    assert departures[1:] == ["", ""]
    assert "speed" in attrs["comparison_validity"].split("\n")[2]
    assert attrs["fatigue_materials"].split("\n") == [
        "rail and wheel steels",
        "rail steels R220 and R260",
    ]
    assert "zero beyond 175 N" in attrs["fatigue_departures"].split("\n")[1]
    assert "R8T" in attrs["wear_coefficients_materials"]
    assert "seizure_cap" not in {
        key for key, value in attrs.items() if value != ""
    }  # usfd has no seizure
    assert not any(
        "crack_angle" in str(value) for value in attrs.values()
    )  # it acted nowhere


def test_assumptions_of_the_balance_are_stated_with_their_effect(pair):
    table = tables_damage.life(pair[0])
    assert "Assumed: the width over which damage is counted" in table.caption
    assert "a WLRM crack is 2.00 mm deep and 3.00 mm may wear" in table.caption
    assert "at the rates of the last state" in table.caption
    laws = tables_damage.fatigue_laws(pair[0])
    assert "assumed width of 10 mm" in laws.caption
    head = "Largest rate at the end, before removal by wear [1/1000 km]"
    assert head in laws.frame.columns
    plate = plates.plate(plates.balance, [pair[0]])
    assert "last step" not in plate.caption
    assert "assumptions" in plate.caption


def test_shakedown_map_states_its_yield_stress(pair):
    caption = plates.plate(plates.shakedown, pair).caption
    assert caption.endswith("Yield stress in cyclic shear: 300 MPa.")
    unlike = pair[1].copy(deep=True)
    unlike["fatigue_shear_yield"] = unlike["fatigue_shear_yield"] / 300.0 * 250.0
    caption = plates.plate(plates.shakedown, [pair[0], unlike]).caption
    assert caption.endswith("shear: 300 MPa (rig), 250 MPa (field).")
    alone = pair[0].isel(fatigue=[0])
    assert list(alone["fatigue_name"].values) == ["wlrm"]
    caption = plates.plate(plates.shakedown, [alone]).caption
    assert caption.endswith("shear: 300 MPa.")  # of a published set


def test_first_crack_of_page_one_is_that_of_the_table(pair, text):
    """Of the law that counts cycles, the wheel that comes first."""
    found = crack_distances(pair[1])
    assert list(found) == ["wlrm"]
    texts = cells(tables_damage.life(pair[1]), "First crack after [km]")
    assert [1e-3 * at for at in found["wlrm"]] == pytest.approx(
        [np.inf if one == "never" else one for one in texts], rel=1e-12
    )
    numbers = [
        one for one in answer.numbers(pair, translate(*pair)) if "crack" in one.meaning
    ]
    assert len(numbers) == 1
    firsts = [plain(1e-3 * found["wlrm"].min(), 3)]
    firsts.insert(0, plain(1e-3 * crack_distances(pair[0])["wlrm"].min(), 3))
    assert numbers[0].value == " / ".join(firsts)
    (made,) = answer.limits(pair)
    cracks = made.frame[made.frame["Measure"].str.startswith("Damage by WLRM")]
    met = [text.replace("\N{NARROW NO-BREAK SPACE}", " ") for text in cracks["Met at"]]
    assert sorted(met) == sorted(f"after about {one} km" for one in firsts)
    net = pair[1].copy()
    net["fatigue_crack_depth"] = (
        net["fatigue_crack_depth"] * np.nan
    )  # the law counts the removal itself
    rate = net["fatigue_damage_rate"].values[-1, :, 0].max(axis=1)
    np.testing.assert_allclose(crack_distances(net)["wlrm"], 1.0 / rate, rtol=1e-12)


def test_laws_have_their_titles_side_by_side(pair):
    table = wearsim.side_by_side(*pair, names=("rig", "field"))
    assert "first crack by WLRM" in table["quantity"].tolist()


def test_page_one_states_whose_numbers_count_the_cracks(pair):
    """Distances from numbers of rail steel are no more certain than these."""
    (crack,) = (
        one for one in answer.numbers(pair, translate(*pair)) if "crack" in one.meaning
    )
    assert crack.meaning == "to the first crack by WLRM, rig / field"
    assert crack.sure == (
        "assumed: numbers of rail steels R220 and R260, not of wheel steel"
    )
    own = pair[0].copy()
    who = "damage_function: given by the user, who says: a guess"
    own["fatigue_warnings"] = ("fatigue", [who, ""])
    (crack,) = (one for one in answer.numbers([own]) if "crack" in one.meaning)
    assert crack.sure == "assumed: numbers of the scene, certainty: a guess"


def test_a_crack_within_the_campaign_is_met_where_damage_reaches_one(pair):
    """Damage that grows evenly to 4 reaches 1 at a quarter of the way."""
    grown = pair[0].copy(deep=True)
    run = grown["distance"].values
    grown["fatigue_damage"].values[:, 1, 0, :] = 4.0 * (run / run[-1])[:, None]
    grown["fatigue_damage"].values[:, 0, 0, :] = 0.0
    distance, met = first_cracks(grown)["wlrm"]
    assert met.tolist() == [False, True]
    assert distance[1] == pytest.approx(0.25 * run[-1], rel=1e-12)
    (made,) = answer.cracks_of(grown)
    assert (made.met, made.wheel) == (True, "left")


def test_page_one_with_fatigue_fits_two_pages(pair, without_figures, page_one):
    limited = [
        data.assign_attrs(attributes_of({"max_wear_depth": 2e-3}, True))
        for data in pair
    ]
    page = render(limited)
    assert len(page_one(page).split()) <= 450


def test_report_without_such_laws_has_no_section(run_directory):
    plain = (run_directory / "report.html").read_text(encoding="utf-8")
    assert 'id="fatigue"' not in plain
    assert "figure-shakedown" not in plain
    assert 'id="table-wear-laws-rig"' not in plain


def test_table_of_wear_laws_is_the_dataset(pair):
    table = tables_damage.wear_laws(pair[0])[0]
    values = table.frame.to_numpy()
    assert values[:, 0].tolist() == ["USFD, active", "Archard", "none"]
    area = pair[0]["comparison_worn_area"].values[-1]
    assert values[1, 1] == 1e6 * area[0, :4].sum()
    assert values[1, 3] == pytest.approx(
        area[:, :4].sum() / pair[0]["worn_area"].values[-1].sum(), 1e-12
    )
    assert (
        cells(table, "Deepest, right [mm]")[0]
        == 1e3 * pair[0]["wear_depth"].values[-1, 0].max()
    )
    assert (
        cells(table, "Deepest, right [mm]")[1]
        == 1e3 * pair[0]["comparison_wear_depth"].values[-1, 0, 0].max()
    )
    assert values[2, -1] == "no wear"
    shares = [float(part) for part in re.findall(r"([\d.]+)%", values[1, -1])]
    assert sum(shares) == pytest.approx(100.0, abs=0.2)  # each rounded to 0.1


def test_life_is_ended_by_what_comes_first(pair):
    table = tables_damage.life(pair[0])
    rate = pair[0]["fatigue_damage_rate"].values[-1, 0, 0]
    wear = pair[0]["wear_depth_rate"].values[-1, 0]
    crack = 1e-3 / np.max(rate - wear / 2e-3)  # [km]
    worn = 1e-3 * 3e-3 / wear.max()
    assert cells(table, "First crack after [km]")[0] == pytest.approx(crack, rel=1e-12)
    assert cells(table, "Wear limit after [km]")[0] == pytest.approx(worn, rel=1e-12)
    assert cells(table, "Life ends by")[0] == ("cracks" if crack < worn else "wear")


def test_largest_index_is_stated_with_its_place_and_operating_point(pair, text):
    """From the stored resultants: wear number and the highest pressure of the patches;
    margin below zero.
    """
    data = pair[1]
    (table,) = tables_damage.fatigue_index(data)
    assert table.name == "fatigue-index"
    side, end = data["side"].values[-1], data.isel(step=-1)
    number = np.where(np.isfinite(end["wheel_y"]), end["wear_number_without_spin"], 0.0)
    at = np.unravel_index(number.argmax(), number.shape)
    first, local, below = (table.frame.iloc[k] for k in range(3))
    assert first.iloc[0] == "WLRM: wear number the fatigue law judges by [N]"
    assert first["Damage above"] == 15.0
    assert first["Wheel"] == ("right", "left")[int(side[at])]
    assert first["End"] == number.max()
    assert first["Operating point"] == str(data["operating_point_name"].values[at[0]])
    half = (
        500.0 * end["width"].values[at]
    )  # [mm]; the patch's place is its pressure-weighted centre
    assert abs(first["At y [mm]"] - 1e3 * end["wheel_y"].values[at]) < half
    here = side == ("right", "left").index(local["Wheel"])
    pressure = np.nanmax(np.where(here, end["max_pressure"].values, np.nan))
    assert local.iloc[0] == "surface fatigue index local: fatigue index of the surface"
    # not above mu - k/p0 in the cell of the highest pressure; cells that carry the load
    # reach 2 % above p0
    friction = data["friction"].values.max()
    assert local["End"] <= friction - 300e6 / (1.02 * pressure)
    assert below["End"] >= 1e-6 * pressure / 6.0


def test_index_of_a_patch_explains_its_damage(pair):
    """Damage where the index is above its limit, by the functions of the laws; other
    quantities missing.
    """
    data = pair[1]
    damage = data["fatigue_damage_passage"].values
    local = data["fatigue_index"].values[..., 1]
    here = np.isfinite(damage[..., 0])
    np.testing.assert_array_equal(np.isfinite(local), here)
    np.testing.assert_array_equal(np.maximum(local[here], 0.0), damage[..., 1][here])
    by_wear = data["fatigue_index_force"].values[..., 0][here]
    expected = 10e-6 * np.clip((by_wear - 15.0) / 50.0, 0.0, 1.0)
    np.testing.assert_allclose(damage[..., 0][here], expected, rtol=1e-12)
    assert np.isnan(data["fatigue_index"].values[..., 0]).all()
    assert np.isnan(data["fatigue_index_stress"].values).all()
    off = np.abs(data["fatigue_index_y"].values - data["wheel_y"].values[..., None])
    assert np.nanmax(off) < 20e-3
    assert (off[np.isfinite(off)] <= np.repeat(data["width"].values[here], 2)).all()


def test_agreement_is_weighted_with_the_collective(pair):
    data = pair[1]
    actual = cycles(data)
    damage = data["fatigue_damage_passage"].values[-1]
    here = np.isfinite(damage[..., 0])
    weight = np.broadcast_to(data["weight"].values[:, None], here.shape)[here]
    expected = agreement({"a": damage[here][:, 0], "b": damage[here][:, 1]}, weight)
    np.testing.assert_array_equal(actual.overlap, expected.overlap)
    assert 0.0 < actual.overlap[0, 1] < 1.0
    laws = ("wlrm", "surface_fatigue_index_local", actual.overlap[0, 1])
    assert tables_damage.agreement(data) == [laws]
    assert tables_damage.agreement(data.isel(fatigue=[0])) == []


def test_shakedown_map_has_every_patch(pair):
    """Places from the stored resultants; as many marks as patches, new and worn."""
    friction, ratio = campaign.shakedown_place(pair[0], -1)
    count = int(np.isfinite(pair[0]["max_pressure"].values[[0, -1]]).sum())
    assert np.isfinite(friction).sum() == np.isfinite(ratio).sum()
    marks = [
        line
        for line in campaign.plot_shakedown(pair[0]).lines
        if line.get_marker() in ("o", "^")
    ]
    assert sum(len(line.get_xdata()) for line in marks) == count
    known = ratio[np.isfinite(ratio)]
    np.testing.assert_allclose(
        known.max(), np.nanmax(pair[0]["max_pressure"].values[-1]) / 300e6, rtol=1e-12
    )


def test_figures_are_made_for_one_campaign_too(pair):
    one = Campaigns([pair[1]])
    drawn = {
        key: [b.name for b in content(one) if isinstance(b, plates.Plate)]
        for key, _, content in SECTIONS
    }
    assert drawn["wear"][-1] == "wear_laws"
    assert drawn["fatigue"] == ["shakedown", "fatigue_damage", "balance"]
    assert 'id="fatigue"' in render([pair[1]])


def test_factors_of_damage_are_those_of_both_campaigns(pair):
    factors = translate(*pair)
    area = [data["comparison_worn_area"].values[-1].sum() for data in pair]
    for name in ("comparison_worn_area", "fatigue_damage", "fatigue_damage_rate"):
        value = factors[name].values
        ratio = factors[f"{name}_factor"].values
        defined = factors[f"{name}_factor_status"].values == 0
        assert defined[:, -1, 0].all()
        np.testing.assert_allclose(
            ratio[defined],
            (value[:, :, 0] / np.where(defined, value[:, :, 1], 1.0))[defined],
        )
    assert factors["comparison_worn_area"].values[0, -1, 0, 0, 2] == pytest.approx(
        area[0], rel=1e-9
    )
    assert (
        factors["comparison_worn_area_factor_status"].values[:, :, 1] != 0
    ).all()  # the law "none"


def test_laws_with_other_settings_are_not_compared(pair):
    other = pair[1].copy(deep=True)
    other["fatigue_crack_width"][0] = 5e-3
    factors = translate(pair[0], other)
    assert list(factors["fatigue_name"].values) == ["surface_fatigue_index_local"]
    assert "fatigue law wlrm: its settings differ" in factors.attrs["warnings"]


def test_inspect_lists_the_laws(folder):
    actual = inspect(folder / "rig.nc")
    assert list(actual["damage"]["comparison"]) == ["archard", "none"]
    message = summary_text(actual)
    archard, wlrm, index_of_surface = (
        re.search(rf"^{law}\n((?:  .*\n)+)", message, re.MULTILINE)[1]
        for law in ("Archard", "WLRM", "surface fatigue index local")
    )
    assert re.search(r"  largest wear depth \[mm\] +0\.0\d+", archard)
    index_line = r"  largest fatigue index of the surface +-?\d"
    assert re.search(index_line, index_of_surface)
    place = r"  lateral position of the fatigue index on the wheel profile \[mm\] +-?\d"
    assert re.search(place, wlrm)
    assert "operating point of the index: curve (right), curve (left)" in wlrm
    assert max(map(len, message.splitlines())) <= 100
    assert re.search(r"Life of WLRM, right wheel, ended by: (cracks|wear)", message)


@pytest.mark.cf
def test_compliance_checker_finds_nothing_in_the_factors(folder, assert_cf):
    assert_cf(folder / "translation.nc")


def test_a_comparison_has_less_than_2500_words_before_its_appendix(text):
    """Without figures; scenes, coefficients and fingerprints are in the last fold."""
    main = text[text.index("<main>") :]
    body, _, appendix = main.partition('<details id="appendix">')
    said = re.sub(r"<svg.*?</svg>|<[^>]*>", " ", body, flags=re.DOTALL)
    assert len(said.split()) < 2500
    assert body.count("<details") == 0
    for part in ("SHA-256", "[scene]"):
        assert part in appendix
        assert part not in body
