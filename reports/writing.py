"""How the scripts of this folder write their reports.

Report.md.j2 with tables and figures, CSV, SVG.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

HERE = Path(__file__).parent
RULES = {"l": "---", "r": "---:", "c": ":---:"}


@dataclass(frozen=True)
class Table:
    """Table of a report.

    Titles of the columns, cells as they are written, caption above.

    `align` is "l", "r" or "c" for each column; if not given, the first one stands left,
    the others right.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    align: str = ""
    caption: str = ""

    @property
    def rule(self) -> list[str]:
        """Line below the head."""
        return [
            RULES[letter] for letter in self.align or "l" + "r" * (len(self.head) - 1)
        ]


@dataclass(frozen=True)
class Figure:
    """Figure of a report.

    SVG file in its folder, caption, text for who cannot see it (or the caption).
    """

    file: str
    caption: str
    alternative: str = ""


def options(
    script: str,
    description: str | None,
    arguments: Sequence[str] | None = None,
    from_csv: bool = False,
    more: Mapping[str, Mapping[str, Any]] | None = None,
) -> argparse.Namespace:
    """Options of a script.

    `out`, made if it is not there, and `from_csv` if it can write from its table.

    `more` are options of its own: what `add_argument` takes, by name.
    """
    parser = argparse.ArgumentParser(
        prog=f"python reports/{Path(script).name}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        default=HERE,
        help="folder (default: this script's)",
    )
    if from_csv:
        text = "compute nothing: write from the CSV file"
        parser.add_argument("--from-csv", action="store_true", help=text)
    for name, given in (more or {}).items():
        parser.add_argument(f"--{name}", **given)
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    return chosen


def write_report(
    out: Path, script: str, title: str, blocks: Sequence[str | Table | Figure]
) -> Path:
    """Write a report in Markdown under the name of its script (`__file__`).

    Returns the file.

    A block of text is Markdown: a paragraph, a heading, a list.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    command = f"python reports/{Path(script).name}"
    text = environment.get_template("report.md.j2").render(
        title=title, command=command, blocks=blocks
    )
    path = out / f"{Path(script).stem}.md"
    path.write_text(text, encoding="utf-8")
    return path


def write_csv(table: pd.DataFrame, path: Path, number: str = "%.6g") -> None:
    """Write a table without its index, floats in the given format, NaN as nothing."""
    table.to_csv(path, index=False, float_format=number, lineterminator="\n")
