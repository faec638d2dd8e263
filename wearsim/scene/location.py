"""Scenes of kind "location": where rigid wheels touch rail and rollers, over the lateral shift."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, Strict

from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import Wheelset
from wearsim.errors import Fault, ProfileError
from wearsim.profile.files import load_profile
from wearsim.profile.shape import Profile
from wearsim.scene.inputs import FLANGE_BACK_TO_ORIGIN, find_file
from wearsim.scene.models import Header, Inclination, SceneModel, WheelsetSection
from wearsim.scene.published import Radius
from wearsim.scene.section import Section, Text, quantity, words
from wearsim.toml_faults import shown


class LocationHeader(Header):
    """[scene] of contact locations."""

    kind: Literal["location"] = Field(description="what the scene describes")


class TrackSection(Section):
    """[counterface] of contact locations: a rail, and rollers with its profile."""

    profile: Text = words("the name of a rail profile, or a file of points")
    inclination: Inclination = words('the inclination of the rail, such as "1:40", or "none"')
    gauge_mm: float = quantity("the track gauge", "mm", 1435.0, ge=950, le=1750)
    roller_radii_mm: Annotated[tuple[Radius, ...], Strict(False)] = Field(
        (), max_length=6, description="roller radii", json_schema_extra={"unit": "mm"}
    )


class SweepSection(Section):
    """[sweep]: the attitudes of the wheelset."""

    shift_from_mm: float = quantity("the first lateral shift, + to the right", "mm", ge=-20, le=20)
    shift_to_mm: float = quantity("the last lateral shift", "mm", ge=-20, le=20)
    shift_step_mm: float = quantity("the step of the shift", "mm", 0.1, ge=0.01, le=1)
    yaw_mrad: float = quantity("the yaw angle, + to the right", "mrad", 0.0, ge=-100, le=100)
    roll: Literal["free", "none"] = words(
        '"free": the wheelset rests on both wheels; "none": no roll', "free"
    )


class LocationScene(SceneModel):
    """Contact locations of rigid bodies over the shift."""

    scene: LocationHeader
    wheelset: WheelsetSection
    counterface: TrackSection
    sweep: SweepSection
    remarks: str = Field("", description="a paragraph for the report", max_length=5000)


@dataclass(frozen=True)
class Locations:
    """Everything contact locations are searched with, in SI units.

    Parameters
    ----------
    title, remarks, scene_text : str
        Of the scene; a paragraph for the report; the scene file.
    wheelset : Wheelset
        Both wheels.
    profile : Profile
        Placed rail.
    curvatures : tuple of float
        Of rail (0) and rollers [1/m].
    shift : (n,) array
        Rising [m].
    yaw : float
        [rad].
    free_roll : bool
        Whether the wheelset rests on both wheels.
    """

    title: str
    remarks: str
    scene_text: str
    wheelset: Wheelset
    profile: Profile
    curvatures: tuple[float, ...]
    shift: FloatArray
    yaw: float
    free_roll: bool


def read_locations(scene: LocationScene) -> tuple[Locations | None, list[Fault]]:
    """Read the profiles of a scene of kind "location", and turn all into SI units.

    Parameters
    ----------
    scene : LocationScene
        With valid keys, types and ranges.

    Returns
    -------
    locations : Locations or None
        None if there are faults.
    faults : list of Fault
        All that were found.
    """
    file = str(scene.origin.path)
    faults: list[Fault] = []
    half_span = 0.5e-3 * scene.wheelset.flange_back_mm + FLANGE_BACK_TO_ORIGIN
    track, sweep = scene.counterface, scene.sweep

    def profile(name: str, key: str, table: str, inclination: str = "none") -> Profile | None:
        beside = find_file(name, (scene.origin.path.parent,), "profiles")
        place: str | Path = beside if beside is not None and beside.suffix != ".toml" else name
        try:
            return load_profile(
                place,
                "wheel" if table == "wheelset" else "rail",
                inclination=0.0 if inclination == "none" else 1.0 / float(inclination[2:]),
                gauge=1e-3 * track.gauge_mm,
                half_span=half_span,
            )
        except ProfileError as error:
            line = scene.line(table, key)
            faults.extend(Fault(f"{key} = {shown(name)}: {t}", file, line) for t in str(error).splitlines())
            return None

    right = profile(scene.wheelset.profile, "profile", "wheelset")
    left = right
    if scene.wheelset.profile_left is not None:
        left = profile(scene.wheelset.profile_left, "profile_left", "wheelset")
    rail = profile(track.profile, "profile", "counterface", track.inclination)
    steps = (sweep.shift_to_mm - sweep.shift_from_mm) / sweep.shift_step_mm
    if steps < 1.0:
        told = (
            f"shift_to_mm = {sweep.shift_to_mm:g} must be above shift_from_mm = {sweep.shift_from_mm:g} by "
            f"a step of {sweep.shift_step_mm:g} mm or more"
        )
        faults.append(Fault(told, file, scene.line("sweep", "shift_to_mm")))
    if faults or right is None or left is None or rail is None:
        return None, sorted(dict.fromkeys(faults), key=lambda fault: fault.line or 0)
    count = int(steps + 1e-9) + 1
    return Locations(
        title=scene.scene.title or scene.origin.path.stem,
        remarks=scene.remarks,
        scene_text=scene.origin.content.decode("utf-8-sig"),
        wheelset=Wheelset(right, left, 1e-3 * scene.wheelset.radius_mm, half_span),
        profile=rail,
        curvatures=(0.0, *sorted(1e3 / radius for radius in track.roller_radii_mm)),
        shift=1e-3 * (sweep.shift_from_mm + sweep.shift_step_mm * np.arange(count, dtype=np.float64)),
        yaw=1e-3 * sweep.yaw_mrad,
        free_roll=sweep.roll == "free",
    ), []


def locations_of(scene: LocationScene) -> Locations:
    """Locations of a scene that `load_scene` has read.

    Parameters
    ----------
    scene : LocationScene
        As loaded.

    Returns
    -------
    Locations
        In SI units.
    """
    found = scene._inputs
    if not isinstance(found, Locations):
        raise ValueError("the locations are there after load_scene has read the files of the scene")
    return found
