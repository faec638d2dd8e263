import json
import re

import matplotlib as mpl
import numpy as np
import pytest

from wearsim.errors import ResultError
from wearsim.report.inspect import inspect, summary, summary_text, write_figures
from wearsim.results.limits import attributes_of


def test_summary_is_the_dataset(run_directory, rig):
    actual = inspect(run_directory / "rig.nc")
    assert actual["kind"] == "rig"
    assert actual["finished"] is True
    assert actual["steps"] == 6
    assert actual["distance"] == 60e3
    assert (actual["operating_points"], actual["monitoring_points"]) == (7, 4)
    assert actual["worn"]["max_wear_depth"] == rig["max_wear_depth"].values[-1].tolist()
    assert actual["new"]["equivalent_conicity"] == rig["equivalent_conicity"].values[0]
    assert actual["worn"]["equivalent_conicity"] is None
    assert actual["contact"]["power"] == [
        np.nanmin(rig["power"].values[-1]),
        np.nanmax(rig["power"].values[-1]),
    ]
    assert sum(actual["regime_share"].values()) == pytest.approx(1.0, rel=1e-12)


def test_residuals_of_forces_are_in_the_text_of_results_that_hold_them(rig):
    missing = np.full((rig.sizes["step"], rig.sizes["operating_point"]), np.nan)
    dims = "step", "operating_point"
    without = summary(rig.assign(force_residual=(dims, missing)))
    assert without == summary(rig)
    missing[:, :2] = [3e-4, 2e-5]
    text = summary_text(summary(rig.assign(force_residual=(dims, missing))))
    (line,) = [line for line in text.splitlines() if "over the axle load" in line]
    assert line.split("[%]")[1].split() == ["0.002000", "to", "0.03000"]


def test_result_warnings_are_among_the_warnings(run_directory):
    """0.72 mm in 90 km of field; the rig's tread wear is nobody's service."""
    actual = inspect(run_directory / "field.nc")
    assert [line[:43] for line in actual["warnings"]] == [
        "tread wear of 800 mm per 100 000 km is abov"
    ]
    assert "warning: tread wear of 800 mm" in summary_text(actual)
    assert inspect(run_directory / "rig.nc")["warnings"] == []


def test_summary_is_valid_json(run_directory):
    actual = inspect(run_directory / "field.nc")
    assert json.loads(json.dumps(actual, allow_nan=False)) == actual


def test_text_shows_the_units_people_read(run_directory):
    text = summary_text(inspect(run_directory / "rig.nc"))
    assert text.startswith("rig: finished, 60 km (distance reached); ")
    assert text.splitlines()[0].endswith("right wheel 1.200 mm deep; no limits stated")
    assert re.search(r"^Wear steps +6$", text, re.MULTILINE)
    assert "Largest wear depth [mm]" in text
    assert "1.200" in text
    assert "undefined" in text  # conicity at the end
    assert "nan" not in text.lower()


def test_depth_counts_from_the_last_reprofiling(reprofiled):
    """30 of 60 km."""
    actual = summary(reprofiled)
    assert actual["distance_since_reprofiling"] == 30e3
    text = " ".join(summary_text(actual).split())
    assert "right wheel 1.200 mm deep in 30 km since reprofiling; no limits" in text


def test_figures_are_written_and_change_no_global_setting(run_directory, tmp_path):
    before = dict(mpl.rcParams)
    files = write_figures(run_directory / "rig.nc", tmp_path / "figures")
    assert {file.name for file in files} >= {
        "rig_wheels.svg",
        "rig_wear_depth.svg",
        "rig_contact.svg",
    }
    for file in files:
        assert "<path" in file.read_text(encoding="utf-8")
    assert dict(mpl.rcParams) == before


def test_faults_are_one_line(run_directory, tmp_path):
    with pytest.raises(ResultError, match="does not exist"):
        inspect(tmp_path / "absent.nc")
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(ResultError, match="figures cannot be written"):
        write_figures(run_directory / "rig.nc", tmp_path / "taken")


def test_limits_and_where_they_are_met(rig):
    """20 nm of depth per metre on the right wheel, 0.9 times as much on the left one;
    60 km are run.
    """
    limited = rig.assign_attrs(
        attributes_of({"max_wear_depth": 1.1e-3, "equivalent_conicity": 0.2}, True)
    )
    actual = summary(limited)
    assert actual["limits"]["max_wear_depth"] == {
        "limit": 1.1e-3,
        "met": [pytest.approx(55e3), None],
    }
    text = summary_text(actual)
    assert " ".join(text.split()).startswith(
        "rig: finished, 60 km (distance reached); right wheel 1.200 mm deep; first "
        "limit: equivalent conicity, met at 15 km"
    )
    assert (
        "Largest wear depth of the wheel, at most 1.1 mm: right met at 55 km, "
        "left not met"
    ) in text
    assert "Equivalent conicity, at most 0.2: met at 15 km" in text
    assert summary(rig)["limits"] == {}


def test_the_first_limit_is_that_of_the_wheel_that_meets_it_first(rig):
    """20 nm of depth per metre on the right wheel: 1.6 mm after 80 km."""
    limited = rig.assign_attrs(attributes_of({"max_wear_depth": 1.6e-3}, True))
    first = summary(limited)["first_limit"]
    assert (first["name"], first["wheel"]) == ("max_wear_depth", "right")
    assert first["met"] is False
    assert first["distance"] == pytest.approx(80e3)
    text = " ".join(summary_text(summary(limited)).split())
    assert "largest wear depth (right), not met, after about 80 km" in text
    far = rig.assign_attrs(attributes_of({"max_wear_depth": 1.0}, True))
    text = " ".join(summary_text(summary(far)).split())
    assert "1.200 mm deep; no limit in sight " in text


def test_details_are_left_out_unless_asked_for(run_directory):
    whole = summary_text(inspect(run_directory / "field.nc"))
    short = summary_text(inspect(run_directory / "field.nc"), details=False)
    assert whole.startswith(short)
    assert "Wear law: USFD" in whole
    assert "Wear law: " not in short
    assert "Wheel radius at the running circle [mm]: 460" in whole
    assert "warning: tread wear" in short
    assert max(map(len, whole.splitlines())) <= 100
