"""Names of inputs of a scene in words, for tables, figures and sentences.

A name is what the description of the key begins with, or the words of this module where
that says too little alone. Of keys that several tables have, it states the table.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import xarray as xr

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.titles import law_title
from wearsim.quantities import QUANTITIES
from wearsim.scene.models import FieldScene, RigScene
from wearsim.table_layout import unit_of_key
from wearsim.toml_faults import meaning_of, model_path

# units at the end of keys as people read them
_READABLE = {
    "kNm": "kN m",
    "Nm": "N m",
    "um": "µm",
    "mm2/1000km": "mm²/1000 km",
    "mm3/kJ": "mm³/kJ",
    "kg/m3": "kg/m³",
}

_POINT_FILES = {
    "smooth_mm": "cut-off wavelength of profile smoothing",
    "format": "format of profile files",
    "units": "unit of profile files",
    "mirror": "mirroring of profile files",
    "z_up": "direction of z in profile files",
    "origin": "origin of y in profile files",
    "offset_y_mm": "offset of y in profile files",
    "offset_z_mm": "offset of z in profile files",
}
_WORDS: Mapping[str, str] = {
    **{
        f"{table}.{key}": f"{words} ({body})"
        for table, body in (
            ("wheelset", "wheels"),
            ("counterface", "counterface"),
            ("campaign.reprofiling", "reprofiling"),
        )
        for key, words in _POINT_FILES.items()
    },
    "wheelset.profile": "wheel profile",
    "wheelset.profile_left": "wheel profile on the left",
    "wheelset.at_km": "distance of the result that the wheels come from",
    "counterface.profile": "counterface profile",
    "counterface.profile_left": "counterface profile on the left",
    "counterface.ends": "ends of the counterface profile",
    "counterface.rig": "rig",
    "counterface.drive": "drive of the rollers",
    "contact.model": "contact models",
    "contact.friction_decrease_s_m": "decrease of friction with the slip velocity",
    "contact.rotation": "rule of the wheel rotation",
    "contact.roll": "rule of the wheelset roll",
    "contact.torque_Nm": "torque on the axle where no other is stated",
    "wear": "wear law with its coefficients",
    "wear.form": "form of the wear law",
    "wear.energy_coefficient_mm3_kJ": "energy coefficient of the wear law",
    "wear.seizure_cap": "cap that keeps out the seizure regime",
    "wear.brake_block.um_per_1000_km": "wear depth by the brake blocks in 1000 km",
    "wear.brake_block.from_mm": "edge of the brake blocks towards the flange",
    "wear.brake_block.to_mm": "edge of the brake blocks towards the field side",
    "wear.table.source": "source",
    "wear.table.certainty": "certainty",
    "wear.table.validity": "validity",
    "wear.table.materials": "materials",
    "wear.table.interpolation": "interpolation between rows",
    "wear.table.beyond": "rule beyond the last row",
    "wear.table.below": "rule below the first row",
    "wear.table_file": "file of the wear table",
    "wear.scale": "factor on the wear depth of the active law",
    "wear.also_evaluate.law": "law",
    "wear.also_evaluate.form": "form",
    "wear.also_evaluate.coefficients": "coefficients",
    "fatigue.branch": f"form of {law_title('wlrm')}",
    "fatigue.coefficients": "coefficients of the fatigue laws",
    "fatigue.wear_limit_mm": "wear depth that ends the life of the wheel",
    "fatigue.damage_function.source": "source",
    "fatigue.damage_function.certainty": "certainty",
    "operation.programme": "file of the rig programme",
    "operation.together": "all blocks in every wear step",
    "operation.block.name": "name",
    "operation.class.name": "name",
    "operation.block.distance_km": "distance per loop",
    "operation.block.duration_h": "time per loop",
    "operation.block.revolutions": "revolutions of the wheels per loop",
    "operation.block.positions": "lateral positions of the ramp",
    "operation.class.positions": "lateral positions",
    "campaign.max_step_km": "longest wear step",
    "campaign.smoothing_wavelength_mm": "wavelength of wear that smoothing halves",
    "campaign.limits.end": "end of the campaign",
    "campaign.reprofiling.at_limits": "limits at which the wheels are reprofiled",
    "campaign.reprofiling.at_km": "distances at which the wheels are reprofiled",
    "campaign.reprofiling.profile": "profile of reprofiled wheels",
    "programme.guard": "largest ratio of the contact's severity to that of the field",
    "programme.ramps": "ramps among the blocks",
    "programme.lateral_force_kN": "largest lateral force to either side",
    "recorded.shift_positive": "side of positive shifts",
    "recorded.yaw_positive": "side of positive yaw",
    "recorded.curve_positive": "side of positive curves",
    "recorded.lateral_force_positive": "side of positive lateral forces",
    "vehicle.file": "vehicle",
    "vehicle.axle": "axle of the bogie that is computed",
    "vehicle.tangent": "motion of the wheelset on straight track",
    "vehicle.positions": "lateral positions on each class of the route",
    "vehicle.route": "route of the vehicle",
    "vehicle.tangent_wavelength_m": "wavelength of the motion on straight track",
    "vehicle.class.name": "name",
    "vehicle.class.cant_deficiency_mm": "cant deficiency",
    "vehicle.each.lubricated_share": "share of the distance with a lubricated flange",
    "vehicle.class.lubricated_share": "share of the distance with a lubricated flange",
    **{
        f"{table}.rails.{key}": words
        for table in ("vehicle.each", "vehicle.class")
        for key, words in (
            ("share", "share of the distance"),
            ("profile", "profile"),
            ("profile_left", "profile on the left"),
            ("inclination", "inclination"),
        )
    },
    "vehicle.class.axle_torques.axle_torque_kN_m": "value",
    "vehicle.class.axle_torques.share": "share of the distance",
}
"""Words of keys, without what selects an entry of a list, whose descriptions begin with
something else or with too little.
"""

_TABLES: Mapping[str, str] = {
    "wear.table": "wear table",
    "fatigue.damage_function": "damage function",
    "operation.monitor": "monitored points",
    "campaign.limits": "limit",
    "programme": "programme",
    "recorded": "record",
    "vehicle.each": "each class of the route",
}
"""What stands in brackets after the words of keys that other tables have, too."""

_LISTS: Mapping[str, str] = {
    "operation.block": "block",
    "operation.class": "class",
    "vehicle.class": "route class",
    "rails": "rails",
    "axle_torques": "axle torque",
    "also_evaluate": "comparison law",
}
"""Words for an entry of a list of tables; its number or its name follows."""

_COLUMNS = "recorded.columns"


def input_title(name: str) -> str:
    """Name of an uncertain input in words, if it is a key.

    Names are those of dimensions: a key may have the campaign behind it, or before it.
    A name that the user gave is returned as it is.
    """
    key, comma, campaign = name.partition(", ")
    parts = key.split(".")
    if len(parts) > 1 and parts[0] in ("rig", "field"):
        comma, campaign = ", ", parts.pop(0)
    words = _words(parts)
    return f"{words}{comma}{campaign}" if words else name


def input_heading(name: str) -> str:
    """Name of an uncertain input in words, with a capital unless the user wrote it."""
    title = input_title(name)
    return name if title == name else title[:1].upper() + title[1:]


def input_unit(key: str) -> str:
    """Give the unit of the values of a key, as people read it, "" without one."""
    if key.endswith("um_per_1000_km"):
        return _READABLE["um"]
    return "" if _COLUMNS in key else _readable(unit_of_key(key))


def input_value(key: str, value: str) -> str:
    """Write a text that a key has as people read it: laws by their titles."""
    return law_title(value) if key.rpartition(".")[2] == "law" else value


def _readable(unit: str) -> str:
    return _READABLE.get(unit, unit)


def titled(dataset: xr.Dataset) -> xr.Dataset:
    """Bands or posterior with its uncertain inputs named in words."""
    names = dataset["input_name"]
    return dataset.assign(
        input_name=names.copy(data=[input_title(str(name)) for name in names.values])
    )


def _words(parts: Sequence[str]) -> str:
    """Words for the parts of a key, "" if they are none of a scene."""
    if parts[:2] == ["wear", "values"] and len(parts) == 3:
        symbol = parts[2].replace("_", " ")
        return f"coefficient {symbol} of {_law_of(parts[2])}"
    if parts[:2] == ["fatigue", "coefficients"] and len(parts) == 3:
        return f"coefficients of {law_title(parts[2])}"
    for path, meaning in _located(parts):
        keys = [item for item in path if isinstance(item, str)]
        if words := _of_key(keys, meaning):
            return " of ".join([words, *_entries(path, parts)])
    return ""


def _located(parts: Sequence[str]) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Places of a key in the models of scenes, and what they say about it.

    Where an entry of a list is selected, the place has 0.
    """
    tables = [list(parts)]
    if parts[0] == "operation" and len(parts) == 2:  # of every block or class
        every = ("operation.block", "operation.class", "vehicle.class")
        tables += [[*table.split("."), parts[1]] for table in every]
    for keys in tables:
        for model in (RigScene, FieldScene):
            path = tuple(
                0 if str(key).isdigit() else key for key in model_path(model, keys)
            )
            if ".".join(item for item in path if isinstance(item, str)) in _WORDS:
                yield path, ""
            elif meaning := meaning_of(model, keys):
                yield path, meaning


def _of_key(keys: Sequence[str], meaning: str) -> str:
    """Words for a key without entries of lists, from its meaning; "" for tables."""
    key, table = ".".join(keys), ".".join(keys[:-1])
    if len(keys) < 2 and key not in _WORDS:
        return ""
    if keys[-1] in QUANTITIES:
        meaning = QUANTITIES[keys[-1]].meaning
    begin = re.split(r"[,;:(]|\. ", meaning.removeprefix("the "))[0].strip()
    words = _WORDS.get(key, begin)
    if table == _COLUMNS:
        unit = unit_of_key(key)
        return f"column of the {words}" + (f" in {_readable(unit)}" if unit else "")
    return f"{words} ({_TABLES[table]})" if table in _TABLES else words


def _entries(path: Sequence[str | int], parts: Sequence[str]) -> list[str]:
    """Words for the entries of lists that a key selects, the innermost first."""
    entries: list[str] = []
    for place, item in enumerate(path):
        if item != 0:
            continue
        lists = [
            word
            for table, word in _LISTS.items()
            if ".".join(map(str, path[:place])).endswith(table)
        ]
        entries.insert(0, f"{lists[0]} {parts[place]}" if lists else parts[place])
    return entries


def _law_of(symbol: str) -> str:
    """Name the laws of which a coefficient is; the wear law if none is known."""
    laws = dict.fromkeys(
        law_title(law)
        for coefficients in COEFFICIENT_SETS.values()
        if symbol in coefficients.values
        for law in coefficients.laws
    )
    return f"the law {' or '.join(laws)}" if laws else "the wear law"
