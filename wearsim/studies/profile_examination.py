"""All that `wearsim profile` tells of one profile: measures, limits, wear, running behaviour."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from wearsim.errors import ProfileError
from wearsim.profile.alignment import HOLD_TREAD, Alignment, align
from wearsim.profile.limits import Judgement, LimitSet, judge, judge_wheelset
from wearsim.profile.measures import (
    GaugeDistances,
    Measures,
    WheelsetMeasures,
    wheel_measures,
    wheelset_measures,
)
from wearsim.profile.noise import smoothed
from wearsim.profile.shape import Profile
from wearsim.profile.worn import WearBetween, wear_between
from wearsim.studies.profile_doubts import header_notes, hollowing_notes
from wearsim.studies.profile_identity import axle_notes, comparison_notes
from wearsim.studies.profile_running import AMPLITUDES, Running, running
from wearsim.studies.profile_subject import Kind, Subject, placed, read_subject, tilt_of, told_stand

BACK_TO_BACK = 1.360
GAUGE = 1.435
JUDGED_AMPLITUDE = 3e-3
"""Amplitude of the conicity that limits speak of [m]."""

LARGE_REST = 50e-6
"""Distance left on the zones of a best fit that noise of an instrument does not explain [m]."""

_STATED = ("wheel_diameter", "wheel_diameter_difference", "back_to_back", "front_to_front")
COUNTERPART = {"wheel": "60E1", "rail": "S1002"}


@dataclass(frozen=True)
class Circumstances:
    """What is stated about a wheelset, its track and the ways of measuring, SI units; None: not stated.

    Parameters
    ----------
    distances : GaugeDistances
        Of Sh, Sd and qR; the tape circle is that of `tape`.
    tape : float or None
        Distance of the tape circle from the flange back; that of the wheel, see `Subject.tape`, if not
        stated [m].
    back_to_back, gauge : float or None
        `BACK_TO_BACK` and `GAUGE` act if not stated, without being judged [m].
    diameter, left_diameter : float or None
        At the tape circles as they are now [m].
    inclination : float or None
        Of the rail, see `profile_subject.placed` [-].
    counterpart : str or None
        Rail under a wheel or wheel on a rail, by name or file; `COUNTERPART` if not stated.
    smooth : float or None
        Wavelength of the noise filter on measured profiles [m].
    align : str or None
        Rule of `wearsim.profile.alignment`; if not stated, `best_fit` for measured profiles and `none` for
        standard shapes.
    rotate : bool
        Whether the best fit may turn the profile, too.
    said : mapping
        Statements on files, see `read_profile`.
    own_limits : bool
        Whether the limits are meant for the stated distances; else only gauge values at 2, 10 and 70 mm are
        judged.
    """

    distances: GaugeDistances
    tape: float | None = None
    back_to_back: float | None = None
    gauge: float | None = None
    diameter: float | None = None
    left_diameter: float | None = None
    inclination: float | None = None
    counterpart: str | None = None
    smooth: float | None = None
    align: str | None = None
    rotate: bool = False
    said: Mapping[str, Any] | None = None
    own_limits: bool = False

    @property
    def half_span(self) -> float:
        """From the track centre to the tape circle [m]."""
        return 0.5 * (self.back_to_back or BACK_TO_BACK) + self.distances.flange_back


@dataclass(frozen=True)
class Comparison:
    """A profile against an earlier or new one.

    Parameters
    ----------
    reference : Subject
        The other one, as it was compared.
    alignment : Alignment
        How the profile was laid on it.
    wear : WearBetween
        From the reference to the profile.
    measures : Measures or None
        Of the reference, if it is a wheel; unmoved, too.
    running : Running or None
        Of the reference.
    """

    reference: Subject
    alignment: Alignment
    wear: WearBetween
    measures: Measures | None
    running: Running | None

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against the wear that was found, or is hidden in it; a sentence each."""
        told = []
        rule, rms = self.alignment.rule, self.alignment.rms
        if self.wear.worn_area < 0.0:
            told.append(
                f"the net worn area is negative, which no wear is: {rule} does not fit these profiles, or "
                f"they are not of one {self.reference.kind}; try another rule with --align"
            )
        if rms is not None and rms > LARGE_REST:
            way = "" if self.alignment.angle else "; a profile measured at a tilt needs --rotate"
            told.append(
                f"{1e6 * rms:.0f} µm rms are left on parts that do not wear, more than "
                f"{1e6 * LARGE_REST:.0f}: wear of this size is doubtful{way}"
            )
        if rule in HOLD_TREAD:
            told.append(
                f"{rule} lays the tape circles on each other: wear there counts as none, the flange seems to "
                "grow; back_and_tip or best_fit tell the wear of the tread"
            )
        if rule == "top":
            told.append(
                "top lays the tops on each other: wear there counts as none, the sides of the head seem to "
                "grow; best_fit tells the wear of the top"
            )
        return tuple(told)


@dataclass(frozen=True)
class Examination:
    """All values of one profile.

    Parameters
    ----------
    subject : Subject
        With the profile as it was measured, smoothed if that was asked for; never moved.
    left : Subject or None
        Left wheel that differs.
    circumstances : Circumstances
        What was stated.
    measures, left_measures, axle_measures : Measures or None
        Of the wheels and of the axle; None of rails. If both wheels are alike, `measures` holds those of the
        axle, too, and the others are None.
    limits : LimitSet or None
        What the measures were judged by.
    judgements, left_judgements, axle_judgements : tuple of Judgement
        Of the measures; the conicity is with the axle, or with the wheel if both are alike. The axle is
        judged by its smaller wheel.
    running : Running or None
        On the counterpart; None where it cannot run there.
    trouble : str
        Why it cannot.
    comparison : Comparison or None
        Against another profile.
    """

    subject: Subject
    left: Subject | None
    circumstances: Circumstances
    measures: Measures | None
    left_measures: Measures | None
    axle_measures: Measures | None
    limits: LimitSet | None
    judgements: tuple[Judgement, ...]
    left_judgements: tuple[Judgement, ...]
    axle_judgements: tuple[Judgement, ...]
    running: Running | None
    trouble: str
    comparison: Comparison | None

    @property
    def laid(self) -> Profile:
        """Profile as it lies on the one it is compared with; as measured, if it is not compared."""
        return self.subject.profile if self.comparison is None else self.comparison.alignment.profile

    @property
    def exceeded(self) -> tuple[str, ...]:
        """Names of the measures beyond a limit."""
        return _names_of(each for each in self._all_judgements if each.exceeded)

    @property
    def not_judged(self) -> tuple[str, ...]:
        """Names of the measures that have limits, of which it cannot be told whether they are beyond."""
        return _names_of(each for each in self._all_judgements if each.exceeded is None)

    @property
    def _all_judgements(self) -> tuple[Judgement, ...]:
        return (*self.judgements, *self.left_judgements, *self.axle_judgements)


def _names_of(judgements: Iterable[Judgement]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(each.measure for each in judgements))


def examine(
    subject: Subject,
    at: Circumstances,
    limits: LimitSet | None = None,
    *,
    left: Subject | None = None,
    against: Subject | None = None,
    amplitudes: tuple[float, ...] = AMPLITUDES,
    measure_reference: bool = True,
) -> Examination:
    """Measure a profile.

    Parameters
    ----------
    subject : Subject
        Wheel or rail.
    at : Circumstances
        What is stated.
    limits : LimitSet, optional
        To judge the measures of a wheel by.
    left : Subject, optional
        Left wheel.
    against : Subject, optional
        Earlier or new profile of the same kind.
    amplitudes : tuple of float
        Of the conicity [m].
    measure_reference : bool
        Whether the other profile is measured, too.

    Returns
    -------
    Examination
        With the subject as measured.

    Raises
    ------
    ProfileError
        The profile cannot be smoothed, aligned or compared.
    """
    tape = at.tape or subject.tape
    at = replace(at, distances=replace(at.distances, flange_back=tape))
    subject = _prepared(subject, at)
    if left is not None:
        left = _prepared(left, at)
        subject = replace(subject, notes=(*subject.notes, *axle_notes(subject, left)))
    if against is not None:
        subject = replace(subject, notes=(*subject.notes, *comparison_notes(subject, against)))
    measures, left_measures, axle = _measures(subject, left, at)
    subject = _doubted(subject, measures, at)
    left = None if left is None else _doubted(left, left_measures, at)
    run, trouble = _running(subject, left, at, amplitudes)
    comparison = None
    if against is not None:
        before = _prepared(against, at)
        comparison = _compared(subject, before, at)
        if measure_reference:
            comparison = replace(
                comparison,
                measures=_measures(before, None, at)[0],
                running=_running(before, None, at, amplitudes)[0],
            )
    judged = _judged(measures, left_measures, axle, limits, run, at)
    return Examination(
        subject,
        left,
        at,
        measures,
        left_measures,
        axle,
        limits if measures is not None else None,
        tuple(judged.get("right", ())),
        tuple(judged.get("left", ())),
        tuple(judged.get("axle", ())),
        run,
        trouble,
        comparison,
    )


def _doubted(subject: Subject, measures: Measures | None, at: Circumstances) -> Subject:
    """Subject with notes on measures that are doubtful."""
    if measures is None:
        return subject
    notes = header_notes(subject, measures.values, _elsewhere(at.distances))
    return replace(subject, notes=(*subject.notes, *notes, *hollowing_notes(subject, measures.values)))


def _elsewhere(distances: GaugeDistances) -> set[str]:
    """Gauge values that other than the usual distances change."""
    usual, changed = GaugeDistances(), set()
    if distances.below_tip != usual.below_tip:
        changed |= {"flange_gradient"}
    if distances.level != usual.level:
        changed |= {"flange_thickness", "flange_gradient", "front_to_front"}
    if distances.flange_back != usual.flange_back:
        changed |= {"flange_height", "flange_thickness", "flange_gradient", "front_to_front"}
    return changed


def _judged(
    measures: Measures | None,
    left: Measures | None,
    axle: Measures | None,
    limits: LimitSet | None,
    run: Running | None,
    at: Circumstances,
) -> dict[str, list[Judgement]]:
    """Judgements of "right", "left" and "axle"; of all with "right" if both wheels are alike."""
    if measures is None or limits is None:
        return {}
    if left is None or axle is None:
        return {"right": judge(_judgeable(measures, run, at), limits)}
    wheelset = WheelsetMeasures(
        _judgeable(measures, None, at), _judgeable(left, None, at), _judgeable(axle, run, at)
    )
    return judge_wheelset(wheelset, limits)


def _judgeable(measures: Measures, run: Running | None, at: Circumstances) -> Measures:
    """Measures that limits apply to, and the conicity at 3 mm where the wheelset runs."""
    values = dict(measures.values)
    conicity = next((value for a, value, _ in run.conicity if a == JUDGED_AMPLITUDE), None) if run else None
    if conicity is not None:
        values["equivalent_conicity"] = conicity
    # what nobody stated is not judged: only gauge values that should be there are told as missing
    missing = {name: why for name, why in measures.missing.items() if name not in _STATED}
    for name in () if at.own_limits else _elsewhere(at.distances):
        if values.pop(name, None) is not None:
            missing[name] = "measured at other distances than those the limits are meant for"
    return Measures(values, missing)


def _in_track(subject: Subject, at: Circumstances) -> Subject:
    """Place a rail in the track that does not stand there already."""
    if subject.kind == "wheel" or not (subject.upright or tilt_of(subject, at.inclination)):
        return subject
    note = f"placed in the track for the comparison: {track_words(subject, at)}"
    profile = placed(subject, at.inclination, at.gauge or GAUGE, at.half_span)
    return replace(subject, profile=profile, notes=(*subject.notes, note))


def _compared(subject: Subject, before: Subject, at: Circumstances) -> Comparison:
    """Wear between two profiles, the later one laid on the earlier one."""
    reference, after = _in_track(before, at), _in_track(subject, at)
    rule = at.align or ("best_fit" if subject.measured else "none")
    options = {"rotation": True} if at.rotate else {}
    alignment = align(after.profile, reference.profile, rule, **options)
    wear = wear_between(reference.profile, alignment.profile)
    return Comparison(reference, alignment, wear, None, None)


def counterpart_of(kind: Kind, at: Circumstances) -> Subject:
    """Rail under a wheel, or wheel on a rail."""
    given = at.counterpart or COUNTERPART[kind]
    found = read_subject(given, "rail" if kind == "wheel" else "wheel", at.said if at.counterpart else None)
    return _prepared(found, replace(at, smooth=None)) if found.kind == "wheel" else found


def _prepared(subject: Subject, at: Circumstances) -> Subject:
    """Profile with y from the tape circle that acts, and, if measured, without its noise."""
    tape, wavelength = at.distances.flange_back, at.smooth
    subject = replace(subject, notes=(*subject.notes, *told_stand(subject, at.inclination)))
    if subject.kind == "wheel" and subject.tape != tape:
        moved = replace(subject.profile, y=subject.profile.y + (subject.tape - tape))
        note = f"y from a tape circle {tape * 1e3:g} mm from the flange back, {subject.tape * 1e3:g} before"
        subject = replace(subject, profile=moved, notes=(*subject.notes, note))
    if wavelength is None or not subject.measured:
        return subject
    note = f"waves shorter than {wavelength * 1e3:g} mm taken out"
    return replace(subject, profile=smoothed(subject.profile, wavelength), notes=(*subject.notes, note))


def _measures(
    subject: Subject, left: Subject | None, at: Circumstances
) -> tuple[Measures | None, Measures | None, Measures | None]:
    """Gauge values of the right wheel, of a left wheel that differs and of their axle.

    Of wheels that are alike there is one, with the values of the axle.
    """
    if subject.kind != "wheel":
        return None, None, None
    diameter = at.diameter or subject.diameter
    if left is None and at.left_diameter is None:
        alone = wheel_measures(subject.profile, at.distances, back_to_back=at.back_to_back)
        return _with_diameter(alone, diameter), None, None
    other = subject if left is None else left
    both = wheelset_measures(subject.profile, other.profile, at.distances, back_to_back=at.back_to_back)
    left_diameter = at.left_diameter or (None if left is None else left.diameter) or at.diameter
    axle, missing = dict(both.axle.values), dict(both.axle.missing)
    if diameter is not None and left_diameter is not None:
        axle["wheel_diameter_difference"] = diameter - left_diameter
        missing.pop("wheel_diameter_difference", None)
    return (
        _with_diameter(both.right, diameter),
        _with_diameter(both.left, left_diameter),
        Measures(axle, missing),
    )


def _with_diameter(measures: Measures, diameter: float | None) -> Measures:
    """Measures with the diameter at the tape circle, which no profile tells by itself."""
    missing = {name: why for name, why in measures.missing.items() if name != "wheel_diameter"}
    if diameter is None:
        return Measures(measures.values, {**missing, "wheel_diameter": "not stated (--diameter-mm)"})
    return Measures({**measures.values, "wheel_diameter": diameter}, missing)


def _running(
    subject: Subject, left: Subject | None, at: Circumstances, amplitudes: tuple[float, ...]
) -> tuple[Running | None, str]:
    """Compute the running behaviour on the counterpart, or why there is none."""
    counter = counterpart_of(subject.kind, at)
    rail_subject, wheel = (counter, subject) if subject.kind == "wheel" else (subject, counter)
    gauge = at.gauge or GAUGE
    try:
        rail = placed(rail_subject, at.inclination, gauge, at.half_span)
        other = None if left is None else left.profile
        words, more = track_words(rail_subject, at), _diameter_difference(subject, left, at)
        # of standard shapes that goes without saying
        words += ", both rails alike" if rail_subject.measured else ""
        words += ", both wheels alike" if wheel.measured and left is None and not more else ""
        return running(wheel.profile, other, rail, words, more, amplitudes), ""
    except ProfileError as error:
        return None, str(error)


def _diameter_difference(subject: Subject, left: Subject | None, at: Circumstances) -> float:
    """Right minus left diameter where both are known, else 0 [m]."""
    right = at.diameter or subject.diameter
    other = at.left_diameter or (None if left is None else left.diameter)
    return right - other if right is not None and other is not None else 0.0


def track_words(rail: Subject, at: Circumstances) -> str:
    """Rail, inclination, gauge and distance of the flange backs in words."""
    tilt = tilt_of(rail, at.inclination)
    stands = "upright" if rail.upright else "as measured" if rail.measured else "as defined"
    leans = f"1:{1.0 / tilt:g}" if tilt else stands
    back = "assumed" if at.back_to_back is None else "stated"
    return (
        f"{rail.profile.name} {leans}, gauge {(at.gauge or GAUGE) * 1e3:g} mm, flange backs "
        f"{(at.back_to_back or BACK_TO_BACK) * 1e3:g} mm apart ({back})"
    )
