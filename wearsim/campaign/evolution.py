"""Evolution of a wheelset: start, evaluate, row, advance."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from wearsim.campaign import choose, control, step
from wearsim.campaign.comparison import comparison_laws, start_comparison
from wearsim.campaign.counterface import new_counterface, redressed
from wearsim.campaign.evaluate import Setup, accumulate, patch_wear, rate, setup_of, solve_passage
from wearsim.campaign.left_out import Failed, area_rates, judged, new_history, with_failed
from wearsim.campaign.reprofiling import reprofile, reprofiling_due, to_next_reprofiling
from wearsim.campaign.row import Evaluation, StepTaken, build_row, header_of, no_step, recorded_measures
from wearsim.campaign.state import State, WearRate
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import NumericalError
from wearsim.profile.shape import arc_length
from wearsim.results import Header
from wearsim.results.schema import CHANGES
from wearsim.scene.campaign import ControlSettings

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


_ATTEMPTS = 30  # at one step


@dataclass(frozen=True)
class WheelsetEvolution:
    """A wheelset wearing under a load collective."""

    setup: CampaignSetup
    command: str = ""  # command line, for the history attribute
    threads: int = 1  # of the contact solver; their number does not change the bits of the result
    # first step and control of each change of the settings, in order, and its text for the results
    controls: tuple[tuple[int, ControlSettings], ...] = ()
    changes: str = ""

    @property
    def target(self) -> float:
        """Distance to run [m]."""
        return self.setup.control.distance

    @cached_property
    def digest(self) -> str:
        """Hash of the scene and of all files it names."""
        digest = hashlib.sha256(self.setup.scene_text.encode())
        for _, value in self.setup.input_hashes:
            digest.update(f"\0{value}".encode())
        for name in choose.static_choice(self.setup).get("contact_candidate", ()):  # rows hold their indices
            digest.update(f"\0{name}".encode())
        return digest.hexdigest()

    @cached_property
    def header(self) -> Header:
        """Static part of the result file."""
        header = header_of(self.setup, self.command)
        return replace(header, attributes={**header.attributes, CHANGES: self.changes})

    def _in_force(self, state: State) -> CampaignSetup:
        """Return the setup with the settings of the step from a state."""
        made = [control for first, control in self.controls if first <= state.step + 1]
        return replace(self.setup, control=made[-1]) if made else self.setup

    def start(self) -> tuple[State, StepTaken]:
        """Return the new wheelset."""
        right, left = self.setup.wheelset.right, self.setup.wheelset.left
        y, z = np.stack([right.y, left.y]), np.stack([right.z, left.z])
        regimes = WEAR_LAWS[self.setup.wear.law].regimes
        nothing, unworn = np.zeros(2), np.zeros_like(y)
        regime_depth = np.zeros((2, len(regimes), y.shape[1]))
        state = State(0, 0.0, y, z, unworn, regime_depth, worn_area=nothing, worn_mass=nothing)
        state = start_comparison(state, comparison_laws(self.setup))
        state = replace(state, points=new_history(self.setup.points))
        if self.setup.counterface_wear is not None:
            state = replace(state, counterface=new_counterface(self.setup.counterface))
        return self._chosen(state), no_step(len(self.setup.points.label))

    def _chosen(self, state: State) -> State:
        """Return the state with contact models chosen for it."""
        if self.setup.tolerance is None:
            return state
        return replace(state, choice=choose.choice(self._in_force(state), state, threads=self.threads).choice)

    def _setup(self, state: State) -> Setup:
        """Return the setup with the contact models chosen in a state."""
        setup = setup_of(self.setup, self.threads)
        return replace(setup, models=choose.models_of(self.setup.models, state.choice))

    def evaluate(self, state: State) -> Evaluation:
        """Solve the contact of a state for all operating points."""
        setup, points = self._setup(state), self.setup.points
        history = state.points
        failed: Failed | None = None if history is None else {}
        apart = None if history is None else history.left_out
        passage = solve_passage(state, points, setup, apart=apart, failed=failed)
        wear = patch_wear(passage, state, setup.wheelset)
        if history is not None and failed is not None:
            rates = area_rates(passage.contact, wear, len(points.label))
            history = judged(history, points, rates, failed, state.distance)
        collective = accumulate(passage, points, points.weight, state, setup)
        return Evaluation(collective, passage, recorded_measures(state, self.setup), wear, history)

    def row(self, state: State, evaluation: Evaluation, taken: StepTaken) -> dict[str, np.ndarray]:
        """Return the row of the result file for a state."""
        return build_row(state, evaluation, taken, self.setup)

    def advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Take the next wear step, or reprofile the wheels where that is due."""
        setup, points = self._in_force(state), self.setup.points
        state = replace(state, points=evaluation.points)
        if reprofiling_due(state, setup, evaluation.measures):
            return self._chosen(reprofile(state, setup)), no_step(len(points.label))
        here = self._setup(state)
        ahead_of = to_next_reprofiling(state, setup.control)
        wave = setup.control.smoothing_wavelength

        def rate_for(weight: np.ndarray) -> WearRate:
            if np.array_equal(weight, points.weight):
                return evaluation.collective
            return accumulate(evaluation.passage, points, weight, state, here)

        def depth_limit(now: WearRate, weight: np.ndarray) -> float:
            other = state.counterface or state
            lines = ((state.y[0], state.z[0]), (other.y[0], other.z[0]))
            spacing = min(float(np.diff(arc_length(*line)).min()) for line in lines)
            return control.half_space_depth_limit(now, weight, setup.models, spacing, wave)

        tolerance = setup.control.error_tolerance
        rule = step.StepRule(
            setup.wheelset.radius, setup.wear.density, wave, setup.control.integrator,
            estimate=tolerance < math.inf, crack_depth=here.comparison.crack_depth,
        )  # fmt: skip
        limit = control.error_limit(state.step_length, state.step_error, tolerance)
        for rejected in range(_ATTEMPTS):
            choice = control.choose(
                state, points, rate_for, ahead_of, depth_limit=depth_limit, length_limit=limit,
                counterface_wear=setup.counterface_wear,
            )  # fmt: skip
            now = rate_for(choice.weight)
            failed: Failed = {}
            rate_at = partial(rate, points=points, weight=choice.weight, setup=here, failed=failed)
            after = step.advance(state, now, choice.step_length, rule, rate_at)
            if after.points is not None:
                after = replace(after, points=with_failed(after.points, points, failed))
            if after.step_error is None or after.step_error <= tolerance:
                stability = control.stability_rate(now) * choice.step_length
                if setup.counterface_wear is not None and not control.reached(after.distance, self.target):
                    after = redressed(after, setup.counterface, setup.counterface_wear)
                passed = [share * setup.control.distance for share in choose.CHECKS]
                if any(state.distance < place <= after.distance for place in passed):
                    after = self._chosen(after)
                return after, StepTaken(choice.step_length, stability, choice.weight, rejected)
            limit = control.error_limit(choice.step_length, after.step_error, tolerance)
        raise NumericalError(
            f"after {state.distance / 1e3:.6g} km no wear step keeps the tolerance of "
            f"{1e6 * tolerance:.4g} um: a step of {choice.step_length:.4g} m has an error of "
            f"{1e6 * (after.step_error or 0.0):.4g} um; raise error_tolerance_um in [campaign]"
        )
