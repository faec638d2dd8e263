"""Rolling radius difference and equivalent conicity of wheel pairs."""

from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ProfileError
from wearsim.profile.conicity import equivalent_conicity, rolling_radius_difference
from wearsim.profile.measures import (
    flange_gradient,
    flange_height,
    flange_thickness,
    hollowing,
)
from wearsim.profile.shape import Profile
from wearsim.profile.standard import rail, read_definition, sample, wheel

DATA = Path(__file__).parents[1] / "data"
S1002 = wheel("S1002")
RAIL = rail("60E1", 1 / 40, 1.435, 0.750)


def benchmark(name):
    shape = read_definition(DATA / f"profile_en15302_{name}.toml")
    return Profile(shape.name, shape.kind, *sample(shape, 0.25e-3))


def coned(slope):
    """Wheel whose tread is a cone, with the flange of S1002."""
    z = np.where(S1002.y < -0.030, S1002.z, -slope * S1002.y)
    return Profile("cone", "wheel", S1002.y, z)


def test_rolling_radius_difference_equals_the_check_table():
    """1 um except within one grid step of the contact jumps at 0.2..0.3 mm and 6.6..6.7
    mm.
    """
    shift, expected, _ = (
        np.loadtxt(DATA / "profile_delta_r.csv", delimiter=",", skiprows=2).T * 1e-3
    )
    away = shift < 6.65e-3
    result = rolling_radius_difference(S1002, S1002, RAIL)(shift)
    assert result[away] == pytest.approx(expected[away], abs=1e-6)
    # on the flank of 70 degrees 1 um of shift is 2.7 um of radius; the table's grid is
    # 5 um
    assert result[~away] == pytest.approx(expected[~away], abs=14e-6)


def test_rolling_radius_difference_is_odd_for_equal_wheels():
    shift = np.array([0.37e-3, 1.234e-3, 3e-3, 5.01e-3])
    right = rolling_radius_difference(S1002, S1002, RAIL)(shift)
    assert rolling_radius_difference(S1002, S1002, RAIL)(-shift) == pytest.approx(
        -right, abs=1e-12
    )


def test_unequal_wheels_swap_with_the_sign_of_the_shift():
    other, shift = coned(1 / 20), np.linspace(-4e-3, 4e-3, 17)
    one = rolling_radius_difference(S1002, other, RAIL)(shift)
    two = rolling_radius_difference(other, S1002, RAIL)(-shift)
    assert one == pytest.approx(-two, abs=1e-12)


def test_conicity_equals_the_check_table():
    """The table is uncertain by 0.01 beside contact jumps (1432, 6 mm), elsewhere by
    its grid.
    """
    rows = [
        line.split(",")
        for line in (DATA / "profile_conicity.csv").read_text().splitlines()[2:]
    ]
    assert len(rows) == 4
    for inclination, gauge, *expected in rows:
        cant = 1.0 / float(inclination.split(":")[1])
        placed = rail("60E1", cant, float(gauge) * 1e-3, 0.750)
        for millimetres, value in enumerate(map(float, expected), start=1):
            result = equivalent_conicity(
                S1002, S1002, placed, amplitude=millimetres * 1e-3
            )
            tolerance = 0.01 if (gauge, millimetres) == ("1432", 6) else 0.0015
            assert result == pytest.approx(value, abs=tolerance), (
                inclination,
                gauge,
                millimetres,
            )


def test_conicity_of_the_reference_pair():
    assert equivalent_conicity(S1002, S1002, RAIL, amplitude=3e-3) == pytest.approx(
        0.174, abs=0.001
    )


def test_conicity_of_the_benchmark_of_en_15302():
    """Wheel A on rail A, values of the standard, printed to 0.001."""
    a, counter = benchmark("wheel_a"), benchmark("rail_a")
    published = [0.125, 0.155, 0.188, 0.216, 0.254, 0.303]
    result = [
        equivalent_conicity(a, a, counter, amplitude=k * 1e-3) for k in range(1, 7)
    ]
    assert result == pytest.approx(published, abs=0.00055)


@pytest.mark.parametrize("slope", [1 / 10, 1 / 20, 1 / 40])
def test_conicity_of_a_cone_is_its_slope(slope):
    """Midpoint rule on 400 phases and the search grid: 1e-6 of the slope."""
    wheels = coned(slope)
    result = equivalent_conicity(
        wheels, wheels, rail("60E1", 1 / 20, 1.435, 0.750), amplitude=3e-3
    )
    assert result == pytest.approx(slope, rel=1e-5)


def test_conicity_does_not_depend_on_which_wheel_is_right():
    other = coned(1 / 20)
    one = equivalent_conicity(S1002, other, RAIL)
    two = equivalent_conicity(other, S1002, RAIL)
    assert one is not None
    assert one == pytest.approx(two, rel=1e-6)


def test_cylinders_have_no_conicity():
    wheels = coned(0.0)
    assert (
        equivalent_conicity(wheels, wheels, rail("60E1", 1 / 20, 1.435, 0.750)) is None
    )


def test_reversed_cones_have_no_conicity():
    """Radii that fall on the side the wheelset moves to: it does not come back."""
    wheels = coned(-1 / 40)
    assert (
        equivalent_conicity(
            wheels, wheels, rail("60E1", 1 / 20, 1.435, 0.750), amplitude=1e-3
        )
        is None
    )


def test_wheels_that_miss_the_rail_are_refused():
    off = Profile("far rail", "rail", RAIL.y + 0.3, RAIL.z)
    with pytest.raises(
        ProfileError, match=r"no contact within the profiles over an amplitude of 3 mm"
    ):
        equivalent_conicity(S1002, S1002, off)
    assert np.isnan(
        rolling_radius_difference(S1002, S1002, off)(np.array([1e-3]))
    ).all()


@pytest.mark.parametrize("amplitude", [0.0, -1e-3, 1.0, np.nan])
def test_amplitude_is_checked(amplitude):
    with pytest.raises(
        ProfileError, match=r"amplitude = .* must be at least 0\.2 and at most 15 mm"
    ):
        equivalent_conicity(S1002, S1002, RAIL, amplitude=amplitude)


@pytest.mark.benchmark
def test_time_of_all_measures_of_a_step(benchmark):
    """Budget: 30 ms per wear step for both wheels and the conicity of unequal
    wheels.
    """
    other = wheel("S1002", spacing=0.2501e-3)

    def measures():
        for y, z in ((S1002.y, S1002.z), (other.y, other.z)):
            (
                flange_height(y, z),
                flange_thickness(y, z),
                flange_gradient(y, z),
                hollowing(y, z),
            )
        return equivalent_conicity(S1002, other, RAIL)

    assert benchmark(measures) == pytest.approx(0.174, abs=0.001)
