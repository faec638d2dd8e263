"""Scenes of kind "accuracy": a matrix of contact cases on which models are measured against a reference."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, Strict

from wearsim.contact.problem import ContactModels, Counterface, Wheelset
from wearsim.contact.solve import ContactConditions
from wearsim.errors import Fault, ProfileError
from wearsim.profile.files import load_profile
from wearsim.profile.shape import FloatArray, Profile
from wearsim.scene.inputs import FLANGE_BACK_TO_ORIGIN, find_file
from wearsim.scene.models import (
    Header,
    Inclination,
    NormalName,
    SceneModel,
    Shift,
    TangentialName,
    WheelsetSection,
)
from wearsim.scene.published import Radius
from wearsim.scene.section import Section, Text, quantity
from wearsim.toml_faults import shown

_MOST_CASES = 20000

_Load = Annotated[float, Field(ge=0.1, le=300)]
_Yaw = Annotated[float, Field(ge=-100, le=100)]
_Friction = Annotated[float, Field(gt=0, le=1)]


class AccuracyHeader(Header):
    """[scene] of a matrix of contact cases."""

    kind: Literal["accuracy"] = Field(description="what the scene describes")


class MatrixSection(Section):
    """[matrix]: every combination of these values is a case."""

    profiles: Annotated[tuple[Text, ...], Strict(False)] = Field(
        ("60E1",), min_length=1, max_length=8, description="names of rail profiles, or files of points"
    )
    inclinations: Annotated[tuple[Inclination, ...], Strict(False)] = Field(
        ("1:40",), min_length=1, max_length=8, description='inclinations, such as "1:40", or "none"'
    )
    gauge_mm: float = quantity("the track gauge", "mm", 1435.0, ge=950, le=1750)
    rail: bool = Field(True, description="whether the wheel runs on rails")
    roller_radii_mm: Annotated[tuple[Radius, ...], Strict(False)] = Field(
        (), max_length=20, description="roller radii", json_schema_extra={"unit": "mm"}
    )
    shifts_mm: Annotated[tuple[Shift, ...], Strict(False)] = Field(
        min_length=1, max_length=200, description="lateral shifts", json_schema_extra={"unit": "mm"}
    )
    yaws_mrad: Annotated[tuple[_Yaw, ...], Strict(False)] = Field(
        (0.0,), min_length=1, max_length=50, description="yaw angles", json_schema_extra={"unit": "mrad"}
    )
    wheel_loads_kN: Annotated[tuple[_Load, ...], Strict(False)] = Field(
        (80.0,), min_length=1, max_length=50, description="vertical loads", json_schema_extra={"unit": "kN"}
    )
    frictions: Annotated[tuple[_Friction, ...], Strict(False)] = Field(
        (0.35,), min_length=1, max_length=20, description="friction coefficients"
    )
    speed_km_h: float = quantity("the speed", "km/h", 72.0, gt=0, le=400)
    youngs_GPa: float = quantity("Young's modulus of both bodies", "GPa", 210.0, ge=1, le=1000)
    poisson: float = quantity("Poisson's ratio of both bodies", "", 0.3, ge=0, le=0.49)


class ModelsSection(Section):
    """[reference] and [[model]]: models of the contact and how finely they are solved."""

    normal: NormalName = Field(description="the model of the normal contact")
    tangential: TangentialName = Field(description="the model of the tangential contact")
    strips: int = quantity("the number of strips across a patch", "", 50, ge=5, le=400)
    cells: int = quantity("the number of cells along a strip", "", 50, ge=5, le=400)


class AccuracyScene(SceneModel):
    """Contact models measured against a reference."""

    remarks: str = Field("", description="a paragraph for the report", max_length=5000)
    scene: AccuracyHeader
    wheelset: WheelsetSection
    matrix: MatrixSection
    reference: ModelsSection = Field(description="the models the others are measured against")
    models: Annotated[tuple[ModelsSection, ...], Strict(False)] = Field(
        alias="model", min_length=1, max_length=40, description="the models to measure"
    )


@dataclass(frozen=True)
class CaseGroup:
    """Cases on one counterface.

    Parameters
    ----------
    profile, inclination : str
        Of the rail, as the scene has them.
    counterface : Counterface
        Rail or roller.
    conditions : ContactConditions
        Of its cases; rotation speed V/r0.
    """

    profile: str
    inclination: str
    counterface: Counterface
    conditions: ContactConditions


@dataclass(frozen=True)
class Matrix:
    """Everything a scene of kind "accuracy" is solved with.

    Parameters
    ----------
    title, remarks, scene_text : str
        Of the scene; a paragraph for the report; the scene file.
    wheelset : Wheelset
        Both wheels.
    groups : tuple of CaseGroup
        The cases by counterface.
    reference : ContactModels
        What the others are measured against.
    models : tuple of ContactModels
        Those to measure.
    """

    title: str
    remarks: str
    scene_text: str
    wheelset: Wheelset
    groups: tuple[CaseGroup, ...]
    reference: ContactModels
    models: tuple[ContactModels, ...]

    @property
    def count(self) -> int:
        """Number of cases."""
        return sum(group.conditions.shift.size for group in self.groups)


def read_accuracy(scene: AccuracyScene) -> tuple[Matrix | None, list[Fault]]:
    """Read the profiles of a scene of kind "accuracy", and turn all into SI units.

    Parameters
    ----------
    scene : AccuracyScene
        With valid keys, types and ranges.

    Returns
    -------
    matrix : Matrix or None
        None if there are faults.
    faults : list of Fault
        All that were found.
    """
    file = str(scene.origin.path)
    faults: list[Fault] = []
    half_span = 0.5e-3 * scene.wheelset.flange_back_mm + FLANGE_BACK_TO_ORIGIN
    matrix = scene.matrix

    def profile(name: str, key: str, table: str, inclination: str = "none") -> Profile | None:
        beside = find_file(name, (scene.origin.path.parent,), "profiles")
        place: str | Path = beside if beside is not None and beside.suffix != ".toml" else name
        slope = 0.0 if inclination == "none" else 1.0 / float(inclination[2:])
        try:
            return load_profile(
                place,
                "wheel" if table == "wheelset" else "rail",
                inclination=slope,
                gauge=1e-3 * matrix.gauge_mm,
                half_span=half_span,
            )
        except ProfileError as error:
            line = scene.line(table, key)
            faults.extend(
                Fault(f"{key} = {shown(name)}: {told}", file, line) for told in str(error).splitlines()
            )
            return None

    right = profile(scene.wheelset.profile, "profile", "wheelset")
    left = right
    if scene.wheelset.profile_left is not None:
        left = profile(scene.wheelset.profile_left, "profile_left", "wheelset")
    curvatures = ([0.0] if matrix.rail else []) + [1e3 / radius for radius in matrix.roller_radii_mm]
    if not curvatures:
        told = "rail = false and no roller_radii_mm: there is nothing to run on; give one of them"
        faults.append(Fault(told, file, scene.line("matrix", "rail")))
    conditions = _conditions(matrix)
    cases = conditions.shift.size * len(curvatures) * len(matrix.profiles) * len(matrix.inclinations)
    if cases > _MOST_CASES:
        told = f"[matrix] has {cases} cases, more than {_MOST_CASES}; give fewer values or several scenes"
        faults.append(Fault(told, file, scene.line("matrix", "shifts_mm")))
    groups = []
    for name, inclination in product(matrix.profiles, matrix.inclinations):
        placed = profile(name, "profiles", "matrix", inclination)
        if placed is not None:
            groups += [
                CaseGroup(name, inclination, Counterface(placed, curvature), conditions)
                for curvature in curvatures
            ]
    if faults or right is None or left is None:
        return None, sorted(dict.fromkeys(faults), key=lambda fault: fault.line or 0)
    return Matrix(
        title=scene.scene.title or scene.origin.path.stem,
        remarks=scene.remarks,
        scene_text=scene.origin.content.decode("utf-8-sig"),
        wheelset=Wheelset(right, left, 1e-3 * scene.wheelset.radius_mm, half_span),
        groups=tuple(groups),
        reference=_models(scene.reference, matrix),
        models=tuple(_models(models, matrix) for models in scene.models),
    ), []


def matrix_of(scene: AccuracyScene) -> Matrix:
    """Matrix of a scene that `load_scene` has read.

    Parameters
    ----------
    scene : AccuracyScene
        As loaded.

    Returns
    -------
    Matrix
        In SI units.
    """
    matrix = scene._inputs
    if not isinstance(matrix, Matrix):
        raise ValueError("the matrix is there after load_scene has read the files of the scene")
    return matrix


def _models(models: ModelsSection, matrix: MatrixSection) -> ContactModels:
    return ContactModels(
        normal=models.normal,
        tangential=models.tangential,
        strips=models.strips,
        cells=models.cells,
        youngs_modulus=1e9 * matrix.youngs_GPa,
        poisson_ratio=matrix.poisson,
    )


def _conditions(matrix: MatrixSection) -> ContactConditions:
    """Every combination of shift, yaw, load and friction, shifts running fastest."""
    rows = [
        (shift, yaw, load, friction)
        for friction, load, yaw, shift in product(
            matrix.frictions, matrix.wheel_loads_kN, matrix.yaws_mrad, matrix.shifts_mm
        )
    ]
    shift, yaw, load, friction = (_column([row[k] for row in rows]) for k in range(4))
    zero = 0.0 * shift
    return ContactConditions(
        shift=1e-3 * shift,
        yaw=1e-3 * yaw,
        roll=zero,
        wheel_load=1e3 * load,
        speed=zero + matrix.speed_km_h / 3.6,
        friction=friction,
        track_curvature=zero,
        rotation="nominal",
    )


def _column(values: list[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)
