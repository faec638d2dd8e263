"""Contact of a wheel with a rail or roller: geometry, normal, creepage, tangential."""
