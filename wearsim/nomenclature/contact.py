"""Quantities of contact patches."""

from __future__ import annotations

from wearsim.nomenclature.row import INDEX, LATERAL, MICRON, ON_WHEEL, PER_MILLE, Row

_TRACK_SIGN = "wheel surface minus counterface, in the contact frame, x rolling direction, y right, z down"
_BARE = (
    "of the patch, as if the wheel ran in this operating point all the time: neither weighted with the share "
    "of the point nor multiplied by its environment factor"
)
_LEFT = "; a left wheel keeps the signs of the track axes"

PATCH: tuple[Row, ...] = (
    ("patch_side", "", "", "wheel of the patch", "", None),
    ("wheel_y", "y", "m", "lateral position of the patch on the wheel profile", LATERAL, None),
    ("rail_y", "y", "m", "lateral position of the patch on the rail or roller profile", LATERAL, None),
    (
        "contact_x",
        "x",
        "m",
        "longitudinal position of the patch",
        "from the axle, positive in rolling direction",
        None,
    ),
    ("contact_angle", "δ", "rad", "contact angle", "about x, z down" + _LEFT, None),
    ("area", "A", "m2", "area of the contact patch", "", None),
    ("max_pressure", "p₀", "Pa", "largest contact pressure", "", None),
    ("patch_length", "2a", "m", "length of the contact patch in rolling direction", "", None),
    ("patch_width", "2b", "m", "width of the contact patch", "", None),
    ("approach", "δ₀", "m", "approach of the bodies", "", MICRON),
    ("normal_force", "N", "N", "normal force of the patch", "", None),
    (
        "load_scale",
        "",
        "1",
        "factor on the normal force of the patch that makes the wheel carry its load",
        "1 but where patches of a wheel merge: there no interpenetration gives the load, and pressures and "
        "forces are scaled to it",
        None,
    ),
    ("creepage_x", "ξx", "1", "longitudinal creepage", _TRACK_SIGN, PER_MILLE),
    ("creepage_y", "ξy", "1", "lateral creepage", _TRACK_SIGN + _LEFT, PER_MILLE),
    ("spin", "φ", "m-1", "spin creepage", _TRACK_SIGN + _LEFT, None),
    ("force_x", "Fx", "N", "longitudinal creep force", ON_WHEEL, None),
    ("force_y", "Fy", "N", "lateral creep force", ON_WHEEL + _LEFT, None),
    ("spin_moment", "Mz", "N m", "spin moment about the centre of the patch", ON_WHEEL + _LEFT, None),
    ("slip_area", "As", "m2", "area of the patch that slips", "", None),
    ("slip_share", "As/A", "1", "share of the patch that slips", "", None),
    ("power", "P", "W", "frictional power of the patch", "never negative", None),
    (
        "power_balance",
        "P'/P",
        "1",
        "power of the unscaled local fields over the resultant power",
        "a diagnostic; local fields are stored after scaling",
        None,
    ),
    ("wear_index_mean", "Tγ/A", "Pa", "frictional work per distance and area, mean of the patch", "", INDEX),
    (
        "wear_index_max",
        "Tγ/A",
        "Pa",
        "frictional work per distance and area, largest in the patch",
        "",
        INDEX,
    ),
    (
        "wear_area_rate",
        "dA/ds",
        "m2 m-1",
        "worn area of the profile per distance run",
        _BARE,
        None,
    ),
    (
        "wear_depth_rate_max",
        "dd/ds",
        "m m-1",
        "largest wear depth per distance run",
        _BARE + "; along the normal, before smoothing",
        None,
    ),
    (
        "wear_regime",
        "",
        "",
        "wear regime that contributes most depth in the patch",
        "-1 where nothing wears",
        None,
    ),
    (
        "wear_regime_highest",
        "",
        "",
        "highest wear regime of the patch: the last one, in the order of the law, in which any of its cells "
        "wears",
        "-1 where nothing wears; in the patch-mean form of the law a patch has one regime",
        None,
    ),
)
"""Of each patch, in result files."""

SOLUTION: tuple[Row, ...] = (
    ("shift", "y", "m", "lateral shift of the wheelset", "positive to the right", None),
    ("yaw", "ψ", "rad", "yaw of the wheelset", "turns x (rolling direction) towards y (right)", None),
    ("roll", "φ", "rad", "roll of the wheelset", "turns y (right) towards z (down)", None),
    ("wheel_load", "Q", "N", "vertical load of each wheel", "", None),
    ("speed", "V", "m s-1", "peripheral speed of the counterface at its profile top", "", None),
    ("friction", "μ", "1", "friction coefficient", "", None),
    (
        "counterface_curvature",
        "κ",
        "m-1",
        "curvature of the counterface in rolling direction, 1/s0",
        "0 = rail",
        None,
    ),
    ("track_curvature", "1/R", "m-1", "track curvature", "positive to the right", None),
    (
        "rotation_speed",
        "Ω",
        "rad s-1",
        "rotation speed of the wheelset",
        "positive when it rolls forwards",
        None,
    ),
    ("side", "", "", "wheel of the patch", "right or left", None),
    (
        "x",
        "x",
        "m",
        "longitudinal position of the patch",
        "from the axle, positive in rolling direction",
        None,
    ),
    ("length", "2a", "m", "length of the contact patch in rolling direction", "", None),
    ("width", "2b", "m", "width of the contact patch", "", None),
    ("normal", "", "", "normal contact model", "", None),
    ("tangential", "", "", "tangential contact model", "", None),
)
"""Names that only `wearsim contact` uses: flags, JSON, tables."""
