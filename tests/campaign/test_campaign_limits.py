"""Campaigns with limits: where they are met, and that they end there if the scene says
so.
"""

from dataclasses import dataclass, replace

import netCDF4
import numpy as np
import pytest

from wearsim.campaign.directory import read_status
from wearsim.campaign.run import run_evolution
from wearsim.results import LAYOUT, row_count
from wearsim.results.limits import attributes_of

STEPS = 12


@pytest.fixture
def limited(synthetic):
    """Function that gives the synthetic campaign with limits."""

    @dataclass(frozen=True)
    class Limited(synthetic.SyntheticEvolution):
        limits: tuple = ()
        end: bool = False

        @property
        def header(self):
            header = synthetic.header()
            return replace(
                header,
                attributes={
                    **header.attributes,
                    **attributes_of(dict(self.limits), self.end),
                },
            )

    return lambda end, **limits: Limited(STEPS, limits=tuple(limits.items()), end=end)


def depths(path):
    with netCDF4.Dataset(path) as file:
        return np.array(file["distance"][:]), np.array(file["max_wear_depth"][:])


@pytest.fixture(scope="module")
def free(synthetic, tmp_path_factory):
    """Result without limits."""
    return run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path_factory.mktemp("free"), "rig"
    )


def test_limits_that_do_not_end_a_campaign_are_told_and_change_nothing(
    limited, free, tmp_path
):
    run, depth = depths(free)
    limit = 0.5 * (depth[4] + depth[5]).max()
    path = run_evolution(
        limited(False, max_wear_depth=limit, hollowing=1.0), tmp_path, "rig"
    )
    with netCDF4.Dataset(path) as file, netCDF4.Dataset(free) as other:
        for name in LAYOUT:
            assert np.array_equal(file[name][:], other[name][:]), name
        assert file.limit_max_wear_depth == limit
        assert file.finished == "distance reached"
        assert run[4] < file.limit_max_wear_depth_met_right < run[5]
        assert "limit_hollowing_met_right" not in file.ncattrs()


def test_a_campaign_ends_with_the_step_in_which_a_limit_is_met(limited, free, tmp_path):
    _, depth = depths(free)
    limit = 0.5 * (depth[4] + depth[5]).max()
    events = []
    path = run_evolution(
        limited(True, max_wear_depth=limit), tmp_path, "rig", events.append
    )
    assert row_count(path) == 6
    with netCDF4.Dataset(path) as file:
        assert file.finished == "limit of largest wear depth of the wheel met"
        assert (
            float(file["max_wear_depth"][-1].max())
            >= limit
            > float(file["max_wear_depth"][-2].max())
        )
    assert events[-1].ended == "limit of largest wear depth of the wheel met"
    assert read_status(tmp_path)["campaigns"]["rig"]["ended"] == events[-1].ended
    seen = []
    run_evolution(limited(True, max_wear_depth=limit), tmp_path, "rig", seen.append)
    assert [(event.kind, event.step) for event in seen] == [("complete", 5)]
    assert seen[0].ended == events[-1].ended


def test_a_campaign_stopped_after_each_step_ends_at_the_same_limit(
    limited, free, tmp_path, stopped_at
):
    """Also where the step that met the limit was the last one written: nothing goes on
    behind it.
    """
    _, depth = depths(free)
    evolution = limited(True, max_wear_depth=0.5 * (depth[4] + depth[5]).max())
    for name in ("one", "other"):
        (tmp_path / name).mkdir()

    for step in range(6):
        with stopped_at(step) as stop:
            run_evolution(evolution, tmp_path / "one", "rig", stop)
    path = run_evolution(evolution, tmp_path / "one", "rig")
    whole = run_evolution(evolution, tmp_path / "other", "rig")
    assert row_count(path) == 6
    with netCDF4.Dataset(path) as file, netCDF4.Dataset(whole) as other:
        for name in LAYOUT:
            assert np.array_equal(file[name][:], other[name][:]), name
        assert file.finished == other.finished
