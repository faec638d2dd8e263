"""What a user names becomes a profile with its story."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile import standard
from wearsim.profile.conicity import running
from wearsim.profile.files import load_profile, read_profile, write_profile
from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.inputs import placed, read_input

MEASURED = Path(__file__).parents[3] / "profiles" / "measured"


@pytest.mark.parametrize("kind", ["wheel", "rail"])
def test_every_shipped_name_tells_its_kind(kind):
    for name in standard.shipped_names(kind):
        subject = read_input(name)
        assert subject.kind == kind
        assert not subject.measured
        assert subject.source
        assert subject.certainty


@pytest.mark.parametrize(
    "path", sorted(MEASURED.glob("*.[whbp][hra][lnw]")), ids=lambda path: path.name
)
def test_measured_files_are_those_of_the_reader(path):
    subject = read_input(str(path))
    reading = read_profile(path, subject.kind)
    np.testing.assert_array_equal(subject.profile.y, reading.profile.y)
    assert subject.notes == reading.notes[1:]
    assert subject.measured


def test_rails_stand_in_the_track_as_for_all_commands():
    for name, inclination in (
        ("60E1", 1.0 / 40.0),
        ("54E2", 1.0 / 20.0),
        ("EN15302_rail_A", 1.0 / 40.0),
    ):
        own = placed(read_input(name), inclination, 1.435, 0.75)
        other = load_profile(name, "rail", inclination=inclination)
        np.testing.assert_array_equal(own.y, other.y)
        np.testing.assert_array_equal(own.z, other.z)


def test_only_upright_shapes_lean_unless_it_is_stated():
    measured = read_input(str(MEASURED / "rail_worn_outer.ban"))
    assert not measured.upright
    stands, leans = (placed(measured, tilt, 1.435, 0.75) for tilt in (None, 1.0 / 40.0))
    upright = placed(measured, 0.0, 1.435, 0.75)
    np.testing.assert_array_equal(stands.z, upright.z)
    assert np.ptp(leans.z - stands.z) > 1e-3


def at(inclination=None):
    return Conditions(inclination=inclination)


@pytest.fixture
def written(tmp_path):
    """Write 60E1 as it stands and read it back."""

    def write(inclination, name="60E1.ban"):
        path = tmp_path / name
        shape = read_input("60E1").profile
        if inclination:
            shape = standard.rail("60E1", inclination, 1.435, 0.75)
        write_profile(shape, path, "miniprof")
        return read_input(str(path))

    return write


@pytest.mark.parametrize("inclination", [None, 1.0 / 40.0, 1.0 / 20.0])
def test_an_upright_file_is_what_its_definition_is(written, inclination):
    """To 0.01 mm2 over 85 mm, a tenth of a micrometre of the best fit."""
    subject = written(0.0)
    assert subject.upright
    assert "head stands upright" in subject.notes
    result = inspect_profile(subject, at(inclination), against=read_input("60E1"))
    assert abs(result.comparison.wear.worn_area) < 0.02e-6
    conicity = result.running.judged_conicity
    assert conicity == pytest.approx(
        result.comparison.running.judged_conicity, abs=1e-6
    )
    assert conicity == pytest.approx(
        0.010 if inclination == 1.0 / 20.0 else 0.174, abs=1e-3
    )


@pytest.mark.parametrize("lean", [1.0 / 40.0, 1.0 / 20.0])
@pytest.mark.parametrize("stated", [False, True])
def test_a_file_that_leans_is_not_tilted_again(written, lean, stated):
    subject = written(lean)
    assert subject.lean == pytest.approx(lean, abs=1e-5)
    if not stated:
        result = inspect_profile(subject, at(), brief=True)
    else:
        result = inspect_profile(subject, at(lean), against=read_input("60E1"))
        assert abs(result.comparison.wear.worn_area) < 0.02e-6
        assert any(
            "leans 1:" in note and "is not tilted again" in note
            for note in result.given.notes
        )
    assert result.running.judged_conicity == pytest.approx(
        0.174 if lean == 1.0 / 40.0 else 0.010, abs=1e-3
    )


def test_a_worn_head_is_tilted_only_if_that_is_stated_and_so_is_its_reference():
    """A tilt of both leaves the wear between the two as it is."""
    worn = read_input(str(MEASURED / "rail_worn_outer.ban"))
    assert worn.lean is None
    alone = inspect_profile(worn, at(), against=worn, brief=True)
    assert any(
        "if it was measured upright, state --inclination" in note
        for note in alone.given.notes
    )
    tilted = inspect_profile(worn, at(1.0 / 40.0), against=worn, brief=True)
    assert any("inclined 1:40 by --inclination" in note for note in tilted.given.notes)
    assert abs(tilted.comparison.wear.worn_area) < 0.02e-6
    assert abs(tilted.running.judged_conicity - alone.running.judged_conicity) > 0.05


def test_diameter_of_the_header(tmp_path):
    file, lines = (
        tmp_path / "wheel.whl",
        (MEASURED / "wheel_worn_right.whl").read_text(),
    )
    for text, diameter in (
        ("921.4", 0.9214),
        ("921,4", 0.9214),
        ("0", None),
        ("-", None),
        ("9999", None),
    ):
        file.write_text(f"DIAMETERTAPERLINE={text}\n{lines}")
        assert read_input(str(file)).diameter == (
            None if diameter is None else pytest.approx(diameter)
        )


def test_a_definition_that_is_no_definition_is_told(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text("[scene]\nkind = 'rig'\n")
    with pytest.raises(ProfileError, match=r"scene\.toml"):
        read_input(str(file))


def test_running_of_mirrored_wheelsets_is_mirrored():
    right, left = (
        read_input(str(MEASURED / f"wheel_worn_{side}.whl")).profile
        for side in ("right", "left")
    )
    rail = standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    one, other = (
        running(right, left, rail, "", 1e-3),
        running(left, right, rail, "", -1e-3),
    )
    np.testing.assert_allclose(one.difference, -other.difference[::-1], atol=1e-12)
    for (_, first, _), (_, second, _) in zip(
        one.equivalent_conicity, other.equivalent_conicity, strict=True
    ):
        assert first == pytest.approx(second, rel=1e-6)


def test_running_tells_what_it_cannot():
    rail = standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    cylinder = running(standard.wheel("cylinder"), None, rail, "")
    assert all(
        value is None and "undefined" in why
        for _, value, why in cylinder.equivalent_conicity[:3]
    )
    short = standard.wheel("S1002")
    keep = short.y < 0.0045
    cut = type(short)(short.name, short.kind, short.y[keep], short.z[keep])
    lost = running(cut, None, rail, "")
    assert lost.rolling_radius_difference[-1].value is None
    assert any("beyond the end" in why for _, _, why in lost.equivalent_conicity)


def test_a_file_that_does_not_say_its_kind_needs_it_stated(tmp_path):
    file = tmp_path / "points.csv"
    shape = standard.wheel("S1002")
    write_profile(shape, file)
    assert read_input(str(file)).kind == "wheel"  # by the comment that wearsim writes
    file.write_text("\n".join(file.read_text().splitlines()[1:]))
    with pytest.raises(
        ProfileError,
        match="neither extension nor first line says what it is: state --kind",
    ):
        read_input(str(file))
    np.testing.assert_array_equal(read_input(str(file), "wheel").profile.y, shape.y)
