"""Figures of contact states show the data they are given."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.quiver import Quiver

from wearsim.contact.dataset import SIDES, solve_contact
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.errors import ResultError
from wearsim.profile import standard
from wearsim.report.figures import contact
from wearsim.report.style import COLOURS, to_svg, write_figure
from wearsim.studies.contact_state import contact_state

STRIPS, CELLS = 24, 20


@pytest.fixture(scope="module")
def make():
    wheel = standard.wheel("S1002")
    wheelset = Wheelset(wheel, wheel, 0.46, 0.75)
    rail = standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)

    def state(
        shift,
        yaw=0.0,
        kappa=0.0,
        friction=0.35,
        sides=(0,),
        grid=(STRIPS, CELLS),
        **options,
    ):
        values = (shift, yaw, 0.0, 80e3, 20.0, friction, 0.0)
        conditions = ContactConditions(
            *(np.array([value]) for value in values), **options
        )
        counterface = Counterface(rail, kappa)
        models = ContactModels.of(
            "fast", strips=grid[0], cells=grid[1], most_cells=max(grid), cell_size=1.0
        )
        solved = solve_contact(
            wheelset,
            counterface,
            conditions,
            models,
            sides=[SIDES[side] for side in sides],
            fields=True,
        )
        return contact_state(conditions, wheelset, counterface, solved)

    return state


@pytest.fixture(scope="module")
def state(make):
    return make(3e-3, yaw=2e-3)


@pytest.fixture(scope="module")
def two(make):
    return make(5.1e-3, sides=(0, 1), free_roll=True)


def test_the_outline_goes_through_the_ends_of_the_strips(state):
    line = contact.plot_outline(state).lines[0]
    y, x = line.get_data()
    assert (y[0], x[0]) == (y[-1], x[-1])
    for end, name in (
        (slice(1, 2 * STRIPS, 2), "x_lead"),
        (slice(-2, 2 * STRIPS, -2), "x_trail"),
    ):
        np.testing.assert_allclose(y[end], 1e3 * state["lateral"].values[0], rtol=1e-12)
        np.testing.assert_allclose(x[end], 1e3 * state[name].values[0], rtol=1e-12)
    assert np.ptp(y) == pytest.approx(1e3 * float(state["width"][0]), rel=1e-9)
    area = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    # corners cut between strips: second order, 1 % on 24 strips
    assert area == pytest.approx(1e6 * float(state["area"][0]), rel=0.01)


def test_states_lie_over_each_other_with_their_labels(make, state):
    """As in figure 5 of the seed paper: outlines of rail and rollers."""
    rollers = [make(3e-3, yaw=2e-3, kappa=kappa) for kappa in (1.0, 2.0)]
    ax = contact.plot_outline(state)
    contact.plot_outline(rollers[0], ax)
    contact.plot_outline(rollers[1], ax, linestyle="--", label="small roller")
    assert [line.get_label() for line in ax.lines] == [
        "rail",
        "roller 1000 mm",
        "small roller",
    ]
    assert [line.get_color() for line in ax.lines] == [
        COLOURS["rail"],
        COLOURS["rig"],
        COLOURS["rig"],
    ]
    assert ax.lines[2].get_linestyle() == "--"


def test_pressure_map_holds_every_cell(state):
    ax = contact.plot_field(state)
    mesh = next(item for item in ax.collections if isinstance(item, QuadMesh))
    values = np.asarray(mesh.get_array()).reshape(CELLS, 2 * STRIPS)
    np.testing.assert_allclose(
        values[:, ::2], 1e-6 * state["pressure"].values[0], rtol=1e-12
    )
    assert "MPa" in ax.figure.axes[-1].get_ylabel()
    corners = mesh.get_coordinates()
    assert corners[0, :, 1].max() == pytest.approx(
        1e3 * float(state["x_lead"].max())
    )  # leads upwards


def test_work_is_shown_where_the_patch_slips(state):
    ax = contact.plot_field(state, "work_density")
    mesh = next(item for item in ax.collections if isinstance(item, QuadMesh))
    shown = ~np.ma.getmaskarray(mesh.get_array()).reshape(CELLS, 2 * STRIPS)[:, ::2]
    np.testing.assert_array_equal(shown, state["work_density"].values[0] > 0.0)


def test_arrows_of_stick_and_slip_are_the_shear_of_their_cells(state):
    ax = contact.plot_shear(state)
    y, x = 1e3 * state["lateral"].values[0], 1e3 * state["longitudinal"].values[0]
    quivers = [item for item in ax.collections if isinstance(item, Quiver)]
    assert len(quivers) == 2
    for quiver, slips in zip(quivers, (0, 1), strict=True):
        assert quiver.U.size > 5
        for at_y, at_x, u, v in zip(
            quiver.X, quiver.Y, quiver.U, quiver.V, strict=True
        ):
            j = int(np.argmin(np.abs(y - at_y)))
            i = int(np.argmin(np.abs(x[:, j] - at_x)))
            assert u == pytest.approx(
                1e-6 * state["shear_y"].values[0, i, j], rel=1e-12
            )
            assert v == pytest.approx(
                1e-6 * state["shear_x"].values[0, i, j], rel=1e-12
            )
            assert state["slipping"].values[0, i, j] == slips
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "stick",
        "slip",
    ]


def test_arrows_do_not_reach_each_other(make):
    """The longest is a little more than their spacing; shear turns slowly, so
    neighbours are parallel.
    """
    ax = contact.plot_shear(make(3e-3, yaw=2e-3, grid=(50, 50)))
    quivers = [item for item in ax.collections if isinstance(item, Quiver)]
    places = np.concatenate([np.stack((q.X, q.Y), axis=1) for q in quivers])
    longest = max(np.hypot(q.U, q.V).max() / q.scale for q in quivers)
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    assert longest < 1.5 * apart.min()


def test_arrows_of_several_states_can_have_one_scale(state):
    alone, shared = (
        next(
            item
            for item in contact.plot_shear(state, largest=top).collections
            if isinstance(item, Quiver)
        )
        for top in (None, 2e9)
    )
    top = 1e-6 * float(np.hypot(state["shear_x"], state["shear_y"]).max())
    assert shared.scale / alone.scale == pytest.approx(2e3 / top, rel=1e-12)


def test_section_marks_each_contact_on_the_counterface(two):
    for side, count in ((0, 2), (1, 1)):
        ax = contact.plot_section(two, side=side)
        lines = {line.get_label(): line for line in ax.lines}
        assert set(lines) == {"rail 60E1", "wheel S1002", "contact"}
        own = two["side"].values == side
        sign = -1.0 if side else 1.0
        np.testing.assert_allclose(
            lines["contact"].get_xdata(), sign * 1e3 * two["rail_y"].values[own]
        )
        assert own.sum() == count
        assert [text.get_text() for text in ax.texts] == (
            ["1", "2"] if count == 2 else []
        )
        assert ax.get_aspect() == 1.0
        assert ax.yaxis_inverted()


def test_the_whole_figure_has_axes_for_every_side_and_patch(two):
    figure = contact.contact_figure(two)
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles[0] == "Section, right wheel"
    assert titles[1] == "Section, left wheel"
    # 2 sections, 3 patches with 3 axes and 2 bars each
    assert len(figure.axes) == 2 + 3 * 5
    assert sum(title.startswith("Right wheel, patch") for title in titles) == 2
    heading = figure.get_suptitle()
    for part in (
        "shift 5.1 mm",
        "load 80 kN",
        "friction 0.35",
        "72 km/h",
        "(free)",
        "S1002",
        "rail 60E1",
    ):
        assert part in heading


@pytest.mark.slow
def test_texts_do_not_overlap(two, make):
    """Titles, axis labels and tick labels of the finished figure, drawn at its size."""
    for dataset in (two, make(0.0), make(3e-3, yaw=0.01, kappa=2.0)):
        figure = contact.contact_figure(dataset)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        boxes = []
        for ax in figure.axes:
            texts = [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label]
            boxes += [
                (text.get_text(), text.get_window_extent(renderer))
                for text in texts
                if text.get_text()
            ]
        for k, (name, box) in enumerate(boxes):
            assert figure.bbox.x0 <= box.x0, name
            assert box.x1 <= figure.bbox.x1, name
            for other, second in boxes[k + 1 :]:
                assert not box.overlaps(second), (name, other)


@pytest.mark.slow
def test_a_contact_without_friction_is_drawn(make):
    figure = contact.contact_figure(make(3e-3, friction=0.0))
    assert "Frictional power 0 W" in [ax.get_title(loc="left") for ax in figure.axes]


def test_figures_are_the_same_each_time_and_change_no_setting(state):
    before = dict(mpl.rcParams)
    texts = [to_svg(contact.contact_figure(state), "contact") for _ in range(2)]
    assert texts[0] == texts[1]
    assert dict(mpl.rcParams) == before


def test_a_figure_that_cannot_be_written_is_an_error_for_the_user(state, tmp_path):
    with pytest.raises(ResultError, match="cannot be written"):
        write_figure(
            contact.contact_figure(state), tmp_path / "missing" / "contact.png"
        )
