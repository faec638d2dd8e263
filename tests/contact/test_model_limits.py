"""Validation of every model's input and solution: coarse grids, loads, patches beyond
elasticity.
"""

import sys
from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact import normal as normal_models
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.normal.model import LARGEST_STRAIN, LONGEST_PATCH, NormalModel
from wearsim.contact.problem import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.registry import discover
from wearsim.contact.solve import CHUNK, solve
from wearsim.contact.tangential import TANGENTIAL_MODELS, TangentialModel
from wearsim.errors import ContactError, NumericalError
from wearsim.profile import standard

ONE = np.ones(1)


def solved(load=80e3, roller=None, youngs_modulus=210e9, **models):
    wheel = standard.wheel("S1002")
    conditions = ContactConditions(
        3e-3 * ONE,
        0.0 * ONE,
        0.0 * ONE,
        load * ONE,
        20.0 * ONE,
        0.35 * ONE,
        0.0 * ONE,
        rotation="nominal",
    )
    return solve(
        conditions,
        Wheelset(wheel, wheel, 0.46, 0.75),
        Counterface(
            standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75),
            0.0 if roller is None else 1.0 / roller,
        ),
        ContactModels(
            **{
                "normal": "kik_piotrowski",
                "tangential": "fastsim",
                "youngs_modulus": youngs_modulus,
                **models,
            }
        ),
        sides=(0,),
    )


@pytest.mark.parametrize("normal", sorted(NORMAL_MODELS))
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"strips": 1}, "strips = 1 must be at least 5"),
        ({"cells": 4}, "cells = 4 must be at least 5"),
        ({"load": 0.0}, "wheel load = 0 N must be above 0 N"),
        ({"load": -1.0}, "wheel load = -1 N must be above 0 N"),
        ({"load": np.nan}, "wheel load = nan N must be above 0 N"),
        ({"load": np.inf}, "wheel load = inf N must be above 0 N"),
        ({"roller": 1e-3}, "edge of a profile"),
    ],
)
def test_every_normal_model_rejects_what_is_outside_its_limits(
    normal, changes, message
):
    with pytest.raises(ContactError) as fault:
        solved(normal=normal, **changes)
    assert message in str(fault.value)


@pytest.mark.parametrize("tangential", sorted(TANGENTIAL_MODELS))
def test_every_tangential_model_solves_on_the_coarsest_grid_it_allows_and_not_below(
    tangential,
):
    """Power within 20 % of that on 50 x 50: what a grid of eight cells may cost."""
    fine = solved(tangential=tangential).power[0]
    powers = []
    for count in (5, 8):
        try:
            powers.append(
                solved(tangential=tangential, strips=count, cells=count).power[0]
            )
        except ContactError as error:
            message = str(error)
            powers.append(
                fine if message.startswith(f"{tangential} needs at least") else np.nan
            )
    np.testing.assert_allclose(powers, fine, rtol=0.2)


def test_a_module_in_the_folder_is_a_model(monkeypatch, tmp_path):
    """Adding a model touches one file: registry, solver, scenes and command line take
    it from there.
    """
    (tmp_path / "made_up.py").write_text(
        "from dataclasses import replace\n"
        "from wearsim.contact.normal.hertz import MODEL as hertz\n"
        'MODEL = replace(hertz, name="made_up", can_update_profile=True)\n'
    )
    monkeypatch.setattr(
        normal_models, "__path__", [*normal_models.__path__, str(tmp_path)]
    )
    try:
        records = discover(
            "normal model", normal_models.__name__, normal_models.__path__, NormalModel
        )
    finally:
        sys.modules.pop(f"{normal_models.__name__}.made_up", None)
        vars(normal_models).pop("made_up", None)
    assert set(records) == {*NORMAL_MODELS, "made_up"}
    assert list(records) == sorted(records)
    monkeypatch.setitem(NORMAL_MODELS, "made_up", records["made_up"])
    np.testing.assert_array_equal(
        solved(normal="made_up").power, solved(normal="hertz").power
    )


def test_half_space_rolling_names_what_it_needs():
    with pytest.raises(
        ContactError,
        match="half_space needs at least 8 strips and cells along them; take more",
    ):
        solved(tangential="half_space", strips=7, cells=50, cell_size=1.0)


def registered(monkeypatch, **changed):
    """Hertz's solution with some of it changed, as a model of its own."""

    def model(gap, row, load, **others):
        result = NORMAL_MODELS["hertz"](gap, row, load, **others)
        patch = {
            name: changed[name](getattr(result.patch, name))
            for name in changed
            if hasattr(result.patch, name)
        }
        whole = {
            name: changed[name](getattr(result, name))
            for name in changed
            if hasattr(result, name)
        }
        return replace(result, patch=replace(result.patch, **patch), **whole)

    monkeypatch.setitem(
        NORMAL_MODELS, "made_up", NormalModel(name="made_up", solve=model)
    )


def test_a_patch_as_long_as_the_wheel_is_round_is_no_half_space(monkeypatch):
    radius = 0.46 + float(
        np.interp(-12.5e-3, standard.wheel("S1002").y, standard.wheel("S1002").z)
    )
    for half, fits in (
        (0.999 * LONGEST_PATCH * radius, True),
        (1.001 * LONGEST_PATCH * radius, False),
    ):
        registered(
            monkeypatch,
            x_lead=lambda x, half=half: np.full_like(x, half),
            x_trail=lambda x, half=half: np.full_like(x, -half),
        )
        if fits:
            assert solved(normal="made_up").length[0] == pytest.approx(
                2.0 * half, rel=1e-3
            )  # creep forces move the load
        else:
            with pytest.raises(
                ContactError,
                match=r"277 mm long on a rolling radius of 46\d mm, more than 0\.6",
            ):
                solved(normal="made_up")


def test_pressures_beyond_a_tenth_of_the_modulus_are_not_elastic():
    """Hertz: the pressure grows with the cube root of the load, so the limit is known
    beforehand.
    """
    result = solved(normal="hertz", roller=20e-3)
    largest = (
        80e3
        * (
            LARGEST_STRAIN
            * ContactModels.of("fast").effective_modulus
            / result.max_pressure[0]
        )
        ** 3
    )
    assert (
        solved(normal="hertz", roller=20e-3, load=0.99 * largest).max_pressure[0] > 11e9
    )
    with pytest.raises(ContactError, match=r"MPa, more than 0\.1 of E"):
        solved(normal="hertz", roller=20e-3, load=1.01 * largest)


@pytest.mark.parametrize(
    "name", ["max_pressure", "vertical_displacement", "approach", "x_lead"]
)
def test_a_solution_that_is_not_finite_never_leaves_a_normal_model(monkeypatch, name):
    registered(monkeypatch, **{name: lambda values: np.full_like(values, np.nan)})
    with pytest.raises(NumericalError, match="no finite solution; check profiles"):
        solved(normal="made_up")


@pytest.mark.parametrize("rotation", ["nominal", "free"])
def test_a_tangential_failure_names_its_operating_point(
    monkeypatch, wheelset, counterface, points, rotation
):
    """Also behind the first chunk of points, whose rows are counted anew."""
    shift = np.linspace(-3e-3, 3e-3, CHUNK + 6)
    fails = CHUNK + 3

    def model(patch, creepage, friction, **others):
        result = np.flatnonzero((patch.row == fails - CHUNK) & (friction == 0.25))
        if result.size > 0:
            raise NumericalError("does not converge", row=int(patch.row[result[0]]))
        return TANGENTIAL_MODELS["fastsim"](patch, creepage, friction, **others)

    monkeypatch.setitem(
        TANGENTIAL_MODELS, "made_up", TangentialModel("made_up", model, 1.0)
    )
    friction = np.where(np.arange(shift.size) == fails, 0.25, 0.35)
    with pytest.raises(
        NumericalError,
        match=(
            rf"^point {fails}, shift {1e3 * shift[fails]:g} mm, yaw 4 mrad: does not "
            r"converge"
        ),
    ) as caught:
        solve(
            points(shift, 4e-3, friction=friction, rotation=rotation),
            wheelset,
            counterface(),
            ContactModels("kik_piotrowski", "made_up", strips=10, cells=10),
        )
    assert caught.value.row == fails
