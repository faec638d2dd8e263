"""Writers of profile files; a file is complete or not there, and read back to the bit."""

from __future__ import annotations

import os
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.formats import known_format, miniprof, simpack
from wearsim.profile.formats.orientation import TAPE
from wearsim.profile.formats.points import EXACT
from wearsim.profile.shape import Profile

_ENDING = {'"': "'", "!": ""}  # marks that begin a comment in some format


def write(profile: Profile, path: Path, name: str, *, overwrite: bool) -> None:
    """Write a profile in one of the formats of `WRITERS`.

    Parameters
    ----------
    profile : Profile
        Any profile with finite points.
    path : Path
        File to write.
    name : str
        Key of `WRITERS`.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ProfileError
        The format is not written, the extension is that of the other kind, the file exists or cannot be
        written, or a point is not finite.
    """
    known_format(name, {key: key for key in WRITERS}, path)
    if not (np.all(np.isfinite(profile.y)) and np.all(np.isfinite(profile.z))):
        raise ProfileError(
            f"{path}: profile {profile.name!r} holds points that are not finite; nothing was written"
        )
    stands_for = {**miniprof.SUFFIXES, **simpack.SUFFIXES}.get(path.suffix.lower(), profile.kind)
    if stands_for != profile.kind:
        raise ProfileError(
            f"{path}: {path.suffix} is the extension of a {stands_for}, {profile.name!r} is a "
            f"{profile.kind}; choose another name"
        )
    if path.exists() and not overwrite:
        raise ProfileError(f"{path}: exists already; choose another name or allow overwriting")
    text = "\n".join(WRITERS[name](profile, path)) + "\n"
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ProfileError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error


def _about(profile: Profile) -> str:
    """Name and source in one line, without the marks that begin a comment."""
    text = f"{profile.name}; {profile.source}" if profile.source else profile.name
    return "".join(_ENDING.get(mark, mark) for mark in _one_line(text))


def _one_line(text: str) -> str:
    """Text with single blanks and without characters that no reader takes."""
    return " ".join("".join(mark if mark.isprintable() else " " for mark in text).split())


def _two_column(profile: Profile, path: Path) -> list[str]:  # noqa: ARG001
    axes = "z radially outward" if profile.kind == "wheel" else "z down"
    about = _one_line(f"{profile.kind} profile {profile.name}; y to the field side, {axes}; {profile.source}")
    rows = zip(profile.y, profile.z, strict=True)
    return [f"# {about}", "y_mm,z_mm", *(f"{_plain(_mm(y))},{_plain(_mm(z))}" for y, z in rows)]


def _miniprof(profile: Profile, path: Path) -> list[str]:
    wheel = profile.kind == "wheel"
    header = [
        f"Filename={_one_line(path.name)}",
        "ProgramName=wearsim",
        f"XYPoints={len(profile.y)}",
        "ColumnDef=X,Y",
        f"UOF1={_about(profile)}",
        f"{miniprof.AXIS_KEY}={miniprof.AXIS_FIELD}",
    ]
    if wheel:
        header.append(f"WheelDiameterTaperline={TAPE}.0000")
    rows = []
    for y, z in zip(profile.y, profile.z, strict=True):
        x = EXACT.add(_mm(y), TAPE) if wheel else _mm(y)
        up = _mm(z) if wheel else _mm(z).copy_negate()
        rows.append(f"{_plain(x)} {_plain(up)}")
    return [*header, "", *rows]


def _simpack(profile: Profile, path: Path) -> list[str]:
    wheel = profile.kind == "wheel"
    comment = _about(profile).replace("'", "")
    header = [
        f"! {profile.kind} profile written by wearsim: {_one_line(path.name)}",
        "header.begin",
        "  version       = 1",
        f"  type          = {int(wheel)}",
        "header.end",
        "spline.begin",
        "  approx.smooth  = 0",
        f"  comment        = '{comment}'",
        f"  type           = {int(wheel)}",
        "  point.dist.min = 0",
        "  shift.y        = 0",
        "  shift.z        = 0",
        "  rotate         = 0",
        "  bound.y.min    = 1",
        "  bound.y.max    = 0",
        "  bound.z.min    = 1",
        "  bound.z.max    = 0",
        "  mirror.y       = 0",
        "  mirror.z       = 0",
        "  inversion      = 0",
        "  units.len.f    = 1000",
        "  units.ang.f    = 1",
        "  point.begin",
    ]
    rows = [f"    {_plain(_mm(y))} {_plain(_mm(z))}" for y, z in zip(profile.y, profile.z, strict=True)]
    # SIMPACK lists wheels from the field side to the flange
    return [*header, *(rows[::-1] if wheel else rows), "  point.end", "spline.end"]


def _mm(metres: float) -> Decimal:
    """Exact decimal of the shortest representation, times 1000."""
    return Decimal(repr(float(metres))).scaleb(3)


def _plain(value: Decimal) -> str:
    """Digits without exponent."""
    return f"{value:f}"


WRITERS: dict[str, Callable[[Profile, Path], list[str]]] = {
    "two-column": _two_column,
    "miniprof": _miniprof,
    "simpack": _simpack,
}
