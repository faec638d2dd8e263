"""A campaign with invented physics in the real file formats: fast enough to be killed
many times.

As a program: `synthetic_campaign.py DIRECTORY STEPS PAUSE` runs it in a process of its
own.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.row import NO_STEP, StepTaken
from wearsim.campaign.state import State
from wearsim.quantities import STEP_LIMITS
from wearsim.results import FILL_FLOAT, FILL_INT, LAYOUT, ROW, Header


class Stop(Exception):
    """What ends a run that is stopped on purpose."""


@contextmanager
def stopped_at(step: int) -> Iterator[Callable[[object], None]]:
    """Give an observer that stops a run once a step is written; the run must be stopped
    by it.
    """

    def observe(event: object) -> None:
        if event.kind == "step" and event.step == step:  # type: ignore[attr-defined]
            raise Stop

    with pytest.raises(Stop):
        yield observe


N_POINT, N_OPERATING, STEP = 300, 4, 1000.0
REGIMES = ("mild", "severe", "catastrophic")


def header() -> Header:
    y = np.linspace(-0.07, 0.06, N_POINT)
    static: dict[str, object] = {
        "wheel_name": ("right", "left"),
        "regime_name": REGIMES,
        "operating_point_name": tuple(f"block {k}, µ 0.35" for k in range(N_OPERATING)),
        "arc_length": y - y[0],
        "counterface_y": np.linspace(-0.035, 0.035, 60),
        "counterface_z": np.linspace(-0.035, 0.035, 60) ** 2,
    }
    for name, variable in LAYOUT.items():
        if variable.dimensions == ("operating_point",) and variable.kind == "f8":
            static[name] = np.linspace(0.0, 1.0, N_OPERATING)
    attributes = {
        "title": "synthetic campaign",
        "history": "wearsim run synthetic.toml",
        "source": "wearsim test",
        "wheel_radius": 0.46,
        "wear_law": "usfd",
        "warnings": "",
    }
    return Header(static, attributes)


@dataclass(frozen=True)
class SyntheticEvolution:
    """A bump that is worn off with a memory of the worn shape, so that each step needs
    the last bits.
    """

    steps: int = 12
    pause: float = 0.0
    digest: str = "synthetic"

    @property
    def header(self) -> Header:
        return header()

    @property
    def target(self) -> float:
        return self.steps * STEP

    def start(self) -> tuple[State, StepTaken]:
        y = np.stack([np.linspace(-0.07, 0.06, N_POINT)] * 2)
        zero = np.zeros_like(y)
        nothing = dict.fromkeys(
            ("active_weight", "point_length", "point_error", "point_stiffness"),
            np.zeros(N_OPERATING),
        )
        regimes, none = np.zeros((2, 3, N_POINT)), np.zeros(2)
        return State(
            0, 0.0, y, 0.1 * y**2, zero, regimes, none, none, **nothing
        ), NO_STEP

    def evaluate(self, state: State, taken: StepTaken | None = None) -> np.ndarray:
        time.sleep(self.pause)
        memory = state.point_error[1] + 1e-12 * state.point_length[1]
        return 1e-9 * (1.0 + np.sin(1e3 * state.z + state.step) ** 2) + 1e-3 * memory

    def ended(self, state: State) -> bool:
        return False

    def resumed(self, state: State) -> State:
        return state

    def fastest(self, evaluation: np.ndarray) -> str:
        return "curve"

    def closing(self, row: Mapping[str, np.ndarray]) -> Header:
        return Header({}, {})

    def row(
        self, state: State, evaluation: np.ndarray, taken: StepTaken
    ) -> dict[str, np.ndarray]:
        sizes = self.header.sizes
        row: dict[str, np.ndarray] = {}
        for name in ROW:
            shape = tuple(sizes[d] for d in LAYOUT[name].dimensions[1:])
            fill = (
                np.full(shape, FILL_FLOAT)
                if LAYOUT[name].kind == "f8"
                else np.full(shape, FILL_INT, np.int32)
            )
            if LAYOUT[name].dimensions[-1] == "patch":
                fill[:, :2] = 1 if name == "side" else state.step
            row[name] = fill
        row.update(
            distance=np.asarray(state.distance),
            step_length=np.asarray(taken.length),
            stability_number=np.asarray(taken.stability),
            step_error=np.asarray(FILL_FLOAT if taken.error is None else taken.error),
            step_limit=np.asarray(STEP_LIMITS.index(taken.reason), dtype=np.int32),
            stages=np.asarray(taken.stages, dtype=np.int32),
            rejected_steps=np.asarray(taken.rejected, dtype=np.int32),
            active_weight=state.active_weight,
            point_length=state.point_length,
            point_error=state.point_error,
            point_stiffness=state.point_stiffness,
            profile_y=state.y,
            profile_z=state.z,
            wear_depth=state.wear_depth,
            wear_depth_by_regime=state.regime_depth,
            friction_work=evaluation,
            n_patch=np.full(N_OPERATING, 2, np.int32),
            worn_area=state.worn_area,
            worn_mass=state.worn_mass,
            max_wear_depth=state.wear_depth.max(axis=1),
            tread_wear=state.wear_depth.max(axis=1),
            root_wear=np.zeros(2),
            flange_wear=np.zeros(2),
            flange_height=np.array([0.028, 0.028]),
        )
        row["wear_area_rate"][:, :2] *= 1e-3  # of the largest depth along 1 mm
        row["wear_regime"][:, :2] = (-1, 1)
        row["wear_regime_highest"][:, :2] = (-1, 2)
        return row

    def advance(self, state: State, evaluation: np.ndarray) -> tuple[State, StepTaken]:
        depth = evaluation * STEP
        after = State(
            step=state.step + 1,
            distance=state.distance + STEP,
            y=state.y,
            z=state.z - depth,
            wear_depth=state.wear_depth + depth,
            regime_depth=state.regime_depth
            + depth[:, None] * np.array([0.7, 0.2, 0.1])[:, None],
            worn_area=state.worn_area + depth.sum(axis=1),
            worn_mass=state.worn_mass + depth.sum(axis=1) * 3.0,
            active_weight=np.full(N_OPERATING, 0.25),
            point_length=np.full(N_OPERATING, 0.25 * STEP),
            point_error=np.full(N_OPERATING, float(depth.max()) / 7.0),
            point_stiffness=np.full(N_OPERATING, 1e-3 * state.step),
        )
        return after, StepTaken(
            STEP, 0.3, float(depth.max()) / 7.0, state.step % 3, 2, "error"
        )


if __name__ == "__main__":
    from wearsim.campaign.run import run_evolution

    def show(event: object) -> None:
        sys.stdout.write(f"{event.kind} {event.step}\n")  # type: ignore[attr-defined]
        sys.stdout.flush()

    run_evolution(
        SyntheticEvolution(int(sys.argv[2]), float(sys.argv[3])),
        Path(sys.argv[1]),
        "rig",
        show,
    )
