"""Wear of the counterface in report, inspect and check, from short campaigns of the
real physics.
"""

import json

import numpy as np
import pytest

from wearsim.cli import main
from wearsim.quantities import QUANTITIES
from wearsim.report import plates
from wearsim.report.figures import campaign
from wearsim.report.html import write_report
from wearsim.report.inspect import inspect, summary_text
from wearsim.report.tables import counterface

ROLLERS = "[counterface.wear]\nfactor = 0.5\nredress_every_km = 6"
RAILS = "[counterface.wear]\narea_mm2_per_1000km = 3"


@pytest.fixture(scope="module")
def ran(run_pair):
    return run_pair(4, {"counterface": ROLLERS}, {"counterface": RAILS})


@pytest.fixture(scope="module")
def folder(ran):
    return ran[0]


@pytest.fixture(scope="module")
def pair(ran):
    return ran[1]


def test_report_states_what_the_counterface_lost(folder, pair):
    text = write_report(folder / "out").read_text(encoding="utf-8")
    for name in ("counterface_wear", "counterface_over_distance"):
        assert text.count(f'id="figure-{name}"') == 1
    for role in ("rig", "field"):
        assert text.count(f'id="table-counterface-{role}"') == 1
    assert "the rollers were redressed 2 times" in text
    assert (
        "The factors contain wear of the counterface: rollers wear, rails wear." in text
    )
    assert "sampled differently" not in text
    assert "Running after which rollers are redressed [km]" in text
    assert "cross-section loses per distance run [mm²/1000\N{NO-BREAK SPACE}km]" in text
    (rails,) = counterface(pair[1])
    assert list(rails.frame.columns) == ["Measure", "Right rail", "Left rail"]
    assert rails.frame.iloc[1, 1:].tolist() == pytest.approx(
        [0.09, 0.09], rel=1e-9
    )  # 3 mm2, 30 of 1000 km


@pytest.mark.slow
def test_whole_figures_of_the_counterface_are_drawn(folder, drawing):
    with drawing():
        text = write_report(folder / "out").read_text(encoding="utf-8")
    figure = text[text.index('id="figure-counterface_wear"') :]
    assert figure[: figure.index("</figure>")].count("<path") > 10


def test_captions_of_rails_say_that_their_area_is_stated(pair):
    """No environment factor acts on it, and rails are not redressed."""
    draw = (plates.counterface_wear, plates.counterface_over_distance)
    rig, field = ([plates.plate(one, [data]).caption for one in draw] for data in pair)
    for along, over in (rig, field):
        assert along.endswith(".")
        assert over.endswith(".")
    assert "Environment factor: " in rig[0]
    assert "rollers are redressed" in rig[1]
    assert "the amount is as given and contains no environment factor" in field[0]
    assert "Environment factor: " not in "".join(field)
    assert "redressed" not in "".join(field)
    both = plates.plate(plates.counterface_wear, pair).caption
    assert "Environment factor: 1." in both
    assert "Rails (field) lose" in both


def test_lives_of_the_rollers_are_drawn(pair):
    """Two redressings and the end; rails: three quarters of the way and the end."""
    rig, field = pair
    redressings = rig["counterface_redressed_count"].values
    rows = campaign.states_shown(rig)
    assert [int(redressings[row]) for row in rows] == [1, 2, 2]
    deepest = rig["counterface_wear_depth"].values.max(axis=2)
    np.testing.assert_array_equal(deepest, rig["counterface_max_wear_depth"].values)
    off = deepest[rows[:-1]].sum(axis=0)
    np.testing.assert_allclose(
        rig["counterface_redressed_depth"].values[-1], off, rtol=1e-12
    )
    assert rows[-1] == rig.sizes["step"] - 1
    assert not field["counterface_redressed_count"].values.any()
    shown = list(
        campaign.states_shown(field)
    )  # the first steps are short: quarters may share a state
    assert shown == sorted(set(shown))
    assert 2 < len(shown) <= min(4, field.sizes["step"] - 1)
    assert shown[-1] == field.sizes["step"] - 1
    ax = campaign.plot_over_distance(rig, "counterface_max_wear_depth")
    x, y = ax.lines[0].get_data()
    at = np.flatnonzero(np.diff(x) == 0.0)
    np.testing.assert_allclose(x[at], [6.0, 12.0], rtol=1e-12)
    depth = QUANTITIES["counterface_max_wear_depth"].shown_factor
    before = rig["counterface_max_wear_depth"].values[
        np.flatnonzero(np.diff(redressings)) + 1, 0
    ]
    np.testing.assert_allclose(y[at], depth * before, rtol=1e-12)
    assert not y[at + 1].any()


def test_inspect_lists_both_sides(folder, pair):
    actual = inspect(folder / "out" / "rig.nc")
    worn = actual["counterface"]
    assert worn["counterface_redressed_count"] == 2
    assert worn["counterface_worn_area"] == pytest.approx(
        pair[0]["counterface_worn_area"].values[-1]
    )
    assert json.dumps(actual)
    assert "Number of times the rollers were redressed: 2" in summary_text(actual)
    rails = summary_text(inspect(folder / "out" / "field.nc"))
    assert "Largest wear depth of the rail" in rails
    assert "redressed" not in rails


def test_check_lists_how_it_wears(folder, capsys):
    assert main(["check", str(folder / "compare.toml")]) == 0
    message = " ".join(capsys.readouterr().out.split())
    assert (
        "wear 0.5 times as deep per passage as the wheels; redressed to their new "
        "profile every 6 km"
    ) in message
    assert "each loses 3 mm2 per 1000 km where the wheels wear" in message
