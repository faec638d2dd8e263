"""Reprofilings and service life of a result: parts of the loss of diameter, the end."""

import numpy as np
import pytest
import xarray as xr

from wearsim.profile.measures import running_circle_level
from wearsim.profile.shape import Profile
from wearsim.profile.sources import standard_profile
from wearsim.results.limits import REPROFILED_AT, REPROFILED_PLACES, attributes_of
from wearsim.results.service_life import (
    AT_DISTANCE,
    LEAST_CUT,
    PARTS,
    reprofiling_table,
    service_life,
)

S1002 = standard_profile("S1002")
FLANK = np.tan(np.radians(70.0))  # of the straight flank of S1002


def reprofiled_axle(worn, cut, interval=10e3, count=2, reason="hollowing", **attrs):
    """Result of wheels that wear in the same way in each of `count` spans.

    `worn` are both wheels worn since S1002, and `cut` the radius between the templates
    before and after [m]; each span has a row at its begin and one at its end.
    """
    rows = []
    for span in range(count + 1):
        level = -span * cut
        for end in range(1 if span == count else 2):
            wheels = worn if end else (S1002, S1002)
            z = np.stack([wheel.z + level for wheel in wheels])
            y = np.stack([wheel.y for wheel in wheels])
            circle = [running_circle_level(*line) for line in zip(y, z, strict=True)]
            rows.append(
                {
                    "distance": (span + end) * interval,
                    "last_reprofiling": 2 * span,
                    "profile_y": y,
                    "profile_z": z,
                    "wheel_diameter": 2.0 * (0.46 + np.array(circle)),
                    "hollowing": np.array([2e-3, 1e-3]) * end,
                }
            )
    dims = {
        "profile_y": ("step", "wheel", "point"),
        "profile_z": ("step", "wheel", "point"),
        "wheel_diameter": ("step", "wheel"),
        "hollowing": ("step", "wheel"),
    }
    made = {
        name: (dims.get(name, ("step",)), np.stack([row[name] for row in rows]))
        for name in rows[0]
    }
    made["environment"] = ("operating_point", [0.18, 1.0])
    made["weight"] = ("operating_point", [1.0, 0.0])  # the second one is monitored
    limits = {"hollowing": 2e-3, "wheel_diameter": 0.9}
    stated = {REPROFILED_AT: reason, REPROFILED_PLACES: "", **attrs}
    return xr.Dataset(made, attrs={**attributes_of(limits, False), **stated})


def worn_by(depth=0.0, sideways=0.0):
    """S1002 with a lower surface, and with its flank worn sideways [m]."""
    lateral = np.where(S1002.y < -20e-3, sideways, 0.0)
    return Profile("worn", "wheel", S1002.y + lateral, S1002.z - depth)


def parts_of(table, wheel):
    """Parts of the loss at the first reprofiling of a wheel [mm]."""
    row = table[table["wheel"] == wheel].iloc[0]
    return {part: row[f"{part}_mm"] for part in PARTS}


def test_parts_of_the_loss_are_those_that_were_put_in():
    """1 and 0.5 mm worn all over, 0.3 mm of allowance, 0.2 mm more for cracks."""
    worn = worn_by(1e-3), worn_by(0.5e-3)
    data = reprofiled_axle(worn, 1.5e-3, **{LEAST_CUT: 0.3e-3})
    table = reprofiling_table(data)
    right = {"wear": 2.0, "profile": 0.0, "other_wheel": 0.0}
    left = {"wear": 1.0, "profile": 0.0, "other_wheel": 1.0}
    both = {"cracks": 0.4, "allowance": 0.6}
    assert parts_of(table, "right") == pytest.approx(right | both, abs=1e-9)
    assert parts_of(table, "left") == pytest.approx(left | both, abs=1e-9)
    np.testing.assert_allclose(table["loss_mm"], 3.0, atol=1e-9)
    assert table["cause"].unique().tolist() == ["hollowing"]
    assert table["interval_km"].tolist() == [10.0] * 4


def test_a_flank_worn_sideways_costs_its_slope_times_the_radius():
    """0.4 mm on a flank of 70 degrees; the circle between the vertices of the flange
    root costs a micrometre.
    """
    cut = 0.4e-3 * FLANK
    data = reprofiled_axle((worn_by(sideways=-0.4e-3), worn_by()), cut)
    table = reprofiling_table(data)
    assert parts_of(table, "right")["profile"] == pytest.approx(2e3 * cut, abs=2e-3)
    assert parts_of(table, "left")["other_wheel"] == pytest.approx(2e3 * cut, abs=2e-3)
    assert parts_of(table, "right")["wear"] == pytest.approx(0.0, abs=1e-9)
    place = table["tightest_place_y_mm"][0]
    assert -45.0 < place < -30.0


def test_life_is_projected_to_the_least_diameter():
    """3 mm of 20 mm each 10 km: the sixth cut leaves 902 mm, the seventh goes below 900
    mm at 70 km.
    """
    data = reprofiled_axle((worn_by(1e-3), worn_by(0.5e-3)), 1.5e-3, count=2)
    life = service_life(data)
    assert life.reprofilings == 2
    assert (life.interval, life.last_interval) == (10e3, 10e3)
    assert life.at_limits
    assert life.loss == pytest.approx(3e-3, rel=1e-9)
    assert life.environment == (0.18, 0.18)  # monitoring points do not count
    assert not life.met
    assert life.limit.name == "wheel_diameter"
    assert life.distance == pytest.approx(70e3, rel=1e-9)
    assert life.expected == 6
    assert sum(life.shares.values()) == pytest.approx(1.0, rel=1e-12)


def test_life_that_was_met_counts_the_reprofilings_before_it():
    data = reprofiled_axle((worn_by(1e-3), worn_by(0.5e-3)), 1.5e-3, count=7)
    life = service_life(data)
    assert life.met
    assert life.distance == pytest.approx(70e3, rel=1e-9)
    assert life.expected == 6


def test_prescribed_distances_are_a_cause_and_are_projected_through():
    worn = worn_by(1e-3), worn_by(0.5e-3)
    data = reprofiled_axle(worn, 1.5e-3, reason="")
    # files do not have empty attributes
    for name in (REPROFILED_AT, "limit_hollowing"):
        del data.attrs[name]
    data = data.assign_attrs({REPROFILED_PLACES: "10000 20000"})
    assert reprofiling_table(data)["cause"].unique().tolist() == [AT_DISTANCE]
    assert service_life(data).expected == 6
    assert not service_life(data).at_limits


def test_wheels_that_are_not_reprofiled_have_no_life():
    data = reprofiled_axle((worn_by(1e-3), worn_by(1e-3)), 1e-3)
    never = data.isel(step=[0, 1])
    assert reprofiling_table(never).empty
    life = service_life(never)
    assert life.reprofilings == 0
    assert np.isnan(life.interval)
    assert service_life(data.drop_vars("last_reprofiling")) is None
