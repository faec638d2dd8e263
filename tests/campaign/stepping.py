"""A wear step with a wear rate that is a function of the state alone."""

from wearsim.campaign.step import begun, stability_rate


def step_over(state, rate, length, rule, rate_at, stability=None):
    """Step of a length [m], by the calls of a campaign; stability number of the rate if
    none is given.
    """
    number = stability_rate(rate) * length if stability is None else stability
    stages = begun(state, rate, length, rule, number)
    while stages.left:
        ahead = stages.ahead()
        stages = stages.with_rate(ahead, rate_at(ahead))
    return stages.end()
