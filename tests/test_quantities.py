from collections import Counter

import numpy as np
import pytest
from netCDF4 import Dataset

from wearsim import quantities
from wearsim.contact.problem import ContactConditions, ContactSolution
from wearsim.quantities import QUANTITIES, duration, kilometres
from wearsim.results import GROUPS, LAYOUT
from wearsim.scene.contact import ContactSection
from wearsim.scene.models import WheelsetSection
from wearsim.scene.operation import Running
from wearsim.studies.contact_flags import COLUMNS
from wearsim.texts import wrapped

# shown unit -> shown value of 1 in the stored unit, written out independently of the
# table
SHOWN = {
    ("m", "mm"): 1e3,
    ("m", "m"): 1.0,
    ("m", "km"): 1e-3,
    ("m", "µm"): 1e6,
    ("m", "nm"): 1e9,
    ("m2", "mm²"): 1e6,
    ("m2 m-1", "mm²/1000 km"): 1e6 * 1e6,
    ("m m-1", "µm/1000 km"): 1e6 * 1e6,
    ("m-1", "1/m"): 1.0,
    ("s m-1", "s/m"): 1.0,
    ("m-1", "1/1000 km"): 1e3 * 1e3,
    ("m3 J-1", "mm³/kJ"): 1e9 * 1e3,
    ("rad", "mrad"): 1e3,
    ("rad s-1", "rad/s"): 1.0,
    ("N", "N"): 1.0,
    ("N", "kN"): 1e-3,
    ("N m", "N m"): 1.0,
    ("N m-1", "MN/m"): 1e-6,
    ("N m rad-1", "MN m/rad"): 1e-6,
    ("Pa", "MPa"): 1e-6,
    ("Pa", "GPa"): 1e-9,
    ("Pa", "N/mm²"): 1e-6,
    ("W", "W"): 1.0,
    ("kg", "kg"): 1.0,
    ("kg m-3", "kg/m³"): 1.0,
    ("J m-3", "kJ/m³"): 1e-3,
    ("J m-2", "J/m²"): 1.0,
    ("m s-1", "km/h"): 3.6,
    ("1", "1"): 1.0,
    ("1", "%"): 1e2,
    ("s", "h"): 1.0 / 3600.0,
    ("N m", "kN m"): 1e-3,
    ("N m-1", "kN/mm"): 1e-3 / 1e3,
    ("1", "10⁻³"): 1e3,
    ("", ""): 1.0,
}


def test_shown_factors_belong_to_the_pair_of_units():
    for name, quantity in QUANTITIES.items():
        assert quantity.name == name
        assert quantity.meaning, name
        assert quantity.shown_factor == SHOWN[quantity.unit, quantity.shown_unit], name


def test_no_name_stands_twice_in_the_table():
    """The later one would win without a word."""
    assert [
        name
        for name, count in Counter(row.name for row in quantities._ROWS).items()
        if count > 1
    ] == []


def test_every_variable_of_a_result_file_has_a_meaning_and_numbers_have_a_unit():
    flags = ("side", "wear_regime", "wear_regime_highest", "step_limit")
    for name, variable in [
        *LAYOUT.items(),
        *(item for group in GROUPS.values() for item in group.items()),
    ]:
        assert bool(variable.unit) == (variable.kind != "str" and name not in flags), (
            name
        )
        assert variable.kind in ("f8", "i4", "str")
        assert "step" not in variable.dimensions[1:]


def test_contact_json_names_are_in_the_table():
    """The names of `wearsim contact --json`; a renamed one would break scripts of
    users.
    """
    names = (
        "shift yaw wheel_load counterface_curvature rotation_speed side wheel_y "
        "rail_y x contact_angle area max_pressure length width approach normal_force "
        "creepage_x creepage_y spin force_x force_y spin_moment slip_area power "
        "power_balance normal tangential"
    )
    assert set(names.split()) <= set(QUANTITIES)


def test_a_quantity_has_one_name_in_python_json_and_result_files():
    """Fields of contact problem and solution that result files hold have the same name
    there.
    """
    fields = {
        *ContactConditions.__dataclass_fields__,
        *ContactSolution.__dataclass_fields__,
    }
    points = [
        name for name, row in LAYOUT.items() if row.dimensions == ("operating_point",)
    ]
    patches = [name for name, row in LAYOUT.items() if row.dimensions[-1] == "patch"]
    of_operation = {
        "operating_point_name",
        "curve_curvature",
        "environment",
        "weight",
        "block_length",
    }
    of_wear = {name for name in patches if name.startswith("wear_")}
    assert set(points) - fields == of_operation
    assert set(patches) - fields == of_wear


def test_input_ranges_are_not_empty():
    for name, quantity in QUANTITIES.items():
        if quantity.allowed:
            low, high = quantity.span
            assert low < high, name


def test_what_is_no_input_has_no_range():
    with pytest.raises(ValueError, match="area is no input"):
        _ = QUANTITIES["area"].range


@pytest.mark.parametrize(
    ("section", "key", "column"),
    [
        (WheelsetSection, "radius_mm", "wheel_radius_mm"),
        (WheelsetSection, "back_to_back_mm", "back_to_back_mm"),
        (ContactSection, "strips", "strips"),
        (ContactSection, "cells", "cells"),
        (ContactSection, "youngs_GPa", "youngs_GPa"),
        (ContactSection, "poisson", "poisson"),
        (ContactSection, "kalker_factor", "kalker_factor"),
        (Running, "load_kN", "wheel_load_kN"),
        (Running, "speed_km_h", "speed_km_h"),
        (Running, "friction", "friction"),
        (Running, "yaw_mrad", "yaw_mrad"),
    ],
)
def test_scene_and_command_line_allow_the_same_range(section, key, column):
    limits = {
        bound: getattr(item, bound)
        for item in section.model_fields[key].metadata
        for bound in ("ge", "le")
        if hasattr(item, bound)
    }
    assert (limits["ge"], limits["le"]) == QUANTITIES[COLUMNS[column].quantity].span


def test_label_shows_meaning_symbol_and_unit_of_dimensional_quantities():
    assert QUANTITIES["max_pressure"].label == "largest contact pressure p₀ [MPa]"
    assert QUANTITIES["equivalent_conicity"].label == "equivalent conicity λ"
    assert QUANTITIES["normal"].label == "normal contact model"


def test_stored_text_survives_netcdf(tmp_path):
    """Greek letters and signs of the table must come back from a file as they went
    in.
    """
    with Dataset(tmp_path / "text.nc", "w") as file:
        for name, quantity in QUANTITIES.items():
            file.setncattr(f"t_{name}", quantity.label)
    with Dataset(tmp_path / "text.nc") as file:
        assert all(file.getncattr(f"t_{n}") == q.label for n, q in QUANTITIES.items())


def test_table_cannot_be_changed_at_run_time():
    with pytest.raises(TypeError):
        QUANTITIES["area"] = np.nan


@pytest.mark.parametrize(
    ("seconds", "message"),
    [
        (0.4, "0 s"),
        (89.0, "89 s"),
        (100.0, "2 min"),
        (5000.0, "83 min"),
        (9e3, "2 h 30 min"),
    ],
)
def test_a_duration_is_written_as_people_say_it(seconds, message):
    assert duration(seconds) == message


@pytest.mark.parametrize(
    ("distance", "text"),
    [
        (0.0, "0 km"),
        (0.05, "< 0.001 km"),
        (0.99999999, "0.001 km"),
        (547.8123, "0.5478 km"),
        (60e3, "60 km"),
        (1234.6e3, "1235 km"),
        (9999.6e3, "10 000 km"),
        (916196.2e3, "916 196 km"),
        (1e10, "10 000 000 km"),
        (-12345e3, "-12 345 km"),
    ],
)
def test_distances_have_four_digits_and_thousands_apart(distance, text):
    assert kilometres(distance) == text


def test_a_line_is_not_broken_within_a_number():
    text = "x" * 90 + " after 916 196 km"
    assert wrapped(text).splitlines() == ["x" * 90 + " after", "  916 196 km"]
