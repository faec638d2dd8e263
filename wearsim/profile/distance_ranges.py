"""Allowed distances of the measures of a wheel: without numpy, for the flags of the command line too."""

DISTANCE_RANGES = {"below_tip": (0.5, 10.0), "level": (2.0, 25.0), "flange_back": (50.0, 100.0)}
"""Smallest and largest value of each of `GaugeDistances` that can be meant [mm]."""
