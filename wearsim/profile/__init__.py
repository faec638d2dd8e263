"""Cross-sections of wheels, rails and rollers: standard shapes, files, gauge values."""
