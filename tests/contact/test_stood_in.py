"""A wheel that the models on strips do not solve: the half-space stands in, for that
wheel alone.
"""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import wheels
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import ContactError, NumericalError

MODELS = ContactModels(strips=12, cells=12, cell_size=1e-3)


@pytest.fixture
def refusing(monkeypatch):
    """Function after which strips have no solution of the second row, with an error of
    a kind.
    """

    def refuse(kind):
        model = NORMAL_MODELS["coupled_strips"]

        def fails(gap, row, load, **options):
            if not options["rough"] and 1 in row:
                raise kind("refused", row=1)
            return model.solve(gap, row, load, **options)

        changed = {**NORMAL_MODELS, "coupled_strips": replace(model, solve=fails)}
        monkeypatch.setattr(wheels, "NORMAL_MODELS", changed)

    return refuse


def test_the_half_space_solves_the_wheel_that_strips_do_not(
    refusing, wheelset, counterface, points
):
    conditions = points([0.0, 3e-3, -2e-3], rotation="free")
    whole = solve(conditions, wheelset, counterface(), MODELS)
    refusing(NumericalError)
    mixed = solve(conditions, wheelset, counterface(), MODELS)
    by_half_space = solve(
        conditions, wheelset, counterface(), replace(MODELS, normal="half_space")
    )
    others, there = mixed.point != 1, mixed.point == 1
    np.testing.assert_array_equal(mixed.point, whole.point)
    np.testing.assert_array_equal(mixed.stood_in, there)
    assert not whole.stood_in.any()
    np.testing.assert_array_equal(
        mixed.normal_force[others], whole.normal_force[others]
    )
    np.testing.assert_array_equal(mixed.power[others], whole.power[others])
    theirs = by_half_space.max_pressure[by_half_space.point == 1]
    np.testing.assert_allclose(mixed.max_pressure[there], theirs, rtol=5e-3)
    # the same tractions but for pressures along each strip
    np.testing.assert_allclose(
        mixed.power[there], by_half_space.power[by_half_space.point == 1], rtol=0.05
    )
    assert mixed.patch.grid is None


def test_on_a_grid_too_coarse_for_the_half_space_it_has_its_coarsest_one(
    refusing, wheelset, counterface, points
):
    refusing(NumericalError)
    coarse = replace(MODELS, strips=5, cells=5, cell_size=1.0)
    mixed = solve(points([0.0, 3e-3], rotation="free"), wheelset, counterface(), coarse)
    assert np.isfinite(mixed.power).all()


def test_a_wheel_without_contact_stays_without(refusing, wheelset, counterface, points):
    refusing(ContactError)
    with pytest.raises(ContactError, match="refused") as caught:
        solve(points([0.0, 3e-3], rotation="free"), wheelset, counterface(), MODELS)
    assert caught.value.row == 1


# ---- creep forces


@pytest.fixture
def not_rolling(monkeypatch):
    """Function after which strips have no creep forces of the left wheel of the second
    point.

    Neither has the half-space, if it `also` is named.
    """

    def refuse(also=""):
        for name in filter(None, ("coupled_strips", also)):
            model = TANGENTIAL_MODELS[name]

            def fails(patch, creepage, friction, strips=None, model=model, **options):
                if strips is None or 3 in strips.wheel:
                    raise NumericalError(f"{model.name} refused", row=1)
                return model.solve(patch, creepage, friction, strips=strips, **options)

            monkeypatch.setitem(TANGENTIAL_MODELS, name, replace(model, solve=fails))

    return refuse


def test_the_half_space_finds_the_creep_forces_that_strips_do_not(
    not_rolling, wheelset, counterface, points
):
    conditions = points([0.0, 3e-3, -2e-3], rotation="nominal")
    whole = solve(conditions, wheelset, counterface(), MODELS)
    by_half_space = solve(
        conditions, wheelset, counterface(), replace(MODELS, tangential="half_space")
    )
    not_rolling()
    mixed = solve(conditions, wheelset, counterface(), MODELS)
    there = (mixed.point == 1) & (mixed.side == 1)
    np.testing.assert_array_equal(mixed.stood_in, there)
    for name in (
        "normal_force",
        "force_x",
        "force_y",
        "spin_moment",
        "power",
        "slip_area",
    ):
        one, other = getattr(mixed, name), getattr(whole, name)
        np.testing.assert_allclose(one[~there], other[~there], rtol=1e-3, err_msg=name)
        # the patch lies in one plane, as in all solutions by the half-space
        other = getattr(by_half_space, name)
        np.testing.assert_allclose(one[there], other[there], rtol=0.05, err_msg=name)
    assert (mixed.power_balance[there] > 0.9).all()


def test_a_wheel_without_creep_forces_by_either_has_the_error_of_the_strips(
    not_rolling, wheelset, counterface, points
):
    not_rolling(also="half_space")
    with pytest.raises(NumericalError, match=r"^point 1, .* coupled_strips refused"):
        solve(
            points([0.0, 3e-3, -2e-3], rotation="nominal"),
            wheelset,
            counterface(),
            MODELS,
        )


def test_wheels_that_balance_the_torque_do_so_with_creep_forces_of_both(
    not_rolling, wheelset, counterface, points
):
    not_rolling()
    mixed = solve(points([0.0, 3e-3], rotation="free"), wheelset, counterface(), MODELS)
    pair = mixed.point == 1
    np.testing.assert_array_equal(mixed.stood_in[pair], mixed.side[pair])
    drive = mixed.force_x[pair]
    assert abs(drive.sum()) < 0.02 * abs(drive).max()
