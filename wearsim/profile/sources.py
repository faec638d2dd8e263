"""Profiles by the name of a standard shape or from a file, placed in the track."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

from wearsim.errors import Fault, ProfileError, issue_warning
from wearsim.profile import standard
from wearsim.profile.files import load_profile
from wearsim.profile.files.axes import Statements
from wearsim.profile.placement import BACK_TO_BACK, GAUGE, INCLINATION, RUNNING_CIRCLE
from wearsim.profile.point_noise import noise_note
from wearsim.profile.shape import Kind, Profile
from wearsim.quantities import QUANTITIES


def half_span(back_to_back: float) -> float:
    """Lateral position of the wheel's origin from the track centre [m].

    It is half the back-to-back distance plus the 70 mm from the flange back to the
    running circle. Raises `ProfileError` for a distance out of its range.
    """
    if fault := QUANTITIES["back_to_back"].fault(back_to_back):
        raise ProfileError(fault)
    return 0.5 * back_to_back + RUNNING_CIRCLE


def standard_profile(
    name: str,
    *,
    inclination: float = INCLINATION,
    gauge: float = GAUGE,
    back_to_back: float = BACK_TO_BACK,
    spacing: float = 0.25e-3,
) -> Profile:
    """Profile of a standard shape.

    Parameters
    ----------
    name : str
        Such as "S1002", "S1002/h30/e30.5" (flange height and thickness [mm]) or "60E1".
    inclination : float
        Tangent of a rail's tilt towards the track centre [-].
    gauge : float
        Distance of the gauge points of both rails [m].
    back_to_back : float
        Of the wheelset on the rails: it fixes the origin of the wheel profile, which is
        that of the rail [m].
    spacing : float
        Point distance along the profile [m].

    Returns
    -------
    Profile
        In metres; a rail is placed in the track.

    Raises
    ------
    ProfileError
        There is no such shape, or a parameter is out of range.

    Examples
    --------
    >>> import wearsim
    >>> wheel = wearsim.standard_profile("S1002/h30/e30.5")
    >>> wheel.kind
    'wheel'
    >>> wearsim.standard_profile("60E1", inclination=1 / 20).kind
    'rail'
    """
    if standard.definition(name).kind == "wheel":
        return standard.wheel(name, spacing)
    return standard.rail(name, inclination, gauge, half_span(back_to_back), spacing)


def read_profile(
    path: str | Path,
    kind: Kind,
    *,
    inclination: float = INCLINATION,
    gauge: float = GAUGE,
    back_to_back: float = BACK_TO_BACK,
    smooth: float = 0.0,
    **statements: Unpack[Statements],
) -> Profile:
    """Read a profile from a file of any known format.

    Parameters
    ----------
    path : str or Path
        MiniProf, SIMPACK, GENSYS, UIC 519 or columns of points.
    kind : {"wheel", "rail"}
        Kind of the profile.
    inclination : float
        Tangent of a rail's tilt towards the track centre; a head measured as it leans
        in the track is not tilted again [-].
    gauge, back_to_back : float
        As of `standard_profile` [m].
    smooth : float
        Wavelength below which the profile is smoothed; without it a `WearsimWarning`
        names one if noise of the points would change contact pressures by more than
        5 % [m].
    **statements
        Data that the file lacks or states wrongly: `format`, `units`, `mirror`, `z_up`,
        `origin`, see `wearsim.profile.files.axes.Statements`.

    Returns
    -------
    Profile
        In metres; a rail is placed in the track. Its `source` lists what was detected.

    Raises
    ------
    ProfileError
        One line per fault, ``file:line: message``.

    Examples
    --------
    >>> import wearsim
    >>> wearsim.export_profile(wearsim.standard_profile("S1002"), "wheel.whl")
    >>> wearsim.read_profile("wheel.whl", "wheel").name
    'wheel'
    """
    path = Path(path)
    unknown = [name for name in statements if name not in Statements.__annotations__]
    if unknown:
        allowed = ", ".join(Statements.__annotations__)
        raise ProfileError(
            f"{path}: {unknown[0]} is no statement on a file; known: {allowed}"
        )
    if not path.is_file():
        raise ProfileError(f"{path} does not exist or is no file; give a profile file")
    span = half_span(back_to_back)
    profile = load_profile(
        path,
        kind,
        inclination=inclination,
        gauge=gauge,
        half_span=span,
        smooth=smooth,
        **statements,
    )
    if not smooth and (note := noise_note(profile)):
        issue_warning(Fault(f"{note} (smooth)", str(path)))
    return profile
