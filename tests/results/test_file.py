import contextlib
import importlib.util
import os
import pickle
import re
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from wearsim.errors import NumericalError, ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import (
    FILL_FLOAT,
    LAYOUT,
    ROW,
    append,
    create,
    load_results,
    open_results,
    row_count,
    schema,
    verify,
)


@pytest.fixture(scope="module")
def synthetic():
    path = Path(__file__).parents[1] / "campaign" / "synthetic_campaign.py"
    spec = importlib.util.spec_from_file_location(
        "synthetic_campaign_for_results", path
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def header(synthetic):
    return synthetic.header()


@pytest.fixture
def rows(synthetic):
    """Rows of four consecutive states."""
    evolution = synthetic.SyntheticEvolution()
    state, taken = evolution.start()
    made = []
    for _ in range(4):
        evaluation = evolution.evaluate(state)
        made.append(evolution.row(state, evaluation, taken))
        state, taken = evolution.advance(state, evaluation)
    return made


@pytest.fixture
def path(tmp_path, header, rows):
    path = tmp_path / "rig.nc"
    create(path, header, rows[:1])
    append(path, header, rows[1:], 1)
    return path


def assert_rows(path, rows):
    assert row_count(path) == len(rows)
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name in ROW:
            expected = np.stack([row[name] for row in rows])
            np.testing.assert_array_equal(file[name][:], expected, err_msg=name)


def test_rows_come_back_bit_by_bit(path, rows):
    assert_rows(path, rows)


def test_rows_written_at_once_or_one_by_one_are_the_same(tmp_path, header, rows, path):
    create(tmp_path / "at_once.nc", header, rows)
    assert_rows(tmp_path / "at_once.nc", rows)


def test_open_results_is_lazy_and_has_units_long_names_and_coordinates(path, rows):
    with open_results(path) as dataset:
        assert set(LAYOUT) <= set(dataset.variables)
        numbers = ["step", "point"]
        for index in (names := ["operating_point", "wheel", "regime"]):
            assert dataset[index].attrs == dataset[f"{index}_name"].attrs
        for name, variable in dataset.drop_vars([*names, *numbers]).variables.items():
            assert variable.attrs["long_name"] == QUANTITIES[name].meaning
            assert variable.attrs.get("units", "") == QUANTITIES[name].unit
        assert not dataset["profile_z"].variable._in_memory
        assert set(dataset.coords) == {
            *schema.COORDINATES,
            *names,
            *numbers,
            "profile_y",
        }
        np.testing.assert_array_equal(dataset["profile_z"][-1], rows[-1]["profile_z"])
        assert list(dataset["wheel_name"].values) == ["right", "left"]
        assert dataset["operating_point_name"].values[0] == "block 0, µ 0.35"


def test_steps_points_and_wheels_are_selected_by_their_labels(
    path, tmp_path, header, rows
):
    with open_results(path) as dataset:
        state = dataset.sel(distance=1200.0, method="nearest")
        assert float(state["distance"]) == 1000.0
        np.testing.assert_array_equal(state["profile_z"], rows[1]["profile_z"])
        np.testing.assert_array_equal(
            dataset.sel(distance=slice(1000.0, 2000.0))["distance"], [1000.0, 2000.0]
        )
        point = dataset.sel(wheel="left", operating_point=["block 0, µ 0.35"])
        assert point.sizes["operating_point"] == 1
        np.testing.assert_array_equal(point["profile_z"][2], rows[2]["profile_z"][1])
    twice = [*rows[:3], {**rows[3], "distance": rows[2]["distance"]}]  # a reprofiling
    create(tmp_path / "twice.nc", header, twice)
    with open_results(tmp_path / "twice.nc") as dataset:
        for distance, step in ((1900.0, 3), ([100.0, 1900.0], [0, 3])):
            state = dataset.sel(distance=distance, method="nearest")
            np.testing.assert_array_equal(
                state["profile_z"], dataset["profile_z"][step]
            )
        assert dataset.sel(distance=2000.0).sizes["step"] == 2


def test_names_are_selected_with_the_nearest_distance_and_drawn_in_one_line(path, rows):
    with open_results(path) as dataset:
        (line,) = dataset.wear_depth.sel(
            distance=1900.0, wheel="right", method="nearest"
        ).plot(x="profile_y")
        np.testing.assert_array_equal(line.get_ydata(), rows[2]["wear_depth"][0])
        np.testing.assert_array_equal(line.get_xdata(), rows[2]["profile_y"][0])
        depth = dataset.wear_depth_by_regime.sel(regime="severe", distance=1000.0)
        np.testing.assert_array_equal(depth, rows[1]["wear_depth_by_regime"][:, 1])
        between = dataset.profile_z.swap_dims(step="distance").interp(distance=1500.0)
        expected = 0.5 * (rows[1]["profile_z"] + rows[2]["profile_z"])
        np.testing.assert_allclose(between, expected, rtol=1e-12, atol=1e-18)
        with pytest.raises(KeyError, match="wheel"):
            dataset.sel(wheel="both", distance=0.0, method="nearest")


@pytest.mark.parametrize(
    "part",
    [
        lambda data: data.isel(step=slice(1, 3)),
        lambda data: data.isel(step=-1),
        lambda data: data.sel(wheel="left", operating_point=["block 0, µ 0.35"]),
        lambda data: data[["wear_depth", "worn_area"]].sel(
            distance=1900.0, wheel="right", method="nearest"
        ),
        lambda data: data.isel(point=slice(0, 3)),
    ],
)
def test_a_part_saved_by_xarray_opens_again(path, tmp_path, part):
    with open_results(path) as dataset:
        saved = part(dataset).load()
    saved.to_netcdf(tmp_path / "part.nc")
    with open_results(tmp_path / "part.nc") as again:
        assert again.equals(saved)
        assert set(again.coords) == set(saved.coords)
    if set(saved.sizes) == {
        "point"
    }:  # what reads all of a result says what is not there
        with pytest.raises(ResultError, match="without regime_name"):
            load_results(tmp_path / "part.nc")


def test_viewers_draw_over_the_numbers_of_steps_and_points(path):
    with netCDF4.Dataset(path) as file:
        for name, size in (("step", 4), ("point", file.dimensions["point"].size)):
            assert file[name].dimensions == (name,)
            np.testing.assert_array_equal(file[name][:], np.arange(size))
            assert file[name].units == "1"
    with open_results(path) as dataset:
        assert {"step", "point"}.isdisjoint(
            dataset.xindexes
        )  # arithmetic aligns distances


def test_a_reader_that_is_done_holds_the_file_no_longer(path):
    with open_results(path) as dataset:
        assert float(dataset["distance"][-1]) == 3000.0
        with pytest.raises(OSError, match=path.name):
            netCDF4.Dataset(path, "a")
    netCDF4.Dataset(path, "a").close()


def test_missing_values_become_nan_and_nothing_else_does(path):
    with open_results(path) as dataset:
        assert int(dataset["area"].notnull().sum()) == 4 * 4 * 2
        assert bool(dataset["hollowing"].isnull().all())
        for name in LAYOUT:
            variable = dataset[name]
            if variable.dtype.kind == "f" and not LAYOUT[name].missing:
                assert bool(variable.notnull().all()), name


def test_file_follows_the_cf_rules_the_checker_does_not_know_by_itself(path):
    with netCDF4.Dataset(path) as file:
        assert file.getncattr("Conventions") == "CF-1.11"
        assert all(str(file.getncattr(name)) for name in file.ncattrs())
        assert "warnings" not in file.ncattrs()  # empty ones are left out
        for name in schema.COORDINATES:
            assert "_FillValue" not in file[name].ncattrs()
        for name, variable in file.variables.items():
            assert "axis" not in variable.ncattrs()
            assert all(str(variable.getncattr(key)) for key in variable.ncattrs()), name
        for name in ("wear_regime", "wear_regime_highest"):
            flags = file[name]
            assert len(flags.flag_meanings.split()) == len(flags.flag_values) == 4


@pytest.mark.cf
def test_compliance_checker_finds_nothing(path, assert_cf):
    assert_cf(path)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nan_is_stopped_and_the_file_stays_as_it_was(path, header, rows, value):
    bad = {**rows[0], "friction_work": rows[0]["friction_work"].copy()}
    bad["friction_work"][1, 7] = value
    with pytest.raises(NumericalError, match=r"friction_work\[1, 7\]"):
        append(path, header, [bad], 4)
    assert_rows(path, rows)


def test_row_of_wrong_shape_or_with_other_names_is_rejected(path, header, rows):
    with pytest.raises(ResultError, match="worn_area has shape"):
        append(path, header, [{**rows[0], "worn_area": np.zeros(3)}], 4)
    with pytest.raises(ResultError, match="worn_volume"):
        append(path, header, [{**rows[0], "worn_volume": np.zeros(2)}], 4)


def test_verify_counts_equal_rows_and_sees_a_single_bit(path, header, rows):
    readers = [lambda row=row: row for row in rows]
    assert verify(path, readers) == 4
    assert verify(path, [*readers, readers[0]]) == 4
    assert verify(path, readers[:3]) is None
    altered = {**rows[2], "profile_z": rows[2]["profile_z"].copy()}
    altered["profile_z"][0, 5] = np.nextafter(altered["profile_z"][0, 5], 1.0)
    assert verify(path, [*readers[:2], lambda: altered, readers[3]]) is None
    assert verify(path.with_name("none.nc"), readers) is None


def test_missing_foreign_and_damaged_files_are_one_line(tmp_path, path, impatient):
    with netCDF4.Dataset(tmp_path / "foreign.nc", "w") as file:
        file.title = "somebody else's"
    (tmp_path / "text.nc").write_text("not netCDF")
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(path.read_bytes()[:5000])
    for name, message in (
        ("absent.nc", "does not exist"),
        (".", "is not a file"),
        ("foreign.nc", "is not a result file of a wearsim campaign"),
        ("text.nc", "cannot be read as netCDF"),
        ("damaged.nc", "cannot be read as netCDF"),
    ):
        with pytest.raises(ResultError, match=message) as caught:
            open_results(tmp_path / name)
        assert "\n" not in str(caught.value)
        assert caught.value.exit_code == 2


def test_file_of_a_later_schema_is_rejected(path):
    with netCDF4.Dataset(path, "a") as file:
        file.wearsim_schema = np.int32(schema.SCHEMA + 1)
    with pytest.raises(ResultError, match="update wearsim"):
        open_results(path)


def test_file_of_an_earlier_schema_is_distinguished_from_a_foreign_one(path):
    with netCDF4.Dataset(path, "a") as file:
        file.wearsim_schema = np.int32(1)
        file.renameVariable("load_scale", "load_factor")
    with pytest.raises(
        ResultError,
        match=r"older wearsim \(schema 1, this one reads 5\); run its scene again",
    ):
        open_results(path)


def test_row_cut_short_by_a_kill_is_not_shown(path):
    with netCDF4.Dataset(path, "a") as file:
        file["profile_z"][4] = 0.0  # the step dimension grows, distance stays unwritten
    assert row_count(path) == 5
    with open_results(path) as dataset:
        assert dataset.sizes["step"] == 4
        assert float(dataset["distance"].max()) < FILL_FLOAT


def test_row_torn_by_a_kill_is_one_line_with_the_way_out(path):
    """The file opens, what its last append wrote does not."""
    content = bytearray(path.read_bytes())
    torn = 0
    for place in re.finditer(
        b"\x78\x01", bytes(content)
    ):  # the first bytes of what zlib packed
        with contextlib.suppress(zlib.error):
            zlib.decompressobj().decompress(content[place.start() :])
            content[place.start()] = 0
            torn += 1
    assert torn > 0
    path.write_bytes(content)
    assert row_count(path) == 4
    with pytest.raises(
        ResultError, match=r"damaged while it was written.*`wearsim resume"
    ) as caught:
        open_results(path)
    assert "\n" not in str(caught.value)


def test_create_replaces_atomically_and_reports_an_impossible_place(
    tmp_path, header, rows
):
    path = tmp_path / "file" / "rig.nc"
    (tmp_path / "file").write_text("a regular file, not a directory")
    with pytest.raises(ResultError, match="choose another --out"):
        create(path, header, rows)
    good = tmp_path / "rig.nc"
    create(good, header, rows[:1])
    with pytest.raises(NumericalError):
        create(good, header, [rows[0], {**rows[1], "worn_area": np.full(2, np.nan)}])
    assert_rows(good, rows[:1])
    assert os.listdir(tmp_path).count("rig.nc") == 1


def test_reader_in_another_process_holds_the_file_and_append_says_so(
    path, header, rows
):
    """The writer gives up after its patience; the file stays readable and unchanged."""
    code = (
        f"import netCDF4, sys; f = netCDF4.Dataset({str(path)!r}); "
        "sys.stdout.write('open\\n'); sys.stdout.flush(); sys.stdin.read()"
    )
    reader = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert reader.stdout.readline() == b"open\n"
        with pytest.raises(OSError, match=r"HDF|lock|Resource"):
            append(path, header, rows[:1], 4, patience=0.2)
        assert row_count(path) == 4
    finally:
        reader.communicate()
    append(path, header, rows[:1], 4)
    assert row_count(path) == 5


def test_copy_elsewhere_opens_too(path, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    copy = shutil.copy(path, tmp_path / "elsewhere")
    with open_results(str(copy)) as dataset:
        assert dataset.sizes["step"] == 4


def test_an_open_file_keeps_little_in_memory(tmp_path, monkeypatch, header, rows):
    """HDF5 by itself keeps up to 16 MB of each of the fifty variables, which long
    campaigns would fill.
    """
    kept = []
    file_module = sys.modules[create.__module__]
    write = file_module._write_rows

    def measured(opened, first, written):
        kept.append(sum(opened[name].get_var_chunk_cache()[0] for name in ROW))
        write(opened, first, written)

    monkeypatch.setattr(file_module, "_write_rows", measured)
    path = tmp_path / "rig.nc"
    create(path, header, rows[:1])
    append(path, header, rows[1:], 1)
    assert len(kept) == 2
    assert max(kept) <= 20e6


def test_an_open_file_that_has_grown_shows_the_rows_it_had(path, header, rows):
    opened = open_results(path)
    copied = opened.copy(deep=True)
    pickled = pickle.loads(pickle.dumps(opened))
    opened.close()  # its handle, which the copies share
    append(path, header, [{**rows[-1], "distance": rows[-1]["distance"] + 1000.0}], 4)
    with open_results(path) as longer:
        assert longer.sizes["step"] == 5
    for dataset in (opened, copied, pickled):
        assert dataset["profile_z"].values.shape[0] == 4
        np.testing.assert_array_equal(dataset["profile_z"][-1], rows[-1]["profile_z"])
        dataset.close()


AT_ONCE = """
import pickle, sys, threading
from wearsim.results import append, create, load_results, open_results

paths, header, rows = pickle.loads(sys.stdin.buffer.read())
failed = []

def campaign(path):
    try:
        for _ in range(3):
            create(path, header, rows[:1])
            for index in range(1, len(rows)):
                append(path, header, rows[index : index + 1], index)
            load_results(path)
            open_results(path)["profile_z"].load()
    except BaseException as error:
        failed.append(error)

threads = [threading.Thread(target=campaign, args=(path,)) for path in paths]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
sys.exit(repr(failed) if failed else 0)
"""


def test_campaigns_in_two_threads_write_and_read_their_files(tmp_path, header, rows):
    given = pickle.dumps(([tmp_path / "one.nc", tmp_path / "two.nc"], header, rows))
    ended = subprocess.run(
        [sys.executable, "-c", AT_ONCE], input=given, capture_output=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, b"")
    assert_rows(tmp_path / "one.nc", rows)


AGAIN = """
import sys
from pathlib import Path
import wearsim
from wearsim.results import attribute_of, load_results, open_results, row_count

rig, field = map(Path, sys.argv[1:])
opened = open_results(rig)
for _ in range(2):
    load_results(rig)
    wearsim.translate(opened, field)
    another = open_results(rig)
    row_count(rig), attribute_of(rig, "title")
    another["wheel_name"].load()
    opened["regime_name"].load()
another.close()
opened.load()
"""


def test_an_open_result_is_loaded_again_and_translated_twice(tmp_path, write_campaign):
    files = [
        write_campaign(tmp_path / f"{kind}.nc", kind, 3, 10e-9)
        for kind in ("rig", "field")
    ]
    ended = subprocess.run(
        [sys.executable, "-c", AGAIN, *files], capture_output=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, b"")
