"""Balance of bogies in curves: the committed report, rows of it computed again, what a
scan says.
"""

from functools import partial

import curving
import numpy as np
import pandas as pd
import pytest
from curving import (
    AXLES,
    DEFICIENCY,
    GROUPS,
    MODELS,
    PAIRS,
    RADII,
    REFUSED,
    TARGET,
    TARGETED,
    VEHICLES,
)

from wearsim.contact.balance import AT_JUMP as ACCEPTED_AT_JUMP

FREIGHT = next(
    one for one in GROUPS if one.vehicle == "freight_wagon" and one.model == "fast"
)


@pytest.fixture(scope="module")
def committed(reports):
    return curving.read_rows(reports / "curving.csv")


@pytest.fixture(scope="module")
def found():
    """Rows of a freight wagon at two radii."""
    rows, grids = curving.rows_of(FREIGHT, (500, 2000))
    assert not grids
    return rows


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "curving.csv").write_bytes((reports / "curving.csv").read_bytes())
    curving.main(["--from-csv", "--out", str(tmp_path)])
    assert (tmp_path / "curving.md").read_text() == (reports / "curving.md").read_text()


def test_every_combination_is_in_the_report_with_a_balance(committed):
    """Within the target with `standard`; with `fast` but for less than three, where
    forces jump.
    """
    usual = committed[committed["cant_deficiency_mm"] == DEFICIENCY]
    assert (
        len(usual) == len(MODELS) * len(PAIRS) * len(VEHICLES) * len(RADII) == 2 * 512
    )
    assert not committed.duplicated([*FREIGHT.names, "radius_m"]).any()
    assert not (committed["outcome"] == REFUSED).any()
    beyond = committed[(committed[list(TARGETED)] >= TARGET).any(axis=1)]
    assert len(beyond) < 3
    assert (beyond["model"] == "fast").all()


@pytest.mark.xfail(
    strict=True,
    reason=(
        "measured 1.2e-2 and 1.2e-3 of two axles by fast, target 1e-4: contact solved "
        "anew rests on other patches at the same shift and yaw, as a second one closes"
    ),
)
@pytest.mark.parametrize("target", [TARGET, ACCEPTED_AT_JUMP])
def test_axles_at_a_jump_are_balanced_as_well(committed, target):
    assert (committed[list(TARGETED)] < target).all(axis=None)


def test_sampled_rows_of_the_report(committed, found):
    """To the balance of forces, 1e-4 of the axle load, which moves an axle on the tread
    by some um.
    """
    rows = committed[
        np.logical_and.reduce(
            [committed[key] == value for key, value in FREIGHT.names.items()]
        )
    ]
    rows = rows.set_index("radius_m").loc[found["radius_m"]]
    assert list(found["outcome"]) == list(rows["outcome"])
    assert (found[list(TARGETED)] < TARGET).all(axis=None)
    for axle in AXLES:
        for name in (f"{axle}_shift_mm", f"{axle}_yaw_mrad"):
            assert found[name].to_numpy() == pytest.approx(
                rows[name].to_numpy(), abs=2e-3
            )
        name = f"{axle}_wear_number_N"
        assert found[name].to_numpy() == pytest.approx(rows[name].to_numpy(), rel=5e-3)


def test_residuals_are_those_of_the_state(found):
    """Away from the balance by 10 um, as one bogie has them; the spring alone makes 40
    N of that.
    """
    bogie = curving.OneBogie(FREIGHT, 2000)
    row = found.iloc[1]
    start = np.array(
        [[row[f"{axle}_shift_mm"], row[f"{axle}_yaw_mrad"], 1.0] for axle in AXLES]
    )
    state = bogie.nearest([start])
    assert np.abs(bogie.residual(state.ravel())).max() < TARGET
    assert state[:, :2] == pytest.approx(start[:, :2], abs=2e-3)
    state[0, 0] += 10e-3
    assert np.abs(bogie.residual(state.ravel())).max() > TARGET


class StubBogie:
    """Residuals that fall with shift and yaw, the force also by a jump at some
    shift.
    """

    weight = 1e5

    def __init__(self, jump, force=0.0):
        self.jump, self.force = jump, force

    def residual_of_axle(self, state, axle, place):
        """As of `OneBogie`, with 100 N/um and 10 N m/urad."""
        shift, yaw = place.T
        force = self.force - 100e6 * shift - self.jump * (np.sign(shift - 0.3e-6) + 1.0)
        return np.stack([force, -10e6 * yaw], axis=1)


@pytest.mark.parametrize(
    ("bogie", "cause", "jumps"),
    [
        (StubBogie(jump=0.0), "search", 0),
        (StubBogie(jump=500.0, force=200.0), "jump", 1),
        (StubBogie(jump=0.0, force=1e5), "none", 0),
    ],
)
def test_a_scan_names_the_cause(bogie, cause, jumps):
    row, grid = curving.scan(bogie, np.zeros((2, 3)), 0, shifts=20, yaws=4)
    assert (row["cause"], row["jumps"]) == (cause, jumps)
    assert row["force_step_kN"] == pytest.approx(0.1 + 2e-3 * bogie.jump)
    assert grid.shape == (20, 4, 4)


def test_a_refused_combination_is_scanned_and_listed(monkeypatch, found, tmp_path):
    """As if the search had not found the balance at 2000 m: the scan shows that there
    is one.
    """
    monkeypatch.setattr(curving, "THINNED", 5)
    monkeypatch.setattr(curving, "NEIGHBOURS", 1)
    monkeypatch.setattr(curving, "scan", partial(curving.scan, shifts=10, yaws=4))
    row, grid = curving.refused_row(FREIGHT, 2000, found.to_dict("records"))
    assert len(grid) == 2 * 4
    assert row["cause"] == "search"
    rows = pd.concat([found.iloc[:1], pd.DataFrame([row], columns=curving.COLUMNS)])
    rows.to_csv(tmp_path / "curving.csv", index=False)
    curving.main(["--from-csv", "--out", str(tmp_path)])
    page = (tmp_path / "curving.md").read_text()
    assert (
        "1 have a balance, 0 of them with an axle at a jump of the contact, and 1 "
        "are refused"
    ) in page
    assert curving.CAUSES["search"] in page
