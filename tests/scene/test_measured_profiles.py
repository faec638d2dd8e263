"""Measured profiles in scenes: smoothing, noise that would decide the contact,
diameters of headers.
"""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.run import run_scene
from wearsim.contact.solve import solve
from wearsim.errors import SceneError
from wearsim.profile.files import load_profile, read_profile, write_profile
from wearsim.profile.shape import resample, vertex_normals
from wearsim.profile.smoothing import smoothed
from wearsim.profile.standard import rail, wheel
from wearsim.scene import build, load_scene
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.setup import warnings_of

ROOT = Path(__file__).parents[2]
RIG = (ROOT / "tests/data/scene_rig.toml").read_text()
MEASURED = ROOT / "profiles/measured"
SPACING = 0.3e-3


def measured(name, sigma, seed=0, shape=None, header=""):
    """Write a file of points with white noise; an instrument gives them every 0.3
    mm.
    """
    even = resample(wheel("S1002") if shape is None else shape, SPACING)
    normal_y, normal_z = vertex_normals(even.y, even.z)
    error = sigma * np.random.default_rng(seed).standard_normal(even.y.size)
    noisy = replace(even, y=even.y + normal_y * error, z=even.z + normal_z * error)
    write_profile(noisy, name, "miniprof", overwrite=True)
    Path(name).write_text(header + Path(name).read_text())


def scene_of(changed, keys="", **profiles):
    """Scene with files as profiles, and further keys of [wheelset]."""
    text = RIG
    for old, name in profiles.items():
        text = changed(text, (f'profile = "{old}"', f'profile = "{name}"'))
    Path("scene.toml").write_text(
        changed(text, ("[counterface]\n", f"{keys}[counterface]\n"))
    )
    return load_scene("scene.toml")


def test_smooth_mm_acts_on_both_wheels_and_on_the_counterface(folder, changed):
    measured("right.whl", 3e-6, 1)
    measured("left.whl", 3e-6, 2)
    measured("rail.ban", 3e-6, 3, rail("60E1", 0.0, 1.435, 0.75))
    keys = 'profile_left = "left.whl"\nsmooth_mm = 4\n'
    scene = scene_of(changed, keys, S1002="right.whl", **{"60E1": "rail.ban"})
    text = changed(
        Path("scene.toml").read_text(),
        ("[counterface]\n", "[counterface]\nsmooth_mm = 3\n"),
    )
    Path("scene.toml").write_text(text)
    rough, scene = scene, load_scene("scene.toml")
    setup = build(scene)
    wheels = setup.wheelset.right, setup.wheelset.left
    for name, ours in zip(("right.whl", "left.whl"), wheels, strict=True):
        expected = resample(
            smoothed(read_profile(name, "wheel").profile, 4e-3), 0.25e-3
        )
        assert np.array_equal(ours.z[:50], expected.z[:50])
    bend = [np.diff(build(one).counterface.profile.z, 2) for one in (rough, scene)]
    middle = slice(100, -100)
    assert np.std(bend[1][middle]) < 0.2 * np.std(bend[0][middle])
    assert warnings_of(scene) == ()


def test_smoothing_of_drawn_profiles_is_without_effect_and_said_to_be(folder, changed):
    scene = scene_of(changed, "smooth_mm = 4\n")
    (warning,) = warnings_of(scene)
    assert "smooth_mm is without effect: no profile of [wheelset]" in str(warning)
    plain = build(scene_of(changed))
    assert np.array_equal(build(scene).wheelset.right.z, plain.wheelset.right.z)


def test_the_diameter_of_the_header_acts_where_the_scene_gives_no_radius(
    folder, changed
):
    for side, diameter in (("right", 912.0), ("left", 911.0)):
        measured(f"{side}.whl", 1e-6, header=f"DiameterTaperline={diameter}\n")
    right = {"S1002": "right.whl"}
    scene = scene_of(changed, "", **right)
    assert build(scene).wheelset.radius == pytest.approx(0.456, abs=1e-12)
    assert warnings_of(scene) == ()
    scene = scene_of(changed, "radius_mm = 460\n", **right)
    assert build(scene).wheelset.radius == 0.46
    (warning,) = warnings_of(scene)
    assert (
        "radius_mm = 460 is a diameter of 920 mm, the header says 912 mm (right.whl)"
        in str(warning)
    )
    assert warnings_of(scene_of(changed, "radius_mm = 456\n", **right)) == ()
    scene = scene_of(changed, 'profile_left = "left.whl"\n', **right)
    assert build(scene).wheelset.radius == pytest.approx(0.45575, abs=1e-12)
    (warning,) = warnings_of(scene)
    assert "912 mm (right.whl) and 911 mm (left.whl)" in str(warning)


@pytest.mark.parametrize(
    ("sigma", "seed"),
    [
        (10e-6, 0),
        *(pytest.param(10e-6, seed, marks=pytest.mark.slow) for seed in (1, 2, 3, 4)),
    ],
)
def test_noise_that_decides_the_contact_is_refused_with_its_cure(
    folder, changed, sigma, seed
):
    measured("noisy.whl", sigma, seed)
    noisy = {"S1002": "noisy.whl"}
    with pytest.raises(SceneError) as caught:
        check_contact(scene_of(changed, **noisy))
    (fault,) = caught.value.faults
    text = str(fault)
    # two thirds of the variance of white noise at 0.3 mm lie below 2 mm
    assert float(re.search(r"noise of (\S+) um rms", text)[1]) == pytest.approx(
        7.0, abs=2.5
    )
    cure = re.search(r"write (smooth_mm = \S+) in \[wheelset\]", text)[1]
    assert re.search(r"moves the tread by up to (2|3|4)\d um and the flange by", text)
    check_contact(scene_of(changed, f"{cure}\n", **noisy))


@pytest.mark.parametrize("sigma", [1e-6, pytest.param(2e-6, marks=pytest.mark.slow)])
def test_noise_of_good_instruments_passes(folder, changed, sigma):
    measured("fine.whl", sigma)
    check_contact(scene_of(changed, S1002="fine.whl"))


def test_measured_examples_pass(folder, changed):
    keys = f'profile_left = "{MEASURED}/wheel_worn_left.whl"\n'
    changes = {
        "S1002": MEASURED / "wheel_worn_right.whl",
        "60E1": MEASURED / "rail_worn_outer.ban",
    }
    check_contact(scene_of(changed, keys, **changes))


def test_noise_of_the_counterface_is_refused_under_its_key_by_whoever_runs_it(
    folder, changed
):
    measured("rail.ban", 10e-6, 3, rail("60E1", 0.0, 1.435, 0.75))
    scene = scene_of(changed, **{"60E1": "rail.ban"})
    cure = r"write smooth_mm = \S+ in \[counterface\], which moves the profile"
    tables = tomllib.loads(Path("scene.toml").read_text())
    for given, place in (
        (scene, r"scene\.toml:\d+: "),
        (tables, r"counterface\.profile: "),
    ):
        with pytest.raises(SceneError, match=f"^{place}.*{cure}"):
            run_scene(given, "out")
    assert not Path("out").exists()


def test_part_of_a_roller_is_enough_where_the_contact_lies_inside(folder, changed):
    """15 mm around the contacts of both wheels give that of the whole head; 9 mm
    further there is none.
    """
    whole = rail("60E1", 1.0 / 40.0, 1.435, 0.75, 0.1e-3)
    blocks = RIG[RIG.index("[[operation.block]]") : RIG.index("[campaign]")]
    block = (
        '[[operation.block]]\nname = "a"\nshift_mm = 0\nyaw_mrad = 4\nload_kN = 4\n'
        "speed_km_h = 36\nfriction = 0.3\ndistance_km = 1\n"
    )
    one = changed(RIG, (blocks, block), ('profile = "S1002"', 'profile = "cone"'))
    Path("scene.toml").write_text(one)
    expected = solve_scene(load_scene("scene.toml"))
    part = changed(one, ('"60E1"', '"part.csv"'), ('"1:40"', '"none"'))
    Path("scene.toml").write_text(part)
    centre = float(expected.rail_y.mean())
    for off, inside in ((0.0, True), (9e-3, False)):
        near = np.abs(whole.y - centre - off) < 7.5e-3
        write_profile(
            replace(whole, y=whole.y[near], z=whole.z[near]), "part.csv", overwrite=True
        )
        scene = load_scene("scene.toml")
        if not inside:
            with pytest.raises(
                SceneError, match="the contact patch reaches the edge of a profile"
            ):
                check_contact(scene)
            continue
        (warning,) = check_contact(scene)
        assert (
            'profile = "part.csv" is 14.8 mm wide: without gauge point its y '
            "counts from"
        ) in str(warning)
        ours = solve_scene(scene)
        # the curves are splines through other points near their ends only
        assert ours.rail_y == pytest.approx(expected.rail_y, abs=2e-5)
        assert ours.max_pressure == pytest.approx(expected.max_pressure, rel=2e-3)


def solve_scene(scene):
    """Solution of all operating points of a scene."""
    setup = build(scene)
    return solve(
        setup.points.conditions, setup.wheelset, setup.counterface, setup.models
    )


@pytest.mark.parametrize("name", ["60E1", "head.csv"])
def test_the_gauge_height_of_a_scene_places_shipped_and_measured_rails(
    name, folder, changed
):
    write_profile(rail("60E1", 0.0, 1.435, 0.75), "head.csv")
    profiles = [build(scene_of(changed, **{"60E1": name})).counterface.profile]
    text = changed(
        Path("scene.toml").read_text(),
        ("[counterface]\n", "[counterface]\ngauge_height_mm = 15.875\n"),
    )
    Path("scene.toml").write_text(text)
    profiles.append(build(load_scene("scene.toml")).counterface.profile)
    expected = [
        rail("60E1", 1 / 40, 1.435, 0.75, gauge_height=height).y[0]
        for height in (14e-3, 15.875e-3)
    ]
    assert np.ptp(profiles[1].y - profiles[0].y) < 1e-12
    assert profiles[1].y[0] - profiles[0].y[0] == pytest.approx(
        np.diff(expected)[0], abs=1e-6
    )  # chords
    Path("scene.toml").write_text(changed(text, ("15.875", "50")))
    with pytest.raises(
        SceneError, match="gauge_height_mm = 50 must be at least 5 and at most 25 mm"
    ):
        load_scene("scene.toml")


def test_a_head_that_leans_as_measured_is_not_tilted_again(folder, changed):
    """As for `wearsim contact` and in Python; one that stands upright is tilted."""
    for inclination in (0.0, 1.0 / 40.0):
        shape = rail("60E1", inclination, 1.435, 0.75)
        write_profile(
            replace(shape, y=shape.y - shape.y.mean()), "head.csv", overwrite=True
        )
        scene = scene_of(changed, **{"60E1": "head.csv"})
        warnings = [
            str(warning)
            for warning in warnings_of(scene)
            if "inclination" in str(warning)
        ]
        assert len(warnings) == (inclination > 0.0)
        ours = build(scene).counterface.profile
        expected = load_profile("head.csv", "rail", inclination=1.0 / 40.0)
        np.testing.assert_allclose(
            np.interp(ours.y, expected.y, expected.z), ours.z, rtol=0, atol=1e-9
        )
    assert warnings[0].startswith("scene.toml:")
    assert (
        'inclination = "1:40" is without effect: the head in head.csv leans'
        in warnings[0]
    )
