"""Result files that are damaged or not as wearsim writes them: one line, exit code 2,
from every reader.
"""

import netCDF4
import numpy as np
import pytest
from siege_netcdf import rewritten

from wearsim.cli import main
from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import LAYOUT, load_results, open_results


@pytest.fixture(scope="module")
def results(tmp_path_factory, write_campaign):
    folder = tmp_path_factory.mktemp("results")
    for kind in ("rig", "field"):
        write_campaign(folder / f"{kind}.nc", kind, 3, 10e-9)
    return folder


@pytest.fixture
def folder(results, tmp_path, impatient):
    for file in results.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def assert_one_line(folder, capsys, *parts, words=("inspect", "rig.nc")):
    """The command refuses the file, and says which and what of it."""
    command, *files = words
    assert main([command, *(str(folder / file) for file in files)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    (line,) = told.err.splitlines()
    for part in (str(folder / "rig.nc"), "wearsim run", *parts):
        assert part in line


def nothing(array):
    array[...] = np.nan
    return array


CHANGES = {
    "a dimension less": (
        {"dimensions": {"profile_z": ("step", "wheel")}},
        "profile_z has dimensions",
    ),
    "a dimension twice": (
        {"dimensions": {"weight": ("wheel", "wheel")}},
        "weight has a dimension twice",
    ),
    "other dimensions": (
        {"dimensions": {"weight": ("wheel",)}},
        "weight has dimensions",
    ),
    "numbers as texts": ({"kinds": {"wear_depth": str}}, "wear_depth has type"),
    "single precision": (
        {"kinds": {"wear_depth": "f4"}},
        "wear_depth has type float32",
    ),
    "texts as numbers": ({"kinds": {"regime_name": "f8"}}, "regime_name has type"),
    "no steps": ({"sizes": {"step": 0}}, "distance has 0 values along step"),
    "one wheel": ({"sizes": {"wheel": 1}}, "wheel_name has 1 values along wheel"),
    "no points": ({"sizes": {"point": 1}}, "arc_length has 1 values along point"),
    "a dimension of 5e8": (
        {"sizes": {"operating_point": 500_000_000}},
        "more than a file of",
    ),
    "no numbers": (
        {"values": {"wear_depth": nothing}},
        "wear_depth has values that are missing",
    ),
    "no distance": ({"values": {"distance": nothing}}, "distance has no value"),
    "distance falls": (
        {"values": {"distance": lambda array: array[::-1]}},
        "distance does not rise",
    ),
    "an unknown flag": (
        {"values": {"step_limit": lambda array: array + 99}},
        "step_limit has values beyond",
    ),
    "area without depth": (
        {"values": {"wear_depth_rate_max": lambda array: 0.0 * array}},
        "wear_area_rate is more than wear_depth_rate_max",
    ),
    "an unknown regime": (
        {"values": {"wear_regime": lambda array: array + 99}},
        "wear_regime has values",
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_file_of_other_structure_is_one_line_with_the_variable(
    folder, capsys, change
):
    changed, message = CHANGES[change]
    if "values" in changed:
        with netCDF4.Dataset(folder / "rig.nc", "a") as file:
            file.set_auto_maskandscale(False)
            for name, of in changed["values"].items():
                file[name][:] = of(file[name][:])
    else:
        rewritten(folder / "rig.nc", **changed)
    assert_one_line(folder, capsys, message)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(LAYOUT))
def test_every_variable_is_held_to_its_row_of_the_table(folder, name):
    """Another type, or a dimension more or less, of each variable of all results."""
    quantity = QUANTITIES[name]
    other = "f8" if quantity.kind == "str" else str
    kind = {"str": str, "int": "i4"}.get(quantity.kind, quantity.kind)
    for path, kind_made, axes, message in (
        (folder / "rig.nc", other, quantity.dimensions, "has type"),
        (
            folder / "field.nc",
            kind,
            (*quantity.dimensions[:-1], "patch", "patch"),
            "has (dimensions|a dimension twice)",
        ),
    ):
        with netCDF4.Dataset(path, "a") as file:
            file.renameVariable(name, "as_written")
            file.createVariable(name, kind_made, axes)
        with pytest.raises(ResultError, match=f"{name} {message}"):
            open_results(path)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "wear_depth.units",
            "furlong",
            "wear_depth has units furlong where m are needed",
        ),
        ("wear_depth.scale_factor", 1e3, "wear_depth has another scale_factor"),
        ("wheel_radius", "w\nide", "attribute wheel_radius = w\\nide must be a number"),
        ("wheel_radius", "wide", "attribute wheel_radius = wide must be a number"),
        ("counterface_curvature", np.arange(3.0), "attribute counterface_curvature"),
        ("limit_hollowing", np.nan, "attribute limit_hollowing = nan must be a number"),
        ("scene_kind", 3.0, "attribute scene_kind = 3.0 must be a text"),
        ("wear_form", 3.0, "attribute wear_form = 3.0 must be a text"),
        ("stability_limit", "8", "attribute stability_limit = 8 must be a number"),
        ("wearsim_schema", "five", "is not a result file of a wearsim campaign"),
    ],
)
def test_an_attribute_that_is_not_as_written_is_one_line(
    folder, capsys, name, value, message
):
    variable, _, attribute = name.rpartition(".")
    with netCDF4.Dataset(folder / "rig.nc", "a") as file:
        (file[variable] if variable else file).setncattr(attribute, value)
    assert_one_line(folder, capsys, message)


@pytest.mark.parametrize(
    "words",
    [("inspect", "rig.nc"), ("translate", "rig.nc", "field.nc"), ("report", ".")],
)
def test_every_command_refuses_a_file_without_a_required_setting(folder, capsys, words):
    with netCDF4.Dataset(folder / "rig.nc", "a") as file:
        file.delncattr("wear_law")
    assert_one_line(folder, capsys, "attribute wear_law is missing", words=words)
    assert not (folder / "report.html").exists()


def test_a_whole_file_is_read_into_memory(results):
    dataset = load_results(results / "rig.nc")
    assert all(variable._in_memory for variable in dataset.variables.values())
    with open_results(results / "rig.nc") as opened:
        assert dataset.identical(opened)


def test_factors_beside_results_that_state_too_much_are_left_out(folder, capsys):
    """4 GB of texts in a file of kilobytes, in place of the causes and bands of a
    comparison.
    """
    with netCDF4.Dataset(folder / "translation.nc", "w") as file:
        file.createDimension("matched_point", 500_000_000)
        file.createVariable("rig_label", str, ("matched_point",))
    assert main(["translate", str(folder / "rig.nc"), str(folder / "field.nc")]) == 0
    (folder / "translation.nc").rename(folder / "bands.nc")
    assert main(["report", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert (
        "bands.nc cannot be read (it states more values than a file of its size holds)"
        in line
    )
