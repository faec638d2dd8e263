"""Shipped, measured and written profile files of all formats with bytes changed,
through `read_profile`.
"""

import re
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from siege import ACCEPTED, REFUSED, ROOT, chosen, damaged, require

from wearsim.errors import ProfileError
from wearsim.profile.checks import points_faults
from wearsim.profile.files import FORMATS, read_profile, write_profile
from wearsim.profile.standard import rail, wheel

WAYS = ("bytes", "numbers", "lines", "cut off", "garbage", "statements")
SUFFIXES = sorted({s for each in FORMATS.values() for s in each.suffixes} | {".csv"})
WORDS = (
    "1 2",
    "-70,9.5",
    "nan 1",
    "x=1",
    "ColumnDef=A",
    "",
    "[Profile1Points]",
    "point.begin",
    '"',
    "spline.begin",
    "spline.end",
    "'a'",
    "0 1",
    "1e999 2",
    "(Sd/Sh/qR)",
    "XYPoints=9",
    "[",
    "=",
)
FACTORS = (-1, 0, 10, 25.4, 1e3, 1e-3, 1e300, 1.1, 1.01, 0.99, 1.001, 0.999)
NUMBERS = (
    "nan",
    "inf",
    "1e400",
    "-0",
    "1e-400",
    "9" * 400,
    "",
    "x",
    "1,5",
    "0x10",
    "1_0",
    "١",
    "1e5",
    "--1",
    "1.2.3",
)


@cache
def wheel_and_rail():
    """Profiles that the written files hold."""
    return wheel("S1002", spacing=1e-3), rail(
        "60E1", 1 / 40, 1.435, 0.750, spacing=1e-3
    )


@cache
def valid_files():
    """Valid files of every format, those of profiles/measured among them: name, kind
    and content.
    """
    with tempfile.TemporaryDirectory() as place:
        files = []
        for profile, suffixes in zip(
            wheel_and_rail(),
            (("csv", "whl", "prw"), ("csv", "ban", "prr")),
            strict=True,
        ):
            for name, suffix in zip(
                ("two-column", "miniprof", "simpack"), suffixes, strict=True
            ):
                path = Path(place) / f"{profile.kind}.{suffix}"
                write_profile(profile, path, name)
                files.append((path.name, profile.kind, path.read_bytes()))
    head = wheel_and_rail()[1]
    points = "\n".join(
        f"{y:.3f} {-z:.3f}" for y, z in zip(1e3 * head.y, 1e3 * head.z, strict=True)
    )
    text = (
        f"[FileInfo]\n[Profile1Info]\nMPDN=a\n[Profile1Points]\n{points}\n"
        f"[Profile2Points]\n{points}\n"
    )
    files.append(("two.mpt", "rail", text.encode()))
    listed = "0 1\n2\n0 0 0\n1\n0.0 'rail.prr'\n1.0 'rail.ban'\n"
    files.append(("two.slcs", "rail", listed.encode()))
    for path in sorted((ROOT / "profiles/measured").glob("*_worn_*")):
        files.append((path.name, path.name.split("_")[0], path.read_bytes()))
    return files


def attempt(path, kind, **statements):
    """Read a file; a profile that comes out is a valid one, an error is plain lines
    with the file.
    """
    try:
        reading = read_profile(path, kind, **statements)
    except ProfileError as error:
        for line in str(error).splitlines():
            require(
                line.startswith((str(path), str(path.parent))), "names no file", line
            )
            require(line.isprintable() and len(line) < 1000, repr(line))
        return None
    profile = reading.profile
    require(
        np.all(np.isfinite(profile.y)) and np.all(np.isfinite(profile.z)), "not finite"
    )
    require(
        points_faults(kind, profile.y, profile.z) == [],
        points_faults(kind, profile.y, profile.z),
    )
    return profile


def change_number(content, random):
    """Another number at some place: scaled, of no use, or none."""
    found = list(re.finditer(rb"-?\d+\.?\d*(?:e-?\d+)?", content))
    number = chosen(random, found)
    scaled = float(number[0]) * chosen(random, FACTORS)
    put = (
        f"{scaled:.6g}".encode()
        if random.random() < 0.7
        else chosen(random, NUMBERS).encode()
    )
    return content[: number.start()] + put + content[number.end() :]


def change_lines(content, random):
    """Remove, double, reverse, move or thin out some lines."""
    lines = content.split(b"\n")
    at = int(random.integers(len(lines) + 1))
    end = min(at + int(random.choice([1, 3, 10, len(lines)])), len(lines))
    how = chosen(
        random,
        ("removed", "doubled", "reversed", "moved", "thinned", "blank", "joined"),
    )
    part = lines[at:end]
    changed = {
        "removed": lines[:at] + lines[end:],
        "doubled": lines[:end] + lines[at:],
        "reversed": lines[:at] + part[::-1] + lines[end:],
        "moved": part + lines[:at] + lines[end:],
        "thinned": lines[:at] + part[:: int(random.integers(2, 20))] + lines[end:],
        "blank": [*lines[:at], *[b""] * int(random.integers(50)), *lines[at:]],
        "joined": [*lines[:at], b" ".join(part), *lines[end:]],
    }
    return b"\n".join(changed[how])


def garbage(random):
    """Bytes, text or words of the formats without their sense."""
    size = int(random.integers(400))
    how = chosen(random, ("bytes", "text", "words"))
    if how == "bytes":
        return random.bytes(size)
    if how == "text":
        return "".join(map(chr, random.integers(0x3000, size=size))).encode(
            "utf-8", "surrogatepass"
        )
    return "\n".join(chosen(random, WORDS) for _ in range(size // 8)).encode()


def statements_of(name, random, many):
    """Statements with which a file is read: those it needs, or any."""
    stated = {"part": chosen(random, (1, 2, None, "a"))} if name.endswith("mpt") else {}
    stated |= {"slice": chosen(random, (1, 2, None))} if name.endswith("slcs") else {}
    options = {
        "format": [*FORMATS, "x"],
        "units": ["mm", "m", "cm", "in", "x"],
        "mirror": [True, False],
        "z_up": [True, False],
        "origin": ["running_circle", "flange_back", "x"],
        "part": [0, -1, 10**9, "a"],
        "slice": [0, -1, 10**9],
    }
    taken = [key for key in options if many and random.random() < 0.3]
    return stated | {key: chosen(random, options[key]) for key in taken}


def attack(way, random, folder):
    """Read one file that was changed."""
    name, kind, content = chosen(random, valid_files())
    whole = content
    for other, _, text in valid_files():
        if other in ("rail.prr", "rail.ban"):
            (folder / other).write_bytes(text)
    changes = {"bytes": damaged, "numbers": change_number, "lines": change_lines}
    if way == "cut off":
        # a cut within the digits of the last point only cannot be seen in MiniProf
        content = content[: int(random.integers(content.rstrip().rfind(b"\n")))]
    elif way == "garbage":
        content, name = garbage(random), f"f{chosen(random, SUFFIXES)}"
    else:
        for _ in range(int(random.integers(0 if way == "statements" else 1, 4))):
            if re.search(rb"\d", content):
                content = changes.get(way, damaged)(content, random)
    (folder / name).write_bytes(content)
    read = attempt(
        folder / name, kind, **statements_of(name, random, way == "statements")
    )
    if way == "cut off" and (b"XYPoints" in whole or name.endswith(("prw", "prr"))):
        require(read is None, "a file that is cut off was read")
    require(read is None or way != "garbage", "garbage was read")
    return REFUSED if read is None else ACCEPTED
