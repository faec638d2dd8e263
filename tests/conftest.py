"""Settings of all tests."""

from hypothesis import settings

# First calls compile kernels, which no deadline allows for; the same examples in every run.
settings.register_profile("wearsim", deadline=None, derandomize=True)
settings.load_profile("wearsim")
