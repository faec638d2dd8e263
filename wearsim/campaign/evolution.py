"""Evolution of a wheelset: start, evaluate, row, advance."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.campaign import control, step
from wearsim.campaign.comparison import comparison_laws, start_comparison
from wearsim.campaign.counterface import new_counterface, redressed
from wearsim.campaign.evaluate import (
    Evaluation,
    Passage,
    Setup,
    accumulate,
    rate,
    setup_of,
    solved,
)
from wearsim.campaign.left_out import Failed, new_history, with_failed
from wearsim.campaign.reprofiling import reprofile, reprofiling_due, to_next_reprofiling
from wearsim.campaign.row import NO_STEP, StepTaken, build_row, header_of, recorded_measures
from wearsim.campaign.running import new_running, settled_state, with_help
from wearsim.campaign.state import State, WearRate, worn_wheels
from wearsim.contact.patch import FloatArray
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints, where_it_runs
from wearsim.operation.recorded import binning_error
from wearsim.profile.shape import arc_length
from wearsim.results import Header
from wearsim.results.schema import CHANGES
from wearsim.scene.campaign import ControlSettings

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


_ATTEMPTS = 30  # at one step

# largest share of a step's area that may be clipped: more means that patches moved too far in it
_CLIPPED = 0.01

_SHORTER = 0.3  # of a step that was clipped, or whose stages have no contact solution

# depth of a step from which both are no matter of its length: a patch vanishes, a point has no solution [m]
_SHALLOW = 1e-7


_REMEMBERED = 0.8  # share of the stiffness of the step before that stays known


@dataclass(frozen=True)
class WheelsetEvolution:
    """A wheelset wearing under a load collective."""

    setup: CampaignSetup
    command: str = ""  # command line, for the history attribute
    threads: int = 1  # of the contact solver; their number does not change the bits of the result
    # first step and control of each change of the settings, in order, and their text for the results
    controls: tuple[tuple[int, ControlSettings], ...] = ()
    changes: str = ""

    @property
    def target(self) -> float:
        """Distance to run [m]."""
        return (self.controls[-1][1] if self.controls else self.setup.control).distance

    @cached_property
    def digest(self) -> str:
        """Hash of the scene and of all files it names."""
        digest = hashlib.sha256(self.setup.scene_text.encode())
        for _, value in self.setup.input_hashes:
            digest.update(f"\0{value}".encode())
        return digest.hexdigest()

    @cached_property
    def header(self) -> Header:
        """Static part of the result file."""
        header = header_of(self.setup, self.command)
        own: dict[str, str | float] = {"target_distance": self.target, CHANGES: self.changes}
        return replace(header, attributes={**header.attributes, **own})

    @cached_property
    def _contact(self) -> Setup:
        """What a wear rate depends on."""
        return setup_of(self.setup, self.threads)

    def _control(self, number: int) -> ControlSettings:
        """Return the control of a step."""
        made = [control for first, control in self.controls if first <= number]
        return made[-1] if made else self.setup.control

    def _in_force(self, state: State) -> CampaignSetup:
        """Return the setup with the settings of the step from a state."""
        return replace(self.setup, control=self._control(state.step + 1))

    def ended(self, state: State) -> bool:
        """Whether the distance was reached in a state, by the settings of the step that led to it.

        A longer campaign goes on from there.
        """
        return control.reached(state.distance, self._control(state.step).distance)

    def resumed(self, state: State) -> State:
        """Return the state from which the next step begins, of one that was stored.

        Rollers are not redressed at the end of the distance; a longer campaign begins with that.
        """
        wear = self.setup.counterface_wear
        if wear is None or not self.ended(state):
            return state
        changed = redressed(state, self.setup.counterface, wear)
        return state if changed is state else self._on_new_profiles(changed)

    def start(self) -> tuple[State, StepTaken]:
        """Return the new wheelset."""
        setup, wheels = self.setup, (self.setup.wheelset.right, self.setup.wheelset.left)
        y, z = (np.stack([getattr(wheel, axis) for wheel in wheels]) for axis in "yz")
        unworn, nothing, nowhere = np.zeros_like(y), np.zeros(2), np.zeros(len(setup.points.label))
        regime_depth = np.zeros((2, len(WEAR_LAWS[setup.wear.law].regimes), y.shape[1]))
        state = State(
            0, 0.0, y, z, unworn, regime_depth, nothing, nothing, nowhere, nowhere, nowhere, nowhere,
            counterface=None if setup.counterface_wear is None else new_counterface(setup.counterface),
            points=new_history(setup.points), running=new_running(setup),
        )  # fmt: skip
        return start_comparison(state, comparison_laws(setup)), NO_STEP

    def _where(self, state: State) -> CampaignSetup:
        """Return the setup in force with the operating points where the wheelset runs in a state."""
        setup = self._in_force(state)
        return replace(setup, points=where_it_runs(setup.points, state.running))

    def _settled(self, state: State) -> State:
        """Return the state with the shifts and loads that balance what is controlled."""
        return settled_state(state, self.setup.points, self._contact)

    def _on_new_profiles(self, state: State) -> State:
        """Return the state where it runs on profiles that were cut."""
        return self._settled(state)

    def evaluate(self, state: State, taken: StepTaken | None = None) -> Evaluation:
        """Solve the contact of a state, if the step that led to it has not left it.

        At all operating points where nothing acted or the distance is reached, else at those of the last
        step and the monitoring points.
        """
        points, weight = self._where(state).points, state.active_weight
        end = None if taken is None else taken.end
        ends = taken is not None and self.ended(state)
        if ends or not weight.any():
            weight, end = points.weight, None
        if end is None:
            # at the end of the distance with points that did not act in the last step: no reason to lose it
            end = self._solved(state, points, weight, raises=not ends)
        return replace(end, measures=recorded_measures(state, self.setup))

    def _solved(
        self, state: State, points: OperatingPoints, weight: FloatArray, *, raises: bool = True
    ) -> Evaluation:
        """Contact of the points that act with a weight (n,), and of the monitoring points."""
        followed = (weight > 0.0) | (points.weight == 0.0)
        return solved(state, points, weight, self._contact, among=followed, raises=raises)

    def row(self, state: State, evaluation: Evaluation, taken: StepTaken) -> dict[str, np.ndarray]:
        """Return the row of the result file for a state."""
        return build_row(state, evaluation, taken, self._where(state))

    def closing(self, row: Mapping[str, np.ndarray]) -> Header:
        """Return what the last row decides of the static part of a result."""
        reduction, wheelset = self.setup.reduction, self.setup.wheelset
        if reduction is None:
            return Header({}, {})
        right, left = worn_wheels(wheelset, row["profile_y"], row["profile_z"])
        worn = reduction.increments_on(replace(wheelset, right=right, left=left))
        names = ("binning_depth_samples_worn", "binning_depth_points_worn")
        return Header(dict(zip(names, worn, strict=True)), {"binning_error_worn": binning_error(worn)})

    def advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Take the next wear step, or reprofile the wheels where that is due.

        An error of a bogie without balance says what would let it run.
        """
        try:
            return self._advance(state, evaluation)
        except ContactError as error:
            helped = with_help(error, self.setup.points, self._contact)
            if helped is error:
                raise
            raise helped from error

    def _advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Take the next wear step, or reprofile the wheels where that is due."""
        setup, here = self._where(state), self._contact
        points, wave = setup.points, setup.control.smoothing_wavelength
        state = replace(state, points=evaluation.points)
        if reprofiling_due(state, setup, evaluation.measures):
            return self._on_new_profiles(reprofile(state, setup)), NO_STEP
        settings = to_next_reprofiling(state, setup.control)
        known, passage = {evaluation.weight.tobytes(): evaluation.collective}, evaluation.passage

        def rate_for(weight: FloatArray) -> WearRate:
            key = weight.tobytes()
            if key not in known:
                there = [*passage.contact.point, *passage.failed]
                known[key] = (
                    accumulate(passage, points, weight, state, here)
                    if np.isin(np.flatnonzero(weight), there).all()
                    else rate(state, points, weight, here)
                )
            return known[key]

        def spacing() -> float:
            bodies = (state, state.counterface or state)
            arcs = [arc_length(*line) for body in bodies for line in zip(body.y, body.z, strict=True)]
            return min(float(np.diff(arc).min()) for arc in arcs)

        def depth_limit(now: WearRate, weight: FloatArray) -> float:
            return control.half_space_depth_limit(now, weight, setup.models, spacing(), wave)

        rule = step.StepRule(
            setup.wheelset.radius, setup.wear.density, wave, setup.control.integrator,
            crack_depth=here.comparison.crack_depth,
        )  # fmt: skip
        limit, error, length, stiffness = (math.inf, "error"), 0.0, 0.0, 0.0
        for rejected in range(_ATTEMPTS):
            choice = control.choose(
                state, points, rate_for, settings, depth_limit=depth_limit, length_limit=limit,
                stiffness=stiffness, counterface_wear=setup.counterface_wear,
            )  # fmt: skip
            weight, length = choice.weight, choice.limit.step_length
            now = rate_for(weight)
            shallow = float(now.depth.max()) * length < _SHALLOW
            try:
                tried, error, stiffness, end = self._try(state, now, choice, rule, passage)
            except ContactError:
                if shallow:
                    raise
                limit = _SHORTER * length, "no contact"
                continue
            clipped = tried.clipped > _CLIPPED and not shallow
            if error > settings.error_tolerance or clipped:
                limit = control.error_limit(length, error, settings), "error"
                if clipped:
                    limit = min(limit, (_SHORTER * length, "clipping"))
                continue
            taken = StepTaken(
                length,
                choice.limit.stiffness * length,
                error,
                rejected,
                tried.stages,
                choice.limit.reason,
                end,
            )
            break
        else:
            raise NumericalError(
                f"after {state.distance / 1e3:.6g} km no wear step keeps the tolerance of "
                f"{1e6 * settings.error_tolerance:.4g} um: a step of {length:.4g} m, limited by "
                f"{limit[1]}, has an error of {1e6 * error:.4g} um; raise error_tolerance_um in [campaign]"
            )
        stiffest = np.maximum(stiffness, _REMEMBERED * state.point_stiffness)
        acted: dict[str, Any] = {"length": weight * length, "error": error, "stiffness": stiffest}
        kept = {
            f"point_{name}": np.where(weight > 0.0, value, getattr(state, f"point_{name}"))
            for name, value in acted.items()
        }
        after = replace(tried.state, active_weight=weight, **kept)
        if setup.counterface_wear is None or self.ended(after):
            return after, taken
        changed = redressed(after, setup.counterface, setup.counterface_wear)
        if changed is after:
            return after, taken
        return self._on_new_profiles(changed), replace(taken, end=None)

    def _try(
        self,
        state: State,
        now: WearRate,
        choice: control.StepChoice,
        rule: step.StepRule,
        earlier: Passage,
    ) -> tuple[step.Step, float, float, Evaluation]:
        """Take a step: its end, its error [m], its stiffness [1/m], and the contact at its end.

        The contact of each stage begins at that of the one before, of the first one at that of the state; the
        contact at the end begins anew, because a campaign resumed there knows none.
        """
        points, weight, limit = self._where(state).points, choice.weight, choice.limit
        length, wave = limit.step_length, rule.smoothing_wavelength
        failed: Failed = {}
        running, wears = state.running, WEAR_LAWS[self._contact.wear.law].wears  # else all stages are alike

        def rate_at(ahead: State) -> WearRate:
            nonlocal running, earlier
            ahead = replace(ahead, running=running)
            ahead = settled_state(ahead, self.setup.points, self._contact, stage=weight > 0.0)
            running = ahead.running
            stage = solved(
                ahead, self._where(ahead).points, weight, self._contact, earlier=earlier if wears else None
            )
            earlier = stage.passage
            failed.update(stage.passage.failed)
            return stage.collective

        tried = step.advance(state, now, length, rule, rate_at, limit.stiffness * length)
        after = tried.state
        if after.points is not None:
            after = replace(after, points=with_failed(after.points, points, failed))
        # where the wheelset runs after the step: what the shift changed in it is part of the error
        tried = tried._replace(state=self._settled(replace(after, running=running)))
        # with the history that is stored: a resumed campaign solves the same batches, to the last bit
        end = self._solved(tried.state, self._where(tried.state).points, weight)
        last = step.smoothed_at_end(state, tried.state, end.collective, wave)
        error = step.error_of(state, tried.state, tried.start, last)
        return tried, error, step.stiffness_of(tried, last), end
