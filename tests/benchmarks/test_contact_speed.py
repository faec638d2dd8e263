"""Times of the contact and of the main job, printed beside their targets and never asserted."""

import ctypes
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wearsim.contact import geometry
from wearsim.contact import solve as contact
from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import load_factor
from wearsim.contact.solve import CHUNK, ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.contact.tangential import fastsim
from wearsim.profile import standard

pytestmark = pytest.mark.benchmark
HERE = Path(__file__).parent
ROOT = HERE.parents[1]
POINTS = 1000
MODELS = ContactModels(strips=50, cells=50)
FLAGS = ("-O3", "-march=native", "-ffast-math")


@pytest.fixture(scope="module")
def scene():
    """1000 operating points of the right wheel, shifts of 5 mm and yaw of 10 mrad either way, on a rail."""
    random = np.random.default_rng(1)
    zero, one = np.zeros(POINTS), np.ones(POINTS)
    shift, yaw = random.uniform(-5e-3, 5e-3, POINTS), random.uniform(-0.01, 0.01, POINTS)
    conditions = ContactConditions(shift, yaw, zero, 80e3 * one, 20.0 * one, 0.35 * one, zero, "nominal")
    wheel, rail = standard.wheel("S1002"), standard.rail("60E1", 1.0 / 40.0, 1.435, 0.75)
    return conditions, Wheelset(wheel, wheel, 0.46, 0.75), Counterface(rail, 0.0), MODELS


def test_fastsim_kernel_against_c(show, best, tmp_path):
    """Cells per second of the kernel and of plain C compiled in the same run."""
    patches, cells, strips = 64, 50, 50
    a, b = 6e-3, 4e-3
    y = np.tile((np.arange(strips) + 0.5) / strips * 2 * b - b, (patches, 1))
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    random = np.random.default_rng(2)
    creepage = random.uniform(-1.0, 1.0, (patches, 3)) * [2e-3, 2e-3, 0.4]
    width = np.full(patches, 2 * b / strips)
    slope = np.full_like(half, 80e3 / (0.5 * np.pi * (half[0] ** 2).sum() * width[0]) * load_factor(cells))
    flexibility = np.tile([[1.2e-14], [1.3e-14], [1.1e-14]], (1, patches))
    mean = np.full(patches, 1.25e-14)
    given = (y, width, half, -half, np.full(patches, 0.35), slope, creepage, flexibility, mean)

    def outputs():
        return np.empty((5, patches, cells, strips)), np.zeros((patches, 3)), np.zeros(patches)

    ours, theirs = outputs(), outputs()
    rows = np.empty(14 * fastsim._ROW)

    def kernel():
        fastsim._march(*given, cells, True, rows, *ours)

    kernel()
    per_cell = 1e9 / (patches * cells * strips)
    time_kernel = best(kernel, 40) * per_cell
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        show(f"FASTSIM kernel {time_kernel:.2f} ns per cell; no C compiler here to compare with")
        return
    library = tmp_path / "fastsim_loop.so"
    command = [compiler, *FLAGS, "-shared", "-fPIC", str(HERE / "fastsim_loop.c"), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(library))

    def pointer(array):
        return array.ctypes.data_as(ctypes.c_void_p)

    arguments = [ctypes.c_int(n) for n in (patches, cells, strips)]
    arguments += [pointer(array) for array in (*given, *theirs)]
    show(f"FASTSIM kernel, 50 x 50 cells: {time_kernel:.2f} ns per cell")
    for name in ("across_strips", "by_strip"):
        function = loaded[name]
        function.restype = None
        function(*arguments)
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-12 * abs(mine).max())
        time_c = best(lambda call=function: call(*arguments), 40) * per_cell
        ratio = time_kernel / time_c
        show(f"C {' '.join(FLAGS)}, {name}: {time_c:.2f} ns, ratio {ratio:.2f} (target <= 1.5)")


def test_full_solution(show, best, scene):
    """Search to strip work in batches of 1000 on one and two threads, and the share of each room."""

    def run(threads):
        contact.solve_each(*scene, lambda part: part.fields.strip_work, sides=(0,), threads=threads)

    run(1)
    alone = best(lambda: run(1)) / POINTS * 1e6
    pair = best(lambda: run(2)) / POINTS * 1e6
    show(f"full solution 50 x 50: {alone:.0f} us per core (target < 150)")
    other = (*scene[:3], replace(MODELS, normal="knothe_le_the"))

    def strip_model():
        contact.solve_each(*other, lambda part: part.fields.strip_work, sides=(0,))

    strip_model()
    show(f"with knothe_le_the: {best(strip_model) / POINTS * 1e6:.0f} us (target < 300)")
    show(f"two threads: {pair:.0f} us, {alone / pair:.2f} times faster (target 1.7; {os.cpu_count()} cores)")

    conditions, wheelset, counterface, models = scene
    wheel, ground = (
        geometry.wheel_surface(wheelset.right, wheelset.radius),
        geometry.counterface_profile(counterface.profile),
    )
    task = contact._Task((wheel,) * 2, (ground,) * 2, wheelset, counterface.curvature, models, (0,), True)
    spent = dict.fromkeys(("search", "normal", "creepage", "tangential", "power and fields"), 0.0)
    repeats = 5
    for start in list(range(0, POINTS, CHUNK)) * repeats:
        chunk = contact._part(conditions, slice(start, min(start + CHUNK, POINTS)))
        clock = [time.perf_counter()]
        pose = geometry.WheelsetPose(chunk.shift, chunk.yaw, chunk.roll)
        gap = geometry.gap(wheel, ground, pose, half_span=0.75, nominal_radius=0.46, curvature=0.0)
        clock.append(time.perf_counter())
        normal = NORMAL_MODELS[models.normal](
            gap,
            chunk.wheel_load,
            vertical=True,
            effective_modulus=models.effective_modulus,
            strips=models.strips,
            parameters={},
        )
        clock.append(time.perf_counter())
        side = contact._solve_side(task, 0, chunk, start)
        clock.append(time.perf_counter())
        speed = -chunk.speed / wheelset.radius
        result = fastsim.solve(
            normal.patch,
            side.kinematics.creepage(speed[normal.patch.row]),
            side.friction,
            shear_modulus=models.shear_modulus,
            poisson_ratio=models.poisson_ratio,
            cells=models.cells,
            fields=True,
        )
        clock.append(time.perf_counter())
        strip_work = contact._finish(side, result, chunk.roll, speed, start).fields.strip_work
        clock.append(time.perf_counter())
        assert np.isfinite(strip_work).all()
        step = np.diff(clock)
        step[2] -= step[0] + step[1]  # the whole side: search, normal contact and kinematics again
        for name, seconds in zip(spent, step, strict=True):
            spent[name] += seconds
    total = sum(spent.values())
    parts = ", ".join(
        f"{name} {seconds / POINTS / repeats * 1e6:.0f} us ({seconds / total:.0%})"
        for name, seconds in spent.items()
    )
    show(f"rooms: {parts}")


def test_free_rotation(show, best, scene):
    """Both wheels with the balance of axle torque, as campaigns run it."""
    conditions, wheelset, counterface, models = scene
    free = ContactConditions(**{**vars(conditions), "rotation": "free"})

    def run():
        contact.solve_each(free, wheelset, counterface, models, lambda part: part.fields.strip_work)

    run()
    show(f"wheelset with free rotation: {best(run, 3) / POINTS * 1e6:.0f} us per operating point and core")


def test_help(show, best):
    """Start of the command line, which must not import numpy."""
    command = [sys.executable, "-m", "wearsim", "--help"]
    run = lambda: subprocess.run(command, capture_output=True, check=True)  # noqa: E731 (used twice)
    run()
    show(f"wearsim --help: {best(run, 10):.3f} s (target < 0.15)")
    script = "import sys; sys.argv = ['wearsim', '--help']\nfrom wearsim.cli import main\n"
    script += "try:\n    main()\nexcept SystemExit:\n    pass\nsys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True).returncode == 0


def test_main_job_of_the_readme(show, tmp_path):
    """Rig against field with its report: cold with compilation, then warm."""
    command = [sys.executable, "-m", "wearsim", "run", str(ROOT / "workflows" / "rig_vs_field.toml"), "--out"]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for name, target in (("cold", 60), ("warm", 20)):
        start = time.perf_counter()
        out = str(tmp_path / name)
        subprocess.run([*command, out], check=True, capture_output=True, env=environment)
        show(f"main job of the README, {name}: {time.perf_counter() - start:.1f} s (target < {target})")
