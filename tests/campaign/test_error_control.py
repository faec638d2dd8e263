"""Steps under the tolerance of their error: real physics, coarse and short."""

import signal

import netCDF4
import numpy as np
import pytest

from wearsim.campaign.run import resume, run_scene
from wearsim.errors import NumericalError
from wearsim.results import LAYOUT, open_results

KILLED = """
import os, signal
from wearsim.campaign.run import run_scene
def kill(event):
    if event.kind == "step" and event.step == {step}:
        os.kill(os.getpid(), signal.SIGKILL)
run_scene({scene!r}, {out!r}, observer=kill)
"""


@pytest.fixture(scope="module")
def write(scene_text):
    """Function that writes the scene of two long blocks, with steps that only the error
    limits.
    """

    def made(folder, *, tolerance, integrator="rkc"):
        campaign = (
            "distance_km = 30\npoint_spacing_mm = 0.5\nmax_step_depth_um = 20\n"
            "stability = 1.0\n"
            "first_step_depth_um = 20\n"
            f'integrator = "{integrator}"\nerror_tolerance_um = {tolerance}'
        )
        left, right = (
            {"shift_mm": shift, "yaw_mrad": yaw, "distance_km": distance}
            for shift, yaw, distance in ((-3, 0, 12), (3, 1, 18))
        )
        path = folder / "rig.toml"
        path.write_text(scene_text(left, right, campaign=campaign))
        return path

    return made


@pytest.fixture(scope="module")
def strict(tmp_path_factory, write):
    """A campaign whose steps the error limits: scene and result file."""
    folder = tmp_path_factory.mktemp("strict")
    scene = write(folder, tolerance=0.05)
    return scene, run_scene(scene, folder / "out")[0]


def test_steps_that_fail_the_tolerance_are_repeated_shorter(strict):
    with open_results(strict[1]) as data:
        error, rejected = data["step_error"].values, data["rejected_steps"].values
        assert np.isnan(error[0])
        assert error[1:].max() <= 0.05e-6
        assert rejected[0] == 0
        # the first step does not know the error yet; the later ones learn from their
        # predecessor
        assert rejected[1] >= 1
        assert rejected[2:].mean() < 0.5
        assert data.attrs["error_tolerance"] == pytest.approx(0.05e-6)
        # the error limits them, not the 20 um or S = 1
        assert float(data["stability_number"].max()) < 0.7
        assert float(data["distance"][-1]) == pytest.approx(30e3, rel=1e-12)


@pytest.mark.slow
def test_a_killed_campaign_tries_the_same_steps(strict, tmp_path, forked):
    """What limits the next step by the error is in the record: same bits."""
    scene, reference = strict
    code = KILLED.format(step=3, scene=str(scene), out=str(tmp_path / "out"))
    process, printed = forked(code)
    with printed:
        output = printed.read()
    process.join()
    assert process.exitcode == -signal.SIGKILL, output
    (path,) = resume(tmp_path / "out")
    with netCDF4.Dataset(path) as one, netCDF4.Dataset(reference) as other:
        for file in (one, other):
            file.set_auto_maskandscale(False)
        for name in LAYOUT:
            assert np.array_equal(one[name][:], other[name][:]), name


@pytest.mark.slow
def test_euler_under_the_same_tolerance_agrees(strict, tmp_path, write):
    """Two rules, each step within 0.05 um: the profiles differ by no more than the sum
    of their estimates.

    As RMS over the worn band, as which the error of a step is estimated.
    """
    (path,) = run_scene(
        write(tmp_path, tolerance=0.05, integrator="euler"), tmp_path / "out"
    )
    with open_results(path) as euler, open_results(strict[1]) as rkc:
        depth = rkc["wear_depth"].values[-1]
        band = depth > 0.02 * depth.max(axis=1, keepdims=True)
        off = np.where(band, euler["wear_depth"].values[-1] - depth, 0.0)
        rms = np.sqrt((off**2).sum(axis=1) / band.sum(axis=1)).max()
        assert 0.0 < rms < float(euler["step_error"].sum() + rkc["step_error"].sum())
        assert float(euler["step_error"].max()) <= 0.05e-6


def test_an_error_that_does_not_fall_is_told(tmp_path, monkeypatch, write):
    from wearsim.campaign import evolution

    monkeypatch.setattr(evolution.step, "error_of", lambda *_: 1e-3)
    with pytest.raises(
        NumericalError, match=r"no wear step keeps .* raise error_tolerance_um"
    ) as caught:
        run_scene(write(tmp_path, tolerance=0.05), tmp_path / "out")
    assert "\n" not in str(caught.value)
