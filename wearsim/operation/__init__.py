"""Where and how the wheelset runs.

Rig programmes, load collectives of the field, monitoring points.
"""
