"""Fast models corrected by a half-space: limits in which the correction is exact, stability, what is kept."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.campaign import correction, differences, evaluate, handover
from wearsim.campaign.control import reached
from wearsim.campaign.evaluate import accumulate, setup_of, solve_passage
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.state import Correction, flattened, rebuilt
from wearsim.contact.solve import ContactModels
from wearsim.errors import ContactError
from wearsim.profile.shape import vertex_lengths
from wearsim.scene import build, load_scene

CURVING = {"shift_mm": 4, "yaw_mrad": 2, "distance_km": 50}
SPREAD = {"shift_mean_mm": 0.5, "shift_std_mm": 1.5, "positions": 10, "share": 1.0}
GRID = "strips = 12\ncells = 12"


def ended(evolution, steps=10_000):
    """Last state of a campaign, and its states."""
    state, taken = evolution.start()
    states = [state]
    while not reached(state.distance, evolution.target) and len(states) <= steps:
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
        states.append(state)
    return state, states


def with_control(evolution, **changes):
    return replace(
        evolution, setup=replace(evolution.setup, control=replace(evolution.setup.control, **changes))
    )


@pytest.fixture(autouse=True)
def none_is_few(monkeypatch, request):
    """Correct single points, too, but in tests named after few points."""
    if "few" not in request.node.name:
        monkeypatch.setattr(handover, "_FEW", 0)


def test_solved_at_every_step_of_euler_s_rule_it_is_the_half_space(evolution_of, scene_text, monkeypatch):
    """Differences added and subtracted again leave rounding; steps are those of the corrected campaign."""
    monkeypatch.setattr(correction, "_STRICTEST", 0.0)
    text = scene_text(CURVING, contact=f'model = "auto"\ntolerance = 0.9\n{GRID}',
                      campaign='distance_km = 6\nintegrator = "euler"\nmax_step_depth_um = 4')  # fmt: skip
    corrected = with_control(evolution_of(text), error_tolerance=np.inf)
    true = with_control(
        evolution_of(text.replace('model = "auto"\ntolerance = 0.9', 'model = "accurate"')),
        error_tolerance=np.inf, stability=1e9, depth_cap=1.0, distance=1e9,
    )  # fmt: skip
    state, taken = corrected.start()
    state = replace(state, correction=replace(state.correction, strictness=0.0))  # no point may wait
    lengths = []
    while not reached(state.distance, corrected.target):
        here = corrected.evaluate(state, taken)
        ours, theirs = here.collective.depth, true.evaluate(replace(state, correction=None)).collective.depth
        assert ours == pytest.approx(theirs, rel=0.0, abs=1e-14 * theirs.max())
        state, taken = corrected.advance(state, here)
        lengths.append(taken.length)
    assert len(lengths) > 3
    assert state.correction.solved == 1 + len(lengths)
    assert (state.correction.model == 0).all()
    other, taken = true.start()
    for length in lengths:
        other, taken = with_control(true, max_step=length).advance(other, true.evaluate(other, taken))
    assert other.distance == pytest.approx(state.distance, rel=1e-12)
    # what rounding leaves of a rate is far below the last digit of the profile
    assert state.wear_depth == pytest.approx(other.wear_depth, rel=0.0, abs=1e-14 * state.wear_depth.max())


@pytest.mark.slow
def test_wear_steps_keep_their_order(evolution_of, scene_text, monkeypatch):
    """Second, as with the half-space in all stages, down to the noise of a grid of 24 x 24, 3e-4."""
    monkeypatch.setattr(correction, "_STRICTEST", 0.0)
    monkeypatch.setattr(handover, "handed_over", lambda state, *_: state)

    def worn(model, steps):
        text = scene_text({"shift_mm": 2, "distance_km": 5000}, contact=f"{model}\nstrips = 24\ncells = 24",
                          campaign="distance_km = 16\nsmoothing_wavelength_mm = 5")  # fmt: skip
        free = {"error_tolerance": np.inf, "depth_cap": 1.0, "stability": 1e9, "first_depth": 1.0}
        evolution = with_control(evolution_of(text), max_step=16e3 / steps * (1.0 + 1e-12), **free)
        state, taken = evolution.start()
        if state.correction is not None:  # no point may wait, none asks for shorter steps
            state = replace(state, correction=replace(state.correction, strictness=0.0))
        while not reached(state.distance, evolution.target):
            state, taken = evolution.advance(state, evolution.evaluate(state, taken))
            if state.correction is not None:
                unlimited = np.full_like(state.correction.length, np.inf)
                state = replace(state, correction=replace(state.correction, length=unlimited))
        assert state.step == steps
        return state.wear_depth

    true = worn('model = "accurate"', 16)
    error = {
        (model, steps): np.abs(worn(f'model = "{model}"', steps) - true).max() / true.max()
        for model in ("accurate", "auto")
        for steps in (2, 4)
    }
    assert error["auto", 4] < 1e-3
    assert error["auto", 2] > 3.0 * error["auto", 4]
    for steps in (2, 4):
        assert error["auto", steps] < 1.2 * error["accurate", steps]


@pytest.fixture(scope="module")
def spread(tmp_path_factory, scene_text):
    campaign = "distance_km = 400\npoint_spacing_mm = 0.5"
    texts = {
        "auto": 'model = "auto"', "accurate": 'model = "accurate"', "fast": 'normal = "kik_piotrowski"',
    }  # fmt: skip
    made = {}
    for name, text in texts.items():
        path = tmp_path_factory.mktemp("spread") / "scene.toml"
        path.write_text(scene_text(SPREAD, kind="field", contact=f"{text}\n{GRID}", campaign=campaign))
        made[name] = WheelsetEvolution(build(load_scene(path)))
    return made


def test_depth_follows_the_half_space_where_the_fast_model_does_not(spread):
    depth = {name: ended(one)[0].wear_depth for name, one in spread.items()}
    deepest = depth["accurate"].max()
    error = {name: np.abs(one - depth["accurate"]).max() / deepest for name, one in depth.items()}
    assert error["auto"] < 0.03 < error["fast"]


def test_a_corrected_rate_keeps_the_area_and_is_nowhere_negative(spread):
    evolution = spread["auto"]
    state, _ = evolution.start()
    setup, points = setup_of(evolution.setup), evolution.setup.points
    true = replace(setup, models=setup.reference, fallbacks=(), reference=None)
    ours = evolution.evaluate(state).collective
    passage = solve_passage(replace(state, correction=None), points, true, points.weight > 0.0)
    theirs = accumulate(passage, points, points.weight, replace(state, correction=None), true)
    length = vertex_lengths(state.y, state.z)
    assert (ours.depth >= 0.0).all()
    assert (ours.depth * length).sum() == pytest.approx((theirs.depth * length).sum(), rel=1e-12)
    assert ours.depth == pytest.approx(theirs.depth, abs=1e-12 * theirs.depth.max())
    assert ours.friction_work == pytest.approx(theirs.friction_work, abs=1e-9 * theirs.friction_work.max())


def test_points_are_solved_again_fewer_times_than_all_at_every_step(spread):
    state, states = ended(spread["auto"])
    points = len(spread["auto"].setup.points.label)
    assert points < state.correction.solved < points * len(states)
    assert 0.0 < correction.estimated_error(state) < 0.1


def refusing(normal, solve, beyond):
    """Solve as `solve` does, but for a normal model that has no solution beyond a shift [m]."""

    def refuse(conditions, wheelset, counterface, models: ContactModels, each, *, failed=None, **rest):
        if models.normal == normal and failed is not None:
            bad = np.flatnonzero(np.abs(conditions.shift) > beyond)
            failed.update({int(row): ContactError(f"point {row}, refused", int(row)) for row in bad})
            kept = np.setdiff1d(np.arange(conditions.shift.size), bad)
            found = solve(conditions, wheelset, counterface, models, each, failed=failed, **rest)
            return [evaluate.joined([one], np.flatnonzero(np.isin(one.contact.point, kept))) for one in found]
        return solve(conditions, wheelset, counterface, models, each, failed=failed, **rest)

    return refuse


def test_models_that_fail_give_way_to_the_next(spread, monkeypatch):
    """The strip model solves what kik_piotrowski does not; its difference is from itself."""
    solve = evaluate.solve_each
    monkeypatch.setattr(evaluate, "solve_each", refusing("kik_piotrowski", solve, 2e-3))
    evolution = spread["auto"]
    state, _ = evolution.start()
    far = np.abs(evolution.setup.points.conditions.shift) > 2e-3
    assert far.any()
    assert (state.correction.model == np.where(far, 1, 0)).all()
    monkeypatch.setattr(evaluate, "solve_each", solve)
    true, _ = evolution.start()
    ours, theirs = (evolution.evaluate(one).collective.depth for one in (state, true))
    assert ours == pytest.approx(theirs, abs=1e-9 * theirs.max())


def test_a_single_point_does_not_ripple_beyond_the_bound_of_frozen_differences(evolution_of, scene_text):
    """Waves of 2 to 5 mm, which differences taken on in full would multiply by -3 per step at this S."""
    text = scene_text(
        {"shift_mm": 0, "distance_km": 1e4}, contact=f'model = "auto"\n{GRID}',
        campaign="distance_km = 8000\npoint_spacing_mm = 0.5\nmax_step_depth_um = 30",
    )  # fmt: skip
    evolution = evolution_of(text)
    _, states = ended(evolution, steps=14)
    increments = np.diff([one.wear_depth[0] for one in states[-5:]], axis=0)
    band = increments.sum(axis=0) > 0.2 * increments.sum(axis=0).max()
    turned = np.diff(increments[:, band] / increments[:, band].max(axis=1, keepdims=True), axis=0)
    # an instability changes sign from step to step and grows; a profile that conforms drifts one way
    assert np.abs(turned[-1]).max() < 0.25


def test_left_and_right_are_alike_on_a_symmetric_collective(evolution_of, scene_text):
    """With pressures solved further than by default, on any processor.

    Sums over the operating points, in the other order for the other wheel, make last bits of the profiles
    differ; which ones depends on the kernel of BLAS. Conjugate gradients let such a difference grow up to
    the change of the pressures at which they stop: with 3e-5 in place of 3e-9 depths differ by 1e-4.
    """
    text = scene_text({**SPREAD, "shift_mean_mm": 0}, kind="field", contact=f'model = "auto"\n{GRID}',
                      campaign="distance_km = 300\npoint_spacing_mm = 0.5")  # fmt: skip
    evolution = evolution_of(text)
    *fast, reference = evolution.setup.fallbacks
    further = (*reference.parameters, ("half_space_tolerance", 3e-9))
    fallbacks = (*fast, replace(reference, parameters=further))
    state, _ = ended(replace(evolution, setup=replace(evolution.setup, fallbacks=fallbacks)))
    # what is left: tractions, whose residuals stop at 1e-6 of their sum
    assert state.wear_depth[0] == pytest.approx(state.wear_depth[1], abs=1e-5 * state.wear_depth.max())


def test_a_record_brings_back_the_differences_to_the_last_bit(spread):
    state, _ = spread["auto"].start()
    again = rebuilt(Correction, flattened(state.correction))
    assert again.wheel.tobytes() == state.correction.wheel.tobytes()
    assert again.step.tolist() == state.correction.step.tolist()


@pytest.fixture
def corrected_state(spread):
    """State at the beginning with known drifts, at 20 um of wear."""
    state, _ = spread["auto"].start()
    known = replace(state.correction, drift=np.ones_like(state.correction.drift))
    return replace(state, correction=known, wear_depth=state.wear_depth + 20e-6)


OWN = handover.ReferenceStep(length=100.0, depth=8e-6, model=2)
NEVER = np.zeros(10, dtype=bool)


def test_few_points_are_the_half_space_s_until_their_wear_is_deep(evolution_of, scene_text):
    """As deep as that a micrometre, the error of one of its steps, is the tolerance: 5 um at 20 %."""
    blocks = [{"shift_mm": shift, "distance_km": 1} for shift in (2.0, 3.0)]
    made = scene_text(*blocks, contact=f'model = "auto"\ntolerance = 0.2\n{GRID}',
                      campaign="distance_km = 60\npoint_spacing_mm = 0.5")  # fmt: skip
    state, states = ended(evolution_of(made))
    own = np.array([(one.correction.until > 0.0).all() for one in states])
    deep = np.array([one.wear_depth.max() for one in states]) >= 1e-6 / 0.2
    assert own[~deep].all()
    assert (own == ~deep)[:-1].all()
    assert not own[-2]
    given = states[int(np.argmax(deep))]  # whose row is corrected at once
    assert (given.correction.step[given.active_weight > 0.0] == given.step).all()
    assert given.correction.wheel.any()
    assert np.isfinite(state.wear_depth).all()
    assert (state.correction.length > 0.0).all()


def test_the_half_space_takes_points_over_whose_steps_would_be_short(corrected_state):
    """It solves all points twice per step: from half the length of its steps on correcting is cheaper."""
    weight = np.where(np.arange(10) < 4, 0.25, 0.0)
    new = handover.handed_over(corrected_state, weight, 49.0, OWN, NEVER).correction
    assert (new.model == np.where(weight > 0.0, 2, 0)).all()
    assert not new.wheel[:4].any()
    assert new.wheel[4:] == pytest.approx(corrected_state.correction.wheel[4:], abs=0.0)
    assert handover.handed_over(corrected_state, weight, 51.0, OWN, NEVER) is corrected_state
    assert handover.handed_over(corrected_state, weight, np.inf, OWN, NEVER) is corrected_state


def test_points_are_given_back_when_the_wear_is_deep_enough(corrected_state):
    weight = np.full(10, 0.1)
    taken = handover.handed_over(corrected_state, weight, 10.0, OWN, NEVER)
    deeper = replace(taken, wear_depth=taken.wear_depth + 59e-6)
    assert handover.handed_over(deeper, weight, 10.0, OWN, NEVER) is deeper
    deeper = replace(taken, wear_depth=taken.wear_depth + 61e-6)
    given = handover.handed_over(deeper, weight, 10.0, OWN, NEVER).correction
    assert not given.until.any()
    assert not given.model.any()
    assert correction.stale(replace(deeper, correction=given), weight).all()


def test_points_whose_steps_are_short_with_the_half_space_too_are_given_back_for_long(corrected_state):
    weight = np.full(10, 0.1)
    taken = handover.handed_over(corrected_state, weight, 10.0, OWN, NEVER)
    given = handover.handed_over(taken, weight, 10.0, OWN, ~NEVER)
    assert not given.correction.model.any()
    assert handover.handed_over(given, weight, 10.0, OWN, NEVER) is given
    deeper = replace(given, wear_depth=given.wear_depth + 61e-6)
    assert handover.handed_over(deeper, weight, 10.0, OWN, NEVER).correction.model.all()


def test_what_was_taken_over_is_unknown_after_a_reprofiling(spread):
    """Points of the half-space have no difference, and none that stays without being looked at again."""
    evolution = spread["auto"]
    state, _ = evolution.start()
    points, setup = evolution.setup.points, setup_of(evolution.setup)
    weight = points.weight
    taken = handover.handed_over(state, weight, 10.0, OWN, NEVER)
    taken = replace(taken, correction=differences.refreshed(taken, points, weight > 0.0, setup).correction)
    assert not taken.correction.wheel.any()
    fresh = correction.forgotten(taken, wheels=True)
    assert not fresh.correction.until.any()
    assert np.isinf(fresh.correction.drift[weight > 0.0]).all()
    worn = replace(state, correction=replace(state.correction, drift=np.full(10, 1e-12)))
    assert np.isinf(
        correction.forgotten(worn, wheels=True).correction.drift
    ).all()  # that of worn wheels goes


def test_points_without_a_solution_of_the_half_space_are_not_taken(corrected_state):
    known = corrected_state.correction
    pressure = known.max_pressure.copy()
    pressure[3] = 0.0
    state = replace(corrected_state, correction=replace(known, max_pressure=pressure))
    new = handover.handed_over(state, np.full(10, 0.1), 10.0, OWN, NEVER).correction
    assert (new.until > 0.0).tolist() == [number != 3 for number in range(10)]


def test_a_point_without_a_solution_of_the_half_space_leaves_the_drift_of_others_known(spread, monkeypatch):
    evolution, steps, corrected_step = spread["auto"], [], correction.corrected_step
    shift = np.sort(np.abs(evolution.setup.points.conditions.shift))
    refuse = refusing("half_space", evaluate.solve_each, 0.5 * (shift[-1] + shift[-2]))
    monkeypatch.setattr(evaluate, "solve_each", refuse)
    monkeypatch.setattr(
        correction, "corrected_step", lambda *given: steps.append(corrected_step(*given)) or steps[-1]
    )
    state, taken = evolution.start()
    for _ in range(2):
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
    assert np.isinf(state.correction.drift).sum() == 1
    assert [known for *_, known in steps] == [False, True]


def test_wear_without_a_solution_of_the_half_space_is_error_and_asked_for_once_per_step(spread, monkeypatch):
    """The outermost point is left to its fast model: results say so, and warn."""
    evolution, asked = spread["auto"], []
    shift = np.sort(np.abs(evolution.setup.points.conditions.shift))
    refuse = refusing("half_space", evaluate.solve_each, 0.5 * (shift[-1] + shift[-2]))
    far = int(np.argmax(np.abs(evolution.setup.points.conditions.shift)))

    def counted(conditions, wheelset, counterface, models, *given, **named):
        if models.normal == "half_space" and shift[-1] in np.abs(conditions.shift):
            asked.append(conditions.shift.size)
        return refuse(conditions, wheelset, counterface, models, *given, **named)

    monkeypatch.setattr(evaluate, "solve_each", counted)
    state, taken = evolution.start()
    assert len(asked) == 1
    for steps in (1, 2):
        state, taken = evolution.advance(state, evolution.evaluate(state, taken))
        assert len(asked) == 1 + steps
    row = evolution.row(state, evolution.evaluate(state, taken), taken)
    assert (row["reference_step"] < 0).nonzero()[0].tolist() == [far]
    alone = accumulate(
        solve_passage(state, evolution.setup.points, setup_of(evolution.setup)), evolution.setup.points,
        np.where(np.arange(10) == far, evolution.setup.points.weight, 0.0), state, setup_of(evolution.setup),
    )  # fmt: skip
    worn = float(alone.depth.max()) * state.distance
    assert state.correction.unsolved_depth == pytest.approx(worn, rel=0.05)  # the rate hardly changes
    assert correction.estimated_error(state) >= worn * 0.95 / state.wear_depth.max()


def test_where_rollers_are_redressed_the_half_space_is_asked(evolution_of, scene_text):
    """A row on new rollers is as corrected as any other."""
    text = scene_text(
        CURVING, contact=f'model = "auto"\n{GRID}', campaign="distance_km = 3\npoint_spacing_mm = 0.5"
    )
    wear = "[counterface.wear]\nfactor = 1.0\nredress_every_km = 1.5\n[contact]"
    _, states = ended(evolution_of(text.replace("[contact]", wear, 1)), steps=4)
    fresh = [one for one in states[1:] if one.counterface.redressed_at == one.distance]
    assert fresh
    for one in fresh:
        assert one.correction.step.tolist() == [one.step]
        assert one.correction.wheel.any()


def test_the_rule_may_err_as_much_as_alone_where_the_half_space_solves_the_acting_block(
    corrected_state, spread,
):  # fmt: skip
    """Whatever solves the other points, which do not act."""
    setup = SimpleNamespace(tolerance=0.03)
    settings = replace(spread["auto"].setup.control, error_tolerance=1e-6)
    known, one = corrected_state.correction, np.arange(10) == 3
    taken = replace(corrected_state, correction=replace(known, until=np.where(one, 1.0, 0.0)))
    alone = replace(settings, half_space_depths=1.0)  # but not in steps as deep
    assert settings.half_space_depths == 2.0
    assert correction.control_at(taken, setup, settings, one / 1.0) == alone
    assert correction.control_at(taken, setup, settings, ~one / 9.0).error_tolerance < 1e-6


def test_points_given_back_with_nothing_to_compare_make_no_nan(corrected_state):
    weight = np.where(np.arange(10) < 9, 1.0 / 9.0, 0.0)
    taken = handover.handed_over(corrected_state, weight, 10.0, OWN, NEVER)
    deeper = replace(taken, wear_depth=taken.wear_depth + 61e-6)
    given = handover.handed_over(deeper, weight, np.inf, OWN, NEVER).correction
    assert not given.until.any()
    assert not np.isnan(given.length).any()


def test_a_campaign_taken_over_is_that_of_the_half_space(evolution_of, scene_text):
    """A tolerance so small that steps with corrections are shorter than those of the half-space."""
    texts = [
        scene_text(CURVING, contact=f"{model}\n{GRID}", campaign="distance_km = 12\npoint_spacing_mm = 0.5")
        for model in ('model = "auto"\ntolerance = 0.001', 'model = "accurate"')
    ]
    (ours, states), (theirs, others) = (ended(evolution_of(text)) for text in texts)
    assert [bool(one.correction.until) for one in states] == [False] + [True] * (len(states) - 1)
    assert len(states) == len(others)
    assert ours.wear_depth.tolist() == theirs.wear_depth.tolist()
