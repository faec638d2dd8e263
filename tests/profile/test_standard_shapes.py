"""Contract of every shipped shape: source, certainty, junctions, points, and a contact
solved with it.
"""

import json
import math

import numpy as np
import pytest
from junctions import KINK_TOLERANCE, STEP_TOLERANCE, junction_faults, junctions

from wearsim.cli import main
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.solve import solve
from wearsim.profile.checks import points_faults
from wearsim.profile.shape import Profile, arc_length, resample
from wearsim.profile.standard import (
    build,
    definition,
    evaluate,
    find_shipped,
    rail,
    read_definition,
    read_template,
    sample,
    shipped_names,
    shipped_path,
    wheel,
)

FILES = sorted(shipped_path("profiles").glob("*.toml"))
RAILS = [path.stem for path in FILES if read_template(path).about["kind"] == "rail"]
WHEELS = [path.stem for path in FILES if read_template(path).about["kind"] == "wheel"]
# flat across its whole width: no flange to measure, and no origin to check
WITHOUT_FLANGE = ["disc"]
# (file, parameter, value): the ends of all ranges
EXTREMES = [
    pytest.param(
        path,
        parameter.form,
        value,
        id=f"{path.stem}/{parameter.form.replace('#', f'{value:g}')}",
    )
    for path in FILES
    for parameter in read_template(path).parameters
    for value in parameter.range or (min(parameter.values), max(parameter.values))
]


def pressures(wheel_profile, counterface, curvature):
    """Largest pressure of the patch that carries most, in the middle of the track and 3
    mm aside [Pa].

    A patch that has just appeared carries next to nothing, at any pressure down to
    zero.
    """
    shift = np.array([0.0, 3e-3])
    same = np.ones(2)
    points = ContactConditions(
        shift,
        0 * same,
        0 * same,
        80e3 * same,
        20 * same,
        0.35 * same,
        0 * same,
        rotation="nominal",
    )
    solution = solve(
        points,
        Wheelset(wheel_profile, wheel_profile, 0.46, 0.75),
        Counterface(counterface, curvature),
        ContactModels.of("fast", strips=16, cells=12),
        sides=(0,),
    )
    _, main = np.unique(
        solution.point, return_index=True
    )  # patches are in falling order of their loads
    assert len(main) == 2
    return solution.fields.pressure[main].max(axis=(1, 2))


@pytest.fixture(scope="module")
def rail_60e1():
    return rail("60E1", 1 / 40, 1.435, 0.750)


@pytest.fixture(scope="module")
def s1002():
    return wheel("S1002")


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_every_file_tells_its_source_and_certainty(path):
    shape = read_definition(path)
    assert shape.name == path.stem
    assert len(shape.source) > 20
    assert shape.certainty.startswith(("certain", "exact", "uncertain"))
    assert find_shipped(shape.name) == path
    for alias in read_template(path).about.get("aliases", ()):
        assert definition(alias, shape.kind) == shape


def test_names_are_complete():
    assert {
        "S1002",
        "EPS",
        "1in40",
        "1:40",
        "1/40",
        "P8",
        "cone",
        "cylinder",
        "disc",
    } <= set(shipped_names("wheel"))
    assert {f"EN15302_{letter}" for letter in "ABCHI"} <= set(shipped_names("wheel"))
    assert set(RAILS) >= {
        "60E1",
        "60E2",
        "54E1",
        "54E2",
        "49E1",
        "56E1",
        "60E1_benchmark",
        "EN15302_rail_A",
    }


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_junctions_are_smooth_but_where_the_standard_is_not(path):
    """None is off without a reason, and nothing is excused for nothing."""
    shape = read_definition(path)
    assert junction_faults(shape) == []
    _, step, kink = junctions(shape)
    rough = (np.abs(step) > STEP_TOLERANCE) | (np.abs(kink) > KINK_TOLERANCE)
    zones = [piece.zone for piece in shape.segments]
    there = {(zones[k], zones[k + 1]) for k in np.flatnonzero(rough)}
    assert there == {tuple(allowance["between"]) for allowance in shape.allowances}
    assert all(len(allowance["reason"]) > 10 for allowance in shape.allowances)
    assert np.max(np.abs(step)) < 1e-6
    assert np.all(step[np.abs(kink) > 4e-3] < STEP_TOLERANCE)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_points_lie_on_the_definition(path):
    shape = read_definition(path)
    y, z = sample(shape, 0.25e-3)
    assert np.all(np.diff(y) > 0.0)
    assert np.max(np.diff(arc_length(y, z))) < 0.5e-3
    assert z == pytest.approx(evaluate(shape, y), abs=0.0)
    if shape.name not in WITHOUT_FLANGE:
        assert points_faults(shape.kind, y, z) == []


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_resampling_keeps_the_shape(path):
    """A cubic spline through points of 0.25 mm; across an edge of 0.17 rad it leaves
    the shape by 3 um.
    """
    shape = read_definition(path)
    y, z = sample(shape, 0.25e-3)
    new = resample(Profile(shape.name, shape.kind, y, z), 0.31e-3)
    inside = (new.y >= y[0]) & (new.y <= y[-1])
    low, high = np.tan(np.radians([-80.0, 80.0]))
    slope = np.gradient(new.z, new.y)
    flat = inside & (slope > low) & (slope < high)
    off = (new.z - evaluate(shape, np.clip(new.y, y[0], y[-1]))) / np.hypot(1.0, slope)
    assert np.max(np.abs(off[flat])) < 4e-6


@pytest.mark.parametrize("name", WHEELS)
def test_every_wheel_runs_on_a_rail(name, rail_60e1):
    result = pressures(wheel(name), rail_60e1, 0.0)
    assert np.all((result > 0.3e9) & (result < 6e9))


@pytest.mark.parametrize("curvature", [0.0, 2.0])
@pytest.mark.parametrize("name", RAILS)
def test_every_rail_carries_a_wheel_as_rail_and_as_roller(name, curvature, s1002):
    result = pressures(s1002, rail(name, 1 / 40, 1.435, 0.750), curvature)
    assert np.all((result > 0.3e9) & (result < 6e9))


@pytest.mark.parametrize("name", RAILS)
def test_every_rail_shape_is_a_roller_on_the_command_line(name, capsys):
    assert (
        main(
            [
                "contact",
                "--rail",
                name,
                "--roller-radius-mm",
                "500",
                "--shift-mm",
                "3",
                "--json",
            ]
        )
        == 0
    )
    (point,) = json.loads(capsys.readouterr().out)["points"]
    assert point["counterface_curvature"] == pytest.approx(2.0)
    assert sum(patch["normal_force"] for patch in point["patches"]) == pytest.approx(
        80e3, rel=0.02
    )


@pytest.mark.parametrize(("path", "form", "value"), EXTREMES)
def test_every_parameter_can_be_taken_to_its_limits(path, form, value, rail_60e1):
    template = read_template(path)
    values = {p.form: p.default for p in template.parameters}
    shape = build(template, values | {form: value})
    assert junction_faults(shape) == []
    y, z = sample(shape, 0.25e-3)
    assert points_faults(shape.kind, y, z) == []
    assert np.all(pressures(Profile(shape.name, "wheel", y, z), rail_60e1, 0.0) < 6e9)
    # the name holds what differs, and stands for the same shape
    assert definition(shape.name, shape.kind) == shape
    assert math.isclose(y[0], -0.070)
