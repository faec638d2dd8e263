"""Operating conditions: rig programmes, load collectives and monitoring points."""
