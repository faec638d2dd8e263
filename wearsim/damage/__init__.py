"""Damage laws: wear and fatigue of the wheel due to the work of contact forces."""
