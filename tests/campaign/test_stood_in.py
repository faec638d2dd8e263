"""Wear of wheels that the contact model of a scene does not solve, counted and warned
of.
"""

from dataclasses import replace

import pytest

from wearsim.campaign.run import run_scene
from wearsim.cli.report import print_warnings
from wearsim.contact import wheels
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.errors import NumericalError
from wearsim.results import FILL_INT

SCENE = """
[scene]
kind = "rig"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
roller_radius_mm = 1000
[contact]
strips = 8
cells = 8
cell_mm = 2
[campaign]
distance_km = 1
point_spacing_mm = 0.5
[[operation.block]]
name = "left"
shift_mm = -1
load_kN = 80
speed_km_h = 72
friction = 0.35
distance_km = 4
"""


@pytest.fixture
def refusing(monkeypatch):
    """Strips have no solution of any wheel."""
    model = NORMAL_MODELS["coupled_strips"]

    def refuses(gap, row, load, **options):
        if options["rough"]:
            return model.solve(gap, row, load, **options)
        raise NumericalError("refused", row=int(row[0]), rows=row.tolist())

    changed = {**NORMAL_MODELS, "coupled_strips": replace(model, solve=refuses)}
    monkeypatch.setattr(wheels, "NORMAL_MODELS", changed)


def flags_of_new_wheels(evolution):
    """Flags of the patches in the first row of a campaign."""
    state, taken = evolution.start()
    flags = evolution.row(state, evolution.evaluate(state, taken), taken)["stood_in"]
    return flags[flags != FILL_INT].tolist()


def test_a_row_says_which_patches_another_model_solved(evolution_of, refusing):
    assert flags_of_new_wheels(evolution_of(SCENE)) == [1, 1]


def test_a_row_of_solved_patches_says_so(evolution_of):
    assert flags_of_new_wheels(evolution_of(SCENE)) == [0, 0]


@pytest.mark.slow
def test_their_wear_is_warned_of_after_the_run(refusing, tmp_path, capsys):
    scene, out = tmp_path / "rig.toml", tmp_path / "out"
    scene.write_text(SCENE)
    run_scene(scene, out)
    print_warnings([out / "rig.nc"])
    printed = capsys.readouterr().err
    assert (
        "warning: rig: 100 % of the wear, more than 5 %, is of wheels for which "
        "the contact"
    ) in printed
    assert "at 1 of 1 operating points: half_space stood in for it there" in printed
