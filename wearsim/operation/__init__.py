"""Where and how the wheelset runs: rig programmes, load collectives of the field, monitoring points."""
