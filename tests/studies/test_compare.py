"""Two campaigns of any kind, or two scenes, side by side."""

import copy

import numpy as np
import pytest

import wearsim

RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
SCENE = {
    "scene": {"kind": "rig"},
    "wheelset": {"profile": "S1002"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "contact": {"model": "fast", "strips": 10, "cells": 10},
    "operation": {
        "block": [
            {"name": "middle", "shift_mm": 0, "distance_km": 3, **RUNNING},
            {"name": "right", "shift_mm": 3, "distance_km": 1, **RUNNING},
        ]
    },
    "campaign": {"distance_km": 4},
}


@pytest.fixture(scope="module")
def files(tmp_path_factory, write_campaign):
    """Two rigs: 6 steps of 20 nm/km, 9 steps of 8 nm/km."""
    folder = tmp_path_factory.mktemp("compared")
    (folder / "one").mkdir()
    (folder / "two").mkdir()
    return (
        write_campaign(folder / "one" / "rig.nc", "rig", 6, 20e-9),
        write_campaign(folder / "two" / "rig.nc", "rig", 9, 8e-9),
    )


def test_two_rigs_at_equal_distance_and_depth_are_the_states_there(files):
    both = wearsim.compare(*files)
    worn = wearsim.open_results(files[0]), wearsim.open_results(files[1])
    end = min(float(data["distance"][-1]) for data in worn)
    for name, data in zip(("a", "b"), worn, strict=True):
        state = wearsim.at_distance(data.load(), end)
        same = both.sel(campaign=name, basis="equal distance").isel(progress=-1)
        assert float(same["distance_run"]) == end
        for wheel in ("right", "left"):
            for measure in ("max_wear_depth", "worn_area"):
                expected = float(state[measure].sel(wheel=wheel))
                assert float(same[measure].sel(wheel_group=wheel)) == pytest.approx(
                    expected, rel=1e-12
                )
    depth = both["max_wear_depth"].sel(basis="equal worn depth", wheel_group="both")
    np.testing.assert_allclose(
        depth.sel(campaign="a"), depth.sel(campaign="b"), rtol=1e-12
    )
    ratio = both["worn_area_factor"].sel(basis="equal distance", wheel_group="both")[1:]
    area = both["worn_area"].sel(basis="equal distance", wheel_group="both")[1:]
    np.testing.assert_allclose(
        ratio, area.sel(campaign="a") / area.sel(campaign="b"), rtol=1e-12
    )
    assert {
        "flange_height_change",
        "flange_thickness_change",
        "flange_gradient_change",
    } <= set(both)
    assert {"power_collective", "power_point"} <= set(both)


def test_rig_against_field_has_the_numbers_of_translate_and_no_word_of_them(
    files, tmp_path, write_campaign
):
    field = write_campaign(tmp_path / "field.nc", "field", 9, 8e-9)
    both, known = wearsim.compare(files[0], field), wearsim.translate(files[0], field)
    for name, values in known.data_vars.items():
        if name in both and values.dtype.kind == "f":
            np.testing.assert_array_equal(both[name], values, err_msg=str(name))
    texts = [
        str(value) for one in both.variables.values() for value in one.attrs.values()
    ]
    texts += [str(name) for name in both.variables]
    texts += [
        text for key, text in both.attrs.items() if key in ("comment", "warnings")
    ]
    assert [
        text for text in texts if "rig" in text.split() or "field" in text.split("_")
    ] == []


def test_the_settings_that_differ_are_named_with_the_names_of_the_campaigns(files):
    one, other = (wearsim.open_results(path).load() for path in files)
    other = other.assign_attrs(wheel_radius=0.42)
    both = wearsim.compare(one, other, names=("large", "small"))
    assert (
        "wheel radius differs: 0.46 m in large, 0.42 m in small"
        in both.attrs["warnings"].splitlines()
    )
    assert both["campaign"].values.tolist() == ["large", "small"]
    assert (
        both["power_collective_factor"].attrs["long_name"].endswith("large over small")
    )


def test_a_campaign_against_itself_has_ratios_of_one(files):
    both = wearsim.compare(files[0], files[0])
    ratio = both["max_wear_depth_factor"].isel(progress=-1)
    np.testing.assert_allclose(ratio, 1.0, rtol=1e-12)


def test_reprofiled_wheels_are_compared_at_equal_distance_alone(files):
    one, other = (wearsim.open_results(path).load() for path in files)
    last = np.zeros(other.sizes["step"], dtype=np.int64)
    last[4:] = 4
    other = other.assign(last_reprofiling=("step", last))
    assert wearsim.compare(one, other)["basis"].values.tolist() == ["equal distance"]


def test_scenes_are_compared_on_new_wheels():
    """A larger roller wears less; rates are those of `wear_rate`, weighted by the
    distance of the blocks.
    """
    large = copy.deepcopy(SCENE)
    large["counterface"]["roller_radius_mm"] = 3000
    both = wearsim.compare(SCENE, large, names=("small", "large"))
    assert float(both["wear_area_rate_collective_factor"].sel(wheel_group="both")) > 1.0
    rate = wearsim.wear_rate(SCENE)
    share = np.array([0.75, 0.25])
    for wheel in ("right", "left"):
        of = {"campaign": "small", "wheel_group": wheel}
        power = share @ rate["power"].sel(wheel=wheel).values
        assert float(both["power_collective"].sel(of)) == pytest.approx(
            power, rel=1e-12
        )
        depth = (
            share @ rate["wear_depth_rate"].sel(wheel=wheel).sum("regime").values
        ).max()
        assert float(both["wear_depth_rate"].sel(of)) == pytest.approx(depth, rel=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "options", "message"),
    [
        (
            SCENE,
            "rig.nc",
            {},
            "one is a result and the other a scene; give two results or two scenes$",
        ),
        (
            3,
            SCENE,
            {},
            "3 is neither a result nor a scene; give a file, a Dataset or a scene$",
        ),
        ("none.nc", "none.nc", {}, "none.nc"),
        (
            SCENE,
            SCENE,
            {"names": ("a", "a")},
            r"names = \('a', 'a'\) must be two words",
        ),
        (SCENE, SCENE, {"names": ("fast one", "b")}, "must be two words"),
        (SCENE, {"scene": {"kind": "rig"}}, {}, r"key profile is missing|missing"),
    ],
)
def test_what_cannot_be_compared_is_an_error(a, b, options, message):
    with pytest.raises(wearsim.WearsimError, match=message):
        wearsim.compare(a, b, **options)
