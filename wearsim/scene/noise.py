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
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactSolution, solve_each
from wearsim.errors import Fault
from wearsim.profile.shape import Profile, arc_length
from wearsim.profile.smoothing import ROUGH_BELOW, change, longest_wavelength, roughness, smoothed
from wearsim.scene.models import FieldScene, RigScene
from wearsim.scene.read import inputs_of
from wearsim.scene.setup import CampaignSetup
from wearsim.texts import shown

DECIDES = 0.8
"""RMS change of pressure by noise over the largest pressure, from which noise decides the contact: a little
above the 0.71 at which valleys of a wave leave the contact, where patches of the noise begin to appear."""
_CURED = 0.1  # that is left by the smoothing a fault names: it changes pressures by some per cent
_CALM = 4e-3  # wavelength of the smoothing for the contact without noise [m]
_LEAST_PRESSURE = 0.3e9  # noise that changes this one by less is of no interest [Pa]
_AROUND = 2e-3  # of a patch on either side, so that there are points enough [m]
_STEP, _LONGEST = 0.5e-3, 10e-3  # of the wavelengths that faults name [m]
_FLANGE = -26e-3  # y of a wheel from which on it is the tread [m]


class _Noise(NamedTuple):
    """A measured profile of a scene, and the contact that its noise changes most."""

    path: tuple[str, str]  # of its key
    name: str
    profile: Profile
    sides: tuple[int, ...]  # of the wheelset that have it
    row: int = 0  # of the operating point where it changes pressures most
    share: float = 0.0  # RMS change of pressure there over the largest one [-]
    height: float = 0.0  # RMS of the noise there [m]
    wavelength: float = 0.0  # of the smoothing that cures it [m]


class _Contacts(NamedTuple):
    """Patches between profiles without noise: largest pressure, and their ends on wheel and counterface."""

    row: IntArray
    side: IntArray
    pressure: FloatArray
    wheel_y: FloatArray
    counterface_y: FloatArray


def noise_faults(scene: RigScene | FieldScene, setup: CampaignSetup) -> list[Fault]:
    """Faults of measured profiles whose noise would decide the contact at an operating point.

    At most one for each profile; `setup` is that of the scene.
    """
    bodies, modulus = list(_bodies(scene, setup)), setup.models.effective_modulus
    slopes = [float(np.sqrt(np.mean(roughness(body.profile).slope ** 2))) for body in bodies]
    if 0.5 * modulus * max(slopes, default=0.0) <= DECIDES * _LEAST_PRESSURE:
        return []
    contacts = _contacts(setup)
    deciding = [one for body in bodies if (one := _worst(body, contacts, modulus)).share > DECIDES]
    # one wavelength cures both wheels
    longest = {one.path[0]: one.wavelength for one in sorted(deciding, key=lambda one: one.wavelength)}
    return [scene.fault(one.path, _text(scene, setup, one, longest[one.path[0]])) for one in deciding]


def _bodies(scene: RigScene | FieldScene, setup: CampaignSetup) -> Iterator[_Noise]:
    names = {file.role: file.name for file in inputs_of(scene).files if not file.shipped}
    right, left = setup.wheelset.right, setup.wheelset.left
    for one in (
        _Noise(("wheelset", "profile"), "", right, (0, 1) if left is right else (0,)),
        _Noise(("wheelset", "profile_left"), "", left, (1,)),
        _Noise(("counterface", "profile"), "", setup.counterface.profile, (0, 1)),
    ):
        name = names.get(".".join(one.path))
        if name is not None and longest_wavelength(one.profile) >= ROUGH_BELOW:
            yield one._replace(name=name)


def _contacts(setup: CampaignSetup) -> _Contacts:
    """Patches of all points that have a solution."""
    wheelset, counterface = setup.wheelset, setup.counterface
    wheelset = replace(wheelset, right=_calm(wheelset.right), left=_calm(wheelset.left))
    counterface = replace(counterface, profile=_calm(counterface.profile))

    def patches(solution: ContactSolution) -> _Contacts:
        edges = solution.strip_edges_wheel_y, solution.strip_edges_rail_y
        ends = [np.column_stack((each.min(axis=1), each.max(axis=1))) for each in edges]
        return _Contacts(solution.point, solution.side, solution.max_pressure, *ends)

    models = replace(setup.models, tangential="fastsim")
    parts = solve_each(setup.points.conditions, wheelset, counterface, models, patches, failed={})
    return _Contacts(*map(np.concatenate, zip(*parts, strict=True)))


def _calm(profile: Profile) -> Profile:
    return smoothed(profile, min(_CALM, longest_wavelength(profile)))


def _worst(body: _Noise, contacts: _Contacts, modulus: float) -> _Noise:
    """Where the noise of a profile changes the contact most, if it decides that contact."""
    profile, rough = body.profile, roughness(body.profile)
    arc, rising_y = arc_length(profile.y, profile.z), np.maximum.accumulate(profile.y)
    ends = contacts.counterface_y if body.path[0] == "counterface" else contacts.wheel_y
    share, worst, where = 0.0, 0, np.ones(profile.y.size, dtype=bool)
    for patch in np.flatnonzero(np.isin(contacts.side, body.sides)).tolist():
        first, last = arc[np.searchsorted(rising_y, ends[patch]).clip(0, profile.y.size - 1)]
        inside = (arc >= first - _AROUND) & (arc <= last + _AROUND)
        own = 0.5 * modulus * float(np.sqrt(np.mean(rough.slope[inside] ** 2))) / contacts.pressure[patch]
        if own > share:
            share, worst, where = own, patch, inside
    if share <= DECIDES:
        return body
    needed = rough.wavelength(where, _CURED * 2.0 * float(contacts.pressure[worst]) / modulus)
    return body._replace(
        row=int(contacts.row[worst]),
        share=share,
        height=float(np.sqrt(np.mean(rough.height[where] ** 2))),
        wavelength=_STEP * float(np.ceil(needed / _STEP)),
    )


def _text(scene: RigScene | FieldScene, setup: CampaignSetup, one: _Noise, wavelength: float) -> str:
    """Message on a profile whose section a smoothing `wavelength` [m] would cure."""
    (table, key), profile = one.path, one.profile
    given, shift = getattr(scene, table).smooth_mm, setup.points.conditions.shift[one.row]
    noise = (
        f"{key} = {shown(one.name)}: noise of {1e6 * one.height:.2g} um rms in wavelengths below "
        f"{1e3 * ROUGH_BELOW:g} mm decides the contact: at a shift of {1e3 * shift:.4g} mm it changes "
        f"pressures by {100.0 * one.share:.0f} % of the largest (rms, {100.0 * DECIDES:.0f} % allowed)"
    )
    wavelength = max(wavelength, _STEP + 1e-3 * (given or 0.0))
    longest = min(_LONGEST, longest_wavelength(profile))
    if wavelength > longest:
        return f"{noise}; smooth_mm up to {1e3 * longest:.3g} does not cure it: measure the profile again"
    moved = np.abs(change(profile, smoothed(profile, wavelength)))
    tread = profile.y > _FLANGE
    parts = {"the tread": tread, "the flange": ~tread & (np.arange(tread.size) > profile.z.argmax())}
    if table == "counterface":
        parts = {"the profile": np.ones(moved.size, dtype=bool)}
    changes = " and ".join(
        f"{part} by up to {1e6 * moved[there].max():.2g} um" for part, there in parts.items() if there.any()
    )
    instead = "" if given is None else f" in place of {given:g}"
    return f"{noise}; write smooth_mm = {1e3 * wavelength:g}{instead} in [{table}], which moves {changes}"
