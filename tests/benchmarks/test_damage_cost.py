"""Cost of comparison laws and of fatigue laws in a campaign; printed, never
asserted.
"""

import time
import tracemalloc
from dataclasses import replace

import pytest

from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.profile.standard import shipped_path
from wearsim.scene import build, load_scene

pytestmark = pytest.mark.benchmark


def cpu_time(function, repeats=7):
    """Least of several times of the processor [s]: others on the machine do not
    enter.
    """
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def test_step_with_comparison_laws(show):
    setup = build(load_scene(shipped_path("workflows", "fatigue.toml")))
    cases = {
        "active law alone": replace(setup, also_evaluate=(), fatigue=()),
        f"{len(setup.also_evaluate)} comparison laws": replace(setup, fatigue=()),
        f"{len(setup.fatigue)} fatigue laws": replace(setup, also_evaluate=()),
        "both": setup,
    }
    alone = None
    for name, case in cases.items():
        of = WheelsetEvolution(case, threads=1)
        state, _ = of.start()

        def step(of=of, state=state):
            return of.advance(state, of.evaluate(state))

        spent = cpu_time(step)
        tracemalloc.start()
        step()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        alone = alone or (spent, peak)
        show(
            f"{name}: {1e3 * spent:.0f} ms per wear step, {spent / alone[0]:.2f} of "
            f"the active law alone; peak memory {1e-6 * peak:.0f} MB, "
            f"{peak / alone[1]:.2f} of it"
        )
