"""Long campaigns: time, growth with points and steps, memory; printed by targets, never
asserted.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[2]
SHARE = float(os.environ.get("WEARSIM_LONG_RUNS", "1"))
"""Of the distances, points and steps: CI sets 0.05, which keeps the runs alive but
tells no speed.
"""
FAST = ("kik_piotrowski", "fastsim")
STANDARD = ("coupled_strips", "coupled_strips")
OTHERS = (("coupled_strips", "fastsim"), ("half_space", "half_space"))
"""The other models that may lead, on few steps; hertz never leads."""

RUN = """
import json, resource, sys, time
from wearsim.campaign.run import run_scene
from wearsim.scene import load_scene
from wearsim.scene.initial_contact import check_contact
import wearsim.campaign.evaluate as rate
check_contact(load_scene(sys.argv[1]))
solve, solved, steps = rate.solve_each, [0], [0]
def counted(conditions, *given, **named):
    solution = solve(conditions, *given, **named)
    solved[0] += 2 * len(conditions.shift)
    return solution
rate.solve_each = counted
def told(event):
    steps[0] = event.step
start, cpu = time.perf_counter(), time.process_time()
run_scene(sys.argv[1], sys.argv[2], observer=told, threads=int(sys.argv[3]) or None)
print(json.dumps(dict(wall=time.perf_counter() - start, cpu=time.process_time() - cpu, steps=steps[0],
                      solutions=solved[0], memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)))
"""


@pytest.fixture
def campaign(tmp_path):
    """Function that runs the field scene with other points, models and steps in a
    process of its own.
    """

    def run(
        points, distance, models=FAST, grid=20, step=None, integrator="rkc", threads=0
    ):
        text = (ROOT / "workflows" / "field_given.toml").read_text()
        head, _, rest = text.partition("[operation.monitor]")
        counts = iter([round(0.4 * points), round(0.3 * points), round(0.3 * points)])
        head = re.sub(r"positions = \d+", lambda _: f"positions = {next(counts)}", head)
        head, result = re.subn(r"(strips|cells) = \d+", rf"\1 = {grid}", head)
        assert result == 2
        given = f'normal = "{models[0]}"\ntangential = "{models[1]}"\n'
        head, result = re.subn(r"model = .*\n", given, head)
        assert result == 1
        end = rest[rest.index("[campaign]") :].replace(
            "distance_km = 35000", f"distance_km = {distance}"
        )
        end = end.replace('"rkc"', f'"{integrator}"') + (
            f"\nmax_step_km = {step}\n" if step else "\n"
        )
        number = len(list(tmp_path.glob("*.toml")))
        scene = tmp_path / f"field_{number}.toml"
        scene.write_text(head + end)
        command = [
            sys.executable,
            "-c",
            RUN,
            str(scene),
            str(tmp_path / f"out_{number}"),
            str(threads),
        ]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run


def points(full):
    """Share of the operating points; the field scene needs 34 for its three classes."""
    return max(round(SHARE * full), 34)


def steps(full):
    """Share of the steps, two at least."""
    return max(round(SHARE * full), 2)


def speed(message):
    return (
        f"{message['steps']} steps, {message['solutions']} solutions in "
        f"{message['wall']:.1f} s (CPU {message['cpu']:.1f} s): "
        f"{message['solutions'] / message['wall']:.0f} solutions/s, "
        f"{message['memory']:.0f} MB"
    )


@pytest.mark.parametrize("grid", [20, 30])
def test_100_000_km_in_the_field(show, campaign, grid):
    one, two = (
        campaign(points(500), 100_000 * SHARE, grid=grid, threads=threads)
        for threads in (1, 2)
    )
    target = " (target < 10 s on two cores)" if SHARE == 1.0 else ""
    run = (
        f"{100 * SHARE:g} 000 km, {points(500)} points, both wheels, "
        f"{' + '.join(FAST)} {grid} x {grid}"
    )
    show(f"{run}, two threads: {speed(two)}{target}")
    show(
        f"one thread: {speed(one)}; two are {one['wall'] / two['wall']:.2f} times as "
        "fast (target 1.8)"
    )


def test_100_000_km_with_the_standard_models(show, campaign):
    message = campaign(points(500), 100_000 * SHARE, STANDARD)
    target = " (target 15 s on two cores)" if SHARE == 1.0 else ""
    show(
        f"{100 * SHARE:g} 000 km, {points(500)} points, both wheels, standard: "
        f"{speed(message)}{target}"
    )


@pytest.mark.parametrize("models", OTHERS)
def test_a_step_of_the_other_models_that_may_lead(show, campaign, models):
    count = points(100 if models[0] == "half_space" else 500)
    grid = 20 if SHARE == 1.0 else 10
    message = campaign(count, 10, models, grid, step=10, integrator="euler")
    show(f"{' + '.join(models)} {grid} x {grid}: {speed(message)}")


def test_cost_is_linear_in_points_and_steps(show, campaign):
    factors = (1, 2, 4) if SHARE == 1.0 else (1, 2)
    sizes = [factor * max(points(500) // 4, 34) for factor in factors]
    lengths = [factor * steps(10) for factor in factors]
    by_points = [campaign(n, 50 * lengths[0], step=50)["cpu"] for n in sizes]
    by_steps = [
        by_points[0],
        *(campaign(sizes[0], 50 * n, step=50)["cpu"] for n in lengths[1:]),
    ]
    for name, size, times in (
        ("points", sizes, by_points),
        ("steps", lengths, by_steps),
    ):
        slope = np.polyfit(np.log(size), np.log(times), 1)[0]
        message = ", ".join(
            f"{n}: {time:.1f} s" for n, time in zip(size, times, strict=True)
        )
        show(f"CPU time by {name}: {message}; slope {slope:.2f} (target 1)")


def test_memory_does_not_grow_with_the_steps(show, campaign):
    few, many = (
        campaign(points(500), 50 * n, grid=5, step=50, integrator="euler")
        for n in (steps(40), 4 * steps(40))
    )
    show(
        f"peak memory, {points(500)} points: {few['memory']:.0f} MB for "
        f"{few['steps']} steps, {many['memory']:.0f} MB for {many['steps']} (target: "
        "below 1000 and the same)"
    )
