r"""Noise of measured profiles, and whether it would decide the contact.

A wave of height :math:`\hat h` and wavenumber q on one of two bodies changes the pressure between them, where
they touch all over, by :math:`E^* q \hat h / 2` with :math:`E^* = E/(2 (1 - \nu^2))` [1]_: the RMS change of
pressure is :math:`E^*/2` times the RMS slope of the noise. Where the amplitude of a wave of that RMS exceeds
the largest pressure, its valleys leave the contact, and the patch falls apart into patches of the noise.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, section 13.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wearsim.contact import geometry
from wearsim.contact.gap import between_points
from wearsim.contact.geometry import WheelsetPose
from wearsim.contact.normal import NORMAL_MODELS, NormalSolution
from wearsim.contact.patch import FloatArray, IntArray
from wearsim.errors import ContactError, Fault
from wearsim.profile.shape import Profile, arc_length
from wearsim.profile.smoothing import ROUGH_BELOW, change, longest_wavelength, roughness, smoothed
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.read import inputs_of
from wearsim.scene.setup import CampaignSetup
from wearsim.toml_faults import shown

DECIDES = 0.8
"""RMS change of pressure by noise over the largest pressure, from which noise decides the contact: a little
above the 0.71 at which valleys of a wave leave the contact, where patches of the noise begin to appear."""
_CURED = 0.1  # that is left by the smoothing a fault names: it changes pressures by some per cent
_CALM = 4e-3  # wavelength of the smoothing for the contact without noise [m]
_LEAST_PRESSURE = 0.3e9  # noise that changes this one by less is of no interest [Pa]
_AROUND = 2e-3  # of a patch on either side, so that there are points enough [m]
_STEP, _LONGEST = 0.5e-3, 10e-3  # of the wavelengths that faults name [m]
_FLANGE = -26e-3  # y of a wheel from which on it is the tread [m]


@dataclass(frozen=True)
class _Body:
    """A measured profile of a scene."""

    section: str  # whose `smooth_mm` it is
    key: str
    name: str
    profile: Profile
    sides: tuple[int, ...]  # of the wheelset that have it
    counterface: bool


def noise_faults(scene: RigScene | FieldScene, setup: CampaignSetup) -> list[Fault]:
    """Faults of measured profiles whose noise would decide the contact at an operating point.

    At most one for each profile; `setup` is that of the scene.
    """
    bodies = list(_bodies(scene, setup))
    modulus = setup.models.effective_modulus
    slope = [float(np.sqrt(np.mean(roughness(body.profile).slope ** 2))) for body in bodies]
    if not any(0.5 * modulus * each > DECIDES * _LEAST_PRESSURE for each in slope):
        return []
    contacts = {side: list(_contacts(setup, side)) for side in {s for body in bodies for s in body.sides}}
    verdicts = [
        verdict
        for body in bodies
        if (verdict := _verdict(body, [one for side in body.sides for one in contacts[side]], modulus))
    ]
    longest: dict[str, float] = {}  # of both wheels
    for verdict in verdicts:
        section = verdict.body.section
        longest[section] = max(longest.get(section, 0.0), verdict.wavelength)
    return [
        scene.fault((one.body.section, one.body.key), _text(scene, setup, one, longest[one.body.section]))
        for one in verdicts
    ]


@dataclass(frozen=True)
class _Verdict:
    """Noise that decides a contact."""

    body: _Body
    row: int  # of the operating point where it changes pressures most
    share: float  # RMS change of pressure over the largest one [-]
    height: float  # RMS of the noise there [m]
    wavelength: float  # of the smoothing that cures it [m]


def _bodies(scene: RigScene | FieldScene, setup: CampaignSetup) -> Iterator[_Body]:
    files = {file.role: file for file in inputs_of(scene).files if not file.shipped}
    wheelset = setup.wheelset
    alike = wheelset.left is wheelset.right
    places = (
        ("wheelset", "profile", wheelset.right, (0, 1) if alike else (0,)),
        ("wheelset", "profile_left", wheelset.left, (1,)),
        ("counterface", "profile", setup.counterface.profile, (0, 1)),
    )
    for section, key, profile, sides in places:
        file = files.get(f"{section}.{key}")
        if file is not None and longest_wavelength(profile) >= ROUGH_BELOW:
            yield _Body(section, key, file.name, profile, sides, section == "counterface")


@dataclass(frozen=True)
class _Contact:
    """A patch between smoothed profiles: largest pressure, and its ends on wheel and counterface."""

    row: int
    pressure: float
    wheel_y: FloatArray
    counterface_y: FloatArray


def _contacts(setup: CampaignSetup, side: int) -> Iterator[_Contact]:
    """Patches of one wheel at all points, between profiles without noise; none where that has no solution."""
    wheel = (setup.wheelset.right, setup.wheelset.left)[side]
    surface = geometry.wheel_surface(_calm(wheel), setup.wheelset.radius)
    profile = geometry.counterface_profile(_calm(setup.counterface.profiles[side]))
    conditions, sign = setup.points.conditions, -1.0 if side else 1.0
    gap = geometry.gap(
        surface,
        profile,
        WheelsetPose(*(sign * each for each in (conditions.shift, conditions.yaw, conditions.roll))),
        half_span=setup.wheelset.half_span,
        nominal_radius=setup.wheelset.radius,
        curvature=setup.counterface.curvature,
    )

    def solved(rows: IntArray) -> Iterator[NormalSolution]:
        try:
            yield NORMAL_MODELS[setup.models.normal](
                gap,
                rows,
                conditions.loads[rows, side],
                vertical=True,
                effective_modulus=setup.models.effective_modulus,
                resolution=setup.models.resolution,
                parameters=dict(setup.models.parameters),
                rough=True,
            )
        except ContactError:
            if rows.size > 1:
                for half in np.array_split(rows, 2):
                    yield from solved(half)

    for solution in solved(np.arange(conditions.shift.size)):
        ends = np.column_stack((solution.edge_y.min(axis=1), solution.edge_y.max(axis=1)))
        on_wheel = between_points(gap, gap.wheel_y, solution.patch.row, ends)
        for row, pressure, there, here in zip(
            solution.patch.row.tolist(), solution.max_pressure.tolist(), on_wheel, ends, strict=True
        ):
            yield _Contact(row, pressure, there, here)


def _calm(profile: Profile) -> Profile:
    return smoothed(profile, min(_CALM, longest_wavelength(profile)))


def _verdict(body: _Body, contacts: list[_Contact], modulus: float) -> _Verdict | None:
    """Where the noise of a profile changes the contact most, if it decides that contact."""
    profile, rough = body.profile, roughness(body.profile)
    share, worst, where = 0.0, None, np.ones(profile.y.size, dtype=bool)
    for contact in contacts:
        low, high = contact.counterface_y if body.counterface else contact.wheel_y
        arc = arc_length(profile.y, profile.z)
        first, last = arc[
            np.searchsorted(np.maximum.accumulate(profile.y), (low, high)).clip(0, profile.y.size - 1)
        ]
        inside = (arc >= first - _AROUND) & (arc <= last + _AROUND)
        own = 0.5 * modulus * float(np.sqrt(np.mean(rough.slope[inside] ** 2))) / contact.pressure
        if own > share:
            share, worst, where = own, contact, inside
    if worst is None or share <= DECIDES:
        return None
    needed = rough.wavelength(where, _CURED * 2.0 * worst.pressure / modulus)
    height = float(np.sqrt(np.mean(rough.height[where] ** 2)))
    return _Verdict(body, worst.row, share, height, _STEP * float(np.ceil(needed / _STEP)))


def _text(scene: RigScene | FieldScene, setup: CampaignSetup, verdict: _Verdict, wavelength: float) -> str:
    """Message on a profile whose section a smoothing `wavelength` [m] would cure."""
    body, given = verdict.body, getattr(scene, verdict.body.section).smooth_mm
    shift = setup.points.conditions.shift[verdict.row]
    noise = (
        f"{body.key} = {shown(body.name)}: noise of {1e6 * verdict.height:.2g} um rms in wavelengths below "
        f"{1e3 * ROUGH_BELOW:g} mm decides the contact: at a shift of {1e3 * shift:.4g} mm it changes "
        f"pressures by {100.0 * verdict.share:.0f} % of the largest (rms, {100.0 * DECIDES:.0f} % allowed)"
    )
    wavelength = max(wavelength, _STEP + 1e-3 * (given or 0.0))
    longest = min(_LONGEST, longest_wavelength(body.profile))
    if wavelength > longest:
        return f"{noise}; smooth_mm up to {1e3 * longest:.3g} does not cure it: measure the profile again"
    moved = np.abs(change(body.profile, smoothed(body.profile, wavelength)))
    parts = {"the profile": moved > -1.0}
    if not body.counterface:
        tread = body.profile.y > _FLANGE
        parts = {"the tread": tread, "the flange": ~tread & (np.arange(tread.size) > body.profile.z.argmax())}
    changes = " and ".join(
        f"{part} by up to {1e6 * moved[there].max():.2g} um" for part, there in parts.items() if there.any()
    )
    instead = "" if given is None else f" in place of {given:g}"
    return (
        f"{noise}; write smooth_mm = {1e3 * wavelength:g}{instead} in [{body.section}], which moves {changes}"
    )
