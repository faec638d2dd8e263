"""`wearsim contact --match`: what it prints and writes, and what it refuses."""

import json

import pandas as pd
import pytest

from wearsim.cli import main
from wearsim.errors import WearsimError
from wearsim.texts import WIDTH

POINT = ["contact", "--shift-mm", "1.8", "--model", "fast"]
RIG = [
    "--rig",
    "workflows/rig.toml",
    "--set",
    "operation.block.curving.friction_flange=",
    "--match",
]


def test_a_contact_is_matched_on_the_shipped_rig(capsys, tmp_path):
    table = tmp_path / "match.csv"
    words = [*POINT, *RIG, "max_pressure, place", "--csv", str(table)]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert all(len(line) <= WIDTH for line in printed.splitlines())
    for part in (
        "rig: full-scale rig",
        "wheel load [kN]",
        "25 to 125",
        "largest pressure [MPa] *",
        "change by an error of",
        "yaw 0.2 mrad",
    ):
        assert part in printed
    assert printed.rstrip().splitlines()[-1] == "matched"
    rows = pd.read_csv(table).set_index("quantity")
    assert rows.loc["max_pressure", "matched"] == pytest.approx(
        rows.loc["max_pressure", "field"], rel=0.01
    )
    assert rows.loc["wheel_load", "high"] == pytest.approx(125e3)


def test_json_has_si_values_and_null_where_there_is_none(capsys):
    assert main([*POINT, *RIG, "max_pressure", "--json"]) == 0
    held = json.loads(capsys.readouterr().out)
    assert held["matched"] is True
    assert held["states"]["field"]["wheel_load"] == 80e3
    right = held["states"]["matched"]["wheels"]["right"]
    assert right["max_pressure"] == pytest.approx(
        held["states"]["field"]["wheels"]["right"]["max_pressure"], rel=0.01
    )
    assert held["limits"]["yaw"] == {"low": -0.04, "high": 0.04, "controlled": True}
    assert held["verdict"][0] == "matched"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--match", "place"], "--match needs --rig"),
        (["--rig", "rig.toml"], "--rig acts with --match only"),
        (["--csv", "a.csv"], "--csv acts with --match only"),
        ([*RIG, "power"], "--match = power: must be some of max_pressure"),
        ([*RIG, "place", "--table", "a.csv"], "--match and --table exclude each"),
        ([*RIG, "place", "--plot", "a.png"], "--match and --plot exclude each"),
        ([*RIG, "place", "--creepage=0,0,0"], "--match and --creepage exclude"),
        (["--match", "place", "--rig", "none.toml"], "none.toml"),
        (["--match", "place", "--rig", "workflows/field_given.toml"], "kind rig"),
    ],
)
def test_faults_are_lines_and_exit_code_2(words, message, capsys):
    assert main([*POINT, *words]) == WearsimError.exit_code
    assert message in capsys.readouterr().err


def test_a_table_that_cannot_be_written_costs_no_search(monkeypatch, capsys, tmp_path):
    def search(*_, **__):
        raise AssertionError("the search has begun")

    monkeypatch.setattr("wearsim.studies.match.match_contact", search)
    words = ["contact", "--shift-mm", "1", *RIG, "place"]
    assert main([*words, "--csv", str(tmp_path / "missing" / "a.csv")]) == 2
    assert "cannot be written" in capsys.readouterr().err
