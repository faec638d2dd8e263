"""[wear] and [fatigue] of a scene file, and the settings of damage laws they stand for."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    Strict,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema

from wearsim.damage import fatigue
from wearsim.damage.coefficients import FATIGUE_SETS, CoefficientSet
from wearsim.damage.fatigue import FatigueSettings
from wearsim.damage.fatigue.wlrm import own_function
from wearsim.damage.wear import DEFAULT_COEFFICIENTS, WEAR_FORMS, WearSettings, acting_coefficients, energy
from wearsim.damage.wear.table import WearTable
from wearsim.damage.wear.table_file import TableFault, wear_table
from wearsim.errors import SceneError
from wearsim.scene.section import Registered, Section, Text, number, words

WearLawName = Annotated[str, Registered("wearsim.damage.wear", "WEAR_LAWS")]
WearSetName = Annotated[str, Registered("wearsim.damage.coefficients", "COEFFICIENT_SETS")]
FatigueLawName = Annotated[str, Registered("wearsim.damage.fatigue", "FATIGUE_LAWS")]
FatigueSetName = Annotated[str, Registered("wearsim.damage.coefficients", "FATIGUE_SETS")]
Column = Annotated[tuple[float, ...], Strict(False)]


def column(meaning: str, unit: str) -> Any:
    """Field of a column of a table that may be missing."""
    extra: Any = {"unit": unit}
    return Field(None, min_length=1, max_length=10000, description=meaning, json_schema_extra=extra)


class WearTableSection(Section):
    """[wear.table]: a wear law of one's own, one index column or two and one column of the wear rate."""

    source: Text = words("where the table comes from")
    certainty: Text = words("how sure it is, in words")
    validity: Text | None = words("what it holds for", None)
    materials: Text | None = words("wheel and rail, and the state of their surfaces", None)
    interpolation: Literal["linear", "step"] = Field(description="what holds between the rows")
    beyond: Literal["hold", "slope"] = Field(description="what holds beyond the last row")
    below: Literal["proportional", "hold", "zero"] | None = Field(
        None, description="what holds below the first row, where that is above 0"
    )
    hardness_GPa: float | None = number("hardness", "the hardness of the wheel", None)
    T_gamma_A_N_mm2: Column | None = column("frictional work per area and distance", "N/mm2")
    power_density_W_mm2: Column | None = column("frictional power per area", "W/mm2")
    slip_speed_m_s: Column | None = column("the sliding speed", "m/s")
    pressure_MPa: Column | None = column("the contact pressure", "MPa")
    mass_rate_ug_m_mm2: Column | None = column("mass lost per distance and area", "ug/m/mm2")
    energy_coefficient_mm3_kJ: Column | None = column("volume lost per frictional work", "mm3/kJ")
    wear_coefficient: Column | None = column("Archard's coefficient", "")


class BesideSection(Section):
    """Entry of beside: a wear law with its own form and set, or the law's name alone."""

    law: WearLawName = Field(description="the wear law")
    form: Literal["local", "patch_mean"] | None = Field(
        None, description="whether the law acts in each cell (where it can) or on the mean of the patch"
    )
    coefficients: WearSetName | None = Field(None, description="the set of wear coefficients")

    @model_validator(mode="before")
    @classmethod
    def _of_a_name(cls, data: Any) -> Any:
        """Take the name of a law for a table with that law."""
        if not isinstance(data, str):
            return data
        return {"law": Registered("wearsim.damage.wear", "WEAR_LAWS").check(data)}

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> Any:
        """Give a law without form and set as its name."""
        return self.law if self.form is None and self.coefficients is None else handler(self)


class _OrName:
    """Tells in the schema that the name of a law stands for a table."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> Any:
        names = Registered("wearsim.damage.wear", "WEAR_LAWS").names()
        return {"anyOf": [{"type": "string", "enum": names}, handler(schema)]}


class WearSection(Section):
    """[wear]: the law that turns frictional work into depth."""

    law: WearLawName = Field("usfd", description="the wear law")
    coefficients: Annotated[str, Registered("wearsim.damage.coefficients", "COEFFICIENT_SETS")] | None = (
        Field(
            None,
            description="the set of wear coefficients, named after its paper; each law has one of its own",
        )
    )
    form: Literal["local", "patch_mean"] | None = Field(
        None, description="whether the law acts in each cell (where it can) or on the mean of the patch"
    )
    energy_coefficient_mm3_kJ: float | None = number(
        "energy_coefficient",
        'the volume lost per frictional work, one constant in place of a set (law = "energy")',
        None,
    )
    density_kg_m3: float = number("density", "the density of the wheel", 7850.0)
    hardness_GPa: float | None = number(
        "hardness", 'the hardness of the wheel, in place of that of the set (law = "archard")', None
    )
    seizure_cap: Literal["none", "pressure", "regime"] = Field(
        "none", description='what keeps elastic pressures out of the seizure regime (law = "archard")'
    )
    table: WearTableSection | None = None
    table_file: Text | None = words('a CSV or TOML file with the table of law = "table"', None)
    beside: Annotated[tuple[Annotated[BesideSection, _OrName], ...], Strict(False)] = Field(
        (), max_length=20, description="wear laws evaluated on the same contacts beside the leading one"
    )

    @model_validator(mode="before")
    @classmethod
    def _own_of_the_law(cls, data: Any) -> Any:
        """Write in what the law takes where nothing is given, so that every output shows what acts."""
        if not isinstance(data, dict):
            return data
        law = data.get("law", "usfd")
        if not isinstance(law, str) or law not in WEAR_FORMS:
            return data
        named = None if "energy_coefficient_mm3_kJ" in data else DEFAULT_COEFFICIENTS.get(law)
        own = {"coefficients": named, "form": WEAR_FORMS[law][0]}
        return {**{key: value for key, value in own.items() if value is not None}, **data}


class DamageFunctionSection(Section):
    """[fatigue.damage_function]: break points of one's own for law = "wlrm"."""

    source: Text = words("where the break points come from")
    certainty: Text = words("how sure they are, in words")
    start_N: float = number("wear_number_start", "the wear number at which damage begins")
    peak_N: float = number("wear_number_peak", "the wear number of the largest damage")
    end_N: float = number("wear_number_end", "the wear number at which damage is zero again")
    peak_damage: float = number("peak_damage", "the largest damage of a passage")
    floor: float | None = number("damage_floor", "the lowest damage beyond the end", None)


class FatigueSection(Section):
    """[fatigue]: rolling contact fatigue of the wheel."""

    laws: Annotated[tuple[FatigueLawName, ...], Strict(False)] = Field(
        ("surface_fatigue_index",), min_length=1, max_length=20, description="the fatigue laws"
    )
    coefficients: Annotated[tuple[FatigueSetName, ...], Strict(False)] = Field(
        (), max_length=20, description="sets that replace the laws' own ones"
    )
    shear_yield_MPa: float | None = number(
        "fatigue_shear_yield", "the yield stress of the wheel in cyclic shear", None
    )
    wear_number: Literal["without_spin", "with_spin"] = Field(
        "without_spin", description="the wear number that laws of T-gamma take"
    )
    branch: Literal["net", "rising"] = Field(
        "net", description='the form of law = "wlrm": with the removal of cracks by wear in it, or without'
    )
    crack_depth_mm: float | None = number(
        "fatigue_crack_depth", "the depth of a crack of damage 1, which wear removes", None
    )
    crack_width_mm: float = number(
        "fatigue_crack_width", "the width of profile over which damage counts as that of one place", 10.0
    )
    wear_limit_mm: float = number(
        "fatigue_wear_limit",
        "the depth that may wear, against which cracks of a stated depth are weighed",
        3.0,
    )
    damage_function: DamageFunctionSection | None = None


def table_of(section: WearSection) -> tuple[WearTable | None, tuple[TableFault, ...]]:
    """Return the table of [wear.table]; None if there is none, or it has faults."""
    if section.table is None:
        return None, ()
    keys = section.table.model_dump(exclude_none=True)
    return wear_table(keys, "wear.table")


def wear_settings(section: WearSection, table: WearTable | None = None) -> WearSettings:
    """Return the settings of the leading wear law.

    Parameters
    ----------
    section : WearSection
        Without faults.
    table : WearTable, optional
        Of `table_file`, if it names one.

    Returns
    -------
    WearSettings
        In SI units.
    """
    return _settings(section, section.law, table or table_of(section)[0])


def beside_settings(section: WearSection, table: WearTable | None = None) -> tuple[WearSettings, ...]:
    """Return the settings of the wear laws beside the leading one, each with its own set and form.

    An entry without form takes that of the leading law where it has it, one without set the law's own, or
    that of the leading law where it is the same law.

    Parameters
    ----------
    section, table
        As for `wear_settings`.

    Returns
    -------
    tuple of WearSettings
        In the order of `beside`.
    """
    return tuple(
        _settings(section, entry.law, table or table_of(section)[0], entry) for entry in section.beside
    )


def _settings(
    section: WearSection, law: str, table: WearTable | None, entry: BesideSection | None = None
) -> WearSettings:
    coefficients: str | CoefficientSet | None = DEFAULT_COEFFICIENTS.get(law)
    if law == section.law and section.coefficients is not None:
        coefficients = section.coefficients
    constant = section.energy_coefficient_mm3_kJ
    if law == section.law == "energy" and constant is not None:
        coefficients = energy.constant(1e-12 * constant, "energy_coefficient_mm3_kJ as given in the scene")
    if entry is not None and entry.coefficients is not None:
        coefficients = entry.coefficients
    if law == "table":
        coefficients = table
    form = section.form if law == section.law or section.form in WEAR_FORMS[law] else None
    if entry is not None and entry.form is not None:
        form = entry.form
    # keys of Archard's law that no law takes are kept, so that they are refused
    takes = law == "archard" or (entry is None and "archard" not in (one.law for one in section.beside))
    hardness = section.hardness_GPa
    return WearSettings(
        law=law,
        coefficients=coefficients if coefficients is not None else "",
        form=form if form is not None else WEAR_FORMS[law][0],
        density=section.density_kg_m3,
        hardness=1e9 * hardness if hardness is not None and takes else None,
        seizure_cap=section.seizure_cap if takes else "none",
    )


def fatigue_settings(section: FatigueSection | None) -> tuple[FatigueSettings, ...]:
    """Return the settings of all fatigue laws of a scene.

    Parameters
    ----------
    section : FatigueSection or None
        Without faults; None: no law.

    Returns
    -------
    tuple of FatigueSettings
        In the order of `laws`, SI units.
    """
    if section is None:
        return ()
    return tuple(_fatigue(section, law) for law in section.laws)


def _fatigue(section: FatigueSection, law: str) -> FatigueSettings:
    named = [name for name in section.coefficients if law in FATIGUE_SETS[name].laws]
    coefficients: str | CoefficientSet = named[0] if named else fatigue.DEFAULT_COEFFICIENTS[law]
    own = section.damage_function
    contains_removal = law in fatigue.CONTAIN_REMOVAL
    if own is not None and contains_removal:
        coefficients = own_function(
            start=own.start_N,
            peak=own.peak_N,
            end=own.end_N,
            peak_damage=own.peak_damage,
            floor=own.floor,
            source=own.source,
            certainty=own.certainty,
        )
    found = coefficients if isinstance(coefficients, CoefficientSet) else FATIGUE_SETS[coefficients]
    if section.shear_yield_MPa is not None and "shear_yield" in found.values:
        coefficients = found.with_value("shear_yield", section.shear_yield_MPa, "yield stress as given")
    depth = section.crack_depth_mm
    return FatigueSettings(
        law=law,
        coefficients=coefficients,
        wear_number=section.wear_number,
        branch=section.branch if contains_removal else "net",
        crack_depth=1e-3 * depth if contains_removal and depth is not None else None,
        crack_width=1e-3 * section.crack_width_mm,
        wear_limit=1e-3 * section.wear_limit_mm,
    )


Told = list[tuple[tuple[str | int, ...], str]]


def damage_faults(wear: WearSection, section: FatigueSection | None) -> Told:
    """Tell what does not fit together within [wear] and [fatigue].

    Parameters
    ----------
    wear : WearSection
        With valid keys, types and ranges.
    section : FatigueSection or None
        Likewise.

    Returns
    -------
    list of (path, str)
        Path of the key and message of each fault.
    """
    return _wear_faults(wear) + ([] if section is None else _fatigue_faults(section))


_KEYS = {
    "coefficients": "coefficients",
    "form": "form",
    "seizure_cap": "seizure_cap",
    "hardness": "hardness_GPa",
}


def _wear_faults(wear: WearSection) -> Told:
    found: Told = []
    for wrong in table_of(wear)[1]:
        place = tuple(item for item in (wrong.key, wrong.row) if item is not None)
        found.append((("wear", "table", *place), wrong.message))
    laws = (wear.law, *(entry.law for entry in wear.beside))
    every = [wear_settings(wear), *beside_settings(wear)]
    acting = [(one.law, one.form, one.coefficients if one.law != "table" else "") for one in every]
    for k, entry in enumerate(wear.beside):
        named = f'beside[{k}] = "{entry.law}"'
        if acting[k + 1] in acting[: k + 1]:
            what = "given twice" if acting[k + 1] in acting[1 : k + 1] else "the leading law"
            way = "delete it, or give it another form or other coefficients"
            found.append((("wear", "beside", k), f"{named} is {what}; {way}"))
        elif entry.law == "table" and entry.coefficients is not None:
            told = f'{named} with coefficients = "{entry.coefficients}": a table has its own numbers'
            found.append((("wear", "beside", k), f"{told}; delete coefficients"))
        elif entry.law != "table":
            try:
                acting_coefficients(replace(every[k + 1], hardness=None, seizure_cap="none"))
            except SceneError as error:
                found += [(("wear", "beside", k), f"{named}: {fault.message}") for fault in error.faults]
    given = [key for key in ("table", "table_file") if getattr(wear, key) is not None]
    if len(given) == 2:
        found.append((("wear", "table_file"), "table_file and [wear.table] are both given; delete one"))
    if "table" in laws and not given:
        key = "law" if wear.law == "table" else "beside"
        found.append((("wear", key), f'{key}: "table" needs its table; give [wear.table] or table_file'))
    if given and "table" not in laws:
        told = f'{given[0]} acts with law = "table" only, not with "{wear.law}"; delete it, or change the law'
        found.append((("wear", given[0]), told))
    if wear.energy_coefficient_mm3_kJ is not None:
        key = "energy_coefficient_mm3_kJ"
        if wear.law != "energy":
            told = f'{key} acts with law = "energy" only, not with "{wear.law}"; delete it'
            return [*found, (("wear", key), told)]
        if wear.coefficients is not None:
            told = f'{key} and coefficients = "{wear.coefficients}" are both given; delete one'
            found.append((("wear", key), told))
    if wear.law == "table":
        if wear.coefficients is not None:
            told = f'coefficients = "{wear.coefficients}": law = "table" has its own numbers; delete it'
            found.append((("wear", "coefficients"), told))
        return found
    try:
        acting_coefficients(wear_settings(wear))
    except SceneError as error:
        for fault in error.faults:
            word = fault.message.split(" ", 1)[0]
            message = fault.message.replace("hardness acts", "hardness_GPa acts")
            found.append((("wear", _KEYS.get(word, "law")), message))
    return found


def _fatigue_faults(section: FatigueSection) -> Told:
    found: Told = []
    laws = section.laws
    contain = [law for law in laws if law in fatigue.CONTAIN_REMOVAL]
    for k, law in enumerate(laws):
        if law in laws[:k]:
            found.append((("fatigue", "laws", k), f'laws[{k}] = "{law}" is given twice; delete it'))
    named: dict[str, str] = {}
    for k, name in enumerate(section.coefficients):
        fitting = [law for law in laws if law in FATIGUE_SETS[name].laws]
        told = ""
        if not fitting:
            told = f"belongs to {', '.join(FATIGUE_SETS[name].laws)}, of which laws has none; delete it"
        elif fitting[0] in named:
            told = f'and "{named[fitting[0]]}" both belong to {fitting[0]}; delete one'
        elif section.damage_function is not None and fitting[0] in contain:
            told = "and [fatigue.damage_function] both give break points; delete one"
        if told:
            found.append((("fatigue", "coefficients", k), f'coefficients[{k}] = "{name}" {told}'))
        named.update(dict.fromkeys(fitting, name))
    only = f'acts with "{", ".join(fatigue.CONTAIN_REMOVAL)}" among the laws only; delete it'
    if not contain:
        alone = {
            "damage_function": section.damage_function is not None,
            "branch": section.branch != "net",
            "crack_depth_mm": section.crack_depth_mm is not None,
            "wear_number": section.wear_number != "without_spin",
        }
        found += [(("fatigue", key), f"{key} {only}") for key, wrong in alone.items() if wrong]
    if section.wear_limit_mm != 3.0 and section.crack_depth_mm is None:
        told = "wear_limit_mm acts with crack_depth_mm only; give that too, or delete it"
        found.append((("fatigue", "wear_limit_mm"), told))
    takes_yield = [law for law in laws if law not in contain]
    if section.shear_yield_MPa is not None and not takes_yield:
        told = f"shear_yield_MPa acts with none of the laws ({', '.join(laws)}); delete it"
        found.append((("fatigue", "shear_yield_MPa"), told))
    if found:
        return found
    for law in laws:
        try:
            fatigue.acting_coefficients(_fatigue(section, law))
        except SceneError as error:
            for fault in error.faults:
                points = fault.message.startswith("damage_function")
                key = (
                    "damage_function" if points else "crack_depth_mm" if section.crack_depth_mm else "branch"
                )
                found.append((("fatigue", key), fault.message.replace("crack_depth", "crack_depth_mm")))
    return found
