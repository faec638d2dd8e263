"""A rig whose wear is a closed form: depth of two wheels at three distances."""

import numpy as np

from wearsim.studies import posterior

ARC = np.arange(0.0, 120e-3, 2e-3)
AT = np.array([0.5, 1.0, 2.0])
NAMES = ("scale", "shift", "friction", "load", "border")
CLOCKED = np.array([True, False, False, False, False])


def depth(distance, scores):
    """Depth (2, n) [m] at a distance in 1000 km, wider and slower as it wears."""
    scale, shift, friction, load, border = scores
    worn = distance * np.exp(0.42 * scale)
    out = []
    for side in (-1.0, 1.0):
        middle = 60e-3 + side * 2e-3 * shift
        width = (14e-3 + 2e-3 * load) * (1.0 + 0.1 * worn)
        tread = np.exp(-(((ARC - middle) / width) ** 2))
        place = 25e-3 - side * 1e-3 * shift + 1e-3 * border
        flange = np.exp(-(((ARC - place) / 5e-3) ** 2)) * np.exp(0.5 * friction)
        much = 250e-6 * worn / (1.0 + 0.15 * worn)
        out.append(much * (tread + (0.5 + 0.2 * side) * flange))
    return np.array(out)


def predicted(scores):
    """All measurements (N,), wheel by wheel."""
    every = np.array([depth(distance, scores) for distance in AT])
    return np.moveaxis(every, 1, 0).reshape(-1)


def covariances(prediction, first=1.0):
    """Covariance of the noise and of the error of shape of each wheel."""
    one = posterior.noise_covariance(ARC, 10e-6, 2e-3, 3e-6)
    angle = np.linspace(1.2, -0.1, ARC.size)
    normal = np.stack([np.sin(angle), -np.cos(angle)])
    modes = posterior.alignment_modes(ARC - 0.06, 0.0 * ARC, normal, 0.1e-3, 1e-3)
    between = posterior.difference_covariance(np.ones(AT.size), first)
    noise = np.kron(between, one + modes @ modes.T)
    depths = prediction.reshape(2, AT.size, ARC.size)
    return [noise + posterior.shape_covariance(one, ARC, 0.05, 5e-3) for one in depths]


def noise(prediction):
    """Whitener of residuals where measurements (N,) are predicted."""
    return posterior.whitener(
        [np.linalg.cholesky(one) for one in covariances(prediction)]
    )


def measured(scores, random):
    """Measurements (N,) of a rig with these inputs."""
    truth = predicted(scores)
    parts = [
        np.linalg.cholesky(one) @ random.standard_normal(len(one))
        for one in covariances(truth)
    ]
    return truth + np.concatenate(parts)


def run(batch):
    """Each campaign answers for the scale, too."""

    def response_of(own):
        def response(scores):
            assert (scores[~CLOCKED] == own[~CLOCKED]).all()
            return predicted(scores)

        return response

    return [response_of(one.copy()) for one in batch]


def learn(data, seed=1, mode_only=False):
    """Find the posterior of measurements (N,), or its mode alone."""
    start = posterior.start_by_clock(run, data, noise, CLOCKED)
    mode = posterior.search(run, data, noise, CLOCKED, start)
    return mode if mode_only else posterior.posterior_around(run, data, mode, seed)
