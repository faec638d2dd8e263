"""Files of standard shapes: what they may hold, and how their faults are reported."""

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.segments import Arc, Polynomial, Spline, line, part_moved, rail_head, tangent_arc
from wearsim.profile.standard import read_definition

HEAD = 'name = "made up"\nkind = "wheel"\nsource = "test"\ncertainty = "none"\n'
LINES = """
[[segment]]
zone = "left"
from = -70.0
to = 0.0
polynomial = [0.0, -0.1]

[[segment]]
zone = "right"
from = 0.0
to = 60.0
polynomial = [0.0, -0.2]
"""


def written(tmp_path, text):
    path = tmp_path / "made_up.toml"
    path.write_text(text)
    return path


def test_a_shape_of_lines(tmp_path):
    shape = read_definition(written(tmp_path, HEAD + LINES))
    assert [piece.zone for piece in shape.segments] == ["left", "right"]


@pytest.mark.parametrize(
    "change",
    [
        ("polynomial = [0.0, -0.1]", ""),
        ("polynomial = [0.0, -0.1]", "arc = 3"),
        (LINES, ""),
        ('certainty = "none"', ""),
        ('name = "made up"', "name = "),
        ("from = -70.0\n", ""),
        (HEAD, HEAD + '[base]\nname = "nowhere"\nzones = []\nparameters = []\n'),
    ],
)
def test_what_is_no_definition_is_told_in_one_line_with_its_file(tmp_path, change):
    text = HEAD + LINES
    assert change[0] in text
    with pytest.raises(ProfileError, match=r"(made_up|nowhere)\.toml: ") as caught:
        read_definition(written(tmp_path, text.replace(*change)))
    assert "\n" not in str(caught.value)


def assert_tangent(first, arc, second):
    """The arc touches both neighbours with a common tangent."""
    for piece, at in ((first, arc.start), (second, arc.end)):
        y = np.array([at])
        assert arc.height(y)[0] == pytest.approx(piece.height(y)[0], abs=1e-12)
        assert arc.angle(y)[0] == pytest.approx(piece.angle(y)[0], abs=1e-12)


def test_tangent_arc_between_two_lines():
    """A roof of 45 degrees on both sides rounded with R 10: tangent at 10 sin 45."""
    left, right = Polynomial("l", -20, 20, (0.0, 1.0)), Polynomial("r", -20, 20, (0.0, -1.0))
    arc = tangent_arc("cap", left, right, 10.0, 1)
    assert arc.centre == pytest.approx((0.0, -10.0 * np.sqrt(2.0)), abs=1e-12)
    assert (arc.start, arc.end) == pytest.approx((-10 / np.sqrt(2), 10 / np.sqrt(2)), abs=1e-12)
    assert_tangent(left, arc, right)


@pytest.mark.parametrize("radius", [5.0, 20.0, 36.0, 60.0])
def test_tangent_arc_between_an_arc_and_a_line(radius):
    """A groove of R 13 and a line of 1:40, as in the profile 1/40."""
    groove = Arc("D", -38.4, -20.0, (-26.210665, 16.446), 13.0, -1)
    tread = Polynomial("tread", -26.0, 60.0, (0.0, -0.025))
    if radius < 13.0:
        with pytest.raises(
            ProfileError, match=r"no arc of radius 5 mm can be tangent to zones 'D' and 'tread'"
        ):
            tangent_arc("R", groove, tread, radius, -1)
    else:
        assert_tangent(groove, tangent_arc("R", groove, tread, radius, -1), tread)


@pytest.mark.parametrize(("radius", "branch"), [(60.0, 1), (20.0, -1)])
def test_tangent_arc_between_two_arcs(radius, branch):
    """Two caps of R 10, 40 apart, under a common cap or joined by a bowl; both are centred between them."""
    left, right = Arc("a", -30.0, 0.0, (-20.0, 0.0), 10.0, 1), Arc("b", 0.0, 30.0, (20.0, 0.0), 10.0, 1)
    arc = tangent_arc("R", left, right, radius, branch)
    assert arc.centre[0] == pytest.approx(0.0, abs=1e-12)
    assert np.hypot(20.0, arc.centre[1]) == pytest.approx(radius - branch * 10.0, abs=1e-12)
    assert_tangent(left, arc, right)


def test_tangent_arc_needs_arcs_or_lines():
    curve = Polynomial("curve", -20, 0, (0.0, 0.0, 1.0))
    with pytest.raises(ProfileError, match=r"zone 'curve' is no arc and no line"):
        tangent_arc("R", curve, Polynomial("r", 0, 20, (0.0,)), 10.0, 1)


@pytest.mark.parametrize(
    ("widths", "depth", "message"),
    [
        ([52.053, 20.456], 16.0, r"arc 2 of \[head\], R 80, ends before it begins"),
        ([20.456, 52.053], 10.0, r"side_depth = 10 must be above the arcs' end at 14\.300"),
    ],
)
def test_rail_heads_that_do_not_close_are_refused(widths, depth, message):
    with pytest.raises(ProfileError, match=message):
        rail_head([300.0, 80.0, 13.0], widths, 20.0, depth)


def test_only_caps_can_be_moved_together():
    chain = (line("a", (-70.0, 0.0), (0.0, 10.0)), line("b", (0.0, 10.0), (60.0, 0.0)))
    with pytest.raises(ProfileError, match=r"a flange can only be made thinner from a cap at its tip"):
        part_moved(chain, -55.0, -0.5, -1.0, "T", 0.0)


def test_splines_move_and_keep_their_slopes():
    spline = Spline("s", 0.0, 2.0, (0.0, 1.0, 2.0), (0.0, 1.0, 0.0), (1.0, -1.0))
    assert spline.angle(np.array([0.0, 2.0])) == pytest.approx([np.pi / 4, -np.pi / 4], abs=1e-12)
    moved = spline.moved(3.0, 5.0)
    at = np.linspace(0.0, 2.0, 9)
    assert moved.height(at + 3.0) == pytest.approx(spline.height(at) + 5.0, abs=1e-12)
    points = spline.abscissae(0.1)
    length = np.hypot(np.diff(points), np.diff(spline.height(points)))
    assert np.ptp(length) < 0.01 * length.mean()
