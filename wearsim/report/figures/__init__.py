"""Figures: `plot_x(dataset, ax=None) -> Axes`, and whole figures made of them."""
