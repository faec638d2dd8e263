"""[contact]: creep curves of contaminated rails, independent wheels."""

from pathlib import Path

import pytest

from wearsim.campaign.row import header_of
from wearsim.cli import main
from wearsim.scene import build, load_scene
from wearsim.scene.draws import dimensions_of

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
CURVE = "kalker_factor = 0.3\nfriction_ratio = 0.4\nfriction_decrease_s_m = 0.6\n"


def attributes_of(text):
    Path("scene.toml").write_text(text)
    return header_of(build(load_scene("scene.toml")), "").attributes


def test_results_state_the_creep_curve_of_contaminated_rails_alone(folder):
    clean = attributes_of(RIG)
    assert not {"kalker_factor", "friction_ratio", "friction_decrease"} & clean.keys()
    dirty = attributes_of(f"{RIG}[contact]\n{CURVE}")
    assert dirty["kalker_factor"] == 0.3
    assert dirty["friction_ratio"] == 0.4
    assert dirty["friction_decrease"] == 0.6
    assert "falls with its rigid slip velocity" in dirty["friction_note"]


@pytest.mark.parametrize(
    ("keys", "output"),
    [
        ("kalker_factor = 0.1", "kalker_factor = 0.1 must be at least 0.2 and at most"),
        ("kalker_factor = 1.1", "kalker_factor = 1.1 must be at least 0.2 and at most"),
        ("friction_ratio = 1.5", "friction_ratio = 1.5 must be at least 0 and at most"),
        (
            "friction_decrease_s_m = -1",
            "friction_decrease_s_m = -1 must be at least 0 and at most 10 s/m",
        ),
        (
            "friction_ratio = 0.4",
            "friction_ratio = 0.4 is without effect where friction_decrease_s_m = 0; "
            "write a friction_decrease_s_m above 0, or delete it",
        ),
        (
            "friction_decrease_s_m = 0.6",
            "friction_decrease_s_m = 0.6 is without effect where friction_ratio = 1; "
            "write a friction_ratio below 1, or delete it",
        ),
        ('rotation = "single"', 'rotation = "single"'),
    ],
)
def test_numbers_that_are_refused(folder, faults_of, keys, output):
    (fault,) = faults_of(f"{RIG}[contact]\n{keys}\n")
    assert output in fault


def test_creep_curves_are_uncertain_inputs(folder):
    inputs = "".join(
        f'[[uncertainty.input]]\nkey = "contact.{key}"\ndistribution = "uniform"\n'
        f"low = {low}\nhigh = {high}\n"
        for key, low, high in (
            ("kalker_factor", 0.3, 1.0),
            ("friction_ratio", 0.3, 0.5),
            ("friction_decrease_s_m", 0.2, 0.8),
        )
    )
    Path("scene.toml").write_text(f"{RIG}[contact]\n{CURVE}{inputs}")
    assert len(dimensions_of(load_scene("scene.toml"))) == 3


def test_check_shows_the_creep_curve(folder, capsys):
    line = (
        "Kalker factor 0.3; friction falls with the slip velocity to 0.4 of its value "
        "at rest, B = 0.6 s/m"
    )
    for text, shown in ((RIG, False), (f"{RIG}[contact]\n{CURVE}", True)):
        Path("scene.toml").write_text(text)
        assert main(["check", "scene.toml"]) == 0
        assert (line in " ".join(capsys.readouterr().out.split())) is shown


FATIGUE = """[fatigue]
laws = ["wlrm"]
wear_number = "with_spin"
branch = "rising"
crack_depth_mm = 5
"""


def test_a_campaign_beyond_the_crest_ends_with_a_message(folder, capsys):
    """Also where fatigue laws have no patch left."""
    torque = 'model = "fast"\ntorque_Nm = 24500\n'
    Path("scene.toml").write_text(f"{RIG}{FATIGUE}[contact]\n{torque}{CURVE}")
    assert main(["run", "scene.toml", "--out", "out", "-q"]) != 0
    *_, line = capsys.readouterr().err.splitlines()
    assert "an axle torque of 24500 N m is beyond the crest of the creep forces" in line
