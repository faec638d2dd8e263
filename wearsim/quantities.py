"""The one table of quantities: name, symbol, units, meaning, sign, place in result files, input range.

A quantity has one name in Python, JSON, result files and tables; dimensions tell apart what shares a name:
``shift(operating_point)`` of a result file is the ``shift`` of `wearsim contact --json`.  Result files take
units, long names and dimensions from here, figures their labels and factors; scene files, flags and CSV
columns the range of every number they accept.  Numbers are SI inside and in files, in the shown unit in
scenes, flags and tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple


class InputRange(NamedTuple):
    """Values allowed as input, in the shown unit; `high` is included, `low` unless `above`."""

    low: float
    high: float
    above: bool = False


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
        Unit people read and write.
    shown_factor : float
        Shown value = stored value * factor.
    meaning : str
        One short phrase; the `long_name` of result files.
    sign : str
        Sign convention or further remark, where there is one; the `comment` of result files.
    dimensions : tuple of str
        In result files, `step` first where it has one; empty if result files do not hold it.
    kind : {"f8", "i4", "str"}
        Type stored in result files.
    missing : bool
        Whether values of result files may be missing (no patch in the slot, quantity undefined).
    group : str
        Group of variables that only results of some scenes have, all or none; "" if all results have it.
    allowed : InputRange, optional
        Range allowed as input, if it is one.
    """

    name: str
    symbol: str
    unit: str
    shown_unit: str
    shown_factor: float
    meaning: str
    sign: str = ""
    dimensions: tuple[str, ...] = ()
    kind: str = "f8"
    missing: bool = False
    group: str = ""
    allowed: InputRange | None = None

    @property
    def label(self) -> str:
        """Axis label: meaning, symbol and shown unit."""
        unit = f" [{self.shown_unit}]" if self.shown_unit not in ("", "1") else ""
        return f"{self.meaning} {self.symbol}{unit}" if self.symbol else f"{self.meaning}{unit}"

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of a variable of a dataset: `long_name`, `units` and, with a sign, `comment`."""
        texts = {"long_name": self.meaning, "units": self.unit, "comment": self.sign}
        return {key: text for key, text in texts.items() if text}

    @property
    def range(self) -> InputRange:
        """Range allowed as input, in the shown unit; raises ValueError for what is no input."""
        if self.allowed is None:
            raise ValueError(f"{self.name} is no input")
        return self.allowed

    def fault(self, value: float, name: str = "") -> str:
        """Message if an input [SI unit] is not finite or out of its range, else empty; `name` is its own."""
        shown, unit = value * self.shown_factor, self.shown_unit if self.shown_unit != "1" else ""
        low, high, above = self.allowed or InputRange(-math.inf, math.inf)
        slack = 1e-9 * abs(shown)  # of the conversion
        if math.isfinite(shown) and low - slack <= shown <= high + slack and not (above and shown <= low):
            return ""
        limits = f"{'above' if above else 'at least'} {low:g} and at most {high:g}"
        return (
            f"{name or self.name} = {shown:g} must be {limits if self.allowed else 'finite'} {unit}".rstrip()
        )

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest input, in the shown unit."""
        return self.range[:2]


STEP_LIMITS = (
    "none", "depth cap", "stability", "error", "growth", "first step", "max step", "block border",
    "redressing", "remaining distance", "no contact", "clipping",
)  # fmt: skip
"""What limits a wear step, in the order of the flags of `step_limit`; none in the initial state."""


def duration(seconds: float) -> str:
    """Write a time [s] as people say it."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


# unit -> shown unit and factor where the row gives no other
_SHOWN = {
    "": ("", 1.0), "1": ("1", 1.0), "m": ("mm", 1e3), "m2": ("mm²", 1e6), "m2 m-1": ("mm²/1000 km", 1e12),
    "m m-1": ("µm/1000 km", 1e12), "m-1": ("1/m", 1.0), "rad": ("mrad", 1e3), "rad s-1": ("rad/s", 1.0),
    "N": ("kN", 1e-3), "N m": ("N m", 1.0), "Pa": ("MPa", 1e-6), "W": ("W", 1.0), "kg": ("kg", 1.0),
    "J m-3": ("kJ/m³", 1e-3), "J m-2": ("J/m²", 1.0), "m s-1": ("km/h", 3.6), "kg m-3": ("kg/m³", 1.0),
    "m3 J-1": ("mm³/kJ", 1e12), "N m-1": ("N/m", 1.0), "s": ("s", 1.0),
}  # fmt: skip
_KM, _MICRON, _METRE = ("km", 1e-3), ("µm", 1e6), ("m", 1.0)
_PER_MILLE, _INDEX, _NEWTON, _GIGA = ("10⁻³", 1e3), ("N/mm²", 1e-6), ("N", 1.0), ("GPa", 1e-9)

_LATERAL = "positive to the field side, 0 at the origin line of the wheel profile"
_FRAME = "in the contact frame, x rolling direction, y right, z down"
_CREEP = f"wheel surface minus counterface, {_FRAME}"
_LEFT = "; a left wheel keeps the signs of the track axes"
_ON_WHEEL = f"acting on the wheel, {_FRAME}"
_TRACK = "in the axes of the track, positive to the right"
_FORWARD = "positive in rolling direction"
_BARE = (
    "of the patch, as if the wheel ran in this operating point all the time: neither weighted with the share "
    "of the point nor multiplied by its environment factor"
)
_REPROFILED = "since the start or the last reprofiling"
_SINCE = f"at material points, {_REPROFILED}"
_REDRESSED = "since it was new or last redressed; the depth before in the row of a redressing"
_MARGIN = "missing where wear removes no damage, or the law contains it"
_JUDGED = "missing where the law judges by another quantity"
_ACTING = (
    "of the points of the step that led to this state; of the whole collective in the initial state, after a "
    "reprofiling and at the end of the distance"
)
_FAINT = (
    f"{_ACTING}; patches below a thousandth of the load, power and wear of their wheel fade out, and the "
    "others carry their load"
)
_FAINTEST = "of one wheel at one operating point"
_PER_MATERIAL = "of both bodies"

# place in result files: type if it is not the usual one, dimensions, ? where values may be missing
_OP, _WHEEL, _ALONG = "operating_point", "step wheel", "step wheel point"
_PATCH, _PATCH_LAW = "step operating_point patch ?", "step operating_point patch fatigue ?"
_BELOW, _STATE = "step wheel counterface_point", "step operating_point"


def _q(
    name: str, symbol: str, unit: str, meaning: str, sign: str = "", at: str = "", *,
    shown: tuple[str, float] | None = None, allowed: tuple[float, float] | None = None,
    above: tuple[float, float] | None = None,
) -> Quantity:  # fmt: skip
    """Quantity of a row: `allowed` includes both ends, `above` leaves out the lower one."""
    words = at.split()
    kind = words.pop(0) if words and words[0] == "i4" else "f8" if unit else "str"
    limits = InputRange(*above, above=True) if above else InputRange(*allowed) if allowed else None
    return Quantity(
        name, symbol, unit, *(shown or _SHOWN[unit]), meaning, sign,
        tuple(word for word in words if word != "?"), kind, "?" in words, "", limits,
    )  # fmt: skip


def _group(group: str, *rows: Quantity) -> tuple[Quantity, ...]:
    return tuple(replace(row, group=group) for row in rows)


# One line per quantity where it fits.
# fmt: off
_CAMPAIGN = (
    _q("wheel_name", "", "", "wheel", at="wheel"),
    _q("regime_name", "", "", "wear regime", at="regime"),
    _q("operating_point_name", "", "", "operating point", at=_OP),
    _q("arc_length", "u", "m", "arc length along the new right wheel profile", "from the flange back",
       "point"),
    _q("counterface_y", "y", "m", "lateral position of the rail or roller profile", _LATERAL,
       "counterface_point"),
    _q("counterface_z", "z", "m", "height of the rail or roller profile", "positive down, 0 at the top",
       "counterface_point"),
    _q("shift", "y", "m", "lateral shift of the wheelset", "positive to the right", _OP, allowed=(-100, 100)),
    _q("yaw", "ψ", "rad", "yaw of the wheelset", "turns x (rolling direction) towards y (right)", _OP,
       allowed=(-100, 100)),
    _q("roll", "φ", "rad", "roll of the wheelset",
       "turns y (right) towards z (down); not that of a wheelset whose roll_rule is free", _OP,
       allowed=(-100, 100)),
    # below 0.1 kN a patch is hardly wider than the 0.1 mm grid on which profiles are compared
    _q("wheel_load", "Q", "N", "vertical load of each wheel", at=_OP, allowed=(0.1, 300)),
    _q("speed", "V", "m s-1", "peripheral speed of the counterface at its profile top", at=_OP,
       allowed=(0.1, 500)),
    _q("friction", "μ", "1", "friction coefficient", at=_OP, allowed=(0, 1)),
    _q("track_curvature", "1/R", "m-1", "track curvature", "positive to the right", _OP, allowed=(-0.1, 0.1)),
    _q("environment", "f", "1", "environment factor on the wear depth",
       "1 = coefficients as measured in the dry laboratory", _OP, above=(0, 10)),
    _q("weight", "w", "1", "share of the operating point in the full collective", "0 = monitoring point", _OP,
       above=(0, 1)),
    _q("block_length", "L", "m", "length of the block in the loop of the programme",
       "0 = stationary collective or monitoring point", _OP, shown=_KM, above=(0, 1e7)),
    _q("distance", "s", "m", "distance run", at="step", shown=_KM, above=(0, 1e7)),
    _q("step_length", "Δs", "m", "distance of the step that led to this state", "0 in the initial state",
       "step", shown=_KM, above=(0, 1e7)),
    _q("stability_number", "S", "1", "decay of the fastest wave of the profile in the step to this state",
       "the larger of half the depth over interpenetration and 1.25 times what the steps before have shown",
       "step", above=(0, 100)),
    _q("step_error", "ε", "m", "estimated error of the depth of the step that led to this state",
       "RMS over the band worn in the step, after smoothing, on the wheel or counterface where it is largest",
       "step ?", shown=_MICRON, allowed=(0.001, 1000)),
    _q("rejected_steps", "n", "1", "longer steps that were tried before and exceeded the error tolerance",
       "or had no contact solution, or clipped more than 1 % of their area", "i4 step"),
    _q("step_limit", "", "", "what limits the length of the step that led to this state", at="i4 step"),
    _q("stages", "s", "1", "stages of the rule of the step that led to this state", "0 in the initial state",
       "i4 step"),
    _q("active_weight", "w", "1", "share of the operating point in the step that led to this state",
       "0 in the initial state, for monitoring points and for blocks that did not act; contact of the latter "
       "is known in the initial state and at the end of the distance alone", "step operating_point"),
    _q("point_length", "Δs", "m", "distance the operating point ran in the last step it acted in",
       "0 before, and after a reprofiling or redressing", "step operating_point", shown=_KM),
    _q("point_error", "ε", "m", "estimated error of the depth of the last step the operating point acted in",
       "0 before", "step operating_point", shown=_MICRON),
    _q("point_stiffness", "ρ", "m-1", "fastest decay of a wave of the profile while the point acted",
       "0 before; a fifth of it is forgotten from step to step", "step operating_point"),
    _q("profile_y", "y", "m", "lateral position of the wheel profile", _LATERAL, _ALONG),
    _q("profile_z", "z", "m", "height of the wheel profile",
       "positive radially outward, 0 at the new running circle", _ALONG),
    _q("wear_depth", "d", "m", "wear depth along the surface normal", _SINCE, _ALONG),
    _q("friction_work", "e", "J m-3", "frictional work per area and distance run",
       f"{_ACTING}, with both wheels rolling on the state of this row", _ALONG),
    _q("wear_depth_by_regime", "d", "m", "wear depth along the surface normal by wear regime",
       _SINCE, "step wheel regime point"),
    _q("flange_height", "Sh", "m", "flange height", at=f"{_WHEEL} ?", allowed=(20, 45)),
    _q("flange_thickness", "Sd", "m", "flange thickness", at=f"{_WHEEL} ?", allowed=(15, 40)),
    _q("flange_gradient", "qR", "m", "flange gradient", at=f"{_WHEEL} ?", allowed=(0, 20)),
    _q("hollowing", "h", "m", "tread hollowing", at=f"{_WHEEL} ?", above=(0, 20)),
    _q("worn_area", "A", "m2", "area of the profile cross-section worn off", "since the start", _WHEEL),
    _q("worn_mass", "m", "kg", "mass worn off the wheel", "since the start, whole circumference, without "
       "reprofiling", _WHEEL),
    _q("max_wear_depth", "d", "m", "largest wear depth of the wheel", _REPROFILED, _WHEEL, above=(0, 50)),
    _q("equivalent_conicity", "λ", "1", "equivalent conicity at 3 mm amplitude",
       "missing where it is undefined (no rolling radius difference that centres the wheelset)", "step ?",
       above=(0, 5)),
    _q("n_patch", "n", "1", "number of contact patches of the operating point",
       "both wheels, without those that were left out because they are faint", "i4 step operating_point"),
    _q("faint_load", "", "1", "share of the load that faint patches lost", _FAINT, "step"),
    _q("faint_power", "", "1", "share of the frictional power that faint patches lost", _FAINT, "step"),
    _q("faint_wear", "", "1", "share of the wear that faint patches lost", _FAINT, "step"),
    _q("faint_load_max", "", "1", "share of the load that faint patches lost, largest", _FAINTEST, "step"),
    _q("faint_power_max", "", "1", "share of the power that faint patches lost, largest", _FAINTEST, "step"),
    _q("faint_wear_max", "", "1", "share of the wear that faint patches lost, largest", _FAINTEST, "step"),
)

_CONTACT = (
    _q("side", "", "", "wheel of the patch", "right or left", f"i4 {_PATCH}"),
    _q("wheel_y", "y", "m", "lateral position of the patch on the wheel profile", _LATERAL, _PATCH),
    _q("rail_y", "y", "m", "lateral position of the patch on the rail or roller profile", _LATERAL, _PATCH),
    _q("x", "x", "m", "longitudinal position of the patch", f"from the axle, {_FORWARD}", _PATCH),
    _q("contact_angle", "δ", "rad", "contact angle", "about x, z down" + _LEFT, _PATCH),
    _q("area", "A", "m2", "area of the contact patch", at=_PATCH),
    _q("max_pressure", "p₀", "Pa", "largest contact pressure", at=_PATCH),
    _q("length", "2a", "m", "length of the contact patch in rolling direction", at=_PATCH),
    _q("width", "2b", "m", "width of the contact patch", at=_PATCH),
    _q("approach", "δ₀", "m", "approach of the bodies", at=_PATCH, shown=_MICRON),
    _q("normal_force", "N", "N", "normal force of the patch", at=_PATCH, allowed=(0.1, 300)),
    _q("load_scale", "", "1", "factor on the normal force of the patch that makes the wheel carry its load",
       "1 but where patches of a wheel merge: there no interpenetration gives the load, and pressures and "
       "forces are scaled to it", _PATCH),
    _q("creepage_x", "ξx", "1", "longitudinal creepage", _CREEP, _PATCH, shown=_PER_MILLE,
       allowed=(-1000, 1000)),
    _q("creepage_y", "ξy", "1", "lateral creepage", _CREEP + _LEFT, _PATCH, shown=_PER_MILLE,
       allowed=(-1000, 1000)),
    _q("spin", "φ", "m-1", "spin creepage", _CREEP + _LEFT, _PATCH, allowed=(-100, 100)),
    _q("force_x", "Fx", "N", "longitudinal creep force", _ON_WHEEL, _PATCH),
    _q("force_y", "Fy", "N", "lateral creep force", _ON_WHEEL + _LEFT, _PATCH),
    _q("spin_moment", "Mz", "N m", "spin moment about the centre of the patch", _ON_WHEEL + _LEFT, _PATCH),
    _q("slip_area", "As", "m2", "area of the patch that slips", at=_PATCH),
    _q("slip_share", "As/A", "1", "share of the patch that slips"),
    _q("power", "P", "W", "frictional power of the patch", "never negative", _PATCH),
    _q("power_balance", "P'/P", "1", "power of the unscaled local fields over the resultant power",
       "a diagnostic; local fields are stored after scaling", _PATCH),
    _q("wear_index_mean", "Tγ/A", "Pa", "frictional work per distance and area, mean of the patch", at=_PATCH,
       shown=_INDEX),
    _q("wear_index_max", "Tγ/A", "Pa", "frictional work per distance and area, largest in the patch",
       at=_PATCH, shown=_INDEX),
    _q("wear_area_rate", "dA/ds", "m2 m-1", "worn area of the profile per distance run", _BARE, _PATCH),
    _q("wear_depth_rate_max", "dd/ds", "m m-1", "largest wear depth per distance run",
       _BARE + "; along the normal, before smoothing", _PATCH),
    _q("wear_regime", "", "", "wear regime that contributes most depth in the patch",
       "-1 where nothing wears", f"i4 {_PATCH}"),
    _q("wear_regime_highest", "", "", "highest wear regime of the patch: the last one, in the order of the "
       "law, in which any of its cells wears", "-1 where nothing wears; in the patch-mean form of the law a "
       "patch has one regime", f"i4 {_PATCH}"),
    _q("normal", "", "", "normal contact model"),
    _q("tangential", "", "", "tangential contact model"),
    _q("counterface_curvature", "κ", "m-1", "curvature of the counterface in rolling direction, 1/s0",
       "0 = rail"),
    _q("rotation_speed", "Ω", "rad s-1", "rotation speed of the wheelset", "positive when it rolls forwards",
       above=(0, 1000)),
)

_COMPARISON = _group("comparison",
    _q("comparison_name", "", "", "comparison wear law", "in the order of the scene", "comparison"),
    _q("comparison_coefficients", "", "", "wear coefficients of the comparison law", at="comparison"),
    _q("comparison_source", "", "", "source of the wear coefficients of the comparison law", at="comparison"),
    _q("comparison_warnings", "", "", "uncertain wear coefficients of the comparison law", at="comparison"),
    _q("comparison_form", "", "", "form of the comparison wear law", at="comparison"),
    _q("comparison_regime_name", "", "", "comparison wear law and its regime", "law after law",
       "comparison_regime"),
    _q("comparison_wear_depth", "d", "m", "wear depth by a comparison law", "what the law would have worn on "
       f"the contacts of the campaign, along the normal {_SINCE}; it changes no profile",
       "step wheel comparison point"),
    _q("comparison_worn_area", "A", "m2", "area worn off by a comparison law, by regime",
       "since the start; it changes no profile", "step wheel comparison_regime"),
)

_FATIGUE = _group("fatigue",
    _q("fatigue_name", "", "", "fatigue law", "in the order of the scene", "fatigue"),
    _q("fatigue_coefficients", "", "", "coefficients of the fatigue law", at="fatigue"),
    _q("fatigue_source", "", "", "source of the coefficients of the fatigue law", at="fatigue"),
    _q("fatigue_warnings", "", "", "uncertain coefficients of the fatigue law", at="fatigue"),
    _q("fatigue_form", "", "", "form of the fatigue law and its wear number", at="fatigue"),
    _q("fatigue_crack_width", "w", "m", "width of profile over which the damage of a passage counts as that "
       "of one place", at="fatigue", allowed=(0.1, 200)),
    _q("fatigue_crack_depth", "h", "m", "depth of a crack of damage 1, which wear removes", _MARGIN,
       "fatigue ?", allowed=(0.001, 100)),
    _q("fatigue_wear_limit", "d", "m", "depth that may wear, against which cracks are weighed", _MARGIN,
       "fatigue ?", allowed=(0.01, 100)),
    _q("fatigue_shear_yield", "k", "Pa", "yield stress of the wheel in cyclic shear",
       "missing where the law has none", "fatigue ?", allowed=(50, 1500)),
    _q("fatigue_damage", "D", "1", "fatigue damage", "at material points; what wear and reprofiling remove "
       "is taken off, and it is never below 0; of a law without depth of its cracks reprofiling takes all",
       "step wheel fatigue point", above=(0, 1000)),
    _q("fatigue_damage_rate", "dD/ds", "m-1", "fatigue damage per distance run, before removal by wear",
       f"{_ACTING}, without removal by wear but that in the law",
       "step wheel fatigue point", shown=("1/1000 km", 1e6)),
    _q("wear_depth_rate", "dd/ds", "m m-1", "wear depth per distance run",
       f"{_ACTING}, by the active law, before smoothing", _ALONG),
    _q("magic_wear_rate", "dd/ds", "m m-1", "magic wear rate: wear depth per distance run at which cracks "
       "just do not grow", _MARGIN, "step wheel fatigue point ?"),
    _q("life_limited_by", "", "", "what limits the life of the place at the rates of this row, from new",
       "cracks at damage 1, wear at the depth that may wear; missing as the magic wear rate is",
       "i4 step wheel fatigue point ?"),
    _q("fatigue_damage_passage", "D", "1", "fatigue damage of one passage of the patch",
       "neither weighted with the share of its operating point nor shared by the width of a place",
       _PATCH_LAW),
    _q("fatigue_index", "FI", "1", "fatigue index of the surface",
       f"largest of the patch; above 0 the surface ratchets; {_JUDGED}", _PATCH_LAW),
    _q("fatigue_index_stress", "|τ| − k", "Pa", "largest shear stress above the yield stress in cyclic shear",
       f"below 0 the margin to it; {_JUDGED}", _PATCH_LAW),
    _q("fatigue_index_force", "Tγ", "N", "wear number the fatigue law judges by",
       f"with or without spin, as the form of the law says; {_JUDGED}", _PATCH_LAW, shown=_NEWTON),
    _q("fatigue_index_y", "y", "m", "lateral position of the fatigue index on the wheel profile",
       "strip where the index is largest: of the whole patch the highest pressure, of the wear number the "
       f"most frictional work; {_LATERAL}", _PATCH_LAW),
    _q("subsurface_fatigue_index", "FIₛᵤᵦ", "Pa", "fatigue index below the surface", "to be compared with "
       "the equivalent shear limit of Dang Van of the steel; without residual stress", _PATCH),
    _q("wear_number_without_spin", "Tγ", "N", "wear number without spin",
       "force times creepage of both directions, magnitudes", _PATCH, shown=_NEWTON),
    _q("wear_number_with_spin", "P/V", "N", "wear number with spin, frictional work per distance",
       "forces and spin moment times creepages and spin", _PATCH, shown=_NEWTON),
)

_COUNTERFACE = _group("counterface",
    _q("counterface_name", "", "", "rail or roller that wears", at="wheel"),
    _q("counterface_profile_y", "y", "m", "lateral position of the worn rail or roller", _LATERAL, _BELOW),
    _q("counterface_profile_z", "z", "m", "height of the worn rail or roller",
       "positive down, 0 at the top when new; after redressing, if it is redressed in this row", _BELOW),
    _q("counterface_wear_depth", "d", "m", "wear depth of the rail or roller along its normal",
       f"at material points, {_REDRESSED}", _BELOW),
    _q("counterface_worn_area", "A", "m2", "area of the cross-section worn off the rail or roller",
       "since the start, without what redressing removes", _WHEEL),
    _q("counterface_max_wear_depth", "d", "m", "largest wear depth of the rail or roller", _REDRESSED,
       _WHEEL),
    _q("counterface_redressed_depth", "", "m", "depth redressed off the roller in all",
       "the least: its largest wear depth at each redressing", _WHEEL),
    _q("counterface_redressed_count", "", "1", "number of times the rollers were redressed",
       "since the start", "i4 step"),
    _q("counterface_redressed_at", "s", "m", "distance run when the rollers were last redressed",
       "0 before the first time", "step", shown=_KM),
)

_REPROFILING = _group("reprofiling",
    _q("wheel_template", "", "", "profile the wheel is reprofiled to", at="wheel"),
    _q("last_reprofiling", "n", "1", "step of the last reprofiling of the wheels",
       "its own number in the row of the reprofiled wheels, 0 before the first reprofiling", "i4 step"),
    _q("wheel_diameter", "D", "m", "wheel diameter at the running circle", at=f"{_WHEEL} ?",
       allowed=(200, 3000)),
)

_RUNNING = _group("running",
    _q("flange_friction", "μ", "1", "friction coefficient on the flange",
       "from a contact angle of 40 degrees on, linear from that of the tread at 20 degrees", _OP),
    _q("lateral_position", "y", "m", "lateral position of the wheelset",
       "positive to the right; found where a force is controlled, else the shift", _STATE),
    _q("wheel_loads", "Q", "N", "vertical load of the wheel",
       "found where the axle load is controlled, else as given", f"{_STATE} wheel"),
    _q("lateral_stiffness", "dH/dy", "N m-1", "lateral force over the lateral position where it runs",
       "0 where the shift is given", _STATE, shown=("kN/mm", 1e-6)),
    _q("lateral_force", "H", "N", "lateral force on the wheelset at axle height",
       f"{_TRACK}; what holds it against the contact forces, missing where they are not known",
       f"{_STATE} ?", allowed=(-600, 600)),
    _q("derailment_quotient", "Y/Q", "1", "lateral over vertical force of the wheel on the rail",
       "positive towards the field side", f"{_STATE} wheel ?"),
    _q("steering_moment", "M", "N m", "moment of the contact forces about the vertical axis",
       "turns x (rolling direction) towards y (right)", f"{_STATE} ?", shown=("kN m", 1e-3)),
    _q("axle_wear_number", "Tγ", "N", "frictional work of both wheels per distance", "with spin",
       f"{_STATE} ?", shown=_NEWTON),
    _q("wear_share", "", "1", "share of the operating point in the wear of both wheels",
       "by cross-section, of the points of this row, with their shares of the distance", _STATE),
)

_CHOICE = _group("choice",
    _q("contact_candidate", "", "", "contact models that may be chosen", "by rising cost", "candidate"),
    _q("contact_candidate_cost", "C", "1", "cost of one solution by the contact models, over that of the "
       "cheapest ones", "from the committed chart of speed against accuracy", "candidate"),
    _q("contact_class", "", "", "class of operating points", "by the share of the work that they do, least "
       "first", "contact_class"),
    _q("contact_point_class", "", "1", "place of the class of the operating point in contact_class",
       "points that only monitor belong to the last one", "i4 step operating_point"),
    _q("contact_models", "k", "1", "place of the contact models of the class in contact_candidate",
       at="i4 step contact_class"),
    _q("contact_models_error", "ε", "1", "error of the wear increment of the contact models when they were "
       "chosen", "largest difference from half-space solutions over the largest depth, estimated from a "
       "sample", "step"),
    _q("contact_candidate_error", "ε", "1", "error of the wear increment if the contact models solved all "
       "operating points", "when it was chosen; missing where they were not tried, or are not applicable to "
       "a point", "step candidate ?"),
)

_LEFT_OUT = _group("left_out",
    _q("operating_point_class", "", "", "block or class of the operating point", at=_OP),
    _q("left_out", "", "1", "whether the operating point had no contact solution and was left out of the "
       "step that led to this state", "1 left out, 0 not", "i4 step operating_point"),
    _q("left_out_share", "", "1", "share of the wear that the operating points left out of the step carry",
       "by their last rate, by the largest one of their block or class where they never had one", "step"),
    _q("last_wear_area_rate", "dA/ds", "m2 m-1", "worn area of both profiles per distance run when the "
       "operating point was last solved", "as if the wheelset ran in this operating point all the time: "
       "neither weighted with the share of the point nor multiplied by its environment factor; in a state "
       "before this one", "step operating_point ?"),
)

# of one solution: strips and cells of its patches, sections across the track
_FIELDS = (
    _q("lateral", "y", "m", "lateral position in the contact plane",
       f"from the pressure-weighted centre of the patch, {_TRACK}"),
    _q("strip_wheel_y", "y", "m", "position of the strip on the wheel profile", _LATERAL),
    _q("strip_wheel_y_edges", "y", "m", "edges of the strips on the wheel profile", _LATERAL),
    _q("strip_rail_y_edges", "y", "m", "edges of the strips on the rail or roller profile", _LATERAL),
    _q("strip_work", "e", "J m-2", "frictional work per area of the strip in one passage"),
    _q("cell_pressure", "p", "Pa", "contact pressure on the grid of the normal model"),
    _q("grid_lead", "x", "m", "leading end of the grid of the normal model", _FORWARD),
    _q("grid_trail", "x", "m", "trailing end of the grid of the normal model", _FORWARD),
    _q("strip_width", "Δy", "m", "width of a strip"),
    _q("longitudinal", "x", "m", "longitudinal position in the contact plane",
       f"from the contact line, {_FORWARD}"),
    _q("x_lead", "x", "m", "leading end of the strip", _FORWARD),
    _q("x_trail", "x", "m", "trailing end of the strip", _FORWARD),
    _q("cells_lead", "x", "m", "leading end of the strip's row of cells", _FORWARD),
    _q("cells_trail", "x", "m", "trailing end of the strip's row of cells", _FORWARD),
    _q("pressure", "p", "Pa", "contact pressure"),
    _q("shear_x", "τx", "Pa", "longitudinal shear stress", _ON_WHEEL),
    _q("shear_y", "τy", "Pa", "lateral shear stress", f"acting on the wheel, {_TRACK}"),
    _q("slip_x", "sx", "1", "longitudinal slip velocity over the speed", _FORWARD),
    _q("slip_y", "sy", "1", "lateral slip velocity over the speed", _TRACK),
    _q("slipping", "", "1", "whether the cell slips", "1 slip, 0 stick"),
    _q("work_density", "w", "Pa", "frictional work per area and distance run", shown=_INDEX),
    _q("section_y", "y", "m", "lateral position in the track",
       "from the origin line of the wheel profile at rest, positive to the right"),
    _q("section_z", "z", "m", "height in the track", "positive down, 0 at the top of the counterface"),
    _q("gap", "g", "m", "gap of the unloaded profiles along the normal", "0 at the initial contact",
       shown=_MICRON),
)

_PROFILE = (
    _q("rolling_radius_difference", "Δr", "m", "rolling radius difference",
       "right minus left wheel, over the lateral shift of the wheelset to the right"),
    _q("amplitude", "ŷ", "m", "amplitude of the lateral motion", allowed=(0.2, 15)),
    _q("back_to_back", "AR", "m", "back-to-back distance", allowed=(400, 2000)),
    _q("front_to_front", "SR", "m", "distance of the active flanks", "back to back and both Sd"),
    _q("wheel_diameter_difference", "ΔD", "m", "difference of the wheel diameters", "right minus left"),
    _q("rim_width", "BR", "m", "width of the rim", "from the flange back to the outer face"),
    _q("alignment_rms", "", "m", "rms distance left by the alignment on unworn parts", shown=_MICRON),
    _q("below_tip", "", "m", "depth of the upper point of qR below the flange tip", allowed=(0.5, 10)),
    _q("level", "", "m", "height of Sd and of the lower point of qR above the running circle",
       allowed=(2, 25)),
    _q("flange_back", "", "m", "distance of the running circle from the flange back", allowed=(50, 100)),
    _q("noise_wavelength", "", "m", "wavelength below which measured profiles are smoothed",
       allowed=(0.5, 50)),
)

_INPUT = (
    _q("wheel_radius", "r₀", "m", "wheel radius at the running circle", allowed=(100, 1500)),
    _q("roller_radius", "s₀", "m", "roller radius at its top", allowed=(50, 100_000)),
    _q("gauge", "", "m", "track gauge", "14 mm below the top", allowed=(500, 2000)),
    _q("half_span", "l", "m", "half the distance of the running circles", allowed=(250, 1100)),
    _q("inclination_ratio", "N", "1", "N of the rail inclination 1:N", allowed=(10, 100)),
    _q("curve_radius", "R", "m", "curve radius", "positive to the right; the range is that of its magnitude",
       shown=_METRE, allowed=(10, 1e6)),
    _q("axle_torque", "", "N m", "torque on the axle", "driving forward", allowed=(-50_000, 50_000)),
    _q("binning_error", "ε", "1", "largest difference of the wear of operating points and samples, over the "
       "largest depth", above=(0, 1)),
    _q("duration", "t", "s", "time", shown=("h", 1 / 3600.0), above=(0, 1e6)),
    _q("revolutions", "n", "1", "revolutions of the wheels", above=(0, 1e10)),
    _q("ramp_positions", "n", "1", "points of a ramp", allowed=(2, 200)),
    _q("wheelset_mass", "m", "kg", "mass of the wheelset", allowed=(1, 10_000)),
    _q("axle_box_distance", "2b", "m", "distance of the forces on both axle boxes", allowed=(100, 4000)),
    _q("axle_load", "W", "N", "vertical load of both wheels", allowed=(0.2, 600)),
    _q("friction_flange", "μ", "1", "friction coefficient on the flange",
       "from a contact angle of 40 degrees on, linear from that of the tread at 20 degrees", allowed=(0, 1)),
    _q("drift", "y'", "1", "lateral velocity of the wheelset over V", "positive to the right; the contact "
       "sees the yaw less the drift", allowed=(-0.1, 0.1)),
    _q("speed_difference", "ΔV/V", "1", "speed of the left roller less that of the right one",
       "over their mean; imitates a curve to the right to first order", shown=("%", 1e2), allowed=(-20, 20)),
    _q("youngs_modulus", "E", "Pa", "Young's modulus", _PER_MATERIAL, shown=_GIGA, allowed=(1, 1000)),
    _q("poisson_ratio", "ν", "1", "Poisson's ratio", _PER_MATERIAL, allowed=(0, 0.5)),
    _q("strips", "", "1", "smallest number of strips across a patch", allowed=(5, 512)),
    _q("cells", "", "1", "smallest number of cells along each strip", allowed=(5, 512)),
    _q("cell_size", "", "m", "largest width of a strip and length of a cell", allowed=(0.05, 1000)),
    _q("most_cells", "", "1", "largest number of strips, and of cells along each", allowed=(5, 512)),
    _q("virtual_penetration_factor", "", "1", "share of the approach that is virtual penetration",
       above=(0, 1)),
    _q("contact_tolerance", "", "1", "error of the wear increment over its largest depth", above=(0, 1)),
    _q("shift_std", "σ", "m", "standard deviation of the lateral shift", allowed=(0, 10)),
    _q("positions", "", "1", "lateral positions within 3 standard deviations", allowed=(10, 200)),
    _q("depth_cap", "", "m", "largest wear depth of one step", shown=_MICRON, allowed=(0.1, 200)),
    _q("first_depth", "", "m", "largest wear depth of the first step", shown=_MICRON, allowed=(0.01, 200)),
    _q("smoothing_wavelength", "", "m", "wavelength that smoothing halves", "0 for none", allowed=(0, 50)),
    _q("point_spacing", "", "m", "spacing of the profile's points", allowed=(0.05, 2)),
    _q("least_cut", "", "m", "least depth that reprofiling removes everywhere", allowed=(0, 20)),
    _q("counterface_wear_factor", "", "1", "wear depth of a roller in one passage over that of the wheel",
       above=(0, 100)),
    _q("counterface_area_rate", "", "m2 m-1", "area each rail's cross-section loses per distance run",
       above=(0, 1000)),
    _q("redress_distance", "", "m", "running after which rollers are redressed", shown=_KM,
       allowed=(0.01, 1e7)),
    _q("redress_depth", "", "m", "wear depth at which rollers are redressed", shown=_MICRON,
       allowed=(1, 20_000)),
    _q("density", "ρ", "kg m-3", "density of the wheel", allowed=(500, 25_000)),
    _q("seizure_blend", "", "1", "width of the blend into seizure over the hardness", allowed=(0, 0.4)),
    _q("hardness", "H", "Pa", "hardness of the wheel", shown=_GIGA, allowed=(0.1, 20)),
    _q("energy_coefficient", "", "m3 J-1", "volume lost per frictional work", above=(0, 1000)),
    _q("wear_number_start", "", "N", "wear number at which damage begins", shown=_NEWTON, allowed=(0, 1e5)),
    _q("wear_number_peak", "", "N", "wear number of the largest damage", shown=_NEWTON, above=(0, 1e5)),
    _q("wear_number_end", "", "N", "wear number from which damage is zero", shown=_NEWTON, above=(0, 1e6)),
    _q("peak_damage", "", "1", "largest damage of a passage", above=(0, 1)),
    _q("damage_floor", "", "1", "lowest damage beyond the end", allowed=(-1, 0)),
    _q("sweep_cases", "", "1", "cases of a latin_hypercube", allowed=(1, 100_000)),
    _q("sweep_seed", "", "1", "seed of a latin_hypercube", allowed=(0, 2**32 - 1)),
)
# fmt: on

_ROWS = (
    *_CAMPAIGN, *_CONTACT, *_COMPARISON, *_FATIGUE, *_COUNTERFACE, *_REPROFILING, *_RUNNING, *_CHOICE,
    *_LEFT_OUT, *_FIELDS, *_PROFILE, *_INPUT,
)  # fmt: skip

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({row.name: row for row in _ROWS})
"""All quantities by name."""
