"""Layout of text tables from any program: encoding, separator, decimal mark, units.

The layout is detected and described in one line. The meaning of the numbers (sign,
unit, origin) is not: it is stated by the user, and a row of units is checked against
what is stated.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence

SEPARATORS = {
    ",": "commas",
    ";": "semicolons",
    "\t": "tabs",
    "|": "vertical bars",
    " ": "blanks",
}
"""Separators of columns with their names."""

COMMENTS = ("#", "!", "%", "//")
"""Marks at the beginning of comment lines."""

_SAMPLE = 200  # lines from which the separator is detected
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3})?")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d{1,3})?")
_GROUPED = re.compile(r"[+-]?\d{1,3}(\.\d{3})+(,\d+)?")
_NOT_A_NUMBER = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_TOKEN = (
    r"(?:[kMmuµμGnc]?(?:m|s|N|g|Hz|Pa|rad|W|J)|[kM]?N ?m+|[mk]?min|h|deg|in|kph|kmh|1)"
)
_UNIT = re.compile(
    rf"[\[(<{{].{{0,20}}[\])>}}]|[-°%‰]|{_TOKEN}(\^?-?\d)?([*·/. ]{_TOKEN}(\^?-?\d)?)*"
)
_ENDINGS = {
    "_mm2_per_1000km": "mm2/1000km",
    "_mm3_kJ": "mm3/kJ",
    "_kg_m3": "kg/m3",
    "_MN_m": "MN/m",
    "_MPa": "MPa",
    "_kN_m": "kNm",
    "_N_m": "Nm",
    "_Nm": "Nm",
    "_km_h": "km/h",
    "_m_s": "m/s",
    "_s_m": "s/m",
    "_per_km": "1/km",
    "_per_m": "1/m",
    "_percent": "%",
    "_mrad": "mrad",
    "_rad": "rad",
    "_GPa": "GPa",
    "_kN": "kN",
    "_N": "N",
    "_km": "km",
    "_mm": "mm",
    "_um": "um",
    "_m": "m",
    "_s": "s",
    "_h": "h",
    "_kg": "kg",
}
"""Unit by the end of a key."""
_SPELLINGS = {
    "kmh": "km/h",
    "kph": "km/h",
    "sec": "s",
    "rad/m": "1/m",
    "m-1": "1/m",
    "km-1": "1/km",
    "ms-1": "m/s",
}
_OTHER_UNITS = ("deg", "°", "cm", "in", "ms", "min", "MN", "g", "t", "kN/m")


def decoded(content: bytes) -> tuple[str, str]:
    """Text of a file with plain ends of lines, and its encoding.

    UTF-8 and UTF-16 with or without a byte order mark; else GBK, if all other bytes are
    pairs of Chinese characters, else Latin-1.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "UTF-16"
    elif (order := _null_bytes(content)) is not None:
        encoding = order
    else:
        encoding = "UTF-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        try:  # GB 2312 is the part of GBK that Latin-1 text hardly fits by chance
            text, encoding = content.decode("gb2312"), "GBK"
        except UnicodeDecodeError:
            text, encoding = content.decode("latin-1"), "Latin-1"
    plain = text.removeprefix("\ufeff").removesuffix("\x1a")  # end mark of DOS files
    name = encoding.removesuffix("-sig")
    return plain.replace("\r\n", "\n").replace("\r", "\n"), name


def _null_bytes(content: bytes) -> str | None:
    """UTF-16 without a mark: every second byte of Western text is zero."""
    head = content[:2000]
    if len(head) < 4 or b"\0" not in head:
        return None
    even, odd = head[::2].count(0), head[1::2].count(0)
    if odd > 0.4 * len(head[1::2]) and even == 0:
        return "UTF-16-LE"
    return "UTF-16-BE" if even > 0.4 * len(head[::2]) and odd == 0 else None


def is_number(cell: str) -> bool:
    """Return True if a cell holds a number with a decimal point or a decimal comma."""
    return bool(
        _NUMBER.fullmatch(cell)
        or _COMMA_NUMBER.fullmatch(cell)
        or _NOT_A_NUMBER.fullmatch(cell)
    )


def is_comment(line: str) -> bool:
    """Return True if a line begins with a mark of comments."""
    return line.lstrip().startswith(COMMENTS)


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of one line, without blanks around them."""
    if separator == " ":
        return line.split()
    reader = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [cell.strip() for cell in next(reader, [])]


def separator_of(lines: Sequence[str]) -> str:
    """Return the separator that divides most lines into equally many cells.

    Blanks separate only numbers; a table of one column has the separator ",".
    """
    sample = [line for line in lines if line.strip()][:_SAMPLE]
    numbers = [line.split() for line in sample if all(map(is_number, line.split()))]
    blanks = [cells for cells in numbers if len(cells) > 1]
    if 2 * len(blanks) > len(sample) and not any("\t" in line for line in sample):
        return " "
    best, highest = ",", 0.0
    for separator in (";", "\t", "|", ","):  # numbers hold commas, not semicolons
        counts = Counter(
            len(cells_of(line, separator)) if separator in line else 1
            for line in sample
        )
        most, times = max(counts.items(), key=lambda item: item[1], default=(1, 0))
        if most > 1 and times / len(sample) > highest:
            best, highest = separator, times / len(sample)
    return best


def with_points(cell: str) -> str:
    """Cell with a decimal point, if it is a number with a decimal comma."""
    return cell.replace(",", ".") if _COMMA_NUMBER.fullmatch(cell) else cell


def has_comma(cell: str) -> bool:
    """Return True if a cell is a number with a decimal comma."""
    return "," in cell and bool(_COMMA_NUMBER.fullmatch(cell))


def is_grouped(cell: str) -> bool:
    """Return True if points in a number with decimal commas may group thousands."""
    return bool(_GROUPED.fullmatch(cell))


def is_units(cells: Sequence[str]) -> bool:
    """Return True if all cells of a row are units, such as [kN] or m/s, or empty."""
    given = [cell for cell in cells if cell]
    brackets = any(cell[0] in "[(<{" for cell in given)
    return (
        (len(given) > 1 or brackets)
        and all(_UNIT.fullmatch(cell) for cell in given)
        and not all(map(is_number, given))
    )


def unit_named(text: str) -> str:
    """Return the unit of a cell in the spelling of keys, "" if it is not known."""
    plain = re.sub(r"[\[\](){}<>\s*·^]|(?<=N)\.", "", text).replace("µ", "u")
    plain = _SPELLINGS.get(plain.replace("μ", "u"), plain.replace("μ", "u"))
    return plain if plain in {*_ENDINGS.values(), *_OTHER_UNITS} else ""


def unit_of_key(key: str) -> str:
    """Return the unit that a key ends with, "" if it has none."""
    return next((unit for end, unit in _ENDINGS.items() if key.endswith(end)), "")


def contradicts(key: str, unit: str) -> bool:
    """Return True if the unit of a cell is known and not that of a key."""
    given, stated = unit_named(unit), unit_of_key(key)
    return bool(given and stated) and given != stated


def layout_words(
    encoding: str, separator: str, commas: bool, units_line: int | None, skipped: int
) -> str:
    """Describe a layout in one line; "" for UTF-8, commas and decimal points.

    `skipped` is the number of lines of text above the header.
    """
    words = [] if encoding == "UTF-8" else [f"text in {encoding}"]
    words += (
        [] if separator == "," else [f"columns separated by {SEPARATORS[separator]}"]
    )
    words += ["decimal commas"] if commas else []
    words += [] if units_line is None else [f"units in line {units_line}"]
    if skipped:
        lines = f"{skipped} lines" if skipped > 1 else "1 line"
        words.append(f"{lines} of text above the header left out")
    return ", ".join(words)
