"""Quantities of the rail or roller, as it is and as it wears."""

from __future__ import annotations

from wearsim.nomenclature.row import KM, LATERAL, Row

ROWS: tuple[Row, ...] = (
    ("counterface_y", "y", "m", "lateral position of the rail or roller profile", LATERAL, None),
    ("counterface_z", "z", "m", "height of the rail or roller profile", "positive down, 0 at the top", None),
    ("counterface_name", "", "", "rail or roller that wears", "", None),
    ("counterface_profile_y", "y", "m", "lateral position of the worn rail or roller", LATERAL, None),
    (
        "counterface_profile_z",
        "z",
        "m",
        "height of the worn rail or roller",
        "positive down, 0 at the top when new; after turning, if it is turned in this row",
        None,
    ),
    (
        "counterface_wear_depth",
        "d",
        "m",
        "wear depth of the rail or roller along its normal",
        "at material points, since it was new or last turned; the depth before in the row of a turning",
        None,
    ),
    (
        "counterface_worn_area",
        "A",
        "m2",
        "area of the cross-section worn off the rail or roller",
        "since the start, without what is turned off",
        None,
    ),
    (
        "counterface_max_wear_depth",
        "d",
        "m",
        "largest wear depth of the rail or roller",
        "since it was new or last turned; the depth before in the row of a turning",
        None,
    ),
    (
        "counterface_turned_depth",
        "",
        "m",
        "depth turned off the roller in all",
        "the least: its largest wear depth at each turning",
        None,
    ),
    ("counterface_turnings", "", "1", "number of times the rollers were turned", "since the start", None),
    (
        "counterface_turned_at",
        "s",
        "m",
        "distance run when the rollers were last turned",
        "0 before the first time",
        KM,
    ),
)
