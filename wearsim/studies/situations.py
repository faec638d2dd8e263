"""Situations that are hard on contact models: profiles, loads, creepages and grids at which methods fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import ContactConditions, ContactModels, Counterface, Wheelset
from wearsim.profile import standard
from wearsim.profile.smoothing import smoothed
from wearsim.profile.shape import Profile, resample

_RADIUS, _HALF_SPAN, _GAUGE = 0.46, 0.75, 1.435
_PLAIN = 3e-3  # shift [m] at which one patch lies on the tread
_PATCH_Y = -12.5e-3  # where that patch lies on the wheel [m]


@dataclass(frozen=True)
class Case:
    """One contact problem.

    Parameters
    ----------
    wheel : Profile
        Of both wheels.
    counterface : Counterface
        Rail or roller.
    conditions : ContactConditions
        One operating point.
    youngs_modulus, poisson_ratio : float
        Of both bodies [Pa, -].
    strips, cells : int, optional
        Where the situation is one of the grid.
    """

    wheel: Profile
    counterface: Counterface
    conditions: ContactConditions
    youngs_modulus: float = 210e9
    poisson_ratio: float = 0.3
    strips: int | None = None
    cells: int | None = None

    @property
    def wheelset(self) -> Wheelset:
        """Both wheels alike, 460 mm radius, flange backs 1360 mm apart."""
        return Wheelset(self.wheel, self.wheel, _RADIUS, _HALF_SPAN)

    def models(self, normal: str, tangential: str, grid: int) -> ContactModels:
        """Models on a grid, in the material and on the grid of the situation where it has one."""
        return ContactModels(
            normal=normal,
            tangential=tangential,
            strips=self.strips or grid,
            cells=self.cells or grid,
            youngs_modulus=self.youngs_modulus,
            poisson_ratio=self.poisson_ratio,
        )


@dataclass(frozen=True)
class Situation:
    """A case under the name of what is hard about it.

    Parameters
    ----------
    kind : str
        What is hard, alike for all values of it.
    title : str
        With its value.
    case : callable
        Makes the contact problem.
    """

    kind: str
    title: str
    case: Callable[[], Case]


@cache
def _wheel() -> Profile:
    return standard.wheel("S1002")


@cache
def _rail() -> Profile:
    return standard.rail("60E1", 1.0 / 40.0, _GAUGE, _HALF_SPAN)


def _running(
    shift: float = _PLAIN,
    yaw: float = 0.0,
    load: float = 80e3,
    creepage: tuple[float, float, float] | None = None,
) -> ContactConditions:
    """One operating point at 20 m/s, friction 0.35, rotation speed V/r0."""
    one = np.ones(1)
    return ContactConditions(
        shift=shift * one,
        yaw=yaw * one,
        roll=0.0 * one,
        wheel_load=load * one,
        speed=20.0 * one,
        friction=0.35 * one,
        track_curvature=0.0 * one,
        rotation="nominal",
        creepage=None if creepage is None else np.array([creepage]),
    )


def tread(
    shift: float = _PLAIN,
    yaw: float = 0.0,
    load: float = 80e3,
    creepage: tuple[float, float, float] | None = None,
    roller: float | None = None,
) -> Case:
    """S1002 on 60E1 1:40, rail or a roller of a radius [m]."""
    curvature = 0.0 if roller is None else 1.0 / roller
    return Case(_wheel(), Counterface(_rail(), curvature), _running(shift, yaw, load, creepage))


def over_rail(opening: Callable[[FloatArray], FloatArray], load: float = 80e3) -> Case:
    """Wheel that stands off the rail by a given gap at every lateral position."""
    rail = _rail()
    part = np.abs(rail.y) < 33e-3
    y = rail.y[part]
    wheel = Profile("designed", "wheel", y, rail.z[part] - opening(y), "the rail less a given gap")
    return Case(wheel, Counterface(rail, 0.0), _running(0.0, load=load))


def parabola(y: FloatArray, centre: float, radius: float) -> FloatArray:
    """Gap of relative radius `radius` at `centre` [m]."""
    square: FloatArray = 0.5 * (y - centre) ** 2 / radius
    return square


def two_wells(y: FloatArray, apart: float, height: float) -> FloatArray:
    """Gap with a maximum in the middle: two contacts, between them a wheel more hollow than the rail."""
    wells: FloatArray = height * ((y / (0.5 * apart)) ** 2 - 1.0) ** 2
    return wells


def hollow(depth: float, shift: float) -> Case:
    """S1002 with a hollow of 60 mm width on the tread."""
    wheel = _wheel()
    worn = np.where(np.abs(wheel.y) < 30e-3, np.cos(np.pi * wheel.y / 60e-3) ** 2, 0.0)
    facing = np.arange(wheel.y.size) > int(np.argmax(wheel.z))
    profile = replace(wheel, name="hollow", z=wheel.z - depth * worn * facing)
    return replace(tread(shift), wheel=profile)


def flat() -> Case:
    """Cylinder on a flat: both without curvature across the rail."""
    y = np.linspace(-35e-3, 35e-3, 281)
    wheel = Profile("cylinder", "wheel", y, 0.0 * y, "a straight line")
    rail = Profile("flat", "rail", y, 0.0 * y, "a straight line")
    return Case(wheel, Counterface(rail, 0.0), _running(0.0))


def noisy(height: float, smoothing: float = 0.0, shift: float = _PLAIN) -> Case:
    """S1002 with normally distributed noise on points 0.25 mm apart, smoothed over a wavelength if any."""
    wheel = resample(_wheel(), 0.25e-3)
    noise = height * np.random.default_rng(6).standard_normal(wheel.y.size)
    profile = replace(wheel, name="measured", z=wheel.z + noise)
    return replace(tread(shift), wheel=smoothed(profile, smoothing))


def cut(beyond: float) -> Case:
    """S1002 of which the wheel ends `beyond` the middle of the patch on the tread [m]."""
    wheel = _wheel()
    part = wheel.y < _PATCH_Y + beyond
    return replace(tread(), wheel=replace(wheel, name="cut", y=wheel.y[part], z=wheel.z[part]))


def grid(strips: int | None, cells: int | None) -> Case:
    """Tread on a grid of few strips or cells."""
    return replace(tread(), strips=strips, cells=cells)


def material(youngs_modulus: float, poisson_ratio: float) -> Case:
    """Tread of another material."""
    return replace(tread(), youngs_modulus=youngs_modulus, poisson_ratio=poisson_ratio)


def _all(kind: str, cases: dict[str, Callable[[], Case]]) -> list[Situation]:
    return [Situation(kind, title, case) for title, case in cases.items()]


SITUATIONS: tuple[Situation, ...] = (
    *_all(
        "plain tread",
        {
            "ellipse: relative radius 0.3 m": partial(over_rail, partial(parabola, centre=0.0, radius=0.3)),
            "shift 3 mm": tread,
            "shift -3 mm, yaw 3 mrad": partial(tread, -3e-3, 3e-3),
            "shift 0": partial(tread, 0.0),
        },
    ),
    *_all(
        "split contact",
        {
            "shift 5 mm": partial(tread, 5e-3),
            "shift 5 mm, yaw 3 mrad, roller 1 m": partial(tread, 5e-3, 3e-3, roller=1.0),
        },
    ),
    *_all(
        "contact jumps",
        {
            "shift -0.77 mm": partial(tread, -0.77e-3),
            "shift 5.3 mm, yaw 60 mrad": partial(tread, 5.3e-3, 60e-3),
            "shift 5.4 mm, yaw 60 mrad": partial(tread, 5.4e-3, 60e-3),
        },
    ),
    *_all(
        "flange root",
        {
            "shift 6 mm": partial(tread, 6e-3),
            "shift 6.5 mm": partial(tread, 6.5e-3),
            "conformal: relative radius 0.1 m": partial(
                over_rail, partial(parabola, centre=-28e-3, radius=0.1)
            ),
            "conformal: relative radius 1 m": partial(
                over_rail, partial(parabola, centre=-28e-3, radius=1.0)
            ),
        },
    ),
    *_all(
        "hollow tread",
        {
            "1 mm deep": partial(hollow, 1e-3, 0.0),
            "2 mm deep": partial(hollow, 2e-3, 0.0),
            "2 mm deep, shift 5 mm": partial(hollow, 2e-3, 5e-3),
        },
    ),
    *_all(
        "no or negative curvature",
        {
            "flat on flat": flat,
            "relative radius 30 m": partial(over_rail, partial(parabola, centre=0.0, radius=30.0)),
            "hollow of 5 um over 10 mm": partial(over_rail, partial(two_wells, apart=10e-3, height=5e-6)),
            "hollow of 100 um over 20 mm": partial(over_rail, partial(two_wells, apart=20e-3, height=1e-4)),
        },
    ),
    *_all(
        "measured noise",
        {
            "1 um": partial(noisy, 1e-6),
            "10 um": partial(noisy, 1e-5),
            "50 um": partial(noisy, 5e-5),
        },
    ),
    *_all(
        "measured noise, smoothed",
        {
            "1 um, smoothed over 3 mm": partial(noisy, 1e-6, 3e-3),
            "10 um, smoothed over 5 mm": partial(noisy, 1e-5, 5e-3),
        },
    ),
    *_all(
        "load of 1 N",
        {
            "1 N": partial(tread, load=1.0),
        },
    ),
    *_all(
        "load, 100 N to 300 kN",
        {
            "100 N": partial(tread, load=100.0),
            "10 kN": partial(tread, load=10e3),
            "300 kN": partial(tread, load=300e3),
        },
    ),
    *_all(
        "creepage 0, 1e-9, 1",
        {
            "0": partial(tread, creepage=(0.0, 0.0, 0.0)),
            "1e-9 along": partial(tread, creepage=(1e-9, 0.0, 0.0)),
            "1e-9 across": partial(tread, creepage=(0.0, 1e-9, 0.0)),
            "1 along": partial(tread, creepage=(1.0, 0.0, 0.0)),
            "1 across": partial(tread, creepage=(0.0, 1.0, 0.0)),
        },
    ),
    *_all(
        "next to no spin, no creepage",
        {
            "0.01 1/m": partial(tread, creepage=(0.0, 0.0, 0.01)),
        },
    ),
    *_all(
        "spin only, 0.2 to 2 1/m",
        {
            "0.2 1/m": partial(tread, creepage=(0.0, 0.0, 0.2)),
            "1 1/m": partial(tread, creepage=(0.0, 0.0, 1.0)),
            "2 1/m": partial(tread, creepage=(0.0, 0.0, 2.0)),
        },
    ),
    *_all(
        "grid of few strips or cells",
        {
            "1 strip, 1 cell": partial(grid, 1, 1),
            "2 strips, 2 cells": partial(grid, 2, 2),
            "1 cell along each strip": partial(grid, None, 1),
            "2 cells along each strip": partial(grid, None, 2),
            "5 strips, 5 cells": partial(grid, 5, 5),
        },
    ),
    *_all(
        "edge of a profile",
        {
            "wheel ends 1 mm beyond the middle of the patch": partial(cut, 1e-3),
            "wheel ends 3 mm before the patch": partial(cut, -8e-3),
            "shift -18 mm": partial(tread, -18e-3),
        },
    ),
    *_all(
        "roller of 100 to 1 mm",
        {
            "radius 100 mm": partial(tread, roller=0.1),
            "radius 20 mm": partial(tread, roller=0.02),
            "radius 5 mm": partial(tread, roller=0.005),
            "radius 1 mm": partial(tread, roller=0.001),
        },
    ),
    *_all(
        "large yaw or shift",
        {
            "100 mrad": partial(tread, yaw=0.1),
            "300 mrad": partial(tread, yaw=0.3),
            "1000 mrad, on the edge of the chamfer": partial(tread, yaw=1.0),
            "1200 mrad, no contact": partial(tread, yaw=1.2),
            "shift 70 mm, no contact": partial(tread, 70e-3),
        },
    ),
    *_all(
        "soft and hard materials",
        {
            "soft: E = 1 GPa": partial(material, 1e9, 0.3),
            "very soft: E = 0.01 GPa": partial(material, 1e7, 0.49),
            "nearly incompressible: Poisson's ratio 0.49": partial(material, 210e9, 0.49),
            "hard: E = 1000 GPa": partial(material, 1e12, 0.2),
        },
    ),
)
