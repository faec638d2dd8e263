"""Flange height, flange thickness and slopes written behind the name of a wheel."""

import numpy as np
import pytest
from junctions import junctions

from wearsim.errors import ProfileError
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.measures import flange_height, flange_thickness, hollowing
from wearsim.profile.standard import (
    definition,
    evaluate,
    find_shipped,
    is_designation,
    rail,
    shipped_path,
    wheel,
)


def zone(shape, name):
    """The only segment of this name."""
    (piece,) = [piece for piece in shape.segments if piece.zone == name]
    return piece


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("S1002", "S1002"),
        ("S1002/h28/e32.5/6.7%", "S1002"),
        ("S1002 / h30 / e30.5 / 10 %", "S1002/h30/e30.5/10%"),
        ("S1002/10%/e30.50/h30", "S1002/h30/e30.5/10%"),
        ("1/40/h32", "1in40/h32"),
        ("1:40/e31", "1in40/e31"),
        ("cone/1:16", "cone/1:16"),
        ("EN15302_C", "P8"),
    ],
)
def test_designations(written, name):
    assert is_designation(written)
    assert wheel(written).name == name
    assert find_shipped(written) == shipped_path(
        "profiles", f"{name.split('/')[0]}.toml"
    )


def test_the_title_tells_what_differs():
    assert definition("S1002", "wheel").title == "S1002 / h28 / e32.5 / 6.7 %"
    assert (
        definition("S1002/h30/e30.5", "wheel").title
        == "S1002 / h28 / e32.5 / 6.7 %; but h30, e30.5"
    )


@pytest.mark.parametrize("text", ["S1003/h30", "folder/S1002", "wheel.csv", "", "/"])
def test_other_texts_are_no_designations(text):
    assert not is_designation(text)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("S1002/h29", r"flange height h = 29 must be one of 28, 30, 32 mm"),
        ("S1002/e33", r"flange thickness e = 33 must be in 28\.5 \.\. 32\.5 mm"),
        ("S1002/6.6%", r"outer slope = 6\.6 must be in 6\.7 \.\. 15 %"),
        ("S1002/h29/16%", r"flange height h = 29 .*; outer slope = 16 must be"),
        ("S1002/h30/h30", r"flange height h is given twice"),
        (
            "S1002/i5",
            (
                r"'i5' is no parameter of it; there is h# \(flange height h one of "
                r"28, 30, 32 mm\), e#"
            ),
        ),
        ("S1002/hnan", r"'hnan' is no parameter"),
        ("S1002/h-30", r"'h-30' is no parameter"),
        ("EPS/e30", r"'e30' is no parameter of it; there is h#"),
        ("P8/h30", r"'h30' is no parameter of it; there is none"),
        ("cone/1:5", r"slope of the tread 1:N = 5 must be in 8 \.\. 1000"),
        (
            "s1002/h30",
            (
                r"'s1002/h30' is neither a file nor a shipped wheel .*did you mean "
                r"'S1002'\?"
            ),
        ),
    ],
)
def test_faults_are_told_in_one_line(name, message):
    with pytest.raises(ProfileError, match=message) as caught:
        wheel(name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("height", "centre", "lower", "upper"),
    [
        (30, (-60.733, 10.425), (-40.530, 17.779), (-47.758, 27.568)),
        (32, (-63.110, 12.568), (-41.497, 20.434), (-46.153, 28.108)),
    ],
)
def test_taller_flanges_have_the_points_of_the_standard(height, centre, lower, upper):
    """Rounded to 1 um. For h 32 the transcription has 12.558 for the centre, against
    its own two points.
    """
    shape = definition(f"S1002/h{height}", "wheel")
    arc = zone(shape, "F")
    assert arc.centre == pytest.approx(centre, abs=0.52e-3)
    ends = np.array([arc.end, arc.start])
    assert (ends[0], arc.height(ends)[0]) == pytest.approx(lower, abs=0.52e-3)
    assert (ends[1], arc.height(ends)[1]) == pytest.approx(upper, abs=0.52e-3)
    profile = wheel(f"S1002/h{height}")
    assert flange_height(profile.y, profile.z) == pytest.approx(
        height * 1e-3, abs=0.1e-6
    )
    assert flange_thickness(profile.y, profile.z) == pytest.approx(32.5e-3, abs=0.1e-6)
    y = np.linspace(-38e-3, 65e-3, 200)
    assert np.array_equal(evaluate(shape, y), evaluate(definition("S1002", "wheel"), y))


@pytest.mark.parametrize(
    ("thickness", "reduction"), [(31.5, 0.010), (30.5, 0.042), (29.5, 0.094)]
)
def test_thinner_flanges(thickness, reduction):
    """Flank and root keep their shape; the tip is lower by the steps the standard
    prints, to 1 um.
    """
    name = f"S1002/e{thickness}"
    shape, new = definition(name, "wheel"), definition("S1002", "wheel")
    less = 32.5 - thickness
    tip = -55.0 - 0.5 * less
    at_tip = float(evaluate(shape, np.array([tip * 1e-3]))[0]) * 1e3
    assert at_tip == pytest.approx(16.0 + np.sqrt(144.0 - 0.25 * less**2), abs=1e-9)
    assert 28.0 - at_tip == pytest.approx(reduction, abs=0.6e-3)
    y = np.linspace(tip + 0.01, -0.51 - less, 300) * 1e-3
    assert evaluate(shape, y) == pytest.approx(
        evaluate(new, y + less * 1e-3), abs=1e-12
    )
    field = np.linspace(0.0, 64.9e-3, 100)
    assert np.array_equal(evaluate(shape, field), evaluate(new, field))
    middle = float(evaluate(shape, np.array([-0.5e-3 * (0.5 + less)]))[0])
    assert middle == pytest.approx(
        0.5 * float(evaluate(new, np.array([-0.5e-3]))[0]), abs=1e-12
    )
    profile = wheel(name)
    assert flange_thickness(profile.y, profile.z) == pytest.approx(
        thickness * 1e-3, abs=0.1e-6
    )


def test_outer_slope_begins_at_b1():
    shape, new = definition("S1002/15%", "wheel"), definition("S1002", "wheel")
    y = np.array([32.15796e-3, 60e-3 - 1e-12, 65e-3])
    z, before = evaluate(shape, y), evaluate(new, y)
    assert z[0] == pytest.approx(before[0], abs=1e-12)
    assert (z[1] - z[0]) / (y[1] - y[0]) == pytest.approx(-0.15, abs=1e-9)
    assert z[2] == pytest.approx(z[1] - 5e-3, abs=1e-11)


@pytest.mark.parametrize("n", [8, 16, 20, 100])
def test_cones_have_the_conicity_of_their_slope(n):
    """Search grid and phases: 1e-5 of the slope. The tread is straight through the
    running circle.
    """
    profile = wheel(f"cone/1:{n}")
    assert (
        float(evaluate(definition(f"cone/1:{n}", "wheel"), np.array([0.0]))[0]) == 0.0
    )
    result = equivalent_conicity(
        profile, profile, rail("60E1", 1 / 20, 1.435, 0.750), amplitude=3e-3
    )
    assert result == pytest.approx(1.0 / n, rel=1e-5)
    assert "no standard profile" in definition("cone", "wheel").certainty


def test_cylinder_has_no_conicity_and_the_flange_of_s1002():
    profile = wheel("cylinder")
    placed = rail("60E1", 1 / 20, 1.435, 0.750)
    assert equivalent_conicity(profile, profile, placed) is None
    assert flange_height(profile.y, profile.z) == pytest.approx(28e-3, abs=0.1e-6)
    assert flange_thickness(profile.y, profile.z) == pytest.approx(32.5e-3, abs=0.1e-6)


@pytest.mark.parametrize(
    "name", ["S1002", "EPS", "1in40", "P8", "cone", "cylinder", "S1002/h32/e28.5/15%"]
)
def test_new_wheels_are_not_hollow(name):
    """Flat zones computed from their arcs rise by rounding only: 4 nm at the end of
    R 330.
    """
    profile = wheel(name)
    assert hollowing(profile.y, profile.z) < 5e-9


def test_all_parameters_together_are_smooth_where_the_standard_is():
    _, step, kink = junctions(definition("S1002/h32/e28.5/15%", "wheel"))
    assert np.max(np.abs(step)) < 0.12e-6
    assert (
        np.count_nonzero(np.abs(kink) > 0.005e-3) == 5
    )  # tip, both ends of the straight line, B1, chamfer
