"""How the scripts of this folder write their reports: report.md.j2 with tables and figures, CSV, SVG."""

import argparse
import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2

from wearsim.report.style import save_svg

HERE = Path(__file__).parent
RULES = {"l": "---", "r": "---:", "c": ":---:"}


@dataclass(frozen=True)
class Table:
    """Table of a report.

    Parameters
    ----------
    head : sequence of str
        Titles of the columns.
    rows : sequence of sequences
        Cells, written as they are.
    align : str, optional
        "l", "r" or "c" for each column; if not given, the first one stands left and the others right.
    caption : str, optional
        Above the table.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    align: str = ""
    caption: str = ""

    @property
    def rule(self) -> list[str]:
        """Line below the head."""
        return [RULES[letter] for letter in self.align or "l" + "r" * (len(self.head) - 1)]


@dataclass(frozen=True)
class Figure:
    """Figure of a report: SVG file in its folder, caption, text for who cannot see it (or the caption)."""

    file: str
    caption: str
    alternative: str = ""


def options(
    script: str, description: str | None, arguments: Sequence[str] | None = None, from_csv: bool = False
) -> argparse.Namespace:
    """Options of a script: `out`, made if it is not there, and `from_csv` if it can write from its table."""
    parser = argparse.ArgumentParser(
        prog=f"python reports/{Path(script).name}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--out", metavar="DIR", type=Path, default=HERE, help="folder (default: this script's)"
    )
    if from_csv:
        parser.add_argument(
            "--from-csv", action="store_true", help="compute nothing: write from the CSV file"
        )
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    return chosen


def output_folder(script: str, description: str | None, arguments: Sequence[str] | None = None) -> Path:
    """Folder of a script's option --out, made if it is not there; without the option the script's own."""
    out: Path = options(script, description, arguments).out
    return out


def write_report(out: Path, script: str, title: str, blocks: Sequence[str | Table | Figure]) -> Path:
    """Write a report in Markdown under the name of its script.

    Parameters
    ----------
    out : Path
        Folder.
    script : str
        File of the script (`__file__`).
    title : str
        Heading.
    blocks : sequence of str, Table or Figure
        In the order of the report; text is Markdown: a paragraph, a heading, a list.

    Returns
    -------
    Path
        The file.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    command = f"python reports/{Path(script).name}"
    text = environment.get_template("report.md.j2").render(title=title, command=command, blocks=blocks)
    path = out / f"{Path(script).stem}.md"
    path.write_text(text, encoding="utf-8")
    return path


def write_csv(path: Path, rows: Sequence[Mapping[str, object]], number: str = "%.6g") -> Path:
    """Write rows as CSV, floats in the given format, NaN as nothing; the first row names the columns."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({name: _cell(value, number) for name, value in row.items()})
    return path


def _cell(value: object, number: str) -> object:
    if isinstance(value, float):
        return "" if math.isnan(value) else number % value
    return value


def read_csv(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file, without lines that start with #."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


__all__ = [
    "HERE",
    "Figure",
    "Table",
    "options",
    "output_folder",
    "read_csv",
    "save_svg",
    "write_csv",
    "write_report",
]
