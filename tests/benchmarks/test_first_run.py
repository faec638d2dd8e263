"""The first run on a machine: what compiling the kernels takes of it; printed, never
asserted.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[2]
MAIN = (
    "import sys, time; began = time.perf_counter(), time.process_time(); from "
    "wearsim.cli import main; "
)
RUN = (
    MAIN
    + """
import json
from numba.core import event


class Compiled(event.Listener):
    def __init__(self):
        self.open, self.kernels, self.seconds = [], [], [0.0, 0.0]

    def on_start(self, of):
        self.open.append([of.data["dispatcher"].py_func, time.perf_counter(), time.process_time(), 0.0])

    def on_end(self, of):
        function, wall, cpu, inner = self.open.pop()
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        self.kernels.append((function.__module__, function.__name__, cpu - inner))
        if self.open:
            self.open[-1][3] += cpu
        else:
            self.seconds = [self.seconds[0] + wall, self.seconds[1] + cpu]


compiled = Compiled()
event.register("numba:compile", compiled)
assert main(sys.argv[1:]) == 0
total = time.perf_counter() - began[0], time.process_time() - began[1]
print(json.dumps(dict(total=total, compiled=compiled.seconds, kernels=compiled.kernels)))
"""
)
PAIRS = (("kik_piotrowski", "fastsim"), ("coupled_strips", "coupled_strips"))
"""What a campaign with `standard` compiles: coarse searches use the fast pair."""


def started(program, words, cache):
    command = [sys.executable, "-c", program, *words]
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        stdout=subprocess.PIPE,
        text=True,
    )


def told(process):
    output, _ = process.communicate()
    assert process.returncode == 0
    return output.splitlines()[-1]


def test_the_first_campaign_and_the_second_one(show, tmp_path):
    words = ["run", "workflows/rig.toml", "-q", "--set", "campaign.distance_km=20"]
    for name in ("first", "second"):
        out = ["--out", str(tmp_path / name)]
        message = json.loads(told(started(RUN, [*words, *out], tmp_path / "cache")))
        (wall, cpu), (own_wall, own_cpu) = message["total"], message["compiled"]
        compiling = (
            f"{len(message['kernels'])} kernels {own_wall:.1f} s, CPU {own_cpu:.1f} s"
        )
        show(
            f"{name} rig.toml of 20 km: {wall:.1f} s, CPU {cpu:.1f} s; compiling "
            f"{compiling}"
        )
        by_file = Counter()
        for module, _, seconds in message["kernels"]:
            by_file[module.removeprefix("wearsim.contact.")] += seconds
        if by_file:
            show(
                ", ".join(
                    f"{file} {seconds:.1f} s"
                    for file, seconds in by_file.most_common(10)
                )
            )


def test_both_pairs_compiled_in_turn_and_at_once(show, tmp_path, best):
    """A process for each: kernels that both need are compiled twice."""
    program = (
        MAIN + "sys.stdout = open('/dev/null', 'w'); assert main(sys.argv[1:]) == 0; "
    )
    program += "print(time.process_time() - began[1], file=sys.__stdout__)"

    def words(pair):
        return [
            "contact",
            "--yaw-mrad",
            "1",
            "--json",
            "--normal",
            pair[0],
            "--tangential",
            pair[1],
        ]

    seconds, cpu = {}, {}
    for name in ("in turn", "at once"):

        def both(name=name):
            cache = tmp_path / name
            if name == "in turn":
                cpu[name] = [
                    float(told(started(program, words(pair), cache))) for pair in PAIRS
                ]
            else:
                running = [started(program, words(pair), cache) for pair in PAIRS]
                cpu[name] = [float(told(process)) for process in running]

        seconds[name] = best(both, 1)
        show(
            f"{name}: {seconds[name]:.1f} s, CPU "
            f"{' and '.join(f'{one:.1f}' for one in cpu[name])} s"
        )
    show(f"at once is {seconds['in turn'] / seconds['at once']:.2f} times as fast")
