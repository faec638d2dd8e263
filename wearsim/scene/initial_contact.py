"""Initial contact of the new wheels of a scene at every operating point.

And noise that would decide it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray
from wearsim.contact.solve import ContactSolution, available_cores, solve_each
from wearsim.damage.wear import passage_depth
from wearsim.errors import ContactError, Fault, NumericalError, SceneError, shown
from wearsim.operation.points import LARGEST_SHARE, carried_share, mask_of
from wearsim.profile.point_noise import NOTABLE, PointNoise, point_noise
from wearsim.profile.shape import Profile, arc_length
from wearsim.profile.smoothing import (
    ROUGH_BELOW,
    change,
    longest_wavelength,
    roughness,
    smoothed,
)
from wearsim.scene.checks import by_line, key_of
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import FieldScene, PairScene, RigScene
from wearsim.scene.overrides import at_its_source
from wearsim.scene.prepared import Prepared, prepare
from wearsim.scene.read import CampaignScene
from wearsim.scene.setup import CampaignSetup, build, warnings_of
from wearsim.toml_faults import KeyPath

LARGEST_TILT = 1e-3
"""Roll that a scene may leave out without a warning [rad]: contact angles change by as
much.
"""


_Failed = Mapping[int, ContactError]
"""Errors of points without contact, by their row."""


def check_contact(
    scene: CampaignScene | PairScene,
    threads: int | None = None,
    prepared: Sequence[Prepared] | None = None,
) -> tuple[Fault, ...]:
    """Solve the contact of the new wheels at all points of a scene of `load_scene`.

    With FASTSIM, whatever the tangential model; on so many threads, by default all
    available. What is solved from each of its parts may be given, else it is solved
    here.

    Returns
    -------
    tuple of Fault
        Warnings: what runs, but deserves a second look before. In the order of files
        and lines.

    Raises
    ------
    SceneError
        With one fault for each block, class or watched shift at which a wheel has no
        contact, or its patch reaches the edge of a profile, or creep forces lift it;
        before these, with one for each measured profile whose noise decides the
        contact. Points are warnings where together they carry less of the wear than a
        campaign leaves out.
    """
    faults: list[Fault] = []
    warnings: list[Fault] = []
    threads = threads or available_cores()
    prepared = [prepare(part) for part in scene.parts] if prepared is None else prepared
    for part, prepared_part in zip(scene.parts, prepared, strict=True):
        setup, places = build(part, prepared_part), prepared_part.places
        try:
            # a contact that noise decides has no faults of the scene
            if noise := noise_faults(part, setup, threads):
                faults += noise
                continue
            warnings += noise_warnings(part, setup, threads)
            failed, share = _failed(setup, threads)
        except ContactError as error:  # of no point: the grid
            faults.append(part.fault(("contact",), str(error)))
            continue
        point_faults = _faults(part, setup, places, failed)
        if point_faults and share > LARGEST_SHARE:
            faults += point_faults
            continue
        text = (
            f"; such points are left out, together they carry {100.0 * share:.2g} % "
            "of the wear"
        )
        point_faults = [
            replace(fault, message=f"{fault.message}{text}") for fault in point_faults
        ]
        warnings += by_line(
            [
                *point_faults,
                *warnings_of(part, prepared_part),
                *_roll_warnings(part, setup, places, failed),
            ]
        )
    if faults:
        raise SceneError([at_its_source(fault) for fault in faults])
    return tuple(warnings)


def _failed(
    setup: CampaignSetup, threads: int
) -> tuple[dict[int, ContactError], float]:
    """Errors of points without contact, and the share of the wear they carry.

    Inf if one only watches.
    """
    points, wear, failed = setup.points, setup.wear, dict[int, ContactError]()

    def worn(solution: ContactSolution) -> tuple[IntArray, FloatArray]:
        depth = np.sum(passage_depth(solution.fields, solution.area, wear), axis=(0, 2))
        return solution.point, depth * solution.patch.width

    problem = (
        setup.wheelset,
        setup.counterface,
        replace(setup.models, tangential="fastsim"),
    )
    parts = solve_each(
        points.conditions,
        *problem,
        worn,
        threads=threads,
        failed=failed,
        fields=wear.needs_fields or "work",
    )
    if not failed:
        return failed, 0.0
    point, area = (np.concatenate(values) for values in zip(*parts, strict=True))
    out = mask_of(failed, len(points.label))
    if (points.weight[out] == 0.0).any():
        return failed, np.inf
    rate = np.where(out, np.nan, np.bincount(point, area, out.size))
    return failed, carried_share(
        points.weight * points.environment, points.of_class, rate, out
    )


def _faults(
    scene: RigScene | FieldScene,
    setup: CampaignSetup,
    places: Sequence[KeyPath],
    failed: _Failed,
) -> list[Fault]:
    """Fault of the first failed point of each place."""
    faults: dict[KeyPath, Fault] = {}
    conditions = setup.points.conditions
    problem = (
        setup.wheelset,
        setup.counterface,
        replace(setup.models, tangential="fastsim"),
    )
    for row, error in sorted(failed.items()):
        place = places[row]
        # a point that does not converge is no fault of the scene; the run reports it
        if place in faults or isinstance(error, NumericalError):
            continue
        if (
            error.row != row
        ):  # several that failed together share the error of the first one
            try:
                solve_each(conditions.at(np.array([row])), *problem, lambda _: None)
            except ContactError as error_alone:
                error = error_alone
        wheel = (
            "wheelset"
            if error.side is None
            else "left wheel"
            if error.side
            else "right wheel"
        )
        reach = (
            f"check the shift, gauge_mm = {scene.counterface.gauge_mm:g} and how far "
            "both profiles reach"
        )
        text = error.reason.replace("check shift, gauge and profiles", reach)
        message = (
            f"{key_of(place)}: at a shift of "
            f"{1e3 * conditions.axle_shift()[row]:.4g} mm and a yaw of "
            f"{1e3 * conditions.yaw[row]:.4g} mrad the {wheel} cannot carry its load: "
            f"{text}"
        )
        faults[place] = scene.fault(place, message)
    return by_line(list(faults.values()))


def _roll_warnings(
    scene: RigScene | FieldScene,
    setup: CampaignSetup,
    places: Sequence[KeyPath],
    failed: _Failed,
) -> list[Fault]:
    """Where the wheelset would roll much further.

    The worst outermost point of each block or class.
    """
    conditions = setup.points.conditions
    shift = conditions.axle_shift()
    if conditions.free_roll:
        return []
    rows = defaultdict[KeyPath, list[int]](list)
    for row, place in enumerate(places):
        if row not in failed and "monitor" not in place:
            rows[place].append(row)
    ends = {
        pick(class_rows, key=shift.__getitem__)
        for class_rows in rows.values()
        for pick in (min, max)
    }
    # how far it rolls hardly depends on the models
    models = replace(
        setup.models, normal="kik_piotrowski", tangential="fastsim", strips=16, cells=16
    )
    index = np.array(sorted(ends), dtype=np.int64)
    free = replace(conditions.at(index), free_roll=True)
    resting: dict[int, float] = {}

    def roll(solution: ContactSolution) -> None:
        resting.update(
            zip(index[solution.point].tolist(), solution.roll.tolist(), strict=True)
        )

    solve_each(
        free, setup.wheelset, setup.counterface, models, roll, failed={}, fields="work"
    )
    tilt = {row: abs(resting[row] - conditions.roll[row]) for row in sorted(resting)}
    worst: dict[KeyPath, int] = {}
    for row in sorted(tilt, key=lambda row: -tilt[row]):
        if tilt[row] > LARGEST_TILT:
            worst.setdefault(places[row], row)
    warnings = []
    for place, row in worst.items():
        text = (
            f"roll_mrad = {1e3 * conditions.roll[row]:.4g}: at a shift of "
            f"{1e3 * shift[row]:.3g} mm the wheelset rests on both wheels at a roll of "
            f'{1e3 * resting[row]:.2g} mrad; give that roll, or roll = "free" in '
            "[contact], or smaller shifts"
        )
        warnings.append(scene.fault((*place[:3], "roll_mrad"), text))
    return warnings


DECIDES = 0.8
"""RMS change of pressure by noise over the largest pressure, from which noise decides
the contact: a little above the 0.71 at which valleys of a wave leave the contact, where
patches of the noise begin to appear.
"""
# that is left by the smoothing a fault names: it changes pressures by some per cent
_CURED = 0.1
_SUSPECT = 0.02  # RMS change of pressure by noise from which contacts are compared [-]
_NEAR = 3e-3  # of a patch on either side, within which the noise of points counts [m]
_CALM = 4e-3  # wavelength of the smoothing for the contact without noise [m]
_LEAST_PRESSURE = 0.3e9  # noise that changes this one by less is of no interest [Pa]
_LEAST_SHARE = 0.01  # of the load: noise of patches that carry less is of no interest
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
    """Patches between profiles without noise: largest pressure, and their ends on wheel
    and counterface.
    """

    row: IntArray
    side: IntArray
    pressure: FloatArray
    wheel_y: FloatArray
    counterface_y: FloatArray


def noise_faults(
    scene: RigScene | FieldScene, setup: CampaignSetup, threads: int
) -> list[Fault]:
    r"""Faults of measured profiles whose noise decides the contact at a point.

    At most one for each profile; `setup` is that of the scene.

    Notes
    -----
    A wave of height :math:`\hat h` and wavenumber q on one of two bodies changes the
    pressure between them, where they touch all over, by :math:`E^* q \hat h / 2` with
    :math:`E^* = E/(2 (1 - \nu^2))` [1]_: the RMS change of pressure is :math:`E^*/2`
    times the RMS slope of the noise. Where the amplitude of a wave of that RMS exceeds
    the largest pressure, its valleys leave the contact, and the patch falls apart into
    patches of the noise.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, section
           13.2.
    """
    bodies, modulus = list(_bodies(scene, setup)), setup.models.effective_modulus
    slopes = [
        float(np.sqrt(np.mean(roughness(body.profile).slope ** 2))) for body in bodies
    ]
    if 0.5 * modulus * max(slopes, default=0.0) <= DECIDES * _LEAST_PRESSURE:
        return []
    calm = tuple(map(_without_noise, _profiles(setup)))
    contacts = _contacts(setup, calm, threads)
    deciding = [
        noise
        for body in bodies
        if (noise := _decisive_noise(body, contacts, modulus)).share > DECIDES
    ]
    # one wavelength cures both wheels
    longest = {
        noise.path[0]: noise.wavelength
        for noise in sorted(deciding, key=lambda noise: noise.wavelength)
    }
    return [
        scene.fault(
            noise.path, _noise_text(scene, setup, noise, longest[noise.path[0]])
        )
        for noise in deciding
    ]


def _bodies(scene: RigScene | FieldScene, setup: CampaignSetup) -> Iterator[_Noise]:
    names = {
        file.role: file.name for file in inputs_of(scene).files if not file.shipped
    }
    right, left = setup.wheelset.right, setup.wheelset.left
    for body in (
        _Noise(("wheelset", "profile"), "", right, (0, 1) if left is right else (0,)),
        _Noise(("wheelset", "profile_left"), "", left, (1,)),
        _Noise(("counterface", "profile"), "", setup.counterface.profile, (0, 1)),
    ):
        name = names.get(".".join(body.path))
        if name is not None and longest_wavelength(body.profile) >= ROUGH_BELOW:
            yield body._replace(name=name)


def noise_warnings(
    scene: RigScene | FieldScene, setup: CampaignSetup, threads: int
) -> list[Fault]:
    """Warnings of measured profiles whose noise changes the contact by more than 5 %.

    Noise is that of points, see `profile.point_noise`: of rounding, too, and of points
    far apart. Where it lets expect a change, the contact is solved with and without.
    """
    bodies, modulus = list(_bodies(scene, setup)), setup.models.effective_modulus
    measured = inputs_of(scene).measured
    bodies = [body for body in bodies if ".".join(body.path) in measured]
    files = {body.path: measured[".".join(body.path)] for body in bodies}
    quick = [point_noise(file) for file in files.values()]
    if all(
        noise is None or noise.share(modulus, _LEAST_PRESSURE) < _SUSPECT
        for noise in quick
    ):
        return []
    raw = _contacts(setup, _profiles(setup), threads)
    noisy = [
        (body, *worst)
        for body in bodies
        if (worst := _noisiest(body, files[body.path], raw, modulus)) is not None
    ]
    cures = {id(body.profile): cure for body, _, cure, _ in noisy}
    smooth = tuple(
        smoothed(profile, cures[id(profile)]) if id(profile) in cures else profile
        for profile in _profiles(setup)
    )
    if not noisy:
        return []
    before = _largest_pressures(raw)
    after = _largest_pressures(_contacts(setup, smooth, threads))
    changes = {
        key: before[key] / after[key] - 1.0 for key in before.keys() & after.keys()
    }
    worst_key = max(changes, key=lambda key: abs(changes[key]), default=None)
    if worst_key is None or abs(changes[worst_key]) <= NOTABLE:
        return []
    shift = setup.points.conditions.axle_shift()[worst_key[0]]
    warnings = []
    for body, noise, cure, left in noisy:
        table, key = body.path
        text = (
            f"{key} = {shown(body.name)}: {noise.words} changes the largest pressure "
            f"by {100.0 * changes[worst_key]:+.2g} % at a shift of "
            f"{1e3 * shift:.4g} mm; write smooth_mm = {1e3 * cure:g} in [{table}], "
            f"which leaves about {100.0 * left:.2g} % (rms)"
        )
        warnings.append(scene.fault(body.path, text))
    return warnings


def _noisiest(
    body: _Noise, file: Profile, contacts: _Contacts, modulus: float
) -> tuple[PointNoise, float, float] | None:
    """Noise of a profile where it acts most, and the wavelength that cures it [m].

    With the RMS change of pressure that is left [-]. `file` has the points as they were
    measured. None if it lets expect no change of the contact.
    """
    y = file.y
    ends = contacts.counterface_y if body.path[0] == "counterface" else contacts.wheel_y
    noisiest: tuple[PointNoise, float, float] | None = None
    highest = _SUSPECT
    for patch in np.flatnonzero(np.isin(contacts.side, body.sides)).tolist():
        first, last = ends[patch]
        noise = point_noise(file, (y > first - _NEAR) & (y < last + _NEAR))
        pressure = float(contacts.pressure[patch])
        if noise is not None and noise.share(modulus, pressure) > highest:
            highest = noise.share(modulus, pressure)
            cure = noise.curing_wavelength(modulus, pressure)
            cure = min(cure, longest_wavelength(file))
            noisiest = noise, cure, noise.left(modulus, pressure, cure)
    return noisiest


def _largest_pressures(contacts: _Contacts) -> dict[tuple[int, int], float]:
    """Largest pressure by operating point and side [Pa]."""
    largest: dict[tuple[int, int], float] = {}
    for row, side, pressure in zip(
        contacts.row.tolist(),
        contacts.side.tolist(),
        contacts.pressure.tolist(),
        strict=True,
    ):
        largest[row, side] = max(pressure, largest.get((row, side), 0.0))
    return largest


def _profiles(setup: CampaignSetup) -> tuple[Profile, Profile, Profile]:
    """Profiles of the right and the left wheel and of the counterface."""
    wheelset = setup.wheelset
    return wheelset.right, wheelset.left, setup.counterface.profile


def _contacts(
    setup: CampaignSetup, profiles: Sequence[Profile], threads: int
) -> _Contacts:
    """Patches of all points that have a solution, but those that carry little.

    Profiles are those of the right and the left wheel and of the counterface.
    """
    right, left, profile = profiles
    wheelset = replace(setup.wheelset, right=right, left=left)
    counterface = replace(setup.counterface, profile=profile)

    def patches(solution: ContactSolution) -> _Contacts:
        loaded = (
            solution.normal_force
            > _LEAST_SHARE * conditions.loads.max(axis=1)[solution.point]
        )
        edges = (
            solution.strip_edges_wheel_y[loaded],
            solution.strip_edges_rail_y[loaded],
        )
        ends = [
            np.column_stack((strip_edges.min(axis=1), strip_edges.max(axis=1)))
            for strip_edges in edges
        ]
        point, side = solution.point[loaded], solution.side[loaded]
        return _Contacts(point, side, solution.max_pressure[loaded], *ends)

    models = replace(setup.models, tangential="fastsim")
    conditions = setup.points.conditions
    parts = solve_each(
        conditions, wheelset, counterface, models, patches, threads=threads, failed={}
    )
    return _Contacts(*map(np.concatenate, zip(*parts, strict=True)))


def _without_noise(profile: Profile) -> Profile:
    return smoothed(profile, min(_CALM, longest_wavelength(profile)))


def _decisive_noise(body: _Noise, contacts: _Contacts, modulus: float) -> _Noise:
    """Noise of a profile where it changes the contact most, if it decides it."""
    profile, rough = body.profile, roughness(body.profile)
    arc, rising_y = arc_length(profile.y, profile.z), np.maximum.accumulate(profile.y)
    ends = contacts.counterface_y if body.path[0] == "counterface" else contacts.wheel_y
    share = 0.0
    worst = 0
    where = np.ones(profile.y.size, dtype=bool)
    for patch in np.flatnonzero(np.isin(contacts.side, body.sides)).tolist():
        first, last = arc[
            np.searchsorted(rising_y, ends[patch]).clip(0, profile.y.size - 1)
        ]
        inside = (arc >= first - _AROUND) & (arc <= last + _AROUND)
        pressure_change = (
            0.5
            * modulus
            * float(np.sqrt(np.mean(rough.slope[inside] ** 2)))
            / contacts.pressure[patch]
        )
        if pressure_change > share:
            share = pressure_change
            worst = patch
            where = inside
    if share <= DECIDES:
        return body
    needed = rough.wavelength(
        where, _CURED * 2.0 * float(contacts.pressure[worst]) / modulus
    )
    return body._replace(
        row=int(contacts.row[worst]),
        share=share,
        height=float(np.sqrt(np.mean(rough.height[where] ** 2))),
        wavelength=_STEP * float(np.ceil(needed / _STEP)),
    )


def _noise_text(
    scene: RigScene | FieldScene, setup: CampaignSetup, body: _Noise, wavelength: float
) -> str:
    """Message on a profile whose section a smoothing `wavelength` [m] would cure."""
    (table, key), profile = body.path, body.profile
    conditions = setup.points.conditions
    given, shift = getattr(scene, table).smooth_mm, conditions.axle_shift()[body.row]
    noise = (
        f"{key} = {shown(body.name)}: noise of {1e6 * body.height:.2g} um rms in "
        f"wavelengths below {1e3 * ROUGH_BELOW:g} mm decides the contact: at a shift "
        f"of {1e3 * shift:.4g} mm it changes pressures by {100.0 * body.share:.0f} % "
        f"of the largest (rms, {100.0 * DECIDES:.0f} % allowed)"
    )
    wavelength = max(wavelength, _STEP + 1e-3 * (given or 0.0))
    longest = min(_LONGEST, longest_wavelength(profile))
    if wavelength > longest:
        return (
            f"{noise}; smooth_mm up to {1e3 * longest:.3g} does not cure it: measure "
            "the profile again"
        )
    moved = np.abs(change(profile, smoothed(profile, wavelength)))
    tread = profile.y > _FLANGE
    parts = {
        "the tread": tread,
        "the flange": ~tread & (np.arange(tread.size) > profile.z.argmax()),
    }
    if table == "counterface":
        parts = {"the profile": np.ones(moved.size, dtype=bool)}
    changes = " and ".join(
        f"{part} by up to {1e6 * moved[mask].max():.2g} um"
        for part, mask in parts.items()
        if mask.any()
    )
    instead = "" if given is None else f" in place of {given:g}"
    return (
        f"{noise}; write smooth_mm = {1e3 * wavelength:g}{instead} in [{table}], "
        f"which moves {changes}"
    )
