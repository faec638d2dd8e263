"""Wear campaigns: states, rates, steps, and runs that can be resumed."""
