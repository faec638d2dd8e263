"""Inspection of a profile: measures, limits, wear, running behaviour, reprofiling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from wearsim.errors import ProfileError
from wearsim.profile.alignment import Alignment, align
from wearsim.profile.conicity import AMPLITUDES, JUDGED_AMPLITUDE, Running, running
from wearsim.profile.inspection import inputs
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.limits import Judgement, LimitSet, judge
from wearsim.profile.measures import (
    LEVEL,
    Measures,
    MeasuringRule,
    axle_measures,
    running_circle_level,
    wheel_measures,
)
from wearsim.profile.placement import BACK_TO_BACK, GAUGE, RUNNING_CIRCLE
from wearsim.profile.point_noise import noise_note
from wearsim.profile.reprofiling import reprofile, reprofile_axle
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed
from wearsim.profile.worn import WearBetween, wear_between

COUNTERPART = {"wheel": "60E1", "rail": "S1002"}
# Residual in the zones of a best fit that noise of an instrument does not explain [m].
_LARGE_REST = 50e-6


@dataclass(frozen=True)
class Conditions:
    """Data of a wheelset, its track and the measuring method in SI units.

    None means that a value is not stated.
    """

    # back-to-back distance [m]; if not stated, `BACK_TO_BACK` is used without
    # comparison with limits
    back_to_back: float | None = None
    gauge: float = GAUGE
    diameter: float | None = None  # at the running circle as it is now [m]
    left_diameter: float | None = None
    inclination: float | None = None  # of the rail, see `inputs.placed` [-]
    counterpart: str | None = (
        None  # rail under a wheel or wheel on a rail, name or file; else `COUNTERPART`
    )
    smooth: float | None = (
        None  # wavelength of the noise filter on measured profiles [m]
    )
    align: str | None = (
        # rule of alignment; else best_fit for measured profiles, none for standard ones
        None
    )
    rotate: bool = False  # True if the best fit may also rotate the profile
    measuring_height: float = LEVEL  # of Sd above the running circle [m]
    running_circle: float = RUNNING_CIRCLE  # distance from the flange back [m]
    # of the conicity, besides `AMPLITUDES` [m]
    amplitudes: tuple[float, ...] = ()
    no_limits: str = ""  # reason why no limits are compared
    statements: Mapping[str, Any] | None = None  # on files, see `read_profile`

    @property
    def half_span(self) -> float:
        """From the track centre to the running circle [m]."""
        return 0.5 * (self.back_to_back or BACK_TO_BACK) + RUNNING_CIRCLE

    @property
    def rule(self) -> MeasuringRule:
        """Places at which the gauge values are measured."""
        return MeasuringRule(self.measuring_height, self.running_circle)

    @property
    def conicity_amplitudes(self) -> tuple[float, ...]:
        """Amplitudes of the conicity in rising order [m]."""
        return tuple(sorted({*AMPLITUDES, *self.amplitudes}))


@dataclass(frozen=True)
class Comparison:
    """Comparison of a profile with an earlier or new one."""

    reference: ProfileInput  # reference profile as compared
    alignment: Alignment  # alignment of the profile with the reference
    wear: WearBetween  # from the reference to the profile
    # measures of the reference, if it is a wheel; never moved
    measures: Measures | None = None
    running: Running | None = None  # of the reference

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings against the computed wear, one sentence each."""
        lines = []
        if self.wear.worn_area < 0.0:
            lines.append(
                "the net worn area is negative, which no wear is: they are not of one "
                f"{self.reference.kind}, or --align {self.alignment.rule} does not fit "
                "them"
            )
        rms = self.alignment.rms
        if rms is not None and rms > _LARGE_REST:
            lines.append(
                f"{1e6 * rms:.0f} µm rms are left on parts that do not wear, more than "
                f"{1e6 * _LARGE_REST:.0f}: wear of this size is uncertain; a profile "
                "measured at a tilt needs --rotate"
            )
        return tuple(lines)


@dataclass(frozen=True)
class Inspection:
    """All values of one profile."""

    # profile as measured, smoothed on request, never moved
    given: ProfileInput
    left: ProfileInput | None  # left wheel that differs
    conditions: Conditions  # stated conditions
    # Measures of "right", "left" and "axle"; equal wheels have "right" only, with the
    # values of the axle; rails have none.
    measures: Mapping[str, Measures]
    limits: LimitSet | None  # limits of the measures
    judgements: tuple[Judgement, ...]
    # running behaviour on the counterpart; None if it cannot run there
    running: Running | None
    trouble: str  # reason why it cannot run
    comparison: Comparison | None

    @property
    def aligned(self) -> Profile:
        """Profile aligned with the one it is compared with.

        Without comparison it is as measured.
        """
        return (
            self.given.profile
            if self.comparison is None
            else self.comparison.alignment.profile
        )

    def beyond(self, *wheels: str) -> list[str]:
        """Names of the measures beyond a limit, of some wheels or of all."""
        exceeded = (
            judgement
            for judgement in self.judgements
            if judgement.exceeded and judgement.wheel in (wheels or self.measures)
        )
        return list(dict.fromkeys(judgement.measure for judgement in exceeded))

    @property
    def not_judged(self) -> list[str]:
        """Names of the measures with limits that could not be compared with them."""
        return list(
            dict.fromkeys(
                judgement.measure
                for judgement in self.judgements
                if judgement.exceeded is None
            )
        )


def inspect_profile(
    given: ProfileInput,
    conditions: Conditions | None = None,
    limits: LimitSet | None = None,
    *,
    left: ProfileInput | None = None,
    against: ProfileInput | None = None,
    brief: bool = False,
) -> Inspection:
    """Measure a wheel or rail profile.

    Parameters
    ----------
    given, left, against : ProfileInput
        Wheel or rail, left wheel that differs, and earlier or new profile of the same
        kind.
    conditions, limits : Conditions, LimitSet, optional
        Stated conditions, and limits of the measures of a wheel.
    brief : bool
        True to compute one amplitude of the conicity alone, and no values of the other
        profile.

    Raises
    ------
    ProfileError
        The profile cannot be smoothed, aligned or compared.
    """
    at = conditions or Conditions()
    given = _prepared(given, at)
    left, against = left and _prepared(left, at), against and _prepared(against, at)
    measures = _measures(given, left, at)
    if measures:
        given = given.noted(*inputs.measure_notes(given, measures["right"].values))
        left = left and left.noted(*inputs.measure_notes(left, measures["left"].values))
    amplitudes = (JUDGED_AMPLITUDE,) if brief else at.conicity_amplitudes
    run, trouble = _running(given, left, at, amplitudes)
    comparison = None if against is None else _compared(given, against, at)
    if comparison is not None and against is not None and not brief:
        before = _measures(against, None, at).get("right")
        comparison = replace(
            comparison,
            measures=before,
            running=_running(against, None, at, amplitudes)[0],
        )
    judgeable = dict(measures)
    if measures and run is not None and (conicity := run.judged_conicity) is not None:
        body, last = list(measures.items())[-1]  # body of the axle, if there is one
        judgeable[body] = replace(
            last, values={**last.values, "equivalent_conicity": conicity}
        )
    limits = limits if measures else None
    judgements = () if limits is None else tuple(judge(judgeable, limits, at.rule))
    return Inspection(
        given, left, at, measures, limits, judgements, run, trouble, comparison
    )


def counterpart_of(kind: Kind, at: Conditions) -> ProfileInput:
    """Rail under a wheel, or wheel on a rail, as read."""
    counterpart_kind: Kind = "rail" if kind == "wheel" else "wheel"
    if at.counterpart is None:
        return inputs.read_input(COUNTERPART[kind], counterpart_kind)
    return inputs.read_input(at.counterpart, counterpart_kind, at.statements)


def _prepared(given: ProfileInput, at: Conditions) -> ProfileInput:
    """Profile with a note on its placement and, if measured, without its noise."""
    given = given.noted(*inputs.placement_notes(given, at.inclination))
    if not given.measured:
        return given
    if at.smooth is None:
        note = noise_note(given.profile)
        return given.noted(f"{note} (--smooth-mm)") if note else given
    return replace(given, profile=smoothed(given.profile, at.smooth)).noted(
        f"waves shorter than {at.smooth * 1e3:g} mm taken out"
    )


def _measures(
    given: ProfileInput, left: ProfileInput | None, at: Conditions
) -> dict[str, Measures]:
    """Gauge values of the right wheel, a different left wheel and their axle."""
    if given.kind != "wheel":
        return {}
    rule, right_diameter = at.rule, at.diameter or given.diameter
    right = wheel_measures(given.profile, diameter=right_diameter, rule=rule)
    if left is None and at.left_diameter is None:
        axle = dict(axle_measures(right, right, at.back_to_back).values)
        # a single wheel has no diameter difference
        axle.pop("wheel_diameter_difference", None)
        return {"right": replace(right, values={**right.values, **axle})}
    diameter = (
        at.left_diameter or (None if left is None else left.diameter) or at.diameter
    )
    left_measures = wheel_measures(
        (left or given).profile, diameter=diameter, rule=rule
    )
    return {
        "right": right,
        "left": left_measures,
        "axle": axle_measures(right, left_measures, at.back_to_back),
    }


def _compared(given: ProfileInput, before: ProfileInput, at: Conditions) -> Comparison:
    """Wear between two profiles, the later one aligned with the earlier one."""
    reference, after = _in_track(before, at), _in_track(given, at)
    rule = at.align or ("best_fit" if given.measured else "none")
    alignment = align(after.profile, reference.profile, rule, rotation=at.rotate)
    return Comparison(
        reference, alignment, wear_between(reference.profile, alignment.profile)
    )


def _in_track(given: ProfileInput, at: Conditions) -> ProfileInput:
    """Place a rail in the track, unless it is placed already."""
    if given.kind == "wheel" or not (
        given.upright or inputs.tilt_of(given, at.inclination)
    ):
        return given
    profile = inputs.placed(given, at.inclination, at.gauge, at.half_span)
    note = f"placed in the track for the comparison: {_track_words(given, at)}"
    return replace(given, profile=profile).noted(note)


def _track_words(rail: ProfileInput, at: Conditions) -> str:
    """Rail, inclination, gauge and back-to-back distance in words."""
    tilt = inputs.tilt_of(rail, at.inclination)
    as_it_is = (
        "upright" if rail.upright else "as measured" if rail.measured else "as defined"
    )
    leans = f"1:{1.0 / tilt:g}" if tilt else as_it_is
    back = "assumed" if at.back_to_back is None else "stated"
    return (
        f"{rail.profile.name} {leans}, gauge {at.gauge * 1e3:g} mm, back-to-back "
        f"distance {(at.back_to_back or BACK_TO_BACK) * 1e3:g} mm ({back})"
    )


def _running(
    given: ProfileInput,
    left: ProfileInput | None,
    at: Conditions,
    amplitudes: tuple[float, ...],
) -> tuple[Running | None, str]:
    """Return the running behaviour on the counterpart, or why there is none."""
    counterpart = counterpart_of(given.kind, at)
    rail, wheel = (
        (counterpart, given) if given.kind == "wheel" else (given, counterpart)
    )
    diameter = at.diameter or given.diameter
    left_diameter = at.left_diameter or (None if left is None else left.diameter)
    more = (
        diameter - left_diameter
        if diameter is not None and left_diameter is not None
        else 0.0
    )
    try:
        in_track = inputs.placed(rail, at.inclination, at.gauge, at.half_span)
        words = _track_words(rail, at)
        # obvious for standard shapes
        words += ", both rails alike" if rail.measured else ""
        words += (
            ", both wheels alike"
            if wheel.measured and left is None and not more
            else ""
        )
        left_profile = None if left is None else left.profile
        run = running(
            wheel.profile, left_profile, in_track, words, more, amplitudes, at.rule
        )
        return run, ""
    except ProfileError as error:
        return None, str(error)


@dataclass(frozen=True)
class ReprofiledWheel:
    """Wheel after reprofiling."""

    wheel: str  # "right" or "left"
    diameter_loss: float  # on the lathe [m]
    wheel_diameter: (
        float | None
    )  # at the running circle afterwards [m]; None: that before is not known
    place: float  # y of the tightest place [m]
    slack: float  # radius removed beyond what the wheel needs [m]
    # range of y in which the template was compared with the worn profile [m]
    compared: tuple[float, float]


def reprofiled_wheels(
    inspection: Inspection, template: ProfileInput
) -> tuple[ReprofiledWheel, ...]:
    """Reprofile an inspected wheel, or both wheels of an axle to one diameter.

    If the diameter of an axle is unknown, both wheels are taken as equal at their
    running circles. Raises `ProfileError` as `wearsim.profile.reprofiling.reprofile`
    does.
    """
    wheels = [inspection.given.profile] + (
        [inspection.left.profile] if inspection.left else []
    )
    sides = ("right", "left")[: len(wheels)]
    before = [inspection.measures[side].values.get("wheel_diameter") for side in sides]
    has_diameters = None not in before
    if len(wheels) == 1:
        new = [reprofile(wheels[0], template.profile)]
    else:
        right, left = (
            0.5 * (diameter if has_diameters and diameter else 0.0)
            - running_circle_level(wheel.y, wheel.z, inspection.conditions.rule)
            for wheel, diameter in zip(wheels, before, strict=True)
        )
        new = list(
            reprofile_axle(
                wheels[0],
                wheels[1],
                (template.profile, template.profile),
                (right, left),
            )
        )
    return tuple(
        ReprofiledWheel(
            side,
            2.0 * reprofiled.radius_loss,
            diameter - 2.0 * reprofiled.radius_loss
            if has_diameters and diameter is not None
            else None,
            reprofiled.place,
            reprofiled.slack,
            (reprofiled.start, reprofiled.end),
        )
        for side, reprofiled, diameter in zip(sides, new, before, strict=True)
    )
