import numpy as np
import pytest
from netCDF4 import Dataset

from wearsim import nomenclature
from wearsim.nomenclature import NOMENCLATURE
from wearsim.results import GROUPS, LAYOUT

# shown unit -> shown value of 1 in the stored unit, written out independently of the table
SHOWN = {
    ("m", "mm"): 1e3,
    ("m", "km"): 1e-3,
    ("m", "µm"): 1e6,
    ("m2", "mm²"): 1e6,
    ("m2 m-1", "mm²/1000 km"): 1e6 * 1e6,
    ("m m-1", "µm/1000 km"): 1e6 * 1e6,
    ("m-1", "1/m"): 1.0,
    ("m-1", "1/1000 km"): 1e3 * 1e3,
    ("rad", "mrad"): 1e3,
    ("rad s-1", "rad/s"): 1.0,
    ("N", "N"): 1.0,
    ("N", "kN"): 1e-3,
    ("N m", "N m"): 1.0,
    ("Pa", "MPa"): 1e-6,
    ("Pa", "N/mm²"): 1e-6,
    ("W", "W"): 1.0,
    ("kg", "kg"): 1.0,
    ("J m-2", "J/m²"): 1.0,
    ("J m-3", "kJ/m³"): 1e-3,
    ("m s-1", "km/h"): 3.6,
    ("1", "1"): 1.0,
    ("1", "10⁻³"): 1e3,
    ("", ""): 1.0,
}


@pytest.mark.parametrize("name", sorted(NOMENCLATURE))
def test_shown_factor_belongs_to_the_pair_of_units(name):
    quantity = NOMENCLATURE[name]
    assert quantity.name == name
    assert quantity.meaning
    assert quantity.shown_factor == SHOWN[quantity.unit, quantity.shown_unit]


def test_no_name_stands_in_two_parts_of_the_table():
    """The later one would win without a word."""
    names = [row[0] for row in nomenclature._ROWS]
    assert sorted(names) == sorted(NOMENCLATURE)


def test_every_variable_of_a_result_file_has_a_meaning_and_numbers_have_a_unit():
    flags = ("patch_side", "wear_regime", "wear_regime_highest", "life_limited_by")
    for name, variable in [*LAYOUT.items(), *(item for group in GROUPS.values() for item in group.items())]:
        quantity = NOMENCLATURE[name]
        flag = name in flags
        assert bool(quantity.unit) == (variable.kind != "str" and not flag), name


def test_contact_json_names_are_in_the_table():
    """The names of architecture section 7; a renamed one would break scripts of users."""
    names = (
        "shift yaw wheel_load counterface_curvature rotation_speed side wheel_y rail_y x contact_angle area "
        "max_pressure length width approach normal_force creepage_x creepage_y spin force_x force_y "
        "spin_moment slip_area power power_balance normal tangential"
    )
    assert set(names.split()) <= set(NOMENCLATURE)


def test_label_shows_meaning_symbol_and_unit_of_dimensional_quantities():
    assert NOMENCLATURE["max_pressure"].label == "largest contact pressure p₀ [MPa]"
    assert NOMENCLATURE["equivalent_conicity"].label == "equivalent conicity at 3 mm amplitude λ"
    assert NOMENCLATURE["normal"].label == "normal contact model"


def test_stored_text_survives_netcdf(tmp_path):
    """Greek letters and signs of the table must come back from a file as they went in."""
    with Dataset(tmp_path / "text.nc", "w") as file:
        for name, quantity in NOMENCLATURE.items():
            file.setncattr(f"t_{name}", quantity.label)
    with Dataset(tmp_path / "text.nc") as file:
        assert all(file.getncattr(f"t_{n}") == q.label for n, q in NOMENCLATURE.items())


def test_table_cannot_be_changed_at_run_time():
    with pytest.raises(TypeError):
        NOMENCLATURE["area"] = np.nan
