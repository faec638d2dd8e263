"""Where a measured profile lies against a reference: rules that hold one unworn thing or another."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.best_fit import FEWEST, STEEPEST, FitZone, Move, best_fit, default_zones, prolonged
from wearsim.profile.shape import Profile

BACK_FROM = 8e-3
"""Depth below the flange tip from which the flange back is looked at [m]."""

TIP_HALF_WIDTH = 3e-3
"""Half the width around the tip, top or tape circle over which a parabola takes out the noise [m]."""

_EITHER_SIDE = 0.5e-3  # how far points must reach on both sides of it [m]
_TIP_ROUNDS = 20
_CLOSE = 1e-9  # change of the tip's place at which it is found [m]


@dataclass(frozen=True)
class Alignment:
    """A profile after alignment, and how it was moved.

    Parameters
    ----------
    profile : Profile
        Moved; its source says how.
    rule : str
        Key of `ALIGNMENTS`.
    dy, dz : float
        Shift, after the rotation [m].
    angle : float
        Rotation about the origin of the measured profile; turns y towards z [rad].
    rms : float or None
        Root mean square of the normal distances left on the zones used [m]; None for rules that hold
        single points.
    note : str
        What was held, in one sentence.
    """

    profile: Profile
    rule: str
    dy: float
    dz: float
    angle: float
    rms: float | None
    note: str


@dataclass(frozen=True)
class AlignmentRule:
    """One way to align.

    Parameters
    ----------
    find : callable
        `(profile, reference, **options) -> Move`; raises ProfileError with what the profile lacks.
    kinds : tuple of str
        Wheel, rail or both.
    title : str
        What it holds, for lists.
    """

    find: Callable[..., Move]
    kinds: tuple[str, ...]
    title: str


def align(profile: Profile, reference: Profile, rule: str, **options: object) -> Alignment:
    """Move a measured profile so that a stated part of it lies where the reference has it.

    Parameters
    ----------
    profile : Profile
        As measured.
    reference : Profile
        New shape, or an earlier measurement, in the axes wanted.
    rule : str
        Key of `ALIGNMENTS`.
    **options
        Of the rule: `lateral` (bool) of flange_tip; `rotation` (bool) and `zones` (tuple of FitZone) of
        best_fit.

    Returns
    -------
    Alignment
        With the moved profile.

    Raises
    ------
    ProfileError
        The rule is unknown or for the other kind, or the profile lacks what it holds; the message
        names the rules that would work.
    """
    if profile.kind != reference.kind:
        raise ProfileError(
            f"{profile.name} is a {profile.kind} and {reference.name} a {reference.kind}; align like with "
            "like"
        )
    known = [name for name, each in ALIGNMENTS.items() if profile.kind in each.kinds]
    if rule not in known:
        near = difflib.get_close_matches(rule, known, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ProfileError(f"{rule!r} is no rule of aligning a {profile.kind} ({', '.join(known)}){hint}")
    try:
        move = ALIGNMENTS[rule].find(profile, reference, **options)
    except ProfileError as error:
        working = [name for name in known if name not in (rule, "none") and _works(name, profile, reference)]
        way_out = f"align by {' or '.join(working)}" if working else "only 'none' is possible"
        raise ProfileError(f"{profile.name}: alignment by {rule}: {error}; {way_out}") from error
    c, s = math.cos(move.angle), math.sin(move.angle)
    moved = profile
    if move.dy or move.dz or move.angle:
        y = c * profile.y - s * profile.z + move.dy
        z = s * profile.y + c * profile.z + move.dz
        source = f"{profile.source}; aligned by {rule}" if profile.source else f"aligned by {rule}"
        moved = replace(profile, y=y, z=z, source=source)
    return Alignment(moved, rule, move.dy, move.dz, move.angle, move.rms, move.note)


def _works(rule: str, profile: Profile, reference: Profile) -> bool:
    try:
        ALIGNMENTS[rule].find(profile, reference)
    except ProfileError:
        return False
    return True


def _parabola(profile: Profile, index: int, at: float) -> tuple[float, float, float] | None:
    """Curvature/2, slope and height at y = `at` of the stretch around a point, None if it is too short.

    The stretch is the run of points around `index` that lie within `TIP_HALF_WIDTH`: other parts of the
    profile at the same y, such as the foot of a rail, are none of it.
    """
    sides = profile.y - at
    far = np.flatnonzero(np.abs(sides) > TIP_HALF_WIDTH)
    first = int(np.max(far[far < index], initial=-1)) + 1
    last = int(np.min(far[far > index], initial=len(sides)))
    sides, z = sides[first:last], profile.z[first:last]
    if len(sides) < FEWEST or sides.min() > -_EITHER_SIDE or sides.max() < _EITHER_SIDE:
        return None
    x = sides / TIP_HALF_WIDTH
    bend, slope, height = np.linalg.lstsq(np.vander(x, 3), z, rcond=None)[0]
    return float(bend) / TIP_HALF_WIDTH**2, float(slope) / TIP_HALF_WIDTH, float(height)


def _tip(profile: Profile) -> tuple[float, float]:
    """Flange tip without its noise [m]."""
    top = int(np.argmax(profile.z))
    at, height = float(profile.y[top]), float(profile.z[top])
    for _ in range(_TIP_ROUNDS):
        found = _parabola(profile, top, at)
        if found is None or found[0] >= 0.0:
            raise ProfileError("there are no points on both sides of the flange tip")
        bend, slope, height = found
        offset = float(np.clip(-0.5 * slope / bend, -0.5 * TIP_HALF_WIDTH, 0.5 * TIP_HALF_WIDTH))
        at, height = at + offset, height + (slope + bend * offset) * offset
        if abs(offset) < _CLOSE:
            break
    return at, height


def _tape_level(profile: Profile, dy: float) -> float:
    """Height of the tread 70 mm from the flange back once the profile is shifted by dy [m]."""
    tip = int(np.argmax(profile.z))
    index = tip + int(np.argmin(np.abs(profile.y[tip:] + dy)))
    found = _parabola(profile, index, -dy)
    if found is None:
        raise ProfileError("there is no tread on both sides of the tape circle")
    return found[2]


def _top_level(profile: Profile) -> float:
    """Height of the top of a rail head [m]."""
    top = int(np.argmin(profile.z))
    found = _parabola(profile, top, float(profile.y[top]))
    if found is None:
        raise ProfileError("there are no points on both sides of the top")
    bend, slope, height = found
    if bend <= 0.0:
        return height
    offset = float(np.clip(-0.5 * slope / bend, -TIP_HALF_WIDTH, TIP_HALF_WIDTH))
    return height + (slope + bend * offset) * offset


def _none(profile: Profile, reference: Profile) -> Move:  # noqa: ARG001 - one signature for all rules
    return Move(note="as measured, nothing moved")


def _by_tape_line(profile: Profile, reference: Profile) -> Move:  # noqa: ARG001
    level = _tape_level(profile, 0.0)
    return Move(dz=-level, note="z = 0 on the tread at y = 0; y as measured")


def _by_flange_tip(profile: Profile, reference: Profile, *, lateral: bool = False) -> Move:
    y, z = _tip(profile)
    ref_y, ref_z = _tip(reference)
    held = f"y and z of the flange tip as on {reference.name}"
    if not lateral:
        held = f"z of the flange tip as on {reference.name}; y as measured"
    return Move(dy=ref_y - y if lateral else 0.0, dz=ref_z - z, note=held)


def _by_flange_back(profile: Profile, reference: Profile) -> Move:
    dy, held = _back_shift(profile, reference)
    return Move(dy=dy, dz=-_tape_level(profile, dy), note=f"{held}; z = 0 on the tread at y = 0")


def _by_back_and_tip(profile: Profile, reference: Profile) -> Move:
    dy, held = _back_shift(profile, reference)
    return Move(dy=dy, dz=_tip(reference)[1] - _tip(profile)[1], note=f"{held}; z of the flange tip, too")


def _back_shift(profile: Profile, reference: Profile) -> tuple[float, str]:
    """Shift that lays the flange backs on each other [m], and what was held.

    Compared at equal depth below the tip, which wears as little as the back; the tread does wear.
    """
    tip_z, ref_tip_z = _tip(profile)[1], _tip(reference)[1]
    ref = prolonged(reference)
    end = int(np.argmax(ref.z)) + 1
    ref_y, ref_depth = ref.y[:end][::-1], ref_tip_z - ref.z[:end][::-1]
    down, out = np.diff(ref_depth), np.abs(np.diff(ref_y))
    back = np.flatnonzero((ref_depth[1:] >= BACK_FROM) & (down >= math.tan(STEEPEST) * out))
    if len(back) == 0:
        raise ProfileError(f"{reference.name} has no steep flange back")
    # the lowest stretch that is steep throughout
    run = back[np.flatnonzero(np.diff(back) > 1)[-1] + 1 :] if np.any(np.diff(back) > 1) else back
    part = slice(int(run[0]), int(run[-1]) + 2)
    shallow, deep = float(ref_depth[part][0]), float(ref_depth[part][-1])
    top = int(np.argmax(profile.z))
    depth, y = tip_z - profile.z[:top], profile.y[:top]
    use = (depth >= shallow) & (depth <= deep)
    count = int(np.count_nonzero(use))
    if count < FEWEST:
        raise ProfileError(
            f"the flange back is not measured: {count} points lie {shallow * 1e3:.3g} mm or more below the "
            f"flange tip behind it, {FEWEST} are needed"
        )
    dy = float(np.median(np.interp(depth[use], ref_depth[part], ref_y[part]) - y[use]))
    return dy, (
        f"y of the flange back ({count} points {shallow * 1e3:.3g} mm or more below the tip) as on "
        f"{reference.name}"
    )


def _by_top(profile: Profile, reference: Profile) -> Move:
    dz = _top_level(reference) - _top_level(profile)
    return Move(dz=dz, note=f"z of the top as on {reference.name}; y as measured")


def _by_best_fit(
    profile: Profile,
    reference: Profile,
    *,
    rotation: bool = False,
    zones: tuple[FitZone, ...] | None = None,
) -> Move:
    zones = zones or default_zones(reference)
    return best_fit(profile, reference, zones, rotation=rotation)


ALIGNMENTS: Mapping[str, AlignmentRule] = MappingProxyType(
    {
        "none": AlignmentRule(_none, ("wheel", "rail"), "as measured"),
        "flange_back": AlignmentRule(
            _by_flange_back, ("wheel",), "y by the flange back, z = 0 on the tread 70 mm from it"
        ),
        "back_and_tip": AlignmentRule(
            _by_back_and_tip, ("wheel",), "y by the flange back, z by the flange tip"
        ),
        "flange_tip": AlignmentRule(_by_flange_tip, ("wheel",), "z by the flange tip, y as measured"),
        "tape_line": AlignmentRule(_by_tape_line, ("wheel",), "z = 0 on the tread at y = 0, y as measured"),
        "best_fit": AlignmentRule(
            _by_best_fit, ("wheel", "rail"), "least squares on the parts that do not wear"
        ),
        "top": AlignmentRule(_by_top, ("rail",), "z by the top of the head, y as measured"),
    }
)
"""Rules of alignment by name."""

HOLD_TREAD = ("flange_back", "tape_line")
"""Rules that lay the tape circles on each other: what is worn there does not show."""
