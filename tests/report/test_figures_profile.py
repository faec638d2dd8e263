"""Figures of profiles show the data they are given, flange down, in mm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg

from wearsim.errors import ResultError
from wearsim.profile.inspection import Conditions, inspect_profile
from wearsim.profile.inspection.datasets import fleet_dataset, profile_dataset
from wearsim.profile.inspection.fleet import fleet_rows
from wearsim.profile.inspection.inputs import read_input
from wearsim.profile.limits import load_limits
from wearsim.profile.measures import GaugeDistances
from wearsim.report.figures import fleet as figures_fleet
from wearsim.report.figures import profile as figures_profile
from wearsim.report.figures.fleet import plot_member
from wearsim.report.style import COLOURS, write_figure

MEASURED = Path(__file__).parents[2] / "profiles" / "measured"


def state_of(name, against=None, left=None, distances=None, **stated):
    at = Conditions(distances or GaugeDistances(), **stated)
    other, second = (None if given is None else read_input(str(given)) for given in (against, left))
    return profile_dataset(
        inspect_profile(read_input(str(name)), at, load_limits("TSI"), against=other, left=second)
    )


@pytest.fixture(scope="module")
def worn():
    return state_of(MEASURED / "wheel_worn_right.whl", "S1002", MEASURED / "wheel_worn_left.whl")


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
            lambda artist: hasattr(artist, "get_text") and hasattr(artist, "get_fontsize")
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


def test_the_shape_is_drawn_in_mm_flange_down_with_equal_aspect(worn):
    ax = figures_profile.plot_shape(worn)
    for name, label in (("profile", "wheel_worn_right"), ("reference", "S1002"),
                        ("left", "wheel_worn_left (left wheel), beyond")):  # fmt: skip
        y, z = line_of(ax, label).get_data()
        np.testing.assert_allclose(y, 1e3 * worn[f"{name}_y"].values, rtol=1e-15)
        np.testing.assert_allclose(z, 1e3 * worn[f"{name}_z"].values, rtol=1e-15)
    assert line_of(ax, "S1002").get_color() == COLOURS["new"]
    assert ax.get_aspect() == 1.0
    assert ax.yaxis_inverted()


def test_dimension_lines_have_the_length_of_the_measures(worn):
    """Ends of the arrows of Sh, Sd and qR, and the texts on them."""
    ax = figures_profile.plot_shape(worn)
    profile_z, gauge = 1e3 * worn["profile_z"].values, 1e3 * worn["gauge_y"].values
    texts = {text.get_text().split()[0]: float(text.get_text().split()[1].rstrip("!"))
             for text in ax.texts if text.get_text()[:2] in ("Sh", "Sd", "qR")}  # fmt: skip
    spans = [np.subtract(arrow.xy, arrow.xyann) for arrow in ax.texts if hasattr(arrow, "arrow_patch")]
    lengths = {
        "Sh": [abs(dz) for dy, dz in spans if dy == 0.0],
        "Sd": [abs(dy) for dy, dz in spans if dz == 0.0],
    }
    lengths["qR"] = lengths["Sd"]
    for name, value in texts.items():
        # the texts have two decimals
        assert min(abs(length - value) for length in lengths[name]) < 0.0051, name
    assert texts["Sh"] == pytest.approx(profile_z.max() - 1e3 * worn["gauge_z"].values[1], abs=0.01)
    assert texts["Sd"] == pytest.approx(70.0 + gauge[2], abs=0.0051)


def test_gauge_points_lie_on_the_profile(worn):
    y, z = worn["profile_y"].values, worn["profile_z"].values
    for at, height in zip(worn["gauge_y"].values, worn["gauge_z"].values, strict=True):
        # 0.3 mm between the points: half of that at most
        assert np.min(np.hypot(y - at, z - height)) < 0.2e-3


def test_distances_stand_at_their_dimensions():
    state = state_of("S1002", distances=GaugeDistances(below_tip=3e-3, level=12e-3))
    texts = [text.get_text() for text in figures_profile.plot_shape(state).texts]
    assert {"3", "12"} <= set(texts)


def test_a_measure_beyond_its_limit_stands_out():
    ax = figures_profile.plot_shape(state_of(MEASURED / "wheel_worn_left.whl"))
    (text,) = [text for text in ax.texts if text.get_text().startswith("Sd")]
    assert text.get_text().endswith("!")
    assert text.get_color() == figures_profile.EXCEEDED
    ax = figures_profile.plot_shape(
        state_of(MEASURED / "wheel_worn_right.whl", left=MEASURED / "wheel_worn_left.whl")
    )
    (text,) = [text for text in ax.texts if text.get_text().startswith("Sd")]
    assert not text.get_text().endswith("!")  # the left one is beyond, the right one is drawn


def test_a_left_wheel_beyond_a_limit_is_marked_in_its_label():
    state = state_of("S1002", left=MEASURED / "wheel_worn_left.whl")
    assert state.attrs["left_label"].endswith("(left wheel), beyond: flange thickness !")


def test_depth_over_arc_length_with_the_lateral_position_above(worn):
    ax = figures_profile.plot_depth(worn)
    line = next(line for line in ax.lines if len(line.get_xdata()) == worn.sizes["wear_point"])
    np.testing.assert_allclose(line.get_xdata(), 1e3 * worn["arc_length"].values, rtol=1e-15)
    np.testing.assert_allclose(line.get_ydata(), 1e3 * worn["wear_depth"].values, rtol=1e-15)
    (top,) = ax.child_axes
    s, y = 1e3 * worn["arc_length"].values, 1e3 * worn["wear_y"].values
    for place, label in zip(top.get_xticks(), top.get_xticklabels(), strict=True):
        expected = float(label.get_text().replace("\N{MINUS SIGN}", "-"))
        assert np.interp(place, s, y) == pytest.approx(expected, abs=0.05)


def test_running_behaviour_of_both(worn):
    ax = figures_profile.plot_radius_difference(worn)
    np.testing.assert_allclose(
        line_of(ax, "wheel_worn_right").get_ydata(), 1e3 * worn["rolling_radius_difference"].values
    )
    np.testing.assert_allclose(
        line_of(ax, "S1002").get_ydata(), 1e3 * worn["reference_rolling_radius_difference"].values
    )
    ax = figures_profile.plot_conicity(worn)
    np.testing.assert_allclose(ax.lines[-1].get_ydata(), worn["equivalent_conicity"].values)


@pytest.mark.parametrize(
    "name",
    ["S1002", "cone/1:20", *(pytest.param(name, marks=pytest.mark.slow) for name in ("60E1", "disc", "P8"))],
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


@pytest.mark.parametrize("ending", [pytest.param("png", marks=pytest.mark.slow), "svg", "pdf"])
def test_the_same_figure_is_the_same_file(ending, worn, tmp_path):
    files = [tmp_path / f"{k}/figure.{ending}" for k in range(2)]
    for file in files:
        file.parent.mkdir()
        write_figure(figures_profile.profile_figure(worn), file)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_figure_that_cannot_be_written_is_reported(worn, tmp_path):
    with pytest.raises(ResultError, match="cannot be written"):
        write_figure(figures_profile.profile_figure(worn), tmp_path / "none" / "figure.png")


@pytest.fixture(scope="module")
def fleet():
    files = sorted(MEASURED.glob("*.whl"))
    reference = read_input("S1002")
    rows = list(fleet_rows(files, Conditions(GaugeDistances()), load_limits("TSI"), against=reference))
    return fleet_dataset(rows * 15, reference, load_limits("TSI"))


def test_small_figures_show_profile_reference_and_what_is_beyond(fleet):
    left, right = (plot_member(fleet, member) for member in (0, 1))
    for ax, member in ((left, 0), (right, 1)):
        np.testing.assert_allclose(ax.lines[0].get_ydata(), 1e3 * fleet["reference_z"].values)
        np.testing.assert_allclose(ax.lines[1].get_ydata(), 1e3 * fleet["profile_z"].values[member])
    assert left.lines[1].get_color() == figures_profile.EXCEEDED
    assert right.lines[1].get_color() == figures_fleet.NOT_JUDGED  # Sh, without a diameter
    assert right.lines[1].get_label() == "not judged, or not in all"
    assert any(text.get_text().startswith("Sh") and text.get_text().endswith("?") for text in right.texts)
    assert any(text.get_text().startswith("Sd") and text.get_text().endswith("!") for text in left.texts)


def test_pages_hold_all_profiles_on_the_same_axes(fleet):
    pages = list(figures_fleet.fleet_pages(fleet))
    assert len(pages) == 2
    drawn = [ax for page in pages for ax in page.axes if ax.lines]
    assert len(drawn) == fleet.sizes["wheel"] == 30
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in drawn}) == 1
    assert overlaps(pages[1]) == []


def test_several_files_of_one_wheel_are_distinguished_by_their_names(fleet):
    names = [str(name) for name in fleet["wheel_name"].values]
    assert names == ["wheel_worn_left.whl", "wheel_worn_right.whl"] * 15


def test_the_lowest_figure_of_each_column_has_numbers(fleet):
    page = next(figures_fleet.fleet_pages(fleet.isel(wheel=slice(6))))
    numbered = [ax.xaxis.get_tick_params()["labelbottom"] for ax in page.axes if ax.lines]
    assert numbered == [False, False, True, True, True, True]


def test_a_misread_profile_does_not_shrink_the_others(fleet):
    usual = figures_fleet.limits_of(fleet)
    wrong = fleet.copy(deep=True)
    wrong["profile_y"].values[3] *= 25.4
    wrong["profile_z"].values[3] *= 25.4
    assert figures_fleet.limits_of(wrong) == usual


def test_titles_keep_what_distinguishes_the_wheels_of_an_axle(fleet):
    fleet = fleet.copy(deep=True)
    names = [f"A very long name of a coach car 1 axle 2 {side}" for side in "LR"]
    fleet["wheel_name"] = ("wheel", names * (fleet.sizes["wheel"] // 2))
    left, right = (plot_member(fleet, member).get_title() for member in (0, 1))
    assert left.endswith("axle 2 L")
    assert right.endswith("axle 2 R")


def test_more_pages_than_are_drawn_are_reported(fleet, tmp_path, monkeypatch):
    monkeypatch.setattr(figures_fleet, "MOST_PAGES", 1)
    monkeypatch.setattr(figures_fleet, "ROWS", 1)
    files, drawn = figures_fleet.write_fleet(fleet, tmp_path / "fleet.svg")
    assert (len(files), drawn) == (1, figures_fleet.COLUMNS * figures_fleet.ROWS)
