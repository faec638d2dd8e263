"""Damage laws: what the frictional work of a contact does to the wheel."""
