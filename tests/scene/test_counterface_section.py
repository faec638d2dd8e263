"""[counterface.wear] of a scene: rollers by a factor, rails at a stated rate."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.contact.geometry import counterface_profile
from wearsim.profile.shape import arc_length
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import CounterfaceWear

DATA = Path(__file__).parents[1] / "data"
TEXT = {kind: (DATA / f"scene_{kind}.toml").read_text() for kind in ("rig", "field")}


@pytest.mark.parametrize(
    ("kind", "lines", "wanted"),
    [
        (
            "rig",
            "factor = 0.8\nredress_every_km = 200\nredress_depth_um = 300",
            CounterfaceWear(
                factor=0.8, radius=1.0, redress_distance=200e3, redress_depth=300e-6
            ),
        ),
        ("rig", "factor = 1", CounterfaceWear(factor=1.0, radius=1.0)),
        ("field", "area_mm2_per_1000km = 5", CounterfaceWear(area_rate=5e-12)),
    ],
)
def test_wear_reaches_the_campaign_in_si(folder, kind, lines, wanted):
    Path("scene.toml").write_text(f"{TEXT[kind]}\n[counterface.wear]\n{lines}\n")
    scene = load_scene("scene.toml")
    setup = build(scene)
    result = setup.counterface_wear
    for name in CounterfaceWear.__dataclass_fields__:
        assert getattr(result, name) == pytest.approx(
            getattr(wanted, name), rel=1e-12
        ), name
    # a profile that wears gets the points of the wheels; it stays where it was
    profile = setup.counterface.profile
    steps = np.diff(arc_length(profile.y, profile.z))
    spacing = 1e-3 * scene.campaign.point_spacing_mm
    assert np.median(steps) == pytest.approx(spacing, rel=0.01)
    Path("fixed.toml").write_text(TEXT[kind])
    fixed = build(load_scene("fixed.toml"))
    assert fixed.counterface_wear is None
    new, old = (
        counterface_profile(one) for one in (profile, fixed.counterface.profile)
    )
    shared = (old.y > new.y[0]) & (old.y < new.y[-1])
    apart = (np.interp(old.y, new.y, new.z) - old.z) * np.cos(old.angle)
    assert np.abs(apart[shared]).max() < 0.1e-6


@pytest.mark.parametrize(
    ("kind", "lines", "line", "message"),
    [
        ("rig", "redress_every_km = 3", "[counterface.wear]", "factor"),
        ("rig", "factor = 0", "factor = 0", "factor = 0 must be above 0"),
        (
            "rig",
            "factor = 1\nredress_depth_um = 0.5",
            "redress_depth_um",
            "must be at least 1",
        ),
        (
            "rig",
            "factor = 1\nredress_km = 3",
            "redress_km",
            "did you mean redress_every_km?",
        ),
        (
            "rig",
            "factor = 1\narea_mm2_per_1000km = 2",
            "area_mm2",
            "a roller runs under this wheel alone",
        ),
        (
            "field",
            "area_mm2_per_1000km = 2\nfactor = 1",
            "factor = 1",
            "a rail is passed by other wheels",
        ),
        (
            "field",
            'area_mm2_per_1000km = 2\nlaw = "usfd"',
            "law = ",
            "rail wear per 100 MGT follows from every result in the field",
        ),
        ("field", "", "[counterface.wear]", "area_mm2_per_1000km"),
    ],
)
def test_faults_stand_at_their_line(
    folder, faults_of, line_with, kind, lines, line, message
):
    text = f"{TEXT[kind]}\n[counterface.wear]\n{lines}\n"
    (fault,) = faults_of(text)
    assert fault.startswith(f"scene.toml:{line_with(text, line)}: ")
    assert message in fault


def test_a_law_that_wears_nothing_wears_no_counterface(
    folder, faults_of, line_with, changed
):
    text = (
        changed(TEXT["rig"], ("[counterface]", '[wear]\nlaw = "none"\n[counterface]'))
        + "\n[counterface.wear]\nfactor = 1\n"
    )
    (fault,) = [one for one in faults_of(text) if "counterface" in one]
    assert fault.startswith(f"scene.toml:{line_with(text, '[counterface.wear]')}: ")
    assert 'law = "none" wears nowhere' in fault


def test_a_schedule_that_is_never_reached_is_a_warning(folder, line_with):
    text = f"{TEXT['rig']}\n[counterface.wear]\nfactor = 1\nredress_every_km = 1e6\n"
    Path("scene.toml").write_text(text)
    (warning,) = build(load_scene("scene.toml")).warnings
    assert warning.startswith(
        f"scene.toml:{line_with(text, 'redress_every')}: redress_every_km = 1e+06 is "
        "not"
    )
