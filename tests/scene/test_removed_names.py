"""Keys and values of earlier versions: one line each, all at once, wherever they are
given.
"""

import tomllib
from pathlib import Path

import pytest

import wearsim
from wearsim import ContactModels, cli
from wearsim.errors import ContactError, SceneError
from wearsim.scene import load_scene
from wearsim.scene.draws import dimensions_of
from wearsim.scene.overrides import Override

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
AUTO = (
    'contact.model = "auto" was removed in 0.3.0: write "standard" or "accurate"; '
    "depths change by up to 5 % in the shipped scenes"
)
TOLERANCE = "contact.tolerance was removed in 0.3.0: "
STRIPS = (
    'was removed in 0.3.0: write "coupled_strips", or leave normal out: it is the '
    "default"
)
HEUN = 'campaign.integrator = "heun" was removed in 0.3.0: write "rkc"'
NORMAL = f'contact.normal = "knothe_le_the" {STRIPS}'


def test_both_are_named_at_once_in_a_scene(folder, faults_of):
    first, second = faults_of(RIG + '[contact]\nmodel = "auto"\ntolerance = 0.03\n')
    line = RIG.count("\n") + 2
    assert first == f"scene.toml:{line}: {AUTO}"
    assert second.startswith(f"scene.toml:{line + 1}: {TOLERANCE}")


def test_in_a_scene_of_python(folder):
    tables = tomllib.loads(RIG) | {"contact": {"model": "auto", "tolerance": 0.03}}
    with pytest.raises(SceneError) as caught:
        load_scene(tables)
    first, second = str(caught.value).splitlines()
    assert first.endswith(AUTO)
    assert TOLERANCE in second


def test_in_values_of_the_command_line(folder, capsys):
    flags = ["--set", "contact.model=auto", "--set", "contact.tolerance=0.02"]
    assert cli.main(["run", "rig.toml", "--out", "out", *flags]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert AUTO in first
    assert TOLERANCE in second


def test_to_remove_a_key_that_is_gone_says_so_too(folder):
    with pytest.raises(SceneError, match=TOLERANCE):
        load_scene("rig.toml", overrides=[Override("contact.tolerance", None)])


def test_in_a_sweep(folder, capsys):
    flags = ["--vary", "contact.model=auto,fast", "--vary", "contact.tolerance=0.02"]
    assert cli.main(["sweep", "rig.toml", "--out", "out", *flags]) == 2
    said = capsys.readouterr().err
    assert AUTO in said
    assert TOLERANCE in said
    assert not Path("out").exists()


def test_in_uncertain_inputs(folder):
    drawn = 'distribution = "uniform"\nlow = 0.01\nhigh = 0.1\n'
    Path("scene.toml").write_text(
        f'{RIG}[[uncertainty.input]]\nkey = "contact.tolerance"\n{drawn}'
    )
    with pytest.raises(SceneError, match=TOLERANCE):
        dimensions_of(load_scene("scene.toml"))


def test_in_contact_models_of_python():
    with pytest.raises(SceneError) as caught:
        ContactModels.of("auto")
    assert str(caught.value) == AUTO
    with pytest.raises(SceneError, match="did you mean 'fast'"):
        ContactModels.of("fsat")


@pytest.mark.parametrize("more", ["", 'tangential = "fastsim"\n', 'model = "fast"\n'])
def test_a_normal_model_is_named_in_a_scene(folder, faults_of, more):
    (fault,) = faults_of(f'{RIG}[contact]\n{more}normal = "knothe_le_the"\n')
    line = RIG.count("\n") + 2 + more.count("\n")
    assert fault == f"scene.toml:{line}: {NORMAL}"


@pytest.mark.parametrize(
    ("command", "place"),
    [
        (
            "run rig.toml --out out --set contact.normal=knothe_le_the",
            "--set contact.normal=knothe_le_the",
        ),
        (
            "sweep rig.toml --out out --vary contact.normal=hertz,knothe_le_the",
            "case 2",
        ),
    ],
)
def test_a_normal_model_in_values_of_the_command_line(folder, capsys, command, place):
    assert cli.main(command.split()) == 2
    (line,) = (line for line in capsys.readouterr().err.splitlines() if STRIPS in line)
    assert f"{place}: {NORMAL}" in line
    assert not Path("out").exists()


def test_a_normal_model_of_a_single_contact(folder, capsys):
    assert cli.main(["contact", "--normal", "knothe_le_the"]) == 2
    assert capsys.readouterr().err == f"--normal = knothe_le_the {STRIPS}\n"
    Path("points.csv").write_text("shift_mm,normal\n1,knothe_le_the\n")
    assert cli.main(["contact", "--table", "points.csv"]) == 2
    assert capsys.readouterr().err == f"points.csv:2: normal = knothe_le_the {STRIPS}\n"


def test_a_normal_model_of_python():
    with pytest.raises(SceneError) as caught:
        wearsim.NORMAL_MODELS["knothe_le_the"]
    assert str(caught.value) == f'normal model "knothe_le_the" {STRIPS}'
    models = ContactModels(normal="knothe_le_the")
    wheelset, rails = (
        wearsim.wheelset("S1002"),
        wearsim.rails("60E1", inclination=1 / 40, gauge=1.435),
    )
    with pytest.raises(ContactError) as caught:
        wearsim.solve_contact(
            wheelset, rails, wearsim.ContactConditions.of([0.0]), models
        )
    assert str(caught.value) == f"normal = 'knothe_le_the' {STRIPS}"


def test_an_integrator_is_named_in_a_scene(folder, faults_of):
    (fault,) = faults_of(
        RIG.replace("[campaign]\n", '[campaign]\nintegrator = "heun"\n')
    )
    line = RIG[: RIG.index("[campaign]")].count("\n") + 2
    assert fault == f"scene.toml:{line}: {HEUN}"


@pytest.mark.parametrize("command", ["run rig.toml --set", "sweep rig.toml --vary"])
def test_an_integrator_in_values_of_the_command_line(folder, capsys, command):
    assert cli.main([*command.split(), "campaign.integrator=heun", "--out", "out"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert HEUN in line
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("lines", "pair"),
    [
        ("", ("coupled_strips", "coupled_strips")),
        ('model = "fast"', ("kik_piotrowski", "fastsim")),
        ('model = "accurate"', ("half_space", "half_space")),
        ('normal = "half_space"', ("half_space", "coupled_strips")),
        ('tangential = "fastsim"', ("coupled_strips", "fastsim")),
    ],
)
def test_pairs_of_models_by_name_and_one_alone(folder, lines, pair):
    Path("scene.toml").write_text(RIG + f"[contact]\n{lines}\n")
    assert load_scene("scene.toml").contact.pair == pair
