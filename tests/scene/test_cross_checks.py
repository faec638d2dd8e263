"""Files that a scene names, and what only shows between its values: faults and warnings
with their line.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from wearsim.campaign.step import INTEGRATORS
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import STABILITY
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.setup import warnings_of

DATA = Path(__file__).parents[1] / "data"
RIG = (DATA / "scene_rig.toml").read_text()
FIELD = (DATA / "scene_field.toml").read_text()
COMPARE = (DATA / "scene_compare.toml").read_text()


@pytest.mark.parametrize(
    ("text", "old", "new", "output"),
    [
        (RIG, '"S1002"', '"S1003"', "neither a file nor a shipped wheel profile"),
        (RIG, '"60E1"', '"S1002"', "'S1002' is a wheel profile"),
        (
            RIG,
            '"60E1"',
            '"rail.csv"',
            (
                "there is no such file as given, next to the scene file or among the "
                "shipped"
            ),
        ),
        (
            FIELD,
            "share = 0.75",
            "share = 0.8",
            "0.8 + 0.25, must sum to 1 within 1 %, not 1.05",
        ),
        (
            FIELD,
            "shift_std_mm = 2.5",
            "shift_std_mm = 9",
            "reach 27 mm, more than 4 mm beyond the flange",
        ),
        (
            FIELD,
            "gauge_mm = 1435",
            "gauge_mm = 1424",
            "gauge_mm = 1424 must be above 1425 mm",
        ),
        (
            FIELD,
            "max_step_km = 20",
            "smoothing_wavelength_mm = 0.4",
            "at least twice point_spacing_mm = 0.25",
        ),
        (
            FIELD,
            "max_step_km = 20",
            "stability = 40",
            'must be at most 32 with integrator = "rkc"',
        ),
    ],
)
def test_files_and_cross_checks_are_told_with_their_line(
    folder, text, old, new, output, changed, faults_of, line_with
):
    (fault,) = faults_of(changed(text, (old, new)))
    assert fault.startswith(f"scene.toml:{line_with(text, old)}: ")
    assert output in fault


def test_the_limit_of_stability_is_that_of_the_rule(folder, changed, faults_of):
    for integrator, given, largest in (
        ("euler", "", 0.4),
        ("rkc", "", 8.4),
        ("euler", "stability = 1", 1.0),
    ):
        text = changed(
            FIELD, ("max_step_km = 20", f'integrator = "{integrator}"\n{given}')
        )
        (folder / "scene.toml").write_text(text)
        assert build(load_scene("scene.toml")).control.stability == largest
    (fault,) = faults_of(
        changed(FIELD, ("max_step_km = 20", 'integrator = "euler"\nstability = 2.1'))
    )
    assert 'must be at most 2 with integrator = "euler"' in fault


def test_no_scene_asks_for_more_than_its_rule_is_stable_with():
    for name, (_, largest) in STABILITY.items():
        assert largest <= (2.0 if name != "rkc" else INTEGRATORS[name][-1].stable)


def test_all_faults_of_the_last_stage_are_told_at_once(
    folder, changed, faults_of, line_with
):
    old, new = (
        ('"S1002"', '"60E1"', "share = 0.75"),
        ('"S1003"', '"rail.csv"', "share = 0.8"),
    )
    result = faults_of(changed(FIELD, *zip(old, new, strict=True)))
    assert [fault.split(":")[1] for fault in result] == [
        str(line_with(FIELD, text)) for text in old
    ]


def test_a_wheel_that_does_not_touch_the_rail_is_told_at_its_shift(
    folder, changed, faults_of, line_with
):
    text = changed(FIELD, ("gauge_mm = 1435", "gauge_mm = 1700"))
    (fault,) = faults_of(text)
    assert fault.startswith(f"scene.toml:{line_with(text, 'shift_mean_mm')}: ")
    assert "has no contact" in fault


def test_faults_of_a_profile_file_name_both_files_and_lines(folder, changed, faults_of):
    rows = [f"{0.5 * index},{0.01 * index}" for index in range(30)]
    rows[11] = "nan,1"
    rows[20] = "5,abc"
    Path("wheel.csv").write_text("\n".join(rows))
    result = faults_of(changed(RIG, ('"S1002"', '"wheel.csv"')))
    assert len(result) == 2
    assert all(
        fault.startswith('scene.toml:5: profile = "wheel.csv": wheel.csv:')
        for fault in result
    )
    assert "wheel.csv:12:" in result[0]
    assert "wheel.csv:21:" in result[1]


def test_a_profile_with_too_few_points_is_a_fault_of_its_key(
    folder, changed, faults_of
):
    Path("wheel.csv").write_text("0,0\n1,0\n2,0\n")
    (fault,) = faults_of(changed(RIG, ('"S1002"', '"wheel.csv"')))
    assert fault.startswith('scene.toml:5: profile = "wheel.csv": ')
    assert "points" in fault


def test_rounded_shares_are_normalised_with_a_warning(folder, changed):
    """Two decimals of 1/3 need not sum to 1; the ratio of the shares is kept."""
    Path("field.toml").write_text(changed(FIELD, ("share = 0.75", "share = 0.7501")))
    scene = load_scene("field.toml")
    (warning,) = [item for item in check_contact(scene) if "share" in item.message]
    assert str(warning).startswith(
        "field.toml:16: share: the shares of all classes sum to 1.0001; they are norm"
    )
    weight = build(scene).points.weight
    exact = Path("exact.toml")
    exact.write_text(FIELD)
    ratio = weight / build(load_scene(exact)).points.weight
    assert weight.sum() == pytest.approx(1.0, rel=1e-12)
    assert ratio.max() / ratio.min() == pytest.approx(0.7501 / 0.75, rel=1e-12)


def test_a_compare_scene_tells_the_faults_of_both_scenes(folder, changed, faults_of):
    Path("rig.toml").write_text(changed(RIG, ("load_kN = 80", "load_kN = 0")))
    Path("field.toml").write_text(changed(FIELD, ("share = 0.75", "share = 0.5")))
    result = faults_of(COMPARE)
    assert [fault.split(": ")[0] for fault in result] == [
        "rig.toml:15",
        "field.toml:16",
    ]


def test_a_compare_scene_names_one_scene_of_each_kind(folder, changed, faults_of):
    (fault,) = faults_of(
        changed(COMPARE, ('field = "field.toml"', 'field = "rig.toml"'))
    )
    assert (
        fault == 'scene.toml:5: field = "rig.toml" is a rig scene; name a field scene'
    )
    (fault,) = faults_of(changed(COMPARE, ('rig = "rig.toml"', 'rig = "compare.toml"')))
    assert fault.startswith('scene.toml:4: rig = "compare.toml" is a compare scene')
    (fault,) = faults_of(changed(COMPARE, ('rig = "rig.toml"', 'rig = "none.toml"')))
    assert fault.startswith('scene.toml:4: rig = "none.toml" does not exist')


def test_a_compare_scene_takes_nothing_else(folder, faults_of):
    (fault,) = faults_of(COMPARE + '[wheelset]\nprofile = "S1002"\n')
    assert fault.startswith(
        "scene.toml:6: unknown section [wheelset]: a compare scene holds"
    )


def test_what_deserves_a_second_look_is_a_warning(folder, changed):
    assert build(load_scene("rig.toml")).warnings == ()
    Path("scene.toml").write_text(
        RIG.replace("friction = 0.35", "friction = 0").replace(
            "friction = 0.3\n", "friction = 0\n"
        )
    )
    assert any(
        "nothing will wear" in line for line in build(load_scene("scene.toml")).warnings
    )
    Path("scene.toml").write_text(
        changed(
            FIELD,
            ("shift_std_mm = 2.5", "shift_std_mm = 2.5\npositions = 10"),
            ("2.5", "3.2"),
        )
    )
    climbing, positions = build(load_scene("scene.toml")).warnings
    assert climbing.startswith("scene.toml:12: shift_std_mm = 3.2")
    assert positions.startswith("scene.toml:13: positions = 10 lie 2.1 mm apart")


def test_warnings_in_results_name_the_scene_without_its_folder(folder, changed):
    Path("below").mkdir()
    Path("below/scene.toml").write_text(changed(RIG, ("shift_mm = 4", "shift_mm = 7")))
    scene = load_scene("below/scene.toml")
    (warning,) = build(scene).warnings
    assert warning.startswith("scene.toml:21: shift_mm = 7")
    assert [str(item) for item in warnings_of(scene)] == [f"below/{warning}"]


def test_warnings_of_a_copy_with_overrides_name_the_copy(folder, changed):
    """Its lines are not those of the file the user wrote."""
    Path("scene.toml").write_text(changed(RIG, ("shift_mm = 4", "shift_mm = 7")))
    scene = load_scene("scene.toml", overrides={"operation.block.1.load_kN": 81.0})
    (warning,) = build(scene).warnings
    assert warning.startswith("scene.toml:21: shift_mm = 7")
    copy = Path("scene/scene.toml")
    copy.parent.mkdir()
    copy.write_bytes(scene.origin.content)
    (warning,) = build(load_scene(copy)).warnings
    place, line, _ = warning.split(":", 2)
    assert place == "scene/scene.toml"
    assert copy.read_text().split("\n")[int(line) - 1] == "shift_mm = 7"


# both wheels, 0.35 x 80 kN x 0.46 m each; the second block carries less load and
# friction: 0.3 x 90 kN
@pytest.mark.parametrize("torque", [24841, -24841, 50000])
def test_a_torque_beyond_friction_is_told_with_the_state_that_carries_least(
    folder, faults_of, torque
):
    (fault,) = faults_of(RIG + f"[contact]\ntorque_Nm = {torque}\n")
    assert fault.startswith(
        f"scene.toml:{RIG.count(chr(10)) + 2}: torque_Nm = {torque} is more than "
        "friction"
    )
    assert (
        'in block "right": 2 x friction x wheel load x radius_mm = 2.484e+04 N m; lower'
        in fault
    )


@pytest.mark.parametrize("place", ["friction = 0.3\n", "friction = 0.35\n[campaign]"])
def test_a_torque_without_friction_is_told_in_blocks_and_watched_states(
    folder, faults_of, changed, place
):
    text = changed(RIG, (place, place.replace("= 0.3", "= 0.0")))
    (fault,) = faults_of(text.replace("= 0.05", "= 0") + "[contact]\ntorque_Nm = 1\n")
    assert ("[operation.monitor]" if "campaign" in place else 'block "right"') in fault


def test_a_torque_that_friction_carries_is_accepted_and_one_without_effect_is_warned_of(
    folder,
):
    Path("scene.toml").write_text(RIG + "[contact]\ntorque_Nm = 24839\n")
    assert warnings_of(load_scene("scene.toml")) == ()
    Path("scene.toml").write_text(
        RIG + '[contact]\ntorque_Nm = 50000\nrotation = "nominal"\n'
    )
    (warning,) = warnings_of(load_scene("scene.toml"))
    assert str(warning).startswith(
        f"scene.toml:{RIG.count(chr(10)) + 2}: torque_Nm = 50000 is without effect"
    )


@pytest.mark.parametrize(
    "name",
    [name for name, model in NORMAL_MODELS.items() if not model.can_update_profile],
)
@pytest.mark.parametrize("text", [RIG, FIELD], ids=["rig", "field"])
def test_a_normal_model_that_must_not_lead_a_campaign_is_told(
    folder, faults_of, monkeypatch, text, name
):
    record = replace(NORMAL_MODELS[name], solve=NORMAL_MODELS["kik_piotrowski"].solve)
    monkeypatch.setitem(NORMAL_MODELS, name, record)
    (fault,) = faults_of(text + f'[contact]\nnormal = "{name}"\n')
    assert fault.startswith(
        f'scene.toml:{text.count(chr(10)) + 2}: normal = "{name}" cannot update the '
        "profile in a campaign: "
    )
    assert 'normal = "kik_piotrowski"' in fault


LONG_BLOCKS = (
    ("distance_km = 1\n", "distance_km = 2000\n"),
    ("distance_km = 3\n", "distance_km = 6000\n"),
)


def test_a_campaign_shorter_than_its_programme_tells_which_shares_act(
    folder, changed, line_with
):
    """Blocks that never run would otherwise be missing without a word."""
    text = changed(RIG, *LONG_BLOCKS)
    for distance, shares in (
        ("4", '"left" 100 % (of the loop 25 %), "right" 0 % (of the loop 75 %)'),
        ("5000", '"left" 40 % (of the loop 25 %), "right" 60 % (of the loop 75 %)'),
    ):
        Path("scene.toml").write_text(
            changed(text, ("distance_km = 100", f"distance_km = {distance}"))
        )
        (warning,) = build(load_scene("scene.toml")).warnings
        assert warning.startswith(
            f"scene.toml:{line_with(text, 'distance_km = 100')}: distance_km = "
            f"{distance}"
        )
        assert "is less than one loop of the programme, 8000 km" in warning
        assert shares in warning
        assert "together = true" in warning
    Path("scene.toml").write_text(
        changed(text, ("distance_km = 100", "distance_km = 8000"))
    )
    assert build(load_scene("scene.toml")).warnings == ()


def test_blocks_weighed_together_all_act_in_every_step(folder, changed):
    text = changed(
        RIG,
        *LONG_BLOCKS,
        ("[operation.monitor]", "[operation]\ntogether = true\n[operation.monitor]"),
    )
    Path("scene.toml").write_text(text)
    setup = build(load_scene("scene.toml"))
    assert setup.warnings == ()
    assert setup.points.block_length.max() == 0.0
    assert setup.points.weight.tolist() == [0.25, 0.75, 0.0, 0.0, 0.0]
