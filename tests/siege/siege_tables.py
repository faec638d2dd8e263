"""Tables of points, wear, programmes, routes, records and sweeps with cells, columns or
bytes changed.
"""

import re
import shutil
from pathlib import Path

from siege import ROOT, chosen, command, damaged, judged
from siege_profiles import change_lines, change_number
from siege_scenes import SCENES, checked

HEAD = SCENES["rig"].partition("[wear]")[0]
END = "[campaign]\ndistance_km = 1\n"
FIELD = HEAD.replace('"rig"', '"field"').replace("roller_radius_mm = 1000", "")
DATA = Path(__file__).parent / "tables"
OF_ROUTE = (DATA / "end_of_route.toml").read_text()
OF_WEAR = '[wear]\nlaw = "table"\ntable_file = "table.csv"\n'
WAYS = {
    "points of contact": DATA / "points.csv",
    "wear table": DATA / "wear.csv",
    "programme": DATA / "programme.csv",
    "route": DATA / "route.csv",
    "record": ROOT / "workflows/recorded.csv",
    "table of a sweep": DATA / "sweep.csv",
}
"""What is attacked, and its valid file."""
CELLS = (
    "",
    " ",
    "nan",
    "inf",
    "-1",
    "0",
    "1e400",
    "1e300",
    "1e-300",
    "x",
    "=1+1",
    "µ",
    "true",
    "1;2",
    '"',
    '"a',
    "1,5",
    "'1",
    "9" * 400,
    "\u202e",
    "a\x00",
    "0x10",
    "1_000",
    "١",
    "None",
    "1979-05-27",
    "a" * 500,
)


OF_CELLS = ("put",) * 3 + (
    "column removed",
    "column doubled",
    "column moved",
    "name",
    "swapped",
)


def change_cell(content, random):
    """Another cell, or column: of another kind, removed, doubled, moved."""
    rows = [line.split(b",") for line in content.split(b"\n")]
    row = int(random.integers(len(rows)))
    column = int(random.integers(len(rows[row])))
    how = chosen(random, OF_CELLS)
    if how in ("put", "name"):
        row, column = (0, column % len(rows[0])) if how == "name" else (row, column)
        rows[row][column] = chosen(random, CELLS).encode()
    for cells in rows if how.startswith("column") else ():
        if column < len(cells):
            cell = cells[column] if how == "column doubled" else cells.pop(column)
            cells[:0] = [] if how == "column removed" else [cell]
    if how == "swapped":
        other = int(random.integers(len(rows[row])))
        rows[row][column], rows[row][other] = rows[row][other], rows[row][column]
    return b"\n".join(b",".join(cells) for cells in rows)


CHANGES = (change_cell, change_cell, change_number, change_lines, damaged)


def attack(way, random, folder):
    """Use one table that was changed."""
    content = WAYS[way].read_bytes()
    for _ in range(int(random.integers(1, 4))):
        if re.search(rb"\d", content):
            content = chosen(random, CHANGES)(content, random)
    (folder / "table.csv").write_bytes(content)
    if way == "points of contact":
        return judged(
            *command("contact", "--table", "table.csv", "--json"), "table.csv"
        )
    if way == "table of a sweep":
        shutil.copy(ROOT / "workflows/rig_given.toml", folder)
        code, out, printed = command(
            "sweep", "rig_given.toml", "--table", "table.csv", "--list"
        )
        # the list has a line for each case, a possible one or not
        return judged(
            code,
            out if code == 0 else "",
            printed if code == 0 else out + printed,
            "rig_given.toml",
            "table.csv",
        )
    if way == "record":
        scene = SCENES["recorded"].replace("recorded.csv", "table.csv")
    elif way == "programme":
        scene = HEAD + '[operation]\nprogramme = "table.csv"\n' + END
    elif way == "wear table":
        scene = re.sub(r"(?s)\[wear\].*?\n(?=\[\[?operation)", OF_WEAR, SCENES["rig"])
    else:
        scene = FIELD + OF_ROUTE + END
    (folder / "scene.toml").write_text(scene)
    return checked("scene.toml", random, "table.csv")
