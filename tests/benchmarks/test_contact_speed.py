"""Times of the contact and of the main job, printed beside their targets and never
asserted.
"""

import cProfile
import ctypes
import os
import pstats
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.contact import solve as contact
from wearsim.contact.patch import load_factor
from wearsim.contact.solve import (
    ContactConditions,
    ContactModels,
    Counterface,
    Wheelset,
)
from wearsim.contact.tangential import fastsim
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
HERE = Path(__file__).parent
ROOT = HERE.parents[1]
POINTS = 1000
MODELS = ContactModels.of("fast", strips=50, cells=50)
FLAGS = ("-O3", "-march=native", "-ffast-math")


@pytest.fixture(scope="module")
def scene():
    """1000 operating points of the right wheel, shifts of 5 mm and yaw of 10 mrad
    either way, on a rail.
    """
    random = np.random.default_rng(1)
    zero, one = np.zeros(POINTS), np.ones(POINTS)
    shift, yaw = (
        random.uniform(-5e-3, 5e-3, POINTS),
        random.uniform(-0.01, 0.01, POINTS),
    )
    conditions = ContactConditions(
        shift, yaw, zero, 80e3 * one, 20.0 * one, 0.35 * one, zero, "nominal"
    )
    wheel, rail = (
        standard.wheel("S1002"),
        standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75),
    )
    return (
        conditions,
        Wheelset(wheel, wheel, 0.46, 0.75),
        Counterface(rail, 0.0),
        MODELS,
    )


def test_fastsim_kernel_against_c(show, best, tmp_path):
    """Cells per second of the kernel and of plain C compiled in the same run."""
    patches, cells, strips = 64, 50, 50
    a, b = 6e-3, 4e-3
    y = np.tile((np.arange(strips) + 0.5) / strips * 2 * b - b, (patches, 1))
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    random = np.random.default_rng(2)
    creepage = random.uniform(-1.0, 1.0, (patches, 3)) * [2e-3, 2e-3, 0.4]
    width = np.full(patches, 2 * b / strips)
    slope = np.full_like(
        half,
        80e3 / (0.5 * np.pi * (half[0] ** 2).sum() * width[0]) * load_factor(cells),
    )
    flexibility = np.tile([[1.2e-14], [1.3e-14], [1.1e-14]], (1, patches))
    mean = np.full(patches, 1.25e-14)
    given = (
        y,
        width,
        half,
        -half,
        np.full(patches, 0.35),
        slope,
        creepage,
        flexibility,
        mean,
    )
    strip_count, cell_count = np.full(patches, strips), np.full(patches, cells)

    def outputs():
        return (
            np.empty((5, patches, cells, strips)),
            np.zeros((patches, 3)),
            np.zeros(patches),
        )

    ours, theirs = outputs(), outputs()
    alone = (np.empty((1, patches, cells, strips)), *outputs()[1:])
    rows = fastsim.rows_for_march()

    def kernel(outputs=ours):
        fastsim._march(*given, strip_count, cell_count, True, rows, *outputs)

    kernel()
    per_cell = 1e9 / (patches * cells * strips)
    time_kernel = best(kernel, 40) * per_cell
    time_work = best(lambda: kernel(alone), 40) * per_cell
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        show(
            f"FASTSIM kernel {time_kernel:.2f} ns per cell; no C compiler here to "
            "compare with"
        )
        return
    library = tmp_path / "fastsim_loop.so"
    command = [
        compiler,
        *FLAGS,
        "-shared",
        "-fPIC",
        str(HERE / "fastsim_loop.c"),
        "-o",
        str(library),
        "-lm",
    ]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(library))

    def pointer(array):
        return array.ctypes.data_as(ctypes.c_void_p)

    arguments = [ctypes.c_int(n) for n in (patches, cells, strips)]
    arguments += [pointer(array) for array in (*given, *theirs)]
    show(
        f"FASTSIM kernel, 50 x 50 cells: {time_kernel:.2f} ns per cell, "
        f"{time_work:.2f} for the work alone"
    )
    for name in ("across_strips", "by_strip"):
        function = loaded[name]
        function.restype = None
        function(*arguments)
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(
                mine, other, rtol=1e-9, atol=1e-12 * abs(mine).max()
            )
        time_c = best(lambda call=function: call(*arguments), 40) * per_cell
        ratio = time_kernel / time_c
        show(
            f"C {' '.join(FLAGS)}, {name}: {time_c:.2f} ns, ratio {ratio:.2f} (target "
            "<= 1.1)"
        )


def solved(
    scene,
    normal="kik_piotrowski",
    tangential="fastsim",
    grid=50,
    sides=(0,),
    threads=1,
    points=POINTS,
    fields="work",
):
    """Search to strip work, balance of the load included, on an exact grid; no other
    fields, as campaigns.
    """
    conditions, wheelset, counterface, models = scene
    models = replace(
        models,
        normal=normal,
        tangential=tangential,
        strips=grid,
        cells=grid,
        most_cells=grid,
        cell_size=1.0,
    )
    conditions = conditions.at(np.arange(points) % POINTS)
    contact.solve_each(
        conditions,
        wheelset,
        counterface,
        models,
        lambda part: part.fields.strip_work,
        sides=sides,
        threads=threads,
        fields=fields,
    )


@pytest.mark.parametrize(
    ("normal", "target"), [("kik_piotrowski", 60), ("coupled_strips", 120)]
)
def test_full_solution(show, best, scene, normal, target):
    """One wheel at the nominal rotation speed, 50 x 50, on one thread."""
    solved(scene, normal)
    alone = best(lambda: solved(scene, normal)) / POINTS * 1e6
    solved(scene, normal, fields=True)
    whole = best(lambda: solved(scene, normal, fields=True)) / POINTS * 1e6
    show(
        f"full solution with {normal}, 50 x 50, load balance included: {alone:.0f} us "
        f"(target {target}), {whole:.0f} us with all fields of cells"
    )


@pytest.mark.parametrize(
    ("normal", "times"),
    [("kik_piotrowski", 1), ("kik_piotrowski", 4), ("coupled_strips", 1)],
)
def test_threads(show, scene, normal, times):
    """Two threads against one, wall clock; what one waits for in the end counts less in
    more chunks.
    """
    options = {"normal": normal, "sides": (0, 1), "points": times * POINTS}
    for threads in (1, 2):
        solved(scene, threads=threads, **options)
    one, two = (
        min(
            wall(lambda threads=threads: solved(scene, threads=threads, **options))
            for _ in range(7)
        )
        for threads in (1, 2)
    )
    show(
        f"two threads, {normal}, {times * POINTS} points: {one / two:.2f} times as "
        f"fast as one (target 1.8; {os.cpu_count()} cores)"
    )


def wall(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


PAIRS = [
    ("kik_piotrowski", "fastsim", 50, POINTS),
    ("half_space", "half_space", 30, 24),
]


@pytest.mark.parametrize(("normal", "tangential", "grid", "points"), PAIRS)
def test_free_rotation(show, best, scene, normal, tangential, grid, points):
    """Both wheels, with the balance of axle torque as campaigns run it, against the
    nominal speed.
    """
    nominal, wheelset, counterface, models = scene
    free = (replace(nominal, rotation="free"), wheelset, counterface, models)
    options = {
        "normal": normal,
        "tangential": tangential,
        "grid": grid,
        "sides": (0, 1),
        "points": points,
    }
    times = []
    for one in (free, scene):
        solved(one, **options)
        times.append(best(lambda one=one: solved(one, **options), 3) / points / 2 * 1e6)
    target = " (target 6000 us)" if normal == "half_space" else ""
    show(
        f"{normal} + {tangential}, {grid} x {grid}: free rotation {times[0]:.0f} us "
        f"per wheel{target}, {times[0] / times[1]:.2f} times nominal (target 1.5)"
    )


def test_rooms(show, scene):
    """Share of the functions of a full solution, of a profile of one thread."""
    free = (replace(scene[0], rotation="free"), *scene[1:])
    solved(free, sides=(0, 1))
    profile = cProfile.Profile()
    profile.runcall(solved, free, sides=(0, 1))
    spent = pstats.Stats(profile)
    shown = sorted(spent.stats.items(), key=lambda item: -item[1][2])[:6]
    total = spent.total_tt
    show(
        "most time: "
        + ", ".join(f"{key[2]} {value[2] / total:.0%}" for key, value in shown)
    )


def test_help(show, best):
    """Start of the command line, which must not import numpy."""
    command = [sys.executable, "-m", "wearsim", "--help"]
    # used twice
    run = lambda: subprocess.run(command, capture_output=True, check=True)  # noqa: E731
    run()
    show(f"wearsim --help: {best(run, 10):.3f} s (target < 0.15)")
    script = (
        "import sys; sys.argv = ['wearsim', '--help']\nfrom wearsim.cli import main\n"
    )
    script += (
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "sys.exit('numpy' in sys.modules)"
    )
    assert (
        subprocess.run([sys.executable, "-c", script], capture_output=True).returncode
        == 0
    )


def test_main_job_of_the_readme(show, tmp_path):
    """Rig against field with its report: cold with compilation, then warm."""
    command = [
        sys.executable,
        "-m",
        "wearsim",
        "run",
        str(ROOT / "workflows" / "rig_vs_field.toml"),
        "--out",
    ]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for name, target in (("cold", 60), ("warm", 20)):
        start = time.perf_counter()
        out = str(tmp_path / name)
        subprocess.run(
            [*command, out], check=True, capture_output=True, env=environment
        )
        show(
            f"main job of the README, {name}: {time.perf_counter() - start:.1f} s "
            f"(target < {target})"
        )
