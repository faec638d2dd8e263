"""The same campaign computed otherwise: what is refined, what the table tells, what it costs to ask again."""

import json
import tomllib

import numpy as np
import pytest
import xarray as xr

from wearsim import cli
from wearsim.errors import ContactError, NumericalError
from wearsim.profile.standard import shipped_path
from wearsim.report.style import plain
from wearsim.report.tables_quality import read_convergence
from wearsim.results import open_results
from wearsim.results.checks import percent
from wearsim.results.schema import CONVERGENCE
from wearsim.scene import load_campaign
from wearsim.scene.overrides import Override
from wearsim.studies.converge import converge, other_models, refinements

ROWS = ["step", "grid", "smoothing-half", "smoothing-double", "points", "together"]


@pytest.fixture(scope="module")
def rig_text(scene_text):
    """Scene of a few steps on a rig, coarse."""
    campaign = "distance_km = 4\npoint_spacing_mm = 0.5\nmax_step_km = 2"
    return scene_text({"shift_mm": 3, "distance_km": 2}, campaign=campaign)


def overrides_of(scene):
    return {item.name: {c.key: c.value for c in item.overrides} for item in refinements(scene)}


def test_what_is_refined_in_the_field():
    result = overrides_of(load_campaign(shipped_path("workflows", "field_given.toml")))
    assert list(result) == ROWS
    assert result["step"] == {
        "campaign.max_step_depth_um": 25.0,
        "campaign.first_step_depth_um": 1.0,
        "campaign.stability": 4.2,
        "campaign.error_tolerance_um": 0.125,
    }
    assert result["grid"] == {
        "campaign.point_spacing_mm": 0.125,
        "contact.cell_mm": 0.25,
        "contact.strips": 60,
        "contact.cells": 60,
        "contact.most_cells": 240,
    }
    assert result["smoothing-half"] == {"campaign.smoothing_wavelength_mm": 1.25}
    assert result["smoothing-double"] == {"campaign.smoothing_wavelength_mm": 5.0}
    assert result["points"]["operation.class.1.positions"] == 2 * 15
    assert result["points"]["operation.class.2.positions"] == 2 * 11
    together = result["step"] | result["grid"] | result["smoothing-half"] | result["points"]
    assert result["together"] == together


@pytest.mark.parametrize(
    ("wavelength", "spacing", "half", "together", "text"),
    [
        (2.5, 0.25, 1.25, 1.25, "all of these, with the wavelength halved"),
        (0.5, 0.25, None, 0.25, "all of these, with the wavelength halved"),
        (0.0, 0.25, None, None, "all of these, smoothed as given"),
        (0.1, 0.05, None, None, "all of these, smoothed as given"),
    ],
)
def test_half_the_wavelength_is_told_where_it_is_taken(
    tmp_path, rig_text, wavelength, spacing, half, together, text
):
    """Half of two points' spacing is resolved by points twice as close, and by these alone."""
    path = tmp_path / "rig.toml"
    path.write_text(rig_text)
    given = (
        Override("campaign.smoothing_wavelength_mm", wavelength),
        Override("campaign.point_spacing_mm", spacing),
    )
    result = {item.name: item for item in refinements(load_campaign(path, overrides=given))}
    for name, expected in (("smoothing-half", half), ("together", together)):
        values = {item.key: item.value for item in result[name].overrides}
        assert values.get("campaign.smoothing_wavelength_mm") == expected
        load_campaign(path, overrides=(*given, *result[name].overrides))
    assert result["together"].text == text


@pytest.mark.parametrize(
    ("share", "text"),
    [(1.1, "110 %"), (1, "100 %"), (0.044, "4.4 %"), (2e-6, "less than 0.001 %"), (0, "0 %")],
)
def test_shares_are_plain_numbers(share, text):
    assert percent(share) == text


def test_in_a_comparison_both_scenes_are_refined():
    result = overrides_of(load_campaign(shipped_path("workflows", "rig_vs_field.toml")))
    assert {key.split(".")[0] for key in result["together"]} == {"rig", "field"}
    assert {key.split(".")[0] for key in result["points"]} == {"field"}  # a programme gives its points


@pytest.fixture(scope="module")
def converged(tmp_path_factory, rig_text):
    """A few steps on a rig, coarse, with all their refinements; scene and run directory."""
    folder = tmp_path_factory.mktemp("converged")
    scene, out = folder / "rig.toml", folder / "out"
    scene.write_text(rig_text)
    assert cli.main(["run", str(scene), "--out", str(out), "--converge"]) == 0
    return scene, out


def test_table_tells_how_the_end_moves(converged):
    _, out = converged
    table = json.loads((out / "convergence.json").read_text())
    assert [row["name"] for row in table["rows"]] == ROWS
    given = table["given"]["rig"]
    rows = {row["name"]: row for row in table["rows"]}
    assert rows["points"]["reason"].startswith("a rig programme gives")
    assert rows["step"]["ends"]["rig"]["steps"] > given["steps"]
    for name in ("step", "grid", "together"):
        with open_results(out / "converge" / name / "rig.nc") as data:
            depth = data["max_wear_depth"].values[-1]
        assert rows[name]["ends"]["rig"]["end"]["max_wear_depth"] == depth.tolist()
    refined = tomllib.loads((out / "converge" / "together" / "scene" / "rig.toml").read_text())
    assert refined["contact"]["strips"] == 24
    assert refined["campaign"]["smoothing_wavelength_mm"] == 1.25


def test_the_table_stands_in_the_report(converged):
    """Numbers of the table are differences of the results: largest of both wheels, and its share."""
    _, out = converged
    table = json.loads((out / "convergence.json").read_text())
    row = next(item for item in table["rows"] if item["name"] == "grid")
    end, given = row["ends"]["rig"]["end"]["max_wear_depth"], table["given"]["rig"]["end"]["max_wear_depth"]
    difference = max((b - a for a, b in zip(given, end, strict=True)), key=abs)
    share = max(abs(b / a - 1.0) for a, b in zip(given, end, strict=True))
    html, (shown,) = (out / "report.html").read_text(), read_convergence(out)
    assert 'id="table-convergence-rig"' in html
    cell = f"({100.0 * share:.2g} %)"
    text = f"{plain(1e6 * difference, 3)} {cell}"
    assert shown.frame.set_index("computed with")["largest wear depth [µm]"].iloc[2] == text
    assert text in html


def test_asked_again_nothing_is_computed(converged):
    scene, out = converged
    before = (out / CONVERGENCE).read_bytes()
    command = json.loads(before)["command"]
    seen = []
    converge(scene, out, command=command, observer=lambda event: seen.append((event.kind, event.name)))
    assert seen == [("complete", "rig")] + [("complete", f"rig, {name}") for name in ROWS if name != "points"]
    assert (out / CONVERGENCE).read_bytes() == before


@pytest.mark.slow
def test_a_shorter_distance_bounds_the_cost(converged, tmp_path):
    scene, _ = converged
    table = json.loads(converge(scene, tmp_path / "out", distance=2e3).read_text())
    assert table["shortened"]
    assert table["given"]["rig"]["distance"] == pytest.approx(2e3)
    assert all(row["ends"]["rig"]["distance"] == pytest.approx(2e3) for row in table["rows"] if "ends" in row)
    assert (tmp_path / "out" / "converge-2km" / "as-given" / "rig.nc").exists()
    assert not (tmp_path / "out" / "rig.nc").exists()
    assert "2 km, shortened for this comparison" in read_convergence(tmp_path / "out")[0].title


@pytest.mark.parametrize("text", ["0", "-3", "nan", "far"])
def test_a_distance_that_is_none_is_told(text, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["run", "rig.toml", f"--converge={text}"])
    assert caught.value.code == 2
    assert "must be a distance above 0" in capsys.readouterr().err


@pytest.mark.slow
def test_other_contact_models_tell_how_far_the_end_depends_on_them(converged, tmp_path, undrawn):
    """A scaled friction would move all alike; here the place of the difference counts, too."""
    scene, _ = converged
    out = tmp_path / "out"
    asked = ["run", str(scene), "--out", str(out), "--against", "knothe_le_the+fastsim"]
    assert cli.main([*asked, "--against", "kik_piotrowski+fastsim"]) == 0
    table = json.loads((out / CONVERGENCE).read_text())
    assert [row["name"] for row in table["rows"]] == ["knothe_le_the+fastsim", "kik_piotrowski+fastsim"]
    strips, same = (row["ends"]["rig"] for row in table["rows"])
    assert same["end"] == table["given"]["rig"]["end"]
    assert same["profile_difference"] == [0.0, 0.0]
    with (
        open_results(out / "rig.nc") as given,
        open_results(out / "converge" / "knothe_le_the+fastsim" / "rig.nc") as result,
    ):
        depth, other = (data["wear_depth"].values[-1] for data in (given, result))
        assert result.attrs["contact_normal"] == "knothe_le_the"
    apart = np.abs(other - depth).max(axis=1)  # the points of new profiles are the same
    np.testing.assert_allclose(strips["profile_difference"], apart, rtol=1e-12)
    line = read_convergence(out)[0].frame.iloc[1]
    assert line.iloc[-1].endswith(f"({100.0 * (apart / depth.max(axis=1)).max():.2g} %)")


def test_models_that_a_scene_leaves_open_are_told(rig_text, tmp_path):
    given = rig_text[rig_text.index("[contact]") : rig_text.index("[", rig_text.index("[contact]") + 1)]
    text = rig_text.replace(given, '[contact]\nmodel = "auto"\ntolerance = 0.5\n')
    (tmp_path / "auto.toml").write_text(text)
    (row,) = other_models(load_campaign(tmp_path / "auto.toml"), [("half_space", "half_space")])
    assert row.overrides == ()
    assert 'model = "auto"' in row.reason


@pytest.mark.parametrize("text", ["hertz+fastsim", "half_space", "half_space+hertz", "+"])
def test_models_that_cannot_lead_are_told(text, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["run", "rig.toml", "--against", text])
    assert caught.value.code == 2
    assert "must be one of half_space, kik_piotrowski, knothe_le_the, a plus sign" in capsys.readouterr().err


def test_a_study_does_not_converge(capsys, tmp_path):
    assert cli.main(["run", "sweep_rig.toml", "--out", str(tmp_path), "--converge"]) == 2
    assert "--converge is for campaigns" in capsys.readouterr().err


def test_a_spoiled_table_is_told(tmp_path, capsys, converged):
    (tmp_path / "rig.nc").write_bytes((converged[1] / "rig.nc").read_bytes())
    (tmp_path / "convergence.json").write_text("{}")
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "is no table of `wearsim run --converge`" in capsys.readouterr().err


def test_refined_campaigns_run_as_far_as_the_one_that_ended_at_a_limit(
    monkeypatch, tmp_path, write_campaign, rig_text
):
    """Ends at different distances could not be compared."""
    scene = tmp_path / "scene.toml"
    scene.write_text(rig_text + "[campaign.limits]\ndepth_mm = 1\nend = true\n")
    seen = []

    def run_scene(path, directory, *, overrides, **_):
        seen.append({item.key: item.value for item in overrides})
        directory.mkdir(parents=True, exist_ok=True)
        write_campaign(directory / "rig.nc", "rig", 2, 20e-9)
        return (directory / "rig.nc",)

    monkeypatch.setattr("wearsim.studies.converge.run_scene", run_scene)
    converge(scene, tmp_path / "out")
    assert seen[0] == {}
    assert len(seen) == 6  # as given, step, grid, half and double smoothing, together
    for one in seen[1:]:
        assert one["campaign.distance_km"] == 20.0
        assert one["campaign.limits.end"] is False


@pytest.mark.slow
def test_rollers_that_wear_have_columns_of_their_own(tmp_path, converged, rig_text):
    """Depth and area as the results tell them; no such columns where the rollers do not wear."""
    scene = tmp_path / "rig.toml"
    worn = rig_text.replace("[contact]", "[counterface.wear]\nfactor = 0.5\n[contact]")
    scene.write_text(worn.replace("distance_km = 4", "distance_km = 2"))
    table = json.loads(converge(scene, tmp_path / "out").read_text())
    given = table["given"]["rig"]
    names = ("counterface_max_wear_depth", "counterface_worn_area")
    with open_results(tmp_path / "out" / "rig.nc") as data:
        for name in names:
            assert given["end"][name] == given["moved"][name] == data[name].values[-1].tolist()
            assert given["end"][name][0] > 0.0
    (result,) = read_convergence(tmp_path / "out")
    row = result.frame.iloc[1]
    assert row.iloc[0].startswith("steps half")
    end = table["rows"][0]["ends"]["rig"]["end"]
    for name, title in zip(names, result.frame.columns[-3:-1], strict=True):
        difference = max((b - a for a, b in zip(given["end"][name], end[name], strict=True)), key=abs)
        assert "of the counterface" in title
        assert row[title].startswith(plain(1e6 * difference, 3))
    assert not any("counterface" in title for title in read_convergence(converged[1])[0].frame)


@pytest.fixture
def made_up_runs(monkeypatch, write_campaign):
    """Campaigns are loaded and checked as ever, but written, not run; 20 km, some refinements fail."""

    def run_scene(path, directory, *, overrides, **_):
        load_campaign(path, overrides=overrides)
        if directory.name in ("grid", "step"):
            raise {"grid": ContactError, "step": NumericalError}[directory.name]("the wheel does not touch")
        directory.mkdir(parents=True, exist_ok=True)
        write_campaign(directory / "rig.nc", "rig", 2, 20e-9)
        return (directory / "rig.nc",)

    monkeypatch.setattr("wearsim.studies.converge.run_scene", run_scene)


@pytest.mark.parametrize("distance", [None, pytest.param(20e3, marks=pytest.mark.slow)])
def test_a_campaign_that_is_cut_short_before_a_turning_is_compared_all_the_same(
    made_up_runs, tmp_path, distance, rig_text
):
    """At 20 km a limit ended it, or the user; the turnings at 20 and 30 km are not reached."""
    scene = tmp_path / "scene.toml"
    turned = "[campaign.limits]\ndepth_mm = 1\nend = true\n[campaign.reprofiling]\nat_km = [20, 30]\n"
    scene.write_text(rig_text.replace("distance_km = 4", "distance_km = 40") + turned)
    table = json.loads(converge(scene, tmp_path / "out", distance=distance).read_text())
    message = {row["name"]: row["reason"] for row in table["rows"]}
    assert message["together"] == message["smoothing-half"] == ""
    assert message["grid"] == message["step"] == "failed: the wheel does not touch"


@pytest.mark.slow
def test_a_campaign_that_ended_with_a_turning_is_compared_by_its_worn_wheels(
    made_up_runs, monkeypatch, tmp_path, rig_text
):
    """Its last row, without depth, is one of turned wheels; refined campaigns end at the same place, worn."""

    def turned(path):
        data = open_results(path).drop_indexes("distance")
        if path.parent.name != "out":
            return data
        lathe = data.isel(step=slice(0, 1)).assign(distance=data["distance"][-1:])
        both = xr.concat([data, lathe], "step", data_vars="minimal", coords="minimal", compat="override")
        return both.assign(last_reprofiling=("step", [0, 0, 0, 3]))

    monkeypatch.setattr("wearsim.studies.converge.open_results", turned)
    scene = tmp_path / "scene.toml"
    scene.write_text(rig_text)
    table = json.loads(converge(scene, tmp_path / "out").read_text())
    given, refined = table["given"]["rig"], table["rows"][-1]["ends"]["rig"]
    assert given["steps"] == refined["steps"] == 2
    assert given["end"] == refined["end"]
    assert given["moved"] == refined["moved"]
    assert given["moved"]["max_wear_depth"][0] == pytest.approx(20e-9 * 20e3, rel=1e-12)
