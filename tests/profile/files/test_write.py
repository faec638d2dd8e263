"""Writers: round trips to the bit, nothing lost, nothing half written; the measured
examples.
"""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest

from wearsim.errors import ProfileError, ResultError
from wearsim.profile.files import (
    WRITTEN_FORMATS,
    load_profile,
    read_profile,
    write_profile,
)
from wearsim.profile.shape import Profile
from wearsim.profile.standard import rail, shipped_path, wheel

WHEEL = wheel("S1002", spacing=1e-3)
RAIL = rail("60E1", 1 / 40, 1.435, 0.750, spacing=1e-3)
SUFFIX = {
    "two-column": ("csv", "csv"),
    "miniprof": ("whl", "ban"),
    "simpack": ("prw", "prr"),
}


def file_for(folder, profile, name):
    return folder / f"p.{SUFFIX[name][profile.kind == 'rail']}"


@pytest.mark.parametrize("name", sorted(WRITTEN_FORMATS))
@pytest.mark.parametrize(
    "profile",
    [WHEEL, RAIL, wheel("S1002"), rail("60E1", 0.0, 1.435, 0.750)],
    ids=lambda p: f"{p.kind}{len(p.y)}",
)
def test_round_trip_gives_the_same_bits(tmp_path, profile, name):
    path = file_for(tmp_path, profile, name)
    write_profile(profile, path, name)
    reading = read_profile(path, profile.kind)
    assert reading.format == name
    assert np.array_equal(reading.profile.y, profile.y)
    assert np.array_equal(reading.profile.z, profile.z)


@pytest.mark.parametrize("name", sorted(WRITTEN_FORMATS))
@pytest.mark.parametrize("profile", [WHEEL, RAIL], ids=["wheel", "rail"])
def test_round_trip_of_any_double(tmp_path, profile, name):
    random = np.random.default_rng(1)
    size = 10.0 ** random.uniform(-20.0, -6.0, (2, len(profile.y)))
    noise = size * random.choice([-1.0, 1.0], size.shape)
    path = file_for(tmp_path, profile, name)
    noisy = Profile("noisy", profile.kind, profile.y + noise[0], profile.z + noise[1])
    write_profile(noisy, path, name)
    back = read_profile(path, profile.kind).profile
    assert np.array_equal(back.y, noisy.y)
    assert np.array_equal(back.z, noisy.z)


@pytest.mark.parametrize("value", [1e-17, -3.3e-20, 5e-324, -0.0])
@pytest.mark.parametrize("name", sorted(WRITTEN_FORMATS))
def test_round_trip_of_almost_nothing(tmp_path, name, value):
    """The flange back lies 70 mm off in MiniProf, which must not cost the digits of
    small numbers.
    """
    y = WHEEL.y.copy()
    y[np.argmin(np.abs(y))] = value
    path = file_for(tmp_path, WHEEL, name)
    write_profile(replace(WHEEL, y=y), path, name)
    assert np.array_equal(read_profile(path, "wheel").profile.y, y)


@pytest.mark.parametrize("name", sorted(WRITTEN_FORMATS))
@pytest.mark.parametrize(
    "about",
    [
        'a "quoted" name',
        "it's",
        "# ! % marks",
        "two\nlines",
        "x=1",
        "1 2",
        "Ö\u2028",
        "bell\x07",
        "\udcff",
    ],
)
def test_names_cannot_break_a_file(tmp_path, name, about):
    path = file_for(tmp_path, WHEEL, name)
    write_profile(replace(WHEEL, name=about, source=about), path, name)
    assert np.array_equal(read_profile(path, "wheel").profile.y, WHEEL.y)


@pytest.mark.parametrize("name", sorted(WRITTEN_FORMATS))
def test_nothing_is_overwritten_or_left_half_written(tmp_path, name):
    path = file_for(tmp_path, WHEEL, name)
    path.write_text("mine")
    with pytest.raises(ProfileError, match=r"exists already; choose another name"):
        write_profile(WHEEL, path, name)
    assert path.read_text() == "mine"
    with pytest.raises(ResultError, match=r"cannot be written"):
        write_profile(WHEEL, tmp_path / "none" / path.name, name)
    write_profile(WHEEL, path, name, overwrite=True)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_formats_that_are_not_written(tmp_path):
    with pytest.raises(
        ProfileError, match=r"'gensys' is not one of two-column, miniprof, simpack"
    ):
        write_profile(WHEEL, tmp_path / "p.wheel", "gensys")
    with pytest.raises(
        ProfileError,
        match=r"\.ban is the extension of a rail, 'S1002' a wheel; rename it",
    ):
        write_profile(WHEEL, tmp_path / "p.ban", "miniprof")


def test_simpack_lists_wheels_from_the_field_side(tmp_path):
    write_profile(WHEEL, tmp_path / "p.prw", "simpack")
    lines = (tmp_path / "p.prw").read_text().splitlines()
    first = lines[lines.index("  point.begin") + 1]
    assert float(first.split()[0]) == 65.0
    assert float(first.split()[1]) < 0.0


def test_miniprof_counts_from_the_flange_back_and_rails_upwards(tmp_path):
    write_profile(WHEEL, tmp_path / "p.whl", "miniprof")
    _, points = (tmp_path / "p.whl").read_text().split("\n\n")
    assert float(points.split()[0]) == 0.0
    write_profile(RAIL, tmp_path / "p.ban", "miniprof")
    _, points = (tmp_path / "p.ban").read_text().split("\n\n")
    assert all(float(line.split()[1]) <= 0.0 for line in points.splitlines())


# ---- measured examples

MEASURED = shipped_path("profiles", "measured")
EXAMPLES = [
    "rail_worn_outer.ban",
    "wheel_worn_left.whl",
    "wheel_worn_light.prw",
    "wheel_worn_right.whl",
]


def kind_of(name):
    return "rail" if name.startswith("rail") else "wheel"


def test_examples_are_all_there_and_described():
    result = sorted(
        path.name
        for path in MEASURED.iterdir()
        if path.suffix in (".ban", ".whl", ".prw")
    )
    assert result == EXAMPLES
    about = (MEASURED / "README.md").read_text(encoding="utf-8")
    assert all(name in about for name in EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_is_readable_and_says_that_it_is_made(name):
    profile = load_profile(MEASURED / name, kind_of(name), inclination=0.0)
    assert len(profile.y) > 200
    assert "not measured" in (MEASURED / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_can_be_made_again(tmp_path, monkeypatch, name):
    monkeypatch.setattr(
        sys, "dont_write_bytecode", True
    )  # the folder is shipped as it is
    spec = importlib.util.spec_from_file_location(
        "make_measured", MEASURED / "make_measured.py"
    )
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "make_measured", module)
    spec.loader.exec_module(module)
    module.make(tmp_path)
    old, new = (
        read_profile(folder / name, kind_of(name)).profile
        for folder in (MEASURED, tmp_path)
    )
    # other processors may round the last printed digit the other way
    assert np.max(np.abs(old.y - new.y)) <= 1.01e-7
    assert np.max(np.abs(old.z - new.z)) <= 1.01e-7


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("wheel_worn_right.whl", 1.1, 1.8),
        ("wheel_worn_left.whl", 1.6, 2.3),
        ("wheel_worn_light.prw", 0.3, 0.5),
    ],
)
def test_wear_of_the_example_wheels_is_what_their_note_says(name, least, most):
    """Depth on the tread against the new wheel [mm]; the slope there is below 1:10."""
    worn = read_profile(MEASURED / name, "wheel").profile
    tread = np.abs(worn.y) < 0.010
    new = wheel("S1002")
    depth = 1e3 * (np.interp(worn.y[tread], new.y, new.z) - worn.z[tread])
    assert least < depth.min()
    assert depth.max() < most
    rim = worn.y > 0.045
    assert np.max(np.abs(np.interp(worn.y[rim], new.y, new.z) - worn.z[rim])) < 0.03e-3


def test_worn_rail_of_the_example_lost_its_gauge_corner():
    """At the gauge corner; before placing, which would move the worn gauge point back
    to the gauge.
    """
    worn = read_profile(MEASURED / "rail_worn_outer.ban", "rail").profile
    new = load_profile("60E1", "rail", inclination=1 / 40)
    assert np.interp(-0.028, worn.y, worn.z) - np.interp(-0.028, new.y, new.z) > 0.5e-3
