"""The one table of quantities: name, symbol, SI unit, shown unit, sign convention, meaning.

Result files take their units and long names from here, figures their labels and factors, and
``wearsim contact --json`` its field names.  A quantity that is not in this table has no name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Quantity:
    """One quantity of the field.

    Parameters
    ----------
    name : str
        As in result files, in JSON and as the Python name.
    symbol : str
        As in the literature, Unicode.
    unit : str
        SI unit in UDUNITS form, "1" for ratios, "" for names and flags.
    shown_unit : str
        Unit people read.
    shown_factor : float
        Shown value = stored value * factor.
    meaning : str
        One short phrase; the `long_name` of result files.
    sign : str
        Sign convention or further remark, where there is one; the `comment` of result files.
    """

    name: str
    symbol: str
    unit: str
    shown_unit: str
    shown_factor: float
    meaning: str
    sign: str = ""

    @property
    def label(self) -> str:
        """Axis label: meaning, symbol and shown unit."""
        unit = f" [{self.shown_unit}]" if self.shown_unit not in ("", "1") else ""
        return f"{self.meaning} {self.symbol}{unit}" if self.symbol else f"{self.meaning}{unit}"


# unit -> shown unit and factor where nothing better is said in the row
_SHOWN = {
    "": ("", 1.0),
    "1": ("1", 1.0),
    "m": ("mm", 1e3),
    "m2": ("mm²", 1e6),
    "m2 m-1": ("mm²/1000 km", 1e12),
    "m m-1": ("µm/1000 km", 1e12),
    "m-1": ("1/m", 1.0),
    "rad": ("mrad", 1e3),
    "rad s-1": ("rad/s", 1.0),
    "N": ("kN", 1e-3),
    "N m": ("N m", 1.0),
    "Pa": ("MPa", 1e-6),
    "W": ("W", 1.0),
    "kg": ("kg", 1.0),
    "J m-3": ("kJ/m³", 1e-3),
    "m s-1": ("km/h", 3.6),
}
_PER_KM = ("1/1000 km", 1e6)

_KM = ("km", 1e-3)
_MICRON = ("µm", 1e6)
_PER_MILLE = ("10⁻³", 1e3)
_INDEX = ("N/mm²", 1e-6)

_LATERAL = "positive to the field side, 0 at the origin line of the wheel profile"
_TRACK_SIGN = "wheel surface minus counterface, in the contact frame, x rolling direction, y right, z down"
_ON_WHEEL = "acting on the wheel, in the contact frame, x rolling direction, y right, z down"
_BARE = (
    "of the patch, as if the wheel ran in this operating point all the time: neither weighted with the share "
    "of the point nor multiplied by its environment factor"
)
_LEFT = "; a left wheel keeps the signs of the track axes"

# name, symbol, unit, meaning, sign convention, (shown unit, factor) where it differs from the usual one
_Row = tuple[str, str, str, str, str, tuple[str, float] | None]

_CAMPAIGN: tuple[_Row, ...] = (
    ("distance", "s", "m", "distance run", "", _KM),
    ("step_length", "Δs", "m", "distance of the step that led to this state", "0 in the initial state", _KM),
    (
        "stability_number",
        "S",
        "1",
        "largest depth over interpenetration in the step that led to this state",
        "sum over the operating points; 0 in the initial state and for models without interpenetration",
        None,
    ),
    (
        "step_error",
        "ε",
        "m",
        "estimated error of the depth of the step that led to this state, where it is largest",
        "difference between the rules of first and second order, after smoothing",
        _MICRON,
    ),
    (
        "rejected_steps",
        "n",
        "1",
        "longer steps that were tried before and failed the tolerance of the error",
        "",
        None,
    ),
    (
        "active_weight",
        "w",
        "1",
        "share of the operating point in the step that led to this state",
        "0 in the initial state and for monitoring points",
        None,
    ),
    ("wheel_name", "", "", "wheel", "", None),
    ("regime_name", "", "", "wear regime", "", None),
    ("arc_length", "u", "m", "arc length along the new right wheel profile", "from the flange back", None),
    ("profile_y", "y", "m", "lateral position of the wheel profile", _LATERAL, None),
    (
        "profile_z",
        "z",
        "m",
        "height of the wheel profile",
        "positive radially outward, 0 at the new tape circle",
        None,
    ),
    (
        "wear_depth",
        "d",
        "m",
        "wear depth along the surface normal",
        "at material points, since the start or the last turning",
        None,
    ),
    (
        "wear_depth_by_regime",
        "d",
        "m",
        "wear depth along the surface normal by wear regime",
        "at material points, since the start or the last turning",
        None,
    ),
    (
        "friction_work",
        "e",
        "J m-3",
        "frictional work per area and distance run",
        "of the whole collective, with both wheels rolling on the state of this row",
        None,
    ),
    ("flange_height", "Sh", "m", "flange height", "", None),
    ("flange_thickness", "Sd", "m", "flange thickness", "", None),
    ("flange_gradient", "qR", "m", "flange gradient", "", None),
    ("hollowing", "h", "m", "tread hollowing", "", None),
    ("worn_area", "A", "m2", "area of the profile cross-section worn off", "since the start", None),
    (
        "worn_mass",
        "m",
        "kg",
        "mass worn off the wheel",
        "since the start, whole circumference, without turning",
        None,
    ),
    (
        "max_wear_depth",
        "d",
        "m",
        "largest wear depth of the wheel",
        "since the start or the last turning",
        None,
    ),
    (
        "equivalent_conicity",
        "λ",
        "1",
        "equivalent conicity at 3 mm amplitude",
        "missing where it is undefined (no rolling radius difference that centres the wheelset)",
        None,
    ),
    ("n_patch", "n", "1", "number of contact patches of the operating point", "both wheels", None),
    ("counterface_y", "y", "m", "lateral position of the rail or roller profile", _LATERAL, None),
    ("counterface_z", "z", "m", "height of the rail or roller profile", "positive down, 0 at the top", None),
    ("counterface_name", "", "", "rail or roller that wears", "", None),
    ("counterface_profile_y", "y", "m", "lateral position of the worn rail or roller", _LATERAL, None),
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
        _KM,
    ),
)

_OPERATION: tuple[_Row, ...] = (
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
        _KM,
    ),
)

_PATCH: tuple[_Row, ...] = (
    ("patch_side", "", "", "wheel of the patch", "", None),
    ("wheel_y", "y", "m", "lateral position of the patch on the wheel profile", _LATERAL, None),
    ("rail_y", "y", "m", "lateral position of the patch on the rail or roller profile", _LATERAL, None),
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
    ("approach", "δ₀", "m", "approach of the bodies", "", _MICRON),
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
    ("creepage_x", "ξx", "1", "longitudinal creepage", _TRACK_SIGN, _PER_MILLE),
    ("creepage_y", "ξy", "1", "lateral creepage", _TRACK_SIGN + _LEFT, _PER_MILLE),
    ("spin", "φ", "m-1", "spin creepage", _TRACK_SIGN + _LEFT, None),
    ("force_x", "Fx", "N", "longitudinal creep force", _ON_WHEEL, None),
    ("force_y", "Fy", "N", "lateral creep force", _ON_WHEEL + _LEFT, None),
    ("spin_moment", "Mz", "N m", "spin moment about the centre of the patch", _ON_WHEEL + _LEFT, None),
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
    ("wear_index_mean", "Tγ/A", "Pa", "frictional work per distance and area, mean of the patch", "", _INDEX),
    (
        "wear_index_max",
        "Tγ/A",
        "Pa",
        "frictional work per distance and area, largest in the patch",
        "",
        _INDEX,
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

_LAW_TEXT = "as the scene asks for them, in its order"

# contact models that are chosen: results of scenes that ask for it
_CHOICE: tuple[_Row, ...] = (
    ("contact_candidate", "", "", "contact models that may be chosen", "by rising cost", None),
    (
        "contact_candidate_cost",
        "C",
        "1",
        "cost of one solution by the contact models, over that of the cheapest ones",
        "from the committed chart of speed against accuracy",
        None,
    ),
    (
        "contact_class",
        "",
        "",
        "class of operating points",
        "by the share of the work that they do, least first",
        None,
    ),
    (
        "contact_point_class",
        "",
        "1",
        "place of the class of the operating point in contact_class",
        "points that only monitor belong to the last one",
        None,
    ),
    (
        "contact_models",
        "k",
        "1",
        "place of the contact models of the class in contact_candidate",
        "",
        None,
    ),
    (
        "contact_models_error",
        "ε",
        "1",
        "error of the wear increment of the contact models when they were chosen",
        "largest difference from a half-space solution over the largest depth",
        None,
    ),
    (
        "contact_candidate_error",
        "ε",
        "1",
        "error of the wear increment if the contact models solved all operating points",
        "when it was chosen; missing where they were not tried, or refused a point",
        None,
    ),
)

# laws beside the leading wear law, and fatigue: results of scenes that ask for them
_DAMAGE: tuple[_Row, ...] = (
    ("beside_name", "", "", "wear law beside the leading one", _LAW_TEXT, None),
    ("beside_coefficients", "", "", "wear coefficients of the law beside", "", None),
    ("beside_source", "", "", "source of the wear coefficients of the law beside", "", None),
    ("beside_doubts", "", "", "uncertain wear coefficients of the law beside", "", None),
    ("beside_form", "", "", "form of the wear law beside", "", None),
    ("beside_regime_name", "", "", "wear law beside and its regime", "law after law", None),
    (
        "beside_wear_depth",
        "d",
        "m",
        "wear depth by a law beside the leading one",
        "what the law would have worn on the contacts of the campaign, along the normal at material points, "
        "since the start or the last turning; it changes no profile",
        None,
    ),
    (
        "beside_worn_area",
        "A",
        "m2",
        "area worn off by a law beside the leading one, by regime",
        "since the start; it changes no profile",
        None,
    ),
    ("wheel_template", "", "", "profile the wheel is turned to", "", None),
    (
        "last_turning",
        "n",
        "1",
        "step of the last turning of the wheels",
        "its own number in the row of the turned wheels, 0 before the first turning",
        ("1", 1.0),
    ),
    ("fatigue_name", "", "", "fatigue law", _LAW_TEXT, None),
    ("fatigue_coefficients", "", "", "coefficients of the fatigue law", "", None),
    ("fatigue_source", "", "", "source of the coefficients of the fatigue law", "", None),
    ("fatigue_doubts", "", "", "uncertain coefficients of the fatigue law", "", None),
    ("fatigue_form", "", "", "form of the fatigue law and its wear number", "", None),
    (
        "fatigue_crack_width",
        "w",
        "m",
        "width of profile over which the damage of a passage counts as that of one place",
        "",
        None,
    ),
    (
        "fatigue_crack_depth",
        "h",
        "m",
        "depth of a crack of damage 1, which wear removes",
        "missing where wear removes no damage, or the law contains it",
        None,
    ),
    (
        "fatigue_wear_limit",
        "d",
        "m",
        "depth that may wear, against which cracks are weighed",
        "missing where wear removes no damage, or the law contains it",
        None,
    ),
    (
        "fatigue_shear_yield",
        "k",
        "Pa",
        "yield stress of the wheel in cyclic shear",
        "missing where the law has none",
        None,
    ),
    (
        "fatigue_damage",
        "D",
        "1",
        "fatigue damage",
        "at material points, since the start or the last turning; what wear removes is taken off, and it is "
        "never below 0",
        None,
    ),
    (
        "fatigue_damage_rate",
        "dD/ds",
        "m-1",
        "fatigue damage per distance run",
        "of the whole collective in the state of this row, without removal by wear but that in the law",
        _PER_KM,
    ),
    (
        "wear_depth_rate",
        "dd/ds",
        "m m-1",
        "wear depth per distance run",
        "of the whole collective in the state of this row, by the leading law, before smoothing",
        None,
    ),
    (
        "balanced_wear_rate",
        "dd/ds",
        "m m-1",
        "wear depth per distance run at which cracks just do not grow",
        "missing where wear removes no damage, or the law contains it",
        None,
    ),
    (
        "life_limited_by",
        "",
        "",
        "what limits the life of the place at the rates of this row, from new",
        "cracks at damage 1, wear at the depth that may wear; missing as the balanced wear rate is",
        None,
    ),
    (
        "fatigue_damage_passage",
        "D",
        "1",
        "fatigue damage of one passage of the patch",
        "neither weighted with the share of its operating point nor shared by the width of a place",
        None,
    ),
    (
        "wear_number_without_spin",
        "Tγ",
        "N",
        "wear number without spin",
        "force times creepage of both directions, magnitudes",
        ("N", 1.0),
    ),
    (
        "wear_number_with_spin",
        "P/V",
        "N",
        "wear number with spin, frictional work per distance",
        "forces and spin moment times creepages and spin",
        ("N", 1.0),
    ),
)

# names that only `wearsim contact` uses: flags, JSON, tables
_CONTACT: tuple[_Row, ...] = (
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

_TRACK = "in the axes of the track, positive to the right"
_FORWARD = "positive in rolling direction"

# cell and strip fields of one patch, and sections across the track
_FIELD: tuple[_Row, ...] = (
    (
        "lateral",
        "y",
        "m",
        "lateral position in the contact plane",
        f"from the pressure-weighted centre of the patch, {_TRACK}",
        None,
    ),
    ("strip_wheel_y", "y", "m", "position of the strip on the wheel profile", _LATERAL, None),
    ("strip_width", "Δy", "m", "width of a strip", "", None),
    (
        "longitudinal",
        "x",
        "m",
        "longitudinal position in the contact plane",
        f"from the contact line, {_FORWARD}",
        None,
    ),
    ("x_lead", "x", "m", "leading end of the strip", _FORWARD, None),
    ("x_trail", "x", "m", "trailing end of the strip", _FORWARD, None),
    ("cells_lead", "x", "m", "leading end of the strip's row of cells", _FORWARD, None),
    ("cells_trail", "x", "m", "trailing end of the strip's row of cells", _FORWARD, None),
    ("pressure", "p", "Pa", "contact pressure", "", None),
    ("shear_x", "τx", "Pa", "longitudinal shear stress", _ON_WHEEL, None),
    ("shear_y", "τy", "Pa", "lateral shear stress", f"acting on the wheel, {_TRACK}", None),
    ("slip_x", "sx", "1", "longitudinal slip velocity over the speed", _FORWARD, None),
    ("slip_y", "sy", "1", "lateral slip velocity over the speed", _TRACK, None),
    ("slipping", "", "1", "whether the cell slips", "1 slip, 0 stick", None),
    ("work_density", "w", "Pa", "frictional work per area and distance run", "", _INDEX),
    (
        "section_y",
        "y",
        "m",
        "lateral position in the track",
        "from the origin line of the wheel profile at rest, positive to the right",
        None,
    ),
    (
        "section_z",
        "z",
        "m",
        "height in the track",
        "positive down, 0 at the top of the counterface",
        None,
    ),
    ("gap", "g", "m", "gap of the unloaded profiles along the normal", "0 where they touch first", _MICRON),
)

# what `wearsim profile` tells beyond the names of campaigns
_PROFILE: tuple[_Row, ...] = (
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
    ("alignment_rms", "", "m", "rms distance left by the alignment on unworn parts", "", _MICRON),
)


def _quantity(row: _Row) -> Quantity:
    name, symbol, unit, meaning, sign, shown = row
    shown_unit, factor = shown if shown is not None else _SHOWN[unit]
    return Quantity(name, symbol, unit, shown_unit, factor, meaning, sign)


_ROWS = (*_CAMPAIGN, *_OPERATION, *_PATCH, *_CHOICE, *_DAMAGE, *_CONTACT, *_FIELD, *_PROFILE)

NOMENCLATURE: Mapping[str, Quantity] = MappingProxyType({row[0]: _quantity(row) for row in _ROWS})
"""All quantities by name."""
