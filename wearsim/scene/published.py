"""Scenes of kind "published": contact cases with published values, to be put beside our own."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, Strict

from wearsim.contact.problem import ContactModels, Wheelset
from wearsim.errors import Fault, ProfileError
from wearsim.profile.files import load_profile
from wearsim.profile.shape import Profile
from wearsim.scene.inputs import FLANGE_BACK_TO_ORIGIN, find_file
from wearsim.scene.models import ContactSection, Header, Inclination, SceneModel, Shift, WheelsetSection
from wearsim.scene.section import Section, Text, quantity, words
from wearsim.scene.setup import contact_models
from wearsim.toml_faults import shown

RESULTS = {
    "area_mm2": ("area", 1e-6),
    "max_pressure_MPa": ("max_pressure", 1e6),
    "length_mm": ("patch_length", 1e-3),
    "width_mm": ("patch_width", 1e-3),
    "slip_share": ("slip_share", 1.0),
    "force_x_kN": ("force_x", 1e3),
    "force_y_kN": ("force_y", 1e3),
    "spin_moment_Nm": ("spin_moment", 1.0),
    "power_W": ("power", 1.0),
}
"""Keys of results: name of the quantity and factor to SI."""

_MOTION = {
    "creepage_x": ("creepage_x", 1.0),
    "spin_per_m": ("spin", 1.0),
    "contact_angle_mrad": ("contact_angle", 1e-3),
}
_KINDS = ("kinematics", "centre", "touch")
Radius = Annotated[float, Field(ge=50, le=100000)]


class PublishedHeader(Header):
    """[scene] of published contact cases."""

    kind: Literal["published"] = Field(description="what the scene describes")


class PublishedSection(Section):
    """[published]: where the values come from."""

    source: Text = words("where the values were published")
    half_space: Text | None = words("a CSV file with half-space solutions of the cases", None)
    remarks: str = Field("", description="a paragraph for the report", max_length=5000)


class ProfilesSection(Section):
    """[counterface] of published cases: rails or rollers, the latter by the radius of each case."""

    profiles: Annotated[tuple[Text, ...], Strict(False)] = Field(
        min_length=1, max_length=8, description="names of rail profiles, or files of points"
    )
    inclination: Inclination = words('the inclination of the rail, such as "1:40", or "none"')
    gauge_mm: float = quantity("the track gauge", "mm", 1435.0, ge=950, le=1750)


class ConditionsSection(Section):
    """[conditions]: what all cases have in common."""

    normal_force_kN: float = quantity("the normal force of the patch", "kN", gt=0, le=250)
    speed_km_h: float = quantity("the speed", "km/h", gt=0, le=400)
    friction: float = quantity("Coulomb's coefficient of friction", "", ge=0, le=1)


class CaseSection(Section):
    """[[case]]: one contact case; creepages are prescribed, results are those published."""

    shift_mm: float = quantity("the lateral shift, + to the right", "mm", ge=-20, le=20)
    roller_radius_mm: Radius | None = quantity("the roller radius; none for a rail", "mm", None)
    creepage_x: float = quantity("the longitudinal creepage", "", ge=-1, le=1)
    creepage_y: float = quantity("the lateral creepage", "", 0.0, ge=-1, le=1)
    spin_per_m: float = quantity("the spin", "1/m", ge=-10, le=10)
    area_mm2: float | None = quantity("the published area", "mm2", None, gt=0)
    max_pressure_MPa: float | None = quantity("the published maximum pressure", "MPa", None, gt=0)
    force_x_kN: float | None = quantity("the published longitudinal force", "kN", None)
    force_y_kN: float | None = quantity("the published lateral force", "kN", None)
    power_W: float | None = quantity("the published frictional power", "W", None, ge=0)


class TrendsSection(Section):
    """[trends]: shifts and roller radii over which the conclusions are checked."""

    shifts_mm: Annotated[tuple[Shift, ...], Strict(False)] = Field(
        min_length=1, max_length=200, description="the lateral shifts", json_schema_extra={"unit": "mm"}
    )
    roller_radii_mm: Annotated[tuple[Radius, ...], Strict(False)] = Field(
        min_length=1, max_length=50, description="roller radii", json_schema_extra={"unit": "mm"}
    )


class PublishedScene(SceneModel):
    """Contact cases with published values."""

    scene: PublishedHeader
    published: PublishedSection
    wheelset: WheelsetSection
    counterface: ProfilesSection
    contact: ContactSection = Field(default_factory=lambda: ContactSection.model_validate({}))
    conditions: ConditionsSection
    cases: Annotated[tuple[CaseSection, ...], Strict(False)] = Field(
        alias="case", min_length=1, max_length=200, description="the contact cases"
    )
    trends: TrendsSection | None = None


@dataclass(frozen=True)
class Case:
    """One published contact case, in SI units and our axes.

    Parameters
    ----------
    shift, counterface_curvature : float
        [m], [1/m].
    creepage : tuple of 3 float
        Longitudinal, lateral creepage and spin [-, -, 1/m].
    results : dict
        Published results by the name of the quantity.
    half_space : dict
        Half-space results by how creepages come about ("kinematics", "centre", "touch") and quantity;
        empty where there are none.
    """

    shift: float
    counterface_curvature: float
    creepage: tuple[float, float, float]
    results: dict[str, float]
    half_space: dict[str, dict[str, float]]


@dataclass(frozen=True)
class PublishedCases:
    """Everything published cases are solved with.

    Parameters
    ----------
    title, source, remarks : str
        Of the scene; of the published values; a paragraph for the report.
    scene_text : str
        The scene file.
    wheelset : Wheelset
        Both wheels.
    profiles : tuple of Profile
        Placed rails.
    names : tuple of str
        Their names in the scene.
    models : ContactModels
        Of the contact.
    normal_force, speed, friction : float
        [N], [m/s], [-].
    cases : tuple of Case
        In the order of the file.
    trend_shifts, trend_curvatures : tuple of float
        [m], [1/m] rising from the rail's 0; empty without trends.
    """

    title: str
    source: str
    remarks: str
    scene_text: str
    wheelset: Wheelset
    profiles: tuple[Profile, ...]
    names: tuple[str, ...]
    models: ContactModels
    normal_force: float
    speed: float
    friction: float
    cases: tuple[Case, ...]
    trend_shifts: tuple[float, ...]
    trend_curvatures: tuple[float, ...]


def read_published(scene: PublishedScene) -> tuple[PublishedCases | None, list[Fault]]:
    """Read the files of a scene of published cases, and turn all into SI units.

    Parameters
    ----------
    scene : PublishedScene
        With valid keys, types and ranges.

    Returns
    -------
    cases : PublishedCases or None
        None if there are faults.
    faults : list of Fault
        All that were found.
    """
    file = str(scene.origin.path)
    faults: list[Fault] = []
    half_span = 0.5e-3 * scene.wheelset.flange_back_mm + FLANGE_BACK_TO_ORIGIN

    def profile(name: str, line: int, key: str, kind: Literal["wheel", "rail"]) -> Profile | None:
        beside = find_file(name, (scene.origin.path.parent,), "profiles")
        place: str | Path = beside if beside is not None and beside.suffix != ".toml" else name
        slope = (
            0.0 if scene.counterface.inclination == "none" else 1.0 / float(scene.counterface.inclination[2:])
        )
        try:
            return load_profile(
                place, kind, inclination=slope, gauge=1e-3 * scene.counterface.gauge_mm, half_span=half_span
            )
        except ProfileError as error:
            faults.extend(
                Fault(f"{key} = {shown(name)}: {told}", file, line) for told in str(error).splitlines()
            )
            return None

    wheelset = scene.wheelset
    right = profile(wheelset.profile, scene.line("wheelset", "profile"), "profile", "wheel")
    left = right
    if wheelset.profile_left is not None:
        line = scene.line("wheelset", "profile_left")
        left = profile(wheelset.profile_left, line, "profile_left", "wheel")
    names = scene.counterface.profiles
    line = scene.line("counterface", "profiles")
    rails = [profile(name, line, "profiles", "rail") for name in names]
    half_space = _half_space(scene, faults)
    faults += _repeated_radii(scene)
    placed = tuple(rail for rail in rails if rail is not None)
    if faults or right is None or left is None:
        return None, sorted(faults, key=lambda fault: fault.line or 0)
    trends = scene.trends
    return PublishedCases(
        title=scene.scene.title or scene.origin.path.stem,
        source=scene.published.source,
        remarks=scene.published.remarks,
        scene_text=scene.origin.content.decode("utf-8-sig"),
        wheelset=Wheelset(right, left, 1e-3 * wheelset.radius_mm, half_span),
        profiles=placed,
        names=names,
        models=contact_models(scene.contact),
        normal_force=1e3 * scene.conditions.normal_force_kN,
        speed=scene.conditions.speed_km_h / 3.6,
        friction=scene.conditions.friction,
        cases=tuple(_case(case, half_space) for case in scene.cases),
        trend_shifts=() if trends is None else tuple(1e-3 * shift for shift in trends.shifts_mm),
        trend_curvatures=()
        if trends is None
        else (0.0, *sorted(1e3 / radius for radius in trends.roller_radii_mm)),
    ), []


def published_cases(scene: PublishedScene) -> PublishedCases:
    """Cases of a scene that `load_scene` has read.

    Parameters
    ----------
    scene : PublishedScene
        As loaded.

    Returns
    -------
    PublishedCases
        In SI units.
    """
    cases = scene._inputs
    if not isinstance(cases, PublishedCases):
        raise ValueError("cases are there after load_scene has read the files of the scene")
    return cases


def _case(case: CaseSection, half_space: dict[tuple[float, float], dict[str, dict[str, float]]]) -> Case:
    values: dict[str, float | None] = {key: getattr(case, key, None) for key in RESULTS}
    told = {key: value for key, value in values.items() if value is not None}
    return Case(
        shift=1e-3 * case.shift_mm,
        counterface_curvature=0.0 if case.roller_radius_mm is None else 1e3 / case.roller_radius_mm,
        creepage=(case.creepage_x, case.creepage_y, case.spin_per_m),
        results={RESULTS[key][0]: value * RESULTS[key][1] for key, value in told.items()},
        half_space=half_space.get((case.shift_mm, case.roller_radius_mm or 0.0), {}),
    )


def _repeated_radii(scene: PublishedScene) -> list[Fault]:
    radii = scene.trends.roller_radii_mm if scene.trends is not None else ()
    twice = sorted({radius for radius in radii if radii.count(radius) > 1})
    told = "roller_radii_mm holds {:g} twice: nothing changes between them; give each radius once"
    line = scene.line("trends", "roller_radii_mm") if twice else 0
    return [Fault(told.format(radius), str(scene.origin.path), line) for radius in twice]


def _half_space(
    scene: PublishedScene, faults: list[Fault]
) -> dict[tuple[float, float], dict[str, dict[str, float]]]:
    """Half-space results by shift and roller radius [mm] (0: rail), by kind of creepages, by quantity."""
    name = scene.published.half_space
    if name is None:
        return {}
    path = find_file(name, (scene.origin.path.parent,), "workflows")
    if path is None:
        line = scene.line("published", "half_space")
        faults.append(
            Fault(f"half_space = {shown(name)}: there is no such file", str(scene.origin.path), line)
        )
        return {}
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        faults.append(Fault(f"cannot be read as UTF-8 text ({error})", str(path)))
        return {}
    numbered = [(n, row) for n, row in enumerate(text.splitlines(), 1) if row.strip() and row[0] != "#"]
    columns = {**_MOTION, **RESULTS}
    reader = csv.DictReader(io.StringIO("\n".join(row for _, row in numbered)))
    missing = {"creepages", "shift_mm", "roller_radius_mm", *columns} - set(reader.fieldnames or ())
    if missing:
        told = f"columns that are missing: {', '.join(sorted(missing))}"
        faults.append(Fault(told, str(path), numbered[0][0] if numbered else 1))
        return {}
    found: dict[tuple[float, float], dict[str, dict[str, float]]] = {}
    known = {(case.shift_mm, case.roller_radius_mm or 0.0) for case in scene.cases}
    for (line, _), row in zip(numbered[1:], reader, strict=False):
        wrong = [key for key in ("shift_mm", *columns) if not _is_number(row[key])]
        wrong += [key for key in ("roller_radius_mm",) if row[key] and not _is_number(row[key])]
        faults += [Fault(f"{key} = {shown(row[key])} must be a number", str(path), line) for key in wrong]
        if row["creepages"] not in _KINDS:
            told = f"creepages = {shown(row['creepages'])} must be one of {', '.join(_KINDS)}"
            faults.append(Fault(told, str(path), line))
        elif not wrong:
            case = (float(row["shift_mm"]), float(row["roller_radius_mm"] or 0.0))
            kinds = found.setdefault(case, {})
            if case not in known or row["creepages"] in kinds:
                told = "repeats an earlier row" if case in known else "is no case of the scene"
                told += f": shift_mm {case[0]:g}, roller_radius_mm {row['roller_radius_mm'] or 'empty'}"
                faults.append(Fault(f"{told}; correct or delete the row", str(path), line))
                continue
            kinds[row["creepages"]] = {
                name: float(row[key]) * factor for key, (name, factor) in columns.items()
            }
    return found


def _is_number(text: str | None) -> bool:
    try:
        return text is not None and math.isfinite(float(text))
    except ValueError:
        return False
