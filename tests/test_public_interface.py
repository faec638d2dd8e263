"""The public interface: names, cost of the import, examples, same numbers as the
modules behind it.
"""

import copy
import doctest
import json
import subprocess
import sys
import tomllib

import netCDF4
import numpy as np
import pytest
import xarray as xr

import wearsim
from wearsim.contact.solve import solve
from wearsim.profile.standard import shipped_path
from wearsim.scene import build
from wearsim.scene.overrides import toml_text

EXAMPLES = (
    "standard_profile",
    "export_profile",
    "read_profile",
    "wheelset",
    "rails",
    "rollers",
    "solve_contact",
    "ContactConditions.of",
    "load_scene",
    "run",
    "resume",
    "open_results",
    "translate",
    "register",
    "wear_rate",
    "check",
    "inspect",
    "write_report",
    "citations",
    "measure",
    "worn_profile",
    "at_distance",
    "wear_between",
    "plot",
    "compare",
    "sweep",
    "run_many",
    "programme",
    "match_contact",
)
COMMON = {
    "wheelset": {"profile": "S1002"},
    "contact": {"model": "fast", "strips": np.int64(10), "cells": 10},
    "campaign": {"distance_km": 2.0, "point_spacing_mm": 0.5, "max_step_km": None},
}
RUNNING = {"load_kN": 80, "speed_km_h": 72, "friction": 0.35}
RIG = COMMON | {
    "scene": {"kind": "rig", "title": "short rig, µ = 0.35"},
    "counterface": {"profile": "60E1", "inclination": "1:40", "roller_radius_mm": 1000},
    "wear": {
        "law": "usfd",
        "also_evaluate": ["archard", {"law": "usfd", "form": "patch_mean"}],
    },
    "operation": {
        "block": [
            {"name": "left", "shift_mm": -3, "distance_km": 1, **RUNNING},
            {
                "name": "right",
                "shift_mm": 3,
                "yaw_mrad": 1,
                "distance_km": 1,
                **RUNNING,
            },
        ],
        "monitor": {"shifts_mm": np.array([0.0, 3.0]), **RUNNING},
    },
}
FIELD = COMMON | {
    "scene": {"kind": "field"},
    "counterface": {"profile": "60E1", "inclination": "1:40"},
    "operation": {
        "class": [
            {
                "name": "tangent",
                "shift_mean_mm": 0,
                "shift_std_mm": 2,
                "positions": 10,
                "share": 1,
                **RUNNING,
            }
        ],
        "monitor": RIG["operation"]["monitor"],
    },
}
SHIPPED = shipped_path("workflows", "fatigue.toml")
REGISTRIES = {
    "NORMAL_MODELS": "hertz",
    "TANGENTIAL_MODELS": "fastsim",
    "WEAR_LAWS": "usfd",
    "FATIGUE_LAWS": "wlrm",
    "COEFFICIENT_SETS": "lewis_dwyer_joyce_2004",
    "QUANTITIES": "power",
}
IMPORTED = """\
import json, sys
import wearsim
print(json.dumps(sorted({"numpy", "xarray", "numba", "pydantic"} & set(sys.modules))))
"""


def test_import_loads_no_numpy():
    """The packages that take long to load wait until they are needed."""
    run = subprocess.run(
        [sys.executable, "-c", IMPORTED], check=True, capture_output=True
    )
    assert json.loads(run.stdout) == []


def test_every_name_is_there_and_documented():
    assert dir(wearsim) == sorted(wearsim.__all__)
    for name in set(wearsim.__all__) - {"__version__", *REGISTRIES}:
        assert getattr(wearsim, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'solve'"):
        _ = wearsim.solve


@pytest.mark.parametrize("name", REGISTRIES)
def test_registries_hold_what_scenes_name(name):
    assert REGISTRIES[name] in getattr(wearsim, name)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with a short comparison in `out`, in which the examples run one after the
    other.
    """
    folder = tmp_path_factory.mktemp("examples")
    (folder / "rig.toml").write_text(toml_text(RIG))
    (folder / "field.toml").write_text(toml_text(FIELD))
    both = {"rig": folder / "rig.toml", "field": folder / "field.toml"}
    paths = wearsim.run({"scene": {"kind": "compare"}, "compare": both}, folder / "out")
    assert [path.name for path in paths] == ["rig.nc", "field.nc", "translation.nc"]
    return folder


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_of_each_function_runs(name, folder, monkeypatch, own_records):
    monkeypatch.chdir(folder)
    function = wearsim
    for part in name.split("."):
        function = getattr(function, part)
    (example,) = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    assert len(example.examples) > 1
    assert doctest.DocTestRunner().run(example).failed == 0


def test_the_examples_of_the_package_run_and_show_registries_and_classes():
    (example,) = doctest.DocTestFinder(recurse=False).find(wearsim, "wearsim", globs={})
    assert doctest.DocTestRunner().run(example).failed == 0
    shown = {
        *REGISTRIES,
        "ContactModels",
        "Counterface",
        "Profile",
        "WearsimError",
        "Wheelset",
    }
    assert [
        name for name in sorted(shown) if f"wearsim.{name}" not in example.docstring
    ] == []


@pytest.fixture(scope="module")
def case():
    return (
        wearsim.wheelset("S1002", left="S1002/h30", radius=0.45),
        wearsim.rollers("60E1", radius=1.0),
        wearsim.ContactConditions.of(
            np.linspace(-3e-3, 3e-3, 70), yaw=1e-3, friction=0.3
        ),
        wearsim.ContactModels.of("fast", strips=8, cells=8),
    )


@pytest.fixture(scope="module")
def solution(case):
    wheelset, counterface, conditions, models = case
    return solve(conditions, wheelset, counterface, models)


@pytest.mark.parametrize("fields", [False, True])
def test_solve_contact_gives_the_bits_of_the_solver(case, solution, fields):
    data = wearsim.solve_contact(*case, fields=fields, threads=2)
    np.testing.assert_array_equal(data["side"] == "left", solution.side == 1)
    for name in data.data_vars:
        if data[name].dims == ("patch",) and hasattr(solution, name):
            np.testing.assert_array_equal(data[name], getattr(solution, name))
        assert data[name].attrs["long_name"]
    np.testing.assert_array_equal(
        data["roll"].values[data["point"].values], solution.roll
    )
    np.testing.assert_array_equal(data["shift"], case[2].shift)
    assert ("pressure" in data) == fields
    if fields:
        for name in ("pressure", "shear_x", "slip_y", "strip_work"):
            np.testing.assert_array_equal(data[name], getattr(solution.fields, name))
        work = (data["strip_work"] * data["strip_width"]).sum("strip")
        speed = data["speed"].values[data["point"].values]
        np.testing.assert_allclose(work * speed, data["power"], rtol=1e-9)


def test_grid_models_add_the_pressure_of_their_cells(case):
    wheelset, counterface, _, _ = case
    models = wearsim.ContactModels(
        normal="half_space", tangential="fastsim", strips=10, cells=10
    )
    point = wearsim.ContactConditions.of(3e-3)
    data = wearsim.solve_contact(
        wheelset, counterface, point, models, sides=["right"], fields=True
    )
    cells = (
        (data["grid_lead"] - data["grid_trail"])
        / data.sizes["grid_cell"]
        * data["strip_width"]
    )
    load = (data["cell_pressure"].sum(["grid_cell", "strip"]) * cells).values
    np.testing.assert_allclose(load, data["normal_force"], rtol=1e-9)


def test_fields_of_several_points_on_unlike_grids_are_those_of_each_point(case):
    """Points are solved a few at a time, each with strips and cells by the size of its
    patch.
    """
    wheelset, counterface, _, _ = case
    models = wearsim.ContactModels(
        "half_space", "half_space", strips=8, cells=8, cell_size=2e-3
    )
    shifts, loads = [0.0, 3e-3, 1e-3], [80e3, 30e3, 150e3]

    def solved(shift, load):
        conditions = wearsim.ContactConditions.of(
            shift=shift, wheel_load=load, friction=0.35
        )
        return wearsim.solve_contact(
            wheelset, counterface, conditions, models, sides="right", fields=True
        )

    whole = solved(shifts, loads)
    assert whole["point"].values.tolist() == [0, 1, 2]
    for k, (shift, load) in enumerate(zip(shifts, loads, strict=True)):
        one, same = solved(shift, load).isel(patch=0), whole.isel(patch=k)
        strips, cells = one.sizes["strip"], one.sizes["cell"]
        own = {
            "strip": slice(strips),
            "cell": slice(cells),
            "grid_cell": slice(one.sizes["grid_cell"]),
        }
        for name in (
            "lateral",
            "x_lead",
            "cells_lead",
            "strip_work",
            "pressure",
            "slip_x",
            "cell_pressure",
        ):
            given = {dimension: own[dimension] for dimension in one[name].dims}
            np.testing.assert_array_equal(
                same[name].isel(given), one[name], err_msg=name
            )
            if name not in ("lateral", "cells_lead"):
                assert np.count_nonzero(same[name]) == np.count_nonzero(one[name]), name
        for ends in ("cells_lead", "cells_trail"), ("grid_lead", "grid_trail"):
            dimension = "cell" if "cells_lead" in ends else "grid_cell"
            lengths = [
                (data[ends[0]] - data[ends[1]]) / data.sizes[dimension]
                for data in (same, one)
            ]
            own_strips = [
                length.isel(strip=slice(strips), missing_dims="ignore")
                for length in lengths
            ]
            np.testing.assert_allclose(*own_strips, rtol=1e-9)
        edges = same["strip_wheel_y_edges"].values
        np.testing.assert_array_equal(edges[: strips + 1], one["strip_wheel_y_edges"])
        assert (edges[strips:] == edges[strips]).all()
    assert (
        len({int((edges > 0).sum()) for edges in np.diff(whole["strip_wheel_y_edges"])})
        > 1
    )


def test_forces_of_patches_on_the_wheel_carry_its_load(case):
    """Also of bent patches, whose contact angle and forces do not say so: to the
    balance, 1e-4.
    """
    conditions = wearsim.ContactConditions.of(
        [-2e-3, 5e-3, 6e-3], yaw=1e-3, friction=0.3
    )
    contact = wearsim.solve_contact(*case[:2], conditions)
    wheel = 2 * contact["point"] + (contact["side"] == "left")
    carried = np.bincount(wheel, contact["track_vertical"])
    np.testing.assert_allclose(carried, 80e3, rtol=5e-4)
    assert abs(contact["contact_angle"]).max() > 0.3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wheel_load": 0.0}, "wheel_load = 0 must be at least 0.1 and at most 300 kN"),
        ({"friction": -0.1}, "friction = -0.1 must be at least 0 and at most 1$"),
        (
            {"shift": [0.0, np.nan]},
            "shift = nan must be at least -100 and at most 100 mm",
        ),
        (
            {"track_curvature": np.inf},
            "track_curvature = inf must be at least -0.1 and at most 0.1 1/m",
        ),
        ({"track_curvature": 300.0}, "track_curvature = 300 must be"),
        (
            {"torque": np.nan},
            "torque = nan must be at least -50000 and at most 50000 N m",
        ),
        ({"shift": [0.0, 1e-3], "yaw": [0.0] * 3}, r"shift \(2,\), yaw \(3,\)"),
        ({"shift": []}, r"shift \(0,\)"),
        ({"rotation": "fixed"}, "one of free, independent, centred, nominal"),
        ({"creepage": [1e-3, 0.0]}, r"creepage \(n, 3\)"),
        ({"load": 80e3}, "load is not a contact condition; known: shift"),
        (
            {"shift": "left"},
            "shift = left must be a number, or an array of numbers for points$",
        ),
        (
            {"yaw": [[1.0, 2.0], [3.0]]},
            "must be a number, or an array of numbers for points$",
        ),
        ({"wheel_load": None}, "wheel_load = nan must be"),
    ],
)
def test_unusable_conditions_are_errors(change, message):
    with pytest.raises(wearsim.WearsimError, match=message):
        wearsim.ContactConditions.of(**change)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: wearsim.standard_profile("S1003"),
            "'S1003' is neither a file nor .*S1002",
        ),
        (lambda: wearsim.read_profile("none.csv", "wheel"), "does not exist"),
        (
            lambda: wearsim.read_profile("none.csv", "wheel", unit="mm"),
            "unit is no statement .* units",
        ),
        (lambda: wearsim.wheelset("60E1"), "a wheel is needed"),
        (
            lambda: wearsim.wheelset("S1002", radius=0.0),
            "radius = 0 must be at least 5 and at most",
        ),
        (
            lambda: wearsim.wheelset("S1002", radius="0.46"),
            "radius = '0.46' must be a number$",
        ),
        (
            lambda: wearsim.rollers("60E1", radius=None),
            "radius = None must be a number$",
        ),
        (
            lambda: wearsim.rails("60E1", inclination="1:40"),
            "inclination = 1:40 must be in 0 .. 0.1 ",
        ),
        (
            lambda: wearsim.wheelset("S1002", back_to_back=1360),
            "back_to_back = 1.36e.06 must be .* 2000 mm",
        ),
        (
            lambda: wearsim.wheelset("S1002", diameter_difference=1.0),
            "diameter_difference = 1000 must be at least -20",
        ),
        (
            lambda: wearsim.rails("60E1", gauge_height=0.1),
            "gauge_height = 100 must be .* 25 mm",
        ),
        (lambda: wearsim.rails(wearsim.standard_profile("S1002")), "a rail is needed"),
        (
            lambda: wearsim.rails(wearsim.standard_profile("60E1"), gauge=1.43),
            "placed in the track already",
        ),
    ],
)
def test_unusable_profiles_are_errors(call, message):
    with pytest.raises(wearsim.WearsimError, match=message):
        call()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"models": wearsim.ContactModels(normal="herz", tangential="fastsim")},
            "normal = 'herz' is not one of coupled_strips, half_space, hertz",
        ),
        (
            {
                "models": wearsim.ContactModels.of(
                    "fast", parameters=(("penetration", 0.6),)
                )
            },
            (
                "name of a parameter = 'penetration' is not one of .*, "
                "virtual_penetration_factor$"
            ),
        ),
        (
            {
                "models": wearsim.ContactModels.of(
                    "fast", parameters=(("virtual_penetration_factor", 60.0),)
                )
            },
            "virtual_penetration_factor = 60 must be above 0 and at most 1$",
        ),
        (
            {
                "models": wearsim.ContactModels.of(
                    "fast", parameters=(("half_space_tolerance", np.nan),)
                )
            },
            "half_space_tolerance = nan must be above 0",
        ),
        (
            {"models": wearsim.ContactModels.of("fast", poisson_ratio=0.7)},
            "poisson_ratio = 0.7 must be .* at most 0.5$",
        ),
        (
            {"models": wearsim.ContactModels.of("fast", kalker_factor=0.1)},
            "kalker_factor = 0.1 must be at least 0.2 and at most 1$",
        ),
        (
            {"models": wearsim.ContactModels.of("fast", youngs_modulus=-1.0)},
            "youngs_modulus = -1 must be above 0 Pa",
        ),
        (
            {"models": wearsim.ContactModels(strips="30")},
            "strips = '30' must be a number$",
        ),
        (
            {"models": wearsim.ContactModels(youngs_modulus=None)},
            "youngs_modulus = None must be a number$",
        ),
        (
            {"models": wearsim.ContactModels(parameters={"curvature_window": 0.003})},
            (
                r"parameters = \{'curvature_window': 0.003\} must be pairs of a name "
                r"and a number"
            ),
        ),
        (
            {"models": wearsim.ContactModels(parameters=(("curvature_window", "3"),))},
            "curvature_window = '3' must be a number$",
        ),
        ({"sides": ["both"]}, "sides = 'both' is not one of right, left"),
        ({"sides": "both"}, "sides = 'both' is not one of right, left"),
        ({"load": "axle"}, "load = 'axle' is not one of wheel, normal_force"),
    ],
)
def test_unknown_names_and_numbers_out_of_range_are_errors(case, change, message):
    with pytest.raises(wearsim.WearsimError, match=message):
        wearsim.solve_contact(*case[:3], **change)


def test_a_pair_of_rails_that_is_not_there_is_an_error(case):
    conditions = wearsim.ContactConditions.of([0.0, 1e-3], rail=np.array([0, 1]))
    with pytest.raises(
        wearsim.WearsimError,
        match="rail = 1 must be at least 0 and below 1, the pairs of",
    ):
        wearsim.solve_contact(*case[:2], conditions)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (0, "S1002", "wheelset is 'S1002'; give what wearsim.wheelset returns$"),
        (
            1,
            "60E1",
            (
                "counterface is '60E1'; give what wearsim.rails or wearsim.rollers "
                "returns$"
            ),
        ),
        (
            2,
            3e-3,
            "conditions is 0.003; give what wearsim.ContactConditions.of returns$",
        ),
        (2, {"shift": 0.0}, "conditions is a dict; give"),
        (
            3,
            "standard",
            "models is 'standard'; give what wearsim.ContactModels.of returns$",
        ),
    ],
)
def test_arguments_of_another_kind_are_errors(case, place, value, message):
    arguments = [*case[:3], wearsim.ContactModels()]
    arguments[place] = value
    with pytest.raises(wearsim.WearsimError, match=message):
        wearsim.solve_contact(*arguments)


@pytest.mark.parametrize(
    ("model", "others", "message"),
    [
        (
            "fast",
            {"normal": "half_space"},
            'the pair "fast" has a normal model; leave normal out, or write',
        ),
        (
            "fast",
            {"tangential": "fastsim"},
            'the pair "fast" has a tangential model; leave tangential out',
        ),
        (
            "fast",
            {"strip": 30},
            "strip is unknown; there is strips, cells, .*; did you mean 'strips'",
        ),
        ("fast", {"tolerance": 0.01}, "contact.tolerance was removed in 0.3.0"),
        (
            "quick",
            {},
            (
                'pair of contact models "quick" is unknown; there is accurate, fast, '
                "standard$"
            ),
        ),
        (None, {}, 'pair of contact models "None" is unknown'),
        (["fast"], {}, "is unknown; there is accurate, fast, standard"),
    ],
)
def test_a_pair_with_other_arguments_is_an_error(model, others, message):
    with pytest.raises(wearsim.WearsimError, match=message) as caught:
        wearsim.ContactModels.of(model, **others)
    assert "\n" not in str(caught.value)


def assert_same_file(first, second):
    """Same variables, attributes and bits, apart from where the scene came from."""
    with netCDF4.Dataset(first) as a, netCDF4.Dataset(second) as b:
        assert set(a.variables) == set(b.variables)
        for name in a.variables:
            np.testing.assert_array_equal(
                np.asarray(a[name][:]), np.asarray(b[name][:])
            )
        assert set(a.ncattrs()) == set(b.ncattrs())


def test_a_scene_from_a_dict_is_the_scene_of_the_file(folder):
    loaded, read = wearsim.load_scene(RIG), wearsim.load_scene(folder / "rig.toml")
    assert loaded.model_dump() == read.model_dump()
    assert loaded.origin.content == read.origin.content
    assert build(loaded).title == "short rig, µ = 0.35"
    with SHIPPED.open("rb") as file:
        tables = tomllib.load(file)
    assert (
        wearsim.load_scene(tables).model_dump()
        == wearsim.load_scene(SHIPPED).model_dump()
    )
    assert tomllib.loads(toml_text(tables)) == tables


def test_run_gives_the_same_bits_for_a_dict_a_file_and_a_loaded_scene(folder, tmp_path):
    (from_dict,) = wearsim.run(RIG, tmp_path / "dict")
    (loaded,) = wearsim.run(wearsim.load_scene(RIG), tmp_path / "loaded", threads=1)
    for path in (from_dict, loaded):
        assert_same_file(path, folder / "out" / "rig.nc")
    assert (tmp_path / "dict" / "scene" / "scene.toml").read_bytes() == (
        folder / "rig.toml"
    ).read_bytes()
    assert (
        wearsim.run(RIG, tmp_path / "dict")
        == wearsim.resume(tmp_path / "dict")
        == (from_dict,)
    )


def test_a_run_warns_as_python_does_and_logs_its_progress(tmp_path, caplog):
    """The warning names the key of the dict, and is placed at the call."""
    caplog.set_level("INFO", logger="wearsim")
    with pytest.warns(
        wearsim.WearsimWarning, match=r"also_evaluate: local archard takes"
    ) as caught:
        wearsim.run(RIG, tmp_path / "out")
    assert [one.filename for one in caught] == [__file__]
    assert str(caught[0].message).startswith("wear.also_evaluate")
    lines = [
        record.getMessage() for record in caplog.records if record.name == "wearsim"
    ]
    assert lines[0] == "rig: started, 2 km to run"
    assert lines[-1].startswith("rig: finished, 2 km, worst depth ")
    silent = []
    wearsim.run(RIG, tmp_path / "again", warn=silent.append)
    assert len(silent) == len(caught)


def test_overrides_are_a_mapping_and_the_history_is_the_call(tmp_path):
    out, values = (
        tmp_path / "out",
        {"campaign.distance_km": 1.0, "operation.block.left.friction": 0.3},
    )
    (path,) = wearsim.run(RIG, out, overrides=values)
    assert wearsim.resume(out, overrides={"campaign.distance_km": 1.5}) == (path,)
    with wearsim.open_results(path) as data:
        assert (
            data.attrs["history"]
            == f"wearsim.run(scene, {str(out)!r}, overrides={values})"
        )
        assert data["friction"].sel(operating_point="left") == 0.3
        assert float(data["distance"][-1]) == 1500.0
    scene = wearsim.load_scene(SHIPPED, overrides={"contact.model": "fast"})
    assert scene.contact.pair == ("kik_piotrowski", "fastsim")


@pytest.mark.parametrize(
    ("kind", "ending", "first"),
    [
        ("S1002", ".prw", "! wheel"),
        ("S1002", ".WHL", "Filename="),
        ("60E1", ".prr", "! rail"),
        ("60E1", ".ban", "Filename="),
        ("60E1", ".csv", "# rail"),
        ("S1002", ".txt", "# wheel"),
    ],
)
def test_the_ending_decides_the_format_of_a_profile(kind, ending, first, tmp_path):
    profile = wearsim.standard_profile(kind)
    wearsim.export_profile(profile, tmp_path / f"own{ending}")
    assert (tmp_path / f"own{ending}").read_text().startswith(first)


def test_translate_gives_the_same_factors_for_files_and_datasets(folder):
    rig, field = folder / "out" / "rig.nc", folder / "out" / "field.nc"
    by_path = wearsim.translate(rig, str(field))
    with wearsim.open_results(rig) as one, wearsim.open_results(field) as other:
        one.load()
        other.load()
        by_dataset = wearsim.translate(one, other)
    assert by_path.identical(by_dataset)
    with xr.open_dataset(folder / "out" / "translation.nc") as stored:
        assert stored.attrs["rig_sha256"] == by_dataset.attrs["rig_sha256"]
    with pytest.raises(wearsim.WearsimError, match="cannot be read as netCDF"):
        wearsim.translate(folder / "rig.toml", field)
    for exchanged in ((field, rig), (other, one)):
        with pytest.raises(
            wearsim.WearsimError, match=r"results are exchanged: .* give the rig first"
        ):
            wearsim.translate(*exchanged)
    for twice in ((rig, rig), (one, one), (other, field)):
        with pytest.raises(
            wearsim.WearsimError, match="same result twice; give the results of two"
        ):
            wearsim.translate(*twice)


def test_faults_of_a_dict_name_the_key(folder):
    tables = copy.deepcopy(RIG)
    tables["operation"]["block"][1]["load_kN"] = -80
    del tables["operation"]["block"][0]["friction"]
    tables["wheelset"]["radius"] = 460
    with pytest.raises(wearsim.WearsimError) as caught:
        wearsim.load_scene(tables)
    begins = [line.split(";")[0] for line in str(caught.value).splitlines()]
    assert begins[:2] == [
        "wheelset.radius: unknown key radius in [wheelset]",
        "operation.block[0]: key friction is missing in [[operation.block]]",
    ]
    assert begins[2].startswith("operation.block[1].load_kN: load_kN = -80 must be ")
    for key, value, message in (
        ("profile", "none.csv", "^wheelset.profile: profile = .*none.csv"),
        (
            "profile",
            object(),
            "^wheelset.profile is a object; give a number, a text, a list or a dict$",
        ),
    ):
        with pytest.raises(wearsim.WearsimError, match=message):
            wearsim.load_scene(RIG | {"wheelset": {key: value}})
