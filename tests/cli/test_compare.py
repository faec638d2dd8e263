"""Two results of one kind side by side."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest

import wearsim
from wearsim import cli
from wearsim.campaign import run
from wearsim.campaign.directory import PAIR
from wearsim.cli.compare import table_lines
from wearsim.errors import ResultError, SceneError
from wearsim.report.html import write_report
from wearsim.report.pair import side_by_side as page_table
from wearsim.results import load_results
from wearsim.studies import pair as study
from wearsim.translation.bands import SCRAMBLES
from wearsim.translation.side_by_side import not_reprofiled, with_bands

RULES = """\
distance_km = 6
max_step_km = 1
point_spacing_mm = 0.5
error_tolerance_um = 5
first_step_depth_um = 10
[campaign.limits]
depth_mm = 0.002
diameter_mm = 919
[campaign.reprofiling]
at_limits = ["depth_mm"]
cut_mm = {cut}
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory, scene_text):
    """Run directories of one rig with two rules, that differ in the allowance."""
    folder = tmp_path_factory.mktemp("rules")
    block = {"shift_mm": 4, "friction": 0.4, "distance_km": 0.5}
    for name, cut in (("thin", 0.1), ("thick", 0.3)):
        scene = folder / f"{name}.toml"
        scene.write_text(scene_text(block, campaign=RULES.format(cut=cut)))
        wearsim.run(scene, folder / name)
    return folder


def test_two_rules_of_maintenance_differ_in_the_loss_they_state(ran):
    """0.2 mm of radius more in each cut; wear up to the first one is the same."""
    files = [ran / name / "rig.nc" for name in ("thin", "thick")]
    table = wearsim.side_by_side(*files, names=("thin", "thick"))
    rows = table.set_index("quantity")
    assert rows.loc[
        "loss of diameter each time as allowance", "thick"
    ] == pytest.approx(0.6, rel=1e-9)
    assert rows.loc[
        "loss of diameter each time as allowance", "ratio"
    ] == pytest.approx(1 / 3, rel=1e-9)
    loss = rows.loc["loss of diameter each time"]
    assert loss["thick"] - loss["thin"] == pytest.approx(0.4, abs=2e-3)
    assert rows.loc["life", "thin"] > 2.0 * rows.loc["life", "thick"]
    assert rows.loc["life ends by", "thin"] == "wheel diameter"
    assert rows.loc["end of life", "thin"] in ("met", "extrapolated")
    assert rows.loc["reprofilings until the end of life", "thin"] > 0
    zones = [name for name in rows.index if name.startswith("share of the wear")]
    assert rows.loc[zones, "thin"].sum() == pytest.approx(100.0, rel=1e-9)
    assert rows.loc["assumed environment factor", "thick"] == "1"


def test_command_names_both_by_their_folders_and_writes_the_table(ran, capsys):
    table = ran / "rules.csv"
    words = ["compare", str(ran / "thin"), str(ran / "thick"), "--csv", str(table)]
    assert cli.main(words) == 0
    head, *lines = capsys.readouterr().out.rstrip().split("\n")
    assert head.split() == ["thin", "thick", "ratio"]
    assert max(map(len, lines)) <= 100
    assert any(
        line.startswith("loss of diameter each time as allowance [mm]")
        for line in lines
    )
    assert pd.read_csv(table)["quantity"].size == len(lines)
    words = ["compare", *words[1:3], "--json", "--names", "one", "two"]
    assert cli.main(words) == 0
    first = json.loads(capsys.readouterr().out)[0]
    assert first["quantity"] == "life"
    assert first["one"] > first["two"]


@pytest.fixture(scope="module")
def pair(ran):
    path = ran / "pair.toml"
    files = '["thin.toml", "thick.toml"]'
    path.write_text(f'[scene]\nkind = "compare"\n[compare]\nscenes = {files}\n')
    return path


def test_a_scene_of_two_of_one_kind_runs_both_under_their_names(ran, pair, capsys):
    """Each has a run directory; what is computed is what each computes alone."""
    out = ran / "both"
    words = ["run", str(pair), "--out", str(out)]
    assert cli.main([*words, "--set", "thick.campaign.distance_km=5"]) == 0
    printed = capsys.readouterr()
    assert "thin: finished, 6 km" in printed.err
    assert "thick: finished, 5 km" in printed.err
    assert printed.out.split()[:3] == ["thin", "thick", "ratio"]
    assert cli.main(words) == 0  # the longer distance goes on
    assert "thin: finished before" in capsys.readouterr().err
    table = pd.read_csv(out / "comparison.csv").set_index("quantity")
    file = ran / "thin" / "rig.nc"
    alone = wearsim.side_by_side(file, file, names=("a", "b"))
    life = alone.set_index("quantity").loc["life", "a"]
    assert float(table.loc["life", "thin"]) == pytest.approx(life, rel=1e-12)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<h1>thin against thick</h1>" in page
    assert "How do wear and service life of thin and thick compare?" in page
    assert re.search("thick, (right|left)", page)  # of its limits
    assert "Thick" not in page
    assert page.count("<tr><th colspan") == 0
    for part in ("side-by-side", "verdict-thin", "verdict-thick", "settings"):
        assert f'id="table-{part}"' in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    summary = page[: page.index('<nav aria-label="Contents">')]
    assert "loss of diameter each time: thin / thick; ratio" in summary
    assert "needs bands" in summary
    assert cli.main(["report", str(out)]) == 0
    assert (out / "report.html").read_text(encoding="utf-8") == page
    for command in ("status", "resume", "inspect"):
        assert cli.main([command, str(out)]) == 2
        assert "holds two campaigns, each in a run directory" in capsys.readouterr().err


def test_a_report_of_two_has_the_titles_of_the_scenes_where_they_differ(ran):
    """Else those of their files, which tables and figures have, too."""
    out = ran / "titled"
    for name in ("thin", "thick"):
        shutil.copytree(ran / name, out / name)
    (out / PAIR).write_text('{"campaigns": ["thin", "thick"]}')
    paths = {name: out / name / "rig.nc" for name in ("thin", "thick")}

    def page(**titles):
        results = {
            path: load_results(path).assign_attrs(title=titles[name])
            for name, path in paths.items()
        }
        return write_report(out, results).read_text(encoding="utf-8")

    titled = page(thin="iPad rig, 0.1 mm", thick="iPad rig, 0.3 mm")
    assert "<h1>iPad rig, 0.1 mm against iPad rig, 0.3 mm</h1>" in titled
    assert (
        "How do wear and service life of iPad rig, 0.1 mm (thin) and "
        "iPad rig, 0.3 mm (thick) compare?"
    ) in titled
    alike = page(thin="iPad rig", thick="iPad rig")
    assert "<h1>thin against thick</h1>" in alike
    assert "How do wear and service life of thin and thick compare?" in alike


def test_warnings_on_results_have_the_names_of_the_pair(ran, pair, capsys, undrawn):
    words = ["run", str(pair), "--out", str(ran / "warned")]
    for key, value in (("friction", 0.1), ("environment", 0.5)):
        words += ["--set", f"thick.operation.block.1.{key}={value}"]
    assert cli.main([*words, "--set", "campaign.distance_km=0.5"]) == 0
    lines = capsys.readouterr().err.split("\n")
    (warning,) = (line for line in lines if "lubrication may be counted" in line)
    assert warning.startswith("warning: thick: ")


def test_kinds_of_scenes_decide_what_they_are(pair, tmp_path):
    scene = wearsim.load_scene(pair)
    assert list(scene.pair) == ["thin", "thick"]
    assert [part.scene.kind for part in scene.parts] == ["rig", "rig"]
    files = '["field_given.toml", "rig_given.toml"]'
    mixed = tmp_path / "mixed.toml"
    mixed.write_text(f'[scene]\nkind = "compare"\n[compare]\nscenes = {files}\n')
    both = wearsim.load_scene(mixed)
    assert (both.rig.scene.kind, both.field.scene.kind) == ("rig", "field")


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ('scenes = ["thin.toml"]', "must be two files"),
        ('scenes = ["thin.toml", "thick.toml"]\nrig = "thin.toml"', "exclude each"),
        ('rig = "thin.toml"', "needs field"),
        ('scenes = ["thin.toml", "thin.toml"]', 'both files are called "thin"'),
        ('scenes = ["thin.toml", "ratio.toml"]', '"ratio" is the name of a column'),
        ('scenes = ["thin.toml", "nowhere.toml"]', '"nowhere.toml" does not exist'),
        ('scenes = ["thin.toml", "sweep_rig.toml"]', "is a sweep scene"),
        ('scenes = ["thin.toml", "thick.toml"]\ncauses = true', "rig against field"),
        (
            'scenes = ["thin.toml", "thick.toml"]\n[uncertainty]\ndraws = 16',
            "is not drawn",
        ),
    ],
)
def test_faults_of_compared_scenes_name_the_key(ran, lines, text):
    path = ran / "faulty.toml"
    path.write_text(f'[scene]\nkind = "compare"\n[compare]\n{lines}\n')
    with pytest.raises(SceneError) as error:
        wearsim.load_scene(path)
    assert text in str(error.value)
    assert "faulty.toml:" in str(error.value)


def test_two_of_one_kind_are_no_single_campaign(pair, ran, capsys):
    with pytest.raises(SceneError, match="run them with `wearsim run`"):
        wearsim.run(pair, ran / "no")
    assert cli.main(["run", str(pair), "--out", str(ran / "no"), "--bands"]) == 2
    assert "bands need uncertain inputs" in capsys.readouterr().err
    assert not (ran / "no").exists()
    assert cli.main(["run", str(pair), "--out", str(ran / "thin")]) == 2
    assert "is the run directory of one campaign" in capsys.readouterr().err


def test_each_scene_is_prepared_once(pair, tmp_path, monkeypatch):
    prepared = []

    def prepare(part):
        prepared.append(part.scene.kind)
        return solve(part)

    solve = run.prepare
    monkeypatch.setattr(study, "prepare", prepare)
    monkeypatch.setattr(run, "prepare", prepare)
    words = ["run", str(pair), "--out", str(tmp_path / "out")]
    assert cli.main([*words, "--set", "campaign.distance_km=0.5"]) == 0
    assert prepared == ["rig", "rig"]


def test_a_ratio_has_a_band_where_both_have_the_same_draws(ran):
    files = [ran / name / "rig.nc" for name in ("thin", "thick")]
    table = wearsim.side_by_side(*files, names=("thin", "thick"))
    draws = [tuple(map(load_results, files))] * SCRAMBLES
    for paired in (True, False):
        made = with_bands(table, draws, nominal=table, paired=paired)
        rows = made.set_index("quantity")
        loss = rows.loc["loss of diameter each time"]
        for end in ("5%", "95%"):
            assert loss[f"thin {end}"] == pytest.approx(loss["thin"], rel=1e-12)
            expected = loss["ratio"] if paired else np.nan
            assert loss[f"ratio {end}"] == pytest.approx(expected, nan_ok=True)
        assert np.isnan(rows.loc["life ends by", "thin 5%"])


def test_bands_of_other_contact_models_count_by_their_ratio_to_the_nominal(ran):
    files = [ran / name / "rig.nc" for name in ("thin", "thick")]
    table = wearsim.side_by_side(*files, names=("thin", "thick"))
    draws = [tuple(map(load_results, files))] * SCRAMBLES
    own = table.copy()
    what = "loss of diameter each time"
    loss = own["quantity"] == what
    own.loc[loss, "thin"] = 1.1 * own.loc[loss, "thin"].astype(float)
    rows = with_bands(own, draws, nominal=table, paired=True).set_index("quantity")
    assert rows.loc[what, "thin 5%"] == pytest.approx(rows.loc[what, "thin"], rel=1e-9)


def test_draws_that_are_not_reprofiled_are_counted_beside_the_band(ran):
    """Their distance between reprofilings lies beyond any; it had no band before."""
    files = [ran / name / "rig.nc" for name in ("thin", "thick")]
    thin, thick = map(load_results, files)
    first = int(np.flatnonzero(np.diff(thin["last_reprofiling"].values))[0])
    unturned = thin.isel(step=slice(0, first + 1))
    table = wearsim.side_by_side(thin, thick, names=("thin", "thick"))
    draws = [(thin, thick)] * (SCRAMBLES - 1) + [(unturned, thick)]
    made = with_bands(table, draws, nominal=table, paired=True)
    row = made.set_index("quantity").loc["mean distance between reprofilings"]
    assert row["thin 5%"] == pytest.approx(row["thin"], rel=1e-12)
    assert row["thin 95%"] == np.inf
    assert row["thin not reprofiled"] == f"1 of {SCRAMBLES}"
    ending = "draws were not reprofiled in the distance run and count as not in sight."
    sentence = f"thin: 1 of {SCRAMBLES} {ending}"
    assert not_reprofiled(made) == [sentence]
    lines = table_lines(made)
    assert sentence in lines
    assert any("to not in sight" in line for line in lines)
    none = [(unturned, thick)] * SCRAMBLES
    (stated,) = not_reprofiled(with_bands(table, none, nominal=table, paired=True))
    count = f"{SCRAMBLES} of {SCRAMBLES}"
    assert stated == f"thin: {count} {ending}"
    every = with_bands(table, [(thin, thick)] * 8, nominal=table, paired=True)
    assert not not_reprofiled(every)


def test_events_beyond_the_end_of_a_draw_lie_beyond_any_distance(ran, monkeypatch):
    """A life or crack that is not in sight, and a limit that is not met; not so in a
    draw that ended before the others met the limit or were reprofiled.
    """
    thin, thick = (load_results(ran / name / "rig.nc") for name in ("thin", "thick"))
    first = int(np.flatnonzero(np.diff(thin["last_reprofiling"].values))[0])
    monkeypatch.setattr(
        "wearsim.translation.side_by_side.crack_distances",
        lambda data: {"wlrm": np.array([1e4 if data.sizes["step"] > 5 else np.inf])},
    )

    def low_and_high(quantity, data, other):
        table = wearsim.side_by_side(data, thick, names=("thin", "thick"))
        draws = [(data, thick)] * (SCRAMBLES - 1) + [(other, thick)]
        made = with_bands(table, draws, nominal=table, paired=True)
        row = made.set_index("quantity").loc[quantity]
        return [row[f"thin {end}"] / row["thin"] for end in ("5%", "95%")]

    whole = thin.isel(step=slice(0, first + 1))
    for quantity in ("life", "first crack by WLRM"):
        assert low_and_high(quantity, thin, whole) == pytest.approx([1.0, np.inf])
    half = thin.isel(step=slice(0, first // 2 + 1))
    interval = low_and_high("mean distance between reprofilings", thin, half)
    assert np.isnan(interval).all()

    # the same without reprofiling
    monkeypatch.setattr(
        "wearsim.translation.side_by_side.service_life", lambda data: None
    )
    assert "limit_max_wear_depth" in thin.attrs
    unmet = thin.assign_attrs(limit_max_wear_depth=1.0)
    what = "limit of max wear depth"
    assert low_and_high(what, thin, unmet) == pytest.approx([1.0, np.inf])
    short = unmet.isel(step=slice(0, first // 2 + 1))
    assert np.isnan(low_and_high(what, thin, short)).all()


UNCERTAIN = """
[uncertainty]
draws = 16
[[uncertainty.input]]
key = "operation.environment"
acts = "factor"
distribution = "lognormal"
median = 1.0
within = 1.5
"""


@pytest.mark.slow
def test_what_both_share_cancels_in_the_band_of_the_ratio(ran, tmp_path, capsys):
    """Intervals are in inverse proportion to the environment factor, their ratio is
    not; both campaigns have the same draws.
    """
    for name in ("thin", "thick"):
        text = (ran / f"{name}.toml").read_text() + UNCERTAIN
        (tmp_path / f"{name}.toml").write_text(text)
    path = tmp_path / "pair.toml"
    path.write_text(
        '[scene]\nkind = "compare"\n[compare]\nscenes = ["thin.toml", "thick.toml"]\n'
    )
    out = tmp_path / "out"
    words = ["run", str(path), "--out", str(out), "--bands", "--jobs", "1"]
    assert cli.main(words) == 0
    printed = capsys.readouterr()
    assert "thick draw 16: finished (16 of 16)" in printed.err
    assert max(map(len, printed.out.split("\n")[:-2])) <= 100
    row = pd.read_csv(out / "comparison.csv").set_index("quantity")
    interval = row.loc["mean distance between reprofilings"]
    assert interval["thin 95%"] > 1.8 * interval["thin 5%"]
    assert interval["ratio 95%"] < 1.05 * interval["ratio 5%"]
    summary = (out / "report.html").read_text().partition("<nav")[0]
    assert "mean distance between reprofilings: thin / thick; ratio" in summary
    assert "90 %: " in summary


def test_equal_names_are_a_fault(ran):
    file = ran / "thin" / "rig.nc"
    with pytest.raises(ResultError, match="must be two different names"):
        wearsim.side_by_side(file, file, names=("a", "a"))
    with pytest.raises(ResultError, match='"ratio" is the name of a column'):
        wearsim.side_by_side(file, file, names=("ratio", "later"))


def test_a_folder_with_the_name_of_a_column_is_not_the_head_of_one(ran, capsys):
    files = [ran / name / "rig.nc" for name in ("ratio", "unit")]
    for file in files:
        file.parent.mkdir()
        file.symlink_to(ran / "thin" / "rig.nc")
    assert cli.main(["compare", *map(str, files)]) == 0
    head = capsys.readouterr().out.split("\n")[0]
    assert head.split() == ["first", "second", "ratio"]


def test_all_large_numbers_have_one_separator_of_thousands():
    """Pages have four digits of estimates; thousands of a row are set apart in all of
    its values, or in none.
    """
    values = {
        "fleet": [916196.4, 59721.0, 9999.0, 4330.4],
        "later": [1054962.0, -12345.6, 1.5, 17286.0],
    }
    table = pd.DataFrame(
        {"quantity": list("abcd"), "unit": "km", **values, "ratio": 1.0}
    )
    lines = table_lines(table)
    assert "916 196" in lines[1]
    assert "1 054 962" in lines[1]
    assert "59 721" in lines[2]
    assert "-12 346" in lines[2]
    assert "9999" in lines[3]
    cells = page_table(table).frame["fleet"].tolist()
    assert [cell.replace("\N{NARROW NO-BREAK SPACE}", " ") for cell in cells] == [
        "916 200",
        "59 720",
        "9999",
        "4 330",
    ]


def test_values_of_a_row_have_equally_many_digits_and_names_their_letters():
    values = {"S1002": [0.02, 33453.0], "eps": [0.0266, 33453.0], "ratio": [0.752, 1.0]}
    ends = {f"{name} {end}%": 2 * [0.02] for name in values for end in (5, 95)}
    quantities = {"quantity": ["worn mass", "life"], "unit": ["kg", "km"]}
    table = pd.DataFrame({**quantities, **values, **ends})
    mass = page_table(table).frame.iloc[0]
    assert mass.tolist()[1::2] == ["0.0200", "0.0266", "0.752"]
    assert mass["S1002, 90 %"] == "0.0200"
    assert "eps" in mass.index
    _, line, *_ = table_lines(table)
    assert line.split()[-3:] == ["0.02000", "0.02660", "0.752"]


def test_a_campaign_without_reprofiling_has_the_wear_alone(ran, tmp_path, scene_text):
    (tmp_path / "rig.toml").write_text(scene_text({"shift_mm": 4, "distance_km": 0.5}))
    (plain,) = wearsim.run(tmp_path / "rig.toml", tmp_path / "out")
    table = wearsim.side_by_side(plain, ran / "thin" / "rig.nc").set_index("quantity")
    assert table.loc["life", "a"] is None
    assert pd.isna(table.loc["life", "ratio"])
    assert table.loc["worn area at 6 km", "ratio"] > 0.0
