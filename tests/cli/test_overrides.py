"""Values of a scene overridden on the command line: what acts, and what the run
directory keeps.
"""

import json
import tomllib

import netCDF4
import pytest

from wearsim import cli
from wearsim.profile.standard import shipped_path
from wearsim.scene import load_scene
from wearsim.scene.overrides import Override

pytestmark = pytest.mark.usefixtures("untried")


@pytest.fixture
def scene(tmp_path):
    """The shipped rig, cut short and coarse."""
    text = shipped_path("workflows", "rig_given.toml").read_text()
    text = text.replace("strips = 30", "strips = 12").replace(
        "cells = 30", "cells = 12"
    )
    text = text.replace('model = "standard"', 'model = "fast"')
    head, tail = text.split("[campaign]")
    path = tmp_path / "rig.toml"
    path.write_text(
        f"{head}[campaign]{tail.replace('distance_km = 1260', 'distance_km = 9')}"
    )
    return path


def settings(capsys, *words):
    assert cli.main(["check", *words, "--json"]) == 0
    return [
        item["settings"] for item in json.loads(capsys.readouterr().out)["campaigns"]
    ]


@pytest.mark.parametrize(
    ("word", "wavelength"), [("off", 0.0), ("half", 1.25), ("double", 5.0)]
)
def test_smoothing_is_one_flag_away(scene, capsys, word, wavelength):
    (result,) = settings(capsys, str(scene), "--smoothing", word)
    assert result["campaign"]["smoothing_wavelength_mm"] == wavelength


def test_in_a_comparison_each_scene_keeps_its_own_wavelength(capsys):
    one = "field.campaign.smoothing_wavelength_mm=4"
    result = settings(capsys, "rig_vs_field.toml", "--set", one, "--smoothing", "half")
    assert [item["campaign"]["smoothing_wavelength_mm"] for item in result] == [
        1.25,
        2.0,
    ]


def test_the_run_directory_keeps_the_scene_as_changed(scene, tmp_path, capsys, undrawn):
    """A resumed campaign, and whoever reads the result, finds the value that acted."""
    words = ["run", str(scene), "--out", str(tmp_path / "out"), "--smoothing", "off"]
    assert (
        cli.main(
            [
                *words,
                "--set",
                "campaign.stability=0.9",
                "--set",
                "contact.friction_note=1",
            ]
        )
        == 2
    )
    assert "friction_note" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert cli.main([*words, "--set", "campaign.stability=0.9"]) == 0
    copy = tomllib.loads((tmp_path / "out" / "scene" / "rig.toml").read_text())
    assert copy["campaign"]["smoothing_wavelength_mm"] == 0.0
    assert copy["campaign"]["stability"] == 0.9
    with netCDF4.Dataset(tmp_path / "out" / "rig.nc") as file:
        assert file.smoothing_wavelength == 0.0
        assert file.stability_limit == 0.9
        assert "smoothing_wavelength_mm = 0.0" in file.scene_text
    assert cli.main(words[:-2]) == 2  # without the flags it is another campaign
    assert "belongs to another campaign" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text", ["stability=1", "campaign.stability", "campaign..x=1", "=3", "rig="]
)
def test_what_is_no_key_and_value_is_told(scene, capsys, text):
    assert cli.main(["check", str(scene), "--set", text]) == 2
    assert capsys.readouterr().err == (
        f"--set {text}: write KEY=VALUE with a dotted key, such as "
        "campaign.max_step_km=10\n"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--set", "campaign.stability=-1"],
            "--set campaign.stability=-1: stability = -1 must be above 0",
        ),
        (
            ["--set", "campaign.stabilty=1"],
            "--set campaign.stabilty=1: unknown key stabilty in [campaign]",
        ),
        (
            ["--set", "campaign.stabilty="],
            "--set campaign.stabilty=: unknown key stabilty in [campaign]",
        ),
        (
            ["--set", "operation.block.shift_mm=20"],
            "--set operation.block.shift_mm=20: ",
        ),
        (
            ["--set", "wheelset.profile="],
            "--set wheelset.profile=: key profile is missing in [wheelset]",
        ),
    ],
)
def test_a_fault_of_an_override_names_the_flag(scene, capsys, words, message):
    """Whatever stage of the checks it shows in; not a line of the file, which does not
    hold the value.
    """
    assert cli.main(["check", str(scene), *words]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert all(line.startswith(message) for line in lines)
    assert "(in rig.toml)" in lines[0] or "unknown key" in lines[0]


def test_names_that_look_like_numbers_and_lists_are_read_as_what_the_key_holds(
    scene, capsys
):
    values = (
        "counterface.profile=54E1",
        "scene.title=2024",
        'wear.also_evaluate=["archard"]',
    )
    flags = (word for value in values for word in ("--set", value))
    (result,) = settings(capsys, str(scene), *flags)
    assert result["counterface"]["profile"] == "54E1"
    assert result["scene"]["title"] == "2024"
    assert result["wear"]["also_evaluate"] == ["archard"]


def test_a_block_is_set_by_its_name(scene, capsys):
    (result,) = settings(
        capsys, str(scene), "--set", "operation.block.curving.friction=0.21"
    )
    frictions = {
        block["name"]: block["friction"] for block in result["operation"]["block"]
    }
    assert frictions.pop("curving") == 0.21
    assert 0.21 not in frictions.values()
    assert (
        cli.main(["check", str(scene), "--set", "operation.block.curving.frition="])
        == 2
    )
    assert "unknown key frition in [[operation.block]]" in capsys.readouterr().err


def test_an_empty_value_removes_a_key_or_a_table(scene, tmp_path, capsys):
    """Its default applies, also from the copy that a run directory would keep."""
    words = [
        str(scene),
        "--set",
        "operation.monitor=",
        "--set",
        "wheelset.radius_mm=",
        "--set",
        "contact.strips=",
    ]
    (result,) = settings(capsys, *words)
    assert result["operation"]["monitor"] is None
    assert (result["wheelset"]["radius_mm"], result["contact"]["strips"]) == (460.0, 30)
    copy = tmp_path / "copy.toml"
    overrides = [Override(word[:-1], None) for word in words[2::2]]
    copy.write_bytes(load_scene(scene, overrides=overrides).origin.content)
    assert settings(capsys, str(copy))[0] == result
    assert "radius_mm" not in tomllib.loads(copy.read_text())["wheelset"]


def test_an_empty_value_removes_a_whole_section(capsys):
    (settings_of_wear,) = settings(capsys, "fatigue.toml", "--set", "fatigue=")
    assert settings_of_wear["fatigue"] is None
    assert cli.main(["check", "sweep_rig.toml", "--set", "sweep="]) == 2
    assert (
        capsys.readouterr().err
        == "--set sweep=: [sweep] is missing; give the table (in sweep_rig.toml)\n"
    )


def test_a_study_has_no_smoothing(capsys):
    assert cli.main(["check", "sweep_rig.toml", "--smoothing", "half"]) == 2
    assert "--smoothing is for campaigns" in capsys.readouterr().err
