"""Quantities of operating points."""

from __future__ import annotations

from wearsim.nomenclature.row import KM, Row

ROWS: tuple[Row, ...] = (
    ("op_label", "", "", "operating point", "", None),
    ("op_shift", "y", "m", "lateral shift of the wheelset", "positive to the right", None),
    ("op_yaw", "ψ", "rad", "yaw of the wheelset", "turns x (rolling direction) towards y (right)", None),
    (
        "op_roll",
        "φ",
        "rad",
        "roll of the wheelset",
        "turns y (right) towards z (down); not that of a wheelset whose roll_rule is free",
        None,
    ),
    ("op_wheel_load", "Q", "N", "vertical load of each wheel", "", None),
    ("op_speed", "V", "m s-1", "peripheral speed of the counterface at its profile top", "", None),
    ("op_friction", "μ", "1", "friction coefficient", "", None),
    ("op_track_curvature", "1/R", "m-1", "track curvature", "positive to the right", None),
    (
        "op_environment",
        "f",
        "1",
        "environment factor on the wear depth",
        "1 = coefficients as measured in the dry laboratory",
        None,
    ),
    (
        "op_weight",
        "w",
        "1",
        "share of the operating point in the full collective",
        "0 = monitoring point",
        None,
    ),
    (
        "op_block_length",
        "L",
        "m",
        "length of the block in the loop of the programme",
        "0 = stationary collective or monitoring point",
        KM,
    ),
)
