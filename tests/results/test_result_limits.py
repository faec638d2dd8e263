"""Limits of a campaign and where they are met."""

import numpy as np
import pytest
import xarray as xr

from wearsim.quantities import QUANTITIES
from wearsim.results import FILL_FLOAT, GROUPS, layout_of, open_results
from wearsim.results.limits import (
    END,
    LIMITED,
    REPROFILED_AT,
    REPROFILED_PLACES,
    attributes_of,
    distances_to,
    ending_limits,
    first_met,
    limits_met,
    limits_of,
    met_at,
    met_attributes,
)

RUN = np.array([0.0, 1e3, 3e3, 4e3])


@pytest.mark.parametrize(
    ("name", "values", "limit", "at"),
    [
        (
            "hollowing",
            [0.0, 1e-3, 3e-3, 4e-3],
            1.5e-3,
            1.5e3,
        ),  # linear between two rows
        ("hollowing", [0.0, 1e-3, 3e-3, 4e-3], 3e-3, 3e3),  # exactly at a row
        (
            "flange_thickness",
            [32e-3, 31e-3, 29e-3, 28e-3],
            30e-3,
            2e3,
        ),  # a smallest value
        ("hollowing", [0.0, 2e-3, 1e-3, 4e-3], 2e-3, 1e3),  # the first time
        ("hollowing", [2e-3, 2e-3, 2e-3, 2e-3], 1e-3, 0.0),  # met by the new wheel
        ("hollowing", [0.0, 1e-3, 3e-3, 4e-3], 5e-3, None),
        (
            "hollowing",
            [0.0, FILL_FLOAT, np.nan, 4e-3],
            2e-3,
            2e3,
        ),  # missing ones are passed over
        ("hollowing", [FILL_FLOAT] * 4, 2e-3, None),
    ],
)
def test_a_limit_is_met_between_two_rows(name, values, limit, at):
    actual = met_at(RUN, np.array(values), name, limit)
    assert actual == (None if at is None else pytest.approx(at, rel=1e-12))


def test_attributes_hold_the_limits_bit_by_bit():
    limits = {"flange_thickness": 22e-3, "equivalent_conicity": 0.4}
    actual = attributes_of(limits, True)
    assert limits_of({"title": "other", **actual}) == limits
    assert END in actual
    assert END not in attributes_of(limits, False)
    assert limits_of({}) == {}


def test_a_row_meets_a_limit_on_either_wheel_and_missing_values_meet_none():
    row = {
        "flange_thickness": np.array([25e-3, 22e-3]),
        "hollowing": np.array([FILL_FLOAT, 0.0]),
        "equivalent_conicity": np.asarray(FILL_FLOAT),
    }
    limits = {"hollowing": 2e-3, "equivalent_conicity": 0.4}
    assert first_met(row, limits) is None
    assert first_met(row, {**limits, "flange_thickness": 22e-3}) == "flange_thickness"


def test_met_limits_are_stated_by_side():
    rows = [
        {
            "distance": np.asarray(run),
            "flange_thickness": np.array([32e-3 - 1e-6 * run, 32e-3]),
            "equivalent_conicity": np.asarray(0.1 + 1e-4 * run),
        }
        for run in RUN
    ]
    actual = met_attributes(
        rows, {"flange_thickness": 30e-3, "equivalent_conicity": 0.2}
    )
    assert actual == {
        "limit_flange_thickness_met_right": pytest.approx(2e3, rel=1e-12),
        "limit_equivalent_conicity_met": pytest.approx(1e3, rel=1e-12),
    }
    assert met_attributes(rows, {}) == {}


def test_limited_measures_are_variables_of_the_rows():
    layout = layout_of([next(iter(group)) for group in GROUPS.values()])
    for name in LIMITED:
        assert layout[name].dimensions[:2] in (("step",), ("step", "wheel"))
        assert name in QUANTITIES


def test_limits_of_an_open_result(tmp_path, write_campaign):
    write_campaign(tmp_path / "rig.nc", "rig", 6, 20e-9)
    with open_results(tmp_path / "rig.nc") as data:
        data.attrs |= attributes_of(
            {"max_wear_depth": 1.1e-3, "equivalent_conicity": 0.2}, False
        )
        depth, conicity = limits_met(data)
    # 20 nm per metre on the right wheel, 0.9 times as much on the left one; 60 km are
    # run
    assert depth.distance == (pytest.approx(55e3, rel=1e-9), None)
    assert conicity.distance == (pytest.approx(15e3, rel=1e-9),)


def test_of_values_along_the_profile_the_worst_counts():
    damage = np.zeros((2, 3, 5))
    damage[1, 2, 3] = 1.0
    laws = ("wlrm", "wlrm", "wlrm")
    row = {"distance": np.asarray(2e3), "fatigue_damage": damage}
    assert first_met(row, {"fatigue_damage": 1.0}, laws) == "fatigue_damage"
    assert first_met(row, {"fatigue_damage": 1.1}, laws) is None
    rows = [{"distance": np.asarray(0.0), "fatigue_damage": np.zeros((2, 3, 5))}, row]
    assert met_attributes(rows, {"fatigue_damage": 0.5}, laws) == {
        "limit_fatigue_damage_met_left": 1e3
    }


def test_damage_that_counts_no_cycles_meets_no_limit(tmp_path, write_campaign):
    """An index of 5 beside a damage of 0.4 by wlrm: no crack, and no limit of 1 met."""
    laws = ("surface_fatigue_index_local", "wlrm")
    damage = np.zeros((2, 2, 181))
    damage[:, 0], damage[0, 1, 7] = 5.0, 0.4
    rows = [
        {"distance": np.asarray(run), "fatigue_damage": run / 1e3 * damage}
        for run in (0.0, 1e3)
    ]
    assert first_met(rows[1], {"fatigue_damage": 1.0}, laws) is None
    assert first_met(rows[1], {"fatigue_damage": 1.0}, laws[:1]) is None
    assert first_met(rows[1], {"fatigue_damage": 0.4}, laws) == "fatigue_damage"
    assert met_attributes(rows, {"fatigue_damage": 0.2}, laws) == {
        "limit_fatigue_damage_met_right": 500.0
    }
    assert met_attributes(rows, {"fatigue_damage": 0.2}, laws[:1]) == {}
    write_campaign(tmp_path / "rig.nc", "rig", 1, 20e-9)
    with open_results(tmp_path / "rig.nc") as data:
        along = np.stack([row["fatigue_damage"] for row in rows])
        limited = data.assign(
            fatigue_name=("fatigue", list(laws)),
            fatigue_damage=(("step", "wheel", "fatigue", "point"), along),
        ).assign_attrs(attributes_of({"fatigue_damage": 0.2}, False))
        (met,) = limits_met(limited)
    assert met.distance == (5e3, None)  # 10 km are run


def test_limits_that_have_wheels_reprofiled_end_no_campaign():
    given = attributes_of({"hollowing": 2e-3, "flange_thickness": 22e-3}, True)
    assert ending_limits(given) == limits_of(given)
    assert ending_limits({**given, REPROFILED_AT: "hollowing flange_gradient"}) == {
        "flange_thickness": 22e-3
    }
    assert ending_limits(attributes_of({"hollowing": 2e-3}, False)) == {}


def turned_wheels(spans):
    """Wheels reprofiled every 40 km at 2 mm of hollowing, the last span 20 km long.

    A span wears 0.5 mm off the diameter and 1 mm off the flange, the lathe takes 1.5 mm
    of the diameter and restores the shape. The left wheel wears half as fast.
    """
    rows, last = [], 0
    for span in range(spans):
        for part in (0.0, 0.25, 0.5, 0.75, 1.0)[: 5 if span < spans - 1 else 3]:
            last = len(rows) if part == 0.0 else last
            wear = part * np.array([1.0, 0.5])
            rows.append(
                (
                    40e3 * (span + part),
                    last,
                    2e-3 * wear,
                    32e-3 - 1e-3 * wear,
                    0.92 - 2e-3 * span - 5e-4 * wear,
                )
            )
    names = ("hollowing", "flange_thickness", "wheel_diameter")
    run, reprofiled, *measures = map(np.array, zip(*rows, strict=True))
    wheels = {
        name: (("step", "wheel"), values)
        for name, values in zip(names, measures, strict=True)
    }
    limits = {"hollowing": 2e-3, "flange_thickness": 31.3e-3, "wheel_diameter": 0.9}
    return xr.Dataset(
        {"distance": ("step", run), "last_reprofiling": ("step", reprofiled), **wheels},
        attrs={
            **attributes_of(limits, False),
            REPROFILED_AT: "hollowing",
            REPROFILED_PLACES: "",
        },
    )


@pytest.mark.parametrize("spans", [2, 3, 6])
def test_the_diameter_is_projected_through_reprofilings(spans):
    """2 mm are lost in 40 km, of 20 mm: the lathe takes the last of them at 400 km."""
    data = turned_wheels(spans)
    worn = data.isel(step=[0]).assign(
        wheel_diameter=(("step", "wheel"), [[0.922, 0.923]])
    )
    later = data.assign(last_reprofiling=data["last_reprofiling"] + 1)
    turned_at_once = xr.concat([worn, later], "step")
    for wheels in (data, turned_at_once):
        (diameter,) = (
            one for one in limits_met(wheels) if one.name == "wheel_diameter"
        )
        at, met = distances_to(wheels, diameter)
        assert not met.any()
        np.testing.assert_allclose(at, 400e3, rtol=1e-9)


def test_a_shape_that_is_restored_is_projected_to_the_next_reprofiling_only():
    """The flange loses 0.7 mm in 28 km, before it is turned at 40 km, the left one 0.35
    mm in as much.
    """
    for spans, expected in ((1, [28e3, np.inf]), (3, [28e3, np.inf])):
        data = turned_wheels(spans)
        (flange,) = (one for one in limits_met(data) if one.name == "flange_thickness")
        at, met = distances_to(data, flange)
        np.testing.assert_allclose(at, expected)
        assert met.tolist() == [spans > 1, False]
    sooner = turned_wheels(1).assign_attrs({REPROFILED_PLACES: "10000 25000"})
    assert np.isinf(
        distances_to(sooner, flange._replace(distance=(None, None)))[0]
    ).all()


def test_what_the_lathe_leaves_adds_up_to_a_limit():
    """Hollowing by 0.1 mm more from span to span: 2.1 mm at the end of the second, 2.5
    mm of the sixth.
    """
    data = turned_wheels(3)
    span = (data["last_reprofiling"] == np.arange(data.sizes["step"])).cumsum(
        "step"
    ) - 1
    data["hollowing"] += 1e-4 * span
    data.attrs |= {"limit_hollowing": 2.5e-3}
    (hollow,) = (one for one in limits_met(data) if one.name == "hollowing")
    at, _ = distances_to(data, hollow)
    assert at[0] == pytest.approx(6 * 40e3, rel=1e-9)
