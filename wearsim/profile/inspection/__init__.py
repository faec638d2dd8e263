"""What `wearsim profile` computes of one profile: measures, limits, wear, running behaviour, reprofiling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from wearsim.errors import ProfileError
from wearsim.profile.alignment import HOLD_TREAD, Alignment, align
from wearsim.profile.conicity import AMPLITUDES, Running, running
from wearsim.profile.inspection import inputs
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.limits import Judgement, LimitSet, judge_wheelset
from wearsim.profile.measures import (
    GaugeDistances,
    Measures,
    axle_measures,
    running_circle_level,
    wheel_measures,
)
from wearsim.profile.placement import BACK_TO_BACK, GAUGE
from wearsim.profile.reprofiling import Reprofiling, reprofile, reprofile_axle
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed
from wearsim.profile.worn import WearBetween, wear_between

COUNTERPART = {"wheel": "60E1", "rail": "S1002"}
_LARGE_REST = 50e-6  # left on the zones of a best fit, not explained by noise of an instrument [m]

IF_STATED = ("wheel_diameter", "wheel_diameter_difference", "back_to_back", "front_to_front")
"""Measures that are there only if something is stated."""

_GAUGED_AT = {
    "below_tip": {"flange_gradient"},
    "level": {"flange_thickness", "flange_gradient", "front_to_front"},
    "flange_back": {"flange_height", "flange_thickness", "flange_gradient", "front_to_front"},
}


@dataclass(frozen=True)
class Conditions:
    """What is stated about a wheelset, its track and the ways of measuring, SI units; None: not stated."""

    distances: GaugeDistances = field(default_factory=GaugeDistances)  # running circle: the next one counts
    running_circle: float | None = None  # from the flange back [m]; that of the wheel if not stated
    back_to_back: float | None = None  # `BACK_TO_BACK` acts if not stated, without being judged [m]
    gauge: float = GAUGE
    diameter: float | None = None  # at the running circle as it is now [m]
    left_diameter: float | None = None
    inclination: float | None = None  # of the rail, see `inputs.placed` [-]
    counterpart: str | None = None  # rail under a wheel or wheel on a rail, name or file; else `COUNTERPART`
    smooth: float | None = None  # wavelength of the noise filter on measured profiles [m]
    align: str | None = None  # rule of alignment; else best_fit for measured profiles, none for standard ones
    rotate: bool = False  # whether the best fit may turn the profile, too
    statements: Mapping[str, Any] | None = None  # on files, see `read_profile`
    own_limits: bool = False  # meant for the stated distances; else gauge values at others are not judged

    @property
    def half_span(self) -> float:
        """From the track centre to the running circle [m]."""
        return 0.5 * (self.back_to_back or BACK_TO_BACK) + self.distances.flange_back


@dataclass(frozen=True)
class Comparison:
    """A profile against an earlier or new one."""

    reference: ProfileInput  # the other one, as it was compared
    alignment: Alignment  # how the profile was laid on it
    wear: WearBetween  # from the reference to the profile
    measures: Measures | None = None  # of the reference, if it is a wheel; unmoved, too
    running: Running | None = None  # of the reference

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the wear, or is hidden in it; a sentence each."""
        lines = []
        rule, rms = self.alignment.rule, self.alignment.rms
        if self.wear.worn_area < 0.0:
            lines.append(
                f"the net worn area is negative, which no wear is: {rule} does not fit these profiles, or "
                f"they are not of one {self.reference.kind}; try another rule with --align"
            )
        if rms is not None and rms > _LARGE_REST:
            lines.append(
                f"{1e6 * rms:.0f} µm rms are left on parts that do not wear, more than "
                f"{1e6 * _LARGE_REST:.0f}: wear of this size is uncertain; a profile measured at a tilt "
                "needs --rotate"
            )
        if held := HOLD_TREAD.get(rule):
            lines.append(
                f"{rule} lays the {held} on each other: wear there counts as none, and the sides seem to "
                "grow; best_fit shows it"
            )
        return tuple(lines)


@dataclass(frozen=True)
class Inspection:
    """All values of one profile."""

    given: ProfileInput  # as it was measured, smoothed if that was asked for; never moved
    left: ProfileInput | None  # left wheel that differs
    conditions: Conditions  # what was stated
    # of "right", "left" and "axle"; of alike wheels "right" only, with the values of the axle; none of rails
    measures: Mapping[str, Measures]
    limits: LimitSet | None  # what the measures were judged by
    judgements: tuple[tuple[str, Judgement], ...]  # with the key of `measures`; the axle by its smaller wheel
    running: Running | None  # on the counterpart; None where it cannot run there
    trouble: str  # why it cannot
    comparison: Comparison | None

    @property
    def aligned(self) -> Profile:
        """Profile as it lies on the one it is compared with; as measured, if it is not compared."""
        return self.given.profile if self.comparison is None else self.comparison.alignment.profile

    @property
    def exceeded(self) -> tuple[str, ...]:
        """Names of the measures beyond a limit."""
        return tuple(dict.fromkeys(each.measure for _, each in self.judgements if each.exceeded))

    @property
    def not_judged(self) -> tuple[str, ...]:
        """Names of the measures that have limits, but could not be compared with them."""
        return tuple(dict.fromkeys(each.measure for _, each in self.judgements if each.exceeded is None))


def inspect_profile(
    given: ProfileInput,
    conditions: Conditions | None = None,
    limits: LimitSet | None = None,
    *,
    left: ProfileInput | None = None,
    against: ProfileInput | None = None,
    amplitudes: tuple[float, ...] = AMPLITUDES,
    measure_reference: bool = True,
) -> Inspection:
    """Measure a wheel or rail profile.

    Parameters
    ----------
    given, left, against : ProfileInput
        Wheel or rail, left wheel that differs, and earlier or new profile of the same kind.
    conditions, limits : Conditions, LimitSet, optional
        What is stated, and what the measures of a wheel are judged by.
    amplitudes : tuple of float
        Of the conicity [m].
    measure_reference : bool
        Whether the other profile is measured, too.

    Raises
    ------
    ProfileError
        The profile cannot be smoothed, aligned or compared.
    """
    at = conditions or Conditions()
    circle = at.running_circle or given.running_circle
    at = replace(at, distances=replace(at.distances, flange_back=circle))
    given = _prepared(given, at)
    if left is not None:
        left = _prepared(left, at)
        given = given.noted(*inputs.axle_notes(given, left))
    if against is not None:
        given = given.noted(*inputs.comparison_notes(given, against))
    measures = _measures(given, left, at)
    if measures:
        given = _checked(given, measures["right"], at)
        left = left and _checked(left, measures["left"], at)
    run, trouble = _running(given, left, at, amplitudes)
    comparison = None
    if against is not None:
        before = _prepared(against, at)
        comparison = _compared(given, before, at)
        if measure_reference:
            comparison = replace(
                comparison,
                measures=_measures(before, None, at).get("right"),
                running=_running(before, None, at, amplitudes)[0],
            )
    judgements = _judged(measures, limits, run, at) if limits is not None else ()
    limits = limits if measures else None
    return Inspection(given, left, at, measures, limits, judgements, run, trouble, comparison)


def counterpart_of(kind: Kind, at: Conditions) -> ProfileInput:
    """Rail under a wheel, or wheel on a rail, as read; a wheel with y from the running circle that acts."""
    name = at.counterpart or COUNTERPART[kind]
    other = inputs.read_input(
        name, "rail" if kind == "wheel" else "wheel", at.statements if at.counterpart else None
    )
    return _prepared(other, replace(at, smooth=None)) if other.kind == "wheel" else other


def _checked(given: ProfileInput, measures: Measures, at: Conditions) -> ProfileInput:
    """Profile with warnings on its measures."""
    notes = inputs.header_notes(given, measures.values, _elsewhere(at.distances))
    return given.noted(*notes, *inputs.hollowing_notes(given, measures.values))


def _elsewhere(distances: GaugeDistances) -> set[str]:
    """Gauge values that other than the usual distances change."""
    usual = GaugeDistances()
    changed = (names for key, names in _GAUGED_AT.items() if getattr(distances, key) != getattr(usual, key))
    return set().union(*changed)


def _prepared(given: ProfileInput, at: Conditions) -> ProfileInput:
    """Profile with y from the running circle that acts, and, if measured, without its noise."""
    circle, wavelength = at.distances.flange_back, at.smooth
    given = given.noted(*inputs.placement_notes(given, at.inclination))
    if given.kind == "wheel" and given.running_circle != circle:
        moved = replace(given.profile, y=given.profile.y + (given.running_circle - circle))
        before = f"{given.running_circle * 1e3:g} before"
        given = replace(given, profile=moved).noted(
            f"y from a running circle {circle * 1e3:g} mm from the flange back, {before}"
        )
    if wavelength is None or not given.measured:
        return given
    return replace(given, profile=smoothed(given.profile, wavelength)).noted(
        f"waves shorter than {wavelength * 1e3:g} mm taken out"
    )


def _measures(given: ProfileInput, left: ProfileInput | None, at: Conditions) -> dict[str, Measures]:
    """Gauge values of the right wheel, of a left wheel that differs and of their axle."""
    if given.kind != "wheel":
        return {}
    right = wheel_measures(given.profile, at.distances, diameter=at.diameter or given.diameter)
    if left is None and at.left_diameter is None:
        axle = axle_measures(right, right, at.back_to_back)
        values, missing = {**right.values, **axle.values}, {**right.missing, **axle.missing}
        for known in (values, missing):
            known.pop("wheel_diameter_difference", None)  # there is none of one wheel
        return {"right": Measures(values, missing)}
    diameter = at.left_diameter or (None if left is None else left.diameter) or at.diameter
    other = wheel_measures((left or given).profile, at.distances, diameter=diameter)
    return {"right": right, "left": other, "axle": axle_measures(right, other, at.back_to_back)}


def _judged(
    measures: Mapping[str, Measures], limits: LimitSet, run: Running | None, at: Conditions
) -> tuple[tuple[str, Judgement], ...]:
    """Judgements of all bodies; the conicity is with the axle, or with the wheel if both are alike."""
    elsewhere = set() if at.own_limits else _elsewhere(at.distances)
    judgeable = {}
    for body, each in measures.items():
        # what nobody stated is not judged: only gauge values that should be there are reported as missing
        missing = {name: why for name, why in each.missing.items() if name not in IF_STATED}
        values = {name: value for name, value in each.values.items() if name not in elsewhere}
        other = "measured at other distances than those the limits are meant for"
        missing |= dict.fromkeys(elsewhere & each.values.keys(), other)
        conicity = run.judged_conicity if run and body == list(measures)[-1] else None
        if conicity is not None:
            values["equivalent_conicity"] = conicity
        judgeable[body] = Measures(values, missing)
    judged = judge_wheelset(judgeable, limits)
    return tuple((body, each) for body, judgements in judged.items() for each in judgements)


def _compared(given: ProfileInput, before: ProfileInput, at: Conditions) -> Comparison:
    """Wear between two profiles, the later one laid on the earlier one."""
    reference, after = _in_track(before, at), _in_track(given, at)
    rule = at.align or ("best_fit" if given.measured else "none")
    options = {"rotation": True} if at.rotate else {}
    alignment = align(after.profile, reference.profile, rule, **options)
    return Comparison(reference, alignment, wear_between(reference.profile, alignment.profile))


def _in_track(given: ProfileInput, at: Conditions) -> ProfileInput:
    """Place a rail in the track that does not stand there already."""
    if given.kind == "wheel" or not (given.upright or inputs.tilt_of(given, at.inclination)):
        return given
    profile = inputs.placed(given, at.inclination, at.gauge, at.half_span)
    note = f"placed in the track for the comparison: {_track_words(given, at)}"
    return replace(given, profile=profile).noted(note)


def _track_words(rail: ProfileInput, at: Conditions) -> str:
    """Rail, inclination, gauge and back-to-back distance in words."""
    tilt = inputs.tilt_of(rail, at.inclination)
    as_it_is = "upright" if rail.upright else "as measured" if rail.measured else "as defined"
    leans = f"1:{1.0 / tilt:g}" if tilt else as_it_is
    back = "assumed" if at.back_to_back is None else "stated"
    return (
        f"{rail.profile.name} {leans}, gauge {at.gauge * 1e3:g} mm, back-to-back distance "
        f"{(at.back_to_back or BACK_TO_BACK) * 1e3:g} mm ({back})"
    )


def _running(
    given: ProfileInput, left: ProfileInput | None, at: Conditions, amplitudes: tuple[float, ...]
) -> tuple[Running | None, str]:
    """Return the running behaviour on the counterpart, or why there is none."""
    counterpart = counterpart_of(given.kind, at)
    rail, wheel = (counterpart, given) if given.kind == "wheel" else (given, counterpart)
    diameter = at.diameter or given.diameter
    left_diameter = at.left_diameter or (None if left is None else left.diameter)
    more = diameter - left_diameter if diameter is not None and left_diameter is not None else 0.0
    try:
        in_track = inputs.placed(rail, at.inclination, at.gauge, at.half_span)
        words = _track_words(rail, at)
        # of standard shapes that goes without saying
        words += ", both rails alike" if rail.measured else ""
        words += ", both wheels alike" if wheel.measured and left is None and not more else ""
        other = None if left is None else left.profile
        return running(wheel.profile, other, in_track, words, more, amplitudes), ""
    except ProfileError as error:
        return None, str(error)


@dataclass(frozen=True)
class ReprofiledWheel:
    """One wheel after reprofiling."""

    side: str  # "right", "left", or "" of a wheel by itself
    reprofiling: Reprofiling  # to the template
    diameter: float | None  # at the running circle afterwards [m]; None: that before is not known

    @property
    def diameter_loss(self) -> float:
        """Loss on the lathe [m]."""
        return 2.0 * self.reprofiling.radius_loss


def reprofiled_wheels(inspection: Inspection, template: ProfileInput) -> tuple[ReprofiledWheel, ...]:
    """Reprofile what was inspected to a template: one wheel, or right and left of an axle to one diameter.

    Of an axle with a diameter that is not known, both are taken for equal at their running circles. Raises
    `ProfileError` as `wearsim.profile.reprofiling.reprofile` does.
    """
    right, left = inspection.given.profile, inspection.left
    before = {side: each.values.get("wheel_diameter") for side, each in inspection.measures.items()}
    diameter, other = before.get("right"), before.get("left")
    if left is None:
        one = reprofile(right, template.profile)
        return (ReprofiledWheel("", one, None if diameter is None else diameter - 2.0 * one.radius_loss),)
    known = diameter is not None and other is not None
    radii = [
        0.5 * (each if known and each else 0.0) - running_circle_level(wheel.y, wheel.z)
        for wheel, each in ((right, diameter), (left.profile, other))
    ]
    both = reprofile_axle(right, left.profile, (template.profile, template.profile), (radii[0], radii[1]))
    return tuple(
        ReprofiledWheel(side, one, each - 2.0 * one.radius_loss if known and each is not None else None)
        for side, one, each in zip(("right", "left"), both, (diameter, other), strict=True)
    )
