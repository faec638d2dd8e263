"""Results hang neither on what was compiled when nor on what was called before."""

import importlib.util
import io
import json
import os
import pkgutil
import resource
import subprocess
import sys

import numba
import numpy as np
import pytest

import wearsim.contact
from wearsim.cli import main
from wearsim.cli.progress import observer
from wearsim.contact.kernel import (
    _uncounted,
    bare_kernel,
    inner_kernel,
    kernel,
    leaf_kernel,
    plain,
)


def kernels():
    """Kernels of the contact rooms, by the module that defines them."""
    modules = [
        importlib.import_module(info.name)
        for info in pkgutil.walk_packages(wearsim.contact.__path__, "wearsim.contact.")
    ]
    return [
        value
        for module in modules
        for value in vars(module).values()
        if hasattr(value, "py_func") and value.py_func.__module__ == module.__name__
    ]


def test_leaf_kernels_call_no_kernel_and_are_called_by_none():
    every = kernels()
    leaves = [each for each in every if each.targetoptions.get("fastmath")]
    assert 0 < len(leaves) < len(every)
    for caller in every:
        code, known = caller.py_func.__code__, caller.py_func.__globals__
        called = [
            known[name] for name in code.co_names if hasattr(known.get(name), "py_func")
        ]
        assert caller not in leaves or not called, caller
        assert not [each for each in called if each in leaves], caller


@kernel
def _sum(values):
    total = 0.0
    for value in values:
        total += value * value
    return total


@leaf_kernel
def _sum_in_any_order(values):
    total = 0.0
    for value in values:
        total += value * value
    return total


def test_the_order_of_sums_is_kept_except_in_leaf_kernels():
    given = np.random.default_rng(1).normal(size=(20, 1001))
    totals = [_sum.py_func(values) for values in given]
    assert [_sum(values) for values in given] == totals
    assert [_sum(values) for values in np.repeat(given, 2, axis=1)[:, ::2]] == totals
    reordered = [_sum_in_any_order(values) for values in given]
    assert reordered != totals
    assert reordered == pytest.approx(totals, rel=1e-14)


@bare_kernel
def _doubled(values):
    for i in range(values.size):
        values[i] *= 2.0


@bare_kernel
def _allocating(count):
    return np.zeros(count)[0]


def test_bare_kernels_change_arrays_and_allocate_none():
    values = np.arange(3.0)
    before = sys.getrefcount(values)
    _doubled(values)
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])
    assert sys.getrefcount(values) == before
    with pytest.raises(numba.NumbaError):
        _allocating(3)


def test_bare_kernels_return_no_arrays():
    bare = [each for each in kernels() if "_nrt" in each.targetoptions]
    assert bare
    for each in bare:
        assert "FloatArray" not in str(each.py_func.__annotations__["return"]), each


@inner_kernel
def _inner(value):
    return 2.0 * value


@kernel
def _outer(value):
    return _inner(value) + 1.0


def test_inner_kernels_are_called_by_kernels_alone():
    every = kernels()
    inner = [each for each in every if each.targetoptions.get("no_cpython_wrapper")]
    called = {name for each in every for name in each.py_func.__code__.co_names}
    assert inner
    assert {each.py_func.__name__ for each in inner} <= called
    assert _outer(3.0) == 7.0
    for kernel_of_kernels in (_inner, *inner):
        with pytest.raises(TypeError, match="kernels alone can call"):
            kernel_of_kernels(3.0)


def test_a_numba_without_the_private_option_counts():
    assert _uncounted(numba.core.cpu.CPUTargetOptions) == {"_nrt": False}
    assert _uncounted(None) == {}


def test_plain_arrays_are_contiguous_and_writeable():
    given = np.broadcast_to(np.arange(3), (2, 3))
    array = plain(given)
    assert array.flags.c_contiguous
    assert array.flags.writeable
    assert array.dtype == np.float64
    np.testing.assert_array_equal(array, given)
    assert plain(array) is array


SQUARE = """
from wearsim.contact.kernel import kernel

@kernel
def square(x):
    return x * x
"""


@pytest.fixture
def square(tmp_path, monkeypatch):
    """Function that makes a kernel of a module of its own, cached in a folder of its
    own, and its cache.
    """
    monkeypatch.setattr("wearsim.contact.kernel.UNCACHED", [])
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    path = tmp_path / "square_alone.py"
    path.write_text(SQUARE)

    def made():
        spec = importlib.util.spec_from_file_location("square_alone", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.square

    return made


def reasons():
    return sys.modules["wearsim.contact.kernel"].UNCACHED


def test_without_a_place_for_the_cache_kernels_are_compiled_anew_and_it_is_said(
    square, monkeypatch, capsys
):
    njit = numba.njit

    def nowhere(cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function")
        return njit(**options)

    monkeypatch.setattr(numba, "njit", nowhere)
    assert square()(3.0) == 9.0
    assert reasons() == ["no folder for it can be written"]
    assert main(["schema"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(
        "note: kernels are compiled anew in each run, numba's cache fails: no folder"
    )


def test_a_full_disk_or_a_damaged_cache_costs_time_not_the_run(square, tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        assert square()(3.0) == 9.0
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert reasons() == ["File too large"]
    reasons().clear()
    assert square()(3.0) == 9.0
    assert reasons() == []
    (index,) = tmp_path.rglob("*.nbi")
    index.write_bytes(b"")
    assert square()(3.0) == 9.0
    assert any("EOFError" in reason for reason in reasons())


def test_a_first_run_says_once_that_it_compiles_and_later_ones_do_not(
    square, monkeypatch, caplog
):
    """Also in the progress of a campaign."""
    caplog.set_level("INFO", logger="wearsim")
    announced = sys.modules["wearsim.contact.kernel"]._announce
    progress = io.StringIO()
    announced.cache_clear()
    with observer(progress):
        first = square()
        assert (first(3.0), first(3)) == (9.0, 9)  # two variants
    announced.cache_clear()
    assert square()(3.0) == 9.0
    (record,) = (one for one in caplog.records if one.name == "wearsim.kernels")
    assert record.getMessage().startswith(
        "compiling kernels of the contact models: a first run here takes"
    )
    assert progress.getvalue().splitlines() == [record.getMessage()]


FOUR_BY_FOUR = """
import json
import numpy as np
from wearsim.contact.normal.half_space.pressure import NODES, HeightGrid, solve_pressure
from wearsim.contact.patch import Patch
from wearsim.contact.tangential import fastsim, half_space

y = np.array([[-3e-3, -1e-3, 1e-3, 3e-3]])
half = np.array([[2e-3, 5e-3, 6e-3, 3e-3]])
zero, count = np.array([0]), np.array([4])
slope = np.full((1, 4), 2e11)
width = np.array([2e-3])
patch = Patch(zero, y, width, half, -half, slope, 0 * y, count, count)

def rolled(model, creepage):
    result = model.solve(
        patch,
        np.array([creepage]),
        np.array([0.3]),
        shear_modulus=8e10,
        poisson_ratio=0.28,
        fields=True,
    )
    parts = result.force, result.slip_area, result.cells
    return [part.ravel().tolist() for part in parts]

x = 1e-3 * (np.arange(4) - 1.5)
first, second = (
    HeightGrid(a * x[:, None] ** 2 + x**2, 1e-3, 1e-3, c)
    for a, c in ((1.0, 1.0), (2.0, 0.9))
)
coupling = np.kron(1.0 - np.eye(2), np.full((NODES * NODES,) * 2, 1e-10))
both = solve_pressure([first, second], 5e3, 1.15e11, coupling=coupling)
alone = solve_pressure([first], 5e3, 1.15e11)
print(json.dumps({
    "fastsim": rolled(fastsim, [6e-4, -4e-4, 0.3]),
    "rolling": rolled(half_space, [2e-3, -1e-3, 0.3]),
    "pressure": [p.ravel().tolist() for p in (*both.pressure, *alone.pressure)],
    "approach": [[both.vertical_displacement], [both.iterations]],
}))
"""


def test_kernels_are_the_same_without_compilation(capsys):
    """On 4 x 4 cells: FASTSIM to rounding, two forms of one iteration for the rest."""
    exec(FOUR_BY_FOUR, {})
    compiled = json.loads(capsys.readouterr().out)
    done = subprocess.run(
        [sys.executable, "-c", FOUR_BY_FOUR],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    interpreted = json.loads(done.stdout)
    for name, rtol, atol in (
        ("fastsim", 1e-12, 1e-20),
        ("pressure", 1e-9, 1.0),
        ("approach", 1e-9, 1e-12),
    ):
        for one, other in zip(compiled[name], interpreted[name], strict=True):
            np.testing.assert_allclose(one, other, rtol=rtol, atol=atol, err_msg=name)
    for one, other in zip(compiled["rolling"], interpreted["rolling"], strict=True):
        largest = np.abs(one).max()
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-12 * largest)
