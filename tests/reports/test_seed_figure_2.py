"""Initial contact with yaw: the committed report on figure 2 of the seed paper, and its
limits.
"""

import numpy as np
import pandas as pd
import pytest
import seed_figure_2
from initial_contact import initial_contact
from seed_figure_2 import (
    COLUMNS,
    COUNTERFACES,
    SHIFT,
    WHEELSET,
    located,
    two_point_contacts,
)


@pytest.fixture(scope="module")
def jumps():
    near = SHIFT[(SHIFT > 4.5e-3) & (SHIFT < 6e-3)]
    return {
        name: two_point_contacts(counterface, near)
        for name, counterface in COUNTERFACES.items()
    }


def test_the_committed_values_are_computed_again(reports):
    """Every tenth shift, positions to 1 um: the flat tread amplifies rounding."""
    committed = pd.read_csv(reports / "seed_figure_2.csv")
    assert list(committed.columns) == ["counterface", "shift_mm", *COLUMNS]
    for name, counterface in COUNTERFACES.items():
        rows = committed[committed["counterface"] == name].iloc[::10]
        contact = located(counterface, SHIFT[::10])
        np.testing.assert_allclose(rows["shift_mm"], 1e3 * SHIFT[::10], atol=1e-9)
        for column, (value, factor) in COLUMNS.items():
            np.testing.assert_allclose(
                factor * contact[value], rows[column], rtol=0.0, atol=1e-3
            )


@pytest.mark.slow
def test_the_script_writes_the_committed_report(reports, tmp_path, same_numbers):
    seed_figure_2.main(["--out", str(tmp_path / "deep")])
    names = {"seed_figure_2.md", "seed_figure_2.csv", "seed_figure_2.svg"}
    assert {path.name for path in (tmp_path / "deep").iterdir()} == names
    written, committed = (
        (folder / "seed_figure_2.md").read_text()
        for folder in (tmp_path / "deep", reports)
    )
    same_numbers(written, committed)


def test_two_point_contact_comes_at_about_5_mm_and_earlier_on_the_roller(jumps):
    """The paper: about 5 mm on the rail, slightly different on the roller."""
    for name, shift in (("rail", 5.36e-3), ("roller 1 m", 5.20e-3)):
        ((at, before, after),) = jumps[name]
        assert at == pytest.approx(shift, abs=0.02e-3)
        assert before["x"] < 0.0
        assert after["x"] > 20e-3  # the flange, ahead of the axle
        assert after["contact_angle"] < -1.1


def test_both_points_touch_at_the_jump(jumps):
    """The wheelset's roll has none: on the climbing flange it changes by 7 rad per
    metre of shift.
    """
    for name, counterface in COUNTERFACES.items():
        sides = located(counterface, jumps[name][0][0] + np.array([-1e-7, 1e-7]))
        assert abs(np.diff(sides["roll"])[0]) < 2e-6
        assert abs(np.diff(sides["wheel_y"])[0]) > 40e-3


def test_without_yaw_the_contact_lies_under_the_axle_alike_on_rail_and_roller():
    shift = np.linspace(-5e-3, 5e-3, 11)
    rail, roller = (
        initial_contact(WHEELSET, counterface, shift, free_roll=True)
        for counterface in COUNTERFACES.values()
    )
    assert not rail["x"].any()
    for name, values in rail.items():
        np.testing.assert_allclose(values, roller[name], rtol=0.0, atol=1e-12)


def test_the_tread_contact_lies_where_the_cone_and_the_curvature_put_it():
    """First order in yaw: x = -yaw b / (1 + kappa r) - yaw r' r / (1 + kappa r), b to
    the track's middle.
    """
    for counterface in COUNTERFACES.values():
        contact = initial_contact(WHEELSET, counterface, np.zeros(1), yaw=1e-3)
        radius, reach = contact["wheel_radius"][0], 0.75 + contact["wheel_y"][0]
        lag = 1e-3 * (reach + np.tan(contact["contact_angle"][0]) * radius)
        assert contact["x"][0] == pytest.approx(
            -lag / (1.0 + counterface.curvature * radius), rel=1e-3
        )
