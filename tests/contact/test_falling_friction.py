"""Friction that falls with the rigid slip velocity, and the crest of creep forces."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.contact.equilibrium import nearest_root
from wearsim.contact.friction import falling_friction
from wearsim.contact.problem import ContactModels
from wearsim.contact.solve import solve
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.errors import NumericalError

RATIO, DECREASE, SPEED, LOAD, FRICTION, RADIUS = 0.4, 0.6, 30.0, 80e3, 0.4, 0.46
FALLING = {"friction_ratio": RATIO, "friction_decrease": DECREASE}


def models_of(pair, **others):
    return ContactModels.of(pair, strips=12, cells=12, cell_size=1e-3, **others)


def test_friction_falls_from_rest_to_its_ratio():
    """Closed form."""
    values = falling_friction(np.array([0.0, 1.0 / DECREASE, 1e3]), RATIO, DECREASE)
    expected = [1.0, RATIO + (1.0 - RATIO) / np.e, RATIO]
    np.testing.assert_allclose(values, expected, rtol=1e-12)


@pytest.mark.parametrize("name", sorted(TANGENTIAL_MODELS))
@pytest.mark.parametrize("normal", ["kik_piotrowski", "coupled_strips"])
def test_full_slip_has_the_friction_of_its_velocity(
    wheelset, counterface, points, normal, name
):
    """Elastic slip left over at 10 %, spin, and the load that a lateral force lifts:
    1 %. The power is that of the rigid slip.
    """
    creepage = np.array([[0.1, 0.0, 0.0], [0.03, -0.04, 0.0]])
    conditions = points(shift=np.zeros(2), speed=SPEED, friction=FRICTION)
    conditions = replace(conditions, creepage=creepage)
    models = replace(models_of("fast", **FALLING), normal=normal, tangential=name)
    found = solve(conditions, wheelset, counterface(), models, sides=(0,))
    slip = np.linalg.norm(creepage[:, :2], axis=1)
    friction = FRICTION * falling_friction(SPEED * slip, RATIO, DECREASE)
    force = np.hypot(found.force_x, found.force_y)
    np.testing.assert_allclose(force, friction * found.normal_force, rtol=0.01)
    np.testing.assert_allclose(found.power, force * slip * SPEED, rtol=0.01)


@pytest.mark.parametrize("others", [{"friction_ratio": 0.4}, {"friction_decrease": 1}])
def test_one_number_alone_changes_nothing(wheelset, counterface, points, others):
    conditions = points(shift=3e-3, rotation="free")
    plain, same = (
        solve(conditions, wheelset, counterface(), models_of("fast", **given))
        for given in ({}, others)
    )
    np.testing.assert_array_equal(plain.force_x, same.force_x)
    np.testing.assert_array_equal(plain.power, same.power)


@pytest.fixture(scope="module", params=["fast", "standard"])
def models(request):
    return models_of(request.param, kalker_factor=0.5, **FALLING)


@pytest.fixture(scope="module")
def crest(wheelset, counterface, points, models):
    """Largest torque of the axle over rotation speeds in small steps [N m], and the
    longitudinal creepage there.
    """
    rotation = SPEED / RADIUS * (1.0 + np.linspace(0.0, 0.02, 201))
    conditions = points(
        shift=np.zeros(201), speed=SPEED, friction=FRICTION, rotation=rotation
    )
    found = solve(conditions, wheelset, counterface(), models)
    torque = np.bincount(found.point, RADIUS * found.force_x)
    highest = int(np.argmax(torque))
    return torque[highest], found.creepage_x[found.point == highest][0]


@pytest.mark.parametrize("rule", ["free", "independent"])
@pytest.mark.parametrize("share", [-0.99, 0.3, 0.9, 0.99])
def test_wheels_run_before_the_crest(
    wheelset, counterface, points, models, crest, rule, share
):
    """The torque is carried, 1 % by spin moments, with less slip than at the crest."""
    torque, creepage = crest
    conditions = points(
        speed=SPEED, friction=FRICTION, rotation=rule, torque=share * torque
    )
    found = solve(conditions, wheelset, counterface(), models)
    np.testing.assert_allclose(RADIUS * found.force_x.sum(), share * torque, rtol=0.01)
    assert np.all(found.creepage_x * np.sign(share) < 0.0)
    assert np.all(np.abs(found.creepage_x) < abs(creepage))


@pytest.mark.parametrize("rule", ["free", "independent"])
@pytest.mark.parametrize("share", [-1.1, 1.01, 3.0])
def test_a_torque_beyond_the_crest_is_an_error_that_states_it(
    wheelset, counterface, points, models, crest, rule, share
):
    """The scan has steps of 0.01 % creepage, and no spin moments: 0.2 %."""
    conditions = points(
        speed=SPEED, friction=FRICTION, rotation=rule, torque=share * crest[0]
    )
    with pytest.raises(NumericalError, match="beyond the crest of the") as error:
        solve(conditions, wheelset, counterface(), models)
    stated = float(str(error.value).split("creep forces, ")[1].split(" N m")[0])
    assert stated == pytest.approx(np.sign(share) * crest[0], rel=2e-3)
    assert "\n" not in str(error.value)


def solved_root(shift):
    """Nearest root of a curve with crests of 0.5 at 1 on both sides of 0."""

    def torque(x, wanted):
        return np.where(wanted, -x / (1.0 + x * x) - shift, np.nan)

    one = np.ones(shift.size)
    return nearest_root(
        torque,
        0.0 * one,
        1e-2 * one,
        goal=1e-12 * one,
        narrow=0.0 * one,
        done=one == 0.0,
    )


def test_the_nearest_root_is_before_the_crest():
    """Closed form: roots of x^2 + x/s + 1 = 0; iterations stop at 1e-12."""
    shift = np.array([-0.4999, -0.3, -1e-3, 0.2, 0.49])
    root, solved, missing = solved_root(shift)
    assert solved.all()
    assert not missing.any()
    expected = (-1.0 + np.sqrt(1.0 - 4.0 * shift**2)) / (2.0 * shift)
    np.testing.assert_allclose(root, expected, atol=1e-8)


def test_without_a_root_the_crest_is_the_nearest_value():
    """Golden sections to 1e-4 of a stride: second order of it."""
    root, solved, missing = solved_root(np.array([0.6, -0.7, 0.1]))
    assert solved.tolist() == [False, False, True]
    np.testing.assert_allclose(root[:2], [-1.0, 1.0], atol=1e-2)
    np.testing.assert_allclose(missing, [-0.1, 0.2, 0.0], atol=1e-6)
