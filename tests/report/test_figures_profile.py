"""Figures of profiles show the data they are given, flange up, in mm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg

from wearsim.errors import ResultError
from wearsim.profile.conicity import Conicity
from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.inputs import read_input
from wearsim.profile.inspection.tables import fleet_rows
from wearsim.profile.limits import load_limits
from wearsim.report.figures import profile as figures_profile
from wearsim.report.style import COLOURS, write_figure

MEASURED = Path(__file__).parents[2] / "profiles" / "measured"


def state_of(name, against=None, left=None):
    other, second = (
        None if given is None else read_input(str(given)) for given in (against, left)
    )
    return inspect_profile(
        read_input(str(name)), None, load_limits("TSI"), against=other, left=second
    )


@pytest.fixture(scope="module")
def worn():
    return state_of(
        MEASURED / "wheel_worn_right.whl", "S1002", MEASURED / "wheel_worn_left.whl"
    )


@pytest.fixture(scope="module")
def rail():
    return state_of(MEASURED / "rail_worn_outer.ban", "60E1")


def line_of(ax, label):
    (line,) = [line for line in ax.lines if line.get_label().startswith(label)]
    return line


def overlaps(figure):
    """Pairs of texts that lie on each other."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    unseen = set()  # ticks beyond the limits of their axis are not drawn
    for axis in figure.findobj(Axis):
        low, high = sorted(axis.get_view_interval())
        for tick in axis.get_major_ticks():
            if not low - 1e-9 <= tick.get_loc() <= high + 1e-9:
                unseen |= {tick.label1, tick.label2}
    texts = [
        text
        for text in figure.findobj(
            lambda artist: (
                hasattr(artist, "get_text") and hasattr(artist, "get_fontsize")
            )
        )
        if text.get_text().strip() and text.get_visible() and text not in unseen
    ]
    boxes = [text.get_window_extent(renderer).shrunk(0.9, 0.8) for text in texts]
    return [
        (texts[i].get_text(), texts[j].get_text())
        for i in range(len(texts))
        for j in range(i)
        if boxes[i].overlaps(boxes[j])
    ]


def test_the_shape_is_drawn_in_mm_flange_up_and_left_with_equal_aspect(worn):
    ax = figures_profile.plot_shape(worn)
    drawn = {
        "wheel_worn_right": worn.aligned,
        "S1002": worn.comparison.reference.profile,
        "wheel_worn_left (left wheel), beyond": worn.left.profile,
    }
    for label, profile in drawn.items():
        y, z = line_of(ax, label).get_data()
        np.testing.assert_allclose(y, 1e3 * profile.y, rtol=1e-15)
        np.testing.assert_allclose(z, 1e3 * profile.z, rtol=1e-15)
    assert line_of(ax, "S1002").get_color() == COLOURS["new"]
    assert ax.get_aspect() == 1.0
    assert not ax.yaxis_inverted()
    assert not ax.xaxis_inverted()


def test_dimension_lines_have_the_length_of_the_measures(worn):
    """Ends of the arrows of Sh, Sd and qR, and the texts on them."""
    ax = figures_profile.plot_shape(worn)
    profile_z, gauge = 1e3 * worn.aligned.z, 1e3 * figures_profile.gauge_points(worn)
    texts = {
        text.get_text().split()[0]: float(text.get_text().split()[1].rstrip("!"))
        for text in ax.texts
        if text.get_text()[:2] in ("Sh", "Sd", "qR")
    }
    spans = [
        np.subtract(arrow.xy, arrow.xyann)
        for arrow in ax.texts
        if hasattr(arrow, "arrow_patch")
    ]
    lengths = {
        "Sh": [abs(dz) for dy, dz in spans if dy == 0.0],
        "Sd": [abs(dy) for dy, dz in spans if dz == 0.0],
    }
    lengths["qR"] = lengths["Sd"]
    for name, value in texts.items():
        # the texts have two decimals
        assert min(abs(length - value) for length in lengths[name]) < 0.0051, name
    assert texts["Sh"] == pytest.approx(profile_z.max() - gauge[1, 1], abs=0.01)
    assert texts["Sd"] == pytest.approx(70.0 + gauge[2, 0], abs=0.0051)


def test_gauge_points_lie_on_the_profile(worn):
    y, z = worn.aligned.y, worn.aligned.z
    for at, height in figures_profile.gauge_points(worn):
        # 0.3 mm between the points: half of that at most
        assert np.min(np.hypot(y - at, z - height)) < 0.2e-3


def test_a_measure_beyond_its_limit_stands_out():
    ax = figures_profile.plot_shape(state_of(MEASURED / "wheel_worn_left.whl"))
    (text,) = [text for text in ax.texts if text.get_text().startswith("Sd")]
    assert text.get_text().endswith("!")
    assert text.get_color() == figures_profile.EXCEEDED
    ax = figures_profile.plot_shape(
        state_of(
            MEASURED / "wheel_worn_right.whl", left=MEASURED / "wheel_worn_left.whl"
        )
    )
    (text,) = [text for text in ax.texts if text.get_text().startswith("Sd")]
    assert not text.get_text().endswith(
        "!"
    )  # the left one is beyond, the right one is drawn


def test_a_left_wheel_beyond_a_limit_is_marked_in_its_label():
    ax = figures_profile.plot_shape(
        state_of("S1002", left=MEASURED / "wheel_worn_left.whl")
    )
    assert line_of(ax, "wheel_worn_left (left wheel), beyond: flange thickness !")


def test_depth_over_arc_length_with_the_lateral_position_above(worn):
    ax, wear = figures_profile.plot_depth(worn.comparison), worn.comparison.wear
    line = next(line for line in ax.lines if len(line.get_xdata()) == len(wear.s))
    np.testing.assert_allclose(line.get_xdata(), 1e3 * wear.s, rtol=1e-15)
    np.testing.assert_allclose(line.get_ydata(), 1e3 * wear.depth, rtol=1e-15)
    (top,) = ax.child_axes
    s, y = 1e3 * wear.s, 1e3 * wear.y
    for place, label in zip(top.get_xticks(), top.get_xticklabels(), strict=True):
        expected = float(label.get_text().replace("\N{MINUS SIGN}", "-"))
        assert np.interp(place, s, y) == pytest.approx(expected, abs=0.05)


def test_running_behaviour_of_both(worn):
    ax = figures_profile.plot_radius_difference(worn)
    np.testing.assert_allclose(
        line_of(ax, "wheel_worn_right").get_ydata(), 1e3 * worn.running.difference
    )
    np.testing.assert_allclose(
        line_of(ax, "S1002").get_ydata(), 1e3 * worn.comparison.running.difference
    )
    ax = figures_profile.plot_conicity(worn)
    values = [at.value for at in worn.running.equivalent_conicity]
    np.testing.assert_allclose(ax.lines[-1].get_ydata(), values)
    assert [text.get_text() for text in ax.texts] == [
        f"{value:.3f}" for value in values
    ]


def test_a_profile_without_conicity_is_named_beside_one_that_has_it(worn):
    """The amplitude of 8 mm is within the axes, too."""
    ours = worn.comparison.running
    further = replace(
        ours, equivalent_conicity=(*ours.equivalent_conicity, Conicity(8e-3, 0.3, ""))
    )
    without = replace(
        worn,
        running=replace(worn.running, equivalent_conicity=()),
        comparison=replace(worn.comparison, running=further),
    )
    ax = figures_profile.plot_conicity(without)
    (text,) = ax.texts
    assert text.get_text() == "wheel_worn_right: undefined at all amplitudes"
    assert ax.get_xlim()[0] <= 0.5 < 8.0 < ax.get_xlim()[1]


def test_the_axis_of_the_radius_difference_holds_the_larger_one(worn):
    steep = worn.comparison.running
    steep = replace(steep, difference=10.0 * steep.difference)
    both = replace(worn, comparison=replace(worn.comparison, running=steep))
    ax = figures_profile.plot_radius_difference(both)
    near = np.abs(steep.shift) <= 3e-3
    assert ax.get_ylim()[1] > 1e3 * np.abs(steep.difference[near]).max()


@pytest.mark.parametrize(
    "name",
    [
        "S1002",
        "cone/1:20",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("60E1", "disc", "P8")
        ),
    ],
)
def test_whole_figures_of_standard_shapes_have_no_texts_on_each_other(name):
    assert overlaps(figures_profile.profile_figure(state_of(name))) == []


@pytest.mark.slow
def test_whole_figures_of_comparisons_have_no_texts_on_each_other(worn, rail):
    for state in (worn, rail):
        assert overlaps(figures_profile.profile_figure(state)) == []


def test_rails_are_drawn_top_up(rail):
    ax = figures_profile.plot_shape(rail)
    assert ax.yaxis_inverted()
    assert ax.get_ylabel() == "Height, down [mm]"


@pytest.mark.parametrize(
    "ending", [pytest.param("png", marks=pytest.mark.slow), "svg", "pdf"]
)
def test_the_same_figure_is_the_same_file(ending, worn, tmp_path):
    files = [tmp_path / f"{k}/figure.{ending}" for k in range(2)]
    for file in files:
        file.parent.mkdir()
        write_figure(figures_profile.profile_figure(worn), file)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_figure_that_cannot_be_written_is_reported(worn, tmp_path):
    with pytest.raises(ResultError, match="cannot be written"):
        write_figure(
            figures_profile.profile_figure(worn), tmp_path / "none" / "figure.png"
        )


def test_a_fleet_is_drawn_over_its_reference_and_those_beyond_limits_are_named():
    files, reference = sorted(MEASURED.glob("*.[wb]*")), read_input("S1002")
    rows = list(fleet_rows(files, Conditions(), load_limits("TSI"), against=reference))
    rails, wheels = figures_profile.fleet_figure(rows, reference.profile).axes
    assert len(rails.lines) == 1
    labels = [line.get_label() for line in wheels.lines]
    assert labels[:2] == ["S1002", "Example coach car 1 axle 2 L: flange thickness !"]
    assert wheels.lines[1].get_color() == figures_profile.EXCEEDED
    for line, row in zip(
        wheels.lines[1:],
        [row for row in rows if row.profile.kind == "wheel"],
        strict=True,
    ):
        np.testing.assert_allclose(line.get_ydata(), 1e3 * row.profile.z)
