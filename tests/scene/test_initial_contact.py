"""What only the contact of the new wheels tells about a scene, before it runs."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.contact.solve import solve
from wearsim.errors import SceneError
from wearsim.operation.points import select
from wearsim.scene import build, load_scene
from wearsim.scene.initial_contact import check_contact

RIG = (Path(__file__).parents[1] / "data/scene_rig.toml").read_text()


@pytest.mark.parametrize("key", ["cells", "strips"])
@pytest.mark.parametrize(
    "models",
    ['normal = "half_space"', 'tangential = "half_space"', 'model = "accurate"'],
)
def test_a_grid_too_coarse_for_any_model_of_the_scene_is_a_fault_of_the_key(
    folder, changed, key, models
):
    """The half-space needs 8 strips and cells, a fault before the run."""
    for count in (7, 8):
        grid = {"cells": 10, "strips": 10, key: count}
        keys = "".join(f"{name} = {value}\n" for name, value in grid.items())
        Path("scene.toml").write_text(RIG + f"[contact]\n{models}\n{keys}")
        if count == 8:
            assert check_contact(load_scene("scene.toml")) == ()
        else:
            with pytest.raises(
                SceneError,
                match=rf"toml:\d+: {key} = 7 must be at least 8 with half_space;",
            ):
                load_scene("scene.toml")


def rig(changed, *changes):
    return (
        changed(RIG, ("roll_mrad = 0.5\n", ""), *changes) + '[contact]\nroll = "free"\n'
    )


def test_a_wheelset_of_free_roll_rests_on_both_wheels_and_needs_no_warning(
    folder, changed
):
    """At 6.5 mm a level wheelset would be warned of (test_flange_climbing)."""
    Path("scene.toml").write_text(rig(changed, ("shift_mm = 4", "shift_mm = 6.5")))
    scene = load_scene("scene.toml")
    assert check_contact(scene) == ()
    setup = build(scene)
    conditions = setup.points.conditions
    assert conditions.free_roll
    assert conditions.shift.size == 5  # two blocks, three watched shifts
    solution = solve(conditions, setup.wheelset, setup.counterface, setup.models)
    at = np.searchsorted(solution.point, np.arange(5))
    assert -2e-3 < solution.roll[at[1]] < -1e-3
    assert abs(solution.roll[at[3]]) < 1e-10  # watched at zero shift
    # what campaigns solve are parts of these points
    part = select(setup.points, np.array([1]))
    again = solve(part.conditions, setup.wheelset, setup.counterface, setup.models)
    assert again.roll[0] == pytest.approx(
        solution.roll[at[1]], rel=1e-9
    )  # patches have less padding here


def test_a_wheelset_that_finds_no_rest_is_refused(
    folder, changed, line_with, monkeypatch
):
    """No shift that the clearance allows is known to have none: the search is made to
    fail.
    """
    text = rig(changed)
    Path("scene.toml").write_text(text)
    monkeypatch.setattr(
        "wearsim.contact.rough_axle.resting_roll",
        lambda _, roll, *__, **___: (roll, np.zeros(roll.size, bool)),
    )
    with pytest.raises(SceneError) as error_of:
        check_contact(load_scene("scene.toml"))
    assert len(error_of.value.faults) == 5
    first = str(error_of.value).splitlines()[0]
    assert first.startswith(
        f"scene.toml:{line_with(text, 'shift_mm = -3')}: shift_mm: at a shift of -3 mm"
    )
    assert (
        "the wheelset cannot carry its load: no roll of the wheelset lets both "
        "wheels carry"
    ) in first


@pytest.mark.parametrize("roll", ["given", "free"])
def test_every_block_whose_flange_locks_is_named_before_the_run(
    folder, changed, line_with, roll
):
    blocks = [
        "[[operation.block]]\n"
        f'name = "{name}"\nshift_mm = {shift}\nyaw_mrad = {yaw}\nload_kN = 80\n'
        "speed_km_h = 72\n"
        "friction = 0.5\ndistance_km = 1\n"
        for name, shift, yaw in (("right", 6.5, -60), ("left", -6.5, 60))
    ]
    text = (
        changed(RIG, ("roll_mrad = 0.5\n", ""))
        + f'[contact]\nroll = "{roll}"\n'
        + "".join(blocks)
    )
    Path("scene.toml").write_text(text)
    with pytest.raises(SceneError) as error_of:
        check_contact(load_scene("scene.toml"))
    first, second = (str(fault) for fault in error_of.value.faults)
    for fault, shift, wheel in ((first, "6.5", "right"), (second, "-6.5", "left")):
        assert fault.startswith(
            f"scene.toml:{line_with(text, f'shift_mm = {shift}')}: shift_mm: at a "
            "shift of"
        )
        assert f"the {wheel} wheel cannot carry its load: " in fault
        assert fault.count("creep forces lift the wheel") == 1
        assert fault.endswith("; lower friction, yaw or shift")


def test_free_and_given_roll_exclude_each_other(folder, faults_of):
    (fault,) = faults_of(RIG + '[contact]\nroll = "free"\n')
    assert fault.startswith("scene.toml:14: roll_mrad = 0.5 and roll =")


@pytest.mark.parametrize(
    "key", ["youngs_wheel_GPa = 200", "poisson_rail = 0.25", "youngs_roller_GPa = 190"]
)
def test_unequal_elastic_constants_are_refused_with_the_reason(folder, faults_of, key):
    (fault,) = faults_of(RIG + f"[contact]\n{key}\n")
    assert (
        f"unknown key {key.split()[0]} in [contact]: wheel and counterface share one"
        in fault
    )
