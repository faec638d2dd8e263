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
from wearsim.campaign.attempt import (
    Attempt,
    Rates,
    Way,
    is_shallow,
    refusal,
    without_contact,
)
from wearsim.campaign.comparison import comparison_laws, start_comparison
from wearsim.campaign.counterface import new_counterface, redressed
from wearsim.campaign.evaluate import (
    Evaluation,
    Setup,
    fastest_wear,
    setup_of,
    solved,
)
from wearsim.campaign.left_out import new_history, with_failed
from wearsim.campaign.passage import Passage
from wearsim.campaign.reprofiling import (
    late,
    reprofile,
    reprofiling_due,
    to_next_reprofiling,
)
from wearsim.campaign.row import (
    NO_STEP,
    StepTaken,
    build_row,
    header_of,
    recorded_measures,
)
from wearsim.campaign.running import (
    begun_at,
    equilibria_of,
    new_running,
    settled_state,
    with_help,
)
from wearsim.campaign.state import State, WearRate, worn_wheels
from wearsim.contact.balance import Equilibria
from wearsim.contact.patch import FloatArray
from wearsim.damage.wear import WEAR_LAWS
from wearsim.errors import ContactError, NumericalError
from wearsim.operation.points import OperatingPoints, where_it_runs
from wearsim.operation.recorded import binning_error
from wearsim.plugins import plug_ins_of
from wearsim.quantities import kilometres
from wearsim.results import Header
from wearsim.results.schema import CHANGES
from wearsim.scene.campaign import ControlSettings

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup


_ATTEMPTS = 30  # attempts per step

_REMEMBERED = 0.8  # share of the stiffness of the previous step that is kept


@dataclass(frozen=True)
class WheelsetEvolution:
    """Wear evolution of a wheelset under a load collective."""

    setup: CampaignSetup
    command: str = ""  # command line, for the history attribute
    # threads of the contact solver; their number does not change the bits of the result
    threads: int = 1
    # first step and control of each change of the settings, in order, and their text
    # for the results
    controls: tuple[tuple[int, ControlSettings], ...] = ()
    changes: str = ""

    @property
    def target(self) -> float:
        """Distance of the campaign [m]."""
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
        run_attributes: dict[str, str | float] = {
            "target_distance": self.target,
            CHANGES: self.changes,
        }
        setup = self.setup
        plug_ins = plug_ins_of(
            setup.models, (setup.wear, *setup.also_evaluate), setup.fatigue
        )
        if plug_ins:
            versions = [
                str(header.attributes["source"]),
                *dict.fromkeys(plug_ins.values()),
            ]
            run_attributes["source"] = ", ".join(versions)
            run_attributes["plugins"] = "; ".join(
                f"{what}: {source}" for what, source in plug_ins.items()
            )
        return replace(header, attributes={**header.attributes, **run_attributes})

    @cached_property
    def _contact(self) -> Setup:
        """Inputs of the wear rate."""
        return setup_of(self.setup, self.threads)

    def _control(self, number: int) -> ControlSettings:
        """Return the control of a step."""
        made = [control for first, control in self.controls if first <= number]
        return made[-1] if made else self.setup.control

    def _in_force(self, state: State) -> CampaignSetup:
        """Return the setup with the settings of the step from a state."""
        return replace(self.setup, control=self._control(state.step + 1))

    def ended(self, state: State) -> bool:
        """Return True if a state has reached the distance of the campaign.

        The distance is that of the settings of the step that led to the state. A longer
        campaign continues from there.
        """
        return control.reached(state.distance, self._control(state.step).distance)

    def resumed(self, state: State) -> State:
        """Return the state in which the next step begins, from a stored state.

        Rollers are not redressed at the end of the distance; a longer campaign begins
        with that.
        """
        wear = self.setup.counterface_wear
        if wear is None or not self.ended(state):
            return state
        changed = redressed(state, self.setup.counterface, wear)
        return state if changed is state else self.settled(changed)

    def start(self) -> tuple[State, StepTaken]:
        """Return the new wheelset."""
        setup, wheels = (
            self.setup,
            (self.setup.wheelset.right, self.setup.wheelset.left),
        )
        y, z = (np.stack([getattr(wheel, axis) for wheel in wheels]) for axis in "yz")
        unworn = np.zeros_like(y)
        wheel_zeros = np.zeros(2)
        point_zeros = np.zeros(len(setup.points.label))
        regime_depth = np.zeros((2, len(WEAR_LAWS[setup.wear.law].regimes), y.shape[1]))
        state = State(
            0,
            0.0,
            y,
            z,
            unworn,
            regime_depth,
            wheel_zeros,
            wheel_zeros,
            point_zeros,
            point_zeros,
            point_zeros,
            point_zeros,
            counterface=None
            if setup.counterface_wear is None
            else new_counterface(setup.counterface),
            points=new_history(setup.points),
            running=new_running(setup),
        )
        return start_comparison(state, comparison_laws(setup)), NO_STEP

    def _where(self, state: State) -> CampaignSetup:
        """Return the setup in force, with the running positions of a state."""
        setup = self._in_force(state)
        return replace(setup, points=where_it_runs(setup.points, state.running))

    def settled(self, state: State) -> State:
        """State with the shifts and loads that balance the controlled forces."""
        settled, begin = settled_state(state, self.setup.points, self._contact)
        return replace(settled, begin=self._if_worn(begin))

    def evaluate(self, state: State, taken: StepTaken | None = None) -> Evaluation:
        """Solve the contact of a state, unless the step that led to it has left it.

        All operating points are solved if none was active or the distance is reached,
        else the active points of the last step and the monitoring points. If all points
        were active in the last step, its end is that contact.
        """
        points, weight = self._where(state).points, state.active_weight
        end = None if taken is None else taken.end
        ends = taken is not None and self.ended(state)
        if not weight.any() or (ends and not np.array_equal(weight, points.weight)):
            weight, end = points.weight, None
        if end is None:
            # A point that fails at the end of the distance but was not active in the
            # last step does not invalidate the step.
            end = self._solved(state, points, weight, raises=not ends)
        if end.measures:
            return end
        return replace(end, measures=recorded_measures(state, self.setup))

    def _solved(
        self,
        state: State,
        points: OperatingPoints,
        weight: FloatArray,
        *,
        raises: bool = True,
    ) -> Evaluation:
        """Contact of the points with a weight (n,), and of the monitoring points."""
        followed = (weight > 0.0) | (points.weight == 0.0)
        points = begun_at(points, state.begin)
        return solved(
            state, points, weight, self._contact, among=followed, raises=raises
        )

    def row(
        self, state: State, evaluation: Evaluation, taken: StepTaken
    ) -> dict[str, np.ndarray]:
        """Return the row of the result file for a state."""
        return build_row(state, evaluation, taken, self._where(state))

    def fastest(self, evaluation: Evaluation) -> str:
        """Name the operating point that wears a place of the wheels fastest."""
        return fastest_wear(evaluation, self.setup.points)

    def closing(self, row: Mapping[str, np.ndarray]) -> Header:
        """Return the static part of a result that follows from the last row."""
        reduction, wheelset = self.setup.reduction, self.setup.wheelset
        if reduction is None:
            return Header({}, {})
        right, left = worn_wheels(wheelset, row["profile_y"], row["profile_z"])
        worn = reduction.increments_on(replace(wheelset, right=right, left=left))
        names = ("binning_depth_samples_worn", "binning_depth_points_worn")
        return Header(
            dict(zip(names, worn, strict=True)),
            {"binning_error_worn": binning_error(worn)},
        )

    def advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Take the next wear step, or reprofile the wheels when due.

        An error of a bogie without balance lists changes that would let it run.
        """
        try:
            return self._advance(state, evaluation)
        except ContactError as error:
            helped = with_help(error, self.setup.points, self._contact)
            if helped is error:
                raise
            raise helped from error

    def _advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Take the next wear step, or reprofile the wheels when due."""
        setup = self._where(state)
        state = replace(state, points=evaluation.points)
        if reprofiling_due(state, setup, evaluation.measures):
            return self.settled(reprofile(state, setup)), NO_STEP
        return self._redressed(*self._stepped(state, evaluation, setup))

    def _stepped(
        self, state: State, evaluation: Evaluation, setup: CampaignSetup
    ) -> tuple[State, StepTaken]:
        """Try steps of falling length until one is accepted."""
        points, settings = setup.points, to_next_reprofiling(state, setup.control)
        wave = setup.control.smoothing_wavelength
        rates = Rates(state, begun_at(points, state.begin), self._contact, evaluation)
        rule = step.StepRule(
            setup.wheelset.radius,
            setup.wear.density,
            wave,
            setup.control.integrator,
            self._contact.comparison.crack_depth,
        )
        limit, error, length, stiffness = (math.inf, "error"), 0.0, 0.0, 0.0
        for rejected in range(_ATTEMPTS):
            choice = control.choose(
                state,
                points,
                rates.of,
                settings,
                length_limit=limit,
                stiffness=stiffness,
                counterface_wear=setup.counterface_wear,
            )
            length, now = choice.limit.step_length, rates.of(choice.weight)
            shallow = is_shallow(now, length)
            try:
                attempt = self._try(state, now, choice, rule, evaluation.passage)
            except ContactError:
                if shallow:
                    raise
                limit = without_contact(length)
                continue
            error, stiffness = attempt.error, attempt.stiffness
            shorter = refusal(attempt, length, shallow, settings)
            if shorter is None and setup.control.reprofiling is not None:
                attempt = self._measured(attempt)
                ends = (evaluation.measures, attempt.end.measures)
                end = late(state, length, ends, setup)
                shorter = None if end is None else (end, "reprofiling")
            if shorter is None:
                return _accepted(state, choice, attempt, rejected)
            limit = shorter
        raise NumericalError(
            f"after {kilometres(state.distance)} no wear step keeps the tolerance of "
            f"{1e6 * settings.error_tolerance:.4g} um: a step of {length:.4g} m, "
            f"limited by {limit[1]}, has an error of {1e6 * error:.4g} um; raise "
            "error_tolerance_um in [campaign]"
        )

    def _measured(self, attempt: Attempt) -> Attempt:
        """Return an attempt with the measures of the wheels at its end."""
        measured = recorded_measures(attempt.step.state, self.setup)
        return attempt._replace(end=replace(attempt.end, measures=measured))

    def _redressed(self, after: State, taken: StepTaken) -> tuple[State, StepTaken]:
        """Redress the rollers when due at the end of a step."""
        wear = self.setup.counterface_wear
        if wear is None or self.ended(after):
            return after, taken
        changed = redressed(after, self.setup.counterface, wear)
        if changed is after:
            return after, taken
        return self.settled(changed), replace(taken, end=None)

    def _try(
        self,
        state: State,
        now: WearRate,
        choice: control.StepChoice,
        rule: step.StepRule,
        earlier: Passage,
    ) -> Attempt:
        """Take a step: its stages, its end and the contact there.

        The contact solution of each stage starts from that of the one before, that of
        the first stage from that of the state. The start of the contact solution at the
        end is part of the state: a campaign resumed there uses the same start.
        """
        weight, limit = choice.weight, choice.limit
        stages = step.begun(
            state, now, limit.step_length, rule, limit.stiffness * limit.step_length
        )
        begin = self._if_worn(equilibria_of(earlier, self.setup.points, state.begin))
        way = first = Way(state.distance, state.running, begin, {})
        while stages.left:
            ahead = stages.ahead()
            rate, way = self._stage(ahead, weight, way, first)
            stages = stages.with_rate(ahead, rate)
        trial = stages.end()
        after = trial.state
        if after.points is not None:
            after = replace(
                after,
                points=with_failed(after.points, self._where(state).points, way.failed),
            )
        # Use the running state after the step: changes due to the shift are part of the
        # error.
        after = replace(after, running=way.running)
        after, begin = settled_state(
            after,
            self.setup.points,
            self._contact,
            begin=way.begin_at(after.distance, weight),
        )
        begin = self._begin(begin, first, after.distance)
        trial = trial._replace(state=replace(after, begin=begin))
        # Use the stored history, so that a resumed campaign solves the same batches bit
        # by bit.
        end = self._solved(trial.state, self._where(trial.state).points, weight)
        last = step.smoothed_at_end(
            state, trial.state, end.collective, rule.smoothing_wavelength
        )
        error = step.error_of(state, trial.state, trial.start, last)
        return Attempt(trial, error, step.stiffness_of(trial, last), end)

    def _stage(
        self, ahead: State, weight: FloatArray, way: Way, first: Way
    ) -> tuple[WearRate, Way]:
        """Wear rate in a stage of a step, and the start of the next stage.

        The step begins at `first`.
        """
        ahead = replace(ahead, running=way.running)
        points = self.setup.points
        ahead, begin = settled_state(
            ahead,
            points,
            self._contact,
            weight > 0.0,
            way.begin_at(ahead.distance, weight),
        )
        begin = self._if_worn(begin)
        begun_points = begun_at(self._where(ahead).points, begin)
        evaluation = solved(ahead, begun_points, weight, self._contact)
        failed = {**way.failed, **evaluation.passage.failed}
        begin = equilibria_of(evaluation.passage, points, begin)
        begin = self._begin(begin, first, ahead.distance)
        return evaluation.collective, Way(ahead.distance, ahead.running, begin, failed)

    def _begin(
        self, begin: Equilibria | None, first: Way, distance: float
    ) -> Equilibria | None:
        """Start of the contact solution after one at a distance [m] in a step.

        It drifts as it did since the step began at `first`.
        """
        begin = self._if_worn(begin)
        if begin is None or first.begin is None:
            return begin
        return begin.with_drift(first.begin, distance - first.distance)

    def _if_worn(self, begin: Equilibria | None) -> Equilibria | None:
        """Start of the next contact solution.

        It is a fresh start under a law without wear, since all states have the same
        contact.
        """
        return begin if WEAR_LAWS[self._contact.wear.law].wears else None


def _accepted(
    state: State, choice: control.StepChoice, attempt: Attempt, rejected: int
) -> tuple[State, StepTaken]:
    """State after an accepted step, with the data that the next step uses."""
    weight, limit = choice.weight, choice.limit
    length, made = limit.step_length, attempt.step
    taken = StepTaken(
        length,
        limit.stiffness * length,
        attempt.error,
        rejected,
        made.stages,
        limit.reason,
        attempt.end,
    )
    stiffest = np.maximum(attempt.stiffness, _REMEMBERED * state.point_stiffness)
    acted: dict[str, Any] = {
        "length": weight * length,
        "error": attempt.error,
        "stiffness": stiffest,
    }
    kept = {
        f"point_{name}": np.where(weight > 0.0, value, getattr(state, f"point_{name}"))
        for name, value in acted.items()
    }
    return replace(made.state, active_weight=weight, **kept), taken
