"""Contact states: what the figures of a contact solution are drawn from."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.contact.dataset import SIDES, solve_contact
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.errors import ContactError
from wearsim.profile import standard
from wearsim.quantities import QUANTITIES
from wearsim.studies.contact_state import contact_state


@pytest.fixture(scope="module")
def wheelset():
    wheel = standard.wheel("S1002")
    return Wheelset(wheel, wheel, 0.46, 0.75)


@pytest.fixture(scope="module")
def rail():
    return standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)


@pytest.fixture(scope="module")
def state(wheelset, rail):
    """Solve one point of shift [m], yaw [rad] and curvature [1/m], and make its
    dataset.
    """

    def make(shift, yaw=0.0, kappa=0.0, sides=(0, 1), **options):
        ones = np.ones(2)
        conditions = ContactConditions(
            shift=np.array([0.0, shift]),
            yaw=yaw * ones,
            roll=0.0 * ones,
            wheel_load=80e3 * ones,
            speed=20.0 * ones,
            friction=0.35 * ones,
            track_curvature=0.0 * ones,
            **options,
        )
        counterface = Counterface(rail, kappa)
        models = ContactModels.of("fast", strips=24, cells=20)
        named = [SIDES[side] for side in sides]
        contact = solve_contact(
            wheelset, counterface, conditions, models, sides=named, fields=True
        )
        return contact_state(
            conditions, wheelset, counterface, contact, point=1
        ), contact

    return make


def test_every_variable_has_unit_and_meaning(state):
    dataset, _ = state(5.1e-3)
    for name, variable in dataset.variables.items():
        assert variable.attrs["long_name"], name
        assert name in ("side", "wheel") or "units" in variable.attrs, name
        quantity = QUANTITIES.get(name)
        if quantity is not None:
            assert variable.attrs["long_name"] == quantity.meaning
    assert all(
        np.isfinite(variable.values).all() for variable in dataset.variables.values()
    )


def test_only_the_patches_of_the_point(state):
    dataset, contact = state(5.1e-3)
    own = contact["point"].values == 1
    assert dataset.sizes["patch"] == own.sum() == 3
    assert dataset["power"].values.tolist() == contact["power"].values[own].tolist()
    assert dataset["side"].values.tolist() == [0, 0, 1]
    assert float(dataset["shift"]) == 5.1e-3
    assert dataset.attrs["label"] == "rail"


def test_fields_carry_the_forces_of_their_patch(state):
    """Pressure to the load, shear to the creep forces: the models' own resultants, on
    their grid.
    """
    dataset, _ = state(3e-3, yaw=2e-3, kappa=1.0)
    length = (dataset["cells_lead"] - dataset["cells_trail"]) / dataset.sizes["cell"]
    area = length * dataset["strip_width"]
    for field, force in (
        ("pressure", "normal_force"),
        ("shear_x", "force_x"),
        ("shear_y", "force_y"),
    ):
        total = (dataset[field] * area).sum(("cell", "strip"))
        np.testing.assert_allclose(total, dataset[force], rtol=1e-9)
    power = (dataset["work_density"] * area).sum(("cell", "strip")) * float(
        dataset["speed"]
    )
    np.testing.assert_allclose(power, dataset["power"], rtol=1e-12)
    assert dataset.attrs["label"] == "roller 1000 mm"


def test_slipping_cells_are_those_where_work_is_done(state):
    """Each cell that works slips; the slip area counts whole cells, too, save those cut
    in between.
    """
    dataset, _ = state(3e-3, yaw=2e-3)
    slips = dataset["slipping"] == 1
    assert not ((dataset["work_density"] > 0.0) & ~slips).any()
    area = (
        (dataset["cells_lead"] - dataset["cells_trail"])
        / dataset.sizes["cell"]
        * dataset["strip_width"]
    )
    total = (area * slips).sum(("cell", "strip"))
    cell_row = (area * dataset.sizes["strip"]).max("strip")
    assert (abs(total - dataset["slip_area"]) <= 2.0 * cell_row).all()


def test_a_left_wheel_is_the_mirror_image(state):
    right, _ = state(2e-3, yaw=3e-3, sides=(0,), rotation="nominal")
    left, _ = state(-2e-3, yaw=-3e-3, sides=(1,), rotation="nominal")
    alike = "pressure shear_x slip_x x_lead longitudinal strip_wheel_y wheel_section_z"
    for name in alike.split():
        np.testing.assert_allclose(
            left[name], right[name], rtol=1e-9, atol=1e-15, err_msg=name
        )
    for name in (
        "lateral",
        "shear_y",
        "slip_y",
        "wheel_section_y",
        "counterface_section_y",
    ):
        np.testing.assert_allclose(
            left[name], -right[name], rtol=1e-9, atol=1e-15, err_msg=name
        )
    # the flange is on the inside: at the right end of the left wheel
    assert (
        left["wheel_section_y"].values[0, np.argmax(left["wheel_section_z"].values[0])]
        > 0.0
    )


@pytest.mark.parametrize(
    ("shift", "yaw", "kappa"),
    [(0.0, 0.0, 0.0), (3e-3, 0.0, 0.0), (5.1e-3, 0.0, 2.0), (2e-3, 0.01, 1.0)],
)
def test_wheel_and_counterface_just_touch_in_the_section(state, shift, yaw, kappa):
    """The trace is of first order in the angles and chords cut the curves: 5 um
    together.
    """
    dataset, _ = state(shift, yaw, kappa, free_roll=True)
    for row, side in enumerate(dataset["wheel"].values):
        y, z = (dataset[f"wheel_section_{axis}"].values[row] for axis in "yz")
        rail_y, rail_z = (
            dataset[f"counterface_section_{axis}"].values[row] for axis in "yz"
        )
        tip = int(np.argmax(z))
        y, z = y[tip:], z[tip:]
        order, inside = np.argsort(y), (rail_y > y.min()) & (rail_y < y.max())
        distance = rail_z[inside] - np.interp(rail_y[inside], y[order], z[order])
        assert abs(distance.min()) < 5e-6, side


def test_roll_of_the_state_is_the_free_one(state):
    dataset, contact = state(3e-3, free_roll=True)
    assert float(dataset["roll"]) == contact["roll"].values[1] != 0.0
    assert dataset.attrs["free_roll"] == 1


def test_a_point_that_was_not_solved_is_refused(state, wheelset, rail):
    _, contact = state(1e-3)
    none = contact.assign_coords(point=contact["point"] + 5)
    conditions = ContactConditions(*(np.zeros(1) for _ in range(7)))
    with pytest.raises(ContactError, match="point 1 is not in the solution"):
        contact_state(conditions, wheelset, Counterface(rail, 0.0), none, point=1)
