"""Measures that a header contradicts or that are noise are reported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.profile.inspection.inputs import measure_notes, read_input
from wearsim.profile.measures import hollowing, wheel_measures

MEASURED = Path(__file__).parents[3] / "profiles" / "measured"


@pytest.fixture(scope="module")
def wheel():
    return read_input(str(MEASURED / "wheel_worn_right.whl"))


@pytest.fixture(scope="module")
def values(wheel):
    return wheel_measures(wheel.profile).values


def test_headers_that_agree_say_nothing(wheel, values):
    """Instruments smooth: Sh 27.97 for 27.80 mm was found in a real file."""
    near = {"SH": "29.45", "sd": "32,4000", "qR": "10.3"}
    assert (
        measure_notes(wheel, values)
        == measure_notes(replace(wheel, header=near), values)
        == ()
    )
    unset = {"Sh": "0.0000", "Sd": "", "qR": "-"}
    assert measure_notes(replace(wheel, header=unset), values) == ()


def test_headers_that_disagree_are_told_at_once(wheel, values):
    first, second = measure_notes(
        replace(wheel, header={"Sh": "28.1", "Sd": "25", "qR": "10.66"}), values
    )
    assert first.startswith(
        "the header says Sh = 28.1 mm, the points give 29.60 mm: it is old"
    )
    assert second.startswith("the header says Sd = 25 mm, the points give 32.35 mm")


@pytest.mark.parametrize("noise", [0.0, 3e-6, 50e-6])
def test_hollowing_of_noise_is_told(noise):
    """White noise of 50 um stands out by 0.2 mm on a tread without hollowing; 3 um by
    0.02 mm.
    """
    new = read_input("S1002")
    z = new.profile.z + np.random.default_rng(5).normal(0.0, noise, len(new.profile.z))
    subject = replace(new, format="two-column", profile=replace(new.profile, z=z))
    result = {"hollowing": hollowing(subject.profile.y, z)}
    message = measure_notes(subject, result)
    if noise < 10e-6:
        assert message == ()
    else:
        assert message[0].startswith(
            f"of {1e3 * result['hollowing']:.3f} mm hollowing "
        )
        assert "--smooth-mm 5" in message[0]


def test_real_hollowing_stays(wheel, values):
    assert values["hollowing"] > 1e-3
    assert measure_notes(wheel, values) == ()
