import re
import shutil
from contextlib import nullcontext
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from wearsim.campaign.directory import MANIFEST, has_uncertainty
from wearsim.errors import ResultError
from wearsim.report import answer, plates, service_life, sources, tables
from wearsim.report.html import SECTIONS, Campaigns, all_figures, render, write_report
from wearsim.report.shares import wear_shares
from wearsim.report.style import distance_text, plain
from wearsim.report.texts import lines
from wearsim.results import load_results, open_results
from wearsim.results.limits import attributes_of
from wearsim.translation.bands import PER_KM
from wearsim.translation.translate import table, translate


class Page(HTMLParser):
    """Ids, links, and the cells of each table row of a page."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.rows = [], [], {}
        self._row = self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.links += [attrs[k] for k in ("href", "src", "xlink:href") if k in attrs]
        if tag == "tr" and "data-variable" in attrs:
            self._row = self.rows.setdefault(attrs["data-variable"], [])
        if tag == "td" and self._row is not None:
            self._cell = [attrs.get("data-value"), ""]

    def handle_data(self, data):
        if self._cell is not None:
            self._cell[1] += data

    def handle_endtag(self, tag):
        if tag == "td" and self._cell is not None:
            self._row.append(tuple(self._cell))
            self._cell = None
        if tag == "tr":
            self._row = None


@pytest.fixture(scope="module")
def text(run_directory):
    return (run_directory / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def test_every_number_of_the_verdict_is_the_dataset(page, rig, field):
    """Exact values to the last bit; what is shown to its last digit."""
    rows = table(translate(rig, field))
    assert set(page.rows) == set(rows["variable"])
    for variable, cells in page.rows.items():
        entries = [
            rows[(rows["variable"] == variable) & (rows["basis"] == b)].iloc[0]
            for b in rows["basis"].unique()[:2]
        ]
        expected = [
            entry[key] for entry in entries for key in ("rig", "field", "factor")
        ]
        for value, (exact, shown) in zip(expected, cells[:6], strict=True):
            if np.isfinite(value):
                assert float(exact) == value
                digits = shown.replace("\N{MINUS SIGN}", "-").replace(
                    "\N{NARROW NO-BREAK SPACE}", ""
                )
                if digits in ("< 0.0001", "> -0.0001"):
                    assert 0.0 < abs(value) < 1e-4
                else:
                    assert float(digits) == pytest.approx(value, rel=5.1e-3)
            else:
                assert (exact, shown) == (None, "undefined")
        assert cells[6][1]


def test_verdict_says_where_it_is_taken(text):
    """A field campaign that runs on is not compared at its end."""
    assert "Where both campaigns end" not in text
    assert "and the largest worn depth that both campaigns reach" in text


def test_verdict_traces_back_to_the_result_files(page, rig, field):
    """Equal distance is 60 km: row 6 of both campaigns."""
    depth, area = page.rows["max_wear_depth"], page.rows["worn_area"]
    for cell, data in ((0, rig), (1, field)):
        assert float(depth[cell][0]) == pytest.approx(
            1e3 * data["max_wear_depth"].values[6].max(), rel=1e-12
        )
        assert float(area[cell][0]) == pytest.approx(
            1e6 * data["worn_area"].values[6].sum(), rel=1e-12
        )


def test_zero_denominator_is_undefined(page):
    assert page.rows["creepage_y_collective"][2] == (None, "undefined")
    assert page.rows["creepage_y_collective"][6][1] == "field value is zero"
    assert not re.search(
        r">\s*[-+]?(nan|inf)\b",
        "".join(cell for r in page.rows.values() for _, cell in r),
        re.I,
    )


def test_small_changes_of_the_wheel_shape_have_their_own_reason(
    rig, field, without_figures
):
    slow = field.copy(deep=True)
    sd = slow["flange_thickness"].values
    sd[:] = sd[0] + 1e-3 * (sd - sd[0])
    row = Page(render([rig, slow])).rows["flange_thickness_change"]
    assert row[2] == (None, "undefined")
    assert row[6][1].startswith("field value too small to divide by")


STATE = {
    "state": "failed",
    "distance": 9e4,
    "target": 1e5,
    "message": "no contact patch in block 3 at 90 km",
}


@pytest.mark.parametrize("roles", ["rig", "field", "both"])
def test_page_one_holds_the_answer_and_what_it_rests_on(
    rig, field, without_figures, page_one, roles
):
    """With everything on it: a failure, a stopped run, all limits, warnings."""
    limits = {
        "max_wear_depth": 2e-3,
        "hollowing": 2e-3,
        "flange_height": 36e-3,
        "flange_thickness": 22e-3,
    }
    limits |= {"equivalent_conicity": 0.4, "flange_gradient": 6.5e-3}
    each = [data.assign_attrs(attributes_of(limits, True)) for data in (rig, field)]
    each = {"rig": each[:1], "field": each[1:], "both": each}[roles]
    words = page_one(
        render(
            each,
            states={"field": STATE, "rig": {**STATE, "state": "stopped"}},
            date="2026-11-30",
        )
    )
    assert 100 < len(words.split()) <= 450  # two pages with both figures
    for part in ("no contact patch in block 3", "`wearsim resume` continues it"):
        assert part in words
    for part in ("Largest wear depth [mm]", "Equivalent conicity", "Tread hollowing"):
        assert part in words
    assert "not validated against a measured wheel" in words
    assert "The environment factor of the wear is assumed" in words
    assert "rolling contact fatigue (RCF), as no law counts cycles" in words
    assert "Computed on 2026-11-30 with wearsim 0.1.0" in words
    for role in ("Prepared", "Checked", "Approved"):
        assert role in words


def test_page_one_answers_the_question(text, rig, field, page_one):
    words = page_one(text)
    assert words.count("?") == 1
    # 60 km of each: 20 against 8 nm per metre, over 0.2 of environment
    found = translate(rig, field)
    factor = found["max_wear_depth_factor"].values[0, -1, -1]
    assert f"{plain(factor, 3)} times as deep on the rig as in the field" in words
    assert "km in the field for 1 km on the rig" in words
    assert (
        "limits of wheel measures (Sh, " in words[words.index("Not in this report") :]
    )
    assert (
        text.index('id="answer"')
        < text.index(">For engineers<")
        < text.index("<summary>Appendix<")
    )


def test_numbers_without_bands_say_what_they_assume(rig, field):
    """The environment factor is 1 on the rig and 0.2 in the field."""
    for data, assumed in (
        ([rig], "laboratory wear coefficient"),
        ([field], "environment factor 0.2"),
        ([rig, field], "environment factor 1 (rig), 0.2 (field)"),
    ):
        factors = translate(*data) if len(data) == 2 else None
        made = answer.numbers(data, factors)
        assert 2 <= len(made) <= 3
        for number in made:
            assert number.sure == f"no band; assumed: {assumed}"


def test_bands_and_what_decides_stand_on_page_one(rig, field, monkeypatch):
    row = {"quantity": "km", "variable": next(iter(PER_KM)), "where": "up to 1 mm each"}
    row |= {"5%": 2.0, "95%": 8.0, "decided by": "friction (share of variance 0.70)"}
    monkeypatch.setattr(answer, "band_table", lambda _: pd.DataFrame([row]))
    monkeypatch.setattr(answer, "shares_beyond_validity", lambda _: {})
    factors = translate(rig, field)
    first, *_ = answer.numbers([rig, field], factors, xr.Dataset())
    assert first.sure == "90 %: 2.00 to 8.00 km; mainly due to friction"
    beyond = {"above shakedown": 0.3}
    monkeypatch.setattr(answer, "shares_beyond_validity", lambda _: beyond)
    first, *_ = answer.numbers([rig, field], factors, xr.Dataset())
    assert first.sure.startswith("90 %: 2.00 to 8.00 km")
    assert first.sure.endswith(
        "error of the models not included: 30 % of the wear (rig) is above shakedown"
    )
    row |= {"5%": np.nan, "95%": np.nan}
    first, *_ = answer.numbers([rig, field], factors, xr.Dataset())
    assert first.sure.startswith("no band, as a draw of the uncertain inputs ended")
    assert "nan" not in first.sure


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("operation.environment", "environment factor on the wear depth"),
        ("operation.friction, rig", "friction coefficient, rig"),
        (
            "field.operation.class.tangent.load_kN",
            "vertical load of each wheel of class tangent, field",
        ),
        ("operation.block.2.shift_mm", "lateral shift of block 2"),
        ("operation.block.friction", "friction coefficient"),
        ("vehicle.class.2.friction", "friction coefficient of route class 2"),
        ("rig", "rig"),
        ("wear.scale", "factor on the wear depth of the active law"),
        ("wear.values.k1", "coefficient k1 of the wear law"),
        ("friction of the line", "friction of the line"),
        ("load (of cells)", "load (of cells)"),
    ],
)
def test_uncertain_inputs_are_named_in_words(name, words):
    """On page one and in the figure of the sensitivity."""
    row = {"5%": 1, "95%": 2, "decided by": f"{name} (share 0.7)"}
    said = answer._sure(row, "", "km")
    assert f"; mainly due to {words}" in said
    shares = ("input", "estimate"), [[0.7, 0.6, 0.8]], {"kind": "share of variance"}
    variables = {
        "rig_worn_area": ((), 1e-6, {"long_name": "worn area"}),
        "rig_worn_area_sensitivity": shares,
        "input_name": ("input", [name]),
    }
    (ax,) = plates.sensitivity([], xr.Dataset(variables)).axes
    # a user's name is as written, words of a key begin with a capital
    heading = words if words == name else words[0].upper() + words[1:]
    (label,) = ax.get_yticklabels()
    assert label.get_text().replace("\n", " ") == heading


def test_depth_of_page_one_counts_from_the_last_reprofiling(rig, reprofiled):
    """30 of 60 km; a second reprofiling at the end does not begin a new depth."""
    closed = reprofiled.copy(deep=True)
    closed["last_reprofiling"].values[-1] = 6
    for data, expected in (
        (rig, f"deepest wear after {distance_text(60e3)}, "),
        (
            reprofiled,
            f"deepest wear since the last reprofiling, {distance_text(30e3)}, ",
        ),
        (
            closed,
            f"deepest wear between the last two reprofilings, {distance_text(20e3)}, ",
        ),
    ):
        assert answer.numbers([data])[0].meaning.startswith(expected)


def test_page_one_says_what_bands_would_add(rig, reprofiled):
    (line,) = answer.absent([rig])
    assert "bands, as no uncertain inputs are given; " in line
    assert "reprofilings on page one" not in line
    (line,) = answer.absent([reprofiled], uncertain=True)
    assert (
        "life and distance between reprofilings on page one, which need bands" in line
    )


def test_uncertain_inputs_are_those_of_the_stored_scene(rig, tmp_path, page_one):
    """Without --bands: they are given, and not drawn."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / MANIFEST).write_text('{"main": "rig.toml"}')
    for scene, expected in (
        ("[uncertainty]", "bands (run with --bands)"),
        ("[scene]", "bands, as no uncertain inputs are given"),
        ("no scene", "bands, as no uncertain inputs are given"),
    ):
        (folder / "rig.toml").write_text(scene)
        assert has_uncertainty(tmp_path) == (scene == "[uncertainty]")
        words = page_one(render([rig], uncertain=has_uncertainty(tmp_path)))
        assert expected in words


def test_an_extrapolated_life_stands_on_page_one_with_its_bands(rig):
    """The right wheel loses 2.4 mm of 920 in 60 km; 910 mm are met at 250 km."""
    limits = {"wheel_diameter": 0.91, "max_wear_depth": 8e-3}
    limited = rig.assign_attrs(attributes_of(limits, False))
    for drawn, expected in (
        (False, "needs bands"),
        (True, f"about {distance_text(250e3)}"),
    ):
        (made,) = answer.limits([limited], drawn=drawn)
        life = made.frame.iloc[-1].tolist()
        assert life[0] == "Wheel diameter at the running circle [mm]"
        assert life[2:5] == pytest.approx([920.0, 917.6, 910.0])
        assert life[5].endswith(expected)
    assert "wear depth" in answer.numbers([limited])[1].meaning
    bands = xr.Dataset(
        {
            "rig_service_life": ((), 250e3),
            "rig_service_life_band": ("quantile", [101.4e3, 250e3, np.inf]),
        }
    )
    (line,) = service_life.sentences([limited], bands)
    assert line == "Life of the wheels (rig): 250 km (90 %: 101 km to not in sight)."


def test_limits_stand_by_their_distance_at_the_wheel_that_comes_first(rig):
    """20 nm of depth per metre on the right wheel, 18 on the left one, 60 km are
    run.
    """
    expected = {
        1.1e-3: distance_text(55e3),
        1.5e-3: f"after about {distance_text(75e3)}",
        0.1: "not in sight",
    }
    for limit, met in expected.items():
        (made,) = answer.limits(
            [rig.assign_attrs(attributes_of({"max_wear_depth": limit}, False))]
        )
        row = made.frame.iloc[0].tolist()
        assert row[:2] == ["Largest wear depth [mm]", "Rig, right"]
        assert row[2:5] == pytest.approx([0.0, 1.2, 1e3 * limit])
        assert row[5] == met
    limits = {"max_wear_depth": 1.5e-3, "flange_height": 28.5e-3}
    (made,) = answer.limits([rig.assign_attrs(attributes_of(limits, False))])
    distances = [
        one.distance
        for one in answer.limits_of(rig.assign_attrs(attributes_of(limits, False)))
    ]
    first = ("Largest wear depth [mm]", "Flange height [mm]")[int(np.argmin(distances))]
    assert made.frame["Measure"].tolist()[0] == first


def test_wear_is_shared_out_among_the_classes(rig):
    shares = wear_shares(rig)
    assert shares.sum().tolist() == pytest.approx([100.0, 100.0], rel=1e-12)
    wear = shares["wear"].tolist()
    assert wear == sorted(wear, reverse=True)
    fewer = wear_shares(rig, most=2)
    assert fewer.index.tolist() == [shares.index[0], "others"]
    assert fewer.sum().tolist() == pytest.approx([100.0, 100.0], rel=1e-12)


def test_bibliography_and_commands_stand_in_the_appendix(text):
    appendix = text[text.index(">Appendix<") :]
    assert "<li>Lewis and Dwyer-Joyce 2004</li>" in appendix
    assert "wearsim run rig.toml --out out" in appendix
    models = sources.bibliography(
        [xr.Dataset(attrs={"contact_normal": "hertz", "contact_tangential": "fastsim"})]
    )
    assert any(line.endswith("doi:10.1515/crll.1882.92.156") for line in models)
    assert any("doi:10.1080/00423118208968684" in line for line in models)
    assert not any("\n" in line or ".. [" in line for line in models)


def test_both_wheels_are_shown_where_both_are_named(rig, field):
    shown = {
        plate.name: plate
        for plate in all_figures(Campaigns([rig, field], translate(rig, field)))
    }
    titles = [ax.get_title(loc="left") for ax in shown["profiles"].figure.axes]
    assert sum(title.startswith("Right wheel.") for title in titles) == 2
    assert sum(title.startswith("Left wheel.") for title in titles) == 2
    worn = shown["profiles"].figure.axes[2].lines  # left wheel, equal distance
    (at_60_km,) = (line for line in worn if line.get_label() == "rig")
    np.testing.assert_array_equal(
        at_60_km.get_ydata(), 1e3 * rig["wear_depth"].values[6, 1]
    )
    (difference,) = (line for line in worn if line.get_label() == "rig minus field")
    expected = 1e3 * (rig["wear_depth"] - field["wear_depth"]).values[6, 1]
    np.testing.assert_allclose(difference.get_ydata(), expected, atol=1e-9)


def test_regimes_are_drawn_where_there_are_several(rig):
    """A panel of one colour shows nothing."""
    mild = rig.copy(deep=True)
    mild["wear_depth_by_regime"].values[:, :, 1:] = 0.0
    assert plates.wear_by_regime([mild]) is None
    figure = plates.wear_by_regime([rig, mild])
    assert figure is not None
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles == ["Rig, right wheel", "Rig, left wheel"]


def test_settings_name_contact_models_and_coefficients_in_words(rig):
    named = rig.assign_attrs(
        contact_normal="kik_piotrowski",
        contact_tangential="fastsim",
        wear_coefficients="lewis_dwyer_joyce_2004",
    )
    values = tables.settings([named]).frame.set_index("Setting")["Rig"]
    assert values["Normal contact model"] == "Kik and Piotrowski"
    assert values["Tangential contact model"] == "FASTSIM"
    assert values["Wear coefficients"] == "Lewis and Dwyer-Joyce 2004"
    own = named.assign_attrs(
        wear_coefficients="own_steel", contact_normal="unknown_one"
    )
    values = tables.settings([own]).frame.set_index("Setting")["Rig"]
    assert values["Wear coefficients"] == "own_steel"
    assert values["Normal contact model"] == "unknown_one"


def test_result_warnings_and_differing_settings_are_listed(rig, field):
    other = field.assign_attrs(poisson_ratio=0.28)
    other["load_scale"] = other["load_scale"].copy(deep=True)
    other["load_scale"].values[1:3, 0, 0] = 1.2
    warned = lines("warnings", datasets=[rig, other], factors=translate(rig, other))
    assert "Poisson ratio differs: 0.3 on the rig, 0.28 in the field." in warned
    assert any(line.startswith("Field: contact patches merge") for line in warned)
    # 0.72 mm in 90 km
    assert any(
        line.startswith("Field: tread wear of 800 mm per 100 000 km is above")
        for line in warned
    )
    assert not any(line.startswith("Rig: tread wear") for line in warned)


def test_every_figure_and_section_is_there(page, text, rig, field):
    names = {
        plate.name
        for plate in all_figures(Campaigns([rig, field], translate(rig, field)))
    }
    assert {
        "profiles",
        "wear_depth",
        "measures",
        "wheels",
        "main_causes",
        "contact",
        "factors_wear",
    } <= names
    for name in names:
        figure = text[text.index(f'id="figure-{name}"') :]
        assert "<path" in figure[: figure.index("</figure>")]
    # neither campaign has fatigue laws or bands
    assert {key for key, *_ in SECTIONS} - set(page.ids) == {"fatigue", "bands"}
    assert text.count("<figure ") == len(names)


def assert_alone(text):
    page = Page(text)
    outside = [link for link in page.links if not link.startswith(("#", "data:"))]
    assert outside == []
    assert "@import" not in text
    assert "url(" not in re.sub(r"url\(#", "", text)
    assert len(page.ids) == len(set(page.ids))


def test_page_stands_alone(text):
    assert_alone(text)


def test_environment_is_stated_with_every_wear_figure(text):
    for name in (
        "profiles",
        "wear_depth",
        "wear_over_distance",
        "factors_wear",
        "equivalent_distance",
    ):
        caption = text[text.index(f'id="caption-{name}"') :]
        assert (
            "Environment factor: 1 (rig), 0.2 (field)"
            in caption[: caption.index("</figcaption>")]
        )
    assert "The environment factors differ: 1 on the rig, 0.2 in the field." in text


def test_words_of_users_are_escaped(text):
    assert "Synthetic rig &lt;campaign&gt;" in text
    assert "<campaign>" not in text


def test_provenance(text):
    for part in (
        "wearsim run rig.toml --out out",
        "Lewis and Dwyer-Joyce 2004",
        "S1002 0123abcd",
        "numpy 2",
    ):
        assert part in text
    assert "[scene]\nkind = &#34;field&#34;" in text


@pytest.mark.slow
def test_a_drawn_page_stands_alone_and_is_the_same_again(drawn_directory, drawing):
    text = (drawn_directory / "report.html").read_text(encoding="utf-8")
    assert_alone(text)
    with drawing():
        write_report(drawn_directory)
    assert (drawn_directory / "report.html").read_text(encoding="utf-8") == text


def test_results_that_are_loaded_are_not_read_again(
    run_directory, tmp_path, monkeypatch
):
    folder = shutil.copytree(run_directory, tmp_path / "run")
    before = (folder / "report.html").read_text(encoding="utf-8")
    loaded = {
        folder / name: load_results(folder / name) for name in ("rig.nc", "field.nc")
    }
    monkeypatch.setattr(
        "wearsim.report.html.load_results",
        lambda path: pytest.fail(f"{path} is read again"),
    )
    assert write_report(folder, loaded).read_text(encoding="utf-8") == before


@pytest.mark.parametrize("kind", [pytest.param("rig", marks=pytest.mark.slow), "field"])
def test_one_campaign_has_a_report_too(tmp_path, write_campaign, kind):
    write_campaign(tmp_path / f"{kind}.nc", kind, 3, 10e-9)
    text = write_report(tmp_path).read_text(encoding="utf-8")
    assert "figure-wheels" in text
    assert "figure-profiles" not in text  # page one has them
    assert "figure-factors_wear" not in text
    assert 'data-value="0.3' in text  # 30 km at 10 nm/km


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_report_without_any_wear(tmp_path, write_campaign, drawing, drawn):
    write_campaign(tmp_path / "rig.nc", "rig", 2, 1e-9, friction_free=True)
    write_campaign(tmp_path / "field.nc", "field", 2, 1e-9, friction_free=True)
    with drawing() if drawn else nullcontext():  # axes without extent
        text = write_report(tmp_path).read_text(encoding="utf-8")
    assert "a factor of the wear, as one campaign shows none" in text
    assert Page(text).rows["max_wear_depth"][2] == (None, "undefined")


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_report_of_the_first_row_only(tmp_path, write_campaign, drawing, drawn):
    """A campaign stopped before its first step."""
    write_campaign(tmp_path / "rig.nc", "rig", 1, 1e-9)
    with (
        open_results(tmp_path / "rig.nc") as data,
        drawing() if drawn else nullcontext(),
    ):
        text = render([data.isel(step=slice(0, 1)).load()])
    assert f"deepest wear after {distance_text(0e3)}" in text


def test_unfinished_and_regimes_are_warned_of(rig, field):
    unfinished = rig.copy()
    del unfinished.attrs["finished"]
    said = lines("alerts", datasets=[unfinished, field], states={})
    first = "Rig: the campaign is unfinished, these are the first"
    assert said == [f"{first} {distance_text(60e3)}."]
    warned = lines(
        "warnings", datasets=[unfinished, field], factors=translate(unfinished, field)
    )
    assert any("different regimes" in line for line in warned)


def test_warnings_of_the_campaigns_are_repeated(rig: xr.Dataset):
    noted = rig.assign_attrs(warnings="friction 0.9 is high; lower it\nshift is large")
    assert lines("warnings", datasets=[noted], factors=None) == [
        "Rig: friction 0.9 is high; lower it",
        "Rig: shift is large",
    ]


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ("shift is large; friction is high", ["shift is large; friction is high"]),
        (
            ["shift is large", "friction is high"],
            ["shift is large", "friction is high"],
        ),
        (np.array(["shift is large"]), ["shift is large"]),
        ("", []),
    ],
)
def test_a_text_of_warnings_is_one_item_and_a_list_has_its_own(rig, stated, expected):
    """Results of earlier versions have all warnings in one line."""
    noted = rig.assign_attrs(warnings=stated)
    assert lines("warnings", datasets=[noted], factors=None) == [
        f"Rig: {warning}" for warning in expected
    ]


def test_empty_directory_is_one_line(tmp_path):
    with pytest.raises(
        ResultError, match=r"there is no rig\.nc or field\.nc"
    ) as caught:
        write_report(tmp_path)
    assert "\n" not in str(caught.value)


def test_limits_are_a_table_of_their_own(rig, field, without_figures):
    """The field wears 8 nm per metre: 1.1 mm are beyond its 90 km; each campaign has
    limits of its own.
    """
    depth = {"max_wear_depth": 1.1e-3}
    page = render(
        [
            rig.assign_attrs(attributes_of({**depth, "hollowing": 2e-3}, False)),
            field.assign_attrs(attributes_of(depth, False)),
        ]
    )
    table_ = page[page.index('id="table-limits"') :].partition("</table>")[0]
    assert "Largest wear depth of the wheel, at most 1.1 mm" in table_
    # 18 nm per metre on the left wheel of the rig, 8 nm on the field's
    said = table_.replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "right: 55 km; left: not met, after about 61 km" in said
    assert (
        "right: not met, after about 138 km; left: not met, after about 153 km" in said
    )
    assert "not given" in table_
    assert 'id="table-limits"' not in render([rig, field])
