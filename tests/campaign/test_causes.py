"""Causes of a factor: what must cancel, what must multiply, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import wearsim
from wearsim.campaign.causes import (
    BODY_CAUSES,
    NoSplitError,
    add_causes,
    area_rates,
    shapley,
    split,
    split_power,
    world_of,
)
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.run import run_evolution, run_scene
from wearsim.contact.solve import solve
from wearsim.operation.states import BeyondJump
from wearsim.report.html import write_report
from wearsim.results import load_results, open_results
from wearsim.scene import build, load_scene
from wearsim.scene.damage import BrakeBlockSection
from wearsim.translation.translate import translate

MODELS = wearsim.ContactModels.of("fast", strips=30, cells=30)
BLOCKS = (
    {"shift_mm": -2, "yaw_mrad": -1, "distance_km": 2},
    {"shift_mm": 3, "distance_km": 1},
)
CLASSES = (
    {
        "shift_mean_mm": 0.5,
        "shift_std_mm": 1,
        "positions": 10,
        "share": 1,
        "environment": 0.2,
        "curve_radius_m": 2000,
    },
)


@pytest.fixture
def made(tmp_path, scene_text):
    """Function that gives setup and world of new wheels of a scene."""

    def world(*running, **options):
        path = tmp_path / "scene.toml"
        path.write_text(scene_text(*running, **options))
        setup = build(load_scene(path))
        return setup, world_of(setup)

    return world


def test_shares_add_up_and_do_not_know_the_order():
    """Three groups, two of which only act together: they share what they do in
    halves.
    """
    value = np.array([float(k & 1) * 2.0 + 3.0 * (k & 6 == 6) for k in range(8)])
    np.testing.assert_allclose(shapley(value), [2.0, 1.5, 1.5], rtol=1e-14)
    rng = np.random.default_rng(3)
    value = rng.normal(size=16)
    swapped = value[[(k & 12) | (k & 1) << 1 | (k & 2) >> 1 for k in range(16)]]
    np.testing.assert_allclose(
        shapley(swapped), shapley(value)[[1, 0, 2, 3]], rtol=1e-12
    )
    assert shapley(value).sum() == pytest.approx(value[-1] - value[0], rel=1e-12)


def test_worlds_that_do_not_differ_have_no_causes(made):
    _, rig = made(*BLOCKS)
    causes, factor = split(rig, rig)
    assert causes == {}
    assert factor[0] == 1.0


def test_a_single_cause_is_the_factor(made):
    _, rig = made(*BLOCKS)
    _, field = made(*({**block, "environment": 0.2} for block in BLOCKS))
    causes, factor = split(rig, field)
    assert list(causes) == ["environment"]
    # of the whole wheel and of each zone that wears
    assert np.isfinite(factor).sum() >= 2
    for value in (causes["environment"], factor):
        np.testing.assert_allclose(value[np.isfinite(factor)], 5.0, rtol=1e-12)


def test_causes_multiply_to_the_factor_and_turn_over_with_the_worlds(made):
    """Blocks against positions, roller against rail, tangent against curve; the
    environment acts alone.
    """
    _, rig = made(*BLOCKS)
    _, field = made(*CLASSES, kind="field")
    causes, factor = split(rig, field)
    assert list(causes) == [
        "roller curvature: contact patch",
        "roller curvature: creepage",
        "positions (shift and yaw)",
        "path curvature (wheelset)",
        "environment",
    ]
    np.testing.assert_allclose(
        np.prod(list(causes.values()), axis=0), factor, rtol=1e-12
    )
    # all causes are the rig as it is, none the field: merged and exchanged points lose
    # nothing
    assert factor[0] == pytest.approx(
        area_rates(rig)[0] / area_rates(field)[0], rel=1e-9
    )
    assert causes["environment"][0] == pytest.approx(5.0, rel=1e-12)
    back, _ = split(field, rig)
    np.testing.assert_allclose(
        [back[name][0] * causes[name][0] for name in causes], 1.0, rtol=1e-12
    )


def test_a_roller_without_curvature_is_no_cause(made):
    """A rail is a roller of zero curvature: what is left of 1e-9 1/m is below 1e-6 of
    the factor.
    """
    _, rail = made(*BLOCKS)
    rail, nearly = (
        replace(rail, parts=rail.parts | dict.fromkeys(BODY_CAUSES[:2], curvature))
        for curvature in (0.0, 1e-9)
    )
    causes, factor = split(nearly, rail)
    assert len(causes) == 2
    np.testing.assert_allclose(
        [one[0] for one in (*causes.values(), factor)], 1.0, rtol=0.0, atol=1e-6
    )


def test_the_curvature_of_the_creepage_acts_on_the_creepage_alone(made):
    setup, _ = made(*BLOCKS)
    rig, conditions = setup.counterface, setup.points.conditions
    same = solve(
        conditions,
        setup.wheelset,
        replace(rig, rolling_curvature=rig.curvature),
        setup.models,
    )
    whole = solve(conditions, setup.wheelset, rig, setup.models)
    for name in ("normal_force", "creepage_x", "spin", "power"):
        np.testing.assert_array_equal(getattr(same, name), getattr(whole, name))
    rail = solve(
        conditions, setup.wheelset, replace(rig, rolling_curvature=0.0), setup.models
    )
    # the patch differs only by the load that creep forces carry
    np.testing.assert_allclose(rail.area, whole.area, rtol=0.02)
    assert np.abs(rail.spin / whole.spin - 1.0).max() > 0.05


def bodies(radius, models=MODELS):
    """Wheelset, counterface and models; rails of no radius."""
    rail = wearsim.rails("60E1", inclination=1 / 40, gauge=1.435)
    counterface = rail if radius is None else replace(rail, curvature=1.0 / radius)
    return wearsim.wheelset("S1002", radius=0.46), counterface, models


def test_the_power_of_the_paper_is_patch_and_creepages():
    """Table 5 of Liu & Bruni: 1.61 and 2.78 times the rail's power in the middle, 1.39
    and 1.84 at 3 mm.

    Ours differ from theirs as the seed report shows (their wheel is not free); what
    makes them up: in the middle spin, 1 + r0/s0 times as large, at 3 mm longitudinal
    creepage, and everywhere a smaller patch.
    """
    conditions = wearsim.ContactConditions.of([0.0, 3e-3], friction=0.35)
    for radius, paper in ((1.0, (1.61, 1.39)), (0.5, (2.78, 1.84))):
        causes, factor = split_power(conditions, bodies(radius), bodies(None))
        np.testing.assert_allclose(causes.prod(axis=-1), factor, rtol=1e-12)
        np.testing.assert_allclose(factor[:, 0], paper, rtol=0.2)
        whole = [solve(conditions, *one) for one in (bodies(radius), bodies(None))]
        ratio = whole[0].power / whole[1].power
        np.testing.assert_allclose(
            factor.ravel(), ratio, rtol=2e-6
        )  # of the load balance of both
        patch, longitudinal, lateral, spin = causes[:, 0].T
        assert (patch < 1.0).all()
        np.testing.assert_allclose(lateral, 1.0, atol=0.02)
        assert spin[0] > 1.5 > 1.01 > abs(longitudinal[0])
        assert longitudinal[1] > 1.2 > spin[1]


def test_saturated_power_in_the_hertzian_limit_is_the_creepage(tmp_path):
    """Full slip, longitudinal creepage alone: power mu N V xi, so that the patch is no
    cause (spec 6.2).
    """
    conditions = wearsim.ContactConditions.of([0.0], friction=0.1)
    rig, field = bodies(0.5), bodies(None)
    slipping = replace(
        conditions, rotation="nominal", creepage=np.array([[0.05, 0.0, 0.0]])
    )
    power = [float(solve(slipping, *one, sides=(0,)).power[0]) for one in (rig, field)]
    assert power[0] == pytest.approx(power[1], rel=2e-3)
    assert power[1] == pytest.approx(0.1 * 80e3 * 20.0 * 0.05, rel=0.02)


def test_equal_bodies_have_no_causes():
    conditions = wearsim.ContactConditions.of([0.0, 2e-3, 8e-3], friction=0.3)
    causes, factor = split_power(conditions, bodies(1.0), bodies(1.0))
    single = np.isfinite(factor)
    assert single.sum() >= 4
    np.testing.assert_allclose(causes[single], 1.0, rtol=1e-9)
    np.testing.assert_allclose(factor[single], 1.0, rtol=1e-9)


def test_what_cannot_be_split_says_why(made):
    setup, rig = made(*BLOCKS)
    brake = BrakeBlockSection(um_per_1000_km=10.0, from_mm=-20.0, to_mm=30.0)
    with pytest.raises(NoSplitError, match="brake blocks"):
        world_of(replace(setup, brake=brake))
    jump = BeyondJump(np.array([0]), np.array([-2e-3]), np.array([0.5]))
    with pytest.raises(NoSplitError, match="both sides of a jump"):
        world_of(replace(setup, points=replace(setup.points, beyond=jump)))
    _, nominal = made(*BLOCKS, contact='strips = 12\ncells = 12\nrotation = "nominal"')
    with pytest.raises(NoSplitError, match="different rules"):
        split(rig, nominal)
    far = replace(rig, values=rig.values + np.eye(1, rig.values.shape[1]) * 90e-3)
    with pytest.raises(NoSplitError, match="no contact solution"):
        split(far, rig)


def test_the_state_at_a_station_is_between_the_stored_ones(made):
    """Worn by 0.4 mm in 40 km: 0.1 mm after 10 km; positions that are held keep their
    bits.
    """
    setup, new = made(*BLOCKS)
    wheels = new.parts["wheel profile"].right, new.parts["wheel profile"].left
    y, z = (np.stack([getattr(wheel, axis) for wheel in wheels]) for axis in "yz")
    shift, loads = setup.points.conditions.shift, setup.points.conditions.loads
    points = ("step", "operating_point")
    result = xr.Dataset(
        {
            "distance": ("step", [0.0, 40e3]),
            "n_patch": (points, np.full((2, shift.size), 2)),
            "profile_y": (("step", "wheel", "point"), np.stack([y, y])),
            "profile_z": (("step", "wheel", "point"), np.stack([z, z - 0.4e-3])),
            "lateral_position": (points, np.stack([shift, shift])),
            "wheelset_yaw": (
                points,
                np.stack([np.zeros_like(shift), 1e-3 + np.zeros_like(shift)]),
            ),
            "wheelset_roll": (points, np.zeros((2, shift.size))),
            "wheel_loads": ((*points, "wheel"), np.stack([loads, loads])),
        }
    )
    world = world_of(setup, result, 10e3)
    np.testing.assert_allclose(
        world.parts["wheel profile"].right.z, z[0] - 0.1e-3, rtol=0.0, atol=1e-12
    )
    np.testing.assert_array_equal(world.values[:, 0], new.values[:, 0])
    np.testing.assert_allclose(world.values[:, 1], 0.25e-3, rtol=1e-12)


@pytest.mark.slow
def test_the_profile_is_no_cause_between_a_rail_and_rollers_of_100_m(
    tmp_path, scene_text
):
    """They wear alike, in unlike steps: 0.3 % was made by taking the stored state
    before the station.
    """
    setups, results = [], []
    for name, environment, distance in (("rig", 1.0, 60), ("field", 0.2, 300)):
        blocks = ({**block, "environment": environment} for block in BLOCKS)
        campaign = (
            f"point_spacing_mm = 0.5\nerror_tolerance_um = 3\ndistance_km = {distance}"
        )
        (tmp_path / "rig.toml").write_text(scene_text(*blocks, campaign=campaign))
        setup = build(load_scene(tmp_path / "rig.toml"))
        curvature = 1e-2 if name == "rig" else 0.0
        setups.append(
            replace(setup, counterface=replace(setup.counterface, curvature=curvature))
        )
        results.append(
            load_results(run_evolution(WheelsetEvolution(setups[-1]), tmp_path, name))
        )
    found = add_causes(translate(*results), setups, results)
    names = list(found["cause_name"].values)
    assert names == [*BODY_CAUSES[:2], "wheel profile", "environment"]
    profile = found["cause_factor"].values[:, names.index("wheel profile")]
    np.testing.assert_allclose(profile, 1.0, rtol=0.0, atol=5e-4)
    np.testing.assert_allclose(
        found["cause_factor"].prod("cause"), found["rate_factor"], rtol=1e-9
    )
    # in stored states the rate is the stored one
    for setup, result in zip(setups, results, strict=True):
        stored = (
            result["wear_area_rate"][-1].sum("patch")
            * result["weight"]
            * result["environment"]
        )
        there = world_of(setup, result, float(result["distance"][-1]))
        assert area_rates(there)[0] == pytest.approx(float(stored.sum()), rel=1e-9)


def test_a_comparison_keeps_its_causes_and_shows_them(tmp_path, scene_text):
    campaign = "distance_km = 3\npoint_spacing_mm = 0.5"
    (tmp_path / "rig.toml").write_text(scene_text(*BLOCKS, campaign=campaign))
    (tmp_path / "field.toml").write_text(
        scene_text(*CLASSES, kind="field", campaign=campaign)
    )
    text = (
        '[scene]\nkind = "compare"\n[compare]\nrig = "rig.toml"\n'
        'field = "field.toml"\ncauses = true\n'
    )
    (tmp_path / "compare.toml").write_text(text)
    paths = run_scene(tmp_path / "compare.toml", tmp_path / "out")
    written = paths[2].read_bytes()
    with open_results(paths[0]) as rig, open_results(paths[1]) as field:
        setups = [
            build(load_scene(tmp_path / f"{name}.toml")) for name in ("rig", "field")
        ]
        found = add_causes(translate(rig, field), setups, (rig, field))
        # the first rate is that of the result files: the wear of the new wheels, before
        # smoothing
        rate = [
            float(
                (
                    data["wear_area_rate"][0].sum("patch")
                    * data["weight"]
                    * data["environment"]
                ).sum()
            )
            for data in (rig, field)
        ]
    assert found["rate_factor"].values[0] == pytest.approx(rate[0] / rate[1], rel=1e-9)
    np.testing.assert_allclose(
        found["cause_factor"].prod("cause"), found["rate_factor"], rtol=1e-12
    )
    np.testing.assert_allclose(
        found["cause_zone_factor"].prod("cause", skipna=False),
        found["rate_zone_factor"],
    )
    run_scene(tmp_path / "compare.toml", tmp_path / "out")
    assert paths[2].read_bytes() == written
    page = write_report(tmp_path / "out").read_text()
    for name in found["cause_name"].values:
        assert name[1:] in page
    assert 'id="figure-main_causes"' in page
