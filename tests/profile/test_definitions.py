"""Files of standard shapes: what they may hold, and how their faults are reported."""

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.segments import Arc, Polynomial, Spline, tangent_arc
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


@pytest.mark.parametrize("radius", [5.0, 20.0, 36.0, 60.0])
def test_tangent_arc_between_an_arc_and_a_line(radius):
    """A groove of R 13 and a line of 1:40, as in the profile 1/40."""
    groove = Arc("D", -38.4, -20.0, (-26.210665, 16.446), 13.0, -1)
    tread = Polynomial("tread", -26.0, 60.0, (0.0, -0.025))
    if radius < 13.0:
        with pytest.raises(
            ProfileError, match=r"0 arcs of radius 5 mm are tangent to its neighbours"
        ):
            tangent_arc("R", groove, tread, radius, -1)
    else:
        assert_tangent(groove, tangent_arc("R", groove, tread, radius, -1), tread)


def test_splines_move_and_keep_their_slopes():
    spline = Spline("s", 0.0, 2.0, (0.0, 1.0, 2.0), (0.0, 1.0, 0.0), (1.0, -1.0))
    assert spline.angle(np.array([0.0, 2.0])) == pytest.approx(
        [np.pi / 4, -np.pi / 4], abs=1e-12
    )
    moved = spline.moved(3.0, 5.0)
    at = np.linspace(0.0, 2.0, 9)
    assert moved.height(at + 3.0) == pytest.approx(spline.height(at) + 5.0, abs=1e-12)
    points = spline.abscissae(0.1)
    length = np.hypot(np.diff(points), np.diff(spline.height(points)))
    assert np.ptp(length) < 0.01 * length.mean()
