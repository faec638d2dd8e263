"""Judging contact models by the wear increment they give."""

from dataclasses import replace

import numpy as np
import pytest

from wearsim.campaign import choose
from wearsim.campaign.choose import Evidence
from wearsim.contact.problem import ContactModels
from wearsim.scene import build, load_scene
from wearsim.studies.chart import sample_of


def test_a_small_collective_is_its_own_sample():
    index = choose.sample(np.array([1.0, 5.0, 2.0]), np.array([0.5, 0.0, 0.5]))
    assert index.tolist() == [0, 2]


def test_a_sample_stands_for_the_work_in_equal_parts():
    """100 points, one of which does half of the work: it is taken, and the rest is spread over the others."""
    work = np.ones(100)
    work[37] = 100.0
    index = choose.sample(work, np.full(100, 0.01), 10)
    assert 37 in index
    assert 5 <= index.size <= 10
    assert np.all(np.diff(index) > 0)
    assert choose.sample(np.zeros(100), np.full(100, 0.01), 10).size == 10


def test_the_cheapest_is_the_first_that_keeps_the_tolerance():
    models = ContactModels()
    one, two, three = (Evidence(models, error, 0.0, 0.0) for error in (0.3, 0.04, 0.01))
    assert choose.cheapest([one, two, three], 0.05) is two
    assert choose.cheapest([one, two, three], 0.02) is three
    assert choose.cheapest([one, two, three], 1e-3) is None
    assert choose.cheapest([Evidence(models, np.inf, np.inf, np.inf, "refused")], 10.0) is None


@pytest.fixture(scope="module")
def rig():
    return build(load_scene("workflows/rig.toml"))


def test_evidence_is_zero_against_itself_and_the_size_of_the_difference_otherwise(rig):
    """30 against 60 strips: below 2 % in strip work; twice the friction wears far more than twice as much."""
    state, points = sample_of(rig, 4)
    fine = replace(rig.models, strips=60, cells=60)
    stiff = replace(rig.models, normal="hertz")
    evidence = choose.judge(
        [fine, replace(fine, strips=30, cells=30), stiff], fine, state, points, rig.wheelset, rig.counterface,
        rig.wear, smoothing_wavelength=rig.control.smoothing_wavelength,
    )  # fmt: skip
    assert (evidence[0].depth_error, evidence[0].work_error, evidence[0].power_error) == (0.0, 0.0, 0.0)
    assert 0.0 < evidence[1].work_error < 0.02
    assert 0.0 < evidence[1].power_error < 0.02
    assert evidence[2].depth_error == np.inf
    assert "no contact ellipse" in evidence[2].refusal
