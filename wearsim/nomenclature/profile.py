"""Quantities that `wearsim profile` tells beyond those of campaigns."""

from __future__ import annotations

from wearsim.nomenclature.row import MICRON, Row

ROWS: tuple[Row, ...] = (
    (
        "rolling_radius_difference",
        "Δr",
        "m",
        "rolling radius difference",
        "right minus left wheel, over the lateral shift of the wheelset to the right",
        None,
    ),
    ("amplitude", "ŷ", "m", "amplitude of the lateral motion", "", None),
    ("wheel_diameter", "D", "m", "wheel diameter at the tape circle", "", None),
    ("back_to_back", "AR", "m", "distance of the flange backs", "", None),
    ("front_to_front", "SR", "m", "distance of the active flanks", "back to back and both Sd", None),
    ("wheel_diameter_difference", "ΔD", "m", "difference of the wheel diameters", "right minus left", None),
    ("rim_width", "BR", "m", "width of the rim", "from the flange back to the outer face", None),
    ("alignment_rms", "", "m", "rms distance left by the alignment on unworn parts", "", MICRON),
)
