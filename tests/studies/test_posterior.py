"""The posterior of closed-form rigs: coverage, ranks, formulas, refusals."""

import closed_form_rig as rig
import numpy as np
import pytest
from scipy.stats import chisquare

from wearsim.errors import ResultError
from wearsim.studies import posterior

D = len(rig.NAMES)


@pytest.fixture(scope="module")
def many():
    """Truths from the prior, ranks among 99 draws, and whether 90 % intervals hold."""
    random = np.random.default_rng(5)
    ranks, held = [], []
    for seed in range(300):
        truth = random.standard_normal(D)
        found = rig.learn(rig.measured(truth, random), seed=seed)
        low, high = np.quantile(found.draws, (0.05, 0.95), axis=0)
        held.append((truth > low) & (truth < high))
        chosen = found.draws[random.choice(len(found.draws), 99, replace=False)]
        ranks.append((chosen < truth).sum(axis=0))
    return np.array(ranks), np.array(held)


@pytest.mark.slow
def test_ranks_of_300_rigs_are_uniform(many):
    ranks, _ = many
    for k in range(D):
        counts = np.bincount(ranks[:, k] // 5, minlength=20)
        assert chisquare(counts).pvalue > 0.01 / D


@pytest.mark.slow
def test_intervals_of_300_rigs_cover(many):
    _, held = many
    assert 0.86 <= held.mean() <= 0.94
    assert held.mean(axis=0).min() >= 0.80


def test_a_rig_is_recovered_within_its_intervals():
    truth = np.array([0.7, 0.5, -0.8, 0.3, -0.4])
    found = rig.learn(rig.measured(truth, np.random.default_rng(2)))
    assert (
        np.abs((found.draws.mean(axis=0) - truth) / found.draws.std(axis=0)).max() < 3.0
    )
    assert found.draws.std(axis=0).max() < 0.5  # the measurements tell about all inputs
    assert found.p_value > posterior.LEAST_P


def test_same_seed_same_bits():
    data = rig.measured(np.zeros(D), np.random.default_rng(3))
    one, other = (rig.learn(data, seed=4).draws for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert (rig.learn(data, seed=5).draws != one).any()


@pytest.mark.parametrize("count", [1, 5])
def test_measurements_that_tell_nothing_return_the_prior(count):
    """A thousand kilograms of noise; fewer measurements than inputs, and more."""
    matrix = np.random.default_rng(1).standard_normal((count, 3))

    def run(batch):
        return [lambda scores: matrix @ scores for _ in batch]

    def white(prediction):
        return posterior.whitener([1e3 * np.eye(count)])

    data = 1e3 * np.ones(count)
    mode = posterior.search(run, data, white, np.zeros(3, dtype=bool), np.zeros(3))
    found = posterior.posterior_around(run, data, mode, seed=1)
    # of 4 096 draws: 5 standard errors
    assert np.abs(found.draws.mean(axis=0)).max() < 5.0 / np.sqrt(posterior.POINTS)
    np.testing.assert_allclose(found.draws.std(axis=0), 1.0, atol=0.06)


@pytest.mark.parametrize("exact", [1.0, 1e-7])
def test_fewer_measurements_than_inputs_leave_the_prior_elsewhere(exact):
    """Of a combination that is measured, however well; two numbers, five inputs."""
    matrix = np.zeros((2, 5))
    matrix[0, 0] = matrix[1, 1] = 1.0

    def run(batch):
        return [lambda scores: matrix @ scores for _ in batch]

    def white(prediction):
        return posterior.whitener([exact * np.eye(2)])

    data = np.array([0.5, -0.5])
    mode = posterior.search(run, data, white, np.zeros(5, dtype=bool), np.zeros(5))
    found = posterior.posterior_around(run, data, mode, seed=1)
    left = np.sqrt(exact**2 / (1.0 + exact**2))
    expected = np.array([left, left, 1.0, 1.0, 1.0])
    # of 4 096 draws, and of points with 999 of 1 000 of the mass
    np.testing.assert_allclose(found.draws.std(axis=0) / expected, 1.0, atol=0.08)


def test_a_linear_model_has_the_closed_form():
    """Mean and covariance of the draws are those of a linear Gaussian model."""
    random = np.random.default_rng(1)
    matrix = random.standard_normal((40, 3)) * np.array([3.0, 1.0, 0.2])
    data = matrix @ np.array([0.5, -1.0, 1.0]) + random.standard_normal(40)

    def run(batch):
        return [lambda scores: matrix @ scores for _ in batch]

    def white(prediction):
        return posterior.whitener([np.eye(40)])

    mode = posterior.search(run, data, white, np.zeros(3, dtype=bool), np.zeros(3))
    covariance = np.linalg.inv(matrix.T @ matrix + np.eye(3))
    mean = covariance @ matrix.T @ data
    np.testing.assert_allclose(mode.scores, mean, atol=1e-9)
    np.testing.assert_allclose(mode.covariance, covariance, rtol=1e-9)
    misfit = data - matrix @ mean
    assert mode.chi2 == pytest.approx(misfit @ misfit + mean @ mean, rel=1e-9)
    found = posterior.posterior_around(run, data, mode, seed=1)
    deviation = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        found.draws.mean(axis=0), mean, atol=0.08 * deviation.max()
    )
    np.testing.assert_allclose(found.draws.std(axis=0), deviation, rtol=0.06)
    assert found.surrogate.error < 1e-9


def walk(density, start, root, steps, random):
    """Metropolis' random walk: points (steps, d)."""
    points = np.empty((steps, start.size))
    place, height = start, density(start)
    for step in range(steps):
        other = place + root @ random.standard_normal(start.size)
        higher = density(other)
        if np.log(random.random()) < higher - height:
            place, height = other, higher
        points[step] = place
    return points


@pytest.mark.slow
def test_draws_agree_with_a_random_walk_on_the_rig_itself():
    """Without polynomial, weights and Gaussian: the same means and deviations."""
    random = np.random.default_rng(9)
    truth = np.array([0.7, 0.5, -0.8, 0.3, -0.4])
    data = rig.measured(truth, random)
    mode = rig.learn(data, mode_only=True)
    found = posterior.posterior_around(rig.run, data, mode, seed=1)
    whitening = mode.whiten(np.eye(data.size)).T

    def density(scores):
        left = whitening @ (data - rig.predicted(scores))
        return -0.5 * float(left @ left + scores @ scores)

    root = 2.38 / np.sqrt(D) * np.linalg.cholesky(mode.covariance)
    points = walk(density, mode.scores, root, 24_000, random)[4_000:]
    deviation = points.std(axis=0)
    off = (found.draws.mean(axis=0) - points.mean(axis=0)) / deviation
    # of a walk with some 1 in 30 independent: 4 % of the deviation, and weights as many
    assert np.abs(off).max() < 0.2
    np.testing.assert_allclose(found.draws.std(axis=0), deviation, rtol=0.12)


def test_the_clock_alone_finds_the_scale():
    truth = np.array([0.9, 0.0, 0.0, 0.0, 0.0])
    data = rig.measured(truth, np.random.default_rng(6))
    start = posterior.start_by_clock(rig.run, data, rig.noise, rig.CLOCKED)
    assert start[0] == pytest.approx(0.9, abs=0.3)
    assert (start[1:] == 0.0).all()


def test_an_unknown_that_is_left_out_shows_in_chi_square():
    """With the shift 3 standard deviations off, the clock alone does not fit."""
    data = rig.measured(np.array([0.5, 3.0, 0.0, 0.0, 0.0]), np.random.default_rng(7))

    def run(batch):
        return [lambda s: rig.predicted(np.array([s[0], 0, 0, 0, 0])) for _ in batch]

    clocked = np.array([True])
    start = posterior.start_by_clock(run, data, rig.noise, clocked)
    mode = posterior.search(run, data, rig.noise, clocked, start)
    assert posterior.p_value(mode.chi2, data.size) < posterior.LEAST_P


def test_exchanged_wheels_show_in_chi_square():
    data = rig.measured(np.array([0.5, 1.5, 0.5, 0.0, 0.0]), np.random.default_rng(8))
    half = data.size // 2
    exchanged = np.concatenate([data[half:], data[:half]])
    mode = rig.learn(exchanged, mode_only=True)
    assert posterior.p_value(mode.chi2, data.size) < posterior.LEAST_P


def test_a_model_that_no_polynomial_follows_is_refused():
    def run(batch):
        return [
            lambda s: 30.0 * np.sin(9.0 * np.outer(s, [1.0, 2.0]).ravel())
            for _ in batch
        ]

    def white(prediction):
        return posterior.whitener([np.eye(4)])

    mode = posterior.Mode(
        np.zeros(2),
        np.eye(2),
        np.zeros(4),
        np.ones((4, 2)),
        white(None),
        1.0,
        1,
        np.zeros(2, dtype=bool),
    )
    with pytest.raises(ResultError, match="follow no polynomial"):
        posterior.posterior_around(run, np.zeros(4), mode, seed=1)


def test_noise_has_its_closed_form():
    arc = np.array([0.0, 1e-3, 3e-3])
    found = posterior.noise_covariance(arc, 10e-6, 2e-3, 3e-6)
    assert found[0, 0] == pytest.approx(109e-12)
    assert found[0, 2] == pytest.approx(1e-10 * np.exp(-1.5))
    assert np.linalg.eigvalsh(found).min() > 0.0


def test_alignment_modes_are_what_a_moved_profile_feigns():
    """A plane profile shifted and turned, cut along its normals."""
    y = np.linspace(-0.03, 0.03, 7)
    z = np.full(7, 0.002)
    normal = np.stack([np.zeros(7), -np.ones(7)])
    modes = posterior.alignment_modes(y, z, normal, 1e-4, 1e-3)
    np.testing.assert_allclose(modes[:, 0], 0.0, atol=1e-18)
    np.testing.assert_allclose(modes[:, 1], -1e-4)
    np.testing.assert_allclose(modes[:, 2], -1e-3 * y, atol=1e-15)


def test_changes_share_the_error_of_the_first_measurement():
    random = np.random.default_rng(1)
    first = random.standard_normal((200_000, 2)).mean(axis=1)
    later = [random.standard_normal((200_000, n)).mean(axis=1) for n in (1, 3)]
    changes = np.stack([one - first for one in later])
    expected = posterior.difference_covariance(np.array([1.0, 3.0]), 2.0)
    np.testing.assert_allclose(np.cov(changes), expected, atol=0.02)


def test_one_more_measurement_is_worth_what_its_variance_says():
    """Of one value measured once, a second measurement halves the variance."""
    jacobian = np.array([[10.0]])
    one, two = (posterior.whitener([np.array([[v]])]) for v in (1.0, 0.5**0.5))
    left = posterior.worth(jacobian, one, jacobian, two)
    assert left[0] == pytest.approx(np.sqrt(101.0 / 201.0))
