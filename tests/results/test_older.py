import gzip
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.report.inspect import inspect
from wearsim.results import layout_of, open_results, row_count
from wearsim.results.checks import reprofilings
from wearsim.results.schema import ADDED, RENAMED

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Result of wearsim 0.1: worn and redressed rollers, a reprofiling, a comparison law, fatigue laws."""
    path = tmp_path_factory.mktemp("older") / "rig.nc"
    path.write_bytes(gzip.decompress((DATA / "results_schema_3.nc.gz").read_bytes()))
    return path


def test_results_of_schema_3_open_with_present_names_and_the_same_values(path):
    with open_results(path) as dataset, xr.open_dataset(path) as stored:
        layout = layout_of(dataset.variables)
        assert set(dataset.variables) == {*layout, "operating_point", "wheel"} - set(ADDED)
        assert {each.group for each in layout.values()} == {
            "", "comparison", "fatigue", "counterface", "reprofiling",
        }  # fmt: skip
        for name in stored.variables:
            new = dataset[RENAMED.get(name, name)]
            assert new.dims == layout[new.name].dimensions, name
            np.testing.assert_array_equal(new.values, stored[name].values, err_msg=name)
        assert not set(RENAMED) & {*dataset.variables, *dataset.dims, *dataset.attrs}
        assert len(dataset.attrs) == len(stored.attrs)
        assert dataset.attrs["comparison_numbers"] == stored.attrs["beside_numbers"]
        assert dataset["magic_wear_rate"].attrs["long_name"] == QUANTITIES["magic_wear_rate"].meaning
        assert "operating_point_name" in dataset.coords


def test_results_of_schema_3_are_read_by_what_reads_results(path):
    actual = inspect(path)
    assert list(actual["damage"]["comparison"]) == ["archard"]
    assert actual["counterface"]["counterface_redressed_count"] == 2
    with open_results(path) as dataset:
        (reprofiling,) = reprofilings(dataset)
        assert reprofiling.distance == pytest.approx(20e3)


def test_incomplete_file_of_schema_3_is_rejected_by_its_present_name(path, tmp_path):
    other = tmp_path / "rig.nc"
    other.write_bytes(path.read_bytes())
    with netCDF4.Dataset(other, "a") as file:
        file.renameVariable("op_shift", "op_shifted")
    with pytest.raises(ResultError, match=r"\(without shift\).*run its scene again"):
        open_results(other)


def test_file_of_schema_3_is_not_appended_to(path):
    """A campaign goes on from its records; the file is then written anew in the present schema."""
    with pytest.raises(ResultError, match=r"older wearsim \(schema 3, this one reads 5\)"):
        row_count(path)
