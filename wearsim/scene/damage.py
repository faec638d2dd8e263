"""[wear] and [fatigue] of a scene file, and settings of damage laws they stand for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema

from wearsim.contact.normal import NORMAL_MODELS
from wearsim.contact.patch import FloatArray
from wearsim.contact.tangential import TANGENTIAL_MODELS
from wearsim.damage import fatigue, wear
from wearsim.damage.coefficients import (
    COEFFICIENT_SETS,
    CoefficientSet,
    coefficient_set,
)
from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.damage.fatigue.wlrm import own_function
from wearsim.damage.wear import WEAR_LAWS, WearSettings, energy
from wearsim.damage.wear.law import WearLaw
from wearsim.damage.wear.table import WearTable
from wearsim.errors import SceneError
from wearsim.scene.section import Registered, Section, Text, quantity, text_field
from wearsim.scene.wear_table import PathFaults, WearTableSection, wear_table
from wearsim.toml_faults import KeyPath, cross_check


def _sets_of(laws: Mapping[str, Any]) -> Registered:
    """Return names of the coefficient sets that belong to some laws."""
    return Registered(
        COEFFICIENT_SETS, lambda coefficients: bool(set(laws) & set(coefficients.laws))
    )


_WEAR_LAW = Registered(WEAR_LAWS)
WearLawName = Annotated[str, _WEAR_LAW]
WearSetName = Annotated[str, _sets_of(WEAR_LAWS)]
FatigueLawName = Annotated[str, Registered(FATIGUE_LAWS)]
FatigueSetName = Annotated[str, _sets_of(FATIGUE_LAWS)]


class ComparisonLawSection(Section):
    """Entry of also_evaluate: a wear law with its own form and set, or the law's name
    alone.
    """

    law: WearLawName = Field(description="the wear law")
    form: Literal["local", "patch_mean"] | None = Field(
        None,
        description="whether the law acts in each cell (where it can) or on the mean "
        "of the patch",
    )
    coefficients: WearSetName | None = Field(
        None, description="the set of wear coefficients"
    )

    @model_validator(mode="before")
    @classmethod
    def _of_a_name(cls, data: Any) -> Any:
        """Take the name of a law for a table with that law."""
        if not isinstance(data, str):
            return data
        return {"law": _WEAR_LAW.check(data)}

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> Any:
        """Give a law without form and set as its name."""
        return (
            self.law
            if self.form is None and self.coefficients is None
            else handler(self)
        )


class _OrName:
    """Says in the schema that the name of a law stands for a table."""

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Any:
        return {
            "anyOf": [{"type": "string", "enum": sorted(WEAR_LAWS)}, handler(schema)]
        }


class BrakeBlockSection(Section):
    """[wear.brake_block]: what brake blocks wear off the tread, counted in the first
    regime of each law.
    """

    um_per_1000_km: float = quantity(
        "brake_wear", meaning="the depth worn by the blocks in 1000 km"
    )
    from_mm: float = quantity(
        "block_edge",
        meaning="the edge of the block towards the flange, from the running circle",
    )
    to_mm: float = quantity(
        "block_edge", meaning="its edge towards the field side, from the running circle"
    )

    @model_validator(mode="after")
    def _check_edges(self) -> Self:
        if self.to_mm <= self.from_mm:
            text = (
                f"to_mm = {self.to_mm:g} must be above from_mm = {self.from_mm:g}; "
                "exchange them"
            )
            raise cross_check(text, "to_mm")
        return self

    def depth(self, y: FloatArray) -> FloatArray:
        """Depth per distance at vertices of a wheel [m/m]."""
        under_block = (y >= 1e-3 * self.from_mm) & (y <= 1e-3 * self.to_mm)
        return np.where(under_block, 1e-12 * self.um_per_1000_km, 0.0)


class WearSection(Section):
    """[wear]: the law of the wear depth by frictional work."""

    not_here: ClassVar[dict[str, str]] = {
        "beside": "the comparison laws are the key also_evaluate; rename it",
    }
    law: WearLawName = Field(WearSettings.law, description="the wear law")
    coefficients: WearSetName | None = Field(
        None,
        description="the set of wear coefficients, named after its paper; each law "
        "has one of its own",
    )
    form: Literal["local", "patch_mean"] | None = Field(
        None,
        description="whether the law acts in each cell (where it can) or on the mean "
        "of the patch",
    )
    energy_coefficient_mm3_kJ: float | None = quantity(
        "energy_coefficient",
        None,
        "the volume lost per frictional work, one constant in place of a set (law = "
        f"{WEAR_LAWS.that_take('energy_coefficient')})",
    )
    density_kg_m3: float = quantity("wheel_density", 7850.0)
    hardness_GPa: float | None = quantity(
        "hardness",
        None,
        "the hardness of the wheel, in place of that of the set (law = "
        f"{WEAR_LAWS.that_take('hardness')})",
    )
    seizure_blend: float | None = quantity(
        "seizure_blend",
        None,
        "the width of the blend into seizure over the hardness, in place of that of "
        f"the set, 0 for a jump (law = {WEAR_LAWS.that_take('seizure_blend')})",
    )
    seizure_cap: Literal["none", "pressure", "regime"] = Field(
        "none",
        description="what keeps elastic pressures out of the seizure regime (law = "
        f"{WEAR_LAWS.that_take('seizure_cap')})",
    )
    brake_block: BrakeBlockSection | None = None
    table: WearTableSection | None = None
    table_file: Text | None = text_field(
        f"a CSV or TOML file with the table of law = {WEAR_LAWS.that_take('table')}",
        None,
    )
    values: dict[str, float] | None = Field(
        None,
        description="values in place of those of the coefficient set, by their names, "
        "in its units",
    )
    scale: float = quantity(
        "wear_scale",
        1.0,
        "the factor on depths of the active law, such as from a calibration",
    )
    also_evaluate: tuple[Annotated[ComparisonLawSection, _OrName], ...] = Field(
        (),
        description="comparison laws: further wear laws evaluated on the same contacts",
        max_length=20,
        strict=False,
    )

    @model_validator(mode="before")
    @classmethod
    def _defaults_of_the_law(cls, data: Any) -> Any:
        """Write in what the law takes where nothing is given.

        So that every output shows what acts.
        """
        law = data.get("law", WearSettings.law) if isinstance(data, dict) else None
        if not isinstance(law, str) or law not in WEAR_LAWS:
            return data
        named = (
            None if "energy_coefficient_mm3_kJ" in data else WEAR_LAWS[law].coefficients
        )
        defaults = {"coefficients": named, "form": WEAR_LAWS[law].forms[0]}
        return {
            **{key: value for key, value in defaults.items() if value is not None},
            **data,
        }


class DamageFunctionSection(Section):
    """[fatigue.damage_function]: break points of one's own for a law of T-gamma."""

    source: Text = text_field("where the break points come from")
    certainty: Text = text_field("how sure they are, in words")
    start_N: float = quantity("wear_number_start")
    peak_N: float = quantity("wear_number_peak")
    end_N: float = quantity(
        "wear_number_end", meaning="the wear number at which damage is zero again"
    )
    peak_damage: float = quantity("peak_damage")
    floor: float | None = quantity("damage_floor", None)


class FatigueSection(Section):
    """[fatigue]: rolling contact fatigue of the wheel."""

    laws: tuple[FatigueLawName, ...] = Field(
        ("surface_fatigue_index",),
        description="the fatigue laws",
        min_length=1,
        max_length=20,
        strict=False,
    )
    coefficients: tuple[FatigueSetName, ...] = Field(
        (),
        description="sets that replace the laws' own ones",
        max_length=20,
        strict=False,
    )
    shear_yield_MPa: float | None = quantity("fatigue_shear_yield", None)
    wear_number: Literal["without_spin", "with_spin"] = Field(
        "without_spin", description="the wear number that laws of T-gamma take"
    )
    branch: Literal["net", "rising"] = Field(
        "net",
        description=f"the form of law = {FATIGUE_LAWS.that_take('branch')}: with the "
        "removal of cracks by wear in it, or without",
    )
    crack_depth_mm: float | None = quantity("fatigue_crack_depth", None)
    crack_width_mm: float = quantity("fatigue_crack_width", 10.0)
    wear_limit_mm: float = quantity("fatigue_wear_limit", 3.0)
    damage_function: DamageFunctionSection | None = None


def wear_settings(
    section: WearSection, table: WearTable | None = None
) -> tuple[WearSettings, ...]:
    """Return settings of the active wear law, then of the comparison laws, in SI units.

    A comparison law without form takes that of the active law where it has it, one
    without set its own, or that of the active law where it is the same law.

    Parameters
    ----------
    section : WearSection
        Without faults.
    table : WearTable, optional
        Of `table_file`, if it names one.
    """
    if table is None and section.table is not None:
        table = wear_table(section.table, "wear.table")[0]
    entries = [
        (section.law, None),
        *((entry.law, entry) for entry in section.also_evaluate),
    ]
    return tuple(_settings(section, law, table, entry) for law, entry in entries)


def _settings(
    section: WearSection,
    law: str,
    table: WearTable | None,
    entry: ComparisonLawSection | None,
) -> WearSettings:
    record, active = WEAR_LAWS[law], law == section.law
    values = section.si()
    taken = {"hardness", "seizure_blend", "seizure_cap"} & {*record.parameters}
    acts = active and (entry is None or entry.coefficients is None)
    coefficients = _coefficients(section, record, table, entry)
    form = section.form if active or section.form in record.forms else None
    return WearSettings(
        law=law,
        coefficients=coefficients or "",
        form=(entry and entry.form) or form or record.forms[0],
        density=section.density_kg_m3,
        values=tuple((section.values or {}).items()) if acts else (),
        scale=section.scale if acts else 1.0,
        **{key: values[key] for key in taken & values.keys()},
    )


def _coefficients(
    section: WearSection,
    law: WearLaw,
    table: WearTable | None,
    entry: ComparisonLawSection | None,
) -> str | CoefficientSet | None:
    """Coefficients of a law: of the table, of its entry, of the scene, or its own."""
    if "table" in law.parameters:
        return table
    if entry is not None and entry.coefficients is not None:
        return entry.coefficients
    if law.name != section.law:
        return law.coefficients
    stated = section.energy_coefficient_mm3_kJ
    if stated and "energy_coefficient" in law.parameters:
        source = "energy_coefficient_mm3_kJ as given in the scene"
        return energy.constant(1e-12 * stated, source)
    return section.coefficients or law.coefficients


def slip_warnings(
    section: WearSection, table: WearTable | None, tangential: str
) -> Iterator[tuple[KeyPath, str]]:
    """Path and text of each law that trusts the slip of single cells.

    More than the tangential model can.
    """
    if TANGENTIAL_MODELS[tangential].bounded_slip:
        return
    for k, settings in enumerate(wear_settings(section, table)):
        if settings.form == "local" and WEAR_LAWS[settings.law].by_slip(
            settings.coefficients
        ):
            key, fix = "law", 'form = "patch_mean" in [wear]'
            if k > 0:
                key, fix = (
                    "also_evaluate",
                    f'{{law = "{settings.law}", form = "patch_mean"}}',
                )
            text = (
                f"{key}: local {settings.law} takes its coefficient from the sliding "
                f"speed of each cell, which {tangential} overrates at the trailing "
                "edge: up to 3 times too much wear at small angles of attack, another "
                f'share elsewhere; give {fix}, or model = "standard" or "accurate" in '
                "[contact]"
            )
            yield ("wear", key), text


def pressure_warnings(
    section: FatigueSection | None, normal: str
) -> Iterator[tuple[KeyPath, str]]:
    """Path and text of fatigue under pressures of a normal model too low."""
    if section is not None and NORMAL_MODELS[normal].underrates_pressure:
        text = (
            f"the largest pressures of {normal} are 16 % low in the median "
            "(reports/contact_accuracy.md), and shakedown and fatigue indices with "
            'them; write model = "standard" in [contact]'
        )
        yield ("fatigue",), text


def fatigue_settings(section: FatigueSection | None) -> tuple[FatigueSettings, ...]:
    """Return settings of all fatigue laws of a section without faults, in SI units."""
    return (
        () if section is None else tuple(_fatigue(section, law) for law in section.laws)
    )


def _fatigue(section: FatigueSection, law: str) -> FatigueSettings:
    record = FATIGUE_LAWS[law]
    damage_function = section.damage_function
    depth = section.crack_depth_mm
    named = [
        name for name in section.coefficients if law in COEFFICIENT_SETS[name].laws
    ]
    coefficients: str | CoefficientSet = named[0] if named else record.coefficients
    if damage_function is not None and "damage_function" in record.parameters:
        coefficients = own_function(
            **{key.removesuffix("_N"): value for key, value in damage_function}
        )
    if section.shear_yield_MPa is not None and "shear_yield" in record.parameters:
        own_set = coefficient_set(coefficients, law)
        coefficients = own_set.with_value(
            "shear_yield", section.shear_yield_MPa, "yield stress as given"
        )
    return FatigueSettings(
        law=law,
        coefficients=coefficients,
        wear_number=section.wear_number,
        branch=section.branch if "branch" in record.parameters else "net",
        crack_depth=1e-3 * depth
        if depth is not None and "crack_depth" in record.parameters
        else None,
        crack_width=1e-3 * section.crack_width_mm,
        wear_limit=1e-3 * section.wear_limit_mm,
    )


def damage_faults(
    section: WearSection, fatigue_section: FatigueSection | None
) -> PathFaults:
    """Return what does not fit together within [wear] and [fatigue].

    Paths of keys, and messages.
    """
    faults: PathFaults = [
        (("wear", *path), message) for path, message in _wear_faults(section)
    ]
    if fatigue_section is not None:
        fatigue_faults = list(_fatigue_key_faults(fatigue_section)) or _fatigue_faults(
            fatigue_section
        )
        faults += [(("fatigue", *path), message) for path, message in fatigue_faults]
    return faults


_OWN_KEYS = {"hardness": "hardness_GPa", "seizure_blend": "seizure_blend"}
"""Values of coefficient sets that have a key of their own in [wear]."""
_Faults = Iterator[tuple[tuple[str | int, ...], str]]
_PARAMETERS = {
    "energy_coefficient_mm3_kJ": "energy_coefficient",
    "hardness_GPa": "hardness",
    "seizure_blend": "seizure_blend",
    "seizure_cap": "seizure_cap",
    "table": "table",
    "table_file": "table",
}
"""Keys of [wear] that only some laws take, with the parameter of the law."""


def _wear_faults(section: WearSection) -> _Faults:
    """Faults between the keys of [wear]; the active law comes first in `laws`."""
    laws = wear_settings(section)
    given = {key for key in _PARAMETERS if getattr(section, key) not in (None, "none")}
    if section.table is not None:
        for path, message in wear_table(section.table, "wear.table")[1]:
            yield ("table", *path), message
    yield from _comparison_faults(section, laws)
    yield from _parameter_faults(section, laws, given)
    yield from _table_faults(laws, given)
    if _has_parameter(laws[0], "table"):
        yield from _table_conflicts(section)
    else:
        yield from _coefficient_faults(section, laws[0], given)


def _has_parameter(law: WearSettings, parameter: str) -> bool:
    return parameter in WEAR_LAWS[law.law].parameters


def _messages(settings: WearSettings) -> list[str]:
    try:
        wear.coefficients_of(settings)
    except SceneError as error:
        return [fault.message for fault in error.faults]
    return []


def _comparison_faults(section: WearSection, laws: Sequence[WearSettings]) -> _Faults:
    """Faults of the entries of also_evaluate: given twice, or without coefficients."""
    alike = [
        (
            law.law,
            law.form,
            _has_parameter(law, "table") or law.coefficients,
            law.values,
            law.scale,
        )
        for law in laws
    ]
    for k, entry in enumerate(section.also_evaluate, start=1):
        path = ("also_evaluate", k - 1)
        named = f'also_evaluate[{k - 1}] = "{entry.law}"'
        if alike[k] in alike[:k]:
            what = "given twice" if alike[k] in alike[1:k] else "the active law"
            fix = "delete it, or give it another form or other coefficients"
            yield path, f"{named} is {what}; {fix}"
        elif not _has_parameter(laws[k], "table"):
            yield from ((path, f"{named}: {message}") for message in _messages(laws[k]))
        elif entry.coefficients is not None:
            text = (
                f'{named} with coefficients = "{entry.coefficients}": a table has its '
                "own numbers; delete coefficients"
            )
            yield path, text


def _parameter_faults(
    section: WearSection, laws: Sequence[WearSettings], given: Collection[str]
) -> _Faults:
    """Faults of keys that none of the laws takes."""
    for key, parameter in _PARAMETERS.items():
        takers = laws[:1] if parameter == "energy_coefficient" else laws
        if key in given and not any(_has_parameter(law, parameter) for law in takers):
            fitting = WEAR_LAWS.that_take(parameter)
            text = (
                f'{key} acts with law = {fitting} only, not with "{section.law}"; '
                "delete it, or change the law"
            )
            yield (key,), text


def _table_faults(laws: Sequence[WearSettings], given: Collection[str]) -> _Faults:
    """Faults of a wear table that is given twice, or missing."""
    if "table" in given and "table_file" in given:
        yield ("table_file",), "table_file and [wear.table] are both given; delete one"
    elif "table" not in given and "table_file" not in given:
        for k, law in enumerate(laws):
            if _has_parameter(law, "table"):
                key = "also_evaluate" if k else "law"
                fix = "give [wear.table] or table_file"
                yield (key,), f'{key}: "{law.law}" needs its table; {fix}'
                return


def _table_conflicts(section: WearSection) -> _Faults:
    """Faults of numbers in place of those of the table of the active law."""
    if section.coefficients is not None:
        named = f'coefficients = "{section.coefficients}"'
        text = f'{named}: law = "{section.law}" has its own numbers; delete it'
        yield ("coefficients",), text
    if section.values:
        text = (
            f'values: law = "{section.law}" has the numbers of its table; delete '
            "[wear.values], change the table"
        )
        yield ("values",), text


def _coefficient_faults(
    section: WearSection, law: WearSettings, given: Collection[str]
) -> _Faults:
    """Faults of the coefficients of the active law, and of values in place of them."""
    constant, values = "energy_coefficient_mm3_kJ", section.values or {}
    two_given = constant in given and section.coefficients is not None
    if two_given and _has_parameter(law, "energy_coefficient"):
        named = f'coefficients = "{section.coefficients}"'
        yield (constant,), f"{constant} and {named} are both given; delete one"
    with_own_key = [symbol for symbol in values if symbol in _OWN_KEYS]
    for symbol in with_own_key:
        text = f"{symbol} has a key of its own; write {_OWN_KEYS[symbol]} in [wear]"
        yield ("values", symbol), text
    for message in () if with_own_key else _messages(law):
        word = message.split(" ", 1)[0]
        if word in values:
            yield ("values", word), message
        else:
            key = word if word in ("coefficients", "form", "values") else "law"
            yield (key,), message


def _fatigue_faults(section: FatigueSection) -> _Faults:
    for law in section.laws:
        try:
            fatigue.coefficients_of(_fatigue(section, law))
        except SceneError as error:
            for message in (fault.message for fault in error.faults):
                key = "crack_depth_mm" if section.crack_depth_mm else "branch"
                key = (
                    "damage_function" if message.startswith("damage_function") else key
                )
                yield (key,), message.replace("crack_depth", "crack_depth_mm")


def _fatigue_key_faults(section: FatigueSection) -> _Faults:
    laws, named = section.laws, dict[str, str]()
    for k, law in enumerate(laws):
        if law in laws[:k]:
            yield ("laws", k), f'laws[{k}] = "{law}" is given twice; delete it'
    for k, name in enumerate(section.coefficients):
        set_laws = COEFFICIENT_SETS[name].laws
        fitting, what = [law for law in laws if law in set_laws], ""
        if not fitting:
            what = (
                f"belongs to {', '.join(set_laws)}, of which laws has none; delete it"
            )
        elif fitting[0] in named:
            what = f'and "{named[fitting[0]]}" both belong to {fitting[0]}; delete one'
        elif (
            section.damage_function is not None
            and "damage_function" in FATIGUE_LAWS[fitting[0]].parameters
        ):
            what = "and [fatigue.damage_function] both give break points; delete one"
        if what:
            yield ("coefficients", k), f'coefficients[{k}] = "{name}" {what}'
        named.update(dict.fromkeys(fitting, name))
    changed = {
        key
        for key, info in type(section).model_fields.items()
        if getattr(section, key) != info.default
    }
    for key in (
        "damage_function",
        "branch",
        "crack_depth_mm",
        "wear_number",
        "shear_yield_MPa",
    ):
        parameter = key.removesuffix("_mm").removesuffix("_MPa")
        if key in changed and not any(
            parameter in FATIGUE_LAWS[law].parameters for law in laws
        ):
            takers = FATIGUE_LAWS.that_take(parameter)
            yield (key,), f"{key} acts with {takers} among the laws only; delete it"
    if "wear_limit_mm" in changed and section.crack_depth_mm is None:
        text = (
            "wear_limit_mm acts with crack_depth_mm only; give that too, or delete it"
        )
        yield ("wear_limit_mm",), text
