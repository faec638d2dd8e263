"""From the rig to the field: pure functions on two result datasets."""
