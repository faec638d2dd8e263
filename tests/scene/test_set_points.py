"""Set-points of a rig programme: ranges, limits of rigs, what is refused."""

import numpy as np
import pytest

from wearsim.errors import SceneError
from wearsim.scene import load_scene
from wearsim.scene.set_points import set_points

RUNNING = {"load_kN": 50, "speed_km_h": 72, "friction": 0.35, "distance_km": 1}
RIG = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {
        "profile": "60E1",
        "inclination": "1:40",
        "rig": "full_scale",
    },
    "operation": {"block": [{"name": "a", "shift_mm": 0, **RUNNING}]},
    "campaign": {"distance_km": 1},
}


def loaded(programme=None, rig=None, blocks=()):
    tables = RIG | ({} if programme is None else {"programme": programme})
    if rig is not None:
        tables["counterface"] = RIG["counterface"] | {"rig": str(rig)}
    own = RIG["operation"]["block"]
    return load_scene(tables | {"operation": {"block": [*own, *blocks]}})


@pytest.fixture
def small_rig(tmp_path):
    """Rig of few actuators with narrow limits."""
    path = tmp_path / "small.toml"
    path.write_text(
        'name = "small"\nsource = "made up"\nroller_radius_mm = 500\n'
        'drive = "coupled"\ncontrolled = ["shift_mm", "load_kN"]\n'
        "[limits]\nshift_mm = 2.2\nload_kN = 60\nspeed_km_h = 80\n"
    )
    return path


def test_by_default_shifts_end_at_the_flange_and_ramps_keep_within():
    found = set_points(loaded())
    assert found.limits == ("flange", "scene", "scene")
    assert found.step == pytest.approx(0.4e-3)
    assert found.lateral[-1] + 0.5 * found.step <= 6.7e-3
    np.testing.assert_allclose(found.lateral, -found.lateral[::-1], atol=1e-12)
    assert (found.speed, found.friction) == (pytest.approx(20.0), 0.35)


def test_a_rig_limits_the_defaults_and_fixes_what_it_does_not_control(small_rig):
    found = set_points(loaded(rig=small_rig))
    assert found.limits == ("rig", "rig", "rig")
    assert found.lateral[-1] + 0.5 * found.step == pytest.approx(2.2e-3)
    assert found.yaw.tolist() == [0.0]
    assert found.load.max() == 50e3


def test_what_is_stated_beyond_the_rig_is_refused_all_at_once(small_rig):
    stated = {"shift_mm": 5, "yaws_mrad": [0, 1], "loads_kN": [50, 80]}
    stated |= {"speed_km_h": 100}
    with pytest.raises(SceneError) as caught:
        set_points(loaded(stated, small_rig))
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    for key in ("shift_mm", "loads_kN", "speed_km_h"):
        assert any(key in line and "limit is" in line for line in lines)
    assert any("does not control yaw_mrad" in line for line in lines)


def test_blocks_of_unlike_friction_need_one_for_the_programme():
    other = [{"name": "b", "shift_mm": 1, **RUNNING, "friction": 0.2}]
    with pytest.raises(SceneError, match=r"give friction in \[programme\]"):
        set_points(loaded(blocks=other))
    assert set_points(loaded({"friction": 0.3}, blocks=other)).friction == 0.3


def test_blocks_of_unlike_environment_are_refused():
    other = [{"name": "b", "shift_mm": 1, **RUNNING, "environment": 0.5}]
    with pytest.raises(SceneError, match="several environment factors"):
        set_points(loaded(blocks=other))


def test_a_rig_that_controls_forces_alone_has_set_points_by_force(tmp_path):
    path = tmp_path / "force.toml"
    path.write_text(
        'name = "force"\nsource = "made up"\nroller_radius_mm = 500\n'
        'drive = "coupled"\ncontrolled = ["lateral_force_kN", "load_kN"]\n'
        "[limits]\nlateral_force_kN = 25\n"
    )
    block = {**RUNNING, "name": "a", "lateral_force_kN": 0}
    tables = RIG | {"operation": {"block": [block]}}
    tables["counterface"] = RIG["counterface"] | {"rig": str(path)}
    found = set_points(load_scene(tables))
    assert found.by_force
    assert found.lateral.tolist() == [-20e3, -10e3, 0.0, 10e3, 20e3]
    with pytest.raises(SceneError, match="lateral_force_kN holds 30, beyond the rig"):
        set_points(load_scene(tables | {"programme": {"lateral_force_kN": 30}}))
    with pytest.raises(SceneError, match="exclude each other"):
        loaded({"lateral_force_kN": 20, "shift_mm": 4})


def test_blocks_of_unlike_torque_are_refused():
    other = [{"name": "b", "shift_mm": 1, **RUNNING, "axle_torque_kN_m": 1}]
    with pytest.raises(SceneError, match="several axle_torque_kN_m"):
        set_points(loaded(blocks=other))


def test_a_guard_below_the_field_is_refused():
    with pytest.raises(SceneError, match=r"guard = 0.5 .* write 1 or more, or 0"):
        loaded({"guard": 0.5})
