"""Profile files of other programs: text beside numbers, other origins, other bodies."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.files import load_profile, read_profile
from wearsim.profile.measures import flange_height, flange_thickness
from wearsim.profile.standard import rail

EXPORTS = Path(__file__).parents[2] / "data/exports"
APTA = EXPORTS / "apta320_inch.csv"


def test_text_beside_the_numbers_is_left_out(tmp_path):
    """GENSYS allows explanations behind the points, also with commas in them."""
    path = EXPORTS / "text_beside.wheel"
    reading = read_profile(path, "wheel")
    assert "text beside the numbers of 2 lines left out" in reading.notes
    marked = (
        path.read_text().replace("   field", " # field").replace("   run", " # run")
    )
    (tmp_path / "marked.wheel").write_text(marked)
    same = read_profile(tmp_path / "marked.wheel", "wheel")
    assert not any("text beside" in note for note in same.notes)
    np.testing.assert_array_equal(reading.profile.y, same.profile.y)
    np.testing.assert_array_equal(reading.profile.z, same.profile.z)


@pytest.mark.parametrize(
    "statements",
    [{"origin": "gauge_point"}, {"offset_y": -40.767e-3, "offset_z": 17.28e-3}],
)
def test_a_wheel_in_inches_counted_from_its_gauge_point(statements):
    """Coordinates of APTA PR-M-S-015: Sh 26.79, Sd 32.07 and the conicity 0.043 at
    3 mm, of its points moved by hand.
    """
    wheel = read_profile(APTA, "wheel", units="in", **statements).profile
    assert wheel.y[0] == pytest.approx(-70e-3, abs=1e-6)
    assert 1e3 * flange_height(wheel.y, wheel.z) == pytest.approx(26.79, abs=0.005)
    assert 1e3 * flange_thickness(wheel.y, wheel.z) == pytest.approx(32.07, abs=0.005)
    span = 0.5 * 1.355 + 0.070  # back-to-back distance of North American wheelsets
    track = rail("60E1", 1 / 40, 1.435, span)
    conicity = equivalent_conicity(wheel, wheel, track, amplitude=3e-3)
    assert conicity == pytest.approx(0.043, abs=0.002)


def test_an_origin_on_the_flange_is_asked_for_by_name(tmp_path):
    with pytest.raises(ProfileError, match="state the origin gauge_point, or offsets"):
        read_profile(APTA, "wheel", units="in")
    lines = APTA.read_text().splitlines()
    (tmp_path / "p.csv").write_text("\n".join(lines[4:]))  # without the flange back
    with pytest.raises(ProfileError, match="needs the flange back"):
        read_profile(tmp_path / "p.csv", "wheel", units="in", origin="gauge_point")
    with pytest.raises(ProfileError, match="origin and offsets exclude each other"):
        read_profile(APTA, "wheel", units="in", origin="gauge_point", offset_y=0.0)


def test_a_row_of_units_gives_the_unit(tmp_path):
    rows = [f"{1e-3 * y:.6f};{1e-3 * z:.6f}" for y, z in _points_mm()]
    (tmp_path / "p.csv").write_text("\n".join(["scan 12", "y;z", "[m];[m]", *rows]))
    reading = read_profile(tmp_path / "p.csv", "wheel")
    assert "units m by line 3" in reading.notes
    assert reading.header["columns"] == "scan 12"
    assert np.ptp(reading.profile.y) == pytest.approx(0.1397, abs=1e-6)


def _points_mm():
    wheel = read_profile(APTA, "wheel", units="in", origin="gauge_point").profile
    return zip(1e3 * wheel.y, 1e3 * wheel.z, strict=True)


def test_a_head_narrower_than_any_running_rail_is_noted():
    reading = read_profile(EXPORTS / "crossing_nose.prr", "rail")
    (note,) = (note for note in reading.notes if "narrower" in note)
    assert note.startswith("36.7 mm wide, narrower than the head of any running rail")


def test_a_flat_disc_is_no_fault(tmp_path):
    path = tmp_path / "disc.csv"
    path.write_text("y,z\n" + "".join(f"{0.05 * k - 5:.2f},0\n" for k in range(201)))
    disc = load_profile(path, "rail")
    assert np.ptp(disc.y) == pytest.approx(10e-3)
    path.write_text("y,z\n" + "".join(f"{0.3 * k - 30:.2f},0\n" for k in range(201)))
    with pytest.raises(ProfileError):
        load_profile(path, "rail")
