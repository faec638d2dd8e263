"""Whatever runs the solver many times and writes a dataset."""
