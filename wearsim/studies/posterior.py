r"""Posterior of uncertain inputs from differences of measured profiles.

Formulas on arrays.

Each input is the normal score of its distribution, so that the prior of all scores
x (d,) is N(0, I). Measurements are a vector (N,) of changes since the first profile;
what is Gaussian in them beside the inputs - noise, alignment, a small error of shape -
is integrated out in their covariance. Whitened, their residual is N(0, I), too.

The mode is found by Gauss-Newton steps on campaigns; around it the campaigns of some
draws of the Laplace approximation are replaced by a polynomial, with which points are
weighted (importance sampling) [1]_.

References
----------
.. [1] C. P. Robert, G. Casella, "Monte Carlo Statistical Methods", 2nd ed., Springer
   (2004), sections 3.3 and 14.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from wearsim.errors import ResultError

FloatArray = NDArray[np.float64]
Response = Callable[[FloatArray], FloatArray]
"""Predictions (N,) of one campaign at scores (d,) that differ from its own in those
inputs alone whose effect needs no further campaign."""
Run = Callable[[FloatArray], Sequence[Response]]
"""Campaigns at scores (n, d), with the response of each."""
Whitener = Callable[[FloatArray], FloatArray]
"""Maps residuals (..., N) to such of covariance I."""

BOUND = 3.5
"""Score from which on an input is at the bound of its distribution: its mode is never
farther away."""
LEAST_P = 1e-4
"""Of chi-square; below, the measurements are not those of the scene."""
LEAST_EFFECTIVE = 400
"""Effective number of weighted points."""
LARGEST_ERROR = 0.3
"""Of the polynomial, in standard deviations of the noise."""
DRAWS, ROUNDS = 32, 3
"""Campaigns around the mode in each round, and most rounds."""
POINTS = 4096
"""Points that are weighted in each round, and draws of the posterior."""

_SETTLED = 0.3  # step in standard deviations with which the search ends
_GAIN = 1.0  # of the sum of squares, without which it ends, too
_MOST_STEPS = 8
_LARGEST_STEP, _SMALLEST_STEP = (
    1.0,
    0.1,
)  # of differences, in scores; campaigns are rough
_CLOCK_STEP = 0.05  # the same, of inputs that need no campaign
_WIDENED = 1.6  # draws around the mode, over the Laplace approximation
_WIDER = 1.4  # the posterior against what the draws of its last round were made for
_REFITS = 8  # of the distribution of the points
_FREEDOM = 5  # of the t distribution of the points
_REACH = 0.999  # share of the widened draws that bounds where the polynomial is used
_ENOUGH = 0.3  # effective share of the points with which a round is the last one


def noise_covariance(
    arc: FloatArray, noise: float, length: float, white: float
) -> FloatArray:
    """Covariance of the noise of a measured profile [m2].

    Parameters
    ----------
    arc : (n,) array
        Arc length of its points [m].
    noise : float
        Standard deviation of the correlated part [m].
    length : float
        Over which its correlation falls to 1/e [m].
    white : float
        Standard deviation of the part without correlation [m].

    Returns
    -------
    (n, n) array
        ``noise**2 * exp(-|s - s'| / length) + white**2 * I`` [m2]. The correlation is
        exponential: a smooth one would make ripples of 1 to 4 mm count as wear.
    """
    apart = np.abs(arc[:, None] - arc[None])
    return noise**2 * np.exp(-apart / length) + white**2 * np.eye(arc.size)


def alignment_modes(
    y: FloatArray, z: FloatArray, normal: FloatArray, shift: float, tilt: float
) -> FloatArray:
    """Apparent wear depths of misaligned measurements [m].

    Parameters
    ----------
    y, z : (n,) array
        Points of the profile [m].
    normal : (2, n) array
        Unit normals into the material.
    shift, tilt : float
        Standard deviations of the shifts in y and z [m], and of the angle [rad].

    Returns
    -------
    (n, 3) array
        Depth by one standard deviation of the shift in y, in z, and of the angle that
        turns y towards z [m].
    """
    turned = normal[1] * y - normal[0] * z
    return np.column_stack([shift * normal[0], shift * normal[1], tilt * turned])


def difference_covariance(counts: FloatArray, first: float) -> FloatArray:
    """Covariance of m changes since a first measurement, whose error all share.

    Parameters
    ----------
    counts : (m,) array
        Measurements whose mean each change is made of.
    first : float
        Measurements whose mean the first one is.

    Returns
    -------
    (m, m) array
        In variances of one measurement: ``diag(1 / counts) + 1 / first``.
    """
    return np.diag(1.0 / counts) + 1.0 / first


def shape_covariance(
    depth: FloatArray, arc: FloatArray, share: float, length: float
) -> FloatArray:
    """Covariance of a shape error proportional to depth, the same at all times [m2].

    Parameters
    ----------
    depth : (m, n) array
        Predicted depth at m distances [m].
    arc : (n,) array
        Arc length [m].
    share : float
        Standard deviation over the depth.
    length : float
        Of its (Gaussian) correlation along the profile [m].

    Returns
    -------
    (m n, m n) array
        In [m2].
    """
    alike = np.exp(-0.5 * ((arc[:, None] - arc[None]) / length) ** 2)
    flat = share * depth.reshape(-1)
    return np.outer(flat, flat) * np.tile(alike, (len(depth), len(depth)))


def whitener(roots: Sequence[FloatArray]) -> Whitener:
    """Give the function that whitens residuals of independent blocks.

    Parameters
    ----------
    roots : sequence of (n, n) array
        Lower triangular root of the covariance of each block, in the order of the
        residuals.
    """
    ends = np.cumsum([0, *(len(root) for root in roots)])

    def whiten(residual: FloatArray) -> FloatArray:
        flat = np.atleast_2d(residual)
        parts = [
            solve_triangular(root, flat[:, start:end].T, lower=True).T
            for root, start, end in zip(roots, ends[:-1], ends[1:], strict=True)
        ]
        whitened = np.concatenate(parts, axis=1) if parts else np.zeros_like(flat)
        return whitened.reshape(residual.shape)

    return whiten


def newton_step(
    residual: FloatArray, jacobian: FloatArray, scores: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mode of the posterior where predictions are linear in the scores.

    Parameters
    ----------
    residual : (N,) array
        Measured less predicted at the scores, whitened.
    jacobian : (N, d) array
        Derivative of the predictions by the scores, whitened.
    scores : (d,) array
        Where both are taken.

    Returns
    -------
    mode : (d,) array
    precision : (d, d) array
        Inverse of the posterior covariance, ``J^T J + I``.
    """
    precision = jacobian.T @ jacobian + np.eye(scores.size)
    mode = np.linalg.solve(precision, jacobian.T @ (residual + jacobian @ scores))
    return np.asarray(mode, dtype=np.float64), precision


@dataclass(frozen=True)
class Mode:
    """Mode of the posterior, and what is linear there."""

    scores: FloatArray  # (d,)
    precision: FloatArray  # (d, d)
    predicted: FloatArray  # (N,) by the campaign next to it
    jacobian: FloatArray  # (N, d) of the predictions, not whitened
    whiten: Whitener
    chi2: float  # squares of the whitened residual and of the scores
    campaigns: int  # of the search
    clocked: NDArray[np.bool_]  # (d,) inputs that need no further campaign

    @property
    def covariance(self) -> FloatArray:
        """Posterior covariance of the Laplace approximation (d, d)."""
        return np.asarray(np.linalg.inv(self.precision))

    @property
    def deviation(self) -> FloatArray:
        """Posterior standard deviations (d,), over those of the prior."""
        return np.sqrt(np.diag(self.covariance))


def start_by_clock(
    run: Run,
    measured: FloatArray,
    noise: Callable[[FloatArray], Whitener],
    clocked: NDArray[np.bool_],
) -> FloatArray:
    """Scores (d,) to begin with, by one campaign for those that need no further."""
    scores = np.zeros(clocked.size)
    indices = np.flatnonzero(clocked)
    if not indices.size:
        return scores
    (response,) = run(scores[None])
    for _ in range(20):
        predicted = response(scores)
        whiten = noise(predicted)
        jacobian = np.empty((measured.size, indices.size))
        for column, index in enumerate(indices):
            jacobian[:, column] = _by_response(response, scores, int(index), predicted)
        step, _ = newton_step(
            whiten(measured - predicted), whiten(jacobian.T).T, scores[indices]
        )
        moved = np.clip(step - scores[indices], -0.5, 0.5)
        scores[indices] = np.clip(scores[indices] + moved, -BOUND, BOUND)
        if np.abs(moved).max() < 1e-3:
            break
    return scores


def _by_response(
    response: Response, scores: FloatArray, index: int, predicted: FloatArray
) -> FloatArray:
    """Return the derivative (N,) by an input that needs no further campaign."""
    moved = scores.copy()
    moved[index] -= _CLOCK_STEP
    return (predicted - response(moved)) / _CLOCK_STEP


def search(
    run: Run,
    measured: FloatArray,
    noise: Callable[[FloatArray], Whitener],
    clocked: NDArray[np.bool_],
    start: FloatArray,
    correction: FloatArray | float = 0.0,
) -> Mode:
    """Find the mode by Gauss-Newton steps on campaigns.

    Parameters
    ----------
    run : callable
        Makes campaigns; each step needs one, and one for each input without clock.
    measured : (N,) array
    noise : callable
        Whitener for predictions (N,).
    clocked : (d,) array of bool
        Inputs whose effect follows from the campaign that is there.
    start : (d,) array
        Scores to begin with.
    correction : (N,) array or float
        Added to all predictions: another contact model less that of the campaigns.

    Raises
    ------
    ResultError
        If the steps do not settle.
    """
    scores, before = start.copy(), start.copy()
    least, count = math.inf, 0
    deviation = np.full(scores.size, 0.5)
    sampled = np.flatnonzero(~clocked)
    for _ in range(_MOST_STEPS):
        sizes = np.clip(deviation, _SMALLEST_STEP, _LARGEST_STEP)
        steps = np.where(scores > 0.0, -sizes, sizes)
        batch = np.tile(scores, (1 + sampled.size, 1))
        batch[1 + np.arange(sampled.size), sampled] += steps[sampled]
        responses = run(batch)
        count += len(batch)
        base = responses[0](scores)
        predicted = base + correction
        whiten = noise(predicted)
        residual = whiten(measured - predicted)
        cost = float(residual @ residual + scores @ scores)
        if cost > 1.5 * least:  # too far: half the way back
            scores = 0.5 * (scores + before)
            continue
        jacobian = np.empty((measured.size, scores.size))
        for k, index in enumerate(sampled):
            jacobian[:, index] = (responses[1 + k](batch[1 + k]) - base) / steps[index]
        for index in np.flatnonzero(clocked):
            jacobian[:, index] = _by_response(responses[0], scores, int(index), base)
        mode, precision = newton_step(residual, whiten(jacobian.T).T, scores)
        mode = np.clip(mode, -BOUND, BOUND)
        change = mode - scores
        moved = math.sqrt(max(float(change @ precision @ change), 0.0))
        deviation = np.sqrt(np.diag(np.linalg.inv(precision)))
        left = residual - whiten(jacobian.T).T @ change
        chi2 = float(left @ left + mode @ mode)
        candidate = Mode(
            mode, precision, predicted, jacobian, whiten, chi2, count, clocked
        )
        if moved < _SETTLED or cost > least - _GAIN:
            return candidate
        before, scores, least = scores, mode, min(cost, least)
    if (
        p_value(least, measured.size) < LEAST_P
    ):  # the measurements are of something else
        return candidate
    raise ResultError(
        f"the search for the inputs does not settle: after {_MOST_STEPS} steps it "
        f"still moves by {moved:.2g} standard deviations; give fewer inputs or "
        "narrower distributions"
    )


@dataclass(frozen=True)
class Surrogate:
    """Polynomial for whitened predictions around the mode."""

    centre: FloatArray  # (d,)
    root: FloatArray  # (d, d) lower triangular: scores = centre + root @ local
    degree: int  # 1, or 2 with squares, or 3 with products, too
    weights: FloatArray  # (columns, N) of the whitened predictions
    directions: FloatArray  # (N, k) orthonormal, in which the inputs act at first order
    spread: FloatArray  # (k, k) covariance of the left-out errors in them

    @property
    def error(self) -> float:
        """Left-out error in the directions of the inputs, over the noise."""
        return math.sqrt(float(np.trace(self.spread)) / len(self.spread))

    def columns(self, scores: FloatArray) -> FloatArray:
        """Columns of the polynomial at scores (n, d)."""
        local = solve_triangular(self.root, (scores - self.centre).T, lower=True).T
        return _polynomial(local, self.degree)


def _polynomial(local: FloatArray, degree: int) -> FloatArray:
    d = local.shape[1]
    parts = [np.ones(len(local)), *local.T]
    if degree > 1:
        parts += list((local**2 - 1.0).T)
    if degree > 2:
        parts += [local[:, i] * local[:, j] for i in range(d) for j in range(i)]
    return np.column_stack(parts)


def surrogate_of(
    scores: FloatArray, whitened: FloatArray, centre: FloatArray, root: FloatArray
) -> Surrogate:
    """Fit the polynomial, of the degree that predicts left-out campaigns best.

    Parameters
    ----------
    scores : (n, t, d) array
        Of n campaigns, each at t places that it answers for.
    whitened : (n, t, N) array
        Predictions at them.
    centre, root : (d,), (d, d) array
        Mode, and root of the covariance that the draws were made with.
    """
    campaigns, places, d = scores.shape
    flat = (scores - centre).reshape(-1, d)
    local = solve_triangular(root, flat.T, lower=True).T
    identity = (1.0 + 1e-9) * np.eye(places)
    surrogates = list[Surrogate]()
    for degree in (1, 2, 3):
        design = _polynomial(local, degree)
        if surrogates and campaigns < 1.3 * design.shape[1]:
            break
        inverse = np.linalg.pinv(design)
        weights = inverse @ whitened.reshape(len(flat), -1)
        rows = design.reshape(campaigns, places, -1)
        hat = rows @ np.moveaxis(inverse.reshape(-1, campaigns, places), 0, 1)
        left_out = np.linalg.solve(identity - hat, whitened - rows @ weights)[:, 0]
        directions, _ = np.linalg.qr(weights[1 : 1 + d].T)
        errors = left_out @ directions
        spread = errors.T @ errors / len(errors)
        surrogates.append(Surrogate(centre, root, degree, weights, directions, spread))
    return min(surrogates, key=lambda surrogate: surrogate.error)


def log_density(surrogate: Surrogate, measured: FloatArray) -> Whitener:
    """Logarithm of the posterior density (n,) at scores (n, d), but for a constant.

    `measured` (N,) is whitened. The error of the surrogate counts as noise; where no
    draw of it is near, there is no density.
    """
    from scipy.stats import chi2  # 0.3 s to import, only spent where it is needed

    gram = surrogate.weights @ surrogate.weights.T
    mixed = surrogate.weights @ measured
    square = float(measured @ measured)
    farthest = float(chi2.ppf(_REACH, surrogate.centre.size))
    identity = np.eye(len(surrogate.spread))
    lost = identity - np.linalg.inv(identity + surrogate.spread)
    across = surrogate.weights @ surrogate.directions
    measured_across = measured @ surrogate.directions

    def density(scores: FloatArray) -> FloatArray:
        columns = surrogate.columns(scores)
        misfit = square - 2.0 * columns @ mixed
        misfit += np.einsum("ni,ij,nj->n", columns, gram, columns, optimize=True)
        deviation = measured_across - columns @ across
        misfit -= np.einsum("ni,ij,nj->n", deviation, lost, deviation)
        local = columns[:, 1 : 1 + surrogate.centre.size]
        near = (local**2).sum(axis=1) <= farthest
        logarithm = -0.5 * misfit - 0.5 * (scores**2).sum(axis=1)
        return np.where(near, logarithm, -np.inf)

    return density


def weighted_points(
    density: Callable[[FloatArray], FloatArray],
    centre: FloatArray,
    covariance: FloatArray,
    seed: int,
) -> tuple[FloatArray, FloatArray, float]:
    """Points of a density, weighted; those of a t distribution that is fitted to them.

    Parameters
    ----------
    density : callable
        Logarithm of the density at (n, d), but for a constant.
    centre, covariance : (d,), (d, d) array
        Where to begin.
    seed : int

    Returns
    -------
    points : (n, d) array
    weights : (n,) array
        Their sum is 1.
    effective : float
        1 over the sum of their squares.
    """
    from scipy.special import ndtri
    from scipy.stats import chi2, qmc

    best: tuple[FloatArray, FloatArray, float] | None = None
    for random in np.random.default_rng(seed).spawn(_REFITS):
        share = qmc.Sobol(centre.size + 1, rng=random).random(POINTS)
        share = np.clip(share, 1e-9, 1.0 - 1e-9)
        width = np.sqrt(chi2.ppf(share[:, -1:], _FREEDOM) / _FREEDOM)
        local = ndtri(share[:, :-1]) / width
        points = centre + local @ np.linalg.cholesky(covariance).T
        proposed = (
            -0.5
            * (_FREEDOM + centre.size)
            * np.log1p((local**2).sum(axis=1) / _FREEDOM)
        )
        logs = density(points) - proposed
        weights = _normalised(logs)
        effective = 1.0 / float((weights**2).sum())
        if best is None or effective > best[2]:
            best = points, weights, effective
        if effective > _ENOUGH * POINTS:
            break
        power = 1.0
        while 1.0 / float((weights**2).sum()) < 0.05 * POINTS and power > 0.01:
            power *= 0.7
            weights = _normalised(power * logs)
        centre, covariance = _moments(points, weights, covariance)
    assert best is not None
    return best


def _moments(
    points: FloatArray, weights: FloatArray, before: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (d,) and covariance (d, d) of weighted points.

    A little of the covariance `before` keeps that of few points regular.
    """
    mean = weights @ points
    apart = points - mean
    return mean, (weights[:, None] * apart).T @ apart + 1e-6 * before


def _normalised(logs: FloatArray) -> FloatArray:
    weights = np.exp(logs - logs.max())
    return weights / weights.sum()


def equal_draws(
    points: FloatArray, weights: FloatArray, count: int, seed: int
) -> FloatArray:
    """Draws (count, d) of equal weight from weighted points, in random order."""
    random = np.random.default_rng(seed)
    places = (random.random() + np.arange(count)) / count
    chosen = np.searchsorted(np.cumsum(weights), places)
    chosen = np.minimum(chosen, len(points) - 1)
    return points[random.permutation(chosen)]


@dataclass(frozen=True)
class Posterior:
    """Draws of the posterior, and how they were found."""

    mode: Mode
    draws: FloatArray  # (POINTS, d) scores, of equal weight
    surrogate: Surrogate
    predictions: FloatArray  # (3, N) 5 %, 50 % and 95 % of the draws
    effective: float
    p_value: float  # of chi-square


def p_value(chi2: float, count: int) -> float:
    """Probability [-] that chi-square of `count` values is at least as large."""
    from scipy.stats import chi2 as distribution

    return float(distribution.sf(chi2, count)) if count else 1.0


def draws_around(
    centre: FloatArray, covariance: FloatArray, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Scores (n, d) of campaigns around a place, with the root of their covariance."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    root = np.asarray(_WIDENED * np.linalg.cholesky(covariance), dtype=np.float64)
    share = qmc.Sobol(centre.size, rng=random).random(DRAWS)
    normal = np.clip(ndtri(np.clip(share, 1e-9, 1.0 - 1e-9)), -2.0, 2.0)
    return centre + normal @ root.T, root


def posterior_around(
    run: Run,
    measured: FloatArray,
    mode: Mode,
    seed: int,
    correction: FloatArray | float = 0.0,
) -> Posterior:
    """Draw from the posterior around its mode.

    Campaigns of the first round are draws of the Laplace approximation; each answers
    for slower wear, too, as far as inputs need no further campaign. Where the
    posterior they lead to lies elsewhere, by more than one standard deviation of the
    draws, or is wider, further ones are drawn there.

    Parameters
    ----------
    run, measured, correction
        As of `search`.
    mode : Mode
    seed : int
        Same seed, same bits.

    Raises
    ------
    ResultError
        If the campaigns around the mode are followed by no polynomial, or too few
        points have weight.
    """
    centre, covariance = mode.scores, mode.covariance
    slower = np.where(mode.clocked, mode.deviation, 0.0)
    places = np.array([0.0, 1.0] if mode.clocked.any() else [0.0])
    scores = np.empty((0, places.size, centre.size))
    predicted = np.empty((0, places.size, measured.size))
    for random in np.random.default_rng(seed).spawn(ROUNDS):
        more, root = draws_around(centre, covariance, random)
        responses = run(more)
        at = more[:, None] - places[:, None] * slower
        values = [
            [response(place) for place in row]
            for response, row in zip(responses, at, strict=True)
        ]
        scores = np.concatenate([scores, at])
        predicted = np.concatenate([predicted, np.array(values) + correction])
        whitened = mode.whiten(predicted.reshape(-1, measured.size))
        whitened = whitened.reshape(predicted.shape)
        surrogate = surrogate_of(scores, whitened, centre, root)
        density = log_density(surrogate, mode.whiten(measured))
        points, weights, effective = weighted_points(density, centre, covariance, seed)
        mean, weighted_covariance = _moments(points, weights, covariance)
        moved = math.sqrt(
            float((mean - centre) @ np.linalg.solve(covariance, mean - centre))
        )
        wider = float(np.sqrt(np.diag(weighted_covariance) / np.diag(covariance)).max())
        if surrogate.error <= LARGEST_ERROR and moved <= _WIDENED and wider <= _WIDER:
            break
        centre, covariance = mean, weighted_covariance
    if surrogate.error > LARGEST_ERROR:
        raise ResultError(
            f"{len(scores)} campaigns around the mode follow no polynomial: its error "
            f"is {surrogate.error:.2g} standard deviations of the noise, above "
            f"{LARGEST_ERROR:g}; give fewer inputs or narrower distributions"
        )
    if effective < LEAST_EFFECTIVE:
        raise ResultError(
            f"only {effective:.0f} points of the posterior have weight, fewer than "
            f"{LEAST_EFFECTIVE}; give fewer inputs or narrower distributions"
        )
    draws = equal_draws(points, weights, POINTS, seed)
    flat = surrogate.columns(scores.reshape(-1, centre.size))
    raw = np.linalg.pinv(flat) @ predicted.reshape(len(flat), -1)
    sample = surrogate.columns(draws[:: len(draws) // 512]) @ raw
    bands = np.quantile(sample, (0.05, 0.5, 0.95), axis=0)
    p = p_value(mode.chi2, measured.size)
    return Posterior(mode, draws, surrogate, bands, effective, p)


def worth(
    jacobian: FloatArray, whiten: Whitener, more: FloatArray, whiten_more: Whitener
) -> FloatArray:
    """Find the standard deviations (d,) that further measurements would leave.

    Parameters
    ----------
    jacobian, more : (N, d), (M, d) array
        Derivatives of what is measured, and of what would be, all of it.
    whiten, whiten_more : callable
        Of both.

    Returns
    -------
    (d,) array
        Over those that are left by what is measured.
    """
    left = []
    for matrix, white in ((jacobian, whiten), (more, whiten_more)):
        whitened = white(matrix.T).T
        precision = whitened.T @ whitened + np.eye(matrix.shape[1])
        left.append(np.sqrt(np.diag(np.linalg.inv(precision))))
    return left[1] / left[0]
