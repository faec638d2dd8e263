"""The report of a sweep: each result over each varied key, and what became of each
case.
"""

import itertools

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.report.html import (
    plot_chart,
    plot_over_key,
    render_chart,
    render_sweep,
    varied,
)
from wearsim.report.style import COLOURS, SERIES_COLOURS, grid
from wearsim.studies.sweep import MEASURES

RADII, FRICTIONS = (0.5, 1.0, 5.0), tuple(np.linspace(0.1, 0.4, 8))


@pytest.fixture(scope="module")
def sweep():
    """24 cases of a rig, of which the last one failed; depth is radius times friction,
    left half as much.
    """
    radius, friction = np.array([*itertools.product(RADII, FRICTIONS)]).T
    state = np.array(["finished"] * 23 + ["failed"], dtype=object)
    fault = np.array([""] * 23 + ["no contact patch"], dtype=object)
    data = {
        "radius": ("case", radius, {"key": "counterface.roller_radius_mm"}),
        "friction": ("case", friction, {"key": "operation.friction"}),
        "strips": ("case", np.full(24, 20.0), {"key": "contact.strips"}),
        "state": ("case", state),
        "fault": ("case", fault),
    }
    wear = np.where(state == "finished", radius * friction, np.nan)
    for name in MEASURES:
        if QUANTITIES[name].dimensions == ("step", "wheel"):
            values = 1e-3 * np.stack([wear, 0.5 * wear], axis=-1)[:, None]
            data[name] = (("case", "campaign", "wheel"), values)
        else:
            data[name] = (("case", "campaign"), wear[:, None])
    names = {"case": np.arange(1, 25), "campaign_name": ("campaign", ["rig"])}
    return xr.Dataset(data, names, {"title": "radius and friction"})


def test_keys_with_several_values_are_varied(sweep):
    assert varied(sweep) == ["radius", "friction"]


def test_a_line_joins_the_cases_that_differ_in_one_key(sweep):
    """By radius, a line for each of eight frictions and wheel; those beyond six colours
    are grey.
    """
    ax = plot_over_key(sweep, "radius", "max_wear_depth", grid()[1][0, 0])
    assert len(ax.lines) == 2 * len(FRICTIONS)
    for k, friction in enumerate(FRICTIONS[:7]):
        right, left = ax.lines[2 * k : 2 * k + 2]
        np.testing.assert_array_equal(right.get_xdata(), RADII)
        np.testing.assert_allclose(
            right.get_ydata(), np.array(RADII) * friction, rtol=1e-12
        )
        np.testing.assert_allclose(
            left.get_ydata(), 0.5 * right.get_ydata(), rtol=1e-12
        )
        assert right.get_color() == (SERIES_COLOURS[k] if k < 6 else COLOURS["new"])
        assert right.get_label().startswith(
            "_" if k >= 6 else f"friction coefficient {friction:.6g}"
        )
    assert np.isnan(ax.lines[-1].get_ydata()[-1])
    assert ax.get_xlabel() == "Radius of the rollers at the profile's top [mm]"


def test_the_page_has_every_key_every_case_and_every_fault(sweep):
    text = render_sweep(sweep, "2026-11-30")
    assert "Computed on 2026-11-30." in text
    assert "How does wear depend on radius of the rollers" in text
    assert "profile&#39;s top and friction coefficient?" in text
    assert "24 cases: 23 finished, 1 failed." in text
    assert "Case 24: no contact patch" in text
    for key in ("radius", "friction"):
        assert f'id="figure-sweep_{key}"' in text
    assert "figure-sweep_strips" not in text
    assert text.count('<tr><th scope="row"') == 24
    words = "radius of the rollers at the profile's top"
    assert f"from 0.0500 ({words} 0.5 mm, friction coefficient 0.1) to 1.79" in (
        text.replace("&#39;", "'")
    )
    heads = text[text.index("Cases of the sweep") :]
    assert ">Friction coefficient</th>" in heads
    assert ">Radius of the rollers at the profile&#39;s top [mm]</th>" in heads
    assert "roller_<wbr>radius_<wbr>mm" not in heads


def test_the_page_names_every_version_that_computed_a_case(sweep):
    sources = "wearsim 0.2.0 (Python 3.11, numpy 2.0), wearsim 0.3.0.dev0 (Python 3.12)"
    text = render_sweep(sweep.assign_attrs(source=sources), "2026-11-30")
    assert "Computed on 2026-11-30 with wearsim 0.2.0 and wearsim 0.3.0.dev0." in text


def test_varied_laws_have_the_titles_of_other_pages(sweep):
    laws = np.where(np.arange(24) < 12, "usfd", "archard").astype(object)
    by_law = sweep.assign(radius=("case", laws, {"key": "wear.law"}))
    text = render_sweep(by_law)
    assert "(wear law USFD, friction coefficient 0.1)" in text
    ax = plot_over_key(by_law, "radius", "max_wear_depth", grid()[1][0, 0])
    assert set(ax.lines[0].get_xdata()) == {"USFD", "Archard"}


def test_a_sweep_without_a_finished_case_has_a_page(sweep):
    begun = sweep[["radius", "friction", "state", "fault"]].isel(case=[23])
    text = render_sweep(begun.assign_attrs(sweep.attrs))
    assert "1 case: 1 failed." in text
    assert "<figure" not in text


def test_the_chart_is_the_table():
    table = pd.DataFrame(
        {
            "scene": ["rig"] * 3,
            "models": ["a", "b", "c"],
            "time_ratio": [0.1, 1.0, np.nan],
            "depth_error": [0.05, 1e-6, np.nan],
            "pareto": [True, True, False],
        }
    )
    lines = plot_chart(table).axes[0].lines
    assert [line.get_xydata().tolist() for line in lines[:2]] == [
        [[0.1, 5.0]],
        [[1.0, 0.1]],
    ]
    assert lines[2].get_xdata().tolist() == [0.1, 1.0]
    text = render_chart(table, table)
    assert "rig: a, 0.10 times its CPU time, error 5 %." in text
    assert 'id="figure-chart"' in text
