"""The physics of a campaign as its run sees it: start, evaluate, row, advance."""

from __future__ import annotations

import hashlib
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import numpy as np

from wearsim.campaign import choose, control, step
from wearsim.campaign.comparison import (
    ComparisonPassage,
    comparison_attributes,
    comparison_laws,
    comparison_passage,
    start_comparison,
    static_comparison,
)
from wearsim.campaign.counterface import new_counterface, turned
from wearsim.campaign.counterface_row import attributes_below, static_below
from wearsim.campaign.rate import accumulate, patch_wear, rate, solve_contact
from wearsim.campaign.reprofiling import to_next_turning, turn_wheels, turning_due
from wearsim.campaign.row import StepTaken, build_row, measures_told, no_step
from wearsim.campaign.state import State, WearRate
from wearsim.contact.solve import ContactSolution
from wearsim.damage.wear import WEAR_LAWS, coefficients_of, passage_depth
from wearsim.errors import NumericalError
from wearsim.operation.points import TurningRules
from wearsim.profile.shape import arc_length
from wearsim.results import Header
from wearsim.results.limits import REPROFILED_AT, attributes_of

if TYPE_CHECKING:
    from wearsim.scene import CampaignSetup

EvaluationT = TypeVar("EvaluationT")

_ATTEMPTS = 30
"""Tries of one step: the error falls at least in proportion to the length, so a few are enough."""


class Evolution(Protocol, Generic[EvaluationT]):
    """What happens between two rows of the result file. All methods are pure."""

    @property
    def header(self) -> Header:
        """Static part of the result file."""

    @property
    def target(self) -> float:
        """Distance to run [m]."""

    @property
    def digest(self) -> str:
        """Tells campaigns apart: a hash of all input."""

    def start(self) -> tuple[State, StepTaken]:
        """Return the new wheelset."""

    def evaluate(self, state: State) -> EvaluationT:
        """Solve the contact of a state."""

    def row(self, state: State, evaluation: EvaluationT, taken: StepTaken) -> dict[str, np.ndarray]:
        """Return the row of the result file for a state."""

    def advance(self, state: State, evaluation: EvaluationT) -> tuple[State, StepTaken]:
        """Take one wear step."""


@dataclass(frozen=True)
class Evaluation:
    """Contact of one state, solved once, and what follows from it.

    Parameters
    ----------
    solution : ContactSolution
        Of all operating points, monitoring points too.
    passage : (n_regimes, m, ny) array
        Depth per passage of each strip [m].
    collective : WearRate
        Under the weights of the full collective.
    comparison : ComparisonPassage
        What the comparison laws make of each passage.
    measures : mapping of arrays
        Of the wheels, from `row.measures_told`.
    """

    solution: ContactSolution
    passage: np.ndarray
    collective: WearRate
    comparison: ComparisonPassage
    measures: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class WheelsetEvolution:
    """A wheelset wearing under a load collective.

    Parameters
    ----------
    setup : CampaignSetup
        Ingredients from the scene.
    command : str
        Command line, for the history attribute.
    threads : int
        Of the contact solver; they do not change a bit.
    """

    setup: CampaignSetup
    command: str = ""
    threads: int = 1

    @property
    def target(self) -> float:
        """Distance to run [m]."""
        return self.setup.control.distance

    @cached_property
    def digest(self) -> str:
        """Hash of the scene and of all files it names, whatever their names are in this directory."""
        digest = hashlib.sha256(self.setup.scene_text.encode())
        for _, value in self.setup.input_hashes:
            digest.update(f"\0{value}".encode())
        for name in choose.static_choice(self.setup).get("contact_candidate", ()):  # rows tell their places
            digest.update(f"\0{name}".encode())
        return digest.hexdigest()

    @cached_property
    def header(self) -> Header:
        """Static part of the result file."""
        return _header(self.setup, self.command)

    def start(self) -> tuple[State, StepTaken]:
        """Return the new wheelset."""
        right, left = self.setup.wheelset.right, self.setup.wheelset.left
        y, z = np.stack([right.y, left.y]), np.stack([right.z, left.z])
        state = State(
            step=0,
            distance=0.0,
            y=y,
            z=z,
            wear_depth=np.zeros_like(y),
            regime_depth=np.zeros((2, len(WEAR_LAWS[self.setup.wear.law].regimes), y.shape[1])),
            worn_area=np.zeros(2),
            worn_mass=np.zeros(2),
        )
        state = start_comparison(state, comparison_laws(self.setup))
        if self.setup.counterface_wear is not None:
            state = replace(state, counterface=new_counterface(self.setup.counterface))
        return self._chosen(state), no_step(len(self.setup.points.label))

    def _chosen(self, state: State) -> State:
        """Return the state with the contact models that are good enough in it."""
        if self.setup.tolerance is None:
            return state
        return replace(state, choice=choose.choice(self.setup, state, threads=self.threads).choice)

    def evaluate(self, state: State) -> Evaluation:
        """Solve the contact of a state for all operating points."""
        setup = self.setup
        solution = solve_contact(
            state,
            setup.points,
            setup.wheelset,
            setup.counterface,
            choose.models_of(setup.models, state.choice),
            threads=self.threads,
        )
        passage = passage_depth(solution.fields, solution.area, setup.wear)
        comparison = comparison_passage(solution, comparison_laws(setup))
        collective = accumulate(
            solution,
            setup.points,
            setup.points.weight,
            state,
            setup.wheelset,
            setup.wear,
            passage=passage,
            comparison=comparison,
            counterface_wear=setup.counterface_wear,
        )
        return Evaluation(solution, passage, collective, comparison, measures_told(state, setup))

    def row(self, state: State, evaluation: Evaluation, taken: StepTaken) -> dict[str, np.ndarray]:
        """Return the row of the result file for a state."""
        wear = patch_wear(evaluation.solution, evaluation.passage, state, self.setup.wheelset)
        return build_row(
            state,
            evaluation.collective,
            wear,
            taken,
            self.setup,
            evaluation.measures,
            evaluation.comparison,
        )

    def advance(self, state: State, evaluation: Evaluation) -> tuple[State, StepTaken]:
        """Choose the next step and take it; turn the wheels where that is due."""
        setup = self.setup
        if turning_due(state, setup, evaluation.measures):
            return self._chosen(turn_wheels(state, setup)), no_step(len(setup.points.label))
        ahead_of = to_next_turning(state, setup.control)

        def rate_for(weight: np.ndarray) -> WearRate:
            if np.array_equal(weight, setup.points.weight):
                return evaluation.collective
            return accumulate(
                evaluation.solution,
                setup.points,
                weight,
                state,
                setup.wheelset,
                setup.wear,
                passage=evaluation.passage,
                comparison=evaluation.comparison,
                counterface_wear=setup.counterface_wear,
            )

        def rate_at(ahead: State) -> WearRate:
            return rate(
                ahead,
                setup.points,
                choice.weight,
                setup.wheelset,
                setup.counterface,
                choose.models_of(setup.models, state.choice),
                setup.wear,
                comparison=comparison_laws(setup),
                counterface_wear=setup.counterface_wear,
                threads=self.threads,
            )

        def depth_limit(now: WearRate, weight: np.ndarray) -> float:
            below = state.counterface or state
            lines = ((state.y[0], state.z[0]), (below.y[0], below.z[0]))
            spacing = min(float(np.diff(arc_length(*line)).min()) for line in lines)
            wave = setup.control.smoothing_wavelength
            return control.half_space_depth_limit(now, weight, setup.models, spacing, wave)

        tolerance = setup.control.error_tolerance
        limit = control.error_limit(state.step_length, state.step_error, tolerance)
        for rejected in range(_ATTEMPTS):
            choice = control.choose(
                state,
                setup.points,
                rate_for,
                ahead_of,
                depth_limit=depth_limit,
                length_limit=limit,
                counterface_wear=setup.counterface_wear,
            )
            now = rate_for(choice.weight)
            after = step.advance(
                state,
                now,
                choice.step_length,
                radius=setup.wheelset.radius,
                density=setup.wear.density,
                smoothing_wavelength=setup.control.smoothing_wavelength,
                integrator=setup.control.integrator,
                rate_at=rate_at,
                crack_depth=comparison_laws(setup).crack_depth,
                estimate=tolerance < math.inf,
            )
            if after.step_error is None or after.step_error <= tolerance:
                stability = control.stability_rate(now) * choice.step_length
                after = replace(after, choice=state.choice, turned=state.turned)
                if setup.counterface_wear is not None and not control.finished(after, setup.control):
                    after = turned(after, setup.counterface, setup.counterface_wear)
                passed = [share * setup.control.distance for share in choose.CHECKS]
                if any(state.distance < place <= after.distance for place in passed):
                    after = self._chosen(after)
                return after, StepTaken(choice.step_length, stability, choice.weight, rejected)
            limit = control.error_limit(choice.step_length, after.step_error, tolerance)
        raise NumericalError(
            f"after {state.distance / 1e3:.6g} km no wear step keeps the tolerance of "
            f"{1e6 * tolerance:.4g} um: one of {choice.step_length:.4g} m still has an error of "
            f"{1e6 * (after.step_error or 0.0):.4g} um; raise error_tolerance_um in [campaign]"
        )


def versions() -> str:
    """Name the programs whose arithmetic a result depends on."""
    import numba
    import scipy

    import wearsim

    return (
        f"wearsim {wearsim.__version__} (Python {platform.python_version()}, numpy {np.__version__}, "
        f"scipy {scipy.__version__}, numba {numba.__version__})"
    )


def _turning_attributes(rules: TurningRules | None) -> dict[str, str | float]:
    if rules is None:
        return {}
    return {
        REPROFILED_AT: " ".join(rules.limits),
        "reprofiling_distances": " ".join(f"{place:.12g}" for place in rules.places),
        "reprofiling_least_cut": rules.cut,
    }


def _header(setup: CampaignSetup, command: str) -> Header:
    points, conditions = setup.points, setup.points.conditions
    static = {
        "wheel_name": ("right", "left"),
        "regime_name": WEAR_LAWS[setup.wear.law].regimes,
        "operating_point_name": points.label,
        "shift": conditions.shift,
        "yaw": conditions.yaw,
        "roll": conditions.roll,
        "wheel_load": conditions.wheel_load,
        "speed": conditions.speed,
        "friction": conditions.friction,
        "track_curvature": conditions.track_curvature,
        "environment": points.environment,
        "weight": points.weight,
        "block_length": points.block_length,
        "arc_length": arc_length(setup.wheelset.right.y, setup.wheelset.right.z),
        "counterface_y": setup.counterface.profile.y,
        "counterface_z": setup.counterface.profile.z,
        **choose.static_choice(setup),
        **static_comparison(comparison_laws(setup)),
        **static_below(setup),
        **({} if setup.templates is None else {"wheel_template": [one.name for one in setup.templates]}),
    }
    wear, models, limits = setup.wear, setup.models, setup.control
    coefficients, law = coefficients_of(wear), WEAR_LAWS[wear.law]
    auto = setup.tolerance is not None
    rotation = conditions.rotation
    attributes: dict[str, str | int | float] = {
        "title": setup.title or f"wear campaign, {setup.kind}",
        "history": command,
        "source": versions(),
        "scene_text": setup.scene_text,
        "scene_kind": setup.kind,
        "input_hashes": "; ".join(f"{name} sha256:{value}" for name, value in setup.input_hashes),
        "wheel_profile_right": setup.wheelset.right.name,
        "wheel_profile_left": setup.wheelset.left.name,
        "counterface_profile": setup.counterface.profile.name,
        "wear_law": wear.law,
        "wear_coefficients": coefficients.name if law.wears else "",
        "wear_coefficients_source": coefficients.source if law.wears else "",
        "wear_coefficients_materials": coefficients.materials if law.wears else "",
        "wear_coefficients_validity": coefficients.validity if law.wears else "",
        "wear_coefficients_departures": " ".join(coefficients.departures) if law.wears else "",
        "wear_coefficients_warnings": "; ".join(coefficients.uncertain) if law.wears else "",
        "wear_law_numbers": ", ".join(coefficients.numbers) if law.wears else "",
        "wear_form": wear.form if law.wears else "",
        "seizure_cap": wear.seizure_cap if "seizure_cap" in law.parameters else "",
        "wheel_density": wear.density,
        "contact_normal": "auto" if auto else models.normal,
        "contact_tangential": "auto" if auto else models.tangential,
        "contact_tolerance": setup.tolerance if setup.tolerance is not None else "",
        "contact_parameters": ", ".join(f"{name} = {value:g}" for name, value in models.parameters),
        "youngs_modulus": models.youngs_modulus,
        "poisson_ratio": models.poisson_ratio,
        "strips": 0 if auto else models.strips,
        "cells": 0 if auto else models.cells,
        "rotation_rule": rotation if isinstance(rotation, str) else "given",
        "roll_rule": "free" if conditions.free_roll else "given",
        "axle_torque": float(conditions.torque),
        "smoothing_wavelength": limits.smoothing_wavelength,
        "stability_limit": limits.stability,
        "depth_cap": limits.depth_cap,
        "first_depth": limits.first_depth if limits.first_depth < math.inf else "",
        "integrator": limits.integrator,
        "error_tolerance": limits.error_tolerance if limits.error_tolerance < math.inf else "",
        "target_distance": limits.distance,
        **attributes_of(dict(limits.limits), limits.end_at_limit),
        **_turning_attributes(limits.turning),
        "counterface_curvature": setup.counterface.curvature,
        **attributes_below(setup.counterface_wear),
        **comparison_attributes(comparison_laws(setup)),
        "wheel_radius": setup.wheelset.radius,
        "half_span": setup.wheelset.half_span,
        "friction_note": "one Coulomb coefficient per operating point, alike over the whole profile",
        "attribute_units": "SI: m, m-1, Pa, N m, kg m-3",
        "warnings": "; ".join(str(warning) for warning in setup.warnings),
    }
    return Header(static, attributes)
