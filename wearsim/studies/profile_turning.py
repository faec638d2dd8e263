"""A measured wheel, or the two of an axle, turned to a template."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.profile.measures import Measures, tape_level
from wearsim.profile.shape import Profile
from wearsim.profile.turning import Turning, turn, turn_axle
from wearsim.studies.profile_examination import Examination
from wearsim.studies.profile_subject import Subject


@dataclass(frozen=True)
class TurnedWheel:
    """One wheel after turning.

    Parameters
    ----------
    side : str
        "right", "left", or "" of a wheel by itself.
    turning : Turning
        To the template.
    diameter : float or None
        At the tape circle afterwards [m]; None where that of the worn wheel is not known.
    """

    side: str
    turning: Turning
    diameter: float | None

    @property
    def diameter_loss(self) -> float:
        """Loss on the lathe [m]."""
        return 2.0 * self.turning.radius_loss

    @property
    def slack(self) -> float:
        """Radius lost to the partner alone [m]."""
        return self.turning.slack


def turned(found: Examination, template: Subject) -> tuple[TurnedWheel, ...]:
    """Turn what was examined: both wheels of an axle to one diameter.

    Parameters
    ----------
    found : Examination
        Of a wheel, with the left one if it differs.
    template : Subject
        What the wheels get.

    Returns
    -------
    tuple of TurnedWheel
        One, or right and left. Of an axle with a diameter that is not known, both are taken for equal at
        their tape circles.

    Raises
    ------
    ProfileError
        See `wearsim.profile.turning.turn`.
    """
    right = found.subject.profile
    diameter = _diameter(found.measures)
    if found.left is None:
        one = turn(right, template.profile)
        return (TurnedWheel("", one, None if diameter is None else diameter - 2.0 * one.radius_loss),)
    left, other = found.left.profile, _diameter(found.left_measures)
    known = diameter is not None and other is not None
    radii = (
        _radius_at_zero(right, diameter if known else None),
        _radius_at_zero(left, other if known else None),
    )
    both = turn_axle(right, left, (template.profile, template.profile), radii)
    return tuple(
        TurnedWheel(side, one, before - 2.0 * one.radius_loss if known and before is not None else None)
        for side, one, before in zip(("right", "left"), both, (diameter, other), strict=True)
    )


def _diameter(measures: Measures | None) -> float | None:
    return None if measures is None else measures.values.get("wheel_diameter")


def _radius_at_zero(profile: Profile, diameter: float | None) -> float:
    """Return the rolling radius at z = 0; relative to the tape circle where none is known [m]."""
    return 0.5 * (diameter or 0.0) - tape_level(profile.y, profile.z)
