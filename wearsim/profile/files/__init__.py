"""Input and output of profiles: MiniProf, SIMPACK, point lists of any program."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal, localcontext
from functools import partial
from pathlib import Path
from typing import NamedTuple, Unpack

from wearsim.errors import ProfileError, suggestion
from wearsim.profile import placement, standard
from wearsim.profile.files import miniprof, simpack
from wearsim.profile.files.axes import (
    ORIGINS,
    UNITS,
    Conversion,
    Statements,
)
from wearsim.profile.files.points import (
    Faults,
    Points,
    Text,
    one_line,
    read_points,
    read_text,
)
from wearsim.profile.shape import Kind, Profile
from wearsim.profile.smoothing import smoothed
from wearsim.whole_files import utf8, write_whole

_EXACT_DIGITS = 400  # enough to add 70 mm to any double without rounding


class Format(NamedTuple):
    """Profile format: its title, its reader and its recognition.

    A format is recognised by its content, else by its extension. Each extension has the
    kind of profile it implies, "" for both.
    """

    title: str
    read: Callable[[Text, Kind, Faults], Points]
    suffixes: Mapping[str, str]
    recognises: Callable[[Text], bool] | None = None


_GENSYS = {".wheel": "wheel", ".rail": "rail", ".kpf_rotr": "rail"}
FORMATS: dict[str, Format] = {
    "simpack": Format("SIMPACK", simpack.read, simpack.SUFFIXES, simpack.recognises),
    "miniprof": Format(
        "MiniProf", miniprof.read, miniprof.SUFFIXES, miniprof.recognises
    ),
    "gensys": Format("GENSYS", partial(read_points, towards_centre=True), _GENSYS),
    "uic519": Format("UIC 519 table", partial(read_points, upwards=True), {".dat": ""}),
    "two-column": Format("two columns", read_points, {}),
}
"""Formats that can be read, in the order in which they are tried."""


@dataclass(frozen=True)
class ProfileReading:
    """A profile from a file and what was detected on reading it."""

    # profile in wearsim's axes [m]; a rail is not yet placed in the track
    profile: Profile
    format: str  # key of `FORMATS`
    header: Mapping[str, str] = field(
        repr=False
    )  # keys and values of the file, unchanged
    notes: tuple[str, ...]  # what was detected, changed or left out
    lean: float | None = (
        None  # of a rail head towards the track centre, see `placement.head_lean` [-]
    )
    diameter: float | None = (
        None  # of a wheel at the running circle, that the instrument wrote down [m]
    )


def read_profile(
    path: str | Path,
    kind: Kind,
    *,
    content: str | None = None,
    **statements: Unpack[Statements],
) -> ProfileReading:
    """Read a profile from a file of any supported format, in wearsim's axes.

    Points are in the order along the profile.

    Parameters
    ----------
    path : str or Path
        Text of at most 20 MB and 10^6 points.
    kind : {"wheel", "rail"}
        Kind of the profile.
    content : str, optional
        Text of the file, by default read from it.
    **statements
        Data that the file lacks or states wrongly, see `Statements`.

    Raises
    ------
    ProfileError
        One line per fault, ``file:line: message``; what cannot be detected names the
        flag that settles it.
    """
    path = Path(path)
    stated = statements.get("format")
    _known("units", statements.get("units"), UNITS, path)
    _known("origin", statements.get("origin"), ORIGINS, path)
    _known("format", stated, FORMATS, path)
    text = read_text(path) if content is None else Text(tuple(content.split("\n")))
    suffix, faults = path.suffix.lower(), Faults(path)
    by_content = (
        key
        for key, file_format in FORMATS.items()
        if file_format.recognises and file_format.recognises(text)
    )
    by_suffix = (
        key for key, file_format in FORMATS.items() if suffix in file_format.suffixes
    )
    name: str = stated or next(by_content, None) or next(by_suffix, "two-column")
    stands_for = FORMATS[name].suffixes.get(suffix, "")
    if stands_for not in ("", kind):
        faults.add(f"{suffix} is a {stands_for}, a {kind} profile is needed")
    with localcontext(prec=_EXACT_DIGITS):
        points = FORMATS[name].read(text, kind, faults)
        faults.raise_any()
        conversion = Conversion(points, kind, statements, faults)
        y, z = conversion.result()
    lean = None if kind == "wheel" else placement.head_lean(y, z)
    leans = () if lean is None else (f"head {placement.lean_words(lean)}",)
    notes = (f"format {FORMATS[name].title}", *text.notes, *conversion.notes, *leans)
    shown = notes[1:] if name == "two-column" else notes
    source = f"file {path.name} ({'; '.join(shown)})" if shown else f"file {path.name}"
    diameter = miniprof.wheel_diameter(points.header) if kind == "wheel" else None
    return ProfileReading(
        Profile(utf8(path.stem), kind, y, z, source),
        name,
        points.header,
        notes,
        lean,
        diameter,
    )


def _known(key: str, value: str | None, names: Iterable[str], path: Path) -> None:
    """Raise an error for an unknown statement."""
    if value is not None and value not in names:
        hint = suggestion(value, names)
        raise ProfileError(
            f"{path}: {key} = {value!r} is not one of {', '.join(names)}{hint}"
        )


def load_profile(
    name_or_path: str | Path,
    kind: Kind,
    *,
    inclination: float = 0.0,
    gauge: float = 1.435,
    half_span: float = 0.750,
    spacing: float = 0.25e-3,
    smooth: float = 0.0,
    gauge_height: float = placement.GAUGE_DEPTH,
    **statements: Unpack[Statements],
) -> Profile:
    """Return a profile by the name of a standard shape or from a file.

    A rail is placed in the track.

    Parameters
    ----------
    name_or_path : str or Path
        A path by `is_file` is read with `read_profile` and its statements; any other
        text is the name or designation of a shipped shape, such as "S1002/h30".
    kind : {"wheel", "rail"}
        Required kind of the profile.
    inclination : float
        Of a rail towards the track centre [-]. A rail from a file is tilted as well,
        unless its head leans already, see `placement.tilt_to_add` (0: orientation as
        measured).
    gauge, half_span, spacing : float
        Placement of a rail, see `place_rail`; point distance of a shipped shape [m].
    smooth : float
        Wavelength below which a profile from a file is smoothed, see `smoothed` [m].
    gauge_height : float
        Depth below the top of the rail at which the gauge is measured, see
        `place_rail` [m].
    """
    name = str(name_or_path)
    if not is_file(name):
        if kind == "wheel":
            return standard.wheel(name, spacing)
        return standard.rail(name, inclination, gauge, half_span, spacing, gauge_height)
    reading = read_profile(name_or_path, kind, **statements)
    profile = smoothed(reading.profile, smooth)
    if kind == "wheel":
        return profile
    tilt = placement.tilt_to_add(reading.lean, inclination)
    return place_file(profile, name, tilt, gauge, half_span, gauge_height)


def is_file(name: str) -> bool:
    """Return True if a text is a path.

    A path is an existing file, or a name with a folder or an extension. Designations
    such as "S1002/h30" are not paths.
    """
    path = Path(name)
    looks_like_path = bool(path.suffix) or len(path.parts) != 1
    return os.path.isfile(name) or (
        looks_like_path and not standard.is_designation(name)
    )


def is_result(name: str | None) -> bool:
    """Return True if a name is that of a result file."""
    return name is not None and Path(name).suffix.lower() == ".nc"


def place_file(
    profile: Profile,
    name: str,
    tilt: float,
    gauge: float,
    half_span: float,
    gauge_height: float = placement.GAUGE_DEPTH,
) -> Profile:
    """Place a rail from the file `name` in the track, see `place_rail`.

    Faults name the file.
    """
    try:
        placed = placement.place_rail(profile, tilt, gauge, half_span, gauge_height)
    except ProfileError as error:
        raise ProfileError(f"{name}: {error}") from error
    return replace(placed, source=profile.source)


WRITTEN_FORMATS = {
    "two-column": {"wheel": ".csv", "rail": ".csv"},
    "miniprof": {kind: suffix for suffix, kind in miniprof.SUFFIXES.items()},
    "simpack": {kind: suffix for suffix, kind in simpack.SUFFIXES.items()},
}
"""Formats that can be written, with the usual extension by kind."""


def write_profile(
    profile: Profile,
    path: str | Path,
    format: str | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Write a profile.

    Parameters
    ----------
    profile : Profile
        Any profile with finite points.
    path : str or Path
        File to write; it is complete or not there.
    format : {"two-column", "miniprof", "simpack"}, optional
        By default that of the extension: MiniProf of `.whl` and `.ban`, SIMPACK of
        `.prw` and `.prr`, else two columns, comma-separated text in mm.
    overwrite : bool
        True if an existing file may be replaced.

    Raises
    ------
    ProfileError
        The format is not written, the extension is that of the other kind, or the file
        exists.
    ResultError
        The file cannot be written.

    Notes
    -----
    The file has the shortest decimals that represent the stored metres, moved by exact
    decimal arithmetic: `read_profile` returns the same bits.

    Examples
    --------
    >>> import wearsim
    >>> rail = wearsim.standard_profile("60E1")
    >>> wearsim.export_profile(rail, "60e1.ban")
    """
    path = Path(path)
    if format is None:
        suffix = path.suffix.lower()
        format = next(
            (
                name
                for name, suffixes in WRITTEN_FORMATS.items()
                if suffix in suffixes.values()
            ),
            "two-column",
        )
    _known("format", format, WRITTEN_FORMATS, path)
    kind = profile.kind
    stands_for = {**miniprof.SUFFIXES, **simpack.SUFFIXES}.get(
        path.suffix.lower(), kind
    )
    if stands_for != kind:
        raise ProfileError(
            f"{path}: {path.suffix} is the extension of a {stands_for}, "
            f"{profile.name!r} a {profile.kind}; rename it"
        )
    if path.exists() and not overwrite:
        raise ProfileError(
            f"{path}: exists already; choose another name or allow overwriting"
        )
    write_whole(path, text_of_profile(profile, path, format))


def text_of_profile(
    profile: Profile, path: Path, format: str, diameter: float | None = None
) -> str:
    """Text of the file that `write_profile` writes.

    A MiniProf file states the wheel diameter [m] if it is given.
    """
    return "\n".join(_lines(profile, path, format, diameter)) + "\n"


def _lines(
    profile: Profile, path: Path, format: str, diameter: float | None
) -> list[str]:
    """Lines of a file."""
    wheel, name = profile.kind == "wheel", profile.name
    points = [
        [Decimal(repr(float(c))).scaleb(3) for c in pair]
        for pair in zip(profile.y, profile.z, strict=True)
    ]
    if format == "two-column":
        axes = "z radially outward" if wheel else "z down"
        about = (
            f"{profile.kind} profile {name}; y to the field side, {axes}; "
            f"{profile.source}"
        )
        return [
            f"# {one_line(about)}",
            "y_mm,z_mm",
            *(f"{y:f},{z:f}" for y, z in points),
        ]
    # Name and source without characters that begin a comment in some format.
    about = one_line(f"{name}; {profile.source}" if profile.source else name)
    about = about.replace('"', "'").replace("!", "")
    if format == "simpack":
        title = f"{profile.kind} profile written by wearsim: {one_line(path.name)}"
        rows = [f"    {y:f} {z:f}" for y, z in points]
        # SIMPACK lists wheels from the field side to the flange
        return simpack.framed(
            rows[::-1] if wheel else rows, title, about.replace("'", ""), profile.kind
        )
    head = [
        f"Filename={one_line(path.name)}",
        "ProgramName=wearsim",
        f"XYPoints={len(points)}",
    ]
    head += [
        "ColumnDef=X,Y",
        f"UOF1={about}",
        f"{miniprof.AXIS_KEY}={miniprof.AXIS_FIELD}",
    ]
    if wheel:
        head.append(f"{miniprof.CIRCLE_KEY}={miniprof.RUNNING_CIRCLE}.0000")
        if diameter is not None:
            head.append(
                f"{miniprof.DIAMETER_KEY}={Decimal(repr(diameter)).scaleb(3):f}"
            )
        with localcontext(prec=_EXACT_DIGITS):
            return [
                *head,
                "",
                *(f"{y + miniprof.RUNNING_CIRCLE:f} {z:f}" for y, z in points),
            ]
    return [*head, "", *(f"{y:f} {z.copy_negate():f}" for y, z in points)]
