"""What deserves a second look in solutions of `wearsim contact`."""

from __future__ import annotations

from functools import lru_cache

from wearsim.cli.contact_flags import Settings
from wearsim.cli.contact_points import PointResult, rail_profile, wheel_profile

_PLASTIC = 4e9
"""Maximum pressure [Pa] above which an elastic contact is no answer: a surface is fully plastic at a mean
pressure of 2.8 times the yield stress (K. L. Johnson, Contact Mechanics, 1985, 6.3), in an ellipse two thirds
of the maximum; with 0.95 GPa, high for wheel and rail steel, that is 4 GPa."""


@lru_cache(maxsize=64)
def _clearance(wheel: str, rail: str, inclination: float, gauge: float, half_span: float) -> float | None:
    from wearsim.profile.conicity import flange_clearance

    return flange_clearance(wheel_profile(wheel), rail_profile(rail, inclination, gauge, half_span))


def _clearance_of(settings: Settings) -> float | None:
    return _clearance(settings.wheel, settings.rail, settings.inclination, settings.gauge, settings.half_span)


@lru_cache(maxsize=64)
def _stand(rail: str, inclination: float) -> str | None:
    """Tell how a measured rail is put into the track, None for standard shapes."""
    from wearsim.profile.files import is_file
    from wearsim.profile.inspection.inputs import placement_notes, read_input

    told = placement_notes(read_input(rail, "rail"), inclination) if is_file(rail) else ()
    return told[0] if told else None


def notes(result: PointResult) -> list[str]:
    """Tell what deserves a second look in one solved point, one line each.

    Parameters
    ----------
    result : PointResult
        Of any point.

    Returns
    -------
    list of str
        On a measured rail, a wheel that climbs its flange, pressures no steel carries, and a roller that
        runs in a curve.
    """
    return list(_kinds(result).values())


def _kinds(result: PointResult) -> dict[str, str]:
    """Return the notes by kind, so that those of many rows can be put together."""
    point = result.point
    found = {}
    stand = _stand(point.settings.rail, point.settings.inclination)
    if stand is not None:
        found["measured rail"] = f"{point.settings.rail}: {stand}"
    free = _clearance_of(point.settings)
    towards = {"right": point.shift, "left": -point.shift}
    climbing = [side for side in dict.fromkeys(p.side for p in result.patches) if free is not None
                and towards[side] > free]  # fmt: skip
    if climbing and free is not None:
        found["flange clearance"] = (
            f"shift {1e3 * point.shift:g} mm is beyond the flange clearance of {1e3 * free:.3g} mm: the "
            f"{climbing[0]} wheel climbs its flange, which a wheelset in service does only while it derails"
        )
    highest = max(patch.values["max_pressure"] for patch in result.patches)
    if highest > _PLASTIC:
        found["pressure"] = (
            f"maximum pressure {1e-9 * highest:.3g} GPa: wheel and rail steel yields far below "
            f"{1e-9 * _PLASTIC:g} GPa, and an elastic contact is no answer; check load and profiles"
        )
    if point.track_curvature != 0.0 and point.settings.curvature > 0.0:
        found["curve"] = (
            "a curve radius on a roller stands for rollers of both sides that turn at different speeds"
        )
    return found


class Notes:
    """Notes on the rows of a table, put together by kind."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[int, str]] = {}
        self._count: dict[str, int] = {}

    def add(self, line: int, result: PointResult) -> None:
        """Take the notes on the row of a line."""
        for kind, note in _kinds(result).items():
            self._first.setdefault(kind, (line, note))
            self._count[kind] = self._count.get(kind, 0) + 1

    def told(self) -> list[str]:
        """One line per kind: the first row that has it, and how many more."""
        lines = []
        for kind, (line, note) in self._first.items():
            more = self._count[kind] - 1
            rows = "" if more == 0 else f" ({more} more row{'s' if more > 1 else ''} like it)"
            lines.append(f"line {line}: {note}{rows}")
        return lines
